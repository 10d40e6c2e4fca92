//! `emu check --scenario`: plays a scenario on the evaluator and on every chip, and expects the same verdict.

use emu_check::{
    CheckOptions, RefusedCheck, ScenarioResult, play_on_chip, play_on_evaluator, scenario_report, verdict_diagnostic,
};
use ladder::LadderProgram;
use rayon::prelude::*;
use scenario::Scenario;

use super::CheckArgs;
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::input::ReadProgram;
use crate::shared::report::{MessageStyle, report_diagnostics};
use crate::shared::{output, scenarios};

/// Plays the scenario and reports the verdicts.
pub fn check(
    args: &CheckArgs,
    name: &str,
    read: &ReadProgram,
    chips: &[CheckOptions],
    all: bool,
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let file = scenarios::read_scenario(name)?;
    let (program, scenario): (&LadderProgram, &Scenario) = (&read.program, &file.scenario);
    let reference = play_on_evaluator(program, scenario).map_err(|faults| file.binding_failure(faults))?;
    let outcomes: Vec<Result<ScenarioResult, RefusedCheck>> = chips
        .par_iter()
        .map(|options| {
            play_on_chip(program, scenario, options).map_err(|errors| RefusedCheck {
                program: program.file.clone(),
                mcu: options.mcu.clone(),
                errors,
            })
        })
        .collect();
    let (results, refused): (Vec<_>, Vec<_>) = outcomes.into_iter().partition(Result::is_ok);
    let results: Vec<ScenarioResult> = results.into_iter().filter_map(Result::ok).collect();
    let refused: Vec<RefusedCheck> = refused.into_iter().filter_map(Result::err).collect();
    if results.is_empty() || !all && !refused.is_empty() {
        let errors = refused.into_iter().flat_map(|refused| refused.errors).collect();
        return Err(file.binding_failure(errors));
    }
    let differences: Vec<_> =
        results.iter().filter_map(|result| verdict_diagnostic(name, &reference, result)).collect();
    reference.log.iter().for_each(|line| output::print_to_stderr(&format!("{line}\n")));
    report_diagnostics(style, &differences, &file.texts());
    let verdict = reference.verdict.clone();
    let failure = verdict.as_ref().and_then(|verdict| verdict.to_diagnostic(name));
    report_diagnostics(style, &failure.into_iter().collect::<Vec<_>>(), &file.texts());
    let mut all_played = vec![reference];
    all_played.extend(results);
    let document = scenario_report(&program.file, name, &all_played);
    if args.json {
        output::print_json(&document)?;
    } else {
        output::print(verdict_table(&document.on, &refused, document.agreed))?;
    }
    Ok(match verdict {
        Some(verdict) if document.agreed => scenarios::verdict_exit_code(verdict.outcome),
        _ => exit::FAILED,
    })
}

/// Returns a table with one line per machine, and the summary below it.
fn verdict_table(rows: &[emu_check::ScenarioReportRow], refused: &[RefusedCheck], agreed: bool) -> String {
    let name_width = rows.iter().map(|row| row.on.len()).chain(refused.iter().map(|r| r.mcu.len())).max().unwrap_or(0);
    let mut out = String::new();
    for row in rows {
        let step = row.step.map_or_else(String::new, |step| format!(" in step {step}"));
        let why = row.why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        let compared = if row.compared > 0 { format!(", {} values compared", row.compared) } else { String::new() };
        out += &format!("{:name_width$}  {}{step}, {} scans{compared}{why}\n", row.on, row.verdict, row.scans);
    }
    for RefusedCheck { mcu, errors, .. } in refused {
        let why = errors.first().map_or("", |error| error.cause.as_str());
        out += &format!("{mcu:name_width$}  refused: {why}\n");
    }
    let chips = rows.len().saturating_sub(1);
    out += &match agreed {
        true => format!("the same verdict on the evaluator and {chips} chip(s)\n"),
        false => "the verdicts are not the same\n".to_owned(),
    };
    out
}

/// Checks that there is exactly one program and no flag that contradicts a scenario.
pub fn check_flags(args: &CheckArgs, programs: usize) -> Result<(), VerbFailure> {
    if programs != 1 {
        return Err(VerbFailure::Usage("--scenario is for one program; give one".to_owned()));
    }
    if args.scans.is_some() {
        return Err(VerbFailure::Usage(
            "--scans has no meaning with --scenario: the scenario gives its limit".to_owned(),
        ));
    }
    Ok(())
}
