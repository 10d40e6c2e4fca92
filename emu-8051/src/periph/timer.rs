//! Timers 0 and 1 in closed form (user's manual, "Timer/Counters": modes 0 to 3, GATE, C/T; TMOD and TCON).
//!
//! Both are in one value because mode 3 of timer 0 uses TR1 and TF1. Where the manual is silent, the model
//! decides:
//!
//! - Mode 0: TL counts as eight bits, of which the lower five cause the carry into TH. The manual calls the
//!   upper three indeterminate.
//! - A gated timer counts in a cycle in which its INT pin is sampled high, and not in one in which it is
//!   sampled low.
//! - The edge detectors of T0 and T1 always run. An edge counts if the timer runs as a counter in the cycle
//!   after the low sample, regardless of its mode at the samples.
//! - While timer 0 is in mode 3, TH0 uses TR1 and TF1 and nothing else: GATE of timer 1 still stops timer 1
//!   by its INT pin, and has no effect on TH0.
//! - A flag that is already set is not set again: its time stays that of the first overflow.

use super::map::{pin, sfr};
use super::ticks::Ticks;
use super::{Device, Mcs51Outbox, Mcs51Signal};
use emu_core::NEVER;
use emu_core::pins::PinId;
use emu_core::state;

const GATE: u8 = 8;
const COUNTER: u8 = 4;
const MODE: u8 = 3;

/// A pin that is sampled at S5P2 of every cycle, with a detector of falling edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InputPin {
    /// The level at the cycle `at` and later.
    pub(super) level: bool,
    /// The level in the cycle before `at`.
    was: bool,
    at: u64,
    /// The cycle of the low sample of the last falling edge.
    pub(super) fell_cycle: u64,
}

state! { InputPin { level, was, at, fell_cycle } }

impl InputPin {
    /// A pin that has been high from the start.
    pub(super) const HIGH: InputPin = InputPin { level: true, was: true, at: NEVER, fell_cycle: NEVER };

    /// Sets the level from `cycle` on. Of several changes in one cycle the last one is sampled.
    pub(super) fn drive(&mut self, level: bool, cycle: u64) {
        if cycle != self.at {
            self.was = self.level;
            self.at = cycle;
        }
        self.level = level;
        if self.was && !level {
            self.fell_cycle = cycle;
        } else if self.fell_cycle == cycle {
            self.fell_cycle = NEVER;
        }
    }

    /// The cycle in which the last falling edge is counted: the one after the low sample.
    pub(super) fn counted_cycle(&self) -> u64 {
        self.fell_cycle.saturating_add(1)
    }
}

/// Number of overflows within `counts` counts if the first comes with count number `first` and then one every
/// `period` counts.
pub(super) fn overflows_in(counts: u64, first: u64, period: u64) -> u64 {
    if counts < first { 0 } else { 1 + (counts - first) / period }
}

/// What a counter counts.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimerFeed {
    Off,
    /// Every cycle.
    Cycles,
    /// An edge, counted in this cycle.
    OneEdge(u64),
}

/// How the bytes of a timer are combined.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TimerShape {
    /// Mode 0.
    Thirteen,
    /// Mode 1.
    Sixteen,
    /// Mode 2.
    Reload,
    /// TL0 in mode 3.
    Low,
    /// TH0 in mode 3.
    High,
}

/// The state that counting changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct TimerCounts {
    synced: u64,
    tl: [u8; 2],
    th: [u8; 2],
    flag: [bool; 2],
    since: [u64; 2],
    overflows: u64,
}

state! {
    TimerCounts { synced, tl, th, flag, since, overflows } if |of, now| of.synced <= now && of.overflows != NEVER
}

/// When a timer overflows, in counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct OverflowCounts {
    /// Counts until the next overflow.
    pub(super) first: u64,
    /// Counts from one overflow to the next.
    pub(super) period: u64,
}

impl TimerCounts {
    /// Counts until the next overflow of timer `n`, and from one overflow to the next.
    fn counts_to_overflow(&self, n: usize, shape: TimerShape) -> OverflowCounts {
        let (tl, th) = (u64::from(self.tl[n]), u64::from(self.th[n]));
        match shape {
            TimerShape::Thirteen => OverflowCounts { first: 0x2000 - (th << 5 | tl & 0x1F), period: 0x2000 },
            TimerShape::Sixteen => OverflowCounts { first: 0x1_0000 - (th << 8 | tl), period: 0x1_0000 },
            TimerShape::Reload => OverflowCounts { first: 0x100 - tl, period: 0x100 - th },
            TimerShape::Low => OverflowCounts { first: 0x100 - tl, period: 0x100 },
            TimerShape::High => OverflowCounts { first: 0x100 - th, period: 0x100 },
        }
    }

