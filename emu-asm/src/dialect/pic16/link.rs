//! Sections of relocatable sources, placed as gplink places one module with its default script for the chip.
//!
//! gplink places sections without an address by their size in bytes, the largest first and equal ones in
//! source order. Each takes the smallest free range that holds it: `code` within a page of program memory,
//! `udata` within a bank of RAM, `udata_shr` in the cells that all banks share. The initial values of `idata`
//! are stored in program memory as RETLWs, and so is `.cinit`, a list of them. gplink's scripts agree with
//! the chip's map of RAM, so they are not read.

use std::ops::Range;

use emu_core::chip::Chip;

use super::chip::{ID, emit_at};
use super::data::EEPROM;
use crate::dialect::{AsmDirective, SectionContent};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, trim};

/// The section for everything with an address by `org`, and for everything before the first section.
pub(super) const ABSOLUTE: usize = 0;
/// Words of a page of program memory, and addresses of a bank of RAM.
const PAGE: i64 = 0x800;
const BANK: u16 = 0x80;
/// Number of addresses that a section may have.
const LIMIT: i64 = 0x1_0000;
/// `retlw 0`, and an erased word.
const RETLW: u16 = 0x3400;
const ERASED: u16 = 0x3FFF;

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SectionKind {
    /// Program words.
    Code,
    /// Variables in one bank.
    Banked,
    /// Variables in RAM that all banks share.
    Shared,
    /// Variables that overlay each other.
    Overlay,
    /// Variables with initial values.
    Initial,
}

/// A section of the source.
#[derive(Debug)]
pub(super) struct ModuleSection {
    /// Its number among the sections.
    number: usize,
    kind: SectionKind,
    /// It has a fixed address.
    fixed: bool,
    /// Length of its longest part in addresses, if the parts overlay each other.
    longest: i64,
    /// Initial values of its variables.
    initial: Vec<u8>,
    /// The line that begins it.
    line: Option<AsmLine>,
}

/// Returns the directive that begins a section.
pub(super) const fn section(name: &'static str) -> AsmDirective {
    AsmDirective::named(name, begin)
}

/// `name code address`; name and address are optional.
fn begin(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let word = call.get(call.word.clone()).trim_start_matches('.').to_ascii_lowercase();
    let kind = match word.as_str() {
        "code" => SectionKind::Code,
        "udata" => SectionKind::Banked,
        "udata_shr" => SectionKind::Shared,
        "udata_ovr" => SectionKind::Overlay,
        "idata" => SectionKind::Initial,
        _ => {
            let cause = format!("the {} has no `{word}`: it is for chips with a 16-bit core", asm.chip.name);
            let hint = "take `udata_shr` for variables of all banks, `code` for the program";
            return asm.report(LineFault::new("ASM050", call.word.clone(), cause, hint));
        }
    };
    let name = call.label.clone().map_or(format!(".{word}"), |label| call.get(label).to_owned());
    let rest = trim(call.text, call.rest.clone());
    let address = if rest.is_empty() { None } else { asm.evaluate_address(call.text, rest.clone()) };
    if let Some(at) = address.filter(|at| !(0..LIMIT).contains(at)) {
        let cause = format!("the address 0x{at:X} is not in 0..=0x{:X}", LIMIT - 1);
        return asm.report(LineFault::new("ASM003", rest, cause, "give an address of a memory, or none"));
    }
    let (space, holds) = match kind {
        SectionKind::Code => ("", SectionContent::Image),
        _ => (asm.chip.ram_space, SectionContent::Addresses),
    };
    let Some(number) = asm.out.open(&name, space, holds) else {
        return asm.report(LineFault::new(
            "ASM017",
            call.word.clone(),
            "there are too many sections",
            "put some together",
        ));
    };
    asm.out.enter_section(number);
    if let Some(known) = asm.family_state.pic16.modules.iter_mut().find(|known| known.number == number) {
        let extent = asm.out.extent(number);
        if kind == SectionKind::Overlay && known.kind == kind {
            known.longest = known.longest.max(extent.end - extent.start);
            asm.out.set_address(extent.start);
        }
        return;
    }
    if let Some(at) = address {
        asm.out.begin_at(number, at);
        asm.out.set_address(at);
    }
    let (fixed, line) = (!rest.is_empty(), asm.line.clone());
    asm.family_state.pic16.modules.push(ModuleSection { number, kind, fixed, longest: 0, initial: Vec::new(), line });
}

