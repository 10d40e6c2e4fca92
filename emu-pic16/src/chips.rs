//! Chip data of the PIC16 family: one row per chip.
//!
//! Sources: the data sheet that [`Chip::data_sheet`] names, its sections "Memory organization", "Special
//! features of the CPU", "Electrical characteristics" and its pin descriptions; device IDs by the programming
//! specifications (DS39025 16F87X, DS39589 16F87XA, DS30262 16F84A, DS41196 16F62XA, DS39603 16F81X, DS39607
//! 16F87 and 88). The default clock is 4 MHz for all chips, at which an instruction cycle takes 1 us; no data
//! sheet names a usual clock.

mod bits;
mod config;
mod data;
mod f62x;
mod f87x;
mod f88;
mod f8x;
mod names;
mod pins;
mod regs;

use emu_core::chip::Chip;
use emu_core::pins::PinId;

use crate::periph::map::{InterruptFlag, Pic16Line, Sfr};

pub use bits::ALIASES;
pub use config::{ConfigLayout, OscillatorMode};
pub use f87x::PIC16F873;

/// Rows of all chips of this crate.
pub const PIC16_PARTS: &[Pic16Part] = &[
    f8x::PIC16C71,
    f8x::PIC16C84,
    f8x::PIC16F84,
    f8x::PIC16F84A,
    f62x::PIC16F628,
    f62x::PIC16F628A,
    f62x::PIC16F648A,
    f88::PIC16F818,
    f88::PIC16F819,
    f88::PIC16F87,
    f88::PIC16F88,
    f87x::PIC16F870,
    f87x::PIC16F871,
    f87x::PIC16F872,
    PIC16F873,
    f87x::PIC16F873A,
    f87x::PIC16F874,
    f87x::PIC16F874A,
    f87x::PIC16F876,
    f87x::PIC16F876A,
    f87x::PIC16F877,
    f87x::PIC16F877A,
];

/// Returns the row of the chip `name`; upper and lower case are equal.
#[must_use]
pub fn part(name: &str) -> Option<&'static Pic16Part> {
    PIC16_PARTS.iter().find(|p| p.chip.name.eq_ignore_ascii_case(name))
}

/// Returns the chip `name`; upper and lower case are equal.
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|p| &p.chip)
}

/// Yields all chips of this crate, in the order of [`PIC16_PARTS`].
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    PIC16_PARTS.iter().map(|p| &p.chip)
}

/// Row of a chip: the data common to all families, and the data that only PIC16 chips have.
#[derive(Debug)]
pub struct Pic16Part {
    /// Data common to all families. `regs` lists every register once, at its lowest address, with the name in
    /// this chip's data sheet.
    pub chip: Chip,
    /// Registers by address in data memory, including all mirrors. Addresses neither here nor in
    /// `chip.ram_ranges` are unimplemented.
    pub sfr: &'static [(u16, Sfr)],
    /// Bits of registers by the names of the headers, in which slashes and bars are spelled out (GO_NOT_DONE,
    /// NOT_TO). If a bit has several names, the first is that of the data sheet.
    pub bits: &'static [SfrBit],
    /// Ports of the chip.
    pub ports: &'static [PortPins],
    /// Master clear pin, dedicated or shared with a port.
    pub mclr: PinId,
    /// Lines between peripherals and pins.
    pub lines: &'static [PeripheralPin],
    /// Interrupt flags and their enable bits.
    pub flags: &'static [FlagLocation],
    /// Pins of the analog inputs AN0, AN1 and so on.
    pub analog: &'static [PinId],
    /// Number of CCP modules, 0 to 2.
    pub ccps: u8,
    /// True if the chip has timers 1 and 2.
    pub timers: bool,
    /// Variant of the synchronous serial port.
    pub ssp: SspKind,
    /// True if the chip has a USART.
    pub usart: bool,
    /// Variant of the analog-to-digital converter.
    pub adc: Pic16AdcKind,
    /// Variant of the comparators.
    pub comparators: ComparatorKind,
    /// True if the chip has a parallel slave port on ports D and E.
    pub psp: bool,
    /// How a program writes the EEPROM and program memory.
    pub memory: NonvolatileKind,
    /// Variant of the internal oscillator.
    pub internal: InternalOscillator,
    /// Layout of the configuration words.
    pub config: ConfigLayout,
    /// Device ID at 2006h with revision bits 0; None if the chip has none.
    pub device_id: Option<u16>,
    /// Time ranges of the chip.
    pub times: TimingRanges,
}

/// A named bit of a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SfrBit {
    /// The register.
    pub sfr: Sfr,
    /// The name in the manufacturer's header.
    pub name: &'static str,
    /// The number of the bit, 0 to 7.
    pub bit: u8,
}

/// What is at an address of data memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileSlot {
    /// RAM, with the canonical address under which the byte is stored.
    Ram(u16),
    /// A register.
    Sfr(Sfr),
    /// Unimplemented: reads 0, writes are lost.
    None,
}

impl Pic16Part {
    /// Returns what is at `addr` in data memory, 0 to 1FFh. Higher address bits are not decoded.
    #[must_use]
    pub fn file_slot(&self, addr: u16) -> FileSlot {
        let addr = addr & 0x1FF;
        if let Some(&(_, sfr)) = self.sfr.iter().find(|s| s.0 == addr) {
            return FileSlot::Sfr(sfr);
        }
        match self.chip.ram_ranges.iter().find(|r| r.first <= addr && addr <= r.last) {
            Some(r) => FileSlot::Ram(r.canonical + (addr - r.first)),
            None => FileSlot::None,
        }
    }

