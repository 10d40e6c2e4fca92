//! Emits sources instead of images: C, an Arduino sketch, byte code for an interpreter. `docs/emit.md`
//! describes them.
//!
//! All emitters use the same intermediate code as the images, so an element has one meaning in this crate. C
//! and sketch share `body` and `helpers`.

pub mod arduino;
mod body;
pub mod bytecode;
pub mod c;
mod helpers;
mod names;
mod tables;

use diag::{Diagnostic, Severity};
use ladder::{ElementId, LadderProgram, ProgramElement};

use crate::ir::{BitId, BitRole, Ir, WordId, WordRole};
use crate::{codes, element_checks, lower, optimise};

/// A cell of the scan's state, as named in a source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceCell {
    /// Name of the symbol, or a description of the memory.
    pub name: String,
    /// Expression in the source that can be read and assigned. In byte code: `bit 3`, `word 1`.
    pub text: String,
    /// Number among the bits or the words of the source; byte code reorders the bits.
    pub index: u32,
    /// Width of an integer in bytes, `None` for a bit.
    pub bytes: Option<u8>,
    /// True for a symbol of the program, false for a memory of the compiler.
    pub is_symbol: bool,
}

/// An emitted source with its cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EmittedSource {
    /// Text of the file.
    pub text: String,
    /// Byte code as bytes; empty in the other languages.
    pub image: Vec<u8>,
    /// Symbols and memories, bits first, without temporaries.
    pub cells: Vec<SourceCell>,
    /// Names of the inputs, in the order in which the source numbers them.
    pub inputs: Vec<String>,
    /// Names of the outputs, in the order in which the source numbers them.
    pub outputs: Vec<String>,
    /// Names of the analog inputs, in the order in which the source numbers them.
    pub analog: Vec<String>,
    /// Number of EEPROM cells in use, from address 0.
    pub eeprom: u16,
    /// Number of bits, including temporaries.
    pub bits: u32,
    /// Number of integers, including temporaries.
    pub words: u32,
}

/// Returns the optimised intermediate code of a program, without a target chip.
///
/// # Errors
/// All errors of `ladder::check`, and every element that cannot be compiled, sorted by position.
pub fn lower_and_optimise(program: &LadderProgram) -> Result<Ir, Vec<Diagnostic>> {
    let mut diagnostics: Vec<Diagnostic> = ladder::check(program).into_iter().filter(Diagnostic::is_error).collect();
    for refusal in element_checks::unsupported_elements(program, None) {
        if !diagnostics.iter().any(|known| known.pos.line == refusal.pos.line) {
            diagnostics.push(refusal);
        }
    }
    diagnostics.sort_by_key(|diagnostic| diagnostic.pos);
    if diagnostics.is_empty() { Ok(optimise::optimise(lower::lower(program))) } else { Err(diagnostics) }
}

/// A program and its intermediate code, as the emitters need them.
pub(crate) struct EmitContext<'a> {
    pub program: &'a LadderProgram,
    pub ir: &'a Ir,
}

impl EmitContext<'_> {
    /// Iterates over the bits of a role with their names, in the order of the intermediate code.
    pub(crate) fn bits(&self, role: BitRole) -> impl Iterator<Item = (BitId, &str)> {
        let cells = self.ir.bits.iter().zip(0..);
        cells.filter(move |(cell, _)| cell.role == role).map(|(cell, n)| (BitId(n), cell.name.as_str()))
    }

    /// Elements with their text, in order.
    pub(crate) fn texts(&self) -> Vec<(ElementId, String)> {
        self.program.elements().map(|ProgramElement { id, element, .. }| (id, ladder::element_text(element))).collect()
    }

    /// Builds the emitted source with its symbols and memories; `bit` and `word` return number and spelling.
    pub(crate) fn source(
        &self,
        text: String,
        bit: impl Fn(BitId) -> (u32, String),
        word: impl Fn(WordId) -> (u32, String),
    ) -> EmittedSource {
        let bits = self.ir.bits.iter().zip(0..).filter(|(cell, _)| cell.role != BitRole::Temporary).map(|(cell, n)| {
            let (index, text) = bit(BitId(n));
            let symbol = cell.role != BitRole::Memory;
            SourceCell { name: cell.name.clone(), text, index, bytes: None, is_symbol: symbol }
        });
        let words = self.ir.words.iter().zip(0..).filter(|(cell, _)| cell.role != WordRole::Temporary);
        let words = words.map(|(cell, n)| {
            let (index, text) = word(WordId(n));
            let symbol = matches!(cell.role, WordRole::Symbol(_));
            SourceCell { name: cell.name.clone(), text, index, bytes: Some(cell.bytes), is_symbol: symbol }
        });
        let named = |role| self.bits(role).map(|(_, name)| name.to_owned()).collect();
        EmittedSource {
            text,
            image: Vec::new(),
            cells: bits.chain(words).collect(),
            inputs: named(BitRole::Input),
            outputs: named(BitRole::Output),
            analog: self.ir.adcs.clone(),
            eeprom: self.ir.eeprom_bytes,
            bits: self.ir.bits.len() as u32,
            words: self.ir.words.len() as u32,
        }
    }
}

/// Refuses a program with several PWM outputs for a target that has one.
fn refuse_further_pwm(program: &LadderProgram, target: &str) -> Option<Diagnostic> {
    let outputs = program.pwm_outputs();
    let [first, second, ..] = &outputs[..] else { return None };
    let ProgramElement { id, pos, .. } = program.find_element(second.element)?;
    let cause = format!(
        "{id}: the PWM output {} comes after {} of {}, and {target} has one",
        second.label(),
        first.label(),
        first.element
    );
    let hint = "keep one of them, or compile for a chip with several, or take --emit c";
    Some(Diagnostic::new(Severity::Error, codes::LACKS, &program.file, pos, cause, hint))
}
