//! The table of AP101's instructions, and what is derived from it: the disassembler and the encoder.
//!
//! The rows have the order of the source, which numbers its instructions from 1; an opcode is that number
//! minus one. Every instruction with an address has two rows, one for each addressing mode: direct, and
//! relative to the index register RX. A direct address that is a plain bit of memory has its own kind.

use emu_core::CoreError;
use emu_core::chip::InstructionSet;
use emu_core::table::{
    DisassembledInstruction, EncodeError, FlowKind, FoundRow, InstructionLocation, InstructionRow, PredecodedOp,
    SyntaxAlias, disassemble as disassemble_line,
};

use crate::operands::{A, D, JumpTarget, X};

/// Passes every row to `callback!`, after the tokens of `{ .. }`. Columns: name, mnemonic, syntax, pattern,
/// operands, machine cycles, registers written, body, kind for plain bits of memory.
#[rustfmt::skip]
macro_rules! ap101_table {
    ($callback:path { $($head:tt)* }) => { $callback! { $($head)* 16; extra {
        /// Leaves the hot loop: the end of the program, a jump that ends or leaves it, a breakpoint, or an
        /// address after the end of memory.
        Slow,
    }
    /// Load: A becomes the bit.
    Ld      "ld"    "a"    "0000 0aaa aaaa aaaa" (a: A)       "1"  "A"  => load(a), LdCell;
    /// Load, relative to RX.
    LdX     "ld"    "a,X"  "0000 1aaa aaaa aaaa" (a: X)       "1"  "A"  => load(a);
    /// Load the complement.
    Ldc     "ldc"   "a"    "0001 0aaa aaaa aaaa" (a: A)       "1"  "A"  => load_not(a), LdcCell;
    /// Load the complement, relative to RX.
    LdcX    "ldc"   "a,X"  "0001 1aaa aaaa aaaa" (a: X)       "1"  "A"  => load_not(a);
    /// Store A.
    Sto     "sto"   "a"    "0010 0aaa aaaa aaaa" (a: A)       "1"  ""   => store(a), StoCell;
    /// Store A, relative to RX.
    StoX    "sto"   "a,X"  "0010 1aaa aaaa aaaa" (a: X)       "1"  ""   => store(a);
    /// Store the complement of A.
    Stoc    "stoc"  "a"    "0011 0aaa aaaa aaaa" (a: A)       "1"  ""   => store_not(a), StocCell;
    /// Store the complement of A, relative to RX.
    StocX   "stoc"  "a,X"  "0011 1aaa aaaa aaaa" (a: X)       "1"  ""   => store_not(a);
    /// Set the bit if A is 1.
    Stc     "stc"   "a"    "0100 0aaa aaaa aaaa" (a: A)       "1"  ""   => store_if(a, true), StcCell;
    /// Set the bit if A is 1, relative to RX.
    StcX    "stc"   "a,X"  "0100 1aaa aaaa aaaa" (a: X)       "1"  ""   => store_if(a, true);
    /// Clear the bit if A is 1.
    Rtc     "rtc"   "a"    "0101 0aaa aaaa aaaa" (a: A)       "1"  ""   => store_if(a, false), RtcCell;
    /// Clear the bit if A is 1, relative to RX.
    RtcX    "rtc"   "a,X"  "0101 1aaa aaaa aaaa" (a: X)       "1"  ""   => store_if(a, false);
    /// And A with the bit.
    And     "and"   "a"    "0110 0aaa aaaa aaaa" (a: A)       "1"  "A"  => and(a), AndCell;
    /// And A with the bit, relative to RX.
    AndX    "and"   "a,X"  "0110 1aaa aaaa aaaa" (a: X)       "1"  "A"  => and(a);
    /// And A with the complement of the bit.
    Andc    "andc"  "a"    "0111 0aaa aaaa aaaa" (a: A)       "1"  "A"  => and_not(a), AndcCell;
    /// And A with the complement of the bit, relative to RX.
    AndcX   "andc"  "a,X"  "0111 1aaa aaaa aaaa" (a: X)       "1"  "A"  => and_not(a);
    /// Or A with the bit.
    Or      "or"    "a"    "1000 0aaa aaaa aaaa" (a: A)       "1"  "A"  => or(a), OrCell;
    /// Or A with the bit, relative to RX.
    OrX     "or"    "a,X"  "1000 1aaa aaaa aaaa" (a: X)       "1"  "A"  => or(a);
    /// Or A with the complement of the bit.
    Orc     "orc"   "a"    "1001 0aaa aaaa aaaa" (a: A)       "1"  "A"  => or_not(a), OrcCell;
    /// Or A with the complement of the bit, relative to RX.
    OrcX    "orc"   "a,X"  "1001 1aaa aaaa aaaa" (a: X)       "1"  "A"  => or_not(a);
    /// Exclusive-or A with the bit.
    Xor     "xor"   "a"    "1010 0aaa aaaa aaaa" (a: A)       "1"  "A"  => xor(a), XorCell;
    /// Exclusive-or A with the bit, relative to RX.
    XorX    "xor"   "a,X"  "1010 1aaa aaaa aaaa" (a: X)       "1"  "A"  => xor(a);
    /// Complement A.
    Not     "not"   ""     "1011 ---- ---- ----" ()           "1"  "A"  => not();
    /// Clear A.
    Clr     "clr"   ""     "1100 ---- ---- ----" ()           "1"  "A"  => clear();
    /// Jump.
    Jmp     "jmp"   "t"    "1101 0ttt tttt tttt" (t: JumpTarget)  "1"  ""   => jump(t);
    /// Jump, relative to RX.
    JmpX    "jmp"   "t,X"  "1101 1ttt tttt tttt" (t: JumpTarget)  "1"  ""   => jump(t);
    /// Jump if A is 1.
    Jmpc    "jmpc"  "t"    "1110 0ttt tttt tttt" (t: JumpTarget)  "1"  ""   => jump_if(t);
    /// Jump if A is 1, relative to RX.
    JmpcX   "jmpc"  "t,X"  "1110 1ttt tttt tttt" (t: JumpTarget)  "1"  ""   => jump_if(t);
    /// No operation.
    Nop     "nop"   ""     "1111 1111 1111 1111" ()           "1"  ""   => nop();
    /// No operation. With bit 11 clear, the field is the preset for a store to a preset port directly before
    /// it. Written as `.word`.
    NopData "nop"   "d"    "1111 dddd dddd dddd" (d: D)       "1"  ""   => data(d);
    } };
}
pub(crate) use ap101_table;

