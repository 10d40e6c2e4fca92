//! Code around the rungs: reset, and the subroutines that a program uses.

use emu_8051::isa::Mcs51OpKind;

use super::arch::{Mcs51Arch, Mcs51Jump};
use super::byte_ops::AluOp;
use super::known_state::{ByteOperand, SelectorState};
use super::layout::Mcs51Layout;
use super::registers::{ACC, B, DPL, SIGN};
use super::select::{Mcs51Selector, PendingCode};
use crate::code::{CodeLabel, CodeWriter};
use crate::ir::Ir;

/// Emits the reset code: first drives outputs low, because reset leaves all ports high; then initializes RAM.
pub(super) fn emit_reset(asm: &mut CodeWriter<Mcs51Arch>, ir: &Ir, layout: &Mcs51Layout) {
    let outputs = || layout.ports.iter().filter(|port| port.outputs != 0);
    for port in outputs() {
        asm.op(Mcs51OpKind::MovDirImm, &[port.sfr.into(), i32::from(!port.outputs)]);
    }
    if layout.ram_bytes > 0 {
        let again = asm.new_label();
        asm.op(Mcs51OpKind::MovRegImm, &[0, i32::from(layout.highest_address.max(1))]);
        asm.op(Mcs51OpKind::ClrA, &[]);
        asm.place_label(again);
        asm.op(Mcs51OpKind::MovIndA, &[0]);
        asm.jump_back(Mcs51Jump::conditional(Mcs51OpKind::DjnzReg, &[0]), again, layout.highest_address.max(1).into());
    }
    for port in outputs().filter(|port| port.outputs != 0xFF) {
        if let Some(image) = port.output {
            asm.op(Mcs51OpKind::MovDirImm, &[image.into(), i32::from(!port.outputs)]);
        }
    }
    for bit in ir.initial_bits() {
        let at = layout.bit(bit);
        asm.op(Mcs51OpKind::OrlDirImm, &[at.byte.into(), i32::from(1_u8 << at.bit)]);
    }
    for (n, cell) in ir.words.iter().enumerate() {
        let at = layout.word(crate::ir::WordId(n as u32));
        for (at, byte) in (at..).zip(cell.initial.to_le_bytes()).take(cell.bytes.into()).filter(|(_, byte)| *byte != 0)
        {
            if at < 0x80 {
                asm.op(Mcs51OpKind::MovDirImm, &[at.into(), byte.into()]);
            } else {
                asm.op(Mcs51OpKind::MovRegImm, &[0, at.into()]);
                asm.op(Mcs51OpKind::MovIndImm, &[0, byte.into()]);
            }
        }
    }
}

