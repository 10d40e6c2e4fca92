//! Source texts: where includes come from, and what was read, for diagnostics.

use std::io;
use std::ops::Range;
use std::rc::Rc;

use diag::{Pos, text};

use crate::lines::AsmLine;

/// Opens included files.
pub trait IncludeFiles {
    /// Opens the file `name` that the file `from` includes; returns its path for display, and its bytes.
    ///
    /// # Errors
    /// It cannot be read.
    fn open(&mut self, name: &str, from: &str) -> io::Result<(String, Vec<u8>)>;
}

/// An implementation without files.
impl IncludeFiles for () {
    fn open(&mut self, _: &str, _: &str) -> io::Result<(String, Vec<u8>)> {
        Err(io::Error::new(io::ErrorKind::NotFound, "no files can be included here"))
    }
}

/// The texts that were read, by display name.
#[derive(Debug, Clone, Default)]
pub struct SourceTexts {
    files: Vec<ReadText>,
}

#[derive(Debug, Clone)]
struct ReadText {
    name: String,
    bytes: Vec<u8>,
    lines: Rc<[AsmLine]>,
}

impl SourceTexts {
    /// Returns the bytes of the text with this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.iter().find(|text| text.name == name).map(|text| text.bytes.as_slice())
    }

    /// Returns names and bytes of all texts, the source first.
    pub fn all(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.files.iter().map(|text| (text.name.as_str(), text.bytes.as_slice()))
    }

    /// Adds a text; returns its number.
    pub(crate) fn add(&mut self, name: &str, bytes: &[u8], block_comments: bool) -> u32 {
        let file = self.files.len() as u32;
        let bytes = &*text::strip_line_decorations(bytes);
        let text = text::decode_text(bytes);
        let bare = if block_comments && text.contains("/*") { blank_block_comments(&text) } else { text.into_owned() };
        let whole = bare.strip_suffix('\n').unwrap_or(&bare);
        let lines = whole.split('\n').map(|line| line.trim_end_matches('\r')).zip(1..);
        let lines = lines.map(|(text, number)| AsmLine { text: text.into(), file, number, map: None });
        let lines: Vec<AsmLine> = lines.collect();
        let lines = if block_comments { join_continued_lines(lines).into() } else { lines.into() };
        self.files.push(ReadText { name: name.to_owned(), bytes: bytes.to_vec(), lines });
        file
    }

    /// Returns the name of a text's encoding, judged by its first bytes, if it is not supported.
    pub(crate) fn encoding(&self, file: u32) -> Option<&'static str> {
        text::wide_encoding(&self.files.get(file as usize)?.bytes)
    }

    /// The lines of a file; empty if there is no such file.
    pub(crate) fn lines(&self, file: u32) -> Rc<[AsmLine]> {
        self.files.get(file as usize).map(|text| text.lines.clone()).unwrap_or_default()
    }

    /// The name of a file; empty if there is no such file.
    pub(crate) fn name(&self, file: u32) -> &str {
        self.files.get(file as usize).map_or("", |text| &text.name)
    }

    /// Returns the text of a line of a file.
    pub(crate) fn line(&self, file: u32, number: u32) -> &str {
        let text = self.files.get(file as usize);
        text.and_then(|text| text.lines.get((number as usize).checked_sub(1)?)).map_or("", |line| &line.text)
    }

    /// Returns file and position of a byte range of a line.
    pub(crate) fn pos(&self, line: &AsmLine, at: &Range<usize>) -> (String, Pos) {
        let (start, end) = match &line.map {
            Some(map) => {
                (map.old(at.start), map.old(at.end.saturating_sub(1).max(at.start)) + usize::from(at.end > at.start))
            }
            None => (at.start, at.end),
        };
        let text = self.line(line.file, line.number);
        let count = |to: usize| text.char_indices().take_while(|(i, _)| *i < to).count() as u32;
        let column = count(start) + 1;
        let width = (count(end) + 1).saturating_sub(column).max(1);
        (self.name(line.file).to_owned(), Pos::new(line.number, column, width))
    }
}

/// Joins preprocessor lines that end with a backslash with the lines that follow, and leaves empty lines in
/// their place.
fn join_continued_lines(mut lines: Vec<AsmLine>) -> Vec<AsmLine> {
    let goes_on = |line: &AsmLine| line.text.ends_with('\\');
    let mut at = 0;
    while let Some(first) = lines.get(at) {
        let behind = lines.iter().skip(at).position(|line| !goes_on(line)).map_or(lines.len(), |n| at + n + 1);
        if !first.text.trim_start().starts_with('#') || behind == at + 1 {
            at += 1;
            continue;
        }
        let pieces = lines.get_mut(at..behind).unwrap_or_default();
        let whole: Vec<&str> = pieces.iter().map(|line| line.text.trim_end_matches('\\')).collect();
        let whole = whole.join(" ");
        pieces.iter_mut().for_each(|line| line.text = "".into());
        if let Some(first) = pieces.first_mut() {
            first.text = whole.into();
        }
        at = behind.max(at + 1);
    }
    lines
}

/// Replaces `/* .. */` by spaces and keeps line ends.
fn blank_block_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = find_block_comment(rest) {
        // An unclosed comment stays and is reported as what it contains.
        let Some(end) = rest.get(start + 2..).and_then(|inside| inside.find("*/")) else { break };
        let end = start + 2 + end + 2;
        out.push_str(rest.get(..start).unwrap_or_default());
        let block = rest.get(start..end).unwrap_or_default();
        out.extend(block.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
        rest = rest.get(end..).unwrap_or_default();
    }
    out + rest
}

/// Returns the number of bytes between the single quote at the start and the one that closes it on the same
/// line; 0 if none does.
fn quoted_length(text: &str) -> usize {
    let line = text.split('\n').next().unwrap_or_default();
    let close = if line.starts_with("'\\") { 3 } else { 2 };
    match line.as_bytes().get(close) {
        Some(b'\'') => close,
        _ => line.get(1..).and_then(|rest| rest.find('\'')).map_or(0, |at| at + 1),
    }
}

/// Returns where a block comment begins, outside quotes and other comments.
fn find_block_comment(text: &str) -> Option<usize> {
    let bytes = text.as_bytes();
    let mut quote = 0u8;
    let mut i = 0;
    while i < bytes.len() {
        let (c, next) = (bytes.get(i).copied()?, bytes.get(i + 1).copied().unwrap_or(0));
        match c {
            b'\n' => quote = 0,
            b'\\' if quote != 0 => i += 1,
            b'"' if quote == 0 || quote == b'"' => quote ^= b'"',
            b'\'' if quote == 0 => i += quoted_length(text.get(i..).unwrap_or_default()),
            b'/' if quote == 0 && next == b'*' => return Some(i),
            b';' if quote == 0 => quote = b';',
            b'/' if quote == 0 && next == b'/' => quote = b';',
            _ => {}
        }
        i += 1;
    }
    None
}
