//! The chips of the family, one row each.
//!
//! Source: the data sheet that [`Chip::source`] names: register summary, interrupt vectors, memories, pin configuration,
//! alternate port functions, fuses, boot loader parameters.

mod x8;

use emu_core::chip::Chip;
use emu_core::pins::PinId;

use crate::periph::timers::Shape;
use crate::periph::{Line, adc, comparator, eeprom, external, guard, spi, spm, timers, twi, usart};

pub use x8::{ATMEGA328, ATMEGA328P, PART_328P};

/// All parts of this crate.
pub const PARTS: &[&Part] = &[&x8::PART_328P, &x8::PART_328];

/// All chips of this crate.
pub const CHIPS: &[&Chip] = &[&ATMEGA328P, &ATMEGA328];

/// The chip `name` (case aside).
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|part| part.chip)
}

/// The part `name` (case aside).
#[must_use]
pub fn part(name: &str) -> Option<&'static Part> {
    PARTS.iter().copied().find(|part| part.chip.name.eq_ignore_ascii_case(name))
}

/// A chip, with what only this family has.
#[derive(Debug)]
pub struct Part {
    /// What all families have. Pins stand eight to a port, by bits, absent ones included.
    pub chip: &'static Chip,
    /// The bits of each port that there are.
    pub ports: &'static [u8],
    /// What stands at each data address below 100h.
    pub sites: &'static [Site; 0x100],
    /// Which pin a line of a unit goes to.
    pub lines: &'static [(usize, Line, PinId)],
    /// The pin of each pin change input.
    pub pin_changes: &'static [(PinId, u8)],
    /// After a reset SP is the last address of RAM; 0 otherwise.
    pub stack_at_end: bool,
    /// Writing ones to PINx toggles PORTx.
    pub toggles: bool,
    /// What asks for each interrupt: unit, and its number there; from vector 1 on.
    pub vectors: &'static [(usize, u8)],
    /// Timer/counters.
    pub timers: &'static [Shape],
    /// The converter.
    pub adc: adc::Kind,
    /// The pins of ADC0, ADC1, ..
    pub analog: &'static [PinId],
    /// AIN0 and AIN1.
    pub ain: [PinId; 2],
    /// The sources of ADTS 1 to 7: unit, and its interrupt.
    pub triggers: &'static [(usize, u8)],
    /// The EEPROM.
    pub eeprom: eeprom::Kind,
    /// Self-programming.
    pub spm: spm::Kind,
    /// External interrupts.
    pub external: external::Kind,
    /// The watchdog.
    pub watchdog: guard::Kind,
    /// Bits of PRR that stop units.
    pub prr: &'static [(u8, usize)],
    /// Signature bytes (28.3).
    pub signature: [u8; 3],
    /// Where the fuses stand.
    pub fuses: Fuses,
    /// The reset pin.
    pub reset: PinId,
}

/// A fuse: byte (low 0, high 1, extended 2), lowest bit, number of bits. 0 is programmed.
pub type Fuse = (u8, u8, u8);

/// Where the fuses stand, and what they mean.
#[derive(Debug, Clone, Copy)]
pub struct Fuses {
    /// What the model assumes where none are given: as delivered, but for a clock from outside that is not divided.
    pub assumed: [u8; 3],
    /// Divide the clock by 8 after reset, where there is the fuse.
    pub ckdiv8: Option<Fuse>,
    /// Clock source.
    pub cksel: Fuse,
    /// Start-up time.
    pub sut: Fuse,
    /// The watchdog is always on.
    pub wdton: Fuse,
    /// The EEPROM outlives a chip erase.
    pub eesave: Fuse,
    /// Size of the boot section, where there is one.
    pub bootsz: Option<Fuse>,
    /// Reset goes to the boot section.
    pub bootrst: Option<Fuse>,
    /// The reset pin is a port pin.
    pub rstdisbl: Option<Fuse>,
    /// Brown-out detector, by [`Fuses::bod_mv`].
    pub bodlevel: Fuse,
    /// Level of the detector by the value of BODLEVEL in millivolts (table 29-8, typical); 0 is off.
    pub bod_mv: &'static [u32],
}

