//! Macro arguments: splitting them, and substituting them for parameter names in the lines of a macro.

use std::ops::Range;

use crate::NamedText;
use crate::dialect::AsmDialect;
use crate::dialect::avr::atmel::substitute_numbered;
use crate::lines::{AsmLine, RewrittenText, begins_name, behind_name, byte, cut, skip_space, step, trim};
use crate::macros::MacroParameter;
use crate::statement::code_end;

/// The mark that joins an argument to the adjacent text in a macro line. Substitution removes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ArgumentJoin {
    /// No mark.
    Nothing,
    /// `l&n` and `'&n'`, as in ASM51 and ASEM-51 (its manual, "Macro expansion").
    And,
    /// `l'n` and `n'_x`, as in sdas8051 (`asmcro.c`).
    Quote,
}

impl ArgumentJoin {
    /// Returns the mark for a macro or repetition that the directive `word` begins: a word with a dot is
    /// sdas8051's.
    pub fn of(d: &AsmDialect, word: &str) -> ArgumentJoin {
        match word.starts_with('.') || d.hooks.is_sdas {
            _ if !d.hooks.angle_arguments => ArgumentJoin::Nothing,
            true if d.dot_is_bit => ArgumentJoin::Quote,
            true => ArgumentJoin::And,
            false => ArgumentJoin::And,
        }
    }
}

/// Returns the end of the name that begins at `at` and that may be replaced. If no such name begins there,
/// the error is the position at which to continue: after a number, after the dot between a byte and a bit,
/// after quoted text, or after one character.
pub(crate) fn scan_name(d: &AsmDialect, text: &str, at: usize) -> Result<usize, usize> {
    let c = byte(text, at);
    // A run of digits and letters that begins with a digit is one number.
    if c.is_ascii_digit() {
        let rest = text.get(at..).unwrap_or_default();
        return Err(at + rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len()));
    }
    // `P1.n`: the name begins after the dot. In `.n` it begins with the dot.
    if c == b'.' && d.dot_is_bit && ends_value(byte(text, at.wrapping_sub(1))) {
        return Err(at + 1);
    }
    match d.name_end(text, at) {
        end if end > at => Ok(end),
        _ => Err(step(d, text, at)),
    }
}

/// Returns the end of the word that begins at `at`, as [`scan_name`] does, by the rules of sdas8051: a word
/// has letters, digits and `_ . $`, in quoted text too.
fn scan_asxxxx_word(text: &str, at: usize) -> Result<usize, usize> {
    let rest = text.get(at..).unwrap_or_default();
    let end = at + rest.find(|c: char| !c.is_ascii_alphanumeric() && !"_.$".contains(c)).unwrap_or(rest.len());
    match byte(text, at).is_ascii_digit() {
        true => Err(end),
        false if end > at => Ok(end),
        false => Err(at + rest.chars().next().map_or(1, char::len_utf8)),
    }
}

/// Reports whether a value may end with this character.
fn ends_value(c: u8) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, b'_' | b'?' | b'$' | b')' | b']') || c >= 0x80
}

/// Splits arguments at commas. In dialects that have angle brackets, each argument loses the ones around it:
/// `<1, 2>, <>`.
pub(crate) fn split_arguments(
    d: &AsmDialect,
    text: &str,
    range: Range<usize>,
    join: ArgumentJoin,
) -> Vec<Range<usize>> {
    let written = text.get(range.clone()).unwrap_or_default();
    if join == ArgumentJoin::Quote && written.contains('^') {
        return delimited(d, text, range);
    }
    if !d.hooks.angle_arguments || !text.get(range.clone()).is_some_and(|all| all.contains('<')) {
        return split_parts(d, text, range, join);
    }
    let mut all = Vec::new();
    let mut at = range.start;
    loop {
        let start = skip_space(text, at).min(range.end);
        let next = match angle_contents(d, text, start..range.end) {
            Some(inside) => {
                let behind = skip_space(text, inside.end + 1);
                all.push(inside);
                behind
            }
            None => {
                let first = cut(d, text, start..range.end).first().map_or(start..range.end, |first| {
                    let comma = skip_space(text, first.end);
                    start..comma
                });
                all.push(trim(text, first.clone()));
                first.end
            }
        };
        if next >= range.end {
            return all;
        }
        at = next + 1;
    }
}

