//! Macros and functions that build chip rows from groups.

use emu_core::chip::NamedAddress;

use crate::periph::map::Sfr;

/// Joins several groups into one list.
macro_rules! join {
    ($($group:expr),+ $(,)?) => { &$crate::chips::data::join_groups::<_, { 0 $(+ $group.len())+ }>(&[$($group),+]) };
}
pub(super) use join;

/// Joins groups for [`join`]; `N` is the length of all groups together.
pub(super) const fn join_groups<T: Copy, const N: usize>(groups: &[&[T]]) -> [T; N] {
    let mut all = [groups[0][0]; N];
    let (mut len, mut g) = (0, 0);
    while g < groups.len() {
        let mut i = 0;
        while i < groups[g].len() {
            all[len] = groups[g][i];
            len += 1;
            i += 1;
        }
        g += 1;
    }
    all
}

/// Registers of a chip for the tools: each once, at its lowest address, in order of addresses. `Sfr =>
/// "name"` gives the name in this chip's data sheet.
macro_rules! regs {
    ($sfr:expr $(, $from:ident => $to:literal)* $(,)?) => {
        &$crate::chips::data::named_registers::<{ $crate::chips::data::distinct_count($sfr) }>(
            $sfr, &[$(($crate::periph::map::Sfr::$from, $to)),*])
    };
}
pub(super) use regs;

/// Returns the index of the entry with the lowest address of the register in entry `i`.
const fn is_lowest_address(sfr: &[(u16, Sfr)], i: usize) -> usize {
    let (mut low, mut k) = (i, 0);
    while k < sfr.len() {
        if sfr[k].1 as u8 == sfr[i].1 as u8 && sfr[k].0 < sfr[low].0 {
            low = k;
        }
        k += 1;
    }
    low
}

/// Returns the number of different registers.
pub(super) const fn distinct_count(sfr: &[(u16, Sfr)]) -> usize {
    let (mut n, mut i) = (0, 0);
    while i < sfr.len() {
        if is_lowest_address(sfr, i) == i {
            n += 1;
        }
        i += 1;
    }
    n
}

/// Builds the list for [`regs`]; `N` is [`distinct_count`].
pub(super) const fn named_registers<const N: usize>(
    sfr: &[(u16, Sfr)],
    names: &[(Sfr, &'static str)],
) -> [NamedAddress; N] {
    let mut all = [NamedAddress { name: "", addr: 0 }; N];
    let (mut len, mut i) = (0, 0);
    while i < sfr.len() {
        if is_lowest_address(sfr, i) == i {
            let (addr, reg) = sfr[i];
            let mut name = match reg {
                Sfr::OPTION => "OPTION_REG",
                _ => reg.name(),
            };
            let mut k = 0;
            while k < names.len() {
                if names[k].0 as u8 == reg as u8 {
                    name = names[k].1;
                }
                k += 1;
            }
            let mut at = len;
            while at > 0 && all[at - 1].addr > addr {
                all[at] = all[at - 1];
                at -= 1;
            }
            all[at] = NamedAddress { name, addr };
            len += 1;
        }
        i += 1;
    }
    all
}

/// Chip data of a chip with flash and EEPROM: name, title, data sheet, program words in K, bytes of RAM,
/// bytes of EEPROM, number of pins, and the chip from which all else is copied. In a HEX file a word takes
/// two bytes, and a byte of EEPROM a word (programming specifications, "Program memory map": 2000h user
/// memory, 2100h EEPROM).
macro_rules! chip {
    ($name:literal, $title:literal, $source:literal, $words:literal K, $ram:literal, $eeprom:literal, $pins:literal, $base:expr) => {
        emu_core::chip::Chip {
            name: $name,
            constants: || $crate::chips::names::names_of_chip($name),
            title: concat!(
                $title,
                ": ",
                $words,
                "K words flash, ",
                $ram,
                " bytes RAM, ",
                $eeprom,
                " bytes EEPROM, ",
                $pins,
                " pins"
            ),
            data_sheet: $source,
            flash_bytes: $words * 0x800,
            on_chip_flash_bytes: $words * 0x800,
            ram_len: $ram,
            eeprom_bytes: $eeprom,
            hex_spaces: &[
                emu_core::image::ImageSpace {
                    name: "flash",
                    start: 0,
                    len: $words * 0x800,
                    word: 2,
                    word_bits: emu_core::image::WordBits::Only(14),
                },
                emu_core::image::ImageSpace {
                    name: "config",
                    start: 0x4000,
                    len: 0x20,
                    word: 2,
                    word_bits: emu_core::image::WordBits::Low(14),
                },
                emu_core::image::ImageSpace {
                    name: "eeprom",
                    start: 0x4200,
                    len: $eeprom * 2,
                    word: 2,
                    word_bits: emu_core::image::WordBits::Low(8),
                },
            ],
            spaces: &[
                emu_core::chip::ChipSpace::new("flash", $words * 0x400, 2),
                emu_core::chip::ChipSpace::new("data", 0x200, 1),
                emu_core::chip::ChipSpace::new("eeprom", $eeprom, 1),
                emu_core::chip::ChipSpace::new("config", 0x10, 2),
            ],
            ..$base
        }
    };
}
pub(super) use chip;
