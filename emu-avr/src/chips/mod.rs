//! Chip data of the AVR family: one row per chip.
//!
//! Source: the data sheet that [`Chip::data_sheet`] names: register summary, interrupt vectors, memories, pin
//! configuration, alternate port functions, fuses, boot loader parameters.

mod bits;
mod classic;
mod fuses;
mod m128;
mod m16;
mod m162;
mod m644;
mod m8;
mod names;
mod register_presence;
mod x8;

use emu_core::chip::{Chip, ChipFamily, ChipSpace, PinDef};
use emu_core::image::{ImageSpace, WordBits};
use emu_core::pins::PinId;

use crate::periph::timers::TimerShape;
use crate::periph::{AvrLine, adc, comparator, eeprom, external, spi, spm, timers, twi, usart, watchdog};

pub use fuses::{FuseByte, FuseField, FuseLayout, StartUpTime, StartUpTimes};
pub use names::HeaderNames;
pub use register_presence::RegisterPresence;
pub use x8::{ATMEGA328, ATMEGA328P, PART_328P};

/// Rows of all chips of this crate.
pub const AVR_PARTS: &[&AvrPart] = &[
    &x8::PART_328P,
    &x8::PART_328,
    &x8::PART_168,
    &x8::PART_168A,
    &x8::PART_168P,
    &x8::PART_168PA,
    &x8::PART_88,
    &x8::PART_88A,
    &x8::PART_88P,
    &x8::PART_88PA,
    &x8::PART_48,
    &x8::PART_48A,
    &x8::PART_48P,
    &x8::PART_48PA,
    &m8::PART_8,
    &m16::PART_16,
    &m16::PART_32,
    &m128::PART_64,
    &m128::PART_128,
    &m162::PART_162,
    &m644::PART_164P,
    &m644::PART_164PA,
    &m644::PART_164A,
    &m644::PART_324P,
    &m644::PART_324PA,
    &m644::PART_324A,
    &m644::PART_644,
    &m644::PART_644P,
    &m644::PART_644PA,
    &m644::PART_644A,
    &m644::PART_1284,
    &m644::PART_1284P,
];

/// All chips of this crate.
pub const AVR_CHIPS: &[&Chip] = &{
    let mut chips = [AVR_PARTS[0].chip; AVR_PARTS.len()];
    let mut i = 0;
    while i < AVR_PARTS.len() {
        chips[i] = AVR_PARTS[i].chip;
        i += 1;
    }
    chips
};

/// Returns the chip `name`; upper and lower case are equal.
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|part| part.chip)
}

/// Returns the row of the chip `name`; upper and lower case are equal.
#[must_use]
pub fn part(name: &str) -> Option<&'static AvrPart> {
    AVR_PARTS.iter().copied().find(|part| part.chip.name.eq_ignore_ascii_case(name))
}

