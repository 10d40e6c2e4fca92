//! The run loop that all families share. It handles what happens between two instructions: due events,
//! resets, interrupts, sleep, stops, breakpoints, and polling loops of the program, whose iterations it
//! skips.
//!
//! A family implements [`CpuEngine`] for its machine and calls [`run`] and [`step_until`]. The run loop sets
//! a deadline, the cycle of the next event, and calls the hot loop of the family, [`CpuEngine::burst`], which
//! executes instructions up to the deadline.

use crate::bus::{Bus, report_events};
use crate::cpu::{Cpu, LAST_CYCLE, NEVER, Probe, ProgramError, StopReason};
use crate::pins::{ChipEvent, CycleTime};

/// Iterations of a loop are skipped only if nothing that the loop reads changes for at least this number of
/// cycles: for less, the attempt costs more time than it saves.
const MIN_QUIET_CYCLES: u64 = 64;

/// After an attempt to skip that failed for lack of quiet cycles, loops are not examined for this number of
/// cycles, so that short waits cost no more than without the attempts.
const RETRY_AFTER_CYCLES: u64 = 1024;

/// What the run loop keeps from one call to the next: settings, and what it knows of the last run. It is no
/// part of the machine's state, so snapshots do not contain it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunState {
    /// Program word of the breakpoint that stopped the last run. The next run starts there and passes it
    /// once.
    pub breakpoint_to_pass: Option<u32>,
    /// Setting: iterations of polling loops are skipped.
    pub skip_idle_loops: bool,
    /// Machine cycle before which polling loops are not examined, because an attempt to skip iterations
    /// failed.
    pub no_skip_before: u64,
    /// Setting: a run continues to its limit even if nothing can wake the chip. Otherwise it stops with
    /// [`StopReason::Halted`].
    pub run_while_halted: bool,
    /// The run found the machine asleep or in a polling loop while no event was due and no interrupt pending,
    /// so only an event from outside can change what the program does.
    pub is_blocked: bool,
}

impl RunState {
    /// The initial settings: polling loops are skipped.
    pub const START: RunState = RunState {
        breakpoint_to_pass: None,
        skip_idle_loops: true,
        no_skip_before: 0,
        run_while_halted: false,
        is_blocked: false,
    };
}

/// What predecode found out about an instruction, in addition to its operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionMark {
    /// Nothing special.
    Plain,
    /// A jump to itself, which changes nothing and reads nothing.
    JumpsToItself,
    /// The jump at the end of a polling loop or a countdown loop ([`CpuEngine::loop_plan`]).
    ClosesLoop,
}

/// A polling loop or a countdown loop of the program, as predecode found it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoopPlan {
    /// Program word of its first instruction.
    pub head: u32,
    /// Registers of the chip that it reads, as [`Bus`] numbers them.
    pub registers_read: Vec<u16>,
    /// Whether it clears the watchdog. Of such a loop only the last iteration matters, since each one
    /// restarts the watchdog.
    pub clears_watchdog: bool,
    /// Bytes of the counter, lowest first, if the loop does nothing but count down to zero by one per
    /// iteration; otherwise empty. The family numbers the bytes, and [`CpuEngine::counter_byte`] reads them.
    pub counter: Vec<u16>,
}

/// An executor with the code that it runs.
pub struct ReadyExecutor<E, C> {
    /// The interpreter with the state of the core.
    pub executor: E,
    /// The predecoded code.
    pub code: C,
}

/// The core of a machine as the run loop sees it. The chip around it is a [`Bus`].
pub trait CpuEngine: Cpu {
    /// The state of the core that a polling loop can change. If an iteration leaves it unchanged, the next
    /// iteration does the same.
    type CoreState: PartialEq;

    /// Returns the flag that is set when the probe requests a stop.
    fn stop_requested(&mut self) -> &mut bool;
    /// Returns the flag that the burst sets when it stops at an op that it does not execute itself: a
    /// breakpoint, a jump to itself, the jump at the end of a loop, or a word that is not an instruction.
    fn slow_path_requested(&mut self) -> &mut bool;

