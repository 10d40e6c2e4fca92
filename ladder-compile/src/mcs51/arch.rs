//! What the assembler must know of the family: encoding, flow, and the forms of jumps by their reach.

use emu_8051::isa::{self, Kind, ROWS};

use crate::code::{Arch, Cycles, Flow, Step};

/// The family for [`crate::code::Asm`]. Program words are bytes.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51;

/// What refers to a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Jump {
    /// A jump: SJMP, AJMP or LJMP.
    Go,
    /// A call: ACALL or LCALL.
    Call,
    /// A conditional jump, with as many operands in front of its target.
    When(Kind, [i32; 2], usize),
    /// No jump: DPTR := the label's address.
    Point,
}

impl Jump {
    /// A conditional jump with at most two operands in front of its target.
    #[must_use]
    pub fn when(kind: Kind, operands: &[i32]) -> Jump {
        let at = |n: usize| operands.get(n).copied().unwrap_or(0);
        Jump::When(kind, [at(0), at(1)], operands.len().min(2))
    }
}

/// The conditional jump on the opposite condition, where there is one.
fn opposite(kind: Kind) -> Option<Kind> {
    const PAIRS: [(Kind, Kind); 3] = [(Kind::Jc, Kind::Jnc), (Kind::Jb, Kind::Jnb), (Kind::Jz, Kind::Jnz)];
    PAIRS.iter().find_map(|&(a, b)| if a == kind { Some(b) } else { (b == kind).then_some(a) })
}

/// An instruction with a target. Programs beyond 64 KB are refused when they are finished, so until then addresses wrap.
fn to(kind: Kind, operands: &[i32], target: u32) -> Step<Kind> {
    let operands = operands.iter().copied().chain([(target & 0xFFFF) as i32]).collect();
    Step { kind, operands, target: Some(target) }
}

/// The jump at `at`, relative, in the page, or anywhere; nothing where it does not reach.
fn go(level: u8, at: u32, target: u32) -> Option<Step<Kind>> {
    let next = at + 2;
    match level {
        0 => near(next, target).then(|| to(Kind::Sjmp, &[], target)),
        1 => (next >> 11 == target >> 11).then(|| to(Kind::Ajmp, &[], target)),
        _ => Some(to(Kind::Ljmp, &[], target)),
    }
}

fn near(next: u32, target: u32) -> bool {
    (-128..128).contains(&(i64::from(target) - i64::from(next)))
}

impl Arch for Mcs51 {
    type Kind = Kind;
    type Jump = Jump;

    fn len(&self, kind: Kind) -> u32 {
        ROWS.get(kind as usize).map_or(1, |row| row.len())
    }

    fn encode(&self, kind: Kind, operands: &[i32], at: u32) -> Result<Vec<u16>, String> {
        let bytes = isa::encode(kind, operands, at & 0xFFFF).map_err(|error| error.to_string())?;
        Ok(bytes.into_iter().map(u16::from).collect())
    }

    fn form(&self, jump: Jump, level: u8, at: u32, target: u32) -> Option<Vec<Step<Kind>>> {
        match (jump, level) {
            (Jump::Go, level) => go(level, at, target).map(|step| vec![step]),
            (Jump::Call, 0) => ((at + 2) >> 11 == target >> 11).then(|| vec![to(Kind::Acall, &[], target)]),
            (Jump::Call, _) => Some(vec![to(Kind::Lcall, &[], target)]),
            (Jump::Point, _) => {
                Some(vec![Step { kind: Kind::MovDptr, operands: vec![(target & 0xFFFF) as i32], target: None }])
            }
            (Jump::When(kind, operands, count), level) => {
                let operands = operands.get(..count).unwrap_or(&operands);
                let len = self.len(kind);
                if level == 0 {
                    return near(at + len, target).then(|| vec![to(kind, operands, target)]);
                }
                if let Some(opposite) = opposite(kind) {
                    let far = go(level, at + len, target)?;
                    let over = at + len + self.len(far.kind);
                    return Some(vec![to(opposite, operands, over), far]);
                }
                // No opposite: the jump goes to a jump, and what follows it jumps over that.
                let far = go(level, at + len + 2, target)?;
                let over = at + len + 2 + self.len(far.kind);
                Some(vec![to(kind, operands, at + len + 2), to(Kind::Sjmp, &[], over), far])
            }
        }
    }

    fn flow(&self, kind: Kind) -> (Flow, Cycles) {
        use Kind::{
            Acall, Ajmp, CjneDir, CjneImm, CjneInd, CjneReg, DjnzDir, DjnzReg, Jb, Jbc, Jc, Jnb, Jnc, Jnz, Jz, Lcall,
            Ljmp, Ret, Sjmp,
        };
        let flow = match kind {
            Sjmp | Ajmp | Ljmp => Flow::Jump,
            Acall | Lcall => Flow::Call,
            Ret => Flow::Return,
            Jc | Jnc | Jb | Jnb | Jbc | Jz | Jnz | CjneDir | CjneImm | CjneReg | CjneInd | DjnzReg | DjnzDir => {
                Flow::Branch
            }
            _ => Flow::Next,
        };
        let outcomes = ROWS.get(kind as usize).map_or(&[][..], |row| row.cycles.outcomes());
        let cycles = outcomes.first().map_or(1, |&n| n.into());
        (flow, [cycles; 3])
    }

    fn text(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at & 0xFFFF).text
    }
}
