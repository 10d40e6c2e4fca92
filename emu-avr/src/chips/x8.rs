//! ATmega48, 88, 168 and 328 with their variants (DS40002061).

use crate::chips::{AdcTrigger, FuseField};
use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::*;
use super::SocRegister::*;
use super::bits as b;
use super::fuses::{FuseLayout, start_up};
use super::{ANALOG, AvrPart, ChipMemories, HeaderNames, TQFP32, dip, named_chip, pins, registers, sites, unit_index};
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

/// Chip data that all chips of this file share, for the given memories.
macro_rules! chip {
    ($name:literal, $title:literal, $flash:literal, $end:literal, $eeprom:literal) => {
        Chip {
            data_sheet: "DS40002061",
            max_hz: 20_000_000,
            regs: REGS,
            pins: PINS,
            packages: PACKAGES,
            vectors: VECTORS,
            ..named_chip!($name, $title, ChipMemories::<$flash, 0x100, $end, $eeprom, 3>::CHIP)
        }
    };
}

/// Chip data of the ATmega328P.
pub const ATMEGA328P: Chip =
    chip!("atmega328p", "ATmega328P: 32 KB flash, 2 KB RAM, 1 KB EEPROM, 28 or 32 pins", 0x8000, 0x900, 0x400);

/// Chip data of the ATmega328: the 328P without the low-power process.
pub const ATMEGA328: Chip = named_chip!("atmega328", "ATmega328: as ATmega328P, other process", ATMEGA328P);

/// Chip data of the ATmega168.
const ATMEGA168: Chip =
    chip!("atmega168", "ATmega168: 16 KB flash, 1 KB RAM, 512 bytes EEPROM, 28 or 32 pins", 0x4000, 0x500, 0x200);
/// Chip data of the ATmega88.
const ATMEGA88: Chip =
    chip!("atmega88", "ATmega88: 8 KB flash, 1 KB RAM, 512 bytes EEPROM, 28 or 32 pins", 0x2000, 0x500, 0x200);
/// Chip data of the ATmega48.
const ATMEGA48: Chip =
    chip!("atmega48", "ATmega48: 4 KB flash, 512 bytes RAM, 256 bytes EEPROM, 28 or 32 pins", 0x1000, 0x300, 0x100);

/// Row of the ATmega328P.
pub const PART_328P: AvrPart = AvrPart {
    chip: &ATMEGA328P,
    ports: &[0xFF, 0x7F, 0xFF, ANALOG],
    register_slots: &sites(SITES, 0x100),
    peripheral_pins: LINES,
    pin_changes: PIN_CHANGES,
    stack_starts_at_ram_end: true,
    pin_writes_toggle: true,
    bit_writes_whole_register: false,
    mcucr: 0x73,
    interrupt_sources: SOURCES,
    timers: &[TimerShape::narrow(2), TimerShape::wide(2), TimerShape::crystal(2)],
    adc_kind: adc::AvrAdcKind::MEGA48,
    analog_pins: &[8, 9, 10, 11, 12, 13, 24, 25],
    comparator_pins: [22, 23],
    adc_triggers: TRIGGERS,
    eeprom_kind: eeprom::AvrEepromKind::MEGA48,
    spm_kind: spm::SpmKind::MEGA328,
    external_kind: external::ExternalKind::MEGA328,
    watchdog_kind: watchdog::WatchdogKind::MEGA48,
    power_reduction_bits: &[
        (7, unit_index::TWI),
        (6, unit_index::TIMER + 2),
        (5, unit_index::TIMER),
        (3, unit_index::TIMER + 1),
        (2, unit_index::SPI),
        (1, unit_index::USART),
        (0, unit_index::ADC),
    ],
    signature: [0x1E, 0x95, 0x0F],
    fuses: FuseLayout {
        default_bytes: [0xFF, 0xD9, 0xFF],
        ckdiv8: Some(FuseField { byte: 0, bit: 7, bits: 1 }),
        cksel: FuseField { byte: 0, bit: 0, bits: 4 },
        sut: FuseField { byte: 0, bit: 4, bits: 2 },
        start_up,
        reset_clocks: 14,
        wdton: Some(FuseField { byte: 1, bit: 4, bits: 1 }),
        eesave: FuseField { byte: 1, bit: 3, bits: 1 },
        bootsz: Some(FuseField { byte: 1, bit: 1, bits: 2 }),
        bootrst: Some(FuseField { byte: 1, bit: 0, bits: 1 }),
        rstdisbl: Some(FuseField { byte: 1, bit: 7, bits: 1 }),
        bodlevel: FuseField { byte: 2, bit: 0, bits: 3 },
        bod_mv: &[0, 0, 0, 0, 4_300, 2_700, 1_800, 0],
    },
    reset_pin: 14,
    jtag_pins: &[],
    names: HeaderNames {
        bit_names: &[b::ANY, b::NEW, b::DATA, b::X8, b::MUX4, b::TRIGGERED],
        fuse_names: [
            LOW_FUSES,
            "FUSE_RSTDISBL FUSE_DWEN FUSE_SPIEN FUSE_WDTON FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST",
            "- - - - - FUSE_BODLEVEL2 FUSE_BODLEVEL1 FUSE_BODLEVEL0",
        ],
        factory_fuses: [0x62, 0xD9, 0xFF],
        sleep_modes: 6,
        eeprom_page: 4,
        last_outside: 0,
    },
};

