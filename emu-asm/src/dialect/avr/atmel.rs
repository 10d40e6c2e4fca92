//! The AVR dialect of Atmel's assembler (AVRASM2; avra). Program memory counts in words, `.byte` reserves
//! memory, `PC` is the address of the line, and `@0` is a macro argument ("AVR Assembler User Guide",
//! Microchip DS40001917).

use emu_core::NamedConstant;
use emu_core::chip::Chip;

use super::super::common::{bytes, constant, ignore_directive, include, message, purge, reserve_room, words};
use super::super::{
    AsmDialect, AsmDirective, C_OPERATORS, DialectHooks, ProvidedInclude, ReadFlow, SectionContent, UnaryOperator,
};
use super::atmel_names::further_names;
use super::{AVR, longs, section};
use crate::NamedText;
use crate::arguments::scan_name;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::{AsmRefusal, CauseAndHint, LineFault};
use crate::lines::{AsmLine, RewrittenText, byte, trim};
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

/// Bytes of a program word.
const WORD: u32 = 2;
/// The first address behind the registers of `in` and `out`, and the I/O address of the last of them.
const FIRST_EXTENDED: i64 = 0x60;
const LAST_IO: i64 = 0x3F;
/// Arguments of a macro, `@0` to `@9`.
pub(crate) const ARGUMENTS: usize = 10;

/// The unary operators of C, and functions that return a part of a value.
#[rustfmt::skip]
const UNARY: &[UnaryOperator] = &[
    ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| i64::from(n == 0)),
    ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF), ("byte1", 11, |n| n & 0xFF), ("byte2", 11, |n| n >> 8 & 0xFF),
    ("byte3", 11, |n| n >> 16 & 0xFF), ("byte4", 11, |n| n >> 24 & 0xFF), ("lwrd", 11, |n| n & 0xFFFF), ("hwrd", 11, |n| n >> 16 & 0xFFFF),
    ("page", 11, |n| n >> 16 & 0x3F), ("exp2", 11, |n| u32::try_from(n).ok().and_then(|n| 1i64.checked_shl(n)).unwrap_or(0)),
    ("log2", 11, |n| n.checked_ilog2().map_or(0, i64::from)), ("abs", 11, |n| n.wrapping_abs()),
];

