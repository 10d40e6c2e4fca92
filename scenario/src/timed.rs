//! The stimuli of a scenario at fixed times, where it has nothing else.

use std::sync::Arc;

use diag::{Diagnostic, Severity};

use crate::bind::Bound;
use crate::codes::NOT_TIMED;
use crate::ops::{Act, Line, Op, Put};
use crate::player::{Next, Player};
use crate::world::{Reading, World};

/// A stimulus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Timed {
    /// The input of this number gets its value.
    Put(usize),
    /// Bytes begin on their way to the machine.
    Send(Vec<u8>),
}

impl Bound {
    /// Everything is done from outside, so that it can be done again at the same times: `outside` says so of an input.
    ///
    /// # Errors
    /// The steps that write a value inside the machine, or switch it off and on.
    pub fn outside(&self, outside: &dyn Fn(usize) -> bool) -> Result<(), Vec<Diagnostic>> {
        let all = |puts: &[Put]| puts.iter().all(|put| outside(put.input.id));
        let fits = |act: &Act| match act {
            Act::Put(puts) => all(puts),
            Act::Series(values) => values.iter().all(|(_, puts)| all(puts)),
            Act::Toggle(bits) => {
                bits.iter().filter_map(|bit| self.bits.get(*bit)).flatten().all(|input| outside(input.id))
            }
            Act::Power | Act::Snapshot(_) => false,
            Act::Send(_) | Act::Check(_) | Act::Log(_) => true,
        };
        let fault = |line: &Line| {
            let (Op::Do(act) | Op::Every { act, .. }) = &line.op else { return None };
            let info = self.steps.get(line.step).filter(|_| !fits(act))?;
            let cause =
                format!("`{}` does more than drive what is outside, so the debugger cannot queue it", info.text);
            let hint = "leave the step out, or use `emu run --scenario`";
            Some(Diagnostic::new(Severity::Error, NOT_TIMED, &self.file, info.pos, cause, hint))
        };
        let faults: Vec<Diagnostic> = self.lines.iter().filter_map(fault).collect();
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    /// All stimuli, each with its tick, in the order in which they are done.
    ///
    /// # Errors
    /// The first step that has no fixed time, expects something, or goes on for ever.
    pub fn timed(self) -> Result<Vec<(u64, Timed)>, Vec<Diagnostic>> {
        let act = |act: &Act| !matches!(act, Act::Check(_) | Act::Snapshot(_) | Act::Power);
        let fits = |op: &Op| match op {
            Op::At(_) | Op::After(_) | Op::Repeat(_) | Op::Again => true,
            Op::Do(what) => act(what),
            Op::Every { times, until, act: what, .. } => act(what) && (times.is_some() || until.is_some()),
            Op::Wait(..) | Op::Hear(..) | Op::Guard { .. } => false,
        };
        if let Some(line) = self.lines.iter().find(|line| !fits(&line.op)) {
            let info = self.steps.get(line.step);
            let what = info.map_or("a step", |info| info.text.as_str());
            let cause = format!("`{what}` is no stimulus at a fixed time");
            let pos = info.map_or(Default::default(), |info| info.pos);
            let hint = "leave the step out, or use `emu run --scenario`";
            return Err(vec![Diagnostic::new(Severity::Error, NOT_TIMED, &self.file, pos, cause, hint)]);
        }
        let file = self.file.clone();
        let mut player = Player::new(Arc::new(self));
        let mut list = List::default();
        loop {
            match player.look(&mut list) {
                Next::At(tick) => list.now = tick,
                Next::Done(verdict) => {
                    let complaint = verdict.complaint(&file);
                    return complaint.map_or(Ok(list.done), |complaint| Err(vec![complaint]));
                }
            }
        }
    }
}

/// A world that only notes.
#[derive(Default)]
struct List {
    now: u64,
    done: Vec<(u64, Timed)>,
}

impl World for List {
    fn now(&self) -> u64 {
        self.now
    }

    fn put(&mut self, input: usize, at: u64) -> Result<(), String> {
        self.done.push((at, Timed::Put(input)));
        Ok(())
    }

    fn read(&self, _: usize) -> Reading {
        Reading::Floating
    }

    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), String> {
        self.done.push((at, Timed::Send(bytes.to_vec())));
        Ok(())
    }

    fn received(&self) -> &[u8] {
        &[]
    }

    fn power_cycle(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn snapshot(&mut self, _: &str) -> Result<(), String> {
        Ok(())
    }

    fn log(&mut self, _: &str) {}

    fn moment(&self, tick: u64) -> String {
        format!("tick {tick}")
    }
}
