//! Steps and runs, forwards and back. A run is plain data, so that it can be interrupted by a request and
//! resumed afterwards.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use emu_core::cpu::LAST_CYCLE;
use emu_debug::debug::{
    CallFlow, DebugSession, InstructionFlow, LineOrigin, LinePosition, PointTrigger, RunGoal, SessionStopReason,
    StepVerdict, call_flow,
};

use crate::adapter::DebugAdapter;

/// Maximum duration of a slice of a run; then events are reported.
const RUN_SLICE: Duration = Duration::from_millis(20);

/// Machine cycles after which a jump to itself counts as the end of the program.
const SELF_JUMP_CYCLES: u64 = 16;

/// Called periodically; returns whether the run may continue.
type KeepRunning<'a> = &'a mut dyn FnMut() -> bool;

/// A requested run in its current state.
#[derive(Debug, Clone)]
pub(crate) enum PendingRun {
    /// Run until something stops the machine.
    Continue,
    /// Execute this many instructions.
    Steps(u64),
    /// Run until a call has returned.
    StepOver(StepOverCall),
    /// Step to another source line, or out of a function.
    StepLine(LineStep),
    /// Run to one of these program words, this many times.
    ToWords(BTreeSet<u32>, u64),
    /// Go to a cycle, forwards or back.
    Cycle(u64),
    /// Run back to the last hit of a breakpoint or watchpoint.
    ReverseContinue,
    /// Go back by this many instructions.
    BackSteps(u64),
    /// Run back to one of these program words, this many times.
    BackTo(BTreeSet<u32>, u64),
    /// Go back to the beginning of a source line.
    BackLine(BackLineStep),
}

/// A call or an interrupt that must return before the step ends.
#[derive(Debug, Clone)]
pub(crate) struct StepOverCall {
    /// Return address, as a program word.
    return_word: u32,
    /// Stack depth at the call; the depth after the return is at most this.
    depth: u32,
}

impl StepOverCall {
    /// The call at the program counter, if the instruction there is a call.
    pub fn here(session: &mut DebugSession) -> Option<StepOverCall> {
        let (pc, depth) = (session.machine().pc(), session.machine().stack_depth());
        let InstructionFlow { flow, words: len } = session.call_flow(pc);
        (flow == CallFlow::Call).then_some(StepOverCall { return_word: pc.wrapping_add(len), depth })
    }

    fn slice(&self, session: &mut DebugSession, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let goal = RunGoal { words: BTreeSet::from([self.return_word]), ..RunGoal::default() };
        loop {
            let halt = session.run(&goal, keep_running);
            if halt != SessionStopReason::Done || self.is_done(session) {
                return halt;
            }
        }
    }

    fn is_done(&self, session: &DebugSession) -> bool {
        session.machine().pc() == self.return_word && session.machine().stack_depth() <= self.depth
    }
}

/// The goal of a line step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LineStepKind {
    /// The next line, also in called functions that have source lines.
    Into,
    /// The next line of this function or of its caller.
    Next,
    /// The instruction after the return of this function.
    Out,
}

/// A step through one function; calls and interrupts are executed as a whole.
#[derive(Debug, Clone)]
pub(crate) struct LineStep {
    kind: LineStepKind,
    /// The source line at which the step started.
    line: Option<(Arc<str>, u32)>,
    start: u32,
    /// Program counter and stack depth before the next instruction.
    before_step: (u32, u32),
    /// The call or interrupt that is being executed.
    passing: Option<StepOverCall>,
    /// True if the machine is at a jump to itself, which only an interrupt can end.
    at_self_jump: bool,
    done: bool,
    /// What the step leaves, with its inlined functions.
    origin: LineOrigin,
    /// Stack depth of the frame of `origin`.
    depth: u32,
    /// Number of inlined functions that begin at the start and are not entered yet.
    not_entered: usize,
    /// Number of inlined functions that begin at the end and are not entered, if it is not the number of all
    /// that begin there.
    not_entered_at_end: Option<usize>,
}

