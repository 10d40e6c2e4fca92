//! The AVR dialect of avr-as, with those directives of Atmel's assembler that do not contradict it.

pub(crate) mod atmel;
mod atmel_names;
mod commons;
mod gas;
mod sfr;

use std::ops::Range;

use emu_core::chip::Chip;
use emu_core::image::CONSTANT_SPACE;
use emu_core::table::InstructionRow;

use super::common::{constant, ignore_directive, purge, required_arguments, space, value_of};
use super::{
    AsmDialect, AsmDirective, AsmOperator, DialectHooks, NumberForm, ProvidedInclude, ReadFlow, SectionContent,
    SectionRow,
};
pub(crate) use commons::AvrPassState;

use crate::NamedText;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{byte, cut, trim};
use crate::symbols::AsmSymbolKind;

/// The highest number of a subsection.
const LAST_PART: u16 = 8192;
/// The largest number of sections that `.pushsection` keeps.
const KEPT: usize = 1000;

/// The dialect.
#[rustfmt::skip]
pub(super) const AVR: AsmDialect = AsmDialect {
    comments: &[";", "//"],
    line_comments: &["#", "*"],
    separators: b"$",
    block_comments: true,
    labels_in_column_one: false,
    warns_in_column_one: false,
    numbers: &[NumberForm::Hex0x, NumberForm::Binary0b, NumberForm::HexDollar, NumberForm::OctalZero, NumberForm::Plain],
    radix: 10,
    dot_is_bit: false,
    location_counter_names: &["."],
    counter_at_line_start: false,
    counter_after_instruction: true,
    // Precedence of the GNU assembler.
    operators: &[
        ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod), ("<<", 10, AsmOperator::Shl), (">>", 10, AsmOperator::Shr),
        ("|", 8, AsmOperator::Or), ("&", 8, AsmOperator::And), ("^", 8, AsmOperator::Xor), ("!", 8, AsmOperator::OrNot),
        ("+", 6, AsmOperator::Add), ("-", 6, AsmOperator::Sub),
        ("==", 5, AsmOperator::Equal), ("!=", 5, AsmOperator::Unequal), ("<>", 5, AsmOperator::Unequal),
        ("<", 5, AsmOperator::Less), ("<=", 5, AsmOperator::LessEqual), (">", 5, AsmOperator::Greater), (">=", 5, AsmOperator::GreaterEqual),
        ("&&", 3, AsmOperator::BothTrue), ("||", 2, AsmOperator::EitherTrue),
    ],
    unary: &[
        ("-", 12, |n| n.wrapping_neg()), ("+", 12, |n| n), ("~", 12, |n| !n), ("!", 12, |n| i64::from(n == 0)),
        ("lo8", 12, |n| n & 0xFF), ("hi8", 12, |n| n >> 8 & 0xFF), ("hh8", 12, |n| n >> 16 & 0xFF),
        ("hlo8", 12, |n| n >> 16 & 0xFF), ("hhi8", 12, |n| n >> 24 & 0xFF),
        ("low", 12, |n| n & 0xFF), ("high", 12, |n| n >> 8 & 0xFF), ("byte2", 12, |n| n >> 8 & 0xFF),
        ("byte3", 12, |n| n >> 16 & 0xFF),
        ("pm", 12, |n| n >> 1), ("gs", 12, |n| n >> 1), ("pm_lo8", 12, |n| n >> 1 & 0xFF), ("pm_hi8", 12, |n| n >> 9 & 0xFF),
        ("pm_hh8", 12, |n| n >> 17 & 0xFF), ("lo8_gs", 12, |n| n >> 1 & 0xFF), ("hi8_gs", 12, |n| n >> 9 & 0xFF),
    ],
    true_value: -1,
    arithmetic: super::AsmArithmetic::Signed,
    controls: false,
    numbered_labels: true,
    dollar_labels: false,
    ignores_case: false,
    plain_arguments: false,
    big_endian: false,
    org_fills: Some(0),
    spaced_arguments: true,
    space_fills: true,
    zones: false,
    literals: &[],
    hooks: DialectHooks { check: check_constant, names_io_addresses: sfr::names_io_addresses, own_name_value: sfr::default_offset, ignored_dotted: gas::WITHOUT_EFFECT, more: gas::DIRECTIVES, ..DialectHooks::NONE },
    directives: &[
        AsmDirective::run("skip", space),
        AsmDirective::run("zero", space),
        AsmDirective::run("fill", fill),
        AsmDirective::run("string", |asm, call| super::common::text(asm, call, true)),
        AsmDirective::run("2byte", super::common::words),
        AsmDirective::run("short", super::common::words),
        AsmDirective::run("hword", super::common::words),
        AsmDirective::run("long", longs),
        AsmDirective::run("4byte", longs),
        AsmDirective::run("int", longs),
        AsmDirective::run("text", |asm, call| section(asm, call, "text")),
        AsmDirective::run("data", |asm, call| section(asm, call, "data")),
        AsmDirective::run("bss", |asm, call| section(asm, call, "bss")),
        AsmDirective::run("section", section_named),
        AsmDirective::run("pushsection", push_section),
        AsmDirective::run("popsection", pop_section),
        AsmDirective::run("previous", |asm, _| asm.out.enter_previous()),
        AsmDirective::run("cseg", |asm, call| atmel::segment(asm, call, "text")),
        AsmDirective::run("dseg", |asm, call| atmel::segment(asm, call, "dseg")),
        AsmDirective::run("eseg", |asm, call| atmel::segment(asm, call, "eeprom")),
        AsmDirective::run("include", sfr::including),
        AsmDirective::named("equ", atmel::equate),
        AsmDirective::named("def", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
        AsmDirective::run("comm", |asm, call| commons::common(asm, call, "COMMON")),
        AsmDirective::run("lcomm", |asm, call| commons::common(asm, call, "bss")),
        AsmDirective::run("local", commons::local),
        AsmDirective::flow("endmacro", ReadFlow::Endm),
        AsmDirective::run("global", ignore_directive),
        AsmDirective::run("globl", ignore_directive),
        AsmDirective::run("extern", ignore_directive),
        AsmDirective::run("weak", ignore_directive),
        AsmDirective::run("type", ignore_directive),
        AsmDirective::run("size", ignore_directive),
        AsmDirective::run("file", ignore_directive),
        AsmDirective::run("ident", ignore_directive),
        AsmDirective::run("func", ignore_directive),
        AsmDirective::run("endfunc", ignore_directive),
        AsmDirective::run("arch", ignore_directive),
        AsmDirective::run("device", |asm, _| atmel::switch(asm)),
        AsmDirective::run("loc", ignore_directive),
        AsmDirective::run("list", ignore_directive),
        AsmDirective::run("nolist", ignore_directive),
        AsmDirective::run("title", ignore_directive),
        AsmDirective::named("equiv", |asm, call| constant(asm, call, AsmSymbolKind::Equ)),
        AsmDirective::run("string8", |asm, call| super::common::text(asm, call, true)),
        AsmDirective::run("float", no_float),
        AsmDirective::run("single", no_float),
        AsmDirective::run("double", no_float),
        AsmDirective::run("print", print),
        AsmDirective::run("purgem", purge),
        AsmDirective::run("hidden", ignore_directive),
        AsmDirective::run("internal", ignore_directive),
        AsmDirective::run("protected", ignore_directive),
        AsmDirective::run("stabs", ignore_directive),
        AsmDirective::run("stabn", ignore_directive),
        AsmDirective::run("stabd", ignore_directive),
        AsmDirective::run("cfi_startproc", ignore_directive),
        AsmDirective::run("cfi_endproc", ignore_directive),
    ],
    include_provided: provides,
    predefined: defines,
    refuse_instruction: |_, _| None,
    finish_pass: |_| (),
    sections: SECTIONS,
};

