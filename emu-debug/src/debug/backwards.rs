//! Backwards: from the nearest copy before the wanted position, forwards again.

use std::collections::BTreeSet;
use std::time::Instant;

use emu_core::cpu::{LAST_CYCLE, StopReason};

use super::breakpoint_probe::{BreakpointProbe, candidate_hits};
use super::call_flow::CallFlow;
use super::dyn_machine::{DynMachine, ObserveLevel};
use super::expression_place::ExpressionPlace;
use super::followed_machine::FollowedMachine;
use super::history::LeftPosition;
use super::points::{DebugPoints, PointTrigger, breakpoint_words};
use super::session::{DebugSession, HOST_TIME_BETWEEN_COPIES, HaltReason, HaltResult, KeepRunning, PointHit};

/// Machine cycles that an instruction takes at most, in most cases.
const TYPICAL_CYCLES: u64 = 8;

/// Steps that are made before somebody is asked whether to go on.
const STEPS_BETWEEN_CHECKS: u64 = 1 << 16;

/// Steps back of which each position is noted, and cycles that a search looks at first.
const NEAR_STEPS: u64 = 1 << 12;

/// A position that a search backwards comes by. In the stretches between two copies it goes forwards.
pub struct PassedPosition<'a> {
    /// The machine.
    pub target: &'a dyn DynMachine,
    /// The first position of a stretch: what went before is unknown, and the answer does not count.
    pub first: bool,
    /// What the instruction that led here did to the stack of calls.
    pub flow: CallFlow,
    /// Program word of that instruction.
    pub from_word: u32,
}

impl DebugSession {
    /// Goes `n` steps back, or to the beginning of the history. From within a step the first leads to where that begins; as many
    /// steps forward right afterwards end there again.
    /// Far back it goes a stretch between two copies at a time, and asks `go_on` in between; interrupted it stays.
    pub fn step_back(&mut self, n: u64, go_on: KeepRunning<'_>) -> HaltResult {
        let now = self.current.cycle();
        let left = self.left_position.filter(|left| left.returned_to == now).map(|left| left.cycle);
        let at = if self.current.at_step_end { left } else { Some(now) };
        let halt = if n > NEAR_STEPS { self.step_back_far(n, go_on) } else { self.step_back_counted(n) };
        if halt.reason == HaltReason::Interrupted {
            return halt;
        }
        self.left_position = at.map(|at| LeftPosition { cycle: at, returned_to: self.current.cycle() });
        halt
    }

