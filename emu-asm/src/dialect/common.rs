//! Directives that all dialects have.

use std::ops::Range;

use super::{AsmDirective, ProvidedInclude, ReadFlow, RepeatIterations};
use crate::arguments::{ArgumentJoin, split_arguments, unquoted_argument};
use crate::chip_names::ChipNames;
use crate::dialect::SectionContent;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{behind_name, behind_quote, byte, cut, skip_space, trim};
use crate::number::read_string;
use crate::symbols::AsmSymbolKind;

/// The directives by name, without a dot.
#[rustfmt::skip]
pub(super) const DIRECTIVES: &[AsmDirective] = &[
    AsmDirective::run("org", org),
    AsmDirective::named("equ", |asm, call| constant(asm, call, AsmSymbolKind::Equ)),
    AsmDirective::named("set", |asm, call| constant(asm, call, AsmSymbolKind::Set)),
    AsmDirective::named("=", assign),
    AsmDirective::named("==", assign),
    AsmDirective::run("db", bytes),
    AsmDirective::run("byte", bytes),
    AsmDirective::run("dw", words),
    AsmDirective::run("word", words),
    AsmDirective::run("ds", space),
    AsmDirective::run("space", space),
    AsmDirective::run("ascii", |asm, call| text(asm, call, false)),
    AsmDirective::run("asciz", |asm, call| text(asm, call, true)),
    AsmDirective::run("include", include),
    AsmDirective::run("define", |asm, call| asm.define_text(call)),
    AsmDirective::run("undef", undefine),
    AsmDirective::run("undefine", undefine),
    AsmDirective::run("error", |asm, call| message(asm, call, true)),
    AsmDirective::run("warning", |asm, call| message(asm, call, false)),
    AsmDirective::run("end", |asm, _| asm.ended = true),
    AsmDirective::run("exitm", |asm, call| asm.leave_macro(call)),
    AsmDirective::run("local", ignore_directive),
    AsmDirective::flow("if", ReadFlow::If(if_true)),
    AsmDirective::flow("ifdef", ReadFlow::If(|asm, call| is_defined(asm, call, true))),
    AsmDirective::flow("ifndef", ReadFlow::If(|asm, call| is_defined(asm, call, false))),
    AsmDirective::flow("ifnotdef", ReadFlow::If(|asm, call| is_defined(asm, call, false))),
    AsmDirective::flow("ifeq", ReadFlow::If(|asm, call| compare(asm, call, |n| n == 0))),
    AsmDirective::flow("ifne", ReadFlow::If(|asm, call| compare(asm, call, |n| n != 0))),
    AsmDirective::flow("ifgt", ReadFlow::If(|asm, call| compare(asm, call, |n| n > 0))),
    AsmDirective::flow("ifge", ReadFlow::If(|asm, call| compare(asm, call, |n| n >= 0))),
    AsmDirective::flow("iflt", ReadFlow::If(|asm, call| compare(asm, call, |n| n < 0))),
    AsmDirective::flow("ifle", ReadFlow::If(|asm, call| compare(asm, call, |n| n <= 0))),
    AsmDirective::flow("ifb", ReadFlow::If(|_, call| is_blank(call))),
    AsmDirective::flow("ifnb", ReadFlow::If(|_, call| !is_blank(call))),
    AsmDirective::flow("ifc", ReadFlow::If(are_alike)),
    AsmDirective::flow("ifnc", ReadFlow::If(|asm, call| !are_alike(asm, call))),
    AsmDirective::flow("elif", ReadFlow::Elif(if_true)),
    AsmDirective::flow("elseif", ReadFlow::Elif(if_true)),
    AsmDirective::flow("else", ReadFlow::Else),
    AsmDirective::flow("endif", ReadFlow::Endif),
    AsmDirective::flow("macro", ReadFlow::Macro),
    AsmDirective::flow("endm", ReadFlow::Endm),
    AsmDirective::flow("rept", ReadFlow::Repeat(times)),
    AsmDirective::flow("irp", ReadFlow::Repeat(each)),
    AsmDirective::flow("irpc", ReadFlow::Repeat(each_character)),
    AsmDirective::flow("endr", ReadFlow::Endr),
];

