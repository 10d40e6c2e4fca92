//! Snapshots of machines, for all who write and read them.

use std::fs;
use std::io::Read;
use std::path::{Component, Path};

use emu_avr::{Options, Readings};
use emu_core::chip::{Chip, Family};
use emu_core::image::Image;
use emu_debug::snapshot::{self, Head};

use crate::fail::Failure;
use crate::family::Setup;
use crate::output;

/// What snapshots of a machine are of, their cycle aside.
pub fn head(chip: &Chip, image: &Image, setup: &Setup) -> Head {
    let options = match chip.family {
        Family::Avr => {
            // Readings that are not given are not said. A package changes nothing of the state.
            let Options { hz, fuses, lock, start_up, readings, package: _ } = setup.avr;
            let plain = format!("Options {{ hz: {hz}, fuses: {fuses:?}, lock: {lock:?}, start_up: {start_up} }}");
            if readings == Readings::default() { plain } else { format!("{plain}, {readings:?}") }
        }
        Family::Mcs51 => format!("{:?}, {} Hz", setup.mcs51, setup.avr.hz),
        Family::Pic16 => format!("{:?}", setup.pic16),
        Family::Ap101 => format!("{:?}", setup.ap101),
    };
    let (program, options) = (snapshot::program(image), format!("{options}, RAM {:?}", setup.ram));
    Head { chip: chip.name.to_owned(), program, options, cycle: 0 }
}

/// Where snapshots are written during a run.
#[derive(Debug, Clone)]
pub struct Shelf {
    /// What they are of.
    pub head: Head,
    /// Files that are read or written otherwise, which no snapshot may replace.
    pub taken: Vec<String>,
}

impl Shelf {
    /// Writes the state at a cycle to a file that a scenario names, whole or not at all. A scenario may come from somebody else, so it
    /// writes only in the current folder and in folders within it.
    pub fn write_within(&self, file: &str, cycle: u64, state: &[u8]) -> Result<(), Failure> {
        let within = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
        if Path::new(file).components().all(within) {
            return self.write(file, cycle, state);
        }
        Err(Failure::Usage(format!("{file} is outside of the current folder, where a scenario writes nothing")))
    }

    /// Writes the state at a cycle, whole or not at all. Of files that are there it replaces only snapshots.
    pub fn write(&self, file: &str, cycle: u64, state: &[u8]) -> Result<(), Failure> {
        if file == "-" || output::is_stdout(file) {
            return Err(Failure::Usage("a snapshot needs a file, which standard output is not here".to_owned()));
        }
        if self.taken.iter().any(|other| output::same_place(other, file)) {
            return Err(Failure::Usage(format!("{file} is in use otherwise")));
        }
        if !is_replaceable(file) {
            return Err(Failure::Usage(format!("{file} is there already, and is no snapshot")));
        }
        let bytes = snapshot::write(&Head { cycle, ..self.head.clone() }, state);
        output::files(&[(file, &bytes)])
    }
}

/// There is no such file, or it is no plain one, or it is empty or a snapshot.
fn is_replaceable(file: &str) -> bool {
    // What cannot be looked at may be anything; the system says what is wrong with it.
    if !fs::metadata(file).is_ok_and(|found| found.is_file()) {
        return true;
    }
    let mut bytes = Vec::new();
    let read = fs::File::open(file).and_then(|open| open.take(16).read_to_end(&mut bytes));
    read.is_ok() && (bytes.is_empty() || snapshot::is_snapshot(&bytes))
}
