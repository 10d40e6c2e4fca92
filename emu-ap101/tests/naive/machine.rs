//! A model of AP101, one subcycle of one machine cycle at a time, written from the reference's text and the
//! rules alone. It shares no code with the crate and is not fast: what the crate computes in closed form,
//! this model steps through.

mod execute;

use super::config::{BLOCK, Config, Entry, LENGTH};
use super::decode::{Op, decode};
use super::modules::Module;
use super::tally::Tally;

/// A time: machine cycle, and clock in it, 0 or 1.
pub type When = (u64, u8);

/// A line that is driven from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    Input(usize),
    Output(usize),
    Power,
    Clear,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Limit,
    Halted,
    /// A jump out of the program, and its target.
    Jump {
        pc: u16,
        target: u16,
    },
    Watchdog {
        pc: u16,
    },
}

/// The phase of the machine.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
    /// It has no supply.
    Nothing,
    /// Output channels are reloaded; this one is next.
    Refresh(usize),
    /// The next program cycle does not begin before this machine cycle.
    Pause(u64),
    /// A program cycle runs that began at this machine cycle.
    Program(u64),
}

/// Maximum number of machine cycles of a program cycle (rule 16).
const WATCHDOG: u64 = 65_536;

/// The state of the model.
#[derive(Debug, Clone)]
pub struct Naive {
    pub config: Config,
    program: Vec<u16>,
    /// The program table; empty if there is nothing to run.
    entries: Vec<Entry>,
    /// Whether no program can be disabled.
    always: bool,
    pub cycle: u64,
    pub instructions: u64,
    /// Registers (S15, S20, S21, S23).
    pub a: bool,
    pub na: u16,
    pub ric: u16,
    pub rx: u16,
    pub prog: usize,
    pub overruns: u16,
    pub latches: Vec<bool>,
    pub bistables: Vec<bool>,
    /// M, followed by the images of the outputs.
    pub ram: Vec<bool>,
    pub modules: Vec<Module>,
    /// Numbers of the modules that exist.
    fitted: Vec<usize>,
    written: Vec<bool>,
    doing: Doing,
    /// When the last program cycle began.
    began: u64,
    /// Whether a program cycle has begun since the machine started.
    started: bool,
    pins: Vec<bool>,
    supply: bool,
    pub clear: bool,
    /// What happened to the supply and to CLEAR since the last boundary.
    failed: bool,
    cleared: bool,
    drives: Vec<(When, Line, bool)>,
    /// Every change of an output.
    pub edges: Vec<(When, usize, bool)>,
    /// Counts of what has been done.
    pub tally: Tally,
}

impl Naive {
    /// A machine that is switched on with these bytes in its memories. The error is the offset of a fault in
    /// its block.
    pub fn new(bytes: &[Option<u8>]) -> Result<Naive, usize> {
        let byte = |at: usize| bytes.get(at).copied().flatten();
        let block: Vec<u8> = (BLOCK..BLOCK + LENGTH).map(|at| byte(at).unwrap_or(0)).collect();
        let given = (BLOCK..BLOCK + LENGTH).any(|at| byte(at).is_some());
        let config = if given { Config::read(&block)? } else { Config::none() };
        let mut program = Vec::new();
        let mut highest = None;
        for word in 0..2048 {
            let (low, high) = (byte(2 * word), byte(2 * word + 1));
            if low.is_some() || high.is_some() {
                highest = Some(word as u16);
            }
            // A blank memory is NOPs (rule 2).
            program.push(u16::from(low.unwrap_or(0xFF)) + 256 * u16::from(high.unwrap_or(0xFF)));
        }
        let mut entries = config.programs.clone();
        let always = !entries.iter().any(|entry| entry.present);
        if always {
            let whole = |last| Entry { start: 0, last, rx: 0, present: true, enabled: true };
            entries = highest.map(whole).into_iter().collect();
        }
        let mut machine = Naive {
            program,
            entries,
            always,
            cycle: 0,
            instructions: 0,
            a: false,
            na: 0,
            ric: 0,
            rx: 0,
            prog: 0,
            overruns: 0,
            latches: vec![false; 512],
            bistables: vec![false; 256],
            ram: vec![false; 512],
            modules: Vec::new(),
            fitted: (0..128).filter(|n| config.modules[*n].kind != 0).collect(),
            written: vec![false; 256],
            doing: Doing::Nothing,
            began: 0,
            started: false,
            pins: vec![false; 512],
            supply: true,
            clear: false,
            failed: false,
            cleared: false,
            drives: Vec::new(),
            edges: Vec::new(),
            tally: Tally::default(),
            config,
        };
        machine.fail();
        machine.start(true);
        Ok(machine)
    }

