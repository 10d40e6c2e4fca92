//! The state of the core, and access to its registers by direct address.

use emu_core::countdown::Countdown;

use crate::periph::map::sfr;

/// The state of the core that every instruction accesses. Bytes and flags have a word each; as adjacent bytes
/// the compiler would keep them packed in one host register.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoreRegisters {
    /// Program counter; it can exceed FFFFh until it is masked.
    pub pc: u32,
    /// Cycles and instructions.
    pub clock: Countdown,
    /// Accumulator.
    pub acc: u32,
    /// Register B.
    pub b: u32,
    /// CY, 0 or 1.
    pub cy: u32,
    /// AC, in bit 3.
    pub ac: u32,
    /// OV, in bit 7.
    pub ov: u32,
    /// RS1 and RS0 at their positions in PSW; this is also the address of R0.
    pub bank: u32,
    /// F0 and PSW.1 at their positions in PSW.
    pub user_flags: u32,
    /// Stack pointer.
    pub sp: u32,
    /// The selected data pointer.
    pub dptr: u32,
    /// The other data pointer, on chips that have two.
    pub other_dptr: u32,
    /// AUXR1.DPS: the second data pointer is selected.
    pub dps: u32,
    /// The cycle of a boundary that takes no interrupt, because RETI or a write of IE or IP precedes it.
    pub no_interrupt_at: u64,
    /// The op at `pc` needs the slow path.
    pub slow_path_requested: bool,
    /// The probe requested a stop.
    pub stop_requested: bool,
}

/// Bits of PSW that are stored unchanged.
const USER_FLAGS: u32 = 0x22;

impl CoreRegisters {
    /// State after a reset at cycle 0 (user's manual, "Reset", table of reset values).
    pub(crate) const START: CoreRegisters = CoreRegisters {
        pc: 0,
        clock: Countdown::START,
        acc: 0,
        b: 0,
        cy: 0,
        ac: 0,
        ov: 0,
        bank: 0,
        user_flags: 0,
        sp: 7,
        dptr: 0,
        other_dptr: 0,
        dps: 0,
        no_interrupt_at: u64::MAX,
        slow_path_requested: false,
        stop_requested: false,
    };

    /// Reads PSW; the parity bit is computed from the present A.
    #[inline(always)]
    pub(crate) const fn psw(&self) -> u8 {
        let parity = self.acc.count_ones() & 1;
        (self.cy << 7 | (self.ac & 8) << 3 | self.user_flags | self.bank | (self.ov & 0x80) >> 5 | parity) as u8
    }

    /// Writes PSW; P is not written, because it always follows A.
    #[inline(always)]
    pub(crate) const fn set_psw(&mut self, psw: u8) {
        let psw = psw as u32;
        self.cy = psw >> 7;
        self.ac = psw >> 3 & 8;
        self.ov = psw << 5 & 0x80;
        self.bank = psw & 0x18;
        self.user_flags = psw & USER_FLAGS;
    }

    /// Reads the register of the core at a direct address, or returns `None` if there is none. `dual` means
    /// that the chip has two data pointers.
    #[inline(always)]
    pub(crate) const fn read_core_sfr(&self, addr: u8, dual: bool) -> Option<u8> {
        let (first, second) = if self.dps == 0 { (self.dptr, self.other_dptr) } else { (self.other_dptr, self.dptr) };
        Some(match addr {
            sfr::ACC => self.acc as u8,
            sfr::B => self.b as u8,
            sfr::PSW => self.psw(),
            sfr::SP => self.sp as u8,
            sfr::DPL => first as u8,
            sfr::DPH => (first >> 8) as u8,
            sfr::DP1L if dual => second as u8,
            sfr::DP1H if dual => (second >> 8) as u8,
            sfr::AUXR1 if dual => self.dps as u8,
            _ => return None,
        })
    }

    /// Writes the register of the core at a direct address. Returns false if there is none.
    #[inline(always)]
    pub(crate) const fn write_core_sfr(&mut self, addr: u8, value: u8, dual: bool) -> bool {
        let v = value as u32;
        match addr {
            sfr::ACC => self.acc = v,
            sfr::B => self.b = v,
            sfr::PSW => self.set_psw(value),
            sfr::SP => self.sp = v,
            sfr::DPL if self.dps == 0 => self.dptr = self.dptr & 0xFF00 | v,
            sfr::DPH if self.dps == 0 => self.dptr = self.dptr & 0x00FF | v << 8,
            sfr::DPL => self.other_dptr = self.other_dptr & 0xFF00 | v,
            sfr::DPH => self.other_dptr = self.other_dptr & 0x00FF | v << 8,
            sfr::DP1L if dual && self.dps == 0 => self.other_dptr = self.other_dptr & 0xFF00 | v,
            sfr::DP1H if dual && self.dps == 0 => self.other_dptr = self.other_dptr & 0x00FF | v << 8,
            sfr::DP1L if dual => self.dptr = self.dptr & 0xFF00 | v,
            sfr::DP1H if dual => self.dptr = self.dptr & 0x00FF | v << 8,
            sfr::AUXR1 if dual => {
                if v & 1 != self.dps {
                    (self.dptr, self.other_dptr, self.dps) = (self.other_dptr, self.dptr, v & 1);
                }
            }
            _ => return false,
        }
        true
    }
}
