//! PIC16F870 to 877 and their A versions (DS30569 870 and 871, DS30221 872, DS30292 87X, DS39582 87XA).

use emu_core::chip::{Chip, ChipFamily, RamRange};
use emu_core::pins::PinId;

use super::bits as b;
use super::data::{chip, join, regs};
use super::pins::{self as p, dip28, dip40, pins28, pins40};
use super::regs as r;
use super::{
    ComparatorKind, ConfigLayout, InternalOscillator, NO_PIN, NonvolatileKind, OscillatorMode, Pic16AdcKind, Pic16Part,
    SfrBit, SspKind, TimingRanges,
};
use crate::isa::ISA;
use crate::periph::map::Sfr;

/// RAM of the 87X (figure 2-4): no byte is accessible in all banks.
const RAM_192: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x20 },
    RamRange { first: 0x0A0, last: 0x0FF, canonical: 0xA0 },
    RamRange { first: 0x120, last: 0x17F, canonical: 0x20 },
    RamRange { first: 0x1A0, last: 0x1FF, canonical: 0xA0 },
];
/// RAM of the 87X (figure 2-3), and of 87 and 88.
pub(super) const RAM_368: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x020 },
    RamRange { first: 0x0A0, last: 0x0EF, canonical: 0x0A0 },
    RamRange { first: 0x0F0, last: 0x0FF, canonical: 0x070 },
    RamRange { first: 0x110, last: 0x16F, canonical: 0x110 },
    RamRange { first: 0x170, last: 0x17F, canonical: 0x070 },
    RamRange { first: 0x190, last: 0x1EF, canonical: 0x190 },
    RamRange { first: 0x1F0, last: 0x1FF, canonical: 0x070 },
];
/// RAM of 870 and 871 (figure 2-2) and of 872 (figure 2-2).
const RAM_128: &[RamRange] = &[
    RamRange { first: 0x020, last: 0x07F, canonical: 0x20 },
    RamRange { first: 0x0A0, last: 0x0BF, canonical: 0xA0 },
    RamRange { first: 0x0F0, last: 0x0FF, canonical: 0x70 },
    RamRange { first: 0x120, last: 0x17F, canonical: 0x20 },
    RamRange { first: 0x1A0, last: 0x1BF, canonical: 0xA0 },
    RamRange { first: 0x1F0, last: 0x1FF, canonical: 0x70 },
];

/// Addresses of INDF, PCL, STATUS, FSR and PCLATH in each bank.
#[rustfmt::skip]
const SILENT: [(&str, u32); 20] = [
    ("data", 0x00), ("data", 0x02), ("data", 0x03), ("data", 0x04), ("data", 0x0A),
    ("data", 0x80), ("data", 0x82), ("data", 0x83), ("data", 0x84), ("data", 0x8A),
    ("data", 0x100), ("data", 0x102), ("data", 0x103), ("data", 0x104), ("data", 0x10A),
    ("data", 0x180), ("data", 0x182), ("data", 0x183), ("data", 0x184), ("data", 0x18A),
];

/// Registers that all chips of this file have.
const S_ANY: &[(u16, Sfr)] = join!(r::CORE, r::CORE_HIGH, r::PORT_C, r::TIMERS, r::ADC, r::FLASH);
const S_870: &[(u16, Sfr)] = join!(S_ANY, r::USART);
const S_871: &[(u16, Sfr)] = join!(S_870, r::PORT_DE);
const S_872: &[(u16, Sfr)] = join!(S_ANY, r::SSP, r::MSSP);
const S_873: &[(u16, Sfr)] = join!(S_ANY, r::USART, r::SSP, r::MSSP, r::CCP2);
const S_873A: &[(u16, Sfr)] = join!(S_873, r::COMPARATORS);
const S_874: &[(u16, Sfr)] = join!(S_873, r::PORT_DE);
const S_874A: &[(u16, Sfr)] = join!(S_873A, r::PORT_DE);

