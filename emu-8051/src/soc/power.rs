//! Power saving, reset and the watchdog (user's manual, "Power-saving modes of operation", "Reset"; AT89S52 data sheet,
//! "Watchdog timer", "WDT during power-down and idle").

use emu_core::cpu::{NEVER, Reset};
use emu_core::pins::Level;
use emu_core::state;

use super::Soc;
use crate::periph::map::pin;
use crate::periph::serial::REN;

/// PCON: double baud rate.
pub(super) const SMOD: u8 = 0x80;
/// PCON: power was off.
pub(super) const POF: u8 = 0x10;
/// PCON: general flags.
pub(super) const GF: u8 = 0x0C;
/// PCON: power-down.
pub(super) const PD: u8 = 0x02;
/// PCON: idle.
pub(super) const IDL: u8 = 0x01;

/// AUXR: the watchdog does not drive the reset pin.
pub(super) const DISRTO: u8 = 0x08;
/// AUXR: ALE only at MOVX; stored, and without effect here.
pub(super) const DISALE: u8 = 0x01;
/// AUXR: the watchdog rests in idle.
pub(super) const WDIDLE: u8 = 0x10;

/// Machine cycles that RST must be high for a reset ("Reset").
const RESET_CYCLES: u64 = 2;
/// Machine cycles from the release of reset to the first fetch (1 to 2 in the manual).
const RELEASE_CYCLES: u64 = 2;
/// Clocks that the watchdog drives the reset pin high.
const PULSE_CLOCKS: u64 = 98;
/// Machine cycles from a clear of the watchdog to its overflow: a 14-bit counter that reaches 3FFFh.
const WATCHDOG_CYCLES: u64 = 0x3FFF;

/// What stops the core, in machine cycles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Power {
    /// Power-down since this cycle, with the external interrupt that has begun to end it.
    down: Option<(u64, Option<usize>)>,
    /// The reset pin will have been high long enough at this cycle.
    reset_at: u64,
    /// A reset is to be carried out.
    requested: Option<Reset>,
    /// The core is held in reset until this cycle; NEVER while the reset pin is high.
    held_until: Option<u64>,
    /// The watchdog's pulse on the reset pin ends at this cycle.
    pulse_end: u64,
}

state! {
    Power { down, reset_at, requested, held_until, pulse_end } if |power, _now| power.down.is_none_or(|down| down.1.is_none_or(|n| n < 2))
}

impl Power {
    /// Running.
    pub(super) const START: Power =
        Power { down: None, reset_at: NEVER, requested: None, held_until: None, pulse_end: NEVER };

    /// The oscillator stands.
    pub(super) const fn down(&self) -> bool {
        self.down.is_some()
    }

    /// The machine cycle at which the oscillator stopped, or `now` while it runs.
    pub(super) const fn stopped_at(&self, now: u64) -> u64 {
        match self.down {
            Some((since, _)) => since,
            None => now,
        }
    }

    /// Nothing is executed and no interrupt is served, idle aside.
    pub(super) const fn stops_core(&self) -> bool {
        self.down.is_some() || self.held_until.is_some()
    }

    /// The next machine cycle at which something happens here.
    pub(super) fn next(&self) -> u64 {
        self.reset_at.min(self.held_until.unwrap_or(NEVER)).min(self.pulse_end)
    }

    /// The reset pin was high long enough.
    const fn request(&mut self) {
        self.requested = Some(Reset::External);
        self.held_until = Some(NEVER);
    }

    /// The reset pin has this level from the machine cycle `now` on.
    pub(super) fn reset_pin(&mut self, high: bool, now: u64) {
        if high {
            // Who powers up with the pin high executes nothing.
            self.reset_at = if now == 0 { 0 } else { now + RESET_CYCLES };
        } else {
            if self.reset_at <= now {
                self.request();
            }
            self.reset_at = NEVER;
            if self.held_until == Some(NEVER) {
                self.held_until = Some(now + RELEASE_CYCLES);
            }
        }
    }
}

/// The watchdog of the AT89S parts, in oscillator time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Watchdog {
    /// 1Eh was written last.
    unlocked: bool,
    /// The cycle at the end of which it was cleared, if it runs.
    cleared: Option<u64>,
    /// It rests since this cycle.
    paused: Option<u64>,
}

state! { Watchdog { unlocked, cleared, paused } if |of, _now| ![of.cleared, of.paused].contains(&Some(NEVER)) }

impl Watchdog {
    /// As after reset.
    pub(super) const OFF: Watchdog = Watchdog { unlocked: false, cleared: None, paused: None };

    /// The cycle of its overflow.
    pub(super) fn next(&self) -> u64 {
        match (self.cleared, self.paused) {
            (Some(cleared), None) => cleared + WATCHDOG_CYCLES,
            _ => NEVER,
        }
    }

    /// A program writes WDTRST at the end of cycle `t`: 1Eh and then E1h start or clear it.
    pub(super) fn write(&mut self, value: u8, t: u64) {
        if value == 0xE1 && self.unlocked {
            self.cleared = Some(t);
        }
        self.unlocked = value == 0x1E;
    }

