//! The state of the core.

use emu_core::countdown::Countdown;

/// The state of the core that every instruction touches. Bytes and flags stand in words of their own: side by side they would
/// be kept packed in one host register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hot {
    /// Index of the next op: RP1:RP0 in bits 15 and 14, the program counter below, which may stand one or two behind 1FFFh.
    pub at: u32,
    /// Cycles and instructions.
    pub time: Countdown,
    /// W.
    pub w: u32,
    /// C, 0 or 1.
    pub c: u32,
    /// DC: bit 3.
    pub dc: u32,
    /// Z: a byte that is 0.
    pub z: u32,
    /// TO and PD in their places in STATUS.
    pub to_pd: u32,
    /// IRP and FSR: an address of data memory.
    pub pointer: u32,
    /// PCLATH.
    pub pclath: u32,
    /// Place in the stack that the next push takes, modulo 8.
    pub sp: u32,
    /// The op at `pc` needs the slow path.
    pub escape: bool,
    /// The probe asked for a stop.
    pub stop: bool,
}

/// TO and PD in STATUS.
pub(crate) const TO: u32 = 0x10;
/// See [`TO`].
pub(crate) const PD: u32 = 0x08;

/// RP1:RP0 in the index of an op.
pub(crate) const BANK: u32 = 0xC000;

impl Hot {
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
    pub(crate) const START: Hot = Hot {
        at: 0,
        time: Countdown::START,
        w: 0,
        c: 0,
        dc: 0,
        z: 1,
        to_pd: TO | PD,
        pointer: 0,
        pclath: 0,
        sp: 0,
        escape: false,
        stop: false,
    };

    /// STATUS.
    #[inline(always)]
    pub(crate) const fn status(&self) -> u8 {
        let z = ((self.z as u8 == 0) as u32) << 2;
        ((self.pointer & 0x100) >> 1 | (self.at & BANK) >> 9 | self.to_pd | z | self.dc >> 2 & 2 | self.c) as u8
    }

    /// Writes IRP and RP1:RP0, as every instruction can.
    #[inline(always)]
    pub(crate) const fn set_banks(&mut self, status: u32) {
        self.pointer = self.pointer & 0xFF | (status & 0x80) << 1;
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
