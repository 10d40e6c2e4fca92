//! The clock of a hot loop: machine cycles, the deadline and the count of instructions in three words.

use crate::cpu::END_OF_TIME;
use crate::state::{Damaged, State, Tape};

/// The last cycle that a state may have: a run to the end of time may end somewhat behind it.
const LATEST: u64 = END_OF_TIME + (1 << 32);

/// Bits of the budget that count instructions. A deadline is never further away than a count fits.
const COUNT_BITS: u32 = 24;

/// Counts down to the next deadline. `Copy`, so that a loop can hold it in host registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Countdown {
    /// Cycle of the deadline.
    end: u64,
    /// Cycles left to the deadline (above; negative when an instruction ran over it) and instructions executed since it was
    /// set (the lower [`COUNT_BITS`] bits): one sum per instruction keeps both.
    budget: i64,
    /// Instructions executed before the deadline was set.
    counted: u64,
}

/// Where the deadline lies, and how far it is, says nothing of the machine.
impl State for Countdown {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let (mut cycle, mut instructions) = (self.now(), self.instructions());
        cycle.state(tape)?;
        instructions.state(tape)?;
        tape.set_now(cycle);
        *self = Countdown { end: cycle, budget: 0, counted: instructions };
        tape.demand(cycle <= LATEST && instructions <= END_OF_TIME)
    }
}

impl Countdown {
    /// At cycle 0, which is the deadline.
    pub const START: Countdown = Countdown { end: 0, budget: 0, counted: 0 };

    /// The machine cycle.
    #[inline(always)]
    #[must_use]
    pub const fn now(&self) -> u64 {
        self.end.wrapping_sub((self.budget >> COUNT_BITS) as u64)
    }

    /// Instructions executed.
    #[inline(always)]
    #[must_use]
    pub const fn instructions(&self) -> u64 {
        self.counted + (self.budget & ((1 << COUNT_BITS) - 1)) as u64
    }

    /// Counts an instruction.
    #[inline(always)]
    pub const fn count(&mut self) {
        self.budget += 1;
    }

    /// Spends cycles.
    #[inline(always)]
    pub const fn charge(&mut self, cycles: u32) {
        self.budget -= (cycles as i64) << COUNT_BITS;
    }

    /// True while there is a cycle left to the deadline.
    #[inline(always)]
    #[must_use]
    pub const fn goes_on(&self) -> bool {
        self.budget >= 1 << COUNT_BITS
    }

    /// Makes now the deadline.
    #[inline(always)]
    pub const fn force(&mut self) {
        self.end = self.now();
        self.budget &= (1 << COUNT_BITS) - 1;
    }

    /// Lets cycles pass without instructions; the deadline moves along.
    pub const fn pass(&mut self, cycles: u64) {
        self.end += cycles;
    }

    /// Lets `turns` pass that are like the one which began at the cycle `start` and the instruction count `counted`.
    pub const fn repeat(&mut self, turns: u64, start: u64, counted: u64) {
        let (cycles, instructions) = (self.now() - start, self.instructions() - counted);
        self.counted += turns * instructions;
        self.pass(turns * cycles);
    }

    /// Sets the next deadline, or as much of the way there as the count holds; `deadline` is not before now.
    pub const fn set_deadline(&mut self, deadline: u64) {
        let now = self.now();
        let most = (1 << (COUNT_BITS - 1)) as u64;
        let left = if deadline - now > most { most } else { deadline - now };
        self.counted = self.instructions();
        self.end = now + left;
        self.budget = (left as i64) << COUNT_BITS;
    }
}
