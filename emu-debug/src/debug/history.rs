//! What the debugger remembers: copies of the machine, and everything that was done to it from outside.

use std::time::Duration;

use emu_core::cpu::Reset;

use super::line::Line;
use super::place::Place;
use super::target::Target;
use crate::stimulus::Drive;

/// Something done to the machine by the user, not by the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// A level or a voltage on a pin, or the supply, from a time on.
    Drive(Drive),
    /// A reset.
    Reset(Reset),
    /// Another value of a place; the program counter in program words.
    Set(Place, i64),
}

impl Action {
    /// Does it.
    ///
    /// # Errors
    /// The machine has no such thing, or it cannot have that value: one sentence.
    pub fn apply(&self, target: &mut dyn Target) -> Result<(), String> {
        match *self {
            Action::Drive(drive) => target.put(drive),
            Action::Reset(why) => {
                target.reset(why);
                Ok(())
            }
            Action::Set(place, value) => place.set(target, value),
        }
    }
}

/// An action, and the cycle at which the machine stood when it was done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Deed {
    pub cycle: u64,
    pub action: Action,
}

/// A copy of the machine, and what it costs to run from it to the next copy.
struct Moment {
    line: Line,
    cost: Duration,
}

/// A place within a step, such as sleep, in which a run was stopped, and which was left by steps back.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left {
    /// Its cycle.
    pub at: u64,
    /// The cycle to which steps back and forth have led: whatever else moves the machine from there forgets the place.
    pub stands: u64,
}

/// Newest copies that are never thinned out, so that steps near the end are quick.
const DENSE: usize = 32;

/// Copies and deeds.
pub(super) struct History {
    moments: Vec<Moment>,
    pub deeds: Vec<Deed>,
    /// Bytes that copies may take.
    budget: usize,
    used: usize,
}

impl History {
    /// A history that begins with `line`, and keeps at most `budget` bytes of copies besides that first one.
    pub fn new(line: &Line, budget: usize) -> History {
        let first = Moment { line: line.fork(), cost: Duration::ZERO };
        History { moments: vec![first], deeds: Vec::new(), budget, used: 0 }
    }

    /// Keeps a copy; `cost`: how long the run took that led here from the copy before.
    pub fn keep(&mut self, line: &Line, cost: Duration) {
        if let Some(last) = self.moments.last_mut() {
            if last.line.cycle() >= line.cycle() {
                return;
            }
            last.cost = cost;
        }
        let copy = line.fork();
        self.used += copy.weight();
        self.moments.push(Moment { line: copy, cost: Duration::ZERO });
        while self.used > self.budget && self.thin() {}
    }

    /// Drops the copy whose absence costs least. The first one, where all begins, stays.
    fn thin(&mut self) -> bool {
        let last = self.moments.len().saturating_sub(DENSE.min(self.moments.len() / 2)).max(2);
        let pairs = self.moments.windows(2).take(last - 1).enumerate();
        let cheapest = pairs.min_by_key(|(_, pair)| pair.iter().map(|moment| moment.cost).sum::<Duration>());
        let Some(at) = cheapest.map(|(at, _)| at + 1).filter(|at| *at < self.moments.len()) else { return false };
        let gone = self.moments.remove(at);
        self.used = self.used.saturating_sub(gone.line.weight());
        if let Some(before) = self.moments.get_mut(at - 1) {
            before.cost += gone.cost;
        }
        true
    }

    /// Copies at cycles below `cycle`, the newest first.
    pub fn before(&self, cycle: u64) -> impl Iterator<Item = &Line> {
        self.moments.iter().rev().map(|moment| &moment.line).filter(move |line| line.cycle() < cycle)
    }

    /// The newest copy at or before a cycle; the first where there is none.
    pub fn at(&self, cycle: u64) -> Option<&Line> {
        let found = self.moments.iter().rev().find(|moment| moment.line.cycle() <= cycle);
        found.or(self.moments.first()).map(|moment| &moment.line)
    }

    /// The cycle at which it begins.
    pub fn first_cycle(&self) -> u64 {
        self.moments.first().map_or(0, |moment| moment.line.cycle())
    }

    /// Copies, and the bytes that they take.
    pub fn size(&self) -> (usize, usize) {
        (self.moments.len(), self.used)
    }

    /// Everything from `line` on is different from now on: forgets what was to come, and notes a deed.
    pub fn branch(&mut self, line: &Line, action: Action) {
        self.deeds.truncate(line.done);
        self.deeds.push(Deed { cycle: line.cycle(), action });
        // A copy at this very cycle is of before the deed, which is done to it again when it runs on.
        while let Some(gone) = self.moments.pop_if(|moment| moment.line.cycle() > line.cycle()) {
            self.used = self.used.saturating_sub(gone.line.weight());
        }
        if let Some(last) = self.moments.last_mut() {
            last.cost = Duration::ZERO;
        }
    }
}
