//! The history of the debugger: copies of the machine, and all actions of the user.

use std::time::Duration;

use emu_core::cpu::ResetCause;

use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression_place::ExpressionPlace;
use super::machine_with_follower::MachineWithFollower;
use crate::stimulus::TimedDrive;

/// An action of the user on the machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UserAction {
    /// A level or a voltage on a pin, or the supply, from a time on.
    Drive(TimedDrive),
    /// A reset.
    Reset(ResetCause),
    /// A new value of a location; the program counter in program words.
    Set(ExpressionPlace, i64),
}

impl UserAction {
    /// Applies the action.
    ///
    /// # Errors
    /// The machine has no such location, or it cannot have that value.
    pub fn apply(&self, machine: &mut dyn DynMachine) -> Result<(), DebugError> {
        match *self {
            UserAction::Drive(drive) => Ok(machine.queue_drive(drive)?),
            UserAction::Reset(why) => {
                machine.reset(why);
                Ok(())
            }
            UserAction::Set(place, value) => place.set(machine, value),
        }
    }
}

/// An action, and the cycle of the machine when it was applied.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct InputEvent {
    pub cycle: u64,
    pub action: UserAction,
}

/// How much a history keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistorySize {
    /// Number of copies of the machine.
    pub copies: usize,
    /// Size of all copies except the first, in bytes.
    pub bytes: usize,
}

/// A copy of the machine, and the host time to run from it to the next copy.
struct MachineCopy {
    machine: MachineWithFollower,
    cost: Duration,
}

/// A cycle within a step, such as a sleep, at which a run was stopped before steps back.
#[derive(Debug, Clone, Copy)]
pub(super) struct MidStepPosition {
    /// Its cycle.
    pub cycle: u64,
    /// The cycle that steps back and forth have reached; any other movement from there discards the position.
    pub returned_to: u64,
}

/// Number of newest copies that are never removed, so that steps near the end are fast.
const NEWEST_KEPT: usize = 32;

/// The copies of the machine, and the input events of the user.
pub(super) struct MachineHistory {
    copies: Vec<MachineCopy>,
    /// The external actions on the machine so far, in order of time.
    pub input_events: Vec<InputEvent>,
    /// Maximum size of all copies except the first, in bytes.
    max_copy_bytes: usize,
    /// Size of all copies except the first, in bytes.
    copy_bytes: usize,
}

impl MachineHistory {
    /// Returns a history that begins with `machine` and keeps at most `max_copy_bytes` of further copies.
    pub fn new(machine: &MachineWithFollower, max_copy_bytes: usize) -> MachineHistory {
        let first = MachineCopy { machine: machine.fork(), cost: Duration::ZERO };
        MachineHistory { copies: vec![first], input_events: Vec::new(), max_copy_bytes, copy_bytes: 0 }
    }

    /// Keeps a copy; `cost` is the host time of the run from the previous copy.
    pub fn keep_copy(&mut self, machine: &MachineWithFollower, cost: Duration) {
        if let Some(last) = self.copies.last_mut() {
            if last.machine.cycle() >= machine.cycle() {
                return;
            }
            last.cost = cost;
        }
        let copy = machine.fork();
        self.copy_bytes += copy.size_in_bytes();
        self.copies.push(MachineCopy { machine: copy, cost: Duration::ZERO });
        while self.copy_bytes > self.max_copy_bytes && self.drop_cheapest() {}
    }

    /// Removes the copy whose removal adds the least host time to replays. The first copy stays, because
    /// everything begins there.
    fn drop_cheapest(&mut self) -> bool {
        let last = self.copies.len().saturating_sub(NEWEST_KEPT.min(self.copies.len() / 2)).max(2);
        let pairs = self.copies.windows(2).take(last - 1).enumerate();
        let cheapest = pairs.min_by_key(|(_, pair)| pair.iter().map(|moment| moment.cost).sum::<Duration>());
        let Some(at) = cheapest.map(|(at, _)| at + 1).filter(|at| *at < self.copies.len()) else { return false };
        let gone = self.copies.remove(at);
        self.copy_bytes = self.copy_bytes.saturating_sub(gone.machine.size_in_bytes());
        if let Some(before) = self.copies.get_mut(at - 1) {
            before.cost += gone.cost;
        }
        true
    }

    /// Returns the copies at cycles below `cycle`, the newest first.
    pub fn copies_before(&self, cycle: u64) -> impl Iterator<Item = &MachineWithFollower> {
        self.copies.iter().rev().map(|moment| &moment.machine).filter(move |machine| machine.cycle() < cycle)
    }

    /// Returns the newest copy at or before a cycle, or the first copy if there is none.
    pub fn copy_at(&self, cycle: u64) -> Option<&MachineWithFollower> {
        let found = self.copies.iter().rev().find(|moment| moment.machine.cycle() <= cycle);
        found.or(self.copies.first()).map(|moment| &moment.machine)
    }

    /// Returns the cycle at which the history begins.
    pub fn first_cycle(&self) -> u64 {
        self.copies.first().map_or(0, |moment| moment.machine.cycle())
    }

    /// Returns how much is kept.
    pub fn size(&self) -> HistorySize {
        HistorySize { copies: self.copies.len(), bytes: self.copy_bytes }
    }

    /// Discards everything after `machine` and records an action: the future is different from now on.
    pub fn branch(&mut self, machine: &MachineWithFollower, action: UserAction) {
        self.input_events.truncate(machine.input_events_applied);
        self.input_events.push(InputEvent { cycle: machine.cycle(), action });
        // A copy at this very cycle is from before the action, which is applied again when the copy runs.
        while let Some(gone) = self.copies.pop_if(|moment| moment.machine.cycle() > machine.cycle()) {
            self.copy_bytes = self.copy_bytes.saturating_sub(gone.machine.size_in_bytes());
        }
        if let Some(last) = self.copies.last_mut() {
            last.cost = Duration::ZERO;
        }
    }
}
