//! Sections: which ones exist, and their order in memory, as in the linker's script.

use std::ops::Range;

use emu_core::chip::Chip;
use emu_core::image::ImageSpace;

use crate::dialect::{AsmDialect, SectionContent, SectionRow};
use crate::engine::Assembler;
use crate::fault::LineFault;
use crate::output::PassOutput;

/// Separates the name of a section from the number of its subsection.
const PART: char = '\u{1}';
/// The maximum number of sections of a program.
const MAX_SECTIONS: usize = 1000;

/// A section.
#[derive(Debug, Clone)]
pub(crate) struct AsmSection {
    /// Its name.
    pub name: String,
    /// Name of the memory of its labels; empty if the windows of the image determine it.
    pub space: &'static str,
    /// What it holds.
    pub holds: SectionContent,
    /// It follows the previous sections of its memory, at a multiple of this.
    pub behind: Option<i64>,
    /// Its order: its row, how many sections were created before it, and its subsection number.
    pub rank: (usize, usize, u16),
    /// Its largest alignment, to which its end is padded.
    pub align: i64,
    /// Byte address of its address 0 in the image file.
    pub base: u64,
    /// Bytes per address.
    pub unit: u32,
    /// The next byte, counted from its address 0.
    pub pos: i64,
}

/// Returns the sections that a dialect has from the start.
pub(crate) fn initial_sections(chip: &Chip, d: &AsmDialect, spaces: &[ImageSpace]) -> Vec<AsmSection> {
    let code = chip.bytes_per_address(chip.code_space);
    let section = |(rank, row): (usize, &SectionRow)| {
        let window = spaces.iter().find(|space| space.name == row.space);
        AsmSection {
            name: row.name.to_owned(),
            space: row.space,
            holds: row.content,
            base: window.filter(|_| row.content == SectionContent::Memory).map_or(0, |space| space.start.into()),
            behind: row.align_after_previous,
            rank: (rank, 0, 0),
            align: 1,
            unit: if row.content == SectionContent::Image { code } else { 1 },
            pos: if row.space == chip.ram_space { chip.ram_start.into() } else { 0 },
        }
    };
    d.sections.iter().enumerate().map(section).collect()
}

/// Returns the section where the program begins.
pub(crate) fn start_section(d: &AsmDialect) -> usize {
    d.sections.iter().position(|row| row.name == "text").unwrap_or(0)
}

fn align_up(at: i64, step: i64) -> i64 {
    let step = step.max(1);
    at.saturating_add(step - 1).div_euclid(step) * step
}

/// Returns the alignment of a section with all its subsections, and whether this is the last of them, whose
/// end is padded.
fn part_alignment(sections: &[AsmSection], section: &AsmSection) -> (i64, bool) {
    let own = |other: &&AsmSection| (other.rank.0, other.rank.1) == (section.rank.0, section.rank.1);
    let parts = || sections.iter().filter(own);
    let align = parts().map(|part| part.align).max().unwrap_or(1);
    (align, parts().all(|part| part.rank.2 <= section.rank.2))
}

impl PassOutput {
    /// Returns the numbers of the sections that follow each other, in order.
    fn sections_in_order(&self) -> Vec<usize> {
        let ranked = |i: &usize| self.sections.get(*i).map(|section| section.rank);
        let mut order: Vec<usize> = (0..self.sections.len()).collect();
        order.retain(|i| self.sections.get(*i).is_some_and(|section| section.behind.is_some()));
        order.sort_by_key(ranked);
        order
    }

