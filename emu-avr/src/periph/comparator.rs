//! Analog comparator (section 23).
//!
//! The comparator itself is faster than any clock. Its output goes through two flip-flops to ACO (the 1 to 2 cycles of
//! 23.3.2: what changes at an edge is seen two edges later), where ACIS picks the changes that set ACI. Timer 1 takes the output
//! before them, as it has a synchroniser of its own.

use emu_core::NEVER;
use emu_core::state;

use super::real_time_delay::RealTimeDelay;
use super::{AvrDevice, AvrDrive, AvrLine, AvrOutbox, AvrSignal};

/// The registers.
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
    /// A channel of the converter, 0 to 7, which takes the place of AIN1 (23.2).
    Adc(u8),
}

const ACD: u8 = 1 << 7;
const ACBG: u8 = 1 << 6;
const ACO: u8 = 1 << 5;
const ACI: u8 = 1 << 4;
const ACIE: u8 = 1 << 3;
const ACIC: u8 = 1 << 2;
const ACIS: u8 = 3;
/// AIN1D and AIN0D.
const DIDR1: u8 = 3;

/// Cycles from a change of the output to that of ACO.
const SYNC_CYCLES: u64 = 2;
/// Typical start-up time of the bandgap reference (29, system and reset characteristics), in microseconds.
const BANDGAP_US: u32 = 40;

/// A change of the output on its way to ACO.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct OutputChange {
    /// The edge at which ACO takes it, in the time of the part.
    at: u64,
    high: bool,
}

state! { OutputChange { at, high } }

/// The comparator. Voltages are in millivolts above GND.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrComparator {
    /// AIN0, AIN1, ADC0 to ADC7.
    levels: [u32; 10],
    /// The channel in place of AIN1.
    channel: Option<u8>,
    bandgap_mv: u32,
    hz: u64,
    /// The reference is kept on by others (brown-out detector, converter).
    kept: bool,
    /// The start of the reference, while it is on.
    start_up: Option<RealTimeDelay>,
    /// ACSR without ACO.
    acsr: u8,
    didr1: u8,
    /// The output as it was found last.
    output: bool,
    aco: bool,
    /// Changes that ACO has not taken, the older one first; there cannot be more, as each cycle has one.
    changes: [Option<OutputChange>; 2],
    /// The edge at which ACI was set last.
    flagged: u64,
    /// When the clock of the part was stopped.
    stopped: Option<u64>,
}

state! {
    AvrComparator {
        levels, channel, hz, kept, start_up, acsr, didr1, output, aco, changes, flagged, stopped,
    } stays { bandgap_mv } if |of, _now| of.hz != NEVER && of.stopped != Some(NEVER)
}

impl AvrComparator {
    /// The comparator after power-on at cycle 0: all inputs at 0 V, a bandgap reference of `bandgap_mv` millivolts (1,100 on
    /// ATmega48 to 328), `hz` cycles to a second.
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

    /// The level of an input from the edge `t` on; channels that do not exist are ignored.
    pub fn set_millivolts(&mut self, input: ComparatorInput, millivolts: u32, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if let Some(level) = self.levels.get_mut(input_index(input)) {
            *level = millivolts;
        }
        self.compare(t, out);
    }

    /// The channel of the converter that is compared in place of AIN1 from the edge `t` on, as
    /// [`Adc::comparator_channel`](super::adc_kind::Adc::comparator_channel) says.
    pub fn select(&mut self, channel: Option<u8>, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.channel = channel;
        self.compare(t, out);
    }

    /// Whether others than ACBG (the brown-out detector, the converter while ADEN is set) keep the bandgap reference on, from the
    /// edge `t` on (11.7.1).
    pub fn hold_reference_on(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.kept = on;
        self.power_reference(t);
        self.compare(t, out);
    }

    /// ACI, the trigger source 1 of the converter, after everything that was run.
    #[must_use]
    pub fn flag(&self) -> bool {
        self.acsr & ACI != 0
    }

    /// DIDR1: AIN0 (bit 0) and AIN1 (bit 1) whose digital input is off, and which read 0.
    #[must_use]
    pub fn digital_off(&self) -> u8 {
        self.didr1
    }

    fn to_io_time(&self, t: u64) -> u64 {
        self.stopped.unwrap_or(t)
    }

    /// Switches the reference on, which takes its time, or off.
    fn power_reference(&mut self, t: u64) {
        if !self.kept && self.acsr & ACBG == 0 {
            self.start_up = None;
        } else if self.start_up.is_none() {
            self.start_up = Some(RealTimeDelay::new(BANDGAP_US, self.hz, t));
        }
    }

    /// The edge from which the reference gives its voltage; `NEVER` while it is off.
    fn reference_ready_cycle(&self) -> u64 {
        self.start_up.map_or(NEVER, |span| span.end())
    }

    /// The output of the comparator at the edge `t`: high where the positive input is above the negative one. It is low while
    /// the comparator is off.
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

    /// Finds the output at the edge `t`, after something has changed: the change goes on to ACO, and to timer 1 with ACIC.
    fn compare(&mut self, t: u64, out: &mut AvrOutbox) {
        let high = self.output_at(t);
        if high == self.output {
            return;
        }
        self.output = high;
        let change = Some(OutputChange { at: self.to_io_time(t).saturating_add(SYNC_CYCLES), high });
        match &mut self.changes {
            // The last one of a cycle counts.
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

    /// ACO takes the changes that are due at `t`, a time of the part.
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

    /// A change of ACO to `high` is one that ACIS asks for (table 23-2); the reserved mode asks for none.
    fn sets_flag(&self, high: bool) -> bool {
        high != self.aco
            && match self.acsr & ACIS {
                0 => true,
                2 => !high,
                3 => high,
                _ => false,
            }
    }

    /// When ACO next changes.
    fn aco_changes(&self) -> u64 {
        match (self.changes, self.stopped) {
            ([Some(change), _], None) => change.at,
            _ => NEVER,
        }
    }

    /// When the reference comes up, if that is to come and matters.
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

/// The place of an input among the levels; outside of them for channels that do not exist.
fn input_index(input: ComparatorInput) -> usize {
    match input {
        ComparatorInput::Ain0 => 0,
        ComparatorInput::Ain1 => 1,
        ComparatorInput::Adc(channel) => usize::from(channel) + 2,
    }
}

impl AvrDevice for AvrComparator {
    type Reg = ComparatorRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        if self.reference_ready_event() <= t {
            let ready = self.reference_ready_cycle();
            self.synchronise(self.to_io_time(ready), out);
            self.compare(ready, out);
        }
        self.synchronise(self.to_io_time(t), out);
    }

    fn next_cycle(&self) -> u64 {
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
        if self.next_cycle() > t {
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
        // What is set at the very edge of the write stays set.
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

    /// The control bits and ACI are cleared; the way from the inputs to ACO goes on.
    fn reset(&mut self, t: u64, out: &mut AvrOutbox) {
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
            // A change of the output is seen two cycles later at the soonest.
            ComparatorRegister::ACSR => self.next_cycle(),
        };
        change.max(t)
    }
}
