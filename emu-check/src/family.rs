//! What differs from family to family: how a machine is made, what its pacing timer can do, what stands behind its pins.
//!
//! These are the checker's own facts, by the data sheets; nothing of them comes from the compiler.

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_ap101::chips::FIRST_OUTPUT;
use emu_avr::Avr;
use emu_core::chip::{Chip, Family, PinDef};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_core::pins::{Pin, PinId};
use emu_core::rng::Rng;
use emu_pic16::Pic16;
use emu_pic16::chips::{Part, Place, part};

/// Time on the chips of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Facts {
    /// Oscillator clocks of a machine cycle.
    pub clocks: u64,
    /// Machine cycles that a tick of the pacing timer can have, finest first.
    pub ticks: &'static [u64],
    /// Most ticks of one period.
    pub most_ticks: u128,
    /// The longest time in machine cycles from a match to the first instruction of its scan: one turn of a waiting loop that just
    /// missed the match, and the look that sees it.
    pub poll: u64,
    /// The same where a period is longer than the timer counts, 65,536 ticks, so that the loop also counts its turns.
    pub poll_turns: u64,
}

/// A look at TIFR by SBIS takes one cycle, or two when it skips, and the jump back two; a TIFR out of reach of SBIS takes LDS and
/// SBRS, two cycles more. Prescalers of timer 1: DS40002061, table 16-5; they are the same on all chips of the family.
const AVR: Facts = Facts { clocks: 1, ticks: &[1, 8, 64, 256, 1024], most_ticks: 1 << 16, poll: 5, poll_turns: 5 };

/// JNB takes two cycles, as does SJMP; a timer counts machine cycles, and software counts its periods where one is too short: loading
/// the timer and counting down takes up to some 25 more.
const MCS51: Facts = Facts { clocks: 12, ticks: &[1], most_ticks: u128::MAX, poll: 6, poll_turns: 32 };

/// BTFSS takes one cycle, or two when it skips, GOTO two; the prescaler of timer 1 is 1 to 8 (DS33023, section 12.4). Where a period
/// is longer, software counts overflows: clearing the flag and two counts that skip take 5 more.
const PIC16: Facts = Facts { clocks: 4, ticks: &[1, 2, 4, 8], most_ticks: 1 << 16, poll: 6, poll_turns: 11 };

/// A chip whose only CCP module makes pulses: timer 1 is left, whose prescaler does not survive that its value is changed.
const PIC16_PULSES: Facts = Facts { ticks: &[1], most_ticks: u128::MAX, ..PIC16 };

/// The machine itself waits for the end of the period, and is exact.
const AP101: Facts = Facts { clocks: 2, ticks: &[1], most_ticks: u128::MAX, poll: 2, poll_turns: 2 };

/// The facts of a chip's family, for a program that has a PWM output if `pulses`.
pub(crate) fn facts(chip: &Chip, pulses: bool) -> Facts {
    match chip.family {
        // SBIS reaches the I/O registers at data addresses 20h to 3Fh (DS40002061, 7.4).
        Family::Avr if chip.reg("TIFR1").or(chip.reg("TIFR")).is_some_and(|addr| addr >= 0x40) => {
            Facts { poll: 7, poll_turns: 7, ..AVR }
        }
        Family::Avr => AVR,
        Family::Mcs51 => MCS51,
        Family::Pic16 if pulses && chip.reg("CCP2CON").is_none() => PIC16_PULSES,
        Family::Pic16 => PIC16,
        Family::Ap101 => AP101,
    }
}

/// What stands behind a port's pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Nature {
    pub pull_up: PullUp,
    pub high: High,
}

/// The resistor of a pin that the chip does not drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PullUp {
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
pub(crate) enum High {
    /// It drives the pin.
    Strong,
    /// A resistor pulls it up.
    Weak,
    /// Nothing: the board has to pull it up.
    Open,
}

/// The pin of a chip; nothing where the machine has no such thing as a pin that is not driven.
pub(crate) fn nature(chip: &Chip, pin: PinId) -> Option<Nature> {
    let def = chip.pins.get(usize::from(pin))?;
    let (pull_up, high) = match chip.family {
        Family::Avr => (PullUp::Inputs, High::Strong),
        Family::Mcs51 if def.name.starts_with("P0.") => (PullUp::Never, High::Open),
        Family::Mcs51 => (PullUp::Always, High::Weak),
        Family::Pic16 if def.note.contains("open drain") => (PullUp::Never, High::Open),
        Family::Pic16 if def.name.starts_with("RB") => (PullUp::Maybe, High::Strong),
        Family::Pic16 => (PullUp::Never, High::Strong),
        Family::Ap101 => return None,
    };
    Some(Nature { pull_up, high })
}

/// A board has to pull an output at this pin up: the chip only lets it go.
#[must_use]
pub fn needs_pull_up(chip: &Chip, pin: PinId) -> bool {
    nature(chip, pin).is_some_and(|nature| nature.high == High::Open)
}

/// Pins that carry something else than a port, by what the chip's data say of them.
const RESERVED: [&str; 9] = ["XTAL1", "XTAL2", "RESET", "reset", "MCLR", "OSC1", "OSC2", "absent", "PEN"];

