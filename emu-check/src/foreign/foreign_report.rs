//! What a check of a foreign image found, as text and as JSON.

use std::fmt::Write;

use diag::Diagnostic;
use serde::Serialize;

use crate::coverage::LadderCoverage;
use crate::map_contract::ScanPace;
use crate::report::{DifferenceKind, count_text};

use super::codes;
use super::foreign_run::ScanStarts;

/// The result of a check of a foreign image. `docs/foreign.md` describes its JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ForeignReport {
    /// Version of this shape, [`crate::SCHEMA`].
    pub schema: u32,
    /// Name of the program's file.
    pub program: String,
    /// Name of the image's file.
    pub image: String,
    /// The chip.
    pub mcu: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Scans done; with a difference the last one is the scan that differs.
    pub scans: u64,
    /// Runs from reset that these scans were done in.
    pub runs: u64,
    /// Values compared.
    pub compared: u64,
    /// Nothing differed and nothing was found.
    pub agreed: bool,
    /// The first difference.
    pub difference: Option<ForeignDifference>,
    /// What is not as it should be apart from that.
    pub findings: Vec<ForeignFinding>,
    /// The time from scan to scan; none where fewer than two have started.
    pub period: Option<MeasuredPeriod>,
    /// Machine cycles from a scan's start until the chip waits again, the most that were seen.
    pub scan_cycles_max: u64,
    /// Byte address of the first instruction of a scan, as it was found.
    pub scan_start: u32,
    /// What of the program is not compared, and why.
    pub left_out: Vec<String>,
    /// What of the program was exercised.
    pub coverage: LadderCoverage,
    /// What the check has to say besides; never errors.
    pub notes: Vec<Diagnostic>,
}

/// The first difference of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ForeignDifference {
    /// Stable code of the kind, for `emu explain`.
    pub code: &'static str,
    /// Scan of the check, from 1.
    pub scan: u64,
    /// Run from reset that it belongs to, from 1.
    pub run: u64,
    /// Scan of that run, from 1.
    pub scan_of_run: u64,
    /// Machine cycle of that run.
    pub cycle: u64,
    /// What kind of thing differs.
    pub what: DifferenceKind,
    /// The symbol, where it is one.
    pub symbol: Option<String>,
    /// What should be.
    pub expected: String,
    /// What is.
    pub found: String,
    /// The command that replays the check up to this scan.
    pub replay: String,
}

/// Something that is not as it should be though no scan's result differs by it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ForeignFinding {
    /// Stable code of the kind, for `emu explain`.
    pub code: &'static str,
    /// What it is.
    pub says: String,
}

/// The time from the start of one scan to the next, over the longest run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredPeriod {
    /// Periods that were measured.
    pub periods: u64,
    /// Clocks of the oscillator in all of them.
    pub clocks: u64,
    /// Clocks of one on average.
    pub mean_clocks: f64,
    /// Clocks of one by CYCLE and the clock.
    pub wanted_clocks: f64,
}

impl MeasuredPeriod {
    /// The scans come in less than nine tenths of CYCLE on average.
    pub(crate) fn is_much_too_short(&self) -> bool {
        self.periods > 1 && self.mean_clocks < self.wanted_clocks * 0.9
    }

    pub(crate) fn new(pace: &ScanPace, starts: ScanStarts) -> Option<MeasuredPeriod> {
        let periods = starts.scans.checked_sub(1).filter(|&periods| periods > 0)?;
        let clocks = (starts.last - starts.first) * pace.clocks_per_cycle;
        // Hundredths are what a run can tell.
        let mean_clocks = (clocks as f64 / periods as f64 * 100.0).round() / 100.0;
        let wanted_clocks = pace.num as f64 / pace.den as f64 * pace.clocks_per_cycle as f64;
        Some(MeasuredPeriod { periods, clocks, mean_clocks, wanted_clocks })
    }

    /// A finding where tick and loop do not explain the difference.
    /// `gap`: most machine cycles from one poll of the flag to the next.
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
            let says = format!(
                "scans come every {:.2} clocks, CYCLE asks for {:.2}: {each:.2} clocks too {way}, {:.0} in a million \
                 (mean of {})",
                self.mean_clocks,
                self.wanted_clocks,
                each / self.wanted_clocks * 1e6,
                count_text(self.periods, "period"),
            );
            ForeignFinding { code: codes::FINDING_PERIOD, says }
        })
    }
}

/// Machine cycles by which two starts may be off besides tick and look at the timer: loops of others are longer.
const START_TOLERANCE_CYCLES: u64 = 6;

impl ForeignReport {
    /// The report for people, several lines.
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
                let verdict = if self.findings.is_empty() { "agrees" } else { "agrees but for what follows" };
                let (scans, runs) = (count_text(self.scans, "scan"), count_text(self.runs, "run"));
                let compared = count_text(self.compared, "value");
                _ = writeln!(
                    text,
                    "{head} {verdict}: {scans} in {runs} from reset, {compared} compared, seed {}",
                    self.seed
                );
            }
        }
        for ForeignFinding { code, says } in &self.findings {
            _ = writeln!(text, "finding: {says} [{code}]");
        }
        for left in &self.left_out {
            _ = writeln!(text, "not compared: {left}");
        }
        if let Some(period) = &self.period {
            _ = writeln!(
                text,
                "period: {:.2} clocks on average over {}, CYCLE asks for {:.2}; scan at most {} machine cycles, from 0x{:04X} on",
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
            _ => "the course of the program".to_owned(),
        };
        _ = writeln!(text, "  what      {what} [{}]", self.code);
        _ = writeln!(text, "  expected  {}", self.expected);
        _ = writeln!(text, "  found     {}", self.found);
        _ = writeln!(text, "  when      cycle {} of run {}, in its scan {}", self.cycle, self.run, self.scan_of_run);
        _ = writeln!(text, "  replay    {}", self.replay);
        text
    }
}
