//! The mid-range PIC16 dialect of gpasm and Microchip's MPASM.
//!
//! ```text
//!   pic16.rs    the dialect as data, and the names that a program defines
//!   chip.rs     the chip: list, banks, pages, configuration
//!   fields.rs   values too large for an operand field
//!   link.rs     sections of relocatable sources, and their addresses
//!   data.rs     words of all kinds: dw, db, da, de, dt, fill
//!   special.rs  mnemonics that expand to other instructions
//! ```

mod chip;
mod data;
mod fields;
mod link;
pub(crate) mod special;

use std::ops::Range;

use emu_core::table::InstructionRow;

use super::common::ignore_directive;
use super::{AsmDialect, AsmDirective, AsmOperator, DialectHooks, NumberForm, ReadFlow, SectionContent, SectionRow};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::{CauseAndHint, LineFault};
use crate::lines::{behind_name, byte, cut, trim};
use crate::reader::LineBlock;
use crate::statement::code_end;
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

pub(crate) use chip::bare_chip_name;

/// State of the dialect during a pass.
#[derive(Debug, Default)]
pub(crate) struct Pic16PassState {
    /// The value for the next name of a block of constants.
    next_constant: i64,
    /// The configuration words set by `config`.
    settings: Option<[u16; 2]>,
    /// The sections of a relocatable source, in source order.
    modules: Vec<link::ModuleSection>,
    /// The chip's include was read, so the chip's names are defined.
    includes_chip: bool,
    /// Names that `ifdef` and `ifndef` tested before they were defined.
    undefined_checks: Vec<chip::UndefinedCheck>,
    /// The source contains `list f=inhx8m`.
    pub is_inhx8m: bool,
}

/// Directives before which gpasm refuses a label, with its error 121.
#[rustfmt::skip]
const WITHOUT_LABEL: &[&str] = &[
    "if", "ifdef", "ifndef", "else", "endif", "list", "nolist", "expand", "noexpand", "include", "processor", "radix", "errorlevel", "page", "space", "messg",
    "error", "config", "__badram", "exitm", "end",
];

/// Common directives that gpasm does not have.
#[rustfmt::skip]
const FOREIGN: &[&str] = &[
    "ds", "byte", "word", "ascii", "asciz", "rept", "irp", "irpc", "endr", "warning", "undef", "undefine",
    "ifeq", "ifne", "ifgt", "ifge", "iflt", "ifle", "ifb", "ifnb", "ifc", "ifnc", "ifnotdef", "elif", "elseif",
];

/// Directives for debuggers, and the gpsim macros of gputils' `coff.inc`.
const DOTTED: &[&str] = &["line", "eof", "file", "ident", "type", "def", "dim", "direct", "sim", "assert", "command"];

