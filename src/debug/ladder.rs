//! Ladder programs under the debugger: compiled on the fly, or beside the image that was made of them.

use emu_check::{needs_pull_up, read_map};
use emu_core::chip::Chip;
use emu_core::image::{self, ElfMachine, Image};
use emu_core::pins::{Level, PinId, Time};
use emu_debug::Drive;
use emu_debug::stimulus::Put;
use ladder_compile::{Options, Special};
use ladder_view::View;

use super::open::Subject;
use crate::fail::Failure;
use crate::input;
use crate::report::{Terminal, Texts};

/// A program and the image that was made of it.
pub(super) struct Compiled {
    /// The program and its map.
    pub view: View,
    hex: String,
}

impl Compiled {
    /// The image.
    pub fn image(&self, file: &str, chip: &'static Chip) -> Result<Image, Failure> {
        let loaded = image::load(file, self.hex.as_bytes(), chip.hex, chip.elf, ElfMachine(chip.elf_machine));
        loaded.map(|loaded| loaded.image).map_err(|faults| Failure::Refused(faults, Texts::default()))
    }
}

impl Subject {
    /// It is a ladder program, by its name.
    pub(super) fn is_ladder(&self) -> bool {
        self.file.to_ascii_lowercase().ends_with(".ld")
    }

    /// Compiles the program, as `emu compile` does. What that notes of fuses and of parts around the chip is arranged here.
    pub(super) fn compiled(&self, chip: &'static Chip, terminal: &Terminal) -> Result<Compiled, Failure> {
        if self.ladder.is_some() {
            let why = "--ladder and --map are for images; a ladder program is compiled on the fly".to_owned();
            return Err(Failure::Usage(why));
        }
        let read = input::program(&self.file, self.dialect, true, terminal)?;
        let options = Options {
            mcu: chip.name.to_owned(),
            pins: self.pins.clone(),
            clock_hz: self.machine.clock,
            ..Options::default()
        };
        let compiled = match ladder_compile::compile(&read.program, &options) {
            Ok(compiled) => compiled,
            Err(refusals) => return Err(Failure::Refused(refusals, read.texts)),
        };
        read.note_other_chip(chip.name);
        let view = View::new(read.program, compiled.map, chip);
        let view = view.map_err(|faults| Failure::Refused(faults, Texts::default()))?;
        Ok(Compiled { view, hex: compiled.hex })
    }

    /// The program beside the image, if one is given.
    pub(super) fn mapped(&self, chip: &'static Chip, terminal: &Terminal) -> Result<Option<View>, Failure> {
        let (Some(program), Some(file)) = (&self.ladder, &self.map) else {
            return match self.pins.is_empty() && self.dialect.is_none() {
                true => Ok(None),
                false => Err(Failure::Usage("--pin and --dialect are for ladder programs".to_owned())),
            };
        };
        let refused = |faults| Failure::Refused(faults, Texts::default());
        let map = read_map(file, &input::bytes(file)?).map_err(|fault| refused(vec![fault]))?;
        let read = input::program(program, self.dialect, true, terminal)?;
        View::new(read.program, map, chip).map(Some).map_err(refused)
    }
}

/// What a board does for a program: inputs are low, as in `emu sim`, outputs that the chip only lets go are pulled up, and the serial
/// line is at rest.
pub(super) fn wires(view: &View, chip: &Chip) -> Vec<Drive> {
    let at = Time::default();
    let map = view.map();
    let named = map.pins.iter().filter_map(|pin| {
        let id = chip.pin(&pin.pin)?;
        match pin.direction.as_str() {
            "in" => Some((id, Level::Low)),
            _ => needs_pull_up(chip, id).then_some((id, Level::PullUp)),
        }
    });
    let line = map.specials.iter().filter_map(|special| match special {
        Special::Receive { pin, .. } => Some((chip.pin(pin)?, Level::High)),
        _ => None,
    });
    named.chain(line).map(|(pin, level)| Drive { at, put: Put::Level(pin, level) }).collect()
}

/// It drives that pin.
pub(super) fn is_of(drive: &Drive, pin: PinId) -> bool {
    matches!(drive.put, Put::Level(driven, _) | Put::Volts(driven, _) | Put::Counts(driven, _) if driven == pin)
}

/// `Ymotor=1` as `PB1=1`, where the program has an input or output of that name; else the text as it is.
pub(super) fn wired_pin(view: &View, text: &str) -> String {
    let (name, rest) = text.split_at(text.find('=').unwrap_or(text.len()));
    let named = view.map().pins.iter().find(|pin| pin.name == name.trim());
    named.map_or_else(|| text.to_owned(), |pin| format!("{}{rest}", pin.pin))
}
