//! The chip around the core as snapshot state ([`emu_core::state`]).

use emu_core::cpu::NEVER;
use emu_core::external_io::EventLog;
use emu_core::state;

use super::{AvrSoc, CoreRequest};

state! { enum CoreRequest { 0 = Erase { addr, len }, 1 = Program { addr, words } } }

impl Default for CoreRequest {
    fn default() -> CoreRequest {
        CoreRequest::Erase { addr: 0, len: 0 }
    }
}

impl CoreRequest {
    /// Checks that the request is within program memory of `flash` bytes.
    fn is_within_flash(&self, flash: u32) -> bool {
        let (addr, len) = match self {
            CoreRequest::Erase { addr, len } => (*addr, u64::from(*len)),
            CoreRequest::Program { addr, words } => (*addr, 2 * words.len() as u64),
        };
        u64::from(addr) + len <= flash.into()
    }
}

// Deadlines and pending interrupts are derived from the other fields.
state! {
    AvrSoc {
        ports, timers, usarts, spi, twi, adc, comparator, eeprom, spm, watchdog, external, prescalers, gtccr, mcusr, mcucr, smcr, prr,
        osccal, rampz, kept_bytes, low_ram, ursel_read, power, drives, requests, stall,
    } stays { part, wiring, log, schedule, first_vector, core_deadline, out, lints }
    if |soc, _now| soc.stall != NEVER && soc.requests.iter().all(|order| order.is_within_flash(soc.part.chip.flash_bytes)), then AvrSoc::restore_derived
}

impl AvrSoc {
    /// Recomputes the derived fields after a restore.
    fn restore_derived(&mut self) {
        self.log = EventLog::OFF;
        self.out.clear();
        self.lints.forget();
        self.core_deadline = NEVER;
        self.schedule.touch_all();
        self.update_deadlines();
    }

    /// Reports whether everything up to `now` has been executed.
    pub(crate) fn is_settled(&self, now: u64) -> bool {
        self.schedule.due > now
    }
}
