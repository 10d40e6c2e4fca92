//! Errors in the messages of a self-checking program.

use std::borrow::Cow;

/// Why a message cannot be executed. `Display` is the cause, without a full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodError {
    /// A message is longer than any file can hold.
    #[error("it has more than {most} bytes")]
    MessageTooLong {
        /// Maximum number of bytes.
        most: usize,
    },
    /// Text follows an expression.
    #[error("`{rest}` after the expression")]
    TrailingText {
        /// The text.
        rest: String,
    },
    /// A message is not a command.
    #[error("`{text}` is not a command")]
    UnknownCommand {
        /// The message.
        text: String,
    },
    /// A gpsim command is not supported.
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
        /// The text that was found.
        rest: String,
    },
    /// A part of an expression is missing.
    #[error(
        "{}, wanted {wanted}",
        if .found.is_empty() { Cow::from("the text ends") } else { format!("found `{found}`").into() }
    )]
    Unexpected {
        /// The text that was found; empty at the end.
        found: String,
        /// The expected part.
        wanted: &'static str,
    },
    /// An expression is nested too deeply.
    #[error("the expression is nested too deeply")]
    NestedTooDeeply,
    /// Digits are not a number.
    #[error("`{digits}` is not a number{}", .radix.map_or(String::new(), |radix| format!(" to the base {radix}")))]
    BadNumber {
        /// The digits.
        digits: String,
        /// The base, if it is given.
        radix: Option<u32>,
    },
    /// A text is used where another value is expected.
    #[error("a text is not {} {wanted}", crate::text::input_error::article(wanted))]
    TextIsNo {
        /// The expected kind of value, such as `address`.
        wanted: &'static str,
    },
    /// An operator cannot be applied to a value.
    #[error("`{operator}` before a {operand}")]
    BadOperand {
        /// The operator.
        operator: char,
        /// The kind of the operand: `text` or `decimal`.
        operand: &'static str,
    },
    /// Two texts are operands of an operator that is not a comparison.
    #[error("texts can only be compared")]
    TextsInArithmetic,
    /// A bitwise operator has a decimal as an operand.
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
    /// A gpsim module has no model here.
    #[error("there is no model of the module `{kind}`")]
    UnknownModule {
        /// The kind of module.
        kind: String,
    },
    /// Two parts have the same name.
    #[error("there is a part `{name}` already")]
    DuplicatePart {
        /// The name.
        name: String,
    },
    /// There is no object of this kind with this name.
    #[error("there is no {kind} `{name}`")]
    NoSuch {
        /// The kind: `pin`, `node` or `EEPROM`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// A name is not defined.
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
    /// An attribute does not accept a value.
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
    /// A file is loaded but was never saved.
    #[error("nothing was kept as `{file}`")]
    NothingKept {
        /// The file.
        file: String,
    },
    /// A line of a stimulus is outside a stimulus.
    #[error("there is no stimulus that this would belong to")]
    OutsideStimulus,
    /// A stimulus has a cycle without a value.
    #[error("a cycle without a value")]
    CycleWithoutValue,
    /// A stimulus has no end.
    #[error("a stimulus without its end")]
    UnfinishedStimulus,
}
