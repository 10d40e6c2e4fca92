//! The port as a part of the chip.

use emu_core::NEVER;

use super::super::map::{Line, Sfr};
use super::super::{Device, Outbox};
use super::receiver::{Frame, Receiver};
use super::{BRGH, Baud, CREN, CSRC, FERR, OERR, RCSTA_WRITTEN, RX9D, SPEN, SYNC, TCY, TRMT, TXSTA_WRITTEN, Usart};

impl Device for Usart {
    fn run(&mut self, t: u64, out: &mut Outbox) {
        loop {
            let send = self.clock(self.word.map_or(NEVER, |word| word.next));
            let receive = self.clock(self.receiver_due());
            let due = self.empty_change.min(self.load).min(send).min(receive);
            if due > t || due == NEVER {
                return;
            }
            if self.empty_change == due {
                self.empty_seen = !self.empty_seen;
                self.empty_change = NEVER;
            } else if send == due {
                self.send(due, out);
            } else if self.load == due {
                self.transfer(due);
            } else {
                self.receive(due);
            }
            self.settle(due, out);
        }
    }

    fn next(&self) -> u64 {
        let send = self.word.map_or(NEVER, |word| word.next);
        self.empty_change.min(self.load).min(self.clock(send.min(self.receiver_end())))
    }

    fn read(&mut self, reg: Sfr, t: u64, out: &mut Outbox) -> u8 {
        self.run(t, out);
        let value = self.peek(reg, t);
        if reg == Sfr::RCREG {
            self.fifo.pop();
            self.settle(t, out);
        }
        value
    }

    fn peek(&self, reg: Sfr, t: u64) -> u8 {
        let bit = |set: bool, bit: u8| if set { bit } else { 0 };
        let head = self.fifo.head();
        match reg {
            Sfr::RCSTA => self.rcsta | bit(head.bad_stop, FERR) | bit(self.oerr, OERR) | bit(head.ninth, RX9D),
            Sfr::TXSTA => self.txsta | bit(self.trmt(t), TRMT),
            Sfr::TXREG => self.txreg,
            Sfr::RCREG => head.byte,
            Sfr::SPBRG => self.baud.spbrg,
            _ => 0,
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Outbox) {
        self.run(t, out);
        match reg {
            Sfr::RCSTA => {
                self.control(value, self.txsta, t);
                // CREN clear takes OERR away, a port that is off is in reset with its buffer.
                self.oerr &= value & (SPEN | CREN) == SPEN | CREN;
                if value & SPEN == 0 {
                    self.fifo.clear();
                }
            }
            Sfr::TXSTA => self.control(self.rcsta, value, t),
            Sfr::SPBRG => self.set_spbrg(value, t),
            Sfr::TXREG => {
                self.txreg = value;
                self.fill(true, t);
                self.call(t);
            }
            _ => {}
        }
        self.settle(t, out);
    }

    fn line(&mut self, line: Line, high: bool, t: u64, out: &mut Outbox) {
        self.run(t, out);
        let now = self.osc(t);
        match line {
            Line::Rx if high != self.rx_line => {
                self.past.pass(now, self.rx_line);
                self.rx_line = high;
                let looking = !self.sync() && self.receives() && self.receiver == Receiver::Idle;
                if looking && !high && self.asleep.is_none() {
                    self.receiver = Receiver::Frame(Frame::new(self.baud.began(now)));
                }
            }
            Line::Tx if high != self.tx_line => {
                self.tx_line = high;
                if self.slave() {
                    if !high {
                        self.bit();
                    }
                    if self.word.is_some_and(|word| word.high != high) {
                        self.send(t, out);
                    }
                }
            }
            _ => {}
        }
        self.settle(t, out);
    }

    fn sleep(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        self.asleep = self.asleep.or(Some(t));
    }

    fn wake(&mut self, t: u64, out: &mut Outbox) {
        self.run(t, out);
        if let Some(since) = self.asleep.take() {
            self.slept = self.slept.saturating_add(t.saturating_sub(since));
        }
    }

    fn steady(&self, reg: Sfr, t: u64) -> u64 {
        match reg {
            Sfr::TXREG | Sfr::SPBRG => NEVER,
            Sfr::TXSTA if !self.trmt(t) => self.next().min(self.clock(self.trmt_due())).max(t),
            _ => self.next().max(t),
        }
    }
}

impl Usart {
    /// RCSTA and TXSTA are written.
    pub(super) fn control(&mut self, rcsta: u8, txsta: u8, t: u64) {
        let old = self.clone();
        let now = self.osc(t);
        (self.rcsta, self.txsta) = (rcsta & RCSTA_WRITTEN, txsta & TXSTA_WRITTEN);
        let changed = old.txsta ^ self.txsta;
        let mode = changed & SYNC != 0 || self.sync() && changed & CSRC != 0;
        if old.held() && !self.held() {
            self.baud.origin = now.saturating_add(if self.sync() { TCY } else { 0 });
        }
        if mode || !self.sends() {
            (self.word, self.load, self.out_bit) = (None, NEVER, true);
        } else if changed & BRGH != 0 && !self.sync() {
            self.retime_sender(now);
        }
        self.call(t);
        let cut = self.sync() && self.receives();
        if let Some(word) = &mut self.word {
            word.cut |= cut;
        }
        if mode || !self.receives() || changed & BRGH != 0 && !self.sync() {
            self.receiver = Receiver::Idle;
        }
        if self.sync() && self.receives() && self.receiver == Receiver::Idle {
            self.receiver = Receiver::clocked(self.shift(now.saturating_add(TCY)));
        }
    }

    /// SPBRG is written: the generator begins anew.
    pub(super) fn set_spbrg(&mut self, value: u8, t: u64) {
        let now = self.osc(t);
        if let Receiver::Frame(frame) = &mut self.receiver {
            frame.rebase(now, self.baud.period());
        }
        self.baud = Baud { spbrg: value, origin: now };
        self.retime_sender(now);
        let rise = self.shift(now.saturating_add(1));
        let fall = self.fall(now);
        if let Receiver::Clocked(word) = &mut self.receiver {
            word.next = if word.high { fall } else { rise };
        }
    }
}
