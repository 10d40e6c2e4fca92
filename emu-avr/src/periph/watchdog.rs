//! The watchdog (data sheet 11.8 and 11.9): its own 128 kHz clock as a rational of the system clock, the timed sequence,
//! interrupt and reset.

use emu_core::NEVER;

/// Clock of the watchdog in Hz (typical, data sheet 11.8).
const WATCHDOG_HZ: u128 = 128_000;

const WDIF: u8 = 1 << 7;
const WDIE: u8 = 1 << 6;
const WDCE: u8 = 1 << 4;
const WDE: u8 = 1 << 3;
/// WDP3 and WDP2 to WDP0.
const WDP: u8 = 0x27;
/// Cycles after the write of WDCE in which the next write counts.
const WINDOW: u64 = 4;

/// The watchdog.
#[derive(Debug, Clone, Copy)]
pub struct Watchdog {
    /// WDIF, WDIE, WDE, WDP; WDCE is `window`.
    bits: u8,
    /// The last cycle in which the timed sequence is open; 0 when it was not opened.
    window: u64,
    /// The cycle at which the counter was zero.
    start: u64,
    /// Time-outs up to this cycle have been served.
    served: u64,
    /// System clock in Hz.
    hz: u64,
    fired: bool,
}

impl Watchdog {
    /// The watchdog as after reset at the cycle `at`. After a watchdog reset (`forced`) it runs on with the shortest time-out.
    pub const fn new(at: u64, hz: u64, forced: bool) -> Watchdog {
        let bits = if forced { WDE } else { 0 };
        Watchdog { bits, window: 0, start: at, served: at, hz, fired: false }
    }

    /// The system clock in Hz.
    pub const fn hz(&self) -> u64 {
        self.hz
    }

    /// Sets the system clock in Hz; 0 counts as 1.
    pub fn set_hz(&mut self, hz: u64) {
        self.hz = hz.max(1);
    }

    /// WDTCSR in the cycle `now`.
    pub const fn read(&self, now: u64) -> u8 {
        self.bits | if self.open(now) { WDCE } else { 0 }
    }

    /// True while the timed sequence is open.
    pub const fn open(&self, now: u64) -> bool {
        self.window != 0 && now <= self.window
    }

    /// Writes WDTCSR in the cycle `now` (the sequence of 11.8; `forced` is WDRF, which keeps WDE set).
    pub fn write(&mut self, value: u8, now: u64, forced: bool) {
        let was_running = self.running();
        let open = self.open(now) && value & WDCE == 0;
        self.window = if value & (WDCE | WDE) == WDCE | WDE { now + WINDOW } else { 0 };
        let mut bits = self.bits & !(value & WDIF) & !WDIE | value & (WDIE | WDE);
        if open {
            bits = bits & !(WDE | WDP) | value & (WDE | WDP);
        }
        if forced {
            bits |= WDE;
        }
        self.bits = bits;
        (self.start, self.served) = if was_running { (self.start, self.served.max(now)) } else { (now + 1, now + 1) };
    }

    /// Restarts the count, as WDR in the cycle `now` does.
    pub fn restart(&mut self, now: u64) {
        (self.start, self.served) = (now + 1, now + 1);
    }

    /// True while it counts.
    pub const fn running(&self) -> bool {
        self.bits & (WDE | WDIE) != 0
    }

    /// True when it will reset the chip in the end, whatever interrupts do.
    pub const fn resets(&self) -> bool {
        self.bits & WDE != 0
    }

    /// WDIF and WDIE are both set.
    pub const fn pending(&self) -> bool {
        self.bits & (WDIF | WDIE) == WDIF | WDIE
    }

    /// The interrupt is taken: WDIF is cleared, and WDIE too where a reset is to follow (table 11-1).
    pub fn take(&mut self) {
        self.bits &= if self.resets() { !(WDIF | WDIE) } else { !WDIF };
    }

    /// The cycle of the next time-out.
    pub fn next(&self) -> u64 {
        if !self.running() || self.fired {
            return NEVER;
        }
        let hz = u128::from(self.hz);
        let counted = u128::from(self.served - self.start) * WATCHDOG_HZ / hz;
        let period = self.period();
        let cycles = ((counted / period + 1) * period * hz).div_ceil(WATCHDOG_HZ);
        u64::try_from(cycles).map_or(NEVER, |cycles| self.start.saturating_add(cycles))
    }

    /// The time-out that is due at the cycle `at`: the interrupt, or a reset when there is none or nobody took the last one.
    pub fn fire(&mut self, at: u64) {
        self.served = at;
        if self.bits & WDIE != 0 && !(self.resets() && self.bits & WDIF != 0) {
            self.bits |= WDIF;
        } else {
            self.fired = true;
        }
    }

    /// True once after a time-out that resets the chip.
    pub fn reset_requested(&mut self) -> bool {
        std::mem::take(&mut self.fired)
    }

    /// Watchdog clocks in a time-out (table 11-2); reserved settings count as the longest.
    fn period(&self) -> u128 {
        let wdp = (self.bits & 0x07) | (self.bits & 0x20) >> 2;
        2048 << wdp.min(9)
    }
}
