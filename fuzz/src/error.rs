//! Errors of the commands of `emu-fuzz`.

use std::io;

use crate::target_table::TARGETS;

/// The reason why a command of `emu-fuzz` fails. `Display` gives the cause as one sentence without a full
/// stop.
#[derive(Debug, thiserror::Error)]
pub enum FuzzError {
    /// A name is not the name of a target.
    #[error("there is no target `{name}`; targets are {}", target_names())]
    UnknownTarget {
        /// The name.
        name: String,
    },
    /// The command line does not start with a command.
    #[error("there is no such command")]
    UnknownCommand,
    /// A flag is unknown.
    #[error("there is no flag {flag}")]
    UnknownFlag {
        /// The flag.
        flag: String,
    },
    /// A flag is the last word, without a value.
    #[error("{flag} lacks its value")]
    MissingValue {
        /// The flag.
        flag: String,
    },
    /// The value of a flag is not a number.
    #[error("{flag} {value}: write a whole number")]
    BadNumber {
        /// The flag.
        flag: String,
        /// The value.
        value: String,
    },
    /// A worker gets no budget.
    #[error("no budget")]
    NoBudget,
    /// A worker gets no file for its current input.
    #[error("no file")]
    NoInputFile,
    /// A file or folder cannot be read or written.
    #[error("{path}: {source}")]
    File {
        /// The path.
        path: String,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A worker cannot be started, or its input cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn target_names() -> String {
    let names: Vec<&str> = TARGETS.iter().map(|target| target.name).collect();
    names.join(", ")
}
