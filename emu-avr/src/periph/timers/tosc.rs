//! The clock of the asynchronous timer: a watch crystal at TOSC1 and TOSC2, or a clock at TOSC1 (section
//! 18.9).

use emu_core::NEVER;

/// Rising edges of TOSC1, counted since power-on. At power-on the phase of the crystal is zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct AsyncOscillator {
    /// Number of edges up to the cycle `since`.
    edges: u64,
    since: u64,
    /// Elapsed part of the next period at `since`, in units of 1 / `rate`.
    part: u64,
    /// Frequency of the crystal in Hz.
    hz: u64,
    /// Clock of the chip in Hz.
    rate: u64,
    external: bool,
    stopped: bool,
}

emu_core::state! {
    AsyncOscillator { edges, since, part, hz, rate, external, stopped }
    if |tosc, now| tosc.since <= now + 1 && tosc.rate != 0 && tosc.part < tosc.rate && tosc.edges != NEVER
        && ![tosc.hz, tosc.rate].contains(&NEVER)
}

/// How far the 32 kHz crystal has run.
#[derive(Debug, Clone, Copy)]
struct CrystalPhase {
    /// The number of edges.
    edges: u64,
    /// The part of the time to the next edge that has passed, in units of the crystal's rate.
    part: u64,
}

impl AsyncOscillator {
    /// A crystal of 32,768 Hz; the chip sets its own clock later.
    pub(super) const NEW: AsyncOscillator =
        AsyncOscillator { edges: 0, since: 0, part: 0, hz: 32_768, rate: 1_000_000, external: false, stopped: false };

    /// Returns the number of edges up to and including the cycle `t`.
    pub(super) fn index(&self, t: u64) -> u64 {
        self.edge_and_remainder(t).edges
    }

    /// Returns the cycle of the edge `n`, or a past cycle if the edge has passed; `NEVER` if it is unknown.
    pub(super) fn time(&self, n: u64) -> u64 {
        match n.checked_sub(self.edges) {
            None | Some(0) => self.since,
            Some(_) if self.is_stopped() => NEVER,
            Some(ahead) => {
                let parts = u128::from(ahead) * u128::from(self.rate) - u128::from(self.part);
                let cycles = parts.div_ceil(u128::from(self.hz));
                u64::try_from(cycles).map_or(NEVER, |cycles| self.since.saturating_add(cycles))
            }
        }
    }

    /// Counts a rising edge of an external clock.
    pub(super) fn pulse(&mut self, t: u64) {
        if self.external && !self.stopped {
            self.rebase(t);
            self.edges += 1;
        }
    }

    /// Selects the external clock or the crystal.
    pub(super) fn set_external(&mut self, external: bool, t: u64) {
        self.rebase(t);
        self.external = external;
    }

    /// Stops the oscillator, or lets it continue.
    pub(super) fn set_stopped(&mut self, stopped: bool, t: u64) {
        self.rebase(t);
        self.stopped = stopped;
    }

    /// Sets the frequency of the crystal in Hz; 0 means no crystal.
    pub(super) fn set_hz(&mut self, hz: u64, t: u64) {
        self.rebase(t);
        self.hz = hz;
    }

    /// Sets the clock of the chip in Hz; values below 1 count as 1.
    pub(super) fn set_rate(&mut self, rate: u64, t: u64) {
        self.rebase(t);
        let rate = rate.max(1);
        self.part = (u128::from(self.part) * u128::from(rate) / u128::from(self.rate)) as u64;
        self.rate = rate;
    }

    const fn is_stopped(&self) -> bool {
        self.external || self.stopped || self.hz == 0
    }

    fn rebase(&mut self, t: u64) {
        CrystalPhase { edges: self.edges, part: self.part } = self.edge_and_remainder(t);
        self.since = t;
    }

    fn edge_and_remainder(&self, t: u64) -> CrystalPhase {
        if self.is_stopped() {
            return CrystalPhase { edges: self.edges, part: self.part };
        }
        let parts = u128::from(t.saturating_sub(self.since)) * u128::from(self.hz) + u128::from(self.part);
        let rate = u128::from(self.rate);
        let edges = u64::try_from(parts / rate).unwrap_or(u64::MAX);
        CrystalPhase { edges: self.edges.saturating_add(edges), part: (parts % rate) as u64 }
    }
}
