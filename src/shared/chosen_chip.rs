//! The chip of an image: from `--mcu`, or from the file itself; and the requests to simavr in an ELF file.

use diag::text::readable;
use emu_core::chip::Chip;
use emu_core::image::{Image, SimavrSection, SimavrTrace, avr_device, avr_signature, read_simavr_section};

use crate::shared::chip_guess::{hex_signature, name_chips};
use crate::shared::codes::{NO_MODEL, file_error};
use crate::shared::fail::VerbFailure;
use crate::shared::flags::McuFlags;
use crate::shared::input::ELF_MAGIC;
use crate::shared::report::FileTexts;
use crate::shared::{assembly, family, image_origin, input, output};

/// The ELF section in which a program sends requests to simavr, as messages name it.
const SECTION: &str = "section .mmcu";

/// The chip of an image, with the image's requests to simavr.
pub struct ChosenChip {
    /// The chip.
    pub chip: &'static Chip,
    /// The contents of the `.mmcu` section.
    simavr: Option<SimavrSection>,
    file: String,
}

/// A chip that a file names.
pub struct NamedChip {
    /// The name as written in the file.
    pub name: String,
    /// Where the name is in the file: `comment on line 3`.
    pub place: String,
    /// The row of the chip, if there is a model of it.
    pub chip: Option<&'static Chip>,
}

impl McuFlags {
    /// Chooses the chip that runs the image in `file`. Prints a note if the file itself names the chip.
    pub fn choose_chip(&self, file: &str) -> Result<ChosenChip, VerbFailure> {
        self.choose_chip_or(file, None)
    }

    /// Chooses the chip of an image, with a default for files that name no chip.
    pub fn choose_chip_or(&self, file: &str, default: Option<&'static Chip>) -> Result<ChosenChip, VerbFailure> {
        // If the chip is known, an unreadable file is reported later, when the image is loaded.
        let bytes = match (input::read_bytes_twice(file), self.chip.or(default)) {
            (Ok(bytes), _) => bytes,
            (Err(_), Some(_)) => Vec::new(),
            (Err(why), None) => return Err(why),
        };
        let simavr = read_simavr_section(&bytes);
        if let Some(simavr) = &simavr {
            report_simavr_oddities(file, &bytes, simavr);
        }
        let chosen = |chip| ChosenChip { chip, simavr: simavr.clone(), file: file.to_owned() };
        if let Some(chip) = self.chip {
            return Ok(chosen(chip));
        }
        match (named_chip(file, &bytes), default) {
            (Some(NamedChip { chip: Some(chip), place, .. }), _) => {
                output::print_to_stderr(&format!(
                    "note: the chip is {} ({file}: {place}); --mcu CHIP overrides it\n",
                    chip.name
                ));
                Ok(chosen(chip))
            }
            (_, Some(chip)) => Ok(chosen(chip)),
            (Some(NamedChip { name, place, .. }), None) if place == MICRO => Err(unmodelled_micro(file, &name)),
            (Some(NamedChip { name, place, .. }), None) => Err(VerbFailure::Usage(format!(
                "{file} is for {name} ({place}), for which emu has no model; --mcu CHIP runs it on another (`emu chips` lists all)"
            ))),
            (None, None) => Err(VerbFailure::Usage(format!(
                "{file} does not say for which chip it is; give --mcu CHIP (`emu chips` lists all)"
            ))),
        }
    }
}

/// The header line of a ladder program that names its chip.
const MICRO: &str = "MICRO=";

/// The refusal of a program in `file` that is for the target `micro` of LDmicro, for which there is no model.
pub fn unmodelled_micro(file: &str, micro: &str) -> VerbFailure {
    let target = ladder::unmodelled_target(micro);
    let what = target.map_or("which is not known", |target| target.what);
    let hint = match target.and_then(|target| target.nearest) {
        Some(nearest) => format!("the nearest is {nearest} (--mcu {nearest}; `emu chips` lists all)"),
        None => "give --mcu CHIP (`emu chips` lists them)".to_owned(),
    };
    let cause = format!("names `{micro}` in MICRO=, {what}");
    VerbFailure::Refused(vec![file_error(NO_MODEL, file, cause, &hint)], FileTexts::default())
}

