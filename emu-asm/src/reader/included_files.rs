//! Included files: texts that are read at that point, and files whose bytes are inserted.

use std::ops::Range;
use std::rc::Rc;

use super::{FrameEnd, MAX_INCLUDES};
use crate::engine::{Assembler, DirectiveCall, OpenedInclude};
use crate::fault::LineFault;

impl Assembler<'_> {
    /// Reports whether the text that is being read can open a file of this name.
    pub fn can_open(&mut self, name: &str) -> bool {
        let from = self.line.as_ref().map_or(0, |line| line.file);
        self.files.open(name, self.texts.name(from)).is_ok()
    }

    /// Returns the bytes of a binary file; reports an error if it cannot be read.
    pub fn binary(&mut self, name: &str, at: Range<usize>) -> Option<Rc<[u8]>> {
        let from = self.line.as_ref().map_or(0, |line| line.file);
        let key = (name.to_owned(), from);
        if let Some(found) = self.binaries.get(&key) {
            return Some(found.clone());
        }
        match self.files.open(name, self.texts.name(from)) {
            Ok((path, bytes)) => {
                // Recorded by name, so that no output overwrites it.
                self.texts.add(&path, &[], false);
                let bytes: Rc<[u8]> = bytes.into();
                self.binaries.insert(key, bytes.clone());
                Some(bytes)
            }
            Err(error) => {
                let cause = format!("`{name}` cannot be read: {error}");
                self.report(LineFault::new(
                    "ASM015",
                    at,
                    cause,
                    "check the path: it counts from the file that includes it",
                ));
                None
            }
        }
    }

    /// Reads a file at this point.
    pub fn include(&mut self, name: &str, call: &DirectiveCall<'_>) {
        let from = self.line.as_ref().map_or(0, |line| line.file);
        let depth = self.frames.iter().filter(|frame| matches!(frame.at_end, FrameEnd::File)).count();
        if depth >= MAX_INCLUDES {
            let cause = format!("`{name}` is reached through {MAX_INCLUDES} includes within each other");
            let hint = "a file that includes itself needs a condition around it";
            self.report(LineFault::new("ASM016", call.rest.clone(), cause, hint));
            return self.unwind(1);
        }
        let key = (name.to_owned(), from);
        let found = match self.opened_includes.get(&key) {
            Some(found) => found.clone(),
            None => {
                let opened = self.files.open(name, self.texts.name(from));
                let found = match opened {
                    Ok((path, bytes)) => {
                        OpenedInclude::Text(self.texts.add(&path, &bytes, self.dialect.block_comments))
                    }
                    Err(error) => OpenedInclude::Unreadable { cause: format!("`{name}` cannot be read: {error}") },
                };
                self.opened_includes.insert(key, found.clone());
                found
            }
        };
        match found {
            OpenedInclude::Text(file) => {
                if !self.check_encoding(file, call.rest.clone()) {
                    return;
                }
                let lines = self.lines_of(file);
                self.push_frame(lines, FrameEnd::File, None);
            }
            OpenedInclude::Unreadable { cause } => {
                self.report(LineFault::new(
                    "ASM015",
                    call.rest.clone(),
                    cause,
                    "check the path: it counts from the file that includes it",
                ));
            }
        }
    }
}
