//! Records what an instruction does, by running its own body.
//!
//! [`InstructionRecord`] is a second machine for the bodies. Its values are unknown, and it notes what a body
//! accesses. Tests compare the columns of the table with it, and predecode uses it to find polling loops.

use emu_core::dispatch;
use emu_core::machine::BodyMachine;
use emu_core::machine::unknown::{UnknownValue, UnknownWide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Mcs51Op, Mcs51OpKind, mcs51_table};
use crate::operands::{Abs, BitAddr, Dir, Imm, Imm16, Page, RamBit, Rel, Ri, Rn};
use crate::periph::map::sfr;

/// What one execution of an instruction accessed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct InstructionRecord {
    /// Cycles charged.
    pub cycles: u32,
    /// Flags written: C, A (AC), O (OV).
    pub flags_written: [bool; 3],
    /// Direct addresses of the registers of the chip that were read.
    pub registers_read: Vec<u8>,
    /// Distance of a relative jump from the next instruction.
    pub distance: Option<i8>,
    /// Target of an absolute jump.
    pub target: Option<u16>,
    /// Whether it writes the register that clears the watchdog.
    pub clears_watchdog: bool,
    /// Whether it writes anything other than A, B, DPTR and flags, or jumps to a computed address.
    pub has_other_effects: bool,
}

/// Runs the body of `op` without values. A kind without a row has other effects.
pub(crate) fn record_instruction(op: Mcs51Op) -> InstructionRecord {
    let mut record = InstructionRecord::default();
    let (m, op) = (&mut record, &op);
    mcs51_table!(dispatch { (m, op, Mcs51OpKind, op.kind, m.has_other_effects = true) });
    record
}

impl InstructionRecord {
    fn note_read(&mut self, addr: u8) {
        if addr >= 0x80 && !is_core_register(addr) {
            self.registers_read.push(addr);
        }
    }

    fn note_write(&mut self, addr: u8) {
        // A, B, DPTR and PSW are compared in every iteration of a polling loop. The loop must not write SP or
        // PSW directly.
        self.clears_watchdog |= addr == sfr::WDTRST;
        self.has_other_effects |= !matches!(addr, sfr::ACC | sfr::B | sfr::DPL | sfr::DPH | sfr::WDTRST);
    }
}

/// Whether an address is a register of the core, which has no function of its own.
pub(crate) const fn is_core_register(addr: u8) -> bool {
    matches!(addr, sfr::ACC | sfr::B | sfr::PSW | sfr::SP | sfr::DPL | sfr::DPH)
}

impl BodyMachine for InstructionRecord {
    type Bit = UnknownValue;
    type Byte = UnknownValue;
    type Wide = UnknownWide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.cycles += cycles;
    }
    fn jump(&mut self, target: u32) {
        self.target = Some(target as u16);
    }
    fn goto(&mut self, _: UnknownWide) {
        self.has_other_effects = true;
    }
    fn branch_if(&mut self, _: UnknownValue, _: u32) {
        self.has_other_effects = true;
    }
    fn skip_if(&mut self, _: UnknownValue, _: u32) {
        self.has_other_effects = true;
    }
}

impl Mcs51Machine for InstructionRecord {
    fn acc(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_acc(&mut self, _: UnknownValue) {}
    fn b(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_b(&mut self, _: UnknownValue) {}
    fn dptr(&self) -> UnknownWide {
        UnknownWide(None)
    }
    fn set_dptr(&mut self, _: UnknownWide) {}
    fn sp(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_sp(&mut self, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn carry(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_carry(&mut self, _: UnknownValue) {
        self.flags_written[0] = true;
    }
    fn half_carry(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_overflow(&mut self, _: UnknownValue) {
        self.flags_written[2] = true;
    }
    fn set_sum_flags(&mut self, _: UnknownValue, _: UnknownValue) {
        self.flags_written = [true; 3];
    }
    fn word_from_bit(_: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn bit_from_bool(_: bool) -> UnknownValue {
        UnknownValue
    }
    fn reg(&mut self, _: u8) -> UnknownValue {
        UnknownValue
    }
    fn set_reg(&mut self, _: u8, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn ram(&mut self, _: u8) -> UnknownValue {
        UnknownValue
    }
    fn set_ram(&mut self, _: u8, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn idata(&mut self, _: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn set_idata(&mut self, _: UnknownValue, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn direct(&mut self, addr: u8) -> UnknownValue {
        self.note_read(addr);
        UnknownValue
    }
    fn direct_latch(&mut self, addr: u8) -> UnknownValue {
        self.note_read(addr);
        UnknownValue
    }
    fn set_direct(&mut self, addr: u8, _: UnknownValue) {
        self.note_write(addr);
    }
    fn ram_bit(&mut self, _: RamBit) -> UnknownValue {
        UnknownValue
    }
    fn set_ram_bit(&mut self, _: RamBit, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn direct_bit(&mut self, addr: u8) -> UnknownValue {
        self.note_read(addr & 0xF8);
        UnknownValue
    }
    fn direct_bit_latch(&mut self, addr: u8) -> UnknownValue {
        self.note_read(addr & 0xF8);
        UnknownValue
    }
    fn set_direct_bit_if(&mut self, _: UnknownValue, addr: u8, _: UnknownValue) {
        self.note_write(addr & 0xF8);
    }
    fn xdata(&mut self, _: UnknownWide) -> UnknownValue {
        // MOVX writes ones into port 0.
        self.has_other_effects = true;
        UnknownValue
    }
    fn set_xdata(&mut self, _: UnknownWide, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn xdata_page(&mut self) -> UnknownValue {
        UnknownValue
    }
    fn code(&mut self, _: UnknownWide) -> UnknownValue {
        UnknownValue
    }
    fn next_pc(&self) -> UnknownWide {
        UnknownWide(None)
    }
    fn relative_if(&mut self, _: UnknownValue, distance: i8) {
        self.distance = Some(distance);
    }
    fn end_interrupt(&mut self) {
        self.has_other_effects = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{KINDS, ROWS, SHAPES};
    use emu_core::table::{InstructionLocation, PredecodedOp};

    #[test]
    fn the_columns_say_what_the_bodies_do() {
        for ((row, &kind), &shape) in ROWS.iter().zip(KINDS).zip(SHAPES) {
            let op = row.predecode(
                kind,
                row.pattern.value,
                &InstructionLocation { len: row.len(), ..InstructionLocation::default() },
            );
            for kind in [Some(kind), shape].into_iter().flatten() {
                let record = record_instruction(PredecodedOp { kind, ..op });
                let column = ['C', 'A', 'O'].map(|c| row.flags.contains(c));
                assert_eq!(record.flags_written, column, "{}: flags", row.name);
                assert_eq!(record.cycles, row.cycles.constant(), "{}: cycles", row.name);
            }
        }
    }

    /// A row with a byte or bit address as an operand has a shape for RAM, and no other row has one.
    #[test]
    fn shapes_are_where_addresses_are() {
        for (row, shape) in ROWS.iter().zip(SHAPES) {
            let addressed = row.operands.iter().any(|slot| matches!(slot.kind.name, "direct address" | "bit address"));
            assert_eq!(shape.is_some(), addressed, "{}", row.name);
        }
    }
}
