//! Times as written in scenarios, and their conversion to ticks of a machine.

use diag::Pos;

use crate::error::ScenarioError;

/// Maximum number of ticks; no run is that long.
pub(crate) const MAX_TICKS: u64 = 1 << 62;

/// Maximum number of digits of a time, so that products fit in 128 bits.
const MAX_DIGITS: usize = 18;

/// The unit of a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeUnit {
    /// A power of ten below the second: 10 to minus this number (0, 3, 6, 9) seconds.
    Second(u32),
    /// Machine cycles; for a ladder program, periods of its CRYSTAL=.
    Cycle,
    /// Clocks of the oscillator.
    Clock,
    /// Scans of a ladder program.
    Scan,
}

/// An exact length of time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimeSpan {
    /// The number without its decimal point.
    pub mantissa: u64,
    /// Number of decimals; 0 for cycles, clocks and scans.
    pub decimals: u32,
    /// The unit.
    pub unit: TimeUnit,
    /// The time as written.
    pub text: String,
    /// Position in the file.
    pub pos: Pos,
    /// True if a time within a tick is rounded up to the end of the tick, even if the machine rounds down.
    pub round_up: bool,
}

impl TimeSpan {
    /// Parses `10ms`, `2.5us`, `1000 cycles`, `5 scans`.
    ///
    /// # Errors
    /// The text is not a number with a known unit, has too many digits, or has decimals in a count.
    pub fn parse(text: &str, pos: Pos) -> Result<TimeSpan, ScenarioError> {
        let trimmed = text.trim();
        let end = trimmed.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(trimmed.len());
        let (number, unit) = trimmed.split_at(end);
        let whole = |digits: &str| !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        let (units, tenths) = number.split_once('.').map_or((number, None), |(units, tenths)| (units, Some(tenths)));
        if !whole(units) || tenths.is_some_and(|tenths| !whole(tenths)) {
            return Err(ScenarioError::NotATime { text: message_text(text) });
        }
        let digits = format!("{units}{}", tenths.unwrap_or_default());
        if digits.trim_start_matches('0').len() > MAX_DIGITS || digits.len() > 4 * MAX_DIGITS {
            return Err(ScenarioError::TooManyDigits { text: message_text(text), most: MAX_DIGITS });
        }
        let decimals = tenths.map_or(0, str::len) as u32;
        let found = match unit.trim() {
            "s" => TimeUnit::Second(0),
            "ms" => TimeUnit::Second(3),
            "us" => TimeUnit::Second(6),
            "ns" => TimeUnit::Second(9),
            "c" | "cycle" | "cycles" => TimeUnit::Cycle,
            "clock" | "clocks" => TimeUnit::Clock,
            "scan" | "scans" => TimeUnit::Scan,
            "" => return Err(ScenarioError::MissingUnit { text: message_text(text) }),
            other => return Err(ScenarioError::UnknownUnit { unit: message_text(other) }),
        };
        if decimals > 0 && !matches!(found, TimeUnit::Second(_)) {
            return Err(ScenarioError::FractionalCount { text: message_text(text), unit: unit.trim().to_owned() });
        }
        let mantissa = digits.parse().unwrap_or(0);
        Ok(TimeSpan { mantissa, decimals, unit: found, text: trimmed.to_owned(), pos, round_up: false })
    }
}

/// A text shortened to 40 characters without control characters, for messages.
pub(crate) fn message_text(text: &str) -> String {
    let clean = |c: char| if c.is_control() { '?' } else { c };
    let short: String = text.chars().take(40).map(clean).collect();
    if text.chars().count() > 40 { short + ".." } else { short }
}

/// The length of the units of time in ticks of a machine, as fractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeScale {
    /// Ticks per second as (numerator, denominator); both are above 0, as in the other fractions.
    pub second: (u64, u64),
    /// Ticks per machine cycle.
    pub cycle: (u64, u64),
    /// Ticks per clock of the oscillator.
    pub clock: (u64, u64),
    /// Ticks per scan, if the machine has scans.
    pub scan: Option<u64>,
    /// True if a time within a tick is rounded up to the end of the tick, false if it is rounded down.
    pub round_up: bool,
}

