//! PIC16 as a target of the code writer ([`crate::code`]): one word per instruction; GOTO and CALL reach
//! within a page.
//!
//! A page has 2,048 words; PCLATH selects other pages. PCLATH<4:3> is always the page of the running code,
//! except between a change of page and its jump.

use emu_pic16::isa::{self, Pic16OpKind, ROWS};

use crate::CodegenError;
use crate::code::{ControlFlow, CycleCounts, FormInstruction, TargetArch};

/// Words per page.
pub const PAGE: u32 = 0x800;

/// Address of PCLATH, in every bank; below, its bits that select the page.
const PCLATH: i32 = 0x0A;
const PAGE_BITS: [i32; 2] = [3, 4];

/// The PIC16 family.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pic16Arch;

/// A control transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pic16Jump {
    /// GOTO.
    Goto,
    /// CALL; PCLATH is restored after it.
    Call,
}

/// PCLATH bits with their values in page `to`: those that differ from page `from`, or those that are equal.
fn page_bits(from: u32, to: u32, differ: bool) -> impl Iterator<Item = (i32, bool)> {
    let (from, to) = (from / PAGE, to / PAGE);
    (0..2).filter(move |n| ((from ^ to) >> n & 1 == 1) == differ).map(move |n| (PAGE_BITS[n], to >> n & 1 == 1))
}

/// PCLATH bits in which two pages differ, with their values in `to`.
fn differing_page_bits(from: u32, to: u32) -> impl Iterator<Item = (i32, bool)> {
    page_bits(from, to, true)
}

/// Exactly `level` PCLATH bits with their values in `to`: first those that differ, then others, which do not
/// change.
fn written_page_bits(from: u32, to: u32, level: u8) -> impl Iterator<Item = (i32, bool)> {
    differing_page_bits(from, to).chain(page_bits(from, to, false)).take(level.into())
}

fn page_bit_instruction((bit, value): (i32, bool)) -> (Pic16OpKind, Vec<i32>) {
    (if value { Pic16OpKind::Bsf } else { Pic16OpKind::Bcf }, vec![PCLATH, bit])
}

/// Level of the shortest form between two addresses: the number of PCLATH bits that change.
#[must_use]
pub fn shortest_level(from: u32, to: u32) -> u8 {
    differing_page_bits(from, to).count() as u8
}

/// Length of a form in words: changes of PCLATH and the jump; after a call, the changes are undone.
#[must_use]
pub fn form_words(jump: Pic16Jump, level: u8) -> u32 {
    1 + u32::from(level) * if jump == Pic16Jump::Call { 2 } else { 1 }
}

impl TargetArch for Pic16Arch {
    type Opcode = Pic16OpKind;
    type JumpForm = Pic16Jump;

    fn instruction_words(&self, _: Pic16OpKind) -> u32 {
        1
    }

    fn encode(&self, kind: Pic16OpKind, operands: &[i32], _at: u32) -> Result<Vec<u16>, CodegenError> {
        Ok(vec![isa::encode(kind, operands)?])
    }

    fn jump_form(&self, jump: Pic16Jump, level: u8, at: u32, to: u32) -> Option<Vec<FormInstruction<Pic16OpKind>>> {
        if self::shortest_level(at, to) > level {
            return None;
        }
        let set = |change| {
            let (kind, operands) = page_bit_instruction(change);
            FormInstruction { kind, operands, target: None }
        };
        let kind = if jump == Pic16Jump::Goto { Pic16OpKind::Goto } else { Pic16OpKind::Call };
        let mut steps: Vec<_> = written_page_bits(at, to, level).map(set).collect();
        steps.push(FormInstruction { kind, operands: vec![(to % PAGE) as i32], target: Some(to) });
        if jump == Pic16Jump::Call {
            steps.extend(written_page_bits(to, at, level).map(set));
        }
        Some(steps)
    }

    fn flow_and_cycles(&self, kind: Pic16OpKind) -> (ControlFlow, CycleCounts) {
        let flow = match kind {
            Pic16OpKind::Goto => ControlFlow::Jump,
            Pic16OpKind::Call => ControlFlow::Call,
            Pic16OpKind::Return | Pic16OpKind::Retlw | Pic16OpKind::Retfie => ControlFlow::Return,
            _ if is_skip(kind) => ControlFlow::Skip,
            _ => ControlFlow::Sequential,
        };
        let outcomes = ROWS.get(kind as usize).map(|row| row.cycles.possible_counts()).unwrap_or_default();
        let first = outcomes.first().copied().map_or(1, u32::from);
        let last = outcomes.last().copied().map_or(first, u32::from);
        (flow, [first, last, last])
    }

    fn disassemble(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at).text
    }
}

/// True for instructions that may skip the next one.
#[must_use]
pub fn is_skip(kind: Pic16OpKind) -> bool {
    use Pic16OpKind::{Btfsc, Btfss, DecfszF, DecfszW, IncfszF, IncfszW};
    matches!(kind, Btfsc | Btfss | DecfszF | DecfszW | IncfszF | IncfszW)
}
