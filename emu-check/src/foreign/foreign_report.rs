//! The report of a check of a foreign image, as text and as JSON.

use std::fmt::Write;

use diag::Diagnostic;
use serde::Serialize;

use crate::chip::map_contract::ScanPace;
use crate::coverage::classes::LadderCoverage;
use crate::report::check_report::{DifferenceKind, count_text};

use super::codes;
use super::foreign_run::ScanStarts;

/// The result of a check of a foreign image. `docs/foreign.md` describes its JSON form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForeignReport {
    /// Version of the JSON report, [`crate::SCHEMA`].
    pub schema: u32,
    /// Name of the program's file.
    pub program: String,
    /// Name of the image's file.
    pub image: String,
    /// The name of the chip.
    pub mcu: String,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of scans done; if there is a difference, it is in the last one.
    pub scans: u64,
    /// Number of runs from reset that the scans belong to.
    pub runs: u64,
    /// Number of values compared.
    pub compared: u64,
    /// True if nothing differed and there are no findings.
    pub agreed: bool,
    /// The first difference.
    pub difference: Option<ForeignDifference>,
    /// Defects that do not change the result of a scan.
    pub findings: Vec<ForeignFinding>,
    /// The measured period; `None` if fewer than two scans have started.
    pub period: Option<MeasuredPeriod>,
    /// Machine cycles from the start of a scan until the chip waits again: the maximum observed.
    pub scan_cycles_max: u64,
    /// Byte address of the first instruction of a scan, as found in the image.
    pub scan_start: u32,
    /// What is not compared, and why.
    pub left_out: Vec<String>,
    /// Coverage of the program.
    pub coverage: LadderCoverage,
    /// Notes of the check; none of them is an error.
    pub notes: Vec<Diagnostic>,
}

/// The first difference of a check of a foreign image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ForeignDifference {
    /// Diagnostic code of the kind, for `emu explain`.
    pub code: &'static str,
    /// Number of the scan in the check, from 1.
    pub scan: u64,
    /// Number of the run from reset, from 1.
    pub run: u64,
    /// Number of the scan in that run, from 1.
    pub scan_of_run: u64,
    /// Machine cycle of that run.
    pub cycle: u64,
    /// The kind of the difference.
    pub what: DifferenceKind,
    /// The symbol that differs, if it is a symbol.
    pub symbol: Option<String>,
    /// The expected value or level, or a description.
    pub expected: String,
    /// The value or level found, or a description.
    pub found: String,
    /// The command line that replays the check up to this scan.
    pub replay: String,
}

/// A defect of an image that does not change the result of a scan.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ForeignFinding {
    /// Diagnostic code of the kind, for `emu explain`.
    pub code: &'static str,
    /// The finding as one sentence.
    #[serde(rename = "says")]
    pub text: String,
}

/// The time from the start of one scan to the next, measured over the longest run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredPeriod {
    /// Number of periods measured.
    pub periods: u64,
    /// Oscillator clocks of all periods together.
    pub clocks: u64,
    /// Mean oscillator clocks per period.
    pub mean_clocks: f64,
    /// Oscillator clocks per period as required by CYCLE and the clock.
    pub wanted_clocks: f64,
}

impl MeasuredPeriod {
    /// Returns true if the mean period is less than nine tenths of CYCLE.
    pub(crate) fn is_much_too_short(&self) -> bool {
        self.periods > 1 && self.mean_clocks < self.wanted_clocks * 0.9
    }

    /// The period from the scan starts of a run; `None` if fewer than two scans have started.
    pub(crate) fn new(pace: &ScanPace, starts: ScanStarts) -> Option<MeasuredPeriod> {
        let periods = starts.scans.checked_sub(1).filter(|&periods| periods > 0)?;
        let clocks = (starts.last - starts.first) * pace.clocks_per_cycle;
        // A run is long enough for two decimal places.
        let mean_clocks = (clocks as f64 / periods as f64 * 100.0).round() / 100.0;
        let wanted_clocks = pace.num as f64 / pace.den as f64 * pace.clocks_per_cycle as f64;
        Some(MeasuredPeriod { periods, clocks, mean_clocks, wanted_clocks })
    }

