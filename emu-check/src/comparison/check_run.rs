//! Runs a check: starts runs from reset and compares scan after scan until something differs or all scans are
//! done.

use diag::{Diagnostic, Pos, Severity};
use ladder::{LadderDialect, LadderProgram, LdFormat};
use ladder_compile::{CompiledProgram, PinAssignment};

use crate::CheckOptions;
use crate::chip::deviation::Deviation;
use crate::chip::families::CheckedChip;
use crate::codes;
use crate::comparison::fault_location::find_faulty_element;
use crate::comparison::lockstep::{FLOATING_LEVEL, LockstepPair, Mismatch, TestBench};
use crate::coverage::classes::LadderCoverage;
use crate::coverage::goals::CoverageGoals;
use crate::report::check_report::{CheckDifference, CheckReport, DifferenceKind, ProgramFigures, RungFigures, SCHEMA};
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::{ScanStimulus, StimulusGenerator};
use crate::stimulus::shrink::shrink_stimulus;

/// Scans between two progress reports.
const SCANS_PER_PROGRESS: u64 = 64;

/// Totals of a check.
#[derive(Default)]
struct RunTotals {
    /// Scans executed on both sides.
    scans: u64,
    /// Runs, each of which begins with a power-up.
    runs: u64,
    /// Values compared.
    compared: u64,
    /// Machine cycles of the chip.
    cycles: u64,
    /// Machine cycles of the longest scan.
    longest_scan_cycles: u64,
    /// Longest execution of each rung, in machine cycles.
    rungs: Vec<Option<u64>>,
}

/// The current run: the seed of its RAM and its stimuli so far.
#[derive(Default)]
struct CurrentRun {
    ram_seed: u64,
    stimuli: Vec<ScanStimulus>,
}

/// Checks `compiled` on a test bench. `map_deviations` are the deviations of the map from the program.
pub(crate) fn run_check<'a, C: CheckedChip, F: Fn(u64) -> C>(
    program: &LadderProgram,
    compiled: &CompiledProgram,
    options: &CheckOptions,
    bench: &TestBench<'a, C, F>,
    map_deviations: Vec<Deviation>,
    progress: &mut dyn FnMut(u64, u64),
) -> CheckReport {
    let mut goals = CoverageGoals::new(program, bench.eval);
    let mut generator = StimulusGenerator::new(options.seed, BoundaryGoals::new(program, bench.eval));
    let mut totals = RunTotals { rungs: vec![None; compiled.map.rungs.len()], ..RunTotals::default() };
    let mut run = CurrentRun::default();
    let mut pair: Option<LockstepPair<'a, C>> = None;
    let mut mismatch = None;
    if !map_deviations.is_empty() {
        // A map that disagrees with the program is a difference before anything runs; it is reported as scan
        // 1.
        (totals.scans, totals.runs) = (1, 1);
        run.stimuli.push(ScanStimulus::default());
        let (wanted, found): (Vec<_>, Vec<_>) = map_deviations.into_iter().map(|d| (d.expected, d.found)).unzip();
        mismatch = Some(Mismatch::of_text(DifferenceKind::Map, 0, wanted.join("; "), found.join("; ")));
    }
    while totals.scans < options.scans && mismatch.is_none() {
        if totals.scans.is_multiple_of(SCANS_PER_PROGRESS) {
            progress(totals.scans, options.scans);
        }
        totals.scans += 1;
        if let Some(ram_seed) = generator.begin_run(bench.stimulus_symbols) {
            run = CurrentRun { ram_seed, stimuli: Vec::new() };
            totals.runs += 1;
            match LockstepPair::start(bench, ram_seed) {
                Ok(new_pair) => pair = Some(new_pair),
                Err(found) => {
                    run.stimuli.push(ScanStimulus::default());
                    mismatch = Some(found);
                    break;
                }
            }
        }
        let Some(pair) = &mut pair else { break };
        let stimulus = generator.next_stimulus(bench.stimulus_symbols, &pair.eval, &goals);
        let scanned = pair.scan(&stimulus);
        run.stimuli.push(stimulus);
        match scanned {
            Ok(matched) => {
                goals.mark_reached(&matched.evaluated);
                totals.compared += matched.compared;
                totals.cycles += matched.cycles;
                totals.longest_scan_cycles = totals.longest_scan_cycles.max(matched.cycles);
                for (rung, cycles) in matched.rungs {
                    if let Some(most) = totals.rungs.get_mut(rung) {
                        *most = (*most).max(Some(cycles));
                    }
                }
            }
            Err(found) => mismatch = Some(found),
        }
    }
    progress(totals.scans, options.scans);
    let coverage = goals.coverage(program);
    let mut notes = compiled.notes.clone();
    if mismatch.is_none() {
        notes.extend(not_covered_note(program, &coverage, totals.scans));
    }
    let map = &compiled.map;
    let rungs = map.rungs.iter().zip(&totals.rungs).map(|(rung, &cycles_max)| RungFigures {
        rung: rung.rung,
        code_bytes: rung.end.saturating_sub(rung.start),
        cycles_bound: rung.worst_cycles,
        cycles_max,
    });
    let rungs = rungs.collect();
    CheckReport {
        schema: SCHEMA,
        program: program.file.clone(),
        mcu: options.mcu.to_ascii_lowercase(),
        seed: options.seed,
        scans: totals.scans,
        runs: totals.runs,
        compared: totals.compared,
        agreed: mismatch.is_none(),
        difference: mismatch.map(|m| describe_difference(program, compiled, options, bench, &totals, run, &m)),
        coverage,
        figures: ProgramFigures {
            code_bytes: map.code_bytes,
            ram_bytes: map.ram_bytes,
            period_cycles: bench.places.pace.period(),
            clocks_per_cycle: bench.places.pace.clocks_per_cycle,
            scan_cycles_max: totals.longest_scan_cycles,
            // Two decimal places are enough.
            scan_cycles_mean: (totals.cycles as f64 / totals.scans.max(1) as f64 * 100.0).round() / 100.0,
            scan_cycles_bound: map.worst_scan_cycles.into(),
            slack_cycles: map.slack_cycles,
            rungs,
        },
        notes,
    }
}

