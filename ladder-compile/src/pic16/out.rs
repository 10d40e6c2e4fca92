//! Code being written, with what is known on the way: which banks may be selected, what W holds.
//!
//! Every access to a byte first makes sure that its bank is selected, with no instruction where that is known already.
//! All jumps go forward (but for those of loops, which leave the bank alone), so what is known at a label is what all its
//! jumps and the way from above agree on.

use std::collections::BTreeMap;

use emu_pic16::isa::Kind;

use super::arch::{self, Jump, PAGE, Pic};
use super::chip::{ANY, Banks, Silicon};
use crate::code::{Asm, Label};
use crate::target::Mark;

/// STATUS, in every bank.
pub const STATUS: u16 = 3;
/// Carry, and no borrow.
pub const C: u8 = 0;
/// Zero.
pub const Z: u8 = 2;
const RP0: u8 = 5;
const RP1: u8 = 6;

/// A place in the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Lab(u32);

/// A piece of code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Item {
    /// An instruction, and the cycles it costs beyond those of its row.
    Op(Kind, Vec<i32>, u32),
    /// MOVLW or ADDLW of a byte of a label's address.
    Refer(Kind, Lab, u8),
    /// GOTO.
    Goto(Lab),
    /// GOTO backwards, taken at most so often in a row.
    Back(Lab, u32),
    /// CALL.
    Call(Lab),
    /// A label.
    Place(Lab),
    /// A mark.
    Mark(Mark),
    /// The page may change here: no jump goes across but calls.
    Cut,
}

impl Item {
    fn words(&self) -> u32 {
        u32::from(!matches!(self, Item::Place(_) | Item::Mark(_) | Item::Cut))
    }
}

/// Where a trial began.
#[derive(Debug, Clone)]
pub struct Save {
    items: usize,
    banks: Banks,
    open: BTreeMap<Lab, Banks>,
    w: Option<u8>,
}

/// Code being written.
#[derive(Debug)]
pub struct Out<'a> {
    /// The chip.
    pub chip: &'a Silicon,
    /// What has been written.
    pub items: Vec<Item>,
    labels: u32,
    /// Banks that may be selected now.
    pub banks: Banks,
    /// Banks that may be selected where jumps to a label stand.
    open: BTreeMap<Lab, Banks>,
    /// What W holds, where that is known.
    w: Option<u8>,
}

impl<'a> Out<'a> {
    /// Nothing yet; bank 0 is selected, as after reset.
    #[must_use]
    pub fn new(chip: &'a Silicon) -> Self {
        Out { chip, items: Vec::new(), labels: 0, banks: 1, open: BTreeMap::new(), w: None }
    }

    /// What has been written so far, to come back to.
    #[must_use]
    pub fn save(&self) -> Save {
        Save { items: self.items.len(), banks: self.banks, open: self.open.clone(), w: self.w }
    }

    /// Goes back; gives what was written since.
    pub fn restore(&mut self, save: &Save) -> Vec<Item> {
        self.banks = save.banks;
        self.open.clone_from(&save.open);
        self.w = save.w;
        self.items.split_off(save.items.min(self.items.len()))
    }

    /// Words written since.
    #[must_use]
    pub fn words_since(&self, save: &Save) -> u32 {
        self.items.iter().skip(save.items).map(Item::words).sum()
    }

    /// A new label.
    pub fn label(&mut self) -> Lab {
        self.labels += 1;
        Lab(self.labels - 1)
    }

    /// The label stands here.
    pub fn place(&mut self, label: Lab) {
        if let Some(banks) = self.open.remove(&label) {
            self.banks |= banks;
        }
        self.w = None;
        self.items.push(Item::Place(label));
    }

    /// Goes forward to a label.
    pub fn goto(&mut self, label: Lab) {
        *self.open.entry(label).or_insert(0) |= self.banks;
        let conditional = self.after_skip();
        self.items.push(Item::Goto(label));
        if !conditional {
            // What follows is only reached from elsewhere.
            self.banks = 0;
        }
    }

    /// Goes back to a label, at most `times` times in a row.
    pub fn back(&mut self, label: Lab, times: u32) {
        self.items.push(Item::Back(label, times));
    }

