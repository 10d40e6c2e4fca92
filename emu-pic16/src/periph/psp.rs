//! Parallel slave port on ports D and E of the 40-pin chips (DS33023 section 9.10, DS30292 section 3.6).
//!
//! The strobes work without a clock: while CS and WR are low the input latch follows the bus, while CS and RD are low the
//! port drives it. Only the flags pass the clock: they are set in Q4 after the first Q2 that finds the strobe gone.

use emu_core::NEVER;

use super::map::{Flag, Line, Sfr};
use super::{Device, Outbox, Signal};

const IBF: u8 = 1 << 7;
const OBF: u8 = 1 << 6;
const IBOV: u8 = 1 << 5;
const PSPMODE: u8 = 1 << 4;

/// The ends of strobes on their way to a flag. There are two at most: one that Q2 has found and one that waits for Q2;
/// strobes that end before the same Q2 are one to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Ends([u64; 2]);

impl emu_core::state::State for Ends {
    fn state(&mut self, tape: &mut emu_core::state::Tape<'_>) -> Result<(), emu_core::state::Damaged> {
        self.0.state(tape)
    }
}

impl Ends {
    const NONE: Ends = Ends([NEVER; 2]);

    /// A strobe ends at `t`: Q2 is a clock after the beginning of a cycle, and Q4 two clocks after Q2.
    fn push(&mut self, t: u64) {
        let due = (t.saturating_add(2) / 4).saturating_mul(4).saturating_add(3);
        if self.0[0] == NEVER {
            self.0[0] = due;
        } else if self.0[0] != due {
            self.0[1] = due;
        }
    }

    /// The first one, if it is due at `t`.
    fn take(&mut self, t: u64) -> bool {
        let due = self.0[0] <= t;
        if due {
            self.0 = [self.0[1], NEVER];
        }
        due
    }
}

/// The port. Of TRISE it has bits 7 to 4; the others are the owner's.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Psp {
    trise: u8,
    /// Levels of RD, WR, CS.
    strobes: [bool; 3],
    bus: u8,
    input: u8,
    output: u8,
    /// CS and WR are low; CS and RD are low.
    writing: bool,
    reading: bool,
    written: Ends,
    was_read: Ends,
    asleep: bool,
}

emu_core::state! { Psp { trise, strobes, bus, input, output, writing, reading, written, was_read, asleep } }

impl Default for Psp {
    fn default() -> Psp {
        Psp::new()
    }
}

impl Psp {
    /// The port after power-up, with its strobes high.
    #[must_use]
    pub const fn new() -> Psp {
        Psp {
            trise: 0,
            strobes: [true; 3],
            bus: 0,
            input: 0,
            output: 0,
            writing: false,
            reading: false,
            written: Ends::NONE,
            was_read: Ends::NONE,
            asleep: false,
        }
    }

    /// Any reset: PSPMODE and the flags of TRISE are cleared.
    pub fn reset(&mut self) {
        self.asleep = false;
        self.set_trise(0);
    }

    /// PSPMODE: ports D and E are this one's, TRISD is without effect.
    #[must_use]
    pub const fn on(&self) -> bool {
        self.trise & PSPMODE != 0
    }

    /// The levels at port D from `t` on.
    pub fn on_bus(&mut self, levels: u8, t: u64) {
        let _ = t;
        self.bus = levels;
        if self.writing {
            self.input = levels;
        }
    }

    /// What the port drives onto the pins of port D, while CS and RD are low.
    #[must_use]
    pub fn driving(&self) -> Option<u8> {
        self.reading.then_some(self.output)
    }

    /// The program writes PORTD at `t`: in this mode that fills the output buffer.
    pub fn write_port(&mut self, value: u8, t: u64) {
        let _ = t;
        self.output = value;
        if self.on() {
            self.trise |= OBF;
        }
    }

    /// The program reads PORTD at `t` in this mode: the input latch, which is then empty.
    pub fn read_port(&mut self, t: u64) -> u8 {
        let _ = t;
        self.trise &= !IBF;
        self.input
    }

    /// What [`Psp::read_port`] would give.
    #[must_use]
    pub const fn peek_port(&self) -> u8 {
        self.input
    }

    fn set_trise(&mut self, value: u8) {
        // IBF and OBF are for reading only, and held clear outside of this mode.
        self.trise = value & (IBOV | PSPMODE);
        if !self.on() {
            (self.writing, self.reading) = (false, false);
            (self.written, self.was_read) = (Ends::NONE, Ends::NONE);
        }
    }

    /// A byte has come, or has been fetched: what the program sees of it at `t`.
    fn ended(&mut self, written: bool, t: u64, out: &mut Outbox) {
        if written {
            self.trise |= if self.trise & IBF != 0 { IBF | IBOV } else { IBF };
        }
        out.push(Signal::Flag { t, flag: Flag::PSPIF });
    }

    /// Follows the strobes after a change at `t`.
    fn follow(&mut self, t: u64, out: &mut Outbox) {
        if !self.on() {
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
            // Without Q clocks the flag is set by the edge, so that it can wake the chip (DS30292 section 12.13.1).
            if written || was_read {
                self.ended(written, t, out);
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

impl Device for Psp {
    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.next();
            if due > t || due == NEVER {
                return;
            }
            let written = self.written.take(due);
            self.was_read.take(due);
            self.ended(written, due, out);
        }
    }

    fn next(&self) -> u64 {
        self.written.0[0].min(self.was_read.0[0])
    }

    fn peek(&self, reg: Sfr, _t: u64) -> u8 {
        if reg == Sfr::TRISE { self.trise } else { 0 }
    }

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if reg == Sfr::TRISE {
            let full = if self.on() { self.trise & (IBF | OBF) } else { 0 };
            self.set_trise(value);
            if self.on() {
                self.trise |= full;
            }
            self.follow(t, out);
        }
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        let strobe = match line {
            Line::Rd => 0,
            Line::Wr => 1,
            Line::Cs => 2,
            _ => return,
        };
        self.strobes[strobe] = high;
        self.follow(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        self.asleep = true;
        // What waits for a clock is set now, as in sleep: two at most of either kind.
        for _ in 0..2 {
            let pending = [self.written.0[0] != NEVER, self.was_read.0[0] != NEVER];
            if pending != [false; 2] {
                self.written.take(NEVER - 1);
                self.was_read.take(NEVER - 1);
                self.ended(pending[0], t, out);
            }
        }
    }

    fn wake(&mut self, _t: u64, _out: &mut Outbox) {
        self.asleep = false;
    }

    fn steady(&self, _reg: Sfr, _t: u64) -> u64 {
        self.next()
    }
}
