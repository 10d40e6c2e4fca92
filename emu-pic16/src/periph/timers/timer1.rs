//! Timer 1 (DS33023 section 12; DS30292 and DS39582 section 6), in closed form.
//!
//! The state is kept for one clock, `at`. The value at a later clock, and the clock of the `n`th count, are
//! computed. Only edges of the pin T1CKI are processed one by one. The effects of a count (overflow, compare
//! match, reset by a special event) are handled by the caller.
//!
//! The stages follow the block diagram: input, prescaler, synchronizer, TMR1ON, counter. So the prescaler
//! continues while TMR1ON is 0, and an external clock advances it in sleep even if the synchronizer is off.

use emu_core::NEVER;

/// T1CON<0>: the counter runs.
const TMR1ON: u8 = 1 << 0;
/// T1CON<1>: external clock.
const TMR1CS: u8 = 1 << 1;
/// T1CON<2>: the external clock is *not* synchronized.
const T1SYNC: u8 = 1 << 2;
/// T1CON<3>: the oscillator runs, and is the external clock.
const T1OSCEN: u8 = 1 << 3;
/// Mask of the existing bits of T1CON.
const T1CON: u8 = 0x3F;

/// Modulus of the 3-bit prescaler.
const PRESCALER: u64 = 8;

/// Clock source of the timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ClockSource {
    /// None: Fosc/4 in sleep, or an oscillator without a crystal.
    None,
    /// Fosc/4.
    Cycles,
    /// T1CKI.
    Pin,
    /// The crystal at T1OSI and T1OSO.
    Crystal,
}

/// The crystal at T1OSI and T1OSO, and the oscillator of the chip, in Hz. Timer 1 keeps only crystals with `0
/// < hz <= osc`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timer1Crystal {
    /// Frequency of the chip's oscillator.
    pub osc: u64,
    /// Frequency of the crystal.
    pub hz: u64,
}

impl Timer1Crystal {
    /// Returns the rising edges within `clocks` after switching on; the `k`th comes after `k` periods.
    fn rises(self, clocks: u64) -> u64 {
        (u128::from(clocks) * u128::from(self.hz) / u128::from(self.osc)) as u64
    }

    /// Returns the falling edges, half a period before the rising ones.
    fn falls(self, clocks: u64) -> u64 {
        let (osc, hz) = (u128::from(self.osc), u128::from(self.hz));
        ((2 * u128::from(clocks) * hz + osc) / (2 * osc)) as u64
    }

    /// Returns the clocks up to the `k`th rising edge.
    fn rise(self, k: u64) -> u64 {
        u64::try_from((u128::from(k) * u128::from(self.osc)).div_ceil(u128::from(self.hz))).unwrap_or(NEVER)
    }
}

/// Returns the cycle boundary at which an edge that left the prescaler at `t` passes the synchronizer. It
/// samples at the start of Q2 and counts at the end of that cycle, so an edge takes 3 to 6 clocks (DS30292
/// table 15-4, parameter 48: 2 to 7 Tosc).
const fn synchronised(t: u64) -> u64 {
    t.saturating_add(6) & !3
}

/// Returns the last clock whose edges have passed the synchronizer at `t`; see [`synchronised`].
const fn sampled(t: u64) -> u64 {
    (t & !3).saturating_sub(3)
}

/// Timer 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Timer1 {
    con: u8,
    crystal: Option<Timer1Crystal>,
    /// Clock since which the crystal oscillates.
    swings: u64,
    /// Level of T1CKI.
    pin: bool,
    /// Clock for which `value` and `prescaler` are valid.
    at: u64,
    value: u16,
    /// Three bits, of which T1CKPS selects how many divide.
    prescaler: u8,
    /// True if the next rising edge does not count, because no falling edge has come yet (DS30292 section
    /// 6.2).
    unarmed: bool,
    /// Boundaries at which edges in the synchronizer will count, in order; `NEVER` for an unused entry. Two
    /// are enough: an edge stays there for less than two cycles, and a cycle counts at most once.
    flight: [u64; 2],
    asleep: bool,
}

emu_core::state! {
    Timer1 { con, swings, pin, at, value, prescaler, unarmed, flight, asleep } stays { crystal }
    if |of, now| of.swings <= of.at && of.at <= now + 4 && u64::from(of.prescaler) < PRESCALER
}

/// The first boundary at which a crystal edge passes the synchronizer.
#[derive(Debug, Clone, Copy)]
struct FirstBoundary {
    /// The clock of the boundary.
    boundary: u64,
    /// The number of edges by which it is late, 0 or 1.
    late: u64,
}

impl Timer1 {
    /// Returns the timer after power-on. `crystal` is `None` if there is none.
    pub(super) fn new(crystal: Option<Timer1Crystal>) -> Timer1 {
        Timer1 {
            con: 0,
            // Two edges in one clock cannot be distinguished, and no crystal is that fast.
            crystal: crystal
                .filter(|crystal| crystal.osc > 0 && crystal.hz > 0)
                .map(|crystal| Timer1Crystal { hz: crystal.hz.min(crystal.osc), ..crystal }),
            swings: 0,
            pin: false,
            at: 0,
            value: 0,
            prescaler: 0,
            unarmed: false,
            flight: [NEVER; 2],
            asleep: false,
        }
    }

