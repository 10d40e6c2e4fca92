//! Running, stepping and going back on behalf of gdb, and the stop replies.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::ops::Range;

use emu_core::cpu::{LAST_CYCLE, ProgramError, ProgramFault, StopReason};
use emu_debug::debug::{CallFlow, DebugSession, ObserveLevel, PointHit, PointTrigger, RunGoal, SessionStopReason};
use gdbstub::common::Signal;
use gdbstub::stub::SingleThreadStopReason;
use gdbstub::target::ext::base::reverse_exec::{
    ReplayLogPosition, ReverseCont, ReverseContOps, ReverseStep, ReverseStepOps,
};
use gdbstub::target::ext::base::singlethread::{
    SingleThreadRangeStepping, SingleThreadRangeSteppingOps, SingleThreadResume, SingleThreadSingleStep,
    SingleThreadSingleStepOps,
};

use crate::gdb_points::GdbPointKind;
use crate::gdb_target::GdbTarget;

/// The kind of run that gdb requests.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ResumeKind {
    /// Run forwards.
    Continue,
    /// Execute one instruction.
    Step,
    /// Step as long as the program counter is in this range of program words.
    StepRange(Range<u32>),
    /// Run backwards.
    ReverseContinue,
    /// Go back by one step.
    ReverseStep,
}

/// A stop reply, and a line for the user if the reply alone does not explain the stop.
pub(crate) type StopReport = (SingleThreadStopReason<u32>, Option<String>);

impl GdbTarget<'_> {
    /// Executes the requested run until something stops the program.
    pub(crate) fn run(&mut self) -> StopReport {
        let (session, input) = (&mut *self.session, &mut self.input);
        let since = session.machine().cycle();
        let keep_running = &mut || input.may_continue();
        let halt = match self.resume.clone() {
            ResumeKind::Continue => session.run(&RunGoal::default(), keep_running),
            ResumeKind::Step => session.step_instructions(1, LAST_CYCLE, keep_running),
            ResumeKind::StepRange(words) => step_range(session, &words, keep_running),
            ResumeKind::ReverseContinue => run_back(session, keep_running),
            ResumeKind::ReverseStep => session.step_back(1, &mut || true),
        };
        let (reason, text) = self.stop_report(&halt);
        let resets = self.session.resets_since(since);
        let lines = |line: Option<String>| line.into_iter().chain(resets.clone()).collect::<Vec<_>>().join("; ");
        self.last_halt = lines(Some(text.clone().unwrap_or_else(|| self.describe_halt(&halt))));
        let text = lines(text);
        (reason, (!text.is_empty()).then_some(text))
    }

    fn stop_report(&self, why: &SessionStopReason) -> StopReport {
        use SingleThreadStopReason as Reason;
        let place = |pc: &u32| self.session.scope.source().describe_word(*pc);
        let signal = |signal| Reason::SignalWithThread { tid: (), signal };
        match why {
            SessionStopReason::Done | SessionStopReason::Limit => (signal(Signal::SIGTRAP), None),
            SessionStopReason::Interrupted => (signal(Signal::SIGINT), None),
            SessionStopReason::Beginning => (Reason::ReplayLog { tid: None, pos: ReplayLogPosition::Begin }, None),
            SessionStopReason::Points(hits) => (self.stop_of_hits(hits), None),
            // Any signal except SIGTRAP ends gdb's `step`, which would otherwise never end.
            SessionStopReason::Halted => {
                (signal(Signal::SIGSTOP), Some("the program has ended: nothing can wake the chip any more".to_owned()))
            }
            SessionStopReason::BlockedOnInput => {
                (signal(Signal::SIGSTOP), Some("only an external stimulus can change what the program does".to_owned()))
            }
            SessionStopReason::Error(ProgramError::Illegal { pc, word }) => {
                let text = format!("0x{word:04x} at {} is not an instruction of this chip", place(pc));
                (signal(Signal::SIGILL), Some(text))
            }
            SessionStopReason::Error(ProgramError::Fault { pc, fault }) => {
                let number = match fault {
                    ProgramFault::UnwrittenRead { .. } => Signal::SIGSEGV,
                    ProgramFault::JumpOutOfProgram { .. } | ProgramFault::CycleTooLong => Signal::SIGBUS,
                };
                (signal(number), Some(format!("{fault}, at {}", place(pc))))
            }
        }
    }

    /// The stop reply for hits of points. A breakpoint takes precedence over a watchpoint, whose access is in
    /// the previous instruction.
    fn stop_of_hits(&self, hits: &[PointHit]) -> SingleThreadStopReason<u32> {
        use SingleThreadStopReason as Reason;
        let mut set: Vec<_> = hits.iter().filter_map(|hit| self.points.iter().find(|set| set.id == hit.id)).collect();
        set.sort_by_key(|set| matches!(set.kind, GdbPointKind::Watch(..)));
        match set.first().map(|set| (set.kind, set.addr)) {
            Some((GdbPointKind::Soft, _)) => Reason::SwBreak(()),
            Some((GdbPointKind::Hard, _)) => Reason::HwBreak(()),
            Some((GdbPointKind::Watch(kind, _), addr)) => Reason::Watch { tid: (), kind, addr },
            // A point that gdb has not set.
            None => Reason::SignalWithThread { tid: (), signal: Signal::SIGTRAP },
        }
    }

    fn describe_halt(&self, why: &SessionStopReason) -> String {
        let place = self.session.scope.source().describe_word(self.session.machine().pc());
        match why {
            SessionStopReason::Points(hits) if hits.iter().all(|hit| hit.write.is_none()) => {
                format!("breakpoint at {place}")
            }
            SessionStopReason::Points(hits) => {
                let by = hits.iter().find(|hit| hit.write.is_some());
                let value = by.and_then(|hit| hit.new).map_or_else(String::new, |new| format!(" of 0x{new:02x}"));
                let what = if by.and_then(|hit| hit.write) == Some(true) { "write" } else { "read" };
                let from = by.map_or_else(String::new, |hit| self.session.scope.source().describe_word(hit.pc));
                format!("watchpoint: {what}{value} by {from}")
            }
            SessionStopReason::Interrupted => format!("interrupted at {place}"),
            SessionStopReason::Beginning => "the history begins here".to_owned(),
            _ => format!("a step has ended at {place}"),
        }
    }
}

