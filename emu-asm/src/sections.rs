//! Sections: which there are, and in which order they lie, as the linker's script has it.

use std::ops::Range;

use emu_core::chip::Chip;
use emu_core::image::Space;

use crate::dialect::{Dialect, Holds, SectionRow};
use crate::engine::Asm;
use crate::fault::Fault;
use crate::output::Output;

/// Sections that a program may have.
const MOST: usize = 1000;

/// A section.
#[derive(Debug, Clone)]
pub(crate) struct Section {
    /// Its name.
    pub name: String,
    /// Name of the memory of its labels; empty where the image's windows tell.
    pub space: &'static str,
    /// What it holds.
    pub holds: Holds,
    /// It lies behind the sections before it in the same memory, from a multiple of this on.
    pub behind: Option<i64>,
    /// Its place among them: its row, and how many were made before it.
    pub rank: (usize, usize),
    /// The largest alignment in it, to which it is filled up at its end.
    pub align: i64,
    /// Byte address of its address 0 in the image file.
    pub base: u64,
    /// Bytes per address.
    pub unit: u32,
    /// The byte that comes next, from its address 0.
    pub pos: i64,
}

/// The sections that a dialect has from the start.
pub(crate) fn begin(chip: &Chip, d: &Dialect, spaces: &[Space]) -> Vec<Section> {
    let code = chip.width(chip.code);
    let section = |(rank, row): (usize, &SectionRow)| {
        let window = spaces.iter().find(|space| space.name == row.space);
        Section {
            name: row.name.to_owned(),
            space: row.space,
            holds: row.holds,
            base: window.filter(|_| row.holds == Holds::Memory).map_or(0, |space| space.start.into()),
            behind: row.behind,
            rank: (rank, 0),
            align: 1,
            unit: if row.holds == Holds::Image { code } else { 1 },
            pos: if row.space == chip.ram { chip.ram_start.into() } else { 0 },
        }
    };
    d.sections.iter().enumerate().map(section).collect()
}

/// Where the program begins.
pub(crate) fn start(d: &Dialect) -> usize {
    d.sections.iter().position(|row| row.name == "text").unwrap_or(0)
}

fn up(at: i64, step: i64) -> i64 {
    let step = step.max(1);
    at.saturating_add(step - 1).div_euclid(step) * step
}

impl Output {
    /// Numbers of the sections that lie behind each other, in their order.
    fn chain(&self) -> Vec<usize> {
        let ranked = |i: &usize| self.sections.get(*i).map(|section| section.rank);
        let mut order: Vec<usize> = (0..self.sections.len()).collect();
        order.retain(|i| self.sections.get(*i).is_some_and(|section| section.behind.is_some()));
        order.sort_by_key(ranked);
        order
    }

