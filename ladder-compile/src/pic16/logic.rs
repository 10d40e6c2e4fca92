//! Selects code for formulas as chains of skips.
//!
//! `btfss a; btfsc b; X` executes X unless a and not b, because a skip can skip the next skip. Let e(k) mean
//! "instruction k is executed" and c(k) "it skips"; then e(k + 1) = not (e(k) and c(k)). So a chain of skips
//! computes nested ANDs and ORs of literals with one word each. Everything else needs GOTO.

use emu_pic16::isa::Pic16OpKind;

use super::rung_formula::{BitLiteral, RungFormula};
use super::select::Pic16Selector;
use super::writer::{Pic16Label, Pic16Writer};

/// The single instruction to execute if a formula is true.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GuardedInstruction {
    /// Sets or clears a bit.
    StoreBit((u16, u8), bool),
    /// GOTO a label.
    Goto(Pic16Label),
    /// An instruction on the byte at this address, which also determines the bank. It must not be executed
    /// twice.
    Once(Pic16OpKind, u16),
}

impl GuardedInstruction {
    fn addr(&self) -> Option<u16> {
        match self {
            GuardedInstruction::StoreBit((addr, _), _) | GuardedInstruction::Once(_, addr) => Some(*addr),
            GuardedInstruction::Goto(_) => None,
        }
    }

    fn emit(&self, out: &mut Pic16Writer<'_>) {
        match self {
            GuardedInstruction::StoreBit(at, value) => out.set_bit(*at, *value),
            GuardedInstruction::Goto(label) => out.goto(*label),
            GuardedInstruction::Once(kind, addr) => out.byte_op(*kind, *addr),
        }
    }
}

/// Literals of a skip chain that executes the next instruction if `e` is true; `None` if there is no chain.
///
/// The first literal may be any comparison; the chain then starts with its flag.
fn skip_chain(e: &RungFormula) -> Option<Vec<&RungFormula>> {
    chain_of(e, true)
}

/// Chain for `e` if `is`, else for its complement.
fn chain_of(e: &RungFormula, is: bool) -> Option<Vec<&RungFormula>> {
    match e {
        RungFormula::Lit(_) | RungFormula::Cmp(_) => Some(vec![e]),
        RungFormula::Or(all) if is => joined_chain(all, is),
        RungFormula::And(all) if !is => joined_chain(all, is),
        _ => None,
    }
}

fn joined_chain(all: &[RungFormula], is: bool) -> Option<Vec<&RungFormula>> {
    let [a, b] = all else { return None };
    let (inner, last) = if matches!(b, RungFormula::Lit(_)) { (a, b) } else { (b, a) };
    if !matches!(last, RungFormula::Lit(_)) {
        return None;
    }
    let mut list = chain_of(inner, !is)?;
    list.push(last);
    Some(list)
}

impl Pic16Selector<'_, '_> {
    /// Executes `then` if `e` is true.
    pub fn execute_if(&mut self, e: &RungFormula, then: &GuardedInstruction) {
        match self.resolve_sign_bits(e.clone().merge_ranges()) {
            RungFormula::Const(false) => {}
            RungFormula::Const(true) => then.emit(&mut self.out),
            RungFormula::And(all) => self.execute_if_all(all, then),
            RungFormula::Or(all) => self.execute_if_any(all, then),
            e @ RungFormula::Range { .. } => {
                let e = self.compare_to_flags(&e);
                self.execute_if(&e, then);
            }
            e => _ = self.emit_chain(&e, then),
        }
    }

    /// Replaces comparisons that a sign bit decides by that bit.
    fn resolve_sign_bits(&self, e: RungFormula) -> RungFormula {
        match e {
            RungFormula::Cmp(c) => self.sign_bit_comparison(&c).map_or(RungFormula::Cmp(c), RungFormula::Lit),
            RungFormula::And(all) => RungFormula::And(all.into_iter().map(|e| self.resolve_sign_bits(e)).collect()),
            RungFormula::Or(all) => RungFormula::Or(all.into_iter().map(|e| self.resolve_sign_bits(e)).collect()),
            e => e,
        }
    }

