//! Intermediate code to instructions.
//!
//! Most operations are one instruction. Two things are followed on the way: whether A holds the accumulator or its complement, since
//! what comes next often wants the one or the other and both cost the same; and what A holds where that is known.

use std::collections::HashMap;

use emu_ap101::isa::Kind;
use ladder::CounterKind;

use super::layout::{self, Layout, M, R, RESET};
use super::{Jump, Machine};
use crate::code::Asm;
use crate::ir::{Bit, Cond, Logic, Module, Op, Word};

/// What comes behind an operation: the rest of its list, then what follows the list.
#[derive(Clone, Copy)]
struct Rest<'a> {
    ops: &'a [&'a Op],
    then: Option<&'a Rest<'a>>,
}

/// Selects instructions for a scan.
pub(super) struct Select<'a, 'b> {
    pub asm: &'b mut Asm<Machine>,
    layout: &'a Layout,
    all: &'a [&'a Op],
    /// A holds the complement of the accumulator.
    inverted: bool,
    /// What A holds, the accumulator or not.
    known: Option<bool>,
    /// A bit that A holds, or the complement of which.
    held: Option<(u16, bool)>,
    /// Temporaries that are not kept, because another bit is the same for as long as they are read: that one, and whether it is the
    /// complement.
    same: HashMap<Bit, (u16, bool)>,
    /// A does not really hold what it is said to.
    passing: bool,
}