    /// Carries out a request of the chip between two instructions.
    fn apply_request(&mut self, request: <Self::Bus as Bus>::Request);
    /// Returns true if no interrupt is taken between two instructions at the cycle `now`, because of the
    /// instruction before it, such as RETI.
    fn holds_interrupts(&self, now: u64) -> bool {
        let _ = now;
        false
    }
    /// Returns true if an interrupt would be taken at the cycle `now`.
    fn has_pending_interrupt(&self, now: u64) -> bool {
        self.bus().pending_interrupt(now).is_some()
    }
    /// Enters the pending interrupt, if there is one. Returns true if it did.
    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool;
    /// Returns true if the core is stopped until something wakes it.
    fn is_core_asleep(&self) -> bool {
        self.bus().is_core_stopped()
    }
    /// Returns true if the interrupt flag of the core is set. A core without one returns true: there the
    /// registers of the chip decide alone.
    fn accepts_interrupts(&self) -> bool {
        true
    }
    /// Returns true if nothing that is enabled can wake or reset the chip, and nothing is pending.
    fn is_halted(&self) -> bool {
        !self.bus().is_busy() && !self.bus().can_wake(self.accepts_interrupts())
    }

    /// Returns true if a breakpoint is set at `pc`.
    fn has_breakpoint(&self, pc: u32) -> bool;
    /// What predecode found out about the instruction at `pc`.
    fn instruction_mark(&self, pc: u32) -> InstructionMark;
    /// The polling loop or countdown loop that ends with the instruction at `end`.
    fn loop_plan(&self, end: u32) -> Option<&LoopPlan>;
    /// A byte of the counter of a countdown loop ([`LoopPlan::counter`]).
    fn counter_byte(&self, number: u16) -> u8;
    /// Sets a byte of the counter of a countdown loop ([`LoopPlan::counter`]).
    fn set_counter_byte(&mut self, number: u16, value: u8);
    /// The present state of the core.
    fn core_state(&self) -> Self::CoreState;

    /// Executes instructions up to the deadline, or up to an op that it does not execute itself
    /// ([`CpuEngine::slow_path_requested`]). The jump at the end of a polling loop or a countdown loop is
    /// such an op only with `stop_at_polling_loops`.
    fn burst<P: Probe>(&mut self, stop_at_polling_loops: bool, probe: &mut P);
    /// Executes the instruction at `pc`, the program counter, regardless of its marks.
    ///
    /// # Errors
    /// The reason why it cannot be executed.
    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), ProgramError>;
}

/// Runs to the machine cycle `until`, or until something stops the run ([`Cpu::run`]).
pub fn run<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> StopReason {
    let until = until.min(LAST_CYCLE);
    let now = cpu.cycle();
    cpu.bus_mut().set_event_log(P::EVENTS, now);
    let may_skip = may_skip_loops::<E, P>(cpu);
    if P::FLOW {
        probe.on_flow_start(cpu.pc());
    }
    loop {
        if let Some(stop) = handle_boundary(cpu, until, probe) {
            if P::FLOW {
                probe.on_flow_end(cpu.pc());
            }
            return stop;
        }
        let stop_at_polling_loops = may_skip && cpu.cycle() >= cpu.run_state().no_skip_before;
        cpu.burst(stop_at_polling_loops, probe);
    }
}

/// Executes one instruction or one interrupt entry, or sleeps until the next due event, at most up to `until`
/// ([`Cpu::step_until`]).
pub fn step_until<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> StopReason {
    let now = cpu.cycle();
    let next_event = cpu.bus_mut().fire(now);
    // A machine that is asleep with an interrupt pending, or with no event due and no limit, passes one
    // cycle.
    let sleeps = cpu.is_core_asleep() && !cpu.has_pending_interrupt(now) && next_event.min(until) < LAST_CYCLE;
    run(cpu, if sleeps { next_event.min(until).max(now + 1) } else { now + 1 }, probe)
}

