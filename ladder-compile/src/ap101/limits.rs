//! Finds what AP101 cannot express: integer operations, and timers and counters that differ from its modules.

use std::collections::HashSet;

use ladder::{CounterKind, ElementId, TimerKind};

use super::layout::{module_kind, module_preset, used_modules};
use crate::ir::{BranchCondition, Ir, IrOp, JumpKind, TimedModule, WordId, WordOperand, min_bytes};
use crate::target::{BuildRefusal, CompileJob};

/// Returns all reasons for refusal, in order, at most one per element.
pub(super) fn unsupported_ops(job: &CompileJob<'_>) -> Vec<BuildRefusal> {
    let ir = job.ir;
    let mut look = LimitCheck {
        ir,
        modules: used_modules(ir).iter().map(|used| used.word).collect(),
        seen_words: Vec::new(),
        reset_words: HashSet::new(),
    };
    let mut reasons = Vec::new();
    for step in ir.rungs.iter().flat_map(|rung| &rung.steps) {
        if let Some((cause, hint)) = look.check_op(&step.op) {
            reasons.push((Some(step.element), cause, hint));
        }
    }
    // Operations outside of rungs exist only because of an element, so they are checked only if no element
    // was refused.
    if reasons.is_empty() {
        let ops = ir.prologue.iter().chain(&ir.epilogue);
        reasons.extend(ops.filter_map(|op| look.check_op(op)).map(|(cause, hint)| (None, cause, hint)));
    }
    if reasons.is_empty() {
        let cells = (0..).zip(&ir.words).filter(|(n, _)| !look.modules.contains(&WordId(*n)));
        reasons.extend(cells.map(|(_, cell)| (None, format!("`{}` is an integer, {BITS}", cell.name), TIMERS)));
    }
    let mut elements: HashSet<ElementId> = HashSet::new();
    reasons.retain(|(element, ..)| element.is_none_or(|element| elements.insert(element)));
    let lacks =
        |(element, cause, hint): (_, _, &str)| BuildRefusal::Unsupported { cause, hint: hint.to_owned(), element };
    reasons.into_iter().map(lacks).collect()
}

const BITS: &str = "and the machine computes with single bits";
const TIMERS: &str = "choose an 8051, a PIC16 or an AVR: AP101 has only contacts, coils, one shots, the master relay, timers and counters with constant limits, and RES";

/// Check of the operations of a program, in order.
struct LimitCheck<'a> {
    ir: &'a Ir,
    /// Words that are timers or counters.
    modules: HashSet<WordId>,
    /// Words whose timer or counter element was already checked.
    seen_words: Vec<WordId>,
    /// Words that a RES so far resets.
    reset_words: HashSet<WordId>,
}

