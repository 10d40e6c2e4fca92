//! Compares the AVR that an ELF file was linked for with the chip that runs it.

use diag::{Diagnostic, Severity};
use emu_avr::chips::part;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{avr_device, avr_signature, read_simavr_section};

use crate::shared::chip_guess::{name_chips, nearest_first};
use crate::shared::codes::{OTHER_CHIP, file_error};
use crate::shared::family;

/// Returns a diagnostic if an ELF file was linked for an AVR other than `chip`. Returns `None` if it fits,
/// and for other files. The name of the chip overrides the signature, and the signature overrides the core.
pub fn other_avr_diagnostic(file: &str, bytes: &[u8], chip: &Chip, severity: Severity) -> Option<Diagnostic> {
    let core = avr_core(bytes).filter(|_| chip.family == ChipFamily::Avr)?;
    let CauseAndHint { cause, hint } =
        by_name(bytes, chip).or_else(|| by_signature(avr_signature(bytes)?, chip)).or_else(|| by_core(core, chip))?;
    Some(Diagnostic { severity, ..file_error(OTHER_CHIP, file, cause, &hint) })
}

/// Cause and hint of a diagnostic.
pub struct CauseAndHint {
    pub cause: String,
    pub hint: String,
}

fn by_name(bytes: &[u8], chip: &Chip) -> Option<CauseAndHint> {
    let name = avr_device(bytes).or_else(|| read_simavr_section(bytes)?.mcu)?;
    let same = find_avr(&name);
    let build = format!("build it with -mmcu={}", chip.name);
    match same {
        _ if base_name(&name) == base_name(chip.name) => None,
        Some(row) if is_superset_of(chip, row) => None,
        Some(row) => Some(CauseAndHint {
            cause: format!("this is a program for {name}, not for {}", chip.name),
            hint: format!("--mcu {}, or {build}", row.name),
        }),
        None => Some(CauseAndHint {
            cause: format!("this is a program for {name}, for which emu has no model, not for {}", chip.name),
            hint: build,
        }),
    }
}

/// Finds the row of an AVR by name.
pub fn find_avr(name: &str) -> Option<&'static Chip> {
    family::find_chip(name).filter(|chip| chip.family == ChipFamily::Avr)
}

/// Returns the AVRs with this signature.
pub fn avrs_with_signature(signature: [u8; 3]) -> Vec<&'static Chip> {
    family::chips().filter(|c| part(c.name).is_some_and(|part| part.signature == signature)).collect()
}

/// Returns cause and hint if the signature `wanted` of a program is not that of `chip`.
pub fn by_signature(wanted: [u8; 3], chip: &Chip) -> Option<CauseAndHint> {
    let chip_signature = part(chip.name)?.signature;
    let text = |[a, b, c]: [u8; 3]| format!("{a:02X} {b:02X} {c:02X}");
    let fitting: Vec<&Chip> = avrs_with_signature(wanted);
    if wanted == chip_signature || fitting.iter().any(|row| is_superset_of(chip, row)) {
        return None;
    }
    let cause = |of: &str| {
        format!("this is a program for the signature {}{of}; {} has {}", text(wanted), chip.name, text(chip_signature))
    };
    let build = format!("build it with -mmcu={}", chip.name);
    Some(match name_chips(nearest_first(fitting, chip)) {
        Some((names, first)) => {
            CauseAndHint { cause: cause(&format!(" of {names}")), hint: format!("--mcu {first}, or {build}") }
        }
        None => CauseAndHint { cause: cause(", for which emu has no model"), hint: build },
    })
}

fn by_core(core: u32, chip: &Chip) -> Option<CauseAndHint> {
    let chip_core = core_of(chip);
    if core == 0 || core == chip_core {
        return None;
    }
    let fitting = family::chips().filter(|c| c.family == ChipFamily::Avr && core_of(c) == core).collect();
    let cause = format!("this is a program for avr{core} cores, and {} has an avr{chip_core} core", chip.name);
    let hint = name_chips(nearest_first(fitting, chip)).map_or_else(
        || format!("build it with -mmcu={}", chip.name),
        |(names, first)| format!("--mcu {first} (such a core have {names}), or build it with -mmcu={}", chip.name),
    );
    Some(CauseAndHint { cause, hint })
}

/// Returns the chip name without the suffix for process and package: `atmega328` for `atmega328p`.
pub fn base_name(name: &str) -> &str {
    let bare = ["pa", "p", "a"].iter().find_map(|end| name.strip_suffix(end));
    bare.filter(|bare| bare.ends_with(|c: char| c.is_ascii_digit())).unwrap_or(name)
}

/// Returns true if `chip` runs programs for `other`: it has the same registers and vectors, and memories that
/// are at least as large.
fn is_superset_of(chip: &Chip, other: &Chip) -> bool {
    core_of(chip) == core_of(other)
        && chip.ram_start == other.ram_start
        && (chip.flash_bytes >= other.flash_bytes
            && chip.ram_len >= other.ram_len
            && chip.eeprom_bytes >= other.eeprom_bytes)
        && chip.vectors == other.vectors
        && other.regs.iter().all(|reg| chip.regs.contains(reg))
}

/// Returns the core that an ELF file for an AVR is for: 4, 5, 51 for avr4, avr5, avr51, and 0 if the file
/// does not say (EF_AVR_MACH in `e_flags`, elf/avr.h of binutils). Returns `None` for other files.
fn avr_core(bytes: &[u8]) -> Option<u32> {
    const MACHINE: std::ops::Range<usize> = 0x12..0x14;
    const FLAGS: std::ops::Range<usize> = 0x24..0x28;
    const EM_AVR: u16 = 83;
    const EF_AVR_MACH: u32 = 0x7F;
    let machine = u16::from_le_bytes(bytes.get(MACHINE)?.try_into().ok()?);
    let flags = u32::from_le_bytes(bytes.get(FLAGS)?.try_into().ok()?);
    (bytes.starts_with(b"\x7FELF") && machine == EM_AVR).then_some(flags & EF_AVR_MACH)
}

/// Returns the core of an AVR as compilers number it by flash size: avr4 up to 8 KB, avr5 up to 64 KB, avr51
/// up to 128 KB.
fn core_of(chip: &Chip) -> u32 {
    match chip.flash_bytes {
        0..=0x2000 => 4,
        0x2001..=0x1_0000 => 5,
        _ => 51,
    }
}
