//! A debugging session: a machine, its history, and its breakpoints and watchpoints.

use crate::debug::InstructionFlow;
use crate::debug::c_objects::assignment::PlaceWrite;
use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, Instant};

use emu_core::cpu::{LAST_CYCLE, StopReason};
use emu_core::state::SnapshotDamaged;

use super::call_flow::{CallFlow, call_flow};
use super::dyn_machine::{DynMachine, ObserveLevel};
use super::error::DebugError;
use super::event_log::SessionEvents;
use super::expression::DebugExpression;
use super::expression_value::ExpressionValue;
use super::history::{HistorySize, MachineHistory, MidStepPosition, UserAction};
use super::machine_with_follower::{MachineWithFollower, ProgramFollower};
use super::points::{DebugPoints, breakpoint_words};
use super::scope::NameScope;
use super::session_stop::{PointHit, SessionStopReason, session_stop_reason};
use super::step_until::StepLimits;
use super::watchpoint_probe::{Observation, PointChange, WatchpointProbe, candidate_hits};
use crate::time::CycleClock;

/// Target host time of a stretch, which is the part of a run between two copies of the machine in the
/// history.
pub(super) const HOST_TIME_BETWEEN_COPIES: std::ops::Range<Duration> =
    Duration::from_micros(300)..Duration::from_millis(1);

/// The allowed lengths of a stretch, in machine cycles.
const CYCLES_BETWEEN_COPIES: std::ops::RangeInclusive<u64> = 1 << 10..=1 << 40;

/// Length of the first stretch, and of the run that looks for an endless loop, in machine cycles. A program
/// that only a stimulus can change runs for that long before the session reports
/// [`SessionStopReason::BlockedOnInput`].
pub(super) const LOOP_CHECK_CYCLES: u64 = 1 << 12;

/// Number of steps after which a search checks for the first time whether it can end.
pub(super) const STEPS_BEFORE_LOOP_CHECK: u64 = 1 << 12;

/// Maximum steps of one repetition of a halted AP101: two program cycles of the largest program.
const MAX_PERIOD_STEPS: u32 = 2 << 12;

/// The start parameters of a session.
pub struct SessionOptions {
    /// The length of a cycle.
    pub clock: CycleClock,
    /// Maximum size of the copies of the machine, in bytes.
    pub max_copy_bytes: usize,
    /// The follower of the program, such as a ladder view.
    pub follower: Option<Box<dyn ProgramFollower>>,
}

/// Where a run of a session stops, in addition to its breakpoints and watchpoints.
#[derive(Debug, Clone, Default)]
pub struct RunGoal {
    /// The run stops at this machine cycle at the latest.
    pub until: Option<u64>,
    /// The run stops before one of these program words.
    pub words: BTreeSet<u32>,
    /// Time passes up to `until` even if nothing can wake the chip; otherwise the run stops with
    /// [`SessionStopReason::Halted`].
    pub runs_while_halted: bool,
}

/// A machine under the debugger.
pub struct DebugSession {
    /// The machine at the present position.
    pub(super) current: MachineWithFollower,
    /// Earlier copies of the machine, and what happened to it from outside.
    pub(super) history: MachineHistory,
    /// Where a run was stopped within a step, until the machine moves other than by steps.
    pub(super) mid_step_position: Option<MidStepPosition>,
    /// The parts from which [`DebugSession::load`] makes a new history.
    history_template: HistoryTemplate,
    /// Breakpoints and watchpoints.
    pub points: DebugPoints,
    /// Names of symbols, registers and source lines.
    pub scope: NameScope,
    clock: CycleClock,
    /// The newest events of the chip.
    pub(super) chip_events: SessionEvents,
    /// Length of the next stretch in machine cycles.
    stretch: u64,
    /// Call flow of instructions that were executed, by program word.
    flows: HashMap<u32, CachedCallFlow>,
}

