//! The mid-range PIC16 as gpasm and Microchip's MPASM take it.
//!
//! ```text
//!   pic16.rs  the dialect as data, and the names that a program gives    chip.rs  the chip: list, banks, pages, configuration
//!   fields.rs values beyond the field of an operand
//!   link.rs   sections of relocatable sources, and where they lie
//!   data.rs   words of all kinds: dw, db, da, de, dt, fill      special.rs  mnemonics that stand for other instructions
//! ```

mod chip;
mod data;
mod fields;
mod link;
mod special;

use std::ops::Range;

use emu_core::table::Row;

use super::common::nothing;
use super::{Dialect, Directive, Flow, Form, Holds, Hooks, Op, SectionRow};
use crate::engine::{Asm, Call};
use crate::expr::Value;
use crate::fault::Fault;
use crate::reader::Block;
use crate::statement::code_end;
use crate::symbols::Kind;
use crate::text::{behind_name, byte, cut, trim};

pub(crate) use chip::bare;

/// What is kept during a pass.
#[derive(Debug, Default)]
pub(crate) struct State {
    /// What the next name of a block of constants gets.
    block: i64,
    /// The configuration words by `config`.
    settings: Option<[u16; 2]>,
    /// The sections of a relocatable source, in the order in which it begins them.
    modules: Vec<link::ModuleSection>,
    /// The include of a chip was read: its names are defined.
    includes_chip: bool,
    /// What `ifdef` and `ifndef` asked for that was not defined there.
    asked: Vec<chip::Asked>,
    /// `list f=inhx8m`.
    pub is_inhx8m: bool,
}

/// Directives of all dialects that gpasm has not.
#[rustfmt::skip]
const FOREIGN: &[&str] = &[
    "ds", "byte", "word", "ascii", "asciz", "rept", "irp", "irpc", "endr", "warning", "undef", "undefine",
    "ifeq", "ifne", "ifgt", "ifge", "iflt", "ifle", "ifb", "ifnb", "ifc", "ifnc", "ifnotdef", "elif", "elseif",
];

/// Directives for debuggers, and the macros of gputils' `coff.inc` that tell gpsim something.
const DOTTED: &[&str] = &["line", "eof", "file", "ident", "type", "def", "dim", "direct", "sim", "assert", "command"];

