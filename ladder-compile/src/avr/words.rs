//! Integers of one to four bytes: moved, added, multiplied, divided.
//!
//! One that lives in registers is worked on there where the instructions reach it; others pass through A, and what A
//! holds is remembered.

use emu_avr::isa::Kind;

use super::layout::Home;
use super::regs::{A, B, LOW_ZERO, SCRATCH, ZERO};
use super::runtime::{Routine, negate};
use super::select::Select;
use crate::ir::{Math, Value, Word};

/// Registers of a value, least byte first.
pub type Quad = [i32; 4];

/// Registers from one on.
#[must_use]
pub fn from(reg: i32) -> Quad {
    [reg, reg + 1, reg + 2, reg + 3]
}

/// Byte `n` of a constant.
#[must_use]
pub fn byte(constant: i32, n: usize) -> i32 {
    constant >> (8 * n.min(3)) & 0xFF
}

/// ADIW and SBIW take these pairs.
fn counts(reg: i32) -> bool {
    matches!(reg, 24 | 26 | 28 | 30)
}

impl Select<'_> {
    /// Registers where a word lives.
    #[must_use]
    pub fn home(&self, word: Word) -> Option<Quad> {
        match self.layout.word(word) {
            Home::Reg(reg) => Some(from(reg.into())),
            Home::Ram(_) => None,
        }
    }

    /// Width of a word in bytes.
    #[must_use]
    pub fn bytes(&self, word: Word) -> usize {
        self.layout.bytes(word).into()
    }

    /// A holds `value`, extended to `width` bytes at least.
    fn cached(&self, value: Value, width: usize) -> bool {
        matches!((value, self.known.a), (Value::Cell(word), Some((held, to))) if word == held && to >= width)
    }

    /// Registers that hold `value`, to be read only: its home, A, or `to`, whichever costs least.
    pub fn source(&mut self, value: Value, width: usize, to: Quad) -> Quad {
        match value {
            Value::Cell(word) => {
                if let Some(home) = self.home(word).filter(|_| self.bytes(word) >= width) {
                    return home;
                }
                if self.cached(value, width) {
                    return A;
                }
                self.fill(value, width, to);
                to
            }
            Value::Const(constant) => {
                let mut regs = to;
                for (n, reg) in regs.iter_mut().enumerate().take(width) {
                    match byte(constant, n) {
                        0 => *reg = ZERO,
                        byte => self.asm.op(Kind::Ldi, &[*reg, byte]),
                    }
                }
                if to == A {
                    self.known.a = None;
                }
                regs
            }
        }
    }

    /// `to` := `value`, extended with sign to `width` bytes. Constants need registers from r16 on.
    pub fn fill(&mut self, value: Value, width: usize, to: Quad) {
        if to == A && self.cached(value, width) {
            return;
        }
        match value {
            Value::Const(constant) => {
                for (n, &reg) in to.iter().enumerate().take(width) {
                    match byte(constant, n) {
                        0 if reg < 16 => self.asm.op(Kind::Mov, &[reg, ZERO]),
                        byte => self.asm.op(Kind::Ldi, &[reg, byte]),
                    }
                }
            }
            Value::Cell(word) => {
                let there = self.bytes(word).min(width);
                if let Some(home) = self.home(word) {
                    self.copy(to, home, there);
                } else if self.cached(value, there) {
                    self.copy(to, A, there);
                } else if let Home::Ram(addr) = self.layout.word(word) {
                    for (&reg, n) in to.iter().take(there).zip(0..) {
                        self.layout.load(self.asm, reg, addr + n);
                    }
                }
                self.extend(to, there, width);
            }
        }
        if to == A {
            self.known.a = match value {
                Value::Cell(word) => Some((word, width)),
                Value::Const(_) => None,
            };
        }
    }

    /// Fills the bytes from `have` to `width` with the sign.
    pub fn extend(&mut self, regs: Quad, have: usize, width: usize) {
        let (Some(&top), Some(&next)) = (regs.get(have.wrapping_sub(1)), regs.get(have)) else { return };
        if have >= width {
            return;
        }
        self.asm.op(Kind::Mov, &[next, top]);
        self.asm.op(Kind::Add, &[next, next]);
        self.asm.op(Kind::Sbc, &[next, next]);
        regs.iter().take(width).skip(have + 1).for_each(|&reg| self.asm.op(Kind::Mov, &[reg, next]));
    }

    /// Copies registers, pairs at once where they are pairs.
    pub fn copy(&mut self, to: Quad, from: Quad, width: usize) {
        let mut n = 0;
        while n < width.min(4) {
            let (t, f) = (to[n], from[n]);
            let pair = n + 1 < width && t % 2 == 0 && f % 2 == 0 && to[n + 1] == t + 1 && from[n + 1] == f + 1;
            if t != f {
                self.asm.op(if pair { Kind::Movw } else { Kind::Mov }, &[t, f]);
            }
            n += if pair { 2 } else { 1 };
        }
    }

    /// `dst` := registers.
    pub fn save(&mut self, dst: Word, regs: Quad) {
        let width = self.bytes(dst);
        match self.layout.word(dst) {
            Home::Reg(reg) => self.copy(from(reg.into()), regs, width),
            Home::Ram(addr) => {
                for (&reg, n) in regs.iter().take(width).zip(0..) {
                    self.layout.store(self.asm, addr + n, reg);
                }
            }
        }
        if regs == A {
            self.known.a = Some((dst, width));
        } else {
            self.forget(dst);
        }
    }

    /// `dst` has changed otherwise than by way of A.
    pub fn forget(&mut self, dst: Word) {
        self.known.a = self.known.a.filter(|(held, _)| *held != dst);
    }

    /// dst := src.
    pub fn move_word(&mut self, dst: Word, src: Value) {
        let width = self.bytes(dst);
        if src == Value::Cell(dst) {
            return;
        }
        match (src, self.layout.word(dst)) {
            (Value::Const(0), Home::Reg(reg)) => {
                let zero = [LOW_ZERO, ZERO, LOW_ZERO, ZERO];
                let reg = i32::from(reg);
                // A single register cannot be copied from the low one of the pair better than from the high one.
                self.copy(from(reg), if width == 1 { [ZERO; 4] } else { zero }, width);
                self.forget(dst);
            }
            (Value::Const(_), Home::Reg(reg)) if reg >= 16 => {
                self.fill(src, width, from(reg.into()));
                self.forget(dst);
            }
            (Value::Const(constant), Home::Ram(addr)) => {
                let mut held = None;
                for n in 0..width {
                    let byte = byte(constant, n);
                    if byte != 0 && held != Some(byte) {
                        self.asm.op(Kind::Ldi, &[SCRATCH, byte]);
                        held = Some(byte);
                    }
                    self.layout.store(self.asm, addr + n as u16, if byte == 0 { ZERO } else { SCRATCH });
                }
                self.forget(dst);
            }
            (Value::Const(constant), Home::Reg(reg)) if width == 1 => {
                self.asm.op(Kind::Ldi, &[SCRATCH, byte(constant, 0)]);
                self.asm.op(Kind::Mov, &[reg.into(), SCRATCH]);
                self.forget(dst);
            }
            (Value::Cell(_), Home::Reg(reg)) => {
                self.fill(src, width, from(reg.into()));
                self.forget(dst);
            }
            _ => {
                let regs = self.source(src, width, A);
                self.save(dst, regs);
            }
        }
    }

    /// dst := a op b.
    pub fn math(&mut self, op: Math, dst: Word, a: Value, b: Value) {
        let width = usize::from(self.ir.width(op, dst, a, b));
        match (op, a, b) {
            (Math::Add, x, Value::Const(c)) | (Math::Add, Value::Const(c), x) => self.add(dst, x, c),
            (Math::Sub, x, Value::Const(c)) => self.add(dst, x, c.wrapping_neg()),
            (Math::Add, a, b) if b == Value::Cell(dst) => self.sum((Kind::Add, Kind::Adc), dst, b, a),
            (Math::Add, a, b) => self.sum((Kind::Add, Kind::Adc), dst, a, b),
            (Math::Sub, Value::Const(0), b) if usize::from(self.layout.bytes(dst)) <= 2 => self.minus(dst, b),
            (Math::Sub, a, b) => self.sum((Kind::Sub, Kind::Sbc), dst, a, b),
            (Math::Mul, a, b) => self.multiply(dst, a, b),
            (Math::Div, a, b) => {
                self.operands(a, b, width);
                self.routine(Routine::Divide(width as u8, self.signed_divisors));
                self.save(dst, A);
            }
        }
    }

    /// A := a, B := b.
    fn operands(&mut self, a: Value, b: Value, width: usize) {
        self.fill(b, width, B);
        self.fill(a, width, A);
    }

    /// dst := a + b or a - b.
    fn sum(&mut self, (first, further): (Kind, Kind), dst: Word, a: Value, b: Value) {
        let width = self.bytes(dst);
        let constant = matches!(a, Value::Const(_));
        let home = self.home(dst).filter(|home| b != Value::Cell(dst) && !(constant && home[0] < 16));
        let target = home.unwrap_or(A);
        // What A holds of b would be lost when a comes there.
        let held = target == A && self.cached(b, width) && a != b && !self.lives_in(b, width);
        let right = if held {
            self.copy(B, A, width);
            B
        } else if a == b && target == A && !constant {
            A
        } else {
            self.source(b, width, B)
        };
        self.fill(a, width, target);
        for (n, (&left, &right)) in target.iter().zip(&right).enumerate().take(width) {
            self.asm.op(if n == 0 { first } else { further }, &[left, right]);
        }
        if home.is_some() {
            self.forget(dst);
        } else {
            self.save(dst, A);
        }
    }

    /// dst := -b.
    fn minus(&mut self, dst: Word, b: Value) {
        let width = self.bytes(dst);
        let home = self.home(dst).filter(|home| home[0] >= 16 || width == 1);
        let target = home.unwrap_or(A);
        self.fill(b, width, target);
        negate(self.asm, target, width);
        if home.is_some() {
            self.forget(dst);
        } else {
            self.save(dst, A);
        }
    }

    /// The value has a home in registers, as wide as that.
    fn lives_in(&self, value: Value, width: usize) -> bool {
        matches!(value, Value::Cell(word) if self.home(word).is_some() && self.bytes(word) >= width)
    }

    /// dst := x + constant.
    fn add(&mut self, dst: Word, x: Value, constant: i32) {
        let width = self.bytes(dst);
        if let Value::Const(x) = x {
            return self.move_word(dst, Value::Const(x.wrapping_add(constant)));
        }
        // The sum modulo the width, with sign.
        let spare = 32 - 8 * width as u32;
        let constant = (constant << spare) >> spare;
        let low_byte = width == 1 && matches!(constant, -1 | 1) && x == Value::Cell(dst);
        let home = self.home(dst).filter(|home| home[0] >= 16 || low_byte);
        let target = home.unwrap_or(A);
        self.fill(x, width, target);
        match (width, constant) {
            (_, 0) => {}
            (1, 1) => self.asm.op(Kind::Inc, &[target[0]]),
            (1, -1) => self.asm.op(Kind::Dec, &[target[0]]),
            (2, 1..=63) if counts(target[0]) => self.asm.op(Kind::Adiw, &[target[0], constant]),
            (2, -63..=-1) if counts(target[0]) => self.asm.op(Kind::Sbiw, &[target[0], -constant]),
            _ => {
                let constant = constant.wrapping_neg();
                for (n, &reg) in target.iter().enumerate().take(width) {
                    self.asm.op(if n == 0 { Kind::Subi } else { Kind::Sbci }, &[reg, byte(constant, n)]);
                }
            }
        }
        if home.is_some() {
            self.forget(dst);
        } else {
            self.save(dst, A);
        }
    }

    fn multiply(&mut self, dst: Word, a: Value, b: Value) {
        let width = self.bytes(dst);
        let (x, factor) = match (a, b) {
            (Value::Const(c), x) | (x, Value::Const(c)) => (x, Some(c)),
            _ => (a, None),
        };
        match factor.map(|factor| factor << (32 - 8 * width as u32) >> (32 - 8 * width as u32)) {
            Some(0) => return self.move_word(dst, Value::Const(0)),
            Some(1) => return self.move_word(dst, x),
            // Twice, three times, four times, five times: by additions.
            Some(factor @ 2..=5) if width <= 2 && !matches!(x, Value::Const(_)) => {
                self.fill(x, width, A);
                let once = if factor % 2 == 1 { self.another(x, width) } else { A };
                let double = |this: &mut Self| {
                    for (n, &reg) in A.iter().enumerate().take(width) {
                        this.asm.op(if n == 0 { Kind::Add } else { Kind::Adc }, &[reg, reg]);
                    }
                };
                double(self);
                if factor >= 4 {
                    double(self);
                }
                if factor % 2 == 1 {
                    for (n, (&reg, &once)) in A.iter().zip(&once).enumerate().take(width) {
                        self.asm.op(if n == 0 { Kind::Add } else { Kind::Adc }, &[reg, once]);
                    }
                }
            }
            _ => {
                self.operands(a, b, width);
                self.routine(Routine::Multiply(width as u8));
            }
        }
        self.save(dst, A);
    }

    /// Registers other than A that hold what A holds: the home of `x`, or B.
    fn another(&mut self, x: Value, width: usize) -> Quad {
        if let Value::Cell(word) = x
            && let Some(home) = self.home(word).filter(|_| self.bytes(word) >= width)
        {
            return home;
        }
        self.copy(B, A, width);
        B
    }
}