    /// Emits a chain and `then`, if the formula has a chain and one bank reaches all its bytes; returns
    /// whether it did.
    fn emit_chain(&mut self, e: &RungFormula, then: &GuardedInstruction) -> bool {
        let Some(list) = skip_chain(e) else { return false };
        let mut addrs: Vec<u16> =
            list.iter().filter_map(|e| if let RungFormula::Lit(l) = e { Some(l.at.0) } else { None }).collect();
        let lits = self.out.common_banks(&addrs);
        addrs.extend(then.addr());
        let banks = self.out.common_banks(&addrs);
        if banks == 0 {
            if lits == 0 {
                return false;
            }
            // The bank of the literals does not reach the guarded byte, so jump around it.
            let over = self.out.label();
            self.execute_if(&e.opposite(), &GuardedInstruction::Goto(over));
            then.emit(&mut self.out);
            self.out.place(over);
            return true;
        }
        // The first instruction is always executed; each later literal inverts the sense of the earlier ones.
        let last = list.len();
        for (n, e) in list.into_iter().enumerate() {
            let lit = match e {
                RungFormula::Lit(lit) => *lit,
                e => match self.compare_to_flags(e) {
                    RungFormula::Lit(lit) => lit,
                    // A comparison must have a single flag here.
                    _ => return false,
                },
            };
            if n == 0 {
                self.out.select_bank(banks);
            }
            // The formula of the chain so far appears directly if an even number of skips follows, otherwise
            // complemented. So this literal must be true, or its complement must be, for execution.
            let lit = if (last - 1 - n) % 2 == 0 { lit } else { lit.opposite() };
            self.out.bit_op(lit.skip_unless(), lit.at);
        }
        then.emit(&mut self.out);
        true
    }

    /// Executes `then` if one of `all` is true.
    fn execute_if_any(&mut self, all: Vec<RungFormula>, then: &GuardedInstruction) {
        let groups = self.pair_chains(all);
        if groups.len() > 1 && matches!(then, GuardedInstruction::Once(..)) {
            let (over, all) =
                (self.out.label(), groups.into_iter().reduce(RungFormula::or).unwrap_or(RungFormula::Const(false)));
            self.execute_if(&all.opposite(), &GuardedInstruction::Goto(over));
            then.emit(&mut self.out);
            self.out.place(over);
            return;
        }
        for group in groups {
            if !self.emit_chain(&group, then) {
                match group {
                    // There is no chain, so test the parts one by one.
                    RungFormula::Or(parts) => parts.iter().for_each(|part| self.execute_if(part, then)),
                    part => self.execute_if(&part, then),
                }
            }
        }
    }

    /// Returns the parts of an OR, joined in pairs where two make a chain.
    fn pair_chains(&self, all: Vec<RungFormula>) -> Vec<RungFormula> {
        let (mut lits, others): (Vec<RungFormula>, Vec<RungFormula>) =
            all.into_iter().partition(|e| matches!(e, RungFormula::Lit(_)));
        let reach = |a: &RungFormula, b: &RungFormula| {
            let mut addrs = Vec::new();
            for e in [a, b] {
                addresses(e, &mut addrs);
            }
            self.out.common_banks(&addrs) != 0
        };
        let mut groups = Vec::new();
        // A literal alone costs one word less than another part alone, so the other parts choose partners
        // first.
        for other in others {
            let partner = lits.iter().position(|lit| chain_of(&other, false).is_some() && reach(&other, lit));
            groups.push(match partner {
                Some(n) => RungFormula::Or(vec![other, lits.remove(n)]),
                None => other,
            });
        }
        while !lits.is_empty() {
            let first = lits.remove(0);
            let partner = lits.iter().position(|lit| reach(&first, lit));
            groups.push(match partner {
                Some(n) => RungFormula::Or(vec![first, lits.remove(n)]),
                None => first,
            });
        }
        // Comparisons cost most, so they come last.
        groups.sort_by_key(|e| (formula_cost(e), 0));
        groups
    }

