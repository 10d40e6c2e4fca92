//! Checks an image that another compiler has made: the program, the chip and the image are all that is known of it.
//!
//! ```text
//!   image -> pace (where scans begin) -> course: chip at its pins | evaluator -> report with findings
//! ```
//!
//! What is compared how stands in `docs/foreign.md`.

mod board;
mod codes;
mod course;
mod ear;
mod pace;
mod patience;
mod report;

use diag::{Diagnostic, Pos, Severity};
use emu_core::image::Image;
use ladder::Program;
use ladder_compile::Map;
use ladder_eval::Evaluator;

use crate::contract::Pace;
use crate::family::{Job, Target, named, on_machines};
use crate::goals::Goals;
use crate::hints::Hints;
use crate::report::{SCHEMA, What};
use crate::stimulus::Stimulus;
use crate::wishes::Wishes;
use crate::{Options, run};

use board::Board;
use course::{Course, Starts, wire};
use patience::{Budget, patience};

pub use codes::FOREIGN_CODES;
pub use patience::MOST;
pub use report::{Finding, ForeignDifference, ForeignReport, Period};

/// An image that another compiler has made.
#[derive(Debug, Clone, Copy)]
pub struct Foreign<'a> {
    /// Name of its file.
    pub file: &'a str,
    /// What the file holds, for the chip of the options.
    pub image: &'a Image,
    /// Where its symbols are, if that is known, with the name of the file that tells it.
    pub map: Option<(&'a str, &'a Map)>,
    /// Scans to compare, at least 1; else as many as `docs/foreign.md` says, at most [`MOST`].
    pub scans: Option<u64>,
}

/// A difference, without its place in the check.
#[derive(Debug, Clone)]
pub(crate) struct Wrong {
    what: What,
    symbol: Option<usize>,
    expected: String,
    found: String,
}

impl Wrong {
    fn words(what: What, expected: String, found: String) -> Wrong {
        Wrong { what, symbol: None, expected, found }
    }

    fn of(what: What, symbol: usize, expected: String, found: String) -> Wrong {
        Wrong { what, symbol: Some(symbol), expected, found }
    }
}

/// Runs of the stimulus of which each begins with a reset: the first two, and then one in so many.
const RESETS: u64 = 4;

/// Checks the image against the program. Of `options` all but the scans counts.
///
/// # Errors
/// Why there is nothing to check: the evaluator refuses the program, pins are not known, no pacing is found in the image, or
/// no scans were asked for.
pub fn check_foreign(
    program: &Program,
    foreign: &Foreign<'_>,
    options: &Options,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<ForeignReport, Vec<Diagnostic>> {
    let error = |code, file: &str, cause: String, hint: &str| {
        vec![Diagnostic::new(Severity::Error, code, file, Pos::default(), cause, hint)]
    };
    let zero = "a check of no scans compares nothing".to_owned();
    if foreign.scans == Some(0) {
        return Err(error(crate::codes::NOTHING, &program.file, zero, "give --scans 1 or more"));
    }
    let eval = Evaluator::new(program).map_err(|refusal| vec![run::no_meaning(program, &refusal)])?;
    let Some(chip) = named(&options.mcu) else {
        let cause = format!("{} is no chip on which images of others are checked", options.mcu);
        return Err(error(codes::NO_FOREIGN, &program.file, cause, "take a chip of the AVR, 8051 or PIC16 family"));
    };
    let Some(pace) = Pace::new(program, options, chip) else {
        let hint = "give the program a CYCLE= and a CRYSTAL= above 0";
        return Err(error(crate::codes::NOTHING, &program.file, zero, hint));
    };
    let board = Board::new(program, options, &eval, (chip, pace), foreign.map.map(|(_, map)| map))?;
    let job = Check { program, foreign, options, board, eval, progress };
    on_machines(chip, foreign.image, pace.clock_hz, job).map_err(|cause| {
        let hint = "are chip (--mcu), clock (--clock, CRYSTAL=) and CYCLE= those of the image? \
                    docs/foreign.md says which waits are found";
        error(codes::NO_PACE, foreign.file, cause, hint)
    })
}

/// The map in a file of that name.
///
/// # Errors
/// It is none.
pub fn read_map(file: &str, bytes: &[u8]) -> Result<Map, Diagnostic> {
    serde_json::from_slice(bytes).map_err(|error| {
        let hint = "give a map that `emu compile --map` wrote";
        let cause = format!("is no map: {error}");
        Diagnostic::new(Severity::Error, codes::NO_MAP, file, Pos::default(), cause, hint)
    })
}

/// The command that repeats a check up to scan `scans`.
fn replay(program: &Program, foreign: &Foreign<'_>, options: &Options, scans: u64) -> String {
    let mut command = run::replay(program, options, scans) + &format!(" --image {}", run::quoted(foreign.file));
    foreign.map.iter().for_each(|(file, _)| command += &format!(" --map {}", run::quoted(file)));
    command
}

/// A check that is ready to run.
struct Check<'a> {
    program: &'a Program,
    foreign: &'a Foreign<'a>,
    options: &'a Options,
    board: Board,
    eval: Evaluator,
    progress: &'a mut dyn FnMut(u64, u64),
}

