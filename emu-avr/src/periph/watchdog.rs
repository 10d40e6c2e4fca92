//! The watchdog (sections 11.8 and 11.9): a divider behind an oscillator of its own, whose taps time out.
//!
//! The divider is worked out from the time since it was at zero, in picoseconds, so that it keeps its place when the core's
//! clock changes. No sleep stops it.

use emu_core::NEVER;
use emu_core::state;

use super::{AvrDevice, AvrOutbox, AvrSignal};

/// The register.
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
/// Picoseconds in a second.
const SECOND_PS: u128 = 1_000_000_000_000;

/// What differs between the watchdogs of the family: one of the constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchdogKind {
    /// Picoseconds of a clock of the oscillator.
    clock_ps: u64,
    /// Clocks of the shortest time-out, WDP = 0; every further one is twice as long.
    shortest: u64,
    /// The highest WDP; reserved ones count as this.
    longest: u8,
    /// The bits of WDP in the register.
    wdp: u8,
    /// There is an interrupt, and WDRF forces WDE.
    interrupt: bool,
    /// WDP can be written at any time.
    free_wdp: bool,
}

impl WatchdogKind {
    /// ATmega48, 88, 168, 328 and their relatives: 128 kHz, 2K to 1024K clocks (table 11-2).
    pub const MEGA48: WatchdogKind =
        WatchdogKind { clock_ps: 7_812_500, shortest: 2_048, longest: 9, wdp: 0x27, interrupt: true, free_wdp: false };
    /// ATmega8, 64, 128 and 162 (Atmel 2486, 2490, 2467, 2513, watchdog timer): 1 MHz, 16K to 2048K clocks, no interrupt.
    /// These are safety levels 1 and, with the fuse WDTON, 2.
    pub const MEGA8: WatchdogKind = WatchdogKind {
        clock_ps: 1_000_000,
        shortest: 16_384,
        longest: 7,
        wdp: 0x07,
        interrupt: false,
        free_wdp: false,
    };
    /// ATmega16 and 32 (Atmel 2466 and 2503, watchdog timer), which have no fuse WDTON: WDP needs no sequence. So it is on
    /// ATmega64, 128 and 162 in safety level 0, with the fuse M103C or M161C.
    pub const MEGA16: WatchdogKind = WatchdogKind { free_wdp: true, ..WatchdogKind::MEGA8 };

    /// Picoseconds of the time-out `wdp`.
    fn period(self, wdp: u8) -> u128 {
        (u128::from(self.clock_ps) * u128::from(self.shortest)) << wdp
    }
}

/// The watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrWatchdog {
    kind: WatchdogKind,
    /// The fuse WDTON is programmed.
    always_on: bool,
    /// WDRF is set.
    forced: bool,
    /// The chip is in reset: the count stays at zero.
    held: bool,
    /// The register without WDCE.
    wdtcsr: u8,
    /// The edge at which WDCE is cleared; it is set before that. 0 where it is not.
    window: u64,
    hz: u64,
    /// At the edge `from` the divider had counted for `counted` picoseconds.
    from: u64,
    counted: u64,
    /// Time-outs up to this edge are done with.
    served: u64,
    /// The edge at which WDIF was set last.
    flagged: u64,
}

state! {
    AvrWatchdog { forced, held, wdtcsr, window, hz, from, counted, served, flagged } stays { kind, always_on }
    if |of, now| of.hz != 0 && ![of.hz, of.counted].contains(&NEVER) && of.from.max(of.served) <= now + 1
}

impl AvrWatchdog {
    /// The watchdog after power-on at the edge 0, with `hz` cycles to a second (0 counts as 1). `always_on` is the fuse WDTON
    /// programmed: WDE is always 1 and WDIE 0.
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

    /// WDRF is `on` from the edge `t` on: while it is set, so is WDE (11.9.2), which stays set when it goes. Chips without the
    /// interrupt do not do this. To be told before [`AvrDevice::reset`] where a reset changes WDRF.
    pub fn set_forced_on(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.change_setup(t, out, |watchdog| watchdog.forced = on && watchdog.kind.interrupt);
    }

    /// WDR: the divider is cleared at the edge `t` that ends the cycle of the instruction.
    pub fn restart(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.clear_counter(t);
    }

    /// The chip is in reset, start-up time included (`on`), or leaves it at the edge `t`: it counts from there (11.2, 11.8).
    pub fn hold(&mut self, on: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.held = on;
        self.clear_counter(t);
    }

