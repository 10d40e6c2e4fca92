//! Timers 0 and 1 (user's manual, "Timer/Counters": modes 0 to 3, GATE, C/T; TMOD and TCON), in closed form.
//!
//! Both stand in one value because mode 3 of timer 0 borrows TR1 and TF1. What the manual leaves open is settled so:
//!
//! - Mode 0: TL counts as eight bits of which the lower five matter for the carry into TH. The manual calls the upper
//!   three indeterminate.
//! - A gated timer counts in the cycle in which its INT pin is sampled high, and not in the one in which it is low.
//! - The edge detectors of T0 and T1 run always: an edge counts if the counter runs as a counter in the cycle after the
//!   low sample, whatever it did at the samples themselves.
//! - While timer 0 is in mode 3, TH0 takes over TR1 and TF1 and nothing else: GATE of timer 1 still holds timer 1 by its
//!   INT pin, and has no effect on TH0.
//! - A flag that is set already is not set again: its moment stays that of its first overflow.

use emu_core::NEVER;
use emu_core::state;

const GATE: u8 = 8;
const COUNTER: u8 = 4;
const MODE: u8 = 3;

/// A pin that is sampled at S5P2 of every cycle, with a detector of falling edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pin {
    /// The level at `at` and later.
    pub(super) level: bool,
    /// The level at the cycle before `at`.
    was: bool,
    at: u64,
    /// The cycle whose sample was the low one of the last falling edge.
    pub(super) fell: u64,
}

state! { Pin { level, was, at, fell } }

impl Pin {
    pub(super) const HIGH: Pin = Pin { level: true, was: true, at: NEVER, fell: NEVER };

    /// The level from `cycle` on. Of several changes in one cycle the last one is sampled.
    pub(super) fn drive(&mut self, level: bool, cycle: u64) {
        if cycle != self.at {
            self.was = self.level;
            self.at = cycle;
        }
        self.level = level;
        if self.was && !level {
            self.fell = cycle;
        } else if self.fell == cycle {
            self.fell = NEVER;
        }
    }

    /// The cycle in which the last falling edge is counted: the one after the low sample.
    pub(super) fn counted(&self) -> u64 {
        self.fell.saturating_add(1)
    }
}

/// Overflows within `counts` counts when the first comes with count number `first` and another every `period` counts.
pub(super) fn overflows_in(counts: u64, first: u64, period: u64) -> u64 {
    if counts < first { 0 } else { 1 + (counts - first) / period }
}

/// What makes a counter count.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Feed {
    Off,
    /// Every cycle.
    Cycles,
    /// An edge, counted in this cycle.
    Once(u64),
}

/// How the bytes of a timer hang together.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
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

/// What counting changes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Counts {
    synced: u64,
    tl: [u8; 2],
    th: [u8; 2],
    flag: [bool; 2],
    since: [u64; 2],
    overflows: u64,
}

state! {
    Counts { synced, tl, th, flag, since, overflows } if |of, now| of.synced <= now && of.overflows != NEVER
}

impl Counts {
    /// Counts to the next overflow of timer `n`, and from one overflow to the next.
    fn ahead(&self, n: usize, shape: Shape) -> (u64, u64) {
        let (tl, th) = (u64::from(self.tl[n]), u64::from(self.th[n]));
        match shape {
            Shape::Thirteen => (0x2000 - (th << 5 | tl & 0x1F), 0x2000),
            Shape::Sixteen => (0x1_0000 - (th << 8 | tl), 0x1_0000),
            Shape::Reload => (0x100 - tl, 0x100 - th),
            Shape::Low => (0x100 - tl, 0x100),
            Shape::High => (0x100 - th, 0x100),
        }
    }

    /// The registers of timer `n` after `counts` counts.
    fn add(&mut self, n: usize, shape: Shape, counts: u64) {
        let (tl, th) = (self.tl[n], self.th[n]);
        let low = tl.wrapping_add(counts as u8);
        match shape {
            Shape::Thirteen => {
                let sum = (u64::from(th) << 5 | u64::from(tl & 0x1F)).wrapping_add(counts);
                (self.tl[n], self.th[n]) = (low, (sum >> 5) as u8);
            }
            Shape::Sixteen => {
                let sum = (u64::from(th) << 8 | u64::from(tl)).wrapping_add(counts);
                (self.tl[n], self.th[n]) = (low, (sum >> 8) as u8);
            }
            Shape::Reload => {
                let (first, period) = self.ahead(n, shape);
                self.tl[n] = if counts < first { low } else { th.wrapping_add(((counts - first) % period) as u8) };
            }
            Shape::Low => self.tl[n] = low,
            Shape::High => self.th[n] = th.wrapping_add(counts as u8),
        }
    }
}

