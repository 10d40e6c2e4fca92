//! Effects of an instruction, derived from its own body.
//!
//! [`InstructionRecorder`] is another machine for the bodies: its values are empty, and it records what the
//! body touches. Tests compare the columns of the table with it, and predecode uses it to find polling loops.

use std::cell::Cell;

use emu_core::dispatch;
use emu_core::machine::BodyMachine;
use emu_core::machine::unknown::{UnknownValue, UnknownWide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::flags::SregFlag;
use crate::isa::{AvrOp, AvrOpKind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};

/// Effects of one execution of an instruction.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct InstructionRecord {
    /// Number of cycles charged.
    pub cycles: u32,
    /// Registers read (bits 0 to 31) and flags read (bit 32 + bit of SREG), if read before they are written.
    pub reads: u64,
    /// Registers and flags written, with the same bit numbers.
    pub writes: u64,
    /// Data addresses read that the instruction itself determines.
    pub addresses_read: Vec<u16>,
    /// Constant target of a jump or branch.
    pub target: Option<u32>,
    /// True if it has a condition: a branch or a skip.
    pub conditional: bool,
    /// True if it clears the watchdog.
    pub clears_watchdog: bool,
    /// True if it has lasting effects other than on registers and flags, or reads memory at a computed
    /// address.
    pub has_other_effects: bool,
}

/// Runs the body of `op` without values; conditions hold if `taken`. A kind without a row counts as having
/// other effects.
pub(crate) fn record_instruction(op: AvrOp, taken: bool) -> InstructionRecord {
    let mut recorder = InstructionRecorder { record: InstructionRecord::default(), reads: Cell::new(0), taken };
    let (m, op) = (&mut recorder, &op);
    avr_table!(dispatch { (m, op, AvrOpKind, op.kind, m.record.has_other_effects = true) });
    InstructionRecord { reads: recorder.reads.get(), ..recorder.record }
}

/// The recording machine.
struct InstructionRecorder {
    record: InstructionRecord,
    /// Registers and flags read; a `Cell`, because bodies read through a shared reference.
    reads: Cell<u64>,
    taken: bool,
}

impl InstructionRecorder {
    fn note_read(&self, bit: u32) {
        self.reads.set(self.reads.get() | 1 << bit & !self.record.writes);
    }
    fn note_write(&mut self, bit: u32) {
        self.record.writes |= 1 << bit;
    }
    const fn flag_bit(flag: SregFlag) -> u32 {
        32 + flag as u32
    }
    fn write_flags(&mut self, flags: &[SregFlag]) {
        flags.iter().for_each(|&f| self.note_write(Self::flag_bit(f)));
    }
}

impl BodyMachine for InstructionRecorder {
    type Bit = UnknownValue;
    type Byte = UnknownValue;
    type Wide = UnknownWide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.record.cycles += cycles;
    }
    fn jump(&mut self, target: u32) {
        self.record.target = Some(target);
    }
    fn goto(&mut self, _: UnknownWide) {
        self.record.has_other_effects = true;
    }
    fn branch_if(&mut self, _: UnknownValue, target: u32) {
        self.record.conditional = true;
        self.record.target = Some(target);
        self.record.cycles += u32::from(self.taken);
    }
    fn skip_if(&mut self, _: UnknownValue, words: u32) {
        self.record.conditional = true;
        self.record.cycles += if self.taken { words } else { 0 };
    }
}

