//! Analog comparator (section 23).
//!
//! The comparator itself is faster than any clock. Its output passes two flip-flops to ACO (the 1 to 2 cycles
//! of 23.3.2): a change at an edge is visible two edges later. There ACIS selects the changes that set ACI.
//! Timer 1 takes the output before these flip-flops, because it has its own synchronizer.

use emu_core::NEVER;
use emu_core::state;

use super::real_time_delay::RealTimeDelay;
use super::{AvrDrive, AvrLine, AvrOutbox, AvrSignal, Device};

/// The registers of the comparator.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparatorRegister {
    ACSR,
    DIDR1,
}

/// An input of the comparator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparatorInput {
    /// The positive input.
    Ain0,
    /// The negative input.
    Ain1,
    /// A channel of the converter, 0 to 7, which replaces AIN1 (23.2).
    Adc(u8),
}

const ACD: u8 = 1 << 7;
const ACBG: u8 = 1 << 6;
const ACO: u8 = 1 << 5;
const ACI: u8 = 1 << 4;
const ACIE: u8 = 1 << 3;
const ACIC: u8 = 1 << 2;
const ACIS: u8 = 3;
/// Mask of AIN1D and AIN0D.
const DIDR1: u8 = 3;

/// Cycles from a change of the output to the change of ACO.
const SYNC_CYCLES: u64 = 2;
/// Typical start-up time of the bandgap reference (29, system and reset characteristics), in microseconds.
const BANDGAP_US: u32 = 40;

/// A change of the output that has not reached ACO yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct OutputChange {
    /// Local time of the peripheral at which ACO changes.
    at: u64,
    high: bool,
}

state! { OutputChange { at, high } }

/// The analog comparator. Voltages are in millivolts above GND.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrComparator {
    /// Voltages on AIN0, AIN1 and ADC0 to ADC7, in millivolts.
    levels: [u32; 10],
    /// Channel of the converter that replaces AIN1.
    channel: Option<u8>,
    bandgap_mv: u32,
    hz: u64,
    /// True if other peripherals (brown-out detector, converter) keep the reference on.
    kept: bool,
    /// Start-up delay of the reference; None while it is off.
    start_up: Option<RealTimeDelay>,
    /// ACSR without ACO.
    acsr: u8,
    didr1: u8,
    /// Output at the last comparison.
    output: bool,
    aco: bool,
    /// Changes that have not reached ACO, the oldest first. There are at most two, because each cycle has at
    /// most one.
    changes: [Option<OutputChange>; 2],
    /// Cycle at which ACI was last set.
    flagged: u64,
    /// Cycle at which the clock of the peripheral was stopped; None while it runs.
    stopped: Option<u64>,
}

state! {
    AvrComparator {
        levels, channel, hz, kept, start_up, acsr, didr1, output, aco, changes, flagged, stopped,
    } stays { bandgap_mv } if |of, _now| of.hz != NEVER && of.stopped != Some(NEVER)
}

impl AvrComparator {
    /// Returns the comparator after power-on at cycle 0: all inputs at 0 V, a bandgap reference of
    /// `bandgap_mv` millivolts (1,100 on ATmega48 to 328), a clock of `hz` Hz.
    #[must_use]
    pub fn new(bandgap_mv: u32, hz: u64) -> AvrComparator {
        AvrComparator {
            levels: [0; 10],
            channel: None,
            bandgap_mv,
            hz,
            kept: false,
            start_up: None,
            acsr: 0,
            didr1: 0,
            output: false,
            aco: false,
            changes: [None; 2],
            flagged: NEVER,
            stopped: None,
        }
    }

    /// Sets the voltage on an input from the edge `t` on. Channels that do not exist are ignored.
    pub fn set_millivolts(&mut self, input: ComparatorInput, millivolts: u32, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if let Some(level) = self.levels.get_mut(input_index(input)) {
            *level = millivolts;
        }
        self.compare(t, out);
    }

    /// Selects the channel of the converter that replaces AIN1 from the edge `t` on, as given by
    /// [`AvrAdc::comparator_channel`](super::adc::AvrAdc::comparator_channel).
    pub fn select(&mut self, channel: Option<u8>, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.channel = channel;
        self.compare(t, out);
    }

