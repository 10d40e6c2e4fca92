//! Times and frequencies in user notation, computed exactly: fractions of integers, rounded down once at the
//! end.

use std::time::Duration;

use emu_core::pins::CycleTime;

use crate::text::input_error::{InputError, malformed};

/// Maximum time in machine cycles.
pub const MAX_CYCLES: u64 = 1 << 62;

/// Maximum number of digits, so that the products below fit in 128 bits.
const MAX_DIGITS: usize = 19;

/// Converts between cycles and seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleClock {
    /// Oscillator frequency in Hz; above 0.
    pub hz: u64,
    /// Oscillator clocks per machine cycle; above 0.
    pub clocks_per_cycle: u32,
}

impl CycleClock {
    /// Parses a time to machine cycles: a decimal number and `s`, `ms`, `us` or `ns`, or whole cycles with
    /// `c`. A time within a cycle counts as the start of that cycle.
    ///
    /// # Errors
    /// Not such a text, or longer than [`MAX_CYCLES`].
    pub fn parse_cycles(self, text: &str) -> Result<u64, InputError> {
        self.parse_moment(text).map(|time| time.cycle)
    }

    /// Parses a time since power-up as [`CycleClock::parse_cycles`] does, but with the resolution of a clock:
    /// a time within a clock counts as its start.
    ///
    /// # Errors
    /// As [`CycleClock::parse_cycles`].
    pub fn parse_moment(self, text: &str) -> Result<CycleTime, InputError> {
        let wanted = || malformed(text, "time", "2s, 10ms, 2.5us, 100ns or 1000c (cycles)");
        let WrittenQuantity { number, unit } = WrittenQuantity::split(text);
        let per_cycle = u128::from(self.clocks_per_cycle.max(1));
        let too_long = || {
            let seconds = u128::from(MAX_CYCLES) * per_cycle / u128::from(self.hz.max(1));
            InputError::TimeTooLong { text: text.to_owned(), seconds, hz: self.hz }
        };
        if too_many_digits(number) {
            return Err(too_long());
        }
        let DecimalNumber { mantissa, decimals } = parse_decimal(number).ok_or_else(wanted)?;
        let clocks = if unit == "c" {
            (decimals == 0).then_some(mantissa).ok_or_else(wanted)?.checked_mul(per_cycle).ok_or_else(too_long)?
        } else {
            let per_second = 10u128.pow(decimals + unit_exponent(unit).ok_or_else(wanted)?);
            mantissa.checked_mul(u128::from(self.hz)).ok_or_else(too_long)? / per_second
        };
        let cycle = u64::try_from(clocks / per_cycle).ok().filter(|&c| c <= MAX_CYCLES).ok_or_else(too_long)?;
        Ok(CycleTime { cycle, phase: (clocks % per_cycle) as u8 })
    }

    /// Returns the duration of `cycles` in seconds.
    #[must_use]
    pub fn seconds(self, cycles: u64) -> f64 {
        cycles as f64 * f64::from(self.clocks_per_cycle) / self.hz as f64
    }
}

/// Parses a frequency in whole Hz: a decimal number, alone or with `Hz`, `kHz` or `MHz` (case is ignored).
///
/// # Errors
/// Not such a text, zero, or not a whole number of Hz.
pub fn parse_hertz(text: &str) -> Result<u64, InputError> {
    let WrittenQuantity { number, unit } = WrittenQuantity::split(text);
    let zeros = match unit.to_ascii_lowercase().as_str() {
        "" | "hz" => 0,
        "khz" => 3,
        "mhz" => 6,
        _ => return Err(malformed(text, "frequency", "16MHz, 32.768kHz or 8000000")),
    };
    let parsed = parse_decimal(number).ok_or_else(|| malformed(text, "frequency", "16MHz or 8000000"))?;
    let DecimalNumber { mantissa, decimals } = parsed;
    let (up, down) = (10u128.pow(zeros), 10u128.pow(decimals));
    let scaled = mantissa * up;
    if scaled % down != 0 {
        return Err(InputError::NotWhole { text: text.to_owned(), unit: "Hz" });
    }
    match u64::try_from(scaled / down) {
        Ok(0) => Err(InputError::ZeroFrequency),
        Ok(hz) => Ok(hz),
        Err(_) => Err(InputError::FrequencyTooHigh { text: text.to_owned() }),
    }
}

/// Parses a time of the host: a decimal number and `s`, `ms`, `us` or `ns`.
///
/// # Errors
/// Not such a text, or longer than 2^64 ns.
pub fn parse_duration(text: &str) -> Result<Duration, InputError> {
    let wanted = || malformed(text, "time", "30s or 500ms");
    let too_long = || InputError::DurationTooLong { text: text.to_owned() };
    let WrittenQuantity { number, unit } = WrittenQuantity::split(text);
    if too_many_digits(number) {
        return Err(too_long());
    }
    let DecimalNumber { mantissa, decimals } = parse_decimal(number).ok_or_else(wanted)?;
    let exponent = unit_exponent(unit).ok_or_else(wanted)?;
    let nanos = mantissa * 10u128.pow(9 - exponent) / 10u128.pow(decimals);
    u64::try_from(nanos).map(Duration::from_nanos).map_err(|_| too_long())
}

/// A number with its unit, neither of them checked.
pub(crate) struct WrittenQuantity<'t> {
    pub number: &'t str,
    pub unit: &'t str,
}

impl WrittenQuantity<'_> {
    /// Splits a text such as `2.5 ms` behind its number.
    pub(crate) fn split(text: &str) -> WrittenQuantity<'_> {
        let text = text.trim();
        let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
        let (number, unit) = text.split_at(end);
        WrittenQuantity { number, unit: unit.trim_start() }
    }
}

/// Returns true if the integer part has more digits than allowed; leading zeros do not count.
fn too_many_digits(number: &str) -> bool {
    let whole = number.split('.').next().unwrap_or_default();
    whole.trim_start_matches('0').len() > MAX_DIGITS
}

/// A decimal number.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DecimalNumber {
    /// The digits without the decimal point.
    pub(crate) mantissa: u128,
    /// The number of digits after the point.
    pub(crate) decimals: u32,
}

/// Returns the mantissa and the number of decimals.
pub(crate) fn parse_decimal(text: &str) -> Option<DecimalNumber> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    if whole.is_empty() || text.ends_with('.') || whole.len() + fraction.len() > MAX_DIGITS {
        return None;
    }
    let mantissa = format!("{whole}{fraction}").parse().ok()?;
    Some(DecimalNumber { mantissa, decimals: fraction.len() as u32 })
}

/// Returns the unit as a negative power of 10, in seconds.
fn unit_exponent(unit: &str) -> Option<u32> {
    Some(match unit {
        "s" => 0,
        "ms" => 3,
        "us" => 6,
        "ns" => 9,
        _ => return None,
    })
}
