//! Errors of the gdb server and of its `monitor` commands.

use std::io;

use emu_debug::debug::DebugError;

/// The reason why an address to listen on cannot be used, or why a monitor command does nothing.
#[derive(Debug, thiserror::Error)]
pub enum GdbError {
    /// A text is not an address, or its host is not found.
    #[error("`{text}` is not an address ({source}); write :1234 or 127.0.0.1:1234")]
    BadAddress {
        /// The text.
        text: String,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A host has no address.
    #[error("`{text}` is not an address (it has none); write :1234 or 127.0.0.1:1234")]
    HostWithoutAddress {
        /// The text.
        text: String,
    },
    /// The debugger refuses an expression, or the machine a value.
    #[error(transparent)]
    Debugger(#[from] DebugError),
    /// The target of `set` is not a place.
    #[error("that cannot be set")]
    NotAPlace,
    /// The expression after `set` has no value.
    #[error("it has no value now")]
    NoValue,
}
