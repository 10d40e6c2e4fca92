//! What happens between two instructions: supply, program cycles, the reload of outputs, pacing; and the loop
//! around the hot loop.
//!
//! ```text
//!   no supply --> reload --> ready --> program cycle --> reload --> ready --> ..
//!                 of all     until the period is over    of what the program
//!                 outputs    and a program is enabled    did not write
//! ```
//! Only the program cycle has instructions. The other phases pass in one step, up to what is due next.

use emu_core::bus::report_events;
use emu_core::cpu::{Bus, LAST_CYCLE, NEVER, Probe, ProgramError, ProgramFault, StopReason, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::CycleTime;

use crate::cpu::Ap101;
use crate::executor::{Executor, report_branch};
use crate::isa::{Ap101OpKind, SPAN, find_row};
use crate::predecode::ProgramFlow;
use crate::soc::CLOCKS;

/// Number of machine cycles after which the watchdog stops a program cycle.
pub(crate) const WATCHDOG_CYCLES: u64 = 65_536;

/// The phase of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ProgramPhase {
    /// The machine has no supply.
    NoSupply,
    /// Output channels are reloaded one by one, from the machine cycle `from` on. The period of the program
    /// cycle before ends at the cycle `due`, if it has a period.
    Reload { from: u64, due: Option<u64> },
    /// The next program cycle begins at this machine cycle, or later when a program is enabled.
    Ready { at: u64 },
    /// A program runs, in the program cycle that began at this machine cycle.
    Run { begun: u64 },
}

emu_core::state! { enum ProgramPhase { 0 = NoSupply, 1 = Reload { from, due }, 2 = Ready { at }, 3 = Run { begun } } }

/// Whether the probe needs more than the hot loop reports.
const fn needs_slow_path<P: Probe>() -> bool {
    P::EVERY_ITERATION || P::DATA || P::LINT || P::SUBCYCLE
}

impl Ap101 {
    /// Runs to a machine cycle, or until something stops the run. With `HALTS`, a machine whose program
    /// cycles repeat halts.
    pub(crate) fn run_to<P: Probe, const HALTS: bool>(&mut self, until: u64, probe: &mut P) -> StopReason {
        let until = until.min(LAST_CYCLE);
        let now = self.core.clock.now();
        self.soc.set_event_log(P::EVENTS, now);
        loop {
            let mut already_checked = false;
            if let Some(stop) = self.handle_boundary::<P, HALTS>(until, &mut already_checked, probe) {
                return stop;
            }
            if !needs_slow_path::<P>() && self.fetched_word.is_none() {
                self.burst(probe);
                if !self.core.clock.is_before_deadline() || self.is_at_program_end() {
                    continue;
                }
            }
            if let Some(stop) = self.execute_one(already_checked, probe) {
                // Drives that were applied before the stop are reported first.
                self.core.stop_requested |= report_events(&mut self.soc, probe);
                return stop;
            }
        }
    }

    /// Handles what is due between two instructions, and passes time in which there are none. Returns the
    /// reason for a stop, if there is one. Otherwise an instruction is next and the deadline is set;
    /// `already_checked` is set if that instruction was already checked for stops.
    fn handle_boundary<P: Probe, const HALTS: bool>(
        &mut self,
        until: u64,
        already_checked: &mut bool,
        probe: &mut P,
    ) -> Option<StopReason> {
        loop {
            self.core.clock.expire();
            let now = self.core.clock.now();
            let at_instruction_boundary = self.fetched_word.is_none();
            let mut next = None;
            if at_instruction_boundary {
                let due = self.soc.next();
                self.soc.fire(now);
                if self.soc.next() != due {
                    self.forget_repetition();
                }
                self.update_supply(now);
                self.end(now);
                self.finish_reload(now);
                if let Some(program_index) = self.next_program(now) {
                    self.core.next_address =
                        self.code.programs.get(program_index).map_or(0, |ops| ops.program.start.into());
                    // The repetition check runs here, so that it is independent of the reason for a stop.
                    next = Some((program_index, self.repeated_cycles(now)));
                }
            }
            self.core.stop_requested |= report_events(&mut self.soc, probe);
            if std::mem::take(&mut self.core.stop_requested) {
                return Some(StopReason::Probe);
            }
            if now >= until {
                return Some(StopReason::Limit);
            }
            if at_instruction_boundary {
                if let Some((program_index, repetition_cycles)) = next {
                    if let Some(repetition_cycles) = repetition_cycles.filter(|_| HALTS) {
                        let due = self.soc.next();
                        if !self.run_state.run_while_halted
                            && due == NEVER
                            && self.has_no_more_overruns(repetition_cycles)
                        {
                            return Some(StopReason::Halted);
                        }
                        let jumps =
                            self.run_state.skip_idle_loops && !needs_slow_path::<P>() && !self.code.has_breakpoints();
                        if jumps && self.skip_repetitions(repetition_cycles, until.min(due / CLOCKS)) {
                            continue;
                        }
                    }
                    // Inputs are latched after this point, so that a user who stops here can drive them at
                    // this cycle.
                    if needs_slow_path::<P>() || self.code.has_breakpoint(self.core.next_address) {
                        if let Some(stop) = self.stop_at_instruction(now, probe) {
                            return Some(stop);
                        }
                        *already_checked = true;
                    }
                    self.begin(now, program_index);
                }
                if matches!(self.phase, ProgramPhase::Run { begun } if now >= begun + WATCHDOG_CYCLES) {
                    return Some(StopReason::Error(ProgramError::Fault {
                        pc: self.core.next_address,
                        fault: ProgramFault::CycleTooLong,
                    }));
                }
            }
            // Inputs were latched at the first clock of the cycle. What is driven in the second clock is
            // visible to live inputs.
            let fired = self.soc.apply_drives(CLOCKS * now + CLOCKS - 1);
            if fired {
                self.forget_repetition();
            }
            let next = if fired { now + 1 } else { self.soc.next() / CLOCKS };
            let idle = !fired && self.soc.next() == NEVER;
            let end = match self.phase {
                ProgramPhase::Run { begun } => {
                    self.core.clock.set_deadline(until.min(next).min(begun + WATCHDOG_CYCLES).max(now + 1));
                    return None;
                }
                ProgramPhase::Reload { from, .. } => from + self.soc.channels.output_channel_count(),
                ProgramPhase::Ready { at } if now < at => at,
                ProgramPhase::NoSupply | ProgramPhase::Ready { .. } if idle && !self.run_state.run_while_halted => {
                    return Some(StopReason::Halted);
                }
                ProgramPhase::NoSupply | ProgramPhase::Ready { .. } => NEVER,
            };
            let to = until.min(next).min(end);
            if let ProgramPhase::Reload { from, .. } = self.phase {
                self.soc.reload(from, now, to);
            }
            self.core.clock.advance_cycles(to - now);
        }
    }

