//! Reads lines from a terminal, a pipe, scripts and the command line, and passes them to the [`DebugShell`].

use std::io::{self, BufRead};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::files::commands_of;
use super::shell::{DebugShell, ShellFlow};
use super::terminal::LineEditor;
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;

/// Commands that are executed before those of the user, and how failures are handled.
pub struct CommandScript<'a> {
    /// Files of commands, executed first.
    pub files: &'a [String],
    /// Single commands, executed after the files.
    pub commands: &'a [String],
    /// The first command that fails ends the session, and commands are not repeated in the output.
    pub batch: bool,
}

/// Flags that signals set to stop or end a session, and flags that show for what the session waits.
#[derive(Clone, Default)]
pub struct SessionSignals {
    /// Stop at the next instruction, and stop the script too.
    pub interrupt: Arc<AtomicBool>,
    /// End the session.
    pub leave: Arc<AtomicBool>,
    /// The program waits for the user at a terminal, so nothing checks the other flags.
    pub at_prompt: Arc<AtomicBool>,
    /// The program waits for a line from a pipe, so nothing checks the other flags.
    pub at_pipe: Arc<AtomicBool>,
}

const INTERRUPTED: &str = "interrupted: the remaining commands are skipped\n";

/// A command line session that is in progress.
struct Conversation<'a> {
    shell: &'a mut DebugShell,
    signals: SessionSignals,
    batch: bool,
    /// A command of a script or of a pipe has failed.
    failed: bool,
}

/// Executes the scripts, then lines from the terminal if there is one, otherwise from standard input. Returns
/// the exit code.
pub fn converse(
    shell: &mut DebugShell,
    script: &CommandScript<'_>,
    terminal: Option<LineEditor>,
    signals: &SessionSignals,
) -> Result<u8, VerbFailure> {
    let mut talk = Conversation { shell, signals: signals.clone(), batch: script.batch, failed: false };
    let scripted = !script.files.is_empty() || !script.commands.is_empty();
    match (talk.scripts(script)?, terminal) {
        (ScriptEnd::Code(code), _) => Ok(talk.exit_code(code)),
        // The user at the terminal has stopped the script, not the session.
        (ScriptEnd::Interrupted, Some(terminal)) if !talk.signals.leave.load(Ordering::SeqCst) => {
            talk.read_terminal(terminal)
        }
        (ScriptEnd::Interrupted, _) => Ok(exit::LIMIT),
        (ScriptEnd::Finished, _) if script.batch && scripted => {
            let code = talk.shell.exit_code();
            Ok(talk.exit_code(code))
        }
        (ScriptEnd::Finished, Some(terminal)) => talk.read_terminal(terminal),
        (ScriptEnd::Finished, None) => talk.read_pipe(),
    }
}

/// How scripts, or the lines of a pipe, ended.
enum ScriptEnd {
    /// Everything was executed.
    Finished,
    /// The session ends, with an exit code.
    Code(u8),
    /// A signal arrived.
    Interrupted,
}

/// Executes the scripts for the full screen, and appends their output to `out`. Returns an exit code if they
/// end the session. A failed command is reported in `out` and ends its file, but not the session.
#[cfg(feature = "tui")]
pub fn run_scripts(
    shell: &mut DebugShell,
    script: &CommandScript<'_>,
    out: &mut String,
) -> Result<Option<u8>, VerbFailure> {
    let mut carry_out = |line: &str| {
        let flow = shell.execute(line, out);
        if shell.is_interrupted() {
            output::print_to_stderr(INTERRUPTED);
            return Ok(ShellFlow::Quit(exit::LIMIT));
        }
        if let ShellFlow::Failed(why) = &flow {
            out.push_str(&format!("error: {why}\n"));
        }
        Ok(flow)
    };
    for file in script.files {
        let text = crate::shared::input::read_bytes(file)?;
        for (_, line) in commands_of(&diag::text::readable(&text)) {
            match carry_out(line)? {
                ShellFlow::Quit(code) => return Ok(Some(code)),
                ShellFlow::Failed(_) => break,
                ShellFlow::Next | ShellFlow::PointCommands => {}
            }
        }
    }
    for command in script.commands {
        if let ShellFlow::Quit(code) = carry_out(command)? {
            return Ok(Some(code));
        }
    }
    if let Err(why) = shell.end_of_lines() {
        out.push_str(&format!("error: {why}\n"));
    }
    Ok(None)
}

