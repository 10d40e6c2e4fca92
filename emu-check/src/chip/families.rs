//! Facts of each chip family that a check needs: how a machine is made, the limits of its pacing timer, and
//! the electrical behaviour of its pins.
//!
//! These facts are the checker's own, from the data sheets; none of them comes from the compiler.

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_ap101::chips::FIRST_OUTPUT;
use emu_avr::Avr;
use emu_core::chip::{Chip, ChipFamily, PinDef};
use emu_core::cpu::{Bus, Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::{PinId, PinState};
use emu_core::rng::Rng;
use emu_pic16::Pic16;
use emu_pic16::chips::{FileSlot, Pic16Part, part};

/// Timing facts of a chip family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FamilyTiming {
    /// Oscillator clocks per machine cycle.
    pub clocks_per_cycle: u64,
    /// Machine cycles per tick that the pacing timer can have, smallest first.
    pub tick_cycles: &'static [u64],
    /// Maximum number of timer ticks per period.
    pub max_period_ticks: u128,
    /// Maximum machine cycles from a timer match to the first instruction of its scan: one iteration of a
    /// polling loop that just missed the match, plus the poll that sees it.
    pub poll_cycles: u64,
    /// [`FamilyTiming::poll_cycles`] of a period longer than the 65,536 ticks of the timer: the polling loop
    /// then also counts overflows of the timer.
    pub poll_cycles_with_rounds: u64,
}

/// AVR: polling TIFR with SBIS takes one cycle, or two when it skips; the jump back takes two. A TIFR out of
/// reach of SBIS needs LDS and SBRS, two cycles more. Prescalers of timer 1: DS40002061, table 16-5; they are
/// equal on all chips of the family.
const AVR: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 1,
    tick_cycles: &[1, 8, 64, 256, 1024],
    max_period_ticks: 1 << 16,
    poll_cycles: 5,
    poll_cycles_with_rounds: 5,
};

/// 8051: JNB and SJMP take two cycles each. A timer counts machine cycles; where its range is too short,
/// software counts its rounds, and reloading the timer and counting down takes up to about 25 cycles more.
const MCS51: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 12,
    tick_cycles: &[1],
    max_period_ticks: u128::MAX,
    poll_cycles: 6,
    poll_cycles_with_rounds: 32,
};

/// PIC16: BTFSS takes one cycle, or two when it skips; GOTO takes two. The prescaler of timer 1 is 1 to 8
/// (DS33023, section 12.4). For a longer period software counts overflows: clearing the flag and two skipping
/// counts take 5 cycles more.
const PIC16: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 4,
    tick_cycles: &[1, 2, 4, 8],
    max_period_ticks: 1 << 16,
    poll_cycles: 6,
    poll_cycles_with_rounds: 11,
};

/// PIC16 chips whose first CCP module generates the PWM output: only timer 1 is left, and its prescaler is
/// lost when the timer's value is changed.
const PIC16_WITH_PWM: FamilyTiming = FamilyTiming { tick_cycles: &[1], max_period_ticks: u128::MAX, ..PIC16 };

/// AP101: the machine itself waits for the end of the period, with the exact number of cycles.
const AP101: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 2,
    tick_cycles: &[1],
    max_period_ticks: u128::MAX,
    poll_cycles: 2,
    poll_cycles_with_rounds: 2,
};

/// The timing facts of a chip; `uses_first_ccp` is true for a program with a PWM output at the CCP
/// module that otherwise paces the scans of a PIC16.
pub(crate) fn family_timing(chip: &Chip, uses_first_ccp: bool) -> FamilyTiming {
    match chip.family {
        // SBIS reaches the I/O registers at data addresses 20h to 3Fh (DS40002061, 7.4).
        ChipFamily::Avr if chip.reg("TIFR1").or(chip.reg("TIFR")).is_some_and(|addr| addr >= 0x40) => {
            FamilyTiming { poll_cycles: 7, poll_cycles_with_rounds: 7, ..AVR }
        }
        ChipFamily::Avr => AVR,
        ChipFamily::Mcs51 => MCS51,
        ChipFamily::Pic16 if uses_first_ccp => PIC16_WITH_PWM,
        ChipFamily::Pic16 => PIC16,
        ChipFamily::Ap101 => AP101,
    }
}

/// Electrical behaviour of a port pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PinBehaviour {
    /// The pull-up resistor of the pin.
    pub pull_up: PullUpKind,
    /// How the chip outputs a high level.
    pub high: HighDrive,
}

/// The pull-up resistor of a pin that the chip does not drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PullUpKind {
    /// The compiler enables it, for inputs only.
    Inputs,
    /// It is always present.
    Always,
    /// It is enabled or disabled for a whole port, so that it may be present.
    PerPort,
    Never,
}