    /// Handles a supply that comes or goes, and a request for a cold start.
    fn update_supply(&mut self, now: u64) {
        let events = self.soc.take_supply_events();
        match (self.phase == ProgramPhase::NoSupply, self.soc.has_supply()) {
            (false, false) => {
                self.lose_supply(now);
                self.phase = ProgramPhase::NoSupply;
                self.soc.is_supplied = false;
            }
            (false, true) if events.was_lost => {
                let cold = self.soc.has_clear_request();
                self.start(cold);
            }
            (false, true) if events.cold_start_requested => self.start(true),
            (true, true) => {
                let cold = self.soc.has_clear_request();
                self.start(cold);
            }
            _ => {}
        }
    }

    /// Clears everything that is not protected.
    fn lose_supply(&mut self, now: u64) {
        self.soc.reset(now);
        (self.core.a, self.ric, self.fetched_word) = (false, 0, None);
    }

    /// The supply comes: M is kept, or cleared if `cold`, and all outputs are reloaded from their images.
    pub(crate) fn start(&mut self, cold: bool) {
        let now = self.core.clock.now();
        self.lose_supply(now);
        if cold {
            self.soc.channels.clear(&self.config);
        }
        (self.overruns, self.running_program, self.run_state.breakpoint_to_pass) = (0, None, None);
        self.forget_repetition();
        self.program_index = self.choose_program().unwrap_or(0);
        self.core.next_address = self.code.programs.get(self.program_index).map_or(0, |ops| ops.program.start.into());
        self.phase = ProgramPhase::Reload { from: now, due: None };
        self.soc.is_supplied = true;
    }

    /// Whether NA is after the last word of the running program.
    pub(crate) fn is_at_program_end(&self) -> bool {
        matches!(self.phase, ProgramPhase::Run { .. })
            && self.code.is_past_end(self.program_index, self.core.next_address)
    }

    /// Ends a program cycle that is complete at `now`.
    fn end(&mut self, now: u64) {
        if self.is_at_program_end() {
            self.end_program_cycle(now);
        }
        self.core.next_address %= SPAN as u32;
    }

    /// Ends the program cycle; its outputs are reloaded from `now` on.
    fn end_program_cycle(&mut self, now: u64) {
        if let ProgramPhase::Run { begun } = self.phase {
            let due = (self.config.period > 0).then_some(begun + self.config.period);
            self.phase = ProgramPhase::Reload { from: now, due };
        }
    }

    /// Ends a reload that is complete, and checks whether the period was exceeded.
    fn finish_reload(&mut self, now: u64) {
        if let ProgramPhase::Reload { from, due } = self.phase
            && now >= from + self.soc.channels.output_channel_count()
        {
            if due.is_some_and(|due| now > due) {
                self.overruns = self.overruns.saturating_add(1);
            }
            self.phase = ProgramPhase::Ready { at: due.unwrap_or(now).max(now) };
        }
    }

