//! ATmega64 and ATmega128 (Atmel 2490 and 2467), without the compatibility mode of the fuse M103C.

use crate::chips::{AdcTrigger, FuseField, SplitBit};
use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::{self, *};
use super::SocRegister::*;
use super::bits as b;
use super::classic::{self, assr, mcucsr, tccr, timers};
use super::{AvrPart, ChipMemories, FuseLayout, HeaderNames, dip, named_chip, pins, registers, sites, unit_index};
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

/// Chip data of the ATmega64.
const ATMEGA64: Chip = named_chip!(
    "atmega64",
    "ATmega64: 64 KB flash, 4 KB RAM, 2 KB EEPROM, 64 pins",
    Chip {
        data_sheet: "Atmel 2490",
        regs: REGS_64,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS,
        ..ChipMemories::<0x1_0000, 0x100, 0x1100, 0x800, 3>::CHIP
    }
);

/// Chip data of the ATmega128.
const ATMEGA128: Chip = named_chip!(
    "atmega128",
    "ATmega128: 128 KB flash, 4 KB RAM, 4 KB EEPROM, 64 pins",
    Chip {
        data_sheet: "Atmel 2467",
        regs: REGS_128,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS,
        ..ChipMemories::<0x2_0000, 0x100, 0x1100, 0x1000, 3>::CHIP
    }
);

/// Row of the ATmega128.
pub(super) const PART_128: AvrPart = AvrPart {
    chip: &ATMEGA128,
    // The reset pin takes the bit of PG5, which does not exist.
    ports: &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x1F],
    register_slots: &sites_and(RAMPZ_AT, Own(RAMPZ)),
    peripheral_pins: LINES,
    pin_changes: &[],
    stack_starts_at_ram_end: false,
    pin_writes_toggle: false,
    bit_writes_whole_register: true,
    mcucr: 0x13,
    interrupt_sources: SOURCES,
    timers: &[
        TimerShape { asynchronous: true, taps: TimerShape::OWN_TAPS, ..TimerShape::narrow(1) },
        TimerShape::wide(3),
        TimerShape::narrow(1),
        TimerShape::wide(3),
    ],
    adc_kind: adc::AvrAdcKind::MEGA128,
    analog_pins: &[40, 41, 42, 43, 44, 45, 46, 47],
    comparator_pins: [34, 35],
    adc_triggers: &[],
    eeprom_kind: eeprom::AvrEepromKind::MEGA8,
    spm_kind: spm::SpmKind::MEGA128,
    external_kind: external::ExternalKind::MEGA128,
    watchdog_kind: watchdog::WatchdogKind::MEGA8,
    power_reduction_bits: &[],
    signature: [0x1E, 0x97, 0x02],
    fuses: FuseLayout { wdton: Some(FuseField { byte: 2, bit: 0, bits: 1 }), ..classic::FUSES },
    reset_pin: 53,
    jtag_pins: &[44, 45, 46, 47],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::MUX5, b::FREE_RUNNING, b::COMPARE_0, b::TIMERS, b::WDCE, b::M128],
        fuse_names: [classic::LOW_FUSES, classic::HIGH_FUSES, "- - - - - - FUSE_M103C FUSE_WDTON"],
        factory_fuses: [0xE1, 0x99, 0xFD],
        sleep_modes: 6,
        eeprom_page: 8,
        last_outside: 0xFFFF,
    },
};

/// Row of the ATmega64.
pub(super) const PART_64: AvrPart = AvrPart {
    chip: &ATMEGA64,
    register_slots: &sites_and(
        ADCSRB_AT,
        Split(&[
            SplitBit { bit: 2, slot: Adc(ADCSRB), its_bit: 2 },
            SplitBit { bit: 1, slot: Adc(ADCSRB), its_bit: 1 },
            SplitBit { bit: 0, slot: Adc(ADCSRB), its_bit: 0 },
        ]),
    ),
    adc_kind: adc::AvrAdcKind::MEGA16,
    adc_triggers: TRIGGERS,
    spm_kind: spm::SpmKind::MEGA64,
    signature: [0x1E, 0x96, 0x02],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::MUX5, b::TRIGGERED, b::COMPARE_0, b::TIMERS, b::WDCE, b::M128],
        ..PART_128.names
    },
    ..PART_128
};

