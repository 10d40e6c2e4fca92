//! Named constants of each chip in the spelling of the headers of avr-libc
//! ([`Chip::constants`](emu_core::chip::Chip::constants)): register bits, addresses of register pairs, fuses
//! and lock bits, sizes.
//!
//! Sources: register summaries, "Memory programming" and "Boot loader support" of the data sheets. Spellings
//! that no data sheet has are from the headers; `tests/headers.rs` compares all constants with them.

use super::{AvrPart, RegisterSlot, part};
use emu_core::NamedConstant;

/// Data from which a chip's constants are made, in addition to its registers and sizes.
#[derive(Debug, Clone, Copy)]
pub struct HeaderNames {
    /// Tables of bits. A line is a register and the names of its bits from 7 to 0: `-` means no name, `/`
    /// separates several names of one bit. Registers that the chip does not have are skipped, and so are port
    /// bits without a pin.
    pub(super) bit_names: &'static [&'static str],
    /// Names of the fuses from bit 7 to 0, in the same format: low, high, extended byte.
    pub(super) fuse_names: [&'static str; 3],
    /// Factory values of the fuse bytes.
    pub(super) factory_fuses: [u8; 3],
    /// Number of entries of [`SLEEP_MODES`] that the chip has.
    pub(super) sleep_modes: usize,
    /// Size of an EEPROM page in bytes.
    pub(super) eeprom_page: i32,
    /// Last data address with external memory, on chips that can have it; 0 means the end of RAM.
    pub(super) last_outside: i32,
}

/// Sleep modes and their numbers in SM2 to SM0.
const SLEEP_MODES: &[(&str, u8)] = &[
    ("SLEEP_MODE_IDLE", 0),
    ("SLEEP_MODE_ADC", 1),
    ("SLEEP_MODE_PWR_DOWN", 2),
    ("SLEEP_MODE_PWR_SAVE", 3),
    ("SLEEP_MODE_STANDBY", 6),
    ("SLEEP_MODE_EXT_STANDBY", 7),
];

/// Lock bytes of all chips.
const LOCK_BITS: &[NamedConstant] = &[
    constant("LB_MODE_1", 0xFF),
    constant("LB_MODE_2", 0xFE),
    constant("LB_MODE_3", 0xFC),
    constant("LOCKBITS_DEFAULT", 0xFF),
];
#[rustfmt::skip]
const BOOT_LOCK_BITS: &[NamedConstant] = &[
    constant("BLB0_MODE_1", 0xFF), constant("BLB0_MODE_2", 0xFB), constant("BLB0_MODE_3", 0xF3), constant("BLB0_MODE_4", 0xF7),
    constant("BLB1_MODE_1", 0xFF), constant("BLB1_MODE_2", 0xEF), constant("BLB1_MODE_3", 0xCF), constant("BLB1_MODE_4", 0xDF),
];

/// Returns the named constants of the chip `name`; empty for a chip of another crate.
pub(super) fn names_of_chip(name: &str) -> Vec<NamedConstant> {
    let Some(part) = part(name) else { return Vec::new() };
    let mut all = bits(part);
    all.extend(pairs(part));
    all.extend(sleep(part, &all));
    all.extend(fuses(part));
    all.extend(sizes(part));
    all
}

/// A name of a bit of a fuse or lock byte.
#[derive(Debug, Clone, Copy)]
struct NamedBitNumber {
    /// The number of the bit, 0 to 7.
    bit: i32,
    /// The name.
    name: &'static str,
}

/// Makes a constant of a header.
const fn constant(name: &'static str, value: i32) -> NamedConstant {
    NamedConstant { name, value }
}

/// Assigns `words` to the bits from 7 to 0; yields each bit number with each of its names.
fn bit_cells(words: impl Iterator<Item = &'static str>) -> impl Iterator<Item = NamedBitNumber> {
    let bits = (0..8).rev().zip(words);
    bits.flat_map(|(bit, names)| names.split('/').map(move |name| NamedBitNumber { bit, name }))
        .filter(|named| named.name != "-")
}

/// Bit names with their bit numbers.
fn bits(part: &AvrPart) -> Vec<NamedConstant> {
    named_bits(part).into_iter().map(|named| NamedConstant { name: named.name, value: named.bit }).collect()
}

/// A named bit of a register.
pub(super) struct NamedBit {
    /// Data address of the register.
    pub addr: u16,
    /// Bit number, 0 to 7.
    pub bit: i32,
    /// Name in the data sheet.
    pub name: &'static str,
}

