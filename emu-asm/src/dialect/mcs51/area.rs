//! Areas of sdas8051: what `.area` begins, and where the linker sdld puts the areas of one module.
//!
//! Parts of an area with the same name lie behind each other; those with OVR begin at the same address. Areas with ABS lie where
//! their `.org` says. What sdld does with all others is in [`layout`](super::layout).

use std::collections::BTreeMap;

use super::layout::{Complaint, Memory, Shape, layout};
use crate::dialect::Holds;
use crate::engine::{Asm, Call};
use crate::fault::Fault;
use crate::sections::Section;
use crate::text::{Line, trim};

/// An area of the pass.
#[derive(Debug, Clone)]
struct Area {
    /// Its section.
    section: usize,
    shape: Shape,
    /// The line that names it first, for complaints.
    line: Option<Line>,
    /// The place of its name in that line.
    at: std::ops::Range<usize>,
}

/// The areas so far.
#[derive(Debug, Default)]
pub(super) struct Areas {
    all: Vec<Area>,
    /// The area that is open, and where its part began.
    open: Option<(usize, i64)>,
    /// Where the part of a section of ASM51 began that is open where no area is, and the parts that are closed.
    from: i64,
    fixed: Vec<(Memory, i64, i64)>,
    /// `s_NAME` and `l_NAME`, first address and size of each area, and segments by their names, as the pass before had them.
    limits: BTreeMap<String, i64>,
}

impl Areas {
    /// First address or size of an area by the linker's name for it; that of a segment by its own, in any case of its letters.
    pub fn limit(&self, name: &str) -> Option<i64> {
        self.limits.get(name).or_else(|| self.limits.get(&name.to_ascii_lowercase())).copied()
    }
}

/// An attribute in the brackets of `.area`.
fn attribute(shape: &mut Shape, memory: &mut Option<Memory>, word: &str) -> bool {
    match word.to_ascii_uppercase().as_str() {
        "REL" | "CON" | "NOPAG" => {}
        "ABS" => shape.absolute = true,
        "OVR" => shape.overlaid = true,
        "PAG" => shape.paged = true,
        "CODE" => *memory = Some(Memory::Code),
        "XDATA" => *memory = Some(Memory::Xdata),
        "BIT" => *memory = Some(Memory::Bit),
        "DATA" => *memory = Some(Memory::Data),
        _ => return false,
    }
    true
}

/// `.area NAME (ABS,CODE)`.
pub(super) fn area(asm: &mut Asm<'_>, call: &Call<'_>) {
    super::of_sdas(asm, call);
    leave(asm);
    let rest = trim(call.text, call.rest.clone());
    let written = call.get(rest.clone());
    let len = written.find(|c: char| c.is_whitespace() || c == '(' || c == ',').unwrap_or(written.len());
    let name = written.get(..len).unwrap_or_default();
    let at = rest.start..rest.start + len;
    if name.is_empty() {
        let hint = "write `.area CSEG (CODE)`";
        return asm.tell(Fault::new("ASM023", call.word.clone(), "the name of the area is missing", hint));
    }
    let behind = written.get(len..).unwrap_or_default();
    let mut shape = Shape { name: name.to_owned(), ..Shape::default() };
    let mut memory = None;
    for word in behind.split(|c: char| c.is_whitespace() || matches!(c, '(' | ')' | ',')).filter(|w| !w.is_empty()) {
        if !attribute(&mut shape, &mut memory, word) {
            let cause = format!("`{word}` is no attribute of an area");
            let hint = "there are ABS, REL, CON, OVR, PAG, NOPAG, CODE, DATA, XDATA and BIT";
            return asm.tell(Fault::new("ASM023", at, cause, hint));
        }
    }
    // The area in front of the first directive.
    if name == "_CODE" {
        let _ = asm.out.switch("code");
        return;
    }
    shape.memory = memory.unwrap_or_else(|| unsaid(name, shape.absolute));
    let known = asm.own.mcs51.areas.all.iter().position(|area| area.shape.name == name);
    let first = known.and_then(|number| asm.own.mcs51.areas.all.get(number)).filter(|_| !behind.trim().is_empty());
    if first.is_some_and(|first| !first.shape.is_like(&shape)) {
        let cause = format!("the area {name} has other attributes where it first stands");
        return asm.tell(Fault::new("ASM007", at, cause, "give it the same in both places, or none here"));
    }
    if let Some(number) = known.or_else(|| add(asm, shape, at)) {
        enter(asm, number);
    }
}

