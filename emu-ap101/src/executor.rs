//! The hot loop: executes predecoded instructions.
//!
//! [`Executor`] holds the registers as plain locals whose address never escapes, so that the compiler keeps
//! them in host registers. Memory is borrowed.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, BusEffect, Probe};
use emu_core::dispatch;
use emu_core::lint::Lint;

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Ap101Op, Ap101OpKind, SPAN, ap101_table};
use crate::operands::{A, BitAddress, BitLocation, D, IMAGE_START, JumpTarget, M_START, X, ZONE_BITS};
use crate::predecode::{CodeMemory, OP_COUNT};
use crate::soc::Ap101Soc;

/// Indexes in the chip's list of memories: i, e, m, r.
const I_SPACE: u8 = 1;
const E_SPACE: u8 = 2;
const M_SPACE: u8 = 3;
const R_SPACE: u8 = 4;

/// The registers that instructions use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct CoreRegisters {
    /// Counts of cycles and instructions, and the deadline.
    pub clock: Countdown,
    /// The accumulator A.
    pub a: bool,
    /// NA, up to [`OP_COUNT`]; after the end of program memory the hot loop is left.
    pub next_address: u32,
    /// The address of the last instruction.
    pub last: u32,
    /// The probe requested a stop.
    pub stop_requested: bool,
}

impl CoreRegisters {
    /// State at cycle 0.
    pub(crate) const START: CoreRegisters =
        CoreRegisters { clock: Countdown::START, a: false, next_address: 0, last: 0, stop_requested: false };
}

/// Context in which instructions execute: the registers by value, everything else borrowed.
pub(crate) struct Executor<'a, P: Probe> {
    /// Registers of the core, by value.
    pub core: CoreRegisters,
    /// The channels, modules and memory M.
    pub soc: &'a mut Ap101Soc,
    /// Program memory.
    pub code: &'a CodeMemory,
    /// The observer of the run.
    pub probe: &'a mut P,
}

/// Reports the instruction at `pc`, after which the program continues at `to`. Each instruction is reported
/// as a flow of its own, because the order of programs decides where the next one begins.
#[inline(always)]
pub(crate) fn report_branch<P: Probe>(probe: &mut P, pc: u32, to: u32) {
    if P::FLOW {
        let next = pc + 1;
        probe.on_flow_start(pc);
        if to != next {
            probe.on_branch(next, to, true);
        }
        probe.on_flow_end(to);
    }
}

