//! `emu run --cod`: runs self-checking programs with the messages in a `.cod` file, as gpsim does.

use diag::Diagnostic;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;
use emu_core::cpu::ProgramError;
use emu_core::image::{SymbolFile, SymbolSpaces, load_messages, load_symbols};
use emu_debug::cod::{CodOutcome, CodRefusal, CodRunLimits, CodScript, CodVerdict, NamedText, run_script};
use emu_debug::{ProgramSource, TimedDrive};
use serde_json::{Value, json};

use crate::shared::codes::{COD_MESSAGE, file_error};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::report::FileTexts;
use crate::shared::reset_hold::reset_hold;
use crate::shared::{input, output};

/// Default clock of the chip in Hz, as in gpsim, if neither the command line nor the program gives one.
pub const DEFAULT_HZ: u64 = 20_000_000;

/// Reads the messages of the file `name`.
pub fn read_script(name: &str, chip: &Chip) -> Result<CodScript, VerbFailure> {
    if chip.family != ChipFamily::Pic16 {
        return Err(VerbFailure::Usage(format!("--cod is for chips of the PIC16 family; {} is not one", chip.name)));
    }
    if name == "-" {
        return Err(VerbFailure::Usage("--cod needs the name of a file, not standard input".to_owned()));
    }
    let bytes = input::read_bytes(name)?;
    let file = SymbolFile { name, bytes: &bytes };
    let refusal = |faults| VerbFailure::Refused(faults, FileTexts::default());
    let messages = load_messages(&file).map_err(refusal)?;
    let symbols = load_symbols(&[file], SymbolSpaces::PIC16).map_err(refusal)?;
    let wrong_processor_errors = symbols
        .processors_by_file
        .iter()
        .filter_map(|(file, made_for)| input::other_processor_error(file, made_for, chip));
    let wrong_processor_errors: Vec<Diagnostic> = wrong_processor_errors.collect();
    if !wrong_processor_errors.is_empty() {
        return Err(refusal(wrong_processor_errors));
    }
    let refused = |refusals: Vec<CodRefusal>| {
        let refusals = refusals.into_iter().map(|refusal| refused(name, &refusal));
        VerbFailure::Refused(refusals.collect(), FileTexts::default())
    };
    CodScript::read(&messages).map_err(refused)
}

/// Returns the clock of the chip in Hz: that of `--clock`, otherwise that of the messages of `file`,
/// otherwise the default. With `--clock`, makes `script` ignore the clock of the messages, and prints a
/// warning if the two differ.
pub fn choose_script_clock(
    script: &mut CodScript,
    file: &str,
    flag_hz: Option<u64>,
    chip: &Chip,
) -> Result<u64, VerbFailure> {
    match (flag_hz, script.frequency()) {
        (None, None) => Ok(DEFAULT_HZ.min(chip.max_hz)),
        (None, Some(script_hz)) if script_hz > chip.max_hz => Err(VerbFailure::Usage(format!(
            "{file} requests {script_hz} Hz, but {} runs at up to {} Hz; --clock HZ overrides the frequency of the file",
            chip.name, chip.max_hz
        ))),
        (None, Some(script_hz)) => Ok(script_hz),
        (Some(flag_hz), script_hz) => {
            if let Some(script_hz) = script_hz.filter(|script_hz| *script_hz != flag_hz) {
                output::print_to_stderr(&format!(
                    "warning: --clock sets {flag_hz} Hz, and {file} requests {script_hz} Hz; --clock overrides it\n"
                ));
            }
            script.ignore_frequency();
            Ok(flag_hz)
        }
    }
}

fn refused(name: &str, refusal: &CodRefusal) -> Diagnostic {
    file_error(COD_MESSAGE, name, refusal.to_string(), "docs/formats/cod.md lists what is carried out")
}