/// The parts from which [`DebugSession::load`] makes a new history.
struct HistoryTemplate {
    /// The follower in its initial state.
    follower: Option<Box<dyn ProgramFollower>>,
    /// Maximum size of the copies of the machine, in bytes.
    max_copy_bytes: usize,
}

/// What an instruction does to the call stack.
struct CachedCallFlow {
    /// First word of the instruction, to notice that the program has changed.
    first_word: u16,
    flow: CallFlow,
    /// Length of the instruction in program words.
    length: u32,
}

/// Called periodically; returns whether to continue.
pub(super) type KeepRunning<'a> = &'a mut dyn FnMut() -> bool;

/// An action of the user with its time.
#[derive(Debug, Clone, Copy)]
pub struct TimedAction<'a> {
    /// The cycle of the machine.
    pub cycle: u64,
    /// The action.
    pub action: &'a UserAction,
}

impl DebugSession {
    /// Returns a session with a machine in its current state, where the history begins.
    #[must_use]
    pub fn new(machine: Box<dyn DynMachine>, scope: NameScope, options: SessionOptions) -> DebugSession {
        let history_template = HistoryTemplate {
            follower: options.follower.as_ref().map(|follow| follow.fork()),
            max_copy_bytes: options.max_copy_bytes,
        };
        let current = MachineWithFollower::new(machine, options.follower);
        DebugSession {
            history_template,
            history: MachineHistory::new(&current, options.max_copy_bytes),
            current,
            mid_step_position: None,
            points: DebugPoints::default(),
            scope,
            clock: options.clock,
            chip_events: SessionEvents::default(),
            stretch: 1 << 14,
            flows: HashMap::new(),
        }
    }

    /// Returns the machine in its current state.
    #[must_use]
    pub fn machine(&self) -> &dyn DynMachine {
        &*self.current.machine
    }

    /// Returns the follower of the program.
    #[must_use]
    pub fn follower(&self) -> Option<&dyn ProgramFollower> {
        self.current.follower.as_deref()
    }

    /// Returns true if a step has ended here; otherwise a limit or the user has stopped a run within a step,
    /// such as in sleep.
    #[must_use]
    pub fn is_at_step_end(&self) -> bool {
        self.current.at_step_end
    }

    /// Returns the length of a cycle.
    #[must_use]
    pub fn clock(&self) -> CycleClock {
        self.clock
    }

    /// Returns the scans begun since power-up, or since the last loaded state, if the program has scans.
    #[must_use]
    pub fn scan(&self) -> Option<u64> {
        self.current.follower.as_ref().and_then(|follow| follow.scan())
    }

    /// Returns how much the history keeps.
    #[must_use]
    pub fn history_size(&self) -> HistorySize {
        self.history.size()
    }

    /// Returns the cycle at which the history begins: the session cannot go back further.
    #[must_use]
    pub fn first_cycle(&self) -> u64 {
        self.history.first_cycle()
    }

