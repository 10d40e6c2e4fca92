//! The configuration block: what is read, what is rejected and where, and images as Intel HEX.

use emu_ap101::chips::AP101;
use emu_ap101::{Ap101, Ap101Config, InputSampling};
use emu_core::image::{HexSegment, load_hex, write_hex};

use crate::rig::{Block, image, words};

/// Offset in the block, byte, offset that the fault reports, part of the message.
const DAMAGES: &[(usize, u8, usize, &str)] = &[
    (0x000, b'X', 0x000, "does not begin with AP: 58 for 41"),
    (0x001, 0, 0x001, "does not begin with AP: 00 for 50"),
    (0x002, 2, 0x002, "version 2"),
    (0x003, 2, 0x003, "inputs is 2"),
    (0x004, 2, 0x004, "mode is 2"),
    (0x005, 1, 0x005, "reserved byte is 01"),
    (0x007, 2, 0x006, "output channels is 516"),
    (0x009, 3, 0x008, "input channels is 776"),
    (0x00B, 1, 0x00B, "reserved"),
    (0x014, 1, 0x014, "reserved"),
    (0x01F, 9, 0x01F, "reserved"),
    (0x021, 8, 0x020, "the first word of program 0 is 2048"),
    (0x028, 1, 0x02A, "program 1 begins at 1, after its last word 0"),
    (0x02B, 8, 0x02A, "the last word of program 1 is 2048"),
    (0x02D, 8, 0x02C, "RX of program 1 is 2048"),
    (0x02E, 4, 0x02E, "the flags of program 1 is 4"),
    (0x022, 7, 0x022, "program 0 is not present, and a field of it is 7"),
    (0x034, 1, 0x034, "program 2 is not present, and a field of it is 1"),
    (0x101, 1, 0x101, "module 0 is not a timer, and its unit is 1"),
    (0x107, 1, 0x106, "module 1 does not exist, but its preset is 256"),
    (0x060, 1, 0x060, "reserved"),
    (0x0FF, 1, 0x0FF, "reserved"),
    (0x100, 8, 0x100, "module 0 has type 8"),
    (0x2FD, 4, 0x2FD, "module 127 has unit 4"),
];

#[test]
fn damaged_blocks_are_refused_where_they_are() {
    for &(at, byte, place, cause) in DAMAGES {
        let mut image = image(&words("nop"), Some(&Block::EMPTY));
        image.segments[1].bytes[at] = byte;
        let damages = Ap101Config::read_config(&image).expect_err("damaged");
        let [damage] = damages.as_slice() else { panic!("{at:x}: {damages:?}") };
        assert_eq!(damage.addr as usize, 0x1000 + place, "{at:x}");
        assert!(damage.cause.contains(cause) && !damage.hint.is_empty(), "{at:x}: {damage:?}");
    }
}

#[test]
fn every_fault_is_reported() {
    let mut image = image(&words("nop"), Some(&Block::EMPTY));
    for at in [2, 0x61, 0x104] {
        image.segments[1].bytes[at] = 0xEE;
    }
    let places: Vec<u32> =
        Ap101Config::read_config(&image).expect_err("damaged").iter().map(|damage| damage.addr).collect();
    assert_eq!(places, [0x1002, 0x1061, 0x1104]);
}

#[test]
fn half_a_block_is_none() {
    for (from, to, place) in [(0, 0x2FF, 0x12FF), (1, 0x300, 0x1000), (0, 1, 0x1001)] {
        let mut image = image(&words("nop"), Some(&Block::EMPTY));
        let segment = &mut image.segments[1];
        segment.bytes = segment.bytes[from..to].to_vec();
        segment.addr = from as u32;
        let damages = Ap101Config::read_config(&image).expect_err("half a block");
        assert_eq!(damages.iter().map(|damage| damage.addr).collect::<Vec<_>>(), [place]);
    }
}

#[test]
fn without_a_block_there_is_one_program_and_all_channels() {
    let config = Ap101Config::read_config(&image(&words("ld I1; sto E1"), None)).expect("no block");
    assert_eq!(config, Ap101Config::default());
    assert_eq!((config.output_channels, config.input_channels, config.hz), (256, 512, 1_000_000));
    assert_eq!((config.inputs, config.period, config.programs.len()), (InputSampling::Scan, 0, 0));
}

#[test]
fn a_configuration_writes_its_block() {
    let mut full = Block { live: true, reconfigurable: true, hz: 32_768, period: 70_000, ..Block::EMPTY };
    (full.programs[0], full.programs[2], full.programs[7]) = ([0, 9, 3, 3], [4, 2047, 0, 1], [0, 0, 0, 2]);
    (full.modules[1], full.modules[127]) = ((1, 2, 500), (6, 0, 0xFFFF));
    // The default clock is written as a number.
    let plain = Block { hz: 1_000_000, ..Block::EMPTY };
    for block in [plain, full] {
        let config = Ap101Config::read_config(&image(&words("nop"), Some(&block))).expect("sound");
        assert_eq!(config.to_bytes(), block.bytes());
    }
}

#[test]
fn an_image_comes_back_from_its_hex_file() {
    let program = words("ld I1; and I2; sto M1; ld I3; or M1; stoc E1; .word 0xF064; nop; jmp 0");
    let block = Block { hz: 32_768, period: 77, ..Block::EMPTY };
    for block in [None, Some(&block)] {
        let image = image(&program, block);
        let write = |image: &emu_core::image::Image| {
            let start = |space: &str| {
                AP101.hex_spaces.iter().find(|window| window.name == space).map_or(0, |window| window.start)
            };
            let segments: Vec<_> =
                image.segments.iter().map(|s| HexSegment { addr: start(s.space) + s.addr, bytes: &s.bytes }).collect();
            write_hex(&segments)
        };
        let text = write(&image);
        let loaded = load_hex("a.hex", text.as_bytes(), AP101.hex_spaces).expect("a file of ours");
        assert!(loaded.warnings.is_empty());
        assert_eq!(loaded.image.segments, image.segments);
        assert_eq!(write(&loaded.image), text);
        assert_eq!(Ap101::new(&loaded.image).config(), Ap101::new(&image).config());
    }
}

#[test]
fn half_a_word_is_noted_and_bytes_after_the_memories_are_refused() {
    let text = write_hex(&[HexSegment { addr: 0, bytes: &[1, 2, 3] }]);
    let loaded = load_hex("a.hex", text.as_bytes(), AP101.hex_spaces).expect("half a word stays erased");
    let codes: Vec<&str> = loaded.warnings.iter().map(|note| note.code).collect();
    assert_eq!(codes, ["HEX018"]);
    let behind = write_hex(&[HexSegment { addr: 0x1300, bytes: &[1] }]);
    assert!(load_hex("a.hex", behind.as_bytes(), AP101.hex_spaces).is_err());
}