    /// Executes `then` if all of `all` are true.
    fn execute_if_all(&mut self, mut all: Vec<RungFormula>, then: &GuardedInstruction) {
        all.sort_by_key(formula_cost);
        // The last part needs no jump if the guarded instruction directly follows it; a literal is best.
        let odd = all.iter().filter(|e| matches!(e, RungFormula::Lit(_))).count() % 2 == 1;
        let place = all
            .iter()
            .rposition(|e| matches!(e, RungFormula::Lit(_)))
            .filter(|_| odd && !all.iter().any(|e| formula_cost(e) > 1));
        let last = match place {
            Some(n) => all.remove(n),
            None => all.pop().unwrap_or(RungFormula::Const(true)),
        };
        let over = self.out.label();
        let rest = all.into_iter().fold(RungFormula::Const(true), RungFormula::and).opposite();
        self.execute_if(&rest, &GuardedInstruction::Goto(over));
        self.execute_if(&last, then);
        self.out.place(over);
    }

    /// Sets a bit to the value of `e`.
    pub fn assign(&mut self, at: (u16, u8), e: &RungFormula) {
        match e {
            RungFormula::Const(value) => self.out.set_bit(at, *value),
            RungFormula::Lit(lit) if lit.at == at => {
                if !lit.is {
                    self.out.select_bank(self.out.chip.reachable_banks(at.0));
                    self.out.load_w(1 << at.1);
                    self.out.byte_op(Pic16OpKind::XorwfF, at.0);
                }
            }
            RungFormula::And(all) | RungFormula::Or(all) if e.reads_bit(at) => {
                let or = matches!(e, RungFormula::Or(_));
                let (own, rest): (Vec<_>, Vec<_>) = all.iter().cloned().partition(|e| e.reads_bit(at));
                match own.as_slice() {
                    // Assign the part that reads the bit first; the other parts can then only set it, or only
                    // clear it.
                    [own] => {
                        self.assign(at, own);
                        let join = if or { RungFormula::or } else { RungFormula::and };
                        let rest = rest.into_iter().reduce(join).unwrap_or(RungFormula::Const(!or));
                        self.execute_if(&rest.opposite_if(!or), &GuardedInstruction::StoreBit(at, or));
                    }
                    _ => {
                        let (no, end) = (self.out.label(), self.out.label());
                        self.execute_if(&e.opposite(), &GuardedInstruction::Goto(no));
                        self.out.set_bit(at, true);
                        self.out.goto(end);
                        self.out.place(no);
                        self.out.set_bit(at, false);
                        self.out.place(end);
                    }
                }
            }
            _ => {
                // Clear the bit and then set it, or set it and then clear it: whichever is shorter.
                let save = self.out.checkpoint();
                let mut words = [0; 2];
                for (n, first) in [(0, false), (1, true)] {
                    self.preset_bit(at, first, e);
                    words[n] = self.out.words_since(&save);
                    self.out.roll_back(&save);
                }
                self.preset_bit(at, words[1] < words[0], e);
            }
        }
    }

    fn preset_bit(&mut self, at: (u16, u8), first: bool, e: &RungFormula) {
        self.out.set_bit(at, first);
        self.execute_if(&e.clone().opposite_if(first), &GuardedInstruction::StoreBit(at, !first));
    }
}

/// Approximate number of words of a part, for sorting: literals first, comparisons last.
fn formula_cost(e: &RungFormula) -> usize {
    match e {
        RungFormula::Const(_) => 0,
        RungFormula::Lit(_) => 1,
        RungFormula::Cmp(_) | RungFormula::Range { .. } => 6,
        RungFormula::And(all) | RungFormula::Or(all) => 1 + all.iter().map(formula_cost).sum::<usize>(),
    }
}

fn addresses(e: &RungFormula, into: &mut Vec<u16>) {
    match e {
        RungFormula::Lit(BitLiteral { at, .. }) => into.push(at.0),
        RungFormula::And(all) | RungFormula::Or(all) => all.iter().for_each(|e| addresses(e, into)),
        _ => {}
    }
}
