//! Machines that have settled: program cycles of which one is like the other.
//!
//! A controller's program never ends, but where nothing comes from outside it mostly comes to rest. Now and then a copy is kept of all
//! that the next program cycle depends on, as one begins; when one of the following begins with just the same, and no output has
//! moved on the way, all that follows repeats what lies between the two.

use std::sync::Arc;

use emu_core::NEVER;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use crate::cpu::Ap101;
use crate::modules::Ap101Module;
use crate::operands::CELL_COUNT;
use crate::program_cycle::ProgramPhase;

/// Cycles of peace before the first look, and after one that was in vain; after each further one twice as many,
const FIRST_PAUSE_CYCLES: u64 = 1024;

/// up to this many.
const MAX_PAUSE_CYCLES: u64 = 1 << 16;

/// Program cycles that a copy is compared with: all programs of the table can have two turns.
const COMPARED_CYCLES: u32 = 16;

/// What the next program cycle depends on, besides what stands on pins, outputs and presets.
#[derive(Debug, Clone)]
struct ProgramCycleState {
    current: Option<usize>,
    a: bool,
    cells: [bool; CELL_COUNT],
    modules: Vec<Ap101Module>,
    /// When that was, and what was counted then.
    cycle: u64,
    instructions: u64,
    overruns: u16,
}

/// What repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RepeatedCycles {
    cycles: u64,
    instructions: u64,
    overruns: u16,
}

/// What is known of a machine.
#[derive(Debug, Clone)]
enum RepetitionState {
    Unknown,
    /// It was like this; it is compared as often again.
    Comparing(Arc<ProgramCycleState>, u32),
    /// It has settled.
    Repeats(RepeatedCycles),
}

/// Looks at a machine. They come at cycles that depend on nothing but what the machine has gone through, so that any way of running
/// it halts it in the same cycle.
#[derive(Debug, Clone)]
pub(crate) struct RepetitionDetector {
    /// Rounds are jumped over.
    pub skip_idle_loops: bool,
    /// Time passes up to the limit of a run, also where the machine has settled.
    pub run_while_halted: bool,
    /// No look before this cycle.
    next_check: u64,
    pause_cycles: u64,
    state: RepetitionState,
}

/// When a machine halts hangs on when it was looked at.
impl Ap101 {
    /// What is known of how it repeats itself.
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
                let (mut held, mut left) = match known {
                    RepetitionState::Comparing(held, left) => (ProgramCycleState::clone(&held), left),
                    _ => (self.program_cycle_state(now), COMPARED_CYCLES),
                };
                let ProgramCycleState { current, a, cells, modules, cycle, instructions, overruns } = &mut held;
                current.pass_state(tape)?;
                a.pass_state(tape)?;
                cells.pass_state(tape)?;
                tape.pass_slice(modules)?;
                cycle.pass_state(tape)?;
                instructions.pass_state(tape)?;
                overruns.pass_state(tape)?;
                left.pass_state(tape)?;
                // A round takes time: the cycle that begins with this copy is not over yet, or that was before.
                let runs = matches!(self.phase, ProgramPhase::Run { .. }) && !self.is_at_program_end();
                tape.require(*cycle < now || *cycle == now && (runs || self.repetition.next_check > now))?;
                tape.require(*instructions <= counted && *overruns <= self.overruns)?;
                RepetitionState::Comparing(Arc::new(held), left)
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
    /// At first.
    pub(crate) const START: RepetitionDetector = RepetitionDetector {
        skip_idle_loops: true,
        run_while_halted: false,
        next_check: FIRST_PAUSE_CYCLES,
        pause_cycles: FIRST_PAUSE_CYCLES,
        state: RepetitionState::Unknown,
    };
}

impl Ap101 {
    /// Something from outside has touched the machine.
    pub(crate) fn forget_repetition(&mut self) {
        let RepetitionDetector { next_check: at, pause_cycles: blind, state: known, .. } = &mut self.repetition;
        (*at, *blind, *known) =
            (self.core.clock.now() + FIRST_PAUSE_CYCLES, FIRST_PAUSE_CYCLES, RepetitionState::Unknown);
    }

    /// Called as a program cycle is about to begin: what repeats itself from now on, if the machine has settled.
    #[inline]
    pub(crate) fn repeated_cycles(&mut self, now: u64) -> Option<RepeatedCycles> {
        match self.repetition.state {
            RepetitionState::Repeats(round) => Some(round),
            _ if now < self.repetition.next_check => None,
            _ => {
                let found = self.check_repetition(now);
                // Who stops here comes by once more.
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
            RepetitionState::Comparing(held, _) if !self.soc.has_changed && self.equals_state(&held, now) => {
                RepetitionState::Repeats(RepeatedCycles {
                    cycles: now - held.cycle,
                    instructions: self.core.clock.instructions() - held.instructions,
                    overruns: self.overruns - held.overruns,
                })
            }
            RepetitionState::Comparing(held, left @ 2..) if !self.soc.has_changed => {
                RepetitionState::Comparing(held, left - 1)
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
            cells: self.soc.cells,
            modules: self.soc.existing_modules().cloned().collect(),
            cycle: now,
            instructions: self.core.clock.instructions(),
            overruns: self.overruns,
        }
    }

    fn equals_state(&self, held: &ProgramCycleState, now: u64) -> bool {
        held.current == self.running_program
            && held.a == self.core.a
            && held.cells == self.soc.cells
            && self
                .soc
                .existing_modules()
                .zip(&held.modules)
                .all(|(module, before)| module.repeats_as(now, before, held.cycle))
    }

    /// Nothing changes any more while `round` repeats itself; overruns may still have to be counted.
    pub(crate) const fn has_no_more_overruns(&self, round: RepeatedCycles) -> bool {
        round.overruns == 0 || self.overruns == u16::MAX
    }

    /// Jumps over whole rounds, to before the cycle `to`, at which there is more to do than to begin a round; false when there is no
    /// room for one.
    pub(crate) fn skip_repetitions(&mut self, round: RepeatedCycles, to: u64) -> bool {
        let (now, counted) = (self.core.clock.now(), self.core.clock.instructions());
        // OVR stays at its highest value: on the way there no round is left out in which it may be reached.
        let uncounted = u64::from(u16::MAX - self.overruns).saturating_sub(1);
        let most = if self.has_no_more_overruns(round) { u64::MAX } else { uncounted / u64::from(round.overruns) };
        let turns = (to.saturating_sub(now + 1) / round.cycles.max(1)).min(most);
        self.core.clock.repeat_iterations(turns, now - round.cycles, counted - round.instructions);
        for module in self.soc.modules.iter_mut() {
            module.shift_time(now - round.cycles, turns * round.cycles);
        }
        let overruns = u16::try_from(turns.saturating_mul(round.overruns.into())).unwrap_or(u16::MAX);
        self.overruns = self.overruns.saturating_add(overruns);
        turns > 0
    }
}