/// Runs on for a short time and returns whether only an event from outside can change what the program does
/// ([`Cpu::is_blocked_on_input`]). That is so if no event is due, and the machine sleeps or is in a polling
/// loop, at the latest after twice `RETRY_AFTER_CYCLES` cycles. This changes the machine: callers pass a
/// copy.
pub fn is_blocked_on_input<E: CpuEngine>(cpu: &mut E) -> bool {
    let now = cpu.cycle();
    if cpu.bus_mut().fire(now) != NEVER {
        return false;
    }
    *cpu.run_state() = RunState::START;
    run(cpu, now.saturating_add(2 * RETRY_AFTER_CYCLES), &mut ()) == StopReason::Limit && cpu.run_state().is_blocked
}

/// Handles everything that is due at this instruction boundary and sets the next deadline. Returns the reason
/// for a stop, if there is one.
///
/// Each case stops the run, or repeats the loop, or returns with the deadline at least one cycle ahead, so
/// that the next burst executes at least one instruction.
fn handle_boundary<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> Option<StopReason> {
    loop {
        let now = cpu.cycle();
        let next_event = cpu.bus_mut().fire(now);
        if report_events(cpu.bus_mut(), probe) {
            *cpu.stop_requested() = true;
        }
        if let Some(cause) = cpu.bus_mut().requested_reset(now) {
            let (stop_requested, pc_before) = (*cpu.stop_requested(), cpu.pc());
            cpu.reset(cause);
            *cpu.stop_requested() =
                stop_requested | (P::EVENTS && probe.on_event(ChipEvent::Reset { at: CycleTime::at(now), cause }));
            report_jump(cpu, pc_before, probe);
            continue;
        }
        if std::mem::take(cpu.stop_requested()) {
            return Some(StopReason::Probe);
        }
        if now >= until {
            return Some(StopReason::Limit);
        }
        let pc_before = cpu.pc();
        if let Some(request) = cpu.bus_mut().next_request(now) {
            cpu.apply_request(request);
            report_jump(cpu, pc_before, probe);
            continue;
        }
        if !cpu.holds_interrupts(now) && cpu.enter_interrupt(now, probe) {
            report_jump(cpu, pc_before, probe);
            cpu.run_state().breakpoint_to_pass = None;
            *cpu.slow_path_requested() = false;
            cpu.clock_mut().expire();
            continue;
        }
        if cpu.is_core_asleep() {
            if !cpu.run_state().run_while_halted && cpu.is_halted() {
                return Some(StopReason::Halted);
            }
            cpu.run_state().is_blocked |= next_event == NEVER && !cpu.has_pending_interrupt(now);
            // Everything that is due in this cycle is done, and no interrupt can wake the core in it. So time
            // passes: up to the next event, but at least one cycle.
            let clock = cpu.clock_mut();
            clock.advance_cycles(next_event.min(until).max(now + 1) - now);
            clock.expire();
            continue;
        }
        // The hold-off lasts for one instruction: check again directly after it.
        let deadline = if cpu.holds_interrupts(now) { now + 1 } else { next_event.min(until).max(now + 1) };
        let no_skip_before = cpu.run_state().no_skip_before;
        // The burst also ends where polling loops are examined again after a failed attempt to skip.
        let retry_deadline = if no_skip_before > now { no_skip_before } else { NEVER };
        cpu.clock_mut().set_deadline(deadline.min(retry_deadline));
        if std::mem::take(cpu.slow_path_requested()) {
            let nothing_due = next_event == NEVER && !cpu.has_pending_interrupt(now);
            if let Some(stop) = slow_path(cpu, deadline, nothing_due, probe) {
                return Some(stop);
            }
            continue;
        }
        return None;
    }
}

/// Reports to the probe that the program counter changed from `before` without an instruction.
fn report_jump<E: CpuEngine, P: Probe>(cpu: &E, before: u32, probe: &mut P) {
    if P::FLOW {
        probe.on_flow_end(before);
        probe.on_flow_start(cpu.pc());
    }
}

