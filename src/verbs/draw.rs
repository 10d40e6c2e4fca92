//! `emu draw`: draws the rungs of a ladder program as text.

use clap::Args;
use ladder::Notation;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::LadderFlags;
use crate::shared::report::{FileTexts, MessageStyle};
use crate::shared::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu draw examples/welder.ld
  emu draw examples/relays.grid --paths
  emu draw - < welder.ld | less -S";

/// Flags of `emu draw`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct DrawArgs {
    #[command(flatten)]
    program: LadderFlags,
    /// For grids of CSLadder: list the paths to each output, as an OR of ANDs.
    #[arg(long)]
    paths: bool,
}

/// Draws a program, including programs with errors that prevent them from running.
pub fn draw(args: &DrawArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    if args.paths {
        return draw_paths(args);
    }
    let read = input::read_program(&args.program.file, args.program.read.options(), false, style)?;
    output::print(ladder::draw(&read.program))?;
    Ok(exit::OK)
}

/// Lists the paths of grids.
fn draw_paths(args: &DrawArgs) -> Result<u8, VerbFailure> {
    let file = &args.program.file;
    let bytes = input::read_bytes(file)?;
    let text = diag::text::decode_text(&bytes);
    let options = args.program.read.options();
    if ladder::notation_of(file, &text, options) != Some(Notation::Grid) {
        return Err(VerbFailure::Usage(format!("{file} has no grids of CSLadder, and --paths lists their paths")));
    }
    match ladder::grid::read(file, &text) {
        Ok(read) => output::print(ladder::grid::paths_text(&read.program)).map(|()| exit::OK),
        Err(faults) => Err(VerbFailure::Refused(faults, FileTexts::one(file, bytes))),
    }
}
