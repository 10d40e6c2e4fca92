//! Steps and runs, forwards and back. A run is plain data, so that it can be interrupted for a request and go on behind it.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use emu_core::cpu::LAST_CYCLE;
use emu_debug::debug::{CallFlow, DebugSession, HaltReason, HaltResult, PointTrigger, RunGoal, call_flow};

use crate::adapter::DebugAdapter;

/// How long a run goes on before what it has sent is told.
const RUN_SLICE: Duration = Duration::from_millis(20);

/// Machine cycles in which it shows whether a jump to itself is the end.
const SELF_JUMP_CYCLES: u64 = 16;

/// Asked now and then whether to go on.
type KeepRunning<'a> = &'a mut dyn FnMut() -> bool;

/// A run that was asked for, and what is left of it.
#[derive(Debug, Clone)]
pub(crate) enum PendingRun {
    /// Until something stops it.
    Continue,
    /// Some instructions.
    Steps(u64),
    /// Until a call has returned.
    StepOver(StepOverCall),
    /// To another source line, or out of a function.
    StepLine(LineStep),
    /// To one of these program words, some times.
    ToWords(BTreeSet<u32>, u64),
    /// To a cycle, forwards or back.
    Cycle(u64),
    /// Back to the last point.
    ReverseContinue,
    /// Some instructions back.
    BackSteps(u64),
    /// Back to one of these program words, some times.
    BackTo(BTreeSet<u32>, u64),
    /// Back to the beginning of a source line.
    BackLine(BackLineStep),
}

/// A call, or an interrupt, that is to return.
#[derive(Debug, Clone)]
pub(crate) struct StepOverCall {
    /// To this program word.
    return_word: u32,
    /// With the stack as deep as this, or less.
    depth: u32,
}

impl StepOverCall {
    /// The call that stands at the program counter, if one does.
    pub fn here(session: &mut DebugSession) -> Option<StepOverCall> {
        let (pc, depth) = (session.machine().pc(), session.machine().stack_depth());
        let (flow, len) = session.call_flow(pc);
        (flow == CallFlow::Call).then_some(StepOverCall { return_word: pc.wrapping_add(len), depth })
    }

    fn slice(&self, session: &mut DebugSession, go_on: KeepRunning<'_>) -> HaltResult {
        let goal = RunGoal { words: BTreeSet::from([self.return_word]), ..RunGoal::default() };
        loop {
            let halt = session.run(&goal, go_on);
            if halt.reason != HaltReason::Done || self.is_done(session) {
                return halt;
            }
        }
    }

    fn is_done(&self, session: &DebugSession) -> bool {
        session.machine().pc() == self.return_word && session.machine().stack_depth() <= self.depth
    }
}

/// Where a walk through a function goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LineStepKind {
    /// To the next line, also into functions that have lines.
    Into,
    /// To the next line of this function or of its caller.
    Next,
    /// Behind the return of this function.
    Out,
}

/// Steps through one function; what it calls, and interrupts, are passed as a whole.
#[derive(Debug, Clone)]
pub(crate) struct LineStep {
    kind: LineStepKind,
    /// The line and the program word at which it began.
    line: Option<(Arc<str>, u32)>,
    start: u32,
    /// Program counter and depth before the step that comes.
    before_step: (u32, u32),
    /// What is being passed.
    passing: Option<StepOverCall>,
    /// It stands at a jump to itself, which only an interrupt ends.
    at_self_jump: bool,
    done: bool,
}

impl LineStep {
    pub fn new(kind: LineStepKind, session: &DebugSession) -> LineStep {
        let here = (session.machine().pc(), session.machine().stack_depth());
        let line = session.scope.source().line_at(here.0).map(|line| (Arc::clone(&line.file), line.line));
        LineStep { kind, line, start: here.0, before_step: here, passing: None, at_self_jump: false, done: false }
    }

    fn slice(&mut self, session: &mut DebugSession, go_on: KeepRunning<'_>) -> HaltResult {
        loop {
            if let Some(over) = &self.passing {
                let halt = over.slice(session, go_on);
                let returned = halt.reason == HaltReason::Done || over.is_done(session);
                if returned {
                    self.passing = None;
                    self.before_step = (session.machine().pc(), session.machine().stack_depth());
                    self.done = self.has_arrived(session);
                }
                if self.done || !returned || halt.reason != HaltReason::Done {
                    return halt;
                }
            }
            let halt =
                session.step_until(LAST_CYCLE, true, go_on, &mut |session, flow, irq| self.step(session, flow, irq));
            if self.done || halt.reason != HaltReason::Done {
                return halt;
            }
            if std::mem::take(&mut self.at_self_jump) {
                let (before, until) = (self.before_step, session.machine().cycle().saturating_add(SELF_JUMP_CYCLES));
                let halt = session.run(&RunGoal { until: Some(until), ..RunGoal::default() }, go_on);
                self.before_step = (session.machine().pc(), session.machine().stack_depth());
                // An interrupt may have come meanwhile.
                if self.before_step.1 > before.1 {
                    self.passing = Some(StepOverCall { return_word: before.0, depth: before.1 });
                }
                if halt.reason != HaltReason::Limit {
                    return halt;
                }
            }
        }
    }

