//! Truncates values that are too large for an operand field, with a warning.
//!
//! gpasm computes with 32 bits. Its warning 202 covers a constant below -255 or above 255 and a bit or
//! destination outside its field, its warning 219 a register beyond the last of the chip. It reports nothing
//! for a jump.

use emu_core::chip::Chip;

use crate::fault::AsmRefusal;
use crate::matching::{DESTINATION, LITERAL};

/// Number of file register addresses in all banks.
const FILE_ADDRESSES: i64 = 0x200;
/// Words that CALL and GOTO reach with the page that PCLATH selects.
const REACHABLE_WORDS: i64 = 0x2000;

/// Implements [`crate::dialect::CutToField`] for the PIC16.
pub(super) fn cut_to_field(chip: &Chip, kind: &str, _: u32, value: i64) -> Option<(i64, Option<AsmRefusal>)> {
    // Signed 32 bits: 0xFFFFFFFF is -1.
    let n = i64::from(value as i32);
    let warned = |code, fits: i64, of: &str| {
        let cause = format!("{n} (0x{:X}) does not fit into {of}: 0x{fits:X} is left of it", n as i32);
        Some((fits, Some(AsmRefusal::new(code, cause, "select a part with & or low()"))))
    };
    match kind {
        "constant" if (-0xFF..=0xFF).contains(&n) => Some((n & 0xFF, None)),
        "constant" => warned("ASM046", n & 0xFF, "a constant of 8 bits"),
        "bit" if !(0..8).contains(&n) => warned("ASM046", n & 7, "the number of a bit, 0 to 7"),
        DESTINATION if n != n & 1 => warned("ASM046", n & 1, "a destination, W (0) or F (1)"),
        // TRIS has five bits for the address of its register.
        LITERAL => Some((n & 0x1F, None)),
        "file register" if !(0..FILE_ADDRESSES).contains(&n) => {
            warned("ASM047", n & (FILE_ADDRESSES - 1), "the address of a register")
        }
        "target" if !(0..REACHABLE_WORDS).contains(&n) || n >= i64::from(chip.flash_bytes / chip.word_bytes.max(1)) => {
            let (words, fits) = (chip.flash_bytes / chip.word_bytes.max(1), n & (REACHABLE_WORDS - 1));
            let cause = format!("0x{:X} is beyond the {words} program words of the {}", n as i32, chip.name);
            let hint = "the instruction contains the lower 11 bits of the address, and the chip jumps there";
            Some((fits, Some(AsmRefusal::new("ASM048", cause, hint))))
        }
        _ => None,
    }
}
