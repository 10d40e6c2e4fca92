//! The counter of the watchdog (DS33023, section 26.6): its own RC oscillator, and WDTCON on chips that have
//! it (DS30487, section 15.12). Timer 0 contains the prescaler after it and handles its pulses.

use emu_core::parts::prescaler::TickSeries;

/// Mask of SWDTEN in WDTCON: software enable.
const SWDTEN: u8 = 1;
/// Position of WDTPS3:WDTPS0 in WDTCON.
const WDTPS: u8 = 1;
/// WDTCON after a reset: WDTPS = 0100, SWDTEN clear.
const WDTCON_RESET: u8 = 0x08;
/// Highest value of WDTPS; higher values are reserved, and act like it.
const WDTPS_MAX: u8 = 0b1011;

/// The watchdog without its postscaler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16Watchdog {
    /// True if WDTE of the configuration word is set.
    wdte: bool,
    /// WDTCON; None if the chip has none.
    wdtcon: Option<u8>,
    /// Oscillator clocks between pulses, with WDTPS as after a reset.
    clocks: u64,
    /// Clock at which the counter was zero.
    origin: u64,
}

emu_core::state! { Pic16Watchdog { wdtcon, origin } stays { wdte, clocks } if |of, now| of.origin <= now + 4 }

impl Pic16Watchdog {
    /// Returns a watchdog that starts from zero at clock 0. `clocks` is its period without prescaler in
    /// clocks of the oscillator (with WDTPS = 0100 on chips with WDTCON); 0 counts as 1.
    #[must_use]
    pub const fn new(wdte: bool, clocks: u64, wdtcon: bool) -> Pic16Watchdog {
        let wdtcon = if wdtcon { Some(WDTCON_RESET) } else { None };
        Pic16Watchdog { wdte, wdtcon, clocks: if clocks == 0 { 1 } else { clocks }, origin: 0 }
    }

    /// Reports whether it counts: WDTE or SWDTEN is set.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.wdte || self.wdtcon() & SWDTEN != 0
    }

    /// Returns WDTCON; 0 if the chip has none.
    #[must_use]
    pub const fn wdtcon(&self) -> u8 {
        match self.wdtcon {
            Some(value) => value,
            None => 0,
        }
    }

    /// Writes WDTCON at `t`; returns true if that starts the watchdog. WDTPS selects a tap of a divider that
    /// continues to count.
    pub fn set_wdtcon(&mut self, value: u8, t: u64) -> bool {
        let was = self.is_running();
        if let Some(wdtcon) = &mut self.wdtcon {
            *wdtcon = value & 0x1F;
        }
        let starts = !was && self.is_running();
        if starts {
            self.clear(t);
        }
        starts
    }

    /// Restarts the counter from zero at `t`.
    pub fn clear(&mut self, t: u64) {
        self.origin = t;
    }

    /// Resets WDTCON and the counter at `t`.
    pub fn reset(&mut self, t: u64) {
        self.wdtcon = self.wdtcon.map(|_| WDTCON_RESET);
        self.clear(t);
    }

    /// Returns its pulses; none while it is off.
    #[must_use]
    pub fn timeouts(&self) -> TickSeries {
        let every = match self.wdtcon {
            _ if !self.is_running() => 0,
            None => self.clocks,
            Some(value) => {
                let [set, reset] = [value, WDTCON_RESET].map(|w| (w >> WDTPS & 0xF).min(WDTPS_MAX));
                if set < reset {
                    (self.clocks >> (reset - set)).max(1)
                } else {
                    self.clocks.saturating_mul(1 << (set - reset))
                }
            }
        };
        TickSeries { origin: self.origin, period: every }
    }
}
