//! The parts of the chip around the core, one file each, and what they share.
//!
//! Time is counted in cycles of the core's clock since power-on, `t`; cycle `t` lies between the edges `t` and `t + 1`. It goes
//! on while clocks stand in sleep, at the rate they had. The I/O clock is the core's, so a part on it counts cycles; a part that
//! hangs on another oscillator (watchdog, EEPROM, timer 2 on its crystal) is told by [`AvrDevice::set_clock_hz`] how many cycles there are
//! to a second. Nothing ticks: a part answers what it is in a cycle, and when it next does something by itself.
//!
//! Within a cycle:
//!
//! - an instruction reads in cycle `t` what has happened up to the edge `t`: [`AvrDevice::read`] comes with `t`, and everything that
//!   is due at `t` or before has been done;
//! - what it writes in cycle `t` takes effect at the edge that ends the cycle: [`AvrDevice::write`] comes with `t + 1`. What
//!   happens at that very edge by the settings before the write still happens, and the flags that it sets stay set; then the
//!   write counts (a counter that is written takes the value in place of the step);
//! - pins change at edges; [`AvrDevice::on_line_changed`] comes with the edge. Synchronisers are the part's own: what samples a line at the
//!   edge `t` sees it as it was in cycle `t - 1`.
//!
//! Flags of interrupts stand in the registers of the part. It works out flags that nobody waits for only when they are
//! looked at: [`AvrDevice::next_cycle`] tells of those alone that are enabled, or that another part listens to.

use emu_core::state;

pub mod adc;
pub mod comparator;
mod edges;
pub mod eeprom;
pub mod external;
pub(crate) mod ports;
pub mod real_time_delay;
pub mod spi;
pub mod spm;
pub mod timers;
pub mod twi;
pub mod usart;
pub mod watchdog;

/// A line between a part of the chip and a pin. Which pin it is is a matter of the chip and of which part of a kind it is; a line
/// that a chip does not have stays low.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum AvrLine {
    /// Clock input of a timer, T0 to T3.
    T,
    /// Input capture of a timer, ICP1 and ICP3, or the comparator in its place.
    Icp,
    /// Compare output A of a timer.
    OcA,
    /// Compare output B.
    OcB,
    /// Compare output C.
    OcC,
    /// USART: transmit.
    Txd,
    /// USART: receive.
    Rxd,
    /// USART: clock of synchronous mode.
    Xck,
    /// SPI clock.
    Sck,
    /// SPI data from the slave.
    Miso,
    /// SPI data from the master.
    Mosi,
    /// SPI slave select, active low.
    Ss,
    /// Two-wire clock.
    Scl,
    /// Two-wire data.
    Sda,
    /// External interrupt: the pin INT0 to INT7 by its number.
    Int(u8),
    /// Pin change interrupt: the pin PCINT0 to PCINT31 by its number.
    Pc(u8),
}

/// What a part does to a pin in place of its port (the overriding signals of section 14.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AvrDrive {
    /// Leaves it to the port.
    #[default]
    Port,
    /// Gives the level of an output; DDR still says whether it is one (PVOE).
    Value(bool),
    /// Makes it an output of this level, whatever DDR says (DDOE, DDOV = 1, PVOE).
    Output(bool),
    /// Makes it an input, whatever DDR says; the pull-up is PORT's to give (DDOE, DDOV = 0).
    Input,
}

state! { enum AvrDrive { 0 = Port, 1 = Value(high), 2 = Output(high), 3 = Input } }

