//! Comparisons of integers, with sign.

use emu_avr::isa::Kind;

use super::arch::Jump;
use super::layout::Home;
use super::regs::{A, B, BYTE, SCRATCH, ZERO};
use super::select::Select;
use super::words::{Quad, byte};
use crate::code::Label;
use crate::ir::{Compare, Op, Rel, Value, Word};

/// A row of comparisons that is being selected.
#[derive(Debug, Clone, Copy, Default)]
pub struct Row {
    /// Where those that fail go, and what A holds there.
    fails: Option<(Label, Option<(Word, usize)>)>,
    /// The next comparison is one without sign.
    unsigned: bool,
}

/// `first` says that a word is not negative, `second` that it is below a positive constant.
fn is_range(first: &Compare, second: &Compare) -> bool {
    let (Value::Const(low), Value::Const(high)) = (first.b, second.b) else { return false };
    first.a == second.a && first.rel == Rel::Ge && low == 0 && second.rel == Rel::Lt && high > 0
}

impl Select<'_> {
    /// T := T and the comparison; `next` is the operation behind it. In a row of comparisons one that fails goes straight to
    /// the CLT at the end of the row.
    pub fn and_compare(&mut self, compare: &Compare, next: Option<&Op>) {
        if self.known.t == Some(false) {
            return;
        }
        let next = match next {
            Some(Op::AndCompare(next)) => Some(next),
            _ => None,
        };
        if next.is_some_and(|next| is_range(compare, next)) {
            // What is not negative and below a number is below it without sign: the next comparison does it all.
            self.row.unsigned = true;
            return;
        }
        let unsigned = std::mem::take(&mut self.row.unsigned);
        if let (Rel::Lt | Rel::Ge, Value::Const(0), None, None) = (compare.rel, compare.b, next, self.row.fails) {
            let top = self.top(compare.a);
            self.asm.op(if compare.rel == Rel::Ge { Kind::Sbrc } else { Kind::Sbrs }, &[top, 7]);
            self.asm.op(Kind::Clt, &[]);
            self.known.t = None;
            return;
        }
        let (holds, fails) = match self.compare(compare) {
            _ if unsigned => (Kind::Brcs, Kind::Brcc),
            signed => signed,
        };
        let (label, before) = match self.row.fails {
            Some(known) => known,
            None => (self.asm.label(), self.known.a),
        };
        let known = self.known.a.filter(|_| self.known.a == before);
        if next.is_some() {
            self.asm.jump(Jump::If(fails), label);
            self.row.fails = Some((label, known));
        } else {
            let over = self.asm.label();
            self.asm.jump(Jump::If(holds), over);
            self.asm.place(label);
            self.asm.op(Kind::Clt, &[]);
            self.asm.place(over);
            self.row.fails = None;
            self.known.a = known;
        }
        self.known.t = None;
    }

    /// Compares; returns the branches that are taken when the comparison holds and when it does not.
    pub fn compare(&mut self, compare: &Compare) -> (Kind, Kind) {
        let Compare { a, rel, b } = *compare;
        match (rel, b) {
            (Rel::Lt | Rel::Ge, Value::Const(0)) => {
                // Only the sign counts.
                let top = self.top(a);
                self.asm.op(Kind::And, &[top, top]);
                return if rel == Rel::Lt { (Kind::Brmi, Kind::Brpl) } else { (Kind::Brpl, Kind::Brmi) };
            }
            (_, Value::Const(constant)) => self.with_constant(a, rel, constant),
            (_, Value::Cell(word)) => {
                let width = self.bytes(a).max(self.bytes(word));
                // What A holds stays there, the other operand comes to B.
                let held = matches!(self.known.a, Some((held, to)) if held == word && to >= width);
                let left = self.source(Value::Cell(a), width, if held { B } else { A });
                let right = self.source(b, width, B);
                self.chain(left, right, width);
            }
        }
        match rel {
            Rel::Eq => (Kind::Breq, Kind::Brne),
            Rel::Ne => (Kind::Brne, Kind::Breq),
            Rel::Lt => (Kind::Brlt, Kind::Brge),
            Rel::Ge => (Kind::Brge, Kind::Brlt),
        }
    }

    fn chain(&mut self, left: Quad, right: Quad, width: usize) {
        for (n, (&left, &right)) in left.iter().zip(&right).enumerate().take(width) {
            self.asm.op(if n == 0 { Kind::Cp } else { Kind::Cpc }, &[left, right]);
        }
    }

    /// Compares with a constant. For less and not less, low bytes of the constant that are zero decide nothing.
    fn with_constant(&mut self, a: Word, rel: Rel, constant: i32) {
        let width = self.bytes(a);
        let ordered = matches!(rel, Rel::Lt | Rel::Ge);
        let skipped = if ordered { (0..width - 1).take_while(|&n| byte(constant, n) == 0).count() } else { 0 };
        let held = matches!(self.known.a, Some((held, to)) if held == a && to >= width);
        let first = byte(constant, skipped);
        let regs = match (self.layout.word(a), self.home(a)) {
            // The lowest byte that counts is compared at once from r16 on, and with zero anywhere.
            (_, Some(home)) if home[0] >= 16 || first == 0 || (skipped + 1 == width && !held) => home,
            (Home::Ram(addr), None) if skipped + 1 == width && !held => {
                self.layout.load(self.asm, BYTE, addr + skipped as u16);
                [BYTE; 4]
            }
            _ => {
                self.fill(Value::Cell(a), width, A);
                A
            }
        };
        for (n, &reg) in regs.iter().enumerate().take(width).skip(skipped) {
            let (plain, immediate) = if n == skipped { (Kind::Cp, true) } else { (Kind::Cpc, false) };
            match byte(constant, n) {
                0 => self.asm.op(plain, &[reg, ZERO]),
                byte if immediate && reg >= 16 => self.asm.op(Kind::Cpi, &[reg, byte]),
                byte => {
                    self.asm.op(Kind::Ldi, &[SCRATCH, byte]);
                    self.asm.op(plain, &[reg, SCRATCH]);
                }
            }
        }
    }

    /// A register that holds the byte with the sign.
    fn top(&mut self, word: Word) -> i32 {
        let last = self.bytes(word).saturating_sub(1);
        if let Some(&reg) = self.home(word).as_ref().and_then(|home| home.get(last)) {
            return reg;
        }
        match (self.known.a, self.layout.word(word)) {
            (Some((held, to)), _) if held == word && to > last => A.get(last).copied().unwrap_or(BYTE),
            (_, Home::Ram(addr)) => {
                self.layout.load(self.asm, BYTE, addr + last as u16);
                BYTE
            }
            (_, Home::Reg(reg)) => reg.into(),
        }
    }
}
