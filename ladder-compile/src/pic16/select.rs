//! Operations to instructions.
//!
//! The accumulator is a formula ([`Expr`]) that is only computed where something needs it: a coil takes it straight into its
//! bit, a branch into jumps. Temporaries that are read once are formulas too. Before a cell is written, formulas that read
//! it and are still needed are computed: the accumulator into FSR<0>, a temporary into its cell.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use emu_pic16::periph::map::Sfr;

use super::expr::{Expr, Lit};
use super::layout::Layout;
use super::logic::Then;
use super::out::{Lab, Out};
use super::periph::Devices;
use super::uses::{self, Touched};
use crate::ir::{Bit, Cond, Ir, Logic, Op, Value, Word};

/// A subroutine, made once when it is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Routine {
    /// Low bytes of a product, by width.
    Multiply(u8),
    /// Quotient with sign, by width.
    Divide(u8),
    /// Operand 0 or 1 becomes its negative, by width.
    Negate(u16, u8),
    /// Byte `1` of the values of table `0` to W.
    Table(u32, u8, Word),
    /// The converter.
    Convert,
    /// A byte of EEPROM to W.
    ReadEeprom,
    /// W to EEPROM.
    WriteEeprom,
    /// W percent to the PWM output.
    Duty,
}

/// The selector.
#[derive(Debug)]
pub struct Select<'a, 'c> {
    /// What is written.
    pub out: Out<'c>,
    /// The scan.
    pub ir: &'a Ir,
    /// Places.
    pub layout: &'a Layout,
    /// Serial line, converter, PWM.
    pub devices: &'a Devices,
    /// Subroutines in use.
    pub routines: BTreeMap<Routine, Lab>,
    /// The accumulator.
    pub(super) acc: Expr,
    /// Temporaries that have not been computed yet, and how often they will be read.
    pub(super) pending: HashMap<Bit, (Expr, u32)>,
    /// In the list of operations of the scan itself, not in a branch.
    pub(super) outermost: bool,
}

impl<'a, 'c> Select<'a, 'c> {
    /// Continues `out`.
    #[must_use]
    pub fn new(out: Out<'c>, ir: &'a Ir, layout: &'a Layout, devices: &'a Devices) -> Self {
        Select {
            out,
            ir,
            layout,
            devices,
            routines: BTreeMap::new(),
            acc: Expr::Const(false),
            pending: HashMap::new(),
            outermost: true,
        }
    }

    /// The accumulator's own bit: FSR<0>.
    pub(super) fn kept(&self) -> (u16, u8) {
        (self.out.chip.reg(Sfr::FSR), 0)
    }

    /// Label of a subroutine.
    pub fn routine(&mut self, routine: Routine) -> Lab {
        if let Some(&label) = self.routines.get(&routine) {
            return label;
        }
        let label = self.out.label();
        self.routines.insert(routine, label);
        label
    }

