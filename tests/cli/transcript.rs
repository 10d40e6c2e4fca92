//! Transcripts: commands with their expected output, replayed and compared.

use std::fs;
use std::path::Path;
use std::process::Output;

/// The result of replaying a transcript.
pub struct Replayed {
    /// The transcript with the actual output instead of the expected one (blocks with `...` stay unchanged).
    pub text: String,
    /// The differences, one entry per command.
    pub differs: Vec<String>,
    /// True if a command that differs has `...`, so that a person must fix it.
    pub by_hand: bool,
}

/// One command of a transcript.
#[derive(Default)]
struct Block<'a> {
    line: usize,
    command: &'a str,
    input: Vec<u8>,
    wanted: Vec<String>,
}

/// Replays a transcript; `emu` runs the binary with arguments and standard input.
pub fn replay(text: &str, emu: &mut dyn FnMut(&[String], &[u8]) -> Output, folder: &Path) -> Replayed {
    let mut out = Replayed { text: String::new(), differs: Vec::new(), by_hand: false };
    let mut block: Option<Block<'_>> = None;
    for (number, line) in text.lines().enumerate() {
        if let Some(command) = line.strip_prefix("$ ") {
            finish(block.take(), emu, folder, &mut out);
            block = Some(Block { line: number + 1, command, ..Block::default() });
            out.text += &format!("{line}\n");
        } else if let (Some(input), Some(block)) = (line.strip_prefix("< ").or((line == "<").then_some("")), &mut block)
        {
            block.input.extend_from_slice(format!("{input}\n").as_bytes());
            out.text += &format!("{line}\n");
        } else if let (true, Some(block)) = (line.starts_with(['|', '!', '=']), &mut block) {
            block.wanted.push(line.to_owned());
        } else {
            assert!(
                line.is_empty() || line.starts_with('#'),
                "line {}: `{line}` is not a part of a transcript",
                number + 1
            );
            finish(block.take(), emu, folder, &mut out);
            out.text += &format!("{line}\n");
        }
    }
    finish(block.take(), emu, folder, &mut out);
    out
}

fn finish(
    block: Option<Block<'_>>,
    emu: &mut dyn FnMut(&[String], &[u8]) -> Output,
    folder: &Path,
    out: &mut Replayed,
) {
    let Some(block) = block else { return };
    let words = words(block.command);
    let found = match words.first().map(String::as_str) {
        Some("emu") => {
            let result = emu(&words[1..], &block.input);
            let mut lines = prefixed('|', &result.stdout);
            lines.extend(prefixed('!', &result.stderr));
            if words.get(1).is_some_and(|verb| verb == "test") {
                lines.iter_mut().for_each(|line| *line = without_host_time(line));
            }
            lines.push(format!("= {}", result.status.code().map_or("signal".to_owned(), |c| c.to_string())));
            lines
        }
        Some("cat") => {
            prefixed('|', &fs::read(folder.join(&words[1])).unwrap_or_else(|e| panic!("{}: {e}", block.command)))
        }
        Some("ls") => {
            let names = fs::read_dir(folder).expect("the folder").map(|e| e.expect("an entry").file_name());
            let mut names: Vec<String> = names.map(|n| format!("| {}", n.to_string_lossy())).collect();
            names.retain(|n| words.get(1).is_none_or(|part| n.contains(part.as_str())));
            names.sort();
            names
        }
        _ => panic!("line {}: no command of transcripts", block.line),
    };
    let same = matches(&block.wanted, &found);
    let open = block.wanted.iter().any(|w| w.ends_with("..."));
    for line in if open { &block.wanted } else { &found } {
        out.text += &format!("{line}\n");
    }
    if !same {
        out.by_hand |= open;
        let (wanted, found) = (block.wanted.join("\n"), found.join("\n"));
        let (line, command) = (block.line, block.command);
        out.differs.push(format!("line {line}: {command}\n--- wanted\n{wanted}\n--- found\n{found}\n"));
    }
}

fn prefixed(prefix: char, bytes: &[u8]) -> Vec<String> {
    String::from_utf8_lossy(bytes).lines().map(|line| format!("{prefix} {line}").trim_end().to_owned()).collect()
}

/// Replaces the host time in a line of `emu test`: `[   0.123s]` and `time="0.123"`.
fn without_host_time(line: &str) -> String {
    let mut text = line.to_owned();
    for (open, close) in [("[", "s]"), ("time=\"", "\"")] {
        let Some((before, rest)) = text.split_once(open) else { continue };
        let Some((time, after)) = rest.split_once(close) else { continue };
        if time.trim().parse::<f64>().is_ok() {
            text = format!("{before}{open}{}{close}{after}", "#".repeat(time.len().min(5)));
        }
    }
    text
}

/// Compares expected and actual lines; `|...` and `!...` match any number of lines of their kind.
fn matches(wanted: &[String], found: &[String]) -> bool {
    let Some((first, rest)) = wanted.split_first() else { return found.is_empty() };
    if let Some(kind) = first.strip_suffix("...").filter(|kind| kind.len() == 1) {
        let most = found.iter().take_while(|f| f.starts_with(kind)).count();
        return (0..=most).any(|n| matches(rest, &found[n..]));
    }
    found.first() == Some(first) && matches(rest, &found[1..])
}

/// Splits a command into words as a shell does: quotes of both kinds, no escapes.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in command.chars() {
        match quote {
            Some(q) if c == q => quote = None,
            None if c == '\'' || c == '"' => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            None if c == ' ' => words.extend(word.take()),
            _ => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}
