//! The 8051 dialect of as31, of sdas8051 and of assemblers compatible with Intel's ASM51.
//!
//! ```text
//!   mcs51.rs       the dialect as data, sections, predefined names
//!   mcs51/area.rs  areas of sdas8051       mcs51/layout.rs  where sdld and BL51 place areas and segments
//!   mcs51/segment.rs  sections and segments of ASM51 and AX51
//!   mcs51/asxxxx.rs  directives that only sdas8051 has
//!   mcs51/class.rs  byte names used as bits, and bit names used as bytes
//!   mcs51/text.rs  quoted texts and characters of sdas8051
//! ```

mod area;
mod asxxxx;
mod class;
mod layout;
mod segment;
mod text;

use emu_core::chip::Chip;

use super::common::{constant, if_true, ignore_directive, include, is_blank, is_defined, report_no_effect};
use class::{AddressClass, Classes, typed};
use text::{DataSize, TextEnd};

use super::{
    AsmArithmetic, AsmDialect, AsmDirective, AsmOperator, DialectHooks, NumberForm, ProvidedInclude, ReadFlow,
    SectionContent, SectionRow,
};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{cut, trim};
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

/// State of the dialect during a pass.
#[derive(Debug, Default)]
pub(crate) struct Mcs51PassState {
    /// The register bank that `using` selects for R0 to R7.
    bank: i64,
    /// Banks selected by `using`: bit `n` is bank `n`.
    used_banks: u8,
    /// The areas of the source.
    areas: area::PassAreas,
    /// Whether a name is a byte or a bit; kept from pass to pass.
    classes: Classes,
    /// SDCC wrote the source. SDCC's assembler run treats undefined names as external.
    is_from_sdcc: bool,
    /// Names that the source declares as those of other modules.
    declared_externals: std::collections::BTreeSet<String>,
}

