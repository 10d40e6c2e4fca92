//! Standard function blocks of Instruction List: section 6.5 of `docs/semantics.md`.

use ladder::il::StandardBlock;

use crate::flat_program::{FlatProgram, ScanState};

/// An instance with the symbols of its parts.
#[derive(Debug, Clone)]
pub(crate) struct FlatBlock {
    /// The kind of block.
    pub block: StandardBlock,
    /// Index of the state of the instance.
    pub instance: u32,
    /// Symbols of the parts, in the order of [`StandardBlock::parts`].
    pub parts: Vec<u32>,
}

/// State of an instance besides the symbols of its parts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BlockState {
    /// M.
    memory: bool,
    /// M2 of CTUD.
    memory_down: bool,
    /// S, in milliseconds modulo 2^32.
    start: u32,
}

/// The parts of an instance as numbers, while a call runs.
struct BlockExecution<'a> {
    block: &'a FlatBlock,
    code: &'a FlatProgram,
    scan: &'a mut ScanState,
    state: BlockState,
    /// *now* (I26).
    now: u32,
}

impl ScanState {
    /// Executes one call of a block.
    pub(crate) fn run_block(&mut self, code: &FlatProgram, block: &FlatBlock) {
        let Some(&state) = self.il.blocks.get(block.instance as usize) else { return };
        let now = (self.scans as u32).wrapping_mul(code.cycle_ms);
        let mut execution = BlockExecution { block, code, scan: self, state, now };
        match block.block {
            StandardBlock::Ton => execution.on_delay(),
            StandardBlock::Tof => execution.off_delay(),
            StandardBlock::Tp => execution.pulse(),
            StandardBlock::Tona => execution.retentive_on_delay(),
            StandardBlock::Tofa => execution.retentive_off_delay(),
            StandardBlock::Ctu => execution.count_up(),
            StandardBlock::Ctd => execution.count_down(),
            StandardBlock::Ctud => execution.count_both(),
            StandardBlock::RTrig => execution.edge(true),
            StandardBlock::FTrig => execution.edge(false),
            StandardBlock::Sr => {
                let on = execution.bit("S1") || execution.bit("Q1") && !execution.bit("R");
                execution.set("Q1", i64::from(on));
            }
            StandardBlock::Rs => {
                let on = !execution.bit("R1") && (execution.bit("S") || execution.bit("Q1"));
                execution.set("Q1", i64::from(on));
            }
        }
        let state = execution.state;
        if let Some(slot) = self.il.blocks.get_mut(block.instance as usize) {
            *slot = state;
        }
    }
}

