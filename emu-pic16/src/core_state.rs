//! Registers of the core.

use emu_core::countdown::Countdown;

/// State of the core that every instruction uses. Bytes and flags have a word each; the compiler would pack
/// adjacent bytes into one host register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoreRegisters {
    /// Index of the next op: RP1:RP0 in bits 15 and 14, below them the program counter, which can be one or
    /// two past 1FFFh.
    pub bank_and_pc: u32,
    /// Counts of cycles and instructions, and the deadline.
    pub clock: Countdown,
    /// Working register W.
    pub w: u32,
    /// Carry C, 0 or 1.
    pub c: u32,
    /// Digit carry DC, in bit 3.
    pub dc: u32,
    /// Zero flag: Z is set if the low byte is 0.
    pub z: u32,
    /// TO and PD at their positions in STATUS.
    pub timeout_bits: u32,
    /// IRP and FSR: an address of data memory.
    pub indirect_address: u32,
    /// Program counter latch PCLATH.
    pub pclath: u32,
    /// Stack index that the next push uses, modulo 8.
    pub sp: u32,
    /// True if the op at `pc` needs the slow path.
    pub slow_path_requested: bool,
    /// True if the probe requested a stop.
    pub stop_requested: bool,
}

/// Mask of TO in STATUS.
pub(crate) const TO: u32 = 0x10;
/// Mask of PD in STATUS.
pub(crate) const PD: u32 = 0x08;

/// Mask of RP1:RP0 in the index of an op.
pub(crate) const BANK: u32 = 0xC000;

impl CoreRegisters {
    /// Returns the program counter.
    #[inline(always)]
    pub(crate) const fn pc(&self) -> u32 {
        self.bank_and_pc & 0x1FFF
    }

    /// Sets the program counter to the low 13 bits of `pc`.
    #[inline(always)]
    pub(crate) const fn set_pc(&mut self, pc: u32) {
        self.bank_and_pc = self.bank_and_pc & BANK | pc & 0x1FFF;
    }

    /// State after power-on, at cycle 0 (DS30292, table 12-6; unknown values are 0).
    pub(crate) const START: CoreRegisters = CoreRegisters {
        bank_and_pc: 0,
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

    /// Returns STATUS.
    #[inline(always)]
    pub(crate) const fn status(&self) -> u8 {
        let z = ((self.z as u8 == 0) as u32) << 2;
        ((self.indirect_address & 0x100) >> 1
            | (self.bank_and_pc & BANK) >> 9
            | self.timeout_bits
            | z
            | self.dc >> 2 & 2
            | self.c) as u8
    }

    /// Writes IRP and RP1:RP0, which any instruction can write.
    #[inline(always)]
    pub(crate) const fn set_banks(&mut self, status: u32) {
        self.indirect_address = self.indirect_address & 0xFF | (status & 0x80) << 1;
        self.bank_and_pc = self.bank_and_pc & !BANK | (status & 0x60) << 9;
    }

    /// Writes STATUS, except TO and PD, which no write can change.
    #[inline(always)]
    pub(crate) const fn set_status(&mut self, status: u32) {
        self.set_banks(status);
        self.z = !status & 4;
        self.dc = (status & 2) << 2;
        self.c = status & 1;
    }
}