/// The dialect.
#[rustfmt::skip]
pub(super) const MCS51: AsmDialect = AsmDialect {
    comments: &[";", "//"],
    line_comments: &[],
    separators: b"",
    block_comments: true,
    labels_in_column_one: false,
    warns_in_column_one: false,
    numbers: &[NumberForm::DollarMark, NumberForm::Hex0x, NumberForm::HexDollars, NumberForm::HexH, NumberForm::ZeroLetter, NumberForm::BinaryB, NumberForm::OctalOQ, NumberForm::DecimalD, NumberForm::HexDollar, NumberForm::Binary0b,
               NumberForm::BinaryPercent, NumberForm::Plain],
    radix: 10,
    dot_is_bit: true,
    location_counter_names: &["$", ".", "*"],
    counter_at_line_start: true,
    counter_after_instruction: false,
    // Precedence of the signs as in sdas8051, of the words as in Intel's ASM51 ("MCS-51 Macro Assembler
    // User's Guide", operators).
    operators: &[
        (".", 12, AsmOperator::BitOf),
        ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod), ("mod", 10, AsmOperator::Mod),
        ("<<", 8, AsmOperator::Shl), (">>", 8, AsmOperator::Shr), ("shl", 10, AsmOperator::Shl), ("shr", 10, AsmOperator::Shr),
        ("+", 9, AsmOperator::Add), ("-", 9, AsmOperator::Sub),
        ("==", 7, AsmOperator::Equal), ("=", 7, AsmOperator::Equal), ("<>", 7, AsmOperator::Unequal), ("!=", 7, AsmOperator::Unequal),
        ("<", 7, AsmOperator::Less), ("<=", 7, AsmOperator::LessEqual), (">", 7, AsmOperator::Greater), (">=", 7, AsmOperator::GreaterEqual),
        ("eq", 7, AsmOperator::Equal), ("ne", 7, AsmOperator::Unequal), ("lt", 7, AsmOperator::Less), ("le", 7, AsmOperator::LessEqual),
        ("gt", 7, AsmOperator::Greater), ("ge", 7, AsmOperator::GreaterEqual),
        ("&", 5, AsmOperator::And), ("and", 5, AsmOperator::And),
        ("^", 6, AsmOperator::Xor), ("xor", 3, AsmOperator::Xor), ("|", 3, AsmOperator::Or), ("or", 3, AsmOperator::Or),
        ("&&", 2, AsmOperator::BothTrue), ("||", 1, AsmOperator::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
        ("not", 6, |n| !n), ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF),
        ("<", 11, |n| n & 0xFF), (">", 11, |n| n >> 8 & 0xFF),
        // Of AX51 (its manual, "Operators").
        ("byte0", 11, |n| n & 0xFF), ("byte1", 11, |n| n >> 8 & 0xFF), ("byte2", 11, |n| n >> 16 & 0xFF), ("byte3", 11, |n| n >> 24 & 0xFF),
        ("word0", 11, |n| n & 0xFFFF), ("word2", 11, |n| n >> 16 & 0xFFFF),
    ],
    true_value: -1,
    arithmetic: AsmArithmetic::Unsigned(16),
    controls: true,
    numbered_labels: false,
    dollar_labels: true,
    ignores_case: true,
    plain_arguments: true,
    big_endian: true,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    zones: false,
    literals: &[],
    hooks: DialectHooks { own_name_value: own_name, refused_operators: REFUSED_OPERATORS, is_external: external, mismatch: class::mismatch, with_dots: || Some(&AS31), more: asxxxx::DIRECTIVES, angle_arguments: true, complements: true, commas_in_quotes: true, digit_groups: Some('$'), code_end: Some(text::any_code_end), plain_backslashes: text::plain_backslashes, no_bytes: area::why_no_bytes, general_instructions: &[("jmp", &["sjmp", "ajmp", "ljmp"]), ("call", &["acall", "lcall"])], ..DialectHooks::NONE },
    directives: &[
        AsmDirective::run("defb", super::common::bytes),
        AsmDirective::run("db", |asm, call| text::data(asm, call, DataSize::Byte, false)),
        AsmDirective::run("byte", |asm, call| text::data(asm, call, DataSize::Byte, false)),
        AsmDirective::run("fcb", |asm, call| text::data(asm, call, DataSize::Byte, true)),
        AsmDirective::run("dw", |asm, call| text::data(asm, call, DataSize::Word, true)),
        AsmDirective::run("word", |asm, call| text::data(asm, call, DataSize::Word, true)),
        AsmDirective::run("defw", super::common::words),
        AsmDirective::run("fdb", |asm, call| text::data(asm, call, DataSize::Word, true)),
        AsmDirective::run("defs", super::common::space),
        AsmDirective::run("skip", super::common::space),
        AsmDirective::run("rmb", super::common::space),
        AsmDirective::run("blkb", super::common::space),
        AsmDirective::run("dbit", super::common::space),
        AsmDirective::run("dsb", super::common::space),
        AsmDirective::run("dsw", |asm, call| super::common::reserve_room(asm, call, 2)),
        AsmDirective::run("dsd", |asm, call| super::common::reserve_room(asm, call, 4)),
        AsmDirective::run("dd", doubles),
        AsmDirective::named("proc", segment::procedure),
        AsmDirective::named("endp", ignore_directive),
        AsmDirective::named("label", segment::label),
        AsmDirective::run("__error__", |asm, call| super::common::message(asm, call, true)),
        AsmDirective::named("equ", |asm, call| equate(asm, call, AsmSymbolKind::Equ)),
        AsmDirective::named("set", |asm, call| equate(asm, call, AsmSymbolKind::Set)),
        AsmDirective::flow("if", ReadFlow::If(condition)),
        AsmDirective::flow("elseif", ReadFlow::Elif(condition)),
        AsmDirective::named("flag", |asm, call| typed(asm, call, AddressClass::Bit)),
        AsmDirective::run("inc", include),
        AsmDirective::run("blkw", |asm, call| super::common::reserve_room(asm, call, 2)),
        AsmDirective::run("rs", super::common::space),
        AsmDirective::run("ascii", |asm, call| text::text(asm, call, TextEnd::Open)),
        AsmDirective::run("str", |asm, call| text::text(asm, call, TextEnd::Open)),
        AsmDirective::run("fcc", |asm, call| text::text(asm, call, TextEnd::Open)),
        AsmDirective::run("asciz", |asm, call| text::text(asm, call, TextEnd::Zero)),
        AsmDirective::run("strz", |asm, call| text::text(asm, call, TextEnd::Zero)),
        AsmDirective::run("ascis", |asm, call| text::text(asm, call, TextEnd::HighBit)),
        AsmDirective::run("strs", |asm, call| text::text(asm, call, TextEnd::HighBit)),
        AsmDirective::run("even", |asm, call| super::common::parity(asm, call, 0)),
        AsmDirective::run("odd", |asm, call| super::common::parity(asm, call, 1)),
        AsmDirective::run("radix", radix),
        // Conditions of ASEM-51 (its manual, "Conditional assembly").
        AsmDirective::flow("ifn", ReadFlow::If(|asm, call| !if_true(asm, call))),
        AsmDirective::flow("elseifn", ReadFlow::Elif(|asm, call| !if_true(asm, call))),
        AsmDirective::flow("elseifdef", ReadFlow::Elif(|asm, call| is_defined(asm, call, true))),
        AsmDirective::flow("elseifndef", ReadFlow::Elif(|asm, call| is_defined(asm, call, false))),
        AsmDirective::flow("elseifb", ReadFlow::Elif(|_, call| is_blank(call))),
        AsmDirective::flow("elseifnb", ReadFlow::Elif(|_, call| !is_blank(call))),
        AsmDirective::run("mexit", |asm, call| asm.leave_macro(call)),
        AsmDirective::named("bit", |asm, call| typed(asm, call, AddressClass::Bit)),
        AsmDirective::named("data", |asm, call| typed(asm, call, AddressClass::Byte)),
        AsmDirective::named("idata", |asm, call| typed(asm, call, AddressClass::Byte)),
        AsmDirective::named("xdata", |asm, call| segment::place(asm, call, "xdata")),
        AsmDirective::named("code", |asm, call| segment::place(asm, call, "code")),
        AsmDirective::named("sfr", |asm, call| typed(asm, call, AddressClass::Byte)),
        AsmDirective::named("sfr16", |asm, call| constant(asm, call, AsmSymbolKind::Equ)),
        AsmDirective::named("sbit", |asm, call| typed(asm, call, AddressClass::Bit)),
        AsmDirective::run("cseg", |asm, call| segment::absolute(asm, call, "code")),
        AsmDirective::run("dseg", |asm, call| segment::absolute(asm, call, "idata")),
        AsmDirective::run("iseg", |asm, call| segment::absolute(asm, call, "idata")),
        AsmDirective::run("xseg", |asm, call| segment::absolute(asm, call, "xdata")),
        AsmDirective::run("bseg", |asm, call| segment::absolute(asm, call, "bit")),
        AsmDirective::named("segment", segment::segment),
        AsmDirective::run("rseg", segment::rseg),
        AsmDirective::run("area", area::area),
        AsmDirective::run("org", area::org),
        AsmDirective::run("globl", declare),
        AsmDirective::run("global", declare),
        AsmDirective::run("module", of_sdas),
        AsmDirective::run("optsdcc", of_sdcc),
        AsmDirective::run("title", ignore_directive),
        AsmDirective::run("sbttl", ignore_directive),
        AsmDirective::run("page", ignore_directive),
        AsmDirective::run("list", ignore_directive),
        AsmDirective::run("nlist", ignore_directive),
        AsmDirective::run("nolist", ignore_directive),
        AsmDirective::named("lit", literal),
        AsmDirective::run("name", ignore_directive),
        AsmDirective::run("public", ignore_directive),
        AsmDirective::run("extrn", segment::extrn),
        AsmDirective::run("extern", segment::extrn),
        AsmDirective::run("using", using),
        AsmDirective::run("end", end),
        // Controls of AX51 that define names, then controls without effect, such as `$MOD52` and `$NOLIST`.
        AsmDirective::run("$set", |asm, call| set_names(asm, call, None)),
        AsmDirective::run("$reset", |asm, call| set_names(asm, call, Some(0))),
        AsmDirective::run("$", control),
    ],
    include_provided: provides,
    predefined: |_| Vec::new(),
    refuse_instruction: |_, _| None,
    finish_pass: area::place_areas,
    sections: &[
        SectionRow { name: "code", space: "", content: SectionContent::Image, align_after_previous: None },
        SectionRow { name: "idata", space: "idata", content: SectionContent::Addresses, align_after_previous: None },
        SectionRow { name: "xdata", space: "xdata", content: SectionContent::Addresses, align_after_previous: None },
        SectionRow { name: "bit", space: "bit", content: SectionContent::Addresses, align_after_previous: None },
    ],
};