/// Splits arguments of sdas8051. Each may have delimiters of its own: `^/a, b/ c`.
fn delimited(d: &AsmDialect, text: &str, range: Range<usize>) -> Vec<Range<usize>> {
    let (mut all, mut at) = (Vec::new(), skip_space(text, range.start));
    while at < range.end {
        let mark = text.get(at + 1..range.end).and_then(|rest| rest.chars().next()).filter(|c| !c.is_whitespace());
        let inside = mark.filter(|_| byte(text, at) == b'^').and_then(|mark| {
            let from = at + 1 + mark.len_utf8();
            let close = from + text.get(from..range.end)?.find(mark)?;
            Some((from..close, close + mark.len_utf8()))
        });
        at = match inside {
            Some((argument, behind)) => {
                all.push(argument);
                behind
            }
            None => {
                let rest = text.get(at + 1..range.end).unwrap_or_default();
                let next = rest.find('^').map_or(range.end, |found| at + 1 + found);
                let front = text.get(at..next).unwrap_or_default().trim_end().trim_end_matches(',').len();
                all.extend(split_parts(d, text, at..at + front, ArgumentJoin::Quote));
                next
            }
        };
        at = skip_comma(text, at);
        at = skip_space(text, at);
    }
    all
}

/// Returns the text in the angle brackets at the start of `range`, if a comma or the end of `range` follows
/// them.
fn angle_contents(d: &AsmDialect, text: &str, range: Range<usize>) -> Option<Range<usize>> {
    let (mut depth, mut at) = (0u32, range.start);
    while at < range.end {
        match byte(text, at) {
            b'!' => at += 1,
            b'<' => depth += 1,
            b'>' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            let behind = skip_space(text, at + 1);
            let ends = behind >= range.end || byte(text, behind) == b',';
            return (at > range.start && ends).then_some(range.start + 1..at);
        }
        at = step(d, text, at);
    }
    None
}

/// Splits at commas; for avr-as and sdas8051 also at spaces that have no operator on either side.
pub(crate) fn split_parts(d: &AsmDialect, text: &str, range: Range<usize>, join: ArgumentJoin) -> Vec<Range<usize>> {
    let pieces = cut(d, text, range);
    if !d.spaced_arguments && join != ArgumentJoin::Quote {
        return pieces;
    }
    let mut all = Vec::new();
    for piece in pieces {
        let (mut start, mut at, mut depth) = (piece.start, piece.start, 0u32);
        while at < piece.end {
            match byte(text, at) {
                b'(' | b'[' => depth += 1,
                b')' | b']' => depth = depth.saturating_sub(1),
                b' ' | b'\t' if depth == 0 => {
                    let next = skip_space(text, at);
                    let before = byte(text, at.saturating_sub(1));
                    let value =
                        |c: u8| c.is_ascii_alphanumeric() || matches!(c, b'_' | b'.' | b'"' | b'\'' | b'\\' | b'$');
                    let mark = byte(text, next);
                    let begins = value(mark)
                        || matches!(mark, b'(' | b'#' | b'@')
                        || mark == b'?' && join == ArgumentJoin::Quote;
                    let end_of = |from: usize| behind_name(text, from, false).min(piece.end);
                    let front = text.get(start..at).unwrap_or_default();
                    let operator =
                        is_operator(d, front) || is_operator(d, text.get(next..end_of(next)).unwrap_or_default());
                    if (value(before) || before == b')') && begins && !operator {
                        all.push(start..at);
                        start = next;
                    }
                    at = next;
                    continue;
                }
                _ => {}
            }
            at = step(d, text, at);
        }
        all.push(start..piece.end);
    }
    all
}

/// Returns the position after spaces and at most one comma.
pub(crate) fn skip_comma(text: &str, at: usize) -> usize {
    let at = skip_space(text, at);
    if byte(text, at) == b',' { at + 1 } else { at }
}

/// Reports whether the last word of `text` is an operator.
fn is_operator(d: &AsmDialect, text: &str) -> bool {
    let last = text.rsplit(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
    let tokens = d.operators.iter().map(|(token, ..)| *token).chain(d.unary.iter().map(|(token, ..)| *token));
    let mut words = tokens.filter(|token| token.starts_with(|c: char| c.is_ascii_alphabetic()));
    words.any(|token| last.eq_ignore_ascii_case(token))
}

/// Returns the text of an argument without the `!` that escapes special characters: `<a!,b!>>`.
pub(crate) fn unescape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match rest.peek() {
            Some(next) if c == '!' && !next.is_ascii_alphanumeric() && *next != '=' => out.extend(rest.next()),
            _ => out.push(c),
        }
    }
    out
}