    /// Sets whether others than ACBG (the brown-out detector, the converter while ADEN is set) keep the
    /// bandgap reference on, from the edge `t` on (11.7.1).
    pub fn hold_reference_on(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.kept = on;
        self.power_reference(t);
        self.compare(t, out);
    }

    /// Returns ACI, which is trigger source 1 of the converter. Call `run_due` first.
    #[must_use]
    pub fn flag(&self) -> bool {
        self.acsr & ACI != 0
    }

    /// Returns DIDR1: AIN0 (bit 0) and AIN1 (bit 1) with the digital input off; these pins read 0.
    #[must_use]
    pub fn digital_off(&self) -> u8 {
        self.didr1
    }

    /// Returns the local time at the edge `t`, which does not advance while the I/O clock is stopped.
    fn to_io_time(&self, t: u64) -> u64 {
        self.stopped.unwrap_or(t)
    }

    /// Switches the reference on, which starts its start-up delay, or off.
    fn power_reference(&mut self, t: u64) {
        if !self.kept && self.acsr & ACBG == 0 {
            self.start_up = None;
        } else if self.start_up.is_none() {
            self.start_up = Some(RealTimeDelay::new(BANDGAP_US, self.hz, t));
        }
    }

    /// Returns the edge from which the reference has its voltage; `NEVER` while it is off.
    fn reference_ready_cycle(&self) -> u64 {
        self.start_up.map_or(NEVER, |span| span.end())
    }

    /// Returns the output of the comparator at the edge `t`: high if the positive input is above the negative
    /// one, low while the comparator is off.
    fn output_at(&self, t: u64) -> bool {
        let positive = match self.acsr & ACBG != 0 {
            true if self.reference_ready_cycle() <= t => self.bandgap_mv,
            true => 0,
            false => self.levels[0],
        };
        let negative =
            self.levels[input_index(self.channel.map_or(ComparatorInput::Ain1, ComparatorInput::Adc)).min(9)];
        self.acsr & ACD == 0 && positive > negative
    }

    /// Compares the inputs at the edge `t`. A change of the output is sent on to ACO and, with ACIC, to timer
    /// 1.
    fn compare(&mut self, t: u64, out: &mut AvrOutbox) {
        let high = self.output_at(t);
        if high == self.output {
            return;
        }
        self.output = high;
        let change = Some(OutputChange { at: self.to_io_time(t).saturating_add(SYNC_CYCLES), high });
        match &mut self.changes {
            // If the output changes more than once in a cycle, the last change counts.
            [_, second @ Some(_)] => *second = change,
            [Some(first), second] if Some(first.at) != change.map(|c| c.at) => *second = change,
            [first, _] => *first = change,
        }
        self.drive_capture_line(t, out);
    }

    fn drive_capture_line(&self, t: u64, out: &mut AvrOutbox) {
        if self.acsr & ACIC != 0 {
            out.push(AvrSignal::Drive { t, line: AvrLine::Icp, drive: AvrDrive::Value(self.output) });
        }
    }

    /// Applies to ACO all changes that are due at the local time `t`.
    fn synchronise(&mut self, t: u64, out: &mut AvrOutbox) {
        while let [Some(change), next] = self.changes {
            if change.at > t {
                break;
            }
            self.changes = [next, None];
            if self.sets_flag(change.high) {
                if self.acsr & ACI == 0 {
                    out.push(AvrSignal::Flag { t: change.at, irq: 0 });
                }
                self.acsr |= ACI;
                self.flagged = change.at;
            }
            self.aco = change.high;
        }
    }

    /// Reports whether a change of ACO to `high` sets ACI, by ACIS (table 23-2). The reserved mode selects no
    /// change.
    fn sets_flag(&self, high: bool) -> bool {
        high != self.aco
            && match self.acsr & ACIS {
                0 => true,
                2 => !high,
                3 => high,
                _ => false,
            }
    }