/// Adds an area; told where there are too many.
pub(super) fn add(asm: &mut Asm<'_>, shape: Shape, at: std::ops::Range<usize>) -> Option<usize> {
    let Some(section) = section(asm, &shape) else {
        let hint = "join areas under one name";
        asm.tell(Fault::new("ASM017", at, "the program has too many areas", hint));
        return None;
    };
    let areas = &mut asm.own.mcs51.areas.all;
    areas.push(Area { section, shape, line: asm.line.clone(), at });
    Some(areas.len() - 1)
}

/// The number of the segment of AX51 with this name, in any case of its letters.
pub(super) fn segment(asm: &Asm<'_>, name: &str) -> Option<usize> {
    let is_it = |area: &Area| area.shape.class.is_some() && area.shape.name.eq_ignore_ascii_case(name);
    asm.own.mcs51.areas.all.iter().position(is_it)
}

/// The memory of an area whose line names none: RAM, as SDCC has it for its own names and as sdld takes every other. With ABS the
/// code of an area lies where `.org` puts it, whatever memory sdld counts it to.
fn unsaid(name: &str, absolute: bool) -> Memory {
    let data = ["DSEG", "ISEG", "OSEG", "SSEG", "RSEG", "IABS", "DABS", "BIT_BANK"];
    let data = data.contains(&name) || name.starts_with("REG_BANK_");
    match name {
        "BSEG" => Memory::Bit,
        "XSEG" | "PSEG" | "XISEG" | "XABS" | "XSTK" => Memory::Xdata,
        _ if absolute && !data => Memory::Code,
        _ => Memory::Data,
    }
}

/// The section of an area, made in the first pass.
fn section(asm: &mut Asm<'_>, shape: &Shape) -> Option<usize> {
    let (space, holds) = match shape.memory {
        Memory::Code => ("", Holds::Image),
        Memory::Data => ("idata", Holds::Addresses),
        Memory::Xdata => ("xdata", Holds::Addresses),
        Memory::Bit => ("bit", Holds::Addresses),
    };
    let rank = (asm.d.sections.len(), 0);
    let name = shape.name.clone();
    let made = Section { name, space, holds, behind: None, rank, align: 1, base: 0, unit: 1, pos: 0 };
    asm.out.add_section(made, asm.d.sections.len())
}

/// Goes on in an area.
pub(super) fn enter(asm: &mut Asm<'_>, number: usize) {
    let Some(area) = asm.own.mcs51.areas.all.get(number) else { return };
    asm.out.turn_to(area.section);
    let base = asm.out.first.get(area.section).map_or(0, |first| first.pos);
    if area.shape.absolute {
        asm.out.go(0);
    } else if area.shape.overlaid {
        asm.out.go(base);
    }
    asm.own.mcs51.areas.open = Some((number, asm.out.here()));
}

/// Ends the part of an area that is open.
pub(super) fn leave(asm: &mut Asm<'_>) {
    let Some((number, from)) = asm.own.mcs51.areas.open.take() else { return leave_fixed(asm) };
    let Some(area) = asm.own.mcs51.areas.all.get_mut(number) else { return };
    let base = asm.out.first.get(area.section).map_or(0, |first| first.pos);
    let end = asm.out.sections.get(area.section).map_or(base, |section| section.pos);
    if area.shape.absolute {
        area.shape.parts.push((from, end - from));
    } else {
        area.shape.size = area.shape.size.max(end - base);
    }
}

/// Ends the part of a section of ASM51 that is open.
fn leave_fixed(asm: &mut Asm<'_>) {
    let memory = match asm.out.section().map_or("", |section| section.space) {
        "" => Memory::Code,
        "xdata" => Memory::Xdata,
        "bit" => Memory::Bit,
        _ => Memory::Data,
    };
    let here = asm.out.here();
    let areas = &mut asm.own.mcs51.areas;
    if here > areas.from {
        areas.fixed.push((memory, areas.from, here - areas.from));
    }
    areas.from = here;
}

