//! What the chip does with its pins by itself: pull-ups at inputs, strength behind outputs, and nothing elsewhere.

use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};

use crate::family::{High, Nature, PullUp};
use crate::places::Places;

/// Takes `cpu`, a copy, off its board and looks at every pin. Gives the number of pins, or what should be and what is.
///
/// An input reads what it is driven to, and high by its pull-up, where it has one, when left alone; an output holds
/// against the opposite level, as far as the chip drives it; a pin without a name is not driven.
pub(crate) fn probe<C: Cpu>(mut cpu: C, places: &Places) -> Result<u64, (String, String)> {
    let mut with = |pin: PinId, outside: Level| {
        cpu.drive(Time::at(cpu.cycle()), pin, outside);
        (cpu.level(pin), places.pin_name(pin))
    };
    let mut looked = 0;
    for &pin in &places.inputs {
        let Some(Nature { pull_up, .. }) = places.nature(pin) else { continue };
        looked += 1;
        let (level, name) = with(pin, Level::Low);
        if level != Level::Low {
            return Err((format!("the input {name} low when it is driven low"), words(level)));
        }
        let (level, _) = with(pin, Level::High);
        if level != Level::High {
            return Err((format!("the input {name} high when it is driven high"), words(level)));
        }
        with(pin, Level::Low);
        let (level, _) = with(pin, Level::Float);
        if level != Level::High && matches!(pull_up, PullUp::Inputs | PullUp::Always) {
            return Err((format!("the input {name} high by its pull-up when nothing drives it"), words(level)));
        }
    }
    for &(_, pin) in &places.outputs {
        let Some(Nature { high, .. }) = places.nature(pin) else { continue };
        looked += 1;
        let open = high == High::Open;
        let (before, name) = with(pin, if open { Level::PullUp } else { Level::Float });
        let against = if before == Level::High { Level::Low } else { Level::High };
        let (level, _) = with(pin, against);
        let gives = before == Level::High && high != High::Strong;
        if level != before && !gives {
            return Err((format!("the output {name} driven"), format!("{} when driven from outside", words(level))));
        }
    }
    for &pin in &places.unnamed {
        let Some(Nature { pull_up, .. }) = places.nature(pin) else { continue };
        looked += 1;
        with(pin, Level::Low);
        let (level, name) = with(pin, Level::Float);
        let floats = match pull_up {
            PullUp::Inputs | PullUp::Never => level == Level::Float,
            PullUp::Always => level == Level::High,
            PullUp::Maybe => level != Level::Low,
        };
        if !floats {
            return Err((format!("{name} floating, for the program does not name it"), words(level)));
        }
        for outside in [Level::Low, Level::High] {
            let (level, _) = with(pin, outside);
            if level != outside {
                let found = format!("{} when driven {}", words(level), words(outside));
                return Err((format!("{name} floating, for the program does not name it"), found));
            }
        }
    }
    Ok(looked)
}

fn words(level: Level) -> String {
    match level {
        Level::Low => "low",
        Level::High => "high",
        Level::Float | Level::PullUp | Level::PullDown => "floating",
    }
    .to_owned()
}
