//! The chip on the bench: run from one moment of a scan to the next, with its pins wired.

use emu_core::cpu::Stop;
use emu_core::pins::{Level, Time};

use crate::family::{High, Target};
use crate::places::{Places, Point};
use crate::tap::Tap;

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
    /// What listens to serial line and PWM output.
    pub tap: Option<Tap>,
    /// Machine cycle at which the timer was started; of a machine that paces itself the start of the first scan.
    started: Option<u64>,
    /// Periods since then.
    scans: u64,
    stack: Option<u32>,
    /// Whether the chip stops at each rung.
    timed: bool,
    /// Where the rungs of this scan began, with the cycle; nothing unless that is asked for.
    marks: Vec<(usize, u64)>,
}

impl<'a, C: Target> Rig<'a, C> {
    /// A chip fresh from reset, run until its timer has started.
    pub(crate) fn start(mut cpu: C, places: &'a Places) -> Result<Self, Astray> {
        for point in [Point::TimerStart, Point::ScanStart, Point::FirstRung, Point::ScanEnd] {
            places.pc(point).into_iter().for_each(|pc| cpu.trap(pc, true));
        }
        let open = |pin| places.nature(pin).is_some_and(|nature| nature.high == High::Open);
        for &(_, pin) in places.outputs.iter().filter(|output| open(output.1)) {
            cpu.drive(Time::at(0), pin, Level::PullUp);
        }
        if let Some(pin) = places.peripherals.receive {
            cpu.drive(Time::at(0), pin, Level::High);
        }
        let mut rig = Rig {
            cpu,
            places,
            tap: Tap::new(&places.peripherals),
            started: None,
            scans: 0,
            stack: None,
            timed: false,
            marks: Vec::new(),
        };
        if places.paces_itself() {
            return Ok(rig);
        }
        rig.run_to(Point::TimerStart, RESET)?;
        let stop = rig.cpu.step(&mut ());
        rig.started = Some(rig.cpu.cycle());
        match stop {
            Stop::Limit => Ok(rig),
            stop => Err(rig.astray(Point::TimerStart, stop)),
        }
    }

    /// Stops at each rung from now on, to see how long it takes.
    pub(crate) fn time_rungs(&mut self) {
        self.timed = true;
        self.places.rungs.iter().for_each(|&(pc, _)| self.cpu.trap(pc, true));
    }

    /// The rungs of the scan that has ended, by position, with their machine cycles.
    pub(crate) fn rung_times(&self) -> impl Iterator<Item = (usize, u64)> {
        let pairs = self.marks.windows(2).filter_map(|pair| match pair {
            [(rung, from), (_, to)] => Some((*rung, to - from)),
            _ => None,
        });
        pairs.filter(|(rung, _)| *rung != usize::MAX)
    }

    /// At the end of a scan: the machine cycles until the chip waits again.
    pub(crate) fn tail(&self) -> u64 {
        let mut cpu = self.cpu.clone();
        let before = cpu.cycle();
        cpu.step(&mut ());
        // A controller looks at all its outputs then.
        let outputs = if self.places.paces_itself() { self.places.channels(&cpu) } else { 0 };
        cpu.cycle() - before + outputs
    }

    /// Drives the pins that the program does not name, now: the n-th by bit n.
    pub(crate) fn drive_spare(&mut self, levels: u32) {
        let now = Time::at(self.cpu.cycle());
        for (n, &pin) in (0..).zip(&self.places.spare) {
            self.cpu.drive(now, pin, Level::of(levels.checked_shr(n).unwrap_or(0) & 1 == 1));
        }
    }

    /// Drives all inputs, now.
    pub(crate) fn drive(&mut self, levels: impl Iterator<Item = bool>) {
        self.drive_at(Time::at(self.cpu.cycle()), levels);
    }

    /// Drives all inputs as soon as they have been latched, where a scan takes them: a machine that paces itself stands at the start
    /// of a scan, and latches at the first clock of the cycle that comes.
    pub(crate) fn drive_late(&mut self, levels: impl Iterator<Item = bool>) {
        let phase = u8::from(self.places.paces_itself());
        self.drive_at(Time { cycle: self.cpu.cycle(), phase }, levels);
    }

    fn drive_at(&mut self, time: Time, levels: impl Iterator<Item = bool>) {
        for (&pin, level) in self.places.inputs.iter().zip(levels) {
            self.cpu.drive(time, pin, Level::of(level));
        }
    }

