//! Directives that all dialects have.

use std::ops::Range;

use super::{Directive, Flow, Provided, Turns};
use crate::arguments::{Join, arguments};
use crate::dialect::Holds;
use crate::engine::{Asm, Call};
use crate::fault::Fault;
use crate::known::Known;
use crate::number::string;
use crate::symbols::Kind;
use crate::text::{behind_name, byte, cut, skip_space, trim};

/// The directives by name, without a dot.
#[rustfmt::skip]
pub(super) const DIRECTIVES: &[Directive] = &[
    Directive::run("org", org),
    Directive::named("equ", |asm, call| constant(asm, call, Kind::Equ)),
    Directive::named("set", |asm, call| constant(asm, call, Kind::Set)),
    Directive::named("=", assign),
    Directive::named("==", assign),
    Directive::run("db", bytes),
    Directive::run("byte", bytes),
    Directive::run("dw", words),
    Directive::run("word", words),
    Directive::run("ds", space),
    Directive::run("space", space),
    Directive::run("ascii", |asm, call| text(asm, call, false)),
    Directive::run("asciz", |asm, call| text(asm, call, true)),
    Directive::run("include", include),
    Directive::run("define", |asm, call| asm.define_text(call)),
    Directive::run("undef", undefine),
    Directive::run("undefine", undefine),
    Directive::run("error", |asm, call| message(asm, call, true)),
    Directive::run("warning", |asm, call| message(asm, call, false)),
    Directive::run("end", |asm, _| asm.ended = true),
    Directive::run("exitm", |asm, call| asm.leave_macro(call)),
    Directive::run("local", nothing),
    Directive::flow("if", Flow::If(if_true)),
    Directive::flow("ifdef", Flow::If(|asm, call| is_defined(asm, call, true))),
    Directive::flow("ifndef", Flow::If(|asm, call| is_defined(asm, call, false))),
    Directive::flow("ifnotdef", Flow::If(|asm, call| is_defined(asm, call, false))),
    Directive::flow("ifeq", Flow::If(|asm, call| compare(asm, call, |n| n == 0))),
    Directive::flow("ifne", Flow::If(|asm, call| compare(asm, call, |n| n != 0))),
    Directive::flow("ifgt", Flow::If(|asm, call| compare(asm, call, |n| n > 0))),
    Directive::flow("ifge", Flow::If(|asm, call| compare(asm, call, |n| n >= 0))),
    Directive::flow("iflt", Flow::If(|asm, call| compare(asm, call, |n| n < 0))),
    Directive::flow("ifle", Flow::If(|asm, call| compare(asm, call, |n| n <= 0))),
    Directive::flow("ifb", Flow::If(|_, call| is_blank(call))),
    Directive::flow("ifnb", Flow::If(|_, call| !is_blank(call))),
    Directive::flow("ifc", Flow::If(|_, call| are_alike(call))),
    Directive::flow("ifnc", Flow::If(|_, call| !are_alike(call))),
    Directive::flow("elif", Flow::Elif(if_true)),
    Directive::flow("elseif", Flow::Elif(if_true)),
    Directive::flow("else", Flow::Else),
    Directive::flow("endif", Flow::Endif),
    Directive::flow("macro", Flow::Macro),
    Directive::flow("endm", Flow::Endm),
    Directive::flow("rept", Flow::Repeat(times)),
    Directive::flow("irp", Flow::Repeat(each)),
    Directive::flow("irpc", Flow::Repeat(each_character)),
    Directive::flow("endr", Flow::Endr),
];

/// Does nothing.
pub(super) fn nothing(_: &mut Asm<'_>, _: &Call<'_>) {}

/// Tells that a directive has no effect here.
pub(super) fn no_effect(asm: &mut Asm<'_>, call: &Call<'_>) {
    let cause = format!("`{}` has no effect here", call.get(call.word.clone()));
    asm.tell(
        Fault::new("ASM027", call.word.clone(), cause, "there is no linker and no listing option behind it").note(),
    );
}

