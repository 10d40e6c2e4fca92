//! The watchdog (sections 11.8 and 11.9): a divider after its own oscillator, with one tap for each time-out.
//!
//! The divider is computed from the time since it was zero, in picoseconds, so it keeps its value when the
//! core's clock changes. No sleep mode stops it.

use emu_core::NEVER;
use emu_core::state;

use super::{AvrOutbox, AvrSignal, Device};

/// The register of the watchdog.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchdogRegister {
    /// WDTCR on chips without the interrupt; WDCE is WDTOE on ATmega16 and 32.
    WDTCSR,
}

const WDIF: u8 = 1 << 7;
const WDIE: u8 = 1 << 6;
const WDCE: u8 = 1 << 4;
const WDE: u8 = 1 << 3;

/// Cycles for which WDCE stays set.
const UNLOCK_CYCLES: u64 = 4;
/// Picoseconds per second.
const SECOND_PS: u128 = 1_000_000_000_000;

/// Variant of the watchdog of a chip: one of the constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchdogKind {
    /// Period of the watchdog oscillator in picoseconds.
    clock_ps: u64,
    /// Clocks of the shortest time-out, WDP = 0; each further value of WDP doubles it.
    shortest: u64,
    /// Highest value of WDP; reserved values act like it.
    longest: u8,
    /// Mask of the bits of WDP in the register.
    wdp: u8,
    /// True if there is an interrupt, and WDRF forces WDE.
    interrupt: bool,
    /// True if WDP can be written at any time.
    free_wdp: bool,
}

impl WatchdogKind {
    /// ATmega48, 88, 168, 328 and related chips: 128 kHz, 2K to 1024K clocks (table 11-2).
    pub const MEGA48: WatchdogKind =
        WatchdogKind { clock_ps: 7_812_500, shortest: 2_048, longest: 9, wdp: 0x27, interrupt: true, free_wdp: false };
    /// ATmega8, 64, 128 and 162 (Atmel 2486, 2490, 2467, 2513, watchdog timer): 1 MHz, 16K to 2048K clocks,
    /// no interrupt. This is safety level 1 or, with the fuse WDTON, 2.
    pub const MEGA8: WatchdogKind = WatchdogKind {
        clock_ps: 1_000_000,
        shortest: 16_384,
        longest: 7,
        wdp: 0x07,
        interrupt: false,
        free_wdp: false,
    };
    /// ATmega16 and 32 (Atmel 2466 and 2503, watchdog timer), which have no fuse WDTON: WDP needs no timed
    /// sequence. The same holds for ATmega64, 128 and 162 in safety level 0, with the fuse M103C or M161C.
    pub const MEGA16: WatchdogKind = WatchdogKind { free_wdp: true, ..WatchdogKind::MEGA8 };

    /// Returns the time-out for `wdp` in picoseconds.
    fn period(self, wdp: u8) -> u128 {
        (u128::from(self.clock_ps) * u128::from(self.shortest)) << wdp
    }
}

/// The watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrWatchdog {
    kind: WatchdogKind,
    /// True if the fuse WDTON is programmed.
    always_on: bool,
    /// True if WDRF is set.
    forced: bool,
    /// True while the chip is in reset: the counter stays at zero.
    held: bool,
    /// The register without WDCE.
    wdtcsr: u8,
    /// Edge at which WDCE is cleared; before it, WDCE is set. 0 if WDCE is not set.
    window: u64,
    hz: u64,
    /// Reference edge, and the picoseconds that the divider had counted at that edge.
    from: u64,
    counted: u64,
    /// Edge up to which time-outs have been handled.
    served: u64,
    /// Edge at which WDIF was last set.
    flagged: u64,
}

state! {
    AvrWatchdog { forced, held, wdtcsr, window, hz, from, counted, served, flagged } stays { kind, always_on }
    if |of, now| of.hz != 0 && ![of.hz, of.counted].contains(&NEVER) && of.from.max(of.served) <= now + 1
}

