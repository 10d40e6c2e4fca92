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

    /// Returns the arguments of a command that plays the same scenario and can write a waveform with `--vcd`;
    /// `None` if the test has no scenario. `check` writes no waveform, so its program runs on the evaluator.
    pub fn replay_with_wave(&self) -> Option<Vec<String>> {
        let (verb, rest) = self.arguments.split_first()?;
        if !rest.iter().any(|argument| argument.starts_with("--scenario=")) {
            return None;
        }
        let is_check = verb == "check";
        let is_kept = |argument: &&String| {
            let of_sim = ["--scenario=", "--dialect=", "--format=", "--cycle="];
            !is_check || !argument.starts_with("--") || of_sim.iter().any(|flag| argument.starts_with(flag))
        };
        let verb = if is_check { "sim" } else { verb };
        Some([verb.to_owned()].into_iter().chain(rest.iter().filter(is_kept).cloned()).collect())
    }

    /// Returns a name for files of this test, of letters, digits, `-`, `_` and `.`.
    pub fn file_stem(&self) -> String {
        let folder = self.folder.as_ref().map_or(String::new(), |folder| format!("{}-", folder.display()));
        let name = folder + &self.name;
        name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect()
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
    use super::{TestCase, shell_word};

    #[test]
    fn words_are_quoted_for_a_shell() {
        for (word, quoted) in
            [("a.ld", "a.ld"), ("", "''"), ("a b", "'a b'"), ("it's", r"'it'\''s'"), ("--x=$y", "'--x=$y'")]
        {
            assert_eq!(shell_word(word), quoted);
        }
    }

    #[test]
    fn a_check_is_replayed_on_the_evaluator() {
        let case = |arguments: &[&str]| TestCase {
            name: "a/b c".to_owned(),
            file: "emu.toml".to_owned(),
            line: 1,
            folder: Some("sub".into()),
            arguments: arguments.iter().map(|&word| word.to_owned()).collect(),
            exit_code: 0,
        };
        let replayed = |arguments: &[&str]| case(arguments).replay_with_wave().map(|words| words.join(" "));
        let check = ["check", "a.ld", "--mcu=8051", "--dialect=ldmicro-5", "--scenario=s.toml"];
        assert_eq!(replayed(&check).as_deref(), Some("sim a.ld --dialect=ldmicro-5 --scenario=s.toml"));
        let run = ["run", "a.hex", "--mcu=8051", "--scenario=s.toml"];
        assert_eq!(replayed(&run).as_deref(), Some("run a.hex --mcu=8051 --scenario=s.toml"));
        assert_eq!(replayed(&["check", "a.ld"]), None);
        assert_eq!(case(&[]).file_stem(), "sub-a-b-c");
    }
}
