//! Generates random valid ladder programs.

use std::collections::HashMap;

use diag::Pos;
use emu_core::rng::Rng;
use ladder::{
    Element, LadderDialect, LadderProgram, LdFormat, ProgramSettings, Rung, RungNode, SerialTransfer, VarEntry,
};

use super::element_generator::random_element;
use super::flow_generator::add_flow;
use super::program_style::{ElementSort, ProgramProfile, ProgramStyle};

/// Generates program `number` (from 0) of the campaign with seed `seed`. The result depends only on these two
/// numbers.
#[must_use]
pub fn generate_program(seed: u64, number: u64) -> (LadderProgram, ProgramProfile) {
    let mut rng = Rng::new(program_seed(seed, number));
    let style = ProgramStyle::draw(&mut rng);
    let profile = style.profile;
    let elements_left = style.elements;
    let mut generator = ProgramGenerator {
        rng,
        style,
        modules: Vec::new(),
        constants: Vec::new(),
        transfers: 0,
        remaining_elements: elements_left,
    };
    let mut rungs: Vec<Rung> = (0..generator.style.rungs).map(|_| generator.rung()).collect();
    generator.add_missing_modules(&mut rungs);
    // Drawn from numbers of its own, so that the program is otherwise the same with and without jumps.
    let mut rng = Rng::new(!program_seed(seed, number));
    if generator.is_ldmicro5() && rng.one_in(4) {
        add_flow(&mut rng, &mut rungs, &generator.style.inputs, !generator.is_module_machine());
    }
    let mut program = complete_program(&mut generator, rungs);
    let widths = program.symbols().into_iter().map(|symbol| (symbol.name, symbol.bytes.into())).collect();
    program.rungs.iter_mut().for_each(|rung| fit_transfers(&mut rung.series, &widths));
    (program, profile)
}

/// Lets the elements of the serial line transfer no more bytes than their integers have.
fn fit_transfers(series: &mut [RungNode], widths: &HashMap<String, u32>) {
    for node in series {
        match node {
            RungNode::Parallel(branches, _) => branches.iter_mut().for_each(|branch| fit_transfers(branch, widths)),
            RungNode::Leaf(Element::UartSend { name, rest } | Element::UartRecv { name, rest }, _) => {
                let width = widths.get(name.as_str()).copied().unwrap_or(1);
                *rest = rest.map(|rest| SerialTransfer { bytes: rest.bytes.min(width), ..rest });
            }
            RungNode::Leaf(..) => {}
        }
    }
}

/// The seed of one program and of its checks.
#[must_use]
pub fn program_seed(seed: u64, number: u64) -> u64 {
    // The seed is printed in commands, so it has 40 bits only.
    Rng::new(seed ^ Rng::new(number).next_u64()).next_u64() >> 24
}

/// The state while one program is generated.
pub(super) struct ProgramGenerator {
    pub rng: Rng,
    pub style: ProgramStyle,
    /// Timers and counters that have an element already; on a machine with modules each has exactly one.
    pub modules: Vec<String>,
    /// Constants generated so far; their neighbours are worth trying.
    pub constants: Vec<i64>,
    /// Number of elements on a bus so far; each takes some of the scan.
    pub transfers: u32,
    /// Number of elements until no more groups are started, which limits the size of the program.
    remaining_elements: u64,
}

impl ProgramGenerator {
    /// A random element of `from`, which must not be empty.
    pub(super) fn pick<T: Clone>(&mut self, from: &[T]) -> T {
        from[self.rng.below(from.len() as u64) as usize].clone()
    }

    /// Returns true in dialect ldmicro-5.
    pub(super) fn is_ldmicro5(&self) -> bool {
        self.style.dialect == LadderDialect::Ldmicro5
    }

    /// Returns true if each timer or counter is a module of the machine.
    pub(super) fn is_module_machine(&self) -> bool {
        self.style.profile == ProgramProfile::Bits
    }

    fn rung(&mut self) -> Rung {
        Rung { series: self.series(0, true), pos: Pos::default() }
    }

    /// A random series; with `rail`, its right end is the right rail, so it may end in an element with an
    /// effect.
    fn series(&mut self, depth: u32, rail: bool) -> Vec<RungNode> {
        let mut out = Vec::new();
        for _ in 0..self.rng.below(self.style.longest + 1) {
            out.push(if self.begins_group(depth) { self.parallel(depth, false) } else { self.leaf(false) });
        }
        if rail && !self.rng.one_in(8) {
            out.push(if self.begins_group(depth) { self.parallel(depth, true) } else { self.leaf(true) });
        } else if out.is_empty() {
            out.push(self.leaf(false));
        }
        out
    }

