//! The programs in this folder: one instruction a line, `;` begins a comment, targets relative to the next instruction.

use emu_avr::isa::assemble;
use emu_core::image::{Image, Segment};

/// Names and sources.
pub const PROGRAMS: &[(&str, &str)] = &[
    ("alu", include_str!("alu.s")),
    ("copy", include_str!("copy.s")),
    ("crc", include_str!("crc.s")),
    ("sieve", include_str!("sieve.s")),
    ("irq", include_str!("irq.s")),
    ("sleep", include_str!("sleep.s")),
    ("poll", include_str!("poll.s")),
];

/// Assembles a program from address 0.
///
/// # Errors
/// The first line that is no instruction, with its number and the cause.
pub fn image(source: &str) -> Result<Image, String> {
    let mut bytes = Vec::new();
    for (number, line) in (1..).zip(source.lines()) {
        let code = line.split(';').next().unwrap_or("").trim();
        if !code.is_empty() {
            let words = assemble(code, bytes.len() as u32 / 2).map_err(|e| format!("line {number}: {e}"))?;
            bytes.extend(words.into_iter().flat_map(u16::to_le_bytes));
        }
    }
    Ok(Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() })
}
