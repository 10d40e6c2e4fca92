//! The tasks of a player: ramps, repetitions and delayed actions that run in parallel with the steps.

use std::sync::Arc;

use super::{MAX_TASKS, PlayEnd, ScenarioPlayer, too_many};
use crate::play_ops::{InputWrite, PlayAction, PlayOp};
use crate::world::ScenarioWorld;

/// A task that runs in parallel with the steps.
#[derive(Debug, Clone)]
pub(super) struct BackgroundTask {
    /// The tick at which the next action of the task is due.
    pub next: u64,
    /// Index of the step that started the task.
    pub step: usize,
    /// The kind of the task, with its progress.
    pub kind: TaskKind,
    /// True if the task belongs to a repetition without end, so the scenario does not wait for it.
    pub endless: bool,
}

/// The kind of a task.
#[derive(Debug, Clone)]
pub(super) enum TaskKind {
    Ramp {
        values: Arc<[(u64, Vec<InputWrite>)]>,
        start: u64,
        done: usize,
    },
    /// A repeated op: its line, and how many executions are left.
    Repetition {
        line: usize,
        left: Option<u64>,
        until: Option<u64>,
    },
    /// A single action whose time has not come: its line.
    Once(usize),
}

impl ScenarioPlayer {
    /// The task that is due next. Quiet tasks that are due later than `now` are left out, because nothing
    /// depends on them.
    pub(super) fn next_task(&self, now: u64) -> Option<(usize, u64)> {
        let tasks = self.tasks.iter().enumerate().filter(|(n, task)| task.next <= now || !self.task_is_quiet(*n));
        tasks.min_by_key(|(n, task)| (task.next, *n)).map(|(n, task)| (n, task.next))
    }

    /// True if the time of the next step is unknown; a task must not change a shared toggled bit before that
    /// step.
    fn is_waiting(&self) -> bool {
        matches!(self.current_op(), Some(PlayOp::Wait(..) | PlayOp::ExpectBytes(..)))
    }

    /// The step of the first single action that still waits for its time.
    pub(super) fn first_single_step(&self) -> Option<usize> {
        let once = self.tasks.iter().filter(|task| matches!(task.kind, TaskKind::Once(_)));
        once.min_by_key(|task| task.next).map(|task| task.step)
    }

    fn task_is_quiet(&self, task: usize) -> bool {
        match self.tasks.get(task).map(|task| &task.kind) {
            Some(TaskKind::Once(_)) => true,
            Some(TaskKind::Repetition { line, .. }) => match self.bound.lines.get(*line).map(|line| &line.op) {
                Some(PlayOp::Every { act, .. }) => act.is_independent() || matches!(act, PlayAction::Check(_)),
                _ => false,
            },
            _ => false,
        }
    }

    /// True if the machine can accept the next action of a task before its time.
    pub(super) fn can_task_be_queued(&self, task: usize) -> bool {
        match self.tasks.get(task).map(|task| &task.kind) {
            Some(TaskKind::Ramp { values, done, .. }) => {
                let free = |put: &InputWrite| {
                    put.input.can_be_queued && !(self.is_waiting() && self.bound.writes_shared_bit(put))
                };
                values.get(*done).is_none_or(|(_, puts)| puts.iter().all(free))
            }
            Some(TaskKind::Repetition { line, .. }) => match self.bound.lines.get(*line).map(|line| &line.op) {
                Some(PlayOp::Every { act, .. }) => {
                    act.can_be_queued(&self.bound.toggled_inputs)
                        && !(self.is_waiting() && self.bound.acts_on_shared_bit(act))
                }
                _ => false,
            },
            Some(TaskKind::Once(_)) | None => false,
        }
    }

    /// Executes the next action of a task, and removes the task after its last action.
    pub(super) fn run_task(&mut self, n: usize, world: &mut dyn ScenarioWorld) -> Result<(), PlayEnd> {
        let bound = self.bound.clone();
        let Some(BackgroundTask { next: due, step, kind: what, endless }) = self.tasks.get(n).cloned() else {
            return Ok(());
        };
        let (last, tasks) = (self.last_action_tick, self.tasks.len());
        let following = match what {
            TaskKind::Ramp { values, start, done } => {
                if let Some((_, puts)) = values.get(done) {
                    self.write_inputs(puts, world, due, step)?;
                }
                let next = values.get(done + 1).map(|(after, _)| start.saturating_add(*after));
                next.map(|next| (next, TaskKind::Ramp { values, start, done: done + 1 }))
            }
            TaskKind::Repetition { line, left, until } => {
                let op = bound.lines.get(line).map(|line| &line.op);
                let Some(PlayOp::Every { period, act, .. }) = op else { return Ok(()) };
                if until.is_none_or(|until| due <= until) {
                    self.execute_action(act, world, due, step)?;
                }
                let (next, left) = (due.saturating_add(*period), left.map(|left| left.saturating_sub(1)));
                let more = left != Some(0) && until.is_none_or(|until| next <= until);
                more.then_some((next, TaskKind::Repetition { line, left, until }))
            }
            TaskKind::Once(line) => {
                if let Some(PlayOp::Do(act)) = bound.lines.get(line).map(|line| &line.op) {
                    self.execute_action(act, world, due, step)?;
                }
                None
            }
        };
        if endless {
            self.last_action_tick = last;
            self.tasks.iter_mut().skip(tasks).for_each(|task| task.endless = true);
        }
        match (following, self.tasks.get_mut(n)) {
            (Some((next, what)), Some(task)) => *task = BackgroundTask { next, step, kind: what, endless },
            _ => _ = self.tasks.remove(n),
        }
        Ok(())
    }

    /// Starts a task in parallel with the steps.
    pub(super) fn start_task(&mut self, task: BackgroundTask) -> Result<(), PlayEnd> {
        // Single actions do not count, because they do not repeat.
        if self.tasks.iter().filter(|task| !matches!(task.kind, TaskKind::Once(_))).count() >= MAX_TASKS {
            return Err(PlayEnd::failed(task.step, too_many()));
        }
        self.tasks.push(task);
        Ok(())
    }
}
