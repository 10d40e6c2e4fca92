//! ATmega16 and ATmega32 (Atmel 2466 and 2503).

use crate::chips::{AdcTrigger, SplitBit};
use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::{self, *};
use super::SocRegister::*;
use super::bits as b;
use super::classic::{self, assr, general, mcucsr, tccr, tccra, timers};
use super::{AvrPart, ChipMemories, HeaderNames, dip, named_chip, pins, registers, sites, unit_index};
use crate::periph::AvrLine;
use crate::periph::adc::AdcRegister::*;
use crate::periph::comparator::ComparatorRegister::*;
use crate::periph::eeprom::EepromRegister::*;
use crate::periph::external::ExternalRegister::*;
use crate::periph::spi::SpiRegister::*;
use crate::periph::spm::SpmRegister::*;
use crate::periph::timers::TimerRegister::*;
use crate::periph::timers::TimerShape;
use crate::periph::twi::TwiRegister::*;
use crate::periph::usart::UsartRegister::*;
use crate::periph::watchdog::WatchdogRegister::*;
use crate::periph::{adc, eeprom, external, spm, watchdog};

/// Chip data of the ATmega16.
const ATMEGA16: Chip = named_chip!(
    "atmega16",
    "ATmega16: 16 KB flash, 1 KB RAM, 512 bytes EEPROM, 40 pins",
    Chip {
        data_sheet: "Atmel 2466",
        regs: REGS,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS_16,
        ..ChipMemories::<0x4000, 0x60, 0x460, 0x200, 2>::CHIP
    }
);

/// Chip data of the ATmega32.
const ATMEGA32: Chip = named_chip!(
    "atmega32",
    "ATmega32: 32 KB flash, 2 KB RAM, 1 KB EEPROM, 40 pins",
    Chip {
        data_sheet: "Atmel 2503",
        regs: REGS,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS_32,
        ..ChipMemories::<0x8000, 0x60, 0x860, 0x400, 2>::CHIP
    }
);

/// Row of the ATmega16.
pub(super) const PART_16: AvrPart = AvrPart {
    chip: &ATMEGA16,
    // The reset pin follows the ports.
    ports: &[0xFF, 0xFF, 0xFF, 0xFF, 0],
    register_slots: &sites_with(SE_16),
    peripheral_pins: LINES,
    pin_changes: &[],
    stack_starts_at_ram_end: false,
    pin_writes_toggle: false,
    bit_writes_whole_register: true,
    mcucr: 0x13,
    interrupt_sources: SOURCES_16,
    timers: &[TimerShape::narrow(1), TimerShape::wide(2), TimerShape::crystal(1)],
    adc_kind: adc::AvrAdcKind::MEGA16,
    analog_pins: &[0, 1, 2, 3, 4, 5, 6, 7],
    comparator_pins: [10, 11],
    adc_triggers: TRIGGERS,
    eeprom_kind: eeprom::AvrEepromKind::MEGA8,
    spm_kind: spm::SpmKind::MEGA16,
    external_kind: external::ExternalKind::MEGA16,
    watchdog_kind: watchdog::WatchdogKind::MEGA16,
    power_reduction_bits: &[],
    signature: [0x1E, 0x94, 0x03],
    fuses: classic::FUSES,
    reset_pin: 32,
    jtag_pins: &[18, 19, 20, 21],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::MUX5, b::TRIGGERED, b::COMPARE_0, b::TIMERS, b::TIMERS_1_2, b::M16, b::SM_16],
        fuse_names: [classic::LOW_FUSES, classic::HIGH_FUSES, ""],
        factory_fuses: [0xE1, 0x99, 0xFF],
        sleep_modes: 6,
        eeprom_page: 4,
        last_outside: 0,
    },
};

/// Row of the ATmega32.
pub(super) const PART_32: AvrPart = AvrPart {
    chip: &ATMEGA32,
    register_slots: &sites_with(SE_32),
    interrupt_sources: SOURCES_32,
    spm_kind: spm::SpmKind::MEGA32,
    signature: [0x1E, 0x95, 0x02],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::MUX5, b::TRIGGERED, b::COMPARE_0, b::TIMERS, b::TIMERS_1_2, b::M16, b::SM_32],
        ..PART_16.names
    },
    ..PART_16
};

/// MCUCR. The bits of SMCR are in a different order on each of the two chips.
macro_rules! mcucr {
    ($se:literal $sm2:literal) => {
        Split(&[
            SplitBit { bit: $sm2, slot: Own(SMCR), its_bit: 3 },
            SplitBit { bit: $se, slot: Own(SMCR), its_bit: 0 },
            SplitBit { bit: 5, slot: Own(SMCR), its_bit: 2 },
            SplitBit { bit: 4, slot: Own(SMCR), its_bit: 1 },
            SplitBit { bit: 3, slot: External(EICRA), its_bit: 3 },
            SplitBit { bit: 2, slot: External(EICRA), its_bit: 2 },
            SplitBit { bit: 1, slot: External(EICRA), its_bit: 1 },
            SplitBit { bit: 0, slot: External(EICRA), its_bit: 0 },
        ])
    };
}
const SE_16: RegisterSlot = mcucr!(6 7);
const SE_32: RegisterSlot = mcucr!(7 6);

