//! What a program says to simavr, in the section `.mmcu` of its ELF file: for which chip and clock it is, and what it wants traced.
//! The layout is that of simavr's `avr_mcu_section.h`: entries of a tag, a length and so many bytes, with zeros between them.

use super::elf::aligned;
use super::note::section;

/// Name of the section; it is no part of the program.
pub(super) const SECTION: &str = ".mmcu";

/// Longest name that is taken, and most traces: what has more is damaged.
const MAX_ENTRIES: usize = 64;

/// Bytes of the name in the entry of a trace.
const TRACE_NAME_BYTES: usize = 32;

/// The entries that mean something here.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct SimavrSection {
    /// The chip, in small letters, as `atmega328p`.
    pub mcu: Option<String>,
    /// Its clock in Hz.
    pub hz: Option<u32>,
    /// File for the waveform.
    pub vcd: Option<String>,
    /// What is to be in it.
    pub traces: Vec<SimavrTrace>,
    /// Data address of the register whose bytes simavr prints.
    pub console: Option<u16>,
    /// Data address of the register that takes commands to simavr.
    pub command: Option<u16>,
    /// Tag of an entry that is longer than what is left of the section: neither it nor what follows is read.
    pub truncated_bytes: Option<u8>,
}

/// A signal that a program wants traced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SimavrTrace {
    /// The register at this data address, or its bits in the mask, where that is not 0.
    Register(u16, u8),
    /// A pin: letter of its port and number.
    Pin(char, u8),
    /// So many bytes from this data address on, 1 or 2.
    Ram(u16, u8),
    /// An interrupt.
    Interrupt,
}

/// What an ELF file says to simavr; nothing where it has no such section.
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
    /// An entry; tags by avr_mcu_section.h, whose others are passed over. From simavr 1.7 on 17 and 18 trace RAM in an entry as long
    /// as the other traces; in 1.6 the tag 17 is that of a pull-up, with 4 bytes.
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

/// The text up to the first zero, if it can be shown.
fn entry_text(entry: &[u8]) -> Option<String> {
    let text = entry.split(|byte| *byte == 0).next().filter(|text| !text.is_empty() && text.len() <= MAX_ENTRIES)?;
    let fine = text.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    fine.then(|| String::from_utf8_lossy(text).into_owned())
}
