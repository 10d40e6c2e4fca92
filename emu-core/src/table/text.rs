//! Assembly text from the table: the disassembler, and types for the assembler.

use super::{InstructionLocation, InstructionRow, find_row};
use crate::table::FoundRow;

/// An operand of a disassembled instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NamedOperand {
    /// The name of the kind, such as `data address`.
    pub kind: &'static str,
    /// The value.
    pub value: i32,
}

/// One disassembled instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisassembledInstruction {
    /// Mnemonic and operands, or `.word 0x....` (`.db 0x..` where words are bytes) with the meaning in a
    /// comment.
    pub text: String,
    /// Length in program words.
    pub len: usize,
    /// Position of the row, or `None` if no row matches.
    pub row: Option<usize>,
    /// Operands in the order of the row. Empty if no row matches.
    pub operands: Vec<NamedOperand>,
}

/// Directives for a program word that is not an instruction.
const WORD: &str = ".word";
const BYTE: &str = ".db";

/// Disassembles the instruction at the start of `words`, which is at the address `site.pc`.
///
/// A word that no row matches, or an instruction cut off by the end of `words`, prints as `.word 0x....`.
/// Program words have `word_bits` bits.
#[must_use]
pub fn disassemble(
    rows: &[InstructionRow],
    word_bits: u32,
    words: &[u16],
    site: &InstructionLocation,
) -> DisassembledInstruction {
    let first = words.first().copied().unwrap_or(0);
    let (directive, digits) = if word_bits == 8 { (BYTE, 2) } else { (WORD, 4) };
    let raw = |why: &str| DisassembledInstruction {
        text: format!("{directive} 0x{first:0digits$x}{why}"),
        len: 1,
        row: None,
        operands: Vec::new(),
    };
    let Some(FoundRow { index, bits }) = find_row(rows, word_bits, words) else {
        return raw("");
    };
    let row = &rows[index];
    if row.len() as usize > words.len() {
        return raw(&format!("  ; first word of {}, cut off", row.mnemonic));
    }
    let site = InstructionLocation { len: row.len(), ..*site };
    let values: Vec<i32> = row.operand_values(bits, &site).collect();
    let mut text = String::from(row.mnemonic);
    if !row.syntax.is_empty() {
        while text.len() < 5 {
            text.push(' ');
        }
        text.push(' ');
    }
    for c in row.syntax.bytes() {
        match row.operands.iter().position(|s| s.letter == c) {
            Some(i) => (row.operands[i].kind.write_text)(values[i], &mut text),
            None => text.push(c as char),
        }
    }
    // If encoding the text does not give back all bits, the word is not this instruction in text form.
    let shown: Vec<i32> =
        row.operands.iter().zip(&values).filter(|(s, _)| row.pattern.has_letter(s.letter)).map(|(_, &v)| v).collect();
    match row.encode(&shown, &site) {
        Ok(back) if back == bits => {
            let operands = row
                .operands
                .iter()
                .zip(values)
                .map(|(slot, value)| NamedOperand { kind: slot.kind.name, value })
                .collect();
            DisassembledInstruction { text, len: row.len() as usize, row: Some(index), operands }
        }
        _ => raw(&format!("  ; {text}")),
    }
}

/// An error in a line of assembly.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{code}: {cause} ({hint})")]
pub struct AsmError {
    /// Stable code (`ASM001` to `ASM004`).
    pub code: &'static str,
    /// The cause: one sentence.
    pub cause: String,
    /// The hint: one sentence.
    pub hint: String,
}

/// An alternative spelling of a row of the instruction table.
#[derive(Debug, Clone, Copy)]
pub struct SyntaxAlias {
    /// The mnemonic of the alias.
    pub mnemonic: &'static str,
    /// Its operands, each a letter, with their punctuation.
    pub syntax: &'static str,
    /// The mnemonic of the row that it stands for.
    pub row_mnemonic: &'static str,
    /// The row's operands, written with the letters of the alias.
    pub row_operands: &'static str,
}

/// Makes an alias from its mnemonic and syntax, and the mnemonic and operands that it stands for.
#[must_use]
pub const fn alias(
    mnemonic: &'static str,
    syntax: &'static str,
    row_mnemonic: &'static str,
    row_operands: &'static str,
) -> SyntaxAlias {
    SyntaxAlias { mnemonic, syntax, row_mnemonic, row_operands }
}
