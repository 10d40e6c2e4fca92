//! Running step by step until a condition holds, and detecting that it never will.

use std::collections::BTreeSet;
use std::time::Instant;

use emu_core::cpu::{LAST_CYCLE, StopReason};

use super::call_flow::CallFlow;
use super::dyn_machine::ObserveLevel;
use super::points::{PointTrigger, breakpoint_words};
use super::session::{DebugSession, HOST_TIME_BETWEEN_COPIES, KeepRunning, LOOP_CHECK_CYCLES, STEPS_BEFORE_LOOP_CHECK};
use super::session_stop::{SessionStopReason, session_stop_reason};
use super::watchpoint_probe::WatchpointProbe;

/// Where a series of steps ends, in addition to its test.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepLimits {
    /// Machine cycle that steps do not pass.
    pub cycle: u64,
    /// Whether breakpoints stop the machine too.
    pub stops_at_breakpoints: bool,
    /// Whether the run checks that it can end, because the number of steps is unknown.
    pub detects_endless_loops: bool,
}

impl DebugSession {
    /// Steps until `test` returns true. It gets the session, what the instruction did to the call stack, and
    /// whether the step was an interrupt entry instead. If `stops_at_breakpoints` is true, breakpoints stop
    /// the machine too.
    pub fn step_until(
        &mut self,
        limit: u64,
        stops_at_breakpoints: bool,
        keep_running: KeepRunning<'_>,
        test: &mut dyn FnMut(&DebugSession, CallFlow, bool) -> bool,
    ) -> SessionStopReason {
        let detects_endless_loops = limit == LAST_CYCLE;
        let limits = StepLimits { cycle: limit, stops_at_breakpoints, detects_endless_loops };
        self.step_until_with(limits, keep_running, test)
    }

    /// Steps until `test` returns true, within limits.
    pub(super) fn step_until_with(
        &mut self,
        limits: StepLimits,
        keep_running: KeepRunning<'_>,
        test: &mut dyn FnMut(&DebugSession, CallFlow, bool) -> bool,
    ) -> SessionStopReason {
        let StepLimits { cycle: limit, stops_at_breakpoints, detects_endless_loops } = limits;
        self.current.set_breakpoints(&BTreeSet::new());
        let mut probe = WatchpointProbe::new(&self.points, &*self.current.machine);
        self.current.runs_while_halted = limit < LAST_CYCLE;
        let (mut since, mut slept, mut steps) = (Instant::now(), 0u64, 0u64);
        let mut stuck: Option<(u64, SessionStopReason)> = None;
        loop {
            if self.current.cycle() >= limit {
                return SessionStopReason::Limit;
            }
            let flow = self.call_flow(self.current.machine.pc()).flow;
            let entered = probe.interrupts_entered;
            probe.chip_events = Some(std::mem::take(&mut self.chip_events));
            let level = probe.observe_level().max(ObserveLevel::Events);
            let stop = self.current.step(&self.history.input_events, limit, level, &mut probe);
            self.chip_events = probe.chip_events.take().unwrap_or_default();
            let observations = std::mem::take(&mut probe.observations);
            let changes = probe.take_changes(&*self.current.machine);
            let irq = probe.interrupts_entered > entered;
            self.forget_chip_events();
            if since.elapsed() > HOST_TIME_BETWEEN_COPIES.start {
                self.keep_copy(since.elapsed(), 0);
                since = Instant::now();
            }
            let pc = self.current.machine.pc();
            let is_reached = stops_at_breakpoints && self.reaches_breakpoint(pc);
            let reached = if is_reached { StopReason::Breakpoint { pc } } else { StopReason::Limit };
            let hits = self.take_hits(&observations, &changes, if stop == StopReason::Limit { reached } else { stop });
            let done = stop == StopReason::Limit && self.current.at_step_end && test(self, flow, irq);
            if !hits.is_empty() {
                return SessionStopReason::Points(hits);
            }
            match stop {
                _ if done => return SessionStopReason::Done,
                StopReason::Limit | StopReason::Breakpoint { .. } | StopReason::Probe => {}
                stop => return session_stop_reason(stop),
            }
            // At increasing intervals, because the check runs a copy and is expensive during a long sleep.
            slept = if self.current.at_step_end { 0 } else { slept + 1 };
            if slept.is_power_of_two() && limit == LAST_CYCLE && self.is_blocked_on_input() {
                return SessionStopReason::BlockedOnInput;
            }
            steps += u64::from(detects_endless_loops);
            if steps >= STEPS_BEFORE_LOOP_CHECK && steps.is_power_of_two() && stuck.is_none() {
                stuck = self.endless_loop().map(|why| (self.current.cycle() + 2 * LOOP_CHECK_CYCLES, why));
            }
            if let Some((_, why)) = stuck.take_if(|stuck| self.current.cycle() > stuck.0) {
                return why;
            }
            if !keep_running() {
                return SessionStopReason::Interrupted;
            }
        }
    }

    /// Returns true if the instruction at `pc` has a breakpoint and is executed next. A pending interrupt is
    /// taken first: then the breakpoint stops the machine after the service routine, as in a run.
    fn reaches_breakpoint(&self, pc: u32) -> bool {
        if !breakpoint_words(&self.points).any(|word| word == pc) {
            return false;
        }
        let mut copy = self.current.machine.fork();
        copy.set_breakpoints(&BTreeSet::from([pc]));
        let stop = copy.step(ObserveLevel::Nothing, &mut ());
        // A sleeping machine is at its breakpoint too.
        stop == StopReason::Breakpoint { pc }
            || copy.pc() == pc
            || copy.instructions() > self.current.machine.instructions()
    }

    /// Returns true if only a stimulus can change what the program does
    /// ([`DynMachine::is_blocked_on_input`](super::DynMachine::is_blocked_on_input)), none is pending, and no
    /// point depends on time.
    pub(super) fn is_blocked_on_input(&self) -> bool {
        let timed = |what: &PointTrigger| matches!(what, PointTrigger::Change(expr) if expr.depends_only_on_time());
        self.current.next_input_event_cycle(&self.history.input_events) == u64::MAX
            && !self.points.enabled().any(|point| timed(&point.trigger))
            && self.current.machine.is_blocked_on_input()
    }

    /// Returns the reason why a search never ends, if it can be determined: within [`LOOP_CHECK_CYCLES`]
    /// cycles the program repeats in a loop without an exit.
    fn endless_loop(&self) -> Option<SessionStopReason> {
        if self.current.next_input_event_cycle(&self.history.input_events) != u64::MAX {
            return None;
        }
        if self.is_blocked_on_input() {
            return Some(SessionStopReason::BlockedOnInput);
        }
        let mut copy = self.current.machine.fork();
        copy.set_run_while_halted(false);
        (copy.run(copy.cycle() + LOOP_CHECK_CYCLES, ObserveLevel::Nothing, &mut ()) == StopReason::Halted)
            .then_some(SessionStopReason::Halted)
    }
}