/// The dialect.
#[rustfmt::skip]
pub(super) const PIC16: Dialect = Dialect {
    comments: &[";"],
    line_comments: &[],
    separators: b"",
    block_comments: false,
    column_one: true,
    column_one_warns: true,
    // A number of hexadecimal digits may end with b or d, so what is said by these letters comes last.
    numbers: &[Form::Hex0x, Form::Quoted, Form::DecimalDot, Form::HexH, Form::OctalOQ, Form::Plain, Form::BinaryB, Form::DecimalD],
    radix: 16,
    dot_is_bit: false,
    here: &["$"],
    here_is_line: false,
    here_is_behind: false,
    // Comparisons are of one strength, and so are & ^ and |.
    operators: &[
        ("*", 10, Op::Mul), ("/", 10, Op::Div), ("%", 10, Op::Mod),
        ("+", 9, Op::Add), ("-", 9, Op::Sub),
        ("<<", 8, Op::Shl), (">>", 8, Op::Shr),
        (">=", 6, Op::GreaterEqual), (">", 6, Op::Greater), ("<", 6, Op::Less), ("<=", 6, Op::LessEqual),
        ("==", 6, Op::Equal), ("!=", 6, Op::Unequal),
        ("&", 5, Op::And), ("^", 5, Op::Xor), ("|", 5, Op::Or), ("&&", 2, Op::BothTrue), ("||", 1, Op::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
        ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF), ("upper", 11, |n| n >> 16 & 0xFF),
    ],
    truth: 1,
    arithmetic: super::Arithmetic::Signed,
    controls: false,
    numbered_labels: false,
    dollar_labels: false,
    any_case: false,
    plain_arguments: true,
    big_endian: false,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: false,
    literals: &[("W", 0), ("F", 1)],
    hooks: Hooks { check, cut: fields::cut, drops_operands: true, dotted: DOTTED, foreign: FOREIGN, place: link::place, value_names: true, is_32: true, no_bytes, ..Hooks::NONE },
    directives: &[
        Directive::run("include", chip::include),
        Directive::flow("ifdef", Flow::If(|asm, call| chip::is_defined(asm, call, true))),
        Directive::flow("ifndef", Flow::If(|asm, call| chip::is_defined(asm, call, false))),
        Directive::named("org", org),
        Directive::run("dw", data::words),
        Directive::run("word", data::words),
        Directive::run("data", data::words),
        Directive::run("db", data::bytes),
        Directive::run("byte", data::bytes),
        Directive::run("da", data::packed),
        Directive::run("de", data::cells),
        Directive::run("dt", data::table),
        Directive::run("fill", data::fill),
        Directive::run("res", link::reserve),
        link::section("code"), link::section("udata"), link::section("udata_shr"), link::section("udata_ovr"), link::section("idata"),
        link::section("udata_acs"), link::section("idata_acs"), link::section("code_pack"),
        Directive::run("extern", link::external),
        Directive::run("global", nothing),
        Directive::run("list", chip::list),
        Directive::run("processor", chip::processor),
        Directive::run("radix", chip::radix),
        Directive::run("errorlevel", chip::errorlevel),
        Directive::run("__config", chip::config),
        Directive::run("__fuses", chip::config),
        Directive::run("config", chip::settings),
        Directive::run("__idlocs", chip::idlocs),
        Directive::run("banksel", chip::banksel),
        Directive::run("bankisel", chip::bankisel),
        Directive::run("pagesel", chip::pagesel),
        Directive::run("pageselw", chip::pageselw),
        special::named("skpc"), special::named("skpnc"), special::named("skpz"), special::named("skpnz"), special::named("skpdc"), special::named("skpndc"),
        special::named("setc"), special::named("clrc"), special::named("setz"), special::named("clrz"), special::named("setdc"), special::named("clrdc"),
        special::named("movfw"), special::named("tstf"), special::named("negf"), special::named("addcf"), special::named("subcf"), special::named("adddcf"), special::named("subdcf"),
        special::named("b"), special::named("bc"), special::named("bnc"), special::named("bz"), special::named("bnz"), special::named("bdc"), special::named("bndc"),
        special::named("lcall"), special::named("lgoto"),
        Directive::flow("cblock", Flow::Block(constants)),
        Directive::flow("endc", Flow::EndBlock),
        Directive::flow("while", Flow::While),
        Directive::flow("endw", Flow::Endw),
        Directive::run("variable", |asm, call| each_name(asm, call, Kind::Set)),
        Directive::run("constant", |asm, call| each_name(asm, call, Kind::Equ)),
        // The names themselves are replaced when the macro is called.
        Directive::run("local", |asm, call| each_name(asm, call, Kind::Set)),
        Directive::named("++", |asm, call| step(asm, call, |old, _| old.wrapping_add(1))),
        Directive::named("--", |asm, call| step(asm, call, |old, _| old.wrapping_sub(1))),
        Directive::named("+=", |asm, call| step(asm, call, i64::wrapping_add)),
        Directive::named("-=", |asm, call| step(asm, call, i64::wrapping_sub)),
        Directive::named("*=", |asm, call| step(asm, call, i64::wrapping_mul)),
        Directive::named("/=", |asm, call| step(asm, call, |old, n| old.checked_div(n).unwrap_or(0))),
        Directive::named("%=", |asm, call| step(asm, call, |old, n| old.checked_rem(n).unwrap_or(0))),
        Directive::named("<<=", |asm, call| step(asm, call, |old, n| shift(old, n, i64::checked_shl))),
        Directive::named(">>=", |asm, call| step(asm, call, |old, n| shift(old, n, i64::checked_shr))),
        Directive::named("&=", |asm, call| step(asm, call, |old, n| old & n)),
        Directive::named("|=", |asm, call| step(asm, call, |old, n| old | n)),
        Directive::named("^=", |asm, call| step(asm, call, |old, n| old ^ n)),
        Directive::run("messg", message),
        Directive::run("title", nothing),
        Directive::run("subtitle", nothing),
        Directive::run("subtitl", nothing),
        Directive::run("stitle", nothing),
        Directive::run("nolist", nothing),
        Directive::run("page", nothing),
        Directive::run("space", nothing),
        Directive::run("expand", nothing),
        Directive::run("noexpand", nothing),
        Directive::run("__maxram", nothing),
        Directive::run("__badram", nothing),
        Directive::run("__maxrom", nothing),
        Directive::run("__badrom", nothing),
    ],
    provides: chip::provides,
    defines: chip::defines,
    refuses: |_, _| None,
    finish: chip::finish,
    sections: &[SectionRow { name: "code", space: "", holds: Holds::Image, behind: None }],
};

/// An instruction has seven bits for a file register; an address with more is that of another bank.
fn check(row: &Row, values: &[(i32, Range<usize>)]) -> Option<Fault> {
    let slots = row.operands.iter().filter(|slot| row.pattern.has(slot.letter));
    let (value, at) = slots.zip(values).find(|(slot, (n, _))| slot.kind.name == "file register" && n & 0x180 != 0)?.1;
    let cause = format!("the register at 0x{value:X} is not in bank 0");
    let hint = "the instruction has the lower seven bits; `banksel` before it selects the bank";
    Some(Fault::new("ASM042", at.clone(), cause, hint).note())
}

