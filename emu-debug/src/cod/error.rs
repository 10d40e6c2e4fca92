//! What is wrong with a message of a program that checks itself.

use std::borrow::Cow;

/// Why a message cannot be carried out. `Display` is the cause, without a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodError {
    /// A message is longer than any in a file.
    #[error("it has more than {most} bytes")]
    MessageTooLong {
        /// Most bytes.
        most: usize,
    },
    /// Something is behind an expression.
    #[error("`{rest}` behind the expression")]
    TrailingText {
        /// What is there.
        rest: String,
    },
    /// A message is no command.
    #[error("`{text}` is no command")]
    UnknownCommand {
        /// The message.
        text: String,
    },
    /// A command of gpsim has no meaning here.
    #[error("`{text}` is not carried out")]
    UnsupportedCommand {
        /// The message.
        text: String,
    },
    /// A `symbol` command lacks its name or value.
    #[error("`{text}`: wanted symbol NAME=VALUE")]
    MalformedSymbol {
        /// The message.
        text: String,
    },
    /// A list lacks a comma.
    #[error("`{rest}` in a list, wanted a comma")]
    MissingComma {
        /// What is there.
        rest: String,
    },
    /// A part of an expression is missing.
    #[error(
        "{}, wanted {wanted}",
        if .found.is_empty() { Cow::from("the text ends") } else { format!("found `{found}`").into() }
    )]
    Unexpected {
        /// What is there; empty at the end.
        found: String,
        /// What is wanted.
        wanted: &'static str,
    },
    /// An expression has too many operands within each other.
    #[error("the expression is nested too deeply")]
    NestedTooDeeply,
    /// Digits are no number.
    #[error("`{digits}` is no number{}", .radix.map_or(String::new(), |radix| format!(" to the base {radix}")))]
    BadNumber {
        /// The digits.
        digits: String,
        /// The base, where it is given.
        radix: Option<u32>,
    },
    /// A text stands where another value is wanted.
    #[error("a text is no {wanted}")]
    TextIsNo {
        /// What is wanted, such as `address`.
        wanted: &'static str,
    },
    /// An operator has no meaning before a value.
    #[error("`{operator}` before a {operand}")]
    BadOperand {
        /// The operator.
        operator: char,
        /// What is behind it: `text` or `decimal`.
        operand: &'static str,
    },
    /// Two texts are operands of something else than a comparison.
    #[error("texts can only be compared")]
    TextsInArithmetic,
    /// An operator on bits has a decimal as an operand.
    #[error("bits of a decimal")]
    BitsOfDecimal,
    /// The divisor is 0.
    #[error("a division by 0")]
    DivisionByZero,
    /// A number of cycles or a frequency is negative.
    #[error("wanted a number of at least 0")]
    NegativeNumber,
    /// A frequency is 0.
    #[error("a clock of 0 Hz")]
    ZeroFrequency,
    /// A module of gpsim has no model here.
    #[error("there is no model of the module `{kind}`")]
    UnknownModule {
        /// The kind of module.
        kind: String,
    },
    /// Two parts have one name.
    #[error("there is a part `{name}` already")]
    DuplicatePart {
        /// The name.
        name: String,
    },
    /// A name is that of nothing of its kind.
    #[error("there is no {kind} `{name}`")]
    NoSuch {
        /// The kind: `pin`, `node` or `EEPROM`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A name stands for nothing.
    #[error("there is nothing called `{name}`")]
    UnknownName {
        /// The name.
        name: String,
    },
    /// A register cannot be read.
    #[error("`{name}` cannot be read")]
    Unreadable {
        /// The register.
        name: String,
    },
    /// A register cannot be written.
    #[error("`{name}` cannot be written")]
    Unwritable {
        /// The register.
        name: String,
    },
    /// An attribute does not take a value.
    #[error("`{name}` cannot be set to that")]
    BadAttributeValue {
        /// The attribute.
        name: String,
    },
    /// There is no register at an address.
    #[error("there is no register at {addr}")]
    NoRegisterAt {
        /// The address.
        addr: i64,
    },
    /// A file is loaded to which nothing was saved.
    #[error("nothing was kept as `{file}`")]
    NothingKept {
        /// The file.
        file: String,
    },
    /// A line of a stimulus is outside of one.
    #[error("there is no stimulus that this would belong to")]
    OutsideStimulus,
    /// A stimulus has a cycle without a value.
    #[error("a cycle without a value")]
    CycleWithoutValue,
    /// A stimulus has no end.
    #[error("a stimulus without its end")]
    UnfinishedStimulus,
}
