//! Source lines of a program: the line from which the code at an address was made, and the addresses of the
//! code of a line.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, OnceLock};

use diag::Diagnostic;
use diag::text::printable;

use super::{DebugInfo, dwarf};
use crate::CoreError;

/// The kind of file that a line belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SourceKind {
    /// A line of C.
    C,
    /// A line of an assembler source.
    Asm,
    /// A line of the listing that was read, numbered in that file.
    Listing,
}

/// The source line of the code from an address on.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SourceLine {
    /// Byte address in program memory.
    pub addr: u32,
    /// The kind of its file.
    pub kind: SourceKind,
    /// Name of the file with the path that the tools wrote. SDCC's have none; those of an ELF file are
    /// relative to the folder of the compilation, if possible.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// Size of its code in bytes. 0 if the file of symbols does not give it; the code then extends to the
    /// next line.
    pub len: u32,
}

/// The source lines of a program. Those of an ELF file are read on first use.
#[derive(Debug, Clone, Default)]
pub struct SourceLines {
    elf_source: Option<ElfSource>,
    line_table: OnceLock<LineTable>,
    info: OnceLock<Arc<DebugInfo>>,
}

/// A file that is not read yet.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ElfSource {
    name: String,
    bytes: Arc<Vec<u8>>,
}

/// The lines after reading.
#[derive(Debug, Clone, Default)]
pub(super) struct LineTable {
    /// Sorted by address, kind, file and number, without duplicates.
    lines: Vec<SourceLine>,
    /// The kinds that occur, in order of preference.
    kinds: Vec<SourceKind>,
    /// The folder of the compilation of each file; each file once.
    folders: Vec<SourceFolder>,
    /// Warnings about what could not be read.
    warnings: Vec<Diagnostic>,
    /// Byte addresses at which two rows begin, be it of one line: no code belongs to the first.
    pub(super) doubled: BTreeSet<u32>,
    /// Byte addresses of rows that do not start a statement.
    pub(super) parts: BTreeSet<u32>,
}

/// The folder in which the compiler ran for a source file.
#[derive(Debug, Clone)]
pub(super) struct SourceFolder {
    /// The file as the debugging information names it.
    pub(super) file: Arc<str>,
    /// The folder.
    pub(super) folder: String,
}

impl LineTable {
    /// Sorts the lines.
    pub(super) fn from_lines(
        mut lines: Vec<SourceLine>,
        folders: Vec<SourceFolder>,
        warnings: Vec<Diagnostic>,
    ) -> LineTable {
        lines.sort_unstable();
        lines.dedup();
        let mut kinds: Vec<SourceKind> = [SourceKind::C, SourceKind::Asm, SourceKind::Listing].into();
        kinds.retain(|kind| lines.iter().any(|line| line.kind == *kind));
        LineTable { lines, kinds, folders, warnings, doubled: BTreeSet::new(), parts: BTreeSet::new() }
    }
}

impl PartialEq for SourceLines {
    /// Compares the contents; whether they have been read already makes no difference.
    fn eq(&self, other: &Self) -> bool {
        self.elf_source == other.elf_source && (self.elf_source.is_some() || self.all_lines() == other.all_lines())
    }
}

impl Eq for SourceLines {}

impl SourceLines {
    /// The lines of files of symbols.
    #[must_use]
    pub fn new(lines: Vec<SourceLine>) -> SourceLines {
        SourceLines {
            elf_source: None,
            line_table: OnceLock::from(LineTable::from_lines(lines, Vec::new(), Vec::new())),
            info: OnceLock::new(),
        }
    }

    /// The same lines, with functions, variables and types of files of symbols.
    #[must_use]
    pub fn with_debug_info(self, info: DebugInfo) -> SourceLines {
        SourceLines { info: OnceLock::from(Arc::new(info)), ..self }
    }

