//! Measures the PWM output at its pin and compares it with the expected duty cycle. All times are clocks
//! since power-up.

use crate::chip::deviation::Deviation;

/// Number of periods until a new duty cycle must be visible.
const SETTLING_PERIODS: u64 = 2;

/// The expected timing of the PWM output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ExpectedPwm {
    /// Clocks per period, as a fraction (numerator, denominator).
    pub period: (u128, u128),
    /// Number of steps of the duty cycle.
    pub steps: u64,
    /// Tolerance of a measurement in clocks: the machine cycles in which the two edges are observed.
    pub tolerance_clocks: u64,
}

impl ExpectedPwm {
    fn clocks(&self) -> u64 {
        (self.period.0 / self.period.1.max(1)) as u64
    }

    /// Checks one period of `period` clocks with `high` clocks high at `duty` percent; returns its
    /// deviation if it is wrong.
    fn check_period(&self, period: u64, high: u64, duty: u8) -> Option<Deviation> {
        let (num, den) = self.period;
        let expected = num / den.max(1);
        if u128::from(period).abs_diff(expected) > u128::from(self.tolerance_clocks) + 1 {
            return Some(Deviation::new(format!("a period of {expected} clocks"), format!("{period} clocks")));
        }
        // The tolerance is one step: |high / period - duty / 100| <= 1 / steps.
        let deviation = (u128::from(high) * 100).abs_diff(u128::from(period) * u128::from(duty));
        let max_deviation =
            u128::from(period) * 100 / u128::from(self.steps.max(1)) + 100 * u128::from(self.tolerance_clocks);
        (deviation > max_deviation).then(|| {
            let expected = format!("{duty} % of {period} clocks high, within 1 of {} steps", self.steps);
            Deviation::new(expected, format!("{high} clocks high"))
        })
    }
}

/// A meter at the pin of the PWM output; a clone measures independently.
#[derive(Debug, Clone)]
pub(crate) struct PwmMeter {
    expected: ExpectedPwm,
    /// The expected duty cycle in percent; `None` before the first is set.
    duty: Option<u8>,
    /// The clock from which on `duty` must be visible.
    from: u64,
    /// Whether the pin is high.
    high: bool,
    /// The clock of the last rising edge since `from`.
    rose: Option<u64>,
    /// The clock of the falling edge after it.
    fell: Option<u64>,
    /// Number of whole periods measured.
    whole_periods: u64,
    /// The first fault that was measured.
    fault: Option<Deviation>,
}

impl PwmMeter {
    /// A meter at a pin that is low.
    pub(crate) fn new(expected: ExpectedPwm) -> PwmMeter {
        PwmMeter { expected, duty: None, from: 0, high: false, rose: None, fell: None, whole_periods: 0, fault: None }
    }

    /// Sets the expected duty cycle; the program sets it at clock `now` at the latest.
    pub(crate) fn set_duty(&mut self, now: u64, duty: Option<u8>) {
        if duty != self.duty {
            self.duty = duty;
            self.from = now + SETTLING_PERIODS * self.expected.clocks();
            (self.rose, self.fell, self.whole_periods) = (None, None, 0);
        }
    }

    /// The expected duty cycle in percent.
    pub(crate) fn duty(&self) -> Option<u8> {
        self.duty
    }

    /// Records that the pin changed to `high` at clock `at`.
    pub(crate) fn note_edge(&mut self, at: u64, high: bool) {
        if high == self.high {
            return;
        }
        self.high = high;
        if at < self.from || self.fault.is_some() {
            return;
        }
        match self.duty {
            None => self.fault = Some(Deviation::new("a pin that stays low until a duty is set", "an edge")),
            Some(0) => self.fault = Some(Deviation::new("a duty of 0 %, constantly low", "an edge")),
            Some(100) => self.fault = Some(Deviation::new("a duty of 100 %, constantly high", "an edge")),
            Some(duty) if high => {
                if let (Some(rose), Some(fell)) = (self.rose, self.fell) {
                    self.whole_periods += 1;
                    self.fault = self.expected.check_period(at - rose, fell - rose, duty);
                }
                (self.rose, self.fell) = (Some(at), None);
            }
            Some(_) => self.fell = Some(at),
        }
    }

    /// Returns the number of values compared until `now`, or the deviation of a wrong output.
    pub(crate) fn judge(&self, now: u64) -> Result<u64, Deviation> {
        if let Some(fault) = &self.fault {
            return Err(fault.clone());
        }
        let level = |high: bool| if high { "high" } else { "low" }.to_owned();
        match self.duty {
            _ if now < self.from => Ok(0),
            None | Some(0) if self.high => Err(Deviation::new("the PWM output low", level(true))),
            Some(100) if !self.high => Err(Deviation::new("the PWM output high", level(false))),
            None | Some(0 | 100) => Ok(1),
            Some(duty) if self.whole_periods == 0 && now > self.from + 3 * self.expected.clocks() => Err(
                Deviation::new(format!("periods with {duty} % high"), format!("none, the pin is {}", level(self.high))),
            ),
            Some(_) => Ok(u64::from(self.whole_periods > 0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WANTED: ExpectedPwm = ExpectedPwm { period: (1000, 1), steps: 256, tolerance_clocks: 1 };

    /// Rows are `duty | period | high | agrees`, with pulses for ten periods after the duty cycle is set.
    #[test]
    fn pulses_are_measured() {
        for (duty, period, high, agrees) in [
            (50, 1000, 500, true),
            (50, 1000, 504, true),
            (50, 1000, 510, false),
            (50, 1004, 502, false),
            (1, 1000, 10, true),
            (1, 1000, 1, false),
            (100, 1000, 999, false),
            (0, 1000, 1, false),
        ] {
            let mut meter = PwmMeter::new(WANTED);
            meter.set_duty(0, Some(duty));
            for n in 0..10 {
                meter.note_edge(n * period + 10, true);
                meter.note_edge(n * period + 10 + high, false);
            }
            assert_eq!(meter.judge(11_000).is_ok(), agrees, "{duty} {period} {high}");
        }
    }

    /// Rows are `duty | level | agrees`, with a pin that does not change.
    #[test]
    fn levels_are_looked_at() {
        let (on, off) = (true, false);
        for (duty, high, agrees) in [
            (None, off, true),
            (None, on, false),
            (Some(0), off, true),
            (Some(0), on, false),
            (Some(100), on, true),
            (Some(100), off, false),
            (Some(50), on, false),
            (Some(50), off, false),
        ] {
            let mut meter = PwmMeter::new(WANTED);
            meter.set_duty(0, duty);
            meter.note_edge(10, high);
            meter.high = high;
            meter.fault = None;
            assert_eq!(meter.judge(100_000).is_ok(), agrees, "{duty:?} {high}");
        }
    }
}
