//! Lines from a terminal, from a pipe, from scripts and from the command line, handed to the [`Shell`] one by one.

use std::io::{self, BufRead};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::files::commands_of;
use super::shell::{Flow, Shell};
use super::terminal::Terminal;
use crate::fail::{Failure, exit};
use crate::output;

/// Where commands come from besides the user, and how they are told.
pub struct Script<'a> {
    /// Files of commands, then commands, in this order.
    pub files: &'a [String],
    /// Single commands.
    pub commands: &'a [String],
    /// The first command that fails ends it all, and nothing is told but results.
    pub batch: bool,
}

/// What asks a session to stop, from outside.
#[derive(Clone, Default)]
pub struct Signals {
    /// Stop at the next instruction, and the script too.
    pub interrupt: Arc<AtomicBool>,
    /// Leave.
    pub leave: Arc<AtomicBool>,
    /// The user is being waited for at a terminal, so that nothing looks at the others.
    pub prompt: Arc<AtomicBool>,
    /// A line from a pipe is being waited for, so that nothing looks at the others.
    pub pipe: Arc<AtomicBool>,
}

const INTERRUPTED: &str = "interrupted: what was still to be carried out is left out\n";

/// A conversation.
struct Talk<'a> {
    shell: &'a mut Shell,
    signals: Signals,
    batch: bool,
    /// A command of a script or of a pipe has failed.
    failed: bool,
}

/// Carries out the scripts, then what the user says, at a terminal if there is one. Gives the exit code.
pub fn talk(
    shell: &mut Shell,
    script: &Script<'_>,
    terminal: Option<Terminal>,
    signals: &Signals,
) -> Result<u8, Failure> {
    let mut talk = Talk { shell, signals: signals.clone(), batch: script.batch, failed: false };
    let scripted = !script.files.is_empty() || !script.commands.is_empty();
    match (talk.scripts(script)?, terminal) {
        (End::Code(code), _) => Ok(talk.code(code)),
        // A user is there who has stopped the script, not the session.
        (End::Interrupted, Some(terminal)) if !talk.signals.leave.load(Ordering::SeqCst) => talk.terminal(terminal),
        (End::Interrupted, _) => Ok(exit::LIMIT),
        (End::Reached, _) if script.batch && scripted => {
            let code = talk.shell.code();
            Ok(talk.code(code))
        }
        (End::Reached, Some(terminal)) => talk.terminal(terminal),
        (End::Reached, None) => talk.pipe(),
    }
}

/// How scripts, or the lines of a pipe, came to their end.
enum End {
    /// All was carried out that was to be.
    Reached,
    /// The session ends, with an exit code.
    Code(u8),
    /// A signal has come.
    Interrupted,
}

/// Carries out the scripts before a face that is not a conversation; what they print goes to `out`. Gives an exit code where they
/// end the session. Like the conversation it goes on behind a command that fails, which `out` tells.
#[cfg(feature = "tui")]
pub fn prepare(shell: &mut Shell, script: &Script<'_>, out: &mut String) -> Result<Option<u8>, Failure> {
    let mut carry_out = |line: &str| {
        let flow = shell.execute(line, out);
        if shell.interrupted() {
            output::tell(INTERRUPTED);
            return Ok(Flow::Quit(exit::LIMIT));
        }
        if let Flow::Failed(why) = &flow {
            out.push_str(&format!("error: {why}\n"));
        }
        Ok(flow)
    };
    for file in script.files {
        let text = crate::input::bytes(file)?;
        for (_, line) in commands_of(&diag::text::readable(&text)) {
            match carry_out(line)? {
                Flow::Quit(code) => return Ok(Some(code)),
                Flow::Failed(_) => break,
                Flow::Next | Flow::More => {}
            }
        }
    }
    for command in script.commands {
        if let Flow::Quit(code) = carry_out(command)? {
            return Ok(Some(code));
        }
    }
    if let Err(why) = shell.ended() {
        out.push_str(&format!("error: {why}\n"));
    }
    Ok(None)
}