/// `extern a, b`: declares names of another module.
pub(super) fn external(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    for part in super::cut(asm.dialect, call.text, call.rest.clone()) {
        asm.externs.insert(call.get(part).to_owned());
    }
}

/// `res count`: reserves addresses; in program memory it fills them with erased words, as gpasm does.
pub(super) fn reserve(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let before = asm.out.next_address();
    super::super::common::space(asm, call);
    if asm.out.holds() == SectionContent::Image && before < ID {
        let count = asm.out.next_address() - before;
        asm.out.set_address(before);
        (0..count).for_each(|_| asm.emit_words(&[ERASED], call.rest.clone()));
    }
}

/// Reports whether the variables of the current section have initial values.
pub(super) fn in_initial(asm: &Assembler<'_>) -> bool {
    let current = asm.out.current;
    asm.family_state.pic16.modules.iter().any(|known| known.number == current && known.kind == SectionKind::Initial)
}

/// Gives the next variables of the section initial values.
pub(super) fn give_initial(asm: &mut Assembler<'_>, bytes: &[u8]) {
    let extent = asm.out.extent(asm.out.current);
    let current = asm.out.current;
    if let Some(section) = asm.family_state.pic16.modules.iter_mut().find(|known| known.number == current) {
        section.initial.resize((extent.end - extent.start).clamp(0, 0x200) as usize, 0);
        section.initial.extend_from_slice(bytes);
    }
    asm.out.set_address(extent.end + bytes.len() as i64);
}

/// All addresses.
const EVERYWHERE: Range<i64> = 0..i64::MAX;

/// Returns the address range of a section whose name determines it, as in gplink's scripts. PROG1, PROG2, ..
/// are pages (only the PIC16F87 and 88 have PROG0 for the first); PROG is the page of chips with one page
/// (except for the PIC16F870 to 872, where it is PROG1); IDLOCS is the ID words, DEEPROM the EEPROM.
fn limits_of(asm: &Assembler<'_>, section: &ModuleSection) -> Option<Range<i64>> {
    let name = asm.out.initial_sections.get(section.number).map_or("", |first| &first.name);
    let pages = i64::from(asm.chip.flash_bytes / asm.chip.word_bytes.max(1)).div_euclid(PAGE).max(1);
    let first = i64::from(!matches!(asm.chip.name, "pic16f87" | "pic16f88"));
    let alone = pages == 1 && !matches!(asm.chip.name, "pic16f870" | "pic16f871" | "pic16f872");
    match name {
        "IDLOCS" => Some(ID..ID + 4),
        "DEEPROM" if asm.chip.eeprom_bytes > 0 => Some(EEPROM..EEPROM + i64::from(asm.chip.eeprom_bytes)),
        _ if alone => (name == "PROG").then_some(0..PAGE),
        _ => {
            let page = name.strip_prefix("PROG")?.parse::<i64>().ok()?.checked_sub(first)?;
            (0..pages).contains(&page).then_some(page * PAGE..(page + 1) * PAGE)
        }
    }
}

/// Free ranges of a memory.
#[derive(Debug, Default)]
struct FreeSpace {
    stretches: Vec<Range<i64>>,
    /// Ends of pages or banks.
    ends: Vec<i64>,
}

impl FreeSpace {
    /// Returns pages or banks that are all free.
    fn of(stretches: Vec<Range<i64>>) -> FreeSpace {
        FreeSpace { ends: stretches.iter().map(|stretch| stretch.end).collect(), stretches }
    }