/// Row of a chip: the data common to all families, and the data that only AVR chips have.
#[derive(Debug)]
pub struct AvrPart {
    /// Data common to all families. Its pins are listed eight per port, by bit, including absent ones.
    pub chip: &'static Chip,
    /// Mask of the existing bits of each port; after the ports, masks of pins that belong to no port.
    pub ports: &'static [u8],
    /// Register slot at each data address below 100h.
    pub register_slots: &'static [RegisterSlot; 0x100],
    /// Pin of each line of a unit: unit, line, pin.
    pub peripheral_pins: &'static [(usize, AvrLine, PinId)],
    /// Pin and number of each pin change input.
    pub pin_changes: &'static [(PinId, u8)],
    /// True if a reset sets SP to the last address of RAM; otherwise it sets SP to 0.
    pub stack_starts_at_ram_end: bool,
    /// True if writing ones to PINx toggles PORTx.
    pub pin_writes_toggle: bool,
    /// True if SBI and CBI read a register and write all of it, including flags that read as one; otherwise
    /// they change only the one bit.
    pub bit_writes_whole_register: bool,
    /// Existing bits of MCUCR, in the layout of the ATmega1284P: JTD, BODS, BODSE, PUD, IVSEL, IVCE.
    pub mcucr: u8,
    /// Source of each interrupt from vector 1 on: unit, and interrupt number in it.
    pub interrupt_sources: &'static [(usize, u8)],
    /// Shape of each timer/counter.
    pub timers: &'static [TimerShape],
    /// Variant of the converter.
    pub adc_kind: adc::AvrAdcKind,
    /// Pins of ADC0, ADC1 and so on.
    pub analog_pins: &'static [PinId],
    /// Pins of AIN0 and AIN1.
    pub comparator_pins: [PinId; 2],
    /// Trigger sources of the converter for ADTS 1 to 7: unit, and interrupt number in it.
    pub adc_triggers: &'static [AdcTrigger],
    /// Variant of the EEPROM.
    pub eeprom_kind: eeprom::AvrEepromKind,
    /// Variant of self-programming.
    pub spm_kind: spm::SpmKind,
    /// Variant of the external interrupts.
    pub external_kind: external::ExternalKind,
    /// Variant of the watchdog.
    pub watchdog_kind: watchdog::WatchdogKind,
    /// Bits of PRR and, from 8 on, of PRR1, each with the unit whose clock it stops.
    pub power_reduction_bits: &'static [(u8, usize)],
    /// Signature bytes (28.3).
    pub signature: [u8; 3],
    /// Positions and meanings of the fuses.
    pub fuses: FuseLayout,
    /// Identity of the reset pin.
    pub reset_pin: PinId,
    /// Pins of the JTAG interface: TCK, TMS, TDO, TDI. Empty on a chip without one.
    pub jtag_pins: &'static [PinId],
    /// Names of bits and fuses.
    pub names: HeaderNames,
}

/// Numbers of the units of a chip. A chip has up to four timers and two USARTs, numbered consecutively.
#[rustfmt::skip]
#[allow(missing_docs)]
pub mod unit_index {
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

/// An event that starts a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AdcTrigger {
    /// The position of the unit in the chip.
    pub unit: usize,
    /// The number of the interrupt in the unit.
    pub interrupt: u8,
}

impl AvrPart {
    /// Returns the trigger source `source` (1 to 7) of the converter: unit, and interrupt number in it.
    #[must_use]
    pub fn adc_trigger(&self, source: u8) -> Option<AdcTrigger> {
        self.adc_triggers.get(usize::from(source).checked_sub(1)?).copied()
    }

    /// Returns the first byte address of the boot section that BOOTSZ in `fuses` selects, or the end of flash
    /// on a chip without a boot section. The largest boot section is the NRWW section; each higher value of
    /// BOOTSZ halves the size.
    #[must_use]
    pub fn boot_start(&self, fuses: [u8; 3]) -> u32 {
        let flash = self.spm_kind.flash;
        let size = self.fuses.bootsz.map_or(0, |fuse| (flash - self.spm_kind.nrww) >> FuseLayout::value(fuses, fuse));
        flash - size
    }

    /// The fuse byte that makes a reset begin at the byte address `at`, where `fuses` has the others; none
    /// where no boot section begins there.
    #[must_use]
    pub fn boot_fuse(&self, fuses: [u8; 3], at: u32) -> Option<FuseByte> {
        let (FuseField { byte, bit: low, bits }, FuseField { bit: reset, .. }) =
            (self.fuses.bootsz?, self.fuses.bootrst?);
        (0..1 << bits).find_map(|size: u8| {
            let mut with = fuses;
            let place = with.get_mut(usize::from(byte))?;
            *place = *place & !(((1 << bits) - 1) << low) & !(1 << reset) | size << low;
            let value = *place;
            (self.boot_start(with) == at).then_some(FuseByte { index: byte, value })
        })
    }

    /// Returns the name of the pin at which USART `number` transmits; `None` if the chip does not have it.
    #[must_use]
    pub fn transmit_pin(&self, number: usize) -> Option<&'static str> {
        let line = (unit_index::USART + number, AvrLine::Txd);
        let row = self.peripheral_pins.iter().find(|(unit, name, _)| (*unit, *name) == line)?;
        self.chip.pins.get(usize::from(row.2)).map(|pin| pin.name)
    }

    /// Reports whether the pin `name` belongs to the JTAG interface, which JTD disables.
    #[must_use]
    pub fn is_jtag_pin(&self, name: &str) -> bool {
        let named = |pin: &PinId| self.chip.pins.get(usize::from(*pin)).is_some_and(|row| row.name == name);
        self.jtag_pins.iter().any(named)
    }

    /// Reports whether a register can change in every cycle, or has a side effect when it is read. A loop
    /// that reads such a register is never skipped.
    #[must_use]
    pub fn volatile_register(&self, reg: u16) -> bool {
        use timers::TimerRegister::{ICRL, TCNTL};
        let site = self.register_slots.get(usize::from(reg)).copied().unwrap_or(RegisterSlot::Reserved);
        matches!(
            site,
            RegisterSlot::Timer(_, TCNTL | ICRL)
                | RegisterSlot::Usart(_, usart::UsartRegister::UDR)
                | RegisterSlot::Spi(_)
                | RegisterSlot::Ursel(_)
        )
    }
}