impl Mcs51Selector<'_> {
    /// Emits the subroutine that replaces the first of two integers of `width` bytes by their product.
    pub(super) fn multiplication(&mut self, entry: CodeLabel, width: usize) {
        let scratch = self.layout.scratch.clone();
        let at = |n: usize| scratch.get(n).copied().unwrap_or(0);
        self.begin_unknown(entry);
        if width == 2 {
            let [a0, a1, b0, b1] = [0, 1, 2, 3].map(at);
            self.load(ByteOperand::At(a0));
            self.multiply_byte(ByteOperand::At(b1));
            self.save(b1);
            self.load(ByteOperand::At(a1));
            self.multiply_byte(ByteOperand::At(b0));
            self.alu(AluOp::Add, ByteOperand::At(b1));
            self.save(b1);
            self.load(ByteOperand::At(a0));
            self.multiply_byte(ByteOperand::At(b0));
            self.save(a0);
            self.load(ByteOperand::Sfr(B));
            self.alu(AluOp::Add, ByteOperand::At(b1));
            self.save(a1);
        } else {
            let sum = |n: usize| at(2 * width + n);
            (0..width).for_each(|n| self.copy_zero(sum(n)));
            for (i, j) in (0..width).flat_map(|i| (0..width - i).map(move |j| (i, j))) {
                let k = i + j;
                self.load(ByteOperand::At(at(j)));
                self.multiply_byte(ByteOperand::At(at(width + i)));
                self.alu(AluOp::Add, ByteOperand::At(sum(k)));
                self.save(sum(k));
                for m in k + 1..width {
                    self.load(if m == k + 1 { ByteOperand::Sfr(B) } else { ByteOperand::Imm(0) });
                    self.alu(AluOp::Addc, ByteOperand::At(sum(m)));
                    self.save(sum(m));
                }
            }
            (0..width).for_each(|n| self.copy(at(n), ByteOperand::At(sum(n))));
        }
        self.emit(Mcs51OpKind::Ret, &[]);
        self.flush();
    }

    /// Emits the subroutine that replaces the first of two integers of `width` bytes by their quotient.
    ///
    /// It divides magnitudes. A divisor of 0 gives a quotient of all ones, which with the sign of the
    /// dividend is -1 or 1, as the language requires.
    pub(super) fn division(&mut self, entry: CodeLabel, width: usize) {
        let scratch = self.layout.scratch.clone();
        let at = |n: usize| scratch.get(n).copied().unwrap_or(0);
        let [x, y, rest] = [0, 1, 2].map(|n| (n * width..(n + 1) * width).map(at).collect::<Vec<u8>>());
        let (count, top) = (at(3 * width), width - 1);
        self.begin_unknown(entry);
        self.load(ByteOperand::At(at(top)));
        self.alu(AluOp::Xrl, ByteOperand::At(at(width + top)));
        self.emit(Mcs51OpKind::MovCBit, &[ACC + 7]);
        self.emit(Mcs51OpKind::MovBitC, &[SIGN]);
        for number in [&x, &y] {
            self.load(ByteOperand::At(number.get(top).copied().unwrap_or(0)));
            self.negate_if(ACC + 7, number);
        }
        match width {
            1 => self.divide_bytes(at(0), at(1)),
            2 => self.divide_words([0, 1, 2, 3, 4, 5].map(at), count),
            _ => self.divide_long(&x, &y, &rest, count),
        }
        self.negate_if(SIGN, &x);
        self.emit(Mcs51OpKind::Ret, &[]);
        self.flush();
    }

    /// Divides two unsigned bytes with DIV; the quotient is FFh if the divisor is 0.
    fn divide_bytes(&mut self, x: u8, y: u8) {
        let zero = self.asm.new_label();
        self.load(ByteOperand::At(y));
        self.emit(Mcs51OpKind::MovDirA, &[B]);
        self.jump(Mcs51OpKind::Jz, &[], zero);
        self.load(ByteOperand::At(x));
        self.emit(Mcs51OpKind::DivAb, &[]);
        self.emit(Mcs51OpKind::CplA, &[]);
        self.begin_unknown(zero);
        self.emit(Mcs51OpKind::CplA, &[]);
        self.save(x);
    }

    /// Divides two unsigned words.
    ///
    /// The high byte of the quotient comes from DIV if the divisor has one byte, and is 0 if it has two. So
    /// eight iterations remain; the remainder starts as the high byte of the dividend, or as the remainder of
    /// DIV.
    fn divide_words(&mut self, [x0, x1, y0, y1, rest0, rest1]: [u8; 6], count: u8) {
        let (two, zero, go, again, smaller) = (
            self.asm.new_label(),
            self.asm.new_label(),
            self.asm.new_label(),
            self.asm.new_label(),
            self.asm.new_label(),
        );
        self.load(ByteOperand::At(y1));
        self.jump(Mcs51OpKind::Jnz, &[], two);
        self.load(ByteOperand::At(y0));
        self.jump(Mcs51OpKind::Jz, &[], zero);
        self.emit(Mcs51OpKind::MovDirA, &[B]);
        self.load(ByteOperand::At(x1));
        self.emit(Mcs51OpKind::DivAb, &[]);
        self.state = SelectorState::default();
        self.save(x1);
        self.copy(rest0, ByteOperand::Sfr(B));
        self.pending.push(PendingCode::Jump(Mcs51Jump::Unconditional, go));
        // High byte of the quotient: 0 if the divisor has two bytes; FFh if the divisor is 0.
        self.begin_unknown(two);
        self.load(ByteOperand::Imm(0xFF));
        self.begin_unknown(zero);
        self.emit(Mcs51OpKind::CplA, &[]);
        match x1 {
            0..8 => self.emit(Mcs51OpKind::XchReg, &[x1.into()]),
            _ => self.emit(Mcs51OpKind::XchDir, &[x1.into()]),
        }
        self.save(rest0);
        self.begin_unknown(go);
        self.copy(rest1, ByteOperand::Imm(0));
        self.copy(count, ByteOperand::Imm(8));
        self.begin_unknown(again);
        self.shift_left(&[x0, rest0, rest1]);
        // The remainder is less than the divisor, which is at most half of the range, so no bit was shifted
        // out.
        self.load(ByteOperand::At(rest0));
        self.alu(AluOp::Subb, ByteOperand::At(y0));
        self.emit(Mcs51OpKind::MovDirA, &[DPL]);
        self.load(ByteOperand::At(rest1));
        self.alu(AluOp::Subb, ByteOperand::At(y1));
        self.jump(Mcs51OpKind::Jc, &[], smaller);
        self.save(rest1);
        self.copy(rest0, ByteOperand::Sfr(DPL));
        self.step_byte(x0, true);
        self.begin_unknown(smaller);
        self.decrement_and_loop(count, again, 8);
    }

    /// Divides two unsigned numbers of three or four bytes, bit by bit.
    fn divide_long(&mut self, x: &[u8], y: &[u8], rest: &[u8], count: u8) {
        let (again, smaller) = (self.asm.new_label(), self.asm.new_label());
        let bits = 8 * x.len() as u8;
        rest.iter().for_each(|&at| self.copy_zero(at));
        self.copy(count, ByteOperand::Imm(bits));
        self.begin_unknown(again);
        self.shift_left(&[x, rest].concat());
        for (&rest, &y) in rest.iter().zip(y) {
            self.load(ByteOperand::At(rest));
            self.alu(AluOp::Subb, ByteOperand::At(y));
        }
        self.jump(Mcs51OpKind::Jc, &[], smaller);
        for (&rest, &y) in rest.iter().zip(y) {
            self.load(ByteOperand::At(rest));
            self.alu(AluOp::Subb, ByteOperand::At(y));
            self.save(rest);
        }
        x.iter().take(1).for_each(|&at| self.step_byte(at, true));
        self.begin_unknown(smaller);
        self.decrement_and_loop(count, again, bits.into());
    }

    /// Shifts bytes left by one bit, lowest first. The carry is 0 afterwards if the highest was below 80h.
    fn shift_left(&mut self, bytes: &[u8]) {
        self.emit(Mcs51OpKind::ClrC, &[]);
        for &at in bytes {
            self.load(ByteOperand::At(at));
            self.emit(Mcs51OpKind::RlcA, &[]);
            self.state.a = None;
            self.save(at);
        }
    }

    /// Decrements the counter and jumps back until it is 0.
    fn decrement_and_loop(&mut self, count: u8, again: CodeLabel, times: u32) {
        let jump_form = match count {
            0..8 => Mcs51Jump::conditional(Mcs51OpKind::DjnzReg, &[count.into()]),
            _ => Mcs51Jump::conditional(Mcs51OpKind::DjnzDir, &[count.into()]),
        };
        self.pending.push(PendingCode::Repeat(jump_form, again, times));
        self.state = SelectorState::default();
    }

    /// Negates a number if a bit is 1.
    fn negate_if(&mut self, bit: i32, number: &[u8]) {
        let positive = self.asm.new_label();
        self.jump(Mcs51OpKind::Jnb, &[bit], positive);
        self.emit(Mcs51OpKind::ClrC, &[]);
        for &at in number {
            self.load(ByteOperand::Imm(0));
            self.alu(AluOp::Subb, ByteOperand::At(at));
            self.save(at);
        }
        self.begin_unknown(positive);
    }

    fn copy_zero(&mut self, at: u8) {
        self.load(ByteOperand::Imm(0));
        self.save(at);
    }

    /// Places a label at which nothing is known.
    fn begin_unknown(&mut self, label: CodeLabel) {
        self.place(label);
        self.state = SelectorState::default();
    }
}