/// Operators of AX51 about memories beyond 64 KB.
const REFUSED_OPERATORS: &[(&str, &str)] =
    &[("mbyte", "write the number of the memory that C51 wants: 0 for data and idata, 1 for xdata, 0FFh for code")];

/// The variant for as31: a source whose directives begin with a dot. Its values are signed. The operators
/// have an order of their own: shifts bind first, then `&` and `|` alike, then a sign before a value, then
/// `* / %`: `-1&3` is `-(1&3)`, and `2/-1/2` is `(2/(-1))/2`.
#[rustfmt::skip]
const AS31: AsmDialect = AsmDialect {
    operators: &[
        (".", 15, AsmOperator::BitOf),
        ("<<", 13, AsmOperator::Shl), (">>", 13, AsmOperator::Shr),
        ("&", 12, AsmOperator::And), ("and", 5, AsmOperator::And), ("|", 12, AsmOperator::Or), ("or", 3, AsmOperator::Or),
        ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod), ("mod", 10, AsmOperator::Mod),
        ("shl", 10, AsmOperator::Shl), ("shr", 10, AsmOperator::Shr),
        ("+", 9, AsmOperator::Add), ("-", 9, AsmOperator::Sub),
        ("==", 7, AsmOperator::Equal), ("=", 7, AsmOperator::Equal), ("<>", 7, AsmOperator::Unequal), ("!=", 7, AsmOperator::Unequal),
        ("<", 7, AsmOperator::Less), ("<=", 7, AsmOperator::LessEqual), (">", 7, AsmOperator::Greater), (">=", 7, AsmOperator::GreaterEqual),
        ("eq", 7, AsmOperator::Equal), ("ne", 7, AsmOperator::Unequal), ("lt", 7, AsmOperator::Less), ("le", 7, AsmOperator::LessEqual),
        ("gt", 7, AsmOperator::Greater), ("ge", 7, AsmOperator::GreaterEqual),
        ("^", 6, AsmOperator::Xor), ("xor", 3, AsmOperator::Xor),
        ("&&", 2, AsmOperator::BothTrue), ("||", 1, AsmOperator::EitherTrue),
    ],
    unary: &[
        ("-", 11, |n| n.wrapping_neg()), ("+", 14, |n| n), ("~", 14, |n| !n), ("!", 14, |n| i64::from(n == 0)),
        ("not", 6, |n| !n), ("low", 14, |n| n & 0xFF), ("high", 14, |n| n >> 8 & 0xFF),
        ("<", 14, |n| n & 0xFF), (">", 14, |n| n >> 8 & 0xFF),
    ],
    arithmetic: AsmArithmetic::Signed,
    hooks: DialectHooks { with_dots: || None, ..MCS51.hooks },
    ..MCS51
};

