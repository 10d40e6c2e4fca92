//! Numbers and characters in the forms of a dialect.

use diag::text::byte_of;

use crate::dialect::{AsmDialect, NumberForm};
use crate::fault::LineFault;
use crate::lines::{BACKSLASH, byte, step};

/// Reads the number at `at`: its length and value; `None` if none begins there.
///
/// # Errors
/// Digits that the form does not allow, and values over 32 bits.
pub(crate) fn read_number(
    d: &AsmDialect,
    radix: u32,
    text: &str,
    at: usize,
) -> Result<Option<(usize, i64)>, LineFault> {
    let Some(rest) = text.get(at..) else { return Ok(None) };
    // `1010$1010b`: digits in groups, as in ASEM-51.
    if let Some((len, digits)) = grouped_digits(d, rest)
        && let Ok(Some((taken, n))) = read_number(d, radix, &digits, 0)
        && taken == digits.len()
    {
        return Ok(Some((len, n)));
    }
    for form in d.numbers {
        if let Some((skip, digits, radix, behind)) = match_form(*form, rest, radix) {
            let len = skip + digits.len() + behind;
            let Some(n) = digits_value(d, digits, radix) else {
                let cause = format!("`{digits}` has more than 32 bits");
                return Err(LineFault::new("ASM010", at..at + len, cause, "numbers have up to 32 bits"));
            };
            return Ok(Some((len, n)));
        }
    }
    if !byte(rest, 0).is_ascii_digit() {
        return Ok(None);
    }
    let run = leading_word(rest);
    let hint =
        format!("{} is the radix of a number that says nothing of it; see docs/formats/asm.md for the forms", radix);
    Err(LineFault::new("ASM010", at..at + run.len().max(1), format!("`{run}` is not a number"), hint))
}

/// Returns length and bare digits of the number at the start whose digits are in groups.
fn grouped_digits(d: &AsmDialect, rest: &str) -> Option<(usize, String)> {
    let between = d.hooks.digit_groups?;
    // Atmel's `$FF_FF`.
    let mark = usize::from(between != '$' && rest.starts_with('$'));
    let digits = rest.get(mark..)?;
    let end = digits.find(|c: char| !c.is_ascii_alphanumeric() && c != between).unwrap_or(digits.len());
    let run = digits.get(..end)?;
    let begins = mark > 0 || run.starts_with(|c: char| c.is_ascii_digit());
    let whole =
        begins && run.contains(between) && !run.ends_with(between) && !run.contains(&format!("{between}{between}"));
    let bare = || run.replace(between, "");
    whole.then(|| (mark + end, format!("{}{}", rest.get(..mark).unwrap_or_default(), bare())))
}

/// Returns the letters and digits at the start.
fn leading_word(rest: &str) -> &str {
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
    rest.get(..end).unwrap_or_default()
}