impl<P: Probe> Executor<'_, P> {
    /// Runs instructions until the deadline, or until one that leaves this loop.
    pub(crate) fn burst(mut self, ops: &[Ap101Op; OP_COUNT]) -> CoreRegisters {
        let executor = &mut self;
        while executor.core.clock.is_before_deadline() {
            let op = &ops[executor.core.next_address as usize % OP_COUNT];
            if P::INSN
                && op.kind != Ap101OpKind::Slow
                && executor.probe.on_instruction(executor.core.clock.now(), executor.core.next_address)
            {
                executor.core.stop_requested = true;
                executor.core.clock.expire();
                break;
            }
            ap101_table!(dispatch { (executor, op, Ap101OpKind, op.kind, break) });
            report_branch(executor.probe, executor.core.last, executor.core.next_address);
        }
        self.core
    }

    /// Runs one instruction, whose kind must be a row.
    pub(crate) fn single(mut self, op: Ap101Op) -> CoreRegisters {
        let (executor, op) = (&mut self, &op);
        ap101_table!(dispatch { (executor, op, Ap101OpKind, op.kind, ()) });
        self.core
    }

    /// The machine cycle of the running instruction.
    #[inline(always)]
    const fn cycle(&self) -> u64 {
        self.core.clock.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn report_access(&mut self, space: u8, addr: u16, value: bool, write: bool) {
        let wanted = P::DATA && (write || P::DATA_READS);
        if wanted && self.probe.on_data_access(self.cycle(), space, addr, value.into(), write) {
            self.core.stop_requested = true;
            self.core.clock.expire();
        }
    }

    #[inline(always)]
    fn report_lint(&mut self, lint: Lint) {
        if P::LINT {
            let (at, pc) = (self.cycle(), self.core.last);
            self.probe.on_lint(at, pc, lint);
        }
    }

    /// Reports an access to an address where nothing exists.
    fn lint_unmapped(&mut self, addr: u16) {
        const SPACES: [&str; 4] = ["i", "e", "r", "m"];
        let space = SPACES.get(usize::from(addr / ZONE_BITS)).copied().unwrap_or("i");
        self.report_lint(Lint::MissingBit { space, addr: addr % ZONE_BITS });
    }

    /// Reports an access to a location, with its lints.
    fn report_bit_access(&mut self, place: BitAddress, bit: bool, write: bool) {
        match place.location() {
            BitLocation::Cell(cell) if cell < M_START => self.report_access(I_SPACE, cell, bit, write),
            BitLocation::Cell(cell) => self.report_access(M_SPACE, cell - M_START, bit, write),
            BitLocation::Output(n) => {
                self.report_access(E_SPACE, n, bit, write);
                self.report_access(M_SPACE, IMAGE_START - M_START + n, bit, write);
            }
            BitLocation::Module(n) => self.report_access(R_SPACE, n, bit, write),
            BitLocation::Running(n) => self.report_access(R_SPACE, 128 + n, bit, write),
            BitLocation::Port(n) if write => {
                self.report_lint(Lint::PresetPort { module: n, why: "only STO gives a preset" })
            }
            BitLocation::Port(n) => {
                self.report_access(R_SPACE, 256 + n, bit, false);
                self.report_lint(Lint::PresetPort { module: n, why: "a port reads 0" });
            }
            BitLocation::Nothing(addr) => self.lint_unmapped(addr),
        }
    }

    #[inline(always)]
    fn write(&mut self, place: BitAddress, bit: bool) {
        if P::DATA || P::LINT {
            self.report_bit_access(place, bit, true);
        }
        let effect = self.soc.write(place.0, bit.into(), self.cycle());
        // The event of an edge is reported at the next boundary.
        if P::EVENTS && effect.contains(BusEffect::RECHECK) {
            self.core.clock.expire();
        }
    }

    /// STO to a preset port: the NOP after it contains the preset.
    #[inline(always)]
    fn write_preset(&mut self, n: u16, bit: bool) {
        let is_preset = set_module_preset(self.soc, n, self.code.word(self.core.next_address));
        if is_preset {
            self.report_access(R_SPACE, 256 + n, bit, true);
        } else {
            self.report_lint(Lint::PresetPort { module: n, why: "no NOP with data follows" });
        }
    }
}

/// Sets the preset of a module from a word, if the word is a NOP without an index. Returns whether it is.
#[inline(never)]
fn set_module_preset(soc: &mut Ap101Soc, n: u16, word: u16) -> bool {
    let is_preset = word >> 11 == 0b1_1110;
    if is_preset {
        soc.set_preset(n, word % SPAN as u16);
    }
    is_preset
}

impl<P: Probe> Ap101Machine for Executor<'_, P> {
    type Bit = bool;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.core.last = self.core.next_address;
        self.core.next_address += words;
        self.core.clock.charge(cycles);
        self.core.clock.count_instruction();
    }
    #[inline(always)]
    fn bit(value: bool) -> bool {
        value
    }
    #[inline(always)]
    fn a(&self) -> bool {
        self.core.a
    }
    #[inline(always)]
    fn set_a(&mut self, bit: bool) {
        self.core.a = bit;
    }
    #[inline(always)]
    fn cell(&self, cell: u16) -> bool {
        self.soc.channels.get(cell)
    }
    #[inline(always)]
    fn set_cell(&mut self, cell: u16, bit: bool) {
        self.soc.channels.set(cell, bit);
    }

    #[inline(always)]
    fn read_bit(&mut self, place: BitAddress) -> bool {
        let bit = self.soc.read(place.0, self.cycle()).value != 0;
        if P::DATA || P::LINT {
            self.report_bit_access(place, bit, false);
        }
        bit
    }

    #[inline(always)]
    fn write_bit_if(&mut self, condition: bool, place: BitAddress, bit: bool) {
        if condition {
            if let (true, BitLocation::Cell(addr @ 0..M_START)) = (P::LINT, place.location()) {
                self.report_lint(Lint::InputWritten { addr });
            }
            self.write(place, bit);
        }
    }

    #[inline(always)]
    fn store_bit(&mut self, place: BitAddress, bit: bool, orders: bool) {
        match place.location() {
            BitLocation::Port(n) if orders => self.write_preset(n, bit),
            BitLocation::Cell(addr @ 0..M_START) if P::LINT && self.soc.channels.reads_inputs_live() => {
                self.report_lint(Lint::InputWritten { addr })
            }
            _ => self.write(place, bit),
        }
    }

    #[inline(always)]
    fn jump_if(&mut self, condition: bool, target: u16) {
        self.core.next_address = if condition { target.into() } else { self.core.next_address };
    }
}
