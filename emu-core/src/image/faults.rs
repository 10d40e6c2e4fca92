//! The list of faults that a loader fills. It is limited, so that 100 MB of garbage do not become gigabytes
//! of messages.

use diag::{Diagnostic, Pos, Severity};

use super::{Image, LoadedImage};

/// Maximum number of errors, and of warnings, that are kept for one file; further ones are only counted.
pub const MAX_REPORTED: usize = 100;

/// After this many errors, reading a file stops: it is another kind of file, or damaged everywhere.
const MAX_COUNTED: u64 = 1000;

/// The faults of one file.
pub(super) struct FaultList<'f> {
    file: &'f str,
    more_code: &'static str,
    errors: LimitedDiagnostics,
    warnings: LimitedDiagnostics,
    stopped_reading: bool,
}

#[derive(Default)]
struct LimitedDiagnostics {
    list: Vec<Diagnostic>,
    omitted: u64,
}

impl<'f> FaultList<'f> {
    /// An empty list. `more_code` is the code of the closing note.
    pub(super) fn new(file: &'f str, more_code: &'static str) -> Self {
        FaultList {
            file,
            more_code,
            errors: LimitedDiagnostics::default(),
            warnings: LimitedDiagnostics::default(),
            stopped_reading: false,
        }
    }

    /// Adds an error. The text is made only if the error is kept.
    pub(super) fn error(&mut self, code: &'static str, pos: Pos, cause: impl FnOnce() -> String, hint: &str) {
        self.errors.add(|| Diagnostic::new(Severity::Error, code, self.file, pos, cause(), hint));
    }

    /// Adds a warning. The text is made only if the warning is kept.
    pub(super) fn warning(&mut self, code: &'static str, pos: Pos, cause: impl FnOnce() -> String, hint: &str) {
        self.warnings.add(|| Diagnostic::new(Severity::Warning, code, self.file, pos, cause(), hint));
    }

    /// Adds a note. The text is made only if the note is kept.
    pub(super) fn note(&mut self, code: &'static str, pos: Pos, cause: impl FnOnce() -> String, hint: &str) {
        self.warnings.add(|| Diagnostic::new(Severity::Note, code, self.file, pos, cause(), hint));
    }

    /// Returns true if there are no errors so far.
    pub(super) fn is_empty(&self) -> bool {
        self.errors.list.is_empty()
    }

    /// Returns true if errors were counted that are not kept, so that further checks would only count more.
    pub(super) fn is_full(&self) -> bool {
        self.errors.omitted > 0
    }

    /// Returns true if there are so many errors that reading should stop. The closing note then says so.
    pub(super) fn give_up_if_hopeless(&mut self) -> bool {
        self.stopped_reading |= self.errors.list.len() as u64 + self.errors.omitted >= MAX_COUNTED;
        self.stopped_reading
    }

    /// Returns the image if there were no errors, else all faults in the order of their positions.
    pub(super) fn finish(self, image: Image) -> Result<LoadedImage, Vec<Diagnostic>> {
        let refused = !self.is_empty();
        let more = self.errors.omitted + self.warnings.omitted;
        let mut all = self.errors.list;
        all.extend(self.warnings.list);
        all.sort_by_key(|d| d.pos);
        if more > 0 {
            all.push(Diagnostic::new(
                Severity::Note,
                self.more_code,
                self.file,
                Pos::default(),
                format!(
                    "{more} more faults are not shown{}",
                    if self.stopped_reading { ", and the rest is not read" } else { "" }
                ),
                "fix the first ones and load the file again",
            ));
        }
        if refused { Err(all) } else { Ok(LoadedImage { image, warnings: all }) }
    }
}

impl LimitedDiagnostics {
    fn add(&mut self, make: impl FnOnce() -> Diagnostic) {
        if self.list.len() < MAX_REPORTED {
            self.list.push(make());
        } else {
            self.omitted += 1;
        }
    }
}
