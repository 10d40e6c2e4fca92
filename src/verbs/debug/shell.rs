//! Executes commands without a terminal: a line in, text out. The prompt, scripts, blocks of `commands`,
//! tests and the other front ends use it.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use emu_debug::TimedDrive;
use emu_debug::debug::{DebugExpression, DebugSession, FileLine, SessionStopReason};
use ladder_view::LadderView;

use super::blocks::{BlockKind, OpenBlock, UserCommand};
use super::command_error::CommandError;
use super::commands::{self, CommandLine, RepeatKind};
use super::displays::DisplayedExpression;
use super::open::OpenedSession;
use crate::shared::fail::exit;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::sources::SourceFiles;

/// Maximum number of queued commands in a row without a run of the machine; more are taken for an endless
/// loop.
const MAX_QUEUED_COMMANDS: usize = 10_000;

/// What follows after a line was executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ShellFlow {
    /// The next line.
    Next,
    /// The next line, but this one has failed; the reason is a sentence.
    Failed(String),
    /// Queued commands are to be executed now: [`DebugShell::run_next_command`] executes the next one.
    PointCommands,
    /// The session ends with an exit code.
    Quit(u8),
}

/// Result of a command; a failure is a sentence.
pub(super) type CommandResult = Result<(), CommandError>;

/// A session with the settings of its user.
pub struct DebugShell {
    /// The machine under the debugger.
    pub session: DebugSession,
    /// The ladder program, if there is one.
    pub(super) view: Option<LadderView>,
    /// The program file.
    pub(super) file: String,
    /// The snapshot file and cycle with which the history begins, if one was loaded.
    pub(super) loaded: Option<(String, u64)>,
    /// Drives that were queued before the session began.
    pub(super) queued_drives: Vec<TimedDrive>,
    /// Draw rungs in colours.
    pub(super) color: bool,
    /// The texts of the source files.
    pub(super) sources: SourceFiles,
    /// Writes snapshot files of the machine.
    pub(super) snapshot_writer: SnapshotWriter,
    /// Expressions that every stop shows.
    pub(super) displays: Vec<DisplayedExpression>,
    /// Number of the last display.
    pub(super) last_display: u32,
    /// Values of the core registers at the last stop, in the order of the chip.
    pub(super) registers: Vec<Option<u32>>,
    /// Cycle of the last stop: later bytes and resets are reported at the next stop.
    pub(super) reported_to: u64,
    /// Level of the selected call (`up` and `down`), 0 is the innermost.
    pub(super) level: usize,
    /// Number of inlined functions that begin at the current instruction and are not entered yet: their calls
    /// are not part of the stack.
    pub(super) not_entered: usize,
    /// Value of `not_entered` at the next stop, if the step knows it.
    pub(super) next_not_entered: Option<usize>,
    /// Function and frame address of the selected call at the last stop.
    pub(super) stopped_in: Option<(String, Option<u32>)>,
    /// File and line where the next `list` continues.
    pub(super) listed: Option<FileLine>,
    /// Where the next `x` continues.
    pub(super) examined: Option<super::examine::ExamineState>,
    /// Cycle of the last `disas`, and the word where the next one continues.
    pub(super) disassembly: Option<(u64, u32)>,
    /// Notes that were already printed.
    pub(super) notes_given: Vec<&'static str>,
    /// The program has stopped in a fault or at an illegal instruction.
    faulted: bool,
    /// Set to stop a running command at the next instruction.
    interrupt: Arc<AtomicBool>,
    /// Line that an empty line repeats.
    last_line: String,
    /// The current command is repeated by an empty line.
    pub(super) repeated: bool,
    /// Lines that `list` shows.
    pub(super) list_size: u32,
    /// The block whose lines are being read.
    pub(super) block: Option<OpenBlock>,
    /// User-defined commands.
    pub(super) user_commands: BTreeMap<String, UserCommand>,
    /// Lines that are executed before further lines are read.
    pub(super) queue: VecDeque<String>,
    /// The number of lines that were put into the queue while the machine stood still.
    pub(super) queued_count: usize,
    /// Cycle at which `queued_count` was last set to 0.
    queued_at: u64,
    /// The exit code, once `quit` was executed.
    pub(super) leave: Option<u8>,
    /// Nesting depth of scripts.
    pub(super) nesting: u32,
    /// The message of a failed script command already contains its location.
    pub(super) error_has_place: bool,
}

impl DebugShell {
    /// Creates a shell for a session; setting `interrupt` stops a running command.
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
            not_entered: 0,
            next_not_entered: None,
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

    /// Executes a line, and the commands that it queues.
    pub fn execute(&mut self, line: &str, out: &mut String) -> ShellFlow {
        let mut flow = self.execute_line(line, out);
        while flow == ShellFlow::PointCommands {
            flow = self.run_next_command(out);
        }
        flow
    }

