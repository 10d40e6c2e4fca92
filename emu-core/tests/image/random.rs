//! Random and damaged files cause no panic and are not accepted silently. A failing case prints its input in
//! shrunk form.

use std::collections::BTreeMap;

use emu_core::image::{
    AddressedByte, HexSegment, ImageSpace, LoadedImage, MAX_REPORTED, WordBits, load, load_hex, write_hex,
};
use proptest::prelude::*;

use crate::AVR;
use crate::elf::{MEMORIES, program};

const HEX_MEMORIES: &[ImageSpace] = &[
    ImageSpace { name: "low", start: 0, len: 0x1000, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "middle", start: 0xFF00, len: 0x200, word: 1, word_bits: WordBits::All },
    ImageSpace { name: "high", start: 0xFFFF_FF00, len: 0x100, word: 1, word_bits: WordBits::All },
];

/// Random cells of the memories above, as addresses of the file with their bytes, with many adjacent cells
/// and cells at the ends.
fn cells() -> impl Strategy<Value = BTreeMap<u32, u8>> {
    let stretch = (prop_oneof![0u32..0xFC0, 0xFF00u32..0x1_00C0, Just(0xFFF8), 0xFFFF_FF00u32..0xFFFF_FFC0], 1u32..64);
    prop::collection::vec((stretch, any::<u8>()), 0..12).prop_map(|stretches| {
        let bytes =
            |((start, len), seed): ((u32, u32), u8)| (0..len).map(move |i| (start + i, seed.wrapping_add(i as u8)));
        stretches.into_iter().flat_map(bytes).collect()
    })
}

/// Groups adjacent cells, so that the writer gets segments of one byte and of many bytes.
fn stretches(cells: &BTreeMap<u32, u8>) -> Vec<(u32, Vec<u8>)> {
    let mut all: Vec<(u32, Vec<u8>)> = Vec::new();
    for (&addr, &byte) in cells {
        match all.last_mut() {
            Some((start, bytes)) if start.checked_add(bytes.len() as u32) == Some(addr) => bytes.push(byte),
            _ => all.push((addr, vec![byte])),
        }
    }
    all
}

fn write(cells: &BTreeMap<u32, u8>) -> String {
    let stretches = stretches(cells);
    let mut slices: Vec<HexSegment> = stretches.iter().map(|(addr, bytes)| HexSegment { addr: *addr, bytes }).collect();
    slices.reverse();
    write_hex(&slices)
}

fn read(loaded: &LoadedImage) -> BTreeMap<u32, u8> {
    let in_space = |space: &'static ImageSpace| {
        loaded.image.bytes_in(space.name).map(move |AddressedByte { addr: at, byte }| (space.start + at, byte))
    };
    HEX_MEMORIES.iter().flat_map(in_space).collect()
}