/// The dialect.
#[rustfmt::skip]
pub(super) const PIC16: AsmDialect = AsmDialect {
    comments: &[";"],
    line_comments: &[],
    separators: b"",
    block_comments: false,
    labels_in_column_one: true,
    warns_in_column_one: true,
    // A hexadecimal number may end with b or d, so the forms with these suffixes come last.
    numbers: &[NumberForm::Hex0x, NumberForm::Quoted, NumberForm::DecimalDot, NumberForm::HexH, NumberForm::OctalOQ, NumberForm::Plain, NumberForm::BinaryB, NumberForm::DecimalD],
    radix: 16,
    dot_is_bit: false,
    location_counter_names: &["$"],
    counter_at_line_start: false,
    counter_after_instruction: false,
    // All comparisons have equal precedence, and so have & ^ and |.
    operators: &[
        ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod),
        ("+", 9, AsmOperator::Add), ("-", 9, AsmOperator::Sub),
        ("<<", 8, AsmOperator::Shl), (">>", 8, AsmOperator::Shr),
        (">=", 6, AsmOperator::GreaterEqual), (">", 6, AsmOperator::Greater), ("<", 6, AsmOperator::Less), ("<=", 6, AsmOperator::LessEqual),
        ("==", 6, AsmOperator::Equal), ("!=", 6, AsmOperator::Unequal),
        ("&", 5, AsmOperator::And), ("^", 5, AsmOperator::Xor), ("|", 5, AsmOperator::Or), ("&&", 2, AsmOperator::BothTrue), ("||", 1, AsmOperator::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
        ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF), ("upper", 11, |n| n >> 16 & 0xFF),
    ],
    true_value: 1,
    arithmetic: super::AsmArithmetic::Signed,
    controls: false,
    numbered_labels: false,
    dollar_labels: false,
    ignores_case: false,
    plain_arguments: true,
    big_endian: false,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: false,
    literals: &[("W", 0), ("F", 1)],
    hooks: DialectHooks { check, cut: fields::cut_to_field, drops_operands: true, ignored_dotted: DOTTED, foreign: FOREIGN, without_label: WITHOUT_LABEL, place_sections: link::place, value_names: true, is_32: true, no_bytes, ..DialectHooks::NONE },
    directives: &[
        AsmDirective::run("include", chip::include),
        AsmDirective::flow("ifdef", ReadFlow::If(|asm, call| chip::is_defined(asm, call, true))),
        AsmDirective::flow("ifndef", ReadFlow::If(|asm, call| chip::is_defined(asm, call, false))),
        AsmDirective::named("org", org),
        AsmDirective::run("dw", data::words),
        AsmDirective::run("word", data::words),
        AsmDirective::run("data", data::words),
        AsmDirective::run("db", data::bytes),
        AsmDirective::run("byte", data::bytes),
        AsmDirective::run("da", data::packed),
        AsmDirective::run("de", data::cells),
        AsmDirective::run("dt", data::table),
        AsmDirective::run("fill", data::fill),
        AsmDirective::run("res", link::reserve),
        link::section("code"), link::section("udata"), link::section("udata_shr"), link::section("udata_ovr"), link::section("idata"),
        AsmDirective::run("psect", chip::psect),
        link::section("udata_acs"), link::section("idata_acs"), link::section("code_pack"),
        AsmDirective::run("extern", link::external),
        AsmDirective::run("global", ignore_directive),
        AsmDirective::run("list", chip::list),
        AsmDirective::run("processor", chip::processor),
        AsmDirective::run("radix", chip::radix),
        AsmDirective::run("errorlevel", chip::errorlevel),
        AsmDirective::run("__config", chip::config),
        AsmDirective::run("__fuses", chip::config),
        AsmDirective::run("config", chip::settings),
        AsmDirective::run("__idlocs", chip::idlocs),
        AsmDirective::run("banksel", chip::banksel),
        AsmDirective::run("bankisel", chip::bankisel),
        AsmDirective::run("pagesel", chip::pagesel),
        AsmDirective::run("pageselw", chip::pageselw),
        special::named("skpc"), special::named("skpnc"), special::named("skpz"), special::named("skpnz"), special::named("skpdc"), special::named("skpndc"),
        special::named("setc"), special::named("clrc"), special::named("setz"), special::named("clrz"), special::named("setdc"), special::named("clrdc"),
        special::named("movfw"), special::named("tstf"), special::named("negf"), special::named("addcf"), special::named("subcf"), special::named("adddcf"), special::named("subdcf"),
        special::named("b"), special::named("bc"), special::named("bnc"), special::named("bz"), special::named("bnz"), special::named("bdc"), special::named("bndc"),
        special::named("lcall"), special::named("lgoto"),
        AsmDirective::flow("cblock", ReadFlow::Block(constants)),
        AsmDirective::flow("endc", ReadFlow::EndBlock),
        AsmDirective::flow("while", ReadFlow::While),
        AsmDirective::flow("endw", ReadFlow::Endw),
        AsmDirective::run("variable", |asm, call| each_name(asm, call, AsmSymbolKind::Set)),
        AsmDirective::run("constant", |asm, call| each_name(asm, call, AsmSymbolKind::Equ)),
        // The names themselves are replaced when the macro is called.
        AsmDirective::run("local", |asm, call| each_name(asm, call, AsmSymbolKind::Set)),
        AsmDirective::named("++", |asm, call| step(asm, call, |old, _| old.wrapping_add(1))),
        AsmDirective::named("--", |asm, call| step(asm, call, |old, _| old.wrapping_sub(1))),
        AsmDirective::named("+=", |asm, call| step(asm, call, i64::wrapping_add)),
        AsmDirective::named("-=", |asm, call| step(asm, call, i64::wrapping_sub)),
        AsmDirective::named("*=", |asm, call| step(asm, call, i64::wrapping_mul)),
        AsmDirective::named("/=", |asm, call| step(asm, call, |old, n| old.checked_div(n).unwrap_or(0))),
        AsmDirective::named("%=", |asm, call| step(asm, call, |old, n| old.checked_rem(n).unwrap_or(0))),
        AsmDirective::named("<<=", |asm, call| step(asm, call, |old, n| shift(old, n, i64::checked_shl))),
        AsmDirective::named(">>=", |asm, call| step(asm, call, |old, n| shift(old, n, i64::checked_shr))),
        AsmDirective::named("&=", |asm, call| step(asm, call, |old, n| old & n)),
        AsmDirective::named("|=", |asm, call| step(asm, call, |old, n| old | n)),
        AsmDirective::named("^=", |asm, call| step(asm, call, |old, n| old ^ n)),
        AsmDirective::run("messg", message),
        AsmDirective::run("title", ignore_directive),
        AsmDirective::run("subtitle", ignore_directive),
        AsmDirective::run("subtitl", ignore_directive),
        AsmDirective::run("stitle", ignore_directive),
        AsmDirective::run("nolist", ignore_directive),
        AsmDirective::run("page", ignore_directive),
        AsmDirective::run("space", ignore_directive),
        AsmDirective::run("expand", ignore_directive),
        AsmDirective::run("noexpand", ignore_directive),
        AsmDirective::run("__maxram", ignore_directive),
        AsmDirective::run("__badram", ignore_directive),
        AsmDirective::run("__maxrom", ignore_directive),
        AsmDirective::run("__badrom", ignore_directive),
    ],
    include_provided: chip::provides,
    predefined: chip::defines,
    refuse_instruction: |_, _| None,
    finish_pass: chip::finish,
    sections: &[SectionRow { name: "code", space: "", content: SectionContent::Image, align_after_previous: None }],
};

