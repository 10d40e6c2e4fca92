//! The loop around every hot loop: what happens between two instructions. Due events, resets, interrupts, sleep, stops, traps,
//! and loops of the program that only wait, which are jumped over.
//!
//! A family gives its machine as an [`CpuEngine`] and calls [`run`] and [`step_until`]; its own burst executes instructions up to the
//! deadline that is set here.

use crate::countdown::Countdown;
use crate::cpu::{Cpu, LAST_CYCLE, NEVER, Probe, ResetCause, StopReason};
use crate::pins::{ChipEvent, CycleTime};

/// Cycles of peace from which on it is worth to look for turns to jump over.
const MIN_QUIET_CYCLES: u64 = 64;

/// Cycles in which loops are not looked at after a look that was not worth it, so that short waits cost no more than they do
/// without any looking.
const RETRY_AFTER_CYCLES: u64 = 1024;

/// How a machine is run. Says nothing of the machine itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunState {
    /// The trap that stopped the last run, to be stepped over by the next.
    pub breakpoint_to_pass: Option<u32>,
    /// Loops that only look are jumped over,
    pub skip_idle_loops: bool,
    /// but not before this cycle.
    pub no_skip_before: u64,
    /// Time passes up to the limit of a run, whatever can wake the chip.
    pub run_while_halted: bool,
    /// It was met sleeping, or in a loop that only looks, when nothing was due any more.
    pub is_blocked: bool,
}

impl RunState {
    /// At first: loops are jumped over.
    pub const START: RunState = RunState {
        breakpoint_to_pass: None,
        skip_idle_loops: true,
        no_skip_before: 0,
        run_while_halted: false,
        is_blocked: false,
    };
}

/// What predecode has found an instruction to be, besides what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InstructionMark {
    /// Nothing else.
    Plain,
    /// A jump to itself, which changes nothing and looks at nothing.
    JumpsToItself,
    /// It closes a loop that only looks.
    ClosesLoop,
}

/// A machine as the loop sees it.
pub trait CpuEngine: Cpu {
    /// What the core holds and a waiting loop may change: a turn that leaves it as it was is followed by one just like it.
    type CoreState: PartialEq;

    /// The clock of the hot state.
    fn clock(&mut self) -> &mut Countdown;
    /// The probe has asked for a stop.
    fn stop_requested(&mut self) -> &mut bool;
    /// The burst has met an op without a body.
    fn slow_path_requested(&mut self) -> &mut bool;
    /// How the machine is run.
    fn run_state(&mut self) -> &mut RunState;

    /// Runs what is due in the chip up to the machine cycle `now`; returns the next deadline.
    fn fire(&mut self, now: u64) -> u64;
    /// Logs events from now on, or does not.
    fn set_event_log(&mut self, on: bool);
    /// Takes the oldest logged event.
    fn next_event(&mut self) -> Option<ChipEvent>;
    /// The chip asks to be reset.
    fn requested_reset(&mut self) -> Option<ResetCause>;
    /// Does what else the chip asks of the core between two instructions. True when that has taken time.
    fn apply_request(&mut self) -> bool {
        false
    }
    /// The boundary at the cycle `now` takes no interrupt, because of the instruction before it.
    fn holds_interrupts(&self, now: u64) -> bool {
        let _ = now;
        false
    }
    /// An interrupt would be taken at the cycle `now`.
    fn has_pending_interrupt(&self, now: u64) -> bool;
    /// Enters the pending interrupt, if there is one.
    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool;
    /// The core stands still until something wakes it.
    fn is_core_asleep(&self) -> bool;
    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn is_halted(&self) -> bool;

