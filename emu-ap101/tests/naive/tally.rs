//! Counts how often everything has occurred, to check that random programs cover all of it.

use super::asm::{KINDS, UNITS};
use super::decode::{OPS, Place, Word};

const PLACES: [&str; 8] = ["I", "E", "R", "R running", "R port", "M", "image", "unmapped"];
const EVENTS: [&str; 12] = [
    "jump taken",
    "program cycle",
    "refresh changed an output",
    "overrun",
    "loss of the supply",
    "warm start",
    "cold start",
    "glitch",
    "preset by software",
    "idle",
    "another program",
    "settled",
];

/// The counts, indexed by the numbers of what is counted.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    ops: [[u64; 2]; 16],
    read: [u64; 8],
    written: [u64; 8],
    modules: [[u64; 4]; 8],
    reached: [[u64; 4]; 8],
    events: [u64; EVENTS.len()],
}

/// The index of a place in `PLACES`.
fn number(place: Place) -> usize {
    match place {
        Place::Input(_) => 0,
        Place::Output(_) => 1,
        Place::Module(_) => 2,
        Place::Running(_) => 3,
        Place::Port(_) => 4,
        Place::Ram(_) => 5,
        Place::Image(_) => 6,
        Place::Nowhere => 7,
    }
}

impl Tally {
    pub fn executed(&mut self, word: Word) {
        self.ops[word.op as usize][usize::from(word.indexed)] += 1;
    }
    pub fn read(&mut self, place: Place) {
        self.read[number(place)] += 1;
    }
    pub fn written(&mut self, place: Place) {
        self.written[number(place)] += 1;
    }
    /// Counts a write of a module of a kind and unit, or a read with Q = 1.
    pub fn module(&mut self, (kind, unit): (u8, u8), q: bool) {
        let counts = if q { &mut self.reached } else { &mut self.modules };
        counts[usize::from(kind)][usize::from(unit)] += 1;
    }
    pub fn event(&mut self, name: &str) {
        let at = EVENTS.iter().position(|event| *event == name).expect("an event");
        self.events[at] += 1;
    }
    pub fn program_cycles(&self) -> u64 {
        self.events[1]
    }

    /// All counts by name.
    pub fn rows(&self) -> Vec<(String, u64)> {
        let mut rows = Vec::new();
        for ((name, _), counts) in OPS.iter().zip(self.ops) {
            rows.push((format!("{name} direct"), counts[0]));
            rows.push((format!("{name} with X"), counts[1]));
        }
        for (at, place) in PLACES.iter().enumerate() {
            rows.push((format!("read of {place}"), self.read[at]));
            rows.push((format!("write of {place}"), self.written[at]));
        }
        for (kind, name) in KINDS.iter().enumerate().skip(1) {
            // Counters have no unit of time.
            for (unit, of) in UNITS.iter().enumerate().take(if kind < 5 { 4 } else { 1 }) {
                rows.push((format!("{name} {of} written"), self.modules[kind][unit]));
                rows.push((format!("{name} {of} read as 1"), self.reached[kind][unit]));
            }
        }
        rows.extend(EVENTS.iter().zip(self.events).map(|(name, count)| (name.to_string(), count)));
        rows
    }

    pub fn add(&mut self, other: &Tally) {
        let pairs = |mine: &mut [u64], theirs: &[u64]| mine.iter_mut().zip(theirs).for_each(|(a, b)| *a += b);
        pairs(self.ops.as_flattened_mut(), other.ops.as_flattened());
        pairs(&mut self.read, &other.read);
        pairs(&mut self.written, &other.written);
        pairs(self.modules.as_flattened_mut(), other.modules.as_flattened());
        pairs(self.reached.as_flattened_mut(), other.reached.as_flattened());
        pairs(&mut self.events, &other.events);
    }
}
