//! Source lines between the instructions of a listing.

use diag::{Diagnostic, Severity};
use emu_core::image::SourceLines;
use emu_debug::ProgramSource;

use super::DisasmArgs;
use crate::shared::codes::{NO_LINES, file_error};
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::sources::SourceFiles;

/// Finds the source line of each instruction.
pub(super) struct SourceLineListing<'a> {
    lines: &'a SourceLines,
    sources: SourceFiles,
    /// The line of the previous instruction.
    last: Option<String>,
}

impl<'a> SourceLineListing<'a> {
    /// Creates the listing for the image that the arguments name. Prints a warning if there are no source
    /// lines.
    pub(super) fn new(args: &DisasmArgs, lines: &'a SourceLines, style: &MessageStyle) -> SourceLineListing<'a> {
        if lines.all_lines().is_empty() && lines.warnings().is_empty() {
            let hint = "give an ELF file that was compiled with -gdwarf-4, or files of symbols with --symbols";
            let none = file_error(NO_LINES, &args.image, "there are no source lines".to_owned(), hint);
            report_diagnostics(style, &[Diagnostic { severity: Severity::Warning, ..none }], FileTexts::NONE);
        }
        let files = std::iter::once(&args.image).chain(&args.symbols).map(String::as_str);
        SourceLineListing { lines, sources: SourceFiles::new(files), last: None }
    }

    /// Returns the line of a program word, and its text if known.
    pub(super) fn line_at(&mut self, word: u32, source: &ProgramSource<'_>) -> Option<(String, Option<&str>)> {
        let line = source.line_at(word)?;
        Some((format!("{}:{}", line.file, line.line), self.sources.text(self.lines, line)))
    }

    /// Returns line and text of a program word as a comment, if they differ from those of the previous word:
    /// `; main.c:12: x = 1;`.
    pub(super) fn heading(&mut self, word: u32, source: &ProgramSource<'_>) -> Option<String> {
        let (line, text) = self.line_at(word, source).map(|(line, text)| (Some(line), text)).unwrap_or_default();
        let heading = line.as_ref().map(|line| match text {
            Some(text) => format!("; {line}: {text}\n"),
            None => format!("; {line}\n"),
        });
        let new = line != self.last;
        self.last = line;
        heading.filter(|_| new)
    }
}
