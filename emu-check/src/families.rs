//! What differs from family to family: how a machine is made, what its pacing timer can do, what stands behind its pins.
//!
//! These are the checker's own facts, by the data sheets; nothing of them comes from the compiler.

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_ap101::chips::FIRST_OUTPUT;
use emu_avr::Avr;
use emu_core::chip::{Chip, ChipFamily, PinDef};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::{PinId, PinState};
use emu_core::rng::Rng;
use emu_pic16::Pic16;
use emu_pic16::chips::{FileSlot, Pic16Part, part};

/// Time on the chips of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FamilyTiming {
    /// Oscillator clocks of a machine cycle.
    pub clocks_per_cycle: u64,
    /// Machine cycles that a tick of the pacing timer can have, finest first.
    pub tick_cycles: &'static [u64],
    /// Most ticks of one period.
    pub max_period_ticks: u128,
    /// The longest time in machine cycles from a match to the first instruction of its scan: one turn of a waiting loop that just
    /// missed the match, and the look that sees it.
    pub poll_cycles: u64,
    /// The same where a period is longer than the timer counts, 65,536 ticks, so that the loop also counts its turns.
    pub poll_cycles_with_rounds: u64,
}

/// A look at TIFR by SBIS takes one cycle, or two when it skips, and the jump back two; a TIFR out of reach of SBIS takes LDS and
/// SBRS, two cycles more. Prescalers of timer 1: DS40002061, table 16-5; they are the same on all chips of the family.
const AVR: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 1,
    tick_cycles: &[1, 8, 64, 256, 1024],
    max_period_ticks: 1 << 16,
    poll_cycles: 5,
    poll_cycles_with_rounds: 5,
};

/// JNB takes two cycles, as does SJMP; a timer counts machine cycles, and software counts its periods where one is too short: loading
/// the timer and counting down takes up to some 25 more.
const MCS51: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 12,
    tick_cycles: &[1],
    max_period_ticks: u128::MAX,
    poll_cycles: 6,
    poll_cycles_with_rounds: 32,
};

/// BTFSS takes one cycle, or two when it skips, GOTO two; the prescaler of timer 1 is 1 to 8 (DS33023, section 12.4). Where a period
/// is longer, software counts overflows: clearing the flag and two counts that skip take 5 more.
const PIC16: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 4,
    tick_cycles: &[1, 2, 4, 8],
    max_period_ticks: 1 << 16,
    poll_cycles: 6,
    poll_cycles_with_rounds: 11,
};

/// A chip whose only CCP module makes pulses: timer 1 is left, whose prescaler does not survive that its value is changed.
const PIC16_WITH_PWM: FamilyTiming = FamilyTiming { tick_cycles: &[1], max_period_ticks: u128::MAX, ..PIC16 };

/// The machine itself waits for the end of the period, and is exact.
const AP101: FamilyTiming = FamilyTiming {
    clocks_per_cycle: 2,
    tick_cycles: &[1],
    max_period_ticks: u128::MAX,
    poll_cycles: 2,
    poll_cycles_with_rounds: 2,
};

/// The facts of a chip's family, for a program that has a PWM output if `pulses`.
pub(crate) fn family_timing(chip: &Chip, pulses: bool) -> FamilyTiming {
    match chip.family {
        // SBIS reaches the I/O registers at data addresses 20h to 3Fh (DS40002061, 7.4).
        ChipFamily::Avr if chip.reg("TIFR1").or(chip.reg("TIFR")).is_some_and(|addr| addr >= 0x40) => {
            FamilyTiming { poll_cycles: 7, poll_cycles_with_rounds: 7, ..AVR }
        }
        ChipFamily::Avr => AVR,
        ChipFamily::Mcs51 => MCS51,
        ChipFamily::Pic16 if pulses && chip.reg("CCP2CON").is_none() => PIC16_WITH_PWM,
        ChipFamily::Pic16 => PIC16,
        ChipFamily::Ap101 => AP101,
    }
}

