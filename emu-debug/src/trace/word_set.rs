//! A set of program words.

/// A set of observed program words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WordSet {
    bits: Vec<u64>,
}

impl WordSet {
    /// Returns the empty set for a program memory of `words` words.
    #[must_use]
    pub fn none(words: u32) -> WordSet {
        WordSet { bits: vec![0; words.div_ceil(64) as usize] }
    }

    /// Adds the words from `start` to the one before `end`; ignores those beyond the memory.
    pub fn add(&mut self, start: u32, end: u32) {
        let end = end.min(self.bits.len() as u32 * 64);
        for word in start..end {
            if let Some(bits) = self.bits.get_mut(word as usize / 64) {
                *bits |= 1 << (word % 64);
            }
        }
    }

    /// Returns true if the word is in the set.
    #[must_use]
    pub fn contains(&self, word: u32) -> bool {
        self.bits.get(word as usize / 64).is_some_and(|bits| bits >> (word % 64) & 1 != 0)
    }

    /// Returns true if the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bits.iter().all(|bits| *bits == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::WordSet;

    #[test]
    fn stretches_of_words() {
        let mut words = WordSet::none(130);
        assert!(words.is_empty());
        words.add(3, 5);
        words.add(63, 65);
        words.add(129, 1000);
        words.add(9, 9);
        let has: Vec<u32> = (0..131).filter(|&word| words.contains(word)).collect();
        assert_eq!(has, [3, 4, 63, 64, 129, 130]);
        assert!(!words.contains(u32::MAX) && !words.is_empty());
    }
}
