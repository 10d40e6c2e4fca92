//! The external interrupts as a part of the chip.

use emu_core::NEVER;

use super::{Change, External, Reg};
use crate::periph::{Device, Line, Outbox};

impl Device for External {
    type Reg = Reg;

    fn run(&mut self, t: u64, out: &mut Outbox) {
        self.advance(t, out);
    }

    fn next(&self) -> u64 {
        let ints = (self.eimsk | u8::from(self.listened)) & !self.eifr;
        let groups = self.pcicr & !self.pcifr;
        let noticed = |change: &Change| self.found(change) & ints != 0 || change.groups & groups != 0;
        self.coming().find(noticed).map_or(NEVER, |change| change.at)
    }

    /// Interrupt `n` is INT`n`, for as many as there are; those of the groups of pins follow. While the I/O clock stands, this
    /// is what asks to wake.
    fn requests(&self) -> u8 {
        let ints = self.eimsk & (self.eifr | self.low() & !self.pins.int);
        let asleep = match self.stopped {
            Some(_) => self.ways.iter().flatten().fold(self.groups_changed(), |groups, change| groups | change.groups),
            None => 0,
        };
        let groups = self.pcicr & (self.pcifr | asleep);
        ints | (u16::from(groups) << self.kind.ints) as u8
    }

    fn taken(&mut self, irq: u8, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        match irq.checked_sub(self.kind.ints) {
            None => self.eifr &= !(1 << irq),
            Some(group) => self.pcifr &= !1u8.checked_shl(group.into()).unwrap_or(0),
        }
    }

    fn peek(&self, reg: Reg, t: u64) -> u8 {
        if self.coming().next().is_none_or(|change| change.at > t) {
            return self.shown(reg);
        }
        let mut external = self.clone();
        external.advance(t, &mut Outbox::new());
        external.shown(reg)
    }

    fn write(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        let merge = |old: u8, there: u8| old & !(mask & there) | value & mask & there;
        // What is set at the very edge of the write stays set.
        let (ints, groups) = if self.flagged.0 == t { (self.flagged.1, self.flagged.2) } else { (0, 0) };
        match reg {
            Reg::EICRA => self.write_isc(value, mask, 0, t, out),
            Reg::EICRB => self.write_isc(value, mask, 4, t, out),
            Reg::EIMSK => self.eimsk = merge(self.eimsk, self.kind.inputs()),
            Reg::EIFR => self.eifr &= !(value & mask) | ints,
            Reg::PCICR => self.pcicr = merge(self.pcicr, self.kind.groups()),
            Reg::PCIFR => self.pcifr &= !(value & mask) | groups,
            Reg::PCMSK0 => self.pcmsk[0] = merge(self.pcmsk[0], self.kind.masks[0]),
            Reg::PCMSK1 => self.pcmsk[1] = merge(self.pcmsk[1], self.kind.masks[1]),
            Reg::PCMSK2 => self.pcmsk[2] = merge(self.pcmsk[2], self.kind.masks[2]),
            Reg::PCMSK3 => self.pcmsk[3] = merge(self.pcmsk[3], self.kind.masks[3]),
        }
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        let set = |bits: u8, bit: u8| if high { bits | bit } else { bits & !bit };
        match line {
            Line::Int(n) => {
                let bit = 1u8.checked_shl(n.into()).unwrap_or(0) & self.kind.inputs();
                self.trigger(t, out, |external| external.pins.int = set(external.pins.int, bit));
            }
            Line::Pc(n) => {
                let group = usize::from(n / 8);
                if let (Some(pins), Some(there)) = (self.pins.pc.get_mut(group), self.kind.masks.get(group)) {
                    *pins = set(*pins, 1 << (n % 8) & there);
                }
            }
            _ => return,
        }
        self.changed = t;
    }

    /// What is behind the first flip-flops is lost.
    fn reset(&mut self, t: u64, out: &mut Outbox) {
        self.wake(t, out);
        *self = External {
            pins: self.pins,
            seen: self.seen,
            changed: self.changed,
            listened: self.listened,
            ..External::new(self.kind)
        };
    }

    /// The I/O clock stops.
    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        if self.stopped.is_none() && self.kind.edges_wake {
            self.catch_edges(t, out);
        }
        self.stopped.get_or_insert(t);
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        self.advance(t, out);
        let Some(stopped) = self.stopped.take() else { return };
        for change in self.ways.iter_mut().flatten() {
            change.at = change.at.saturating_add(t.saturating_sub(stopped));
        }
        self.changed = t;
    }

    fn steady(&self, reg: Reg, t: u64) -> u64 {
        match reg {
            Reg::EIFR | Reg::PCIFR => self.coming().next().map_or(NEVER, |change| change.at).max(t),
            _ => NEVER,
        }
    }
}
