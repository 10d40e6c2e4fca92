//! PIC16 code for [`crate::code`]: one word an instruction; GOTO and CALL reach their page of 2,048 words, and PCLATH the
//! other pages.
//!
//! PCLATH<4:3> holds the page of the running code everywhere but between a change of page and its jump.

use emu_pic16::isa::{self, Kind, ROWS};

use crate::code::{Arch, Cycles, Flow, Step};

/// Words of a page.
pub const PAGE: u32 = 0x800;

/// Address of PCLATH, in every bank, and its bits that name the page.
const PCLATH: i32 = 0x0A;
const PAGE_BITS: [i32; 2] = [3, 4];

/// The family.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pic;

/// Transfers of control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jump {
    /// GOTO.
    Goto,
    /// CALL; PCLATH is set back behind it.
    Call,
}

/// The bits of PCLATH that name the page `to`, those in which `from` is another or those in which it is the same.
fn page_bits(from: u32, to: u32, differ: bool) -> impl Iterator<Item = (i32, bool)> {
    let (from, to) = (from / PAGE, to / PAGE);
    (0..2).filter(move |n| ((from ^ to) >> n & 1 == 1) == differ).map(move |n| (PAGE_BITS[n], to >> n & 1 == 1))
}

/// The bits of PCLATH in which two pages differ, with their value in `to`.
fn differing(from: u32, to: u32) -> impl Iterator<Item = (i32, bool)> {
    page_bits(from, to, true)
}

/// Exactly `level` bits of PCLATH with their value in `to`: those that differ, then others, which stay what they are.
fn written(from: u32, to: u32, level: u8) -> impl Iterator<Item = (i32, bool)> {
    differing(from, to).chain(page_bits(from, to, false)).take(level.into())
}

fn change_of((bit, value): (i32, bool)) -> (Kind, Vec<i32>) {
    (if value { Kind::Bsf } else { Kind::Bcf }, vec![PCLATH, bit])
}

/// The level of the shortest form from a page to a page: the number of bits of PCLATH that change.
#[must_use]
pub fn level(from: u32, to: u32) -> u8 {
    differing(from, to).count() as u8
}

/// Words of a form: the changes of PCLATH and the jump; behind a call they are taken back.
#[must_use]
pub fn words(jump: Jump, level: u8) -> u32 {
    1 + u32::from(level) * if jump == Jump::Call { 2 } else { 1 }
}

impl Arch for Pic {
    type Kind = Kind;
    type Jump = Jump;

    fn len(&self, _: Kind) -> u32 {
        1
    }

    fn encode(&self, kind: Kind, operands: &[i32], _at: u32) -> Result<Vec<u16>, String> {
        isa::encode(kind, operands).map(|word| vec![word]).map_err(|error| error.to_string())
    }

    fn form(&self, jump: Jump, level: u8, at: u32, to: u32) -> Option<Vec<Step<Kind>>> {
        if self::level(at, to) > level {
            return None;
        }
        let set = |change| {
            let (kind, operands) = change_of(change);
            Step { kind, operands, target: None }
        };
        let kind = if jump == Jump::Goto { Kind::Goto } else { Kind::Call };
        let mut steps: Vec<_> = written(at, to, level).map(set).collect();
        steps.push(Step { kind, operands: vec![(to % PAGE) as i32], target: Some(to) });
        if jump == Jump::Call {
            steps.extend(written(to, at, level).map(set));
        }
        Some(steps)
    }

    fn flow(&self, kind: Kind) -> (Flow, Cycles) {
        let flow = match kind {
            Kind::Goto => Flow::Jump,
            Kind::Call => Flow::Call,
            Kind::Return | Kind::Retlw | Kind::Retfie => Flow::Return,
            _ if is_skip(kind) => Flow::Skip,
            _ => Flow::Next,
        };
        let outcomes = ROWS.get(kind as usize).map(|row| row.cycles.outcomes()).unwrap_or_default();
        let first = outcomes.first().copied().map_or(1, u32::from);
        let last = outcomes.last().copied().map_or(first, u32::from);
        (flow, [first, last, last])
    }

    fn text(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at).text
    }
}

/// Instructions that may leave out the next one.
#[must_use]
pub fn is_skip(kind: Kind) -> bool {
    use Kind::{Btfsc, Btfss, DecfszF, DecfszW, IncfszF, IncfszW};
    matches!(kind, Btfsc | Btfss | DecfszF | DecfszW | IncfszF | IncfszW)
}
