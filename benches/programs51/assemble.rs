//! The programs in this folder are sources for the 8052.

use emu_8051::chips;
use emu_core::image::Image;

/// Assembles a program.
///
/// # Errors
/// All that is wrong with it, one a line.
pub fn image(source: &str) -> Result<Image, String> {
    let chip = chips::chip("8052").ok_or("no 8052")?;
    emu_asm::assemble_text(chip, source).map_err(|refused| refused.to_string())
}
