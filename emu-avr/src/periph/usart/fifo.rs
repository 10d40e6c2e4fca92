//! The receive buffer: two characters deep, and a third one that waits in the shift register (section 20.7.4).

use super::DOR;
use super::frame::ReceivedCharacter;

/// Up to two characters, the older one in front. The last one read stays in sight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ReceiveFifo {
    head: ReceivedCharacter,
    second: ReceivedCharacter,
    held: u8,
    /// Complete, but there is no room for it.
    waiting: Option<ReceivedCharacter>,
    /// A frame was lost; the next one to arrive says so.
    lost: bool,
}

emu_core::state! { ReceiveFifo { head, second, held, waiting, lost } if |fifo, _now| fifo.held <= 2 }

impl ReceiveFifo {
    pub(super) const EMPTY: ReceiveFifo = ReceiveFifo {
        head: ReceivedCharacter::NONE,
        second: ReceivedCharacter::NONE,
        held: 0,
        waiting: None,
        lost: false,
    };

    /// RXC.
    pub(super) const fn is_full(&self) -> bool {
        self.held > 0
    }

    /// What UDR and RXB8 show.
    pub(super) const fn head(&self) -> ReceivedCharacter {
        self.head
    }

    /// FE, DOR and UPE.
    pub(super) const fn errors(&self) -> u8 {
        if self.is_full() { self.head.errors } else { 0 }
    }

    /// A start bit: the shift register is needed.
    pub(super) fn on_start_bit(&mut self) {
        self.lost |= self.waiting.take().is_some();
    }

    /// The shift register is needed where overruns are not told of (MSPIM).
    pub(super) fn overwrite(&mut self) {
        self.waiting = None;
    }

    /// A frame has come in.
    pub(super) fn on_frame_received(&mut self, received: ReceivedCharacter) {
        let lost = if std::mem::take(&mut self.lost) { DOR } else { 0 };
        self.push(ReceivedCharacter { errors: received.errors | lost, ..received });
    }

    fn push(&mut self, received: ReceivedCharacter) {
        match self.held {
            0 => self.head = received,
            1 => self.second = received,
            _ => self.waiting = Some(received),
        }
        self.held = (self.held + 1).min(2);
    }

    /// The older one has been read.
    pub(super) fn pop(&mut self) {
        if self.held == 2 {
            self.head = self.second;
        }
        self.held = self.held.saturating_sub(1);
        if let Some(next) = self.waiting.take() {
            self.push(next);
        }
    }

    /// RXEN is off: nothing is left (section 20.7.6).
    pub(super) fn flush(&mut self) {
        *self = ReceiveFifo { head: self.head, ..ReceiveFifo::EMPTY };
    }
}
