//! A model of the USART that steps clock by clock: every register, counter and shift register of the block
//! diagrams (DS30292, figures 10-1, 10-4; DS33023, figures 18-1 to 18-3). It never computes a future event.

use std::collections::VecDeque;

use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};
use emu_pic16::periph::{Pic16Drive, Pic16Signal};

#[derive(Clone, Copy, Default)]
struct Word {
    byte: u8,
    ninth: bool,
    ferr: bool,
}

/// The transmit shift register: bits still to be shifted out.
struct Tsr {
    byte: u8,
    bits: VecDeque<bool>,
    lost: bool,
}

#[derive(Default)]
pub struct Model {
    // Registers, some of them bit by bit.
    spen: bool,
    rx9: bool,
    sren: bool,
    cren: bool,
    adden: bool,
    oerr: bool,
    csrc: bool,
    tx9: bool,
    txen: bool,
    sync: bool,
    brgh: bool,
    tx9d: bool,
    txreg: u8,
    spbrg: u8,

    // Baud rate generator: clocks of this period, periods (0 to 15), clocks until it leaves reset.
    clocks: u64,
    periods: u8,
    release: u8,
    asleep: bool,
    odd: bool,

    // Transmitter.
    txreg_full: bool,
    /// State of TXREG as TXIF shows it, and the clocks for which it has differed.
    seen_full: bool,
    stale: u8,
    /// Clocks until TSR takes TXREG.
    transfer: u8,
    tsr: Option<Tsr>,
    out_low: bool,
    ck_tx: bool,

    // Receiver in asynchronous mode.
    busy: bool,
    edges: u64,
    samples: Vec<bool>,
    q2q4: VecDeque<bool>,
    rsr: Vec<bool>,
    // Receiver in synchronous mode.
    wait: u8,
    clocked: bool,
    ck_rx: bool,
    // Receive buffer.
    fifo: VecDeque<Word>,
    shown: Word,

    pub tx_line: bool,
    pub rx_line: bool,
    txif: bool,
    rcif: bool,
    drives: Option<(Pic16Drive, Pic16Drive)>,
    pub out: Vec<Pic16Signal>,
}

impl Model {
    pub fn new() -> Model {
        Model { drives: Some((Pic16Drive::Port, Pic16Drive::Port)), ..Model::default() }
    }

    fn master(&self) -> bool {
        self.sync && self.csrc
    }

    fn slave(&self) -> bool {
        self.sync && !self.csrc
    }

    fn tx_on(&self) -> bool {
        self.spen && self.txen
    }

    fn rx_on(&self) -> bool {
        self.spen && (self.cren || self.master() && self.sren)
    }

    fn brg_reset(&self) -> bool {
        self.master() && !self.tx_on() && !self.rx_on()
    }

    /// Executes one clock.
    pub fn tick(&mut self, t: u64) {
        // TXIF changes when TXREG has differed for a whole cycle.
        self.stale = if self.seen_full == self.txreg_full { 0 } else { self.stale + 1 };
        if self.stale == 4 {
            self.seen_full = self.txreg_full;
            self.stale = 0;
        }
        if self.transfer > 0 {
            self.transfer -= 1;
            if self.transfer == 0 {
                self.load();
            }
        }
        if !self.asleep {
            self.odd = !self.odd;
            if self.odd {
                self.q2q4.push_back(self.rx_line);
                if self.q2q4.len() > 3 {
                    self.q2q4.pop_front();
                }
            }
            self.wait = self.wait.saturating_sub(1);
            self.brg(t);
        }
        self.settle(t);
    }

    fn brg(&mut self, t: u64) {
        if self.brg_reset() {
            return;
        }
        if self.release > 0 {
            self.release -= 1;
            if self.release == 0 {
                (self.clocks, self.periods) = (0, 0);
                self.edge(t);
            }
            return;
        }
        self.clocks += 1;
        let period = 4 * (u64::from(self.spbrg) + 1);
        if self.clocks == period {
            self.clocks = 0;
            self.periods = (self.periods + 1) % 16;
            self.edge(t);
        } else if self.clocks == period / 2 {
            self.middle();
        }
    }

    /// Handles the end of a period of the generator, and the start of the next.
    fn edge(&mut self, t: u64) {
        if self.master() {
            self.shift_out(t);
            if self.clocked && self.wait == 0 {
                self.ck_rx = true;
            }
        } else if !self.sync {
            if self.periods & if self.brgh { 3 } else { 15 } == 0 {
                self.shift_out(t);
            }
            if self.busy {
                self.edges += 1;
                let bit = self.rsr.len() as u64;
                if !self.brgh && (7..=9).any(|n| self.edges == n + 16 * bit) {
                    self.samples.push(self.rx_line);
                    if self.samples.len() == 3 {
                        let high = self.samples.drain(..).filter(|&high| high).count() >= 2;
                        self.found(high);
                    }
                }
            }
        }
    }

