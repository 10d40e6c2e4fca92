//! The executor of commands, without a terminal: a line in, text out. The prompt, scripts, blocks of `commands`, tests and other
//! faces use it alike.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use emu_debug::Drive;
use emu_debug::debug::{Expr, Halt, Session};
use ladder_view::View;

use super::commands::{self, Repeat};
use super::data::Display;
use super::open::Opened;
use crate::fail::exit;
use crate::snapshots::Shelf;
use crate::sources::Sources;

/// Commands in a row that blocks of `commands` may call up, the machine standing still, before one is taken for endless.
const QUEUE: usize = 10_000;

/// What comes after a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Flow {
    /// The next line.
    Next,
    /// The next line, but this one has failed: why, in a sentence.
    Failed(String),
    /// Points have commands of their own that are to be carried out now: [`Shell::proceed`] does the next one.
    More,
    /// The end, with an exit code.
    Quit(u8),
}

/// How a command ends: with a sentence where it has failed.
pub(super) type Done = Result<(), String>;

/// A session and what its user has set up.
pub struct Shell {
    /// The machine under the debugger.
    pub session: Session,
    /// The ladder program, where it is one.
    pub(super) view: Option<View>,
    /// The file of the program.
    pub(super) file: String,
    /// The file that its history begins with, where it was loaded.
    pub(super) loaded: Option<(String, u64)>,
    /// What was queued from outside when the session was opened.
    pub(super) queued_drives: Vec<Drive>,
    /// Rungs are drawn in colours.
    pub(super) color: bool,
    pub(super) sources: Sources,
    pub(super) shelf: Shelf,
    /// Expressions that every stop shows.
    pub(super) displays: Vec<Display>,
    /// Number of the last of them.
    pub(super) displayed: u32,
    /// Values of the core's registers at the last stop, in their order.
    pub(super) registers: Vec<Option<u32>>,
    /// The cycle of the last stop: what was sent since is told at the next.
    pub(super) told: u64,
    /// The call that is looked at, 0 the innermost: `up` and `down`.
    pub(super) level: usize,
    /// Where `list` goes on, and where it began.
    pub(super) listed: Option<(String, u32)>,
    /// Where `x` goes on.
    pub(super) examined: Option<super::data::Examined>,
    /// Where `disas` goes on, and the cycle for which that holds.
    pub(super) disassembly: Option<(u64, u32)>,
    /// Notes that were told once.
    pub(super) noted: Vec<&'static str>,
    /// The program has stopped in a fault, or where no instruction is.
    faulted: bool,
    /// Asks a running command to stop at the next instruction.
    interrupt: Arc<AtomicBool>,
    /// The line that an empty one repeats.
    last: String,
    /// The point whose commands are being typed.
    block: Option<(u32, Vec<String>)>,
    pub(super) queue: VecDeque<String>,
    queued: usize,
    /// Where the machine stood when they were counted from 0.
    queued_at: u64,
    pub(super) leave: Option<u8>,
    /// How deep scripts are nested.
    pub(super) nesting: u32,
    /// What has failed in a script has its place already.
    pub(super) placed: bool,
}

impl Shell {
    /// For a session; what sets `interrupt` stops a running command.
    pub fn new(opened: Opened, interrupt: Arc<AtomicBool>, color: bool) -> Shell {
        let mut shell = Shell {
            session: opened.session,
            view: opened.view,
            file: opened.file,
            queued_drives: opened.drives,
            loaded: None,
            color,
            sources: opened.sources,
            shelf: opened.shelf,
            displays: Vec::new(),
            displayed: 0,
            registers: Vec::new(),
            told: 0,
            level: 0,
            listed: None,
            examined: None,
            disassembly: None,
            noted: Vec::new(),
            faulted: false,
            interrupt,
            last: String::new(),
            block: None,
            queue: VecDeque::new(),
            queued: 0,
            queued_at: 0,
            leave: None,
            nesting: 0,
            placed: false,
        };
        shell.registers = shell.core_registers();
        shell
    }

    /// Carries out a line and what points want done after it.
    pub fn execute(&mut self, line: &str, out: &mut String) -> Flow {
        let mut flow = self.begin(line, out);
        while flow == Flow::More {
            flow = self.proceed(out);
        }
        flow
    }

    /// Being interrupted up to now is about what was carried out up to now.
    pub fn forget_interrupt(&self) {
        self.interrupt.store(false, Ordering::SeqCst);
    }

    /// It was interrupted since that was forgotten last: nothing more is to be carried out.
    pub fn interrupted(&self) -> bool {
        self.interrupt.load(Ordering::SeqCst)
    }

    /// Carries out a line; [`Flow::More`] where a point has commands that are to be carried out after it.
    pub fn begin(&mut self, line: &str, out: &mut String) -> Flow {
        self.queue.clear();
        (self.queued, self.queued_at) = (0, self.session.target().cycle());
        if self.collects(line) {
            return Flow::Next;
        }
        let line = line.trim();
        let line = if line.is_empty() { std::mem::take(&mut self.last) } else { line.to_owned() };
        self.last.clear();
        let flow = self.carry_out(&line, out);
        if let Some((command, args)) =
            commands::split(&line).and_then(|(word, args)| Some((commands::find(word).ok()?, args)))
        {
            self.last = match command.repeat {
                Repeat::No => String::new(),
                Repeat::Same => line.clone(),
                // A format is kept, a place is not.
                Repeat::On => {
                    let format =
                        args.split_whitespace().next().filter(|word| word.starts_with('/')).unwrap_or_default();
                    format!("{} {format}", command.name)
                }
            };
        }
        flow
    }

