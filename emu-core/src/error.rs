//! [`CoreError`], the errors of instruction operands and of lookups of source lines.

/// Why an operand cannot be encoded, or why a source line has no address. `Display` gives the cause as one
/// sentence without a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CoreError {
    /// A value is outside of the range of its field.
    #[error("{what} {value} is not in {low}..={high}")]
    OutOfRange {
        /// Name of the value, such as `constant`.
        what: &'static str,
        /// The value.
        value: i32,
        /// The smallest value that fits.
        low: i32,
        /// The largest value that fits.
        high: i32,
    },
    /// An address is outside of its memory.
    #[error("{what} 0x{address:X} is not in 0..=0x{high:X}")]
    AddressOutOfRange {
        /// Name of the address, such as `target`.
        what: &'static str,
        /// The address.
        address: i32,
        /// The highest valid address.
        high: i32,
    },
    /// A register pair is named by its upper (odd) register.
    #[error("{what} r{number} is odd: the lower register of a pair is wanted")]
    OddRegister {
        /// Name of the operand, such as `register`.
        what: &'static str,
        /// The number of the register.
        number: i32,
    },
    /// A target byte address is in the middle of an instruction word.
    #[error("target 0x{address:04X} is odd: instructions are at even addresses")]
    OddTarget {
        /// The byte address.
        address: i32,
    },
    /// A target is in a different page than the next instruction.
    #[error("target 0x{target:04X} is not in the page 0x{page_start:04X} to 0x{page_end:04X} of the next instruction")]
    OutsidePage {
        /// Address of the target.
        target: i32,
        /// First address of the page.
        page_start: i32,
        /// Last address of the page.
        page_end: i32,
    },
    /// The target is out of range of a relative jump.
    #[error("target 0x{target:04X} is {distance} {unit} away; this instruction reaches {low} to {high}")]
    TargetTooFar {
        /// Address of the target.
        target: i32,
        /// Distance from the next instruction to the target, in `unit`.
        distance: i32,
        /// The unit of the distance: `bytes` or `words`.
        unit: &'static str,
        /// The largest distance backwards.
        low: i32,
        /// The largest distance forwards.
        high: i32,
    },
    /// A number is used where a register is required.
    #[error("{value} is a number, and a register is wanted")]
    NumberForRegister {
        /// The number.
        value: i32,
    },
    /// A register of the chip has an address above the I/O addresses.
    #[error("the register at 0x{address:02X} has no I/O address: lds and sts reach it")]
    NoIoAddress {
        /// Data address of the register.
        address: i32,
    },
    /// A NOP has nonzero data bits, for which there is no syntax.
    #[error("a NOP with data in it is written .word 0x{word:04X}")]
    NopWithData {
        /// The instruction word.
        word: i32,
    },
    /// The number of operands is wrong.
    #[error("{wanted} operands wanted, {given} given")]
    OperandCount {
        /// Number of operands that the instruction has.
        wanted: usize,
        /// Number of operands that were given.
        given: usize,
    },
    /// The kind of an op is not a row of the table, because only predecode makes it.
    #[error("not an instruction")]
    NotAnInstruction,
    /// The program has no source-line information.
    #[error("the program has no source lines")]
    NoSourceLines,
    /// The program has no such source file.
    #[error("the program has no source file `{file}`; it has {}", name_list(.known))]
    UnknownSourceFile {
        /// The file that was requested.
        file: String,
        /// The source files of the program.
        known: Vec<String>,
    },
    /// Several source files of the program match the name.
    #[error("`{file}` is one of several source files: {}", name_list(.candidates))]
    AmbiguousSourceFile {
        /// The file that was requested.
        file: String,
        /// The files that match.
        candidates: Vec<String>,
    },
    /// No code was generated for a source line.
    #[error("line {line} of {file} has no code{}", next_line_hint(.file, *.next))]
    LineWithoutCode {
        /// Name of the file.
        file: String,
        /// Number of the line, from 1.
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
