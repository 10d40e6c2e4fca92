//! Sections of ASM51 (`cseg at 0`), and segments of AX51 that BL51 places (`prog segment code`, `rseg prog`).

use std::ops::Range;

use super::super::common::constant;
use super::area;
use super::layout::{AreaMemory, AreaShape, SegmentClass};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{begins_name, behind_name, byte, skip_space, trim};
use crate::symbols::AsmSymbolKind;

/// `dseg`, `dseg at 30h`.
pub(super) fn absolute(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) {
    area::leave_area(asm);
    let _ = asm.out.enter_named(name);
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    if let Some(at) = written.get(..2).filter(|at| at.eq_ignore_ascii_case("at"))
        && let Some(n) = asm.evaluate_address(call.text, rest.start + at.len()..rest.end)
    {
        asm.out.set_address(n);
    }
    area::begin_fixed(asm);
}

/// `code at 100h` and `code` without a name before them: begins a section, as `cseg` does. Returns false for
/// anything else.
pub(super) fn begins(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) -> bool {
    let written = call.get(trim(call.text, call.rest.clone())).to_ascii_lowercase();
    let is_it =
        call.label.is_none() && (written.is_empty() || written.starts_with("at ") || written.starts_with("at\t"));
    if is_it {
        absolute(asm, call, name);
    }
    is_it
}

/// `name code address`, and `code at 100h`.
pub(super) fn place(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) {
    if !begins(asm, call, name) {
        constant(asm, call, AsmSymbolKind::Equ);
    }
}

/// Returns the position of the word `at` in the class of a segment.
fn find_at(text: &str, rest: Range<usize>) -> Option<Range<usize>> {
    let mut at = rest.start;
    while at < rest.end {
        at = skip_space(text, at);
        let end = behind_name(text, at, false).max(at + 1);
        if text.get(at..end).is_some_and(|word| word.eq_ignore_ascii_case("at")) {
            return Some(at..end);
        }
        at = end;
    }
    None
}

/// `name segment code inpage`, `name segment code at 200h`.
pub(super) fn segment(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(label) = call.label.clone() else {
        let hint = "write `name segment code`";
        return asm.report(LineFault::new("ASM023", call.word.clone(), "`segment` needs a name before it", hint));
    };
    let mut shape = AreaShape { name: call.get(label.clone()).to_owned(), ..AreaShape::default() };
    let (mut class, mut memory) = (SegmentClass::default(), None);
    let mut end = call.rest.end;
    if let Some(at) = find_at(call.text, call.rest.clone()) {
        class.at = asm.evaluate_address(call.text, at.end..end);
        end = at.start;
    }
    for word in call.get(call.rest.start..end).split_whitespace() {
        match word.to_ascii_uppercase().as_str() {
            "CODE" | "CONST" => memory = Some(AreaMemory::Code),
            "DATA" => memory = Some(AreaMemory::Data),
            "XDATA" | "PDATA" => memory = Some(AreaMemory::Xdata),
            "BIT" => memory = Some(AreaMemory::Bit),
            "IDATA" => (memory, class.indirect) = (Some(AreaMemory::Data), true),
            "BITADDRESSABLE" => class.bits = true,
            "WORD" => class.align = 2,
            "DWORD" => class.align = 4,
            "PAGE" => class.align = 0x100,
            "BLOCK" => class.align = 0x800,
            "INPAGE" => class.within = 0x100,
            "INBLOCK" => class.within = 0x800,
            // All 64 KB are one segment.
            "UNIT" | "OVERLAYABLE" | "BYTE" | "SEG" | "INSEG" => {}
            upper => return refuse_class(asm, call, word, upper),
        }
    }
    let Some(memory) = memory else {
        let hint = "write CODE, DATA, IDATA, XDATA or BIT after it";
        return asm.report(LineFault::new("ASM023", call.word.clone(), "the segment has no class", hint));
    };
    (shape.memory, shape.class) = (memory, Some(class));
    if area::segment(asm, &shape.name).is_none() {
        area::add(asm, shape, label);
    }
}

/// Classes of AX51 for memories beyond 64 KB, and the class for the same contents within them.
const FAR_CLASSES: &[(&str, &str)] = &[
    ("ECODE", "CODE"),
    ("HCONST", "CODE"),
    ("NCONST", "CODE"),
    ("HDATA", "XDATA"),
    ("EDATA", "IDATA"),
    ("NDATA", "IDATA"),
    ("EBIT", "BIT"),
];

/// Reports a word after `segment` that this chip does not have.
fn refuse_class(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, word: &str, upper: &str) {
    let (cause, hint) = match FAR_CLASSES.iter().find(|(far, _)| *far == upper) {
        Some((_, near)) => (
            format!("the class `{word}` is for chips with more than 64 KB, and the {} has no such memory", asm.chip.name),
            format!("write {near}"),
        ),
        None => (
            format!("`{word}` is not a class of a segment"),
            "there are CODE, DATA, IDATA, XDATA and BIT, with UNIT, BYTE, WORD, DWORD, PAGE, BLOCK, INPAGE, INBLOCK, BITADDRESSABLE, OVERLAYABLE".to_owned(),
        ),
    };
    asm.report(LineFault::new("ASM023", trim(call.text, call.rest.clone()), cause, hint));
}

/// `rseg name`.
pub(super) fn rseg(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let name = call.get(rest.clone());
    match area::segment(asm, name) {
        Some(number) => {
            area::leave_area(asm);
            area::enter_area(asm, number);
        }
        None => {
            let at = if rest.is_empty() { call.word.clone() } else { rest };
            let hint = "give it before, as in `prog segment code`";
            asm.report(LineFault::new("ASM023", at, format!("there is no segment `{name}`"), hint));
        }
    }
}

/// `extrn code (a, b), bit (c)`: declares names of other modules.
pub(super) fn extrn(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = call.get(call.rest.clone());
    let (mut at, mut open) = (0, !rest.contains('('));
    while at < rest.len() {
        let end = behind_name(rest, at, false);
        match byte(rest, at) {
            b'(' => open = true,
            b')' => open = false,
            c if begins_name(c) && open => {
                let name = rest.get(at..end).unwrap_or_default().to_ascii_lowercase();
                asm.family_state.mcs51.declared_externals.insert(name);
            }
            _ => {}
        }
        at = end.max(at + 1);
    }
}

/// `name proc`: defines a label.
pub(super) fn procedure(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    place_label(asm, call, "write `name proc`, and `name endp` after it");
}

/// `name label near`: defines a label.
pub(super) fn label(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    place_label(asm, call, "write `name label near`");
}

/// Defines the label before the word. Only labels within 64 KB exist.
fn place_label(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, hint: &str) {
    let word = call.get(call.word.clone());
    let Some(label) = call.label.clone() else {
        let cause = format!("`{word}` needs a name before it");
        return asm.report(LineFault::new("ASM023", call.word.clone(), cause, hint));
    };
    let kind = trim(call.text, call.rest.clone());
    let written = call.get(kind.clone());
    if !written.is_empty() && !written.eq_ignore_ascii_case("near") {
        let cause = format!("`{written}` is not a kind of `{word}` on the {}: all code is near", asm.chip.name);
        return asm.report(LineFault::new("ASM023", kind, cause, "leave it out, or write NEAR"));
    }
    asm.define_label(call.get(label.clone()), label);
}
