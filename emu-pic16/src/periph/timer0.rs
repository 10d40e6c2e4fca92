//! Timer 0 and the prescaler that it shares with the watchdog (DS33023, sections 11 and 26.6; DS30292 and DS39582, section 5).
//!
//! The chain is that of the block diagram, as levels: T0CS picks the instruction clock or T0CKI (inverted by T0SE); PSA sends
//! that past the prescaler or through it; the outcome is sampled at the start of Q2 and of Q4, and a rise seen there counts at
//! the end of the cycle in whose Q2 it is seen, or of the one after that in whose Q4 it is seen: 3 to 7 clocks after the edge
//! (figure "Timer0 timing with external clock"). The instruction clock rises with Q1 and falls with Q3. The output of the
//! prescaler is the inverse of the bit that PS picks, so that it rises when the count goes round. A write of OPTION comes just
//! before the rise of Q1.
//!
//! A write of TMR0 clears the prescaler where it is timer 0's, and loses all edges of the following cycle and of the Q1 after it:
//! no count comes in two cycles, and the reads after the write are those of the figures.
//!
//! The watchdog's time-out is its own pulse, or the bit of the prescaler that PS picks: half the ratio of timer 0's.

use emu_core::NEVER;

use super::map::{InterruptFlag, Pic16Line, Sfr};
use super::watchdog::Pic16Watchdog;
use super::{Pic16Device, Pic16Outbox, Pic16Signal};

/// Timer 0 counts T0CKI.
const T0CS: u8 = 1 << 5;
/// Timer 0 counts falling edges of T0CKI.
const T0SE: u8 = 1 << 4;
/// The prescaler is the watchdog's.
const PSA: u8 = 1 << 3;
/// PS2:PS0.
const PS: u8 = 7;
/// Clocks from a write of TMR0 on whose edges are lost.
const WRITE_INHIBIT_CLOCKS: u64 = 6;

/// Timer 0, the prescaler and the watchdog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timer0 {
    tmr0: u8,
    option: u8,
    prescaler: u8,
    watchdog: Pic16Watchdog,
    /// Up to here everything is done: edges and samples before this clock, counts and watchdog pulses at it too.
    now: u64,
    /// Level of T0CKI.
    t0cki: bool,
    /// Level of the instruction clock.
    q12: bool,
    /// What the last sample saw.
    sampled: bool,
    /// A rise that was seen counts at the end of this cycle; of the next one.
    seen: [bool; 2],
    /// The first clock whose edges are not lost. While the oscillator stands, clocks from its start.
    free: u64,
    /// The oscillator stands.
    asleep: bool,
}

emu_core::state! {
    Timer0 { tmr0, option, prescaler, watchdog, now, t0cki, q12, sampled, seen, free, asleep }
    if |of, now| of.now <= now + 4 && of.free <= WRITE_INHIBIT_CLOCKS + if of.asleep { 0 } else { now + 4 }
}

impl Timer0 {
    /// The timer as after power-up at clock 0. `wdte`: the configuration word lets the watchdog run; `wdt_clocks`: its period
    /// without prescaler in clocks of the oscillator; `wdtcon`: the chip has WDTCON (16F87, 16F88), and the period is that with
    /// WDTPS = 0100.
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

