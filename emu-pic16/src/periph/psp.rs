//! Parallel slave port on ports D and E of the 40-pin chips (DS33023 section 9.10, DS30292 section 3.6).
//!
//! The strobes work without a clock: while CS and WR are low, the input latch follows the bus; while CS and
//! RD are low, the port drives it. Only the flags are clocked: they are set in Q4 after the first Q2 that
//! detects the end of a strobe.

use emu_core::NEVER;

use super::map::{InterruptFlag, Pic16Line, Sfr};
use super::{Device, Pic16Outbox, Pic16Signal};

const IBF: u8 = 1 << 7;
const OBF: u8 = 1 << 6;
const IBOV: u8 = 1 << 5;
const PSPMODE: u8 = 1 << 4;

/// Ends of strobes that have not reached a flag yet. There are at most two: one that Q2 has detected, and one
/// that waits for Q2. Strobes that end before the same Q2 count as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TransferEnds([u64; 2]);

impl emu_core::state::SnapshotState for TransferEnds {
    fn pass_state(
        &mut self,
        tape: &mut emu_core::state::StateTape<'_>,
    ) -> Result<(), emu_core::state::SnapshotDamaged> {
        self.0.pass_state(tape)
    }
}

impl TransferEnds {
    const NONE: TransferEnds = TransferEnds([NEVER; 2]);

    /// Records the end of a strobe at `t`. Q2 is one clock after the start of a cycle, and Q4 two clocks
    /// after Q2.
    fn push(&mut self, t: u64) {
        let due = (t.saturating_add(2) / 4).saturating_mul(4).saturating_add(3);
        if self.0[0] == NEVER {
            self.0[0] = due;
        } else if self.0[0] != due {
            self.0[1] = due;
        }
    }

    /// Removes the first end if it is due at `t`; returns whether it was.
    fn take(&mut self, t: u64) -> bool {
        let due = self.0[0] <= t;
        if due {
            self.0 = [self.0[1], NEVER];
        }
        due
    }
}

/// The parallel slave port. It holds bits 7 to 4 of TRISE; the chip holds the others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParallelSlavePort {
    trise: u8,
    /// Levels of RD, WR and CS.
    strobes: [bool; 3],
    bus: u8,
    input: u8,
    output: u8,
    /// True while CS and WR are low; then true while CS and RD are low.
    writing: bool,
    reading: bool,
    written: TransferEnds,
    was_read: TransferEnds,
    asleep: bool,
}

emu_core::state! { ParallelSlavePort { trise, strobes, bus, input, output, writing, reading, written, was_read, asleep } }

impl Default for ParallelSlavePort {
    fn default() -> ParallelSlavePort {
        ParallelSlavePort::new()
    }
}

impl ParallelSlavePort {
    /// Returns the port after power-up, with its strobes high.
    #[must_use]
    pub const fn new() -> ParallelSlavePort {
        ParallelSlavePort {
            trise: 0,
            strobes: [true; 3],
            bus: 0,
            input: 0,
            output: 0,
            writing: false,
            reading: false,
            written: TransferEnds::NONE,
            was_read: TransferEnds::NONE,
            asleep: false,
        }
    }

    /// Reports whether PSPMODE is set: then the slave port uses ports D and E, and TRISD has no effect.
    #[must_use]
    pub const fn is_enabled(&self) -> bool {
        self.trise & PSPMODE != 0
    }

    /// Sets the levels at port D from `t` on.
    pub fn set_bus_levels(&mut self, levels: u8, t: u64) {
        let _ = t;
        self.bus = levels;
        if self.writing {
            self.input = levels;
        }
    }

    /// Returns the byte that the port drives onto port D while CS and RD are low.
    #[must_use]
    pub fn driven_byte(&self) -> Option<u8> {
        self.reading.then_some(self.output)
    }

    /// Handles a write of PORTD by the program at `t`; in this mode it fills the output buffer.
    pub fn write_port(&mut self, value: u8, t: u64) {
        let _ = t;
        self.output = value;
        if self.is_enabled() {
            self.trise |= OBF;
        }
    }

