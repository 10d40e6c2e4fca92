//! Directives about the chip: its name, its configuration words, its banks and pages.

use std::ops::Range;

use emu_core::chip::Chip;

use super::link::ABSOLUTE;
use crate::NamedText;
use crate::chip_of_source::processor_of;
use crate::dialect::ProvidedInclude;
use crate::dialect::common::{required_arguments, value_of};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, cut, trim};
use crate::symbols::AsmSymbolKind;

/// Address of STATUS. Its bits select a bank: RP0 and RP1 for direct addresses, IRP for indirect ones.
const STATUS: u16 = 0x03;
const RP0: u16 = 5;
const RP1: u16 = 6;
const IRP: u16 = 7;
/// Address of PCLATH; its bits 3 and 4 select a page of program memory.
const PCLATH: u16 = 0x0A;
/// Addresses of the ID words and of the first configuration word.
pub(super) const ID: i64 = 0x2000;
const CONFIG: i64 = 0x2007;

/// Encodes `bcf` or `bsf`.
fn bit(file: u16, bit: u16, set: bool) -> u16 {
    (if set { 0x1400 } else { 0x1000 }) | bit << 7 | file
}

/// Returns a chip's name without a prefix: `16f873`.
pub fn bare_chip_name(name: &str) -> String {
    let lower = name.trim().trim_matches('"').to_ascii_lowercase();
    let rest = lower.strip_prefix("pic").or_else(|| lower.strip_prefix('p'));
    rest.unwrap_or(&lower).to_owned()
}

/// Returns the names that gpasm defines for the chip: the chip itself, the bounds of its memories, its
/// vectors.
pub(in crate::dialect) fn defines(chip: &Chip) -> Vec<NamedText> {
    let mut names = vec![(format!("__{}", bare_chip_name(chip.name).to_ascii_uppercase()), 1)];
    names.extend([
        ("__CODE_START".to_owned(), 0),
        ("__CODE_END".to_owned(), chip.flash_bytes / chip.word_bytes.max(1) - 1),
    ]);
    names.extend([("__VECTOR_RESET".to_owned(), 0), ("__VECTOR_INT".to_owned(), 4)]);
    if chip.eeprom_bytes > 0 {
        let end = 0x2100 + u32::from(chip.eeprom_bytes) - 1;
        names.extend([("__EEPROM_START".to_owned(), 0x2100), ("__EEPROM_END".to_owned(), end)]);
    }
    if let Some(common) = super::link::common_ram(chip) {
        let (first, last) = (common.start, common.end - 1);
        names.extend([("__COMMON_RAM_START".to_owned(), first.into()), ("__COMMON_RAM_END".to_owned(), last.into())]);
    }
    names.into_iter().map(|(name, value)| NamedText::new(name, format!("0x{value:X}"))).collect()
}

/// Warns if the source names another chip.
fn warn_other_chip(asm: &mut Assembler<'_>, name: &str, call: &DirectiveCall<'_>) {
    let (named, here) = (bare_chip_name(name), asm.chip.name);
    if named != bare_chip_name(here) {
        let cause = format!("the source is for the pic{named}, and is assembled for the {here}");
        let hint = format!("name that chip with --mcu pic{named}, or change the line");
        asm.report(LineFault::new("ASM043", trim(call.text, call.rest.clone()), cause, hint).warning());
    }
}

/// `processor 16f873`.
pub(super) fn processor(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    warn_other_chip(asm, call.get(call.rest.clone()), call);
}

/// `list p=16f873, r=dec`; other options only affect listings.
pub(super) fn list(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in cut(asm.dialect, call.text, call.rest.clone()) {
        let text = call.get(part.clone());
        if let Some(name) = processor_of(text) {
            warn_other_chip(asm, name, call);
        }
        match text.split_once('=') {
            Some((key, value)) if key.trim().eq_ignore_ascii_case("r") => set_radix(asm, value, part),
            Some((key, value)) if key.trim().eq_ignore_ascii_case("f") => {
                let form = value.trim().to_ascii_lowercase();
                asm.family_state.pic16.is_inhx8m = form == "inhx8m";
                if !matches!(form.as_str(), "inhx8m" | "inhx32") {
                    let cause = format!("a HEX file is not written as `{form}`");
                    asm.report(LineFault::new("ASM023", part, cause, "write f=inhx32, as without it, or f=inhx8m"));
                }
            }
            _ => {}
        }
    }
}

