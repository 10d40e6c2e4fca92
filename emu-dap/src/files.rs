//! Sources and their lines: the ladder program, source files of the compiler, and the disassembly made by the
//! adapter.

use std::path::{Path, PathBuf, absolute};

use emu_core::image::SourceLine;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::error::DapError;
use crate::protocol::{DapRequest, DapSource, RequestError};

/// The source reference of the disassembly.
pub(crate) const LISTING: i64 = 1;

/// Maximum number of lines that are searched after a line without code.
const MAX_LINES_SEARCHED: u32 = 200;

/// A line, and where its code begins.
pub(crate) struct LineStart {
    /// The program word.
    pub word: u32,
    /// The line, from 1.
    pub line: u32,
}

/// The code of a line.
pub(crate) struct LocatedLine {
    /// Program words at which the line starts; at least one.
    pub words: Vec<u32>,
    /// The line, which may be after the requested one.
    pub line: u32,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct SourceArguments {
    source: DapSource,
    source_reference: i64,
}

impl DapMachine {
    /// The code of a source line, or of the next line that has code.
    ///
    /// # Errors
    /// The source is not known, or there is no code.
    pub fn words_of(&mut self, source: &DapSource, line: u32) -> Result<LocatedLine, DapError> {
        if source.source_reference == Some(LISTING) {
            let found = self.listing().word_at(line);
            let LineStart { word, line } = found.ok_or(DapError::NoInstructionAtLine { line })?;
            return Ok(LocatedLine { words: vec![word], line });
        }
        let path = source.path.as_ref().or(source.name.as_ref()).ok_or(DapError::SourceWithoutPath)?;
        if let Some(ladder) = self.ladder.as_ref().filter(|ladder| ladder.is_file(path)) {
            let LineStart { word, line } = ladder.word_of_line(line)?;
            return Ok(LocatedLine { words: vec![word], line });
        }
        if ladder::is_program_name(path) && self.ladder.is_none() {
            return Err(DapError::RungsUnknown);
        }
        let lines = &self.session.scope.lines;
        let mut first_error = None;
        for line in line..line.saturating_add(MAX_LINES_SEARCHED) {
            match lines.addresses_of_line(path, line) {
                Ok(places) => {
                    let words = self.session.scope.line_words(&places);
                    return Ok(LocatedLine { words, line });
                }
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        Err(first_error.map_or(DapError::NoInstructionAtLine { line }, DapError::SourceLine))
    }

    /// The protocol's description of the source file of a line.
    pub fn source_of(&self, line: &SourceLine) -> Value {
        // A source that was assembled directly is the program itself.
        let file = if line.file.is_empty() { &*self.name } else { &*line.file };
        let name = Path::new(file).file_name().map_or_else(|| file.to_owned(), |n| n.to_string_lossy().into());
        json!({ "name": name, "path": self.path_of(file).display().to_string() })
    }

    /// The path of a source file: in the folder of its compilation, or next to the image.
    fn path_of(&self, file: &str) -> PathBuf {
        let known = Path::new(file);
        let home = self.session.scope.lines.folder(file).map(|folder| Path::new(folder).join(known));
        let beside = self.folder.join(known);
        let name = known.file_name().map(|name| self.folder.join(name));
        let all: Vec<PathBuf> = home.into_iter().chain([beside]).chain(name).collect();
        let found = all.iter().find(|path| path.is_file()).or(all.first()).cloned().unwrap_or_default();
        absolute(&found).unwrap_or(found)
    }

    /// The protocol's description of the disassembly.
    pub fn listing_source(&self) -> Value {
        json!({ "name": format!("{}, disassembled", self.name), "sourceReference": LISTING, "origin": "emu" })
    }
}

impl DebugAdapter<'_> {
    /// Answers `source`: the text of a file that only the adapter has.
    pub(crate) fn source(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let SourceArguments { source, source_reference } = request.parse_arguments()?;
        let machine = self.machine()?;
        let number = source.source_reference.filter(|number| *number != 0).unwrap_or(source_reference);
        match number {
            LISTING => Ok(json!({ "content": machine.listing().text(), "mimeType": "text/x-asm" })),
            _ => Err(RequestError::not_found(format!("there is no source {number}"))),
        }
    }

    /// Answers `loadedSources`: all files with lines of code.
    pub(crate) fn loaded_sources(&mut self) -> Result<Value, RequestError> {
        let machine = self.machine()?;
        let mut sources: Vec<Value> = machine.ladder.iter().map(|ladder| ladder.source()).collect();
        let mut seen: Vec<&str> = Vec::new();
        for line in machine.session.scope.lines.all_lines() {
            if !seen.contains(&&*line.file) {
                seen.push(&line.file);
                sources.push(machine.source_of(line));
            }
        }
        sources.push(machine.listing_source());
        Ok(json!({ "sources": sources }))
    }
}
