//! Checks a compiled ladder program: the image runs on the emulated chip, the program runs on the reference
//! evaluator, both get the same stimulus, and after every scan all observable values are compared.
//!
//! ```text
//!   symbols -> generator --stimulus--> lockstep: evaluator | chip --> mismatch --> locate, shrink --> report
//!                 ^                       |
//!                 +----- goals <----------+     outcomes that are not covered yet steer the generator
//! ```
//!
//! ```text
//!   stimulus/    the inputs of every scan, values worth trying, and the smallest stimulus of a difference
//!   coverage/    the outcomes that a check should see, and has seen
//!   chip/        facts of the chips, places of the program in its image, pins and peripherals, the run
//!   comparison/  lockstep of evaluator and chip, the element at fault, two dialects compared
//!   scenarios/   scenarios on the evaluator, or on evaluator and chip
//!   report/      results as data, text, HTML page, table and JUnit file
//!   foreign/     images of other compilers, of which only the pins are known
//!   fuzz/        campaigns with random programs
//!   via/         checks of emitted sources: C, byte code and Arduino sketches
//! ```
//!
//! `docs/check.md` describes what is compared when, and the contents of the report.
//!
//! ```
//! use emu_check::{CheckOptions, check};
//!
//! let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
//! let text = format!("{head}RUNG\n    CONTACTS Xstart 0\n    COIL Ylamp 0 0 0\nEND\n");
//! let program = ladder::parse("lamp.ld", &text).expect("a sound program").program;
//! let options = CheckOptions { mcu: "pic16f877".to_owned(), scans: 200, ..Default::default() };
//! let report = check(&program, &options, &mut |_done, _total| {}).expect("a program that compiles");
//! assert!(report.agreed);
//! assert_eq!(report.scans, 200);
//! ```

#![forbid(unsafe_code)]

mod chip;
mod codes;
mod comparison;
mod coverage;
mod error;
mod foreign;
pub mod fuzz;
mod report;
mod scenarios;
mod stimulus;
#[cfg(test)]
mod tests;
pub mod via;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use emu_core::image::{self, Image};
use ladder::LadderProgram;
use ladder_compile::{CompiledProgram, PinAssignment};
use ladder_eval::Evaluator;

use chip::deviation::Deviation;
use chip::families::{CheckedChip, MachineVisitor, visit_machines};
use chip::map_contract::ScanPace;
use chip::program_places::ProgramPlaces;
use comparison::lockstep::TestBench;
use stimulus::stimulus_symbols::StimulusSymbols;

pub use chip::families::needs_pull_up;
pub use chip::serial_line::{ArrivalWindow, byte_edges};
pub use codes::CODES;
pub use comparison::dialect_comparison::{
    DialectComparison, InputRow, MeaningChange, SERIAL_LINE, SymbolDifference, compare_dialects, meaning_changes,
};
pub use coverage::classes::{ClassCoverage, CoverageClass, LadderCoverage, MissingOutcome};
pub use error::CheckError;
pub use foreign::{
    FOREIGN_CODES, ForeignDifference, ForeignFinding, ForeignImage, ForeignReport, MAX_SCANS, MeasuredPeriod,
    check_foreign, read_map,
};
pub use report::check_report::{CheckDifference, CheckReport, DifferenceKind, ProgramFigures, RungFigures, SCHEMA};
pub use report::html_page::{ReportEntry, html_report};
pub use report::junit::junit;
pub use report::summary_table::{CheckOutcome, CheckSummary, RefusedCheck, summary_table};
pub use scenarios::on_chip::{
    ScenarioReport, ScenarioReportRow, ScenarioResult, outcome_name, play_on_chip, play_on_evaluator, scenario_report,
    verdict_diagnostic,
};
pub use scenarios::play::{EvaluatorPlay, LadderResolver, ScanInputs};

/// Options of a check.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckOptions {
    /// The chip, such as `atmega328p`.
    pub mcu: String,
    /// Seed of all random choices: the stimulus, and the contents of RAM at power-up.
    pub seed: u64,
    /// Number of scans to compare, at least 1.
    pub scans: u64,
    /// Pins of symbols; they override those of `IO LIST`.
    pub pins: Vec<PinAssignment>,
    /// Clock in Hz; overrides the clock of the program.
    pub clock_hz: Option<u64>,
    /// Whether the execution time of every rung is measured; a check without it is faster.
    pub rungs: bool,
    /// Whether a difference is explained: the check then locates the faulty element and shrinks the stimulus.
    /// Otherwise the check ends at the first difference, and `element` and `smallest` of the report stay
    /// empty.
    pub explain: bool,
}

/// 2,000 scans on an ATmega328P with seed 1, with timed rungs and explained differences.
impl Default for CheckOptions {
    fn default() -> Self {
        CheckOptions {
            mcu: "atmega328p".to_owned(),
            seed: 1,
            scans: 2_000,
            pins: Vec::new(),
            clock_hz: None,
            rungs: true,
            explain: true,
        }
    }
}