pub(super) fn org(asm: &mut Asm<'_>, call: &Call<'_>) {
    let parts = wanted(asm, call);
    let Some(at) = parts.first().and_then(|part| asm.place_of(call.text, part.clone())) else {
        asm.astray = true;
        return;
    };
    if !(0..1 << 32).contains(&at) {
        asm.astray = true;
        let cause = format!("the address {at} is not in 0..=0xFFFFFFFF");
        return asm.tell(Fault::new(
            "ASM003",
            trim(call.text, call.rest.clone()),
            cause,
            "give an address of a memory",
        ));
    }
    if asm.out.is_shifted() {
        return asm.tell_org(call.word.clone());
    }
    let fill = match parts.get(1) {
        Some(part) => Some(value_of(asm, call.text, part.clone(), 8) as u8),
        None => asm.d.org_fills,
    };
    let gap = at - asm.out.here();
    match fill {
        // What is filled as it is erased is left as it is.
        Some(byte) if byte != 0xFF && gap > 0 && gap <= 0x100_0000 && asm.out.begun() => {
            let gap = vec![byte; gap as usize * asm.out.unit() as usize];
            asm.emit(&gap, call.rest.clone());
        }
        _ => asm.out.go(at),
    }
}

/// `name equ value`, and `equ name, value`.
pub(super) fn constant(asm: &mut Asm<'_>, call: &Call<'_>, kind: Kind) {
    if call.label.is_some() {
        return asm.give(call, kind);
    }
    // `.equ name, value`; Atmel's assembler writes `.equ name = value`.
    let rest = trim(call.text, call.rest.clone());
    let end = behind_name(call.text, rest.start, true).min(rest.end);
    let name = rest.start..end;
    let mark = skip_space(call.text, end);
    if mark >= rest.end || !matches!(byte(call.text, mark), b',' | b'=') {
        let cause = format!("`{}` needs a name and a value", call.get(call.word.clone()));
        return asm.tell(Fault::new(
            "ASM023",
            call.word.clone(),
            cause,
            "write `name equ value` or `.equ name, value`",
        ));
    }
    let from = mark + 1;
    let text = call.get(name.clone());
    if behind_name(text, 0, true) != text.len() || text.is_empty() {
        let cause = format!("`{text}` is no name");
        return asm.tell(Fault::new(
            "ASM005",
            name.clone(),
            cause,
            "a name begins with a letter and has letters, digits and _",
        ));
    }
    asm.give_value(text, name.clone(), call.text, from..call.rest.end, kind);
}

/// `name = value`; to the location counter it is `org`.
fn assign(asm: &mut Asm<'_>, call: &Call<'_>) {
    let name = call.label.clone().map_or("", |label| call.get(label));
    if asm.d.here.contains(&name) {
        return org(asm, call);
    }
    asm.give(call, Kind::Set);
}

/// A value that fills `size` bytes, negative ones as their complement.
pub(super) fn value_of(asm: &mut Asm<'_>, text: &str, range: Range<usize>, bits: u32) -> i64 {
    let Some(value) = asm.value(text, range.clone()) else { return 0 };
    let limit = 1i64 << bits;
    let low_byte = bits == 8 && value.label && asm.d.hooks.is_sdas;
    let least = if asm.d.hooks.complements { -limit } else { -limit / 2 };
    if !value.unknown && !low_byte && !(least..limit).contains(&value.n) {
        let cause = format!("{} does not fit into {bits} bits: its upper bits are left out", value.n);
        asm.tell(Fault::new("ASM030", range, cause, "give the bits that are meant with & or low()").warning());
    }
    value.n & (limit - 1)
}

pub(super) fn bytes(asm: &mut Asm<'_>, call: &Call<'_>) {
    let parts = wanted(asm, call);
    for part in parts {
        match string(call.text, part.start, part.end)
            .filter(|text| byte(call.text, part.start) == b'"' || text.len() != 1)
        {
            Some(text) => asm.emit(&text, part),
            None => {
                let value = value_of(asm, call.text, part.clone(), 8);
                asm.emit(&[value as u8], part);
            }
        }
    }
}

pub(super) fn words(asm: &mut Asm<'_>, call: &Call<'_>) {
    for part in wanted(asm, call) {
        let value = value_of(asm, call.text, part.clone(), 16) as u16;
        let bytes = if asm.d.big_endian { value.to_be_bytes() } else { value.to_le_bytes() };
        asm.emit(&bytes, part);
    }
}

