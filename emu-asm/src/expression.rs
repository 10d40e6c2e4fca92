//! Expressions: operators with the dialect's precedence, and names that the caller resolves.

use std::ops::Range;

use crate::dialect::{AsmArithmetic, AsmDialect, AsmOperator};
use crate::fault::LineFault;
use crate::lines::{begins_name, byte, piece, skip_space};
use crate::number::{self, read_quoted};
use crate::value::AsmValue;

/// Resolves names for the expression parser.
pub(crate) trait NameValues {
    /// Returns the value of the name at `at`.
    fn value_of_name(&mut self, name: &str, at: Range<usize>) -> Result<AsmValue, LineFault>;
    /// Returns the location counter for one of its names.
    fn location_counter(&self, token: &str) -> i64;
    /// Returns the radix of a number without a mark.
    fn radix(&self) -> u32;
    /// Returns how values are divided, shifted and compared.
    fn arithmetic(&self) -> AsmArithmetic;
    /// Returns the internal name of the local label `1:` that `1f` or `1b` refers to, or that of `12$`.
    fn local_label_name(&self, digits: &str, way: u8) -> String;
}

/// The maximum nesting of parentheses.
const MAX_DEPTH: u32 = 64;

/// Evaluates `text[range]`.
///
/// # Errors
/// The first fault in it.
pub(crate) fn evaluate(
    d: &AsmDialect,
    text: &str,
    range: Range<usize>,
    names: &mut dyn NameValues,
) -> Result<AsmValue, LineFault> {
    let range = piece(text, range);
    if range.is_empty() {
        return Err(LineFault::new("ASM005", range, "a value is missing", "write a number, a name or an expression"));
    }
    let Some(front) = text.get(..range.end) else { return Ok(AsmValue::default()) };
    let mut parser = AsmExpressionParser { dialect: d, text: front, at: range.start, names, depth: 0, is_front: false };
    let value = parser.conditional()?;
    parser.skip_space();
    if parser.at < front.len() {
        let rest = parser.at..front.len();
        let what = text.get(rest.clone()).unwrap_or_default();
        let hint = "operators are between values; docs/formats/asm.md lists those of this family";
        return Err(LineFault::new(
            "ASM005",
            rest,
            format!("`{what}` does not belong to the expression before it"),
            hint,
        ));
    }
    Ok(value.with_high_taken())
}

/// Evaluates the expression at the start of `text[range]`; returns its end too.
///
/// # Errors
/// The first fault in it.
pub(crate) fn evaluate_front(
    dialect: &AsmDialect,
    text: &str,
    range: Range<usize>,
    names: &mut dyn NameValues,
) -> Result<(AsmValue, usize), LineFault> {
    let front = text.get(..range.end).unwrap_or_default();
    let mut parser = AsmExpressionParser { dialect, text: front, at: range.start, names, depth: 0, is_front: true };
    let value = parser.conditional()?;
    Ok((value.with_high_taken(), parser.at))
}

struct AsmExpressionParser<'p> {
    dialect: &'p AsmDialect,
    text: &'p str,
    at: usize,
    names: &'p mut dyn NameValues,
    depth: u32,
    /// A statement may follow, whose directive begins with a dot.
    is_front: bool,
}