/// The dialect.
#[rustfmt::skip]
pub(super) const ATMEL: AsmDialect = AsmDialect {
    separators: b"",
    line_comments: &["#"],
    location_counter_names: &["PC", "pc"],
    counter_at_line_start: true,
    counter_after_instruction: false,
    operators: C_OPERATORS,
    unary: UNARY,
    true_value: 1,
    numbered_labels: false,
    ignores_case: true,
    org_fills: None,
    spaced_arguments: false,
    space_fills: false,
    hooks: DialectHooks {
        is_atmel: true,
        names_io_addresses: |_| true,
        digit_groups: Some('_'),
        cut,
        no_bytes: |_| Some(CauseAndHint::new("a program cannot fill RAM", "reserve room with .byte, as in `.byte 2`")),
        ..DialectHooks::NONE
    },
    directives: &[
        AsmDirective::run("cseg", |asm, call| segment(asm, call, "text")),
        AsmDirective::run("dseg", |asm, call| segment(asm, call, "dseg")),
        AsmDirective::run("eseg", |asm, call| segment(asm, call, "eeprom")),
        AsmDirective::run("byte", reserve),
        AsmDirective::run("db", |asm, call| padded(asm, call, bytes)),
        AsmDirective::run("dw", words),
        AsmDirective::run("dd", longs),
        AsmDirective::run("dq", super::gas::quads),
        AsmDirective::named("def", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
        AsmDirective::run("undef", |asm, call| if asm.macros.contains_key(&call.get(trim(call.text, call.rest.clone())).to_ascii_lowercase()) { purge(asm, call) }),
        AsmDirective::flow("endmacro", ReadFlow::Endm),
        AsmDirective::run("include", including),
        AsmDirective::run("message", |asm, call| message(asm, call, false)),
        AsmDirective::run("exit", |asm, _| asm.ended = true),
        AsmDirective::run("device", ignore_directive),
        AsmDirective::run("list", ignore_directive),
        AsmDirective::run("nolist", ignore_directive),
        AsmDirective::run("listmac", ignore_directive),
        AsmDirective::run("overlap", ignore_directive),
        AsmDirective::run("nooverlap", ignore_directive),
        AsmDirective::run("csegsize", ignore_directive),
        AsmDirective::run("includepath", ignore_directive),
        AsmDirective::run("pragma", ignore_directive),
    ],
    predefined: |_| Vec::new(),
    ..AVR
};

/// Switches to this dialect; the pass is read again with it.
pub(super) fn switch(asm: &mut Assembler<'_>) {
    if asm.dialect.hooks.is_atmel {
        return;
    }
    asm.dialect = &ATMEL;
    asm.chip_name_redefined = true;
    let sections = asm.out.initial_sections.iter_mut().chain(&mut asm.out.sections);
    sections.filter(|section| section.holds == SectionContent::Image).for_each(|section| section.unit = WORD);
}

/// `.cseg` and the other segment directives.
pub(super) fn segment(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, name: &str) {
    switch(asm);
    section(asm, call, name);
}

/// `.equ name = value`, which only Atmel's assembler has; `.equ name, value`.
pub(super) fn equate(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if call.label.is_none() && call.get(call.rest.clone()).contains('=') && !call.get(call.rest.clone()).contains(',') {
        switch(asm);
    }
    constant(asm, call, AsmSymbolKind::Equ);
}

/// `.include "m328Pdef.inc"`, whose names come from the chip's data, and other files.
pub(super) fn including(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone()).trim_matches(['"', '<', '>']);
    if written.to_ascii_lowercase().ends_with("def.inc") {
        switch(asm);
        let file = written.rsplit(['/', '\\']).next().unwrap_or(written).to_ascii_lowercase();
        if matches!((asm.dialect.include_provided)(asm.chip, &file), ProvidedInclude::Chip) {
            for (name, value) in names(asm.chip) {
                asm.define_symbol(&name, AsmValue::of(value), AsmSymbolKind::Set, rest.clone());
            }
        }
    }
    include(asm, call);
}

/// Returns names of Atmel's files other than registers: sizes in words, interrupt addresses, and further
/// ones.
fn names(chip: &Chip) -> Vec<(String, i64)> {
    let constant = |wanted: &str| {
        (chip.constants)()
            .into_iter()
            .find(|NamedConstant { name, .. }| *name == wanted)
            .map_or(0, |NamedConstant { value, .. }| i64::from(value))
    };
    let (ram, page) = (i64::from(chip.ram_start), constant("SPM_PAGESIZE") / i64::from(WORD));
    let vector = i64::from(chip.words_per_vector);
    let fixed = [
        ("SRAM_START", ram),
        ("SRAM_SIZE", chip.ram_len.into()),
        ("IOEND", if ram == FIRST_EXTENDED { LAST_IO } else { ram - 1 }),
        // 0 without memory outside.
        ("XRAMEND", Some(constant("XRAMEND")).filter(|end| *end != constant("RAMEND")).unwrap_or(0)),
        ("EEPROMEND", constant("E2END")),
        ("FLASHEND", i64::from(chip.flash_bytes) / i64::from(WORD) - 1),
        ("PAGESIZE", page),
        ("INT_VECTORS_SIZE", chip.vectors.len() as i64 * vector),
    ];
    let vectors = chip
        .vectors
        .iter()
        .zip(0i64..)
        .filter_map(|(name, number)| Some((format!("{}addr", interrupt(name)?), number * vector)));
    let fixed = fixed.into_iter().map(|(name, value)| (name.to_owned(), value));
    fixed.chain(vectors).chain(further_names(chip)).collect()
}

