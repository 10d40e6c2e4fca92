//! Compiles ladder programs: a program becomes a chip's image, a listing, and a map of all places.
//!
//! ```text
//! ladder::LadderProgram -> element checks -> lower -> optimise -> a back end (layout, pacing, select, code)
//!     -> HEX, listing, map
//! ```
//!
//! `docs/compile.md` describes how the compiler works and what the map holds.
//!
//! ```
//! use ladder_compile::{CompileOptions, compile};
//!
//! let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
//! let text = format!("{head}RUNG\n    CONTACTS Xstart 0\n    COIL Ylamp 0 0 0\nEND\n");
//! let program = ladder::parse("lamp.ld", &text).expect("a sound program").program;
//! let compiled = compile(&program, &CompileOptions { mcu: "atmega328p".to_owned(), ..Default::default() })
//!     .expect("a program that fits the chip");
//! assert!(compiled.hex.ends_with(":00000001FF\n")); // Intel HEX
//! assert!(compiled.map.pins.iter().any(|pin| pin.name == "Ylamp"));
//! ```

#![forbid(unsafe_code)]

pub mod ap101;
mod arithmetic;
mod assembly;
pub mod avr;
mod build_map;
pub mod code;
mod codegen_error;
mod codes;
pub mod element_checks;
pub mod emit;
pub mod ir;
mod ir_text;
mod jump_roles;
mod listing;
pub mod longest_path;
pub mod lower;
mod map;
pub mod mcs51;
mod mutants;
pub mod optimise;
pub mod period;
pub mod pic16;
pub mod pins;
mod refusal_diagnostics;
pub mod target;
mod timed_module;

use emu_core::image::{HexSegment, write_hex};
use std::sync::LazyLock;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use ladder::{LadderDialect, LadderProgram};

use ir::Ir;
use pins::{AssignedPin, PinPlan};
use target::{BuiltImage, CompileJob, CompileTarget, PwmPin};

pub use assembly::assembly;
pub use codegen_error::CodegenError;
pub use codes::{CODES, FUSES_NOTE};
pub use map::{CellLocation, EepromMap, ElementMap, ImageMap, PinMap, Ratio, RungMap, SCHEMA, SpecialPin, SymbolMap};
pub use mutants::{Mutant, MutantIr, MutantKind, compile_mutant, mutant_ir, mutants};
pub use pins::PinAssignment;

/// All target chips of the compiler, by family.
pub const TARGETS: &[&[CompileTarget]] = &[avr::TARGETS, mcs51::TARGETS, pic16::TARGETS, ap101::TARGETS];

/// Iterates over all target chips; the emulators support more chips than the compiler.
pub fn targets() -> impl Iterator<Item = &'static CompileTarget> {
    TARGETS.iter().copied().flatten()
}

/// Chip descriptions of all targets.
pub static CHIPS: LazyLock<Vec<&'static Chip>> = LazyLock::new(|| targets().map(|target| target.chip).collect());

/// Finds the target with chip `name`, ignoring case.
#[must_use]
pub fn find_target(name: &str) -> Option<&'static CompileTarget> {
    targets().find(|target| target.chip.name.eq_ignore_ascii_case(name))
}

/// Finds the chip `name`, ignoring case, if the compiler supports it.
#[must_use]
pub fn find_chip(name: &str) -> Option<&'static Chip> {
    find_target(name).map(|target| target.chip)
}

/// Options of a compilation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompileOptions {
    /// Name of the chip, such as `atmega328p`.
    pub mcu: String,
    /// Pins of symbols; they override those of `IO LIST`.
    pub pins: Vec<PinAssignment>,
    /// Clock frequency in Hz that overrides `CRYSTAL=`.
    pub clock_hz: Option<u64>,
    /// True to optimise; false for plain three-address code, which is easy to follow by eye.
    pub optimise: bool,
}

impl Default for CompileOptions {
    fn default() -> CompileOptions {
        CompileOptions { mcu: String::new(), pins: Vec::new(), clock_hz: None, optimise: true }
    }
}

/// Result of a compilation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompiledProgram {
    /// Intel HEX of program memory, including configuration words if the chip has them there.
    pub hex: String,
    /// Program memory from address 0, in bytes.
    pub code: Vec<u8>,
    /// Listing: the instructions with the elements that they belong to.
    pub listing: String,
    /// Intermediate code as text.
    pub ir: String,
    /// Map of all places in the image.
    pub map: ImageMap,
    /// The image as built by the back end.
    pub built: BuiltImage,
    /// Notes for the user: pins assigned automatically, fuses, outputs that need external parts. Never
    /// errors.
    pub notes: Vec<Diagnostic>,
}

/// Compiles `program`. The caller must print the warnings of `ladder::check`.
///
/// # Errors
/// All reasons for which there is no image: errors of `ladder::check`, elements that the chip does not
/// support, pins, time, size. The image is never partial.
pub fn compile(program: &LadderProgram, options: &CompileOptions) -> Result<CompiledProgram, Vec<Diagnostic>> {
    let prepared = prepare(program, options)?;
    let job = prepared.compile_job(program);
    let built = (job.target.build)(&job)
        .map_err(|refusal| refusal_diagnostics::refusal_diagnostics(&refusal, program, &job))?;
    finish_compile(program, &job, built, prepared.notes.clone())
}

