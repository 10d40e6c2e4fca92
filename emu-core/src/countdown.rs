//! The clock of a hot loop: machine cycles, the deadline and the count of instructions in three words.

use crate::cpu::LAST_CYCLE;
use crate::state::{SnapshotDamaged, SnapshotState, StateTape};

/// The last cycle that a state may have: a run to the end of time may end somewhat behind it.
const MAX_CYCLE: u64 = LAST_CYCLE + (1 << 32);

/// Bits of the budget that count instructions. A deadline is never further away than a count fits.
const COUNT_BITS: u32 = 24;

/// Counts down to the next deadline. `Copy`, so that a loop can hold it in host registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Countdown {
    /// Cycle of the deadline.
    end: u64,
    /// Cycles left to the deadline (above; negative when an instruction ran over it) and instructions executed since it was
    /// set (the lower [`COUNT_BITS`] bits): one sum per instruction keeps both.
    cycles_and_count: i64,
    /// Instructions executed before the deadline was set.
    counted_before: u64,
}

/// Where the deadline lies, and how far it is, says nothing of the machine.
impl SnapshotState for Countdown {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (mut cycle, mut instructions) = (self.now(), self.instructions());
        cycle.pass_state(tape)?;
        instructions.pass_state(tape)?;
        tape.set_now(cycle);
        *self = Countdown { end: cycle, cycles_and_count: 0, counted_before: instructions };
        tape.require(cycle <= MAX_CYCLE && instructions <= LAST_CYCLE)
    }
}

impl Countdown {
    /// At cycle 0, which is the deadline.
    pub const START: Countdown = Countdown { end: 0, cycles_and_count: 0, counted_before: 0 };

    /// The machine cycle.
    #[inline(always)]
    #[must_use]
    pub const fn now(&self) -> u64 {
        self.end.wrapping_sub((self.cycles_and_count >> COUNT_BITS) as u64)
    }

    /// Instructions executed.
    #[inline(always)]
    #[must_use]
    pub const fn instructions(&self) -> u64 {
        self.counted_before + (self.cycles_and_count & ((1 << COUNT_BITS) - 1)) as u64
    }

    /// Counts an instruction.
    #[inline(always)]
    pub const fn count_instruction(&mut self) {
        self.cycles_and_count += 1;
    }

    /// Spends cycles.
    #[inline(always)]
    pub const fn charge(&mut self, cycles: u32) {
        self.cycles_and_count -= (cycles as i64) << COUNT_BITS;
    }

    /// True while there is a cycle left to the deadline.
    #[inline(always)]
    #[must_use]
    pub const fn is_before_deadline(&self) -> bool {
        self.cycles_and_count >= 1 << COUNT_BITS
    }

    /// Makes now the deadline.
    #[inline(always)]
    pub const fn expire(&mut self) {
        self.end = self.now();
        self.cycles_and_count &= (1 << COUNT_BITS) - 1;
    }

    /// Lets cycles pass without instructions; the deadline moves along.
    pub const fn advance_cycles(&mut self, cycles: u64) {
        self.end += cycles;
    }

    /// Lets `turns` pass that are like the one which began at the cycle `start` and the instruction count `counted`.
    pub const fn repeat_iterations(&mut self, iterations: u64, start: u64, counted: u64) {
        let (cycles, instructions) = (self.now() - start, self.instructions() - counted);
        self.counted_before += iterations * instructions;
        self.advance_cycles(iterations * cycles);
    }

    /// Sets the next deadline, or as much of the way there as the count holds; `deadline` is not before now.
    pub const fn set_deadline(&mut self, deadline: u64) {
        let now = self.now();
        let most = (1 << (COUNT_BITS - 1)) as u64;
        let left = if deadline - now > most { most } else { deadline - now };
        self.counted_before = self.instructions();
        self.end = now + left;
        self.cycles_and_count = (left as i64) << COUNT_BITS;
    }
}
