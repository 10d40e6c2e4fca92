//! Devices around a chip, and the chip run with them.
//!
//! A device answers an edge at a time that may lie before the end of the instruction that made the edge: SPI can have several
//! edges in one instruction. So a copy of the machine runs ahead, a stretch at a time, and tells the devices of its edges. An answer
//! that lies before the copy is queued in the machine itself, which is still at the start of the stretch, and the copy
//! begins anew from there. When it comes through without another answer, all drives stand in the machine's queue, each at its own
//! cycle, and the machine runs the stretch: exact to the cycle, for any [`Cpu`], and with any probe.

use emu_core::cpu::{Cpu, Probe, Stop};
use emu_core::pins::{Event, Level, PinId, Time};

use crate::devices::Device;
use crate::seer;
use crate::time::Clock;

/// Machine cycles of a stretch: fewer where answers come close to each other.
const STRETCH: std::ops::RangeInclusive<u64> = 16..=1 << 16;

/// Turns of the copy after which a stretch is too long.
const TURNS: u32 = 3;

/// A device with its wires: for each of its pins the pin of the chip, if there is one; others are tied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fitted {
    /// The device.
    pub device: Device,
    /// Pins of the chip, in the order of the device's pins.
    pub wires: Vec<Option<PinId>>,
}

/// The devices, and what they do to the pins.
#[derive(Debug, Clone, PartialEq, Eq)]
struct State {
    fitted: Vec<Fitted>,
    /// What each driven pin gets, and nanoseconds after an edge.
    driven: Vec<(PinId, Level, u64)>,
}

/// The devices around a chip.
#[derive(Debug, Clone)]
pub struct Board {
    state: State,
    clock: Clock,
    stretch: u64,
}

/// A drive of a pin.
type Answer = (Time, PinId, Level);

impl Board {
    /// A board with these devices. `clock` says how long cycles are.
    #[must_use]
    pub fn new(fitted: Vec<Fitted>, clock: Clock) -> Board {
        let mut state = State { fitted, driven: Vec::new() };
        state.driven = state.wanted();
        Board { state, clock, stretch: *STRETCH.end() }
    }

    /// Pins of the chip that devices drive.
    pub fn driven(&self) -> impl Iterator<Item = PinId> {
        self.state.driven.iter().map(|driven| driven.0)
    }

    /// Devices in the order in which they were fitted.
    pub fn devices(&self) -> impl Iterator<Item = &Device> {
        self.state.fitted.iter().map(|fitted| &fitted.device)
    }

    /// Puts the devices to a chip that has just been switched on; the levels of its pins are theirs from now on.
    pub fn connect<C: Cpu>(&mut self, cpu: &mut C) {
        let now = Time::at(cpu.cycle());
        for &(pin, level, _) in &self.state.driven {
            cpu.drive(now, pin, level);
        }
        let t = self.clocks(now);
        for pin in (0..).take(cpu.chip().pins.len()) {
            // A line of which nothing is known is high, as resistors to the supply make it that boards have at select lines.
            self.state.line(pin, cpu.level(pin) != Level::Low, t, self.clock.hz);
        }
    }

    /// Runs the chip as [`Cpu::run`] does, with the devices.
    pub fn run<C: Cpu, P: Probe>(&mut self, cpu: &mut C, until: u64, probe: &mut P) -> Stop {
        self.run_by(cpu, until, probe, |cpu, until, probe| cpu.run(until, probe))
    }

    /// The same, where the machine itself is run by `go` in place of [`Cpu::run`]: in as many runs as it likes.
    pub fn run_by<C: Cpu, P: Probe>(
        &mut self,
        cpu: &mut C,
        until: u64,
        probe: &mut P,
        go: impl Fn(&mut C, u64, &mut P) -> Stop,
    ) -> Stop {
        if self.state.fitted.is_empty() {
            return go(cpu, until, probe);
        }
        loop {
            let (ahead, edges) = self.look_ahead(cpu, until);
            let stop = go(cpu, ahead, probe);
            // The probe may have stopped it before.
            let now = self.clocks(Time::at(cpu.cycle()));
            for (t, pin, high) in edges.into_iter().take_while(|edge| edge.0 <= now) {
                self.state.line(pin, high, t, self.clock.hz);
            }
            self.state.driven = self.state.wanted();
            if stop != Stop::Limit || cpu.cycle() >= until {
                return stop;
            }
        }
    }