/// Notes a file register address of more than seven bits: the instruction holds seven, so the register is in
/// another bank.
fn check(row: &InstructionRow, values: &[(i32, Range<usize>)]) -> Option<LineFault> {
    let slots = row.operands.iter().filter(|slot| row.pattern.has_letter(slot.letter));
    let (value, at) = slots.zip(values).find(|(slot, (n, _))| slot.kind.name == "file register" && n & 0x180 != 0)?.1;
    let cause = format!("the register at 0x{value:X} is not in bank 0");
    let hint = "the instruction has the lower seven bits; `banksel` before it selects the bank";
    Some(LineFault::new("ASM042", at.clone(), cause, hint).note())
}

/// `org address`; a label before it gets the new address.
fn org(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if !asm.family_state.pic16.modules.is_empty() {
        asm.out.enter_section(link::ABSOLUTE);
    }
    super::common::org(asm, call);
    if let Some(label) = call.label.clone() {
        asm.define_label(call.get(label.clone()), label);
    }
}

/// `cblock start`: assigns consecutive numbers to the names up to `endc`: `a`, `b:2, c`.
fn constants(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, body: LineBlock) {
    if !trim(call.text, call.rest.clone()).is_empty() {
        let Some(start) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
        asm.family_state.pic16.next_constant = start;
    }
    let begun = asm.line.take();
    for line in body.iter() {
        asm.line = Some(line.clone());
        // Texts of `#define` replace their names here too.
        let put = asm.expand_defines(line, code_end(asm.dialect, &line.text));
        let line = put.as_ref().unwrap_or(line);
        asm.line = Some(line.clone());
        let put = asm.expand_value_names(line);
        let line = put.as_ref().unwrap_or(line);
        let text: &str = &line.text;
        let all = trim(text, 0..code_end(asm.dialect, text));
        for part in cut(asm.dialect, text, all).into_iter().filter(|part| !part.is_empty()) {
            let end = behind_name(text, part.start, true).min(part.end);
            let behind = trim(text, end..part.end);
            let name = text.get(part.start..end).unwrap_or_default();
            if name.is_empty() || !behind.is_empty() && byte(text, behind.start) != b':' {
                let cause =
                    format!("`{}` is not a name of a block of constants", text.get(part.clone()).unwrap_or_default());
                asm.report(LineFault::new(
                    "ASM023",
                    part,
                    cause,
                    "write names, with commas between them, as `a` or `b:2`",
                ));
                continue;
            }
            let value = AsmValue::of(asm.family_state.pic16.next_constant);
            asm.define_symbol(name, value, AsmSymbolKind::Equ, part.start..end);
            let size = match behind.is_empty() {
                true => 1,
                false => asm.evaluate_number(text, behind.start + 1..part.end).unwrap_or(1),
            };
            asm.family_state.pic16.next_constant = asm.family_state.pic16.next_constant.wrapping_add(size);
        }
    }
    asm.line = begun;
}