/// The variant for sdas8051: a source with directives that as31 and ASM51 do not have.
const SDAS: AsmDialect = AsmDialect {
    comments: &[";"],
    true_value: 1,
    arithmetic: AsmArithmetic::Unsigned(32),
    hooks: DialectHooks {
        is_sdas: true,
        commas_in_quotes: false,
        with_dots: || None,
        quoted: Some(text::quoted_at),
        code_end: Some(text::code_end),
        plain_backslashes: |_| None,
        ..MCS51.hooks
    },
    ..MCS51
};

/// Returns what an include provides. The chip's data replaces vendor register lists such as `reg52.inc`,
/// `regx52.h`, `at89x51.h` and `89c2051.mcu`.
fn provides(_: &Chip, include: &str) -> ProvidedInclude {
    if list_of(include).is_some() { ProvidedInclude::Chip } else { ProvidedInclude::NotProvided }
}

/// Returns the row of [`LISTS`] for a file name in lower case.
fn list_of(include: &str) -> Option<&'static (&'static str, &'static str)> {
    let stem = include.split('.').next().unwrap_or(include);
    let makers = ["at", "reg", "reg_c", "regx", "mod", "sfr", "stc", "i", "p"];
    let number = stem.trim_start_matches(|c: char| !c.is_ascii_digit());
    let maker = stem.strip_suffix(number).unwrap_or_default().trim_end_matches(['_', '-']);
    let known = maker.is_empty() || makers.contains(&maker);
    LISTS.iter().find(|(spelling, _)| known && *spelling == number)
}

