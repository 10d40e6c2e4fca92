//! Program memory as predecoded ops. The location of an address depends on the existing channels and modules
//! and on RX, which is constant while a program runs. Every program of the table therefore has its own ops.

use std::collections::BTreeSet;

use emu_core::pins::PinId;
use emu_core::state::MemoryChanges;
use emu_core::table::{InstructionLocation, PredecodedOp};

use crate::chips::FIRST_OUTPUT;
use crate::config::{Ap101Config, InputSampling, MODULES, ProgramEntry};
use crate::isa::{Ap101Op, Ap101OpKind, Ap101Row, INDEXED, SHAPES, SPAN, find_row};
use crate::operands::{BitAddress, BitLocation, IMAGE_START, M_START, ZONE_BITS};

/// Number of ops of a program. Those after the end of program memory leave the hot loop, so that NA need not
/// be checked at each step.
pub(crate) const OP_COUNT: usize = 2 * SPAN;

/// The op that leaves the hot loop.
const SLOW_OP: Ap101Op = PredecodedOp { kind: Ap101OpKind::Slow, args: [0; 3] };

/// The channels and modules that exist, for locating addresses.
#[derive(Debug, Clone)]
pub(crate) struct AddressMap {
    inputs: u16,
    outputs: u16,
    live: bool,
    modules: [bool; MODULES],
}

impl AddressMap {
    /// Makes the map from the configuration; `inputs` overrides its sampling of inputs.
    pub(crate) fn new(config: &Ap101Config, inputs: InputSampling) -> AddressMap {
        AddressMap {
            inputs: config.input_channels,
            outputs: config.output_channels,
            live: inputs == InputSampling::Live,
            modules: config.modules.map(|settings| settings.kind != crate::modules::ModuleKind::None),
        }
    }

    /// The location of an address of eleven bits.
    pub(crate) fn locate(&self, addr: u16) -> BitLocation {
        let offset = addr % ZONE_BITS;
        let has_module = |n: u16| self.modules.get(usize::from(n)).copied().unwrap_or(false);
        match (addr / ZONE_BITS, offset / 128) {
            (0, _) if offset < self.inputs => BitLocation::Cell(offset),
            (1, _) if offset < self.outputs => BitLocation::Output(offset),
            (2, 0) if has_module(offset) => BitLocation::Module(offset),
            (2, 1) if has_module(offset - 128) => BitLocation::Running(offset - 128),
            (2, 2) if has_module(offset - 256) => BitLocation::Port(offset - 256),
            (3, _) => BitLocation::Cell(M_START + offset),
            _ => BitLocation::Nothing(addr),
        }
    }
}

/// Adds the index to an address within its part of its zone: an index never leads from one kind of location
/// to another.
const fn add_index(addr: u16, rx: u16) -> u16 {
    let (zone, offset) = (addr / ZONE_BITS * ZONE_BITS, addr % ZONE_BITS);
    let size = match (addr / ZONE_BITS, offset) {
        (0, _) => 512,
        (1 | 3, _) => 256,
        _ => 128,
    };
    let base = offset / size * size;
    zone + base + (offset - base + rx) % size
}

/// A program of the table with its ops, one per word.
#[derive(Debug, Clone)]
pub(crate) struct ProgramOps {
    pub program: ProgramEntry,
    pub ops: Box<[Ap101Op; OP_COUNT]>,
}

/// The effect of an instruction on NA.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ProgramFlow {
    /// It continues, or jumps within the program.
    WithinProgram,
    /// It jumps to the first word of the program, which ends the program cycle.
    EndsCycle,
    /// It jumps out of the program, to this word.
    LeavesProgram(u16),
}

/// Program memory as words and as ops.
#[derive(Debug, Clone)]
pub(crate) struct CodeMemory {
    pub words: Box<[u16; SPAN]>,
    pub programs: Vec<ProgramOps>,
    pub address_map: AddressMap,
    breakpoints: BTreeSet<u32>,
    /// What differs from the words with which it was built.
    pub changes: MemoryChanges<u16>,
}

impl CodeMemory {
    /// Program memory filled with `words`, which contains `programs`.
    pub(crate) fn new(words: Box<[u16; SPAN]>, programs: &[ProgramEntry], wiring: AddressMap) -> CodeMemory {
        let programs =
            programs.iter().map(|&program| ProgramOps { program, ops: Box::new([SLOW_OP; OP_COUNT]) }).collect();
        let mut code = CodeMemory {
            words,
            programs,
            address_map: wiring,
            breakpoints: BTreeSet::new(),
            changes: MemoryChanges::NONE,
        };
        for pc in 0..SPAN as u32 {
            code.predecode(pc);
        }
        code
    }

    /// The word at `na`, which wraps.
    pub(crate) const fn word(&self, na: u32) -> u16 {
        self.words[na as usize % SPAN]
    }

    /// Writes a word.
    pub(crate) fn poke(&mut self, pc: u32, word: u16) {
        let old = std::mem::replace(&mut self.words[pc as usize % SPAN], word);
        self.changes.record(pc as usize % SPAN, old, word);
        self.predecode(pc);
    }

    /// Sets or clears a breakpoint.
    pub(crate) fn set_breakpoint(&mut self, pc: u32, on: bool) {
        let pc = pc % SPAN as u32;
        if on {
            self.breakpoints.insert(pc);
        } else {
            self.breakpoints.remove(&pc);
        }
        self.predecode(pc);
    }

