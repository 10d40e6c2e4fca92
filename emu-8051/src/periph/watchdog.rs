//! The watchdog of the AT89S parts (AT89S52 data sheet, "Watchdog timer", "WDT during power-down and idle"),
//! in oscillator time.

use super::map::sfr;
use super::{Device, Mcs51Outbox, Mcs51Signal};
use emu_core::NEVER;
use emu_core::state;

/// Machine cycles from a clear of the watchdog to its overflow: a 14-bit counter that reaches 3FFFh.
const WATCHDOG_CYCLES: u64 = 0x3FFF;

/// The watchdog. A program writes 1Eh and then E1h to WDTRST to start or clear it. Its clock stops in idle if
/// WDIDLE is set.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51Watchdog {
    /// Whether the last write was 1Eh.
    unlock_written: bool,
    /// The cycle at the end of which the watchdog was cleared, if it runs.
    cleared_cycle: Option<u64>,
    /// The cycle since which it is paused.
    paused_since: Option<u64>,
}

state! { Mcs51Watchdog { unlock_written, cleared_cycle, paused_since } if |of, _now| ![of.cleared_cycle, of.paused_since].contains(&Some(NEVER)) }

impl Mcs51Watchdog {
    /// State after reset.
    pub const OFF: Mcs51Watchdog = Mcs51Watchdog { unlock_written: false, cleared_cycle: None, paused_since: None };
}

impl Device<Mcs51Signal> for Mcs51Watchdog {
    /// A direct address.
    type Reg = u8;

    fn run_due(&mut self, t: u64, out: &mut Mcs51Outbox) {
        if self.next_deadline() <= t {
            *self = Mcs51Watchdog::OFF;
            out.push(Mcs51Signal::Watchdog { t });
        }
    }

    fn next_deadline(&self) -> u64 {
        match (self.cleared_cycle, self.paused_since) {
            (Some(cleared), None) => cleared + WATCHDOG_CYCLES,
            _ => NEVER,
        }
    }

    fn peek(&self, _reg: u8, _t: u64) -> u8 {
        0
    }

    fn write(&mut self, reg: u8, value: u8, _mask: u8, t: u64, _out: &mut Mcs51Outbox) {
        if reg == sfr::WDTRST {
            if value == 0xE1 && self.unlock_written {
                self.cleared_cycle = Some(t);
            }
            self.unlock_written = value == 0x1E;
        }
    }

    fn reset(&mut self, _power_on: bool, _t: u64, _out: &mut Mcs51Outbox) {
        *self = Mcs51Watchdog::OFF;
    }

    fn stop_clock(&mut self, t: u64, _out: &mut Mcs51Outbox) {
        self.paused_since = self.paused_since.or(self.cleared_cycle.map(|_| t));
    }

    fn restart_clock(&mut self, t: u64, _out: &mut Mcs51Outbox) {
        if let (Some(cleared), Some(paused)) = (self.cleared_cycle, self.paused_since.take()) {
            self.cleared_cycle = Some(cleared + t.saturating_sub(1).saturating_sub(paused));
        }
    }
}
