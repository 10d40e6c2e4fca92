//! Lowers timers and counters.

use std::collections::HashMap;

use ladder::symbols::for_each_symbol_use;
use ladder::{
    CompareOp, CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LdFormat, ProgramElement,
    TimerKind,
};

use super::{Lowering, if_accumulator, step_word};
use crate::ir::{ArithmeticOp, BitRole, BranchCondition, IrOp, TimedModule, WordId, WordOperand};

/// The number of scans that a timer counts: delay / cycle, truncated, plus its adjust; `None` beyond 32 bits,
/// below 1 in dialect 2.3, or where delay or adjust are no constants. Without an adjust it is -1, as in
/// release 2.3, but 0 in LDmicro 5's own files.
#[must_use]
pub fn timer_scans(program: &LadderProgram, delay: &LadderOperand, adjust: Option<&LadderOperand>) -> Option<i32> {
    let LadderOperand::Const { value: delay, .. } = delay else { return None };
    let adjust = match adjust {
        Some(LadderOperand::Const { value, .. }) => *value,
        Some(LadderOperand::Var(_)) => return None,
        None if program.dialect == LadderDialect::Ldmicro5 && program.format == LdFormat::V02 => 0,
        None => -1,
    };
    let (delay, cycle) = (i128::from(u64::try_from(*delay).ok()?), i128::from(program.settings.cycle_us));
    let scans = match program.dialect {
        LadderDialect::Ldmicro23 => delay.checked_div(cycle)? + i128::from(adjust),
        // One division of the whole: below 0 it is cut towards 0.
        LadderDialect::Ldmicro5 | LadderDialect::Iec => (delay + i128::from(adjust) * cycle).checked_div(cycle)?,
    };
    let scans = i32::try_from(scans).ok()?;
    (scans >= 1 || program.dialect == LadderDialect::Ldmicro5).then_some(scans)
}

/// What the counters of one name start with.
#[derive(Debug, Clone, Default)]
pub(super) struct CounterStart {
    /// At power-up: the constant of the last counter that has one.
    pub power_up: i32,
    /// What RES stores: the start of the first CTU of the name, or else CTD, CTC, CTR.
    pub reset: Option<(u8, LadderOperand)>,
}

/// The start values of the counters and, in `ldmicro-5`, of the TOF timers, by name.
pub(super) fn counter_starts(program: &LadderProgram) -> HashMap<&str, CounterStart> {
    let mut starts: HashMap<&str, CounterStart> = HashMap::new();
    for ProgramElement { element, .. } in program.elements() {
        // At power-up LDmicro 5 writes these in order of the text too.
        if let Element::Timer { kind: TimerKind::Tof, name, delay, adjust } = element
            && program.dialect == LadderDialect::Ldmicro5
        {
            let start = starts.entry(name.as_str()).or_default();
            start.power_up = tof_start(program, delay, adjust.as_ref()).unwrap_or(0);
        }
        let Element::Counter { kind, name, init, .. } = element else { continue };
        let start = starts.entry(name.as_str()).or_default();
        let rank = match kind {
            CounterKind::Ctu => 0,
            CounterKind::Ctd => 1,
            CounterKind::Ctc => 2,
            CounterKind::Ctr => 3,
        };
        let own = init.clone().unwrap_or(LadderOperand::Const { value: 0, text: String::new() });
        if let LadderOperand::Const { value, .. } = own {
            start.power_up = value as i32;
        }
        // LDmicro 5 knows a counter by the first letter of its name.
        if name.starts_with('C') && start.reset.as_ref().is_none_or(|(first, _)| rank < *first) {
            start.reset = Some((rank, own));
        }
    }
    starts
}

/// The element of each integer that uses it first in a scan.
fn first_uses(program: &LadderProgram) -> HashMap<String, ElementId> {
    let mut first = HashMap::new();
    for ProgramElement { id, element, .. } in program.elements() {
        for_each_symbol_use(element, &mut |name, _| _ = first.entry(name.to_owned()).or_insert(id));
    }
    first
}

/// What a TOF starts with: its P, or -1 where its delay is a variable.
fn tof_start(program: &LadderProgram, delay: &LadderOperand, adjust: Option<&LadderOperand>) -> Option<i32> {
    match delay {
        LadderOperand::Const { .. } => timer_scans(program, delay, adjust),
        LadderOperand::Var(_) => Some(-1),
    }
}

