//! Source lines between the instructions.

use diag::{Diagnostic, Severity};
use emu_core::image::Lines;
use emu_debug::Source;

use super::DisasmArgs;
use crate::codes::{NO_LINES, about_file};
use crate::report::{Terminal, Texts, report};
use crate::sources::Sources;

/// Source lines between the instructions.
pub(super) struct Listing<'a> {
    lines: &'a Lines,
    sources: Sources,
    /// The line of the instruction before.
    last: Option<String>,
}

impl<'a> Listing<'a> {
    /// The lines of the image that the arguments name.
    pub(super) fn new(args: &DisasmArgs, lines: &'a Lines, terminal: &Terminal) -> Listing<'a> {
        if lines.all().is_empty() && lines.warnings().is_empty() {
            let hint = "give an ELF file that was compiled with -gdwarf-4, or files of symbols with --symbols";
            let none = about_file(NO_LINES, &args.image, "there are no source lines".to_owned(), hint);
            report(terminal, &[Diagnostic { severity: Severity::Warning, ..none }], Texts::NONE);
        }
        let files = std::iter::once(&args.image).chain(&args.symbols).map(String::as_str);
        Listing { lines, sources: Sources::new(files), last: None }
    }

    /// Line and text at a program word.
    pub(super) fn at(&mut self, word: u32, source: &Source<'_>) -> Option<(String, Option<&str>)> {
        let line = source.line_at(word)?;
        Some((format!("{}:{}", line.file, line.line), self.sources.text(self.lines, line)))
    }

    /// Line and text at a program word, where they are others than at the one before: `; main.c:12: x = 1;`.
    pub(super) fn heading(&mut self, word: u32, source: &Source<'_>) -> Option<String> {
        let (line, text) = self.at(word, source).map(|(line, text)| (Some(line), text)).unwrap_or_default();
        let heading = line.as_ref().map(|line| match text {
            Some(text) => format!("; {line}: {text}\n"),
            None => format!("; {line}\n"),
        });
        let new = line != self.last;
        self.last = line;
        heading.filter(|_| new)
    }
}
