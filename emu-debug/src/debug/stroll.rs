//! Running step by step, until somebody has seen enough; and whether that can be at all.

use std::collections::BTreeSet;
use std::time::Instant;

use emu_core::cpu::{END_OF_TIME, Stop};

use super::eyes::Eyes;
use super::flow::Flow;
use super::points::What;
use super::session::{GoOn, Halt, SHORT, STRETCH, Session, Why, ended};
use super::target::Look;

impl Session {
    /// Steps until `test` says so: it is given the machine, what the instruction did to the stack of calls, and whether it was the
    /// entry of an interrupt instead. `breaks`: breakpoints stop it too.
    pub fn stroll(
        &mut self,
        limit: u64,
        breaks: bool,
        go_on: GoOn<'_>,
        test: &mut dyn FnMut(&Session, Flow, bool) -> bool,
    ) -> Halt {
        self.walk((limit, breaks, limit == END_OF_TIME), go_on, test)
    }

    /// `searches`: nobody knows how many steps it takes, so it is looked whether they have an end.
    pub(super) fn walk(
        &mut self,
        (limit, breaks, searches): (u64, bool, bool),
        go_on: GoOn<'_>,
        test: &mut dyn FnMut(&Session, Flow, bool) -> bool,
    ) -> Halt {
        self.line.set_traps(&BTreeSet::new());
        let mut eyes = Eyes::new(&self.points, &*self.line.target);
        self.line.insists = limit < END_OF_TIME;
        let (mut since, mut slept, mut steps) = (Instant::now(), 0u64, 0u64);
        let mut stuck: Option<(u64, Why)> = None;
        loop {
            if self.line.cycle() >= limit {
                return Halt { why: Why::Limit };
            }
            let flow = self.flow(self.line.target.pc()).0;
            let entered = eyes.entered;
            eyes.events = Some(std::mem::take(&mut self.events));
            let look = eyes.look().max(Look::Events);
            let stop = self.line.step(&self.history.deeds, limit, look, &mut eyes);
            self.events = eyes.events.take().unwrap_or_default();
            let sights = std::mem::take(&mut eyes.seen);
            let changes = eyes.changed(&*self.line.target);
            let irq = eyes.entered > entered;
            self.forget_events();
            if since.elapsed() > STRETCH.start {
                self.keep(since.elapsed(), 0);
                since = Instant::now();
            }
            let pc = self.line.target.pc();
            let trap = if breaks { Stop::Trap { pc } } else { Stop::Limit };
            let hits = self.hits(&sights, &changes, if stop == Stop::Limit { trap } else { stop });
            let done = stop == Stop::Limit && self.line.settled && test(self, flow, irq);
            if !hits.is_empty() {
                return Halt { why: Why::Points(hits) };
            }
            match stop {
                _ if done => return Halt { why: Why::Done },
                Stop::Limit | Stop::Trap { .. } | Stop::Probe => {}
                stop => return Halt { why: ended(stop) },
            }
            // Asked more and more seldom, as it may be long until it wakes.
            slept = if self.line.settled { 0 } else { slept + 1 };
            if slept.is_power_of_two() && limit == END_OF_TIME && self.waits() {
                return Halt { why: Why::Waits };
            }
            steps += u64::from(searches);
            if steps >= SHORT && steps.is_power_of_two() && stuck.is_none() {
                stuck = self.stuck().map(|why| (self.line.cycle() + 2 * SHORT, why));
            }
            if let Some((_, why)) = stuck.take_if(|stuck| self.line.cycle() > stuck.0) {
                return Halt { why };
            }
            if !go_on() {
                return Halt { why: Why::Interrupted };
            }
        }
    }

    /// Only something from outside can change what the program does ([`Target::waits_for_ever`]), none is to come, and no point looks at the time.
    pub(super) fn waits(&self) -> bool {
        let timed = |what: &What| matches!(what, What::Change(expr) if expr.is_of_time());
        self.line.due(&self.history.deeds) == u64::MAX
            && !self.points.enabled().any(|point| timed(&point.what))
            && self.line.target.waits_for_ever()
    }

    /// What ends a search for good, as far as it can be told: within [`SHORT`] cycles the program goes round where nothing leads out.
    fn stuck(&self) -> Option<Why> {
        if self.line.due(&self.history.deeds) != u64::MAX {
            return None;
        }
        if self.waits() {
            return Some(Why::Waits);
        }
        let mut copy = self.line.target.fork();
        copy.insist(false);
        (copy.run(copy.cycle() + SHORT, Look::Nothing, &mut ()) == Stop::Halted).then_some(Why::Halted)
    }
}
