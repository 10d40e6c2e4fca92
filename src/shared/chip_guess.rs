//! Guesses which chip a file was made for, when it does not fit the chip that the user named.
//!
//! A guess is made only on strong evidence: a false alarm costs more than a missing guess.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};
use emu_ap101::config;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{self, ImageSpace, WordBits};
use emu_pic16::chips::{self, Pic16Part};

use crate::shared::chosen_chip::{NamedChip, chip_in_comment};
use crate::shared::codes::OTHER_CHIP;
use crate::shared::family;
use crate::shared::image_origin::{CauseAndHint, base_name, by_signature, other_avr_diagnostic};
use crate::shared::input::ELF_MAGIC;
use diag::distance;

/// Maximum number of chips listed in a message.
const MAX_CHIPS_LISTED: usize = 4;

/// Minimum number of words with 16 significant bits that identify a file as not for a PIC16, when nothing
/// else does.
const MIN_WIDE_WORDS: usize = 4;

/// Byte addresses in a HEX file for a PIC16 that identify the chip (DS39025, "Program memory map").
const PIC_FLASH: std::ops::Range<u32> = 0..0x4000;
const PIC_DEVICE_ID: u32 = 0x400C;
const PIC_CONFIG: u32 = 0x400E;
const PIC_CONFIG_2: u32 = 0x4010;
const PIC_EEPROM: std::ops::Range<u32> = 0x4200..0x4400;
/// Address at which avr-objcopy puts the signature.
const AVR_SIGNATURE: u32 = 0x84_0000;
/// The largest value of a 14-bit word.
const PIC_WORD: u16 = 0x3FFF;
/// The bits of a device ID without its revision.
const PIC_DEVICE: u16 = 0x3FE0;

/// Returns a diagnostic if the file looks like a program for another chip: a note if the file was refused,
/// otherwise a warning.
pub fn guess_chip(file: &str, bytes: &[u8], chip: &Chip, refused: bool) -> Option<Diagnostic> {
    let severity = if refused { Severity::Note } else { Severity::Warning };
    if bytes.starts_with(ELF_MAGIC) {
        return other_avr_diagnostic(file, bytes, chip, severity);
    }
    let other_chip =
        |cause: String, hint: String| Some(Diagnostic::new(severity, OTHER_CHIP, file, Pos::default(), cause, hint));
    if let Some(CauseAndHint { cause, hint }) = chip_in_comment(bytes).and_then(|named| other_name(&named, chip)) {
        return other_chip(cause, hint);
    }
    let contents = HexContents::of(file, bytes)?;
    if let Some(CauseAndHint { cause, hint }) = contents.signature().and_then(|signature| by_signature(signature, chip))
    {
        return other_chip(cause, hint);
    }
    let family = match contents.family(chip) {
        ChipGuess::Family(family) => family,
        ChipGuess::WideWords => {
            let cause = format!("this looks like a program for an AVR or an 8051, not for {}", chip.name);
            return other_chip(cause, "--mcu CHIP; `emu chips` lists all".to_owned());
        }
        ChipGuess::Unknown => return None,
    };
    if family == chip.family && contents.fits(chip) {
        return None;
    }
    let mut fitting: Vec<&Chip> = family::chips().filter(|c| c.family == family && contents.fits(c)).collect();
    if family == chip.family {
        fitting = nearest_first(fitting, chip);
    } else {
        // Among chips of another family, list the largest first: they hold whatever the smaller ones hold.
        fitting.sort_by_key(|c| Reverse(c.flash_bytes));
    }
    let (names, first) = name_chips(fitting)?;
    other_chip(format!("this looks like a program for {names}, not for {}", chip.name), format!("--mcu {first}"))
}

/// Returns cause and hint if a comment names a chip other than `chip`.
fn other_name(named: &NamedChip, chip: &Chip) -> Option<CauseAndHint> {
    let (name, place) = (&named.name, &named.place);
    match named.chip {
        Some(row) if base_name(row.name) == base_name(chip.name) => None,
        Some(row) => Some(CauseAndHint {
            cause: format!("this is a program for {name} ({place}), not for {}", chip.name),
            hint: format!("--mcu {}", row.name),
        }),
        None => Some(CauseAndHint {
            cause: format!("this is a program for {name} ({place}), for which emu has no model, not for {}", chip.name),
            hint: format!("compile it for {}", chip.name),
        }),
    }
}

