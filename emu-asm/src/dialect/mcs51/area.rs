//! Areas of sdas8051: `.area`, and how the linker sdld places the areas of one module.
//!
//! Parts of an area with the same name follow each other; with OVR they all begin at the same address. Areas
//! with ABS are at the addresses of their `.org`. [`layout`](super::layout) places all others as sdld does.

use std::collections::BTreeMap;

use super::layout::{AbsolutePart, AreaMemory, AreaShape, PlacementFault, layout};
use crate::dialect::SectionContent;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::{CauseAndHint, LineFault};
use crate::lines::{AsmLine, trim};
use crate::sections::AsmSection;

/// An area of the pass.
#[derive(Debug, Clone)]
struct PassArea {
    /// Number of its section.
    section: usize,
    shape: AreaShape,
    /// The line that first names it, for diagnostics.
    line: Option<AsmLine>,
    /// The position of its name in that line.
    at: std::ops::Range<usize>,
}

/// The areas read so far.
#[derive(Debug, Default)]
pub(super) struct PassAreas {
    all: Vec<PassArea>,
    /// The open area, and the address where its current part began.
    open: Option<(usize, i64)>,
    /// If no area is open: where the open part of an ASM51 section began; then the closed parts.
    part_start: i64,
    absolute_parts: Vec<AbsolutePart>,
    /// Values of the previous pass: `s_NAME` and `l_NAME` (first address and size of each area), and segment
    /// names.
    limits: BTreeMap<String, i64>,
}

impl PassAreas {
    /// Returns the value of `s_NAME` or `l_NAME`, or the first address of a segment, whose name ignores case.
    pub fn limit(&self, name: &str) -> Option<i64> {
        self.limits.get(name).or_else(|| self.limits.get(&name.to_ascii_lowercase())).copied()
    }
}

/// Applies one attribute in the parentheses of `.area`.
fn attribute(shape: &mut AreaShape, memory: &mut Option<AreaMemory>, word: &str) -> bool {
    match word.to_ascii_uppercase().as_str() {
        "REL" | "CON" | "NOPAG" => {}
        "ABS" => shape.absolute = true,
        "OVR" => shape.overlaid = true,
        "PAG" => shape.paged = true,
        "CODE" => *memory = Some(AreaMemory::Code),
        "XDATA" => *memory = Some(AreaMemory::Xdata),
        "BIT" => *memory = Some(AreaMemory::Bit),
        "DATA" => *memory = Some(AreaMemory::Data),
        _ => return false,
    }
    true
}

/// `.area NAME (ABS,CODE)`.
pub(super) fn area(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    super::of_sdas(asm, call);
    leave_area(asm);
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let len = written.find(|c: char| c.is_whitespace() || c == '(' || c == ',').unwrap_or(written.len());
    let name = written.get(..len).unwrap_or_default();
    let at = rest.start..rest.start + len;
    if name.is_empty() {
        let hint = "write `.area CSEG (CODE)`";
        return asm.report(LineFault::new("ASM023", call.word.clone(), "the name of the area is missing", hint));
    }
    let behind = written.get(len..).unwrap_or_default();
    let mut shape = AreaShape { name: name.to_owned(), ..AreaShape::default() };
    let mut memory = None;
    for word in behind.split(|c: char| c.is_whitespace() || matches!(c, '(' | ')' | ',')).filter(|w| !w.is_empty()) {
        if !attribute(&mut shape, &mut memory, word) {
            let cause = format!("`{word}` is not an attribute of an area");
            let hint = "there are ABS, REL, CON, OVR, PAG, NOPAG, CODE, DATA, XDATA and BIT";
            return asm.report(LineFault::new("ASM023", at, cause, hint));
        }
    }
    // The area before the first directive.
    if name == "_CODE" {
        let _ = asm.out.enter_named("code");
        return;
    }
    shape.memory = memory.unwrap_or_else(|| default_memory(name, shape.absolute));
    let known = asm.family_state.mcs51.areas.all.iter().position(|area| area.shape.name == name);
    let first =
        known.and_then(|number| asm.family_state.mcs51.areas.all.get(number)).filter(|_| !behind.trim().is_empty());
    if first.is_some_and(|first| !first.shape.is_like(&shape)) {
        let cause = format!("the area {name} has other attributes at its first occurrence");
        return asm.report(LineFault::new("ASM007", at, cause, "give it the same in both places, or none here"));
    }
    if let Some(number) = known.or_else(|| add(asm, shape, at)) {
        enter_area(asm, number);
    }
}

