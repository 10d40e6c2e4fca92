//! Intermediate code to instructions: bits, and what chooses between lists of operations.
//!
//! The accumulator is the T flag, so a contact is a skip over CLT and a coil is BLD: two clocks and one, whatever the
//! values. Words are the matter of [`super::words`] and [`super::compare`], peripherals that of [`super::peripheral_ops`].

use emu_avr::isa::Kind;

use super::arch::{AvrCodeWriter, AvrJump};
use super::compare::ComparisonChain;
use super::layout::{AvrCellPlace, AvrLayout};
use super::peripheral_ops::AvrPeripherals;
use super::registers::{AvrRegisters, BYTE, SCRATCH};
use super::runtime::{AvrRoutine, RoutineContext};
use crate::CodegenError;
use crate::code::CodeLabel;
use crate::ir::{BitId, BranchCondition, Ir, IrOp, LogicOp, WordId};

/// What is known along straight code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AvrKnownState {
    /// The T flag.
    pub t: Option<bool>,
    /// A word that A holds, and to how many bytes, extended with sign.
    pub a: Option<(WordId, usize)>,
}

impl AvrKnownState {
    /// What is known where two paths meet.
    fn merge(self, other: AvrKnownState) -> AvrKnownState {
        AvrKnownState { t: self.t.filter(|_| self.t == other.t), a: self.a.filter(|_| self.a == other.a) }
    }
}

/// A subroutine, where it begins, and how often it is wanted.
pub type RequestedRoutine = (AvrRoutine, CodeLabel, u32);

/// The code being selected.
pub struct AvrSelector<'a> {
    /// Takes the instructions.
    pub asm: &'a mut AvrCodeWriter,
    /// The scan.
    pub ir: &'a Ir,
    /// Places of the cells.
    pub layout: &'a AvrLayout,
    /// Names of registers.
    pub regs: &'a AvrRegisters,
    /// How the peripherals are set.
    pub devices: &'a AvrPeripherals,
    /// Some divisor may be zero or less.
    pub signed_divisors: bool,
    /// What is known here.
    pub known: AvrKnownState,
    /// The row of comparisons here.
    pub comparison_chain: ComparisonChain,
    /// Subroutines so far.
    pub routines: Vec<RequestedRoutine>,
    /// Subroutines that are wanted once in the whole program, so that they need be none.
    pub inlined_routines: &'a [AvrRoutine],
    /// What this chip cannot do though it was asked to: a fault of the compiler.
    pub internal_error: Option<CodegenError>,
}

