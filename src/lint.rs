//! `emu run --lint`: what a program did that is seldom meant, for people and as JSON.

use clap::ValueEnum;
use diag::{Diagnostic, Pos, Severity};
use emu_core::cpu::Cpu;
use emu_debug::Found;
use emu_debug::lints::describe;
use serde_json::{Value, json};

use crate::fail::exit;
use crate::report::{self, Terminal};
use crate::summary::Story;

/// What comes of lints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Lint {
    /// They are told.
    Warn,
    /// They are told, and a run that would end well ends with exit code 1.
    Error,
}

/// Says on standard error what was found, in the order in which it came.
pub fn complain<C: Cpu>(story: &Story<'_, C>, lint: Lint, image: &str, terminal: &Terminal) {
    let severity = if lint == Lint::Error { Severity::Error } else { Severity::Warning };
    let each = story.ended.lints.iter().map(|found| {
        let (place, what) = (story.source.place(found.pc), describe(found.lint, &story.source.names));
        let cause = format!("at {place}: {what} ({})", times(found));
        Diagnostic::new(severity, found.lint.code(), image, Pos::default(), cause, found.lint.hint())
    });
    // Images have no lines to draw.
    report::report(terminal, &each.collect::<Vec<_>>(), report::Texts::NONE);
}

/// `4 times, first in cycle 12`.
fn times(found: &Found) -> String {
    match found.count {
        1 => format!("once, in cycle {}", found.first),
        count => format!("{count} times, first in cycle {}", found.first),
    }
}

/// What was found, as a list of objects.
pub fn document<C: Cpu>(story: &Story<'_, C>) -> Value {
    let each = story.ended.lints.iter().map(|found| {
        let mut object = json!({
            "code": found.lint.code(),
            "pc": story.source.names.chip.code_address(found.pc),
            "cause": describe(found.lint, &story.source.names),
            "hint": found.lint.hint(),
            "count": found.count,
            "cycle": found.first,
        });
        let byte = found.pc * story.source.names.chip.word_bytes;
        for (key, value) in [("symbol", story.source.names.near(byte)), ("line", story.source.line(found.pc))] {
            if let Some(value) = value {
                object[key] = json!(value);
            }
        }
        object
    });
    Value::Array(each.collect())
}

/// The exit code of a run that would end with `code`: what is worse than lints keeps its own.
pub fn code(lint: Lint, found: &[Found], code: u8) -> u8 {
    if lint == Lint::Error && !found.is_empty() && code == exit::OK { exit::FAILED } else { code }
}
