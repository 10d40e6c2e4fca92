//! Writer of PIC16 code that tracks which banks may be selected and what W holds.
//!
//! Every access to a byte first ensures that its bank is selected, and emits no instruction if it is known to
//! be. All jumps go forward, except those of loops, which do not change the bank, and those of the program,
//! whose labels any bank may reach. So the state known at another label is what all jumps to it and the
//! preceding code agree on.

use std::collections::BTreeMap;

use emu_pic16::isa::Pic16OpKind;

use super::arch::{self, PAGE, Pic16Arch, Pic16Jump};
use super::chip_data::{ANY_BANK, BankSet, Pic16ChipData};
use crate::CodegenError;
use crate::code::{CodeLabel, CodeWriter};
use crate::jump_roles::JumpRole;
use crate::target::CodeMark;

/// Address of STATUS, in every bank.
pub const STATUS: u16 = 3;
/// Bit number of the carry flag; clear means borrow.
pub const C: u8 = 0;
/// Bit number of the zero flag.
pub const Z: u8 = 2;
const RP0: u8 = 5;
const RP1: u8 = 6;

/// A position in the code, to be placed later.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pic16Label(u32);

/// An item of the code being written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pic16Item {
    /// An instruction, and extra cycles beyond those of its row.
    Op(Pic16OpKind, Vec<i32>, u32),
    /// MOVLW or ADDLW with a byte of a label's address.
    LabelByte(Pic16OpKind, Pic16Label, u8),
    /// GOTO, forward.
    Goto(Pic16Label),
    /// GOTO backward, and the maximum number of times in a row that it is taken.
    GotoBack(Pic16Label, u32),
    /// GOTO of the program, in any direction.
    ProgramJump(Pic16Label, JumpRole<Pic16Label>),
    /// CALL.
    Call(Pic16Label),
    /// A label.
    Place(Pic16Label),
    /// A mark.
    Mark(CodeMark),
    /// A possible change of page: no jump crosses it, only calls do.
    PageBoundary,
}

/// Maximum number of words of a page change: both bits of PCLATH and GOTO.
const MAX_PAGE_CHANGE_WORDS: u32 = 3;

impl Pic16Item {
    /// Number of words if no page changes.
    fn words(&self) -> u32 {
        self.words_at(0)
    }

    /// Number of words, if a jump or call has the form `level`.
    fn words_at(&self, level: u8) -> u32 {
        match self {
            Pic16Item::Place(_) | Pic16Item::Mark(_) | Pic16Item::PageBoundary => 0,
            Pic16Item::Op(..) | Pic16Item::LabelByte(..) => 1,
            Pic16Item::Goto(_) | Pic16Item::GotoBack(..) | Pic16Item::ProgramJump(..) => {
                arch::form_words(Pic16Jump::Goto, level)
            }
            Pic16Item::Call(_) => arch::form_words(Pic16Jump::Call, level),
        }
    }

    /// Label of a jump or call.
    fn target_label(&self) -> Option<Pic16Label> {
        match self {
            Pic16Item::Goto(label)
            | Pic16Item::GotoBack(label, _)
            | Pic16Item::ProgramJump(label, _)
            | Pic16Item::Call(label) => Some(*label),
            _ => None,
        }
    }
}

/// State of the writer to which a trial can be rolled back.
#[derive(Debug, Clone)]
pub struct WriterCheckpoint {
    items: usize,
    banks: BankSet,
    open: BTreeMap<Pic16Label, BankSet>,
    w: Option<u8>,
}

/// Code under construction, with the known bank and W.
#[derive(Debug)]
pub struct Pic16Writer<'a> {
    /// Data of the chip.
    pub chip: &'a Pic16ChipData,
    /// Items written so far.
    pub items: Vec<Pic16Item>,
    labels: u32,
    /// Banks that may be selected at the current position.
    pub banks: BankSet,
    /// Banks that may be selected at the jumps to each label that is not placed yet.
    open: BTreeMap<Pic16Label, BankSet>,
    /// Content of W, if known.
    w: Option<u8>,
}

impl<'a> Pic16Writer<'a> {
    /// Creates an empty writer; bank 0 is selected, as after reset.
    #[must_use]
    pub fn new(chip: &'a Pic16ChipData) -> Self {
        Pic16Writer { chip, items: Vec::new(), labels: 0, banks: 1, open: BTreeMap::new(), w: None }
    }

    /// Saves the current state for [`Pic16Writer::roll_back`].
    #[must_use]
    pub fn checkpoint(&self) -> WriterCheckpoint {
        WriterCheckpoint { items: self.items.len(), banks: self.banks, open: self.open.clone(), w: self.w }
    }

    /// Restores a saved state and returns the items written since.
    pub fn roll_back(&mut self, save: &WriterCheckpoint) -> Vec<Pic16Item> {
        self.banks = save.banks;
        self.open.clone_from(&save.open);
        self.w = save.w;
        self.items.split_off(save.items.min(self.items.len()))
    }

    /// Number of words written since a saved state.
    #[must_use]
    pub fn words_since(&self, save: &WriterCheckpoint) -> u32 {
        self.items.iter().skip(save.items).map(Pic16Item::words).sum()
    }

