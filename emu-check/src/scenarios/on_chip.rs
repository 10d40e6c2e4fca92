//! Plays a scenario on a compiled program: on the evaluator, and on the chip while both are compared scan by
//! scan.

use std::sync::Arc;

use diag::{Diagnostic, Pos, Severity};
use ladder::LadderProgram;
use ladder_compile::CompiledProgram;
use scenario::{BoundScenario, Scenario, ScenarioOutcome, ScenarioPlayer, ScenarioVerdict, bind};
use serde::Serialize;

use crate::chip::families::{CheckedChip, MachineVisitor, visit_machines};
use crate::chip::program_places::ProgramPlaces;
use crate::comparison::lockstep::{LockstepPair, Mismatch, TestBench};
use crate::scenarios::play::{EvaluatorPlay, LadderResolver, ScenarioIo};
use crate::stimulus::stimulus_symbols::StimulusSymbols;
use crate::{CheckOptions, Evaluator, PreparedCheck, prepare_check};

/// The result of a scenario on one machine.
#[derive(Debug, Clone)]
pub struct ScenarioResult {
    /// `evaluator`, or the name of the chip.
    pub machine: String,
    /// The verdict of the scenario; `None` if the chip differed from the evaluator.
    pub verdict: Option<ScenarioVerdict>,
    /// Number of scans run.
    pub scans: u64,
    /// Number of values in which chip and evaluator agreed.
    pub compared: u64,
    /// The difference and its scan, as text.
    pub difference: Option<String>,
    /// Lines that the scenario logged.
    pub log: Vec<String>,
}

/// The results of a scenario on several machines, for JSON.
#[derive(Debug, Clone, Serialize)]
pub struct ScenarioReport {
    /// Version of this JSON document.
    pub schema: u32,
    /// The program's file name.
    pub program: String,
    /// The scenario's file name.
    pub scenario: String,
    /// True if all verdicts are the same.
    pub agreed: bool,
    /// The verdict of the evaluator: `passed`, `failed`, `no result`.
    pub verdict: &'static str,
    /// One row per machine.
    pub on: Vec<ScenarioReportRow>,
}

/// The result of one machine in a [`ScenarioReport`].
#[derive(Debug, Clone, Serialize)]
pub struct ScenarioReportRow {
    /// `evaluator`, or the name of the chip.
    pub on: String,
    /// `passed`, `failed`, `no result`, `differs`, or `refused`.
    pub verdict: &'static str,
    /// Number of the step that decided the verdict, from 1.
    pub step: Option<usize>,
    /// The reason for the verdict.
    pub why: Option<String>,
    /// Number of scans run.
    pub scans: u64,
    /// Number of values in which chip and evaluator agreed.
    pub compared: u64,
}

impl ScenarioResult {
    /// The result as a row of a report.
    #[must_use]
    pub fn to_report_row(&self) -> ScenarioReportRow {
        let verdict = self.verdict.as_ref();
        let why = self.difference.clone().or_else(|| verdict.map(|v| v.why.clone()).filter(|why| !why.is_empty()));
        ScenarioReportRow {
            on: self.machine.clone(),
            verdict: if self.difference.is_some() {
                "differs"
            } else {
                verdict.map_or("differs", |v| outcome_name(v.outcome))
            },
            step: verdict.and_then(|verdict| verdict.step),
            why,
            scans: self.scans,
            compared: self.compared,
        }
    }

    /// Returns true if both verdicts are the same in outcome, step and scan, and no machine differed from the
    /// evaluator.
    #[must_use]
    pub fn has_same_verdict(&self, other: &ScenarioResult) -> bool {
        self.difference.is_none() && other.difference.is_none() && self.verdict == other.verdict
    }
}

/// The name of an outcome for reports.
#[must_use]
pub fn outcome_name(outcome: ScenarioOutcome) -> &'static str {
    match outcome {
        ScenarioOutcome::Passed => "passed",
        ScenarioOutcome::Failed => "failed",
        ScenarioOutcome::NoResult => "no result",
    }
}

/// Plays a scenario on the evaluator.
///
/// # Errors
/// The evaluator refuses the program, or the scenario does not fit it.
pub fn play_on_evaluator(program: &LadderProgram, scenario: &Scenario) -> Result<ScenarioResult, Vec<Diagnostic>> {
    let mut play = EvaluatorPlay::new(program)?;
    let bound = bind(scenario, play.resolver(), Some(&program.file), None)?;
    play.add_scenario(bound);
    while play.scan() {}
    Ok(ScenarioResult {
        machine: "evaluator".to_owned(),
        verdict: Some(play.finish("it was stopped")),
        scans: play.scans(),
        compared: 0,
        difference: None,
        log: play.take_log(),
    })
}

