//! USART (sections 20 and 21): asynchronous, synchronous, and as SPI master.
//!
//! All bits are on the lines: [`AvrSignal::Drive`] drives TXD and XCK, and
//! [`on_line_changed`](super::Device::on_line_changed) receives RXD and XCK. The DDR bit of XCK, which
//! selects clock master or slave, arrives by
//! [`on_direction_changed`](super::Device::on_direction_changed). Between the events of
//! [`next_deadline`](super::Device::next_deadline) the port may be behind; it catches up when it is accessed.

mod baud;
mod device;
mod fifo;
mod frame;
mod receiver;
mod sender;

use crate::periph::usart::frame::FrameBits;
use emu_core::NEVER;
use emu_core::state;

use super::edges::SynchronizedPin;
use super::{AvrDrive, AvrLine, AvrOutbox, AvrSignal};
use baud::BaudClock;
use fifo::ReceiveFifo;
use frame::{FrameFormat, FrameProgress, ReceivedCharacter};
use receiver::UsartReceiver;
use sender::UsartSender;

/// UCSRA: receive complete. In UCSRB the same bit enables its interrupt.
pub const RXC: u8 = 1 << 7;
/// UCSRA: transmit complete; in UCSRB its interrupt enable.
pub const TXC: u8 = 1 << 6;
/// UCSRA: data register empty; in UCSRB its interrupt enable.
pub const UDRE: u8 = 1 << 5;
/// UCSRA: frame error.
pub const FE: u8 = 1 << 4;
/// UCSRA: data overrun.
pub const DOR: u8 = 1 << 3;
/// UCSRA: parity error.
pub const UPE: u8 = 1 << 2;
/// UCSRA: double speed.
pub const U2X: u8 = 1 << 1;
/// UCSRA: multi-processor mode.
pub const MPCM: u8 = 1;
/// UCSRB: receiver enable.
pub const RXEN: u8 = 1 << 4;
/// UCSRB: transmitter enable.
pub const TXEN: u8 = 1 << 3;
/// UCSRB: the third bit of the character size.
pub const UCSZ2: u8 = 1 << 2;
/// UCSRB: the ninth bit received.
pub const RXB8: u8 = 1 << 1;
/// UCSRB: the ninth bit to send.
pub const TXB8: u8 = 1;
/// UCSRC: the lowest bit of the character size; clock phase in master SPI mode.
const UCPHA: u8 = 1 << 1;
/// UCSRC: data order in master SPI mode.
const UDORD: u8 = 1 << 2;
/// UCSRC: clock polarity.
const UCPOL: u8 = 1;

/// The registers of the USART.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UsartRegister {
    UDR,
    UCSRA,
    UCSRB,
    UCSRC,
    UBRRL,
    UBRRH,
}

/// Operating mode, by UMSEL. The reserved value acts as asynchronous.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum UsartMode {
    Async,
    Sync,
    Spi,
}

/// A USART.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrUsart {
    /// TXC, U2X and MPCM of UCSRA.
    a: u8,
    /// Cycle at which TXC was last set.
    complete: u64,
    /// UCSRB without RXB8.
    b: u8,
    /// UCSRC.
    c: u8,
    baud: BaudClock,
    sender: UsartSender,
    /// Written value of UDR with its ninth bit, until it is sent.
    buffer: Option<u16>,
    receiver: UsartReceiver,
    fifo: ReceiveFifo,
    rxd: bool,
    xck: SynchronizedPin,
    /// True if DDR makes XCK an output: this port generates the clock.
    master: bool,
    /// Cycle of the next half bit, if this port generates the clock; `NEVER` while the clock is idle.
    half: u64,
    /// Overrides of TXD, RXD and XCK.
    drives: [AvrDrive; 3],
    /// Cycle at which the clock was stopped; None while it runs.
    asleep: Option<u64>,
}

state! {
    AvrUsart {
        a, complete, b, c, baud, sender, buffer, receiver, fifo, rxd, xck, master, half, drives, asleep,
    } if |usart, now| usart.is_valid_state(now)
}

impl AvrUsart {
    /// Returns a port after power-on at `t`, with all lines low.
    #[must_use]
    pub fn new(t: u64) -> AvrUsart {
        AvrUsart {
            a: 0,
            complete: NEVER,
            b: 0,
            c: 0x06,
            baud: BaudClock::new(t),
            sender: UsartSender::IDLE,
            buffer: None,
            receiver: UsartReceiver::OFF,
            fifo: ReceiveFifo::EMPTY,
            rxd: false,
            xck: SynchronizedPin::new(false),
            master: false,
            half: NEVER,
            drives: [AvrDrive::Port; 3],
            asleep: None,
        }
    }