    /// Removes a range.
    fn remove(&mut self, taken: &Range<i64>) {
        if taken.is_empty() {
            return;
        }
        let around = |free: &Range<i64>| [free.start..free.end.min(taken.start), free.start.max(taken.end)..free.end];
        self.stretches = self.stretches.iter().flat_map(around).filter(|piece| !piece.is_empty()).collect();
    }

    /// Takes the smallest free range of at least `length` within `limits`; returns its start. A range that is
    /// only the last address of a page or bank is the last choice, because gplink overlooks it.
    fn take(&mut self, length: i64, limits: &Range<i64>) -> Option<i64> {
        let inside = self.stretches.iter().filter(|free| limits.contains(&free.start));
        let fits = inside.filter(|free| free.end - free.start >= length);
        let is_last = |free: &Range<i64>| free.end - free.start == 1 && self.ends.contains(&free.end);
        let start = fits.min_by_key(|free| (is_last(free), free.end - free.start))?.start;
        self.remove(&(start..start + length));
        Some(start)
    }
}

/// Returns the addresses in bank 0 of the RAM that all banks share. If there is none, returns the last 16
/// addresses of the bank: gputils counts them as common on the PIC16F873 too.
pub(super) fn common_ram(chip: &Chip) -> Option<Range<u16>> {
    let in_all = |addr: &u16| (0..4).all(|bank| canonical_cell(chip, bank * BANK + addr) == Some(*addr));
    let mut all = (0..BANK).filter(in_all);
    match all.next() {
        Some(first) => Some(first..all.next_back().unwrap_or(first) + 1),
        None if chip.ram_ranges.is_empty() => None,
        None => Some(BANK - 0x10..BANK),
    }
}

/// Returns the canonical address of a cell of RAM.
fn canonical_cell(chip: &Chip, addr: u16) -> Option<u16> {
    let range = chip.ram_ranges.iter().find(|range| (range.first..=range.last).contains(&addr))?;
    Some(range.canonical + (addr - range.first))
}

/// Returns the RAM of the chip: cells with one address, cells with several, cells that all banks share.
fn ram(chip: &Chip) -> [FreeSpace; 3] {
    let mut spaces = [const { Vec::<Range<i64>>::new() }; 3];
    let common = common_ram(chip).unwrap_or_default();
    let mut before = (usize::MAX, 0);
    for addr in (0..4 * BANK).filter(|addr| canonical_cell(chip, *addr) == Some(*addr)) {
        let mirrors = (0..4 * BANK).filter(|other| canonical_cell(chip, *other) == Some(addr)).count();
        let space = match common.contains(&(addr % BANK)) {
            true if addr >= BANK => continue,
            true => 2,
            false => usize::from(mirrors > 1),
        };
        let Some(stretches) = spaces.get_mut(space) else { continue };
        match stretches.last_mut() {
            Some(last) if before == (space, addr) && addr % BANK != 0 => last.end += 1,
            _ => stretches.push(addr.into()..i64::from(addr) + 1),
        }
        before = (space, addr + 1);
    }
    spaces.map(FreeSpace::of)
}

/// Something to place in program memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ProgramPiece {
    /// A section of code, by its index.
    Code(usize),
    /// The initial values of a section.
    Values(usize),
    /// The list of sections with initial values.
    List,
}

/// Places all sections; returns true if one has moved.
pub(super) fn place(asm: &mut Assembler<'_>) -> bool {
    let mut sections = std::mem::take(&mut asm.family_state.pic16.modules);
    if sections.is_empty() {
        return false;
    }
    for section in &mut sections {
        let extent = asm.out.extent(section.number);
        section.longest = section.longest.max(extent.end - extent.start);
        if section.kind == SectionKind::Initial {
            section.initial.resize(section.longest.clamp(0, 0x200) as usize, 0);
        }
    }
    let moved = place_variables(asm, &sections);
    let (pieces, moved_code) = place_code(asm, &sections);
    give_values(asm, &sections, &pieces);
    moved | moved_code
}