/// Returns the table of register slots with this MCUCR.
const fn sites_with(mcucr: RegisterSlot) -> [RegisterSlot; 0x100] {
    let mut all = sites(SITES, 0x60);
    all[0x55] = mcucr;
    all
}

const SFIOR: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Adc(ADCSRB), its_bit: 2 },
    SplitBit { bit: 6, slot: Adc(ADCSRB), its_bit: 1 },
    SplitBit { bit: 5, slot: Adc(ADCSRB), its_bit: 0 },
    SplitBit { bit: 3, slot: Adc(ADCSRB), its_bit: 6 },
    SplitBit { bit: 2, slot: Own(MCUCR), its_bit: 4 },
    SplitBit { bit: 1, slot: Own(GTCCR), its_bit: 1 },
    SplitBit { bit: 0, slot: Own(GTCCR), its_bit: 0 },
]);

#[rustfmt::skip]
registers! {
    0x20 "TWBR" Twi(TWBR);           0x21 "TWSR" Twi(TWSR);           0x22 "TWAR" Twi(TWAR);
    0x23 "TWDR" Twi(TWDR);           0x24 "ADCL" Adc(ADCL);           0x25 "ADCH" Adc(ADCH);
    0x26 "ADCSRA" Adc(ADCSRA);       0x27 "ADMUX" Adc(ADMUX);         0x28 "ACSR" Comparator(ACSR);
    0x29 "UBRRL" Usart(0, UBRRL);    0x2A "UCSRB" Usart(0, UCSRB);    0x2B "UCSRA" Usart(0, UCSRA);
    0x2C "UDR" Usart(0, UDR);        0x2D "SPCR" Spi(SPCR);           0x2E "SPSR" Spi(SPSR);
    0x2F "SPDR" Spi(SPDR);           0x30 "PIND" Port(3, 0);          0x31 "DDRD" Port(3, 1);
    0x32 "PORTD" Port(3, 2);         0x33 "PINC" Port(2, 0);          0x34 "DDRC" Port(2, 1);
    0x35 "PORTC" Port(2, 2);         0x36 "PINB" Port(1, 0);          0x37 "DDRB" Port(1, 1);
    0x38 "PORTB" Port(1, 2);         0x39 "PINA" Port(0, 0);          0x3A "DDRA" Port(0, 1);
    0x3B "PORTA" Port(0, 2);         0x3C "EECR" Eeprom(EECR);        0x3D "EEDR" Eeprom(EEDR);
    0x3E "EEARL" Eeprom(EEARL);      0x3F "EEARH" Eeprom(EEARH);      0x40 "UBRRH" Ursel(0);
    0x40 "UCSRC" Ursel(0);           0x41 "WDTCR" Watchdog(WDTCSR);   0x42 "ASSR" assr!(2);
    0x43 "OCR2" Timer(2, OCRAL);     0x44 "TCNT2" Timer(2, TCNTL);    0x45 "TCCR2" tccr!(2);
    0x46 "ICR1L" Timer(1, ICRL);     0x47 "ICR1H" Timer(1, ICRH);     0x48 "OCR1BL" Timer(1, OCRBL);
    0x49 "OCR1BH" Timer(1, OCRBH);   0x4A "OCR1AL" Timer(1, OCRAL);   0x4B "OCR1AH" Timer(1, OCRAH);
    0x4C "TCNT1L" Timer(1, TCNTL);   0x4D "TCNT1H" Timer(1, TCNTH);   0x4E "TCCR1B" Timer(1, TCCRB);
    0x4F "TCCR1A" tccra!(1);         0x50 "SFIOR" SFIOR;              0x51 "OSCCAL" Own(OSCCAL);
    0x51 "OCDR" Own(OSCCAL);         0x52 "TCNT0" Timer(0, TCNTL);    0x53 "TCCR0" tccr!(0);
    0x54 "MCUCSR" / "MCUSR" mcucsr!(SplitBit { bit: 7, slot: Kept(0), its_bit: 7 }, SplitBit { bit: 6, slot: External(EICRA), its_bit: 4 });
    0x55 "MCUCR" SE_16;
    0x56 "TWCR" Twi(TWCR);           0x57 "SPMCR" Spm(SPMCSR);        0x58 "TIFR" timers!(TIFR);
    0x59 "TIMSK" timers!(TIMSK);     0x5A "GIFR" general!(EIFR, SplitBit { bit: 5, slot: External(EIFR), its_bit: 2 });
    0x5B "GICR" / "GIMSK" general!(EIMSK, SplitBit { bit: 5, slot: External(EIMSK), its_bit: 2 }, SplitBit { bit: 1, slot: Own(MCUCR), its_bit: 1 }, SplitBit { bit: 0, slot: Own(MCUCR), its_bit: 0 });
    0x5C "OCR0" Timer(0, OCRAL);     0x5D "SPL" Core;                 0x5E "SPH" Core;
    0x5F "SREG" Core;
}

