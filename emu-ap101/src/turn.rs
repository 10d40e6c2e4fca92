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
pub struct Hot {
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
    pub const START: Hot = Hot { time: Countdown::START, a: false, na: 0, last: 0, stop: false };
}

/// One turn of the loop: registers by value, everything else borrowed.
pub struct Turn<'a, P: Probe> {
    pub hot: Hot,
    pub soc: &'a mut Soc,
    pub code: &'a Code,
    pub probe: &'a mut P,
}

impl<P: Probe> Turn<'_, P> {
    /// Runs instructions until the deadline, or one that is not for this loop.
    pub fn burst(mut self, ops: &[Ap101Op; OPS]) -> Hot {
        let turn = &mut self;
        while turn.hot.time.goes_on() {
            let op = &ops[turn.hot.na as usize % OPS];
            ap101_table!(dispatch { (turn, op, op.kind, break) });
        }
        self.hot
    }

    /// Runs one instruction, which is none of the extra kinds.
    pub fn single(mut self, op: Ap101Op) -> Hot {
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
        if P::DATA && self.probe.data(self.cycle(), space, addr, value.into(), write) {
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

    fn saw_cell(&mut self, cell: u16, bit: bool, write: bool) {
        if cell < M { self.saw(I_SPACE, cell, bit, write) } else { self.saw(M_SPACE, cell - M, bit, write) }
    }

    /// Writes to a place.
    fn write(&mut self, place: Place, bit: bool) {
        let next = self.hot.time.now();
        match place.spot() {
            Spot::Cell(cell) => {
                self.saw_cell(cell, bit, true);
                if cell >= M || !self.soc.live() {
                    self.soc.set(cell, bit);
                }
            }
            Spot::Output(n) => {
                self.saw(E_SPACE, n, bit, true);
                self.saw(M_SPACE, IMAGE - M + n, bit, true);
                // An edge is told of at the next boundary.
                if self.soc.write_output(n, bit, next) && P::EVENTS {
                    self.hot.time.force();
                }
            }
            Spot::Module(n) => {
                self.saw(R_SPACE, n, bit, true);
                let begun = self.soc.begun();
                self.soc.module_mut(n).write(bit, next, begun);
            }
            Spot::Running(n) => {
                self.saw(R_SPACE, 128 + n, bit, true);
                if bit {
                    self.soc.module_mut(n).clear(next);
                }
            }
            Spot::Port(n) => self.lint(Lint::PresetPort { module: n, why: "only STO gives a preset" }),
            Spot::Nothing(addr) => self.lint_nothing(addr),
        }
    }

    /// STO into a preset port: the NOP behind it has the preset.
    fn order(&mut self, n: u16, bit: bool) {
        let word = self.code.word(self.hot.na);
        if word >> 11 == 0b1_1110 {
            self.saw(R_SPACE, 256 + n, bit, true);
            self.soc.module_mut(n).set_preset(word % SPAN as u16);
        } else {
            self.lint(Lint::PresetPort { module: n, why: "no NOP with data follows" });
        }
    }
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

    fn read(&mut self, place: Place) -> bool {
        let now = self.cycle();
        match place.spot() {
            Spot::Cell(cell) => {
                let bit = self.soc.get(cell);
                self.saw_cell(cell, bit, false);
                bit
            }
            Spot::Output(n) => {
                let bit = self.soc.get(IMAGE + n);
                self.saw(E_SPACE, n, bit, false);
                bit
            }
            Spot::Module(n) => {
                let bit = self.soc.module(n).q(now);
                self.saw(R_SPACE, n, bit, false);
                bit
            }
            Spot::Running(n) => {
                let bit = self.soc.module(n).running(now);
                self.saw(R_SPACE, 128 + n, bit, false);
                bit
            }
            Spot::Port(n) => {
                self.saw(R_SPACE, 256 + n, false, false);
                self.lint(Lint::PresetPort { module: n, why: "a port reads 0" });
                false
            }
            Spot::Nothing(addr) => {
                self.lint_nothing(addr);
                false
            }
        }
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