/// An accepted file has a record on every line, as `ihex` alone reads it, and contains exactly the bytes of
/// those records.
fn accepted_is_sound(text: &[u8], loaded: &LoadedImage) -> Result<(), TestCaseError> {
    let mut base = 0u32;
    let mut bytes = BTreeMap::new();
    let text = diag::text::strip_line_decorations(text);
    for line in text.split(|&b| b == b'\n').map(|line| line.trim_ascii()) {
        if matches!(line, [] | [b';', ..]) {
            continue;
        }
        let line = std::str::from_utf8(line).expect("an accepted line is ASCII");
        match line.parse::<ihex::Record>().expect("an accepted line is a record") {
            ihex::Record::Data { offset, value } => {
                let at = base + u32::from(offset);
                bytes.extend(value.iter().enumerate().map(|(i, &byte)| (at + i as u32, byte)));
            }
            ihex::Record::ExtendedLinearAddress(upper) => base = u32::from(upper) << 16,
            ihex::Record::ExtendedSegmentAddress(segment) => base = u32::from(segment) << 4,
            _ => {}
        }
    }
    prop_assert_eq!(read(loaded), bytes);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn written_images_read_back(cells in cells(), crlf: bool, lower: bool) {
        let mut text = write(&cells);
        if lower { text = text.to_lowercase(); }
        if crlf { text = text.replace('\n', "\r\n"); }
        let loaded = load_hex("a.hex", text.as_bytes(), HEX_MEMORIES).expect("the writer's text is accepted");
        prop_assert_eq!(read(&loaded), cells);
        prop_assert!(text.lines().all(|line| line.len() <= 1 + 2 * (4 + 16 + 1)));
        for (a, b) in loaded.image.segments.iter().zip(loaded.image.segments.iter().skip(1)) {
            prop_assert!(a.space != b.space || a.addr + (a.bytes.len() as u32) < b.addr, "merged and apart");
        }
    }

    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..600)) {
        let _ = load("a", &bytes, HEX_MEMORIES, MEMORIES, AVR);
        let elf = [&[0x7F, b'E', b'L', b'F'][..], &bytes].concat();
        prop_assert!(load("a", &elf, HEX_MEMORIES, MEMORIES, AVR).is_err());
    }

    #[test]
    fn any_text(text in "[:0-9A-Fa-f\r\n \tSx\u{e9}\u{feff}]{0,600}") {
        if let Ok(loaded) = load_hex("a", text.as_bytes(), HEX_MEMORIES) {
            accepted_is_sound(text.as_bytes(), &loaded)?;
        }
    }

    /// A changed digit is always detected, because it changes the sum of its line, and nothing but a digit is
    /// valid there.
    #[test]
    fn one_changed_character(cells in cells(), at: prop::sample::Index, to: u8) {
        let mut text = write(&cells).into_bytes();
        let at = at.index(text.len());
        let from = text[at];
        text[at] = to;
        let same = from.eq_ignore_ascii_case(&to);
        // A line end can become CR; in the last line, where nothing is joined, also a space or ^Z.
        let last = at + 1 == text.len() && (to.is_ascii_whitespace() || to == 0x1A);
        let blank = from == b'\n' && (to == b'\r' || last);
        // A record that becomes a comment is reported.
        let loaded = load_hex("a", &text, HEX_MEMORIES).ok().filter(|loaded| loaded.warnings.iter().all(|d| d.code != "HEX027"));
        prop_assert_eq!(loaded.is_some(), same || blank);
    }

    #[test]
    fn damaged_hex(cells in cells(), edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..8)) {
        let mut text = write(&cells).into_bytes();
        for (at, byte, how) in edits {
            let at = at.index(text.len());
            match how {
                0 => text[at] = byte,
                1 => text.insert(at, byte),
                2 if text.len() > 1 => drop(text.remove(at)),
                _ => text.extend_from_within(at..),
            }
        }
        match load_hex("a", &text, HEX_MEMORIES) {
            Ok(loaded) => accepted_is_sound(&text, &loaded)?,
            Err(all) => {
                prop_assert!(all.iter().any(|d| d.is_error()) && all.len() <= 2 * MAX_REPORTED + 1);
                let text = diag::text::readable(&text);
                let lines: Vec<&str> = text.split('\n').collect();
                for d in all.iter().filter(|d| d.pos.line > 0 && d.code != "HEX014") {
                    let chars = lines[d.pos.line as usize - 1].chars().count() as u32;
                    prop_assert!(d.pos.column + d.pos.width <= chars + 1, "{d} points beyond its line");
                }
            }
        }
    }

    #[test]
    fn damaged_elf(edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..6)) {
        let mut file = program().build();
        for (at, byte, how) in edits {
            let at = at.index(file.len().max(1));
            match how {
                0 | 1 if at < file.len() => file[at] = byte,
                2 if at % 4 == 0 && at + 4 <= file.len() => file[at..at + 4].fill(0xFF),
                3 if byte < 16 => file.truncate(at),
                _ => {}
            }
        }
        match load("a", &file, HEX_MEMORIES, MEMORIES, AVR) {
            Ok(loaded) => for s in &loaded.image.segments {
                let space = MEMORIES.iter().chain(HEX_MEMORIES).find(|m| m.name == s.space).unwrap();
                prop_assert!(!s.bytes.is_empty() && s.addr as usize + s.bytes.len() <= space.len as usize);
            },
            Err(all) => prop_assert!(all.iter().any(|d| d.is_error())),
        }
    }
}
