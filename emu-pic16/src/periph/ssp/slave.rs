//! I2C slave: DS39582 section 9.4.3, DS30292 section 9.2.1.
//!
//! It hangs on the wires alone, so that it works in sleep. Bits are taken as SCL rises; what a byte does it does as SCL falls
//! for the eighth time (address match, SSPBUF, acknowledge) and for the ninth (SSPIF, holding the clock).

use super::super::Outbox;
use super::regs::{BF, CKP, DA, GCEN, RW, Regs, SEN, SSPOV, UA, interrupt};

/// What the byte on its way is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Not for us: waits for Start.
    Idle,
    /// The first byte after Start.
    Address,
    /// The second byte of an address of 10 bits.
    Second,
    /// A byte for us.
    Receive,
    /// An address that asks for a byte from us, before its ninth clock has ended.
    Asked,
    /// A byte from us.
    Transmit,
}

emu_core::state! { enum Phase { 0 = Idle, 1 = Address, 2 = Second, 3 = Receive, 4 = Asked, 5 = Transmit } }

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Slave {
    phase: Phase,
    /// SSPSR.
    sr: u8,
    /// Times that SCL has risen in this byte.
    rises: u8,
    /// The byte was acknowledged: by us, or by the master.
    acked: bool,
    /// SSPSR is being sent, or waits to be.
    sending: bool,
    /// An address of 10 bits has matched since Start: a repeated Start may ask for a read.
    matched: bool,
    /// SCL is held until SSPADD is written.
    wants_address: bool,
}

emu_core::state! { Slave { phase, sr, rises, acked, sending, matched, wants_address } if |of, _now| of.rises <= 9 }

impl Slave {
    pub(super) const IDLE: Slave = Slave {
        phase: Phase::Idle,
        sr: 0,
        rises: 0,
        acked: false,
        sending: false,
        matched: false,
        wants_address: false,
    };

    /// Start on the wires.
    pub(super) fn start(&mut self, regs: &mut Regs) {
        *self = Slave { phase: Phase::Address, matched: self.matched, ..Slave::IDLE };
        regs.stat(RW, false);
        regs.pull_sda = false;
    }

    /// Stop on the wires.
    pub(super) fn stop(&mut self, regs: &mut Regs) {
        *self = Slave::IDLE;
        regs.stat(RW, false);
        regs.pull_sda = false;
    }

    /// SCL rises.
    pub(super) fn rise(&mut self, regs: &mut Regs) {
        if self.phase == Phase::Idle || self.rises >= 9 {
            return;
        }
        self.rises += 1;
        if matches!(self.phase, Phase::Asked | Phase::Transmit) {
            if self.rises == 9 {
                // No acknowledge, whose ever it is to give, ends the read.
                self.acked = !regs.sda && (self.acked || self.phase == Phase::Transmit);
                regs.stat(RW, !regs.sda);
            }
        } else if self.rises <= 8 {
            self.sr = self.sr << 1 | u8::from(regs.sda);
        }
    }

    /// SCL falls.
    pub(super) fn fall(&mut self, regs: &mut Regs, ten: bool, t: u64, out: &mut Outbox) {
        match (self.phase, self.rises) {
            (Phase::Idle, _) => {}
            (Phase::Transmit, 1..8) => {
                self.sr = self.sr.rotate_left(1);
                regs.pull_sda = self.sr & 0x80 == 0;
            }
            (Phase::Transmit, 8) => {
                // SSPSR has gone round: without a new byte the old one is sent again.
                self.sr = self.sr.rotate_left(1);
                regs.stat(BF, false);
                regs.stat |= DA;
                self.sending = false;
                regs.pull_sda = false;
            }
            (_, 8) => {
                self.byte(regs, ten);
                regs.pull_sda = self.acked;
            }
            (_, 9) => self.ninth(regs, t, out),
            _ => {}
        }
        self.hold(regs);
    }