    fn has_bits(&self, bits: u8) -> bool {
        self.con & bits == bits
    }

    fn source(&self) -> ClockSource {
        match (self.has_bits(TMR1CS), self.has_bits(T1OSCEN)) {
            (false, _) if self.asleep => ClockSource::None,
            (false, _) => ClockSource::Cycles,
            (true, false) => ClockSource::Pin,
            (true, true) if self.crystal.is_some() => ClockSource::Crystal,
            (true, true) => ClockSource::None,
        }
    }

    /// Reports whether the clock passes the synchronizer.
    fn synchronous(&self) -> bool {
        self.con & (TMR1CS | T1SYNC) == TMR1CS
    }

    /// Reports whether outputs of the prescaler are counted.
    fn counting(&self) -> bool {
        self.has_bits(TMR1ON) && !(self.asleep && self.synchronous())
    }

    /// Returns the binary logarithm of the prescaler ratio (1, 2, 4 or 8).
    fn scale(&self) -> u8 {
        self.con >> 4 & 3
    }

    /// Returns the position of the prescaler within its ratio.
    fn phase(&self) -> u64 {
        u64::from(self.prescaler & ((1 << self.scale()) - 1))
    }

    /// Returns the rising edges of the input in `(at, t]`. Those of the pin are not included; they are
    /// processed when they occur.
    fn inputs(&self, t: u64) -> u64 {
        if t <= self.at {
            return 0;
        }
        match (self.source(), self.crystal) {
            (ClockSource::Cycles, _) => t / 4 - self.at / 4,
            (ClockSource::Crystal, Some(c)) => c.rises(t - self.swings) - c.rises(self.at - self.swings),
            _ => 0,
        }
    }

    /// Returns the clock of the `n`th rising edge of the input after `at`.
    fn input(&self, n: u64) -> u64 {
        match (self.source(), self.crystal) {
            (ClockSource::Cycles, _) => (self.at / 4).saturating_add(n).saturating_mul(4),
            (ClockSource::Crystal, Some(c)) => {
                self.swings.saturating_add(c.rise(c.rises(self.at - self.swings).saturating_add(n)))
            }
            _ => NEVER,
        }
    }

    /// Returns the outputs of the prescaler in `(at, t]`.
    fn outputs(&self, t: u64) -> u64 {
        (self.phase() + self.inputs(t)) >> self.scale()
    }

    /// Returns the clock of the `n`th output of the prescaler after `at`.
    fn output(&self, n: u64) -> u64 {
        self.input(n.saturating_mul(1 << self.scale()) - self.phase())
    }

    /// Reports whether the crystal gives at least one edge per cycle, so that the synchronizer cannot
    /// separate them.
    fn has_edges_too_close(&self) -> bool {
        self.crystal.is_some_and(|c| u128::from(c.osc) << self.scale() < 4 * u128::from(c.hz))
    }

    /// Returns the first boundary at which a crystal edge after `at` passes the synchronizer, and the number
    /// of edges by which it is late, because an edge already in it has the same boundary.
    fn first(&self) -> FirstBoundary {
        let boundary = synchronised(self.output(1));
        if self.flight.contains(&boundary) {
            FirstBoundary { boundary: boundary.saturating_add(4), late: 1 }
        } else {
            FirstBoundary { boundary, late: 0 }
        }
    }

    /// Returns the counts in `(at, t]`.
    pub(super) fn counts(&self, t: u64) -> u64 {
        if !self.counting() {
            0
        } else if !self.synchronous() {
            self.outputs(t)
        } else {
            let flown = self.flight.iter().filter(|&&b| b <= t).count() as u64;
            let FirstBoundary { boundary: first, late } = if self.source() == ClockSource::Crystal {
                self.first()
            } else {
                FirstBoundary { boundary: NEVER, late: 0 }
            };
            let more = if !self.has_edges_too_close() {
                self.outputs(sampled(t)).saturating_sub(late)
            } else if t < first {
                0
            } else {
                (t - first) / 4 + 1
            };
            flown + more
        }
    }

    /// Returns the clock of the `n`th count after `at`, `n` at least 1, as far as it is known.
    pub(super) fn clock_of_count(&self, n: u64) -> u64 {
        if !self.counting() {
            return NEVER;
        } else if !self.synchronous() {
            return self.output(n);
        }
        let waiting = self.flight.iter().filter(|&&b| b != NEVER).count() as u64;
        if n <= waiting {
            return if n == 1 { self.flight[0] } else { self.flight[1] };
        } else if self.source() != ClockSource::Crystal {
            return NEVER;
        }
        let (n, FirstBoundary { boundary: first, late }) = (n - waiting, self.first());
        if self.has_edges_too_close() {
            first.saturating_add((n - 1).saturating_mul(4))
        } else {
            match self.output(n + late) {
                NEVER => NEVER,
                t => synchronised(t),
            }
        }
    }

