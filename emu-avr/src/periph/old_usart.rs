//! USART0 (data sheet 20): baud rate generator, double-buffered transmitter, receiver with its two-deep buffer. Frames are
//! 8N1 whatever UCSR0C says (QUIRKS.md).

use emu_core::NEVER;
use emu_core::parts::prescaler::Ticks;
use emu_core::parts::uart::{Found, Receiver, Sender, Step};

/// UCSR0A bits.
pub const RXC: u8 = 1 << 7;
/// Transmit complete.
pub const TXC: u8 = 1 << 6;
/// Data register empty.
pub const UDRE: u8 = 1 << 5;
/// Frame error.
pub const FE: u8 = 1 << 4;
/// Data overrun.
pub const DOR: u8 = 1 << 3;
const U2X: u8 = 1 << 1;
const MPCM: u8 = 1 << 0;
const RXEN: u8 = 1 << 4;
const TXEN: u8 = 1 << 3;
/// The bits of UCSR0B that a program writes; RXB8 reads 0.
const UCSRB_MASK: u8 = 0xFD;

/// A received byte with FE and DOR as UCSR0A shows them.
type Received = (u8, u8);

/// The serial port.
#[derive(Debug, Clone)]
pub struct Usart {
    /// TXC, U2X and MPCM.
    a: u8,
    b: u8,
    c: u8,
    ubrr: u16,
    /// The cycle at which the baud rate generator was loaded.
    origin: u64,
    sender: Sender,
    /// UDR0 for writing.
    buffer: Option<u8>,
    receiver: Receiver,
    /// UDR0 for reading: the oldest byte first.
    fifo: [Received; 2],
    held: u8,
    /// A complete frame that waits in the shift register because the buffer is full.
    waiting: Option<Received>,
    /// A frame was lost; the next one to arrive says so.
    lost: bool,
}

impl Usart {
    /// The port as after reset at the cycle `at`.
    pub const fn new(at: u64) -> Usart {
        Usart {
            a: 0,
            b: 0,
            c: 0x06,
            ubrr: 0,
            origin: at,
            sender: Sender::IDLE,
            buffer: None,
            receiver: Receiver::OFF,
            fifo: [(0, 0); 2],
            held: 0,
            waiting: None,
            lost: false,
        }
    }

    /// UCSR0A.
    pub fn status(&self) -> u8 {
        let received = if self.held == 0 { 0 } else { RXC | self.fifo[0].1 };
        let empty = if self.buffer.is_none() { UDRE } else { 0 };
        received | empty | self.a
    }

    /// UCSR0B.
    pub const fn control(&self) -> u8 {
        self.b
    }

    /// UCSR0C.
    pub const fn format(&self) -> u8 {
        self.c
    }

    /// UBRR0.
    pub const fn ubrr(&self) -> u16 {
        self.ubrr
    }

    /// UDR0 without taking the byte out.
    pub const fn peek(&self) -> u8 {
        self.fifo[0].0
    }

    /// True while the transmitter holds or sends a byte.
    pub fn sending(&self) -> bool {
        self.transmits() && (self.buffer.is_some() || self.shifting())
    }

    /// The port has the TXD pin: the transmitter is on, or switched off but not done yet (20.6.5).
    pub fn transmits(&self) -> bool {
        self.b & TXEN != 0 || self.shifting()
    }

    /// The port has the RXD pin.
    pub const fn receives(&self) -> bool {
        self.b & RXEN != 0
    }

    /// The interrupt flags that are set and enabled, as bits of UCSR0A (RXC, TXC, UDRE); the enables stand in the same
    /// places of UCSR0B.
    pub fn pending(&self) -> u8 {
        self.status() & self.b & (RXC | TXC | UDRE)
    }

    /// True when an enabled interrupt may still come: pins may be driven while the receiver is on.
    pub fn can_wake(&self) -> bool {
        self.pending() != 0 || self.b & RXC != 0 && self.receives() || self.b & (TXC | UDRE) != 0 && self.sending()
    }

    /// The cycle of the next step of either half.
    pub fn next(&self) -> u64 {
        self.sender.next().min(self.receiver.next())
    }

    /// True when the step due at [`Usart::next`] is the transmitter's.
    pub fn sender_first(&self) -> bool {
        self.sender.next() <= self.receiver.next()
    }

    /// Reads UDR0: takes the oldest byte; an empty buffer gives the byte read last.
    pub fn read(&mut self) -> u8 {
        let byte = self.fifo[0].0;
        match self.held {
            2 => {
                self.fifo[0] = self.fifo[1];
                self.held = 1;
                if let Some(next) = self.waiting.take() {
                    self.push(next);
                }
            }
            _ => self.held = 0,
        }
        byte
    }

