//! `--reading`: what is true where silicon and its data sheet differ, or where a sentence of a manual can be read two ways.

use emu_core::chip::{Chip, Family};

use crate::fail::Failure;

/// What a reading decides.
#[derive(Debug, Clone, Copy)]
enum Decision {
    /// 8051: [`emu_8051::Readings::sample_now`].
    SampleNow(bool),
    /// 8051: [`emu_8051::Readings::hold_on_read`].
    HoldOnRead(bool),
    /// AVR: [`emu_avr::Readings::edges_wake`].
    EdgesWake(bool),
    /// AVR: [`emu_avr::Readings::erased_is_nop`].
    ErasedIsNop(bool),
    /// AVR: [`emu_avr::Readings::icr_only_as_top`].
    IcrOnlyAsTop(bool),
    /// PIC16: [`emu_pic16::Readings::trmt_as_stop_begins`].
    TrmtAsStopBegins(bool),
    /// PIC16: [`emu_pic16::Readings::ss_keeps_bits`].
    SsKeepsBits(bool),
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
const READINGS: [Reading; 14] = [
    row(Family::Avr, "int-wake", "edge", Decision::EdgesWake(true)),
    row(Family::Avr, "int-wake", "level", Decision::EdgesWake(false)),
    row(Family::Avr, "icr-write", "any", Decision::IcrOnlyAsTop(false)),
    row(Family::Avr, "icr-write", "top", Decision::IcrOnlyAsTop(true)),
    row(Family::Avr, "erased", "stop", Decision::ErasedIsNop(false)),
    row(Family::Avr, "erased", "nop", Decision::ErasedIsNop(true)),
    row(Family::Mcs51, "interrupt-sample", "previous", Decision::SampleNow(false)),
    row(Family::Mcs51, "interrupt-sample", "now", Decision::SampleNow(true)),
    row(Family::Mcs51, "hold", "write", Decision::HoldOnRead(false)),
    row(Family::Mcs51, "hold", "access", Decision::HoldOnRead(true)),
    row(Family::Pic16, "trmt", "middle", Decision::TrmtAsStopBegins(false)),
    row(Family::Pic16, "trmt", "begin", Decision::TrmtAsStopBegins(true)),
    row(Family::Pic16, "ss-raise", "anew", Decision::SsKeepsBits(false)),
    row(Family::Pic16, "ss-raise", "keep", Decision::SsKeepsBits(true)),
];

/// The flag, of every command that builds a machine from an image.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// What is true where silicon and its data sheet differ, or where a sentence of a manual can be read two ways. On AVR
    /// int-wake=edge or level: an edge on INT0 and INT1 ends deep sleep too, or a low level alone (default: edge on ATmega328, 328P and
    /// the A, P, PA variants); icr-write=any or top: ICR is written in any mode (default), or only where it is TOP;
    /// erased=stop or nop: an erased word ends the run (default), or does nothing. On the 8051
    /// interrupt-sample=previous or now, hold=write or access. On PIC16 trmt=middle or begin (of the stop bit); ss-raise=anew or keep: SS
    /// raised within a byte has the SPI slave begin it anew, or leaves SSPSR as it is. Repeatable.
    #[arg(long, value_name = "NAME=READING", value_parser = reading)]
    pub reading: Vec<Reading>,
}

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
        format!(
            "readings are {} on AVR, {} on the 8051, {} on PIC16",
            of(Family::Avr),
            of(Family::Mcs51),
            of(Family::Pic16)
        )
    })
}

/// Refuses readings that are not for the chip's family, and two of one name.
pub fn refuse(readings: &[Reading], chip: &Chip) -> Result<(), Failure> {
    let twice = |(at, reading): &(usize, &Reading)| readings.iter().take(*at).any(|other| other.name == reading.name);
    if let Some((_, reading)) = readings.iter().enumerate().find(twice) {
        return Err(Failure::Usage(format!("--reading gives {} twice", reading.name)));
    }
    match readings.iter().find(|reading| reading.family != chip.family) {
        None => Ok(()),
        Some(reading) => {
            let family = match reading.family {
                Family::Avr => "AVR",
                Family::Mcs51 => "8051",
                Family::Pic16 => "PIC16",
                Family::Ap101 => "AP101",
            };
            let why = format!("--reading {} is for chips of the {family} family; {} is none", reading.name, chip.name);
            Err(Failure::Usage(why))
        }
    }
}