/// Pins (pin configurations), eight per port: the pin identity is 8 times the port (A to D) plus the bit.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PA0" 40 ""  "PA1" 39 ""  "PA2" 38 ""  "PA3" 37 ""  "PA4" 36 ""  "PA5" 35 ""  "PA6" 34 ""  "PA7" 33 ""
    "PB0" 1 ""  "PB1" 2 ""  "PB2" 3 ""  "PB3" 4 ""  "PB4" 5 ""  "PB5" 6 ""  "PB6" 7 ""  "PB7" 8 ""
    "PC0" 22 ""  "PC1" 23 ""  "PC2" 24 ""  "PC3" 25 ""  "PC4" 26 ""  "PC5" 27 ""  "PC6" 28 ""  "PC7" 29 ""
    "PD0" 14 "RXD"  "PD1" 15 "TXD"  "PD2" 16 ""  "PD3" 17 ""  "PD4" 18 ""  "PD5" 19 ""  "PD6" 20 ""  "PD7" 21 ""
    "RESET" 9 "RESET"
};

/// Packages (pin configurations).
const PACKAGES: &[ChipPackage] = &[ChipPackage { name: "DIP40", pins: &dip::<{ PINS.len() }>(PINS) }];

/// Pin of each line of a unit (alternate port functions).
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::T,    8), (unit_index::TIMER,     AvrLine::OcA, 11), (unit_index::TIMER + 1, AvrLine::T,    9),
    (unit_index::TIMER + 1, AvrLine::Icp, 30), (unit_index::TIMER + 1, AvrLine::OcA, 29), (unit_index::TIMER + 1, AvrLine::OcB, 28),
    (unit_index::TIMER + 2, AvrLine::OcA, 31), (unit_index::USART,     AvrLine::Rxd, 24), (unit_index::USART,     AvrLine::Txd, 25),
    (unit_index::USART,     AvrLine::Xck,  8), (unit_index::SPI,       AvrLine::Ss,  12), (unit_index::SPI,       AvrLine::Mosi, 13),
    (unit_index::SPI,       AvrLine::Miso, 14), (unit_index::SPI,      AvrLine::Sck, 15), (unit_index::TWI,       AvrLine::Scl, 16),
    (unit_index::TWI,       AvrLine::Sda, 17), (unit_index::EXTERNAL,  AvrLine::Int(0), 26), (unit_index::EXTERNAL, AvrLine::Int(1), 27),
    (unit_index::EXTERNAL,  AvrLine::Int(2), 10),
];

/// Interrupt vectors of the ATmega16; the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS_16: &[&str] = &[
    "RESET", "INT0", "INT1", "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF",
    "TIMER0_OVF", "SPI_STC", "USART_RXC", "USART_UDRE", "USART_TXC", "ADC", "EE_RDY", "ANA_COMP", "TWI", "INT2", "TIMER0_COMP",
    "SPM_RDY",
];

/// Sources of the interrupts of the ATmega16: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES_16: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3), (unit_index::TIMER, 2), (unit_index::SPI, 0),
    (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2), (unit_index::ADC, 0), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0), (unit_index::TWI, 0),
    (unit_index::EXTERNAL, 2), (unit_index::TIMER, 0), (unit_index::SPM, 0),
];

/// Interrupt vectors of the ATmega32; the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS_32: &[&str] = &[
    "RESET", "INT0", "INT1", "INT2", "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF",
    "TIMER0_COMP", "TIMER0_OVF", "SPI_STC", "USART_RXC", "USART_UDRE", "USART_TXC", "ADC", "EE_RDY", "ANA_COMP", "TWI", "SPM_RDY",
];

/// Sources of the interrupts of the ATmega32: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES_32: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::EXTERNAL, 2), (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3), (unit_index::TIMER, 0), (unit_index::TIMER, 2),
    (unit_index::SPI, 0), (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2), (unit_index::ADC, 0), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0),
    (unit_index::TWI, 0), (unit_index::SPM, 0),
];

/// Trigger sources of the converter, from ADTS 1 on: unit and interrupt number in it.
#[rustfmt::skip]
const TRIGGERS: &[AdcTrigger] = &[
    AdcTrigger { unit: unit_index::COMPARATOR, interrupt: 0 }, AdcTrigger { unit: unit_index::EXTERNAL, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 3 },
    AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 0 },
];
