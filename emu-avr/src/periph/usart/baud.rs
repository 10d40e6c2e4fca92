//! The baud rate generator (section 20.3.1): a counter that counts down from UBRR, and the divider after it.

use emu_core::NEVER;

/// Ticks of the generator, numbered in the order in which the divider counts them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct BaudClock {
    /// UBRR.
    pub(super) ubrr: u16,
    /// Cycle and number of a reference tick, after which ticks follow every UBRR + 1 cycles. It can be at
    /// most one tick in the future.
    tick: u64,
    number: u64,
}

emu_core::state! {
    BaudClock { ubrr, tick, number }
    if |baud, _now| baud.ubrr <= 0xFFF && baud.number != 0 && ![baud.tick, baud.number].contains(&NEVER)
}

impl BaudClock {
    /// Returns the generator after a reset at `t`.
    pub(super) const fn new(t: u64) -> BaudClock {
        BaudClock { ubrr: 0, tick: t.saturating_add(1), number: 1 }
    }

    fn period(&self) -> u64 {
        u64::from(self.ubrr) + 1
    }

    /// Handles a write of UBRRL: restarts counter and divider.
    pub(super) fn restart(&mut self, low: u8, t: u64) {
        self.ubrr = self.ubrr & 0x0F00 | u16::from(low);
        (self.tick, self.number) = (t.saturating_add(self.period()), 1);
    }

    /// Handles a write of UBRRH, which the counter uses from its next reload on.
    pub(super) fn set_high(&mut self, high: u8, t: u64) {
        let number = self.edges_until(t).saturating_add(1);
        (self.tick, self.number) = (self.cycle_of_edge(number), number);
        self.ubrr = self.ubrr & 0x00FF | u16::from(high & 0x0F) << 8;
    }

    /// Delays the ticks by the cycles for which the clock was stopped.
    pub(super) fn shift(&mut self, cycles: u64) {
        self.tick = self.tick.saturating_add(cycles);
    }

    /// Returns the number of the last tick up to `t`.
    pub(super) fn edges_until(&self, t: u64) -> u64 {
        match t.checked_sub(self.tick) {
            None => self.number - 1,
            Some(since) => self.number.saturating_add(since / self.period()),
        }
    }

    fn cycle_of_edge(&self, number: u64) -> u64 {
        let ticks = number.saturating_sub(self.number);
        self.tick.saturating_add(ticks.saturating_mul(self.period()))
    }

    /// Returns the cycle of the `n`th tick after `t`.
    pub(super) fn nth(&self, t: u64, n: u64) -> u64 {
        self.cycle_of_edge(self.edges_until(t).saturating_add(n))
    }

    /// Returns the cycle of the `n`th edge after `t` of the divider by `per`.
    pub(super) fn nth_divided(&self, t: u64, n: u64, per: u64) -> u64 {
        self.cycle_of_edge((self.edges_until(t) / per).saturating_add(n).saturating_mul(per))
    }

    /// Returns the number of edges of the divider by `per` after `from`, up to `to`.
    pub(super) fn divided_between(&self, from: u64, to: u64, per: u64) -> u64 {
        (self.edges_until(to) / per).saturating_sub(self.edges_until(from) / per)
    }
}
