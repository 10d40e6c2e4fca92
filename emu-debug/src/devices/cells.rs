//! The contents of a memory, shared by clones until they change it.

use std::sync::Arc;

/// Number of bytes that are shared or copied together.
const PIECE_BYTES: usize = 4096;

/// The bytes of a memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SharedBytes {
    pieces: Arc<Vec<Arc<Vec<u8>>>>,
    len: usize,
}

impl SharedBytes {
    /// Returns `len` bytes with the value `value`.
    #[must_use]
    pub fn new(len: usize, value: u8) -> SharedBytes {
        let piece = Arc::new(vec![value; PIECE_BYTES]);
        SharedBytes { pieces: Arc::new(vec![piece; len.div_ceil(PIECE_BYTES)]), len }
    }

    /// Returns the number of bytes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if there are no bytes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the byte at an address, FFh after the end.
    #[must_use]
    pub fn get(&self, at: usize) -> u8 {
        let piece = self.pieces.get(at / PIECE_BYTES).filter(|_| at < self.len);
        piece.and_then(|piece| piece.get(at % PIECE_BYTES)).copied().unwrap_or(0xFF)
    }

    /// Sets the byte at an address; does nothing after the end.
    pub fn set(&mut self, at: usize, value: u8) {
        if at < self.len && self.get(at) != value {
            let piece = Arc::make_mut(&mut self.pieces).get_mut(at / PIECE_BYTES);
            if let Some(cell) = piece.and_then(|piece| Arc::make_mut(piece).get_mut(at % PIECE_BYTES)) {
                *cell = value;
            }
        }
    }

    /// Sets the bytes from address 0 on; ignores those that do not fit.
    pub fn fill(&mut self, bytes: &[u8]) {
        bytes.iter().enumerate().for_each(|(at, &byte)| self.set(at, byte));
    }

    /// Returns all bytes.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.pieces.iter().flat_map(|piece| piece.iter().copied()).take(self.len).collect()
    }
}
