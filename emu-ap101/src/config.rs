//! The configuration block, bytes 1000h to 12FFh of an image: channels, clock, program table, modules.
//!
//! ```text
//!   1000h  'A' 'P'
//!   1002h  version, 1
//!   1003h  inputs: 0 scan, 1 live
//!   1004h  mode: 0 fixed, 1 reconfigurable
//!   1006h  output channels, 2 bytes
//!   1008h  input channels, 2 bytes
//!   100Ch  clock in Hz, 4 bytes; 0 is 1,000,000
//!   1010h  period in machine cycles, 4 bytes; 0 is free running
//!   1020h  8 programs: start, last, RX, flags (bit 0 present, bit 1 enabled at a cold start), 2 bytes each
//!   1100h  128 modules: type, unit, preset (2 bytes)
//!   else   reserved, 0
//! ```
//! Numbers of several bytes have the lowest byte first.

use diag::DiagnosticCode;
use emu_core::image::Image;

use crate::isa::SPAN;
pub use crate::modules::{ModuleKind, ModuleSettings, ModuleTimeUnit};

/// Byte address of the block in an image file.
pub const CONFIG_ADDRESS: u32 = 0x1000;
/// Size of the block in bytes.
pub const CONFIG_BYTES: u32 = 0x300;

/// Number of programs in the table.
pub const PROGRAMS: usize = 8;

/// Number of modules.
pub const MODULES: usize = 128;

/// Maximum number of output channels.
pub const OUTPUTS: u16 = 256;

/// Maximum number of input channels.
pub const INPUTS: u16 = 512;

/// Clock in Hz if the block does not give one.
pub const HZ: u64 = 1_000_000;

/// The code of the diagnostic for a damaged block.
pub const DAMAGED: &str = "CFG001";

/// The diagnostic codes of this crate.
pub const CONFIG_CODES: &[DiagnosticCode] = &[DiagnosticCode {
    code: DAMAGED,
    title: "the configuration block of an AP101 image is damaged",
    explain: "Bytes 1000h to 12FFh of an image for AP101 contain its configuration: channels, clock, the table of programs, timers and \
              counters. The block is complete or absent, begins with AP and version 1, and its reserved bytes are 0. The message \
              names the wrong byte. docs/chips/ap101.md has the layout. Fix: let the assembler write the block (`channels`, \
              `program`, `module`), or omit it: then there are 512 inputs, 256 outputs and one program.",
}];

/// When inputs are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InputSampling {
    /// All together at the start of a program cycle.
    #[default]
    Scan,
    /// Each input when an instruction reads it.
    Live,
}

/// A program of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ProgramEntry {
    /// Position in the table.
    pub entry: u8,
    /// First word.
    pub start: u16,
    /// Last word.
    pub last: u16,
    /// Value of the index register while the program runs.
    pub rx: u16,
}

/// The configuration of a machine, as given by the block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ap101Config {
    /// When inputs are sampled.
    pub inputs: InputSampling,
    /// Whether bits of M select the programs that run; otherwise all run in turn.
    pub reconfigurable: bool,
    /// Number of output channels.
    pub output_channels: u16,
    /// Number of input channels.
    pub input_channels: u16,
    /// Clock in Hz.
    pub hz: u64,
    /// Minimum number of machine cycles from the start of one program cycle to the start of the next; 0 means
    /// free running.
    pub period: u64,
    /// The programs that are present, in table order; empty if the table has none.
    pub programs: Vec<ProgramEntry>,
    /// Initial values, at a cold start, of the bits that enable programs in reconfigurable mode, also for
    /// entries that are not present.
    pub enabled: [bool; PROGRAMS],
    /// The modules.
    pub modules: [ModuleSettings; MODULES],
}

impl Default for Ap101Config {
    /// All channels, a clock of 1 MHz, free running, no modules.
    fn default() -> Ap101Config {
        Ap101Config {
            inputs: InputSampling::Scan,
            reconfigurable: false,
            output_channels: OUTPUTS,
            input_channels: INPUTS,
            hz: HZ,
            period: 0,
            programs: Vec::new(),
            enabled: [false; PROGRAMS],
            modules: [ModuleSettings::NONE; MODULES],
        }
    }
}

/// A fault of a block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConfigDamage {
    /// Byte address in the image file.
    pub addr: u32,
    /// What is wrong: one sentence.
    pub cause: String,
    /// What to do about it.
    pub hint: &'static str,
}

