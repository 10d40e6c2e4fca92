//! Reads for which AVR an ELF file was linked: from the note of avr-gcc's start-up files (since version 5),
//! and from the signature section of a program. Both are read separately from loading, so that they are also
//! available for a file that was rejected.
//!
//! ```text
//!   .note.gnu.avr.deviceinfo   words of 32 bits (binutils, elf32-avr.c)
//!     name's size 4, description's size, type 1, "AVR\0"
//!     flash start, size, RAM start, size, EEPROM start, size
//!     size of the table of offsets with this word, offset of the chip's name after the table, ..
//!     strings
//! ```

use object::LittleEndian as Le;
use object::elf::FileHeader32;
use object::read::elf::{FileHeader, SectionHeader};

use super::elf::aligned;

/// Bytes before the description: three words and "AVR\0".
const HEAD: usize = 16;
/// Offset of the table of offsets in the description, after six words.
const TABLE: usize = 24;
/// Maximum length of a chip name; a longer one is not a chip name.
const MOST_NAME: usize = 32;

/// Name of the chip for which an ELF file was linked, as compilers write it (`atmega328p`). `None` if the
/// file has no note or a damaged one. The name has at most 32 letters and digits.
#[must_use]
pub fn avr_device(file: &[u8]) -> Option<String> {
    let bytes = aligned(file);
    let note = section(&bytes, b".note.gnu.avr.deviceinfo")?;
    let word = |bytes: &[u8], at: usize| -> Option<u32> {
        Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
    };
    if (word(note, 0)?, word(note, 8)?, note.get(12..HEAD)?) != (4, 1, b"AVR\0") {
        return None;
    }
    let size = usize::try_from(word(note, 4)?).ok()?;
    let description = note.get(HEAD..HEAD.checked_add(size)?)?;
    let table = usize::try_from(word(description, TABLE)?).ok()?;
    // A table of one word contains only its size.
    let name = usize::try_from(word(description, TABLE + 4)?).ok().filter(|_| table >= 8)?;
    let strings = description.get(TABLE.checked_add(table)?..)?;
    let name = strings.get(name..)?.split(|&byte| byte == 0).next()?;
    let fine = !name.is_empty() && name.len() <= MOST_NAME && name.iter().all(u8::is_ascii_alphanumeric);
    fine.then(|| String::from_utf8_lossy(name).to_ascii_lowercase())
}

/// The signature bytes in the section `.signature` of a program, in the order of the chip rows and of
/// programmers: 1E 95 0F. The file has them in reverse order (AVR-LibC, avr/signature.h).
#[must_use]
pub fn avr_signature(file: &[u8]) -> Option<[u8; 3]> {
    let bytes = aligned(file);
    match section(&bytes, b".signature")? {
        &[last, middle, first] => Some([first, middle, last]),
        _ => None,
    }
}

/// The bytes of a section, or `None` if there is no such section or it cannot be read.
pub(super) fn section<'b>(bytes: &'b [u8], name: &[u8]) -> Option<&'b [u8]> {
    let header = FileHeader32::<Le>::parse(bytes).ok()?;
    let sections = header.sections(Le, bytes).ok()?;
    let found = sections.iter().find(|section| sections.section_name(Le, section) == Ok(name))?;
    found.data(Le, bytes).ok()
}
