//! Checks an emitted source (C, byte code or a sketch): an external compiler compiles it, it runs on this
//! computer or on an emulated chip, and each scan is compared with the evaluator.

mod arduino_board;
mod c_unit;
mod codes;
mod external_tools;
mod recorded_stimulus;
pub mod script;
pub mod serve;

use diag::{Diagnostic, Pos, Severity};
use ladder::LadderProgram;
use ladder_compile::emit::{arduino, bytecode, c};
use ladder_eval::Evaluator;
use serde::Serialize;

use arduino_board::ArduinoBoard;
use recorded_stimulus::{RecordedScan, RecordedStimulus, SourceMismatch, record_stimulus};
use script::SlotNumbering;
use serve::ServedForm;

use crate::{CheckOptions, LadderCoverage};

pub use codes::CODES;

/// The kind of an emitted source, and where it runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SourceRoute {
    /// C, compiled by gcc, runs on this computer.
    Native,
    /// C, compiled by avr-gcc or SDCC, runs on the emulated chip.
    C,
    /// A sketch, compiled with the Arduino core, runs on the emulated ATmega328P.
    Arduino,
    /// Byte code with its interpreter in C, compiled by avr-gcc, runs on the emulated chip.
    Bytecode,
}

/// The result of a check of an emitted source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceCheckReport {
    /// Version of this JSON document: 1.
    pub schema: u32,
    /// Name of the program's file.
    pub program: String,
    /// The kind of source.
    pub via: SourceRoute,
    /// The name of the chip; `native` for this computer.
    pub mcu: String,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of scans compared.
    pub scans: u64,
    /// Number of runs from power-up.
    pub runs: u64,
    /// Number of values compared.
    pub compared: u64,
    /// True if nothing differed.
    pub agreed: bool,
    /// The first difference.
    pub difference: Option<SourceDifference>,
    /// Coverage of the program by the stimulus.
    pub coverage: LadderCoverage,
}

/// The first difference of a check of an emitted source.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SourceDifference {
    /// Number of the scan in the check, from 1.
    pub scan: u64,
    /// Number of the run, from 1.
    pub run: u64,
    /// Number of the scan in the run, from 1.
    pub scan_of_run: u64,
    /// What differs: a symbol, an output, sent bytes, the duty cycle, the EEPROM, or the start of a scan.
    pub what: String,
    /// The evaluator's value.
    pub expected: String,
    /// The value of the program made from the source.
    pub found: String,
    /// The stimulus of the scan, as text.
    #[serde(rename = "step")]
    pub stimulus: String,
}

impl SourceCheckReport {
    /// The report as text.
    #[must_use]
    pub fn text(&self) -> String {
        let route = format!("{:?}", self.via).to_lowercase();
        match &self.difference {
            None => format!(
                "{} by way of {route} on {}: agreed in {} scans, {} runs, {} values (seed {})\n",
                self.program, self.mcu, self.scans, self.runs, self.compared, self.seed
            ),
            Some(d) => format!(
                "{} by way of {route} on {} DIFFERS in scan {} (seed {})\n  what      {}\n  expected  {}\n  found     {}\n  \
                 when      scan {} of run {}: {}\n",
                self.program,
                self.mcu,
                d.scan,
                self.seed,
                d.what,
                d.expected,
                d.found,
                d.scan_of_run,
                d.run,
                d.stimulus
            ),
        }
    }
}

/// Checks the emitted source of `program`. The source is compiled and run; after every scan all symbols,
/// outputs, sent bytes, the duty cycle and the EEPROM are compared with the evaluator. For a sketch, the
/// start time of each scan is checked too. Of `options`, the chip, the seed, the number of scans and the pins
/// apply.
///
/// # Errors
/// The program is refused, `options.scans` is 0, a compiler is missing or refuses the source, the chip is not
/// supported in this way, or the compiled program ended early.
pub fn check(
    program: &LadderProgram,
    via: SourceRoute,
    options: &CheckOptions,
) -> Result<SourceCheckReport, Vec<Diagnostic>> {
    // Names the program in a diagnostic of a tool.
    let for_program = |mut diagnostic: Diagnostic| {
        diagnostic.file.clone_from(&program.file);
        vec![diagnostic]
    };
    if options.scans == 0 {
        let cause = "0 scans were asked for, which compares nothing";
        let at = Pos::default();
        let hint = "give --scans 1 or more";
        return Err(for_program(Diagnostic::new(Severity::Error, crate::codes::NOTHING, "", at, cause, hint)));
    }
    let eval = Evaluator::new(program)
        .map_err(|refusal| vec![crate::comparison::check_run::unsupported_diagnostic(program, &refusal)])?;
    let bytes = via != SourceRoute::Arduino || arduino_board::receives_between_scans(program);
    let stimulus = record_stimulus(program, &eval, options.seed, options.scans, bytes);
    let compared = match via {
        SourceRoute::Native => {
            let source = c::emit(program)?;
            let script = stimulus.to_script(&source, SlotNumbering::InOrder);
            let records = serve::run_native(&[(source.clone(), script)], false).map_err(for_program)?;
            stimulus.compare(&source, records.first().map_or(&[], Vec::as_slice), false)
        }
        SourceRoute::C => {
            let source = c::emit(program)?;
            let script = stimulus.to_script(&source, SlotNumbering::InOrder);
            stimulus.compare(
                &source,
                &serve::run_on_chip(&source, &script, ServedForm::C, &options.mcu).map_err(for_program)?,
                false,
            )
        }
        SourceRoute::Bytecode => {
            let source = bytecode::emit(program)?;
            let script = stimulus.to_script(&source, SlotNumbering::Interpreter);
            stimulus.compare(
                &source,
                &serve::run_on_chip(&source, &script, ServedForm::Bytecode, &options.mcu).map_err(for_program)?,
                false,
            )
        }
        SourceRoute::Arduino => {
            if !options.mcu.eq_ignore_ascii_case("atmega328p") {
                let cause = format!("a sketch runs on the atmega328p of a board, not on `{}`", options.mcu);
                return Err(for_program(external_tools::tool_error(codes::NO_WAY, cause, "name --mcu atmega328p")));
            }
            let sketch =
                arduino::emit(program, &arduino::SketchOptions { pins: options.pins.clone(), debounce_ms: 0 })?;
            let image = ArduinoBoard::new().and_then(|board| board.build(&sketch.source)).map_err(for_program)?;
            arduino_board::run_sketch(
                program,
                &sketch,
                &image,
                &stimulus,
                eval.pwm_outputs().first().map(|output| output.hertz),
            )
            .map_err(for_program)?
        }
    };
    Ok(make_report(program, via, options, &stimulus, compared))
}