/// Executes the op at the program counter, which the hot loop does not execute itself, and skips iterations
/// if it ends a polling loop. `deadline` is the cycle up to which it may run. `nothing_due` means that no
/// event is due in the future and no interrupt is pending.
fn slow_path<E: CpuEngine, P: Probe>(
    cpu: &mut E,
    deadline: u64,
    nothing_due: bool,
    probe: &mut P,
) -> Option<StopReason> {
    let pc = cpu.pc();
    let at_breakpoint = cpu.has_breakpoint(pc);
    if at_breakpoint && cpu.run_state().breakpoint_to_pass != Some(pc) {
        cpu.run_state().breakpoint_to_pass = Some(pc);
        return Some(StopReason::Breakpoint { pc });
    }
    cpu.run_state().breakpoint_to_pass = None;
    if P::INSN && at_breakpoint && probe.on_instruction(cpu.cycle(), pc) {
        cpu.run_state().breakpoint_to_pass = Some(pc);
        return Some(StopReason::Probe);
    }
    let (start, instructions_before) = (cpu.cycle(), cpu.instructions());
    if let Err(error) = cpu.execute_single(pc, probe) {
        return Some(StopReason::Error(error));
    }
    match cpu.instruction_mark(pc) {
        InstructionMark::JumpsToItself if !at_breakpoint && cpu.pc() == pc => {
            // All further iterations are equal to this one.
            if !cpu.run_state().run_while_halted && cpu.is_halted() {
                return Some(StopReason::Halted);
            }
            cpu.run_state().is_blocked |= nothing_due;
            if cpu.run_state().skip_idle_loops && !P::EVERY_ITERATION {
                repeat_iterations(cpu, deadline, start, instructions_before);
            }
        }
        InstructionMark::ClosesLoop if !at_breakpoint && may_skip_loops::<E, P>(cpu) => {
            skip_iterations(cpu, pc, deadline, nothing_due, probe)
        }
        _ => {}
    }
    cpu.clock_mut().expire();
    None
}

/// Returns true if iterations of polling loops may be skipped: the setting allows it, and the probe does not
/// need every iteration or read.
fn may_skip_loops<E: CpuEngine, P: Probe>(cpu: &mut E) -> bool {
    cpu.run_state().skip_idle_loops && !P::EVERY_ITERATION && !P::DATA_READS
}

/// The cycle up to which everything that the loop that ends at `end` reads keeps its value, from the cycle
/// `at` on.
fn loop_steady_until<E: CpuEngine>(cpu: &E, end: u32, at: u64) -> u64 {
    let registers_read = cpu.loop_plan(end).map_or(&[][..], |plan| &plan.registers_read);
    registers_read.iter().map(|&reg| cpu.bus().steady_until(reg, at)).min().unwrap_or(NEVER)
}

/// The counter value of the loop that ends at `end`, if it is a countdown loop.
fn loop_counter<E: CpuEngine>(cpu: &E, end: u32) -> Option<u64> {
    let bytes = &cpu.loop_plan(end).filter(|plan| !plan.counter.is_empty())?.counter;
    Some(bytes.iter().rev().fold(0, |high, &number| high << 8 | u64::from(cpu.counter_byte(number))))
}

/// Sets the counter of the countdown loop that ends at `end`.
fn set_loop_counter<E: CpuEngine>(cpu: &mut E, end: u32, value: u64) {
    for (i, byte) in value.to_le_bytes().into_iter().enumerate() {
        let Some(&number) = cpu.loop_plan(end).and_then(|plan| plan.counter.get(i)) else { return };
        cpu.set_counter_byte(number, byte);
    }
}

/// Advances the clock by as many iterations as fit before the cycle `limit`, each equal to the one that began
/// at the cycle `start` and has just ended.
fn repeat_iterations<E: CpuEngine>(cpu: &mut E, limit: u64, start: u64, instructions_before: u64) {
    let now = cpu.cycle();
    cpu.clock_mut().repeat_iterations(limit.saturating_sub(now) / (now - start), start, instructions_before);
}

/// The program words of the first instruction of a loop and of the jump at its end.
#[derive(Clone, Copy)]
struct LoopSpan {
    head: u32,
    end: u32,
}

