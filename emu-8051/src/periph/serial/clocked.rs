//! [`Mcs51Serial`]: the serial port with its baud clocks (user's manual, "Baud rates"): timer 1, timer 2 or
//! the oscillator, and the divider by two that SMOD bypasses.

use emu_core::NEVER;
use emu_core::pins::PinId;
use emu_core::state;

use super::{SerialPort, SerialStep};
use crate::periph::map::{pin, sfr};
use crate::periph::ticks::Ticks;
use crate::periph::{Device, Mcs51Outbox, Mcs51Signal};

/// The clock sources of the port, and how it uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaudClocks {
    /// Overflows of timer 1.
    pub timer1: Ticks,
    /// Overflows of timer 2.
    pub timer2: Ticks,
    /// Whether timer 2 clocks the transmitter (TCLK) and the receiver (RCLK).
    pub uses_timer2: [bool; 2],
    /// Whether SMOD bypasses the divider by two.
    pub is_double: bool,
}

impl BaudClocks {
    /// Both timers stopped, and all bits 0.
    pub const START: BaudClocks = {
        let stopped = Ticks { count: 0, next: NEVER, period: NEVER, in_states: false };
        BaudClocks { timer1: stopped, timer2: stopped, uses_timer2: [false; 2], is_double: false }
    };
}

/// The source of the ticks of a 16x baud clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BaudSource {
    /// No source: mode 0.
    None,
    Timer1,
    Timer2,
    /// States of the oscillator (six per machine cycle).
    States,
}

/// A side of the port; its number is its index in lists of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PortSide {
    Transmitter,
    Receiver,
}

impl PortSide {
    const BOTH: [PortSide; 2] = [PortSide::Transmitter, PortSide::Receiver];
}

/// The serial port and its clocks. `t` is a cycle of the oscillator.
#[derive(Debug, Clone, PartialEq)]
pub struct Mcs51Serial {
    port: SerialPort,
    /// The count of its source up to which the ticks of each side have been applied.
    applied: [u64; 2],
    clocks: BaudClocks,
}

// The chip sets the clocks again.
state! { Mcs51Serial { port, applied } stays { clocks } }

impl Mcs51Serial {
    /// The state after reset, with stopped clocks.
    #[must_use]
    pub const fn new() -> Mcs51Serial {
        Mcs51Serial { port: SerialPort::new(), applied: [0; 2], clocks: BaudClocks::START }
    }

    /// The port.
    #[must_use]
    pub const fn port(&self) -> &SerialPort {
        &self.port
    }

    /// Whether a byte is being sent or received.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        let receives = self.port.rx_ticks_to_next_step().is_some() && self.next_deadline() != NEVER;
        self.port.is_busy() || receives || self.port.next_shift_cycle() != NEVER
    }

    /// Sets the clocks after a change of a timer or of a bit that selects them, at the end of cycle `t`. A
    /// source that a side did not use before starts with its present count. A source that stays continues,
    /// including ticks that the change itself caused.
    pub fn set_clocks(&mut self, clocks: BaudClocks, t: u64) {
        let before = self.sources();
        self.clocks = clocks;
        self.rebase(before, t);
    }

    /// Sets the clocks after the state was read back.
    pub const fn restore_clocks(&mut self, clocks: BaudClocks) {
        self.clocks = clocks;
    }

    fn rebase(&mut self, before: [BaudSource; 2], t: u64) {
        let now = self.sources();
        for side in PortSide::BOTH.map(|side| side as usize) {
            if now[side] != before[side] {
                self.applied[side] = self.ticks_of(now[side]).count_by_cycle(t);
            }
        }
    }

    fn sources(&self) -> [BaudSource; 2] {
        self.clocks.uses_timer2.map(|by_timer2| match self.port.mode() {
            0 => BaudSource::None,
            2 => BaudSource::States,
            _ if by_timer2 => BaudSource::Timer2,
            _ => BaudSource::Timer1,
        })
    }

    const fn ticks_of(&self, source: BaudSource) -> Ticks {
        match source {
            BaudSource::None => Ticks { next: NEVER, ..Ticks::STATES },
            BaudSource::Timer1 => self.clocks.timer1,
            BaudSource::Timer2 => self.clocks.timer2,
            BaudSource::States => Ticks::STATES,
        }
    }

    /// Counts of the source per tick: 1, or 2 if SMOD is clear.
    const fn divider(&self, source: BaudSource) -> u64 {
        match source {
            BaudSource::Timer1 | BaudSource::States if !self.clocks.is_double => 2,
            _ => 1,
        }
    }

    /// Ticks of a side since the last call; they count as applied.
    fn take_ticks(&mut self, side: PortSide, t: u64) -> u64 {
        let source = self.sources()[side as usize];
        let (counted, divider) = (self.ticks_of(source).count_by_cycle(t), self.divider(source));
        let before = &mut self.applied[side as usize];
        let ticks = (counted / divider).saturating_sub(*before / divider);
        *before = counted.max(*before);
        ticks
    }

    /// The cycle of the tick of a side for which it waits.
    fn cycle_of_tick(&self, side: PortSide, wait: Option<u64>) -> u64 {
        let Some(wait) = wait else { return NEVER };
        let source = self.sources()[side as usize];
        let divider = self.divider(source);
        let count = (self.applied[side as usize] / divider).saturating_add(wait).saturating_mul(divider);
        self.ticks_of(source).cycle_of(count)
    }
}

