//! Cases worked by hand; writes in cycle `t` act at the edge that ends it.

use emu_avr::chips::ATMEGA328P;
use emu_avr::soc::{Put, Soc};
use emu_avr::{Avr, Options};
use emu_core::image::Image;
use emu_core::{Bus, Level, RamInit, Reset};

const CLKPR: u16 = 0x61;

fn chip(fuses: [u8; 3], start_up: bool) -> Soc {
    let options = Options { hz: 8_000_000, fuses: Some(fuses), lock: None, start_up };
    Avr::with(&ATMEGA328P, &Image::default(), RamInit::Zero, options).soc().clone()
}

/// Rewriting CLKPCE neither prolongs its four cycles nor ends them (9.12.2).
#[test]
fn clkpce_once_more() {
    for (at, clkpr) in [(13, 2), (14, 2), (15, 0), (16, 0)] {
        let mut soc = chip([0xFF, 0xD9, 0xFF], false);
        soc.write(CLKPR, 0x80, 10);
        soc.write(CLKPR, 0x80, 12);
        soc.write(CLKPR, 0x02, at);
        assert_eq!(soc.peek(CLKPR, 20), clkpr, "CLKPS written in cycle {at}");
    }
    let mut soc = chip([0xFF, 0xD9, 0xFF], false);
    soc.write(CLKPR, 0x80, 10);
    soc.write(CLKPR, 0x80, 12);
    assert_eq!([11, 13, 14, 15, 16].map(|t| soc.peek(CLKPR, t)), [0x80, 0x80, 0x80, 0, 0]);
}

/// Start-up of 6 + 14 clocks is counted from the end of a reset (11.2), not from what the supply does later.
#[test]
fn a_supply_that_moves_does_not_prolong_start_up() {
    let mut soc = chip([0xC0, 0xD9, 0xFD], true);
    soc.put(10, 10, Put::Supply(4_800));
    soc.fire(19);
    assert!(soc.stands());
    soc.fire(20);
    assert!(!soc.stands());
    // PC6 low from 30 to 40.
    soc.drive(30, 25, 14, Level::Low);
    soc.fire(30);
    assert_eq!(soc.reset_requested(30), Some(Reset::External));
    soc.reset(Reset::External, 30);
    soc.drive(40, 30, 14, Level::High);
    soc.put(45, 40, Put::Supply(4_900));
    soc.fire(59);
    assert!(soc.stands());
    soc.fire(60);
    assert!(!soc.stands());
    assert_eq!(soc.peek(0x54, 60), 0x03, "PORF and EXTRF");
}
