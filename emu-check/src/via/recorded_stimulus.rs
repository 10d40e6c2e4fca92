//! What is done to a program scan by scan, and what the evaluator then has: the stimulus of any check, worked out in advance.

use emu_core::rng::Rng;
use ladder::LadderProgram;
use ladder_compile::emit::EmittedSource;
use ladder_eval::Evaluator;

use super::script::{ScanRecord, ServeScript, SlotNumbering};
use crate::LadderCoverage;
use crate::boundary_goals::BoundaryGoals;
use crate::coverage_goals::{CoverageGoals, EvaluatedScan};
use crate::stimulus::StimulusGenerator;
use crate::value_hints::ValueHints;

/// One scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct RecordedScan {
    /// A run from power-up begins here; the seed of what is random in it.
    pub run_seed: Option<u64>,
    /// Cells of EEPROM that a run begins with.
    pub eeprom: Vec<u8>,
    /// Inputs by name and level.
    pub inputs: Vec<(String, bool)>,
    /// Analog inputs by name and conversion.
    pub analog: Vec<(String, u16)>,
    /// A byte that has been received before this scan.
    pub byte: Option<u8>,
    /// Symbols by name, and the values written to them.
    pub writes: Vec<(String, i32)>,
    /// Every symbol after the scan, in the order of the evaluator.
    pub values: Vec<i32>,
    /// The byte sent, the duty, the cells of EEPROM, and whether no write is under way.
    pub sent: Option<u8>,
    pub duty: Option<u8>,
    pub cells: Vec<u8>,
    pub eeprom_idle: bool,
}

/// A whole stimulus.
pub(super) struct RecordedStimulus {
    pub scans: Vec<RecordedScan>,
    pub coverage: LadderCoverage,
    /// Names of the symbols, in the order of the evaluator.
    pub names: Vec<String>,
}

/// `scans` turns of a program; without `bytes` nothing is received.
pub(super) fn record_stimulus(
    program: &LadderProgram,
    fresh: &Evaluator,
    seed: u64,
    scans: u64,
    bytes: bool,
) -> RecordedStimulus {
    let hints = ValueHints::new(program, fresh);
    let mut goals = CoverageGoals::new(program, fresh);
    let mut stimulus = StimulusGenerator::new(seed, BoundaryGoals::new(program, fresh));
    let mut eval = fresh.clone();
    let names: Vec<String> = fresh.symbols().iter().map(|symbol| symbol.name.clone()).collect();
    let name = |symbol: usize| names.get(symbol).cloned().unwrap_or_default();
    let mut turns = Vec::new();
    for _ in 0..scans {
        let mut turn = RecordedScan { run_seed: stimulus.begin_run(&hints), ..RecordedScan::default() };
        if let Some(seed) = turn.run_seed {
            eval = fresh.clone();
            let mut rng = Rng::new(seed);
            turn.eeprom =
                eval.eeprom().iter().map(|_| if rng.one_in(2) { 0xFF } else { rng.next_u64() as u8 }).collect();
            turn.eeprom.iter().enumerate().for_each(|(addr, byte)| eval.set_eeprom(addr, *byte));
        }
        let step = stimulus.next_stimulus(&hints, &eval, &goals);
        step.apply(&hints, &mut eval);
        turn.byte = step.byte.filter(|_| bytes && !eval.has_received_byte());
        turn.byte.into_iter().for_each(|byte| _ = eval.receive(byte));
        turn.inputs = hints.inputs.iter().zip(&step.inputs).map(|(&symbol, &on)| (name(symbol), on)).collect();
        turn.analog = hints.analog.iter().zip(&step.analog).map(|(&symbol, &value)| (name(symbol), value)).collect();
        turn.writes = step.writes.iter().map(|&(symbol, value)| (name(symbol), value)).collect();
        goals.mark_reached(&EvaluatedScan::run(&mut eval));
        turn.values = (0..names.len()).map(|symbol| eval.get(symbol)).collect();
        (turn.sent, turn.duty) = (eval.sent(), eval.pwm_percent());
        (turn.cells, turn.eeprom_idle) = (eval.eeprom().to_vec(), eval.eeprom_busy_scans() == 0);
        turns.push(turn);
    }
    RecordedStimulus { scans: turns, coverage: goals.coverage(program), names }
}