impl AvrMachine for InstructionRecorder {
    fn reg(&self, r: u8) -> UnknownValue {
        self.note_read(u32::from(r & 31));
        UnknownValue
    }
    fn set_reg(&mut self, r: u8, _: UnknownValue) {
        self.note_write(u32::from(r & 31));
    }
    fn flag(&self, flag: SregFlag) -> UnknownValue {
        self.note_read(Self::flag_bit(flag));
        UnknownValue
    }
    fn set_flag(&mut self, flag: SregFlag, _: UnknownValue) {
        self.write_flags(&[flag]);
    }
    fn force_flag(&mut self, flag: SregFlag, _: bool) {
        self.write_flags(&[flag]);
        self.record.has_other_effects |= flag == SregFlag::I;
    }
    fn carry(&self) -> UnknownValue {
        self.flag(SregFlag::C)
    }
    fn not_zero(&self) -> UnknownValue {
        self.flag(SregFlag::Z)
    }
    fn set_c(&mut self, _: UnknownValue) {
        self.write_flags(&[SregFlag::C]);
    }
    fn set_carries(&mut self, _: UnknownValue) {
        self.write_flags(&[SregFlag::C, SregFlag::H]);
    }
    fn set_z(&mut self, _: UnknownValue) {
        self.write_flags(&[SregFlag::Z]);
    }
    fn set_nzv(&mut self, _: UnknownValue, _: UnknownValue, _: UnknownValue) {
        self.write_flags(&[SregFlag::N, SregFlag::Z, SregFlag::V, SregFlag::S]);
    }
    fn load(&mut self, addr: UnknownWide) -> UnknownValue {
        match addr.0 {
            Some(addr) => self.record.addresses_read.push(addr),
            None => self.record.has_other_effects = true,
        }
        UnknownValue
    }
    fn store(&mut self, _: UnknownWide, _: UnknownValue) {
        self.record.has_other_effects = true;
    }
    fn io_read(&mut self, a: u8) -> UnknownValue {
        self.record.addresses_read.push(u16::from(a) + 0x20);
        UnknownValue
    }
    fn io_write(&mut self, _: u8, _: UnknownValue) {
        self.record.has_other_effects = true;
    }
    fn io_write_bit(&mut self, _: u8, _: u8, _: bool) {
        self.record.has_other_effects = true;
    }
    fn code_byte(&mut self, _: UnknownWide) -> UnknownValue {
        self.record.has_other_effects = true;
        UnknownValue
    }
    fn far_code_byte(&mut self, _: UnknownWide, _: bool) -> UnknownValue {
        self.record.has_other_effects = true;
        UnknownValue
    }
    fn sp(&self) -> UnknownWide {
        UnknownWide(None)
    }
    fn set_sp(&mut self, _: UnknownWide) {
        self.record.has_other_effects = true;
    }
    fn next_pc(&self) -> UnknownWide {
        UnknownWide(None)
    }
    fn store_program(&mut self) {
        self.record.has_other_effects = true;
    }
    fn sleep(&mut self) {
        self.record.has_other_effects = true;
    }
    fn clear_watchdog(&mut self) {
        self.record.clears_watchdog = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{KINDS, ROWS};
    use emu_core::table::InstructionLocation;

    /// Flags by their letters in the column.
    const LETTERS: [(char, SregFlag); 8] = [
        ('C', SregFlag::C),
        ('Z', SregFlag::Z),
        ('N', SregFlag::N),
        ('V', SregFlag::V),
        ('S', SregFlag::S),
        ('H', SregFlag::H),
        ('T', SregFlag::T),
        ('I', SregFlag::I),
    ];

    #[test]
    fn the_columns_say_what_the_bodies_do() {
        for (row, &kind) in ROWS.iter().zip(KINDS) {
            let mut outcomes = Vec::new();
            for (taken, next_len) in [(false, 1), (true, 1), (true, 2)] {
                let op = row.predecode(
                    kind,
                    row.pattern.value,
                    &InstructionLocation { next_len, pc_mask: 0x3FFF, ..InstructionLocation::default() },
                );
                let record = record_instruction(op, taken);
                if outcomes.last() != Some(&record.cycles) {
                    outcomes.push(record.cycles);
                }
                let column: u64 = LETTERS
                    .iter()
                    .filter(|(c, _)| row.flags.contains(*c))
                    .map(|&(_, f)| 1u64 << InstructionRecorder::flag_bit(f))
                    .sum();
                assert_eq!(record.writes >> 32 << 32, column, "{}: flags", row.name);
            }
            let column: Vec<u32> = row.cycles.possible_counts().iter().map(|&c| u32::from(c)).collect();
            assert_eq!(outcomes, column, "{}: cycles", row.name);
        }
    }
}