/// Names of the fuses in the low byte. Some headers number CKSEL and SUT together.
pub(super) const LOW_FUSES: &str = "
    FUSE_CKDIV8 FUSE_CKOUT FUSE_SUT1/FUSE_SUT_CKSEL5 FUSE_SUT0/FUSE_SUT_CKSEL4 FUSE_CKSEL3/FUSE_SUT_CKSEL3
    FUSE_CKSEL2/FUSE_SUT_CKSEL2 FUSE_CKSEL1/FUSE_SUT_CKSEL1 FUSE_CKSEL0/FUSE_SUT_CKSEL0";
/// Names of the fuses in the high byte, on chips with BODLEVEL in that byte.
const HIGH_FUSES: &str =
    "FUSE_RSTDISBL FUSE_DWEN FUSE_SPIEN FUSE_WDTON FUSE_EESAVE FUSE_BODLEVEL2 FUSE_BODLEVEL1 FUSE_BODLEVEL0";

/// Mask of MCUCR without BODS and BODSE, which only the P and PA variants have (10.11.2).
const NO_BODS: u8 = 0x13;

/// Converter of the first ATmega48, 88 and 168, without a temperature sensor (Atmel 2545, ADC).
const COLD: adc::AvrAdcKind = adc::AvrAdcKind { temperature: None, ..adc::AvrAdcKind::MEGA48 };

/// Row of the ATmega328.
pub(super) const PART_328: AvrPart =
    AvrPart { chip: &ATMEGA328, mcucr: NO_BODS, signature: [0x1E, 0x95, 0x14], ..PART_328P };

/// Row of the ATmega168PA. On ATmega88 and 168 the fuses of the boot section are in the extended byte, and
/// BODLEVEL is in the high byte (tables 28-5 to 28-8).
pub(super) const PART_168PA: AvrPart = AvrPart {
    chip: &named_chip!("atmega168pa", "ATmega168PA: as ATmega168P, newer process", ATMEGA168),
    spm_kind: spm::SpmKind::MEGA168,
    signature: [0x1E, 0x94, 0x0B],
    fuses: FuseLayout {
        default_bytes: [0xFF, 0xDF, 0xF9],
        bootsz: Some(FuseField { byte: 2, bit: 1, bits: 2 }),
        bootrst: Some(FuseField { byte: 2, bit: 0, bits: 1 }),
        bodlevel: FuseField { byte: 1, bit: 0, bits: 3 },
        ..PART_328P.fuses
    },
    names: HeaderNames {
        fuse_names: [LOW_FUSES, HIGH_FUSES, "- - - - - FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST"],
        factory_fuses: [0x62, 0xDF, 0xF9],
        ..PART_328P.names
    },
    ..PART_328P
};

/// Row of the ATmega168P.
pub(super) const PART_168P: AvrPart = AvrPart {
    chip: &named_chip!("atmega168p", "ATmega168P: as ATmega168, brown-out detector off in sleep", ATMEGA168),
    ..PART_168PA
};

/// Row of the ATmega168A.
pub(super) const PART_168A: AvrPart = AvrPart {
    chip: &named_chip!("atmega168a", "ATmega168A: as ATmega168, newer process", ATMEGA168),
    mcucr: NO_BODS,
    signature: [0x1E, 0x94, 0x06],
    ..PART_168PA
};