    /// Queues a change of a line from outside. Drives must be given in order of time.
    pub fn drive(&mut self, when: When, line: Line, level: bool) {
        self.drives.push((when, line, level));
    }

    /// Switches the supply off and immediately on again, with CLEAR if `cold`.
    pub fn reset(&mut self, cold: bool) {
        self.fail();
        self.start(cold);
    }

    /// Whether the supply is present, and has been since the last boundary.
    pub fn supplied(&self) -> bool {
        self.supply && !self.failed
    }

    /// Whether no more drives are queued.
    pub fn is_left_alone(&self) -> bool {
        self.drives.is_empty()
    }

    /// A word of program memory.
    pub fn word(&self, at: u16) -> u16 {
        self.program[usize::from(at)]
    }

    /// Runs up to a machine cycle.
    pub fn run(&mut self, until: u64) -> End {
        loop {
            self.boundary();
            if self.cycle >= until {
                return End::Limit;
            }
            self.turn();
            if let Some(end) = self.stops() {
                if let End::Jump { .. } = end {
                    // It is detected in the execute subcycle.
                    self.stir(1);
                }
                return end;
            }
            self.machine_cycle();
        }
    }

    /// What keeps the machine from its next cycle.
    fn stops(&self) -> Option<End> {
        let Doing::Program(began) = self.doing else {
            let rests = match self.doing {
                Doing::Nothing => true,
                Doing::Pause(due) => self.cycle >= due,
                _ => false,
            };
            return (rests && self.drives.is_empty()).then_some(End::Halted);
        };
        // The watchdog (rule 16).
        if self.cycle >= began + WATCHDOG {
            return Some(End::Watchdog { pc: self.na });
        }
        // A jump out of the program is not executed (rule 13).
        let word = decode(self.word(self.na));
        let target = self.target(self.na);
        let entry = self.entries[self.prog];
        let outside = target < entry.start || target > entry.last;
        (self.jumps(word.op) && outside).then_some(End::Jump { pc: self.na, target })
    }

    /// S79, S80: a conditional jump depends on the accumulator.
    fn jumps(&self, op: Op) -> bool {
        op == Op::Jmp || op == Op::Jmpc && self.a
    }

    /// The target of the jump at `at` (S79, rule 5).
    fn target(&self, at: u16) -> u16 {
        let word = decode(self.word(at));
        if word.indexed { (word.field + self.rx) % 2048 } else { word.field }
    }

    /// Handles inputs from outside between two machine cycles.
    fn boundary(&mut self) {
        self.stir(0);
        // Power fails and comes back (rule 10).
        let stood = self.doing == Doing::Nothing;
        if (self.failed || self.cleared) && !stood {
            self.fail();
            self.tally.event("loss of the supply");
        }
        if self.doing == Doing::Nothing && self.supply {
            self.start(self.clear || self.cleared);
            self.tally.event(if self.clear || self.cleared { "cold start" } else { "warm start" });
        }
        (self.failed, self.cleared) = (false, false);
        if self.doing == Doing::Refresh(self.config.outputs) {
            self.doing = Doing::Pause(self.pause());
        }
        // NA is where a program cycle is about to begin.
        if let Doing::Pause(due) = self.doing
            && self.cycle >= due
            && let Some(next) = self.next_program()
        {
            self.na = self.entries[next].start;
        }
    }

    /// Starts a program cycle at the start of a machine cycle, if its time has come.
    fn turn(&mut self) {
        if let Doing::Pause(due) = self.doing
            && self.cycle >= due
        {
            match self.next_program() {
                Some(next) => self.begin(next),
                None => self.tally.event("idle"),
            }
        }
    }

    /// Applies drives that are due.
    fn stir(&mut self, clock: u8) {
        while let Some(&(when, line, level)) = self.drives.first() {
            if when > (self.cycle, clock) {
                return;
            }
            self.drives.remove(0);
            match line {
                Line::Input(n) => self.pins[n] = level,
                // A glitch changes the bistable and nothing else (rule 9).
                Line::Output(n) => {
                    if n < self.config.outputs && self.doing != Doing::Nothing {
                        self.set_bistable(n, level, (self.cycle, clock));
                        self.tally.event("glitch");
                    }
                }
                Line::Power => {
                    self.failed |= self.supply && !level;
                    self.supply = level;
                }
                Line::Clear => {
                    self.cleared |= !self.clear && level && self.supply;
                    self.clear = level;
                }
            }
        }
    }

    fn set_bistable(&mut self, n: usize, level: bool, when: When) {
        if self.bistables[n] != level {
            self.bistables[n] = level;
            self.edges.push((when, n, level));
        }
    }