/// The note that some states of the program were not seen in `scans` scans; `None` if coverage is full.
pub(crate) fn not_covered_note(program: &LadderProgram, coverage: &LadderCoverage, scans: u64) -> Option<Diagnostic> {
    let open = coverage.missing.iter().filter(|m| m.impossible.is_none()).count();
    let cause = format!("{open} states of the program were not seen in {scans} scans");
    let hint = "give more --scans or another --seed; the coverage names them";
    let note = || Diagnostic::new(Severity::Note, codes::NOT_COVERED, &program.file, Pos::default(), cause, hint);
    (!coverage.full).then(note)
}

/// Describes a mismatch in the last scan of `run`: the element to blame, the values, and the smallest
/// stimulus that shows it.
fn describe_difference<C: CheckedChip, F: Fn(u64) -> C>(
    program: &LadderProgram,
    compiled: &CompiledProgram,
    options: &CheckOptions,
    bench: &TestBench<'_, C, F>,
    totals: &RunTotals,
    run: CurrentRun,
    mismatch: &Mismatch,
) -> CheckDifference {
    let scan_of_run = run.stimuli.len() as u64;
    let (element, first_differing) = if options.explain {
        find_faulty_element(bench, (program, &compiled.map), (run.ram_seed, &run.stimuli), mismatch)
    } else {
        (None, mismatch.differing.first().copied())
    };
    let name = |symbol: usize| bench.eval.symbols().get(symbol).map_or_else(String::new, |s| s.name.clone());
    let value = |value: i32| match (mismatch.kind, value) {
        (DifferenceKind::Pin, 0) => "low".to_owned(),
        (DifferenceKind::Pin, FLOATING_LEVEL) => "floating".to_owned(),
        (DifferenceKind::Pin, _) => "high".to_owned(),
        _ => value.to_string(),
    };
    let each = mismatch.differing.iter();
    let differing =
        each.map(|d| format!("{}: expected {}, found {}", name(d.symbol), value(d.expected), value(d.found))).collect();
    let element_text = element.and_then(|id| program.find_element(id)).map(|at| ladder::element_text(at.element));
    let smallest = match mismatch.kind {
        DifferenceKind::Map => Vec::new(),
        _ if !options.explain => Vec::new(),
        _ => shrink_stimulus(bench, run.ram_seed, run.stimuli, mismatch),
    };
    CheckDifference {
        code: mismatch.kind.code(),
        scan: totals.scans,
        run: totals.runs,
        scan_of_run,
        cycle: mismatch.cycle,
        what: mismatch.kind,
        symbol: first_differing.map(|d| name(d.symbol)),
        expected: first_differing.map_or_else(|| mismatch.expected.clone(), |d| value(d.expected)),
        found: first_differing.map_or_else(|| mismatch.found.clone(), |d| value(d.found)),
        rung: element.map(|id| id.rung + 1),
        element: element.map(|id| id.index + 1),
        element_text,
        differing,
        replay: replay_command(program, options, totals.scans),
        smallest: smallest.iter().zip(1..).map(|(stimulus, scan)| stimulus_text(bench, stimulus, scan)).collect(),
    }
}

