//! ATmega164, 324, 644 and 1284 with their variants (Atmel 8272; Atmel 8011 for 164P, 324P and 644P; Atmel
//! 2593 for the first ATmega644).

use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::*;
use super::SocRegister::*;
use super::bits as b;
use super::x8::{LOW_FUSES, PART_328P};
use super::{
    AvrPart, ChipMemories, FuseLayout, HeaderNames, dip, m162, named_chip, pins, registers, sites, unit_index,
};
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
use crate::periph::{adc, external, spm};

/// Chip data of a chip with two USARTs, for the given memories.
macro_rules! chip {
    ($name:literal, $title:literal, $sheet:literal, $flash:literal, $end:literal, $eeprom:literal) => {
        Chip {
            data_sheet: $sheet,
            max_hz: 20_000_000,
            regs: first(REGS, REGS.len() - OF_TIMER_3.registers),
            pins: PINS,
            packages: PACKAGES,
            vectors: first(VECTORS, VECTORS.len() - OF_TIMER_3.vectors),
            ..named_chip!($name, $title, ChipMemories::<$flash, 0x100, $end, $eeprom, 3>::CHIP)
        }
    };
}

/// Numbers of rows at the end of the tables of this file that only some of the chips have.
struct LastRows {
    /// Rows of [`REGS`] and [`SITES`].
    registers: usize,
    /// Rows of [`VECTORS`] and [`SOURCES`].
    vectors: usize,
    /// Rows of [`LINES`].
    lines: usize,
    /// Rows of [`POWER_REDUCTION`].
    power: usize,
}

/// Rows of timer 3, RAMPZ and PRR1, which only the ATmega1284 and 1284P have.
const OF_TIMER_3: LastRows = LastRows { registers: 15, vectors: 4, lines: 4, power: 1 };
/// Rows of those and of USART 1, which the first ATmega644 lacks.
const OF_USART_1: LastRows = LastRows { registers: 21, vectors: 7, lines: 7, power: 2 };

