//! Why a chip that has halted can never go on, where it is held in reset.

use emu_core::chip::Family;
use emu_core::cpu::{Cpu, Stop};
use emu_core::pins::{Level, Time};
use emu_debug::Drive;
use emu_debug::stimulus::{Put, pin, supply_name};

/// The supply at which all chips run, in millivolts.
const ENOUGH: u32 = 5_000;

/// The reset pin of a family by its name, with the level that holds the chip and the one that lets it run.
fn reset_pin(family: Family) -> (&'static str, Level, Level) {
    match family {
        Family::Avr => ("RESET", Level::Low, Level::High),
        Family::Mcs51 => ("RST", Level::High, Level::Low),
        Family::Pic16 => ("MCLR", Level::Low, Level::High),
        Family::Ap101 => ("POWER", Level::Low, Level::High),
    }
}

/// What holds a halted chip in reset: its reset pin, or the supply that `drives` gave it last. What would happen without
/// that is tried on a copy of the machine, since only the chip knows what its configuration makes of a pin or a voltage.
pub fn held<C: Cpu>(cpu: &C, drives: &[Drive]) -> Option<String> {
    let now = Time::at(cpu.cycle());
    let (name, holds, runs) = reset_pin(cpu.chip().family);
    let held = pin(cpu.chip(), name).ok().filter(|&pin| cpu.level(pin) == holds);
    let reset = held.map(|pin| (name, pin, holds, runs));
    // Of several supplies at one moment the one given last counts.
    let supplies = drives.iter().filter_map(|drive| match drive.put {
        Put::Supply(millivolts) => Some((drive.at, millivolts)),
        _ => None,
    });
    let supply = supplies.max_by_key(|(at, _)| *at).map(|(_, millivolts)| millivolts).filter(|&given| given < ENOUGH);
    let goes_on = |with_pin: bool, with_supply: bool| {
        let mut copy = cpu.clone();
        if with_supply {
            copy.supply(now, ENOUGH);
        }
        if let Some((_, pin, _, runs)) = reset.filter(|_| with_pin) {
            copy.drive(now, pin, runs);
        }
        copy.run(cpu.cycle().saturating_add(1), &mut ()) != Stop::Halted
    };
    let by_pin =
        reset.map(|(name, _, holds, _)| format!("{name} is {}", if holds == Level::Low { "low" } else { "high" }));
    let by_supply = supply.map(|millivolts| {
        let (volts, rest) = (millivolts / 1_000, millivolts % 1_000);
        let decimals = format!(".{rest:03}");
        let name = supply_name(cpu.chip());
        format!("{name} is {volts}{} V", decimals.trim_end_matches('0').trim_end_matches('.'))
    });
    let why = match (by_pin, by_supply) {
        (Some(pin), _) if goes_on(true, false) => pin,
        (_, Some(supply)) if goes_on(false, true) => supply,
        (Some(pin), Some(supply)) if goes_on(true, true) => format!("{pin}, and {supply}"),
        _ => return None,
    };
    let how = if cpu.chip().family == Family::Ap101 { "without supply" } else { "held in reset" };
    Some(format!("{how}: {why}, and nothing ends that"))
}
