//! Runs the chip under test from one point of a scan to the next, with its pins connected.

use std::ops::RangeInclusive;

use emu_core::cpu::StopReason;
use emu_core::pins::{CycleTime, PinLevel};

use crate::chip::families::{CheckedChip, HighDrive};
use crate::chip::pin_listener::PinListener;
use crate::chip::program_places::{ProgramPlaces, ScanPoint};

/// Machine cycles allowed from reset to the start of the pacing timer, in addition to [`MAX_PERIODS`]
/// periods.
const MAX_RESET_CYCLES: u64 = 200_000;

/// Periods allowed from one point of a scan to the next.
const MAX_PERIODS: u64 = 3;

/// A stack pointer that differs from the one at the start of the first scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StackChange {
    /// The stack pointer at the start of the first scan.
    pub first: u32,
    /// The stack pointer at the start of this scan.
    pub now: u32,
}

/// The chip did not reach the wanted point of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct LostSync {
    /// The point that the chip should have reached.
    pub wanted: ScanPoint,
    /// Why the run stopped instead.
    pub stop: StopReason,
    /// Machine cycle of the stop.
    pub cycle: u64,
    /// Program counter at the stop, as a word address.
    pub pc: u32,
}

/// A chip under test with the addresses, pins and timing of its program.
#[derive(Debug, Clone)]
pub(crate) struct ChipRunner<'a, C> {
    /// The emulated chip.
    pub cpu: C,
    /// The addresses, pins and timing of its program.
    pub places: &'a ProgramPlaces,
    /// The probe that observes the serial line, the PWM output and the buses.
    pub listener: Option<PinListener>,
    /// Machine cycle at which the pacing timer was started; on a self-paced machine, the start of the first
    /// scan.
    timer_start: Option<u64>,
    /// Periods since `timer_start`.
    periods: u64,
    /// Stack pointer at the start of the first scan.
    first_stack_pointer: Option<u32>,
    /// True if the chip stops at the start of each rung.
    times_rungs: bool,
    /// Rungs of this scan with the cycle at which each started; empty unless rungs are timed.
    rung_marks: Vec<(usize, u64)>,
}

impl<'a, C: CheckedChip> ChipRunner<'a, C> {
    /// Powers up a chip and runs it until its pacing timer has started.
    pub(crate) fn start(mut cpu: C, places: &'a ProgramPlaces) -> Result<Self, LostSync> {
        for point in [ScanPoint::TimerStart, ScanPoint::ScanStart, ScanPoint::FirstRung, ScanPoint::ScanEnd] {
            places.point_word(point).into_iter().for_each(|pc| cpu.set_breakpoint(pc, true));
        }
        let is_open_drain = |pin| places.pin_behaviour(pin).is_some_and(|behaviour| behaviour.high == HighDrive::Open);
        for &(_, pin) in places.outputs.iter().filter(|output| is_open_drain(output.1)) {
            cpu.drive(CycleTime::at(0), pin, PinLevel::PullUp);
        }
        if let Some(pin) = places.peripherals.receive {
            cpu.drive(CycleTime::at(0), pin, PinLevel::High);
        }
        for pin in places.peripherals.buses.pull_ups() {
            cpu.drive(CycleTime::at(0), pin, PinLevel::PullUp);
        }
        let mut runner = ChipRunner {
            cpu,
            places,
            listener: PinListener::new(&places.peripherals),
            timer_start: None,
            periods: 0,
            first_stack_pointer: None,
            times_rungs: false,
            rung_marks: Vec::new(),
        };
        if places.is_self_paced() {
            return Ok(runner);
        }
        runner.run_to(ScanPoint::TimerStart, MAX_RESET_CYCLES)?;
        let stop = runner.cpu.step(&mut ());
        runner.timer_start = Some(runner.cpu.cycle());
        match stop {
            StopReason::Limit => Ok(runner),
            stop => Err(runner.lost_sync(ScanPoint::TimerStart, stop)),
        }
    }