/// Compiles `program` for the chip of `options` and plays a scenario there.
///
/// # Errors
/// The compiler or the evaluator refuses the program, or the scenario does not fit it.
pub fn play_on_chip(
    program: &LadderProgram,
    scenario: &Scenario,
    options: &CheckOptions,
) -> Result<ScenarioResult, Vec<Diagnostic>> {
    let target = ladder_compile::CompileOptions {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let compiled = ladder_compile::compile(program, &target)?;
    let PreparedCheck { chip, image, places, stimulus_symbols, eval } = prepare_check(program, &compiled, options)?;
    let mut resolver = LadderResolver::new(program, &eval);
    let bound = bind(scenario, &mut resolver, Some(&program.file), Some(chip.name))?;
    let hz = places.pace.clock_hz;
    let job = PlayVisitor { compiled: &compiled, seed: options.seed, places, stimulus_symbols, eval, resolver, bound };
    let played = visit_machines(chip, &image, hz, job);
    Ok(ScenarioResult { machine: chip.name.to_owned(), ..played })
}

/// A scenario that is ready to be played on a chip, as a visitor of the machine type.
struct PlayVisitor<'a> {
    compiled: &'a CompiledProgram,
    seed: u64,
    places: ProgramPlaces,
    stimulus_symbols: StimulusSymbols,
    eval: Evaluator,
    resolver: LadderResolver,
    bound: BoundScenario,
}

impl MachineVisitor for PlayVisitor<'_> {
    type Output = ScenarioResult;

    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> ScenarioResult {
        let PlayVisitor { compiled, seed, places, stimulus_symbols, eval, resolver, bound } = self;
        let worst = compiled.map.worst_scan_cycles.into();
        let bench = TestBench {
            power_up,
            places: &places,
            stimulus_symbols: &stimulus_symbols,
            worst_scan_cycles: worst,
            time_rungs: false,
            eval: &eval,
        };
        let mut io = ScenarioIo::new(&resolver, &eval);
        let mut players = [ScenarioPlayer::new(Arc::new(bound))];
        let (mut compared, mut verdict) = (0, None);
        let cells = vec![0xFF; eval.eeprom().len()];
        let differs = start_pair(&bench, &resolver, seed, &cells).and_then(|mut pair| {
            // Number of scans before the last power-up.
            let mut scans_before = 0;
            loop {
                let read = |symbol: usize| places.read_symbol(&pair.runner.cpu, symbol);
                verdict = io.poll_players(&resolver, &mut players, &eval, &read);
                if verdict.is_some() {
                    return Ok(());
                }
                if std::mem::take(&mut io.power_cycle_requested) {
                    let cells = pair.eval.eeprom().to_vec();
                    pair = start_pair(&bench, &resolver, seed.wrapping_add(io.scan), &cells)?;
                    scans_before = io.scan;
                }
                let stimulus = io.next_stimulus(pair.lines.can_begin_byte(&pair.eval));
                compared += pair.scan(&stimulus)?.compared;
                io.end_scan(&resolver, &[]);
                while let Some((scan, byte)) = pair.lines.sent_bytes.pop_front() {
                    io.note_sent_byte(&resolver, scans_before + scan, byte);
                }
            }
        });
        let name = |symbol: usize| eval.symbols().get(symbol).map_or("", |s| s.name.as_str());
        let differs = differs.err().map(|found| mismatch_text(&found, io.scan + 1, &name));
        ScenarioResult { machine: String::new(), verdict, scans: io.scan, compared, difference: differs, log: io.log }
    }
}

/// Starts both sides from power-up, with `cells` in the EEPROM.
fn start_pair<'a, C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'a, C, F>,
    resolver: &LadderResolver,
    seed: u64,
    cells: &[u8],
) -> Result<LockstepPair<'a, C>, Mismatch> {
    let mut pair = LockstepPair::start_with_eeprom(bench, seed, cells.iter().copied())?;
    pair.lines.delay_scans = resolver.arrival_scans();
    Ok(pair)
}

/// A mismatch as one line of text.
fn mismatch_text<'n>(found: &Mismatch, scan: u64, name: &dyn Fn(usize) -> &'n str) -> String {
    let each = found.differing.iter();
    let values: Vec<_> =
        each.map(|d| format!("{}: expected {}, found {}", name(d.symbol), d.expected, d.found)).collect();
    match values.as_slice() {
        [] => format!("scan {scan}: expected {}, found {}", found.expected, found.found),
        values => format!("scan {scan}: {}", values.join("; ")),
    }
}

/// The report of a scenario on the evaluator and on chips.
#[must_use]
pub fn scenario_report(program: &str, scenario: &str, played: &[ScenarioResult]) -> ScenarioReport {
    let agreed = played.windows(2).all(|pair| matches!(pair, [a, b] if a.has_same_verdict(b)));
    let verdict =
        played.first().and_then(|first| first.verdict.as_ref()).map_or("differs", |v| outcome_name(v.outcome));
    let on = played.iter().map(ScenarioResult::to_report_row).collect();
    ScenarioReport { schema: 1, program: program.to_owned(), scenario: scenario.to_owned(), agreed, verdict, on }
}

/// The diagnostic for a chip whose verdict is not that of the evaluator; `None` if the verdicts are the same.
#[must_use]
pub fn verdict_diagnostic(scenario: &str, reference: &ScenarioResult, other: &ScenarioResult) -> Option<Diagnostic> {
    if reference.has_same_verdict(other) {
        return None;
    }
    let says = |played: &ScenarioResult| {
        let row = played.to_report_row();
        let why = row.why.map_or_else(String::new, |why| format!(": {why}"));
        format!("{} {}{why}", row.on, row.verdict)
    };
    let pos = other.verdict.as_ref().map_or(Pos::default(), |verdict| verdict.pos);
    let cause = format!("the verdicts are not the same: {}; {}", says(reference), says(other));
    let hint = "`emu check` without --scenario looks for the smallest such difference";
    Some(Diagnostic::new(Severity::Error, scenario::VERDICTS_DIFFER, scenario, pos, cause, hint))
}
