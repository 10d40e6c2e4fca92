//! The chips of the family, one row each.
//!
//! Sources: Intel "MCS 51 Microcontroller Family User's Manual" (272383) for registers, bits, vectors and pins of all of them;
//! clocks by the data sheets Intel 272318 (8031 to 8752) and 272335 (80C51BH), Atmel 0265 (AT89C51), 0313 (AT89C52), 2487
//! (AT89S51), 1919 (AT89S52), 0368 (AT89C2051), 1001 (AT89C4051). The clock that is assumed when none is given is 12 MHz
//! everywhere, at which a machine cycle takes a microsecond: no data sheet names a usual clock.

mod data;

use data::{
    BITS as COMMON_BITS, BITS_BUS, BITS_NO_TIMER2, BITS_TIMER2, DIP20, PORT_1_TIMER2, PORT_3, PORT_3_BUS, REGS,
    REGS_AT89S, REGS_BUS, REGS_T2MOD, REGS_TIMER2, dip40, regs,
};
use emu_core::chip::{Chip, Family, Reg};
use emu_core::image::{Bits, Space};

/// Timer 2 of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timer2 {
    /// There is none.
    None,
    /// As in the 8052: capture, reload, baud generator; no T2MOD.
    Nmos,
    /// With T2MOD: counts down (DCEN) and gives a clock out (T2OE).
    Full,
}

/// What a chip of the family has beyond the row that every chip has.
#[derive(Debug)]
pub struct Part {
    /// The row that every chip has.
    pub chip: Chip,
    /// Bytes of RAM on the chip: 128 or 256.
    pub iram: u16,
    /// CMOS: PCON has idle and power-down (user's manual, "Power-saving modes of operation").
    pub cmos: bool,
    /// Timer 2.
    pub timer2: Timer2,
    /// Has an external bus: P0, P2, EA. Without it there is no XDATA and no program memory outside.
    pub bus: bool,
    /// Has what the AT89S parts add: watchdog, AUXR, AUXR1 with the second data pointer, power-off flag, wake from
    /// power-down by an interrupt.
    pub at89s: bool,
    /// Has the analog comparator on P1.0 and P1.1 with its output at P3.6.
    pub comparator: bool,
    /// Can run at 6 clocks a machine cycle.
    pub x2: bool,
}

/// Interrupt n, from 1, begins at 8 n - 5 (user's manual, "Interrupts").
pub(crate) const VECTOR_WORDS: u32 = 8;
pub(crate) const VECTOR_BACK: u32 = 5;

/// All chips of this crate.
pub const PARTS: &[Part] = &[
    Part {
        chip: Chip { name: "8031", title: "8031: no ROM, 128 bytes RAM, 40 pins, NMOS", on_chip: 0, ..I8051.chip },
        ..I8051
    },
    I8051,
    Part { chip: Chip { name: "8751", title: "8751: 8051 with 4 KB EPROM", ..I8051.chip }, ..I8051 },
    Part {
        chip: Chip {
            name: "8032",
            title: "8032: no ROM, 256 bytes RAM, timer 2, 40 pins, NMOS",
            on_chip: 0,
            ..I8052.chip
        },
        ..I8052
    },
    I8052,
    Part { chip: Chip { name: "8752", title: "8752: 8052 with 8 KB EPROM", ..I8052.chip }, ..I8052 },
    Part {
        chip: Chip {
            name: "80c51",
            title: "80C51: 8051 in CMOS, with idle and power-down; 6 clocks a cycle with --x2",
            source: "272335",
            max_hz: 24_000_000,
            ..I8051.chip
        },
        cmos: true,
        x2: true,
        ..I8051
    },
    AT89C51,
    AT89C52,
    Part {
        chip: Chip {
            name: "at89s51",
            title: "AT89S51: 4 KB flash, 128 bytes RAM, watchdog, two data pointers, 40 pins",
            source: "2487",
            max_hz: 33_000_000,
            regs: regs!(REGS, REGS_BUS, REGS_AT89S),
            pins: dip40!("" "" "" "" "" "MOSI" "MISO" "SCK"),
            ..AT89C51.chip
        },
        at89s: true,
        ..AT89C51
    },
    Part {
        chip: Chip {
            name: "at89s52",
            title: "AT89S52: 8 KB flash, 256 bytes RAM, timer 2, watchdog, two data pointers, 40 pins",
            source: "1919",
            max_hz: 33_000_000,
            regs: regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD, REGS_AT89S),
            pins: dip40!("T2" "T2EX" "" "" "" "MOSI" "MISO" "SCK"),
            ..AT89C52.chip
        },
        at89s: true,
        ..AT89C52
    },
    AT89C2051,
    Part {
        chip: Chip {
            name: "at89c4051",
            title: "AT89C4051: 4 KB flash, 128 bytes RAM, comparator, 20 pins",
            source: "1001",
            flash: 0x1000,
            on_chip: 0x1000,
            hex: &[Space { name: "code", start: 0, len: 0x1000, word: 1, bits: Bits::All }],
            elf: &[Space { name: "code", start: 0, len: 0x1000, word: 1, bits: Bits::All }],
            spaces: &[("code", 0x1000, 1), ("idata", 128, 1), ("sfr", 256, 1), ("bit", 256, 1)],
            ..AT89C2051.chip
        },
        ..AT89C2051
    },
];

/// Names of all registers that any of the chips has, for text that says nothing of the chip.
pub const SFRS: &[Reg] = regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD, REGS_AT89S);

