//! Program memory as instructions.

use emu_core::chip::Chip;
use emu_core::image::{AddressedByte, Image};
use emu_core::table::{DisassembledInstruction, FlowKind};

/// Number of consecutive erased bytes that do not count as program.
const ERASED_RUN: usize = 8;

/// An instruction of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageInstruction {
    /// Address in program words.
    pub pc: u32,
    /// Length in program words.
    pub len: u32,
    /// How it can change the order of execution.
    pub flow: FlowKind,
    /// Its text.
    pub text: String,
}

/// Program memory by words; `None` where the image has no data.
pub(super) struct ProgramWords {
    chip: &'static Chip,
    words: Vec<Option<u16>>,
}

impl ProgramWords {
    /// Returns the program words of an image for a chip.
    pub fn of(chip: &'static Chip, image: &Image) -> ProgramWords {
        ProgramWords { chip, words: words(chip, image) }
    }

    /// Returns the instruction at a program word, if there is one.
    pub fn line(&self, pc: u32) -> Option<DisassembledInstruction> {
        let here: Vec<u16> = self.words.iter().skip(pc as usize).take(4).map_while(|word| *word).collect();
        (!here.is_empty()).then(|| (self.chip.isa.disassemble)(&here, pc))
    }

    /// Returns the instructions in sequence; at each `executed` word a new instruction begins. Illegal words
    /// are left out, and so are erased words that were not executed.
    pub fn instructions(&self, executed: impl Fn(u32) -> bool) -> Vec<ImageInstruction> {
        let erased = |at: usize| self.words.get(at) == Some(&Some(self.chip.isa.erased_word));
        let (mut found, mut at) = (Vec::new(), 0);
        while at < self.words.len() {
            let run = (at..).take_while(|&at| erased(at) && !executed(at as u32)).count();
            if run * self.chip.word_bytes as usize >= ERASED_RUN {
                at += run;
                continue;
            }
            let pc = at as u32;
            let line = self.line(pc);
            let len = line.as_ref().map_or(1, |line| line.len.max(1));
            // An instruction within this one was executed: then this is not an instruction, unless it was
            // executed too.
            let is_not_instruction = !executed(pc) && (at + 1..at + len).any(|at| executed(at as u32));
            match line.and_then(|line| Some((line.row?, line.text))) {
                Some((row, text)) if !is_not_instruction => {
                    found.push(ImageInstruction { pc, len: len as u32, flow: (self.chip.isa.flow)(row), text });
                    at += len;
                }
                _ => at += 1,
            }
        }
        found
    }
}

fn words(chip: &Chip, image: &Image) -> Vec<Option<u16>> {
    let size = chip.word_bytes.max(1);
    let end = image.end(chip.code_space).min(chip.flash_bytes).div_ceil(size);
    let mut words: Vec<Option<u16>> = vec![None; end as usize];
    for AddressedByte { addr, byte } in image.bytes_in(chip.code_space) {
        if let Some(word) = words.get_mut((addr / size) as usize) {
            let shift = 8 * (addr % size);
            let mask = if size == 1 { 0xFF } else { 0xFFu16 << shift };
            *word = Some(word.unwrap_or(chip.isa.erased_word) & !mask | u16::from(byte) << shift);
        }
    }
    words
}
