//! `emu run --cod`: programs that check themselves by the messages in a `.cod` file, as gpsim runs them.

use diag::Diagnostic;
use emu_core::chip::{Chip, Family};
use emu_core::cpu::Cpu;
use emu_core::image::{SymbolFile, load_messages};
use emu_debug::Names;
use emu_debug::cod::{Limits, Outcome, Refusal, Script, Verdict, run};
use serde_json::{Value, json};

use crate::codes::{MESSAGE, about_file};
use crate::fail::{Failure, exit};
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
    let messages =
        load_messages(&SymbolFile { name, bytes: &bytes }).map_err(|faults| Failure::Refused(faults, Vec::new()))?;
    let refused = |refusals: Vec<Refusal>| {
        let refusals = refusals.into_iter().map(|refusal| refused(name, &refusal));
        Failure::Refused(refusals.collect(), Vec::new())
    };
    Script::read(&messages).map_err(refused)
}

fn refused(name: &str, refusal: &Refusal) -> Diagnostic {
    about_file(MESSAGE, name, refusal.to_string(), "docs/formats/cod.md lists what is carried out")
}

/// Runs the program under its messages, tells how it ended, and gives the exit code: 0 when the first message that halts it says
/// PASSED.
pub fn judge<C: Cpu>(
    cpu: &mut C,
    script: &Script,
    (name, names): (&str, Names<'_>),
    limits: Limits,
    as_json: bool,
) -> Result<u8, Failure> {
    let outcome = run(cpu, script, names, limits, &mut |cpu: &mut C, at, pin, millivolts| {
        cpu.drive_volts(at, pin, u32::try_from(millivolts).unwrap_or(0));
    });
    for warning in &outcome.warnings {
        output::tell(&format!("warning: {warning}\n"));
    }
    if let Verdict::Refused(refusal) = &outcome.verdict {
        return Err(Failure::Refused(vec![refused(name, refusal)], Vec::new()));
    }
    if as_json {
        output::json(&document(cpu, &outcome))?;
    } else {
        output::print(text(&outcome, &names))?;
    }
    Ok(match outcome.verdict {
        Verdict::Illegal { .. } | Verdict::Fault { .. } => exit::FAULT,
        verdict if verdict.passed() => exit::OK,
        _ => exit::FAILED,
    })
}

/// `0x0012 (main+0x2)`.
fn place(names: &Names<'_>, pc: u32) -> String {
    let near = names.near(pc * names.chip.word_bytes);
    near.map_or_else(|| format!("0x{pc:04x}"), |near| format!("0x{pc:04x} ({near})"))
}

fn text(outcome: &Outcome, names: &Names<'_>) -> String {
    let ended = match &outcome.verdict {
        Verdict::Message { text, broken, pc, cycle } => {
            let broken = broken.as_ref().map_or_else(String::new, |(assertion, values)| {
                let values: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
                format!("\nassertion  {assertion}\nvalues     {}", values.join(", "))
            });
            format!("{text}{broken}\npc         {}, cycle {cycle}", place(names, *pc))
        }
        Verdict::Limit { cycle } => format!("the limit came at cycle {cycle}, before any message halted the program"),
        Verdict::Halted { pc, cycle } => {
            format!("the program halted at {}, cycle {cycle}, without a message", place(names, *pc))
        }
        Verdict::Illegal { pc, word } => format!("no instruction: 0x{word:04x} at {}", place(names, *pc)),
        Verdict::Fault { pc, fault } => format!("a fault of the program at {}: {fault}", place(names, *pc)),
        Verdict::Unsettled { cycle } => format!("chip and parts answer each other without end in cycle {cycle}"),
        Verdict::Refused(refusal) => refusal.to_string(),
    };
    let verdict = if outcome.verdict.passed() { "passed" } else { "failed" };
    format!("verdict    {verdict}\nmessage    {ended}\nchecked    {} assertions\n", outcome.checked)
}

fn document<C: Cpu>(cpu: &C, outcome: &Outcome) -> Value {
    let (reason, text, broken) = match &outcome.verdict {
        Verdict::Message { text, broken, .. } => ("message", text.as_str(), broken.as_ref()),
        Verdict::Limit { .. } => ("limit", "", None),
        Verdict::Halted { .. } => ("halted", "", None),
        Verdict::Illegal { .. } => ("illegal", "", None),
        Verdict::Fault { .. } => ("fault", "", None),
        Verdict::Unsettled { .. } => ("unsettled", "", None),
        Verdict::Refused(_) => ("refused", "", None),
    };
    let values = |values: &[(String, String)]| -> Value {
        values.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<serde_json::Map<_, _>>().into()
    };
    json!({
        "schema": 1,
        "mcu": cpu.chip().name,
        "passed": outcome.verdict.passed(),
        "reason": reason,
        "message": text,
        "assertion": broken.map(|(assertion, of)| json!({ "text": assertion, "values": values(of) })),
        "checked": outcome.checked,
        "pc": cpu.pc(),
        "cycles": cpu.cycle(),
    })
}
