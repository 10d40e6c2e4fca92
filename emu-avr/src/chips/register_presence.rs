//! Existing and reserved bits of each chip's registers (register summary).
//!
//! A bit exists if the chip's row names it ([`HeaderNames::bit_names`](super::HeaderNames)), so a chip states
//! each fact once.

use super::names::{NamedBit, named_bits};
use super::{AvrPart, RegisterSlot, SocRegister};
use crate::periph::{eeprom, external, timers, usart};

/// Bit mask of URSEL in UCSRC and UBRRH.
const URSEL: u8 = 1 << 7;

/// Bits 8 to 11 of UBRR in UBRRH, which the tables do not name on all chips.
const UBRR_HIGH: u8 = 0x0F;

/// The bits of each register of a chip that a program may write as ones: all except the reserved bits, which
/// must be written as zeros.
///
/// Absent pins of a port, and absent flags in registers where a one clears a flag, count as existing:
/// programs write such registers as a whole.
#[derive(Debug, Clone)]
pub struct RegisterPresence {
    part: &'static AvrPart,
    /// By data address below 100h; `None` for an address that a program must not write.
    bits: [Option<u8>; 0x100],
}

impl RegisterPresence {
    /// Computes the bits of the chip `part`.
    #[must_use]
    pub fn new(part: &'static AvrPart) -> RegisterPresence {
        let mut named = [0u8; 0x100];
        for NamedBit { addr, bit, .. } in named_bits(part) {
            if let Some(bits) = named.get_mut(usize::from(addr)) {
                *bits |= 1 << bit;
            }
        }
        let mut bits = [None; 0x100];
        for (addr, (place, named)) in (0..).zip(bits.iter_mut().zip(named)) {
            *place = part.writable_bits(addr, named);
        }
        RegisterPresence { part, bits }
    }

    /// Returns the bits of the register at a data address, or `None` for an address that a program must not
    /// write. `value` is the byte written; it distinguishes UCSRC from UBRRH where they share an address.
    #[must_use]
    pub fn existing_bits(&self, addr: u16, value: u8) -> Option<u8> {
        match self.part.register_slot(addr) {
            RegisterSlot::Ursel(_) if value & URSEL == 0 => Some(UBRR_HIGH),
            _ => self.bits.get(usize::from(addr)).copied().flatten(),
        }
    }
}

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

    /// Returns the bits of a register that a program may write as ones; `named` are the bits that have a
    /// name.
    fn writable_bits(&self, addr: u16, named: u8) -> Option<u8> {
        use external::ExternalRegister::{EIFR, PCIFR};
        use timers::TimerRegister::TIFR;
        Some(match self.register_slot(addr) {
            RegisterSlot::Reserved if self.chip.regs.iter().any(|reg| reg.addr == addr) => 0xFF,
            RegisterSlot::Reserved => return None,
            RegisterSlot::Port(..) | RegisterSlot::Timer(_, TIFR) | RegisterSlot::External(EIFR | PCIFR) => 0xFF,
            // The variants of one chip share a table of names.
            RegisterSlot::Own(SocRegister::MCUCR) => self.mcucr,
            RegisterSlot::Eeprom(eeprom::EepromRegister::EEARH) => {
                (self.chip.eeprom_bytes.saturating_sub(1) >> 8) as u8
            }
            RegisterSlot::Usart(_, usart::UsartRegister::UBRRH) => UBRR_HIGH,
            // Registers of data have no names of bits.
            _ if named == 0 => 0xFF,
            _ => named,
        })
    }
}