/// Reads a block, notes its faults, and continues after each.
struct ConfigReader<'a> {
    bytes: &'a [u8],
    damages: Vec<ConfigDamage>,
}

impl ConfigReader<'_> {
    fn byte(&self, at: usize) -> u8 {
        self.bytes.get(at).copied().unwrap_or(0)
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.byte(at), self.byte(at + 1)])
    }

    fn long(&self, at: usize) -> u32 {
        u32::from(self.word(at)) | u32::from(self.word(at + 2)) << 16
    }

    fn report_damage(&mut self, at: usize, cause: String, hint: &'static str) {
        self.damages.push(ConfigDamage { addr: CONFIG_ADDRESS + at as u32, cause, hint });
    }

    /// Checks that a number is at most `most`.
    fn at_most(&mut self, at: usize, value: u16, most: u16, what: &str, hint: &'static str) -> u16 {
        if value > most {
            self.report_damage(at, format!("{what} is {value}, and the most is {most}"), hint);
        }
        value.min(most)
    }

    fn program(&mut self, entry: usize, enabled: &mut bool) -> Option<ProgramEntry> {
        let at = 0x20 + 8 * entry;
        let most = SPAN as u16 - 1;
        let damages_before = self.damages.len();
        let (what, hint) = (format!("program {entry}"), "words of program memory are 0 to 2047");
        let start = self.at_most(at, self.word(at), most, &format!("the first word of {what}"), hint);
        let last = self.at_most(at + 2, self.word(at + 2), most, &format!("the last word of {what}"), hint);
        let rx = self.at_most(at + 4, self.word(at + 4), most, &format!("RX of {what}"), "RX has eleven bits");
        let flags =
            self.at_most(at + 6, self.word(at + 6), 3, &format!("the flags of {what}"), "bit 0 present, bit 1 enabled");
        if self.word(at) > self.word(at + 2) && start < most {
            let cause = format!("{what} begins at {start}, after its last word {last}");
            self.report_damage(at + 2, cause, "the first word of a program must not be after its last one");
        }
        if flags & 1 == 0 && self.damages.len() == damages_before {
            for field in (at..at + 6).step_by(2).filter(|&field| self.word(field) != 0).collect::<Vec<_>>() {
                let cause = format!("{what} is not present, and a field of it is {}", self.word(field));
                self.report_damage(field, cause, "all fields of an absent program but its flags are 0");
            }
        }
        *enabled = flags & 2 != 0;
        (flags & 1 != 0).then_some(ProgramEntry { entry: entry as u8, start, last, rx })
    }

    fn module(&mut self, n: usize) -> ModuleSettings {
        let at = 0x100 + 4 * n;
        let kind = ModuleKind::ALL.get(usize::from(self.byte(at))).copied();
        if kind.is_none() {
            let cause = format!("module {n} has type {}", self.byte(at));
            self.report_damage(at, cause, "types are 0 none, 1 TON, 2 TOF, 3 RTO, 4 TP, 5 CTU, 6 CTD, 7 CTC");
        }
        let unit = ModuleTimeUnit::ALL.get(usize::from(self.byte(at + 1))).copied();
        if unit.is_none() {
            let cause = format!("module {n} has unit {}", self.byte(at + 1));
            self.report_damage(at + 1, cause, "units are 0 program cycle, 1 1 ms, 2 10 ms, 3 100 ms");
        }
        if kind == Some(ModuleKind::None) && self.word(at + 2) != 0 {
            let cause = format!("module {n} does not exist, but its preset is {}", self.word(at + 2));
            self.report_damage(at + 2, cause, "a module of type 0 has unit 0 and preset 0");
        }
        let timer = matches!(kind, None | Some(ModuleKind::Ton | ModuleKind::Tof | ModuleKind::Rto | ModuleKind::Tp));
        if let Some(unit) = unit.filter(|&unit| unit != ModuleTimeUnit::Cycle && !timer) {
            let cause = format!("module {n} is not a timer, and its unit is {}", unit as u8);
            self.report_damage(at + 1, cause, "only timers have a unit of time");
        }
        ModuleSettings {
            kind: kind.unwrap_or(ModuleKind::None),
            unit: unit.unwrap_or(ModuleTimeUnit::Cycle),
            preset: self.word(at + 2),
        }
    }
}