/// Timer 0, or TL0 in mode 3.
const FIRST: usize = 0;
/// TH0 in mode 3.
const SPLIT: usize = 1;
/// Timer 1.
const SECOND: usize = 2;
/// The timer whose registers each of the three counters above lives in.
const OWNER: [usize; 3] = [0, 0, 1];

/// Timers 0 and 1 as of the cycle they were synced to. A write acts from the cycle after that one on. Wherever a timer is
/// named by a number, only its lowest bit counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Timers {
    tmod: u8,
    run: [bool; 2],
    t: [Pin; 2],
    int: [bool; 2],
    /// What follows from the fields above: feed and shape of the three counters, and whether any of them is fed.
    plan: [(Feed, Shape); 3],
    busy: bool,
    counts: Counts,
    /// The counts when a register was last written or a pin last changed: the way back when a second change falls in a
    /// cycle that is counted already.
    before: Counts,
}

// The plan follows from the rest.
state! {
    Timers { tmod, run, t, int, counts, before } stays { plan, busy } if |timers, now| timers.counts.synced + 1 >= now, then Timers::make_plan
}

impl Timers {
    /// The state after reset, synced to cycle `now`: registers 0, pins high.
    #[must_use]
    pub fn new(now: u64) -> Timers {
        let counts = Counts { synced: now, tl: [0; 2], th: [0; 2], flag: [false; 2], since: [NEVER; 2], overflows: 0 };
        let mut timers = Timers {
            tmod: 0,
            run: [false; 2],
            t: [Pin::HIGH; 2],
            int: [true; 2],
            plan: [(Feed::Off, Shape::Thirteen); 3],
            busy: false,
            counts,
            before: counts,
        };
        timers.make_plan();
        timers
    }

    /// Forgets the way back where no change can take it any more, since cycle `t` has come.
    pub fn settle_down(&mut self, t: u64) {
        self.sync(t.saturating_sub(1));
        if self.before.synced.saturating_add(1) < t {
            self.before = self.counts;
        }
    }

    /// [`Timers::sync`] at a boundary: pins may still change in cycle `now`, which is counted anew then.
    pub fn sync_ahead(&mut self, now: u64) {
        self.sync(now.saturating_sub(1));
        if self.counts.synced < now {
            self.before = self.counts;
        }
        self.sync(now);
    }

    /// Counts everything of the cycles up to and including `now`; nothing when that has been done already.
    #[inline]
    pub fn sync(&mut self, now: u64) {
        if now > self.counts.synced {
            if self.busy {
                self.count(now);
            }
            self.counts.synced = now;
        }
    }

    /// TMOD.
    #[must_use]
    pub fn tmod(&self) -> u8 {
        self.tmod
    }

    /// TLn.
    #[must_use]
    pub fn tl(&self, n: usize) -> u8 {
        self.counts.tl[n & 1]
    }