/// Bits that all chips of this file have, without INTCON's names of timer 0.
#[rustfmt::skip]
const B_ANY: &[SfrBit] = join!(
    b::CORE, b::RA5, b::INT, b::TIMERS, b::T1INSYNC, b::T1SYNC, b::PORT_C, b::ADC_ANY, b::ADC, b::PCFG, b::EEPROM, b::FLASH,
);
const B_87X: &[SfrBit] = join!(B_ANY, b::T0, b::TMR0);
const B_870: &[SfrBit] = join!(B_87X, b::USART, b::USART_87X);
const B_871: &[SfrBit] = join!(B_870, b::PORT_DE);
const B_872: &[SfrBit] = join!(B_ANY, b::TMR0, b::T0, b::SSP, b::MSSP);
const B_873: &[SfrBit] = join!(B_870, b::SSP, b::MSSP, b::CCP2);
const B_874: &[SfrBit] = join!(B_873, b::PORT_DE);
const B_873A: &[SfrBit] = join!(
    join!(B_ANY, b::TMR0, b::T0, b::USART, b::USART_87X, b::SSP, b::MSSP, b::CCP2),
    join!(b::ADCS2, b::CMCON, b::CVRCON),
);
const B_874A: &[SfrBit] = join!(B_873A, b::PORT_DE);

const ANALOG28: &[PinId] = &[dip28::RA0, dip28::RA1, dip28::RA2, dip28::RA3, dip28::RA5];
#[rustfmt::skip]
const ANALOG40: &[PinId] =
    &[dip40::RA0, dip40::RA1, dip40::RA2, dip40::RA3, dip40::RA5, dip40::RE0, dip40::RE1, dip40::RE2];

const A_870: [&str; 6] = ["AN0", "AN1", "AN2, VREF-", "AN3, VREF+", "open drain, T0CKI", "AN4"];
const A_873: [&str; 6] = ["AN0", "AN1", "AN2, VREF-", "AN3, VREF+", "open drain, T0CKI", "AN4, SS"];
const A_873A: [&str; 6] =
    ["AN0", "AN1", "AN2, VREF-, CVREF", "AN3, VREF+", "open drain, T0CKI, C1OUT", "AN4, SS, C2OUT"];
const C_870: [&str; 8] = ["T1OSO, T1CKI", "T1OSI", "CCP1", "", "", "", "TX, CK", "RX, DT"];
const C_872: [&str; 8] = ["T1OSO, T1CKI", "T1OSI", "CCP1", "SCK, SCL", "SDI, SDA", "SDO", "", ""];
const C_873: [&str; 8] = ["T1OSO, T1CKI", "T1OSI, CCP2", "CCP1", "SCK, SCL", "SDI, SDA", "SDO", "TX, CK", "RX, DT"];

/// Configuration of the 87X (register 12-1 and table 4-1). The program cannot write code-protected words
/// either.
const CONFIG: ConfigLayout = ConfigLayout {
    words: &[0x2007],
    erased: &[0x3FFF],
    fosc: (3, &[OscillatorMode::Lp, OscillatorMode::Xt, OscillatorMode::Hs, OscillatorMode::Rc]),
    osc_ports: &[],
    fcmen: 0,
    ieso: 0,
    wdte: 1 << 2,
    pwrte: (1 << 3, false),
    boren: 1 << 6,
    mclre: 0,
    lvp: 1 << 7,
    pgm: dip28::RB3,
    ccpmx: (0, NO_PIN, NO_PIN),
    cpd: 1 << 8,
    cp: 0x3030,
    cp_first: (0x30, &[0, 0x800, 0xF00, 0xFFFF]),
    wrt: (1 << 9, &[0xFFFF, 0]),
};
const CONFIG_8K: ConfigLayout = ConfigLayout { cp_first: (0x30, &[0, 0x1000, 0x1F00, 0xFFFF]), ..CONFIG };
/// Configuration of 870 and 871 (register 11-1) and of 872 (register 11-1). Only all words or none are
/// protected; the values between act as all.
const CONFIG_2K: ConfigLayout = ConfigLayout { cp_first: (0x30, &[0, 0, 0, 0xFFFF]), ..CONFIG };
/// Configuration of the 87XA (register 14-1). Only WRT restricts writing.
const CONFIG_A: ConfigLayout =
    ConfigLayout { cp: 0x2000, cp_first: (0, &[]), wrt: (3 << 9, &[0x800, 0x400, 0x100, 0]), ..CONFIG };
