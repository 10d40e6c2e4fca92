//! The counter of the watchdog (DS33023, section 26.6): an RC oscillator of its own, and WDTCON where the chip has it (DS30487,
//! section 15.12). The prescaler behind it is timer 0's, and so is what becomes of its pulses.

use emu_core::parts::prescaler::TickSeries;

/// Watchdog enable by the program.
const SWDTEN: u8 = 1;
/// WDTPS3:WDTPS0, position.
const WDTPS: u8 = 1;
/// WDTCON after a reset: WDTPS = 0100, SWDTEN clear.
const WDTCON_RESET: u8 = 0x08;
/// The longest setting of WDTPS; those above are reserved, and count as this one.
const WDTPS_MAX: u8 = 0b1011;

/// The watchdog without its postscaler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16Watchdog {
    /// WDTE of the configuration word.
    wdte: bool,
    /// WDTCON; `None` where the chip has none.
    wdtcon: Option<u8>,
    /// Oscillator clocks from pulse to pulse, with WDTPS as after a reset.
    clocks: u64,
    /// The clock at which the counter was zero.
    origin: u64,
}

emu_core::state! { Pic16Watchdog { wdtcon, origin } stays { wdte, clocks } if |of, now| of.origin <= now + 4 }

impl Pic16Watchdog {
    /// A watchdog that starts from zero at clock 0. `clocks` is its period without prescaler in clocks of the oscillator (with
    /// WDTPS = 0100 where there is WDTCON); 0 counts as 1.
    #[must_use]
    pub const fn new(wdte: bool, clocks: u64, wdtcon: bool) -> Pic16Watchdog {
        let wdtcon = if wdtcon { Some(WDTCON_RESET) } else { None };
        Pic16Watchdog { wdte, wdtcon, clocks: if clocks == 0 { 1 } else { clocks }, origin: 0 }
    }

    /// It counts: WDTE or SWDTEN is set.
    #[must_use]
    pub const fn is_running(&self) -> bool {
        self.wdte || self.wdtcon() & SWDTEN != 0
    }

    /// WDTCON; 0 where there is none.
    #[must_use]
    pub const fn wdtcon(&self) -> u8 {
        match self.wdtcon {
            Some(value) => value,
            None => 0,
        }
    }

    /// Writes WDTCON at `t`; true where that starts the watchdog. WDTPS picks a tap of a divider that goes on counting.
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

    /// Starts from zero at `t`.
    pub fn clear(&mut self, t: u64) {
        self.origin = t;
    }

    /// A reset at `t`: WDTCON takes its reset value, and the counter starts from zero.
    pub fn reset(&mut self, t: u64) {
        self.wdtcon = self.wdtcon.map(|_| WDTCON_RESET);
        self.clear(t);
    }

    /// Its pulses; none while it stands.
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
