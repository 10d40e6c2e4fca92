//! A model of timers 0 and 1 that is ticked one cycle at a time.

use emu_core::NEVER;

/// Everything that the closed form computes, found by ticking.
#[derive(Clone)]
pub struct Model {
    pub cycle: u64,
    pub tmod: u8,
    pub tl: [u8; 2],
    pub th: [u8; 2],
    pub run: [bool; 2],
    pub flag: [bool; 2],
    pub since: [u64; 2],
    pub overflows: u64,
    /// Levels in the next cycle.
    pub t: [bool; 2],
    pub int: [bool; 2],
    /// The last sample of T0 and T1, and whether the last two samples were high and then low.
    sample: [bool; 2],
    edge: [bool; 2],
    /// Cycles in which hardware set TFn, and cycles of timer 1's overflows, since the logs were cleared.
    pub flags_log: [Vec<u64>; 2],
    pub overflow_log: Vec<u64>,
}

impl Model {
    pub fn new(cycle: u64) -> Model {
        Model {
            cycle,
            tmod: 0,
            tl: [0; 2],
            th: [0; 2],
            run: [false; 2],
            flag: [false; 2],
            since: [NEVER; 2],
            overflows: 0,
            t: [true; 2],
            int: [true; 2],
            sample: [true; 2],
            edge: [false; 2],
            flags_log: [Vec::new(), Vec::new()],
            overflow_log: Vec::new(),
        }
    }

    pub fn write_flag(&mut self, n: usize, on: bool) {
        if on && !self.flag[n] {
            self.since[n] = self.cycle + 1;
        } else if !on {
            self.since[n] = NEVER;
        }
        self.flag[n] = on;
    }

    /// Executes one machine cycle.
    pub fn tick(&mut self) {
        self.cycle += 1;
        let split = self.tmod & 3 == 3;
        for n in 0..2 {
            let mode = self.tmod >> (4 * n) & 3;
            let gate = self.tmod >> (4 * n) & 8 != 0;
            let counter = self.tmod >> (4 * n) & 4 != 0;
            // In mode 3, TH0 uses TR1, and timer 1 runs without it.
            let run = self.run[n] || n == 1 && split;
            if run && (!gate || self.int[n]) && (!counter || self.edge[n]) {
                let over = self.step(n, mode);
                if over && n == 1 {
                    self.overflows += 1;
                    self.overflow_log.push(self.cycle);
                }
                if over && !(n == 1 && split) {
                    self.set(n);
                }
            }
        }
        if split && self.run[1] {
            self.th[0] = self.th[0].wrapping_add(1);
            if self.th[0] == 0 {
                self.set(1);
            }
        }
        for n in 0..2 {
            self.edge[n] = self.sample[n] && !self.t[n];
            self.sample[n] = self.t[n];
        }
    }

    fn set(&mut self, n: usize) {
        self.flags_log[n].push(self.cycle);
        if !self.flag[n] {
            self.flag[n] = true;
            self.since[n] = self.cycle;
        }
    }

    /// Counts once; returns whether it overflows.
    fn step(&mut self, n: usize, mode: u8) -> bool {
        if mode == 3 && n == 1 {
            return false;
        }
        self.tl[n] = self.tl[n].wrapping_add(1);
        let carry = if mode == 0 { self.tl[n] & 0x1F == 0 } else { self.tl[n] == 0 };
        match mode {
            0 | 1 if carry => {
                self.th[n] = self.th[n].wrapping_add(1);
                self.th[n] == 0
            }
            2 if carry => {
                self.tl[n] = self.th[n];
                true
            }
            3 => carry,
            _ => false,
        }
    }
}
