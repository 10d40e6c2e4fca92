//! The serial port (user's manual, "Standard serial interface" and "More about mode 0, 1, 2 and 3"; SCON,
//! SBUF).
//!
//! In modes 1 to 3 the port counts ticks of its two 16x baud clocks, not cycles. The caller maps ticks to
//! time, reports how many have passed, and calls a step function at those that matter. Ticks can pass in
//! every mode; a caller without a clock in mode 0 reports none. Mode 0 counts machine cycles. Where the
//! manual is silent, the model decides:
//!
//! - A byte written while another is still being shifted replaces it: it begins at the next rollover, and the
//!   old byte ends there without TI. In mode 0 the old byte ends with the cycle of the write. The same
//!   applies to a byte that waits for its rollover. During a stop bit nothing is shifted: the new byte waits
//!   for its end.
//! - A change of SM0 or SM1 makes both sides idle and the lines high at the end of the cycle of the write. A
//!   byte whose stop bit is on the line then counts as sent.
//! - Clearing REN ends a reception in progress, in every mode. RXD is sampled whether REN is set or not, so a
//!   line that is already low when REN is set starts no frame.
//! - In mode 0, a program that sets RI does not end a reception in progress, and clearing RI then does not
//!   start another one.
//! - TXD and RXD change at S1P1: in modes 1 to 3 of the cycle after that of the rollover, in mode 0 after the
//!   shift.
//! - A flag that is already set is not set again: its time stays that of the first event.

mod clocked;
mod rx;
mod shift;
mod tx;

use emu_core::NEVER;
use emu_core::pins::CycleTime;
use emu_core::state;

pub use clocked::{BaudClocks, Mcs51Serial};
use rx::SerialReceiver;
use shift::ShiftRegister;
use tx::SerialSender;

/// SCON: a byte was received.
pub const RI: u8 = 1;
/// SCON: a byte was sent.
pub const TI: u8 = 1 << 1;
/// SCON: the ninth bit received, or the stop bit in mode 1.
pub const RB8: u8 = 1 << 2;
/// SCON: the ninth bit to send.
pub const TB8: u8 = 1 << 3;
/// SCON: reception is enabled.
pub const REN: u8 = 1 << 4;
/// SCON: accepts only frames whose ninth bit (in mode 1: stop bit) is 1.
pub const SM2: u8 = 1 << 5;
/// SCON: SM0 and SM1, the mode.
const SM_BITS: u8 = 3 << 6;

/// Clocks of a machine cycle at which the shift clock of mode 0 goes low (S3P1) and high again (S6P1).
const CLOCK_LOW: u8 = 4;
const CLOCK_HIGH: u8 = 10;

/// A line of the port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SerialLine {
    #[default]
    /// TXD, P3.1.
    Txd,
    /// RXD, P3.0, which is an output in mode 0. High releases the pin to its latch.
    Rxd,
}

state! { enum SerialLine { 0 = Txd, 1 = Rxd } }

/// A change of a level that the port outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SerialEdge {
    /// Machine cycle, and clock 0 to 11 in it, from which the level is valid.
    pub at: CycleTime,
    /// The line.
    pub line: SerialLine,
    /// The new level.
    pub level: bool,
}

state! { SerialEdge { at, line, level } if |edge, _now| edge.at.phase < 12 && edge.at.cycle != NEVER }

/// The effects of one step of the port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[must_use]
pub struct SerialStep {
    edges: [Option<SerialEdge>; 3],
    /// The flags that were set, TI and RI. A flag that was already set is not included.
    pub flags: u8,
    /// The byte whose stop bit has ended; in mode 0, whose last bit has ended.
    pub sent_byte: Option<u8>,
}

impl SerialStep {
    /// The changes of the lines, in order of time.
    pub fn edges(&self) -> impl Iterator<Item = SerialEdge> {
        self.edges.into_iter().flatten()
    }

    fn push_edge(&mut self, line: SerialLine, level: bool, cycle: u64, phase: u8) {
        if let Some(free) = self.edges.iter_mut().find(|edge| edge.is_none()) {
            *free = Some(SerialEdge { at: CycleTime { cycle, phase }, line, level });
        }
    }
}

/// The serial port.
#[derive(Debug, Clone, PartialEq)]
pub struct SerialPort {
    scon: u8,
    /// The receive buffer.
    sbuf: u8,
    /// The cycles at which RI and TI were set; [`NEVER`] if they are clear.
    since: [u64; 2],
    /// TXD in modes 1 to 3, and the cycle at whose S1P1 it took that level.
    txd: (bool, u64),
    sender: SerialSender,
    receiver: SerialReceiver,
    shifter: ShiftRegister,
}

state! { SerialPort { scon, sbuf, since, txd, sender, receiver, shifter } }

