//! `emu check --scenario`: a scenario on the evaluator and on every chip, with the same verdict.

use emu_check::{Options, Performance, Refused, differing, document, perform, rehearse};
use ladder::Program;
use rayon::prelude::*;
use scenario::Scenario;

use super::CheckArgs;
use crate::fail::{Failure, exit};
use crate::input::Read;
use crate::report::{Terminal, report};
use crate::{output, scenarios};

/// Plays it.
pub fn check(
    args: &CheckArgs,
    name: &str,
    read: &Read,
    chips: &[Options],
    all: bool,
    terminal: &Terminal,
) -> Result<u8, Failure> {
    let file = scenarios::read(name)?;
    let (program, scenario): (&Program, &Scenario) = (&read.program, &file.scenario);
    let reference = rehearse(program, scenario).map_err(|faults| file.refused(faults))?;
    let played: Vec<Result<Performance, Refused>> = chips
        .par_iter()
        .map(|options| {
            perform(program, scenario, options).map_err(|errors| Refused {
                program: program.file.clone(),
                mcu: options.mcu.clone(),
                errors,
            })
        })
        .collect();
    let (good, refused): (Vec<_>, Vec<_>) = played.into_iter().partition(Result::is_ok);
    let good: Vec<Performance> = good.into_iter().filter_map(Result::ok).collect();
    let refused: Vec<Refused> = refused.into_iter().filter_map(Result::err).collect();
    if good.is_empty() || !all && !refused.is_empty() {
        let errors = refused.into_iter().flat_map(|refused| refused.errors).collect();
        return Err(file.refused(errors));
    }
    let differs: Vec<_> = good.iter().filter_map(|played| differing(name, &reference, played)).collect();
    reference.log.iter().for_each(|line| output::tell(&format!("{line}\n")));
    report(terminal, &differs, &file.texts());
    let verdict = reference.verdict.clone();
    let complaint = verdict.as_ref().and_then(|verdict| verdict.complaint(name));
    report(terminal, &complaint.into_iter().collect::<Vec<_>>(), &file.texts());
    let mut all_played = vec![reference];
    all_played.extend(good);
    let document = document(&program.file, name, &all_played);
    if args.json {
        output::json(&document)?;
    } else {
        output::print(table(&document.on, &refused, document.agreed))?;
    }
    Ok(match verdict {
        Some(verdict) if document.agreed => scenarios::code(verdict.outcome),
        _ => exit::FAILED,
    })
}

/// A line for each machine, and what follows of them.
fn table(rows: &[emu_check::Row], refused: &[Refused], agreed: bool) -> String {
    let wide = rows.iter().map(|row| row.on.len()).chain(refused.iter().map(|r| r.mcu.len())).max().unwrap_or(0);
    let mut out = String::new();
    for row in rows {
        let step = row.step.map_or_else(String::new, |step| format!(" in step {step}"));
        let why = row.why.as_ref().map_or_else(String::new, |why| format!(": {why}"));
        let compared = if row.compared > 0 { format!(", {} values compared", row.compared) } else { String::new() };
        out += &format!("{:wide$}  {}{step}, {} scans{compared}{why}\n", row.on, row.verdict, row.scans);
    }
    for Refused { mcu, errors, .. } in refused {
        let why = errors.first().map_or("", |error| error.cause.as_str());
        out += &format!("{mcu:wide$}  refused: {why}\n");
    }
    let chips = rows.len().saturating_sub(1);
    out += &match agreed {
        true => format!("the same verdict on the evaluator and {chips} chip(s)\n"),
        false => "the verdicts are not the same\n".to_owned(),
    };
    out
}

/// A scenario is of one program, and excludes what a check is otherwise about.
pub fn usable(args: &CheckArgs, programs: usize) -> Result<(), Failure> {
    if programs != 1 {
        return Err(Failure::Usage("--scenario is for one program; give one".to_owned()));
    }
    if args.scans.is_some() {
        return Err(Failure::Usage(
            "--scans has no meaning with --scenario: its limit stands in the scenario".to_owned(),
        ));
    }
    Ok(())
}
