//! A scenario played on a compiled program: on the evaluator, and on the chip with both compared scan by scan as ever.

use std::sync::Arc;

use diag::{Diagnostic, Pos, Severity};
use ladder::Program;
use ladder_compile::Compiled;
use scenario::{Bound, Outcome, Player, Scenario, Verdict, bind};
use serde::Serialize;

use crate::family::{Job, Target, on_machines};
use crate::hints::Hints;
use crate::lockstep::{Bench, Mismatch, Pair};
use crate::places::Places;
use crate::play::{Hand, LadderSite, Rehearsal};
use crate::{Evaluator, Options, Prepared, prepared};

/// A scenario on one machine.
#[derive(Debug, Clone)]
pub struct Performance {
    /// `evaluator`, or the chip.
    pub on: String,
    /// How it ended; nothing where the chip did something else than the evaluator.
    pub verdict: Option<Verdict>,
    /// Scans run.
    pub scans: u64,
    /// Values in which chip and evaluator agreed.
    pub compared: u64,
    /// What differed, and in which scan.
    pub differs: Option<String>,
    /// Lines that the scenario told.
    pub log: Vec<String>,
}

/// The document of several.
#[derive(Debug, Clone, Serialize)]
pub struct Performances {
    /// Version of this document.
    pub schema: u32,
    /// The program.
    pub program: String,
    /// The scenario.
    pub scenario: String,
    /// All verdicts are the same.
    pub agreed: bool,
    /// `passed`, `failed`, `no result`; of the evaluator.
    pub verdict: &'static str,
    /// A row for each machine.
    pub on: Vec<Row>,
}

/// A machine in a document.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// `evaluator`, or the chip.
    pub on: String,
    /// `passed`, `failed`, `no result`, `differs`, or `refused`.
    pub verdict: &'static str,
    /// The step that decided, from 1.
    pub step: Option<usize>,
    /// What was found.
    pub why: Option<String>,
    /// Scans run.
    pub scans: u64,
    /// Values in which chip and evaluator agreed.
    pub compared: u64,
}

impl Performance {
    /// Its row.
    #[must_use]
    pub fn row(&self) -> Row {
        let verdict = self.verdict.as_ref();
        let why = self.differs.clone().or_else(|| verdict.map(|v| v.why.clone()).filter(|why| !why.is_empty()));
        Row {
            on: self.on.clone(),
            verdict: if self.differs.is_some() { "differs" } else { verdict.map_or("differs", |v| word(v.outcome)) },
            step: verdict.and_then(|verdict| verdict.step),
            why,
            scans: self.scans,
            compared: self.compared,
        }
    }

    /// The verdicts are the same: outcome, step and scan.
    #[must_use]
    pub fn same(&self, other: &Performance) -> bool {
        self.differs.is_none() && other.differs.is_none() && self.verdict == other.verdict
    }
}

/// An outcome in a word or two.
#[must_use]
pub fn word(outcome: Outcome) -> &'static str {
    match outcome {
        Outcome::Passed => "passed",
        Outcome::Failed => "failed",
        Outcome::NoResult => "no result",
    }
}

/// Plays a scenario on the evaluator.
///
/// # Errors
/// The evaluator refuses the program, or the scenario does not fit it.
pub fn rehearse(program: &Program, scenario: &Scenario) -> Result<Performance, Vec<Diagnostic>> {
    let mut play = Rehearsal::new(program)?;
    let bound = bind(scenario, play.site(), Some(&program.file), None)?;
    play.play(bound);
    while play.scan() {}
    Ok(Performance {
        on: "evaluator".to_owned(),
        verdict: Some(play.end("it was stopped")),
        scans: play.scans(),
        compared: 0,
        differs: None,
        log: play.told(),
    })
}

/// Compiles `program` for the chip of `options` and plays a scenario there.
///
/// # Errors
/// Why it cannot be played: compiler or evaluator refuse the program, or the scenario does not fit it.
pub fn perform(program: &Program, scenario: &Scenario, options: &Options) -> Result<Performance, Vec<Diagnostic>> {
    let target = ladder_compile::Options {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let compiled = ladder_compile::compile(program, &target)?;
    let Prepared { chip, image, places, hints, eval } = prepared(program, &compiled, options)?;
    let mut site = LadderSite::new(program, &eval);
    let bound = bind(scenario, &mut site, Some(&program.file), Some(chip.name))?;
    let hz = places.pace.clock_hz;
    let job = Play { compiled: &compiled, seed: options.seed, places, hints, eval, site, bound };
    let played = on_machines(chip, &image, hz, job);
    Ok(Performance { on: chip.name.to_owned(), ..played })
}

/// A scenario that is ready to be played on a chip.
struct Play<'a> {
    compiled: &'a Compiled,
    seed: u64,
    places: Places,
    hints: Hints,
    eval: Evaluator,
    site: LadderSite,
    bound: Bound,
}