/// Row of the ATmega168.
pub(super) const PART_168: AvrPart =
    AvrPart { chip: &ATMEGA168, adc_kind: COLD, external_kind: external::ExternalKind::MEGA48, ..PART_168A };

/// Row of the ATmega88PA.
pub(super) const PART_88PA: AvrPart = AvrPart {
    chip: &named_chip!("atmega88pa", "ATmega88PA: as ATmega88P, newer process", ATMEGA88),
    spm_kind: spm::SpmKind::MEGA88,
    signature: [0x1E, 0x93, 0x0F],
    ..PART_168PA
};

/// Row of the ATmega88P.
pub(super) const PART_88P: AvrPart = AvrPart {
    chip: &named_chip!("atmega88p", "ATmega88P: as ATmega88, brown-out detector off in sleep", ATMEGA88),
    ..PART_88PA
};

/// Row of the ATmega88A.
pub(super) const PART_88A: AvrPart = AvrPart {
    chip: &named_chip!("atmega88a", "ATmega88A: as ATmega88, newer process", ATMEGA88),
    mcucr: NO_BODS,
    signature: [0x1E, 0x93, 0x0A],
    ..PART_88PA
};

/// Row of the ATmega88.
pub(super) const PART_88: AvrPart =
    AvrPart { chip: &ATMEGA88, adc_kind: COLD, external_kind: external::ExternalKind::MEGA48, ..PART_88A };

/// Row of the ATmega48PA, which has no boot section and therefore no IVSEL (12.5).
pub(super) const PART_48PA: AvrPart = AvrPart {
    chip: &named_chip!("atmega48pa", "ATmega48PA: as ATmega48P, newer process", ATMEGA48),
    mcucr: 0x70,
    spm_kind: spm::SpmKind::MEGA48,
    signature: [0x1E, 0x92, 0x0A],
    fuses: FuseLayout { default_bytes: [0xFF, 0xDF, 0xFF], bootsz: None, bootrst: None, ..PART_168PA.fuses },
    names: HeaderNames {
        fuse_names: [LOW_FUSES, HIGH_FUSES, "- - - - - - - FUSE_SELFPRGEN"],
        factory_fuses: [0x62, 0xDF, 0xFF],
        ..PART_168PA.names
    },
    ..PART_168PA
};

/// Row of the ATmega48P.
pub(super) const PART_48P: AvrPart = AvrPart {
    chip: &named_chip!("atmega48p", "ATmega48P: as ATmega48, brown-out detector off in sleep", ATMEGA48),
    ..PART_48PA
};

/// Row of the ATmega48A.
pub(super) const PART_48A: AvrPart = AvrPart {
    chip: &named_chip!("atmega48a", "ATmega48A: as ATmega48, newer process", ATMEGA48),
    mcucr: 0x10,
    signature: [0x1E, 0x92, 0x05],
    ..PART_48PA
};

/// Row of the ATmega48.
pub(super) const PART_48: AvrPart =
    AvrPart { chip: &ATMEGA48, adc_kind: COLD, external_kind: external::ExternalKind::MEGA48, ..PART_48A };