impl LineStep {
    /// A step that starts at the current location, where `not_entered` inlined functions are not entered yet.
    pub fn new(kind: LineStepKind, session: &DebugSession, not_entered: usize) -> LineStep {
        let origin = LinePosition::of(session).origin(not_entered);
        let here = (session.machine().pc(), session.machine().stack_depth());
        let line = session.scope.source().line_at(here.0).map(|line| (Arc::clone(&line.file), line.line));
        LineStep {
            kind,
            line,
            start: here.0,
            before_step: here,
            passing: None,
            at_self_jump: false,
            done: false,
            origin,
            depth: here.1,
            not_entered,
            not_entered_at_end: None,
        }
    }

    fn slice(&mut self, session: &mut DebugSession, keep_running: KeepRunning<'_>) -> SessionStopReason {
        // The call of an inlined function has no instruction: the step enters it where the machine is.
        if self.kind == LineStepKind::Into && self.not_entered > 0 && !self.done {
            (self.not_entered_at_end, self.done) = (Some(self.not_entered - 1), true);
            return SessionStopReason::Done;
        }
        loop {
            if let Some(over) = &self.passing {
                let halt = over.slice(session, keep_running);
                let returned = halt == SessionStopReason::Done || over.is_done(session);
                if returned {
                    self.passing = None;
                    self.before_step = (session.machine().pc(), session.machine().stack_depth());
                    self.done = self.has_arrived(session);
                }
                if self.done || !returned || halt != SessionStopReason::Done {
                    return halt;
                }
            }
            let halt = session
                .step_until(LAST_CYCLE, true, keep_running, &mut |session, flow, irq| self.step(session, flow, irq));
            if self.done || halt != SessionStopReason::Done {
                return halt;
            }
            if std::mem::take(&mut self.at_self_jump) {
                let (before, until) = (self.before_step, session.machine().cycle().saturating_add(SELF_JUMP_CYCLES));
                let halt = session.run(&RunGoal { until: Some(until), ..RunGoal::default() }, keep_running);
                self.before_step = (session.machine().pc(), session.machine().stack_depth());
                // An interrupt may have started meanwhile.
                if self.before_step.1 > before.1 {
                    self.passing = Some(StepOverCall { return_word: before.0, depth: before.1 });
                }
                if halt != SessionStopReason::Limit {
                    return halt;
                }
            }
        }
    }

    /// Called after each instruction: returns true if the stepping must stop, for a call or interrupt to
    /// execute or at the goal.
    fn step(&mut self, session: &DebugSession, flow_of: CallFlow, irq: bool) -> bool {
        let target = session.machine();
        let before = std::mem::replace(&mut self.before_step, (target.pc(), target.stack_depth()));
        let pc = self.before_step.0;
        let ret = if irq {
            before.0
        } else if flow_of == CallFlow::Call {
            before.0.wrapping_add(call_flow(session.scope.chip(), |word| session.word(word), before.0).words)
        } else {
            self.done = flow_of == CallFlow::Return && self.kind == LineStepKind::Out || self.has_arrived(session);
            self.at_self_jump = pc == before.0 && !self.done;
            return self.done || self.at_self_jump;
        };
        // Compilers call the next instruction to allocate space on the stack.
        if pc == ret {
            self.done = self.has_arrived(session);
        } else if !irq && self.kind == LineStepKind::Into && session.scope.source().line_at(pc).is_some() {
            self.done = true;
        } else {
            self.passing = Some(StepOverCall { return_word: ret, depth: before.1 });
            return true;
        }
        self.done
    }

    /// True if the machine is at the first instruction of another line, or back at the start of the step.
    fn has_arrived(&mut self, session: &DebugSession) -> bool {
        let now = LinePosition::of(session);
        if !(now.inlined.is_empty() && self.origin.inlined.is_empty()) {
            return self.has_arrived_beside_inlined(session, &now);
        }
        let pc = session.machine().pc();
        let source = session.scope.source();
        let line = source.line_at(pc);
        let begins = |addr: u32| addr == pc.saturating_mul(session.scope.chip().word_bytes);
        let other = |file: &str, line: u32| self.line.as_ref().is_none_or(|here| (&*here.0, here.1) != (file, line));
        self.kind != LineStepKind::Out
            && line.is_some_and(|line| begins(line.addr) && (other(&line.file, line.line) || pc == self.start))
    }
}

