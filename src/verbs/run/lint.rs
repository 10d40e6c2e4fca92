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
pub fn report_lints<C: Cpu>(story: &RunSummary<'_, C>, lint: LintMode, image: &str, terminal: &MessageStyle) {
    let severity = if lint == LintMode::Error { Severity::Error } else { Severity::Warning };
    let each = story.ended.lints.iter().map(|found| {
        let (place, what) = (story.source.describe_word(found.pc), describe_lint(found.lint, &story.source.names));
        let cause = format!("at {place}: {what} ({})", times(found));
        Diagnostic::new(severity, found.lint.code(), image, Pos::default(), cause, found.lint.hint())
    });
    // An image has no source lines to draw.
    report::report_diagnostics(terminal, &each.collect::<Vec<_>>(), report::FileTexts::NONE);
}

/// Returns the count of a finding: `4 times, first in cycle 12`.
fn times(found: &LintFinding) -> String {
    match found.count {
        1 => format!("once, in cycle {}", found.first),
        count => format!("{count} times, first in cycle {}", found.first),
    }
}

/// Returns the findings as a list of JSON objects.
pub fn document<C: Cpu>(story: &RunSummary<'_, C>) -> Value {
    let each = story.ended.lints.iter().map(|found| {
        let mut object = json!({
            "code": found.lint.code(),
            "pc": story.source.names.chip.code_address(found.pc),
            "cause": describe_lint(found.lint, &story.source.names),
            "hint": found.lint.hint(),
            "count": found.count,
            "cycle": found.first,
        });
        let byte = found.pc * story.source.names.chip.word_bytes;
        for (key, value) in
            [("symbol", story.source.names.nearest_symbol(byte)), ("line", story.source.line_text(found.pc))]
        {
            if let Some(value) = value {
                object[key] = json!(value);
            }
        }
        object
    });
    Value::Array(each.collect())
}

/// Returns the exit code of a run that would end with `code`. Other failures keep their own code.
pub fn exit_code_with_lints(lint: LintMode, found: &[LintFinding], code: u8) -> u8 {
    if lint == LintMode::Error && !found.is_empty() && code == exit::OK { exit::FAILED } else { code }
}