#[rustfmt::skip]
registers! {
    0x23 "PINB" Port(0, 0);          0x24 "DDRB" Port(0, 1);          0x25 "PORTB" Port(0, 2);
    0x26 "PINC" Port(1, 0);          0x27 "DDRC" Port(1, 1);          0x28 "PORTC" Port(1, 2);
    0x29 "PIND" Port(2, 0);          0x2A "DDRD" Port(2, 1);          0x2B "PORTD" Port(2, 2);
    0x35 "TIFR0" Timer(0, TIFR);     0x36 "TIFR1" Timer(1, TIFR);     0x37 "TIFR2" Timer(2, TIFR);
    0x3B "PCIFR" External(PCIFR);    0x3C "EIFR" External(EIFR);      0x3D "EIMSK" External(EIMSK);
    0x3E "GPIOR0" Kept(0);           0x3F "EECR" Eeprom(EECR);        0x40 "EEDR" Eeprom(EEDR);
    0x41 "EEARL" Eeprom(EEARL);      0x42 "EEARH" Eeprom(EEARH);      0x43 "GTCCR" Own(GTCCR);
    0x44 "TCCR0A" Timer(0, TCCRA);   0x45 "TCCR0B" Timer(0, TCCRB);   0x46 "TCNT0" Timer(0, TCNTL);
    0x47 "OCR0A" Timer(0, OCRAL);    0x48 "OCR0B" Timer(0, OCRBL);    0x4A "GPIOR1" Kept(1);
    0x4B "GPIOR2" Kept(2);           0x4C "SPCR" Spi(SPCR);           0x4D "SPSR" Spi(SPSR);
    0x4E "SPDR" Spi(SPDR);           0x50 "ACSR" Comparator(ACSR);    0x53 "SMCR" Own(SMCR);
    0x54 "MCUSR" Own(MCUSR);         0x55 "MCUCR" Own(MCUCR);         0x57 "SPMCSR" Spm(SPMCSR);
    0x5D "SPL" Core;                 0x5E "SPH" Core;                 0x5F "SREG" Core;
    0x60 "WDTCSR" Watchdog(WDTCSR);  0x61 "CLKPR" Own(CLKPR);         0x64 "PRR" Own(PRR);
    0x66 "OSCCAL" Own(OSCCAL);       0x68 "PCICR" External(PCICR);    0x69 "EICRA" External(EICRA);
    0x6B "PCMSK0" External(PCMSK0);  0x6C "PCMSK1" External(PCMSK1);  0x6D "PCMSK2" External(PCMSK2);
    0x6E "TIMSK0" Timer(0, TIMSK);   0x6F "TIMSK1" Timer(1, TIMSK);   0x70 "TIMSK2" Timer(2, TIMSK);
    0x78 "ADCL" Adc(ADCL);           0x79 "ADCH" Adc(ADCH);           0x7A "ADCSRA" Adc(ADCSRA);
    0x7B "ADCSRB" Adc(ADCSRB);       0x7C "ADMUX" Adc(ADMUX);         0x7E "DIDR0" Adc(DIDR0);
    0x7F "DIDR1" Comparator(DIDR1);  0x80 "TCCR1A" Timer(1, TCCRA);   0x81 "TCCR1B" Timer(1, TCCRB);
    0x82 "TCCR1C" Timer(1, TCCRC);   0x84 "TCNT1L" Timer(1, TCNTL);   0x85 "TCNT1H" Timer(1, TCNTH);
    0x86 "ICR1L" Timer(1, ICRL);     0x87 "ICR1H" Timer(1, ICRH);     0x88 "OCR1AL" Timer(1, OCRAL);
    0x89 "OCR1AH" Timer(1, OCRAH);   0x8A "OCR1BL" Timer(1, OCRBL);   0x8B "OCR1BH" Timer(1, OCRBH);
    0xB0 "TCCR2A" Timer(2, TCCRA);   0xB1 "TCCR2B" Timer(2, TCCRB);   0xB2 "TCNT2" Timer(2, TCNTL);
    0xB3 "OCR2A" Timer(2, OCRAL);    0xB4 "OCR2B" Timer(2, OCRBL);    0xB6 "ASSR" Timer(2, ASSR);
    0xB8 "TWBR" Twi(TWBR);           0xB9 "TWSR" Twi(TWSR);           0xBA "TWAR" Twi(TWAR);
    0xBB "TWDR" Twi(TWDR);           0xBC "TWCR" Twi(TWCR);           0xBD "TWAMR" Twi(TWAMR);
    0xC0 "UCSR0A" Usart(0, UCSRA);   0xC1 "UCSR0B" Usart(0, UCSRB);   0xC2 "UCSR0C" Usart(0, UCSRC);
    0xC4 "UBRR0L" Usart(0, UBRRL);   0xC5 "UBRR0H" Usart(0, UBRRH);   0xC6 "UDR0" Usart(0, UDR);
}

/// Pins (section 1), eight per port: the pin identity is 8 times the port (B, C, D) plus the bit. The inputs
/// that are only analog follow the ports.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PB0" 14 ""  "PB1" 15 ""  "PB2" 16 ""  "PB3" 17 ""  "PB4" 18 ""  "PB5" 19 ""  "PB6" 9 "XTAL1"  "PB7" 10 "XTAL2"
    "PC0" 23 ""  "PC1" 24 ""  "PC2" 25 ""  "PC3" 26 ""  "PC4" 27 ""  "PC5" 28 ""  "PC6" 1 "RESET"  "PC7" 0 "absent"
    "PD0" 2 "RXD0"  "PD1" 3 "TXD0"  "PD2" 4 ""  "PD3" 5 ""  "PD4" 6 ""  "PD5" 11 ""  "PD6" 12 ""  "PD7" 13 ""
    "ADC6" 0 "analog input"  "ADC7" 0 "analog input"
};

