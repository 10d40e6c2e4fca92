//! Assembly text off the table: disassembly, and the assembler of one line.

use diag::Code;

use super::{Row, Site, find, words_of};

/// The codes of the one-line assembler.
pub const CODES: &[Code] = &[
    Code {
        code: "ASM001",
        title: "unknown mnemonic",
        explain: "The first word of the line is no instruction of this chip. `emu disasm` and the page docs/isa list those that are.",
    },
    Code {
        code: "ASM002",
        title: "operands fit no form of the instruction",
        explain: "The instruction exists, but not with operands of these kinds, this number or this order. The hint lists its forms; \
                  lower-case letters stand for operands, everything else is written as shown.",
    },
    Code {
        code: "ASM003",
        title: "operand out of range",
        explain: "The operand has the right kind but the instruction has no bits for this value: `ldi` takes r16 to r31, a relative \
                  branch reaches 64 words, and so on.",
    },
    Code {
        code: "ASM004",
        title: "empty line",
        explain: "There is nothing to assemble on the line but a comment or white space.",
    },
];

/// One disassembled instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// Mnemonic and operands, or `.word 0x....` (`.db 0x..` where words are bytes) with the meaning in a comment.
    pub text: String,
    /// Length in program words.
    pub len: usize,
    /// Position of the row; `None` when no row matches.
    pub row: Option<usize>,
    /// Operands in the order of the row: the name of the kind and the value. None where no row matches.
    pub operands: Vec<(&'static str, i32)>,
}

/// Directives for a program word as it is.
const WORD: &str = ".word";
const BYTE: &str = ".db";

/// Disassembles the instruction at the front of `words`, which stands at `site.pc`.
///
/// A word that no row matches, or an instruction cut off by the end of `words`, prints as `.word 0x....`. Program words have `word_bits` bits; targets print as byte addresses where `bytes_per_word` is 2.
#[must_use]
pub fn disassemble(rows: &[Row], word_bits: u32, words: &[u16], site: &Site) -> Line {
    let first = words.first().copied().unwrap_or(0);
    let (directive, digits) = if word_bits == 8 { (BYTE, 2) } else { (WORD, 4) };
    let raw = |why: &str| Line {
        text: format!("{directive} 0x{first:0digits$x}{why}"),
        len: 1,
        row: None,
        operands: Vec::new(),
    };
    let Some((index, bits)) = find(rows, word_bits, words) else {
        return raw("");
    };
    let row = &rows[index];
    if row.len() as usize > words.len() {
        return raw(&format!("  ; first word of {}, cut off", row.mnemonic));
    }
    let site = Site { len: row.len(), ..*site };
    let values: Vec<i32> = row.operands_of(bits, &site).collect();
    let mut text = String::from(row.mnemonic);
    if !row.syntax.is_empty() {
        while text.len() < 5 {
            text.push(' ');
        }
        text.push(' ');
    }
    for c in row.syntax.bytes() {
        match row.operands.iter().position(|s| s.letter == c) {
            Some(i) => (row.operands[i].kind.text)(values[i], &mut text),
            None => text.push(c as char),
        }
    }
    // Bits that the pattern leaves open must come back as they were, or the word is not this instruction in text.
    let shown: Vec<i32> =
        row.operands.iter().zip(&values).filter(|(s, _)| row.pattern.has(s.letter)).map(|(_, &v)| v).collect();
    match row.encode(&shown, &site) {
        Ok(back) if back == bits => {
            let operands = row.operands.iter().map(|slot| slot.kind.name).zip(values).collect();
            Line { text, len: row.len() as usize, row: Some(index), operands }
        }
        _ => raw(&format!("  ; {text}")),
    }
}

/// What is wrong with a line of assembly.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AsmError {
    /// Stable code (`ASM001` to `ASM004`).
    pub code: &'static str,
    /// The cause, one sentence.
    pub cause: String,
    /// The hint, one sentence.
    pub hint: String,
}

impl std::fmt::Display for AsmError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {} ({})", self.code, self.cause, self.hint)
    }
}

impl std::error::Error for AsmError {}

/// Another spelling of a row: mnemonic, syntax, the row's mnemonic, and its operands written with the alias's letters.
pub type Alias = (&'static str, &'static str, &'static str, &'static str);

