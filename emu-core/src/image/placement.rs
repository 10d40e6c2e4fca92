//! Puts bytes at addresses of the image file into memories. It finds bytes outside of all memories, overlaps,
//! and half words.

use std::collections::BTreeMap;

use super::{ImageSpace, Segment, WordBits};

/// The source of bytes: for HEX a line and the column of the first byte, for ELF the number of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SourceSpan {
    pub line: u32,
    pub column: u32,
}

/// Why bytes could not be placed normally at `start..end` of the image file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlacementConflict {
    /// There is no memory.
    Outside { start: u64, end: u64 },
    /// `with` has already put bytes there.
    Overlap { start: u64, end: u64, with: SourceSpan },
    /// `with` has put erased bytes there; the new bytes replace them.
    Replaced { start: u64, end: u64, with: SourceSpan },
}

/// A byte whose word lacks its other half.
pub(super) struct HalfWord<'s> {
    pub space: &'s ImageSpace,
    /// Byte address within the memory.
    pub addr: u32,
    pub from: SourceSpan,
    /// Number of bytes of the run of `from` before this one.
    pub offset: u32,
}

/// What happens to the other half, for notes.
pub(super) const STAYS_ERASED: &str = ", which stays erased (0xFF)";

impl HalfWord<'_> {
    /// The byte that is present and the one that is missing, for messages.
    pub(super) fn bytes(&self) -> String {
        format!("byte 0x{:04X} without 0x{:04X}", self.addr, self.addr ^ 1)
    }
}

/// Words with bits that their memory does not implement.
pub(super) struct OverwideWords<'s> {
    pub space: &'s ImageSpace,
    /// Byte address of the first such word within the memory.
    pub addr: u32,
    /// The first such word.
    pub word: u16,
    /// Source of its upper byte.
    pub from: SourceSpan,
    /// Number of bytes of the record of `from` before that byte.
    pub offset: u32,
    /// Number of further such words.
    pub others: u32,
}

/// The bytes placed so far. No two runs overlap.
pub(super) struct PlacedBytes<'s> {
    spaces: &'s [ImageSpace],
    runs: Vec<BTreeMap<u32, ByteRun>>,
}

struct ByteRun {
    bytes: Vec<u8>,
    from: SourceSpan,
    /// Number of bytes of the record before the first byte of this run.
    offset: u32,
}

impl ByteRun {
    fn end(&self, start: u32) -> u32 {
        start + self.bytes.len() as u32
    }
}

/// Returns true if a byte is that of an erased cell: FF, or as the upper byte of a PIC word also 3F, or 00 if
/// the word holds a byte.
fn is_erased(space: &ImageSpace, at: u32, byte: u8) -> bool {
    let upper = space.word == 2 && space.word_bits != WordBits::All && at % 2 == 1;
    byte == 0xFF || upper && (byte == 0x3F || byte == 0 && matches!(space.word_bits, WordBits::Low(8)))
}

impl<'s> PlacedBytes<'s> {
    /// Makes an empty placement in these memories.
    pub(super) fn new(spaces: &'s [ImageSpace]) -> Self {
        PlacedBytes { spaces, runs: spaces.iter().map(|_| BTreeMap::new()).collect() }
    }

    /// Places `bytes` at the image address `addr`. Faulty parts are reported to `tell` and left out; the rest
    /// is placed.
    pub(super) fn place_bytes(
        &mut self,
        addr: u64,
        bytes: &[u8],
        from: SourceSpan,
        mut tell: impl FnMut(PlacementConflict),
    ) {
        let end = addr + bytes.len() as u64;
        let mut at = addr;
        while at < end {
            let inside = self.spaces.iter().position(|s| address_range(s).contains(&at));
            let stop = match inside {
                Some(i) => address_range(&self.spaces[i]).end.min(end),
                None => self
                    .spaces
                    .iter()
                    .map(|s| address_range(s).start)
                    .filter(|&start| start > at)
                    .min()
                    .unwrap_or(end)
                    .min(end),
            };
            match inside {
                Some(i) => {
                    let piece = slice(bytes, at - addr, stop - addr);
                    self.place_in_space(i, at, piece, from, (at - addr) as u32, &mut tell);
                }
                None => tell(PlacementConflict::Outside { start: at, end: stop }),
            }
            at = stop;
        }
    }

    fn place_in_space(
        &mut self,
        i: usize,
        addr: u64,
        bytes: &[u8],
        from: SourceSpan,
        offset: u32,
        tell: &mut impl FnMut(PlacementConflict),
    ) {
        let (Some(space), Some(runs)) = (self.spaces.get(i), self.runs.get_mut(i)) else { return };
        let base = u64::from(space.start);
        let start = (addr - base) as u32;
        let end = start + bytes.len() as u32;
        let first =
            runs.range(..=start).next_back().filter(|(at, run)| run.end(**at) > start).map_or(start, |(at, _)| *at);
        let taken: Vec<(u32, u32, SourceSpan)> =
            runs.range(first..end).map(|(at, run)| (*at, run.end(*at), run.from)).collect();
        let mut free = start;
        for (taken_from, taken_to, with) in taken.into_iter().chain([(end, end, from)]) {
            let (overlap_from, overlap_to) = (taken_from.max(start), taken_to.min(end));
            if free < overlap_from {
                let bytes = slice(bytes, u64::from(free - start), u64::from(overlap_from - start)).to_vec();
                runs.insert(free, ByteRun { bytes, from, offset: offset + (free - start) });
            }
            if overlap_from < overlap_to {
                let (start_at, end_at) = (base + u64::from(overlap_from), base + u64::from(overlap_to));
                let erased = runs.get(&taken_from).is_some_and(|run| {
                    let held = run.bytes.get((overlap_from - taken_from) as usize..(overlap_to - taken_from) as usize);
                    (overlap_from..).zip(held.unwrap_or_default()).all(|(at, byte)| is_erased(space, at, *byte))
                });
                if erased && let Some(old) = runs.remove(&taken_from) {
                    let piece = |from: u32, to: u32| ByteRun {
                        bytes: slice(&old.bytes, u64::from(from - taken_from), u64::from(to - taken_from)).to_vec(),
                        from: old.from,
                        offset: old.offset + (from - taken_from),
                    };
                    let new = slice(bytes, u64::from(overlap_from - start), u64::from(overlap_to - start)).to_vec();
                    let new = ByteRun { bytes: new, from, offset: offset + (overlap_from - start) };
                    let pieces = [
                        (taken_from, piece(taken_from, overlap_from)),
                        (overlap_from, new),
                        (overlap_to, piece(overlap_to, taken_to)),
                    ];
                    runs.extend(pieces.into_iter().filter(|(_, run)| !run.bytes.is_empty()));
                    tell(PlacementConflict::Replaced { start: start_at, end: end_at, with });
                } else {
                    tell(PlacementConflict::Overlap { start: start_at, end: end_at, with });
                }
            }
            free = overlap_to;
        }
    }

