//! Chip and evaluator side by side, scan by scan, and what is compared when.

use emu_core::cpu::Stop;
use emu_core::pins::Level;
use ladder_eval::Evaluator;

use crate::family::Target;
use crate::goals::Seen;
use crate::hints::Hints;
use crate::lines::Lines;
use crate::places::{Places, Point};
use crate::report::What;
use crate::rig::{Astray, Rig};
use crate::stimulus::Step;
use crate::wiring;

/// What both sides are made of.
pub(crate) struct Bench<'a, C, F: Fn(u64) -> C> {
    /// A chip fresh from reset with its image, its RAM random by the seed.
    pub power_up: F,
    pub places: &'a Places,
    pub hints: &'a Hints,
    /// Machine cycles of the longest scan, by the compiler's reckoning.
    pub worst: u64,
    /// Rungs are timed.
    pub rungs: bool,
    /// The evaluator at power-up.
    pub eval: &'a Evaluator,
}

/// A symbol and its two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Differing {
    pub symbol: usize,
    pub expected: i32,
    pub found: i32,
}

/// The first thing that is not as it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mismatch {
    pub what: What,
    /// Machine cycle since reset.
    pub cycle: u64,
    /// What differs, for symbols and pins.
    pub differing: Vec<Differing>,
    /// In words, for the others.
    pub expected: String,
    pub found: String,
    /// Where the chip is, as a program word, when it went astray.
    pub pc: Option<u32>,
}

impl Mismatch {
    fn values(what: What, cycle: u64, differing: Vec<Differing>) -> Mismatch {
        Mismatch { what, cycle, differing, expected: String::new(), found: String::new(), pc: None }
    }

    pub(crate) fn words(what: What, cycle: u64, expected: String, found: String) -> Mismatch {
        Mismatch { what, cycle, differing: Vec::new(), expected, found, pc: None }
    }

    /// True when both are the same complaint about the same things.
    pub(crate) fn like(&self, other: &Mismatch) -> bool {
        let symbols = |m: &Mismatch| m.differing.iter().map(|d| d.symbol).collect::<Vec<_>>();
        let same_pin = self.what != What::Pin || self.expected == other.expected;
        self.what == other.what && symbols(self) == symbols(other) && same_pin
    }
}

/// A scan in which nothing differed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Agreed {
    /// Values compared.
    pub compared: u64,
    /// Machine cycles from the scan's start until the chip waits again.
    pub cycles: u64,
    /// Rungs by position, with their machine cycles, if they were timed.
    pub rungs: Vec<(usize, u64)>,
    /// What the evaluator did.
    pub seen: Seen,
}

/// Both sides, at the end of a scan (or before the first).
#[derive(Clone)]
pub(crate) struct Pair<'a, C> {
    pub rig: Rig<'a, C>,
    pub eval: Evaluator,
    places: &'a Places,
    hints: &'a Hints,
    pub lines: Lines,
    first: bool,
    worst: u64,
    /// Machine cycles from the end of a scan until the chip waits.
    tail: Option<u64>,
}

impl<'a, C: Target> Pair<'a, C> {
    /// Both sides from power-up.
    pub(crate) fn start<F: Fn(u64) -> C>(bench: &Bench<'a, C, F>, ram_seed: u64) -> Result<Self, Mismatch> {
        Pair::with_cells(bench, ram_seed, bench.places.peripherals.eeprom(ram_seed))
    }

