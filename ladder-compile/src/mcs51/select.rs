//! Selects 8051 instructions for the intermediate code.
//!
//! The accumulator of the intermediate code is the carry; `SelectorState` holds what else is known of it.
//! Code is collected in lines first, so that the two arms of a branch can be made to agree before they join.

use emu_8051::isa::Mcs51OpKind;

use super::arch::{Mcs51Arch, Mcs51Jump};
use super::known_state::{AccumulatorState, BitSource, SelectorState, acc_live_after};
use super::layout::Mcs51Layout;
use super::registers::Mcs51Registers;
use crate::code::{CodeLabel, CodeWriter};
use crate::ir::{Ir, IrOp};
use crate::jump_roles::{JumpLabels, JumpRole};
use crate::target::CodeMark;

/// A line of code that has not been passed to the code writer yet.
#[derive(Debug, Clone)]
pub enum PendingCode {
    /// An instruction.
    Op(Mcs51OpKind, Vec<i32>),
    /// An instruction that refers to a label.
    Jump(Mcs51Jump, CodeLabel),
    /// The position of a label.
    Place(CodeLabel),
    /// A jump of the program.
    ProgramJump(CodeLabel, JumpRole<CodeLabel>),
    /// A jump back, taken at most this many times in a row.
    Repeat(Mcs51Jump, CodeLabel, u32),
}

/// State of instruction selection.
#[derive(Debug)]
pub struct Mcs51Selector<'a> {
    /// Writer that receives the instructions.
    pub asm: &'a mut CodeWriter<Mcs51Arch>,
    /// The intermediate code.
    pub(super) ir: &'a Ir,
    /// The places of bits and words.
    pub(super) layout: &'a Mcs51Layout,
    /// The registers of the chip.
    pub(super) regs: Mcs51Registers,
    /// What is known at the current position.
    pub(super) state: SelectorState,
    /// Lines not yet passed to the code writer.
    pub(super) pending: Vec<PendingCode>,
    /// Labels of the multiplication routines in use, by width in bytes.
    pub multiply: [Option<CodeLabel>; 5],
    /// Labels of the division routines in use, by width in bytes.
    pub divide: [Option<CodeLabel>; 5],
    /// Tables in use; each holds one byte of every value.
    pub tables: Vec<(CodeLabel, Vec<u8>)>,
    /// Labels of the program's jumps.
    jump_labels: JumpLabels<CodeLabel>,
    /// Labels before each write to the transmitter.
    pub send_labels: Vec<CodeLabel>,
    /// True if the previous byte may still be in transmission when a byte is sent.
    pub must_wait_for_transmitter: bool,
    /// Iterations of the loop that waits for a byte to go.
    pub sent_iterations: u32,
}

impl<'a> Mcs51Selector<'a> {
    /// Creates a selector that knows nothing of the machine state.
    pub fn new(asm: &'a mut CodeWriter<Mcs51Arch>, ir: &'a Ir, layout: &'a Mcs51Layout, regs: Mcs51Registers) -> Self {
        Mcs51Selector {
            asm,
            ir,
            layout,
            regs,
            state: SelectorState::default(),
            pending: Vec::new(),
            multiply: [None; 5],
            divide: [None; 5],
            tables: Vec::new(),
            jump_labels: JumpLabels::default(),
            send_labels: Vec::new(),
            must_wait_for_transmitter: false,
            sent_iterations: 0,
        }
    }

    /// Appends the code of one operation; `live` says whether the accumulator is read after it.
    pub fn select_op(&mut self, op: &IrOp, live: bool) {
        self.op(op, live);
        self.flush();
    }

    /// Passes the collected lines to the code writer.
    pub(super) fn flush(&mut self) {
        for line in std::mem::take(&mut self.pending) {
            match line {
                PendingCode::Op(kind, operands) => self.asm.op(kind, &operands),
                PendingCode::Jump(jump, to) => self.asm.jump(jump, to),
                PendingCode::Place(label) => self.asm.place_label(label),
                PendingCode::ProgramJump(to, role) => {
                    self.asm.jump_with_role(Mcs51Jump::Unconditional, to, role, 0);
                }
                PendingCode::Repeat(jump, to, times) => self.asm.jump_back(jump, to, times),
            }
        }
    }

