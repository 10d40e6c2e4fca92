//! The statistics of a campaign per chip; tallies of shards can be added.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt::Write;

use ladder::{Element, LadderProgram, ProgramElement, RungNode};
use serde::{Deserialize, Serialize};

use crate::CheckReport;

/// Bytes of a page of PIC16 code memory (2K words); a call or jump to another page needs more than one
/// instruction.
const PAGE_BYTES: u64 = 4_096;

/// Programs refused with one diagnostic code.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusalReason {
    /// Number of programs.
    pub programs: u64,
    /// The message of the first program.
    pub first: String,
}

/// Coverage of one class of items, summed over programs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ClassTotals {
    /// How many items had all outcomes.
    pub covered: u64,
    /// How many items can have all outcomes.
    pub total: u64,
}

/// The statistics of the programs on one chip.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChipTally {
    /// The name of the chip.
    pub mcu: String,
    /// Number of programs that were compared.
    pub checked: u64,
    /// Number of programs with elements that this chip does not support; they are generated for other chips.
    pub outside: u64,
    /// Programs that the compiler refused, by diagnostic code.
    pub refused: BTreeMap<String, RefusalReason>,
    /// Number of programs whose chip and reference differed.
    pub differing: u64,
    /// Number of scans compared.
    pub scans: u64,
    /// Number of values compared.
    pub compared: u64,
    /// Bytes of code of all programs together.
    pub code_bytes: u64,
    /// Bytes of code of the largest program.
    pub code_bytes_max: u64,
    /// Number of elements by keyword.
    pub elements: BTreeMap<String, u64>,
    /// Number of elements by nesting depth.
    pub depths: BTreeMap<u32, u64>,
    /// Number of programs by risky feature: aliased operands, shared timers and counters, several coils of
    /// one name, large code.
    #[serde(alias = "delicate")]
    pub risky_features: BTreeMap<String, u64>,
    /// Coverage by class, as in the report of a check.
    pub outcomes: BTreeMap<String, ClassTotals>,
}

impl ChipTally {
    /// An empty tally of a chip.
    #[must_use]
    pub fn new(mcu: &str) -> ChipTally {
        ChipTally { mcu: mcu.to_owned(), ..ChipTally::default() }
    }

    /// Counts a program that was refused.
    pub(super) fn count_refusal(&mut self, code: &str, message: String) {
        self.refused.entry(code.to_owned()).or_insert(RefusalReason { programs: 0, first: message }).programs += 1;
    }

    /// Counts a program that was compared.
    pub(super) fn count_check(&mut self, program: &LadderProgram, report: &CheckReport) {
        self.checked += 1;
        self.differing += u64::from(!report.agreed);
        self.scans += report.scans;
        self.compared += report.compared;
        let bytes = u64::from(report.figures.code_bytes);
        self.code_bytes += bytes;
        self.code_bytes_max = self.code_bytes_max.max(bytes);
        for rung in &program.rungs {
            self.count_elements(&rung.series, 0);
        }
        let mut risky = risky_features(program);
        if bytes > PAGE_BYTES {
            risky.push("over 2K words of code");
        }
        for what in risky {
            *self.risky_features.entry(what.to_owned()).or_default() += 1;
        }
        for row in &report.coverage.classes {
            let seen = self.outcomes.entry(row.class.name().to_owned()).or_default();
            seen.covered += u64::from(row.covered);
            seen.total += u64::from(row.total);
        }
    }

    fn count_elements(&mut self, series: &[RungNode], depth: u32) {
        for node in series {
            match node {
                RungNode::Leaf(element, _) => {
                    *self.elements.entry(keyword(element)).or_default() += 1;
                    *self.depths.entry(depth).or_default() += 1;
                }
                RungNode::Parallel(branches, _) => {
                    branches.iter().for_each(|branch| self.count_elements(branch, depth + 1))
                }
            }
        }
    }

