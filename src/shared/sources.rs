//! Finds source files and returns the text of their lines.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use emu_core::image::{SourceLine, SourceLines};

/// Maximum size of a source file, in bytes; larger files are ignored.
const MAX_BYTES: u64 = 16 << 20;

/// Source files; each is searched for once.
pub struct SourceFiles {
    /// Folders of the image and of the symbol files, and the current folder.
    folders: Vec<PathBuf>,
    files: HashMap<String, Option<Vec<String>>>,
}

impl SourceFiles {
    /// Creates the list for a program whose image and symbols are in `files`.
    pub fn new<'f>(files: impl Iterator<Item = &'f str>) -> SourceFiles {
        let input_folders = files.filter(|name| *name != "-").filter_map(|name| Path::new(name).parent());
        let folders = input_folders.chain([Path::new("")]).map(Path::to_path_buf).collect();
        SourceFiles { folders, files: HashMap::new() }
    }

    /// Returns a value with the same folders and an empty cache.
    pub fn without_cache(&self) -> SourceFiles {
        SourceFiles { folders: self.folders.clone(), files: HashMap::new() }
    }

    /// Returns the text of one of the program's `lines` without surrounding white space, or `None` if the
    /// file is missing or shorter.
    pub fn text(&mut self, lines: &SourceLines, line: &SourceLine) -> Option<&str> {
        let text = self.file(lines, &line.file)?.get((line.line as usize).checked_sub(1)?)?.trim();
        Some(text).filter(|text| !text.is_empty())
    }

    /// Returns all lines of a source file of the program, or `None` if it is not found.
    pub fn file(&mut self, lines: &SourceLines, name: &str) -> Option<&[String]> {
        let SourceFiles { folders, files } = self;
        let file = files.entry(name.to_owned()).or_insert_with(|| {
            let recorded_folder = lines.folder(name).map(PathBuf::from);
            recorded_folder.iter().chain(folders.iter()).find_map(|folder| read(&folder.join(name)))
        });
        file.as_deref()
    }
}

/// Reads the lines of a file, with control characters replaced. Only regular files are read, because others
/// may never end.
fn read(path: &Path) -> Option<Vec<String>> {
    let found = fs::metadata(path).ok()?;
    let bytes = if found.is_file() && found.len() <= MAX_BYTES { fs::read(path).ok()? } else { return None };
    let printed = |c: char| if c.is_control() { ' ' } else { c };
    let text = diag::text::readable(&bytes);
    Some(text.lines().map(|line| line.chars().map(printed).collect::<String>().trim_end().to_owned()).collect())
}