    /// Calls a subroutine that must find one of the banks `entry` selected and leaves `exit` selected.
    pub fn call(&mut self, label: Lab, entry: Banks, exit: Option<Banks>) {
        self.select(entry);
        self.items.push(Item::Call(label));
        self.w = None;
        self.banks = exit.unwrap_or(self.banks);
    }

    /// The page may change here.
    pub fn cut(&mut self) {
        self.items.push(Item::Cut);
    }

    /// A mark.
    pub fn mark(&mut self, mark: Mark) {
        self.items.push(Item::Mark(mark));
    }

    /// From here on anything may be selected that `banks` says, and W holds anything: code that others jump to.
    pub fn enter(&mut self, banks: Banks) {
        self.banks = banks;
        self.w = None;
    }

    fn after_skip(&self) -> bool {
        matches!(self.items.last(), Some(Item::Op(kind, ..)) if arch::is_skip(*kind))
    }

    fn push(&mut self, kind: Kind, operands: &[u16], extra: u32) {
        use Kind::{Bcf, Bsf, Btfsc, Btfss, Clrf, DecfszF, IncfszF, Movlw, Movwf};
        let conditional = self.after_skip();
        match kind {
            Movlw if !conditional => self.w = operands.first().map(|&k| k as u8),
            Bcf | Bsf | Btfsc | Btfss | Clrf | DecfszF | IncfszF | Movwf => {}
            Kind::IncfF | Kind::DecfF | Kind::AddwfF | Kind::SubwfF | Kind::XorwfF | Kind::IorwfF | Kind::AndwfF => {}
            Kind::RlfF | Kind::RrfF | Kind::ComfF | Kind::MovfF | Kind::Nop => {}
            _ => self.w = None,
        }
        self.items.push(Item::Op(kind, operands.iter().map(|&o| i32::from(o)).collect(), extra));
    }

    /// Makes sure that one of `allowed` is selected.
    pub fn select(&mut self, allowed: Banks) {
        if self.banks & !allowed == 0 {
            return;
        }
        const CHANGES: [&[(u8, bool)]; 8] = [
            &[(RP0, false)],
            &[(RP0, true)],
            &[(RP1, false)],
            &[(RP1, true)],
            &[(RP0, false), (RP1, false)],
            &[(RP0, true), (RP1, false)],
            &[(RP0, false), (RP1, true)],
            &[(RP0, true), (RP1, true)],
        ];
        let after = |changes: &[(u8, bool)]| {
            changes.iter().fold(self.banks, |set, &(bit, value)| {
                let weight = 1 << (bit - RP0);
                (0..4u8).filter(|bank| set >> bank & 1 == 1).fold(0, |new, bank| {
                    let bank = if value { bank | weight } else { bank & !weight };
                    new | 1 << bank
                })
            })
        };
        if let Some(changes) = CHANGES.iter().find(|changes| after(changes) & !allowed == 0) {
            let banks = after(changes);
            for &(bit, value) in *changes {
                self.push(if value { Kind::Bsf } else { Kind::Bcf }, &[STATUS, bit.into()], 0);
            }
            self.banks = banks;
        }
    }

    /// The banks from which all of these bytes are reached.
    #[must_use]
    pub fn common(&self, addrs: &[u16]) -> Banks {
        addrs.iter().fold(ANY, |set, &addr| set & self.chip.reach(addr))
    }

    /// An instruction on a byte of data memory.
    pub fn f(&mut self, kind: Kind, addr: u16) {
        self.select(self.chip.reach(addr));
        self.push(kind, &[addr & 0x7F], 0);
    }

    /// An instruction on a bit of data memory.
    pub fn bit(&mut self, kind: Kind, (addr, bit): (u16, u8)) {
        self.select(self.chip.reach(addr));
        self.push(kind, &[addr & 0x7F, bit.into()], 0);
    }

    /// Sets or clears a bit.
    pub fn put(&mut self, at: (u16, u8), value: bool) {
        self.bit(if value { Kind::Bsf } else { Kind::Bcf }, at);
    }

    /// The next instruction is left out unless the bit has the value.
    pub fn only_if(&mut self, at: (u16, u8), value: bool) {
        self.bit(if value { Kind::Btfsc } else { Kind::Btfss }, at);
    }