/// Address of RAMPZ, which only the ATmega128 has.
const RAMPZ_AT: u16 = 0x5B;
/// Address of ADCSRB, which only the ATmega64 has.
const ADCSRB_AT: u16 = 0x8E;

/// Returns the table of register slots with `site` at the address `at`.
const fn sites_and(at: u16, site: RegisterSlot) -> [RegisterSlot; 0x100] {
    let mut all = sites(SITES, 0x100);
    all[at as usize] = site;
    all
}

/// Returns the list of registers with the register `name` at `addr` in addition.
const fn regs_and(name: &'static str, addr: u16) -> [NamedAddress; REGS.len() + 1] {
    let mut all = [NamedAddress { name, addr }; REGS.len() + 1];
    let mut i = 0;
    while i < REGS.len() {
        all[i] = REGS[i];
        i += 1;
    }
    all
}
const REGS_64: &[NamedAddress] = &regs_and("ADCSRB", ADCSRB_AT);
const REGS_128: &[NamedAddress] = &regs_and("RAMPZ", RAMPZ_AT);

/// UCSRnC, which has one bit of UMSEL (the ATmega328P has two).
macro_rules! ucsrc {
    ($n:literal) => {
        Split(&[
            SplitBit { bit: 6, slot: Usart($n, UCSRC), its_bit: 6 },
            SplitBit { bit: 5, slot: Usart($n, UCSRC), its_bit: 5 },
            SplitBit { bit: 4, slot: Usart($n, UCSRC), its_bit: 4 },
            SplitBit { bit: 3, slot: Usart($n, UCSRC), its_bit: 3 },
            SplitBit { bit: 2, slot: Usart($n, UCSRC), its_bit: 2 },
            SplitBit { bit: 1, slot: Usart($n, UCSRC), its_bit: 1 },
            SplitBit { bit: 0, slot: Usart($n, UCSRC), its_bit: 0 },
        ])
    };
}

/// ETIMSK or ETIFR.
macro_rules! more_timers {
    ($reg:ident) => {
        Split(&[
            SplitBit { bit: 5, slot: Timer(3, $reg), its_bit: 5 },
            SplitBit { bit: 4, slot: Timer(3, $reg), its_bit: 1 },
            SplitBit { bit: 3, slot: Timer(3, $reg), its_bit: 2 },
            SplitBit { bit: 2, slot: Timer(3, $reg), its_bit: 0 },
            SplitBit { bit: 1, slot: Timer(3, $reg), its_bit: 3 },
            SplitBit { bit: 0, slot: Timer(1, $reg), its_bit: 3 },
        ])
    };
}

/// MCUCR. The chip only stores SRE and SRW10.
const MCUCR_BITS: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Kept(0), its_bit: 7 },
    SplitBit { bit: 6, slot: Kept(0), its_bit: 6 },
    SplitBit { bit: 5, slot: Own(SMCR), its_bit: 0 },
    SplitBit { bit: 4, slot: Own(SMCR), its_bit: 2 },
    SplitBit { bit: 3, slot: Own(SMCR), its_bit: 1 },
    SplitBit { bit: 2, slot: Own(SMCR), its_bit: 3 },
    SplitBit { bit: 1, slot: Own(MCUCR), its_bit: 1 },
    SplitBit { bit: 0, slot: Own(MCUCR), its_bit: 0 },
]);

const SFIOR: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Own(GTCCR), its_bit: 7 },
    SplitBit { bit: 3, slot: Adc(ADCSRB), its_bit: 6 },
    SplitBit { bit: 2, slot: Own(MCUCR), its_bit: 4 },
    SplitBit { bit: 1, slot: Own(GTCCR), its_bit: 1 },
    SplitBit { bit: 0, slot: Own(GTCCR), its_bit: 0 },
]);

