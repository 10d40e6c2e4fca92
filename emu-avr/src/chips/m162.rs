//! ATmega162 (Atmel 2513), without the compatibility mode of the fuse M161C.

use emu_core::chip::{Chip, Package, PinDef, Reg};
use emu_core::pins::PinId;

use super::Own::*;
use super::Site::{self, *};
use super::bits as b;
use super::fuses::start_up_162;
use super::old::{self, assr, general, mcucsr, tccr, tccra};
use super::{Fuses, Memories, Names, Part, dip, named, pins, registers, sites, unit};
use crate::periph::Line;
use crate::periph::comparator::Reg::*;
use crate::periph::eeprom::Reg::*;
use crate::periph::external::Reg::*;
use crate::periph::guard::Reg::*;
use crate::periph::spi::Reg::*;
use crate::periph::spm::Reg::*;
use crate::periph::timers::Reg::*;
use crate::periph::timers::{Shape, Tap};
use crate::periph::usart::Reg::*;
use crate::periph::{adc, eeprom, external, guard, spm};

/// ATmega162.
const ATMEGA162: Chip = named!(
    "atmega162",
    "ATmega162: 16 KB flash, 1 KB RAM, 512 bytes EEPROM, 40 pins",
    Chip {
        source: "Atmel 2513",
        regs: REGS,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS,
        ..Memories::<0x4000, 0x100, 0x500, 0x200, 3>::CHIP
    }
);

/// Timer 3 has no pin T; clock select 6 and 7 divide by 16 and 32.
const TIMER_3: Shape = Shape {
    taps: [Tap::Off, Tap::Div(1), Tap::Div(8), Tap::Div(64), Tap::Div(256), Tap::Div(1024), Tap::Div(16), Tap::Div(32)],
    ..Shape::wide(2)
};

/// The row of the ATmega162.
pub(super) const PART_162: Part = Part {
    chip: &ATMEGA162,
    // The reset pin stands in the place of PE3.
    ports: &[0xFF, 0xFF, 0xFF, 0xFF, 0x07],
    sites: &sites(SITES, 0x100),
    lines: LINES,
    pin_changes: PIN_CHANGES,
    stack_at_end: false,
    toggles: false,
    whole_registers: true,
    mcucr: 0x13,
    vectors: SOURCES,
    timers: &[Shape::narrow(1), Shape::wide(2), Shape::crystal(1), TIMER_3],
    // There is none; its reference is the comparator's.
    adc: adc::Kind { bandgap_mv: 1_100, ..adc::Kind::MEGA8 },
    analog: &[],
    ain: [10, 11],
    triggers: &[],
    eeprom: eeprom::Kind::MEGA8,
    spm: spm::Kind::MEGA16,
    external: external::Kind::MEGA162,
    watchdog: guard::Kind::MEGA8,
    prr: &[],
    signature: [0x1E, 0x94, 0x04],
    fuses: Fuses {
        assumed: [0xFF, 0xD9, 0xFF],
        ckdiv8: Some((0, 7, 1)),
        start_up: start_up_162,
        wdton: Some((1, 4, 1)),
        bodlevel: (2, 1, 3),
        bod_mv: &[0, 0, 0, 2_300, 4_300, 2_700, 1_800, 0],
        ..old::FUSES
    },
    reset: 35,
    names: Names {
        bits: &[b::ANY, b::OLD, b::COMPARE_0, b::TIMERS_1_2, b::WDCE, b::M162],
        fuses: [
            "FUSE_CKDIV8 FUSE_CKOUT FUSE_SUT1 FUSE_SUT0 FUSE_CKSEL3 FUSE_CKSEL2 FUSE_CKSEL1 FUSE_CKSEL0",
            "FUSE_OCDEN FUSE_JTAGEN FUSE_SPIEN FUSE_WDTON FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST",
            "- - - FUSE_M161C FUSE_BODLEVEL2 FUSE_BODLEVEL1 FUSE_BODLEVEL0 -",
        ],
        delivered: [0x62, 0x99, 0xFF],
        // The bits that choose a mode stand in three registers, so no byte means a mode.
        sleep: 0,
        eeprom_page: 4,
        last_outside: 0xFFFF,
    },
};

