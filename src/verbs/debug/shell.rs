//! The executor of commands, without a terminal: a line in, text out. The prompt, scripts, blocks of `commands`, tests and other
//! faces use it alike.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use emu_debug::TimedDrive;
use emu_debug::debug::{DebugExpression, DebugSession, HaltResult};
use ladder_view::LadderView;

use super::blocks::{BlockKind, OpenBlock, UserCommand};
use super::commands::{self, RepeatKind};
use super::displays::DisplayedExpression;
use super::open::OpenedSession;
use crate::shared::fail::exit;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::sources::SourceFiles;

/// Commands in a row that blocks of `commands` may call up, the machine standing still, before one is taken for endless.
const MAX_QUEUED_COMMANDS: usize = 10_000;

/// What comes after a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ShellFlow {
    /// The next line.
    Next,
    /// The next line, but this one has failed: why, in a sentence.
    Failed(String),
    /// Points have commands of their own that are to be carried out now: [`Shell::run_next_command`] does the next one.
    PointCommands,
    /// The end, with an exit code.
    Quit(u8),
}

/// How a command ends: with a sentence where it has failed.
pub(super) type CommandResult = Result<(), String>;

/// A session and what its user has set up.
pub struct DebugShell {
    /// The machine under the debugger.
    pub session: DebugSession,
    /// The ladder program, where it is one.
    pub(super) view: Option<LadderView>,
    /// The file of the program.
    pub(super) file: String,
    /// The file that its history begins with, where it was loaded.
    pub(super) loaded: Option<(String, u64)>,
    /// What was queued from outside when the session was opened.
    pub(super) queued_drives: Vec<TimedDrive>,
    /// Rungs are drawn in colours.
    pub(super) color: bool,
    pub(super) sources: SourceFiles,
    pub(super) snapshot_writer: SnapshotWriter,
    /// Expressions that every stop shows.
    pub(super) displays: Vec<DisplayedExpression>,
    /// Number of the last of them.
    pub(super) last_display: u32,
    /// Values of the core's registers at the last stop, in their order.
    pub(super) registers: Vec<Option<u32>>,
    /// The cycle of the last stop: what was sent since is told at the next.
    pub(super) reported_to: u64,
    /// The call that is looked at, 0 the innermost: `up` and `down`.
    pub(super) level: usize,
    /// Functions put in place of their calls that begin here and are not entered yet: their calls are no part of the stack.
    pub(super) hidden: usize,
    /// That of the stop to come, where the step knows it.
    pub(super) next_hidden: Option<usize>,
    /// The call that was looked at at the last stop.
    pub(super) stopped_in: Option<(String, Option<u32>)>,
    /// Where `list` goes on, and where it began.
    pub(super) listed: Option<(String, u32)>,
    /// Where `x` goes on.
    pub(super) examined: Option<super::examine::ExamineState>,
    /// Where `disas` goes on, and the cycle for which that holds.
    pub(super) disassembly: Option<(u64, u32)>,
    /// Notes that were told once.
    pub(super) notes_given: Vec<&'static str>,
    /// The program has stopped in a fault, or where no instruction is.
    faulted: bool,
    /// Asks a running command to stop at the next instruction.
    interrupt: Arc<AtomicBool>,
    /// The line that an empty one repeats.
    last_line: String,
    /// The empty line has repeated the command that is being carried out.
    pub(super) repeated: bool,
    /// Lines that `list` shows.
    pub(super) list_size: u32,
    /// The block whose lines are being typed.
    pub(super) block: Option<OpenBlock>,
    /// Commands that the user has defined.
    pub(super) user_commands: BTreeMap<String, UserCommand>,
    pub(super) queue: VecDeque<String>,
    pub(super) queued_count: usize,
    /// Where the machine stood when they were counted from 0.
    queued_at: u64,
    pub(super) leave: Option<u8>,
    /// How deep scripts are nested.
    pub(super) nesting: u32,
    /// What has failed in a script has its place already.
    pub(super) error_has_place: bool,
}

