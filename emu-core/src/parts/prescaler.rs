//! Periodic clock edges, and the free-running clock divider that makes them.

use crate::cpu::NEVER;

/// Clock edges at the cycles `origin + k * period` for k = 1, 2, ..; none if `period` is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TickSeries {
    /// The cycle from which the edges are counted; it is not an edge itself.
    pub origin: u64,
    /// Cycles between edges; 0 for no edges.
    pub period: u64,
}

crate::state! { TickSeries { origin, period } if |ticks, _now| ticks.origin != NEVER && ticks.period != NEVER }

impl TickSeries {
    /// No edges.
    pub const NONE: TickSeries = TickSeries { origin: 0, period: 0 };

    /// Number of edges in the cycles after `from`, up to and including `to`.
    #[must_use]
    pub fn ticks_between(self, from: u64, to: u64) -> u64 {
        if to <= from { 0 } else { self.edges_until(to) - self.edges_until(from) }
    }

    /// The cycle of the `n`th edge after `from`, counted from 1, or [`NEVER`].
    #[must_use]
    pub fn nth_after(self, from: u64, n: u64) -> u64 {
        if self.period == 0 {
            return NEVER;
        }
        let edges = self.edges_until(from).saturating_add(n);
        self.origin.saturating_add(edges.saturating_mul(self.period))
    }

    fn edges_until(self, at: u64) -> u64 {
        let since = at.saturating_sub(self.origin);
        match self.period {
            0 => 0,
            // Most dividers are powers of two, and a shift is much cheaper than a division.
            every if every.is_power_of_two() => since >> every.trailing_zeros(),
            every => since / every,
        }
    }
}

/// A clock divider that runs freely until it is cleared or held at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Prescaler {
    origin: u64,
    held: bool,
}

crate::state! { Prescaler { origin, held } if |prescaler, _now| prescaler.origin != NEVER }

impl Prescaler {
    /// A divider that starts from zero at the cycle `at`.
    #[must_use]
    pub const fn new(at: u64) -> Prescaler {
        Prescaler { origin: at, held: false }
    }

    /// Clears the divider at the cycle `at`. With `held` it stays at zero from then on.
    pub fn restart(&mut self, at: u64, held: bool) {
        *self = Prescaler { origin: at, held };
    }

    /// Delays all edges by `cycles`, during which the clock of the divider was stopped.
    pub fn postpone(&mut self, cycles: u64) {
        self.origin = self.origin.saturating_add(cycles);
    }

    /// Returns true if the divider is held at zero.
    #[must_use]
    pub const fn is_held(&self) -> bool {
        self.held
    }

    /// The edges of the tap that divides by `div`. 0 means no clock. 1 means the undivided clock, which
    /// bypasses the divider and is therefore not held.
    #[must_use]
    pub const fn tap(&self, div: u16) -> TickSeries {
        if self.held && div > 1 { TickSeries::NONE } else { TickSeries { origin: self.origin, period: div as u64 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn ticks_agree_with_a_divider_that_is_stepped() {
        let seed = 0x7a11;
        let mut rng = Rng::new(seed);
        for _ in 0..2000 {
            let ticks = TickSeries { origin: rng.below(50), period: rng.below(12) };
            let (from, to) = (ticks.origin + rng.below(60), ticks.origin + rng.below(120));
            let edges: Vec<u64> = (ticks.origin + 1..to + 200)
                .scan(0, |phase, at| {
                    *phase += 1;
                    let edge = ticks.period != 0 && *phase == ticks.period;
                    if edge {
                        *phase = 0;
                    }
                    Some((edge, at))
                })
                .filter_map(|(edge, at)| edge.then_some(at))
                .collect();
            let inside = edges.iter().filter(|&&e| e > from && e <= to).count() as u64;
            assert_eq!(ticks.ticks_between(from, to), inside, "seed {seed:#x}: {ticks:?} {from}..{to}");
            let n = 1 + rng.below(3);
            if let Some(&at) = edges.iter().filter(|&&e| e > from).nth(n as usize - 1) {
                assert_eq!(ticks.nth_after(from, n), at, "seed {seed:#x}: {ticks:?} after {from}");
            }
        }
    }

    #[test]
    fn a_held_divider_gives_no_edges_but_lets_the_undivided_clock_pass() {
        let mut prescaler = Prescaler::new(3);
        assert_eq!(prescaler.tap(8).nth_after(3, 1), 11);
        prescaler.restart(20, true);
        assert_eq!(prescaler.tap(8).nth_after(20, 1), NEVER);
        assert_eq!(prescaler.tap(1).nth_after(20, 1), 21);
        prescaler.restart(30, false);
        assert_eq!(prescaler.tap(8).nth_after(30, 2), 46);
        assert_eq!(prescaler.tap(0).nth_after(30, 2), NEVER);
    }
}