impl LineStep {
    /// Returns whether the step has arrived, if it is in inlined functions or reaches some.
    fn has_arrived_beside_inlined(&mut self, session: &DebugSession, now: &LinePosition) -> bool {
        let depth = session.machine().stack_depth();
        if self.kind == LineStepKind::Out {
            // A step out of an inlined function ends after its code.
            let own = self.origin.inlined.last();
            return depth <= self.depth && own.is_some_and(|own| !now.inlined.contains(own));
        }
        if now.row.is_some() && now.row == self.origin.row && depth == self.depth {
            return session.machine().pc() == self.start;
        }
        match self.origin.verdict(now, self.kind == LineStepKind::Next, depth == self.depth) {
            StepVerdict::GoOn => false,
            StepVerdict::LeaveFrom(next) => {
                (self.origin, self.depth) = (next, depth);
                false
            }
            StepVerdict::Stop(not_entered) => {
                self.not_entered_at_end = Some(not_entered);
                true
            }
        }
    }

    /// Returns the number of inlined functions that begin where the step has ended and are not entered.
    pub fn not_entered(&self) -> Option<usize> {
        self.not_entered_at_end.filter(|_| self.done)
    }
}

/// A step back to the beginning of a line of this function or of a caller.
#[derive(Debug, Clone)]
pub(crate) struct BackLineStep {
    line: Option<(Arc<str>, u32)>,
    /// True if the step began in the middle of its line; then the beginning of the same line is a goal, too.
    began_mid_line: bool,
    depth: u32,
    /// Byte range of this function in program memory.
    function: std::ops::Range<u32>,
}

impl BackLineStep {
    /// A step back that starts at the current location.
    pub fn new(session: &DebugSession) -> BackLineStep {
        let (target, source) = (session.machine(), session.scope.source());
        let chip = session.scope.chip();
        let byte = target.pc().saturating_mul(chip.word_bytes);
        let line = source.line_at(target.pc());
        let covers = |symbol: &&emu_core::image::SymbolAt| {
            symbol.space == chip.code_space && (symbol.addr..symbol.addr.saturating_add(symbol.size)).contains(&byte)
        };
        let function = session.scope.symbols.iter().find(covers);
        BackLineStep {
            began_mid_line: line.is_some_and(|line| line.addr != byte),
            line: line.map(|line| (Arc::clone(&line.file), line.line)),
            depth: target.stack_depth(),
            function: function.map_or(0..0, |symbol| symbol.addr..symbol.addr.saturating_add(symbol.size)),
        }
    }

    fn slice(&self, session: &mut DebugSession, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let scope = session.scope.clone();
        let source = scope.source();
        session.run_back_until(keep_running, &mut || true, &mut |passed| {
            let (pc, depth) = (passed.machine.pc(), passed.machine.stack_depth());
            let byte = pc.saturating_mul(scope.chip().word_bytes);
            let here = self.line.as_ref().map(|line| (&*line.0, line.1));
            source.line_at(pc).is_some_and(|line| {
                !passed.first
                    && line.addr == byte
                    && (self.began_mid_line || here != Some((&*line.file, line.line)))
                    && (depth <= self.depth || self.function.contains(&byte))
            })
        })
    }
}

