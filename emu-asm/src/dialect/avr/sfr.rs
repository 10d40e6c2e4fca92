//! Macros of avr-libc about registers (`<avr/sfr_defs.h>`), and the offset of register names.
//!
//! `PORTB` is the address in data memory, 25h. If the program defines `__SFR_OFFSET` as 0, the names of
//! registers in the range of `in` and `out` are their I/O addresses: `PORTB` is 5.

use super::super::ProvidedInclude;
use super::atmel;
use crate::NamedText;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::trim;
use crate::number::read_number;

/// The macro with the offset.
const OFFSET: &str = "__SFR_OFFSET";
/// The macro that only exists if register names are addresses in data memory.
const ADDRESS: &str = "_SFR_ADDR";
/// The distance of addresses in data memory from I/O addresses.
const DATA_OFFSET: i64 = 0x20;

/// The macros with their parameter, and their texts, without spaces, which separate arguments of macros. A
/// sum is a plain number, also if the argument is the name of a register.
const MACROS: &[(&str, &str)] = &[
    ("_BV(bit)", "(1<<(bit))"),
    ("_SFR_MEM8(addr)", "(addr)"),
    ("_SFR_MEM16(addr)", "(addr)"),
    ("_SFR_MEM32(addr)", "(addr)"),
    ("_SFR_IO8(addr)", "((addr)+__SFR_OFFSET)"),
    ("_SFR_IO16(addr)", "((addr)+__SFR_OFFSET)"),
    ("_SFR_IO_ADDR(sfr)", "((sfr)-__SFR_OFFSET)"),
    ("_SFR_MEM_ADDR(sfr)", "((sfr)+0)"),
    ("_SFR_IO_REG_P(sfr)", "((sfr)<0x40+__SFR_OFFSET)"),
    ("_SFR_ADDR(sfr)", "_SFR_MEM_ADDR(sfr)"),
];

/// Returns the macros as definitions.
pub(super) fn macros() -> impl Iterator<Item = NamedText> {
    MACROS.iter().map(|(name, text)| NamedText::new(*name, *text))
}

/// Returns the number that the program defines as the offset; `None` if it defines none, or not as a number.
fn defined_offset(asm: &Assembler<'_>) -> Option<i64> {
    let text = asm.find_define(OFFSET)?.text.trim().trim_matches(['(', ')']).trim();
    let (len, n) = read_number(asm.dialect, 10, text, 0).ok()??;
    (len == text.len()).then_some(n)
}

/// Reports whether names of registers are I/O addresses.
pub(super) fn names_io_addresses(asm: &Assembler<'_>) -> bool {
    defined_offset(asm) == Some(0)
}

/// Returns the value of the offset in a source that does not define it.
pub(super) fn default_offset(_: &Assembler<'_>, name: &str) -> Option<i64> {
    (name == OFFSET).then_some(DATA_OFFSET)
}

/// `#include <avr/io.h>` defines the offset unless the program does; other files.
pub(super) fn including(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let file = call.get(rest.clone()).trim_matches(['"', '<', '>']).to_ascii_lowercase();
    let is_header =
        file.ends_with(".h") && matches!((asm.dialect.include_provided)(asm.chip, &file), ProvidedInclude::Chip);
    if is_header && asm.find_define(OFFSET).is_none() {
        asm.define_name(OFFSET.to_owned(), "0x20");
    }
    if is_header && defined_offset(asm).is_none_or(|n| n != 0 && n != DATA_OFFSET) {
        let cause = "`__SFR_OFFSET` is neither 0 nor 0x20";
        return asm.report(LineFault::new("ASM003", rest, cause, "write `#define __SFR_OFFSET 0` before this line"));
    }
    if is_header && names_io_addresses(asm) {
        asm.defines.remove(ADDRESS);
    }
    atmel::including(asm, call);
}
