//! Reads the section `.mmcu` of an ELF file, in which a program describes for simavr its chip, its clock and
//! the signals to trace. The layout is that of simavr's `avr_mcu_section.h`: entries with a tag, a length and
//! that many bytes, with zeros between them.

use super::elf::aligned;
use super::note::section;

/// Name of the section; it is not part of the program.
pub(super) const SECTION: &str = ".mmcu";

/// Maximum length of a name, and maximum number of traces; a section with more is damaged.
const MAX_ENTRIES: usize = 64;

/// Bytes of the name in a trace entry.
const TRACE_NAME_BYTES: usize = 32;

/// The entries of the section that are used.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SimavrSection {
    /// The chip in lower case, such as `atmega328p`.
    pub mcu: Option<String>,
    /// The clock in Hz.
    pub hz: Option<u32>,
    /// File for the waveform.
    pub vcd: Option<String>,
    /// Signals of the waveform.
    pub traces: Vec<SimavrTrace>,
    /// Data address of the register whose bytes simavr prints.
    pub console: Option<u16>,
    /// Data address of the register that takes commands for simavr.
    pub command: Option<u16>,
    /// Tag of an entry that is longer than the rest of the section. Neither it nor what follows is read.
    pub truncated_bytes: Option<u8>,
}

/// A signal that a program wants to have traced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SimavrTrace {
    /// The register at this data address, or only its bits in the mask if the mask is not 0.
    Register(u16, u8),
    /// A pin: the letter of its port, and its number.
    Pin(char, u8),
    /// A variable at this data address with this number of bytes, 1 or 2.
    Ram(u16, u8),
    /// An interrupt.
    Interrupt,
}

/// Reads the section of an ELF file, or returns `None` if the file has none.
#[must_use]
pub fn read_simavr_section(file: &[u8]) -> Option<SimavrSection> {
    if !file.starts_with(super::elf::MAGIC) {
        return None;
    }
    let bytes = aligned(file);
    let mut rest = section(&bytes, SECTION.as_bytes())?;
    let mut found = SimavrSection::default();
    loop {
        match rest {
            [] => return Some(found),
            [0, behind @ ..] => rest = behind,
            [tag, behind @ ..] => {
                let cut = || SimavrSection { truncated_bytes: Some(*tag), ..found.clone() };
                let Some((len, behind)) = behind.split_first() else { return Some(cut()) };
                let Some((entry, behind)) = behind.split_at_checked(usize::from(*len)) else { return Some(cut()) };
                found.apply_entry(*tag, entry);
                rest = behind;
            }
        }
    }
}

impl SimavrSection {
    /// Applies an entry. Tags are those of avr_mcu_section.h; others are ignored. From simavr 1.7 on, tags 17
    /// and 18 trace RAM in an entry as long as other traces. In 1.6 tag 17 is a pull-up, with 4 bytes.
    fn apply_entry(&mut self, tag: u8, entry: &[u8]) {
        match (tag, entry) {
            (1, _) => self.mcu = entry_text(entry).map(|name| name.to_ascii_lowercase()),
            (2, &[a, b, c, d]) => self.hz = Some(u32::from_le_bytes([a, b, c, d])).filter(|hz| *hz > 0),
            (10, &[low, high]) => self.command = Some(u16::from_le_bytes([low, high])),
            (11, &[low, high]) => self.console = Some(u16::from_le_bytes([low, high])),
            (12, _) => self.vcd = entry_text(entry),
            (14..=18, &[mask, low, high, ref name @ ..]) if self.traces.len() < MAX_ENTRIES => {
                let addr = u16::from_le_bytes([low, high]);
                self.traces.extend(match tag {
                    14 => Some(SimavrTrace::Register(addr, mask)),
                    15 => Some(SimavrTrace::Pin(char::from(mask).to_ascii_uppercase(), low)),
                    16 => Some(SimavrTrace::Interrupt),
                    _ => (name.len() == TRACE_NAME_BYTES).then(|| SimavrTrace::Ram(addr, tag - 16)),
                });
            }
            _ => {}
        }
    }
}

/// The text up to the first zero, if it is printable and not too long.
fn entry_text(entry: &[u8]) -> Option<String> {
    let text = entry.split(|byte| *byte == 0).next().filter(|text| !text.is_empty() && text.len() <= MAX_ENTRIES)?;
    let fine = text.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    fine.then(|| String::from_utf8_lossy(text).into_owned())
}