impl Default for SerialPort {
    fn default() -> SerialPort {
        SerialPort::new()
    }
}

impl SerialPort {
    /// The port after reset, with its line high. SBUF is undefined after reset; it is 0 here.
    #[must_use]
    pub const fn new() -> SerialPort {
        SerialPort {
            scon: 0,
            sbuf: 0,
            since: [NEVER; 2],
            txd: (true, 0),
            sender: SerialSender::IDLE,
            receiver: SerialReceiver::IDLE,
            shifter: ShiftRegister::IDLE,
        }
    }

    /// SCON.
    #[must_use]
    pub const fn scon(&self) -> u8 {
        self.scon
    }

    /// SBUF as a program reads it: the receive buffer.
    #[must_use]
    pub const fn sbuf(&self) -> u8 {
        self.sbuf
    }

    /// The mode, 0 to 3.
    #[must_use]
    pub const fn mode(&self) -> u8 {
        self.scon >> 6
    }

    /// The cycle at whose S5P2 the request begins: that of the earlier of RI and TI, among those that are
    /// set; [`NEVER`] if none is set. A flag written by a program in cycle w has the cycle w + 1. A flag set
    /// at S1P1 of a cycle (mode 0) has that cycle.
    #[must_use]
    pub fn flags_set_since(&self) -> u64 {
        self.since[0].min(self.since[1])
    }

    /// Writes SCON at the end of `cycle`.
    pub fn set_scon(&mut self, v: u8, cycle: u64) -> SerialStep {
        let mut step = SerialStep::default();
        if (v ^ self.scon) & SM_BITS != 0 {
            self.release_rxd(&mut step, cycle);
            self.set_txd(true, cycle, &mut step);
            step.sent_byte = self.sender.abort();
            self.receiver.abort();
            self.shifter = ShiftRegister::IDLE;
        }
        if v & REN == 0 {
            self.receiver.abort();
            self.shifter.stop_receiving();
        }
        for (flag, since) in [RI, TI].into_iter().zip(&mut self.since) {
            *since = if v & flag == 0 { NEVER } else { (*since).min(cycle.saturating_add(1)) };
        }
        self.scon = v;
        if self.mode() == 0 && v & (REN | RI) == REN {
            self.shifter.receive(cycle);
        }
        step
    }

    /// Writes SBUF at the end of `cycle`: a byte to send, in modes 2 and 3 with the present TB8.
    pub fn write_sbuf(&mut self, v: u8, cycle: u64) -> SerialStep {
        let mut step = SerialStep::default();
        match self.mode() {
            0 => {
                self.release_rxd(&mut step, cycle);
                self.shifter.send(v, cycle);
            }
            1 => self.sender.load(v, None),
            _ => self.sender.load(v, Some(self.scon & TB8 != 0)),
        }
        step
    }

    /// Ticks of the transmit clock until the transmitter acts, 1 to 16; `None` if it has nothing to do.
    #[must_use]
    pub fn tx_ticks_to_next_step(&self) -> Option<u64> {
        self.sender.ticks_to_next_step()
    }

    /// Lets `n` ticks of the transmit clock pass in which nothing happens: fewer than
    /// [`SerialPort::tx_ticks_to_next_step`], or any number if that is `None`.
    pub fn tx_advance(&mut self, n: u64) {
        self.sender.advance(n);
    }

    /// Executes the tick given by [`SerialPort::tx_ticks_to_next_step`], in machine cycle `cycle`.
    pub fn step_transmitter(&mut self, cycle: u64) -> SerialStep {
        let did = self.sender.step();
        let mut step = SerialStep { sent_byte: did.sent, ..SerialStep::default() };
        if let Some(level) = did.line {
            self.set_txd(level, cycle, &mut step);
        }
        if did.ti {
            self.raise_flag(TI, cycle, &mut step);
        }
        step
    }

    /// Sets the level of RXD from now on. Every change must be reported, after the ticks before it.
    pub fn set_rxd_level(&mut self, level: bool) {
        self.receiver.set_level(level);
    }

    /// The level of RXD, as set by [`SerialPort::set_rxd_level`].
    #[must_use]
    pub const fn rxd_level(&self) -> bool {
        self.receiver.level()
    }

    /// Ticks of the receive clock until one that matters, if the line does not change; `None` if there is
    /// none. [`SerialPort::set_rxd_level`] changes it.
    #[must_use]
    pub fn rx_ticks_to_next_step(&self) -> Option<u64> {
        self.receiver.ticks_to_next_step(self.is_listening())
    }

    /// Lets `n` ticks of the receive clock pass with an unchanged line: fewer than
    /// [`SerialPort::rx_ticks_to_next_step`], or any number if that is `None`.
    pub fn rx_advance(&mut self, n: u64) {
        self.receiver.advance(n, self.is_listening(), self.mode() == 1);
    }

