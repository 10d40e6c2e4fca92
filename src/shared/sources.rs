//! The text of source lines, where their files are found.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use emu_core::image::{SourceLine, SourceLines};

/// Larger files are taken for something else than a source.
const MAX_BYTES: u64 = 16 << 20;

/// Source files, each looked for once.
pub struct SourceFiles {
    /// Folders of the image and of the files of symbols, and the current one.
    folders: Vec<PathBuf>,
    files: HashMap<String, Option<Vec<String>>>,
}

impl SourceFiles {
    /// For a program whose image and symbols are in `files`.
    pub fn new<'f>(files: impl Iterator<Item = &'f str>) -> SourceFiles {
        let beside = files.filter(|name| *name != "-").filter_map(|name| Path::new(name).parent());
        let folders = beside.chain([Path::new("")]).map(Path::to_path_buf).collect();
        SourceFiles { folders, files: HashMap::new() }
    }

    /// The same folders, of which nothing was looked for yet.
    pub fn without_cache(&self) -> SourceFiles {
        SourceFiles { folders: self.folders.clone(), files: HashMap::new() }
    }

    /// The text of one of the `lines` of the program, without white space around it; nothing where its file is not found or shorter.
    pub fn text(&mut self, lines: &SourceLines, line: &SourceLine) -> Option<&str> {
        let text = self.file(lines, &line.file)?.get((line.line as usize).checked_sub(1)?)?.trim();
        Some(text).filter(|text| !text.is_empty())
    }

    /// All lines of a source file of the program; nothing where it is not found.
    pub fn file(&mut self, lines: &SourceLines, name: &str) -> Option<&[String]> {
        let SourceFiles { folders, files } = self;
        let file = files.entry(name.to_owned()).or_insert_with(|| {
            let home = lines.folder(name).map(PathBuf::from);
            home.iter().chain(folders.iter()).find_map(|folder| read(&folder.join(name)))
        });
        file.as_deref()
    }
}

/// The lines of a file, fit to be printed. What is no plain file may never end, and is not read.
fn read(path: &Path) -> Option<Vec<String>> {
    let found = fs::metadata(path).ok()?;
    let bytes = if found.is_file() && found.len() <= MAX_BYTES { fs::read(path).ok()? } else { return None };
    let printed = |c: char| if c.is_control() { ' ' } else { c };
    let text = diag::text::readable(&bytes);
    Some(text.lines().map(|line| line.chars().map(printed).collect::<String>().trim_end().to_owned()).collect())
}
