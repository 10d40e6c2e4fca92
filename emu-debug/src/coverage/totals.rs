//! The coverage in numbers.

use super::CoveredInstruction;
use super::lcov::LcovRecord;

/// A covered share of a total.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CoveredShare {
    /// Number covered.
    pub covered: u64,
    /// Total number.
    pub total: u64,
}

impl CoveredShare {
    /// Returns the share of things for which `seen` is true.
    pub fn of<T>(things: impl IntoIterator<Item = T>, seen: impl Fn(&T) -> bool) -> CoveredShare {
        let mut part = CoveredShare::default();
        for thing in things {
            part.covered += u64::from(seen(&thing));
            part.total += 1;
        }
        part
    }

    /// Returns the share in tenths of a percent, rounded down, so that only full coverage is 100 percent;
    /// `None` if the total is 0.
    #[must_use]
    pub fn permille(self) -> Option<u64> {
        (u128::from(self.covered) * 1000).checked_div(u128::from(self.total)).map(|part| part as u64)
    }
}

impl std::fmt::Display for CoveredShare {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.covered, self.total)?;
        self.permille().map_or(Ok(()), |part| write!(f, " ({}.{} %)", part / 10, part % 10))
    }
}

/// All totals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CoverageTotals {
    /// Instructions executed.
    pub instructions: CoveredShare,
    /// Outcomes of conditional instructions; each has two.
    pub branches: CoveredShare,
    /// Lines with an executed instruction: of source files, of the listing, or of the ladder program.
    pub lines: CoveredShare,
    /// Functions entered, or rungs.
    pub functions: CoveredShare,
    /// Values of the symbols of elements; each has two.
    pub elements: Option<CoveredShare>,
}

impl CoverageTotals {
    /// Computes the totals from instructions and records.
    #[must_use]
    pub fn of(reached: &[CoveredInstruction], records: &[LcovRecord]) -> CoverageTotals {
        let ways = reached.iter().filter_map(|one| one.counts_by_outcome).flatten();
        CoverageTotals {
            instructions: CoveredShare::of(reached, |one| one.count > 0),
            branches: CoveredShare::of(ways, |count| *count > 0),
            lines: CoveredShare::of(records.iter().flat_map(|record| record.lines.values()), |count| **count > 0),
            functions: CoveredShare::of(records.iter().flat_map(|record| &record.functions), |function| {
                function.count > 0
            }),
            elements: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_all_is_a_hundred_percent() {
        for (covered, total, text) in [
            (0, 0, "0 of 0"),
            (1, 3, "1 of 3 (33.3 %)"),
            (9999, 10000, "9999 of 10000 (99.9 %)"),
            (2, 2, "2 of 2 (100.0 %)"),
        ] {
            assert_eq!(CoveredShare { covered, total }.to_string(), text);
        }
    }
}
