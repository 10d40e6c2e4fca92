//! Lines out of stabs: records of type SLINE between those of functions and files.

use crate::image::elf::NamedSection;
use std::collections::BTreeSet;
use std::sync::Arc;

use super::{NamesAtZero, Stab, StabPosition, StabRecords, UnitChange, function_name, path_text, record};
use crate::image::source_lines::{SourceFileNames, SourceLine, source_kind};

/// A record of a line, or where the code before ends.
#[derive(Debug, Clone)]
struct StabRow {
    addr: u32,
    /// File and line; nothing at an end.
    line: Option<(Arc<str>, u32)>,
}

struct StabLineReader<'a> {
    names: &'a mut SourceFileNames,
    /// Byte addresses at which two lines begin.
    doubled: &'a mut BTreeSet<u32>,
    lines: Vec<SourceLine>,
    position: StabPosition,
    /// The main file of the unit, and the present one, which may be a header.
    main: Option<Arc<str>>,
    file: Option<Arc<str>>,
    rows: Vec<StabRow>,
    /// GCC counts the first line of a function from its first address.
    gcc: bool,
    /// Inside of a function; whether a line of it came already.
    function: Option<bool>,
    /// The function was dropped by the linker.
    dropped: bool,
}

/// The source lines of the stabs of a file.
#[derive(Debug, Clone)]
pub(in crate::image) struct StabLines {
    /// The lines in the order of the records.
    pub(in crate::image) lines: Vec<SourceLine>,
    /// The first thing that was wrong in the records.
    pub(in crate::image) fault: Option<&'static str>,
}

/// The lines of a file, and the first thing that was wrong; nothing where it has no stabs.
pub(in crate::image) fn read_stab_lines(
    sections: &[NamedSection<'_>],
    elf: &[u8],
    names: &mut SourceFileNames,
    doubled: &mut BTreeSet<u32>,
) -> StabLines {
    let Some(mut records) = StabRecords::new(sections) else { return StabLines { lines: Vec::new(), fault: None } };
    let mut reader = StabLineReader {
        names,
        doubled,
        lines: Vec::new(),
        position: StabPosition::default(),
        main: None,
        file: None,
        rows: Vec::new(),
        gcc: false,
        function: None,
        dropped: false,
    };
    let zero = NamesAtZero::new(elf);
    for stab in records.by_ref() {
        reader.follow(&stab, &zero);
    }
    reader.finish_unit();
    StabLines { lines: reader.lines, fault: records.fault }
}

impl StabLineReader<'_> {
    fn follow(&mut self, stab: &Stab<'_>, zero: &NamesAtZero<'_>) {
        match stab.kind {
            record::SO => {
                match self.position.change_unit(stab) {
                    UnitChange::Folder => {}
                    UnitChange::Begins(_) => {
                        self.finish_unit();
                        self.file = Some(self.names.intern(&self.position.unit, &self.position.folder));
                        self.main.clone_from(&self.file);
                    }
                    UnitChange::Ends(addr) => {
                        self.end_rows(addr);
                        self.finish_unit();
                        self.file = None;
                    }
                }
                (self.gcc, self.function, self.dropped) = (false, None, false);
            }
            record::SOL => {
                let name = path_text(&stab.text);
                self.file = Some(self.names.intern(&name, &self.position.folder));
            }
            record::OPT => self.gcc |= &*stab.text == b"gcc2_compiled.",
            record::FUN if stab.text.is_empty() => {
                if self.function.take() == Some(true) && !self.dropped {
                    self.end_rows(self.position.function.saturating_add(stab.value));
                }
                (self.position.function, self.dropped) = (0, false);
            }
            record::FUN => {
                if let Some(function) = function_name(&stab.text) {
                    self.position.function = stab.value;
                    (self.function, self.dropped) = (Some(false), zero.is_dropped(stab.value, function.name));
                }
            }
            record::SLINE => self.line(stab),
            _ => {}
        }
    }

    fn line(&mut self, stab: &Stab<'_>) {
        let is_first = self.function == Some(false);
        self.function = self.function.map(|_| true);
        let offset = if is_first && self.gcc { 0 } else { stab.value };
        let Some(addr) = self.position.function.checked_add(offset) else { return };
        let Some(file) = self.file.as_ref().filter(|_| !self.dropped && stab.desc > 0) else { return };
        self.rows.push(StabRow { addr, line: Some((Arc::clone(file), stab.desc.into())) });
    }

    /// The code before an address ends there; lines that begin there have none.
    fn end_rows(&mut self, addr: u32) {
        while self.rows.last().is_some_and(|row| row.addr == addr && row.line.is_some()) {
            self.rows.pop();
        }
        self.rows.push(StabRow { addr, line: None });
    }

    /// Makes lines of the rows. Of several at one address the last is that of the code: of those of the main
    /// file, if there are any, as gdb keeps the rows of each file apart and asks the main file first.
    fn finish_unit(&mut self) {
        let mut rows = std::mem::take(&mut self.rows);
        rows.sort_by_key(|row| (row.addr, row.line.is_some()));
        let mut groups = rows.chunk_by(|a, b| a.addr == b.addr).peekable();
        while let Some(group) = groups.next() {
            let is_main = |row: &&StabRow| row.line.as_ref().is_some_and(|(file, _)| self.main.as_ref() == Some(file));
            let Some(row) = group.iter().rev().find(is_main).or(group.last()) else { continue };
            let Some((file, line)) = &row.line else { continue };
            let of_file = |row: &&StabRow| row.line.as_ref().is_some_and(|(own, _)| own == file);
            if group.iter().filter(of_file).count() > 1 {
                self.doubled.insert(row.addr);
            }
            let len = groups.peek().and_then(|next| next.first()).map_or(0, |next| next.addr - row.addr);
            let file = Arc::clone(file);
            self.lines.push(SourceLine { addr: row.addr, kind: source_kind(&file), file, line: *line, len });
        }
    }
}
