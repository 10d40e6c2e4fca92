//! Checks a foreign image, which another compiler made, with nothing but the program, the chip and the image.
//!
//! ```text
//!   image -> scan_loop (where scans begin) -> foreign_run: chip at its pins | evaluator -> report
//! ```
//!
//! `docs/foreign.md` describes what is compared, and how.

mod codes;
mod foreign_board;
mod foreign_report;
mod foreign_run;
mod line_listener;
mod scan_budget;
mod scan_loop;

use diag::{Diagnostic, Pos, Severity};
use emu_core::image::Image;
use ladder::LadderProgram;
use ladder_compile::ImageMap;
use ladder_eval::Evaluator;

use crate::chip::families::{CheckedChip, MachineVisitor, find_chip_with_package, visit_machines};
use crate::chip::map_contract::ScanPace;
use crate::comparison::check_run;
use crate::coverage::goals::CoverageGoals;
use crate::report::check_report::{DifferenceKind, SCHEMA};
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::StimulusGenerator;
use crate::stimulus::stimulus_symbols::StimulusSymbols;
use crate::{CheckError, CheckOptions};

use foreign_board::ForeignBoard;
use foreign_run::{ForeignRun, ScanStarts, wire_board};
use scan_budget::{ScanBudget, long_run_scans};

pub use codes::FOREIGN_CODES;
pub use foreign_report::{ForeignDifference, ForeignFinding, ForeignReport, MeasuredPeriod};
pub use scan_budget::MAX_SCANS;

/// An image that another compiler made, with what is known about it.
#[derive(Debug, Clone, Copy)]
pub struct ForeignImage<'a> {
    /// Name of the image file.
    pub file: &'a str,
    /// The contents of the file, for the chip of the options.
    pub image: &'a Image,
    /// The name and contents of a map with the locations of the symbols, if there is one.
    pub map: Option<(&'a str, &'a ImageMap)>,
    /// Number of scans to compare, at least 1; by default as described in `docs/foreign.md`, at most
    /// [`MAX_SCANS`].
    pub scans: Option<u64>,
}

/// A difference, without its scan, run and cycle.
#[derive(Debug, Clone)]
pub(crate) struct ForeignMismatch {
    kind: DifferenceKind,
    symbol: Option<usize>,
    expected: String,
    found: String,
}

impl ForeignMismatch {
    fn of_text(kind: DifferenceKind, expected: String, found: String) -> ForeignMismatch {
        ForeignMismatch { kind, symbol: None, expected, found }
    }

    fn of_symbol(kind: DifferenceKind, symbol: usize, expected: String, found: String) -> ForeignMismatch {
        ForeignMismatch { kind, symbol: Some(symbol), expected, found }
    }
}

/// The runs of the stimulus generator are blocks here, because not each of them begins with a reset: the
/// first three, every fourth and every long one do. The others continue from the state of the block before.
const BLOCKS_PER_RESET: u64 = 4;

/// Checks a foreign image against its program. All of `options` applies except the number of scans.
///
/// # Errors
/// The evaluator refuses the program, a pin is not known, no pacing is found in the image, or the number of
/// scans is 0.
pub fn check_foreign(
    program: &LadderProgram,
    foreign: &ForeignImage<'_>,
    options: &CheckOptions,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<ForeignReport, Vec<Diagnostic>> {
    let error = |code, file: &str, cause: String, hint: &str| {
        vec![Diagnostic::new(Severity::Error, code, file, Pos::default(), cause, hint)]
    };
    let zero = "a check of no scans compares nothing".to_owned();
    if foreign.scans == Some(0) {
        return Err(error(crate::codes::NOTHING, &program.file, zero, "give --scans 1 or more"));
    }
    let eval = Evaluator::new(program).map_err(|refusal| vec![check_run::unsupported_diagnostic(program, &refusal)])?;
    let Some(chip) = find_chip_with_package(&options.mcu) else {
        let cause = format!("images of other compilers cannot be checked on {}", options.mcu);
        return Err(error(codes::NO_FOREIGN, &program.file, cause, "take a chip of the AVR, 8051 or PIC16 family"));
    };
    let Some(pace) = ScanPace::new(program, options, chip) else {
        let hint = "give the program a CYCLE= and a CRYSTAL= above 0";
        return Err(error(crate::codes::NOTHING, &program.file, zero, hint));
    };
    let board = ForeignBoard::new(program, options, &eval, (chip, pace), foreign.map.map(|(_, map)| map))?;
    let job = ForeignCheckVisitor { program, foreign, options, board, eval, progress };
    visit_machines(chip, foreign.image, pace.clock_hz, job).map_err(|why| {
        let hint = "are chip (--mcu), clock (--clock, CRYSTAL=) and CYCLE= those of the image? \
                    docs/foreign.md says which waits are found";
        error(codes::NO_PACE, foreign.file, why.to_string(), hint)
    })
}

/// Parses a map file; `file` is its name for diagnostics.
///
/// # Errors
/// The file is not a map.
pub fn read_map(file: &str, bytes: &[u8]) -> Result<ImageMap, Diagnostic> {
    serde_json::from_slice(bytes).map_err(|error| {
        let hint = "give a map that `emu compile --map` wrote";
        let cause = format!("is not a map: {error}");
        Diagnostic::new(Severity::Error, codes::NO_MAP, file, Pos::default(), cause, hint)
    })
}

/// The command line that repeats a check up to scan `scans`.
fn replay_command(program: &LadderProgram, foreign: &ForeignImage<'_>, options: &CheckOptions, scans: u64) -> String {
    let mut command = check_run::replay_command(program, options, scans)
        + &format!(" --image {}", check_run::shell_quote(foreign.file));
    foreign.map.iter().for_each(|(file, _)| command += &format!(" --map {}", check_run::shell_quote(file)));
    command
}

/// A check of a foreign image that is ready to run, as a visitor of the machine type.
struct ForeignCheckVisitor<'a> {
    program: &'a LadderProgram,
    foreign: &'a ForeignImage<'a>,
    options: &'a CheckOptions,
    board: ForeignBoard,
    eval: Evaluator,
    progress: &'a mut dyn FnMut(u64, u64),
}

