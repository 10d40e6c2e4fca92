//! ATmega162 (Atmel 2513), without the compatibility mode of the fuse M161C.

use crate::chips::{FuseField, SplitBit};
use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::{self, *};
use super::SocRegister::*;
use super::bits as b;
use super::classic::{self, assr, general, mcucsr, tccr, tccra};
use super::fuses::start_up_162;
use super::{AvrPart, ChipMemories, FuseLayout, HeaderNames, dip, named_chip, pins, registers, sites, unit_index};
use crate::periph::AvrLine;
use crate::periph::comparator::ComparatorRegister::*;
use crate::periph::eeprom::EepromRegister::*;
use crate::periph::external::ExternalRegister::*;
use crate::periph::spi::SpiRegister::*;
use crate::periph::spm::SpmRegister::*;
use crate::periph::timers::TimerRegister::*;
use crate::periph::timers::{ClockTap, TimerShape};
use crate::periph::usart::UsartRegister::*;
use crate::periph::watchdog::WatchdogRegister::*;
use crate::periph::{adc, eeprom, external, spm, watchdog};

/// Chip data of the ATmega162.
const ATMEGA162: Chip = named_chip!(
    "atmega162",
    "ATmega162: 16 KB flash, 1 KB RAM, 512 bytes EEPROM, 40 pins",
    Chip {
        data_sheet: "Atmel 2513",
        regs: REGS,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS,
        ..ChipMemories::<0x4000, 0x100, 0x500, 0x200, 3>::CHIP
    }
);

/// Timer 3, which has no pin T: clock select 6 and 7 divide by 16 and 32.
const TIMER_3: TimerShape = TimerShape {
    taps: [
        ClockTap::Off,
        ClockTap::Div(1),
        ClockTap::Div(8),
        ClockTap::Div(64),
        ClockTap::Div(256),
        ClockTap::Div(1024),
        ClockTap::Div(16),
        ClockTap::Div(32),
    ],
    ..TimerShape::wide(2)
};

/// Row of the ATmega162.
pub(super) const PART_162: AvrPart = AvrPart {
    chip: &ATMEGA162,
    // The reset pin takes the bit of PE3, which does not exist.
    ports: &[0xFF, 0xFF, 0xFF, 0xFF, 0x07],
    register_slots: &sites(SITES, 0x100),
    peripheral_pins: LINES,
    pin_changes: PIN_CHANGES,
    stack_starts_at_ram_end: false,
    pin_writes_toggle: false,
    bit_writes_whole_register: true,
    mcucr: 0x13,
    interrupt_sources: SOURCES,
    timers: &[TimerShape::narrow(1), TimerShape::wide(2), TimerShape::crystal(1), TIMER_3],
    // The chip has no converter; only the reference voltage is used, by the comparator.
    adc_kind: adc::AvrAdcKind { bandgap_mv: 1_100, ..adc::AvrAdcKind::MEGA8 },
    analog_pins: &[],
    comparator_pins: [10, 11],
    adc_triggers: &[],
    eeprom_kind: eeprom::AvrEepromKind::MEGA8,
    spm_kind: spm::SpmKind::MEGA16,
    external_kind: external::ExternalKind::MEGA162,
    watchdog_kind: watchdog::WatchdogKind::MEGA8,
    power_reduction_bits: &[],
    signature: [0x1E, 0x94, 0x04],
    fuses: FuseLayout {
        default_bytes: [0xFF, 0xD9, 0xFF],
        ckdiv8: Some(FuseField { byte: 0, bit: 7, bits: 1 }),
        start_up: start_up_162,
        wdton: Some(FuseField { byte: 1, bit: 4, bits: 1 }),
        bodlevel: FuseField { byte: 2, bit: 1, bits: 3 },
        bod_mv: &[0, 0, 0, 2_300, 4_300, 2_700, 1_800, 0],
        ..classic::FUSES
    },
    reset_pin: 35,
    jtag_pins: &[20, 21, 22, 23],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::COMPARE_0, b::TIMERS_1_2, b::WDCE, b::M162],
        fuse_names: [
            LOW_FUSES,
            "FUSE_OCDEN FUSE_JTAGEN FUSE_SPIEN FUSE_WDTON FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST",
            "- - - FUSE_M161C FUSE_BODLEVEL2 FUSE_BODLEVEL1 FUSE_BODLEVEL0 -",
        ],
        factory_fuses: [0x62, 0x99, 0xFF],
        // The bits that select a sleep mode are in three registers, so no single byte selects a mode.
        sleep_modes: 0,
        eeprom_page: 4,
        last_outside: 0xFFFF,
    },
};

/// Names of the fuses in the low byte, from bit 7 to bit 0.
pub(super) const LOW_FUSES: &str =
    "FUSE_CKDIV8 FUSE_CKOUT FUSE_SUT1 FUSE_SUT0 FUSE_CKSEL3 FUSE_CKSEL2 FUSE_CKSEL1 FUSE_CKSEL0";