#[rustfmt::skip]
registers! {
    0x20 "PINF" Port(5, 0);          0x21 "PINE" Port(4, 0);          0x22 "DDRE" Port(4, 1);
    0x23 "PORTE" Port(4, 2);         0x24 "ADCL" Adc(ADCL);           0x25 "ADCH" Adc(ADCH);
    0x26 "ADCSRA" / "ADCSR" Adc(ADCSRA); 0x27 "ADMUX" Adc(ADMUX);     0x28 "ACSR" Comparator(ACSR);
    0x29 "UBRR0L" Usart(0, UBRRL);   0x2A "UCSR0B" Usart(0, UCSRB);   0x2B "UCSR0A" Usart(0, UCSRA);
    0x2C "UDR0" Usart(0, UDR);       0x2D "SPCR" Spi(SPCR);           0x2E "SPSR" Spi(SPSR);
    0x2F "SPDR" Spi(SPDR);           0x30 "PIND" Port(3, 0);          0x31 "DDRD" Port(3, 1);
    0x32 "PORTD" Port(3, 2);         0x33 "PINC" Port(2, 0);          0x34 "DDRC" Port(2, 1);
    0x35 "PORTC" Port(2, 2);         0x36 "PINB" Port(1, 0);          0x37 "DDRB" Port(1, 1);
    0x38 "PORTB" Port(1, 2);         0x39 "PINA" Port(0, 0);          0x3A "DDRA" Port(0, 1);
    0x3B "PORTA" Port(0, 2);         0x3C "EECR" Eeprom(EECR);        0x3D "EEDR" Eeprom(EEDR);
    0x3E "EEARL" Eeprom(EEARL);      0x3F "EEARH" Eeprom(EEARH);      0x40 "SFIOR" SFIOR;
    0x41 "WDTCR" Watchdog(WDTCSR);   0x42 "OCDR" Reserved;            0x43 "OCR2" Timer(2, OCRAL);
    0x44 "TCNT2" Timer(2, TCNTL);    0x45 "TCCR2" tccr!(2);           0x46 "ICR1L" Timer(1, ICRL);
    0x47 "ICR1H" Timer(1, ICRH);     0x48 "OCR1BL" Timer(1, OCRBL);   0x49 "OCR1BH" Timer(1, OCRBH);
    0x4A "OCR1AL" Timer(1, OCRAL);   0x4B "OCR1AH" Timer(1, OCRAH);   0x4C "TCNT1L" Timer(1, TCNTL);
    0x4D "TCNT1H" Timer(1, TCNTH);   0x4E "TCCR1B" Timer(1, TCCRB);   0x4F "TCCR1A" Timer(1, TCCRA);
    0x50 "ASSR" assr!(0);            0x51 "OCR0" Timer(0, OCRAL);     0x52 "TCNT0" Timer(0, TCNTL);
    0x53 "TCCR0" tccr!(0);           0x54 "MCUCSR" / "MCUSR" mcucsr!(SplitBit { bit: 7, slot: Kept(0), its_bit: 0 });
    0x55 "MCUCR" MCUCR_BITS;         0x56 "TIFR" timers!(TIFR);       0x57 "TIMSK" timers!(TIMSK);
    0x58 "EIFR" External(EIFR);      0x59 "EIMSK" External(EIMSK);    0x5A "EICRB" External(EICRB);
    0x5C "XDIV" Kept(1);             0x5D "SPL" Core;                 0x5E "SPH" Core;
    0x5F "SREG" Core;                0x61 "DDRF" Port(5, 1);          0x62 "PORTF" Port(5, 2);
    0x63 "PING" Port(6, 0);          0x64 "DDRG" Port(6, 1);          0x65 "PORTG" Port(6, 2);
    0x68 "SPMCSR" / "SPMCR" Spm(SPMCSR); 0x6A "EICRA" External(EICRA);    0x6C "XMCRB" Kept(2);
    0x6D "XMCRA" Kept(3);            0x6F "OSCCAL" Own(OSCCAL);       0x70 "TWBR" Twi(TWBR);
    0x71 "TWSR" Twi(TWSR);           0x72 "TWAR" Twi(TWAR);           0x73 "TWDR" Twi(TWDR);
    0x74 "TWCR" Twi(TWCR);           0x78 "OCR1CL" Timer(1, OCRCL);   0x79 "OCR1CH" Timer(1, OCRCH);
    0x7A "TCCR1C" Timer(1, TCCRC);   0x7C "ETIFR" more_timers!(TIFR); 0x7D "ETIMSK" more_timers!(TIMSK);
    0x80 "ICR3L" Timer(3, ICRL);     0x81 "ICR3H" Timer(3, ICRH);     0x82 "OCR3CL" Timer(3, OCRCL);
    0x83 "OCR3CH" Timer(3, OCRCH);   0x84 "OCR3BL" Timer(3, OCRBL);   0x85 "OCR3BH" Timer(3, OCRBH);
    0x86 "OCR3AL" Timer(3, OCRAL);   0x87 "OCR3AH" Timer(3, OCRAH);   0x88 "TCNT3L" Timer(3, TCNTL);
    0x89 "TCNT3H" Timer(3, TCNTH);   0x8A "TCCR3B" Timer(3, TCCRB);   0x8B "TCCR3A" Timer(3, TCCRA);
    0x8C "TCCR3C" Timer(3, TCCRC);   0x90 "UBRR0H" Usart(0, UBRRH);   0x95 "UCSR0C" ucsrc!(0);
    0x98 "UBRR1H" Usart(1, UBRRH);   0x99 "UBRR1L" Usart(1, UBRRL);   0x9A "UCSR1B" Usart(1, UCSRB);
    0x9B "UCSR1A" Usart(1, UCSRA);   0x9C "UDR1" Usart(1, UDR);       0x9D "UCSR1C" ucsrc!(1);
}

