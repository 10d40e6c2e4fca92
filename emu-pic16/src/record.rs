//! What an instruction does, read off its own body.
//!
//! [`Record`] is a second meaning of the bodies: its values are empty, and it notes what was touched. The columns of the table
//! are checked against it, and predecode asks it which loops only look.

use emu_core::dispatch;
use emu_core::machine::Machine;
use emu_core::machine::unit::{Unit, Wide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Kind, Pic16Op, pic16_table};
use crate::operands::{B, F, K, Place, Target};
use crate::periph::map::Sfr;

/// What one execution of an instruction touched.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Record {
    /// Cycles charged, apart from those of a skip.
    pub cycles: u32,
    /// Flags written: C, DC, Z.
    pub flags: [bool; 3],
    /// Registers of the chip read, as places.
    pub looks: Vec<Place>,
    /// Lower bits of the target of a jump.
    pub target: Option<u16>,
    /// It may skip the next instruction.
    pub skips: bool,
    /// Clears the watchdog.
    pub renews: bool,
    /// Writes something apart from W and flags, reads through FSR, or goes where it does not say.
    pub reaches_out: bool,
}

/// Runs the body of `op` without values. A kind without a row reaches out.
pub(crate) fn record(op: Pic16Op) -> Record {
    let mut record = Record::default();
    let (m, op) = (&mut record, &op);
    pic16_table!(dispatch { (m, op, op.kind, m.reaches_out = true) });
    record
}

impl Machine for Record {
    type Bit = Unit;
    type Word = Unit;
    type Wide = Wide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.cycles += cycles;
    }
    fn jump(&mut self, _: u32) {
        self.reaches_out = true;
    }
    fn goto(&mut self, _: Wide) {
        self.reaches_out = true;
    }
    fn branch_if(&mut self, _: Unit, _: u32) {
        self.reaches_out = true;
    }
    fn skip_if(&mut self, _: Unit, _: u32) {
        self.skips = true;
    }
}

impl Pic16Machine for Record {
    fn w(&self) -> Unit {
        Unit
    }
    fn set_w(&mut self, _: Unit) {}
    fn carry(&self) -> Unit {
        Unit
    }
    fn set_carry(&mut self, _: Unit) {
        self.flags[0] = true;
    }
    fn set_z(&mut self, _: Unit) {
        self.flags[2] = true;
    }
    fn set_carries(&mut self, _: Unit) {
        (self.flags[0], self.flags[1]) = (true, true);
    }
    fn word(_: Unit) -> Unit {
        Unit
    }
    fn resolve(&mut self, place: Place) -> Place {
        self.reaches_out |= place == Place::sfr(Sfr::INDF);
        place
    }
    fn file(&mut self, place: Place) -> Unit {
        self.looks.push(place);
        Unit
    }
    fn put(&mut self, _: Place, _: Unit) {
        self.reaches_out = true;
    }
    fn put_alu(&mut self, _: Place, _: Unit) {
        self.reaches_out = true;
    }
    fn ram(&mut self, _: u16) -> Unit {
        Unit
    }
    fn put_ram(&mut self, _: u16, _: Unit) {
        self.reaches_out = true;
    }
    fn masked(_: Unit, _: u8) -> Unit {
        Unit
    }
    fn skip(&mut self, _: Unit) {
        self.skips = true;
    }
    fn go(&mut self, target: u16) {
        self.target = Some(target);
    }
    fn push(&mut self) {
        self.reaches_out = true;
    }
    fn pop(&mut self) {
        self.reaches_out = true;
    }
    fn interrupt_ended(&mut self) {
        self.reaches_out = true;
    }
    fn clear_watchdog(&mut self) {
        self.renews = true;
    }
    fn standby(&mut self) {
        self.reaches_out = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{KINDS, ROWS, SHAPES};
    use emu_core::table::{Op, Site};

    #[test]
    fn the_columns_say_what_the_bodies_do() {
        for ((row, &kind), &shape) in ROWS.iter().zip(KINDS).zip(SHAPES) {
            let op = row.op(kind, row.pattern.value, &Site { len: row.len(), ..Site::default() });
            for kind in [Some(kind), shape].into_iter().flatten() {
                let record = record(Op { kind, ..op });
                let column = ['C', 'D', 'Z'].map(|c| row.flags.contains(c));
                assert_eq!(record.flags, column, "{}: flags", row.name);
                assert_eq!(record.cycles, row.cycles.constant(), "{}: cycles", row.name);
                assert_eq!(record.skips, row.cycles.outcomes() == [1, 2], "{}: cycles", row.name);
            }
        }
    }

    /// A row that reaches a file register has a shape for RAM, and no other has.
    #[test]
    fn shapes_are_where_file_registers_are() {
        for (row, shape) in ROWS.iter().zip(SHAPES) {
            let reaches = row.operands.iter().any(|slot| slot.kind.name == F::NAME);
            assert_eq!(shape.is_some(), reaches, "{}", row.name);
        }
    }
}
