//! Reads lines from a user at a terminal, with history and completion.

use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::Validator;
use rustyline::{Config, Context, Editor, Helper};
use signal_hook::consts::{SIGHUP, SIGTERM};

use super::shell::DebugShell;

/// Ends the bracketed paste mode of the terminal, and the line of the prompt.
const PASTE_OFF: &[u8] = b"\x1b[?2004l\n";

/// Maximum number of lines of the history.
const MAX_HISTORY_LINES: usize = 1000;

/// Completes a word; the candidates are collected when the line begins.
struct WordCompleter {
    commands: Vec<String>,
    names: Vec<String>,
}

impl Completer for WordCompleter {
    type Candidate = String;

    fn complete(&self, line: &str, at: usize, _: &Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        let before = line.get(..at).unwrap_or_default();
        let start = word_start(before);
        let word = before.get(start..).unwrap_or_default();
        let first = before.get(..start).unwrap_or_default().trim().is_empty();
        let pool = if first { &self.commands } else { &self.names };
        Ok((start, pool.iter().filter(|name| name.starts_with(word)).cloned().collect()))
    }
}

/// Returns the start of the last word of a text.
fn word_start(text: &str) -> usize {
    let of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '-');
    // The character before may have more than one byte.
    let mut start = text.trim_end_matches(of_word).len();
    // The colons of `app::result` are part of the name, that of `data:buf` is not.
    while let Some(outer) = text.get(..start).and_then(|outer| outer.strip_suffix("::")) {
        start = outer.trim_end_matches(of_word).len();
    }
    start
}

impl Hinter for WordCompleter {
    type Hint = String;
}
impl Highlighter for WordCompleter {}
impl Validator for WordCompleter {}
impl Helper for WordCompleter {}

/// Reads lines. It must be created before a handler for SIGINT is registered: the editor installs its own
/// handler when it is created, and a handler that is registered later is called first.
pub struct LineEditor {
    editor: Option<Editor<WordCompleter, FileHistory>>,
    history: Option<PathBuf>,
    /// The settings of the terminal before the session, as printed by `stty -g`.
    saved_settings: Option<String>,
}

impl LineEditor {
    /// Creates an editor with the history of earlier sessions. A history that cannot be read or written is
    /// ignored.
    pub fn new() -> LineEditor {
        let config =
            Config::builder().max_history_size(MAX_HISTORY_LINES).map(|config| config.auto_add_history(true).build());
        let editor = config.and_then(Editor::with_config);
        let mut terminal = LineEditor { editor: editor.ok(), history: history_file(), saved_settings: stty("-g") };
        if let (Some(editor), Some(file)) = (&mut terminal.editor, &terminal.history) {
            _ = editor.load_history(file);
        }
        terminal
    }

    /// Restores the terminal if SIGTERM or SIGHUP ends the program while the editor reads a line (`prompt` is
    /// true), because the editor has changed the settings. If the handler cannot be registered, nothing is
    /// restored.
    pub fn restore_on_signal(&self, prompt: &Arc<AtomicBool>) {
        for signal in [SIGTERM, SIGHUP] {
            let Ok((mut receiver, sender)) = UnixStream::pair() else { continue };
            let (prompt, found) = (Arc::clone(prompt), self.saved_settings.clone());
            let ended = move || {
                while matches!(receiver.read(&mut [0]), Ok(1)) {
                    if prompt.load(Ordering::SeqCst) {
                        _ = found.as_deref().map(stty);
                        _ = std::io::stdout().write_all(PASTE_OFF);
                        _ = signal_hook::low_level::emulate_default_handler(signal);
                    }
                }
            };
            if std::thread::Builder::new().spawn(ended).is_ok() {
                _ = signal_hook::low_level::pipe::register(signal, sender);
            }
        }
    }

    /// Returns the next line, or `None` at the end of the input. Ctrl-C at the prompt discards the typed
    /// text.
    pub fn read_line(&mut self, shell: &DebugShell) -> Option<String> {
        let editor = self.editor.as_mut()?;
        editor.set_helper(Some(WordCompleter { commands: shell.command_names(), names: shell.names() }));
        loop {
            match editor.readline(shell.prompt()) {
                Ok(line) => return Some(line),
                // A signal that stopped an earlier run may be reported here late.
                Err(ReadlineError::Interrupted | ReadlineError::Signal(_)) => {}
                Err(_) => return None,
            }
        }
    }
}

impl Drop for LineEditor {
    fn drop(&mut self) {
        if let (Some(editor), Some(file)) = (&mut self.editor, &self.history) {
            if let Some(folder) = file.parent() {
                _ = std::fs::create_dir_all(folder);
            }
            _ = editor.save_history(file);
        }
    }
}

/// Runs `stty` on the terminal and returns its output; there is no other safe access to the settings.
fn stty(words: &str) -> Option<String> {
    let out = Command::new("stty").arg(words).stdin(Stdio::inherit()).stderr(Stdio::null()).output().ok()?;
    out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Returns the history file: `emu/debug-history` in the folder for states (XDG Base Directory Specification).
fn history_file() -> Option<PathBuf> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let own = set("XDG_STATE_HOME").filter(|folder| folder.is_absolute());
    let folder = own.or_else(|| Some(set("HOME")?.join(".local/state")))?;
    Some(folder.join("emu/debug-history"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `line up to the cursor | where its last word begins | candidates`.
    #[test]
    fn the_last_word_is_completed() {
        let text = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let words = WordCompleter { commands: text(&["print", "stepi"]), names: text(&["Ylamp", "r16"]) };
        let history = rustyline::history::MemHistory::new();
        let cases: &[(&str, usize, &[&str])] = &[
            ("", 0, &["print", "stepi"]),
            ("  pr", 2, &["print"]),
            ("print Yl", 6, &["Ylamp"]),
            ("print 5\u{20ac}", 10, &["Ylamp", "r16"]),
            ("print \u{e9}\u{20ac}r", 11, &["r16"]),
        ];
        for (line, start, wanted) in cases {
            let found = words.complete(line, line.len(), &Context::new(&history)).expect("candidates");
            assert_eq!(found, (*start, text(wanted)), "{line}");
        }
    }
}