impl MachineVisitor for ForeignCheckVisitor<'_> {
    type Output = Result<ForeignReport, CheckError>;

    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> Self::Output {
        let ForeignCheckVisitor { program, foreign, options, board, eval, progress } = self;
        let period = u64::try_from(board.pace.num / board.pace.den).unwrap_or(u64::MAX / 64);
        let erase_unfilled_eeprom = |cpu: &mut C| {
            let image_cells: Vec<u32> = foreign.image.bytes_in("eeprom").map(|one| one.addr).collect();
            for addr in (0..u32::from(board.chip.eeprom_bytes)).filter(|addr| !image_cells.contains(addr)) {
                cpu.poke("eeprom", addr, 0xFF);
            }
        };
        let powered_up = |seed: u64| {
            let mut cpu = power_up(seed);
            erase_unfilled_eeprom(&mut cpu);
            cpu
        };
        let mut cpu = powered_up(options.seed);
        wire_board(&mut cpu, &board);
        let scan_loop = scan_loop::find_scan_loop(cpu, period)?;
        let mut stimulus_symbols = StimulusSymbols::new(program, &eval);
        // The locations of the symbols in memory are not known, so nothing can be written.
        stimulus_symbols.writable.fill(false);
        let mut goals = CoverageGoals::new(program, &eval);
        let mut generator = StimulusGenerator::with_long_runs(
            options.seed,
            BoundaryGoals::new(program, &eval),
            long_run_scans(program),
        );
        let mut budget = ScanBudget::new(foreign.scans, long_run_scans(program) as u64);
        let (mut scans, mut runs, mut blocks) = (0, 0, 0u64);
        let (mut compared, mut longest) = (0, 0);
        let mut findings: Vec<ForeignFinding> = Vec::new();
        let mut longest_starts = ScanStarts::default();
        let mut foreign_run: Option<ForeignRun<'_, C>> = None;
        let mut mismatch = None;
        while scans < budget.scans && mismatch.is_none() {
            progress(scans, budget.scans);
            if let Some(seed) = generator.begin_run(&stimulus_symbols) {
                blocks += 1;
                if blocks <= 3 || blocks % BLOCKS_PER_RESET == 0 || generator.is_long() {
                    runs += 1;
                    foreign_run =
                        Some(ForeignRun::start(powered_up(seed), &eval, &board, &stimulus_symbols, scan_loop));
                }
            }
            let Some(run) = &mut foreign_run else { break };
            scans += 1;
            let mut stimulus = generator.next_stimulus(&stimulus_symbols, &run.eval, &goals);
            stimulus.writes.clear();
            match run.scan(&stimulus) {
                Ok(evaluated) => {
                    let before = goals.open_goal_count();
                    goals.mark_reached(&evaluated);
                    budget.note_scan(scans, goals.open_goal_count() < before);
                }
                Err(found) => mismatch = Some((found, run.starts.scans.max(1), run.cycle())),
            }
            compared += std::mem::take(&mut run.compared);
            longest = run.longest_scan.max(longest);
            for finding in run.findings.drain(..) {
                if !findings.iter().any(|other| other.code == finding.code && other.text == finding.text) {
                    findings.push(finding);
                }
            }
            if run.starts.scans > longest_starts.scans {
                longest_starts = run.starts;
            }
        }
        progress(scans, budget.scans);
        let period = MeasuredPeriod::new(&board.pace, longest_starts);
        if let Some(period) = period.as_ref().filter(|period| period.is_much_too_short()) {
            // The flag is cleared once per CYCLE, so these are not scans, and the comparison means nothing.
            return Err(CheckError::OtherScanRate {
                period: scan_loop.period,
                mean_clocks: period.mean_clocks,
                wanted_clocks: period.wanted_clocks,
            });
        }
        findings.extend(period.as_ref().and_then(|period| period.to_finding(&board.pace, scan_loop.max_read_gap)));
        let difference = mismatch.map(|(mismatch, scan_of_run, cycle)| ForeignDifference {
            code: mismatch.kind.code(),
            scan: scans,
            run: runs,
            scan_of_run,
            cycle,
            what: mismatch.kind,
            symbol: mismatch.symbol.and_then(|symbol| eval.symbols().get(symbol)).map(|symbol| symbol.name.clone()),
            expected: mismatch.expected,
            found: mismatch.found,
            replay: replay_command(program, foreign, options, scans),
        });
        let coverage = goals.coverage(program);
        let not_covered = check_run::not_covered_note(program, &coverage, scans).filter(|_| difference.is_none());
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
            scan_start: scan_loop.start * board.chip.word_bytes.max(1),
            left_out: board.left_out.clone(),
            coverage,
            notes: not_covered.into_iter().collect(),
        })
    }
}
