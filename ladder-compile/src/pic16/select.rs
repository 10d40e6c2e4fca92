//! Selects PIC16 instructions for the intermediate code.
//!
//! The accumulator is a formula ([`RungFormula`]) that is computed only where it is needed: a coil evaluates
//! it directly into its bit, a branch into jumps. Temporaries that are read once are formulas too. Before a
//! cell is written, formulas that read it and are still needed are computed: the accumulator into FSR<0>, a
//! temporary into its cell.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use emu_pic16::periph::map::Sfr;

use super::chip_data::ANY_BANK;
use super::layout::Pic16Layout;
use super::logic::GuardedInstruction;
use super::peripherals::Pic16Peripherals;
use super::rung_formula::{BitLiteral, RungFormula};
use super::touched_cells::{self, TouchedCells};
use super::writer::{Pic16Label, Pic16Writer};
use crate::ir::{BitId, BranchCondition, Ir, IrOp, LogicOp, WordId, WordOperand};
use crate::jump_roles::JumpLabels;

/// A subroutine, generated once if it is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pic16Routine {
    /// Product, by width in bytes.
    Multiply(u8),
    /// Signed quotient, by width in bytes.
    Divide(u8),
    /// Negation of operand 0 or 1, by width in bytes.
    Negate(u16, u8),
    /// W := a byte of the value at the index: number of the table, number of the byte, index.
    Table(u32, u8, WordId),
    /// Analog-to-digital conversion.
    Convert,
    /// W := a byte of EEPROM.
    ReadEeprom,
    /// EEPROM := W.
    WriteEeprom,
    /// Sets the duty cycle of the PWM output of this number to W percent.
    Duty(u32),
    /// Writes a register of an I2C device.
    I2cWrite,
    /// Reads a register of an I2C device.
    I2cRead,
    /// Exchanges a byte on SPI.
    Spi,
}

/// State of instruction selection.
#[derive(Debug)]
pub struct Pic16Selector<'a, 'c> {
    /// Writer that receives the instructions.
    pub out: Pic16Writer<'c>,
    /// Intermediate code of the scan.
    pub ir: &'a Ir,
    /// Places of the cells.
    pub layout: &'a Pic16Layout,
    /// Settings of serial line, converter and PWM.
    pub devices: &'a Pic16Peripherals,
    /// Subroutines in use, with their labels.
    pub routines: BTreeMap<Pic16Routine, Pic16Label>,
    /// Labels of the program's jumps.
    jump_labels: JumpLabels<Pic16Label>,
    /// Formula of the accumulator.
    pub(super) acc: RungFormula,
    /// Temporaries that have not been computed yet, with their formulas and the number of remaining reads.
    pub(super) pending: HashMap<BitId, (RungFormula, u32)>,
    /// True in the operations of the scan itself, false inside a branch.
    pub(super) outermost: bool,
}

impl<'a, 'c> Pic16Selector<'a, 'c> {
    /// Creates a selector that appends to `out`.
    #[must_use]
    pub fn new(out: Pic16Writer<'c>, ir: &'a Ir, layout: &'a Pic16Layout, devices: &'a Pic16Peripherals) -> Self {
        Pic16Selector {
            out,
            ir,
            layout,
            devices,
            routines: BTreeMap::new(),
            jump_labels: JumpLabels::default(),
            acc: RungFormula::Const(false),
            pending: HashMap::new(),
            outermost: true,
        }
    }

    /// Bit that stores the accumulator: FSR<0>.
    pub(super) fn accumulator_bit(&self) -> (u16, u8) {
        (self.out.chip.reg(Sfr::FSR), 0)
    }

    /// Label of a subroutine, which is requested by the first call.
    pub fn routine(&mut self, routine: Pic16Routine) -> Pic16Label {
        if let Some(&label) = self.routines.get(&routine) {
            return label;
        }
        let label = self.out.label();
        self.routines.insert(routine, label);
        label
    }

