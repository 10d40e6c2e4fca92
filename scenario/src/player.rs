//! The engine that plays a scenario. The caller runs the machine and calls [`ScenarioPlayer::poll`] to learn
//! when to stop next.

mod tasks;

use std::sync::Arc;

use diag::Pos;

use crate::bind::{condition_text, quote_bytes};
use crate::bound_scenario::BoundScenario;
use crate::error::ScenarioError;
use crate::play_ops::{InputWrite, LogPiece, OutputCheck, OutputChecks, PlayAction, PlayOp};
use crate::verdict::{ScenarioOutcome, ScenarioVerdict};
use crate::world::ScenarioWorld;
use tasks::{BackgroundTask, TaskKind};

/// Maximum number of ops per poll; more means that steps repeat without any time between them.
const MAX_OPS_PER_POLL: u32 = 2_000_000;

/// Maximum number of pulses, ramps, repeated actions and guards that are active at the same time.
const MAX_TASKS: usize = 4_096;

/// What the caller must do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PlayerState {
    /// Run the machine and poll again at this tick, or as soon as one of [`ScenarioPlayer::watched_outputs`]
    /// has changed.
    WakeAt(u64),
    /// The scenario has ended with this verdict.
    Done(ScenarioVerdict),
}

/// Checks that must always or never hold in a window.
#[derive(Debug, Clone)]
struct ConditionGuard {
    checks: OutputChecks,
    wanted: bool,
    from: u64,
    to: Option<u64>,
    step: usize,
    /// True once the guard was checked: a window shorter than a step of the machine is checked at the first
    /// step after its start.
    was_checked: bool,
}

/// The current round of a repetition.
#[derive(Debug, Clone)]
struct RepeatFrame {
    line: usize,
    remaining_rounds: u64,
    base: u64,
}

/// A scenario that is being played; a clone continues independently.
#[derive(Debug, Clone)]
pub struct ScenarioPlayer {
    bound: Arc<BoundScenario>,
    line: usize,
    /// The tick that the steps have reached; it is ahead of the machine if stimuli are queued in advance.
    time: u64,
    /// The last tick at which an action was executed.
    last_action_tick: u64,
    frames: Vec<RepeatFrame>,
    tasks: Vec<BackgroundTask>,
    guards: Vec<ConditionGuard>,
    levels: Vec<bool>,
    /// Number of received bytes that expectations have consumed.
    consumed_bytes: usize,
    verdict: Option<ScenarioVerdict>,
}

/// Why a scenario ends early.
struct PlayEnd {
    outcome: ScenarioOutcome,
    /// Index of the step.
    step: usize,
    why: String,
}

impl PlayEnd {
    fn failed(step: usize, why: impl Into<String>) -> PlayEnd {
        PlayEnd { outcome: ScenarioOutcome::Failed, step, why: why.into() }
    }
}

impl ScenarioPlayer {
    /// A player at the first step.
    #[must_use]
    pub fn new(bound: Arc<BoundScenario>) -> ScenarioPlayer {
        ScenarioPlayer {
            line: 0,
            time: 0,
            last_action_tick: 0,
            frames: Vec::new(),
            tasks: Vec::new(),
            guards: Vec::new(),
            levels: vec![false; bound.toggled_inputs.len()],
            consumed_bytes: 0,
            verdict: None,
            bound,
        }
    }