/// What stands behind a port's pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PinBehaviour {
    pub pull_up: PullUpKind,
    pub high: HighDrive,
}

/// The resistor of a pin that the chip does not drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PullUpKind {
    /// The compiler switches it on, for inputs only.
    Inputs,
    /// It is always there.
    Always,
    /// It is on or off for a whole port.
    Maybe,
    Never,
}

/// What the chip does for a high level at an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum HighDrive {
    /// It drives the pin.
    Strong,
    /// A resistor pulls it up.
    Weak,
    /// Nothing: the board has to pull it up.
    Open,
}

/// The pin of a chip; nothing where the machine has no such thing as a pin that is not driven.
pub(crate) fn pin_behaviour(chip: &Chip, pin: PinId) -> Option<PinBehaviour> {
    let def = chip.pins.get(usize::from(pin))?;
    let (pull_up, high) = match chip.family {
        ChipFamily::Avr => (PullUpKind::Inputs, HighDrive::Strong),
        ChipFamily::Mcs51 if def.name.starts_with("P0.") => (PullUpKind::Never, HighDrive::Open),
        ChipFamily::Mcs51 => (PullUpKind::Always, HighDrive::Weak),
        ChipFamily::Pic16 if def.note.contains("open drain") => (PullUpKind::Never, HighDrive::Open),
        ChipFamily::Pic16 if def.name.starts_with("RB") => (PullUpKind::Maybe, HighDrive::Strong),
        ChipFamily::Pic16 => (PullUpKind::Never, HighDrive::Strong),
        ChipFamily::Ap101 => return None,
    };
    Some(PinBehaviour { pull_up, high })
}

/// A board has to pull an output at this pin up: the chip only lets it go.
#[must_use]
pub fn needs_pull_up(chip: &Chip, pin: PinId) -> bool {
    pin_behaviour(chip, pin).is_some_and(|nature| nature.high == HighDrive::Open)
}

/// Pins that carry something else than a port, by what the chip's data say of them.
const RESERVED: [&str; 9] = ["XTAL1", "XTAL2", "RESET", "reset", "MCLR", "OSC1", "OSC2", "absent", "PEN"];

/// The pins that the program does not name: those that must not be driven by the chip, and those that a board may drive.
pub(crate) fn unnamed_pins(chip: &Chip, named: &[PinId]) -> (Vec<PinId>, Vec<PinId>) {
    let free = (0..chip.pins.len() as PinId).filter(|pin| !named.contains(pin));
    if chip.family == ChipFamily::Ap101 {
        return (Vec::new(), free.take_while(|&pin| pin < FIRST_OUTPUT).collect());
    }
    let note = |pin: PinId| chip.pins.get(usize::from(pin)).map_or("absent", |p| p.note);
    let is = |pin: PinId, what: &[&str]| note(pin).split(", ").any(|note| what.contains(&note));
    // The reset pin may have a pull-up of its own.
    let apart = ["absent", "RESET", "reset", "MCLR", "PEN", PinDef::ANALOG_INPUT_NOTE];
    let port: Vec<PinId> = free.filter(|&pin| !is(pin, &apart)).collect();
    let drivable = port.iter().copied().filter(|&pin| !is(pin, &RESERVED)).collect();
    (port, drivable)
}

/// The chip of that name that there is an emulator for.
pub(crate) fn find_chip(name: &str) -> Option<&'static Chip> {
    emu_avr::chips::chip(name).or_else(|| emu_8051::chips::chip(name)).or_else(|| emu_pic16::chips::chip(name))
}

/// A machine as a check needs it.
pub(crate) trait CheckedChip: Cpu {
    /// How deep the stack is, in a number that moves with it; nothing where there is none.
    fn stack_depth(&self) -> Option<u32>;
    /// Who drives a pin, now; nothing where the machine has no such thing as a pin that is not driven.
    fn pin_state(&self, pin: PinId) -> Option<PinState>;
}

