//! The chip as the core and the run loop access it: registers, interrupts, inputs from outside, and what
//! keeps the chip awake.

use emu_core::RegisterRead;
use std::convert::Infallible;

use emu_core::cpu::{Bus, BusEffect, NEVER, ResetCause};
use emu_core::external_io::{EventLog, OutsideInput};
use emu_core::pins::{CycleTime, PinId, PinState};

use super::{Mcs51Soc, power, unit_index};
use crate::periph::Device;
use crate::periph::map::sfr;

impl Bus for Mcs51Soc {
    type Request = Infallible;

    fn read(&mut self, reg: u16, now: u64) -> RegisterRead {
        let due = self.next_due() <= now;
        self.run(now);
        let addr = reg as u8;
        if is_counter_register(addr) {
            self.sync_timers(self.to_oscillator_time(now));
        }
        let hold = self.readings.read_holds_interrupts && matches!(addr, sfr::IE | sfr::IP);
        let wake =
            BusEffect(if due { BusEffect::RECHECK.0 } else { 0 } | if hold { BusEffect::HOLD_INTERRUPTS.0 } else { 0 });
        RegisterRead { value: self.read_sfr(addr), effect: wake }
    }

    fn read_latch(&mut self, reg: u16, now: u64) -> RegisterRead {
        match port_of(reg as u8).filter(|&port| !self.is_port_missing(port)) {
            Some(port) => RegisterRead { value: self.ports.latch(port), effect: BusEffect::NONE },
            None => self.read(reg, now),
        }
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        let mut soc = self.clone();
        soc.run(now);
        soc.sync_timers(soc.to_oscillator_time(now));
        soc.read_sfr(reg as u8)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        self.write_bits(reg, 0xFF, value, now)
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect {
        let due = self.next_due() <= now;
        self.run(now);
        let t = self.to_oscillator_time(now);
        let addr = reg as u8;
        if let Some(port) = port_of(addr) {
            // A user can write while the oscillator is stopped; events have the time of the machine cycle.
            let ahead = now.saturating_sub(self.power.stopped_at(now));
            self.stopped_cycles += ahead;
            let quiet = self.write_port(port, mask, value, t);
            self.stopped_cycles -= ahead;
            return if quiet && !due { BusEffect::NONE } else { BusEffect::RECHECK };
        }
        let logged = self.log.len();
        self.sync_timers(t);
        self.write_sfr(addr, mask, value, t);
        self.update_deadline();
        self.next_interrupt_boundary = self.next_interrupt(t);
        // The core need not check before its next deadline unless something is due sooner.
        let sooner =
            self.next_due().min(self.next_interrupt_boundary.saturating_add(self.stopped_cycles)) < self.core_deadline;
        let seen = sooner || due || self.log.len() != logged || addr == sfr::PCON;
        match addr {
            sfr::IE | sfr::IP => BusEffect(BusEffect::RECHECK.0 | BusEffect::HOLD_INTERRUPTS.0),
            _ if seen => BusEffect::RECHECK,
            _ => BusEffect::NONE,
        }
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(now);
        self.core_deadline = self.next_due();
        if self.power.is_core_stopped() {
            return self.core_deadline;
        }
        let t = self.to_oscillator_time(now);
        if self.next_interrupt_boundary <= t {
            self.sync_boundary(t);
            self.next_interrupt_boundary = self.next_interrupt(t);
        }
        self.core_deadline = self.core_deadline.min(self.next_interrupt_boundary.saturating_add(self.stopped_cycles));
        self.core_deadline
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.next_due() <= now { now } else { self.sfr_steady_until(reg as u8, now) }
    }

    fn pending_interrupt(&self, now: u64) -> Option<u8> {
        if self.next_due() <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.pending_interrupt(now);
        }
        let t = self.to_oscillator_time(now);
        if self.next_interrupt_boundary > t || self.power.is_core_stopped() {
            return None;
        }
        if self.timers_synced_to < t {
            let mut soc = self.clone();
            soc.sync_timers(t);
            return soc.interrupt_to_serve(t);
        }
        self.interrupt_to_serve(t)
    }

    fn acknowledge_interrupt(&mut self, vector: u8, now: u64) {
        self.run(now);
        let t = self.to_oscillator_time(now);
        self.sync_timers(t);
        self.pcon &= !power::IDL;
        self.schedule.touch(unit_index::WATCHDOG);
        self.watchdog.restart_clock(t, &mut self.out);
        self.enter(vector);
        self.update_deadline();
        self.next_interrupt_boundary = 0;
    }

    fn can_wake(&self, interrupts_enabled: bool) -> bool {
        let _ = interrupts_enabled;
        self.can_wake_up()
    }

    fn is_busy(&self) -> bool {
        let clock = self.timer2.next_deadline();
        self.serial.is_busy() || clock != NEVER || self.drives.next_cycle() != NEVER || !self.edges.is_empty()
    }

    fn is_core_stopped(&self) -> bool {
        self.power.is_core_stopped() || self.pcon & power::IDL != 0
    }

    #[inline]
    fn requested_reset(&mut self, _: u64) -> Option<ResetCause> {
        self.power.requested.take()
    }

    fn pins(&self) -> &[PinState] {
        self.ports.pins()
    }

    fn has_contention(&self, pin: PinId) -> bool {
        self.ports.has_contention(pin)
    }

    /// Models levels only.
    fn queue_input(&mut self, at: CycleTime, now: u64, input: OutsideInput) -> bool {
        let OutsideInput::Level(pin, level) = input else { return false };
        self.run(now);
        self.drives.push(at.cycle.max(now), (pin, level));
        self.update_deadline();
        self.run(now);
        true
    }

    fn byte_in_stop_bit(&self) -> Option<u8> {
        self.serial.port().byte_in_stop_bit()
    }

    #[inline]
    fn event_log(&mut self) -> &mut EventLog {
        &mut self.log
    }

    fn normalize(&mut self, now: u64) {
        self.log = EventLog::OFF;
        self.run(now);
        let t = self.to_oscillator_time(now);
        let before = t.saturating_sub(1);
        if self.timers_synced_to < before {
            self.sync_timers(before);
        }
        self.schedule.touch(unit_index::SERIAL);
        self.serial.run_due(before, &mut self.out);
        self.timers.normalize(t);
        self.timer2.normalize(t);
        self.update_deadline();
    }
}

/// Whether a register depends on the counts of timers.
const fn is_counter_register(addr: u8) -> bool {
    matches!(addr, sfr::TCON..=sfr::TH1 | sfr::T2CON..=sfr::TH2)
}

/// The number of the port at a direct address.
const fn port_of(addr: u8) -> Option<usize> {
    match addr {
        sfr::P0 => Some(0),
        sfr::P1 => Some(1),
        sfr::P2 => Some(2),
        sfr::P3 => Some(3),
        _ => None,
    }
}
