//! The cycle counter of a hot loop: machine cycles, the deadline and the instruction count in three words.

use crate::cpu::LAST_CYCLE;
use crate::state::{SnapshotDamaged, SnapshotState, StateTape};

/// The last cycle that a saved state may have. A run up to [`LAST_CYCLE`] can end slightly after it.
const MAX_CYCLE: u64 = LAST_CYCLE + (1 << 32);

/// Number of bits of `cycles_and_count` that count instructions. A deadline is never so far away that they
/// overflow.
const COUNT_BITS: u32 = 24;

/// Counts cycles down to the next deadline. It is `Copy`, so that a loop can hold it in host registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Countdown {
    /// The cycle of the deadline.
    deadline: u64,
    /// Cycles left to the deadline in the upper bits (negative if an instruction ended after it), and
    /// instructions executed since the deadline was set in the lower [`COUNT_BITS`] bits. One addition per
    /// instruction updates both.
    cycles_and_count: i64,
    /// Instructions executed when the deadline was set.
    instructions_at_start: u64,
}

/// Only the cycle and the instruction count are saved; the deadline is not part of the machine's state.
impl SnapshotState for Countdown {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (mut cycle, mut instructions) = (self.now(), self.instructions());
        cycle.pass_state(tape)?;
        instructions.pass_state(tape)?;
        tape.set_now(cycle);
        *self = Countdown { deadline: cycle, cycles_and_count: 0, instructions_at_start: instructions };
        tape.require(cycle <= MAX_CYCLE && instructions <= LAST_CYCLE)
    }
}

impl Countdown {
    /// Cycle 0, no instructions, and the deadline is now.
    pub const START: Countdown = Countdown { deadline: 0, cycles_and_count: 0, instructions_at_start: 0 };

    /// The present machine cycle.
    #[inline(always)]
    #[must_use]
    pub const fn now(&self) -> u64 {
        self.deadline.wrapping_sub((self.cycles_and_count >> COUNT_BITS) as u64)
    }

    /// Number of instructions executed.
    #[inline(always)]
    #[must_use]
    pub const fn instructions(&self) -> u64 {
        self.instructions_at_start + (self.cycles_and_count & ((1 << COUNT_BITS) - 1)) as u64
    }

    /// Counts one instruction.
    #[inline(always)]
    pub const fn count_instruction(&mut self) {
        self.cycles_and_count += 1;
    }

    /// Adds `cycles` machine cycles.
    #[inline(always)]
    pub const fn charge(&mut self, cycles: u32) {
        self.cycles_and_count -= (cycles as i64) << COUNT_BITS;
    }

    /// Returns true if at least one cycle is left to the deadline.
    #[inline(always)]
    #[must_use]
    pub const fn is_before_deadline(&self) -> bool {
        self.cycles_and_count >= 1 << COUNT_BITS
    }

    /// Sets the deadline to now, so that the hot loop executes no further instruction before the run loop has
    /// set a new one.
    #[inline(always)]
    pub const fn expire(&mut self) {
        self.deadline = self.now();
        self.cycles_and_count &= (1 << COUNT_BITS) - 1;
    }

    /// Lets cycles pass without instructions; the deadline moves by the same number.
    pub const fn advance_cycles(&mut self, cycles: u64) {
        self.deadline += cycles;
    }

    /// Adds `iterations` iterations equal to the one that began at the cycle `start` with the instruction
    /// count `instructions_before`.
    pub const fn repeat_iterations(&mut self, iterations: u64, start: u64, instructions_before: u64) {
        let (cycles, instructions) = (self.now() - start, self.instructions() - instructions_before);
        self.instructions_at_start += iterations * instructions;
        self.advance_cycles(iterations * cycles);
    }

    /// Sets the next deadline, or an earlier one if the instruction counter could overflow before it.
    /// `deadline` must not be in the past.
    pub const fn set_deadline(&mut self, deadline: u64) {
        let now = self.now();
        let max_cycles_left = (1 << (COUNT_BITS - 1)) as u64;
        let left = if deadline - now > max_cycles_left { max_cycles_left } else { deadline - now };
        self.instructions_at_start = self.instructions();
        self.deadline = now + left;
        self.cycles_and_count = (left as i64) << COUNT_BITS;
    }
}