impl AsmExpressionParser<'_> {
    fn skip_space(&mut self) {
        self.at = skip_space(self.text, self.at);
    }

    /// Returns the operator at the current position that binds at least as strongly as `least`: its length,
    /// strength and meaning.
    fn operator(&mut self, least: u8) -> Option<(usize, u8, AsmOperator)> {
        self.skip_space();
        let rest = self.text.get(self.at..)?;
        let is_apart = self.text.get(..self.at).is_some_and(|front| front.ends_with([' ', '\t']));
        if self.is_front && is_apart && rest.starts_with('.') {
            return None;
        }
        let mut found: Option<(usize, u8, AsmOperator)> = None;
        for &(token, power, op) in self.dialect.operators {
            if found.is_none_or(|(len, ..)| token.len() > len) && starts_with_token(rest, token) {
                found = Some((token.len(), power, op));
            }
        }
        found.filter(|&(_, power, _)| power >= least)
    }

    /// Parses a whole expression, in sources for Atmel's assembler also `condition ? value : value`.
    fn conditional(&mut self) -> Result<AsmValue, LineFault> {
        let condition = self.binary(0)?;
        self.skip_space();
        if !self.dialect.hooks.is_atmel || byte(self.text, self.at) != b'?' {
            return Ok(condition);
        }
        let mark = self.at;
        self.at += 1;
        self.depth += 1;
        let yes = self.conditional()?;
        self.skip_space();
        if byte(self.text, self.at) != b':' {
            let cause = "`?` is not followed by two values";
            return Err(LineFault::new("ASM005", mark..mark + 1, cause, "write `condition ? value : value`"));
        }
        self.at += 1;
        let no = self.conditional()?;
        self.depth -= 1;
        let chosen = if condition.number != 0 { yes } else { no };
        Ok(AsmValue { is_unknown: condition.is_unknown || chosen.is_unknown, ..chosen })
    }

    fn binary(&mut self, least: u8) -> Result<AsmValue, LineFault> {
        let start = self.at;
        let mut left = self.unary()?;
        while let Some((len, power, op)) = self.operator(least) {
            self.at += len;
            let right = self.binary(power + 1)?;
            left = self.apply(op, left, right, start..self.at)?;
        }
        Ok(left)
    }

    fn apply(&self, op: AsmOperator, left: AsmValue, right: AsmValue, at: Range<usize>) -> Result<AsmValue, LineFault> {
        let is_sum = matches!(op, AsmOperator::Add) || matches!(op, AsmOperator::Sub) && !right.is_high;
        let (left, right) = if is_sum { (left, right) } else { (left.with_high_taken(), right.with_high_taken()) };
        let unknown = left.is_unknown || right.is_unknown;
        let (a, b) = (left.number, right.number);
        let arithmetic = self.names.arithmetic();
        let operand = |n| arithmetic.operand(n);
        let compared = operand(a).cmp(&operand(b));
        let truth = |yes: bool| if yes { self.dialect.true_value } else { 0 };
        let n = match op {
            AsmOperator::Mul => a.wrapping_mul(b),
            AsmOperator::Div | AsmOperator::Mod if operand(b) == 0 && unknown => 0,
            AsmOperator::Div | AsmOperator::Mod if operand(b) == 0 => {
                let cause = "the expression divides by zero";
                return Err(LineFault::new("ASM009", at, cause, "look at the value on the right of the operator"));
            }
            AsmOperator::Div => operand(a).wrapping_div(operand(b)),
            AsmOperator::Mod => operand(a).wrapping_rem(operand(b)),
            AsmOperator::Add => a.wrapping_add(b),
            AsmOperator::Sub => a.wrapping_sub(b),
            AsmOperator::Shl | AsmOperator::Shr if unknown && !(0..64).contains(&b) => 0,
            // As in gpasm, shifted by all its bits or by a negative count a value becomes its sign, also to
            // the left.
            AsmOperator::Shl | AsmOperator::Shr if self.dialect.hooks.is_32 && !(0..32).contains(&b) => a >> 63,
            AsmOperator::Shl | AsmOperator::Shr if !(0..64).contains(&b) => {
                let cause = format!("values of 64 bits cannot be shifted by {b}");
                return Err(LineFault::new("ASM003", at, cause, "shift by 0 to 63"));
            }
            AsmOperator::Shl => u32::try_from(b).ok().and_then(|b| a.checked_shl(b)).unwrap_or(0),
            AsmOperator::Shr => u32::try_from(b).ok().and_then(|b| operand(a).checked_shr(b)).unwrap_or(0),
            AsmOperator::And => a & b,
            AsmOperator::Or => a | b,
            AsmOperator::Xor => a ^ b,
            AsmOperator::OrNot => a | !b,
            AsmOperator::Equal => truth(compared.is_eq()),
            AsmOperator::Unequal => truth(compared.is_ne()),
            AsmOperator::Less => truth(compared.is_lt()),
            AsmOperator::LessEqual => truth(compared.is_le()),
            AsmOperator::Greater => truth(compared.is_gt()),
            AsmOperator::GreaterEqual => truth(compared.is_ge()),
            AsmOperator::BothTrue => truth_of(a != 0 && b != 0),
            AsmOperator::EitherTrue => truth_of(a != 0 || b != 0),
            AsmOperator::BitOf if unknown => 0,
            AsmOperator::BitOf => {
                return bit_address(a, b, at).map(AsmValue::of);
            }
        };
        // The difference of two addresses is a number.
        let label =
            if op == AsmOperator::Sub { left.is_label != right.is_label } else { left.is_label || right.is_label };
        let number = self.dialect.wrap_value(n);
        let high = left.is_high || right.is_high;
        Ok(AsmValue { number, is_unknown: unknown, is_register: false, is_label: label, is_high: high })
    }

    fn unary(&mut self) -> Result<AsmValue, LineFault> {
        self.skip_space();
        // sdas8051 ignores the constant mark before any value: `.if #LEVEL - 8`.
        if self.dialect.hooks.is_sdas && byte(self.text, self.at) == b'#' {
            self.at += 1;
            self.skip_space();
        }
        let start = self.at;
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let cause = format!("the expression is deeper than {MAX_DEPTH} brackets and signs");
            return Err(LineFault::new("ASM005", start..start + 1, cause, "give parts of it names with equ"));
        }
        let rest = self.text.get(start..).unwrap_or_default();
        let found = self
            .dialect
            .unary
            .iter()
            .filter(|(token, ..)| starts_with_token(rest, token) && self.is_function(rest, token))
            .max_by_key(|(token, ..)| token.len());
        let value = match found {
            Some(&(token, power, fun)) => {
                self.at += token.len();
                let inner = self.binary(power)?.with_high_taken();
                if token == ">" && self.dialect.hooks.is_sdas && inner.is_label {
                    self.depth -= 1;
                    return Ok(AsmValue { is_high: true, is_register: false, ..inner });
                }
                AsmValue { number: self.dialect.wrap_value(fun(inner.number)), is_register: false, ..inner }
            }
            None => self.primary()?,
        };
        self.depth -= 1;
        Ok(value)
    }

    /// Reports whether the unary operator has a value behind it. `low` and `BYTE0` without one may be names
    /// of the program.
    fn is_function(&self, rest: &str, token: &str) -> bool {
        let next = rest.get(skip_space(rest, token.len())..).unwrap_or_default();
        if !token.ends_with(|c: char| c.is_ascii_digit()) {
            return !token.ends_with(|c: char| c.is_ascii_alphabetic())
                || !next.is_empty() && !next.starts_with([',', ')']);
        }
        let c = byte(next, 0);
        let is_operator = self.dialect.operators.iter().any(|(operator, ..)| starts_with_token(next, operator));
        !is_operator && (begins_name(c) || c.is_ascii_digit() || matches!(c, b'(' | b'\'' | b'"' | b'$'))
    }

    fn primary(&mut self) -> Result<AsmValue, LineFault> {
        let start = self.at;
        let c = byte(self.text, start);
        if c == b'(' {
            return self.brackets();
        }
        if let Some((len, value)) = read_quoted(self.dialect, self.text, start)? {
            self.at += len;
            return Ok(AsmValue::of(value));
        }
        if c.is_ascii_digit()
            && let Some((len, name)) = self.local_label()
        {
            self.at += len;
            return self.names.value_of_name(&name, start..start + len);
        }
        if let Some((len, value)) = number::read_number(self.dialect, self.names.radix(), self.text, start)? {
            self.at += len;
            return Ok(AsmValue::of(self.dialect.wrap_value(value)));
        }
        let rest = self.text.get(start..).unwrap_or_default();
        if let Some(token) = self
            .dialect
            .location_counter_names
            .iter()
            .find(|token| rest.starts_with(**token) && is_whole_token(rest, token))
        {
            self.at += token.len();
            return Ok(AsmValue { is_label: true, ..AsmValue::of(self.names.location_counter(token)) });
        }
        if begins_name(c) {
            let end = self.dialect.name_end(self.text, start);
            self.at = end;
            let name = self.text.get(start..end).unwrap_or_default();
            // `a.6` is a bit of the accumulator, whose address has another name.
            let accumulator = self.dialect.dot_is_bit && name.eq_ignore_ascii_case("a") && byte(self.text, end) == b'.';
            let value = self.names.value_of_name(if accumulator { "acc" } else { name }, start..end)?;
            return if self.dialect.dot_is_bit && byte(self.text, end) == b'[' {
                self.bit_index(value, start)
            } else {
                Ok(value)
            };
        }
        let what: String = rest.chars().take(12).collect();
        let cause =
            if rest.is_empty() { "a value is missing at the end".into() } else { format!("`{what}` is not a value") };
        Err(LineFault::new(
            "ASM005",
            start..self.text.len().max(start),
            cause,
            "write a number, a name or an expression",
        ))
    }

    /// Parses `bits[3]`: a bit of a byte in the notation of sdas8051.
    fn bit_index(&mut self, of: AsmValue, start: usize) -> Result<AsmValue, LineFault> {
        let open = self.at;
        self.at += 1;
        let bit = self.binary(0)?;
        self.skip_space();
        if byte(self.text, self.at) != b']' {
            let hint = "write the number of a bit between the brackets: `bits[3]`";
            return Err(LineFault::new("ASM005", open..open + 1, "the bracket is not closed", hint));
        }
        self.at += 1;
        self.apply(AsmOperator::BitOf, of, bit, start..self.at)
    }

    fn brackets(&mut self) -> Result<AsmValue, LineFault> {
        let start = self.at;
        self.at += 1;
        let value = self.conditional()?;
        self.skip_space();
        if byte(self.text, self.at) != b')' {
            let hint = "count the brackets of the expression";
            return Err(LineFault::new("ASM005", start..self.at.max(start + 1), "the bracket is not closed", hint));
        }
        self.at += 1;
        Ok(value)
    }

    /// Parses `1f`, `1b` and `12$`: length, and the internal name of the label.
    fn local_label(&self) -> Option<(usize, String)> {
        let rest = self.text.get(self.at..)?;
        let digits = rest.find(|c: char| !c.is_ascii_digit())?;
        let way = byte(rest, digits);
        let ends =
            !matches!(byte(rest, digits + 1), c if c.is_ascii_alphanumeric() || c == b'_' || c == b'$' || c == b'\'');
        let known = match way {
            b'f' | b'b' => self.dialect.numbered_labels,
            b'$' => self.dialect.dollar_labels,
            _ => false,
        };
        (known && ends).then(|| (digits + 1, self.names.local_label_name(&rest[..digits], way)))
    }
}

