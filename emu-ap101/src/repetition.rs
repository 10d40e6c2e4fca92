//! Detects machines that have settled: their program cycles repeat.
//!
//! The program of a controller never ends, but without changes from outside it mostly settles. From time to
//! time, at the start of a program cycle, the detector keeps a copy of everything on which the next program
//! cycle depends. If one of the following program cycles starts with the same state, and no output has
//! changed in between, everything that follows repeats what happened between the two.

use std::sync::Arc;

use emu_core::NEVER;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use crate::cpu::Ap101;
use crate::modules::Ap101Module;
use crate::operands::CELL_COUNT;
use crate::program_cycle::ProgramPhase;

/// Quiet cycles before the first check, and after the first check without success; each further one doubles
/// the pause.
const FIRST_PAUSE_CYCLES: u64 = 1024;

/// Maximum pause in cycles.
const MAX_PAUSE_CYCLES: u64 = 1 << 16;

/// Number of program cycles with which a copy is compared: enough for two turns of all programs of the table.
const COMPARED_CYCLES: u32 = 16;

/// What the next program cycle depends on, in addition to pins, outputs and presets.
#[derive(Debug, Clone)]
struct ProgramCycleState {
    current: Option<usize>,
    a: bool,
    cells: [bool; CELL_COUNT],
    modules: Vec<Ap101Module>,
    /// The time of the copy, and the counts at that time.
    cycle: u64,
    instructions: u64,
    overruns: u16,
}

/// The period of a repetition: its cycles, instructions and overruns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RepeatedCycles {
    cycles: u64,
    instructions: u64,
    overruns: u16,
}

/// What is known about a machine.
#[derive(Debug, Clone)]
enum RepetitionState {
    Unknown,
    /// A copy, and the number of further comparisons with it.
    Comparing(Arc<ProgramCycleState>, u32),
    /// The machine has settled.
    Repeats(RepeatedCycles),
}

/// Detects repetition. Its checks are at cycles that depend only on the history of the machine, so that any
/// way of running it halts in the same cycle.
#[derive(Debug, Clone)]
pub(crate) struct RepetitionDetector {
    /// The cycle of the next check.
    next_check: u64,
    pause_cycles: u64,
    state: RepetitionState,
}

/// The state of the detector is saved, because it determines when a machine halts.
impl Ap101 {
    /// Saves or restores the state of the detector.
    pub(crate) fn pass_repetition_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let (now, counted) = (self.core.clock.now(), self.core.clock.instructions());
        self.repetition.next_check.pass_state(tape)?;
        self.repetition.pause_cycles.pass_state(tape)?;
        tape.require(self.repetition.next_check != NEVER && self.repetition.pause_cycles <= MAX_PAUSE_CYCLES)?;
        let tag = tape.pass_byte(match self.repetition.state {
            RepetitionState::Unknown => 0,
            RepetitionState::Comparing(..) => 1,
            RepetitionState::Repeats(_) => 2,
        })?;
        self.repetition.state = match (tag, self.repetition.state.clone()) {
            (0, _) => RepetitionState::Unknown,
            (1, known) => {
                let (mut compared_state, mut left) = match known {
                    RepetitionState::Comparing(compared_state, left) => {
                        (ProgramCycleState::clone(&compared_state), left)
                    }
                    _ => (self.program_cycle_state(now), COMPARED_CYCLES),
                };
                let ProgramCycleState { current, a, cells, modules, cycle, instructions, overruns } =
                    &mut compared_state;
                current.pass_state(tape)?;
                a.pass_state(tape)?;
                cells.pass_state(tape)?;
                tape.pass_slice(modules)?;
                cycle.pass_state(tape)?;
                instructions.pass_state(tape)?;
                overruns.pass_state(tape)?;
                left.pass_state(tape)?;
                // A period takes time: the program cycle that began with this copy is still running, or the
                // copy is older.
                let runs = matches!(self.phase, ProgramPhase::Run { .. }) && !self.is_at_program_end();
                tape.require(*cycle < now || *cycle == now && (runs || self.repetition.next_check > now))?;
                tape.require(*instructions <= counted && *overruns <= self.overruns)?;
                RepetitionState::Comparing(Arc::new(compared_state), left)
            }
            (2, known) => {
                let mut round = match known {
                    RepetitionState::Repeats(round) => round,
                    _ => RepeatedCycles { cycles: 0, instructions: 0, overruns: 0 },
                };
                round.cycles.pass_state(tape)?;
                round.instructions.pass_state(tape)?;
                round.overruns.pass_state(tape)?;
                tape.require((1..=now).contains(&round.cycles) && round.instructions <= counted)?;
                RepetitionState::Repeats(round)
            }
            _ => return Err(SnapshotDamaged),
        };
        Ok(())
    }
}

