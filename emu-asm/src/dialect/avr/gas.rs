//! The less common directives of the GNU assembler ("Using as", "Assembler Directives").

use super::super::common::{Alignment, align_to, required_arguments, value_of};
use super::super::{AsmDirective, ReadFlow};
use super::{AVR, enter};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{cut, trim};
use crate::number::read_string;

/// The section of `.struct` and `.offset`, in which labels are numbers.
pub(super) const ABSOLUTE: &str = "*ABS*";

/// The directives, without a dot.
#[rustfmt::skip]
pub(super) const DIRECTIVES: &[AsmDirective] = &[
    AsmDirective::run("quad", quads),
    AsmDirective::run("8byte", |asm, call| integers(asm, call, 8)),
    AsmDirective::run("octa", |asm, call| integers(asm, call, 16)),
    AsmDirective::run("dc", |asm, call| integers(asm, call, 2)),
    AsmDirective::run("dc.b", super::super::common::bytes),
    AsmDirective::run("dc.w", |asm, call| integers(asm, call, 2)),
    AsmDirective::run("dc.l", |asm, call| integers(asm, call, 4)),
    AsmDirective::run("dcb", |asm, call| blocks(asm, call, 2)),
    AsmDirective::run("dcb.b", |asm, call| blocks(asm, call, 1)),
    AsmDirective::run("dcb.w", |asm, call| blocks(asm, call, 2)),
    AsmDirective::run("dcb.l", |asm, call| blocks(asm, call, 4)),
    AsmDirective::run("ds", |asm, call| blocks(asm, call, 2)),
    AsmDirective::run("ds.b", |asm, call| blocks(asm, call, 1)),
    AsmDirective::run("ds.w", |asm, call| blocks(asm, call, 2)),
    AsmDirective::run("ds.l", |asm, call| blocks(asm, call, 4)),
    AsmDirective::run("sleb128", |asm, call| leb128(asm, call, true)),
    AsmDirective::run("uleb128", |asm, call| leb128(asm, call, false)),
    AsmDirective::run("string16", |asm, call| wide_text(asm, call, 2)),
    AsmDirective::run("string32", |asm, call| wide_text(asm, call, 4)),
    AsmDirective::run("string64", |asm, call| wide_text(asm, call, 8)),
    AsmDirective::run("incbin", incbin),
    AsmDirective::run("align", |asm, call| align(asm, call, true, 1)),
    AsmDirective::run("p2align", |asm, call| align(asm, call, true, 1)),
    AsmDirective::run("p2alignw", |asm, call| align(asm, call, true, 2)),
    AsmDirective::run("p2alignl", |asm, call| align(asm, call, true, 4)),
    AsmDirective::run("balign", |asm, call| align(asm, call, false, 1)),
    AsmDirective::run("balignw", |asm, call| align(asm, call, false, 2)),
    AsmDirective::run("balignl", |asm, call| align(asm, call, false, 4)),
    AsmDirective::run("struct", absolute),
    AsmDirective::run("offset", absolute),
    AsmDirective::run("subsection", |asm, call| {
        asm.out.previous = asm.out.current;
        super::enter_part(asm, call, trim(call.text, call.rest.clone()));
    }),
    AsmDirective::run("err", stop),
    AsmDirective::run("abort", stop),
    AsmDirective::flow("ifeqs", ReadFlow::If(|asm, call| texts_alike(asm, call) == Some(true))),
    AsmDirective::flow("ifnes", ReadFlow::If(|asm, call| texts_alike(asm, call) == Some(false))),
    AsmDirective::run("altmacro", |asm, _| asm.dialect = &super::ALTERNATE),
    AsmDirective::run("noaltmacro", |asm, _| asm.dialect = &AVR),
];