    /// Handles the middle of a period.
    fn middle(&mut self) {
        if self.master() {
            self.ck_tx = false;
            if self.ck_rx {
                self.ck_rx = false;
                self.clock_in();
            }
        } else if self.busy && self.brgh && self.edges == 2 + 4 * self.rsr.len() as u64 {
            let high = self.q2q4.iter().filter(|&&high| high).count() >= 2;
            self.found(high);
        }
    }

    // Transmitter.

    fn load(&mut self) {
        let mut bits: VecDeque<bool> = (0..8).map(|n| self.txreg >> n & 1 != 0).collect();
        if self.tx9 {
            bits.push_back(self.tx9d);
        }
        if !self.sync {
            bits.push_front(false);
            bits.push_back(true);
        }
        self.tsr = Some(Tsr { byte: self.txreg, bits, lost: self.sync && self.rx_on() });
        self.txreg_full = false;
        self.stale = 0;
    }

    /// Returns TRMT: TSR is empty from the middle of the stop bit on, unless the next byte waits.
    fn trmt(&self) -> bool {
        let (bit, half) = if self.brgh { (4, 2) } else { (16, 8) };
        let stopped = !self.sync && !self.txreg_full && self.periods % bit >= half;
        self.tsr.as_ref().is_none_or(|tsr| tsr.bits.is_empty() && stopped)
    }

    fn end_of_word(&mut self, t: u64) {
        if let Some(tsr) = self.tsr.take()
            && !tsr.lost
        {
            self.out.push(Pic16Signal::Sent { t, byte: tsr.byte });
        }
        if self.txreg_full {
            self.load();
        }
    }

    fn shift_out(&mut self, t: u64) {
        if self.tsr.as_ref().is_some_and(|tsr| tsr.bits.is_empty()) {
            self.end_of_word(t);
        }
        if let Some(bit) = self.tsr.as_mut().and_then(|tsr| tsr.bits.pop_front()) {
            self.out_low = !bit;
            self.ck_tx = self.sync;
        }
    }

    // Receiver.

    /// Processes a bit of a frame after the vote.
    fn found(&mut self, high: bool) {
        self.rsr.push(high);
        let of = if self.rx9 { 11 } else { 10 };
        if self.rsr.len() == 1 && high {
            self.idle();
        } else if self.rsr.len() >= of {
            let byte = (0..8).fold(0, |byte, n| byte | u8::from(self.rsr[n + 1]) << n);
            let ninth = self.rx9 && self.rsr[9];
            if !(self.rx9 && self.adden && !ninth) {
                self.store(Word { byte, ninth, ferr: !high });
            }
            self.idle();
        }
    }

    fn idle(&mut self) {
        self.busy = false;
        self.clocked = false;
        self.ck_rx = false;
        self.edges = 0;
        self.samples.clear();
        self.rsr.clear();
    }

    fn clock_in(&mut self) {
        self.rsr.push(self.rx_line);
        if self.rsr.len() < if self.rx9 { 9 } else { 8 } {
            return;
        }
        let byte = (0..8).fold(0, |byte, n| byte | u8::from(self.rsr[n]) << n);
        let ninth = self.rx9 && self.rsr[8];
        self.store(Word { byte, ninth, ferr: false });
        self.rsr.clear();
        if self.master() {
            self.sren = false;
            if !self.cren {
                self.idle();
            }
        }
    }

    fn store(&mut self, word: Word) {
        if self.oerr {
            return;
        }
        if self.fifo.len() == 2 {
            self.oerr = true;
            return;
        }
        self.fifo.push_back(word);
        self.shown = self.fifo[0];
    }

    // Inputs from the chip.

    pub fn line(&mut self, line: Pic16Line, high: bool, t: u64) {
        match line {
            Pic16Line::Rx => {
                let fell = self.rx_line && !high;
                self.rx_line = high;
                if fell && !self.sync && self.rx_on() && !self.busy && !self.asleep {
                    self.busy = true;
                }
            }
            Pic16Line::Tx if high != self.tx_line => {
                self.tx_line = high;
                if self.slave() && high {
                    if let Some(bit) = self.tsr.as_mut().and_then(|tsr| tsr.bits.pop_front()) {
                        self.out_low = !bit;
                        self.ck_tx = true;
                    }
                } else if self.slave() {
                    if self.clocked {
                        self.clock_in();
                    }
                    // The falling edge of the last bit ends the word.
                    if std::mem::take(&mut self.ck_tx) && self.tsr.as_ref().is_some_and(|tsr| tsr.bits.is_empty()) {
                        self.end_of_word(t);
                    }
                }
            }
            _ => {}
        }
        self.settle(t);
    }

    pub fn read(&mut self, reg: Sfr, t: u64) -> u8 {
        let value = self.peek(reg);
        if reg == Sfr::RCREG {
            self.fifo.pop_front();
            self.shown = self.fifo.front().copied().unwrap_or(self.shown);
            self.settle(t);
        }
        value
    }