    /// Writes UDR0; a full buffer ignores it (20.6.2). The byte goes on to an idle shifter at once.
    pub fn write(&mut self, byte: u8, at: u64) {
        if self.buffer.is_none() {
            self.buffer = Some(byte);
            self.load(at);
        }
    }

    /// Clears the flags of UCSR0A that `ones` has: TXC is one that a program (by writing 1) or its interrupt clears.
    pub fn clear(&mut self, ones: u8) {
        self.a &= !(ones & TXC);
    }

    /// Writes U2X and MPCM of UCSR0A.
    pub fn set_status(&mut self, value: u8, at: u64) {
        self.retime(at, |usart| usart.a = usart.a & TXC | value & (U2X | MPCM));
    }

    /// Writes UCSR0B.
    pub fn set_control(&mut self, value: u8, at: u64) {
        let before = std::mem::replace(&mut self.b, value & UCSRB_MASK);
        match (before & RXEN != 0, self.receives()) {
            (false, true) => self.receiver.enable(at, self.samples()),
            (true, false) => {
                (self.receiver, self.held, self.waiting, self.lost) = (Receiver::OFF, 0, None, false);
            }
            _ => {}
        }
        self.load(at);
    }

    /// Writes UCSR0C.
    pub fn set_format(&mut self, value: u8) {
        self.c = value;
    }

    /// Writes UBRR0L, which loads the baud rate generator anew (20.11.5).
    pub fn set_ubrr_low(&mut self, value: u8, at: u64) {
        self.retime(at, |usart| {
            usart.ubrr = usart.ubrr & 0x0F00 | u16::from(value);
            usart.origin = at;
        });
    }

    /// Writes UBRR0H.
    pub fn set_ubrr_high(&mut self, value: u8, at: u64) {
        self.retime(at, |usart| usart.ubrr = usart.ubrr & 0x00FF | u16::from(value & 0x0F) << 8);
    }

    /// Takes the transmitter's step that is due. At the end of a frame the next byte follows without a gap.
    pub fn send(&mut self) -> Step {
        let at = self.sender.next();
        let bits = self.bits();
        let step = self.sender.step(bits);
        if let Step::End(_) = step {
            match self.buffer.take() {
                Some(byte) => self.sender.follow(byte, at, bits),
                None => self.a |= TXC,
            }
        }
        step
    }

    /// True while the shifter is at work.
    pub fn shifting(&self) -> bool {
        self.sender.next() != NEVER
    }

    /// Takes the receiver's sample that is due: the line as sampled, and as it stands.
    pub fn receive(&mut self, sample: bool, line: bool) {
        let per_bit = self.per_bit() as u8;
        match self.receiver.step(sample, line, per_bit, self.samples()) {
            Some(Found::Start) => self.lost |= self.waiting.take().is_some(),
            Some(Found::Frame { byte, stop }) => {
                let lost = if std::mem::take(&mut self.lost) { DOR } else { 0 };
                let frame = (byte, lost | if stop { 0 } else { FE });
                if self.held < 2 { self.push(frame) } else { self.waiting = Some(frame) }
            }
            None => {}
        }
    }

    /// The RXD wire changed at the cycle `at`.
    pub fn line_changed(&mut self, at: u64) {
        self.receiver.line_changed(at, self.samples());
    }

    fn push(&mut self, frame: Received) {
        if let Some(place) = self.fifo.get_mut(usize::from(self.held)) {
            *place = frame;
            self.held += 1;
        }
    }

    fn load(&mut self, at: u64) {
        let ready = self.b & TXEN != 0 && !self.shifting();
        if let Some(byte) = self.buffer.take_if(|_| ready) {
            self.sender.load(byte, at, self.bits());
        }
    }

    fn per_bit(&self) -> u64 {
        if self.a & U2X != 0 { 8 } else { 16 }
    }

    /// The receiver's clock: one edge a sample.
    fn samples(&self) -> Ticks {
        Ticks { origin: self.origin, every: u64::from(self.ubrr) + 1 }
    }

    /// The transmitter's clock: one edge a bit, from the same generator.
    fn bits(&self) -> Ticks {
        Ticks { origin: self.origin, every: self.samples().every * self.per_bit() }
    }

    fn retime(&mut self, at: u64, change: impl FnOnce(&mut Usart)) {
        let old = (self.samples(), self.bits());
        change(self);
        let new = (self.samples(), self.bits());
        if new != old {
            self.sender.retime(at, new.1);
            self.receiver.retime(at, old.0, new.0);
        }
    }
}