    /// One operation, `rest` being those behind it in its list; the accumulator is needed behind the list if `live`, and
    /// then wanted in `target` if there is one. Says how many operations have been done.
    pub fn op(&mut self, op: &Op, rest: &[&Op], live: bool, target: Option<Lit>) -> usize {
        match op {
            Op::Acc(value) => self.acc = Expr::Const(*value),
            Op::Load { bit, negated } => self.acc = self.read(*bit).opposite_if(*negated),
            Op::And { bit, negated } => {
                let other = self.read(*bit).opposite_if(*negated);
                self.acc = self.take().and(other);
            }
            Op::Or { bit, negated } => {
                let other = self.read(*bit).opposite_if(*negated);
                self.acc = self.take().or(other);
            }
            Op::AndCompare(compare) => self.acc = self.take().and(Expr::Cmp(*compare)),
            Op::Store { bit, negated } => self.store(*bit, *negated, rest),
            Op::Put { bit, value } => {
                self.pending.remove(bit);
                self.before(&Touched::bit(*bit), uses::acc_read(rest, live));
                self.out.put(self.layout.bit(*bit), *value);
            }
            Op::Rising(memory) => return self.edge(*memory, true, rest, live, target),
            Op::Falling(memory) => return self.edge(*memory, false, rest, live, target),
            Op::Logic { dst, is } => self.logic(*dst, *is),
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise, rest, live, target),
            Op::Receive { dst } => self.receive(*dst, rest, live, target),
            word => {
                let mut touched = Touched::default();
                touched.op(word);
                self.before(&touched, uses::acc_read(rest, live));
                self.word(word);
            }
        }
        1
    }

    /// Operations of a branch.
    pub(super) fn list(&mut self, ops: &[Op], live: bool, target: Option<Lit>) {
        let ops: Vec<&Op> = ops.iter().collect();
        let outer = std::mem::replace(&mut self.outermost, false);
        let mut at = 0;
        while let Some((op, rest)) = ops.get(at..).and_then(<[_]>::split_first) {
            at += self.op(op, rest, live, target);
        }
        self.outermost = outer;
    }

    fn take(&mut self) -> Expr {
        std::mem::replace(&mut self.acc, Expr::Const(false))
    }

    /// What a bit is now; a temporary that has not been computed gives its formula.
    pub(super) fn read(&mut self, bit: Bit) -> Expr {
        if let Some((e, left)) = self.pending.get_mut(&bit) {
            let e = e.clone();
            *left -= 1;
            if *left == 0 {
                self.pending.remove(&bit);
            }
            return e;
        }
        Expr::Lit(Lit { at: self.layout.bit(bit), is: true })
    }

    pub(super) fn reads(&self, e: &Expr, touched: &Touched) -> bool {
        touched.bits.iter().any(|&bit| e.reads_bit(self.layout.bit(bit)))
            || touched.words.iter().any(|&word| e.reads_word(word))
            || (touched.acc && e.reads_bit(self.kept()))
    }

    /// Before cells are written: computes the formulas that read them; the accumulator's if it is needed behind.
    pub(super) fn before(&mut self, touched: &Touched, acc_live: bool) {
        if !acc_live {
            self.acc = Expr::Const(false);
        } else if self.reads(&self.acc, touched) {
            self.keep();
        }
        self.compute(|select, e| select.reads(e, touched));
    }

    /// Computes the temporaries of which `wanted` is true.
    pub(super) fn compute(&mut self, wanted: impl Fn(&Self, &Expr) -> bool) {
        let mut due: Vec<Bit> =
            self.pending.iter().filter(|(_, (e, _))| wanted(self, e)).map(|(&bit, _)| bit).collect();
        due.sort_unstable();
        for bit in due {
            if let Some((e, _)) = self.pending.remove(&bit) {
                self.assign(self.layout.bit(bit), &e);
            }
        }
    }

    /// Before code that is not always executed: computes the temporaries that it reads, and those whose formulas read the
    /// accumulator's own bit, which it may use for itself. What is computed in one way only is missing in the other.
    pub(super) fn before_ways(&mut self, touched: &Touched) {
        if self.outermost {
            let used = self.pending.keys().copied().filter(|&bit| touched.uses(bit)).collect::<BTreeSet<Bit>>();
            for bit in used {
                if let Some((e, _)) = self.pending.remove(&bit) {
                    self.assign(self.layout.bit(bit), &e);
                }
            }
        }
        let kept = self.kept();
        self.compute(|_, e| e.reads_bit(kept));
    }

    /// Computes the accumulator into its bit.
    pub(super) fn keep(&mut self) {
        let at = self.kept();
        let e = self.take();
        if e != (Expr::Lit(Lit { at, is: true })) {
            self.compute(|_, e| e.reads_bit(at));
            self.assign(at, &e);
        }
        self.acc = Expr::Lit(Lit { at, is: true });
    }

    fn store(&mut self, bit: Bit, negated: bool, rest: &[&Op]) {
        let at = self.layout.bit(bit);
        self.pending.remove(&bit);
        if self.outermost && self.ir.is_temporary(bit) {
            match uses::reads_of(bit, rest) {
                Some(0) => return,
                // Whatever is written first computes what still reads it, so a formula may wait.
                // A formula waits that is read once, here or there; so does what is no work.
                Some(reads)
                    if !uses::acc_read(rest, true) && reads == 1 || self.acc.is_simple() && !self.acc.reads_bit(at) =>
                {
                    self.compute(|_, e| e.reads_bit(at));
                    self.pending.insert(bit, (self.acc.clone().opposite_if(negated), reads));
                    return;
                }
                _ => {}
            }
        }
        let e = self.take().opposite_if(negated);
        self.before(&Touched::bit(bit), false);
        let simple = e.is_simple() && !e.reads_bit(at);
        self.assign(at, &e);
        self.acc = if simple { e.opposite_if(negated) } else { Expr::Lit(Lit { at, is: !negated }) };
    }

    /// Where the accumulator is best computed to, behind an operation that touches `touched`: the bit that is stored next, else
    /// what the list wants, else its own bit.
    pub(super) fn target(&self, touched: &Touched, also: &[&Expr], rest: &[&Op], target: Option<Lit>) -> Lit {
        if let Some(Op::Store { bit, negated }) = rest.first() {
            let at = self.layout.bit(*bit);
            let free = !touched.uses(*bit) && !also.iter().any(|e| e.reads_bit(at));
            if free && !self.pending.values().any(|(e, _)| e.reads_bit(at)) {
                return Lit { at, is: !negated };
            }
        }
        match target {
            Some(lit) if rest.is_empty() && !also.iter().any(|e| e.reads_bit(lit.at)) => lit,
            _ => Lit { at: self.kept(), is: true },
        }
    }

    /// The bit becomes such that `to` has the value of the accumulator.
    pub(super) fn settle(&mut self, to: Lit) {
        let e = self.take();
        self.assign(to.at, &e.opposite_if(!to.is));
        self.acc = Expr::Lit(to);
    }

    fn edge(&mut self, memory: Bit, rising: bool, rest: &[&Op], live: bool, target: Option<Lit>) -> usize {
        // A falling edge is a rising one of the complements.
        let m = Lit { at: self.layout.bit(memory), is: rising };
        if let Some((Op::If { cond: Cond::Acc, then, otherwise }, behind)) = rest.split_first()
            && otherwise.is_empty()
            && !uses::acc_read(behind, live)
        {
            let e = self.take().opposite_if(!rising);
            let mut touched = Touched::bit(memory);
            touched.list(then);
            self.before_ways(&touched);
            self.before(&touched, false);
            let (end, low) = (self.out.label(), self.out.label());
            let seen = Expr::Lit(m);
            let simple = matches!(&e, Expr::Lit(l) if l.at != m.at);
            if simple {
                self.exec(&e.opposite(), &Then::Put(m.at, !m.is));
                self.exec(&e.opposite().or(seen), &Then::Goto(end));
            } else {
                self.exec(&e.opposite(), &Then::Goto(low));
                self.exec(&seen, &Then::Goto(end));
            }
            self.out.put(m.at, m.is);
            self.acc = Expr::Const(true);
            self.list(then, false, None);
            if !simple {
                self.out.goto(end);
                self.out.place(low);
                self.out.put(m.at, !m.is);
            }
            self.out.place(end);
            self.acc = Expr::Const(false);
            return 2;
        }
        let touched = Touched::bit(memory);
        let e = self.take().opposite_if(!rising);
        self.before(&touched, false);
        let t = self.target(&touched, &[&e], rest, target);
        self.compute(|_, e| e.reads_bit(t.at));
        let (yes, seen) = (Expr::Lit(t), Expr::Lit(m));
        match &e {
            Expr::Lit(l) if l.at != t.at && l.at != m.at => {
                let both = e.clone().and(seen.opposite());
                self.assign(t.at, &both.opposite_if(!t.is));
                self.assign(m.at, &e.opposite_if(!m.is));
            }
            _ => {
                self.assign(t.at, &e.opposite_if(!t.is));
                self.exec(&yes.opposite(), &Then::Put(m.at, !m.is));
                self.exec(&seen, &Then::Put(t.at, !t.is));
                self.exec(&yes, &Then::Put(m.at, m.is));
            }
        }
        self.acc = yes;
        1
    }

    fn receive(&mut self, dst: Word, rest: &[&Op], live: bool, target: Option<Lit>) {
        let mut touched = Touched::default();
        touched.words.insert(dst);
        self.before(&touched, false);
        let needed = uses::acc_read(rest, live);
        let to = self.target(&touched, &[], rest, target);
        if needed {
            self.compute(|_, e| e.reads_bit(to.at));
            self.acc = Expr::Const(false);
            self.settle(to);
        }
        let end = self.out.label();
        let waits = Lit { at: self.layout.received, is: true };
        self.exec(&Expr::Lit(waits.opposite()), &Then::Goto(end));
        self.take_byte(dst);
        if needed {
            self.acc = Expr::Const(true);
            self.settle(to);
        }
        self.out.place(end);
        self.acc = if needed { Expr::Lit(to) } else { Expr::Const(false) };
    }

    /// The three-address form: the templates of the book, one after the other.
    fn logic(&mut self, dst: Bit, is: Logic) {
        self.before(&Touched::bit(dst), false);
        let at = self.layout.bit(dst);
        let of = |bit: Bit| self.layout.bit(bit);
        let is = match is {
            // What is also an operand is not preset.
            Logic::And(a, b) if of(a) == at || of(b) == at => {
                let other = if of(a) == at { b } else { a };
                let lit = Lit { at: of(other), is: false };
                return self.exec(&Expr::Lit(lit), &Then::Put(at, false));
            }
            Logic::Or(a, b) if of(a) == at || of(b) == at => {
                let other = if of(a) == at { b } else { a };
                return self.exec(&Expr::Lit(Lit { at: of(other), is: true }), &Then::Put(at, true));
            }
            Logic::Not(a) | Logic::Copy(a) if of(a) == at => {
                return self.assign(at, &Expr::Lit(Lit { at, is: matches!(is, Logic::Copy(_)) }));
            }
            is => is,
        };
        let mut when = |lit: Lit, value: bool| self.exec(&Expr::Lit(lit), &Then::Put(at, value));
        let bit = |bit: Bit, is: bool| Lit { at: of(bit), is };
        match is {
            Logic::Not(a) => {
                when(bit(a, true), false);
                when(bit(a, false), true);
            }
            Logic::Copy(a) => {
                when(bit(a, false), false);
                when(bit(a, true), true);
            }
            Logic::And(a, b) => {
                self.out.put(at, true);
                self.exec(&Expr::Lit(bit(a, false)), &Then::Put(at, false));
                self.exec(&Expr::Lit(bit(b, false)), &Then::Put(at, false));
            }
            Logic::Or(a, b) => {
                self.out.put(at, false);
                self.exec(&Expr::Lit(bit(a, true)), &Then::Put(at, true));
                self.exec(&Expr::Lit(bit(b, true)), &Then::Put(at, true));
            }
        }
    }

    fn word(&mut self, op: &Op) {
        match op {
            Op::Move { dst, src } => self.copy(self.layout.word(*dst), self.ir.bytes(*dst), *src),
            Op::Math { op, dst, a, b } => self.math(*op, *dst, *a, *b),
            Op::Lookup { dst, index, table } => self.lookup(*dst, *index, *table),
            Op::ReadAdc { dst, input } => self.convert(*dst, *input),
            Op::SetPwm { duty } => self.duty(*duty),
            Op::Send { value } => self.send(*value),
            Op::Recall { dst, addr } => self.recall(*dst, *addr),
            Op::Persist { src, addr, busy, scans } => self.persist(*src, *addr, (*busy, Value::Const(*scans))),
            _ => {}
        }
    }
}
