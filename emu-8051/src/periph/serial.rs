//! The serial port (user's manual, "Standard serial interface" and "More about mode 0, 1, 2 and 3"; SCON, SBUF).
//!
//! In modes 1 to 3 the part knows ticks of its two 16x baud clocks, not cycles: the caller maps them to time, says how many
//! have passed, and takes a step at those that matter. Ticks may pass in every mode; a caller that has no clock for mode 0
//! passes none. Mode 0 counts machine cycles. What the manual leaves open is settled so:
//!
//! - A byte written while another is still being shifted takes its place: it begins at the next rollover, and the old
//!   one ends there without TI. In mode 0 the old one ends with the cycle of the write. The same holds for a byte that
//!   waits for its rollover. A stop bit is not shifting: the byte waits for its end.
//! - A change of SM0 or SM1 makes both sides idle at the end of the cycle of the write, and the lines high. A byte whose
//!   stop bit is on the line then counts as sent.
//! - Clearing REN ends a reception under way, in every mode. RXD is sampled whether REN is set or not, so that a line that
//!   is low already when REN is set begins no frame.
//! - In mode 0 setting RI by program does not end a reception under way, and clearing it does not begin another.
//! - TXD and RXD change at S1P1: with modes 1 to 3 of the cycle after that of the rollover, in mode 0 after the shift.
//! - A flag that is set already is not set again: its moment stays the first one.

mod rx;
mod shift;
mod tx;

use emu_core::NEVER;
use emu_core::pins::CycleTime;
use emu_core::state;

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
/// SCON: reception is on.
pub const REN: u8 = 1 << 4;
/// SCON: takes frames only whose ninth (mode 1: stop) bit is 1.
pub const SM2: u8 = 1 << 5;
/// SCON: SM0 and SM1, the mode.
const SM_BITS: u8 = 3 << 6;

/// The clocks of a machine cycle at which the shift clock of mode 0 goes low (S3P1) and high again (S6P1).
const CLOCK_LOW: u8 = 4;
const CLOCK_HIGH: u8 = 10;

/// A line of the port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SerialLine {
    #[default]
    /// TXD, P3.1.
    Txd,
    /// RXD, P3.0, which mode 0 puts out. High leaves the pin to its latch.
    Rxd,
}

state! { enum SerialLine { 0 = Txd, 1 = Rxd } }

/// A change of a level that the port puts out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SerialEdge {
    /// Machine cycle, and clock 0 to 11 in it, from which the level holds.
    pub at: CycleTime,
    /// Which line.
    pub line: SerialLine,
    /// Its level from then on.
    pub level: bool,
}

state! { SerialEdge { at, line, level } if |edge, _now| edge.at.phase < 12 && edge.at.cycle != NEVER }

/// What the port did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[must_use]
pub struct SerialStep {
    edges: [Option<SerialEdge>; 3],
    /// The flags that were set, TI and RI. One that was set before is not among them.
    pub flags: u8,
    /// The stop bit of this byte has passed; in mode 0 its last bit has.
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
    /// The cycles at which RI and TI were set; [`NEVER`] while they are not.
    since: [u64; 2],
    /// TXD of modes 1 to 3, and the cycle at whose S1P1 it took that level.
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
    /// The port as after reset, its line high. SBUF is undefined then; it is 0 here.
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

    /// SBUF as read: the receive buffer.
    #[must_use]
    pub const fn sbuf(&self) -> u8 {
        self.sbuf
    }

    /// The mode, 0 to 3.
    #[must_use]
    pub const fn mode(&self) -> u8 {
        self.scon >> 6
    }

    /// The cycle at whose S5P2 the earlier one of RI and TI, of those that are set, counts as set; [`NEVER`]
    /// if none is. Written by a program in cycle w it is w + 1, set at S1P1 of a cycle (mode 0) it is that cycle.
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

    /// Writes SBUF at the end of `cycle`: a byte to send, in modes 2 and 3 with TB8 as it is now.
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

    /// Ticks of the transmit clock to the one at which the transmitter does something, 1 to 16; `None` while it has
    /// nothing to do.
    #[must_use]
    pub fn tx_ticks_to_next_step(&self) -> Option<u64> {
        self.sender.ticks_to_next_step()
    }

