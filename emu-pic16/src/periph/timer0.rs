//! Timer 0 and the prescaler that it shares with the watchdog (DS33023, sections 11 and 26.6; DS30292 and
//! DS39582, section 5).
//!
//! The signal path is that of the block diagram, in levels. T0CS selects the instruction clock or T0CKI
//! (inverted by T0SE). PSA routes that past the prescaler or through it. The result is sampled at the start
//! of Q2 and Q4. A rise detected in Q2 counts at the end of that cycle, a rise detected in Q4 at the end of
//! the next one: 3 to 7 clocks after the edge (figure "Timer0 timing with external clock"). The instruction
//! clock rises with Q1 and falls with Q3. The output of the prescaler is the inverse of the bit that PS
//! selects, so it rises when the count wraps. A write of OPTION takes effect just before the rise of Q1.
//!
//! A write of TMR0 clears the prescaler if it is assigned to timer 0, and suppresses all edges of the
//! following cycle and of the Q1 after it: nothing is counted for two cycles, and reads after the write match
//! the figures.
//!
//! The time-out of the watchdog is its own pulse, or the prescaler bit that PS selects: half the ratio of
//! timer 0.

use emu_core::NEVER;

use super::map::{InterruptFlag, Pic16Line, Sfr};
use super::watchdog::Pic16Watchdog;
use super::{Device, Pic16Outbox, Pic16Signal};

/// Mask of T0CS in OPTION: timer 0 counts T0CKI.
const T0CS: u8 = 1 << 5;
/// Mask of T0SE in OPTION: timer 0 counts falling edges of T0CKI.
const T0SE: u8 = 1 << 4;
/// Mask of PSA in OPTION: the prescaler is assigned to the watchdog.
const PSA: u8 = 1 << 3;
/// Mask of PS2:PS0 in OPTION.
const PS: u8 = 7;
/// Clocks after a write of TMR0 in which edges are not counted.
const WRITE_INHIBIT_CLOCKS: u64 = 6;

/// Timer 0, the prescaler and the watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timer0 {
    tmr0: u8,
    option: u8,
    prescaler: u8,
    watchdog: Pic16Watchdog,
    /// Clock up to which everything has been executed: edges and samples before this clock, and counts and
    /// watchdog pulses also at it.
    now: u64,
    /// Level of T0CKI.
    t0cki: bool,
    /// Level of the instruction clock.
    q12: bool,
    /// Level at the last sample.
    sampled: bool,
    /// Whether a detected rise counts at the end of this cycle, and at the end of the next cycle.
    seen: [bool; 2],
    /// First clock at which edges count again. While the oscillator is stopped, it is relative to the
    /// restart.
    free: u64,
    /// True while the oscillator is stopped.
    asleep: bool,
}

emu_core::state! {
    Timer0 { tmr0, option, prescaler, watchdog, now, t0cki, q12, sampled, seen, free, asleep }
    if |of, now| of.now <= now + 4 && of.free <= WRITE_INHIBIT_CLOCKS + if of.asleep { 0 } else { now + 4 }
}

impl Timer0 {
    /// Returns the timer after power-up at clock 0. `wdte` is the watchdog enable of the configuration word.
    /// `wdt_clocks` is the watchdog period without prescaler in clocks of the oscillator. `wdtcon` is true if
    /// the chip has WDTCON (16F87, 16F88); then the period is that with WDTPS = 0100.
    #[must_use]
    pub const fn new(wdte: bool, wdt_clocks: u64, wdtcon: bool) -> Timer0 {
        Timer0 {
            tmr0: 0,
            option: 0xFF,
            prescaler: 0,
            watchdog: Pic16Watchdog::new(wdte, wdt_clocks, wdtcon),
            now: 0,
            t0cki: false,
            q12: false,
            sampled: true,
            seen: [false; 2],
            free: 0,
            asleep: false,
        }
    }

    /// Clears the watchdog at `t` (CLRWDT, SLEEP), and also the prescaler if it is assigned to the watchdog.
    pub fn clear_watchdog(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
        self.watchdog.clear(t);
        if self.has(PSA) {
            self.prescaler = 0;
        }
    }

    /// Reports whether the watchdog is on.
    #[must_use]
    pub const fn has_running_watchdog(&self) -> bool {
        self.watchdog.is_running()
    }

    const fn has(&self, bit: u8) -> bool {
        self.option & bit != 0
    }

    /// Returns the prescaler bit that PS selects.
    const fn tap(&self) -> bool {
        self.prescaler >> (self.option & PS) & 1 != 0
    }

    /// Returns the level that timer 0 counts, before the prescaler.
    const fn input(&self) -> bool {
        if self.has(T0CS) { self.t0cki != self.has(T0SE) } else { self.q12 }
    }

