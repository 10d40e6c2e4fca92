//! Reads input files: images, symbols, sources and ladder programs.

use std::collections::HashSet;
use std::fs::File;
use std::io::{self, Read as _};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use diag::text::{readable, strip_line_decorations};
use diag::{Diagnostic, Severity};
use emu_core::chip::Chip;
use emu_core::image::{self, CONSTANT_SPACE, ElfMachine, Image, SourceLines, SymbolAt, SymbolFile, Symbols};
use ladder::{LadderDialect, LadderProgram, ReadOptions};
use ladder_compile::PinAssignment;

use crate::shared::chip_guess::guess_chip;
use crate::shared::codes::{OTHER_PROCESSOR, OTHER_PROGRAM, SOURCE_AS_IMAGE, UNREADABLE, file_error, system_message};
use crate::shared::fail::VerbFailure;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{ap101, assembly, chosen_chip, family, output};

/// Maximum size of a file, in bytes.
const MAX_BYTES: u64 = 64 << 20;

/// The first bytes of every ELF file.
pub const ELF_MAGIC: &[u8] = b"\x7fELF";

/// True if an editor uses standard input, so that `-` cannot be read as a file.
static STDIN_TAKEN: AtomicBool = AtomicBool::new(false);

/// The name and bytes of a file that was read once and will be read again.
static PEEKED: Mutex<Option<(String, Vec<u8>)>> = Mutex::new(None);

/// Reserves standard input: after this call, `-` cannot be read.
pub fn reserve_stdin() {
    STDIN_TAKEN.store(true, Ordering::Relaxed);
}

/// Reads all bytes of a file; `-` is standard input.
pub fn read_bytes(file: &str) -> Result<Vec<u8>, VerbFailure> {
    read_file(file).map_err(|error| unreadable_file(file, &error))
}

/// Returns the failure that a file cannot be read.
pub fn unreadable_file(file: &str, error: &io::Error) -> VerbFailure {
    let cause = match error.kind() {
        io::ErrorKind::FileTooLarge => "is larger than 64 MB".to_owned(),
        _ => format!("cannot be read: {}", system_message(error)),
    };
    let hint = "check the path; - is standard input";
    VerbFailure::Refused(vec![file_error(UNREADABLE, file, cause, hint)], FileTexts::default())
}

/// Reads all bytes of a file that will be read once more. The bytes are kept, because a pipe can be read only
/// once.
pub fn read_bytes_twice(file: &str) -> Result<Vec<u8>, VerbFailure> {
    let bytes = read_bytes(file)?;
    if let Ok(mut peeked) = PEEKED.lock() {
        *peeked = Some((file.to_owned(), bytes.clone()));
    }
    Ok(bytes)
}

/// Reads all bytes of a file like [`read_bytes`], but returns the system error.
pub fn read_file(file: &str) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if let Ok(mut peeked) = PEEKED.lock()
        && let Some((_, bytes)) = peeked.take_if(|(name, _)| name == file)
    {
        return Ok(bytes);
    }
    let most = MAX_BYTES + 1;
    match file {
        "-" if STDIN_TAKEN.load(Ordering::Relaxed) => return Err(io::Error::other("standard input is the editor's")),
        "-" => io::stdin().lock().take(most).read_to_end(&mut bytes)?,
        _ => File::open(file)?.take(most).read_to_end(&mut bytes)?,
    };
    if bytes.len() as u64 > MAX_BYTES { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

/// Reads the image for `chip` from a HEX, ELF or object file, or assembles it from a source. Prints warnings.
pub fn read_image(file: &str, chip: &'static Chip, style: &MessageStyle) -> Result<Image, VerbFailure> {
    let bytes = read_bytes(file)?;
    if assembly::is_source(file) || file == "-" && is_text(&bytes) {
        let image = assembly::assemble_image(file, &bytes, chip, style)?;
        let faults = ap101::configuration_faults(file, &[], chip, &image);
        return if faults.is_empty() { Ok(image) } else { Err(VerbFailure::Refused(faults, FileTexts::default())) };
    }
    match image::load(file, &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)) {
        Ok(mut loaded) => {
            let faults = ap101::configuration_faults(file, &bytes, chip, &loaded.image);
            if !faults.is_empty() {
                return Err(VerbFailure::Refused(faults, FileTexts::one(file, bytes)));
            }
            loaded.warnings.extend(guess_chip(file, &bytes, chip, false));
            // The source lines of an ELF file are not in the file itself, so there is no text to draw.
            if bytes.starts_with(ELF_MAGIC) {
                report_diagnostics(style, &loaded.warnings, FileTexts::NONE);
                loaded.image.lines = SourceLines::from_elf(file, bytes);
            } else {
                report_diagnostics(style, &loaded.warnings, &FileTexts::one(file, bytes));
            }
            Ok(loaded.image)
        }
        Err(mut faults) => {
            faults.extend(guess_chip(file, &bytes, chip, true));
            faults.extend(source(file, &bytes));
            Err(VerbFailure::Refused(faults, FileTexts::one(file, bytes)))
        }
    }
}