/// Returns the text of an argument without the quotes around all of it, which avr-as removes; a doubled quote
/// inside is one. In other dialects the quotes belong to the argument.
pub(crate) fn unquoted_argument(d: &AsmDialect, text: &str) -> String {
    let removes = d.spaced_arguments && !d.hooks.angle_arguments;
    text.strip_prefix('"').filter(|_| removes).and_then(text_to_quote).unwrap_or_else(|| text.to_owned())
}

/// Returns the text up to the quote that ends all of `inside`.
fn text_to_quote(inside: &str) -> Option<String> {
    let mut out = String::with_capacity(inside.len());
    let (mut rest, mut is_escaped) = (inside.chars().peekable(), false);
    while let Some(c) = rest.next() {
        if c == '"' && !is_escaped && rest.next_if_eq(&'"').is_none() {
            return rest.next().is_none().then_some(out);
        }
        out.push(c);
        is_escaped = c == '\\' && !is_escaped;
    }
    None
}

/// Parses a parameter: `a`, `a=1`, `a:req`, `a:vararg`, `\a`.
pub(crate) fn parse_parameter(d: &AsmDialect, text: &str) -> MacroParameter {
    let (name, default) =
        text.split_once('=').map_or((text, None), |(name, value)| (name, Some(unquoted_argument(d, value.trim()))));
    let (name, kind) = name.split_once(':').unwrap_or((name, ""));
    let kind = kind.trim();
    MacroParameter {
        name: name.trim().trim_start_matches(['\\', '?']).to_owned(),
        default,
        label: name.trim().starts_with('?'),
        required: kind.eq_ignore_ascii_case("req"),
        rest: kind.eq_ignore_ascii_case("vararg"),
    }
}

/// Returns the line with values substituted for names: `\name` in all dialects, and in some of them the bare
/// name outside quotes, in macros of sdas8051 inside them too. `\@` becomes the number of the call; `\()` is
/// removed.
pub(crate) fn substitute_parameters(
    d: &AsmDialect,
    line: &AsmLine,
    values: &[NamedText],
    number: u32,
    join: ArgumentJoin,
) -> AsmLine {
    if d.hooks.is_atmel {
        return substitute_numbered(d, line, values);
    }
    let text: &str = &line.text;
    let plain = d.plain_arguments && !values.is_empty();
    if !plain && !text.contains('\\') {
        return line.clone();
    }
    let mut put = ParameterSubstitution {
        text,
        values,
        out: RewrittenText::default(),
        copied_to: 0,
        any_quote_joins: join == ArgumentJoin::Quote,
    };
    let end = code_end(d, text);
    let is_quote = |at| matches!(byte(text, at), b'\'' | b'"');
    // The end of the last quoted text whose words are replaced.
    let (mut at, mut quoted_to) = (0, 0);
    let mut in_text = false;
    while at < text.len() {
        if !plain {
            in_text ^= byte(text, at) == b'"';
            // avr-as reads the character of `'\n'` before it looks for parameters.
            if !in_text && byte(text, at) == b'\'' && byte(text, at + 1) == b'\\' && byte(text, at + 2).is_ascii() {
                at += 3;
                continue;
            }
        }
        if byte(text, at) == b'\\' && !d.hooks.is_sdas {
            at = put.substitute_marked(at, number);
            continue;
        }
        if !plain || at >= end {
            at += text.get(at..).and_then(|rest| rest.chars().next()).map_or(1, char::len_utf8);
            continue;
        }
        let scanned = match d.hooks.is_sdas || at < quoted_to {
            true => scan_asxxxx_word(text, at),
            false => scan_name(d, text, at),
        };
        at = match scanned {
            Ok(name_end) => put.substitute_name(at..name_end, join),
            // `x'n`: the quote joins the two.
            Err(_) if join == ArgumentJoin::Quote && put.joins(at) => at + 1,
            Err(behind) if join == ArgumentJoin::Quote && is_quote(at) => {
                quoted_to = quoted_to.max(behind);
                at + 1
            }
            Err(behind) => {
                if is_quote(at) {
                    put.substitute_in_quotes(at..behind, join, number);
                }
                behind
            }
        };
    }
    put.out.copy(text, put.copied_to..text.len());
    put.out.into_line(line)
}