impl RepetitionDetector {
    /// The initial state.
    pub(crate) const START: RepetitionDetector = RepetitionDetector {
        next_check: FIRST_PAUSE_CYCLES,
        pause_cycles: FIRST_PAUSE_CYCLES,
        state: RepetitionState::Unknown,
    };
}

impl Ap101 {
    /// Restarts the detection: something from outside has changed the machine.
    pub(crate) fn forget_repetition(&mut self) {
        let RepetitionDetector { next_check: at, pause_cycles: blind, state: known } = &mut self.repetition;
        (*at, *blind, *known) =
            (self.core.clock.now() + FIRST_PAUSE_CYCLES, FIRST_PAUSE_CYCLES, RepetitionState::Unknown);
    }

    /// Returns the repetition if the machine has settled. It must be called when a program cycle is about to
    /// begin.
    #[inline]
    pub(crate) fn repeated_cycles(&mut self, now: u64) -> Option<RepeatedCycles> {
        match self.repetition.state {
            RepetitionState::Repeats(round) => Some(round),
            _ if now < self.repetition.next_check => None,
            _ => {
                let found = self.check_repetition(now);
                // A run that stops here calls this function again at the same cycle.
                self.repetition.next_check = self.repetition.next_check.max(now + 1);
                found
            }
        }
    }

    #[cold]
    fn check_repetition(&mut self, now: u64) -> Option<RepeatedCycles> {
        self.repetition.state = match std::mem::replace(&mut self.repetition.state, RepetitionState::Unknown) {
            RepetitionState::Repeats(round) => RepetitionState::Repeats(round),
            RepetitionState::Unknown => {
                self.soc.has_changed = false;
                RepetitionState::Comparing(Arc::new(self.program_cycle_state(now)), COMPARED_CYCLES)
            }
            RepetitionState::Comparing(compared_state, _)
                if !self.soc.has_changed && self.equals_state(&compared_state, now) =>
            {
                RepetitionState::Repeats(RepeatedCycles {
                    cycles: now - compared_state.cycle,
                    instructions: self.core.clock.instructions() - compared_state.instructions,
                    overruns: self.overruns - compared_state.overruns,
                })
            }
            RepetitionState::Comparing(compared_state, left @ 2..) if !self.soc.has_changed => {
                RepetitionState::Comparing(compared_state, left - 1)
            }
            RepetitionState::Comparing(..) => {
                self.repetition.next_check = now + self.repetition.pause_cycles;
                self.repetition.pause_cycles = (2 * self.repetition.pause_cycles).min(MAX_PAUSE_CYCLES);
                RepetitionState::Unknown
            }
        };
        match self.repetition.state {
            RepetitionState::Repeats(round) => Some(round),
            _ => None,
        }
    }

    fn program_cycle_state(&self, now: u64) -> ProgramCycleState {
        ProgramCycleState {
            current: self.running_program,
            a: self.core.a,
            cells: self.soc.channels.cells,
            modules: self.soc.modules.existing().cloned().collect(),
            cycle: now,
            instructions: self.core.clock.instructions(),
            overruns: self.overruns,
        }
    }

    fn equals_state(&self, compared_state: &ProgramCycleState, now: u64) -> bool {
        compared_state.current == self.running_program
            && compared_state.a == self.core.a
            && compared_state.cells == self.soc.channels.cells
            && self
                .soc
                .modules
                .existing()
                .zip(&compared_state.modules)
                .all(|(module, before)| module.repeats_as(now, before, compared_state.cycle))
    }

    /// Whether nothing at all changes any more while `round` repeats; otherwise overruns are still counted.
    pub(crate) const fn has_no_more_overruns(&self, round: RepeatedCycles) -> bool {
        round.overruns == 0 || self.overruns == u16::MAX
    }

    /// Skips whole periods, up to before the cycle `to`, at which something else is due. Returns false if
    /// there is no room for one.
    pub(crate) fn skip_repetitions(&mut self, round: RepeatedCycles, to: u64) -> bool {
        let (now, counted) = (self.core.clock.now(), self.core.clock.instructions());
        // OVR saturates at its maximum. A period in which it can reach the maximum is not skipped.
        let uncounted = u64::from(u16::MAX - self.overruns).saturating_sub(1);
        let most = if self.has_no_more_overruns(round) { u64::MAX } else { uncounted / u64::from(round.overruns) };
        let turns = (to.saturating_sub(now + 1) / round.cycles.max(1)).min(most);
        self.core.clock.repeat_iterations(turns, now - round.cycles, counted - round.instructions);
        self.soc.modules.shift_time(now - round.cycles, turns * round.cycles);
        let overruns = u16::try_from(turns.saturating_mul(round.overruns.into())).unwrap_or(u16::MAX);
        self.overruns = self.overruns.saturating_add(overruns);
        turns > 0
    }
}