    /// Stops at the start of each rung from now on, to measure how long each rung takes.
    pub(crate) fn time_rungs(&mut self) {
        self.times_rungs = true;
        self.places.rungs.iter().for_each(|&(pc, _)| self.cpu.set_breakpoint(pc, true));
    }

    /// The rungs of the scan that has ended, by index, with their machine cycles.
    pub(crate) fn rung_times(&self) -> impl Iterator<Item = (usize, u64)> {
        let pairs = self.rung_marks.windows(2).filter_map(|pair| match pair {
            [(rung, from), (_, to)] => Some((*rung, to - from)),
            _ => None,
        });
        pairs.filter(|(rung, _)| *rung != usize::MAX)
    }

    /// At the end of a scan: machine cycles until the chip waits again.
    pub(crate) fn tail_cycles(&self) -> u64 {
        let mut cpu = self.cpu.clone();
        let before = cpu.cycle();
        cpu.step(&mut ());
        // A self-paced machine then processes its output channels, one cycle each.
        let outputs = if self.places.is_self_paced() { self.places.output_channels(&cpu) } else { 0 };
        cpu.cycle() - before + outputs
    }

    /// Drives the pins that the program does not name and the board may drive, in the current cycle; bit n is
    /// the level of the n-th pin.
    pub(crate) fn drive_unnamed_pins(&mut self, levels: u32) {
        let now = CycleTime::at(self.cpu.cycle());
        for (n, &pin) in (0..).zip(&self.places.drivable_pins) {
            self.cpu.drive(now, pin, PinLevel::from_bit(levels.checked_shr(n).unwrap_or(0) & 1 == 1));
        }
    }

    /// Drives all inputs in the current cycle.
    pub(crate) fn drive_inputs(&mut self, levels: impl Iterator<Item = bool>) {
        self.drive_at(CycleTime::at(self.cpu.cycle()), levels);
    }

    /// Drives all inputs directly after the scan has latched them. A self-paced machine is at the start of a
    /// scan here and latches its inputs in the first clock of the next cycle.
    pub(crate) fn drive_after_latch(&mut self, levels: impl Iterator<Item = bool>) {
        let phase = u8::from(self.places.is_self_paced());
        self.drive_at(CycleTime { cycle: self.cpu.cycle(), phase }, levels);
    }

    fn drive_at(&mut self, time: CycleTime, levels: impl Iterator<Item = bool>) {
        for (&pin, level) in self.places.inputs.iter().zip(levels) {
            self.cpu.drive(time, pin, PinLevel::from_bit(level));
        }
    }

    /// Runs to the next start of a scan.
    pub(crate) fn reach_start(&mut self) -> Result<(), LostSync> {
        self.run_to(ScanPoint::ScanStart, 0)?;
        self.rung_marks.clear();
        self.note_rung_start(self.cpu.pc());
        match self.timer_start {
            Some(_) => self.periods += 1,
            None => self.timer_start = Some(self.cpu.cycle()),
        }
        Ok(())
    }

    /// Runs to the first rung. Returns false if the program has no separate address for it.
    pub(crate) fn reach_rungs(&mut self) -> Result<bool, LostSync> {
        match self.places.point_word(ScanPoint::FirstRung) {
            Some(_) => self.run_to(ScanPoint::FirstRung, 0).map(|()| true),
            None => Ok(false),
        }
    }

    /// Runs to the end of the scan.
    pub(crate) fn reach_end(&mut self) -> Result<(), LostSync> {
        self.run_to(ScanPoint::ScanEnd, 0)
    }

    /// Runs to the next breakpoint of any kind and returns its program word; an unexpected breakpoint is not
    /// an error here.
    pub(crate) fn reach_next(&mut self) -> Result<u32, LostSync> {
        let until = self.cycle_limit(0);
        match self.run_until(until) {
            StopReason::Breakpoint { pc } => Ok(pc),
            stop => Err(self.lost_sync(ScanPoint::ScanEnd, stop)),
        }
    }