/// `radix dec`.
pub(super) fn radix(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    set_radix(asm, call.get(rest.clone()), rest);
}

fn set_radix(asm: &mut Assembler<'_>, name: &str, at: Range<usize>) {
    asm.radix = match name.trim().to_ascii_lowercase().as_str() {
        "hex" => 16,
        "dec" => 10,
        "oct" => 8,
        other => {
            let cause = format!("`{other}` is not a radix");
            return asm.report(LineFault::new("ASM023", at, cause, "there are hex, dec and oct"));
        }
    };
}

/// Message numbers of gpasm and MPASM, and the codes of this assembler with the same meaning.
#[rustfmt::skip]
const MESSAGES: &[(u32, &str)] = &[
    (203, "ASM040"), (205, "ASM041"), (302, "ASM042"), (223, "ASM043"), (312, "ASM044"), (303, "ASM045"), (301, "ASM025"), (202, "ASM046"),
    (219, "ASM047"), (211, "ASM051"),
];

/// `errorlevel -302` suppresses a message and `+302` enables it again. 0 shows everything, 1 hides notes, 2
/// hides warnings too.
pub(super) fn errorlevel(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in cut(asm.dialect, call.text, call.rest.clone()) {
        let text = call.get(part.clone());
        let number = text.trim_start_matches(['-', '+']).trim().parse::<u32>();
        let Ok(number) = number else {
            let cause = format!("`{text}` is not a number of a message");
            asm.report(LineFault::new("ASM023", part, cause, "write 0, 1, 2, or a number with a sign as -302"));
            continue;
        };
        let ours = MESSAGES.iter().filter(|(theirs, _)| *theirs == number).map(|(_, ours)| *ours);
        match text.as_bytes().first() {
            Some(b'-') => asm.suppressed_codes.extend(ours),
            Some(b'+') => ours.for_each(|code| {
                asm.suppressed_codes.remove(code);
            }),
            _ => asm.suppressed_below = number,
        }
    }
}

/// Emits words at another address of the image, then returns to the current address.
pub(super) fn emit_at(asm: &mut Assembler<'_>, addr: i64, give: impl FnOnce(&mut Assembler<'_>)) {
    let current = std::mem::replace(&mut asm.out.current, ABSOLUTE);
    let here = asm.out.next_address();
    asm.out.set_address(addr);
    give(asm);
    asm.out.set_address(here);
    asm.out.current = current;
}

/// `__config value` sets the first configuration word, `__config address, value` any of them.
pub(super) fn config(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let parts = cut(asm.dialect, call.text, call.rest.clone());
    let (addr, value) = match parts.as_slice() {
        [value] => (Some(CONFIG), value),
        [addr, value] => (asm.evaluate_address(call.text, addr.clone()), value),
        _ => {
            let hint = "write `__config value`, or `__config address, value`";
            return asm.report(LineFault::new("ASM023", call.word.clone(), "a value is wanted", hint));
        }
    };
    let Some(addr) = addr else { return };
    let word = value_of(asm, call.text, value.clone(), 16) as u16;
    emit_at(asm, addr, |asm| asm.emit_words(&[word & 0x3FFF], value.clone()));
}

/// Settings in the second configuration word, on chips that have two.
const SECOND: [&str; 2] = ["fcmen", "ieso"];