    /// Sets the registers of timer `n` to their values after `counts` more counts.
    fn add_counts(&mut self, n: usize, shape: TimerShape, counts: u64) {
        let (tl, th) = (self.tl[n], self.th[n]);
        let low = tl.wrapping_add(counts as u8);
        match shape {
            TimerShape::Thirteen => {
                let sum = (u64::from(th) << 5 | u64::from(tl & 0x1F)).wrapping_add(counts);
                (self.tl[n], self.th[n]) = (low, (sum >> 5) as u8);
            }
            TimerShape::Sixteen => {
                let sum = (u64::from(th) << 8 | u64::from(tl)).wrapping_add(counts);
                (self.tl[n], self.th[n]) = (low, (sum >> 8) as u8);
            }
            TimerShape::Reload => {
                let OverflowCounts { first, period } = self.counts_to_overflow(n, shape);
                self.tl[n] = if counts < first { low } else { th.wrapping_add(((counts - first) % period) as u8) };
            }
            TimerShape::Low => self.tl[n] = low,
            TimerShape::High => self.th[n] = th.wrapping_add(counts as u8),
        }
    }
}

/// Timer 0, or TL0 in mode 3.
const TIMER0_COUNTER: usize = 0;
/// TH0 in mode 3.
const TH0_COUNTER: usize = 1;
/// Timer 1.
const TIMER1_COUNTER: usize = 2;
/// The timer that contains the registers of each of the three counters.
const COUNTER_OWNER: [usize; 3] = [0, 0, 1];

/// Timers 0 and 1 as of the cycle to which they are advanced. A write takes effect in the cycle after that.
/// Where a timer is given by number, only the lowest bit of the number is used.
#[derive(Debug, Clone, PartialEq)]
pub struct Mcs51Timers {
    tmod: u8,
    run: [bool; 2],
    t: [InputPin; 2],
    int: [bool; 2],
    /// Derived from the fields above: feed and shape of the three counters, and whether any of them counts.
    counter_setup: [(TimerFeed, TimerShape); 3],
    is_counting: bool,
    counts: TimerCounts,
    /// The counts at the last register write or pin change. They are restored when a second change falls into
    /// a cycle that has already been counted.
    counts_before: TimerCounts,
}

// The setup is derived from the other fields.
state! {
    Mcs51Timers { tmod, run, t, int, counts, counts_before } stays { counter_setup, is_counting } if |timers, now| timers.counts.synced + 1 >= now, then Mcs51Timers::update_setup
}

/// TMOD and the counts; TCON is shared with the external interrupts, so the chip reads and writes its bits
/// one by one. A write at the end of cycle `t` acts from cycle `t + 1` on, a level at S5P2 of cycle `t` from
/// `t` on. The last level of a cycle wins. There is no signal: the chip asks for the flags.
impl Device<Mcs51Signal> for Mcs51Timers {
    /// A direct address.
    type Reg = u8;

    fn interrupt_requests(&self) -> u8 {
        u8::from(self.flag(0)) | u8::from(self.flag(1)) << 1
    }

    fn peek(&self, reg: u8, t: u64) -> u8 {
        if t > self.counts.synced {
            let mut timers = self.clone();
            timers.advance_to(t);
            return timers.peek(reg, t);
        }
        match reg {
            sfr::TMOD => self.tmod,
            sfr::TL0 => self.counts.tl[0],
            sfr::TL1 => self.counts.tl[1],
            sfr::TH0 => self.counts.th[0],
            sfr::TH1 => self.counts.th[1],
            _ => 0,
        }
    }

    fn write(&mut self, reg: u8, value: u8, mask: u8, t: u64, _out: &mut Mcs51Outbox) {
        self.advance_to(t);
        let register = match reg {
            sfr::TMOD => &mut self.tmod,
            sfr::TL0 => &mut self.counts.tl[0],
            sfr::TL1 => &mut self.counts.tl[1],
            sfr::TH0 => &mut self.counts.th[0],
            sfr::TH1 => &mut self.counts.th[1],
            _ => return,
        };
        *register = *register & !mask | value & mask;
        self.on_register_written();
    }