    /// Rests from the end of cycle `t` on.
    pub(super) fn pause(&mut self, t: u64) {
        self.paused = self.paused.or(self.cleared.map(|_| t));
    }

    /// Counts on from cycle `t` on.
    pub(super) fn resume(&mut self, t: u64) {
        if let (Some(cleared), Some(paused)) = (self.cleared, self.paused.take()) {
            self.cleared = Some(cleared + t.saturating_sub(1).saturating_sub(paused));
        }
    }
}

impl Soc {
    /// True while the core does not execute: idle, power-down, held in reset.
    #[must_use]
    pub fn asleep(&self) -> bool {
        self.power.stops_core() || self.pcon & IDL != 0
    }

    /// What resets the chip, once.
    pub fn reset_requested(&mut self) -> Option<Reset> {
        self.power.requested.take()
    }

    /// A program has written PCON at the end of cycle `t`.
    pub(super) fn enter_power_modes(&mut self, t: u64) {
        if self.pcon & PD != 0 && !self.power.down() {
            // A level that is there already begins to wake it at once.
            let waking = (0..2usize).find(|&n| self.wakes_by(n) && !self.ports.pin([pin::INT0, pin::INT1][n]).high);
            self.power.down = Some((t + 1 + self.frozen, waking));
        } else if self.pcon & IDL != 0 && self.auxr & WDIDLE != 0 {
            self.watchdog.pause(t);
        }
    }

    /// The oscillator runs again from the machine cycle `now` on.
    pub(super) fn wake_oscillator(&mut self, now: u64) {
        if let Some((since, _)) = self.power.down.take() {
            self.frozen += now.saturating_sub(since);
            self.pcon &= !PD;
        }
    }

    /// Pins that change at the machine cycle `due` while the oscillator stands: RST, and on the AT89S parts INT0 and INT1 as
    /// levels. A level begins to wake the chip and the interrupt is served once it has gone.
    pub(super) fn run_stopped(&mut self, due: u64) {
        let t = self.inner(due);
        while let Some((pin, level)) = self.drives.take(due) {
            let changed = self.ports.drive(pin, level, t);
            // The event bears the machine's cycle, the oscillator's stands: since the end of this cycle where PCON was written by hand.
            let ahead = due.saturating_sub(t + self.frozen);
            self.frozen += ahead;
            self.edge(pin, changed, t, 0);
            self.frozen -= ahead;
            if pin == pin::RST && changed.is_some() {
                self.power.reset_pin(level == Level::High, due);
                self.sampled[super::RST] = level == Level::High;
            }
        }
        for n in 0..2usize {
            let level = self.ports.pin([pin::INT0, pin::INT1][n]).high;
            let armed = self.wakes_by(n);
            let Some((_, waking)) = &mut self.power.down else { return };
            if armed && !level {
                *waking = Some(n);
            } else if *waking == Some(n) && level {
                self.wake_oscillator(due);
                let t = self.inner(due);
                self.interrupts.remember(n, t);
                self.irq_at = 0;
                self.sample_at = t;
                return;
            }
        }
    }

    /// The external interrupt `n` can end power-down: enabled, by level, and on a chip that does so.
    fn wakes_by(&self, n: usize) -> bool {
        self.part.at89s && self.interrupts.enabled() & [1, 4][n & 1] != 0 && !self.interrupts.external[n & 1].edge
    }

    /// Resets and their ends at the machine cycle `now`.
    pub(super) fn run_power(&mut self, now: u64) {
        if self.power.reset_at <= now {
            self.power.reset_at = NEVER;
            self.power.request();
        }
        if self.power.pulse_end <= now {
            self.power.pulse_end = NEVER;
            self.ports.rst_high = false;
            let t = self.inner(now);
            self.settle(pin::RST, t, (PULSE_CLOCKS % 12) as u8);
        }
        if self.power.held_until.is_some_and(|until| until <= now) {
            self.power.held_until = None;
        }
    }

    /// The watchdog overflows if it is due at cycle `t`: a reset, and a pulse on the reset pin.
    pub(super) fn run_watchdog(&mut self, t: u64) {
        if self.watchdog.next() > t {
            return;
        }
        self.watchdog = Watchdog::OFF;
        let now = t + self.frozen;
        self.power.requested = Some(Reset::Watchdog);
        self.power.held_until = Some(now + PULSE_CLOCKS.div_ceil(12));
        if self.auxr & DISRTO == 0 {
            self.power.pulse_end = now + PULSE_CLOCKS / 12;
            self.ports.rst_high = true;
            self.settle(pin::RST, t, 0);
        }
    }

    /// True when something that is enabled can reset the chip or end its sleep without any pin being driven. Interrupts as
    /// [`Bus::fire`](emu_core::Bus::fire) has found them last.
    pub(super) fn wakes(&self) -> bool {
        if self.power.next() != NEVER || self.power.requested.is_some() {
            return true;
        }
        if self.power.stops_core() {
            return false;
        }
        self.watchdog.next() != NEVER
            || self.irq_at != NEVER
            || self.interrupts.enabled() & 1 << 4 != 0 && self.serial.scon() & REN != 0
    }
}
