//! Machines that have settled: program cycles of which one is like the other.
//!
//! A controller's program never ends, but where nothing comes from outside it mostly comes to rest. Now and then a copy is kept of all
//! that the next program cycle depends on, as one begins; when one of the following begins with just the same, and no output has
//! moved on the way, all that follows repeats what lies between the two.

use std::sync::Arc;

use emu_core::NEVER;
use emu_core::state::{Damaged, State, Tape};

use crate::boundary::Phase;
use crate::cpu::Ap101;
use crate::modules::Module;
use crate::operands::CELLS;

/// Cycles of peace before the first look, and after one that was in vain; after each further one twice as many,
const BLIND: u64 = 1024;

/// up to this many.
const MOST_BLIND: u64 = 1 << 16;

/// Program cycles that a copy is compared with: all programs of the table can have two turns.
const TURNS: u32 = 16;

/// What the next program cycle depends on, besides what stands on pins, outputs and presets.
#[derive(Debug, Clone)]
struct Held {
    current: Option<usize>,
    a: bool,
    cells: [bool; CELLS],
    modules: Vec<Module>,
    /// When that was, and what was counted then.
    cycle: u64,
    instructions: u64,
    overruns: u16,
}

/// What repeats itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Round {
    cycles: u64,
    instructions: u64,
    overruns: u16,
}

/// What is known of a machine.
#[derive(Debug, Clone)]
enum Known {
    Nothing,
    /// It was like this; it is compared as often again.
    Was(Arc<Held>, u32),
    /// It has settled.
    Repeats(Round),
}

/// Looks at a machine. They come at cycles that depend on nothing but what the machine has gone through, so that any way of running
/// it halts it in the same cycle.
#[derive(Debug, Clone)]
pub(crate) struct Looks {
    /// Rounds are jumped over.
    pub skip: bool,
    /// Time passes up to the limit of a run, also where the machine has settled.
    pub insists: bool,
    /// No look before this cycle.
    at: u64,
    blind: u64,
    known: Known,
}

/// When a machine halts hangs on when it was looked at.
impl Ap101 {
    /// What is known of how it repeats itself.
    pub(crate) fn known_state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let (now, counted) = (self.hot.time.now(), self.hot.time.instructions());
        self.looks.at.state(tape)?;
        self.looks.blind.state(tape)?;
        tape.demand(self.looks.at != NEVER && self.looks.blind <= MOST_BLIND)?;
        let tag = tape.byte(match self.looks.known {
            Known::Nothing => 0,
            Known::Was(..) => 1,
            Known::Repeats(_) => 2,
        })?;
        self.looks.known = match (tag, self.looks.known.clone()) {
            (0, _) => Known::Nothing,
            (1, known) => {
                let (mut held, mut left) = match known {
                    Known::Was(held, left) => (Held::clone(&held), left),
                    _ => (self.held(now), TURNS),
                };
                let Held { current, a, cells, modules, cycle, instructions, overruns } = &mut held;
                current.state(tape)?;
                a.state(tape)?;
                cells.state(tape)?;
                tape.all(modules)?;
                cycle.state(tape)?;
                instructions.state(tape)?;
                overruns.state(tape)?;
                left.state(tape)?;
                // A round takes time: the cycle that begins with this copy is not over yet, or that was before.
                let runs = matches!(self.phase, Phase::Run { .. }) && !self.at_end();
                tape.demand(*cycle < now || *cycle == now && (runs || self.looks.at > now))?;
                tape.demand(*instructions <= counted && *overruns <= self.overruns)?;
                Known::Was(Arc::new(held), left)
            }
            (2, known) => {
                let mut round = match known {
                    Known::Repeats(round) => round,
                    _ => Round { cycles: 0, instructions: 0, overruns: 0 },
                };
                round.cycles.state(tape)?;
                round.instructions.state(tape)?;
                round.overruns.state(tape)?;
                tape.demand((1..=now).contains(&round.cycles) && round.instructions <= counted)?;
                Known::Repeats(round)
            }
            _ => return Err(Damaged),
        };
        Ok(())
    }
}

