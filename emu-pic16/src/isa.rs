//! The table of mid-range PIC16 instructions, and all functions that read it.
//!
//! Source: DS33023, section 29 "Instruction Set". The rows are in the order of its summary: byte-oriented,
//! bit-oriented, literal and control operations. The destination bit is part of the row, so each destination
//! has its own specialized body. Rows with a file register name a second kind, for file registers in RAM. The
//! cycles column is for all file registers except PCL: an instruction that writes PCL takes one cycle more.

use emu_core::CoreError;
use emu_core::chip::InstructionSet;
use emu_core::table::{
    DisassembledInstruction, EncodeError, FlowKind, FoundRow, InstructionLocation, InstructionRow, PredecodedOp,
    SyntaxAlias, alias, disassemble as disassemble_line,
};

use crate::operands::{B, F, JumpTarget, K};

/// Passes every row to `callback!`, after the tokens in `{ .. }`. Columns: name, mnemonic, syntax, pattern,
/// operands, instruction cycles, flags written (C, D for DC, Z), body, kind for operands in RAM.
#[rustfmt::skip]
macro_rules! pic16_table {
    ($callback:path { $($head:tt)* }) => { $callback! { $($head)* 14; extra {
        /// Not an instruction: no row matches the word. It stops the run.
        Illegal,
        /// A word with a breakpoint.
        Breakpoint,
        /// The last instruction of a loop that may repeat without changing anything.
        PollingLoop,
        /// `btfsc` of RAM with a GOTO after it: a conditional jump.
        BtfscGoto,
        /// `btfss` of RAM with a GOTO after it.
        BtfssGoto,
        /// `decfsz f, F` of RAM with a GOTO after it.
        DecfszGoto,
        /// `incfsz f, F` of RAM with a GOTO after it.
        IncfszGoto,
        /// `btfsc` of a register with a GOTO after it.
        BtfscSfrGoto,
        /// `btfss` of a register with a GOTO after it.
        BtfssSfrGoto,
    }
    // Byte-oriented file register operations.
    /// Add W and file register, to W.
    AddwfW   "addwf"   "f, W"  "00 0111 0fff ffff" (f: F)        "1"   "CDZ" => addwf(f, true), AddwfWRam;
    /// Add W and file register, to the file register.
    AddwfF   "addwf"   "f, F"  "00 0111 1fff ffff" (f: F)        "1"   "CDZ" => addwf(f, false), AddwfFRam;
    /// And W with file register, to W.
    AndwfW   "andwf"   "f, W"  "00 0101 0fff ffff" (f: F)        "1"   "Z"   => andwf(f, true), AndwfWRam;
    /// And W with file register, to the file register.
    AndwfF   "andwf"   "f, F"  "00 0101 1fff ffff" (f: F)        "1"   "Z"   => andwf(f, false), AndwfFRam;
    /// Clear file register.
    Clrf     "clrf"    "f"     "00 0001 1fff ffff" (f: F)        "1"   "Z"   => clrf(f), ClrfRam;
    /// Clear W. Open bits are encoded as Microchip's assembler does.
    Clrw     "clrw"    ""      "00 0001 0--- --++" ()            "1"   "Z"   => clrw();
    /// Complement file register, to W.
    ComfW    "comf"    "f, W"  "00 1001 0fff ffff" (f: F)        "1"   "Z"   => comf(f, true), ComfWRam;
    /// Complement file register, to the file register.
    ComfF    "comf"    "f, F"  "00 1001 1fff ffff" (f: F)        "1"   "Z"   => comf(f, false), ComfFRam;
    /// Decrement file register, to W.
    DecfW    "decf"    "f, W"  "00 0011 0fff ffff" (f: F)        "1"   "Z"   => decf(f, true), DecfWRam;
    /// Decrement file register, to the file register.
    DecfF    "decf"    "f, F"  "00 0011 1fff ffff" (f: F)        "1"   "Z"   => decf(f, false), DecfFRam;
    /// Decrement file register, skip if zero, to W.
    DecfszW  "decfsz"  "f, W"  "00 1011 0fff ffff" (f: F)        "1/2" ""    => decfsz(f, true), DecfszWRam;
    /// Decrement file register, skip if zero, to the file register.
    DecfszF  "decfsz"  "f, F"  "00 1011 1fff ffff" (f: F)        "1/2" ""    => decfsz(f, false), DecfszFRam;
    /// Increment file register, to W.
    IncfW    "incf"    "f, W"  "00 1010 0fff ffff" (f: F)        "1"   "Z"   => incf(f, true), IncfWRam;
    /// Increment file register, to the file register.
    IncfF    "incf"    "f, F"  "00 1010 1fff ffff" (f: F)        "1"   "Z"   => incf(f, false), IncfFRam;
    /// Increment file register, skip if zero, to W.
    IncfszW  "incfsz"  "f, W"  "00 1111 0fff ffff" (f: F)        "1/2" ""    => incfsz(f, true), IncfszWRam;
    /// Increment file register, skip if zero, to the file register.
    IncfszF  "incfsz"  "f, F"  "00 1111 1fff ffff" (f: F)        "1/2" ""    => incfsz(f, false), IncfszFRam;
    /// Inclusive-or W with file register, to W.
    IorwfW   "iorwf"   "f, W"  "00 0100 0fff ffff" (f: F)        "1"   "Z"   => iorwf(f, true), IorwfWRam;
    /// Inclusive-or W with file register, to the file register.
    IorwfF   "iorwf"   "f, F"  "00 0100 1fff ffff" (f: F)        "1"   "Z"   => iorwf(f, false), IorwfFRam;
    /// Move file register, to W.
    MovfW    "movf"    "f, W"  "00 1000 0fff ffff" (f: F)        "1"   "Z"   => movf(f, true), MovfWRam;
    /// Move file register, to the file register.
    MovfF    "movf"    "f, F"  "00 1000 1fff ffff" (f: F)        "1"   "Z"   => movf(f, false), MovfFRam;
    /// Move W to file register.
    Movwf    "movwf"   "f"     "00 0000 1fff ffff" (f: F)        "1"   ""    => movwf(f), MovwfRam;
    /// No operation.
    Nop      "nop"     ""      "00 0000 0--0 0000" ()            "1"   ""    => nop();
    /// Rotate left through carry, to W.
    RlfW     "rlf"     "f, W"  "00 1101 0fff ffff" (f: F)        "1"   "C"   => rlf(f, true), RlfWRam;
    /// Rotate left through carry, to the file register.
    RlfF     "rlf"     "f, F"  "00 1101 1fff ffff" (f: F)        "1"   "C"   => rlf(f, false), RlfFRam;
    /// Rotate right through carry, to W.
    RrfW     "rrf"     "f, W"  "00 1100 0fff ffff" (f: F)        "1"   "C"   => rrf(f, true), RrfWRam;
    /// Rotate right through carry, to the file register.
    RrfF     "rrf"     "f, F"  "00 1100 1fff ffff" (f: F)        "1"   "C"   => rrf(f, false), RrfFRam;
    /// Subtract W from file register, to W.
    SubwfW   "subwf"   "f, W"  "00 0010 0fff ffff" (f: F)        "1"   "CDZ" => subwf(f, true), SubwfWRam;
    /// Subtract W from file register, to the file register.
    SubwfF   "subwf"   "f, F"  "00 0010 1fff ffff" (f: F)        "1"   "CDZ" => subwf(f, false), SubwfFRam;
    /// Swap the halves of file register, to W.
    SwapfW   "swapf"   "f, W"  "00 1110 0fff ffff" (f: F)        "1"   ""    => swapf(f, true), SwapfWRam;
    /// Swap the halves of file register, to the file register.
    SwapfF   "swapf"   "f, F"  "00 1110 1fff ffff" (f: F)        "1"   ""    => swapf(f, false), SwapfFRam;
    /// Exclusive-or W with file register, to W.
    XorwfW   "xorwf"   "f, W"  "00 0110 0fff ffff" (f: F)        "1"   "Z"   => xorwf(f, true), XorwfWRam;
    /// Exclusive-or W with file register, to the file register.
    XorwfF   "xorwf"   "f, F"  "00 0110 1fff ffff" (f: F)        "1"   "Z"   => xorwf(f, false), XorwfFRam;
    // Bit-oriented file register operations.
    /// Clear bit of file register.
    Bcf      "bcf"     "f, b"  "01 00bb bfff ffff" (f: F, b: B)  "1"   ""    => set_bit(f, b, false), BcfRam;
    /// Set bit of file register.
    Bsf      "bsf"     "f, b"  "01 01bb bfff ffff" (f: F, b: B)  "1"   ""    => set_bit(f, b, true), BsfRam;
    /// Test bit of file register, skip if clear.
    Btfsc    "btfsc"   "f, b"  "01 10bb bfff ffff" (f: F, b: B)  "1/2" ""    => skip_bit(f, b, false), BtfscRam;
    /// Test bit of file register, skip if set.
    Btfss    "btfss"   "f, b"  "01 11bb bfff ffff" (f: F, b: B)  "1/2" ""    => skip_bit(f, b, true), BtfssRam;
    // Literal and control operations.
    /// Add constant to W.
    Addlw    "addlw"   "k"     "11 111- kkkk kkkk" (k: K)        "1"   "CDZ" => addlw(k);
    /// And constant with W.
    Andlw    "andlw"   "k"     "11 1001 kkkk kkkk" (k: K)        "1"   "Z"   => andlw(k);
    /// Call subroutine.
    Call     "call"    "t"     "10 0ttt tttt tttt" (t: JumpTarget)   "2"   ""    => call(t);
    /// Clear the watchdog timer.
    Clrwdt   "clrwdt"  ""      "00 0000 0110 0100" ()            "1"   ""    => clrwdt();
    /// Go to address.
    Goto     "goto"    "t"     "10 1ttt tttt tttt" (t: JumpTarget)   "2"   ""    => goto(t);
    /// Inclusive-or constant with W.
    Iorlw    "iorlw"   "k"     "11 1000 kkkk kkkk" (k: K)        "1"   "Z"   => iorlw(k);
    /// Move constant to W.
    Movlw    "movlw"   "k"     "11 00-- kkkk kkkk" (k: K)        "1"   ""    => movlw(k);
    /// Return from interrupt.
    Retfie   "retfie"  ""      "00 0000 0000 1001" ()            "2"   ""    => retfie();
    /// Return with constant in W.
    Retlw    "retlw"   "k"     "11 01-- kkkk kkkk" (k: K)        "2"   ""    => retlw(k);
    /// Return from subroutine.
    Return   "return"  ""      "00 0000 0000 1000" ()            "2"   ""    => return_();
    /// Go into standby mode.
    Sleep    "sleep"   ""      "00 0000 0110 0011" ()            "1"   ""    => sleep();
    /// Subtract W from constant.
    Sublw    "sublw"   "k"     "11 110- kkkk kkkk" (k: K)        "1"   "CDZ" => sublw(k);
    /// Exclusive-or constant with W.
    Xorlw    "xorlw"   "k"     "11 1010 kkkk kkkk" (k: K)        "1"   "Z"   => xorlw(k);
    /// Load OPTION with W; for code of older chips.
    Option   "option"  ""      "00 0000 0110 0010" ()            "1"   ""    => option();
    /// Load TRISA with W; for code of older chips.
    TrisA    "tris"    "5"     "00 0000 0110 0101" ()            "1"   ""    => tris(Sfr::TRISA);
    /// Load TRISB with W; for code of older chips.
    TrisB    "tris"    "6"     "00 0000 0110 0110" ()            "1"   ""    => tris(Sfr::TRISB);
    /// Load TRISC with W; for code of older chips.
    TrisC    "tris"    "7"     "00 0000 0110 0111" ()            "1"   ""    => tris(Sfr::TRISC);
    } };
}
pub(crate) use pic16_table;

