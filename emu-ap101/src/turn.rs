//! The hot loop: what one instruction does to the machine.
//!
//! [`Turn`] holds the registers as plain locals whose address never escapes, so that they live in host registers; memory lies
//! beside it.

use emu_core::countdown::Countdown;
use emu_core::cpu::Probe;
use emu_core::dispatch;
use emu_core::lint::Lint;

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Ap101Op, Kind, SPAN, ap101_table};
use crate::operands::{A, D, IMAGE, M, Place, Spot, Target, X, ZONE};
use crate::predecode::{Code, OPS};
use crate::soc::Soc;

/// Positions in the chip's list of memories: i, e, m, r.
const I_SPACE: u8 = 1;
const E_SPACE: u8 = 2;
const M_SPACE: u8 = 3;
const R_SPACE: u8 = 4;

/// The registers that instructions use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Hot {
    pub time: Countdown,
    pub a: bool,
    /// Up to [`OPS`]: behind the end of program memory the hot loop is left.
    pub na: u32,
    /// The address of the last instruction.
    pub last: u32,
    /// The probe has asked for a stop.
    pub stop: bool,
}

impl Hot {
    /// At cycle 0.
    pub(crate) const START: Hot = Hot { time: Countdown::START, a: false, na: 0, last: 0, stop: false };
}

/// One turn of the loop: registers by value, everything else borrowed.
pub(crate) struct Turn<'a, P: Probe> {
    pub hot: Hot,
    pub soc: &'a mut Soc,
    pub code: &'a Code,
    pub probe: &'a mut P,
}

/// Tells of the instruction at `pc` behind which the program goes on at `to`. Each is told for itself: where the next begins, the
/// order of programs decides.
#[inline(always)]
pub(crate) fn tell<P: Probe>(probe: &mut P, pc: u32, to: u32) {
    if P::FLOW {
        let next = pc + 1;
        probe.enters(pc);
        if to != next {
            probe.goes(next, to, true);
        }
        probe.breaks(to);
    }
}

impl<P: Probe> Turn<'_, P> {
    /// Runs instructions until the deadline, or one that is not for this loop.
    pub(crate) fn burst(mut self, ops: &[Ap101Op; OPS]) -> Hot {
        let turn = &mut self;
        while turn.hot.time.goes_on() {
            let op = &ops[turn.hot.na as usize % OPS];
            if P::INSN && op.kind != Kind::Slow && turn.probe.insn(turn.hot.time.now(), turn.hot.na) {
                turn.hot.stop = true;
                turn.hot.time.force();
                break;
            }
            ap101_table!(dispatch { (turn, op, op.kind, break) });
            tell(turn.probe, turn.hot.last, turn.hot.na);
        }
        self.hot
    }

    /// Runs one instruction, which is none of the extra kinds.
    pub(crate) fn single(mut self, op: Ap101Op) -> Hot {
        let (turn, op) = (&mut self, &op);
        ap101_table!(dispatch { (turn, op, op.kind, ()) });
        self.hot
    }

    /// The machine cycle of the running instruction.
    #[inline(always)]
    const fn cycle(&self) -> u64 {
        self.hot.time.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn saw(&mut self, space: u8, addr: u16, value: bool, write: bool) {
        let wanted = P::DATA && (write || P::READS);
        if wanted && self.probe.data(self.cycle(), space, addr, value.into(), write) {
            self.hot.stop = true;
            self.hot.time.force();
        }
    }

    #[inline(always)]
    fn lint(&mut self, lint: Lint) {
        if P::LINT {
            let (at, pc) = (self.cycle(), self.hot.last);
            self.probe.lint(at, pc, lint);
        }
    }

    /// Nothing stands at an address.
    fn lint_nothing(&mut self, addr: u16) {
        const SPACES: [&str; 4] = ["i", "e", "r", "m"];
        let space = SPACES.get(usize::from(addr / ZONE)).copied().unwrap_or("i");
        self.lint(Lint::NoSuchBit { space, addr: addr % ZONE });
    }

    /// Tells of an access to a place, with what is odd about it.
    fn look(&mut self, place: Place, bit: bool, write: bool) {
        match place.spot() {
            Spot::Cell(cell) if cell < M => self.saw(I_SPACE, cell, bit, write),
            Spot::Cell(cell) => self.saw(M_SPACE, cell - M, bit, write),
            Spot::Output(n) => {
                self.saw(E_SPACE, n, bit, write);
                self.saw(M_SPACE, IMAGE - M + n, bit, write);
            }
            Spot::Module(n) => self.saw(R_SPACE, n, bit, write),
            Spot::Running(n) => self.saw(R_SPACE, 128 + n, bit, write),
            Spot::Port(n) if write => self.lint(Lint::PresetPort { module: n, why: "only STO gives a preset" }),
            Spot::Port(n) => {
                self.saw(R_SPACE, 256 + n, bit, false);
                self.lint(Lint::PresetPort { module: n, why: "a port reads 0" });
            }
            Spot::Nothing(addr) => self.lint_nothing(addr),
        }
    }

    #[inline(always)]
    fn write(&mut self, place: Place, bit: bool) {
        if P::DATA || P::LINT {
            self.look(place, bit, true);
        }
        let changed = put(self.soc, place, bit, self.hot.time.now());
        // An edge is told of at the next boundary.
        if P::EVENTS && changed {
            self.hot.time.force();
        }
    }

    /// STO into a preset port: the NOP behind it has the preset.
    #[inline(always)]
    fn order(&mut self, n: u16, bit: bool) {
        let given = preset(self.soc, n, self.code.word(self.hot.na));
        if given {
            self.saw(R_SPACE, 256 + n, bit, true);
        } else {
            self.lint(Lint::PresetPort { module: n, why: "no NOP with data follows" });
        }
    }
}