/// Does nothing.
pub(super) fn ignore_directive(_: &mut Assembler<'_>, _: &DirectiveCall<'_>) {}

/// Reports that a directive has no effect here.
pub(super) fn report_no_effect(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let cause = format!("`{}` has no effect here", call.get(call.word.clone()));
    asm.report(
        LineFault::new("ASM027", call.word.clone(), cause, "emu has no linker and no such listing option").note(),
    );
}

/// `.org`: sets the address of what follows.
pub(super) fn org(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = required_arguments(asm, call);
    let Some(at) = parts.first().and_then(|part| asm.evaluate_address(call.text, part.clone())) else {
        asm.address_unknown = true;
        return;
    };
    if !(0..1 << 32).contains(&at) {
        asm.address_unknown = true;
        let cause = format!("the address {at} is not in 0..=0xFFFFFFFF");
        return asm.report(LineFault::new(
            "ASM003",
            trim(call.text, call.rest.clone()),
            cause,
            "give an address of a memory",
        ));
    }
    // As with avr-as, the address counts from the start of the section.
    let shift = asm.out.shift();
    if shift != 0 {
        asm.report_shifted_org(call.word.clone(), shift);
    }
    let at = at + shift;
    let fill = match parts.get(1) {
        Some(part) => Some(value_of(asm, call.text, part.clone(), 8) as u8),
        None => asm.dialect.org_fills,
    };
    let gap = at - asm.out.next_address();
    match fill {
        // Filling with FFh leaves erased memory as it is.
        Some(byte) if byte != 0xFF && gap > 0 && gap <= 0x100_0000 => {
            let gap = vec![byte; gap as usize * asm.out.unit() as usize];
            asm.emit(&gap, call.rest.clone());
        }
        _ => asm.out.set_address(at),
    }
}

/// `name equ value`, and `equ name, value`.
pub(super) fn constant(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, kind: AsmSymbolKind) {
    if call.label.is_some() {
        return asm.define_from_directive(call, kind);
    }
    // `.equ name, value`; Atmel's assembler writes `.equ name = value`.
    let rest = trim(call.text, call.rest.clone());
    let end = behind_name(call.text, rest.start, true).min(rest.end);
    let name = rest.start..end;
    let mark = skip_space(call.text, end);
    if mark >= rest.end || !matches!(byte(call.text, mark), b',' | b'=') {
        let cause = format!("`{}` needs a name and a value", call.get(call.word.clone()));
        return asm.report(LineFault::new(
            "ASM023",
            call.word.clone(),
            cause,
            "write `name equ value` or `.equ name, value`",
        ));
    }
    let from = mark + 1;
    let text = call.get(name.clone());
    if behind_name(text, 0, true) != text.len() || text.is_empty() {
        let cause = format!("`{text}` is not a name");
        return asm.report(LineFault::new(
            "ASM005",
            name.clone(),
            cause,
            "a name begins with a letter and has letters, digits and _",
        ));
    }
    asm.define_value(text, name.clone(), call.text, from..call.rest.end, kind);
}

/// `name = value`; for the location counter it is `org`.
fn assign(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let name = call.label.clone().map_or("", |label| call.get(label));
    if asm.dialect.location_counter_names.contains(&name) {
        return org(asm, call);
    }
    asm.define_from_directive(call, AsmSymbolKind::Set);
}

/// Returns a value of `bits` bits; negative values become their two's complement.
pub(super) fn value_of(asm: &mut Assembler<'_>, text: &str, range: Range<usize>, bits: u32) -> i64 {
    let Some(value) = asm.evaluate(text, range.clone()) else { return 0 };
    let limit = 1i64 << bits;
    let low_byte = bits == 8 && value.is_label && asm.dialect.hooks.is_sdas;
    let least = if asm.dialect.hooks.complements { -limit } else { -limit / 2 };
    if !value.is_unknown && !low_byte && !(least..limit).contains(&value.number) {
        let cause = format!("{} does not fit into {bits} bits: its upper bits are dropped", value.number);
        asm.report(LineFault::new("ASM030", range, cause, "select the bits with & or low()").warning());
    }
    value.number & (limit - 1)
}

