//! Registers that only keep what is written to them: general purpose ones, and those of peripherals that QUIRKS.md lists as
//! not modelled, of which the bits that the data sheet marks R/W are kept (section 36).

use super::map::at::*;

/// Address, bits that can be written, value after reset.
#[rustfmt::skip]
const PLAIN: &[(u16, u8, u8)] = &[
    (GPIOR0, 0xFF, 0),    (GPIOR1, 0xFF, 0),    (GPIOR2, 0xFF, 0),    (SMCR,   0x0F, 0),    (MCUCR,  0x10, 0),
    (EIMSK,  0x03, 0),    (EICRA,  0x0F, 0),    (PCICR,  0x07, 0),    (PCMSK0, 0xFF, 0),    (PCMSK1, 0x7F, 0),
    (PCMSK2, 0xFF, 0),    (EECR,   0x38, 0),    (EEDR,   0xFF, 0),    (EEARL,  0xFF, 0),    (EEARH,  0x03, 0),
    (SPCR,   0xFF, 0),    (SPSR,   0x01, 0),    (SPDR,   0xFF, 0),    (ACSR,   0xCF, 0),    (SPMCSR, 0x80, 0),
    (PRR,    0xEF, 0),    (OSCCAL, 0xFF, 0),    (ADCSRA, 0xAF, 0),    (ADCSRB, 0x47, 0),    (ADMUX,  0xEF, 0),
    (DIDR0,  0x3F, 0),    (DIDR1,  0x03, 0),    (ASSR,   0x60, 0),    (TWBR,   0xFF, 0),    (TWSR,   0x03, 0xF8),
    (TWAR,   0xFF, 0xFE), (TWDR,   0xFF, 0xFF), (TWCR,   0x75, 0),    (TWAMR,  0xFE, 0),    (TCCR0A, 0xF3, 0),
    (TCCR0B, 0x0F, 0),    (TCCR1A, 0xF3, 0),    (TCCR1B, 0xDF, 0),    (TCCR2A, 0xF3, 0),    (TCCR2B, 0x0F, 0),
];

/// The registers, from data address 0x20 on.
#[derive(Debug, Clone)]
pub struct Plain([u8; LEN]);

const FIRST: usize = 0x20;
const LEN: usize = 0xE0;

/// Bits that can be written, by address.
const MASKS: [u8; LEN] = column(false);
const RESET: [u8; LEN] = column(true);

impl Plain {
    /// All registers as after reset.
    pub const RESET: Plain = Plain(RESET);

    /// What the register holds; 0 for addresses that are none of these.
    pub fn get(&self, reg: u16) -> u8 {
        self.0.get(usize::from(reg).wrapping_sub(FIRST)).copied().unwrap_or(0)
    }

    /// Writes the bits of `mask` that the register has.
    pub fn put(&mut self, reg: u16, mask: u8, value: u8) {
        let i = usize::from(reg).wrapping_sub(FIRST);
        if let (Some(held), Some(bits)) = (self.0.get_mut(i), MASKS.get(i)) {
            let bits = bits & mask;
            *held = *held & !bits | value & bits;
        }
    }
}

const fn column(reset: bool) -> [u8; LEN] {
    let mut all = [0; LEN];
    let mut i = 0;
    while i < PLAIN.len() {
        let (addr, mask, value) = PLAIN[i];
        all[addr as usize - FIRST] = if reset { value } else { mask };
        i += 1;
    }
    all
}
