//! The receive buffer: two characters, and a third one that waits in the shift register (section 20.7.4).

use super::DOR;
use super::frame::ReceivedCharacter;

/// Up to two characters, the older one at the head. The last character read stays visible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ReceiveFifo {
    head: ReceivedCharacter,
    second: ReceivedCharacter,
    held: u8,
    /// A complete character for which the buffer has no space.
    waiting: Option<ReceivedCharacter>,
    /// True if a frame was lost; the next frame received reports it.
    lost: bool,
}

emu_core::state! { ReceiveFifo { head, second, held, waiting, lost } if |fifo, _now| fifo.held <= 2 }

impl ReceiveFifo {
    /// An empty buffer that shows 0.
    pub(super) const EMPTY: ReceiveFifo = ReceiveFifo {
        head: ReceivedCharacter::NONE,
        second: ReceivedCharacter::NONE,
        held: 0,
        waiting: None,
        lost: false,
    };

    /// RXC: at least one character is in the buffer.
    pub(super) const fn is_full(&self) -> bool {
        self.held > 0
    }

    /// Returns the character that UDR and RXB8 show.
    pub(super) const fn head(&self) -> ReceivedCharacter {
        self.head
    }

    /// Returns FE, DOR and UPE.
    pub(super) const fn errors(&self) -> u8 {
        if self.is_full() { self.head.errors } else { 0 }
    }

    /// Handles a start bit, which needs the shift register: a waiting character is lost.
    pub(super) fn on_start_bit(&mut self) {
        self.lost |= self.waiting.take().is_some();
    }

    /// Discards the waiting character in a mode that reports no overruns (MSPIM).
    pub(super) fn overwrite(&mut self) {
        self.waiting = None;
    }

    /// Stores a received frame.
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

    /// Removes the older character after a read.
    pub(super) fn pop(&mut self) {
        if self.held == 2 {
            self.head = self.second;
        }
        self.held = self.held.saturating_sub(1);
        if let Some(next) = self.waiting.take() {
            self.push(next);
        }
    }

    /// Empties the buffer when RXEN is cleared (section 20.7.6).
    pub(super) fn flush(&mut self) {
        *self = ReceiveFifo { head: self.head, ..ReceiveFifo::EMPTY };
    }
}
