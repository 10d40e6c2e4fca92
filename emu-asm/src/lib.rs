//! One assembler over any chip's instruction table.
//!
//! ```text
//!   lib.rs        assemble a source, one instruction     dialect/   what families do differently, as tables
//!   engine.rs     passes, names, complaints              statement.rs  one line: labels and its word
//!                                                          given.rs  names that are words of directives, complaints.rs  lines that are none
//!   reader.rs     files, macros, repetitions, conditions  macros.rs  macros, texts for names
//!   arguments.rs  arguments of macros, put in
//!   matching.rs   operands against the forms              table.rs   an instruction table made ready for that
//!   expr.rs       expressions     names.rs   what names stand for in them
//!   number.rs     numbers         symbols.rs names from pass to pass   chip_names.rs  the chip's names
//!   sections.rs   which there are, and their order
//!   output.rs     bytes into memories                     listing.rs the listing     codes.rs  the codes of complaints
//! ```
//!
//! The source is read again as a whole until no name moves; only what the last pass finds wrong is told. The language stands in
//! docs/formats/asm.md.

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

use diag::text::to_display_text;
use diag::{Diagnostic, Severity};
use emu_core::chip::{Chip, ChipFamily};
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
    /// Its name, for messages and as what includes count from.
    pub name: &'a str,
    /// Its bytes.
    pub bytes: &'a [u8],
}

/// What is given beside the source.
#[derive(Debug, Clone, Default)]
pub struct AssembleOptions {
    /// Names with their texts, as by `#define`.
    pub defines: Vec<(String, String)>,
    /// Chips by name, as on a command line: the include of another chip of the family gives that chip's names, as its file would.
    /// Without it such an include is refused.
    pub find_chip: Option<fn(name: &str) -> Option<&'static Chip>>,
    /// Names that no line of an 8051 source gives are those of other modules, as with `sdas8051 -g`: 0 stands for them, and a
    /// warning tells.
    pub undefined_global: bool,
}

/// An assembled program.
#[derive(Debug, Clone)]
pub struct AssembledProgram {
    /// The image: its bytes, its names (labels in their memories, others as [`CONSTANT_SPACE`]) and its lines.
    pub image: Image,
    /// The listing.
    pub listing: AsmListing,
    /// The source asks for a HEX file without records of extended addresses (`list f=inhx8m` of PIC16).
    pub is_inhx8m: bool,
    /// Warnings and notes, in the order of the source.
    pub warnings: Vec<Diagnostic>,
    /// The texts that were read.
    pub texts: SourceTexts,
}

/// A refused program. `Display` is all errors, one a line: `line:column: CODE: cause (hint)`.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{}", error_lines(.diagnostics))]
pub struct RefusedSource {
    /// All errors, in the order in which they were found, and the warnings between them; at most 100 of each and a closing note.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that were read.
    pub texts: SourceTexts,
}

/// Assembles a program for a chip.
///
/// # Errors
/// All that is wrong with it.
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

/// The image of what was assembled.
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
    let memory = |space: &str| asm.chip.spaces.iter().position(|(name, ..)| *name == space).unwrap_or(usize::MAX);
    symbols.sort_by(|a, b| (memory(a.space), a.addr, &a.name).cmp(&(memory(b.space), b.addr, &b.name)));
    Image {
        segments: std::mem::take(&mut asm.out.segments),
        symbols,
        lines: SourceLines::new(std::mem::take(&mut asm.out.lines)),
        entry: None,
    }
}

/// Memory and address of a bit of AP101 by its name, as `M1`; other families' registers are none of a memory.
fn bit_of(chip: &Chip, register: &str) -> Option<(&'static str, u32)> {
    let zone = register.chars().next()?.to_ascii_lowercase();
    let zone =
        [('t', "r"), ('o', "e")].iter().find(|row| row.0 == zone).map_or(zone.to_string(), |row| row.1.to_owned());
    let number = register.get(1..)?.trim_start_matches('_').parse().ok()?;
    let &(space, size, _) = chip.spaces.iter().find(|(name, ..)| chip.family == ChipFamily::Ap101 && *name == zone)?;
    (number < size).then_some((space, number))
}

/// Whether a name means something already on this chip, case aside: an instruction, a directive, a function, a register, a bit or a
/// number of the chip. Such a name is no label.
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

/// Names of the directives that a chip's dialect takes, without a dot.
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
/// All that is wrong with it.
pub fn assemble_text(chip: &'static Chip, text: &str) -> Result<Image, Box<RefusedSource>> {
    let source = SourceText { name: "", bytes: text.as_bytes() };
    assemble(&source, chip, &AssembleOptions::default(), &mut ()).map(|assembled| assembled.image)
}

fn error_lines(diagnostics: &[Diagnostic]) -> String {
    let errors = diagnostics.iter().filter(|fault| fault.is_error());
    let lines = errors.map(|f| format!("{}:{}: {}: {} ({})", f.pos.line, f.pos.column, f.code, f.cause, f.hint));
    lines.collect::<Vec<_>>().join("\n")
}

/// Assembles one line, an instruction or values, that will stand at the program word `pc`.
///
/// # Errors
/// What is wrong with it.
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
