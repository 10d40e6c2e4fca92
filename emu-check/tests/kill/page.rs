//! Writes the figures of docs/kill.md and the file of survivors.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

use emu_check::fuzz::FAMILIES;

use crate::campaign::{FaultCase, FaultVerdict, KINDS, ProgramSample};
use crate::common;

/// Markers of the generated part of the page.
const FIGURES: [&str; 2] = ["<!-- figures -->\n", "<!-- end of the figures -->\n"];

/// The placeholder for a missing reason.
const NONE: &str = "?";

/// The prefix of the reason of a fault whose image does the same as the correct one.
const EQUIVALENT: &str = "equivalent: ";

/// The reason of a fault that checks with other seeds find.
const LATER_REASON: &str = "gap: checks with other seeds and 6,000 scans find it";

/// The survivors with their reasons: the lines of kill.txt.
pub struct SurvivorList {
    head: String,
    /// The reasons by `chip | program | fault`.
    rows: BTreeMap<String, String>,
}

impl SurvivorList {
    pub fn read() -> SurvivorList {
        let text = fs::read_to_string(common::beside("tests/kill.txt")).expect("kill.txt");
        let mut survivors = SurvivorList { head: String::new(), rows: BTreeMap::new() };
        for line in text.lines().filter(|line| !line.is_empty()) {
            if line.starts_with('#') {
                survivors.head += &format!("{line}\n");
                continue;
            }
            let (name, reason) = line.rsplit_once(" | ").expect("chip | program | fault | reason");
            survivors.rows.insert(name.to_owned(), reason.to_owned());
        }
        survivors
    }

    /// Why a fault is not found, if the reason is known.
    pub fn reason(&self, name: &str) -> Option<&str> {
        self.rows.get(name).map(|reason| &**reason).filter(|reason| *reason != NONE)
    }

    /// True if the fault is known to be equivalent to the correct compiler.
    fn is_equivalent(&self, name: &str) -> bool {
        self.reason(name).is_some_and(|reason| reason.starts_with(EQUIVALENT))
    }

    /// Lists the current survivors; known reasons are kept.
    pub fn update<'a>(&mut self, cases: impl Iterator<Item = &'a FaultCase>) {
        let survive = cases.filter(|case| case.verdict == FaultVerdict::Survives);
        self.rows = survive
            .map(|case| {
                let unknown = if case.found_by_recheck { LATER_REASON } else { NONE };
                (case.name.clone(), self.reason(&case.name).unwrap_or(unknown).to_owned())
            })
            .collect();
    }

    pub fn unexplained(&self) -> Vec<&str> {
        self.rows.iter().filter(|(_, reason)| *reason == NONE).map(|(name, _)| &**name).collect()
    }

    pub fn write(&self) {
        let rows: String = self.rows.iter().map(|(name, reason)| format!("{name} | {reason}\n")).collect();
        fs::write(common::beside("tests/kill.txt"), format!("{}{rows}", self.head)).expect("kill.txt");
    }
}

/// The results for the faults of one sort.
#[derive(Default)]
struct KindTotals {
    /// The scan of the first difference of each fault found.
    found: Vec<u64>,
    survive: usize,
    equivalent: usize,
    same: usize,
    proved: usize,
    refused: usize,
}

impl KindTotals {
    fn faults(&self) -> usize {
        self.found.len() + self.survive + self.equivalent
    }

    /// The share of found faults, in percent, without those that are known to be equivalent.
    fn share(&self) -> f64 {
        100.0 * self.found.len() as f64 / (self.found.len() + self.survive).max(1) as f64
    }
}

