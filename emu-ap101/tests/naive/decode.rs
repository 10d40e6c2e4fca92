//! Decodes a word of AP101 without the crate's table. "S41" is sentence 41 of `../sentences.txt`, "rule 1" a
//! rule of `docs/chips/ap101.md`.

/// The sixteen instructions, numbered from 1 by the reference and from 0 in the word (rule 2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    Ld,
    Ldc,
    Sto,
    Stoc,
    Stc,
    Rtc,
    And,
    Andc,
    Or,
    Orc,
    Xor,
    Not,
    Clr,
    Jmp,
    Jmpc,
    Nop,
}

/// Names and instructions in the reference's order.
pub const OPS: [(&str, Op); 16] = [
    ("LD", Op::Ld),
    ("LDC", Op::Ldc),
    ("STO", Op::Sto),
    ("STOC", Op::Stoc),
    ("STC", Op::Stc),
    ("RTC", Op::Rtc),
    ("AND", Op::And),
    ("ANDC", Op::Andc),
    ("OR", Op::Or),
    ("ORC", Op::Orc),
    ("XOR", Op::Xor),
    ("NOT", Op::Not),
    ("CLR", Op::Clr),
    ("JMP", Op::Jmp),
    ("JMPC", Op::Jmpc),
    ("NOP", Op::Nop),
];

/// The fields of a word (rule 1): code, addressing mode, address or data.
#[derive(Debug, Clone, Copy)]
pub struct Word {
    pub op: Op,
    pub indexed: bool,
    pub field: u16,
}

pub fn decode(word: u16) -> Word {
    let (_, op) = OPS[usize::from(word / 4096)];
    Word { op, indexed: word / 2048 % 2 == 1, field: word % 2048 }
}

/// The location of an address (rule 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Input(usize),
    Output(usize),
    Module(usize),
    Running(usize),
    Port(usize),
    Ram(usize),
    Image(usize),
    Nowhere,
}

/// The location of the field; an index moves it within its kind only (rule 5).
pub fn place(word: Word, rx: u16) -> Place {
    let (zone, offset) = (word.field / 512, usize::from(word.field % 512));
    // First address and number of addresses of each kind.
    let (base, size) = match (zone, offset) {
        (0, _) => (0, 512),
        (1, 0..=255) => (0, 256),
        (2, 0..=127) => (0, 128),
        (2, 128..=255) => (128, 128),
        (2, 256..=383) => (256, 128),
        (3, 0..=255) => (0, 256),
        (3, _) => (256, 256),
        _ => return Place::Nowhere,
    };
    let index = if word.indexed { usize::from(rx) } else { 0 };
    let at = (offset - base + index) % size;
    match (zone, base) {
        (0, _) => Place::Input(at),
        (1, _) => Place::Output(at),
        (2, 0) => Place::Module(at),
        (2, 128) => Place::Running(at),
        (2, _) => Place::Port(at),
        (_, 0) => Place::Ram(at),
        _ => Place::Image(at),
    }
}
