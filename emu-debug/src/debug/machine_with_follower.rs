//! A machine at a position of its history: runs it, applies the user's actions at their cycles, and notifies
//! the follower of the program.

use std::collections::BTreeSet;

use emu_core::cpu::{LAST_CYCLE, ResetCause, StopReason};

use super::dyn_machine::{DynMachine, DynProbe, ObserveLevel};
use super::error::DebugError;
use super::history::{InputEvent, UserAction};

/// Follows a program at words of its own, such as the rungs of a ladder program. Its state goes back in time
/// with the machine.
pub trait ProgramFollower {
    /// Returns the program words at which it is notified; always the same.
    fn followed_words(&self) -> &[u32];
    /// Called when the machine reaches the program word `pc`, one of [`ProgramFollower::followed_words`]; the
    /// instruction there is next.
    fn on_reached(&mut self, machine: &dyn DynMachine, pc: u32);
    /// Called after a power cycle: the program's memory is lost.
    fn on_power_cycle(&mut self) {}
    /// Returns the scans begun since power-up, if the program has scans.
    fn scan(&self) -> Option<u64>;
    /// Returns an independent copy.
    fn fork(&self) -> Box<dyn ProgramFollower>;
    /// Returns the maximum size of a copy in bytes.
    fn size_in_bytes(&self) -> usize;
    /// Returns the follower for downcasts.
    fn as_any(&self) -> &dyn std::any::Any;
}

/// A machine at a position of its history, with its follower.
pub(super) struct MachineWithFollower {
    /// The machine.
    pub machine: Box<dyn DynMachine>,
    /// The follower of the program, if there is one.
    pub follower: Option<Box<dyn ProgramFollower>>,
    /// Number of input events of the history that were applied to the machine.
    pub input_events_applied: usize,
    /// The follower was notified of the next instruction.
    follower_notified: bool,
    /// Time passes even if nothing can wake the chip, because the end of the run is known.
    pub runs_while_halted: bool,
    /// A step has ended here, not a limit within one.
    pub at_step_end: bool,
}

impl MachineWithFollower {
    /// Returns the machine at the end of a step, with no input event applied.
    pub fn new(machine: Box<dyn DynMachine>, follow: Option<Box<dyn ProgramFollower>>) -> MachineWithFollower {
        let mut positioned = MachineWithFollower {
            machine,
            follower: follow,
            input_events_applied: 0,
            follower_notified: false,
            runs_while_halted: false,
            at_step_end: true,
        };
        positioned.end_step();
        positioned
    }

    /// Returns an independent copy of machine and follower.
    pub fn fork(&self) -> MachineWithFollower {
        MachineWithFollower {
            machine: self.machine.fork(),
            follower: self.follower.as_ref().map(|follow| follow.fork()),
            input_events_applied: self.input_events_applied,
            follower_notified: self.follower_notified,
            runs_while_halted: self.runs_while_halted,
            at_step_end: self.at_step_end,
        }
    }

    /// Returns the machine cycles since power-up.
    pub fn cycle(&self) -> u64 {
        self.machine.cycle()
    }

    /// Returns the maximum size of a copy in bytes.
    pub fn size_in_bytes(&self) -> usize {
        self.machine.size_in_bytes()
            + self.follower.as_ref().map_or(0, |follow| follow.size_in_bytes())
            + size_of::<MachineWithFollower>()
    }

    /// Sets breakpoints at these program words and removes all others.
    pub fn set_breakpoints(&mut self, words: &BTreeSet<u32>) {
        match &self.follower {
            Some(follow) if !follow.followed_words().is_empty() => {
                let all = words.iter().chain(follow.followed_words()).copied().collect();
                self.machine.set_breakpoints(&all);
            }
            _ => self.machine.set_breakpoints(words),
        }
    }

    /// Runs to the cycle `until`. At a word of the follower the follower is notified and the run continues,
    /// unless the word is also in `words`.
    pub fn run(
        &mut self,
        input_events: &[InputEvent],
        until: u64,
        words: &BTreeSet<u32>,
        level: ObserveLevel,
        probe: &mut dyn DynProbe,
    ) -> StopReason {
        loop {
            self.apply_due_input_events(input_events, level, probe);
            let next = self.next_input_event_cycle(input_events);
            let (goal, before) = (until.min(next), self.cycle());
            if before >= goal {
                return StopReason::Limit;
            }
            // A pending action wakes it.
            self.machine.set_run_while_halted(self.runs_while_halted || next != u64::MAX);
            let stop = self.machine.run(goal, level, probe);
            if self.cycle() > before {
                self.follower_notified = false;
            }
            // The run may have ended within a sleep, which is not the end of a step.
            self.at_step_end &= self.cycle() == before;
            if let StopReason::Breakpoint { pc } = stop {
                self.note_arrival(pc)
            } else {
                self.end_step()
            }
            if self.cycle() >= next {
                // Whatever stopped the machine, its state changes now.
                self.apply_due_input_events(input_events, level, probe);
                if self.cycle() >= until {
                    return StopReason::Limit;
                }
                continue;
            }
            match stop {
                StopReason::Limit if self.cycle() < until => {}
                StopReason::Breakpoint { pc } if !words.contains(&pc) => {}
                _ => return stop,
            }
        }
    }