    /// The bytes that define half a word. In a memory of two-byte words, every contiguous range of bytes must
    /// start and end at an even address.
    pub(super) fn half_words(&self) -> Vec<HalfWord<'_>> {
        let mut halves = Vec::new();
        for (space, runs) in self.spaces.iter().zip(&self.runs).filter(|(s, _)| s.word == 2) {
            let mut runs = runs.iter().peekable();
            let mut last_end = None;
            while let Some((&at, run)) = runs.next() {
                if at % 2 == 1 && last_end != Some(at) {
                    halves.push(HalfWord { space, addr: at, from: run.from, offset: run.offset });
                }
                let end = run.end(at);
                if end % 2 == 1 && runs.peek().is_none_or(|(next, _)| **next != end) {
                    let offset = run.offset + (end - at - 1);
                    halves.push(HalfWord { space, addr: end - 1, from: run.from, offset });
                }
                last_end = Some(end);
            }
        }
        halves
    }

    /// Adds an erased byte beside each byte that [`PlacedBytes::half_words`] finds in a memory of 16-bit
    /// words.
    pub(super) fn fill_half_words(&mut self) {
        let halves = self.half_words().into_iter().filter(|half| half.space.word_bits == WordBits::All);
        let halves: Vec<_> = halves.map(|half| (half.space.name, half.addr ^ 1, half.from)).collect();
        for (name, addr, from) in halves {
            let runs = self.spaces.iter().position(|space| space.name == name).and_then(|i| self.runs.get_mut(i));
            if let Some(runs) = runs {
                runs.insert(addr, ByteRun { bytes: vec![0xFF], from, offset: 0 });
            }
        }
    }

    /// For each memory, the words with bits that it does not implement. Half words are ignored.
    pub(super) fn wide_words(&self) -> Vec<OverwideWords<'_>> {
        let mut found = Vec::new();
        for (space, runs) in self.spaces.iter().zip(&self.runs).filter(|(s, _)| s.word == 2) {
            let (WordBits::Only(bits) | WordBits::Low(bits)) = space.word_bits else { continue };
            let mut first: Option<OverwideWords<'_>> = None;
            let mut low = None;
            for (&at, run) in runs {
                for ((addr, offset), &byte) in (at..).zip(run.offset..).zip(&run.bytes) {
                    if addr % 2 == 0 {
                        low = Some((addr, byte));
                        continue;
                    }
                    let Some((addr, low)) = low.filter(|&(even, _)| even + 1 == addr) else { continue };
                    let word = u16::from_le_bytes([low, byte]);
                    match &mut first {
                        _ if u32::from(word) >> bits == 0 => {}
                        Some(first) => first.others += 1,
                        None => first = Some(OverwideWords { space, addr, word, from: run.from, offset, others: 0 }),
                    }
                }
            }
            found.extend(first);
        }
        found
    }

    /// Returns true if nothing was placed.
    pub(super) fn is_empty(&self) -> bool {
        self.runs.iter().all(BTreeMap::is_empty)
    }

    /// The bytes in the order of memories and addresses, with adjacent runs merged.
    pub(super) fn into_segments(self) -> Vec<Segment> {
        let mut segments: Vec<Segment> = Vec::new();
        for (space, runs) in self.spaces.iter().zip(self.runs) {
            for (addr, run) in runs {
                match segments.last_mut() {
                    Some(s) if s.space == space.name && s.addr + s.bytes.len() as u32 == addr => {
                        s.bytes.extend(run.bytes)
                    }
                    _ => segments.push(Segment { space: space.name, addr, bytes: run.bytes }),
                }
            }
        }
        segments
    }
}

/// The address range of the memory `space` in the image file.
pub(super) fn address_range(space: &ImageSpace) -> std::ops::Range<u64> {
    let start = u64::from(space.start);
    start..start + u64::from(space.len)
}

/// The memories and their address ranges, for messages.
pub(super) fn describe_spaces(spaces: &[ImageSpace]) -> String {
    let names = spaces.iter().filter(|s| s.len > 0).map(|s| {
        let window = address_range(s);
        format!("{} {:#06X} to {:#06X}, {} bytes", s.name, window.start, window.end - 1, s.len)
    });
    names.collect::<Vec<_>>().join("; ")
}

/// `bytes[from..to]`, empty if the range does not exist.
fn slice(bytes: &[u8], from: u64, to: u64) -> &[u8] {
    bytes.get(from as usize..to as usize).unwrap_or_default()
}
