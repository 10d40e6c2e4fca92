//! Helpers shared by the tests.

// Each test uses a part of it.
#![allow(dead_code)]

use emu_core::chip::Chip;

/// Returns the chip with this name, of any family.
pub fn chip(name: &str) -> Option<&'static Chip> {
    chips().find(|chip| chip.name == name)
}

/// Returns all chips.
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    let avr = emu_avr::chips::AVR_CHIPS.iter().copied();
    avr.chain(emu_8051::chips::chips()).chain(emu_pic16::chips::chips()).chain(emu_ap101::chips::chips())
}
