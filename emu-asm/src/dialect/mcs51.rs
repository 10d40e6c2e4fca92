//! The 8051 as as31, sdas8051 and the assemblers after Intel's ASM51 take it.
//!
//! ```text
//!   mcs51.rs       the dialect as data, sections, names of its own
//!   mcs51/area.rs  areas of sdas8051       mcs51/layout.rs  where sdld puts them, and BL51 segments
//!   mcs51/segment.rs  sections and segments of ASM51 and AX51
//!   mcs51/text.rs  texts and characters in quotes as sdas8051 takes them, and where
//! ```

mod area;
mod layout;
mod segment;
mod text;

use emu_core::chip::Chip;

use super::common::{constant, if_true, include, is_blank, is_defined, no_effect, nothing};
use text::{End, Size};

use super::{Arithmetic, Dialect, Directive, Flow, Form, Holds, Hooks, Op, Own, Provided, SectionRow};
use crate::engine::{Asm, Call};
use crate::expr::Value;
use crate::fault::Fault;
use crate::symbols::Kind;
use crate::text::{cut, trim};

/// What is kept during a pass.
#[derive(Debug, Default)]
pub(crate) struct State {
    /// The bank of R0 to R7 by `using`.
    bank: i64,
    /// A bit for each bank by `using`.
    banks: u8,
    /// Its areas.
    areas: area::Areas,
    /// It is what SDCC writes, which assembles with undefined names as those of other modules.
    compiled: bool,
    /// Names that it says other modules have.
    declared: std::collections::BTreeSet<String>,
}

