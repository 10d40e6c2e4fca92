//! Program memory as predecoded ops. What an address means depends on the channels and modules that there are, and on RX, which a
//! program keeps as long as it runs: so every program of the table has ops of its own.

use std::collections::BTreeSet;

use emu_core::pins::PinId;
use emu_core::state::Changes;
use emu_core::table::{Op, Site};

use crate::chips::FIRST_OUTPUT;
use crate::config::{Config, Inputs, MODULES, Program};
use crate::isa::{Ap101Op, INDEXED, Kind, SHAPES, SPAN, row_of};
use crate::operands::{IMAGE, M, Place, Spot, ZONE};

/// Ops of a program: those behind the end of program memory leave the hot loop, so that NA needs no look at each step.
pub(crate) const OPS: usize = 2 * SPAN;

/// What leaves the hot loop.
const SLOW: Ap101Op = Op { kind: Kind::Slow, arg: [0; 3] };

/// What there is around the core, as far as addresses are concerned.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    inputs: u16,
    outputs: u16,
    live: bool,
    modules: [bool; MODULES],
}

impl Wiring {
    /// By the configuration; `inputs` may be read otherwise than it says.
    pub(crate) fn new(config: &Config, inputs: Inputs) -> Wiring {
        Wiring {
            inputs: config.input_channels,
            outputs: config.output_channels,
            live: inputs == Inputs::Live,
            modules: config.modules.map(|settings| settings.kind != crate::modules::Kind::None),
        }
    }

    /// What stands at an address of eleven bits.
    pub(crate) fn spot(&self, addr: u16) -> Spot {
        let offset = addr % ZONE;
        let there = |n: u16| self.modules.get(usize::from(n)).copied().unwrap_or(false);
        match (addr / ZONE, offset / 128) {
            (0, _) if offset < self.inputs => Spot::Cell(offset),
            (1, _) if offset < self.outputs => Spot::Output(offset),
            (2, 0) if there(offset) => Spot::Module(offset),
            (2, 1) if there(offset - 128) => Spot::Running(offset - 128),
            (2, 2) if there(offset - 256) => Spot::Port(offset - 256),
            (3, _) => Spot::Cell(M + offset),
            _ => Spot::Nothing(addr),
        }
    }
}

/// An address with the index added, within its part of its zone: an index leads from no kind of thing to another.
const fn indexed(addr: u16, rx: u16) -> u16 {
    let (zone, offset) = (addr / ZONE * ZONE, addr % ZONE);
    let size = match (addr / ZONE, offset) {
        (0, _) => 512,
        (1 | 3, _) => 256,
        _ => 128,
    };
    let base = offset / size * size;
    zone + base + (offset - base + rx) % size
}

/// A program of the table with its ops, one a word.
#[derive(Debug, Clone)]
pub(crate) struct Ops {
    pub program: Program,
    pub ops: Box<[Ap101Op; OPS]>,
}

/// What an instruction does to NA.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Flow {
    /// It goes on, or jumps within the program.
    On,
    /// It jumps to the program's first word, which ends the program cycle.
    Start,
    /// It jumps out of the program, to this word.
    Out(u16),
}

/// Program memory in both forms.
#[derive(Debug, Clone)]
pub(crate) struct Code {
    pub words: Box<[u16; SPAN]>,
    pub programs: Vec<Ops>,
    pub wiring: Wiring,
    traps: BTreeSet<u32>,
    /// What differs from the words that it was built with.
    pub changes: Changes<u16>,
}

impl Code {
    /// Program memory filled with `words`, which has `programs`.
    pub(crate) fn new(words: Box<[u16; SPAN]>, programs: &[Program], wiring: Wiring) -> Code {
        let programs = programs.iter().map(|&program| Ops { program, ops: Box::new([SLOW; OPS]) }).collect();
        let mut code = Code { words, programs, wiring, traps: BTreeSet::new(), changes: Changes::NONE };
        for pc in 0..SPAN as u32 {
            code.predecode(pc);
        }
        code
    }

    /// The word at `na`, which wraps.
    pub(crate) const fn word(&self, na: u32) -> u16 {
        self.words[na as usize % SPAN]
    }

    /// Changes a word.
    pub(crate) fn poke(&mut self, pc: u32, word: u16) {
        let old = std::mem::replace(&mut self.words[pc as usize % SPAN], word);
        self.changes.note(pc as usize % SPAN, old, word);
        self.predecode(pc);
    }

    /// Sets or clears a trap.
    pub(crate) fn trap(&mut self, pc: u32, on: bool) {
        let pc = pc % SPAN as u32;
        if on {
            self.traps.insert(pc);
        } else {
            self.traps.remove(&pc);
        }
        self.predecode(pc);
    }