    /// Returns the time of the next change of ACO.
    fn aco_changes(&self) -> u64 {
        match (self.changes, self.stopped) {
            ([Some(change), _], None) => change.at,
            _ => NEVER,
        }
    }

    /// Returns the time at which the reference reaches its voltage, if that changes the output.
    fn reference_ready_event(&self) -> u64 {
        let ready = self.reference_ready_cycle();
        if self.acsr & (ACBG | ACD) == ACBG && self.output != self.output_at(ready) { ready } else { NEVER }
    }

    fn register_value(&self, reg: ComparatorRegister) -> u8 {
        match reg {
            ComparatorRegister::ACSR => self.acsr | if self.aco { ACO } else { 0 },
            ComparatorRegister::DIDR1 => self.didr1,
        }
    }
}

/// Returns the index of an input in the levels; out of range for channels that do not exist.
fn input_index(input: ComparatorInput) -> usize {
    match input {
        ComparatorInput::Ain0 => 0,
        ComparatorInput::Ain1 => 1,
        ComparatorInput::Adc(channel) => usize::from(channel) + 2,
    }
}

impl Device<AvrSignal> for AvrComparator {
    type Reg = ComparatorRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        if self.reference_ready_event() <= t {
            let ready = self.reference_ready_cycle();
            self.synchronise(self.to_io_time(ready), out);
            self.compare(ready, out);
        }
        self.synchronise(self.to_io_time(t), out);
    }

    fn next_deadline(&self) -> u64 {
        self.aco_changes().min(self.reference_ready_event())
    }

    /// Interrupt 0: analog comparator.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.acsr & (ACI | ACIE) == ACI | ACIE)
    }

    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if irq == 0 {
            self.acsr &= !ACI;
        }
    }

    fn peek(&self, reg: ComparatorRegister, t: u64) -> u8 {
        if self.next_deadline() > t {
            return self.register_value(reg);
        }
        let mut comparator = self.clone();
        comparator.run_due(t, &mut AvrOutbox::new());
        comparator.register_value(reg)
    }

    fn write(&mut self, reg: ComparatorRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if reg == ComparatorRegister::DIDR1 {
            let bits = mask & DIDR1;
            self.didr1 = self.didr1 & !bits | value & bits;
            return;
        }
        let bits = mask & (ACD | ACBG | ACIE | ACIC | ACIS);
        let before = self.acsr;
        self.acsr = before & !bits | value & bits;
        // A flag set at the very edge of the write stays set.
        if value & mask & ACI != 0 && self.flagged != t {
            self.acsr &= !ACI;
        }
        self.power_reference(t);
        self.compare(t, out);
        match (before & ACIC != 0, self.acsr & ACIC != 0) {
            (false, true) => out.push(AvrSignal::Drive { t, line: AvrLine::Icp, drive: AvrDrive::Value(self.output) }),
            (true, false) => out.push(AvrSignal::Drive { t, line: AvrLine::Icp, drive: AvrDrive::Port }),
            _ => {}
        }
    }

    /// Clears the control bits and ACI; changes on their way to ACO continue.
    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.restart_clock(t, out);
        self.run_due(t, out);
        if self.acsr & ACIC != 0 {
            out.push(AvrSignal::Drive { t, line: AvrLine::Icp, drive: AvrDrive::Port });
        }
        (self.acsr, self.didr1, self.channel) = (0, 0, None);
        self.power_reference(t);
        self.compare(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.stopped = Some(self.to_io_time(t));
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        let Some(stopped) = self.stopped.take() else { return };
        let slept = t.saturating_sub(stopped);
        for change in self.changes.iter_mut().flatten() {
            change.at = change.at.saturating_add(slept);
        }
    }

    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        if let Some(span) = &mut self.start_up {
            span.set_clock_hz(hz, t);
        }
        self.hz = hz;
    }

    fn steady_until(&self, reg: ComparatorRegister, t: u64) -> u64 {
        let change = match reg {
            ComparatorRegister::DIDR1 => NEVER,
            // A change of the output is visible in ACO two cycles later at the earliest.
            ComparatorRegister::ACSR => self.next_deadline(),
        };
        change.max(t)
    }
}
