//! `--reading`: choices where silicon and its data sheet differ, or where a manual can be read in two ways.

use emu_core::chip::{Chip, ChipFamily};

use crate::shared::fail::VerbFailure;
use crate::shared::usage_error::UsageError;

/// The readings of the machines of all families that have some.
#[derive(Debug, Clone, Copy, Default)]
pub struct FamilyReadings {
    /// Readings of an AVR.
    pub avr: emu_avr::AvrReadings,
    /// Readings of an 8051.
    pub mcs51: emu_8051::Mcs51Readings,
    /// Readings of a PIC16.
    pub pic16: emu_pic16::Pic16Readings,
}

/// The field of [`FamilyReadings`] that a reading sets.
#[derive(Debug, Clone, Copy)]
enum ReadingField {
    /// A field with the same default for every chip.
    Plain(fn(&mut FamilyReadings) -> &mut bool),
    /// A field whose default is in the row of the chip.
    ByChip(fn(&mut FamilyReadings) -> &mut Option<bool>),
}

/// One value of `--reading`.
#[derive(Debug, Clone, Copy)]
pub struct ReadingChoice {
    name: &'static str,
    choice: &'static str,
    family: ChipFamily,
    field: ReadingField,
    value: bool,
}

impl ReadingChoice {
    fn apply(&self, to: &mut FamilyReadings) {
        match self.field {
            ReadingField::Plain(field) => *field(to) = self.value,
            ReadingField::ByChip(field) => *field(to) = Some(self.value),
        }
    }

    fn is_applied(&self, mut to: FamilyReadings) -> bool {
        match self.field {
            ReadingField::Plain(field) => *field(&mut to) == self.value,
            ReadingField::ByChip(field) => *field(&mut to) == Some(self.value),
        }
    }
}

const fn row(
    family: ChipFamily,
    name: &'static str,
    choices: [&'static str; 2],
    field: ReadingField,
) -> [ReadingChoice; 2] {
    let [no, yes] = choices;
    [
        ReadingChoice { name, choice: no, family, field, value: false },
        ReadingChoice { name, choice: yes, family, field, value: true },
    ]
}

/// All readings: family, name, the choice for false and the choice for true, and the field.
#[rustfmt::skip]
const READINGS: [[ReadingChoice; 2]; 7] = [
    row(ChipFamily::Avr,   "int-wake",         ["level", "edge"],   ReadingField::ByChip(|of| &mut of.avr.edges_wake)),
    row(ChipFamily::Avr,   "icr-write",        ["any", "top"],      ReadingField::Plain(|of| &mut of.avr.icr_only_as_top)),
    row(ChipFamily::Avr,   "erased",           ["stop", "nop"],     ReadingField::Plain(|of| &mut of.avr.erased_is_nop)),
    row(ChipFamily::Mcs51, "interrupt-sample", ["previous", "now"], ReadingField::Plain(|of| &mut of.mcs51.samples_interrupt_at_once)),
    row(ChipFamily::Mcs51, "hold",             ["write", "access"], ReadingField::Plain(|of| &mut of.mcs51.read_holds_interrupts)),
    row(ChipFamily::Pic16, "trmt",             ["middle", "begin"], ReadingField::Plain(|of| &mut of.pic16.trmt_as_stop_begins)),
    row(ChipFamily::Pic16, "ss-raise",         ["anew", "keep"],    ReadingField::Plain(|of| &mut of.pic16.ss_keeps_bits)),
];

fn rows() -> impl Iterator<Item = &'static ReadingChoice> {
    READINGS.iter().flatten()
}

/// The flag `--reading`, for every command that builds a machine from an image.
#[derive(Debug, clap::Args)]
pub struct ReadingFlags {
    /// Choose between two readings, where silicon and its data sheet differ or where a manual can be read in
    /// two ways. On AVR int-wake=edge or level: an edge on INT0 and INT1 also ends deep sleep, or only a low
    /// level does (default: edge on ATmega328, 328P and the A, P, PA variants); icr-write=any or top: ICR can
    /// be written in any mode (default), or only where it is TOP; erased=stop or nop: an erased word ends the
    /// run (default), or does nothing. On the 8051 interrupt-sample=previous or now, hold=write or access. On
    /// PIC16 trmt=middle or begin (of the stop bit); ss-raise=anew or keep: when SS rises within a byte, the
    /// SPI slave begins the byte again, or keeps SSPSR as it is. Repeatable.
    #[arg(long, value_name = "NAME=READING", value_parser = parse_reading)]
    reading: Vec<ReadingChoice>,
}

