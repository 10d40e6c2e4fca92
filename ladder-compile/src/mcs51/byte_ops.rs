//! Selects loads, stores and arithmetic of bytes by addressing mode, using what A and R0 are known to hold.

use emu_8051::isa::Mcs51OpKind;

use super::known_state::ByteOperand;
use super::registers::{ACC, B};
use super::select::Mcs51Selector;

/// Arithmetic of A and a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AluOp {
    /// Addition.
    Add,
    /// Addition with carry.
    Addc,
    /// Subtraction with borrow.
    Subb,
    /// Bitwise AND.
    Anl,
    /// Bitwise OR.
    Orl,
    /// Bitwise exclusive OR.
    Xrl,
}

impl AluOp {
    /// Instructions with a register, a direct byte, RAM through R0, a constant.
    const fn kinds(self) -> [Mcs51OpKind; 4] {
        match self {
            AluOp::Add => [Mcs51OpKind::AddReg, Mcs51OpKind::AddDir, Mcs51OpKind::AddInd, Mcs51OpKind::AddImm],
            AluOp::Addc => [Mcs51OpKind::AddcReg, Mcs51OpKind::AddcDir, Mcs51OpKind::AddcInd, Mcs51OpKind::AddcImm],
            AluOp::Subb => [Mcs51OpKind::SubbReg, Mcs51OpKind::SubbDir, Mcs51OpKind::SubbInd, Mcs51OpKind::SubbImm],
            AluOp::Anl => [Mcs51OpKind::AnlReg, Mcs51OpKind::AnlDir, Mcs51OpKind::AnlInd, Mcs51OpKind::AnlImm],
            AluOp::Orl => [Mcs51OpKind::OrlReg, Mcs51OpKind::OrlDir, Mcs51OpKind::OrlInd, Mcs51OpKind::OrlImm],
            AluOp::Xrl => [Mcs51OpKind::XrlReg, Mcs51OpKind::XrlDir, Mcs51OpKind::XrlInd, Mcs51OpKind::XrlImm],
        }
    }
}

/// Addressing mode of an operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AddressingMode {
    Reg(i32),
    Dir(i32),
    /// Indirect through R0, which already points to the byte.
    Ind,
    Imm(i32),
}

