//! Errors in user input: times, voltages, pins, addresses, texts and conditions.

use std::borrow::Cow;

use emu_core::CoreError;

/// Why a user's text cannot be used, or why a machine cannot do what it requests. `Display` is the cause, one
/// sentence with what was found and what is expected, without a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InputError {
    /// A text does not have the expected form.
    #[error("`{text}` is not {} {wanted}; write {examples}", article(wanted))]
    Malformed {
        /// The text.
        text: String,
        /// What is expected, such as `time`.
        wanted: &'static str,
        /// Examples of the notation.
        examples: Cow<'static, str>,
    },
    /// A text lacks a part.
    #[error("`{text}` gives no {part}; write {examples}")]
    MissingPart {
        /// The text.
        text: String,
        /// The part, such as `level`.
        part: &'static str,
        /// Examples of the complete notation.
        examples: String,
    },
    /// A time has more cycles than the maximum.
    #[error("`{text}` is longer than 2^62 cycles, the most, which is {seconds} s at {hz} Hz")]
    TimeTooLong {
        /// The time.
        text: String,
        /// The longest time in seconds.
        seconds: u128,
        /// Clock of the machine in Hz.
        hz: u64,
    },
    /// A time on the host is too long.
    #[error("`{text}` is longer than 584 years, the most")]
    DurationTooLong {
        /// The time.
        text: String,
    },
    /// A frequency or voltage is not a multiple of its smallest unit.
    #[error("`{text}` is not a whole number of {unit}")]
    NotWhole {
        /// The frequency or voltage.
        text: String,
        /// The smallest unit.
        unit: &'static str,
    },
    /// A frequency is 0.
    #[error("the clock cannot be 0; write at least 1 Hz")]
    ZeroFrequency,
    /// A frequency has more than 64 bits.
    #[error("`{text}` is more than 2^64 Hz")]
    FrequencyTooHigh {
        /// The frequency.
        text: String,
    },
    /// A voltage is above the maximum of any pin.
    #[error("`{text}` is more than any pin bears; the most is {most_volts} V")]
    VoltageTooHigh {
        /// The voltage.
        text: String,
        /// The highest voltage.
        most_volts: u128,
    },
    /// The chip has no such pin.
    #[error("{chip} has no pin `{name}`; its pins are {known}")]
    UnknownPin {
        /// The chip.
        chip: &'static str,
        /// The name.
        name: String,
        /// The pins of the chip.
        known: String,
    },
    /// A controller has fewer channels than its chip.
    #[error("{pin} is not a channel of this machine: the configuration in its image has fewer")]
    MissingChannel {
        /// The channel.
        pin: &'static str,
    },
    /// The chip has the pin only in other packages.
    #[error("{pin} is not a pin of the chosen package; packages that have it are {}", .packages.join(", "))]
    NotInPackage {
        /// The pin.
        pin: &'static str,
        /// The packages that have it.
        packages: Vec<&'static str>,
    },
    /// The machine has no analog inputs.
    #[error("{what} cannot be set on {chip}, which knows levels only: {pin}=0, {pin}=1 or {pin}=z")]
    LevelsOnly {
        /// What was to be set: `voltages on pins` or `the supply`.
        what: &'static str,
        /// The chip.
        chip: &'static str,
        /// A pin of it, as an example.
        pin: &'static str,
    },
    /// A baud rate is 0, or above the maximum.
    #[error("a rate is of 1 to {most} bits a second")]
    BadBaudRate {
        /// The fastest rate.
        most: u64,
    },
    /// Bytes on a serial line end after the last cycle that can be counted.
    #[error("the text takes longer than 2^62 cycles")]
    SerialTextTooLong,
    /// `\x` is not followed by two digits.
    #[error("`\\x{digits}` needs two hex digits, as in \\x0a")]
    BadHexEscape {
        /// What follows it.
        digits: String,
    },
    /// A backslash with an unknown character.
    #[error("`\\{letter}` is not an escape; known are \\n \\r \\t \\0 \\\\ \\\" \\xNN")]
    UnknownEscape {
        /// The character.
        letter: char,
    },
    /// A text ends with a backslash.
    #[error("a backslash at the end has no meaning; write \\\\ for a backslash")]
    BackslashAtEnd,
    /// A text has no characters.
    #[error("an empty text is always there; write at least one character")]
    EmptyText,
    /// A text within quotes has an unescaped quote.
    #[error("the quotes of `{text}` do not pair; write \"text\", and \\\" for one within the text")]
    UnpairedQuotes {
        /// The text.
        text: String,
    },
    /// A condition on fetches is not available for this chip.
    #[error("`{text}` is for chips that fetch and execute one after the other, as ap101; {chip} is not one")]
    NoFetchCycles {
        /// The condition.
        text: String,
        /// The chip.
        chip: &'static str,
    },
    /// A location is a core register, which has no address.
    #[error("`{text}` is a register of the core, not in a memory; every run shows those (memories: {memories})")]
    CoreRegister {
        /// The register.
        text: String,
        /// The memories of the chip.
        memories: String,
    },
    /// A location has no memory, and its name is in none.
    #[error("`{text}` names no memory; write {example} (memories: {memories})")]
    NoMemory {
        /// The location.
        text: String,
        /// An example of a location.
        example: String,
        /// The memories of the chip.
        memories: String,
    },
    /// A name is in several memories.
    #[error("`{text}` is in several memories: {memories}")]
    SeveralMemories {
        /// The name.
        text: String,
        /// Those memories.
        memories: String,
    },
    /// The chip has no such memory.
    #[error("{chip} has no memory `{space}`; memories are {memories}")]
    UnknownMemory {
        /// The chip.
        chip: &'static str,
        /// The name of the memory.
        space: String,
        /// The memories of the chip.
        memories: String,
    },
    /// A location ends after the end of its memory.
    #[error("{place} reaches beyond {space}, whose last address is 0x{last:x}{hint}")]
    BeyondMemory {
        /// The location.
        place: String,
        /// The memory.
        space: &'static str,
        /// Its last address.
        last: u32,
        /// The notation of the address that was probably meant, after a semicolon; often empty.
        hint: String,
    },
    /// A range ends at or before its start.
    #[error("`{text}` contains no {unit}: its end is excluded")]
    EmptyRange {
        /// The range.
        text: String,
        /// The unit of its memory: `bytes` or `words`.
        unit: &'static str,
    },
    /// Accesses to a memory are not reported.
    #[error("accesses are watched in {watched} memory, not in {space}")]
    MemoryNotWatched {
        /// The memories whose accesses are reported.
        watched: String,
        /// The memory.
        space: &'static str,
    },
    /// Accesses to the core registers at the start of a memory are not reported.
    #[error(
        "accesses are watched in {space} memory from 0x{first:x} on, not in {space}:0x{addr:x}, a register of the core"
    )]
    WatchedFrom {
        /// The memory.
        space: &'static str,
        /// The first address whose accesses are reported.
        first: u32,
        /// The address.
        addr: u32,
    },
    /// Accesses to a register that instructions use implicitly are not reported.
    #[error(
        "{space}:0x{addr:x} is a register of the core, which instructions use without naming it: only its changes are reported"
    )]
    AccessedImplicitly {
        /// The memory.
        space: &'static str,
        /// Address of the register.
        addr: u32,
    },
    /// A program address is within a word.
    #[error("0x{addr:x} is not the start of a word; program addresses are even byte addresses")]
    WithinWord {
        /// The address.
        addr: u32,
    },
    /// The code of a source line is after the end of program memory.
    #[error("`{text}` is beyond {space}")]
    LineBeyondMemory {
        /// File and line.
        text: String,
        /// Program memory.
        space: &'static str,
    },
    /// A source line has no code.
    #[error(transparent)]
    SourceLine(#[from] CoreError),
    /// A name belongs to several locations in a memory.
    #[error("`{text}` is the name of several places in {space}: {addresses}")]
    SeveralPlaces {
        /// The name.
        text: String,
        /// The memory.
        space: String,
        /// Their addresses.
        addresses: String,
    },
    /// A text is part of several names.
    #[error("`{text}` is part of several names, write one whole: {candidates}")]
    SeveralNames {
        /// The text.
        text: String,
        /// Whole names with their addresses.
        candidates: String,
    },
    /// The offset of a name is not a number.
    #[error("`{text}` is not a number of addresses")]
    BadOffset {
        /// The offset.
        text: String,
    },
    /// A name with its offset is not an address.
    #[error("`{text}` is not an address")]
    AddressOverflow {
        /// Name and number.
        text: String,
    },
    /// An address is expected, but there is no text.
    #[error("an address is missing")]
    MissingAddress,
    /// A constant of the program is used as an address of RAM, but is not one.
    #[error("the constant `{name}` is below RAM, which begins at 0x{first:x}")]
    ConstantBelowRam {
        /// The constant.
        name: String,
        /// First address of RAM.
        first: u32,
    },
    /// The chip has no such register.
    #[error("{chip} has no register `{name}`")]
    UnknownRegister {
        /// The chip.
        chip: &'static str,
        /// The name.
        name: String,
    },
    /// A name is used with an image without symbols.
    #[error("`{name}` is not an address (the image has no symbols)")]
    NoSymbols {
        /// The name.
        name: String,
    },
    /// The image has no such symbol.
    #[error("the image has no symbol `{name}` in {space}")]
    UnknownSymbol {
        /// The name.
        name: String,
        /// The memory that was searched.
        space: String,
    },
    /// The byte of a named bit is not known.
    #[error("`{text}` is not a byte of {ram} or {registers}")]
    UnknownByte {
        /// The byte.
        text: String,
        /// The memory of RAM.
        ram: &'static str,
        /// The memory of registers.
        registers: &'static str,
    },
    /// The bits of a byte have no addresses of their own.
    #[error(
        "the bits of 0x{addr:x} have no addresses; those of {ram} 0x20 to 0x2f have, and of {registers} those of every \
         eighth byte"
    )]
    BitsWithoutAddresses {
        /// Address of the byte.
        addr: u32,
        /// The memory of RAM.
        ram: &'static str,
        /// The memory of registers.
        registers: &'static str,
    },
    /// The number of a bit is not 0 to 7.
    #[error("`{text}` is not a bit of a byte; those are 0 to 7")]
    BadBitOfByte {
        /// The number.
        text: String,
    },
    /// A scenario names more bytes than a number can have.
    #[error("`{name}` has {bytes} bytes; a number has at most {most}")]
    NumberTooWide {
        /// The name.
        name: String,
        /// Its bytes.
        bytes: u32,
        /// The maximum number of bytes.
        most: u32,
    },
    /// The chip has no byte at an address of its memory.
    #[error("{chip} has no memory at {space}:0x{addr:x}")]
    NothingAt {
        /// The chip.
        chip: &'static str,
        /// The memory.
        space: &'static str,
        /// The address.
        addr: u32,
    },
    /// A name in a scenario is not defined on the chip.
    #[error("`{name}` is not a pin of {chip}, no symbol and no register")]
    UnknownName {
        /// The name.
        name: String,
        /// The chip.
        chip: &'static str,
    },
    /// A text is assigned to a location in memory.
    #[error("`{name}` takes a number, not `{value}`")]
    NumberWanted {
        /// The name of the location.
        name: String,
        /// The text.
        value: String,
    },
    /// A location in memory cannot hold a number.
    #[error("`{name}` takes {low} to {high}, not {value}")]
    NumberOutOfRange {
        /// The name of the location.
        name: String,
        /// The lowest allowed value.
        low: i64,
        /// The highest allowed value.
        high: i64,
        /// The number.
        value: i64,
    },
    /// A scenario reads the supply.
    #[error("{name} can be set, not looked at")]
    SupplyIsNotReadable {
        /// The name of the supply.
        name: String,
    },
    /// The chip has no serial port.
    #[error("{chip} has no serial port")]
    NoSerialPort {
        /// The chip.
        chip: &'static str,
    },
}

/// Returns the indefinite article of a noun.
pub(crate) fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" }
}

/// Returns the error for a text with the wrong form.
pub(crate) fn malformed(text: &str, wanted: &'static str, examples: impl Into<Cow<'static, str>>) -> InputError {
    InputError::Malformed { text: text.to_owned(), wanted, examples: examples.into() }
}

/// The command line reports errors as texts.
impl From<InputError> for String {
    fn from(error: InputError) -> String {
        error.to_string()
    }
}