impl Conversation<'_> {
    /// Returns the exit code: `code` of the shell, or 1 if that is 0 and a command has failed.
    fn exit_code(&self, code: u8) -> u8 {
        if self.failed && code == exit::OK { exit::FAILED } else { code }
    }

    /// Executes the scripts.
    fn scripts(&mut self, script: &CommandScript<'_>) -> Result<ScriptEnd, VerbFailure> {
        for file in script.files {
            let text = crate::shared::input::read_bytes(file)?;
            for (_, line) in commands_of(&diag::text::readable(&text)) {
                match self.run_script_line(line)? {
                    (_, Some(end)) => return Ok(end),
                    // After a command of a script has failed, the rest of the script is skipped.
                    (ShellFlow::Failed(_), None) => break,
                    _ => {}
                }
            }
            if let Some(end) = self.end_of_lines()? {
                return Ok(end);
            }
        }
        for command in script.commands {
            if let (_, Some(end)) = self.run_script_line(command)? {
                return Ok(end);
            }
        }
        Ok(self.end_of_lines()?.unwrap_or(ScriptEnd::Finished))
    }

    /// Reports a block that is still open at the end of the lines as a failure.
    fn end_of_lines(&mut self) -> Result<Option<ScriptEnd>, VerbFailure> {
        let Err(why) = self.shell.end_of_lines() else { return Ok(None) };
        self.report_failure(&why.to_string())?;
        Ok(self.batch.then_some(ScriptEnd::Code(exit::FAILED)))
    }

    fn report_failure(&mut self, why: &str) -> Result<(), VerbFailure> {
        self.failed = true;
        let text = format!("error: {why}\n");
        if self.batch {
            output::print_to_stderr(&text)
        } else {
            output::print(text)?
        }
        Ok(())
    }

    /// Executes a line of a script or a pipe. Also returns how the session ends if this line ends it.
    fn run_script_line(&mut self, line: &str) -> Result<(ShellFlow, Option<ScriptEnd>), VerbFailure> {
        let flow = self.run_line(line, true)?;
        let end = match &flow {
            ShellFlow::Quit(code) => Some(ScriptEnd::Code(*code)),
            _ if self.shell.is_interrupted() => {
                if self.batch {
                    output::print_to_stderr(INTERRUPTED)
                } else {
                    output::print(INTERRUPTED)?
                }
                Some(ScriptEnd::Interrupted)
            }
            ShellFlow::Failed(_) if self.batch => Some(ScriptEnd::Code(exit::FAILED)),
            _ => None,
        };
        Ok((flow, end))
    }

    /// Executes a line and prints its output.
    fn run_line(&mut self, line: &str, echo: bool) -> Result<ShellFlow, VerbFailure> {
        if echo && !self.batch {
            output::print(format!("{}{line}\n", self.shell.prompt()))?;
        }
        let mut out = String::new();
        let mut flow = self.shell.execute_line(line, &mut out);
        loop {
            output::print(std::mem::take(&mut out))?;
            if flow != ShellFlow::PointCommands {
                break;
            }
            flow = self.shell.run_next_command(&mut out);
        }
        if let ShellFlow::Failed(why) = &flow {
            self.report_failure(why)?;
        }
        Ok(flow)
    }

    /// Executes lines from a pipe or a file.
    fn read_pipe(&mut self) -> Result<u8, VerbFailure> {
        let mut input = io::stdin().lock();
        loop {
            let mut line = Vec::new();
            self.signals.at_pipe.store(true, Ordering::SeqCst);
            let read = input.read_until(b'\n', &mut line);
            self.signals.at_pipe.store(false, Ordering::SeqCst);
            if read.map_err(|error| crate::shared::input::unreadable_file("-", &error))? == 0 {
                break;
            }
            let line = String::from_utf8_lossy(&line);
            match self.run_script_line(line.trim_end_matches(['\n', '\r']))?.1 {
                Some(ScriptEnd::Code(code)) => return Ok(self.exit_code(code)),
                Some(_) => return Ok(exit::LIMIT),
                None => {}
            }
        }
        self.end_of_lines()?;
        let code = self.shell.exit_code();
        Ok(self.exit_code(code))
    }

    /// Executes lines from a user at a terminal. A command that fails does not change the exit code.
    fn read_terminal(&mut self, mut terminal: LineEditor) -> Result<u8, VerbFailure> {
        let mut out = String::new();
        self.shell.report_position(&mut out);
        output::print(out)?;
        loop {
            self.shell.forget_interrupt();
            // A signal handler that finds `at_prompt` set ends the program itself.
            self.signals.at_prompt.store(true, Ordering::SeqCst);
            if self.signals.leave.load(Ordering::SeqCst) {
                break;
            }
            let line = terminal.read_line(self.shell);
            self.signals.at_prompt.store(false, Ordering::SeqCst);
            let Some(line) = line else { break };
            let flow = self.run_line(&line, false)?;
            self.failed = false;
            if let ShellFlow::Quit(code) = flow {
                return Ok(code);
            }
        }
        Ok(exit::OK)
    }
}
