//! [`UsageError`], the errors in values of flags and arguments.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use emu_core::CoreError;
use emu_debug::InputError;

/// Why the value of a flag or argument cannot be used. `Display` is the cause, without a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UsageError {
    /// A time, an address or a symbol cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A source line has no address.
    #[error(transparent)]
    Line(#[from] CoreError),
    /// The value does not have the expected form, or is not one of the possible values.
    #[error("{expected}")]
    Malformed {
        /// What is expected, with an example: `write NAME or NAME=VALUE, as in F_CPU=8000000`.
        expected: Cow<'static, str>,
    },
    /// A part of the value does not have the expected form.
    #[error("`{part}` is not {wanted}; {expected}")]
    MalformedPart {
        /// The part.
        part: String,
        /// What it should be, such as `a seed`.
        wanted: &'static str,
        /// What is expected, with an example.
        expected: Cow<'static, str>,
    },
    /// A name is not in a list.
    #[error("there is no {kind}`{name}`{expected}")]
    UnknownName {
        /// The kind of the name with a space at its end, such as `bus `, or nothing.
        kind: &'static str,
        /// The name.
        name: String,
        /// The known names, after a comma, semicolon or word.
        expected: String,
    },
    /// A setting is given twice.
    #[error("`{key}` is given twice")]
    GivenTwice {
        /// The key of the setting.
        key: String,
    },
    /// A setting has no value.
    #[error("`{setting}` has no value; {expected}")]
    NoValue {
        /// The setting.
        setting: String,
        /// What is expected, with an example.
        expected: &'static str,
    },
    /// A device cannot have an address.
    #[error(
        "{device} cannot have the address `{address}`: it is of seven bits, 0x50 to 0x57, without the bits that are \
         part of the address in the memory"
    )]
    DeviceAddress {
        /// Name of the device.
        device: String,
        /// The address.
        address: String,
    },
    /// A fuse byte without its name.
    #[error("which fuse byte is it? low=0x{value:02X}, high=0x{value:02X} or extended=0x{value:02X}")]
    UnnamedFuse {
        /// The byte.
        value: u8,
    },
    /// No chip has the name, but one is near to it.
    #[error("no chip of this name; the nearest is `{chip}`: {why} (`emu chips` lists all)")]
    OtherChip {
        /// The chip.
        chip: &'static str,
        /// Why it is the nearest.
        why: &'static str,
    },
    /// No chip has the name, which may be misspelt.
    #[error("no chip of this name; did you mean `{near}`? (`emu chips` lists all)")]
    MisspeltChip {
        /// A chip of a similar name.
        near: &'static str,
    },
    /// No chip has the name.
    #[error("no chip of this name; chips are {}", .known.join(", "))]
    UnknownChip {
        /// All chips.
        known: Vec<&'static str>,
    },
    /// A symbol does not take the value.
    #[error("`{name}` takes {} to {}, not `{value}`", .range.start(), .range.end())]
    OutOfRange {
        /// The symbol.
        name: String,
        /// What it takes.
        range: RangeInclusive<i64>,
        /// The value.
        value: String,
    },
    /// The program has no such cell of the EEPROM.
    #[error("{}", match .count {
        0 => "the program has no PERSIST, so no cell of the EEPROM".to_owned(),
        count => format!("there is no cell `{name}`; cells are eeprom:0 to eeprom:{}", count - 1),
    })]
    NoCell {
        /// The cell.
        name: String,
        /// Number of cells that it has.
        count: usize,
    },
    /// The program has no such symbol.
    #[error("the program has no symbol `{name}`; it has {}", .known.join(", "))]
    UnknownSymbol {
        /// The name.
        name: String,
        /// All symbols.
        known: Vec<String>,
    },
    /// No test is left to run.
    #[error("{}", match .found {
        0 => "no test was found: neither an emu.toml with tests nor a scenario with its program".to_owned(),
        found => format!("--filter selects none of the {found} tests (`emu test --list` names them)"),
    })]
    NoTest {
        /// Number of tests that were found.
        found: usize,
    },
    /// A rung is named, and nothing says where it is.
    #[error("rungs need the map of the program: --map FILE")]
    RungWithoutMap,
    /// The program has no such rung.
    #[error("the program has the rungs 1 to {count}")]
    UnknownRung {
        /// Number of rungs.
        count: usize,
    },
    /// A rung consists of comments.
    #[error("that rung has no code")]
    RungWithoutCode,
    /// A range is empty.
    #[error("contains no {what}: its end is excluded")]
    EmptyRange {
        /// What the range is of: `instruction` or `line`.
        what: &'static str,
    },
    /// A name of a signal is not a word.
    #[error("a signal is named by a word of ASCII")]
    SignalName,
    /// A signal is unknown, and may be misspelt.
    #[error("is unknown; did you mean `{near}`?")]
    MisspeltSignal {
        /// A symbol of a similar name.
        near: String,
    },
    /// A signal has too many bytes.
    #[error("has {bytes} bytes; a signal has at most {most}")]
    SignalTooLong {
        /// Number of bytes.
        bytes: u32,
        /// The maximum number.
        most: u32,
    },
    /// A signal is several bits with addresses of their own.
    #[error("names several bits; add them one by one")]
    SeveralBits,
    /// The map is of a chip with other memories.
    #[error("the map has it in `{space}`, but {chip} has no such memory")]
    UnknownMemory {
        /// The memory.
        space: String,
        /// The chip.
        chip: &'static str,
    },
    /// An address is in no memory of the chip.
    #[error("{chip} has no memory at {space}:0x{addr:x}")]
    NoMemoryAt {
        /// The chip.
        chip: &'static str,
        /// The memory.
        space: &'static str,
        /// The address.
        addr: u32,
    },
    /// A scan is after the last one.
    #[error("scan {scan} does not run; scans are 1 to {scans} (--scans)")]
    ScanNotRun {
        /// Number of the scan.
        scan: u64,
        /// Number of scans.
        scans: u64,
    },
}

impl UsageError {
    /// Returns the error of a value without the expected form.
    pub fn malformed(expected: impl Into<Cow<'static, str>>) -> UsageError {
        UsageError::Malformed { expected: expected.into() }
    }
}