/// TIMSK or TIFR.
macro_rules! timers {
    ($reg:ident) => {
        Split(&[
            (7, Timer(1, $reg), 0),
            (6, Timer(1, $reg), 1),
            (5, Timer(1, $reg), 2),
            (4, Timer(2, $reg), 1),
            (3, Timer(1, $reg), 5),
            (2, Timer(2, $reg), 0),
            (1, Timer(0, $reg), 0),
            (0, Timer(0, $reg), 1),
        ])
    };
}

/// ETIMSK or ETIFR.
macro_rules! more_timers {
    ($reg:ident) => {
        Split(&[(5, Timer(3, $reg), 5), (4, Timer(3, $reg), 1), (3, Timer(3, $reg), 2), (2, Timer(3, $reg), 0)])
    };
}

/// SRE and SRW10 are only kept, as all bits for external memory are.
const MCUCR_BITS: Site = Split(&[
    (7, Kept(0), 7),
    (6, Kept(0), 6),
    (5, Own(SMCR), 0),
    (4, Own(SMCR), 2),
    (3, External(EICRA), 3),
    (2, External(EICRA), 2),
    (1, External(EICRA), 1),
    (0, External(EICRA), 0),
]);

const EMCUCR: Site = Split(&[
    (7, Own(SMCR), 1),
    (6, Kept(1), 6),
    (5, Kept(1), 5),
    (4, Kept(1), 4),
    (3, Kept(1), 3),
    (2, Kept(1), 2),
    (1, Kept(1), 1),
    (0, External(EICRA), 4),
]);

const SFIOR: Site = Split(&[
    (7, Own(GTCCR), 7),
    (6, Kept(2), 6),
    (5, Kept(2), 5),
    (4, Kept(2), 4),
    (3, Kept(2), 3),
    (2, Own(MCUCR), 4),
    (1, Own(GTCCR), 1),
    (0, Own(GTCCR), 0),
]);

