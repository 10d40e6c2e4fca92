//! What can be wrong with an operand of an instruction, or with a source line that is asked for.

/// Why an operand cannot be encoded, or why a source line has no address. `Display` is the cause, one sentence without
/// a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CoreError {
    /// A value lies outside of what its field holds.
    #[error("{what} {value} is not in {low}..={high}")]
    OutOfRange {
        /// What the value is, such as `constant`.
        what: &'static str,
        /// The value.
        value: i32,
        /// The least that fits.
        low: i32,
        /// The most that fits.
        high: i32,
    },
    /// An address lies outside of its memory.
    #[error("{what} 0x{address:X} is not in 0..=0x{high:X}")]
    AddressOutOfRange {
        /// What the address is of, such as `target`.
        what: &'static str,
        /// The address.
        address: i32,
        /// The highest address.
        high: i32,
    },
    /// A register pair is named by its upper register.
    #[error("{what} r{number} is odd: the lower register of a pair is wanted")]
    OddRegister {
        /// What the operand is, such as `register`.
        what: &'static str,
        /// The number of the register.
        number: i32,
    },
    /// A target in bytes lies within an instruction word.
    #[error("target 0x{address:04X} is odd: instructions stand at even addresses")]
    OddTarget {
        /// The byte address.
        address: i32,
    },
    /// A target lies in another page than the next instruction.
    #[error("target 0x{target:04X} is not in the page 0x{page_start:04X} to 0x{page_end:04X} of the next instruction")]
    OutsidePage {
        /// The target's address.
        target: i32,
        /// First address of the page.
        page_start: i32,
        /// Last address of the page.
        page_end: i32,
    },
    /// A relative jump does not reach its target.
    #[error("target 0x{target:04X} is {distance} {unit} away; this instruction reaches {low} to {high}")]
    TargetTooFar {
        /// The target's address.
        target: i32,
        /// How far it is from the next instruction, in `unit`.
        distance: i32,
        /// What the distance counts: `bytes` or `words`.
        unit: &'static str,
        /// The farthest backwards.
        low: i32,
        /// The farthest forwards.
        high: i32,
    },
    /// A number stands where a register is wanted.
    #[error("{value} is a number, and a register is wanted")]
    NumberForRegister {
        /// The number.
        value: i32,
    },
    /// A register of the chip lies beyond the I/O addresses.
    #[error("the register at 0x{address:02X} has no I/O address: lds and sts reach it")]
    NoIoAddress {
        /// The register's data address.
        address: i32,
    },
    /// A NOP is given data, which has no syntax of its own.
    #[error("a NOP with data in it is written .word 0x{word:04X}")]
    NopWithData {
        /// The instruction word that is meant.
        word: i32,
    },
    /// An instruction has another number of operands.
    #[error("{wanted} operands wanted, {given} given")]
    OperandCount {
        /// How many the instruction has.
        wanted: usize,
        /// How many there are.
        given: usize,
    },
    /// The kind of op is none of the table's rows: predecode makes it.
    #[error("not an instruction")]
    NotAnInstruction,
    /// The program has no source lines.
    #[error("the program has no source lines")]
    NoSourceLines,
    /// The program has no such source file.
    #[error("the program has no source file `{file}`; it has {}", name_list(.known))]
    UnknownSourceFile {
        /// The file that is asked for.
        file: String,
        /// The files of the program.
        known: Vec<String>,
    },
    /// Several source files of the program may be meant.
    #[error("`{file}` is one of several source files: {}", name_list(.candidates))]
    AmbiguousSourceFile {
        /// The file that is asked for.
        file: String,
        /// The files that it may be.
        candidates: Vec<String>,
    },
    /// A source line has no code.
    #[error("line {line} of {file} has no code{}", next_line_hint(.file, *.next))]
    LineWithoutCode {
        /// The file's name.
        file: String,
        /// The line, from 1.
        line: u32,
        /// The next line of the file that has code.
        next: Option<u32>,
    },
}

fn name_list(names: &[String]) -> String {
    const MAX_LISTED: usize = 8;
    let more = if names.len() > MAX_LISTED { ", .." } else { "" };
    format!("{}{more}", names.iter().take(MAX_LISTED).map(String::as_str).collect::<Vec<_>>().join(", "))
}

fn next_line_hint(file: &str, next: Option<u32>) -> String {
    next.map_or(String::new(), |next| format!("; the next line that has is {file}:{next}"))
}