    /// Reports whether the transmitter has something to send.
    #[must_use]
    pub fn is_sending(&self) -> bool {
        self.is_transmitting() && (self.buffer.is_some() || self.sender.active)
    }

    /// Reports whether a frame that arrives would request an interrupt.
    #[must_use]
    pub fn is_receiver_enabled(&self) -> bool {
        self.is_receiving_enabled() && self.b & RXC != 0
    }

    /// Checks that a restored state is possible for a port that has executed everything up to `now`.
    fn is_valid_state(&self, now: u64) -> bool {
        let next = self.sender.next().min(self.receiver.next()).min(self.half).min(self.xck.next());
        self.asleep.map_or(next > now, |since| since <= now + 1 && next >= since)
    }

    fn mode(&self) -> UsartMode {
        match self.c >> 6 {
            1 => UsartMode::Sync,
            3 => UsartMode::Spi,
            _ => UsartMode::Async,
        }
    }

    fn is_async(&self) -> bool {
        self.mode() == UsartMode::Async
    }

    fn format(&self) -> FrameFormat {
        FrameFormat::new(self.b, self.c)
    }

    fn is_receiving_enabled(&self) -> bool {
        self.b & RXEN != 0
    }

    /// Reports whether the port drives TXD. A transmitter that is switched off continues until everything is
    /// sent (section 20.6.5).
    fn is_transmitting(&self) -> bool {
        self.b & TXEN != 0 || self.sender.active
    }

    /// Returns the ticks of the baud rate generator per asynchronous bit (table 20-1).
    fn samples_per_bit(&self) -> u64 {
        if self.a & U2X != 0 { 8 } else { 16 }
    }

    /// Returns UCSRA.
    fn status(&self) -> u8 {
        let errors = if self.mode() == UsartMode::Spi { 0 } else { self.fifo.errors() };
        let received = if self.fifo.is_full() { RXC | errors } else { 0 };
        let empty = if self.buffer.is_none() { UDRE } else { 0 };
        self.a | received | empty
    }

    /// Returns the cycle of the next internal step.
    fn due(&self) -> u64 {
        match self.asleep {
            Some(_) => NEVER,
            None => self.sender.next().min(self.receiver.next()).min(self.half).min(self.xck.next()),
        }
    }

    fn step(&mut self, t: u64, out: &mut AvrOutbox) {
        if let Some(high) = self.xck.pop(t).filter(|_| !self.master && !self.is_async()) {
            self.on_clock_edge(self.is_setup_edge(high), t, out);
        }
        if self.half <= t {
            self.on_clock_edge(self.baud.edges_until(t).is_multiple_of(2), t, out);
        }
        if self.sender.next() <= t {
            self.sender.catch_up(t.saturating_sub(1), &self.baud, self.samples_per_bit());
            self.shift(t, out);
        }
        if self.receiver.next() <= t {
            let found = self.receiver.sample(self.rxd, self.format(), self.samples_per_bit(), &self.baud);
            self.on_frame_progress(found);
        }
        self.drive_lines(t, out);
    }

    /// Reports whether the edge of XCK to this level is the one at which data changes, not the one at which
    /// it is sampled (figures 20-3, 21-1).
    fn is_setup_edge(&self, high: bool) -> bool {
        let leading = high != (self.c & UCPOL != 0);
        leading == (self.mode() == UsartMode::Sync || self.c & UCPHA != 0)
    }

    /// Returns the level of XCK. A bit has two halves; data changes at the start of the first.
    fn xck_level(&self, t: u64) -> bool {
        let first_half = self.baud.edges_until(t).is_multiple_of(2);
        let idle = self.c & UCPOL != 0;
        match self.mode() {
            UsartMode::Spi if !self.sender.started => idle,
            UsartMode::Spi => idle != (first_half == (self.c & UCPHA != 0)),
            _ => idle != first_half,
        }
    }

    /// Handles an edge of the clock in synchronous and SPI mode.
    fn on_clock_edge(&mut self, sets_up: bool, t: u64, out: &mut AvrOutbox) {
        if sets_up {
            self.shift(t, out);
        } else if self.mode() == UsartMode::Sync {
            let found = self.receiver.sample_clocked(self.rxd, self.format());
            if self.is_receiving_enabled() {
                self.on_frame_progress(found);
            }
        } else if self.sender.started {
            self.shift_in();
        }
        self.reschedule_receiver(t);
    }

