//! Existing and reserved bits of each chip's registers (register summary).

use super::{AvrPart, RegisterSlot, SocRegister};
use crate::periph::{adc, comparator, eeprom, external, spi, spm, timers, twi, usart, watchdog};

/// Bit mask of JTRF in MCUCSR.
const JTRF: u8 = 1 << 4;

/// Bit mask of URSEL in UCSRC and UBRRH.
const URSEL: u8 = 1 << 7;

impl AvrPart {
    /// Returns the register slot at a data address below 100h; any other address is reserved.
    #[must_use]
    pub fn register_slot(&self, addr: u16) -> RegisterSlot {
        self.register_slots.get(usize::from(addr)).copied().unwrap_or(RegisterSlot::Reserved)
    }

    /// Returns the port whose PINx register is at a data address.
    #[must_use]
    pub fn input_port(&self, addr: u16) -> Option<usize> {
        match self.register_slot(addr) {
            RegisterSlot::Port(port, 0) => Some(port.into()),
            _ => None,
        }
    }

    /// Returns the bits of the register at a data address that a program may write as ones: all except the
    /// reserved bits, which must be written as zeros. Returns None for an address that a program must not
    /// write.
    ///
    /// Absent pins of a port, and absent flags in registers where a one clears a flag, count as existing:
    /// programs write such registers as a whole. `value` is the byte written; it distinguishes UCSRC from
    /// UBRRH where they share an address.
    #[must_use]
    pub fn existing_bits(&self, addr: u16, value: u8) -> Option<u8> {
        use adc::AdcRegister::{ADCSRB, ADMUX, DIDR0};
        use external::ExternalRegister::{EICRA, EIMSK, PCICR, PCMSK0, PCMSK1, PCMSK2};
        use timers::TimerRegister::{ASSR, TCCRA, TCCRB, TCCRC, TIMSK};
        // True for ATmega48 to 328; the other chips are older.
        let today = self.pin_writes_toggle;
        Some(match self.register_slot(addr) {
            RegisterSlot::Reserved if self.chip.regs.iter().any(|reg| reg.addr == addr) => 0xFF,
            RegisterSlot::Reserved => return None,
            RegisterSlot::Split(bits) => {
                // JTRF, which chips with a JTAG interface have in addition to JTD, is a flag that nothing in
                // the model sets.
                let jtag = bits.contains(&(3, RegisterSlot::Own(SocRegister::MCUSR), 3))
                    && bits.iter().any(|bit| matches!(bit.1, RegisterSlot::Kept(_)));
                bits.iter().fold(if jtag { JTRF } else { 0 }, |all, &(bit, ..)| all | 1 << bit)
            }
            RegisterSlot::Ursel(_) if value & URSEL == 0 => 0x0F,
            RegisterSlot::Timer(n, reg) => {
                let shape = self.timers.get(usize::from(n)).copied().unwrap_or(timers::TimerShape::narrow(0));
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
            RegisterSlot::Usart(_, usart::UsartRegister::UBRRH) => 0x0F,
            RegisterSlot::Spi(spi::SpiRegister::SPSR) => 0xC1,
            RegisterSlot::Twi(twi::TwiRegister::TWSR) => 0xFB,
            RegisterSlot::Twi(twi::TwiRegister::TWCR) => 0xFD,
            RegisterSlot::Twi(twi::TwiRegister::TWAMR) => 0xFE,
            RegisterSlot::Adc(ADCSRB) if today => 0x47,
            RegisterSlot::Adc(ADCSRB) => 0x07,
            RegisterSlot::Adc(ADMUX) if today => 0xE0 | self.adc_kind.mux,
            RegisterSlot::Adc(DIDR0) => self.adc_kind.didr0,
            RegisterSlot::Comparator(comparator::ComparatorRegister::DIDR1) => 0x03,
            RegisterSlot::Eeprom(eeprom::EepromRegister::EECR) => {
                if today {
                    0x3F
                } else {
                    0x0F
                }
            }
            RegisterSlot::Eeprom(eeprom::EepromRegister::EEARH) => {
                (self.chip.eeprom_bytes.saturating_sub(1) >> 8) as u8
            }
            RegisterSlot::Spm(spm::SpmRegister::SPMCSR) if !today => 0xDF,
            RegisterSlot::Watchdog(watchdog::WatchdogRegister::WDTCSR) if !today => 0x1F,
            RegisterSlot::External(EICRA) if today => self.external_kind.sense_mask(),
            RegisterSlot::External(EIMSK) => self.external_kind.int_mask(),
            RegisterSlot::External(PCICR) => {
                (0..4).fold(0, |bits, n| bits | u8::from(self.external_kind.group_mask(n) != 0) << n)
            }
            RegisterSlot::External(reg @ (PCMSK0 | PCMSK1 | PCMSK2)) => {
                self.external_kind.group_mask(reg as usize - PCMSK0 as usize)
            }
            RegisterSlot::Own(SocRegister::MCUCR) => self.mcucr,
            // Newer chips have JTRF if they have JTD, bit 7 of MCUCR.
            RegisterSlot::Own(SocRegister::MCUSR) => 0x0F | self.mcucr >> 3 & JTRF,
            RegisterSlot::Own(SocRegister::SMCR) => 0x0F,
            RegisterSlot::Own(SocRegister::CLKPR) => 0x8F,
            RegisterSlot::Own(SocRegister::PRR) => {
                self.power_reduction_bits.iter().fold(0, |bits, row| bits | 1 << row.0)
            }
            RegisterSlot::Own(SocRegister::GTCCR) => 0x83,
            RegisterSlot::Own(SocRegister::RAMPZ) => 0x01,
            _ => 0xFF,
        })
    }
}