/// Returns the chip that an image or a source names.
///
/// - An ELF file: the note of avr-gcc, the `.mmcu` section for simavr, or the signature.
/// - A HEX file: a comment as CCS C writes it, or the signature.
/// - A source for a PIC or an AVR: directives and includes.
/// - A ladder program: MICRO=.
pub fn named_chip(file: &str, bytes: &[u8]) -> Option<NamedChip> {
    let avr =
        |name: String, place: &str| NamedChip { chip: image_origin::find_avr(&name), name, place: place.to_owned() };
    let signed = |signature| {
        let (name, _) = name_chips(image_origin::avrs_with_signature(signature))?;
        let chip = image_origin::avrs_with_signature(signature).into_iter().next();
        Some(NamedChip { name, place: "signature".to_owned(), chip })
    };
    if bytes.starts_with(ELF_MAGIC) {
        let device = avr_device(bytes).map(|name| avr(name, "note of its compiler"));
        let from_section = || Some(avr(read_simavr_section(bytes)?.mcu?, SECTION));
        return device.or_else(from_section).or_else(|| signed(avr_signature(bytes)?));
    }
    if bytes.starts_with(b"LDmicro") {
        let parsed = ladder::parse_bytes(file, bytes, ladder::ParseOptions::default()).ok()?;
        let name = parsed.program.settings.micro?;
        let chip = ladder::chip_of(&name).and_then(|chip| family::parse_chip(chip).ok());
        return Some(NamedChip { name, place: MICRO.to_owned(), chip });
    }
    if assembly::is_source(file) {
        let name = emu_asm::named_chip(bytes)?;
        return Some(NamedChip { chip: family::parse_chip(&name).ok(), name, place: "directive".to_owned() });
    }
    chip_in_comment(bytes).or_else(|| signed(hex_signature(bytes)?))
}

/// Returns the chip that a comment of a HEX file names, such as `;PIC16F877`.
pub fn chip_in_comment(bytes: &[u8]) -> Option<NamedChip> {
    // Most files have no comments, and files may be large.
    if !bytes.contains(&b';') {
        return None;
    }
    let text = readable(bytes);
    let comments =
        (1..).zip(text.lines()).filter_map(|(number, line)| Some((number, line.trim_start().strip_prefix(';')?)));
    comments.take(100).find_map(|(number, comment): (u32, &str)| {
        comment.split(|c: char| !c.is_ascii_alphanumeric()).find_map(|word| {
            let chip = family::find_by_maker_name(word).filter(|_| word.starts_with(|c: char| c.is_ascii_alphabetic()));
            let place = format!("comment on line {number}");
            (chip.is_some() || is_pic(word) || is_avr(word)).then(|| NamedChip { name: word.to_owned(), place, chip })
        })
    })
}

/// Returns true for the name of any PIC: `PIC18F4550`, `PIC12F675`.
fn is_pic(word: &str) -> bool {
    let rest = word.get(..3).filter(|front| front.eq_ignore_ascii_case("pic")).and_then(|_| word.get(3..));
    rest.is_some_and(|rest| rest.len() >= 5 && rest.starts_with(|c: char| c.is_ascii_digit()))
}

/// Returns true for the name of any AVR: `ATmega2560`, `ATtiny85`, `AT90S8515`, `ATxmega128A1`.
fn is_avr(word: &str) -> bool {
    const FAMILIES: [&str; 4] = ["atmega", "attiny", "atxmega", "at90"];
    let word = word.to_ascii_lowercase();
    let rest = FAMILIES.iter().find_map(|family| word.strip_prefix(family));
    rest.is_some_and(|rest| rest.contains(|c: char| c.is_ascii_digit()))
}

