//! A check once more, with every symbol of both sides written down, for drawing.

use std::collections::VecDeque;

use emu_core::image;
use ladder::Program;
use ladder_eval::Evaluator;

use crate::Options;
use crate::contract::Pace;
use crate::family::{Job, Target, on_machines};
use crate::goals::Goals;
use crate::hints::Hints;
use crate::html::Entry;
use crate::lockstep::{Bench, Pair};
use crate::places::Places;
use crate::stimulus::Stimulus;
use crate::wishes::Wishes;

/// Scans that are kept at most: the last ones.
const MOST: usize = 2_000;

/// The symbols at the end of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Row {
    pub scan: u64,
    /// A run begins here.
    pub reset: bool,
    pub expected: Vec<i32>,
    pub found: Vec<i32>,
}

/// Symbols over scans.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Trace {
    /// Name, and whether it is a bit.
    pub symbols: Vec<(String, bool)>,
    pub rows: VecDeque<Row>,
    /// The last row is that of a difference.
    pub differs: bool,
}

/// The first `scans` scans of a check; nothing where it was refused.
pub(crate) fn trace(entry: &Entry<'_>, scans: u64) -> Option<Trace> {
    let &Entry { program, options, compiled, .. } = entry;
    let target = ladder_compile::Options {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let own;
    let compiled = match compiled {
        Some(compiled) => compiled,
        None => {
            own = ladder_compile::compile(program, &target).ok()?;
            &own
        }
    };
    let eval = Evaluator::new(program).ok()?;
    let chip = ladder_compile::chip(&options.mcu)?;
    let pace = Pace::new(program, options, chip)?;
    let loaded = image::load_hex(&program.file, compiled.hex.as_bytes(), chip.hex).ok()?;
    let places = Places::new(program, &compiled.map, chip, &eval, pace).ok()?;
    let hints = Hints::new(program, &eval);
    let worst = compiled.map.worst_scan_cycles.into();
    let job = Recording { program, options, scans, places, hints, eval, worst };
    Some(on_machines(chip, &loaded.image, pace.clock_hz, job))
}

struct Recording<'a> {
    program: &'a Program,
    options: &'a Options,
    scans: u64,
    places: Places,
    hints: Hints,
    eval: Evaluator,
    worst: u64,
}

impl Job for Recording<'_> {
    type Out = Trace;

    fn on<C: Target, F: Fn(u64) -> C>(self, power_up: F) -> Trace {
        let Recording { program, options, scans, places, hints, eval, worst } = self;
        let bench = Bench { power_up, places: &places, hints: &hints, worst, rungs: false, eval: &eval };
        let mut goals = Goals::new(program, &eval);
        let mut stimulus = Stimulus::new(options.seed, Wishes::new(program, &eval));
        let symbols = eval.symbols().iter().map(|symbol| (symbol.name.clone(), symbol.kind.is_bit())).collect();
        let mut trace = Trace { symbols, rows: VecDeque::new(), differs: false };
        let mut pair: Option<Pair<'_, C>> = None;
        for scan in 1..=scans {
            let begun = stimulus.begin(&hints);
            if let Some(seed) = begun {
                match Pair::start(&bench, seed) {
                    Ok(fresh) => pair = Some(fresh),
                    Err(_) => break,
                }
            }
            let Some(pair) = &mut pair else { break };
            let step = stimulus.step(&hints, &pair.eval, &goals);
            let scanned = pair.scan(&step);
            let all = 0..trace.symbols.len();
            let expected = all.clone().map(|symbol| pair.eval.get(symbol)).collect();
            let found = all.map(|symbol| places.read(&pair.rig.cpu, symbol)).collect();
            trace.rows.push_back(Row { scan, reset: begun.is_some(), expected, found });
            if trace.rows.len() > MOST {
                trace.rows.pop_front();
            }
            match scanned {
                Ok(agreed) => goals.mark(&agreed.seen),
                Err(_) => break,
            }
        }
        trace
    }
}