/// Sorts lengths and what they are for, the largest first. Empty entries are dropped, except those of
/// `idata`, which gplink lists in `.cinit` anyway.
fn by_size<T>(mut wanted: Vec<(i64, T)>, is_initial: impl Fn(&T) -> bool) -> impl Iterator<Item = (i64, T)> {
    wanted.retain(|(length, of)| *length > 0 || is_initial(of));
    wanted.sort_by_key(|(length, _)| -length);
    wanted.into_iter()
}

fn place_variables(asm: &mut Assembler<'_>, sections: &[ModuleSection]) -> bool {
    let mut free = ram(asm.chip);
    let variables = || sections.iter().filter(|section| section.kind != SectionKind::Code);
    let mut taken: Vec<(Range<i64>, &ModuleSection)> = Vec::new();
    for section in variables().filter(|section| section.fixed) {
        let start = asm.out.extent(section.number).start;
        let range = start..start + section.longest;
        let shared = |other: &Range<i64>| range.start.max(other.start)..range.end.min(other.end);
        if let Some((other, with)) = taken.iter().find(|(other, _)| !shared(other).is_empty()) {
            report_shared_address(asm, section, with, shared(other).start);
        }
        free.iter_mut().for_each(|space| space.remove(&range));
        taken.push((range, section));
    }
    let mut moved = false;
    let wanted = variables().filter(|s| !s.fixed).map(|s| (s.longest, s)).collect();
    for (length, section) in by_size(wanted, |section| section.kind == SectionKind::Initial) {
        let from = if section.kind == SectionKind::Shared { 2 } else { 0 };
        let found = free.iter_mut().skip(from).find_map(|space| space.take(length, &EVERYWHERE));
        match found {
            Some(at) => moved |= asm.out.begin_at(section.number, at),
            None => no_room(asm, section, &format!("{length} bytes of RAM in one bank")),
        }
    }
    moved
}

fn place_code(asm: &mut Assembler<'_>, sections: &[ModuleSection]) -> (Vec<(ProgramPiece, i64)>, bool) {
    let words = i64::from(asm.chip.flash_bytes / asm.chip.word_bytes.max(1));
    let pages = (0..).map(|page| page * PAGE..((page + 1) * PAGE).min(words)).take_while(|page| !page.is_empty());
    let others = [ID..ID + 4, EEPROM..EEPROM + i64::from(asm.chip.eeprom_bytes)];
    let mut free = FreeSpace::of(pages.chain(others).collect());
    let absolute = asm.out.runs.iter().filter(|run| run.section == ABSOLUTE);
    absolute.for_each(|run| free.remove(&(run.addr as i64 / 2..(run.addr as i64 + run.bytes.len() as i64 + 1) / 2)));
    let mut wanted = Vec::new();
    for (i, section) in sections.iter().enumerate() {
        match section.kind {
            SectionKind::Code if section.fixed => {
                let start = asm.out.extent(section.number).start;
                free.remove(&(start..start + section.longest));
            }
            SectionKind::Code => wanted.push((section.longest, ProgramPiece::Code(i))),
            SectionKind::Initial => wanted.push((section.longest, ProgramPiece::Values(i))),
            _ => {}
        }
    }
    let lists = sections.iter().filter(|section| section.kind == SectionKind::Initial).count();
    if lists > 0 {
        wanted.push((2 + 6 * lists as i64, ProgramPiece::List));
    }
    // Sections whose name determines their address come first.
    let section_of = |piece: &ProgramPiece| match piece {
        ProgramPiece::Code(i) | ProgramPiece::Values(i) => sections.get(*i),
        ProgramPiece::List => sections.first(),
    };
    let limits = |piece: &ProgramPiece| match piece {
        ProgramPiece::Code(i) => sections.get(*i).and_then(|section| limits_of(asm, section)),
        _ => None,
    };
    let wanted = wanted.into_iter().map(|(length, piece)| (length, (piece, limits(&piece))));
    let (named, others): (Vec<_>, Vec<_>) = wanted.partition(|(_, (_, limits))| limits.is_some());
    let (mut places, mut moved) = (Vec::new(), false);
    let is_values = |(piece, _): &(ProgramPiece, _)| matches!(piece, ProgramPiece::Values(_));
    for (length, (piece, limits)) in by_size(named, is_values).chain(by_size(others, is_values)) {
        let Some(section) = section_of(&piece) else { continue };
        let limits = limits.unwrap_or(0..ID);
        let Some(at) = free.take(length, &limits) else {
            no_room(asm, section, &format!("{length} words of program memory in one page"));
            continue;
        };
        places.push((piece, at));
        if let ProgramPiece::Code(_) = piece {
            moved |= asm.out.begin_at(section.number, at);
        }
    }
    (places, moved)
}