    /// The timers must be advanced to the cycle before `t`, or to `t` itself if a pin change of that cycle
    /// was already reported.
    fn on_line_changed(&mut self, line: PinId, high: bool, t: u64, _out: &mut Mcs51Outbox) {
        let n = usize::from(matches!(line, pin::T1 | pin::INT1));
        match line {
            pin::T0 | pin::T1 => self.change_pin(t, |timers, cycle| timers.t[n].drive(high, cycle)),
            pin::INT0 | pin::INT1 => self.change_pin(t, |timers, _| timers.int[n] = high),
            _ => {}
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, _out: &mut Mcs51Outbox) {
        *self = Mcs51Timers::new(t);
    }

    fn steady_until(&self, reg: u8, t: u64) -> u64 {
        if reg == sfr::TMOD { NEVER } else { t }
    }
}

impl Mcs51Timers {
    /// The state after reset, advanced to cycle `now`: registers 0, pins high.
    #[must_use]
    pub fn new(now: u64) -> Mcs51Timers {
        let counts =
            TimerCounts { synced: now, tl: [0; 2], th: [0; 2], flag: [false; 2], since: [NEVER; 2], overflows: 0 };
        let mut timers = Mcs51Timers {
            tmod: 0,
            run: [false; 2],
            t: [InputPin::HIGH; 2],
            int: [true; 2],
            counter_setup: [(TimerFeed::Off, TimerShape::Thirteen); 3],
            is_counting: false,
            counts,
            counts_before: counts,
        };
        timers.update_setup();
        timers
    }

    /// Drops the counts kept for restoring if no change can need them any more, because cycle `t` has begun.
    pub fn normalize(&mut self, t: u64) {
        self.advance_to(t.saturating_sub(1));
        if self.counts_before.synced.saturating_add(1) < t {
            self.counts_before = self.counts;
        }
    }

    /// As [`Mcs51Timers::advance_to`], but at a boundary: pins can still change in cycle `now`, which is then
    /// counted again.
    pub fn advance_before(&mut self, now: u64) {
        self.advance_to(now.saturating_sub(1));
        if self.counts.synced < now {
            self.counts_before = self.counts;
        }
        self.advance_to(now);
    }

    /// Counts all cycles up to and including `now` that have not been counted.
    #[inline]
    pub fn advance_to(&mut self, now: u64) {
        if now > self.counts.synced {
            if self.is_counting {
                self.count_to(now);
            }
            self.counts.synced = now;
        }
    }

    /// TRn.
    #[must_use]
    pub fn run(&self, n: usize) -> bool {
        self.run[n & 1]
    }

    /// TFn.
    #[must_use]
    pub fn flag(&self, n: usize) -> bool {
        self.counts.flag[n & 1]
    }

    /// The cycle at whose S5P2 TFn was set: that of the overflow, or the one after a write. [`NEVER`] if it
    /// is clear.
    #[must_use]
    pub fn flag_set_since(&self, n: usize) -> u64 {
        self.counts.since[n & 1]
    }

    /// Writes TRn.
    pub fn set_run(&mut self, n: usize, on: bool) {
        self.run[n & 1] = on;
        self.on_register_written();
    }

    /// Writes TFn, for a program or for the hardware that clears it when the interrupt is taken.
    pub fn set_flag(&mut self, n: usize, on: bool) {
        let next = self.counts.synced.saturating_add(1);
        let since = &mut self.counts.since[n & 1];
        *since = if on { (*since).min(next) } else { NEVER };
        self.counts.flag[n & 1] = on;
        self.on_register_written();
    }

    /// The cycle of the next overflow that sets TFn if no register or pin changes, even if TFn is already
    /// set; [`NEVER`] if there is none.
    #[must_use]
    pub fn next_flag(&self, n: usize) -> u64 {
        match (n & 1, self.is_split()) {
            (0, _) => self.overflow_cycle(&self.counts, TIMER0_COUNTER),
            (_, true) => self.overflow_cycle(&self.counts, TH0_COUNTER),
            (_, false) => self.overflow_cycle(&self.counts, TIMER1_COUNTER),
        }
    }

    /// The overflows of timer 1 since power-up, exact from the last register write, pin change or boundary
    /// on. They clock the serial port, even if they set no flag because timer 0 is in mode 3.
    #[must_use]
    pub fn ticks(&self) -> Ticks {
        self.ticks_from(&self.counts_before)
    }

    /// Whether the counts are what those of the last change foresaw; only a damaged snapshot has others.
    pub(crate) fn is_sound(&self) -> bool {
        self.ticks().continues_as(&self.ticks_from(&self.counts), self.counts.synced)
    }

