//! Selects AVR instructions for bits and for branches between lists of operations.
//!
//! The accumulator is the T flag, so a contact is a skip over CLT (two clocks) and a coil is BLD (one clock),
//! whatever the values. [`super::words`] and [`super::compare`] handle words, [`super::peripheral_ops`]
//! peripherals.

use emu_avr::isa::AvrOpKind;

use super::arch::{AvrCodeWriter, AvrJump};
use super::compare::ComparisonChain;
use super::layout::{AvrCellPlace, AvrLayout};
use super::peripheral_ops::AvrPeripherals;
use super::registers::{AvrRegisters, BYTE, SCRATCH};
use super::runtime::{AvrRoutine, RoutineContext};
use crate::CodegenError;
use crate::code::CodeLabel;
use crate::ir::{BitId, BranchCondition, Ir, IrOp, LogicOp, WordId};
use crate::jump_roles::JumpLabels;

/// Values known at compile time in straight-line code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AvrKnownState {
    /// Value of the T flag, if known.
    pub t: Option<bool>,
    /// Word that A holds, and the number of bytes to which it is sign-extended.
    pub a: Option<(WordId, usize)>,
}

impl AvrKnownState {
    /// Keeps what is known on both of two paths that join.
    fn merge(self, other: AvrKnownState) -> AvrKnownState {
        AvrKnownState { t: self.t.filter(|_| self.t == other.t), a: self.a.filter(|_| self.a == other.a) }
    }
}

/// A subroutine, its label, and the number of its calls.
pub type RequestedRoutine = (AvrRoutine, CodeLabel, u32);

/// State of instruction selection.
pub struct AvrSelector<'a> {
    /// Writer that receives the instructions.
    pub asm: &'a mut AvrCodeWriter,
    /// Intermediate code of the scan.
    pub ir: &'a Ir,
    /// Places of the cells.
    pub layout: &'a AvrLayout,
    /// Register lookup of the chip.
    pub regs: &'a AvrRegisters,
    /// Settings of the peripherals.
    pub devices: &'a AvrPeripherals,
    /// True if some divisor may be zero or negative.
    pub signed_divisors: bool,
    /// Values known at the current position.
    pub known: AvrKnownState,
    /// Current chain of comparisons.
    pub comparison_chain: ComparisonChain,
    /// Labels of the program's jumps.
    pub jump_labels: JumpLabels<CodeLabel>,
    /// Subroutines requested so far.
    pub routines: Vec<RequestedRoutine>,
    /// Subroutines with a single call in the whole program, which are inlined.
    pub inlined_routines: &'a [AvrRoutine],
    /// An operation that the back end cannot translate although it was requested: an internal error of the
    /// compiler.
    pub internal_error: Option<CodegenError>,
}