    /// The file name of the scenario.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.bound.file
    }

    /// The tick at which the scenario ends at the latest.
    #[must_use]
    pub fn limit(&self) -> u64 {
        self.bound.limit
    }

    /// Identifiers of the outputs that a wait or a guard depends on now.
    pub fn watched_outputs(&self) -> impl Iterator<Item = usize> {
        let waits = match self.current_op() {
            Some(PlayOp::Wait(checks, _)) => Some(checks),
            _ => None,
        };
        let guards = self.guards.iter().map(|guard| &guard.checks);
        waits.into_iter().chain(guards).flat_map(|checks| checks.iter().map(|check| check.output))
    }

    /// True if the scenario waits for bytes from the machine.
    #[must_use]
    pub fn awaits_bytes(&self) -> bool {
        matches!(self.current_op(), Some(PlayOp::ExpectBytes(..)))
    }

    /// Executes all ops that are due and checks the guards.
    pub fn poll(&mut self, world: &mut dyn ScenarioWorld) -> PlayerState {
        if let Some(verdict) = &self.verdict {
            return PlayerState::Done(verdict.clone());
        }
        let (outcome, step, why) = match self.advance(world) {
            Ok(Some(next)) => return PlayerState::WakeAt(next),
            Ok(None) => (ScenarioOutcome::Passed, None, String::new()),
            Err(PlayEnd { outcome, step, why }) => (outcome, Some(step), why),
        };
        PlayerState::Done(self.finish(world, outcome, step, why))
    }

    /// Ends the scenario because the machine cannot continue: at its own end or at an external limit.
    pub fn abort(&mut self, world: &dyn ScenarioWorld, why: &str) -> ScenarioVerdict {
        match &self.verdict {
            Some(verdict) => verdict.clone(),
            None => {
                let waiting = self.bound.lines.get(self.line).or(self.bound.lines.last());
                // A single action that waits for its time comes before the next step.
                let step = self.first_single_step().or(waiting.map(|line| line.step));
                let what = step.and_then(|step| self.bound.steps.get(step)).map_or("", |info| info.text.as_str());
                let why = format!("{why}, before `{what}` was done");
                self.finish(world, ScenarioOutcome::NoResult, step, why)
            }
        }
    }

    fn finish(
        &mut self,
        world: &dyn ScenarioWorld,
        outcome: ScenarioOutcome,
        step: Option<usize>,
        why: String,
    ) -> ScenarioVerdict {
        let info = step.and_then(|step| self.bound.steps.get(step));
        let tick = world.now();
        let verdict = ScenarioVerdict {
            outcome,
            step: step.map(|step| step + 1),
            text: info.map_or_else(String::new, |info| info.text.clone()),
            pos: info.map_or(Pos::default(), |info| info.pos),
            why,
            tick,
            tick_text: world.describe_tick(tick),
        };
        self.verdict = Some(verdict.clone());
        verdict
    }

    fn current_op(&self) -> Option<&PlayOp> {
        self.bound.lines.get(self.line).map(|line| &line.op)
    }

    /// Executes what is due; returns the tick of the next poll, or `None` at the end.
    fn advance(&mut self, world: &mut dyn ScenarioWorld) -> Result<Option<u64>, PlayEnd> {
        let now = world.now();
        let horizon = now.saturating_add(world.queue_ahead_ticks());
        self.check_guards(world, now)?;
        let (mut busy, mut waits) = (0, false);
        let mut next = loop {
            busy += 1;
            let step = self.bound.lines.get(self.line).map_or(0, |line| line.step);
            if busy > MAX_OPS_PER_POLL {
                return Err(PlayEnd::failed(step, "steps are repeated without any time between them"));
            }
            let task = self.next_task(now);
            let script = if waits { None } else { self.next_due(step)? };
            match (task, script) {
                (None, None) => break u64::MAX,
                (Some((n, due)), script) if script.is_none_or(|(script, _)| due <= script) => {
                    let ahead = self.can_task_be_queued(n);
                    if due > if ahead { horizon } else { now } {
                        break if ahead { due - (horizon - now) } else { due };
                    }
                    self.run_task(n, world)?;
                }
                (_, Some((due, ahead))) => {
                    if due > if ahead { horizon } else { now } {
                        break if ahead { due - (horizon - now) } else { due };
                    }
                    waits = !self.execute_op(world, due, step)?;
                }
                (Some((_, due)), None) => break due,
            }
        };
        if let Some(PlayOp::Wait(_, Some(within)) | PlayOp::ExpectBytes(_, Some(within))) = self.current_op() {
            next = next.min(self.time.saturating_add(*within));
        }
        // A quiet task that is due later has not delayed anything, but it limits the next poll.
        next = self.tasks.iter().map(|task| task.next).filter(|due| *due > now && *due < next).fold(next, u64::min);
        for guard in &self.guards {
            let bound = if guard.from > now { guard.from } else { guard.to.unwrap_or(u64::MAX) };
            next = next.min(bound);
        }
        let script_over = self.line >= self.bound.lines.len();
        if script_over
            && self.tasks.iter().all(|task| task.endless)
            && self.guards.iter().all(|guard| guard.to.is_none())
        {
            if now >= self.last_action_tick.max(self.time) {
                return Ok(None);
            }
            next = next.min(self.last_action_tick.max(self.time));
        }
        if now >= self.bound.limit {
            let line = self.bound.lines.get(self.line).or(self.bound.lines.last());
            let step = line.map_or(0, |line| line.step);
            return Err(PlayEnd { outcome: ScenarioOutcome::NoResult, step, why: self.waiting_text(world) });
        }
        Ok(Some(next.min(self.bound.limit).max(now + 1)))
    }

    /// What the scenario waits for when the limit is reached.
    fn waiting_text(&self, world: &dyn ScenarioWorld) -> String {
        match self.current_op() {
            Some(PlayOp::Wait(checks, _)) => {
                match checks.iter().find(|check| !check.is_met(world.read_output(check.output))) {
                    Some(check) => format!("the limit was reached during the wait for {}", found_text(check, world)),
                    None => "the limit was reached".to_owned(),
                }
            }
            Some(PlayOp::ExpectBytes(bytes, _)) => {
                format!("the limit was reached during the wait for {}", quote_bytes(bytes))
            }
            _ => "the limit was reached before all steps were done".to_owned(),
        }
    }

    /// When the next op is due, and whether it can be queued in advance; `None` after the last op.
    fn next_due(&self, step: usize) -> Result<Option<(u64, bool)>, PlayEnd> {
        let base = self.frames.last().map_or(0, |frame| frame.base);
        Ok(match self.current_op() {
            None => None,
            Some(PlayOp::At(ticks)) => {
                let due = base.saturating_add(*ticks);
                if due < self.time {
                    return Err(PlayEnd::failed(step, "its time had already passed when it started,"));
                }
                Some((due, true))
            }
            Some(PlayOp::After(ticks)) => Some((self.time.saturating_add(*ticks), true)),
            // An action that no step depends on becomes a task that waits for its time in parallel.
            Some(PlayOp::Do(act)) if act.is_independent() => Some((self.time, self.tasks.len() < 2 * MAX_TASKS)),
            Some(PlayOp::Do(act)) => Some((self.time, act.can_be_queued(&self.bound.toggled_inputs))),
            Some(PlayOp::Every { .. } | PlayOp::Repeat(_) | PlayOp::RepeatEnd) => Some((self.time, true)),
            Some(PlayOp::Wait(..) | PlayOp::ExpectBytes(..) | PlayOp::Guard { .. }) => Some((self.time, false)),
        })
    }

    /// Executes an op; returns false if it still waits.
    fn execute_op(&mut self, world: &mut dyn ScenarioWorld, due: u64, step: usize) -> Result<bool, PlayEnd> {
        let bound = self.bound.clone();
        let Some(line) = bound.lines.get(self.line) else { return Ok(false) };
        let now = world.now();
        match &line.op {
            PlayOp::At(_) | PlayOp::After(_) => self.time = due,
            PlayOp::Do(act) if due > now && act.is_independent() => {
                self.tasks.push(BackgroundTask { next: due, step, kind: TaskKind::Once(self.line), endless: false });
            }
            PlayOp::Do(act) => self.execute_action(act, world, due, step)?,
            PlayOp::Every { until, times, .. } => {
                let until = until.map(|until| self.frames.last().map_or(0, |frame| frame.base).saturating_add(until));
                let what = TaskKind::Repetition { line: self.line, left: *times, until };
                self.start_task(BackgroundTask {
                    next: due,
                    step,
                    kind: what,
                    endless: times.is_none() && until.is_none(),
                })?;
            }
            PlayOp::Wait(checks, within) => {
                let missing = checks.iter().find(|check| !check.is_met(world.read_output(check.output)));
                if let Some(check) = missing {
                    if within.is_some_and(|within| now >= due.saturating_add(within)) {
                        return Err(PlayEnd::failed(
                            step,
                            format!("timed out waiting for {}", found_text(check, world)),
                        ));
                    }
                    return Ok(false);
                }
                self.time = now.max(self.time);
            }
            PlayOp::ExpectBytes(bytes, within) => {
                let fresh = world.received().get(self.consumed_bytes..).unwrap_or_default();
                let Some(at) = fresh.windows(bytes.len().max(1)).position(|window| window == bytes.as_slice()) else {
                    if within.is_some_and(|within| now < due.saturating_add(within)) {
                        return Ok(false);
                    }
                    let got = if fresh.is_empty() { "nothing".to_owned() } else { quote_bytes(last_bytes(fresh)) };
                    return Err(PlayEnd::failed(
                        step,
                        format!("expected {} to be sent, found {got}", quote_bytes(bytes)),
                    ));
                };
                self.consumed_bytes += at + bytes.len();
                self.time = now.max(self.time);
            }
            PlayOp::Guard { checks, wanted, window } => {
                let base = self.frames.last().map_or(0, |frame| frame.base);
                let (from, to) =
                    window.map_or((due, None), |(from, to)| (base.saturating_add(from), Some(base.saturating_add(to))));
                if to.is_some_and(|to| to < now) {
                    return Err(PlayEnd::failed(step, "its time had already passed when it started,"));
                }
                if self.guards.len() >= MAX_TASKS {
                    return Err(PlayEnd::failed(step, too_many()));
                }
                self.guards.push(ConditionGuard {
                    checks: checks.clone(),
                    wanted: *wanted,
                    from,
                    to,
                    step,
                    was_checked: false,
                });
                self.check_guards(world, now)?;
            }
            PlayOp::Repeat(rounds) => {
                self.frames.push(RepeatFrame {
                    line: self.line + 1,
                    remaining_rounds: rounds.saturating_sub(1),
                    base: self.time,
                });
            }
            PlayOp::RepeatEnd => {
                let time = self.time;
                if let Some(frame) = self.frames.last_mut() {
                    if frame.remaining_rounds > 0 {
                        (frame.remaining_rounds, frame.base) = (frame.remaining_rounds - 1, time);
                        self.line = frame.line;
                        return Ok(true);
                    }
                    self.frames.pop();
                }
            }
        }
        self.line += 1;
        Ok(true)
    }

    fn execute_action(
        &mut self,
        act: &PlayAction,
        world: &mut dyn ScenarioWorld,
        due: u64,
        step: usize,
    ) -> Result<(), PlayEnd> {
        let refused = |error: ScenarioError| PlayEnd::failed(step, error.to_string());
        self.last_action_tick = self.last_action_tick.max(due);
        match act {
            PlayAction::Write(puts) => self.write_inputs(puts, world, due, step)?,
            PlayAction::Toggle(which) => {
                for &bit in which {
                    let (Some(level), Some(inputs)) = (self.levels.get_mut(bit), self.bound.toggled_inputs.get(bit))
                    else {
                        continue;
                    };
                    *level = !*level;
                    world.set_input(inputs[usize::from(*level)].id, due).map_err(refused)?;
                }
            }
            PlayAction::Ramp(values) => {
                let what = TaskKind::Ramp { values: values.clone(), start: due, done: 0 };
                self.start_task(BackgroundTask { next: due, step, kind: what, endless: false })?;
            }
            PlayAction::Send(bytes) => world.send(bytes, due).map_err(refused)?,
            PlayAction::Check(checks) => {
                if let Some(check) = checks.iter().find(|check| !check.is_met(world.read_output(check.output))) {
                    return Err(PlayEnd::failed(step, format!("expected {}", found_text(check, world))));
                }
            }
            PlayAction::Log(pieces) => {
                let text: String = pieces
                    .iter()
                    .map(|piece| match piece {
                        LogPiece::Text(text) => text.clone(),
                        LogPiece::Value(output) => world.read_output(*output).to_string(),
                    })
                    .collect();
                // Control characters are escaped because the line is printed on a terminal.
                let plain = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
                world.log(&text.chars().map(plain).collect::<String>());
            }
            PlayAction::Snapshot(file) => world.snapshot(file).map_err(refused)?,
            PlayAction::Power => world.power_cycle().map_err(refused)?,
        }
        Ok(())
    }

    fn write_inputs(
        &mut self,
        puts: &[InputWrite],
        world: &mut dyn ScenarioWorld,
        due: u64,
        step: usize,
    ) -> Result<(), PlayEnd> {
        self.last_action_tick = self.last_action_tick.max(due);
        for put in puts {
            if let Some((bit, level)) = put.level
                && let Some(slot) = self.levels.get_mut(bit)
            {
                *slot = level;
            }
            world.set_input(put.input.id, due).map_err(|error| PlayEnd::failed(step, error.to_string()))?;
        }
        Ok(())
    }

    /// Checks the guards.
    fn check_guards(&mut self, world: &dyn ScenarioWorld, now: u64) -> Result<(), PlayEnd> {
        for guard in self
            .guards
            .iter()
            .filter(|guard| guard.from <= now && (!guard.was_checked || guard.to.is_none_or(|to| now <= to)))
        {
            let missing = guard.checks.iter().find(|check| !check.is_met(world.read_output(check.output)));
            match (missing, guard.wanted) {
                (Some(check), true) => {
                    return Err(PlayEnd::failed(guard.step, format!("expected {}", found_text(check, world))));
                }
                (None, false) => {
                    let each: Vec<_> = guard
                        .checks
                        .iter()
                        .map(|check| format!("{} = {}", check.name, world.read_output(check.output)))
                        .collect();
                    return Err(PlayEnd::failed(
                        guard.step,
                        format!("found {}, which never should be,", each.join(", ")),
                    ));
                }
                _ => {}
            }
        }
        self.guards.iter_mut().filter(|guard| guard.from <= now).for_each(|guard| guard.was_checked = true);
        self.guards.retain(|guard| !guard.was_checked || guard.to.is_none_or(|to| now < to));
        Ok(())
    }
}

fn too_many() -> String {
    format!("more than {MAX_TASKS} steps run at once: steps are repeated without enough time between them")
}

/// A failed check as text: `Yarc = 1, found 0`.
fn found_text(check: &OutputCheck, world: &dyn ScenarioWorld) -> String {
    format!("{}, found {}", condition_text(&check.name, &check.wanted), world.read_output(check.output))
}

/// The last received bytes, for messages.
fn last_bytes(bytes: &[u8]) -> &[u8] {
    bytes.get(bytes.len().saturating_sub(40)..).unwrap_or(bytes)
}