/// The flags that choose the readings of a machine, one for every name; `taken` says whether it is so.
fn flags(family: Family, taken: impl Fn(Decision) -> bool) -> Vec<String> {
    let rows = READINGS.iter().filter(|row| row.family == family && taken(row.decision));
    rows.map(|row| format!("--reading {}={}", row.name, row.choice)).collect()
}

/// The flags that choose these readings on the AVR `chip`.
pub fn flags_of_avr(chip: &Chip, readings: emu_avr::Readings) -> Vec<String> {
    let readings = readings.resolved(chip);
    flags(Family::Avr, |decision| match decision {
        Decision::EdgesWake(edges) => readings.edges_wake == Some(edges),
        Decision::IcrOnlyAsTop(only) => readings.icr_only_as_top == only,
        Decision::ErasedIsNop(nop) => readings.erased_is_nop == nop,
        _ => false,
    })
}

/// The flags that choose these readings on an 8051.
pub fn flags_of_mcs51(readings: emu_8051::Readings) -> Vec<String> {
    flags(Family::Mcs51, |decision| match decision {
        Decision::SampleNow(now) => readings.sample_now == now,
        Decision::HoldOnRead(too) => readings.hold_on_read == too,
        _ => false,
    })
}

/// The flags that choose these readings on a PIC16.
pub fn flags_of_pic16(readings: emu_pic16::Readings) -> Vec<String> {
    flags(Family::Pic16, |decision| match decision {
        Decision::TrmtAsStopBegins(begins) => readings.trmt_as_stop_begins == begins,
        Decision::SsKeepsBits(keeps) => readings.ss_keeps_bits == keeps,
        _ => false,
    })
}

/// What the readings decide on an AVR.
pub fn avr(readings: &[Reading]) -> emu_avr::Readings {
    let mut all = emu_avr::Readings::default();
    for reading in readings {
        match reading.decision {
            Decision::EdgesWake(edges) => all.edges_wake = Some(edges),
            Decision::IcrOnlyAsTop(only) => all.icr_only_as_top = only,
            Decision::ErasedIsNop(nop) => all.erased_is_nop = nop,
            _ => {}
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
            _ => {}
        }
    }
    all
}

/// What the readings decide on a PIC16.
pub fn pic16(readings: &[Reading]) -> emu_pic16::Readings {
    let mut all = emu_pic16::Readings::default();
    for reading in readings {
        match reading.decision {
            Decision::TrmtAsStopBegins(begins) => all.trmt_as_stop_begins = begins,
            Decision::SsKeepsBits(keeps) => all.ss_keeps_bits = keeps,
            _ => {}
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::chip;

    #[test]
    fn every_choice_comes_back_as_its_flag() {
        for chosen in READINGS {
            let flag = format!("--reading {}={}", chosen.name, chosen.choice);
            let flags = match chosen.family {
                Family::Avr => flags_of_avr(chip("atmega328p").expect("a chip"), avr(&[chosen])),
                Family::Pic16 => flags_of_pic16(pic16(&[chosen])),
                _ => flags_of_mcs51(mcs51(&[chosen])),
            };
            assert!(
                flags.contains(&flag) && flags.len() == if chosen.family == Family::Avr { 3 } else { 2 },
                "{flag}: {flags:?}"
            );
        }
    }

    #[test]
    fn what_is_not_chosen_is_as_the_chip_has_it() {
        for (name, wakes) in [("atmega328p", "edge"), ("atmega48", "level")] {
            let flags = flags_of_avr(chip(name).expect("a chip"), avr(&[]));
            assert_eq!(
                flags,
                [
                    format!("--reading int-wake={wakes}"),
                    "--reading icr-write=any".to_owned(),
                    "--reading erased=stop".to_owned()
                ],
                "{name}"
            );
        }
    }
}