    /// The supply is lost: only M keeps its contents (S44, rule 10).
    fn fail(&mut self) {
        for n in 0..256 {
            self.set_bistable(n, false, (self.cycle, 0));
        }
        (self.a, self.ric) = (false, 0);
        self.latches = vec![false; 512];
        let hz = self.config.hz;
        self.modules = self.config.modules.iter().map(|record| Module::new(*record, hz)).collect();
        self.doing = Doing::Nothing;
    }

    /// The supply comes: all outputs are reloaded before the first fetch (rule 10).
    fn start(&mut self, cold: bool) {
        if cold {
            self.ram = vec![false; 512];
            if self.config.reconfigurable {
                for (k, entry) in self.config.programs.iter().enumerate() {
                    self.ram[248 + k] = entry.enabled;
                }
            }
        }
        self.written = vec![false; 256];
        self.started = false;
        self.overruns = 0;
        let first = self.next_program().or(self.entries.iter().position(|entry| entry.present));
        self.prog = first.unwrap_or(0);
        let entry = self.entries.get(self.prog);
        (self.na, self.rx) = entry.map_or((0, 0), |entry| (entry.start, entry.rx));
        self.doing = Doing::Refresh(0);
    }

    /// When the next program cycle can begin, after the outputs have been reloaded (rule 19).
    fn pause(&mut self) -> u64 {
        let period = self.config.period;
        if !self.started || period == 0 {
            return self.cycle;
        }
        let due = self.began + period;
        if self.cycle > due {
            self.overruns = self.overruns.saturating_add(1);
            self.tally.event("overrun");
        }
        due.max(self.cycle)
    }

    /// The program that runs next (S16, rule 14): all that are present in turn, or those that their bits of M
    /// enable.
    fn next_program(&self) -> Option<usize> {
        let count = self.entries.len();
        let after = if self.started { self.prog + 1 } else { 0 };
        let mut turns = (0..count).map(|step| (after + step) % count);
        let enabled = |k: usize| self.always || !self.config.reconfigurable || self.ram[248 + k];
        turns.find(|&k| self.entries[k].present && enabled(k))
    }

    /// Starts a program cycle: inputs are sampled (rule 7), and nothing is written yet (rule 9).
    fn begin(&mut self, number: usize) {
        let entry = self.entries[number];
        self.tally.event("program cycle");
        if self.started && number != self.prog {
            self.tally.event("another program");
        }
        (self.prog, self.na, self.rx) = (number, entry.start, entry.rx);
        self.written = vec![false; 256];
        for n in &self.fitted {
            self.modules[*n].program_cycle();
        }
        if !self.config.live {
            for n in 0..self.config.inputs {
                self.latches[n] = self.pins[n];
            }
        }
        self.started = true;
        self.began = self.cycle;
        self.doing = Doing::Program(self.cycle);
    }

    /// Executes one machine cycle: two clocks, a subcycle each (S18, S19, rule 4).
    fn machine_cycle(&mut self) {
        let mut effects = None;
        if let Doing::Program(_) = self.doing {
            // Fetch (S20, S21): NA gives the address, the word goes to RIC, NA is incremented.
            self.ric = self.word(self.na);
            let at = self.na;
            self.na = (self.na + 1) % 2048;
            self.stir(1);
            effects = Some(self.execute(at));
        } else {
            self.stir(1);
        }
        // The end of the cycle.
        for n in &self.fitted {
            self.modules[*n].pass();
        }
        self.cycle += 1;
        if let Doing::Refresh(n) = self.doing {
            // S43: an output that was not written is set to its image.
            if n < self.config.outputs && !self.written[n] {
                if self.bistables[n] != self.ram[256 + n] {
                    self.tally.event("refresh changed an output");
                }
                self.set_bistable(n, self.ram[256 + n], (self.cycle, 0));
            }
            self.doing = Doing::Refresh(n + 1);
        }
        if let Some(effects) = effects {
            self.finish(effects);
        }
    }

    /// A bit or byte of a memory, with the names of `--peek`.
    pub fn peek(&self, space: &str, at: usize) -> Option<u8> {
        let bit = |bits: &Vec<bool>| bits.get(at).map(|bit| u8::from(*bit));
        let byte = |words: &mut dyn Iterator<Item = u16>| words.nth(at / 2).map(|word| word.to_le_bytes()[at % 2]);
        match space {
            "i" if self.config.live && at < self.config.inputs => bit(&self.pins),
            "i" => bit(&self.latches),
            "e" => bit(&self.bistables),
            "m" => bit(&self.ram),
            "r" if at < 128 => Some(u8::from(self.modules[at].q())),
            "r" if at < 256 => Some(u8::from(self.modules[at - 128].running())),
            "r" if at < 384 => Some(0),
            "preset" => byte(&mut self.modules.iter().map(|module| module.preset)),
            "value" => byte(&mut self.modules.iter().map(Module::value)),
            "code" => byte(&mut self.program.iter().copied()),
            _ => None,
        }
    }
}
