//! Source lines of a program: which line the code at an address was made of, and where the code of a line begins.

use std::sync::{Arc, OnceLock};

use diag::Diagnostic;

use super::{DebugInfo, dwarf};

/// What a line belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineKind {
    /// A line of C.
    C,
    /// A line of an assembler source.
    Asm,
    /// A line of the listing that was read, counted in that file.
    Listing,
}

/// The line that the code from an address on was made of.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct LineAt {
    /// Byte address in program memory.
    pub addr: u32,
    /// What the line belongs to.
    pub kind: LineKind,
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
pub struct Lines {
    elf: Option<Elf>,
    found: OnceLock<Found>,
    info: OnceLock<Arc<DebugInfo>>,
}

/// A file that is not read yet.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Elf {
    name: String,
    bytes: Arc<Vec<u8>>,
}

/// What was read.
#[derive(Debug, Clone, Default)]
pub(super) struct Found {
    /// By address, kind, file and number; none twice.
    lines: Vec<LineAt>,
    /// The kinds that occur, the one that is preferred first.
    kinds: Vec<LineKind>,
    /// The folder of the compilation by file, each file once.
    folders: Vec<(Arc<str>, String)>,
    /// What could not be read.
    warnings: Vec<Diagnostic>,
}

impl Found {
    /// Puts the lines in order.
    pub(super) fn of(mut lines: Vec<LineAt>, folders: Vec<(Arc<str>, String)>, warnings: Vec<Diagnostic>) -> Found {
        lines.sort_unstable();
        lines.dedup();
        let mut kinds: Vec<LineKind> = [LineKind::C, LineKind::Asm, LineKind::Listing].into();
        kinds.retain(|kind| lines.iter().any(|line| line.kind == *kind));
        Found { lines, kinds, folders, warnings }
    }
}

impl PartialEq for Lines {
    /// Whether they were read already makes no difference.
    fn eq(&self, other: &Self) -> bool {
        self.elf == other.elf && (self.elf.is_some() || self.all() == other.all())
    }
}

impl Eq for Lines {}

impl Lines {
    /// The lines of files of symbols.
    #[must_use]
    pub fn new(lines: Vec<LineAt>) -> Lines {
        Lines { elf: None, found: OnceLock::from(Found::of(lines, Vec::new(), Vec::new())), info: OnceLock::new() }
    }

    /// Those of the debugging information (DWARF 2 to 5) of an ELF file, or none where it has none. Nothing is read yet, and
    /// nothing ever fails: what is damaged is left out and told by [`Lines::warnings`]. `name` is the file's for messages.
    #[must_use]
    pub fn of_elf(name: &str, bytes: impl Into<Vec<u8>>) -> Lines {
        Lines {
            elf: Some(Elf { name: name.to_owned(), bytes: Arc::new(bytes.into()) }),
            found: OnceLock::new(),
            info: OnceLock::new(),
        }
    }

    /// Functions, variables and types that the ELF file tells of; none where it does not, or where there is no ELF file. They are read
    /// when they are first asked for.
    #[must_use]
    pub fn debug_info(&self) -> &Arc<DebugInfo> {
        self.info
            .get_or_init(|| Arc::new(self.elf.as_ref().map(|elf| DebugInfo::of_elf(&elf.bytes)).unwrap_or_default()))
    }

    fn found(&self) -> &Found {
        self.found.get_or_init(|| self.elf.as_ref().map(|elf| dwarf::read(&elf.name, &elf.bytes)).unwrap_or_default())
    }

    /// All lines by address, kind, file and number; none twice.
    #[must_use]
    pub fn all(&self) -> &[LineAt] {
        &self.found().lines
    }

    /// What was found damaged in the debugging information; empty while nobody has asked for a line.
    #[must_use]
    pub fn warnings(&self) -> &[Diagnostic] {
        self.found.get().map_or(&[], |found| &found.warnings)
    }

    /// The line that the code at a byte address belongs to; C goes before assembler, and that before a listing. A line of
    /// which it is not known how far it goes counts only where it begins at `from`, where the function begins, or behind it.
    #[must_use]
    pub fn at(&self, byte: u32, from: u32) -> Option<&LineAt> {
        let end = self.all().partition_point(|line| line.addr <= byte);
        let behind = self.all().get(..end)?;
        self.found().kinds.iter().find_map(|kind| {
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
    pub fn of(&self, file: &str, line: u32) -> Result<Vec<u32>, String> {
        let mut files: Vec<&str> = self.all().iter().map(|line| &*line.file).collect();
        files.sort_unstable();
        files.dedup();
        if files.is_empty() {
            return Err("the program has no source lines".to_owned());
        }
        let found = match files.iter().find(|known| **known == file) {
            Some(whole) => vec![*whole],
            None => self.files_of(&files, file),
        };
        let name = match found.as_slice() {
            [name] => *name,
            [] => return Err(format!("the program has no source file `{file}`; it has {}", listed(&files))),
            several => return Err(format!("`{file}` is one of several source files: {}", listed(several))),
        };
        let here: Vec<&LineAt> = self.all().iter().filter(|known| &*known.file == name).collect();
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
    fn files_of<'a>(&self, files: &[&'a str], path: &str) -> Vec<&'a str> {
        let path = &*clean(path);
        let whole = |known: &str| match self.folder(known) {
            Some(folder) if !known.starts_with('/') => clean(&format!("{folder}/{known}")),
            _ => clean(known),
        };
        let those = |wanted: &dyn Fn(&str) -> bool| -> Vec<&'a str> {
            files.iter().copied().filter(|known| wanted(&whole(known)) || wanted(&clean(known))).collect()
        };
        let mut found = those(&|known| known == path);
        if found.is_empty() {
            found = those(&|known| ends_with_path(known, path));
        }
        if found.is_empty() && path.starts_with('/') {
            let tail = |known: &str| clean(known).trim_start_matches("../").to_owned();
            found = files.iter().copied().filter(|known| ends_with_path(path, &tail(known))).collect();
            let longest = found.iter().map(|known| tail(known).len()).max();
            found.retain(|known| Some(tail(known).len()) == longest);
        }
        found
    }

    /// The folder in which the compiler was called for a source file, where that is known.
    #[must_use]
    pub fn folder(&self, file: &str) -> Option<&str> {
        self.found().folders.iter().find(|(known, _)| &**known == file).map(|(_, folder)| folder.as_str())
    }
}

/// A path without `.`, and without `..` behind a folder.
fn clean(path: &str) -> String {
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
fn listed(names: &[&str]) -> String {
    const MOST: usize = 8;
    let more = if names.len() > MOST { ", .." } else { "" };
    format!("{}{more}", names.iter().take(MOST).copied().collect::<Vec<_>>().join(", "))
}
