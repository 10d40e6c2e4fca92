//! One assembler for the instruction tables of all chips.
//!
//! ```text
//!   lib.rs         assemble a source, one instruction     dialect/    differences of families, as tables
//!   engine.rs      passes, names, diagnostics             statement.rs  one line: labels and its word
//!   reader.rs      files, macros, repetitions, conditions
//!   complaints.rs  diagnostics about lines that are not statements
//!   name_or_directive.rs  names of the program that are also directives
//!   macros.rs      macros, text definitions               arguments.rs  macro arguments
//!   matching.rs    operands against the forms             form_table.rs  an instruction table for matching
//!   expression.rs  expressions                            name_values.rs  values of names in expressions
//!   number.rs      numbers, characters                    lines.rs    lines, and pieces of text
//!   symbols.rs     names from pass to pass                chip_names.rs  the chip's names
//!   sections.rs    the sections and their order           output.rs   bytes into memories
//!   listing.rs     the listing                            codes.rs    the diagnostic codes
//! ```
//!
//! The whole source is read again until no name changes its value; only the faults of the last pass are
//! reported. docs/formats/asm.md describes the language.

#![forbid(unsafe_code)]

mod arguments;
mod chip_names;
mod chip_of_source;
mod codes;
mod complaints;
mod dialect;
mod engine;
mod expression;
mod fault;
mod files;
mod form_table;
mod lines;
mod listing;
mod macros;
mod matching;
mod name_or_directive;
mod name_values;
mod number;
mod output;
mod reader;
mod sections;
mod statement;
mod symbols;
mod value;

use diag::text::to_display_text;
use diag::{Diagnostic, Severity};
use emu_core::chip::{Chip, ChipSpace};
use emu_core::image::{CONSTANT_SPACE, Image, SourceLines, SymbolAt};
use emu_core::table::AsmError;

pub use chip_of_source::named_chip;
pub use codes::CODES;
use engine::Assembler;
pub use files::{IncludeFiles, SourceTexts};
pub use listing::AsmListing;
use symbols::AsmSymbolKind;

/// A source text.
#[derive(Debug, Clone, Copy)]
pub struct SourceText<'a> {
    /// Its name, for diagnostics and as the base of its includes.
    pub name: &'a str,
    /// Its bytes.
    pub bytes: &'a [u8],
}

/// A name and the text that replaces it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedText {
    /// The name of a text definition or of a macro's parameter.
    pub name: String,
    /// The text.
    pub text: String,
}

impl NamedText {
    /// Makes a text with its name.
    pub(crate) fn new(name: impl Into<String>, text: impl Into<String>) -> NamedText {
        NamedText { name: name.into(), text: text.into() }
    }
}

/// Settings of an assembly.
#[derive(Debug, Clone, Default)]
pub struct AssembleOptions {
    /// Names and their texts, as with `#define`.
    pub defines: Vec<NamedText>,
    /// Finds a chip by its command-line name: then an include of another chip of the family defines that
    /// chip's names, as its file would. If `None`, such an include is refused.
    pub find_chip: Option<fn(name: &str) -> Option<&'static Chip>>,
    /// Undefined names of an 8051 source belong to other modules, as with `sdas8051 -g`: their value is 0,
    /// with a warning.
    pub undefined_global: bool,
}

/// An assembled program.
#[derive(Debug, Clone)]
pub struct AssembledProgram {
    /// The image: its bytes, its names (labels in their memories, others as [`CONSTANT_SPACE`]) and its
    /// lines.
    pub image: Image,
    /// The listing.
    pub listing: AsmListing,
    /// The source asks for a HEX file without records of extended addresses (`list f=inhx8m` of PIC16).
    pub is_inhx8m: bool,
    /// Warnings and notes, in source order.
    pub warnings: Vec<Diagnostic>,
    /// The texts that were read.
    pub texts: SourceTexts,
}

/// A refused program. `Display` prints all errors, one per line: `line:column: CODE: cause (hint)`.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{}", error_lines(.diagnostics))]
pub struct RefusedSource {
    /// All errors and warnings in the order in which they were found; at most 100 errors and 100 remarks, and
    /// a closing note.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that were read.
    pub texts: SourceTexts,
}

/// Assembles a program for a chip.
///
/// # Errors
/// All faults of the program.
pub fn assemble(
    source: &SourceText<'_>,
    chip: &'static Chip,
    options: &AssembleOptions,
    files: &mut dyn IncludeFiles,
) -> Result<AssembledProgram, Box<RefusedSource>> {
    let mut asm = Assembler::new(chip, options.defines.clone(), files);
    asm.find_chip = options.find_chip;
    asm.undefined_global = options.undefined_global;
    asm.texts.add(source.name, source.bytes, asm.dialect.block_comments);
    asm.run_passes();
    let faults = asm.take_diagnostics();
    let texts = std::mem::take(&mut asm.texts);
    if faults.iter().any(|fault| fault.severity == Severity::Error) {
        return Err(Box::new(RefusedSource { diagnostics: faults, texts }));
    }
    let listing = AsmListing {
        rows: asm.out.list.iter().map(|listed| listing::ListingRow::of(listed, &asm.out.bytes, &texts)).collect(),
        symbols: asm
            .symbols
            .all()
            .into_iter()
            .filter(|(name, _)| !name.contains('\u{1}'))
            .map(|(name, symbol)| {
                (to_display_text(name).into_owned(), symbol.value.number, listing::kind_name(&symbol.kind))
            })
            .collect(),
        digits: if chip.flash_bytes > 0x1_0000 { 5 } else { 4 },
    };
    let is_inhx8m = asm.family_state.pic16.is_inhx8m;
    Ok(AssembledProgram { image: image_of(&mut asm), listing, is_inhx8m, warnings: faults, texts })
}

