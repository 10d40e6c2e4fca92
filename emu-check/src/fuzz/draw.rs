//! Random valid ladder programs.

use diag::Pos;
use emu_core::rng::Rng;
use ladder::{Dialect, Element, Format, Node, Program, Rung, Settings, VarEntry};

use super::element::element;
use super::style::{Profile, Sort, Style};

/// Program number `number` (from 0) of the campaign with seed `seed`: the same whatever else is drawn.
#[must_use]
pub fn program(seed: u64, number: u64) -> (Program, Profile) {
    let mut rng = Rng::new(own_seed(seed, number));
    let style = Style::draw(&mut rng);
    let profile = style.profile;
    let left = style.elements;
    let mut draw = Draw { rng, style, modules: Vec::new(), constants: Vec::new(), left };
    let mut rungs: Vec<Rung> = (0..draw.style.rungs).map(|_| draw.rung()).collect();
    draw.finish(&mut rungs);
    (whole(&mut draw, rungs), profile)
}

/// The seed of one program and of its checks.
#[must_use]
pub fn own_seed(seed: u64, number: u64) -> u64 {
    // Printed in commands, so not all of its 64 bits are used.
    Rng::new(seed ^ Rng::new(number).next_u64()).next_u64() >> 24
}

/// A program being drawn.
pub(super) struct Draw {
    pub rng: Rng,
    pub style: Style,
    /// Timers and counters that have their element already: on a machine with modules each has one only.
    pub modules: Vec<String>,
    /// Constants drawn so far: their neighbours are worth a try.
    pub constants: Vec<i64>,
    /// Elements until no more groups are begun, so that nesting does not grow without bounds.
    left: u64,
}

impl Draw {
    pub(super) fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.rng.below(from.len() as u64) as usize].clone()
    }

    /// True in dialect ldmicro-5.
    pub(super) fn five(&self) -> bool {
        self.style.dialect == Dialect::Ldmicro5
    }

    /// True where a timer or counter is a module of the machine.
    pub(super) fn bits(&self) -> bool {
        self.style.profile == Profile::Bits
    }

    fn rung(&mut self) -> Rung {
        Rung { series: self.series(0, true), pos: Pos::default() }
    }

    /// A series; `rail` where its right end is the right rail, so that it may end in an element with an effect.
    fn series(&mut self, depth: u32, rail: bool) -> Vec<Node> {
        let mut out = Vec::new();
        for _ in 0..self.rng.below(self.style.longest + 1) {
            out.push(if self.nests(depth) { self.parallel(depth, false) } else { self.leaf(false) });
        }
        if rail && !self.rng.one_in(8) {
            out.push(if self.nests(depth) { self.parallel(depth, true) } else { self.leaf(true) });
        } else if out.is_empty() {
            out.push(self.leaf(false));
        }
        out
    }

    fn nests(&mut self, depth: u32) -> bool {
        self.left > 0 && depth < self.style.depth && self.rng.one_in(self.style.group)
    }

    fn parallel(&mut self, depth: u32, rail: bool) -> Node {
        let mut branches: Vec<Vec<Node>> = (0..2 + self.rng.below(2)).map(|_| self.series(depth + 1, rail)).collect();
        for branch in &mut branches {
            // A group right within a group cannot be written.
            if let [Node::Parallel(..)] = branch.as_slice() {
                branch.insert(0, self.leaf(false));
            }
        }
        Node::Parallel(branches, Pos::default())
    }

    fn leaf(&mut self, last: bool) -> Node {
        self.left = self.left.saturating_sub(1);
        let sort = self.style.sort(&mut self.rng, last);
        Node::Leaf(element(self, sort), Pos::default())
    }

    /// Rungs that a program of modules lacks: a RES needs its timer or counter somewhere.
    fn finish(&mut self, rungs: &mut Vec<Rung>) {
        if !self.bits() {
            return;
        }
        for sort in [Sort::Timer, Sort::Counter] {
            let all = if sort == Sort::Timer { &self.style.timers } else { &self.style.counters };
            for _ in all.clone() {
                let [input, module, coil] = [Sort::Contact, sort, Sort::Coil].map(|sort| element(self, sort));
                // Once all names are given, something else was drawn.
                if matches!(module, Element::Timer { .. } | Element::Counter { .. }) {
                    let series = [input, module, coil].map(|element| Node::Leaf(element, Pos::default()));
                    rungs.push(Rung { series: series.into(), pos: Pos::default() });
                }
            }
        }
    }
}

/// The program around its rungs.
fn whole(draw: &mut Draw, rungs: Vec<Rung>) -> Program {
    let (format, mut vars) = match draw.style.dialect {
        Dialect::Ldmicro23 => (Format::V01, None),
        Dialect::Ldmicro5 => (Format::V02, Some(Vec::new())),
    };
    if let (Some(vars), false) = (&mut vars, draw.bits()) {
        for name in draw.style.plain.clone() {
            if draw.rng.one_in(2) {
                let bytes = 1 + draw.rng.below(4) as u8;
                let text = format!("{bytes} bytes {name}");
                vars.push(VarEntry { name, bytes, text, pos: Pos::default() });
            }
        }
    }
    let style = &draw.style;
    let settings = Settings {
        micro: None,
        cycle_us: style.cycle_us,
        cycle_rest: String::new(),
        crystal_hz: style.clock_hz,
        crystal_rest: String::new(),
        baud: style.baud,
        baud_rest: String::new(),
        compiler: None,
        compiled: None,
    };
    let (file, io, pull_ups) = ("fuzz.ld".to_owned(), Vec::new(), None);
    Program { file, format, dialect: style.dialect, settings, io, vars, pull_ups, rungs }
}