/// Emits the initial values and the list of them: a count, then for each section the address of the values,
/// the address of the variables, and the number of bytes.
fn give_values(asm: &mut Assembler<'_>, sections: &[ModuleSection], pieces: &[(ProgramPiece, i64)]) {
    let retlw = |byte: &u8| RETLW | u16::from(*byte);
    let mut list: Vec<u8> = Vec::new();
    let mut count = 0u16;
    for (i, section) in sections.iter().enumerate() {
        let Some(&(_, at)) = pieces.iter().find(|(piece, _)| *piece == ProgramPiece::Values(i)) else { continue };
        let to = asm.out.initial_sections.get(section.number).map_or(0, |first| first.pos);
        list.extend([at, to, section.longest].iter().flat_map(|n| (*n as u16).to_le_bytes()));
        count += 1;
        emit_at(asm, at, |asm| section.initial.iter().for_each(|byte| asm.emit_words(&[retlw(byte)], 0..0)));
    }
    if let Some(&(_, at)) = pieces.iter().find(|(piece, _)| *piece == ProgramPiece::List) {
        let all: Vec<u8> = count.to_le_bytes().into_iter().chain(list).collect();
        emit_at(asm, at, |asm| all.iter().for_each(|byte| asm.emit_words(&[retlw(byte)], 0..0)));
    }
}

/// Reports that a section finds no room; faults that follow from that are not reported.
fn no_room(asm: &mut Assembler<'_>, section: &ModuleSection, what: &str) {
    asm.address_unknown = true;
    let name = name_of(asm, section);
    let cause = format!("the section `{name}` needs {what}, and the {} has none free", asm.chip.name);
    report_at_section(asm, section, "ASM050", cause, "divide it into several sections, or make it smaller");
}

/// Reports that two sections of variables overlap at an address.
fn report_shared_address(asm: &mut Assembler<'_>, section: &ModuleSection, with: &ModuleSection, at: i64) {
    let (name, other) = (name_of(asm, section), name_of(asm, with));
    let cause = format!("the section `{name}` has 0x{at:02X}, the address of section `{other}`");
    report_at_section(asm, section, "ASM019", cause, "give one of them another address, or none");
}

fn name_of(asm: &Assembler<'_>, section: &ModuleSection) -> String {
    asm.out.initial_sections.get(section.number).map_or_else(String::new, |first| first.name.clone())
}

/// Reports a fault at the line that begins a section.
fn report_at_section(asm: &mut Assembler<'_>, section: &ModuleSection, code: &'static str, cause: String, hint: &str) {
    let before = std::mem::replace(&mut asm.line, section.line.clone());
    let at =
        asm.line.as_ref().map_or(0..0, |line| trim(&line.text, 0..crate::statement::code_end(asm.dialect, &line.text)));
    asm.report(LineFault::new(code, at, cause, hint));
    asm.line = before;
}
