//! What a back end refuses, as diagnostics with the figures.

use diag::{Diagnostic, Pos, Severity};
use ladder::Program;

use crate::codes;
use crate::target::{Job, Refusal};

/// How many rungs are named when the code does not fit.
const LARGEST: usize = 5;

/// The diagnostics of a refusal, one for each reason.
pub(crate) fn tell(refusal: &Refusal, program: &Program, job: &Job<'_>) -> Vec<Diagnostic> {
    let (chip, clock, cycle) = (job.target.chip.name, job.clock_hz, job.cycle_us);
    let mut pos = Pos::default();
    let (code, cause, hint) = match refusal {
        Refusal::Code { needed, available, rungs } => {
            let mut sizes: Vec<(usize, u64)> = rungs.iter().copied().enumerate().collect();
            sizes.sort_by_key(|&(number, bytes)| (std::cmp::Reverse(bytes), number));
            let largest: Vec<String> =
                sizes.iter().take(LARGEST).map(|(n, bytes)| format!("rung {} with {bytes}", n + 1)).collect();
            let most = if largest.is_empty() { String::new() } else { format!("; most in {}", largest.join(", ")) };
            let cause = format!("the code needs {needed} bytes, {chip} has {available}{most}");
            (codes::FLASH_FULL, cause, "shorten the program or take a larger chip".to_owned())
        }
        Refusal::Ram { needed, available } => {
            let cause = format!("data and stack need {needed} bytes of RAM, {chip} has {available}");
            (codes::RAM_FULL, cause, "use fewer integers and relays".to_owned())
        }
        Refusal::Period { shortest, longest } if cycle > *longest => {
            let cause = format!(
                "the cycle of {cycle} us is longer than the timer of {chip} can pace: at {clock} Hz at most {longest} us"
            );
            (codes::CYCLE_LONG, cause, format!("choose a cycle of {shortest} to {longest} us, or another clock"))
        }
        Refusal::Period { shortest, longest } => {
            let cause = format!(
                "the cycle of {cycle} us is shorter than the timer of {chip} can pace: at {clock} Hz at least {shortest} us"
            );
            (codes::CYCLE_SHORT, cause, format!("choose a cycle of {shortest} to {longest} us, or another clock"))
        }
        Refusal::Baud { nearest } => {
            let wanted = job.baud.unwrap_or(0);
            let cause = format!(
                "{chip} at {clock} Hz cannot send {wanted} bits per second within 2 %: the nearest is {nearest}"
            );
            (codes::BAUD, cause, "choose another rate, or a clock that is a multiple of it".to_owned())
        }
        Refusal::Pwm { nearest } => {
            let wanted = job.ir.pwm_hz.unwrap_or(0);
            let cause = format!(
                "{chip} at {clock} Hz cannot make a PWM of {wanted} Hz within 5 %: the nearest is {nearest} Hz"
            );
            (codes::PWM, cause, format!("choose {nearest} Hz, or another clock"))
        }
        Refusal::Lacks { cause, hint, element } => {
            let found = element.and_then(|id| program.elements().find(|(other, ..)| *other == id));
            let cause = match found {
                Some((id, _, at)) => {
                    pos = at;
                    format!("{id}: {cause}")
                }
                None => cause.clone(),
            };
            (codes::LACKS, cause, hint.clone())
        }
        Refusal::Many(all) => return all.iter().flat_map(|one| tell(one, program, job)).collect(),
        Refusal::Internal(what) => (codes::INTERNAL, what.clone(), "please report this with the program".to_owned()),
    };
    vec![Diagnostic::new(Severity::Error, code, &program.file, pos, cause, hint)]
}
