//! Checks the electrical behaviour of the chip's pins: pull-ups of inputs, drivers of outputs, and no driver
//! on other pins.

use emu_core::pins::{CycleTime, PinId, PinLevel, PinState};

use crate::chip::deviation::Deviation;
use crate::chip::families::{CheckedChip, HighDrive, PinBehaviour, PullUpKind};
use crate::chip::program_places::ProgramPlaces;

/// Checks every pin as if it were disconnected from the board. Returns the number of pins checked, or the
/// deviation of the first pin that is wrong.
///
/// An input must read the level that it is driven to and, if it has a pull-up, high when nothing drives it.
/// An output must hold its level against the opposite level, as far as the chip drives it. The chip must not
/// drive a pin that the program does not name.
///
/// The level of a wire follows from its drivers, so copies of the wires are enough for all of this, except
/// for peripherals that react to an edge. With `drive_machine`, a copy of the machine is driven instead,
/// which takes several hundred times as long.
pub(crate) fn check_pins<C: CheckedChip>(
    cpu: &C,
    places: &ProgramPlaces,
    drive_machine: bool,
) -> Result<u64, Deviation> {
    let now = cpu.cycle();
    let mut machine = drive_machine.then(|| cpu.clone());
    let mut wire = None;
    let mut level_when_driven = |pin: PinId, outside: PinLevel| match &mut machine {
        Some(machine) => {
            machine.drive(CycleTime::at(now), pin, outside);
            machine.pin_level(pin)
        }
        None => {
            let (_, mut copy) =
                wire.filter(|(of, _)| *of == pin).unwrap_or_else(|| (pin, cpu.pin_state(pin).unwrap_or_default()));
            let level = driven_level(&mut copy, outside, now);
            wire = Some((pin, copy));
            level
        }
    };
    let mut checked = 0;
    for &pin in &places.inputs {
        let Some(PinBehaviour { pull_up, .. }) = places.pin_behaviour(pin) else { continue };
        let name = places.pin_name(pin);
        checked += 1;
        let level = level_when_driven(pin, PinLevel::Low);
        if level != PinLevel::Low {
            return Err(Deviation::new(format!("the input {name} low when it is driven low"), level_text(level)));
        }
        let level = level_when_driven(pin, PinLevel::High);
        if level != PinLevel::High {
            return Err(Deviation::new(format!("the input {name} high when it is driven high"), level_text(level)));
        }
        level_when_driven(pin, PinLevel::Low);
        let level = level_when_driven(pin, PinLevel::Float);
        if level != PinLevel::High && matches!(pull_up, PullUpKind::Inputs | PullUpKind::Always) {
            return Err(Deviation::new(
                format!("the input {name} high by its pull-up when nothing drives it"),
                level_text(level),
            ));
        }
    }
    for &(_, pin) in &places.outputs {
        let Some(PinBehaviour { high, .. }) = places.pin_behaviour(pin) else { continue };
        let name = places.pin_name(pin);
        checked += 1;
        let is_open_drain = high == HighDrive::Open;
        let before = level_when_driven(pin, if is_open_drain { PinLevel::PullUp } else { PinLevel::Float });
        let opposite = if before == PinLevel::High { PinLevel::Low } else { PinLevel::High };
        let level = level_when_driven(pin, opposite);
        let may_yield = before == PinLevel::High && high != HighDrive::Strong;
        if level != before && !may_yield {
            return Err(Deviation::new(
                format!("the output {name} driven"),
                format!("{} when driven from outside", level_text(level)),
            ));
        }
    }
    for &pin in &places.undriven_pins {
        let Some(PinBehaviour { pull_up, .. }) = places.pin_behaviour(pin) else { continue };
        let name = places.pin_name(pin);
        checked += 1;
        level_when_driven(pin, PinLevel::Low);
        let level = level_when_driven(pin, PinLevel::Float);
        let floats = match pull_up {
            PullUpKind::Inputs | PullUpKind::Never => level == PinLevel::Float,
            PullUpKind::Always => level == PinLevel::High,
            PullUpKind::PerPort => level != PinLevel::Low,
        };
        if !floats {
            return Err(Deviation::new(
                format!("{name} floating, for the program does not name it"),
                level_text(level),
            ));
        }
        for outside in [PinLevel::Low, PinLevel::High] {
            let level = level_when_driven(pin, outside);
            if level != outside {
                let found = format!("{} when driven {}", level_text(level), level_text(outside));
                return Err(Deviation::new(format!("{name} floating, for the program does not name it"), found));
            }
        }
    }
    Ok(checked)
}