/// Adds an area; reports an error if there are too many.
pub(super) fn add(asm: &mut Assembler<'_>, shape: AreaShape, at: std::ops::Range<usize>) -> Option<usize> {
    let Some(section) = section(asm, &shape) else {
        let hint = "join areas under one name";
        asm.report(LineFault::new("ASM017", at, "the program has too many areas", hint));
        return None;
    };
    let areas = &mut asm.family_state.mcs51.areas.all;
    areas.push(PassArea { section, shape, line: asm.line.clone(), at });
    Some(areas.len() - 1)
}

/// Returns the number of the AX51 segment with this name; case is ignored.
pub(super) fn segment(asm: &Assembler<'_>, name: &str) -> Option<usize> {
    let is_it = |area: &PassArea| area.shape.class.is_some() && area.shape.name.eq_ignore_ascii_case(name);
    asm.family_state.mcs51.areas.all.iter().position(is_it)
}

/// Returns the memory of an area whose line names none: RAM for SDCC's names, as SDCC uses them, and for any
/// other name, as in sdld. With ABS, the code of an area is at its `.org`, whichever memory sdld assigns it
/// to.
fn default_memory(name: &str, absolute: bool) -> AreaMemory {
    let data = ["DSEG", "ISEG", "OSEG", "SSEG", "RSEG", "IABS", "DABS", "BIT_BANK"];
    let data = data.contains(&name) || name.starts_with("REG_BANK_");
    match name {
        "BSEG" => AreaMemory::Bit,
        "XSEG" | "PSEG" | "XISEG" | "XABS" | "XSTK" => AreaMemory::Xdata,
        _ if absolute && !data => AreaMemory::Code,
        _ => AreaMemory::Data,
    }
}

/// Returns the section of an area; the first pass creates it.
fn section(asm: &mut Assembler<'_>, shape: &AreaShape) -> Option<usize> {
    let (space, holds) = match shape.memory {
        AreaMemory::Code => ("", SectionContent::Image),
        AreaMemory::Data => ("idata", SectionContent::Addresses),
        AreaMemory::Xdata => ("xdata", SectionContent::Addresses),
        AreaMemory::Bit => ("bit", SectionContent::Addresses),
    };
    let rank = (asm.dialect.sections.len(), 0, 0);
    let name = shape.name.clone();
    let made = AsmSection { name, space, holds, behind: None, rank, align: 1, base: 0, unit: 1, pos: 0 };
    asm.out.add_section(made, asm.dialect.sections.len())
}

/// Continues in an area.
pub(super) fn enter_area(asm: &mut Assembler<'_>, number: usize) {
    let Some(area) = asm.family_state.mcs51.areas.all.get(number) else { return };
    asm.out.enter_section(area.section);
    let base = asm.out.initial_sections.get(area.section).map_or(0, |first| first.pos);
    if area.shape.absolute {
        asm.out.set_address(0);
    } else if area.shape.overlaid {
        asm.out.set_address(base);
    }
    asm.family_state.mcs51.areas.open = Some((number, asm.out.next_address()));
}

/// Closes the open part of an area.
pub(super) fn leave_area(asm: &mut Assembler<'_>) {
    let Some((number, from)) = asm.family_state.mcs51.areas.open.take() else { return leave_fixed(asm) };
    let Some(area) = asm.family_state.mcs51.areas.all.get_mut(number) else { return };
    let base = asm.out.initial_sections.get(area.section).map_or(0, |first| first.pos);
    let end = asm.out.sections.get(area.section).map_or(base, |section| section.pos);
    if area.shape.absolute {
        area.shape.parts.push((from, end - from));
    } else {
        area.shape.size = area.shape.size.max(end - base);
    }
}

/// Closes the open part of an ASM51 section.
fn leave_fixed(asm: &mut Assembler<'_>) {
    let memory = match asm.out.section().map_or("", |section| section.space) {
        "" => AreaMemory::Code,
        "xdata" => AreaMemory::Xdata,
        "bit" => AreaMemory::Bit,
        _ => AreaMemory::Data,
    };
    let here = asm.out.next_address();
    let areas = &mut asm.family_state.mcs51.areas;
    if here > areas.part_start {
        areas.absolute_parts.push(AbsolutePart { memory, at: areas.part_start, size: here - areas.part_start });
    }
    areas.part_start = here;
}

