//! What the outside does to the pins, and when.

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};

use crate::time::Clock;

/// A pin is driven to a level, or let go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Drive {
    /// Machine cycle.
    pub at: u64,
    /// Which pin.
    pub pin: PinId,
    /// Its level from then on; `Float` lets it go.
    pub level: Level,
}

/// `PB0=1`, `PB0=0` or `PB0=z` (let go), case aside.
///
/// # Errors
/// No such pin or level.
pub fn pin_level(chip: &Chip, text: &str) -> Result<(PinId, Level), String> {
    let Some((name, level)) = text.split_once('=') else {
        let pin = example_pin(chip, 0);
        return Err(format!("`{text}` gives no level; write {pin}=1, {pin}=0 or {pin}=z"));
    };
    let name = name.trim();
    let pin = chip.pin(name).filter(|&pin| present(chip, pin));
    let pin = pin.ok_or_else(|| {
        let names: Vec<&str> = chip.pins.iter().filter(|p| p.dip != 0).map(|p| p.name).collect();
        format!("{} has no pin `{name}`; its pins are {}", chip.name, names.join(" "))
    })?;
    let level = match level.trim() {
        "0" => Level::Low,
        "1" => Level::High,
        "z" | "Z" => Level::Float,
        other => return Err(format!("`{other}` is no level of a pin; write 0, 1 or z")),
    };
    Ok((pin, level))
}

/// `10ms:PB0=0`: a time as in [`Clock::cycles`] and a level as in [`pin_level`].
///
/// # Errors
/// As those.
pub fn drive(chip: &Chip, clock: Clock, text: &str) -> Result<Drive, String> {
    let Some((time, rest)) = text.split_once(':') else {
        return Err(format!("`{text}` gives no time; write 10ms:{}=0", example_pin(chip, 0)));
    };
    let at = clock.cycles(time)?;
    let (pin, level) = pin_level(chip, rest)?;
    Ok(Drive { at, pin, level })
}

/// Queues the drives, in order of time; of two at one time the one given last wins.
pub fn queue<C: Cpu>(cpu: &mut C, drives: &[Drive]) {
    let mut sorted = drives.to_vec();
    sorted.sort_by_key(|d| d.at);
    for drive in sorted {
        cpu.drive(Time::at(drive.at), drive.pin, drive.level);
    }
}

/// The name of the pin at position `n` of those that the package has, for messages.
#[must_use]
pub fn example_pin(chip: &Chip, n: usize) -> &'static str {
    chip.pins.iter().filter(|p| p.dip != 0).nth(n).map_or("PIN", |p| p.name)
}

/// The package has the pin.
#[must_use]
pub fn present(chip: &Chip, pin: PinId) -> bool {
    chip.pins.get(usize::from(pin)).is_some_and(|p| p.dip != 0)
}