/// Checks many programs on this computer in one executable, as C or as byte code. Of `options`, the seed and
/// the number of scans apply. The entry of a refused program holds its diagnostics.
///
/// # Errors
/// A compiler is missing or refuses a source, or a compiled program ended early.
pub fn check_many(
    programs: &[LadderProgram],
    form: ServedForm,
    options: &CheckOptions,
) -> Result<Vec<Result<SourceCheckReport, Vec<Diagnostic>>>, Diagnostic> {
    let slots = if form == ServedForm::C { SlotNumbering::InOrder } else { SlotNumbering::Interpreter };
    let prepare = |program: &LadderProgram| {
        let eval = Evaluator::new(program)
            .map_err(|refusal| vec![crate::comparison::check_run::unsupported_diagnostic(program, &refusal)])?;
        let source = if form == ServedForm::C { c::emit(program)? } else { bytecode::emit(program)? };
        let stimulus = record_stimulus(program, &eval, options.seed, options.scans, true);
        let script = stimulus.to_script(&source, slots);
        Ok((stimulus, (source, script)))
    };
    let mut stimuli = Vec::new();
    let mut served = Vec::new();
    for program in programs {
        stimuli.push(prepare(program).map(|(stimulus, pair)| {
            served.push(pair);
            stimulus
        }));
    }
    let records =
        if form == ServedForm::C { serve::run_native(&served, false)? } else { serve::run_interpreted(&served)? };
    let mut served_records = served.iter().zip(&records);
    let reports = stimuli.into_iter().zip(programs).map(|(stimulus, program)| {
        stimulus.map(|stimulus| {
            let compared =
                served_records.next().map_or(Ok(0), |((source, _), records)| stimulus.compare(source, records, false));
            make_report(program, SourceRoute::Native, options, &stimulus, compared)
        })
    });
    Ok(reports.collect())
}

fn make_report(
    program: &LadderProgram,
    via: SourceRoute,
    options: &CheckOptions,
    stimulus: &RecordedStimulus,
    compared: Result<u64, SourceMismatch>,
) -> SourceCheckReport {
    let runs = |scans: &[RecordedScan]| scans.iter().filter(|scan| scan.run_seed.is_some()).count() as u64;
    let (scans_done, difference) = match &compared {
        Ok(_) => (stimulus.scans.len(), None),
        Err(mismatch) => {
            let scans_up_to = stimulus.scans.get(..=mismatch.scan).unwrap_or(&stimulus.scans);
            let run_start = scans_up_to.iter().rposition(|scan| scan.run_seed.is_some()).unwrap_or(0);
            let difference = SourceDifference {
                scan: mismatch.scan as u64 + 1,
                run: runs(scans_up_to),
                scan_of_run: (scans_up_to.len() - run_start) as u64,
                what: mismatch.what.clone(),
                expected: mismatch.expected.clone(),
                found: mismatch.found.clone(),
                stimulus: scans_up_to.last().map_or_else(String::new, stimulus_text),
            };
            (scans_up_to.len(), Some(difference))
        }
    };
    SourceCheckReport {
        schema: 1,
        program: program.file.clone(),
        via,
        mcu: if via == SourceRoute::Native { "native".to_owned() } else { options.mcu.to_ascii_lowercase() },
        seed: options.seed,
        scans: scans_done as u64,
        runs: runs(stimulus.scans.get(..scans_done).unwrap_or(&[])),
        compared: compared.unwrap_or(0),
        agreed: difference.is_none(),
        difference,
        coverage: stimulus.coverage.clone(),
    }
}

/// The stimulus of a scan as text.
fn stimulus_text(scan: &RecordedScan) -> String {
    let mut words: Vec<String> = scan.inputs.iter().map(|(name, on)| format!("{name}={}", u8::from(*on))).collect();
    words.extend(scan.analog.iter().map(|(name, value)| format!("{name} converts to {value}")));
    words.extend(scan.byte.iter().map(|byte| format!("byte {byte} received")));
    words.extend(scan.writes.iter().map(|(name, value)| format!("written {name}={value}")));
    if words.is_empty() { "nothing done".to_owned() } else { words.join(", ") }
}
