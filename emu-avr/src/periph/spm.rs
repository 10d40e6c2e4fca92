//! Self-programming (section 27; section 26 for the ATmega48): SPMCSR, the page buffer, the lock bits.
//!
//! A command is written to SPMCSR, and the SPM or LPM that follows within a few cycles executes it. The page
//! in the model changes at the start of an erase or write; the program cannot read it until the operation is
//! over.

mod kind;

use emu_core::NEVER;
use emu_core::state;

pub use self::kind::{ConfigBytes, SpmKind};
use super::real_time_delay::RealTimeDelay;
use super::{AvrOutbox, AvrSignal, Device};

/// The register of self-programming.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpmRegister {
    SPMCSR,
}

const SPMIE: u8 = 1 << 7;
const RWWSB: u8 = 1 << 6;
const SIGRD: u8 = 1 << 5;
const RWWSRE: u8 = 1 << 4;
const BLBSET: u8 = 1 << 3;
const PGWRT: u8 = 1 << 2;
const PGERS: u8 = 1 << 1;
const SPMEN: u8 = 1;

/// Mask of the bits that select a command other than a page load. Any two of them together have no effect
/// (27.9.1).
const COMMAND_BITS: u8 = SIGRD | RWWSRE | BLBSET | PGWRT | PGERS;

/// Cycles after the write of SPMCSR in which SPM is enabled.
const COMMAND_WINDOW: u64 = 4;
/// Number of cycles by which LPM must start earlier: within three cycles (27.8.8).
const LPM_LEAD_CYCLES: u64 = 1;
/// Time of a page erase, a page write or a write of lock bits in microseconds: the middle of 3.7 to 4.5 ms
/// (table 27-6).
const WRITE_US: u32 = 4_100;
/// Value of a read that is not allowed.
const UNREADABLE: u8 = 0xFF;

/// Boot lock bits (tables 27-2 and 27-3). BLB01: SPM must not write to the application section. BLB02: LPM in
/// the boot section must not read it. BLB11 and BLB12: the same for the boot section.
const BLB01: u8 = 1 << 2;
const BLB02: u8 = 1 << 3;
const BLB11: u8 = 1 << 4;
const BLB12: u8 = 1 << 5;

/// A command in progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct PageOperation {
    span: RealTimeDelay,
    /// Lock bits after the command.
    lock: u8,
}

state! { PageOperation { span, lock } }

/// Self-programming of the program memory. All addresses are byte addresses, including those of instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SelfProgramming {
    kind: SpmKind,
    bytes: ConfigBytes,
    /// First byte address of the boot section, by BOOTSZ.
    boot: u32,
    hz: u64,
    spmie: bool,
    rwwsb: bool,
    /// SPMEN and the command bits written with it, while they are enabled or in progress.
    command: u8,
    /// Edge at which SPMEN is cleared if no SPM executes, and the last edge at which an SPM may end; 0 if
    /// SPMEN is clear.
    window: u64,
    job: Option<PageOperation>,
    /// Page buffer; empty while it is erased.
    buffer: Vec<u16>,
    /// Mask of the buffer words that have been loaded; each word can be loaded once.
    loaded: u128,
    /// Edge up to which the EEPROM is being written.
    blocked: u64,
    /// Edge up to which everything has been executed.
    now: u64,
}

state! {
    SelfProgramming { bytes, hz, spmie, rwwsb, command, window, job, buffer, loaded, blocked, now } stays { kind, boot }
    if |spm, _now| spm.hz != NEVER && (spm.buffer.is_empty() || spm.buffer.len() == spm.kind.page as usize / 2)
}

impl SelfProgramming {
    /// Returns self-programming after power-on. `boot` is the first byte address of the boot section, by
    /// BOOTSZ; the clock is `hz` Hz.
    #[must_use]
    pub fn new(kind: SpmKind, bytes: ConfigBytes, boot: u32, hz: u64) -> SelfProgramming {
        SelfProgramming {
            kind,
            bytes,
            boot,
            hz,
            spmie: false,
            rwwsb: false,
            command: 0,
            window: 0,
            job: None,
            buffer: Vec::new(),
            loaded: 0,
            blocked: 0,
            now: 0,
        }
    }

    /// Returns the lock bits, fuses, signature and calibration. Call `run_due` first.
    #[must_use]
    pub fn config_bytes(&self) -> &ConfigBytes {
        &self.bytes
    }

