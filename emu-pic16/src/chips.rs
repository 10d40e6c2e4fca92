//! The chips of the family, one row each.
//!
//! Sources: the data sheet that [`Chip::data_sheet`] names, its sections "Memory organization", "Special features of the CPU",
//! "Electrical characteristics" and its pin descriptions; device IDs by the programming specifications (DS39025 16F87X,
//! DS39589 16F87XA, DS30262 16F84A, DS41196 16F62XA, DS39603 16F81X, DS39607 16F87 and 88). The clock that is assumed when
//! none is given is 4 MHz everywhere, at which an instruction cycle takes a microsecond: no data sheet names a usual clock.

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

/// All chips of this crate.
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

/// The part `name` (case aside).
#[must_use]
pub fn part(name: &str) -> Option<&'static Pic16Part> {
    PIC16_PARTS.iter().find(|p| p.chip.name.eq_ignore_ascii_case(name))
}

/// The chip `name` (case aside).
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|p| &p.chip)
}

/// All chips of this crate, in the order of [`PIC16_PARTS`].
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    PIC16_PARTS.iter().map(|p| &p.chip)
}

/// A chip, with what only this family has.
#[derive(Debug)]
pub struct Pic16Part {
    /// What all families have. `regs` lists every register once, at its lowest address, by the name of this chip's data
    /// sheet.
    pub chip: Chip,
    /// Registers by address in data memory, every mirror included. What is neither here nor in `chip.ram_ranges` is unimplemented.
    pub sfr: &'static [(u16, Sfr)],
    /// Bits of registers by the names of the headers, in which strokes and bars are written out (GO_NOT_DONE, NOT_TO). Where
    /// a bit has several names the first is that of the data sheet.
    pub bits: &'static [SfrBit],
    /// Ports.
    pub ports: &'static [PortPins],
    /// Master clear, where it has a pin of its own or shares one.
    pub mclr: PinId,
    /// Lines between parts and pins, and how they reach them.
    pub lines: &'static [PeripheralPin],
    /// Interrupt flags and their enables.
    pub flags: &'static [FlagLocation],
    /// Analog inputs: the pin of AN0, AN1, ..
    pub analog: &'static [PinId],
    /// CCP modules: 0 to 2.
    pub ccps: u8,
    /// There are timers 1 and 2.
    pub timers: bool,
    /// Synchronous serial port.
    pub ssp: SspKind,
    /// There is a USART.
    pub usart: bool,
    /// Analog-to-digital converter.
    pub adc: Pic16AdcKind,
    /// Comparators.
    pub comparators: ComparatorKind,
    /// There is a parallel slave port on ports D and E.
    pub psp: bool,
    /// How the EEPROM and program memory are written by the program.
    pub memory: NonvolatileKind,
    /// The oscillator on the chip.
    pub internal: InternalOscillator,
    /// The configuration words.
    pub config: ConfigLayout,
    /// The device ID at 2006h, revision bits 0; `None` where there is none.
    pub device_id: Option<u16>,
    /// Times.
    pub times: TimingRanges,
}

/// A named bit: register, name, number.
pub type SfrBit = (Sfr, &'static str, u8);

/// What an address of data memory is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileSlot {
    /// RAM, and the address under which the byte is kept.
    Ram(u16),
    /// A register.
    Sfr(Sfr),
    /// Nothing: reads 0, writes are lost.
    None,
}

impl Pic16Part {
    /// What stands at `addr` in data memory, 0 to 1FFh. Higher bits are not decoded.
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

    /// [`Pic16Part::file_slot`] of all addresses: for those who look places up often.
    #[must_use]
    pub fn file_slots(&self) -> [FileSlot; 0x200] {
        let mut addr = 0;
        [(); 0x200].map(|()| {
            addr += 1;
            self.file_slot(addr - 1)
        })
    }

