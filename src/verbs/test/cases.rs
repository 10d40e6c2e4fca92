//! A test: a command of `emu` with its name and its place.

use std::path::PathBuf;

use serde_json::{Value, json};

/// A test.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TestCase {
    /// Name, unique in a run.
    pub name: String,
    /// The scenario or the emu.toml that defines the test.
    pub file: String,
    /// Line of the definition in `file`, from 1.
    pub line: u32,
    /// Folder in which the command runs; `None` is the current one.
    pub folder: Option<PathBuf>,
    /// The verb and its arguments.
    pub arguments: Vec<String>,
    /// The exit code with which the command must end.
    pub exit_code: u8,
    /// The arguments of a command that plays the same scenario and can write a waveform with `--vcd`.
    pub replay_with_wave: Option<Vec<String>>,
}

impl TestCase {
    /// Returns the command as a user types it in the current folder.
    pub fn command(&self) -> String {
        let words: Vec<String> = self.arguments.iter().map(|argument| shell_word(argument)).collect();
        let command = format!("emu {}", words.join(" "));
        match &self.folder {
            Some(folder) => format!("(cd {} && {command})", shell_word(&folder.display().to_string())),
            None => command,
        }
    }

    /// Returns a name for files of this test, of letters, digits, `-`, `_` and `.`.
    pub fn file_stem(&self) -> String {
        self.name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
    }

    /// Returns the test as JSON.
    pub fn json(&self) -> Value {
        json!({ "name": self.name, "file": self.file, "line": self.line, "command": self.command(), "exit": self.exit_code })
    }
}

/// Quotes a word for a POSIX shell if it needs quotes.
fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::shell_word;

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, quoted) in
            [("a.ld", "a.ld"), ("", "''"), ("a b", "'a b'"), ("it's", r"'it'\''s'"), ("--x=$y", "'--x=$y'")]
        {
            assert_eq!(shell_word(word), quoted);
        }
    }
}