/// How the chip outputs a high level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HighDrive {
    /// It drives the pin.
    Strong,
    /// A pull-up resistor of the chip pulls the pin high.
    Weak,
    /// The chip does not drive the pin; the board has to pull it up.
    Open,
}

/// The behaviour of a pin; `None` on a machine whose pins are always driven.
pub(crate) fn pin_behaviour(chip: &Chip, pin: PinId) -> Option<PinBehaviour> {
    let def = chip.pins.get(usize::from(pin))?;
    let (pull_up, high) = match chip.family {
        ChipFamily::Avr => (PullUpKind::Inputs, HighDrive::Strong),
        ChipFamily::Mcs51 if def.name.starts_with("P0.") => (PullUpKind::Never, HighDrive::Open),
        ChipFamily::Mcs51 => (PullUpKind::Always, HighDrive::Weak),
        ChipFamily::Pic16 if def.note.contains("open drain") => (PullUpKind::Never, HighDrive::Open),
        ChipFamily::Pic16 if def.name.starts_with("RB") => (PullUpKind::PerPort, HighDrive::Strong),
        ChipFamily::Pic16 => (PullUpKind::Never, HighDrive::Strong),
        ChipFamily::Ap101 => return None,
    };
    Some(PinBehaviour { pull_up, high })
}

/// Returns true if an output at this pin needs a pull-up on the board: the chip has no driver for a high
/// level.
#[must_use]
pub fn needs_pull_up(chip: &Chip, pin: PinId) -> bool {
    pin_behaviour(chip, pin).is_some_and(|behaviour| behaviour.high == HighDrive::Open)
}

/// Functions other than a port, as named in the notes of the chip's pins.
const RESERVED: [&str; 9] = ["XTAL1", "XTAL2", "RESET", "reset", "MCLR", "OSC1", "OSC2", "absent", "PEN"];

/// The pins that a program does not name.
pub(crate) struct UnnamedPins {
    /// Pins that the chip must not drive.
    pub undriven: Vec<PinId>,
    /// Pins that a board may drive.
    pub drivable: Vec<PinId>,
}

/// The pins of a chip that are not among `named`.
pub(crate) fn unnamed_pins(chip: &Chip, named: &[PinId]) -> UnnamedPins {
    let free = (0..chip.pins.len() as PinId).filter(|pin| !named.contains(pin));
    if chip.family == ChipFamily::Ap101 {
        let drivable = free.take_while(|&pin| pin < FIRST_OUTPUT).collect();
        return UnnamedPins { undriven: Vec::new(), drivable };
    }
    let note = |pin: PinId| chip.pins.get(usize::from(pin)).map_or("absent", |p| p.note);
    let has_function = |pin: PinId, what: &[&str]| note(pin).split(", ").any(|note| what.contains(&note));
    // Pins to leave out; the reset pin may have a pull-up of its own.
    let excluded = ["absent", "RESET", "reset", "MCLR", "PEN", PinDef::ANALOG_INPUT_NOTE];
    let undriven: Vec<PinId> = free.filter(|&pin| !has_function(pin, &excluded)).collect();
    let drivable = undriven.iter().copied().filter(|&pin| !has_function(pin, &RESERVED)).collect();
    UnnamedPins { undriven, drivable }
}

/// Returns the AVR, 8051 or PIC16 chip of this name. AP101 is left out: callers look for chips that have
/// foreign images, or pins by package.
pub(crate) fn find_chip_with_package(name: &str) -> Option<&'static Chip> {
    emu_avr::chips::chip(name).or_else(|| emu_8051::chips::chip(name)).or_else(|| emu_pic16::chips::chip(name))
}

/// What a check needs of a machine in addition to [`Cpu`].
pub(crate) trait CheckedChip: Cpu {
    /// Returns the stack pointer (on a PIC16 the stack position); `None` on a machine without a stack. At the
    /// same depth of the stack it has the same value.
    fn stack_pointer(&self) -> Option<u32>;
    /// Who drives a pin now; `None` on a machine whose pins are always driven.
    fn pin_state(&self, pin: PinId) -> Option<PinState> {
        self.bus().pins().get(usize::from(pin)).copied()
    }
}

impl CheckedChip for Avr {
    fn stack_pointer(&self) -> Option<u32> {
        self.reg("sp")
    }
}

impl CheckedChip for Mcs51 {
    fn stack_pointer(&self) -> Option<u32> {
        self.reg("sp")
    }
}

