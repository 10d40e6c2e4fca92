//! Mnemonics that expand to other instructions, as in gpasm and Microchip's MPASM ("special instruction
//! mnemonics").

use crate::dialect::AsmDirective;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::cut;

/// A part of an expansion.
enum SpecialPart {
    /// A fixed word: an instruction on a bit of STATUS.
    Word(u16),
    /// An instruction with the operands as written.
    Same(&'static str),
    /// An instruction on the first operand, with W (0) or the register (1) as its destination.
    To(&'static str, u8),
    /// The selection of the operand's page.
    Page,
}

use SpecialPart::{Page, Same, To, Word};

/// Skips the next instruction if carry, digit carry or zero is 0 or 1.
const IF_C: SpecialPart = Word(0x1803);
const IF_NC: SpecialPart = Word(0x1C03);
const IF_DC: SpecialPart = Word(0x1883);
const IF_NDC: SpecialPart = Word(0x1C83);
const IF_Z: SpecialPart = Word(0x1903);
const IF_NZ: SpecialPart = Word(0x1D03);

/// All special mnemonics: minimum and maximum number of operands, and the expansion.
#[rustfmt::skip]
const SPECIALS: &[(&str, usize, usize, &[SpecialPart])] = &[
    ("skpc", 0, 0, &[IF_NC]), ("skpnc", 0, 0, &[IF_C]), ("skpz", 0, 0, &[IF_NZ]), ("skpnz", 0, 0, &[IF_Z]),
    ("skpdc", 0, 0, &[IF_NDC]), ("skpndc", 0, 0, &[IF_DC]),
    ("setc", 0, 0, &[Word(0x1403)]), ("clrc", 0, 0, &[Word(0x1003)]), ("setz", 0, 0, &[Word(0x1503)]),
    ("clrz", 0, 0, &[Word(0x1103)]), ("setdc", 0, 0, &[Word(0x1483)]), ("clrdc", 0, 0, &[Word(0x1083)]),
    ("movfw", 1, 1, &[To("movf", 0)]), ("tstf", 1, 1, &[To("movf", 1)]), ("negf", 1, 2, &[To("comf", 1), Same("incf")]),
    ("addcf", 1, 2, &[IF_C, Same("incf")]), ("subcf", 1, 2, &[IF_C, Same("decf")]),
    ("adddcf", 1, 2, &[IF_DC, Same("incf")]), ("subdcf", 1, 2, &[IF_DC, Same("decf")]),
    ("b", 1, 1, &[Same("goto")]), ("bc", 1, 1, &[IF_C, Same("goto")]), ("bnc", 1, 1, &[IF_NC, Same("goto")]),
    ("bz", 1, 1, &[IF_Z, Same("goto")]), ("bnz", 1, 1, &[IF_NZ, Same("goto")]),
    ("bdc", 1, 1, &[IF_DC, Same("goto")]), ("bndc", 1, 1, &[IF_NDC, Same("goto")]),
    ("lcall", 1, 1, &[Page, Same("call")]), ("lgoto", 1, 1, &[Page, Same("goto")]),
];

/// Reports whether the word is a special mnemonic.
pub(crate) fn is_special(word: &str) -> bool {
    SPECIALS.iter().any(|(name, ..)| name.eq_ignore_ascii_case(word))
}

/// Returns the directive of a special mnemonic.
pub(super) const fn named(name: &'static str) -> AsmDirective {
    AsmDirective::run(name, special)
}

/// Emits the expansion of the mnemonic.
fn special(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let word = call.get(call.word.clone()).trim_start_matches('.').to_ascii_lowercase();
    let Some((name, least, most, parts)) = SPECIALS.iter().find(|row| row.0 == word) else { return };
    let operands = cut(asm.dialect, call.text, call.rest.clone());
    let mut right = (*least..=*most).contains(&operands.len());
    if !right {
        let (n, given) = (if least == most { least.to_string() } else { format!("{least} or {most}") }, operands.len());
        let cause = format!("`{name}` takes {n} operands, but here are {given}");
        asm.report(LineFault::new("ASM002", call.word.clone(), cause, "docs/formats/asm.md lists its expansion"));
    }
    for part in *parts {
        // A wrong instruction keeps its length, as any other; faults of its operands are reported once.
        let errors_before = asm.error_count();
        let give = |asm: &mut Assembler<'_>, text: &str, mnemonic, end| {
            let word = call.word.clone();
            let words =
                right.then(|| asm.assemble_instruction(text, mnemonic, word.clone(), call.rest.start..end)).flatten();
            asm.emit_words(&words.unwrap_or_else(|| vec![0]), word);
        };
        match part {
            Word(word) => asm.emit_words(&[*word], call.word.clone()),
            Same(mnemonic) => give(asm, call.text, mnemonic, call.rest.end),
            To(mnemonic, to) => {
                // The destination is appended after the operand, so a fault of the operand is reported at its
                // position.
                let end = operands.first().map_or(call.rest.end, |first| first.end);
                let text = format!("{},{to}", call.get(0..end));
                give(asm, &text, mnemonic, text.len());
            }
            Page => super::chip::pagesel(asm, call),
        }
        right &= asm.error_count() == errors_before;
    }
}
