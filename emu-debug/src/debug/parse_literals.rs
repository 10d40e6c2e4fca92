//! Parses the literals of expressions: numbers, characters and strings of C.

use emu_core::image::DebugInfo;

use super::c_objects::ObjectExpr;
use super::c_type_queries::CTypeRef;
use super::error::DebugError;
use super::expression::DebugExpression;
use super::parse_expression::DebugExpressionParser;
use crate::text::input_error::malformed;
use crate::text_escapes::unescape;

impl<'a> DebugExpressionParser<'a> {
    /// Parses `1.5`, `1.`, `1.5e-3` or `2.5f`.
    pub(super) fn real(&mut self, name: &str) -> Result<DebugExpression, DebugError> {
        let mut text = name.trim_end_matches(['f', 'F']).to_owned();
        // The sign of an exponent ends a word, so it is parsed here.
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

    /// Parses `"abc"`; adjacent strings are joined.
    pub(super) fn text_literal(&mut self) -> Result<DebugExpression, DebugError> {
        let mut bytes = Vec::new();
        while let Some(rest) = self.rest.strip_prefix('"') {
            let end = if rest.starts_with('"') { Some(0) } else { quote_end(rest, '"') };
            let end = end.ok_or_else(|| DebugError::MissingSign { sign: "\"", text: self.text.to_owned() })?;
            bytes.extend(literal_bytes(&rest[..end])?);
            self.rest = rest[end + 1..].trim_start();
        }
        Ok(DebugExpression::Text(bytes))
    }

    /// Parses `'a'` or `'file.c'::x`; `rest` is the text after the first quote.
    pub(super) fn quoted(&mut self, rest: &'a str) -> Result<DebugExpression, DebugError> {
        let end = quote_end(rest, '\'');
        let end = end.ok_or_else(|| DebugError::MissingSign { sign: "'", text: self.text.to_owned() })?;
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
        let bytes = literal_bytes(&rest[..end])?;
        match bytes.as_slice() {
            [byte] => Ok(self.typed((*byte as i8).into(), "char").unwrap_or(DebugExpression::Number((*byte).into()))),
            _ => Err(DebugError::NotOneByte { text: rest[..end].to_owned() }),
        }
    }

    /// Returns a value of a built-in type, if the program is a C program.
    fn typed(&self, value: i64, kind: &str) -> Option<DebugExpression> {
        let kind = CTypeRef::new(Some(DebugInfo::builtin_type(kind)?));
        let value = ObjectExpr::value_of(self.calls()?.clone(), DebugExpression::Number(value), kind);
        Some(DebugExpression::Object(Box::new(value)))
    }

    /// Parses `12`, `0x1F` or `10UL`.
    pub(super) fn whole(&self, name: &str) -> Result<DebugExpression, DebugError> {
        let digits = name.trim_end_matches(['u', 'U', 'l', 'L']);
        let suffix = name[digits.len()..].to_ascii_lowercase();
        if !matches!(suffix.as_str(), "" | "u" | "l" | "ul" | "lu" | "ll" | "ull" | "llu") {
            return Err(malformed(name, "number", "418, 0x1a2 or 0b101").into());
        }
        let value = number(digits)?;
        let (unsigned, long) = (suffix.contains('u'), suffix.matches('l').count());
        let kind = match (value, long) {
            _ if suffix.is_empty() => return Ok(DebugExpression::Number(value)),
            (0..0x8000, 0) => "int",
            (0x8000..0x1_0000, 0) if unsigned => "int",
            (..0x1_0000_0000, 0 | 1) => "long",
            _ => "long long",
        };
        let kind = if unsigned { format!("unsigned {kind}") } else { kind.to_owned() };
        Ok(self.typed(value, &kind).unwrap_or(DebugExpression::Number(value)))
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

/// Returns the end of a literal; a quote after a backslash does not end it.
fn quote_end(rest: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    rest.char_indices().find_map(|(at, c)| {
        let ends = c == quote && !escaped && at > 0;
        escaped = c == '\\' && !escaped;
        ends.then_some(at)
    })
}

/// Returns the bytes of a literal, with the escapes of C.
fn literal_bytes(text: &str) -> Result<Vec<u8>, DebugError> {
    let (mut bytes, mut rest) = (Vec::new(), text);
    while let Some(at) = rest.find('\\') {
        bytes.extend(&rest.as_bytes()[..at]);
        let behind = &rest[at + 1..];
        let octal = behind.bytes().take(3).take_while(|byte| (b'0'..b'8').contains(byte)).count();
        let single = [('a', 7u8), ('b', 8), ('e', 27), ('f', 12), ('v', 11), ('\'', b'\'')];
        let own = single.iter().find(|(letter, _)| behind.starts_with(*letter));
        let len = if octal > 0 {
            bytes.push(u32::from_str_radix(&behind[..octal], 8).unwrap_or(0) as u8);
            octal
        } else if let Some((_, byte)) = own {
            bytes.push(*byte);
            1
        } else {
            // Other escapes have one character, or an x with two digits.
            let len = if behind.starts_with('x') { 3 } else { behind.chars().next().map_or(0, char::len_utf8) };
            let end = (at + 1 + len).min(rest.len());
            bytes.extend(unescape(rest.get(at..end).unwrap_or(&rest[at..]))?);
            end - at - 1
        };
        rest = &rest[at + 1 + len..];
    }
    bytes.extend(rest.as_bytes());
    Ok(bytes)
}