impl DebugShell {
    /// For a session; what sets `interrupt` stops a running command.
    pub fn new(opened: OpenedSession, interrupt: Arc<AtomicBool>, color: bool) -> DebugShell {
        let mut shell = DebugShell {
            session: opened.session,
            view: opened.view,
            file: opened.file,
            queued_drives: opened.drives,
            loaded: None,
            color,
            sources: opened.sources,
            snapshot_writer: opened.snapshot_writer,
            displays: Vec::new(),
            last_display: 0,
            registers: Vec::new(),
            reported_to: 0,
            level: 0,
            hidden: 0,
            next_hidden: None,
            stopped_in: None,
            listed: None,
            examined: None,
            disassembly: None,
            notes_given: Vec::new(),
            faulted: false,
            interrupt,
            last_line: String::new(),
            repeated: false,
            list_size: super::code::LINES_SHOWN,
            block: None,
            user_commands: BTreeMap::new(),
            queue: VecDeque::new(),
            queued_count: 0,
            queued_at: 0,
            leave: None,
            nesting: 0,
            error_has_place: false,
        };
        shell.registers = shell.core_registers();
        shell
    }

    /// Carries out a line and what points want done after it.
    pub fn execute(&mut self, line: &str, out: &mut String) -> ShellFlow {
        let mut flow = self.execute_line(line, out);
        while flow == ShellFlow::PointCommands {
            flow = self.run_next_command(out);
        }
        flow
    }

    /// Being interrupted up to now is about what was carried out up to now.
    pub fn forget_interrupt(&self) {
        self.interrupt.store(false, Ordering::SeqCst);
    }

