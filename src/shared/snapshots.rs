//! Headers and files of snapshots, for all verbs that write or read them.

use std::fs;
use std::io::Read;
use std::path::{Component, Path};

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::RamInit;
use emu_core::image::Image;
use emu_debug::snapshot::{self, SnapshotHeader};
use emu_pic16::TimingCorner;

use crate::shared::fail::VerbFailure;
use crate::shared::family::MachineSetup;
use crate::shared::readings::FamilyReadings;
use crate::shared::{output, readings};

/// Returns the header of a machine's snapshots, with cycle 0.
///
/// The options are the flags that build the same machine, including what the image and the chip's row decide.
/// So equal machines have equal options, whatever their origin.
pub fn snapshot_header(chip: &Chip, image: &Image, setup: &MachineSetup) -> SnapshotHeader {
    let mut flags = match chip.family {
        ChipFamily::Avr => avr_flags(chip, image, setup.avr),
        ChipFamily::Mcs51 => {
            let emu_8051::Options { von_neumann, ea, x2, readings: _ } = setup.mcs51;
            let mut flags = vec![clock(setup.avr.hz), format!("--ea {}", if ea { "high" } else { "low" })];
            let given_flags = [("--von-neumann", von_neumann), ("--x2", x2)];
            flags.extend(given_flags.into_iter().filter(|(_, is_given)| *is_given).map(|(flag, _)| flag.to_owned()));
            flags
        }
        ChipFamily::Pic16 => pic16_flags(image, setup.pic16),
        ChipFamily::Ap101 => {
            let config = emu_ap101::config::Ap101Config::read_config(image).unwrap_or_default();
            let inputs = match setup.ap101.inputs.unwrap_or(config.inputs) {
                emu_ap101::InputSampling::Scan => "scan",
                emu_ap101::InputSampling::Live => "live",
            };
            vec![clock(setup.ap101.hz.unwrap_or(config.hz)), format!("--inputs {inputs}")]
        }
    };
    let (avr, mcs51, pic16) = (setup.avr.readings, setup.mcs51.readings, setup.pic16.readings);
    flags.extend(readings::reading_flags(chip, FamilyReadings { avr, mcs51, pic16 }));
    flags.push(match setup.ram {
        RamInit::Random(seed) => format!("--ram random:{seed}"),
        RamInit::Zero => "--ram zero".to_owned(),
    });
    SnapshotHeader {
        chip: chip.name.to_owned(),
        program: snapshot::image_hash(image),
        options: flags.join(" "),
        cycle: 0,
    }
}

fn clock(hz: u64) -> String {
    format!("--clock {hz}")
}

fn avr_flags(chip: &Chip, image: &Image, options: emu_avr::Options) -> Vec<String> {
    // The package does not change the state.
    let emu_avr::Options { hz, fuses: given_fuses, lock, start_up, readings: _, package: _ } = options;
    let mut fuses = emu_avr::chips::part(chip.name).map_or([0xFF; 3], |part| part.fuses.default_bytes);
    image.fill("fuse", &mut fuses);
    let mut locked = [0xFF];
    image.fill("lock", &mut locked);
    let has = chip.space("fuse").map_or(0, |space| space.size as usize);
    let bytes = ["low", "high", "extended"].into_iter().zip(given_fuses.unwrap_or(fuses)).take(has);
    let bytes: Vec<String> = bytes.map(|(name, value)| format!("{name}=0x{value:02X}")).collect();
    let mut flags =
        vec![clock(hz), format!("--fuse {}", bytes.join(",")), format!("--lock 0x{:02X}", lock.unwrap_or(locked[0]))];
    flags.extend((!start_up).then(|| "--no-start-up".to_owned()));
    flags
}

fn pic16_flags(image: &Image, options: emu_pic16::Options) -> Vec<String> {
    /// Index of the configuration word at 2007h in the memory `config`, which begins at 2000h.
    const WORD: usize = 7;
    let emu_pic16::Options { hz, corner, config, start_up, timer1_hz, ideal_acquisition, readings: _ } = options;
    let mut bytes = [0xFF; 2 * WORD + 2];
    image.fill("config", &mut bytes);
    let own = u16::from_le_bytes([bytes[2 * WORD], bytes[2 * WORD + 1]]) & 0x3FFF;
    let corner = match corner {
        TimingCorner::Min => "min",
        TimingCorner::Typ => "typ",
        TimingCorner::Max => "max",
    };
    let mut flags = vec![
        clock(hz),
        format!("--config 0x{:04X}", config.unwrap_or(own)),
        format!("--corner {corner}"),
        format!("--timer1-crystal {}", timer1_hz.map_or("none".to_owned(), |hz| hz.to_string())),
    ];
    flags.extend((!start_up).then(|| "--no-start-up".to_owned()));
    flags.extend(ideal_acquisition.then(|| "--cod".to_owned()));
    flags
}

/// Writes snapshots during a run.
#[derive(Debug, Clone)]
pub struct SnapshotWriter {
    /// The header of the snapshots.
    pub head: SnapshotHeader,
    /// Files that the run reads or writes, which no snapshot may replace.
    pub protected_files: Vec<String>,
}

impl SnapshotWriter {
    /// Writes the state at a cycle to a file that a scenario names, completely or not at all. A scenario may
    /// come from somebody else, so it may write only in the current folder and its subfolders.
    pub fn write_within(&self, file: &str, cycle: u64, state: &[u8]) -> Result<(), VerbFailure> {
        let within = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
        if Path::new(file).components().all(within) {
            return self.write(file, cycle, state);
        }
        Err(VerbFailure::Usage(format!("{file} is outside of the current folder, and a scenario may not write there")))
    }

    /// Writes the state at a cycle, completely or not at all. Replaces an existing file only if it is a
    /// snapshot.
    pub fn write(&self, file: &str, cycle: u64, state: &[u8]) -> Result<(), VerbFailure> {
        if file == "-" || output::is_stdout(file) {
            return Err(VerbFailure::Usage("a snapshot needs a file, not standard output".to_owned()));
        }
        if self.protected_files.iter().any(|other| output::same_place(other, file)) {
            return Err(VerbFailure::Usage(format!("{file} is in use otherwise")));
        }
        if !is_replaceable(file) {
            return Err(VerbFailure::Usage(format!("{file} exists already and is not a snapshot")));
        }
        let bytes = snapshot::encode_snapshot(&SnapshotHeader { cycle, ..self.head.clone() }, state);
        output::write_files(&[(file, &bytes)])
    }
}

/// Returns true if the file does not exist, is no regular file, is empty, or is a snapshot.
fn is_replaceable(file: &str) -> bool {
    // If the file cannot be examined, the later write reports the system's error.
    if !fs::metadata(file).is_ok_and(|found| found.is_file()) {
        return true;
    }
    let mut bytes = Vec::new();
    let read = fs::File::open(file).and_then(|open| open.take(16).read_to_end(&mut bytes));
    read.is_ok() && (bytes.is_empty() || snapshot::is_snapshot(&bytes))
}
