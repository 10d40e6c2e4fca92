//! `emu draw`: draws the rungs of a ladder program as text.

use clap::Args;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::LadderFlags;
use crate::shared::report::MessageStyle;
use crate::shared::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu draw examples/welder.ld
  emu draw - < welder.ld | less -S";

/// Flags of `emu draw`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DrawArgs {
    #[command(flatten)]
    program: LadderFlags,
}

/// Draws a program, including programs with errors that prevent them from running.
pub fn draw(args: &DrawArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let read = input::read_program(&args.program.file, args.program.read.options(), false, style)?;
    output::print(ladder::draw(&read.program))?;
    Ok(exit::OK)
}