    /// Traps are set.
    pub(crate) fn has_traps(&self) -> bool {
        !self.traps.is_empty()
    }

    /// A trap stands there.
    pub(crate) fn has_trap(&self, pc: u32) -> bool {
        self.traps.contains(&pc)
    }

    /// NA has passed the last word of the program at position `which`.
    pub(crate) fn ended(&self, which: usize, na: u32) -> bool {
        self.programs.get(which).is_some_and(|ops| na == u32::from(ops.program.last) + 1)
    }

    fn predecode(&mut self, pc: u32) {
        for which in 0..self.programs.len() {
            let word = self.word(pc);
            let slow = self.traps.contains(&pc) || self.ended(which, pc) || self.flow(which, word) != Flow::On;
            let op = if slow { SLOW } else { self.op(which, word, true) };
            if let Some(place) = self.programs.get_mut(which).and_then(|ops| ops.ops.get_mut(pc as usize)) {
                *place = op;
            }
        }
    }

    /// The index register of a program.
    fn rx(&self, which: usize) -> u16 {
        self.programs.get(which).map_or(0, |ops| ops.program.rx)
    }

    /// The channels that the programs name, as pins.
    pub(crate) fn channels(&self) -> BTreeSet<PinId> {
        let words = self.programs.iter().enumerate().flat_map(|(which, ops)| {
            let all = usize::from(ops.program.start)..=usize::from(ops.program.last);
            self.words.get(all).unwrap_or_default().iter().map(move |word| (which, *word))
        });
        words
            .filter_map(|(which, word)| match self.spot(which, word)? {
                Spot::Cell(cell) if cell < M => Some(cell),
                Spot::Output(n) => Some(FIRST_OUTPUT + n),
                _ => None,
            })
            .collect()
    }

    /// What the address of an instruction of a program is; none where it has no such address.
    fn spot(&self, which: usize, word: u16) -> Option<Spot> {
        match row_of(word).1 {
            Kind::Jmp | Kind::JmpX | Kind::Jmpc | Kind::JmpcX | Kind::Not | Kind::Clr | Kind::Nop | Kind::NopData => {
                None
            }
            _ => {
                let field = word % SPAN as u16;
                let addr = if word & INDEXED == 0 { field } else { indexed(field, self.rx(which)) };
                Some(self.wiring.spot(addr))
            }
        }
    }

    /// What an instruction of a program does to NA, if it is a jump that is taken.
    pub(crate) fn flow(&self, which: usize, word: u16) -> Flow {
        let kind = row_of(word).1;
        let Some(ops) = self.programs.get(which) else { return Flow::On };
        if !matches!(kind, Kind::Jmp | Kind::JmpX | Kind::Jmpc | Kind::JmpcX) {
            return Flow::On;
        }
        let target = self.target(which, word);
        match target {
            _ if target == ops.program.start => Flow::Start,
            _ if (ops.program.start..=ops.program.last).contains(&target) => Flow::On,
            _ => Flow::Out(target),
        }
    }

    /// Where a jump goes.
    fn target(&self, which: usize, word: u16) -> u16 {
        let index = if word & INDEXED == 0 { 0 } else { self.rx(which) };
        (word + index) % SPAN as u16
    }

    /// The op of an instruction in a program; `quick`: with what lies in plain memory as such.
    pub(crate) fn op(&self, which: usize, word: u16, quick: bool) -> Ap101Op {
        let (row, kind) = row_of(word);
        let op = row.op(kind, word.into(), &Site::default());
        match kind {
            Kind::Jmp | Kind::JmpX | Kind::Jmpc | Kind::JmpcX => with(kind, self.target(which, word)),
            _ => {
                let Some(spot) = self.spot(which, word) else { return op };
                let writes = matches!(kind, Kind::Sto | Kind::Stoc | Kind::Stc | Kind::Rtc);
                // What takes a second look when it is written to an input stays away from the short way.
                let (plain, cell) = match spot {
                    Spot::Cell(cell) => {
                        (cell >= M || !writes || matches!(kind, Kind::Sto | Kind::Stoc) && !self.wiring.live, cell)
                    }
                    Spot::Output(n) => (!writes, IMAGE + n),
                    _ => (false, 0),
                };
                match SHAPES.get(kind as usize).copied().flatten() {
                    Some(shape) if quick && plain => with(shape, cell),
                    _ => with(kind, Place::of(spot).0),
                }
            }
        }
    }
}

/// An op with one operand.
const fn with(kind: Kind, value: u16) -> Ap101Op {
    let [low, high] = value.to_le_bytes();
    Op { kind, arg: [low, high, 0] }
}
