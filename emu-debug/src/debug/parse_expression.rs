//! Parses expressions.

use super::c_objects::ObjectExpr;
use super::c_type_queries::{CTypeQueries as _, CTypeRef};
use super::c_types;
use super::error::DebugError;
use super::expression::{BinaryOperator, DebugExpression};
use super::expression_place::ExpressionPlace;
use super::scope::{FrameContext, NameScope};
use crate::input_error::malformed;
use crate::text_escapes::unescape;

/// Maximum nesting, so that no text can exhaust the stack.
const MAX_DEPTH: u32 = 100;

/// Maximum number of operators, for the same reason: a sequence of them is a tree as deep as it is long.
const MAX_OPERATORS: u32 = 1_000;

/// Operators with their binding strength; longer spellings come before their own prefixes.
#[rustfmt::skip]
const OPERATORS: &[(&str, BinaryOperator, u8)] = &[
    ("||", BinaryOperator::Or, 1), ("&&", BinaryOperator::And, 2),
    ("==", BinaryOperator::Eq, 6), ("!=", BinaryOperator::Ne, 6),
    ("<<", BinaryOperator::Shl, 8), (">>", BinaryOperator::Shr, 8), ("<=", BinaryOperator::Le, 7), (">=", BinaryOperator::Ge, 7),
    ("<", BinaryOperator::Lt, 7), (">", BinaryOperator::Gt, 7), ("|", BinaryOperator::BitOr, 3), ("^", BinaryOperator::BitXor, 4), ("&", BinaryOperator::BitAnd, 5),
    ("+", BinaryOperator::Add, 9), ("-", BinaryOperator::Sub, 9), ("*", BinaryOperator::Mul, 10), ("/", BinaryOperator::Div, 10), ("%", BinaryOperator::Rem, 10),
];

/// Parses an expression.
///
/// # Errors
/// The first fault in it.
pub(super) fn parse(scope: &NameScope, here: Option<&FrameContext>, text: &str) -> Result<DebugExpression, DebugError> {
    let mut parser = DebugExpressionParser { scope, here, text, rest: text.trim(), depth: 0, operators: 0 };
    let expr = parser.binary(0)?;
    match parser.rest {
        "" => Ok(expr),
        rest => Err(DebugError::TrailingText { rest: rest.to_owned(), text: text.to_owned() }),
    }
}

struct DebugExpressionParser<'a> {
    scope: &'a NameScope,
    /// The location of the machine, for names with a local scope.
    here: Option<&'a FrameContext>,
    text: &'a str,
    rest: &'a str,
    depth: u32,
    operators: u32,
}

