//! Sources instead of an image: C, a sketch for the Arduino, byte code for an interpreter. `docs/emit.md` has the formats.
//!
//! All of them are told from the intermediate code that the images are made of, so an element has one meaning in this
//! crate. The parts that C and sketch share stand in `body` and `helpers`.

pub mod arduino;
mod body;
pub mod bytecode;
pub mod c;
mod helpers;
mod names;
mod tables;

use diag::Diagnostic;
use ladder::{ElementId, LadderProgram};

use crate::ir::{BitId, BitRole, Ir, WordId, WordRole};
use crate::{element_checks, lower, optimise};

/// A cell of the scan's state as a source names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SourceCell {
    /// The symbol's name, or a description of what is remembered.
    pub name: String,
    /// How the source spells it: an expression that can be read and assigned. In byte code: `bit 3`, `word 1`.
    pub text: String,
    /// Its number among the bits or among the words of the source; byte code sorts them anew.
    pub index: u32,
    /// Width in bytes of an integer, `None` for a bit.
    pub bytes: Option<u8>,
    /// It is a symbol of the program, not something remembered besides.
    pub is_symbol: bool,
}

/// An emitted source.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EmittedSource {
    /// The text of the file.
    pub text: String,
    /// Byte code as bytes; empty in the other languages.
    pub image: Vec<u8>,
    /// Symbols and memories, bits first; temporaries are left out.
    pub cells: Vec<SourceCell>,
    /// Names of the inputs, outputs and analog inputs in the order in which the source numbers them.
    pub inputs: Vec<String>,
    /// See `inputs`.
    pub outputs: Vec<String>,
    /// See `inputs`.
    pub analog: Vec<String>,
    /// Cells of EEPROM in use, from 0.
    pub eeprom: u16,
    /// All bits, temporaries with them.
    pub bits: u32,
    /// All integers, temporaries with them.
    pub words: u32,
}

/// The optimised intermediate code of a program that no chip has to hold.
///
/// # Errors
/// All errors of `ladder::check`, and every element that has no code, by place.
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

/// What the emitters ask of a scan besides its operations.
pub(crate) struct EmitContext<'a> {
    pub program: &'a LadderProgram,
    pub ir: &'a Ir,
}

impl EmitContext<'_> {
    /// Bits of a role with their names, in the order of the intermediate code.
    pub(crate) fn bits(&self, role: BitRole) -> impl Iterator<Item = (BitId, &str)> {
        let cells = self.ir.bits.iter().zip(0..);
        cells.filter(move |(cell, _)| cell.role == role).map(|(cell, n)| (BitId(n), cell.name.as_str()))
    }

    /// The elements with their text, in order.
    pub(crate) fn texts(&self) -> Vec<(ElementId, String)> {
        self.program.elements().map(|(id, element, _)| (id, ladder::element_text(element))).collect()
    }

    /// Symbols and memories; `bit` and `word` give number and spelling.
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