/// What is at a data address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegisterSlot {
    /// Nothing: reads 0.
    Reserved,
    /// A register of the core.
    Core,
    /// RAM below 100h, by its data address.
    Low(u8),
    /// Register of a port: port number, then 0 for PINx, 1 for DDRx, 2 for PORTx.
    Port(u8, u8),
    /// A register of a timer.
    Timer(u8, timers::TimerRegister),
    /// A register of a USART.
    Usart(u8, usart::UsartRegister),
    /// UBRRH and UCSRC of a USART, which share an address; bit 7, URSEL, selects one.
    Ursel(u8),
    /// A register of the SPI.
    Spi(spi::SpiRegister),
    /// A register of the two-wire interface.
    Twi(twi::TwiRegister),
    /// A register of the ADC.
    Adc(adc::AdcRegister),
    /// A register of the analog comparator.
    Comparator(comparator::ComparatorRegister),
    /// A register of the EEPROM.
    Eeprom(eeprom::EepromRegister),
    /// SPMCSR.
    Spm(spm::SpmRegister),
    /// WDTCSR.
    Watchdog(watchdog::WatchdogRegister),
    /// A register of the external interrupts.
    External(external::ExternalRegister),
    /// A register of the chip that belongs to no unit.
    Own(SocRegister),
    /// A byte without function, which only stores what is written, by its number.
    Kept(u8),
    /// Bits of several registers.
    Split(&'static [SplitBit]),
}

/// Registers of the chip that belong to no unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum SocRegister {
    MCUCR,
    MCUSR,
    SMCR,
    CLKPR,
    PRR,
    PRR1,
    OSCCAL,
    GTCCR,
    RAMPZ,
}

/// Names of the core's registers, in the order in which they are displayed.
const CPU_REGS: &[&str] = &[
    "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "r13", "r14", "r15", "r16", "r17",
    "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31", "SREG", "SP",
    "PC",
];

/// Memories of a chip: flash in bytes, first RAM address, RAM end address (exclusive), EEPROM in bytes,
/// number of fuse bytes.
struct ChipMemories<const FLASH: u32, const RAM: u16, const END: u16, const EEPROM: u16, const FUSES: u32>;

impl<const FLASH: u32, const RAM: u16, const END: u16, const EEPROM: u16, const FUSES: u32>
    ChipMemories<FLASH, RAM, END, EEPROM, FUSES>
{
    /// Chip data that follows from the memories; the chip's row sets the other fields.
    const CHIP: Chip = Chip {
        name: "",
        family: ChipFamily::Avr,
        isa: &crate::isa::instruction_set::<FLASH>(),
        title: "",
        data_sheet: "",
        code_space: "flash",
        flash_bytes: FLASH,
        on_chip_flash_bytes: FLASH,
        ram_space: "data",
        ram_start: RAM,
        ram_len: END - RAM,
        ram_ranges: &[],
        eeprom_bytes: EEPROM,
        word_bytes: 2,
        max_hz: 16_000_000,
        default_hz: 16_000_000,
        hex_spaces: &[ImageSpace { name: "flash", start: 0, len: FLASH, word: 2, word_bits: WordBits::All }],
        elf_spaces: &[
            ImageSpace { name: "flash", start: 0, len: FLASH, word: 2, word_bits: WordBits::All },
            ImageSpace { name: "data", start: 0x80_0000, len: END as u32, word: 1, word_bits: WordBits::All },
            ImageSpace { name: "eeprom", start: 0x81_0000, len: EEPROM as u32, word: 1, word_bits: WordBits::All },
            ImageSpace { name: "fuse", start: 0x82_0000, len: FUSES, word: 1, word_bits: WordBits::All },
            ImageSpace { name: "lock", start: 0x83_0000, len: 1, word: 1, word_bits: WordBits::All },
            ImageSpace { name: "signature", start: 0x84_0000, len: 3, word: 1, word_bits: WordBits::All },
        ],
        elf_machine: 83,
        cpu_regs: CPU_REGS,
        reg_space: "data",
        bits: &[],
        regs: &[],
        pins: &[],
        constants: Vec::new,
        vectors: &[],
        words_per_vector: if FLASH > 0x2000 { 2 } else { 1 },
        packages: &[],
        later_vectors_back_words: 0,
        spaces: &[
            ChipSpace::new("data", END as u32, 1),
            ChipSpace::new("flash", FLASH, 1),
            ChipSpace::new("eeprom", EEPROM as u32, 1),
            ChipSpace::new("fuse", FUSES, 1),
            ChipSpace::new("lock", 1, 1),
        ],
        observable_spaces: &[("data", 0x20)],
        // SPL, SPH, SREG.
        implicit_accesses: &[("data", 0x5D), ("data", 0x5E), ("data", 0x5F)],
    };
}