    /// Returns the level that is sampled.
    const fn output(&self) -> bool {
        if self.has(PSA) { self.input() } else { !self.tap() }
    }

    /// Returns the level of timer 0's input at the prescaler. The watchdog's pulses are too short to matter
    /// here.
    const fn ripple(&self) -> bool {
        !self.has(PSA) && self.input()
    }

    /// Returns the time-out of the watchdog as a level.
    const fn is_timeout_pending(&self) -> bool {
        self.watchdog.is_running() && self.has(PSA) && self.tap()
    }

    /// Returns the instruction cycles until `counts` counts (at least 1), while [`Timer0::is_regular`] holds.
    fn cycles(&self, counts: u64) -> u64 {
        if self.has(PSA) {
            return counts;
        }
        let shift = (self.option & PS) + 1;
        (counts << shift) - (u64::from(self.prescaler) & ((1 << shift) - 1))
    }

    /// Returns the cycles until TMR0 goes from FFh to 00h.
    fn cycles_to_overflow(&self) -> u64 {
        self.cycles(256 - u64::from(self.tmr0))
    }

    /// Reports whether an edge at `t` is counted.
    const fn counts_at(&self, t: u64) -> bool {
        if self.asleep { self.free == 0 } else { t >= self.free }
    }

    /// Applies a change of levels at `t`. The prescaler counts asynchronously, even while the oscillator is
    /// stopped.
    fn change_setup(&mut self, t: u64, change: impl FnOnce(&mut Timer0)) {
        let before = self.ripple();
        change(self);
        if !before && self.ripple() && self.counts_at(t) {
            self.prescaler = self.prescaler.wrapping_add(1);
        }
    }

    /// Executes one clock.
    fn step(&mut self, out: &mut Pic16Outbox) {
        let t = self.now;
        match t % 4 {
            0 => self.change_setup(t, |s| s.q12 = true),
            2 => self.change_setup(t, |s| s.q12 = false),
            phase => {
                let level = self.output();
                if level && !self.sampled && self.counts_at(t) {
                    self.seen[usize::from(phase == 3)] = true;
                }
                self.sampled = level;
            }
        }
        self.now += 1;
        if self.now.is_multiple_of(4) {
            let [count, next] = self.seen;
            self.seen = [next, false];
            if count {
                self.count(1, out);
            }
        }
    }

    /// Adds counts, at most up to the next return to 0; `now` is the clock of the last count.
    fn count(&mut self, counts: u64, out: &mut Pic16Outbox) {
        let to = u64::from(self.tmr0) + counts;
        self.tmr0 = to as u8;
        if to > 0xFF {
            out.push(Pic16Signal::Flag { t: self.now, flag: InterruptFlag::T0IF });
        }
    }

    /// Reports whether no detected rise waits to be counted.
    const fn is_idle(&self) -> bool {
        !self.seen[0] && !self.seen[1]
    }

    /// Reports whether nothing will be counted before a line changes.
    const fn is_still(&self) -> bool {
        self.asleep || (self.has(T0CS) && self.is_idle() && self.sampled == self.output())
    }

    /// Reports whether each cycle from now on is equal: no rise waits, and no edges are suppressed.
    const fn is_regular(&self) -> bool {
        !self.has(T0CS)
            && self.now.is_multiple_of(4)
            && self.is_idle()
            && self.now >= self.free
            && self.sampled == self.output()
    }

    /// Executes whole cycles up to `t`, or up to the next return to 0.
    fn skip_regular(&mut self, t: u64, out: &mut Pic16Outbox) {
        let cycles = self.cycles_to_overflow().min((t - self.now) / 4);
        self.now += 4 * cycles;
        if self.has(PSA) {
            self.count(cycles, out);
        } else {
            let shift = (self.option & PS) + 1;
            let counts = ((u64::from(self.prescaler) & ((1 << shift) - 1)) + cycles) >> shift;
            self.prescaler = self.prescaler.wrapping_add(cycles as u8);
            self.sampled = self.output();
            self.count(counts, out);
        }
    }

    /// Executes everything up to `t`, except time-outs.
    fn advance(&mut self, t: u64, out: &mut Pic16Outbox) {
        let pulses = if self.has(PSA) { self.watchdog.timeouts().ticks_between(self.now, t) } else { 0 };
        while self.now < t {
            if self.is_still() {
                if !self.asleep {
                    self.q12 = matches!(t % 4, 1 | 2);
                }
                self.now = t;
            } else if t - self.now >= 4 && self.is_regular() {
                self.skip_regular(t, out);
            } else {
                self.step(out);
            }
        }
        self.prescaler = self.prescaler.wrapping_add(pulses as u8);
    }

