//! Effects of an instruction, derived from its own body.
//!
//! [`InstructionRecord`] is another machine for the bodies: its values are empty, and it records what the
//! body touches. Tests compare the columns of the table with it, and predecode uses it to find polling loops.

use emu_core::dispatch;
use emu_core::machine::BodyMachine;
use emu_core::machine::unknown::{UnknownValue, UnknownWide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Pic16Op, Pic16OpKind, pic16_table};
use crate::operands::{B, F, FileAddress, JumpTarget, K};
use crate::periph::map::Sfr;

/// Effects of one execution of an instruction.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct InstructionRecord {
    /// Number of cycles charged, without that of a skip.
    pub cycles: u32,
    /// Flags written: C, DC, Z.
    pub flags: [bool; 3],
    /// File addresses read, other than RAM.
    pub addresses_read: Vec<FileAddress>,
    /// Low bits of the target of a jump.
    pub target: Option<u16>,
    /// True if it can skip the next instruction.
    pub skips: bool,
    /// True if it clears the watchdog.
    pub clears_watchdog: bool,
    /// True if it writes something other than W and flags, reads through FSR, or jumps to an address not in
    /// the instruction.
    pub has_other_effects: bool,
}

/// Runs the body of `op` without values. A kind without a row counts as having other effects.
pub(crate) fn record_instruction(op: Pic16Op) -> InstructionRecord {
    let mut record = InstructionRecord::default();
    let (m, op) = (&mut record, &op);
    pic16_table!(dispatch { (m, op, Pic16OpKind, op.kind, m.has_other_effects = true) });
    record
}

impl BodyMachine for InstructionRecord {
    type Bit = UnknownValue;
    type Byte = UnknownValue;
    type Wide = UnknownWide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.cycles += cycles;
    }
    fn jump(&mut self, _: u32) {
        self.has_other_effects = true;
    }
    fn goto(&mut self, _: UnknownWide) {
        self.has_other_effects = true;
    }
    fn branch_if(&mut self, _: UnknownValue, _: u32) {
        self.has_other_effects = true;
    }
    fn skip_if(&mut self, _: UnknownValue, _: u32) {
        self.skips = true;
    }
}

impl Pic16Machine for InstructionRecord {
    fn w(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_w(&mut self, _: UnknownValue) {}
    fn carry(&self) -> UnknownValue {
        UnknownValue
    }
    fn set_carry(&mut self, _: UnknownValue) {
        self.flags[0] = true;
    }
    fn set_z(&mut self, _: UnknownValue) {
        self.flags[2] = true;
    }
    fn set_carries(&mut self, _: UnknownValue) {
        (self.flags[0], self.flags[1]) = (true, true);
    }
    fn word_from_bit(_: UnknownValue) -> UnknownValue {
        UnknownValue
    }
    fn resolve(&mut self, file_address: FileAddress) -> FileAddress {
        self.has_other_effects |= file_address == FileAddress::sfr(Sfr::INDF);
        file_address
    }
    fn read_file(&mut self, file_address: FileAddress) -> UnknownValue {
        self.addresses_read.push(file_address);
        UnknownValue
    }
    fn write_file(&mut self, _: FileAddress, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn write_file_with_flags(&mut self, _: FileAddress, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn read_ram(&mut self, _: u16) -> UnknownValue {
        UnknownValue
    }
    fn write_ram(&mut self, _: u16, _: UnknownValue) {
        self.has_other_effects = true;
    }
    fn is_any_bit_set(_: UnknownValue, _: u8) -> UnknownValue {
        UnknownValue
    }
    fn skip(&mut self, _: UnknownValue) {
        self.skips = true;
    }
    fn jump_within_page(&mut self, target: u16) {
        self.target = Some(target);
    }
    fn push(&mut self) {
        self.has_other_effects = true;
    }
    fn pop(&mut self) {
        self.has_other_effects = true;
    }
    fn end_interrupt(&mut self) {
        self.has_other_effects = true;
    }
    fn clear_watchdog(&mut self) {
        self.clears_watchdog = true;
    }
    fn enter_standby(&mut self) {
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
                let column = ['C', 'D', 'Z'].map(|c| row.flags.contains(c));
                assert_eq!(record.flags, column, "{}: flags", row.name);
                assert_eq!(record.cycles, row.cycles.constant(), "{}: cycles", row.name);
                assert_eq!(record.skips, row.cycles.possible_counts() == [1, 2], "{}: cycles", row.name);
            }
        }
    }

    /// A row has a kind for RAM exactly if it has a file register.
    #[test]
    fn shapes_are_where_file_registers_are() {
        for (row, shape) in ROWS.iter().zip(SHAPES) {
            let reaches = row.operands.iter().any(|slot| slot.kind.name == F::NAME);
            assert_eq!(shape.is_some(), reaches, "{}", row.name);
        }
    }
}
