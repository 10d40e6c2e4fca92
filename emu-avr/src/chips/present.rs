//! Which bits of the chips' registers there are (register summary).

use super::{Own, Part, Site};
use crate::periph::{adc, comparator, eeprom, external, guard, spi, spm, timers, twi, usart};

/// JTRF in MCUCSR.
const JTRF: u8 = 1 << 4;

/// URSEL in UCSRC and UBRRH.
const URSEL: u8 = 1 << 7;

impl Part {
    /// What stands at a data address below 100h.
    #[must_use]
    pub fn site(&self, addr: u16) -> Site {
        self.sites.get(usize::from(addr)).copied().unwrap_or(Site::Reserved)
    }

    /// The port whose pins are read at a data address.
    #[must_use]
    pub fn input_port(&self, addr: u16) -> Option<usize> {
        match self.site(addr) {
            Site::Port(port, 0) => Some(port.into()),
            _ => None,
        }
    }

    /// The bits of the register at a data address that may be written as ones: all but the reserved ones, which are to be written
    /// as zeros. Nothing for an address that is not to be written at all.
    ///
    /// Absent pins of a port, and absent flags of registers whose ones clear them, count as there: programs write such registers
    /// whole. `value` tells UCSRC from UBRRH where they share an address.
    #[must_use]
    pub fn present(&self, addr: u16, value: u8) -> Option<u8> {
        use adc::Reg::{ADCSRB, ADMUX, DIDR0};
        use external::Reg::{EICRA, EIMSK, PCICR, PCMSK0, PCMSK1, PCMSK2};
        use timers::Reg::{ASSR, TCCRA, TCCRB, TCCRC, TIMSK};
        // ATmega48 to 328; the others are older.
        let today = self.toggles;
        Some(match self.site(addr) {
            Site::Reserved if self.chip.regs.iter().any(|reg| reg.addr == addr) => 0xFF,
            Site::Reserved => return None,
            Site::Split(bits) => {
                // JTRF, which chips with a JTAG interface have beside JTD, is a flag that nothing here can set.
                let jtag = bits.contains(&(3, Site::Own(Own::MCUSR), 3))
                    && bits.iter().any(|bit| matches!(bit.1, Site::Kept(_)));
                bits.iter().fold(if jtag { JTRF } else { 0 }, |all, &(bit, ..)| all | 1 << bit)
            }
            Site::Ursel(_) if value & URSEL == 0 => 0x0F,
            Site::Timer(n, reg) => {
                let shape = self.timers.get(usize::from(n)).copied().unwrap_or(timers::Shape::narrow(0));
                match reg {
                    TCCRA if shape.channels == 3 => 0xFF,
                    TCCRA => 0xF3,
                    TCCRB if shape.wide => 0xDF,
                    TCCRB if shape.channels == 0 => 0x07,
                    TCCRB => 0xCF,
                    TCCRC if shape.channels == 3 => 0xE0,
                    TCCRC => 0xC0,
                    ASSR => 0x7F,
                    TIMSK => shape.flags(),
                    _ => 0xFF,
                }
            }
            Site::Usart(_, usart::Reg::UBRRH) => 0x0F,
            Site::Spi(spi::Reg::SPSR) => 0xC1,
            Site::Twi(twi::Reg::TWSR) => 0xFB,
            Site::Twi(twi::Reg::TWCR) => 0xFD,
            Site::Twi(twi::Reg::TWAMR) => 0xFE,
            Site::Adc(ADCSRB) if today => 0x47,
            Site::Adc(ADCSRB) => 0x07,
            Site::Adc(ADMUX) if today => 0xE0 | self.adc.mux,
            Site::Adc(DIDR0) => self.adc.didr0,
            Site::Comparator(comparator::Reg::DIDR1) => 0x03,
            Site::Eeprom(eeprom::Reg::EECR) => {
                if today {
                    0x3F
                } else {
                    0x0F
                }
            }
            Site::Eeprom(eeprom::Reg::EEARH) => (self.chip.eeprom.saturating_sub(1) >> 8) as u8,
            Site::Spm(spm::Reg::SPMCSR) if !today => 0xDF,
            Site::Watchdog(guard::Reg::WDTCSR) if !today => 0x1F,
            Site::External(EICRA) if today => self.external.senses(),
            Site::External(EIMSK) => self.external.inputs(),
            Site::External(PCICR) => (0..4).fold(0, |bits, n| bits | u8::from(self.external.pins(n) != 0) << n),
            Site::External(reg @ (PCMSK0 | PCMSK1 | PCMSK2)) => self.external.pins(reg as usize - PCMSK0 as usize),
            Site::Own(Own::MCUCR) => self.mcucr,
            // Chips of today have JTRF beside JTD, bit 7 of MCUCR.
            Site::Own(Own::MCUSR) => 0x0F | self.mcucr >> 3 & JTRF,
            Site::Own(Own::SMCR) => 0x0F,
            Site::Own(Own::CLKPR) => 0x8F,
            Site::Own(Own::PRR) => self.prr.iter().fold(0, |bits, row| bits | 1 << row.0),
            Site::Own(Own::GTCCR) => 0x83,
            Site::Own(Own::RAMPZ) => 0x01,
            _ => 0xFF,
        })
    }
}
