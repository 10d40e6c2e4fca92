//! Summary of checks of several programs on several chips, as a text table and as one JSON document.

use std::fmt::Write;

use diag::{Diagnostic, align_columns};
use serde::Serialize;

use crate::report::check_report::{CheckReport, SCHEMA, count_text};

/// The outcome of checking one program on one chip.
#[derive(Debug, Clone, PartialEq)]
pub enum CheckOutcome {
    /// The program was checked.
    Checked(Box<CheckReport>),
    /// The program could not be checked.
    Refused(RefusedCheck),
}

/// A check that was refused, with the reasons.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RefusedCheck {
    /// Name of the program's file.
    pub program: String,
    /// The name of the chip.
    pub mcu: String,
    /// The reasons.
    pub errors: Vec<Diagnostic>,
}

/// The summary of many checks. `docs/check.md` describes its JSON form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckSummary {
    /// Version of the JSON summary, [`SCHEMA`].
    pub schema: u32,
    /// True if no check found a difference.
    pub agreed: bool,
    /// The reports, by program and then by chip.
    pub checks: Vec<CheckReport>,
    /// The refused checks, in the same order.
    pub refused: Vec<RefusedCheck>,
}

impl CheckSummary {
    /// Collects all outcomes.
    #[must_use]
    pub fn new(outcomes: Vec<CheckOutcome>) -> CheckSummary {
        let (mut checks, mut refused) = (Vec::new(), Vec::new());
        for outcome in outcomes {
            match outcome {
                CheckOutcome::Checked(report) => checks.push(*report),
                CheckOutcome::Refused(why) => refused.push(why),
            }
        }
        CheckSummary { schema: SCHEMA, agreed: checks.iter().all(|report| report.agreed), checks, refused }
    }
}

/// Column headings. The first three columns are left-aligned, numbers are right-aligned.
pub(crate) const COLUMN_HEADS: [&str; 12] =
    ["program", "chip", "verdict", "scans", "code", "RAM", "period", "worst", "bound", "mean", "slack", "worst rung"];

/// A text table with one line per outcome, followed by the reasons of refusals. Sizes are in bytes; times, in
/// clocks, do not include the wait at the end of a scan.
#[must_use]
pub fn summary_table(outcomes: &[CheckOutcome]) -> String {
    let mut rows: Vec<Vec<String>> = vec![COLUMN_HEADS.map(str::to_owned).to_vec()];
    let mut reasons = String::new();
    for outcome in outcomes {
        match outcome {
            CheckOutcome::Checked(report) => rows.push(report_cells(report)),
            CheckOutcome::Refused(RefusedCheck { program, mcu, errors }) => {
                rows.push(vec![program.clone(), mcu.clone(), "refused".to_owned()]);
                // The first reason is enough; a check on this chip alone prints all of them.
                let more = match errors.len() {
                    0 | 1 => String::new(),
                    n => format!(", and {} more", n - 1),
                };
                if let Some(error) = errors.first() {
                    _ = writeln!(reasons, "  {program} on {mcu}: {} [{}]{more}", error.cause, error.code);
                }
            }
        }
    }
    let mut text = align_columns(&rows, |column| column > 2);
    _ = writeln!(text, "{}", verdict_line(outcomes));
    if !reasons.is_empty() {
        _ = writeln!(text, "refused:\n{}", reasons.trim_end());
    }
    text
}

/// One line with the number of checks that agree, differ and were refused.
pub(crate) fn verdict_line(outcomes: &[CheckOutcome]) -> String {
    let checked = outcomes.iter().filter(|outcome| matches!(outcome, CheckOutcome::Checked(_))).count();
    let differ = outcomes.iter().filter(|o| matches!(o, CheckOutcome::Checked(report) if !report.agreed)).count();
    let all = count_text(checked as u64, "check");
    format!("{all}: {} agree, {differ} differ; {} refused", checked - differ, outcomes.len() - checked)
}

/// The cells of a report, one per column of [`COLUMN_HEADS`].
pub(crate) fn report_cells(report: &CheckReport) -> Vec<String> {
    let figures = &report.figures;
    let clocks = |cycles: u64| cycles.saturating_mul(figures.clocks_per_cycle).to_string();
    let rung = figures.rungs.iter().filter_map(|rung| Some((rung.cycles_max?, rung.rung))).max_by_key(|rung| rung.0);
    let times = |cycles: &str| match cycles.split_once('/') {
        None => cycles.parse().map_or_else(|_| cycles.to_owned(), clocks),
        Some((num, den)) => {
            let ratio = num.parse::<f64>().ok().zip(den.parse::<f64>().ok()).map(|(num, den)| num / den);
            let clocks = ratio.map(|ratio| ratio * figures.clocks_per_cycle as f64);
            clocks.map_or_else(|| cycles.to_owned(), |clocks| format!("{}", (clocks * 100.0).round() / 100.0))
        }
    };
    vec![
        report.program.clone(),
        report.mcu.clone(),
        if report.agreed { "agrees" } else { "DIFFERS" }.to_owned(),
        report.scans.to_string(),
        figures.code_bytes.to_string(),
        figures.ram_bytes.to_string(),
        times(&figures.period_cycles),
        clocks(figures.scan_cycles_max),
        clocks(figures.scan_cycles_bound),
        format!("{:.1}", figures.scan_cycles_mean * figures.clocks_per_cycle as f64),
        clocks(figures.slack_cycles),
        rung.map_or_else(String::new, |(cycles, rung)| format!("{} ({rung})", clocks(cycles))),
    ]
}
