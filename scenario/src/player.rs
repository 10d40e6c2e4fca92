//! The engine: plays a scenario over a machine that is run by somebody else, who asks [`Player::look`] when to stop next.

mod tasks;

use std::sync::Arc;

use diag::Pos;

use crate::bind::{Bound, condition, quoted};
use crate::ops::{Act, Check, Checks, Op, Piece, Put};
use crate::verdict::{Outcome, Verdict};
use crate::world::World;
use tasks::{Again, Task};

/// Ops in one moment at most: steps that are repeated without any time between them would never end.
const BUSY: u32 = 2_000_000;

/// Pulses, ramps, repeated acts and things watched over that go on at a time, at most.
const MOST: usize = 4_096;

/// What is to be done next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Next {
    /// Run, and look again at this tick, or as soon as something in [`Player::watched`] has changed.
    At(u64),
    /// It is over.
    Done(Verdict),
}

/// Something that always or never holds.
#[derive(Debug, Clone)]
struct Guard {
    checks: Checks,
    wanted: bool,
    from: u64,
    to: Option<u64>,
    step: usize,
    /// It was looked at: a time shorter than the machine's steps is at its first behind the beginning.
    seen: bool,
}

/// A round of a repetition.
#[derive(Debug, Clone)]
struct Frame {
    line: usize,
    left: u64,
    base: u64,
}

/// A scenario in play. A value: a clone goes on by itself.
#[derive(Debug, Clone)]
pub struct Player {
    bound: Arc<Bound>,
    line: usize,
    /// The tick that the steps have reached; ahead of the machine where they can be told in advance.
    time: u64,
    /// The last tick at which something was done.
    last: u64,
    frames: Vec<Frame>,
    tasks: Vec<Task>,
    guards: Vec<Guard>,
    levels: Vec<bool>,
    /// Bytes that an expectation has used up.
    heard: usize,
    verdict: Option<Verdict>,
}

/// Why it does not go on.
type Ended = (Outcome, usize, String);

impl Player {
    /// At the first step.
    #[must_use]
    pub fn new(bound: Arc<Bound>) -> Player {
        Player {
            line: 0,
            time: 0,
            last: 0,
            frames: Vec::new(),
            tasks: Vec::new(),
            guards: Vec::new(),
            levels: vec![false; bound.bits.len()],
            heard: 0,
            verdict: None,
            bound,
        }
    }

    /// The file.
    #[must_use]
    pub fn file(&self) -> &str {
        &self.bound.file
    }

    /// The last moment at which it ends.
    #[must_use]
    pub fn limit(&self) -> u64 {
        self.bound.limit
    }

    /// What is waited for or watched over now: identifiers of outputs.
    pub fn watched(&self) -> impl Iterator<Item = usize> {
        let waits = match self.op() {
            Some(Op::Wait(checks, _)) => Some(checks),
            _ => None,
        };
        let guards = self.guards.iter().map(|guard| &guard.checks);
        waits.into_iter().chain(guards).flat_map(|checks| checks.iter().map(|check| check.output))
    }

    /// Bytes of the machine are waited for.
    #[must_use]
    pub fn listens(&self) -> bool {
        matches!(self.op(), Some(Op::Hear(..)))
    }

    /// Does what is due, and looks at what is expected.
    pub fn look(&mut self, world: &mut dyn World) -> Next {
        if let Some(verdict) = &self.verdict {
            return Next::Done(verdict.clone());
        }
        let (outcome, step, why) = match self.turn(world) {
            Ok(Some(next)) => return Next::At(next),
            Ok(None) => (Outcome::Passed, None, String::new()),
            Err((outcome, step, why)) => (outcome, Some(step), why),
        };
        Next::Done(self.end(world, outcome, step, why))
    }