/// TIMSK or TIFR.
macro_rules! timers {
    ($reg:ident) => {
        Split(&[
            SplitBit { bit: 7, slot: Timer(1, $reg), its_bit: 0 },
            SplitBit { bit: 6, slot: Timer(1, $reg), its_bit: 1 },
            SplitBit { bit: 5, slot: Timer(1, $reg), its_bit: 2 },
            SplitBit { bit: 4, slot: Timer(2, $reg), its_bit: 1 },
            SplitBit { bit: 3, slot: Timer(1, $reg), its_bit: 5 },
            SplitBit { bit: 2, slot: Timer(2, $reg), its_bit: 0 },
            SplitBit { bit: 1, slot: Timer(0, $reg), its_bit: 0 },
            SplitBit { bit: 0, slot: Timer(0, $reg), its_bit: 1 },
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
        ])
    };
}

/// MCUCR. The chip only stores SRE and SRW10, like all bits of the external memory.
const MCUCR_BITS: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Kept(0), its_bit: 7 },
    SplitBit { bit: 6, slot: Kept(0), its_bit: 6 },
    SplitBit { bit: 5, slot: Own(SMCR), its_bit: 0 },
    SplitBit { bit: 4, slot: Own(SMCR), its_bit: 2 },
    SplitBit { bit: 3, slot: External(EICRA), its_bit: 3 },
    SplitBit { bit: 2, slot: External(EICRA), its_bit: 2 },
    SplitBit { bit: 1, slot: External(EICRA), its_bit: 1 },
    SplitBit { bit: 0, slot: External(EICRA), its_bit: 0 },
]);

const EMCUCR: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Own(SMCR), its_bit: 1 },
    SplitBit { bit: 6, slot: Kept(1), its_bit: 6 },
    SplitBit { bit: 5, slot: Kept(1), its_bit: 5 },
    SplitBit { bit: 4, slot: Kept(1), its_bit: 4 },
    SplitBit { bit: 3, slot: Kept(1), its_bit: 3 },
    SplitBit { bit: 2, slot: Kept(1), its_bit: 2 },
    SplitBit { bit: 1, slot: Kept(1), its_bit: 1 },
    SplitBit { bit: 0, slot: External(EICRA), its_bit: 4 },
]);

const SFIOR: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Own(GTCCR), its_bit: 7 },
    SplitBit { bit: 6, slot: Kept(2), its_bit: 6 },
    SplitBit { bit: 5, slot: Kept(2), its_bit: 5 },
    SplitBit { bit: 4, slot: Kept(2), its_bit: 4 },
    SplitBit { bit: 3, slot: Kept(2), its_bit: 3 },
    SplitBit { bit: 2, slot: Own(MCUCR), its_bit: 4 },
    SplitBit { bit: 1, slot: Own(GTCCR), its_bit: 1 },
    SplitBit { bit: 0, slot: Own(GTCCR), its_bit: 0 },
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
    0x54 "MCUCSR" mcucsr!(SplitBit { bit: 7, slot: Kept(0), its_bit: 0 }, SplitBit { bit: 5, slot: Own(SMCR), its_bit: 3 });        0x55 "MCUCR" MCUCR_BITS;
    0x56 "EMCUCR" EMCUCR;            0x57 "SPMCR" Spm(SPMCSR);        0x58 "TIFR" timers!(TIFR);
    0x59 "TIMSK" timers!(TIMSK);
    0x5A "GIFR" general!(EIFR, SplitBit { bit: 5, slot: External(EIFR), its_bit: 2 }, SplitBit { bit: 4, slot: External(PCIFR), its_bit: 1 }, SplitBit { bit: 3, slot: External(PCIFR), its_bit: 0 });
    0x5B "GICR" general!(EIMSK, SplitBit { bit: 5, slot: External(EIMSK), its_bit: 2 }, SplitBit { bit: 4, slot: External(PCICR), its_bit: 1 }, SplitBit { bit: 3, slot: External(PCICR), its_bit: 0 },
                         SplitBit { bit: 1, slot: Own(MCUCR), its_bit: 1 }, SplitBit { bit: 0, slot: Own(MCUCR), its_bit: 0 });
    0x5C "UBRR1H" Ursel(1);          0x5C "UCSR1C" Ursel(1);          0x5D "SPL" Core;
    0x5E "SPH" Core;                 0x5F "SREG" Core;                0x61 "CLKPR" Own(CLKPR);
    0x6B "PCMSK0" External(PCMSK0);  0x6C "PCMSK1" External(PCMSK1);  0x7C "ETIFR" more_timers!(TIFR);
    0x7D "ETIMSK" more_timers!(TIMSK); 0x80 "ICR3L" Timer(3, ICRL);   0x81 "ICR3H" Timer(3, ICRH);
    0x84 "OCR3BL" Timer(3, OCRBL);   0x85 "OCR3BH" Timer(3, OCRBH);   0x86 "OCR3AL" Timer(3, OCRAL);
    0x87 "OCR3AH" Timer(3, OCRAH);   0x88 "TCNT3L" Timer(3, TCNTL);   0x89 "TCNT3H" Timer(3, TCNTH);
    0x8A "TCCR3B" Timer(3, TCCRB);   0x8B "TCCR3A" tccra!(3);
}

