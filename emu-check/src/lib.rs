//! Checks a compiled ladder program: the image runs on the emulated chip, the program runs on the reference evaluator,
//! both get the same stimulus, and at every scan everything that can be seen is compared.
//!
//! ```text
//!   hints -> stimulus --step--> lockstep: evaluator | rig (chip, places) --> mismatch --> locate, shrink --> report
//!               ^                  |
//!               +--- goals <-------+      what is not covered yet steers the stimulus
//! ```
//!
//! What is compared when, and what the report says, stands in `docs/check.md`.

#![forbid(unsafe_code)]

mod codes;
mod contract;
mod coverage;
mod family;
mod foreign;
pub mod fuzz;
mod goals;
mod hints;
mod html;
mod html_trace;
mod junit;
mod lines;
mod locate;
mod lockstep;
mod peripherals;
mod places;
mod play;
mod play_chip;
mod pulse;
mod reach;
mod report;
mod rig;
mod run;
mod shrink;
mod stimulus;
mod svg;
mod table;
mod tap;
#[cfg(test)]
mod tests;
pub mod via;
mod wanted;
mod wire;
mod wiring;
mod wishes;

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use emu_core::image::{self, Image};
use ladder::Program;
use ladder_compile::Compiled;
use ladder_eval::Evaluator;

use contract::Pace;
use family::{Job, Target, on_machines};
use hints::Hints;
use lockstep::Bench;
use places::Places;

pub use codes::CODES;
pub use coverage::{Class, ClassCoverage, Coverage, Missing};
pub use family::needs_pull_up;
pub use foreign::{
    FOREIGN_CODES, Finding, Foreign, ForeignDifference, ForeignReport, MOST, Period, check_foreign, read_map,
};
pub use html::{Entry, html};
pub use junit::junit;
pub use play::{LadderSite, Outside, Rehearsal};
pub use play_chip::{Performance, Performances, Row, differing, document, perform, rehearse, word};
pub use report::{Difference, Figures, Report, RungFigures, SCHEMA, What};
pub use table::{Outcome, Refused, Summary, table};
pub use wire::{Slot, edges};

/// How a program is checked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// The chip, such as `atmega328p`.
    pub mcu: String,
    /// Seed of everything random: stimulus, and what RAM holds at power-up.
    pub seed: u64,
    /// Scans to compare, at least 1.
    pub scans: u64,
    /// Pins by symbol, such as (`Xstart`, `PD2`).
    pub pins: Vec<(String, String)>,
    /// Clock in Hz, instead of the program's.
    pub clock_hz: Option<u64>,
    /// The time of every rung is measured; without it a check is faster.
    pub rungs: bool,
    /// A difference is explained: the element to blame is looked for and the stimulus made as small as possible. Without it
    /// a check is over as soon as one is found, and its `element` and `smallest` stay empty.
    pub explain: bool,
}

/// 2,000 scans on an ATmega328P with seed 1, with the time of every rung, and a difference explained.
impl Default for Options {
    fn default() -> Self {
        Options {
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

/// Compiles `program` and checks the image. `progress` is called now and then with the scans done and to do.
///
/// A difference is no error: it is in the report.
///
/// # Errors
/// Why there is nothing to check: the compiler or the evaluator refuses the program, or no scans were asked for.
pub fn check(
    program: &Program,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Report, Vec<Diagnostic>> {
    let target = ladder_compile::Options {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let compiled = ladder_compile::compile(program, &target)?;
    check_compiled(program, &compiled, options, progress)
}

/// Checks an image of `program` that has been compiled already; its HEX text and its map are what counts.
///
/// # Errors
/// As [`check`], and when image and map do not fit the program or the chip.
pub fn check_compiled(
    program: &Program,
    compiled: &Compiled,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Report, Vec<Diagnostic>> {
    if options.scans == 0 {
        let cause = "0 scans were asked for, which compares nothing".to_owned();
        let hint = "give --scans 1 or more";
        return Err(vec![Diagnostic::new(Severity::Error, codes::NOTHING, &program.file, Pos::default(), cause, hint)]);
    }
    let Prepared { chip, image, places, hints, eval } = prepared(program, compiled, options)?;
    let disagreements = contract::disagreements(program, options, &places.pace, (&compiled.map, chip));
    let hz = places.pace.clock_hz;
    let job = Check { program, compiled, options, places, hints, eval, disagreements, progress };
    Ok(on_machines(chip, &image, hz, job))
}

/// An image and its program, ready for the bench.
pub(crate) struct Prepared {
    pub chip: &'static Chip,
    pub image: Image,
    pub places: Places,
    pub hints: Hints,
    pub eval: Evaluator,
}

/// Looks up all that a bench needs.
pub(crate) fn prepared(program: &Program, compiled: &Compiled, options: &Options) -> Result<Prepared, Vec<Diagnostic>> {
    let error = |code, cause: String, hint: &str| {
        vec![Diagnostic::new(Severity::Error, code, &program.file, Pos::default(), cause, hint)]
    };
    let eval = Evaluator::new(program).map_err(|refusal| vec![run::no_meaning(program, &refusal)])?;
    let map = &compiled.map;
    let Some(chip) = ladder_compile::chip(&options.mcu) else {
        let known: Vec<&str> = ladder_compile::CHIPS.iter().map(|chip| chip.name).collect();
        let cause = format!("there is no compiler for the chip `{}`, so no image to check", options.mcu);
        return Err(error(codes::NO_CHIP, cause, &format!("known are {}", known.join(", "))));
    };
    let Some(pace) = Pace::new(program, options, chip) else {
        let cause = "the program's cycle time or its clock is 0, so there are no scans to compare".to_owned();
        return Err(error(codes::NOTHING, cause, "give the program a CYCLE= and a CRYSTAL= above 0"));
    };
    let loaded = image::load_hex(&program.file, compiled.hex.as_bytes(), chip.hex).map_err(|faults| {
        let cause = format!("the compiler's HEX text is refused with {} faults", faults.len());
        let mut told = error(codes::BAD_IMAGE, cause, "please report this with the program");
        told.extend(faults);
        told
    })?;
    let places = Places::new(program, map, chip, &eval, pace)?;
    let hints = Hints::new(program, &eval);
    Ok(Prepared { chip, image: loaded.image, places, hints, eval })
}

/// A check that is ready to run.
struct Check<'a> {
    program: &'a Program,
    compiled: &'a Compiled,
    options: &'a Options,
    places: Places,
    hints: Hints,
    eval: Evaluator,
    disagreements: Vec<(String, String)>,
    progress: &'a mut dyn FnMut(u64, u64),
}

impl Job for Check<'_> {
    type Out = Report;

    fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) -> Report {
        let Check { program, compiled, options, places, hints, eval, disagreements, progress } = self;
        let worst = compiled.map.worst_scan_cycles.into();
        let bench = Bench { power_up, places: &places, hints: &hints, worst, rungs: options.rungs, eval: &eval };
        run::run(program, compiled, options, &bench, disagreements, progress)
    }
}