/// `.db`: emits bytes and texts.
pub(super) fn bytes(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        text_or_byte(asm, call, part);
    }
}

/// Emits quoted text, or a value of 8 bits.
pub(super) fn text_or_byte(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, part: Range<usize>) {
    let text = read_string(call.text, part.start, part.end);
    match text.filter(|text| byte(call.text, part.start) == b'"' || text.len() != 1) {
        Some(text) => asm.emit(&text, part),
        None => {
            let value = value_of(asm, call.text, part.clone(), 8);
            asm.emit(&[value as u8], part);
        }
    }
}

/// `.dw`: emits 16-bit words in the byte order of the dialect.
pub(super) fn words(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let value = value_of(asm, call.text, part.clone(), 16) as u16;
        let bytes = if asm.dialect.big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        asm.emit(&bytes, part);
    }
}

/// Returns the arguments; reports an error if there are none.
pub(super) fn required_arguments(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> Vec<Range<usize>> {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    if parts.is_empty() {
        let cause = format!("`{}` has no values", call.get(call.word.clone()));
        asm.report(LineFault::new(
            "ASM023",
            call.word.clone(),
            cause,
            "give one value or several with commas between them",
        ));
    }
    parts
}

/// Advances to the next even or odd address, counted from the start of the section.
pub(super) fn parity(asm: &mut Assembler<'_>, _: &DirectiveCall<'_>, odd: i64) {
    let here = asm.out.next_address();
    let base = asm.out.initial_sections.get(asm.out.current).map_or(0, |first| first.pos);
    asm.out.set_address(here + ((here - base) & 1 ^ odd));
}

/// Reserves a number of addresses; fills them if a value is given.
pub(super) fn space(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    reserve_room(asm, call, 1);
}

/// Reserves a count times `each` addresses.
pub(super) fn reserve_room(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, each: i64) {
    let mut parts = required_arguments(asm, call).into_iter();
    let (Some(count), value) = (parts.next(), parts.next()) else { return };
    let Some(n) = asm.evaluate_number(call.text, count.clone()) else { return };
    if !(0..=0x100_0000).contains(&n) {
        let cause = format!("{n} addresses cannot be reserved");
        return asm.report(LineFault::new("ASM003", count, cause, "give a number from 0 to the size of the memory"));
    }
    let fills = (asm.dialect.space_fills || value.is_some()) && asm.out.holds() != SectionContent::Addresses;
    if !fills {
        let here = asm.out.next_address();
        return asm.out.set_address(here + n * each);
    }
    let byte = value.map_or(0, |part| value_of(asm, call.text, part, 8));
    let size = (n * each) as usize * asm.out.unit() as usize;
    asm.emit(&vec![byte as u8; size], count);
}

/// An alignment: the boundary at which the section continues, and the fill up to it.
pub(super) struct Alignment {
    /// Align to a multiple of this.
    pub step: i64,
    /// The fill value.
    pub fill: i64,
    /// Size of the fill value in bytes.
    pub size: usize,
    /// Do nothing if the fill would need more bytes than this.
    pub most: Option<i64>,
}

/// Advances to the next multiple.
pub(super) fn align_to(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, to: &Alignment) {
    let here = asm.out.next_address();
    let gap = (here + to.step - 1).div_euclid(to.step) * to.step - here;
    if to.most.is_some_and(|most| gap > most) {
        return;
    }
    if let Some(section) = asm.out.sections.get_mut(asm.out.current) {
        section.align = section.align.max(to.step);
    }
    if asm.out.holds() == SectionContent::Addresses {
        return asm.out.set_address(here + gap);
    }
    if gap % to.size as i64 != 0 {
        let cause = format!("the {gap} bytes up to there are no multiple of the {} bytes that fill them", to.size);
        return asm.report(LineFault::new("ASM003", call.rest.clone(), cause, "align with single bytes before it"));
    }
    let pattern = to.fill.to_le_bytes();
    let bytes = pattern.get(..to.size).unwrap_or_default().repeat(gap as usize / to.size.max(1));
    asm.emit(&bytes, call.rest.clone());
}

/// Returns the bytes of adjacent quoted texts, `"one" "two"`, each followed by a 0 if `zero`; `None` if
/// anything else is among them.
fn strings(text: &str, part: Range<usize>, zero: bool) -> Option<Vec<u8>> {
    let ends = |mut bytes: Vec<u8>| {
        bytes.extend(zero.then_some(0));
        bytes
    };
    if let Some(one) = read_string(text, part.start, part.end) {
        return Some(ends(one));
    }
    let (mut bytes, mut at) = (Vec::new(), part.start);
    while at < part.end {
        let end = behind_quote(text, at).filter(|end| byte(text, at) == b'"' && *end <= part.end)?;
        bytes.extend(ends(read_string(text, at, end)?));
        at = skip_space(text, end);
    }
    Some(bytes).filter(|_| !part.is_empty())
}

/// Emits texts in quotes; with `zero` a byte 0 follows each of them.
pub(super) fn text(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, zero: bool) {
    for part in required_arguments(asm, call) {
        match strings(call.text, part.clone(), zero) {
            Some(bytes) => asm.emit(&bytes, part),
            None => {
                let cause = format!("`{}` is not a text in quotes", call.get(part.clone()));
                asm.report(LineFault::new("ASM011", part, cause, "write it as \"text\""));
            }
        }
    }
}

/// `.include`: reads another file in place of the line.
pub(super) fn include(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let inner = written.trim_matches(|c| matches!(c, '"' | '\'' | '<' | '>' | '(' | ')')).trim();
    // Windows paths.
    let inner = &inner.replace('\\', "/");
    if inner.is_empty() {
        let hint = "write `include \"file\"`";
        return asm.report(LineFault::new("ASM023", call.word.clone(), "the name of a file is missing", hint));
    }
    let base = inner.rsplit('/').next().unwrap_or(inner).to_ascii_lowercase();
    let with_folder = inner.to_ascii_lowercase();
    let provided = match (asm.dialect.include_provided)(asm.chip, &with_folder) {
        ProvidedInclude::NotProvided => (asm.dialect.include_provided)(asm.chip, &base),
        found => found,
    };
    match provided {
        ProvidedInclude::Chip => {}
        ProvidedInclude::OtherChip(cause, hint) => asm.report(LineFault::new("ASM015", rest, cause, hint)),
        ProvidedInclude::NamedChip(name, cause, hint) => match asm.find_chip.and_then(|named| named(&name)) {
            Some(other) => {
                asm.chip_names = ChipNames::of(other);
                let hint = "its names and numbers are used; name one chip in both places";
                asm.report(LineFault::new("ASM043", rest, cause, hint).warning());
            }
            // The chip is unknown, but the include folders have its file.
            None if asm.can_open(inner) => {
                asm.include(inner, &DirectiveCall { rest, label: None, word: call.word.clone(), ..*call })
            }
            None => asm.report(LineFault::new("ASM015", rest, cause, hint)),
        },
        ProvidedInclude::NotProvided => {
            asm.include(inner, &DirectiveCall { rest, label: None, word: call.word.clone(), ..*call })
        }
    }
}

fn undefine(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let name = call.get(trim(call.text, call.rest.clone()));
    asm.defines.remove(name);
}

/// `.purgem name` and `.mdelete name`: delete the macro.
pub(super) fn purge(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let name = call.get(part.clone());
        if asm.macros.remove(&name.to_ascii_lowercase()).is_none() {
            let cause = format!("there is no macro `{name}`");
            asm.report(LineFault::new(
                "ASM023",
                part,
                cause,
                "give the name of a macro that is defined before this line",
            ));
        }
    }
}