/// The dialect after `.altmacro`: macro arguments are replaced by their bare names, may be in angle brackets,
/// and `%` gives their values.
const ALTERNATE: AsmDialect = AsmDialect {
    plain_arguments: true,
    hooks: DialectHooks { angle_arguments: true, ..AVR.hooks },
    finish_pass: |asm| asm.dialect = &AVR,
    ..AVR
};

/// The sections in the order of avr-ld's script.
const SECTIONS: &[SectionRow] = &[
    text("vectors", 1),
    text("progmem.gcc*", 1),
    text("trampolines", 2),
    text("trampolines*", 1),
    text("progmem*", 1),
    text("jumptables", 2),
    text("jumptables*", 1),
    text("lowtext", 1),
    text("lowtext*", 1),
    text("init0", 1),
    text("init1", 1),
    text("init2", 1),
    text("init3", 1),
    text("init4", 1),
    text("init5", 1),
    text("init6", 1),
    text("init7", 1),
    text("init8", 1),
    text("init9", 1),
    text("text", 1),
    text("text.*", 2),
    text("fini9", 2),
    text("fini8", 1),
    text("fini7", 1),
    text("fini6", 1),
    text("fini5", 1),
    text("fini4", 1),
    text("fini3", 1),
    text("fini2", 1),
    text("fini1", 1),
    text("fini0", 1),
    ram("data", SectionContent::Copied, 1),
    ram("data*", SectionContent::Copied, 1),
    ram("rodata", SectionContent::Copied, 1),
    ram("rodata*", SectionContent::Copied, 1),
    ram("bss", SectionContent::Addresses, 2),
    ram("bss*", SectionContent::Addresses, 1),
    ram("COMMON", SectionContent::Addresses, 1),
    ram("noinit*", SectionContent::Addresses, 1),
    ram("dseg", SectionContent::Addresses, 1),
    other("eeprom", "eeprom*"),
    other("fuse", "fuse"),
    other("fuse", "lfuse"),
    other("fuse", "hfuse"),
    other("fuse", "efuse"),
    other("lock", "lock*"),
    other("signature", "signature*"),
    SectionRow {
        name: gas::ABSOLUTE,
        space: CONSTANT_SPACE,
        content: SectionContent::Addresses,
        align_after_previous: None,
    },
];

