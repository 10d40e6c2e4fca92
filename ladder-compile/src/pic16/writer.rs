//! Code being written, with what is known on the way: which banks may be selected, what W holds.
//!
//! Every access to a byte first makes sure that its bank is selected, with no instruction where that is known already.
//! All jumps go forward (but for those of loops, which leave the bank alone), so what is known at a label is what all its
//! jumps and the way from above agree on.

use std::collections::BTreeMap;

use emu_pic16::isa::Kind;

use super::arch::{self, PAGE, Pic16Arch, Pic16Jump};
use super::chip_data::{ANY_BANK, BankSet, Pic16ChipData};
use crate::CodegenError;
use crate::code::{CodeLabel, CodeWriter};
use crate::target::CodeMark;

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
pub struct Pic16Label(u32);

/// A piece of code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pic16Item {
    /// An instruction, and the cycles it costs beyond those of its row.
    Op(Kind, Vec<i32>, u32),
    /// MOVLW or ADDLW of a byte of a label's address.
    LabelByte(Kind, Pic16Label, u8),
    /// GOTO.
    Goto(Pic16Label),
    /// GOTO backwards, taken at most so often in a row.
    GotoBack(Pic16Label, u32),
    /// CALL.
    Call(Pic16Label),
    /// A label.
    Place(Pic16Label),
    /// A mark.
    Mark(CodeMark),
    /// The page may change here: no jump goes across but calls.
    PageBoundary,
}

/// Words that a change of page takes at most: both bits of PCLATH and GOTO.
const MAX_PAGE_CHANGE_WORDS: u32 = 3;

impl Pic16Item {
    /// Words within a page.
    fn words(&self) -> u32 {
        self.words_at(0)
    }

    /// Words, with the form `level` of an item that goes elsewhere.
    fn words_at(&self, level: u8) -> u32 {
        match self {
            Pic16Item::Place(_) | Pic16Item::Mark(_) | Pic16Item::PageBoundary => 0,
            Pic16Item::Op(..) | Pic16Item::LabelByte(..) => 1,
            Pic16Item::Goto(_) | Pic16Item::GotoBack(..) => arch::form_words(Pic16Jump::Goto, level),
            Pic16Item::Call(_) => arch::form_words(Pic16Jump::Call, level),
        }
    }

    /// Where it goes.
    fn target_label(&self) -> Option<Pic16Label> {
        match self {
            Pic16Item::Goto(label) | Pic16Item::GotoBack(label, _) | Pic16Item::Call(label) => Some(*label),
            _ => None,
        }
    }
}

/// Where a trial began.
#[derive(Debug, Clone)]
pub struct WriterCheckpoint {
    items: usize,
    banks: BankSet,
    open: BTreeMap<Pic16Label, BankSet>,
    w: Option<u8>,
}

/// Code being written.
#[derive(Debug)]
pub struct Pic16Writer<'a> {
    /// The chip.
    pub chip: &'a Pic16ChipData,
    /// What has been written.
    pub items: Vec<Pic16Item>,
    labels: u32,
    /// Banks that may be selected now.
    pub banks: BankSet,
    /// Banks that may be selected where jumps to a label stand.
    open: BTreeMap<Pic16Label, BankSet>,
    /// What W holds, where that is known.
    w: Option<u8>,
}

impl<'a> Pic16Writer<'a> {
    /// Nothing yet; bank 0 is selected, as after reset.
    #[must_use]
    pub fn new(chip: &'a Pic16ChipData) -> Self {
        Pic16Writer { chip, items: Vec::new(), labels: 0, banks: 1, open: BTreeMap::new(), w: None }
    }

    /// What has been written so far, to come back to.
    #[must_use]
    pub fn checkpoint(&self) -> WriterCheckpoint {
        WriterCheckpoint { items: self.items.len(), banks: self.banks, open: self.open.clone(), w: self.w }
    }

    /// Goes back; gives what was written since.
    pub fn roll_back(&mut self, save: &WriterCheckpoint) -> Vec<Pic16Item> {
        self.banks = save.banks;
        self.open.clone_from(&save.open);
        self.w = save.w;
        self.items.split_off(save.items.min(self.items.len()))
    }

    /// Words written since.
    #[must_use]
    pub fn words_since(&self, save: &WriterCheckpoint) -> u32 {
        self.items.iter().skip(save.items).map(Pic16Item::words).sum()
    }

    /// A new label.
    pub fn label(&mut self) -> Pic16Label {
        self.labels += 1;
        Pic16Label(self.labels - 1)
    }

    /// The label stands here.
    pub fn place(&mut self, label: Pic16Label) {
        if let Some(banks) = self.open.remove(&label) {
            self.banks |= banks;
        }
        self.w = None;
        self.items.push(Pic16Item::Place(label));
    }

    /// Goes forward to a label.
    pub fn goto(&mut self, label: Pic16Label) {
        *self.open.entry(label).or_insert(0) |= self.banks;
        let conditional = self.after_skip();
        self.items.push(Pic16Item::Goto(label));
        if !conditional {
            // What follows is only reached from elsewhere.
            self.banks = 0;
        }
    }

