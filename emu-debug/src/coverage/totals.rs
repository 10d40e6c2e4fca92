//! The account in figures.

use super::Reached;
use super::lcov::Record;

/// How much of something was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Part {
    /// So many were seen,
    pub seen: u64,
    /// of so many.
    pub all: u64,
}

impl Part {
    /// The part of some things for which `seen` is true.
    pub fn of<T>(things: impl IntoIterator<Item = T>, seen: impl Fn(&T) -> bool) -> Part {
        let mut part = Part::default();
        for thing in things {
            part.seen += u64::from(seen(&thing));
            part.all += 1;
        }
        part
    }

    /// In tenths of a percent, rounded down, so that only all is 100 percent; nothing of nothing.
    #[must_use]
    pub fn permille(self) -> Option<u64> {
        (u128::from(self.seen) * 1000).checked_div(u128::from(self.all)).map(|part| part as u64)
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.seen, self.all)?;
        self.permille().map_or(Ok(()), |part| write!(f, " ({}.{} %)", part / 10, part % 10))
    }
}

/// All figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Totals {
    /// Instructions that were executed.
    pub instructions: Part,
    /// Ways of instructions with a condition; each has two.
    pub branches: Part,
    /// Lines of sources of which an instruction was executed; or of the listing, or of the ladder program.
    pub lines: Part,
    /// Functions that were entered, or rungs.
    pub functions: Part,
    /// Values of the symbols of elements, of which each has two.
    pub elements: Option<Part>,
}

impl Totals {
    /// Of instructions and what is written of them.
    #[must_use]
    pub fn of(reached: &[Reached], records: &[Record]) -> Totals {
        let ways = reached.iter().filter_map(|one| one.ways).flatten();
        Totals {
            instructions: Part::of(reached, |one| one.count > 0),
            branches: Part::of(ways, |count| *count > 0),
            lines: Part::of(records.iter().flat_map(|record| record.lines.values()), |count| **count > 0),
            functions: Part::of(records.iter().flat_map(|record| &record.functions), |function| function.count > 0),
            elements: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_all_is_a_hundred_percent() {
        for (seen, all, text) in [
            (0, 0, "0 of 0"),
            (1, 3, "1 of 3 (33.3 %)"),
            (9999, 10000, "9999 of 10000 (99.9 %)"),
            (2, 2, "2 of 2 (100.0 %)"),
        ] {
            assert_eq!(Part { seen, all }.to_string(), text);
        }
    }
}
