//! Why a request or a session fails: lines and names without code, breakpoints without sense, input without frames.

use std::io;

use emu_core::CoreError;
use emu_debug::InputError;
use emu_debug::debug::DebugError;

use crate::framing::MAX_MESSAGE_BYTES;

/// A machine could not be made: the opener's own error, for people.
pub type LaunchError = Box<dyn std::error::Error + Send + Sync>;

/// Why a request cannot be carried out, or why a session ends. `Display` is the cause, one sentence without a full stop.
#[derive(Debug, thiserror::Error)]
pub enum DapError {
    /// The debugger refuses an expression.
    #[error(transparent)]
    Debugger(#[from] DebugError),
    /// An address or a range cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A source line has no code.
    #[error(transparent)]
    SourceLine(#[from] CoreError),
    /// A line of the ladder program lies behind the last rung.
    #[error("no rung stands at or behind line {line}")]
    NoRungAtLine {
        /// The line, from 1.
        line: u32,
    },
    /// A rung has no code, nor has any behind it.
    #[error("rung {rung} has no code, and neither has a rung behind it")]
    NoCodeFromRung {
        /// The rung, from 1.
        rung: u32,
    },
    /// A rung that is named has no code.
    #[error("rung {rung} has no code, or there is none")]
    NoSuchRung {
        /// The rung, from 1.
        rung: u32,
    },
    /// An element that is named has no code.
    #[error("element {rung}.{element} has no code, or there is none")]
    NoSuchElement {
        /// The rung, from 1.
        rung: u32,
        /// The element in it, from 1.
        element: u32,
    },
    /// A line of the listing lies behind the last instruction.
    #[error("no instruction stands at or behind line {line}")]
    NoInstructionAtLine {
        /// The line, from 1.
        line: u32,
    },
    /// A source has neither a path nor a name.
    #[error("the source has no path")]
    SourceWithoutPath,
    /// A ladder program is named, and the session has no map of it.
    #[error("rungs are not known: launch the .ld file itself, or the image with its `map` and `ladder`")]
    RungsUnknown,
    /// A data breakpoint asks for another access than read, write and readWrite.
    #[error("`{access}` is no kind of access")]
    UnknownAccess {
        /// The access as the client has it.
        access: String,
    },
    /// A data breakpoint on accesses names no place in memory; one on changes can be set.
    #[error("{0}; `write` sees its changes")]
    NotAccessible(#[source] Box<DapError>),
    /// A condition on the number of hits has no number above 0.
    #[error("`{text}` counts no hits; write 5, >5, ==5 or %5")]
    BadHitCondition {
        /// The condition.
        text: String,
    },
    /// An expression in a log message has no end.
    #[error("a }} is missing in `{text}`")]
    UnclosedBrace {
        /// The message.
        text: String,
    },
    /// An address and an offset are outside of 32 bits.
    #[error("{address} and {offset} more is no address")]
    AddressOverflow {
        /// The address as the client has it.
        address: String,
        /// What is added.
        offset: i64,
    },
    /// The input cannot be read.
    #[error("the input cannot be read: {0}")]
    UnreadableInput(#[source] io::Error),
    /// The output cannot be written.
    #[error("the output takes no more: {0}")]
    UnwritableOutput(#[source] io::Error),
    /// The input ends within a message.
    #[error("the input ends after {got} of the {length} bytes of a message")]
    TruncatedMessage {
        /// Bytes that came.
        got: usize,
        /// Bytes that its head announces.
        length: u64,
    },
    /// The input has no head of a message.
    #[error("the input is no frame of the protocol: a head is a few short lines and an empty one")]
    NotFramed,
    /// A line of a head has no colon.
    #[error("`{line}` is no line of a head")]
    BadHeaderLine {
        /// The beginning of the line.
        line: String,
    },
    /// The Content-Length of a message is no number.
    #[error("`{text}` is no length of a message")]
    BadLength {
        /// The beginning of the text.
        text: String,
    },
    /// A message is longer than any that is read.
    #[error("a message of {length} bytes is longer than {MAX_MESSAGE_BYTES}, the most")]
    MessageTooLong {
        /// Bytes that its head announces.
        length: u64,
    },
    /// The head of a message has no Content-Length.
    #[error("the head of a message has no Content-Length")]
    NoContentLength,
}