impl<'a> DebugExpressionParser<'a> {
    fn take(&mut self, wanted: &str) -> bool {
        match self.rest.strip_prefix(wanted) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    fn binary(&mut self, least: u8) -> Result<DebugExpression, DebugError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(DebugError::NestedTooDeeply);
        }
        let mut left = self.unary()?;
        while let Some(&(sign, operator, binds)) = OPERATORS.iter().find(|(sign, ..)| self.rest.starts_with(sign)) {
            if binds <= least {
                break;
            }
            self.operators += 1;
            if self.operators > MAX_OPERATORS {
                return Err(DebugError::TooManyOperators { most: MAX_OPERATORS });
            }
            self.take(sign);
            let right = self.binary(binds)?;
            left = combine(operator, left, right);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn unary(&mut self) -> Result<DebugExpression, DebugError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(DebugError::NestedTooDeeply);
        }
        let sign = ['-', '!', '~', '+', '*', '&', '('].into_iter().find(|sign| self.rest.starts_with(*sign));
        let expr = match sign {
            Some('(') => match self.cast() {
                Some((here, kind)) => {
                    DebugExpression::Object(Box::new(ObjectExpr::value_of(here.calls.clone(), self.unary()?, kind)))
                }
                None => {
                    self.take("(");
                    let inner = self.binary(0)?;
                    self.expect(")")?;
                    self.postfix(inner)?
                }
            },
            Some('*') => {
                self.take("*");
                match self.unary()? {
                    DebugExpression::Object(object) if object.element_type().is_some() => {
                        DebugExpression::Object(Box::new(object.element(DebugExpression::Number(0))?))
                    }
                    address => DebugExpression::At(self.scope.chip().ram_space, Box::new(address)),
                }
            }
            Some('&') => {
                self.take("&");
                self.address()?
            }
            Some('+') => {
                self.take("+");
                self.unary()?
            }
            Some(sign) => {
                self.rest = self.rest[1..].trim_start();
                DebugExpression::Unary(sign, Box::new(self.unary()?))
            }
            None => {
                let atom = self.atom()?;
                self.postfix(atom)?
            }
        };
        self.depth -= 1;
        Ok(expr)
    }

    fn expect(&mut self, sign: &'static str) -> Result<(), DebugError> {
        if self.take(sign) { Ok(()) } else { Err(DebugError::MissingSign { sign, text: self.text.to_owned() }) }
    }

    /// Parses `(type)`; `None` if the parentheses contain anything else.
    fn cast(&mut self) -> Option<(&'a FrameContext, CTypeRef)> {
        let here = self.here?;
        let (inner, rest) = self.rest.strip_prefix('(')?.split_once(')')?;
        let kind = c_types::find_type(&here.calls.info, inner)?;
        self.rest = rest.trim_start();
        Some((here, kind))
    }

    /// Parses `&x`.
    fn address(&mut self) -> Result<DebugExpression, DebugError> {
        let width = |space: &str| i64::from(self.scope.chip().bytes_per_address(space).max(1));
        let nothing = DebugError::NoAddress { text: Some(self.rest.to_owned()) };
        match self.unary()? {
            DebugExpression::Object(object) => {
                object.address().map(|address| DebugExpression::Object(Box::new(address)))
            }
            DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }) => {
                Ok(DebugExpression::Number(i64::from(addr) / width(space)))
            }
            DebugExpression::At(_, addr) => Ok(*addr),
            // A function or label represents its address.
            DebugExpression::Number(number) => Ok(DebugExpression::Number(number)),
            _ => Err(nothing),
        }
    }

    /// Parses what may follow an object: `.member`, `->member`, `[index]`, and `.3` for a bit.
    fn postfix(&mut self, mut of: DebugExpression) -> Result<DebugExpression, DebugError> {
        loop {
            of = match of {
                DebugExpression::Object(object) if self.rest.starts_with('(') => {
                    let is_code = object.is_function() || object.is_function_pointer();
                    return Err(match is_code {
                        true => DebugError::Call,
                        false => DebugError::NotAFunction { text: self.text.to_owned() },
                    });
                }
                DebugExpression::Number(_) if self.rest.starts_with('(') => return Err(DebugError::Call),
                of if self.rest.starts_with('[') => {
                    self.take("[");
                    let index = self.binary(0)?;
                    self.expect("]")?;
                    index_into(of, index)?
                }
                DebugExpression::Object(object) if self.rest.starts_with("->") || self.rest.starts_with('.') => {
                    let rest = self.rest.trim_start_matches("->").trim_start_matches('.');
                    if rest.starts_with(|c: char| c.is_ascii_digit()) {
                        return self.bit_suffix(DebugExpression::Object(object));
                    }
                    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
                    self.rest = rest[end..].trim_start();
                    DebugExpression::Object(Box::new(object.member(&rest[..end])?))
                }
                of => return self.bit_suffix(of),
            };
        }
    }

    /// Parses `.3` after an object or after parentheses.
    fn bit_suffix(&mut self, of: DebugExpression) -> Result<DebugExpression, DebugError> {
        let Some(rest) = self.rest.strip_prefix('.') else { return Ok(of) };
        let digits = rest.len() - rest.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        let bit = rest[..digits].parse().ok().filter(|bit| *bit < 64);
        self.rest = rest[digits..].trim_start();
        bit.map(|bit| DebugExpression::Bit(Box::new(of), bit))
            .ok_or_else(|| DebugError::MissingBitNumber { text: self.text.to_owned() })
    }

    /// Parses `sizeof x` and `sizeof (type)`.
    fn size(&mut self) -> Result<DebugExpression, DebugError> {
        if let Some((here, kind)) = self.cast() {
            let size = here.calls.info.size_of(kind).ok_or(DebugError::UnknownSize { what: "that type" })?;
            return Ok(DebugExpression::Number(size.into()));
        }
        let bytes = match self.unary()? {
            DebugExpression::Object(object) => object.bytes(),
            DebugExpression::Place(ExpressionPlace::Memory { bytes, .. }) => Some(bytes.into()),
            _ => None,
        };
        bytes.map(|bytes| DebugExpression::Number(bytes.into())).ok_or(DebugError::NoSize)
    }

    /// Parses `1.5`, `1.`, `1.5e-3`, `2.5f`.
    fn real(&mut self, name: &str) -> Result<DebugExpression, DebugError> {
        let mut text = name.trim_end_matches(['f', 'F']).to_owned();
        // The sign of an exponent ends a word.
        if text.ends_with(['e', 'E'])
            && let Some(sign) = self.rest.chars().next().filter(|sign| matches!(sign, '+' | '-'))
        {
            let digits = &self.rest[1..];
            let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
            text.push(sign);
            text.push_str(&digits[..end]);
            self.rest = digits[end..].trim_start();
        }
        let value: Option<f64> = text.parse().ok();
        value.map(|value| DebugExpression::Real(value.to_bits())).ok_or_else(|| malformed(name, "number", "1.5").into())
    }

    fn atom(&mut self) -> Result<DebugExpression, DebugError> {
        if let Some(rest) = self.rest.strip_prefix('\'') {
            // After a backslash, neither `'` nor a backslash has its special meaning.
            let mut escaped = false;
            let end = rest.char_indices().find_map(|(at, c)| {
                let ends = c == '\'' && !escaped && at > 0;
                escaped = c == '\\' && !escaped;
                ends.then_some(at)
            });
            let end = end.ok_or_else(|| DebugError::MissingSign { sign: "'", text: self.text.to_owned() })?;
            let bytes = unescape(&rest[..end])?;
            self.rest = rest[end + 1..].trim_start();
            if let (Some(here), Some(behind)) = (self.here, self.rest.strip_prefix("::")) {
                let len = behind.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(behind.len());
                let (file, name) = (&rest[..end], &behind[..len]);
                self.rest = behind[len..].trim_start();
                let found = here.calls.info.global_in_file(file, name);
                let found = found
                    .ok_or_else(|| DebugError::UnknownFileVariable { name: name.to_owned(), file: file.to_owned() })?;
                return Ok(DebugExpression::Object(Box::new(ObjectExpr::variable(
                    here.calls.clone(),
                    found,
                    Vec::new(),
                    0,
                ))));
            }
            return match bytes.as_slice() {
                [byte] => Ok(DebugExpression::Number((*byte).into())),
                _ => Err(DebugError::NotOneByte { text: rest[..end].to_owned() }),
            };
        }
        let word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | ':' | '$' | '@' | '#');
        let end = self.rest.find(|c: char| !word(c)).unwrap_or(self.rest.len());
        let end = self.scope.mangled_name_length(self.rest).map_or(end, |name| name.max(end));
        let (name, rest) = self.rest.split_at(end);
        // What follows a C variable is a member of it, or a bit.
        let (head, _) = name.split_at(name.find('.').unwrap_or(name.len()));
        if let Some(object) = self.here.and_then(|here| self.scope.find_variable(here, head)) {
            self.rest = self.rest[head.len()..].trim_start();
            return Ok(DebugExpression::Object(Box::new(object)));
        }
        if let Some(value) = self.scope.values.named(head) {
            self.rest = self.rest[head.len()..].trim_start();
            return value;
        }
        self.rest = rest.trim_start();
        if name == "sizeof" {
            return self.size();
        }
        if let Some(here) = self.here
            && let Some(found) = self.scope.find_in_frame(here, name).or_else(|| self.scope.find_qualified(here, name))
        {
            return Ok(found);
        }
        if name.is_empty() {
            let found = self.rest.chars().next().map_or("nothing".to_owned(), |c| format!("`{c}`"));
            return Err(DebugError::MissingOperand { text: self.text.to_owned(), found });
        }
        if name.starts_with(|c: char| c.is_ascii_digit()) && !name.contains(':') {
            if name.contains('.') {
                return self.real(name);
            }
            return number(name).map(DebugExpression::Number);
        }
        let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_');
        match self.scope.find_name(name) {
            // The wording of gdb, for programs with information on their variables.
            Err(_) if self.here.is_some() && plain => Err(DebugError::UnknownSymbolHere {
                name: name.to_owned(),
                example: self.scope.source().names.example_address(),
            }),
            found => found,
        }
    }
}

