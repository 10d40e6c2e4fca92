//! What the chip does with its pins by itself: pull-ups at inputs, strength behind outputs, and nothing elsewhere.

use emu_core::pins::{Level, Pin, PinId, Time};

use crate::family::{High, Nature, PullUp, Target};
use crate::places::Places;

/// Looks at every pin as it would be off its board. Gives the number of pins, or what should be and what is.
///
/// An input reads what it is driven to, and high by its pull-up, where it has one, when left alone; an output holds
/// against the opposite level, as far as the chip drives it; a pin without a name is not driven.
///
/// What a wire does follows from what drives it, so copies of the wires tell all of this. Only a part of the chip that answers
/// an edge is beyond them: with `whole`, a copy of the machine is driven instead, which takes some hundred times as long.
pub(crate) fn probe<C: Target>(cpu: &C, places: &Places, whole: bool) -> Result<u64, (String, String)> {
    let now = cpu.cycle();
    let mut machine = whole.then(|| cpu.clone());
    let mut wire = None;
    let mut with = |pin: PinId, outside: Level| match &mut machine {
        Some(machine) => {
            machine.drive(Time::at(now), pin, outside);
            machine.level(pin)
        }
        None => {
            let (_, mut copy) =
                wire.filter(|(of, _)| *of == pin).unwrap_or_else(|| (pin, cpu.pin(pin).unwrap_or_default()));
            let level = driven(&mut copy, outside, now);
            wire = Some((pin, copy));
            level
        }
    };
    let mut looked = 0;
    for &pin in &places.inputs {
        let Some(Nature { pull_up, .. }) = places.nature(pin) else { continue };
        let name = places.pin_name(pin);
        looked += 1;
        let level = with(pin, Level::Low);
        if level != Level::Low {
            return Err((format!("the input {name} low when it is driven low"), words(level)));
        }
        let level = with(pin, Level::High);
        if level != Level::High {
            return Err((format!("the input {name} high when it is driven high"), words(level)));
        }
        with(pin, Level::Low);
        let level = with(pin, Level::Float);
        if level != Level::High && matches!(pull_up, PullUp::Inputs | PullUp::Always) {
            return Err((format!("the input {name} high by its pull-up when nothing drives it"), words(level)));
        }
    }
    for &(_, pin) in &places.outputs {
        let Some(Nature { high, .. }) = places.nature(pin) else { continue };
        let name = places.pin_name(pin);
        looked += 1;
        let open = high == High::Open;
        let before = with(pin, if open { Level::PullUp } else { Level::Float });
        let against = if before == Level::High { Level::Low } else { Level::High };
        let level = with(pin, against);
        let gives = before == Level::High && high != High::Strong;
        if level != before && !gives {
            return Err((format!("the output {name} driven"), format!("{} when driven from outside", words(level))));
        }
    }
    for &pin in &places.unnamed {
        let Some(Nature { pull_up, .. }) = places.nature(pin) else { continue };
        let name = places.pin_name(pin);
        looked += 1;
        with(pin, Level::Low);
        let level = with(pin, Level::Float);
        let floats = match pull_up {
            PullUp::Inputs | PullUp::Never => level == Level::Float,
            PullUp::Always => level == Level::High,
            PullUp::Maybe => level != Level::Low,
        };
        if !floats {
            return Err((format!("{name} floating, for the program does not name it"), words(level)));
        }
        for outside in [Level::Low, Level::High] {
            let level = with(pin, outside);
            if level != outside {
                let found = format!("{} when driven {}", words(level), words(outside));
                return Err((format!("{name} floating, for the program does not name it"), found));
            }
        }
    }
    Ok(looked)
}

/// The level of a wire once the outside drives it so.
fn driven(wire: &mut Pin, outside: Level, now: u64) -> Level {
    wire.outside = outside;
    wire.settle(now);
    wire.level()
}

fn words(level: Level) -> String {
    match level {
        Level::Low => "low",
        Level::High => "high",
        Level::Float | Level::PullUp | Level::PullDown => "floating",
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
    use crate::family::{Job, named, on_machines, unnamed};

    /// Machines with random values in their registers, each pin of which is driven: on the machine, and on a copy of the wire.
    struct Drive(&'static Chip);

    impl Job for Drive {
        type Out = ();

        fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) {
            let chip = self.0;
            let mut seen = BTreeSet::new();
            for seed in 0..60 {
                let (mut cpu, mut rng) = (power_up(seed), Rng::new(seed));
                for _ in 0..rng.below(60) {
                    let reg = &chip.regs[rng.below(chip.regs.len() as u64) as usize];
                    // No program is checked while its chip has no clock; a part that keeps a bus answers edges.
                    if reg.name != "PCON" && !["SSP", "TW"].iter().any(|part| reg.name.starts_with(part)) {
                        cpu.poke(chip.reg_space, reg.addr.into(), rng.next_u64() as u8);
                    }
                    cpu.run(cpu.cycle() + rng.below(3), &mut ());
                }
                for pin in unnamed(chip, &[]).0 {
                    let (mut machine, mut wire) = (cpu.clone(), cpu.pin(pin).expect("a pin"));
                    let now = cpu.cycle();
                    for outside in [Level::Low, Level::High, Level::PullUp, Level::Low, Level::Float, Level::PullDown] {
                        machine.drive(Time::at(now), pin, outside);
                        let (level, copied) = (machine.level(pin), driven(&mut wire, outside, now));
                        let name = chip.pins[usize::from(pin)].name;
                        assert_eq!(level, copied, "{} seed {seed}: {name} driven {outside:?}", chip.name);
                        seen.insert(format!("{outside:?} {level:?}"));
                    }
                }
            }
            let wanted = ["Low Low", "High High", "Low High", "High Low", "Float Float", "Float Low"];
            let missed: Vec<_> = wanted.iter().filter(|case| !seen.contains(**case)).collect();
            // Nothing on an 8051 drives a pin high against the outside.
            let never = chip.name == "at89s52" && missed == [&"Low High"];
            assert!(missed.is_empty() || never, "{}: {missed:?} did not occur", chip.name);
        }
    }

    /// What the probe takes a wire to do is what it does on the machine.
    #[test]
    fn a_copy_of_a_wire_behaves_as_the_wire() {
        for mcu in ["atmega328p", "atmega8", "atmega162", "at89s52", "pic16f873", "pic16f88", "pic16f628"] {
            let chip = named(mcu).expect(mcu);
            on_machines(chip, &Image::default(), chip.default_hz, Drive(chip));
        }
    }
}