    /// A reset at `t`: OPTION is FFh, the prescaler and the watchdog start from zero, TMR0 stays.
    pub fn reset(&mut self, t: u64) {
        // What was due up to here is lost with the reset.
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

    /// CLRWDT, SLEEP: clears the watchdog at `t`, and the prescaler where it is the watchdog's.
    pub fn clear_watchdog(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
        self.watchdog.clear(t);
        if self.has(PSA) {
            self.prescaler = 0;
        }
    }

    /// The watchdog is on.
    #[must_use]
    pub const fn has_running_watchdog(&self) -> bool {
        self.watchdog.is_running()
    }

    const fn has(&self, bit: u8) -> bool {
        self.option & bit != 0
    }

    /// The bit of the prescaler that PS picks.
    const fn tap(&self) -> bool {
        self.prescaler >> (self.option & PS) & 1 != 0
    }

    /// What timer 0 counts, before the prescaler.
    const fn input(&self) -> bool {
        if self.has(T0CS) { self.t0cki != self.has(T0SE) } else { self.q12 }
    }

    /// What the samples see.
    const fn output(&self) -> bool {
        if self.has(PSA) { self.input() } else { !self.tap() }
    }

    /// What the prescaler sees of timer 0's input. The watchdog's pulses are too short to be met here.
    const fn ripple(&self) -> bool {
        !self.has(PSA) && self.input()
    }

    /// The watchdog's time-out as a level.
    const fn is_timeout_pending(&self) -> bool {
        self.watchdog.is_running() && self.has(PSA) && self.tap()
    }

    /// Instruction cycles to a count, from a moment at which the chain is [`Timer0::is_regular`]; `counts` at least 1.
    fn cycles(&self, counts: u64) -> u64 {
        if self.has(PSA) {
            return counts;
        }
        let shift = (self.option & PS) + 1;
        (counts << shift) - (u64::from(self.prescaler) & ((1 << shift) - 1))
    }

    /// Cycles until TMR0 goes from FFh to 00h.
    fn cycles_to_overflow(&self) -> u64 {
        self.cycles(256 - u64::from(self.tmr0))
    }

    /// An edge at `t` is not lost.
    const fn counts_at(&self, t: u64) -> bool {
        if self.asleep { self.free == 0 } else { t >= self.free }
    }

    /// Changes a level at `t`. The prescaler counts asynchronously, whether the oscillator runs or not.
    fn change_setup(&mut self, t: u64, change: impl FnOnce(&mut Timer0)) {
        let before = self.ripple();
        change(self);
        if !before && self.ripple() && self.counts_at(t) {
            self.prescaler = self.prescaler.wrapping_add(1);
        }
    }

    /// One clock.
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

    /// Counts up to the next return to 0 at most, and is at the last count now.
    fn count(&mut self, counts: u64, out: &mut Pic16Outbox) {
        let to = u64::from(self.tmr0) + counts;
        self.tmr0 = to as u8;
        if to > 0xFF {
            out.push(Pic16Signal::Flag { t: self.now, flag: InterruptFlag::T0IF });
        }
    }

    /// Nothing is in flight.
    const fn is_idle(&self) -> bool {
        !self.seen[0] && !self.seen[1]
    }

    /// Nothing will count before a line changes.
    const fn is_still(&self) -> bool {
        self.asleep || (self.has(T0CS) && self.is_idle() && self.sampled == self.output())
    }

    /// Each cycle from now on does the same: nothing is in flight and nothing is inhibited.
    const fn is_regular(&self) -> bool {
        !self.has(T0CS)
            && self.now.is_multiple_of(4)
            && self.is_idle()
            && self.now >= self.free
            && self.sampled == self.output()
    }

    /// Whole cycles up to `t`, or up to the next return to 0.
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

    /// Everything up to `t` but time-outs.
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

    /// Everything up to `t`.
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

    /// The watchdog runs out now, and begins anew.
    fn time_out(&mut self, out: &mut Pic16Outbox) {
        out.push(Pic16Signal::Watchdog { t: self.now });
        if self.has(PSA) {
            self.prescaler = 0;
        }
    }

    /// When the watchdog will run out. The bit that PS picks is clear: where it is set the time-out has been.
    fn timeout(&self) -> u64 {
        let pulses = if self.has(PSA) {
            let ratio = 1u64 << (self.option & PS);
            ratio - (u64::from(self.prescaler) & (ratio - 1))
        } else {
            1
        };
        self.watchdog.timeouts().nth_after(self.now, pulses)
    }

    /// When TMR0 will go from FFh to 00h.
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

    /// The timer as it will be at `t`.
    fn advanced_to(&self, t: u64) -> Timer0 {
        let mut ahead = *self;
        ahead.advance(t, &mut Pic16Outbox::new());
        ahead
    }
}

impl Pic16Device for Timer0 {
    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
    }

    fn next_clock(&self) -> u64 {
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

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Pic16Outbox) {
        if reg == Sfr::TMR0 {
            // The value takes the place of a count that falls on the write.
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
                // A hand can write while the oscillator stands.
                self.free = if self.asleep { WRITE_INHIBIT_CLOCKS } else { t.saturating_add(WRITE_INHIBIT_CLOCKS) };
            }
            Sfr::OPTION => {
                self.change_setup(t, |s| s.option = value);
                // Bits that timer 0 left in the prescaler can be a time-out (DS33023, 11.6.1).
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

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.settle(t, out);
        if !self.asleep {
            self.asleep = true;
            self.free = self.free.saturating_sub(t);
        }
    }

    /// The wake-up clears the watchdog, whatever its cause.
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