    /// Runs to the end of the next step: an instruction or the entry of an interrupt, with the sleep before
    /// it. `limit` is a cycle at which sleep ends in any case. Breakpoints are ignored.
    pub fn step(
        &mut self,
        input_events: &[InputEvent],
        limit: u64,
        level: ObserveLevel,
        probe: &mut dyn DynProbe,
    ) -> StopReason {
        self.apply_due_input_events(input_events, level, probe);
        let (start, pc, counted) = (self.cycle(), self.machine.pc(), self.machine.instructions());
        let mut stopped_at_breakpoint = false;
        loop {
            let before = self.cycle();
            let next = self.next_input_event_cycle(input_events);
            // Sleep ends at the next action of this history.
            self.machine.set_run_while_halted(self.runs_while_halted || next != u64::MAX);
            let stop = self.machine.step_until(next.min(limit), level, probe);
            match stop {
                StopReason::Breakpoint { pc } if !stopped_at_breakpoint => {
                    stopped_at_breakpoint = true;
                    self.note_arrival(pc);
                    continue;
                }
                StopReason::Limit | StopReason::Probe => {}
                StopReason::Halted if self.cycle() > before && self.machine.instructions() > counted => {}
                stop => {
                    self.at_step_end &= self.cycle() == start;
                    return stop;
                }
            }
            if self.cycle() > before {
                self.follower_notified = false;
            }
            self.apply_due_input_events(input_events, level, probe);
            let moved = self.machine.pc() != pc || self.machine.instructions() != counted;
            // If nothing is ever due, it sleeps cycle by cycle, and the caller can interrupt it in between.
            let endless = next.min(limit) >= LAST_CYCLE && self.cycle() == before + 1;
            if moved || self.cycle() >= limit || stop == StopReason::Probe || endless {
                self.at_step_end = moved;
                self.end_step();
                return if moved { StopReason::Limit } else { stop };
            }
        }
    }

    /// Executes one step of the machine, which ends early at a breakpoint; those in `words` are reported.
    /// `limit` is a cycle at which sleep ends in any case.
    pub fn step_to_breakpoint(
        &mut self,
        input_events: &[InputEvent],
        words: &BTreeSet<u32>,
        limit: u64,
        level: ObserveLevel,
        probe: &mut dyn DynProbe,
    ) -> StopReason {
        let before = self.cycle();
        let stop = self.machine.step_until(limit.min(self.next_input_event_cycle(input_events)), level, probe);
        if self.cycle() > before {
            (self.follower_notified, self.at_step_end) = (false, false);
        }
        self.apply_due_input_events(input_events, level, probe);
        match stop {
            StopReason::Breakpoint { pc } => {
                self.note_arrival(pc);
                if words.contains(&pc) { stop } else { StopReason::Limit }
            }
            stop => stop,
        }
    }

    /// Records that the machine has stopped before the instruction at `pc`.
    fn note_arrival(&mut self, pc: u32) {
        if let Some(follow) =
            self.follower.as_mut().filter(|f| !self.follower_notified && f.followed_words().contains(&pc))
        {
            self.follower_notified = true;
            follow.on_reached(&*self.machine, pc);
        }
    }

    /// Ends a step: notifies the follower at once if the next word is one of its words and no interrupt comes
    /// first.
    fn end_step(&mut self) {
        let pc = self.machine.pc();
        if self.follower.as_ref().is_some_and(|follow| follow.followed_words().contains(&pc)) {
            self.notify_follower();
        }
    }

    /// Notifies the follower if one of its words is next at this cycle.
    fn notify_follower(&mut self) {
        let Some(follow) = self.follower.as_ref().filter(|_| !self.follower_notified) else { return };
        let mut copy = self.machine.fork();
        copy.set_breakpoints(&follow.followed_words().iter().copied().collect());
        // A run of a halted controller ends before it checks breakpoints; a step does not.
        if let StopReason::Breakpoint { pc } = copy.step(ObserveLevel::Nothing, &mut ())
            && copy.cycle() == self.cycle()
        {
            self.note_arrival(pc);
        }
    }

    /// Returns the cycle of the next input event: a run that ends there shows its effect.
    pub fn next_input_event_cycle(&self, input_events: &[InputEvent]) -> u64 {
        input_events.get(self.input_events_applied).map_or(u64::MAX, |event| event.cycle)
    }

    /// Applies the input events that are due up to now.
    pub fn apply_due_input_events(
        &mut self,
        input_events: &[InputEvent],
        level: ObserveLevel,
        probe: &mut dyn DynProbe,
    ) {
        while let Some(event) = input_events.get(self.input_events_applied).filter(|event| event.cycle <= self.cycle())
        {
            // An action that fails had failed when it was first applied, and was not recorded.
            _ = self.apply(&event.action, level, probe);
            self.input_events_applied += 1;
        }
    }

    /// Applies an action and lets the chip react to it; no time passes.
    pub fn apply(
        &mut self,
        action: &UserAction,
        level: ObserveLevel,
        probe: &mut dyn DynProbe,
    ) -> Result<(), DebugError> {
        // The follower is notified of this word first, however the machine got here. A controller updates its
        // inputs only when it runs.
        self.notify_follower();
        let pc = self.machine.pc();
        action.apply(&mut *self.machine)?;
        self.machine.run(self.cycle(), level, probe);
        if matches!(action, UserAction::Reset(_)) || self.machine.pc() != pc {
            self.follower_notified = false;
        }
        if let (UserAction::Reset(ResetCause::PowerOn), Some(follow)) = (action, &mut self.follower) {
            follow.on_power_cycle();
        }
        self.end_step();
        Ok(())
    }
}
