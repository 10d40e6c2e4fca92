//! Lines from a terminal, from a pipe, from scripts and from the command line, handed to the [`DebugShell`] one by one.

use std::io::{self, BufRead};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::files::commands_of;
use super::shell::{DebugShell, ShellFlow};
use super::terminal::LineEditor;
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output;

/// Where commands come from besides the user, and how they are told.
pub struct CommandScript<'a> {
    /// Files of commands, then commands, in this order.
    pub files: &'a [String],
    /// Single commands.
    pub commands: &'a [String],
    /// The first command that fails ends it all, and nothing is told but results.
    pub batch: bool,
}

/// What asks a session to stop, from outside.
#[derive(Clone, Default)]
pub struct SessionSignals {
    /// Stop at the next instruction, and the script too.
    pub interrupt: Arc<AtomicBool>,
    /// Leave.
    pub leave: Arc<AtomicBool>,
    /// The user is being waited for at a terminal, so that nothing looks at the others.
    pub at_prompt: Arc<AtomicBool>,
    /// A line from a pipe is being waited for, so that nothing looks at the others.
    pub at_pipe: Arc<AtomicBool>,
}

const INTERRUPTED: &str = "interrupted: what was still to be carried out is left out\n";

/// A conversation.
struct Conversation<'a> {
    shell: &'a mut DebugShell,
    signals: SessionSignals,
    batch: bool,
    /// A command of a script or of a pipe has failed.
    failed: bool,
}

/// Carries out the scripts, then what the user says, at a terminal if there is one. Gives the exit code.
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
        // A user is there who has stopped the script, not the session.
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

/// How scripts, or the lines of a pipe, came to their end.
enum ScriptEnd {
    /// All was carried out that was to be.
    Finished,
    /// The session ends, with an exit code.
    Code(u8),
    /// A signal has come.
    Interrupted,
}

/// Carries out the scripts before a face that is not a conversation; what they print goes to `out`. Gives an exit code where they
/// end the session. Like the conversation it goes on behind a command that fails, which `out` tells.
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
    /// The exit code, where the shell says `code`.
    fn exit_code(&self, code: u8) -> u8 {
        if self.failed && code == exit::OK { exit::FAILED } else { code }
    }

    /// Carries out the scripts.
    fn scripts(&mut self, script: &CommandScript<'_>) -> Result<ScriptEnd, VerbFailure> {
        for file in script.files {
            let text = crate::shared::input::read_bytes(file)?;
            for (_, line) in commands_of(&diag::text::readable(&text)) {
                match self.run_script_line(line)? {
                    (_, Some(end)) => return Ok(end),
                    // The rest of a script makes no sense when one of its commands has failed.
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

    /// Lines have come to their end; commands of a point that lack theirs are a failure.
    fn end_of_lines(&mut self) -> Result<Option<ScriptEnd>, VerbFailure> {
        let Err(why) = self.shell.end_of_lines() else { return Ok(None) };
        self.report_failure(&why)?;
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

    /// Carries out a line that nobody types, and tells whether it is the last.
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

    /// Carries out a line.
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

    /// Lines from a pipe or a file.
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

    /// Lines from a user. What fails is no failure of the session.
    fn read_terminal(&mut self, mut terminal: LineEditor) -> Result<u8, VerbFailure> {
        let mut out = String::new();
        self.shell.report_position(&mut out);
        output::print(out)?;
        loop {
            self.shell.forget_interrupt();
            // Who is to leave looks at this first, and leaves by itself then.
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
