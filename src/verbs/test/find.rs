//! Finds tests: `emu.toml`, and scenarios with the program or image beside them.

use std::fs;
use std::path::{Path, PathBuf};

use diag::{Diagnostic, Pos, Severity};
use scenario::Scenario;

use crate::shared::codes::{NO_PROGRAM, UNREADABLE, file_error, system_message};
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::verbs::test::cases::TestCase;
use crate::verbs::test::manifest::{FILE_NAME, read_manifest};

/// Extensions of images and of sources that `emu run` assembles, in the order in which they are tried.
const IMAGES: [&str; 9] = ["hex", "ihx", "elf", "omf", "asm", "s", "S", "a51", "src"];

/// Folders that hold results of builds or files of tools.
const SKIPPED_FOLDERS: [&str; 2] = ["target", "node_modules"];

/// Deepest folder that is searched.
const MAX_DEPTH: u32 = 32;

/// Finds the tests of `places`; without any, those of the nearest `emu.toml` above the current folder, or of
/// the scenarios below it.
///
/// # Errors
/// A place cannot be read, or a file is faulty.
pub fn find_cases(places: &[String], style: &MessageStyle) -> Result<Vec<TestCase>, VerbFailure> {
    let mut finder = TestFinder { cases: Vec::new(), notes: Vec::new() };
    match places {
        [] => match manifest_above() {
            Some(folder) => finder.manifest(&folder)?,
            None => finder.folder(Path::new("."), MAX_DEPTH)?,
        },
        _ => places.iter().try_for_each(|place| finder.place(Path::new(place)))?,
    }
    report_diagnostics(style, &finder.notes, FileTexts::NONE);
    let mut names = std::collections::BTreeSet::new();
    finder.cases.retain(|case| names.insert((case.name.clone(), case.folder.clone())));
    Ok(finder.cases)
}

/// Returns the nearest folder with an `emu.toml`, from the current one upwards: relative if it is the current
/// one.
fn manifest_above() -> Option<PathBuf> {
    let here = std::env::current_dir().ok()?;
    let found = here.ancestors().find(|folder| folder.join(FILE_NAME).is_file())?;
    Some(if found == here { PathBuf::new() } else { found.to_owned() })
}

struct TestFinder {
    cases: Vec<TestCase>,
    /// Notes about scenarios without a program.
    notes: Vec<Diagnostic>,
}

impl TestFinder {
    /// Finds the tests of a folder or file that the user named.
    fn place(&mut self, place: &Path) -> Result<(), VerbFailure> {
        if place.is_dir() {
            return if place.join(FILE_NAME).is_file() { self.manifest(place) } else { self.folder(place, MAX_DEPTH) };
        }
        if place.file_name().is_some_and(|name| name == FILE_NAME) {
            return self.manifest(place.parent().unwrap_or(Path::new("")));
        }
        let file = text_of(place);
        let bytes = input::read_bytes(&file)?;
        match scenario::parse_bytes(&file, &bytes) {
            Ok(found) => self.scenario(place, &found),
            Err(faults) => return Err(VerbFailure::Refused(faults, FileTexts::one(&file, bytes))),
        }
        match self.notes.pop() {
            Some(missing) => {
                let refusal = Diagnostic { severity: Severity::Error, ..missing };
                Err(VerbFailure::Refused(vec![refusal], FileTexts::one(&file, bytes)))
            }
            None => Ok(()),
        }
    }

    /// Adds the tests of the `emu.toml` in a folder; without [[test]], those of the scenarios below it.
    fn manifest(&mut self, folder: &Path) -> Result<(), VerbFailure> {
        let file = text_of(&folder.join(FILE_NAME));
        let bytes = input::read_bytes(&file)?;
        let is_current = matches!(text_of(folder).as_str(), "" | ".");
        let text = String::from_utf8_lossy(&bytes);
        match read_manifest(&file, (!is_current).then_some(folder), &text) {
            Ok(cases) if cases.is_empty() => self.folder(if is_current { Path::new(".") } else { folder }, MAX_DEPTH),
            Ok(cases) => {
                self.cases.extend(cases);
                Ok(())
            }
            Err(faults) => Err(VerbFailure::Refused(faults, FileTexts::one(&file, bytes))),
        }
    }

    /// Adds the scenarios of a folder and of the folders in it, in the order of their names.
    fn folder(&mut self, folder: &Path, depth: u32) -> Result<(), VerbFailure> {
        let unreadable = |error: std::io::Error| {
            let cause = format!("cannot be read: {}", system_message(&error));
            let fault = file_error(UNREADABLE, &text_of(folder), cause, "check the path");
            VerbFailure::Refused(vec![fault], FileTexts::default())
        };
        let entries = fs::read_dir(folder).map_err(unreadable)?;
        let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        paths.sort();
        for path in paths {
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            if name.starts_with('.') || name == FILE_NAME {
                continue;
            }
            if path.is_dir() && !path.is_symlink() {
                if depth > 0 && !SKIPPED_FOLDERS.contains(&name.as_str()) {
                    self.folder(&path, depth - 1)?;
                }
            } else if has_extension(&path, "toml") {
                let file = text_of(&path);
                let Ok(bytes) = fs::read(&path) else { continue };
                // Other files of TOML, such as Cargo.toml, have no [[step]].
                if !String::from_utf8_lossy(&bytes).lines().any(|line| line.trim_start().starts_with("[[step]]")) {
                    continue;
                }
                match scenario::parse_bytes(&file, &bytes) {
                    Ok(found) => self.scenario(&path, &found),
                    Err(faults) => return Err(VerbFailure::Refused(faults, FileTexts::one(&file, bytes))),
                }
            }
        }
        Ok(())
    }

    /// Adds the test of a scenario, or a note that its program is missing.
    fn scenario(&mut self, path: &Path, found: &Scenario) {
        let file = text_of(path);
        let named = found.program.as_ref().map(|program| path.with_file_name(&program.text));
        let beside = || {
            let extensions = ladder::Notation::EXTENSIONS.iter().map(|(_, extension)| *extension).chain(IMAGES);
            extensions.map(|extension| path.with_extension(extension)).find(|path| path.is_file())
        };
        let Some(program) =
            named.clone().filter(|path| path.is_file()).or_else(|| named.is_none().then(beside).flatten())
        else {
            let cause = match &named {
                Some(program) => format!("the program {} is not there", text_of(program)),
                None => "no program or image is beside this scenario".to_owned(),
            };
            let hint = "name it in the first lines: program = \"welder.ld\", in the folder of the scenario";
            let pos = found.program.as_ref().map_or(Pos::new(1, 1, 1), |program| program.pos);
            self.notes.push(Diagnostic::new(Severity::Note, NO_PROGRAM, &file, pos, cause, hint));
            return;
        };
        let program = text_of(&program);
        let chip = found.mcu.as_ref().map(|mcu| format!("--mcu={}", mcu.text));
        let verb = match (ladder::is_program_name(&program), &chip) {
            (true, Some(_)) => "check",
            (true, None) => "sim",
            (false, _) => "run",
        };
        let arguments: Vec<String> =
            [verb.to_owned(), program].into_iter().chain(chip).chain([format!("--scenario={file}")]).collect();
        self.cases.push(TestCase { name: file.clone(), file, line: 1, folder: None, arguments, exit_code: 0 });
    }
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// Returns a path as text, without `./` at its beginning.
fn text_of(path: &Path) -> String {
    path.strip_prefix(".").unwrap_or(path).to_string_lossy().into_owned()
}