/// `config FOSC = HS, WDTE = OFF`: settings by the names of the vendor's constants, here `_FOSC_HS` and
/// `_WDTE_OFF`.
pub(super) fn settings(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in required_arguments(asm, call) {
        let text = call.get(part.clone());
        let Some((name, value)) = text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) else {
            let cause = format!("`{text}` is not a setting");
            asm.report(LineFault::new("ASM023", part, cause, "write `config NAME = VALUE`, as `config WDTE = OFF`"));
            continue;
        };
        let constant = format!("_{name}_{value}");
        match asm.chip_names.get(&constant) {
            Some(mask) => {
                let second = SECOND.iter().any(|field| field.eq_ignore_ascii_case(name));
                let [first, other] = asm.family_state.pic16.settings.get_or_insert([0x3FFF; 2]);
                *(if second { other } else { first }) &= mask.number as u16;
            }
            None => {
                let cause = format!("the {} has no setting `{name}` with the value `{value}`", asm.chip.name);
                let hint = format!("settings go by the constants of the chip, and there is no `{constant}`");
                asm.report(LineFault::new("ASM006", part, cause, hint).with_similar_name(&constant));
            }
        }
    }
}

/// Emits the configuration words that `config` has set.
fn give_settings(asm: &mut Assembler<'_>) {
    let Some(words) = asm.family_state.pic16.settings.take() else { return };
    let count = if asm.chip_names.get("_CONFIG2").is_some() { 2 } else { 1 };
    emit_at(asm, CONFIG, |asm| words.iter().take(count).for_each(|word| asm.emit_words(&[*word], 0..0)));
}

/// `__idlocs value`: its four hexadecimal digits, one in each ID word.
pub(super) fn idlocs(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let rest = trim(call.text, call.rest.clone());
    let value = value_of(asm, call.text, rest.clone(), 16) as u16;
    emit_at(asm, ID, |asm| {
        (0..4).rev().for_each(|digit| asm.emit_words(&[value >> (4 * digit) & 0xF], rest.clone()));
    });
}

/// Returns the number of register banks: 4 if there are registers or RAM in the upper two, else 2.
fn banks(chip: &Chip) -> u32 {
    let upper = chip.regs.iter().any(|reg| reg.addr >= 0x100) || chip.ram_len > 0xC0;
    if upper { 4 } else { 2 }
}

/// Selects the bank of an address.
pub(super) fn banksel(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(addr) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    asm.emit_words(&[bit(STATUS, RP0, addr & 0x80 != 0)], call.word.clone());
    if banks(asm.chip) > 2 {
        asm.emit_words(&[bit(STATUS, RP1, addr & 0x100 != 0)], call.word.clone());
    }
}

/// Selects the pair of banks for an address that FSR will hold.
pub(super) fn bankisel(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(addr) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    asm.emit_words(&[bit(STATUS, IRP, addr & 0x100 != 0)], call.word.clone());
}

/// Reports whether the chip has more than one page of program words; adds a note if it has one.
fn has_pages(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) -> bool {
    let more = asm.chip.flash_bytes / asm.chip.word_bytes > 0x800;
    if !more {
        let cause = format!("the {} has one page, so nothing is written to select it", asm.chip.name);
        asm.report(LineFault::new("ASM044", call.word.clone(), cause, "the line can go").note());
    }
    more
}

/// Selects the page of an address with bit instructions.
pub(super) fn pagesel(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(addr) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    if !has_pages(asm, call) {
        return;
    }
    asm.emit_words(&[bit(PCLATH, 3, addr & 0x800 != 0)], call.word.clone());
    if asm.chip.flash_bytes / asm.chip.word_bytes > 0x1000 {
        asm.emit_words(&[bit(PCLATH, 4, addr & 0x1000 != 0)], call.word.clone());
    }
}

/// Selects the page of an address through W.
pub(super) fn pageselw(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some(addr) = asm.evaluate_number(call.text, call.rest.clone()) else { return };
    if has_pages(asm, call) {
        // movlw high address; movwf PCLATH
        asm.emit_words(&[0x3000 | (addr >> 8) as u16 & 0xFF, 0x0080 | PCLATH], call.word.clone());
    }
}

/// `include <p16f873.inc>`: defines the names of the chip from here on.
pub(super) fn include(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let written = call.get(trim(call.text, call.rest.clone())).to_ascii_lowercase();
    let name = written.trim_matches(|c| matches!(c, '"' | '\'' | '<' | '>' | ' '));
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    asm.family_state.pic16.includes_chip |= chip_of(base).is_some();
    super::super::common::include(asm, call);
}

