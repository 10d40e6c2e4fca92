//! The converter of chips that differ from the ATmega328P: channels and references.

use emu_avr::chips::chip;
use emu_avr::{Avr, Options};
use emu_core::CycleTime;
use emu_core::RamInit;
use emu_core::cpu::Bus;
use emu_core::external_io::OutsideInput;
use emu_core::image::Image;

/// Returns the result of a conversion on the chip `name` with `millivolts` on a pin.
fn converted(name: &str, pin: &str, millivolts: u32, admux: u8) -> u16 {
    let chip = chip(name).expect("a chip");
    let reg = |name: &str| chip.reg(name).expect("a register");
    let mut soc = Avr::with(chip, &Image::default(), RamInit::Zero, Options::at_hz(chip.default_hz)).soc().clone();
    soc.queue_input(CycleTime::at(0), 0, OutsideInput::Volts(chip.pin(pin).expect("a pin"), millivolts));
    soc.write(reg("ADMUX"), admux, 1);
    soc.write(reg("ADCSRA"), 0xC0, 2);
    soc.fire(100);
    u16::from(soc.read(reg("ADCL"), 100).value) | u16::from(soc.read(reg("ADCH"), 101).value) << 8
}

/// ADC6 and ADC7 convert the voltages on their pins.
#[test]
fn channels_of_the_flat_packages_convert() {
    for name in ["atmega328p", "atmega48", "atmega168a", "atmega8"] {
        assert_eq!(converted(name, "ADC6", 1_200, 0x46), 245, "{name}");
        assert_eq!(converted(name, "ADC7", 3_700, 0x47), 757, "{name}");
    }
}

/// The reference by REFS, and the bandgap (Atmel 8272, tables 23-3 and 23-4; ATmega16: 2466). The result is
/// the voltage times 1024 over the reference.
#[test]
fn references_and_bandgap() {
    for (name, admux, millivolts, wanted) in [
        ("atmega644", 0x40, 1_000, 204),
        ("atmega644", 0x80, 1_000, 930),
        ("atmega1284p", 0xC0, 1_000, 400),
        ("atmega1284p", 0x5E, 0, 225),
        ("atmega164a", 0x5F, 0, 0),
        ("atmega16", 0x80, 1_000, 204),
    ] {
        assert_eq!(converted(name, "PA0", millivolts, admux), wanted, "{name}: ADMUX {admux:02X}");
    }
}