/// `variable a = 1, b`: names with their values, 0 if none is given.
fn each_name(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, kind: AsmSymbolKind) {
    let local = call.get(call.word.clone()).eq_ignore_ascii_case("local");
    for part in cut(asm.dialect, call.text, call.rest.clone()) {
        let end = behind_name(call.text, part.start, true).min(part.end);
        let behind = trim(call.text, end..part.end);
        let name = call.get(part.start..end);
        let equals = byte(call.text, behind.start) == b'=';
        match behind.is_empty() {
            // A local label gets its value as any other label.
            true if local => {}
            true => asm.define_symbol(name, AsmValue::of(0), kind.clone(), part),
            false if equals && !name.is_empty() => {
                asm.define_value(name, part.start..end, call.text, behind.start + 1..part.end, kind.clone());
            }
            false => {
                let cause = format!("`{}` is not a name with a value", call.get(part.clone()));
                asm.report(LineFault::new("ASM023", part, cause, "write `name = value`"));
            }
        }
    }
}

/// `name += value` and similar directives.
fn step(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, new: fn(i64, i64) -> i64) {
    let Some(label) = call.label.clone() else { return };
    let name = call.get(label.clone());
    let Some(old) = asm.evaluate(call.text, label.clone()) else { return };
    let rest = trim(call.text, call.rest.clone());
    let by = match rest.is_empty() && matches!(call.get(call.word.clone()), "++" | "--") {
        true => Some(AsmValue::of(1)),
        false => asm.evaluate(call.text, rest),
    };
    let Some(by) = by else { return };
    let n = asm.dialect.wrap_value(new(old.number, by.number));
    let value = AsmValue { is_unknown: old.is_unknown || by.is_unknown, ..AsmValue::of(n) };
    asm.list_value(value);
    asm.define_symbol(name, value, AsmSymbolKind::Set, label);
}

/// Shifts a value. Shifted by 32 or more, or by a negative count, it becomes its sign.
fn shift(n: i64, by: i64, shift: fn(i64, u32) -> Option<i64>) -> i64 {
    u32::try_from(by).ok().filter(|by| *by < 32).and_then(|by| shift(n, by)).unwrap_or(n >> 63)
}

/// Returns cause and hint for bytes in a section of RAM, which cannot hold them.
fn no_bytes(_: &Assembler<'_>) -> Option<CauseAndHint> {
    let cause = "a section of variables cannot contain code or constants";
    Some(CauseAndHint::new(cause, "reserve room with res, or give the values in an idata section"))
}

/// `messg "text"`.
fn message(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let text = call.get(rest.clone()).trim_matches('"').to_owned();
    asm.report(LineFault::new("ASM025", rest, text, "the program itself says so").note());
}