impl Job for Play<'_> {
    type Out = Performance;

    fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) -> Performance {
        let Play { compiled, seed, places, hints, eval, site, bound } = self;
        let worst = compiled.map.worst_scan_cycles.into();
        let bench = Bench { power_up, places: &places, hints: &hints, worst, rungs: false, eval: &eval };
        let mut hand = Hand::new(&site);
        let mut players = [Player::new(Arc::new(bound))];
        let (mut compared, mut verdict) = (0, None);
        let cells = vec![0xFF; eval.eeprom().len()];
        let differs = begin(&bench, &site, seed, &cells).and_then(|mut pair| {
            // Scans before the last power-up.
            let mut before = 0;
            loop {
                let read = |symbol: usize| places.read(&pair.rig.cpu, symbol);
                verdict = hand.look(&site, &mut players, &eval, &read);
                if verdict.is_some() {
                    return Ok(());
                }
                if std::mem::take(&mut hand.power) {
                    let cells = pair.eval.eeprom().to_vec();
                    pair = begin(&bench, &site, seed.wrapping_add(hand.moment), &cells)?;
                    before = hand.moment;
                }
                let step = hand.step(pair.lines.free(&pair.eval));
                compared += pair.scan(&step)?.compared;
                hand.scanned(&site, None);
                while let Some((scan, byte)) = pair.lines.heard.pop_front() {
                    hand.heard(&site, before + scan, byte);
                }
            }
        });
        let name = |symbol: usize| eval.symbols().get(symbol).map_or("", |s| s.name.as_str());
        let differs = differs.err().map(|found| told(&found, hand.moment + 1, &name));
        Performance { on: String::new(), verdict, scans: hand.moment, compared, differs, log: hand.log }
    }
}

/// Both sides from power-up, with these cells of the EEPROM.
fn begin<'a, C: Target, F: Fn(u64) -> C>(
    bench: &Bench<'a, C, F>,
    site: &LadderSite,
    seed: u64,
    cells: &[u8],
) -> Result<Pair<'a, C>, Mismatch> {
    let mut pair = Pair::with_cells(bench, seed, cells.iter().copied())?;
    pair.lines.delay = site.arrives();
    Ok(pair)
}

/// A mismatch in a line.
fn told<'n>(found: &Mismatch, scan: u64, name: &dyn Fn(usize) -> &'n str) -> String {
    let each = found.differing.iter();
    let values: Vec<_> =
        each.map(|d| format!("{}: expected {}, found {}", name(d.symbol), d.expected, d.found)).collect();
    match values.as_slice() {
        [] => format!("scan {scan}: expected {}, found {}", found.expected, found.found),
        values => format!("scan {scan}: {}", values.join("; ")),
    }
}

/// The document of a scenario on the evaluator and on chips.
#[must_use]
pub fn document(program: &str, scenario: &str, played: &[Performance]) -> Performances {
    let agreed = played.windows(2).all(|pair| matches!(pair, [a, b] if a.same(b)));
    let verdict = played.first().and_then(|first| first.verdict.as_ref()).map_or("differs", |v| word(v.outcome));
    let on = played.iter().map(Performance::row).collect();
    Performances { schema: 1, program: program.to_owned(), scenario: scenario.to_owned(), agreed, verdict, on }
}

/// The complaint about a chip whose verdict is another one than the evaluator's.
#[must_use]
pub fn differing(scenario: &str, reference: &Performance, other: &Performance) -> Option<Diagnostic> {
    if reference.same(other) {
        return None;
    }
    let says = |played: &Performance| {
        let row = played.row();
        let why = row.why.map_or_else(String::new, |why| format!(": {why}"));
        format!("{} {}{why}", row.on, row.verdict)
    };
    let pos = other.verdict.as_ref().map_or(Pos::default(), |verdict| verdict.pos);
    let cause = format!("the verdicts are not the same: {}; {}", says(reference), says(other));
    let hint = "`emu check` without --scenario looks for the smallest such difference";
    Some(Diagnostic::new(Severity::Error, scenario::DIFFER, scenario, pos, cause, hint))
}
