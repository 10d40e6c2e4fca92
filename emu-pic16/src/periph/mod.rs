//! The parts of the chip around the core, and what they share.
//!
//! Time is counted in clocks of the oscillator since power-up, four to an instruction cycle: Q1 of cycle `c` is the clock
//! `4 c`. It goes on while the oscillator stands in sleep; a part that hangs on the oscillator is told by [`Pic16Device::stop_clock`] and
//! [`Pic16Device::restart_clock`]. Nothing ticks: a part answers what it is at a clock, and when it next does something by itself.
//!
//! Within an instruction cycle:
//!
//! - an instruction reads in Q2 what has happened up to the end of Q1's first edge: [`Pic16Device::read`] of cycle `c` comes with
//!   `t = 4 c`;
//! - it writes at the end of Q4: [`Pic16Device::write`] of cycle `c` comes with `t = 4 c + 4`. What happens at that very clock by
//!   the settings before the write still happens (a timer that is stopped counts a last time, one that is started counts first
//!   at `t + 4`); a counter that is itself written takes the value instead of the count;
//! - counters of instruction cycles count at the end of a cycle, at clocks that four divides;
//! - pins change at any clock.

pub mod adc;
pub mod comparator;
pub mod eeprom;
pub mod map;
pub mod ports;
pub mod psp;
pub mod ssp;
pub mod timer0;
pub mod timers;
pub mod usart;
pub mod watchdog;

use map::{InterruptFlag, Pic16Line, Sfr};

/// What a part does to a line that it shares with a port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Pic16Drive {
    /// Leaves it to the port.
    #[default]
    Port,
    /// Drives 0 in place of the port's latch.
    Low,
    /// Drives 1 in place of the port's latch.
    High,
    /// Lets go.
    Float,
    /// Never drives the latch: lets go where TRIS makes the pin an input, and drives 0 where it makes it an output (I2C).
    Open,
}

emu_core::state! { enum Pic16Drive { 0 = Port, 1 = Low, 2 = High, 3 = Float, 4 = Open } }

impl Pic16Drive {
    /// High for true.
    #[must_use]
    pub const fn from_bit(high: bool) -> Pic16Drive {
        if high { Pic16Drive::High } else { Pic16Drive::Low }
    }
}

/// What a part does to the rest of the chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Pic16Signal {
    /// Sets an interrupt flag.
    Flag {
        /// Clock.
        t: u64,
        /// Which.
        flag: InterruptFlag,
    },
    /// Does something to a line from now on.
    Drive {
        /// Clock.
        t: u64,
        /// Which.
        line: Pic16Line,
        /// What.
        drive: Pic16Drive,
    },
    /// The USART has sent a byte: its stop bit has passed.
    Sent {
        /// Clock.
        t: u64,
        /// The byte.
        byte: u8,
    },
    /// The special event of a CCP module starts a conversion.
    Convert {
        /// Clock.
        t: u64,
    },
    /// The watchdog has run out.
    Watchdog {
        /// Clock.
        t: u64,
    },
    /// Program memory is to be read for EEDATA and EEDATH.
    FlashRead {
        /// Program word address.
        addr: u16,
    },
    /// Program words are to be written.
    FlashWrite {
        /// Address of the first.
        addr: u16,
        /// The words.
        words: Vec<u16>,
    },
    /// Program words are to be programmed without an erase before: bits that are 0 here become 0, the others stay.
    FlashProgram {
        /// Address of the first.
        addr: u16,
        /// The words.
        words: Vec<u16>,
    },
    /// Instructions whose first cycle begins at `from` or later and before `until` run as NOP.
    Ignore {
        /// Clock.
        from: u64,
        /// Clock.
        until: u64,
    },
    /// Timer 2 has reached its period, for who listens.
    Timer2 {
        /// Clock.
        t: u64,
    },
    /// The core stands still up to this clock.
    Stall {
        /// Clock.
        until: u64,
    },
}

/// Where parts put their signals, in order of time as far as one part is concerned.
pub type Pic16Outbox = Vec<Pic16Signal>;

/// A part of the chip around the core. The calls to it come in order of time; `t` never goes back.
pub trait Pic16Device {
    /// Does everything that is due at or before `t`. Nothing that has been done is done again.
    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox);
    /// The clock at which [`Pic16Device::run_due`] will next do something that can be noticed outside of the part (a flag, a line, a
    /// signal), if no register is written and no line changes before; `NEVER` where there is none. While the oscillator stands
    /// only what goes on without it counts.
    fn next_clock(&self) -> u64;
    /// Reads a register as an instruction does, with side effects. Everything due at `t` has been done.
    fn read(&mut self, reg: Sfr, t: u64, out: &mut Pic16Outbox) -> u8 {
        let _ = out;
        self.peek(reg, t)
    }
    /// What a read would give at `t`, nothing being due before.
    fn peek(&self, reg: Sfr, t: u64) -> u8;
    /// Writes a register at the end of an instruction cycle. Everything due before `t` has been done; what is due at `t` is
    /// the part's to do.
    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Pic16Outbox);
    /// The level of a line has changed at `t`, by whomever. Everything due at `t` has been done.
    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        let _ = (line, high, t, out);
    }
    /// The oscillator stops at `t`. Everything due at `t` has been done.
    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox);
    /// The oscillator runs again from `t` on: what hangs on it goes on where it stood.
    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox);
    /// Up to when a read of `reg` keeps giving what it gives at `t`, without side effects, if nothing is written and no line
    /// changes: `t` itself where nothing is promised.
    fn steady_until(&self, reg: Sfr, t: u64) -> u64;
}
