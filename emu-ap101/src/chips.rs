//! The only chip of the family, as data.

use emu_core::chip::{Chip, ChipFamily, ChipSpace, NamedAddress, PinDef};
use emu_core::image::{ImageSpace, WordBits};
use emu_core::pins::PinId;

use crate::config::{CONFIG_ADDRESS, CONFIG_BYTES, INPUTS, OUTPUTS};
use crate::isa::{ISA, SPAN};

/// The first output channel among the pins; the input channels come before it.
pub const FIRST_OUTPUT: PinId = INPUTS;
/// The supply; low means no supply.
pub const POWER_PIN: PinId = INPUTS + OUTPUTS;
/// Requests a cold start.
pub const CLEAR_PIN: PinId = POWER_PIN + 1;
/// Total number of pins.
pub const PIN_COUNT: usize = CLEAR_PIN as usize + 1;

/// Maximum length of the name of a channel.
const NAME: usize = 4;

/// The name of a channel.
#[derive(Clone, Copy)]
struct ChannelName {
    /// A letter and a number of up to three digits; zeros after them.
    letters: [u8; NAME],
    /// The number of characters.
    len: usize,
}

/// The name of a channel, a letter and a number of up to three digits, and its length.
const fn channel(letter: u8, n: u16) -> ChannelName {
    let (hundreds, tens, ones) = (b'0' + (n / 100) as u8, b'0' + (n / 10 % 10) as u8, b'0' + (n % 10) as u8);
    match n {
        0..=9 => ChannelName { letters: [letter, ones, 0, 0], len: 2 },
        10..=99 => ChannelName { letters: [letter, tens, ones, 0], len: 3 },
        _ => ChannelName { letters: [letter, hundreds, tens, ones], len: 4 },
    }
}

const fn names() -> [ChannelName; FIRST_OUTPUT as usize + OUTPUTS as usize] {
    let mut names = [ChannelName { letters: [0; NAME], len: 0 }; FIRST_OUTPUT as usize + OUTPUTS as usize];
    let mut i = 0;
    while i < names.len() {
        let n = i as u16;
        names[i] = if n < FIRST_OUTPUT { channel(b'I', n) } else { channel(b'E', n - FIRST_OUTPUT) };
        i += 1;
    }
    names
}

const NAMES: &[ChannelName] = &names();

const fn name(pin: usize) -> &'static str {
    let ChannelName { letters, len } = &NAMES[pin];
    match std::str::from_utf8(letters.split_at(*len).0) {
        Ok(name) => name,
        Err(_) => "",
    }
}

const fn pins() -> [PinDef; PIN_COUNT] {
    let mut pins = [PinDef { name: "POWER", dip: Chip::NO_PACKAGE, note: "supply, 0 is none" }; PIN_COUNT];
    let mut i = 0;
    while i < NAMES.len() {
        pins[i] = PinDef { name: name(i), dip: Chip::NO_PACKAGE, note: "" };
        i += 1;
    }
    pins[CLEAR_PIN as usize] = PinDef { name: "CLEAR", dip: Chip::NO_PACKAGE, note: "cold start" };
    pins
}

/// Memories of an image file.
const IMAGE: &[ImageSpace] = &[
    ImageSpace { name: "code", start: 0, len: 2 * SPAN as u32, word: 2, word_bits: WordBits::All },
    ImageSpace { name: "config", start: CONFIG_ADDRESS, len: CONFIG_BYTES, word: 1, word_bits: WordBits::All },
];

/// Memories with one bit per address.
pub const BIT_SPACES: [&str; 4] = ["i", "e", "m", "r"];

/// The chip row of AP101.
pub static AP101: Chip = Chip {
    name: "ap101",
    family: ChipFamily::Ap101,
    isa: &ISA,
    title: "AP101, a programmable controller that computes single bits",
    data_sheet: "Programarea automatelor programabile cu prelucrare la nivel de bit (hand-out); emu-ap101/QUIRKS.md",
    code_space: "code",
    flash_bytes: 2 * SPAN as u32,
    on_chip_flash_bytes: 2 * SPAN as u32,
    ram_space: "m",
    ram_start: 0,
    ram_len: 512,
    ram_ranges: &[],
    eeprom_bytes: 0,
    word_bytes: 2,
    max_hz: u32::MAX as u64,
    default_hz: crate::config::HZ,
    hex_spaces: IMAGE,
    elf_spaces: &[],
    elf_machine: 0,
    cpu_regs: &["A", "NA", "RIC", "RX", "PROG", "OVR"],
    reg_space: "r",
    regs: REGS,
    bits: &[],
    constants: Vec::new,
    pins: PIN_LIST,
    vectors: &[],
    words_per_vector: 0,
    packages: &[],
    later_vectors_back_words: 0,
    spaces: &[
        ChipSpace::new("code", SPAN as u32, 2),
        ChipSpace::new("i", 512, 1),
        ChipSpace::new("e", 256, 1),
        ChipSpace::new("m", 512, 1),
        ChipSpace::new("r", 384, 1),
        ChipSpace::new("preset", 128, 2),
        ChipSpace::new("value", 128, 2),
    ],
    observable_spaces: &[("i", 0), ("e", 0), ("m", 0), ("r", 0)],
    implicit_accesses: &[],
};

const REGS: &[NamedAddress] = &[];
const PIN_LIST: &[PinDef] = &pins();

/// All chips of this crate.
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    std::iter::once(&AP101)
}
