//! I2C slave: DS39582 section 9.4.3, DS30292 section 9.2.1.
//!
//! The slave depends only on the lines, so it works in sleep. Bits are sampled as SCL rises. A byte takes
//! effect as SCL falls for the eighth time (address match, SSPBUF, acknowledge) and for the ninth time
//! (SSPIF, clock stretching).

use super::super::Pic16Outbox;
use super::regs::{BF, CKP, DA, GCEN, RW, SEN, SSPOV, SspRegisters, UA, raise_sspif};

/// Meaning of the current byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SlavePhase {
    /// Not addressed: waits for Start.
    Idle,
    /// The first byte after Start.
    Address,
    /// The second byte of a 10-bit address.
    Second,
    /// A byte to receive.
    Receive,
    /// An address that requests a byte from this slave, before its ninth clock has ended.
    Asked,
    /// A byte to send.
    Transmit,
}

emu_core::state! { enum SlavePhase { 0 = Idle, 1 = Address, 2 = Second, 3 = Receive, 4 = Asked, 5 = Transmit } }

/// The I2C slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct I2cSlave {
    phase: SlavePhase,
    /// Shift register SSPSR.
    sr: u8,
    /// Number of rising edges of SCL in this byte.
    rises: u8,
    /// True if the byte was acknowledged, by this slave or by the master.
    acked: bool,
    /// True if SSPSR is being sent, or waits to be sent.
    sending: bool,
    /// True if a 10-bit address has matched since Start: a repeated Start may request a read.
    matched: bool,
    /// True if SCL is held low until SSPADD is written.
    wants_address: bool,
}

emu_core::state! { I2cSlave { phase, sr, rises, acked, sending, matched, wants_address } if |of, _now| of.rises <= 9 }

impl I2cSlave {
    /// A slave that is not addressed.
    pub(super) const IDLE: I2cSlave = I2cSlave {
        phase: SlavePhase::Idle,
        sr: 0,
        rises: 0,
        acked: false,
        sending: false,
        matched: false,
        wants_address: false,
    };

    /// Handles a Start on the bus.
    pub(super) fn start(&mut self, regs: &mut SspRegisters) {
        *self = I2cSlave { phase: SlavePhase::Address, matched: self.matched, ..I2cSlave::IDLE };
        regs.set_stat_bits(RW, false);
        regs.pull_sda = false;
    }

    /// Handles a Stop on the bus.
    pub(super) fn stop(&mut self, regs: &mut SspRegisters) {
        *self = I2cSlave::IDLE;
        regs.set_stat_bits(RW, false);
        regs.pull_sda = false;
    }

    /// Handles a rising edge of SCL.
    pub(super) fn rise(&mut self, regs: &mut SspRegisters) {
        if self.phase == SlavePhase::Idle || self.rises >= 9 {
            return;
        }
        self.rises += 1;
        if matches!(self.phase, SlavePhase::Asked | SlavePhase::Transmit) {
            if self.rises == 9 {
                // A missing acknowledge ends the read, whichever device had to give it.
                self.acked = !regs.sda && (self.acked || self.phase == SlavePhase::Transmit);
                regs.set_stat_bits(RW, !regs.sda);
            }
        } else if self.rises <= 8 {
            self.sr = self.sr << 1 | u8::from(regs.sda);
        }
    }

    /// Handles a falling edge of SCL.
    pub(super) fn fall(&mut self, regs: &mut SspRegisters, ten: bool, t: u64, out: &mut Pic16Outbox) {
        match (self.phase, self.rises) {
            (SlavePhase::Idle, _) => {}
            (SlavePhase::Transmit, 1..8) => {
                self.sr = self.sr.rotate_left(1);
                regs.pull_sda = self.sr & 0x80 == 0;
            }
            (SlavePhase::Transmit, 8) => {
                // SSPSR has rotated by eight bits: without a new byte the old one is sent again.
                self.sr = self.sr.rotate_left(1);
                regs.set_stat_bits(BF, false);
                regs.stat |= DA;
                self.sending = false;
                regs.pull_sda = false;
            }
            (_, 8) => {
                self.on_byte_received(regs, ten);
                regs.pull_sda = self.acked;
            }
            (_, 9) => self.on_ninth_clock(regs, t, out),
            _ => {}
        }
        self.hold_clock(regs);
    }