/// Returns the name that Atmel's files give an interrupt, without the `addr` at its end.
fn interrupt(name: &str) -> Option<String> {
    let known = match name {
        "WDT" => "WDT",
        "SPI_STC" => "SPI",
        "ADC" => "ADCC",
        "EE_READY" | "EE_RDY" => "ERDY",
        "ANALOG_COMP" | "ANA_COMP" => "ACI",
        "TWI" => "TWI",
        "SPM_READY" | "SPM_RDY" => "SPMR",
        _ => "",
    };
    if !known.is_empty() {
        return Some(known.to_owned());
    }
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    if let Some(number) = name.strip_prefix("INT") {
        return Some(format!("INT{number}"));
    }
    if let Some(number) = name.strip_prefix("PCINT") {
        return Some(format!("PCI{number}"));
    }
    let (unit, what) = name.split_once('_')?;
    let n = digits(unit);
    let what = match (unit.trim_end_matches(|c: char| c.is_ascii_digit()), what) {
        ("TIMER", "OVF") => format!("OVF{n}"),
        ("TIMER", "CAPT") => format!("ICP{n}"),
        ("TIMER", rest) if rest.starts_with("COMP") => format!("OC{n}{}", rest.trim_start_matches("COMP")),
        ("USART", "RX" | "RXC") => format!("URXC{n}"),
        ("USART", "UDRE") => format!("UDRE{n}"),
        ("USART", "TX" | "TXC") => format!("UTXC{n}"),
        _ => return None,
    };
    Some(what)
}

/// `.byte 2`: reserves RAM or EEPROM.
fn reserve(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    if asm.out.holds() == SectionContent::Image {
        let cause = "`byte` reserves room, and program memory is not reserved";
        let hint = "give the bytes with .db, or reserve space after .dseg";
        return asm.report(LineFault::new("ASM023", call.word.clone(), cause, hint));
    }
    reserve_room(asm, call, 1);
}

/// Emits bytes; in program memory it pads a list of them to whole words.
fn padded(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, give: fn(&mut Assembler<'_>, &DirectiveCall<'_>)) {
    give(asm, call);
    let odd = asm.out.section().is_some_and(|section| section.holds == SectionContent::Image && section.pos % 2 != 0);
    if odd {
        asm.emit(&[0], call.word.clone());
    }
}

/// Converts a target from words to bytes, because instructions count bytes here. A constant of more than 8
/// bits is truncated, with a warning.
fn cut(_: &Chip, kind: &str, width: u32, value: i64) -> Option<(i64, Option<AsmRefusal>)> {
    match kind {
        "target" => Some((value.saturating_mul(WORD.into()), None)),
        "constant" if width == 8 && !(-0x80..0x100).contains(&value) => {
            let cause = format!("{value} does not fit into 8 bits: its upper bits are dropped");
            Some((value & 0xFF, Some(AsmRefusal::new("ASM030", cause, "select the bits with low() or &"))))
        }
        _ => None,
    }
}

/// Returns a macro line with its arguments substituted for `@0` to `@9`, and its labels renamed.
pub(crate) fn substitute_numbered(dialect: &AsmDialect, line: &AsmLine, values: &[NamedText]) -> AsmLine {
    let text: &str = &line.text;
    let (mut out, mut at, mut done) = (RewrittenText::default(), 0, 0);
    let value = |name: &str| values.iter().find(|value| value.name == name).map(|value| value.text.as_str());
    while at < text.len() {
        let end = match scan_name(dialect, text, at) {
            _ if byte(text, at) == b'@' => at + 2,
            Ok(end) => end,
            Err(behind) => {
                at = behind;
                continue;
            }
        };
        if let Some(value) = text.get(at..end).and_then(value) {
            out.copy(text, done..at);
            out.put(value, at);
            done = end;
        }
        at = end;
    }
    out.copy(text, done..text.len());
    out.into_line(line)
}