/// Skips iterations of the polling loop that ends with the jump at `end`, if the jump was taken and the
/// program is at the head of the loop. It runs one iteration. If that leaves the core unchanged, it skips all
/// whole iterations during which nothing can change. It stops early at the deadline, at a breakpoint, or
/// where the program leaves the loop. If the loop clears the watchdog, the last iteration is executed,
/// because its effect is that of all the skipped ones.
fn skip_iterations<E: CpuEngine, P: Probe>(cpu: &mut E, end: u32, deadline: u64, nothing_due: bool, probe: &mut P) {
    let Some(head) = cpu.loop_plan(end).map(|plan| plan.head).filter(|&head| head == cpu.pc()) else { return };
    let span = LoopSpan { head, end };
    if let Some(iterations_left) = loop_counter(cpu, end) {
        skip_counted_iterations(cpu, span, iterations_left, deadline, probe);
        return;
    }
    let (start, instructions_before, state_before) = (cpu.cycle(), cpu.instructions(), cpu.core_state());
    let steady_until = loop_steady_until(cpu, end, start);
    if steady_until.min(deadline).saturating_sub(start) < MIN_QUIET_CYCLES {
        cpu.run_state().no_skip_before = start + RETRY_AFTER_CYCLES;
        return;
    }
    if !run_iteration(cpu, span, deadline, probe) {
        return;
    }
    let now = cpu.cycle();
    // A register that is steady only up to now may give another value in the next iteration.
    if cpu.pc() == head && cpu.core_state() == state_before && now < steady_until {
        let steady_until = loop_steady_until(cpu, end, now);
        cpu.run_state().is_blocked |= nothing_due && steady_until == NEVER;
        let limit = steady_until.min(deadline);
        if cpu.loop_plan(end).is_some_and(|plan| plan.clears_watchdog) {
            repeat_iterations(cpu, limit.saturating_sub(now - start), start, instructions_before);
            run_iteration(cpu, span, deadline, probe);
        } else {
            repeat_iterations(cpu, limit, start, instructions_before);
        }
    }
}

/// Skips iterations of a loop that counts down to zero and has `iterations_left`, from the head of the loop.
/// It runs one iteration. Then it skips all but the last two, or as many as fit before the deadline. Then it
/// runs one more iteration, which sets the flags as all skipped ones would have.
fn skip_counted_iterations<E: CpuEngine, P: Probe>(
    cpu: &mut E,
    span: LoopSpan,
    iterations_left: u64,
    deadline: u64,
    probe: &mut P,
) {
    let (start, instructions_before) = (cpu.cycle(), cpu.instructions());
    // The counter can be in memory: then a probe of writes needs every iteration. A loop with few iterations
    // left, or a near deadline, saves less time than the attempt costs.
    if P::DATA || iterations_left.min(deadline.saturating_sub(start)) < MIN_QUIET_CYCLES {
        cpu.run_state().no_skip_before = start + RETRY_AFTER_CYCLES;
        return;
    }
    if !run_iteration(cpu, span, deadline, probe) || cpu.pc() != span.head {
        return;
    }
    let iteration_cycles = cpu.cycle() - start;
    let iterations_that_fit = (deadline.saturating_sub(cpu.cycle()) / iteration_cycles).saturating_sub(1);
    if let Some(counter) = loop_counter(cpu, span.end).filter(|&counter| counter + 1 == iterations_left) {
        let skipped = iterations_that_fit.min(counter.saturating_sub(2));
        set_loop_counter(cpu, span.end, counter - skipped);
        cpu.clock_mut().repeat_iterations(skipped, start, instructions_before);
        run_iteration(cpu, span, deadline, probe);
    }
}

/// Runs one iteration from the head of the loop to the end of its last jump. Returns false if it stops
/// earlier.
fn run_iteration<E: CpuEngine, P: Probe>(cpu: &mut E, span: LoopSpan, deadline: u64, probe: &mut P) -> bool {
    loop {
        let pc = cpu.pc();
        // A loop inside the loop is examined on its own.
        let is_inner_loop = pc != span.end && cpu.instruction_mark(pc) != InstructionMark::Plain;
        if cpu.cycle() >= deadline || cpu.has_breakpoint(pc) || is_inner_loop || !(span.head..=span.end).contains(&pc) {
            return false;
        }
        if P::INSN && probe.on_instruction(cpu.cycle(), pc) {
            *cpu.stop_requested() = true;
            return false;
        }
        if cpu.execute_single(pc, probe).is_err() {
            return false;
        }
        if pc == span.end {
            return true;
        }
    }
}
