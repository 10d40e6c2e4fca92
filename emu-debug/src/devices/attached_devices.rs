//! Devices around a chip, and running the chip with them.
//!
//! A device may answer an edge before the instruction that made the edge ends: SPI can have several edges in
//! one instruction. Therefore a copy of the machine runs ahead, one stretch at a time, and reports its edges
//! to the devices. The machine itself stays at the start of the stretch. An answer at a time that the copy
//! has passed is queued in the machine, and the copy starts again from there. Once the copy finishes without
//! a new answer, all drives are in the machine's queue, each at its own cycle, and the machine runs the
//! stretch. This is exact to the cycle, for any [`Cpu`] and any probe.

use emu_core::cpu::{Cpu, Probe, StopReason};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use crate::devices::ExternalDevice;
use crate::probes::dyn_probe;
use crate::text::time::CycleClock;

/// Machine cycles by which the copy runs ahead at a time: fewer if answers follow each other closely.
const STRETCH_CYCLES: std::ops::RangeInclusive<u64> = 16..=1 << 16;

/// Passes of the copy after which the stretch is shortened.
const MAX_LOOKAHEAD_PASSES: u32 = 3;

/// A device with its wires: for each device pin the chip pin, if there is one; other pins are tied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WiredDevice {
    /// The device.
    pub device: ExternalDevice,
    /// Chip pins, in the order of the device's pins.
    pub wires: Vec<Option<PinId>>,
}

/// The devices, and what they do to the pins.
#[derive(Debug, Clone, PartialEq, Eq)]
struct DevicesState {
    devices: Vec<WiredDevice>,
    /// The level of each driven pin, and its delay after an edge in nanoseconds.
    driven: Vec<DrivenPin>,
}

/// The devices around a chip.
#[derive(Debug, Clone)]
pub struct AttachedDevices {
    state: DevicesState,
    clock: CycleClock,
    /// Length of the next stretch in machine cycles, within [`STRETCH_CYCLES`].
    stretch: u64,
}

/// A drive of a pin by a device.
#[derive(Debug, Clone, Copy)]
struct DeviceDrive {
    /// The time.
    at: CycleTime,
    /// The pin.
    pin: PinId,
    /// The level from then on.
    level: PinLevel,
}

/// An edge at a pin.
#[derive(Debug, Clone, Copy)]
struct SeenEdge {
    /// The clock of the edge.
    clock: u64,
    /// The pin.
    pin: PinId,
    /// Whether the pin is high from then on.
    high: bool,
}

/// What the devices know of the next stretch.
#[derive(Debug, Clone)]
struct LookAhead {
    /// The cycle up to which the machine may run.
    end: u64,
    /// The edges until then.
    edges: Vec<SeenEdge>,
}

impl AttachedDevices {
    /// Returns these devices, not connected yet. `clock` gives the length of cycles.
    #[must_use]
    pub fn new(wired: Vec<WiredDevice>, clock: CycleClock) -> AttachedDevices {
        let mut state = DevicesState { devices: wired, driven: Vec::new() };
        state.driven = state.combined_drives();
        AttachedDevices { state, clock, stretch: *STRETCH_CYCLES.end() }
    }

    /// Returns the chip pins that devices drive.
    pub fn driven_pins(&self) -> impl Iterator<Item = PinId> {
        self.state.driven.iter().map(|driven| driven.pin)
    }

    /// Returns the devices in the order in which they were added.
    pub fn devices(&self) -> impl Iterator<Item = &ExternalDevice> {
        self.state.devices.iter().map(|wired| &wired.device)
    }

    /// Connects the devices to a chip that has just been powered up; from now on they see the levels of its
    /// pins.
    pub fn connect<C: Cpu>(&mut self, cpu: &mut C) {
        let now = CycleTime::at(cpu.cycle());
        for &DrivenPin { pin, level, .. } in &self.state.driven {
            cpu.drive(now, pin, level);
        }
        let clock = self.clocks_of(now);
        for pin in (0..).take(cpu.chip().pins.len()) {
            // A line with an unknown level is high: boards have pull-up resistors at select lines.
            self.state.on_pin_change(pin, cpu.pin_level(pin) != PinLevel::Low, clock, self.clock.hz);
        }
    }