/// Reports the text of the line as an error, or as a warning if `error` is false.
pub(super) fn message(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, error: bool) {
    let rest = trim(call.text, call.rest.clone());
    let text = match call.get(rest.clone()).trim_matches('"') {
        "" => "the line gives no reason".to_owned(),
        text => text.to_owned(),
    };
    let at = if rest.is_empty() { call.word.clone() } else { rest };
    let fault = LineFault::new(if error { "ASM024" } else { "ASM025" }, at, text, "the program itself says so");
    asm.report(if error { fault } else { fault.warning() });
}

/// Returns whether the condition of an `.if` is not 0.
pub(super) fn if_true(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> bool {
    if call.get(call.word.clone()).starts_with('#') {
        return asm.evaluate_c_condition(call.text, call.rest.clone()) != 0;
    }
    asm.evaluate_number(call.text, call.rest.clone()).is_some_and(|n| n != 0)
}

/// Compares the value with 0, or with a second value if there are two.
fn compare(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, holds: fn(i64) -> bool) -> bool {
    let parts = required_arguments(asm, call);
    let mut numbers = parts.iter().map(|part| asm.evaluate_number(call.text, part.clone()).unwrap_or(0));
    let (first, second) = (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0));
    drop(numbers);
    let difference = first.wrapping_sub(second);
    // sdas8051 compares 32 bits with a sign.
    holds(if asm.dialect.hooks.is_sdas { i64::from(difference as i32) } else { difference })
}