impl Talk<'_> {
    /// The exit code, where the shell says `code`.
    fn code(&self, code: u8) -> u8 {
        if self.failed && code == exit::OK { exit::FAILED } else { code }
    }

    /// Carries out the scripts.
    fn scripts(&mut self, script: &Script<'_>) -> Result<End, Failure> {
        for file in script.files {
            let text = crate::input::bytes(file)?;
            for (_, line) in commands_of(&diag::text::readable(&text)) {
                match self.scripted(line)? {
                    (_, Some(end)) => return Ok(end),
                    // The rest of a script makes no sense when one of its commands has failed.
                    (Flow::Failed(_), None) => break,
                    _ => {}
                }
            }
            if let Some(end) = self.ended()? {
                return Ok(end);
            }
        }
        for command in script.commands {
            if let (_, Some(end)) = self.scripted(command)? {
                return Ok(end);
            }
        }
        Ok(self.ended()?.unwrap_or(End::Reached))
    }

    /// Lines have come to their end; commands of a point that lack theirs are a failure.
    fn ended(&mut self) -> Result<Option<End>, Failure> {
        let Err(why) = self.shell.ended() else { return Ok(None) };
        self.failed(&why)?;
        Ok(self.batch.then_some(End::Code(exit::FAILED)))
    }

    fn failed(&mut self, why: &str) -> Result<(), Failure> {
        self.failed = true;
        let text = format!("error: {why}\n");
        if self.batch {
            output::tell(&text)
        } else {
            output::print(text)?
        }
        Ok(())
    }

    /// Carries out a line that nobody types, and tells whether it is the last.
    fn scripted(&mut self, line: &str) -> Result<(Flow, Option<End>), Failure> {
        let flow = self.line(line, true)?;
        let end = match &flow {
            Flow::Quit(code) => Some(End::Code(*code)),
            _ if self.shell.interrupted() => {
                if self.batch {
                    output::tell(INTERRUPTED)
                } else {
                    output::print(INTERRUPTED)?
                }
                Some(End::Interrupted)
            }
            Flow::Failed(_) if self.batch => Some(End::Code(exit::FAILED)),
            _ => None,
        };
        Ok((flow, end))
    }

    /// Carries out a line.
    fn line(&mut self, line: &str, echo: bool) -> Result<Flow, Failure> {
        if echo && !self.batch {
            output::print(format!("{}{line}\n", self.shell.prompt()))?;
        }
        let mut out = String::new();
        let mut flow = self.shell.begin(line, &mut out);
        loop {
            output::print(std::mem::take(&mut out))?;
            if flow != Flow::More {
                break;
            }
            flow = self.shell.proceed(&mut out);
        }
        if let Flow::Failed(why) = &flow {
            self.failed(why)?;
        }
        Ok(flow)
    }

    /// Lines from a pipe or a file.
    fn pipe(&mut self) -> Result<u8, Failure> {
        let mut input = io::stdin().lock();
        loop {
            let mut line = Vec::new();
            self.signals.pipe.store(true, Ordering::SeqCst);
            let read = input.read_until(b'\n', &mut line);
            self.signals.pipe.store(false, Ordering::SeqCst);
            if read.map_err(|error| crate::input::unreadable("-", &error))? == 0 {
                break;
            }
            let line = String::from_utf8_lossy(&line);
            match self.scripted(line.trim_end_matches(['\n', '\r']))?.1 {
                Some(End::Code(code)) => return Ok(self.code(code)),
                Some(_) => return Ok(exit::LIMIT),
                None => {}
            }
        }
        self.ended()?;
        let code = self.shell.code();
        Ok(self.code(code))
    }

    /// Lines from a user. What fails is no failure of the session.
    fn terminal(&mut self, mut terminal: Terminal) -> Result<u8, Failure> {
        let mut out = String::new();
        self.shell.here(&mut out);
        output::print(out)?;
        loop {
            self.shell.forget_interrupt();
            // Who is to leave looks at this first, and leaves by itself then.
            self.signals.prompt.store(true, Ordering::SeqCst);
            if self.signals.leave.load(Ordering::SeqCst) {
                break;
            }
            let line = terminal.line(self.shell);
            self.signals.prompt.store(false, Ordering::SeqCst);
            let Some(line) = line else { break };
            let flow = self.line(&line, false)?;
            self.failed = false;
            if let Flow::Quit(code) = flow {
                return Ok(code);
            }
        }
        Ok(exit::OK)
    }
}
