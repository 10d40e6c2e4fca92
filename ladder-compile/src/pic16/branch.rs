//! Selects branches between lists of operations, and places the accumulator where both paths agree.

use emu_pic16::isa::Pic16OpKind;

use super::logic::GuardedInstruction;
use super::rung_formula::{BitLiteral, RungFormula};
use super::select::Pic16Selector;
use super::touched_cells::{self, TouchedCells};
use super::writer::Pic16Item;
use crate::ir::{BranchCondition, IrOp};

impl Pic16Selector<'_, '_> {
    /// Selects code that executes one of two lists.
    pub(super) fn branch(
        &mut self,
        cond: BranchCondition,
        then: &[IrOp],
        otherwise: &[IrOp],
        rest: &[&IrOp],
        live: bool,
        target: Option<BitLiteral>,
    ) {
        let needed = touched_cells::is_accumulator_read(rest, live);
        let mut touched = TouchedCells::default();
        touched.list(then);
        touched.list(otherwise);
        let changes = touched.acc;
        self.compute_before_branch(&touched);
        let e = match cond {
            BranchCondition::Acc => {
                let again = needed && !changes && (!self.acc.is_simple() || self.reads(&self.acc, &touched));
                self.compute_readers(&touched, true);
                if again {
                    self.store_accumulator();
                }
                self.acc.clone()
            }
            _ => {
                let inside =
                    needed || touched_cells::reads_accumulator(then) || touched_cells::reads_accumulator(otherwise);
                self.compute_readers(&touched, inside);
                match cond {
                    BranchCondition::Bit(bit) => self.read(bit),
                    BranchCondition::Compare(compare) => RungFormula::Cmp(compare),
                    BranchCondition::Acc => RungFormula::Const(false),
                }
            }
        };
        let settle =
            (needed && changes).then(|| self.accumulator_target(&touched, &[&e, &self.acc.clone()], rest, target));
        if let Some(to) = settle {
            self.compute(|_, e| e.reads_bit(to.at));
        }
        if settle.is_none()
            && otherwise.is_empty()
            && self.select_single_instruction(&e, then, cond == BranchCondition::Acc)
        {
            return;
        }
        let before = if cond == BranchCondition::Acc { None } else { Some(self.acc.clone()) };
        let (no, end) = (self.out.label(), self.out.label());
        let mine = before.clone().unwrap_or(RungFormula::Const(true));
        let other = before.clone().unwrap_or(RungFormula::Const(false));
        // If one path only leaves a known value, store that value before the branch.
        let preset = settle.filter(|to| !e.reads_bit(to.at));
        let done = |way: &[IrOp], value: &RungFormula| {
            preset.is_some() && way.is_empty() && matches!(value, RungFormula::Const(_))
        };
        for (way, value) in [(then, &mine), (otherwise, &other)] {
            if let (Some(to), true, RungFormula::Const(value)) = (preset, done(way, value), value) {
                self.out.set_bit(to.at, *value == to.is);
            }
        }
        if then.is_empty() && (settle.is_none() || done(then, &mine)) {
            self.execute_if(&e, &GuardedInstruction::Goto(end));
        } else {
            self.execute_if(&e.opposite(), &GuardedInstruction::Goto(no));
            self.acc = mine;
            self.select_ops(then, needed, settle);
            if let Some(to) = settle {
                self.store_accumulator_to(to);
            }
            if !otherwise.is_empty() || (settle.is_some() && !done(otherwise, &other)) {
                self.out.goto(end);
            }
        }
        self.out.place(no);
        if !otherwise.is_empty() || settle.is_some() {
            self.acc = other.clone();
            self.select_ops(otherwise, needed, settle);
            if let Some(to) = settle
                && !done(otherwise, &other)
            {
                self.store_accumulator_to(to);
            }
        }
        self.out.place(end);
        self.acc = match (settle, before) {
            (Some(to), _) => RungFormula::Lit(to),
            (None, Some(acc)) if needed => acc,
            (None, None) if needed => e,
            _ => RungFormula::Const(false),
        };
    }

    /// Emits a branch with a single instruction as a skip; returns whether that was possible.
    fn select_single_instruction(&mut self, e: &RungFormula, then: &[IrOp], by_acc: bool) -> bool {
        let [op] = then else { return false };
        let (IrOp::SetBit { .. } | IrOp::Store { .. } | IrOp::Move { .. } | IrOp::Math { .. }) = op else {
            return false;
        };
        let save = self.out.checkpoint();
        let acc = self.acc.clone();
        if by_acc {
            self.acc = RungFormula::Const(true);
        }
        let banks = self.out.banks;
        self.select_ops(then, false, None);
        self.acc = acc;
        let same = self.out.banks == banks;
        let made = self.out.roll_back(&save);
        let then = match made.as_slice() {
            [Pic16Item::Op(kind, operands, 0)] if same => {
                let addr = operands.first().copied().unwrap_or(0) as u16;
                let addr = self.written_byte(op).unwrap_or(addr);
                match (kind, operands.get(1)) {
                    (Pic16OpKind::Bsf | Pic16OpKind::Bcf, Some(&bit)) => {
                        GuardedInstruction::StoreBit((addr, bit as u8), *kind == Pic16OpKind::Bsf)
                    }
                    (Pic16OpKind::Clrf | Pic16OpKind::IncfF | Pic16OpKind::DecfF, None) => {
                        GuardedInstruction::Once(*kind, addr)
                    }
                    _ => return false,
                }
            }
            _ => return false,
        };
        self.execute_if(e, &then);
        true
    }

    /// Address of the byte that a one-byte operation writes.
    fn written_byte(&self, op: &IrOp) -> Option<u16> {
        match op {
            IrOp::SetBit { bit, .. } | IrOp::Store { bit, .. } => Some(self.layout.bit(*bit).0),
            IrOp::Move { dst, .. } | IrOp::Math { dst, .. } => Some(self.layout.word(*dst)),
            _ => None,
        }
    }
}