impl Looks {
    /// At first.
    pub(crate) const START: Looks =
        Looks { skip: true, insists: false, at: BLIND, blind: BLIND, known: Known::Nothing };
}

impl Ap101 {
    /// Something from outside has touched the machine.
    pub(crate) fn stir(&mut self) {
        let Looks { at, blind, known, .. } = &mut self.looks;
        (*at, *blind, *known) = (self.hot.time.now() + BLIND, BLIND, Known::Nothing);
    }

    /// Called as a program cycle is about to begin: what repeats itself from now on, if the machine has settled.
    #[inline]
    pub(crate) fn settled(&mut self, now: u64) -> Option<Round> {
        match self.looks.known {
            Known::Repeats(round) => Some(round),
            _ if now < self.looks.at => None,
            _ => {
                let found = self.look(now);
                // Who stops here comes by once more.
                self.looks.at = self.looks.at.max(now + 1);
                found
            }
        }
    }

    #[cold]
    fn look(&mut self, now: u64) -> Option<Round> {
        self.looks.known = match std::mem::replace(&mut self.looks.known, Known::Nothing) {
            Known::Repeats(round) => Known::Repeats(round),
            Known::Nothing => {
                self.soc.moved = false;
                Known::Was(Arc::new(self.held(now)), TURNS)
            }
            Known::Was(held, _) if !self.soc.moved && self.is_like(&held, now) => Known::Repeats(Round {
                cycles: now - held.cycle,
                instructions: self.hot.time.instructions() - held.instructions,
                overruns: self.overruns - held.overruns,
            }),
            Known::Was(held, left @ 2..) if !self.soc.moved => Known::Was(held, left - 1),
            Known::Was(..) => {
                self.looks.at = now + self.looks.blind;
                self.looks.blind = (2 * self.looks.blind).min(MOST_BLIND);
                Known::Nothing
            }
        };
        match self.looks.known {
            Known::Repeats(round) => Some(round),
            _ => None,
        }
    }

    fn held(&self, now: u64) -> Held {
        Held {
            current: self.current,
            a: self.hot.a,
            cells: self.soc.cells,
            modules: self.soc.fitted().cloned().collect(),
            cycle: now,
            instructions: self.hot.time.instructions(),
            overruns: self.overruns,
        }
    }

    fn is_like(&self, held: &Held, now: u64) -> bool {
        held.current == self.current
            && held.a == self.hot.a
            && held.cells == self.soc.cells
            && self.soc.fitted().zip(&held.modules).all(|(module, before)| module.goes_on_as(now, before, held.cycle))
    }

    /// Nothing changes any more while `round` repeats itself; overruns may still have to be counted.
    pub(crate) const fn rests(&self, round: Round) -> bool {
        round.overruns == 0 || self.overruns == u16::MAX
    }

    /// Jumps over whole rounds, to before the cycle `to`, at which there is more to do than to begin a round; false when there is no
    /// room for one.
    pub(crate) fn jump_over(&mut self, round: Round, to: u64) -> bool {
        let (now, counted) = (self.hot.time.now(), self.hot.time.instructions());
        // OVR stays at its highest value: on the way there no round is left out in which it may be reached.
        let uncounted = u64::from(u16::MAX - self.overruns).saturating_sub(1);
        let most = if self.rests(round) { u64::MAX } else { uncounted / u64::from(round.overruns) };
        let turns = (to.saturating_sub(now + 1) / round.cycles.max(1)).min(most);
        self.hot.time.repeat(turns, now - round.cycles, counted - round.instructions);
        for module in self.soc.modules.iter_mut() {
            module.repeat(now - round.cycles, turns * round.cycles);
        }
        let overruns = u16::try_from(turns.saturating_mul(round.overruns.into())).unwrap_or(u16::MAX);
        self.overruns = self.overruns.saturating_add(overruns);
        turns > 0
    }
}