/// The arguments; told where there are none.
pub(super) fn wanted(asm: &mut Asm<'_>, call: &Call<'_>) -> Vec<Range<usize>> {
    let parts = cut(call.text, call.rest.clone());
    if parts.is_empty() {
        let cause = format!("`{}` stands without values", call.get(call.word.clone()));
        asm.tell(Fault::new("ASM023", call.word.clone(), cause, "give one value or several with commas between them"));
    }
    parts
}

/// Goes on at the next even or odd address, as it counts from the begin of the section.
pub(super) fn parity(asm: &mut Asm<'_>, _: &Call<'_>, odd: i64) {
    let here = asm.out.here();
    let base = asm.out.first.get(asm.out.current).map_or(0, |first| first.pos);
    asm.out.go(here + ((here - base) & 1 ^ odd));
}

/// Room of so many addresses; filled with a value where one is given.
pub(super) fn space(asm: &mut Asm<'_>, call: &Call<'_>) {
    room(asm, call, 1);
}

/// Room of so many times `each` addresses.
pub(super) fn room(asm: &mut Asm<'_>, call: &Call<'_>, each: i64) {
    let mut parts = wanted(asm, call).into_iter();
    let (Some(count), value) = (parts.next(), parts.next()) else { return };
    let Some(n) = asm.number(call.text, count.clone()) else { return };
    if !(0..=0x100_0000).contains(&n) {
        let cause = format!("{n} addresses cannot be reserved");
        return asm.tell(Fault::new("ASM003", count, cause, "give a number from 0 to the size of the memory"));
    }
    let fills = (asm.d.space_fills || value.is_some()) && asm.out.holds() != Holds::Addresses;
    if !fills {
        let here = asm.out.here();
        return asm.out.go(here + n * each);
    }
    let byte = value.map_or(0, |part| value_of(asm, call.text, part, 8));
    let size = (n * each) as usize * asm.out.unit() as usize;
    asm.emit(&vec![byte as u8; size], count);
}

pub(super) fn text(asm: &mut Asm<'_>, call: &Call<'_>, zero: bool) {
    for part in wanted(asm, call) {
        match string(call.text, part.start, part.end) {
            Some(mut bytes) => {
                bytes.extend(zero.then_some(0));
                asm.emit(&bytes, part);
            }
            None => {
                let cause = format!("`{}` is no text in quotes", call.get(part.clone()));
                asm.tell(Fault::new("ASM011", part, cause, "write it as \"text\""));
            }
        }
    }
}

pub(super) fn include(asm: &mut Asm<'_>, call: &Call<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let inner = written.trim_matches(|c| matches!(c, '"' | '\'' | '<' | '>' | '(' | ')')).trim();
    // Paths as Windows writes them.
    let inner = &inner.replace('\\', "/");
    if inner.is_empty() {
        let hint = "write `include \"file\"`";
        return asm.tell(Fault::new("ASM023", call.word.clone(), "the name of a file is missing", hint));
    }
    let base = inner.rsplit('/').next().unwrap_or(inner).to_ascii_lowercase();
    let with_folder = inner.to_ascii_lowercase();
    let provided = match (asm.d.provides)(asm.chip, &with_folder) {
        Provided::No => (asm.d.provides)(asm.chip, &base),
        found => found,
    };
    match provided {
        Provided::Chip => {}
        Provided::Otherwise(cause, hint) => asm.tell(Fault::new("ASM032", rest, cause, hint).warning()),
        Provided::Other(cause, hint) => asm.tell(Fault::new("ASM015", rest, cause, hint)),
        Provided::Named(name, cause, hint) => match asm.chip_named.and_then(|named| named(&name)) {
            Some(other) => {
                asm.known = Known::of(other);
                let hint = "its names and numbers are used; name one chip in both places";
                asm.tell(Fault::new("ASM043", rest, cause, hint).warning());
            }
            // A chip that is not known, whose file lies in the folders all the same.
            None if asm.can_open(inner) => {
                asm.include(inner, &Call { rest, label: None, word: call.word.clone(), ..*call })
            }
            None => asm.tell(Fault::new("ASM015", rest, cause, hint)),
        },
        Provided::No => asm.include(inner, &Call { rest, label: None, word: call.word.clone(), ..*call }),
    }
}

