//! `emu run --cod`: programs that check themselves by the messages in a `.cod` file, as gpsim runs them.

use diag::Diagnostic;
use emu_core::chip::{Chip, Family};
use emu_core::cpu::Cpu;
use emu_core::image::{SymbolFile, SymbolSpaces, load_messages, load_symbols};
use emu_debug::cod::{Limits, Outcome, Refusal, Script, Verdict, run};
use emu_debug::{Drive, Source};
use serde_json::{Value, json};

use crate::codes::{MESSAGE, about_file};
use crate::fail::{Failure, exit};
use crate::held::held;
use crate::report::Texts;
use crate::{input, output};

/// Clock of the chip where neither the command line nor the program names one, as gpsim has it.
pub const HZ: u64 = 20_000_000;

/// Reads the messages of the file `name`.
pub fn script(name: &str, chip: &Chip) -> Result<Script, Failure> {
    if chip.family != Family::Pic16 {
        return Err(Failure::Usage(format!("--cod is for chips of the PIC16 family; {} is none", chip.name)));
    }
    if name == "-" {
        return Err(Failure::Usage("--cod wants the name of a file, not standard input".to_owned()));
    }
    let bytes = input::bytes(name)?;
    let file = SymbolFile { name, bytes: &bytes };
    let refuse = |faults| Failure::Refused(faults, Texts::default());
    let messages = load_messages(&file).map_err(refuse)?;
    let symbols = load_symbols(&[file], SymbolSpaces::PIC16).map_err(refuse)?;
    let strange = symbols.processors.iter().filter_map(|(file, made_for)| input::other_processor(file, made_for, chip));
    let strange: Vec<Diagnostic> = strange.collect();
    if !strange.is_empty() {
        return Err(refuse(strange));
    }
    let refused = |refusals: Vec<Refusal>| {
        let refusals = refusals.into_iter().map(|refusal| refused(name, &refusal));
        Failure::Refused(refusals.collect(), Texts::default())
    };
    Script::read(&messages).map_err(refused)
}

/// The clock of the chip in Hz, and it is told where `--clock` goes before what the messages of `file` ask for.
pub fn clock(script: &mut Script, file: &str, given: Option<u64>, chip: &Chip) -> Result<u64, Failure> {
    match (given, script.frequency()) {
        (None, None) => Ok(HZ.min(chip.max_hz)),
        (None, Some(asked)) if asked > chip.max_hz => Err(Failure::Usage(format!(
            "{file} asks for {asked} Hz, and {} runs at up to {} Hz; --clock HZ goes before what the file asks for",
            chip.name, chip.max_hz
        ))),
        (None, Some(asked)) => Ok(asked),
        (Some(given), asked) => {
            if let Some(asked) = asked.filter(|asked| *asked != given) {
                output::tell(&format!(
                    "warning: --clock sets {given} Hz, and {file} asks for {asked} Hz; --clock goes before it\n"
                ));
            }
            script.ignore_frequency();
            Ok(given)
        }
    }
}

fn refused(name: &str, refusal: &Refusal) -> Diagnostic {
    about_file(MESSAGE, name, refusal.to_string(), "docs/formats/cod.md lists what is carried out")
}

/// Runs the program under its messages, tells how it ended, and gives the exit code: 0 when the first message that halts it says
/// PASSED.
pub fn judge<C: Cpu>(
    cpu: &mut C,
    script: &Script,
    (name, source): (&str, Source<'_>),
    (limits, drives): (Limits, &[Drive]),
    as_json: bool,
) -> Result<u8, Failure> {
    let outcome = run(cpu, script, source.names, limits, &mut |cpu: &mut C, at, pin, millivolts| {
        cpu.drive_volts(at, pin, u32::try_from(millivolts).unwrap_or(0));
    });
    for warning in &outcome.warnings {
        output::tell(&format!("warning: {warning}\n"));
    }
    if let Verdict::Refused(refusal) = &outcome.verdict {
        return Err(Failure::Refused(vec![refused(name, refusal)], Texts::default()));
    }
    if as_json {
        output::json(&document(cpu, &outcome, (&source, limits.hz), drives))?;
    } else {
        output::print(text(cpu, &outcome, &source, drives))?;
    }
    Ok(match outcome.verdict {
        Verdict::Illegal { .. } | Verdict::Fault { .. } => exit::FAULT,
        verdict if verdict.passed() => exit::OK,
        _ => exit::FAILED,
    })
}

/// How the run ended, in a sentence; the text of the message where one halted it.
fn sentence<C: Cpu>(cpu: &C, outcome: &Outcome, source: &Source<'_>, drives: &[Drive]) -> String {
    match &outcome.verdict {
        Verdict::Message { text, .. } => text.clone(),
        Verdict::Limit { cycle } => format!("the limit came at cycle {cycle}, before any message halted the program"),
        Verdict::Halted { pc, cycle } => {
            let why = held(cpu, drives).map_or_else(String::new, |why| format!(": {why}"));
            format!("the program halted at {}, cycle {cycle}, without a message{why}", source.place(*pc))
        }
        Verdict::Illegal { pc, word } => format!("no instruction: 0x{word:04x} at {}", source.place(*pc)),
        Verdict::Fault { pc, fault } => format!("a fault of the program at {}: {fault}", source.place(*pc)),
        Verdict::Unsettled { cycle } => format!("chip and parts answer each other without end in cycle {cycle}"),
        Verdict::Refused(refusal) => refusal.to_string(),
    }
}

fn text<C: Cpu>(cpu: &C, outcome: &Outcome, source: &Source<'_>, drives: &[Drive]) -> String {
    let mut ended = sentence(cpu, outcome, source, drives);
    if let Verdict::Message { broken, pc, cycle, .. } = &outcome.verdict {
        if let Some((assertion, values)) = broken {
            let values: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            ended.push_str(&format!("\nassertion  {assertion}\nvalues     {}", values.join(", ")));
        }
        ended.push_str(&format!("\npc         {}, cycle {cycle}", source.place(*pc)));
    }
    let verdict = if outcome.verdict.passed() { "passed" } else { "failed" };
    format!("verdict    {verdict}\nmessage    {ended}\nchecked    {} assertions\n", outcome.checked)
}

fn document<C: Cpu>(cpu: &C, outcome: &Outcome, (source, hz): (&Source<'_>, u64), drives: &[Drive]) -> Value {
    let (reason, broken) = match &outcome.verdict {
        Verdict::Message { broken, .. } => ("message", broken.as_ref()),
        Verdict::Limit { .. } => ("limit", None),
        Verdict::Halted { .. } => ("halted", None),
        Verdict::Illegal { .. } => ("illegal", None),
        Verdict::Fault { .. } => ("fault", None),
        Verdict::Unsettled { .. } => ("unsettled", None),
        Verdict::Refused(_) => ("refused", None),
    };
    let values = |values: &[(String, String)]| -> Value {
        values.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<serde_json::Map<_, _>>().into()
    };
    json!({
        "schema": 1,
        "mcu": cpu.chip().name,
        "clock_hz": hz,
        "passed": outcome.verdict.passed(),
        "reason": reason,
        "message": sentence(cpu, outcome, source, drives),
        "assertion": broken.map(|(assertion, of)| json!({ "text": assertion, "values": values(of) })),
        "checked": outcome.checked,
        "pc": cpu.pc(),
        "cycles": cpu.cycle(),
    })
}
