//! Why a command of `emu-fuzz` is not carried out.

use std::io;

use crate::target_table::TARGETS;

/// Why a command of `emu-fuzz` is not carried out. `Display` is the cause, one sentence without a full stop.
#[derive(Debug, thiserror::Error)]
pub enum FuzzError {
    /// A name is that of no target.
    #[error("there is no target `{name}`; targets are {}", target_names())]
    UnknownTarget {
        /// The name.
        name: String,
    },
    /// The command line begins with no command.
    #[error("there is no such command")]
    UnknownCommand,
    /// A flag is unknown.
    #[error("there is no flag {flag}")]
    UnknownFlag {
        /// The flag.
        flag: String,
    },
    /// A flag is the last word.
    #[error("{flag} lacks its value")]
    MissingValue {
        /// The flag.
        flag: String,
    },
    /// The value of a flag is no number.
    #[error("{flag} {value}: write a whole number")]
    BadNumber {
        /// The flag.
        flag: String,
        /// Its value.
        value: String,
    },
    /// A worker is given no budget.
    #[error("no budget")]
    NoBudget,
    /// A worker is given no file for its input.
    #[error("no file")]
    NoInputFile,
    /// A file or folder cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// Its path.
        path: String,
        /// What the system says.
        source: io::Error,
    },
    /// A worker cannot be started, or its input not be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn target_names() -> String {
    let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    names.join(", ")
}
