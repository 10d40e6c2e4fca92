//! Ladder programs in the debugger: compiled on the fly, or read with the map of an image.

use emu_check::{needs_pull_up, read_map};
use emu_core::chip::Chip;
use emu_core::image::{self, ElfMachine, Image};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_debug::TimedDrive;
use emu_debug::stimulus::ExternalDrive;
use ladder_compile::{CompileOptions, SpecialPin};
use ladder_view::LadderView;

use super::open::DebugSubject;
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::report::{FileTexts, MessageStyle};

/// A ladder program and the image that it was compiled to.
pub(super) struct CompiledLadder {
    /// The program and its map.
    pub view: LadderView,
    hex: String,
}

impl CompiledLadder {
    /// Loads the image.
    pub fn image(&self, file: &str, chip: &'static Chip) -> Result<Image, VerbFailure> {
        let loaded =
            image::load(file, self.hex.as_bytes(), chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine));
        loaded.map(|loaded| loaded.image).map_err(|faults| VerbFailure::Refused(faults, FileTexts::default()))
    }
}

impl DebugSubject {
    /// Returns true if the file is a ladder program, by its name.
    pub(super) fn is_ladder(&self) -> bool {
        ::ladder::is_program_name(&self.file)
    }

    /// Compiles the program as `emu compile` does. The debugger sets up the fuses and external parts that the
    /// compiler mentions in its notes.
    pub(super) fn compile_ladder(
        &self,
        chip: &'static Chip,
        style: &MessageStyle,
    ) -> Result<CompiledLadder, VerbFailure> {
        if self.ladder.is_some() {
            let why = "--ladder and --map are for images; a ladder program is compiled on the fly".to_owned();
            return Err(VerbFailure::Usage(why));
        }
        let read = input::read_program_for_pins(&self.file, self.read.options(), &self.pins, style)?;
        let options = CompileOptions {
            mcu: chip.name.to_owned(),
            pins: self.pins.clone(),
            clock_hz: self.machine.clock,
            ..CompileOptions::default()
        };
        let compiled = match ladder_compile::compile(&read.program, &options) {
            Ok(compiled) => compiled,
            Err(refusals) => return Err(VerbFailure::Refused(refusals, read.texts)),
        };
        read.note_other_chip(chip.name);
        let view = LadderView::new(read.program, compiled.map, chip);
        let view = view.map_err(|faults| VerbFailure::Refused(faults, FileTexts::default()))?;
        Ok(CompiledLadder { view, hex: compiled.hex })
    }

    /// Reads the ladder program and the map that belong to an image, if they are given.
    pub(super) fn mapped_ladder(
        &self,
        chip: &'static Chip,
        style: &MessageStyle,
    ) -> Result<Option<LadderView>, VerbFailure> {
        let (Some(program), Some(file)) = (&self.ladder, &self.map) else {
            return match self.pins.is_empty() && self.read.is_empty() {
                true => Ok(None),
                false => {
                    Err(VerbFailure::Usage("--pin, --dialect, --format and --cycle are for ladder programs".to_owned()))
                }
            };
        };
        let refused = |faults| VerbFailure::Refused(faults, FileTexts::default());
        let map = read_map(file, &input::read_bytes(file)?).map_err(|fault| refused(vec![fault]))?;
        let read = input::read_program(program, self.read.options(), true, style)?;
        LadderView::new(read.program, map, chip).map(Some).map_err(refused)
    }
}

/// Returns the initial drives of the environment, as in `emu sim`: inputs are low, or high if their
/// declaration says TRUE; outputs that the chip can only pull low have pull-ups, and the receive line is high
/// (idle).
pub(super) fn default_drives(view: &LadderView, chip: &Chip) -> Vec<TimedDrive> {
    let at = CycleTime::default();
    let map = view.map();
    let named = map.pins.iter().filter_map(|pin| {
        let id = chip.pin(&pin.pin)?;
        match pin.direction.as_str() {
            "in" => Some((id, PinLevel::from_bit(view.is_high_at_power_up(&pin.name)))),
            _ => needs_pull_up(chip, id).then_some((id, PinLevel::PullUp)),
        }
    });
    let line = map.specials.iter().filter_map(|special| match special {
        SpecialPin::Receive { pin, .. } => Some((chip.pin(pin)?, PinLevel::High)),
        _ => None,
    });
    named.chain(line).map(|(pin, level)| TimedDrive { at, drive: ExternalDrive::Level(pin, level) }).collect()
}

/// Returns true if a drive is of a given pin.
pub(super) fn is_drive_of(drive: &TimedDrive, pin: PinId) -> bool {
    matches!(drive.drive, ExternalDrive::Level(driven, _) | ExternalDrive::Volts(driven, _) | ExternalDrive::Counts(driven, _) if driven == pin)
}

/// Replaces the name of an input or output of the program by its pin: `Ymotor=1` becomes `PB1=1`. Other text
/// is unchanged.
pub(super) fn chip_pin_text(view: &LadderView, text: &str) -> String {
    let (name, rest) = text.split_at(text.find('=').unwrap_or(text.len()));
    let named = view.map().pins.iter().find(|pin| pin.name == name.trim());
    named.map_or_else(|| text.to_owned(), |pin| format!("{}{rest}", pin.pin))
}