    /// `n` ticks of the transmit clock pass at which nothing happens: fewer than [`SerialPort::tx_ticks_to_next_step`], or any number.
    pub fn tx_advance(&mut self, n: u64) {
        self.sender.advance(n);
    }

    /// The tick that [`SerialPort::tx_ticks_to_next_step`] gave, in machine cycle `cycle`.
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

    /// RXD has this level from now on. To be told of every change, after the ticks up to then.
    pub fn set_rxd_level(&mut self, level: bool) {
        self.receiver.set_level(level);
    }

    /// Ticks of the receive clock, the line staying as it is, to the one that matters; `None` while none does. Changed by
    /// [`SerialPort::line`].
    #[must_use]
    pub fn rx_ticks_to_next_step(&self) -> Option<u64> {
        self.receiver.ticks_to_next_step(self.is_listening())
    }

    /// `n` ticks of the receive clock pass, the line staying as it is: fewer than [`SerialPort::rx_ticks_to_next_step`], or any number.
    pub fn rx_advance(&mut self, n: u64) {
        self.receiver.advance(n, self.is_listening(), self.mode() == 1);
    }

    /// A tick of the receive clock in machine cycle `cycle`, at which RXD has the level `sample`. Right for every tick,
    /// also one at which nothing happens.
    pub fn step_receiver(&mut self, cycle: u64, sample: bool) -> SerialStep {
        let mut step = SerialStep::default();
        if let Some(bits) = self.receiver.sample(sample, self.is_listening(), self.mode() == 1) {
            let ninth = bits & 1 << 8 != 0;
            // Else the frame is lost, and the byte before it stays.
            if self.scon & RI == 0 && (self.scon & SM2 == 0 || ninth) {
                self.sbuf = bits as u8;
                self.scon = self.scon & !RB8 | if ninth { RB8 } else { 0 };
                self.raise_flag(RI, cycle, &mut step);
            }
        }
        step
    }

    /// Mode 0: the machine cycle of the next step; [`NEVER`] when idle.
    #[must_use]
    pub fn next_shift_cycle(&self) -> u64 {
        self.shifter.next()
    }

    /// Mode 0: the machine cycle that [`SerialPort::next_shift_cycle`] gave, up to S5P2, where RXD has the level `rxd`. The clock's
    /// rise after that is among the edges.
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

    /// The level of TXD once all edges that were handed out have come: where a program changes nothing, that at the
    /// begin of the next cycle. The caller ANDs it with the latch.
    #[must_use]
    pub const fn txd(&self) -> bool {
        self.txd.0
    }

    /// The level of TXD at S5P2 of `cycle`, the one up to which all steps were taken.
    #[must_use]
    pub fn txd_at(&self, cycle: u64) -> bool {
        !self.shifter.is_clock_running() && self.txd.0 == (cycle >= self.txd.1)
    }

    /// The data bit that mode 0 puts on RXD in the cycle up to which all steps were taken; `None` when it sends none.
    #[must_use]
    pub fn driven_rxd(&self) -> Option<bool> {
        self.shifter.driven_level()
    }

    /// A byte was written that is not sent yet, its stop bit included.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.sender.is_busy() || self.shifter.is_sending()
    }

    /// The byte whose stop bit is on the line: TI was set as that began.
    #[must_use]
    pub fn byte_in_stop_bit(&self) -> Option<u8> {
        self.sender.byte_in_stop_bit()
    }

    /// From the start bit's edge until the port looks for the next one; in mode 0 from the write until RI.
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

    /// TXD takes `level` after `cycle`.
    fn set_txd(&mut self, level: bool, cycle: u64, step: &mut SerialStep) {
        if self.txd.0 != level {
            let from = cycle.saturating_add(1);
            self.txd = (level, from);
            step.push_edge(SerialLine::Txd, level, from, 0);
        }
    }

    /// What mode 0 sends on RXD ends with `cycle`.
    fn release_rxd(&mut self, step: &mut SerialStep, cycle: u64) {
        if self.shifter.driven_level() == Some(false) {
            step.push_edge(SerialLine::Rxd, true, cycle.saturating_add(1), 0);
        }
    }
}
