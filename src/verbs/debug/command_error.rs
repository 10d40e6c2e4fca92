//! The error of the commands of `emu debug`.

use emu_debug::InputError;
use emu_debug::debug::DebugError;

/// Why a command fails: one sentence without a full stop, as the user reads it.
#[derive(Debug, Clone, PartialEq, Eq, Default, thiserror::Error)]
#[error("{0}")]
pub struct CommandError(String);

impl From<String> for CommandError {
    fn from(sentence: String) -> CommandError {
        CommandError(sentence)
    }
}

impl From<&str> for CommandError {
    fn from(sentence: &str) -> CommandError {
        CommandError(sentence.to_owned())
    }
}

impl From<DebugError> for CommandError {
    fn from(error: DebugError) -> CommandError {
        CommandError(error.to_string())
    }
}

impl From<InputError> for CommandError {
    fn from(error: InputError) -> CommandError {
        CommandError(error.to_string())
    }
}