/// Packages (section 1). The 32-pin MLF, also called QFN, has the pin numbers of the TQFP; the numbers of the
/// 28-pin MLF are those of the DIP28 rotated by four.
#[rustfmt::skip]
const PACKAGES: &[ChipPackage] = &[
    ChipPackage { name: "DIP28", pins: &dip::<{ PINS.len() }>(PINS) },
    ChipPackage { name: "TQFP32", pins: &TQFP32 },
    ChipPackage { name: "MLF32", pins: &TQFP32 },
    ChipPackage { name: "MLF28", pins: &[
        10, 11, 12, 13, 14, 15, 5, 6,  19, 20, 21, 22, 23, 24, 25, 0,  26, 27, 28, 1, 2, 7, 8, 9,  0, 0,
    ] },
];

/// Pin of each line of a unit (section 14.3), without the pin change inputs.
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::T,   20), (unit_index::TIMER,     AvrLine::OcA, 22), (unit_index::TIMER,     AvrLine::OcB, 21),
    (unit_index::TIMER + 1, AvrLine::T,   21), (unit_index::TIMER + 1, AvrLine::Icp,  0), (unit_index::TIMER + 1, AvrLine::OcA,  1),
    (unit_index::TIMER + 1, AvrLine::OcB,  2), (unit_index::TIMER + 2, AvrLine::OcA,  3), (unit_index::TIMER + 2, AvrLine::OcB, 19),
    (unit_index::USART,     AvrLine::Rxd, 16), (unit_index::USART,     AvrLine::Txd, 17), (unit_index::USART,     AvrLine::Xck, 20),
    (unit_index::SPI,       AvrLine::Ss,   2), (unit_index::SPI,       AvrLine::Mosi, 3), (unit_index::SPI,       AvrLine::Miso, 4),
    (unit_index::SPI,       AvrLine::Sck,  5), (unit_index::TWI,       AvrLine::Sda, 12), (unit_index::TWI,       AvrLine::Scl, 13),
    (unit_index::EXTERNAL,  AvrLine::Int(0), 18), (unit_index::EXTERNAL, AvrLine::Int(1), 19),
];

/// Pin and number of each pin change input: PCINT0 to 7 on port B, 8 to 14 on port C, 16 to 23 on port D.
#[rustfmt::skip]
const PIN_CHANGES: &[(PinId, u8)] = &[
    (0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (7, 7), (8, 8), (9, 9), (10, 10), (11, 11), (12, 12), (13, 13),
    (14, 14), (16, 16), (17, 17), (18, 18), (19, 19), (20, 20), (21, 21), (22, 22), (23, 23),
];

/// Interrupt vectors (table 12-6); the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "PCINT0", "PCINT1", "PCINT2", "WDT", "TIMER2_COMPA", "TIMER2_COMPB", "TIMER2_OVF",
    "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMPA", "TIMER0_COMPB", "TIMER0_OVF", "SPI_STC",
    "USART_RX", "USART_UDRE", "USART_TX", "ADC", "EE_READY", "ANALOG_COMP", "TWI", "SPM_READY",
];

/// Sources of the interrupts: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::EXTERNAL, 2), (unit_index::EXTERNAL, 3), (unit_index::EXTERNAL, 4), (unit_index::WATCHDOG, 0),
    (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 1), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3),
    (unit_index::TIMER, 0), (unit_index::TIMER, 1), (unit_index::TIMER, 2), (unit_index::SPI, 0),
    (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2), (unit_index::ADC, 0), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0), (unit_index::TWI, 0),
    (unit_index::SPM, 0),
];

/// Trigger sources of the converter (table 24-6), from ADTS 1 on: unit and interrupt number in it.
#[rustfmt::skip]
const TRIGGERS: &[AdcTrigger] = &[
    AdcTrigger { unit: unit_index::COMPARATOR, interrupt: 0 }, AdcTrigger { unit: unit_index::EXTERNAL, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 3 },
    AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 0 },
];
