//! Bit patterns and cycle columns, parsed and checked at compile time.

/// A bit pattern such as `0001 00rd dddd rrrr`. 0 and 1 are fixed bits, and a letter is a bit of that
/// operand, most significant bit first. Spaces are ignored. A pattern covers one to three program words; the
/// first word is in the upper bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitPattern {
    /// Mask of the fixed bits.
    pub mask: u32,
    /// Values of the fixed bits.
    pub value: u32,
    /// The instruction with all operands 0 as assemblers write it: the fixed bits, and 1 where the pattern
    /// has `+`.
    pub canonical: u32,
    letters: [u8; 32],
    bits: u8,
    words: u8,
}

/// The field of an operand in an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OperandField {
    /// Its bits as a number.
    pub raw: u32,
    /// How many bits it has.
    pub width: u32,
}

impl BitPattern {
    /// Parses a pattern for program words of `word_bits` bits (8, 14 or 16).
    ///
    /// # Panics
    /// At compile time, if a character is not `0`, `1`, `-` or `+` (don't care, written as 0 and as 1), a
    /// lower-case letter or a space, or if the length is not a whole number of one to three words or is more
    /// than 32 bits.
    #[must_use]
    pub const fn parse(text: &str, word_bits: u32) -> BitPattern {
        let text = text.as_bytes();
        let mut letters = [0u8; 32];
        let (mut mask, mut value, mut written, mut bits, mut i) = (0u32, 0u32, 0u32, 0usize, 0usize);
        while i < text.len() {
            let c = text[i];
            i += 1;
            if c == b' ' {
                continue;
            }
            assert!(
                c == b'0' || c == b'1' || c == b'-' || c == b'+' || (c >= b'a' && c <= b'z'),
                "a pattern has 0, 1, -, + and letters"
            );
            assert!(bits < 32, "a pattern has at most 32 bits");
            mask <<= 1;
            value <<= 1;
            written <<= 1;
            if c == b'1' || c == b'+' {
                written |= 1;
            }
            if c == b'0' || c == b'1' {
                mask |= 1;
                value |= (c - b'0') as u32;
            }
            letters[bits] = c;
            bits += 1;
        }
        let words = bits as u32 / word_bits;
        assert!(words >= 1 && words <= 3 && words * word_bits == bits as u32, "a pattern fills whole program words");
        BitPattern { mask, value, canonical: written, letters, bits: bits as u8, words: words as u8 }
    }

    /// Length in program words.
    #[must_use]
    pub const fn words(&self) -> u32 {
        self.words as u32
    }

    /// Returns true if the fixed bits of `bits` are those of the pattern.
    #[must_use]
    pub const fn matches(&self, bits: u32) -> bool {
        bits & self.mask == self.value
    }

    /// Returns true if the operand `letter` occurs in the pattern.
    #[must_use]
    pub fn has_letter(&self, letter: u8) -> bool {
        self.letters[..self.bits as usize].contains(&letter)
    }

    /// The bits of operand `letter` gathered from `bits`; the width is 0 where it is not in the pattern.
    #[must_use]
    pub fn extract_field(&self, letter: u8, bits: u32) -> OperandField {
        let (mut raw, mut width) = (0, 0);
        for (i, &c) in self.letters[..self.bits as usize].iter().enumerate() {
            if c == letter {
                raw = (raw << 1) | ((bits >> (u32::from(self.bits) - 1 - i as u32)) & 1);
                width += 1;
            }
        }
        OperandField { raw, width }
    }

    /// Returns the bits of an instruction that hold `raw` in operand `letter`; all other bits are 0.
    #[must_use]
    pub fn insert_field(&self, letter: u8, raw: u32) -> u32 {
        let mut left = self.extract_field(letter, 0).width;
        let mut bits = 0;
        for (i, &c) in self.letters[..self.bits as usize].iter().enumerate() {
            if c == letter {
                left -= 1;
                bits |= ((raw >> left) & 1) << (u32::from(self.bits) - 1 - i as u32);
            }
        }
        bits
    }
}

/// Formats the pattern as in a table, in groups of four bits.
impl std::fmt::Display for BitPattern {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, &c) in self.letters[..self.bits as usize].iter().enumerate() {
            if i > 0 && (usize::from(self.bits) - i) % 4 == 0 {
                f.write_str(" ")?;
            }
            write!(f, "{}", c as char)?;
        }
        Ok(())
    }
}

/// The cycle column of a row: `1`, or one number per outcome. `1/2/3` is the order not taken, taken, taken
/// over two words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleCounts {
    list: [u8; 4],
    len: u8,
}

impl CycleCounts {
    /// Parses the column.
    ///
    /// # Panics
    /// At compile time, if it is not one to four digits from 1 to 9 separated by `/`.
    #[must_use]
    pub const fn parse(text: &str) -> CycleCounts {
        let text = text.as_bytes();
        let mut list = [0u8; 4];
        let mut i = 0;
        assert!(text.len() % 2 == 1 && text.len() <= 7, "cycles are digits with / between them");
        while i < text.len() {
            if i % 2 == 0 {
                assert!(text[i] >= b'1' && text[i] <= b'9', "a cycle count is a digit from 1");
                list[i / 2] = text[i] - b'0';
            } else {
                assert!(text[i] == b'/', "outcomes are separated by /");
            }
            i += 1;
        }
        CycleCounts { list, len: text.len().div_ceil(2) as u8 }
    }

    /// The number of cycles if all outcomes take the same, else 0 (the body charges them).
    #[must_use]
    pub const fn constant(&self) -> u32 {
        if self.len == 1 { self.list[0] as u32 } else { 0 }
    }

    /// One number of cycles per outcome.
    #[must_use]
    pub fn possible_counts(&self) -> &[u8] {
        &self.list[..self.len as usize]
    }

    /// The largest number of cycles.
    #[must_use]
    pub fn max_count(&self) -> u32 {
        self.possible_counts().iter().copied().max().map_or(0, u32::from)
    }
}