    /// The same, with what the EEPROM holds.
    pub(crate) fn with_cells<F: Fn(u64) -> C>(
        bench: &Bench<'a, C, F>,
        ram_seed: u64,
        cells: impl IntoIterator<Item = u8>,
    ) -> Result<Self, Mismatch> {
        let (places, hints) = (bench.places, bench.hints);
        let (mut cpu, mut eval) = ((bench.power_up)(ram_seed), bench.eval.clone());
        for (addr, byte) in (0..).zip(cells) {
            cpu.poke("eeprom", addr, byte);
            eval.set_eeprom(addr as usize, byte);
        }
        let mut rig = Rig::start(cpu, places).map_err(|a| astray(&a, places))?;
        if bench.rungs {
            rig.time_rungs();
        }
        Ok(Pair {
            rig,
            eval,
            places,
            hints,
            lines: Lines::new(places, bench.worst),
            first: true,
            worst: bench.worst,
            tail: None,
        })
    }

    /// Drives the inputs, runs the chip to the next scan's start, looks whether it is punctual and as the last scan left
    /// it, and gives both sides this scan's inputs and writes.
    pub(crate) fn begin(&mut self, step: &Step) -> Result<u64, Mismatch> {
        self.rig.drive(step.inputs.iter().copied());
        self.rig.drive_spare(step.spare);
        self.lines.prepare(&mut self.rig, &self.eval, step);
        self.rig.reach_start().map_err(|a| astray(&a, self.places))?;
        let cycle = self.rig.cpu.cycle();
        let ((from, to), at) = self.rig.punctual();
        if at < from || at > to {
            let expected = format!("{from} to {to} cycles after the start of the timer");
            return Err(Mismatch::words(What::Period, cycle, expected, format!("{at}")));
        }
        if let Some((first, now)) = self.rig.stack_moved() {
            let (expected, found) = (format!("0x{first:04X}"), format!("0x{now:04X}"));
            return Err(Mismatch::words(What::Stack, cycle, expected, found));
        }
        let mut compared = 2 + self.pins()? + self.lines.arrive(&mut self.rig, &mut self.eval)?;
        if self.first {
            self.first = false;
            let all = self.hints.bits.iter().chain(&self.hints.integers).copied();
            compared += self.symbols(What::Reset, all)? + self.wiring(true)?;
        }
        step.apply(self.hints, &mut self.eval);
        for &(symbol, value) in &step.writes {
            self.places.write(&mut self.rig.cpu, symbol, value);
        }
        Ok(compared)
    }

    /// One whole scan on both sides.
    pub(crate) fn scan(&mut self, step: &Step) -> Result<Agreed, Mismatch> {
        let first = self.first;
        let mut compared = self.begin(step)?;
        let start = self.rig.cpu.cycle();
        let seen = Seen::scan(&mut self.eval);
        self.lines.evaluated(&mut self.rig, &self.eval);
        let lost = |a: Astray| astray(&a, self.places);
        // A machine that paces itself takes its inputs before the first instruction.
        if self.rig.reach_rungs().map_err(lost)? || self.places.paces_itself() {
            self.flip(step);
        }
        self.rig.reach_end().map_err(lost)?;
        compared += self.symbols(What::Symbol, 0..self.eval.symbols().len())? + self.pins()? + self.wiring(first)?;
        compared += self.lines.sent(&mut self.rig)?;
        let end = self.rig.cpu.cycle();
        let cycles = end - start + *self.tail.get_or_insert_with(|| self.rig.tail());
        if cycles > self.worst {
            let expected = format!("a scan of at most {} machine cycles, as the map says", self.worst);
            return Err(Mismatch::words(What::Bound, end, expected, format!("{cycles}")));
        }
        Ok(Agreed { compared, cycles, rungs: self.rig.rung_times().collect(), seen })
    }

    /// The inputs change once they must have been latched.
    pub(crate) fn flip(&mut self, step: &Step) {
        if !step.flips.is_empty() {
            self.rig.drive_late(step.inputs.iter().zip(&step.flips).map(|(level, flip)| level ^ flip));
        }
    }