    /// Executes everything up to `t`.
    fn settle(&mut self, t: u64, out: &mut Pic16Outbox) {
        loop {
            let at = self.timeout();
            if at > t {
                break;
            }
            self.advance(at, out);
            self.time_out(out);
        }
        self.advance(t, out);
    }

    /// Handles a time-out of the watchdog now, which then starts again.
    fn time_out(&mut self, out: &mut Pic16Outbox) {
        out.push(Pic16Signal::Watchdog { t: self.now });
        if self.has(PSA) {
            self.prescaler = 0;
        }
    }

    /// Returns the clock of the next watchdog time-out. The prescaler bit that PS selects is clear: if it
    /// were set, the time-out would have occurred.
    fn timeout(&self) -> u64 {
        let pulses = if self.has(PSA) {
            let ratio = 1u64 << (self.option & PS);
            ratio - (u64::from(self.prescaler) & (ratio - 1))
        } else {
            1
        };
        self.watchdog.timeouts().nth_after(self.now, pulses)
    }

    /// Returns the clock at which TMR0 goes from FFh to 00h.
    fn overflow(&self) -> u64 {
        let mut ahead = *self;
        let mut out = Pic16Outbox::new();
        while out.is_empty() {
            if ahead.is_still() {
                return NEVER;
            }
            if ahead.is_regular() {
                return ahead.now.saturating_add(4 * ahead.cycles_to_overflow());
            }
            ahead.step(&mut out);
        }
        ahead.now
    }

    /// Returns a copy of the timer as it will be at `t`.
    fn advanced_to(&self, t: u64) -> Timer0 {
        let mut ahead = *self;
        ahead.advance(t, &mut Pic16Outbox::new());
        ahead
    }
}

impl Device<Pic16Signal> for Timer0 {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
    }

    fn next_deadline(&self) -> u64 {
        self.timeout().min(self.overflow())
    }

    fn peek(&self, reg: Sfr, t: u64) -> u8 {
        match reg {
            Sfr::TMR0 => self.advanced_to(t).tmr0,
            Sfr::OPTION => self.option,
            Sfr::WDTCON => self.watchdog.wdtcon(),
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        if reg == Sfr::TMR0 {
            // The written value replaces a count at the same clock.
            self.settle(t.saturating_sub(1), out);
            self.seen = [false; 2];
        }
        self.settle(t, out);
        match reg {
            Sfr::TMR0 => {
                self.tmr0 = value;
                if !self.has(PSA) {
                    self.prescaler = 0;
                }
                self.seen = [false; 2];
                // A write from outside can occur while the oscillator is stopped.
                self.free = if self.asleep { WRITE_INHIBIT_CLOCKS } else { t.saturating_add(WRITE_INHIBIT_CLOCKS) };
            }
            Sfr::OPTION => {
                self.change_setup(t, |s| s.option = value);
                // Bits that timer 0 left in the prescaler can cause a time-out (DS33023, 11.6.1).
                if self.is_timeout_pending() {
                    self.time_out(out);
                }
            }
            Sfr::WDTCON if self.watchdog.set_wdtcon(value, t) => self.clear_watchdog(t, out),
            _ => {}
        }
    }

    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        if line == Pic16Line::T0cki {
            self.settle(t, out);
            self.change_setup(t, |s| s.t0cki = high);
        }
    }

    /// Resets the timer at `t`: OPTION is FFh, prescaler and watchdog start from zero, TMR0 keeps its value.
    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut Pic16Outbox) {
        // Events due up to this clock are lost with the reset.
        self.settle(t, &mut Pic16Outbox::new());
        self.option = 0xFF;
        self.prescaler = 0;
        self.watchdog.reset(t);
        self.q12 = false;
        self.seen = [false; 2];
        self.free = 0;
        self.asleep = false;
        self.sampled = self.output();
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
        if !self.asleep {
            self.asleep = true;
            self.free = self.free.saturating_sub(t);
        }
    }

    /// Every wake-up clears the watchdog.
    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.clear_watchdog(t, out);
        if self.asleep {
            self.asleep = false;
            self.free = if self.free == 0 { 0 } else { self.free.saturating_add(t) };
        }
    }

    fn steady_until(&self, reg: Sfr, t: u64) -> u64 {
        if reg != Sfr::TMR0 {
            return NEVER;
        }
        let mut ahead = self.advanced_to(t);
        let value = ahead.tmr0;
        while ahead.tmr0 == value {
            if ahead.is_still() {
                return NEVER;
            }
            if ahead.is_regular() {
                return ahead.now.saturating_add(4 * ahead.cycles(1));
            }
            ahead.step(&mut Pic16Outbox::new());
        }
        ahead.now
    }
}
