//! A voltage that changes at given cycles: pulse generators and asynchronous stimuli.

use crate::cod::value::CodValue;

/// The voltage of a pin, in millivolts, as a function of time in machine cycles.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StimulusWave {
    /// Cycle from which the times of points and periods count.
    pub start: u64,
    /// Length of a period in cycles; 0 if the wave does not repeat.
    pub period: u64,
    /// Millivolts before the first point.
    pub initial: i64,
    /// Every period begins with `initial` again; otherwise the last voltage stays.
    pub holds_last: bool,
    /// Millivolts from a cycle of the period on, sorted by cycle, one for each.
    points: Vec<WavePoint>,
}

/// A point of a waveform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct WavePoint {
    /// The cycle within the period.
    time: u64,
    /// The value from then on.
    value: i64,
}

impl StimulusWave {
    /// Sets the pin to `millivolts` from `cycle` of each period on.
    pub fn set(&mut self, cycle: u64, millivolts: i64) {
        match self.points.binary_search_by_key(&cycle, |point| point.time) {
            Ok(at) => {
                if let Some(point) = self.points.get_mut(at) {
                    point.value = millivolts;
                }
            }
            Err(at) => self.points.insert(at, WavePoint { time: cycle, value: millivolts }),
        }
    }

    /// Removes the point at `cycle`.
    pub fn delete(&mut self, cycle: u64) {
        self.points.retain(|point| point.time != cycle);
    }

    /// Returns the points within a period.
    fn reached(&self) -> impl DoubleEndedIterator<Item = WavePoint> + '_ {
        let end = if self.period == 0 { u64::MAX } else { self.period };
        self.points.iter().copied().filter(move |point| point.time < end)
    }

    /// Returns the millivolts at a cycle.
    #[must_use]
    pub fn at(&self, cycle: u64) -> i64 {
        let Some(since) = cycle.checked_sub(self.start) else { return self.initial };
        let lap = since.checked_div(self.period).unwrap_or(0);
        let phase = since - lap * self.period;
        let point = self.reached().rev().find(|WavePoint { time: at, .. }| *at <= phase);
        let before = || if lap == 0 || self.holds_last { None } else { self.reached().last() };
        point.or_else(before).map_or(self.initial, |WavePoint { value: level, .. }| level)
    }

    /// Returns the next cycle after `cycle` at which the voltage may change.
    #[must_use]
    pub fn next(&self, cycle: u64) -> Option<u64> {
        let first = self.reached().next()?.time;
        let Some(since) = cycle.checked_sub(self.start) else { return self.start.checked_add(first) };
        let lap = since.checked_div(self.period).unwrap_or(0);
        let phase = since - lap * self.period;
        let base = self.start.checked_add(lap.checked_mul(self.period)?)?;
        if let Some(WavePoint { time: at, .. }) = self.reached().find(|WavePoint { time: at, .. }| *at > phase) {
            return base.checked_add(at);
        }
        let over = base.checked_add(self.period).filter(|_| self.period > 0)?;
        if self.holds_last { Some(over) } else { over.checked_add(first) }
    }

    /// Sets an attribute of a pulse generator: `set`, `clear`, `delete`, `period` (cycles) or `initial`
    /// (volts). Returns false if there is no such attribute or the value has another type.
    pub fn assign(&mut self, attribute: &str, value: &CodValue) -> bool {
        let cycle = || value.to_integer().and_then(|i| u64::try_from(i).ok());
        match (attribute, cycle()) {
            ("set", Some(cycle)) => self.set(cycle, 5000),
            ("clear", Some(cycle)) => self.set(cycle, 0),
            ("delete", Some(cycle)) => self.delete(cycle),
            ("period", Some(cycles)) => self.period = cycles,
            ("initial", _) => match value.to_real() {
                // A pulse has two levels.
                Some(volts) => self.initial = if volts > 2.5 { 5000 } else { 0 },
                None => return false,
            },
            _ => return false,
        }
        true
    }
}