/// A line during substitution.
struct ParameterSubstitution<'t> {
    text: &'t str,
    values: &'t [NamedText],
    out: RewrittenText,
    /// Everything before this position is in `out`.
    copied_to: usize,
    /// A quote next to a parameter joins it to any text, not only to a name.
    any_quote_joins: bool,
}

impl<'t> ParameterSubstitution<'t> {
    /// Returns the value of the parameter at `at`.
    fn value(&self, at: Range<usize>) -> Option<&'t str> {
        let name = self.text.get(at)?;
        self.values.iter().find(|value| value.name == name).map(|value| value.text.as_str())
    }

    /// Substitutes `value` for the text at `at`; returns the position after it.
    fn substitute_value(&mut self, at: Range<usize>, value: &str) -> usize {
        if self.copied_to < at.start {
            self.out.copy(self.text, self.copied_to..at.start);
        }
        self.out.put(value, at.start);
        self.copied_to = at.end;
        at.end
    }

    /// Substitutes for the backslash at `at` and what follows it; returns the position after them.
    fn substitute_marked(&mut self, at: usize, number: u32) -> usize {
        let name_end = behind_name(self.text, at + 1, false);
        if let Some(value) = self.value(at + 1..name_end) {
            self.substitute_value(at..name_end, value)
        } else if byte(self.text, at + 1) == b'@' {
            // Counted from 0, as the GNU assembler does.
            self.substitute_value(at..at + 2, &number.saturating_sub(1).to_string())
        } else if self.text.get(at + 1..at + 3) == Some("()") {
            self.substitute_value(at..at + 3, "")
        } else {
            at + 1
        }
    }

    /// Substitutes for the name at `at` if it is a parameter, and removes its join marks; returns the
    /// position after it.
    fn substitute_name(&mut self, at: Range<usize>, join: ArgumentJoin) -> usize {
        let Some(value) = self.value(at.clone()) else { return at.end };
        let mark = match join {
            ArgumentJoin::Nothing => return self.substitute_value(at, value),
            ArgumentJoin::And => b'&',
            ArgumentJoin::Quote => b'\'',
        };
        let before = at.start > self.copied_to
            && byte(self.text, at.start - 1) == mark
            && (self.is_name(at.start - 1) || self.any_quote_joins);
        let next = byte(self.text, at.end + 1);
        // Before a number, `&` is the operator.
        let joins = begins_name(next) && next != b'.' || next == b'$' || self.any_quote_joins;
        let behind = byte(self.text, at.end) == mark && joins;
        self.substitute_value(at.start - usize::from(before)..at.end + usize::from(behind), value)
    }

    /// Reports whether a name (and not a number) or a substituted value ends at `end`.
    fn is_name(&self, end: usize) -> bool {
        let front = self.text.get(..end).unwrap_or_default();
        let word = front.rfind(|c: char| !c.is_ascii_alphanumeric() && !matches!(c, '_' | '?' | '$'));
        let first = byte(front, word.map_or(0, |at| at + 1));
        end == self.copied_to && end > 0 || begins_name(first)
    }

    /// Reports whether the quote at `at` joins a name to the parameter after it.
    fn joins(&self, at: usize) -> bool {
        let name = at + 1..behind_name(self.text, at + 1, false);
        byte(self.text, at) == b'\'' && (self.is_name(at) || self.any_quote_joins) && self.value(name).is_some()
    }

    /// Substitutes values for `\name`, `&name` and `&name&` inside quoted text.
    fn substitute_in_quotes(&mut self, at: Range<usize>, join: ArgumentJoin, number: u32) {
        let mut next = at.start;
        let is_mark = |c: char| c == '\\' || c == '&' && join == ArgumentJoin::And;
        while let Some(mark) = self.text.get(next..at.end).and_then(|rest| rest.find(is_mark)).map(|found| next + found)
        {
            if byte(self.text, mark) == b'\\' {
                next = self.substitute_marked(mark, number);
                continue;
            }
            let end = behind_name(self.text, mark + 1, false).min(at.end);
            next = mark + 1;
            if let Some(value) = self.value(mark + 1..end) {
                // `&a&b`: the second mark belongs to `b`.
                let behind = behind_name(self.text, end + 1, false);
                let closes = byte(self.text, end) == b'&' && self.value(end + 1..behind).is_none();
                next = self.substitute_value(mark..end + usize::from(closes), value);
            }
        }
    }
}
