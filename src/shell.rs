//! `emu completions` and `emu man`: what a package of emu installs beside it.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use crate::args::Cli;
use crate::fail::{Failure, exit};
use crate::output;

/// Flags of `emu completions`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  emu completions bash > ~/.local/share/bash-completion/completions/emu")]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

/// Prints completions.
pub fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "emu", &mut script);
    output::print(script)?;
    Ok(exit::OK)
}

/// Prints the manual page.
pub fn man() -> Result<u8, Failure> {
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page).map_err(|e| Failure::writing("-", &e))?;
    output::print(page)?;
    Ok(exit::OK)
}