/// The dialect.
#[rustfmt::skip]
pub(super) const MCS51: Dialect = Dialect {
    comments: &[";", "//"],
    line_comments: &[],
    separators: b"",
    block_comments: true,
    column_one: false,
    column_one_warns: false,
    numbers: &[Form::DollarMark, Form::Hex0x, Form::HexDollars, Form::HexH, Form::ZeroLetter, Form::BinaryB, Form::OctalOQ, Form::DecimalD, Form::HexDollar, Form::Binary0b,
               Form::BinaryPercent, Form::Plain],
    radix: 10,
    dot_is_bit: true,
    here: &["$", ".", "*"],
    here_is_line: true,
    here_is_behind: false,
    // Signs in the order of as31 and sdas8051; words as in Intel's ASM51 ("MCS-51 Macro Assembler User's Guide", operators).
    operators: &[
        (".", 12, Op::BitOf),
        ("*", 10, Op::Mul), ("/", 10, Op::Div), ("%", 10, Op::Mod), ("mod", 10, Op::Mod),
        ("<<", 8, Op::Shl), (">>", 8, Op::Shr), ("shl", 10, Op::Shl), ("shr", 10, Op::Shr),
        ("+", 9, Op::Add), ("-", 9, Op::Sub),
        ("==", 7, Op::Equal), ("=", 7, Op::Equal), ("<>", 7, Op::Unequal), ("!=", 7, Op::Unequal),
        ("<", 7, Op::Less), ("<=", 7, Op::LessEqual), (">", 7, Op::Greater), (">=", 7, Op::GreaterEqual),
        ("eq", 7, Op::Equal), ("ne", 7, Op::Unequal), ("lt", 7, Op::Less), ("le", 7, Op::LessEqual),
        ("gt", 7, Op::Greater), ("ge", 7, Op::GreaterEqual),
        ("&", 5, Op::And), ("and", 5, Op::And),
        ("^", 6, Op::Xor), ("xor", 3, Op::Xor), ("|", 3, Op::Or), ("or", 3, Op::Or),
        ("&&", 2, Op::BothTrue), ("||", 1, Op::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
        ("not", 6, |n| !n), ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF),
        ("<", 11, |n| n & 0xFF), (">", 11, |n| n >> 8 & 0xFF),
    ],
    truth: -1,
    arithmetic: Arithmetic::Unsigned(16),
    controls: true,
    numbered_labels: false,
    dollar_labels: true,
    any_case: true,
    plain_arguments: true,
    big_endian: true,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: false,
    literals: &[],
    hooks: Hooks { names: own_name, external, angles: true, complements: true, digit_groups: true, code_end: Some(text::any_code_end), plain_backslashes: text::plain_backslashes, no_bytes: area::why_no_bytes, general: &[("jmp", &["sjmp", "ajmp", "ljmp"]), ("call", &["acall", "lcall"])], ..Hooks::NONE },
    directives: &[
        Directive::run("defb", super::common::bytes),
        Directive::run("db", |asm, call| text::data(asm, call, Size::Byte, false)),
        Directive::run("byte", |asm, call| text::data(asm, call, Size::Byte, false)),
        Directive::run("fcb", |asm, call| text::data(asm, call, Size::Byte, true)),
        Directive::run("dw", |asm, call| text::data(asm, call, Size::Word, true)),
        Directive::run("word", |asm, call| text::data(asm, call, Size::Word, true)),
        Directive::run("defw", super::common::words),
        Directive::run("fdb", |asm, call| text::data(asm, call, Size::Word, true)),
        Directive::run("defs", super::common::space),
        Directive::run("skip", super::common::space),
        Directive::run("rmb", super::common::space),
        Directive::run("blkb", super::common::space),
        Directive::run("dbit", super::common::space),
        Directive::run("dsb", super::common::space),
        Directive::named("flag", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::run("inc", include),
        Directive::run("blkw", |asm, call| super::common::room(asm, call, 2)),
        Directive::run("rs", super::common::space),
        Directive::run("ascii", |asm, call| text::text(asm, call, End::Open)),
        Directive::run("str", |asm, call| text::text(asm, call, End::Open)),
        Directive::run("fcc", |asm, call| text::text(asm, call, End::Open)),
        Directive::run("asciz", |asm, call| text::text(asm, call, End::Zero)),
        Directive::run("strz", |asm, call| text::text(asm, call, End::Zero)),
        Directive::run("ascis", |asm, call| text::text(asm, call, End::HighBit)),
        Directive::run("strs", |asm, call| text::text(asm, call, End::HighBit)),
        Directive::run("even", |asm, call| super::common::parity(asm, call, 0)),
        Directive::run("odd", |asm, call| super::common::parity(asm, call, 1)),
        Directive::run("radix", radix),
        // The conditions of ASEM-51 (its manual, "Conditional assembly").
        Directive::flow("ifn", Flow::If(|asm, call| !if_true(asm, call))),
        Directive::flow("elseifn", Flow::Elif(|asm, call| !if_true(asm, call))),
        Directive::flow("elseifdef", Flow::Elif(|asm, call| is_defined(asm, call, true))),
        Directive::flow("elseifndef", Flow::Elif(|asm, call| is_defined(asm, call, false))),
        Directive::flow("elseifb", Flow::Elif(|_, call| is_blank(call))),
        Directive::flow("elseifnb", Flow::Elif(|_, call| !is_blank(call))),
        Directive::run("mexit", |asm, call| asm.leave_macro(call)),
        Directive::named("bit", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("data", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("idata", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("xdata", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("code", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("sfr", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("sfr16", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::named("sbit", |asm, call| constant(asm, call, Kind::Equ)),
        Directive::run("cseg", |asm, call| segment::absolute(asm, call, "code")),
        Directive::run("dseg", |asm, call| segment::absolute(asm, call, "idata")),
        Directive::run("iseg", |asm, call| segment::absolute(asm, call, "idata")),
        Directive::run("xseg", |asm, call| segment::absolute(asm, call, "xdata")),
        Directive::run("bseg", |asm, call| segment::absolute(asm, call, "bit")),
        Directive::named("segment", segment::segment),
        Directive::run("rseg", segment::rseg),
        Directive::run("area", area::area),
        Directive::run("org", area::org),
        Directive::run("globl", declare),
        Directive::run("global", declare),
        Directive::run("module", of_sdas),
        Directive::run("optsdcc", of_sdcc),
        Directive::run("title", nothing),
        Directive::run("sbttl", nothing),
        Directive::run("page", nothing),
        Directive::run("list", nothing),
        Directive::run("nlist", nothing),
        Directive::run("nolist", nothing),
        Directive::named("lit", literal),
        Directive::run("name", nothing),
        Directive::run("public", nothing),
        Directive::run("extrn", segment::extrn),
        Directive::run("extern", segment::extrn),
        Directive::run("using", using),
        // Controls of AX51 that give names values, and then those without effect, such as `$MOD52` and `$NOLIST`.
        Directive::run("$set", |asm, call| set_names(asm, call, None)),
        Directive::run("$reset", |asm, call| set_names(asm, call, Some(0))),
        Directive::run("$", control),
    ],
    provides,
    defines: |_| Vec::new(),
    refuses: |_, _| None,
    finish: area::place,
    sections: &[
        SectionRow { name: "code", space: "", holds: Holds::Image, behind: None },
        SectionRow { name: "idata", space: "idata", holds: Holds::Addresses, behind: None },
        SectionRow { name: "xdata", space: "xdata", holds: Holds::Addresses, behind: None },
        SectionRow { name: "bit", space: "bit", holds: Holds::Addresses, behind: None },
    ],
};

/// The same for sdas8051: a source with directives that as31 and ASM51 lack.
const SDAS: Dialect = Dialect {
    comments: &[";"],
    truth: 1,
    arithmetic: Arithmetic::Unsigned(32),
    hooks: Hooks {
        is_sdas: true,
        quoted: Some(text::quoted_at),
        code_end: Some(text::code_end),
        plain_backslashes: |_| None,
        ..MCS51.hooks
    },
    ..MCS51
};

/// Lists of registers by their makers' names, such as `reg52.inc`, `regx52.h`, `at89x51.h` and `89c2051.mcu`, stand for what the chip
/// has.
fn provides(_: &Chip, include: &str) -> Provided {
    let stem = include.split('.').next().unwrap_or(include);
    let makers = ["at", "reg", "reg_c", "regx", "mod", "sfr", "stc", "i", "p"];
    let number = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
    let maker = stem.strip_suffix(number).unwrap_or_default().trim_end_matches(['_', '-']);
    let known = maker.is_empty() || makers.contains(&maker);
    if known && LISTS.contains(&number) { Provided::Chip } else { Provided::No }
}

/// Chips by what the names of such files have behind the maker.
#[rustfmt::skip]
const LISTS: &[&str] = &[
    "51", "52", "8031", "8032", "8051", "8052", "8751", "8752", "80c31", "80c32", "80c51", "80c52", "87c51", "87c52", "89c51", "89c52",
    "51f", "8051sfr", "83c51", "83c52", "89c51rc", "89c52rc", "89c5xrc", "892051", "894051", "89s8252", "89s8253", "89s51", "89s52", "89c1051", "89c2051", "89c4051", "89x51", "89x52", "89x051", "1051", "2051", "4051",
];

/// Controls of the listing, of the object file and of the chip's names that stand at the head of public sources (A51, "Control
/// directives"; ASEM-51, "Assembler controls"). Others are told.
#[rustfmt::skip]
const CONTROLS: &[&str] = &[
    "builtin", "case", "co", "cond", "condonly", "da", "date", "db", "debug", "ej", "eject", "ep", "erf", "errorprint", "ge", "gen", "genonly", "go",
    "incdir", "la", "language", "li", "list", "ma", "macro", "mo", "mod51", "mr", "mpl", "nobuiltin", "noco", "nocond", "noda", "nodb", "nodebug", "noep", "noge", "nogen", "noli", "nolines",
    "nolist", "nolst", "nomacro", "noma", "nomo", "nomod51", "noob", "noobject", "nopaging", "nopi", "noprint", "nopr", "noregisterbank", "norb", "nosb", "nosymbols", "nosymlist",
    "nosy", "notabs", "noxr", "noxref", "object", "oj", "pagelength", "paging", "pagewidth", "philips", "pi", "pl", "pr", "print", "pw", "rb", "registerbank", "restore",
    "rs", "sa", "save", "sb", "symbols", "symlist", "sy", "tabs", "title", "tt", "wo", "xr", "xref",
];

/// A control without effect.
fn control(asm: &mut Asm<'_>, call: &Call<'_>) {
    let name = call.get(call.word.clone()).trim_start_matches('$').to_ascii_lowercase();
    let chips = name
        .trim_start_matches("no")
        .strip_prefix("mod")
        .is_some_and(|chip| chip.starts_with(|c: char| c.is_ascii_digit()));
    if !chips && !CONTROLS.contains(&name.as_str()) {
        no_effect(asm, call);
    }
}

/// `$SET (DEBUG, LEVEL=2)` and `$RESET (DEBUG)`: values for `$IF`.
fn set_names(asm: &mut Asm<'_>, call: &Call<'_>, fixed: Option<i64>) {
    let rest = trim(call.text, call.rest.clone());
    let inner = match call.get(rest.clone()) {
        all if all.starts_with('(') && all.ends_with(')') => rest.start + 1..rest.end - 1,
        _ => rest,
    };
    for part in cut(call.text, inner) {
        let equals = call.get(part.clone()).find('=').map_or(part.end, |at| part.start + at);
        let name = trim(call.text, part.start..equals);
        let value = match fixed {
            Some(n) => n,
            None if equals == part.end => 0xFFFF,
            None => asm.number(call.text, equals + 1..part.end).unwrap_or(0),
        };
        asm.define(call.get(name.clone()), Value::of(value), Kind::Set, name);
    }
}

/// `name LIT 'text'`: the text stands for the name, in any case of its letters.
fn literal(asm: &mut Asm<'_>, call: &Call<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let inner = written.strip_prefix(['\'', '"']).and_then(|inner| inner.strip_suffix(['\'', '"']));
    let (Some(label), Some(inner)) = (call.label.clone(), inner) else {
        let at = if rest.is_empty() { call.word.clone() } else { rest };
        return asm.tell(Fault::new("ASM023", at, "`lit` needs a name and a text", "write `name lit 'text'`"));
    };
    let name = call.get(label);
    for name in [name.to_owned(), name.to_ascii_uppercase(), name.to_ascii_lowercase()] {
        asm.define_name(name, inner);
    }
}

/// `using 1`: the bank of which AR0 to AR7 are the addresses.
fn using(asm: &mut Asm<'_>, call: &Call<'_>) {
    let Some(bank) = asm.number(call.text, call.rest.clone()) else { return };
    if !(0..4).contains(&bank) {
        let cause = format!("there is no bank {bank} of registers");
        return asm.tell(Fault::new("ASM003", trim(call.text, call.rest.clone()), cause, "give a number from 0 to 3"));
    }
    asm.own.mcs51.bank = bank;
    asm.own.mcs51.banks |= 1 << bank;
}

/// Where the interrupts of the 8051 begin, by the names that ASEM-51 gives them (its manual, predefined symbols).
#[rustfmt::skip]
const VECTORS: &[(&str, i64)] = &[
    ("RESET", 0), ("EXTI0", 0x03), ("TIMER0", 0x0B), ("EXTI1", 0x13), ("TIMER1", 0x1B), ("SINT", 0x23), ("TIMER2", 0x2B),
];

/// `AR0` to `AR7`: the addresses of R0 to R7 in the bank by `using`. `s_CSEG` and `l_CSEG`: first address and size of an area;
/// the name of a segment is its first address.
fn own_name(own: &Own, name: &str) -> Option<i64> {
    match name.as_bytes() {
        [b'a' | b'A', b'r' | b'R', digit @ b'0'..=b'7'] => Some(own.mcs51.bank * 8 + i64::from(digit - b'0')),
        _ => {
            let vector = || VECTORS.iter().find(|(vector, _)| vector.eq_ignore_ascii_case(name)).map(|(_, at)| *at);
            own.mcs51.areas.limit(name).or_else(vector)
        }
    }
}

/// What only sources for sdas8051 have; the lines before it are read anew with that in mind.
fn of_sdas(asm: &mut Asm<'_>, call: &Call<'_>) {
    if call.get(call.word.clone()).starts_with('.') {
        asm.late |= !asm.d.hooks.is_sdas;
        asm.d = &SDAS;
    }
}

/// `.optsdcc -mmcs51`: the source is what SDCC has written.
fn of_sdcc(asm: &mut Asm<'_>, call: &Call<'_>) {
    of_sdas(asm, call);
    asm.own.mcs51.compiled = true;
}

/// `.globl name`: a name of this module for others, or of others for this one.
fn declare(asm: &mut Asm<'_>, call: &Call<'_>) {
    let names = cut(call.text, call.rest.clone()).into_iter().map(|part| call.get(part));
    asm.own.mcs51.declared.extend(names.map(|name| name.to_ascii_lowercase()));
}

/// A name that no line gives is one of another module; so are first address and size of an area that is not in this one.
fn external(asm: &Asm<'_>, name: &str) -> bool {
    let state = &asm.own.mcs51;
    let linkers = |name: &str| {
        name.strip_prefix(['s', 'l'])
            .and_then(|rest| rest.strip_prefix('_'))
            .is_some_and(|area| area == area.to_ascii_uppercase())
    };
    state.compiled || state.declared.contains(&name.to_ascii_lowercase()) || asm.d.hooks.is_sdas && linkers(name)
}

/// `.radix x`: b, o, d or x; or a number.
fn radix(asm: &mut Asm<'_>, call: &Call<'_>) {
    let written = call.get(trim(call.text, call.rest.clone())).to_ascii_lowercase();
    asm.radix = match written.as_str() {
        "b" | "2" => 2,
        "o" | "q" | "8" => 8,
        "d" | "10" | "" => 10,
        "x" | "h" | "16" => 16,
        _ => {
            let cause = format!("`{written}` is no radix");
            return asm.tell(Fault::new("ASM023", call.rest.clone(), cause, "write b, o, d or x"));
        }
    };
}