    /// A trap stands at `pc`.
    fn has_breakpoint(&self, pc: u32) -> bool;
    /// What predecode has found the instruction at `pc` to be.
    fn instruction_mark(&self, pc: u32) -> InstructionMark;
    /// The head of the loop that only looks and is closed by the instruction at `end`.
    fn loop_head(&self, end: u32) -> Option<u32>;
    /// The cycle up to which everything that this loop looks at keeps its value from the cycle `at` on.
    fn loop_steady_until(&self, end: u32, at: u64) -> u64;
    /// The loop that only looks and is closed by the instruction at `end` clears the watchdog: how long ago its last turn did counts,
    /// and no turn before it.
    fn loop_clears_watchdog(&self, end: u32) -> bool;
    /// What the counter holds of the loop that is closed by the instruction at `end` and does nothing but count down to zero, one a
    /// turn; none for other loops.
    fn loop_counter(&self, end: u32) -> Option<u64>;
    /// Lets that counter hold another value.
    fn set_loop_counter(&mut self, end: u32, value: u64);
    /// What the core holds.
    fn core_state(&self) -> Self::CoreState;

    /// Executes instructions up to the deadline; `looks`: stops at loops that only look, not just at jumps to themselves.
    fn burst<P: Probe>(&mut self, stop_at_polling_loops: bool, probe: &mut P);
    /// Executes the instruction at `pc`, the program counter, whatever marks it bears.
    ///
    /// # Errors
    /// Why it cannot be executed.
    fn execute_single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), StopReason>;
}

