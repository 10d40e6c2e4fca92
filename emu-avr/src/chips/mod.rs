//! The chips of the family, one row each.
//!
//! Source: the data sheet that [`Chip::data_sheet`] names: register summary, interrupt vectors, memories, pin configuration,
//! alternate port functions, fuses, boot loader parameters.

mod bits;
mod classic;
mod fuses;
mod m128;
mod m16;
mod m162;
mod m8;
mod names;
mod register_presence;
mod x8;

use emu_core::chip::{Chip, ChipFamily, PinDef};
use emu_core::image::{ImageSpace, WordBits};
use emu_core::pins::PinId;

use crate::periph::timers::TimerShape;
use crate::periph::{AvrLine, adc, comparator, eeprom, external, spi, spm, timers, twi, usart, watchdog};

pub use fuses::{FuseByte, FuseField, FuseLayout, StartUpTime, StartUpTimes};
pub use names::HeaderNames;
pub use x8::{ATMEGA328, ATMEGA328P, PART_328P};

/// All parts of this crate.
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

/// The chip `name` (case aside).
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|part| part.chip)
}

/// The part `name` (case aside).
#[must_use]
pub fn part(name: &str) -> Option<&'static AvrPart> {
    AVR_PARTS.iter().copied().find(|part| part.chip.name.eq_ignore_ascii_case(name))
}

/// A chip, with what only this family has.
#[derive(Debug)]
pub struct AvrPart {
    /// What all families have. Pins stand eight to a port, by bits, absent ones included.
    pub chip: &'static Chip,
    /// The bits of each port that there are; behind the ports, pins that belong to none.
    pub ports: &'static [u8],
    /// What stands at each data address below 100h.
    pub register_slots: &'static [RegisterSlot; 0x100],
    /// Which pin a line of a unit goes to.
    pub peripheral_pins: &'static [(usize, AvrLine, PinId)],
    /// The pin of each pin change input.
    pub pin_changes: &'static [(PinId, u8)],
    /// After a reset SP is the last address of RAM; 0 otherwise.
    pub stack_starts_at_ram_end: bool,
    /// Writing ones to PINx toggles PORTx.
    pub pin_writes_toggle: bool,
    /// SBI and CBI read a register and write all of it, flags that read as one included; else they touch the one bit.
    pub bit_writes_whole_register: bool,
    /// The bits of MCUCR that there are, by the layout of the ATmega328P: BODS, BODSE, PUD, IVSEL, IVCE.
    pub mcucr: u8,
    /// What asks for each interrupt: unit, and its number there; from vector 1 on.
    pub interrupt_sources: &'static [(usize, u8)],
    /// Timer/counters.
    pub timers: &'static [TimerShape],
    /// The converter.
    pub adc_kind: adc::AvrAdcKind,
    /// The pins of ADC0, ADC1, ..
    pub analog_pins: &'static [PinId],
    /// AIN0 and AIN1.
    pub comparator_pins: [PinId; 2],
    /// The sources of ADTS 1 to 7: unit, and its interrupt.
    pub adc_triggers: &'static [(usize, u8)],
    /// The EEPROM.
    pub eeprom_kind: eeprom::AvrEepromKind,
    /// Self-programming.
    pub spm_kind: spm::SpmKind,
    /// External interrupts.
    pub external_kind: external::ExternalKind,
    /// The watchdog.
    pub watchdog_kind: watchdog::WatchdogKind,
    /// Bits of PRR that stop units.
    pub power_reduction_bits: &'static [(u8, usize)],
    /// Signature bytes (28.3).
    pub signature: [u8; 3],
    /// Where the fuses stand.
    pub fuses: FuseLayout,
    /// The reset pin.
    pub reset_pin: PinId,
    /// Names of bits and fuses.
    pub names: HeaderNames,
}

/// The units of a chip, by number.
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

impl AvrPart {
    /// What the trigger source `source` (1 to 7) of the converter is.
    #[must_use]
    pub fn adc_trigger(&self, source: u8) -> Option<(usize, u8)> {
        self.adc_triggers.get(usize::from(source).checked_sub(1)?).copied()
    }

    /// The first byte of the boot section, by BOOTSZ in these fuses: the largest one is four times the next but one. The end of flash on
    /// a chip without one.
    #[must_use]
    pub fn boot_start(&self, fuses: [u8; 3]) -> u32 {
        let flash = self.spm_kind.flash;
        let size = self.fuses.bootsz.map_or(0, |fuse| (flash - self.spm_kind.nrww) >> FuseLayout::value(fuses, fuse));
        flash - size
    }

    /// The fuse byte that makes a reset begin at the byte address `at`, where `fuses` has the others; none where no boot section
    /// begins there.
    #[must_use]
    pub fn boot_fuse(&self, fuses: [u8; 3], at: u32) -> Option<FuseByte> {
        let ((byte, low, bits), (_, reset, _)) = (self.fuses.bootsz?, self.fuses.bootrst?);
        (0..1 << bits).find_map(|size: u8| {
            let mut with = fuses;
            let place = with.get_mut(usize::from(byte))?;
            *place = *place & !(((1 << bits) - 1) << low) & !(1 << reset) | size << low;
            let value = *place;
            (self.boot_start(with) == at).then_some(FuseByte { index: byte, value })
        })
    }

