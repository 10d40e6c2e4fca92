//! Reads the configuration block from bytes (rule 17).

/// An entry of the program table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    pub start: u16,
    pub last: u16,
    pub rx: u16,
    pub present: bool,
    pub enabled: bool,
}

/// Kind, unit and preset of an R module, by their numbers in the block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    pub kind: u8,
    pub unit: u8,
    pub preset: u16,
}

/// The contents of the block.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    pub live: bool,
    pub reconfigurable: bool,
    pub outputs: usize,
    pub inputs: usize,
    pub hz: u64,
    /// Machine cycles, 0 for none.
    pub period: u64,
    pub programs: Vec<Entry>,
    pub modules: Vec<Record>,
}

/// Address of the first byte of the block, and its length.
pub const BLOCK: usize = 0x1000;
pub const LENGTH: usize = 0x300;

impl Config {
    /// The configuration of a chip without a block.
    pub fn none() -> Config {
        let nothing = Entry { start: 0, last: 0, rx: 0, present: false, enabled: false };
        Config {
            live: false,
            reconfigurable: false,
            outputs: 256,
            inputs: 512,
            hz: 1_000_000,
            period: 0,
            programs: vec![nothing; 8],
            modules: vec![Record { kind: 0, unit: 0, preset: 0 }; 128],
        }
    }

    /// Reads the bytes of a block. The error is the offset of the first wrong byte.
    pub fn read(block: &[u8]) -> Result<Config, usize> {
        let two = |at: usize| u16::from(block[at]) + 256 * u16::from(block[at + 1]);
        let four = |at: usize| u64::from(two(at)) + 65536 * u64::from(two(at + 2));
        let must = |good: bool, at: usize| if good { Ok(()) } else { Err(at) };
        must(block[0] == b'A', 0)?;
        must(block[1] == b'P', 1)?;
        must(block[2] == 1, 2)?;
        must(block[3] <= 1, 3)?;
        must(block[4] <= 1, 4)?;
        must(block[5] == 0, 5)?;
        must(two(6) <= 256, 6)?;
        must(two(8) <= 512, 8)?;
        for reserved in (0xA..0xC).chain(0x14..0x20).chain(0x60..0x100) {
            must(block[reserved] == 0, reserved)?;
        }
        let mut programs = Vec::new();
        for number in 0..8 {
            let at = 0x20 + 8 * number;
            let flags = two(at + 6);
            must(two(at) < 2048, at)?;
            must(two(at + 2) < 2048 && two(at) <= two(at + 2), at + 2)?;
            must(two(at + 4) < 2048, at + 4)?;
            must(flags < 4, at + 6)?;
            // Of an absent program only the flags have a meaning.
            for field in [at, at + 2, at + 4] {
                must(flags % 2 == 1 || two(field) == 0, field)?;
            }
            let (present, enabled) = (flags % 2 == 1, flags / 2 == 1);
            programs.push(Entry { start: two(at), last: two(at + 2), rx: two(at + 4), present, enabled });
        }
        let mut modules = Vec::new();
        for number in 0..128 {
            let at = 0x100 + 4 * number;
            must(block[at] <= 7, at)?;
            must(block[at + 1] <= 3, at + 1)?;
            let timer = (1..=4).contains(&block[at]);
            must(timer || block[at + 1] == 0, at + 1)?;
            must(block[at] != 0 || two(at + 2) == 0, at + 2)?;
            modules.push(Record { kind: block[at], unit: block[at + 1], preset: two(at + 2) });
        }
        let hz = if four(0xC) == 0 { 1_000_000 } else { four(0xC) };
        let (outputs, inputs) = (usize::from(two(6)), usize::from(two(8)));
        let (live, reconfigurable) = (block[3] == 1, block[4] == 1);
        Ok(Config { live, reconfigurable, outputs, inputs, hz, period: four(0x10), programs, modules })
    }

    /// Writes a block with this configuration.
    pub fn write(&self) -> Vec<u8> {
        let mut block = vec![0; LENGTH];
        let mut put = |at: usize, bytes: &[u8]| block[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, &[b'A', b'P', 1, u8::from(self.live), u8::from(self.reconfigurable)]);
        put(6, &(self.outputs as u16).to_le_bytes());
        put(8, &(self.inputs as u16).to_le_bytes());
        put(0xC, &(self.hz as u32).to_le_bytes());
        put(0x10, &(self.period as u32).to_le_bytes());
        for (number, entry) in self.programs.iter().enumerate() {
            let flags = u16::from(entry.present) + 2 * u16::from(entry.enabled);
            for (place, value) in [entry.start, entry.last, entry.rx, flags].into_iter().enumerate() {
                put(0x20 + 8 * number + 2 * place, &value.to_le_bytes());
            }
        }
        for (number, record) in self.modules.iter().enumerate() {
            let [low, high] = record.preset.to_le_bytes();
            put(0x100 + 4 * number, &[record.kind, record.unit, low, high]);
        }
        block
    }
}
