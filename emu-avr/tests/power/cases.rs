//! Hand-made cases; a write in cycle `t` takes effect at the edge that ends it.

use emu_avr::chips::ATMEGA328P;
use emu_avr::soc::AvrSoc;
use emu_avr::{Avr, Options};
use emu_core::CycleTime;
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;
use emu_core::{Bus, PinLevel, RamInit, ResetCause};

const CLKPR: u16 = 0x61;
const MCUCR: u16 = 0x55;
const SMCR: u16 = 0x53;

fn chip(fuses: [u8; 3], start_up: bool) -> AvrSoc {
    let options = Options { fuses: Some(fuses), start_up, ..Options::at_hz(8_000_000) };
    Avr::with(&ATMEGA328P, &Image::default(), RamInit::Zero, options).soc().clone()
}

/// Writing CLKPCE again neither extends nor ends its four cycles (9.12.2).
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

/// BODS switches the detector (2.7 V) off during a sleep; it is on again after waking (10.11.2).
#[test]
fn a_brown_out_in_sleep_is_seen_at_waking() {
    for (bods, in_sleep) in [(true, None), (false, Some(ResetCause::BrownOut))] {
        let mut soc = chip([0xFF, 0xD9, 0xFD], false);
        if bods {
            soc.write(MCUCR, 0x60, 1);
            soc.write(MCUCR, 0x40, 2);
        }
        soc.write(SMCR, 5, 3);
        assert!(soc.sleep(4));
        soc.queue_input(CycleTime::at(10), 10, OutsideInput::Supply(2_000));
        let found = soc.requested_reset(10);
        assert_eq!(found, in_sleep, "BODS {bods}");
        if found.is_none() {
            soc.wake_up(20);
            assert_eq!(soc.requested_reset(20), Some(ResetCause::BrownOut));
        }
    }
}

/// The start-up of 6 + 14 clocks is counted from the end of a reset (11.2); later changes of the supply do
/// not matter.
#[test]
fn a_supply_that_moves_does_not_prolong_start_up() {
    let mut soc = chip([0xC0, 0xD9, 0xFD], true);
    soc.queue_input(CycleTime::at(10), 10, OutsideInput::Supply(4_800));
    soc.fire(19);
    assert!(soc.is_core_stopped());
    soc.fire(20);
    assert!(!soc.is_core_stopped());
    // PC6 is low from 30 to 40.
    soc.queue_input(CycleTime::at(30), 25, OutsideInput::Level(14, PinLevel::Low));
    soc.fire(30);
    assert_eq!(soc.requested_reset(30), Some(ResetCause::External));
    soc.reset(ResetCause::External, 30);
    soc.queue_input(CycleTime::at(40), 30, OutsideInput::Level(14, PinLevel::High));
    soc.queue_input(CycleTime::at(45), 40, OutsideInput::Supply(4_900));
    soc.fire(59);
    assert!(soc.is_core_stopped());
    soc.fire(60);
    assert!(!soc.is_core_stopped());
    assert_eq!(soc.peek(0x54, 60), 0x03, "PORF and EXTRF");
}

/// The watchdog, switched on by WDTON, counts from the end of the start-up time (11.2, 11.8), which is longer
/// than its 16 ms: 16K clocks of the crystal and 65 ms. The same holds after each of its own resets.
#[test]
fn the_watchdog_counts_from_the_end_of_start_up() {
    let mut soc = chip([0xFF, 0xC9, 0xFF], true);
    let mut now = 0;
    for _ in 0..3 {
        while soc.is_core_stopped() {
            now += 1;
            soc.fire(now);
            assert_eq!(soc.requested_reset(now), None, "in reset, cycle {now}");
        }
        let started = now;
        let why = loop {
            now += 1;
            soc.fire(now);
            if let Some(why) = soc.requested_reset(now) {
                break why;
            }
        };
        // 2048 clocks at 128 kHz are 16 ms.
        assert_eq!((why, now - started), (ResetCause::Watchdog, 128_000));
        soc.reset(why, now);
    }
}