    /// Creates a label.
    pub fn label(&mut self) -> Pic16Label {
        self.labels += 1;
        Pic16Label(self.labels - 1)
    }

    /// Places a label at the current position.
    pub fn place(&mut self, label: Pic16Label) {
        if let Some(banks) = self.open.remove(&label) {
            self.banks |= banks;
        }
        self.w = None;
        self.items.push(Pic16Item::Place(label));
    }

    /// Emits a forward GOTO.
    pub fn goto(&mut self, label: Pic16Label) {
        *self.open.entry(label).or_insert(0) |= self.banks;
        let conditional = self.after_skip();
        self.items.push(Pic16Item::Goto(label));
        if !conditional {
            // The following code is reached only by jumps.
            self.banks = 0;
        }
    }

    /// Emits a backward GOTO that is taken at most `times` times in a row.
    pub fn goto_back(&mut self, label: Pic16Label, times: u32) {
        self.items.push(Pic16Item::GotoBack(label, times));
    }

    /// Emits a GOTO to a label that any bank may reach, in any direction.
    pub fn program_jump(&mut self, label: Pic16Label, role: JumpRole<Pic16Label>) {
        self.items.push(Pic16Item::ProgramJump(label, role));
        // The following code is reached only by jumps.
        self.banks = 0;
    }

    /// Emits a call of a subroutine that requires one of the banks `entry` and returns with `exit`, or with
    /// the bank unchanged.
    pub fn call(&mut self, label: Pic16Label, entry: BankSet, exit: Option<BankSet>) {
        self.select_bank(entry);
        self.items.push(Pic16Item::Call(label));
        self.w = None;
        self.banks = exit.unwrap_or(self.banks);
    }

    /// Allows a change of page at the current position.
    pub fn allow_page_change(&mut self) {
        self.items.push(Pic16Item::PageBoundary);
    }

    /// Places a mark at the current position.
    pub fn mark(&mut self, mark: CodeMark) {
        self.items.push(Pic16Item::Mark(mark));
    }

    /// Starts code that is reached by jumps from elsewhere: any of `banks` may be selected, and W is unknown.
    pub fn assume_banks(&mut self, banks: BankSet) {
        self.banks = banks;
        self.w = None;
    }

    fn after_skip(&self) -> bool {
        matches!(self.items.last(), Some(Pic16Item::Op(kind, ..)) if arch::is_skip(*kind))
    }

    fn push(&mut self, kind: Pic16OpKind, operands: &[u16], extra: u32) {
        use Pic16OpKind::{Bcf, Bsf, Btfsc, Btfss, Clrf, DecfszF, IncfszF, Movlw, Movwf};
        let conditional = self.after_skip();
        match kind {
            Movlw if !conditional => self.w = operands.first().map(|&k| k as u8),
            Bcf | Bsf | Btfsc | Btfss | Clrf | DecfszF | IncfszF | Movwf => {}
            Pic16OpKind::IncfF
            | Pic16OpKind::DecfF
            | Pic16OpKind::AddwfF
            | Pic16OpKind::SubwfF
            | Pic16OpKind::XorwfF
            | Pic16OpKind::IorwfF
            | Pic16OpKind::AndwfF => {}
            Pic16OpKind::RlfF | Pic16OpKind::RrfF | Pic16OpKind::ComfF | Pic16OpKind::MovfF | Pic16OpKind::Nop => {}
            _ => self.w = None,
        }
        self.items.push(Pic16Item::Op(kind, operands.iter().map(|&o| i32::from(o)).collect(), extra));
    }