    /// Runs the chip as [`Cpu::run`] does, with the devices.
    pub fn run<C: Cpu, P: Probe>(&mut self, cpu: &mut C, until: u64, probe: &mut P) -> StopReason {
        self.run_with(cpu, until, probe, |cpu, until, probe| cpu.run(until, probe))
    }

    /// Runs with the devices, but calls `run_machine` instead of [`Cpu::run`]; it may split the run.
    pub fn run_with<C: Cpu, P: Probe>(
        &mut self,
        cpu: &mut C,
        until: u64,
        probe: &mut P,
        run_machine: impl Fn(&mut C, u64, &mut P) -> StopReason,
    ) -> StopReason {
        if self.state.devices.is_empty() {
            return run_machine(cpu, until, probe);
        }
        loop {
            let LookAhead { end: stretch_end, edges } = self.look_ahead(cpu, until);
            let stop = run_machine(cpu, stretch_end, probe);
            // The probe may have stopped the run earlier.
            let now = self.clocks_of(CycleTime::at(cpu.cycle()));
            for SeenEdge { clock, pin, high } in edges.into_iter().take_while(|edge| edge.clock <= now) {
                self.state.on_pin_change(pin, high, clock, self.clock.hz);
            }
            self.state.driven = self.state.combined_drives();
            if stop != StopReason::Limit || cpu.cycle() >= until {
                return stop;
            }
        }
    }

    /// Queues the answers of the devices in the next stretch. Returns the cycle up to which the machine may
    /// run, and the edges until then: clock, pin, and whether the pin is high.
    fn look_ahead<C: Cpu>(&mut self, cpu: &mut C, until: u64) -> LookAhead {
        let (least, most) = (*STRETCH_CYCLES.start(), *STRETCH_CYCLES.end());
        let mut stretch_end = until.min(cpu.cycle().saturating_add(self.stretch));
        let (mut queued_answers, mut passes) = (0, 0);
        loop {
            let mut copy = cpu.clone();
            let state = self.state.clone();
            let mut lookahead =
                LookaheadProbe { state, clock: self.clock, queued_answers, edges: Vec::new(), answers: Vec::new() };
            let ended = 'copy: loop {
                let stop = copy.run(stretch_end, &mut dyn_probe::probe_events(&mut lookahead));
                for DeviceDrive { at, pin, level } in std::mem::take(&mut lookahead.answers) {
                    cpu.drive(at, pin, level);
                    queued_answers += 1;
                    if at.cycle <= copy.cycle() {
                        break 'copy None;
                    }
                    copy.drive(at, pin, level);
                }
                if !matches!(stop, StopReason::Probe | StopReason::Breakpoint { .. }) {
                    break Some(stop);
                }
            };
            if let Some(stop) = ended {
                self.stretch =
                    if passes > MAX_LOOKAHEAD_PASSES { self.stretch / 2 } else { self.stretch * 2 }.clamp(least, most);
                // If the program has ended, the machine ends by itself.
                return LookAhead {
                    end: if stop == StopReason::Limit { stretch_end } else { until },
                    edges: lookahead.edges,
                };
            }
            passes += 1;
            if passes == MAX_LOOKAHEAD_PASSES {
                // Each pass begins at the start of the stretch, so successive answers require a short
                // stretch.
                stretch_end = stretch_end.min(copy.cycle().saturating_add(least));
            }
        }
    }

    fn clocks_of(&self, at: CycleTime) -> u64 {
        time_in_clocks(self.clock, at)
    }
}

/// Converts a time to clocks of the oscillator.
fn time_in_clocks(clock: CycleClock, at: CycleTime) -> u64 {
    at.cycle.saturating_mul(clock.clocks_per_cycle.into()).saturating_add(at.phase.into())
}