const fn text(name: &'static str, align: i64) -> SectionRow {
    SectionRow { name, space: "", content: SectionContent::Image, align_after_previous: Some(align) }
}

const fn ram(name: &'static str, holds: SectionContent, align: i64) -> SectionRow {
    SectionRow { name, space: "data", content: holds, align_after_previous: Some(align) }
}

const fn other(space: &'static str, name: &'static str) -> SectionRow {
    SectionRow { name, space, content: SectionContent::Memory, align_after_previous: Some(1) }
}

/// Warns about a constant below -255: its lower 8 bits are used, as avr-as does.
fn check_constant(row: &InstructionRow, values: &[(i32, Range<usize>)]) -> Option<LineFault> {
    let slots = row.operands.iter().filter(|slot| row.pattern.has_letter(slot.letter));
    let (_, (n, at)) = slots.zip(values).find(|(slot, (n, _))| slot.kind.name == "constant" && *n < -0xFF)?;
    let cause = format!("{n} does not fit into 8 bits: its upper bits are dropped");
    Some(LineFault::new("ASM030", at.clone(), cause, "select the bits with & or lo8()").warning())
}

/// Returns the macros about the chip that avr-gcc defines for an assembly source.
fn defines(chip: &Chip) -> Vec<NamedText> {
    let (calls, far) = (chip.flash_bytes > 0x2000, chip.flash_bytes > 0x1_0000);
    let arch = match (calls, far) {
        (_, true) => "51",
        (true, _) => "5",
        _ => "4",
    };
    let always = ["__ASSEMBLER__", "__AVR__", "__AVR", "__AVR_2_BYTE_PC__", "__AVR_HAVE_MUL__", "__AVR_HAVE_MOVW__"];
    let more = ["__AVR_HAVE_LPMX__", "__AVR_HAVE_SPH__", "__AVR_HAVE_16BIT_SP__", "__AVR_ENHANCED__"];
    let large = ["__AVR_HAVE_JMP_CALL__", "__AVR_MEGA__"].into_iter().filter(|_| calls);
    let largest = ["__AVR_HAVE_ELPM__", "__AVR_HAVE_ELPMX__", "__AVR_HAVE_RAMPZ__"].into_iter().filter(|_| far);
    let ones = always.into_iter().chain(more).chain(large).chain(largest).map(|name| NamedText::new(name, "1"));
    let texts = [
        NamedText::new(predefined(chip.name), "1"),
        NamedText::new("__AVR_ARCH__", arch),
        NamedText::new("__AVR_DEVICE_NAME__", chip.name),
        NamedText::new("__AVR_SFR_OFFSET__", "0x20"),
    ];
    ones.chain(texts).chain(sfr::macros()).collect()
}

/// Returns the chip's macro: `__AVR_ATmega328P__`.
fn predefined(name: &str) -> String {
    match name.strip_prefix("atmega") {
        Some(rest) => format!("__AVR_ATmega{}__", rest.to_ascii_uppercase()),
        None => format!("__AVR_{name}__"),
    }
}

