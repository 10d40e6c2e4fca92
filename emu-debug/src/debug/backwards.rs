//! Running backwards: take the nearest copy before the wanted position, and run it forwards again.

use std::collections::BTreeSet;
use std::time::Instant;

use emu_core::cpu::{LAST_CYCLE, StopReason};

use super::call_flow::CallFlow;
use super::dyn_machine::{DynMachine, ObserveLevel};
use super::expression_place::ExpressionPlace;
use super::history::MidStepPosition;
use super::machine_with_follower::MachineWithFollower;
use super::points::{DebugPoints, PointTrigger, breakpoint_words};
use super::session::{DebugSession, HOST_TIME_BETWEEN_COPIES, KeepRunning};
use super::session_stop::{PointHit, SessionStopReason};
use super::watchpoint_probe::{WatchpointProbe, candidate_hits};

/// Maximum duration of most instructions in machine cycles.
const TYPICAL_CYCLES: u64 = 8;

/// Number of steps between two calls of `keep_running`.
const STEPS_BETWEEN_CHECKS: u64 = 1 << 16;

/// Number of steps back up to which every position is recorded, and of cycles that a search examines first.
const NEAR_STEPS: u64 = 1 << 12;

/// A position that a search backwards visits. The positions between two copies are visited forwards.
pub struct PassedPosition<'a> {
    /// The machine.
    pub machine: &'a dyn DynMachine,
    /// The first position of a stretch: what preceded it is unknown, and the result of the test does not
    /// count.
    pub first: bool,
    /// What the instruction that led here did to the call stack.
    pub flow: CallFlow,
    /// Program word of that instruction.
    pub from_word: u32,
}

/// The last time at which something was accessed or changed.
#[derive(Debug, Clone, Copy)]
pub struct EarlierHit {
    /// The cycle after the instruction.
    pub cycle: u64,
    /// What was accessed.
    pub hit: PointHit,
}

/// The last earlier position at which points would have stopped a run.
struct EarlierStop {
    /// A copy of the machine at this position.
    replay: MachineWithFollower,
    /// The points that were hit there.
    hits: Vec<PointHit>,
}

impl DebugSession {
    /// Goes `n` steps back, or to the beginning of the history. From within a step, the first step back leads
    /// to the start of that step; the same number of steps forward right afterwards returns to the original
    /// position. Far back, it goes one stretch between two copies at a time and calls `keep_running` in
    /// between; if interrupted, it does not move.
    pub fn step_back(&mut self, n: u64, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let now = self.current.cycle();
        let left = self.mid_step_position.filter(|left| left.returned_to == now).map(|left| left.cycle);
        let at = if self.current.at_step_end { left } else { Some(now) };
        let halt = if n > NEAR_STEPS { self.step_back_far(n, keep_running) } else { self.step_back_counted(n) };
        if halt == SessionStopReason::Interrupted {
            return halt;
        }
        self.mid_step_position = at.map(|at| MidStepPosition { cycle: at, returned_to: self.current.cycle() });
        halt
    }

