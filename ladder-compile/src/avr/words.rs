//! Selects AVR instructions for integers of one to four bytes: moves and arithmetic.
//!
//! A word in registers is processed in place if the instructions can reach it. Other words pass through A,
//! and the selector tracks what A holds.

use emu_avr::isa::AvrOpKind;

use super::layout::AvrCellPlace;
use super::registers::{A, B, LOW_ZERO, SCRATCH, ZERO};
use super::runtime::{AvrRoutine, negate};
use super::select::AvrSelector;
use crate::ir::{ArithmeticOp, WordId, WordOperand, shift_count};

/// Registers of a value, least significant byte first.
pub type RegisterQuad = [i32; 4];

/// The four registers from `reg` on.
#[must_use]
pub fn consecutive_registers(reg: i32) -> RegisterQuad {
    [reg, reg + 1, reg + 2, reg + 3]
}

/// Byte `n` of a constant.
#[must_use]
pub fn constant_byte(constant: i32, n: usize) -> i32 {
    constant >> (8 * n.min(3)) & 0xFF
}

/// True for the register pairs that ADIW and SBIW accept.
fn is_word_add_pair(reg: i32) -> bool {
    matches!(reg, 24 | 26 | 28 | 30)
}

impl AvrSelector<'_> {
    /// Registers that permanently hold a word; `None` if it is in RAM.
    #[must_use]
    pub fn home_registers(&self, word: WordId) -> Option<RegisterQuad> {
        match self.layout.word(word) {
            AvrCellPlace::Reg(reg) => Some(consecutive_registers(reg.into())),
            AvrCellPlace::Ram(_) => None,
        }
    }

    /// Width of a word in bytes.
    #[must_use]
    pub fn bytes(&self, word: WordId) -> usize {
        self.layout.bytes(word).into()
    }

    /// True if A holds `value`, sign-extended to at least `width` bytes.
    fn is_cached(&self, value: WordOperand, width: usize) -> bool {
        matches!((value, self.known.a), (WordOperand::Cell(word), Some((cached, to))) if word == cached && to >= width)
    }

    /// Registers that hold `value`, for reading only: its own registers, A, or `to`, whichever is cheapest.
    pub fn source_registers(&mut self, value: WordOperand, width: usize, to: RegisterQuad) -> RegisterQuad {
        match value {
            WordOperand::Cell(word) => {
                if let Some(home) = self.home_registers(word).filter(|_| self.bytes(word) >= width) {
                    return home;
                }
                if self.is_cached(value, width) {
                    return A;
                }
                self.load_value(value, width, to);
                to
            }
            WordOperand::Const(constant) => {
                let mut regs = to;
                for (n, reg) in regs.iter_mut().enumerate().take(width) {
                    match constant_byte(constant, n) {
                        0 => *reg = ZERO,
                        byte => self.asm.op(AvrOpKind::Ldi, &[*reg, byte]),
                    }
                }
                if to == A {
                    self.known.a = None;
                }
                regs
            }
        }
    }

    /// Emits `to` := `value`, sign-extended to `width` bytes. Constants need registers r16 and above.
    pub fn load_value(&mut self, value: WordOperand, width: usize, to: RegisterQuad) {
        if to == A && self.is_cached(value, width) {
            return;
        }
        match value {
            WordOperand::Const(constant) => {
                for (n, &reg) in to.iter().enumerate().take(width) {
                    match constant_byte(constant, n) {
                        0 if reg < 16 => self.asm.op(AvrOpKind::Mov, &[reg, ZERO]),
                        byte => self.asm.op(AvrOpKind::Ldi, &[reg, byte]),
                    }
                }
            }
            WordOperand::Cell(word) => {
                let available = self.bytes(word).min(width);
                if let Some(home) = self.home_registers(word) {
                    self.copy_registers(to, home, available);
                } else if self.is_cached(value, available) {
                    self.copy_registers(to, A, available);
                } else if let AvrCellPlace::Ram(addr) = self.layout.word(word) {
                    for (&reg, n) in to.iter().take(available).zip(0..) {
                        self.layout.load(self.asm, reg, addr + n);
                    }
                }
                self.sign_extend(to, available, width);
            }
        }
        if to == A {
            self.known.a = match value {
                WordOperand::Cell(word) => Some((word, width)),
                WordOperand::Const(_) => None,
            };
        }
    }

    /// Emits the sign extension from `have` to `width` bytes.
    pub fn sign_extend(&mut self, regs: RegisterQuad, have: usize, width: usize) {
        let (Some(&top), Some(&next)) = (regs.get(have.wrapping_sub(1)), regs.get(have)) else { return };
        if have >= width {
            return;
        }
        self.asm.op(AvrOpKind::Mov, &[next, top]);
        self.asm.op(AvrOpKind::Add, &[next, next]);
        self.asm.op(AvrOpKind::Sbc, &[next, next]);
        regs.iter().take(width).skip(have + 1).for_each(|&reg| self.asm.op(AvrOpKind::Mov, &[reg, next]));
    }

    /// Emits a copy of registers, with MOVW where both sides are pairs.
    pub fn copy_registers(&mut self, to: RegisterQuad, from: RegisterQuad, width: usize) {
        let mut n = 0;
        while n < width.min(4) {
            let (t, f) = (to[n], from[n]);
            let pair = n + 1 < width && t % 2 == 0 && f % 2 == 0 && to[n + 1] == t + 1 && from[n + 1] == f + 1;
            if t != f {
                self.asm.op(if pair { AvrOpKind::Movw } else { AvrOpKind::Mov }, &[t, f]);
            }
            n += if pair { 2 } else { 1 };
        }
    }

    /// Emits `dst` := the registers.
    pub fn store_registers(&mut self, dst: WordId, regs: RegisterQuad) {
        let width = self.bytes(dst);
        match self.layout.word(dst) {
            AvrCellPlace::Reg(reg) => self.copy_registers(consecutive_registers(reg.into()), regs, width),
            AvrCellPlace::Ram(addr) => {
                for (&reg, n) in regs.iter().take(width).zip(0..) {
                    self.layout.store(self.asm, addr + n, reg);
                }
            }
        }
        if regs == A {
            self.known.a = Some((dst, width));
        } else {
            self.invalidate_cached(dst);
        }
    }

    /// Forgets `dst` as the content of A, after it changed by another way.
    pub fn invalidate_cached(&mut self, dst: WordId) {
        self.known.a = self.known.a.filter(|(cached, _)| *cached != dst);
    }

    /// Emits dst := src.
    pub fn move_word(&mut self, dst: WordId, src: WordOperand) {
        let width = self.bytes(dst);
        if src == WordOperand::Cell(dst) {
            return;
        }
        match (src, self.layout.word(dst)) {
            (WordOperand::Const(0), AvrCellPlace::Reg(reg)) => {
                let zero = [LOW_ZERO, ZERO, LOW_ZERO, ZERO];
                let reg = i32::from(reg);
                // For a single register, either zero register is equally good.
                self.copy_registers(consecutive_registers(reg), if width == 1 { [ZERO; 4] } else { zero }, width);
                self.invalidate_cached(dst);
            }
            (WordOperand::Const(_), AvrCellPlace::Reg(reg)) if reg >= 16 => {
                self.load_value(src, width, consecutive_registers(reg.into()));
                self.invalidate_cached(dst);
            }
            (WordOperand::Const(constant), AvrCellPlace::Ram(addr)) => {
                let mut cached = None;
                for n in 0..width {
                    let byte = constant_byte(constant, n);
                    if byte != 0 && cached != Some(byte) {
                        self.asm.op(AvrOpKind::Ldi, &[SCRATCH, byte]);
                        cached = Some(byte);
                    }
                    self.layout.store(self.asm, addr + n as u16, if byte == 0 { ZERO } else { SCRATCH });
                }
                self.invalidate_cached(dst);
            }
            (WordOperand::Const(constant), AvrCellPlace::Reg(reg)) if width == 1 => {
                self.asm.op(AvrOpKind::Ldi, &[SCRATCH, constant_byte(constant, 0)]);
                self.asm.op(AvrOpKind::Mov, &[reg.into(), SCRATCH]);
                self.invalidate_cached(dst);
            }
            (WordOperand::Cell(_), AvrCellPlace::Reg(reg)) => {
                self.load_value(src, width, consecutive_registers(reg.into()));
                self.invalidate_cached(dst);
            }
            _ => {
                let regs = self.source_registers(src, width, A);
                self.store_registers(dst, regs);
            }
        }
    }

    /// Emits dst := a op b.
    pub fn math(&mut self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) {
        let width = usize::from(self.ir.width(op, dst, a, b));
        match (op, a, b) {
            (ArithmeticOp::Add, x, WordOperand::Const(c)) | (ArithmeticOp::Add, WordOperand::Const(c), x) => {
                self.add(dst, x, c)
            }
            (ArithmeticOp::Sub, x, WordOperand::Const(c)) => self.add(dst, x, c.wrapping_neg()),
            (ArithmeticOp::Add, a, b) if b == WordOperand::Cell(dst) => {
                self.add_or_subtract((AvrOpKind::Add, AvrOpKind::Adc), dst, b, a)
            }
            (ArithmeticOp::Add, a, b) => self.add_or_subtract((AvrOpKind::Add, AvrOpKind::Adc), dst, a, b),
            (ArithmeticOp::Sub, WordOperand::Const(0), b) if usize::from(self.layout.bytes(dst)) <= 2 => {
                self.negate_into(dst, b)
            }
            (ArithmeticOp::Sub, a, b) => self.add_or_subtract((AvrOpKind::Sub, AvrOpKind::Sbc), dst, a, b),
            (ArithmeticOp::Mul, a, b) => self.multiply(dst, a, b),
            (ArithmeticOp::And, a, b) => self.add_or_subtract((AvrOpKind::And, AvrOpKind::And), dst, a, b),
            (ArithmeticOp::Or, a, b) => self.add_or_subtract((AvrOpKind::Or, AvrOpKind::Or), dst, a, b),
            (ArithmeticOp::Xor, a, b) => self.add_or_subtract((AvrOpKind::Eor, AvrOpKind::Eor), dst, a, b),
            (ArithmeticOp::Shr, a, b) => self.shift_right(dst, a, shift_count(b)),
            (ArithmeticOp::Div, a, b) => {
                self.operands(a, b, width);
                self.routine(AvrRoutine::Divide(width as u8, self.signed_divisors));
                self.store_registers(dst, A);
            }
        }
    }

    /// Emits A := a, B := b.
    fn operands(&mut self, a: WordOperand, b: WordOperand, width: usize) {
        self.load_value(b, width, B);
        self.load_value(a, width, A);
    }

    /// Emits dst := a + b or a - b, or a bitwise operation.
    fn add_or_subtract(
        &mut self,
        (first, further): (AvrOpKind, AvrOpKind),
        dst: WordId,
        a: WordOperand,
        b: WordOperand,
    ) {
        let width = self.bytes(dst);
        let constant = matches!(a, WordOperand::Const(_));
        let home = self.home_registers(dst).filter(|home| b != WordOperand::Cell(dst) && !(constant && home[0] < 16));
        let target = home.unwrap_or(A);
        // If A holds b, loading a into A would destroy it.
        let cached = target == A && self.is_cached(b, width) && a != b && !self.has_home(b, width);
        let right = if cached {
            self.copy_registers(B, A, width);
            B
        } else if a == b && target == A && !constant {
            A
        } else {
            self.source_registers(b, width, B)
        };
        self.load_value(a, width, target);
        for (n, (&left, &right)) in target.iter().zip(&right).enumerate().take(width) {
            self.asm.op(if n == 0 { first } else { further }, &[left, right]);
        }
        if home.is_some() {
            self.invalidate_cached(dst);
        } else {
            self.store_registers(dst, A);
        }
    }

    /// Emits dst := a shifted right by a constant, zeros coming in: whole bytes are moved, the rest bit by
    /// bit.
    fn shift_right(&mut self, dst: WordId, a: WordOperand, count: usize) {
        let width = self.bytes(dst);
        self.load_value(a, width, A);
        let (skipped, bits) = (count / 8, count % 8);
        if skipped > 0 {
            for n in 0..width {
                let from = if n + skipped < width { A[n + skipped] } else { ZERO };
                self.asm.op(AvrOpKind::Mov, &[A[n], from]);
            }
        }
        for _ in 0..bits {
            for n in (0..width.saturating_sub(skipped)).rev() {
                let top = n + skipped + 1 == width;
                self.asm.op(if top { AvrOpKind::Lsr } else { AvrOpKind::Ror }, &[A[n]]);
            }
        }
        self.store_registers(dst, A);
    }

    /// Emits dst := -b.
    fn negate_into(&mut self, dst: WordId, b: WordOperand) {
        let width = self.bytes(dst);
        let home = self.home_registers(dst).filter(|home| home[0] >= 16 || width == 1);
        let target = home.unwrap_or(A);
        self.load_value(b, width, target);
        negate(self.asm, target, width);
        if home.is_some() {
            self.invalidate_cached(dst);
        } else {
            self.store_registers(dst, A);
        }
    }

    /// True if the value is in registers of its own with at least `width` bytes.
    fn has_home(&self, value: WordOperand, width: usize) -> bool {
        matches!(value, WordOperand::Cell(word) if self.home_registers(word).is_some() && self.bytes(word) >= width)
    }

    /// Emits dst := x + constant.
    fn add(&mut self, dst: WordId, x: WordOperand, constant: i32) {
        let width = self.bytes(dst);
        if let WordOperand::Const(x) = x {
            return self.move_word(dst, WordOperand::Const(x.wrapping_add(constant)));
        }
        // The constant modulo the width, sign-extended.
        let spare = 32 - 8 * width as u32;
        let constant = (constant << spare) >> spare;
        let low_byte = width == 1 && matches!(constant, -1 | 1) && x == WordOperand::Cell(dst);
        let home = self.home_registers(dst).filter(|home| home[0] >= 16 || low_byte);
        let target = home.unwrap_or(A);
        self.load_value(x, width, target);
        match (width, constant) {
            (_, 0) => {}
            (1, 1) => self.asm.op(AvrOpKind::Inc, &[target[0]]),
            (1, -1) => self.asm.op(AvrOpKind::Dec, &[target[0]]),
            (2, 1..=63) if is_word_add_pair(target[0]) => self.asm.op(AvrOpKind::Adiw, &[target[0], constant]),
            (2, -63..=-1) if is_word_add_pair(target[0]) => self.asm.op(AvrOpKind::Sbiw, &[target[0], -constant]),
            _ => {
                let constant = constant.wrapping_neg();
                for (n, &reg) in target.iter().enumerate().take(width) {
                    self.asm
                        .op(if n == 0 { AvrOpKind::Subi } else { AvrOpKind::Sbci }, &[reg, constant_byte(constant, n)]);
                }
            }
        }
        if home.is_some() {
            self.invalidate_cached(dst);
        } else {
            self.store_registers(dst, A);
        }
    }

    fn multiply(&mut self, dst: WordId, a: WordOperand, b: WordOperand) {
        let width = self.bytes(dst);
        let (x, factor) = match (a, b) {
            (WordOperand::Const(c), x) | (x, WordOperand::Const(c)) => (x, Some(c)),
            _ => (a, None),
        };
        match factor.map(|factor| factor << (32 - 8 * width as u32) >> (32 - 8 * width as u32)) {
            Some(0) => return self.move_word(dst, WordOperand::Const(0)),
            Some(1) => return self.move_word(dst, x),
            // Multiply by 2 to 5 with additions.
            Some(factor @ 2..=5) if width <= 2 && !matches!(x, WordOperand::Const(_)) => {
                self.load_value(x, width, A);
                let once = if factor % 2 == 1 { self.other_registers(x, width) } else { A };
                let double = |this: &mut Self| {
                    for (n, &reg) in A.iter().enumerate().take(width) {
                        this.asm.op(if n == 0 { AvrOpKind::Add } else { AvrOpKind::Adc }, &[reg, reg]);
                    }
                };
                double(self);
                if factor >= 4 {
                    double(self);
                }
                if factor % 2 == 1 {
                    for (n, (&reg, &once)) in A.iter().zip(&once).enumerate().take(width) {
                        self.asm.op(if n == 0 { AvrOpKind::Add } else { AvrOpKind::Adc }, &[reg, once]);
                    }
                }
            }
            _ => {
                self.operands(a, b, width);
                self.routine(AvrRoutine::Multiply(width as u8));
            }
        }
        self.store_registers(dst, A);
    }

    /// Registers other than A with the content of A: those of `x`, or B after a copy.
    fn other_registers(&mut self, x: WordOperand, width: usize) -> RegisterQuad {
        if let WordOperand::Cell(word) = x
            && let Some(home) = self.home_registers(word).filter(|_| self.bytes(word) >= width)
        {
            return home;
        }
        self.copy_registers(B, A, width);
        B
    }
}