impl AvrWatchdog {
    /// Returns the watchdog after power-on at the edge 0, with a core clock of `hz` Hz (0 counts as 1).
    /// `always_on` means that the fuse WDTON is programmed: WDE is always 1 and WDIE 0.
    #[must_use]
    pub fn new(kind: WatchdogKind, always_on: bool, hz: u64) -> AvrWatchdog {
        AvrWatchdog {
            kind,
            always_on,
            forced: false,
            held: false,
            wdtcsr: if always_on { WDE } else { 0 },
            window: 0,
            hz: hz.max(1),
            from: 0,
            counted: 0,
            served: 0,
            flagged: 0,
        }
    }

    /// Sets whether WDRF is set, from the edge `t` on. While WDRF is set, WDE is set too (11.9.2), and WDE
    /// stays set afterwards. Has no effect on chips without the interrupt. Call it before
    /// [`Device::reset`] if a reset changes WDRF.
    pub fn set_forced_on(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.change_setup(t, out, |watchdog| watchdog.forced = on && watchdog.kind.interrupt);
    }

    /// Executes a WDR: clears the divider at the edge `t`, which ends the cycle of the instruction.
    pub fn restart(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.clear_counter(t);
    }

    /// Holds the watchdog while the chip is in reset, including the start-up time (`on`), or releases it at
    /// the edge `t`; then it counts from zero (11.2, 11.8).
    pub fn hold(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.held = on;
        self.clear_counter(t);
    }

    /// Reports whether the watchdog counts: WDE or WDIE is set.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.wdtcsr & (WDE | WDIE) != 0
    }

    fn clear_counter(&mut self, t: u64) {
        (self.from, self.counted, self.served) = (t, 0, t);
    }

    /// Changes the register, or what overrides it, at `t`. The divider is zero while the watchdog is off.
    fn change_setup(&mut self, t: u64, out: &mut AvrOutbox, change: impl FnOnce(&mut AvrWatchdog)) {
        self.run_due(t, out);
        let was_running = self.is_running();
        change(self);
        if self.forced || self.always_on {
            self.wdtcsr |= WDE;
        }
        if self.always_on {
            self.wdtcsr &= !WDIE;
        }
        if was_running {
            self.served = t;
        } else {
            self.clear_counter(t);
        }
    }

    /// Returns the time-out that WDP selects, in picoseconds.
    fn period(&self) -> u128 {
        let wdp = self.wdtcsr & self.kind.wdp;
        self.kind.period((wdp & 7 | wdp >> 5 << 3).min(self.kind.longest))
    }

    /// Returns the picoseconds that the divider has counted at the edge `t`.
    fn elapsed(&self, t: u64) -> u128 {
        u128::from(self.counted) + u128::from(t.saturating_sub(self.from)) * SECOND_PS / u128::from(self.hz)
    }

    /// Returns the first edge after `served` at which the divider has passed a multiple of the period.
    fn timeout_cycle(&self) -> u64 {
        if !self.is_running() || self.held {
            return NEVER;
        }
        let period = self.period();
        self.cycle_of((self.elapsed(self.served) / period + 1) * period)
    }

    /// Returns the first edge at which the divider has counted `elapsed` picoseconds.
    fn cycle_of(&self, elapsed: u128) -> u64 {
        let left = elapsed.saturating_sub(u128::from(self.counted));
        let cycles = left.saturating_mul(u128::from(self.hz)).div_ceil(SECOND_PS);
        u64::try_from(cycles).map_or(NEVER, |cycles| self.from.saturating_add(cycles))
    }

    /// Handles time-outs up to `t` that only set WDIF again.
    fn repeat(&mut self, t: u64) {
        let period = self.period();
        let last = self.cycle_of(self.elapsed(t) / period * period);
        if last > self.served {
            self.flagged = last;
        }
        self.served = t;
    }

    /// Reports whether the next time-out sets WDIF and does not reset the chip: the interrupt is enabled and,
    /// if a reset follows it, the previous interrupt was taken (table 11-1).
    const fn is_interrupt_mode(&self) -> bool {
        self.wdtcsr & WDIE != 0 && self.wdtcsr & (WDE | WDIF) != WDE | WDIF
    }

    /// Reports whether WDIF is set and further time-outs only set it again.
    const fn is_change_pending(&self) -> bool {
        self.is_interrupt_mode() && self.wdtcsr & WDIF != 0
    }
}