    /// Whether any breakpoint is set.
    pub(crate) fn has_breakpoints(&self) -> bool {
        !self.breakpoints.is_empty()
    }

    /// Whether a breakpoint is set at `pc`.
    pub(crate) fn has_breakpoint(&self, pc: u32) -> bool {
        self.breakpoints.contains(&pc)
    }

    /// Whether NA has passed the last word of the program with the index `which`.
    pub(crate) fn is_past_end(&self, which: usize, na: u32) -> bool {
        self.programs.get(which).is_some_and(|ops| na == u32::from(ops.program.last) + 1)
    }

    fn predecode(&mut self, pc: u32) {
        for which in 0..self.programs.len() {
            let word = self.word(pc);
            let slow = self.breakpoints.contains(&pc)
                || self.is_past_end(which, pc)
                || self.flow(which, word) != ProgramFlow::WithinProgram;
            let op = if slow { SLOW_OP } else { self.op(which, word, true) };
            if let Some(place) = self.programs.get_mut(which).and_then(|ops| ops.ops.get_mut(pc as usize)) {
                *place = op;
            }
        }
    }

    /// The index register of a program.
    fn index_of(&self, which: usize) -> u16 {
        self.programs.get(which).map_or(0, |ops| ops.program.rx)
    }

    /// The channels that the programs use, as pins.
    pub(crate) fn channels(&self) -> BTreeSet<PinId> {
        let words = self.programs.iter().enumerate().flat_map(|(which, ops)| {
            let all = usize::from(ops.program.start)..=usize::from(ops.program.last);
            self.words.get(all).unwrap_or_default().iter().map(move |word| (which, *word))
        });
        words
            .filter_map(|(which, word)| match self.operand_location(which, word)? {
                BitLocation::Cell(cell) if cell < M_START => Some(cell),
                BitLocation::Output(n) => Some(FIRST_OUTPUT + n),
                _ => None,
            })
            .collect()
    }

    /// The location that an instruction of a program addresses; `None` if it has no such address.
    fn operand_location(&self, which: usize, word: u16) -> Option<BitLocation> {
        match find_row(word).kind {
            Ap101OpKind::Jmp
            | Ap101OpKind::JmpX
            | Ap101OpKind::Jmpc
            | Ap101OpKind::JmpcX
            | Ap101OpKind::Not
            | Ap101OpKind::Clr
            | Ap101OpKind::Nop
            | Ap101OpKind::NopData => None,
            _ => {
                let field = word % SPAN as u16;
                let addr = if word & INDEXED == 0 { field } else { add_index(field, self.index_of(which)) };
                Some(self.address_map.locate(addr))
            }
        }
    }

    /// The effect of an instruction of a program on NA, assuming that a jump is taken.
    pub(crate) fn flow(&self, which: usize, word: u16) -> ProgramFlow {
        let kind = find_row(word).kind;
        let Some(ops) = self.programs.get(which) else { return ProgramFlow::WithinProgram };
        if !matches!(kind, Ap101OpKind::Jmp | Ap101OpKind::JmpX | Ap101OpKind::Jmpc | Ap101OpKind::JmpcX) {
            return ProgramFlow::WithinProgram;
        }
        let target = self.jump_target(which, word);
        match target {
            _ if target == ops.program.start => ProgramFlow::EndsCycle,
            _ if (ops.program.start..=ops.program.last).contains(&target) => ProgramFlow::WithinProgram,
            _ => ProgramFlow::LeavesProgram(target),
        }
    }

    /// The target of a jump.
    fn jump_target(&self, which: usize, word: u16) -> u16 {
        let index = if word & INDEXED == 0 { 0 } else { self.index_of(which) };
        (word + index) % SPAN as u16
    }

    /// The op of an instruction in a program. With `quick`, an operand in plain memory uses its short kind.
    pub(crate) fn op(&self, which: usize, word: u16, quick: bool) -> Ap101Op {
        let Ap101Row { row, kind } = find_row(word);
        let op = row.predecode(kind, word.into(), &InstructionLocation::default());
        match kind {
            Ap101OpKind::Jmp | Ap101OpKind::JmpX | Ap101OpKind::Jmpc | Ap101OpKind::JmpcX => {
                op_with_value(kind, self.jump_target(which, word))
            }
            _ => {
                let Some(spot) = self.operand_location(which, word) else { return op };
                let writes = matches!(kind, Ap101OpKind::Sto | Ap101OpKind::Stoc | Ap101OpKind::Stc | Ap101OpKind::Rtc);
                // Writes to inputs that need special handling do not use the short kind.
                let (plain, cell) = match spot {
                    BitLocation::Cell(cell) => (
                        cell >= M_START
                            || !writes
                            || matches!(kind, Ap101OpKind::Sto | Ap101OpKind::Stoc) && !self.address_map.live,
                        cell,
                    ),
                    BitLocation::Output(n) => (!writes, IMAGE_START + n),
                    _ => (false, 0),
                };
                match SHAPES.get(kind as usize).copied().flatten() {
                    Some(shape) if quick && plain => op_with_value(shape, cell),
                    _ => op_with_value(kind, BitAddress::from_location(spot).0),
                }
            }
        }
    }
}

/// An op with one operand.
const fn op_with_value(kind: Ap101OpKind, value: u16) -> Ap101Op {
    let [low, high] = value.to_le_bytes();
    PredecodedOp { kind, args: [low, high, 0] }
}
