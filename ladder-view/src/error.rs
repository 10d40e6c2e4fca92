//! Why a value cannot be explained.

/// Why there is no explanation of a symbol's value.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// The session has no follower of scans.
    #[error("nothing follows this program")]
    NotFollowed,
    /// No scan has begun.
    #[error("no scan has run yet{}; `scan` runs one", if *.was_reset { " since the reset" } else { "" })]
    NoScan {
        /// The chip was reset since power-up.
        was_reset: bool,
    },
    /// The program has no such symbol.
    #[error("the program has no symbol `{name}`; it has {}", .known.join(", "))]
    UnknownSymbol {
        /// The name.
        name: String,
        /// The symbols of the program.
        known: Vec<String>,
    },
}
