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
use emu_core::table::Flow;

pub use code::Instruction;
pub use totals::{Part, Totals};

/// Places: one for each program word that a counter of 16 bits reaches.
const PLACES: usize = 0x1_0000;

/// What happened in front of an instruction.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// How often the program came from elsewhere, less how often it stood here and something else than an instruction took it
    /// elsewhere.
    came: i64,
    /// How often the instruction before it went elsewhere.
    left: i64,
}

/// Counts where the program goes. Turns of a loop that only waits are jumped over as in a run that nobody looks at, so a count is of
/// the turns that were made one by one.
#[derive(Debug, Clone)]
pub struct Coverage {
    places: Box<[Place; PLACES]>,
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
        // Nothing is touched that no program reaches.
        let places = vec![Place::default(); PLACES].into_boxed_slice().try_into();
        Coverage { places: places.unwrap_or_else(|_| Box::new([Place::default(); PLACES])) }
    }
}

impl Probe for Coverage {
    const FLOW: bool = true;

    #[inline(always)]
    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        self.places[next as usize % PLACES].left += i64::from(taken);
        self.places[to as usize % PLACES].came += i64::from(taken);
    }

    fn enters(&mut self, pc: u32) {
        self.places[pc as usize % PLACES].came += 1;
    }

    fn breaks(&mut self, pc: u32) {
        self.places[pc as usize % PLACES].came -= 1;
    }
}

impl Coverage {
    /// How often the instruction at each program word was executed. `length`: of the instruction at a word, in words.
    fn counts(&self, length: impl Fn(u32) -> u32) -> Vec<u64> {
        let mut counts = vec![0u64; PLACES];
        for (at, place) in self.places.iter().enumerate() {
            // The instructions before it have been added already.
            let count = counts[at].saturating_add_signed(place.came - place.left);
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
    pub fn reached(&self, chip: &'static Chip, image: &Image) -> Vec<Reached> {
        let words = code::Words::of(chip, image);
        let counts = self.counts(|pc| words.line(pc).map_or(1, |line| line.len.max(1) as u32));
        let count = |pc: u32| counts.get(pc as usize).copied().unwrap_or(0);
        let reached = words.instructions(|pc| count(pc) > 0).into_iter().map(|instruction| {
            let count = count(instruction.pc);
            let next = (instruction.pc + instruction.len) as usize % PLACES;
            let left = self.places[next].left.unsigned_abs().min(count);
            let ways = (instruction.flow == Flow::Either).then_some([count - left, left]);
            Reached { count, instruction, ways }
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
        let mut coverage = Coverage::default();
        coverage.enters(0);
        // 0 1 3, 0 1, interrupt 8, 0 1 3 and there it ends.
        coverage.goes(4, 0, true);
        coverage.goes(3, 0, true);
        coverage.breaks(1);
        coverage.enters(8);
        coverage.goes(9, 1, true);
        coverage.breaks(3);
        let counts = coverage.counts(|pc| if pc == 1 { 2 } else { 1 });
        assert_eq!([0, 1, 2, 3, 4, 8, 9].map(|pc: usize| counts[pc]), [3, 3, 0, 1, 0, 1, 0]);
    }
}