/// Steps through the code of a source line. An interrupt service routine that starts meanwhile runs to its
/// end. A jump to itself that nothing can end is the end of the program; single steps alone would not detect
/// it.
fn step_range(
    session: &mut DebugSession,
    words: &Range<u32>,
    keep_running: &mut dyn FnMut() -> bool,
) -> SessionStopReason {
    let (mut depth, mut from) = (session.machine().stack_depth(), session.machine().pc());
    let mut service: Option<u32> = None;
    let mut self_jumps = 0u64;
    let mut halted = false;
    let halt = session.step_until(LAST_CYCLE, true, keep_running, &mut |session, flow, entered| {
        let machine = session.machine();
        match service {
            None if entered => service = Some(depth),
            Some(before) if flow == CallFlow::Return && machine.stack_depth() <= before => service = None,
            _ => {}
        }
        depth = machine.stack_depth();
        self_jumps = if machine.pc() == from { self_jumps + 1 } else { 0 };
        from = machine.pc();
        // Checked at increasing intervals, because it may take long until an interrupt comes.
        halted = self_jumps.is_power_of_two() && {
            let mut copy = machine.fork();
            copy.set_breakpoints(&BTreeSet::new());
            copy.run(machine.cycle() + 1, ObserveLevel::Nothing, &mut ()) == StopReason::Halted
        };
        halted || service.is_none() && !words.contains(&machine.pc())
    });
    if halted && halt == SessionStopReason::Done { SessionStopReason::Halted } else { halt }
}

/// Runs backwards. The session stops after the instruction that hit a watchpoint; gdb expects the stop before
/// it, where the memory has its old value.
fn run_back(session: &mut DebugSession, keep_running: &mut dyn FnMut() -> bool) -> SessionStopReason {
    if session.points.enabled().any(|point| !matches!(point.trigger, PointTrigger::Code(_))) {
        // The instruction that was just executed may have hit a watchpoint.
        let now = session.machine().cycle();
        if session.step_back(1, &mut || true) == SessionStopReason::Done
            && let SessionStopReason::Points(hits) = session.step_instructions(1, now, &mut || true)
        {
            return step_before_access(session, hits);
        }
    }
    match session.run_back(keep_running) {
        SessionStopReason::Points(hits) if !hits.iter().any(|hit| is_breakpoint(session, hit.id)) => {
            step_before_access(session, hits)
        }
        why => why,
    }
}

/// Goes back before the instruction that hit a watchpoint; that instruction may have a breakpoint.
fn step_before_access(session: &mut DebugSession, mut hits: Vec<PointHit>) -> SessionStopReason {
    session.step_back(1, &mut || true);
    hits.extend(breakpoints_here(session));
    SessionStopReason::Points(hits)
}

fn is_breakpoint(session: &DebugSession, id: u32) -> bool {
    session.points.get(id).is_some_and(|point| matches!(point.trigger, PointTrigger::Code(_)))
}

/// The breakpoints on the next instruction.
fn breakpoints_here(session: &DebugSession) -> Vec<PointHit> {
    let pc = session.machine().pc();
    let on = session
        .points
        .enabled()
        .filter(|point| matches!(&point.trigger, PointTrigger::Code(words) if words.contains(&pc)));
    on.map(|point| PointHit { id: point.id, old: None, new: None, write: None, pc }).collect()
}

impl SingleThreadResume for GdbTarget<'_> {
    fn resume(&mut self, _signal: Option<Signal>) -> Result<(), Infallible> {
        self.resume = ResumeKind::Continue;
        Ok(())
    }
    fn support_single_step(&mut self) -> Option<SingleThreadSingleStepOps<'_, Self>> {
        Some(self)
    }
    fn support_range_step(&mut self) -> Option<SingleThreadRangeSteppingOps<'_, Self>> {
        Some(self)
    }
    fn support_reverse_step(&mut self) -> Option<ReverseStepOps<'_, (), Self>> {
        Some(self)
    }
    fn support_reverse_cont(&mut self) -> Option<ReverseContOps<'_, (), Self>> {
        Some(self)
    }
}

impl SingleThreadSingleStep for GdbTarget<'_> {
    fn step(&mut self, _signal: Option<Signal>) -> Result<(), Infallible> {
        self.resume = ResumeKind::Step;
        Ok(())
    }
}

impl SingleThreadRangeStepping for GdbTarget<'_> {
    fn resume_range_step(&mut self, start: u32, end: u32) -> Result<(), Infallible> {
        let per_word = self.session.machine().chip().word_bytes.max(1);
        self.resume = ResumeKind::StepRange(start / per_word..end.div_ceil(per_word));
        Ok(())
    }
}

impl ReverseCont<()> for GdbTarget<'_> {
    fn reverse_cont(&mut self) -> Result<(), Infallible> {
        self.resume = ResumeKind::ReverseContinue;
        Ok(())
    }
}

impl ReverseStep<()> for GdbTarget<'_> {
    fn reverse_step(&mut self, (): ()) -> Result<(), Infallible> {
        self.resume = ResumeKind::ReverseStep;
        Ok(())
    }
}
