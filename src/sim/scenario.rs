//! `emu sim --scenario` and `--stimulus`: the reference evaluator under a scenario, or under a waveform.

use emu_check::Rehearsal;
use ladder_eval::Evaluator;
use scenario::bind;

use super::{MAX_VALUES, SimArgs, results, sends, unsupported};
use crate::fail::{Failure, exit};
use crate::input::Read;
use crate::output;
use crate::report::{Terminal, Texts, report};
use crate::scenarios::{self, Played};
use crate::trace::Trace;

/// Plays it, and writes what was asked for.
pub fn play(args: &SimArgs, read: &Read, used: &[(&str, &str)], terminal: &Terminal) -> Result<u8, Failure> {
    let program = &read.program;
    let eval = Evaluator::new(program)
        .map_err(|refusal| Failure::Refused(vec![unsupported(program, &refusal)], Texts::default()))?;
    let mut play = Rehearsal::new(program).map_err(|faults| Failure::Refused(faults, Texts::default()))?;
    let file = args.scenario.as_deref().map(scenarios::read).transpose()?;
    if let Some(file) = &file {
        let bound = bind(&file.scenario, play.site(), Some(&program.file), None);
        let bound = bound.map_err(|faults| file.refused(faults))?;
        play.play(bound.limited(args.scans));
    }
    if let Some(name) = &args.stimulus {
        let inputs = program.symbols().into_iter().filter(|symbol| symbol.kind == ladder::SymbolKind::Input);
        let analog = eval.adc_symbols().filter_map(|adc| eval.symbols().get(adc).cloned());
        let driven: Vec<String> = inputs.chain(analog).map(|symbol| symbol.name).collect();
        let wave = scenarios::waveform(name)?;
        let (stimuli, told) = wave.scenario(&mut |wire| driven.iter().any(|name| name == wire))?;
        report(terminal, &told, Texts::NONE);
        let bound = bind(&stimuli, play.site(), None, None).map_err(|faults| wave.refused(faults))?;
        // It ends with its last change, unless a number of scans or a scenario says otherwise.
        let alone = file.is_none() && args.scans.is_none();
        play.accompany(bound.limited(Some(u64::MAX)), alone);
    }
    let symbols = eval.symbols().to_vec();
    let mut trace = Trace::new(&symbols, &eval, sends(program));
    let traced = !used.is_empty() || file.is_none();
    let most = if traced { MAX_VALUES / (trace.width() as u64).max(1) } else { u64::MAX };
    // A scenario has a limit of its own.
    let end = args.scans.filter(|_| file.is_none()).unwrap_or(u64::MAX);
    while play.scans() < end && play.scan() {
        play.told().iter().for_each(|line| output::tell(&format!("{line}\n")));
        if play.scans() > most {
            let (flag, name) = match &args.scenario {
                Some(file) => ("--scenario <FILE>", file),
                None => ("--stimulus <FILE>", args.stimulus.as_ref().unwrap_or(&program.file)),
            };
            let why = format!("it goes on for more than the {most} scans whose values can be traced at once");
            return Err(Failure::value(flag, name, &why));
        }
        if traced {
            trace.note(&play.eval);
        }
    }
    play.told().iter().for_each(|line| output::tell(&format!("{line}\n")));
    let Some(file) = file else {
        results(args, program, &trace, None)?;
        if used.is_empty() {
            output::print(trace.table())?;
        }
        return Ok(exit::OK);
    };
    let verdict = play.end("the run was over");
    results(args, program, &trace, Some(file.document(&verdict)))?;
    let printed = used.iter().any(|(_, file)| output::is_stdout(file));
    file.tell(&Played { steps: file.steps(), verdict: &verdict }, printed, terminal)
}
