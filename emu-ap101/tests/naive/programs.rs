//! The programs of `../programs/` on every machine.

use super::core::Core;
use super::machine::{End, Line, Naive, When};
use super::script::{Case, Subject, cases};

const FILES: [(&str, &str); 4] = [
    ("logic.txt", include_str!("../programs/logic.txt")),
    ("outputs.txt", include_str!("../programs/outputs.txt")),
    ("jumps.txt", include_str!("../programs/jumps.txt")),
    ("modules.txt", include_str!("../programs/modules.txt")),
];

impl Subject for Naive {
    fn make(bytes: &[Option<u8>]) -> Result<Naive, usize> {
        Naive::new(bytes)
    }
    fn drive(&mut self, when: When, line: Line, level: bool) {
        self.drive(when, line, level);
    }
    fn run(&mut self, until: u64) -> End {
        self.run(until)
    }
    fn cycle(&self) -> u64 {
        self.cycle
    }
    fn instructions(&self) -> u64 {
        self.instructions
    }
    fn reg(&self, name: &str) -> Option<u32> {
        Some(match name {
            "A" => u32::from(self.a),
            "NA" => u32::from(self.na),
            "RIC" => u32::from(self.ric),
            "RX" => u32::from(self.rx),
            "PROG" => self.prog as u32,
            "OVR" => u32::from(self.overruns),
            _ => return None,
        })
    }
    fn peek(&self, space: &str, at: usize) -> Option<u8> {
        self.peek(space, at)
    }
    fn output(&self, n: usize) -> bool {
        self.bistables[n]
    }
    fn reset(&mut self, cold: bool) {
        self.reset(cold);
    }
    fn poke_ram(&mut self, at: usize, bit: bool) {
        self.ram[at] = bit;
    }
    fn edges(&self) -> Vec<(When, usize, bool)> {
        self.edges.clone()
    }
    fn clear(&self) -> bool {
        self.clear
    }
}

/// All cases of all files.
pub fn all() -> Vec<Case> {
    FILES.iter().flat_map(|(_, text)| cases(text)).collect()
}

fn check<S: Subject>() {
    let mut count = 0;
    let mut faults = Vec::new();
    for (file, text) in FILES {
        for case in cases(text) {
            count += 1;
            let Case { name, items, .. } = &case;
            if let Err(fault) = case.check::<S>() {
                faults.push(format!("{file}: {name}: {}\n    {fault}\n{}", items.join(" ; "), case.source));
            }
        }
    }
    assert!(faults.is_empty(), "{} of {count} cases:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn the_naive_model_runs_every_program_as_written() {
    check::<Naive>();
}

#[test]
fn the_crate_runs_every_program_as_written() {
    check::<Core>();
}