impl Job for Check<'_> {
    type Out = Result<ForeignReport, String>;

    fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) -> Self::Out {
        let Check { program, foreign, options, board, eval, progress } = self;
        let period = u64::try_from(board.pace.num / board.pace.den).unwrap_or(u64::MAX / 64);
        let fill = |cpu: &mut C| {
            let filled: Vec<u32> = foreign.image.bytes_in("eeprom").map(|(addr, _)| addr).collect();
            for addr in (0..u32::from(board.chip.eeprom)).filter(|addr| !filled.contains(addr)) {
                cpu.poke("eeprom", addr, 0xFF);
            }
        };
        let fresh = |seed: u64| {
            let mut cpu = power_up(seed);
            fill(&mut cpu);
            cpu
        };
        let mut probe = fresh(options.seed);
        wire(&mut probe, &board);
        let found = pace::find(probe, period)?;
        let mut hints = Hints::new(program, &eval);
        // Nothing of the image's memory is known.
        hints.writable.fill(false);
        let mut goals = Goals::new(program, &eval);
        let mut stimulus = Stimulus::patient(options.seed, Wishes::new(program, &eval), patience(program));
        let mut budget = Budget::new(foreign.scans, patience(program) as u64);
        let (mut scans, mut runs, mut blocks) = (0, 0, 0u64);
        let (mut compared, mut longest) = (0, 0);
        let mut findings: Vec<Finding> = Vec::new();
        let mut timed = Starts::default();
        let mut course: Option<Course<'_, C>> = None;
        let mut wrong = None;
        while scans < budget.scans && wrong.is_none() {
            progress(scans, budget.scans);
            if let Some(seed) = stimulus.begin(&hints) {
                blocks += 1;
                if blocks <= 3 || blocks % RESETS == 0 || stimulus.is_long() {
                    runs += 1;
                    course = Some(Course::start(fresh(seed), &eval, &board, &hints, found));
                }
            }
            let Some(course) = &mut course else { break };
            scans += 1;
            let mut step = stimulus.step(&hints, &course.eval, &goals);
            step.writes.clear();
            match course.scan(&step) {
                Ok(seen) => {
                    let before = goals.remaining();
                    goals.mark(&seen);
                    budget.seen(scans, goals.remaining() < before);
                }
                Err(found) => wrong = Some((found, course.starts.scans.max(1), course.cycle())),
            }
            compared += std::mem::take(&mut course.compared);
            longest = course.longest.max(longest);
            for finding in course.findings.drain(..) {
                if !findings.iter().any(|other| other.code == finding.code && other.says == finding.says) {
                    findings.push(finding);
                }
            }
            if course.starts.scans > timed.scans {
                timed = course.starts;
            }
        }
        progress(scans, budget.scans);
        let period = Period::new(&board.pace, timed);
        if let Some(period) = period.as_ref().filter(|period| period.is_far_too_short()) {
            // The flag is cleared once in CYCLE, so these are no scans, and what was compared says nothing.
            return Err(format!(
                "where scans begin is not found: the flag of the timer is cleared every {} machine cycles, but what seems \
                 to be a scan comes every {:.0} clocks, where CYCLE asks for {:.0}",
                found.period, period.mean_clocks, period.wanted_clocks
            ));
        }
        findings.extend(period.as_ref().and_then(|period| period.finding(&board.pace, found.gap)));
        let difference = wrong.map(|(wrong, scan_of_run, cycle)| ForeignDifference {
            code: wrong.what.code(),
            scan: scans,
            run: runs,
            scan_of_run,
            cycle,
            what: wrong.what,
            symbol: wrong.symbol.and_then(|symbol| eval.symbols().get(symbol)).map(|symbol| symbol.name.clone()),
            expected: wrong.expected,
            found: wrong.found,
            replay: replay(program, foreign, options, scans),
        });
        let coverage = goals.coverage(program);
        let unseen = run::not_covered(program, &coverage, scans).filter(|_| difference.is_none());
        Ok(ForeignReport {
            schema: SCHEMA,
            program: program.file.clone(),
            image: foreign.file.to_owned(),
            mcu: board.chip.name.to_owned(),
            seed: options.seed,
            scans,
            runs,
            compared,
            agreed: difference.is_none() && findings.is_empty(),
            difference,
            findings,
            period,
            scan_cycles_max: longest,
            scan_start: found.start * board.chip.word_bytes.max(1),
            left_out: board.left_out.clone(),
            coverage,
            notes: unseen.into_iter().collect(),
        })
    }
}
