//! Quoted texts and characters of sdas8051 (`asmain.c` and `aslex.c` of SDCC 4.2: text directives, `getmap`).
//!
//! A text begins and ends with the same character, whichever it is: `.ascii /it's/`. A backslash begins an
//! escape with `b f n r t` or up to three octal digits; before any other character it is an ordinary
//! character. As a value, `'c` is one character and `"cc` is two, the first of which is the high byte; the
//! closing quote may be left out.
//!
//! as31 and assemblers compatible with ASM51 take `.db "ab"` as a text. Directives that only one of the two
//! has show which one a line is written for.

use std::ops::Range;

use diag::text::encode_text;

use super::super::common::{bytes, required_arguments, text_or_byte, value_of, words};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, BACKSLASH, RewrittenText, byte, cut, skip_space, step, trim};
use crate::number::{read_byte, read_string};

/// What ends a text in memory.
#[derive(Clone, Copy)]
pub(super) enum TextEnd {
    /// Nothing.
    Open,
    /// A byte of 0.
    Zero,
    /// The last character, with its bit 7 set.
    HighBit,
}

/// The size of a value.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum DataSize {
    Byte,
    Word,
}

/// Directives whose text may have any delimiter.
const TEXTS: &[&str] = &["ascii", "asciz", "ascis", "str", "strz", "strs", "fcc"];

/// Returns the end of the text of such a directive in this line, including its delimiter.
fn text_end(line: &str) -> Option<usize> {
    let mut at = skip_space(line, 0);
    loop {
        let rest = line.get(at..)?;
        let len = rest.find(|c: char| c.is_whitespace() || c == ':').unwrap_or(rest.len());
        let word = rest.get(..len)?;
        if TEXTS.iter().any(|known| word.trim_start_matches('.').eq_ignore_ascii_case(known)) {
            let from = skip_space(line, at + len);
            return closing_delimiter(line, from..line.len()).map(|close| close + 1);
        }
        // A label precedes it.
        let behind = rest.get(len..)?.trim_start_matches(':');
        if word.is_empty() || behind.len() == rest.len() - len {
            return None;
        }
        at = skip_space(line, line.len() - behind.len());
    }
}

/// Returns where the comment of a line begins in a source for any assembler.
pub(super) fn any_code_end(line: &str) -> usize {
    let mut at = text_end(line).unwrap_or(0);
    while at < line.len() {
        let rest = line.get(at..).unwrap_or_default();
        if rest.starts_with(';') || rest.starts_with("//") {
            return at;
        }
        // `!;` in a macro argument is a semicolon.
        at = if rest.starts_with("!;") { at + 2 } else { step(&super::MCS51, line, at) };
    }
    line.len()
}

/// Returns where the comment of a line begins in a source for sdas8051.
pub(super) fn code_end(line: &str) -> usize {
    let mut at = text_end(line).unwrap_or(0);
    while at < line.len() {
        at = match byte(line, at) {
            b';' => return at,
            b'\'' | b'"' => quoted_at(line, at).map_or(at + 1, |(end, _)| end),
            _ => at + 1,
        };
    }
    line.len()
}

/// Returns the end and the value of the quoted value that begins at `at`.
pub(super) fn quoted_at(text: &str, at: usize) -> Option<(usize, u16)> {
    quoted(text, at..text.len())
}

/// Returns the position of the delimiter that closes the text at the start of `range`. Within single quotes a
/// doubled quote is one quote.
fn closing_delimiter(line: &str, range: Range<usize>) -> Option<usize> {
    let mark = line.get(range.clone())?.chars().next().filter(char::is_ascii)?;
    let mut from = range.start + 1;
    loop {
        let at = from + line.get(from..range.end)?.find(mark)?;
        if mark != '\'' || byte(line, at + 1) != b'\'' || at == range.start + 1 && byte(line, at + 2) != b'\'' {
            return Some(at);
        }
        from = at + 2;
    }
}