    /// An instruction with a constant.
    pub fn lit(&mut self, kind: Kind, k: u8) {
        self.push(kind, &[k.into()], 0);
    }

    /// An instruction without an operand.
    pub fn bare(&mut self, kind: Kind) {
        self.push(kind, &[], 0);
    }

    /// MOVWF PCL: takes a cycle more than other instructions on a byte.
    pub fn computed_goto(&mut self, pcl: u16) {
        self.push(Kind::Movwf, &[pcl], 1);
    }

    /// MOVLW or ADDLW of a byte of a label's address.
    pub fn refer(&mut self, kind: Kind, label: Lab, byte: u8) {
        self.items.push(Item::Refer(kind, label, byte));
        self.w = None;
    }

    /// W := k, where it does not hold it already.
    pub fn load(&mut self, k: u8) {
        if self.w != Some(k) {
            self.lit(Kind::Movlw, k);
        }
    }

    /// Byte at `addr` := k.
    pub fn set(&mut self, addr: u16, k: u8) {
        if k == 0 {
            self.f(Kind::Clrf, addr);
        } else {
            self.select(self.chip.reach(addr));
            self.load(k);
            self.f(Kind::Movwf, addr);
        }
    }
}

/// Hands the code to the assembler. Code of more than a page changes pages at cuts.
///
/// # Errors
/// A piece between two cuts is longer than a page.
pub fn assemble(items: &[Item], labels: u32, asm: &mut Asm<Pic>) -> Result<Vec<Label>, String> {
    let names: Vec<Label> = (0..labels).map(|_| asm.label()).collect();
    let name = |lab: &Lab| names.get(lab.0 as usize).copied().ok_or("a label has no place");
    let small = items.iter().map(Item::words).sum::<u32>() <= PAGE;
    let mut places: BTreeMap<Lab, u32> = BTreeMap::new();
    let mut pc = 0;
    for piece in items.split_inclusive(|item| *item == Item::Cut) {
        if !small {
            // Calls go to subroutines that stand before, so their lengths are known.
            let words = |at: u32| {
                let call = |lab| arch::words(Jump::Call, at, places.get(lab).copied().unwrap_or(at));
                piece.iter().map(|item| if let Item::Call(lab) = item { call(lab) } else { item.words() }).sum::<u32>()
            };
            let next = (pc / PAGE + 1) * PAGE;
            // Behind the piece there must be room for the change of page.
            if pc + words(pc) + 3 > next {
                if words(next) + 3 > PAGE {
                    return Err("an element is longer than a page of program memory".to_owned());
                }
                let there = asm.label();
                // By hand: the assembler would choose the form by where the label comes to stand without the filler.
                arch::changes(pc, next).for_each(|(kind, operands)| asm.op(kind, &operands));
                asm.jump(Jump::Bare, there);
                let used = arch::words(Jump::Goto, pc, next);
                asm.data(&vec![0x3FFF; (next - pc).saturating_sub(used) as usize]);
                asm.place(there);
                pc = next;
            }
        }
        for item in piece {
            match item {
                Item::Op(kind, operands, 0) => asm.op(*kind, operands),
                Item::Op(kind, operands, extra) => asm.costly(*kind, operands, *extra),
                Item::Refer(kind, lab, byte) => asm.refer(*kind, &[0], 0, name(lab)?, *byte, 0),
                Item::Goto(lab) => asm.jump(Jump::Goto, name(lab)?),
                Item::Back(lab, times) => asm.repeat(Jump::Goto, name(lab)?, *times),
                Item::Call(lab) => asm.jump(Jump::Call, name(lab)?),
                Item::Place(lab) => {
                    places.insert(*lab, pc);
                    asm.place(name(lab)?);
                }
                Item::Mark(mark) => asm.mark(*mark),
                Item::Cut => {}
            }
            let to = |lab| places.get(lab).copied().unwrap_or(pc);
            pc += match item {
                Item::Call(lab) => arch::words(Jump::Call, pc, to(lab)),
                Item::Back(lab, _) => arch::words(Jump::Goto, pc, to(lab)),
                item => item.words(),
            };
        }
    }
    Ok(names)
}

impl Out<'_> {
    /// Number of labels made so far.
    #[must_use]
    pub fn labels(&self) -> u32 {
        self.labels
    }
}
