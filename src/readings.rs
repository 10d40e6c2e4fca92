//! `--reading`: what is true where silicon and its data sheet differ, or where a sentence of a manual can be read two ways.

use emu_core::chip::{Chip, Family};

use crate::fail::Failure;

/// The readings of the machines of all families that have some.
#[derive(Debug, Clone, Copy, Default)]
pub struct Readings {
    /// Of an AVR.
    pub avr: emu_avr::Readings,
    /// Of an 8051.
    pub mcs51: emu_8051::Readings,
    /// Of a PIC16.
    pub pic16: emu_pic16::Readings,
}

/// The field of [`Readings`] that a reading decides.
#[derive(Debug, Clone, Copy)]
enum Field {
    /// One that every chip has alike.
    Plain(fn(&mut Readings) -> &mut bool),
    /// One that the row of a chip decides where nobody else does.
    ByChip(fn(&mut Readings) -> &mut Option<bool>),
}

/// A reading of the command line.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    name: &'static str,
    choice: &'static str,
    family: Family,
    field: Field,
    value: bool,
}

impl Reading {
    fn apply(&self, to: &mut Readings) {
        match self.field {
            Field::Plain(field) => *field(to) = self.value,
            Field::ByChip(field) => *field(to) = Some(self.value),
        }
    }

    fn is_applied(&self, mut to: Readings) -> bool {
        match self.field {
            Field::Plain(field) => *field(&mut to) == self.value,
            Field::ByChip(field) => *field(&mut to) == Some(self.value),
        }
    }
}

const fn row(family: Family, name: &'static str, choices: [&'static str; 2], field: Field) -> [Reading; 2] {
    let [no, yes] = choices;
    [
        Reading { name, choice: no, family, field, value: false },
        Reading { name, choice: yes, family, field, value: true },
    ]
}

/// All readings: family, name, the choice that leaves the field false and the one that makes it true, the field.
#[rustfmt::skip]
const READINGS: [[Reading; 2]; 7] = [
    row(Family::Avr,   "int-wake",         ["level", "edge"],   Field::ByChip(|of| &mut of.avr.edges_wake)),
    row(Family::Avr,   "icr-write",        ["any", "top"],      Field::Plain(|of| &mut of.avr.icr_only_as_top)),
    row(Family::Avr,   "erased",           ["stop", "nop"],     Field::Plain(|of| &mut of.avr.erased_is_nop)),
    row(Family::Mcs51, "interrupt-sample", ["previous", "now"], Field::Plain(|of| &mut of.mcs51.sample_now)),
    row(Family::Mcs51, "hold",             ["write", "access"], Field::Plain(|of| &mut of.mcs51.hold_on_read)),
    row(Family::Pic16, "trmt",             ["middle", "begin"], Field::Plain(|of| &mut of.pic16.trmt_as_stop_begins)),
    row(Family::Pic16, "ss-raise",         ["anew", "keep"],    Field::Plain(|of| &mut of.pic16.ss_keeps_bits)),
];

fn rows() -> impl Iterator<Item = &'static Reading> {
    READINGS.iter().flatten()
}

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
    reading: Vec<Reading>,
}

impl Args {
    /// What the flags decide for `chip`.
    ///
    /// # Errors
    /// One is not for its family, or there are two of one name.
    pub fn of(&self, chip: &Chip) -> Result<Readings, Failure> {
        refuse(&self.reading, chip)?;
        Ok(of(&self.reading))
    }
}

/// The reading `NAME=READING`.
fn reading(text: &str) -> Result<Reading, String> {
    let found = text
        .split_once('=')
        .and_then(|(name, choice)| rows().find(|row| (row.name, row.choice) == (name, choice)).copied());
    found.ok_or_else(|| {
        let of = |family| {
            let rows = rows().filter(move |row| row.family == family);
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
fn refuse(readings: &[Reading], chip: &Chip) -> Result<(), Failure> {
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

/// What the readings decide.
fn of(readings: &[Reading]) -> Readings {
    let mut all = Readings::default();
    readings.iter().for_each(|reading| reading.apply(&mut all));
    all
}

/// The flags that choose the readings of a machine of `chip`, one for every name.
pub fn flags(chip: &Chip, readings: Readings) -> Vec<String> {
    let readings = Readings { avr: readings.avr.resolved(chip), ..readings };
    let rows = rows().filter(|row| row.family == chip.family && row.is_applied(readings));
    rows.map(|row| format!("--reading {}={}", row.name, row.choice)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::chip;

    #[test]
    fn every_choice_comes_back_as_its_flag() {
        for chosen in rows() {
            let flag = format!("--reading {}={}", chosen.name, chosen.choice);
            let of_family = ["atmega328p", "at89s52", "pic16f877a"].map(|name| chip(name).expect("a chip"));
            let chip = of_family.into_iter().find(|chip| chip.family == chosen.family).expect("of its family");
            let flags = flags(chip, of(&[*chosen]));
            let names = READINGS.iter().flatten().filter(|row| row.family == chip.family && row.value).count();
            assert!(flags.contains(&flag) && flags.len() == names, "{flag}: {flags:?}");
        }
    }

    #[test]
    fn what_is_not_chosen_is_as_the_chip_has_it() {
        for (name, wakes) in [("atmega328p", "edge"), ("atmega48", "level")] {
            let flags = flags(chip(name).expect("a chip"), of(&[]));
            let wanted = [&format!("--reading int-wake={wakes}"), "--reading icr-write=any", "--reading erased=stop"];
            assert_eq!(flags, wanted, "{name}");
        }
    }
}