    /// Sections in the same memory lie behind each other, as a linker puts them; true where one of them has moved.
    pub fn stack(&mut self) -> bool {
        let mut moved = false;
        let mut ends: Vec<(&'static str, i64)> = Vec::new();
        for i in self.chain() {
            let (Some(first), Some(section)) = (self.first.get_mut(i), self.sections.get(i)) else { continue };
            let length = (section.pos - first.pos).max(0);
            let end = ends.iter_mut().find(|(space, _)| *space == first.space);
            if let Some((_, end)) = &end {
                let at = up(*end, section.align.max(first.behind.unwrap_or(1)));
                moved |= first.pos != at;
                first.pos = at;
            }
            let behind = up(first.pos + length, section.align);
            match end {
                Some((_, end)) => *end = behind,
                None => ends.push((first.space, behind)),
            }
        }
        moved
    }

    /// The address of the first byte that is copied.
    pub fn copied_from(&self) -> i64 {
        let copied = self.first.iter().filter(|section| section.holds == Holds::Copied);
        copied.map(|section| section.pos).min().unwrap_or(0)
    }

    /// The largest alignment of what is copied.
    pub fn copied_align(&self) -> u64 {
        let copied = self.sections.iter().filter(|section| section.holds == Holds::Copied);
        copied.map(|section| section.align).max().map_or(1, |align| align.max(1) as u64)
    }

    /// The current section begins where others end, so that no address in it is certain; Atmel's `dseg` has addresses of RAM.
    pub fn is_shifted(&self) -> bool {
        let first = self.first.get(self.current).filter(|first| first.name != "dseg");
        first.is_some_and(|first| first.behind.is_some() && first.pos != 0)
    }

    /// The number of the section of this name, which is made where there is none yet.
    pub fn open(&mut self, name: &str, space: &'static str, holds: Holds) -> Option<usize> {
        let unit = if holds == Holds::Image { self.first.first()?.unit } else { 1 };
        let rank = (self.sections.len(), 0);
        let made = Section { name: name.to_owned(), space, holds, behind: None, rank, align: 1, base: 0, unit, pos: 0 };
        self.add_section(made, 0)
    }

    /// The section of this name behind the first `own` ones, which is added where there is none; nothing where there are too many.
    pub fn add_section(&mut self, made: Section, own: usize) -> Option<usize> {
        let known = self.sections.iter().skip(own).position(|section| section.name == made.name);
        if let Some(number) = known {
            return Some(own + number);
        }
        let number = self.sections.len();
        if number >= MOST {
            return None;
        }
        self.first.push(made.clone());
        self.sections.push(made);
        Some(number)
    }

    /// The section of this number begins at this address in all passes to come; true where it began elsewhere.
    pub fn begin_at(&mut self, number: usize, at: i64) -> bool {
        let Some(first) = self.first.get_mut(number) else { return false };
        let pos = at.saturating_mul(first.unit.into());
        std::mem::replace(&mut first.pos, pos) != pos
    }

    /// The addresses of a section in this pass, from its begin to what comes next.
    pub fn extent(&self, number: usize) -> Range<i64> {
        let (Some(first), Some(now)) = (self.first.get(number), self.sections.get(number)) else { return 0..0 };
        let unit = i64::from(now.unit.max(1));
        first.pos / unit..now.pos / unit
    }

    /// Goes on in the section of this number.
    pub fn turn_to(&mut self, number: usize) {
        (self.previous, self.current) = (self.current, number);
    }

    /// Goes back to the section before the last change.
    pub fn turn_back(&mut self) {
        self.turn_to(self.previous);
    }

    /// Switches to the section of this name, which is made where a row of the dialect stands for all names with its begin; `None` where
    /// there is none.
    pub fn switch(&mut self, name: &str) -> Option<()> {
        let known = |section: &Section| !section.name.ends_with('*') && section.name.eq_ignore_ascii_case(name);
        let number = match self.sections.iter().position(known) {
            Some(number) => number,
            None => self.make(name)?,
        };
        self.turn_to(number);
        Some(())
    }

    fn make(&mut self, name: &str) -> Option<usize> {
        let stem = |section: &&Section| section.name.strip_suffix('*').is_some_and(|stem| name.starts_with(stem));
        let longest = self.first.iter().filter(stem).max_by_key(|section| section.name.len())?;
        let number = self.sections.len();
        if number >= MOST {
            return None;
        }
        let made = Section { name: name.to_owned(), rank: (longest.rank.0, number), ..longest.clone() };
        self.first.push(made.clone());
        self.sections.push(made);
        Some(number)
    }
}

impl Asm<'_> {
    /// Fills sections up to where the next begins, as the linker does.
    pub fn fill_up(&mut self) {
        let order = self.out.chain();
        for (place, &current) in order.iter().enumerate() {
            self.out.current = current;
            let Some(section) = self.out.sections.get(current) else { continue };
            let mut end = up(section.pos, section.align);
            // Empty sections between two others have alignments too.
            for next in
                order.iter().skip(place + 1).filter_map(|i| Some((self.out.first.get(*i)?, self.out.sections.get(*i)?)))
            {
                let (begin, now) = next;
                if begin.space != section.space {
                    continue;
                }
                let same = begin.holds == section.holds;
                end = if same { end.max(begin.pos) } else { up(end, begin.behind.unwrap_or(1)) };
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
            let holds = section.holds != Holds::Addresses;
            if holds && self.out.begun() && (1..=1 << 20).contains(&gap) && !taken {
                self.emit(&vec![0; gap as usize], 0..0);
            }
        }
    }

    /// Tells of `org` in a section whose begin hangs on others.
    pub fn tell_org(&mut self, at: std::ops::Range<usize>) {
        let name = self.out.section().map_or("", |section| &section.name);
        let cause = format!("`org` in .{name}, which lies where other sections end");
        self.tell(Fault::new("ASM031", at, cause, "reserve room with .space, or take .balign"));
    }
}
