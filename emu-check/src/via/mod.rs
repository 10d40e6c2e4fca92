//! Checks by way of an emitted source: C, byte code or a sketch is made of the program, compiled by a compiler from outside,
//! run on this computer or on an emulated chip, and compared with the evaluator scan by scan.

mod board;
mod codes;
mod course;
pub mod script;
pub mod serve;
mod tools;
mod unit;

use diag::{Diagnostic, Pos, Severity};
use ladder::Program;
use ladder_compile::emit::{arduino, bytecode, c};
use ladder_eval::Evaluator;
use serde::Serialize;

use board::Board;
use course::{Course, Turn, Wrong, course};
use script::Slots;
use serve::Form;

use crate::{Coverage, Options};

pub use codes::CODES;

/// The ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Via {
    /// C, compiled by gcc, on this computer.
    Native,
    /// C, compiled by avr-gcc or SDCC, on the emulated chip.
    C,
    /// A sketch, compiled with the core of the Arduino, on the emulated ATmega328P.
    Arduino,
    /// Byte code and its interpreter in C, compiled by avr-gcc, on the emulated chip.
    Bytecode,
}

/// What a check by way of a source found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of this document: 1.
    pub schema: u32,
    /// Name of the program's file.
    pub program: String,
    /// The way.
    pub via: Via,
    /// The chip; `native` where there is none.
    pub mcu: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Scans compared.
    pub scans: u64,
    /// Runs from power-up.
    pub runs: u64,
    /// Values compared.
    pub compared: u64,
    /// Nothing differed.
    pub agreed: bool,
    /// The first difference.
    pub difference: Option<Difference>,
    /// What the stimulus reached.
    pub coverage: Coverage,
}

/// The first difference.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Scan of the check, from 1.
    pub scan: u64,
    /// Run, from 1.
    pub run: u64,
    /// Scan of the run, from 1.
    pub scan_of_run: u64,
    /// What differs: a symbol, an output, sent bytes, the duty, the EEPROM, the start of a scan.
    pub what: String,
    /// The evaluator's value.
    pub expected: String,
    /// The value of the program made from the source.
    pub found: String,
    /// What was done before the scan, in words.
    pub step: String,
}

impl Report {
    /// The report in words.
    #[must_use]
    pub fn text(&self) -> String {
        let way = format!("{:?}", self.via).to_lowercase();
        match &self.difference {
            None => format!(
                "{} by way of {way} on {}: agreed in {} scans, {} runs, {} values (seed {})\n",
                self.program, self.mcu, self.scans, self.runs, self.compared, self.seed
            ),
            Some(d) => format!(
                "{} by way of {way} on {} DIFFERS in scan {} (seed {})\n  what      {}\n  expected  {}\n  found     {}\n  \
                 when      scan {} of run {}: {}\n",
                self.program, self.mcu, d.scan, self.seed, d.what, d.expected, d.found, d.scan_of_run, d.run, d.step
            ),
        }
    }
}

/// Emits `program`, compiles and runs it by way of a source, and compares every symbol, output, sent byte, duty and cell of
/// EEPROM with the evaluator after every scan; a sketch's scans must begin in time as well. Of `options` the chip, seed,
/// scans and pins count.
///
/// # Errors
/// Why there is nothing to check: the program is refused, no scans were asked for, a compiler is missing or refuses the
/// source, there is no such way to the chip, or the program made of the source ended early.
pub fn check(program: &Program, via: Via, options: &Options) -> Result<Report, Vec<Diagnostic>> {
    let one = |mut told: Diagnostic| {
        told.file.clone_from(&program.file);
        vec![told]
    };
    if options.scans == 0 {
        let cause = "0 scans were asked for, which compares nothing";
        let at = Pos::default();
        let hint = "give --scans 1 or more";
        return Err(one(Diagnostic::new(Severity::Error, crate::codes::NOTHING, "", at, cause, hint)));
    }
    let eval = Evaluator::new(program).map_err(|refusal| vec![crate::run::no_meaning(program, &refusal)])?;
    let bytes = via != Via::Arduino || board::hears(program);
    let course = course(program, &eval, options.seed, options.scans, bytes);
    let compared = match via {
        Via::Native => {
            let source = c::emit(program)?;
            let script = course.script(&source, Slots::InOrder);
            let records = serve::native(&[(source.clone(), script)], false).map_err(one)?;
            course.compare(&source, records.first().map_or(&[], Vec::as_slice), false)
        }
        Via::C => {
            let source = c::emit(program)?;
            let script = course.script(&source, Slots::InOrder);
            course.compare(&source, &serve::on_chip(&source, &script, Form::C, &options.mcu).map_err(one)?, false)
        }
        Via::Bytecode => {
            let source = bytecode::emit(program)?;
            let script = course.script(&source, Slots::Interpreter);
            course.compare(
                &source,
                &serve::on_chip(&source, &script, Form::Bytecode, &options.mcu).map_err(one)?,
                false,
            )
        }
        Via::Arduino => {
            if !options.mcu.eq_ignore_ascii_case("atmega328p") {
                let cause = format!("a sketch runs on the atmega328p of a board, not on `{}`", options.mcu);
                return Err(one(tools::error(codes::NO_WAY, cause, "name --mcu atmega328p")));
            }
            let sketch = arduino::emit(program, &arduino::Options { pins: options.pins.clone(), debounce_ms: 0 })?;
            let image = Board::new().and_then(|board| board.build(&sketch.source)).map_err(one)?;
            board::run(program, &sketch, &image, &course, eval.pwm_hz()).map_err(one)?
        }
    };
    Ok(report(program, via, options, &course, compared))
}