/// Returns the chip of a register list, `reg52.inc` or `89c4051.mcu`, as the command line spells it. It may
/// be one that has no row; `None` if the file is no register list.
pub(crate) fn chip_of_list(include: &str) -> Option<&'static str> {
    list_of(&include.to_ascii_lowercase()).map(|(_, chip)| *chip)
}

/// Chips as the names of such files spell them after the vendor's prefix, and on the command line.
#[rustfmt::skip]
const LISTS: &[(&str, &str)] = &[
    ("51", "8051"), ("52", "8052"), ("8031", "8031"), ("8032", "8032"), ("8051", "8051"), ("8052", "8052"), ("8751", "8751"), ("8752", "8752"),
    ("80c31", "8031"), ("80c32", "8032"), ("80c51", "80c51"), ("80c52", "8052"), ("83c51", "80c51"), ("83c52", "8052"), ("87c51", "8751"), ("87c52", "8752"),
    ("51f", "8051"), ("8051sfr", "8051"), ("89c51", "at89c51"), ("89c52", "at89c52"), ("89x51", "at89c51"), ("89x52", "at89c52"), ("89s51", "at89s51"), ("89s52", "at89s52"),
    ("89c51rc", "at89c51rc"), ("89c52rc", "at89c52"), ("89c5xrc", "at89c52"), ("89s8252", "at89s8252"), ("89s8253", "at89s8253"),
    ("89c1051", "at89c1051"), ("1051", "at89c1051"), ("89c2051", "at89c2051"), ("892051", "at89c2051"), ("2051", "at89c2051"), ("89x051", "at89c2051"),
    ("89c4051", "at89c4051"), ("894051", "at89c4051"), ("4051", "at89c4051"),
];

/// Ignored controls, which are common at the start of public sources: of the listing, the object file and the
/// chip's names (A51, "Control directives"; ASEM-51, "Assembler controls"). Other controls are reported.
#[rustfmt::skip]
const CONTROLS: &[&str] = &[
    "builtin", "case", "co", "cond", "condonly", "da", "date", "db", "debug", "ej", "eject", "ep", "erf", "errorprint", "ge", "gen", "genonly", "go",
    "incdir", "la", "language", "li", "list", "ma", "macro", "mo", "mod51", "mr", "mpl", "nobuiltin", "noco", "nocond", "noda", "nodb", "nodebug", "noep", "noge", "nogen", "noli", "nolines",
    "nolist", "nolst", "nomacro", "noma", "nomo", "nomod51", "noob", "noobject", "nopaging", "nopi", "noprint", "nopr", "noregisterbank", "norb", "nosb", "nosymbols", "nosymlist",
    "nosy", "notabs", "noxr", "noxref", "object", "oj", "pagelength", "paging", "pagewidth", "philips", "pi", "pl", "pr", "print", "pw", "rb", "registerbank", "restore",
    "rs", "sa", "save", "sb", "symbols", "symlist", "sy", "tabs", "title", "tt", "wo", "xr", "xref",
];

