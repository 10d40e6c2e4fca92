//! The transmitter: TXREG, the shift register TSR, and the transfer between them.

use emu_core::NEVER;

use super::super::{Pic16Outbox, Pic16Signal};
use super::{Pic16Usart, TCY, TX9, TX9D};

/// A word in TSR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct OutgoingWord {
    /// The lower eight bits.
    pub(super) byte: u8,
    /// Bits that are not on the line yet, the next one lowest, and their number.
    bits: u16,
    /// The number of bits that are still to be sent.
    pub(super) left: u8,
    /// Synchronous mode: true while CK is in the high half of a bit.
    pub(super) high: bool,
    /// True if a reception has disconnected it from DT, so that nobody receives it (DS30292, 10.3.1).
    pub(super) is_cut_short: bool,
    /// Running clock of the next step; `NEVER` if CK comes from outside.
    pub(super) next: u64,
}

emu_core::state! { OutgoingWord { byte, bits, left, high, is_cut_short, next } if |word, _now| word.left <= 12 }

/// Result of a step.
pub(super) enum SenderStep {
    /// A bit was put on the line.
    Bit(bool),
    /// CK has fallen.
    Fall,
    /// The word is complete.
    End { byte: u8, cut: bool },
}

impl OutgoingWord {
    fn new(byte: u8, ninth: Option<bool>, framed: bool, cut: bool, next: u64) -> OutgoingWord {
        let (data, n) = match ninth {
            None => (u16::from(byte), 8),
            Some(bit) => (u16::from(byte) | u16::from(bit) << 8, 9),
        };
        let (bits, left) = if framed { ((data | 1 << n) << 1, n + 2) } else { (data, n) };
        OutgoingWord { byte, bits, left, high: false, is_cut_short: cut, next }
    }

    /// Executes the next edge of the shift clock. A master ends a word when the time of its last bit is over,
    /// a slave at the last falling edge of CK, because no other edge may follow.
    fn step(&mut self, sync: bool, slave: bool) -> SenderStep {
        let fell = std::mem::take(&mut self.high);
        if self.left == 0 && (!fell || slave) {
            return SenderStep::End { byte: self.byte, cut: self.is_cut_short };
        }
        if fell {
            return SenderStep::Fall;
        }
        let bit = self.bits & 1 != 0;
        self.bits >>= 1;
        self.left -= 1;
        self.high = sync;
        SenderStep::Bit(bit)
    }
}

impl Pic16Usart {
    /// Records that TXREG was filled or emptied; TXIF follows one cycle later, if it has not changed again.
    pub(super) fn write_txreg(&mut self, full: bool, t: u64) {
        self.full = full;
        self.empty_change = if self.empty_seen == full { t.saturating_add(TCY) } else { NEVER };
    }

    /// Schedules the transfer from TXREG to an idle TSR, one cycle later.
    pub(super) fn request_transfer(&mut self, t: u64) {
        if self.load == NEVER && self.is_sending_enabled() && self.full && self.word.is_none() {
            self.load = t.saturating_add(TCY);
        }
    }

    /// Moves the byte in TXREG to TSR.
    pub(super) fn load_shifter(&mut self, t: u64) {
        self.load = NEVER;
        self.write_txreg(false, t);
        let ninth = (self.txsta & TX9 != 0).then_some(self.txsta & TX9D != 0);
        let next = self.shift(self.osc(t));
        let cut = self.sync() && self.is_receiving_enabled();
        self.word = Some(OutgoingWord::new(self.txreg, ninth, !self.sync(), cut, next));
    }

    /// Executes a step of TSR at `t`.
    pub(super) fn send(&mut self, t: u64, out: &mut Pic16Outbox) {
        let now = self.osc(t);
        let (shift, fall) = (self.shift(now.saturating_add(1)), self.fall(now));
        let (sync, slave) = (self.sync(), self.slave());
        let Some(word) = &mut self.word else { return };
        let step = word.step(sync, slave);
        word.next = match (slave, word.high) {
            (true, _) => NEVER,
            (false, true) => fall,
            (false, false) => shift,
        };
        match step {
            SenderStep::Bit(bit) => self.out_bit = bit,
            SenderStep::Fall => {}
            SenderStep::End { byte, cut } => {
                self.word = None;
                if !cut {
                    out.push(Pic16Signal::Sent { t, byte });
                }
                if self.full {
                    self.load_shifter(t);
                }
            }
        }
    }

    /// Updates the next step after a change of the shift clock at `now`.
    pub(super) fn retime_sender(&mut self, now: u64) {
        let (rise, fall) = (self.shift(now.saturating_add(1)), self.fall(now));
        let slave = self.slave();
        if let Some(word) = self.word.as_mut().filter(|_| !slave) {
            word.next = if word.high { fall } else { rise };
        }
    }
}