/// Runs the program with its messages, reports how it ended, and returns the exit code: 0 if the first
/// message that halts it says PASSED.
pub fn run_and_judge<C: Cpu>(
    cpu: &mut C,
    script: &CodScript,
    (name, source): (&str, ProgramSource<'_>),
    (limits, drives): (CodRunLimits, &[TimedDrive]),
    as_json: bool,
) -> Result<u8, VerbFailure> {
    let outcome = run_script(cpu, script, source.names, limits, &mut |cpu: &mut C, at, pin, millivolts| {
        cpu.drive_volts(at, pin, u32::try_from(millivolts).unwrap_or(0));
    });
    for warning in &outcome.warnings {
        output::print_to_stderr(&format!("warning: {warning}\n"));
    }
    if let CodVerdict::Refused(refusal) = &outcome.verdict {
        return Err(VerbFailure::Refused(vec![refused(name, refusal)], FileTexts::default()));
    }
    if as_json {
        output::print_json(&document(cpu, &outcome, (&source, limits.hz), drives))?;
    } else {
        output::print(text(cpu, &outcome, &source, drives))?;
    }
    Ok(match outcome.verdict {
        CodVerdict::Error(_) => exit::FAULT,
        verdict if verdict.passed() => exit::OK,
        _ => exit::FAILED,
    })
}

/// Returns how the run ended in one sentence, or the text of the message that halted it.
fn sentence<C: Cpu>(cpu: &C, outcome: &CodOutcome, source: &ProgramSource<'_>, drives: &[TimedDrive]) -> String {
    match &outcome.verdict {
        CodVerdict::Message { text, .. } => text.clone(),
        CodVerdict::Limit { cycle } => {
            format!("the limit was reached at cycle {cycle}, before any message halted the program")
        }
        CodVerdict::Halted { pc, cycle } => {
            let why = reset_hold(cpu, drives).map_or_else(String::new, |why| format!(": {why}"));
            format!("the program halted at {}, cycle {cycle}, without a message{why}", source.describe_word(*pc))
        }
        CodVerdict::Error(ProgramError::Illegal { pc, word }) => {
            format!("no instruction: 0x{word:04x} at {}", source.describe_word(*pc))
        }
        CodVerdict::Error(ProgramError::Fault { pc, fault }) => {
            format!("a fault of the program at {}: {fault}", source.describe_word(*pc))
        }
        CodVerdict::Unsettled { cycle } => format!("chip and parts answer each other without end in cycle {cycle}"),
        CodVerdict::Refused(refusal) => refusal.to_string(),
    }
}

fn text<C: Cpu>(cpu: &C, outcome: &CodOutcome, source: &ProgramSource<'_>, drives: &[TimedDrive]) -> String {
    let mut ended = sentence(cpu, outcome, source, drives);
    if let CodVerdict::Message { failed_assertion, pc, cycle, .. } = &outcome.verdict {
        if let Some((assertion, values)) = failed_assertion {
            let values: Vec<String> = values.iter().map(|one| format!("{} = {}", one.name, one.value)).collect();
            ended.push_str(&format!("\nassertion  {assertion}\nvalues     {}", values.join(", ")));
        }
        ended.push_str(&format!("\npc         {}, cycle {cycle}", source.describe_word(*pc)));
    }
    let verdict = if outcome.verdict.passed() { "passed" } else { "failed" };
    format!("verdict    {verdict}\nmessage    {ended}\nchecked    {} assertions\n", outcome.assertions_checked)
}

fn document<C: Cpu>(
    cpu: &C,
    outcome: &CodOutcome,
    (source, hz): (&ProgramSource<'_>, u64),
    drives: &[TimedDrive],
) -> Value {
    let (reason, failed_assertion) = match &outcome.verdict {
        CodVerdict::Message { failed_assertion, .. } => ("message", failed_assertion.as_ref()),
        CodVerdict::Limit { .. } => ("limit", None),
        CodVerdict::Halted { .. } => ("halted", None),
        CodVerdict::Error(ProgramError::Illegal { .. }) => ("illegal", None),
        CodVerdict::Error(ProgramError::Fault { .. }) => ("fault", None),
        CodVerdict::Unsettled { .. } => ("unsettled", None),
        CodVerdict::Refused(_) => ("refused", None),
    };
    let values = |values: &[NamedText]| -> Value {
        values.iter().map(|one| (one.name.clone(), json!(one.value))).collect::<serde_json::Map<_, _>>().into()
    };
    json!({
        "schema": 1,
        "mcu": cpu.chip().name,
        "clock_hz": hz,
        "passed": outcome.verdict.passed(),
        "reason": reason,
        "message": sentence(cpu, outcome, source, drives),
        "assertion": failed_assertion.map(|(assertion, of)| json!({ "text": assertion, "values": values(of) })),
        "checked": outcome.assertions_checked,
        "pc": cpu.pc(),
        "cycles": cpu.cycle(),
    })
}
