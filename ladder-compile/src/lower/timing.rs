//! Lowers timers and counters.

use std::collections::HashMap;

use ladder::symbols::for_each_symbol_use;
use ladder::{
    CompareOp, CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LdFormat, TimerKind,
};

use super::{Lowering, if_accumulator, step_word};
use crate::ir::{ArithmeticOp, BitRole, BranchCondition, IrOp, RelationOp, TimedModule, WordComparison, WordOperand};

/// Number of scans that a timer counts: delay / cycle, truncated, plus its adjust.
///
/// `None` if it is below 1 or above 32 bits, or if delay or adjust are not constants. The default adjust is
/// -1, as in release 2.3, but 0 in files with LDmicro 5's own header.
#[must_use]
pub fn timer_scans(program: &LadderProgram, delay: &LadderOperand, adjust: Option<&LadderOperand>) -> Option<i32> {
    let LadderOperand::Const { value: delay, .. } = delay else { return None };
    let adjust = match adjust {
        Some(LadderOperand::Const { value, .. }) => *value,
        Some(LadderOperand::Var(_)) => return None,
        None if program.dialect == LadderDialect::Ldmicro5 && program.format == LdFormat::V02 => 0,
        None => -1,
    };
    let whole = u64::try_from(*delay).ok()?.checked_div(program.settings.cycle_us)?;
    let scans = i64::try_from(whole).ok()?.checked_add(adjust)?;
    i32::try_from(scans).ok().filter(|scans| *scans >= 1)
}

/// Start values of all counters; the first element with a name decides.
pub(super) fn counter_starts(program: &LadderProgram) -> HashMap<&str, i32> {
    let mut starts = HashMap::new();
    for (_, element, _) in program.elements() {
        if let Element::Counter { name, init, .. } = element {
            starts.entry(name.as_str()).or_insert(start_value(init.as_ref()));
        }
    }
    starts
}

/// Start value of a counter element.
fn start_value(init: Option<&LadderOperand>) -> i32 {
    if let Some(LadderOperand::Const { value, .. }) = init { *value as i32 } else { 0 }
}

/// For each integer, the first element in a scan that uses it.
fn first_uses(program: &LadderProgram) -> HashMap<String, ElementId> {
    let mut first = HashMap::new();
    for (id, element, _) in program.elements() {
        for_each_symbol_use(element, &mut |name, _| _ = first.entry(name.to_owned()).or_insert(id));
    }
    first
}