impl Device<AvrSignal> for AvrWatchdog {
    type Reg = WatchdogRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        while !self.is_change_pending() {
            let at = self.timeout_cycle();
            if at > t || at == NEVER {
                return;
            }
            self.served = at;
            if self.is_interrupt_mode() {
                self.wdtcsr |= WDIF;
                self.flagged = at;
            } else {
                // One reset is enough, even if several time-outs have passed.
                out.push(AvrSignal::Reset { t: at });
                self.served = t;
            }
        }
        if t > self.served {
            self.repeat(t);
        }
    }

    fn next_deadline(&self) -> u64 {
        if self.is_change_pending() { NEVER } else { self.timeout_cycle() }
    }

    /// Interrupt 0: time-out.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.wdtcsr & (WDIF | WDIE) == WDIF | WDIE)
    }

    /// Clears WDIF, and WDIE too if a reset follows the interrupt (11.9.2).
    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        self.change_setup(t, out, |watchdog| {
            if irq == 0 {
                watchdog.wdtcsr &= if watchdog.wdtcsr & WDE != 0 { !(WDIF | WDIE) } else { !WDIF };
            }
        });
    }

    fn peek(&self, _reg: WatchdogRegister, t: u64) -> u8 {
        let mut watchdog = *self;
        watchdog.run_due(t, &mut AvrOutbox::new());
        watchdog.wdtcsr | if t < self.window { WDCE } else { 0 }
    }

    /// Timed sequence of 11.8: WDCE and WDE together open a window of four cycles, in which a write without
    /// WDCE changes WDE and WDP. WDE can be set at any time.
    fn write(&mut self, _reg: WatchdogRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.change_setup(t, out, |watchdog| {
            let old = watchdog.wdtcsr;
            let value = value & mask | old & !(mask | WDIF);
            let open = watchdog.window != 0 && t <= watchdog.window && value & WDCE == 0;
            watchdog.window = if value & (WDCE | WDE) == WDCE | WDE { t.saturating_add(UNLOCK_CYCLES) } else { 0 };
            let mut free = 0;
            if watchdog.kind.interrupt {
                free |= WDIE;
            }
            if open {
                free |= WDE;
            }
            if open || watchdog.kind.free_wdp {
                free |= watchdog.kind.wdp;
            }
            watchdog.wdtcsr = old & !free | value & (free | WDE);
            // A flag set at the very edge of the write stays set.
            if value & WDIF != 0 && watchdog.flagged != t {
                watchdog.wdtcsr &= !WDIF;
            }
        });
    }

    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut AvrOutbox) {
        self.wdtcsr = if self.forced || self.always_on { WDE } else { 0 };
        self.window = 0;
        self.clear_counter(t);
    }

    /// Call `run_due` first, so that no time-out is lost. 0 Hz counts as 1.
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        self.run_due(t, &mut AvrOutbox::new());
        // The divider counts modulo its longest time-out, which is a multiple of all others.
        self.counted = u64::try_from(self.elapsed(t) % self.kind.period(self.kind.longest)).unwrap_or(0);
        (self.from, self.served, self.hz) = (t, t, hz.max(1));
    }

    fn steady_until(&self, _reg: WatchdogRegister, t: u64) -> u64 {
        let window = if t < self.window { self.window } else { NEVER };
        window.min(self.next_deadline()).max(t)
    }
}