/// Runs to the machine cycle `until`, or until something stops the run ([`Cpu::run`]).
pub fn run<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> StopReason {
    let until = until.min(LAST_CYCLE);
    cpu.set_event_log(P::EVENTS);
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

/// Executes one instruction or one interrupt entry, or sleeps on to what is due next, up to `until` ([`Cpu::step_until`]).
pub fn step_until<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> StopReason {
    let now = cpu.cycle();
    let next = cpu.fire(now);
    // Where an interrupt is there already, or nothing is ever due and nobody says how far, one cycle.
    let sleeps = cpu.is_core_asleep() && !cpu.has_pending_interrupt(now) && next.min(until) < LAST_CYCLE;
    run(cpu, if sleeps { next.min(until).max(now + 1) } else { now + 1 }, probe)
}

/// Only something from outside can still change what the program does, though it does not count as halted: nothing is due, and it
/// sleeps, or goes round in a loop that only looks, or will within some [`RETRY_AFTER_CYCLES`] cycles ([`Cpu::is_blocked_on_input`]).
pub fn is_blocked_on_input<E: CpuEngine>(cpu: &mut E) -> bool {
    let now = cpu.cycle();
    if cpu.fire(now) != NEVER {
        return false;
    }
    *cpu.run_state() = RunState::START;
    run(cpu, now.saturating_add(2 * RETRY_AFTER_CYCLES), &mut ()) == StopReason::Limit && cpu.run_state().is_blocked
}

/// Runs everything due at this instruction boundary and sets the next deadline. Returns why to stop, if so.
///
/// Every case either stops, or leaves at least one cycle to the deadline for the next burst, or goes round again.
fn handle_boundary<E: CpuEngine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> Option<StopReason> {
    loop {
        let now = cpu.cycle();
        let next = cpu.fire(now);
        if P::EVENTS {
            while let Some(event) = cpu.next_event() {
                *cpu.stop_requested() |= probe.on_event(event);
            }
        }
        if let Some(why) = cpu.requested_reset() {
            let (stop, before) = (*cpu.stop_requested(), cpu.pc());
            cpu.reset(why);
            *cpu.stop_requested() =
                stop | (P::EVENTS && probe.on_event(ChipEvent::Reset { at: CycleTime::at(now), cause: why }));
            report_jump(cpu, before, probe);
            continue;
        }
        if std::mem::take(cpu.stop_requested()) {
            return Some(StopReason::Probe);
        }
        if now >= until {
            return Some(StopReason::Limit);
        }
        let before = cpu.pc();
        if cpu.apply_request() {
            report_jump(cpu, before, probe);
            continue;
        }
        if !cpu.holds_interrupts(now) && cpu.enter_interrupt(now, probe) {
            report_jump(cpu, before, probe);
            cpu.run_state().breakpoint_to_pass = None;
            *cpu.slow_path_requested() = false;
            cpu.clock().expire();
            continue;
        }
        if cpu.is_core_asleep() {
            if !cpu.run_state().run_while_halted && cpu.is_halted() {
                return Some(StopReason::Halted);
            }
            cpu.run_state().is_blocked |= next == NEVER && !cpu.has_pending_interrupt(now);
            // The deadline of this cycle has been served; the interrupt, if any, was not enabled.
            let clock = cpu.clock();
            clock.advance_cycles(next.min(until).max(now + 1) - now);
            clock.expire();
            continue;
        }
        // Hold-off lasts for one instruction: look again right after it.
        let deadline = if cpu.holds_interrupts(now) { now + 1 } else { next.min(until).max(now + 1) };
        let no_skip_before = cpu.run_state().no_skip_before;
        let retry_deadline = if no_skip_before > now { no_skip_before } else { NEVER };
        cpu.clock().set_deadline(deadline.min(retry_deadline));
        if std::mem::take(cpu.slow_path_requested()) {
            let idle = next == NEVER && !cpu.has_pending_interrupt(now);
            if let Some(stop) = slow_path(cpu, deadline, idle, probe) {
                return Some(stop);
            }
            continue;
        }
        return None;
    }
}

/// The program counter was `before`, and no instruction has moved it from there.
fn report_jump<E: CpuEngine, P: Probe>(cpu: &E, before: u32, probe: &mut P) {
    if P::FLOW {
        probe.on_flow_end(before);
        probe.on_flow_start(cpu.pc());
    }
}

/// The op at the program counter has no body of its own. `deadline` is the cycle up to which it may run; `idle`: nothing is due, and
/// no interrupt is there.
fn slow_path<E: CpuEngine, P: Probe>(cpu: &mut E, deadline: u64, idle: bool, probe: &mut P) -> Option<StopReason> {
    let pc = cpu.pc();
    let trap = cpu.has_breakpoint(pc);
    if trap && cpu.run_state().breakpoint_to_pass != Some(pc) {
        cpu.run_state().breakpoint_to_pass = Some(pc);
        return Some(StopReason::Breakpoint { pc });
    }
    cpu.run_state().breakpoint_to_pass = None;
    if P::INSN && trap && probe.on_instruction(cpu.cycle(), pc) {
        cpu.run_state().breakpoint_to_pass = Some(pc);
        return Some(StopReason::Probe);
    }
    let (start, instructions_before) = (cpu.cycle(), cpu.instructions());
    if let Err(stop) = cpu.execute_single(pc, probe) {
        return Some(stop);
    }
    match cpu.instruction_mark(pc) {
        InstructionMark::JumpsToItself if !trap && cpu.pc() == pc => {
            // Every turn is like this one.
            if !cpu.run_state().run_while_halted && cpu.is_halted() {
                return Some(StopReason::Halted);
            }
            cpu.run_state().is_blocked |= idle;
            if cpu.run_state().skip_idle_loops && !P::EVERY_ITERATION {
                repeat_iterations(cpu, deadline, start, instructions_before);
            }
        }
        InstructionMark::ClosesLoop if !trap && may_skip_loops::<E, P>(cpu) => {
            skip_iterations(cpu, pc, deadline, idle, probe)
        }
        _ => {}
    }
    cpu.clock().expire();
    None
}

/// True when loops that only look may be jumped over: the probe wants to see every turn of none.
fn may_skip_loops<E: CpuEngine, P: Probe>(cpu: &mut E) -> bool {
    cpu.run_state().skip_idle_loops && !P::EVERY_ITERATION && !P::DATA_READS
}

/// Adds whole turns like the one that began at the cycle `start`, up to `limit`.
fn repeat_iterations<E: CpuEngine>(cpu: &mut E, limit: u64, start: u64, instructions_before: u64) {
    let now = cpu.cycle();
    cpu.clock().repeat_iterations(limit.saturating_sub(now) / (now - start), start, instructions_before);
}

/// At the head of the loop that only looks and is closed by the jump at `end`, if the jump was taken: runs one turn, and if it
/// leaves the core as it was, jumps over as many whole turns as nothing can change in. Stops early at the deadline, at a
/// trap, or where the loop is left. Where the watchdog is cleared, the last turn is run: it leaves what all before it would have.
fn skip_iterations<E: CpuEngine, P: Probe>(cpu: &mut E, end: u32, deadline: u64, idle: bool, probe: &mut P) {
    let Some(head) = cpu.loop_head(end).filter(|&head| head == cpu.pc()) else { return };
    if let Some(left) = cpu.loop_counter(end) {
        skip_counted_iterations(cpu, (head, end), left, deadline, probe);
        return;
    }
    let (start, counted, before) = (cpu.cycle(), cpu.instructions(), cpu.core_state());
    let stable_until = cpu.loop_steady_until(end, start);
    if stable_until.min(deadline).saturating_sub(start) < MIN_QUIET_CYCLES {
        cpu.run_state().no_skip_before = start + RETRY_AFTER_CYCLES;
        return;
    }
    if !run_iteration(cpu, (head, end), deadline, probe) {
        return;
    }
    let now = cpu.cycle();
    // A promise that ends now was good for this turn and says nothing of the next.
    if cpu.pc() == head && cpu.core_state() == before && now < stable_until {
        let promised = cpu.loop_steady_until(end, now);
        cpu.run_state().is_blocked |= idle && promised == NEVER;
        let limit = promised.min(deadline);
        if cpu.loop_clears_watchdog(end) {
            repeat_iterations(cpu, limit.saturating_sub(now - start), start, counted);
            run_iteration(cpu, (head, end), deadline, probe);
        } else {
            repeat_iterations(cpu, limit, start, counted);
        }
    }
}

/// At the head of a loop that counts down to zero, with so many turns left: runs one, jumps over all but the last two or as many as
/// the deadline leaves room for, and runs one more, which leaves the flags that all before it would have.
fn skip_counted_iterations<E: CpuEngine, P: Probe>(
    cpu: &mut E,
    (head, end): (u32, u32),
    iterations_left: u64,
    deadline: u64,
    probe: &mut P,
) {
    let (start, counted) = (cpu.cycle(), cpu.instructions());
    // A probe that is told of writes sees the counter's, which may lie in memory.
    if P::DATA || iterations_left.min(deadline.saturating_sub(start)) < MIN_QUIET_CYCLES {
        cpu.run_state().no_skip_before = start + RETRY_AFTER_CYCLES;
        return;
    }
    if !run_iteration(cpu, (head, end), deadline, probe) || cpu.pc() != head {
        return;
    }
    let iteration_cycles = cpu.cycle() - start;
    let iterations_that_fit = (deadline.saturating_sub(cpu.cycle()) / iteration_cycles).saturating_sub(1);
    if let Some(now) = cpu.loop_counter(end).filter(|&now| now + 1 == iterations_left) {
        let skipped = iterations_that_fit.min(now.saturating_sub(2));
        cpu.set_loop_counter(end, now - skipped);
        cpu.clock().repeat_iterations(skipped, start, counted);
        run_iteration(cpu, (head, end), deadline, probe);
    }
}

/// Runs the turn of a loop that begins at its head, up to behind the jump at its end; false where it stops before.
fn run_iteration<E: CpuEngine, P: Probe>(cpu: &mut E, (head, end): (u32, u32), deadline: u64, probe: &mut P) -> bool {
    loop {
        let pc = cpu.pc();
        // A loop within the loop is looked at for itself.
        let is_inner_loop = pc != end && cpu.instruction_mark(pc) != InstructionMark::Plain;
        if cpu.cycle() >= deadline || cpu.has_breakpoint(pc) || is_inner_loop || !(head..=end).contains(&pc) {
            return false;
        }
        if P::INSN && probe.on_instruction(cpu.cycle(), pc) {
            *cpu.stop_requested() = true;
            return false;
        }
        if cpu.execute_single(pc, probe).is_err() {
            return false;
        }
        if pc == end {
            return true;
        }
    }
}