/// Begins a part of an ASM51 section.
pub(super) fn begin_fixed(asm: &mut Assembler<'_>) {
    asm.family_state.mcs51.areas.part_start = asm.out.next_address();
}

/// `.org` in an area: begins its next part. Only an area with ABS may have one.
pub(super) fn org(asm: &mut Assembler<'_>, call: &DirectiveCall<'_>) {
    let Some((number, _)) = asm.family_state.mcs51.areas.open else {
        leave_fixed(asm);
        super::super::common::org(asm, call);
        return begin_fixed(asm);
    };
    let relocatable = asm.family_state.mcs51.areas.all.get(number).filter(|area| !area.shape.absolute);
    if let Some(area) = relocatable {
        let cause = format!("`org` in the area {}, which the linker places", area.shape.name);
        let hint = match area.shape.class {
            Some(_) => "write `cseg at ADDRESS`, or reserve space with ds",
            None => "give the area the attribute ABS, or reserve space with .ds",
        };
        return asm.report(LineFault::new("ASM031", call.word.clone(), cause, hint));
    }
    leave_area(asm);
    super::super::common::org(asm, call);
    asm.family_state.mcs51.areas.open = Some((number, asm.out.next_address()));
}

/// Returns cause and hint for bytes in an area of RAM, which cannot hold them.
pub(super) fn why_no_bytes(asm: &Assembler<'_>) -> Option<CauseAndHint> {
    let (number, _) = asm.family_state.mcs51.areas.open?;
    let AreaShape { name, class, .. } = &asm.family_state.mcs51.areas.all.get(number)?.shape;
    if class.is_some() {
        let cause = format!("the segment {name} is not in program memory, so a program cannot fill it");
        return Some(CauseAndHint::new(cause, format!("write `{name} segment code`, or reserve space with ds")));
    }
    let cause = format!("the area {name} is in RAM, so a program cannot fill it");
    Some(CauseAndHint::new(
        cause,
        format!("write `.area {name} (CODE)` at its first occurrence, or reserve space with .ds"),
    ))
}

/// Places the areas at the end of a pass.
pub(super) fn place_areas(asm: &mut Assembler<'_>) {
    leave_area(asm);
    if asm.family_state.mcs51.areas.all.is_empty() {
        return;
    }
    let mut areas = std::mem::take(&mut asm.family_state.mcs51.areas);
    let ram = asm.chip.space("idata").map_or(256, |space| space.size);
    let shapes: Vec<AreaShape> = areas.all.iter().map(|area| area.shape.clone()).collect();
    let banks = asm.family_state.mcs51.used_banks | 1;
    let found = layout(&shapes, &areas.absolute_parts, banks, ram as usize);
    for (area, base) in areas.all.iter().zip(&found.bases) {
        if let Some(first) = asm.out.initial_sections.get_mut(area.section) {
            asm.chip_name_redefined |= first.pos != *base;
            first.pos = *base;
        }
    }
    asm.chip_name_redefined |= areas.limits != found.limits;
    areas.limits = found.limits;
    for (number, complaint) in found.complaints {
        let Some(area) = areas.all.get(number) else { continue };
        asm.line.clone_from(&area.line);
        asm.report(complaint_fault(&area.shape.name, area.at.clone(), &complaint));
        asm.line = None;
    }
    asm.family_state.mcs51.areas = areas;
}

fn complaint_fault(name: &str, at: std::ops::Range<usize>, complaint: &PlacementFault) -> LineFault {
    match complaint {
        PlacementFault::Full(size) => {
            let cause = format!("there are no {size} free bytes in a row in the memory of the area {name}");
            LineFault::new("ASM037", at, cause, "reserve less, or use another memory")
        }
        PlacementFault::Shared(addr, with) => {
            let cause = format!("sdld puts the area {name} over {with}, from 0x{addr:02X} on");
            LineFault::new("ASM038", at, cause, "join it with DSEG, or give it ABS and an .org").warning()
        }
        PlacementFault::Page => {
            let cause = format!("the area {name} with PAG crosses the end of a page of 256 bytes");
            LineFault::new("ASM038", at, cause, "make it smaller").warning()
        }
    }
}

impl super::Mcs51PassState {
    /// Returns the state that the next pass takes over.
    pub fn next(self) -> super::Mcs51PassState {
        let areas = PassAreas { limits: self.areas.limits, ..PassAreas::default() };
        super::Mcs51PassState { areas, classes: self.classes, ..super::Mcs51PassState::default() }
    }
}