impl<'a, 'b> Select<'a, 'b> {
    /// `all`: the operations of the scan, which [`Select::next`] takes one after the other.
    pub(super) fn new(asm: &'b mut Asm<Machine>, layout: &'a Layout, all: &'a [&'a Op]) -> Self {
        Select { asm, layout, all, inverted: false, known: None, held: None, same: HashMap::new(), passing: false }
    }

    /// The next operation of the scan.
    pub(super) fn next(&mut self) {
        if let Some((op, ops)) = self.all.split_first() {
            self.all = ops;
            self.op(op, &Rest { ops, then: None });
        }
    }

    /// Brings outputs from their images to their channels.
    pub(super) fn outputs(&mut self) {
        for &(image, channel) in &self.layout.late {
            self.put(Kind::Ld, image);
            self.put(Kind::Sto, channel);
        }
    }

    fn put(&mut self, kind: Kind, addr: u16) {
        self.asm.op(kind, &[addr.into()]);
        let writes = matches!(kind, Kind::Sto | Kind::Stoc | Kind::Stc | Kind::Rtc);
        if !writes || self.held.is_some_and(|(held, _)| held == addr) {
            self.held = None;
        }
        if !writes {
            self.known = None;
        }
        // What is written to a module is not what is read there.
        match kind {
            Kind::Ld | Kind::Ldc => self.held = Some((addr, kind == Kind::Ldc)),
            Kind::Sto | Kind::Stoc if !(R..M).contains(&addr) => self.held = Some((addr, kind == Kind::Stoc)),
            _ => {}
        }
    }

    fn bit(&self, bit: Bit) -> u16 {
        self.layout.bits.get(bit.0 as usize).copied().unwrap_or(0)
    }

    /// Where a bit can be read, and whether its complement is there.
    fn source(&self, bit: Bit) -> (u16, bool) {
        self.same.get(&bit).copied().unwrap_or((self.bit(bit), false))
    }

    /// A temporary can be that address for as long as it is read; `rest` comes behind its store.
    fn lasts(&self, bit: Bit, addr: u16, rest: &Rest<'_>) -> bool {
        self.layout.temporary.contains(&bit)
            && rest.then.is_none()
            && addr != self.layout.scratch
            && !(R..M).contains(&addr)
            && self.stays(rest.ops, bit, addr)
    }

    /// Stores the accumulator in a temporary by remembering which bit is the same; false where none is, or not long enough.
    fn remembers(&mut self, bit: Bit, negated: bool, rest: &Rest<'_>) -> bool {
        self.same.remove(&bit);
        if let Some((addr, complement)) = self.held
            && self.lasts(bit, addr, rest)
        {
            self.same.insert(bit, (addr, complement != (self.inverted != negated)));
        }
        self.same.contains_key(&bit)
    }

    /// What is loaded is only stored, and that store only remembered.
    fn passes(&self, addr: u16, rest: &Rest<'_>) -> bool {
        let Some((Op::Store { bit, .. }, ops)) = rest.ops.split_first() else { return false };
        let behind = Rest { ops, then: rest.then };
        !reads_acc(&behind) && self.lasts(*bit, addr, &behind)
    }

    /// Until `bit` gets a new value for certain, nothing writes to it or to the address.
    fn stays(&self, ops: &[&Op], bit: Bit, addr: u16) -> bool {
        for op in ops {
            if matches!(op, Op::Store { bit: other, .. } | Op::Put { bit: other, .. } | Op::Logic { dst: other, .. } if *other == bit)
            {
                return true;
            }
            let mut written = false;
            layout::each(op, &mut |op| {
                written |= layout::written(op).is_some_and(|other| other == bit || self.bit(other) == addr);
            });
            if written {
                return false;
            }
        }
        true
    }

    fn module(&self, word: Word) -> u16 {
        R + self.layout.words.get(word.0 as usize).copied().unwrap_or(0)
    }

    fn not(&mut self) {
        self.asm.op(Kind::Not, &[]);
        self.inverted = !self.inverted;
        self.known = self.known.map(|a| !a);
        self.held = self.held.map(|(bit, complement)| (bit, !complement));
    }

    fn clear(&mut self) {
        if self.known != Some(false) {
            self.asm.op(Kind::Clr, &[]);
            (self.known, self.held) = (Some(false), None);
        }
    }

    /// Makes A the accumulator, or its complement.
    fn turn(&mut self, inverted: bool) {
        if self.inverted != inverted {
            self.not();
        }
    }

    fn load(&mut self, addr: u16, negated: bool, rest: &Rest<'_>) {
        if let Some((_, complement)) = self.held.filter(|(held, _)| *held == addr) {
            self.inverted = complement != negated;
            return;
        }
        self.inverted = wants_inverted(rest);
        self.put(if negated == self.inverted { Kind::Ld } else { Kind::Ldc }, addr);
    }

    fn store(&mut self, addr: u16, negated: bool) {
        self.put(if negated == self.inverted { Kind::Sto } else { Kind::Stoc }, addr);
    }

    /// acc and the bit; of complements that is an or.
    fn and(&mut self, addr: u16, negated: bool) {
        let kind = match (self.inverted, negated) {
            (false, false) => Kind::And,
            (false, true) => Kind::Andc,
            (true, false) => Kind::Orc,
            (true, true) => Kind::Or,
        };
        self.put(kind, addr);
    }

    fn or(&mut self, addr: u16, negated: bool) {
        let kind = match (self.inverted, negated) {
            (false, false) => Kind::Or,
            (false, true) => Kind::Orc,
            (true, false) => Kind::Andc,
            (true, true) => Kind::And,
        };
        self.put(kind, addr);
    }

    /// Makes a bit a constant; what the accumulator is stays.
    fn constant(&mut self, addr: u16, value: bool, rest: &Rest<'_>) {
        let write = if value { Kind::Stc } else { Kind::Rtc };
        if self.known.is_none() {
            if reads_acc(rest) {
                self.put(write, addr);
                self.not();
                return self.put(write, addr);
            }
            self.clear();
        }
        self.put(if self.known == Some(value) { Kind::Sto } else { Kind::Stoc }, addr);
    }

    fn op(&mut self, op: &Op, rest: &Rest<'_>) {
        match op {
            Op::Acc(value) => {
                self.clear();
                self.inverted = *value;
            }
            Op::Load { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                if self.passes(addr, rest) {
                    // As if A held it, until the store is over.
                    (self.held, self.inverted, self.passing) = (Some((addr, false)), *negated != complement, true);
                } else {
                    self.load(addr, *negated != complement, rest);
                }
            }
            Op::And { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                self.and(addr, *negated != complement);
            }
            Op::Or { bit, negated } => {
                let (addr, complement) = self.source(*bit);
                self.or(addr, *negated != complement);
            }
            Op::Store { bit, negated } => {
                if !self.remembers(*bit, *negated, rest) {
                    self.store(self.bit(*bit), *negated);
                }
                if std::mem::take(&mut self.passing) {
                    self.held = None;
                }
            }
            Op::Put { bit, value } => {
                self.same.remove(bit);
                self.constant(self.bit(*bit), *value, rest);
            }
            Op::Rising(memory) => self.rising(self.bit(*memory)),
            Op::Falling(memory) => self.falling(self.bit(*memory)),
            // A reset: nothing else that moves numbers comes here.
            Op::Move { dst, .. } => self.constant(self.module(*dst) + RESET, true, rest),
            Op::Module { is, word, .. } => self.element(*is, *word, rest),
            Op::Logic { dst, is } => {
                self.logic(self.bit(*dst), *is);
                self.same.remove(dst);
            }
            Op::If { cond, then, otherwise } => self.branch(*cond, then, otherwise, rest),
            // Refused before.
            Op::AndCompare(_)
            | Op::Math { .. }
            | Op::Lookup { .. }
            | Op::ReadAdc { .. }
            | Op::SetPwm { .. }
            | Op::Send { .. }
            | Op::Receive { .. }
            | Op::Recall { .. }
            | Op::Persist { .. } => {}
        }
    }

    /// The memory first loses its 1 where in is 0; then out is what of in the memory has not, and is added to it.
    fn rising(&mut self, memory: u16) {
        self.turn(true);
        self.put(Kind::Rtc, memory);
        self.not();
        self.put(Kind::Andc, memory);
        self.put(Kind::Stc, memory);
    }

    /// The same with in and memory complemented.
    fn falling(&mut self, memory: u16) {
        self.turn(false);
        self.put(Kind::Stc, memory);
        self.not();
        self.put(Kind::And, memory);
        self.put(Kind::Rtc, memory);
        self.inverted = false;
    }

    /// The template of an operation by itself.
    fn logic(&mut self, dst: u16, is: Logic) {
        let (first, second) = match is {
            Logic::Copy(a) => ((Kind::Ld, Kind::Ldc, a), None),
            Logic::Not(a) => ((Kind::Ldc, Kind::Ld, a), None),
            Logic::And(a, b) => ((Kind::Ld, Kind::Ldc, a), Some((Kind::And, Kind::Andc, b))),
            Logic::Or(a, b) => ((Kind::Ld, Kind::Ldc, a), Some((Kind::Or, Kind::Orc, b))),
        };
        for (plain, complemented, bit) in std::iter::once(first).chain(second) {
            let (addr, complement) = self.source(bit);
            self.put(if complement { complemented } else { plain }, addr);
        }
        self.put(Kind::Sto, dst);
        self.inverted = false;
    }

    /// A timer or counter.
    fn element(&mut self, is: Module, word: Word, rest: &Rest<'_>) {
        let module = self.module(word);
        let circular = matches!(is, Module::Counter { kind: CounterKind::Ctc, .. });
        if layout::is_plain(is) {
            self.store(module, false);
            // What a CTC gives is what it gets.
            if !circular && reads_acc(rest) {
                self.load(module, false, rest);
            }
            return;
        }
        let Module::Counter { kind, input, bounded } = is else { return };
        let scratch = self.layout.scratch;
        // It counts the edges of what is written, so that a 0 comes before each 1; Q is then what the count makes of it.
        self.store(scratch, false);
        self.clear();
        self.put(Kind::Sto, module);
        self.put(if matches!(input, '/' | 'o') { Kind::Ldc } else { Kind::Ld }, scratch);
        self.inverted = input == '/';
        let edge = self.layout.edges.get(&word).copied().unwrap_or(scratch);
        match input {
            '/' => self.rising(edge),
            '\\' => self.falling(edge),
            _ => {}
        }
        match kind {
            CounterKind::Ctu if bounded => self.put(Kind::Andc, module),
            CounterKind::Ctd if bounded => self.put(Kind::And, module),
            _ => {}
        }
        self.put(Kind::Sto, module);
        self.load(if circular { scratch } else { module }, false, rest);
    }

    fn branch(&mut self, cond: Cond, then: &[Op], otherwise: &[Op], rest: &Rest<'_>) {
        let simple = |ops: &[Op]| ops.iter().all(|op| matches!(op, Op::Put { .. } | Op::Move { .. }));
        match cond {
            Cond::Acc if simple(then) && simple(otherwise) => {
                for (ops, inverted) in [(then, false), (otherwise, true)] {
                    ops.iter().for_each(|op| self.conditional(op, inverted));
                }
            }
            Cond::Acc => {
                self.turn(false);
                self.arms(then, otherwise, None, rest);
            }
            Cond::Bit(bit) => {
                if let ([Op::Store { bit: stored, negated: false }], [Op::Put { bit: set, value: true }]) =
                    (then, otherwise)
                    && *stored == bit
                    && *set == bit
                    && !reads_acc(rest)
                {
                    // The master relay: on where it was off, else the accumulator.
                    self.or(self.bit(bit), true);
                    return self.store(self.bit(bit), false);
                }
                let scratch = self.layout.scratch;
                let (then_ops, other_ops): (Vec<&Op>, Vec<&Op>) = (then.iter().collect(), otherwise.iter().collect());
                let reads = |ops: &[&Op]| reads_acc(&Rest { ops, then: Some(rest) });
                let kept = reads(&then_ops) || reads(&other_ops);
                if kept {
                    self.store(scratch, false);
                }
                let (addr, complement) = self.source(bit);
                self.put(if complement { Kind::Ldc } else { Kind::Ld }, addr);
                self.inverted = false;
                self.arms(then, otherwise, kept.then_some(scratch), rest);
            }
            // Refused before.
            Cond::Compare(_) => {}
        }
    }

    /// A constant is written, or a module reset, where the accumulator is 1, or where it is 0.
    fn conditional(&mut self, op: &Op, inverted: bool) {
        let (kind, addr) = match op {
            Op::Put { bit, value } => (if *value { Kind::Stc } else { Kind::Rtc }, self.bit(*bit)),
            Op::Move { dst, .. } => (Kind::Stc, self.module(*dst) + RESET),
            _ => return,
        };
        self.turn(inverted);
        self.put(kind, addr);
    }

    /// Two lists, of which A decides; `from`: where the accumulator is, if not in A.
    fn arms(&mut self, then: &[Op], otherwise: &[Op], from: Option<u16>, rest: &Rest<'_>) {
        let (first, end) = (self.asm.label(), self.asm.label());
        self.asm.jump(Jump::IfSet, first);
        self.arm(otherwise, false, from, rest);
        self.asm.jump(Jump::Always, end);
        self.asm.place(first);
        self.arm(then, true, from, rest);
        self.asm.place(end);
        (self.known, self.held) = (None, None);
    }

    fn arm(&mut self, list: &[Op], a: bool, from: Option<u16>, rest: &Rest<'_>) {
        let ops: Vec<&Op> = list.iter().collect();
        (self.inverted, self.known, self.held) = (false, Some(a), None);
        let mut here = Rest { ops: &ops, then: Some(rest) };
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
            self.turn(false);
        }
        self.inverted = false;
    }
}

