//! The less common directives of sdas8051 (`asmain.c` and `asmcro.c` of SDCC 4.2).

use super::super::common::{constant, purge, required_arguments};
use super::super::{AsmDirective, ReadFlow};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{behind_name, byte, cut, skip_space, trim};
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

/// A comparison of a value with 0.
type ZeroComparison = fn(i64) -> bool;

/// The comparisons by the words of `.if`.
#[rustfmt::skip]
const COMPARISONS: &[(&str, ZeroComparison)] = &[
    ("eq", |n| n == 0), ("ne", |n| n != 0), ("gt", |n| n > 0), ("lt", |n| n < 0), ("ge", |n| n >= 0), ("le", |n| n <= 0),
];

/// The directives, without a dot.
#[rustfmt::skip]
pub(super) const DIRECTIVES: &[AsmDirective] = &[
    AsmDirective::named("gblequ", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
    AsmDirective::named("lclequ", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
    AsmDirective::named("=:", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
    AsmDirective::named("==:", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
    AsmDirective::run("bndry", boundary),
    AsmDirective::run("mdelete", purge),
    AsmDirective::run("narg", |asm, call| define_quantity(asm, call, |asm, _| asm.arguments_given())),
    AsmDirective::run("nchr", |asm, call| define_quantity(asm, call, |_, text| Some(inside(text).chars().count() as i64))),
    AsmDirective::run("ntyp", measure_type),
    AsmDirective::run("nval", |asm, call| measure_value(asm, call, |value| value.number)),
    AsmDirective::flow("ift", ReadFlow::Within(|holds| holds)),
    AsmDirective::flow("iff", ReadFlow::Within(|holds| !holds)),
    AsmDirective::flow("iftf", ReadFlow::Within(|_| true)),
    AsmDirective::flow("iift", ReadFlow::WithinLine(|holds| holds)),
    AsmDirective::flow("iiff", ReadFlow::WithinLine(|holds| !holds)),
    AsmDirective::flow("iiftf", ReadFlow::WithinLine(|_| true)),
    AsmDirective::run("iif", run_one_line_if),
    AsmDirective::run("iifne", |asm, call| run_one_line(asm, call, |n| n != 0)),
    AsmDirective::run("iifeq", |asm, call| run_one_line(asm, call, |n| n == 0)),
    AsmDirective::run("iifgt", |asm, call| run_one_line(asm, call, |n| n > 0)),
    AsmDirective::run("iiflt", |asm, call| run_one_line(asm, call, |n| n < 0)),
    AsmDirective::run("iifge", |asm, call| run_one_line(asm, call, |n| n >= 0)),
    AsmDirective::run("iifle", |asm, call| run_one_line(asm, call, |n| n <= 0)),
];

/// Splits `eq,value`, a condition of `.if` and `.iif`: returns its comparison with 0, and the position of the
/// value. The comma may be missing. sdas8051 does not take these words as names there.
fn split_comparison(text: &str, at: usize) -> Option<(ZeroComparison, usize)> {
    let start = skip_space(text, at);
    let end = behind_name(text, start, false);
    let word = text.get(start..end)?.to_ascii_lowercase();
    let (_, holds) = COMPARISONS.iter().find(|(name, _)| *name == word)?;
    let comma = skip_space(text, end);
    Some((*holds, comma + usize::from(byte(text, comma) == b',')))
}

/// Evaluates the condition `eq,value` of a source for sdas8051; `None` if it has another form.
pub(super) fn compared(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> Option<bool> {
    let (holds, at) = split_comparison(call.text, call.rest.start).filter(|_| asm.dialect.hooks.is_sdas)?;
    Some(asm.evaluate_number(call.text, at..call.rest.end.max(at)).is_some_and(|n| holds(i64::from(n as i32))))
}

/// `.iif eq,value statement`: as `.iifeq value statement`.
fn run_one_line_if(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    match split_comparison(call.text, call.rest.start).filter(|_| asm.dialect.hooks.is_sdas) {
        Some((holds, at)) => {
            let rest = at..call.rest.end.max(at);
            run_one_line(asm, &DirectiveCall { rest, label: None, word: call.word.clone(), ..*call }, holds);
        }
        None => run_one_line(asm, call, |n| n != 0),
    }
}

/// `.iif condition, statement`: reads the statement only if the condition holds.
fn run_one_line(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, holds: ZeroComparison) {
    let Some((value, behind)) = asm.front_value(call.text, call.rest.clone()) else { return };
    let comma = skip_space(call.text, behind);
    let from = comma + usize::from(byte(call.text, comma) == b',');
    if holds(if value.is_unknown { 0 } else { i64::from(value.number as i32) }) {
        asm.inner_statement(call, from);
    }
}

/// Advances to the next multiple of a number, counted from the start of the area.
fn boundary(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(step) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    if !(1..=0x1_0000).contains(&step) {
        let at = trim(call.text, call.rest.clone());
        return asm.report(LineFault::new(
            "ASM003",
            at,
            format!("{step} is not a boundary"),
            "give a number such as 2",
        ));
    }
    let here = asm.out.next_address();
    let base = asm.out.initial_sections.get(asm.out.current).map_or(0, |first| first.pos);
    asm.out.set_address(here + (base - here).rem_euclid(step));
}

/// Returns the text of an argument without its delimiters: `^/text/`.
fn inside(text: &str) -> &str {
    let mut chars = text.chars();
    let delimited = chars.next() == Some('^');
    match chars.next() {
        Some(mark) if delimited => chars.as_str().split(mark).next().unwrap_or_default(),
        _ => text,
    }
}

/// `.narg name` and `.nchr name, text`: define the name as a number.
fn define_quantity(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, of: fn(&Assembler<'_>, &str) -> Option<i64>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let Some(name) = parts.first().cloned() else {
        required_arguments(asm, call);
        return;
    };
    let given = call.get(parts.get(1).map_or(name.end..call.rest.end, |second| second.start..call.rest.end));
    match of(asm, given.trim()) {
        Some(n) => asm.define_symbol(call.get(name.clone()), AsmValue::of(n), AsmSymbolKind::Set, name),
        None => {
            let cause = format!("`{}` is outside of a macro", call.get(call.word.clone()));
            asm.report(LineFault::new(
                "ASM013",
                call.word.clone(),
                cause,
                "it counts the arguments of the macro that contains it",
            ));
        }
    }
}

/// `.ntyp name, value`: 0 for a number, 1 for an address.
fn measure_type(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    measure_value(asm, call, |value| i64::from(value.is_label));
}

/// `.nval name, value`.
fn measure_value(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, of: fn(AsmValue) -> i64) {
    let parts = required_arguments(asm, call);
    let [name, value] = parts.as_slice() else {
        let cause = format!("`{}` needs a name and a value", call.get(call.word.clone()));
        return asm.report(LineFault::new("ASM023", call.word.clone(), cause, "write the name, a comma and the value"));
    };
    let Some(value) = asm.evaluate(call.text, value.clone()) else { return };
    let measured = AsmValue { is_unknown: value.is_unknown, ..AsmValue::of(of(value)) };
    asm.define_symbol(call.get(name.clone()), measured, AsmSymbolKind::Set, name.clone());
}