/// Names of all bits likewise.
pub const BITS: &[Reg] = regs!(COMMON_BITS, BITS_BUS, BITS_TIMER2);

/// The part `name` (case aside).
#[must_use]
pub fn part(name: &str) -> Option<&'static Part> {
    PARTS.iter().find(|p| p.chip.name.eq_ignore_ascii_case(name))
}

/// The chip `name` (case aside).
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    part(name).map(|p| &p.chip)
}

/// All chips of this crate, in the order of [`PARTS`].
pub fn chips() -> impl Iterator<Item = &'static Chip> {
    PARTS.iter().map(|p| &p.chip)
}

/// The first of the family, from which the rows of all others derive.
pub(crate) const I8051: Part = Part {
    chip: Chip {
        name: "8051",
        family: Family::Mcs51,
        isa: &crate::isa::ISA,
        title: "8051: 4 KB ROM, 128 bytes RAM, 40 pins, NMOS",
        source: "272318",
        code: "code",
        flash: 0x1_0000,
        on_chip: 0x1000,
        ram: "idata",
        ram_start: 0,
        ram_len: 128,
        ram_map: &[],
        eeprom: 0,
        word_bytes: 1,
        max_hz: 12_000_000,
        default_hz: 12_000_000,
        hex: &[Space { name: "code", start: 0, len: 0x1_0000, word: 1, bits: Bits::All }],
        elf: &[Space { name: "code", start: 0, len: 0x1_0000, word: 1, bits: Bits::All }],
        elf_machine: 165,
        cpu_regs: &["r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "ACC", "B", "PSW", "SP", "DPTR", "PC"],
        reg_space: "sfr",
        regs: regs!(REGS, REGS_BUS),
        bits: regs!(COMMON_BITS, BITS_BUS, BITS_NO_TIMER2),
        pins: dip40!("" "" "" "" "" "" "" ""),
        constants: || [PORT_3, PORT_3_BUS].concat(),
        vectors: &["RESET", "INT0", "TIMER0", "INT1", "TIMER1", "SERIAL"],
        vector_words: VECTOR_WORDS,
        packages: &[],
        vector_back: VECTOR_BACK,
        spaces: &[("code", 0x1_0000, 1), ("idata", 128, 1), ("sfr", 256, 1), ("bit", 256, 1), ("xdata", 0x1_0000, 1)],
        told: &[("idata", 0), ("sfr", 0), ("bit", 0), ("xdata", 0)],
        // SP, DPL, DPH, PSW, ACC, B.
        silent: &[("sfr", 0x81), ("sfr", 0x82), ("sfr", 0x83), ("sfr", 0xD0), ("sfr", 0xE0), ("sfr", 0xF0)],
    },
    iram: 128,
    cmos: false,
    timer2: Timer2::None,
    bus: true,
    at89s: false,
    comparator: false,
    x2: false,
};

const I8052: Part = Part {
    chip: Chip {
        name: "8052",
        title: "8052: 8 KB ROM, 256 bytes RAM, timer 2, 40 pins, NMOS",
        on_chip: 0x2000,
        ram_len: 256,
        regs: regs!(REGS, REGS_BUS, REGS_TIMER2),
        bits: regs!(COMMON_BITS, BITS_BUS, BITS_TIMER2),
        constants: || [PORT_3, PORT_3_BUS, PORT_1_TIMER2].concat(),
        pins: dip40!("T2" "T2EX" "" "" "" "" "" ""),
        vectors: &["RESET", "INT0", "TIMER0", "INT1", "TIMER1", "SERIAL", "TIMER2"],
        spaces: &[("code", 0x1_0000, 1), ("idata", 256, 1), ("sfr", 256, 1), ("bit", 256, 1), ("xdata", 0x1_0000, 1)],
        ..I8051.chip
    },
    iram: 256,
    timer2: Timer2::Nmos,
    ..I8051
};

const AT89C51: Part = Part {
    chip: Chip {
        name: "at89c51",
        title: "AT89C51: 4 KB flash, 128 bytes RAM, 40 pins",
        source: "0265",
        max_hz: 24_000_000,
        ..I8051.chip
    },
    cmos: true,
    ..I8051
};

const AT89C52: Part = Part {
    chip: Chip {
        name: "at89c52",
        title: "AT89C52: 8 KB flash, 256 bytes RAM, timer 2, 40 pins",
        source: "0313",
        max_hz: 24_000_000,
        regs: regs!(REGS, REGS_BUS, REGS_TIMER2, REGS_T2MOD),
        ..I8052.chip
    },
    cmos: true,
    timer2: Timer2::Full,
    ..I8052
};

const AT89C2051: Part = Part {
    chip: Chip {
        name: "at89c2051",
        title: "AT89C2051: 2 KB flash, 128 bytes RAM, comparator, 20 pins",
        source: "0368",
        flash: 0x800,
        on_chip: 0x800,
        hex: &[Space { name: "code", start: 0, len: 0x800, word: 1, bits: Bits::All }],
        elf: &[Space { name: "code", start: 0, len: 0x800, word: 1, bits: Bits::All }],
        regs: regs!(REGS),
        bits: regs!(COMMON_BITS, BITS_NO_TIMER2),
        constants: || PORT_3.to_vec(),
        pins: DIP20,
        spaces: &[("code", 0x800, 1), ("idata", 128, 1), ("sfr", 256, 1), ("bit", 256, 1)],
        ..AT89C51.chip
    },
    bus: false,
    comparator: true,
    ..AT89C51
};