    /// Takes a line that belongs to the commands of a point; among them may be commands of another point, with an `end` of their own.
    fn collects(&mut self, line: &str) -> bool {
        let Some((id, mut lines)) = self.block.take() else { return false };
        let begins = |line: &String| {
            commands::split(line)
                .is_some_and(|(word, _)| commands::find(word).is_ok_and(|found| found.name == "commands"))
        };
        let open = lines.iter().filter(|line| begins(line)).count();
        let closed = lines.iter().filter(|line| *line == "end").count();
        if line.trim() != "end" || open > closed {
            lines.push(line.trim().to_owned());
            self.block = Some((id, lines));
        } else if let Some(point) = self.session.points.get_mut(id) {
            point.commands = lines;
        }
        true
    }

    /// Carries out the next of the commands that points want done.
    pub fn proceed(&mut self, out: &mut String) -> Flow {
        let Some(line) = self.queue.pop_front() else { return Flow::Next };
        // What moves the machine has an end; a breakpoint that only tells may tell as often as it likes.
        let now = self.session.target().cycle();
        if now > self.queued_at {
            (self.queued, self.queued_at) = (0, now);
        }
        self.queued += 1;
        if self.interrupted() {
            self.queue.clear();
            return Flow::Failed("interrupted".to_owned());
        }
        if self.queued > QUEUE {
            self.queue.clear();
            return Flow::Failed(format!(
                "{QUEUE} commands of points in a row: they seem to call each other up without end"
            ));
        }
        if line == "silent" || self.collects(&line) { self.after() } else { self.carry_out(&line, out) }
    }

    fn after(&self) -> Flow {
        match self.leave {
            Some(code) => Flow::Quit(code),
            None if self.queue.is_empty() => Flow::Next,
            None => Flow::More,
        }
    }

    fn carry_out(&mut self, line: &str, out: &mut String) -> Flow {
        let Some((word, args)) = commands::split(line) else { return self.after() };
        let done = commands::find(word).and_then(|command| (command.run)(self, args, out));
        match done {
            Ok(()) => self.after(),
            Err(why) => {
                self.queue.clear();
                Flow::Failed(why)
            }
        }
    }

    /// The lines have come to their end.
    ///
    /// # Errors
    /// They end within the commands of a point, which it does not get then.
    pub fn ended(&mut self) -> Done {
        match self.block.take() {
            Some((id, _)) => Err(format!("the commands of point {id} lack their `end`")),
            None => Ok(()),
        }
    }

    /// What the prompt is to be: lines of a block of commands have another.
    pub fn prompt(&self) -> &'static str {
        if self.block.is_some() { ">" } else { "(emu) " }
    }

    /// The exit code of a session that ends here and in which no command has failed.
    pub fn code(&self) -> u8 {
        if self.faulted { exit::FAULT } else { exit::OK }
    }

    /// The lines that follow are the commands of a point, up to `end`.
    pub(super) fn collect(&mut self, id: u32) {
        self.block = Some((id, Vec::new()));
    }

    /// Lets the machine run, and tells how it stands then.
    pub(super) fn go(
        &mut self,
        out: &mut String,
        run: impl FnOnce(&mut Session, &mut dyn FnMut() -> bool) -> Halt,
    ) -> Halt {
        let points = self.session.points.clone();
        let interrupt = Arc::clone(&self.interrupt);
        let halt = run(&mut self.session, &mut || !interrupt.load(Ordering::SeqCst));
        self.stopped(&halt, &points, out);
        halt
    }

    /// Commands of points that have stopped the machine are carried out next.
    pub(super) fn enqueue(&mut self, lines: Vec<String>) {
        self.queue = lines.into();
    }

    /// Notes whether the program has done what cannot be carried out.
    pub(super) fn fault(&mut self, faulted: bool) {
        self.faulted = faulted;
    }

    /// Asked now and then whether to go on.
    pub(super) fn go_on(&self) -> impl FnMut() -> bool + use<> {
        let interrupt = Arc::clone(&self.interrupt);
        move || !interrupt.load(Ordering::SeqCst)
    }

    /// Tells something once in a session.
    pub(super) fn note(&mut self, text: &'static str, out: &mut String) {
        if !self.noted.contains(&text) {
            self.noted.push(text);
            out.push_str(text);
            out.push('\n');
        }
    }

    /// Reads an expression in the call that is looked at.
    pub(super) fn expr(&self, text: &str) -> Result<Expr, String> {
        self.session.scope.expr_in(text, self.session.target(), self.level)
    }

    /// A count behind a command: an expression, 1 where there is none.
    pub(super) fn count(&self, text: &str) -> Result<u64, String> {
        if text.trim().is_empty() {
            return Ok(1);
        }
        let value = self.value(text)?;
        u64::try_from(value).ok().filter(|count| *count > 0).ok_or_else(|| format!("`{text}` is no count"))
    }
}