/// Returns what an include of `<avr/io.h>` or `m328Pdef.inc` provides.
fn provides(chip: &Chip, include: &str) -> ProvidedInclude {
    if include.starts_with("avr/") || matches!(include, "io.h" | "interrupt.h" | "pgmspace.h") {
        return ProvidedInclude::Chip;
    }
    let Some(name) = include.strip_prefix('m').and_then(|rest| rest.strip_suffix("def.inc")) else {
        return ProvidedInclude::NotProvided;
    };
    if chip.name.strip_prefix("atmega").is_some_and(|number| number == name) {
        return ProvidedInclude::Chip;
    }
    let cause = format!("`{include}` is for another chip than the {}", chip.name);
    ProvidedInclude::OtherChip(
        cause,
        format!("name that chip with --mcu atmega{name}, or include the file of this one"),
    )
}

fn section(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) {
    enter(asm, call, name);
    let rest = trim(call.text, call.rest.clone());
    if !rest.is_empty() {
        enter_part(asm, call, rest);
    }
}

/// Enters the subsection of the current section with the number at `at`. Subsections follow each other by
/// number.
fn enter_part(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, at: Range<usize>) {
    let Some(n) = asm.evaluate_number(call.text, at.clone()) else { return };
    let part = u16::try_from(n).ok().filter(|part| *part <= LAST_PART);
    if part.and_then(|part| asm.out.enter_part(part)).is_none() {
        let cause = format!("a section has no part {n}");
        asm.report(LineFault::new("ASM003", at, cause, "number parts from 0 to 8192, and not more than 1000 in all"));
    }
}

fn enter(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) {
    if asm.out.enter_named(name).is_none() {
        let cause = format!("there is no section `{name}`");
        let hint = "there are .text, .vectors, .progmem, .init0 to .fini0, .data, .rodata, .bss, .noinit, .eeprom, .fuse and .lock";
        let hint = if name.starts_with("debug") { "assemble what the compiler gives without -g" } else { hint };
        asm.report(LineFault::new("ASM023", trim(call.text, call.rest.clone()), cause, hint));
    }
}

/// `.section .eeprom,"aw"`.
fn section_named(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let written = parts.first().map_or("", |part| call.get(part.clone())).trim_matches('"');
    enter(asm, call, written.strip_prefix('.').unwrap_or(written));
    // `.pushsection .text, 2`.
    if let Some(part) = parts.get(1).filter(|part| byte(call.text, part.start).is_ascii_digit()) {
        enter_part(asm, call, part.clone());
    }
}

fn push_section(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if asm.out.section_stack.len() < KEPT {
        asm.out.section_stack.push((asm.out.current, asm.out.previous));
    }
    section_named(asm, call);
}

fn pop_section(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    match asm.out.section_stack.pop() {
        Some(kept) => (asm.out.current, asm.out.previous) = kept,
        None => {
            let cause = "no section was kept by .pushsection before";
            asm.report(LineFault::new("ASM023", call.word.clone(), cause, "remove it, or write `.section NAME`"));
        }
    }
}

fn longs(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let value = value_of(asm, call.text, part.clone(), 32) as u32;
        asm.emit(&value.to_le_bytes(), part);
    }
}

fn no_float(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let cause = format!("`{}` is not taken: numbers are whole here", call.get(call.word.clone()));
    asm.report(LineFault::new("ASM023", call.word.clone(), cause, "give the bytes of the number with .long or .byte"));
}

/// `.print "text"`.
fn print(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let text = call.get(rest.clone()).trim_matches('"');
    asm.report(LineFault::new("ASM025", rest, text, "the program itself says so").note());
}

/// `.fill count, size, value`.
fn fill(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = required_arguments(asm, call);
    let mut numbers = parts.iter().map(|part| asm.evaluate_number(call.text, part.clone()).unwrap_or(0));
    let (count, size, value) = (numbers.next().unwrap_or(0), numbers.next().unwrap_or(1), numbers.next().unwrap_or(0));
    drop(numbers);
    if !(0..=0x100_0000).contains(&count) || !(0..=8).contains(&size) {
        let cause = format!("{count} times {size} bytes cannot be filled");
        return asm.report(LineFault::new(
            "ASM003",
            call.rest.clone(),
            cause,
            "a count, a size of up to 8 bytes, and a value",
        ));
    }
    let one: Vec<u8> = value.to_le_bytes().into_iter().take(size as usize).collect();
    let all: Vec<u8> = one.iter().copied().cycle().take(one.len() * count as usize).collect();
    asm.emit(&all, call.rest.clone());
}
