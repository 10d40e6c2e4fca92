//! Operations to instructions.
//!
//! The accumulator of the intermediate code is the carry; what else is known of it stands in [`State`]. Code is collected in
//! lines, so that the two arms of a branch can be brought to agree before they are joined.

use emu_8051::isa::Kind;

use super::arch::{Jump, Mcs51};
use super::layout::Layout;
use super::regs::Regs;
use super::state::{Acc, Flag, State, live};
use crate::code::{Asm, Label};
use crate::ir::{Ir, Op};
use crate::target::Mark;

/// A line of code that is not yet in the assembler.
#[derive(Debug, Clone)]
pub enum Line {
    /// An instruction.
    Op(Kind, Vec<i32>),
    /// What refers to a label.
    Jump(Jump, Label),
    /// A label.
    Place(Label),
    /// A jump back, taken at most so many times in a row.
    Repeat(Jump, Label, u32),
}

/// Code of operations.
#[derive(Debug)]
pub struct Select<'a> {
    /// What becomes of it.
    pub asm: &'a mut Asm<Mcs51>,
    pub(super) ir: &'a Ir,
    pub(super) layout: &'a Layout,
    pub(super) regs: Regs,
    pub(super) now: State,
    pub(super) out: Vec<Line>,
    /// The multiplications in use, by width in bytes.
    pub multiply: [Option<Label>; 5],
    /// The divisions in use, by width in bytes.
    pub divide: [Option<Label>; 5],
    /// The tables in use, a byte of each value.
    pub tables: Vec<(Label, Vec<u8>)>,
    /// Places where a byte is sent.
    pub sends: Vec<Label>,
    /// The byte before may still be on its way when a byte is sent.
    pub waits: bool,
}

impl<'a> Select<'a> {
    /// Nothing is known at first.
    pub fn new(asm: &'a mut Asm<Mcs51>, ir: &'a Ir, layout: &'a Layout, regs: Regs) -> Self {
        Select {
            asm,
            ir,
            layout,
            regs,
            now: State::default(),
            out: Vec::new(),
            multiply: [None; 5],
            divide: [None; 5],
            tables: Vec::new(),
            sends: Vec::new(),
            waits: false,
        }
    }

    /// Appends the code of one operation; `live` says that the accumulator is read after it.
    pub fn one(&mut self, op: &Op, live: bool) {
        self.op(op, live);
        self.flush();
    }

    /// Hands what is collected to the assembler.
    pub(super) fn flush(&mut self) {
        for line in std::mem::take(&mut self.out) {
            match line {
                Line::Op(kind, operands) => self.asm.op(kind, &operands),
                Line::Jump(jump, to) => self.asm.jump(jump, to),
                Line::Place(label) => self.asm.place(label),
                Line::Repeat(jump, to, times) => self.asm.repeat(jump, to, times),
            }
        }
    }

    /// A mark stands here.
    pub fn mark(&mut self, mark: Mark) {
        self.asm.mark(mark);
    }

    pub(super) fn emit(&mut self, kind: Kind, operands: &[i32]) {
        self.out.push(Line::Op(kind, operands.to_vec()));
    }

    pub(super) fn jump(&mut self, kind: Kind, operands: &[i32], to: Label) {
        self.out.push(Line::Jump(Jump::when(kind, operands), to));
    }

    pub(super) fn place(&mut self, label: Label) {
        self.out.push(Line::Place(label));
    }

    pub(super) fn list(&mut self, ops: &[Op], after: bool) {
        let all: Vec<&Op> = ops.iter().collect();
        for (op, live) in all.iter().zip(live(&all, after)) {
            self.op(op, live);
        }
    }

    fn op(&mut self, op: &Op, live: bool) {
        match op {
            Op::Acc(value) => self.now.acc = Acc { known: Some(*value), ..Acc::default() },
            Op::Load { bit, negated } => {
                self.now.acc = Acc { flag: Some((Flag::Cell(*bit), *negated)), ..Acc::default() };
            }
            Op::And { bit, negated } if live => self.combine(true, Flag::Cell(*bit), *negated),
            Op::Or { bit, negated } if live => self.combine(false, Flag::Cell(*bit), *negated),
            Op::And { .. } | Op::Or { .. } => {}
            Op::Store { bit, negated } => self.store_acc(*bit, *negated),
            Op::Put { bit, value } => self.put_bit(*bit, *value, live),
            Op::Rising(bit) | Op::Falling(bit) if !live => self.store_acc(*bit, false),
            Op::Rising(bit) => self.edge(*bit, true),
            Op::Falling(bit) => self.edge(*bit, false),
            Op::AndCompare(compare) if live => self.and_compare(compare),
            Op::AndCompare(_) => {}
            Op::Move { dst, src } => self.set(*dst, *src, live),
            Op::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b, live),
            Op::Logic { dst, is } => self.logic(*dst, *is),
            Op::Lookup { dst, index, table } => self.lookup(*dst, *index, *table, live),
            Op::Send { value } => self.send(*value),
            Op::Receive { dst } => self.receive(*dst),
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise, live),
            // Refused before: the chips have nothing of the kind.
            Op::ReadAdc { .. } | Op::SetPwm { .. } | Op::Recall { .. } | Op::Persist { .. } | Op::Module { .. } => {}
        }
        if !live {
            self.now.acc = Acc::default();
        }
    }
}