pic16_table!(emu_core::define_isa { Pic16OpKind; });

/// The instruction set as tools see it. Erased program memory is all ones, which is `addlw 0xFF` with an open
/// bit set.
pub const ISA: InstructionSet = InstructionSet {
    disassemble,
    erased_word: 0x3FFF,
    rows: ROWS,
    word_bits: WORD_BITS,
    aliases: ALIASES,
    locate: |pc, _| locate(pc),
    is_missing: |_| false,
    flow,
};

/// Returns the effect of a row on the program flow. An instruction is conditional exactly if its number of
/// cycles varies.
fn flow(row: usize) -> FlowKind {
    match (KINDS.get(row), ROWS.get(row)) {
        (Some(Pic16OpKind::Retfie), _) => FlowKind::EndsInterrupt,
        (_, Some(row)) if row.has_variable_cycles() => FlowKind::Conditional,
        _ => FlowKind::Straight,
    }
}

/// Alternative spellings that the assembler accepts: mnemonic, syntax, then mnemonic and operands that they
/// mean.
#[rustfmt::skip]
pub const ALIASES: &[SyntaxAlias] = &[
    // The default destination is the file register.
    alias("addwf", "f", "addwf", "f,F"), alias("andwf", "f", "andwf", "f,F"), alias("comf", "f", "comf", "f,F"), alias("decf", "f", "decf", "f,F"),
    alias("decfsz", "f", "decfsz", "f,F"), alias("incf", "f", "incf", "f,F"), alias("incfsz", "f", "incfsz", "f,F"),
    alias("iorwf", "f", "iorwf", "f,F"), alias("movf", "f", "movf", "f,F"), alias("rlf", "f", "rlf", "f,F"), alias("rrf", "f", "rrf", "f,F"),
    alias("subwf", "f", "subwf", "f,F"), alias("swapf", "f", "swapf", "f,F"), alias("xorwf", "f", "xorwf", "f,F"),
    // TRIS takes the low bits of the register's address.
    alias("tris", "TRISA", "tris", "5"), alias("tris", "TRISB", "tris", "6"), alias("tris", "TRISC", "tris", "7"),
];