/// Assembles one line (mnemonic and operands; a comment behind `;` is ignored) that will stand at `site.pc`.
///
/// Returns the instruction's words. `.word N` (`.db N` where words are bytes) gives the word itself.
///
/// # Errors
/// `ASM001` unknown mnemonic, `ASM002` operands that fit no form, `ASM003` an operand out of range, `ASM004` empty line.
pub fn assemble(
    rows: &[Row],
    aliases: &[Alias],
    word_bits: u32,
    line: &str,
    site: &Site,
) -> Result<Vec<u16>, AsmError> {
    let line = line.split(';').next().unwrap_or("").trim();
    let (mnemonic, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let mnemonic = mnemonic.to_ascii_lowercase();
    let operands: String = rest.chars().filter(|c| !c.is_whitespace()).collect();
    if mnemonic.is_empty() {
        return Err(AsmError {
            code: "ASM004",
            cause: "the line is empty".into(),
            hint: "write a mnemonic and its operands".into(),
        });
    }
    if mnemonic == if word_bits == 8 { BYTE } else { WORD } {
        let value = number(&operands).filter(|v| (0..1 << word_bits).contains(v)).ok_or_else(|| AsmError {
            code: "ASM003",
            cause: format!("`{operands}` is not a word of {word_bits} bits"),
            hint: format!("give a number from 0 to {}", (1u32 << word_bits) - 1),
        })?;
        return Ok(vec![value as u16]);
    }
    for &(name, syntax, target, written) in aliases.iter().filter(|a| a.0 == mnemonic) {
        if let Some(parts) = split(syntax, &operands) {
            let text: String = written
                .chars()
                .map(|c| parts.iter().find(|(l, _)| *l == c).map_or_else(|| c.to_string(), |(_, t)| (*t).to_owned()))
                .collect();
            debug_assert!(name != target, "an alias that names itself would not end");
            return assemble(rows, aliases, word_bits, &format!("{target} {text}"), site);
        }
    }
    let forms: Vec<&Row> = rows.iter().filter(|r| r.mnemonic == mnemonic).collect();
    if forms.is_empty() {
        let hint = nearest(rows, &mnemonic)
            .map_or_else(|| "see the instruction list".into(), |n| format!("did you mean `{n}`?"));
        return Err(AsmError { code: "ASM001", cause: format!("`{mnemonic}` is no instruction of this chip"), hint });
    }
    let mut out_of_range = None;
    for row in &forms {
        let site = Site { len: row.len(), ..*site };
        let Some(values) = match_operands(row, &operands, &site, word_bits) else { continue };
        match row.encode(&values, &site) {
            Ok(bits) => return Ok(words_of(row, word_bits, bits)),
            Err(e) => out_of_range = Some(e.cause),
        }
    }
    let wanted: Vec<String> = forms.iter().map(|r| format!("{} {}", r.mnemonic, r.syntax)).collect();
    Err(match out_of_range {
        Some(cause) => {
            AsmError { code: "ASM003", cause: format!("{mnemonic}: {cause}"), hint: "use a value in range".into() }
        }
        None => AsmError {
            code: "ASM002",
            cause: format!("`{operands}` fits no form of {mnemonic}"),
            hint: format!("forms: {}", wanted.join(", ")),
        },
    })
}

/// Splits operand text by a syntax: literal characters must stand there (case aside), letters take what is between them.
fn split<'t>(syntax: &str, text: &'t str) -> Option<Vec<(char, &'t str)>> {
    let syntax: Vec<char> = syntax.chars().filter(|c| !c.is_whitespace()).collect();
    let mut parts = Vec::new();
    let mut rest = text;
    let mut i = 0;
    while i < syntax.len() {
        if syntax[i].is_ascii_lowercase() {
            let end = match syntax.get(i + 1) {
                Some(&stop) => rest.to_ascii_uppercase().find(stop)?,
                None => rest.len(),
            };
            parts.push((syntax[i], &rest[..end]));
            rest = &rest[end..];
        } else {
            let c = rest.chars().next()?;
            if !c.eq_ignore_ascii_case(&syntax[i]) {
                return None;
            }
            rest = &rest[c.len_utf8()..];
        }
        i += 1;
    }
    rest.is_empty().then_some(parts)
}

/// A number, or the address of the instruction (`$`, and `.` with an offset from the next one) in the unit of the text.
fn plain(text: &str, site: &Site, word_bits: u32) -> Option<i32> {
    let unit = if word_bits == 16 { 2 } else { 1 };
    let at = site.pc as i32 * unit;
    match text.strip_prefix('.') {
        Some("") => Some(at),
        Some(offset) => Some(at + unit + number(offset.strip_prefix('+').unwrap_or(offset))?),
        None if text == "$" => Some(at),
        None => number(text),
    }
}

fn match_operands(row: &Row, text: &str, site: &Site, word_bits: u32) -> Option<Vec<i32>> {
    let parts = split(row.syntax, text)?;
    row.operands
        .iter()
        .filter(|s| row.pattern.has(s.letter))
        .map(|slot| {
            let (_, piece) = parts.iter().find(|(l, _)| *l == slot.letter as char)?;
            (slot.kind.named)(piece).or_else(|| (slot.kind.number)(plain(piece, site, word_bits)?, site).ok())
        })
        .collect()
}

/// Reads a number: decimal, `0x` or `$` hexadecimal, `0b` binary, with an optional minus.
#[must_use]
pub fn number(text: &str) -> Option<i32> {
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |d| (true, d));
    if digits.starts_with(['+', '-']) {
        return None;
    }
    let lower = digits.to_ascii_lowercase();
    let value = if let Some(hex) = lower.strip_prefix("0x").or_else(|| lower.strip_prefix('$')) {
        i64::from_str_radix(hex, 16).ok()?
    } else if let Some(bin) = lower.strip_prefix("0b") {
        i64::from_str_radix(bin, 2).ok()?
    } else {
        lower.parse::<i64>().ok()?
    };
    i32::try_from(if negative { -value } else { value }).ok()
}

fn nearest(rows: &[Row], word: &str) -> Option<&'static str> {
    let near = |name: &&'static str| {
        let (a, b) = (name.as_bytes(), word.as_bytes());
        let same = a.iter().zip(b).filter(|(x, y)| x == y).count();
        same + 1 >= a.len().max(b.len())
    };
    rows.iter().map(|r| r.mnemonic).find(near)
}
