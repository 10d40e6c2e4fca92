//! What goes on beside the steps.

use std::sync::Arc;

use super::{MAX_TASKS, PlayEnd, ScenarioPlayer, too_many};
use crate::play_ops::{InputWrite, PlayAction, PlayOp};
use crate::verdict::ScenarioOutcome;
use crate::world::ScenarioWorld;

/// Something that goes on beside the steps.
#[derive(Debug, Clone)]
pub(super) struct BackgroundTask {
    pub next: u64,
    pub step: usize,
    pub kind: TaskKind,
    /// It comes from something that goes on for ever: nobody waits for its end.
    pub endless: bool,
}

#[derive(Debug, Clone)]
pub(super) enum TaskKind {
    Ramp {
        values: Arc<[(u64, Vec<InputWrite>)]>,
        start: u64,
        done: usize,
    },
    /// The line of its op, and how often it is still done.
    Repetition {
        line: usize,
        left: Option<u64>,
        until: Option<u64>,
    },
    /// The line of its op, whose time is still to come.
    Once(usize),
}

impl ScenarioPlayer {
    /// The task that is next. One that is done between two instructions, and later than now, keeps nobody waiting who goes by nothing that
    /// it changes.
    pub(super) fn next_task(&self, now: u64) -> Option<(usize, u64)> {
        let tasks = self.tasks.iter().enumerate().filter(|(n, task)| task.next <= now || !self.task_is_quiet(*n));
        tasks.min_by_key(|(n, task)| (task.next, *n)).map(|(n, task)| (n, task.next))
    }

    /// The next step comes at a time that nobody knows: what it makes of a bit that toggles may come before what a task makes of it.
    fn is_waiting(&self) -> bool {
        matches!(self.current_op(), Some(PlayOp::Wait(..) | PlayOp::ExpectBytes(..)))
    }

    /// The step of what is still to be done at its time beside the steps.
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

    /// Does the next of a task, and removes it behind its last.
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

    /// Something goes on beside the steps.
    pub(super) fn start_task(&mut self, task: BackgroundTask) -> Result<(), PlayEnd> {
        // What is only told does not go on.
        if self.tasks.iter().filter(|task| !matches!(task.kind, TaskKind::Once(_))).count() >= MAX_TASKS {
            return Err((ScenarioOutcome::Failed, task.step, too_many()));
        }
        self.tasks.push(task);
        Ok(())
    }
}