/// The named bits of the registers.
pub(super) fn named_bits(part: &AvrPart) -> Vec<NamedBit> {
    let mut all = Vec::new();
    for line in part.names.bit_names.iter().flat_map(|table| table.lines()) {
        let mut words = line.split_whitespace();
        let Some(addr) = words.next().and_then(|register| part.chip.reg(register)) else { continue };
        let there = match part.register_slot(addr) {
            RegisterSlot::Port(port, _) => part.ports.get(usize::from(port)).copied().unwrap_or(0),
            _ => 0xFF,
        };
        let there = bit_cells(words).filter(|NamedBitNumber { bit, .. }| there >> bit & 1 == 1);
        all.extend(there.map(|NamedBitNumber { bit, name }| NamedBit { addr, bit, name }));
    }
    all
}

/// Register pairs by the address of the lower register: OCR1A for OCR1AL and OCR1AH. The pair of the
/// converter is named ADCW, because ADC is an instruction.
fn pairs(part: &'static AvrPart) -> impl Iterator<Item = NamedConstant> {
    part.chip.regs.iter().filter_map(|low| {
        let name = low.name.strip_suffix('L')?;
        let high = part.chip.regs.iter().find(|high| high.name.strip_suffix('H') == Some(name))?;
        let name = if name == "ADC" { "ADCW" } else { name };
        (high.addr == low.addr + 1).then_some(NamedConstant { name, value: i32::from(low.addr) })
    })
}

/// Sleep modes as values of the register that selects them.
fn sleep(part: &AvrPart, bits: &[NamedConstant]) -> Vec<NamedConstant> {
    let modes = SLEEP_MODES.iter().take(part.names.sleep_modes);
    let place = |name: &str| bits.iter().find(|bit| bit.name == name).map_or(0, |bit| bit.value);
    let places = ["SM0", "SM1", "SM2"].map(place);
    let value = |mode: u8| (0..3).zip(places).map(|(n, place)| i32::from(mode >> n & 1) << place).sum();
    modes.map(|&(name, mode)| constant(name, value(mode))).collect()
}

/// Fuses as bytes in which only that fuse is programmed, the factory fuse bytes, and lock bytes.
fn fuses(part: &'static AvrPart) -> impl Iterator<Item = NamedConstant> {
    let fuses = part.names.fuse_names.iter().flat_map(|byte| bit_cells(byte.split_whitespace()));
    let fuses = fuses.map(|NamedBitNumber { bit, name }| NamedConstant { name, value: 0xFF & !(1 << bit) });
    let bytes =
        ["LFUSE_DEFAULT", "HFUSE_DEFAULT", "EFUSE_DEFAULT"].into_iter().zip(part.names.factory_fuses.map(i32::from));
    let bytes = bytes.map(|(name, value)| constant(name, value));
    let boot = if part.fuses.bootsz.is_some() { BOOT_LOCK_BITS } else { &[] };
    fuses.chain(bytes.take(fuse_bytes(part))).chain(LOCK_BITS.iter().chain(boot).copied())
}

/// Number of fuse bytes of the chip.
fn fuse_bytes(part: &AvrPart) -> usize {
    part.chip.space("fuse").map_or(0, |space| space.size as usize)
}

/// Sizes and limits of memories, and the signature.
fn sizes(part: &AvrPart) -> [NamedConstant; 17] {
    let chip = part.chip;
    let (start, ram) = (i32::from(chip.ram_start), i32::from(chip.ram_len));
    let end = start + ram - 1;
    let [a, b, c] = part.signature.map(i32::from);
    [
        NamedConstant { name: "RAMSTART", value: start },
        NamedConstant { name: "RAMSIZE", value: ram },
        NamedConstant { name: "RAMEND", value: end },
        NamedConstant { name: "XRAMEND", value: end.max(part.names.last_outside) },
        NamedConstant { name: "FLASHSTART", value: 0 },
        NamedConstant { name: "FLASHEND", value: chip.flash_bytes as i32 - 1 },
        NamedConstant { name: "SPM_PAGESIZE", value: part.spm_kind.page as i32 },
        NamedConstant { name: "E2START", value: 0 },
        NamedConstant { name: "E2SIZE", value: i32::from(chip.eeprom_bytes) },
        NamedConstant { name: "E2END", value: i32::from(chip.eeprom_bytes) - 1 },
        NamedConstant { name: "E2PAGESIZE", value: part.names.eeprom_page },
        NamedConstant { name: "FUSE_MEMORY_SIZE", value: fuse_bytes(part) as i32 },
        NamedConstant { name: "_VECTOR_SIZE", value: chip.words_per_vector as i32 * 2 },
        NamedConstant { name: "_VECTORS_SIZE", value: chip.vectors.len() as i32 * chip.words_per_vector as i32 * 2 },
        NamedConstant { name: "SIGNATURE_0", value: a },
        NamedConstant { name: "SIGNATURE_1", value: b },
        NamedConstant { name: "SIGNATURE_2", value: c },
    ]
}