impl LimitCheck<'_> {
    fn name(&self, word: WordId) -> &str {
        self.ir.words.get(word.0 as usize).map_or("?", |cell| &cell.name)
    }

    /// Returns cause and hint if an operation is refused.
    fn check_op(&mut self, op: &IrOp) -> Option<(String, &'static str)> {
        let text = || self.ir.op_text(op);
        match op {
            IrOp::SetAccumulator(_)
            | IrOp::Load { .. }
            | IrOp::And { .. }
            | IrOp::Or { .. }
            | IrOp::Store { .. }
            | IrOp::SetBit { .. }
            | IrOp::Rising(_)
            | IrOp::Falling(_)
            | IrOp::Label(_)
            | IrOp::Jump { kind: JumpKind::Forward | JumpKind::Return, .. }
            | IrOp::Logic { .. } => None,
            IrOp::Jump { kind: JumpKind::Back, .. } => {
                Some(("a jump back needs an integer to count, and AP101 has none".to_owned(), "jump forward only"))
            }
            // A module counts once in a scan, however often it is written.
            IrOp::Jump { kind: JumpKind::Call { .. }, .. } if !self.modules.is_empty() => Some((
                "a subprogram may be called several times in a scan, and a timer or counter of AP101 counts once"
                    .to_owned(),
                "write the rungs of the subprogram in place of GOSUB, or take another chip",
            )),
            IrOp::Jump { .. } => None,
            IrOp::Move { dst, src: WordOperand::Const(0) } if self.modules.contains(dst) => {
                self.reset_words.insert(*dst);
                None
            }
            IrOp::Move { .. } | IrOp::Math { .. } | IrOp::AndCompare(_) | IrOp::Lookup { .. } => {
                Some((format!("`{}` computes with integers, {BITS}", text()), TIMERS))
            }
            IrOp::ReadAdc { .. } => Some((format!("`{}`: AP101 has no converter", text()), TIMERS)),
            IrOp::SetPwm { .. } => Some((format!("`{}`: AP101 has no PWM output", text()), TIMERS)),
            IrOp::Send { .. } | IrOp::WaitSent | IrOp::Receive { .. } => {
                Some((format!("`{}`: AP101 has no serial line", text()), TIMERS))
            }
            IrOp::Transfer { .. } => Some((format!("`{}`: AP101 has no bus", text()), TIMERS)),
            IrOp::ReadEeprom { .. } | IrOp::WriteEeprom { .. } => {
                Some((format!("`{}`: AP101 has no EEPROM", text()), TIMERS))
            }
            IrOp::Module { module: is, word, limit } => self.check_module(*is, *word, *limit),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                // The first reason in a branch is more specific than the condition.
                let is_back = |op: &&IrOp| matches!(op, IrOp::Jump { kind: JumpKind::Back, .. });
                let ops = || then.iter().chain(otherwise);
                let within = ops().find(is_back).into_iter().chain(ops()).find_map(|op| self.check_op(op));
                let compares = matches!(cond, BranchCondition::Compare(_));
                let line = text().lines().next().unwrap_or_default().to_owned();
                within.or_else(|| compares.then(|| (format!("`{line}` compares integers, {BITS}"), TIMERS)))
            }
        }
    }

    /// Returns cause and hint if a timer or counter differs from what a module can do.
    fn check_module(&mut self, is: TimedModule, word: WordId, limit: WordOperand) -> Option<(String, &'static str)> {
        let name = self.name(word).to_owned();
        if self.seen_words.contains(&word) {
            let cause = format!("`{name}` has a timer or counter already, and each is a module of its own");
            return Some((cause, "give each timer and counter a name of its own"));
        }
        self.seen_words.push(word);
        let cell = self.ir.words.get(word.0 as usize)?;
        if module_kind(is).is_none() {
            let cause = format!("`{name}` is a {}, and AP101 has no module that does the same", module_keyword(is));
            return Some((cause, "express it with TON, TOF, RTO, CTU or CTD, or take another chip"));
        }
        // In LDmicro 5 a TOF has its preset at power-up already, where a RES or a jump may come before it.
        let is_tof = is == TimedModule::Timer(TimerKind::Tof);
        if is_tof && cell.initial != 0 && (self.ir.has_jumps() || self.reset_words.contains(&word)) {
            let cause = format!("`{name}` is a TOF, which its module presets when it is first executed");
            return Some((cause, "write RES below the TOF, and do without jumps, or take another chip"));
        }
        if let WordOperand::Cell(other) = limit {
            let cause = format!("the limit of `{name}` is the integer `{}`, {BITS}", self.name(other));
            return Some((cause, "give it a constant"));
        }
        if module_preset(is, limit).is_none()
            || cell.bytes > 2
            || matches!(limit, WordOperand::Const(max) if min_bytes(max) > cell.bytes)
        {
            let (low, high) = match is {
                TimedModule::Timer(_) => (1, i16::MAX),
                TimedModule::Counter { kind: CounterKind::Ctd, bounded: true, .. } => (i16::MIN, i16::MAX - 1),
                TimedModule::Counter { .. } => (i16::MIN, i16::MAX),
            };
            let WordOperand::Const(limit) = limit else { return None };
            let cause = format!(
                "`{name}` has the limit {limit} and {} bytes; modules have limits from {low} to {high} and 2 bytes",
                cell.bytes
            );
            return Some((cause, "choose a limit within that; a timer of a longer delay needs a longer cycle"));
        }
        (cell.initial != 0 && !is_tof).then(|| {
            let cause = format!("`{name}` starts at {}, a module at 0", cell.initial);
            (cause, "let it start at 0")
        })
    }
}

/// LDmicro's keyword of a module.
fn module_keyword(is: TimedModule) -> String {
    match is {
        TimedModule::Timer(kind) => format!("{kind:?}").to_uppercase(),
        TimedModule::Counter { kind: CounterKind::Ctc, .. } => "CTC with a carry".to_owned(),
        TimedModule::Counter { kind, .. } => format!("{kind:?}").to_uppercase(),
    }
}