impl Mcs51Selector<'_> {
    fn addressing_mode(&mut self, byte: ByteOperand) -> AddressingMode {
        match byte {
            ByteOperand::Imm(value) => AddressingMode::Imm(value.into()),
            ByteOperand::Sfr(at) => AddressingMode::Dir(at),
            ByteOperand::At(at @ 0..8) => AddressingMode::Reg(at.into()),
            ByteOperand::At(at @ 8..0x80) => AddressingMode::Dir(at.into()),
            ByteOperand::At(at) => {
                match self.state.r0 {
                    Some(there) if there == at => {}
                    Some(before) if before.wrapping_add(1) == at => self.emit(Mcs51OpKind::IncReg, &[0]),
                    Some(behind) if behind.wrapping_sub(1) == at => self.emit(Mcs51OpKind::DecReg, &[0]),
                    _ => self.emit(Mcs51OpKind::MovRegImm, &[0, at.into()]),
                }
                self.state.r0 = Some(at);
                AddressingMode::Ind
            }
        }
    }

    /// A := byte; no flag changes.
    pub(super) fn load(&mut self, byte: ByteOperand) {
        if self.state.a == Some(byte) {
            return;
        }
        match self.addressing_mode(byte) {
            AddressingMode::Reg(r) => self.emit(Mcs51OpKind::MovAReg, &[r]),
            AddressingMode::Dir(at) => self.emit(Mcs51OpKind::MovADir, &[at]),
            AddressingMode::Ind => self.emit(Mcs51OpKind::MovAInd, &[0]),
            AddressingMode::Imm(0) => self.emit(Mcs51OpKind::ClrA, &[]),
            AddressingMode::Imm(value) => self.emit(Mcs51OpKind::MovAImm, &[value]),
        }
        self.state.a = (!matches!(byte, ByteOperand::Sfr(_))).then_some(byte);
    }

    /// A := A op byte.
    pub(super) fn alu(&mut self, op: AluOp, byte: ByteOperand) {
        let [reg, dir, ind, imm] = op.kinds();
        match self.addressing_mode(byte) {
            AddressingMode::Reg(r) => self.emit(reg, &[r]),
            AddressingMode::Dir(at) => self.emit(dir, &[at]),
            AddressingMode::Ind => self.emit(ind, &[0]),
            AddressingMode::Imm(value) => self.emit(imm, &[value]),
        }
        self.state.a = None;
        if matches!(op, AluOp::Add | AluOp::Addc | AluOp::Subb) {
            self.state.carry = None;
        }
    }

    /// RAM at `at` := A.
    pub(super) fn save(&mut self, at: u8) {
        match self.addressing_mode(ByteOperand::At(at)) {
            AddressingMode::Reg(r) => self.emit(Mcs51OpKind::MovRegA, &[r]),
            AddressingMode::Ind => self.emit(Mcs51OpKind::MovIndA, &[0]),
            _ => self.emit(Mcs51OpKind::MovDirA, &[at.into()]),
        }
        if !matches!(self.state.a, Some(ByteOperand::Imm(_))) {
            self.state.a = Some(ByteOperand::At(at));
        }
    }

    /// Forgets RAM at `at` as the content of A, after it changed by another way.
    pub(super) fn invalidate(&mut self, at: u8) {
        if self.state.a == Some(ByteOperand::At(at)) {
            self.state.a = None;
        }
    }

    /// RAM at `at` := byte; may or may not change A.
    pub(super) fn copy(&mut self, at: u8, byte: ByteOperand) {
        if byte == ByteOperand::At(at) {
            return;
        }
        if self.state.a == Some(byte) {
            return self.save(at);
        }
        let kind = match (byte, at) {
            (ByteOperand::Imm(_), 0..8) => Mcs51OpKind::MovRegImm,
            (ByteOperand::Imm(_), 8..0x80) => Mcs51OpKind::MovDirImm,
            (ByteOperand::Imm(_), _) => Mcs51OpKind::MovIndImm,
            (ByteOperand::At(0..0x80) | ByteOperand::Sfr(_), 0..8) => Mcs51OpKind::MovRegDir,
            (ByteOperand::At(0..8), 8..0x80) => Mcs51OpKind::MovDirReg,
            (ByteOperand::At(8..0x80) | ByteOperand::Sfr(_), 8..0x80) => Mcs51OpKind::MovDirDir,
            (ByteOperand::At(0..0x80) | ByteOperand::Sfr(_), _) => Mcs51OpKind::MovIndDir,
            (ByteOperand::At(_), 8..0x80) => Mcs51OpKind::MovDirInd,
            (ByteOperand::At(_), _) => {
                self.load(byte);
                return self.save(at);
            }
        };
        let pointed = match byte {
            ByteOperand::At(from) if at < 0x80 => from,
            _ => at,
        };
        if pointed >= 0x80 {
            self.addressing_mode(ByteOperand::At(pointed));
        }
        let from = match byte {
            ByteOperand::At(from) => i32::from(from),
            ByteOperand::Imm(value) => value.into(),
            ByteOperand::Sfr(sfr) => sfr,
        };
        match kind {
            Mcs51OpKind::MovDirInd => self.emit(kind, &[at.into(), 0]),
            Mcs51OpKind::MovIndImm | Mcs51OpKind::MovIndDir => self.emit(kind, &[0, from]),
            _ => self.emit(kind, &[at.into(), from]),
        }
        self.invalidate(at);
    }

    /// A special function register := byte.
    pub(super) fn copy_sfr(&mut self, sfr: i32, byte: ByteOperand) {
        if self.state.a == Some(byte) {
            return self.emit(Mcs51OpKind::MovDirA, &[sfr]);
        }
        match self.addressing_mode(byte) {
            AddressingMode::Reg(r) => self.emit(Mcs51OpKind::MovDirReg, &[sfr, r]),
            AddressingMode::Dir(at) => self.emit(Mcs51OpKind::MovDirDir, &[sfr, at]),
            AddressingMode::Ind => self.emit(Mcs51OpKind::MovDirInd, &[sfr, 0]),
            AddressingMode::Imm(value) => self.emit(Mcs51OpKind::MovDirImm, &[sfr, value]),
        }
    }

    /// Increments or decrements a byte of RAM; no flag changes.
    pub(super) fn step_byte(&mut self, at: u8, up: bool) {
        match self.addressing_mode(ByteOperand::At(at)) {
            AddressingMode::Reg(r) => self.emit(if up { Mcs51OpKind::IncReg } else { Mcs51OpKind::DecReg }, &[r]),
            AddressingMode::Ind => self.emit(if up { Mcs51OpKind::IncInd } else { Mcs51OpKind::DecInd }, &[0]),
            _ => self.emit(if up { Mcs51OpKind::IncDir } else { Mcs51OpKind::DecDir }, &[at.into()]),
        }
        self.invalidate(at);
    }

    /// A := FFh if bit 7 of A is 1, else 0. Changes the carry.
    pub(super) fn sign_of_a(&mut self) {
        self.emit(Mcs51OpKind::RlcA, &[]);
        self.emit(Mcs51OpKind::SubbDir, &[ACC]);
        (self.state.a, self.state.carry) = (None, None);
    }

    /// B:A := A * byte.
    pub(super) fn multiply_byte(&mut self, byte: ByteOperand) {
        self.copy_sfr(B, byte);
        self.emit(Mcs51OpKind::MulAb, &[]);
        (self.state.a, self.state.carry) = (None, Some(false));
    }
}