/// Returns the first `count` rows of a table.
const fn first<T>(rows: &'static [T], count: usize) -> &'static [T] {
    rows.split_at(count).0
}

/// Chip data of the ATmega164P.
const ATMEGA164P: Chip = chip!(
    "atmega164p",
    "ATmega164P: 16 KB flash, 1 KB RAM, 512 bytes EEPROM, 40 or 44 pins",
    "Atmel 8011",
    0x4000,
    0x500,
    0x200
);
/// Chip data of the ATmega324P.
const ATMEGA324P: Chip = chip!(
    "atmega324p",
    "ATmega324P: 32 KB flash, 2 KB RAM, 1 KB EEPROM, 40 or 44 pins",
    "Atmel 8011",
    0x8000,
    0x900,
    0x400
);
/// Chip data of the ATmega644P.
const ATMEGA644P: Chip = chip!(
    "atmega644p",
    "ATmega644P: 64 KB flash, 4 KB RAM, 2 KB EEPROM, 40 or 44 pins",
    "Atmel 8011",
    0x1_0000,
    0x1100,
    0x800
);
/// Chip data of the ATmega644.
const ATMEGA644: Chip = Chip {
    data_sheet: "Atmel 2593",
    pins: &PINS_644,
    regs: first(REGS, REGS.len() - OF_USART_1.registers),
    vectors: first(VECTORS, VECTORS.len() - OF_USART_1.vectors),
    ..named_chip!("atmega644", "ATmega644: as ATmega644P, with one USART, other process", ATMEGA644P)
};
/// Chip data of the ATmega1284P.
const ATMEGA1284P: Chip = Chip {
    regs: REGS,
    vectors: VECTORS,
    ..chip!(
        "atmega1284p",
        "ATmega1284P: 128 KB flash, 16 KB RAM, 4 KB EEPROM, 40 or 44 pins",
        "Atmel 8272",
        0x2_0000,
        0x4100,
        0x1000
    )
};

/// Chip data under another name, of a variant that Atmel 8272 describes.
macro_rules! variant {
    ($name:literal, $title:literal, $chip:expr) => {
        &Chip { data_sheet: "Atmel 8272", ..named_chip!($name, $title, $chip) }
    };
}

/// Row of the ATmega164P.
pub(super) const PART_164P: AvrPart = AvrPart {
    chip: &ATMEGA164P,
    // The reset pin follows the ports.
    ports: &[0xFF, 0xFF, 0xFF, 0xFF, 0],
    register_slots: &sites(first(SITES, SITES.len() - OF_TIMER_3.registers), 0x100),
    peripheral_pins: first(LINES, LINES.len() - OF_TIMER_3.lines),
    pin_changes: PIN_CHANGES,
    mcucr: 0xF3,
    interrupt_sources: first(SOURCES, SOURCES.len() - OF_TIMER_3.vectors),
    adc_kind: adc::AvrAdcKind::MEGA644,
    analog_pins: &[0, 1, 2, 3, 4, 5, 6, 7],
    comparator_pins: [10, 11],
    spm_kind: spm::SpmKind::MEGA168,
    external_kind: external::ExternalKind::MEGA644,
    power_reduction_bits: first(POWER_REDUCTION, POWER_REDUCTION.len() - OF_TIMER_3.power),
    signature: [0x1E, 0x94, 0x0A],
    fuses: FuseLayout { rstdisbl: None, ..PART_328P.fuses },
    reset_pin: 32,
    jtag_pins: &[18, 19, 20, 21],
    names: HeaderNames {
        bit_names: &[b::ANY, b::NEW, b::M644, b::M644_BODS, b::M644_P, b::MUX5, b::TRIGGERED],
        fuse_names: [
            LOW_FUSES,
            "FUSE_OCDEN FUSE_JTAGEN FUSE_SPIEN FUSE_WDTON FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST",
            "- - - - - FUSE_BODLEVEL2 FUSE_BODLEVEL1 FUSE_BODLEVEL0",
        ],
        factory_fuses: [0x62, 0x99, 0xFF],
        ..PART_328P.names
    },
    ..PART_328P
};

/// Mask of MCUCR without BODS and BODSE, which only the P and PA variants have (8272, 10.3).
const NO_BODS: u8 = 0x93;

/// Names of the chips of Atmel 8272.
const NAMES_8272: HeaderNames = HeaderNames {
    bit_names: &[b::ANY, b::NEW, b::DATA, b::M644, b::M644_BODS, b::M644_P, b::M644_DATA, b::MUX5, b::TRIGGERED],
    ..PART_164P.names
};

/// Row of the ATmega164PA.
pub(super) const PART_164PA: AvrPart = AvrPart {
    chip: variant!("atmega164pa", "ATmega164PA: as ATmega164P, newer process", ATMEGA164P),
    names: NAMES_8272,
    ..PART_164P
};

/// Row of the ATmega164A.
pub(super) const PART_164A: AvrPart = AvrPart {
    chip: variant!("atmega164a", "ATmega164A: as ATmega164PA, without BODS", ATMEGA164P),
    mcucr: NO_BODS,
    signature: [0x1E, 0x94, 0x0F],
    ..PART_164PA
};

/// Row of the ATmega324P.
pub(super) const PART_324P: AvrPart =
    AvrPart { chip: &ATMEGA324P, spm_kind: spm::SpmKind::MEGA328, signature: [0x1E, 0x95, 0x08], ..PART_164P };

/// Row of the ATmega324PA.
pub(super) const PART_324PA: AvrPart = AvrPart {
    chip: variant!("atmega324pa", "ATmega324PA: as ATmega324P, newer process", ATMEGA324P),
    signature: [0x1E, 0x95, 0x11],
    names: NAMES_8272,
    ..PART_324P
};

/// Row of the ATmega324A.
pub(super) const PART_324A: AvrPart = AvrPart {
    chip: variant!("atmega324a", "ATmega324A: as ATmega324PA, without BODS", ATMEGA324P),
    mcucr: NO_BODS,
    signature: [0x1E, 0x95, 0x15],
    ..PART_324PA
};

/// Row of the ATmega644P.
pub(super) const PART_644P: AvrPart = AvrPart {
    chip: &ATMEGA644P,
    spm_kind: spm::SpmKind::MEGA644,
    signature: [0x1E, 0x96, 0x0A],
    names: HeaderNames { eeprom_page: 8, ..PART_164P.names },
    ..PART_164P
};

/// Row of the ATmega644PA.
pub(super) const PART_644PA: AvrPart = AvrPart {
    chip: variant!("atmega644pa", "ATmega644PA: as ATmega644P, newer process", ATMEGA644P),
    names: HeaderNames { eeprom_page: 8, ..NAMES_8272 },
    ..PART_644P
};

/// Row of the ATmega644A.
pub(super) const PART_644A: AvrPart = AvrPart {
    chip: variant!("atmega644a", "ATmega644A: as ATmega644PA, without BODS", ATMEGA644P),
    mcucr: NO_BODS,
    signature: [0x1E, 0x96, 0x09],
    ..PART_644PA
};

/// Row of the first ATmega644.
pub(super) const PART_644: AvrPart = AvrPart {
    chip: &ATMEGA644,
    register_slots: &sites(first(SITES, SITES.len() - OF_USART_1.registers), 0x100),
    peripheral_pins: first(LINES, LINES.len() - OF_USART_1.lines),
    mcucr: NO_BODS,
    interrupt_sources: first(SOURCES, SOURCES.len() - OF_USART_1.vectors),
    power_reduction_bits: first(POWER_REDUCTION, POWER_REDUCTION.len() - OF_USART_1.power),
    signature: [0x1E, 0x96, 0x09],
    names: HeaderNames {
        bit_names: &[b::ANY, b::NEW, b::M644, b::MUX5, b::TRIGGERED],
        fuse_names: [m162::LOW_FUSES, PART_644P.names.fuse_names[1], PART_644P.names.fuse_names[2]],
        ..PART_644P.names
    },
    ..PART_644P
};

/// Row of the ATmega1284P.
pub(super) const PART_1284P: AvrPart = AvrPart {
    chip: &ATMEGA1284P,
    register_slots: &sites(SITES, 0x100),
    peripheral_pins: LINES,
    interrupt_sources: SOURCES,
    timers: &[TimerShape::narrow(2), TimerShape::wide(2), TimerShape::crystal(2), TimerShape::wide(2)],
    spm_kind: spm::SpmKind::MEGA1284,
    power_reduction_bits: POWER_REDUCTION,
    signature: [0x1E, 0x97, 0x05],
    ..PART_644PA
};

/// Row of the ATmega1284.
pub(super) const PART_1284: AvrPart = AvrPart {
    chip: &named_chip!("atmega1284", "ATmega1284: as ATmega1284P, without BODS", ATMEGA1284P),
    mcucr: NO_BODS,
    signature: [0x1E, 0x97, 0x06],
    ..PART_1284P
};

// The last 15 rows are those of timer 3, the 6 before them those of USART 1.
#[rustfmt::skip]
registers! {
    0x20 "PINA" Port(0, 0);          0x21 "DDRA" Port(0, 1);          0x22 "PORTA" Port(0, 2);
    0x23 "PINB" Port(1, 0);          0x24 "DDRB" Port(1, 1);          0x25 "PORTB" Port(1, 2);
    0x26 "PINC" Port(2, 0);          0x27 "DDRC" Port(2, 1);          0x28 "PORTC" Port(2, 2);
    0x29 "PIND" Port(3, 0);          0x2A "DDRD" Port(3, 1);          0x2B "PORTD" Port(3, 2);
    0x35 "TIFR0" Timer(0, TIFR);     0x36 "TIFR1" Timer(1, TIFR);     0x37 "TIFR2" Timer(2, TIFR);
    0x3B "PCIFR" External(PCIFR);    0x3C "EIFR" External(EIFR);      0x3D "EIMSK" External(EIMSK);
    0x3E "GPIOR0" Kept(0);           0x3F "EECR" Eeprom(EECR);        0x40 "EEDR" Eeprom(EEDR);
    0x41 "EEARL" Eeprom(EEARL);      0x42 "EEARH" Eeprom(EEARH);      0x43 "GTCCR" Own(GTCCR);
    0x44 "TCCR0A" Timer(0, TCCRA);   0x45 "TCCR0B" Timer(0, TCCRB);   0x46 "TCNT0" Timer(0, TCNTL);
    0x47 "OCR0A" Timer(0, OCRAL);    0x48 "OCR0B" Timer(0, OCRBL);    0x4A "GPIOR1" Kept(1);
    0x4B "GPIOR2" Kept(2);           0x4C "SPCR" / "SPCR0" Spi(SPCR); 0x4D "SPSR" / "SPSR0" Spi(SPSR);
    0x4E "SPDR" / "SPDR0" Spi(SPDR); 0x50 "ACSR" Comparator(ACSR);    0x51 "OCDR" Reserved;
    0x53 "SMCR" Own(SMCR);           0x54 "MCUSR" Own(MCUSR);         0x55 "MCUCR" Own(MCUCR);
    0x57 "SPMCSR" Spm(SPMCSR);       0x5D "SPL" Core;                 0x5E "SPH" Core;
    0x5F "SREG" Core;                0x60 "WDTCSR" Watchdog(WDTCSR);  0x61 "CLKPR" Own(CLKPR);
    0x64 "PRR0" / "PRR" Own(PRR);    0x66 "OSCCAL" Own(OSCCAL);       0x68 "PCICR" External(PCICR);
    0x69 "EICRA" External(EICRA);    0x6B "PCMSK0" External(PCMSK0);  0x6C "PCMSK1" External(PCMSK1);
    0x6D "PCMSK2" External(PCMSK2);  0x6E "TIMSK0" Timer(0, TIMSK);   0x6F "TIMSK1" Timer(1, TIMSK);
    0x70 "TIMSK2" Timer(2, TIMSK);   0x73 "PCMSK3" External(PCMSK3);  0x78 "ADCL" Adc(ADCL);
    0x79 "ADCH" Adc(ADCH);           0x7A "ADCSRA" Adc(ADCSRA);       0x7B "ADCSRB" Adc(ADCSRB);
    0x7C "ADMUX" Adc(ADMUX);         0x7E "DIDR0" Adc(DIDR0);         0x7F "DIDR1" Comparator(DIDR1);
    0x80 "TCCR1A" Timer(1, TCCRA);   0x81 "TCCR1B" Timer(1, TCCRB);   0x82 "TCCR1C" Timer(1, TCCRC);
    0x84 "TCNT1L" Timer(1, TCNTL);   0x85 "TCNT1H" Timer(1, TCNTH);   0x86 "ICR1L" Timer(1, ICRL);
    0x87 "ICR1H" Timer(1, ICRH);     0x88 "OCR1AL" Timer(1, OCRAL);   0x89 "OCR1AH" Timer(1, OCRAH);
    0x8A "OCR1BL" Timer(1, OCRBL);   0x8B "OCR1BH" Timer(1, OCRBH);   0xB0 "TCCR2A" Timer(2, TCCRA);
    0xB1 "TCCR2B" Timer(2, TCCRB);   0xB2 "TCNT2" Timer(2, TCNTL);    0xB3 "OCR2A" Timer(2, OCRAL);
    0xB4 "OCR2B" Timer(2, OCRBL);    0xB6 "ASSR" Timer(2, ASSR);      0xB8 "TWBR" Twi(TWBR);
    0xB9 "TWSR" Twi(TWSR);           0xBA "TWAR" Twi(TWAR);           0xBB "TWDR" Twi(TWDR);
    0xBC "TWCR" Twi(TWCR);           0xBD "TWAMR" Twi(TWAMR);         0xC0 "UCSR0A" Usart(0, UCSRA);
    0xC1 "UCSR0B" Usart(0, UCSRB);   0xC2 "UCSR0C" Usart(0, UCSRC);   0xC4 "UBRR0L" Usart(0, UBRRL);
    0xC5 "UBRR0H" Usart(0, UBRRH);   0xC6 "UDR0" Usart(0, UDR);
    0xC8 "UCSR1A" Usart(1, UCSRA);   0xC9 "UCSR1B" Usart(1, UCSRB);   0xCA "UCSR1C" Usart(1, UCSRC);
    0xCC "UBRR1L" Usart(1, UBRRL);   0xCD "UBRR1H" Usart(1, UBRRH);   0xCE "UDR1" Usart(1, UDR);
    0x38 "TIFR3" Timer(3, TIFR);     0x5B "RAMPZ" Own(RAMPZ);         0x65 "PRR1" Own(PRR1);
    0x71 "TIMSK3" Timer(3, TIMSK);   0x90 "TCCR3A" Timer(3, TCCRA);   0x91 "TCCR3B" Timer(3, TCCRB);
    0x92 "TCCR3C" Timer(3, TCCRC);   0x94 "TCNT3L" Timer(3, TCNTL);   0x95 "TCNT3H" Timer(3, TCNTH);
    0x96 "ICR3L" Timer(3, ICRL);     0x97 "ICR3H" Timer(3, ICRH);     0x98 "OCR3AL" Timer(3, OCRAL);
    0x99 "OCR3AH" Timer(3, OCRAH);   0x9A "OCR3BL" Timer(3, OCRBL);   0x9B "OCR3BH" Timer(3, OCRBH);
}

/// Pins (pin configurations), eight per port: the pin identity is 8 times the port (A to D) plus the bit.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PA0" 40 ""  "PA1" 39 ""  "PA2" 38 ""  "PA3" 37 ""  "PA4" 36 ""  "PA5" 35 ""  "PA6" 34 ""  "PA7" 33 ""
    "PB0" 1 ""  "PB1" 2 ""  "PB2" 3 ""  "PB3" 4 ""  "PB4" 5 ""  "PB5" 6 ""  "PB6" 7 ""  "PB7" 8 ""
    "PC0" 22 ""  "PC1" 23 ""  "PC2" 24 ""  "PC3" 25 ""  "PC4" 26 ""  "PC5" 27 ""  "PC6" 28 ""  "PC7" 29 ""
    "PD0" 14 "RXD0"  "PD1" 15 "TXD0"  "PD2" 16 "RXD1"  "PD3" 17 "TXD1"  "PD4" 18 ""  "PD5" 19 ""  "PD6" 20 ""  "PD7" 21 ""
    "RESET" 9 "RESET"
};

