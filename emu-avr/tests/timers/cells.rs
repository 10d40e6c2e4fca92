//! The clocks of the model: the prescaler, the pin samplers, TOSC.

/// A level sampled once a cycle: the last of `seen` is that of the cycle before the edge.
#[derive(Debug, Clone, Default)]
pub struct Sampler {
    pub line: bool,
    seen: [bool; 8],
    /// Output of the noise canceller.
    quiet: bool,
}

impl Sampler {
    /// One edge: the edges that come out of the direct way and of the noise canceller, true for rising ones.
    pub fn tick(&mut self) -> [Option<bool>; 2] {
        self.seen.rotate_left(1);
        self.seen[7] = self.line;
        // The sample of the cycle t - 1 is seen[7], so that of the cycle t - n is seen[8 - n]. A change in the cycle c acts at
        // the edge c + 3; by way of four equal samples four cycles later.
        let direct = (self.seen[5] != self.seen[4]).then_some(self.seen[5]);
        let four = &self.seen[1..5];
        let before = self.quiet;
        if four.iter().all(|&level| level == four[0]) {
            self.quiet = four[0];
        }
        [direct, (self.quiet != before).then_some(self.quiet)]
    }
}

/// The ten bits before a timer.
#[derive(Debug, Clone, Default)]
pub struct Divider {
    pub count: u64,
    pub held: bool,
}

impl Divider {
    /// One edge of its clock; true where the tap `div` has one.
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

    /// One cycle: its rising edges.
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
