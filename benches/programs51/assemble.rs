//! Assembles the benchmark programs in this folder for the 8052.

use emu_8051::chips;
use emu_core::image::Image;

/// Assembles a program.
///
/// # Errors
/// All errors of the source, one per line.
pub fn image(source: &str) -> Result<Image, String> {
    let chip = chips::chip("8052").ok_or("no 8052")?;
    emu_asm::assemble_text(chip, source).map_err(|refused| refused.to_string())
}
