//! The codes of the assembler's complaints.

use diag::Code;

/// All of them; ASM040 to ASM059 are of the PIC16's dialect, ASM060 to ASM079 of AP101's.
#[rustfmt::skip]
pub const CODES: &[Code] = &[
];
