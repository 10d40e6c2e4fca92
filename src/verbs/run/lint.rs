//! `emu run --lint`: reports suspicious but legal behaviour of a program, as text and as JSON.

use clap::ValueEnum;
use diag::{Diagnostic, Pos, Severity};
use emu_core::cpu::Cpu;
use emu_debug::LintFinding;
use emu_debug::lints::describe_lint;
use serde_json::{Value, json};

use crate::shared::fail::exit;
use crate::shared::report;
use crate::shared::report::MessageStyle;
use crate::verbs::run::summary::RunSummary;

/// The effect of lint findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LintMode {
    /// Findings are reported.
    Warn,
    /// Findings are reported, and a run that would end with exit code 0 ends with 1.
    Error,
}

/// Prints the findings on standard error, in the order in which they occurred.
pub fn report_lints<C: Cpu>(summary: &RunSummary<'_, C>, mode: LintMode, image: &str, style: &MessageStyle) {
    let severity = if mode == LintMode::Error { Severity::Error } else { Severity::Warning };
    let diagnostics = summary.result.lints.iter().map(|finding| {
        let (place, what) =
            (summary.source.describe_word(finding.pc), describe_lint(finding.lint, &summary.source.names));
        let cause = format!("at {place}: {what} ({})", count_text(finding));
        Diagnostic::new(severity, finding.lint.code(), image, Pos::default(), cause, finding.lint.hint())
    });
    // An image has no source lines to draw.
    report::report_diagnostics(style, &diagnostics.collect::<Vec<_>>(), report::FileTexts::NONE);
}

/// Returns the count of a finding: `4 times, first in cycle 12`.
fn count_text(finding: &LintFinding) -> String {
    match finding.count {
        1 => format!("once, in cycle {}", finding.first),
        count => format!("{count} times, first in cycle {}", finding.first),
    }
}

/// Returns the findings as a list of JSON objects.
pub fn document<C: Cpu>(summary: &RunSummary<'_, C>) -> Value {
    let objects = summary.result.lints.iter().map(|finding| {
        let mut object = json!({
            "code": finding.lint.code(),
            "pc": summary.source.names.chip.code_address(finding.pc),
            "cause": describe_lint(finding.lint, &summary.source.names),
            "hint": finding.lint.hint(),
            "count": finding.count,
            "cycle": finding.first,
        });
        let byte = finding.pc * summary.source.names.chip.word_bytes;
        for (key, value) in
            [("symbol", summary.source.names.nearest_symbol(byte)), ("line", summary.source.line_text(finding.pc))]
        {
            if let Some(value) = value {
                object[key] = json!(value);
            }
        }
        object
    });
    Value::Array(objects.collect())
}

/// Returns the exit code of a run that would end with `code`. Other failures keep their own code.
pub fn exit_code_with_lints(mode: LintMode, findings: &[LintFinding], code: u8) -> u8 {
    if mode == LintMode::Error && !findings.is_empty() && code == exit::OK { exit::FAILED } else { code }
}