    /// Decides, after eight bits, whether the byte is for this slave, goes to SSPBUF, and is acknowledged
    /// (table 9-2, in DS39582 9-3).
    fn on_byte_received(&mut self, regs: &mut SspRegisters, ten: bool) {
        let first = self.phase == SlavePhase::Address;
        let read = first && self.sr & 1 != 0;
        let general = first && regs.master && regs.con2 & GCEN != 0 && self.sr == 0;
        let upper = first && ten && !read && !general;
        let ours = match self.phase {
            SlavePhase::Address => general || (self.sr ^ regs.add) >> 1 == 0 && (!ten || !read || self.matched),
            SlavePhase::Second => self.sr == regs.add,
            _ => true,
        };
        self.acked = false;
        if !ours {
            *self = I2cSlave::IDLE;
            return;
        }
        regs.set_stat_bits(DA, self.phase == SlavePhase::Receive);
        if first {
            regs.set_stat_bits(RW, read);
        }
        let overflown = regs.con & SSPOV != 0;
        self.acked = regs.stat & BF == 0 && !overflown;
        if regs.stat & BF != 0 {
            regs.con |= SSPOV;
        } else if regs.master || !overflown {
            regs.buf = self.sr;
            // After an address that requests a read, BF means that there is a byte to send (figures 9-9,
            // 9-11).
            regs.set_stat_bits(BF, !read);
        }
        if self.acked && (upper || self.phase == SlavePhase::Second) {
            regs.stat |= UA;
        }
        (self.phase, self.matched) = match self.phase {
            SlavePhase::Address if read => (SlavePhase::Asked, self.matched),
            SlavePhase::Address if upper => (SlavePhase::Second, false),
            SlavePhase::Address => (SlavePhase::Receive, false),
            SlavePhase::Second => (SlavePhase::Receive, self.acked),
            _ => (SlavePhase::Receive, self.matched),
        };
    }

    /// Handles the end of a byte.
    fn on_ninth_clock(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        raise_sspif(t, out);
        self.rises = 0;
        regs.pull_sda = false;
        self.wants_address = regs.stat & UA != 0;
        if matches!(self.phase, SlavePhase::Asked | SlavePhase::Transmit) {
            if !self.acked {
                *self = I2cSlave { matched: self.matched, wants_address: self.wants_address, ..I2cSlave::IDLE };
                return;
            }
            self.phase = SlavePhase::Transmit;
            if regs.stat & BF == 0 {
                regs.con &= !CKP;
            } else {
                self.present_bit(regs);
            }
        } else if regs.stretch && regs.con2 & SEN != 0 && self.acked && regs.stat & BF != 0 && !self.wants_address {
            // Section 9.4.4.2: during a 10-bit address UA holds the clock.
            regs.con &= !CKP;
        }
    }

    /// Puts the first bit to send on SDA while the clock is low.
    fn present_bit(&self, regs: &mut SspRegisters) {
        regs.pull_sda = self.sr & 0x80 == 0;
    }

    /// Reports whether SSPBUF must not be written, because it is being sent.
    pub(super) fn is_busy(&self) -> bool {
        self.sending
    }

    /// Handles a write of SSPBUF. Only in a read does it go to SSPSR and count as full.
    pub(super) fn load(&mut self, regs: &mut SspRegisters) {
        let asked = self.phase == SlavePhase::Transmit || self.phase == SlavePhase::Asked && self.acked;
        if !asked || regs.stat & RW == 0 {
            return;
        }
        self.sr = regs.buf;
        self.sending = true;
        regs.stat |= BF;
        if self.phase == SlavePhase::Transmit && self.rises == 0 && !regs.scl {
            self.present_bit(regs);
        }
    }

    /// Handles a write of SSPADD. It clears UA, but not between the address match and the end of the byte
    /// (figure 9-14).
    pub(super) fn address(&mut self, regs: &mut SspRegisters) {
        if self.rises < 8 {
            self.wants_address = false;
            regs.set_stat_bits(UA, false);
            self.hold_clock(regs);
        }
    }

    /// Holds the clock low, starting while it is low, until CKP is set and SSPADD has been updated (section
    /// 9.4.4.5).
    pub(super) fn hold_clock(&mut self, regs: &mut SspRegisters) {
        let hold = regs.con & CKP == 0 || self.wants_address;
        if !hold && regs.pull_scl && self.phase == SlavePhase::Transmit && self.rises == 0 {
            self.sending = true;
            self.present_bit(regs);
        }
        regs.pull_scl = hold && (regs.pull_scl || !regs.scl);
    }
}