    /// Whether the chip has the register.
    #[must_use]
    pub fn has(&self, sfr: Sfr) -> bool {
        self.sfr.iter().any(|s| s.1 == sfr)
    }

    /// The lowest address of a register.
    #[must_use]
    pub fn addr(&self, sfr: Sfr) -> Option<u16> {
        self.sfr.iter().filter(|s| s.1 == sfr).map(|s| s.0).min()
    }

    /// The line's row, where the chip has the line.
    #[must_use]
    pub fn line(&self, line: Pic16Line) -> Option<&'static PeripheralPin> {
        self.lines.iter().find(|l| l.line == line)
    }
}

/// A port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortPins {
    /// PORTA to PORTE.
    pub port: Sfr,
    /// TRISA to TRISE.
    pub tris: Sfr,
    /// The pin of every bit; [`NO_PIN`] where there is none.
    pub pins: [PinId; 8],
    /// Bits that are inputs only, whatever TRIS says.
    pub inputs: u8,
    /// Bits with an open drain.
    pub open: u8,
}

/// No pin.
pub const NO_PIN: PinId = PinId::MAX;

/// A line and its pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeripheralPin {
    /// The line.
    pub line: Pic16Line,
    /// Its pin.
    pub pin: PinId,
    /// What a part drives reaches the pin even where TRIS makes it an input.
    pub over_tris: bool,
}

/// Where a flag and its enable stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlagLocation {
    /// The flag.
    pub flag: InterruptFlag,
    /// Register and bit of the flag.
    pub at: (Sfr, u8),
    /// Register and bit of its enable.
    pub enable: (Sfr, u8),
    /// PEIE must be set too.
    pub peripheral: bool,
}

/// Synchronous serial port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SspKind {
    /// None.
    None,
    /// SSP: SPI, and I2C as slave (and master by software).
    Basic,
    /// MSSP: the I2C master too.
    Master,
    /// MSSP of the A parts, which as a slave can hold the clock after reception as well (SEN).
    MasterStretch,
}

/// Analog-to-digital converter.
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
    /// 10 bits, ADCS2, ANSEL in place of PCFG (16F88).
    Ansel,
}

/// Comparators and their reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ComparatorKind {
    /// None.
    None,
    /// 16F62x: outputs on RA3, RA4; VREF.
    F62x,
    /// 16F87xA: outputs on RA4, RA5; CVREF.
    F87xA,
    /// 16F87 and 16F88.
    F88,
}

/// How the program writes EEPROM and program memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NonvolatileKind {
    /// Neither (16C71).
    None,
    /// EEPROM only, EEIF in EECON1 (16F84).
    F84,
    /// EEPROM only, EEIF in PIR1 (16F628).
    F62x,
    /// Program memory too, a word at a time (16F87x).
    Word,
    /// Program memory in blocks of four words, which it erases (16F87xA).
    Block4,
    /// Program memory can only be read (16F870, 871, 872 write too: [`NonvolatileKind::Word`]).
    Read,
    /// Program memory is erased in rows of 32 words (FREE) and written in blocks of four (818, 819, 87, 88).
    Row32,
}

/// The oscillator on the chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InternalOscillator {
    /// None.
    None,
    /// 4 MHz, or slow by OSCF in PCON (16F62x): the slow frequency in Hz.
    F62x(u32),
    /// 31.25 kHz to 8 MHz by OSCCON (818, 819, 87, 88).
    Osccon,
}

/// Times in microseconds: minimum, typical, maximum (data sheet, "Electrical characteristics", tables of AC parameters).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimingRanges {
    /// Watchdog period without prescaler.
    pub wdt: [u32; 3],
    /// Power-up timer.
    pub pwrt: [u32; 3],
    /// Writing a byte of EEPROM.
    pub eeprom: [u32; 3],
    /// Writing program memory (a word, or a block).
    pub flash: [u32; 3],
    /// TAD of the ADC's own RC oscillator, in nanoseconds.
    pub adc_rc_ns: [u32; 3],
}