/// What a list of operations does with the accumulator that it gets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Reads it.
    Reads,
    /// Gives it another value first.
    Sets,
    /// Neither.
    Leaves,
}

fn using<'a>(mut ops: impl Iterator<Item = &'a Op>) -> Use {
    let one = |op: &Op| match op {
        Op::Acc(_) | Op::Load { .. } | Op::Logic { .. } => Use::Sets,
        Op::Put { .. } | Op::Move { .. } => Use::Leaves,
        Op::If { cond: Cond::Bit(_), then, otherwise } => match (using(then.iter()), using(otherwise.iter())) {
            (Use::Reads, _) | (_, Use::Reads) => Use::Reads,
            (Use::Sets, Use::Sets) => Use::Sets,
            _ => Use::Leaves,
        },
        _ => Use::Reads,
    };
    ops.find_map(|op| Some(one(op)).filter(|used| *used != Use::Leaves)).unwrap_or(Use::Leaves)
}

/// The accumulator is read before it gets another value.
fn reads_acc(rest: &Rest<'_>) -> bool {
    match using(rest.ops.iter().copied()) {
        Use::Leaves => rest.then.is_some_and(reads_acc),
        used => used == Use::Reads,
    }
}

/// What comes next is shorter where A is the complement of the accumulator.
fn wants_inverted(rest: &Rest<'_>) -> bool {
    let mut turned = false;
    for op in rest.ops {
        match op {
            Op::And { .. } | Op::Or { .. } | Op::Store { .. } => {}
            // A constant is written once for each value of A.
            Op::Put { .. } | Op::Move { .. } => turned = !turned,
            Op::Rising(_) => return !turned,
            Op::Module { is: Module::Counter { kind: CounterKind::Ctc, .. }, .. } => {}
            Op::If { cond: Cond::Acc, then, otherwise } => return turned != (then.is_empty() && !otherwise.is_empty()),
            _ => return turned,
        }
    }
    turned
}