/// Matches a form at the start of `rest`: length of its prefix, digits, radix, length of its suffix.
fn match_form(form: NumberForm, rest: &str, radix: u32) -> Option<(usize, &str, u32, usize)> {
    let all = |digits: &str, radix| !digits.is_empty() && digits.chars().all(|c| c.is_digit(radix));
    let behind = |prefix: usize, radix| {
        let digits = leading_word(rest.get(prefix..)?);
        all(digits, radix).then_some((prefix, digits, radix, 0))
    };
    let prefixed = |mark: &str, radix| {
        rest.get(..mark.len()).filter(|front| front.eq_ignore_ascii_case(mark))?;
        behind(mark.len(), radix)
    };
    let starts = byte(rest, 0).is_ascii_digit();
    let suffixed = |marks: &[u8], radix| {
        let run = leading_word(rest);
        let last = byte(run, run.len().checked_sub(1)?).to_ascii_lowercase();
        let digits = run.get(..run.len() - 1)?;
        (starts && marks.contains(&last) && all(digits, radix)).then_some((0, digits, radix, 1))
    };
    match form {
        NumberForm::Hex0x => prefixed("0x", 16),
        NumberForm::Binary0b => prefixed("0b", 2),
        NumberForm::HexDollar => prefixed("$", 16),
        NumberForm::DollarMark => match rest.as_bytes().get(..2)? {
            b"$%" => behind(2, 2),
            b"$&" => behind(2, 8),
            b"$#" => behind(2, 10),
            _ => None,
        },
        NumberForm::HexDollars => prefixed("$$", 16),
        NumberForm::ZeroLetter => match byte(rest, 1).to_ascii_lowercase() {
            b'h' if starts && byte(rest, 0) == b'0' => behind(2, 16),
            b'o' | b'q' if starts && byte(rest, 0) == b'0' => behind(2, 8),
            b'd' if starts && byte(rest, 0) == b'0' => behind(2, 10),
            _ => None,
        },
        NumberForm::BinaryPercent => prefixed("%", 2),
        NumberForm::HexH => suffixed(b"h", 16),
        NumberForm::BinaryB => suffixed(b"b", 2),
        NumberForm::OctalOQ => suffixed(b"oq", 8),
        NumberForm::DecimalD => suffixed(b"d", 10),
        NumberForm::OctalZero => {
            (starts && byte(rest, 0) == b'0' && leading_word(rest).len() > 1).then(|| behind(0, 8)).flatten()
        }
        NumberForm::DecimalDot => prefixed(".", 10),
        NumberForm::Quoted => {
            let radix = match byte(rest, 0).to_ascii_lowercase() {
                b'h' => 16,
                b'd' => 10,
                b'o' | b'q' => 8,
                b'b' => 2,
                _ => return None,
            };
            (byte(rest, 1) == b'\'').then_some(())?;
            let (prefix, digits, radix, _) = behind(2, radix)?;
            (byte(rest, 2 + digits.len()) == b'\'').then_some((prefix, digits, radix, 1))
        }
        NumberForm::Plain => (starts).then(|| behind(0, radix)).flatten(),
    }
}

/// Returns the value of digits; `None` if it has more than 32 bits.
fn digits_value(d: &AsmDialect, digits: &str, radix: u32) -> Option<i64> {
    if d.hooks.is_32 {
        let step = |n: i64, digit: u32| i64::from((n as u32).wrapping_mul(radix).wrapping_add(digit));
        return Some(digits.chars().filter_map(|c| c.to_digit(radix)).fold(0, step));
    }
    i64::from_str_radix(digits, radix).ok().filter(|n| *n <= 0xFFFF_FFFF)
}

/// Reads the quoted character at `at`: its length and code; `None` if none begins there.
///
/// # Errors
/// A quote with nothing after it, or one that is not closed.
pub(crate) fn read_quoted(d: &AsmDialect, text: &str, at: usize) -> Result<Option<(usize, i64)>, LineFault> {
    let quote = byte(text, at);
    let ascii =
        quote.eq_ignore_ascii_case(&b'a') && byte(text, at + 1) == b'\'' && d.numbers.contains(&NumberForm::Quoted);
    let open = if ascii { at + 1 } else { at };
    if byte(text, open) != b'\'' && quote != b'"' {
        return Ok(None);
    }
    if let Some(quoted) = d.hooks.quoted {
        let cause = "a character is missing after the quote";
        let hint = "'c is one character, \"cc are two; texts are for .ascii";
        let found = quoted(text, open).ok_or_else(|| LineFault::new("ASM011", open..text.len(), cause, hint))?;
        return Ok(Some((found.0 - at, i64::from(found.1))));
    }
    let mark = byte(text, open);
    let mut at_char = open + 1;
    let mut value = 0i64;
    let mut count = 0;
    while at_char < text.len() && (byte(text, at_char) != mark || (count == 0 && byte(text, at_char + 1) == mark)) {
        let (mut len, code) = read_character(text, at_char);
        // A quote as a character is doubled, or single.
        if mark == b'\'' && text.get(at_char..).unwrap_or_default().starts_with("'''") {
            len = 2;
        }
        value = value << 8 | i64::from(code);
        at_char += len;
        count += 1;
        let comma = byte(text, at_char) == b',' && step(d, text, open) == at_char;
        let ends = comma || !text.get(at_char..).unwrap_or_default().contains('\'');
        if count == 1 && mark == b'\'' && byte(text, at_char) != mark && ends {
            // 'c without a closing quote.
            let next = text.get(at_char..).map(|rest| rest.chars().next().unwrap_or(' '));
            let (cause, hint) = match next {
                None => {
                    let c: String = text.get(open + 1..).unwrap_or_default().chars().take(1).collect();
                    let cause =
                        format!("`{c}` has {} bytes in this file, and a character as a number has one", c.len());
                    (cause, "write its code as a number, such as 0xE9, or save the file in an 8-bit code page")
                }
                Some(c) if c.is_alphanumeric() => {
                    let cause = format!("the text `{}` is not closed", text.get(open..).unwrap_or_default().trim_end());
                    (cause, "close it with a second quote")
                }
                _ => return Ok(Some((at_char - at, value))),
            };
            return Err(LineFault::new("ASM011", at..text.len(), cause, hint));
        }
        if count > 4 {
            break;
        }
    }
    if byte(text, at_char) != mark || count == 0 {
        let written = text.get(open..).unwrap_or_default().trim_end();
        let closed = written.len() > 1 && written.ends_with(mark as char);
        let cause = match count {
            0 => "there is no character between the quotes".to_owned(),
            _ if closed => "the quote is not closed".to_owned(),
            _ => format!("the text `{written}` is not closed"),
        };
        let hint = "write a character as a number in single quotes: 'c'; texts are for db and ascii";
        return Err(LineFault::new("ASM011", at..text.len(), cause, hint));
    }
    Ok(Some((at_char + 1 - at, value)))
}