/// Directives without effect on the bytes.
#[rustfmt::skip]
pub(super) const WITHOUT_EFFECT: &[&str] = &[
    "version", "gnu_attribute", "line", "eject", "psize", "sbttl", "lflags", "cfi_sections", "cfi_def_cfa",
    "cfi_def_cfa_register", "cfi_def_cfa_offset", "cfi_adjust_cfa_offset", "cfi_offset", "cfi_val_offset", "cfi_rel_offset", "cfi_register",
    "cfi_restore", "cfi_undefined", "cfi_same_value", "cfi_remember_state", "cfi_restore_state", "cfi_return_column", "cfi_signal_frame",
    "cfi_window_save", "cfi_escape", "cfi_personality", "cfi_lsda",
];

/// Parses a number that may be wider than an ordinary value. `None` unless `text` is hexadecimal or decimal
/// digits.
fn long_number(text: &str) -> Option<Result<u128, ()>> {
    let lower = text.to_ascii_lowercase();
    let (digits, radix) = lower.strip_prefix("0x").map_or((lower.as_str(), 10), |digits| (digits, 16));
    // A number that begins with 0 is octal; the ordinary reader takes it.
    let plain =
        !digits.is_empty() && digits.chars().all(|c| c.is_digit(radix)) && (radix == 16 || !digits.starts_with('0'));
    plain.then(|| u128::from_str_radix(digits, radix).map_err(|_| ()))
}

/// Values of eight bytes each.
pub(super) fn quads(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    integers(asm, call, 8);
}

/// Values of `size` bytes each, low byte first.
fn integers(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, size: usize) {
    for part in required_arguments(asm, call) {
        let n = match long_number(call.get(part.clone())).filter(|_| size > 4) {
            Some(Ok(n)) if size == 16 || n >> 64 == 0 => n as i128,
            Some(_) => {
                let cause = format!("`{}` has more than {} bits", call.get(part.clone()), 8 * size);
                asm.report(LineFault::new("ASM010", part, cause, "give a smaller number, or its bytes with .byte"));
                continue;
            }
            None if size > 4 => asm.evaluate(call.text, part.clone()).map_or(0, |value| value.number).into(),
            None => value_of(asm, call.text, part.clone(), 8 * size as u32).into(),
        };
        asm.emit(n.to_le_bytes().get(..size).unwrap_or_default(), part);
    }
}

/// `.dcb.w count, value` and `.ds.w count, value`: values of `size` bytes each, 0 if no value is given.
fn blocks(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, size: usize) {
    let mut parts = required_arguments(asm, call).into_iter();
    let (Some(count), value) = (parts.next(), parts.next()) else { return };
    let Some(n) = asm.evaluate_number(call.text, count.clone()) else { return };
    if !(0..=0x40_0000).contains(&n) {
        let cause = format!("{n} values cannot be given");
        return asm.report(LineFault::new("ASM003", count, cause, "give a number from 0 to the size of the memory"));
    }
    let value = value.map_or(0, |part| value_of(asm, call.text, part, 8 * size as u32));
    let one = value.to_le_bytes();
    asm.emit(&one.get(..size).unwrap_or_default().repeat(n as usize), count);
}

/// Emits LEB128: groups of 7 bits, the lowest first; bit 7 of a byte is set if another byte follows.
fn leb128(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, signed: bool) {
    for part in required_arguments(asm, call) {
        let mut left = asm.evaluate(call.text, part.clone()).map_or(0, |value| value.number);
        let mut bytes = Vec::new();
        loop {
            let low = (left & 0x7F) as u8;
            left = if signed { left >> 7 } else { ((left as u64) >> 7) as i64 };
            let sign = if signed && low & 0x40 != 0 { -1 } else { 0 };
            if left == sign {
                bytes.push(low);
                break;
            }
            bytes.push(low | 0x80);
        }
        asm.emit(&bytes, part);
    }
}