    /// True for registers that may read otherwise in every cycle, or do something when they are read: a loop over one of them
    /// can never be jumped over.
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

/// What stands at a data address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegisterSlot {
    /// Nothing: reads 0.
    Reserved,
    /// A register of the core.
    Core,
    /// RAM, by its data address.
    Low(u8),
    /// PINx, DDRx and PORTx of a port, 0 to 2.
    Port(u8, u8),
    /// A register of a timer.
    Timer(u8, timers::TimerRegister),
    /// A register of a USART.
    Usart(u8, usart::UsartRegister),
    /// UBRRH and UCSRC of a USART, told apart by bit 7, URSEL.
    Ursel(u8),
    /// A register of the serial peripheral interface.
    Spi(spi::SpiRegister),
    /// A register of the two-wire interface.
    Twi(twi::TwiRegister),
    /// A register of the converter.
    Adc(adc::AdcRegister),
    /// A register of the comparator.
    Comparator(comparator::ComparatorRegister),
    /// A register of the EEPROM.
    Eeprom(eeprom::EepromRegister),
    /// SPMCSR.
    Spm(spm::SpmRegister),
    /// WDTCSR.
    Watchdog(watchdog::WatchdogRegister),
    /// A register of the external interrupts.
    External(external::ExternalRegister),
    /// A register of the chip itself.
    Own(SocRegister),
    /// A byte that is only kept, by its number.
    Kept(u8),
    /// Bits of several registers: the bit here, and where it stands.
    Split(&'static [(u8, RegisterSlot, u8)]),
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
    OSCCAL,
    GTCCR,
    RAMPZ,
}

/// Registers of the core, as they are shown.
const CPU_REGS: &[&str] = &[
    "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "r13", "r14", "r15", "r16", "r17",
    "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31", "SREG", "SP",
    "PC",
];

/// A chip's memories: bytes of flash, first address of RAM and the one behind it, bytes of EEPROM, fuse bytes.
struct ChipMemories<const FLASH: u32, const RAM: u16, const END: u16, const EEPROM: u16, const FUSES: u32>;

impl<const FLASH: u32, const RAM: u16, const END: u16, const EEPROM: u16, const FUSES: u32>
    ChipMemories<FLASH, RAM, END, EEPROM, FUSES>
{
    /// What follows from them; the rest is for the row to say.
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
            ("data", END as u32, 1),
            ("flash", FLASH, 1),
            ("eeprom", EEPROM as u32, 1),
            ("fuse", FUSES, 1),
            ("lock", 1, 1),
        ],
        observable_spaces: &[("data", 0x20)],
        // SPL, SPH, SREG.
        implicit_accesses: &[("data", 0x5D), ("data", 0x5E), ("data", 0x5F)],
    };
}

/// A chip after another, by its own name and title.
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

/// A list of registers: address, name, older names, and what stands there.
macro_rules! registers {
    ($($addr:literal $name:literal $(/ $old:literal)* $site:expr;)*) => {
        /// Register summary, data addresses.
        const REGS: &[NamedAddress] = &[ $( NamedAddress { name: $name, addr: $addr }, $( NamedAddress { name: $old, addr: $addr }, )* )* ];
        /// What stands there.
        const SITES: &[(u16, RegisterSlot)] = &[ $( ($addr, $site) ),* ];
    };
}
use registers;

/// A list of pins: name, pin of the package, note.
macro_rules! pins {
    ($($name:literal $dip:literal $note:literal)*) => {
        &[ $( emu_core::chip::PinDef { name: $name, dip: $dip, note: $note } ),* ]
    };
}
use pins;

/// ADC6 and ADC7 where they belong to no port: as bits of a port that has no registers.
const ANALOG: u8 = 0x03;

/// The flat package of ATmega8 and ATmega48 to 328 (pin configurations), whose pins stand as ports B, C, D, ADC6, ADC7.
#[rustfmt::skip]
const TQFP32: [u8; 26] = [
    12, 13, 14, 15, 16, 17, 7, 8,  23, 24, 25, 26, 27, 28, 29, 0,  30, 31, 32, 1, 2, 9, 10, 11,  19, 22,
];

/// The numbers of the package in [`PinDef::dip`].
const fn dip<const N: usize>(pins: &[PinDef]) -> [u8; N] {
    let mut numbers = [0; N];
    let mut i = 0;
    while i < N && i < pins.len() {
        numbers[i] = pins[i].dip;
        i += 1;
    }
    numbers
}

/// The table of addresses from rows; below 100h RAM begins at `ram`.
const fn sites(rows: &[(u16, RegisterSlot)], ram: u16) -> [RegisterSlot; 0x100] {
    let mut all = [RegisterSlot::Reserved; 0x100];
    let mut i = ram as usize;
    while i < all.len() {
        all[i] = RegisterSlot::Low(i as u8);
        i += 1;
    }
    i = 0;
    while i < rows.len() {
        all[rows[i].0 as usize] = rows[i].1;
        i += 1;
    }
    all
}
