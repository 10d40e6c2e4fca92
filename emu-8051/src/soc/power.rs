//! Power saving and reset (user's manual, "Power-saving modes of operation", "Reset").

use emu_core::cpu::{NEVER, ResetCause};
use emu_core::pins::PinLevel;
use emu_core::state;

use super::{Mcs51Soc, unit_index};
use crate::periph::Device;
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
/// AUXR: ALE is active only during MOVX; stored, without effect here.
pub(super) const DISALE: u8 = 0x01;
/// AUXR: the watchdog pauses in idle.
pub(super) const WDIDLE: u8 = 0x10;

/// Machine cycles for which RST must be high to cause a reset ("Reset").
const RESET_CYCLES: u64 = 2;
/// Machine cycles from the release of reset to the first fetch (1 to 2 in the manual).
const RELEASE_CYCLES: u64 = 2;
/// Clocks for which the watchdog drives the reset pin high.
const PULSE_CLOCKS: u64 = 98;

/// What stops the core, in machine cycles.
#[derive(Debug, Clone, Copy)]
pub(super) struct PowerState {
    /// The cycle since which the chip is in power-down, and the external interrupt that has started to end
    /// it.
    power_down_since: Option<(u64, Option<usize>)>,
    /// The cycle at which the reset pin will have been high long enough.
    reset_at: u64,
    /// A reset that must be carried out.
    pub requested: Option<ResetCause>,
    /// The cycle until which the core is held in reset; NEVER while the reset pin is high.
    held_until: Option<u64>,
    /// The cycle at which the watchdog's pulse on the reset pin ends.
    pulse_end: u64,
}

state! {
    PowerState { power_down_since, reset_at, requested, held_until, pulse_end } if |power, _now| power.power_down_since.is_none_or(|down| down.1.is_none_or(|n| n < 2))
}

impl PowerState {
    /// The chip runs.
    pub(super) const START: PowerState =
        PowerState { power_down_since: None, reset_at: NEVER, requested: None, held_until: None, pulse_end: NEVER };

    /// Whether the oscillator is stopped.
    pub(super) const fn is_powered_down(&self) -> bool {
        self.power_down_since.is_some()
    }

    /// The machine cycle at which the oscillator stopped, or `now` if it runs.
    pub(super) const fn stopped_at(&self, now: u64) -> u64 {
        match self.power_down_since {
            Some((since, _)) => since,
            None => now,
        }
    }

    /// Whether nothing is executed and no interrupt is served, for a reason other than idle.
    pub(super) const fn is_core_stopped(&self) -> bool {
        self.power_down_since.is_some() || self.held_until.is_some()
    }

    /// The next machine cycle at which something is due here.
    pub(super) fn next(&self) -> u64 {
        self.reset_at.min(self.held_until.unwrap_or(NEVER)).min(self.pulse_end)
    }

    /// Requests the reset: the reset pin was high long enough.
    const fn request_reset(&mut self) {
        self.requested = Some(ResetCause::External);
        self.held_until = Some(NEVER);
    }

    /// Sets the level of the reset pin from the machine cycle `now` on.
    pub(super) fn set_reset_pin(&mut self, high: bool, now: u64) {
        if high {
            // A chip that powers up with the pin high executes nothing.
            self.reset_at = if now == 0 { 0 } else { now + RESET_CYCLES };
        } else {
            if self.reset_at <= now {
                self.request_reset();
            }
            self.reset_at = NEVER;
            if self.held_until == Some(NEVER) {
                self.held_until = Some(now + RELEASE_CYCLES);
            }
        }
    }
}

impl Mcs51Soc {
    /// Enters a power-saving mode after a program has written PCON at the end of cycle `t`.
    pub(super) fn enter_power_modes(&mut self, t: u64) {
        if self.pcon & PD != 0 && !self.power.is_powered_down() {
            // A level that is already present starts the wake-up immediately.
            let waking =
                (0..2usize).find(|&n| self.is_woken_by(n) && !self.ports.pin([pin::INT0, pin::INT1][n]).reads_high);
            self.power.power_down_since = Some((t + 1 + self.stopped_cycles, waking));
        } else if self.pcon & IDL != 0 && self.auxr & WDIDLE != 0 {
            self.schedule.touch(unit_index::WATCHDOG);
            self.watchdog.stop_clock(t, &mut self.out);
        }
    }