fn truth_of(yes: bool) -> i64 {
    i64::from(yes)
}

/// Reports whether the token is at the start of `rest`; a word must not continue with a letter.
fn starts_with_token(rest: &str, token: &str) -> bool {
    let Some(piece) = rest.get(..token.len()) else { return false };
    if !piece.eq_ignore_ascii_case(token) {
        return false;
    }
    let word = token.ends_with(|c: char| c.is_ascii_alphanumeric());
    !word
        || !matches!(byte(rest, token.len()), c if c.is_ascii_alphanumeric() || matches!(c, b'_' | b'?' | b'$' | b'\''))
}

/// Reports whether no name continues after the token.
fn is_whole_token(rest: &str, token: &str) -> bool {
    !matches!(byte(rest, token.len()), c if c.is_ascii_alphanumeric() || matches!(c, b'_' | b'?'))
}

/// Returns the address of bit `bit` of the byte `byte`.
fn bit_address(byte: i64, bit: i64, at: Range<usize>) -> Result<i64, LineFault> {
    let cause = match (byte, bit) {
        (_, bit) if !(0..8).contains(&bit) => format!("bit {bit} is not in 0..=7"),
        (0x20..=0x2F, _) => return Ok((byte - 0x20) * 8 + bit),
        (0x80..=0xFF, _) if byte % 8 == 0 => return Ok(byte + bit),
        _ => format!("the byte 0x{byte:02X} has no bit addresses"),
    };
    let hint = "bytes 20h to 2Fh and registers whose address is divisible by 8 have bits with addresses";
    Err(LineFault::new("ASM003", at, cause, hint))
}