impl AvrSelector<'_> {
    /// Appends the code of `ops`.
    pub fn ops(&mut self, ops: &[IrOp]) {
        ops.iter().zip(1..).for_each(|(op, next)| self.op(op, ops.get(next)));
    }

    /// Appends the code of one operation; `next` is the one that follows it whatever happens.
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
                    self.asm.op(if *negated { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                    self.asm.op(Kind::Set, &[]);
                }
            },
            IrOp::Store { bit, negated } => self.store_bit(*bit, *negated),
            IrOp::SetBit { bit, value } => self.set_bit(*bit, *value),
            IrOp::Rising(bit) => {
                let n = self.load_old_bit(*bit);
                self.asm.op(Kind::Sbrc, &[SCRATCH, n]);
                self.asm.op(Kind::Clt, &[]);
                self.known.t = self.known.t.filter(|t| !t);
            }
            IrOp::Falling(bit) => {
                let n = self.load_old_bit(*bit);
                match self.known.t {
                    Some(true) => self.set_accumulator(false),
                    Some(false) => {
                        self.asm.op(Kind::Bst, &[SCRATCH, n]);
                        self.known.t = None;
                    }
                    None => {
                        let low = self.asm.new_label();
                        self.asm.jump(AvrJump::If(Kind::Brtc), low);
                        self.asm.op(Kind::Eor, &[SCRATCH, SCRATCH]);
                        self.asm.place_label(low);
                        self.asm.op(Kind::Bst, &[SCRATCH, n]);
                    }
                }
            }
            IrOp::AndCompare(compare) => self.and_compare(compare, next),
            IrOp::Move { dst, src } => self.move_word(*dst, *src),
            IrOp::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            IrOp::If { cond, if_true: then, if_false: otherwise } => self.branch(*cond, then, otherwise),
            IrOp::Logic { dst, function: is } => self.logic(*dst, *is),
            IrOp::Lookup { dst, index, table } => self.look_up(*dst, *index, *table),
            IrOp::ReadAdc { dst, input } => self.read_adc(*dst, *input),
            IrOp::SetPwm { duty } => self.set_pwm(*duty),
            IrOp::Send { value } => self.send(*value),
            IrOp::Receive { dst } => self.receive(*dst),
            IrOp::ReadEeprom { dst, addr } => self.recall(*dst, *addr),
            IrOp::WriteEeprom { src, addr, busy, scans } => self.persist(*src, *addr, *busy, *scans),
            IrOp::Module { .. } => self.internal_error = Some(CodegenError::NoCodeFor { op: self.ir.op_text(op) }),
        }
    }

    /// A subroutine: called, or in its place where it is the only one of its kind. A is lost but for its result.
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
            let around = RoutineContext { regs: self.regs, layout: self.layout, eeprom: self.ir.eeprom_bytes };
            routine.body(self.asm, &around);
        } else {
            self.asm.jump(AvrJump::Call, label);
        }
        self.known.a = None;
    }

    fn set_accumulator(&mut self, value: bool) {
        if self.known.t != Some(value) {
            self.asm.op(if value { Kind::Set } else { Kind::Clt }, &[]);
            self.known.t = Some(value);
        }
    }

    fn load_bit(&mut self, bit: BitId, negated: bool) {
        if negated {
            self.set_accumulator(true);
            self.and_bit(bit, true);
        } else {
            let (reg, n) = self.fetch_bit(bit);
            self.asm.op(Kind::Bst, &[reg, n]);
            self.known.t = None;
        }
    }

    /// T := T and bit.
    fn and_bit(&mut self, bit: BitId, negated: bool) {
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(if negated { Kind::Sbrc } else { Kind::Sbrs }, &[reg, n]);
        self.asm.op(Kind::Clt, &[]);
        self.known.t = None;
    }

    fn store_bit(&mut self, bit: BitId, negated: bool) {
        if let (true, Some(t)) = (negated, self.known.t) {
            return self.set_bit(bit, !t);
        }
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(Kind::Bld, &[reg, n]);
        if negated {
            self.asm.op(Kind::Ldi, &[SCRATCH, 1 << n]);
            self.asm.op(Kind::Eor, &[reg, SCRATCH]);
        }
        self.store_fetched_bit(bit);
    }

    fn set_bit(&mut self, bit: BitId, value: bool) {
        let (reg, n) = self.fetch_bit(bit);
        let mask = if value { 1 << n } else { 0xFF ^ (1 << n) };
        if self.known.t == Some(value) {
            self.asm.op(Kind::Bld, &[reg, n]);
        } else if reg >= 16 {
            self.asm.op(if value { Kind::Ori } else { Kind::Andi }, &[reg, mask]);
        } else {
            self.asm.op(Kind::Ldi, &[SCRATCH, mask]);
            self.asm.op(if value { Kind::Or } else { Kind::And }, &[reg, SCRATCH]);
        }
        self.store_fetched_bit(bit);
    }

    /// A bit of its own for every operation: cleared or set, then changed by a skip for each operand.
    fn logic(&mut self, dst: BitId, is: LogicOp) {
        let skip = |this: &mut Self, first: bool, skips: Kind, bit: BitId, sets: bool| {
            if first {
                this.asm.op(if sets { Kind::Clt } else { Kind::Set }, &[]);
            }
            let (reg, n) = this.fetch_bit(bit);
            this.asm.op(skips, &[reg, n]);
            this.asm.op(if sets { Kind::Set } else { Kind::Clt }, &[]);
        };
        match is {
            LogicOp::Copy(a) => skip(self, true, Kind::Sbrc, a, true),
            LogicOp::Not(a) => skip(self, true, Kind::Sbrs, a, true),
            LogicOp::And(a, b) => {
                skip(self, true, Kind::Sbrs, a, false);
                skip(self, false, Kind::Sbrs, b, false);
            }
            LogicOp::Or(a, b) => {
                skip(self, true, Kind::Sbrc, a, true);
                skip(self, false, Kind::Sbrc, b, true);
            }
        }
        self.known.t = None;
        self.store_bit(dst, false);
    }

    /// The bit's old byte to the scratch register, T to the bit; returns the bit's number.
    fn load_old_bit(&mut self, bit: BitId) -> i32 {
        let (reg, n) = self.fetch_bit(bit);
        self.asm.op(Kind::Mov, &[SCRATCH, reg]);
        self.asm.op(Kind::Bld, &[reg, n]);
        self.store_fetched_bit(bit);
        n
    }

    /// Register and number of a bit, loaded if it is in RAM.
    fn fetch_bit(&mut self, bit: BitId) -> (i32, i32) {
        match self.layout.bit(bit) {
            (AvrCellPlace::Reg(reg), n) => (reg.into(), n.into()),
            (AvrCellPlace::Ram(addr), n) => {
                self.layout.load(self.asm, BYTE, addr);
                (BYTE, n.into())
            }
        }
    }

    /// Stores the byte that [`Self::fetch_bit`] loaded.
    fn store_fetched_bit(&mut self, bit: BitId) {
        if let (AvrCellPlace::Ram(addr), _) = self.layout.bit(bit) {
            self.layout.store(self.asm, addr, BYTE);
        }
    }

    fn branch(&mut self, cond: BranchCondition, then: &[IrOp], otherwise: &[IrOp]) {
        if let (BranchCondition::Acc, Some(t)) = (cond, self.known.t) {
            return self.ops(if t { then } else { otherwise });
        }
        // Only one arm: jump past it. Two: the first ends with a jump past the second.
        let (first, second, holds) = if then.is_empty() { (otherwise, then, false) } else { (then, otherwise, true) };
        let (other, end) = (self.asm.new_label(), self.asm.new_label());
        match cond {
            BranchCondition::Acc => self.asm.jump(AvrJump::If(if holds { Kind::Brtc } else { Kind::Brts }), other),
            BranchCondition::Bit(bit) => {
                let (reg, n) = self.fetch_bit(bit);
                if let ([IrOp::SetAccumulator(value)], []) = (first, second)
                    && self.known.t != Some(*value)
                {
                    // One instruction: the skip goes past it.
                    self.asm.op(if holds { Kind::Sbrc } else { Kind::Sbrs }, &[reg, n]);
                    self.asm.op(if *value { Kind::Set } else { Kind::Clt }, &[]);
                    self.known.t = None;
                    return;
                }
                self.asm.op(if holds { Kind::Sbrs } else { Kind::Sbrc }, &[reg, n]);
                self.asm.jump(AvrJump::To, other);
            }
            BranchCondition::Compare(compare) => {
                let (yes, no) = self.compare(&compare);
                self.asm.jump(AvrJump::If(if holds { no } else { yes }), other);
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
