//! `emu draw`: the rungs of a ladder program as text.

use clap::Args;

use crate::args::Ladder;
use crate::fail::{Failure, exit};
use crate::report::Terminal;
use crate::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu draw examples/welder.ld
  emu draw - < welder.ld | less -S";

/// Flags of `emu draw`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DrawArgs {
    #[command(flatten)]
    program: Ladder,
}

/// Draws a program. Programs that cannot run can still be drawn.
pub fn draw(args: &DrawArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let read = input::program(&args.program.file, args.program.dialect, false, terminal)?;
    output::print(ladder::draw(&read.program))?;
    Ok(exit::OK)
}
