//! The 8051 as a target of the code writer: encoding, control flow, and forms of jumps by reach.

use emu_8051::isa::{self, Mcs51OpKind, ROWS};

use crate::CodegenError;
use crate::code::{ControlFlow, CycleCounts, FormInstruction, TargetArch};

/// The family for [`crate::code::CodeWriter`]. Program words are bytes.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51Arch;

/// A reference to a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mcs51Jump {
    /// An unconditional jump: SJMP, AJMP or LJMP.
    Unconditional,
    /// A call: ACALL or LCALL.
    Call,
    /// A conditional jump, with its operands before the target and their number.
    Conditional(Mcs51OpKind, [i32; 2], usize),
    /// Not a jump: DPTR := the address of the label.
    LoadAddress,
}

impl Mcs51Jump {
    /// Creates a conditional jump with at most two operands before its target.
    #[must_use]
    pub fn conditional(kind: Mcs51OpKind, operands: &[i32]) -> Mcs51Jump {
        let at = |n: usize| operands.get(n).copied().unwrap_or(0);
        Mcs51Jump::Conditional(kind, [at(0), at(1)], operands.len().min(2))
    }
}

/// The conditional jump on the opposite condition, if there is one.
fn opposite(kind: Mcs51OpKind) -> Option<Mcs51OpKind> {
    const PAIRS: [(Mcs51OpKind, Mcs51OpKind); 3] =
        [(Mcs51OpKind::Jc, Mcs51OpKind::Jnc), (Mcs51OpKind::Jb, Mcs51OpKind::Jnb), (Mcs51OpKind::Jz, Mcs51OpKind::Jnz)];
    PAIRS.iter().find_map(|&(a, b)| if a == kind { Some(b) } else { (b == kind).then_some(a) })
}

/// An instruction with a target. Addresses wrap, because programs beyond 64 KB are refused only when
/// finished.
fn jump_instruction(kind: Mcs51OpKind, operands: &[i32], target: u32) -> FormInstruction<Mcs51OpKind> {
    let operands = operands.iter().copied().chain([(target & 0xFFFF) as i32]).collect();
    FormInstruction { kind, operands, target: Some(target) }
}

/// A jump at `at`: relative, within the page, or absolute by `level`; `None` if it does not reach.
fn shortest_jump(level: u8, at: u32, target: u32) -> Option<FormInstruction<Mcs51OpKind>> {
    let next = at + 2;
    match level {
        0 => is_short_reachable(next, target).then(|| jump_instruction(Mcs51OpKind::Sjmp, &[], target)),
        1 => (next >> 11 == target >> 11).then(|| jump_instruction(Mcs51OpKind::Ajmp, &[], target)),
        _ => Some(jump_instruction(Mcs51OpKind::Ljmp, &[], target)),
    }
}

fn is_short_reachable(next: u32, target: u32) -> bool {
    (-128..128).contains(&(i64::from(target) - i64::from(next)))
}

impl TargetArch for Mcs51Arch {
    type Opcode = Mcs51OpKind;
    type JumpForm = Mcs51Jump;

    fn instruction_words(&self, kind: Mcs51OpKind) -> u32 {
        ROWS.get(kind as usize).map_or(1, |row| row.len())
    }

    fn encode(&self, kind: Mcs51OpKind, operands: &[i32], at: u32) -> Result<Vec<u16>, CodegenError> {
        let bytes = isa::encode(kind, operands, at & 0xFFFF)?;
        Ok(bytes.into_iter().map(u16::from).collect())
    }

    fn jump_form(&self, jump: Mcs51Jump, level: u8, at: u32, target: u32) -> Option<Vec<FormInstruction<Mcs51OpKind>>> {
        match (jump, level) {
            (Mcs51Jump::Unconditional, level) => shortest_jump(level, at, target).map(|step| vec![step]),
            (Mcs51Jump::Call, 0) => {
                ((at + 2) >> 11 == target >> 11).then(|| vec![jump_instruction(Mcs51OpKind::Acall, &[], target)])
            }
            (Mcs51Jump::Call, _) => Some(vec![jump_instruction(Mcs51OpKind::Lcall, &[], target)]),
            (Mcs51Jump::LoadAddress, _) => Some(vec![FormInstruction {
                kind: Mcs51OpKind::MovDptr,
                operands: vec![(target & 0xFFFF) as i32],
                target: None,
            }]),
            (Mcs51Jump::Conditional(kind, operands, count), level) => {
                let operands = operands.get(..count).unwrap_or(&operands);
                let len = self.instruction_words(kind);
                if level == 0 {
                    return is_short_reachable(at + len, target)
                        .then(|| vec![jump_instruction(kind, operands, target)]);
                }
                if let Some(opposite) = opposite(kind) {
                    let far = shortest_jump(level, at + len, target)?;
                    let over = at + len + self.instruction_words(far.kind);
                    return Some(vec![jump_instruction(opposite, operands, over), far]);
                }
                // Without an opposite condition, the jump goes to a far jump, and an SJMP in between skips
                // that.
                let far = shortest_jump(level, at + len + 2, target)?;
                let over = at + len + 2 + self.instruction_words(far.kind);
                Some(vec![
                    jump_instruction(kind, operands, at + len + 2),
                    jump_instruction(Mcs51OpKind::Sjmp, &[], over),
                    far,
                ])
            }
        }
    }

    fn flow_and_cycles(&self, kind: Mcs51OpKind) -> (ControlFlow, CycleCounts) {
        use Mcs51OpKind::{
            Acall, Ajmp, CjneDir, CjneImm, CjneInd, CjneReg, DjnzDir, DjnzReg, Jb, Jbc, Jc, Jnb, Jnc, Jnz, Jz, Lcall,
            Ljmp, Ret, Sjmp,
        };
        let flow = match kind {
            Sjmp | Ajmp | Ljmp => ControlFlow::Jump,
            Acall | Lcall => ControlFlow::Call,
            Ret => ControlFlow::Return,
            Jc | Jnc | Jb | Jnb | Jbc | Jz | Jnz | CjneDir | CjneImm | CjneReg | CjneInd | DjnzReg | DjnzDir => {
                ControlFlow::Branch
            }
            _ => ControlFlow::Sequential,
        };
        let outcomes = ROWS.get(kind as usize).map_or(&[][..], |row| row.cycles.possible_counts());
        let cycles = outcomes.first().map_or(1, |&n| n.into());
        (flow, [cycles; 3])
    }

    fn disassemble(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at & 0xFFFF).text
    }
}
