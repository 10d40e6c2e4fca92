//! A ladder program in an image, located by its map: rungs as code ranges, elements as lines of the program.

use std::collections::BTreeMap;

use emu_core::chip::Chip;
use emu_debug::ProgramSource;
use emu_debug::coverage::lcov::{BranchCount, FunctionCount, LcovRecord};
use emu_debug::coverage::{CoveredInstruction, CoveredShare};
use emu_debug::run::ReadMemory;
use ladder::{LadderProgram, ProgramElement, ReadOptions};
use ladder_compile::{CellLocation, ImageMap};

use super::trace;
use crate::shared::codes::{OTHER_LADDER, file_error};
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::report::{FileTexts, MessageStyle};

/// The map, and the program if it is given.
pub struct MappedLadder {
    chip: &'static Chip,
    map: ImageMap,
    program: Option<LadderProgram>,
}

/// Counts the values of elements that are bits, sampled once per scan.
pub struct ElementCounts {
    /// The program word of the last instruction of a scan.
    scan_end_word: u32,
    /// By index of the element in the map: the location of the bit, and how often it was 0 and 1.
    bits: BTreeMap<usize, (CellLocation, [u64; 2])>,
}

impl MappedLadder {
    /// Reads the map and its program. Refuses a program whose elements differ from those of the map.
    pub fn read(
        map: &str,
        ladder: Option<&str>,
        source: &ProgramSource<'_>,
        style: &MessageStyle,
    ) -> Result<MappedLadder, VerbFailure> {
        let chip = source.names.chip;
        let parsed = trace::read_map(map, chip)?;
        let program = ladder
            .map(|file| input::read_program(file, ReadOptions::default(), true, style).map(|read| read.program))
            .transpose()?;
        if let (Some(program), Some(file)) = (&program, ladder) {
            let texts = program.elements().map(|ProgramElement { element, .. }| ladder::element_text(element));
            if !texts.eq(parsed.elements.iter().map(|element| element.text.clone())) {
                let cause = format!("has other elements than the map {map}");
                let hint = "give the program that was compiled, or compile it again";
                let wrong_program = file_error(OTHER_LADDER, file, cause, hint);
                return Err(VerbFailure::Refused(vec![wrong_program], FileTexts::default()));
            }
        }
        Ok(MappedLadder { chip, map: parsed, program })
    }

    /// Returns true if the lines of the program are known.
    pub fn has_lines(&self) -> bool {
        self.program.is_some()
    }

    /// Returns the number of the rung, from 1, whose code contains an instruction.
    pub fn rung_at(&self, pc: u32) -> Option<u32> {
        let byte = pc * self.chip.word_bytes;
        self.map.rungs.iter().find(|rung| (rung.start..rung.end).contains(&byte)).map(|rung| rung.rung)
    }

    /// Returns new counters for the elements that are bits: contacts and coils. `None` without a program.
    pub fn new_element_counts(&self) -> Option<ElementCounts> {
        let program = self.program.as_ref()?;
        let bits = program.elements().enumerate().filter_map(|(i, ProgramElement { element, .. })| {
            let mut location = None;
            ladder::symbols::for_each_symbol_use(element, &mut |name, _| {
                let symbol = self.map.symbols.iter().find(|symbol| symbol.name == name);
                location = location.take().or_else(|| symbol.map(|symbol| symbol.place.clone()));
            });
            location
                .filter(|location| matches!(location, CellLocation::Bit { .. }))
                .map(|location| (i, (location, [0; 2])))
        });
        Some(ElementCounts { scan_end_word: self.map.scan_end / self.chip.word_bytes, bits: bits.collect() })
    }

    /// Returns the coverage record of the program, if it is known: a rung is a function, and an element that
    /// is a bit has its two values as branches.
    pub fn record(&self, instructions: &[CoveredInstruction], elements: Option<&ElementCounts>) -> Option<LcovRecord> {
        let program = self.program.as_ref()?;
        let count = |start: u32, end: u32| {
            let words = start / self.chip.word_bytes..end / self.chip.word_bytes;
            instructions
                .iter()
                .filter(|covered| words.contains(&covered.instruction.pc))
                .map(|covered| covered.count)
                .max()
        };
        let mut record = LcovRecord::new(program.file.clone());
        for (rung, mapped) in program.rungs.iter().zip(&self.map.rungs) {
            // A rung that holds only comments has no code.
            let Some(count) = count(mapped.start, mapped.end) else { continue };
            record.functions.push(FunctionCount { line: rung.pos.line, name: format!("rung {}", mapped.rung), count });
        }
        for (i, (ProgramElement { pos, .. }, mapped)) in program.elements().zip(&self.map.elements).enumerate() {
            // An element without code counts as executed whenever its rung is.
            let rung = self.map.rungs.iter().find(|rung| rung.rung == mapped.rung);
            let execution_count =
                count(mapped.start, mapped.end).or_else(|| rung.and_then(|rung| count(rung.start, rung.end)));
            let Some(execution_count) = execution_count else { continue };
            let line = record.lines.entry(pos.line).or_default();
            *line = (*line).max(execution_count);
            if let Some((_, value_counts)) = elements.and_then(|elements| elements.bits.get(&i)) {
                let counts_by_outcome = (value_counts[0] + value_counts[1] > 0).then_some(*value_counts);
                record.branches.push(BranchCount { line: pos.line, block: i as u32 + 1, counts_by_outcome });
            }
        }
        Some(record)
    }
}

impl ElementCounts {
    /// Returns the program word at which the elements are sampled.
    pub fn scan_end_word(&self) -> u32 {
        self.scan_end_word
    }

    /// Samples all elements if `pc` is the sampling word.
    pub fn sample_elements(&mut self, memory: ReadMemory<'_>, pc: u32) {
        if pc != self.scan_end_word {
            return;
        }
        for (location, value_counts) in self.bits.values_mut() {
            if let CellLocation::Bit { space, addr, bit } = location {
                let on = memory(space, *addr).is_some_and(|byte| byte >> (*bit & 7) & 1 == 1);
                value_counts[usize::from(on)] += 1;
            }
        }
    }

    /// Returns how many of the two values of each element occurred.
    pub fn covered_share(&self) -> CoveredShare {
        CoveredShare::of(self.bits.values().flat_map(|(_, value_counts)| value_counts), |count| **count > 0)
    }
}