/// Pins, eight per port: the pin identity is 8 times the port (A to G) plus the bit. Numbers are those of the
/// 64-pin flat package (pin configurations).
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PA0" 51 ""  "PA1" 50 ""  "PA2" 49 ""  "PA3" 48 ""  "PA4" 47 ""  "PA5" 46 ""  "PA6" 45 ""  "PA7" 44 ""
    "PB0" 10 ""  "PB1" 11 ""  "PB2" 12 ""  "PB3" 13 ""  "PB4" 14 ""  "PB5" 15 ""  "PB6" 16 ""  "PB7" 17 ""
    "PC0" 35 ""  "PC1" 36 ""  "PC2" 37 ""  "PC3" 38 ""  "PC4" 39 ""  "PC5" 40 ""  "PC6" 41 ""  "PC7" 42 ""
    "PD0" 25 ""  "PD1" 26 ""  "PD2" 27 "RXD1"  "PD3" 28 "TXD1"  "PD4" 29 ""  "PD5" 30 ""  "PD6" 31 ""  "PD7" 32 ""
    "PE0" 2 "RXD0"  "PE1" 3 "TXD0"  "PE2" 4 ""  "PE3" 5 ""  "PE4" 6 ""  "PE5" 7 ""  "PE6" 8 ""  "PE7" 9 ""
    "PF0" 61 ""  "PF1" 60 ""  "PF2" 59 ""  "PF3" 58 ""  "PF4" 57 ""  "PF5" 56 ""  "PF6" 55 ""  "PF7" 54 ""
    "PG0" 33 ""  "PG1" 34 ""  "PG2" 43 ""  "PG3" 18 ""  "PG4" 19 ""  "RESET" 20 "RESET"
};

/// Packages (pin configurations).
const PACKAGES: &[ChipPackage] = &[ChipPackage { name: "TQFP64", pins: &dip::<{ PINS.len() }>(PINS) }];