impl CheckedChip for Pic16 {
    fn stack_pointer(&self) -> Option<u32> {
        Some(self.stack().next as u32)
    }
}

impl CheckedChip for Ap101 {
    fn stack_pointer(&self) -> Option<u32> {
        None
    }
}

/// An action that is generic over the type of the machine.
pub(crate) trait MachineVisitor {
    type Output;
    /// Runs the action; `power_up` makes a machine in its power-up state, with RAM contents from the given
    /// seed.
    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> Self::Output;
}

/// Runs `job` with machines of `chip` that have `image` in their memories and an oscillator of `hz` Hz.
///
/// The program is decoded only once where possible: machines are copies of one machine, with different RAM
/// contents.
pub(crate) fn visit_machines<J: MachineVisitor>(chip: &'static Chip, image: &Image, hz: u64, job: J) -> J::Output {
    match chip.family {
        ChipFamily::Avr => {
            let mut template = Avr::new(chip, image, RamInit::Zero);
            template.set_clock_hz(hz);
            let (first, len) = (u32::from(chip.ram_start), u32::from(chip.ram_len));
            let ram: Vec<(u32, usize)> = (0..32).chain(first..first + len).zip(0..).collect();
            job.visit(move |seed| with_random_ram(&template, &ram, seed))
        }
        // An 8051 may have 64 KiB of external RAM; filling it byte by byte takes longer than making a new
        // machine.
        ChipFamily::Mcs51 => job.visit(|seed| Mcs51::new(chip, image, RamInit::Random(seed))),
        ChipFamily::Pic16 => {
            let options = emu_pic16::Options { hz, start_up: false, ..emu_pic16::Options::default() };
            let template = Pic16::with(chip, image, RamInit::Zero, options);
            let places = (0..).zip(part(chip.name).map(Pic16Part::file_slots).into_iter().flatten());
            let ram: Vec<(u32, usize)> = places
                .filter_map(|(addr, place)| match place {
                    FileSlot::Ram(canonical) => Some((addr, canonical.into())),
                    FileSlot::Sfr(_) | FileSlot::None => None,
                })
                .collect();
            job.visit(move |seed| with_random_ram(&template, &ram, seed))
        }
        // A cold start clears the memory M, so nothing is random.
        ChipFamily::Ap101 => job.visit(|_| Ap101::new(image)),
    }
}

/// A copy of `template` with random bytes in data memory. Each entry of `ram` is an address and the index of
/// its random byte.
fn with_random_ram<C: Cpu>(template: &C, ram: &[(u32, usize)], seed: u64) -> C {
    let mut cpu = template.clone();
    let mut bytes = vec![0; ram.iter().map(|(_, n)| n + 1).max().unwrap_or(0)];
    Rng::new(seed).fill(&mut bytes);
    for &(addr, n) in ram {
        cpu.poke("data", addr, bytes.get(n).copied().unwrap_or(0));
    }
    cpu
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All state of a machine that can be read.
    fn state<C: Cpu>(cpu: &C) -> Vec<Option<u32>> {
        let bytes = ["data", "eeprom"].into_iter().flat_map(|space| (0..0x1000).map(move |addr| (space, addr)));
        let bytes = bytes.map(|(space, addr)| cpu.peek(space, addr).map(u32::from));
        bytes.chain(cpu.chip().cpu_regs.iter().map(|reg| cpu.reg(reg))).chain([Some(cpu.cycle() as u32)]).collect()
    }

    /// Compares power-up machines with those that the emulator itself makes.
    struct PowerUpCheck(&'static Chip, u64);

    impl MachineVisitor for PowerUpCheck {
        type Output = ();

        fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) {
            let PowerUpCheck(chip, hz) = self;
            let (image, start_up) = (Image::default(), false);
            for seed in [1, 7, u64::MAX] {
                let wanted = match chip.family {
                    ChipFamily::Avr => state(&Avr::new(chip, &image, RamInit::Random(seed))),
                    _ => {
                        let options = emu_pic16::Options { hz, start_up, ..emu_pic16::Options::default() };
                        state(&Pic16::with(chip, &image, RamInit::Random(seed), options))
                    }
                };
                assert_eq!(state(&power_up(seed)), wanted, "{} with seed {seed}", chip.name);
            }
        }
    }

    #[test]
    fn a_copy_with_its_own_ram_is_as_from_power_up() {
        for mcu in ["atmega328p", "atmega8", "atmega128", "pic16f873", "pic16f877a", "pic16f628", "pic16f84a"] {
            let chip = find_chip_with_package(mcu).expect(mcu);
            visit_machines(chip, &Image::default(), chip.default_hz, PowerUpCheck(chip, chip.default_hz));
        }
    }
}
