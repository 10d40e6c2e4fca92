//! The scan period in all back ends: exact fractions, and the range that a chip can pace.

/// The periods that the timers of a chip can pace at a clock, in microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeriodRange {
    /// Shortest period.
    pub shortest_us: u64,
    /// Longest period.
    pub longest_us: u64,
}

impl From<PeriodRange> for crate::target::BuildRefusal {
    fn from(range: PeriodRange) -> Self {
        Self::PeriodOutOfRange { shortest: range.shortest_us, longest: range.longest_us }
    }
}

/// A fraction in lowest terms, wide enough for the product of a clock and a period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ReducedFraction {
    /// Numerator.
    pub num: u128,
    /// Denominator.
    pub den: u128,
}

/// Reduces a fraction to lowest terms.
pub(crate) fn reduce_fraction(num: u128, den: u128) -> ReducedFraction {
    let (mut a, mut b) = (num, den);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    let by = a.max(1);
    ReducedFraction { num: num / by, den: den / by }
}