/// A pin that a device drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct DrivenPin {
    pin: PinId,
    level: PinLevel,
    /// How long the device takes, in nanoseconds.
    delay_ns: u64,
}

impl DevicesState {
    /// Returns the level of each pin that a device drives. Of several drives at one pin, low wins over high,
    /// and both over pull resistors.
    fn combined_drives(&self) -> Vec<DrivenPin> {
        let strength = |level: PinLevel| match level {
            PinLevel::Low => 4,
            PinLevel::High => 3,
            PinLevel::PullDown => 2,
            PinLevel::PullUp => 1,
            PinLevel::Float => 0,
        };
        let mut all: Vec<DrivenPin> = Vec::new();
        for WiredDevice { device, wires } in &self.devices {
            let mut add_drive = |wire: usize, level: PinLevel| {
                let Some(pin) = wires.get(wire).copied().flatten() else { return };
                match all.iter_mut().find(|row| row.pin == pin) {
                    Some(row) if strength(row.level) < strength(level) => row.level = level,
                    Some(_) => {}
                    None => all.push(DrivenPin { pin, level, delay_ns: device.delay_ns() }),
                }
            };
            add_drive(device.driven_pin(), device.driven_level());
            if let ExternalDevice::Eeprom(_) = device {
                // SCL has its pull-up resistor too.
                add_drive(1, PinLevel::PullUp);
            }
        }
        all
    }

    /// Reports a new level of a chip pin to the devices.
    fn on_pin_change(&mut self, pin: PinId, high: bool, clock: u64, hz: u64) {
        for WiredDevice { device, wires } in &mut self.devices {
            for (wire, _) in wires.iter().enumerate().filter(|(_, of)| **of == Some(pin)) {
                device.on_pin_change(wire, high, clock, hz);
            }
        }
    }
}

/// The probe of the copy: devices see its edges and answer.
struct LookaheadProbe {
    state: DevicesState,
    clock: CycleClock,
    /// Number of answers that are already queued and will occur again.
    queued_answers: usize,
    edges: Vec<SeenEdge>,
    answers: Vec<DeviceDrive>,
}

impl LookaheadProbe {
    /// Returns the time `ns` nanoseconds after a clock; any delay is at least a machine cycle.
    fn delayed(&self, clock: u64, ns: u64) -> CycleTime {
        let cycle = u64::from(self.clock.clocks_per_cycle.max(1));
        let clocks = (u128::from(ns) * u128::from(self.clock.hz)).div_ceil(1_000_000_000);
        let clocks = u64::try_from(clocks).unwrap_or(u64::MAX);
        let clock = clock.saturating_add(if ns == 0 { 0 } else { clocks.max(cycle) });
        CycleTime { cycle: clock / cycle, phase: (clock % cycle) as u8 }
    }
}

impl Probe for LookaheadProbe {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        let ChipEvent::Edge { at, pin, level: level @ (PinLevel::Low | PinLevel::High) } = event else { return false };
        if !self.state.devices.iter().any(|wired| wired.wires.contains(&Some(pin))) {
            return false;
        }
        let (clock, high) = (time_in_clocks(self.clock, at), level == PinLevel::High);
        self.edges.push(SeenEdge { clock, pin, high });
        self.state.on_pin_change(pin, high, clock, self.clock.hz);
        let new_drives = self.state.combined_drives();
        for (old, &DrivenPin { pin, level, delay_ns: ns }) in self.state.driven.clone().iter().zip(&new_drives) {
            if old.level == level {
                continue;
            }
            match self.queued_answers.checked_sub(1) {
                Some(queued_answers) => self.queued_answers = queued_answers,
                None => self.answers.push(DeviceDrive { at: self.delayed(clock, ns), pin, level }),
            }
        }
        self.state.driven = new_drives;
        !self.answers.is_empty()
    }
}