    /// It was interrupted since that was forgotten last: nothing more is to be carried out.
    pub fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::SeqCst)
    }

    /// Carries out a line; [`ShellFlow::PointCommands`] where a point has commands that are to be carried out after it.
    pub fn execute_line(&mut self, line: &str, out: &mut String) -> ShellFlow {
        self.queue.clear();
        (self.queued_count, self.queued_at) = (0, self.session.machine().cycle());
        if let Some(done) = self.collect_line(line) {
            self.last_line.clear();
            return self.flow_of(done);
        }
        let line = line.trim();
        self.repeated = line.is_empty();
        let line = if line.is_empty() { std::mem::take(&mut self.last_line) } else { line.to_owned() };
        self.last_line.clear();
        let flow = self.dispatch(&line, out);
        if let Some((command, args)) =
            commands::split_command(&line).and_then(|(word, args)| Some((commands::find_command(word).ok()?, args)))
        {
            self.last_line = match command.repeat {
                RepeatKind::No => String::new(),
                RepeatKind::Same => line.clone(),
                // A format is kept, a place is not.
                RepeatKind::Continue => {
                    let format =
                        args.split_whitespace().next().filter(|word| word.starts_with('/')).unwrap_or_default();
                    format!("{} {format}", command.name)
                }
            };
        }
        flow
    }

    /// Carries out the next of the commands that points want done.
    pub fn run_next_command(&mut self, out: &mut String) -> ShellFlow {
        let Some(line) = self.queue.pop_front() else { return ShellFlow::Next };
        // What moves the machine has an end; a breakpoint that only tells may tell as often as it likes.
        let now = self.session.machine().cycle();
        if now > self.queued_at {
            (self.queued_count, self.queued_at) = (0, now);
        }
        self.queued_count += 1;
        if self.is_interrupted() {
            self.queue.clear();
            return ShellFlow::Failed("interrupted".to_owned());
        }
        if self.queued_count > MAX_QUEUED_COMMANDS {
            self.queue.clear();
            return ShellFlow::Failed(format!(
                "{MAX_QUEUED_COMMANDS} commands of points in a row: they seem to call each other up without end"
            ));
        }
        if Self::is_mark(&line) {
            return self.flow_after();
        }
        match self.collect_line(&line) {
            Some(done) => self.flow_of(done),
            None => self.dispatch(&line, out),
        }
    }

    /// What comes after a command: where it has failed, what was queued is left out.
    fn flow_of(&mut self, done: CommandResult) -> ShellFlow {
        match done {
            Ok(()) => self.flow_after(),
            Err(why) => {
                self.queue.clear();
                ShellFlow::Failed(why)
            }
        }
    }

    fn flow_after(&self) -> ShellFlow {
        match self.leave {
            Some(code) => ShellFlow::Quit(code),
            None if self.queue.is_empty() => ShellFlow::Next,
            None => ShellFlow::PointCommands,
        }
    }

    fn dispatch(&mut self, line: &str, out: &mut String) -> ShellFlow {
        let Some((word, args)) = commands::split_command(line) else { return self.flow_after() };
        if self.queue_user_command(word, args) || self.open_foreign_block(word, args) {
            return self.flow_after();
        }
        let done = commands::find_command(word).and_then(|command| (command.run)(self, args, out));
        self.flow_of(done)
    }

    /// What the prompt is to be: lines of a block of commands have another.
    pub fn prompt(&self) -> &'static str {
        if self.block.is_some() { ">" } else { "(emu) " }
    }

    /// The exit code of a session that ends here and in which no command has failed.
    pub fn exit_code(&self) -> u8 {
        if self.faulted { exit::FAULT } else { exit::OK }
    }

    /// The lines that follow are the commands of a point, up to `end`.
    pub(super) fn begin_commands(&mut self, id: u32) {
        self.open_block(BlockKind::Point(id));
    }

    /// Lets the machine run, and tells how it stands then.
    pub(super) fn run_and_report(
        &mut self,
        out: &mut String,
        run: impl FnOnce(&mut DebugSession, &mut dyn FnMut() -> bool) -> HaltResult,
    ) -> HaltResult {
        self.go_hidden(out, |session, keep_running| (run(session, keep_running), None))
    }

    /// The same for a step that knows before which calls of functions put in their place it ends.
    pub(super) fn go_hidden(
        &mut self,
        out: &mut String,
        run: impl FnOnce(&mut DebugSession, &mut dyn FnMut() -> bool) -> (HaltResult, Option<usize>),
    ) -> HaltResult {
        let points = self.session.points.clone();
        let interrupt = Arc::clone(&self.interrupt);
        let (halt, hidden) = run(&mut self.session, &mut || !interrupt.load(Ordering::SeqCst));
        self.next_hidden = hidden;
        self.report_stop(&halt, &points, out);
        halt
    }

    /// Notes whether the program has done what cannot be carried out.
    pub(super) fn set_faulted(&mut self, faulted: bool) {
        self.faulted = faulted;
    }

    /// Asked now and then whether to go on.
    pub(super) fn keep_running(&self) -> impl FnMut() -> bool + use<> {
        let interrupt = Arc::clone(&self.interrupt);
        move || !interrupt.load(Ordering::SeqCst)
    }

    /// Tells something once in a session.
    pub(super) fn note_once(&mut self, text: &'static str, out: &mut String) {
        if !self.notes_given.contains(&text) {
            self.notes_given.push(text);
            out.push_str(text);
            out.push('\n');
        }
    }

    /// Reads an expression in the call that is looked at.
    pub(super) fn parse_expression(&self, text: &str) -> Result<DebugExpression, String> {
        Ok(self.session.scope.parse_expression_in_frame(text, self.session.machine(), self.level)?)
    }

    /// A count behind a command: an expression, 1 where there is none.
    pub(super) fn parse_count(&self, text: &str) -> Result<u64, String> {
        if text.trim().is_empty() {
            return Ok(1);
        }
        let value = self.integer_value(text)?;
        u64::try_from(value).ok().filter(|count| *count > 0).ok_or_else(|| format!("`{text}` is no count"))
    }
}
