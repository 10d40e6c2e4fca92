//! A machine on its way: it runs, what was done from outside is done to it at its cycles, and who follows the program is told.

use std::collections::BTreeSet;

use emu_core::cpu::{END_OF_TIME, Reset, Stop};

use super::history::{Action, Deed};
use super::target::{Look, Seer, Target};

/// Follows a program at points of its own, such as the rungs of a ladder program, with a state that goes back in time with the
/// machine.
pub trait Follow {
    /// Program words at which it wants to be told; always the same.
    fn stops(&self) -> &[u32];
    /// The machine has come to the program word `pc`, one of [`Follow::stops`]; the instruction there is next.
    fn at(&mut self, target: &dyn Target, pc: u32);
    /// The chip was switched off and on: what the program remembers is gone.
    fn reset(&mut self) {}
    /// Scans begun since power-up, where the program has scans.
    fn scan(&self) -> Option<u64>;
    /// A copy that goes its own way.
    fn fork(&self) -> Box<dyn Follow>;
    /// Bytes that a copy takes at most.
    fn weight(&self) -> usize;
    /// For those who know what follows.
    fn as_any(&self) -> &dyn std::any::Any;
}

/// A machine somewhere in its history, with who follows it.
pub(super) struct Line {
    pub target: Box<dyn Target>,
    pub follow: Option<Box<dyn Follow>>,
    /// Deeds of the history that were done to it.
    pub done: usize,
    /// The follower was told of the instruction that is next.
    arrived: bool,
    /// Time passes here whatever can wake the chip, since it is known how far.
    pub insists: bool,
    /// A step has ended here, not a limit within one.
    pub settled: bool,
}

impl Line {
    pub fn new(target: Box<dyn Target>, follow: Option<Box<dyn Follow>>) -> Line {
        let mut line = Line { target, follow, done: 0, arrived: false, insists: false, settled: true };
        line.land();
        line
    }

    pub fn fork(&self) -> Line {
        Line {
            target: self.target.fork(),
            follow: self.follow.as_ref().map(|follow| follow.fork()),
            done: self.done,
            arrived: self.arrived,
            insists: self.insists,
            settled: self.settled,
        }
    }

    pub fn cycle(&self) -> u64 {
        self.target.cycle()
    }

    pub fn weight(&self) -> usize {
        self.target.weight() + self.follow.as_ref().map_or(0, |follow| follow.weight()) + size_of::<Line>()
    }

    /// Stops at these program words from now on.
    pub fn set_traps(&mut self, words: &BTreeSet<u32>) {
        match &self.follow {
            Some(follow) if !follow.stops().is_empty() => {
                let all = words.iter().chain(follow.stops()).copied().collect();
                self.target.set_traps(&all);
            }
            _ => self.target.set_traps(words),
        }
    }

    /// Runs to the cycle `until`. Traps of the follower are its own business: it is told, and the run goes on, unless the word is one
    /// of `words` too.
    pub fn run(&mut self, deeds: &[Deed], until: u64, words: &BTreeSet<u32>, look: Look, seer: &mut dyn Seer) -> Stop {
        loop {
            self.do_due(deeds, look, seer);
            let next = self.due(deeds);
            let (goal, before) = (until.min(next), self.cycle());
            if before >= goal {
                return Stop::Limit;
            }
            // What is still to be done wakes it.
            self.target.insist(self.insists || next != u64::MAX);
            let stop = self.target.run(goal, look, seer);
            if self.cycle() > before {
                self.arrived = false;
            }
            // Time that has passed here may be a part of what the next step passes.
            self.settled &= self.cycle() == before;
            if let Stop::Trap { pc } = stop {
                self.arrive(pc)
            } else {
                self.land()
            }
            if self.cycle() >= next {
                // Whatever has stopped it, the machine is another now.
                self.do_due(deeds, look, seer);
                if self.cycle() >= until {
                    return Stop::Limit;
                }
                continue;
            }
            match stop {
                Stop::Limit if self.cycle() < until => {}
                Stop::Trap { pc } if !words.contains(&pc) => {}
                _ => return stop,
            }
        }
    }