/// `org address`; a label in front of it has the new address.
fn org(asm: &mut Asm<'_>, call: &Call<'_>) {
    if !asm.own.pic16.modules.is_empty() {
        asm.out.turn_to(link::ABSOLUTE);
    }
    super::common::org(asm, call);
    if let Some(label) = call.label.clone() {
        asm.label(call.get(label.clone()), label);
    }
}

/// `cblock start`, and up to `endc` names, each with the next number: `a`, `b:2, c`.
fn constants(asm: &mut Asm<'_>, call: &Call<'_>, body: Block) {
    if !trim(call.text, call.rest.clone()).is_empty() {
        let Some(start) = asm.number(call.text, call.rest.clone()) else { return };
        asm.own.pic16.block = start;
    }
    let begun = asm.line.take();
    for line in body.iter() {
        asm.line = Some(line.clone());
        let text: &str = &line.text;
        let all = trim(text, 0..code_end(asm.d, text));
        for part in cut(text, all).into_iter().filter(|part| !part.is_empty()) {
            let end = behind_name(text, part.start, true).min(part.end);
            let behind = trim(text, end..part.end);
            let name = text.get(part.start..end).unwrap_or_default();
            if name.is_empty() || !behind.is_empty() && byte(text, behind.start) != b':' {
                let cause =
                    format!("`{}` is no name of a block of constants", text.get(part.clone()).unwrap_or_default());
                asm.tell(Fault::new("ASM023", part, cause, "write names, with commas between them, as `a` or `b:2`"));
                continue;
            }
            let value = Value::of(asm.own.pic16.block);
            asm.define(name, value, Kind::Equ, part.start..end);
            let size = match behind.is_empty() {
                true => 1,
                false => asm.number(text, behind.start + 1..part.end).unwrap_or(1),
            };
            asm.own.pic16.block = asm.own.pic16.block.wrapping_add(size);
        }
    }
    asm.line = begun;
}

/// `variable a = 1, b`: names with their values, 0 where none is given.
fn each_name(asm: &mut Asm<'_>, call: &Call<'_>, kind: Kind) {
    let local = call.get(call.word.clone()).eq_ignore_ascii_case("local");
    for part in cut(call.text, call.rest.clone()) {
        let end = behind_name(call.text, part.start, true).min(part.end);
        let behind = trim(call.text, end..part.end);
        let name = call.get(part.start..end);
        let equals = byte(call.text, behind.start) == b'=';
        match behind.is_empty() {
            // A local label gets its value as any other.
            true if local => {}
            true => asm.define(name, Value::of(0), kind.clone(), part),
            false if equals && !name.is_empty() => {
                asm.give_value(name, part.start..end, call.text, behind.start + 1..part.end, kind.clone());
            }
            false => {
                let cause = format!("`{}` is no name with a value", call.get(part.clone()));
                asm.tell(Fault::new("ASM023", part, cause, "write `name = value`"));
            }
        }
    }
}

/// `name += value` and its like.
fn step(asm: &mut Asm<'_>, call: &Call<'_>, new: fn(i64, i64) -> i64) {
    let Some(label) = call.label.clone() else { return };
    let name = call.get(label.clone());
    let Some(old) = asm.value(call.text, label.clone()) else { return };
    let rest = trim(call.text, call.rest.clone());
    let by = match rest.is_empty() && matches!(call.get(call.word.clone()), "++" | "--") {
        true => Some(Value::of(1)),
        false => asm.value(call.text, rest),
    };
    let Some(by) = by else { return };
    let n = asm.d.fit(new(old.n, by.n));
    let value = Value { n, unknown: old.unknown || by.unknown, register: false, label: false };
    asm.list_value(value);
    asm.define(name, value, Kind::Set, label);
}

/// Shifted by 32 or more, or by a negative count, a value is its sign.
fn shift(n: i64, by: i64, shift: fn(i64, u32) -> Option<i64>) -> i64 {
    u32::try_from(by).ok().filter(|by| *by < 32).and_then(|by| shift(n, by)).unwrap_or(n >> 63)
}

/// What stands in for bytes of RAM.
fn no_bytes(_: &Asm<'_>) -> Option<(String, String)> {
    let cause = "nothing that a program holds can lie in a section of variables";
    Some((cause.to_owned(), "reserve room with res, or give the values in an idata section".to_owned()))
}

/// `messg "text"`.
fn message(asm: &mut Asm<'_>, call: &Call<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let text = call.get(rest.clone()).trim_matches('"').to_owned();
    asm.tell(Fault::new("ASM025", rest, text, "the program itself says so").note());
}
