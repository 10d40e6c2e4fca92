//! Generates random programs, as text, from elements that the machine supports.

use emu_core::rng::Rng;
use ladder::LadderDialect;

use crate::machine_pair::HEAD;

/// Limits of a generated program.
#[derive(Debug, Clone, Copy)]
pub struct ProgramLimits {
    pub rungs: u64,
    /// Maximum number of elements in a series.
    pub max_series: u64,
    pub depth: u32,
    /// Maximum number of timers and counters.
    pub modules: u64,
    /// Dialect of the program; the file has the 0.1 header in any case.
    pub dialect: LadderDialect,
}

pub struct ProgramGenerator<'a> {
    rng: &'a mut Rng,
    limits: ProgramLimits,
    out: String,
    modules: Vec<String>,
    relays: u64,
}

/// Generates a program within the limits. The same seed gives the same program.
pub fn generate_program(rng: &mut Rng, wish: ProgramLimits) -> String {
    let relays = 1 + rng.below(6);
    let out = HEAD.to_owned();
    let mut draw = ProgramGenerator { rng, limits: wish, out, modules: Vec::new(), relays };
    for _ in 0..1 + draw.rng.below(wish.rungs) {
        draw.rung();
    }
    draw.out
}

impl ProgramGenerator<'_> {
    fn line(&mut self, text: &str) {
        self.out += text;
        self.out.push('\n');
    }

    fn rung(&mut self) {
        self.line("RUNG");
        if self.rng.one_in(20) {
            self.line("COMMENT of no meaning");
        } else {
            self.series(self.limits.depth);
            self.last(self.limits.depth);
        }
        self.line("END");
    }

    fn series(&mut self, depth: u32) {
        for _ in 0..1 + self.rng.below(self.limits.max_series) {
            if depth > 0 && self.rng.one_in(4) {
                self.parallel(depth, false);
            } else {
                self.middle();
            }
        }
    }

    /// Generates branches; at the end of a rung, each branch ends with an element that ends a rung.
    fn parallel(&mut self, depth: u32, last: bool) {
        self.line("PARALLEL");
        for _ in 0..2 + self.rng.below(2) {
            self.line("SERIES");
            if !last || self.rng.one_in(2) {
                self.series(depth - 1);
            }
            if last {
                self.last(depth - 1);
            }
            self.line("END");
        }
        self.line("END");
    }

    fn bit(&mut self) -> String {
        match self.rng.below(3) {
            0 => format!("X{}", self.rng.below(4)),
            1 => format!("Y{}", self.rng.below(4)),
            _ => format!("R{}", self.rng.below(self.relays)),
        }
    }

    fn middle(&mut self) {
        let text = match self.rng.below(16) {
            0 => "SHORT".to_owned(),
            1 if self.rng.one_in(3) => "OPEN".to_owned(),
            2 => "OSR".to_owned(),
            3 => "OSF".to_owned(),
            4 | 5 => self.module(false),
            _ => {
                let bit = self.bit();
                format!("CONTACTS {bit} {}", self.rng.below(2))
            }
        };
        self.line(&text);
    }

    fn last(&mut self, depth: u32) {
        if depth > 0 && self.rng.one_in(4) {
            return self.parallel(depth, true);
        }
        let text = match self.rng.below(12) {
            0 => "MASTER_RELAY".to_owned(),
            1 | 2 => self.module(true),
            3 if !self.modules.is_empty() => {
                let n = self.rng.below(self.modules.len() as u64) as usize;
                format!("RES {}", self.modules[n])
            }
            _ => {
                let bit = if self.rng.one_in(2) {
                    format!("Y{}", self.rng.below(4))
                } else {
                    format!("R{}", self.rng.below(self.relays))
                };
                let how = ["0 0 0", "0 0 0", "1 0 0", "0 1 0", "0 0 1"][self.rng.below(5) as usize];
                format!("COIL {bit} {how}")
            }
        };
        self.line(&text);
    }

    /// Generates a timer or counter with its own name; with `last` one that ends a rung.
    fn module(&mut self, last: bool) -> String {
        let n = self.modules.len() as u64;
        if n >= self.limits.modules {
            return if last { "COIL Ylast 0 0 0".to_owned() } else { "SHORT".to_owned() };
        }
        let five = self.limits.dialect == LadderDialect::Ldmicro5;
        // A rung ends with a CTC; the other kinds are used elsewhere. The CTC of LDmicro 5 has no module.
        if last || self.rng.one_in(2) {
            let kind = if last && !five { "CTC" } else { ["CTU", "CTD"][self.rng.below(2) as usize] };
            self.modules.push(format!("C{n}"));
            let max = self.limit();
            return self.counter(kind, n, max, five);
        }
        self.modules.push(format!("T{n}"));
        let kind = ["TON", "TOF", "RTO"][self.rng.below(3) as usize];
        let scans = 2 + self.rng.below(5);
        format!("{kind} T{n} {}", scans * 10_000)
    }

    fn counter(&mut self, kind: &str, n: u64, max: i64, five: bool) -> String {
        if five {
            // A CTD with the largest limit is refused, because no number is above it.
            let max = if kind == "CTD" { max.min(32_766) } else { max };
            let input = ['/', '\\', '-', 'o'][self.rng.below(4) as usize];
            format!("{kind} C{n} {max} 0 {input}")
        } else {
            format!("{kind} C{n} {max}")
        }
    }

    fn limit(&mut self) -> i64 {
        match self.rng.below(6) {
            0 => -(self.rng.below(5) as i64),
            1 => [32_767, -32_768, 32_766][self.rng.below(3) as usize],
            _ => self.rng.below(6) as i64,
        }
    }
}