/// Pins of the first ATmega644, where PD2 and PD3 are no serial line.
const PINS_644: [PinDef; PINS.len()] = {
    let mut pins = [PINS[0]; PINS.len()];
    pins.copy_from_slice(PINS);
    (pins[26].note, pins[27].note) = ("", "");
    pins
};

/// Packages (pin configurations), in the order ports A, B, C, D, reset.
#[rustfmt::skip]
const PACKAGES: &[ChipPackage] = &[
    ChipPackage { name: "DIP40", pins: &dip::<{ PINS.len() }>(PINS) },
    ChipPackage { name: "TQFP44", pins: &[
        37, 36, 35, 34, 33, 32, 31, 30,  40, 41, 42, 43, 44, 1, 2, 3,  19, 20, 21, 22, 23, 24, 25, 26,
        9, 10, 11, 12, 13, 14, 15, 16,  4,
    ] },
];

/// Pin of each line of a unit (alternate port functions), without the pin change inputs. The last four rows
/// are those of timer 3, the three before them those of USART 1.
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::T,    8), (unit_index::TIMER,     AvrLine::OcA, 11), (unit_index::TIMER,     AvrLine::OcB, 12),
    (unit_index::TIMER + 1, AvrLine::T,    9), (unit_index::TIMER + 1, AvrLine::Icp, 30), (unit_index::TIMER + 1, AvrLine::OcA, 29),
    (unit_index::TIMER + 1, AvrLine::OcB, 28), (unit_index::TIMER + 2, AvrLine::OcA, 31), (unit_index::TIMER + 2, AvrLine::OcB, 30),
    (unit_index::USART,     AvrLine::Rxd, 24), (unit_index::USART,     AvrLine::Txd, 25), (unit_index::USART,     AvrLine::Xck,  8),
    (unit_index::SPI,       AvrLine::Ss,  12), (unit_index::SPI,       AvrLine::Mosi, 13), (unit_index::SPI,      AvrLine::Miso, 14),
    (unit_index::SPI,       AvrLine::Sck, 15), (unit_index::TWI,       AvrLine::Scl, 16), (unit_index::TWI,       AvrLine::Sda, 17),
    (unit_index::EXTERNAL,  AvrLine::Int(0), 26), (unit_index::EXTERNAL, AvrLine::Int(1), 27), (unit_index::EXTERNAL, AvrLine::Int(2), 10),
    (unit_index::USART + 1, AvrLine::Rxd, 26), (unit_index::USART + 1, AvrLine::Txd, 27), (unit_index::USART + 1, AvrLine::Xck, 28),
    (unit_index::TIMER + 3, AvrLine::T,   24), (unit_index::TIMER + 3, AvrLine::Icp, 13), (unit_index::TIMER + 3, AvrLine::OcA, 14),
    (unit_index::TIMER + 3, AvrLine::OcB, 15),
];