/// Chip data of `$chip` under another name and title.
macro_rules! named_chip {
    ($name:literal, $title:literal, $chip:expr) => {
        emu_core::chip::Chip {
            name: $name,
            title: $title,
            constants: || $crate::chips::names::names_of_chip($name),
            ..$chip
        }
    };
}
use named_chip;

/// List of registers: data address, name, older names, register slot.
macro_rules! registers {
    ($($addr:literal $name:literal $(/ $old:literal)* $site:expr;)*) => {
        /// Register summary, data addresses.
        const REGS: &[NamedAddress] = &[ $( NamedAddress { name: $name, addr: $addr }, $( NamedAddress { name: $old, addr: $addr }, )* )* ];
        /// Register slot of each register.
        const SITES: &[$crate::chips::RegisterRow] = &[ $( $crate::chips::RegisterRow { addr: $addr, slot: $site } ),* ];
    };
}
use registers;

/// List of pins: name, number in the package, note.
macro_rules! pins {
    ($($name:literal $dip:literal $note:literal)*) => {
        &[ $( emu_core::chip::PinDef { name: $name, dip: $dip, note: $note } ),* ]
    };
}
use pins;

/// Mask for ADC6 and ADC7 where they belong to no port: two bits of a port without registers.
const ANALOG: u8 = 0x03;

/// Pin numbers of the 32-pin flat package of ATmega8 and ATmega48 to 328 (pin configurations), in the order
/// ports B, C, D, ADC6, ADC7.
#[rustfmt::skip]
const TQFP32: [u8; 26] = [
    12, 13, 14, 15, 16, 17, 7, 8,  23, 24, 25, 26, 27, 28, 29, 0,  30, 31, 32, 1, 2, 9, 10, 11,  19, 22,
];

/// Returns the pin numbers of [`PinDef::dip`].
const fn dip<const N: usize>(pins: &[PinDef]) -> [u8; N] {
    let mut numbers = [0; N];
    let mut i = 0;
    while i < N && i < pins.len() {
        numbers[i] = pins[i].dip;
        i += 1;
    }
    numbers
}

/// A row of a register table.
#[derive(Debug, Clone, Copy)]
struct RegisterRow {
    /// The data address.
    addr: u16,
    /// The register at this address.
    slot: RegisterSlot,
}

/// Returns the table of register slots from `rows`. Addresses from `ram` to FFh are RAM.
const fn sites(rows: &[RegisterRow], ram: u16) -> [RegisterSlot; 0x100] {
    let mut all = [RegisterSlot::Reserved; 0x100];
    let mut i = ram as usize;
    while i < all.len() {
        all[i] = RegisterSlot::Low(i as u8);
        i += 1;
    }
    i = 0;
    while i < rows.len() {
        all[rows[i].addr as usize] = rows[i].slot;
        i += 1;
    }
    all
}

/// A bit of a register that belongs to another register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SplitBit {
    /// The bit in this register.
    pub bit: u8,
    /// The other register.
    pub slot: RegisterSlot,
    /// The bit there.
    pub its_bit: u8,
}