/// Returns the chip that an include is for: `16f873` of `p16f873.inc`.
fn chip_of(include: &str) -> Option<&str> {
    let named = include.strip_prefix('p')?.strip_suffix(".inc")?;
    named.starts_with(|c: char| c.is_ascii_digit()).then_some(named)
}

/// A name that was not defined when the program tested it.
#[derive(Debug)]
pub(super) struct UndefinedCheck {
    name: String,
    at: Range<usize>,
    line: Option<AsmLine>,
    /// Tested by `ifdef`, not by `ifndef`.
    wanted: bool,
}

/// Reports whether a name is defined, or undefined if `wanted` is false. The chip's names are defined from
/// its include on.
pub(super) fn is_defined(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>, wanted: bool) -> bool {
    let at = trim(call.text, call.rest.clone());
    let name = call.get(at.clone());
    let is_given = asm.symbols.get(name, asm.dialect.ignores_case).is_some_and(|symbol| symbol.pass == asm.pass);
    let by_chip = asm.family_state.pic16.includes_chip && asm.chip_names.get(name).is_some();
    let found = is_given || by_chip || asm.defines.contains_key(name);
    if !found {
        let line = asm.line.clone();
        asm.family_state.pic16.undefined_checks.push(UndefinedCheck { name: name.to_owned(), at, line, wanted });
    }
    found == wanted
}

/// Warns of names that are defined after the line that tests them. gpasm, which reads a source twice, knows
/// them there. A number that `ifndef` itself guards is equal in both passes, so only labels count there.
fn warn_late_definitions(asm: &mut Assembler<'_>) {
    for UndefinedCheck { name, at, line, wanted } in std::mem::take(&mut asm.family_state.pic16.undefined_checks) {
        let symbol = asm.symbols.get(&name, asm.dialect.ignores_case).filter(|symbol| symbol.pass == asm.pass);
        let given = symbol.is_some_and(|symbol| wanted || matches!(symbol.kind, AsmSymbolKind::Label { .. }));
        let by_chip = wanted && asm.family_state.pic16.includes_chip && asm.chip_names.get(&name).is_some();
        if given || by_chip {
            asm.line = line;
            let cause = format!("`{name}` is given below this line and is not defined here, but would be for gpasm");
            let hint = "give it above, or ask for another name";
            asm.report(LineFault::new("ASM052", at, cause, hint).warning());
        }
    }
    asm.line = None;
}

/// Ends a pass.
pub(super) fn finish(asm: &mut Assembler<'_>) {
    give_settings(asm);
    warn_late_definitions(asm);
}

/// The hint for sources written for pic-as.
const PIC_AS: &str = "sources are those of gpasm and MPASM here: `include <p16f877a.inc>`, `code` and `udata` for sections, `res` for room";

/// `psect` of pic-as.
pub(super) fn psect(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let cause = "`psect` belongs to pic-as of XC8, and this is not its language";
    asm.report(LineFault::new("ASM023", call.word.clone(), cause, PIC_AS));
}

/// Returns what an include provides. `p16f873.inc` gives names that the chip's data already has; `coff.inc`
/// defines names for gpsim and debuggers.
pub(super) fn provides(chip: &Chip, include: &str) -> ProvidedInclude {
    if include == "coff.inc" {
        return ProvidedInclude::Chip;
    }
    if matches!(include, "xc.inc" | "pic.inc" | "pic_as_chip_select.inc") {
        return ProvidedInclude::OtherChip(
            format!("`{include}` belongs to pic-as of XC8, and this is not its language"),
            PIC_AS.to_owned(),
        );
    }
    let Some(named) = chip_of(include) else { return ProvidedInclude::NotProvided };
    if named == bare_chip_name(chip.name) {
        return ProvidedInclude::Chip;
    }
    let cause = format!("`{include}` is for another chip than the {}", chip.name);
    let hint = format!("name that chip with --mcu pic{named}, or include p{}.inc", bare_chip_name(chip.name));
    ProvidedInclude::NamedChip(format!("pic{named}"), cause, hint)
}
