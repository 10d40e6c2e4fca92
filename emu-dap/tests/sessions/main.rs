//! Replays whole debug sessions from transcripts: `tests/*.txt`.
//!
//! ```text
//! # a comment
//! > {..}    a request, to which seq and type are added; a run that it starts continues until a stop
//! & {..}    a request; the machine keeps running after it
//! < {..}    a message from the adapter; `...` matches any text
//! ```
//! Paths of this machine are written as `...`. `EMU_BLESS=1` rewrites the transcripts, to be reviewed and
//! committed. `frames.txt` tests the input byte by byte: `$` is the input with escapes, `!` the error that
//! ends it.

mod open;

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use emu_dap::{DebugAdapter, serve};
use emu_debug::text_escapes::unescape;
use open::{open, root};
use serde_json::{Value, json};

/// Number of slices after which a machine must have stopped.
const PATIENCE: usize = 1500;

fn tables() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let entries = fs::read_dir(folder).expect("the folder of the tests");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "txt"));
    // The variable SESSION selects transcripts by name.
    let only = std::env::var("SESSION").unwrap_or_default();
    files.retain(|file| file.to_string_lossy().contains(&only));
    files.sort();
    files
}

/// A message in the format of a transcript.
fn message_line(message: &Value) -> String {
    format!("< {}", message.to_string().replace(&root().display().to_string(), "..."))
}

/// Compares a line with an expected one, in which `...` matches any text.
fn fits(wanted: &str, found: &str) -> bool {
    let mut pieces = wanted.split("...");
    let Some(mut rest) = pieces.next().and_then(|first| found.strip_prefix(first)) else { return false };
    let mut last = "";
    for piece in pieces {
        let Some(at) = rest.find(piece) else { return false };
        rest = &rest[at + piece.len()..];
        last = piece;
    }
    rest.is_empty() || wanted.ends_with("...") || !last.is_empty() && found.ends_with(last)
}

/// One request, or one piece of input, with the expected answers.
#[derive(Default)]
struct Block {
    line: usize,
    asked: String,
    wanted: Vec<String>,
}

/// Replays a transcript; `answer` returns the lines that answer a request.
fn replay(file: &Path, answer: &mut dyn FnMut(&str) -> Vec<String>) -> Vec<String> {
    let text = fs::read_to_string(file).expect("a table");
    let (mut out, mut differs) = (String::new(), Vec::new());
    let mut finish = |block: Option<Block>, out: &mut String| {
        let Some(block) = block else { return };
        let found = answer(&block.asked);
        let same = block.wanted.len() == found.len() && block.wanted.iter().zip(&found).all(|(w, f)| fits(w, f));
        // A matching line keeps its `...`.
        for line in if same { &block.wanted } else { &found } {
            *out += &format!("{line}\n");
        }
        if !same {
            let (wanted, found) = (block.wanted.join("\n"), found.join("\n"));
            differs.push(format!("line {}: {}\n--- wanted\n{wanted}\n--- found\n{found}\n", block.line, block.asked));
        }
    };
    let mut block: Option<Block> = None;
    for (number, line) in text.lines().enumerate() {
        if line.starts_with(['<', '!']) {
            block.as_mut().expect("an answer behind a question").wanted.push(line.to_owned());
            continue;
        }
        finish(block.take(), &mut out);
        out += &format!("{line}\n");
        if line.starts_with(['>', '&', '$']) {
            block = Some(Block { line: number + 1, asked: line.to_owned(), wanted: Vec::new() });
        } else {
            assert!(line.is_empty() || line.starts_with('#'), "{}:{}: `{line}`", file.display(), number + 1);
        }
    }
    finish(block.take(), &mut out);
    if std::env::var_os("EMU_BLESS").is_some() && out != text {
        fs::write(file, out).expect("the table written again");
    }
    differs
}

/// Replays a session.
fn session(file: &Path) -> Vec<String> {
    let mut adapter = DebugAdapter::new(&open);
    let mut seq = 0;
    replay(file, &mut |line| {
        let (kind, text) = line.split_at(1);
        let mut request: Value = serde_json::from_str(text).unwrap_or_else(|e| panic!("{line}: {e}"));
        seq += 1;
        if let Some(fields) = request.as_object_mut() {
            fields.entry("seq").or_insert(json!(seq));
            fields.entry("type").or_insert(json!("request"));
        }
        let mut found: Vec<String> = adapter.handle(&request).iter().map(message_line).collect();
        if kind == "&" {
            found.extend(adapter.run_slice(&mut || false).iter().map(message_line));
            return found;
        }
        let mut slices = 0;
        while adapter.is_running() && slices < PATIENCE {
            found.extend(adapter.run_slice(&mut || true).iter().map(message_line));
            slices += 1;
        }
        if slices == PATIENCE {
            found.push("! it did not stop".to_owned());
        }
        found
    })
}

/// The messages that answer an input, and the error.
fn served(line: &str) -> Vec<String> {
    let text = line.trim_start_matches(['$', ' ']);
    let input = if text.is_empty() { Vec::new() } else { unescape(text).expect("escapes") };
    let mut output = Vec::new();
    let ended = serve(Cursor::new(input), &mut output, &open);
    let mut output = Cursor::new(output);
    let mut found = Vec::new();
    while let emu_dap::framing::IncomingMessage::Message(message) =
        emu_dap::framing::read_message(&mut output).expect("frames")
    {
        found.push(message_line(&message));
    }
    found.extend(ended.err().map(|why| format!("! {why}")));
    found
}

#[test]
fn sessions() {
    // Paths in the transcripts are relative to the workspace.
    std::env::set_current_dir(root()).expect("the workspace");
    let mut wrong = Vec::new();
    let files = tables();
    assert!(!files.is_empty(), "no tables");
    for file in files {
        let name = file.file_name().expect("a name").to_string_lossy().into_owned();
        let differs = if name == "frames.txt" { replay(&file, &mut served) } else { session(&file) };
        wrong.extend(differs.iter().map(|text| format!("{name}: {text}")));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