impl Ap101Config {
    /// Reads the block in `image`. Without a block, the result is the configuration of a machine without one.
    ///
    /// # Errors
    /// All faults of the block, in order of address.
    pub fn read_config(image: &Image) -> Result<Ap101Config, Vec<ConfigDamage>> {
        let found: Vec<_> = image.bytes_in("config").collect();
        if found.is_empty() {
            return Ok(Ap101Config::default());
        }
        let mut bytes = vec![0; CONFIG_BYTES as usize];
        image.fill("config", &mut bytes);
        let mut reader = ConfigReader { bytes: &bytes, damages: Vec::new() };
        let gap = (0..CONFIG_BYTES).zip(&found).find(|(wanted, found)| *wanted != found.addr).map(|(wanted, _)| wanted);
        if let Some(gap) = gap.or((found.len() < CONFIG_BYTES as usize).then_some(found.len() as u32)) {
            reader.report_damage(
                gap as usize,
                "the block is not whole".to_owned(),
                "give all bytes from 1000h to 12FFh, or none",
            );
            return Err(reader.damages);
        }
        let config = Ap101Config::read(&mut reader);
        reader.damages.sort_by_key(|damage| damage.addr);
        if reader.damages.is_empty() { Ok(config) } else { Err(reader.damages) }
    }

    /// Writes the configuration as a block of [`CONFIG_BYTES`] bytes. Programs are written at their positions
    /// in the table.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let (outputs, inputs) = (self.output_channels.to_le_bytes(), self.input_channels.to_le_bytes());
        let mut block = b"AP\x01".to_vec();
        block.extend([u8::from(self.inputs == InputSampling::Live), u8::from(self.reconfigurable), 0]);
        block.extend([outputs, inputs, [0; 2]].concat());
        let long = |number: u64| u32::try_from(number).unwrap_or(u32::MAX).to_le_bytes();
        block.extend([long(self.hz), long(self.period)].concat());
        block.resize(0x20, 0);
        for (entry, &enabled) in (0..).zip(&self.enabled) {
            let program = self.programs.iter().find(|program| program.entry == entry);
            let fields = program.map_or([0; 3], |program| [program.start, program.last, program.rx]);
            let flags = u16::from(program.is_some()) | u16::from(enabled) << 1;
            block.extend(fields.into_iter().chain([flags]).flat_map(u16::to_le_bytes));
        }
        block.resize(0x100, 0);
        for ModuleSettings { kind, unit, preset } in self.modules {
            block.extend([kind as u8, unit as u8]);
            block.extend(preset.to_le_bytes());
        }
        block
    }

    fn read(reader: &mut ConfigReader<'_>) -> Ap101Config {
        for (at, letter) in b"AP".iter().enumerate() {
            if reader.byte(at) != *letter {
                let cause = format!("the block does not begin with AP: {:02X} for {letter:02X}", reader.byte(at));
                reader.report_damage(at, cause, "is the image for an AP101?");
            }
        }
        if reader.byte(2) != 1 {
            let cause = format!("the block is of version {}", reader.byte(2));
            reader.report_damage(2, cause, "only version 1 is known");
        }
        for at in [5, 0xA, 0xB].into_iter().chain(0x14..0x20).chain(0x60..0x100) {
            if reader.byte(at) != 0 {
                let cause = format!("a reserved byte is {:02X}", reader.byte(at));
                reader.report_damage(at, cause, "reserved bytes are 0");
            }
        }
        let live = reader.at_most(3, reader.byte(3).into(), 1, "inputs", "inputs are 0 for scan, 1 for live");
        let mode = reader.at_most(4, reader.byte(4).into(), 1, "mode", "mode is 0 for fixed, 1 for reconfigurable");
        let hint = "there are at most 256 outputs and 512 inputs";
        let output_channels = reader.at_most(6, reader.word(6), OUTPUTS, "the number of output channels", hint);
        let input_channels = reader.at_most(8, reader.word(8), INPUTS, "the number of input channels", hint);
        let mut enabled = [false; PROGRAMS];
        let entries = enabled.iter_mut().enumerate();
        let programs = entries.filter_map(|(entry, enabled)| reader.program(entry, enabled)).collect();
        let mut modules = [ModuleSettings::NONE; MODULES];
        for (n, settings) in modules.iter_mut().enumerate() {
            *settings = reader.module(n);
        }
        Ap101Config {
            inputs: if live == 1 { InputSampling::Live } else { InputSampling::Scan },
            reconfigurable: mode == 1,
            output_channels,
            input_channels,
            hz: match reader.long(0xC) {
                0 => HZ,
                hz => hz.into(),
            },
            period: reader.long(0x10).into(),
            programs,
            enabled,
            modules,
        }
    }
}