#[rustfmt::skip]
registers! {
    0x20 "UBRR1L" Usart(1, UBRRL);   0x21 "UCSR1B" Usart(1, UCSRB);   0x22 "UCSR1A" Usart(1, UCSRA);
    0x23 "UDR1" Usart(1, UDR);       0x24 "OSCCAL" Own(OSCCAL);       0x24 "OCDR" Own(OSCCAL);
    0x25 "PINE" Port(4, 0);          0x26 "DDRE" Port(4, 1);          0x27 "PORTE" Port(4, 2);
    0x28 "ACSR" Comparator(ACSR);    0x29 "UBRR0L" Usart(0, UBRRL);   0x2A "UCSR0B" Usart(0, UCSRB);
    0x2B "UCSR0A" Usart(0, UCSRA);   0x2C "UDR0" Usart(0, UDR);       0x2D "SPCR" Spi(SPCR);
    0x2E "SPSR" Spi(SPSR);           0x2F "SPDR" Spi(SPDR);           0x30 "PIND" Port(3, 0);
    0x31 "DDRD" Port(3, 1);          0x32 "PORTD" Port(3, 2);         0x33 "PINC" Port(2, 0);
    0x34 "DDRC" Port(2, 1);          0x35 "PORTC" Port(2, 2);         0x36 "PINB" Port(1, 0);
    0x37 "DDRB" Port(1, 1);          0x38 "PORTB" Port(1, 2);         0x39 "PINA" Port(0, 0);
    0x3A "DDRA" Port(0, 1);          0x3B "PORTA" Port(0, 2);         0x3C "EECR" Eeprom(EECR);
    0x3D "EEDR" Eeprom(EEDR);        0x3E "EEARL" Eeprom(EEARL);      0x3F "EEARH" Eeprom(EEARH);
    0x40 "UBRR0H" Ursel(0);          0x40 "UCSR0C" Ursel(0);          0x41 "WDTCR" Watchdog(WDTCSR);
    0x42 "OCR2" Timer(2, OCRAL);     0x43 "TCNT2" Timer(2, TCNTL);    0x44 "ICR1L" Timer(1, ICRL);
    0x45 "ICR1H" Timer(1, ICRH);     0x46 "ASSR" assr!(2);            0x47 "TCCR2" tccr!(2);
    0x48 "OCR1BL" Timer(1, OCRBL);   0x49 "OCR1BH" Timer(1, OCRBH);   0x4A "OCR1AL" Timer(1, OCRAL);
    0x4B "OCR1AH" Timer(1, OCRAH);   0x4C "TCNT1L" Timer(1, TCNTL);   0x4D "TCNT1H" Timer(1, TCNTH);
    0x4E "TCCR1B" Timer(1, TCCRB);   0x4F "TCCR1A" tccra!(1);         0x50 "SFIOR" SFIOR;
    0x51 "OCR0" Timer(0, OCRAL);     0x52 "TCNT0" Timer(0, TCNTL);    0x53 "TCCR0" tccr!(0);
    0x54 "MCUCSR" mcucsr!((7, Kept(0), 0), (5, Own(SMCR), 3));        0x55 "MCUCR" MCUCR_BITS;
    0x56 "EMCUCR" EMCUCR;            0x57 "SPMCR" Spm(SPMCSR);        0x58 "TIFR" timers!(TIFR);
    0x59 "TIMSK" timers!(TIMSK);
    0x5A "GIFR" general!(EIFR, (5, External(EIFR), 2), (4, External(PCIFR), 1), (3, External(PCIFR), 0));
    0x5B "GICR" general!(EIMSK, (5, External(EIMSK), 2), (4, External(PCICR), 1), (3, External(PCICR), 0),
                         (1, Own(MCUCR), 1), (0, Own(MCUCR), 0));
    0x5C "UBRR1H" Ursel(1);          0x5C "UCSR1C" Ursel(1);          0x5D "SPL" Core;
    0x5E "SPH" Core;                 0x5F "SREG" Core;                0x61 "CLKPR" Own(CLKPR);
    0x6B "PCMSK0" External(PCMSK0);  0x6C "PCMSK1" External(PCMSK1);  0x7C "ETIFR" more_timers!(TIFR);
    0x7D "ETIMSK" more_timers!(TIMSK); 0x80 "ICR3L" Timer(3, ICRL);   0x81 "ICR3H" Timer(3, ICRH);
    0x84 "OCR3BL" Timer(3, OCRBL);   0x85 "OCR3BH" Timer(3, OCRBH);   0x86 "OCR3AL" Timer(3, OCRAL);
    0x87 "OCR3AH" Timer(3, OCRAH);   0x88 "TCNT3L" Timer(3, TCNTL);   0x89 "TCNT3H" Timer(3, TCNTH);
    0x8A "TCCR3B" Timer(3, TCCRB);   0x8B "TCCR3A" tccra!(3);
}

/// Pins (pin configurations), 8 to a port: pin identity is port (A to E) times 8 plus bit.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PA0" 39 ""  "PA1" 38 ""  "PA2" 37 ""  "PA3" 36 ""  "PA4" 35 ""  "PA5" 34 ""  "PA6" 33 ""  "PA7" 32 ""
    "PB0" 1 ""  "PB1" 2 ""  "PB2" 3 "RXD1"  "PB3" 4 "TXD1"  "PB4" 5 ""  "PB5" 6 ""  "PB6" 7 ""  "PB7" 8 ""
    "PC0" 21 ""  "PC1" 22 ""  "PC2" 23 ""  "PC3" 24 ""  "PC4" 25 ""  "PC5" 26 ""  "PC6" 27 ""  "PC7" 28 ""
    "PD0" 10 "RXD0"  "PD1" 11 "TXD0"  "PD2" 12 ""  "PD3" 13 ""  "PD4" 14 ""  "PD5" 15 ""  "PD6" 16 ""  "PD7" 17 ""
    "PE0" 31 ""  "PE1" 30 ""  "PE2" 29 ""  "RESET" 9 "RESET"
};

