//! Directives with a frequency or a time: the clock and the period of a scan, and how a number with a unit is
//! read.

use super::{TimeLength, check_given_once, report_bad_argument, state};
use crate::engine::{Assembler, DirectiveCall};
use crate::lines::trim;

/// `clock 1000000`, `clock 1.5MHz`, `clock NAME`.
pub(super) fn clock(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    check_given_once(asm, call, call.get(call.word.clone()));
    let units = [("mhz", 1_000_000), ("khz", 1_000), ("hz", 1), ("", 1)];
    match define_quantity(asm, call, &units).and_then(|(hz, _)| u32::try_from(hz).ok()) {
        Some(hz) => state(asm).clock = hz,
        None => {
            let cause = format!("`{}` is not a clock", call.get(trim(call.text, call.rest.clone())));
            report_bad_argument(
                asm,
                call,
                cause,
                "write a frequency such as 1000000 or 1.5MHz, from 1 to 4294967295 Hz",
            );
        }
    }
}

/// `period 10ms`, `period 5000c`.
pub(super) fn period(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    check_given_once(asm, call, call.get(call.word.clone()));
    let units = [("us", 1_000), ("ms", 1_000_000), ("s", 1_000_000_000), ("c", 1)];
    match define_quantity(asm, call, &units) {
        Some((n, 3)) => state(asm).period = Some(TimeLength::Cycles(n)),
        Some((n, _)) => state(asm).period = Some(TimeLength::Nanoseconds(n)),
        None => {
            let cause = format!("`{}` is not a period", call.get(trim(call.text, call.rest.clone())));
            report_bad_argument(asm, call, cause, "write a time such as 10ms, or machine cycles such as 5000c");
        }
    }
}

/// Returns a number in the smallest unit, and the index of its unit: `10ms`, `1.5MHz`, `n*1000c`, or a name.
/// `None` if it is not a whole number above 0.
fn define_quantity(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, units: &[(&str, u64)]) -> Option<(u64, usize)> {
    let all = trim(call.text, call.rest.clone());
    let text = call.get(all.clone());
    let lower = text.to_ascii_lowercase();
    // A unit follows a digit, a bracket or a space; otherwise its letters are the end of a name.
    let before =
        |unit: &str| lower.strip_suffix(unit).filter(|n| unit.is_empty() || n.ends_with(|c: char| !is_name(c)));
    let at = units.iter().position(|(unit, _)| before(unit).is_some())?;
    let (unit, factor) = units.get(at).copied()?;
    let number = before(unit)?.trim_end();
    let (whole, part) = number.split_once('.').unwrap_or((number, ""));
    let digits = |text: &str| text.bytes().all(|c| c.is_ascii_digit() || c == b'_');
    let n = if digits(whole) && digits(part) {
        let (whole, part) = (whole.replace('_', ""), part.replace('_', ""));
        let scale = 10u64.checked_pow(part.len() as u32)?;
        let parts = format!("{whole}{part}").parse::<u64>().ok()?.checked_mul(factor)?;
        parts.is_multiple_of(scale).then_some(parts / scale)?
    } else if number.starts_with(|c: char| c.is_ascii_digit()) && !number.contains(['+', '-', '*', '/', '<', '>', ' '])
    {
        return None;
    } else {
        u64::try_from(asm.evaluate_number(call.text, all.start..all.start + number.len())?).ok()?.checked_mul(factor)?
    };
    (n > 0).then_some((n, at))
}

/// Reports whether a character belongs to a name and is not a digit.
fn is_name(c: char) -> bool {
    c.is_ascii_alphabetic() || c == '_'
}