/// Prints notes on standard error about inconsistent contents of the `.mmcu` section.
fn report_simavr_oddities(file: &str, bytes: &[u8], simavr: &SimavrSection) {
    if let Some(tag) = simavr.truncated_bytes {
        output::print_to_stderr(&format!(
            "note: {file}: the entry of tag {tag} in {SECTION} is longer than the section: it and the rest are ignored\n"
        ));
    }
    let row = |name: &str| image_origin::find_avr(name).map_or(name.to_owned(), |chip| chip.name.to_owned());
    if let (Some(compiler), Some(section_mcu)) = (avr_device(bytes), &simavr.mcu)
        && row(&compiler) != row(section_mcu)
    {
        output::print_to_stderr(&format!(
            "note: {file} is for {section_mcu} by {SECTION}, and for {compiler} by the note of its compiler, which counts\n"
        ));
    }
}

impl ChosenChip {
    /// Returns the clock in Hz: `requested` if given, otherwise the clock in the `.mmcu` section, with a
    /// note.
    pub fn clock(&self, requested: Option<u64>) -> Option<u64> {
        let image_hz = self.simavr.as_ref().and_then(|simavr| simavr.hz).map(u64::from);
        let (None, Some(hz)) = (requested, image_hz) else { return requested };
        let (file, chip) = (&self.file, self.chip);
        if hz > chip.max_hz {
            output::print_to_stderr(&format!(
                "note: {file} requests {hz} Hz ({SECTION}), and {} runs at up to {} Hz: ignored\n",
                chip.name, chip.max_hz
            ));
            return None;
        }
        output::print_to_stderr(&format!("note: {file} requests {hz} Hz ({SECTION}); --clock HZ overrides it\n"));
        Some(hz)
    }

    /// Prints notes on standard error that name the flags for the program's requests to simavr. `vcd` is true
    /// if a waveform is written.
    pub fn report_simavr_requests(&self, image: &Image, vcd: bool) {
        let Some(simavr) = &self.simavr else { return };
        let file = &self.file;
        let register = |addr: u16| {
            let named = self.chip.regs.iter().find(|reg| reg.addr == addr);
            named.map_or_else(|| format!("{}:0x{addr:X}", self.chip.reg_space), |reg| reg.name.to_owned())
        };
        if !vcd && (simavr.vcd.is_some() || !simavr.traces.is_empty()) {
            let mut flags = format!("--vcd {}", simavr.vcd.as_deref().unwrap_or("FILE"));
            let mut added = Vec::new();
            for trace in &simavr.traces {
                let name = match *trace {
                    SimavrTrace::Register(addr, _) => register(addr),
                    SimavrTrace::Ram(addr, bytes) => self.ram_signal_name(image, addr.into(), bytes.into()),
                    SimavrTrace::Pin(..) | SimavrTrace::Interrupt => continue,
                };
                if !added.contains(&name) {
                    flags.push_str(&format!(" --vcd-add {name}"));
                    added.push(name);
                }
            }
            if simavr.traces.contains(&SimavrTrace::Interrupt) {
                flags.push_str(" --trace FILE (for interrupts)");
            }
            output::print_to_stderr(&format!("note: {file} asks simavr for a waveform\n  hint: {flags}\n"));
        }
        if let Some(addr) = simavr.console {
            let name = register(addr);
            output::print_to_stderr(&format!(
                "note: {file} prints through {name}, the console of simavr, which is not shown\n  hint: --vcd FILE --vcd-add {name} has its bytes\n"
            ));
        }
        if let Some(addr) = simavr.command {
            output::print_to_stderr(&format!(
                "note: {file} sends commands to simavr through {}: ignored\n",
                register(addr)
            ));
        }
    }

    /// Returns the `--vcd-add` name for `bytes` bytes of RAM at `addr`: the variable of that address and size
    /// if its name is one word, otherwise the address.
    fn ram_signal_name(&self, image: &Image, addr: u32, bytes: u32) -> String {
        let space = self.chip.reg_space;
        let objects = image.symbols.iter().filter(|s| (s.space, s.addr, s.size) == (space, addr, bytes));
        let word = |name: &&str| name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let named = objects.map(|symbol| symbol.name.as_str()).find(word);
        named.map_or_else(
            || match bytes {
                1 => format!("{space}:0x{addr:X}"),
                _ => format!("{space}:0x{addr:X}..0x{:X}", addr + bytes),
            },
            str::to_owned,
        )
    }
}
