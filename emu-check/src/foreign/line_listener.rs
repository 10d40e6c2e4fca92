//! A probe at the pins of a foreign image: the serial line, the PWM outputs, the buses, and all outputs
//! before the first scan.

use emu_core::cpu::Probe;
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use crate::chip::bus_devices::BusDevices;
use crate::chip::deviation::Deviation;
use crate::chip::serial_line::SerialListener;

use super::foreign_board::ForeignBoard;

/// The probe at the pins of a foreign image.
#[derive(Debug, Clone)]
pub(crate) struct LineListener {
    clocks: u64,
    /// The transmitter's pin with its receiver.
    pub serial: Option<(PinId, SerialListener)>,
    /// The pins of the PWM outputs with their meters.
    pub pwm: Vec<(PinId, ForeignPwmMeter)>,
    /// The devices on the buses.
    pub buses: Option<BusDevices>,
    /// Outputs with the clock of their first rising edge; they are observed until the first scan has started.
    pub outputs: Vec<(PinId, Option<u64>)>,
    /// True until the first scan has started.
    pub is_before_first_scan: bool,
}

impl LineListener {
    /// Makes the receivers of the lines that the board has.
    pub(super) fn new(board: &ForeignBoard) -> LineListener {
        let of = &board.peripherals;
        LineListener {
            clocks: of.clocks_per_cycle,
            serial: of.transmit.map(|pin| (pin, SerialListener::new(of.bit_time, 2 * of.clocks_per_cycle))),
            pwm: board
                .pwm
                .iter()
                .map(|&(pin, hertz)| (pin, ForeignPwmMeter::new(board.pace.clock_hz, hertz, of.clocks_per_cycle)))
                .collect(),
            buses: BusDevices::new(of.buses),
            outputs: board.outputs.iter().map(|&(_, pin)| (pin, None)).collect(),
            is_before_first_scan: true,
        }
    }
}

impl Probe for LineListener {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        let ChipEvent::Edge { at: CycleTime { cycle, phase }, pin, level } = event else { return false };
        let (clock, high) = (cycle * self.clocks + u64::from(phase), level == PinLevel::High);
        if let Some((line, listener)) = &mut self.serial
            && *line == pin
        {
            listener.note_edge(clock, high);
        }
        for (_, pulses) in self.pwm.iter_mut().filter(|(output, _)| *output == pin) {
            pulses.note_edge(clock, high);
        }
        // An edge in the first two cycles is caused by the reset of the chip.
        if self.is_before_first_scan && high && cycle > 1 {
            self.outputs.iter_mut().filter(|output| output.0 == pin).for_each(|output| {
                output.1.get_or_insert(clock);
            });
        }
        self.buses.as_mut().is_some_and(|buses| {
            buses.note_edge(pin, high);
            buses.drive.is_some()
        })
    }
}

/// Tolerance of the period in percent; the timer setup of the other compiler is not known.
const PERIOD_PERCENT: u64 = 5;
/// Tolerance of the duty cycle in percentage points.
const DUTY_PERCENT: u64 = 2;

/// Number of periods until a new duty cycle must be visible.
const SETTLING_PERIODS: u64 = 3;

/// Measures the PWM output, in clocks.
#[derive(Debug, Clone)]
pub(crate) struct ForeignPwmMeter {
    period: u64,
    tolerance_clocks: u64,
    duty: Option<u8>,
    from: u64,
    high: bool,
    rose: Option<u64>,
    fell: Option<u64>,
    edges: u64,
    fault: Option<Deviation>,
}

impl ForeignPwmMeter {
    /// A meter for an output of `hertz` Hz; `tolerance_clocks` is the tolerance of an edge.
    pub(super) fn new(clock_hz: u64, hertz: u64, tolerance_clocks: u64) -> ForeignPwmMeter {
        let period = clock_hz / hertz.max(1);
        let (duty, rose, fell, fault) = (None, None, None, None);
        ForeignPwmMeter { period, tolerance_clocks, duty, from: 0, high: false, rose, fell, edges: 0, fault }
    }

    /// Sets the duty cycle of a scan that is over at clock `now`.
    pub(super) fn set_duty(&mut self, now: u64, duty: Option<u8>) {
        if duty != self.duty {
            self.duty = duty;
            self.from = now.saturating_add(SETTLING_PERIODS * self.period * (100 + PERIOD_PERCENT) / 100);
            (self.rose, self.fell, self.edges) = (None, None, 0);
        }
    }

    /// Records that the pin changed to `high` at clock `at`.
    pub(super) fn note_edge(&mut self, at: u64, high: bool) {
        if high == self.high {
            return;
        }
        self.high = high;
        if at < self.from || self.fault.is_some() {
            return;
        }
        self.edges += 1;
        if !high {
            self.fell = Some(at);
            return;
        }
        if let (Some(rose), Some(fell), Some(duty)) = (self.rose, self.fell, self.duty) {
            let (period, up) = (at - rose, fell.saturating_sub(rose));
            if period.abs_diff(self.period) * 100 > self.period * PERIOD_PERCENT + 100 * self.tolerance_clocks {
                let wanted = format!("PWM with a period of {} clocks, to {PERIOD_PERCENT} %", self.period);
                self.fault = Some(Deviation::new(wanted, format!("{period} clocks")));
            } else if (up * 100).abs_diff(period * u64::from(duty))
                > period * DUTY_PERCENT + 100 * self.tolerance_clocks
            {
                let wanted = format!("PWM high for {duty} % of the time, to {DUTY_PERCENT} points");
                self.fault = Some(Deviation::new(wanted, format!("{up} of {period} clocks")));
            }
        }
        (self.rose, self.fell) = (Some(at), None);
    }

    /// The error of the output at clock `now` if there is one.
    pub(super) fn judge(&self, now: u64) -> Option<Deviation> {
        if self.fault.is_some() || now < self.from {
            return self.fault.clone();
        }
        let level = if self.high { "high" } else { "low" }.to_owned();
        let says = |wanted: &str, found: String| Some(Deviation::new(wanted, found));
        match self.duty {
            None | Some(0) if self.high || self.edges > 0 => {
                says("the PWM output constantly low", format!("pulses, {level} now"))
            }
            Some(100) if !self.high || self.edges > 0 => {
                says("the PWM output constantly high", format!("pulses, {level} now"))
            }
            Some(1..=99) if self.edges == 0 && now > self.from + 3 * self.period => {
                says("PWM pulses", format!("none, the pin is {level}"))
            }
            _ => None,
        }
    }
}
