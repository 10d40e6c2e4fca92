//! ATmega8 (Atmel 2486).

use crate::chips::{FuseField, SplitBit};
use emu_core::chip::{Chip, ChipPackage, NamedAddress, PinDef};
use emu_core::pins::PinId;

use super::RegisterSlot::{self, *};
use super::SocRegister::*;
use super::bits as b;
use super::classic::{self, assr, general, mcucsr, tccr, tccra};
use super::{
    ANALOG, AvrPart, ChipMemories, FuseLayout, HeaderNames, TQFP32, dip, named_chip, pins, registers, sites, unit_index,
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
use crate::periph::{adc, eeprom, external, spm, watchdog};

/// Chip data of the ATmega8.
const ATMEGA8: Chip = named_chip!(
    "atmega8",
    "ATmega8: 8 KB flash, 1 KB RAM, 512 bytes EEPROM, 28 or 32 pins",
    Chip {
        data_sheet: "Atmel 2486",
        regs: REGS,
        pins: PINS,
        packages: PACKAGES,
        vectors: VECTORS,
        ..ChipMemories::<0x2000, 0x60, 0x460, 0x200, 2>::CHIP
    }
);

/// Row of the ATmega8.
pub(super) const PART_8: AvrPart = AvrPart {
    chip: &ATMEGA8,
    ports: &[0xFF, 0x7F, 0xFF, ANALOG],
    register_slots: &sites(SITES, 0x60),
    peripheral_pins: LINES,
    pin_changes: &[],
    stack_starts_at_ram_end: false,
    pin_writes_toggle: false,
    bit_writes_whole_register: true,
    mcucr: 0x13,
    interrupt_sources: SOURCES,
    timers: &[TimerShape::narrow(0), TimerShape::wide(2), TimerShape::crystal(1)],
    adc_kind: adc::AvrAdcKind::MEGA8,
    analog_pins: &[8, 9, 10, 11, 12, 13, 24, 25],
    comparator_pins: [22, 23],
    adc_triggers: &[],
    eeprom_kind: eeprom::AvrEepromKind::MEGA8,
    spm_kind: spm::SpmKind::MEGA8,
    external_kind: external::ExternalKind::MEGA8,
    watchdog_kind: watchdog::WatchdogKind::MEGA8,
    power_reduction_bits: &[],
    signature: [0x1E, 0x93, 0x07],
    fuses: FuseLayout {
        wdton: Some(FuseField { byte: 1, bit: 6, bits: 1 }),
        rstdisbl: Some(FuseField { byte: 1, bit: 7, bits: 1 }),
        ..classic::FUSES
    },
    reset_pin: 14,
    jtag_pins: &[],
    names: HeaderNames {
        bit_names: &[b::ANY, b::OLD, b::MUX4, b::FREE_RUNNING, b::TIMERS_1_2, b::WDCE, b::M8],
        fuse_names: [
            classic::LOW_FUSES,
            "FUSE_RSTDISBL FUSE_WDTON FUSE_SPIEN FUSE_CKOPT FUSE_EESAVE FUSE_BOOTSZ1 FUSE_BOOTSZ0 FUSE_BOOTRST",
            "",
        ],
        factory_fuses: [0xE1, 0xD9, 0xFF],
        sleep_modes: 5,
        eeprom_page: 4,
        last_outside: 0,
    },
};

/// TIMSK or TIFR.
macro_rules! timers {
    ($reg:ident) => {
        Split(&[
            SplitBit { bit: 7, slot: Timer(2, $reg), its_bit: 1 },
            SplitBit { bit: 6, slot: Timer(2, $reg), its_bit: 0 },
            SplitBit { bit: 5, slot: Timer(1, $reg), its_bit: 5 },
            SplitBit { bit: 4, slot: Timer(1, $reg), its_bit: 1 },
            SplitBit { bit: 3, slot: Timer(1, $reg), its_bit: 2 },
            SplitBit { bit: 2, slot: Timer(1, $reg), its_bit: 0 },
            SplitBit { bit: 0, slot: Timer(0, $reg), its_bit: 0 },
        ])
    };
}

const MCUCR_BITS: RegisterSlot = Split(&[
    SplitBit { bit: 7, slot: Own(SMCR), its_bit: 0 },
    SplitBit { bit: 6, slot: Own(SMCR), its_bit: 3 },
    SplitBit { bit: 5, slot: Own(SMCR), its_bit: 2 },
    SplitBit { bit: 4, slot: Own(SMCR), its_bit: 1 },
    SplitBit { bit: 3, slot: External(EICRA), its_bit: 3 },
    SplitBit { bit: 2, slot: External(EICRA), its_bit: 2 },
    SplitBit { bit: 1, slot: External(EICRA), its_bit: 1 },
    SplitBit { bit: 0, slot: External(EICRA), its_bit: 0 },
]);

const SFIOR: RegisterSlot = Split(&[
    SplitBit { bit: 3, slot: Adc(ADCSRB), its_bit: 6 },
    SplitBit { bit: 2, slot: Own(MCUCR), its_bit: 4 },
    SplitBit { bit: 1, slot: Own(GTCCR), its_bit: 1 },
    SplitBit { bit: 0, slot: Own(GTCCR), its_bit: 0 },
]);

#[rustfmt::skip]
registers! {
    0x20 "TWBR" Twi(TWBR);           0x21 "TWSR" Twi(TWSR);           0x22 "TWAR" Twi(TWAR);
    0x23 "TWDR" Twi(TWDR);           0x24 "ADCL" Adc(ADCL);           0x25 "ADCH" Adc(ADCH);
    0x26 "ADCSRA" / "ADCSR" Adc(ADCSRA); 0x27 "ADMUX" Adc(ADMUX);     0x28 "ACSR" Comparator(ACSR);
    0x29 "UBRRL" Usart(0, UBRRL);    0x2A "UCSRB" Usart(0, UCSRB);    0x2B "UCSRA" Usart(0, UCSRA);
    0x2C "UDR" Usart(0, UDR);        0x2D "SPCR" Spi(SPCR);           0x2E "SPSR" Spi(SPSR);
    0x2F "SPDR" Spi(SPDR);           0x30 "PIND" Port(2, 0);          0x31 "DDRD" Port(2, 1);
    0x32 "PORTD" Port(2, 2);         0x33 "PINC" Port(1, 0);          0x34 "DDRC" Port(1, 1);
    0x35 "PORTC" Port(1, 2);         0x36 "PINB" Port(0, 0);          0x37 "DDRB" Port(0, 1);
    0x38 "PORTB" Port(0, 2);         0x3C "EECR" Eeprom(EECR);        0x3D "EEDR" Eeprom(EEDR);
    0x3E "EEARL" Eeprom(EEARL);      0x3F "EEARH" Eeprom(EEARH);      0x40 "UBRRH" Ursel(0);
    0x40 "UCSRC" Ursel(0);           0x41 "WDTCR" Watchdog(WDTCSR);   0x42 "ASSR" assr!(2);
    0x43 "OCR2" Timer(2, OCRAL);     0x44 "TCNT2" Timer(2, TCNTL);    0x45 "TCCR2" tccr!(2);
    0x46 "ICR1L" Timer(1, ICRL);     0x47 "ICR1H" Timer(1, ICRH);     0x48 "OCR1BL" Timer(1, OCRBL);
    0x49 "OCR1BH" Timer(1, OCRBH);   0x4A "OCR1AL" Timer(1, OCRAL);   0x4B "OCR1AH" Timer(1, OCRAH);
    0x4C "TCNT1L" Timer(1, TCNTL);   0x4D "TCNT1H" Timer(1, TCNTH);   0x4E "TCCR1B" Timer(1, TCCRB);
    0x4F "TCCR1A" tccra!(1);         0x50 "SFIOR" SFIOR;              0x51 "OSCCAL" Own(OSCCAL);
    0x52 "TCNT0" Timer(0, TCNTL);    0x53 "TCCR0" Timer(0, TCCRB);    0x54 "MCUCSR" / "MCUSR" mcucsr!();
    0x55 "MCUCR" MCUCR_BITS;         0x56 "TWCR" Twi(TWCR);           0x57 "SPMCR" Spm(SPMCSR);
    0x58 "TIFR" timers!(TIFR);       0x59 "TIMSK" timers!(TIMSK);     0x5A "GIFR" general!(EIFR);
    0x5B "GICR" / "GIMSK" general!(EIMSK, SplitBit { bit: 1, slot: Own(MCUCR), its_bit: 1 }, SplitBit { bit: 0, slot: Own(MCUCR), its_bit: 0 });
    0x5D "SPL" Core;                 0x5E "SPH" Core;                 0x5F "SREG" Core;
}

/// Pins (pin configurations), eight per port: the pin identity is 8 times the port (B, C, D) plus the bit.
/// The inputs that are only analog follow the ports.
#[rustfmt::skip]
const PINS: &[PinDef] = pins! {
    "PB0" 14 ""  "PB1" 15 ""  "PB2" 16 ""  "PB3" 17 ""  "PB4" 18 ""  "PB5" 19 ""  "PB6" 9 "XTAL1"  "PB7" 10 "XTAL2"
    "PC0" 23 ""  "PC1" 24 ""  "PC2" 25 ""  "PC3" 26 ""  "PC4" 27 ""  "PC5" 28 ""  "PC6" 1 "RESET"  "PC7" 0 "absent"
    "PD0" 2 "RXD"  "PD1" 3 "TXD"  "PD2" 4 ""  "PD3" 5 ""  "PD4" 6 ""  "PD5" 11 ""  "PD6" 12 ""  "PD7" 13 ""
    "ADC6" 0 "analog input"  "ADC7" 0 "analog input"
};

/// Packages (pin configurations).
const PACKAGES: &[ChipPackage] = &[
    ChipPackage { name: "DIP28", pins: &dip::<{ PINS.len() }>(PINS) },
    ChipPackage { name: "TQFP32", pins: &TQFP32 },
    ChipPackage { name: "MLF32", pins: &TQFP32 },
];

/// Pin of each line of a unit (alternate port functions).
#[rustfmt::skip]
const LINES: &[(usize, AvrLine, PinId)] = &[
    (unit_index::TIMER,     AvrLine::T,   20), (unit_index::TIMER + 1, AvrLine::T,   21), (unit_index::TIMER + 1, AvrLine::Icp,  0),
    (unit_index::TIMER + 1, AvrLine::OcA,  1), (unit_index::TIMER + 1, AvrLine::OcB,  2), (unit_index::TIMER + 2, AvrLine::OcA,  3),
    (unit_index::USART,     AvrLine::Rxd, 16), (unit_index::USART,     AvrLine::Txd, 17), (unit_index::USART,     AvrLine::Xck, 20),
    (unit_index::SPI,       AvrLine::Ss,   2), (unit_index::SPI,       AvrLine::Mosi, 3), (unit_index::SPI,       AvrLine::Miso, 4),
    (unit_index::SPI,       AvrLine::Sck,  5), (unit_index::TWI,       AvrLine::Sda, 12), (unit_index::TWI,       AvrLine::Scl, 13),
    (unit_index::EXTERNAL,  AvrLine::Int(0), 18), (unit_index::EXTERNAL, AvrLine::Int(1), 19),
];

/// Interrupt vectors; the position is the vector number, RESET is 0.
#[rustfmt::skip]
const VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "TIMER2_COMP", "TIMER2_OVF", "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF",
    "TIMER0_OVF", "SPI_STC", "USART_RXC", "USART_UDRE", "USART_TXC", "ADC", "EE_RDY", "ANA_COMP", "TWI", "SPM_RDY",
];

/// Sources of the interrupts: unit and interrupt number in it, from vector 1 on.
#[rustfmt::skip]
const SOURCES: &[(usize, u8)] = &[
    (unit_index::EXTERNAL, 0), (unit_index::EXTERNAL, 1), (unit_index::TIMER + 2, 0), (unit_index::TIMER + 2, 2),
    (unit_index::TIMER + 1, 0), (unit_index::TIMER + 1, 1), (unit_index::TIMER + 1, 2), (unit_index::TIMER + 1, 3), (unit_index::TIMER, 2), (unit_index::SPI, 0),
    (unit_index::USART, 0), (unit_index::USART, 1), (unit_index::USART, 2), (unit_index::ADC, 0), (unit_index::EEPROM, 0), (unit_index::COMPARATOR, 0), (unit_index::TWI, 0),
    (unit_index::SPM, 0),
];