impl PendingRun {
    /// Continues the run as long as `keep_running` returns true.
    fn slice(&mut self, session: &mut DebugSession, keep_running: KeepRunning<'_>) -> SessionStopReason {
        match self {
            PendingRun::Continue => session.run(&RunGoal::default(), keep_running),
            PendingRun::Steps(left) => session.step_remaining(left, LAST_CYCLE, true, keep_running),
            PendingRun::StepOver(over) => over.slice(session, keep_running),
            PendingRun::StepLine(step) => step.slice(session, keep_running),
            PendingRun::ToWords(words, left) => {
                let goal = RunGoal { words: words.clone(), ..RunGoal::default() };
                loop {
                    let halt = session.run(&goal, keep_running);
                    if halt != SessionStopReason::Done {
                        return halt;
                    }
                    *left = left.saturating_sub(1);
                    if *left == 0 {
                        return halt;
                    }
                }
            }
            PendingRun::Cycle(cycle) => session.goto_cycle(*cycle, keep_running),
            PendingRun::ReverseContinue => session.run_back(keep_running),
            PendingRun::BackSteps(n) => session.step_back(*n, &mut || true),
            PendingRun::BackLine(line) => line.slice(session, keep_running),
            PendingRun::BackTo(words, left) => {
                let own = session.points.add(PointTrigger::Code(words.iter().copied().collect()), "", false);
                let halt = loop {
                    let halt = session.run_back(keep_running);
                    let SessionStopReason::Points(mut hits) = halt else { break halt };
                    let wanted = hits.iter().any(|hit| hit.id == own);
                    hits.retain(|hit| hit.id != own);
                    *left = left.saturating_sub(u64::from(wanted));
                    if !hits.is_empty() {
                        break SessionStopReason::Points(hits);
                    }
                    if *left == 0 {
                        break SessionStopReason::Done;
                    }
                };
                session.points.remove(own);
                halt
            }
        }
    }

    /// True if the run has reached its goal at a point that did not stop it.
    fn has_arrived(&mut self, session: &DebugSession) -> bool {
        match self {
            PendingRun::Steps(left) => *left == 0,
            PendingRun::StepOver(over) => over.is_done(session),
            PendingRun::StepLine(step) => step.done,
            PendingRun::ToWords(words, left) => {
                *left = left.saturating_sub(u64::from(words.contains(&session.machine().pc())));
                *left == 0
            }
            _ => false,
        }
    }

    fn is_backwards(&self) -> bool {
        matches!(
            self,
            PendingRun::ReverseContinue
                | PendingRun::BackSteps(_)
                | PendingRun::BackTo(..)
                | PendingRun::BackLine(_)
                | PendingRun::Cycle(_)
        )
    }
}

impl DebugAdapter<'_> {
    /// Executes a slice of the requested run.
    pub(crate) fn advance_run(&mut self, keep_running: KeepRunning<'_>) {
        let (Some(mut run), Some(machine)) = (self.run.take(), self.machine.as_mut()) else { return };
        let (back, end) = (run.is_backwards(), Instant::now() + RUN_SLICE);
        let log_points = if back { self.points.disable_log_points(&mut machine.session) } else { Vec::new() };
        // An interrupted search backwards starts again, so it is only interrupted by a request.
        let halt = run.slice(&mut machine.session, &mut || (back || Instant::now() < end) && keep_running());
        self.points.enable_log_points(&mut machine.session, &log_points);
        machine.listing = None;
        machine.expandable_objects.borrow_mut().clear();
        self.report_events();
        match halt {
            SessionStopReason::Interrupted => self.run = Some(run),
            SessionStopReason::Points(hits) if !back => {
                let hits = self.filter_hits(hits);
                let Some(machine) = &self.machine else { return };
                if !hits.is_empty() {
                    self.report_stop(self.stop_of(&SessionStopReason::Points(hits)));
                } else if run.has_arrived(&machine.session) {
                    self.report_stop(self.stop_of(&SessionStopReason::Done));
                } else {
                    self.run = Some(run);
                }
            }
            why => {
                let not_entered = match (&run, &why) {
                    (PendingRun::StepLine(step), SessionStopReason::Done) => step.not_entered(),
                    _ => None,
                };
                self.report_stop(self.stop_of(&why));
                if let (Some(not_entered), Some(machine)) = (not_entered, &mut self.machine) {
                    machine.not_entered = not_entered;
                }
            }
        }
    }
}