    /// The program whose program cycle begins now, if it is time and a program may run.
    fn next_program(&self, now: u64) -> Option<usize> {
        match self.phase {
            ProgramPhase::Ready { at } if now >= at => self.choose_program(),
            _ => None,
        }
    }

    /// Starts a program cycle.
    fn begin(&mut self, now: u64, program_index: usize) {
        (self.program_index, self.running_program) = (program_index, Some(program_index));
        self.soc.begin(now);
        self.phase = ProgramPhase::Run { begun: now };
    }

    /// The program that runs next: the next one in the order of the table that may run.
    fn choose_program(&self) -> Option<usize> {
        let programs = &self.code.programs;
        let first = self.running_program.map_or(0, |program_index| program_index + 1);
        let may = |program_index: usize| {
            let ops = programs.get(program_index)?;
            (!self.config.reconfigurable
                || self.config.programs.is_empty()
                || self.soc.channels.is_enabled(ops.program.entry))
            .then_some(program_index)
        };
        (0..programs.len()).find_map(|i| may((first + i) % programs.len()))
    }

    /// Runs instructions up to the deadline, or to one that needs the slow path.
    fn burst<P: Probe>(&mut self, probe: &mut P) {
        let Some(ops) = self.code.programs.get(self.program_index) else { return };
        let counted = self.core.clock.instructions();
        let executor = Executor { core: self.core, soc: &mut self.soc, code: &self.code, probe };
        self.core = executor.burst(&ops.ops);
        if self.core.clock.instructions() != counted {
            self.ric = self.code.word(self.core.last);
            self.run_state.breakpoint_to_pass = None;
        }
        if self.core.next_address == SPAN as u32 && !self.is_at_program_end() {
            self.core.next_address = 0;
        }
    }

    /// Checks for stops before the instruction at NA, at `now`. Returns the reason for a stop, if there is
    /// one.
    fn stop_at_instruction<P: Probe>(&mut self, now: u64, probe: &mut P) -> Option<StopReason> {
        let pc = self.core.next_address % SPAN as u32;
        if self.code.has_breakpoint(pc) && self.run_state.breakpoint_to_pass != Some(pc) {
            self.run_state.breakpoint_to_pass = Some(pc);
            return Some(StopReason::Breakpoint { pc });
        }
        (P::INSN && probe.on_instruction(now, pc)).then_some(StopReason::Probe)
    }

    /// Runs the instruction at NA, or its remaining subcycle, one subcycle at a time. With `already_checked`,
    /// the first instruction of a program cycle was already checked for stops.
    fn execute_one<P: Probe>(&mut self, already_checked: bool, probe: &mut P) -> Option<StopReason> {
        let now = self.core.clock.now();
        if self.fetched_word.is_none() {
            let pc = self.core.next_address % SPAN as u32;
            let already_checked = already_checked && matches!(self.phase, ProgramPhase::Run { begun } if begun == now);
            if !already_checked && let Some(stop) = self.stop_at_instruction(now, probe) {
                return Some(stop);
            }
            self.run_state.breakpoint_to_pass = None;
            let previous_ric = std::mem::replace(&mut self.ric, self.code.word(pc));
            self.fetched_word = Some(previous_ric);
            self.core.next_address = pc + 1;
            if P::SUBCYCLE && probe.on_subcycle(CycleTime { cycle: now, phase: 1 }, Subcycle::Fetch, pc, self.ric) {
                return Some(StopReason::Probe);
            }
        }
        let (pc, word) = (self.core.next_address.wrapping_sub(1) % SPAN as u32, self.ric);
        let previous_ric = self.fetched_word.take().unwrap_or(word);
        self.core.next_address = pc;
        let kind = find_row(word).kind;
        let taken = matches!(kind, Ap101OpKind::Jmp | Ap101OpKind::JmpX) || self.core.a;
        let flow = if taken { self.code.flow(self.program_index, word) } else { ProgramFlow::WithinProgram };
        if let ProgramFlow::LeavesProgram(target) = flow {
            self.ric = previous_ric;
            return Some(StopReason::Error(ProgramError::Fault {
                pc,
                fault: ProgramFault::JumpOutOfProgram { target },
            }));
        }
        if P::LINT && matches!(kind, Ap101OpKind::Not | Ap101OpKind::Clr) && word & 0xFFF != 0 {
            probe.on_lint(now, pc, Lint::UnusedFieldSet { word });
        }
        let op = self.code.op(self.program_index, word, false);
        self.core = Executor { core: self.core, soc: &mut self.soc, code: &self.code, probe }.single(op);
        report_branch(probe, pc, if flow == ProgramFlow::WithinProgram { self.core.next_address } else { 0 });
        if flow == ProgramFlow::EndsCycle {
            self.end_program_cycle(now + 1);
        }
        if P::SUBCYCLE {
            self.core.stop_requested |= probe.on_subcycle(CycleTime::at(now + 1), Subcycle::Execute, pc, word);
        }
        None
    }
}