    /// Places a mark at the current position.
    pub fn mark(&mut self, mark: CodeMark) {
        self.asm.mark(mark);
    }

    /// Adds an instruction to the pending lines.
    pub(super) fn emit(&mut self, kind: Mcs51OpKind, operands: &[i32]) {
        self.pending.push(PendingCode::Op(kind, operands.to_vec()));
    }

    /// Adds a conditional jump to the pending lines.
    pub(super) fn jump(&mut self, kind: Mcs51OpKind, operands: &[i32], to: CodeLabel) {
        self.pending.push(PendingCode::Jump(Mcs51Jump::conditional(kind, operands), to));
    }

    /// Places a label in the pending lines.
    pub(super) fn place(&mut self, label: CodeLabel) {
        self.pending.push(PendingCode::Place(label));
    }

    /// Selects a list of operations; `after` says whether the accumulator is read after it.
    pub(super) fn select_ops(&mut self, ops: &[IrOp], after: bool) {
        let all: Vec<&IrOp> = ops.iter().collect();
        for (op, live) in all.iter().zip(acc_live_after(&all, after)) {
            self.op(op, live);
        }
    }

    fn op(&mut self, op: &IrOp, live: bool) {
        match op {
            IrOp::SetAccumulator(value) => {
                self.state.acc = AccumulatorState { known: Some(*value), ..AccumulatorState::default() }
            }
            IrOp::Load { bit, negated } => {
                self.state.acc =
                    AccumulatorState { flag: Some((BitSource::Cell(*bit), *negated)), ..AccumulatorState::default() };
            }
            IrOp::And { bit, negated } if live => self.combine(true, BitSource::Cell(*bit), *negated),
            IrOp::Or { bit, negated } if live => self.combine(false, BitSource::Cell(*bit), *negated),
            IrOp::And { .. } | IrOp::Or { .. } => {}
            IrOp::Store { bit, negated } => self.store_acc(*bit, *negated),
            IrOp::SetBit { bit, value } => self.put_bit(*bit, *value, live),
            IrOp::Rising(bit) | IrOp::Falling(bit) if !live => self.store_acc(*bit, false),
            IrOp::Rising(bit) => self.edge(*bit, true),
            IrOp::Falling(bit) => self.edge(*bit, false),
            IrOp::AndCompare(compare) if live => self.and_compare(compare),
            IrOp::AndCompare(_) => {}
            IrOp::Move { dst, src } => self.move_word(*dst, *src, live),
            IrOp::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b, live),
            IrOp::Label(label) => {
                let label = self.jump_labels.label(*label, || self.asm.new_label());
                self.place(label);
                self.state = SelectorState::default();
            }
            IrOp::Jump { to, kind } => {
                let to = self.jump_labels.label(*to, || self.asm.new_label());
                let role = self.jump_labels.role(*kind, || self.asm.new_label());
                self.pending.push(PendingCode::ProgramJump(to, role));
            }
            IrOp::Logic { dst, function: is } => self.logic(*dst, *is),
            IrOp::Lookup { dst, index, table } => self.lookup(*dst, *index, *table, live),
            IrOp::Send { value } => self.send(*value),
            IrOp::WaitSent => self.wait_sent(),
            IrOp::Receive { dst } => self.receive(*dst),
            IrOp::If { cond, if_true: then, if_false: otherwise } => self.branch(*cond, then, otherwise, live),
            // The checks refuse these, because the chips have no such peripherals.
            IrOp::ReadAdc { .. }
            | IrOp::SetPwm { .. }
            | IrOp::Transfer { .. }
            | IrOp::ReadEeprom { .. }
            | IrOp::WriteEeprom { .. }
            | IrOp::Module { .. } => {}
        }
        if !live {
            self.state.acc = AccumulatorState::default();
        }
    }
}