/// Returns whether the argument is empty or `<>`.
pub(super) fn is_blank(call: &DirectiveCall<'_>) -> bool {
    matches!(call.get(trim(call.text, call.rest.clone())), "" | "<>")
}

fn are_alike(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> bool {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let text = |i: usize| parts.get(i).map_or("", |part| call.get(part.clone()));
    text(0) == text(1)
}

/// Returns whether the symbol in the argument exists, or with `wanted` false, whether it does not.
pub(super) fn is_defined(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, wanted: bool) -> bool {
    let name = call.get(trim(call.text, call.rest.clone()));
    // `$ifdef (NAME)`.
    let name = name.strip_prefix('(').and_then(|inner| inner.strip_suffix(')')).map_or(name, str::trim);
    let symbol = asm.symbols.get(name, asm.dialect.ignores_case).is_some_and(|symbol| symbol.pass == asm.pass);
    // Names of interrupt vectors are not counted: other assemblers do not predefine them.
    let own = || name.starts_with("??") && (asm.dialect.hooks.own_name_value)(asm, name).is_some();
    let found = symbol || asm.find_define(name).is_some() || asm.chip_names.get(name).is_some() || own();
    found == wanted
}

fn times(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> RepeatIterations {
    let n = asm.evaluate_number(call.text, call.rest.clone()).unwrap_or(0);
    RepeatIterations { name: None, texts: Vec::new(), count: n.max(0) as u64 }
}

/// Returns the name that a repetition replaces, and the arguments after it.
fn name_and_arguments(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> (String, Vec<Range<usize>>) {
    required_arguments(asm, call);
    let join = ArgumentJoin::of(asm.dialect, call.get(call.word.clone()));
    let mut parts = split_arguments(asm.dialect, call.text, call.rest.clone(), join).into_iter();
    let name = parts.next().map_or("", |part| call.get(part)).to_owned();
    (name, parts.collect())
}

fn each(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> RepeatIterations {
    let (name, list) = name_and_arguments(asm, call);
    // `irp x, <1, 2>`: the list in angle brackets.
    let list = match list.as_slice() {
        [all] if asm.dialect.hooks.angle_arguments && byte(call.text, all.start.wrapping_sub(1)) == b'<' => {
            cut(asm.dialect, call.text, all.clone())
        }
        _ => list,
    };
    let mut texts: Vec<String> = list.into_iter().map(|part| unquoted_argument(asm.dialect, call.get(part))).collect();
    // avr-as reads the lines once for an empty list.
    if texts.is_empty() && asm.dialect.spaced_arguments {
        texts.push(String::new());
    }
    RepeatIterations { name: Some(name), texts, count: 0 }
}

fn each_character(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> RepeatIterations {
    let (name, parts) = name_and_arguments(asm, call);
    let text = parts.into_iter().next().map_or("", |part| call.get(part));
    // In sdas8051 the quotes are characters too.
    let text = if asm.dialect.hooks.is_sdas { text } else { text.trim_matches('"') };
    RepeatIterations { name: Some(name), texts: text.chars().map(String::from).collect(), count: 0 }
}