    /// Goes `n` steps back, and forgets from where.
    fn step_back_counted(&mut self, n: u64) -> HaltResult {
        let now = self.current.cycle();
        let wanted = usize::try_from(n).unwrap_or(usize::MAX);
        let mut reach = n.saturating_mul(TYPICAL_CYCLES).max(TYPICAL_CYCLES);
        loop {
            let from = now.saturating_sub(reach).max(self.history.first_cycle());
            let Some(mut line) = self.replayed(from) else { return HaltResult { reason: HaltReason::Beginning } };
            let begins = line.cycle() <= self.history.first_cycle();
            let base = line.fork();
            // Where a run was stopped by its limit may be in the middle of a sleep; where a step ends is a position.
            let mut found: Vec<u64> = if begins { vec![line.cycle()] } else { Vec::new() };
            self.visit_positions(&mut line, now, &mut |line| found.push(line.cycle()));
            found.retain(|cycle| *cycle < now);
            if found.len() >= wanted || begins {
                let enough = found.len() >= wanted;
                let to = found.get(found.len().saturating_sub(wanted)).copied();
                let Some(to) = to else { return HaltResult { reason: HaltReason::Beginning } };
                self.current = base;
                self.step_to(to);
                return HaltResult { reason: if enough { HaltReason::Done } else { HaltReason::Beginning } };
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// As [`DebugSession::step_back_counted`], for many: positions are counted, not noted.
    fn step_back_far(&mut self, n: u64, go_on: KeepRunning<'_>) -> HaltResult {
        let (now, first) = (self.current.cycle(), self.history.first_cycle());
        let starts: Vec<u64> = self.history.copies_before(now).map(FollowedMachine::cycle).collect();
        let (mut end, mut rest) = (now, n);
        for start in starts {
            let Some(base) = self.replayed(start) else { break };
            let begins = base.cycle() <= first;
            let mut positions = u64::from(begins && base.cycle() < now);
            self.visit_positions(&mut base.fork(), end, &mut |line| positions += u64::from(line.cycle() < now));
            if positions >= rest {
                // So many positions of this stretch are passed over.
                let (mut before, mut found) = (positions - rest, None);
                let mut tell = |line: &FollowedMachine| {
                    if before == 0 {
                        found.get_or_insert(line.cycle());
                    }
                    before = before.saturating_sub(1);
                };
                if begins {
                    tell(&base);
                }
                self.visit_positions(&mut base.fork(), end, &mut tell);
                self.current = base;
                self.step_to(found.unwrap_or(start));
                return HaltResult { reason: HaltReason::Done };
            }
            rest -= positions;
            end = start;
            if !go_on() {
                return HaltResult { reason: HaltReason::Interrupted };
            }
        }
        if let Some(line) = self.replayed(first) {
            self.arrive(line);
        }
        HaltResult { reason: HaltReason::Beginning }
    }

    /// Goes to a cycle, in the past or in the future, or where an instruction spans it to the position before that; points are passed
    /// over.
    pub fn goto_cycle(&mut self, cycle: u64, go_on: KeepRunning<'_>) -> HaltResult {
        let (cycle, first) = (cycle.min(LAST_CYCLE), self.history.first_cycle());
        if cycle >= self.current.cycle() {
            let points = std::mem::take(&mut self.points);
            let goal = super::RunGoal { until: Some(cycle), runs_while_halted: true, ..super::RunGoal::default() };
            let halt = self.run(&goal, go_on);
            self.points = points;
            if halt.reason != HaltReason::Limit {
                return halt;
            }
        } else if let Some(line) = self.replayed(cycle.max(first)) {
            self.arrive(line);
        }
        // It has overshot: then it goes to where the step before that ended. In sleep it stays at the cycle.
        if self.current.cycle() > first.max(cycle) {
            let now = self.current.cycle();
            self.step_back_counted(1);
            self.step_to(cycle.min(now));
        }
        HaltResult { reason: if cycle < first { HaltReason::Beginning } else { HaltReason::Done } }
    }

    /// Goes back to the last position at which a run forwards would have been stopped by a point. Counts to be ignored do not
    /// matter, conditions do.
    pub fn run_back(&mut self, go_on: KeepRunning<'_>) -> HaltResult {
        let points = self.points.clone();
        match self.last_hit(&points, false, go_on) {
            Err(why) => HaltResult { reason: why },
            Ok(Some((line, hits))) => {
                self.arrive(line);
                self.points.note_stops(hits.iter().map(|hit| hit.id));
                HaltResult { reason: HaltReason::Points(hits) }
            }
            Ok(None) => {
                if let Some(line) = self.replayed(self.history.first_cycle()) {
                    self.arrive(line);
                }
                HaltResult { reason: HaltReason::Beginning }
            }
        }
    }

    /// The last time up to now that one of `wanted` was accessed or changed, the instruction that ended here counted: the cycle behind that instruction, and what was seen.
    /// The machine stays where it is.
    ///
    /// # Errors
    /// [`HaltReason::Interrupted`] where `go_on` said so.
    pub fn last_access(
        &mut self,
        wanted: PointTrigger,
        go_on: KeepRunning<'_>,
    ) -> Result<Option<(u64, PointHit)>, HaltReason> {
        let mut points = DebugPoints::default();
        points.add(wanted, "", false);
        let found = self.last_hit(&points, true, go_on)?;
        Ok(found.and_then(|(line, hits)| Some((line.cycle(), *hits.first()?))))
    }

    /// What a place was at a cycle, behind what was done from outside then. The machine stays where it is.
    #[must_use]
    pub fn value_at(&self, place: ExpressionPlace, cycle: u64) -> Option<i64> {
        place.value(&*self.replayed(cycle)?.machine)
    }

    /// The program word of the step that ends at a cycle. The machine stays where it is.
    #[must_use]
    pub fn step_ending_at(&self, cycle: u64) -> Option<u32> {
        let mut reach = TYPICAL_CYCLES;
        loop {
            let from = cycle.saturating_sub(reach).max(self.history.first_cycle());
            let mut line = self.replayed(from)?;
            let mut pc = None;
            while line.cycle() < cycle {
                pc = Some(line.machine.pc());
                if line.step(&self.history.input_events, cycle, ObserveLevel::Nothing, &mut ()) != StopReason::Limit {
                    break;
                }
            }
            if pc.is_some() || from <= self.history.first_cycle() {
                return pc;
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// Goes back to the last position before this one at which `test` holds. A stretch is what lies between two copies, or less: near
    /// ones are looked at before those behind them. `ended` is asked behind each; with false the search is over, and the machine stays.
    pub fn run_back_until(
        &mut self,
        go_on: KeepRunning<'_>,
        ended: &mut dyn FnMut() -> bool,
        test: &mut dyn FnMut(&PassedPosition<'_>) -> bool,
    ) -> HaltResult {
        let now = self.current.cycle();
        let (mut end, mut reach) = (now, NEAR_STEPS);
        loop {
            let copy = self.history.copies_before(end).next().map(FollowedMachine::cycle);
            let Some(copy) = copy else { break };
            let Some(base) = self.replayed(end.saturating_sub(reach).max(copy)) else { break };
            reach = reach.saturating_mul(8);
            if base.cycle() >= end {
                continue;
            }
            let mut line = base.fork();
            let mut found = None;
            let first = PassedPosition {
                target: &*line.machine,
                first: true,
                flow: CallFlow::Plain,
                from_word: line.machine.pc(),
            };
            test(&first);
            line.set_breakpoints(&BTreeSet::new());
            let mut steps = 0u64;
            while line.cycle() < end {
                let from = line.machine.pc();
                let flow = self.call_flow_on(&line, from);
                let stop = line.step(&self.history.input_events, end, ObserveLevel::Nothing, &mut ());
                let passed = PassedPosition { target: &*line.machine, first: false, flow, from_word: from };
                if line.at_step_end && test(&passed) && line.cycle() < now {
                    found = Some(line.cycle());
                }
                if stop != StopReason::Limit {
                    break;
                }
                steps += 1;
                if steps.is_multiple_of(STEPS_BETWEEN_CHECKS) && !go_on() {
                    return HaltResult { reason: HaltReason::Interrupted };
                }
            }
            if let Some(cycle) = found {
                self.current = base;
                self.step_to(cycle);
                return HaltResult { reason: HaltReason::Done };
            }
            if !(ended() && go_on()) {
                return HaltResult { reason: HaltReason::Interrupted };
            }
            end = base.cycle();
        }
        if let Some(line) = self.replayed(self.history.first_cycle()) {
            self.arrive(line);
        }
        HaltResult { reason: HaltReason::Beginning }
    }

    fn call_flow_on(&self, line: &FollowedMachine, pc: u32) -> CallFlow {
        let chip = self.scope.chip();
        super::call_flow(chip, |word| super::session::word(&*line.machine, word), pc).0
    }

    /// The last position before this one at which points would have stopped a run. The past is run through once, its newest stretches
    /// first, and more of them at a time the further it goes back: setting breakpoints in a copy costs as much as a stretch.
    fn last_hit(
        &mut self,
        points: &DebugPoints,
        here_too: bool,
        go_on: KeepRunning<'_>,
    ) -> Result<Option<(FollowedMachine, Vec<PointHit>)>, HaltReason> {
        let now = self.current.cycle();
        let mut end = now;
        let starts: Vec<u64> = self.history.copies_before(now).map(FollowedMachine::cycle).collect();
        let mut left = starts.as_slice();
        let mut count = 1;
        while !left.is_empty() {
            let (stretches, older) = left.split_at(count.min(left.len()));
            // A copy that stands at a breakpoint does not see it; the stretch before comes to it.
            let reach = if end < now { end + 1 } else { end };
            let mut bounds: Vec<u64> = stretches.iter().rev().copied().chain([reach]).collect();
            // Once to find the cycle of the last, once to stop there.
            let mut last: Option<(u64, u64)> = None;
            self.hits_between(&bounds, points, go_on, &mut |line, _| {
                let at = line.cycle();
                if at <= end && (at < now || here_too && at == now) {
                    last = Some((at, last.filter(|last| last.0 == at).map_or(1, |last| last.1 + 1)));
                }
                true
            })?;
            if let Some((at, nth)) = last {
                let behind = bounds.partition_point(|bound| *bound < at).saturating_sub(1);
                for from in [behind, 0] {
                    let (mut seen, mut hit) = (0, Vec::new());
                    let line = self.hits_between(&bounds[from..], points, go_on, &mut |line, hits| {
                        seen += u64::from(line.cycle() == at);
                        hit = hits;
                        seen < nth && line.cycle() <= at
                    })?;
                    if let Some(line) = line.filter(|_| seen == nth) {
                        return Ok(Some((line, hit)));
                    }
                }
            }
            end = bounds.swap_remove(0);
            left = older;
            count = count.saturating_mul(2);
        }
        Ok(None)
    }

    /// Runs from the first of these cycles to the last, and tells each time that points would have stopped the machine, until that is
    /// answered with false. All but the last are cycles of copies.
    fn hits_between(
        &self,
        bounds: &[u64],
        points: &DebugPoints,
        go_on: KeepRunning<'_>,
        tell: &mut dyn FnMut(&FollowedMachine, Vec<PointHit>) -> bool,
    ) -> Result<Option<FollowedMachine>, HaltReason> {
        let words: BTreeSet<u32> = breakpoint_words(points).collect();
        let Some(mut line) = bounds.first().and_then(|start| self.replayed(*start)) else { return Ok(None) };
        let mut eyes = BreakpointProbe::new(points, &*line.machine);
        let mut left_start = !words.contains(&line.machine.pc()) || line.machine.is_asleep();
        let mut slice = STEPS_BETWEEN_CHECKS;
        for &end in bounds.iter().skip(1) {
            while line.cycle() < end {
                let (deeds, start) = (&self.history.input_events, Instant::now());
                line.set_breakpoints(&words);
                let stop = if left_start {
                    let until = end.min(line.cycle().saturating_add(slice));
                    line.run(deeds, until.min(line.next_event_cycle(deeds)), &words, eyes.observe_level(), &mut eyes)
                } else {
                    left_start = true;
                    line.step(deeds, end, eyes.observe_level(), &mut eyes)
                };
                let sights = std::mem::take(&mut eyes.observations);
                let changes = eyes.take_changes(&*line.machine);
                let mut hits = candidate_hits(points, &*line.machine, &sights, &changes, stop);
                hits.retain(|hit| points.get(hit.id).is_some_and(|point| point.condition_holds(&*line.machine)));
                if !hits.is_empty() && !tell(&line, hits) {
                    return Ok(Some(line));
                }
                if !matches!(stop, StopReason::Limit | StopReason::Breakpoint { .. } | StopReason::Probe) {
                    break;
                }
                // What was jumped over when the machine ran first may be long when it is looked at.
                slice = match start.elapsed() < HOST_TIME_BETWEEN_COPIES.end {
                    true if stop == StopReason::Limit => slice.saturating_mul(2),
                    true => slice,
                    false => STEPS_BETWEEN_CHECKS,
                };
                if !go_on() {
                    return Err(HaltReason::Interrupted);
                }
            }
            if !go_on() {
                return Err(HaltReason::Interrupted);
            }
            // What could not be carried out ended the run there, too, until something was done from outside.
            if line.cycle() < end && bounds.last() != Some(&end) {
                let Some(next) = self.replayed(end) else { return Ok(None) };
                line = next;
                eyes = BreakpointProbe::new(points, &*line.machine);
                left_start = !words.contains(&line.machine.pc()) || line.machine.is_asleep();
            }
        }
        Ok(Some(line))
    }

    /// A copy of the machine as it was at a cycle, or at the first boundary behind it.
    fn replayed(&self, cycle: u64) -> Option<FollowedMachine> {
        let mut line = self.history.copy_at(cycle)?.fork();
        let none = BTreeSet::new();
        line.set_breakpoints(&none);
        line.runs_while_halted = true;
        if line.cycle() < cycle {
            line.run(&self.history.input_events, cycle, &none, ObserveLevel::Nothing, &mut ());
        }
        line.apply_due_events(&self.history.input_events, ObserveLevel::Nothing, &mut ());
        Some(line)
    }

    /// Steps a copy up to a cycle, and tells of each position behind its first.
    fn visit_positions(&self, line: &mut FollowedMachine, end: u64, tell: &mut dyn FnMut(&FollowedMachine)) {
        line.set_breakpoints(&BTreeSet::new());
        while line.cycle() < end {
            let stop = line.step(&self.history.input_events, end, ObserveLevel::Nothing, &mut ());
            if line.at_step_end {
                tell(line);
            }
            if stop != StopReason::Limit {
                return;
            }
        }
    }

    /// Steps the machine itself on as long as it comes to no later cycle.
    fn step_to(&mut self, cycle: u64) {
        self.current.set_breakpoints(&BTreeSet::new());
        let mut scout = self.current.fork();
        let mut steps = 0u64;
        while scout.cycle() < cycle {
            let stop = scout.step(&self.history.input_events, cycle, ObserveLevel::Nothing, &mut ());
            if scout.cycle() > cycle || !scout.at_step_end && scout.cycle() >= cycle || stop != StopReason::Limit {
                break;
            }
            steps += 1;
        }
        for _ in 0..steps {
            self.current.step(&self.history.input_events, cycle, ObserveLevel::Nothing, &mut ());
        }
        self.left_position = None;
        self.forget_events();
    }

    fn arrive(&mut self, line: FollowedMachine) {
        self.current = line;
        self.left_position = None;
        self.forget_events();
    }
}