/// Package (pin configurations).
const PACKAGES: &[Package] = &[Package { name: "DIP40", pins: &dip::<{ PINS.len() }>(PINS) }];

/// Alternate functions (alternate port functions).
#[rustfmt::skip]
const LINES: &[(usize, Line, PinId)] = &[
    (unit::TIMER,     Line::T,    8), (unit::TIMER,     Line::OcA,  8), (unit::TIMER + 1, Line::T,    9),
    (unit::TIMER + 1, Line::Icp, 32), (unit::TIMER + 1, Line::OcA, 29), (unit::TIMER + 1, Line::OcB, 34),
    (unit::TIMER + 2, Line::OcA,  9), (unit::TIMER + 3, Line::Icp, 27), (unit::TIMER + 3, Line::OcA, 28),
    (unit::TIMER + 3, Line::OcB, 12), (unit::USART,     Line::Rxd, 24), (unit::USART,     Line::Txd, 25),
    (unit::USART,     Line::Xck, 28), (unit::USART + 1, Line::Rxd, 10), (unit::USART + 1, Line::Txd, 11),
    (unit::USART + 1, Line::Xck, 26), (unit::SPI,       Line::Ss,  12), (unit::SPI,       Line::Mosi, 13),
    (unit::SPI,       Line::Miso, 14), (unit::SPI,      Line::Sck, 15), (unit::EXTERNAL,  Line::Int(0), 26),
    (unit::EXTERNAL,  Line::Int(1), 27), (unit::EXTERNAL, Line::Int(2), 32),
];

/// Pin change inputs: PCINT0 to 7 on port A, 8 to 15 on port C.
#[rustfmt::skip]
const PIN_CHANGES: &[(PinId, u8)] = &[
    (0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (7, 7),
    (16, 8), (17, 9), (18, 10), (19, 11), (20, 12), (21, 13), (22, 14), (23, 15),
];

/// Interrupt vectors, number = position, RESET is 0.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "INT2", "PCINT0", "PCINT1", "TIMER3_CAPT", "TIMER3_COMPA", "TIMER3_COMPB", "TIMER3_OVF",
    "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMP", "TIMER0_OVF",
    "SPI_STC", "USART0_RXC", "USART1_RXC", "USART0_UDRE", "USART1_UDRE", "USART0_TXC", "USART1_TXC", "EE_RDY", "ANA_COMP",
    "SPM_RDY",
];

/// What asks for them.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit::EXTERNAL, 0), (unit::EXTERNAL, 1), (unit::EXTERNAL, 2), (unit::EXTERNAL, 3), (unit::EXTERNAL, 4),
    (unit::TIMER + 3, 0), (unit::TIMER + 3, 1), (unit::TIMER + 3, 2), (unit::TIMER + 3, 3), (unit::TIMER + 2, 0), (unit::TIMER + 2, 2),
    (unit::TIMER + 1, 0), (unit::TIMER + 1, 1), (unit::TIMER + 1, 2), (unit::TIMER + 1, 3), (unit::TIMER, 0), (unit::TIMER, 2),
    (unit::SPI, 0), (unit::USART, 0), (unit::USART + 1, 0), (unit::USART, 1), (unit::USART + 1, 1), (unit::USART, 2),
    (unit::USART + 1, 2), (unit::EEPROM, 0), (unit::COMPARATOR, 0), (unit::SPM, 0),
];
