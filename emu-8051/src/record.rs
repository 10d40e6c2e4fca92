//! What an instruction does, read off its own body.
//!
//! [`Recorder`] is a second meaning of the bodies: its values are empty, and it notes what was touched. The columns of the
//! table are checked against it, and predecode asks it which loops only look.

use emu_core::dispatch;
use emu_core::machine::Machine;
use emu_core::machine::unit::{Unit, Wide};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Kind, Mcs51Op, mcs51_table};
use crate::operands::{Abs, BitAddr, Dir, Imm, Imm16, Page, RamBit, Rel, Ri, Rn};
use crate::periph::map::at;

/// What one execution of an instruction touched.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Record {
    /// Cycles charged.
    pub cycles: u32,
    /// Flags written: C, A (AC), O (OV).
    pub flags: [bool; 3],
    /// Registers of the chip read, by direct address.
    pub looks: Vec<u8>,
    /// Distance of a relative jump from the next instruction.
    pub distance: Option<i8>,
    /// Target of an absolute jump.
    pub target: Option<u16>,
    /// Writes the register that clears the watchdog.
    pub renews: bool,
    /// Writes something else apart from A, B, DPTR and flags, or goes to a computed address.
    pub reaches_out: bool,
}

/// Runs the body of `op` without values. A kind without a row reaches out.
pub(crate) fn record(op: Mcs51Op) -> Record {
    let mut record = Record::default();
    let (m, op) = (&mut record, &op);
    mcs51_table!(dispatch { (m, op, op.kind, m.reaches_out = true) });
    record
}

impl Record {
    fn look(&mut self, addr: u8) {
        if addr >= 0x80 && !is_core(addr) {
            self.looks.push(addr);
        }
    }

    fn write(&mut self, addr: u8) {
        // What the core holds is compared whole at every turn of a loop; the stack pointer and PSW are left alone by it.
        self.renews |= addr == at::WDTRST;
        self.reaches_out |= !matches!(addr, at::ACC | at::B | at::DPL | at::DPH | at::WDTRST);
    }
}

/// True for registers of the core, which do nothing by themselves.
pub(crate) const fn is_core(addr: u8) -> bool {
    matches!(addr, at::ACC | at::B | at::PSW | at::SP | at::DPL | at::DPH)
}

impl Machine for Record {
    type Bit = Unit;
    type Word = Unit;
    type Wide = Wide;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, cycles: u32) {
        self.cycles += cycles;
    }
    fn jump(&mut self, target: u32) {
        self.target = Some(target as u16);
    }
    fn goto(&mut self, _: Wide) {
        self.reaches_out = true;
    }
    fn branch_if(&mut self, _: Unit, _: u32) {
        self.reaches_out = true;
    }
    fn skip_if(&mut self, _: Unit, _: u32) {
        self.reaches_out = true;
    }
}

impl Mcs51Machine for Record {
    fn acc(&self) -> Unit {
        Unit
    }
    fn set_acc(&mut self, _: Unit) {}
    fn b(&self) -> Unit {
        Unit
    }
    fn set_b(&mut self, _: Unit) {}
    fn dptr(&self) -> Wide {
        Wide(None)
    }
    fn set_dptr(&mut self, _: Wide) {}
    fn sp(&self) -> Unit {
        Unit
    }
    fn set_sp(&mut self, _: Unit) {
        self.reaches_out = true;
    }
    fn carry(&self) -> Unit {
        Unit
    }
    fn set_carry(&mut self, _: Unit) {
        self.flags[0] = true;
    }
    fn half(&self) -> Unit {
        Unit
    }
    fn set_overflow(&mut self, _: Unit) {
        self.flags[2] = true;
    }
    fn set_sum_flags(&mut self, _: Unit, _: Unit) {
        self.flags = [true; 3];
    }
    fn word(_: Unit) -> Unit {
        Unit
    }
    fn bit(_: bool) -> Unit {
        Unit
    }
    fn reg(&mut self, _: u8) -> Unit {
        Unit
    }
    fn set_reg(&mut self, _: u8, _: Unit) {
        self.reaches_out = true;
    }
    fn ram(&mut self, _: u8) -> Unit {
        Unit
    }
    fn set_ram(&mut self, _: u8, _: Unit) {
        self.reaches_out = true;
    }
    fn idata(&mut self, _: Unit) -> Unit {
        Unit
    }
    fn set_idata(&mut self, _: Unit, _: Unit) {
        self.reaches_out = true;
    }
    fn direct(&mut self, addr: u8) -> Unit {
        self.look(addr);
        Unit
    }
    fn direct_latch(&mut self, addr: u8) -> Unit {
        self.look(addr);
        Unit
    }
    fn set_direct(&mut self, addr: u8, _: Unit) {
        self.write(addr);
    }
    fn ram_bit(&mut self, _: RamBit) -> Unit {
        Unit
    }
    fn set_ram_bit(&mut self, _: RamBit, _: Unit) {
        self.reaches_out = true;
    }
    fn direct_bit(&mut self, addr: u8) -> Unit {
        self.look(addr & 0xF8);
        Unit
    }
    fn direct_bit_latch(&mut self, addr: u8) -> Unit {
        self.look(addr & 0xF8);
        Unit
    }
    fn set_direct_bit_if(&mut self, _: Unit, addr: u8, _: Unit) {
        self.write(addr & 0xF8);
    }
    fn xdata(&mut self, _: Wide) -> Unit {
        // It leaves ones in port 0.
        self.reaches_out = true;
        Unit
    }
    fn set_xdata(&mut self, _: Wide, _: Unit) {
        self.reaches_out = true;
    }
    fn page(&mut self) -> Unit {
        Unit
    }
    fn code(&mut self, _: Wide) -> Unit {
        Unit
    }
    fn next_pc(&self) -> Wide {
        Wide(None)
    }
    fn relative_if(&mut self, _: Unit, distance: i8) {
        self.distance = Some(distance);
    }
    fn interrupt_ended(&mut self) {
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
                let column = ['C', 'A', 'O'].map(|c| row.flags.contains(c));
                assert_eq!(record.flags, column, "{}: flags", row.name);
                assert_eq!(record.cycles, row.cycles.constant(), "{}: cycles", row.name);
            }
        }
    }

    /// A row that reaches a byte or a bit by its address has a shape for RAM, and no other has.
    #[test]
    fn shapes_are_where_addresses_are() {
        for (row, shape) in ROWS.iter().zip(SHAPES) {
            let addressed = row.operands.iter().any(|slot| matches!(slot.kind.name, "direct address" | "bit address"));
            assert_eq!(shape.is_some(), addressed, "{}", row.name);
        }
    }
}