    /// The finding that the period is wrong, if the timer tick and the waiting loop do not explain the
    /// difference. `gap` is the maximum number of machine cycles between two polls of the flag.
    pub(crate) fn to_finding(&self, pace: &ScanPace, gap: u64) -> Option<ForeignFinding> {
        let wanted = u128::from(self.periods) * pace.num * u128::from(pace.clocks_per_cycle) / pace.den;
        let slack =
            (pace.tick_cycles + (2 * pace.poll_cycles).max(gap) + START_TOLERANCE_CYCLES) * pace.clocks_per_cycle;
        let off = u128::from(self.clocks).abs_diff(wanted);
        (off > u128::from(slack)).then(|| {
            let (each, way) = match u128::from(self.clocks) > wanted {
                true => (self.mean_clocks - self.wanted_clocks, "long"),
                false => (self.wanted_clocks - self.mean_clocks, "short"),
            };
            let text = format!(
                "a scan starts every {:.2} clocks; CYCLE requires {:.2}: {each:.2} clocks too {way}, {:.0} in a million \
                 (mean of {})",
                self.mean_clocks,
                self.wanted_clocks,
                each / self.wanted_clocks * 1e6,
                count_text(self.periods, "period"),
            );
            ForeignFinding { code: codes::FINDING_PERIOD, text }
        })
    }
}

/// Additional tolerance of the distance of two scan starts, in machine cycles: other compilers have longer
/// waiting loops.
const START_TOLERANCE_CYCLES: u64 = 6;

impl ForeignReport {
    /// The report as text of several lines.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        let head = format!("{} as {} on {}", self.image, self.program, self.mcu);
        match &self.difference {
            Some(difference) => {
                _ = writeln!(text, "{head} DIFFERS in scan {} (seed {})", difference.scan, self.seed);
                text += &difference.text();
            }
            None => {
                let verdict = if self.findings.is_empty() { "agrees" } else { "agrees, with findings" };
                let (scans, runs) = (count_text(self.scans, "scan"), count_text(self.runs, "run"));
                let compared = count_text(self.compared, "value");
                _ = writeln!(
                    text,
                    "{head} {verdict}: {scans} in {runs} from reset, {compared} compared, seed {}",
                    self.seed
                );
            }
        }
        for finding in &self.findings {
            _ = writeln!(text, "finding: {} [{}]", finding.text, finding.code);
        }
        for left in &self.left_out {
            _ = writeln!(text, "not compared: {left}");
        }
        if let Some(period) = &self.period {
            _ = writeln!(
                text,
                "period: {:.2} clocks on average over {}, CYCLE requires {:.2}; scan at most {} machine cycles, from 0x{:04X} on",
                period.mean_clocks,
                count_text(period.periods, "period"),
                period.wanted_clocks,
                self.scan_cycles_max,
                self.scan_start
            );
        }
        text += &self.coverage.summary_line();
        if self.difference.is_none() {
            text += &self.coverage.missing_lines();
        }
        text
    }
}

impl ForeignDifference {
    fn text(&self) -> String {
        let mut text = String::new();
        let what = match (self.what, &self.symbol) {
            (DifferenceKind::Pin, Some(symbol)) => format!("the pin of {symbol}"),
            (_, Some(symbol)) => symbol.clone(),
            (DifferenceKind::Serial, None) => "the serial line".to_owned(),
            (DifferenceKind::Pwm, None) => "the PWM output".to_owned(),
            (DifferenceKind::Eeprom, None) => "the EEPROM".to_owned(),
            (DifferenceKind::Bus, None) => "a bus".to_owned(),
            _ => "the sequence of the scan".to_owned(),
        };
        _ = writeln!(text, "  what      {what} [{}]", self.code);
        _ = writeln!(text, "  expected  {}", self.expected);
        _ = writeln!(text, "  found     {}", self.found);
        _ = writeln!(text, "  when      cycle {} of run {}, in its scan {}", self.cycle, self.run, self.scan_of_run);
        _ = writeln!(text, "  replay    {}", self.replay);
        text
    }
}
