//! The text of source lines, where their files are found.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use emu_core::image::{LineAt, Lines};

/// Larger files are taken for something else than a source.
const MAX_BYTES: u64 = 16 << 20;

/// Source files, each looked for once.
pub struct Sources<'a> {
    lines: &'a Lines,
    /// Folders of the image and of the files of symbols, and the current one.
    folders: Vec<PathBuf>,
    files: HashMap<String, Option<Vec<String>>>,
}

impl<'a> Sources<'a> {
    /// For the lines of a program whose image and symbols are in `files`.
    pub fn new<'f>(lines: &'a Lines, files: impl Iterator<Item = &'f str>) -> Sources<'a> {
        let beside = files.filter(|name| *name != "-").filter_map(|name| Path::new(name).parent());
        let folders = beside.chain([Path::new("")]).map(Path::to_path_buf).collect();
        Sources { lines, folders, files: HashMap::new() }
    }

    /// The text of a line, without white space around it; nothing where its file is not found or shorter.
    pub fn text(&mut self, line: &LineAt) -> Option<&str> {
        let Sources { lines, folders, files } = self;
        let file = files.entry(line.file.to_string()).or_insert_with(|| {
            let home = lines.folder(&line.file).map(PathBuf::from);
            home.iter().chain(folders.iter()).find_map(|folder| read(&folder.join(&*line.file)))
        });
        let text = file.as_ref()?.get((line.line as usize).checked_sub(1)?)?;
        Some(text.as_str()).filter(|text| !text.is_empty())
    }
}

/// The lines of a file, fit to be printed. What is no plain file may never end, and is not read.
fn read(path: &Path) -> Option<Vec<String>> {
    let found = fs::metadata(path).ok()?;
    let bytes = if found.is_file() && found.len() <= MAX_BYTES { fs::read(path).ok()? } else { return None };
    let printed = |c: char| if c.is_control() { ' ' } else { c };
    let text = String::from_utf8_lossy(&bytes);
    Some(text.lines().map(|line| line.chars().map(printed).collect::<String>().trim().to_owned()).collect())
}