    fn ticks_from(&self, counts: &TimerCounts) -> Ticks {
        let (feed, shape) = self.counter_setup[TIMER1_COUNTER];
        let OverflowCounts { period, .. } = counts.counts_to_overflow(1, shape);
        Ticks {
            count: counts.overflows,
            next: self.overflow_cycle(counts, TIMER1_COUNTER),
            period: if feed == TimerFeed::Cycles { period } else { NEVER },
            in_states: false,
        }
    }

    /// Whether timer 0 is in mode 3.
    fn is_split(&self) -> bool {
        self.tmod & MODE == 3
    }

    /// Must be called after every write.
    fn on_register_written(&mut self) {
        self.update_setup();
        self.counts_before = self.counts;
    }

    fn update_setup(&mut self) {
        let split = self.is_split();
        let feed = |n: usize, run: bool| {
            let control = self.tmod >> (4 * n);
            if !run || control & GATE != 0 && !self.int[n] {
                TimerFeed::Off
            } else if control & COUNTER == 0 {
                TimerFeed::Cycles
            } else if self.t[n].fell_cycle == NEVER {
                TimerFeed::Off
            } else {
                TimerFeed::OneEdge(self.t[n].counted_cycle())
            }
        };
        let shape = |mode: u8| match mode & MODE {
            0 => TimerShape::Thirteen,
            1 => TimerShape::Sixteen,
            2 => TimerShape::Reload,
            _ => TimerShape::Low,
        };
        let halves = if split && self.run[1] { TimerFeed::Cycles } else { TimerFeed::Off };
        let held = self.tmod >> 4 & MODE == 3;
        let second = if held { TimerFeed::Off } else { feed(1, self.run[1] || split) };
        self.counter_setup =
            [(feed(0, self.run[0]), shape(self.tmod)), (halves, TimerShape::High), (second, shape(self.tmod >> 4))];
        self.is_counting = self.counter_setup.iter().any(|&(feed, _)| feed != TimerFeed::Off);
    }

    fn change_pin(&mut self, cycle: u64, change: impl FnOnce(&mut Mcs51Timers, u64)) {
        self.advance_to(cycle.saturating_sub(1));
        let synced = self.counts.synced;
        if synced == cycle && self.counts_before.synced == cycle.wrapping_sub(1) {
            self.counts = self.counts_before;
        } else {
            self.counts_before = self.counts;
        }
        change(self, cycle.max(synced));
        self.update_setup();
        self.advance_to(synced);
    }

    /// Number of counts that a feed gives in the cycles that are not counted yet, up to `now`.
    fn counts_fed(&self, feed: TimerFeed, now: u64) -> u64 {
        match feed {
            TimerFeed::Off => 0,
            TimerFeed::Cycles => now.saturating_sub(self.counts.synced),
            TimerFeed::OneEdge(cycle) => u64::from(self.counts.synced < cycle && cycle <= now),
        }
    }

    /// The cycle of a counter's next overflow after `counts`; [`NEVER`] if there is none.
    fn overflow_cycle(&self, counts: &TimerCounts, counter: usize) -> u64 {
        let (feed, shape) = self.counter_setup[counter];
        let OverflowCounts { first, .. } = counts.counts_to_overflow(COUNTER_OWNER[counter], shape);
        match feed {
            TimerFeed::Cycles => counts.synced.saturating_add(first),
            TimerFeed::OneEdge(cycle) if first == 1 && cycle > counts.synced => cycle,
            _ => NEVER,
        }
    }

    fn count_to(&mut self, now: u64) {
        let split = self.is_split();
        for counter in [TIMER0_COUNTER, TH0_COUNTER, TIMER1_COUNTER] {
            let (feed, shape) = self.counter_setup[counter];
            let n = COUNTER_OWNER[counter];
            let counts = self.counts_fed(feed, now);
            if counts == 0 {
                continue;
            }
            let OverflowCounts { first, period } = self.counts.counts_to_overflow(n, shape);
            if counts >= first {
                let cycle = self.overflow_cycle(&self.counts, counter);
                if counter == TIMER1_COUNTER {
                    self.counts.overflows += overflows_in(counts, first, period);
                }
                if counter != TIMER1_COUNTER || !split {
                    let flag = usize::from(counter != TIMER0_COUNTER);
                    self.counts.flag[flag] = true;
                    self.counts.since[flag] = self.counts.since[flag].min(cycle);
                }
            }
            self.counts.add_counts(n, shape, counts);
        }
    }
}