const CONFIG_A_8K: ConfigLayout = ConfigLayout { wrt: (3 << 9, &[0x1000, 0x800, 0x100, 0]), ..CONFIG_A };

/// Row of the PIC16F873.
pub const PIC16F873: Pic16Part = Pic16Part {
    chip: chip!(
        "pic16f873",
        "PIC16F873",
        "DS30292",
        4 K,
        192,
        128,
        28,
        Chip {
            name: "",
            family: ChipFamily::Pic16,
            isa: &ISA,
            title: "",
            data_sheet: "",
            code_space: "flash",
            flash_bytes: 0,
            on_chip_flash_bytes: 0,
            ram_space: "data",
            ram_start: 0x20,
            ram_len: 0,
            ram_ranges: RAM_192,
            eeprom_bytes: 0,
            word_bytes: 2,
            max_hz: 20_000_000,
            default_hz: 4_000_000,
            hex_spaces: &[],
            elf_spaces: &[],
            elf_machine: 0,
            cpu_regs: &["W", "STATUS", "FSR", "PCLATH", "PC"],
            reg_space: "data",
            regs: regs!(S_873),
            bits: &[],
            pins: &pins28(A_873, C_873),
            constants: Vec::new,
            vectors: &["RESET", "INT"],
            words_per_vector: 4,
            packages: &[],
            later_vectors_back_words: 0,
            spaces: &[],
            observable_spaces: &[("data", 0)],
            implicit_accesses: &SILENT,
        }
    ),
    sfr: S_873,
    bits: B_873,
    ports: p::PORTS28,
    mclr: dip28::MCLR,
    lines: join!(p::L28, p::L28_CCP2, p::L28_SSP, p::L28_USART),
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_CCP2, r::F_SSP, r::F_MSSP, r::F_USART, r::F_ADC, r::F_EEPROM),
    analog: ANALOG28,
    ccps: 2,
    timers: true,
    ssp: SspKind::Master,
    usart: true,
    adc: Pic16AdcKind::Bits10,
    comparators: ComparatorKind::None,
    psp: false,
    memory: NonvolatileKind::Word,
    internal: InternalOscillator::None,
    config: CONFIG,
    device_id: Some(0x0960),
    times: TimingRanges {
        wdt: [7_000, 18_000, 33_000],
        pwrt: [28_000, 72_000, 132_000],
        eeprom: [4_000, 4_000, 8_000],
        flash: [4_000, 4_000, 8_000],
        adc_rc_ns: [2_000, 4_000, 6_000],
    },
};

/// Row of the PIC16F874.
pub(super) const PIC16F874: Pic16Part = Pic16Part {
    chip: Chip {
        regs: regs!(S_874),
        pins: &pins40(A_873, C_873),
        ..chip!("pic16f874", "PIC16F874", "DS30292", 4 K, 192, 128, 40, PIC16F873.chip)
    },
    sfr: S_874,
    bits: B_874,
    ports: p::PORTS40,
    mclr: dip40::MCLR,
    lines: join!(PIC16F873.lines, p::L40),
    flags: join!(PIC16F873.flags, r::F_PSP),
    analog: ANALOG40,
    psp: true,
    device_id: Some(0x0920),
    ..PIC16F873
};

/// Row of the PIC16F876.
pub(super) const PIC16F876: Pic16Part = Pic16Part {
    chip: Chip { ram_ranges: RAM_368, ..chip!("pic16f876", "PIC16F876", "DS30292", 8 K, 368, 256, 28, PIC16F873.chip) },
    config: CONFIG_8K,
    device_id: Some(0x09E0),
    ..PIC16F873
};

/// Row of the PIC16F877.
pub(super) const PIC16F877: Pic16Part = Pic16Part {
    chip: Chip { ram_ranges: RAM_368, ..chip!("pic16f877", "PIC16F877", "DS30292", 8 K, 368, 256, 40, PIC16F874.chip) },
    config: CONFIG_8K,
    device_id: Some(0x09A0),
    ..PIC16F874
};

