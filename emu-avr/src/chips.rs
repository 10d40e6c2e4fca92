//! The chips of the family, one row each.
//!
//! Source: ATmega48A/PA/88A/PA/168A/PA/328/P data sheet DS40002061: register summary (36), interrupt vectors (12.4),
//! memories (8), pin configuration (1).

use emu_core::chip::{Chip, Family, PinDef, Reg};
use emu_core::image::{Bits, Space};

/// All chips of this crate.
pub const CHIPS: &[&Chip] = &[&ATMEGA328P, &ATMEGA328];

/// The chip `name` (case aside).
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    CHIPS.iter().copied().find(|c| c.name.eq_ignore_ascii_case(name))
}

/// ATmega328P.
pub const ATMEGA328P: Chip = Chip {
    name: "atmega328p",
    family: Family::Avr,
    isa: &crate::isa::isa::<0x3FFF>(),
    title: "ATmega328P: 32 KB flash, 2 KB RAM, 1 KB EEPROM, 28 pins",
    source: "DS40002061",
    code: "flash",
    flash: 0x8000,
    on_chip: 0x8000,
    ram: "data",
    ram_start: 0x100,
    ram_len: 0x800,
    eeprom: 0x400,
    word_bytes: 2,
    max_hz: 20_000_000,
    default_hz: 16_000_000,
    hex: &[Space { name: "flash", start: 0, len: 0x8000, word: 2, bits: Bits::All }],
    elf: &[
        Space { name: "flash", start: 0, len: 0x8000, word: 2, bits: Bits::All },
        Space { name: "data", start: 0x80_0000, len: 0x900, word: 1, bits: Bits::All },
        Space { name: "eeprom", start: 0x81_0000, len: 0x400, word: 1, bits: Bits::All },
        Space { name: "fuse", start: 0x82_0000, len: 3, word: 1, bits: Bits::All },
        Space { name: "lock", start: 0x83_0000, len: 1, word: 1, bits: Bits::All },
        Space { name: "signature", start: 0x84_0000, len: 3, word: 1, bits: Bits::All },
    ],
    elf_machine: 83,
    cpu_regs: &[
        "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "r13", "r14", "r15", "r16",
        "r17", "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31",
        "SREG", "SP", "PC",
    ],
    reg_space: "data",
    bits: &[],
    regs: MEGA_X8_REGS,
    pins: MEGA_X8_PINS,
    vectors: MEGA_X8_VECTORS,
    vector_words: 2,
    spaces: &[("data", 0x900, 1), ("flash", 0x8000, 1), ("eeprom", 0x400, 1)],
};

/// ATmega328: the 328P without the low-power process; the same to a program.
pub const ATMEGA328: Chip = Chip { name: "atmega328", title: "ATmega328: as ATmega328P, other process", ..ATMEGA328P };

macro_rules! regs {
    ($($addr:literal $name:literal)*) => { &[ $( Reg { name: $name, addr: $addr } ),* ] };
}

/// Register summary (section 36), data addresses.
#[rustfmt::skip]
const MEGA_X8_REGS: &[Reg] = regs! {
    0x23 "PINB"   0x24 "DDRB"   0x25 "PORTB"  0x26 "PINC"   0x27 "DDRC"   0x28 "PORTC"  0x29 "PIND"   0x2A "DDRD"
    0x2B "PORTD"  0x35 "TIFR0"  0x36 "TIFR1"  0x37 "TIFR2"  0x3B "PCIFR"  0x3C "EIFR"   0x3D "EIMSK"  0x3E "GPIOR0"
    0x3F "EECR"   0x40 "EEDR"   0x41 "EEARL"  0x42 "EEARH"  0x43 "GTCCR"  0x44 "TCCR0A" 0x45 "TCCR0B" 0x46 "TCNT0"
    0x47 "OCR0A"  0x48 "OCR0B"  0x4A "GPIOR1" 0x4B "GPIOR2" 0x4C "SPCR"   0x4D "SPSR"   0x4E "SPDR"   0x50 "ACSR"
    0x53 "SMCR"   0x54 "MCUSR"  0x55 "MCUCR"  0x57 "SPMCSR" 0x5D "SPL"    0x5E "SPH"    0x5F "SREG"   0x60 "WDTCSR"
    0x61 "CLKPR"  0x64 "PRR"    0x66 "OSCCAL" 0x68 "PCICR"  0x69 "EICRA"  0x6B "PCMSK0" 0x6C "PCMSK1" 0x6D "PCMSK2"
    0x6E "TIMSK0" 0x6F "TIMSK1" 0x70 "TIMSK2" 0x78 "ADCL"   0x79 "ADCH"   0x7A "ADCSRA" 0x7B "ADCSRB" 0x7C "ADMUX"
    0x7E "DIDR0"  0x7F "DIDR1"  0x80 "TCCR1A" 0x81 "TCCR1B" 0x82 "TCCR1C" 0x84 "TCNT1L" 0x85 "TCNT1H" 0x86 "ICR1L"
    0x87 "ICR1H"  0x88 "OCR1AL" 0x89 "OCR1AH" 0x8A "OCR1BL" 0x8B "OCR1BH" 0xB0 "TCCR2A" 0xB1 "TCCR2B" 0xB2 "TCNT2"
    0xB3 "OCR2A"  0xB4 "OCR2B"  0xB6 "ASSR"   0xB8 "TWBR"   0xB9 "TWSR"   0xBA "TWAR"   0xBB "TWDR"   0xBC "TWCR"
    0xBD "TWAMR"  0xC0 "UCSR0A" 0xC1 "UCSR0B" 0xC2 "UCSR0C" 0xC4 "UBRR0L" 0xC5 "UBRR0H" 0xC6 "UDR0"
};

macro_rules! pins {
    ($($name:literal $dip:literal $note:literal)*) => { &[ $( PinDef { name: $name, dip: $dip, note: $note } ),* ] };
}

/// Pins (section 1), 8 to a port: pin identity is port (B, C, D) times 8 plus bit.
#[rustfmt::skip]
const MEGA_X8_PINS: &[PinDef] = pins! {
    "PB0" 14 ""  "PB1" 15 ""  "PB2" 16 ""  "PB3" 17 ""  "PB4" 18 ""  "PB5" 19 ""  "PB6" 9 "XTAL1"  "PB7" 10 "XTAL2"
    "PC0" 23 ""  "PC1" 24 ""  "PC2" 25 ""  "PC3" 26 ""  "PC4" 27 ""  "PC5" 28 ""  "PC6" 1 "RESET"  "PC7" 0 "absent"
    "PD0" 2 "RXD0"  "PD1" 3 "TXD0"  "PD2" 4 ""  "PD3" 5 ""  "PD4" 6 ""  "PD5" 11 ""  "PD6" 12 ""  "PD7" 13 ""
};

/// Interrupt vectors (table 12-6), number = position, RESET is 0.
#[rustfmt::skip]
const MEGA_X8_VECTORS: &[&str] = &[
    "RESET", "INT0", "INT1", "PCINT0", "PCINT1", "PCINT2", "WDT", "TIMER2_COMPA", "TIMER2_COMPB", "TIMER2_OVF",
    "TIMER1_CAPT", "TIMER1_COMPA", "TIMER1_COMPB", "TIMER1_OVF", "TIMER0_COMPA", "TIMER0_COMPB", "TIMER0_OVF", "SPI_STC",
    "USART_RX", "USART_UDRE", "USART_TX", "ADC", "EE_READY", "ANALOG_COMP", "TWI", "SPM_READY",
];