    /// Goes back to a label, at most `times` times in a row.
    pub fn goto_back(&mut self, label: Pic16Label, times: u32) {
        self.items.push(Pic16Item::GotoBack(label, times));
    }

    /// Calls a subroutine that must find one of the banks `entry` selected and leaves `exit` selected.
    pub fn call(&mut self, label: Pic16Label, entry: BankSet, exit: Option<BankSet>) {
        self.select_bank(entry);
        self.items.push(Pic16Item::Call(label));
        self.w = None;
        self.banks = exit.unwrap_or(self.banks);
    }

    /// The page may change here.
    pub fn allow_page_change(&mut self) {
        self.items.push(Pic16Item::PageBoundary);
    }

    /// A mark.
    pub fn mark(&mut self, mark: CodeMark) {
        self.items.push(Pic16Item::Mark(mark));
    }

    /// From here on anything may be selected that `banks` says, and W holds anything: code that others jump to.
    pub fn assume_banks(&mut self, banks: BankSet) {
        self.banks = banks;
        self.w = None;
    }

    fn after_skip(&self) -> bool {
        matches!(self.items.last(), Some(Pic16Item::Op(kind, ..)) if arch::is_skip(*kind))
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
        self.items.push(Pic16Item::Op(kind, operands.iter().map(|&o| i32::from(o)).collect(), extra));
    }

    /// Makes sure that one of `allowed` is selected.
    pub fn select_bank(&mut self, allowed: BankSet) {
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
    pub fn common_banks(&self, addrs: &[u16]) -> BankSet {
        addrs.iter().fold(ANY_BANK, |set, &addr| set & self.chip.reachable_banks(addr))
    }

    /// An instruction on a byte of data memory.
    pub fn byte_op(&mut self, kind: Kind, addr: u16) {
        self.select_bank(self.chip.reachable_banks(addr));
        self.push(kind, &[addr & 0x7F], 0);
    }

    /// An instruction on a bit of data memory.
    pub fn bit_op(&mut self, kind: Kind, (addr, bit): (u16, u8)) {
        self.select_bank(self.chip.reachable_banks(addr));
        self.push(kind, &[addr & 0x7F, bit.into()], 0);
    }

    /// Sets or clears a bit.
    pub fn set_bit(&mut self, at: (u16, u8), value: bool) {
        self.bit_op(if value { Kind::Bsf } else { Kind::Bcf }, at);
    }

    /// The next instruction is left out unless the bit has the value.
    pub fn skip_unless(&mut self, at: (u16, u8), value: bool) {
        self.bit_op(if value { Kind::Btfsc } else { Kind::Btfss }, at);
    }

    /// An instruction with a constant.
    pub fn literal_op(&mut self, kind: Kind, k: u8) {
        self.push(kind, &[k.into()], 0);
    }

    /// An instruction without an operand.
    pub fn implied_op(&mut self, kind: Kind) {
        self.push(kind, &[], 0);
    }

    /// MOVWF PCL: takes a cycle more than other instructions on a byte.
    pub fn computed_goto(&mut self, pcl: u16) {
        self.push(Kind::Movwf, &[pcl], 1);
    }

    /// MOVLW or ADDLW of a byte of a label's address.
    pub fn label_byte(&mut self, kind: Kind, label: Pic16Label, byte: u8) {
        self.items.push(Pic16Item::LabelByte(kind, label, byte));
        self.w = None;
    }

    /// W := k, where it does not hold it already.
    pub fn load_w(&mut self, k: u8) {
        if self.w != Some(k) {
            self.literal_op(Kind::Movlw, k);
        }
    }

    /// Byte at `addr` := k.
    pub fn set_byte(&mut self, addr: u16, k: u8) {
        if k == 0 {
            self.byte_op(Kind::Clrf, addr);
        } else {
            self.select_bank(self.chip.reachable_banks(addr));
            self.load_w(k);
            self.byte_op(Kind::Movwf, addr);
        }
    }
}

/// Where the items come to lie. Code of more than a page changes pages at cuts, so no piece between two cuts crosses a
/// border.
struct PageLayout {
    /// The form of every item that goes elsewhere; 0 for the others.
    levels: Vec<u8>,
    /// Items before which the page changes, with the words before and behind the change.
    changes: Vec<(usize, u32, u32)>,
    /// Length of the code in words.
    length: u32,
}

impl PageLayout {
    /// Lays out the items. Of a label that stands before, the form follows from its page; of one that follows, a form is
    /// assumed, which only rises from pass to pass, at most twice.
    ///
    /// # Errors
    /// A piece between two cuts is longer than a page.
    fn lay_out(items: &[Pic16Item]) -> Result<PageLayout, CodegenError> {
        let mut assumed = vec![0; items.len()];
        loop {
            let (pages, needed) = PageLayout::layout_pass(items, &assumed)?;
            if needed.iter().zip(&assumed).all(|(needed, assumed)| needed <= assumed) {
                return Ok(pages);
            }
            assumed.iter_mut().zip(needed).for_each(|(assumed, needed)| *assumed = needed.max(*assumed));
        }
    }

