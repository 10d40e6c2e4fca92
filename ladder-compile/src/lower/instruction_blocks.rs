//! Lowers calls of standard function blocks: section 6.5 of `docs/semantics.md`.
//!
//! Blocks test and set bits without the accumulator, so a BOOL result survives a call. Only inputs and
//! outputs go through the accumulator.

use ladder::CompareOp;
use ladder::il::{BlockCall, IecType, IlSource, StandardBlock};

use super::Lowering;
use crate::ir::{ArithmeticOp, BitId, BitRole, BranchCondition, IrOp, WordId, WordOperand};

/// The bits and words of an instance. A part that the block does not have has a cell of its own, unused.
struct BlockInstance<'a> {
    call: &'a BlockCall,
}

impl BlockInstance<'_> {
    fn bit(&self, lower: &mut Lowering<'_>, part: &str) -> BitId {
        lower.symbol_bit(&format!("{}.{part}", self.call.instance))
    }

    fn word(&self, lower: &mut Lowering<'_>, part: &str) -> WordId {
        lower.word(&format!("{}.{part}", self.call.instance))
    }

    /// M or M2.
    fn memory(&self, lower: &mut Lowering<'_>, name: &str) -> BitId {
        lower.named_bit(&format!("{name} of {}", self.call.instance), BitRole::Memory)
    }
}