/// A control without effect.
fn control(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let name = call.get(call.word.clone()).trim_start_matches('$').to_ascii_lowercase();
    let chips = name
        .trim_start_matches("no")
        .strip_prefix("mod")
        .is_some_and(|chip| chip.starts_with(|c: char| c.is_ascii_digit()));
    if !chips && !CONTROLS.contains(&name.as_str()) {
        report_no_effect(asm, call);
    }
}

/// `$SET (DEBUG, LEVEL=2)` and `$RESET (DEBUG)`: values for `$IF`.
fn set_names(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, fixed: Option<i64>) {
    let rest = trim(call.text, call.rest.clone());
    let inner = match call.get(rest.clone()) {
        all if all.starts_with('(') && all.ends_with(')') => rest.start + 1..rest.end - 1,
        _ => rest,
    };
    for part in cut(asm.dialect, call.text, inner) {
        let equals = call.get(part.clone()).find('=').map_or(part.end, |at| part.start + at);
        let name = trim(call.text, part.start..equals);
        let value = match fixed {
            Some(n) => n,
            None if equals == part.end => 0xFFFF,
            None => asm.evaluate_number(call.text, equals + 1..part.end).unwrap_or(0),
        };
        asm.define_symbol(call.get(name.clone()), AsmValue::of(value), AsmSymbolKind::Set, name);
    }
}

/// `name LIT 'text'`: the name is replaced by the text; case is ignored.
fn literal(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let inner = written.strip_prefix(['\'', '"']).and_then(|inner| inner.strip_suffix(['\'', '"']));
    let (Some(label), Some(inner)) = (call.label.clone(), inner) else {
        let at = if rest.is_empty() { call.word.clone() } else { rest };
        return asm.report(LineFault::new("ASM023", at, "`lit` needs a name and a text", "write `name lit 'text'`"));
    };
    let name = call.get(label);
    for name in [name.to_owned(), name.to_ascii_uppercase(), name.to_ascii_lowercase()] {
        asm.define_name(name, inner);
    }
}

/// `name equ A`: another name for the accumulator, the carry or DPTR; otherwise an ordinary value.
fn equate(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, kind: AsmSymbolKind) {
    let written = call.get(trim(call.text, call.rest.clone()));
    let core = ["a", "ab", "c", "dptr"].iter().any(|name| written.eq_ignore_ascii_case(name));
    match call.label.clone().filter(|_| core && asm.symbols.get(written, true).is_none()) {
        Some(label) => {
            let again = kind == AsmSymbolKind::Set;
            asm.define_symbol(
                call.get(label.clone()),
                AsmValue::default(),
                AsmSymbolKind::Alias { of: written.into(), redefinable: again },
                label,
            );
        }
        None => constant(asm, call, kind),
    }
}

/// `dd 12345678h`: values of 32 bits, high byte first.
fn doubles(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in super::common::required_arguments(asm, call) {
        let value = super::common::value_of(asm, call.text, part.clone(), 32) as u32;
        asm.emit(&value.to_be_bytes(), part);
    }
}