    /// Restarts the oscillator at the machine cycle `now`.
    pub(super) fn wake_oscillator(&mut self, now: u64) {
        if let Some((since, _)) = self.power.power_down_since.take() {
            self.stopped_cycles += now.saturating_sub(since);
            self.pcon &= !PD;
        }
    }

    /// Applies pin changes at the machine cycle `due` while the oscillator is stopped: RST, and on the AT89S
    /// parts the levels of INT0 and INT1. A low level starts the wake-up, and the interrupt is served when
    /// the level has ended.
    pub(super) fn run_stopped(&mut self, due: u64) {
        let t = self.to_oscillator_time(due);
        while let Some((pin, level)) = self.drives.pop_due(due) {
            let changed = self.ports.drive(pin, level, t);
            // The event has the time of the machine cycle; the oscillator is stopped, since the end of this
            // cycle if a user wrote PCON.
            let ahead = due.saturating_sub(t + self.stopped_cycles);
            self.stopped_cycles += ahead;
            self.on_pin_edge(pin, changed, t, 0);
            self.stopped_cycles -= ahead;
            if pin == pin::RST && changed.is_some() {
                self.power.set_reset_pin(level == PinLevel::High, due);
                self.sampled_levels[super::RST_INDEX] = level == PinLevel::High;
            }
        }
        for n in 0..2usize {
            let level = self.ports.pin([pin::INT0, pin::INT1][n]).reads_high;
            let armed = self.is_woken_by(n);
            let Some((_, waking)) = &mut self.power.power_down_since else { return };
            if armed && !level {
                *waking = Some(n);
            } else if *waking == Some(n) && level {
                self.wake_oscillator(due);
                let t = self.to_oscillator_time(due);
                self.interrupts.remember_request(n, t);
                self.next_interrupt_boundary = 0;
                self.sample_at = t;
                return;
            }
        }
    }

    /// Whether the external interrupt `n` can end power-down: it is enabled, level-triggered, and the chip
    /// supports it.
    fn is_woken_by(&self, n: usize) -> bool {
        self.part.is_at89s && self.interrupts.enabled() & [1, 4][n & 1] != 0 && !self.interrupts.external[n & 1].edge
    }

    /// Executes resets and ends of resets at the machine cycle `now`.
    pub(super) fn run_power(&mut self, now: u64) {
        if self.power.reset_at <= now {
            self.power.reset_at = NEVER;
            self.power.request_reset();
        }
        if self.power.pulse_end <= now {
            self.power.pulse_end = NEVER;
            self.ports.rst_high = false;
            let t = self.to_oscillator_time(now);
            self.update_pin(pin::RST, t, (PULSE_CLOCKS % 12) as u8);
        }
        if self.power.held_until.is_some_and(|until| until <= now) {
            self.power.held_until = None;
        }
    }

    /// Executes a watchdog overflow at cycle `t`: a reset, and a pulse on the reset pin.
    pub(super) fn watchdog_ran_out(&mut self, t: u64) {
        let now = t + self.stopped_cycles;
        self.power.requested = Some(ResetCause::Watchdog);
        self.power.held_until = Some(now + PULSE_CLOCKS.div_ceil(12));
        if self.auxr & DISRTO == 0 {
            self.power.pulse_end = now + PULSE_CLOCKS / 12;
            self.ports.rst_high = true;
            self.update_pin(pin::RST, t, 0);
        }
    }

    /// Whether something that is enabled can reset the chip or end its sleep without a change of a pin. For
    /// interrupts it uses the result of the last [`Bus::fire`](emu_core::Bus::fire).
    pub(super) fn can_wake_up(&self) -> bool {
        if self.power.next() != NEVER || self.power.requested.is_some() {
            return true;
        }
        if self.power.is_core_stopped() {
            return false;
        }
        self.watchdog.next_deadline() != NEVER
            || self.next_interrupt_boundary != NEVER
            || self.interrupts.enabled() & 1 << 4 != 0 && self.serial.port().scon() & REN != 0
    }
}