    /// Returns the counter at `t`, if it only counts until then.
    pub(super) fn value(&self, t: u64) -> u16 {
        self.value.wrapping_add(self.counts(t) as u16)
    }

    /// Returns the counter at `at`.
    pub(super) fn settled(&self) -> u16 {
        self.value
    }

    /// Moves `at` to `t`. Edges stay in the synchronizer only while the timer counts.
    pub(super) fn settle(&mut self, t: u64) {
        if t < self.at {
            return;
        }
        let (value, prescaler) = (self.value(t), (u64::from(self.prescaler) + self.inputs(t)) % PRESCALER);
        let mut waiting = [NEVER; 2];
        if self.counting() && self.synchronous() {
            let next = (t & !3).saturating_add(4);
            for (slot, boundary) in waiting.iter_mut().zip([next, next.saturating_add(4)]) {
                let fresh = self.outputs(sampled(boundary).min(t)) > self.outputs(sampled(boundary - 4));
                if fresh || self.flight.contains(&boundary) {
                    *slot = boundary;
                }
            }
            waiting.sort_unstable();
        }
        (self.value, self.prescaler, self.flight, self.at) = (value, prescaler as u8, waiting, t);
    }

    /// Replaces the counter value after a count.
    pub(super) fn set(&mut self, value: u16) {
        self.value = value;
    }

    /// Handles a write to TMR1L or TMR1H; `edit` computes the new value. A count at `t` is lost, and the
    /// prescaler is cleared (DS30569 section 6.8).
    pub(super) fn write(&mut self, t: u64, edit: impl FnOnce(u16) -> u16) {
        let before = self.before(t);
        if self.uncounted() <= t {
            self.arm(t);
        } else {
            self.settle(t);
        }
        self.value = edit(before);
        self.prescaler = 0;
    }

    /// Returns the counter just before `t`.
    pub(super) fn before(&self, t: u64) -> u16 {
        if t > self.at { self.value(t - 1) } else { self.value }
    }

    /// Returns T1CON.
    pub(super) fn con(&self) -> u8 {
        self.con
    }

    /// Writes T1CON. Edges in the synchronizer are lost if the clock path changes.
    pub(super) fn write_con(&mut self, con: u8, t: u64) {
        self.settle(t);
        let changed = self.con ^ con;
        self.con = con & T1CON;
        if changed & T1OSCEN != 0 {
            self.swings = t;
        }
        if changed & (TMR1ON | TMR1CS | T1SYNC | T1OSCEN) != 0 {
            self.flight = [NEVER; 2];
        }
        if changed & (TMR1ON | TMR1CS | T1OSCEN) != 0 {
            let low = match (self.source(), self.crystal) {
                (ClockSource::Pin, _) => !self.pin,
                (ClockSource::Crystal, Some(c)) => {
                    let swung = t.saturating_sub(self.swings);
                    c.falls(swung) > c.rises(swung)
                }
                _ => false,
            };
            self.unarmed = self.has_bits(TMR1ON) && low;
        }
    }

    /// Returns the clock of the next crystal edge that must not count; results of [`Timer1::clock_of_count`]
    /// are not valid beyond it.
    pub(super) fn uncounted(&self) -> u64 {
        if self.unarmed { self.input(1) } else { NEVER }
    }

    /// Passes the edge of [`Timer1::uncounted`] at `t`.
    pub(super) fn arm(&mut self, t: u64) {
        let value = self.value;
        self.settle(t);
        self.value = value;
        self.flight = [NEVER; 2];
        self.unarmed = false;
    }

    /// Handles a change of T1CKI. Returns true if the counter counts at `t`.
    pub(super) fn line(&mut self, high: bool, t: u64) -> bool {
        let rises = high && !self.pin;
        self.pin = high;
        if !rises || self.source() != ClockSource::Pin {
            return false;
        }
        self.settle(t);
        self.prescaler = (self.prescaler + 1) % PRESCALER as u8;
        if std::mem::take(&mut self.unarmed) || self.phase() != 0 || !self.counting() {
            return false;
        }
        if self.synchronous() {
            let boundary = synchronised(t);
            if !self.flight.contains(&boundary) {
                self.flight[usize::from(self.flight[0] != NEVER)] = boundary;
            }
        }
        !self.synchronous()
    }

    /// Stops the oscillator: the synchronizer is off, and loses its edges (DS30292 section 6.3).
    pub(super) fn sleep(&mut self, t: u64) {
        self.settle(t);
        self.asleep = true;
    }

    /// Restarts the oscillator.
    pub(super) fn wake(&mut self, t: u64) {
        self.settle(t);
        self.asleep = false;
    }

    /// Resets the timer at power-on or brown-out: T1CON is 0, and so is the counter, which the data sheet
    /// calls unknown. No other reset affects the timer (DS30569 section 6.7).
    pub(super) fn power_on(&mut self, t: u64) {
        *self = Timer1 { crystal: self.crystal, pin: self.pin, at: t, ..Timer1::new(None) };
    }
}
