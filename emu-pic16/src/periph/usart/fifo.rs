//! RCREG: a buffer of two words, with FERR and RX9D of each (DS30292, 10.2.2).

/// A received word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct ReceivedWord {
    /// The lower eight bits.
    pub(super) byte: u8,
    /// The ninth bit.
    pub(super) ninth: bool,
    /// Whether the stop bit was low (FERR).
    pub(super) bad_stop: bool,
}

emu_core::state! { ReceivedWord { byte, ninth, bad_stop } }

/// Up to two words, the older one at the head. The last word read stays visible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ReceiveFifo {
    head: ReceivedWord,
    second: ReceivedWord,
    held: u8,
}

emu_core::state! { ReceiveFifo { head, second, held } if |fifo, _now| fifo.held <= 2 }

impl ReceiveFifo {
    /// An empty buffer that shows 0.
    pub(super) const EMPTY: ReceiveFifo = ReceiveFifo { head: ReceivedWord::NONE, second: ReceivedWord::NONE, held: 0 };

    /// Reports whether there is a word.
    pub(super) const fn has_word(&self) -> bool {
        self.held > 0
    }

    /// Returns the word that RCREG and RCSTA show.
    pub(super) const fn head(&self) -> ReceivedWord {
        self.head
    }

    /// Adds a word; returns false if there is no space.
    pub(super) fn push(&mut self, word: ReceivedWord) -> bool {
        match self.held {
            0 => self.head = word,
            1 => self.second = word,
            _ => return false,
        }
        self.held += 1;
        true
    }

    /// Removes the older word after a read.
    pub(super) fn pop(&mut self) {
        if self.held == 2 {
            self.head = self.second;
        }
        self.held = self.held.saturating_sub(1);
    }

    /// Removes all words, and with them the framing error and the ninth bit.
    pub(super) fn clear(&mut self) {
        *self = ReceiveFifo { head: ReceivedWord { byte: self.head.byte, ..ReceivedWord::NONE }, ..ReceiveFifo::EMPTY };
    }
}

impl ReceivedWord {
    const NONE: ReceivedWord = ReceivedWord { byte: 0, ninth: false, bad_stop: false };
}
