//! A ladder program in an image, by its map: rungs as stretches of code, elements as lines of the program.

use std::collections::BTreeMap;

use diag::DiagnosticCode;
use emu_core::chip::Chip;
use emu_debug::ProgramSource;
use emu_debug::coverage::lcov::{BranchCount, FunctionCount, LcovRecord};
use emu_debug::coverage::{CoveredInstruction, CoveredShare};
use emu_debug::run::ReadMemory;
use ladder::LadderProgram;
use ladder_compile::{CellLocation, ImageMap};

use super::trace;
use crate::shared::codes::file_error;
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::report::{FileTexts, MessageStyle};

/// A ladder program that is not the one of the map.
pub const OTHER_LADDER: &str = "COV001";

/// All of them, for `emu explain`.
#[rustfmt::skip]
pub const CODES: &[DiagnosticCode] = &[
    DiagnosticCode { code: OTHER_LADDER, title: "a ladder program that is not the one of the map",
        explain: "The file of --ladder has other elements than the program of which --map is the map, so that its lines would be \
                  told of code that is not theirs. Nothing was run. Mend: give the program that was compiled, or compile it again." },
];

/// The map, and the program where it was given.
pub struct MappedLadder {
    chip: &'static Chip,
    map: ImageMap,
    program: Option<LadderProgram>,
}

/// The bits of elements, looked at once a scan.
pub struct ElementCounts {
    /// The last instruction of a scan, a program word.
    scan_end_word: u32,
    /// By element, as the map lists them: the bit, and how often it was 0 and 1.
    bits: BTreeMap<usize, (CellLocation, [u64; 2])>,
}

impl MappedLadder {
    /// Reads the map, and the program that it is of.
    pub fn read(
        map: &str,
        ladder: Option<&str>,
        source: &ProgramSource<'_>,
        terminal: &MessageStyle,
    ) -> Result<MappedLadder, VerbFailure> {
        let chip = source.names.chip;
        let parsed = trace::read_map(map, chip)?;
        let program =
            ladder.map(|file| input::read_program(file, None, true, terminal).map(|read| read.program)).transpose()?;
        if let (Some(program), Some(file)) = (&program, ladder) {
            let texts = program.elements().map(|(_, element, _)| ladder::element_text(element));
            if !texts.eq(parsed.elements.iter().map(|element| element.text.clone())) {
                let cause = format!("has other elements than the map {map}");
                let hint = "give the program that was compiled, or compile it again";
                let other = file_error(OTHER_LADDER, file, cause, hint);
                return Err(VerbFailure::Refused(vec![other], FileTexts::default()));
            }
        }
        Ok(MappedLadder { chip, map: parsed, program })
    }

    /// Lines of the program are known.
    pub fn has_lines(&self) -> bool {
        self.program.is_some()
    }

    /// The rung whose code an instruction is part of, from 1.
    pub fn rung_at(&self, pc: u32) -> Option<u32> {
        let byte = pc * self.chip.word_bytes;
        self.map.rungs.iter().find(|rung| (rung.start..rung.end).contains(&byte)).map(|rung| rung.rung)
    }

    /// Elements that are a bit: contacts and coils.
    pub fn elements(&self) -> Option<ElementCounts> {
        let program = self.program.as_ref()?;
        let bits = program.elements().enumerate().filter_map(|(i, (_, element, _))| {
            let mut place = None;
            ladder::symbols::for_each_symbol_use(element, &mut |name, _| {
                let symbol = self.map.symbols.iter().find(|symbol| symbol.name == name);
                place = place.take().or_else(|| symbol.map(|symbol| symbol.place.clone()));
            });
            place.filter(|place| matches!(place, CellLocation::Bit { .. })).map(|place| (i, (place, [0; 2])))
        });
        Some(ElementCounts { scan_end_word: self.map.scan_end / self.chip.word_bytes, bits: bits.collect() })
    }

    /// The record of the program, where it is known: a rung is a function, an element that is a bit has both its values as
    /// branches.
    pub fn record(&self, reached: &[CoveredInstruction], elements: Option<&ElementCounts>) -> Option<LcovRecord> {
        let program = self.program.as_ref()?;
        let count = |start: u32, end: u32| {
            let words = start / self.chip.word_bytes..end / self.chip.word_bytes;
            reached.iter().filter(|one| words.contains(&one.instruction.pc)).map(|one| one.count).max()
        };
        let mut record = LcovRecord::new(program.file.clone());
        for (rung, at) in program.rungs.iter().zip(&self.map.rungs) {
            // A rung of comments has no code.
            let Some(count) = count(at.start, at.end) else { continue };
            record.functions.push(FunctionCount { line: rung.pos.line, name: format!("rung {}", at.rung), count });
        }
        for (i, ((_, _, pos), at)) in program.elements().zip(&self.map.elements).enumerate() {
            // What needs no code of its own is done whenever its rung is.
            let rung = self.map.rungs.iter().find(|rung| rung.rung == at.rung);
            let own = count(at.start, at.end).or_else(|| rung.and_then(|rung| count(rung.start, rung.end)));
            let Some(own) = own else { continue };
            let line = record.lines.entry(pos.line).or_default();
            *line = (*line).max(own);
            if let Some((_, seen)) = elements.and_then(|elements| elements.bits.get(&i)) {
                let ways = (seen[0] + seen[1] > 0).then_some(*seen);
                record.branches.push(BranchCount { line: pos.line, block: i as u32 + 1, counts_by_outcome: ways });
            }
        }
        Some(record)
    }
}

impl ElementCounts {
    /// Where they are looked at: a program word.
    pub fn at(&self) -> u32 {
        self.scan_end_word
    }

    /// Looks at all of them, at the program word `pc`.
    pub fn sample_elements(&mut self, memory: ReadMemory<'_>, pc: u32) {
        if pc != self.scan_end_word {
            return;
        }
        for (place, seen) in self.bits.values_mut() {
            if let CellLocation::Bit { space, addr, bit } = place {
                let on = memory(space, *addr).is_some_and(|byte| byte >> (*bit & 7) & 1 == 1);
                seen[usize::from(on)] += 1;
            }
        }
    }

    /// How many values were seen, of two for each.
    pub fn covered_share(&self) -> CoveredShare {
        CoveredShare::of(self.bits.values().flat_map(|(_, seen)| seen), |count| **count > 0)
    }
}
