//! What the machine cannot express: all that computes with integers, and timers and counters that are not what its modules are.

use std::collections::HashSet;

use ladder::{CounterKind, ElementId};

use super::layout::{modules, preset};
use crate::ir::{Cond, Ir, Module, Op, Value, Word, bytes_of};
use crate::target::{Job, Refusal};

/// Every reason, at most one for each element, in order.
pub(super) fn refuse(job: &Job<'_>) -> Vec<Refusal> {
    let ir = job.ir;
    let mut look = Look { ir, modules: modules(ir).iter().map(|(_, word, _)| *word).collect(), seen: Vec::new() };
    let mut told = Vec::new();
    for step in ir.rungs.iter().flat_map(|rung| &rung.steps) {
        if let Some((cause, hint)) = look.op(&step.op) {
            told.push((Some(step.at), cause, hint));
        }
    }
    // What belongs to no element is there because of one that does.
    if told.is_empty() {
        let ops = ir.begin.iter().chain(&ir.end);
        told.extend(ops.filter_map(|op| look.op(op)).map(|(cause, hint)| (None, cause, hint)));
    }
    if told.is_empty() {
        let cells = (0..).zip(&ir.words).filter(|(n, _)| !look.modules.contains(&Word(*n)));
        told.extend(cells.map(|(_, cell)| (None, format!("`{}` is an integer, {BITS}", cell.name), TIMERS)));
    }
    let mut elements: HashSet<ElementId> = HashSet::new();
    told.retain(|(element, ..)| element.is_none_or(|element| elements.insert(element)));
    let lacks = |(element, cause, hint): (_, _, &str)| Refusal::Lacks { cause, hint: hint.to_owned(), element };
    told.into_iter().map(lacks).collect()
}

const BITS: &str = "and the machine computes with single bits";
const TIMERS: &str =
    "AP101 has contacts, coils, one shots, the master relay, timers and counters with constant limits, and RES";

struct Look<'a> {
    ir: &'a Ir,
    /// Words that are timers or counters.
    modules: HashSet<Word>,
    /// Those of which the element has come already.
    seen: Vec<Word>,
}

impl Look<'_> {
    fn name(&self, word: Word) -> &str {
        self.ir.words.get(word.0 as usize).map_or("?", |cell| &cell.name)
    }

    /// Why an operation is refused: cause and hint.
    fn op(&mut self, op: &Op) -> Option<(String, &'static str)> {
        let text = || self.ir.text(op);
        match op {
            Op::Acc(_)
            | Op::Load { .. }
            | Op::And { .. }
            | Op::Or { .. }
            | Op::Store { .. }
            | Op::Put { .. }
            | Op::Rising(_)
            | Op::Falling(_)
            | Op::Logic { .. } => None,
            Op::Move { dst, src: Value::Const(0) } if self.modules.contains(dst) => None,
            Op::Move { .. } | Op::Math { .. } | Op::AndCompare(_) | Op::Lookup { .. } => {
                Some((format!("`{}` computes with integers, {BITS}", text()), TIMERS))
            }
            Op::ReadAdc { .. } => Some((format!("`{}`: AP101 has no converter", text()), TIMERS)),
            Op::SetPwm { .. } => Some((format!("`{}`: AP101 has no PWM output", text()), TIMERS)),
            Op::Send { .. } | Op::Receive { .. } => Some((format!("`{}`: AP101 has no serial line", text()), TIMERS)),
            Op::Recall { .. } | Op::Persist { .. } => Some((format!("`{}`: AP101 has no EEPROM", text()), TIMERS)),
            Op::Module { is, word, limit } => self.module(*is, *word, *limit),
            Op::If { cond, then, otherwise } => {
                // The first reason within says more than the condition.
                let within = then.iter().chain(otherwise).find_map(|op| self.op(op));
                let compares = matches!(cond, Cond::Compare(_));
                let line = text().lines().next().unwrap_or_default().to_owned();
                within.or_else(|| compares.then(|| (format!("`{line}` compares integers, {BITS}"), TIMERS)))
            }
        }
    }

    fn module(&mut self, is: Module, word: Word, limit: Value) -> Option<(String, &'static str)> {
        let name = self.name(word).to_owned();
        if self.seen.contains(&word) {
            let cause = format!("`{name}` has a timer or counter already, and each is a module of its own");
            return Some((cause, "give each timer and counter a name of its own"));
        }
        self.seen.push(word);
        let cell = self.ir.words.get(word.0 as usize)?;
        if let Value::Cell(other) = limit {
            let cause = format!("the limit of `{name}` is the integer `{}`, {BITS}", self.name(other));
            return Some((cause, "give it a constant"));
        }
        if preset(is, limit).is_none()
            || cell.bytes > 2
            || matches!(limit, Value::Const(max) if bytes_of(max) > cell.bytes)
        {
            let (low, high) = match is {
                Module::Timer(_) => (1, i16::MAX),
                Module::Counter { kind: CounterKind::Ctd, bounded: true, .. } => (i16::MIN, i16::MAX - 1),
                Module::Counter { .. } => (i16::MIN, i16::MAX),
            };
            let Value::Const(limit) = limit else { return None };
            let cause = format!(
                "`{name}` has the limit {limit} and {} bytes; modules have limits from {low} to {high} and 2 bytes",
                cell.bytes
            );
            return Some((cause, "choose a limit within that; a timer of a longer delay needs a longer cycle"));
        }
        (cell.initial != 0).then(|| {
            let cause = format!("`{name}` starts at {}, a module at 0", cell.initial);
            (cause, "let it start at 0")
        })
    }
}