    /// Selects one operation and returns the number of operations that this has covered.
    ///
    /// `rest` is the rest of its list. If `live`, the accumulator is needed after the list, in `target` if
    /// that is given.
    pub fn op(&mut self, op: &IrOp, rest: &[&IrOp], live: bool, target: Option<BitLiteral>) -> usize {
        match op {
            IrOp::SetAccumulator(value) => self.acc = RungFormula::Const(*value),
            IrOp::Load { bit, negated } => self.acc = self.read(*bit).opposite_if(*negated),
            IrOp::And { bit, negated } => {
                let other = self.read(*bit).opposite_if(*negated);
                self.acc = self.take().and(other);
            }
            IrOp::Or { bit, negated } => {
                let other = self.read(*bit).opposite_if(*negated);
                self.acc = self.take().or(other);
            }
            IrOp::AndCompare(compare) => self.acc = self.take().and(RungFormula::Cmp(*compare)),
            IrOp::Store { bit, negated } => self.store(*bit, *negated, rest),
            IrOp::SetBit { bit, value } => {
                self.pending.remove(bit);
                self.compute_readers(&TouchedCells::bit(*bit), touched_cells::is_accumulator_read(rest, live));
                self.out.set_bit(self.layout.bit(*bit), *value);
            }
            IrOp::Rising(memory) => return self.edge(*memory, true, rest, live, target),
            IrOp::Falling(memory) => return self.edge(*memory, false, rest, live, target),
            IrOp::Label(label) => {
                self.acc = RungFormula::Const(false);
                self.compute(|_, _| true);
                let label = self.jump_labels.label(*label, || self.out.label());
                self.out.place(label);
                self.out.assume_banks(ANY_BANK);
            }
            IrOp::Jump { to, kind } => {
                self.acc = RungFormula::Const(false);
                self.compute(|_, _| true);
                let to = self.jump_labels.label(*to, || self.out.label());
                let role = self.jump_labels.role(*kind, || self.out.label());
                self.out.program_jump(to, role);
            }
            IrOp::Logic { dst, function: is } => self.logic(*dst, *is),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                self.branch(*cond, then, otherwise, rest, live, target)
            }
            IrOp::Receive { dst } => self.receive(*dst, rest, live, target),
            word => {
                let mut touched = TouchedCells::default();
                touched.op(word);
                self.compute_readers(&touched, touched_cells::is_accumulator_read(rest, live));
                self.word(word);
            }
        }
        1
    }

    /// Selects the operations of a branch.
    pub(super) fn select_ops(&mut self, ops: &[IrOp], live: bool, target: Option<BitLiteral>) {
        let ops: Vec<&IrOp> = ops.iter().collect();
        let outer = std::mem::replace(&mut self.outermost, false);
        let mut at = 0;
        while let Some((op, rest)) = ops.get(at..).and_then(<[_]>::split_first) {
            at += self.op(op, rest, live, target);
        }
        self.outermost = outer;
    }

    fn take(&mut self) -> RungFormula {
        std::mem::replace(&mut self.acc, RungFormula::Const(false))
    }

    /// Returns the current value of a bit as a formula, also for a temporary that has not been computed.
    pub(super) fn read(&mut self, bit: BitId) -> RungFormula {
        if let Some((e, left)) = self.pending.get_mut(&bit) {
            let e = e.clone();
            *left -= 1;
            if *left == 0 {
                self.pending.remove(&bit);
            }
            return e;
        }
        RungFormula::Lit(BitLiteral { at: self.layout.bit(bit), is: true })
    }

    /// True if a formula reads a cell that is about to be written.
    pub(super) fn reads(&self, e: &RungFormula, touched: &TouchedCells) -> bool {
        touched.bits.iter().any(|&bit| e.reads_bit(self.layout.bit(bit)))
            || touched.words.iter().any(|&word| e.reads_word(word))
            || (touched.acc && e.reads_bit(self.accumulator_bit()))
    }

    /// Computes the formulas that read cells about to be written, including the accumulator's if it is needed
    /// later.
    pub(super) fn compute_readers(&mut self, touched: &TouchedCells, acc_live: bool) {
        if !acc_live {
            self.acc = RungFormula::Const(false);
        } else if self.reads(&self.acc, touched) {
            self.store_accumulator();
        }
        self.compute(|select, e| touched.leaves || select.reads(e, touched));
    }

    /// Computes the temporaries for which `wanted` is true.
    pub(super) fn compute(&mut self, wanted: impl Fn(&Self, &RungFormula) -> bool) {
        let mut due: Vec<BitId> =
            self.pending.iter().filter(|(_, (e, _))| wanted(self, e)).map(|(&bit, _)| bit).collect();
        due.sort_unstable();
        for bit in due {
            if let Some((e, _)) = self.pending.remove(&bit) {
                self.assign(self.layout.bit(bit), &e);
            }
        }
    }

    /// Computes temporaries before code that is not always executed.
    ///
    /// These are the temporaries that the code reads, and those whose formulas read FSR<0>, which the code
    /// may use itself. A value computed on one path only would be missing on the other.
    pub(super) fn compute_before_branch(&mut self, touched: &TouchedCells) {
        if self.outermost {
            let used = self.pending.keys().copied().filter(|&bit| touched.uses(bit)).collect::<BTreeSet<BitId>>();
            for bit in used {
                if let Some((e, _)) = self.pending.remove(&bit) {
                    self.assign(self.layout.bit(bit), &e);
                }
            }
        }
        let accumulator_bit = self.accumulator_bit();
        self.compute(|_, e| e.reads_bit(accumulator_bit));
    }

    /// Computes the accumulator into its bit.
    pub(super) fn store_accumulator(&mut self) {
        let at = self.accumulator_bit();
        let e = self.take();
        if e != (RungFormula::Lit(BitLiteral { at, is: true })) {
            self.compute(|_, e| e.reads_bit(at));
            self.assign(at, &e);
        }
        self.acc = RungFormula::Lit(BitLiteral { at, is: true });
    }

    fn store(&mut self, bit: BitId, negated: bool, rest: &[&IrOp]) {
        let at = self.layout.bit(bit);
        self.pending.remove(&bit);
        if self.outermost && self.ir.is_temporary(bit) {
            match touched_cells::count_reads(bit, rest) {
                Some(0) => return,
                // A formula may stay pending, because any write to a cell first computes the formulas that
                // read it. It stays pending if it is read only once, or if it takes no work.
                Some(reads)
                    if !touched_cells::is_accumulator_read(rest, true) && reads == 1
                        || self.acc.is_simple() && !self.acc.reads_bit(at) =>
                {
                    self.compute(|_, e| e.reads_bit(at));
                    self.pending.insert(bit, (self.acc.clone().opposite_if(negated), reads));
                    return;
                }
                _ => {}
            }
        }
        let e = self.take().opposite_if(negated);
        self.compute_readers(&TouchedCells::bit(bit), false);
        let simple = e.is_simple() && !e.reads_bit(at);
        self.assign(at, &e);
        self.acc = if simple { e.opposite_if(negated) } else { RungFormula::Lit(BitLiteral { at, is: !negated }) };
    }

    /// Best place to compute the accumulator to, after an operation that touches `touched`.
    ///
    /// This is the bit that is stored next, else `target`, else the accumulator's own bit.
    pub(super) fn accumulator_target(
        &self,
        touched: &TouchedCells,
        also: &[&RungFormula],
        rest: &[&IrOp],
        target: Option<BitLiteral>,
    ) -> BitLiteral {
        if let Some(IrOp::Store { bit, negated }) = rest.first() {
            let at = self.layout.bit(*bit);
            let free = !touched.uses(*bit) && !also.iter().any(|e| e.reads_bit(at));
            if free && !self.pending.values().any(|(e, _)| e.reads_bit(at)) {
                return BitLiteral { at, is: !negated };
            }
        }
        match target {
            Some(lit) if rest.is_empty() && !also.iter().any(|e| e.reads_bit(lit.at)) => lit,
            _ => BitLiteral { at: self.accumulator_bit(), is: true },
        }
    }

    /// Sets the bit so that `to` has the value of the accumulator.
    pub(super) fn store_accumulator_to(&mut self, to: BitLiteral) {
        let e = self.take();
        self.assign(to.at, &e.opposite_if(!to.is));
        self.acc = RungFormula::Lit(to);
    }

    fn edge(&mut self, memory: BitId, rising: bool, rest: &[&IrOp], live: bool, target: Option<BitLiteral>) -> usize {
        // A falling edge is a rising edge of the complements.
        let m = BitLiteral { at: self.layout.bit(memory), is: rising };
        if let Some((IrOp::If { cond: BranchCondition::Acc, if_true: then, if_false: otherwise }, following)) =
            rest.split_first()
            && otherwise.is_empty()
            && !touched_cells::is_accumulator_read(following, live)
        {
            let e = self.take().opposite_if(!rising);
            let mut touched = TouchedCells::bit(memory);
            touched.list(then);
            self.compute_before_branch(&touched);
            self.compute_readers(&touched, false);
            let (end, low) = (self.out.label(), self.out.label());
            let seen = RungFormula::Lit(m);
            let simple = matches!(&e, RungFormula::Lit(l) if l.at != m.at);
            if simple {
                self.execute_if(&e.opposite(), &GuardedInstruction::StoreBit(m.at, !m.is));
                self.execute_if(&e.opposite().or(seen), &GuardedInstruction::Goto(end));
            } else {
                self.execute_if(&e.opposite(), &GuardedInstruction::Goto(low));
                self.execute_if(&seen, &GuardedInstruction::Goto(end));
            }
            self.out.set_bit(m.at, m.is);
            self.acc = RungFormula::Const(true);
            self.select_ops(then, false, None);
            if !simple {
                self.out.goto(end);
                self.out.place(low);
                self.out.set_bit(m.at, !m.is);
            }
            self.out.place(end);
            self.acc = RungFormula::Const(false);
            return 2;
        }
        let touched = TouchedCells::bit(memory);
        let e = self.take().opposite_if(!rising);
        self.compute_readers(&touched, false);
        let t = self.accumulator_target(&touched, &[&e], rest, target);
        self.compute(|_, e| e.reads_bit(t.at));
        let (yes, seen) = (RungFormula::Lit(t), RungFormula::Lit(m));
        match &e {
            RungFormula::Lit(l) if l.at != t.at && l.at != m.at => {
                let both = e.clone().and(seen.opposite());
                self.assign(t.at, &both.opposite_if(!t.is));
                self.assign(m.at, &e.opposite_if(!m.is));
            }
            _ => {
                self.assign(t.at, &e.opposite_if(!t.is));
                self.execute_if(&yes.opposite(), &GuardedInstruction::StoreBit(m.at, !m.is));
                self.execute_if(&seen, &GuardedInstruction::StoreBit(t.at, !t.is));
                self.execute_if(&yes, &GuardedInstruction::StoreBit(m.at, m.is));
            }
        }
        self.acc = yes;
        1
    }

    fn receive(&mut self, dst: WordId, rest: &[&IrOp], live: bool, target: Option<BitLiteral>) {
        let mut touched = TouchedCells::default();
        touched.words.insert(dst);
        self.compute_readers(&touched, false);
        let needed = touched_cells::is_accumulator_read(rest, live);
        let to = self.accumulator_target(&touched, &[], rest, target);
        if needed {
            self.compute(|_, e| e.reads_bit(to.at));
            self.acc = RungFormula::Const(false);
            self.store_accumulator_to(to);
        }
        let end = self.out.label();
        let waits = BitLiteral { at: self.layout.byte_received_flag, is: true };
        self.execute_if(&RungFormula::Lit(waits.opposite()), &GuardedInstruction::Goto(end));
        self.take_byte(dst);
        if needed {
            self.acc = RungFormula::Const(true);
            self.store_accumulator_to(to);
        }
        self.out.place(end);
        self.acc = if needed { RungFormula::Lit(to) } else { RungFormula::Const(false) };
    }

    /// Selects a three-address operation with a fixed template.
    fn logic(&mut self, dst: BitId, is: LogicOp) {
        self.compute_readers(&TouchedCells::bit(dst), false);
        let at = self.layout.bit(dst);
        let of = |bit: BitId| self.layout.bit(bit);
        let is = match is {
            // A destination that is also an operand cannot be preset.
            LogicOp::And(a, b) if of(a) == at || of(b) == at => {
                let other = if of(a) == at { b } else { a };
                let lit = BitLiteral { at: of(other), is: false };
                return self.execute_if(&RungFormula::Lit(lit), &GuardedInstruction::StoreBit(at, false));
            }
            LogicOp::Or(a, b) if of(a) == at || of(b) == at => {
                let other = if of(a) == at { b } else { a };
                return self.execute_if(
                    &RungFormula::Lit(BitLiteral { at: of(other), is: true }),
                    &GuardedInstruction::StoreBit(at, true),
                );
            }
            LogicOp::Not(a) | LogicOp::Copy(a) if of(a) == at => {
                return self.assign(at, &RungFormula::Lit(BitLiteral { at, is: matches!(is, LogicOp::Copy(_)) }));
            }
            is => is,
        };
        let mut when = |lit: BitLiteral, value: bool| {
            self.execute_if(&RungFormula::Lit(lit), &GuardedInstruction::StoreBit(at, value))
        };
        let bit = |bit: BitId, is: bool| BitLiteral { at: of(bit), is };
        match is {
            LogicOp::Not(a) => {
                when(bit(a, true), false);
                when(bit(a, false), true);
            }
            LogicOp::Copy(a) => {
                when(bit(a, false), false);
                when(bit(a, true), true);
            }
            LogicOp::And(a, b) => {
                self.out.set_bit(at, true);
                self.execute_if(&RungFormula::Lit(bit(a, false)), &GuardedInstruction::StoreBit(at, false));
                self.execute_if(&RungFormula::Lit(bit(b, false)), &GuardedInstruction::StoreBit(at, false));
            }
            LogicOp::Or(a, b) => {
                self.out.set_bit(at, false);
                self.execute_if(&RungFormula::Lit(bit(a, true)), &GuardedInstruction::StoreBit(at, true));
                self.execute_if(&RungFormula::Lit(bit(b, true)), &GuardedInstruction::StoreBit(at, true));
            }
        }
    }

    fn word(&mut self, op: &IrOp) {
        match op {
            IrOp::Move { dst, src } => self.copy_value(self.layout.word(*dst), self.ir.bytes(*dst), *src),
            IrOp::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            IrOp::Lookup { dst, index, table } => self.lookup(*dst, *index, *table),
            IrOp::ReadAdc { dst, input } => self.convert(*dst, *input),
            IrOp::SetPwm { output, duty } => self.set_duty(*output, *duty),
            IrOp::Send { value } => self.send(*value),
            IrOp::WaitSent => self.wait_sent(),
            IrOp::Transfer { action, register, value, dst } => self.transfer(*action, *register, *value, *dst),
            IrOp::ReadEeprom { dst, addr } => self.recall(*dst, *addr),
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                self.persist(*src, *addr, (*busy, WordOperand::Const(*scans)))
            }
            _ => {}
        }
    }
}
