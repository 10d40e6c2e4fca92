//! A line from a user at a terminal, with history and completion.

use std::path::PathBuf;

use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::Validator;
use rustyline::{Config, Context, Editor, Helper};

use super::shell::Shell;

/// Lines that the history keeps.
const LINES: usize = 1000;

/// What completes a word: the candidates, as they are when the line is begun.
struct Words {
    commands: Vec<String>,
    names: Vec<String>,
}

impl Completer for Words {
    type Candidate = String;

    fn complete(&self, line: &str, at: usize, _: &Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        let before = line.get(..at).unwrap_or_default();
        let start =
            before.rfind(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.' | '-'))).map_or(0, |at| at + 1);
        let word = before.get(start..).unwrap_or_default();
        let first = before.get(..start).unwrap_or_default().trim().is_empty();
        let pool = if first { &self.commands } else { &self.names };
        Ok((start, pool.iter().filter(|name| name.starts_with(word)).cloned().collect()))
    }
}

impl Hinter for Words {
    type Hint = String;
}
impl Highlighter for Words {}
impl Validator for Words {}
impl Helper for Words {}

/// Asks for lines. It is made before anybody listens to SIGINT: the editor takes that signal for itself when it is made, and who
/// listens later is told first.
pub struct Terminal {
    editor: Option<Editor<Words, FileHistory>>,
    history: Option<PathBuf>,
}

impl Terminal {
    /// With the history of sessions before. A history that cannot be read or written is none.
    pub fn new() -> Terminal {
        let config = Config::builder().max_history_size(LINES).map(|config| config.auto_add_history(true).build());
        let editor = config.and_then(Editor::with_config);
        let mut terminal = Terminal { editor: editor.ok(), history: history_file() };
        if let (Some(editor), Some(file)) = (&mut terminal.editor, &terminal.history) {
            _ = editor.load_history(file);
        }
        terminal
    }

    /// The next line; nothing at the end of the input. Ctrl-C at the prompt drops what was typed.
    pub fn line(&mut self, shell: &Shell) -> Option<String> {
        let editor = self.editor.as_mut()?;
        editor.set_helper(Some(Words { commands: shell.command_names(), names: shell.names() }));
        loop {
            match editor.readline(shell.prompt()) {
                Ok(line) => return Some(line),
                // A signal that has stopped a run before may be told here late.
                Err(ReadlineError::Interrupted | ReadlineError::Signal(_)) => {}
                Err(_) => return None,
            }
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if let (Some(editor), Some(file)) = (&mut self.editor, &self.history) {
            if let Some(folder) = file.parent() {
                _ = std::fs::create_dir_all(folder);
            }
            _ = editor.save_history(file);
        }
    }
}

/// Where the history is kept: `emu/debug-history` in the folder for states (XDG Base Directory Specification).
fn history_file() -> Option<PathBuf> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let own = set("XDG_STATE_HOME").filter(|folder| folder.is_absolute());
    let folder = own.or_else(|| Some(set("HOME")?.join(".local/state")))?;
    Some(folder.join("emu/debug-history"))
}