    /// Goes `n` steps back, and forgets the original position.
    fn step_back_counted(&mut self, n: u64) -> SessionStopReason {
        let now = self.current.cycle();
        let wanted = usize::try_from(n).unwrap_or(usize::MAX);
        let mut reach = n.saturating_mul(TYPICAL_CYCLES).max(TYPICAL_CYCLES);
        loop {
            let from = now.saturating_sub(reach).max(self.history.first_cycle());
            let Some(mut replay) = self.replayed(from) else { return SessionStopReason::Beginning };
            let begins = replay.cycle() <= self.history.first_cycle();
            let base = replay.fork();
            // A run that was stopped by its limit may be in the middle of a sleep; only the end of a step is
            // a position.
            let mut found: Vec<u64> = if begins { vec![replay.cycle()] } else { Vec::new() };
            self.visit_positions(&mut replay, now, &mut |replay| found.push(replay.cycle()));
            found.retain(|cycle| *cycle < now);
            if found.len() >= wanted || begins {
                let enough = found.len() >= wanted;
                let to = found.get(found.len().saturating_sub(wanted)).copied();
                let Some(to) = to else { return SessionStopReason::Beginning };
                self.current = base;
                self.step_to(to);
                return if enough { SessionStopReason::Done } else { SessionStopReason::Beginning };
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// Steps back many instructions, as [`DebugSession::step_back_counted`] does for few: it counts positions
    /// instead of recording them.
    fn step_back_far(&mut self, n: u64, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let (now, first) = (self.current.cycle(), self.history.first_cycle());
        let starts: Vec<u64> = self.history.copies_before(now).map(MachineWithFollower::cycle).collect();
        let (mut end, mut rest) = (now, n);
        for start in starts {
            let Some(base) = self.replayed(start) else { break };
            let begins = base.cycle() <= first;
            let mut positions = u64::from(begins && base.cycle() < now);
            self.visit_positions(&mut base.fork(), end, &mut |replay| positions += u64::from(replay.cycle() < now));
            if positions >= rest {
                // Number of positions of this stretch to skip.
                let (mut before, mut found) = (positions - rest, None);
                let mut visit = |replay: &MachineWithFollower| {
                    if before == 0 {
                        found.get_or_insert(replay.cycle());
                    }
                    before = before.saturating_sub(1);
                };
                if begins {
                    visit(&base);
                }
                self.visit_positions(&mut base.fork(), end, &mut visit);
                self.current = base;
                self.step_to(found.unwrap_or(start));
                return SessionStopReason::Done;
            }
            rest -= positions;
            end = start;
            if !keep_running() {
                return SessionStopReason::Interrupted;
            }
        }
        if let Some(replay) = self.replayed(first) {
            self.move_to(replay);
        }
        SessionStopReason::Beginning
    }

    /// Goes to a cycle, in the past or in the future, and ignores points. If an instruction spans the cycle,
    /// goes to the position before it.
    pub fn goto_cycle(&mut self, cycle: u64, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let (cycle, first) = (cycle.min(LAST_CYCLE), self.history.first_cycle());
        if cycle >= self.current.cycle() {
            let points = std::mem::take(&mut self.points);
            let goal = super::RunGoal { until: Some(cycle), runs_while_halted: true, ..super::RunGoal::default() };
            let halt = self.run(&goal, keep_running);
            self.points = points;
            if halt != SessionStopReason::Limit {
                return halt;
            }
        } else if let Some(replay) = self.replayed(cycle.max(first)) {
            self.move_to(replay);
        }
        // It went past the cycle: return to the end of the previous step. In sleep, stay at the cycle.
        if self.current.cycle() > first.max(cycle) {
            let now = self.current.cycle();
            self.step_back_counted(1);
            self.step_to(cycle.min(now));
        }
        if cycle < first { SessionStopReason::Beginning } else { SessionStopReason::Done }
    }

    /// Goes back to the last position at which a point would have stopped a forward run. Ignore counts have
    /// no effect, conditions do.
    pub fn run_back(&mut self, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let points = self.points.clone();
        match self.last_hit(&points, false, keep_running) {
            Err(why) => why,
            Ok(Some(EarlierStop { replay, hits })) => {
                self.move_to(replay);
                self.points.note_stops(hits.iter().map(|hit| hit.id));
                SessionStopReason::Points(hits)
            }
            Ok(None) => {
                if let Some(replay) = self.replayed(self.history.first_cycle()) {
                    self.move_to(replay);
                }
                SessionStopReason::Beginning
            }
        }
    }

    /// Goes forward to the last position before the cycle `end` at which a breakpoint would have stopped a
    /// run; reverse-next may have gone past it within a call. Returns `None`, without a move, if there is
    /// none.
    pub fn forward_to_passed_breakpoint(
        &mut self,
        end: u64,
        keep_running: KeepRunning<'_>,
    ) -> Option<SessionStopReason> {
        let start = self.current.cycle();
        let mut points = self.points.clone();
        let others = points.all().iter().filter(|point| !matches!(point.trigger, PointTrigger::Code(_)));
        let others: Vec<u32> = others.map(|point| point.id).collect();
        others.into_iter().for_each(|id| _ = points.remove(id));
        points.enabled().next()?;
        let mut last = None;
        let searched = self.hits_between(&[start, end], &points, keep_running, &mut |replay, hits| {
            if (start + 1..end).contains(&replay.cycle()) {
                last = Some((replay.fork(), hits));
            }
            true
        });
        if let Err(why) = searched {
            return Some(why);
        }
        let (replay, hits) = last?;
        self.move_to(replay);
        self.points.note_stops(hits.iter().map(|hit| hit.id));
        Some(SessionStopReason::Points(hits))
    }

    /// Finds the last time up to now at which `wanted` was accessed or changed, including the instruction
    /// that ended here: the cycle after that instruction, and the hit. The machine does not move.
    ///
    /// # Errors
    /// [`SessionStopReason::Interrupted`] if `keep_running` returned false.
    pub fn last_access(
        &mut self,
        wanted: PointTrigger,
        keep_running: KeepRunning<'_>,
    ) -> Result<Option<EarlierHit>, SessionStopReason> {
        let mut points = DebugPoints::default();
        points.add(wanted, "", false);
        let found = self.last_hit(&points, true, keep_running)?;
        Ok(found
            .and_then(|EarlierStop { replay, hits }| Some(EarlierHit { cycle: replay.cycle(), hit: *hits.first()? })))
    }

    /// Returns the value of a place at a cycle, after the user's actions at that cycle. The machine does not
    /// move.
    #[must_use]
    pub fn value_at(&self, place: ExpressionPlace, cycle: u64) -> Option<i64> {
        place.value(&*self.replayed(cycle)?.machine)
    }

    /// Returns the program word of the step that ends at a cycle. The machine does not move.
    #[must_use]
    pub fn step_ending_at(&self, cycle: u64) -> Option<u32> {
        let mut reach = TYPICAL_CYCLES;
        loop {
            let from = cycle.saturating_sub(reach).max(self.history.first_cycle());
            let mut replay = self.replayed(from)?;
            let mut pc = None;
            while replay.cycle() < cycle {
                pc = Some(replay.machine.pc());
                if replay.step(&self.history.input_events, cycle, ObserveLevel::Nothing, &mut ()) != StopReason::Limit {
                    break;
                }
            }
            if pc.is_some() || from <= self.history.first_cycle() {
                return pc;
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// Goes back to the last earlier position at which `test` holds. A stretch is the range between two
    /// copies, or less; recent stretches are searched first. `ended` is called after each; if it returns
    /// false, the search is over and the machine does not move.
    pub fn run_back_until(
        &mut self,
        keep_running: KeepRunning<'_>,
        ended: &mut dyn FnMut() -> bool,
        test: &mut dyn FnMut(&PassedPosition<'_>) -> bool,
    ) -> SessionStopReason {
        let now = self.current.cycle();
        let (mut end, mut reach) = (now, NEAR_STEPS);
        loop {
            let copy = self.history.copies_before(end).next().map(MachineWithFollower::cycle);
            let Some(copy) = copy else { break };
            let Some(base) = self.replayed(end.saturating_sub(reach).max(copy)) else { break };
            reach = reach.saturating_mul(8);
            if base.cycle() >= end {
                continue;
            }
            let mut replay = base.fork();
            let mut found = None;
            let first = PassedPosition {
                machine: &*replay.machine,
                first: true,
                flow: CallFlow::Plain,
                from_word: replay.machine.pc(),
            };
            test(&first);
            replay.set_breakpoints(&BTreeSet::new());
            let mut steps = 0u64;
            while replay.cycle() < end {
                let from = replay.machine.pc();
                let flow = self.call_flow_on(&replay, from);
                let stop = replay.step(&self.history.input_events, end, ObserveLevel::Nothing, &mut ());
                let passed = PassedPosition { machine: &*replay.machine, first: false, flow, from_word: from };
                if replay.at_step_end && test(&passed) && replay.cycle() < now {
                    found = Some(replay.cycle());
                }
                if stop != StopReason::Limit {
                    break;
                }
                steps += 1;
                if steps.is_multiple_of(STEPS_BETWEEN_CHECKS) && !keep_running() {
                    return SessionStopReason::Interrupted;
                }
            }
            if let Some(cycle) = found {
                self.current = base;
                self.step_to(cycle);
                return SessionStopReason::Done;
            }
            if !(ended() && keep_running()) {
                return SessionStopReason::Interrupted;
            }
            end = base.cycle();
        }
        if let Some(replay) = self.replayed(self.history.first_cycle()) {
            self.move_to(replay);
        }
        SessionStopReason::Beginning
    }

    fn call_flow_on(&self, replay: &MachineWithFollower, pc: u32) -> CallFlow {
        let chip = self.scope.chip();
        super::call_flow(chip, |word| super::session::program_word_at(&*replay.machine, word), pc).flow
    }

    /// Returns the last earlier position at which breakpoints and watchpoints would have stopped a run, and
    /// their hits. It executes the past again, newest stretches first, from the copies of the history. Each
    /// round takes twice as many stretches as the one before, because setting breakpoints in a copy costs as
    /// much host time as a stretch. With `here_too`, the present position counts as well.
    fn last_hit(
        &mut self,
        points: &DebugPoints,
        here_too: bool,
        keep_running: KeepRunning<'_>,
    ) -> Result<Option<EarlierStop>, SessionStopReason> {
        let now = self.current.cycle();
        let mut end = now;
        let starts: Vec<u64> = self.history.copies_before(now).map(MachineWithFollower::cycle).collect();
        let mut left = starts.as_slice();
        let mut count = 1;
        while !left.is_empty() {
            let (stretches, older) = left.split_at(count.min(left.len()));
            // A replay that starts on a breakpoint does not report it; the previous stretch reaches it.
            let reach = if end < now { end + 1 } else { end };
            let mut bounds: Vec<u64> = stretches.iter().rev().copied().chain([reach]).collect();
            // The first pass finds the cycle of the last hit, the second stops there.
            // Its cycle, and how many hits are in that cycle up to it.
            let mut last: Option<(u64, u64)> = None;
            self.hits_between(&bounds, points, keep_running, &mut |replay, _| {
                let at = replay.cycle();
                if at <= end && (at < now || here_too && at == now) {
                    last = Some((at, last.filter(|last| last.0 == at).map_or(1, |last| last.1 + 1)));
                }
                true
            })?;
            if let Some((at, nth)) = last {
                let previous = bounds.partition_point(|bound| *bound < at).saturating_sub(1);
                for from in [previous, 0] {
                    let (mut seen, mut hit) = (0, Vec::new());
                    let replay = self.hits_between(&bounds[from..], points, keep_running, &mut |replay, hits| {
                        seen += u64::from(replay.cycle() == at);
                        hit = hits;
                        seen < nth && replay.cycle() <= at
                    })?;
                    if let Some(replay) = replay.filter(|_| seen == nth) {
                        return Ok(Some(EarlierStop { replay, hits: hit }));
                    }
                }
            }
            end = bounds.swap_remove(0);
            left = older;
            count = count.saturating_mul(2);
        }
        Ok(None)
    }

    /// Runs from the first of these cycles to the last, and calls `on_hit` each time points would have
    /// stopped the machine, until it returns false. All cycles but the last are those of copies.
    fn hits_between(
        &self,
        bounds: &[u64],
        points: &DebugPoints,
        keep_running: KeepRunning<'_>,
        on_hit: &mut dyn FnMut(&MachineWithFollower, Vec<PointHit>) -> bool,
    ) -> Result<Option<MachineWithFollower>, SessionStopReason> {
        let words: BTreeSet<u32> = breakpoint_words(points).collect();
        let Some(mut replay) = bounds.first().and_then(|start| self.replayed(*start)) else { return Ok(None) };
        let mut probe = WatchpointProbe::new(points, &*replay.machine);
        let mut left_start = !words.contains(&replay.machine.pc()) || replay.machine.is_asleep();
        let mut slice = STEPS_BETWEEN_CHECKS;
        for &end in bounds.iter().skip(1) {
            while replay.cycle() < end {
                let (input_events, start) = (&self.history.input_events, Instant::now());
                replay.set_breakpoints(&words);
                let stop = if left_start {
                    let until = end.min(replay.cycle().saturating_add(slice));
                    replay.run(
                        input_events,
                        until.min(replay.next_input_event_cycle(input_events)),
                        &words,
                        probe.observe_level(),
                        &mut probe,
                    )
                } else {
                    left_start = true;
                    replay.step(input_events, end, probe.observe_level(), &mut probe)
                };
                let observations = std::mem::take(&mut probe.observations);
                let changes = probe.take_changes(&*replay.machine);
                let mut hits = candidate_hits(points, &*replay.machine, &observations, &changes, stop);
                hits.retain(|hit| points.get(hit.id).is_some_and(|point| point.condition_holds(&*replay.machine)));
                if !hits.is_empty() && !on_hit(&replay, hits) {
                    return Ok(Some(replay));
                }
                if !matches!(stop, StopReason::Limit | StopReason::Breakpoint { .. } | StopReason::Probe) {
                    break;
                }
                // Loops that were skipped in the first run may take long when they are observed.
                slice = match start.elapsed() < HOST_TIME_BETWEEN_COPIES.end {
                    true if stop == StopReason::Limit => slice.saturating_mul(2),
                    true => slice,
                    false => STEPS_BETWEEN_CHECKS,
                };
                if !keep_running() {
                    return Err(SessionStopReason::Interrupted);
                }
            }
            if !keep_running() {
                return Err(SessionStopReason::Interrupted);
            }
            // The program had a fault here; the replay continues from the user's next action.
            if replay.cycle() < end && bounds.last() != Some(&end) {
                let Some(next) = self.replayed(end) else { return Ok(None) };
                replay = next;
                probe = WatchpointProbe::new(points, &*replay.machine);
                left_start = !words.contains(&replay.machine.pc()) || replay.machine.is_asleep();
            }
        }
        Ok(Some(replay))
    }

    /// Returns a copy of the machine at a cycle, or at the first boundary after it.
    fn replayed(&self, cycle: u64) -> Option<MachineWithFollower> {
        let mut replay = self.history.copy_at(cycle)?.fork();
        let none = BTreeSet::new();
        replay.set_breakpoints(&none);
        replay.runs_while_halted = true;
        if replay.cycle() < cycle {
            replay.run(&self.history.input_events, cycle, &none, ObserveLevel::Nothing, &mut ());
        }
        replay.apply_due_input_events(&self.history.input_events, ObserveLevel::Nothing, &mut ());
        Some(replay)
    }

    /// Steps a copy up to a cycle, and calls `on_position` at each position after its first.
    fn visit_positions(
        &self,
        replay: &mut MachineWithFollower,
        end: u64,
        on_position: &mut dyn FnMut(&MachineWithFollower),
    ) {
        replay.set_breakpoints(&BTreeSet::new());
        while replay.cycle() < end {
            let stop = replay.step(&self.history.input_events, end, ObserveLevel::Nothing, &mut ());
            if replay.at_step_end {
                on_position(replay);
            }
            if stop != StopReason::Limit {
                return;
            }
        }
    }

    /// Steps the current machine, not a copy, up to a cycle but not past it.
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
        self.mid_step_position = None;
        self.forget_chip_events();
    }

    /// Makes a replayed copy the current machine.
    fn move_to(&mut self, replay: MachineWithFollower) {
        self.current = replay;
        self.mid_step_position = None;
        self.forget_chip_events();
    }
}