    /// Handles a read of PORTD by the program at `t` in this mode: returns the input latch, which is then
    /// empty.
    pub fn read_port(&mut self, t: u64) -> u8 {
        let _ = t;
        self.trise &= !IBF;
        self.input
    }

    /// Returns the value that [`ParallelSlavePort::read_port`] would give.
    #[must_use]
    pub const fn peek_port(&self) -> u8 {
        self.input
    }

    fn set_trise(&mut self, value: u8) {
        // IBF and OBF are read-only, and held clear outside this mode.
        self.trise = value & (IBOV | PSPMODE);
        if !self.is_enabled() {
            (self.writing, self.reading) = (false, false);
            (self.written, self.was_read) = (TransferEnds::NONE, TransferEnds::NONE);
        }
    }

    /// Sets the flags at `t` after a byte was written (`written`) or read by the bus.
    fn on_transfer_end(&mut self, written: bool, t: u64, out: &mut Pic16Outbox) {
        if written {
            self.trise |= if self.trise & IBF != 0 { IBF | IBOV } else { IBF };
        }
        out.push(Pic16Signal::Flag { t, flag: InterruptFlag::PSPIF });
    }

    /// Processes the strobes after a change at `t`.
    fn update_bus(&mut self, t: u64, out: &mut Pic16Outbox) {
        if !self.is_enabled() {
            return;
        }
        let [rd, wr, cs] = self.strobes;
        let (writing, reading) = (!cs && !wr, !cs && !rd);
        let (written, was_read) = (self.writing && !writing, self.reading && !reading);
        if writing {
            self.input = self.bus;
        }
        if reading && !self.reading {
            self.trise &= !OBF;
        }
        (self.writing, self.reading) = (writing, reading);
        if self.asleep {
            // Without Q clocks the edge itself sets the flag, so that it can wake the chip (DS30292 section
            // 12.13.1).
            if written || was_read {
                self.on_transfer_end(written, t, out);
            }
            return;
        }
        if written {
            self.written.push(t);
        }
        if was_read {
            self.was_read.push(t);
        }
    }
}

impl Device<Pic16Signal> for ParallelSlavePort {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        loop {
            let due = self.next_deadline();
            if due > t || due == NEVER {
                return;
            }
            let written = self.written.take(due);
            self.was_read.take(due);
            self.on_transfer_end(written, due, out);
        }
    }

    fn next_deadline(&self) -> u64 {
        self.written.0[0].min(self.was_read.0[0])
    }

    fn peek(&self, reg: Sfr, _t: u64) -> u8 {
        if reg == Sfr::TRISE { self.trise } else { 0 }
    }

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if reg == Sfr::TRISE {
            let full = if self.is_enabled() { self.trise & (IBF | OBF) } else { 0 };
            self.set_trise(value);
            if self.is_enabled() {
                self.trise |= full;
            }
            self.update_bus(t, out);
        }
    }

    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        let strobe = match line {
            Pic16Line::Rd => 0,
            Pic16Line::Wr => 1,
            Pic16Line::Cs => 2,
            _ => return,
        };
        self.strobes[strobe] = high;
        self.update_bus(t, out);
    }

    /// Resets the port for any cause: PSPMODE and the flags of TRISE are cleared.
    fn reset(&mut self, _power_on: bool, _t: u64, _out: &mut Pic16Outbox) {
        self.asleep = false;
        self.set_trise(0);
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = true;
        // Ends that wait for a clock set their flags now, as in sleep; there are at most two of each kind.
        for _ in 0..2 {
            let pending = [self.written.0[0] != NEVER, self.was_read.0[0] != NEVER];
            if pending != [false; 2] {
                self.written.take(NEVER - 1);
                self.was_read.take(NEVER - 1);
                self.on_transfer_end(pending[0], t, out);
            }
        }
    }

    fn restart_clock(&mut self, _t: u64, _out: &mut Pic16Outbox) {
        self.asleep = false;
    }

    fn steady_until(&self, _reg: Sfr, _t: u64) -> u64 {
        self.next_deadline()
    }
}
