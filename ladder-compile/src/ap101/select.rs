//! Selects AP101 instructions for the intermediate code.
//!
//! Most operations become one instruction. The selector tracks whether A holds the accumulator or its
//! complement, because both cost the same and the next operation often prefers one of them. It also tracks
//! the value of A where that is known.

use std::collections::HashMap;

use emu_ap101::isa::Ap101OpKind;
use ladder::CounterKind;

use super::acc_use::{OpContinuation, prefers_inverted, reads_acc};
use super::layout::{self, Ap101Layout, M_ZONE, R_ZONE, RESET_OFFSET};
use super::{Ap101Arch, Ap101Jump};
use crate::code::{CodeLabel, CodeWriter};
use crate::ir::{BitId, BranchCondition, IrOp, LogicOp, TimedModule, WordId};
use crate::jump_roles::JumpLabels;

/// Selects instructions for a scan.
pub(super) struct Ap101Selector<'a, 'b> {
    /// Writer that receives the instructions.
    pub asm: &'b mut CodeWriter<Ap101Arch>,
    layout: &'a Ap101Layout,
    /// Remaining operations of the scan.
    all_ops: &'a [&'a IrOp],
    /// True if A holds the complement of the accumulator.
    inverted: bool,
    /// Value of A if it is known at compile time, whether or not A is the accumulator.
    known: Option<bool>,
    /// Address of a bit that A currently equals, and true if A is its complement.
    held_bit: Option<(u16, bool)>,
    /// Temporaries that are not stored, because another bit equals them for as long as they are read: its
    /// address, and true if it is the complement.
    equal_bits: HashMap<BitId, (u16, bool)>,
    /// True if an elided load means that A does not really hold `held_bit`.
    holds_nothing_real: bool,
    /// Labels of the program's jumps.
    jump_labels: JumpLabels<CodeLabel>,
}

