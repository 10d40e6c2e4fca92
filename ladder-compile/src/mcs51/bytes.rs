//! Bytes: loads, stores and arithmetic by where an operand lies, with what A and R0 are known to hold.

use emu_8051::isa::Kind;

use super::regs::{ACC, B};
use super::select::Select;
use super::state::Byte;

/// Arithmetic of A and a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Alu {
    /// Sum.
    Add,
    /// Sum with carry.
    Addc,
    /// Difference with borrow.
    Subb,
    /// Or.
    Orl,
    /// Exclusive or.
    Xrl,
}

impl Alu {
    /// With a register, a direct byte, RAM by R0, a constant.
    const fn kinds(self) -> [Kind; 4] {
        match self {
            Alu::Add => [Kind::AddReg, Kind::AddDir, Kind::AddInd, Kind::AddImm],
            Alu::Addc => [Kind::AddcReg, Kind::AddcDir, Kind::AddcInd, Kind::AddcImm],
            Alu::Subb => [Kind::SubbReg, Kind::SubbDir, Kind::SubbInd, Kind::SubbImm],
            Alu::Orl => [Kind::OrlReg, Kind::OrlDir, Kind::OrlInd, Kind::OrlImm],
            Alu::Xrl => [Kind::XrlReg, Kind::XrlDir, Kind::XrlInd, Kind::XrlImm],
        }
    }
}

/// Where an operand lies, as instructions see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Reg(i32),
    Dir(i32),
    /// By R0, which points there.
    Ind,
    Imm(i32),
}