    /// Clears the interrupt flag before the next command.
    pub fn forget_interrupt(&self) {
        self.interrupt.store(false, Ordering::SeqCst);
    }

    /// Returns true if the session was interrupted since the flag was cleared: nothing more is executed.
    pub fn is_interrupted(&self) -> bool {
        self.interrupt.load(Ordering::SeqCst)
    }

    /// Executes a line. Returns [`ShellFlow::PointCommands`] if queued commands are to be executed after it.
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
            commands::split_command(&line).and_then(|line| Some((commands::find_command(line.word).ok()?, line.args)))
        {
            self.last_line = match command.repeat {
                RepeatKind::No => String::new(),
                RepeatKind::Same => line.clone(),
                // The format is kept, the address is not.
                RepeatKind::Continue => {
                    let format =
                        args.split_whitespace().next().filter(|word| word.starts_with('/')).unwrap_or_default();
                    format!("{} {format}", command.name)
                }
            };
        }
        flow
    }

    /// Executes the next queued command.
    pub fn run_next_command(&mut self, out: &mut String) -> ShellFlow {
        let Some(line) = self.queue.pop_front() else { return ShellFlow::Next };
        // A command that moves the machine resets the count, so a breakpoint that only prints can do so any
        // number of times.
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
                "{MAX_QUEUED_COMMANDS} commands in a row without a run of the machine: they seem to call each other endlessly"
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

    /// Returns what follows a command; after a failure the queue is cleared.
    fn flow_of(&mut self, done: CommandResult) -> ShellFlow {
        match done {
            Ok(()) => self.flow_after(),
            Err(why) => {
                self.queue.clear();
                ShellFlow::Failed(why.to_string())
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
        let Some(CommandLine { word, args }) = commands::split_command(line) else { return self.flow_after() };
        if self.queue_user_command(word, args) || self.open_foreign_block(word, args) {
            return self.flow_after();
        }
        let done = commands::find_command(word).and_then(|command| (command.run)(self, args, out));
        self.flow_of(done)
    }

    /// Returns the prompt: lines of a block have another one.
    pub fn prompt(&self) -> &'static str {
        if self.block.is_some() { ">" } else { "(emu) " }
    }

    /// Returns the exit code of a session that ends here and in which no command has failed.
    pub fn exit_code(&self) -> u8 {
        if self.faulted { exit::FAULT } else { exit::OK }
    }

    /// Opens the block of the commands of a point.
    pub(super) fn begin_commands(&mut self, id: u32) {
        self.open_block(BlockKind::Point(id));
    }

    /// Runs the machine, and reports the stop.
    pub(super) fn run_and_report(
        &mut self,
        out: &mut String,
        run: impl FnOnce(&mut DebugSession, &mut dyn FnMut() -> bool) -> SessionStopReason,
    ) -> SessionStopReason {
        self.run_and_report_inlined(out, |session, keep_running| (run(session, keep_running), None))
    }

    /// Runs the machine like [`Self::run_and_report`]. `run` also returns how many inlined functions begin at
    /// the stop and are not entered, if it knows that.
    pub(super) fn run_and_report_inlined(
        &mut self,
        out: &mut String,
        run: impl FnOnce(&mut DebugSession, &mut dyn FnMut() -> bool) -> (SessionStopReason, Option<usize>),
    ) -> SessionStopReason {
        let points = self.session.points.clone();
        let interrupt = Arc::clone(&self.interrupt);
        let (halt, not_entered) = run(&mut self.session, &mut || !interrupt.load(Ordering::SeqCst));
        self.next_not_entered = not_entered;
        self.report_stop(&halt, &points, out);
        halt
    }

    /// Sets whether the program has stopped in a fault or at an illegal instruction.
    pub(super) fn set_faulted(&mut self, faulted: bool) {
        self.faulted = faulted;
    }

    /// Returns a function that a run calls now and then, and that returns false after an interrupt.
    pub(super) fn keep_running(&self) -> impl FnMut() -> bool + use<> {
        let interrupt = Arc::clone(&self.interrupt);
        move || !interrupt.load(Ordering::SeqCst)
    }

    /// Prints a note once in a session.
    pub(super) fn note_once(&mut self, text: &'static str, out: &mut String) {
        if !self.notes_given.contains(&text) {
            self.notes_given.push(text);
            out.push_str(text);
            out.push('\n');
        }
    }

    /// Parses an expression in the selected call.
    pub(super) fn parse_expression(&self, text: &str) -> Result<DebugExpression, CommandError> {
        Ok(self.session.scope.parse_expression_in_frame(text, self.session.machine(), self.level)?)
    }

    /// Parses a count: an expression, 1 if the text is empty.
    pub(super) fn parse_count(&self, text: &str) -> Result<u64, CommandError> {
        if text.trim().is_empty() {
            return Ok(1);
        }
        let value = self.integer_value(text)?;
        u64::try_from(value).ok().filter(|count| *count > 0).ok_or_else(|| format!("`{text}` is not a count").into())
    }
}