/// Pins (pin configurations), eight per port: the pin identity is 8 times the port (A to E) plus the bit.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PA0" 39 ""  "PA1" 38 ""  "PA2" 37 ""  "PA3" 36 ""  "PA4" 35 ""  "PA5" 34 ""  "PA6" 33 ""  "PA7" 32 ""
    "PB0" 1 ""  "PB1" 2 ""  "PB2" 3 "RXD1"  "PB3" 4 "TXD1"  "PB4" 5 ""  "PB5" 6 ""  "PB6" 7 ""  "PB7" 8 ""
    "PC0" 21 ""  "PC1" 22 ""  "PC2" 23 ""  "PC3" 24 ""  "PC4" 25 ""  "PC5" 26 ""  "PC6" 27 ""  "PC7" 28 ""
    "PD0" 10 "RXD0"  "PD1" 11 "TXD0"  "PD2" 12 ""  "PD3" 13 ""  "PD4" 14 ""  "PD5" 15 ""  "PD6" 16 ""  "PD7" 17 ""
    "PE0" 31 ""  "PE1" 30 ""  "PE2" 29 ""  "RESET" 9 "RESET"
};

/// Packages (pin configurations).
const PACKAGES: &[ChipPackage] = &[ChipPackage { name: "DIP40", pins: &dip::<{ PINS.len() }>(PINS) }];

/// Pin of each line of a unit (alternate port functions).
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::T,    8), (unit_index::TIMER,     AvrLine::OcA,  8), (unit_index::TIMER + 1, AvrLine::T,    9),
    (unit_index::TIMER + 1, AvrLine::Icp, 32), (unit_index::TIMER + 1, AvrLine::OcA, 29), (unit_index::TIMER + 1, AvrLine::OcB, 34),
    (unit_index::TIMER + 2, AvrLine::OcA,  9), (unit_index::TIMER + 3, AvrLine::Icp, 27), (unit_index::TIMER + 3, AvrLine::OcA, 28),
    (unit_index::TIMER + 3, AvrLine::OcB, 12), (unit_index::USART,     AvrLine::Rxd, 24), (unit_index::USART,     AvrLine::Txd, 25),
    (unit_index::USART,     AvrLine::Xck, 28), (unit_index::USART + 1, AvrLine::Rxd, 10), (unit_index::USART + 1, AvrLine::Txd, 11),
    (unit_index::USART + 1, AvrLine::Xck, 26), (unit_index::SPI,       AvrLine::Ss,  12), (unit_index::SPI,       AvrLine::Mosi, 13),
    (unit_index::SPI,       AvrLine::Miso, 14), (unit_index::SPI,      AvrLine::Sck, 15), (unit_index::EXTERNAL,  AvrLine::Int(0), 26),
    (unit_index::EXTERNAL,  AvrLine::Int(1), 27), (unit_index::EXTERNAL, AvrLine::Int(2), 32),
];

/// Pin and number of each pin change input: PCINT0 to 7 on port A, 8 to 15 on port C.
#[rustfmt::skip]
const PIN_CHANGES: &[(PinId, u8)] = &[
    (0, 0), (1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (6, 6), (7, 7),
    (16, 8), (17, 9), (18, 10), (19, 11), (20, 12), (21, 13), (22, 14), (23, 15),
];

/// Interrupt vectors; the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "INT2", "PCINT0", "PCINT1", "TIMER3_CAPT", "TIMER3_COMPA", "TIMER3_COMPB", "TIMER3_OVF",
    "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMP", "TIMER0_OVF",
    "SPI_STC", "USART0_RXC", "USART1_RXC", "USART0_UDRE", "USART1_UDRE", "USART0_TXC", "USART1_TXC", "EE_RDY", "ANA_COMP",
    "SPM_RDY",
];

/// Sources of the interrupts: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::EXTERNAL, 2), (unit_index::EXTERNAL, 3), (unit_index::EXTERNAL, 4),
    (unit_index::TIMER + 3, 0), (unit_index::TIMER + 3, 1), (unit_index::TIMER + 3, 2), (unit_index::TIMER + 3, 3), (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3), (unit_index::TIMER, 0), (unit_index::TIMER, 2),
    (unit_index::SPI, 0), (unit_index::USART, 0), (unit_index::USART + 1, 0), (unit_index::USART, 1), (unit_index::USART + 1, 1), (unit_index::USART, 2),
    (unit_index::USART + 1, 2), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0), (unit_index::SPM, 0),
];
