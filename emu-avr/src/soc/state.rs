//! The chip around the core as a state ([`emu_core::state`]).

use emu_core::cpu::NEVER;
use emu_core::outside::Log;
use emu_core::state;

use super::{Order, Soc};
use crate::chips::unit;

state! { enum Order { 0 = Erase { addr, len }, 1 = Program { addr, words } } }

impl Default for Order {
    fn default() -> Order {
        Order::Erase { addr: 0, len: 0 }
    }
}

impl Order {
    /// It stays within program memory of so many bytes.
    fn within(&self, flash: u32) -> bool {
        let (addr, len) = match self {
            Order::Erase { addr, len } => (*addr, u64::from(*len)),
            Order::Program { addr, words } => (*addr, 2 * words.len() as u64),
        };
        u64::from(addr) + len <= flash.into()
    }
}

// When what is due, and what asks, follows from the rest.
state! {
    Soc {
        ports, timers, usarts, spi, twi, adc, comparator, eeprom, spm, watchdog, external, prescalers, gtccr, mcusr, mcucr, smcr, prr,
        osccal, rampz, kept, low, ursel_read, power, drives, orders, stall,
    } stays { part, wiring, log, nexts, asks, touched, first, due, told, out, lints }
    if |soc, _now| soc.stall != NEVER && soc.orders.iter().all(|order| order.within(soc.part.chip.flash)), then Soc::resume
}

impl Soc {
    /// Does everything up to `now`, also what nobody waits for, so that machines that are equal look so.
    pub(crate) fn settle_down(&mut self, now: u64) {
        self.log = Log::OFF;
        self.run(now);
        for number in 0..unit::COUNT {
            self.run_unit(number, now);
        }
        self.plan();
    }

    /// Works out what follows from what was read.
    fn resume(&mut self) {
        self.log = Log::OFF;
        self.out.clear();
        self.lints.forget();
        self.told = NEVER;
        self.touched = u16::MAX;
        self.plan();
    }

    /// Everything up to `now` has been done.
    pub(crate) fn is_settled(&self, now: u64) -> bool {
        self.due > now
    }
}
