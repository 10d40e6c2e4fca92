//! Times of a waveform: ticks of its time scale, and labels of the time axis.

use emu_debug::{CycleClock, InputError};
use vcd::TimescaleUnit;

/// Femtoseconds per second.
const SECOND: u128 = 1_000_000_000_000_000;

/// Units with their length in femtoseconds, longest first.
const UNITS: &[(&str, u128)] =
    &[("s", SECOND), ("ms", SECOND / 1000), ("us", 1_000_000_000), ("ns", 1_000_000), ("ps", 1000), ("fs", 1)];

/// The time scale of a waveform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WaveTimescale {
    /// Length of a tick in femtoseconds, greater than 0.
    step: u128,
}

impl WaveTimescale {
    /// Creates the time scale of a file.
    pub fn new(number: u32, unit: TimescaleUnit) -> WaveTimescale {
        let unit = match unit {
            TimescaleUnit::S => SECOND,
            TimescaleUnit::MS => SECOND / 1000,
            TimescaleUnit::US => 1_000_000_000,
            TimescaleUnit::NS => 1_000_000,
            TimescaleUnit::PS => 1000,
            TimescaleUnit::FS => 1,
        };
        WaveTimescale { step: unit * u128::from(number.max(1)) }
    }

    /// Parses a time and returns its tick: `10ms`, or `5c` for tick 5.
    pub fn ticks(self, text: &str) -> Result<u64, InputError> {
        if text.trim().ends_with('c') {
            return CycleClock { hz: 1, clocks_per_cycle: 1 }.parse_cycles(text);
        }
        // Ticks longer than a second are whole seconds.
        let per_second = u64::try_from(SECOND / self.step).unwrap_or(u64::MAX).max(1);
        let seconds = u64::try_from(self.step / SECOND).unwrap_or(u64::MAX).max(1);
        Ok(CycleClock { hz: per_second, clocks_per_cycle: 1 }.parse_cycles(text)? / seconds)
    }

    /// Returns at most `most` labels for an axis: the tick and its text. Their distance is a round time (1, 2
    /// or 5 times a power of ten).
    pub fn axis_figures(self, from: u64, to: u64, most: u32) -> Vec<(u64, String)> {
        let span = u128::from(to.saturating_sub(from).max(1)) * self.step;
        let least = span / u128::from(most.max(1));
        let mut apart = self.step.max(1);
        let mut round = 1u128;
        while apart <= least {
            let next = [round, 2 * round, 5 * round].into_iter().find(|next| *next > least && *next >= self.step);
            if let Some(next) = next {
                apart = next;
                break;
            }
            round *= 10;
        }
        let first = (u128::from(from) * self.step).div_ceil(apart);
        let end = u128::from(to) * self.step;
        let unit = self.unit(apart.max(1), end);
        (first..)
            .map(|n| n * apart)
            .take_while(|at| *at <= end)
            .map(|at| (at, unit))
            .map(|(at, unit)| (u64::try_from(at / self.step).unwrap_or(u64::MAX), figure(at, unit)))
            .collect()
    }

    /// Returns the text of a tick's time.
    pub fn text(self, at: u64) -> String {
        let at = u128::from(at) * self.step;
        figure(at, self.unit(at, at))
    }

    /// Returns a unit in which the labels of an axis have few digits: the longest one that the end of the
    /// axis reaches.
    fn unit(self, apart: u128, end: u128) -> (&'static str, u128) {
        let fits = |unit: &&(&str, u128)| end >= unit.1 && apart.saturating_mul(1000) >= unit.1;
        UNITS.iter().find(fits).copied().unwrap_or(("s", SECOND))
    }
}

/// Returns a time in a unit, with the necessary decimals.
fn figure(at: u128, (name, unit): (&str, u128)) -> String {
    if at == 0 {
        return "0".to_owned();
    }
    let (whole, rest) = (at / unit, at % unit);
    if rest == 0 {
        return format!("{whole} {name}");
    }
    let digits = unit.ilog10() as usize;
    let decimals = format!("{rest:0digits$}");
    format!("{whole}.{} {name}", decimals.trim_end_matches('0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes() {
        let rows = [
            (1, TimescaleUnit::NS, 0, 1000, 5, "0 0.5 us 1 us"),
            (1, TimescaleUnit::NS, 0, 1000, 4, "0 0.5 us 1 us"),
            (100, TimescaleUnit::PS, 0, 200, 4, "0 10 ns 20 ns"),
            (1, TimescaleUnit::US, 10_500, 12_500, 4, "11 ms 12 ms"),
            (1, TimescaleUnit::S, 0, 2, 8, "0 1 s 2 s"),
            (10, TimescaleUnit::NS, 3, 5, 8, "30 ns 40 ns 50 ns"),
        ];
        for (number, unit, from, to, most, wanted) in rows {
            let figures = WaveTimescale::new(number, unit).axis_figures(from, to, most);
            let texts: Vec<String> = figures.into_iter().map(|(_, text)| text).collect();
            println!("{number} {unit:?} {from} {to}: {}", texts.join(" "));
            assert_eq!(texts.join(" "), wanted);
        }
        // 18,447 s: a distance of 5,000 s would give four labels.
        assert_eq!(WaveTimescale::new(1, TimescaleUnit::FS).axis_figures(0, u64::MAX, 3).len(), 2);
        assert!(WaveTimescale::new(100, TimescaleUnit::S).axis_figures(0, u64::MAX, 3).len() <= 4);
    }

    #[test]
    fn times() {
        let scale = WaveTimescale::new(100, TimescaleUnit::PS);
        for (text, wanted) in [("1us", Ok(10_000)), ("0.05ns", Ok(0)), ("7c", Ok(7)), ("x", Err(()))] {
            assert_eq!(scale.ticks(text).map_err(|_| ()), wanted, "{text}");
        }
        assert_eq!(WaveTimescale::new(10, TimescaleUnit::S).ticks("25s"), Ok(2));
        assert_eq!(scale.text(15), "1.5 ns");
    }
}