    /// It counts: WDE or WDIE is set.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.wdtcsr & (WDE | WDIE) != 0
    }

    fn clear_counter(&mut self, t: u64) {
        (self.from, self.counted, self.served) = (t, 0, t);
    }

    /// Changes the register or what overrides it, at `t`. The divider stands at zero while the watchdog is off.
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

    /// Picoseconds of the time-out that WDP says.
    fn period(&self) -> u128 {
        let wdp = self.wdtcsr & self.kind.wdp;
        self.kind.period((wdp & 7 | wdp >> 5 << 3).min(self.kind.longest))
    }

    /// Picoseconds that the divider has counted at the edge `t`.
    fn elapsed(&self, t: u64) -> u128 {
        u128::from(self.counted) + u128::from(t.saturating_sub(self.from)) * SECOND_PS / u128::from(self.hz)
    }

    /// The first edge after `served` by which the divider has gone over a multiple of the period.
    fn timeout_cycle(&self) -> u64 {
        if !self.is_running() || self.held {
            return NEVER;
        }
        let period = self.period();
        self.cycle_of((self.elapsed(self.served) / period + 1) * period)
    }

    /// The first edge by which the divider has counted for so many picoseconds.
    fn cycle_of(&self, elapsed: u128) -> u64 {
        let left = elapsed.saturating_sub(u128::from(self.counted));
        let cycles = left.saturating_mul(u128::from(self.hz)).div_ceil(SECOND_PS);
        u64::try_from(cycles).map_or(NEVER, |cycles| self.from.saturating_add(cycles))
    }

    /// Time-outs up to `t` do no more than set WDIF once more.
    fn repeat(&mut self, t: u64) {
        let period = self.period();
        let last = self.cycle_of(self.elapsed(t) / period * period);
        if last > self.served {
            self.flagged = last;
        }
        self.served = t;
    }

    /// The next time-out leaves WDIF set, and not a reset behind it: there is an interrupt, and it was taken where a reset is
    /// to follow (table 11-1).
    const fn is_interrupt_mode(&self) -> bool {
        self.wdtcsr & WDIE != 0 && self.wdtcsr & (WDE | WDIF) != WDE | WDIF
    }

    /// WDIF is set, and no time-out will do more than that.
    const fn is_change_pending(&self) -> bool {
        self.is_interrupt_mode() && self.wdtcsr & WDIF != 0
    }
}

impl AvrDevice for AvrWatchdog {
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
                // One reset is enough, whenever it is done.
                out.push(AvrSignal::Reset { t: at });
                self.served = t;
            }
        }
        if t > self.served {
            self.repeat(t);
        }
    }

    fn next_cycle(&self) -> u64 {
        if self.is_change_pending() { NEVER } else { self.timeout_cycle() }
    }

    /// Interrupt 0: time-out.
    fn interrupt_requests(&self) -> u8 {
        u8::from(self.wdtcsr & (WDIF | WDIE) == WDIF | WDIE)
    }

    /// WDIF is cleared, and WDIE too where a reset is to follow (11.9.2).
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

    /// The sequence of 11.8: WDCE and WDE together open a window of four cycles, in which a write without WDCE sets WDE and WDP.
    /// WDE can be set at any time.
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
            // What is set at the very edge of the write stays set.
            if value & WDIF != 0 && watchdog.flagged != t {
                watchdog.wdtcsr &= !WDIF;
            }
        });
    }

    fn reset(&mut self, t: u64, _out: &mut AvrOutbox) {
        self.wdtcsr = if self.forced || self.always_on { WDE } else { 0 };
        self.window = 0;
        self.clear_counter(t);
    }

    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
    }

    /// Time-outs up to `t` that are noticed must have been run. 0 counts as 1.
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        self.run_due(t, &mut AvrOutbox::new());
        // The divider counts modulo its longest time-out, of which all others are parts.
        self.counted = u64::try_from(self.elapsed(t) % self.kind.period(self.kind.longest)).unwrap_or(0);
        (self.from, self.served, self.hz) = (t, t, hz.max(1));
    }

    fn steady_until(&self, _reg: WatchdogRegister, t: u64) -> u64 {
        let window = if t < self.window { self.window } else { NEVER };
        window.min(self.next_cycle()).max(t)
    }
}