/// Reads the character at `at`, decoding an escape: its length in the text and its code.
pub(crate) fn read_character(text: &str, at: usize) -> (usize, u8) {
    let c = byte(text, at);
    if c != b'\\' || at + 1 >= text.len() {
        return read_byte(text, at);
    }
    let octal = text.get(at + 1..).unwrap_or_default();
    let digits = octal.bytes().take(3).take_while(|c| (b'0'..=b'7').contains(c)).count();
    if digits > 0 {
        let code = octal.bytes().take(digits).fold(0u32, |n, c| n * 8 + u32::from(c - b'0'));
        return (1 + digits, code as u8);
    }
    match byte(text, at + 1) {
        b'n' => (2, b'\n'),
        b'r' => (2, b'\r'),
        b't' => (2, b'\t'),
        b'a' => (2, 7),
        b'b' => (2, 8),
        b'f' => (2, 12),
        b'v' => (2, 11),
        b'e' => (2, 27),
        b'x' | b'X' => {
            let hex = text.get(at + 2..).unwrap_or_default();
            let digits = hex.bytes().take(2).take_while(u8::is_ascii_hexdigit).count();
            let code = u8::from_str_radix(hex.get(..digits).unwrap_or_default(), 16).unwrap_or(b'x');
            (2 + digits, code)
        }
        _ => {
            let (len, code) = read_byte(text, at + 1);
            (1 + len, code)
        }
    }
}

/// Reads the byte of the file at `at`, and its length in the text: a character that represents a byte takes
/// several bytes there.
pub(crate) fn read_byte(text: &str, at: usize) -> (usize, u8) {
    let c = text.get(at..).and_then(|rest| rest.chars().next());
    match c.and_then(|c| Some((c.len_utf8(), if c == BACKSLASH { b'\\' } else { byte_of(c)? }))) {
        Some(found) => found,
        None => (1, byte(text, at)),
    }
}

/// Returns the bytes of the quoted text that is all of `text[from..to]`; `None` if it is not such a text.
pub(crate) fn read_string(text: &str, from: usize, to: usize) -> Option<Vec<u8>> {
    let mark = byte(text, from);
    if to < from + 2 || !matches!(mark, b'"' | b'\'') || byte(text, to - 1) != mark {
        return None;
    }
    let inside = text.get(..to - 1)?;
    let mut bytes = Vec::new();
    let mut at = from + 1;
    while at < inside.len() {
        let doubled = mark == b'\'' && inside.get(at..).unwrap_or_default().starts_with("''");
        if byte(inside, at) == mark && !doubled {
            return None;
        }
        let (len, code) = if doubled { (2, mark) } else { read_character(inside, at) };
        bytes.push(code);
        at += len;
    }
    Some(bytes)
}
