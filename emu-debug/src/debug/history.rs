//! What the debugger remembers: copies of the machine, and everything that was done to it from outside.

use std::time::Duration;

use emu_core::cpu::ResetCause;

use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression_place::ExpressionPlace;
use super::followed_machine::FollowedMachine;
use crate::stimulus::TimedDrive;

/// Something done to the machine by the user, not by the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UserAction {
    /// A level or a voltage on a pin, or the supply, from a time on.
    Drive(TimedDrive),
    /// A reset.
    Reset(ResetCause),
    /// Another value of a place; the program counter in program words.
    Set(ExpressionPlace, i64),
}

impl UserAction {
    /// Does it.
    ///
    /// # Errors
    /// The machine has no such thing, or it cannot have that value.
    pub fn apply(&self, target: &mut dyn DynMachine) -> Result<(), DebugError> {
        match *self {
            UserAction::Drive(drive) => Ok(target.queue_drive(drive)?),
            UserAction::Reset(why) => {
                target.reset(why);
                Ok(())
            }
            UserAction::Set(place, value) => place.set(target, value),
        }
    }
}

/// An action, and the cycle at which the machine stood when it was done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct InputEvent {
    pub cycle: u64,
    pub action: UserAction,
}

/// A copy of the machine, and what it costs to run from it to the next copy.
struct MachineCopy {
    machine: FollowedMachine,
    cost: Duration,
}

/// A place within a step, such as sleep, in which a run was stopped, and which was left by steps back.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeftPosition {
    /// Its cycle.
    pub cycle: u64,
    /// The cycle to which steps back and forth have led: whatever else moves the machine from there forgets the place.
    pub returned_to: u64,
}

/// Newest copies that are never thinned out, so that steps near the end are quick.
const NEWEST_KEPT: usize = 32;

/// Copies and deeds.
pub(super) struct MachineHistory {
    copies: Vec<MachineCopy>,
    pub input_events: Vec<InputEvent>,
    /// Bytes that copies may take.
    budget: usize,
    used: usize,
}

impl MachineHistory {
    /// A history that begins with `line`, and keeps at most `budget` bytes of copies besides that first one.
    pub fn new(line: &FollowedMachine, budget: usize) -> MachineHistory {
        let first = MachineCopy { machine: line.fork(), cost: Duration::ZERO };
        MachineHistory { copies: vec![first], input_events: Vec::new(), budget, used: 0 }
    }

    /// Keeps a copy; `cost`: how long the run took that led here from the copy before.
    pub fn keep_copy(&mut self, line: &FollowedMachine, cost: Duration) {
        if let Some(last) = self.copies.last_mut() {
            if last.machine.cycle() >= line.cycle() {
                return;
            }
            last.cost = cost;
        }
        let copy = line.fork();
        self.used += copy.size_in_bytes();
        self.copies.push(MachineCopy { machine: copy, cost: Duration::ZERO });
        while self.used > self.budget && self.drop_cheapest() {}
    }

    /// Drops the copy whose absence costs least. The first one, where all begins, stays.
    fn drop_cheapest(&mut self) -> bool {
        let last = self.copies.len().saturating_sub(NEWEST_KEPT.min(self.copies.len() / 2)).max(2);
        let pairs = self.copies.windows(2).take(last - 1).enumerate();
        let cheapest = pairs.min_by_key(|(_, pair)| pair.iter().map(|moment| moment.cost).sum::<Duration>());
        let Some(at) = cheapest.map(|(at, _)| at + 1).filter(|at| *at < self.copies.len()) else { return false };
        let gone = self.copies.remove(at);
        self.used = self.used.saturating_sub(gone.machine.size_in_bytes());
        if let Some(before) = self.copies.get_mut(at - 1) {
            before.cost += gone.cost;
        }
        true
    }

    /// Copies at cycles below `cycle`, the newest first.
    pub fn copies_before(&self, cycle: u64) -> impl Iterator<Item = &FollowedMachine> {
        self.copies.iter().rev().map(|moment| &moment.machine).filter(move |line| line.cycle() < cycle)
    }

    /// The newest copy at or before a cycle; the first where there is none.
    pub fn copy_at(&self, cycle: u64) -> Option<&FollowedMachine> {
        let found = self.copies.iter().rev().find(|moment| moment.machine.cycle() <= cycle);
        found.or(self.copies.first()).map(|moment| &moment.machine)
    }

    /// The cycle at which it begins.
    pub fn first_cycle(&self) -> u64 {
        self.copies.first().map_or(0, |moment| moment.machine.cycle())
    }

    /// Copies, and the bytes that they take.
    pub fn size(&self) -> (usize, usize) {
        (self.copies.len(), self.used)
    }

    /// Everything from `line` on is different from now on: forgets what was to come, and notes a deed.
    pub fn branch(&mut self, line: &FollowedMachine, action: UserAction) {
        self.input_events.truncate(line.events_applied);
        self.input_events.push(InputEvent { cycle: line.cycle(), action });
        // A copy at this very cycle is of before the deed, which is done to it again when it runs on.
        while let Some(gone) = self.copies.pop_if(|moment| moment.machine.cycle() > line.cycle()) {
            self.used = self.used.saturating_sub(gone.machine.size_in_bytes());
        }
        if let Some(last) = self.copies.last_mut() {
            last.cost = Duration::ZERO;
        }
    }
}
