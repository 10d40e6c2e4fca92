//! Flags of `emu run` for the AVR family, and the names that AVR users expect.

use clap::Args;
use emu_avr::Options;
use emu_avr::chips::{self, AvrPart, FuseLayout};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;
use emu_core::image::Image;
use emu_core::pins::PinId;
use emu_debug::address_names;

use crate::shared::fail::VerbFailure;
use crate::shared::output;
use crate::shared::usage_error::UsageError;

/// Names of the fuse bytes, in order: first the name in data sheets, then the name in avr-libc and avrdude.
const FUSES: [[&str; 2]; 3] = [["low", "lfuse"], ["high", "hfuse"], ["extended", "efuse"]];

/// Bits CLKPS in CLKPR (DS40002061, 9.12.2).
const CLKPS: u8 = 0x0F;

/// Flags that only the AVR family accepts.
#[derive(Debug, Args)]
#[group(id = "avr")]
#[command(next_help_heading = "Only for the AVR family")]
pub struct AvrFlags {
    /// Fuse bytes that replace those of the image (`.fuse` of an ELF file): low=0x62,high=0xD9,extended=0xFF.
    /// The names lfuse, hfuse and efuse mean the same. With fuses, here or in the image, CKSEL chooses the
    /// clock, and every reset takes its start-up time. Default: the fuses of a new chip, but with an external
    /// clock that is not divided.
    #[arg(long, value_name = "BYTE=VALUE", value_parser = parse_fuse, value_delimiter = ',')]
    fuse: Vec<FuseByte>,
    /// Lock bits that replace those of the image (`.lock` of an ELF file): 0xFF.
    #[arg(long, value_name = "VALUE", value_parser = |text: &str| parse_byte("lock bits are", text))]
    lock: Option<u8>,
    /// The package: DIP28, TQFP32, MLF32 or MLF28 on ATmega48 to 328 (`emu chips CHIP` lists them), also
    /// written as 28-PDIP or TQFP-32. With a package, pins that it does not have are refused, and --lint
    /// reports reads of their channels. Default: the pins of all packages.
    #[arg(long, value_name = "NAME")]
    package: Option<String>,
}

/// A fuse byte: its index in [`FUSES`], and its value.
#[derive(Debug, Clone, Copy)]
struct FuseByte(usize, u8);

fn parse_fuse(text: &str) -> Result<FuseByte, UsageError> {
    let Some((name, value)) = text.split_once('=') else {
        return Err(match parse_byte("a fuse byte is", text) {
            Ok(value) => UsageError::UnnamedFuse { value },
            Err(_) => UsageError::malformed("write low=0x62, high=0xD9 or extended=0xFF, several with commas between"),
        });
    };
    let known = |names: &[&str; 2]| names.iter().any(|known| known.eq_ignore_ascii_case(name.trim()));
    let at = FUSES.iter().position(known);
    let at = at.ok_or_else(|| {
        let expected = "; they are low, high and extended".to_owned();
        UsageError::UnknownName { kind: "fuse byte ", name: name.to_owned(), expected }
    })?;
    Ok(FuseByte(at, parse_byte("a fuse byte is", value)?))
}

fn parse_byte(what: &str, text: &str) -> Result<u8, UsageError> {
    // Fuse bytes are always written in hexadecimal, so digits without a prefix are not read as a decimal
    // number.
    let digits = text.trim().trim_end_matches(['h', 'H']);
    if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        let mut meant: Vec<String> =
            u8::from_str_radix(digits, 16).map(|value| format!("0x{value:02X}")).into_iter().collect();
        match digits.parse::<u8>() {
            Ok(value) if value > 9 && digits == text.trim() => {
                meant.push(format!("0x{value:02X} for the decimal number {digits}"));
            }
            _ => {}
        }
        let meant = if meant.is_empty() { String::new() } else { format!(": {}", meant.join(", or ")) };
        return Err(UsageError::malformed(format!("{what} 0x00 to 0xFF, written with 0x in front{meant}")));
    }
    let byte = address_names::parse_number(text.trim()).and_then(|byte| u8::try_from(byte).ok());
    byte.ok_or_else(|| UsageError::malformed(format!("{what} 0x00 to 0xFF")))
}

/// The settings of an AVR, and what they mean for its clock.
#[derive(Debug, Clone, Copy)]
pub struct AvrWiring {
    /// Options of the machine.
    pub options: Options,
    /// Oscillator clocks per cycle after a reset: 8 if CKDIV8 is programmed, otherwise 1.
    pub divider: u32,
    /// True if the fuses come from the command line or the image.
    fuses_given: bool,
}