/// The totals of a chip: one row per sort, and one for all.
fn sums(samples: &[ProgramSample], survivors: &SurvivorList, mcu: &str) -> Vec<(String, KindTotals)> {
    let mut sums: Vec<(String, KindTotals)> =
        KINDS.iter().map(|kind| (format!("{kind:?}"), KindTotals::default())).collect();
    sums.push(("all".to_owned(), KindTotals::default()));
    for sample in samples.iter().filter(|sample| sample.mcu == mcu) {
        let mut of = |kind: &dyn Fn(usize) -> bool, add: &dyn Fn(&mut KindTotals)| {
            let chosen = sums.iter_mut().enumerate().filter(|(n, _)| *n == KINDS.len() || kind(*n));
            chosen.for_each(|(_, (_, sum))| add(sum));
        };
        for case in &sample.cases {
            of(&|n| KINDS[n] == case.kind, &|sum| match case.verdict {
                FaultVerdict::Found(scan, _) => sum.found.push(scan),
                FaultVerdict::Survives if survivors.is_equivalent(&case.name) => sum.equivalent += 1,
                FaultVerdict::Survives => sum.survive += 1,
            });
        }
        sample.identical_images.iter().for_each(|(kind, count)| of(&|n| KINDS[n] == *kind, &|sum| sum.same += count));
        sample
            .proved_equivalent
            .iter()
            .for_each(|(kind, count)| of(&|n| KINDS[n] == *kind, &|sum| sum.proved += count));
        sample.refused.iter().for_each(|(kind, count)| of(&|n| KINDS[n] == *kind, &|sum| sum.refused += count));
    }
    sums.iter_mut().for_each(|(_, sum)| sum.found.sort_unstable());
    sums
}

/// Per chip: number of faults, and the share found in percent.
pub fn shares(samples: &[ProgramSample], survivors: &SurvivorList) -> Vec<(&'static str, (usize, f64))> {
    let all = |mcu| sums(samples, survivors, mcu).pop().map(|(_, sum)| (mcu, (sum.faults(), sum.share())));
    FAMILIES.into_iter().filter_map(all).collect()
}

/// The table of the page.
pub fn table(samples: &[ProgramSample], survivors: &SurvivorList) -> String {
    let mut out = "| chip | sort | faults | found | equivalent | gaps | % | scan: half | 9 of 10 | last | same image | same meaning | refused |\n".to_owned();
    out += "|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for mcu in FAMILIES {
        for (sort, sum) in sums(samples, survivors, mcu) {
            if sum.faults() == 0 {
                _ = writeln!(
                    out,
                    "| {mcu} | {sort} | 0 | | | | | | | | {} | {} | {} |",
                    sum.same, sum.proved, sum.refused
                );
                continue;
            }
            let at = |tenths: usize| {
                sum.found.get((sum.found.len() * tenths).div_ceil(10).max(1) - 1).map_or(0, |scan| *scan)
            };
            let (faults, found, share) = (sum.faults(), sum.found.len(), sum.share());
            let (half, nine, last) = (at(5), at(9), at(10));
            _ = writeln!(
                out,
                "| {mcu} | {sort} | {faults} | {found} | {} | {} | {share:.1} | {half} | {nine} | {last} | {} | {} | {} |",
                sum.equivalent, sum.survive, sum.same, sum.proved, sum.refused
            );
        }
    }
    out
}

/// The share that the page states for a chip, in percent.
pub fn stated_share(page: &str, mcu: &str) -> Option<f64> {
    let row = page.lines().find_map(|line| line.strip_prefix(&format!("| {mcu} | all | ")))?;
    row.split(" | ").nth(4)?.parse().ok()
}

/// The page with these figures in place of its current ones.
pub fn with_figures(page: &str, table: &str, survivors: &SurvivorList) -> String {
    let [begin, end] = FIGURES;
    let (head, rest) = page.split_once(begin).expect("where the figures begin");
    let (_, tail) = rest.split_once(end).expect("where the figures end");
    let row = |(name, reason): (&String, &String)| {
        let cells: Vec<String> = name.splitn(3, " | ").map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} | {reason} |\n", cells.join(" | "))
    };
    let rows: String = survivors.rows.iter().map(row).collect();
    format!(
        "{head}{begin}{table}\n## Survivors\n\n| chip | program | fault | why it is not found |\n|---|---|---|---|\n{rows}{end}{tail}"
    )
}
