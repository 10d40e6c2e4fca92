//! Converts the refusals of a back end to diagnostics with the numbers.

use std::collections::{BTreeSet, HashMap};

use diag::{Diagnostic, Pos, Severity};
use ladder::symbols::for_each_symbol_use;
use ladder::{LadderProgram, ProgramElement};

use crate::codes;
use crate::target::{BuildRefusal, BuiltImage, CompileJob};

/// Maximum number of rungs named when something does not fit.
const MAX_NAMED_RUNGS: usize = 5;

/// Maximum cycle time in microseconds that the reader of programs accepts.
const MAX_CYCLE_US: u64 = 1_000_000_000_000;

/// Returns the diagnostics of a refusal, one per reason.
pub(crate) fn refusal_diagnostics(
    refusal: &BuildRefusal,
    program: &LadderProgram,
    job: &CompileJob<'_>,
) -> Vec<Diagnostic> {
    let (chip, clock, cycle) = (job.target.chip.name, job.clock_hz, job.cycle_us);
    let mut pos = Pos::default();
    let (code, cause, hint) = match refusal {
        BuildRefusal::CodeTooLarge { needed, available, rungs } => {
            let most = largest_rungs(rungs);
            let cause = format!("the code needs {needed} bytes, {chip} has {available}{most}");
            (codes::FLASH_FULL, cause, "shorten the program or take a larger chip".to_owned())
        }
        BuildRefusal::RamTooSmall { needed, available } => {
            let most = largest_rungs(&rung_data_bytes(program));
            let cause = format!("data and stack need {needed} bytes of RAM, {chip} has {available}{most}");
            (codes::RAM_FULL, cause, "use fewer integers and relays".to_owned())
        }
        BuildRefusal::PeriodOutOfRange { shortest, longest } if cycle > *longest => {
            let cause = format!(
                "the cycle of {cycle} us is longer than the timer of {chip} can pace: at {clock} Hz at most {longest} us"
            );
            (codes::CYCLE_LONG, cause, format!("choose a cycle of {shortest} to {longest} us, or another clock"))
        }
        BuildRefusal::PeriodOutOfRange { shortest, longest } => {
            let longest = longest.min(&MAX_CYCLE_US);
            let cause = format!(
                "the cycle of {cycle} us is shorter than the timer of {chip} can pace: at {clock} Hz at least {shortest} us"
            );
            (codes::CYCLE_SHORT, cause, format!("choose a cycle of {shortest} to {longest} us, or another clock"))
        }
        BuildRefusal::BaudOutOfRange { nearest } => {
            let wanted = job.baud.unwrap_or(0);
            let cause = format!(
                "{chip} at {clock} Hz cannot send {wanted} bits per second within 2 %: the nearest is {nearest}"
            );
            (codes::BAUD, cause, "choose another rate, or a clock that is a multiple of it".to_owned())
        }
        BuildRefusal::PwmOutOfRange { hertz: wanted, nearest } => {
            let cause = format!(
                "{chip} at {clock} Hz cannot make a PWM of {wanted} Hz within 5 %: the nearest is {nearest} Hz"
            );
            (codes::PWM, cause, format!("choose {nearest} Hz, or another clock"))
        }
        BuildRefusal::Unsupported { cause, hint, element } => {
            let found = element.and_then(|id| program.find_element(id));
            let cause = match found {
                Some(ProgramElement { id, pos: at, .. }) => {
                    pos = at;
                    format!("{id}: {cause}")
                }
                None => cause.clone(),
            };
            (codes::LACKS, cause, hint.clone())
        }
        BuildRefusal::Several(all) => {
            return all.iter().flat_map(|one| refusal_diagnostics(one, program, job)).collect();
        }
        BuildRefusal::Internal(error) => {
            (codes::INTERNAL, error.to_string(), "please report this with the program".to_owned())
        }
    };
    vec![Diagnostic::new(Severity::Error, code, &program.file, pos, cause, hint)]
}

/// Returns the error for a scan that is longer than the period.
pub(crate) fn scan_too_long(program: &LadderProgram, job: &CompileJob<'_>, built: &BuiltImage) -> Diagnostic {
    let cause = format!(
        "a scan takes up to {} machine cycles (and {} to notice the match), but the cycle of {} us at {} Hz has only {}{}",
        built.worst_scan_cycles,
        built.poll_cycles,
        job.cycle_us,
        job.clock_hz,
        built.shortest_period_cycles,
        largest_rungs(&built.rung_cycles)
    );
    // Scale the needed machine cycles by the current ratio of cycle time to period.
    let needed = u128::from(built.worst_scan_cycles + built.poll_cycles)
        * u128::from(built.period.den)
        * u128::from(job.cycle_us);
    let least = needed.div_ceil(u128::from(built.period.num.max(1)));
    let hint = format!("choose a cycle of {least} us or more, or a faster clock");
    Diagnostic::new(Severity::Error, codes::CYCLE_SHORT, &program.file, Pos::default(), cause, hint)
}

/// Names the rungs with the largest sizes, as the end of a sentence.
fn largest_rungs(rungs: &[u64]) -> String {
    let mut sizes: Vec<(usize, u64)> = rungs.iter().copied().enumerate().filter(|&(_, size)| size > 0).collect();
    sizes.sort_by_key(|&(number, size)| (std::cmp::Reverse(size), number));
    let named: Vec<String> =
        sizes.iter().take(MAX_NAMED_RUNGS).map(|(number, size)| format!("rung {} with {size}", number + 1)).collect();
    if named.is_empty() { String::new() } else { format!("; most in {}", named.join(", ")) }
}

/// Number of bytes of the integers that each rung uses.
fn rung_data_bytes(program: &LadderProgram) -> Vec<u64> {
    let symbols: HashMap<String, u64> =
        program.symbols().into_iter().filter(|s| !s.kind.is_bit()).map(|s| (s.name, s.bytes.into())).collect();
    let mut used: Vec<BTreeSet<String>> = vec![BTreeSet::new(); program.rungs.len()];
    for ProgramElement { id, element, .. } in program.elements() {
        if let Some(names) = used.get_mut(id.rung as usize) {
            for_each_symbol_use(element, &mut |name, _| _ = names.insert(name.to_owned()));
        }
    }
    used.iter().map(|names| names.iter().filter_map(|name| symbols.get(name)).sum()).collect()
}