/// Returns true for text that is neither Intel HEX nor ELF. The first line that is not a comment decides.
fn is_text(bytes: &[u8]) -> bool {
    let text = strip_line_decorations(bytes);
    let mut lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    // An image may begin with comments, as a source does.
    let first = lines.find(|line| !matches!(line, [] | [b';', ..])).unwrap_or_default();
    !text.trim_ascii().is_empty() && !first.starts_with(b":") && !text.starts_with(ELF_MAGIC) && !text.contains(&0)
}

/// Returns a note if the file looks like assembly source instead of an image.
fn source(file: &str, bytes: &[u8]) -> Option<Diagnostic> {
    let text = is_text(bytes).then(|| readable(bytes))?;
    let is_source = text.lines().any(|line| line.trim_start().starts_with([';', '.', '#']));
    is_source.then(|| {
        let cause =
            "this looks like a source, which is assembled where its name ends in .asm, .s, .a51 or .src".to_owned();
        let note = file_error(SOURCE_AS_IMAGE, file, cause, "rename it, or give it to `emu asm`");
        Diagnostic { severity: Severity::Note, ..note }
    })
}

/// Reads an image like [`read_image`], and adds the symbols of symbol files. Prints warnings.
pub fn read_image_with_symbols(
    file: &str,
    symbols: &[String],
    chip: &'static Chip,
    style: &MessageStyle,
) -> Result<Image, VerbFailure> {
    if std::iter::once(file).chain(symbols.iter().map(String::as_str)).filter(|name| *name == "-").count() > 1 {
        return Err(VerbFailure::Usage("standard input (-) can be only one of the files".to_owned()));
    }
    let Some(spaces) = chip.family_traits().symbol_spaces else {
        return match symbols.first() {
            None => read_image(file, chip, style),
            Some(_) => Err(VerbFailure::Usage(format!(
                "--symbols reads what SDCC, Keil and gputils write for the 8051 and PIC16 families; a program for {} has its symbols in its ELF file or source",
                chip.name
            ))),
        };
    };
    let mut image = read_image(file, chip, style)?;
    let files = symbols.iter().map(|name| Ok((name, read_bytes(name)?))).collect::<Result<Vec<_>, VerbFailure>>()?;
    let read: Vec<SymbolFile<'_>> = files.iter().map(|(name, bytes)| SymbolFile { name, bytes }).collect();
    let loaded = image::load_symbols(&read, spaces);
    let texts = FileTexts(files.into_iter().map(|(name, bytes)| (name.clone(), bytes)).collect());
    match loaded {
        Ok(found) => {
            report_diagnostics(style, &found.warnings, &texts);
            report_diagnostics(style, &foreign_symbol_warnings(&found, symbols, &image, chip), FileTexts::NONE);
            let constant = |(name, value)| SymbolAt::new(name, CONSTANT_SPACE, value, 0);
            image.symbols.extend(found.symbols);
            image.symbols.extend(found.unplaced.into_iter().map(constant));
            if !symbols.is_empty() {
                image.lines = SourceLines::new(found.lines).with_debug_info(found.debug_info);
            }
            Ok(image)
        }
        Err(faults) => Err(VerbFailure::Refused(faults, texts)),
    }
}

/// Returns warnings if the symbols belong to another program or to a program for another chip.
fn foreign_symbol_warnings(found: &Symbols, files: &[String], image: &Image, chip: &Chip) -> Vec<Diagnostic> {
    let warning = |error: Diagnostic| Diagnostic { severity: Severity::Warning, ..error };
    let processors =
        found.processors_by_file.iter().filter_map(|(file, made_for)| other_processor_error(file, made_for, chip));
    let mut warnings: Vec<Diagnostic> = processors.map(warning).collect();
    let names = found.symbols.iter().filter(|symbol| symbol.space == chip.code_space).map(|symbol| symbol.addr);
    let places: HashSet<u32> = names.chain(found.lines.iter().map(|line| line.addr)).collect();
    let mut filled = image.bytes_in(chip.code_space).map(|one| one.addr).peekable();
    if !places.is_empty() && filled.peek().is_some() && !filled.any(|addr| places.contains(&addr)) {
        let cause = format!("no name and no source line is at an address that the image fills in {}", chip.code_space);
        let hint = "are these the symbols of this program? Give the files that were written with the image";
        warnings.push(warning(file_error(OTHER_PROGRAM, &files.join(", "), cause, hint)));
    }
    warnings
}

