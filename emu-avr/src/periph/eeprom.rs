//! The EEPROM (sections 8.4 and 8.6).
//!
//! A write starts only within four cycles after EEMPE was set. The calibrated oscillator times it; it
//! continues in sleep and through a reset. The cell changes at the end.

use emu_core::state;
use std::sync::Arc;

use emu_core::NEVER;

use super::real_time_delay::RealTimeDelay;
use super::{AvrOutbox, AvrSignal, Device};

/// The registers of the EEPROM.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EepromRegister {
    EEARL,
    EEARH,
    EEDR,
    EECR,
}

/// Mask of EEPM1 and EEPM0.
const EEPM: u8 = 3 << 4;
const EERIE: u8 = 1 << 3;
const EEMPE: u8 = 1 << 2;
const EEPE: u8 = 1 << 1;
const EERE: u8 = 1;

/// Cycles for which EEMPE stays set.
const UNLOCK_CYCLES: u64 = 4;
/// Cycles for which the core halts after EEPE is set.
const WRITE_HALT_CYCLES: u64 = 2;
/// Cycles for which the core halts after EERE is set.
const READ_HALT_CYCLES: u64 = 4;

/// Variant of the EEPROM of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrEepromKind {
    /// True if EEPM1 and EEPM0 exist.
    pub modes: bool,
    /// Time to erase and write a byte, in microseconds.
    pub both_us: u32,
    /// Time to erase or write only, in microseconds.
    pub half_us: u32,
}

impl AvrEepromKind {
    /// ATmega48, 88, 168, 328 and related chips (table 8-1).
    pub const MEGA48: AvrEepromKind = AvrEepromKind { modes: true, both_us: 3_400, half_us: 1_800 };
    /// ATmega8, 16, 32, 64, 128 and 162: 8,448 periods of the 1 MHz oscillator (Atmel 2486, EEPROM
    /// programming time).
    pub const MEGA8: AvrEepromKind = AvrEepromKind { modes: false, both_us: 8_448, half_us: 0 };
}

/// A write in progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct WriteOperation {
    span: RealTimeDelay,
    addr: u16,
    /// Mask of the bits of the old content that are kept.
    keep: u8,
    /// Bits that are set from EEDR.
    data: u8,
}

state! { WriteOperation { span, addr, keep, data } }

/// The EEPROM. Clones share its content until it changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrEeprom {
    kind: AvrEepromKind,
    cells: Arc<Vec<u8>>,
    hz: u64,
    addr: u16,
    data: u8,
    /// EEPM and EERIE.
    control: u8,
    /// Edge at which EEMPE is cleared; before it, EEMPE is set. 0 if EEMPE is not set.
    window: u64,
    job: Option<WriteOperation>,
    /// Edge up to which program memory is being written; 0 if it is not.
    blocked: u64,
}

state! { AvrEeprom { cells, hz, addr, data, control, window, job, blocked } stays { kind } if |eeprom, _now| eeprom.hz != NEVER }

impl AvrEeprom {
    /// Returns the EEPROM after power-on with the content `cells`, up to 64 KB, and a clock of `hz` Hz.
    #[must_use]
    pub fn new(kind: AvrEepromKind, cells: Arc<Vec<u8>>, hz: u64) -> AvrEeprom {
        AvrEeprom { kind, cells, hz, addr: 0, data: 0, control: 0, window: 0, job: None, blocked: 0 }
    }

    /// Returns the content of the cells. Call `run_due` first.
    #[must_use]
    pub fn cells(&self) -> &Arc<Vec<u8>> {
        &self.cells
    }

    /// Sets a cell from outside the chip; returns false if the cell does not exist.
    pub fn set_cell(&mut self, addr: usize, value: u8) -> bool {
        if addr >= self.cells.len() {
            return false;
        }
        if let Some(cell) = Arc::make_mut(&mut self.cells).get_mut(addr) {
            *cell = value;
        }
        true
    }

    /// Returns the edge at which the current write ends; 0 if there is none. The chip passes it to program
    /// memory after each write of EECR and each change of the clock.
    #[must_use]
    pub fn busy_until(&self) -> u64 {
        self.job.map_or(0, |job| job.span.end())
    }

    /// Returns the edge at which a cell changes, for observers outside the chip; `NEVER` if there is no
    /// write.
    #[must_use]
    pub fn changes_at(&self) -> u64 {
        self.job.map_or(NEVER, |job| job.span.end())
    }

    /// Blocks writes up to the edge `until`, while program memory is written or SPM is enabled, as known at
    /// `t`. No write starts, and the interrupt waits (8.6.3, 27.8.5).
    pub fn block_until(&mut self, until: u64, t: u64) {
        self.finish(t);
        self.blocked = until;
    }