    /// Samples a bit in master SPI mode, one for each bit sent. The last one completes the byte.
    fn shift_in(&mut self) {
        if !self.is_receiving_enabled() {
            return;
        }
        self.fifo.overwrite();
        self.receiver.shift = self.receiver.shift << 1 | u8::from(self.rxd);
        if self.sender.is_at_last_bit() {
            let byte = self.in_bit_order(self.receiver.shift);
            self.fifo.on_frame_received(ReceivedCharacter { byte, ..ReceivedCharacter::NONE });
        }
    }

    fn on_frame_progress(&mut self, found: FrameProgress) {
        match found {
            FrameProgress::Start => self.fifo.on_start_bit(),
            FrameProgress::Done(frame) if self.a & MPCM == 0 || frame.address => self.fifo.on_frame_received(frame),
            _ => {}
        }
    }

    /// Handles the end of a sent bit.
    fn shift(&mut self, t: u64, out: &mut AvrOutbox) {
        if self.sender.active && !self.sender.next_bit() {
            if self.mode() != UsartMode::Spi {
                out.push(AvrSignal::Sent { t, byte: self.sender.byte });
            }
            (self.sender.active, self.sender.started) = (false, false);
            match self.buffer.take() {
                None => {
                    self.a |= TXC;
                    self.complete = t;
                    self.sender.level |= self.mode() != UsartMode::Spi;
                }
                Some(word) => {
                    self.load(word);
                    self.sender.next_bit();
                }
            }
        }
        self.reschedule_sender(t);
    }

    /// Converts between a byte of master SPI mode and the order with bit 7 first.
    fn in_bit_order(&self, byte: u8) -> u8 {
        if self.c & UDORD != 0 { byte.reverse_bits() } else { byte }
    }

    fn load(&mut self, word: u16) {
        let byte = word as u8;
        match self.mode() {
            // The shift register sends the lowest bit first.
            UsartMode::Spi => {
                self.sender.load(byte, FrameBits { bits: u16::from(self.in_bit_order(byte).reverse_bits()), count: 8 })
            }
            _ => self.sender.load(self.format().data(word) as u8, self.format().frame(word)),
        }
    }

    /// Moves the buffer to an idle shift register.
    fn load_next(&mut self, t: u64) {
        let ready = self.b & TXEN != 0 && !self.sender.active;
        if let Some(word) = self.buffer.take_if(|_| ready) {
            self.load(word);
            self.reschedule_sender(t);
            self.reschedule_receiver(t);
        }
    }

    fn reschedule_sender(&mut self, t: u64) {
        if self.is_async() {
            self.sender.schedule(t, &self.baud, self.samples_per_bit());
        } else {
            self.sender.unschedule();
        }
    }

    /// Schedules the start of the next half bit.
    fn reschedule_receiver(&mut self, t: u64) {
        let runs = match self.mode() {
            UsartMode::Async => false,
            UsartMode::Sync => self.master,
            UsartMode::Spi => self.master && self.sender.active,
        };
        self.half = if runs { self.baud.nth(t, 1) } else { NEVER };
    }

    /// Applies a change of the clock, the mode or the baud rate.
    fn change_clock(&mut self, t: u64, change: impl FnOnce(&mut AvrUsart)) {
        self.sender.catch_up(t, &self.baud, self.samples_per_bit());
        self.receiver.catch_up(t, &self.baud);
        let before = (self.mode(), self.master);
        change(self);
        if (self.mode(), self.master) != before && (!self.is_async() || before.0 != UsartMode::Async) {
            self.receiver = UsartReceiver::begin(self.is_receiving_enabled());
            if self.is_async() {
                self.receiver.schedule_sample(t, &self.baud);
            }
            self.sender.level |= !self.sender.started && self.mode() != UsartMode::Spi;
        }
        self.receiver.schedule(t, &self.baud);
        self.reschedule_sender(t);
        self.reschedule_receiver(t);
    }

    /// Sends the overrides of the lines that have changed (table 14-10).
    fn drive_lines(&mut self, t: u64, out: &mut AvrOutbox) {
        let txd = if self.is_transmitting() { AvrDrive::Output(self.sender.level) } else { AvrDrive::Port };
        let rxd = if self.is_receiving_enabled() { AvrDrive::Input } else { AvrDrive::Port };
        let xck = if self.master && !self.is_async() { AvrDrive::Value(self.xck_level(t)) } else { AvrDrive::Port };
        let lines = [AvrLine::Txd, AvrLine::Rxd, AvrLine::Xck].into_iter().zip([txd, rxd, xck]);
        for ((line, drive), held) in lines.zip(&mut self.drives) {
            if std::mem::replace(held, drive) != drive {
                out.push(AvrSignal::Drive { t, line, drive });
            }
        }
    }
}