/// Returns the line with plain backslashes marked, for a source for ASM51 and similar assemblers, where a
/// backslash in quotes is an ordinary character. `None` if nothing changes. Lines with a text directive or
/// with a leading dot belong to as31 or sdas8051. Only `'\n'` is a character of as31 in the operands of
/// instructions.
pub(super) fn plain_backslashes(line: &AsmLine) -> Option<AsmLine> {
    let text: &str = &line.text;
    if !text.contains('\\') {
        return None;
    }
    let between = |c: char| c.is_whitespace() || matches!(c, ':' | '"' | '\'');
    let words = || text.split(between).filter(|word| !word.is_empty()).take(2);
    let data = words().any(|word| DATA.iter().any(|known| word.eq_ignore_ascii_case(known)));
    if text_end(text).is_some() || words().any(|word| word.starts_with(['.', '#', '$']) && word.len() > 1) {
        return None;
    }
    let (mut changed, mut done, mut at) = (RewrittenText::default(), 0, 0);
    while at < text.len() {
        let mark = byte(text, at);
        if mark == b';' || text.get(at..).is_some_and(|rest| rest.starts_with("//")) {
            break;
        }
        let rest = text.get(at + 1..).unwrap_or_default();
        let Some(len) = rest.find(mark as char).filter(|_| matches!(mark, b'\'' | b'"')) else {
            at += 1;
            continue;
        };
        let inside = rest.get(..len).unwrap_or_default();
        let is_escape = !data && inside.len() == 2 && inside.starts_with('\\');
        for (found, _) in inside.match_indices('\\').filter(|_| !is_escape) {
            let old = at + 1 + found;
            changed.copy(text, done..old);
            changed.put(BACKSLASH.encode_utf8(&mut [0; 4]), old);
            done = old + 1;
        }
        at += len + 2;
    }
    changed.copy(text, done..text.len());
    (done > 0).then(|| changed.into_line(line))
}

/// Directives without a dot that take texts of ASM51.
const DATA: &[&str] = &["db", "defb", "dw", "defw", "byte", "word", "fcb", "fdb"];

/// Returns the length and the code of the first character; an escape counts as one.
fn character(bytes: &[u8]) -> Option<(usize, u8)> {
    let (first, rest) = bytes.split_first()?;
    if *first != b'\\' {
        return Some((1, *first));
    }
    let digits = rest.iter().take(3).take_while(|c| matches!(c, b'0'..=b'7'));
    let (count, code) = digits.fold((0, 0u32), |(count, code), c| (count + 1, code * 8 + u32::from(c - b'0')));
    Some(match rest.first() {
        _ if count > 0 => (1 + count, code as u8),
        Some(b'b') => (2, 8),
        Some(b'f') => (2, 12),
        Some(b'n') => (2, b'\n'),
        Some(b'r') => (2, b'\r'),
        Some(b't') => (2, b'\t'),
        _ => (1, b'\\'),
    })
}

/// Returns the bytes of a text between its delimiters.
fn unescape(text: &str) -> Vec<u8> {
    let bytes = encode_text(text);
    let (mut out, mut rest) = (Vec::with_capacity(bytes.len()), bytes.as_slice());
    while let Some((len, code)) = character(rest) {
        out.push(code);
        rest = rest.get(len..).unwrap_or_default();
    }
    out
}

/// `.ascii /text/`; or several quoted texts with commas between them.
pub(super) fn text(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, end: TextEnd) {
    let all = trim(call.text, call.rest.clone());
    if all.is_empty() {
        required_arguments(asm, call);
        return;
    }
    let mut at = all.start;
    loop {
        let Some(close) = closing_delimiter(call.text, at..all.end) else {
            let written = call.get(at..all.end);
            let mark: String = written.chars().take(1).collect();
            let cause = format!("`{written}` is not a text: `{mark}` does not close it");
            return asm.report(LineFault::new("ASM011", at..all.end, cause, "write it as \"text\" or /text/"));
        };
        let mark = byte(call.text, at);
        let inside = call.get(at + 1..close);
        let mut bytes = if mark == b'\'' { unescape(&inside.replace("''", "'")) } else { unescape(inside) };
        match end {
            TextEnd::Open => {}
            TextEnd::Zero => bytes.push(0),
            TextEnd::HighBit => bytes.iter_mut().next_back().into_iter().for_each(|last| *last |= 0x80),
        }
        asm.emit(&bytes, at..close + 1);
        let behind = skip_space(call.text, close + 1);
        let next = skip_space(call.text, behind + 1);
        match byte(call.text, behind) {
            _ if behind >= all.end => return,
            b';' => return,
            b',' if matches!(mark, b'"' | b'\'') && matches!(byte(call.text, next), b'"' | b'\'') => at = next,
            _ => {
                let cause = format!("`{}` follows the text", call.get(behind..all.end));
                let hint = match inside.ends_with('\\') {
                    true => "a backslash does not keep a delimiter from ending the text: take another, /a\"b/",
                    false => "one text, or several in quotes with commas between them; numbers are for .db",
                };
                return asm.report(LineFault::new("ASM011", behind..all.end, cause, hint));
            }
        }
    }
}

