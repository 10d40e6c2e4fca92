//! The chips of the family, one row each.
//!
//! Sources: Intel "MCS 51 Microcontroller Family User's Manual" (272383) for registers, bits, vectors and
//! pins of all of them. Clocks are from the data sheets Intel 272318 (8031 to 8752) and 272335 (80C51BH),
//! Atmel 0265 (AT89C51), 0313 (AT89C52), 2487 (AT89S51), 1919 (AT89S52), 0368 (AT89C2051), 1001 (AT89C4051).
//! The default clock is 12 MHz for all chips, at which a machine cycle takes 1 microsecond, because no data
//! sheet names a usual clock.

mod data;

use data::{
    BITS as COMMON_BITS, BITS_BUS, BITS_NO_TIMER2, BITS_TIMER2, DIP20, PORT_1_TIMER2, PORT_3, PORT_3_BUS, REGS,
    REGS_AT89S, REGS_BUS, REGS_T2MOD, REGS_TIMER2, dip40, regs,
};
use emu_core::chip::{Chip, ChipFamily, ChipSpace, NamedAddress};
use emu_core::image::{ImageSpace, WordBits};

/// The variant of timer 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timer2Kind {
    /// The chip has no timer 2.
    None,
    /// As in the 8052: capture, reload, baud generator; no T2MOD.
    Nmos,
    /// With T2MOD: can count down (DCEN) and output a clock (T2OE).
    Full,
}

/// A chip of the family: the general chip row, and data that only this family has.
#[derive(Debug)]
pub struct Mcs51Part {
    /// The general chip row.
    pub chip: Chip,
    /// Size of RAM on the chip in bytes: 128 or 256.
    pub iram_bytes: u16,
    /// CMOS: PCON has idle and power-down (user's manual, "Power-saving modes of operation").
    pub is_cmos: bool,
    /// Timer 2.
    pub timer2: Timer2Kind,
    /// Has an external bus: P0, P2, EA. Without it there is no XDATA and no external program memory.
    pub has_bus: bool,
    /// Has the additions of the AT89S parts: watchdog, AUXR, AUXR1 with the second data pointer, power-off
    /// flag, wake-up from power-down by an interrupt.
    pub is_at89s: bool,
    /// Has the analog comparator on P1.0 and P1.1, with its output at P3.6.
    pub has_comparator: bool,
    /// Supports 6 clocks per machine cycle.
    pub has_x2: bool,
}

/// The service routine of interrupt n, from 1, starts at 8 n - 5 (user's manual, "Interrupts").
pub(crate) const VECTOR_WORDS: u32 = 8;
/// See [`VECTOR_WORDS`]; the program words by which vectors after reset are nearer to address 0.
pub(crate) const LATER_VECTORS_BACK: u32 = 5;