impl RecordedStimulus {
    /// The course as a script for a served program.
    pub(super) fn to_script(&self, source: &EmittedSource, slots: SlotNumbering) -> ServeScript {
        let shape = slots.record_shape(source);
        let slot = |name: &str| {
            let cell = source.cells.iter().position(|cell| cell.is_symbol && cell.name == name);
            cell.and_then(|cell| shape.cells.get(cell).copied())
        };
        let place = |names: &[String], name: &str| names.iter().position(|other| other == name).map(|n| n as u16);
        let mut script = ServeScript::new();
        for turn in &self.scans {
            if let Some(seed) = turn.run_seed {
                script.reset(seed as u8);
                (0..).zip(&turn.eeprom).for_each(|(cell, byte)| script.cell(cell, *byte));
            }
            for (name, on) in &turn.inputs {
                place(&source.inputs, name).into_iter().for_each(|input| script.input(input, *on));
            }
            for (name, value) in &turn.analog {
                place(&source.analog, name).into_iter().for_each(|input| script.analog(input, *value));
            }
            turn.byte.into_iter().for_each(|byte| script.receive(byte));
            for (name, value) in &turn.writes {
                slot(name).into_iter().for_each(|slot| script.write(slot, *value));
            }
            script.scan();
        }
        script
    }

    /// The first thing in which `records` are not as they should be: scan from 0, what, expected, found. Gives the number of
    /// values compared besides. `lines`: what is sent is compared elsewhere, a duty is compared where it was measured, and one that was never set counts as 0.
    pub(super) fn compare(
        &self,
        source: &EmittedSource,
        records: &[ScanRecord],
        lines: bool,
    ) -> Result<u64, SourceMismatch> {
        let mut compared = 0;
        for (scan, (turn, record)) in self.scans.iter().zip(records).enumerate() {
            let wrong = |what: &str, expected: String, found: String| {
                Err(SourceMismatch { scan, what: what.to_owned(), expected, found })
            };
            for (name, value) in self.names.iter().zip(&turn.values) {
                let cell = source.cells.iter().position(|cell| cell.is_symbol && cell.name == *name);
                let found = cell.and_then(|cell| record.cells.get(cell));
                if found != Some(value) {
                    return wrong(name, value.to_string(), found.map_or_else(|| "nothing".to_owned(), i32::to_string));
                }
                if let Some(output) = source.outputs.iter().position(|output| output == name) {
                    let found = record.outputs.get(output).copied();
                    if found != Some(*value != 0) {
                        return wrong(&format!("output {name}"), value.to_string(), format!("{found:?}"));
                    }
                    compared += 1;
                }
                compared += 1;
            }
            let sent = (turn.sent.map_or(0, |_| 1), turn.sent.unwrap_or(0));
            if !lines && record.sent != sent {
                return wrong("sent bytes and the last one", format!("{sent:?}"), format!("{:?}", record.sent));
            }
            let duty = if lines { record.duty.map(|_| turn.duty.unwrap_or(0)) } else { turn.duty };
            if record.duty != duty {
                return wrong("PWM duty", format!("{:?}", turn.duty), format!("{:?}", record.duty));
            }
            if (turn.eeprom_idle || !lines) && record.eeprom != turn.cells {
                return wrong("EEPROM", format!("{:?}", turn.cells), format!("{:?}", record.eeprom));
            }
            compared += 3;
        }
        Ok(compared)
    }
}

/// What is not as it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SourceMismatch {
    /// Scan, from 0.
    pub scan: usize,
    pub what: String,
    pub expected: String,
    pub found: String,
}
