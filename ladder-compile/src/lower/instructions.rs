//! Lowers lines of Instruction List: section 6 of `docs/semantics.md`.
//!
//! A BOOL result is in the accumulator, any other in a temporary of its width. Where a network goes on with
//! the result of another one, the accumulator goes through a bit.

use std::collections::{HashMap, HashSet};

use ladder::il::{IecType, IecVariable, IlAction, IlBinaryOperator, IlCondition, IlSource, IlStep, TypedSymbol};
use ladder::{CompareOp, Element, ElementId, LadderProgram, ProgramElement, Rung, RungNode};

use super::{Lowering, if_accumulator};
use crate::ir::{ArithmeticOp, BitId, BitRole, BranchCondition, IrOp, WordId, WordOperand, WordRole};

/// What the lowering of Instruction List needs besides the cells of symbols.
#[derive(Debug, Default)]
pub(super) struct InstructionState {
    /// Lines whose result the next line uses.
    live: HashSet<ElementId>,
    /// For each rung: the first line that has an operation, whether it uses the result before it, and the
    /// type of that result.
    networks: Vec<NetworkStart>,
    /// Types of the results that wait for their `)`.
    saved: Vec<Option<IecType>>,
    /// Cells that are no symbols, by their descriptions: a program may give a symbol any name.
    bits: HashMap<String, BitId>,
    words: HashMap<String, WordId>,
}

/// How a network begins.
#[derive(Debug, Clone, Default)]
struct NetworkStart {
    /// True if the first line uses the current result, so that the network goes on with another one's.
    uses_result: bool,
    /// Type of the current result there.
    before: Option<IecType>,
}

impl InstructionState {
    /// The state at the start of a program.
    pub(super) fn new(program: &LadderProgram) -> InstructionState {
        let mut state = InstructionState::default();
        let lines: Vec<(ElementId, &IlStep)> = program
            .elements()
            .filter_map(|ProgramElement { id, element, .. }| match element {
                Element::Instruction(step) if !matches!(step.action, IlAction::Nothing) => Some((id, step.as_ref())),
                _ => None,
            })
            .collect();
        state.networks = vec![NetworkStart::default(); program.rungs.len()];
        for (id, step) in lines.iter().rev() {
            if let Some(start) = state.networks.get_mut(id.rung as usize) {
                *start = NetworkStart { uses_result: !step.is_load(), before: step.before.clone() };
            }
        }
        // Any network may be the one before one that uses its result.
        let is_passed = state.networks.iter().any(|start| start.uses_result);
        for pair in lines.windows(2) {
            let [(id, _), (next, step)] = pair else { continue };
            let is_used = if id.rung == next.rung { !step.is_load() } else { is_passed };
            if is_used {
                state.live.insert(*id);
            }
        }
        state
    }
}

/// Whether the type is BOOL, also of a result of which no path is known.
fn is_bool(iec_type: Option<&IecType>) -> bool {
    iec_type.is_none_or(|iec_type| *iec_type == IecType::Bool)
}

/// Width of a number in bytes; 0 of BOOL.
pub(super) fn width(iec_type: &IecType) -> u8 {
    (iec_type.bits() / 8) as u8
}

/// A constant as the signed number that has the bits of the type.
pub(super) fn constant_of(value: i64, iec_type: &IecType) -> i32 {
    let unused = 32 - iec_type.bits().clamp(1, 32);
    ((value << unused) as i32) >> unused
}

/// A bit: of a cell, or known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BitSource {
    /// The bit of a cell.
    Cell(BitId),
    /// A constant.
    Known(bool),
}

