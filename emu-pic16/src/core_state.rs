//! The state of the core.

use emu_core::countdown::Countdown;

/// The state of the core that every instruction touches. Bytes and flags stand in words of their own: side by side they would
/// be kept packed in one host register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoreRegisters {
    /// Index of the next op: RP1:RP0 in bits 15 and 14, the program counter below, which may stand one or two behind 1FFFh.
    pub at: u32,
    /// Cycles and instructions.
    pub clock: Countdown,
    /// W.
    pub w: u32,
    /// C, 0 or 1.
    pub c: u32,
    /// DC: bit 3.
    pub dc: u32,
    /// Z: a byte that is 0.
    pub z: u32,
    /// TO and PD in their places in STATUS.
    pub timeout_bits: u32,
    /// IRP and FSR: an address of data memory.
    pub indirect_address: u32,
    /// PCLATH.
    pub pclath: u32,
    /// Place in the stack that the next push takes, modulo 8.
    pub sp: u32,
    /// The op at `pc` needs the slow path.
    pub slow_path_requested: bool,
    /// The probe asked for a stop.
    pub stop_requested: bool,
}

/// TO and PD in STATUS.
pub(crate) const TO: u32 = 0x10;
/// See [`TO`].
pub(crate) const PD: u32 = 0x08;

/// RP1:RP0 in the index of an op.
pub(crate) const BANK: u32 = 0xC000;

impl CoreRegisters {
    /// Program counter.
    #[inline(always)]
    pub(crate) const fn pc(&self) -> u32 {
        self.at & 0x1FFF
    }

    /// Sets the program counter, of which 13 bits count.
    #[inline(always)]
    pub(crate) const fn set_pc(&mut self, pc: u32) {
        self.at = self.at & BANK | pc & 0x1FFF;
    }

    /// After power-on, at cycle 0 (DS30292, table 12-6; what is unknown is 0).
    pub(crate) const START: CoreRegisters = CoreRegisters {
        at: 0,
        clock: Countdown::START,
        w: 0,
        c: 0,
        dc: 0,
        z: 1,
        timeout_bits: TO | PD,
        indirect_address: 0,
        pclath: 0,
        sp: 0,
        slow_path_requested: false,
        stop_requested: false,
    };

    /// STATUS.
    #[inline(always)]
    pub(crate) const fn status(&self) -> u8 {
        let z = ((self.z as u8 == 0) as u32) << 2;
        ((self.indirect_address & 0x100) >> 1
            | (self.at & BANK) >> 9
            | self.timeout_bits
            | z
            | self.dc >> 2 & 2
            | self.c) as u8
    }

    /// Writes IRP and RP1:RP0, as every instruction can.
    #[inline(always)]
    pub(crate) const fn set_banks(&mut self, status: u32) {
        self.indirect_address = self.indirect_address & 0xFF | (status & 0x80) << 1;
        self.at = self.at & !BANK | (status & 0x60) << 9;
    }

    /// Writes STATUS but for TO and PD, which no instruction can.
    #[inline(always)]
    pub(crate) const fn set_status(&mut self, status: u32) {
        self.set_banks(status);
        self.z = !status & 4;
        self.dc = (status & 2) << 2;
        self.c = status & 1;
    }
}
