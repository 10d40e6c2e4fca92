//! Formulas to code: chains of skips.
//!
//! `btfss a; btfsc b; X` executes X unless a and not b: a skip that skips the next skip. With e(k) for "instruction k is
//! executed" and c(k) for "it skips", e(k + 1) = not (e(k) and c(k)), so a row of skips computes nested ANDs and ORs of literals
//! at one word each. Anything else goes around by GOTO.

use emu_pic16::isa::Kind;

use super::expr::{Expr, Lit};
use super::out::{Lab, Out};
use super::select::Select;

/// What is done when a formula holds: one instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Then {
    /// A bit becomes 0 or 1.
    Put((u16, u8), bool),
    /// GOTO.
    Goto(Lab),
    /// An instruction on bytes that `addr` shares its bank with; it must not be executed twice.
    Once(Kind, u16),
}

impl Then {
    fn addr(&self) -> Option<u16> {
        match self {
            Then::Put((addr, _), _) | Then::Once(_, addr) => Some(*addr),
            Then::Goto(_) => None,
        }
    }

    fn emit(&self, out: &mut Out<'_>) {
        match self {
            Then::Put(at, value) => out.put(*at, *value),
            Then::Goto(label) => out.goto(*label),
            Then::Once(kind, addr) => out.f(*kind, *addr),
        }
    }
}

/// The literals of a chain that executes what follows when `e` holds; `None` where there is none. The first may be any
/// comparison (`first`), whose flag the chain starts with.
fn chain(e: &Expr) -> Option<Vec<&Expr>> {
    chain_of(e, true)
}

/// A chain for `e`, or for its complement.
fn chain_of(e: &Expr, is: bool) -> Option<Vec<&Expr>> {
    match e {
        Expr::Lit(_) | Expr::Cmp(_) => Some(vec![e]),
        Expr::Or(all) if is => joined(all, is),
        Expr::And(all) if !is => joined(all, is),
        _ => None,
    }
}

fn joined(all: &[Expr], is: bool) -> Option<Vec<&Expr>> {
    let [a, b] = all else { return None };
    let (inner, last) = if matches!(b, Expr::Lit(_)) { (a, b) } else { (b, a) };
    if !matches!(last, Expr::Lit(_)) {
        return None;
    }
    let mut list = chain_of(inner, !is)?;
    list.push(last);
    Some(list)
}

impl Select<'_, '_> {
    /// Executes `then` if `e` holds.
    pub fn exec(&mut self, e: &Expr, then: &Then) {
        match self.plain(e.clone().ranged()) {
            Expr::Const(false) => {}
            Expr::Const(true) => then.emit(&mut self.out),
            Expr::And(all) => self.all(all, then),
            Expr::Or(all) => self.any(all, then),
            e @ Expr::Range { .. } => {
                let e = self.flags(&e);
                self.exec(&e, then);
            }
            e => _ = self.chained(&e, then),
        }
    }

    /// Comparisons that are bits of data memory become what they are.
    fn plain(&self, e: Expr) -> Expr {
        match e {
            Expr::Cmp(c) => self.sign(&c).map_or(Expr::Cmp(c), Expr::Lit),
            Expr::And(all) => Expr::And(all.into_iter().map(|e| self.plain(e)).collect()),
            Expr::Or(all) => Expr::Or(all.into_iter().map(|e| self.plain(e)).collect()),
            e => e,
        }
    }

    /// Emits a chain and `then`, if the formula is one and all its bytes are reached from one bank; says whether.
    fn chained(&mut self, e: &Expr, then: &Then) -> bool {
        let Some(list) = chain(e) else { return false };
        let mut addrs: Vec<u16> =
            list.iter().filter_map(|e| if let Expr::Lit(l) = e { Some(l.at.0) } else { None }).collect();
        let lits = self.out.common(&addrs);
        addrs.extend(then.addr());
        let banks = self.out.common(&addrs);
        if banks == 0 {
            if lits == 0 {
                return false;
            }
            // What is done is not reached from where the literals are.
            let over = self.out.label();
            self.exec(&e.opposite(), &Then::Goto(over));
            then.emit(&mut self.out);
            self.out.place(over);
            return true;
        }
        // The first instruction is executed; each negation on the way to the outermost literal turns the sense.
        let last = list.len();
        for (n, e) in list.into_iter().enumerate() {
            let lit = match e {
                Expr::Lit(lit) => *lit,
                e => match self.flags(e) {
                    Expr::Lit(lit) => lit,
                    // A comparison has one flag.
                    _ => return false,
                },
            };
            if n == 0 {
                self.out.select(banks);
            }
            // The formula of the chain so far appears as it is where an even number of skips follow, else complemented: a
            // literal of e is wanted true to execute, one of the complement's complement too.
            let lit = if (last - 1 - n) % 2 == 0 { lit } else { lit.opposite() };
            self.out.bit(lit.only_if(), lit.at);
        }
        then.emit(&mut self.out);
        true
    }

