//! The registers of the port, and what the chip says to it.

use emu_core::NEVER;

use super::super::{Device, Line, Outbox};
use super::{Baud, Fifo, MPCM, Mode, RXB8, RXC, Receiver, Reg, Sender, TXB8, TXC, U2X, UDRE, Usart};

impl Device for Usart {
    type Reg = Reg;

    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    fn next(&self) -> u64 {
        if self.asleep.is_some() {
            return NEVER;
        }
        let received = if self.b & RXC != 0 { self.receiver.end(self.per_bit(), &self.baud) } else { NEVER };
        let slave = !self.master && !self.is_async();
        let clock = if slave { self.xck.next() } else { self.half };
        self.sender.next().min(received).min(clock)
    }

    /// 0 RX, 1 UDRE, 2 TX.
    fn requests(&self) -> u8 {
        let asked = self.status() & self.b & (RXC | UDRE | TXC);
        u8::from(asked & RXC != 0) | u8::from(asked & UDRE != 0) << 1 | u8::from(asked & TXC != 0) << 2
    }

    fn taken(&mut self, irq: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if irq == 2 {
            self.a &= !TXC;
        }
    }

    fn read(&mut self, reg: Reg, t: u64, out: &mut Outbox) -> u8 {
        self.run(t, out);
        let value = self.peek(reg, t);
        if reg == Reg::UDR && self.asleep.is_none() {
            self.fifo.pop();
        }
        value
    }

    fn peek(&self, reg: Reg, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run(t, &mut Outbox::new());
            return then.peek(reg, t);
        }
        match reg {
            Reg::UDR => self.fifo.head().byte,
            Reg::UCSRA => self.status(),
            Reg::UCSRB => self.b | if self.fifo.head().ninth { RXB8 } else { 0 },
            Reg::UCSRC => self.c,
            Reg::UBRRL => self.baud.ubrr as u8,
            Reg::UBRRH => (self.baud.ubrr >> 8) as u8,
        }
    }

    fn write(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if self.asleep.is_some() {
            return;
        }
        let merge = |old: u8| old & !mask | value & mask;
        match reg {
            Reg::UDR => {
                if self.buffer.is_none() {
                    self.buffer = Some(u16::from(value & mask) | u16::from(self.b & TXB8) << 8);
                    self.feed(t);
                }
            }
            Reg::UCSRA => {
                let stays = if self.complete == t { TXC } else { !(value & mask) };
                let kept = self.a & TXC & stays;
                let settings = merge(self.a) & (U2X | MPCM);
                self.retime(t, |usart| usart.a = kept | settings);
            }
            Reg::UCSRB => {
                let before = self.receives();
                self.b = merge(self.b) & !RXB8;
                if before != self.receives() {
                    self.receiver = Receiver::begin(!before);
                    if before {
                        self.fifo.flush();
                    } else if self.is_async() {
                        self.receiver.look(t, &self.baud);
                    }
                }
                self.feed(t);
            }
            Reg::UCSRC => {
                let c = merge(self.c);
                self.retime(t, |usart| usart.c = c);
            }
            Reg::UBRRL => {
                // Whatever moves XCK clocks both sides of the wire.
                let second_half = self.half != NEVER && self.baud.number(t) % 2 == 1;
                let low = merge(self.baud.ubrr as u8);
                self.retime(t, |usart| usart.baud.restart(low, t));
                if second_half {
                    self.clock(true, t, out);
                }
            }
            Reg::UBRRH => {
                let high = merge((self.baud.ubrr >> 8) as u8);
                self.retime(t, |usart| usart.baud.set_high(high, t));
            }
        }
        self.settle(t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        match (line, self.asleep) {
            (Line::Rxd, asleep) => {
                self.rxd = high;
                if asleep.is_none() && self.is_async() {
                    self.receiver.look(t, &self.baud);
                }
            }
            (Line::Xck, None) => self.xck.change(high, t),
            (Line::Xck, Some(_)) => self.xck.change_asleep(high),
            _ => {}
        }
    }

    fn direction(&mut self, line: Line, output: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if line == Line::Xck && output != self.master {
            // The clock that stands will go on from where it stood.
            self.retime(self.asleep.unwrap_or(t), |usart| usart.master = output);
            self.settle(t, out);
        }
    }

    fn reset(&mut self, t: u64, out: &mut Outbox) {
        self.wake(t, out);
        self.run(t, out);
        self.a = 0;
        self.b = 0;
        self.c = 0x06;
        self.baud = Baud::new(t);
        (self.sender, self.buffer) = (Sender::IDLE, None);
        (self.receiver, self.fifo, self.half) = (Receiver::OFF, Fifo::EMPTY, NEVER);
        self.settle(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        self.asleep = self.asleep.or(Some(t));
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        let Some(from) = self.asleep.take() else { return };
        let cycles = t.saturating_sub(from);
        self.baud.shift(cycles);
        self.sender.shift(cycles);
        self.receiver.stood(cycles);
        self.half = self.half.saturating_add(cycles);
        self.xck.wake(from, t);
        if self.is_async() {
            self.receiver.look(t, &self.baud);
        }
        self.settle(t, out);
    }

    fn steady(&self, reg: Reg, t: u64) -> u64 {
        if reg == Reg::UDR {
            return t;
        }
        if self.asleep.is_some() || !matches!(reg, Reg::UCSRA | Reg::UCSRB) {
            return NEVER;
        }
        let event = match self.mode() {
            Mode::Async => {
                let sent = if reg == Reg::UCSRA { self.sender.end(&self.baud, self.per_bit()) } else { NEVER };
                self.receiver.end(self.per_bit(), &self.baud).min(sent)
            }
            _ if self.master => self.half,
            _ => self.xck.next(),
        };
        event.max(t)
    }
}
