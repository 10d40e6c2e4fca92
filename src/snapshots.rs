//! Snapshots of machines, for all who write and read them.

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
    /// Writes the state at a cycle, whole or not at all.
    pub fn write(&self, file: &str, cycle: u64, state: &[u8]) -> Result<(), Failure> {
        if file == "-" || output::is_stdout(file) {
            return Err(Failure::Usage("a snapshot needs a file, which standard output is not here".to_owned()));
        }
        if self.taken.iter().any(|other| output::same_place(other, file)) {
            return Err(Failure::Usage(format!("{file} is in use otherwise")));
        }
        let bytes = snapshot::write(&Head { cycle, ..self.head.clone() }, state);
        output::files(&[(file, &bytes)])
    }
}