impl Lowering<'_> {
    /// Lowers a line.
    pub(super) fn instruction(&mut self, step: &IlStep) {
        let before = step.before.as_ref();
        match &step.action {
            IlAction::Nothing => {}
            IlAction::Load { negated, source, iec_type } => self.load_result(source, before, iec_type, *negated),
            IlAction::Store { negated, target } => self.store_result(*negated, target, before),
            IlAction::Set(target) => self.change_if_true(target, true, before),
            IlAction::Reset(target) => self.change_if_true(target, false, before),
            IlAction::Not { iec_type } if *iec_type == IecType::Bool => {
                self.result_to_bit(before);
                self.complement();
            }
            IlAction::Not { iec_type } => {
                let dst = self.take_result(before, iec_type);
                self.math(ArithmeticOp::Xor, dst, dst.into(), WordOperand::Const(-1));
            }
            IlAction::Binary { operator, negated, source, iec_type } if *iec_type == IecType::Bool => {
                let bit = self.bit_source(source);
                self.result_to_bit(before);
                self.combine_bit(*operator, *negated, bit);
            }
            IlAction::Binary { operator, negated, source, iec_type } => {
                let mut value = self.number(source, before, iec_type, "operand");
                if *negated {
                    value = self.complement_number(value, iec_type);
                }
                let dst = self.take_result(before, iec_type);
                self.combine(*operator, dst, dst.into(), value, iec_type);
            }
            IlAction::Open { source, iec_type } => self.open(before, source.as_ref(), iec_type.as_ref()),
            IlAction::Close { operator, negated, iec_type } => self.close(*operator, *negated, before, iec_type),
            IlAction::Jump { condition, target, .. } => self.jump(*condition, *target, before),
            IlAction::Return(condition) => self.jump(*condition, self.program.rungs.len() as u32, before),
            IlAction::Call { condition, call } => {
                let ops = self.captured(|this| this.call_block(call, before));
                self.conditionally(*condition, before, ops);
            }
            IlAction::Function(call) => self.function(call, before),
        }
    }

    /// At the start of a rung: takes the result that a network before it left.
    pub(super) fn begin_network(&mut self, rung: u32) {
        let start = self.instructions.networks.get(rung as usize).cloned().unwrap_or_default();
        if start.uses_result && is_bool(start.before.as_ref()) {
            let bit = self.passed_bit();
            self.push(IrOp::Load { bit, negated: false });
        } else {
            self.push(IrOp::SetAccumulator(false));
        }
    }

    /// At the end of a rung: leaves the result for the next one.
    pub(super) fn end_network(&mut self, rung: &Rung) {
        let last = rung.series.iter().rev().find_map(|node| match node {
            RungNode::Leaf(Element::Instruction(step), _) => Some(step),
            _ => None,
        });
        if let Some(after) = last.map(|step| step.after.clone()) {
            self.leave_result(after.as_ref(), self.element.rung + 1);
        }
    }

    /// Leaves the result, of this type, where the network at the start of a rung takes it: a number without
    /// type may have another width there, or be a BOOL. The result itself stays.
    fn leave_result(&mut self, from: Option<&IecType>, rung: u32) {
        let start = self.instructions.networks.get(rung as usize).cloned().unwrap_or_default();
        let Some(to) = start.before.filter(|_| start.uses_result) else { return };
        if to == IecType::Bool {
            self.result_to_bit(from);
            let bit = self.passed_bit();
            self.push(IrOp::Store { bit, negated: false });
        } else if let Some(from) = from.filter(|from| **from != IecType::Bool && width(from) != width(&to)) {
            let (word, dst) = (self.result_word(width(from)), self.result_word(width(&to)));
            let src = self.convert_number(word, from, &to, "left");
            self.push(IrOp::Move { dst, src });
        }
    }

    /// BOOL symbols that are TRUE at power-up.
    pub(super) fn set_initial_bits(&mut self) {
        let program = self.program;
        let is_set = |variable: &&IecVariable| variable.iec_type == IecType::Bool && variable.initial != 0;
        for variable in program.declarations.iter().filter(is_set) {
            let bit = self.symbol_bit(&variable.name);
            if let Some(cell) = self.ir.bits.get_mut(bit.0 as usize) {
                cell.initial = true;
            }
        }
    }

    fn passed_bit(&mut self) -> BitId {
        self.named_bit("current result", BitRole::Temporary)
    }

    /// A bit that is no symbol, by its description.
    pub(super) fn named_bit(&mut self, name: &str, role: BitRole) -> BitId {
        if let Some(&bit) = self.instructions.bits.get(name) {
            return bit;
        }
        let bit = self.new_bit(name.to_owned(), role);
        self.instructions.bits.insert(name.to_owned(), bit);
        bit
    }

    /// A word that is no symbol and keeps its value between scans, by its description; `begin` is called when
    /// it is new.
    pub(super) fn named_word(&mut self, name: &str, bytes: u8, begin: impl FnOnce(&mut Self, WordId)) -> WordId {
        if let Some(&word) = self.instructions.words.get(name) {
            return word;
        }
        let word = self.new_word_cell(name.to_owned(), WordRole::Memory, bytes, 0);
        self.instructions.words.insert(name.to_owned(), word);
        begin(self, word);
        word
    }

    /// The operations that `body` pushes.
    pub(super) fn captured(&mut self, body: impl FnOnce(&mut Self)) -> Vec<IrOp> {
        let kept = std::mem::take(&mut self.steps);
        body(self);
        std::mem::replace(&mut self.steps, kept).into_iter().map(|step| step.op).collect()
    }

    /// Executes operations on a condition of the current result.
    fn conditionally(&mut self, condition: IlCondition, before: Option<&IecType>, ops: Vec<IrOp>) {
        match condition {
            IlCondition::Always => self.push_all(ops),
            IlCondition::IfTrue => {
                self.condition_to_accumulator(before);
                self.push(if_accumulator(ops));
            }
            IlCondition::IfFalse => {
                self.condition_to_accumulator(before);
                self.push(IrOp::If { cond: BranchCondition::Acc, if_true: Vec::new(), if_false: ops });
            }
        }
    }

    /// The cell of a result of this width.
    pub(super) fn result_word(&mut self, bytes: u8) -> WordId {
        self.temporary("current result", bytes)
    }

    /// dst := a op b. `dst` may be `a`.
    pub(super) fn math(&mut self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) {
        self.push(IrOp::Math { op, dst, a, b });
    }

    /// acc := whether the current result is not 0.
    fn condition_to_accumulator(&mut self, before: Option<&IecType>) {
        if let Some(iec_type) = before.filter(|iec_type| !is_bool(Some(iec_type))) {
            let word = self.result_word(width(iec_type));
            self.compare_to_accumulator(CompareOp::Neq, word.into(), WordOperand::Const(0));
        }
    }

    /// acc := the comparison of numbers with sign.
    pub(super) fn compare_to_accumulator(&mut self, op: CompareOp, a: WordOperand, b: WordOperand) {
        self.push(IrOp::SetAccumulator(true));
        let ops = self.and_comparison(op, a, b);
        self.push_all(ops);
    }

    /// The current result becomes BOOL: its lowest bit (I13).
    pub(super) fn result_to_bit(&mut self, before: Option<&IecType>) {
        if let Some(iec_type) = before.filter(|iec_type| !is_bool(Some(iec_type))) {
            let word = self.result_word(width(iec_type));
            let lowest = self.temporary("lowest", 1);
            self.math(ArithmeticOp::And, lowest, word.into(), WordOperand::Const(1));
            self.compare_to_accumulator(CompareOp::Neq, lowest.into(), WordOperand::Const(0));
        }
    }

    /// The cell in which the current result is a number of the type.
    fn take_result(&mut self, before: Option<&IecType>, iec_type: &IecType) -> WordId {
        let dst = self.result_word(width(iec_type));
        let value = self.number(&IlSource::Result, before, iec_type, "taken");
        if value != WordOperand::Cell(dst) {
            self.push(IrOp::Move { dst, src: value });
        }
        dst
    }

    /// The bit of an operand.
    pub(super) fn bit_source(&mut self, source: &IlSource) -> BitSource {
        match source {
            IlSource::Constant(value) => BitSource::Known(value & 1 != 0),
            IlSource::Symbol(symbol) => BitSource::Cell(self.symbol_bit(&symbol.name)),
            // The accumulator goes through a bit.
            IlSource::Result => {
                let bit = self.named_bit("bit argument", BitRole::Temporary);
                self.push(IrOp::Store { bit, negated: false });
                BitSource::Cell(bit)
            }
        }
    }

    /// acc := a bit.
    pub(super) fn load_bit(&mut self, bit: BitSource, negated: bool) {
        self.push(match bit {
            BitSource::Cell(bit) => IrOp::Load { bit, negated },
            BitSource::Known(value) => IrOp::SetAccumulator(value != negated),
        });
    }

    fn load_result(&mut self, source: &IlSource, before: Option<&IecType>, iec_type: &IecType, negated: bool) {
        if *iec_type == IecType::Bool {
            let bit = self.bit_source(source);
            return self.load_bit(bit, negated);
        }
        let dst = self.result_word(width(iec_type));
        let src = self.number(source, before, iec_type, "operand");
        self.push(IrOp::Move { dst, src });
        if negated {
            self.math(ArithmeticOp::Xor, dst, dst.into(), WordOperand::Const(-1));
        }
    }

    fn store_result(&mut self, negated: bool, target: &TypedSymbol, before: Option<&IecType>) {
        if target.iec_type == IecType::Bool {
            self.result_to_bit(before);
            let bit = self.symbol_bit(&target.name);
            return self.push(IrOp::Store { bit, negated });
        }
        let dst = self.word(&target.name);
        let src = self.number(&IlSource::Result, before, &target.iec_type, "stored");
        self.push(IrOp::Move { dst, src });
        if negated {
            self.math(ArithmeticOp::Xor, dst, dst.into(), WordOperand::Const(-1));
        }
    }

    /// S and R.
    fn change_if_true(&mut self, target: &TypedSymbol, value: bool, before: Option<&IecType>) {
        self.condition_to_accumulator(before);
        let bit = self.symbol_bit(&target.name);
        self.push(if_accumulator(vec![IrOp::SetBit { bit, value }]));
    }

    /// acc := acc operator bit.
    pub(super) fn combine_bit(&mut self, operator: IlBinaryOperator, negated: bool, bit: BitSource) {
        use IlBinaryOperator as Op;
        let (and, negated) = match operator {
            Op::And => (true, negated),
            Op::Or => (false, negated),
            Op::Xor | Op::Ne | Op::Eq => {
                let is_equal = operator == Op::Eq;
                return self.exclusive_or(negated != is_equal, bit);
            }
            Op::Gt => (true, !negated),
            Op::Ge => (false, !negated),
            Op::Lt | Op::Le => {
                self.complement();
                (operator == Op::Lt, negated)
            }
            // The type check refuses arithmetic of BOOL.
            Op::Add | Op::Sub | Op::Mul | Op::Div | Op::Mod => return,
        };
        match (bit, and) {
            (BitSource::Cell(bit), true) => self.push(IrOp::And { bit, negated }),
            (BitSource::Cell(bit), false) => self.push(IrOp::Or { bit, negated }),
            (BitSource::Known(value), true) if value == negated => self.push(IrOp::SetAccumulator(false)),
            (BitSource::Known(value), false) if value != negated => self.push(IrOp::SetAccumulator(true)),
            (BitSource::Known(_), _) => {}
        }
    }

    fn exclusive_or(&mut self, negated: bool, bit: BitSource) {
        match bit {
            BitSource::Known(value) if value == negated => {}
            BitSource::Known(_) => self.complement(),
            BitSource::Cell(bit) => self.push(IrOp::If {
                cond: BranchCondition::Acc,
                if_true: vec![IrOp::Load { bit, negated: !negated }],
                if_false: vec![IrOp::Load { bit, negated }],
            }),
        }
    }

    /// `(`: the result is saved.
    fn open(&mut self, before: Option<&IecType>, source: Option<&IlSource>, iec_type: Option<&IecType>) {
        let name = format!("saved {}", self.instructions.saved.len());
        if is_bool(before) {
            let bit = self.named_bit(&name, BitRole::Temporary);
            self.push(IrOp::Store { bit, negated: false });
        } else if let Some(bytes) = before.map(width) {
            let (dst, src) = (self.temporary(&name, bytes), self.result_word(bytes));
            self.push(IrOp::Move { dst, src: src.into() });
        }
        self.instructions.saved.push(before.cloned());
        if let (Some(source), Some(iec_type)) = (source, iec_type) {
            self.load_result(source, before, iec_type, false);
        }
    }

    /// `)`: saved result operator result.
    fn close(&mut self, operator: IlBinaryOperator, negated: bool, inner: Option<&IecType>, iec_type: &IecType) {
        let Some(saved) = self.instructions.saved.pop() else { return };
        let name = format!("saved {}", self.instructions.saved.len());
        if *iec_type == IecType::Bool {
            self.result_to_bit(inner);
            if negated {
                self.complement();
            }
            let bit = self.saved_bit(&name, saved.as_ref());
            return self.combine_bit(mirrored(operator), false, bit);
        }
        let right = self.temporary("inner", width(iec_type));
        let value = self.number(&IlSource::Result, inner, iec_type, "taken");
        self.push(IrOp::Move { dst: right, src: value });
        if negated {
            self.math(ArithmeticOp::Xor, right, right.into(), WordOperand::Const(-1));
        }
        let dst = self.result_word(width(iec_type));
        let Some(saved) = saved.filter(|saved| *saved != IecType::Bool) else { return };
        let cell = self.temporary(&name, width(&saved));
        let left = self.convert_number(cell, &saved, iec_type, "taken");
        self.combine(operator, dst, left, right.into(), iec_type);
    }

    /// A saved result as a bit; the accumulator stays.
    fn saved_bit(&mut self, name: &str, saved: Option<&IecType>) -> BitSource {
        let bit = self.named_bit(name, BitRole::Temporary);
        if let Some(iec_type) = saved.filter(|saved| !is_bool(Some(saved))) {
            let (word, lowest) = (self.temporary(name, width(iec_type)), self.temporary("lowest", 1));
            self.math(ArithmeticOp::And, lowest, word.into(), WordOperand::Const(1));
            let set = |value| vec![IrOp::SetBit { bit, value }];
            let ops = self.if_comparison(CompareOp::Neq, lowest.into(), WordOperand::Const(0), set(true), set(false));
            self.push_all(ops);
        }
        BitSource::Cell(bit)
    }

    /// JMP and RET: to the start of a rung, or to the end.
    fn jump(&mut self, condition: IlCondition, target: u32, before: Option<&IecType>) {
        let Some((jump, is_back)) = self.jump_to_rung(target) else { return };
        self.leave_result(before, target);
        if condition == IlCondition::Always {
            return self.push_all(jump);
        }
        let is_live = self.instructions.live.contains(&self.element);
        self.condition_to_accumulator(before);
        // A jump back may not be taken although its condition holds.
        let kept = (is_back && is_live).then(|| self.named_bit("kept result", BitRole::Temporary));
        if let Some(bit) = kept {
            self.push(IrOp::Store { bit, negated: false });
        }
        let (if_true, if_false) =
            if condition == IlCondition::IfTrue { (jump, Vec::new()) } else { (Vec::new(), jump) };
        self.push(IrOp::If { cond: BranchCondition::Acc, if_true, if_false });
        self.push(match kept {
            Some(bit) => IrOp::Load { bit, negated: false },
            None => IrOp::SetAccumulator(condition == IlCondition::IfFalse),
        });
    }

    /// Whether the next line uses the result of this one.
    pub(super) fn result_is_used(&self) -> bool {
        self.instructions.live.contains(&self.element)
    }
}

/// The operator with its operands in the other order.
fn mirrored(operator: IlBinaryOperator) -> IlBinaryOperator {
    use IlBinaryOperator as Op;
    match operator {
        Op::Gt => Op::Lt,
        Op::Ge => Op::Le,
        Op::Lt => Op::Gt,
        Op::Le => Op::Ge,
        same => same,
    }
}