    /// Runs to the next start of a scan.
    pub(crate) fn reach_start(&mut self) -> Result<(), Astray> {
        self.run_to(Point::ScanStart, 0)?;
        self.marks.clear();
        self.mark(self.cpu.pc());
        match self.started {
            Some(_) => self.scans += 1,
            None => self.started = Some(self.cpu.cycle()),
        }
        Ok(())
    }

    /// Runs to the first rung; false where that is no place of its own.
    pub(crate) fn reach_rungs(&mut self) -> Result<bool, Astray> {
        match self.places.pc(Point::FirstRung) {
            Some(_) => self.run_to(Point::FirstRung, 0).map(|()| true),
            None => Ok(false),
        }
    }

    /// Runs to the end of the scan.
    pub(crate) fn reach_end(&mut self) -> Result<(), Astray> {
        self.run_to(Point::ScanEnd, 0)
    }

    /// Runs to whatever trap comes next; a wrong one is not an error here. Gives the program word.
    pub(crate) fn reach_next(&mut self) -> Result<u32, Astray> {
        let until = self.until(0);
        match self.go(until) {
            Stop::Trap { pc } => Ok(pc),
            stop => Err(self.astray(Point::ScanEnd, stop)),
        }
    }

    /// Scans that have started.
    pub(crate) fn started(&self) -> u64 {
        self.scans + u64::from(self.places.paces_itself() && self.started.is_some())
    }

    /// The first machine cycle in which scan `scan` (from 1) may start.
    pub(crate) fn starts(&self, scan: u64) -> u64 {
        self.started.unwrap_or(0).saturating_add(self.places.window(scan).0)
    }

    /// Now, in clocks since power-up.
    pub(crate) fn clock(&self) -> u64 {
        self.places.peripherals.clock(Time::at(self.cpu.cycle()))
    }

    /// At a scan's start: the cycles, since the timer was started, in which it may lie, and the one in which it does.
    pub(crate) fn punctual(&self) -> ((u64, u64), u64) {
        (self.places.window(self.scans), self.cpu.cycle().saturating_sub(self.started.unwrap_or(0)))
    }

    /// At a scan's start: the stack pointer of the first scan's start and the present one, where they differ.
    pub(crate) fn stack_moved(&mut self) -> Option<(u32, u32)> {
        let now = Target::depth(&self.cpu)?;
        let first = *self.stack.get_or_insert(now);
        (first != now).then_some((first, now))
    }

    /// Runs the chip. A controller that has settled halts where nothing more is to come; but more is.
    fn go(&mut self, until: u64) -> Stop {
        loop {
            let stop = match &mut self.tap {
                Some(tap) => self.cpu.run(until, tap),
                None => self.cpu.run(until, &mut ()),
            };
            let Some(power) = self.places.supply().filter(|_| stop == Stop::Halted && self.cpu.cycle() < until) else {
                return stop;
            };
            self.cpu.drive(Time::at(until), power, Level::High);
        }
    }

    fn until(&self, extra: u64) -> u64 {
        let periods = self.places.period().saturating_mul(PERIODS).saturating_add(extra);
        self.cpu.cycle().saturating_add(periods)
    }

    fn run_to(&mut self, point: Point, extra: u64) -> Result<(), Astray> {
        let until = self.until(extra);
        loop {
            match self.go(until) {
                Stop::Trap { pc } if Some(pc) == self.places.pc(point) => {
                    self.mark(pc);
                    return Ok(());
                }
                Stop::Trap { pc } if !self.places.is_point(pc) && self.mark(pc) => {}
                stop => return Err(self.astray(point, stop)),
            }
        }
    }

    /// Notes that a rung begins here, if one does.
    fn mark(&mut self, pc: u32) -> bool {
        let found = self.places.rungs.iter().find(|(start, _)| *start == pc);
        // Without the others, the rungs where a point lies as well would seem to last until the next point.
        self.marks.extend(found.filter(|_| self.timed).map(|&(_, rung)| (rung, self.cpu.cycle())));
        found.is_some()
    }

    fn astray(&self, wanted: Point, stop: Stop) -> Astray {
        Astray { wanted, stop, cycle: self.cpu.cycle(), pc: self.cpu.pc() }
    }
}