    /// Mask of the bits of EEAR that the memory uses.
    fn addr_bits(&self) -> u16 {
        match u16::try_from(self.cells.len().saturating_sub(1)) {
            Ok(0) => 0,
            Ok(last) => u16::MAX >> last.leading_zeros(),
            Err(_) => u16::MAX,
        }
    }

    /// Returns the content of a cell; FFh if it does not exist.
    fn cell(&self, addr: u16) -> u8 {
        self.cells.get(usize::from(addr)).copied().unwrap_or(0xFF)
    }

    /// Completes the write, if it is over at `t`.
    fn finish(&mut self, t: u64) {
        if let Some(job) = self.job.take_if(|job| job.span.end() <= t) {
            self.set_cell(job.addr.into(), self.cell(job.addr) & job.keep | job.data);
        }
        if self.blocked <= t {
            self.blocked = 0;
        }
    }

    /// Starts the write that EEPM selects (table 8-1). The reserved mode neither erases nor writes.
    fn start(&mut self, t: u64) {
        let (keep, data, us) = match self.control & EEPM {
            0 => (0, self.data, self.kind.both_us),
            0x10 => (0, 0xFF, self.kind.half_us),
            0x20 => (self.data, 0, self.kind.half_us),
            _ => (0xFF, 0, self.kind.half_us),
        };
        self.job = Some(WriteOperation { span: RealTimeDelay::new(us, self.hz, t), addr: self.addr, keep, data });
    }

    fn write_eecr(&mut self, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        let ones = value & mask;
        let open = self.window != 0 && t <= self.window;
        // EEPM is updated before EEPE takes effect, but not during a write.
        let bits = mask & EERIE | if self.kind.modes && self.job.is_none() { mask & EEPM } else { 0 };
        self.control = self.control & !bits | value & bits;
        if mask & EEMPE != 0 {
            self.window = if ones & EEMPE != 0 { t.saturating_add(UNLOCK_CYCLES) } else { 0 };
        }
        if self.job.is_some() {
            return;
        }
        if ones & EEPE != 0 && open && self.blocked == 0 {
            self.start(t);
            out.push(AvrSignal::Stall { until: t.saturating_add(WRITE_HALT_CYCLES) });
        } else if ones & EERE != 0 {
            self.data = self.cell(self.addr);
            out.push(AvrSignal::Stall { until: t.saturating_add(READ_HALT_CYCLES) });
        }
    }
}

impl Device<AvrSignal> for AvrEeprom {
    type Reg = EepromRegister;

    fn run_due(&mut self, t: u64, _out: &mut AvrOutbox) {
        self.finish(t);
    }

    /// Only the interrupt makes the end of a write visible outside; otherwise the content is computed when it
    /// is read.
    fn next_deadline(&self) -> u64 {
        match self.busy_until().max(self.blocked) {
            0 => NEVER,
            _ if self.control & EERIE == 0 => NEVER,
            ready => ready,
        }
    }

    /// Interrupt 0: EEPROM ready, while no write is in progress.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.control & EERIE != 0 && self.job.is_none() && self.blocked == 0)
    }

    fn peek(&self, reg: EepromRegister, t: u64) -> u8 {
        let [high, low] = self.addr.to_be_bytes();
        match reg {
            EepromRegister::EEARL => low,
            EepromRegister::EEARH => high,
            EepromRegister::EEDR => self.data,
            EepromRegister::EECR => {
                let window = if t < self.window { EEMPE } else { 0 };
                let busy = if t < self.busy_until() { EEPE } else { 0 };
                self.control | window | busy
            }
        }
    }

    fn write(&mut self, reg: EepromRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.finish(t);
        let [high, low] = self.addr.to_be_bytes();
        let merge = |old: u8| old & !mask | value & mask;
        let addr = match reg {
            EepromRegister::EECR => return self.write_eecr(value, mask, t, out),
            EepromRegister::EEDR => {
                self.data = merge(self.data);
                return;
            }
            EepromRegister::EEARL => [high, merge(low)],
            EepromRegister::EEARH => [merge(high), low],
        };
        // EEAR cannot be changed during a write (8.6.3).
        if self.job.is_none() {
            self.addr = u16::from_be_bytes(addr) & self.addr_bits();
        }
    }

    /// EEAR keeps its value, and a write in progress continues with its mode (initial values of 8.6, 8.4.2).
    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut AvrOutbox) {
        self.finish(t);
        self.control &= if self.job.is_some() { EEPM } else { 0 };
        (self.data, self.window) = (0, 0);
    }

    /// Writes have their own clock, so they continue.
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        self.finish(t);
        self.hz = hz;
        if let Some(job) = &mut self.job {
            job.span.set_clock_hz(hz, t);
        }
    }

    fn steady_until(&self, reg: EepromRegister, t: u64) -> u64 {
        match reg {
            EepromRegister::EECR => {
                [self.window, self.busy_until()].into_iter().filter(|&end| end > t).min().unwrap_or(NEVER)
            }
            _ => NEVER,
        }
    }
}