impl CheckedChip for Avr {
    fn stack_depth(&self) -> Option<u32> {
        self.reg("sp")
    }

    fn pin_state(&self, pin: PinId) -> Option<PinState> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl CheckedChip for Mcs51 {
    fn stack_depth(&self) -> Option<u32> {
        self.reg("sp")
    }

    fn pin_state(&self, pin: PinId) -> Option<PinState> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl CheckedChip for Pic16 {
    fn stack_depth(&self) -> Option<u32> {
        Some(self.stack().1 as u32)
    }

    fn pin_state(&self, pin: PinId) -> Option<PinState> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl CheckedChip for Ap101 {
    fn stack_depth(&self) -> Option<u32> {
        None
    }

    fn pin_state(&self, _: PinId) -> Option<PinState> {
        None
    }
}

/// Something to do with a source of machines of whatever family.
pub(crate) trait MachineVisitor {
    type Output;
    /// Does it; `power_up` gives a machine fresh from power-up whose RAM is random by the seed.
    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> Self::Output;
}

/// Does `job` with machines of `chip` that have `image` in their memories and an oscillator of `hz`.
///
/// A program is decoded once: the machines are copies of one that differ in what RAM holds.
pub(crate) fn visit_machines<J: MachineVisitor>(chip: &'static Chip, image: &Image, hz: u64, job: J) -> J::Output {
    match chip.family {
        ChipFamily::Avr => {
            let mut fresh = Avr::new(chip, image, RamInit::Zero);
            fresh.set_clock_hz(hz);
            let (first, len) = (u32::from(chip.ram_start), u32::from(chip.ram_len));
            let ram: Vec<(u32, usize)> = (0..32).chain(first..first + len).zip(0..).collect();
            job.visit(move |seed| with_random_ram(&fresh, &ram, seed))
        }
        // Outside of the chip may be 64 KiB of RAM; to fill that byte by byte would take longer than to make a machine.
        ChipFamily::Mcs51 => job.visit(|seed| Mcs51::new(chip, image, RamInit::Random(seed))),
        ChipFamily::Pic16 => {
            let options = emu_pic16::Options { hz, start_up: false, ..emu_pic16::Options::default() };
            let fresh = Pic16::with(chip, image, RamInit::Zero, options);
            let places = (0..).zip(part(chip.name).map(Pic16Part::file_slots).into_iter().flatten());
            let ram: Vec<(u32, usize)> = places
                .filter_map(|(addr, place)| match place {
                    FileSlot::Ram(kept) => Some((addr, kept.into())),
                    FileSlot::Sfr(_) | FileSlot::None => None,
                })
                .collect();
            job.visit(move |seed| with_random_ram(&fresh, &ram, seed))
        }
        // A cold start clears M, so nothing of it is random.
        ChipFamily::Ap101 => job.visit(|_| Ap101::new(image)),
    }
}

/// A copy of `fresh` with random bytes in data memory: at each address of `ram` the one of that number.
fn with_random_ram<C: Cpu>(fresh: &C, ram: &[(u32, usize)], seed: u64) -> C {
    let mut cpu = fresh.clone();
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

    /// What can be read of a machine.
    fn state<C: Cpu>(cpu: &C) -> Vec<Option<u32>> {
        let bytes = ["data", "eeprom"].into_iter().flat_map(|space| (0..0x1000).map(move |addr| (space, addr)));
        let bytes = bytes.map(|(space, addr)| cpu.peek(space, addr).map(u32::from));
        bytes.chain(cpu.chip().cpu_regs.iter().map(|reg| cpu.reg(reg))).chain([Some(cpu.cycle() as u32)]).collect()
    }

    /// Machines from power-up, against those that the emulator itself makes.
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
            let chip = find_chip(mcu).expect(mcu);
            visit_machines(chip, &Image::default(), chip.default_hz, PowerUpCheck(chip, chip.default_hz));
        }
    }
}