/// Returns the signature of an AVR in a HEX file, at the address where avr-objcopy puts it, in the byte order
/// of data sheets.
pub fn hex_signature(bytes: &[u8]) -> Option<[u8; 3]> {
    HexContents::of("", bytes)?.signature()
}

/// Sorts chips by the similarity of their names to the name of `chip`, most similar first.
pub fn nearest_first<'a>(mut chips: Vec<&'a Chip>, chip: &Chip) -> Vec<&'a Chip> {
    chips.sort_by_key(|c| distance(c.name, chip.name));
    chips
}

/// Returns the names of chips as text, and the name of the first chip.
pub fn name_chips(chips: Vec<&Chip>) -> Option<(String, &str)> {
    let names: Vec<&str> = chips.into_iter().map(|c| c.name).collect();
    let first = *names.first()?;
    let words = match names.split_last() {
        _ if names.len() > MAX_CHIPS_LISTED => format!("{first} or one of {} others", names.len() - 1),
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => first.to_owned(),
    };
    Some((words, first))
}

/// What a file appears to be.
enum ChipGuess {
    /// A program for this family.
    Family(ChipFamily),
    /// A program for a family with 16-bit words.
    WideWords,
    /// No strong evidence.
    Unknown,
}

/// The bytes of a HEX file by address.
struct HexContents {
    bytes: BTreeMap<u32, u8>,
}

impl HexContents {
    /// Reads a HEX file. Returns `None` if it is malformed.
    fn of(file: &str, bytes: &[u8]) -> Option<HexContents> {
        const WHOLE: ImageSpace =
            ImageSpace { name: "file", start: 0, len: u32::MAX, word: 1, word_bits: WordBits::All };
        let loaded = image::load_hex(file, bytes, &[WHOLE]).ok()?;
        Some(HexContents { bytes: loaded.image.bytes_in(WHOLE.name).map(|one| (one.addr, one.byte)).collect() })
    }

    /// Returns the signature. The HEX file holds its bytes in reverse order.
    fn signature(&self) -> Option<[u8; 3]> {
        let byte = |at: u32| self.byte(AVR_SIGNATURE + at);
        Some([byte(2)?, byte(1)?, byte(0)?])
    }

    fn byte(&self, addr: u32) -> Option<u8> {
        self.bytes.get(&addr).copied()
    }

    fn word(&self, addr: u32) -> Option<u16> {
        Some(u16::from_le_bytes([self.byte(addr)?, self.byte(addr + 1)?]))
    }

    fn has(&self, addr: u32) -> bool {
        self.bytes.contains_key(&addr)
    }

    /// Returns the family that the file is for, as far as its contents show.
    fn family(&self, chip: &Chip) -> ChipGuess {
        match chip.family {
            _ if self.has_ap101_block() => ChipGuess::Family(ChipFamily::Ap101),
            ChipFamily::Pic16 if self.words_of_14_bits() => ChipGuess::Family(ChipFamily::Pic16),
            ChipFamily::Pic16 if !self.many_are_wide() => ChipGuess::Unknown,
            ChipFamily::Pic16 if self.starts_like_avr() => ChipGuess::Family(ChipFamily::Avr),
            ChipFamily::Pic16 if self.starts_like_mcs51() => ChipGuess::Family(ChipFamily::Mcs51),
            ChipFamily::Pic16 if self.count_wide_words() >= MIN_WIDE_WORDS => ChipGuess::WideWords,
            ChipFamily::Pic16 => ChipGuess::Unknown,
            ChipFamily::Ap101 if self.starts_like_mcs51() => ChipGuess::Family(ChipFamily::Mcs51),
            ChipFamily::Ap101 if self.starts_like_avr() => ChipGuess::Family(ChipFamily::Avr),
            ChipFamily::Avr | ChipFamily::Mcs51 | ChipFamily::Ap101 if self.is_pic16() => {
                ChipGuess::Family(ChipFamily::Pic16)
            }
            ChipFamily::Avr | ChipFamily::Mcs51 | ChipFamily::Ap101 => ChipGuess::Unknown,
        }
    }

    /// Returns true if the file has an AP101 configuration block at its address and no bytes beyond the AP101
    /// memory.
    fn has_ap101_block(&self) -> bool {
        let block = config::CONFIG_ADDRESS..config::CONFIG_ADDRESS + config::CONFIG_BYTES;
        let magic = [b'A', b'P', 1];
        (block.start..).zip(magic).all(|(addr, byte)| self.byte(addr) == Some(byte))
            && self.bytes.keys().all(|addr| *addr < block.end)
    }