/// The level of a wire while the outside drives it with `outside`.
fn driven_level(wire: &mut PinState, outside: PinLevel, now: u64) -> PinLevel {
    wire.external = outside;
    wire.settle(now);
    wire.level()
}

/// Formats the level of a pin for a message.
pub(crate) fn level_text(level: PinLevel) -> String {
    match level {
        PinLevel::Low => "low",
        PinLevel::High => "high",
        PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => "floating",
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use emu_core::chip::Chip;
    use emu_core::image::Image;
    use emu_core::rng::Rng;

    use super::*;
    use crate::chip::families::{MachineVisitor, find_chip_with_package, unnamed_pins, visit_machines};

    /// Machines with random register contents; each pin is driven both on the machine and on a copy of its
    /// wire.
    struct WireCheck(&'static Chip);

    impl MachineVisitor for WireCheck {
        type Output = ();

        fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) {
            let chip = self.0;
            let mut seen = BTreeSet::new();
            for seed in 0..60 {
                let (mut cpu, mut rng) = (power_up(seed), Rng::new(seed));
                for _ in 0..rng.below(60) {
                    let reg = &chip.regs[rng.below(chip.regs.len() as u64) as usize];
                    // A checked program never stops the clock of its chip, and peripherals with a bus
                    // protocol react to edges.
                    if reg.name != "PCON" && !["SSP", "TW"].iter().any(|part| reg.name.starts_with(part)) {
                        cpu.poke(chip.reg_space, reg.addr.into(), rng.next_u64() as u8);
                    }
                    cpu.run(cpu.cycle() + rng.below(3), &mut ());
                }
                for pin in unnamed_pins(chip, &[]).undriven {
                    let (mut machine, mut wire) = (cpu.clone(), cpu.pin_state(pin).expect("a pin"));
                    let now = cpu.cycle();
                    for outside in [
                        PinLevel::Low,
                        PinLevel::High,
                        PinLevel::PullUp,
                        PinLevel::Low,
                        PinLevel::Float,
                        PinLevel::PullDown,
                    ] {
                        machine.drive(CycleTime::at(now), pin, outside);
                        let (level, copied) = (machine.pin_level(pin), driven_level(&mut wire, outside, now));
                        let name = chip.pins[usize::from(pin)].name;
                        assert_eq!(level, copied, "{} seed {seed}: {name} driven {outside:?}", chip.name);
                        seen.insert(format!("{outside:?} {level:?}"));
                    }
                }
            }
            let wanted = ["Low Low", "High High", "Low High", "High Low", "Float Float", "Float Low"];
            let missed: Vec<_> = wanted.iter().filter(|case| !seen.contains(**case)).collect();
            // An 8051 never drives a pin high against the outside.
            let never = chip.name == "at89s52" && missed == [&"Low High"];
            assert!(missed.is_empty() || never, "{}: {missed:?} did not occur", chip.name);
        }
    }

    /// A copy of a wire gives the same levels as the wire of the machine.
    #[test]
    fn a_copy_of_a_wire_behaves_as_the_wire() {
        for mcu in ["atmega328p", "atmega8", "atmega162", "at89s52", "pic16f873", "pic16f88", "pic16f628"] {
            let chip = find_chip_with_package(mcu).expect(mcu);
            visit_machines(chip, &Image::default(), chip.default_hz, WireCheck(chip));
        }
    }
}