    fn symbols(&self, what: What, symbols: impl Iterator<Item = usize>) -> Result<u64, Mismatch> {
        let mut compared = 0;
        let mut differing = Vec::new();
        for symbol in symbols {
            let (expected, found) = (self.eval.get(symbol), self.places.read(&self.rig.cpu, symbol));
            compared += 1;
            if expected != found {
                differing.push(Differing { symbol, expected, found });
            }
        }
        if differing.is_empty() { Ok(compared) } else { Err(Mismatch::values(what, self.rig.cpu.cycle(), differing)) }
    }

    /// What the chip does with its pins when nothing outside drives them. What answers an edge is switched on by the code
    /// before the first scan, or in it, so the whole machine is driven around that one.
    fn wiring(&self, whole: bool) -> Result<u64, Mismatch> {
        wiring::probe(&self.rig.cpu, self.places, whole)
            .map_err(|(expected, found)| Mismatch::words(What::Pin, self.rig.cpu.cycle(), expected, found))
    }

    /// Output pins against the outputs as the evaluator has them now.
    fn pins(&self) -> Result<u64, Mismatch> {
        let mut differing = Vec::new();
        for &(symbol, pin) in &self.places.outputs {
            let expected = self.eval.get(symbol);
            let level = self.rig.cpu.level(pin);
            if level != Level::of(expected != 0) {
                let found = match level {
                    Level::Low => 0,
                    Level::High => 1,
                    Level::Float | Level::PullUp | Level::PullDown => FLOATS,
                };
                differing.push(Differing { symbol, expected, found });
            }
        }
        let compared = self.places.outputs.len() as u64;
        if differing.is_empty() {
            Ok(compared)
        } else {
            Err(Mismatch::values(What::Pin, self.rig.cpu.cycle(), differing))
        }
    }
}

/// Stands for the level of a pin that nothing drives.
pub(crate) const FLOATS: i32 = 2;

fn astray(astray: &Astray, places: &Places) -> Mismatch {
    let byte = |pc: u32| pc * places.word_bytes;
    let name = |point: Point| match point {
        Point::TimerStart => "the start of the timer",
        Point::ScanStart => "the start of the scan",
        Point::FirstRung => "the first rung",
        Point::ScanEnd => "the end of the scan",
    };
    let at = |pc: u32| format!("0x{:04X}", byte(pc));
    let wanted = places.pc(astray.wanted).map_or_else(String::new, |pc| format!(" at {}", at(pc)));
    let points = [Point::TimerStart, Point::ScanStart, Point::FirstRung, Point::ScanEnd];
    let found = match astray.stop {
        Stop::Limit => format!("no sign of it for several periods, the program is at {}", at(astray.pc)),
        Stop::Halted => format!("the chip has halted at {}", at(astray.pc)),
        Stop::Illegal { pc, word } => format!("0x{word:04X} at {} is no instruction", at(pc)),
        Stop::Fault { pc, fault } => format!("{fault}, at {}", at(pc)),
        Stop::Trap { pc } => {
            let point = points.into_iter().find(|p| places.pc(*p) == Some(pc)).map_or("a trap", name);
            format!("{point}, at {}", at(pc))
        }
        Stop::Probe => "a stop that nobody asked for".to_owned(),
    };
    let mut mismatch = Mismatch::words(What::Stop, astray.cycle, format!("{}{wanted}", name(astray.wanted)), found);
    mismatch.pc = Some(astray.pc);
    mismatch
}

/// Runs a row of steps from reset; gives the first mismatch and its scan, from 1. Scan 1 also stands for what goes wrong
/// before it.
pub(crate) fn replay<'a, C: Target, F: Fn(u64) -> C>(
    bench: &Bench<'a, C, F>,
    ram_seed: u64,
    steps: &[Step],
) -> Option<(usize, Mismatch)> {
    let mut pair = match Pair::start(bench, ram_seed) {
        Ok(pair) => pair,
        Err(mismatch) => return Some((1, mismatch)),
    };
    steps.iter().zip(1..).find_map(|(step, scan)| pair.scan(step).err().map(|mismatch| (scan, mismatch)))
}
