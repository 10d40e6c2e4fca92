//! [`Device`] for the external interrupts.

use emu_core::NEVER;

use super::{AvrSignal, ExternalChange, ExternalInterrupts, ExternalRegister};
use crate::periph::{AvrLine, AvrOutbox, Device};

impl Device<AvrSignal> for ExternalInterrupts {
    type Reg = ExternalRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
    }

    fn next_deadline(&self) -> u64 {
        let ints = (self.eimsk | u8::from(self.has_flag_listener)) & !self.eifr;
        let groups = self.pcicr & !self.pcifr;
        let noticed = |change: &ExternalChange| self.found(change) & ints != 0 || change.groups & groups != 0;
        self.pending_changes().find(noticed).map_or(NEVER, |change| change.at)
    }

    /// Interrupt `n` is INT`n`, for the inputs that exist; the interrupts of the pin groups follow. While the
    /// I/O clock is stopped, the result is what requests a wake-up.
    fn interrupt_requests(&self) -> u8 {
        let ints = self.eimsk & (self.eifr | self.low() & !self.pins.int);
        let asleep = match self.stopped {
            Some(_) => self
                .pending_changes
                .iter()
                .flatten()
                .fold(self.groups_changed(), |groups, change| groups | change.groups),
            None => 0,
        };
        let groups = self.pcicr & (self.pcifr | asleep);
        ints | (u16::from(groups) << self.kind.ints) as u8
    }

    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        match irq.checked_sub(self.kind.ints) {
            None => self.eifr &= !(1 << irq),
            Some(group) => self.pcifr &= !1u8.checked_shl(group.into()).unwrap_or(0),
        }
    }

    fn peek(&self, reg: ExternalRegister, t: u64) -> u8 {
        if self.pending_changes().next().is_none_or(|change| change.at > t) {
            return self.register_value(reg);
        }
        let mut external = self.clone();
        external.advance(t, &mut AvrOutbox::new());
        external.register_value(reg)
    }

    fn write(&mut self, reg: ExternalRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        let merge = |old: u8, there: u8| old & !(mask & there) | value & mask & there;
        // A flag set at the very edge of the write stays set.
        let (ints, groups) = if self.last_flagged.0 == t { (self.last_flagged.1, self.last_flagged.2) } else { (0, 0) };
        match reg {
            ExternalRegister::EICRA => self.write_isc(value, mask, 0, t, out),
            ExternalRegister::EICRB => self.write_isc(value, mask, 4, t, out),
            ExternalRegister::EIMSK => self.eimsk = merge(self.eimsk, self.kind.int_mask()),
            ExternalRegister::EIFR => self.eifr &= !(value & mask) | ints,
            ExternalRegister::PCICR => self.pcicr = merge(self.pcicr, self.kind.groups()),
            ExternalRegister::PCIFR => self.pcifr &= !(value & mask) | groups,
            ExternalRegister::PCMSK0 => self.pcmsk[0] = merge(self.pcmsk[0], self.kind.masks[0]),
            ExternalRegister::PCMSK1 => self.pcmsk[1] = merge(self.pcmsk[1], self.kind.masks[1]),
            ExternalRegister::PCMSK2 => self.pcmsk[2] = merge(self.pcmsk[2], self.kind.masks[2]),
            ExternalRegister::PCMSK3 => self.pcmsk[3] = merge(self.pcmsk[3], self.kind.masks[3]),
        }
    }

    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        let set = |bits: u8, bit: u8| if high { bits | bit } else { bits & !bit };
        match line {
            AvrLine::Int(n) => {
                let bit = 1u8.checked_shl(n.into()).unwrap_or(0) & self.kind.int_mask();
                self.change_and_detect(t, out, |external| external.pins.int = set(external.pins.int, bit));
            }
            AvrLine::Pc(n) => {
                let group = usize::from(n / 8);
                if let (Some(pins), Some(there)) = (self.pins.pc.get_mut(group), self.kind.masks.get(group)) {
                    *pins = set(*pins, 1 << (n % 8) & there);
                }
            }
            _ => return,
        }
        self.changed = t;
    }

    /// Changes that have passed the first flip-flops are lost.
    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.restart_clock(t, out);
        *self = ExternalInterrupts {
            pins: self.pins,
            sampled_pins: self.sampled_pins,
            changed: self.changed,
            has_flag_listener: self.has_flag_listener,
            ..ExternalInterrupts::new(self.kind)
        };
    }

    /// Stops the I/O clock.
    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        if self.stopped.is_none() && self.kind.edges_wake {
            self.catch_edges(t, out);
        }
        self.stopped.get_or_insert(t);
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.advance(t, out);
        let Some(stopped) = self.stopped.take() else { return };
        for change in self.pending_changes.iter_mut().flatten() {
            change.at = change.at.saturating_add(t.saturating_sub(stopped));
        }
        self.changed = t;
    }

    fn steady_until(&self, reg: ExternalRegister, t: u64) -> u64 {
        match reg {
            ExternalRegister::EIFR | ExternalRegister::PCIFR => {
                self.pending_changes().next().map_or(NEVER, |change| change.at).max(t)
            }
            _ => NEVER,
        }
    }
}
