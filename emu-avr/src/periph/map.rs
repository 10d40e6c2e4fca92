//! Addresses, vectors and pins by name, read at compile time from the chip's row: a misspelt name does not compile.

use emu_core::pins::PinId;

use crate::chips::ATMEGA328P;

macro_rules! named {
    ($find:ident $type:ty: $($name:ident)*) => { $( pub const $name: $type = $find(stringify!($name)) as $type; )* };
}

/// Data addresses.
pub mod at {
    use super::address;
    named! { address u16:
        SPL SPH SREG PINB PINC PIND PORTD TIFR0 TIFR1 TIFR2 EIMSK GPIOR0 EECR EEDR EEARL EEARH
        GTCCR TCCR0A TCCR0B TCNT0 OCR0A OCR0B GPIOR1 GPIOR2 SPCR SPSR SPDR ACSR SMCR MCUSR MCUCR SPMCSR WDTCSR PRR
        OSCCAL PCICR EICRA PCMSK0 PCMSK1 PCMSK2 TIMSK0 TIMSK1 TIMSK2 ADCSRA ADCSRB ADMUX DIDR0 DIDR1
        TCCR1A TCCR1B TCNT1L TCNT1H ICR1L ICR1H OCR1AL OCR1AH OCR1BL OCR1BH TCCR2A TCCR2B TCNT2 OCR2A OCR2B ASSR
        TWBR TWSR TWAR TWDR TWCR TWAMR UCSR0A UCSR0B UCSR0C UBRR0L UBRR0H UDR0
    }
}

/// Vector numbers.
pub mod irq {
    use super::vector;
    named! { vector u8:
        WDT TIMER2_COMPA TIMER2_COMPB TIMER2_OVF TIMER1_CAPT TIMER1_COMPA TIMER1_COMPB TIMER1_OVF
        TIMER0_COMPA TIMER0_COMPB TIMER0_OVF USART_RX USART_UDRE USART_TX
    }
}

/// RXD, the first pin of port D.
pub const RXD: PinId = 16;
/// TXD, the second pin of port D.
pub const TXD: PinId = 17;

const fn address(name: &str) -> u16 {
    let regs = ATMEGA328P.regs;
    let mut i = 0;
    while !same(regs[i].name, name) {
        i += 1;
    }
    regs[i].addr
}

const fn vector(name: &str) -> usize {
    let mut i = 0;
    while !same(ATMEGA328P.vectors[i], name) {
        i += 1;
    }
    i
}

const fn same(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut i = 0;
    while a.len() == b.len() && i < a.len() && a[i] == b[i] {
        i += 1;
    }
    a.len() == b.len() && i == a.len()
}