/// Checks many programs on this computer at once, in one executable: as C, or as byte code. Of `options` seed and scans
/// count. A program that is refused has its reasons in its place.
///
/// # Errors
/// A compiler is missing or refuses a source, or a program made of one ended early.
pub fn check_many(
    programs: &[Program],
    form: Form,
    options: &Options,
) -> Result<Vec<Result<Report, Vec<Diagnostic>>>, Diagnostic> {
    let slots = if form == Form::C { Slots::InOrder } else { Slots::Interpreter };
    let prepare = |program: &Program| {
        let eval = Evaluator::new(program).map_err(|refusal| vec![crate::run::no_meaning(program, &refusal)])?;
        let source = if form == Form::C { c::emit(program)? } else { bytecode::emit(program)? };
        let course = course(program, &eval, options.seed, options.scans, true);
        let script = course.script(&source, slots);
        Ok((course, (source, script)))
    };
    let mut courses = Vec::new();
    let mut served = Vec::new();
    for program in programs {
        courses.push(prepare(program).map(|(course, pair)| {
            served.push(pair);
            course
        }));
    }
    let records = if form == Form::C { serve::native(&served, false)? } else { serve::interpreted(&served)? };
    let mut done = served.iter().zip(&records);
    let reports = courses.into_iter().zip(programs).map(|(course, program)| {
        course.map(|course| {
            let compared = done.next().map_or(Ok(0), |((source, _), records)| course.compare(source, records, false));
            report(program, Via::Native, options, &course, compared)
        })
    });
    Ok(reports.collect())
}

fn report(program: &Program, via: Via, options: &Options, course: &Course, compared: Result<u64, Wrong>) -> Report {
    let runs = |turns: &[Turn]| turns.iter().filter(|turn| turn.begins.is_some()).count() as u64;
    let (done, difference) = match &compared {
        Ok(_) => (course.turns.len(), None),
        Err(wrong) => {
            let upto = course.turns.get(..=wrong.scan).unwrap_or(&course.turns);
            let begun = upto.iter().rposition(|turn| turn.begins.is_some()).unwrap_or(0);
            let difference = Difference {
                scan: wrong.scan as u64 + 1,
                run: runs(upto),
                scan_of_run: (upto.len() - begun) as u64,
                what: wrong.what.clone(),
                expected: wrong.expected.clone(),
                found: wrong.found.clone(),
                step: upto.last().map_or_else(String::new, words),
            };
            (upto.len(), Some(difference))
        }
    };
    Report {
        schema: 1,
        program: program.file.clone(),
        via,
        mcu: if via == Via::Native { "native".to_owned() } else { options.mcu.to_ascii_lowercase() },
        seed: options.seed,
        scans: done as u64,
        runs: runs(course.turns.get(..done).unwrap_or(&[])),
        compared: compared.unwrap_or(0),
        agreed: difference.is_none(),
        difference,
        coverage: course.coverage.clone(),
    }
}

/// What is done before a scan.
fn words(turn: &Turn) -> String {
    let mut words: Vec<String> = turn.inputs.iter().map(|(name, on)| format!("{name}={}", u8::from(*on))).collect();
    words.extend(turn.analog.iter().map(|(name, value)| format!("{name} converts to {value}")));
    words.extend(turn.byte.iter().map(|byte| format!("byte {byte} received")));
    words.extend(turn.writes.iter().map(|(name, value)| format!("written {name}={value}")));
    if words.is_empty() { "nothing done".to_owned() } else { words.join(", ") }
}