/// Returns an error if a `.cod` file says that its program is for another chip.
pub fn other_processor_error(file: &str, made_for: &str, chip: &Chip) -> Option<Diagnostic> {
    let known = family::find_by_maker_name(made_for);
    if known.is_some_and(|known| known.name == chip.name) {
        return None;
    }
    let cause = format!("the file is of a program for {made_for}, not for {}", chip.name);
    let hint = known.map_or_else(
        || format!("assemble the program for {}", chip.name),
        |known| format!("--mcu {}, or assemble the program for {}", known.name, chip.name),
    );
    Some(file_error(OTHER_PROCESSOR, file, cause, &hint))
}

/// A ladder program and its text.
pub struct ReadProgram {
    /// The program.
    pub program: LadderProgram,
    /// The text, for drawing diagnostics.
    pub texts: FileTexts,
}

impl ReadProgram {
    /// Returns the chip that the program names.
    ///
    /// # Errors
    /// The program names no chip, or a chip that is unknown.
    pub fn chip(&self) -> Result<&'static str, VerbFailure> {
        let micro = self.program.settings.micro.as_deref();
        micro.and_then(ladder::chip_of).ok_or_else(|| {
            let file = &self.program.file;
            if let Some(micro) = micro {
                return chosen_chip::unmodelled_micro(file, micro);
            }
            let why = match self.program.dialect {
                LadderDialect::Iec => {
                    format!("{file} is in a notation that names no chip; give --mcu CHIP (`emu chips` lists them)")
                }
                LadderDialect::Ldmicro23 | LadderDialect::Ldmicro5 => {
                    format!("{file} names no chip in MICRO=; give --mcu CHIP (`emu chips` lists them)")
                }
            };
            VerbFailure::Usage(why)
        })
    }

    /// Prints a note if MICRO= names a chip other than `chip`, the chip of --mcu. Variants of one chip, whose
    /// names begin alike (atmega328, 328p), count as the same chip.
    pub fn note_other_chip(&self, chip: &str) {
        let named = self.program.settings.micro.as_deref().and_then(ladder::chip_of);
        let Some(named) = named.filter(|named| !named.starts_with(chip) && !chip.starts_with(named)) else { return };
        output::print_to_stderr(&format!(
            "note: {} is drawn for {named} (MICRO=); --mcu runs it on {chip}\n",
            self.program.file
        ));
    }
}

/// Reads a ladder program and prints its warnings. With `checked`, also runs the checks of the language.
pub fn read_program(
    file: &str,
    options: ReadOptions,
    checked: bool,
    style: &MessageStyle,
) -> Result<ReadProgram, VerbFailure> {
    let (read, notes) = parse_program(file, read_bytes(file)?, options, checked)?;
    report_diagnostics(style, &notes, &read.texts);
    Ok(read)
}

/// Reads a ladder program whose inputs and outputs `pins` assigns, and prints its warnings and those of the
/// checks of the language: about pins of the program only where `pins` names no other.
pub fn read_program_for_pins(
    file: &str,
    options: ReadOptions,
    pins: &[PinAssignment],
    style: &MessageStyle,
) -> Result<ReadProgram, VerbFailure> {
    let (read, mut notes) = parse_program(file, read_bytes(file)?, options, true)?;
    let moved = |note: &Diagnostic| {
        let of = |entry: &&ladder::IoEntry| entry.pos == note.pos && pins.iter().any(|pin| pin.symbol == entry.name);
        read.program.io.iter().any(|entry| of(&entry))
    };
    notes.retain(|note| note.code != ladder::NO_PORT_PIN || !moved(note));
    report_diagnostics(style, &notes, &read.texts);
    Ok(read)
}

/// Parses a ladder program; with `checked`, also looks for suspicious elements. Returns its warnings and
/// notes.
///
/// # Errors
/// The program has errors.
pub fn parse_program(
    file: &str,
    text: Vec<u8>,
    options: ReadOptions,
    checked: bool,
) -> Result<(ReadProgram, Vec<Diagnostic>), VerbFailure> {
    let parsed = ladder::read_program(file, &text, options);
    let texts = FileTexts::one(file, text);
    let parsed = match parsed {
        Ok(parsed) => parsed,
        Err(faults) => return Err(VerbFailure::Refused(faults, texts)),
    };
    // No verb writes a program back, so warnings about rewriting do not apply.
    let mut warned: Vec<_> = parsed.warnings.into_iter().filter(|d| d.code != ladder::REWRITTEN).collect();
    if checked {
        warned.extend(ladder::check(&parsed.program));
        warned.sort_by_key(|d| d.pos);
    }
    if warned.iter().any(diag::Diagnostic::is_error) {
        return Err(VerbFailure::Refused(warned, texts));
    }
    Ok((ReadProgram { program: parsed.program, texts }, warned))
}