    /// Runs to the end of the next step: an instruction, or the entry of an interrupt, and the sleep before it. `limit`: a cycle at
    /// which sleep is left in any case. Breakpoints are passed.
    pub fn step(&mut self, deeds: &[Deed], limit: u64, look: Look, seer: &mut dyn Seer) -> Stop {
        self.do_due(deeds, look, seer);
        let (start, pc, counted) = (self.cycle(), self.target.pc(), self.target.instructions());
        let mut trapped = false;
        loop {
            let before = self.cycle();
            let next = self.due(deeds);
            // Sleep does not go beyond what wakes it in this history.
            self.target.insist(self.insists || next != u64::MAX);
            let stop = self.target.step_until(next.min(limit), look, seer);
            match stop {
                Stop::Trap { pc } if !trapped => {
                    trapped = true;
                    self.arrive(pc);
                    continue;
                }
                Stop::Limit | Stop::Probe => {}
                Stop::Halted if self.cycle() > before && self.target.instructions() > counted => {}
                stop => {
                    self.settled &= self.cycle() == start;
                    return stop;
                }
            }
            if self.cycle() > before {
                self.arrived = false;
            }
            self.do_due(deeds, look, seer);
            let moved = self.target.pc() != pc || self.target.instructions() != counted;
            // Where nothing is ever due it sleeps cycle by cycle, and somebody is asked in between.
            let endless = next.min(limit) >= END_OF_TIME && self.cycle() == before + 1;
            if moved || self.cycle() >= limit || stop == Stop::Probe || endless {
                self.settled = moved;
                self.land();
                return if moved { Stop::Limit } else { stop };
            }
        }
    }

    /// One step of the machine, which ends before it where a trap is come to; of those the ones in `words` are told. `limit`: a cycle at
    /// which sleep is left in any case.
    pub fn step_to_trap(
        &mut self,
        deeds: &[Deed],
        words: &BTreeSet<u32>,
        limit: u64,
        look: Look,
        seer: &mut dyn Seer,
    ) -> Stop {
        let before = self.cycle();
        let stop = self.target.step_until(limit.min(self.due(deeds)), look, seer);
        if self.cycle() > before {
            (self.arrived, self.settled) = (false, false);
        }
        self.do_due(deeds, look, seer);
        match stop {
            Stop::Trap { pc } => {
                self.arrive(pc);
                if words.contains(&pc) { stop } else { Stop::Limit }
            }
            stop => stop,
        }
    }

    /// The machine stands before the instruction at `pc`, one at which it was stopped.
    fn arrive(&mut self, pc: u32) {
        if let Some(follow) = self.follow.as_mut().filter(|f| !self.arrived && f.stops().contains(&pc)) {
            self.arrived = true;
            follow.at(&*self.target, pc);
        }
    }

    /// A step has ended: the follower is told at once, if it is one of its words and no interrupt comes first.
    fn land(&mut self) {
        let pc = self.target.pc();
        if self.follow.as_ref().is_some_and(|follow| follow.stops().contains(&pc)) {
            self.look_ahead();
        }
    }

    /// Tells the follower if one of its words is next, and now.
    fn look_ahead(&mut self) {
        let Some(follow) = self.follow.as_ref().filter(|_| !self.arrived) else { return };
        let mut copy = self.target.fork();
        copy.set_traps(&follow.stops().iter().copied().collect());
        // A run of a controller at rest ends before it looks at traps; a step does not.
        if let Stop::Trap { pc } = copy.step(Look::Nothing, &mut ())
            && copy.cycle() == self.cycle()
        {
            self.arrive(pc);
        }
    }

    /// The cycle of what is done from outside next: a run that ends there shows what that has changed.
    pub fn due(&self, deeds: &[Deed]) -> u64 {
        deeds.get(self.done).map_or(u64::MAX, |deed| deed.cycle)
    }

    /// Does what was done from outside up to now.
    pub fn do_due(&mut self, deeds: &[Deed], look: Look, seer: &mut dyn Seer) {
        while let Some(deed) = deeds.get(self.done).filter(|deed| deed.cycle <= self.cycle()) {
            // What failed has failed when it was done first, and was not noted.
            _ = self.apply(&deed.action, look, seer);
            self.done += 1;
        }
    }

    /// Does something from outside, and lets the chip see it: no time passes.
    pub fn apply(&mut self, action: &Action, look: Look, seer: &mut dyn Seer) -> Result<(), String> {
        // However the machine came here, who follows is told of this word before. A controller comes round only when it is looked at.
        self.look_ahead();
        let pc = self.target.pc();
        action.apply(&mut *self.target)?;
        self.target.run(self.cycle(), look, seer);
        if matches!(action, Action::Reset(_)) || self.target.pc() != pc {
            self.arrived = false;
        }
        if let (Action::Reset(Reset::PowerOn), Some(follow)) = (action, &mut self.follow) {
            follow.reset();
        }
        self.land();
        Ok(())
    }
}
