//! Targets of assemblers and disassemblers.

use std::io;

use emu_asm::{AssembleOptions, IncludeFiles, SourceText, assemble, assemble_line};
use emu_core::chip::ChipFamily;

use crate::machines::family_chip;

/// An include reader in which every file is the source itself.
struct SelfInclude<'a>(&'a [u8]);

impl IncludeFiles for SelfInclude<'_> {
    fn open(&mut self, name: &str, _: &str) -> io::Result<(String, Vec<u8>)> {
        Ok((name.to_owned(), self.0.to_vec()))
    }
}

fn asm(family: ChipFamily, data: &[u8]) {
    let source = SourceText { name: "fuzz.asm", bytes: data };
    let faults = match assemble(&source, family_chip(family), &AssembleOptions::default(), &mut SelfInclude(data)) {
        Ok(assembled) => {
            _ = assembled.listing.to_string();
            assembled.warnings
        }
        Err(refused) => {
            assert!(refused.diagnostics.iter().any(|fault| fault.is_error()), "refused for a reason");
            refused.diagnostics
        }
    };
    let lines = data.iter().filter(|byte| matches!(byte, b'\n' | b'\r')).count() as u32 + 1;
    for fault in faults {
        assert!(fault.pos.line <= lines, "within the source: {fault}");
    }
}

/// Assembles the input for AVR.
pub(crate) fn asm_avr(data: &[u8]) {
    asm(ChipFamily::Avr, data);
}

/// Assembles the input for the 8051.
pub(crate) fn asm_8051(data: &[u8]) {
    asm(ChipFamily::Mcs51, data);
}

/// Assembles the input for the PIC16.
pub(crate) fn asm_pic16(data: &[u8]) {
    asm(ChipFamily::Pic16, data);
}

/// Assembles the input for AP101.
pub(crate) fn asm_ap101(data: &[u8]) {
    asm(ChipFamily::Ap101, data);
}

/// Disassembles words at the address in the first two bytes; the text must assemble to the same words.
fn disasm(family: ChipFamily, data: &[u8]) {
    let chip = family_chip(family);
    let Some((at, rest)) = data.split_first_chunk::<2>() else { return };
    let end = chip.flash_bytes / chip.word_bytes;
    let pc = u32::from(u16::from_le_bytes(*at)) % end.max(1);
    let mask = (1u32 << chip.isa.word_bits) - 1;
    let words = rest.chunks(chip.word_bytes as usize);
    let words: Vec<u16> = words
        .map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)) & mask as u16)
        .take(4)
        .collect();
    if words.is_empty() {
        return;
    }
    let shown = (chip.isa.disassemble)(&words, pc);
    let wanted = words.get(..shown.len).unwrap_or(&words);
    let back = assemble_line(chip, &shown.text, pc);
    // AP101 has words that cannot be written in a source, such as one that sets an input.
    if family != ChipFamily::Ap101 || back.is_ok() {
        assert_eq!(back.as_deref(), Ok(wanted), "{} at 0x{pc:x}: {}", chip.name, shown.text);
    }
}

/// Disassembles and assembles words of AVR.
pub(crate) fn disasm_avr(data: &[u8]) {
    disasm(ChipFamily::Avr, data);
}

/// Disassembles and assembles words of the 8051.
pub(crate) fn disasm_8051(data: &[u8]) {
    disasm(ChipFamily::Mcs51, data);
}

/// Disassembles and assembles words of the PIC16.
pub(crate) fn disasm_pic16(data: &[u8]) {
    disasm(ChipFamily::Pic16, data);
}

/// Disassembles and assembles words of AP101.
pub(crate) fn disasm_ap101(data: &[u8]) {
    disasm(ChipFamily::Ap101, data);
}