impl AvrFlags {
    /// Returns the name of the package as the chip's row spells it.
    fn package(&self, chip: &Chip) -> Result<Option<&'static str>, VerbFailure> {
        let Some(name) = &self.package else { return Ok(None) };
        if chip.packages.is_empty() {
            return Err(VerbFailure::Usage(format!(
                "--package is for chips of the AVR family; {} is not one",
                chip.name
            )));
        }
        chip.package(name).map(|package| Some(package.name)).ok_or_else(|| {
            let all: Vec<_> = chip.packages.iter().map(|package| package.name).collect();
            VerbFailure::invalid_flag_value(
                "--package <NAME>",
                name,
                &format!("emu has the pin numbers of {} in {}", chip.name, all.join(", ")),
            )
        })
    }

    /// Returns the settings of a machine of `chip` with `image`. `clock` is the oscillator frequency in Hz,
    /// if given. Refuses flags that do not apply to the chip.
    pub fn wiring(
        &self,
        chip: &Chip,
        image: &Image,
        clock: Option<u64>,
        start_up: bool,
    ) -> Result<AvrWiring, VerbFailure> {
        let hz = clock.unwrap_or(chip.default_hz);
        let plain = Options { lock: self.lock, package: self.package(chip)?, ..Options::at_hz(hz) };
        let Some(part) = part(chip) else {
            let given_flags = [("--fuse", !self.fuse.is_empty()), ("--lock", self.lock.is_some())];
            return match given_flags.into_iter().find(|(_, is_given)| *is_given) {
                Some((flag, _)) => {
                    Err(VerbFailure::Usage(format!("{flag} is for chips of the AVR family; {} is not one", chip.name)))
                }
                None => Ok(AvrWiring { options: plain, divider: 1, fuses_given: false }),
            };
        };
        let mut fuses = part.fuses.default_bytes;
        image.fill("fuse", &mut fuses);
        let mut given = [false; 3];
        for &FuseByte(at, value) in &self.fuse {
            let [name, _] = FUSES[at];
            let has = chip.spaces.iter().any(|space| space.name == "fuse" && at < space.size as usize);
            if !has {
                return Err(VerbFailure::Usage(format!("{} has no {name} fuse byte", chip.name)));
            }
            if std::mem::replace(&mut given[at], true) {
                return Err(VerbFailure::Usage(format!("--fuse gives the {name} byte twice")));
            }
            fuses[at] = value;
        }
        let fused = !self.fuse.is_empty() || image.bytes_in("fuse").next().is_some();
        let divided = fused && FuseLayout::is_programmed(fuses, part.fuses.ckdiv8);
        let source = clock_source(part, fuses).1.filter(|_| fused);
        let hz = clock.or(source).unwrap_or(chip.default_hz);
        let options = Options { hz, fuses: fused.then_some(fuses), start_up: start_up && fused, ..plain };
        Ok(AvrWiring { options, divider: if divided { 8 } else { 1 }, fuses_given: fused })
    }
}

/// Returns the row of AVR-only data of a chip, or `None` for other families.
fn part(chip: &Chip) -> Option<&'static AvrPart> {
    chips::part(chip.name).filter(|_| chip.family == ChipFamily::Avr)
}

/// Returns the clock source that CKSEL chooses (DS40002061, table 9-1; for chips without CKDIV8, "Clock
/// sources" in their data sheets), and its frequency in Hz unless the clock is external.
fn clock_source(part: &AvrPart, fuses: [u8; 3]) -> (&'static str, Option<u64>) {
    const CRYSTAL: u64 = 32_768;
    let cksel = FuseLayout::value(fuses, part.fuses.cksel);
    match (part.fuses.ckdiv8.is_some(), cksel) {
        (_, 0) => ("a clock from outside", None),
        (true, 2) => ("the oscillator on the chip", Some(8_000_000)),
        (true, 3) => ("the oscillator on the chip", Some(128_000)),
        (true, 4 | 5) => ("a low-frequency crystal", Some(CRYSTAL)),
        (true, 1) => ("nothing: CKSEL is reserved, used as an external clock", None),
        (false, 1..=4) => ("the oscillator on the chip", Some(1_000_000 << (cksel - 1))),
        (false, 5..=8) => ("an RC oscillator", None),
        (false, 9) => ("a low-frequency crystal", Some(CRYSTAL)),
        _ => ("a crystal", None),
    }
}