/// What a part does to the rest of the chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AvrSignal {
    /// Does something to a line from the edge `t` on.
    Drive {
        /// Cycle.
        t: u64,
        /// Which.
        line: AvrLine,
        /// What.
        drive: AvrDrive,
    },
    /// A USART has sent a character: its last stop bit ends at the edge `t`.
    Sent {
        /// Cycle.
        t: u64,
        /// Its lower eight bits.
        byte: u8,
    },
    /// A flag that others listen to is set: the number of its interrupt within the part.
    Flag {
        /// Cycle.
        t: u64,
        /// Which.
        irq: u8,
    },
    /// The chip is to be reset (watchdog).
    Reset {
        /// Cycle.
        t: u64,
    },
    /// The core stands still and begins its next instruction at the edge `until`.
    Stall {
        /// Cycle.
        until: u64,
    },
    /// A page of program memory is erased.
    ErasePage {
        /// Byte address of its first byte.
        addr: u32,
    },
    /// Words are programmed into program memory: bits that are 0 become 0, the others stay.
    WritePage {
        /// Byte address of the first.
        addr: u32,
        /// The words.
        words: Vec<u16>,
    },
}

/// Where parts put their signals, in order of time as far as one part is concerned.
pub type AvrOutbox = Vec<AvrSignal>;

/// A part of the chip around the core. The calls to it come in order of time; `t` never goes back.
pub trait AvrDevice {
    /// Its registers by their names without the number of the part (UCSRA for UCSR0A and UCSR1A).
    type Reg: Copy;

    /// Does everything that is due at or before `t`. Nothing that has been done is done again.
    fn run_due(&mut self, t: u64, out: &mut AvrOutbox);
    /// The cycle at which [`AvrDevice::run_due`] will next do something that can be noticed outside of the part (an enabled
    /// interrupt, a line, a signal), if no register is written and no line changes before; `NEVER` where there is none.
    fn next_cycle(&self) -> u64;
    /// Interrupts that are asked for, flag and enable both set, after everything that was run: bit `n` is the interrupt `n` of
    /// the part, in the order of the vectors.
    fn interrupt_requests(&self) -> u8 {
        0
    }
    /// The interrupt `irq` of the part is entered at the edge `t`: hardware clears the flag where it does.
    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        let _ = (irq, t, out);
    }
    /// Reads a register as an instruction does in cycle `t`, with side effects. Everything due at `t` has been done.
    fn read(&mut self, reg: Self::Reg, t: u64, out: &mut AvrOutbox) -> u8 {
        let _ = out;
        self.peek(reg, t)
    }
    /// What a read in cycle `t` would give, nothing being due before.
    fn peek(&self, reg: Self::Reg, t: u64) -> u8;
    /// Writes the bits of `mask` (all of them but for SBI and CBI, which touch one) at the edge `t` that ends the cycle of the
    /// write. Everything due before `t` has been done; what is due at `t` is the part's to do first.
    fn write(&mut self, reg: Self::Reg, value: u8, mask: u8, t: u64, out: &mut AvrOutbox);
    /// The level of a line has changed at the edge `t`, by whomever. Everything due at `t` has been done.
    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        let _ = (line, high, t, out);
    }
    /// The bit in DDR of a line's pin has changed at the edge `t`; at first all are inputs. For DDR_XCK, which chooses who gives
    /// the clock, and for an SS that is an output and so none that selects.
    fn on_direction_changed(&mut self, line: AvrLine, output: bool, t: u64, out: &mut AvrOutbox) {
        let _ = (line, output, t, out);
    }
    /// Takes its registers to their initial values at `t`.
    fn reset(&mut self, t: u64, out: &mut AvrOutbox);
    /// The clock on which the part hangs stops at `t` (sleep, PRR). Everything due at `t` has been done.
    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox);
    /// It runs again from `t` on: what hangs on it goes on where it stood.
    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox);
    /// From `t` on there are `hz` cycles to a second (at first, and where CLKPR changes it).
    fn set_clock_hz(&mut self, hz: u64, t: u64) {
        let _ = (hz, t);
    }
    /// Up to when a read of `reg` keeps giving what it gives at `t`, without side effects, if nothing is written and no line
    /// changes: `t` itself where nothing is promised.
    fn steady_until(&self, reg: Self::Reg, t: u64) -> u64;
}