/// Number of bits in a program word.
pub const WORD_BITS: u32 = 14;

/// Number of words that the program counter can address.
pub const SPAN: usize = 0x2000;

/// A row of the instruction table with its kind.
#[derive(Debug, Clone, Copy)]
pub struct Pic16Row {
    /// The row.
    pub row: &'static InstructionRow,
    /// The kind of the instruction.
    pub kind: Pic16OpKind,
}

/// Returns the row and kind of the instruction `word`; None for a word without a row.
#[must_use]
pub fn find_row(word: u16) -> Option<Pic16Row> {
    let FoundRow { index: i, .. } = emu_core::table::find_row(ROWS, WORD_BITS, &[word])?;
    Some(Pic16Row { row: &ROWS[i], kind: KINDS[i] })
}

fn locate(pc: u32) -> InstructionLocation {
    InstructionLocation { pc, len: 1, next_len: 1, pc_mask: SPAN as u32 - 1 }
}

/// Encodes an instruction. Operands are in row order: file registers by the low seven address bits, bits by
/// number, constants, targets by the low eleven address bits.
///
/// # Errors
/// Fails if an operand does not fit; the error gives the allowed values.
pub fn encode(kind: Pic16OpKind, operands: &[i32]) -> Result<u16, EncodeError> {
    let row = ROWS.get(kind as usize).ok_or(EncodeError { mnemonic: "(none)", cause: CoreError::NotAnInstruction })?;
    row.encode(operands, &locate(0)).map(|bits| bits as u16)
}

/// Disassembles the instruction at the start of `words`, at the word address `pc`.
#[must_use]
pub fn disassemble(words: &[u16], pc: u32) -> DisassembledInstruction {
    disassemble_line(ROWS, WORD_BITS, words, &locate(pc))
}

/// A predecoded PIC16 instruction.
pub type Pic16Op = PredecodedOp<Pic16OpKind>;

#[cfg(test)]
mod tests {
    #[test]
    fn kinds_are_in_the_order_of_rows() {
        assert!(super::KINDS.iter().enumerate().all(|(i, &kind)| kind as usize == i));
    }
}
