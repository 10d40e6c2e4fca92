//! The outcomes of checks as JUnit XML: a test case for each program and chip.

use std::fmt::Write;

use crate::report::Report;
use crate::table::{Outcome, Refused};

/// Text for XML: what has a meaning there is escaped, what may not stand there is replaced.
pub(crate) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' => out.push(c),
            c if c < ' ' || matches!(c, '\u{7F}' | '\u{FFFE}' | '\u{FFFF}') => out.push('\u{FFFD}'),
            c => out.push(c),
        }
    }
    out
}

/// One document of all outcomes: a difference is a failure, a refusal is skipped.
#[must_use]
pub fn junit(outcomes: &[Outcome]) -> String {
    let differs = |outcome: &&Outcome| matches!(outcome, Outcome::Checked(report) if !report.agreed);
    let failures = outcomes.iter().filter(differs).count();
    let skipped = outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Refused(_))).count();
    let counts = format!("tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\"", outcomes.len());
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
    _ = writeln!(text, "<testsuites name=\"emu check\" {counts}>\n <testsuite name=\"emu check\" {counts}>");
    for outcome in outcomes {
        match outcome {
            Outcome::Checked(report) => text += &checked(report),
            Outcome::Refused(Refused { program, mcu, errors }) => {
                let why: Vec<String> = errors.iter().map(|e| format!("{} [{}]", e.cause, e.code)).collect();
                _ = writeln!(
                    text,
                    "  {}\n   <skipped message=\"{}\"/>\n  </testcase>",
                    case(program, mcu),
                    escaped(&why.join("; "))
                );
            }
        }
    }
    text + " </testsuite>\n</testsuites>\n"
}

fn case(program: &str, mcu: &str) -> String {
    format!("<testcase classname=\"{}\" name=\"{}\">", escaped(program), escaped(mcu))
}

fn checked(report: &Report) -> String {
    let mut text = format!("  {}\n", case(&report.program, &report.mcu));
    if let Some(difference) = &report.difference {
        let what = difference.symbol.as_deref().unwrap_or("the course of the program");
        let message = format!("{what}: expected {}, found {}", difference.expected, difference.found);
        let code = difference.code;
        _ = writeln!(
            text,
            "   <failure type=\"{code}\" message=\"{}\">{}</failure>",
            escaped(&message),
            escaped(&report.text())
        );
    } else {
        _ = writeln!(text, "   <system-out>{}</system-out>", escaped(&report.text()));
    }
    text + "  </testcase>\n"
}