/// Pin and number of each pin change input: PCINT0 to 7 on port A, 8 to 15 on port B, 16 to 23 on port C, 24
/// to 31 on port D.
const PIN_CHANGES: &[(PinId, u8)] = &{
    let mut inputs = [(0, 0); 32];
    let mut n = 0;
    while n < inputs.len() {
        inputs[n] = (n as PinId, n as u8);
        n += 1;
    }
    inputs
};

/// Interrupt vectors; the position is the vector number, RESET is 0. The last four are those of timer 3, the
/// three before them those of USART 1.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "INT2", "PCINT0", "PCINT1", "PCINT2", "PCINT3", "WDT", "TIMER2_COMPA", "TIMER2_COMPB", "TIMER2_OVF",
    "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMPA", "TIMER0_COMPB", "TIMER0_OVF", "SPI_STC",
    "USART0_RX", "USART0_UDRE", "USART0_TX", "ANALOG_COMP", "ADC", "EE_READY", "TWI", "SPM_READY",
    "USART1_RX", "USART1_UDRE", "USART1_TX", "TIMER3_CAPT", "TIMER3_COMPA", "TIMER3_COMPB", "TIMER3_OVF",
];

/// Sources of the interrupts: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::EXTERNAL, 2), (unit_index::EXTERNAL, 3), (unit_index::EXTERNAL, 4),
    (unit_index::EXTERNAL, 5), (unit_index::EXTERNAL, 6), (unit_index::WATCHDOG, 0),
    (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 1), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3),
    (unit_index::TIMER, 0), (unit_index::TIMER, 1), (unit_index::TIMER, 2), (unit_index::SPI, 0),
    (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2), (unit_index::COMPARATOR, 0), (unit_index::ADC, 0),
    (unit_index::EEPROM, 0), (unit_index::TWI, 0), (unit_index::SPM, 0),
    (unit_index::USART + 1, 0), (unit_index::USART + 1, 1), (unit_index::USART + 1, 2),
    (unit_index::TIMER + 3, 0), (unit_index::TIMER + 3, 1), (unit_index::TIMER + 3, 2), (unit_index::TIMER + 3, 3),
];

/// Bits of PRR0 and, from 8 on, of PRR1. The last row is that of timer 3, the one before it that of USART 1.
#[rustfmt::skip]
const POWER_REDUCTION: &[(u8, usize)] = &[
    (7, unit_index::TWI), (6, unit_index::TIMER + 2), (5, unit_index::TIMER), (3, unit_index::TIMER + 1),
    (2, unit_index::SPI), (1, unit_index::USART), (0, unit_index::ADC), (4, unit_index::USART + 1), (8, unit_index::TIMER + 3),
];
