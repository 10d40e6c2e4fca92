//! Clock sources of the model: the prescaler, the pin samplers, TOSC.

/// A line sampled once per cycle; the last entry of `seen` is the level in the cycle before the edge.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    pub line: bool,
    seen: [bool; 8],
    /// Output of the noise canceler.
    quiet: bool,
}

impl Sampler {
    /// Executes one edge; returns the edges on the direct path and from the noise canceler, true for rising
    /// ones.
    pub fn tick(&mut self) -> [Option<bool>; 2] {
        self.seen.rotate_left(1);
        self.seen[7] = self.line;
        // The sample of cycle t - n is seen[8 - n]. A change in the cycle c takes effect at the edge c + 3;
        // with the noise canceler, which needs four equal samples, four cycles later.
        let direct = (self.seen[5] != self.seen[4]).then_some(self.seen[5]);
        let four = &self.seen[1..5];
        let before = self.quiet;
        if four.iter().all(|&level| level == four[0]) {
            self.quiet = four[0];
        }
        [direct, (self.quiet != before).then_some(self.quiet)]
    }
}

/// The 10-bit divider before a timer.
#[derive(Debug, Clone, Default)]
pub struct Divider {
    pub count: u64,
    pub held: bool,
}

impl Divider {
    /// Executes one clock edge; returns true if the tap `div` has an edge.
    pub fn tick(&mut self, div: u16) -> bool {
        if self.held {
            self.count = 0;
            return div == 1;
        }
        self.count += 1;
        self.count.is_multiple_of(u64::from(div))
    }
}

/// The watch crystal.
#[derive(Debug, Clone)]
pub struct Crystal {
    pub hz: u64,
    pub rate: u64,
    pub stopped: bool,
    phase: u64,
}

impl Crystal {
    pub fn new(rate: u64) -> Crystal {
        Crystal { hz: 32_768, rate, stopped: false, phase: 0 }
    }

    /// Executes one cycle; returns the number of rising edges.
    pub fn tick(&mut self) -> u64 {
        if self.stopped {
            return 0;
        }
        let mut edges = 0;
        self.phase += self.hz;
        while self.phase >= self.rate {
            self.phase -= self.rate;
            edges += 1;
        }
        edges
    }

    pub fn set_rate(&mut self, rate: u64) {
        self.phase = (u128::from(self.phase) * u128::from(rate) / u128::from(self.rate)) as u64;
        self.rate = rate;
    }
}