    /// THn.
    #[must_use]
    pub fn th(&self, n: usize) -> u8 {
        self.counts.th[n & 1]
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

    /// The cycle since whose S5P2 TFn has been set: that of the overflow, or the one after that of the write.
    /// [`NEVER`] while it is clear.
    #[must_use]
    pub fn since(&self, n: usize) -> u64 {
        self.counts.since[n & 1]
    }

    /// Writes TMOD.
    pub fn set_tmod(&mut self, value: u8) {
        self.tmod = value;
        self.written();
    }

    /// Writes TLn.
    pub fn set_tl(&mut self, n: usize, value: u8) {
        self.counts.tl[n & 1] = value;
        self.written();
    }

    /// Writes THn.
    pub fn set_th(&mut self, n: usize, value: u8) {
        self.counts.th[n & 1] = value;
        self.written();
    }

    /// Writes TRn.
    pub fn set_run(&mut self, n: usize, on: bool) {
        self.run[n & 1] = on;
        self.written();
    }

    /// Writes TFn: a program, or the hardware that clears it as the interrupt is taken.
    pub fn set_flag(&mut self, n: usize, on: bool) {
        let next = self.counts.synced.saturating_add(1);
        let since = &mut self.counts.since[n & 1];
        *since = if on { (*since).min(next) } else { NEVER };
        self.counts.flag[n & 1] = on;
        self.written();
    }

    /// Pin Tn has this level at S5P2 of `cycle` and later. The timers are synced to the cycle before, or to `cycle` itself
    /// where this or another pin has been told of for that cycle before; of several the last one holds.
    pub fn pin_t(&mut self, n: usize, level: bool, cycle: u64) {
        self.drive(cycle, |timers, cycle| timers.t[n & 1].drive(level, cycle));
    }

    /// Pin INTn has this level at S5P2 of `cycle` and later; otherwise as [`Timers::pin_t`].
    pub fn pin_int(&mut self, n: usize, level: bool, cycle: u64) {
        self.drive(cycle, |timers, _| timers.int[n & 1] = level);
    }

    /// The cycle of the next overflow that sets TFn if nobody does anything, also while TFn is set; [`NEVER`] where there
    /// is none.
    #[must_use]
    pub fn next_flag(&self, n: usize) -> u64 {
        match (n & 1, self.split()) {
            (0, _) => self.overflow(FIRST, 1),
            (_, true) => self.overflow(SPLIT, 1),
            (_, false) => self.overflow(SECOND, 1),
        }
    }

    /// Overflows of timer 1 since power-up. They drive the serial port, also where they set no flag because timer 0 is in
    /// mode 3.
    #[must_use]
    pub fn overflows(&self) -> u64 {
        self.counts.overflows
    }

    /// The cycle of timer 1's overflow number `k`, counted as [`Timers::overflows`] counts, if nobody does anything;
    /// [`NEVER`] where there is none, and for those that have been.
    #[must_use]
    pub fn overflow_at(&self, k: u64) -> u64 {
        match k.checked_sub(self.counts.overflows) {
            None | Some(0) => NEVER,
            Some(ahead) => self.overflow(SECOND, ahead),
        }
    }

    /// [`Timers::overflows`] as it will be at cycle `now` if nobody does anything.
    #[must_use]
    pub fn overflows_at(&self, now: u64) -> u64 {
        let (feed, shape) = self.plan[SECOND];
        let (first, period) = self.counts.ahead(1, shape);
        self.counts.overflows + overflows_in(self.fed(feed, now), first, period)
    }

    /// Whether timer 0 is in mode 3.
    fn split(&self) -> bool {
        self.tmod & MODE == 3
    }

    /// After every write.
    fn written(&mut self) {
        self.make_plan();
        self.before = self.counts;
    }

    fn make_plan(&mut self) {
        let split = self.split();
        let feed = |n: usize, run: bool| {
            let control = self.tmod >> (4 * n);
            if !run || control & GATE != 0 && !self.int[n] {
                Feed::Off
            } else if control & COUNTER == 0 {
                Feed::Cycles
            } else if self.t[n].fell == NEVER {
                Feed::Off
            } else {
                Feed::Once(self.t[n].counted())
            }
        };
        let shape = |mode: u8| match mode & MODE {
            0 => Shape::Thirteen,
            1 => Shape::Sixteen,
            2 => Shape::Reload,
            _ => Shape::Low,
        };
        let halves = if split && self.run[1] { Feed::Cycles } else { Feed::Off };
        let held = self.tmod >> 4 & MODE == 3;
        let second = if held { Feed::Off } else { feed(1, self.run[1] || split) };
        self.plan = [(feed(0, self.run[0]), shape(self.tmod)), (halves, Shape::High), (second, shape(self.tmod >> 4))];
        self.busy = self.plan.iter().any(|&(feed, _)| feed != Feed::Off);
    }

    fn drive(&mut self, cycle: u64, change: impl FnOnce(&mut Timers, u64)) {
        self.sync(cycle.saturating_sub(1));
        let synced = self.counts.synced;
        if synced == cycle && self.before.synced == cycle.wrapping_sub(1) {
            self.counts = self.before;
        } else {
            self.before = self.counts;
        }
        change(self, cycle.max(synced));
        self.make_plan();
        self.sync(synced);
    }

    /// Counts that a feed gives in the cycles after the sync up to `now`.
    fn fed(&self, feed: Feed, now: u64) -> u64 {
        match feed {
            Feed::Off => 0,
            Feed::Cycles => now.saturating_sub(self.counts.synced),
            Feed::Once(cycle) => u64::from(self.counts.synced < cycle && cycle <= now),
        }
    }

    /// The cycle of the `k`th overflow of a counter after the sync; [`NEVER`] where there is none.
    fn overflow(&self, counter: usize, k: u64) -> u64 {
        let (feed, shape) = self.plan[counter];
        let (first, period) = self.counts.ahead(OWNER[counter], shape);
        let count = (k - 1).saturating_mul(period).saturating_add(first);
        match feed {
            Feed::Cycles => self.counts.synced.saturating_add(count),
            Feed::Once(cycle) if count == 1 && cycle > self.counts.synced => cycle,
            _ => NEVER,
        }
    }

    fn count(&mut self, now: u64) {
        let split = self.split();
        for counter in [FIRST, SPLIT, SECOND] {
            let (feed, shape) = self.plan[counter];
            let n = OWNER[counter];
            let counts = self.fed(feed, now);
            if counts == 0 {
                continue;
            }
            let (first, period) = self.counts.ahead(n, shape);
            if counts >= first {
                let cycle = self.overflow(counter, 1);
                if counter == SECOND {
                    self.counts.overflows += overflows_in(counts, first, period);
                }
                if counter != SECOND || !split {
                    let flag = usize::from(counter != FIRST);
                    self.counts.flag[flag] = true;
                    self.counts.since[flag] = self.counts.since[flag].min(cycle);
                }
            }
            self.counts.add(n, shape, counts);
        }
    }
}