/// Parses a number: decimal, 0x, 0b or 0o, with underscores; a leading 0 makes it octal, as in C.
fn number(text: &str) -> Result<i64, DebugError> {
    let plain = text.replace('_', "").to_ascii_lowercase();
    let radix = [("0x", 16), ("0b", 2), ("0o", 8)];
    let found = radix.into_iter().find_map(|(prefix, radix)| Some((plain.strip_prefix(prefix)?, radix)));
    let (digits, radix) = match (found, plain.strip_prefix('0')) {
        (Some(found), _) => found,
        (None, Some(octal)) if !octal.is_empty() => (octal, 8),
        (None, _) => (plain.as_str(), 10),
    };
    let wrong = || DebugError::from(malformed(text, "number", "418, 0x1a2 or 0b101"));
    if digits.starts_with(['+', '-']) {
        return Err(wrong());
    }
    i64::from_str_radix(digits, radix).map_err(|_| wrong())
}

/// Applies an operator to two operands; pointers move by whole elements.
fn combine(operator: BinaryOperator, left: DebugExpression, right: DebugExpression) -> DebugExpression {
    let pointer = |of: &DebugExpression| of.object().filter(|object| object.element_type().is_some()).cloned();
    let moved = match (operator, pointer(&left), pointer(&right)) {
        (BinaryOperator::Add | BinaryOperator::Sub, Some(pointer), None) => pointer.offset_by(operator, &right),
        (BinaryOperator::Add, None, Some(pointer)) => pointer.offset_by(operator, &left),
        (BinaryOperator::Sub, Some(of), Some(_)) => {
            let size = of.element_type().and_then(|kind| of.info().size_of(kind)).unwrap_or(1).max(1);
            let bytes = DebugExpression::Binary(operator, Box::new(left), Box::new(right));
            return DebugExpression::Binary(
                BinaryOperator::Div,
                Box::new(bytes),
                Box::new(DebugExpression::Number(size.into())),
            );
        }
        _ => None,
    };
    match moved {
        Some(moved) => DebugExpression::Object(Box::new(moved)),
        None => DebugExpression::Binary(operator, Box::new(left), Box::new(right)),
    }
}

/// Returns an element; of memory without a type it is a byte.
fn index_into(of: DebugExpression, index: DebugExpression) -> Result<DebugExpression, DebugError> {
    match (of, index) {
        (DebugExpression::Object(object), index) => Ok(DebugExpression::Object(Box::new(object.element(index)?))),
        (DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }), DebugExpression::Number(index)) => {
            let addr = i64::from(addr).checked_add(index).and_then(|addr| u32::try_from(addr).ok());
            let addr = addr.ok_or(DebugError::IndexTooLarge)?;
            Ok(DebugExpression::Place(ExpressionPlace::Memory { space, addr, bytes: 1, signed: false }))
        }
        (DebugExpression::Place(ExpressionPlace::Memory { space, addr, .. }), index) => Ok(DebugExpression::At(
            space,
            Box::new(DebugExpression::Binary(
                BinaryOperator::Add,
                Box::new(DebugExpression::Number(addr.into())),
                Box::new(index),
            )),
        )),
        _ => Err(DebugError::NoElements),
    }
}