    /// Adds another tally of the same chip.
    pub(super) fn add(&mut self, other: &ChipTally) {
        self.checked += other.checked;
        self.outside += other.outside;
        for (code, reason) in &other.refused {
            let own = self.refused.entry(code.clone()).or_insert(RefusalReason { programs: 0, ..reason.clone() });
            own.programs += reason.programs;
        }
        self.differing += other.differing;
        self.scans += other.scans;
        self.compared += other.compared;
        self.code_bytes += other.code_bytes;
        self.code_bytes_max = self.code_bytes_max.max(other.code_bytes_max);
        add_counts(&mut self.elements, &other.elements);
        add_counts(&mut self.depths, &other.depths);
        add_counts(&mut self.risky_features, &other.risky_features);
        for (class, seen) in &other.outcomes {
            let own = self.outcomes.entry(class.clone()).or_default();
            own.covered += seen.covered;
            own.total += seen.total;
        }
    }

    /// The statistics as text of several lines.
    #[must_use]
    pub fn text(&self) -> String {
        let refused: u64 = self.refused.values().map(|reason| reason.programs).sum();
        let mut out = format!(
            "{}: {} programs checked, {} differ, {refused} refused, {} with elements that the chip lacks; \
             {} scans, {} values; code up to {} bytes\n",
            self.mcu, self.checked, self.differing, self.outside, self.scans, self.compared, self.code_bytes_max
        );
        let list = |out: &mut String, head: &str, items: Vec<String>| {
            if !items.is_empty() {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "  {head}: {}", items.join(", "));
            }
        };
        list(&mut out, "elements", self.elements.iter().map(|(name, n)| format!("{name} {n}")).collect());
        list(&mut out, "elements by depth", self.depths.iter().map(|(depth, n)| format!("{depth}: {n}")).collect());
        list(&mut out, "programs with", self.risky_features.iter().map(|(what, n)| format!("{what} {n}")).collect());
        let seen = self.outcomes.iter().map(|(class, seen)| format!("{class} {}/{}", seen.covered, seen.total));
        list(&mut out, "all outcomes seen", seen.collect());
        for (code, reason) in &self.refused {
            let _ = writeln!(out, "  refused {code} {}: first {}", reason.programs, reason.first);
        }
        out
    }
}

fn add_counts<K: Ord + Clone>(own: &mut BTreeMap<K, u64>, other: &BTreeMap<K, u64>) {
    for (key, count) in other {
        *own.entry(key.clone()).or_default() += count;
    }
}

/// The keyword of an element; a coil is named by its kind.
fn keyword(element: &Element) -> String {
    if let Element::Coil { negated, set, reset, .. } = element {
        let how = match (negated, set, reset) {
            (true, ..) => "COIL negated",
            (_, true, _) => "COIL set",
            (_, _, true) => "COIL reset",
            _ => "COIL",
        };
        return how.to_owned();
    }
    element.facts().keyword.to_owned()
}

/// The features of a program that compilers often translate incorrectly.
fn risky_features(program: &LadderProgram) -> Vec<&'static str> {
    let (mut coils, mut modules): (HashMap<&str, u32>, HashMap<&str, u32>) = Default::default();
    let mut found = HashSet::new();
    for ProgramElement { element, .. } in program.elements() {
        let facts = element.facts();
        let mut written = facts.symbols.iter().filter(|symbol| symbol.write.is_some() && !symbol.is_read);
        if written.any(|dest| facts.symbols.iter().any(|symbol| symbol.is_read && symbol.name == dest.name)) {
            found.insert(if matches!(element, Element::LookUpTable { .. } | Element::PiecewiseLinear { .. }) {
                "aliased tables"
            } else {
                "aliased operands"
            });
        }
        match element {
            Element::Coil { name, set: false, reset: false, .. } => *coils.entry(name).or_default() += 1,
            Element::Timer { name, .. } | Element::Counter { name, .. } => {
                *modules.entry(name).or_default() += 1;
            }
            // Several other elements of one name are nothing unusual.
            _ => {}
        }
    }
    if coils.values().any(|n| *n > 1) {
        found.insert("double coils");
    }
    if modules.values().any(|n| *n > 1) {
        found.insert("shared timers or counters");
    }
    if program.vars.as_ref().is_some_and(|vars| !vars.is_empty()) {
        found.insert("integers of several widths");
    }
    found.into_iter().collect()
}