    /// Returns the edge at which SPMEN clears itself; 0 if it is clear. The chip passes it to the EEPROM
    /// after each write of SPMCSR, each SPM and LPM, and each change of the clock.
    #[must_use]
    pub fn busy_until(&self) -> u64 {
        self.job.map_or(self.window, |job| job.span.end())
    }

    /// Blocks commands up to the edge `until`, while the EEPROM is written, as known at `t`. SPMCSR cannot be
    /// written (27.8.5), and the content of the page buffer is lost (27.8.1).
    pub fn block_until(&mut self, until: u64, t: u64) {
        self.finish(t);
        self.blocked = until;
        if until > t {
            self.erase_buffer();
        }
    }

    /// Reports whether the byte `addr` of program memory cannot be read or executed, because its section was
    /// written and RWWSB is set (27.5).
    #[must_use]
    pub fn is_unreadable(&self, addr: u32) -> bool {
        self.rwwsb && self.wrap_flash_address(addr) < self.kind.nrww
    }

    /// Reports whether boot lock bits block interrupts during the instruction at `pc`, because the vectors
    /// are in the other section (tables 27-2 and 27-3). `ivsel` is true if the vectors are in the boot
    /// section.
    #[must_use]
    pub fn bars_interrupts(&self, pc: u32, ivsel: bool) -> bool {
        let barred = if ivsel { BLB02 } else { BLB12 };
        self.kind.boot && self.is_in_boot_section(pc) != ivsel && self.bytes.lock & barred == 0
    }

    /// Executes an SPM at `pc` that ends at the edge `t`. `z` is Z (with RAMPZ), `data` is R1:R0.
    pub fn spm(&mut self, z: u32, data: u16, pc: u32, t: u64, out: &mut AvrOutbox) {
        self.finish(t);
        if self.job.is_some() || self.window == 0 || t > self.window {
            return;
        }
        self.window = 0;
        if t < self.blocked || self.kind.boot && !self.is_in_boot_section(pc) {
            return;
        }
        match self.command & COMMAND_BITS {
            0 => self.load(z, data),
            command @ (PGERS | PGWRT) => self.start_command(command, z, t, out),
            BLBSET => {
                let lock = self.bytes.lock & (data as u8 | !self.kind.lock);
                self.job = Some(PageOperation { span: RealTimeDelay::new(WRITE_US, self.hz, t), lock });
            }
            RWWSRE => self.rwwsb = false,
            _ => {}
        }
    }

    /// Returns the byte that the LPM or ELPM at `pc`, which starts in cycle `t`, reads at `z` instead of
    /// program memory; None if it reads program memory.
    pub fn lpm(&mut self, z: u32, pc: u32, t: u64) -> Option<u8> {
        self.finish(t);
        let enabled = self.job.is_none() && t >= self.blocked && t.saturating_add(LPM_LEAD_CYCLES) < self.window;
        if enabled && self.command & (BLBSET | SIGRD) != 0 {
            self.window = 0;
            return Some(self.special_byte(z));
        }
        let (from_boot, to_boot) = (self.is_in_boot_section(pc), self.is_in_boot_section(z));
        let barred = if to_boot { BLB12 } else { BLB02 };
        let locked = self.kind.boot && from_boot != to_boot && self.bytes.lock & barred == 0;
        (locked || self.is_unreadable(z)).then_some(UNREADABLE)
    }

    /// Returns the byte at `z` outside program memory that the command selects. Reserved addresses give FFh.
    fn special_byte(&self, z: u32) -> u8 {
        let ConfigBytes { lock, fuses: [low, high, extended], signature, calibration } = self.bytes;
        match (self.command & SIGRD != 0, z & 0xFFFF) {
            (false, 0) => low,
            (false, 1) => lock,
            (false, 2) => extended,
            (false, 3) => high,
            (true, 0) => signature[0],
            (true, 1) => calibration,
            (true, 2) => signature[1],
            (true, 4) => signature[2],
            _ => UNREADABLE,
        }
    }

    fn wrap_flash_address(&self, addr: u32) -> u32 {
        addr & self.kind.flash.wrapping_sub(1)
    }

    fn is_in_boot_section(&self, addr: u32) -> bool {
        self.wrap_flash_address(addr) >= self.boot
    }

    fn erase_buffer(&mut self) {
        self.buffer = Vec::new();
        self.loaded = 0;
    }