    /// Returns the user's actions in order, each with the cycle of the machine.
    pub fn input_events(&self) -> impl Iterator<Item = TimedAction<'_>> {
        self.history.input_events.iter().map(|event| TimedAction { cycle: event.cycle, action: &event.action })
    }

    /// Applies an action of the user now, and discards the future of this history.
    ///
    /// # Errors
    /// The machine does not accept it; nothing has changed.
    pub fn apply_action(&mut self, action: UserAction) -> Result<(), DebugError> {
        // A failing action may have been applied in part.
        let before = self.current.machine.fork();
        let mut probe = WatchpointProbe::new(&DebugPoints::default(), &*before);
        probe.chip_events = Some(std::mem::take(&mut self.chip_events));
        let done = self.current.apply(&action, ObserveLevel::Events, &mut probe);
        self.chip_events = probe.chip_events.take().unwrap_or_default();
        if let Err(why) = done {
            self.current.machine = before;
            return Err(why);
        }
        self.history.branch(&self.current, action);
        self.mid_step_position = None;
        self.current.input_events_applied = self.history.input_events.len();
        Ok(())
    }

    /// Assigns a value to an expression: a location, or a C object that extends over several.
    ///
    /// # Errors
    /// It has no location, or cannot have this value.
    pub fn assign(&mut self, expr: &DebugExpression, value: ExpressionValue) -> Result<(), DebugError> {
        let object = expr.object().filter(|object| object.is_wider_than_place(self.machine()));
        let writes = match (object, expr.place(self.machine())) {
            (Some(object), _) => object.writes_for(self.machine(), value)?,
            (None, Some(place)) => {
                let value = value.to_integer();
                vec![PlaceWrite {
                    place,
                    value: expr.object().map_or(value, |object| object.without_link_offset(value)),
                }]
            }
            (None, None) => return Err(DebugError::NotAPlace),
        };
        writes.into_iter().try_for_each(|PlaceWrite { place, value }| self.apply_action(UserAction::Set(place, value)))
    }

    /// Checks that the machine can be saved and loaded.
    ///
    /// # Errors
    /// It cannot, because the devices at its pins have a state of their own.
    pub fn check_snapshot_possible(&self) -> Result<(), DebugError> {
        if self.current.machine.has_no_devices() { Ok(()) } else { Err(DebugError::DevicesHaveState) }
    }

    /// Returns the state of the chip for [`DebugSession::load`], without devices
    /// ([`DebugSession::check_snapshot_possible`]).
    #[must_use]
    pub fn save(&self) -> Vec<u8> {
        self.current.machine.save()
    }

    /// Loads a state of the chip at the machine cycle `cycle`. A new history begins there; points stay, and
    /// the follower of the program starts again.
    ///
    /// # Errors
    /// It is not a state of this chip at that cycle; nothing has changed.
    pub fn load(&mut self, state: &[u8], cycle: u64) -> Result<(), SnapshotDamaged> {
        let mut machine = self.current.machine.fork();
        machine.restore(state)?;
        if machine.cycle() != cycle {
            return Err(SnapshotDamaged);
        }
        self.current =
            MachineWithFollower::new(machine, self.history_template.follower.as_ref().map(|follow| follow.fork()));
        self.history = MachineHistory::new(&self.current, self.history_template.max_copy_bytes);
        self.mid_step_position = None;
        self.chip_events = SessionEvents::default();
        self.flows.clear();
        Ok(())
    }

    /// Steps `n` instructions (an interrupt entry counts as one), or fewer if a watchpoint stops the machine.
    /// Sleep passes, up to the cycle `limit`. If a run was stopped within a sleep before steps back, a step
    /// forward stops there again, so the same number of steps returns to the start.
    pub fn step_instructions(&mut self, n: u64, limit: u64, keep_running: KeepRunning<'_>) -> SessionStopReason {
        self.step_remaining(&mut { n }, limit, false, keep_running)
    }

    /// Steps `remaining` instructions, as [`DebugSession::step_instructions`] does, and counts `remaining`
    /// down, so that an interrupted call can be continued. With `stops_at_breakpoints`, breakpoints stop the
    /// machine too.
    pub fn step_remaining(
        &mut self,
        remaining: &mut u64,
        limit: u64,
        stops_at_breakpoints: bool,
        keep_running: KeepRunning<'_>,
    ) -> SessionStopReason {
        let now = self.current.cycle();
        // A position within a step, at which a run was stopped before, also ends a step.
        let mut stop_within =
            self.mid_step_position.take().filter(|stop| stop.returned_to == now && stop.cycle < limit);
        loop {
            let end = stop_within.map_or(limit, |stop| stop.cycle);
            let limits = StepLimits { cycle: end, stops_at_breakpoints, detects_endless_loops: false };
            let halt = self.step_until_with(limits, &mut *keep_running, &mut |_, _, _| {
                *remaining = remaining.saturating_sub(1);
                *remaining == 0
            });
            let Some(reached) = stop_within.take() else { return halt };
            let now = self.current.cycle();
            self.mid_step_position = (now < reached.cycle).then_some(MidStepPosition { returned_to: now, ..reached });
            if halt != SessionStopReason::Limit {
                return halt;
            }
            *remaining = remaining.saturating_sub(u64::from(!self.current.at_step_end));
            if *remaining == 0 {
                return SessionStopReason::Done;
            }
        }
    }

    /// Runs until a breakpoint or watchpoint, the goal, or the end of the program. The run consists of
    /// stretches; after each one a copy of the machine is kept, and `keep_running` is asked.
    pub fn run(&mut self, goal: &RunGoal, keep_running: KeepRunning<'_>) -> SessionStopReason {
        let until = goal.until.unwrap_or(LAST_CYCLE).min(LAST_CYCLE);
        let words = breakpoint_words(&self.points).chain(goal.words.iter().copied()).collect::<BTreeSet<u32>>();
        let mut has_left_start = !words.contains(&self.current.machine.pc()) || self.current.machine.is_asleep();
        let mut probe = WatchpointProbe::new(&self.points, &*self.current.machine);
        self.current.runs_while_halted = goal.runs_while_halted && goal.until.is_some();
        let (mut stretch, mut was_blocked) = (LOOP_CHECK_CYCLES.min(self.stretch), false);
        loop {
            if self.current.cycle() >= until {
                return SessionStopReason::Limit;
            }
            let start = (Instant::now(), self.current.cycle());
            probe.chip_events = Some(std::mem::take(&mut self.chip_events));
            let input_events = &self.history.input_events;
            // The first step ignores the breakpoints.
            self.current.set_breakpoints(&words);
            let stop = if has_left_start {
                let end =
                    until.min(start.1.saturating_add(stretch)).min(self.current.next_input_event_cycle(input_events));
                self.current.run(input_events, end, &words, probe.observe_level(), &mut probe)
            } else {
                has_left_start = true;
                let end = until.min(start.1.saturating_add(stretch));
                self.current.step(input_events, end, probe.observe_level(), &mut probe)
            };
            let stop = if stop == StopReason::Halted { self.run_halted_ap101(&words, until, &mut probe) } else { stop };
            self.chip_events = probe.chip_events.take().unwrap_or_default();
            let observations = std::mem::take(&mut probe.observations);
            let changes = probe.take_changes(&*self.current.machine);
            if start.1 < self.current.cycle() {
                self.keep_copy(start.0.elapsed(), self.current.cycle() - start.1);
            }
            let hits = self.take_hits(&observations, &changes, stop);
            if !hits.is_empty() {
                return SessionStopReason::Points(hits);
            }
            match stop {
                StopReason::Breakpoint { pc } if goal.words.contains(&pc) => {
                    return SessionStopReason::Done;
                }
                // Without `until`, a program that waits for input would run forever.
                StopReason::Limit if goal.until.is_none() && self.is_blocked_on_input() => match was_blocked {
                    true => return SessionStopReason::BlockedOnInput,
                    false => (was_blocked, stretch) = (true, LOOP_CHECK_CYCLES),
                },
                StopReason::Limit | StopReason::Breakpoint { .. } | StopReason::Probe => {
                    (was_blocked, stretch) = (false, self.stretch)
                }
                stop => return session_stop_reason(stop),
            }
            // The next run would pass a breakpoint that was reached but not reported.
            let is_unreported = stop == StopReason::Limit && words.contains(&self.current.machine.pc());
            if !is_unreported && !keep_running() {
                return SessionStopReason::Interrupted;
            }
        }
    }

    /// Returns what the instruction at a program word does to the call stack, and its length in program
    /// words.
    pub fn call_flow(&mut self, pc: u32) -> InstructionFlow {
        let (chip, machine) = (self.scope.chip(), &*self.current.machine);
        let read = |word| self::program_word_at(machine, word);
        let first = read(pc);
        match self.flows.get(&pc) {
            Some(known) if known.first_word == first => InstructionFlow { flow: known.flow, words: known.length },
            _ => {
                let InstructionFlow { flow, words: length } = call_flow(chip, read, pc);
                self.flows.insert(pc, CachedCallFlow { first_word: first, flow, length });
                InstructionFlow { flow, words: length }
            }
        }
    }

    /// Returns the content of program memory at a word address; 0 beyond the end of the memory.
    #[must_use]
    pub fn word(&self, address: u32) -> u16 {
        self::program_word_at(&*self.current.machine, address)
    }

    /// Runs a halted AP101 until it reaches one of `words`. It counts as halted because its program no longer
    /// changes anything; but the program still runs, so it is stepped for one whole repetition.
    fn run_halted_ap101(&mut self, words: &BTreeSet<u32>, until: u64, probe: &mut WatchpointProbe) -> StopReason {
        if !self.scope.chip().is_bit_controller() || words.is_empty() {
            return StopReason::Halted;
        }
        self.current.set_breakpoints(words);
        for _ in 0..MAX_PERIOD_STEPS {
            match self.current.step_to_breakpoint(
                &self.history.input_events,
                words,
                until,
                probe.observe_level(),
                probe,
            ) {
                StopReason::Limit if self.current.cycle() < until => {}
                stop => return stop,
            }
        }
        StopReason::Halted
    }

    /// Keeps a copy of the current machine, and adapts the length of the next stretch; a stretch that was cut
    /// short does not show how long a whole one takes.
    pub(super) fn keep_copy(&mut self, host_time: Duration, cycles: u64) {
        if host_time >= HOST_TIME_BETWEEN_COPIES.end {
            self.stretch = (self.stretch / 2).max(*CYCLES_BETWEEN_COPIES.start());
        } else if host_time < HOST_TIME_BETWEEN_COPIES.start && cycles >= self.stretch {
            self.stretch = (self.stretch * 2).min(*CYCLES_BETWEEN_COPIES.end());
        }
        // Runs that end early do not each leave a copy.
        if host_time >= HOST_TIME_BETWEEN_COPIES.start / 4 {
            self.history.keep_copy(&self.current, host_time);
        }
    }

    /// Applies conditions and ignore counts to the points that were observed, and returns those that stop the
    /// machine here.
    pub(super) fn take_hits(
        &mut self,
        observations: &[Observation],
        changes: &[PointChange],
        stop: StopReason,
    ) -> Vec<PointHit> {
        let machine = &*self.current.machine;
        let mut hits = candidate_hits(&self.points, machine, observations, changes, stop);
        let returned = self
            .points
            .enabled()
            .filter(|point| stop == (StopReason::Breakpoint { pc: machine.pc() }) && point.has_call_returned(machine));
        let returned: Vec<u32> = returned.map(|point| point.id).collect();
        hits.retain(|hit| {
            if returned.contains(&hit.id) {
                return false;
            }
            let Some(point) = self.points.get_mut(hit.id).filter(|point| point.condition_holds(machine)) else {
                return false;
            };
            point.hits += 1;
            let passes = point.ignore > 0;
            point.ignore = point.ignore.saturating_sub(1);
            !passes
        });
        for &id in &returned {
            self.points.remove(id);
            hits.push(PointHit { id, old: None, new: None, write: None, pc: machine.pc() });
        }
        self.points.note_stops(hits.iter().map(|hit| hit.id));
        hits
    }

    /// Forgets the chip events after the current cycle.
    pub(super) fn forget_chip_events(&mut self) {
        self.chip_events.forget_after(self.current.cycle());
    }
}

/// Reads a program word of the machine. Bytes outside of memory read as 0.
pub(super) fn program_word_at(machine: &dyn DynMachine, address: u32) -> u16 {
    let chip = machine.chip();
    let byte =
        |n: u32| machine.peek(chip.code_space, address.saturating_mul(chip.word_bytes).saturating_add(n)).unwrap_or(0);
    match chip.word_bytes {
        1 => byte(0).into(),
        _ => u16::from_le_bytes([byte(0), byte(1)]),
    }
}
