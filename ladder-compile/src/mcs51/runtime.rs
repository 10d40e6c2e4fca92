//! What stands around the rungs: reset, and the subroutines that a program uses.

use emu_8051::isa::Kind;

use super::arch::{Jump, Mcs51};
use super::bytes::Alu;
use super::layout::Layout;
use super::regs::{ACC, B, DPL, SIGN};
use super::select::{Line, Select};
use super::state::{Byte, State};
use crate::code::{Asm, Label};
use crate::ir::Ir;

/// From reset on: outputs low before anything else, since reset leaves all ports high; then RAM, whatever it held.
pub(super) fn reset(asm: &mut Asm<Mcs51>, ir: &Ir, layout: &Layout) {
    let outputs = || layout.ports.iter().filter(|port| port.outputs != 0);
    for port in outputs() {
        asm.op(Kind::MovDirImm, &[port.sfr.into(), i32::from(!port.outputs)]);
    }
    if layout.ram_bytes > 0 {
        let again = asm.label();
        asm.op(Kind::MovRegImm, &[0, i32::from(layout.top.max(1))]);
        asm.op(Kind::ClrA, &[]);
        asm.place(again);
        asm.op(Kind::MovIndA, &[0]);
        asm.repeat(Jump::when(Kind::DjnzReg, &[0]), again, layout.top.max(1).into());
    }
    for port in outputs().filter(|port| port.outputs != 0xFF) {
        if let Some(image) = port.output {
            asm.op(Kind::MovDirImm, &[image.into(), i32::from(!port.outputs)]);
        }
    }
    for (n, cell) in ir.words.iter().enumerate() {
        let at = layout.word(crate::ir::Word(n as u32));
        for (at, byte) in (at..).zip(cell.initial.to_le_bytes()).take(cell.bytes.into()).filter(|(_, byte)| *byte != 0)
        {
            if at < 0x80 {
                asm.op(Kind::MovDirImm, &[at.into(), byte.into()]);
            } else {
                asm.op(Kind::MovRegImm, &[0, at.into()]);
                asm.op(Kind::MovIndImm, &[0, byte.into()]);
            }
        }
    }
}

