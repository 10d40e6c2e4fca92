//! Errors of the explanation of a value.

/// Why the value of a symbol cannot be explained.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// The session has no follower of scans.
    #[error("nothing follows this program")]
    NotFollowed,
    /// No scan has begun yet.
    #[error("no scan has run yet{}; `scan` runs one", if *.was_reset { " since the reset" } else { "" })]
    NoScan {
        /// True if the chip was reset since power-up.
        was_reset: bool,
    },
    /// The program has no symbol with this name.
    #[error("the program has no symbol `{name}`; it has {}", .known.join(", "))]
    UnknownSymbol {
        /// The requested name.
        name: String,
        /// Symbols of the program.
        known: Vec<String>,
    },
}
