//! Errors of requests and sessions: lines and names without code, invalid breakpoints, input without frames.

use std::io;

use emu_core::CoreError;
use emu_debug::InputError;
use emu_debug::debug::DebugError;

use crate::framing::MAX_MESSAGE_BYTES;

/// The error of the function that makes a machine; a message for the user.
pub type LaunchError = Box<dyn std::error::Error + Send + Sync>;

/// The reason why a request fails or a session ends. `Display` gives the cause as one sentence without a full
/// stop.
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
    /// The line of the ladder program is after the last rung.
    #[error("there is no rung at or after line {line}")]
    NoRungAtLine {
        /// The line, from 1.
        line: u32,
    },
    /// Neither the rung nor any rung after it has code.
    #[error("rung {rung} has no code, and neither has a rung after it")]
    NoCodeFromRung {
        /// The rung, from 1.
        rung: u32,
    },
    /// The named rung has no code or does not exist.
    #[error("rung {rung} has no code or does not exist")]
    NoSuchRung {
        /// The rung, from 1.
        rung: u32,
    },
    /// The named element has no code or does not exist.
    #[error("element {rung}.{element} has no code or does not exist")]
    NoSuchElement {
        /// The rung, from 1.
        rung: u32,
        /// The element in the rung, from 1.
        element: u32,
    },
    /// The line of the disassembly is after the last instruction.
    #[error("there is no instruction at or after line {line}")]
    NoInstructionAtLine {
        /// The line, from 1.
        line: u32,
    },
    /// A source has neither a path nor a name.
    #[error("the source has no path")]
    SourceWithoutPath,
    /// The request names a ladder program, but the session has no map of it.
    #[error("the rungs are unknown: launch the .ld file itself, or the image with its `map` and `ladder`")]
    RungsUnknown,
    /// A data breakpoint requests an access other than read, write and readWrite.
    #[error("`{access}` is not a kind of access")]
    UnknownAccess {
        /// The requested access.
        access: String,
    },
    /// A data breakpoint on accesses does not name a memory location; one on changes is possible.
    #[error("{0}; `write` detects its changes")]
    NotAccessible(#[source] Box<DapError>),
    /// A hit condition has no number above 0.
    #[error("`{text}` is not a hit condition; write 5, >5, ==5 or %5")]
    BadHitCondition {
        /// The condition.
        text: String,
    },
    /// A brace in a log message is not closed.
    #[error("a }} is missing in `{text}`")]
    UnclosedBrace {
        /// The message.
        text: String,
    },
    /// An address with its offset is outside of 32 bits.
    #[error("{address} plus {offset} is not an address")]
    AddressOverflow {
        /// The requested address.
        address: String,
        /// The requested offset.
        offset: i64,
    },
    /// The input cannot be read.
    #[error("the input cannot be read: {0}")]
    UnreadableInput(#[source] io::Error),
    /// The output cannot be written.
    #[error("the output cannot be written: {0}")]
    UnwritableOutput(#[source] io::Error),
    /// The input ends within a message.
    #[error("the input ends after {got} of the {length} bytes of a message")]
    TruncatedMessage {
        /// Number of bytes received.
        got: usize,
        /// Number of bytes in the header.
        length: u64,
    },
    /// The input has no message header.
    #[error("the input does not follow the framing of the protocol: a header is a few short lines and an empty line")]
    NotFramed,
    /// A line of a header has no colon.
    #[error("`{line}` is not a header line")]
    BadHeaderLine {
        /// The beginning of the line.
        line: String,
    },
    /// The Content-Length of a message is not a number.
    #[error("`{text}` is not a message length")]
    BadLength {
        /// The beginning of the text.
        text: String,
    },
    /// A message exceeds the maximum length.
    #[error("a message of {length} bytes exceeds the maximum of {MAX_MESSAGE_BYTES} bytes")]
    MessageTooLong {
        /// Number of bytes in the header.
        length: u64,
    },
    /// The header of a message has no Content-Length.
    #[error("the header of a message has no Content-Length")]
    NoContentLength,
}
