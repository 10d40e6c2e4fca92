//! What of a program a run has executed: instructions, and both ways of those that have a condition.
//!
//! ```text
//!   mod.rs     the probe                      code.rs   program memory as instructions
//!   lcov.rs    the account as a tracefile     totals.rs the account in figures
//! ```
//! The probe keeps where the program went elsewhere than on to the next instruction, and so costs next to nothing where it did not.
//! How often an instruction was executed is how often the program came there from elsewhere, and from the instruction before it,
//! which is as often as that was executed and not left.

pub mod code;
pub mod lcov;
pub mod totals;

use emu_core::chip::Chip;
use emu_core::cpu::Probe;
use emu_core::image::Image;
use emu_core::table::FlowKind;

pub use code::ImageInstruction;
pub use totals::{CoverageTotals, CoveredShare};

/// Places: one for each program word that a counter of 16 bits reaches.
const WORD_COUNT: usize = 0x1_0000;

/// What happened in front of an instruction.
#[derive(Debug, Clone, Copy, Default)]
struct WordCounts {
    /// How often the program came from elsewhere, less how often it stood here and something else than an instruction took it
    /// elsewhere.
    arrivals: i64,
    /// How often the instruction before it went elsewhere.
    departures: i64,
}

/// Counts where the program goes. Turns of a loop that only waits are jumped over as in a run that nobody looks at, so a count is of
/// the turns that were made one by one.
#[derive(Debug, Clone)]
pub struct CodeCoverage {
    places: Box<[WordCounts; WORD_COUNT]>,
}

/// An instruction and what became of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoveredInstruction {
    /// The instruction.
    pub instruction: ImageInstruction,
    /// How often it was executed.
    pub count: u64,
    /// How often it went on to the next instruction, and how often elsewhere, where it has a condition.
    pub counts_by_outcome: Option<[u64; 2]>,
}

impl Default for CodeCoverage {
    fn default() -> Self {
        // Nothing is touched that no program reaches.
        let places = vec![WordCounts::default(); WORD_COUNT].into_boxed_slice().try_into();
        CodeCoverage { places: places.unwrap_or_else(|_| Box::new([WordCounts::default(); WORD_COUNT])) }
    }
}

impl Probe for CodeCoverage {
    const FLOW: bool = true;

    #[inline(always)]
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.places[next as usize % WORD_COUNT].departures += i64::from(taken);
        self.places[to as usize % WORD_COUNT].arrivals += i64::from(taken);
    }

    fn on_flow_start(&mut self, pc: u32) {
        self.places[pc as usize % WORD_COUNT].arrivals += 1;
    }

    fn on_flow_end(&mut self, pc: u32) {
        self.places[pc as usize % WORD_COUNT].arrivals -= 1;
    }
}

impl CodeCoverage {
    /// How often the instruction at each program word was executed. `length`: of the instruction at a word, in words.
    fn counts(&self, length: impl Fn(u32) -> u32) -> Vec<u64> {
        let mut counts = vec![0u64; WORD_COUNT];
        for (at, place) in self.places.iter().enumerate() {
            // The instructions before it have been added already.
            let count = counts[at].saturating_add_signed(place.arrivals - place.departures);
            counts[at] = count;
            let next = at + if count > 0 { length(at as u32) as usize } else { 1 };
            if let Some(next) = counts.get_mut(next) {
                *next += count;
            }
        }
        counts
    }

    /// All instructions of an image, by address. Of instructions that overlap and end at one word it is not known which of them went
    /// elsewhere.
    #[must_use]
    pub fn covered_instructions(&self, chip: &'static Chip, image: &Image) -> Vec<CoveredInstruction> {
        let words = code::ProgramWords::of(chip, image);
        let counts = self.counts(|pc| words.line(pc).map_or(1, |line| line.len.max(1) as u32));
        let count = |pc: u32| counts.get(pc as usize).copied().unwrap_or(0);
        let reached = words.instructions(|pc| count(pc) > 0).into_iter().map(|instruction| {
            let count = count(instruction.pc);
            let next = (instruction.pc + instruction.len) as usize % WORD_COUNT;
            let left = self.places[next].departures.unsigned_abs().min(count);
            let ways = (instruction.flow == FlowKind::Conditional).then_some([count - left, left]);
            CoveredInstruction { count, instruction, counts_by_outcome: ways }
        });
        reached.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An instruction of one word, one of two that has a condition, an interrupt, and an end.
    #[test]
    fn counts_are_read_off_the_ways() {
        let mut coverage = CodeCoverage::default();
        coverage.on_flow_start(0);
        // 0 1 3, 0 1, interrupt 8, 0 1 3 and there it ends.
        coverage.on_branch(4, 0, true);
        coverage.on_branch(3, 0, true);
        coverage.on_flow_end(1);
        coverage.on_flow_start(8);
        coverage.on_branch(9, 1, true);
        coverage.on_flow_end(3);
        let counts = coverage.counts(|pc| if pc == 1 { 2 } else { 1 });
        assert_eq!([0, 1, 2, 3, 4, 8, 9].map(|pc: usize| counts[pc]), [3, 3, 0, 1, 0, 1, 0]);
    }
}
