//! Assembles sources: for `emu asm`, and for verbs that take a source in place of an image.

use std::io;
use std::path::{Path, PathBuf};

use emu_asm::{AssembleOptions, AssembledProgram, IncludeFiles, SourceText};
use emu_core::chip::Chip;
use emu_core::image::Image;

use crate::shared::fail::VerbFailure;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{family, input};

/// File name extensions of assembly sources.
const SOURCES: &[&str] = &["asm", "s", "a51", "src"];

/// Returns true if the extension of a file name is that of an assembly source.
pub fn is_source(file: &str) -> bool {
    let ending = Path::new(file).extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    ending.is_some_and(|ending| SOURCES.contains(&ending.as_str()))
}

/// Assembles a source to an image with symbols and source lines. Prints warnings.
pub fn assemble_image(
    file: &str,
    bytes: &[u8],
    chip: &'static Chip,
    style: &MessageStyle,
) -> Result<Image, VerbFailure> {
    let mut assembled = assemble(file, bytes, chip, AssembleOptions::default(), &[])?;
    let image = std::mem::take(&mut assembled.image);
    report_warnings(style, assembled);
    Ok(image)
}

/// Prints the warnings of an assembled source.
pub fn report_warnings(style: &MessageStyle, assembled: AssembledProgram) {
    report_diagnostics(style, &assembled.warnings, &texts(&assembled.texts));
}

/// Assembles a source; include files are found in its folder and in `folders`.
pub fn assemble(
    file: &str,
    bytes: &[u8],
    chip: &'static Chip,
    options: AssembleOptions,
    folders: &[PathBuf],
) -> Result<AssembledProgram, VerbFailure> {
    let chip_named = Some((|name| family::parse_chip(name).ok()) as fn(&str) -> Option<&'static Chip>);
    let options = AssembleOptions { find_chip: chip_named, ..options };
    emu_asm::assemble(&SourceText { name: file, bytes }, chip, &options, &mut IncludeFolders { folders })
        .map_err(|refused| VerbFailure::Refused(refused.diagnostics, texts(&refused.texts)))
}

/// Returns the texts of the source and its include files, for drawing diagnostics.
fn texts(read: &emu_asm::SourceTexts) -> FileTexts {
    FileTexts(read.all().map(|(name, bytes)| (name.to_owned(), bytes.to_vec())).collect())
}

/// Finds include files in the folder of the including file and in the folders of `-I`.
struct IncludeFolders<'a> {
    folders: &'a [PathBuf],
}

impl IncludeFiles for IncludeFolders<'_> {
    fn open(&mut self, name: &str, from: &str) -> io::Result<(String, Vec<u8>)> {
        let includer_folder = Path::new(from).parent().unwrap_or(Path::new(""));
        let folders = || std::iter::once(includer_folder).chain(self.folders.iter().map(PathBuf::as_path));
        let mut first = None;
        let exact = folders().map(|folder| folder.join(name));
        // Sources from Windows may spell file names with any letter case.
        for place in exact.chain(folders().filter_map(|folder| find_ignoring_case(folder, name))) {
            match input::read_file(&place.to_string_lossy()) {
                Ok(bytes) => return Ok((place.to_string_lossy().into_owned(), bytes)),
                // "Not found" is reported for the first folder. Any other read error overrides it.
                Err(error) if error.kind() == io::ErrorKind::NotFound => _ = first.get_or_insert(error),
                Err(error) => return Err(error),
            }
        }
        Err(first.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
    }
}

/// Finds the file `name` in a folder, ignoring letter case in each part of the path. If several files match,
/// the first in byte order counts.
fn find_ignoring_case(folder: &Path, name: &str) -> Option<PathBuf> {
    name.split('/').try_fold(folder.to_owned(), |at, part| {
        if matches!(part, "" | "." | "..") || at.join(part).exists() {
            return Some(at.join(part));
        }
        let here = if at.as_os_str().is_empty() { Path::new(".") } else { &at };
        let names = std::fs::read_dir(here).ok()?.filter_map(|entry| Some(entry.ok()?.file_name()));
        let found = names.filter(|found| found.to_string_lossy().eq_ignore_ascii_case(part)).min()?;
        Some(at.join(found))
    })
}