/// A part of a section of ASM51 begins here.
pub(super) fn begin_fixed(asm: &mut Asm<'_>) {
    asm.own.mcs51.areas.from = asm.out.here();
}

/// `.org` in an area: its next part, which only one with ABS may have.
pub(super) fn org(asm: &mut Asm<'_>, call: &Call<'_>) {
    let Some((number, _)) = asm.own.mcs51.areas.open else {
        leave_fixed(asm);
        super::super::common::org(asm, call);
        return begin_fixed(asm);
    };
    let relocatable = asm.own.mcs51.areas.all.get(number).filter(|area| !area.shape.absolute);
    if let Some(area) = relocatable {
        let cause = format!("`org` in the area {}, which the linker places", area.shape.name);
        let hint = match area.shape.class {
            Some(_) => "write `cseg at ADDRESS`, or reserve room with ds",
            None => "give the area the attribute ABS, or reserve room with .ds",
        };
        return asm.tell(Fault::new("ASM031", call.word.clone(), cause, hint));
    }
    leave(asm);
    super::super::common::org(asm, call);
    asm.own.mcs51.areas.open = Some((number, asm.out.here()));
}

/// Bytes for an area of RAM: why there is no place for them, and what to do.
pub(super) fn why_no_bytes(asm: &Asm<'_>) -> Option<(String, String)> {
    let (number, _) = asm.own.mcs51.areas.open?;
    let Shape { name, class, .. } = &asm.own.mcs51.areas.all.get(number)?.shape;
    if class.is_some() {
        let cause = format!("the segment {name} is not one of program memory, and a program cannot fill it");
        return Some((cause, format!("write `{name} segment code`, or reserve room with ds")));
    }
    let cause = format!("the area {name} is one of RAM, and a program cannot fill it");
    Some((cause, format!("write `.area {name} (CODE)` where it first stands, or reserve room with .ds")))
}

/// Places the areas at the end of a pass.
pub(super) fn place(asm: &mut Asm<'_>) {
    leave(asm);
    if asm.own.mcs51.areas.all.is_empty() {
        return;
    }
    let mut areas = std::mem::take(&mut asm.own.mcs51.areas);
    let ram = asm.chip.spaces.iter().find(|(name, ..)| *name == "idata").map_or(256, |(_, size, _)| *size);
    let shapes: Vec<Shape> = areas.all.iter().map(|area| area.shape.clone()).collect();
    let banks = asm.own.mcs51.banks | 1;
    let found = layout(&shapes, &areas.fixed, banks, ram as usize);
    for (area, base) in areas.all.iter().zip(&found.bases) {
        if let Some(first) = asm.out.first.get_mut(area.section) {
            asm.late |= first.pos != *base;
            first.pos = *base;
        }
    }
    asm.late |= areas.limits != found.limits;
    areas.limits = found.limits;
    for (number, complaint) in found.complaints {
        let Some(area) = areas.all.get(number) else { continue };
        asm.line.clone_from(&area.line);
        asm.tell(told(&area.shape.name, area.at.clone(), &complaint));
        asm.line = None;
    }
    asm.own.mcs51.areas = areas;
}

fn told(name: &str, at: std::ops::Range<usize>, complaint: &Complaint) -> Fault {
    match complaint {
        Complaint::Full(size) => {
            let cause = format!("there are no {size} free bytes in a row in the memory of the area {name}");
            Fault::new("ASM037", at, cause, "reserve less, or use another memory")
        }
        Complaint::Shared(addr, with) => {
            let cause = format!("sdld puts the area {name} over {with}, from 0x{addr:02X} on");
            Fault::new("ASM038", at, cause, "join it with DSEG, or give it ABS and an .org").warning()
        }
        Complaint::Page => {
            let cause = format!("the area {name} with PAG crosses the end of a page of 256 bytes");
            Fault::new("ASM038", at, cause, "make it smaller").warning()
        }
    }
}

impl super::State {
    /// What the next pass takes over from this one.
    pub fn next(self) -> super::State {
        let areas = Areas { limits: self.areas.limits, ..Areas::default() };
        super::State { areas, ..super::State::default() }
    }
}