impl<'a, 'b> Ap101Selector<'a, 'b> {
    /// Creates a selector; [`Ap101Selector::select_next`] takes the operations `all` of the scan one after
    /// the other.
    pub(super) fn new(asm: &'b mut CodeWriter<Ap101Arch>, layout: &'a Ap101Layout, all: &'a [&'a IrOp]) -> Self {
        Ap101Selector {
            asm,
            layout,
            all_ops: all,
            inverted: false,
            known: None,
            held_bit: None,
            equal_bits: HashMap::new(),
            holds_nothing_real: false,
            jump_labels: JumpLabels::default(),
        }
    }

    /// Selects instructions for the next operation of the scan.
    pub(super) fn select_next(&mut self) {
        if let Some((op, ops)) = self.all_ops.split_first() {
            self.all_ops = ops;
            self.op(op, &OpContinuation { ops, then: None });
        }
    }

    /// Copies outputs from their images to their channels.
    pub(super) fn copy_late_outputs(&mut self) {
        for &(image, channel) in &self.layout.late_outputs {
            self.emit(Ap101OpKind::Ld, image);
            self.emit(Ap101OpKind::Sto, channel);
        }
    }

    fn emit(&mut self, kind: Ap101OpKind, addr: u16) {
        self.asm.op(kind, &[addr.into()]);
        let writes = matches!(kind, Ap101OpKind::Sto | Ap101OpKind::Stoc | Ap101OpKind::Stc | Ap101OpKind::Rtc);
        if !writes || self.held_bit.is_some_and(|(held, _)| held == addr) {
            self.held_bit = None;
        }
        if !writes {
            self.known = None;
        }
        // Reading a module does not return the value written to it.
        match kind {
            Ap101OpKind::Ld | Ap101OpKind::Ldc => self.held_bit = Some((addr, kind == Ap101OpKind::Ldc)),
            Ap101OpKind::Sto | Ap101OpKind::Stoc if !(R_ZONE..M_ZONE).contains(&addr) => {
                self.held_bit = Some((addr, kind == Ap101OpKind::Stoc))
            }
            _ => {}
        }
    }

    fn bit(&self, bit: BitId) -> u16 {
        self.layout.bits.get(bit.0 as usize).copied().unwrap_or(0)
    }

    /// Address where a bit can be read, and true if its complement is there.
    fn source(&self, bit: BitId) -> (u16, bool) {
        self.equal_bits.get(&bit).copied().unwrap_or((self.bit(bit), false))
    }

    /// True if a temporary can be an alias of `addr` for as long as it is read; `rest` follows its store.
    fn stays_valid(&self, bit: BitId, addr: u16, rest: &OpContinuation<'_>) -> bool {
        self.layout.temporary.contains(&bit)
            && rest.then.is_none()
            && addr != self.layout.scratch
            && !(R_ZONE..M_ZONE).contains(&addr)
            && self.is_unchanged_until_set(rest.ops, bit, addr)
    }

    /// Stores the accumulator in a temporary by recording which bit equals it.
    ///
    /// Returns false if no bit equals it, or not for long enough.
    fn alias_temporary(&mut self, bit: BitId, negated: bool, rest: &OpContinuation<'_>) -> bool {
        self.equal_bits.remove(&bit);
        if let Some((addr, complement)) = self.held_bit
            && self.stays_valid(bit, addr, rest)
        {
            self.equal_bits.insert(bit, (addr, complement != (self.inverted != negated)));
        }
        self.equal_bits.contains_key(&bit)
    }

    /// True if the value loaded from `addr` is only stored to a temporary that becomes an alias.
    fn is_load_unneeded(&self, addr: u16, rest: &OpContinuation<'_>) -> bool {
        let Some((IrOp::Store { bit, .. }, ops)) = rest.ops.split_first() else { return false };
        let behind = OpContinuation { ops, then: rest.then };
        !reads_acc(&behind) && self.stays_valid(*bit, addr, &behind)
    }

    /// True if neither `bit` nor `addr` is written before `bit` certainly gets a new value.
    fn is_unchanged_until_set(&self, ops: &[&IrOp], bit: BitId, addr: u16) -> bool {
        for op in ops {
            if matches!(op, IrOp::Store { bit: other, .. } | IrOp::SetBit { bit: other, .. } | IrOp::Logic { dst: other, .. } if *other == bit)
            {
                return true;
            }
            let mut written = false;
            layout::for_each_nested_op(op, &mut |op| {
                // What is executed between a jump and its label may write anything.
                written |= matches!(op, IrOp::Jump { .. } | IrOp::Label(_));
                written |= layout::written_bit(op).is_some_and(|other| other == bit || self.bit(other) == addr);
            });
            if written {
                return false;
            }
        }
        true
    }

    fn module(&self, word: WordId) -> u16 {
        R_ZONE + self.layout.words.get(word.0 as usize).copied().unwrap_or(0)
    }

    fn not(&mut self) {
        self.asm.op(Ap101OpKind::Not, &[]);
        self.inverted = !self.inverted;
        self.known = self.known.map(|a| !a);
        self.held_bit = self.held_bit.map(|(bit, complement)| (bit, !complement));
    }

    fn clear(&mut self) {
        if self.known != Some(false) {
            self.asm.op(Ap101OpKind::Clr, &[]);
            (self.known, self.held_bit) = (Some(false), None);
        }
    }

    /// Makes A hold the accumulator, or its complement if `inverted`.
    fn set_inversion(&mut self, inverted: bool) {
        if self.inverted != inverted {
            self.not();
        }
    }

    fn load(&mut self, addr: u16, negated: bool, rest: &OpContinuation<'_>) {
        if let Some((_, complement)) = self.held_bit.filter(|(held, _)| *held == addr) {
            self.inverted = complement != negated;
            return;
        }
        self.inverted = prefers_inverted(rest);
        self.emit(if negated == self.inverted { Ap101OpKind::Ld } else { Ap101OpKind::Ldc }, addr);
    }

    fn store(&mut self, addr: u16, negated: bool) {
        self.emit(if negated == self.inverted { Ap101OpKind::Sto } else { Ap101OpKind::Stoc }, addr);
    }

    /// acc := acc and the bit; if A holds the complement, this is an OR of complements.
    fn and(&mut self, addr: u16, negated: bool) {
        let kind = match (self.inverted, negated) {
            (false, false) => Ap101OpKind::And,
            (false, true) => Ap101OpKind::Andc,
            (true, false) => Ap101OpKind::Orc,
            (true, true) => Ap101OpKind::Or,
        };
        self.emit(kind, addr);
    }

    fn or(&mut self, addr: u16, negated: bool) {
        let kind = match (self.inverted, negated) {
            (false, false) => Ap101OpKind::Or,
            (false, true) => Ap101OpKind::Orc,
            (true, false) => Ap101OpKind::Andc,
            (true, true) => Ap101OpKind::And,
        };
        self.emit(kind, addr);
    }

    /// Sets a bit to a constant and preserves the accumulator.
    fn constant(&mut self, addr: u16, value: bool, rest: &OpContinuation<'_>) {
        let write = if value { Ap101OpKind::Stc } else { Ap101OpKind::Rtc };
        if self.known.is_none() {
            if reads_acc(rest) {
                self.emit(write, addr);
                self.not();
                return self.emit(write, addr);
            }
            self.clear();
        }
        self.emit(if self.known == Some(value) { Ap101OpKind::Sto } else { Ap101OpKind::Stoc }, addr);
    }

    fn op(&mut self, op: &IrOp, rest: &OpContinuation<'_>) {
        match op {
            IrOp::SetAccumulator(value) => {
                self.clear();
                self.inverted = *value;
            }
            IrOp::Load { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                if self.is_load_unneeded(addr, rest) {
                    // Track A as if it held the bit, until the store is done.
                    (self.held_bit, self.inverted, self.holds_nothing_real) =
                        (Some((addr, false)), *negated != complement, true);
                } else {
                    self.load(addr, *negated != complement, rest);
                }
            }
            IrOp::And { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                self.and(addr, *negated != complement);
            }
            IrOp::Or { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                self.or(addr, *negated != complement);
            }
            IrOp::Store { bit, negated } => {
                if !self.alias_temporary(*bit, *negated, rest) {
                    self.store(self.bit(*bit), *negated);
                }
                if std::mem::take(&mut self.holds_nothing_real) {
                    self.held_bit = None;
                }
            }
            IrOp::SetBit { bit, value } => {
                self.equal_bits.remove(bit);
                self.constant(self.bit(*bit), *value, rest);
            }
            IrOp::Rising(memory) => self.rising(self.bit(*memory)),
            IrOp::Falling(memory) => self.falling(self.bit(*memory)),
            // A RES: other operations that move numbers were refused before.
            IrOp::Move { dst, .. } => self.constant(self.module(*dst) + RESET_OFFSET, true, rest),
            IrOp::Module { module: is, word, .. } => self.element(*is, *word, rest),
            IrOp::Logic { dst, function: is } => {
                self.logic(self.bit(*dst), *is);
                self.equal_bits.remove(dst);
            }
            IrOp::Label(label) => {
                let label = self.jump_labels.label(*label, || self.asm.new_label());
                self.asm.place_label(label);
                (self.known, self.held_bit, self.inverted) = (None, None, false);
            }
            IrOp::Jump { to, kind } => {
                let to = self.jump_labels.label(*to, || self.asm.new_label());
                let role = self.jump_labels.role(*kind, || self.asm.new_label());
                self.asm.jump_with_role(Ap101Jump::Unconditional, to, role, 0);
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => self.branch(*cond, then, otherwise, rest),
            // `limits` refused these operations before.
            IrOp::AndCompare(_)
            | IrOp::Math { .. }
            | IrOp::Lookup { .. }
            | IrOp::ReadAdc { .. }
            | IrOp::SetPwm { .. }
            | IrOp::Send { .. }
            | IrOp::Receive { .. }
            | IrOp::Transfer { .. }
            | IrOp::WaitSent
            | IrOp::ReadEeprom { .. }
            | IrOp::WriteEeprom { .. } => {}
        }
    }

    /// Selects a rising edge in two steps: clear the memory if the input is 0; then the output is the input
    /// AND NOT memory, and the memory is set where the output is 1.
    fn rising(&mut self, memory: u16) {
        self.set_inversion(true);
        self.emit(Ap101OpKind::Rtc, memory);
        self.not();
        self.emit(Ap101OpKind::Andc, memory);
        self.emit(Ap101OpKind::Stc, memory);
    }

    /// Selects a falling edge: the rising edge with input and memory complemented.
    fn falling(&mut self, memory: u16) {
        self.set_inversion(false);
        self.emit(Ap101OpKind::Stc, memory);
        self.not();
        self.emit(Ap101OpKind::And, memory);
        self.emit(Ap101OpKind::Rtc, memory);
        self.inverted = false;
    }

    /// Selects the fixed template of a three-address operation.
    fn logic(&mut self, dst: u16, is: LogicOp) {
        let (first, second) = match is {
            LogicOp::Copy(a) => ((Ap101OpKind::Ld, Ap101OpKind::Ldc, a), None),
            LogicOp::Not(a) => ((Ap101OpKind::Ldc, Ap101OpKind::Ld, a), None),
            LogicOp::And(a, b) => {
                ((Ap101OpKind::Ld, Ap101OpKind::Ldc, a), Some((Ap101OpKind::And, Ap101OpKind::Andc, b)))
            }
            LogicOp::Or(a, b) => ((Ap101OpKind::Ld, Ap101OpKind::Ldc, a), Some((Ap101OpKind::Or, Ap101OpKind::Orc, b))),
        };
        for (plain, complemented, bit) in std::iter::once(first).chain(second) {
            let (addr, complement) = self.source(bit);
            self.emit(if complement { complemented } else { plain }, addr);
        }
        self.emit(Ap101OpKind::Sto, dst);
        self.inverted = false;
    }

    /// Selects the code of a timer or counter.
    fn element(&mut self, is: TimedModule, word: WordId, rest: &OpContinuation<'_>) {
        let module = self.module(word);
        let circular = matches!(is, TimedModule::Counter { kind: CounterKind::Ctc, .. });
        if layout::writes_input_directly(is) {
            self.store(module, false);
            // The output of a CTC is its input.
            if !circular && reads_acc(rest) {
                self.load(module, false, rest);
            }
            return;
        }
        let TimedModule::Counter { kind, input, bounded } = is else { return };
        let scratch = self.layout.scratch;
        // The module counts edges of the written value, so the code writes a 0 before each 1. Q then follows
        // the count.
        self.store(scratch, false);
        self.clear();
        self.emit(Ap101OpKind::Sto, module);
        self.emit(if matches!(input, '/' | 'o') { Ap101OpKind::Ldc } else { Ap101OpKind::Ld }, scratch);
        self.inverted = input == '/';
        let edge = self.layout.module_edge_bits.get(&word).copied().unwrap_or(scratch);
        match input {
            '/' => self.rising(edge),
            '\\' => self.falling(edge),
            _ => {}
        }
        match kind {
            CounterKind::Ctu if bounded => self.emit(Ap101OpKind::Andc, module),
            CounterKind::Ctd if bounded => self.emit(Ap101OpKind::And, module),
            _ => {}
        }
        self.emit(Ap101OpKind::Sto, module);
        self.load(if circular { scratch } else { module }, false, rest);
    }

    fn branch(&mut self, cond: BranchCondition, then: &[IrOp], otherwise: &[IrOp], rest: &OpContinuation<'_>) {
        let simple = |ops: &[IrOp]| ops.iter().all(|op| matches!(op, IrOp::SetBit { .. } | IrOp::Move { .. }));
        match cond {
            BranchCondition::Acc if simple(then) && simple(otherwise) => {
                for (ops, inverted) in [(then, false), (otherwise, true)] {
                    ops.iter().for_each(|op| self.write_conditionally(op, inverted));
                }
            }
            BranchCondition::Acc => {
                self.set_inversion(false);
                self.select_arms(then, otherwise, None, rest);
            }
            BranchCondition::Bit(bit) => {
                if let ([IrOp::Store { bit: stored, negated: false }], [IrOp::SetBit { bit: set, value: true }]) =
                    (then, otherwise)
                    && *stored == bit
                    && *set == bit
                    && !reads_acc(rest)
                {
                    // The master relay: turn it on if it was off, else set it to the accumulator.
                    self.or(self.bit(bit), true);
                    return self.store(self.bit(bit), false);
                }
                let scratch = self.layout.scratch;
                let (then_ops, other_ops): (Vec<&IrOp>, Vec<&IrOp>) =
                    (then.iter().collect(), otherwise.iter().collect());
                let reads = |ops: &[&IrOp]| reads_acc(&OpContinuation { ops, then: Some(rest) });
                let kept = reads(&then_ops) || reads(&other_ops);
                if kept {
                    self.store(scratch, false);
                }
                let (addr, complement) = self.source(bit);
                self.emit(if complement { Ap101OpKind::Ldc } else { Ap101OpKind::Ld }, addr);
                self.inverted = false;
                self.select_arms(then, otherwise, kept.then_some(scratch), rest);
            }
            // `limits` refused these before.
            BranchCondition::Compare(_) => {}
        }
    }

    /// Writes a constant or resets a module, if the accumulator is 1, or if it is 0 with `inverted`.
    fn write_conditionally(&mut self, op: &IrOp, inverted: bool) {
        let (kind, addr) = match op {
            IrOp::SetBit { bit, value } => (if *value { Ap101OpKind::Stc } else { Ap101OpKind::Rtc }, self.bit(*bit)),
            IrOp::Move { dst, .. } => (Ap101OpKind::Stc, self.module(*dst) + RESET_OFFSET),
            _ => return,
        };
        self.set_inversion(inverted);
        self.emit(kind, addr);
    }

    /// Selects two lists; A chooses which one is executed. `from` is the bit that holds the accumulator if A
    /// does not.
    fn select_arms(&mut self, then: &[IrOp], otherwise: &[IrOp], from: Option<u16>, rest: &OpContinuation<'_>) {
        let (first, end) = (self.asm.new_label(), self.asm.new_label());
        self.asm.jump(Ap101Jump::IfSet, first);
        self.select_arm(otherwise, false, from, rest);
        self.asm.jump(Ap101Jump::Unconditional, end);
        self.asm.place_label(first);
        self.select_arm(then, true, from, rest);
        self.asm.place_label(end);
        (self.known, self.held_bit) = (None, None);
    }

    fn select_arm(&mut self, list: &[IrOp], a: bool, from: Option<u16>, rest: &OpContinuation<'_>) {
        let ops: Vec<&IrOp> = list.iter().collect();
        (self.inverted, self.known, self.held_bit) = (false, Some(a), None);
        let mut here = OpContinuation { ops: &ops, then: Some(rest) };
        if let Some(from) = from
            && reads_acc(&here)
        {
            self.load(from, false, &here);
        }
        while let Some((op, ops)) = here.ops.split_first() {
            here.ops = ops;
            self.op(op, &here);
        }
        if reads_acc(rest) {
            self.set_inversion(false);
        }
        self.inverted = false;
    }
}
