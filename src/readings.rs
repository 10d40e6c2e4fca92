//! `--reading`: what is true where silicon and its data sheet differ, or where a sentence of a manual can be read two ways.

use emu_core::chip::{Chip, Family};

use crate::fail::Failure;

/// What a reading decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Decision {
    /// 8051: [`emu_8051::Readings::sample_now`].
    SampleNow(bool),
    /// 8051: [`emu_8051::Readings::hold_on_read`].
    HoldOnRead(bool),
    /// AVR: [`emu_avr::Readings::edges_wake`].
    EdgesWake(bool),
    /// AVR: [`emu_avr::Readings::icr_only_as_top`].
    IcrOnlyAsTop(bool),
}

/// A reading of the command line.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    name: &'static str,
    choice: &'static str,
    family: Family,
    decision: Decision,
}

const fn row(family: Family, name: &'static str, choice: &'static str, decision: Decision) -> Reading {
    Reading { name, choice, family, decision }
}

/// All readings.
const READINGS: [Reading; 8] = [
    row(Family::Avr, "int-wake", "edge", Decision::EdgesWake(true)),
    row(Family::Avr, "int-wake", "level", Decision::EdgesWake(false)),
    row(Family::Avr, "icr-write", "any", Decision::IcrOnlyAsTop(false)),
    row(Family::Avr, "icr-write", "top", Decision::IcrOnlyAsTop(true)),
    row(Family::Mcs51, "interrupt-sample", "previous", Decision::SampleNow(false)),
    row(Family::Mcs51, "interrupt-sample", "now", Decision::SampleNow(true)),
    row(Family::Mcs51, "hold", "write", Decision::HoldOnRead(false)),
    row(Family::Mcs51, "hold", "access", Decision::HoldOnRead(true)),
];

/// The reading `NAME=READING`.
pub fn reading(text: &str) -> Result<Reading, String> {
    let found = text
        .split_once('=')
        .and_then(|(name, choice)| READINGS.into_iter().find(|row| (row.name, row.choice) == (name, choice)));
    found.ok_or_else(|| {
        let of = |family| {
            let rows = READINGS.iter().filter(move |row| row.family == family);
            rows.map(|row| format!("{}={}", row.name, row.choice)).collect::<Vec<_>>().join(", ")
        };
        format!("readings are {} on AVR, {} on the 8051", of(Family::Avr), of(Family::Mcs51))
    })
}

/// Refuses readings that are not for the chip's family.
pub fn refuse(readings: &[Reading], chip: &Chip) -> Result<(), Failure> {
    match readings.iter().find(|reading| reading.family != chip.family) {
        None => Ok(()),
        Some(reading) => {
            let family = if reading.family == Family::Avr { "AVR" } else { "8051" };
            let why = format!("--reading {} is for chips of the {family} family; {} is none", reading.name, chip.name);
            Err(Failure::Usage(why))
        }
    }
}

/// What the readings decide on an AVR.
pub fn avr(readings: &[Reading]) -> emu_avr::Readings {
    let mut all = emu_avr::Readings::default();
    for reading in readings {
        match reading.decision {
            Decision::EdgesWake(edges) => all.edges_wake = Some(edges),
            Decision::IcrOnlyAsTop(only) => all.icr_only_as_top = only,
            Decision::SampleNow(_) | Decision::HoldOnRead(_) => {}
        }
    }
    all
}

/// What the readings decide on an 8051.
pub fn mcs51(readings: &[Reading]) -> emu_8051::Readings {
    let mut all = emu_8051::Readings::default();
    for reading in readings {
        match reading.decision {
            Decision::SampleNow(now) => all.sample_now = now,
            Decision::HoldOnRead(too) => all.hold_on_read = too,
            Decision::EdgesWake(_) | Decision::IcrOnlyAsTop(_) => {}
        }
    }
    all
}