impl ReadingFlags {
    /// Returns the readings that the flags choose for `chip`.
    ///
    /// # Errors
    /// A reading is for another family, or two readings have one name.
    pub fn of(&self, chip: &Chip) -> Result<FamilyReadings, VerbFailure> {
        check_readings(&self.reading, chip)?;
        Ok(apply_readings(&self.reading))
    }
}

/// Parses the reading `NAME=READING`.
fn parse_reading(text: &str) -> Result<ReadingChoice, UsageError> {
    let found = text
        .split_once('=')
        .and_then(|(name, choice)| rows().find(|row| (row.name, row.choice) == (name, choice)).copied());
    found.ok_or_else(|| {
        let of = |family| {
            let rows = rows().filter(move |row| row.family == family);
            rows.map(|row| format!("{}={}", row.name, row.choice)).collect::<Vec<_>>().join(", ")
        };
        UsageError::malformed(format!(
            "readings are {} on AVR, {} on the 8051, {} on PIC16",
            of(ChipFamily::Avr),
            of(ChipFamily::Mcs51),
            of(ChipFamily::Pic16)
        ))
    })
}

/// Refuses readings for another family, and two readings with one name.
fn check_readings(readings: &[ReadingChoice], chip: &Chip) -> Result<(), VerbFailure> {
    let twice =
        |(at, reading): &(usize, &ReadingChoice)| readings.iter().take(*at).any(|other| other.name == reading.name);
    if let Some((_, reading)) = readings.iter().enumerate().find(twice) {
        return Err(VerbFailure::Usage(format!("--reading gives {} twice", reading.name)));
    }
    match readings.iter().find(|reading| reading.family != chip.family) {
        None => Ok(()),
        Some(reading) => {
            let family = reading.family.traits().title;
            let why =
                format!("--reading {} is for chips of the {family} family; {} is not one", reading.name, chip.name);
            Err(VerbFailure::Usage(why))
        }
    }
}

/// Returns the default readings with these choices applied.
fn apply_readings(readings: &[ReadingChoice]) -> FamilyReadings {
    let mut all = FamilyReadings::default();
    readings.iter().for_each(|reading| reading.apply(&mut all));
    all
}

/// Returns the flags that choose the readings of a machine of `chip`, one per name.
pub fn reading_flags(chip: &Chip, readings: FamilyReadings) -> Vec<String> {
    let readings = FamilyReadings { avr: readings.avr.resolved(chip), ..readings };
    let rows = rows().filter(|row| row.family == chip.family && row.is_applied(readings));
    rows.map(|row| format!("--reading {}={}", row.name, row.choice)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::family::parse_chip;

    #[test]
    fn every_choice_comes_back_as_its_flag() {
        for chosen in rows() {
            let flag = format!("--reading {}={}", chosen.name, chosen.choice);
            let of_family = ["atmega328p", "at89s52", "pic16f877a"].map(|name| parse_chip(name).expect("a chip"));
            let chip = of_family.into_iter().find(|chip| chip.family == chosen.family).expect("of its family");
            let flags = reading_flags(chip, apply_readings(&[*chosen]));
            let names = READINGS.iter().flatten().filter(|row| row.family == chip.family && row.value).count();
            assert!(flags.contains(&flag) && flags.len() == names, "{flag}: {flags:?}");
        }
    }

    #[test]
    fn what_is_not_chosen_is_as_the_chip_has_it() {
        for (name, wakes) in [("atmega328p", "edge"), ("atmega48", "level")] {
            let flags = reading_flags(parse_chip(name).expect("a chip"), apply_readings(&[]));
            let wanted = [&format!("--reading int-wake={wakes}"), "--reading icr-write=any", "--reading erased=stop"];
            assert_eq!(flags, wanted, "{name}");
        }
    }
}
