//! Reads programs with expectations, which the caller checks: the rest of a case is a list, `wanted; wanted`.
//! A line `until N` in a program sets the cycle at which the run ends (default 2000).

use std::collections::BTreeMap;

use emu_8051::Mcs51;

use crate::source::{self, Program};

/// One case of one program.
pub struct Case {
    program: Program,
    pub until: u64,
    pub labels: BTreeMap<String, u32>,
    pub wanted: Vec<String>,
}

impl Case {
    /// Name of the case.
    pub fn name(&self) -> &str {
        &self.program.name
    }

    /// The chip after power-up, with its drives queued.
    pub fn machine(&self) -> Mcs51 {
        self.program.machine()
    }
}

/// All cases of a text.
pub fn cases(text: &str) -> Vec<Case> {
    source::texts(text).into_iter().map(|(name, source, wanted)| case(&name, &source, &wanted)).collect()
}

fn case(name: &str, source: &str, wanted: &str) -> Case {
    let ends = |line: &&str| line.trim_start().starts_with("until ");
    let (ends, lines): (Vec<&str>, Vec<&str>) = source.lines().partition(ends);
    let until = ends.last().and_then(|line| line.split_whitespace().nth(1));
    let (program, labels) = source::program(name, &lines.join("\n"));
    Case {
        program,
        until: until.map_or(2000, |n| source::number(name, n)),
        labels,
        wanted: wanted.split(';').map(|w| w.trim().to_owned()).filter(|w| !w.is_empty()).collect(),
    }
}