impl Select<'_> {
    /// The product of two integers of `width` bytes takes the place of the first.
    pub(super) fn multiplication(&mut self, entry: Label, width: usize) {
        let scratch = self.layout.scratch.clone();
        let at = |n: usize| scratch.get(n).copied().unwrap_or(0);
        self.begin(entry);
        if width == 2 {
            let [a0, a1, b0, b1] = [0, 1, 2, 3].map(at);
            self.load(Byte::At(a0));
            self.times(Byte::At(b1));
            self.save(b1);
            self.load(Byte::At(a1));
            self.times(Byte::At(b0));
            self.alu(Alu::Add, Byte::At(b1));
            self.save(b1);
            self.load(Byte::At(a0));
            self.times(Byte::At(b0));
            self.save(a0);
            self.load(Byte::Sfr(B));
            self.alu(Alu::Add, Byte::At(b1));
            self.save(a1);
        } else {
            let sum = |n: usize| at(2 * width + n);
            (0..width).for_each(|n| self.copy_zero(sum(n)));
            for (i, j) in (0..width).flat_map(|i| (0..width - i).map(move |j| (i, j))) {
                let k = i + j;
                self.load(Byte::At(at(j)));
                self.times(Byte::At(at(width + i)));
                self.alu(Alu::Add, Byte::At(sum(k)));
                self.save(sum(k));
                for m in k + 1..width {
                    self.load(if m == k + 1 { Byte::Sfr(B) } else { Byte::Imm(0) });
                    self.alu(Alu::Addc, Byte::At(sum(m)));
                    self.save(sum(m));
                }
            }
            (0..width).for_each(|n| self.copy(at(n), Byte::At(sum(n))));
        }
        self.emit(Kind::Ret, &[]);
        self.flush();
    }

    /// The quotient of two integers of `width` bytes takes the place of the first. Magnitudes are divided; with a divisor of 0
    /// every bit of the quotient is 1, which with the dividend's sign is -1 or 1, as the language has it.
    pub(super) fn division(&mut self, entry: Label, width: usize) {
        let scratch = self.layout.scratch.clone();
        let at = |n: usize| scratch.get(n).copied().unwrap_or(0);
        let [x, y, rest] = [0, 1, 2].map(|n| (n * width..(n + 1) * width).map(at).collect::<Vec<u8>>());
        let (count, top) = (at(3 * width), width - 1);
        self.begin(entry);
        self.load(Byte::At(at(top)));
        self.alu(Alu::Xrl, Byte::At(at(width + top)));
        self.emit(Kind::MovCBit, &[ACC + 7]);
        self.emit(Kind::MovBitC, &[SIGN]);
        for number in [&x, &y] {
            self.load(Byte::At(number.get(top).copied().unwrap_or(0)));
            self.negate_if(ACC + 7, number);
        }
        match width {
            1 => self.divide_bytes(at(0), at(1)),
            2 => self.divide_words([0, 1, 2, 3, 4, 5].map(at), count),
            _ => self.divide_long(&x, &y, &rest, count),
        }
        self.negate_if(SIGN, &x);
        self.emit(Kind::Ret, &[]);
        self.flush();
    }

    /// Two bytes without sign: DIV, but FFh where the divisor is 0.
    fn divide_bytes(&mut self, x: u8, y: u8) {
        let zero = self.asm.label();
        self.load(Byte::At(y));
        self.emit(Kind::MovDirA, &[B]);
        self.jump(Kind::Jz, &[], zero);
        self.load(Byte::At(x));
        self.emit(Kind::DivAb, &[]);
        self.emit(Kind::CplA, &[]);
        self.begin(zero);
        self.emit(Kind::CplA, &[]);
        self.save(x);
    }

    /// Two bytes each, without sign. The high byte of the quotient comes from DIV where the divisor has one byte, and is 0
    /// where it has two, so that eight turns are left, with the high byte of the dividend, or what DIV left of it, as the remainder.
    fn divide_words(&mut self, [x0, x1, y0, y1, rest0, rest1]: [u8; 6], count: u8) {
        let (two, zero, go, again, smaller) =
            (self.asm.label(), self.asm.label(), self.asm.label(), self.asm.label(), self.asm.label());
        self.load(Byte::At(y1));
        self.jump(Kind::Jnz, &[], two);
        self.load(Byte::At(y0));
        self.jump(Kind::Jz, &[], zero);
        self.emit(Kind::MovDirA, &[B]);
        self.load(Byte::At(x1));
        self.emit(Kind::DivAb, &[]);
        self.now = State::default();
        self.save(x1);
        self.copy(rest0, Byte::Sfr(B));
        self.out.push(Line::Jump(Jump::Go, go));
        // 0 where the divisor has two bytes; FFh where it is 0.
        self.begin(two);
        self.load(Byte::Imm(0xFF));
        self.begin(zero);
        self.emit(Kind::CplA, &[]);
        match x1 {
            0..8 => self.emit(Kind::XchReg, &[x1.into()]),
            _ => self.emit(Kind::XchDir, &[x1.into()]),
        }
        self.save(rest0);
        self.begin(go);
        self.copy(rest1, Byte::Imm(0));
        self.copy(count, Byte::Imm(8));
        self.begin(again);
        self.shift(&[x0, rest0, rest1]);
        // The remainder is below the divisor, which is at most half of the range, so nothing was shifted out.
        self.load(Byte::At(rest0));
        self.alu(Alu::Subb, Byte::At(y0));
        self.emit(Kind::MovDirA, &[DPL]);
        self.load(Byte::At(rest1));
        self.alu(Alu::Subb, Byte::At(y1));
        self.jump(Kind::Jc, &[], smaller);
        self.save(rest1);
        self.copy(rest0, Byte::Sfr(DPL));
        self.step(x0, true);
        self.begin(smaller);
        self.turn(count, again, 8);
    }

    /// Three or four bytes each, without sign, bit by bit.
    fn divide_long(&mut self, x: &[u8], y: &[u8], rest: &[u8], count: u8) {
        let (again, smaller) = (self.asm.label(), self.asm.label());
        let bits = 8 * x.len() as u8;
        rest.iter().for_each(|&at| self.copy_zero(at));
        self.copy(count, Byte::Imm(bits));
        self.begin(again);
        self.shift(&[x, rest].concat());
        for (&rest, &y) in rest.iter().zip(y) {
            self.load(Byte::At(rest));
            self.alu(Alu::Subb, Byte::At(y));
        }
        self.jump(Kind::Jc, &[], smaller);
        for (&rest, &y) in rest.iter().zip(y) {
            self.load(Byte::At(rest));
            self.alu(Alu::Subb, Byte::At(y));
            self.save(rest);
        }
        x.iter().take(1).for_each(|&at| self.step(at, true));
        self.begin(smaller);
        self.turn(count, again, bits.into());
    }

    /// Bytes shifted left by one bit, the lowest first; the carry is 0 afterwards where the highest was below 80h.
    fn shift(&mut self, bytes: &[u8]) {
        self.emit(Kind::ClrC, &[]);
        for &at in bytes {
            self.load(Byte::At(at));
            self.emit(Kind::RlcA, &[]);
            self.now.a = None;
            self.save(at);
        }
    }

    /// Goes back until the count is 0.
    fn turn(&mut self, count: u8, again: Label, times: u32) {
        let turn = match count {
            0..8 => Jump::when(Kind::DjnzReg, &[count.into()]),
            _ => Jump::when(Kind::DjnzDir, &[count.into()]),
        };
        self.out.push(Line::Repeat(turn, again, times));
        self.now = State::default();
    }

    /// A number becomes its negative where a bit is 1.
    fn negate_if(&mut self, bit: i32, number: &[u8]) {
        let positive = self.asm.label();
        self.jump(Kind::Jnb, &[bit], positive);
        self.emit(Kind::ClrC, &[]);
        for &at in number {
            self.load(Byte::Imm(0));
            self.alu(Alu::Subb, Byte::At(at));
            self.save(at);
        }
        self.begin(positive);
    }

    fn copy_zero(&mut self, at: u8) {
        self.load(Byte::Imm(0));
        self.save(at);
    }

    /// A label at which nothing is known.
    fn begin(&mut self, label: Label) {
        self.place(label);
        self.now = State::default();
    }
}
