//! Branches: jumps around lists of operations, and where the accumulator is behind them.

use emu_pic16::isa::Kind;

use super::expr::{Expr, Lit};
use super::logic::Then;
use super::out::Item;
use super::select::Select;
use super::uses::{self, Touched};
use crate::ir::{Cond, Op};

impl Select<'_, '_> {
    /// One of two lists.
    pub(super) fn branch(
        &mut self,
        cond: Cond,
        then: &[Op],
        otherwise: &[Op],
        rest: &[&Op],
        live: bool,
        target: Option<Lit>,
    ) {
        let needed = uses::acc_read(rest, live);
        let mut touched = Touched::default();
        touched.list(then);
        touched.list(otherwise);
        let changes = touched.acc;
        self.before_ways(&touched);
        let e = match cond {
            Cond::Acc => {
                let again = needed && !changes && (!self.acc.is_simple() || self.reads(&self.acc, &touched));
                self.before(&touched, true);
                if again {
                    self.keep();
                }
                self.acc.clone()
            }
            _ => {
                let inside = needed || uses::reads_acc(then) || uses::reads_acc(otherwise);
                self.before(&touched, inside);
                match cond {
                    Cond::Bit(bit) => self.read(bit),
                    Cond::Compare(compare) => Expr::Cmp(compare),
                    Cond::Acc => Expr::Const(false),
                }
            }
        };
        let settle = (needed && changes).then(|| self.target(&touched, &[&e, &self.acc.clone()], rest, target));
        if let Some(to) = settle {
            self.compute(|_, e| e.reads_bit(to.at));
        }
        if settle.is_none() && otherwise.is_empty() && self.single(&e, then, cond == Cond::Acc) {
            return;
        }
        let before = if cond == Cond::Acc { None } else { Some(self.acc.clone()) };
        let (no, end) = (self.out.label(), self.out.label());
        let mine = before.clone().unwrap_or(Expr::Const(true));
        let other = before.clone().unwrap_or(Expr::Const(false));
        // Where one way has nothing to do but to leave a known value, that value is there before.
        let preset = settle.filter(|to| !e.reads_bit(to.at));
        let done = |way: &[Op], value: &Expr| preset.is_some() && way.is_empty() && matches!(value, Expr::Const(_));
        for (way, value) in [(then, &mine), (otherwise, &other)] {
            if let (Some(to), true, Expr::Const(value)) = (preset, done(way, value), value) {
                self.out.put(to.at, *value == to.is);
            }
        }
        if then.is_empty() && (settle.is_none() || done(then, &mine)) {
            self.exec(&e, &Then::Goto(end));
        } else {
            self.exec(&e.opposite(), &Then::Goto(no));
            self.acc = mine;
            self.list(then, needed, settle);
            if let Some(to) = settle {
                self.settle(to);
            }
            if !otherwise.is_empty() || (settle.is_some() && !done(otherwise, &other)) {
                self.out.goto(end);
            }
        }
        self.out.place(no);
        if !otherwise.is_empty() || settle.is_some() {
            self.acc = other.clone();
            self.list(otherwise, needed, settle);
            if let Some(to) = settle
                && !done(otherwise, &other)
            {
                self.settle(to);
            }
        }
        self.out.place(end);
        self.acc = match (settle, before) {
            (Some(to), _) => Expr::Lit(to),
            (None, Some(acc)) if needed => acc,
            (None, None) if needed => e,
            _ => Expr::Const(false),
        };
    }

    /// A branch that is one instruction stands behind a skip. Says whether it was.
    fn single(&mut self, e: &Expr, then: &[Op], by_acc: bool) -> bool {
        let [op] = then else { return false };
        let (Op::Put { .. } | Op::Store { .. } | Op::Move { .. } | Op::Math { .. }) = op else { return false };
        let save = self.out.save();
        let acc = self.acc.clone();
        if by_acc {
            self.acc = Expr::Const(true);
        }
        let banks = self.out.banks;
        self.list(then, false, None);
        self.acc = acc;
        let same = self.out.banks == banks;
        let made = self.out.restore(&save);
        let then = match made.as_slice() {
            [Item::Op(kind, operands, 0)] if same => {
                let addr = operands.first().copied().unwrap_or(0) as u16;
                let addr = self.written(op).unwrap_or(addr);
                match (kind, operands.get(1)) {
                    (Kind::Bsf | Kind::Bcf, Some(&bit)) => Then::Put((addr, bit as u8), *kind == Kind::Bsf),
                    (Kind::Clrf | Kind::IncfF | Kind::DecfF, None) => Then::Once(*kind, addr),
                    _ => return false,
                }
            }
            _ => return false,
        };
        self.exec(e, &then);
        true
    }

    /// The address of what an operation on one byte writes.
    fn written(&self, op: &Op) -> Option<u16> {
        match op {
            Op::Put { bit, .. } | Op::Store { bit, .. } => Some(self.layout.bit(*bit).0),
            Op::Move { dst, .. } | Op::Math { dst, .. } => Some(self.layout.word(*dst)),
            _ => None,
        }
    }
}