impl Lowering<'_> {
    /// Presets the accumulators of TOF timers at their first execution.
    ///
    /// Every element is executed in every scan, so this is in the first scan. If no earlier element uses the
    /// accumulator, the preset is done before all rungs.
    pub(super) fn preset_off_delays(&mut self) {
        if self.keep_modules {
            return;
        }
        let first = first_uses(self.program);
        let (mut early, mut late) = (Vec::new(), false);
        for (id, element, _) in self.program.elements() {
            let Element::Timer { kind: TimerKind::Tof, name, delay, adjust } = element else { continue };
            let Some(limit) = timer_scans(self.program, delay, adjust.as_ref()) else { continue };
            if first.get(name) == Some(&id) {
                early.push(IrOp::Move { dst: self.word(name), src: WordOperand::Const(limit) });
                self.preset.push(id);
            } else {
                late = true;
            }
        }
        if early.is_empty() && !late {
            return;
        }
        let bit = self.new_bit("scanned".to_owned(), BitRole::Memory);
        let done = IrOp::SetBit { bit, value: true };
        if late {
            self.after_first_scan = Some(bit);
            self.ir.epilogue.push(done);
        } else {
            early.push(done);
        }
        if !early.is_empty() {
            self.ir.prologue.push(IrOp::If { cond: BranchCondition::Bit(bit), if_true: Vec::new(), if_false: early });
        }
    }

    /// Lowers a TON, TOF or RTO.
    pub(super) fn timer(&mut self, kind: TimerKind, name: &str, delay: &LadderOperand, adjust: Option<&LadderOperand>) {
        let word = self.word(name);
        // The checks refuse a timer without a valid count.
        let Some(limit) = timer_scans(self.program, delay, adjust) else { return };
        if self.keep_modules {
            return self.push(IrOp::Module {
                module: TimedModule::Timer(kind),
                word,
                limit: WordOperand::Const(limit),
            });
        }
        let running =
            BranchCondition::Compare(WordComparison { a: word, rel: RelationOp::Lt, b: WordOperand::Const(limit) });
        let count = step_word(word, ArithmeticOp::Add);
        let clear = IrOp::Move { dst: word, src: WordOperand::Const(0) };
        match kind {
            TimerKind::Ton => self.push(IrOp::If {
                cond: BranchCondition::Acc,
                if_true: vec![IrOp::If {
                    cond: running,
                    if_true: vec![count, IrOp::SetAccumulator(false)],
                    if_false: vec![],
                }],
                if_false: vec![clear],
            }),
            TimerKind::Tof => {
                if let Some(scanned) = self.after_first_scan.filter(|_| !self.preset.contains(&self.element)) {
                    let preset = IrOp::Move { dst: word, src: WordOperand::Const(limit) };
                    self.push(IrOp::If {
                        cond: BranchCondition::Bit(scanned),
                        if_true: vec![],
                        if_false: vec![preset],
                    });
                }
                self.push(IrOp::If {
                    cond: BranchCondition::Acc,
                    if_true: vec![clear],
                    if_false: vec![IrOp::If {
                        cond: running,
                        if_true: vec![count, IrOp::SetAccumulator(true)],
                        if_false: vec![],
                    }],
                });
            }
            TimerKind::Rto => self.push(IrOp::If {
                cond: running,
                if_true: vec![if_accumulator(vec![count]), IrOp::SetAccumulator(false)],
                if_false: vec![IrOp::SetAccumulator(true)],
            }),
        }
    }

    /// Lowers a CTU, CTD or CTC.
    pub(super) fn counter(
        &mut self,
        kind: CounterKind,
        name: &str,
        max: &LadderOperand,
        (init, input): (Option<&LadderOperand>, Option<char>),
    ) {
        let word = self.word(name);
        let (n, max) = (WordOperand::Cell(word), self.value(max));
        let input = input.unwrap_or('/');
        if self.keep_modules {
            let is = TimedModule::Counter { kind, input, bounded: self.bounded_counters };
            return self.push(IrOp::Module { module: is, word, limit: max });
        }
        let count_ops = match kind {
            CounterKind::Ctu if self.bounded_counters => {
                self.if_comparison(CompareOp::Les, n, max, vec![step_word(word, ArithmeticOp::Add)], Vec::new())
            }
            CounterKind::Ctu => vec![step_word(word, ArithmeticOp::Add)],
            CounterKind::Ctd if self.bounded_counters => {
                self.if_comparison(CompareOp::Grt, n, max, vec![step_word(word, ArithmeticOp::Sub)], Vec::new())
            }
            CounterKind::Ctd => vec![step_word(word, ArithmeticOp::Sub)],
            CounterKind::Ctc => {
                // A CTC restarts at its own start value, whatever another counter with its name has.
                let back = IrOp::Move { dst: word, src: WordOperand::Const(start_value(init)) };
                self.if_comparison(CompareOp::Geq, n, max, vec![back], vec![step_word(word, ArithmeticOp::Add)])
            }
        };
        self.count(input, count_ops, kind == CounterKind::Ctc);
        let out = match kind {
            CounterKind::Ctc => return,
            CounterKind::Ctd if self.bounded_counters => self.and_comparison(CompareOp::Grt, n, max),
            CounterKind::Ctu | CounterKind::Ctd => self.and_comparison(CompareOp::Geq, n, max),
        };
        self.push(IrOp::SetAccumulator(true));
        out.into_iter().for_each(|op| self.push(op));
    }

    /// Executes `count_ops` if the counter counts. Afterwards the rung state is unchanged if `keep`, else
    /// arbitrary.
    fn count(&mut self, input: char, count_ops: Vec<IrOp>, keep: bool) {
        match input {
            '-' => self.push(if_accumulator(count_ops)),
            'o' => self.push(IrOp::If { cond: BranchCondition::Acc, if_true: Vec::new(), if_false: count_ops }),
            edge => {
                let memory = self.new_memory();
                self.push(if edge == '\\' { IrOp::Falling(memory) } else { IrOp::Rising(memory) });
                self.push(if_accumulator(count_ops));
                if keep {
                    // The edge memory now holds the rung state of this scan.
                    self.push(IrOp::Load { bit: memory, negated: false });
                }
            }
        }
    }
}