    /// Executes `then` if one of `all` holds.
    fn any(&mut self, all: Vec<Expr>, then: &Then) {
        let groups = self.groups(all);
        if groups.len() > 1 && matches!(then, Then::Once(..)) {
            let (over, all) = (self.out.label(), groups.into_iter().reduce(Expr::or).unwrap_or(Expr::Const(false)));
            self.exec(&all.opposite(), &Then::Goto(over));
            then.emit(&mut self.out);
            self.out.place(over);
            return;
        }
        for group in groups {
            if !self.chained(&group, then) {
                match group {
                    // No chain: one by one.
                    Expr::Or(parts) => parts.iter().for_each(|part| self.exec(part, then)),
                    part => self.exec(&part, then),
                }
            }
        }
    }

    /// The parts of an OR, in twos where two make a chain.
    fn groups(&self, all: Vec<Expr>) -> Vec<Expr> {
        let (mut lits, others): (Vec<Expr>, Vec<Expr>) = all.into_iter().partition(|e| matches!(e, Expr::Lit(_)));
        let reach = |a: &Expr, b: &Expr| {
            let mut addrs = Vec::new();
            for e in [a, b] {
                addresses(e, &mut addrs);
            }
            self.out.common(&addrs) != 0
        };
        let mut groups = Vec::new();
        // A literal that begins a chain of its own is one word less than a part that cannot, so parts choose first.
        for other in others {
            let partner = lits.iter().position(|lit| chain_of(&other, false).is_some() && reach(&other, lit));
            groups.push(match partner {
                Some(n) => Expr::Or(vec![other, lits.remove(n)]),
                None => other,
            });
        }
        while !lits.is_empty() {
            let first = lits.remove(0);
            let partner = lits.iter().position(|lit| reach(&first, lit));
            groups.push(match partner {
                Some(n) => Expr::Or(vec![first, lits.remove(n)]),
                None => first,
            });
        }
        // Comparisons cost most, so they come last.
        groups.sort_by_key(|e| (cost(e), 0));
        groups
    }

    /// Executes `then` if all of `all` hold.
    fn all(&mut self, mut all: Vec<Expr>, then: &Then) {
        all.sort_by_key(cost);
        // The last part needs no jump of its own if what is done can stand behind it; a literal is the best.
        let odd = all.iter().filter(|e| matches!(e, Expr::Lit(_))).count() % 2 == 1;
        let place =
            all.iter().rposition(|e| matches!(e, Expr::Lit(_))).filter(|_| odd && !all.iter().any(|e| cost(e) > 1));
        let last = match place {
            Some(n) => all.remove(n),
            None => all.pop().unwrap_or(Expr::Const(true)),
        };
        let over = self.out.label();
        let rest = all.into_iter().fold(Expr::Const(true), Expr::and).opposite();
        self.exec(&rest, &Then::Goto(over));
        self.exec(&last, then);
        self.out.place(over);
    }

    /// The bit becomes what `e` is.
    pub fn assign(&mut self, at: (u16, u8), e: &Expr) {
        match e {
            Expr::Const(value) => self.out.put(at, *value),
            Expr::Lit(lit) if lit.at == at => {
                if !lit.is {
                    self.out.select(self.out.chip.reach(at.0));
                    self.out.load(1 << at.1);
                    self.out.f(Kind::XorwfF, at.0);
                }
            }
            Expr::And(all) | Expr::Or(all) if e.reads_bit(at) => {
                let or = matches!(e, Expr::Or(_));
                let (own, rest): (Vec<_>, Vec<_>) = all.iter().cloned().partition(|e| e.reads_bit(at));
                match own.as_slice() {
                    // The part that reads the bit first; the others only ever set it, or only ever clear it.
                    [own] => {
                        self.assign(at, own);
                        let join = if or { Expr::or } else { Expr::and };
                        let rest = rest.into_iter().reduce(join).unwrap_or(Expr::Const(!or));
                        self.exec(&rest.opposite_if(!or), &Then::Put(at, or));
                    }
                    _ => {
                        let (no, end) = (self.out.label(), self.out.label());
                        self.exec(&e.opposite(), &Then::Goto(no));
                        self.out.put(at, true);
                        self.out.goto(end);
                        self.out.place(no);
                        self.out.put(at, false);
                        self.out.place(end);
                    }
                }
            }
            _ => {
                // Cleared and then set, or set and then cleared: whichever is shorter.
                let save = self.out.save();
                let mut words = [0; 2];
                for (n, first) in [(0, false), (1, true)] {
                    self.preset(at, first, e);
                    words[n] = self.out.words_since(&save);
                    self.out.restore(&save);
                }
                self.preset(at, words[1] < words[0], e);
            }
        }
    }

    fn preset(&mut self, at: (u16, u8), first: bool, e: &Expr) {
        self.out.put(at, first);
        self.exec(&e.clone().opposite_if(first), &Then::Put(at, !first));
    }
}

/// Words of a part, roughly: literals first, comparisons last.
fn cost(e: &Expr) -> usize {
    match e {
        Expr::Const(_) => 0,
        Expr::Lit(_) => 1,
        Expr::Cmp(_) | Expr::Range { .. } => 6,
        Expr::And(all) | Expr::Or(all) => 1 + all.iter().map(cost).sum::<usize>(),
    }
}

fn addresses(e: &Expr, into: &mut Vec<u16>) {
    match e {
        Expr::Lit(Lit { at, .. }) => into.push(at.0),
        Expr::And(all) | Expr::Or(all) => all.iter().for_each(|e| addresses(e, into)),
        _ => {}
    }
}