/// Returns the image of the assembled program.
fn image_of(asm: &mut Assembler<'_>) -> Image {
    let mut symbols: Vec<SymbolAt> = asm
        .symbols
        .all()
        .into_iter()
        .filter(|(name, _)| !name.contains('\u{1}'))
        .filter_map(|(name, symbol)| {
            let (space, addr) = match symbol.kind {
                AsmSymbolKind::Label { space, addr } => (space, addr),
                AsmSymbolKind::Equ | AsmSymbolKind::Set => (CONSTANT_SPACE, symbol.value.number as u32),
                AsmSymbolKind::Alias { ref of, .. } => bit_of(asm.chip, of)?,
            };
            Some(SymbolAt::new(to_display_text(name).into_owned(), space, addr, 0))
        })
        .collect();
    let memory = |name: &str| asm.chip.spaces.iter().position(|space| space.name == name).unwrap_or(usize::MAX);
    symbols.sort_by(|a, b| (memory(a.space), a.addr, &a.name).cmp(&(memory(b.space), b.addr, &b.name)));
    Image {
        segments: std::mem::take(&mut asm.out.segments),
        symbols,
        lines: SourceLines::new(std::mem::take(&mut asm.out.lines)),
        entry: None,
    }
}

/// Returns the memory and the address of an AP101 bit from its name, such as `M1`; `None` for other families.
fn bit_of(chip: &Chip, register: &str) -> Option<(&'static str, u32)> {
    let zone = register.chars().next()?.to_ascii_lowercase();
    let zone =
        [('t', "r"), ('o', "e")].iter().find(|row| row.0 == zone).map_or(zone.to_string(), |row| row.1.to_owned());
    let number = register.get(1..)?.trim_start_matches('_').parse().ok()?;
    let &ChipSpace { name: space, size, .. } =
        chip.spaces.iter().find(|ChipSpace { name, .. }| chip.is_bit_controller() && *name == zone)?;
    (number < size).then_some((space, number))
}

/// Reports whether a name already has a meaning on this chip, ignoring case: an instruction, directive,
/// function, register, bit or constant. Such a name cannot be a label.
#[must_use]
pub fn is_taken(chip: &'static Chip, name: &str) -> bool {
    let (dialect, table) = (dialect::AsmDialect::of(chip), form_table::FormTable::of(chip.isa));
    let lower = name.to_ascii_lowercase();
    let is = |word: &&str| word.eq_ignore_ascii_case(name);
    let operators = dialect.operators.iter().map(|row| row.0).chain(dialect.unary.iter().map(|row| row.0));
    let slots = chip.isa.rows.iter().flat_map(|row| row.operands);
    dialect.find_directive(&lower).is_some()
        || operators.chain(dialect.location_counter_names.iter().copied()).any(|word| is(&word))
        || !table.forms(&lower).is_empty()
        || table.words.contains(&lower)
        || chip_names::ChipNames::of(chip).get(name).is_some()
        || slots.into_iter().any(|slot| (slot.kind.parse_name)(name).is_some())
}

/// Returns the names of the directives of a chip's dialect, without a dot.
#[must_use]
pub fn directive_names(chip: &Chip) -> Vec<&'static str> {
    let mut names: Vec<&'static str> = dialect::AsmDialect::of(chip).names().collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Assembles a text without includes, for tests.
///
/// # Errors
/// All faults of the text.
pub fn assemble_text(chip: &'static Chip, text: &str) -> Result<Image, Box<RefusedSource>> {
    let source = SourceText { name: "", bytes: text.as_bytes() };
    assemble(&source, chip, &AssembleOptions::default(), &mut ()).map(|assembled| assembled.image)
}

fn error_lines(diagnostics: &[Diagnostic]) -> String {
    let errors = diagnostics.iter().filter(|fault| fault.is_error());
    let lines = errors.map(|f| format!("{}:{}: {}: {} ({})", f.pos.line, f.pos.column, f.code, f.cause, f.hint));
    lines.collect::<Vec<_>>().join("\n")
}

/// Assembles one line, an instruction or values, for the program word address `pc`.
///
/// # Errors
/// The first fault of the line.
pub fn assemble_line(chip: &'static Chip, text: &str, pc: u32) -> Result<Vec<u16>, AsmError> {
    let mut none = ();
    let mut asm = Assembler::new(chip, Vec::new(), &mut none);
    asm.texts.add("", text.as_bytes(), false);
    asm.run_one_line(pc);
    let error = asm.take_diagnostics().into_iter().find(Diagnostic::is_error);
    if let Some(fault) = error {
        return Err(AsmError { code: fault.code, cause: fault.cause, hint: fault.hint });
    }
    let size = chip.word_bytes.clamp(1, 2) as usize;
    let words =
        asm.out.bytes.chunks(size).map(|word| word.iter().rev().fold(0, |high, &low| high << 8 | u16::from(low)));
    let words: Vec<u16> = words.collect();
    if words.is_empty() {
        let hint = "write a mnemonic and its operands".to_owned();
        return Err(AsmError { code: "ASM004", cause: "the line is empty".to_owned(), hint });
    }
    Ok(words)
}