    /// Returns the complete words in the program memory range of a PIC16.
    fn words(&self) -> impl Iterator<Item = u16> {
        self.bytes.range(PIC_FLASH).filter_map(|(&addr, _)| if addr % 2 == 0 { self.word(addr) } else { None })
    }

    /// Returns true if program memory has words and none of them exceeds 14 bits.
    fn words_of_14_bits(&self) -> bool {
        let mut words = self.words().peekable();
        words.peek().is_some() && words.all(|word| word <= PIC_WORD)
    }

    /// Returns true if more than a quarter of the program words exceed 14 bits. FFFFh is excluded: it is
    /// erased memory or padding.
    fn many_are_wide(&self) -> bool {
        4 * self.count_wide_words() > self.words().filter(|&word| word != u16::MAX).count()
    }

    /// Counts the program words that exceed 14 bits, without FFFFh.
    fn count_wide_words(&self) -> usize {
        self.words().filter(|&word| word > PIC_WORD && word != u16::MAX).count()
    }

    /// Returns true if the file has a PIC16 program and configuration word, and no bytes where a PIC16 has no
    /// memory.
    fn is_pic16(&self) -> bool {
        let config = PIC_FLASH.end..PIC_CONFIG_2 + 2;
        let known = |addr: &u32| PIC_FLASH.contains(addr) || config.contains(addr) || PIC_EEPROM.contains(addr);
        self.word(PIC_CONFIG).is_some_and(|word| word <= PIC_WORD)
            && self.words_of_14_bits()
            && self.bytes.keys().all(known)
    }

    /// Returns true if the first instruction is JMP or RJMP to an address that the file fills ("AVR
    /// Instruction Set Manual", DS40002198).
    fn starts_like_avr(&self) -> bool {
        let Some(word) = self.word(0) else { return false };
        let target = match word {
            0x940C => self.word(2).map(|target| 2 * u32::from(target)),
            0xC000..=0xC7FF => Some(2 * (1 + u32::from(word & 0x7FF))),
            _ => None,
        };
        target.is_some_and(|target| target > 0 && self.has(target))
    }

    /// Returns true if the first instruction is LJMP or AJMP to an address that the file fills (272383,
    /// chapter 2).
    fn starts_like_mcs51(&self) -> bool {
        let (Some(first), Some(second)) = (self.byte(0), self.byte(1)) else { return false };
        let target = match first {
            0x02 => self.byte(2).map(|low| u32::from(second) << 8 | u32::from(low)),
            _ if first & 0x1F == 0x01 => Some(u32::from(first >> 5) << 8 | u32::from(second)),
            _ => None,
        };
        target.is_some_and(|target| target > 0 && self.has(target))
    }

    /// Returns true if the chip has memory for every byte, and neither the device ID nor the configuration
    /// words name another chip.
    fn fits(&self, chip: &Chip) -> bool {
        let spaces = image::hex_spaces(chip.hex_spaces, chip.elf_spaces);
        let beyond = |addr: u32| chip.family == ChipFamily::Avr && addr >= image::AVR_AREAS.end;
        let place = |addr: u32| beyond(addr) || spaces.iter().any(|s| (s.start..s.start + s.len).contains(&addr));
        let part = chips::part(chip.name).filter(|_| chip.family == ChipFamily::Pic16);
        self.bytes.keys().all(|&addr| place(addr)) && part.is_none_or(|part| self.fits_part(part))
    }

    fn fits_part(&self, part: &Pic16Part) -> bool {
        let erased = |word: &u16| *word == PIC_WORD || *word == 0;
        let id = self.word(PIC_DEVICE_ID).filter(|id| !erased(id));
        // An erased second configuration word is no evidence if the file also has the words after it, as in a
        // read-out of a programmer.
        let second = self.word(PIC_CONFIG_2).filter(|word| !erased(word) || *word != 0 && !self.has(PIC_CONFIG_2 + 2));
        // A chip without a device ID never matches one.
        let same = |id: u16| part.device_id.is_some_and(|own| id & PIC_DEVICE == own & PIC_DEVICE);
        id.is_none_or(same) && (second.is_none() || part.config.words.len() > 1)
    }
}