    /// The lines in the debugging information (DWARF 2 to 5) of an ELF file, or none if it has none. Nothing
    /// is read yet and nothing fails: damaged parts are left out and reported by [`SourceLines::warnings`].
    /// `name` is the file name for messages.
    #[must_use]
    pub fn from_elf(name: &str, bytes: impl Into<Vec<u8>>) -> SourceLines {
        SourceLines {
            elf_source: Some(ElfSource { name: name.to_owned(), bytes: Arc::new(bytes.into()) }),
            line_table: OnceLock::new(),
            info: OnceLock::new(),
        }
    }

    /// Functions, variables and types in the ELF file, read on first use. Empty if the file has none or there
    /// is no ELF file.
    #[must_use]
    pub fn debug_info(&self) -> &Arc<DebugInfo> {
        self.info.get_or_init(|| {
            Arc::new(self.elf_source.as_ref().map(|elf| DebugInfo::from_elf(&elf.bytes)).unwrap_or_default())
        })
    }

    fn line_table(&self) -> &LineTable {
        self.line_table.get_or_init(|| {
            self.elf_source.as_ref().map(|elf| dwarf::read_line_table(&elf.name, &elf.bytes)).unwrap_or_default()
        })
    }

    /// All lines by address, kind, file and number, without duplicates.
    #[must_use]
    pub fn all_lines(&self) -> &[SourceLine] {
        &self.line_table().lines
    }

    /// Two rows begin at a byte address: a function that begins there has a prologue without code.
    #[must_use]
    pub fn is_doubled(&self, byte: u32) -> bool {
        self.line_table().doubled.contains(&byte)
    }

    /// Returns true if the line that starts at a byte address starts a statement there, according to the
    /// compiler. A step can end there.
    #[must_use]
    pub fn begins_statement(&self, byte: u32) -> bool {
        !self.line_table().parts.contains(&byte)
    }

    /// Damage found in the debugging information; empty until a line has been requested.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        self.line_table.get().map_or(&[], |found| &found.warnings)
    }

    /// The line of the code at a byte address. C is preferred to assembler, and assembler to a listing. A
    /// line of unknown length counts only if it starts at or after `from`, the start of the function.
    #[must_use]
    pub fn line_at(&self, byte: u32, from: u32) -> Option<&SourceLine> {
        let end = self.all_lines().partition_point(|line| line.addr <= byte);
        let behind = self.all_lines().get(..end)?;
        self.line_table().kinds.iter().find_map(|kind| {
            let last = behind.iter().rev().find(|line| line.kind == *kind)?;
            let covers = if last.len == 0 { last.addr >= from } else { byte - last.addr < last.len };
            covers.then_some(last)
        })
    }

    /// Byte addresses at which the code of a line starts, in ascending order; a line whose code is split has
    /// several. `file` is the name of a file or the end of its path. It can also be a whole path, as given by
    /// editors and debuggers; then it is enough that the path ends with the name of a file, because a program
    /// may have been compiled elsewhere.
    ///
    /// # Errors
    /// Why there is no address: no lines at all, no such file, several such files, or no code of that line.
    pub fn addresses_of_line(&self, file: &str, line: u32) -> Result<Vec<u32>, CoreError> {
        let mut files: Vec<&str> = self.all_lines().iter().map(|line| &*line.file).collect();
        files.sort_unstable();
        files.dedup();
        if files.is_empty() {
            return Err(CoreError::NoSourceLines);
        }
        let found = match files.iter().find(|known| **known == file) {
            Some(whole) => vec![*whole],
            None => self.matching_files(&files, file),
        };
        let name = match found.as_slice() {
            [name] => *name,
            [] => return Err(CoreError::UnknownSourceFile { file: file.to_owned(), known: owned(&files) }),
            several => {
                return Err(CoreError::AmbiguousSourceFile { file: file.to_owned(), candidates: owned(several) });
            }
        };
        let here: Vec<&SourceLine> = self.all_lines().iter().filter(|known| &*known.file == name).collect();
        let mut places: Vec<u32> = here.iter().filter(|known| known.line == line).map(|known| known.addr).collect();
        places.dedup();
        if !places.is_empty() {
            return Ok(places);
        }
        let next = here.iter().map(|known| known.line).filter(|known| *known > line).min();
        Err(CoreError::LineWithoutCode { file: name.to_owned(), line, next })
    }

    /// The source files that a path can mean if it is not the name of a file. These are the files at that
    /// path; if there are none, files whose path ends with it; and if there are none, for an absolute path,
    /// the files whose names are its longest endings.
    fn matching_files<'a>(&self, files: &[&'a str], path: &str) -> Vec<&'a str> {
        let path = &*normalize_path(path);
        let whole = |known: &str| match self.folder(known) {
            Some(folder) if !known.starts_with('/') => normalize_path(&format!("{folder}/{known}")),
            _ => normalize_path(known),
        };
        let those = |wanted: &dyn Fn(&str) -> bool| -> Vec<&'a str> {
            files.iter().copied().filter(|known| wanted(&whole(known)) || wanted(&normalize_path(known))).collect()
        };
        let mut found = those(&|known| known == path);
        if found.is_empty() {
            found = those(&|known| ends_with_path(known, path));
        }
        if found.is_empty() && path.starts_with('/') {
            let tail = |known: &str| normalize_path(known).trim_start_matches("../").to_owned();
            found = files.iter().copied().filter(|known| ends_with_path(path, &tail(known))).collect();
            let longest = found.iter().map(|known| tail(known).len()).max();
            found.retain(|known| Some(tail(known).len()) == longest);
        }
        found
    }

    /// The folder in which the compiler was called for a source file, if known.
    #[must_use]
    pub fn folder(&self, file: &str) -> Option<&str> {
        self.line_table().folders.iter().find(|known| &*known.file == file).map(|known| known.folder.as_str())
    }
}