    fn begins_group(&mut self, depth: u32) -> bool {
        self.remaining_elements > 0 && depth < self.style.depth && self.rng.one_in(self.style.nodes_per_group)
    }

    fn parallel(&mut self, depth: u32, rail: bool) -> RungNode {
        let mut branches: Vec<Vec<RungNode>> =
            (0..2 + self.rng.below(2)).map(|_| self.series(depth + 1, rail)).collect();
        for branch in &mut branches {
            // The `.ld` format cannot express a group directly within a group.
            if let [RungNode::Parallel(..)] = branch.as_slice() {
                branch.insert(0, self.leaf(false));
            }
        }
        RungNode::Parallel(branches, Pos::default())
    }

    fn leaf(&mut self, last: bool) -> RungNode {
        self.remaining_elements = self.remaining_elements.saturating_sub(1);
        // LDmicro 5 allows the elements of the right rail anywhere.
        let last = last || self.is_ldmicro5() && self.rng.one_in(12);
        let sort = self.style.random_sort(&mut self.rng, last);
        RungNode::Leaf(random_element(self, sort), Pos::default())
    }

    /// Adds the timers and counters that a program for modules lacks, because a RES needs its timer or
    /// counter.
    fn add_missing_modules(&mut self, rungs: &mut Vec<Rung>) {
        if !self.is_module_machine() {
            return;
        }
        for sort in [ElementSort::Timer, ElementSort::Counter] {
            let all = if sort == ElementSort::Timer { &self.style.timers } else { &self.style.counters };
            for _ in all.clone() {
                let [input, module, coil] =
                    [ElementSort::Contact, sort, ElementSort::Coil].map(|sort| random_element(self, sort));
                // When no name is left, an element of another sort was generated.
                if matches!(module, Element::Timer { .. } | Element::Counter { .. }) {
                    let series = [input, module, coil].map(|element| RungNode::Leaf(element, Pos::default()));
                    rungs.push(Rung { series: series.into(), pos: Pos::default() });
                }
            }
        }
    }
}

/// Builds the program from its rungs.
fn complete_program(generator: &mut ProgramGenerator, rungs: Vec<Rung>) -> LadderProgram {
    let (format, mut vars) = match generator.style.dialect {
        LadderDialect::Ldmicro23 => (LdFormat::V01, None),
        LadderDialect::Ldmicro5 | LadderDialect::Iec => (LdFormat::V02, Some(Vec::new())),
    };
    if let (Some(vars), false) = (&mut vars, generator.is_module_machine()) {
        for name in generator.style.plain_integers.clone() {
            if generator.rng.one_in(2) {
                let bytes = 1 + generator.rng.below(4) as u8;
                let text = format!("{bytes} bytes {name}");
                vars.push(VarEntry { name, bytes, text, pos: Pos::default() });
            }
        }
    }
    let style = &generator.style;
    let settings = ProgramSettings {
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
    LadderProgram {
        declarations: Vec::new(),
        file,
        format,
        dialect: style.dialect,
        style: Default::default(),
        settings,
        io,
        vars,
        pull_ups,
        rungs,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::generate_program;

    /// Elements that random programs leave out.
    #[rustfmt::skip]
    const LEFT_OUT: &[(&str, &str)] = &[
        ("PLACEHOLDER", "no chip compiles it"),
        ("DELAY",       "has no effect that the checker sees"),
        ("SLEEP",       "has no effect that the checker sees"),
        ("CLRWDT",      "has no effect that the checker sees"),
        ("LOCK",        "ends all scans, so that nothing else of the program would be checked"),
        ("STRING",      "has no effect that the checker sees"),
    ];

    #[test]
    fn every_element_is_generated() {
        let mut found = BTreeSet::new();
        for number in 0..2_000 {
            found.extend(generate_program(1, number).0.elements().map(|at| at.element.facts().keyword));
        }
        let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !found.contains(keyword)).collect();
        assert_eq!(
            missing,
            LEFT_OUT.iter().map(|row| row.0).collect::<Vec<_>>(),
            "missing, and left out with a reason"
        );
    }
}