impl AvrSelector<'_> {
    /// Appends the code of `ops`.
    pub fn ops(&mut self, ops: &[IrOp]) {
        ops.iter().zip(1..).for_each(|(op, next)| self.op(op, ops.get(next)));
    }

    /// Appends the code of one operation; `next` is the operation that always follows it.
    pub fn op(&mut self, op: &IrOp, next: Option<&IrOp>) {
        match op {
            IrOp::SetAccumulator(value) => self.set_accumulator(*value),
            IrOp::Load { bit, negated } => self.load_bit(*bit, *negated),
            IrOp::And { bit, negated } => match self.known.t {
                Some(true) => self.load_bit(*bit, *negated),
                Some(false) => {}
                None => self.and_bit(*bit, *negated),
            },
            IrOp::Or { bit, negated } => match self.known.t {
                Some(false) => self.load_bit(*bit, *negated),
                Some(true) => {}
                None => {
                    let (reg, n) = self.fetch_bit(*bit);
                    self.asm.op(if *negated { AvrOpKind::Sbrs } else { AvrOpKind::Sbrc }, &[reg, n]);
                    self.asm.op(AvrOpKind::Set, &[]);
                }
            },
            IrOp::Store { bit, negated } => self.store_bit(*bit, *negated),
            IrOp::SetBit { bit, value } => self.set_bit(*bit, *value),
            IrOp::Rising(bit) => {
                let n = self.load_old_bit(*bit);
                self.asm.op(AvrOpKind::Sbrc, &[SCRATCH, n]);
                self.asm.op(AvrOpKind::Clt, &[]);
                self.known.t = self.known.t.filter(|t| !t);
            }
            IrOp::Falling(bit) => {
                let n = self.load_old_bit(*bit);
                match self.known.t {
                    Some(true) => self.set_accumulator(false),
                    Some(false) => {
                        self.asm.op(AvrOpKind::Bst, &[SCRATCH, n]);
                        self.known.t = None;
                    }
                    None => {
                        let low = self.asm.new_label();
                        self.asm.jump(AvrJump::If(AvrOpKind::Brtc), low);
                        self.asm.op(AvrOpKind::Eor, &[SCRATCH, SCRATCH]);
                        self.asm.place_label(low);
                        self.asm.op(AvrOpKind::Bst, &[SCRATCH, n]);
                    }
                }
            }
            IrOp::AndCompare(compare) => self.and_compare(compare, next),
            IrOp::Move { dst, src } => self.move_word(*dst, *src),
            IrOp::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            IrOp::If { cond, if_true: then, if_false: otherwise } => self.branch(*cond, then, otherwise),
            IrOp::Label(label) => {
                let label = self.jump_labels.label(*label, || self.asm.new_label());
                self.asm.place_label(label);
                self.known = AvrKnownState::default();
            }
            IrOp::Jump { to, kind } => {
                let to = self.jump_labels.label(*to, || self.asm.new_label());
                let role = self.jump_labels.role(*kind, || self.asm.new_label());
                self.asm.jump_with_role(AvrJump::To, to, role, 0);
            }
            IrOp::Logic { dst, function: is } => self.logic(*dst, *is),
            IrOp::Lookup { dst, index, table } => self.look_up(*dst, *index, *table),
            IrOp::ReadAdc { dst, input } => self.read_adc(*dst, *input),
            IrOp::SetPwm { output, duty } => self.set_pwm(*output, *duty),
            IrOp::Send { value } => self.send(*value),
            IrOp::WaitSent => self.wait_sent(),
            IrOp::Receive { dst } => self.receive(*dst),
            IrOp::Transfer { action, register, value, dst } => self.transfer(*action, *register, *value, *dst),
            IrOp::ReadEeprom { dst, addr } => self.recall(*dst, *addr),
            IrOp::WriteEeprom { src, addr, busy, scans } => self.persist(*src, *addr, *busy, *scans),
            IrOp::Module { .. } => self.internal_error = Some(CodegenError::NoCodeFor { op: self.ir.op_text(op) }),
        }
    }

    /// Emits a subroutine: a call, or the body if this is its only use. Destroys A except for the result.
    pub fn routine(&mut self, routine: AvrRoutine) {
        let known = self.routines.iter_mut().find(|(known, ..)| *known == routine);
        let label = match known {
            Some((_, label, count)) => {
                *count += 1;
                *label
            }
            None => {
                let label = self.asm.new_label();
                self.routines.push((routine, label, 1));
                label
            }
        };
        if self.inlined_routines.contains(&routine) {
            let context = RoutineContext { regs: self.regs, layout: self.layout, eeprom: self.ir.eeprom_bytes };
            routine.body(self.asm, &context);
        } else {
            self.asm.jump(AvrJump::Call, label);
        }
        self.known.a = None;
    }

    fn set_accumulator(&mut self, value: bool) {
        if self.known.t != Some(value) {
            self.asm.op(if value { AvrOpKind::Set } else { AvrOpKind::Clt }, &[]);
            self.known.t = Some(value);
        }
    }

    fn load_bit(&mut self, bit: BitId, negated: bool) {
        if negated {
            self.set_accumulator(true);
            self.and_bit(bit, true);
        } else {
            let (reg, n) = self.fetch_bit(bit);
            self.asm.op(AvrOpKind::Bst, &[reg, n]);
            self.known.t = None;
        }
    }

    /// Emits T := T and bit.
    fn and_bit(&mut self, bit: BitId, negated: bool) {
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(if negated { AvrOpKind::Sbrc } else { AvrOpKind::Sbrs }, &[reg, n]);
        self.asm.op(AvrOpKind::Clt, &[]);
        self.known.t = None;
    }

    fn store_bit(&mut self, bit: BitId, negated: bool) {
        if let (true, Some(t)) = (negated, self.known.t) {
            return self.set_bit(bit, !t);
        }
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(AvrOpKind::Bld, &[reg, n]);
        if negated {
            self.asm.op(AvrOpKind::Ldi, &[SCRATCH, 1 << n]);
            self.asm.op(AvrOpKind::Eor, &[reg, SCRATCH]);
        }
        self.store_fetched_bit(bit);
    }

    fn set_bit(&mut self, bit: BitId, value: bool) {
        let (reg, n) = self.fetch_bit(bit);
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if self.known.t == Some(value) {
            self.asm.op(AvrOpKind::Bld, &[reg, n]);
        } else if reg >= 16 {
            self.asm.op(if value { AvrOpKind::Ori } else { AvrOpKind::Andi }, &[reg, mask]);
        } else {
            self.asm.op(AvrOpKind::Ldi, &[SCRATCH, mask]);
            self.asm.op(if value { AvrOpKind::Or } else { AvrOpKind::And }, &[reg, SCRATCH]);
        }
        self.store_fetched_bit(bit);
    }

    /// Emits a three-address operation: clears or sets T, then changes it by a skip for each operand, then
    /// stores it.
    fn logic(&mut self, dst: BitId, is: LogicOp) {
        let skip = |this: &mut Self, first: bool, skips: AvrOpKind, bit: BitId, sets: bool| {
            if first {
                this.asm.op(if sets { AvrOpKind::Clt } else { AvrOpKind::Set }, &[]);
            }
            let (reg, n) = this.fetch_bit(bit);
            this.asm.op(skips, &[reg, n]);
            this.asm.op(if sets { AvrOpKind::Set } else { AvrOpKind::Clt }, &[]);
        };
        match is {
            LogicOp::Copy(a) => skip(self, true, AvrOpKind::Sbrc, a, true),
            LogicOp::Not(a) => skip(self, true, AvrOpKind::Sbrs, a, true),
            LogicOp::And(a, b) => {
                skip(self, true, AvrOpKind::Sbrs, a, false);
                skip(self, false, AvrOpKind::Sbrs, b, false);
            }
            LogicOp::Or(a, b) => {
                skip(self, true, AvrOpKind::Sbrc, a, true);
                skip(self, false, AvrOpKind::Sbrc, b, true);
            }
        }
        self.known.t = None;
        self.store_bit(dst, false);
    }

    /// Copies the byte with the bit's old value to the scratch register and stores T in the bit; returns the
    /// bit's number.
    fn load_old_bit(&mut self, bit: BitId) -> i32 {
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(AvrOpKind::Mov, &[SCRATCH, reg]);
        self.asm.op(AvrOpKind::Bld, &[reg, n]);
        self.store_fetched_bit(bit);
        n
    }

    /// Register and number of a bit; loads its byte if it is in RAM.
    fn fetch_bit(&mut self, bit: BitId) -> (i32, i32) {
        match self.layout.bit(bit) {
            (AvrCellPlace::Reg(reg), n) => (reg.into(), n.into()),
            (AvrCellPlace::Ram(addr), n) => {
                self.layout.load(self.asm, BYTE, addr);
                (BYTE, n.into())
            }
        }
    }

    /// Writes back the byte that [`Self::fetch_bit`] loaded from RAM.
    fn store_fetched_bit(&mut self, bit: BitId) {
        if let (AvrCellPlace::Ram(addr), _) = self.layout.bit(bit) {
            self.layout.store(self.asm, addr, BYTE);
        }
    }

    fn branch(&mut self, cond: BranchCondition, then: &[IrOp], otherwise: &[IrOp]) {
        if let (BranchCondition::Acc, Some(t)) = (cond, self.known.t) {
            return self.ops(if t { then } else { otherwise });
        }
        // With one arm, jump past it; with two, the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.new_label(), self.asm.new_label());
        match cond {
            BranchCondition::Acc => {
                self.asm.jump(AvrJump::If(if holds { AvrOpKind::Brtc } else { AvrOpKind::Brts }), other)
            }
            BranchCondition::Bit(bit) => {
                let (reg, n) = self.fetch_bit(bit);
                if let ([IrOp::SetAccumulator(value)], []) = (first, second)
                    && self.known.t != Some(*value)
                {
                    // A single instruction needs no jump: the skip passes over it.
                    self.asm.op(if holds { AvrOpKind::Sbrc } else { AvrOpKind::Sbrs }, &[reg, n]);
                    self.asm.op(if *value { AvrOpKind::Set } else { AvrOpKind::Clt }, &[]);
                    self.known.t = None;
                    return;
                }
                self.asm.op(if holds { AvrOpKind::Sbrs } else { AvrOpKind::Sbrc }, &[reg, n]);
                self.asm.jump(AvrJump::To, other);
            }
            BranchCondition::Compare(compare) => {
                let branches = self.compare(&compare);
                self.asm.jump(AvrJump::If(if holds { branches.if_false } else { branches.if_true }), other);
            }
        }
        let before = self.known;
        let with_t = |holds: bool| AvrKnownState {
            t: if cond == BranchCondition::Acc { Some(holds) } else { before.t },
            ..before
        };
        self.known = with_t(holds);
        self.ops(first);
        let after_first = self.known;
        if !second.is_empty() {
            self.asm.jump(AvrJump::To, end);
        }
        self.asm.place_label(other);
        self.known = with_t(!holds);
        self.ops(second);
        self.asm.place_label(end);
        self.known = self.known.merge(after_first);
    }
}
