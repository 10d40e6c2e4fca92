//! A stimulus recorded in advance on the evaluator: what each scan gets, and the state of the evaluator after
//! it.

use emu_core::rng::Rng;
use ladder::LadderProgram;
use ladder_compile::emit::EmittedSource;
use ladder_eval::{BusEvent, Evaluator};

use super::script::{ScanRecord, ServeScript, SlotNumbering};
use crate::LadderCoverage;
use crate::coverage::goals::{CoverageGoals, EvaluatedScan};
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::StimulusGenerator;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// One recorded scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct RecordedScan {
    /// The seed of a run, if a run from power-up begins with this scan.
    pub run_seed: Option<u64>,
    /// Contents of the EEPROM before the first scan of a run; empty in the other scans.
    pub eeprom_before: Vec<u8>,
    /// Level of each input, by name.
    pub inputs: Vec<(String, bool)>,
    /// Conversion result of each analog input, by name.
    pub analog: Vec<(String, u16)>,
    /// A byte that is received before this scan.
    pub byte: Option<u8>,
    /// Values that are written before this scan, by symbol name.
    pub writes: Vec<(String, i32)>,
    /// Value of every symbol after the scan, in the evaluator's order.
    pub values: Vec<i32>,
    /// The bytes sent in this scan.
    pub sent: Vec<u8>,
    /// The transfers on buses as the number that `serve.c` makes of them.
    pub buses: u16,
    /// Duty cycle of the PWM output in percent; of several, the number that `serve.c` makes of them.
    pub duty: Option<u8>,
    /// Contents of the EEPROM after the scan.
    pub eeprom_after: Vec<u8>,
    /// True if no write to the EEPROM is in progress.
    pub eeprom_idle: bool,
}

/// A recorded stimulus of many scans.
pub(super) struct RecordedStimulus {
    /// The scans, in order.
    pub scans: Vec<RecordedScan>,
    /// Coverage of the program by the stimulus.
    pub coverage: LadderCoverage,
    /// Names of the symbols, in the evaluator's order.
    pub names: Vec<String>,
}

/// The number that `serve.c` makes of the duty cycles: that of a single output itself.
fn duty_number(duties: &[Option<u8>]) -> Option<u8> {
    if let [duty] = duties {
        return *duty;
    }
    let given = (0..).zip(duties).filter_map(|(output, duty)| Some((2 * output + 1) * (u32::from((*duty)?) + 1)));
    given.reduce(|sum, part| sum + part).and_then(|sum| u8::try_from(sum % 251).ok())
}

/// Records `scans` scans of a program; without `bytes`, no byte is received.
pub(super) fn record_stimulus(
    program: &LadderProgram,
    power_up: &Evaluator,
    seed: u64,
    scans: u64,
    bytes: bool,
) -> RecordedStimulus {
    let stimulus_symbols = StimulusSymbols::new(program, power_up);
    let mut goals = CoverageGoals::new(program, power_up);
    let mut generator = StimulusGenerator::new(seed, BoundaryGoals::new(program, power_up));
    let mut eval = power_up.clone();
    let names: Vec<String> = power_up.symbols().iter().map(|symbol| symbol.name.clone()).collect();
    let name = |symbol: usize| names.get(symbol).cloned().unwrap_or_default();
    let mut recorded = Vec::new();
    for _ in 0..scans {
        let mut scan = RecordedScan { run_seed: generator.begin_run(&stimulus_symbols), ..RecordedScan::default() };
        if let Some(seed) = scan.run_seed {
            eval = power_up.clone();
            let mut rng = Rng::new(seed);
            scan.eeprom_before =
                eval.eeprom().iter().map(|_| if rng.one_in(2) { 0xFF } else { rng.next_u64() as u8 }).collect();
            scan.eeprom_before.iter().enumerate().for_each(|(addr, byte)| eval.set_eeprom(addr, *byte));
        }
        let stimulus = generator.next_stimulus(&stimulus_symbols, &eval, &goals);
        stimulus.apply(&stimulus_symbols, &mut eval);
        scan.byte = stimulus.byte.filter(|_| bytes && !eval.has_received_byte());
        scan.byte.into_iter().for_each(|byte| _ = eval.receive(byte));
        scan.inputs =
            stimulus_symbols.inputs.iter().zip(&stimulus.inputs).map(|(&symbol, &on)| (name(symbol), on)).collect();
        scan.analog = stimulus_symbols
            .analog
            .iter()
            .zip(&stimulus.analog)
            .map(|(&symbol, &value)| (name(symbol), value))
            .collect();
        scan.writes = stimulus.writes.iter().map(|&(symbol, value)| (name(symbol), value)).collect();
        goals.mark_reached(&EvaluatedScan::run(&mut eval));
        scan.values = (0..names.len()).map(|symbol| eval.get(symbol)).collect();
        scan.sent = eval.sent_bytes().to_vec();
        scan.duty = duty_number(eval.pwm_duties());
        scan.buses = bus_number(eval.bus_events());
        (scan.eeprom_after, scan.eeprom_idle) = (eval.eeprom().to_vec(), eval.eeprom_busy_scans() == 0);
        recorded.push(scan);
    }
    RecordedStimulus { scans: recorded, coverage: goals.coverage(program), names }
}