    /// Ends it where the machine cannot go on: at its own end or at a limit from outside.
    pub fn give_up(&mut self, world: &dyn World, why: &str) -> Verdict {
        match &self.verdict {
            Some(verdict) => verdict.clone(),
            None => {
                let waiting = self.bound.lines.get(self.line).or(self.bound.lines.last());
                // What waits beside the steps comes before the next of them.
                let step = self.first_once().or(waiting.map(|line| line.step));
                let what = step.and_then(|step| self.bound.steps.get(step)).map_or("", |info| info.text.as_str());
                let why = format!("{why}, before `{what}` was done");
                self.end(world, Outcome::NoResult, step, why)
            }
        }
    }

    fn end(&mut self, world: &dyn World, outcome: Outcome, step: Option<usize>, why: String) -> Verdict {
        let info = step.and_then(|step| self.bound.steps.get(step));
        let tick = world.now();
        let verdict = Verdict {
            outcome,
            step: step.map(|step| step + 1),
            text: info.map_or_else(String::new, |info| info.text.clone()),
            pos: info.map_or(Pos::default(), |info| info.pos),
            why,
            tick,
            moment: world.moment(tick),
        };
        self.verdict = Some(verdict.clone());
        verdict
    }

    fn op(&self) -> Option<&Op> {
        self.bound.lines.get(self.line).map(|line| &line.op)
    }