/// Evaluates a condition; `nul argument` holds if the argument is blank (A51, "Macro operators").
fn condition(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> bool {
    let written = call.get(trim(call.text, call.rest.clone()));
    let nul = written.get(..3).filter(|word| word.eq_ignore_ascii_case("nul")).and_then(|_| written.get(3..));
    let is_own = asm.symbols.get("nul", true).is_some();
    match nul.filter(|rest| rest.starts_with([' ', '\t']) || rest.is_empty() && !is_own) {
        Some(rest) => matches!(rest.trim(), "" | "<>"),
        None => asxxxx::compared(asm, call).unwrap_or_else(|| if_true(asm, call)),
    }
}

/// `using 1`: selects the bank whose addresses AR0 to AR7 are.
fn using(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(bank) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    if !(0..4).contains(&bank) {
        let cause = format!("there is no bank {bank} of registers");
        return asm.report(LineFault::new(
            "ASM003",
            trim(call.text, call.rest.clone()),
            cause,
            "give a number from 0 to 3",
        ));
    }
    asm.family_state.mcs51.bank = bank;
    asm.family_state.mcs51.used_banks |= 1 << bank;
}

/// Interrupt vectors of the 8051, and the assembler and its version, with the names of ASEM-51 1.3 (its
/// manual, predefined symbols).
#[rustfmt::skip]
const PREDEFINED: &[(&str, i64)] = &[
    ("RESET", 0), ("EXTI0", 0x03), ("TIMER0", 0x0B), ("EXTI1", 0x13), ("TIMER1", 0x1B), ("SINT", 0x23), ("TIMER2", 0x2B),
    ("??ASEM_51", 0x8051), ("??VERSION", 0x0130),
];

/// Returns the value of a predefined name. `AR0` to `AR7` are the addresses of R0 to R7 in the bank that
/// `using` selects. `s_CSEG` and `l_CSEG` are the first address and the size of an area; the name of a
/// segment is its first address. sdas8051 predefines only the names of areas: there the others may be names
/// of other modules.
fn own_name(asm: &Assembler<'_>, name: &str) -> Option<i64> {
    let own = &asm.family_state.mcs51;
    let limit = own.areas.limit(name);
    if limit.is_some() || asm.dialect.hooks.is_sdas && external(asm, name) {
        return limit;
    }
    match name.as_bytes() {
        [b'a' | b'A', b'r' | b'R', digit @ b'0'..=b'7'] => Some(own.bank * 8 + i64::from(digit - b'0')),
        _ => PREDEFINED.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, at)| *at),
    }
}

/// `end`: ends the source. as31 ignores `.end` and reads on (its manual, "Assembler directives").
fn end(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    asm.ended = !call.get(call.word.clone()).starts_with('.');
}

/// Switches to the sdas8051 variant for a directive that only sdas8051 has; the pass is read again with it.
fn of_sdas(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if call.get(call.word.clone()).starts_with('.') {
        asm.chip_name_redefined |= !asm.dialect.hooks.is_sdas;
        asm.dialect = &SDAS;
    }
}

/// `.optsdcc -mmcs51`: SDCC wrote the source.
fn of_sdcc(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    of_sdas(asm, call);
    asm.family_state.mcs51.is_from_sdcc = true;
}

/// `.globl name`: declares a name of this module for others, or a name of another module.
fn declare(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let names = cut(asm.dialect, call.text, call.rest.clone()).into_iter().map(|part| call.get(part));
    asm.family_state.mcs51.declared_externals.extend(names.map(|name| name.to_ascii_lowercase()));
}

/// Reports whether an undefined name is external: also the first address and size of an area that this module
/// does not have.
fn external(asm: &Assembler<'_>, name: &str) -> bool {
    let state = &asm.family_state.mcs51;
    let linkers = |name: &str| {
        name.strip_prefix(['s', 'l'])
            .and_then(|rest| rest.strip_prefix('_'))
            .is_some_and(|area| area == area.to_ascii_uppercase())
    };
    asm.undefined_global
        || state.is_from_sdcc
        || state.declared_externals.contains(&name.to_ascii_lowercase())
        || asm.dialect.hooks.is_sdas && linkers(name)
}

/// `.radix x`: b, o, d or x; or a number.
fn radix(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let written = call.get(trim(call.text, call.rest.clone())).to_ascii_lowercase();
    asm.radix = match written.as_str() {
        "b" | "2" => 2,
        "o" | "q" | "8" => 8,
        "d" | "10" | "" => 10,
        "x" | "h" | "16" => 16,
        _ => {
            let cause = format!("`{written}` is not a radix");
            return asm.report(LineFault::new("ASM023", call.rest.clone(), cause, "write b, o, d or x"));
        }
    };
}