/// All chips of this crate.
pub const MCS51_PARTS: &[Mcs51Part] = &[
    Mcs51Part {
        chip: Chip {
            name: "8031",
            title: "8031: no ROM, 128 bytes RAM, 40 pins, NMOS",
            on_chip_flash_bytes: 0,
            ..I8051.chip
        },
        ..I8051
    },
    I8051,
    Mcs51Part { chip: Chip { name: "8751", title: "8751: 8051 with 4 KB EPROM", ..I8051.chip }, ..I8051 },
    Mcs51Part {
        chip: Chip {
            name: "8032",
            title: "8032: no ROM, 256 bytes RAM, timer 2, 40 pins, NMOS",
            on_chip_flash_bytes: 0,
            ..I8052.chip
        },
        ..I8052
    },
    I8052,
    Mcs51Part { chip: Chip { name: "8752", title: "8752: 8052 with 8 KB EPROM", ..I8052.chip }, ..I8052 },
    Mcs51Part {
        chip: Chip {
            name: "80c51",
            title: "80C51: 8051 in CMOS, with idle and power-down; 6 clocks a cycle with --x2",
            data_sheet: "272335",
            max_hz: 24_000_000,
            ..I8051.chip
        },
        is_cmos: true,
        has_x2: true,
        ..I8051
    },
    AT89C51,
    AT89C52,
    Mcs51Part {
        chip: Chip {
            name: "at89s51",
            title: "AT89S51: 4 KB flash, 128 bytes RAM, watchdog, two data pointers, 40 pins",
            data_sheet: "2487",
            max_hz: 33_000_000,
            regs: regs!(REGS, REGS_BUS, REGS_AT89S),
            pins: dip40!("" "" "" "" "" "MOSI" "MISO" "SCK"),
            ..AT89C51.chip
        },
        is_at89s: true,
        ..AT89C51
    },
    Mcs51Part {
        chip: Chip {
            name: "at89s52",
            title: "AT89S52: 8 KB flash, 256 bytes RAM, timer 2, watchdog, two data pointers, 40 pins",
            data_sheet: "1919",
            max_hz: 33_000_000,
            regs: regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD, REGS_AT89S),
            pins: dip40!("T2" "T2EX" "" "" "" "MOSI" "MISO" "SCK"),
            ..AT89C52.chip
        },
        is_at89s: true,
        ..AT89C52
    },
    AT89C2051,
    Mcs51Part {
        chip: Chip {
            name: "at89c4051",
            title: "AT89C4051: 4 KB flash, 128 bytes RAM, comparator, 20 pins",
            data_sheet: "1001",
            flash_bytes: 0x1000,
            on_chip_flash_bytes: 0x1000,
            hex_spaces: &[ImageSpace { name: "code", start: 0, len: 0x1000, word: 1, word_bits: WordBits::All }],
            elf_spaces: &[ImageSpace { name: "code", start: 0, len: 0x1000, word: 1, word_bits: WordBits::All }],
            spaces: &[
                ChipSpace::new("code", 0x1000, 1),
                ChipSpace::new("idata", 128, 1),
                ChipSpace::new("sfr", 256, 1),
                ChipSpace::new("bit", 256, 1),
            ],
            ..AT89C2051.chip
        },
        ..AT89C2051
    },
];

/// Names of all registers of all chips, for text that is not for a particular chip.
pub const SFRS: &[NamedAddress] = regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD, REGS_AT89S);

/// Names of all bits of all chips.
pub const BITS: &[NamedAddress] = regs!(COMMON_BITS, BITS_BUS, BITS_TIMER2);

/// The part `name`; case is ignored.
#[must_use]
pub fn part(name: &str) -> Option<&'static Mcs51Part> {
    MCS51_PARTS.iter().find(|p| p.chip.name.eq_ignore_ascii_case(name))
}

/// The chip `name`; case is ignored.
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|p| &p.chip)
}

/// All chips of this crate, in the order of [`MCS51_PARTS`].
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    MCS51_PARTS.iter().map(|p| &p.chip)
}