/// Compiles `program` and checks the image. `progress` is called periodically with (scans done, scans in
/// total).
///
/// A difference is not an error: it is part of the report.
///
/// # Errors
/// The compiler or the evaluator refuses the program, or `options.scans` is 0.
pub fn check(
    program: &LadderProgram,
    options: &CheckOptions,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<CheckReport, Vec<Diagnostic>> {
    let target = ladder_compile::CompileOptions {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let compiled = ladder_compile::compile(program, &target)?;
    check_compiled(program, &compiled, options, progress)
}

/// Checks an image of `program` that is already compiled, as given by its HEX text and its map.
///
/// # Errors
/// The errors of [`check`], and an image or map that does not fit the program or the chip.
pub fn check_compiled(
    program: &LadderProgram,
    compiled: &CompiledProgram,
    options: &CheckOptions,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<CheckReport, Vec<Diagnostic>> {
    if options.scans == 0 {
        let cause = "0 scans were asked for, which compares nothing".to_owned();
        let hint = "give --scans 1 or more";
        return Err(vec![Diagnostic::new(Severity::Error, codes::NOTHING, &program.file, Pos::default(), cause, hint)]);
    }
    let PreparedCheck { chip, image, places, stimulus_symbols, eval } = prepare_check(program, compiled, options)?;
    let map_deviations = chip::map_contract::map_deviations(program, options, &places.pace, (&compiled.map, chip));
    let hz = places.pace.clock_hz;
    let job = CheckVisitor { program, compiled, options, places, stimulus_symbols, eval, map_deviations, progress };
    Ok(visit_machines(chip, &image, hz, job))
}

/// The parts of a check that are prepared before the chip runs.
pub(crate) struct PreparedCheck {
    pub chip: &'static Chip,
    pub image: Image,
    pub places: ProgramPlaces,
    /// The symbols that the stimulus sets.
    pub stimulus_symbols: StimulusSymbols,
    /// The evaluator at power-up.
    pub eval: Evaluator,
}

/// Prepares a check: loads the image, resolves the map and sets up the evaluator.
pub(crate) fn prepare_check(
    program: &LadderProgram,
    compiled: &CompiledProgram,
    options: &CheckOptions,
) -> Result<PreparedCheck, Vec<Diagnostic>> {
    let error = |code, cause: String, hint: &str| {
        vec![Diagnostic::new(Severity::Error, code, &program.file, Pos::default(), cause, hint)]
    };
    let eval = Evaluator::new(program)
        .map_err(|refusal| vec![comparison::check_run::unsupported_diagnostic(program, &refusal)])?;
    let map = &compiled.map;
    let Some(chip) = ladder_compile::find_chip(&options.mcu) else {
        let known: Vec<&str> = ladder_compile::CHIPS.iter().map(|chip| chip.name).collect();
        let cause = format!("there is no compiler for the chip `{}`, so no image to check", options.mcu);
        return Err(error(codes::NO_CHIP, cause, &format!("known are {}", known.join(", "))));
    };
    let Some(pace) = ScanPace::new(program, options, chip) else {
        let cause = "the program's cycle time or its clock is 0, so there are no scans to compare".to_owned();
        return Err(error(codes::NOTHING, cause, "give the program a CYCLE= and a CRYSTAL= above 0"));
    };
    let loaded = image::load_hex(&program.file, compiled.hex.as_bytes(), chip.hex_spaces).map_err(|faults| {
        let cause = format!("the compiler's HEX text is refused with {} faults", faults.len());
        let mut diagnostics = error(codes::BAD_IMAGE, cause, "please report this with the program");
        diagnostics.extend(faults);
        diagnostics
    })?;
    let places = ProgramPlaces::new(program, map, chip, &eval, pace)?;
    let stimulus_symbols = StimulusSymbols::new(program, &eval);
    Ok(PreparedCheck { chip, image: loaded.image, places, stimulus_symbols, eval })
}

/// A check as a visitor of the machine type.
struct CheckVisitor<'a> {
    program: &'a LadderProgram,
    compiled: &'a CompiledProgram,
    options: &'a CheckOptions,
    places: ProgramPlaces,
    stimulus_symbols: StimulusSymbols,
    eval: Evaluator,
    map_deviations: Vec<Deviation>,
    progress: &'a mut dyn FnMut(u64, u64),
}

impl MachineVisitor for CheckVisitor<'_> {
    type Output = CheckReport;

    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> CheckReport {
        let CheckVisitor { program, compiled, options, places, stimulus_symbols, eval, map_deviations, progress } =
            self;
        let worst = compiled.map.worst_scan_cycles.into();
        let bench = TestBench {
            power_up,
            places: &places,
            stimulus_symbols: &stimulus_symbols,
            worst_scan_cycles: worst,
            time_rungs: options.rungs,
            eval: &eval,
        };
        comparison::check_run::run_check(program, compiled, options, &bench, map_deviations, progress)
    }
}
