//! Assembles the benchmark programs in this folder for the ATmega328P.

use emu_avr::chips::ATMEGA328P;
use emu_core::image::Image;

/// Names and sources of the programs.
pub const PROGRAMS: &[(&str, &str)] = &[
    ("alu", include_str!("alu.s")),
    ("copy", include_str!("copy.s")),
    ("crc", include_str!("crc.s")),
    ("sieve", include_str!("sieve.s")),
    ("irq", include_str!("irq.s")),
    ("sleep", include_str!("sleep.s")),
    ("poll", include_str!("poll.s")),
];

/// Assembles a program.
///
/// # Errors
/// All errors of the source, one per line.
pub fn image(source: &str) -> Result<Image, String> {
    emu_asm::assemble_text(&ATMEGA328P, source).map_err(|refused| refused.to_string())
}
