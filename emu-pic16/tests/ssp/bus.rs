//! Two lines with pull-ups, which every device can only pull low.

use emu_pic16::periph::map::{Pic16Line, Sfr};
use emu_pic16::periph::{Device, ssp::Pic16Ssp};

use crate::rig::TestBench;

/// Ports on one I2C bus, and an outside device.
pub struct Bus {
    pub rigs: Vec<TestBench>,
    /// Whether the outside device pulls SCL and SDA low.
    pub hand: [bool; 2],
    /// Levels of SCL and SDA.
    pub wires: [bool; 2],
    /// Edges: clock, line (0 is SCL), level.
    pub edges: Vec<(u64, usize, bool)>,
    pub t: u64,
}

impl Bus {
    pub fn new(ports: Vec<Pic16Ssp>) -> Bus {
        let rigs = ports.into_iter().map(TestBench::new).collect();
        let mut bus = Bus { rigs, hand: [false; 2], wires: [false; 2], edges: Vec::new(), t: 0 };
        bus.settle();
        bus.edges.clear();
        bus
    }

    /// Passes the line levels to all devices until they are stable.
    pub fn settle(&mut self) {
        for _ in 0..40 {
            let mut rest = true;
            // SDA first: lines that are released together must not look like a Stop.
            for wire in [1, 0] {
                let level = !self.hand[wire] && self.rigs.iter().all(|bench| !bench.pulls()[wire]);
                if self.wires[wire] != level {
                    rest = false;
                    self.wires[wire] = level;
                    self.edges.push((self.t, wire, level));
                    for bench in &mut self.rigs {
                        bench.line([Pic16Line::Sck, Pic16Line::Sdi][wire], level, self.t);
                    }
                }
            }
            if rest {
                return;
            }
        }
        panic!("the bus does not come to rest");
    }

    /// Runs up to and including a clock.
    pub fn to(&mut self, t: u64) {
        while self.t < t {
            self.t += 1;
            for bench in &mut self.rigs {
                bench.tick(self.t);
            }
            self.settle();
        }
    }

    pub fn write(&mut self, who: usize, reg: Sfr, value: u8) {
        assert!(self.t.is_multiple_of(4), "instructions write at the end of a cycle");
        self.rigs[who].write(reg, value, self.t);
        self.settle();
    }

    pub fn read(&mut self, who: usize, reg: Sfr) -> u8 {
        let value = self.rigs[who].read(reg, self.t);
        self.settle();
        value
    }

    pub fn peek(&self, who: usize, reg: Sfr) -> u8 {
        self.rigs[who].port.peek(reg, self.t)
    }

    /// Runs to the end of the cycle in which a device has set another flag, or for `limit` clocks.
    pub fn until_flag(&mut self, who: usize, limit: u64) {
        let (had, end) = (self.rigs[who].flags.len(), self.t + limit);
        while self.rigs[who].flags.len() == had && self.t < end {
            self.to(self.t + 1);
        }
        self.to(self.t.next_multiple_of(4));
    }
}
