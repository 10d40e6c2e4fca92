//! [`Device`] for the USART.

use emu_core::NEVER;

use super::super::map::{Pic16Line, Sfr};
use super::super::{Device, Pic16Outbox, Pic16Signal};
use super::receiver::{IncomingFrame, UsartReceiver};
use super::{
    BRGH, BaudClock, CREN, CSRC, FERR, OERR, Pic16Usart, RCSTA_WRITTEN, RX9D, SPEN, SYNC, TCY, TRMT, TXSTA_WRITTEN,
};

impl Device<Pic16Signal> for Pic16Usart {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
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
                self.load_shifter(due);
            } else {
                self.receive(due);
            }
            self.settle(due, out);
        }
    }

    fn next_deadline(&self) -> u64 {
        let send = self.word.map_or(NEVER, |word| word.next);
        self.empty_change.min(self.load).min(self.clock(send.min(self.receiver_end())))
    }

    fn read(&mut self, reg: Sfr, t: u64, out: &mut Pic16Outbox) -> u8 {
        self.run_due(t, out);
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

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        match reg {
            Sfr::RCSTA => {
                self.control(value, self.txsta, t);
                // Clearing CREN clears OERR; a port that is off is in reset, including its buffer.
                self.oerr &= value & (SPEN | CREN) == SPEN | CREN;
                if value & SPEN == 0 {
                    self.fifo.clear();
                }
            }
            Sfr::TXSTA => self.control(self.rcsta, value, t),
            Sfr::SPBRG => self.set_spbrg(value, t),
            Sfr::TXREG => {
                self.txreg = value;
                self.write_txreg(true, t);
                self.request_transfer(t);
            }
            _ => {}
        }
        self.settle(t, out);
    }

    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        let now = self.osc(t);
        match line {
            Pic16Line::Rx if high != self.rx_line => {
                self.past.record_level(now, self.rx_line);
                self.rx_line = high;
                let looking = !self.sync() && self.is_receiving_enabled() && self.receiver == UsartReceiver::Idle;
                if looking && !high && self.asleep.is_none() {
                    self.receiver = UsartReceiver::Frame(IncomingFrame::new(self.baud.began(now)));
                }
            }
            Pic16Line::Tx if high != self.tx_line => {
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

    /// Resets the port at clock `t`; every kind of reset has the same effect (DS30292, table 12-6). It does
    /// not restart the oscillator: a reset out of sleep also needs [`Device::restart_clock`].
    fn reset(&mut self, power_on: bool, t: u64, out: &mut Pic16Outbox) {
        let _ = power_on;
        self.run_due(t, out);
        let now = self.osc(t);
        *self = Pic16Usart {
            baud: BaudClock { spbrg: 0, origin: now },
            slept: self.slept,
            asleep: self.asleep,
            past: self.past,
            tx_line: self.tx_line,
            rx_line: self.rx_line,
            drives: self.drives,
            early_trmt: self.early_trmt,
            ..Pic16Usart::new()
        };
        self.settle(t, out);
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = self.asleep.or(Some(t));
    }

    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if let Some(since) = self.asleep.take() {
            self.slept = self.slept.saturating_add(t.saturating_sub(since));
        }
    }

    fn steady_until(&self, reg: Sfr, t: u64) -> u64 {
        match reg {
            Sfr::TXREG | Sfr::SPBRG => NEVER,
            Sfr::TXSTA if !self.trmt(t) => self.next_deadline().min(self.clock(self.trmt_due())).max(t),
            _ => self.next_deadline().max(t),
        }
    }
}

impl Pic16Usart {
    /// Writes RCSTA and TXSTA.
    pub(super) fn control(&mut self, rcsta: u8, txsta: u8, t: u64) {
        let old = self.clone();
        let now = self.osc(t);
        (self.rcsta, self.txsta) = (rcsta & RCSTA_WRITTEN, txsta & TXSTA_WRITTEN);
        let changed = old.txsta ^ self.txsta;
        let mode = changed & SYNC != 0 || self.sync() && changed & CSRC != 0;
        if old.is_blocked_by_overrun() && !self.is_blocked_by_overrun() {
            self.baud.origin = now.saturating_add(if self.sync() { TCY } else { 0 });
        }
        if mode || !self.is_sending_enabled() {
            (self.word, self.load, self.out_bit) = (None, NEVER, true);
        } else if changed & BRGH != 0 && !self.sync() {
            self.retime_sender(now);
        }
        self.request_transfer(t);
        let cut = self.sync() && self.is_receiving_enabled();
        if let Some(word) = &mut self.word {
            word.is_cut_short |= cut;
        }
        if mode || !self.is_receiving_enabled() || changed & BRGH != 0 && !self.sync() {
            self.receiver = UsartReceiver::Idle;
        }
        if self.sync() && self.is_receiving_enabled() && self.receiver == UsartReceiver::Idle {
            self.receiver = UsartReceiver::clocked(self.shift(now.saturating_add(TCY)));
        }
    }

    /// Writes SPBRG: the generator restarts.
    pub(super) fn set_spbrg(&mut self, value: u8, t: u64) {
        let now = self.osc(t);
        if let UsartReceiver::Frame(frame) = &mut self.receiver {
            frame.rebase(now, self.baud.period());
        }
        self.baud = BaudClock { spbrg: value, origin: now };
        self.retime_sender(now);
        let rise = self.shift(now.saturating_add(1));
        let fall = self.fall(now);
        if let UsartReceiver::Clocked(word) = &mut self.receiver {
            word.next = if word.high { fall } else { rise };
        }
    }
}