    /// Places sections of a memory one after another, as a linker does; returns true if one has moved.
    pub fn place_behind_each_other(&mut self) -> bool {
        let mut moved = false;
        let mut ends: Vec<(&'static str, i64)> = Vec::new();
        for i in self.sections_in_order() {
            let (Some(first), Some(section)) = (self.initial_sections.get_mut(i), self.sections.get(i)) else {
                continue;
            };
            let length = (section.pos - first.pos).max(0);
            let end = ends.iter_mut().find(|(space, _)| *space == first.space);
            let (align, is_last) = part_alignment(&self.sections, section);
            if let Some((_, end)) = &end {
                let at = if section.rank.2 == 0 { align_up(*end, align.max(first.behind.unwrap_or(1))) } else { *end };
                moved |= first.pos != at;
                first.pos = at;
            }
            let behind = if is_last { align_up(first.pos + length, align) } else { first.pos + length };
            match end {
                Some((_, end)) => *end = behind,
                None => ends.push((first.space, behind)),
            }
        }
        moved
    }

    /// Returns the address of the first byte that is copied.
    pub fn copied_from(&self) -> i64 {
        let copied = self.initial_sections.iter().filter(|section| section.holds == SectionContent::Copied);
        copied.map(|section| section.pos).min().unwrap_or(0)
    }

    /// Returns the largest alignment of the copied sections.
    pub fn copied_align(&self) -> u64 {
        let copied = self.sections.iter().filter(|section| section.holds == SectionContent::Copied);
        copied.map(|section| section.align).max().map_or(1, |align| align.max(1) as u64)
    }

    /// Returns the start of the current section, with all its subsections, if it begins where others end;
    /// otherwise 0. Atmel's `dseg` has fixed addresses of RAM.
    pub fn shift(&self) -> i64 {
        let whole = self.initial_sections.get(self.current).map(|own| (own.rank.0, own.rank.1, 0));
        let first = self.initial_sections.iter().find(|first| Some(first.rank) == whole && first.name != "dseg");
        first.filter(|first| first.behind.is_some()).map_or(0, |first| first.pos / i64::from(first.unit.max(1)))
    }

    /// Returns the number of the section of this name; creates it if there is none.
    pub fn open(&mut self, name: &str, space: &'static str, holds: SectionContent) -> Option<usize> {
        let unit = if holds == SectionContent::Image { self.initial_sections.first()?.unit } else { 1 };
        let rank = (self.sections.len(), 0, 0);
        let made =
            AsmSection { name: name.to_owned(), space, holds, behind: None, rank, align: 1, base: 0, unit, pos: 0 };
        self.add_section(made, 0)
    }

    /// Returns the number of the section with this name after the first `own` ones; adds it if there is none.
    /// `None` if there are too many.
    pub fn add_section(&mut self, made: AsmSection, own: usize) -> Option<usize> {
        let known = self.sections.iter().skip(own).position(|section| section.name == made.name);
        if let Some(number) = known {
            return Some(own + number);
        }
        let number = self.sections.len();
        if number >= MAX_SECTIONS {
            return None;
        }
        self.initial_sections.push(made.clone());
        self.sections.push(made);
        Some(number)
    }

    /// Sets the start address of a section for all later passes; returns true if it was different.
    pub fn begin_at(&mut self, number: usize, at: i64) -> bool {
        let Some(first) = self.initial_sections.get_mut(number) else { return false };
        let pos = at.saturating_mul(first.unit.into());
        std::mem::replace(&mut first.pos, pos) != pos
    }

    /// Returns the addresses of a section in this pass, from its start to its next address.
    pub fn extent(&self, number: usize) -> Range<i64> {
        let (Some(first), Some(now)) = (self.initial_sections.get(number), self.sections.get(number)) else {
            return 0..0;
        };
        let unit = i64::from(now.unit.max(1));
        first.pos / unit..now.pos / unit
    }

    /// Switches to the section of this number.
    pub fn enter_section(&mut self, number: usize) {
        (self.previous, self.current) = (self.current, number);
    }

    /// Returns to the section before the last switch.
    pub fn enter_previous(&mut self) {
        self.enter_section(self.previous);
    }

    /// Switches to the section of this name; creates it if a row of the dialect covers its prefix. `None` if
    /// there is no such section.
    pub fn enter_named(&mut self, name: &str) -> Option<()> {
        let known = |section: &AsmSection| !section.name.ends_with('*') && section.name.eq_ignore_ascii_case(name);
        let number = match self.sections.iter().position(known) {
            Some(number) => number,
            None => self.make_section(name)?,
        };
        self.enter_section(number);
        Some(())
    }

    /// Switches to a subsection of the current section; it begins where the previous one ends.
    pub fn enter_part(&mut self, part: u16) -> Option<()> {
        let base = self.section()?;
        let (name, rank) = (base.name.split(PART).next().unwrap_or_default().to_owned(), base.rank);
        let wanted = (rank.0, rank.1, part);
        let number = match self.sections.iter().position(|section| section.rank == wanted) {
            Some(number) => number,
            None if self.sections.len() >= MAX_SECTIONS => return None,
            None => {
                let first = self.initial_sections.get(self.current)?;
                let made = AsmSection { name: format!("{name}{PART}{part}"), rank: wanted, align: 1, ..first.clone() };
                self.initial_sections.push(made.clone());
                self.sections.push(made);
                self.sections.len() - 1
            }
        };
        self.current = number;
        Some(())
    }

    fn make_section(&mut self, name: &str) -> Option<usize> {
        let stem = |section: &&AsmSection| section.name.strip_suffix('*').is_some_and(|stem| name.starts_with(stem));
        let longest = self.initial_sections.iter().filter(stem).max_by_key(|section| section.name.len())?;
        let number = self.sections.len();
        if number >= MAX_SECTIONS {
            return None;
        }
        let made = AsmSection { name: name.to_owned(), rank: (longest.rank.0, number, 0), ..longest.clone() };
        self.initial_sections.push(made.clone());
        self.sections.push(made);
        Some(number)
    }
}

impl Assembler<'_> {
    /// Pads sections up to the start of the next, as the linker does.
    pub fn fill_gaps(&mut self) {
        let order = self.out.sections_in_order();
        for (place, &current) in order.iter().enumerate() {
            self.out.current = current;
            let Some(section) = self.out.sections.get(current) else { continue };
            let (align, is_last) = part_alignment(&self.out.sections, section);
            let mut end = if is_last { align_up(section.pos, align) } else { section.pos };
            // Empty sections between two others have alignments too.
            for next in order
                .iter()
                .skip(place + 1)
                .filter_map(|i| Some((self.out.initial_sections.get(*i)?, self.out.sections.get(*i)?)))
            {
                let (begin, now) = next;
                if begin.space != section.space {
                    continue;
                }
                let same = begin.holds == section.holds;
                end = if same { end.max(begin.pos) } else { align_up(end, begin.behind.unwrap_or(1)) };
                if !same || now.pos != begin.pos {
                    break;
                }
            }
            let gap = end.saturating_sub(section.pos);
            let offset = self.out.image_address();
            let taken =
                self.out.runs.iter().any(|run| {
                    run.section == current && (run.addr..run.addr + run.bytes.len() as u64).contains(&offset)
                });
            let holds = section.holds != SectionContent::Addresses;
            if holds && self.out.has_begun() && (1..=1 << 20).contains(&gap) && !taken {
                self.emit(&vec![0; gap as usize], 0..0);
            }
        }
    }

    /// Warns of `org` in a section whose start depends on others.
    pub fn report_shifted_org(&mut self, at: std::ops::Range<usize>, start: i64) {
        let name = self.out.section().map_or("", |section| section.name.split(PART).next().unwrap_or_default());
        let cause = format!("`org` counts from the start of .{name}, which is 0x{start:X} here");
        self.report(LineFault::new("ASM031", at, cause, "reserve room with .space, or take .balign").warning());
    }
}
