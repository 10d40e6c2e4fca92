//! The chip as its core accesses it: registers, interrupts, and what keeps the chip awake.

use emu_core::RegisterRead;
use emu_core::cpu::{Bus, BusEffect, NEVER, ResetCause};
use emu_core::external_io::{EventLog, OutsideInput};
use emu_core::pins::{CycleTime, PinState};

use super::memory::MaskedWrite;
use super::{AvrSoc, CoreRequest};
use crate::chips::{RegisterSlot, unit_index};
use crate::periph::usart::AvrUsart;
use crate::periph::{Device, SignalReceiver, timers, watchdog};

impl Bus for AvrSoc {
    type Request = CoreRequest;

    #[inline]
    fn read(&mut self, reg: u16, now: u64) -> RegisterRead {
        // Fast path for the flag registers that programs poll.
        if now < self.schedule.due
            && let RegisterSlot::Timer(n, timers::TimerRegister::TIFR) = self.register_slot(reg)
            && self.prr == 0
            && let Some(flags) = self.timers[usize::from(n) % 4].flags_if_quiet(now)
        {
            return RegisterRead { value: flags, effect: BusEffect::NONE };
        }
        self.read_any(reg, now)
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        if self.schedule.due <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.peek_register(soc.register_slot(reg), now);
        }
        self.peek_register(self.register_slot(reg), now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        if let RegisterSlot::Low(addr) = self.register_slot(reg) {
            self.set_low_byte(addr, value);
            return BusEffect::NONE;
        }
        self.write_bits(reg, 0xFF, value, now)
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect {
        let due = self.schedule.due <= now;
        let MaskedWrite { mask, value } = self.merge_whole_register(reg, mask, value, now);
        self.run(now);
        let (logged, asks) = (self.log.len(), self.schedule.requests);
        self.write_register(self.register_slot(reg), mask, value, now + 1);
        if self.schedule.touched != 0 {
            self.update_deadlines();
        }
        // The instruction after a write of IVSEL runs before any interrupt (12.5.1).
        if std::mem::take(&mut self.power.moved_vectors) {
            return BusEffect::HOLD_INTERRUPTS;
        }
        if due { BusEffect::RECHECK } else { self.bus_effect(logged, asks) }
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(now);
        self.core_deadline = self.schedule.due;
        self.schedule.due
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.schedule.due <= now {
            now
        } else {
            self.register_steady_until(self.register_slot(reg), now).min(self.schedule.due)
        }
    }

    fn pending_interrupt(&self, now: u64) -> Option<u8> {
        if self.schedule.due <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.first_vector;
        }
        self.first_vector
    }

    fn acknowledge_interrupt(&mut self, vector: u8, now: u64) {
        self.run(now);
        let source = usize::from(vector).checked_sub(1).and_then(|at| self.part.interrupt_sources.get(at));
        if let Some(&(number, irq)) = source {
            with_unit!(self, number, unit => unit.on_interrupt_taken(irq, now, &mut self.out));
            self.schedule.touch(number);
            self.apply_signals(number);
            self.notify_trigger(number, now);
        }
        self.update_deadlines();
    }

    fn can_wake(&self, interrupts_enabled: bool) -> bool {
        let deaf = self.power.asleep.map_or(0, |asleep| asleep.0.units_unable_to_wake());
        let waits = (0..unit_index::COUNT)
            .any(|n| deaf >> n & 1 == 0 && (self.schedule.deadlines[n] != NEVER || self.schedule.requests[n] != 0));
        let listens = self.usarts.iter().any(AvrUsart::is_receiver_enabled);
        self.watchdog.peek(watchdog::WatchdogRegister::WDTCSR, 0) & WDE != 0
            || self.power.next() != NEVER
            || self.stall != 0
            || interrupts_enabled && (waits || listens)
    }

    fn is_core_stopped(&self) -> bool {
        self.power.is_held_in_reset() || self.power.start_cycle != 0 || self.power.wake_cycle != 0 || self.stall != 0
    }

    #[inline]
    fn requested_reset(&mut self, now: u64) -> Option<ResetCause> {
        self.run(now);
        self.power.reset_request.take()
    }

    #[inline]
    fn next_request(&mut self, _: u64) -> Option<CoreRequest> {
        self.requests.pop_front()
    }

    fn is_busy(&self) -> bool {
        // Units that change pins without an enabled interrupt.
        let moves =
            |n: usize| self.schedule.deadlines[n] != NEVER && self.timers[n].peek(timers::TimerRegister::TIMSK, 0) == 0;
        let units = [unit_index::SPI, unit_index::TWI, unit_index::ADC, unit_index::EEPROM];
        self.drives.next_cycle() != NEVER
            || self.usarts.iter().any(AvrUsart::is_sending)
            || (0..4).any(moves)
            || units.iter().any(|&n| self.schedule.deadlines[n] != NEVER)
    }

    fn pins(&self) -> &[PinState] {
        self.ports.pins()
    }

    fn queue_input(&mut self, at: CycleTime, now: u64, input: OutsideInput) -> bool {
        self.run(now);
        let at = at.cycle.max(now);
        self.drives.push(at, input);
        self.schedule.due = self.schedule.due.min(at);
        self.run(now);
        true
    }

    #[inline]
    fn event_log(&mut self) -> &mut EventLog {
        &mut self.log
    }

    fn normalize(&mut self, now: u64) {
        self.log = EventLog::OFF;
        self.run(now);
        for number in 0..unit_index::COUNT {
            self.run_unit(number, now);
        }
        self.update_deadlines();
    }
}

/// Mask of WDE in WDTCSR.
const WDE: u8 = 1 << 3;
