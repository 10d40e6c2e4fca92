//! Images for the tests: programs as text, and configuration blocks given as differences from an empty one.

use emu_ap101::chips::AP101;
use emu_ap101::config::{CONFIG_BYTES, MODULES, PROGRAMS};
use emu_core::image::{Image, Segment};

/// The fields of a configuration block.
#[derive(Debug, Clone)]
pub struct Block {
    pub live: bool,
    pub reconfigurable: bool,
    pub outputs: u16,
    pub inputs: u16,
    pub hz: u32,
    pub period: u32,
    /// Start, last, RX, flags.
    pub programs: [[u16; 4]; PROGRAMS],
    /// Type, unit, preset.
    pub modules: [(u8, u8, u16); MODULES],
}

impl Block {
    /// A few channels, and nothing else.
    pub const EMPTY: Block = Block {
        live: false,
        reconfigurable: false,
        outputs: 4,
        inputs: 8,
        hz: 0,
        period: 0,
        programs: [[0; 4]; PROGRAMS],
        modules: [(0, 0, 0); MODULES],
    };

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0; CONFIG_BYTES as usize];
        let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
        put(0, &[b'A', b'P', 1, self.live.into(), self.reconfigurable.into()]);
        put(6, &self.outputs.to_le_bytes());
        put(8, &self.inputs.to_le_bytes());
        put(0xC, &self.hz.to_le_bytes());
        put(0x10, &self.period.to_le_bytes());
        for (n, entry) in self.programs.iter().enumerate() {
            for (field, value) in entry.iter().enumerate() {
                put(0x20 + 8 * n + 2 * field, &value.to_le_bytes());
            }
        }
        for (n, &(kind, unit, preset)) in self.modules.iter().enumerate() {
            let [low, high] = preset.to_le_bytes();
            put(0x100 + 4 * n, &[kind, unit, low, high]);
        }
        bytes
    }
}

/// An image of words from address 0 on, with a block if one is given.
pub fn image(words: &[u16], block: Option<&Block>) -> Image {
    let code: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let mut image = Image::default();
    if !code.is_empty() {
        image.segments.push(Segment { space: "code", addr: 0, bytes: code });
    }
    if let Some(block) = block {
        image.segments.push(Segment { space: "config", addr: 0, bytes: block.bytes() });
    }
    image
}

/// The words of a program; instructions are separated by semicolons.
pub fn words(text: &str) -> Vec<u16> {
    let lines = text.split(';').map(str::trim).filter(|line| !line.is_empty());
    lines
        .flat_map(|line| emu_asm::assemble_line(&AP101, line, 0).unwrap_or_else(|error| panic!("{line}: {error}")))
        .collect()
}
