//! The AVR as a target of the code writer ([`crate::code`]): instruction table and forms of jumps.

use emu_avr::isa::{self, AvrOpKind, ROWS, WORD_BITS};
use emu_core::chip::Chip;
use emu_core::table::{InstructionLocation, instruction_words};

use crate::CodegenError;
use crate::code::{ControlFlow, CycleCounts, FormInstruction, TargetArch};

/// An AVR chip.
#[derive(Debug, Clone, Copy)]
pub struct AvrArch {
    /// Description of the chip.
    pub chip: &'static Chip,
}

/// A transfer of control, before its form is chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AvrJump {
    /// A conditional branch.
    If(AvrOpKind),
    /// An unconditional jump. It is one instruction at any distance, so a skip may precede it.
    To,
    /// A call.
    Call,
}

/// Code writer for the AVR.
pub type AvrCodeWriter = crate::code::CodeWriter<AvrArch>;

impl AvrArch {
    /// Mask that wraps relative jumps: program words less one on chips without JMP, else larger than any
    /// program.
    fn wrap_mask(&self) -> u32 {
        if isa::is_missing(self.chip.flash_bytes, AvrOpKind::Jmp) { self.chip.flash_bytes / 2 - 1 } else { 0x3F_FFFF }
    }

    /// Location of an instruction. Addresses wrap, because code that is too large is refused only when it is
    /// finished.
    fn site(&self, pc: u32, len: u32) -> InstructionLocation {
        InstructionLocation { pc: pc & self.wrap_mask(), len, next_len: 1, pc_mask: self.wrap_mask() }
    }

    /// True if RJMP and RCALL reach from `at` to `to`: 2,047 words forward, 2,048 back, and across the wrap
    /// on small chips.
    fn is_relative_reachable(&self, at: u32, to: u32) -> bool {
        let away = i64::from(to) - i64::from(at) - 1;
        let size = i64::from(self.wrap_mask()) + 1;
        [away, away - size, away + size].iter().any(|away| (-2048..2048).contains(away))
    }
}

impl TargetArch for AvrArch {
    type Opcode = AvrOpKind;
    type JumpForm = AvrJump;

    fn instruction_words(&self, kind: AvrOpKind) -> u32 {
        ROWS.get(kind as usize).map_or(1, |row| row.len())
    }

    fn encode(&self, kind: AvrOpKind, operands: &[i32], at: u32) -> Result<Vec<u16>, CodegenError> {
        let row = ROWS.get(kind as usize).ok_or(CodegenError::NoSuchInstruction)?;
        let bits = row.encode(operands, &self.site(at, row.len()))?;
        Ok(instruction_words(row, WORD_BITS, bits))
    }

    fn jump_form(&self, jump: AvrJump, level: u8, at: u32, to: u32) -> Option<Vec<FormInstruction<AvrOpKind>>> {
        let step =
            |kind, to: u32| FormInstruction { kind, operands: vec![(to & self.wrap_mask()) as i32], target: Some(to) };
        match (jump, level) {
            (AvrJump::If(kind), 0) => {
                let away = i64::from(to) - i64::from(at) - 1;
                (-64..64).contains(&away).then(|| vec![step(kind, to)])
            }
            // Out of reach for the branch: the opposite branch skips a jump.
            (AvrJump::If(kind), 1) => self
                .is_relative_reachable(at + 1, to)
                .then(|| vec![step(opposite_branch(kind), at + 2), step(AvrOpKind::Rjmp, to)]),
            (AvrJump::If(kind), _) => Some(vec![step(opposite_branch(kind), at + 3), step(AvrOpKind::Jmp, to)]),
            (AvrJump::To, 0) => self.is_relative_reachable(at, to).then(|| vec![step(AvrOpKind::Rjmp, to)]),
            (AvrJump::Call, 0) => self.is_relative_reachable(at, to).then(|| vec![step(AvrOpKind::Rcall, to)]),
            // On a chip without these instructions only code that is too large reaches this arm; its size is
            // refused later.
            (AvrJump::To, _) => Some(vec![step(AvrOpKind::Jmp, to)]),
            (AvrJump::Call, _) => Some(vec![step(AvrOpKind::Call, to)]),
        }
    }

    fn flow_and_cycles(&self, kind: AvrOpKind) -> (ControlFlow, CycleCounts) {
        let flow = match kind {
            AvrOpKind::Ret => ControlFlow::Return,
            AvrOpKind::Rjmp | AvrOpKind::Jmp => ControlFlow::Jump,
            AvrOpKind::Rcall | AvrOpKind::Call => ControlFlow::Call,
            AvrOpKind::Sbrc | AvrOpKind::Sbrs | AvrOpKind::Sbic | AvrOpKind::Sbis | AvrOpKind::Cpse => {
                ControlFlow::Skip
            }
            kind if opposite_branch(kind) != kind => ControlFlow::Branch,
            _ => ControlFlow::Sequential,
        };
        let outcomes = ROWS.get(kind as usize).map_or(&[][..], |row| row.cycles.possible_counts());
        let cycles = |n: usize| outcomes.get(n).or(outcomes.last()).copied().map_or(1, u32::from);
        (flow, [cycles(0), cycles(1), cycles(2)])
    }

    fn disassemble(&self, words: &[u16], at: u32) -> String {
        (self.chip.isa.disassemble)(words, at).text
    }
}

/// Returns the branch on the opposite condition.
#[must_use]
pub fn opposite_branch(kind: AvrOpKind) -> AvrOpKind {
    const PAIRS: [(AvrOpKind, AvrOpKind); 6] = [
        (AvrOpKind::Brcs, AvrOpKind::Brcc),
        (AvrOpKind::Breq, AvrOpKind::Brne),
        (AvrOpKind::Brmi, AvrOpKind::Brpl),
        (AvrOpKind::Brlt, AvrOpKind::Brge),
        (AvrOpKind::Brts, AvrOpKind::Brtc),
        (AvrOpKind::Brvs, AvrOpKind::Brvc),
    ];
    let found = PAIRS.iter().find_map(|&(a, b)| if a == kind { Some(b) } else { (b == kind).then_some(a) });
    found.unwrap_or(kind)
}
