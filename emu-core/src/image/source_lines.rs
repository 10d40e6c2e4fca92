//! Source lines of a program: which line the code at an address was made of, and where the code of a line begins.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, OnceLock};

use diag::Diagnostic;
use diag::text::printable;

use super::{DebugInfo, dwarf};

/// What a line belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SourceKind {
    /// A line of C.
    C,
    /// A line of an assembler source.
    Asm,
    /// A line of the listing that was read, counted in that file.
    Listing,
}

/// The line that the code from an address on was made of.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct SourceLine {
    /// Byte address in program memory.
    pub addr: u32,
    /// What the line belongs to.
    pub kind: SourceKind,
    /// Name of the file, with the path that the tools wrote: none for SDCC's; below the folder of the compilation for those
    /// of an ELF file.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
    /// Bytes of its code; 0 where the file of symbols does not tell, then it goes on to the next line.
    pub len: u32,
}

/// The source lines of a program. Those of an ELF file are read when they are first asked for.
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

/// What was read.
#[derive(Debug, Clone, Default)]
pub(super) struct LineTable {
    /// By address, kind, file and number; none twice.
    lines: Vec<SourceLine>,
    /// The kinds that occur, the one that is preferred first.
    kinds: Vec<SourceKind>,
    /// The folder of the compilation by file, each file once.
    folders: Vec<(Arc<str>, String)>,
    /// What could not be read.
    warnings: Vec<Diagnostic>,
    /// Byte addresses at which two rows begin, be it of one line: no code belongs to the first.
    pub(super) doubled: BTreeSet<u32>,
    /// Byte addresses of rows that begin no statement.
    pub(super) parts: BTreeSet<u32>,
}

impl LineTable {
    /// Puts the lines in order.
    pub(super) fn from_lines(
        mut lines: Vec<SourceLine>,
        folders: Vec<(Arc<str>, String)>,
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
    /// Whether they were read already makes no difference.
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

    /// Those of the debugging information (DWARF 2 to 5) of an ELF file, or none where it has none. Nothing is read yet, and
    /// nothing ever fails: what is damaged is left out and told by [`Lines::warnings`]. `name` is the file's for messages.
    #[must_use]
    pub fn from_elf(name: &str, bytes: impl Into<Vec<u8>>) -> SourceLines {
        SourceLines {
            elf_source: Some(ElfSource { name: name.to_owned(), bytes: Arc::new(bytes.into()) }),
            line_table: OnceLock::new(),
            info: OnceLock::new(),
        }
    }

    /// Functions, variables and types that the ELF file tells of; none where it does not, or where there is no ELF file. They are read
    /// when they are first asked for.
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

    /// All lines by address, kind, file and number; none twice.
    #[must_use]
    pub fn all_lines(&self) -> &[SourceLine] {
        &self.line_table().lines
    }

    /// Two rows begin at a byte address: a function that begins there has a prologue without code.
    #[must_use]
    pub fn is_doubled(&self, byte: u32) -> bool {
        self.line_table().doubled.contains(&byte)
    }

    /// The line that begins at a byte address begins a statement there, as far as the compiler says so: a step may end there.
    #[must_use]
    pub fn begins_statement(&self, byte: u32) -> bool {
        !self.line_table().parts.contains(&byte)
    }

    /// What was found damaged in the debugging information; empty while nobody has asked for a line.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        self.line_table.get().map_or(&[], |found| &found.warnings)
    }

    /// The line that the code at a byte address belongs to; C goes before assembler, and that before a listing. A line of
    /// which it is not known how far it goes counts only where it begins at `from`, where the function begins, or behind it.
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

    /// Byte addresses at which the code of a line begins, ascending; a line that the compiler has taken apart has several.
    /// `file` is the name of a file, the end of its path, or a whole path as editors and debuggers give it, where what it ends
    /// with is enough: a program may have been compiled elsewhere.
    ///
    /// # Errors
    /// Why there is none, in a sentence: no lines at all, no such file, several, or no code of that line.
    pub fn addresses_of_line(&self, file: &str, line: u32) -> Result<Vec<u32>, String> {
        let mut files: Vec<&str> = self.all_lines().iter().map(|line| &*line.file).collect();
        files.sort_unstable();
        files.dedup();
        if files.is_empty() {
            return Err("the program has no source lines".to_owned());
        }
        let found = match files.iter().find(|known| **known == file) {
            Some(whole) => vec![*whole],
            None => self.matching_files(&files, file),
        };
        let name = match found.as_slice() {
            [name] => *name,
            [] => return Err(format!("the program has no source file `{file}`; it has {}", name_list(&files))),
            several => return Err(format!("`{file}` is one of several source files: {}", name_list(several))),
        };
        let here: Vec<&SourceLine> = self.all_lines().iter().filter(|known| &*known.file == name).collect();
        let mut places: Vec<u32> = here.iter().filter(|known| known.line == line).map(|known| known.addr).collect();
        places.dedup();
        if !places.is_empty() {
            return Ok(places);
        }
        let next = here.iter().map(|known| known.line).filter(|known| *known > line).min();
        let hint = next.map_or(String::new(), |next| format!("; the next line that has is {name}:{next}"));
        Err(format!("line {line} of {name} has no code{hint}"))
    }

    /// The source files that a path may stand for, which is none of their names: those that lie there, else those whose path ends
    /// with it, else, for an absolute path, those with which it ends most.
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

    /// The folder in which the compiler was called for a source file, where that is known.
    #[must_use]
    pub fn folder(&self, file: &str) -> Option<&str> {
        self.line_table().folders.iter().find(|(known, _)| &**known == file).map(|(_, folder)| folder.as_str())
    }
}

/// A path without `.`, and without `..` behind a folder.
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

/// The last folders and the name of a path are `end`.
fn ends_with_path(path: &str, end: &str) -> bool {
    !end.is_empty() && path.strip_suffix(end).is_some_and(|before| before.ends_with('/'))
}

/// Some names, for messages.
fn name_list(names: &[&str]) -> String {
    const MAX_LISTED: usize = 8;
    let more = if names.len() > MAX_LISTED { ", .." } else { "" };
    format!("{}{more}", names.iter().take(MAX_LISTED).copied().collect::<Vec<_>>().join(", "))
}

/// Names of source files, each once, below the folder of their compilation or absolute.
#[derive(Debug, Default)]
pub(super) struct SourceFileNames {
    names: HashMap<String, Arc<str>>,
    /// The folders of the compilations.
    pub folders: Vec<(Arc<str>, String)>,
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
            self.folders.push((Arc::clone(&file), folder.to_owned()));
        }
        file
    }
}

pub(super) fn join_path(folder: &str, name: &str) -> String {
    if folder.is_empty() || name.starts_with('/') { name.to_owned() } else { format!("{folder}/{name}") }
}

/// By the extension: compilers leave assembler alone, and assemblers take no C.
pub(super) fn source_kind(file: &str) -> SourceKind {
    let asm = [".S", ".s", ".sx", ".asm", ".inc"].iter().any(|ending| file.ends_with(ending));
    if asm { SourceKind::Asm } else { SourceKind::C }
}