impl Default for Mcs51Serial {
    fn default() -> Mcs51Serial {
        Mcs51Serial::new()
    }
}

/// Leaves the effects of a step at `t`.
fn leave_signals(step: SerialStep, t: u64, out: &mut Mcs51Outbox) {
    if step.flags != 0 {
        out.push(Mcs51Signal::Flag);
    }
    out.extend(step.edges().map(|edge| Mcs51Signal::Edge { t, edge }));
    out.extend(step.sent_byte.map(|byte| Mcs51Signal::Sent { t, byte }));
}

impl Device<Mcs51Signal> for Mcs51Serial {
    /// A direct address.
    type Reg = u8;

    /// Advances the port to S5P2 of cycle `t`.
    fn run_due(&mut self, t: u64, out: &mut Mcs51Outbox) {
        while self.port.next_shift_cycle() <= t {
            let cycle = self.port.next_shift_cycle();
            leave_signals(self.port.step_shifter(cycle, self.port.rxd_level()), cycle, out);
        }
        if self.port.mode() == 0 {
            return;
        }
        let mut ticks = self.take_ticks(PortSide::Transmitter, t);
        while let Some(wait) = self.port.tx_ticks_to_next_step().filter(|&wait| wait <= ticks) {
            self.port.tx_advance(wait - 1);
            leave_signals(self.port.step_transmitter(t), t, out);
            ticks -= wait;
        }
        self.port.tx_advance(ticks);
        let mut ticks = self.take_ticks(PortSide::Receiver, t);
        while let Some(wait) = self.port.rx_ticks_to_next_step().filter(|&wait| wait <= ticks) {
            self.port.rx_advance(wait - 1);
            leave_signals(self.port.step_receiver(t, self.port.rxd_level()), t, out);
            ticks -= wait;
        }
        self.port.rx_advance(ticks);
    }

    fn next_deadline(&self) -> u64 {
        let tx = self.cycle_of_tick(PortSide::Transmitter, self.port.tx_ticks_to_next_step());
        let rx = self.cycle_of_tick(PortSide::Receiver, self.port.rx_ticks_to_next_step());
        tx.min(rx).min(self.port.next_shift_cycle())
    }

    fn interrupt_requests(&self) -> u8 {
        u8::from(self.port.flags_set_since() != NEVER)
    }

    fn peek(&self, reg: u8, _t: u64) -> u8 {
        match reg {
            sfr::SCON => self.port.scon(),
            sfr::SBUF => self.port.sbuf(),
            _ => 0,
        }
    }

    fn write(&mut self, reg: u8, value: u8, mask: u8, t: u64, out: &mut Mcs51Outbox) {
        self.run_due(t, out);
        let sources = self.sources();
        let step = match reg {
            sfr::SCON => self.port.set_scon(self.port.scon() & !mask | value & mask, t),
            sfr::SBUF => self.port.write_sbuf(value, t),
            _ => return,
        };
        leave_signals(step, t, out);
        self.rebase(sources, t);
    }

    /// A level of RXD at S5P2 of cycle `t`, before the ticks of that cycle.
    fn on_line_changed(&mut self, line: PinId, high: bool, t: u64, out: &mut Mcs51Outbox) {
        if line == pin::RXD {
            self.run_due(t.saturating_sub(1), out);
            self.port.set_rxd_level(high);
        }
    }

    fn reset(&mut self, _power_on: bool, _t: u64, _out: &mut Mcs51Outbox) {
        *self = Mcs51Serial::new();
    }

    fn steady_until(&self, _reg: u8, _t: u64) -> u64 {
        self.next_deadline()
    }
}