fn undefine(asm: &mut Asm<'_>, call: &Call<'_>) {
    let name = call.get(trim(call.text, call.rest.clone()));
    asm.defines.remove(name);
}

fn message(asm: &mut Asm<'_>, call: &Call<'_>, error: bool) {
    let rest = trim(call.text, call.rest.clone());
    let text = match call.get(rest.clone()).trim_matches('"') {
        "" => "the line gives no reason".to_owned(),
        text => text.to_owned(),
    };
    let at = if rest.is_empty() { call.word.clone() } else { rest };
    let fault = Fault::new(if error { "ASM024" } else { "ASM025" }, at, text, "the program itself says so");
    asm.tell(if error { fault } else { fault.warning() });
}

pub(super) fn if_true(asm: &mut Asm<'_>, call: &Call<'_>) -> bool {
    if call.get(call.word.clone()).starts_with('#') {
        return asm.c_value(call.text, call.rest.clone()) != 0;
    }
    asm.number(call.text, call.rest.clone()).is_some_and(|n| n != 0)
}

/// The value and 0; the value and another where two are given.
fn compare(asm: &mut Asm<'_>, call: &Call<'_>, holds: fn(i64) -> bool) -> bool {
    let parts = wanted(asm, call);
    let mut numbers = parts.iter().map(|part| asm.number(call.text, part.clone()).unwrap_or(0));
    let (first, second) = (numbers.next().unwrap_or(0), numbers.next().unwrap_or(0));
    holds(first.wrapping_sub(second))
}

pub(super) fn is_blank(call: &Call<'_>) -> bool {
    matches!(call.get(trim(call.text, call.rest.clone())), "" | "<>")
}

fn are_alike(call: &Call<'_>) -> bool {
    let parts = cut(call.text, call.rest.clone());
    let text = |i: usize| parts.get(i).map_or("", |part| call.get(part.clone()));
    text(0) == text(1)
}

pub(super) fn is_defined(asm: &mut Asm<'_>, call: &Call<'_>, wanted: bool) -> bool {
    let name = call.get(trim(call.text, call.rest.clone()));
    let symbol = asm.symbols.get(name, asm.d.any_case).is_some_and(|symbol| symbol.pass == asm.pass);
    let found = symbol || asm.define_of(name).is_some() || asm.known.get(name).is_some();
    found == wanted
}

fn times(asm: &mut Asm<'_>, call: &Call<'_>) -> Turns {
    let n = asm.number(call.text, call.rest.clone()).unwrap_or(0);
    Turns { name: None, texts: Vec::new(), count: n.max(0) as u64 }
}

fn each(asm: &mut Asm<'_>, call: &Call<'_>) -> Turns {
    wanted(asm, call);
    let mut parts =
        arguments(asm.d, call.text, call.rest.clone(), Join::of(asm.d, call.get(call.word.clone()))).into_iter();
    let name = parts.next().map_or("", |part| call.get(part)).to_owned();
    let list: Vec<Range<usize>> = parts.collect();
    // `irp x, <1, 2>`: the list in angles.
    let list = match list.as_slice() {
        [all] if asm.d.hooks.angles && byte(call.text, all.start.wrapping_sub(1)) == b'<' => {
            cut(call.text, all.clone())
        }
        _ => list,
    };
    let parts = list.into_iter();
    Turns { name: Some(name), texts: parts.map(|part| call.get(part).to_owned()).collect(), count: 0 }
}

fn each_character(asm: &mut Asm<'_>, call: &Call<'_>) -> Turns {
    wanted(asm, call);
    let mut parts =
        arguments(asm.d, call.text, call.rest.clone(), Join::of(asm.d, call.get(call.word.clone()))).into_iter();
    let name = parts.next().map_or("", |part| call.get(part)).to_owned();
    let text = parts.next().map_or("", |part| call.get(part)).trim_matches('"');
    Turns { name: Some(name), texts: text.chars().map(String::from).collect(), count: 0 }
}