    /// Executes a tick of the receive clock in machine cycle `cycle`, at which RXD has the level `sample`. It
    /// is valid for every tick, even for one in which nothing happens.
    pub fn step_receiver(&mut self, cycle: u64, sample: bool) -> SerialStep {
        let mut step = SerialStep::default();
        if let Some(bits) = self.receiver.sample(sample, self.is_listening(), self.mode() == 1) {
            let ninth = bits & 1 << 8 != 0;
            // Otherwise the frame is lost, and the byte before it stays.
            if self.scon & RI == 0 && (self.scon & SM2 == 0 || ninth) {
                self.sbuf = bits as u8;
                self.scon = self.scon & !RB8 | if ninth { RB8 } else { 0 };
                self.raise_flag(RI, cycle, &mut step);
            }
        }
        step
    }

    /// Mode 0: the machine cycle of the next step, or [`NEVER`] if idle.
    #[must_use]
    pub fn next_shift_cycle(&self) -> u64 {
        self.shifter.next()
    }

    /// Mode 0: executes the machine cycle given by [`SerialPort::next_shift_cycle`] up to S5P2, where RXD has
    /// the level `rxd`. The rising clock edge after that is among the edges.
    pub fn step_shifter(&mut self, cycle: u64, rxd: bool) -> SerialStep {
        debug_assert!(cycle == self.next_shift_cycle(), "no shift is due in {cycle}: {self:?}");
        let before = self.shifter.driven_level().unwrap_or(true);
        let did = self.shifter.step(cycle, rxd);
        let mut step = SerialStep { sent_byte: did.sent, ..SerialStep::default() };
        let after = self.shifter.driven_level().unwrap_or(true);
        if before != after {
            step.push_edge(SerialLine::Rxd, after, cycle, 0);
        }
        if did.clock {
            step.push_edge(SerialLine::Txd, false, cycle, CLOCK_LOW);
            step.push_edge(SerialLine::Txd, true, cycle, CLOCK_HIGH);
        }
        if did.sent.is_some() {
            self.raise_flag(TI, cycle, &mut step);
        }
        if let Some(byte) = did.received {
            self.sbuf = byte;
            self.raise_flag(RI, cycle, &mut step);
        }
        step
    }

    /// The level of TXD after all edges that were returned. If a program changes nothing, this is the level
    /// at the start of the next cycle. The caller ANDs it with the latch.
    #[must_use]
    pub const fn txd(&self) -> bool {
        self.txd.0
    }

    /// The level of TXD at S5P2 of `cycle`, the cycle up to which all steps were executed.
    #[must_use]
    pub fn txd_at(&self, cycle: u64) -> bool {
        !self.shifter.is_clock_running() && self.txd.0 == (cycle >= self.txd.1)
    }

    /// The data bit that mode 0 drives on RXD in the cycle up to which all steps were executed; `None` if it
    /// sends none.
    #[must_use]
    pub fn driven_rxd(&self) -> Option<bool> {
        self.shifter.driven_level()
    }

    /// Whether a byte was written that is not completely sent, including its stop bit.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.sender.is_busy() || self.shifter.is_sending()
    }

    /// The byte whose stop bit is on the line. TI was set when that stop bit began.
    #[must_use]
    pub fn byte_in_stop_bit(&self) -> Option<u8> {
        self.sender.byte_in_stop_bit()
    }

    /// Whether a frame is being received: from the edge of the start bit until the port looks for the next
    /// one; in mode 0 from the write until RI.
    #[must_use]
    pub fn is_receiving(&self) -> bool {
        self.receiver.is_receiving() || self.shifter.is_receiving()
    }

    fn is_listening(&self) -> bool {
        self.mode() != 0 && self.scon & REN != 0
    }

    fn raise_flag(&mut self, flag: u8, cycle: u64, step: &mut SerialStep) {
        if self.scon & flag == 0 {
            self.scon |= flag;
            self.since[usize::from(flag == TI)] = cycle;
            step.flags |= flag;
        }
    }

    /// Sets TXD to `level` after `cycle`.
    fn set_txd(&mut self, level: bool, cycle: u64, step: &mut SerialStep) {
        if self.txd.0 != level {
            let from = cycle.saturating_add(1);
            self.txd = (level, from);
            step.push_edge(SerialLine::Txd, level, from, 0);
        }
    }

    /// Ends the output of mode 0 on RXD with `cycle`.
    fn release_rxd(&mut self, step: &mut SerialStep, cycle: u64) {
        if self.shifter.driven_level() == Some(false) {
            step.push_edge(SerialLine::Rxd, true, cycle.saturating_add(1), 0);
        }
    }
}
