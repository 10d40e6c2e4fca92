//! What the chip does with its pins by itself: pull-ups at inputs, strength behind outputs, and nothing elsewhere.

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};

use crate::places::Places;

/// Pins that carry something else than a port, by what the chip's data say of them: nothing is driven there from outside.
const RESERVED: [&str; 4] = ["XTAL1", "XTAL2", "RESET", "absent"];

/// The pins that the program does not name, and those of them that a board may drive.
pub(crate) fn unnamed(chip: &Chip, named: &[PinId]) -> (Vec<PinId>, Vec<PinId>) {
    let free = |pin: &PinId| !named.contains(pin);
    let note = |pin: &PinId| chip.pins.get(usize::from(*pin)).map_or("absent", |p| p.note);
    // The reset pin has a pull-up of its own.
    let port = |pin: &PinId| !matches!(note(pin), "absent" | "RESET");
    let all: Vec<PinId> = (0..chip.pins.len() as PinId).filter(free).filter(port).collect();
    let drivable = all.iter().copied().filter(|pin| !RESERVED.contains(&note(pin))).collect();
    (all, drivable)
}

/// Takes `cpu`, a copy, off its board and looks at every pin. Gives the number of pins, or what should be and what is.
///
/// An input reads low when pulled down and high when left alone; an output holds against the opposite level; a pin
/// without a name floats.
pub(crate) fn probe<C: Cpu>(mut cpu: C, places: &Places) -> Result<u64, (String, String)> {
    let mut with = |pin: PinId, outside: Level| {
        cpu.drive(Time::at(cpu.cycle()), pin, outside);
        (cpu.level(pin), places.pin_name(pin))
    };
    for &pin in &places.inputs {
        let (level, name) = with(pin, Level::Low);
        if level != Level::Low {
            return Err((format!("the input {name} low when it is driven low"), words(level)));
        }
        let (level, name) = with(pin, Level::Float);
        if level != Level::High {
            return Err((format!("the input {name} high by its pull-up when nothing drives it"), words(level)));
        }
    }
    for &(_, pin) in &places.outputs {
        let (before, name) = with(pin, Level::Float);
        let against = if before == Level::High { Level::Low } else { Level::High };
        let (level, _) = with(pin, against);
        if level != before {
            return Err((format!("the output {name} driven"), format!("{} when driven from outside", words(level))));
        }
    }
    for &pin in &places.unnamed {
        let (level, name) = with(pin, Level::Float);
        if level != Level::Float {
            return Err((format!("{name} floating, for the program does not name it"), words(level)));
        }
    }
    Ok((places.inputs.len() + places.outputs.len() + places.unnamed.len()) as u64)
}

fn words(level: Level) -> String {
    match level {
        Level::Low => "low",
        Level::High => "high",
        Level::Float | Level::PullUp | Level::PullDown => "floating",
    }
    .to_owned()
}