    /// Number of scans that have started.
    pub(crate) fn scans_started(&self) -> u64 {
        self.periods + u64::from(self.places.is_self_paced() && self.timer_start.is_some())
    }

    /// The first machine cycle in which scan `scan` (from 1) may start.
    pub(crate) fn scan_start_cycle(&self, scan: u64) -> u64 {
        self.timer_start.unwrap_or(0).saturating_add(*self.places.start_window(scan).start())
    }

    /// The current time in clocks since power-up.
    pub(crate) fn clock(&self) -> u64 {
        self.places.peripherals.to_clock(CycleTime::at(self.cpu.cycle()))
    }

    /// At the start of a scan: the window in which it may start, in machine cycles since the timer was
    /// started.
    pub(crate) fn start_window(&self) -> RangeInclusive<u64> {
        self.places.start_window(self.periods)
    }

    /// Machine cycles since the timer was started.
    pub(crate) fn cycles_since_start(&self) -> u64 {
        self.cpu.cycle().saturating_sub(self.timer_start.unwrap_or(0))
    }

    /// At the start of a scan: the stack pointer, if it is not the one of the first scan.
    pub(crate) fn stack_change(&mut self) -> Option<StackChange> {
        let now = self.cpu.stack_pointer()?;
        let first = *self.first_stack_pointer.get_or_insert(now);
        (first != now).then_some(StackChange { first, now })
    }

    /// Runs the chip until the machine cycle `until`. A settled AP101 halts when no event is due, so its
    /// supply pin gets an event at `until` to let time pass.
    fn run_until(&mut self, until: u64) -> StopReason {
        loop {
            let stop = match &mut self.listener {
                Some(listener) => self.cpu.run(until, listener),
                None => self.cpu.run(until, &mut ()),
            };
            // A device on a bus answers an edge before the next one of the chip.
            if let Some((pin, level)) = self.listener.as_mut().and_then(|l| l.buses.as_mut()?.drive.take()) {
                self.cpu.drive(CycleTime::at(self.cpu.cycle()), pin, level);
                if stop == StopReason::Probe {
                    continue;
                }
            }
            let Some(power) =
                self.places.supply_pin().filter(|_| stop == StopReason::Halted && self.cpu.cycle() < until)
            else {
                return stop;
            };
            self.cpu.drive(CycleTime::at(until), power, PinLevel::High);
        }
    }

    fn cycle_limit(&self, extra: u64) -> u64 {
        let periods = self.places.period_cycles().saturating_mul(MAX_PERIODS).saturating_add(extra);
        self.cpu.cycle().saturating_add(periods)
    }

    fn run_to(&mut self, point: ScanPoint, extra: u64) -> Result<(), LostSync> {
        let until = self.cycle_limit(extra);
        loop {
            match self.run_until(until) {
                StopReason::Breakpoint { pc } if Some(pc) == self.places.point_word(point) => {
                    self.note_rung_start(pc);
                    return Ok(());
                }
                StopReason::Breakpoint { pc } if !self.places.is_scan_point(pc) && self.note_rung_start(pc) => {}
                stop => return Err(self.lost_sync(point, stop)),
            }
        }
    }

    /// Records the start of a rung if a rung starts at `pc`; returns whether one does.
    fn note_rung_start(&mut self, pc: u32) -> bool {
        let rung_start = self.places.rungs.iter().find(|(start, _)| *start == pc);
        // All rungs are timed or none: with a subset, a rung that starts at a scan point would seem to last
        // until the next point.
        self.rung_marks.extend(rung_start.filter(|_| self.times_rungs).map(|&(_, rung)| (rung, self.cpu.cycle())));
        rung_start.is_some()
    }

    fn lost_sync(&self, wanted: ScanPoint, stop: StopReason) -> LostSync {
        LostSync { wanted, stop, cycle: self.cpu.cycle(), pc: self.cpu.pc() }
    }
}