ap101_table!(emu_core::define_isa { Ap101OpKind; });

/// The table for tools. A blank memory is NOPs.
pub const ISA: InstructionSet = InstructionSet {
    disassemble,
    erased_word: NOP,
    rows: ROWS,
    word_bits: WORD_BITS,
    aliases: ALIASES,
    locate: |pc, _| site(pc),
    is_missing: |_| false,
    flow: |row| match KINDS.get(row) {
        Some(Ap101OpKind::Jmpc | Ap101OpKind::JmpcX) => FlowKind::Conditional,
        _ => FlowKind::Straight,
    },
};

/// The word of a plain NOP, and of blank memory.
pub const NOP: u16 = 0xFFFF;

/// Alternative spellings that the assembler accepts: none.
pub const ALIASES: &[SyntaxAlias] = &[];

/// Number of bits of a program word.
pub const WORD_BITS: u32 = 16;

/// Number of words that the next-address register NA can address.
pub const SPAN: usize = 0x800;

/// Bit 11 of a word: the address is relative to RX.
pub const INDEXED: u16 = 0x800;

/// A row of the instruction table with its kind.
#[derive(Debug, Clone, Copy)]
pub struct Ap101Row {
    /// The row.
    pub row: &'static InstructionRow,
    /// The kind of the instruction.
    pub kind: Ap101OpKind,
}

/// Finds the row of the instruction `word`, and its kind. Every word is an instruction.
#[must_use]
pub fn find_row(word: u16) -> Ap101Row {
    let FoundRow { index: i, .. } =
        emu_core::table::find_row(ROWS, WORD_BITS, &[word]).unwrap_or(FoundRow { index: ROWS.len() - 1, bits: 0 });
    Ap101Row { row: &ROWS[i], kind: KINDS[i] }
}

const fn site(pc: u32) -> InstructionLocation {
    InstructionLocation { pc, len: 1, next_len: 1, pc_mask: SPAN as u32 - 1 }
}

/// Encodes an instruction. Operands are in row order; addresses and targets are given by their eleven bits.
///
/// # Errors
/// An operand does not fit; the error says what is allowed.
pub fn encode(kind: Ap101OpKind, operands: &[i32]) -> Result<u16, EncodeError> {
    let row = ROWS.get(kind as usize).ok_or(EncodeError { mnemonic: "(none)", cause: CoreError::NotAnInstruction })?;
    row.encode(operands, &site(0)).map(|word| word as u16)
}

/// Disassembles the instruction at the start of `words`, whose address is `pc`. The mnemonic is in capitals,
/// as in the source.
#[must_use]
pub fn disassemble(words: &[u16], pc: u32) -> DisassembledInstruction {
    let mut line = disassemble_line(ROWS, WORD_BITS, words, &site(pc));
    // If the line is a raw word, the instruction is in a comment after it.
    let first = line.text.find("; ").map_or(0, |comment| comment + 2);
    let first = if line.row.is_some() { 0 } else { first };
    if line.row.is_some() || first > 0 {
        let end = line.text[first..].find(' ').map_or(line.text.len(), |end| first + end);
        let shouted = line.text[first..end].to_ascii_uppercase();
        line.text.replace_range(first..end, &shouted);
    }
    line
}

/// A predecoded instruction.
pub type Ap101Op = PredecodedOp<Ap101OpKind>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_in_the_order_of_rows() {
        assert!(KINDS.iter().enumerate().all(|(i, &kind)| kind as usize == i));
    }

    #[test]
    fn every_word_is_an_instruction() {
        assert!((0..=u16::MAX).all(|word| emu_core::table::find_row(ROWS, WORD_BITS, &[word]).is_some()));
    }
}
