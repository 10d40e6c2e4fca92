//! What goes on beside the steps.

use std::sync::Arc;

use super::{Ended, MOST, Player, too_many};
use crate::ops::{Act, Op, Put};
use crate::verdict::Outcome;
use crate::world::World;

/// Something that goes on beside the steps.
#[derive(Debug, Clone)]
pub(super) struct Task {
    pub next: u64,
    pub step: usize,
    pub what: Again,
    /// It comes from something that goes on for ever: nobody waits for its end.
    pub endless: bool,
}

#[derive(Debug, Clone)]
pub(super) enum Again {
    Series {
        values: Arc<[(u64, Vec<Put>)]>,
        start: u64,
        done: usize,
    },
    /// The line of its op, and how often it is still done.
    Every {
        line: usize,
        left: Option<u64>,
        until: Option<u64>,
    },
    /// The line of its op, whose time is still to come.
    Once(usize),
}

impl Player {
    /// The task that is next. One that is done between two instructions, and later than now, keeps nobody waiting who goes by nothing that
    /// it changes.
    pub(super) fn next_task(&self, now: u64) -> Option<(usize, u64)> {
        let tasks = self.tasks.iter().enumerate().filter(|(n, task)| task.next <= now || !self.task_is_quiet(*n));
        tasks.min_by_key(|(n, task)| (task.next, *n)).map(|(n, task)| (n, task.next))
    }

    /// The next step comes at a time that nobody knows: what it makes of a bit that toggles may come before what a task makes of it.
    fn waits(&self) -> bool {
        matches!(self.op(), Some(Op::Wait(..) | Op::Hear(..)))
    }

    /// The step of what is still to be done at its time beside the steps.
    pub(super) fn first_once(&self) -> Option<usize> {
        let once = self.tasks.iter().filter(|task| matches!(task.what, Again::Once(_)));
        once.min_by_key(|task| task.next).map(|task| task.step)
    }

    fn task_is_quiet(&self, task: usize) -> bool {
        match self.tasks.get(task).map(|task| &task.what) {
            Some(Again::Once(_)) => true,
            Some(Again::Every { line, .. }) => match self.bound.lines.get(*line).map(|line| &line.op) {
                Some(Op::Every { act, .. }) => act.is_quiet() || matches!(act, Act::Check(_)),
                _ => false,
            },
            _ => false,
        }
    }

    pub(super) fn task_ahead(&self, task: usize) -> bool {
        match self.tasks.get(task).map(|task| &task.what) {
            Some(Again::Series { values, done, .. }) => {
                let free = |put: &Put| put.input.ahead && !(self.waits() && self.bound.shares_bit(put));
                values.get(*done).is_none_or(|(_, puts)| puts.iter().all(free))
            }
            Some(Again::Every { line, .. }) => match self.bound.lines.get(*line).map(|line| &line.op) {
                Some(Op::Every { act, .. }) => act.ahead(&self.bound.bits) && !(self.waits() && self.bound.shares(act)),
                _ => false,
            },
            Some(Again::Once(_)) | None => false,
        }
    }

    /// Does the next of a task, and removes it behind its last.
    pub(super) fn run_task(&mut self, n: usize, world: &mut dyn World) -> Result<(), Ended> {
        let bound = self.bound.clone();
        let Some(Task { next: due, step, what, endless }) = self.tasks.get(n).cloned() else { return Ok(()) };
        let (last, tasks) = (self.last, self.tasks.len());
        let following = match what {
            Again::Series { values, start, done } => {
                if let Some((_, puts)) = values.get(done) {
                    self.puts(puts, world, due, step)?;
                }
                let next = values.get(done + 1).map(|(after, _)| start.saturating_add(*after));
                next.map(|next| (next, Again::Series { values, start, done: done + 1 }))
            }
            Again::Every { line, left, until } => {
                let op = bound.lines.get(line).map(|line| &line.op);
                let Some(Op::Every { period, act, .. }) = op else { return Ok(()) };
                if until.is_none_or(|until| due <= until) {
                    self.act(act, world, due, step)?;
                }
                let (next, left) = (due.saturating_add(*period), left.map(|left| left.saturating_sub(1)));
                let more = left != Some(0) && until.is_none_or(|until| next <= until);
                more.then_some((next, Again::Every { line, left, until }))
            }
            Again::Once(line) => {
                if let Some(Op::Do(act)) = bound.lines.get(line).map(|line| &line.op) {
                    self.act(act, world, due, step)?;
                }
                None
            }
        };
        if endless {
            self.last = last;
            self.tasks.iter_mut().skip(tasks).for_each(|task| task.endless = true);
        }
        match (following, self.tasks.get_mut(n)) {
            (Some((next, what)), Some(task)) => *task = Task { next, step, what, endless },
            _ => _ = self.tasks.remove(n),
        }
        Ok(())
    }

    /// Something goes on beside the steps.
    pub(super) fn begin(&mut self, task: Task) -> Result<(), Ended> {
        // What is only told does not go on.
        if self.tasks.iter().filter(|task| !matches!(task.what, Again::Once(_))).count() >= MOST {
            return Err((Outcome::Failed, task.step, too_many()));
        }
        self.tasks.push(task);
        Ok(())
    }
}
