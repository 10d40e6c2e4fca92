//! Timer/counters 0, 1 and 2 in normal and CTC mode (data sheet 15, 16 and 18), in closed form: a value at a cycle, and
//! the edges that step it. Modes are by the row below; PWM modes count as normal mode (QUIRKS.md).

use emu_core::cpu::NEVER;
use emu_core::parts::counter::Counter;
use emu_core::parts::prescaler::Ticks;

/// TOVn in TIFRn, and TOIEn in TIMSKn.
pub const TOV: u8 = 1;
/// OCFnA and OCIEnA.
pub const OCFA: u8 = 1 << 1;
/// OCFnB and OCIEnB.
pub const OCFB: u8 = 1 << 2;
/// ICF1 and ICIE1.
pub const ICF: u8 = 1 << 5;

/// What ends a round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Top {
    /// The width of the counter.
    Max,
    /// OCRnA.
    OcrA,
    /// ICR1.
    Icr,
}

/// One timer/counter.
#[derive(Debug, Clone, Copy)]
pub struct Timer {
    /// The cycle up to which edges are counted in `value` and `flags`.
    at: u64,
    value: u16,
    max: u16,
    top: Top,
    /// TCNTn was written: the next edge makes no compare match (15.5.2).
    blocked: bool,
    ticks: Ticks,
    ocr: [u16; 2],
    icr: u16,
    flags: u8,
    enabled: u8,
    /// Before this cycle no further flag is set, unless something is changed: what a polling program asks again and again.
    calm: u64,
}

impl Timer {
    /// A stopped timer as after reset; `max` is 0xFF or 0xFFFF.
    pub const fn new(max: u16) -> Timer {
        Timer {
            at: 0,
            value: 0,
            max,
            top: Top::Max,
            blocked: false,
            ticks: Ticks::NONE,
            ocr: [0; 2],
            icr: 0,
            flags: 0,
            enabled: 0,
            calm: 0,
        }
    }

    /// Counts the edges up to and including the cycle `now`.
    pub fn sync(&mut self, now: u64) {
        let steps = self.ticks.count(self.at, now);
        self.at = self.at.max(now);
        if steps == 0 {
            return;
        }
        if now >= self.calm {
            for flag in [TOV, OCFA, OCFB, ICF] {
                if self.flags & flag == 0 && self.steps(flag).is_some_and(|n| n <= steps) {
                    self.flags |= flag;
                }
            }
        }
        self.value = if self.blocked {
            Counter { value: self.counter().beyond(), ..self.counter() }.after(steps - 1)
        } else {
            self.counter().after(steps)
        };
        self.blocked = false;
    }

    /// Counts the edges up to `at`, before something of the timer is changed there.
    fn change(&mut self, at: u64) {
        self.sync(at);
        self.calm = 0;
    }

    /// TIFRn in the cycle `now`.
    pub fn flags_at(&mut self, now: u64) -> u8 {
        if now >= self.calm {
            self.sync(now);
            self.calm = self.next(TOV | OCFA | OCFB | ICF);
        }
        self.flags
    }

    /// This timer as it stands in the cycle `now`.
    #[must_use]
    pub fn synced(&self, now: u64) -> Timer {
        let mut timer = *self;
        timer.sync(now);
        timer
    }

    /// The count.
    pub const fn count(&self) -> u16 {
        self.value
    }

    /// TIFRn.
    pub const fn flags(&self) -> u8 {
        self.flags
    }

    /// TIMSKn.
    pub const fn enabled(&self) -> u8 {
        self.enabled
    }

    /// OCRnA (0) or OCRnB (1).
    pub const fn ocr(&self, channel: usize) -> u16 {
        self.ocr[channel & 1]
    }

    /// ICR1.
    pub const fn icr(&self) -> u16 {
        self.icr
    }

    /// True while a clock is selected.
    pub const fn running(&self) -> bool {
        self.ticks.every != 0
    }

    /// Clears flags. A flag that is set at the very edge of the write stays set.
    pub fn clear_flags(&mut self, bits: u8, now: u64) {
        self.change(now);
        self.flags &= !bits;
    }

    /// Sets TIMSKn.
    pub fn set_enabled(&mut self, bits: u8) {
        self.enabled = bits;
    }

    /// Selects other clock edges from those after the cycle `at` on.
    pub fn set_ticks(&mut self, ticks: Ticks, at: u64) {
        if ticks != self.ticks {
            self.change(at);
            self.ticks = ticks;
        }
    }

    /// Selects what ends a round, for the edges after the cycle `at`.
    pub fn set_top(&mut self, top: Top, at: u64) {
        self.change(at);
        self.top = top;
    }

    /// Writes TCNTn: the count is `value` in the cycle `at`, whatever edge falls there.
    pub fn set_count(&mut self, value: u16, at: u64) {
        self.change(at);
        self.value = value & self.max;
        self.blocked = true;
    }

    /// Writes OCRnA (0) or OCRnB (1).
    pub fn set_ocr(&mut self, channel: usize, value: u16, at: u64) {
        self.change(at);
        self.ocr[channel & 1] = value & self.max;
    }

    /// Writes ICR1.
    pub fn set_icr(&mut self, value: u16, at: u64) {
        self.change(at);
        self.icr = value;
    }

    /// The cycle at which the next flag of `among` that is still clear is set; [`NEVER`] where there is none.
    pub fn next(&self, among: u8) -> u64 {
        let open = among & !self.flags;
        if open == 0 || !self.running() {
            return NEVER;
        }
        let steps =
            [TOV, OCFA, OCFB, ICF].into_iter().filter(|flag| open & flag != 0).filter_map(|flag| self.steps(flag));
        steps.min().map_or(NEVER, |n| self.ticks.nth(self.at, n))
    }

    /// Edges from `at` to the one that sets `flag`: that at which the counter goes on from the value it belongs to.
    fn steps(&self, flag: u8) -> Option<u64> {
        let counter = self.counter();
        let target = match flag {
            TOV => self.max,
            OCFA => self.ocr[0],
            OCFB => self.ocr[1],
            _ if self.top == Top::Icr => self.icr,
            _ => return None,
        };
        if !self.blocked || (flag == TOV && self.value == self.max) {
            return counter.leaves(target);
        }
        // No match at the first edge, so no return to 0 by one either.
        Counter { value: counter.beyond(), ..counter }.leaves(target).map(|n| n + 1)
    }

    const fn counter(&self) -> Counter {
        let top = match self.top {
            Top::Max => self.max,
            Top::OcrA => self.ocr[0],
            Top::Icr => self.icr,
        };
        Counter { value: self.value, top, max: self.max }
    }
}
