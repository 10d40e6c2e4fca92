//! [`Device`] for the USART: registers, lines and clocks.

use emu_core::NEVER;

use super::super::{AvrLine, AvrOutbox, AvrSignal, Device};
use super::{
    AvrUsart, BaudClock, MPCM, RXB8, RXC, ReceiveFifo, TXB8, TXC, U2X, UDRE, UsartMode, UsartReceiver, UsartRegister,
    UsartSender,
};

impl Device<AvrSignal> for AvrUsart {
    type Reg = UsartRegister;

    fn run_due(&mut self, t: u64, out: &mut AvrOutbox) {
        loop {
            let due = self.due();
            if due > t {
                return;
            }
            self.step(due, out);
        }
    }

    fn next_deadline(&self) -> u64 {
        if self.asleep.is_some() {
            return NEVER;
        }
        let received = if self.b & RXC != 0 { self.receiver.end(self.samples_per_bit(), &self.baud) } else { NEVER };
        let slave = !self.master && !self.is_async();
        let clock = if slave { self.xck.next() } else { self.half };
        self.sender.next().min(received).min(clock)
    }

    /// Interrupts: 0 RX, 1 UDRE, 2 TX.
    fn interrupt_requests(&self) -> u8 {
        let asked = self.status() & self.b & (RXC | UDRE | TXC);
        u8::from(asked & RXC != 0) | u8::from(asked & UDRE != 0) << 1 | u8::from(asked & TXC != 0) << 2
    }

    fn on_interrupt_taken(&mut self, irq: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if irq == 2 {
            self.a &= !TXC;
        }
    }

    fn read(&mut self, reg: UsartRegister, t: u64, out: &mut AvrOutbox) -> u8 {
        self.run_due(t, out);
        let value = self.peek(reg, t);
        if reg == UsartRegister::UDR && self.asleep.is_none() {
            self.fifo.pop();
        }
        value
    }

    fn peek(&self, reg: UsartRegister, t: u64) -> u8 {
        if self.due() <= t {
            let mut then = self.clone();
            then.run_due(t, &mut AvrOutbox::new());
            return then.peek(reg, t);
        }
        match reg {
            UsartRegister::UDR => self.fifo.head().byte,
            UsartRegister::UCSRA => self.status(),
            UsartRegister::UCSRB => self.b | if self.fifo.head().ninth { RXB8 } else { 0 },
            UsartRegister::UCSRC => self.c,
            UsartRegister::UBRRL => self.baud.ubrr as u8,
            UsartRegister::UBRRH => (self.baud.ubrr >> 8) as u8,
        }
    }

    fn write(&mut self, reg: UsartRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if self.asleep.is_some() {
            return;
        }
        let merge = |old: u8| old & !mask | value & mask;
        match reg {
            UsartRegister::UDR => {
                if self.buffer.is_none() {
                    self.buffer = Some(u16::from(value & mask) | u16::from(self.b & TXB8) << 8);
                    self.load_next(t);
                }
            }
            UsartRegister::UCSRA => {
                let stays = if self.complete == t { TXC } else { !(value & mask) };
                let kept = self.a & TXC & stays;
                let settings = merge(self.a) & (U2X | MPCM);
                self.change_clock(t, |usart| usart.a = kept | settings);
            }
            UsartRegister::UCSRB => {
                let before = self.is_receiving_enabled();
                self.b = merge(self.b) & !RXB8;
                if before != self.is_receiving_enabled() {
                    self.receiver = UsartReceiver::begin(!before);
                    if before {
                        self.fifo.flush();
                    } else if self.is_async() {
                        self.receiver.schedule_sample(t, &self.baud);
                    }
                }
                self.load_next(t);
            }
            UsartRegister::UCSRC => {
                let c = merge(self.c);
                self.change_clock(t, |usart| usart.c = c);
            }
            UsartRegister::UBRRL => {
                // An edge of XCK, whatever causes it, clocks the port and the device at the other end.
                let second_half = self.half != NEVER && self.baud.edges_until(t) % 2 == 1;
                let low = merge(self.baud.ubrr as u8);
                self.change_clock(t, |usart| usart.baud.restart(low, t));
                if second_half {
                    self.on_clock_edge(true, t, out);
                }
            }
            UsartRegister::UBRRH => {
                let high = merge((self.baud.ubrr >> 8) as u8);
                self.change_clock(t, |usart| usart.baud.set_high(high, t));
            }
        }
        self.drive_lines(t, out);
    }

    fn on_line_changed(&mut self, line: AvrLine, high: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        match (line, self.asleep) {
            (AvrLine::Rxd, asleep) => {
                self.rxd = high;
                if asleep.is_none() && self.is_async() {
                    self.receiver.schedule_sample(t, &self.baud);
                }
            }
            (AvrLine::Xck, None) => self.xck.change(high, t),
            (AvrLine::Xck, Some(_)) => self.xck.set_level_while_stopped(high),
            _ => {}
        }
    }

    fn on_direction_changed(&mut self, line: AvrLine, output: bool, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        if line == AvrLine::Xck && output != self.master {
            // A stopped clock will continue from its stopped state.
            self.change_clock(self.asleep.unwrap_or(t), |usart| usart.master = output);
            self.drive_lines(t, out);
        }
    }

    fn reset(&mut self, _power_on: bool, t: u64, out: &mut AvrOutbox) {
        self.restart_clock(t, out);
        self.run_due(t, out);
        self.a = 0;
        self.b = 0;
        self.c = 0x06;
        self.baud = BaudClock::new(t);
        (self.sender, self.buffer) = (UsartSender::IDLE, None);
        (self.receiver, self.fifo, self.half) = (UsartReceiver::OFF, ReceiveFifo::EMPTY, NEVER);
        self.drive_lines(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        self.run_due(t, out);
        self.asleep = self.asleep.or(Some(t));
    }

    fn restart_clock(&mut self, t: u64, out: &mut AvrOutbox) {
        let Some(from) = self.asleep.take() else { return };
        let cycles = t.saturating_sub(from);
        self.baud.shift(cycles);
        self.sender.shift(cycles);
        self.receiver.postpone(cycles);
        self.half = self.half.saturating_add(cycles);
        self.xck.wake(from, t);
        if self.is_async() {
            self.receiver.schedule_sample(t, &self.baud);
        }
        self.drive_lines(t, out);
    }

    fn steady_until(&self, reg: UsartRegister, t: u64) -> u64 {
        if reg == UsartRegister::UDR {
            return t;
        }
        if self.asleep.is_some() || !matches!(reg, UsartRegister::UCSRA | UsartRegister::UCSRB) {
            return NEVER;
        }
        let event = match self.mode() {
            UsartMode::Async => {
                let sent = if reg == UsartRegister::UCSRA {
                    self.sender.end(&self.baud, self.samples_per_bit())
                } else {
                    NEVER
                };
                self.receiver.end(self.samples_per_bit(), &self.baud).min(sent)
            }
            _ if self.master => self.half,
            _ => self.xck.next(),
        };
        event.max(t)
    }
}