/// Returns the reset pin of an AVR, or `None` if RSTDISBL makes it a port pin. `None` for other families.
pub fn reset_pin(chip: &Chip, wiring: &AvrWiring) -> Option<PinId> {
    let fuses = part(chip)?.fuses;
    let bytes = wiring.options.fuses.unwrap_or(fuses.default_bytes);
    let at = chip.pins.iter().position(|pin| pin.note.split(", ").any(|note| note == "RESET"))?;
    (!FuseLayout::is_programmed(bytes, fuses.rstdisbl)).then_some(at as PinId)
}

/// Prints a note on standard error if the fuses choose a clock other than the default.
pub fn report_fuse_clock(chip: &Chip, wiring: &AvrWiring, clock: Option<u64>) {
    let (Some(part), Some(fuses)) = (part(chip).filter(|_| wiring.fuses_given), wiring.options.fuses) else { return };
    let (name, own) = clock_source(part, fuses);
    let hz = wiring.options.hz;
    let divided = match wiring.divider {
        1 => String::new(),
        by => format!(", divided by {by} (CKDIV8): {} Hz at first", hz / u64::from(by)),
    };
    if clock.is_some() && divided.is_empty() {
        return;
    }
    let hint = match (clock, own) {
        (None, None) => "\n  hint: --clock HZ gives its frequency",
        (None, Some(_)) => "\n  hint: --clock HZ overrides it",
        (Some(_), _) => "",
    };
    output::print_to_stderr(&format!("note: the fuses choose {name}, {hz} Hz{divided}{hint}\n"));
}

/// Returns the end of a hint for a run that reached erased memory: what the user can do about it. Empty for
/// other families.
pub fn erased_memory_hint(chip: &Chip, image: &Image, wiring: &AvrWiring) -> String {
    let Some(part) = part(chip) else { return String::new() };
    let first =
        image.segments.iter().filter(|segment| segment.space == chip.code_space).map(|segment| segment.addr).min();
    let fuses = wiring.options.fuses.unwrap_or(part.fuses.default_bytes);
    let begins = FuseLayout::is_programmed(fuses, part.fuses.bootrst);
    let loader = first.filter(|addr| *addr > 0 && !begins).and_then(|at| Some((at, part.boot_fuse(fuses, at)?)));
    let loader = loader.map_or(String::new(), |(at, fuse)| {
        let name = ["low", "high", "extended"].get(usize::from(fuse.index)).copied().unwrap_or_default();
        format!(
            "; --fuse {name}=0x{:02X} begins with the boot loader at 0x{at:X}, with --no-start-up at once",
            fuse.value
        )
    });
    format!("{loader}; --reading erased=nop runs on through it, as the chip does")
}

/// Prints a note on standard error if the clock prescaler at the end of the run differs from that at its
/// start, because all times are counted with the initial clock.
pub fn warn_clock_change<C: Cpu>(cpu: &C, wiring: &AvrWiring) {
    let chip = cpu.chip();
    let clkpr = chip.reg("CLKPR").filter(|_| chip.family == ChipFamily::Avr);
    let Some(clkps) = clkpr.and_then(|addr| cpu.peek(chip.reg_space, addr.into())).map(|value| value & CLKPS) else {
        return;
    };
    let (now, first) = (1u64 << clkps.min(8), u64::from(wiring.divider));
    if now != first {
        let hz = wiring.options.hz;
        output::print_to_stderr(&format!(
            "note: CLKPR divides the clock by {now} in the end, {} Hz; all times are counted at the {} Hz of the start\n",
            hz / now,
            hz / first
        ));
    }
}

/// Replaces `A0` or `ADC0` by the chip's own name of the pin: `A0=1.25V` becomes `PC0=1.25V`. Returns other
/// text unchanged.
pub fn chip_pin_text(chip: &Chip, text: &str) -> String {
    let (name, rest) = text.split_at(text.find('=').unwrap_or(text.len()));
    let upper = name.trim().to_ascii_uppercase();
    let channel = upper.strip_prefix("ADC").or_else(|| upper.strip_prefix('A')).and_then(address_names::parse_number);
    let pin = channel.and_then(|channel| part(chip)?.analog_pins.get(channel as usize));
    match pin.and_then(|&pin| chip.pins.get(usize::from(pin))) {
        Some(pin) => format!("{}{rest}", pin.name),
        None => text.to_owned(),
    }
}
