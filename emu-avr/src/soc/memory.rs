//! Memory accesses that depend on the chip: program memory with SPMCSR and RAMPZ, RAM below 100h, and
//! registers that SBI and CBI write as a whole.

use super::{AvrSoc, regs};
use crate::chips::unit_index;
use crate::periph::SignalReceiver;

/// Lowest data address at which RAM can start.
pub const LOW_BYTES: usize = 0x60;

/// What is written to a register.
pub(super) struct MaskedWrite {
    /// The bits that are.
    pub mask: u8,
    /// Their values.
    pub value: u8,
}

impl AvrSoc {
    /// Returns the byte address in program memory that RAMPZ and Z form.
    #[must_use]
    pub fn rampz_address(&self, z: u16) -> u32 {
        u32::from(self.rampz) << 16 | u32::from(z)
    }

    /// Increments RAMPZ, because Z has wrapped.
    pub fn count_rampz(&mut self) {
        self.rampz = (self.rampz + 1) & regs::RAMPZ;
    }

    /// Executes the SPM at the byte address `pc`, with Z and R1:R0, which ends at the edge `t`.
    pub fn store_program(&mut self, z: u16, data: u16, pc: u32, t: u64) {
        self.run(t);
        self.spm.spm(self.rampz_address(z), data, pc, t, &mut self.out);
        self.eeprom.block_until(self.spm.busy_until(), t);
        self.schedule.touched |= 1 << unit_index::SPM | 1 << unit_index::EEPROM;
        self.apply_signals(unit_index::SPM);
        self.update_deadlines();
    }

    /// Returns the byte that the LPM or ELPM at the byte address `pc`, which starts in cycle `t`, reads
    /// instead of program memory; None if it reads program memory.
    pub fn program_byte(&mut self, addr: u32, pc: u32, t: u64) -> Option<u8> {
        let byte = self.spm.lpm(addr, pc, t);
        if byte.is_some() {
            self.eeprom.block_until(self.spm.busy_until(), t);
            self.schedule.touched |= 1 << unit_index::SPM | 1 << unit_index::EEPROM;
            self.update_deadlines();
        }
        byte
    }

    /// What SBI or CBI in the cycle `now` writes, which on some chips is all of the register as it was read a
    /// cycle before, flags that read as one included.
    pub(super) fn merge_whole_register(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> MaskedWrite {
        if mask == 0xFF || !self.part.bit_writes_whole_register {
            return MaskedWrite { mask, value };
        }
        let before = now.saturating_sub(1);
        self.run(before);
        let old = self.read_register(self.register_slot(reg), before).value;
        MaskedWrite { mask: 0xFF, value: old & !mask | value & mask }
    }

    /// Returns a byte of the RAM below 100h.
    pub(super) fn low_byte(&self, addr: u8) -> u8 {
        self.low_ram.get(usize::from(addr).wrapping_sub(LOW_BYTES)).copied().unwrap_or(0)
    }

    /// Writes a byte of the RAM below 100h.
    pub(super) fn set_low_byte(&mut self, addr: u8, value: u8) {
        if let Some(byte) = self.low_ram.get_mut(usize::from(addr).wrapping_sub(LOW_BYTES)) {
            *byte = value;
        }
    }

    /// Fills the RAM below 100h, from 60h on.
    pub(crate) fn fill_low(&mut self, bytes: &[u8]) {
        self.low_ram.iter_mut().zip(bytes).for_each(|(old, &byte)| *old = byte);
    }
}
