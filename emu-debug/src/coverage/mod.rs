//! What of a program a run has executed: instructions, and both ways of those that have a condition.
//!
//! ```text
//!   mod.rs     the probe                      code.rs   program memory as instructions
//!   lcov.rs    the account as a tracefile     totals.rs the account in figures
//! ```
//! The probe keeps, for every program word, how often the instruction there was followed by the one a word, two or three behind
//! it, or by any other. Everything else is read off that after the run.

pub mod code;
pub mod lcov;
pub mod totals;

use std::collections::BTreeMap;

use emu_core::chip::Chip;
use emu_core::cpu::Probe;
use emu_core::image::Image;
use emu_core::table::Flow;

pub use code::Instruction;
pub use totals::{Part, Totals};

/// Ways on that are told apart: three distances, and all others as 0.
const WAYS: usize = 4;

/// Places: one for each program word that a counter of 16 bits reaches, and as many again, so that an index needs no check.
const PLACES: usize = 0x2_0000;

/// No instruction of this program: what comes first, and what comes behind an interrupt.
const OUTSIDE: u32 = 0x1_0000;

/// Counts instructions and the ways on from them. Turns of a loop that only waits are jumped over as in a run that nobody looks
/// at, so a count is of the turns that were made one by one.
#[derive(Debug, Clone)]
pub struct Coverage {
    ways: Box<[[u64; WAYS]; PLACES]>,
    from: u32,
    /// Instructions behind which an interrupt came, so that it is not known where they went on.
    interrupted: BTreeMap<u32, u64>,
}

/// An instruction and what became of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reached {
    /// The instruction.
    pub instruction: Instruction,
    /// How often it was executed.
    pub count: u64,
    /// How often it went on to the next instruction, and how often elsewhere, where it has a condition.
    pub ways: Option<[u64; 2]>,
}

impl Default for Coverage {
    fn default() -> Self {
        // Nothing is zeroed that is not touched.
        let ways = vec![[0; WAYS]; PLACES].into_boxed_slice().try_into();
        let ways = ways.unwrap_or_else(|_| Box::new([[0; WAYS]; PLACES]));
        Coverage { ways, from: OUTSIDE, interrupted: BTreeMap::new() }
    }
}

impl Probe for Coverage {
    const INSN: bool = true;
    const EVERY: bool = false;

    #[inline(always)]
    fn insn(&mut self, _at: u64, pc: u32) -> bool {
        let distance = pc.wrapping_sub(self.from) as usize;
        let way = if distance < WAYS { distance } else { 0 };
        self.ways[self.from as usize % PLACES][way] += 1;
        self.from = pc;
        false
    }

    fn irq(&mut self, _at: u64, _vector: u8) {
        self.leave();
    }
}

impl Coverage {
    /// Where the last instruction goes on is not known, or is nothing that it does.
    fn leave(&mut self) {
        if self.from != OUTSIDE {
            *self.interrupted.entry(self.from).or_default() += 1;
            self.from = OUTSIDE;
        }
    }

    /// How often the instruction at a program word was executed.
    #[must_use]
    pub fn count(&self, pc: u32) -> u64 {
        let last = u64::from(self.from == pc && self.from != OUTSIDE);
        let went: u64 = self.ways.get(pc as usize).map_or(0, |ways| ways.iter().sum());
        went + self.interrupted.get(&pc).copied().unwrap_or(0) + last
    }

    /// All instructions of an image, by address.
    #[must_use]
    pub fn reached(&self, chip: &'static Chip, image: &Image) -> Vec<Reached> {
        let code = code::instructions(chip, image, |pc| self.count(pc) > 0);
        let reached = code.into_iter().map(|instruction| {
            let ways = (instruction.flow == Flow::Either).then(|| self.both(&instruction));
            Reached { count: self.count(instruction.pc), instruction, ways }
        });
        reached.collect()
    }

    fn both(&self, instruction: &Instruction) -> [u64; 2] {
        let Some(ways) = self.ways.get(instruction.pc as usize) else { return [0; 2] };
        let next = ways.get(instruction.len as usize).copied().unwrap_or(0);
        [next, ways.iter().sum::<u64>() - next]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two instructions of a word and one of two; the middle one has gone both ways.
    #[test]
    fn ways_are_counted_at_the_instruction_that_they_lead_on_from() {
        let mut coverage = Coverage::default();
        for pc in [0, 1, 3, 0, 1, 0, 1] {
            assert!(!coverage.insn(0, pc));
        }
        coverage.irq(0, 3);
        coverage.insn(0, 8);
        assert_eq!([0, 1, 2, 3, 8].map(|pc| coverage.count(pc)), [3, 3, 0, 1, 1]);
        let at = |pc, len| Instruction { pc, len, flow: Flow::Either, text: String::new() };
        assert_eq!(coverage.both(&at(1, 2)), [1, 1]);
        assert_eq!(coverage.both(&at(0, 1)), [3, 0]);
        // Where the one before the interrupt went nobody knows, and the last one has not gone on yet.
        assert_eq!(coverage.both(&at(8, 1)), [0, 0]);
    }
}
