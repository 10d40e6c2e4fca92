//! What is wrong with a script of keys, or with a line of the command line.

use crate::key::key_names;

/// Why keys cannot be read, or why a command line does nothing. `Display` is the cause, one sentence without a full stop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TuiError {
    /// The count behind a key is no number, or too large.
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
        /// Most keys of a script.
        most: usize,
    },
    /// A pause is no time.
    #[error("`{word}`: give a time up to an hour, as in wait:500ms or wait:2s")]
    BadPause {
        /// The word of the script.
        word: String,
    },
    /// A word is no key.
    #[error("there is no key `{word}`; there are single characters, {}, alt-1, wait:500ms, :TEXT", key_names())]
    UnknownKey {
        /// The word of the script.
        word: String,
    },
    /// A command is none of the panel.
    #[error("`{line}` is no command: NAME=VALUE, send TEXT, scan N, back N, speed X")]
    UnknownCommand {
        /// The whole line.
        line: String,
    },
    /// The number of scans of `scan` is no number, or too large.
    #[error("scan takes 1 to {most}")]
    BadScanCount {
        /// Most scans of one command.
        most: u64,
    },
    /// The number of scans of `back` is no number.
    #[error("back takes a number of scans")]
    BadBackCount,
    /// The factor of `speed` is no number, or out of range.
    #[error("speed takes {low} to {high}")]
    BadSpeed {
        /// The slowest.
        low: f64,
        /// The fastest.
        high: f64,
    },
    /// The program has no such symbol.
    #[error("the program has no symbol `{name}`")]
    UnknownSymbol {
        /// The name.
        name: String,
    },
    /// A symbol cannot hold a value.
    #[error("`{name}` takes {low} to {high}")]
    ValueOutOfRange {
        /// The symbol.
        name: String,
        /// The least that it holds.
        low: i64,
        /// The most that it holds.
        high: i64,
    },
    /// `\x` lacks a digit.
    #[error("\\x wants two hexadecimal digits")]
    BadHexEscape,
    /// A backslash and a letter that mean nothing.
    #[error("after \\ comes n, r, t, 0, \\ or xNN")]
    UnknownEscape,
}
