//! The chip on the bench: run from one moment of a scan to the next, with its pins wired.

use emu_core::cpu::{Cpu, Stop};
use emu_core::pins::{Level, Time};

use crate::places::{Places, Point};

/// Cycles allowed from reset to the start of the timer, on top of some periods.
const RESET: u64 = 200_000;

/// Periods allowed from one moment of a scan to the next.
const PERIODS: u64 = 3;

/// The chip did not get where it should.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Astray {
    pub wanted: Point,
    pub stop: Stop,
    pub cycle: u64,
    /// Where it is, as a program word.
    pub pc: u32,
}

/// A chip and its places.
#[derive(Debug, Clone)]
pub(crate) struct Rig<'a, C> {
    pub cpu: C,
    pub places: &'a Places,
    /// Machine cycle at which the timer was started.
    started: u64,
    /// Scans started.
    scans: u64,
    stack: Option<u32>,
}

impl<'a, C: Cpu> Rig<'a, C> {
    /// A chip fresh from reset, run until its timer has started.
    pub fn start(mut cpu: C, places: &'a Places) -> Result<Self, Astray> {
        for point in [Point::TimerStart, Point::ScanStart, Point::FirstRung, Point::ScanEnd] {
            places.pc(point).into_iter().for_each(|pc| cpu.trap(pc, true));
        }
        let mut rig = Rig { cpu, places, started: 0, scans: 0, stack: None };
        rig.run_to(Point::TimerStart, RESET)?;
        let stop = rig.cpu.step(&mut ());
        rig.started = rig.cpu.cycle();
        match stop {
            Stop::Limit => Ok(rig),
            stop => Err(rig.astray(Point::TimerStart, stop)),
        }
    }

    /// Drives the pins that the program does not name, now: the n-th by bit n.
    pub fn drive_spare(&mut self, levels: u32) {
        let now = Time::at(self.cpu.cycle());
        for (n, &pin) in (0..).zip(&self.places.spare) {
            self.cpu.drive(now, pin, Level::of(levels.checked_shr(n).unwrap_or(0) & 1 == 1));
        }
    }

    /// Drives all inputs, now.
    pub fn drive(&mut self, levels: impl Iterator<Item = bool>) {
        let now = Time::at(self.cpu.cycle());
        for (&pin, level) in self.places.inputs.iter().zip(levels) {
            self.cpu.drive(now, pin, Level::of(level));
        }
    }

    /// Runs to the next start of a scan.
    pub fn reach_start(&mut self) -> Result<(), Astray> {
        self.run_to(Point::ScanStart, 0)?;
        self.scans += 1;
        Ok(())
    }

    /// Runs to the first rung; false where that is no place of its own.
    pub fn reach_rungs(&mut self) -> Result<bool, Astray> {
        match self.places.pc(Point::FirstRung) {
            Some(_) => self.run_to(Point::FirstRung, 0).map(|()| true),
            None => Ok(false),
        }
    }

    /// Runs to the end of the scan.
    pub fn reach_end(&mut self) -> Result<(), Astray> {
        self.run_to(Point::ScanEnd, 0)
    }

    /// Runs to whatever trap comes next; a wrong one is not an error here. Gives the program word.
    pub fn reach_next(&mut self) -> Result<u32, Astray> {
        let until = self.until(0);
        match self.cpu.run(until, &mut ()) {
            Stop::Trap { pc } => Ok(pc),
            stop => Err(self.astray(Point::ScanEnd, stop)),
        }
    }

    /// At a scan's start: the cycles, since the timer was started, in which it may lie, and the one in which it does.
    pub fn punctual(&self) -> ((u64, u64), u64) {
        (self.places.window(self.scans), self.cpu.cycle() - self.started)
    }

    /// At a scan's start: the stack pointer of the first scan's start and the present one, where they differ.
    pub fn stack_moved(&mut self) -> Option<(u32, u32)> {
        let now = self.cpu.reg("sp")?;
        let first = *self.stack.get_or_insert(now);
        (first != now).then_some((first, now))
    }

    fn until(&self, extra: u64) -> u64 {
        let periods = self.places.period().saturating_mul(PERIODS).saturating_add(extra);
        self.cpu.cycle().saturating_add(periods)
    }

    fn run_to(&mut self, point: Point, extra: u64) -> Result<(), Astray> {
        let until = self.until(extra);
        match self.cpu.run(until, &mut ()) {
            Stop::Trap { pc } if Some(pc) == self.places.pc(point) => Ok(()),
            stop => Err(self.astray(point, stop)),
        }
    }

    fn astray(&self, wanted: Point, stop: Stop) -> Astray {
        Astray { wanted, stop, cycle: self.cpu.cycle(), pc: self.cpu.pc() }
    }
}