    /// A step was made: true ends the stroll, with something to pass or because it is done.
    fn step(&mut self, session: &DebugSession, flow_of: CallFlow, irq: bool) -> bool {
        let target = session.machine();
        let before = std::mem::replace(&mut self.before_step, (target.pc(), target.stack_depth()));
        let pc = self.before_step.0;
        let ret = if irq {
            before.0
        } else if flow_of == CallFlow::Call {
            before.0.wrapping_add(call_flow(session.scope.chip(), |word| session.word(word), before.0).1)
        } else {
            self.done = if flow_of == CallFlow::Return && self.kind == LineStepKind::Out {
                true
            } else {
                self.has_arrived(session)
            };
            self.at_self_jump = pc == before.0 && !self.done;
            return self.done || self.at_self_jump;
        };
        // Compilers call the next instruction to make room on the stack.
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

    /// It stands where the code of another line begins, or has come round to where it was.
    fn has_arrived(&self, session: &DebugSession) -> bool {
        let pc = session.machine().pc();
        let source = session.scope.source();
        let line = source.line_at(pc);
        let begins = |addr: u32| addr == pc.saturating_mul(session.scope.chip().word_bytes);
        let other = |file: &str, line: u32| self.line.as_ref().is_none_or(|here| (&*here.0, here.1) != (file, line));
        self.kind != LineStepKind::Out
            && line.is_some_and(|line| begins(line.addr) && (other(&line.file, line.line) || pc == self.start))
    }
}

/// The way back to the beginning of a line of this function or of a caller.
#[derive(Debug, Clone)]
pub(crate) struct BackLineStep {
    line: Option<(Arc<str>, u32)>,
    /// The step began in the middle of its line, which then may be the one to come to.
    began_mid_line: bool,
    depth: u32,
    /// Bytes of program memory of this function.
    function: std::ops::Range<u32>,
}

impl BackLineStep {
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

    fn slice(&self, session: &mut DebugSession, go_on: KeepRunning<'_>) -> HaltResult {
        let scope = session.scope.clone();
        let source = scope.source();
        session.run_back_until(go_on, &mut || true, &mut |passed| {
            let (pc, depth) = (passed.target.pc(), passed.target.stack_depth());
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
    /// Runs on for as long as `go_on` says so.
    fn slice(&mut self, session: &mut DebugSession, go_on: KeepRunning<'_>) -> HaltResult {
        match self {
            PendingRun::Continue => session.run(&RunGoal::default(), go_on),
            PendingRun::Steps(left) => session.step_remaining(left, LAST_CYCLE, true, go_on),
            PendingRun::StepOver(over) => over.slice(session, go_on),
            PendingRun::StepLine(walk) => walk.slice(session, go_on),
            PendingRun::ToWords(words, left) => {
                let goal = RunGoal { words: words.clone(), ..RunGoal::default() };
                loop {
                    let halt = session.run(&goal, go_on);
                    if halt.reason != HaltReason::Done {
                        return halt;
                    }
                    *left = left.saturating_sub(1);
                    if *left == 0 {
                        return halt;
                    }
                }
            }
            PendingRun::Cycle(cycle) => session.goto_cycle(*cycle, go_on),
            PendingRun::ReverseContinue => session.run_back(go_on),
            PendingRun::BackSteps(n) => session.step_back(*n, &mut || true),
            PendingRun::BackLine(line) => line.slice(session, go_on),
            PendingRun::BackTo(words, left) => {
                let own = session.points.add(PointTrigger::Code(words.iter().copied().collect()), "", false);
                let halt = loop {
                    let halt = session.run_back(go_on);
                    let HaltReason::Points(mut hits) = halt.reason else { break halt };
                    let wanted = hits.iter().any(|hit| hit.id == own);
                    hits.retain(|hit| hit.id != own);
                    *left = left.saturating_sub(u64::from(wanted));
                    if !hits.is_empty() {
                        break HaltResult { reason: HaltReason::Points(hits) };
                    }
                    if *left == 0 {
                        break HaltResult { reason: HaltReason::Done };
                    }
                };
                session.points.remove(own);
                halt
            }
        }
    }

    /// It has come to where it was to come, though a point stood there that did not stop it.
    fn has_arrived(&mut self, session: &DebugSession) -> bool {
        match self {
            PendingRun::Steps(left) => *left == 0,
            PendingRun::StepOver(over) => over.is_done(session),
            PendingRun::StepLine(walk) => walk.done,
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
    /// A slice of the run that was asked for.
    pub(crate) fn advance_run(&mut self, go_on: KeepRunning<'_>) {
        let (Some(mut run), Some(machine)) = (self.run.take(), self.machine.as_mut()) else { return };
        let (back, end) = (run.is_backwards(), Instant::now() + RUN_SLICE);
        let silent = if back { self.points.disable_log_points(&mut machine.session) } else { Vec::new() };
        // A search backwards begins anew when it is interrupted, so it is left alone as long as nobody wants anything.
        let halt = run.slice(&mut machine.session, &mut || (back || Instant::now() < end) && go_on());
        self.points.enable_log_points(&mut machine.session, &silent);
        machine.listing = None;
        machine.expandable_objects.borrow_mut().clear();
        self.report_events();
        match halt.reason {
            HaltReason::Interrupted => self.run = Some(run),
            HaltReason::Points(hits) if !back => {
                let hits = self.filter_hits(hits);
                let Some(machine) = &self.machine else { return };
                if !hits.is_empty() {
                    self.report_stop(self.stop_of(&HaltReason::Points(hits)));
                } else if run.has_arrived(&machine.session) {
                    self.report_stop(self.stop_of(&HaltReason::Done));
                } else {
                    self.run = Some(run);
                }
            }
            why => self.report_stop(self.stop_of(&why)),
        }
    }
}
