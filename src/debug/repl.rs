//! Lines from a terminal, from a pipe, from scripts and from the command line, handed to the [`Shell`] one by one.

use std::io::{self, BufRead};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

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
    /// Stop at the next instruction.
    pub interrupt: Arc<AtomicBool>,
    /// Leave.
    pub leave: Arc<AtomicBool>,
    /// The user is being waited for, so that nothing looks at the others.
    pub prompt: Arc<AtomicBool>,
}

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
    for file in script.files {
        let text = crate::input::bytes(file)?;
        for line in String::from_utf8_lossy(&text).lines() {
            match talk.line(line, true)? {
                Flow::Quit(code) => return Ok(talk.code(code)),
                // The rest of a script makes no sense when one of its commands has failed.
                Flow::Failed(_) => break,
                Flow::Next | Flow::More => {}
            }
        }
        if talk.failed && talk.batch {
            return Ok(exit::FAILED);
        }
    }
    for command in script.commands {
        match talk.line(command, true)? {
            Flow::Quit(code) => return Ok(talk.code(code)),
            Flow::Failed(_) if talk.batch => return Ok(exit::FAILED),
            _ => {}
        }
    }
    if script.batch && scripted {
        let code = talk.shell.code();
        return Ok(talk.code(code));
    }
    match terminal {
        Some(terminal) => talk.terminal(terminal),
        None => talk.pipe(),
    }
}

/// Carries out the scripts before a face that is not a conversation; what they print goes to `out`. Gives an exit code where they
/// end the session. Like the conversation it goes on behind a command that fails, which `out` tells.
#[cfg(feature = "tui")]
pub fn prepare(shell: &mut Shell, script: &Script<'_>, out: &mut String) -> Result<Option<u8>, Failure> {
    let mut carry_out = |line: &str| {
        let flow = shell.execute(line, out);
        if let Flow::Failed(why) = &flow {
            out.push_str(&format!("error: {why}\n"));
        }
        flow
    };
    for file in script.files {
        let text = crate::input::bytes(file)?;
        for line in String::from_utf8_lossy(&text).lines() {
            match carry_out(line) {
                Flow::Quit(code) => return Ok(Some(code)),
                Flow::Failed(_) => break,
                Flow::Next | Flow::More => {}
            }
        }
    }
    for command in script.commands {
        if let Flow::Quit(code) = carry_out(command) {
            return Ok(Some(code));
        }
    }
    Ok(None)
}

impl Talk<'_> {
    /// The exit code, where the shell says `code`.
    fn code(&self, code: u8) -> u8 {
        if self.failed && code == exit::OK { exit::FAILED } else { code }
    }

    /// Carries out a line that is not typed at a prompt.
    fn line(&mut self, line: &str, echo: bool) -> Result<Flow, Failure> {
        if self.signals.leave.load(Ordering::Relaxed) {
            return Ok(Flow::Quit(exit::FAILED));
        }
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
            self.failed = true;
            let text = format!("error: {why}\n");
            if self.batch { output::tell(&text) } else { output::print(text)? }
        }
        Ok(flow)
    }

    /// Lines from a pipe or a file.
    fn pipe(&mut self) -> Result<u8, Failure> {
        let mut lines = io::stdin().lock().lines();
        while let Some(Ok(line)) = lines.next() {
            match self.line(&line, true)? {
                Flow::Quit(code) => return Ok(self.code(code)),
                Flow::Failed(_) if self.batch => return Ok(exit::FAILED),
                _ => {}
            }
        }
        let code = self.shell.code();
        Ok(self.code(code))
    }

    /// Lines from a user. What fails is no failure of the session.
    fn terminal(&mut self, mut terminal: Terminal) -> Result<u8, Failure> {
        let mut out = String::new();
        self.shell.here(&mut out);
        output::print(out)?;
        while !self.signals.leave.load(Ordering::Relaxed) {
            self.signals.prompt.store(true, Ordering::Relaxed);
            let line = terminal.line(self.shell);
            self.signals.prompt.store(false, Ordering::Relaxed);
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