/// The units of a chip, by number.
#[rustfmt::skip]
#[allow(missing_docs)]
pub mod unit {
    pub const TIMER:      usize = 0;
    pub const USART:      usize = 4;
    pub const SPI:        usize = 6;
    pub const TWI:        usize = 7;
    pub const ADC:        usize = 8;
    pub const COMPARATOR: usize = 9;
    pub const EEPROM:     usize = 10;
    pub const SPM:        usize = 11;
    pub const WATCHDOG:   usize = 12;
    pub const EXTERNAL:   usize = 13;
    pub const COUNT:      usize = 14;
}

impl Part {
    /// What the trigger source `source` (1 to 7) of the converter is.
    #[must_use]
    pub fn trigger(&self, source: u8) -> Option<(usize, u8)> {
        self.triggers.get(usize::from(source).checked_sub(1)?).copied()
    }

    /// True for registers that may read otherwise in every cycle, or do something when they are read: a loop over one of them
    /// can never be jumped over.
    #[must_use]
    pub fn restless(&self, reg: u16) -> bool {
        use timers::Reg::{ICRL, TCNTL};
        let site = self.sites.get(usize::from(reg)).copied().unwrap_or(Site::Reserved);
        matches!(site, Site::Timer(_, TCNTL | ICRL) | Site::Usart(_, usart::Reg::UDR) | Site::Spi(_))
    }
}

/// What stands at a data address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Site {
    /// Nothing: reads 0.
    Reserved,
    /// A register of the core.
    Core,
    /// PINx, DDRx and PORTx of a port, 0 to 2.
    Port(u8, u8),
    /// A register of a timer.
    Timer(u8, timers::Reg),
    /// A register of a USART.
    Usart(u8, usart::Reg),
    /// A register of the serial peripheral interface.
    Spi(spi::Reg),
    /// A register of the two-wire interface.
    Twi(twi::Reg),
    /// A register of the converter.
    Adc(adc::Reg),
    /// A register of the comparator.
    Comparator(comparator::Reg),
    /// A register of the EEPROM.
    Eeprom(eeprom::Reg),
    /// SPMCSR.
    Spm(spm::Reg),
    /// WDTCSR.
    Watchdog(guard::Reg),
    /// A register of the external interrupts.
    External(external::Reg),
    /// A register of the chip itself.
    Own(Own),
    /// A byte that is only kept, by its number.
    Kept(u8),
    /// Bits of several registers: the bit here, and where it stands.
    Split(&'static [(u8, Site, u8)]),
}

/// Registers of the chip that belong to no unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Own {
    MCUCR,
    MCUSR,
    SMCR,
    CLKPR,
    PRR,
    OSCCAL,
    GTCCR,
}

/// The table of addresses from rows.
const fn sites(rows: &[(u16, Site)]) -> [Site; 0x100] {
    let mut all = [Site::Reserved; 0x100];
    let mut i = 0;
    while i < rows.len() {
        all[rows[i].0 as usize] = rows[i].1;
        i += 1;
    }
    all
}

impl Fuses {
    /// The value of a fuse in these bytes: 0 is programmed.
    #[must_use]
    pub const fn value(bytes: [u8; 3], fuse: Fuse) -> u8 {
        let (byte, bit, bits) = fuse;
        bytes[byte as usize % 3] >> bit & ((1 << bits) - 1)
    }

    /// A single fuse is programmed; false where there is none.
    #[must_use]
    pub fn programmed(bytes: [u8; 3], fuse: Option<Fuse>) -> bool {
        fuse.is_some_and(|fuse| Fuses::value(bytes, fuse) == 0)
    }
}