    /// Queues the answers of the next stretch; gives the cycle up to which the machine may run, and the edges until then.
    fn look_ahead<C: Cpu>(&mut self, cpu: &mut C, until: u64) -> (u64, Vec<(u64, PinId, bool)>) {
        let (least, most) = (*STRETCH.start(), *STRETCH.end());
        let mut goal = until.min(cpu.cycle().saturating_add(self.stretch));
        let (mut known, mut turns) = (0, 0);
        loop {
            let mut copy = cpu.clone();
            let state = self.state.clone();
            let mut scout = Scout { state, clock: self.clock, known, edges: Vec::new(), answers: Vec::new() };
            let ended = 'copy: loop {
                let stop = copy.run(goal, &mut seer::events(&mut scout));
                for (at, pin, level) in std::mem::take(&mut scout.answers) {
                    cpu.drive(at, pin, level);
                    known += 1;
                    if at.cycle <= copy.cycle() {
                        break 'copy None;
                    }
                    copy.drive(at, pin, level);
                }
                if !matches!(stop, Stop::Probe | Stop::Trap { .. }) {
                    break Some(stop);
                }
            };
            if let Some(stop) = ended {
                self.stretch = if turns > TURNS { self.stretch / 2 } else { self.stretch * 2 }.clamp(least, most);
                // Where the program has ended the machine ends by itself.
                return (if stop == Stop::Limit { goal } else { until }, scout.edges);
            }
            turns += 1;
            if turns == TURNS {
                // Each turn begins at the start of the stretch, so where answers come one after the other it has to end soon.
                goal = goal.min(copy.cycle().saturating_add(least));
            }
        }
    }

    fn clocks(&self, at: Time) -> u64 {
        clocks(self.clock, at)
    }
}

/// A moment in clocks of the oscillator.
fn clocks(clock: Clock, at: Time) -> u64 {
    at.cycle.saturating_mul(clock.clocks_per_cycle.into()).saturating_add(at.phase.into())
}

impl State {
    /// What each pin gets that a device drives: of several at one pin those that pull low win, then those that drive.
    fn wanted(&self) -> Vec<(PinId, Level, u64)> {
        let strength = |level: Level| match level {
            Level::Low => 4,
            Level::High => 3,
            Level::PullDown => 2,
            Level::PullUp => 1,
            Level::Float => 0,
        };
        let mut all: Vec<(PinId, Level, u64)> = Vec::new();
        for Fitted { device, wires } in &self.fitted {
            let mut put = |wire: usize, level: Level| {
                let Some(pin) = wires.get(wire).copied().flatten() else { return };
                match all.iter_mut().find(|row| row.0 == pin) {
                    Some(row) if strength(row.1) < strength(level) => row.1 = level,
                    Some(_) => {}
                    None => all.push((pin, level, device.delay_ns())),
                }
            };
            put(device.driven(), device.level());
            if let Device::Eeprom(_) = device {
                // SCL has its resistor too.
                put(1, Level::PullUp);
            }
        }
        all
    }

    /// A pin of the chip has another level.
    fn line(&mut self, pin: PinId, high: bool, t: u64, hz: u64) {
        for Fitted { device, wires } in &mut self.fitted {
            for (wire, _) in wires.iter().enumerate().filter(|(_, of)| **of == Some(pin)) {
                device.line(wire, high, t, hz);
            }
        }
    }
}

/// The probe of the copy: devices see its edges and answer.
struct Scout {
    state: State,
    clock: Clock,
    /// Answers that are queued already, which come again.
    known: usize,
    edges: Vec<(u64, PinId, bool)>,
    answers: Vec<Answer>,
}

impl Scout {
    /// A time some nanoseconds after a clock: at least a machine cycle later if any.
    fn later(&self, t: u64, ns: u64) -> Time {
        let cycle = u64::from(self.clock.clocks_per_cycle.max(1));
        let clocks = (u128::from(ns) * u128::from(self.clock.hz)).div_ceil(1_000_000_000);
        let clocks = u64::try_from(clocks).unwrap_or(u64::MAX);
        let t = t.saturating_add(if ns == 0 { 0 } else { clocks.max(cycle) });
        Time { cycle: t / cycle, phase: (t % cycle) as u8 }
    }
}

impl Probe for Scout {
    const EVENTS: bool = true;

    fn event(&mut self, event: Event) -> bool {
        let Event::Edge { at, pin, level: level @ (Level::Low | Level::High) } = event else { return false };
        if !self.state.fitted.iter().any(|fitted| fitted.wires.contains(&Some(pin))) {
            return false;
        }
        let (t, high) = (clocks(self.clock, at), level == Level::High);
        self.edges.push((t, pin, high));
        self.state.line(pin, high, t, self.clock.hz);
        let wanted = self.state.wanted();
        for (old, &(pin, level, ns)) in self.state.driven.clone().iter().zip(&wanted) {
            if old.1 == level {
                continue;
            }
            match self.known.checked_sub(1) {
                Some(known) => self.known = known,
                None => self.answers.push((self.later(t, ns), pin, level)),
            }
        }
        self.state.driven = wanted;
        !self.answers.is_empty()
    }
}
