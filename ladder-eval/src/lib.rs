#![forbid(unsafe_code)]
//! The reference meaning of a ladder program: what one scan does, element by element.
//!
//! Written from the language's documents alone and sharing only the model with the compiler, so that a difference between
//! the two means that one of them is wrong. The meaning itself is told in prose in `docs/semantics.md`; section numbers
//! in this crate ("2.3") are those of its headings.
//!
//! `build` flattens the model once, `exec` runs the flat form; everything that names things is resolved in between.

mod build;
mod exec;

use std::collections::HashMap;
use std::sync::Arc;

pub use ladder::{ElementId, Program, Symbol};

/// Runs one program, scan by scan. A value: `clone` is a snapshot of the whole state and copies nothing else.
#[derive(Debug, Clone)]
pub struct Evaluator {
    code: Arc<Code>,
    state: exec::State,
}

/// An element that has no meaning here (yet, or at all): the program is refused as a whole, never run in part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{element}: `{text}`: {why}")]
pub struct Unsupported {
    /// Which element, printed as rung and element from 1.
    pub element: ElementId,
    /// The element as `.ld` text.
    pub text: String,
    /// Why it has no meaning, with the values found and wanted.
    pub why: String,
}

/// The part of an evaluator that no scan changes.
#[derive(Debug)]
struct Code {
    symbols: Vec<Symbol>,
    by_name: HashMap<String, usize>,
    steps: Vec<exec::Step>,
}

impl Evaluator {
    /// The program in its power-up state: every bit, integer and memory 0, the master relay on (2.1).
    ///
    /// # Errors
    /// The first element, in text order, that has no meaning here: an element outside the list of `docs/semantics.md`,
    /// a timer whose count does not lie in 1..=32767, an operand outside 16 bits, a name used both as a bit and as an
    /// integer, or a meaning that only dialect `ldmicro-5` has.
    pub fn new(program: &Program) -> Result<Evaluator, Unsupported> {
        let symbols = program.symbols();
        let by_name = symbols.iter().enumerate().map(|(i, s)| (s.name.clone(), i)).collect();
        let flat = build::flatten(program, &symbols, &by_name)?;
        let state = exec::State::power_up(symbols.len(), flat.memories, flat.depth);
        Ok(Evaluator { code: Arc::new(Code { symbols, by_name, steps: flat.steps }), state })
    }

    /// All symbols, in the order of [`Program::symbols`]; the position is the index that `get` and `set` take.
    #[must_use]
    pub fn symbols(&self) -> &[Symbol] {
        &self.code.symbols
    }

    /// The index of a symbol by its full name (`Xbutton`).
    #[must_use]
    pub fn index(&self, name: &str) -> Option<usize> {
        self.code.by_name.get(name).copied()
    }

    /// The value of a symbol now: 0 or 1 for a bit, -32768 to 32767 for an integer. An index past the last symbol
    /// reads 0.
    #[must_use]
    pub fn get(&self, symbol: usize) -> i32 {
        self.state.values.get(symbol).copied().map_or(0, i32::from)
    }

    /// Gives a symbol a value: inputs before a scan, anything else at will. A bit becomes 1 for every value but 0; an
    /// integer keeps the low 16 bits. An index past the last symbol changes nothing.
    pub fn set(&mut self, symbol: usize, value: i32) {
        let (Some(slot), Some(Symbol { kind, .. })) =
            (self.state.values.get_mut(symbol), self.code.symbols.get(symbol))
        else {
            return;
        };
        *slot = if kind.is_bit() { i16::from(value != 0) } else { value as i16 };
    }

    /// One scan: all rungs, top to bottom. Inputs are those last set and hold for the whole scan.
    pub fn scan(&mut self) {
        self.state.scan(&self.code.steps, |_, _, _| {});
    }

    /// One scan that calls `watch` after each element with the rung's bit before and after it. Comments are not elements
    /// of the scan and are never reported; each other element is reported exactly once, in order of execution, which is
    /// text order.
    pub fn scan_watched(&mut self, watch: &mut dyn FnMut(ElementId, bool, bool)) {
        self.state.scan(&self.code.steps, watch);
    }

    /// Scans run since power-up.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.state.scans
    }
}