    pub fn peek(&self, reg: Sfr) -> u8 {
        let bits = |bits: [bool; 8]| bits.iter().fold(0, |value, &bit| value << 1 | u8::from(bit));
        match reg {
            Sfr::RCSTA => bits([
                self.spen,
                self.rx9,
                self.sren,
                self.cren,
                self.adden,
                self.shown.ferr,
                self.oerr,
                self.shown.ninth,
            ]),
            Sfr::TXSTA => bits([self.csrc, self.tx9, self.txen, self.sync, false, self.brgh, self.trmt(), self.tx9d]),
            Sfr::TXREG => self.txreg,
            Sfr::RCREG => self.shown.byte,
            Sfr::SPBRG => self.spbrg,
            _ => 0,
        }
    }

    pub fn write(&mut self, reg: Sfr, value: u8, t: u64) {
        let bit = |n: u8| value >> n & 1 != 0;
        let (held, sync, csrc, brgh) = (self.brg_reset(), self.sync, self.csrc, self.brgh);
        match reg {
            Sfr::TXREG => {
                self.txreg = value;
                self.txreg_full = true;
            }
            Sfr::SPBRG => {
                self.spbrg = value;
                (self.clocks, self.periods, self.release) = (0, 0, 0);
            }
            Sfr::RCSTA => {
                (self.spen, self.rx9, self.sren, self.cren, self.adden) = (bit(7), bit(6), bit(5), bit(4), bit(3));
                self.oerr &= self.cren && self.spen;
                if !self.spen {
                    self.fifo.clear();
                    (self.shown.ferr, self.shown.ninth) = (false, false);
                }
            }
            Sfr::TXSTA => {
                (self.csrc, self.tx9, self.txen) = (bit(7), bit(6), bit(5));
                (self.sync, self.brgh, self.tx9d) = (bit(4), bit(2), bit(0));
            }
            _ => {}
        }
        if held && !self.brg_reset() {
            (self.clocks, self.periods, self.release) = (0, 0, if self.sync { 4 } else { 0 });
        }
        let other_mode = sync != self.sync || sync && csrc != self.csrc;
        if other_mode || !self.tx_on() {
            (self.tsr, self.transfer, self.out_low, self.ck_tx) = (None, 0, false, false);
        }
        if self.tx_on() && self.txreg_full && self.tsr.is_none() && self.transfer == 0 {
            self.transfer = 4;
        }
        if other_mode || !self.rx_on() || !self.sync && brgh != self.brgh {
            self.idle();
        }
        if self.sync && self.rx_on() && !self.clocked {
            (self.clocked, self.wait) = (true, 4);
        }
        if self.sync && self.rx_on() {
            self.tsr.iter_mut().for_each(|tsr| tsr.lost = true);
        }
        self.settle(t);
    }

    pub fn reset(&mut self, t: u64) {
        let fresh = Model {
            tx_line: self.tx_line,
            rx_line: self.rx_line,
            odd: self.odd,
            asleep: self.asleep,
            drives: self.drives,
            ..Model::default()
        };
        let old = std::mem::replace(self, fresh);
        (self.q2q4, self.out) = (old.q2q4, old.out);
        self.settle(t);
    }

    pub fn sleep(&mut self) {
        self.asleep = true;
    }

    pub fn wake(&mut self) {
        self.asleep = false;
    }

    pub fn txif(&self) -> bool {
        self.txen && !self.seen_full
    }

    pub fn rcif(&self) -> bool {
        !self.fifo.is_empty()
    }

    /// Sends signals for the levels that have changed.
    fn settle(&mut self, t: u64) {
        let (txif, rcif) = (self.txif(), self.rcif());
        if txif && !self.txif {
            self.out.push(Pic16Signal::Flag { t, flag: InterruptFlag::TXIF });
        }
        if rcif && !self.rcif {
            self.out.push(Pic16Signal::Flag { t, flag: InterruptFlag::RCIF });
        }
        (self.txif, self.rcif) = (txif, rcif);
        let level = |high| if high { Pic16Drive::High } else { Pic16Drive::Low };
        let (mut tx, mut rx) = (Pic16Drive::Port, Pic16Drive::Port);
        if self.sync {
            if self.tx_on() && !self.rx_on() {
                rx = level(!self.out_low);
            }
            if self.master() && (self.tx_on() || self.rx_on()) {
                tx = level(self.ck_tx || self.ck_rx);
            }
        } else if self.tx_on() {
            tx = level(!self.out_low);
        }
        let before = self.drives.replace((tx, rx));
        if before.is_none_or(|drives| drives.0 != tx) {
            self.out.push(Pic16Signal::Drive { t, line: Pic16Line::Tx, drive: tx });
        }
        if before.is_none_or(|drives| drives.1 != rx) {
            self.out.push(Pic16Signal::Drive { t, line: Pic16Line::Rx, drive: rx });
        }
    }
}