/// Returns the intermediate code that `program` is compiled to; the program must have passed the checks.
#[must_use]
pub fn lower_for_target(program: &LadderProgram, target: &CompileTarget, optimised: bool) -> Ir {
    let mut ir = lower::lower_with_modules(program, target.has_modules());
    if target.has_modules() {
        ir.set_bits_in_first_scan();
    }
    if optimised { optimise::optimise(ir) } else { lower::to_three_address(ir) }
}

/// The clock in Hz at which a chip runs a program: the one asked for, or the program's. Instruction List
/// names no crystal, so such a program runs at the chip's usual clock.
#[must_use]
pub fn clock_hz(program: &LadderProgram, chip: &Chip, asked: Option<u64>) -> u64 {
    asked.unwrap_or(match program.dialect {
        LadderDialect::Iec => chip.default_hz,
        LadderDialect::Ldmicro23 | LadderDialect::Ldmicro5 => program.settings.crystal_hz,
    })
}

/// Input of a back end after all checks have passed.
pub(crate) struct PreparedCompile {
    pub target: &'static CompileTarget,
    pub pins: Vec<AssignedPin>,
    pub pwm_pins: Vec<PwmPin>,
    pub clock_hz: u64,
    pub ir: Ir,
    pub notes: Vec<Diagnostic>,
}

impl PreparedCompile {
    /// Creates the job for the back end.
    pub(crate) fn compile_job<'a>(&'a self, program: &LadderProgram) -> CompileJob<'a> {
        CompileJob {
            ir: &self.ir,
            target: self.target,
            pins: &self.pins,
            pwm_pins: &self.pwm_pins,
            clock_hz: self.clock_hz,
            cycle_us: program.settings.cycle_us,
            baud: program.settings.baud,
        }
    }
}

/// Runs all checks that are possible before an image is built.
pub(crate) fn prepare(program: &LadderProgram, options: &CompileOptions) -> Result<PreparedCompile, Vec<Diagnostic>> {
    let error = |code, cause: String, hint: &str| {
        Diagnostic::new(Severity::Error, code, &program.file, Pos::default(), cause, hint)
    };
    let mut diagnostics: Vec<Diagnostic> = ladder::check(program).into_iter().filter(Diagnostic::is_error).collect();
    let target = find_target(&options.mcu);
    for refusal in element_checks::unsupported_elements(program, target) {
        if !diagnostics.iter().any(|known| known.pos.line == refusal.pos.line) {
            diagnostics.push(refusal);
        }
    }
    diagnostics.sort_by_key(|diagnostic| diagnostic.pos);
    let Some(target) = target else {
        let known: Vec<&str> = CHIPS.iter().map(|chip| chip.name).collect();
        let cause = format!("there is no compiler for the chip `{}`", options.mcu);
        diagnostics.push(error(codes::UNKNOWN_CHIP, cause, &format!("known are {}", known.join(", "))));
        return Err(diagnostics);
    };
    let PinPlan { pins, pwm_pins } = pins::assign_pins(program, &options.pins, target, &mut diagnostics);
    let clock_hz = clock_hz(program, target.chip, options.clock_hz);
    if clock_hz == 0 || clock_hz > target.chip.max_hz {
        let cause = format!("the clock is {clock_hz} Hz, {} runs at 1 to {} Hz", target.chip.name, target.chip.max_hz);
        diagnostics.push(error(codes::CLOCK, cause, "set CRYSTAL=, or give another clock on the command line"));
    }
    // The checks of the language already refuse most programs with a cycle of zero.
    if program.settings.cycle_us == 0 && !diagnostics.iter().any(Diagnostic::is_error) {
        diagnostics.push(error(codes::NO_CYCLE, "the cycle time is 0 us".to_owned(), "set CYCLE="));
    }
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(diagnostics.into_iter().filter(Diagnostic::is_error).collect());
    }

    let ir = lower_for_target(program, target, options.optimise);
    Ok(PreparedCompile { target, pins, pwm_pins, clock_hz, ir, notes: diagnostics })
}

/// Checks the timing of a finished image and produces HEX, listing and map.
pub(crate) fn finish_compile(
    program: &LadderProgram,
    job: &CompileJob<'_>,
    built: BuiltImage,
    mut notes: Vec<Diagnostic>,
) -> Result<CompiledProgram, Vec<Diagnostic>> {
    if built.worst_scan_cycles + built.poll_cycles > built.shortest_period_cycles {
        return Err(vec![refusal_diagnostics::scan_too_long(program, job, &built)]);
    }
    let map = build_map::build_map(program, job, &built);
    let warn = |severity, code, cause: String, hint: &str| {
        Diagnostic::new(severity, code, &program.file, Pos::default(), cause, hint)
    };
    if !map.fuses.is_empty() {
        notes.push(warn(Severity::Note, codes::FUSES_NOTE, format!("fuses: {}", map.fuses.join("; ")), ""));
    }
    notes.extend(built.pin_needs.iter().map(|need| warn(need.severity, codes::OUTSIDE, need.cause.clone(), need.hint)));
    let segments: Vec<HexSegment> = built.segments.iter().map(|(at, bytes)| HexSegment { addr: *at, bytes }).collect();
    Ok(CompiledProgram {
        hex: write_hex(&segments),
        listing: listing::listing(program, job.ir, job.target.chip, &built, &map),
        ir: job.ir.to_string(),
        code: built.segments.first().map_or_else(Vec::new, |(_, bytes)| bytes.clone()),
        map,
        built,
        notes,
    })
}
