//! Maps program words to rungs and elements of a ladder program, and these to lines of its text.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf, absolute};

use ladder::{ElementId, ProgramElement};
use ladder_view::{ElementStart, LadderView, RungStart};
use serde_json::{Value, json};

use crate::error::DapError;
use crate::files::LineStart;

/// Line and text of an element.
struct ElementText {
    line: u32,
    text: String,
}

/// The identity of the element that starts at a program word.
fn start_id(start: &ElementStart) -> ElementId {
    ElementId { rung: start.rung.saturating_sub(1), index: start.element.saturating_sub(1) }
}

/// The ladder program of a machine.
pub(crate) struct LadderSource {
    view: LadderView,
    /// Path of its `.ld` file.
    file: PathBuf,
    /// The rungs that have code, with their first program word.
    rungs: Vec<RungStart>,
    elements: Vec<ElementStart>,
    texts: BTreeMap<ElementId, ElementText>,
}

impl LadderSource {
    /// Collects the rungs and elements of a view.
    pub fn new(view: LadderView) -> LadderSource {
        let file = PathBuf::from(&view.program().file);
        let texts = view.program().elements().map(|ProgramElement { id, element, pos }| {
            (id, ElementText { line: pos.line, text: ladder::element_text(element) })
        });
        LadderSource {
            file: absolute(&file).unwrap_or(file),
            rungs: view.rung_starts(),
            elements: view.element_starts(),
            texts: texts.collect(),
            view,
        }
    }

    pub fn view(&self) -> &LadderView {
        &self.view
    }

    /// First program words of all rungs.
    pub fn rung_starts(&self) -> BTreeSet<u32> {
        self.rungs.iter().map(|start| start.word).collect()
    }

    /// First program words of all elements.
    pub fn element_starts(&self) -> BTreeSet<u32> {
        self.elements.iter().map(|start| start.word).collect()
    }

    /// First program word of a scan.
    pub fn scan_start(&self) -> u32 {
        self.view.scan_start()
    }

    /// Number of the rung at a program word, from 1.
    pub fn rung_at(&self, word: u32) -> Option<u32> {
        self.view.rung_at(word)
    }

    /// True if the program has a rung with this number, from 1.
    pub fn has(&self, rung: u32) -> bool {
        rung > 0 && self.view.program().rungs.len() >= rung as usize
    }

    /// True if `path` is the file of the ladder program.
    pub fn is_file(&self, path: &str) -> bool {
        let path = Path::new(path);
        let real = |path: &Path| path.canonicalize().ok();
        absolute(path).is_ok_and(|path| path == self.file)
            || real(path).is_some_and(|path| real(&self.file) == Some(path))
    }

    /// The protocol's description of the source.
    pub fn source(&self) -> Value {
        let name = self.file.file_name().map(|name| name.to_string_lossy().into_owned());
        json!({ "name": name, "path": self.file.display().to_string() })
    }

    /// The element or rung at a program word, with its line.
    pub fn place(&self, word: u32) -> Option<(String, u32)> {
        let element = self.view.element_at(word);
        if let Some((id, ElementText { line, text })) = element.and_then(|id| Some((id, self.texts.get(&id)?))) {
            return Some((format!("{id}: {text}"), *line));
        }
        let rung = self.view.rung_at(word)?;
        Some((format!("rung {rung}"), self.view.rung_line(rung)?))
    }

    /// Returns the first word of the rung to which a line belongs, or of the next rung with code; and the
    /// line of that rung.
    pub fn word_of_line(&self, line: u32) -> Result<LineStart, DapError> {
        let wanted = match self.view.rung_of_line(line) {
            Some(rung) => rung,
            None => {
                let numbers = 1..=self.view.program().rungs.len() as u32;
                let next_rung =
                    numbers.into_iter().find(|rung| self.view.rung_line(*rung).is_some_and(|at| at >= line));
                next_rung.ok_or(DapError::NoRungAtLine { line })?
            }
        };
        let found = self.rungs.iter().find(|start| start.rung >= wanted);
        let start = found.ok_or(DapError::NoCodeFromRung { rung: wanted })?;
        Ok(LineStart { word: start.word, line: self.view.rung_line(start.rung).unwrap_or(line) })
    }

    /// Parses `rung 3`, `element 3.2` or `scan` to a program word; `None` if the text has another form.
    pub fn parse_name(&self, text: &str) -> Option<Result<u32, DapError>> {
        let text = text.trim();
        let number = |text: &str| text.trim().parse::<u32>().ok();
        if text == "scan" {
            return Some(Ok(self.view.scan_start()));
        }
        if let Some(rung) = text.strip_prefix("rung ").and_then(number) {
            let word = self.rungs.iter().find(|start| start.rung == rung).map(|start| start.word);
            return Some(word.ok_or(DapError::NoSuchRung { rung }));
        }
        let (rung, element) = text.strip_prefix("element ")?.split_once('.')?;
        let (rung, element) = (number(rung)?, number(element)?);
        let is_wanted = |start: &&ElementStart| start.rung == rung && start.element == element;
        let word = self.elements.iter().find(is_wanted).map(|start| start.word);
        Some(word.ok_or(DapError::NoSuchElement { rung, element }))
    }

    /// The heading lines above the instruction at a program word, for the disassembly.
    pub fn headings_at(&self, word: u32) -> Vec<String> {
        let mut heads = Vec::new();
        if word == self.view.scan_start() {
            heads.push("; a scan begins".to_owned());
        }
        let rungs = self.rungs.iter().filter(|start| start.word == word).map(|start| format!("; rung {}", start.rung));
        heads.extend(rungs);
        let elements = self.elements.iter().filter(|start| start.word == word);
        heads.extend(elements.filter_map(|start| {
            let ElementText { text, .. } = self.texts.get(&start_id(start))?;
            Some(format!("; {}.{} {text}", start.rung, start.element))
        }));
        heads
    }
}

impl LadderSource {
    /// The line of the element or rung that starts at a program word.
    pub fn line_beginning_at(&self, word: u32) -> Option<u32> {
        let element = self.elements.iter().find(|start| start.word == word);
        let line = element.and_then(|start| self.texts.get(&start_id(start))).map(|at| at.line);
        let rung =
            || self.rungs.iter().find(|start| start.word == word).and_then(|start| self.view.rung_line(start.rung));
        line.or_else(rung)
    }
}