/// A path without `.`, and without `..` after a folder.
fn normalize_path(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/').filter(|part| !matches!(*part, "" | ".")) {
        match parts.last() {
            Some(&last) if part == ".." && last != ".." => _ = parts.pop(),
            _ => parts.push(part),
        }
    }
    format!("{}{}", if path.starts_with('/') { "/" } else { "" }, parts.join("/"))
}

/// Returns true if a path ends with the folders and the name `end`.
fn ends_with_path(path: &str, end: &str) -> bool {
    !end.is_empty() && path.strip_suffix(end).is_some_and(|before| before.ends_with('/'))
}

/// The names as `String`s, for messages.
fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// Names of source files, each once, below the folder of their compilation or absolute.
#[derive(Debug, Default)]
pub(super) struct SourceFileNames {
    names: HashMap<String, Arc<str>>,
    /// The folders of the compilations.
    pub folders: Vec<SourceFolder>,
}

impl SourceFileNames {
    /// The name of a file that was compiled in a folder.
    pub fn intern(&mut self, path: &str, folder: &str) -> Arc<str> {
        let below = path.strip_prefix(folder).filter(|_| !folder.is_empty()).and_then(|path| path.strip_prefix('/'));
        let path = below.unwrap_or(path);
        let path = path.strip_prefix("./").unwrap_or(path);
        if let Some(known) = self.names.get(path) {
            return Arc::clone(known);
        }
        let file: Arc<str> = printable(path).into();
        self.names.insert(path.to_owned(), Arc::clone(&file));
        if !folder.is_empty() {
            self.folders.push(SourceFolder { file: Arc::clone(&file), folder: folder.to_owned() });
        }
        file
    }
}

/// Returns a path in a folder; an absolute path stays as it is.
pub(super) fn join_path(folder: &str, name: &str) -> String {
    if folder.is_empty() || name.starts_with('/') { name.to_owned() } else { format!("{folder}/{name}") }
}

/// By the extension: compilers leave assembler alone, and assemblers take no C.
pub(super) fn source_kind(file: &str) -> SourceKind {
    let asm = [".S", ".s", ".sx", ".asm", ".inc"].iter().any(|ending| file.ends_with(ending));
    if asm { SourceKind::Asm } else { SourceKind::C }
}
