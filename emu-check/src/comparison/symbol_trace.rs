//! Repeats a check and records every symbol of both sides, for the waveforms of the HTML report.

use std::collections::VecDeque;

use emu_core::image;
use ladder::LadderProgram;
use ladder_eval::Evaluator;

use crate::CheckOptions;
use crate::chip::families::{CheckedChip, MachineVisitor, visit_machines};
use crate::chip::map_contract::ScanPace;
use crate::chip::program_places::ProgramPlaces;
use crate::comparison::lockstep::{LockstepPair, TestBench};
use crate::coverage::goals::CoverageGoals;
use crate::report::html_page::ReportEntry;
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::StimulusGenerator;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// Maximum number of scans kept; these are the last ones.
const MAX_TRACE_SCANS: usize = 2_000;

/// The symbols at the end of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TraceRow {
    /// Number of the scan in the check, from 1.
    pub scan: u64,
    /// True if a run begins with this scan.
    pub reset: bool,
    /// The evaluator's values, by symbol index.
    pub expected: Vec<i32>,
    /// The chip's values, by symbol index.
    pub found: Vec<i32>,
}

/// The values of all symbols over the scans.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct SymbolTrace {
    /// Name of each symbol, and whether it is a bit.
    pub symbols: Vec<(String, bool)>,
    pub rows: VecDeque<TraceRow>,
    /// True if the last row is a difference.
    pub differs: bool,
}

/// Records the first `scans` scans of a check; `None` if the check is refused.
pub(crate) fn symbol_trace(entry: &ReportEntry<'_>, scans: u64) -> Option<SymbolTrace> {
    let &ReportEntry { program, options, compiled, .. } = entry;
    let target = ladder_compile::CompileOptions {
        mcu: options.mcu.clone(),
        pins: options.pins.clone(),
        clock_hz: options.clock_hz,
        ..Default::default()
    };
    let compiled_here;
    let compiled = match compiled {
        Some(compiled) => compiled,
        None => {
            compiled_here = ladder_compile::compile(program, &target).ok()?;
            &compiled_here
        }
    };
    let eval = Evaluator::new(program).ok()?;
    let chip = ladder_compile::find_chip(&options.mcu)?;
    let pace = ScanPace::new(program, options, chip)?;
    let loaded = image::load_hex(&program.file, compiled.hex.as_bytes(), chip.hex_spaces).ok()?;
    let places = ProgramPlaces::new(program, &compiled.map, chip, &eval, pace).ok()?;
    let stimulus_symbols = StimulusSymbols::new(program, &eval);
    let worst_scan_cycles = compiled.map.worst_scan_cycles.into();
    let job = TraceVisitor { program, options, scans, places, stimulus_symbols, eval, worst_scan_cycles };
    Some(visit_machines(chip, &loaded.image, pace.clock_hz, job))
}

struct TraceVisitor<'a> {
    program: &'a LadderProgram,
    options: &'a CheckOptions,
    scans: u64,
    places: ProgramPlaces,
    stimulus_symbols: StimulusSymbols,
    eval: Evaluator,
    worst_scan_cycles: u64,
}

impl MachineVisitor for TraceVisitor<'_> {
    type Output = SymbolTrace;

    fn visit<C: CheckedChip, F: Fn(u64) -> C>(self, power_up: F) -> SymbolTrace {
        let TraceVisitor { program, options, scans, places, stimulus_symbols, eval, worst_scan_cycles } = self;
        let bench = TestBench {
            power_up,
            places: &places,
            stimulus_symbols: &stimulus_symbols,
            worst_scan_cycles,
            time_rungs: false,
            eval: &eval,
        };
        let mut goals = CoverageGoals::new(program, &eval);
        let mut generator = StimulusGenerator::new(options.seed, BoundaryGoals::new(program, &eval));
        let symbols = eval.symbols().iter().map(|symbol| (symbol.name.clone(), symbol.kind.is_bit())).collect();
        let mut trace = SymbolTrace { symbols, rows: VecDeque::new(), differs: false };
        let mut pair: Option<LockstepPair<'_, C>> = None;
        for scan in 1..=scans {
            let run_seed = generator.begin_run(&stimulus_symbols);
            if let Some(seed) = run_seed {
                match LockstepPair::start(&bench, seed) {
                    Ok(fresh) => pair = Some(fresh),
                    Err(_) => break,
                }
            }
            let Some(pair) = &mut pair else { break };
            let stimulus = generator.next_stimulus(&stimulus_symbols, &pair.eval, &goals);
            let scanned = pair.scan(&stimulus);
            let all = 0..trace.symbols.len();
            let expected = all.clone().map(|symbol| pair.eval.get(symbol)).collect();
            let found = all.map(|symbol| places.read_symbol(&pair.runner.cpu, symbol)).collect();
            trace.rows.push_back(TraceRow { scan, reset: run_seed.is_some(), expected, found });
            if trace.rows.len() > MAX_TRACE_SCANS {
                trace.rows.pop_front();
            }
            match scanned {
                Ok(agreed) => goals.mark_reached(&agreed.evaluated),
                Err(_) => break,
            }
        }
        trace
    }
}
