//! A line from a user at a terminal, with history and completion.

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

/// Ends the mode in which the terminal tells what is pasted, and the line of the prompt.
const PASTE_OFF: &[u8] = b"\x1b[?2004l\n";

/// Lines that the history keeps.
const MAX_HISTORY_LINES: usize = 1000;

/// What completes a word: the candidates, as they are when the line is begun.
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

/// Where the word begins with which a text ends.
fn word_start(text: &str) -> usize {
    let of_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '-');
    // What precedes may be of more than one byte.
    let mut start = text.trim_end_matches(of_word).len();
    // The colons of `app::result` are of the name, that of `data:buf` is not.
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

/// Asks for lines. It is made before anybody listens to SIGINT: the editor takes that signal for itself when it is made, and who
/// listens later is told first.
pub struct LineEditor {
    editor: Option<Editor<WordCompleter, FileHistory>>,
    history: Option<PathBuf>,
    /// What the terminal was set to, in the words of stty.
    saved_settings: Option<String>,
}

impl LineEditor {
    /// With the history of sessions before. A history that cannot be read or written is none.
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

    /// A signal that ends the program while the editor has the terminal, which `prompt` tells, would leave it to the shell as the
    /// editor has set it. Where it cannot be listened for it is so.
    pub fn restore_on_signal(&self, prompt: &Arc<AtomicBool>) {
        for signal in [SIGTERM, SIGHUP] {
            let Ok((mut told, teller)) = UnixStream::pair() else { continue };
            let (prompt, found) = (Arc::clone(prompt), self.saved_settings.clone());
            let ended = move || {
                while matches!(told.read(&mut [0]), Ok(1)) {
                    if prompt.load(Ordering::SeqCst) {
                        _ = found.as_deref().map(stty);
                        _ = std::io::stdout().write_all(PASTE_OFF);
                        _ = signal_hook::low_level::emulate_default_handler(signal);
                    }
                }
            };
            if std::thread::Builder::new().spawn(ended).is_ok() {
                _ = signal_hook::low_level::pipe::register(signal, teller);
            }
        }
    }

    /// The next line; nothing at the end of the input. Ctrl-C at the prompt drops what was typed.
    pub fn read_line(&mut self, shell: &DebugShell) -> Option<String> {
        let editor = self.editor.as_mut()?;
        editor.set_helper(Some(WordCompleter { commands: shell.command_names(), names: shell.names() }));
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

/// What stty says of the terminal; the thing itself is not to be had without it.
fn stty(words: &str) -> Option<String> {
    let out = Command::new("stty").arg(words).stdin(Stdio::inherit()).stderr(Stdio::null()).output().ok()?;
    out.status.success().then(|| String::from_utf8_lossy(&out.stdout).trim().to_owned())
}

/// Where the history is kept: `emu/debug-history` in the folder for states (XDG Base Directory Specification).
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