    /// A byte has come in: is it for us, does it go to SSPBUF, is it acknowledged (table 9-2, in DS39582 9-3)?
    fn byte(&mut self, regs: &mut Regs, ten: bool) {
        let first = self.phase == Phase::Address;
        let read = first && self.sr & 1 != 0;
        let general = first && regs.master && regs.con2 & GCEN != 0 && self.sr == 0;
        let upper = first && ten && !read && !general;
        let ours = match self.phase {
            Phase::Address => general || (self.sr ^ regs.add) >> 1 == 0 && (!ten || !read || self.matched),
            Phase::Second => self.sr == regs.add,
            _ => true,
        };
        self.acked = false;
        if !ours {
            *self = Slave::IDLE;
            return;
        }
        regs.stat(DA, self.phase == Phase::Receive);
        if first {
            regs.stat(RW, read);
        }
        let overflown = regs.con & SSPOV != 0;
        self.acked = regs.stat & BF == 0 && !overflown;
        if regs.stat & BF != 0 {
            regs.con |= SSPOV;
        } else if regs.master || !overflown {
            regs.buf = self.sr;
            // After an address that asks for a read BF is to say that there is something to send (figures 9-9, 9-11).
            regs.stat(BF, !read);
        }
        if self.acked && (upper || self.phase == Phase::Second) {
            regs.stat |= UA;
        }
        (self.phase, self.matched) = match self.phase {
            Phase::Address if read => (Phase::Asked, self.matched),
            Phase::Address if upper => (Phase::Second, false),
            Phase::Address => (Phase::Receive, false),
            Phase::Second => (Phase::Receive, self.acked),
            _ => (Phase::Receive, self.matched),
        };
    }

    /// The byte ends.
    fn ninth(&mut self, regs: &mut Regs, t: u64, out: &mut Outbox) {
        interrupt(t, out);
        self.rises = 0;
        regs.pull_sda = false;
        self.wants_address = regs.stat & UA != 0;
        if matches!(self.phase, Phase::Asked | Phase::Transmit) {
            if !self.acked {
                *self = Slave { matched: self.matched, wants_address: self.wants_address, ..Slave::IDLE };
                return;
            }
            self.phase = Phase::Transmit;
            if regs.stat & BF == 0 {
                regs.con &= !CKP;
            } else {
                self.present(regs);
            }
        } else if regs.stretch && regs.con2 & SEN != 0 && self.acked && regs.stat & BF != 0 && !self.wants_address {
            // Section 9.4.4.2: while an address of 10 bits comes it is UA that holds the clock.
            regs.con &= !CKP;
        }
    }

    /// The first bit of what is sent goes out while the clock is low.
    fn present(&self, regs: &mut Regs) {
        regs.pull_sda = self.sr & 0x80 == 0;
    }

    /// SSPBUF may not be written: it is being sent.
    pub(super) fn busy(&self) -> bool {
        self.sending
    }

    /// SSPBUF was written. Only in a read does it go to SSPSR and count as full.
    pub(super) fn load(&mut self, regs: &mut Regs) {
        let asked = self.phase == Phase::Transmit || self.phase == Phase::Asked && self.acked;
        if !asked || regs.stat & RW == 0 {
            return;
        }
        self.sr = regs.buf;
        self.sending = true;
        regs.stat |= BF;
        if self.phase == Phase::Transmit && self.rises == 0 && !regs.scl {
            self.present(regs);
        }
    }

    /// SSPADD was written. UA goes, but not between the address match and the end of the byte (figure 9-14).
    pub(super) fn address(&mut self, regs: &mut Regs) {
        if self.rises < 8 {
            self.wants_address = false;
            regs.stat(UA, false);
            self.hold(regs);
        }
    }

    /// The clock is held low from when it is low by itself until CKP is set and SSPADD is as it must be (section 9.4.4.5).
    pub(super) fn hold(&mut self, regs: &mut Regs) {
        let hold = regs.con & CKP == 0 || self.wants_address;
        if !hold && regs.pull_scl && self.phase == Phase::Transmit && self.rises == 0 {
            self.sending = true;
            self.present(regs);
        }
        regs.pull_scl = hold && (regs.pull_scl || !regs.scl);
    }
}
