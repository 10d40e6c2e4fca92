//! The outcomes of checks as JUnit XML, with one test case per program and chip.

use std::fmt::Write;

use diag::escape_markup;

use crate::report::check_report::CheckReport;
use crate::report::summary_table::{CheckOutcome, RefusedCheck};

/// One XML document of all outcomes: a difference is a failure, a refused check is skipped.
#[must_use]
pub fn junit(outcomes: &[CheckOutcome]) -> String {
    let differs = |outcome: &&CheckOutcome| matches!(outcome, CheckOutcome::Checked(report) if !report.agreed);
    let failures = outcomes.iter().filter(differs).count();
    let skipped = outcomes.iter().filter(|outcome| matches!(outcome, CheckOutcome::Refused(_))).count();
    let counts = format!("tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\"", outcomes.len());
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
    _ = writeln!(text, "<testsuites name=\"emu check\" {counts}>\n <testsuite name=\"emu check\" {counts}>");
    for outcome in outcomes {
        match outcome {
            CheckOutcome::Checked(report) => text += &checked_case(report),
            CheckOutcome::Refused(RefusedCheck { program, mcu, errors }) => {
                let why: Vec<String> = errors.iter().map(|e| format!("{} [{}]", e.cause, e.code)).collect();
                _ = writeln!(
                    text,
                    "  {}\n   <skipped message=\"{}\"/>\n  </testcase>",
                    test_case(program, mcu),
                    escape_markup(&why.join("; "))
                );
            }
        }
    }
    text + " </testsuite>\n</testsuites>\n"
}

fn test_case(program: &str, mcu: &str) -> String {
    format!("<testcase classname=\"{}\" name=\"{}\">", escape_markup(program), escape_markup(mcu))
}

fn checked_case(report: &CheckReport) -> String {
    let mut text = format!("  {}\n", test_case(&report.program, &report.mcu));
    if let Some(difference) = &report.difference {
        let what = difference.symbol.as_deref().unwrap_or("the course of the program");
        let message = format!("{what}: expected {}, found {}", difference.expected, difference.found);
        let code = difference.code;
        _ = writeln!(
            text,
            "   <failure type=\"{code}\" message=\"{}\">{}</failure>",
            escape_markup(&message),
            escape_markup(&report.text())
        );
    } else {
        _ = writeln!(text, "   <system-out>{}</system-out>", escape_markup(&report.text()));
    }
    text + "  </testcase>\n"
}