/// Pin of each line of a unit (alternate port functions).
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::OcA, 12), (unit_index::TIMER + 1, AvrLine::T,   30), (unit_index::TIMER + 1, AvrLine::Icp, 28),
    (unit_index::TIMER + 1, AvrLine::OcA, 13), (unit_index::TIMER + 1, AvrLine::OcB, 14), (unit_index::TIMER + 1, AvrLine::OcC, 15),
    (unit_index::TIMER + 2, AvrLine::T,   31), (unit_index::TIMER + 2, AvrLine::OcA, 15), (unit_index::TIMER + 3, AvrLine::T,   38),
    (unit_index::TIMER + 3, AvrLine::Icp, 39), (unit_index::TIMER + 3, AvrLine::OcA, 35), (unit_index::TIMER + 3, AvrLine::OcB, 36),
    (unit_index::TIMER + 3, AvrLine::OcC, 37), (unit_index::USART,     AvrLine::Rxd, 32), (unit_index::USART,     AvrLine::Txd, 33),
    (unit_index::USART,     AvrLine::Xck, 34), (unit_index::USART + 1, AvrLine::Rxd, 26), (unit_index::USART + 1, AvrLine::Txd, 27),
    (unit_index::USART + 1, AvrLine::Xck, 29), (unit_index::SPI,       AvrLine::Ss,   8), (unit_index::SPI,       AvrLine::Sck,  9),
    (unit_index::SPI,       AvrLine::Mosi, 10), (unit_index::SPI,      AvrLine::Miso, 11), (unit_index::TWI,      AvrLine::Scl, 24),
    (unit_index::TWI,       AvrLine::Sda, 25), (unit_index::EXTERNAL,  AvrLine::Int(0), 24), (unit_index::EXTERNAL, AvrLine::Int(1), 25),
    (unit_index::EXTERNAL,  AvrLine::Int(2), 26), (unit_index::EXTERNAL, AvrLine::Int(3), 27), (unit_index::EXTERNAL, AvrLine::Int(4), 36),
    (unit_index::EXTERNAL,  AvrLine::Int(5), 37), (unit_index::EXTERNAL, AvrLine::Int(6), 38), (unit_index::EXTERNAL, AvrLine::Int(7), 39),
];

/// Interrupt vectors; the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "INT2", "INT3", "INT4", "INT5", "INT6", "INT7", "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT",
    "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMP", "TIMER0_OVF", "SPI_STC", "USART0_RX", "USART0_UDRE", "USART0_TX",
    "ADC", "EE_READY", "ANALOG_COMP", "TIMER1_COMPC", "TIMER3_CAPT", "TIMER3_COMPA", "TIMER3_COMPB", "TIMER3_COMPC", "TIMER3_OVF",
    "USART1_RX", "USART1_UDRE", "USART1_TX", "TWI", "SPM_READY",
];

/// Sources of the interrupts: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::EXTERNAL, 2), (unit_index::EXTERNAL, 3),
    (unit_index::EXTERNAL, 4), (unit_index::EXTERNAL, 5), (unit_index::EXTERNAL, 6), (unit_index::EXTERNAL, 7),
    (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 2), (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 4),
    (unit_index::TIMER, 0), (unit_index::TIMER, 2), (unit_index::SPI, 0), (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2),
    (unit_index::ADC, 0), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0), (unit_index::TIMER + 1, 3),
    (unit_index::TIMER + 3, 0), (unit_index::TIMER + 3, 1), (unit_index::TIMER + 3, 2), (unit_index::TIMER + 3, 3), (unit_index::TIMER + 3, 4),
    (unit_index::USART + 1, 0), (unit_index::USART + 1, 1), (unit_index::USART + 1, 2), (unit_index::TWI, 0), (unit_index::SPM, 0),
];

/// Trigger sources of the converter of the ATmega64, from ADTS 1 on: unit and interrupt number in it.
#[rustfmt::skip]
const TRIGGERS: &[AdcTrigger] = &[
    AdcTrigger { unit: unit_index::COMPARATOR, interrupt: 0 }, AdcTrigger { unit: unit_index::EXTERNAL, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 0 }, AdcTrigger { unit: unit_index::TIMER, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 2 }, AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 4 },
    AdcTrigger { unit: unit_index::TIMER + 1, interrupt: 0 },
];
