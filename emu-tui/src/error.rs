//! Errors of key scripts and of the panel's command line.

use crate::key::key_names;

/// The reason why keys cannot be parsed or a command cannot be executed. `Display` gives the cause as one
/// sentence without a full stop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TuiError {
    /// The repetition count of a key is not a number, or too large.
    #[error("`{word}`: how often is a number from 1 to {most}")]
    BadRepetition {
        /// The word of the script.
        word: String,
        /// The largest count.
        most: usize,
    },
    /// A script has too many keys.
    #[error("`{word}`: that is more than {most} keys")]
    TooManyKeys {
        /// The word that exceeds the number.
        word: String,
        /// Maximum number of keys in a script.
        most: usize,
    },
    /// A pause is not a valid time.
    #[error("`{word}`: give a time up to an hour, as in wait:500ms or wait:2s")]
    BadPause {
        /// The word of the script.
        word: String,
    },
    /// A word is not the name of a key.
    #[error("there is no key `{word}`; there are single characters, {}, alt-1, wait:500ms, :TEXT", key_names())]
    UnknownKey {
        /// The word of the script.
        word: String,
    },
    /// A command does not exist in the panel.
    #[error("`{line}` is not a command: NAME=VALUE, send TEXT, scan N, back N, speed X")]
    UnknownCommand {
        /// The whole line.
        line: String,
    },
    /// The argument of `scan` is not a number, or too large.
    #[error("scan takes 1 to {most}")]
    BadScanCount {
        /// Maximum number of scans per command.
        most: u64,
    },
    /// The argument of `back` is not a number.
    #[error("back takes a number of scans")]
    BadBackCount,
    /// The argument of `speed` is not a number, or out of range.
    #[error("speed takes {low} to {high}")]
    BadSpeed {
        /// The smallest factor.
        low: f64,
        /// The largest factor.
        high: f64,
    },
    /// The program does not have the symbol.
    #[error("the program has no symbol `{name}`")]
    UnknownSymbol {
        /// The name.
        name: String,
    },
    /// The symbol cannot hold the value.
    #[error("`{name}` takes {low} to {high}")]
    ValueOutOfRange {
        /// The symbol.
        name: String,
        /// The smallest value of the symbol.
        low: i64,
        /// The largest value of the symbol.
        high: i64,
    },
    /// `\x` is not followed by two hexadecimal digits.
    #[error("\\x needs two hexadecimal digits")]
    BadHexEscape,
    /// A backslash is followed by an unknown character.
    #[error("after \\ comes n, r, t, 0, \\ or xNN")]
    UnknownEscape,
}