    fn load(&mut self, z: u32, data: u16) {
        self.rwwsb = false;
        let place = (z & self.kind.page.wrapping_sub(1)) / 2;
        let bit = 1u128.checked_shl(place).unwrap_or(0);
        if self.loaded & bit == 0 {
            self.loaded |= bit;
            self.buffer.resize(self.kind.page as usize / 2, 0xFFFF);
            if let Some(word) = self.buffer.get_mut(place as usize) {
                *word = data;
            }
        }
    }

    /// Erases or writes the page that contains `z`, unless the boot lock bits forbid it.
    fn start_command(&mut self, command: u8, z: u32, t: u64, out: &mut AvrOutbox) {
        let addr = self.wrap_flash_address(z) & !self.kind.page.wrapping_sub(1);
        let barred = if self.is_in_boot_section(addr) { BLB11 } else { BLB01 };
        if self.kind.boot && self.bytes.lock & barred == 0 {
            return;
        }
        if command == PGERS {
            out.push(AvrSignal::ErasePage { addr });
        } else {
            let mut words = std::mem::take(&mut self.buffer);
            words.resize(self.kind.page as usize / 2, 0xFFFF);
            out.push(AvrSignal::WritePage { addr, words });
            self.erase_buffer();
        }
        let job = PageOperation { span: RealTimeDelay::new(WRITE_US, self.hz, t), lock: self.bytes.lock };
        if addr < self.kind.nrww {
            self.rwwsb = true;
        } else {
            out.push(AvrSignal::Stall { until: job.span.end() });
        }
        self.job = Some(job);
    }

    /// Completes the command, if it is over at `t`.
    fn finish(&mut self, t: u64) {
        self.now = self.now.max(t);
        if let Some(job) = self.job.take_if(|job| job.span.end() <= t) {
            self.bytes.lock = job.lock;
        }
    }
}

impl Device<AvrSignal> for SelfProgramming {
    type Reg = SpmRegister;

    fn run_due(&mut self, t: u64, _out: &mut AvrOutbox) {
        self.finish(t);
    }

    /// The end of a command is visible outside by its interrupt, and by the lock bits that it changes.
    fn next_deadline(&self) -> u64 {
        let ready = self.busy_until().max(self.blocked);
        let ready = if self.spmie && ready > self.now { ready } else { NEVER };
        let locks = self.job.filter(|job| job.lock != self.bytes.lock);
        ready.min(locks.map_or(NEVER, |job| job.span.end()))
    }

    /// Interrupt 0: SPM ready, while SPMEN is clear and the EEPROM is not being written.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.spmie && self.busy_until().max(self.blocked) <= self.now)
    }

    fn peek(&self, _reg: SpmRegister, t: u64) -> u8 {
        let command = if t < self.busy_until() { self.command } else { 0 };
        command | if self.spmie { SPMIE } else { 0 } | if self.rwwsb { RWWSB } else { 0 }
    }

    fn write(&mut self, reg: SpmRegister, value: u8, mask: u8, t: u64, _out: &mut AvrOutbox) {
        self.finish(t);
        if t < self.blocked {
            return;
        }
        let new = self.peek(reg, t) & !mask | value & mask;
        self.spmie = new & SPMIE != 0;
        let command = new & (COMMAND_BITS | SPMEN) & if self.kind.signature_row { 0xFF } else { !SIGRD };
        // Other combinations of bits have no effect, and neither has any write during a command.
        if self.job.is_some() || command & SPMEN == 0 || (command & COMMAND_BITS).count_ones() > 1 {
            return;
        }
        (self.command, self.window) = (command, t.saturating_add(COMMAND_WINDOW));
        if command & RWWSRE != 0 {
            self.erase_buffer();
        }
    }

    /// A command in progress is completed.
    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut AvrOutbox) {
        self.finish(t);
        if let Some(job) = self.job.take() {
            self.bytes.lock = job.lock;
        }
        (self.spmie, self.rwwsb, self.command, self.window) = (false, false, 0, 0);
        self.erase_buffer();
    }

    /// Commands have their own clock, so they continue.
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        self.finish(t);
        self.hz = hz;
        if let Some(job) = &mut self.job {
            job.span.set_clock_hz(hz, t);
        }
    }

    fn steady_until(&self, _reg: SpmRegister, t: u64) -> u64 {
        let until = self.busy_until();
        if until > t { until } else { NEVER }
    }
}
