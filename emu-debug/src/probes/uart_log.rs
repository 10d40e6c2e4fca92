//! What the chip sends over its first serial port.

/// Everything sent so far, and the texts awaited in it.
#[derive(Debug, Clone, Default)]
pub struct UartLog {
    /// The bytes.
    pub sent: Vec<u8>,
    texts: Vec<Vec<u8>>,
}

impl UartLog {
    /// Returns an empty log that searches for `texts`. If several texts end at one byte, the first in the
    /// list counts.
    #[must_use]
    pub fn new(texts: Vec<Vec<u8>>) -> UartLog {
        UartLog { sent: Vec::new(), texts }
    }

    /// Adds a sent byte; returns the index of a text that ends with it.
    pub fn push_byte(&mut self, byte: u8) -> Option<usize> {
        self.sent.push(byte);
        self.texts.iter().position(|text| self.sent.ends_with(text))
    }
}