impl Lowering<'_> {
    /// Presets the accumulators of TOF timers at their first execution.
    ///
    /// Every element of release 2.3 is executed in every scan, so this is in the first scan. If no earlier
    /// element uses the accumulator, the preset is done before all rungs. In LDmicro 5 they have it from
    /// power-up on.
    pub(super) fn preset_off_delays(&mut self) {
        if self.keep_modules || self.program.dialect == LadderDialect::Ldmicro5 {
            return;
        }
        let first = first_uses(self.program);
        let (mut early, mut late) = (Vec::new(), false);
        for ProgramElement { id, element, .. } in self.program.elements() {
            let Element::Timer { kind: TimerKind::Tof, name, delay, adjust } = element else { continue };
            let Some(limit) = tof_start(self.program, delay, adjust.as_ref()) else { continue };
            if first.get(name) == Some(&id) {
                early.push(IrOp::Move { dst: self.word(name), src: WordOperand::Const(limit) });
                self.preset_timers.push(id);
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

    /// Lowers a timer.
    pub(super) fn timer(&mut self, kind: TimerKind, name: &str, delay: &LadderOperand, adjust: Option<&LadderOperand>) {
        let word = self.word(name);
        let limit = match delay {
            // LDmicro 5 does not know what to do with these, and takes -1 for P.
            LadderOperand::Var(_) if matches!(kind, TimerKind::Rto | TimerKind::Rtl) => WordOperand::Const(-1),
            LadderOperand::Var(_) => self.value(delay),
            // A timer that cannot be counted was refused before.
            LadderOperand::Const { .. } => match timer_scans(self.program, delay, adjust) {
                Some(limit) => WordOperand::Const(limit),
                None => return,
            },
        };
        if self.keep_modules {
            return self.push(IrOp::Module { module: TimedModule::Timer(kind), word, limit });
        }
        let count = vec![step_word(word, ArithmeticOp::Add)];
        let clear = IrOp::Move { dst: word, src: WordOperand::Const(0) };
        match kind {
            TimerKind::Ton => {
                let run = self.while_running(word, limit, [count, vec![IrOp::SetAccumulator(false)]].concat(), vec![]);
                self.push(IrOp::If { cond: BranchCondition::Acc, if_true: run, if_false: vec![clear] });
            }
            TimerKind::Tof => {
                if let Some(scanned) = self.after_first_scan.filter(|_| !self.preset_timers.contains(&self.element)) {
                    let start = tof_start(self.program, delay, adjust).unwrap_or(-1);
                    let preset = IrOp::Move { dst: word, src: WordOperand::Const(start) };
                    self.push(IrOp::If {
                        cond: BranchCondition::Bit(scanned),
                        if_true: vec![],
                        if_false: vec![preset],
                    });
                }
                let run = self.while_running(word, limit, [count, vec![IrOp::SetAccumulator(true)]].concat(), vec![]);
                self.push(IrOp::If { cond: BranchCondition::Acc, if_true: vec![clear], if_false: run });
            }
            TimerKind::Rto | TimerKind::Rtl => {
                let counts = match kind {
                    TimerKind::Rto => if_accumulator(count),
                    _ => IrOp::If { cond: BranchCondition::Acc, if_true: vec![], if_false: count },
                };
                let runs = vec![counts, IrOp::SetAccumulator(false)];
                let ops = self.while_running(word, limit, runs, vec![IrOp::SetAccumulator(true)]);
                self.push_all(ops);
            }
            TimerKind::Tcy => {
                let phase = self.new_memory();
                let toggle = IrOp::If {
                    cond: BranchCondition::Bit(phase),
                    if_true: vec![IrOp::SetBit { bit: phase, value: false }],
                    if_false: vec![IrOp::SetBit { bit: phase, value: true }],
                };
                let mut run = self.while_running(word, limit, count, vec![clear.clone(), toggle]);
                run.push(IrOp::Load { bit: phase, negated: false });
                self.push(IrOp::If { cond: BranchCondition::Acc, if_true: run, if_false: vec![clear] });
            }
            TimerKind::Thi => {
                let pulse = self.new_memory();
                self.push(if_accumulator(vec![IrOp::SetBit { bit: pulse, value: true }]));
                let over = IrOp::If {
                    cond: BranchCondition::Acc,
                    if_true: vec![IrOp::SetAccumulator(false)],
                    if_false: vec![clear, IrOp::SetBit { bit: pulse, value: false }],
                };
                let run =
                    self.while_running(word, limit, [count, vec![IrOp::SetAccumulator(true)]].concat(), vec![over]);
                self.push(IrOp::If {
                    cond: BranchCondition::Bit(pulse),
                    if_true: run,
                    if_false: vec![IrOp::SetAccumulator(false)],
                });
            }
            TimerKind::Tlo => {
                let (pulse, armed) = (self.new_memory(), self.new_bit(self.element_name("armed"), BitRole::Memory));
                let begin = IrOp::If {
                    cond: BranchCondition::Bit(armed),
                    if_true: vec![IrOp::SetBit { bit: pulse, value: true }],
                    if_false: vec![],
                };
                self.push(IrOp::If {
                    cond: BranchCondition::Acc,
                    if_true: vec![IrOp::SetBit { bit: armed, value: true }],
                    if_false: vec![begin],
                });
                let over = vec![
                    if_accumulator(vec![clear, IrOp::SetBit { bit: pulse, value: false }]),
                    IrOp::SetAccumulator(true),
                ];
                let run = self.while_running(word, limit, [count, vec![IrOp::SetAccumulator(false)]].concat(), over);
                self.push(IrOp::If {
                    cond: BranchCondition::Bit(pulse),
                    if_true: run,
                    if_false: vec![IrOp::Load { bit: armed, negated: false }],
                });
            }
        }
    }

    /// One list of operations while a timer counts, another from when it has expired.
    fn while_running(&self, word: WordId, limit: WordOperand, runs: Vec<IrOp>, over: Vec<IrOp>) -> Vec<IrOp> {
        self.if_comparison(CompareOp::Les, WordOperand::Cell(word), limit, runs, over)
    }

    /// Lowers a counter of any kind.
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
        let start = init.map_or(WordOperand::Const(0), |init| self.value(init));
        if let WordOperand::Cell(_) = start {
            // A start value that is a variable is taken over the first time.
            let loaded = self.new_bit(self.element_name("loaded"), BitRole::Memory);
            let load = vec![IrOp::Move { dst: word, src: start }, IrOp::SetBit { bit: loaded, value: true }];
            self.push(IrOp::If { cond: BranchCondition::Bit(loaded), if_true: vec![], if_false: load });
        }
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
            CounterKind::Ctc if !self.bounded_counters => {
                let back = IrOp::Move { dst: word, src: WordOperand::Const(0) };
                self.if_comparison(CompareOp::Geq, n, max, vec![back], vec![step_word(word, ArithmeticOp::Add)])
            }
            CounterKind::Ctc | CounterKind::Ctr => {
                return self.count_around(kind, (word, max), start, input);
            }
        };
        self.count(input, count_ops, kind == CounterKind::Ctc);
        let out = match kind {
            CounterKind::Ctc | CounterKind::Ctr => return,
            CounterKind::Ctd if self.bounded_counters => self.and_comparison(CompareOp::Grt, n, max),
            CounterKind::Ctu | CounterKind::Ctd => self.and_comparison(CompareOp::Geq, n, max),
        };
        self.push(IrOp::SetAccumulator(true));
        self.push_all(out);
    }

    /// LDmicro 5's circular counters: past the limit they go back to their own start value, and give a carry
    /// for one scan.
    fn count_around(&mut self, kind: CounterKind, (word, max): (WordId, WordOperand), start: WordOperand, input: char) {
        let (step, past) = match kind {
            CounterKind::Ctr => (ArithmeticOp::Sub, CompareOp::Les),
            CounterKind::Ctu | CounterKind::Ctd | CounterKind::Ctc => (ArithmeticOp::Add, CompareOp::Grt),
        };
        let carry = vec![IrOp::Move { dst: word, src: start }, IrOp::SetAccumulator(true)];
        let mut ops = vec![step_word(word, step)];
        ops.extend(self.if_comparison(past, WordOperand::Cell(word), max, carry, vec![IrOp::SetAccumulator(false)]));
        match input {
            '-' => self.push(if_accumulator(ops)),
            'o' => self.push(IrOp::If {
                cond: BranchCondition::Acc,
                if_true: vec![IrOp::SetAccumulator(false)],
                if_false: ops,
            }),
            edge => {
                let memory = self.new_memory();
                self.push(if edge == '\\' { IrOp::Falling(memory) } else { IrOp::Rising(memory) });
                self.push(if_accumulator(ops));
            }
        }
    }

    /// Executes `count_ops` when the rung state counts by the kind of input. Afterwards the rung state is
    /// what it was if `keep`, otherwise undefined.
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
