//! Makes inputs from seeds. An input depends only on seed, target and number, so that a finding can be
//! reproduced.

use emu_core::rng::Rng;

use crate::seeds::SeedSource;
use crate::target_table::FuzzTarget;

/// Numbers near the limits of readers.
const BOUNDARY_NUMBERS: &[&str] = &[
    "0",
    "1",
    "-1",
    "2",
    "7",
    "8",
    "15",
    "16",
    "31",
    "32",
    "63",
    "64",
    "127",
    "128",
    "255",
    "256",
    "1023",
    "32767",
    "32768",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "0x",
    "1e9",
];

/// Makes the inputs of a target.
pub struct Mutator {
    seed: u64,
    max_input_bytes: usize,
    seeds: Vec<Vec<u8>>,
    dictionary: Vec<Vec<u8>>,
}

impl Mutator {
    /// The mutator of a target. `corpus` contains inputs in addition to the target's own seeds.
    #[must_use]
    pub fn new(target: &FuzzTarget, seed: u64, corpus: Vec<Vec<u8>>) -> Mutator {
        let mut seeds: Vec<Vec<u8>> = target.seeds.iter().flat_map(SeedSource::collect).chain(corpus).collect();
        for seed in &mut seeds {
            seed.truncate(target.max_input_bytes);
        }
        if seeds.is_empty() {
            seeds.push(Vec::new());
        }
        let words = (target.dictionary)().into_iter().map(String::into_bytes).collect();
        let name = target
            .name
            .bytes()
            .fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
        Mutator { seed: seed ^ name, max_input_bytes: target.max_input_bytes, seeds, dictionary: words }
    }

    /// The unchanged seeds.
    #[must_use]
    pub fn seeds(&self) -> &[Vec<u8>] {
        &self.seeds
    }

    /// The input with this number: the first ones are the unchanged seeds, the others are seeds with one to
    /// seven changes.
    #[must_use]
    pub fn input(&self, number: u64) -> Vec<u8> {
        if let Some(seed) = usize::try_from(number).ok().and_then(|number| self.seeds.get(number)) {
            return seed.clone();
        }
        let mut rng = Rng::new(self.seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let mut bytes = self.random_seed(&mut rng).to_vec();
        for _ in 0..1 + rng.below(3) * rng.below(4) {
            self.mutate(&mut bytes, &mut rng);
        }
        bytes.truncate(self.max_input_bytes);
        bytes
    }

    fn random_seed(&self, rng: &mut Rng) -> &[u8] {
        self.seeds.get(rng.below(self.seeds.len() as u64) as usize).map_or(&[], Vec::as_slice)
    }

    fn mutate(&self, bytes: &mut Vec<u8>, rng: &mut Rng) {
        let at = rng.below(bytes.len() as u64 + 1) as usize;
        let end = (at + rng.below(16) as usize).min(bytes.len());
        match rng.below(11) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes.truncate(at),
            2 => _ = bytes.splice(at..at, self.random_word(rng)),
            3 => _ = bytes.splice(at..end, self.random_word(rng)),
            4 => {
                // A part of another seed or of this one.
                let other = if rng.one_in(2) { bytes.clone() } else { self.random_seed(rng).to_vec() };
                let from = rng.below(other.len() as u64 + 1) as usize;
                let piece =
                    other.get(from..(from + rng.below(256) as usize).min(other.len())).unwrap_or_default().to_vec();
                let end = if rng.one_in(2) { at } else { (at + piece.len()).min(bytes.len()) };
                _ = bytes.splice(at..end, piece);
            }
            5 => replace_number(bytes, at, rng),
            6 => {
                // A repeated part, for deep nesting and long names.
                let piece = bytes.get(at..end).unwrap_or_default().to_vec();
                let many = piece.repeat(1 << rng.below(8));
                _ = bytes.splice(at..at, many);
            }
            7 => bytes.insert(at, rng.next_u64() as u8),
            kind => {
                let Some(byte) = bytes.get_mut(at) else { return };
                *byte = match kind {
                    8 => *byte ^ 1 << rng.below(8),
                    9 => [0, 1, 0x7F, 0x80, 0xFF, b'\n', b'"', b'-'][rng.below(8) as usize],
                    _ => byte.wrapping_add([1, 0xFF, 16, 0xF0][rng.below(4) as usize]),
                };
            }
        }
    }

    fn random_word(&self, rng: &mut Rng) -> Vec<u8> {
        match self.dictionary.get(rng.below(self.dictionary.len() as u64) as usize) {
            Some(word) if !rng.one_in(4) => word.clone(),
            _ => BOUNDARY_NUMBERS[rng.below(BOUNDARY_NUMBERS.len() as u64) as usize].as_bytes().to_vec(),
        }
    }
}

/// Replaces the first number at or after `at` by another one.
fn replace_number(bytes: &mut Vec<u8>, at: usize, rng: &mut Rng) {
    let digit = |byte: &u8| byte.is_ascii_digit();
    let Some(start) = bytes.iter().skip(at).position(digit).map(|n| n + at) else { return };
    let len = bytes.iter().skip(start).take_while(|byte| digit(byte)).count();
    let other = BOUNDARY_NUMBERS[rng.below(BOUNDARY_NUMBERS.len() as u64) as usize];
    _ = bytes.splice(start..start + len, other.bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_selects_one_input() {
        for target in ["gdb", "expression", "disasm-avr"].map(|name| crate::find_target(name).expect("a target")) {
            let (one, other) = (Mutator::new(target, 5, Vec::new()), Mutator::new(target, 5, Vec::new()));
            let inputs: Vec<Vec<u8>> = (0..300).map(|number| one.input(number)).collect();
            assert!((0..300).all(|number| inputs[number as usize] == other.input(number)), "{}", target.name);
            assert!(inputs.iter().all(|input| input.len() <= target.max_input_bytes));
            let different: std::collections::HashSet<_> = inputs.iter().collect();
            assert!(different.len() > 200, "{}: {} of 300 inputs differ", target.name, different.len());
        }
    }
}
