//! `emu completions` and `emu man`: files that a package of `emu` installs with the program.

use std::iter;
use std::path::Path;

use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;

use crate::args::CommandLine;
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;
use diag::nearest;

/// Flags of `emu completions`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  emu completions bash > ~/.local/share/bash-completion/completions/emu")]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

/// Prints the completion script of a shell.
pub fn completions(args: &CompletionsArgs) -> Result<u8, VerbFailure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut CommandLine::command(), "emu", &mut script);
    output::print(script)?;
    Ok(exit::OK)
}

/// Flags of `emu man`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  emu man run | man -l -          the page of a verb\n  emu man --output man1          emu.1, emu-run.1, .."
)]
pub struct ManArgs {
    /// The verb whose page is printed. Default: the page of emu.
    #[arg(value_name = "VERB", conflicts_with = "output")]
    verb: Option<String>,
    /// Write the pages of emu and of every verb into this folder, which is created.
    #[arg(short, long, value_name = "DIR")]
    output: Option<String>,
}

/// Prints a manual page, or writes all pages.
pub fn man(args: &ManArgs) -> Result<u8, VerbFailure> {
    let root = root_command();
    let Some(folder) = &args.output else {
        let wanted = args.verb.as_deref().unwrap_or("emu");
        let verbs = || commands(&root).map(Command::get_name);
        let Some(command) = commands(&root).find(|command| command.get_name() == wanted) else {
            let near = nearest(wanted, verbs()).map_or(String::new(), |near| format!("; did you mean {near}?"));
            return Err(VerbFailure::Usage(format!("there is no verb `{wanted}`{near}")));
        };
        output::print(page(command)?)?;
        return Ok(exit::OK);
    };
    output::ensure_writable_folder(folder)?;
    let mut pages = Vec::new();
    for command in commands(&root) {
        let file = Path::new(folder).join(file_name(command));
        pages.push((file.to_string_lossy().into_owned(), page(command)?));
    }
    output::write_files(&pages.iter().map(|(file, page)| (file.as_str(), page.as_slice())).collect::<Vec<_>>())?;
    Ok(exit::OK)
}

/// Returns the command line with the names that the manual pages use.
fn root_command() -> Command {
    let mut root = CommandLine::command().disable_help_subcommand(true);
    root.build();
    root
}

/// Returns the root command and its verbs.
fn commands(root: &Command) -> impl Iterator<Item = &Command> {
    iter::once(root).chain(root.get_subcommands())
}

/// Returns the file name of a command's page: `emu-run.1`.
fn file_name(command: &Command) -> String {
    format!("{}.1", command.get_display_name().unwrap_or_else(|| command.get_name()))
}

/// Renders the page of a command.
fn page(command: &Command) -> Result<Vec<u8>, VerbFailure> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut page).map_err(|e| VerbFailure::write_failed("-", &e))?;
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn completions_offer_chips() {
        let mut script = Vec::new();
        clap_complete::generate(Shell::Bash, &mut CommandLine::command(), "emu", &mut script);
        let script = String::from_utf8_lossy(&script).into_owned();
        assert!(script.contains("compgen -W \"atmega328p "), "verbs of one chip");
        assert!(script.contains("compgen -W \"all atmega328p "), "verbs of several");
    }

    /// The heading of the last family must not stand over flags for all chips.
    #[test]
    fn only_its_own_flags_are_under_the_heading_of_ap101() {
        let root = root_command();
        let mut count = 0;
        for command in commands(&root) {
            let heading = |arg: &&clap::Arg| arg.get_help_heading() == Some("Only for AP101");
            let under: Vec<&str> = command.get_arguments().filter(heading).map(|arg| arg.get_id().as_str()).collect();
            assert!(under.is_empty() || under == ["inputs"], "{}: {under:?}", command.get_name());
            count += under.len();
        }
        assert!(count >= 2, "{count} verbs run AP101");
    }

    /// The page of emu refers to `emu-run(1)` and other pages; each of them is written.
    #[test]
    fn every_page_referred_to_is_written() {
        let root = root_command();
        let names: Vec<String> = commands(&root).map(file_name).collect();
        let page = String::from_utf8_lossy(&page(&root).unwrap_or_default()).replace("\\-", "-");
        let referred: Vec<&str> = page.lines().filter_map(|line| line.strip_suffix("(1)")).collect();
        assert!(referred.len() > 10, "{referred:?}");
        assert!(referred.iter().all(|name| names.contains(&format!("{name}.1"))), "{referred:?} {names:?}");
    }
}