/// Text in which each character takes `size` bytes, with a terminating 0.
fn wide_text(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, size: usize) {
    for part in required_arguments(asm, call) {
        let Some(mut text) = read_string(call.text, part.start, part.end) else {
            let cause = format!("`{}` is not a text in quotes", call.get(part.clone()));
            asm.report(LineFault::new("ASM011", part, cause, "write it as \"text\""));
            continue;
        };
        text.push(0);
        let wide = |byte: u8| u64::from(byte).to_le_bytes().into_iter().take(size);
        let bytes: Vec<u8> = text.into_iter().flat_map(wide).collect();
        asm.emit(&bytes, part);
    }
}

/// `.incbin "file", skip, count`: the bytes of a file.
fn incbin(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = required_arguments(asm, call);
    let Some(first) = parts.first() else { return };
    let mut number = |i: usize| -> Option<i64> {
        let part = parts.get(i).filter(|part| !part.is_empty())?;
        asm.evaluate_number(call.text, part.clone()).map(|n| n.max(0))
    };
    let (skip, count) = (number(1).unwrap_or(0) as usize, number(2));
    let name = call.get(first.clone()).trim_matches('"');
    let Some(bytes) = asm.binary(name, first.clone()) else { return };
    let rest = bytes.get(skip..).unwrap_or_default();
    let count = count.map_or(rest.len(), |count| count as usize);
    match rest.get(..count) {
        Some(part) if skip <= bytes.len() => asm.emit(part, first.clone()),
        _ => {
            let cause = format!("`{name}` has {} bytes, and more are asked for", bytes.len());
            asm.report(LineFault::new("ASM003", first.clone(), cause, "skip fewer bytes, or give a smaller count"));
        }
    }
}

/// `.align n, fill, most`: advances to the next multiple of `n`, or of 2 to the power of `n` if `power`. The
/// fill pattern has `size` bytes.
fn align(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, power: bool, size: usize) {
    let parts = required_arguments(asm, call);
    let Some(n) = parts.first().and_then(|part| asm.evaluate_number(call.text, part.clone())) else { return };
    let step = if power { u32::try_from(n).ok().filter(|n| *n < 20).map_or(0, |n| 1i64 << n) } else { n.max(1) };
    if step <= 0 || step > 1 << 20 || !(step as u64).is_power_of_two() {
        let cause = format!("{n} is not an alignment");
        return asm.report(LineFault::new("ASM003", call.rest.clone(), cause, "give a number such as 2"));
    }
    let given = |i: usize| parts.get(i).filter(|part| !part.is_empty()).cloned();
    let fill = given(1).map_or(0, |part| value_of(asm, call.text, part, 8 * size as u32));
    let most = given(2).and_then(|part| asm.evaluate_number(call.text, part)).filter(|most| *most > 0);
    align_to(asm, call, &Alignment { step, fill, size, most });
}

/// `.struct 0` and `.offset 0`: labels are numbers from here until another section begins.
fn absolute(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let at = if rest.is_empty() { Some(0) } else { asm.evaluate_number(call.text, rest) };
    enter(asm, call, ABSOLUTE);
    asm.out.set_address(at.unwrap_or(0));
}

/// `.err` and `.abort`.
fn stop(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let cause = format!("`{}` ends the program here", call.get(call.word.clone()));
    asm.report(LineFault::new("ASM024", call.word.clone(), cause, "the program itself says so"));
}

/// `.ifeqs "a", "b"`.
fn texts_alike(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> Option<bool> {
    let texts: Vec<_> = cut(asm.dialect, call.text, call.rest.clone())
        .into_iter()
        .map(|part| read_string(call.text, part.start, part.end))
        .collect();
    if let [Some(one), Some(other)] = texts.as_slice() {
        return Some(one == other);
    }
    let cause = format!("`{}` needs two texts in quotes", call.get(call.word.clone()));
    asm.report(LineFault::new("ASM023", call.word.clone(), cause, "write `.ifeqs \"one\", \"other\"`"));
    None
}