    /// Ensures that one of the banks in `allowed` is selected.
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
                self.push(if value { Pic16OpKind::Bsf } else { Pic16OpKind::Bcf }, &[STATUS, bit.into()], 0);
            }
            self.banks = banks;
        }
    }

    /// Banks from which all these bytes can be accessed.
    #[must_use]
    pub fn common_banks(&self, addrs: &[u16]) -> BankSet {
        addrs.iter().fold(ANY_BANK, |set, &addr| set & self.chip.reachable_banks(addr))
    }

    /// Emits an instruction on a byte of data memory.
    pub fn byte_op(&mut self, kind: Pic16OpKind, addr: u16) {
        self.select_bank(self.chip.reachable_banks(addr));
        self.push(kind, &[addr & 0x7F], 0);
    }

    /// Emits an instruction on a bit of data memory.
    pub fn bit_op(&mut self, kind: Pic16OpKind, (addr, bit): (u16, u8)) {
        self.select_bank(self.chip.reachable_banks(addr));
        self.push(kind, &[addr & 0x7F, bit.into()], 0);
    }

    /// Emits an instruction that sets or clears a bit.
    pub fn set_bit(&mut self, at: (u16, u8), value: bool) {
        self.bit_op(if value { Pic16OpKind::Bsf } else { Pic16OpKind::Bcf }, at);
    }

    /// Emits a skip: the next instruction is executed only if the bit has the value.
    pub fn skip_unless(&mut self, at: (u16, u8), value: bool) {
        self.bit_op(if value { Pic16OpKind::Btfsc } else { Pic16OpKind::Btfss }, at);
    }

    /// Emits an instruction with a constant operand.
    pub fn literal_op(&mut self, kind: Pic16OpKind, k: u8) {
        self.push(kind, &[k.into()], 0);
    }

    /// Emits an instruction without an operand.
    pub fn implied_op(&mut self, kind: Pic16OpKind) {
        self.push(kind, &[], 0);
    }

    /// Emits MOVWF PCL, which takes one cycle more than other byte instructions.
    pub fn computed_goto(&mut self, pcl: u16) {
        self.push(Pic16OpKind::Movwf, &[pcl], 1);
    }

    /// Emits MOVLW or ADDLW with a byte of a label's address.
    pub fn label_byte(&mut self, kind: Pic16OpKind, label: Pic16Label, byte: u8) {
        self.items.push(Pic16Item::LabelByte(kind, label, byte));
        self.w = None;
    }

    /// Emits W := k, unless W already holds it.
    pub fn load_w(&mut self, k: u8) {
        if self.w != Some(k) {
            self.literal_op(Pic16OpKind::Movlw, k);
        }
    }

    /// Emits the byte at `addr` := k.
    pub fn set_byte(&mut self, addr: u16, k: u8) {
        if k == 0 {
            self.byte_op(Pic16OpKind::Clrf, addr);
        } else {
            self.select_bank(self.chip.reachable_banks(addr));
            self.load_w(k);
            self.byte_op(Pic16OpKind::Movwf, addr);
        }
    }
}

/// Page layout of the items. Code of more than one page changes pages only at page boundaries, so no piece
/// between two boundaries crosses a page.
struct PageLayout {
    /// Form level of each jump or call; 0 for other items.
    levels: Vec<u8>,
    /// Items before which the page changes, with the word addresses before and after the change.
    changes: Vec<(usize, u32, u32)>,
    /// Length of the code in words.
    length: u32,
}

impl PageLayout {
    /// Lays out the items.
    ///
    /// The form for an earlier label follows from its page. For a later label a form is assumed, which only
    /// rises from pass to pass, at most twice.
    ///
    /// # Errors
    /// A piece between two page boundaries is longer than a page.
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

    /// Runs one pass, and returns the level that each item with a later label needs in it.
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

/// Passes the code to the code writer with a fixed form of every jump; returns its length in words.
///
/// The code writer must not choose the forms itself, because a form that grows would move code across a page.
///
/// # Errors
/// A piece between two page boundaries is longer than a page.
pub fn assemble(items: &[Pic16Item], labels: u32, asm: &mut CodeWriter<Pic16Arch>) -> Result<u32, CodegenError> {
    let names: Vec<CodeLabel> = (0..labels).map(|_| asm.new_label()).collect();
    let name = |lab: &Pic16Label| names.get(lab.0 as usize).copied().ok_or(CodegenError::UnplacedLabel);
    let pages = PageLayout::lay_out(items)?;
    let mut changes = pages.changes.iter().peekable();
    for (n, (item, &level)) in items.iter().zip(&pages.levels).enumerate() {
        if let Some(&(_, from, to)) = changes.next_if(|(first, ..)| *first == n) {
            let (target, level) = (asm.new_label(), arch::shortest_level(from, to));
            asm.jump_with_role(Pic16Jump::Goto, target, JumpRole::Repeats(1), level);
            asm.data(&vec![0x3FFF; (to - from).saturating_sub(arch::form_words(Pic16Jump::Goto, level)) as usize]);
            asm.place_label(target);
        }
        match item {
            Pic16Item::Op(kind, operands, 0) => asm.op(*kind, operands),
            Pic16Item::Op(kind, operands, extra) => asm.op_with_extra_cycles(*kind, operands, *extra),
            Pic16Item::LabelByte(kind, lab, byte) => asm.op_with_label_byte(*kind, &[0], 0, name(lab)?, *byte, 0),
            Pic16Item::Goto(lab) => asm.jump_with_role(Pic16Jump::Goto, name(lab)?, JumpRole::Repeats(1), level),
            Pic16Item::GotoBack(lab, times) => {
                asm.jump_with_role(Pic16Jump::Goto, name(lab)?, JumpRole::Repeats(*times), level)
            }
            Pic16Item::ProgramJump(lab, role) => {
                let to = name(lab)?;
                let role = role.map(|lab| name(&lab).unwrap_or(to));
                asm.jump_with_role(Pic16Jump::Goto, to, role, level);
            }
            Pic16Item::Call(lab) => asm.jump_with_role(Pic16Jump::Call, name(lab)?, JumpRole::Repeats(1), level),
            Pic16Item::Place(lab) => asm.place_label(name(lab)?),
            Pic16Item::Mark(mark) => asm.mark(*mark),
            Pic16Item::PageBoundary => {}
        }
    }
    Ok(pages.length)
}

impl Pic16Writer<'_> {
    /// Number of labels created so far.
    #[must_use]
    pub fn labels(&self) -> u32 {
        self.labels
    }
}