impl TimeScale {
    /// A ladder program with a cycle of `cycle_us` microseconds and an oscillator of `hz` Hz: a tick is a
    /// scan.
    #[must_use]
    pub fn for_scans(cycle_us: u64, hz: u64) -> TimeScale {
        let (cycle_us, hz) = (cycle_us.max(1), hz.max(1));
        let clock = (1_000_000, cycle_us.saturating_mul(hz));
        TimeScale { second: (1_000_000, cycle_us), cycle: clock, clock, scan: Some(1), round_up: true }
    }

    /// A machine with an oscillator of `hz` Hz and `clocks` clocks per cycle: a tick is a clock.
    #[must_use]
    pub fn for_clocks(hz: u64, clocks: u32) -> TimeScale {
        TimeScale { second: (hz.max(1), 1), cycle: (clocks.into(), 1), clock: (1, 1), scan: None, round_up: false }
    }

    /// Converts a time to ticks.
    ///
    /// # Errors
    /// The machine has no scans, or the time is longer than 2^62 ticks.
    pub fn ticks(&self, span: &TimeSpan) -> Result<u64, ScenarioError> {
        let (num, den) = match span.unit {
            TimeUnit::Second(_) => self.second,
            TimeUnit::Cycle => self.cycle,
            TimeUnit::Clock => self.clock,
            TimeUnit::Scan => match self.scan {
                Some(scan) => (scan, 1),
                None => return Err(ScenarioError::NoScans { time: span.text.clone() }),
            },
        };
        let places = span.decimals + if let TimeUnit::Second(places) = span.unit { places } else { 0 };
        let too_long = || ScenarioError::TimeTooLong { time: span.text.clone() };
        let num = u128::from(span.mantissa) * u128::from(num);
        // A denominator that does not fit in 128 bits is larger than any numerator.
        let den = 10u128.checked_pow(places).and_then(|p| p.checked_mul(den.max(1).into())).unwrap_or(u128::MAX);
        let ticks = if self.round_up || span.round_up { num.div_ceil(den) } else { num / den };
        u64::try_from(ticks).ok().filter(|ticks| *ticks <= MAX_TICKS).ok_or_else(too_long)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows are `text | ticks in scans of 10 ms at 4 MHz | ticks at 4 MHz with 4 clocks per cycle`; `-` means
    /// refused.
    const TIMES: &str = "
        10ms        | 1   | 40000
        10.01ms     | 2   | 40040
        0s          | 0   | 0
        2.5us       | 1   | 10
        0.0000000000000000000000000000000000000000001s | 1 | 0
        0.0000000000000000000000000000000000000000000s | 0 | 0
        1 s         | 100 | 4000000
        3 cycles    | 1   | 12
        7 clocks    | 1   | 7
        40000c      | 1   | 160000
        40001 clocks| 2   | 40001
        5 scans     | 5   | -
        1 scan      | 1   | -
        5           | -   | -
        5 weeks     | -   | -
        1.5 scans   | -   | -
        .5s         | -   | -
        1.s         | -   | -
        -1s         | -   | -
        9223372036854775807s | - | -
        999999999999999999s  | - | -
    ";

    #[test]
    fn times() {
        for row in TIMES.lines().filter(|row| row.contains('|')) {
            let cells: Vec<&str> = row.split('|').map(str::trim).collect();
            let scales = [TimeScale::for_scans(10_000, 4_000_000), TimeScale::for_clocks(4_000_000, 4)];
            for (scale, wanted) in scales.iter().zip(&cells[1..]) {
                let found = TimeSpan::parse(cells[0], Pos::default()).ok().and_then(|span| scale.ticks(&span).ok());
                assert_eq!(found.map_or("-".to_owned(), |ticks| ticks.to_string()), **wanted, "{}", cells[0]);
            }
        }
    }
}