impl BlockExecution<'_> {
    fn symbol(&self, part: &str) -> Option<u32> {
        let index = self.block.block.parts().iter().position(|known| known.name == part)?;
        self.block.parts.get(index).copied()
    }

    fn number(&self, part: &str) -> i64 {
        self.symbol(part).map_or(0, |symbol| self.scan.read_symbol(symbol).into())
    }

    fn bit(&self, part: &str) -> bool {
        self.number(part) != 0
    }

    fn set(&mut self, part: &str, value: i64) {
        if let Some(symbol) = self.symbol(part) {
            self.scan.store(self.code, symbol, value);
        }
    }

    /// P (I26).
    fn preset(&self) -> i64 {
        self.number("PT").max(0)
    }

    /// now - S.
    fn elapsed(&self) -> i64 {
        self.now.wrapping_sub(self.state.start).into()
    }

    fn start(&mut self) {
        self.state.memory = true;
        self.state.start = self.now;
    }

    /// Shows the elapsed time, at most P; returns whether P has passed.
    fn show_elapsed(&mut self) -> bool {
        let (elapsed, preset) = (self.elapsed(), self.preset());
        self.set("ET", elapsed.min(preset));
        elapsed >= preset
    }

    fn on_delay(&mut self) {
        if !self.bit("IN") {
            self.state.memory = false;
            self.set("ET", 0);
            self.set("Q", 0);
        } else if !self.state.memory {
            self.start();
            self.set("ET", 0);
            self.set("Q", i64::from(self.preset() == 0));
        } else if !self.bit("Q") {
            let passed = self.show_elapsed();
            self.set("Q", i64::from(passed));
        }
    }

    fn off_delay(&mut self) {
        if self.bit("IN") {
            self.set("Q", 1);
            self.set("ET", 0);
            self.state.memory = false;
        } else if self.bit("Q") {
            if !self.state.memory {
                self.start();
            }
            if self.show_elapsed() {
                self.set("Q", 0);
                self.state.memory = false;
            }
        }
    }

    fn pulse(&mut self) {
        if self.bit("Q") {
            let passed = self.show_elapsed();
            self.set("Q", i64::from(!passed));
        } else if self.bit("IN") && !self.state.memory {
            self.start();
            self.set("ET", 0);
            self.set("Q", i64::from(self.preset() > 0));
        }
        if !self.bit("Q") && !self.bit("IN") {
            self.state.memory = false;
            self.set("ET", 0);
        }
    }

    /// Adds the time since the last call to ET, if the timer runs; returns whether P has passed.
    fn accumulate(&mut self) -> bool {
        let preset = self.preset();
        if self.number("ET") < 0 {
            self.set("ET", 0);
        }
        if self.state.memory {
            let sum = self.number("ET") + self.elapsed();
            self.set("ET", sum.min(preset));
        }
        self.start();
        self.number("ET") >= preset
    }

    fn retentive_on_delay(&mut self) {
        if self.bit("R") {
            self.state.memory = false;
            self.set("ET", 0);
            self.set("Q", 0);
        } else if !self.bit("IN") {
            self.state.memory = false;
        } else if self.accumulate() {
            self.set("Q", 1);
        }
    }

    fn retentive_off_delay(&mut self) {
        if self.bit("R") {
            self.state.memory = false;
            self.set("ET", 0);
            self.set("Q", i64::from(self.bit("IN")));
        } else if self.bit("IN") {
            self.state.memory = false;
            self.set("Q", 1);
        } else if self.bit("Q") && self.accumulate() {
            self.set("Q", 0);
            self.state.memory = false;
        }
    }

    fn count(&mut self, step: i64) {
        let value = (self.number("CV") + step).clamp(i16::MIN.into(), i16::MAX.into());
        self.set("CV", value);
    }

    fn count_up(&mut self) {
        let input = self.bit("CU");
        if self.bit("R") {
            self.set("CV", 0);
        } else if input && !self.state.memory {
            self.count(1);
        }
        self.state.memory = input;
        self.set("Q", i64::from(self.number("CV") >= self.number("PV")));
    }

    fn count_down(&mut self) {
        let input = self.bit("CD");
        if self.bit("LD") {
            self.set("CV", self.number("PV"));
        } else if input && !self.state.memory {
            self.count(-1);
        }
        self.state.memory = input;
        self.set("Q", i64::from(self.number("CV") <= 0));
    }

    fn count_both(&mut self) {
        let (up, down) = (self.bit("CU"), self.bit("CD"));
        let (rises, falls) = (up && !self.state.memory, down && !self.state.memory_down);
        if self.bit("R") {
            self.set("CV", 0);
        } else if self.bit("LD") {
            self.set("CV", self.number("PV"));
        } else if rises != falls {
            self.count(if rises { 1 } else { -1 });
        }
        (self.state.memory, self.state.memory_down) = (up, down);
        self.set("QU", i64::from(self.number("CV") >= self.number("PV")));
        self.set("QD", i64::from(self.number("CV") <= 0));
    }

    /// R_TRIG with `level` TRUE, F_TRIG with FALSE.
    fn edge(&mut self, level: bool) {
        let is_at_level = self.bit("CLK") == level;
        self.set("Q", i64::from(is_at_level && !self.state.memory));
        self.state.memory = is_at_level;
    }
}
