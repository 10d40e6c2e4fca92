//! Timers and counters.

use std::collections::HashMap;

use ladder::symbols::uses;
use ladder::{CompareOp, CounterKind, Dialect, Element, ElementId, Format, Operand, Program, TimerKind};

use super::{Lower, add, when};
use crate::ir::{BitRole, Compare, Cond, Math, Module, Op, Rel, Value};

/// The number of scans that a timer counts: delay / cycle, truncated, plus its adjust; `None` below 1, beyond 32 bits, or
/// where delay or adjust are no constants. Without an adjust it is -1, as in release 2.3, but 0 in LDmicro 5's own files.
#[must_use]
pub fn scans(program: &Program, delay: &Operand, adjust: Option<&Operand>) -> Option<i32> {
    let Operand::Const { value: delay, .. } = delay else { return None };
    let adjust = match adjust {
        Some(Operand::Const { value, .. }) => *value,
        Some(Operand::Var(_)) => return None,
        None if program.dialect == Dialect::Ldmicro5 && program.format == Format::V02 => 0,
        None => -1,
    };
    let whole = u64::try_from(*delay).ok()?.checked_div(program.settings.cycle_us)?;
    let scans = i64::try_from(whole).ok()?.checked_add(adjust)?;
    i32::try_from(scans).ok().filter(|scans| *scans >= 1)
}

/// The start values of the counters: the first of a name decides.
pub(super) fn starts(program: &Program) -> HashMap<&str, i32> {
    let mut starts = HashMap::new();
    for (_, element, _) in program.elements() {
        if let Element::Counter { name, init, .. } = element {
            starts.entry(name.as_str()).or_insert(start(init.as_ref()));
        }
    }
    starts
}

/// A counter's start value.
fn start(init: Option<&Operand>) -> i32 {
    if let Some(Operand::Const { value, .. }) = init { *value as i32 } else { 0 }
}

/// The element of each integer that uses it first in a scan.
fn first_uses(program: &Program) -> HashMap<String, ElementId> {
    let mut first = HashMap::new();
    for (id, element, _) in program.elements() {
        uses(element, &mut |name, _| _ = first.entry(name.to_owned()).or_insert(id));
    }
    first
}

impl Lower<'_> {
    /// A TOF presets its accumulator when it is executed for the first time. Every element is executed in every scan, so that
    /// is in the first scan; and before all rungs where nothing else uses the accumulator earlier.
    pub(super) fn presets(&mut self) {
        if self.modules {
            return;
        }
        let first = first_uses(self.program);
        let (mut early, mut late) = (Vec::new(), false);
        for (id, element, _) in self.program.elements() {
            let Element::Timer { kind: TimerKind::Tof, name, delay, adjust } = element else { continue };
            let Some(limit) = scans(self.program, delay, adjust.as_ref()) else { continue };
            if first.get(name) == Some(&id) {
                early.push(Op::Move { dst: self.word(name), src: Value::Const(limit) });
                self.preset.push(id);
            } else {
                late = true;
            }
        }
        if early.is_empty() && !late {
            return;
        }
        let bit = self.new_bit("scanned".to_owned(), BitRole::Memory);
        let done = Op::Put { bit, value: true };
        if late {
            self.scanned = Some(bit);
            self.ir.end.push(done);
        } else {
            early.push(done);
        }
        if !early.is_empty() {
            self.ir.begin.push(Op::If { cond: Cond::Bit(bit), then: Vec::new(), otherwise: early });
        }
    }

    pub(super) fn timer(&mut self, kind: TimerKind, name: &str, delay: &Operand, adjust: Option<&Operand>) {
        let word = self.word(name);
        // A timer that cannot be counted was refused before.
        let Some(limit) = scans(self.program, delay, adjust) else { return };
        if self.modules {
            return self.push(Op::Module { is: Module::Timer(kind), word, limit: Value::Const(limit) });
        }
        let running = Cond::Compare(Compare { a: word, rel: Rel::Lt, b: Value::Const(limit) });
        let count = add(word, Math::Add);
        let clear = Op::Move { dst: word, src: Value::Const(0) };
        match kind {
            TimerKind::Ton => self.push(Op::If {
                cond: Cond::Acc,
                then: vec![Op::If { cond: running, then: vec![count, Op::Acc(false)], otherwise: vec![] }],
                otherwise: vec![clear],
            }),
            TimerKind::Tof => {
                if let Some(scanned) = self.scanned.filter(|_| !self.preset.contains(&self.at)) {
                    let preset = Op::Move { dst: word, src: Value::Const(limit) };
                    self.push(Op::If { cond: Cond::Bit(scanned), then: vec![], otherwise: vec![preset] });
                }
                self.push(Op::If {
                    cond: Cond::Acc,
                    then: vec![clear],
                    otherwise: vec![Op::If { cond: running, then: vec![count, Op::Acc(true)], otherwise: vec![] }],
                });
            }
            TimerKind::Rto => self.push(Op::If {
                cond: running,
                then: vec![when(vec![count]), Op::Acc(false)],
                otherwise: vec![Op::Acc(true)],
            }),
        }
    }

    pub(super) fn counter(
        &mut self,
        kind: CounterKind,
        name: &str,
        max: &Operand,
        (init, input): (Option<&Operand>, Option<char>),
    ) {
        let word = self.word(name);
        let (n, max) = (Value::Cell(word), self.value(max));
        let input = input.unwrap_or('/');
        if self.modules {
            let is = Module::Counter { kind, input, bounded: self.bounded };
            return self.push(Op::Module { is, word, limit: max });
        }
        let turn = match kind {
            CounterKind::Ctu if self.bounded => {
                self.where_(CompareOp::Les, n, max, vec![add(word, Math::Add)], Vec::new())
            }
            CounterKind::Ctu => vec![add(word, Math::Add)],
            CounterKind::Ctd if self.bounded => {
                self.where_(CompareOp::Grt, n, max, vec![add(word, Math::Sub)], Vec::new())
            }
            CounterKind::Ctd => vec![add(word, Math::Sub)],
            CounterKind::Ctc => {
                // It goes back to its own start value, whatever another counter of the name has.
                let back = Op::Move { dst: word, src: Value::Const(start(init)) };
                self.where_(CompareOp::Geq, n, max, vec![back], vec![add(word, Math::Add)])
            }
        };
        self.count(input, turn, kind == CounterKind::Ctc);
        let out = match kind {
            CounterKind::Ctc => return,
            CounterKind::Ctd if self.bounded => self.narrow(CompareOp::Grt, n, max),
            CounterKind::Ctu | CounterKind::Ctd => self.narrow(CompareOp::Geq, n, max),
        };
        self.push(Op::Acc(true));
        out.into_iter().for_each(|op| self.push(op));
    }

    /// `turn` when the rung state counts; afterwards it is what it was if `keep`, else anything.
    fn count(&mut self, input: char, turn: Vec<Op>, keep: bool) {
        match input {
            '-' => self.push(when(turn)),
            'o' => self.push(Op::If { cond: Cond::Acc, then: Vec::new(), otherwise: turn }),
            edge => {
                let memory = self.memory();
                self.push(if edge == '\\' { Op::Falling(memory) } else { Op::Rising(memory) });
                self.push(when(turn));
                if keep {
                    // The memory is the rung state of this scan.
                    self.push(Op::Load { bit: memory, negated: false });
                }
            }
        }
    }
}