    /// One pass, and the level that each item needs in it where its label follows.
    fn layout_pass(items: &[Pic16Item], assumed: &[u8]) -> Result<(PageLayout, Vec<u8>), CodegenError> {
        let small = items.iter().map(Pic16Item::words).sum::<u32>() <= PAGE;
        let mut places: BTreeMap<Pic16Label, u32> = BTreeMap::new();
        let mut pages = PageLayout { levels: Vec::new(), changes: Vec::new(), length: 0 };
        let mut starts = Vec::new();
        for piece in items.split_inclusive(|item| *item == Pic16Item::PageBoundary) {
            let first = starts.len();
            let levels = |places: &BTreeMap<Pic16Label, u32>, at: u32| -> Vec<u8> {
                let level = |(item, assumed): (&Pic16Item, &u8)| match item.target_label() {
                    Some(label) => places.get(&label).map_or(*assumed, |&to| arch::shortest_level(at, to)),
                    None => 0,
                };
                piece.iter().zip(assumed.iter().skip(first)).map(level).collect()
            };
            let words =
                |levels: &[u8]| piece.iter().zip(levels).map(|(item, &level)| item.words_at(level)).sum::<u32>();
            let mut here = levels(&places, pages.length);
            let next = (pages.length / PAGE + 1) * PAGE;
            if !small && pages.length + words(&here) + MAX_PAGE_CHANGE_WORDS > next {
                here = levels(&places, next);
                if words(&here) + MAX_PAGE_CHANGE_WORDS > PAGE {
                    return Err(CodegenError::ElementExceedsPage);
                }
                pages.changes.push((first, pages.length, next));
                pages.length = next;
            }
            for (item, &level) in piece.iter().zip(&here) {
                starts.push(pages.length);
                if let Pic16Item::Place(label) = item {
                    places.insert(*label, pages.length);
                }
                pages.length += item.words_at(level);
            }
            pages.levels.append(&mut here);
        }
        let needed = items.iter().zip(&starts).map(|(item, &at)| {
            item.target_label().and_then(|label| places.get(&label)).map_or(0, |&to| arch::shortest_level(at, to))
        });
        let needed =
            needed.zip(&pages.levels).map(|(needed, &level)| if needed > level { needed } else { 0 }).collect();
        Ok((pages, needed))
    }
}

/// Hands the code to the assembler, with the form of every jump; returns its length in words.
///
/// The assembler must not choose forms by itself: a form that grows moves code over the border of a page.
///
/// # Errors
/// A piece between two cuts is longer than a page.
pub fn assemble(items: &[Pic16Item], labels: u32, asm: &mut CodeWriter<Pic16Arch>) -> Result<u32, CodegenError> {
    let names: Vec<CodeLabel> = (0..labels).map(|_| asm.new_label()).collect();
    let name = |lab: &Pic16Label| names.get(lab.0 as usize).copied().ok_or(CodegenError::UnplacedLabel);
    let pages = PageLayout::lay_out(items)?;
    let mut changes = pages.changes.iter().peekable();
    for (n, (item, &level)) in items.iter().zip(&pages.levels).enumerate() {
        if let Some(&(_, from, to)) = changes.next_if(|(first, ..)| *first == n) {
            let (there, level) = (asm.new_label(), arch::shortest_level(from, to));
            asm.jump_at_least(Pic16Jump::Goto, there, 1, level);
            asm.data(&vec![0x3FFF; (to - from).saturating_sub(arch::form_words(Pic16Jump::Goto, level)) as usize]);
            asm.place_label(there);
        }
        match item {
            Pic16Item::Op(kind, operands, 0) => asm.op(*kind, operands),
            Pic16Item::Op(kind, operands, extra) => asm.op_with_extra_cycles(*kind, operands, *extra),
            Pic16Item::LabelByte(kind, lab, byte) => asm.op_with_label_byte(*kind, &[0], 0, name(lab)?, *byte, 0),
            Pic16Item::Goto(lab) => asm.jump_at_least(Pic16Jump::Goto, name(lab)?, 1, level),
            Pic16Item::GotoBack(lab, times) => asm.jump_at_least(Pic16Jump::Goto, name(lab)?, *times, level),
            Pic16Item::Call(lab) => asm.jump_at_least(Pic16Jump::Call, name(lab)?, 1, level),
            Pic16Item::Place(lab) => asm.place_label(name(lab)?),
            Pic16Item::Mark(mark) => asm.mark(*mark),
            Pic16Item::PageBoundary => {}
        }
    }
    Ok(pages.length)
}

impl Pic16Writer<'_> {
    /// Number of labels made so far.
    #[must_use]
    pub fn labels(&self) -> u32 {
        self.labels
    }
}