impl Select<'_> {
    fn way(&mut self, byte: Byte) -> Way {
        match byte {
            Byte::Imm(value) => Way::Imm(value.into()),
            Byte::Sfr(at) => Way::Dir(at),
            Byte::At(at @ 0..8) => Way::Reg(at.into()),
            Byte::At(at @ 8..0x80) => Way::Dir(at.into()),
            Byte::At(at) => {
                match self.now.r0 {
                    Some(there) if there == at => {}
                    Some(before) if before.wrapping_add(1) == at => self.emit(Kind::IncReg, &[0]),
                    Some(behind) if behind.wrapping_sub(1) == at => self.emit(Kind::DecReg, &[0]),
                    _ => self.emit(Kind::MovRegImm, &[0, at.into()]),
                }
                self.now.r0 = Some(at);
                Way::Ind
            }
        }
    }

    /// A := byte; no flag changes.
    pub(super) fn load(&mut self, byte: Byte) {
        if self.now.a == Some(byte) {
            return;
        }
        match self.way(byte) {
            Way::Reg(r) => self.emit(Kind::MovAReg, &[r]),
            Way::Dir(at) => self.emit(Kind::MovADir, &[at]),
            Way::Ind => self.emit(Kind::MovAInd, &[0]),
            Way::Imm(0) => self.emit(Kind::ClrA, &[]),
            Way::Imm(value) => self.emit(Kind::MovAImm, &[value]),
        }
        self.now.a = (!matches!(byte, Byte::Sfr(_))).then_some(byte);
    }

    /// A := A op byte.
    pub(super) fn alu(&mut self, op: Alu, byte: Byte) {
        let [reg, dir, ind, imm] = op.kinds();
        match self.way(byte) {
            Way::Reg(r) => self.emit(reg, &[r]),
            Way::Dir(at) => self.emit(dir, &[at]),
            Way::Ind => self.emit(ind, &[0]),
            Way::Imm(value) => self.emit(imm, &[value]),
        }
        self.now.a = None;
        if matches!(op, Alu::Add | Alu::Addc | Alu::Subb) {
            self.now.carry = None;
        }
    }

    /// RAM at `at` := A.
    pub(super) fn save(&mut self, at: u8) {
        match self.way(Byte::At(at)) {
            Way::Reg(r) => self.emit(Kind::MovRegA, &[r]),
            Way::Ind => self.emit(Kind::MovIndA, &[0]),
            _ => self.emit(Kind::MovDirA, &[at.into()]),
        }
        if !matches!(self.now.a, Some(Byte::Imm(_))) {
            self.now.a = Some(Byte::At(at));
        }
    }

    /// RAM at `at` has changed behind A's back.
    pub(super) fn changed(&mut self, at: u8) {
        if self.now.a == Some(Byte::At(at)) {
            self.now.a = None;
        }
    }

    /// RAM at `at` := byte; A keeps what it holds, or not.
    pub(super) fn copy(&mut self, at: u8, byte: Byte) {
        if byte == Byte::At(at) {
            return;
        }
        if self.now.a == Some(byte) {
            return self.save(at);
        }
        let kind = match (byte, at) {
            (Byte::Imm(_), 0..8) => Kind::MovRegImm,
            (Byte::Imm(_), 8..0x80) => Kind::MovDirImm,
            (Byte::Imm(_), _) => Kind::MovIndImm,
            (Byte::At(0..0x80) | Byte::Sfr(_), 0..8) => Kind::MovRegDir,
            (Byte::At(0..8), 8..0x80) => Kind::MovDirReg,
            (Byte::At(8..0x80) | Byte::Sfr(_), 8..0x80) => Kind::MovDirDir,
            (Byte::At(0..0x80) | Byte::Sfr(_), _) => Kind::MovIndDir,
            (Byte::At(_), 8..0x80) => Kind::MovDirInd,
            (Byte::At(_), _) => {
                self.load(byte);
                return self.save(at);
            }
        };
        let pointed = match byte {
            Byte::At(from) if at < 0x80 => from,
            _ => at,
        };
        if pointed >= 0x80 {
            self.way(Byte::At(pointed));
        }
        let from = match byte {
            Byte::At(from) => i32::from(from),
            Byte::Imm(value) => value.into(),
            Byte::Sfr(sfr) => sfr,
        };
        match kind {
            Kind::MovDirInd => self.emit(kind, &[at.into(), 0]),
            Kind::MovIndImm | Kind::MovIndDir => self.emit(kind, &[0, from]),
            _ => self.emit(kind, &[at.into(), from]),
        }
        self.changed(at);
    }

    /// A special function register := byte.
    pub(super) fn copy_sfr(&mut self, sfr: i32, byte: Byte) {
        if self.now.a == Some(byte) {
            return self.emit(Kind::MovDirA, &[sfr]);
        }
        match self.way(byte) {
            Way::Reg(r) => self.emit(Kind::MovDirReg, &[sfr, r]),
            Way::Dir(at) => self.emit(Kind::MovDirDir, &[sfr, at]),
            Way::Ind => self.emit(Kind::MovDirInd, &[sfr, 0]),
            Way::Imm(value) => self.emit(Kind::MovDirImm, &[sfr, value]),
        }
    }

    /// One more or one less in RAM; no flag changes.
    pub(super) fn step(&mut self, at: u8, up: bool) {
        match self.way(Byte::At(at)) {
            Way::Reg(r) => self.emit(if up { Kind::IncReg } else { Kind::DecReg }, &[r]),
            Way::Ind => self.emit(if up { Kind::IncInd } else { Kind::DecInd }, &[0]),
            _ => self.emit(if up { Kind::IncDir } else { Kind::DecDir }, &[at.into()]),
        }
        self.changed(at);
    }

    /// A := FFh where bit 7 of A is 1, else 0. The carry changes.
    pub(super) fn sign_of_a(&mut self) {
        self.emit(Kind::RlcA, &[]);
        self.emit(Kind::SubbDir, &[ACC]);
        (self.now.a, self.now.carry) = (None, None);
    }

    /// The product of A and a byte in B and A.
    pub(super) fn times(&mut self, byte: Byte) {
        self.copy_sfr(B, byte);
        self.emit(Kind::MulAb, &[]);
        (self.now.a, self.now.carry) = (None, Some(false));
    }
}