    /// One look; gives the tick of the next one, nothing at the end.
    fn turn(&mut self, world: &mut dyn World) -> Result<Option<u64>, Ended> {
        let now = world.now();
        let horizon = now.saturating_add(world.ahead());
        self.watch(world, now)?;
        let (mut busy, mut waits) = (0, false);
        let mut next = loop {
            busy += 1;
            let step = self.bound.lines.get(self.line).map_or(0, |line| line.step);
            if busy > BUSY {
                return Err((Outcome::Failed, step, "steps are repeated without any time between them".to_owned()));
            }
            let task = self.next_task(now);
            let script = if waits { None } else { self.due(step)? };
            match (task, script) {
                (None, None) => break u64::MAX,
                (Some((n, due)), script) if script.is_none_or(|(script, _)| due <= script) => {
                    let ahead = self.task_ahead(n);
                    if due > if ahead { horizon } else { now } {
                        break if ahead { due - (horizon - now) } else { due };
                    }
                    self.run_task(n, world)?;
                }
                (_, Some((due, ahead))) => {
                    if due > if ahead { horizon } else { now } {
                        break if ahead { due - (horizon - now) } else { due };
                    }
                    waits = !self.run_line(world, due, step)?;
                }
                (Some((_, due)), None) => break due,
            }
        };
        if let Some(Op::Wait(_, Some(within)) | Op::Hear(_, Some(within))) = self.op() {
            next = next.min(self.time.saturating_add(*within));
        }
        // What only looks and is due later has kept nothing else waiting.
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
            if now >= self.last.max(self.time) {
                return Ok(None);
            }
            next = next.min(self.last.max(self.time));
        }
        if now >= self.bound.limit {
            let line = self.bound.lines.get(self.line).or(self.bound.lines.last());
            let step = line.map_or(0, |line| line.step);
            return Err((Outcome::NoResult, step, self.waiting(world)));
        }
        Ok(Some(next.min(self.bound.limit).max(now + 1)))
    }

    /// What is waited for at the limit.
    fn waiting(&self, world: &dyn World) -> String {
        match self.op() {
            Some(Op::Wait(checks, _)) => match checks.iter().find(|check| !check.holds(world.read(check.output))) {
                Some(check) => format!("the limit came while waiting for {}", found(check, world)),
                None => "the limit came".to_owned(),
            },
            Some(Op::Hear(bytes, _)) => format!("the limit came while waiting for {}", quoted(bytes)),
            _ => "the limit came before all steps were done".to_owned(),
        }
    }

    /// When the next op is due, and whether it can be told ahead; nothing behind the last.
    fn due(&self, step: usize) -> Result<Option<(u64, bool)>, Ended> {
        let base = self.frames.last().map_or(0, |frame| frame.base);
        Ok(match self.op() {
            None => None,
            Some(Op::At(ticks)) => {
                let due = base.saturating_add(*ticks);
                if due < self.time {
                    return Err((Outcome::Failed, step, "its time had passed when it was its turn,".to_owned()));
                }
                Some((due, true))
            }
            Some(Op::After(ticks)) => Some((self.time.saturating_add(*ticks), true)),
            // What changes nothing that a step knows waits for its time beside them.
            Some(Op::Do(act)) if act.is_quiet() => Some((self.time, self.tasks.len() < 2 * MOST)),
            Some(Op::Do(act)) => Some((self.time, act.ahead(&self.bound.bits))),
            Some(Op::Every { .. } | Op::Repeat(_) | Op::Again) => Some((self.time, true)),
            Some(Op::Wait(..) | Op::Hear(..) | Op::Guard { .. }) => Some((self.time, false)),
        })
    }

    /// Does an op; false where it still waits.
    fn run_line(&mut self, world: &mut dyn World, due: u64, step: usize) -> Result<bool, Ended> {
        let bound = self.bound.clone();
        let Some(line) = bound.lines.get(self.line) else { return Ok(false) };
        let now = world.now();
        match &line.op {
            Op::At(_) | Op::After(_) => self.time = due,
            Op::Do(act) if due > now && act.is_quiet() => {
                self.tasks.push(Task { next: due, step, what: Again::Once(self.line), endless: false });
            }
            Op::Do(act) => self.act(act, world, due, step)?,
            Op::Every { until, times, .. } => {
                let until = until.map(|until| self.frames.last().map_or(0, |frame| frame.base).saturating_add(until));
                let what = Again::Every { line: self.line, left: *times, until };
                self.begin(Task { next: due, step, what, endless: times.is_none() && until.is_none() })?;
            }
            Op::Wait(checks, within) => {
                let missing = checks.iter().find(|check| !check.holds(world.read(check.output)));
                if let Some(check) = missing {
                    if within.is_some_and(|within| now >= due.saturating_add(within)) {
                        return Err((Outcome::Failed, step, format!("waited in vain for {}", found(check, world))));
                    }
                    return Ok(false);
                }
                self.time = now.max(self.time);
            }
            Op::Hear(bytes, within) => {
                let fresh = world.received().get(self.heard..).unwrap_or_default();
                let Some(at) = fresh.windows(bytes.len().max(1)).position(|window| window == bytes.as_slice()) else {
                    if within.is_some_and(|within| now < due.saturating_add(within)) {
                        return Ok(false);
                    }
                    let got = if fresh.is_empty() { "nothing".to_owned() } else { quoted(tail(fresh)) };
                    return Err((Outcome::Failed, step, format!("expected {} to be sent, found {got}", quoted(bytes))));
                };
                self.heard += at + bytes.len();
                self.time = now.max(self.time);
            }
            Op::Guard { checks, wanted, window } => {
                let base = self.frames.last().map_or(0, |frame| frame.base);
                let (from, to) =
                    window.map_or((due, None), |(from, to)| (base.saturating_add(from), Some(base.saturating_add(to))));
                if to.is_some_and(|to| to < now) {
                    return Err((Outcome::Failed, step, "its time had passed when it was its turn,".to_owned()));
                }
                if self.guards.len() >= MOST {
                    return Err((Outcome::Failed, step, too_many()));
                }
                self.guards.push(Guard { checks: checks.clone(), wanted: *wanted, from, to, step, seen: false });
                self.watch(world, now)?;
            }
            Op::Repeat(rounds) => {
                self.frames.push(Frame { line: self.line + 1, left: rounds.saturating_sub(1), base: self.time });
            }
            Op::Again => {
                let time = self.time;
                if let Some(frame) = self.frames.last_mut() {
                    if frame.left > 0 {
                        (frame.left, frame.base) = (frame.left - 1, time);
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

    fn act(&mut self, act: &Act, world: &mut dyn World, due: u64, step: usize) -> Result<(), Ended> {
        let refused = |why: String| (Outcome::Failed, step, why);
        self.last = self.last.max(due);
        match act {
            Act::Put(puts) => self.puts(puts, world, due, step)?,
            Act::Toggle(which) => {
                for &bit in which {
                    let (Some(level), Some(inputs)) = (self.levels.get_mut(bit), self.bound.bits.get(bit)) else {
                        continue;
                    };
                    *level = !*level;
                    world.put(inputs[usize::from(*level)].id, due).map_err(refused)?;
                }
            }
            Act::Series(values) => {
                let what = Again::Series { values: values.clone(), start: due, done: 0 };
                self.begin(Task { next: due, step, what, endless: false })?;
            }
            Act::Send(bytes) => world.send(bytes, due).map_err(refused)?,
            Act::Check(checks) => {
                if let Some(check) = checks.iter().find(|check| !check.holds(world.read(check.output))) {
                    return Err((Outcome::Failed, step, format!("expected {}", found(check, world))));
                }
            }
            Act::Log(pieces) => {
                let text: String = pieces
                    .iter()
                    .map(|piece| match piece {
                        Piece::Text(text) => text.clone(),
                        Piece::Value(output) => world.read(*output).to_string(),
                    })
                    .collect();
                // It goes to a terminal as it is.
                let plain = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
                world.log(&text.chars().map(plain).collect::<String>());
            }
            Act::Snapshot(file) => world.snapshot(file).map_err(refused)?,
            Act::Power => world.power_cycle().map_err(refused)?,
        }
        Ok(())
    }

    fn puts(&mut self, puts: &[Put], world: &mut dyn World, due: u64, step: usize) -> Result<(), Ended> {
        self.last = self.last.max(due);
        for put in puts {
            if let Some((bit, level)) = put.level
                && let Some(slot) = self.levels.get_mut(bit)
            {
                *slot = level;
            }
            world.put(put.input.id, due).map_err(|why| (Outcome::Failed, step, why))?;
        }
        Ok(())
    }

    /// What always or never holds.
    fn watch(&mut self, world: &dyn World, now: u64) -> Result<(), Ended> {
        for guard in
            self.guards.iter().filter(|guard| guard.from <= now && (!guard.seen || guard.to.is_none_or(|to| now <= to)))
        {
            let missing = guard.checks.iter().find(|check| !check.holds(world.read(check.output)));
            match (missing, guard.wanted) {
                (Some(check), true) => {
                    return Err((Outcome::Failed, guard.step, format!("expected {}", found(check, world))));
                }
                (None, false) => {
                    let each: Vec<_> = guard
                        .checks
                        .iter()
                        .map(|check| format!("{} = {}", check.name, world.read(check.output)))
                        .collect();
                    return Err((
                        Outcome::Failed,
                        guard.step,
                        format!("found {}, which never should be,", each.join(", ")),
                    ));
                }
                _ => {}
            }
        }
        self.guards.iter_mut().filter(|guard| guard.from <= now).for_each(|guard| guard.seen = true);
        self.guards.retain(|guard| !guard.seen || guard.to.is_none_or(|to| now < to));
        Ok(())
    }
}

fn too_many() -> String {
    format!("more than {MOST} things go on at once: steps are repeated without enough time between them")
}

/// `Yarc = 1, found 0`.
fn found(check: &Check, world: &dyn World) -> String {
    format!("{}, found {}", condition(&check.name, &check.wanted), world.read(check.output))
}

/// The end of what was received, for messages.
fn tail(bytes: &[u8]) -> &[u8] {
    bytes.get(bytes.len().saturating_sub(40)..).unwrap_or(bytes)
}
