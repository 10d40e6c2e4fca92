//! Commands about the session: scripts, saving and loading, quitting.

use emu_debug::snapshot;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell, ShellFlow};
use crate::shared::codes::system_message;
use crate::shared::fail::VerbFailure;
use crate::shared::input;
use crate::shared::output;
use crate::shared::output::RequestedOutput;
use crate::shared::report::FileTexts;

/// Maximum nesting depth of scripts.
const MAX_NESTING: u32 = 20;

/// `source`: executes the commands of a file.
pub(super) fn source(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the name of a file is missing".into());
    }
    let bytes = input::read_file(args).map_err(|error| format!("{args} cannot be read: {}", system_message(&error)))?;
    shell.run_script(args, &diag::text::readable(&bytes), &mut |_| {}, out)
}

/// Returns the lines of a script that are commands, each with its number. Empty lines are skipped and do not
/// repeat a command.
pub fn commands_of(text: &str) -> impl Iterator<Item = (u32, &str)> {
    (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty())
}

impl DebugShell {
    /// Executes the lines of a script, up to the first that fails, and calls `before_line` with each line
    /// first.
    pub fn run_script(
        &mut self,
        name: &str,
        text: &str,
        before_line: &mut dyn FnMut(&str),
        out: &mut String,
    ) -> CommandResult {
        if self.nesting >= MAX_NESTING {
            return Err(format!("{name}: scripts are nested too deeply").into());
        }
        self.nesting += 1;
        // Queued commands of points continue after the script.
        let queue = std::mem::take(&mut self.queue);
        let done = commands_of(text).try_for_each(|(number, line)| {
            if self.leave.is_some() {
                return Ok(());
            }
            before_line(line);
            let why = match self.execute(line, out) {
                ShellFlow::Failed(why) => why,
                _ if self.is_interrupted() => "interrupted".to_owned(),
                _ => return Ok(()),
            };
            // In nested scripts, the innermost one adds its location to the message.
            let placed = std::mem::replace(&mut self.error_has_place, true);
            Err(if placed { why } else { format!("{name}:{number}: {why}") }.into())
        });
        let done = done.and_then(|()| self.end_of_lines().map_err(|why| format!("{name}: {why}").into()));
        self.nesting -= 1;
        self.queue = queue;
        self.error_has_place &= self.nesting > 0;
        done
    }
}

/// `save`: writes a snapshot, or the commands that set all points.
pub(super) fn save(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (word, rest) = args.split_once(char::is_whitespace).unwrap_or((args, ""));
    if word == "breakpoints" || !word.is_empty() && !rest.is_empty() && "breakpoints".starts_with(word) {
        return save_breakpoints(shell, rest.trim(), out);
    }
    let (file, cycle) = (file_argument(args)?, shell.session.machine().cycle());
    shell.session.check_snapshot_possible()?;
    shell.snapshot_writer.write(file, cycle, &shell.session.save()).map_err(|failure| failure.sentence())?;
    out.push_str(&format!("{file} contains the machine at cycle {cycle}\n"));
    Ok(())
}

/// `save breakpoints FILE`: writes the commands that set all points.
fn save_breakpoints(shell: &DebugShell, args: &str, out: &mut String) -> CommandResult {
    let file = file_argument(args)?;
    if shell.session.points.all().is_empty() {
        return Err("nothing to save: there are no breakpoints and no watchpoints".into());
    }
    for own in &shell.snapshot_writer.protected_files {
        output::check_input_not_overwritten(own, &[RequestedOutput::new("save", file)])
            .map_err(|failure| failure.sentence())?;
    }
    let text = super::points::commands_that_set(shell);
    output::write_files(&[(file, text.as_bytes())]).map_err(|failure| failure.sentence())?;
    out.push_str(&format!("Saved to file '{file}'.\n"));
    Ok(())
}

/// `load`: restores a snapshot.
pub(super) fn load(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let file = file_argument(args)?;
    shell.session.check_snapshot_possible()?;
    let sentence = |failure: VerbFailure| failure.sentence();
    let refused = |fault| sentence(VerbFailure::Refused(vec![fault], FileTexts::default()));
    let bytes = input::read_bytes(file).map_err(sentence)?;
    let snapshot::MachineState { cycle, state } =
        snapshot::decode_snapshot_for(file, &bytes, &shell.snapshot_writer.head).map_err(refused)?;
    shell.session.load(state, cycle).map_err(|_| refused(snapshot::invalid_state(file)))?;
    shell.loaded = Some((file.to_owned(), cycle));
    shell.restart_reports(out);
    Ok(())
}

/// Checks the file name of a command; standard input and output are used by the session.
fn file_argument(args: &str) -> Result<&str, CommandError> {
    match args {
        "" => Err("the name of a file is missing".into()),
        "-" => Err("write the name of a file; `-` is not accepted here".into()),
        file => Ok(file),
    }
}

/// `quit`: ends the session with an exit code.
pub(super) fn quit(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    let code = if args.is_empty() { i64::from(shell.exit_code()) } else { shell.integer_value(args)? };
    shell.leave = Some(u8::try_from(code).map_err(|_| format!("{code} is not an exit code; exit codes are 0 to 255"))?);
    Ok(())
}