/// The pins that the program does not name: those that must not be driven by the chip, and those that a board may drive.
pub(crate) fn unnamed(chip: &Chip, named: &[PinId]) -> (Vec<PinId>, Vec<PinId>) {
    let free = (0..chip.pins.len() as PinId).filter(|pin| !named.contains(pin));
    if chip.family == Family::Ap101 {
        return (Vec::new(), free.take_while(|&pin| pin < FIRST_OUTPUT).collect());
    }
    let note = |pin: PinId| chip.pins.get(usize::from(pin)).map_or("absent", |p| p.note);
    let is = |pin: PinId, what: &[&str]| note(pin).split(", ").any(|note| what.contains(&note));
    // The reset pin may have a pull-up of its own.
    let apart = ["absent", "RESET", "reset", "MCLR", "PEN", PinDef::ANALOG];
    let port: Vec<PinId> = free.filter(|&pin| !is(pin, &apart)).collect();
    let drivable = port.iter().copied().filter(|&pin| !is(pin, &RESERVED)).collect();
    (port, drivable)
}

/// The chip of that name that there is an emulator for.
pub(crate) fn named(name: &str) -> Option<&'static Chip> {
    emu_avr::chips::chip(name).or_else(|| emu_8051::chips::chip(name)).or_else(|| emu_pic16::chips::chip(name))
}

/// A machine as a check needs it.
pub(crate) trait Target: Cpu {
    /// How deep the stack is, in a number that moves with it; nothing where there is none.
    fn depth(&self) -> Option<u32>;
    /// Who drives a pin, now; nothing where the machine has no such thing as a pin that is not driven.
    fn pin(&self, pin: PinId) -> Option<Pin>;
}

impl Target for Avr {
    fn depth(&self) -> Option<u32> {
        self.reg("sp")
    }

    fn pin(&self, pin: PinId) -> Option<Pin> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl Target for Mcs51 {
    fn depth(&self) -> Option<u32> {
        self.reg("sp")
    }

    fn pin(&self, pin: PinId) -> Option<Pin> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl Target for Pic16 {
    fn depth(&self) -> Option<u32> {
        Some(self.stack().1 as u32)
    }

    fn pin(&self, pin: PinId) -> Option<Pin> {
        self.soc().pins().get(usize::from(pin)).copied()
    }
}

impl Target for Ap101 {
    fn depth(&self) -> Option<u32> {
        None
    }

    fn pin(&self, _: PinId) -> Option<Pin> {
        None
    }
}

/// Something to do with a source of machines of whatever family.
pub(crate) trait Job {
    type Out;
    /// Does it; `power_up` gives a machine fresh from power-up whose RAM is random by the seed.
    fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) -> Self::Out;
}

/// Does `job` with machines of `chip` that have `image` in their memories and an oscillator of `hz`.
///
/// A program is decoded once: the machines are copies of one that differ in what RAM holds.
pub(crate) fn on_machines<J: Job>(chip: &'static Chip, image: &Image, hz: u64, job: J) -> J::Out {
    match chip.family {
        Family::Avr => {
            let mut fresh = Avr::new(chip, image, RamInit::Zero);
            fresh.set_clock_hz(hz);
            let (first, len) = (u32::from(chip.ram_start), u32::from(chip.ram_len));
            let ram: Vec<(u32, usize)> = (0..32).chain(first..first + len).zip(0..).collect();
            job.on(move |seed| filled(&fresh, &ram, seed))
        }
        // Outside of the chip may be 64 KiB of RAM; to fill that byte by byte would take longer than to make a machine.
        Family::Mcs51 => job.on(|seed| Mcs51::new(chip, image, RamInit::Random(seed))),
        Family::Pic16 => {
            let options = emu_pic16::Options { hz, start_up: false, ..emu_pic16::Options::default() };
            let fresh = Pic16::with(chip, image, RamInit::Zero, options);
            let places = (0..).zip(part(chip.name).map(Part::places).into_iter().flatten());
            let ram: Vec<(u32, usize)> = places
                .filter_map(|(addr, place)| match place {
                    Place::Ram(kept) => Some((addr, kept.into())),
                    Place::Sfr(_) | Place::None => None,
                })
                .collect();
            job.on(move |seed| filled(&fresh, &ram, seed))
        }
        // A cold start clears M, so nothing of it is random.
        Family::Ap101 => job.on(|_| Ap101::new(image)),
    }
}

/// A copy of `fresh` with random bytes in data memory: at each address of `ram` the one of that number.
fn filled<C: Cpu>(fresh: &C, ram: &[(u32, usize)], seed: u64) -> C {
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
    struct Fresh(&'static Chip, u64);

    impl Job for Fresh {
        type Out = ();

        fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) {
            let Fresh(chip, hz) = self;
            let (image, start_up) = (Image::default(), false);
            for seed in [1, 7, u64::MAX] {
                let wanted = match chip.family {
                    Family::Avr => state(&Avr::new(chip, &image, RamInit::Random(seed))),
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
            let chip = named(mcu).expect(mcu);
            on_machines(chip, &Image::default(), chip.default_hz, Fresh(chip, chip.default_hz));
        }
    }
}
