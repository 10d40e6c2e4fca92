//! Named numbers of the chips, as the headers of avr-libc spell them ([`Chip::constants`](emu_core::chip::Chip::constants)): bits
//! of registers, addresses of register pairs, fuses and lock bits, sizes.
//!
//! Sources: register summaries, "Memory programming" and "Boot loader support" of the data sheets; spellings that no sheet has come
//! from the headers, against which `tests/headers.rs` reads all of it.

use super::{AvrPart, RegisterSlot, part};

/// What a chip's names are made of, besides its registers and sizes.
#[derive(Debug, Clone, Copy)]
pub struct HeaderNames {
    /// Tables of bits. A line is a register and the names of its bits from 7 to 0: `-` is none, `/` stands between several names
    /// of one bit. Registers that the chip does not have are passed over, and so are bits of ports that have no pin.
    pub(super) bit_names: &'static [&'static str],
    /// Fuses from bit 7 to 0, in the same manner: low byte, high, extended.
    pub(super) fuse_names: [&'static str; 3],
    /// The fuse bytes of a chip as it is delivered.
    pub(super) factory_fuses: [u8; 3],
    /// How many of [`SLEEP_MODES`] there are.
    pub(super) sleep_modes: usize,
    /// Bytes in a page of EEPROM.
    pub(super) eeprom_page: i32,
    /// Last data address, with memory outside where it can be had; 0 is the end of RAM.
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

/// Lock bytes for everybody, and for chips with a boot section.
const LOCK_BITS: &[(&str, i32)] =
    &[("LB_MODE_1", 0xFF), ("LB_MODE_2", 0xFE), ("LB_MODE_3", 0xFC), ("LOCKBITS_DEFAULT", 0xFF)];
#[rustfmt::skip]
const BOOT_LOCK_BITS: &[(&str, i32)] = &[
    ("BLB0_MODE_1", 0xFF), ("BLB0_MODE_2", 0xFB), ("BLB0_MODE_3", 0xF3), ("BLB0_MODE_4", 0xF7),
    ("BLB1_MODE_1", 0xFF), ("BLB1_MODE_2", 0xEF), ("BLB1_MODE_3", 0xCF), ("BLB1_MODE_4", 0xDF),
];

/// Named numbers of the chip `name`; none for a chip that is not of this crate.
pub(super) fn names_of_chip(name: &str) -> Vec<(&'static str, i32)> {
    let Some(part) = part(name) else { return Vec::new() };
    let mut all = bits(part);
    all.extend(pairs(part));
    all.extend(sleep(part, &all));
    all.extend(fuses(part));
    all.extend(sizes(part));
    all
}

/// The words of a line behind its first, as bits from 7 to 0, with all names of each.
fn bit_cells(words: impl Iterator<Item = &'static str>) -> impl Iterator<Item = (i32, &'static str)> {
    let bits = (0..8).rev().zip(words);
    bits.flat_map(|(bit, names)| names.split('/').map(move |name| (bit, name))).filter(|(_, name)| *name != "-")
}

/// Bits by number.
fn bits(part: &AvrPart) -> Vec<(&'static str, i32)> {
    let mut all = Vec::new();
    for line in part.names.bit_names.iter().flat_map(|table| table.lines()) {
        let mut words = line.split_whitespace();
        let Some(addr) = words.next().and_then(|register| part.chip.reg(register)) else { continue };
        let there = match part.register_slot(addr) {
            RegisterSlot::Port(port, _) => part.ports.get(usize::from(port)).copied().unwrap_or(0),
            _ => 0xFF,
        };
        all.extend(bit_cells(words).filter(|(bit, _)| there >> bit & 1 == 1).map(|(bit, name)| (name, bit)));
    }
    all
}

/// Pairs of registers by the address of the lower one: OCR1A stands for OCR1AL and OCR1AH. That of the converter goes by ADCW,
/// since ADC is an instruction.
fn pairs(part: &'static AvrPart) -> impl Iterator<Item = (&'static str, i32)> {
    part.chip.regs.iter().filter_map(|low| {
        let name = low.name.strip_suffix('L')?;
        let high = part.chip.regs.iter().find(|high| high.name.strip_suffix('H') == Some(name))?;
        let name = if name == "ADC" { "ADCW" } else { name };
        (high.addr == low.addr + 1).then_some((name, i32::from(low.addr)))
    })
}

/// Sleep modes as they stand in their register.
fn sleep(part: &AvrPart, bits: &[(&'static str, i32)]) -> Vec<(&'static str, i32)> {
    let modes = SLEEP_MODES.iter().take(part.names.sleep_modes);
    let place = |name: &str| bits.iter().find(|bit| bit.0 == name).map_or(0, |bit| bit.1);
    let places = ["SM0", "SM1", "SM2"].map(place);
    modes
        .map(|&(name, mode)| (name, (0..3).zip(places).map(|(n, place)| i32::from(mode >> n & 1) << place).sum()))
        .collect()
}

/// Fuses as bytes in which only they are programmed, bytes as delivered, and lock bytes.
fn fuses(part: &'static AvrPart) -> impl Iterator<Item = (&'static str, i32)> {
    let fuses = part.names.fuse_names.iter().flat_map(|byte| bit_cells(byte.split_whitespace()));
    let fuses = fuses.map(|(bit, name)| (name, 0xFF & !(1 << bit)));
    let bytes =
        ["LFUSE_DEFAULT", "HFUSE_DEFAULT", "EFUSE_DEFAULT"].into_iter().zip(part.names.factory_fuses.map(i32::from));
    let boot = if part.fuses.bootsz.is_some() { BOOT_LOCK_BITS } else { &[] };
    fuses.chain(bytes.take(fuse_bytes(part))).chain(LOCK_BITS.iter().chain(boot).copied())
}

fn fuse_bytes(part: &AvrPart) -> usize {
    part.chip.spaces.iter().find(|space| space.0 == "fuse").map_or(0, |space| space.1 as usize)
}

/// Sizes and limits of memories, and the signature.
fn sizes(part: &AvrPart) -> [(&'static str, i32); 17] {
    let chip = part.chip;
    let (start, ram) = (i32::from(chip.ram_start), i32::from(chip.ram_len));
    let end = start + ram - 1;
    let [a, b, c] = part.signature.map(i32::from);
    [
        ("RAMSTART", start),
        ("RAMSIZE", ram),
        ("RAMEND", end),
        ("XRAMEND", end.max(part.names.last_outside)),
        ("FLASHSTART", 0),
        ("FLASHEND", chip.flash_bytes as i32 - 1),
        ("SPM_PAGESIZE", part.spm_kind.page as i32),
        ("E2START", 0),
        ("E2SIZE", i32::from(chip.eeprom_bytes)),
        ("E2END", i32::from(chip.eeprom_bytes) - 1),
        ("E2PAGESIZE", part.names.eeprom_page),
        ("FUSE_MEMORY_SIZE", fuse_bytes(part) as i32),
        ("_VECTOR_SIZE", chip.words_per_vector as i32 * 2),
        ("_VECTORS_SIZE", chip.vectors.len() as i32 * chip.words_per_vector as i32 * 2),
        ("SIGNATURE_0", a),
        ("SIGNATURE_1", b),
        ("SIGNATURE_2", c),
    ]
}