/// Writes to a place what shows from the machine cycle `next` on; true when a pin changes.
#[inline(never)]
fn put(soc: &mut Soc, place: Place, bit: bool, next: u64) -> bool {
    match place.spot() {
        Spot::Output(n) => return soc.write_output(n, bit, next),
        Spot::Cell(cell) if cell >= M || !soc.live() => soc.set(cell, bit),
        Spot::Module(n) => {
            let begun = soc.begun();
            soc.module_mut(n).write(bit, next, begun);
        }
        Spot::Running(n) if bit => soc.module_mut(n).clear(next),
        _ => {}
    }
    false
}

/// Reads a place in the machine cycle `now`.
#[inline(never)]
fn get(soc: &Soc, place: Place, now: u64) -> bool {
    match place.spot() {
        Spot::Cell(cell) => soc.get(cell),
        Spot::Output(n) => soc.get(IMAGE + n),
        Spot::Module(n) => soc.module(n).q(now),
        Spot::Running(n) => soc.module(n).running(now),
        Spot::Port(_) | Spot::Nothing(_) => false,
    }
}

/// Gives a module the preset in a word, if it is a NOP without an index.
#[inline(never)]
fn preset(soc: &mut Soc, n: u16, word: u16) -> bool {
    let given = word >> 11 == 0b1_1110;
    if given {
        soc.set_preset(n, word % SPAN as u16);
    }
    given
}

impl<P: Probe> Ap101 for Turn<'_, P> {
    type Bit = bool;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.hot.last = self.hot.na;
        self.hot.na += words;
        self.hot.time.charge(cycles);
        self.hot.time.count();
    }
    #[inline(always)]
    fn bit(value: bool) -> bool {
        value
    }
    #[inline(always)]
    fn a(&self) -> bool {
        self.hot.a
    }
    #[inline(always)]
    fn set_a(&mut self, bit: bool) {
        self.hot.a = bit;
    }
    #[inline(always)]
    fn cell(&self, cell: u16) -> bool {
        self.soc.get(cell)
    }
    #[inline(always)]
    fn set_cell(&mut self, cell: u16, bit: bool) {
        self.soc.set(cell, bit);
    }

    #[inline(always)]
    fn read(&mut self, place: Place) -> bool {
        let bit = get(self.soc, place, self.cycle());
        if P::DATA || P::LINT {
            self.look(place, bit, false);
        }
        bit
    }

    #[inline(always)]
    fn write_if(&mut self, condition: bool, place: Place, bit: bool) {
        if condition {
            if let (true, Spot::Cell(addr @ 0..M)) = (P::LINT, place.spot()) {
                self.lint(Lint::InputWritten { addr });
            }
            self.write(place, bit);
        }
    }

    #[inline(always)]
    fn store(&mut self, place: Place, bit: bool, orders: bool) {
        match place.spot() {
            Spot::Port(n) if orders => self.order(n, bit),
            Spot::Cell(addr @ 0..M) if P::LINT && self.soc.live() => self.lint(Lint::InputWritten { addr }),
            _ => self.write(place, bit),
        }
    }

    #[inline(always)]
    fn jump_if(&mut self, condition: bool, target: u16) {
        self.hot.na = if condition { target.into() } else { self.hot.na };
    }
}