/// The command line that repeats a check up to scan `scans`.
pub(crate) fn replay_command(program: &LadderProgram, options: &CheckOptions, scans: u64) -> String {
    let mut command = format!(
        "emu check {} --mcu {} --seed {} --scans {scans}",
        shell_quote(&program.file),
        options.mcu.to_ascii_lowercase(),
        options.seed
    );
    options.pins.iter().for_each(|PinAssignment { symbol, pin }| {
        command += &format!(" --pin {}", shell_quote(&format!("{symbol}={pin}")))
    });
    match (program.format, program.dialect) {
        (LdFormat::V01, LadderDialect::Ldmicro5) => command += " --dialect ldmicro-5",
        (LdFormat::V02, LadderDialect::Ldmicro23) => command += " --dialect ldmicro-2.3",
        (LdFormat::V01, LadderDialect::Ldmicro23) if program.only_ldmicro5_writes() => {
            command += " --dialect ldmicro-2.3"
        }
        // The dialect that the header of the format implies; no option is needed.
        (LdFormat::V01, LadderDialect::Ldmicro23)
        | (LdFormat::V02, LadderDialect::Ldmicro5)
        | (_, LadderDialect::Iec) => {}
    }
    options.clock_hz.iter().for_each(|hz| command += &format!(" --clock {hz}"));
    command
}

/// Quotes `word` for a POSIX shell if necessary.
pub(crate) fn shell_quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=+:,@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// The stimulus of one scan as text: `scan 3: Xa=1 Xb=0, inverted after latching: Xa; written Tx=49`.
fn stimulus_text<C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'_, C, F>,
    stimulus: &ScanStimulus,
    scan: usize,
) -> String {
    let name = |symbol: &usize| bench.eval.symbols().get(*symbol).map_or("?", |s| s.name.as_str());
    let inputs = bench.stimulus_symbols.inputs.iter().map(name);
    let levels: Vec<String> =
        inputs.clone().zip(&stimulus.inputs).map(|(name, on)| format!("{name}={}", u8::from(*on))).collect();
    let flips: Vec<&str> = inputs.zip(&stimulus.flips).filter(|(_, flip)| **flip).map(|(name, _)| name).collect();
    let writes: Vec<String> =
        stimulus.writes.iter().map(|(symbol, value)| format!("{}={value}", name(symbol))).collect();
    let mut line = format!("scan {scan}:");
    line += &if levels.is_empty() { String::new() } else { format!(" {}", levels.join(" ")) };
    line += &if flips.is_empty() { String::new() } else { format!(", inverted after latching: {}", flips.join(" ")) };
    let high_pins = bench
        .places
        .drivable_pins
        .iter()
        .zip(0..)
        .filter(|(_, n)| stimulus.drivable_levels.checked_shr(*n).unwrap_or(0) & 1 == 1);
    let high_pins: Vec<&str> = high_pins.map(|(&pin, _)| bench.places.pin_name(pin)).collect();
    line += &if high_pins.is_empty() { String::new() } else { format!("; unnamed and high {}", high_pins.join(" ")) };
    line += &if writes.is_empty() { String::new() } else { format!("; written {}", writes.join(" ")) };
    line
}

/// The diagnostic for an element that the evaluator does not support, at the position of the element.
pub(crate) fn unsupported_diagnostic(program: &LadderProgram, refusal: &ladder_eval::UnsupportedElement) -> Diagnostic {
    let pos = program.find_element(refusal.element).map_or(Pos::default(), |at| at.pos);
    let hint = "docs/semantics.md lists the elements that have a meaning";
    Diagnostic::new(Severity::Error, codes::NO_MEANING, &program.file, pos, refusal.to_string(), hint)
}