    /// Returns [`Pic16Part::file_slot`] for all addresses, for callers with many lookups.
    #[must_use]
    pub fn file_slots(&self) -> [FileSlot; 0x200] {
        let mut addr = 0;
        [(); 0x200].map(|()| {
            addr += 1;
            self.file_slot(addr - 1)
        })
    }

    /// Reports whether the chip has the register.
    #[must_use]
    pub fn has(&self, sfr: Sfr) -> bool {
        self.sfr.iter().any(|s| s.1 == sfr)
    }

    /// Returns the lowest address of a register.
    #[must_use]
    pub fn addr(&self, sfr: Sfr) -> Option<u16> {
        self.sfr.iter().filter(|s| s.1 == sfr).map(|s| s.0).min()
    }

    /// Returns the row of a line, if the chip has the line.
    #[must_use]
    pub fn line(&self, line: Pic16Line) -> Option<&'static PeripheralPin> {
        self.lines.iter().find(|l| l.line == line)
    }
}

/// A port and its pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortPins {
    /// Port register, PORTA to PORTE.
    pub port: Sfr,
    /// Direction register, TRISA to TRISE.
    pub tris: Sfr,
    /// Pin of each bit; [`NO_PIN`] if the bit has none.
    pub pins: [PinId; 8],
    /// Mask of the bits that are always inputs, regardless of TRIS.
    pub inputs: u8,
    /// Mask of the bits with an open drain output.
    pub open: u8,
}

/// Marks the absence of a pin.
pub const NO_PIN: PinId = PinId::MAX;

/// A line of a peripheral and its pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeripheralPin {
    /// The line.
    pub line: Pic16Line,
    /// Pin of the line.
    pub pin: PinId,
    /// True if the output of the peripheral reaches the pin even if TRIS makes it an input.
    pub over_tris: bool,
}

/// Position of an interrupt flag and of its enable bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlagLocation {
    /// The flag.
    pub flag: InterruptFlag,
    /// Register and bit of the flag.
    pub at: SfrBitPlace,
    /// Register and bit of the enable.
    pub enable: SfrBitPlace,
    /// True if PEIE must be set too.
    pub peripheral: bool,
}

/// Variants of the synchronous serial port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SspKind {
    /// None.
    None,
    /// SSP: SPI, and I2C as slave (as master only by software).
    Basic,
    /// MSSP: also I2C as master.
    Master,
    /// MSSP of the A parts: as a slave it can also stretch the clock after reception (SEN).
    MasterStretch,
}

/// Variants of the analog-to-digital converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pic16AdcKind {
    /// None.
    None,
    /// 8 bits (16C71).
    Bits8,
    /// 10 bits, ADCS1:ADCS0 (16F87x).
    Bits10,
    /// 10 bits with ADCS2 (16F87xA, 818, 819).
    Bits10Adcs2,
    /// 10 bits, ADCS2, and ANSEL instead of PCFG (16F88).
    Ansel,
}

/// Variants of the comparators and their reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparatorKind {
    /// None.
    None,
    /// 16F62x: outputs on RA3 and RA4; VREF.
    F62x,
    /// 16F87xA: outputs on RA4 and RA5; CVREF.
    F87xA,
    /// 16F87 and 16F88: outputs on RA3 and RA4; CVREF.
    F88,
}

/// Variants of how a program writes EEPROM and program memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NonvolatileKind {
    /// Not possible (16C71).
    None,
    /// EEPROM only, with EEIF in EECON1 (16F84).
    F84,
    /// EEPROM only, with EEIF in PIR1 (16F628).
    F62x,
    /// EEPROM, and program memory one word at a time (16F87x).
    Word,
    /// EEPROM, and program memory in blocks of four words, which a write erases (16F87xA).
    Block4,
    /// EEPROM; program memory can only be read. 16F870, 871 and 872 can also write it:
    /// [`NonvolatileKind::Word`].
    Read,
    /// EEPROM; program memory is erased in rows of 32 words (FREE) and written in blocks of four (818, 819,
    /// 87, 88).
    Row32,
}

/// Variants of the internal oscillator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InternalOscillator {
    /// None.
    None,
    /// 4 MHz, or a slow frequency selected by OSCF in PCON (16F62x): the slow frequency in Hz.
    F62x(u32),
    /// 31.25 kHz to 8 MHz, selected by OSCCON (818, 819, 87, 88).
    Osccon,
}

/// Time ranges in microseconds: minimum, typical, maximum (data sheet, "Electrical characteristics", tables
/// of AC parameters).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimingRanges {
    /// Watchdog period without prescaler.
    pub wdt: [u32; 3],
    /// Duration of the power-up timer.
    pub pwrt: [u32; 3],
    /// Time to write a byte of EEPROM.
    pub eeprom: [u32; 3],
    /// Time to write program memory (a word, or a block).
    pub flash: [u32; 3],
    /// TAD of the converter's own RC oscillator, in nanoseconds.
    pub adc_rc_ns: [u32; 3],
}

/// A bit of a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SfrBitPlace {
    /// The register.
    pub sfr: Sfr,
    /// The number of the bit, 0 to 7.
    pub bit: u8,
}