/// Emits bytes or words. `own` if as31 and ASM51 have no such directive with a dot, or take no characters in
/// it.
pub(super) fn data(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, size: DataSize, own: bool) {
    let dotted = call.get(call.word.clone()).starts_with('.');
    let marked =
        || cut(asm.dialect, call.text, call.rest.clone()).iter().any(|part| byte(call.text, part.start) == b'#');
    match size {
        _ if dotted && (own || asm.dialect.hooks.is_sdas || marked()) => values(asm, call, size),
        DataSize::Byte if dotted => bytes(asm, call),
        DataSize::Byte => {
            for part in required_arguments(asm, call) {
                match doubled_quotes(call.get(part.clone())) {
                    Some(text) => asm.emit(&text, part),
                    None => text_or_byte(asm, call, part),
                }
            }
        }
        DataSize::Word => words(asm, call),
    }
}

/// Returns the bytes of an A51 text with doubled quotes: `"say ""hello"""`.
fn doubled_quotes(written: &str) -> Option<Vec<u8>> {
    let inside = written.strip_prefix('"')?.strip_suffix('"').filter(|inside| inside.contains("\"\""))?;
    let mut bytes = Vec::new();
    for (number, piece) in inside.split("\"\"").enumerate() {
        let text = format!("\"{piece}\"");
        bytes.extend((number > 0).then_some(b'"'));
        bytes.extend(read_string(&text, 0, text.len())?);
    }
    Some(bytes)
}

fn values(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, size: DataSize) {
    let parts = cut_values(call.text, call.rest.clone());
    if parts.is_empty() {
        required_arguments(asm, call);
    }
    for part in parts {
        // `#5` is 5.
        let from = if byte(call.text, part.start) == b'#' { skip_space(call.text, part.start + 1) } else { part.start };
        let value = match quoted(call.text, from..part.end) {
            Some((end, value)) if end == part.end => {
                if size == DataSize::Byte && value > 0xFF {
                    let cause = format!(
                        "`{}` is the number 0x{value:04X} here: its upper bits are dropped",
                        call.get(part.clone())
                    );
                    asm.report(LineFault::new("ASM030", part.clone(), cause, "write texts with .ascii").warning());
                }
                value
            }
            Some((end, _)) if !begins_operator(byte(call.text, skip_space(call.text, end))) => {
                let cause =
                    format!("`{}` is not a value: 'c has one character, \"cc has two", call.get(from..part.end));
                asm.report(LineFault::new("ASM011", part.clone(), cause, "write texts with .ascii"));
                0
            }
            None if byte(call.text, from) == b'"' => {
                let cause = format!("`{}` is not a value: \"cc has two characters", call.get(from..part.end));
                asm.report(LineFault::new("ASM011", part.clone(), cause, "write one character as 'c"));
                0
            }
            _ => value_of(asm, call.text, from..part.end, if size == DataSize::Byte { 8 } else { 16 }) as u16,
        };
        match size {
            DataSize::Byte => asm.emit(&[value as u8], part),
            DataSize::Word => asm.emit(&value.to_be_bytes(), part),
        }
    }
}

fn begins_operator(c: u8) -> bool {
    matches!(c, b'+' | b'-' | b'*' | b'/' | b'%' | b'&' | b'|' | b'^' | b'<' | b'>' | b'=' | b'!')
}

/// Returns the end and the value of the quoted value at the start of `range`; `None` if there is none, or if
/// it has too few characters.
fn quoted(text: &str, range: Range<usize>) -> Option<(usize, u16)> {
    let mark = byte(text, range.start);
    let count = match mark {
        b'\'' => 1,
        b'"' => 2,
        _ => return None,
    };
    let (mut at, mut value) = (range.start + 1, 0u16);
    for _ in 0..count {
        if at >= range.end {
            return None;
        }
        let (len, code) = match byte(text, at) {
            b'\\' => character(text.as_bytes().get(at..range.end)?)?,
            _ => read_byte(text, at),
        };
        (at, value) = (at + len, value << 8 | u16::from(code));
    }
    let closed = at < range.end && byte(text, at) == mark;
    Some((at + usize::from(closed), value))
}

/// Returns the values between top-level commas without white space around them, but keeps a blank that is a
/// character.
fn cut_values(text: &str, range: Range<usize>) -> Vec<Range<usize>> {
    let (mut parts, mut start, mut at, mut depth) = (Vec::new(), range.start, range.start, 0u32);
    if trim(text, range.clone()).is_empty() {
        return parts;
    }
    // Where the last quoted character ends.
    let mut kept = range.start;
    let whole = |from: usize, to: usize, kept: usize| {
        let part = trim(text, from..to);
        part.start..part.end.max(kept.min(to))
    };
    while at < range.end {
        match byte(text, at) {
            b',' if depth == 0 => {
                parts.push(whole(start, at, kept));
                start = at + 1;
            }
            b'(' => depth += 1,
            b')' => depth = depth.saturating_sub(1),
            b'\'' | b'"' => {
                at = quoted(text, at..range.end).map_or(range.end, |(end, _)| end);
                kept = at;
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    parts.push(whole(start, range.end, kept));
    parts
}
