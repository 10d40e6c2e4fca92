//! Coverage of a run: the instructions executed, and both outcomes of those with a condition.
//!
//! ```text
//!   mod.rs     the probe                        code.rs   program memory as instructions
//!   lcov.rs    the coverage as a tracefile      totals.rs the coverage in numbers
//! ```
//! The probe only records where the program continued at another than the next instruction, so sequential
//! execution costs next to nothing. The execution count of an instruction is the number of arrivals from
//! elsewhere plus the number of times that the previous instruction was executed and did not branch away.

pub mod code;
pub mod lcov;
pub mod totals;

use emu_core::chip::Chip;
use emu_core::cpu::Probe;
use emu_core::image::Image;
use emu_core::table::FlowKind;

pub use code::ImageInstruction;
pub use totals::{CoverageTotals, CoveredShare};

/// Number of entries: one for each program word that a 16-bit counter reaches.
const WORD_COUNT: usize = 0x1_0000;

/// Events before an instruction.
#[derive(Debug, Clone, Copy, Default)]
struct WordCounts {
    /// How often the program arrived from elsewhere, minus how often it was here when something other than an
    /// instruction (an interrupt) took it away.
    arrivals: i64,
    /// How often the previous instruction branched away.
    departures: i64,
}

/// Counts where the program goes. Iterations of a waiting loop that are skipped, as in a run without probes,
/// are not counted.
#[derive(Debug, Clone)]
pub struct CodeCoverage {
    places: Box<[WordCounts; WORD_COUNT]>,
}

/// An instruction with its counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CoveredInstruction {
    /// The instruction.
    pub instruction: ImageInstruction,
    /// How often it was executed.
    pub count: u64,
    /// How often the next instruction followed, and how often another one, if it has a condition.
    pub counts_by_outcome: Option<[u64; 2]>,
}

impl Default for CodeCoverage {
    fn default() -> Self {
        // Memory that no program reaches is not touched.
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
    /// Returns how often the instruction at each program word was executed. `length` returns the length in
    /// words of the instruction at a word.
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

    /// Returns all instructions of an image, by address. If instructions overlap and end at the same word, it
    /// is not known which of them branched away.
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

    /// An instruction of one word, one of two words with a condition, an interrupt, and an end.
    #[test]
    fn counts_are_read_off_the_ways() {
        let mut coverage = CodeCoverage::default();
        coverage.on_flow_start(0);
        // 0 1 3, 0 1, interrupt 8, 0 1 3, end.
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
