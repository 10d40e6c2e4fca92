//! `emu sim --scenario` and `--stimulus`: runs the reference evaluator with a scenario or a waveform.

use emu_check::EvaluatorPlay;
use ladder::ChipPart;
use ladder_eval::Evaluator;
use scenario::bind;

use super::{MAX_VALUES, SimArgs, unsupported, write_results};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::input::ReadProgram;
use crate::shared::output::RequestedOutput;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::scenarios::PlayedScenario;
use crate::shared::{output, scenarios};
use crate::verbs::sim::trace::ScanTraceTable;

/// Plays the scenario or waveform, and writes the requested results.
pub fn play(
    args: &SimArgs,
    read: &ReadProgram,
    used: &[RequestedOutput<'_>],
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let program = &read.program;
    let eval = Evaluator::new(program)
        .map_err(|refusal| VerbFailure::Refused(vec![unsupported(program, &refusal)], FileTexts::default()))?;
    let mut play = EvaluatorPlay::new(program).map_err(|faults| VerbFailure::Refused(faults, FileTexts::default()))?;
    let file = args.scenario.as_deref().map(scenarios::read_scenario).transpose()?;
    if let Some(file) = &file {
        let bound = bind(&file.scenario, play.resolver(), Some(&program.file), None);
        let bound = bound.map_err(|faults| file.binding_failure(faults))?;
        play.add_scenario(bound.with_limit(args.scans));
    }
    if let Some(name) = &args.stimulus {
        let inputs = program.symbols().into_iter().filter(|symbol| symbol.kind == ladder::SymbolKind::Input);
        let analog = eval.adc_symbols().filter_map(|adc| eval.symbols().get(adc).cloned());
        let driven: Vec<String> = inputs.chain(analog).map(|symbol| symbol.name).collect();
        let wave = scenarios::read_waveform(name)?;
        let (stimuli, warnings) = wave.scenario(&mut |wire| driven.iter().any(|name| name == wire))?;
        report_diagnostics(style, &warnings, FileTexts::NONE);
        let bound = bind(&stimuli, play.resolver(), None, None).map_err(|faults| wave.binding_failure(faults))?;
        // A waveform alone ends with its last change, unless the user gives a number of scans.
        let alone = file.is_none() && args.scans.is_none();
        play.add_stimuli(bound.with_limit(Some(u64::MAX)), alone);
    }
    let symbols = eval.symbols().to_vec();
    let mut trace = ScanTraceTable::new(&symbols, &eval, program.uses_part(ChipPart::Transmitter));
    let traced = !used.is_empty() || file.is_none();
    let most = if traced { MAX_VALUES / (trace.width() as u64).max(1) } else { u64::MAX };
    // A scenario has its own limit.
    let end = args.scans.filter(|_| file.is_none()).unwrap_or(u64::MAX);
    while play.scans() < end && play.scan() {
        play.take_log().iter().for_each(|line| output::print_to_stderr(&format!("{line}\n")));
        if play.scans() > most {
            let (flag, name) = match &args.scenario {
                Some(file) => ("--scenario <FILE>", file),
                None => ("--stimulus <FILE>", args.stimulus.as_ref().unwrap_or(&program.file)),
            };
            let why = format!("it takes more than {most} scans, the maximum for a trace");
            return Err(VerbFailure::invalid_flag_value(flag, name, &why));
        }
        if traced {
            trace.note_scan(&play.eval);
        }
    }
    play.take_log().iter().for_each(|line| output::print_to_stderr(&format!("{line}\n")));
    let Some(file) = file else {
        write_results(args, program, &trace, None)?;
        if used.is_empty() {
            output::print(trace.table())?;
        }
        return Ok(exit::OK);
    };
    let verdict = play.finish("the run was over");
    write_results(args, program, &trace, Some(file.verdict_json(&verdict)))?;
    let printed = used.iter().any(|output| output::is_stdout(output.file));
    file.report_verdict(&PlayedScenario { steps: file.steps(), verdict: &verdict }, printed, style)
}