/// Row of the PIC16F873A.
pub(super) const PIC16F873A: Pic16Part = Pic16Part {
    chip: Chip {
        regs: regs!(S_873A),
        pins: &pins28(A_873A, C_873),
        ..chip!("pic16f873a", "PIC16F873A", "DS39582", 4 K, 192, 128, 28, PIC16F873.chip)
    },
    sfr: S_873A,
    bits: B_873A,
    lines: join!(PIC16F873.lines, p::L28_COMPARATORS),
    flags: join!(PIC16F873.flags, r::F_COMPARATORS),
    ssp: SspKind::MasterStretch,
    adc: Pic16AdcKind::Bits10Adcs2,
    comparators: ComparatorKind::F87xA,
    memory: NonvolatileKind::Block4,
    config: CONFIG_A,
    device_id: Some(0x0E40),
    ..PIC16F873
};

/// Row of the PIC16F874A.
pub(super) const PIC16F874A: Pic16Part = Pic16Part {
    chip: Chip {
        regs: regs!(S_874A),
        pins: &pins40(A_873A, C_873),
        ..chip!("pic16f874a", "PIC16F874A", "DS39582", 4 K, 192, 128, 40, PIC16F874.chip)
    },
    sfr: S_874A,
    bits: B_874A,
    lines: join!(PIC16F874.lines, p::L28_COMPARATORS),
    flags: join!(PIC16F874.flags, r::F_COMPARATORS),
    ssp: SspKind::MasterStretch,
    adc: Pic16AdcKind::Bits10Adcs2,
    comparators: ComparatorKind::F87xA,
    memory: NonvolatileKind::Block4,
    config: CONFIG_A,
    device_id: Some(0x0E60),
    ..PIC16F874
};

/// Row of the PIC16F876A.
pub(super) const PIC16F876A: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_368,
        ..chip!("pic16f876a", "PIC16F876A", "DS39582", 8 K, 368, 256, 28, PIC16F873A.chip)
    },
    config: CONFIG_A_8K,
    device_id: Some(0x0E00),
    ..PIC16F873A
};

/// Row of the PIC16F877A.
pub(super) const PIC16F877A: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_368,
        ..chip!("pic16f877a", "PIC16F877A", "DS39582", 8 K, 368, 256, 40, PIC16F874A.chip)
    },
    config: CONFIG_A_8K,
    device_id: Some(0x0E20),
    ..PIC16F874A
};

/// Row of the PIC16F870.
pub(super) const PIC16F870: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_128,
        regs: regs!(S_870),
        pins: &pins28(A_870, C_870),
        ..chip!("pic16f870", "PIC16F870", "DS30569", 2 K, 128, 64, 28, PIC16F873.chip)
    },
    sfr: S_870,
    bits: B_870,
    lines: join!(p::L28, p::L28_USART),
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_USART, r::F_ADC, r::F_EEPROM),
    ccps: 1,
    ssp: SspKind::None,
    config: CONFIG_2K,
    device_id: Some(0x0D00),
    ..PIC16F873
};

/// Row of the PIC16F871.
pub(super) const PIC16F871: Pic16Part = Pic16Part {
    chip: Chip {
        regs: regs!(S_871),
        pins: &pins40(A_870, C_870),
        ..chip!("pic16f871", "PIC16F871", "DS30569", 2 K, 128, 64, 40, PIC16F870.chip)
    },
    sfr: S_871,
    bits: B_871,
    ports: p::PORTS40,
    mclr: dip40::MCLR,
    lines: join!(PIC16F870.lines, p::L40),
    flags: join!(PIC16F870.flags, r::F_PSP),
    analog: ANALOG40,
    psp: true,
    device_id: Some(0x0D20),
    ..PIC16F870
};

/// Row of the PIC16F872.
pub(super) const PIC16F872: Pic16Part = Pic16Part {
    chip: Chip {
        ram_ranges: RAM_128,
        regs: regs!(S_872),
        pins: &pins28(A_873, C_872),
        ..chip!("pic16f872", "PIC16F872", "DS30221", 2 K, 128, 64, 28, PIC16F873.chip)
    },
    sfr: S_872,
    bits: B_872,
    lines: join!(p::L28, p::L28_SSP),
    flags: join!(r::F_CORE, r::F_TIMERS, r::F_SSP, r::F_MSSP, r::F_ADC, r::F_EEPROM),
    ccps: 1,
    usart: false,
    config: CONFIG_2K,
    device_id: Some(0x08E0),
    ..PIC16F873
};