/// The number that `serve.c` makes of the transfers of a scan.
fn bus_number(events: &[BusEvent]) -> u16 {
    let bytes = events.iter().flat_map(|event| match *event {
        BusEvent::I2cWrite { device, register, byte } => vec![0, device, register, byte],
        BusEvent::I2cRead { device, register } => vec![1, device, register],
        BusEvent::Spi { byte } => vec![2, byte],
    });
    bytes.fold(0, |number: u16, byte| number.wrapping_mul(31).wrapping_add(u16::from(byte) + 1))
}

impl RecordedStimulus {
    /// The stimulus as a script for a served program.
    pub(super) fn to_script(&self, source: &EmittedSource, slots: SlotNumbering) -> ServeScript {
        let shape = slots.record_shape(source);
        let slot = |name: &str| {
            let cell = source.cells.iter().position(|cell| cell.is_symbol && cell.name == name);
            cell.and_then(|cell| shape.cells.get(cell).copied())
        };
        let place = |names: &[String], name: &str| names.iter().position(|other| other == name).map(|n| n as u16);
        let mut script = ServeScript::new();
        for scan in &self.scans {
            if let Some(seed) = scan.run_seed {
                script.reset(seed as u8);
                (0..).zip(&scan.eeprom_before).for_each(|(cell, byte)| script.eeprom_cell(cell, *byte));
            }
            for (name, on) in &scan.inputs {
                place(&source.inputs, name).into_iter().for_each(|input| script.input(input, *on));
            }
            for (name, value) in &scan.analog {
                place(&source.analog, name).into_iter().for_each(|input| script.analog(input, *value));
            }
            scan.byte.into_iter().for_each(|byte| script.receive(byte));
            for (name, value) in &scan.writes {
                slot(name).into_iter().for_each(|slot| script.write(slot, *value));
            }
            script.scan();
        }
        script
    }

    /// Compares `records` with the evaluator. Returns the number of values compared, or the first mismatch.
    /// With `from_board`, the records were read from a running board: sent bytes and buses are not in them, a
    /// duty cycle is compared only where it was measured and counts as 0 if it was never set, and the EEPROM
    /// is compared only while no write is in progress.
    pub(super) fn compare(
        &self,
        source: &EmittedSource,
        records: &[ScanRecord],
        from_board: bool,
    ) -> Result<u64, SourceMismatch> {
        let mut compared = 0;
        for (index, (scan, record)) in self.scans.iter().zip(records).enumerate() {
            let mismatch = |what: &str, expected: String, found: String| {
                Err(SourceMismatch { scan: index, what: what.to_owned(), expected, found })
            };
            for (name, value) in self.names.iter().zip(&scan.values) {
                let cell = source.cells.iter().position(|cell| cell.is_symbol && cell.name == *name);
                let found = cell.and_then(|cell| record.cells.get(cell));
                if found != Some(value) {
                    return mismatch(
                        name,
                        value.to_string(),
                        found.map_or_else(|| "nothing".to_owned(), i32::to_string),
                    );
                }
                if let Some(output) = source.outputs.iter().position(|output| output == name) {
                    let found = record.outputs.get(output).copied();
                    if found != Some(*value != 0) {
                        return mismatch(&format!("output {name}"), value.to_string(), format!("{found:?}"));
                    }
                    compared += 1;
                }
                compared += 1;
            }
            let sent = (scan.sent.len() as u8, scan.sent.last().copied().unwrap_or(0));
            if !from_board && record.sent != sent {
                return mismatch("sent bytes and the last one", format!("{sent:?}"), format!("{:?}", record.sent));
            }
            if !from_board && record.buses != scan.buses {
                return mismatch("transfers on buses", format!("{:04X}", scan.buses), format!("{:04X}", record.buses));
            }
            let duty = if from_board { record.duty.map(|_| scan.duty.unwrap_or(0)) } else { scan.duty };
            if record.duty != duty {
                return mismatch("PWM duty", format!("{:?}", scan.duty), format!("{:?}", record.duty));
            }
            if (scan.eeprom_idle || !from_board) && record.eeprom != scan.eeprom_after {
                return mismatch("EEPROM", format!("{:?}", scan.eeprom_after), format!("{:?}", record.eeprom));
            }
            compared += 3;
        }
        Ok(compared)
    }
}

/// The first difference between a record and the evaluator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SourceMismatch {
    /// Number of the scan, from 0.
    pub scan: usize,
    /// What differs: a symbol, an output, sent bytes, the duty cycle, or the EEPROM.
    pub what: String,
    pub expected: String,
    pub found: String,
}
