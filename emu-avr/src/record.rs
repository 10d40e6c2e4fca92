//! What an instruction does, read off its own body.
//!
//! [`Recorder`] is a second meaning of the bodies: its values are empty, and it notes what was touched. The columns of the
//! table are checked against it, and predecode asks it which loops only look.

use std::cell::Cell;

use emu_core::dispatch;
use emu_core::machine::Machine;
use emu_core::machine::unit::{Unit, Wide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::flags::Flag;
use crate::isa::{AvrOp, Kind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};

/// What one execution of an instruction touched.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Record {
    /// Cycles charged.
    pub cycles: u32,
    /// Registers read (bits 0 to 31) and flags read (bit 32 + bit of SREG), as seen before the instruction.
    pub reads: u64,
    /// Registers and flags written, numbered likewise.
    pub writes: u64,
    /// Data addresses read that are known from the instruction alone.
    pub looks: Vec<u16>,
    /// Constant target of a jump or branch.
    pub target: Option<u32>,
    /// Has a condition: a branch or a skip.
    pub conditional: bool,
    /// Clears the watchdog.
    pub renews: bool,
    /// Does something that outlives it apart from registers and flags, or reads memory at a computed address.
    pub reaches_out: bool,
}

/// Runs the body of `op` without values; conditions hold if `taken`. A kind without a row reaches out.
pub(crate) fn record(op: AvrOp, taken: bool) -> Record {
    let mut recorder = Recorder { record: Record::default(), reads: Cell::new(0), taken };
    let (m, op) = (&mut recorder, &op);
    avr_table!(dispatch { (m, op, op.kind, m.record.reaches_out = true) });
    Record { reads: recorder.reads.get(), ..recorder.record }
}

struct Recorder {
    record: Record,
    /// Beside the record, since bodies read through a shared reference.
    reads: Cell<u64>,
    taken: bool,
}

impl Recorder {
    fn read(&self, bit: u32) {
        self.reads.set(self.reads.get() | 1 << bit & !self.record.writes);
    }
    fn write(&mut self, bit: u32) {
        self.record.writes |= 1 << bit;
    }
    const fn flag_bit(flag: Flag) -> u32 {
        32 + flag as u32
    }
    fn write_flags(&mut self, flags: &[Flag]) {
        flags.iter().for_each(|&f| self.write(Self::flag_bit(f)));
    }
}

impl Machine for Recorder {
    type Bit = Unit;
    type Word = Unit;
    type Wide = Wide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.record.cycles += cycles;
    }
    fn jump(&mut self, target: u32) {
        self.record.target = Some(target);
    }
    fn goto(&mut self, _: Wide) {
        self.record.reaches_out = true;
    }
    fn branch_if(&mut self, _: Unit, target: u32) {
        self.record.conditional = true;
        self.record.target = Some(target);
        self.record.cycles += u32::from(self.taken);
    }
    fn skip_if(&mut self, _: Unit, words: u32) {
        self.record.conditional = true;
        self.record.cycles += if self.taken { words } else { 0 };
    }
}

impl AvrMachine for Recorder {
    fn reg(&self, r: u8) -> Unit {
        self.read(u32::from(r & 31));
        Unit
    }
    fn set_reg(&mut self, r: u8, _: Unit) {
        self.write(u32::from(r & 31));
    }
    fn flag(&self, flag: Flag) -> Unit {
        self.read(Self::flag_bit(flag));
        Unit
    }
    fn set_flag(&mut self, flag: Flag, _: Unit) {
        self.write_flags(&[flag]);
    }
    fn force_flag(&mut self, flag: Flag, _: bool) {
        self.write_flags(&[flag]);
        self.record.reaches_out |= flag == Flag::I;
    }
    fn carry(&self) -> Unit {
        self.flag(Flag::C)
    }
    fn not_zero(&self) -> Unit {
        self.flag(Flag::Z)
    }
    fn set_c(&mut self, _: Unit) {
        self.write_flags(&[Flag::C]);
    }
    fn set_carries(&mut self, _: Unit) {
        self.write_flags(&[Flag::C, Flag::H]);
    }
    fn set_z(&mut self, _: Unit) {
        self.write_flags(&[Flag::Z]);
    }
    fn set_nzv(&mut self, _: Unit, _: Unit, _: Unit) {
        self.write_flags(&[Flag::N, Flag::Z, Flag::V, Flag::S]);
    }
    fn load(&mut self, addr: Wide) -> Unit {
        match addr.0 {
            Some(addr) => self.record.looks.push(addr),
            None => self.record.reaches_out = true,
        }
        Unit
    }
    fn store(&mut self, _: Wide, _: Unit) {
        self.record.reaches_out = true;
    }
    fn io_read(&mut self, a: u8) -> Unit {
        self.record.looks.push(u16::from(a) + 0x20);
        Unit
    }
    fn io_write(&mut self, _: u8, _: Unit) {
        self.record.reaches_out = true;
    }
    fn io_write_bit(&mut self, _: u8, _: u8, _: bool) {
        self.record.reaches_out = true;
    }
    fn code_byte(&mut self, _: Wide) -> Unit {
        self.record.reaches_out = true;
        Unit
    }
    fn far_code_byte(&mut self, _: Wide, _: bool) -> Unit {
        self.record.reaches_out = true;
        Unit
    }
    fn sp(&self) -> Wide {
        Wide(None)
    }
    fn set_sp(&mut self, _: Wide) {
        self.record.reaches_out = true;
    }
    fn next_pc(&self) -> Wide {
        Wide(None)
    }
    fn store_program(&mut self) {
        self.record.reaches_out = true;
    }
    fn sleep(&mut self) {
        self.record.reaches_out = true;
    }
    fn clear_watchdog(&mut self) {
        self.record.renews = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{KINDS, ROWS};
    use emu_core::table::Site;

    /// Flags by the letters of the column.
    const LETTERS: [(char, Flag); 8] = [
        ('C', Flag::C),
        ('Z', Flag::Z),
        ('N', Flag::N),
        ('V', Flag::V),
        ('S', Flag::S),
        ('H', Flag::H),
        ('T', Flag::T),
        ('I', Flag::I),
    ];

    #[test]
    fn the_columns_say_what_the_bodies_do() {
        for (row, &kind) in ROWS.iter().zip(KINDS) {
            let mut outcomes = Vec::new();
            for (taken, next_len) in [(false, 1), (true, 1), (true, 2)] {
                let op = row.op(kind, row.pattern.value, &Site { next_len, pc_mask: 0x3FFF, ..Site::default() });
                let record = record(op, taken);
                if outcomes.last() != Some(&record.cycles) {
                    outcomes.push(record.cycles);
                }
                let column: u64 = LETTERS
                    .iter()
                    .filter(|(c, _)| row.flags.contains(*c))
                    .map(|&(_, f)| 1u64 << Recorder::flag_bit(f))
                    .sum();
                assert_eq!(record.writes >> 32 << 32, column, "{}: flags", row.name);
            }
            let column: Vec<u32> = row.cycles.outcomes().iter().map(|&c| u32::from(c)).collect();
            assert_eq!(outcomes, column, "{}: cycles", row.name);
        }
    }
}