impl Lowering<'_> {
    /// Writes the inputs, executes the block, copies the outputs. The current result stays.
    pub(super) fn call_block(&mut self, call: &BlockCall, before: Option<&IecType>) {
        let is_bit = |iec_type: &IecType| *iec_type == IecType::Bool;
        let uses_accumulator =
            call.inputs.iter().any(|(part, source)| is_bit(&part.iec_type) && *source != IlSource::Result)
                || call.outputs.iter().any(|output| is_bit(&output.part.iec_type));
        let takes_result = call.inputs.iter().any(|(_, source)| *source == IlSource::Result);
        if call.inputs.iter().any(|(part, source)| is_bit(&part.iec_type) && *source == IlSource::Result) {
            self.result_to_bit(before);
        }
        let keeps = uses_accumulator && (takes_result || self.result_is_used());
        let kept = keeps.then(|| self.named_bit("kept result", BitRole::Temporary));
        if let Some(bit) = kept {
            self.push(IrOp::Store { bit, negated: false });
        }
        for (part, source) in &call.inputs {
            if is_bit(&part.iec_type) {
                let bit = self.symbol_bit(&part.name);
                match (source, kept) {
                    (IlSource::Result, Some(bit)) => self.push(IrOp::Load { bit, negated: false }),
                    (IlSource::Result, None) => {}
                    _ => {
                        let from = self.bit_source(source);
                        self.load_bit(from, false);
                    }
                }
                self.push(IrOp::Store { bit, negated: false });
            } else {
                let dst = self.word(&part.name);
                let src = self.number(source, before, &part.iec_type, "input");
                self.push(IrOp::Move { dst, src });
            }
        }
        self.execute_block(call);
        for output in &call.outputs {
            if is_bit(&output.part.iec_type) {
                let (from, to) = (self.symbol_bit(&output.part.name), self.symbol_bit(&output.target.name));
                self.push(IrOp::Load { bit: from, negated: output.negated });
                self.push(IrOp::Store { bit: to, negated: false });
            } else {
                let (from, dst) = (self.word(&output.part.name), self.word(&output.target.name));
                let src = self.convert_number(from, &output.part.iec_type, &output.target.iec_type, "output");
                self.push(IrOp::Move { dst, src });
                if output.negated {
                    self.math(ArithmeticOp::Xor, dst, dst.into(), WordOperand::Const(-1));
                }
            }
        }
        if let Some(bit) = kept.filter(|_| self.result_is_used()) {
            self.push(IrOp::Load { bit, negated: false });
        }
    }

    fn execute_block(&mut self, call: &BlockCall) {
        let instance = BlockInstance { call };
        match call.block {
            StandardBlock::Ton => self.on_delay(&instance),
            StandardBlock::Tof => self.off_delay(&instance),
            StandardBlock::Tp => self.pulse(&instance),
            StandardBlock::Tona => self.retentive_on_delay(&instance),
            StandardBlock::Tofa => self.retentive_off_delay(&instance),
            StandardBlock::Ctu => self.count_one_way(&instance, true),
            StandardBlock::Ctd => self.count_one_way(&instance, false),
            StandardBlock::Ctud => self.count_up_and_down(&instance),
            StandardBlock::RTrig | StandardBlock::FTrig => self.edge(&instance),
            StandardBlock::Sr | StandardBlock::Rs => self.bistable(&instance),
        }
    }

    fn set(&mut self, bit: BitId, value: bool) {
        self.push(IrOp::SetBit { bit, value });
    }

    fn assign(&mut self, dst: WordId, src: impl Into<WordOperand>) {
        self.push(IrOp::Move { dst, src: src.into() });
    }

    /// Executes one of two bodies.
    fn branch(&mut self, bit: BitId, then: impl FnOnce(&mut Self), otherwise: impl FnOnce(&mut Self)) {
        let (if_true, if_false) = (self.captured(then), self.captured(otherwise));
        self.push(IrOp::If { cond: BranchCondition::Bit(bit), if_true, if_false });
    }

    /// Executes one of two bodies by a comparison of numbers with sign.
    fn branch_on(
        &mut self,
        op: CompareOp,
        a: impl Into<WordOperand>,
        b: impl Into<WordOperand>,
        then: impl FnOnce(&mut Self),
        otherwise: impl FnOnce(&mut Self),
    ) {
        let (then, otherwise) = (self.captured(then), self.captured(otherwise));
        let ops = self.if_comparison(op, a.into(), b.into(), then, otherwise);
        self.push_all(ops);
    }

    /// The time of the scan in milliseconds (I26), which the end of each scan advances.
    fn now(&mut self) -> WordId {
        self.named_word("scan time", 4, |this, now| {
            let cycle = WordOperand::Const((this.program.settings.cycle_us / 1000) as i32);
            this.ir.epilogue.push(IrOp::Math { op: ArithmeticOp::Add, dst: now, a: now.into(), b: cycle });
        })
    }

    /// S := now.
    fn start(&mut self, instance: &BlockInstance<'_>) {
        let (start, now) = (self.start_time(instance), self.now());
        self.assign(start, now);
    }

    fn start_time(&mut self, instance: &BlockInstance<'_>) -> WordId {
        self.named_word(&format!("S of {}", instance.call.instance), 4, |_, _| ())
    }

    /// P: PT, or 0 if PT is negative.
    fn preset(&mut self, instance: &BlockInstance<'_>) -> WordId {
        let (preset, given) = (self.temporary("P", 4), instance.word(self, "PT"));
        self.assign(preset, given);
        self.branch_on(CompareOp::Les, preset, 0, |this| this.assign(preset, 0), |_| ());
        preset
    }

    /// Puts now - S + `more`, or P if that is smaller, into ET; from P on, also executes `over`. Times from
    /// 2^31 on are negative here, and no P is as long.
    fn elapse(&mut self, instance: &BlockInstance<'_>, more: Option<WordId>, over: impl FnOnce(&mut Self)) {
        let (preset, elapsed) = (self.preset(instance), instance.word(self, "ET"));
        let (time, now, start) = (self.temporary("elapsed", 4), self.now(), self.start_time(instance));
        self.math(ArithmeticOp::Sub, time, now.into(), start.into());
        let before = self.captured(|this| this.assign(elapsed, time));
        let over = self.captured(|this| {
            this.assign(elapsed, preset);
            over(this);
        });
        let is_before = self.if_comparison(CompareOp::Les, time.into(), preset.into(), before, over.clone());
        let mut inside = match more {
            Some(more) => {
                let sum = IrOp::Math { op: ArithmeticOp::Add, dst: time, a: time.into(), b: more.into() };
                let checked = self.if_comparison(CompareOp::Les, time.into(), 0.into(), over.clone(), is_before);
                [vec![sum], checked].concat()
            }
            None => is_before,
        };
        inside = self.if_comparison(CompareOp::Les, time.into(), 0.into(), over, inside);
        self.push_all(inside);
    }

    fn on_delay(&mut self, instance: &BlockInstance<'_>) {
        let [input, output] = ["IN", "Q"].map(|part| instance.bit(self, part));
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        let begin = |this: &mut Self| {
            this.set(memory, true);
            this.start(instance);
            this.assign(elapsed, 0);
            let preset = this.preset(instance);
            this.branch_on(CompareOp::Equ, preset, 0, |this| this.set(output, true), |this| this.set(output, false));
        };
        let run = |this: &mut Self| {
            let wait = |this: &mut Self| this.elapse(instance, None, |this| this.set(output, true));
            this.branch(output, |_| (), wait);
        };
        let stop = |this: &mut Self| {
            this.set(memory, false);
            this.assign(elapsed, 0);
            this.set(output, false);
        };
        self.branch(input, |this| this.branch(memory, run, begin), stop);
    }

    fn off_delay(&mut self, instance: &BlockInstance<'_>) {
        let [input, output] = ["IN", "Q"].map(|part| instance.bit(self, part));
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        let on = |this: &mut Self| {
            this.set(output, true);
            this.assign(elapsed, 0);
            this.set(memory, false);
        };
        let wait = |this: &mut Self| {
            this.branch(
                memory,
                |_| (),
                |this| {
                    this.set(memory, true);
                    this.start(instance);
                },
            );
            this.elapse(instance, None, |this| {
                this.set(output, false);
                this.set(memory, false);
            });
        };
        self.branch(input, on, |this| this.branch(output, wait, |_| ()));
    }

    fn pulse(&mut self, instance: &BlockInstance<'_>) {
        let [input, output] = ["IN", "Q"].map(|part| instance.bit(self, part));
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        let run = |this: &mut Self| this.elapse(instance, None, |this| this.set(output, false));
        let begin = |this: &mut Self| {
            this.set(memory, true);
            this.start(instance);
            this.assign(elapsed, 0);
            let preset = this.preset(instance);
            this.branch_on(CompareOp::Grt, preset, 0, |this| this.set(output, true), |this| this.set(output, false));
        };
        let rest = |this: &mut Self| this.branch(input, |this| this.branch(memory, |_| (), begin), |_| ());
        self.branch(output, run, rest);
        let clear = |this: &mut Self| {
            this.set(memory, false);
            this.assign(elapsed, 0);
        };
        self.branch(output, |_| (), |this| this.branch(input, |_| (), clear));
    }

    /// ET runs on from where it is; then `M := TRUE, S := now`.
    fn accumulate(&mut self, instance: &BlockInstance<'_>) {
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        self.branch_on(CompareOp::Les, elapsed, 0, |this| this.assign(elapsed, 0), |_| ());
        let run = |this: &mut Self| this.elapse(instance, Some(elapsed), |_| ());
        self.branch(memory, run, |_| ());
        self.set(memory, true);
        self.start(instance);
    }

    fn retentive_on_delay(&mut self, instance: &BlockInstance<'_>) {
        let [input, reset, output] = ["IN", "R", "Q"].map(|part| instance.bit(self, part));
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        let clear = |this: &mut Self| {
            this.set(memory, false);
            this.assign(elapsed, 0);
            this.set(output, false);
        };
        let run = |this: &mut Self| {
            this.accumulate(instance);
            let preset = this.preset(instance);
            this.branch_on(CompareOp::Geq, elapsed, preset, |this| this.set(output, true), |_| ());
        };
        self.branch(reset, clear, |this| this.branch(input, run, |this| this.set(memory, false)));
    }

    fn retentive_off_delay(&mut self, instance: &BlockInstance<'_>) {
        let [input, reset, output] = ["IN", "R", "Q"].map(|part| instance.bit(self, part));
        let (memory, elapsed) = (instance.memory(self, "M"), instance.word(self, "ET"));
        let clear = |this: &mut Self| {
            this.set(memory, false);
            this.assign(elapsed, 0);
            this.branch(input, |this| this.set(output, true), |this| this.set(output, false));
        };
        let on = |this: &mut Self| {
            this.set(memory, false);
            this.set(output, true);
        };
        let run = |this: &mut Self| {
            this.accumulate(instance);
            let preset = this.preset(instance);
            let end = |this: &mut Self| {
                this.set(output, false);
                this.set(memory, false);
            };
            this.branch_on(CompareOp::Geq, elapsed, preset, end, |_| ());
        };
        let off = |this: &mut Self| this.branch(output, run, |_| ());
        self.branch(reset, clear, |this| this.branch(input, on, off));
    }

    /// Where the input is at the level: found := not memory, memory := 1. Else both := 0.
    fn find_edge(&mut self, input: BitId, level: bool, memory: BitId, found: BitId) {
        let there = self.captured(|this| {
            let first = |this: &mut Self| {
                this.set(found, true);
                this.set(memory, true);
            };
            this.branch(memory, |this| this.set(found, false), first);
        });
        let elsewhere = self.captured(|this| {
            this.set(found, false);
            this.set(memory, false);
        });
        let (if_true, if_false) = if level { (there, elsewhere) } else { (elsewhere, there) };
        self.push(IrOp::If { cond: BranchCondition::Bit(input), if_true, if_false });
    }

    /// One more or one less, up to the bound.
    fn step_within(&mut self, count: WordId, up: bool) {
        let (op, bound) = if up { (ArithmeticOp::Add, 32_767) } else { (ArithmeticOp::Sub, -32_768) };
        let step = |this: &mut Self| this.math(op, count, count.into(), WordOperand::Const(1));
        self.branch_on(CompareOp::Neq, count, bound, step, |_| ());
    }

    /// bit := the comparison.
    fn set_by(&mut self, bit: BitId, op: CompareOp, a: WordId, b: impl Into<WordOperand>) {
        self.branch_on(op, a, b, |this| this.set(bit, true), |this| this.set(bit, false));
    }

    /// CTU, or CTD with `up` false.
    fn count_one_way(&mut self, instance: &BlockInstance<'_>, up: bool) {
        let [input, load] = if up { ["CU", "R"] } else { ["CD", "LD"] }.map(|part| instance.bit(self, part));
        let ([preset, count], output) = (["PV", "CV"].map(|part| instance.word(self, part)), instance.bit(self, "Q"));
        let (memory, rises) = (instance.memory(self, "M"), self.named_bit("edge rises", BitRole::Temporary));
        self.find_edge(input, true, memory, rises);
        let step = |this: &mut Self| this.branch(rises, |this| this.step_within(count, up), |_| ());
        let loaded = if up { WordOperand::Const(0) } else { preset.into() };
        self.branch(load, |this| this.assign(count, loaded), step);
        if up {
            self.set_by(output, CompareOp::Geq, count, preset);
        } else {
            self.set_by(output, CompareOp::Leq, count, 0);
        }
    }

    fn count_up_and_down(&mut self, instance: &BlockInstance<'_>) {
        let [up, down, reset, load] = ["CU", "CD", "R", "LD"].map(|part| instance.bit(self, part));
        let [is_up, is_down] = ["QU", "QD"].map(|part| instance.bit(self, part));
        let [preset, count] = ["PV", "CV"].map(|part| instance.word(self, part));
        let [first, second] = ["M", "M2"].map(|name| instance.memory(self, name));
        let [rises, other] = ["edge rises", "other edge rises"].map(|name| self.named_bit(name, BitRole::Temporary));
        self.find_edge(up, true, first, rises);
        self.find_edge(down, true, second, other);
        let step = |this: &mut Self| {
            let alone = |this: &mut Self| this.branch(other, |_| (), |this| this.step_within(count, true));
            let not_up = |this: &mut Self| this.branch(other, |this| this.step_within(count, false), |_| ());
            this.branch(rises, alone, not_up);
        };
        let loaded = |this: &mut Self| this.branch(load, |this| this.assign(count, preset), step);
        self.branch(reset, |this| this.assign(count, 0), loaded);
        self.set_by(is_up, CompareOp::Geq, count, preset);
        self.set_by(is_down, CompareOp::Leq, count, 0);
    }

    fn edge(&mut self, instance: &BlockInstance<'_>) {
        let [input, output] = ["CLK", "Q"].map(|part| instance.bit(self, part));
        let memory = instance.memory(self, "M");
        self.find_edge(input, instance.call.block == StandardBlock::RTrig, memory, output);
    }

    fn bistable(&mut self, instance: &BlockInstance<'_>) {
        let output = instance.bit(self, "Q1");
        let sets = instance.call.block == StandardBlock::Sr;
        let [first, second] = if sets { ["S1", "R"] } else { ["R1", "S"] }.map(|part| instance.bit(self, part));
        let rest = |this: &mut Self| this.branch(second, |this| this.set(output, !sets), |_| ());
        self.branch(first, |this| this.set(output, sets), rest);
    }
}
