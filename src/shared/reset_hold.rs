//! Explains why a halted chip never continues when it is held in reset.

use emu_core::cpu::{Cpu, StopReason};
use emu_core::pins::{CycleTime, PinLevel};
use emu_debug::TimedDrive;
use emu_debug::stimulus::{ExternalDrive, find_pin, supply_name};

/// A supply at which all chips run, in millivolts.
const SUFFICIENT_SUPPLY_MV: u32 = 5_000;

/// Returns what holds a halted chip in reset: its reset pin, or the last supply in `drives`. A copy of the
/// machine is run without that cause, because only the chip knows how its configuration treats a pin or a
/// voltage.
pub fn reset_hold<C: Cpu>(cpu: &C, drives: &[TimedDrive]) -> Option<String> {
    let now = CycleTime::at(cpu.cycle());
    let (name, holds) = cpu.chip().family_traits().reset_pin;
    let runs = if holds == PinLevel::Low { PinLevel::High } else { PinLevel::Low };
    let reset_pin_held = find_pin(cpu.chip(), name).ok().filter(|&pin| cpu.pin_level(pin) == holds);
    let reset = reset_pin_held.map(|pin| (name, pin, holds, runs));
    // If several drives of the supply have the same time, the last one counts.
    let supplies = drives.iter().filter_map(|drive| match drive.drive {
        ExternalDrive::Supply(millivolts) => Some((drive.at, millivolts)),
        _ => None,
    });
    let supply = supplies
        .max_by_key(|(at, _)| *at)
        .map(|(_, millivolts)| millivolts)
        .filter(|&given| given < SUFFICIENT_SUPPLY_MV);
    let goes_on = |with_pin: bool, with_supply: bool| {
        let mut copy = cpu.clone();
        if with_supply {
            copy.set_supply(now, SUFFICIENT_SUPPLY_MV);
        }
        if let Some((_, pin, _, runs)) = reset.filter(|_| with_pin) {
            copy.drive(now, pin, runs);
        }
        copy.run(cpu.cycle().saturating_add(1), &mut ()) != StopReason::Halted
    };
    let by_pin =
        reset.map(|(name, _, holds, _)| format!("{name} is {}", if holds == PinLevel::Low { "low" } else { "high" }));
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
    let how = cpu.chip().family_traits().reset_state;
    Some(format!("{how}: {why}, and nothing ends that"))
}