/// The first chip of the family, from which the rows of all others are derived.
pub(crate) const I8051: Mcs51Part = Mcs51Part {
    chip: Chip {
        name: "8051",
        family: ChipFamily::Mcs51,
        isa: &crate::isa::ISA,
        title: "8051: 4 KB ROM, 128 bytes RAM, 40 pins, NMOS",
        data_sheet: "272318",
        code_space: "code",
        flash_bytes: 0x1_0000,
        on_chip_flash_bytes: 0x1000,
        ram_space: "idata",
        ram_start: 0,
        ram_len: 128,
        ram_ranges: &[],
        eeprom_bytes: 0,
        word_bytes: 1,
        max_hz: 12_000_000,
        default_hz: 12_000_000,
        hex_spaces: &[ImageSpace { name: "code", start: 0, len: 0x1_0000, word: 1, word_bits: WordBits::All }],
        elf_spaces: &[ImageSpace { name: "code", start: 0, len: 0x1_0000, word: 1, word_bits: WordBits::All }],
        elf_machine: 165,
        cpu_regs: &["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "ACC", "B", "PSW", "SP", "DPTR", "PC"],
        reg_space: "sfr",
        regs: regs!(REGS, REGS_BUS),
        bits: regs!(COMMON_BITS, BITS_BUS, BITS_NO_TIMER2),
        pins: dip40!("" "" "" "" "" "" "" ""),
        constants: || [PORT_3, PORT_3_BUS].concat(),
        vectors: &["RESET", "INT0", "TIMER0", "INT1", "TIMER1", "SERIAL"],
        words_per_vector: VECTOR_WORDS,
        packages: &[],
        later_vectors_back_words: LATER_VECTORS_BACK,
        spaces: &[
            ChipSpace::new("code", 0x1_0000, 1),
            ChipSpace::new("idata", 128, 1),
            ChipSpace::new("sfr", 256, 1),
            ChipSpace::new("bit", 256, 1),
            ChipSpace::new("xdata", 0x1_0000, 1),
        ],
        observable_spaces: &[("idata", 0), ("sfr", 0), ("bit", 0), ("xdata", 0)],
        // SP, DPL, DPH, PSW, ACC, B.
        implicit_accesses: &[("sfr", 0x81), ("sfr", 0x82), ("sfr", 0x83), ("sfr", 0xD0), ("sfr", 0xE0), ("sfr", 0xF0)],
    },
    iram_bytes: 128,
    is_cmos: false,
    timer2: Timer2Kind::None,
    has_bus: true,
    is_at89s: false,
    has_comparator: false,
    has_x2: false,
};

const I8052: Mcs51Part = Mcs51Part {
    chip: Chip {
        name: "8052",
        title: "8052: 8 KB ROM, 256 bytes RAM, timer 2, 40 pins, NMOS",
        on_chip_flash_bytes: 0x2000,
        ram_len: 256,
        regs: regs!(REGS, REGS_BUS, REGS_TIMER2),
        bits: regs!(COMMON_BITS, BITS_BUS, BITS_TIMER2),
        constants: || [PORT_3, PORT_3_BUS, PORT_1_TIMER2].concat(),
        pins: dip40!("T2" "T2EX" "" "" "" "" "" ""),
        vectors: &["RESET", "INT0", "TIMER0", "INT1", "TIMER1", "SERIAL", "TIMER2"],
        spaces: &[
            ChipSpace::new("code", 0x1_0000, 1),
            ChipSpace::new("idata", 256, 1),
            ChipSpace::new("sfr", 256, 1),
            ChipSpace::new("bit", 256, 1),
            ChipSpace::new("xdata", 0x1_0000, 1),
        ],
        ..I8051.chip
    },
    iram_bytes: 256,
    timer2: Timer2Kind::Nmos,
    ..I8051
};

const AT89C51: Mcs51Part = Mcs51Part {
    chip: Chip {
        name: "at89c51",
        title: "AT89C51: 4 KB flash, 128 bytes RAM, 40 pins",
        data_sheet: "0265",
        max_hz: 24_000_000,
        ..I8051.chip
    },
    is_cmos: true,
    ..I8051
};

const AT89C52: Mcs51Part = Mcs51Part {
    chip: Chip {
        name: "at89c52",
        title: "AT89C52: 8 KB flash, 256 bytes RAM, timer 2, 40 pins",
        data_sheet: "0313",
        max_hz: 24_000_000,
        regs: regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD),
        ..I8052.chip
    },
    is_cmos: true,
    timer2: Timer2Kind::Full,
    ..I8052
};

const AT89C2051: Mcs51Part = Mcs51Part {
    chip: Chip {
        name: "at89c2051",
        title: "AT89C2051: 2 KB flash, 128 bytes RAM, comparator, 20 pins",
        data_sheet: "0368",
        flash_bytes: 0x800,
        on_chip_flash_bytes: 0x800,
        hex_spaces: &[ImageSpace { name: "code", start: 0, len: 0x800, word: 1, word_bits: WordBits::All }],
        elf_spaces: &[ImageSpace { name: "code", start: 0, len: 0x800, word: 1, word_bits: WordBits::All }],
        regs: regs!(REGS),
        bits: regs!(COMMON_BITS, BITS_NO_TIMER2),
        constants: || PORT_3.to_vec(),
        pins: DIP20,
        spaces: &[
            ChipSpace::new("code", 0x800, 1),
            ChipSpace::new("idata", 128, 1),
            ChipSpace::new("sfr", 256, 1),
            ChipSpace::new("bit", 256, 1),
        ],
        ..AT89C51.chip
    },
    has_bus: false,
    has_comparator: true,
    ..AT89C51
};
