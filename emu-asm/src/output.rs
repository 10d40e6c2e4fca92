//! Places emitted bytes: sections, memories, and reports of what does not fit.

use std::ops::Range;

use emu_core::chip::Chip;
use emu_core::image::{ImageSpace, Segment, SourceKind, SourceLine, WordBits};

use crate::dialect::{AsmDialect, SectionContent};
use crate::engine::Assembler;
use crate::fault::{CauseAndHint, LineFault};
use crate::lines::AsmLine;
use crate::sections::{self, AsmSection};

/// Bytes that a line emits.
#[derive(Debug, Clone)]
pub(crate) struct EmittedBytes {
    pub section: usize,
    /// Byte address in the image file; in a section whose bytes are copied, from the start of all such bytes.
    pub addr: u64,
    pub bytes: Range<usize>,
    /// The line, by its number in `list`.
    line: u32,
}

/// A line of the listing.
#[derive(Debug, Clone)]
pub(crate) struct ListedLine {
    /// The line.
    pub line: AsmLine,
    /// Its nesting depth in macros and repetitions.
    pub depth: u32,
    /// The address before it.
    pub addr: i64,
    /// The value of the name that it defines.
    pub value: Option<i64>,
    /// Its bytes.
    pub bytes: Range<usize>,
    /// Bytes per address, which determines how they are printed.
    pub unit: u32,
}

/// The output of a pass.
#[derive(Debug)]
pub(crate) struct PassOutput {
    /// Memories that an image may fill.
    spaces: Vec<ImageSpace>,
    code: &'static str,
    /// The sections as they were at the start of the pass.
    pub(crate) initial_sections: Vec<AsmSection>,
    pub sections: Vec<AsmSection>,
    pub current: usize,
    /// The section that was current before.
    pub previous: usize,
    /// Sections saved on the stack, each with the section before it.
    pub section_stack: Vec<(usize, usize)>,
    /// The section where the program begins.
    start_section: usize,
    pub bytes: Vec<u8>,
    /// The bytes of the pass, in the order of assembly.
    pub(crate) runs: Vec<EmittedBytes>,
    pub list: Vec<ListedLine>,
    /// The image.
    pub segments: Vec<Segment>,
    pub lines: Vec<SourceLine>,
}

/// The maximum number of bytes of a source; more are refused.
const MAX_BYTES: usize = 1 << 24;

impl PassOutput {
    pub fn new(chip: &Chip, d: &AsmDialect) -> PassOutput {
        let mut spaces = chip.hex_spaces.to_vec();
        spaces.extend(
            chip.elf_spaces.iter().filter(|space| chip.hex_spaces.iter().all(|known| known.name != space.name)),
        );
        let first = sections::initial_sections(chip, d, &spaces);
        let current = sections::start_section(d);
        PassOutput {
            spaces,
            code: chip.code_space,
            sections: first.clone(),
            initial_sections: first,
            current,
            previous: current,
            section_stack: Vec::new(),
            start_section: current,
            bytes: Vec::new(),
            runs: Vec::new(),
            list: Vec::new(),
            segments: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Begins a pass.
    pub fn restart(&mut self) {
        self.place_behind_each_other();
        self.sections.clone_from(&self.initial_sections);
        (self.current, self.previous) = (self.start_section, self.start_section);
        self.section_stack.clear();
        self.bytes.clear();
        self.runs.clear();
        self.list.clear();
    }

    pub fn section(&self) -> Option<&AsmSection> {
        self.sections.get(self.current)
    }

    /// Returns the next address, in the unit of the section.
    pub fn next_address(&self) -> i64 {
        self.section().map_or(0, |section| section.pos.div_euclid(section.unit.max(1).into()))
    }

    /// Lists the line of a run at the address of its bytes if that differs from the address before the line:
    /// a directive may emit its bytes elsewhere.
    fn list_at_run_address(&mut self, run: &EmittedBytes) {
        let section = self.sections.get(run.section).filter(|section| section.holds == SectionContent::Image);
        let listed = self.list.get_mut(run.line as usize).filter(|listed| listed.bytes.start == run.bytes.start);
        if let (Some(section), Some(listed)) = (section, listed) {
            listed.addr = (run.addr / u64::from(section.unit.max(1))) as i64;
        }
    }

    /// Sets the next address.
    pub fn set_address(&mut self, at: i64) {
        if let Some(section) = self.sections.get_mut(self.current) {
            section.pos = at.saturating_mul(section.unit.into());
        }
    }

    /// Returns the bytes per address.
    pub fn unit(&self) -> u32 {
        self.section().map_or(1, |section| section.unit)
    }

    /// Returns what the section holds.
    pub fn holds(&self) -> SectionContent {
        self.section().map_or(SectionContent::Image, |section| section.holds)
    }

    /// Returns the byte address in the image file.
    pub fn image_address(&self) -> u64 {
        self.section().map_or(0, |s| (s.base as i64).saturating_add(s.pos).max(0) as u64)
    }

    /// Returns memory and byte address of a label defined here.
    pub fn label_place(&self) -> (&'static str, u32) {
        let Some(section) = self.section() else { return (self.code, 0) };
        if section.holds != SectionContent::Image {
            return (section.space, section.pos as u32);
        }
        let addr = self.image_address();
        let inside =
            |space: &&ImageSpace| (space.start.into()..u64::from(space.start) + u64::from(space.len)).contains(&addr);
        match self.spaces.iter().find(inside) {
            Some(space) => (space.name, (addr - u64::from(space.start)) as u32),
            None => (self.code, addr as u32),
        }
    }

    /// Reports whether this section has bytes already.
    pub fn has_begun(&self) -> bool {
        self.runs.iter().any(|run| run.section == self.current)
    }

    /// Adds bytes here; returns false if there are too many.
    fn add(&mut self, bytes: &[u8], line: u32) -> bool {
        let addr = match self.section() {
            Some(section) if section.holds == SectionContent::Copied => {
                (section.pos - self.copied_from()).max(0) as u64
            }
            _ => self.image_address(),
        };
        let start = self.bytes.len();
        if start + bytes.len() > MAX_BYTES {
            return false;
        }
        self.bytes.extend_from_slice(bytes);
        let (section, end) = (self.current, self.bytes.len());
        match self.runs.last_mut() {
            Some(last)
                if last.line == line && last.section == section && last.addr + last.bytes.len() as u64 == addr =>
            {
                last.bytes.end = end;
            }
            _ => self.runs.push(EmittedBytes { section, addr, bytes: start..end, line }),
        }
        if let Some(section) = self.sections.get_mut(self.current) {
            section.pos += bytes.len() as i64;
        }
        true
    }
}

/// A byte of a memory, and the line that emitted it.
#[derive(Clone, Copy, Default)]
struct PlacedByte {
    byte: u8,
    /// Line by its number in the listing, plus 1; 0 for none.
    listed_line: u32,
}

impl Assembler<'_> {
    /// Emits bytes at the next address.
    pub fn emit(&mut self, bytes: &[u8], at: Range<usize>) {
        if bytes.is_empty() {
            return;
        }
        if self.out.holds() == SectionContent::Addresses {
            let here = self.out.next_address();
            self.out.set_address(here + bytes.len() as i64);
            if bytes.iter().all(|&byte| byte == 0) {
                return;
            }
            let why = (self.dialect.hooks.no_bytes)(self).unwrap_or_else(|| {
                let cause = "there is no memory here that a program can fill";
                CauseAndHint::new(cause, "reserve room with ds, and let the program write it")
            });
            return self.report(LineFault::new("ASM020", at, why.cause, why.hint));
        }
        let line = (self.out.list.len() as u32).saturating_sub(1);
        if bytes.len() as u64 > MAX_BYTES as u64 || !self.out.add(bytes, line) {
            let cause = format!("the program gives more than {MAX_BYTES} bytes");
            self.report(LineFault::new("ASM017", at, cause, "look for a repetition or a gap that has grown too large"));
            self.ended = true;
        }
    }

    /// Emits program words at the next address, low byte first if they have two bytes.
    pub fn emit_words(&mut self, words: &[u16], at: Range<usize>) {
        let mut bytes = [0u8; 8];
        let size = if self.chip.word_bytes == 1 { 1 } else { 2 };
        let mut len = 0;
        for (to, word) in bytes.chunks_mut(size).zip(words) {
            to.iter_mut().zip(word.to_le_bytes()).for_each(|(to, from)| *to = from);
            len += size;
        }
        self.emit(bytes.get(..len).unwrap_or_default(), at);
    }

    /// Places all bytes and reports those that do not fit.
    pub fn place(&mut self) {
        self.fill_gaps();
        let spaces = std::mem::take(&mut self.out.spaces);
        let runs = std::mem::take(&mut self.out.runs);
        let mut memories: Vec<Vec<PlacedByte>> = spaces.iter().map(|_| Vec::new()).collect();
        let end = |name: &str| {
            let in_code = runs
                .iter()
                .filter(|run| self.out.sections.get(run.section).is_some_and(|s| s.holds != SectionContent::Copied));
            let within = spaces.iter().find(|space| space.name == name).map_or(0..0, image_window);
            in_code
                .map(|run| run.addr + run.bytes.len() as u64)
                .filter(|end| *end > within.start && *end <= within.end)
                .max()
        };
        let behind = end(self.out.code).map_or(0, |end| end.next_multiple_of(self.out.copied_align()));
        let mut lines = Vec::new();
        // The current range outside all memories: the line that begins it, and its addresses.
        let mut beyond: Option<(u32, Range<u64>)> = None;
        for run in &runs {
            self.out.list_at_run_address(run);
            let copied =
                self.out.sections.get(run.section).is_some_and(|section| section.holds == SectionContent::Copied);
            let addr = if copied { behind + run.addr } else { run.addr };
            let len = run.bytes.len() as u64;
            let inside = spaces.iter().position(|space| {
                let window = image_window(space);
                window.start <= addr && addr + len <= window.end
            });
            let Some(index) = inside else {
                match &mut beyond {
                    Some((_, known)) if known.end == addr => known.end += len,
                    _ => {
                        let within = spaces.iter().map(image_window).find(|window| window.contains(&addr));
                        let from = within.map_or(addr, |window| window.end);
                        let next = Some((run.line, from..addr + len));
                        self.report_outside(std::mem::replace(&mut beyond, next), &spaces);
                    }
                }
                continue;
            };
            self.report_outside(beyond.take(), &spaces);
            let (Some(space), Some(memory)) = (spaces.get(index), memories.get_mut(index)) else { continue };
            let start = (addr - u64::from(space.start)) as usize;
            if memory.len() < start + len as usize {
                memory.resize(start + len as usize, PlacedByte::default());
            }
            let bytes = self.out.bytes.get(run.bytes.clone()).unwrap_or_default();
            let mut taken = 0;
            for (cell, byte) in memory.iter_mut().skip(start).zip(bytes) {
                if cell.listed_line != 0 && taken == 0 {
                    taken = cell.listed_line;
                }
                *cell = PlacedByte { byte: *byte, listed_line: run.line + 1 };
            }
            if taken != 0 {
                self.report_overlap(run.line, taken - 1, space, start);
            }
            if space.name == self.out.code {
                lines.push((start as u32, run.line, len as u32));
            }
        }
        self.report_outside(beyond, &spaces);
        for (space, memory) in spaces.iter().zip(&mut memories) {
            self.check_words(space, memory);
            self.out.segments.extend(memory_segments(space, memory));
        }
        self.out.lines = lines.into_iter().filter_map(|(addr, line, len)| self.line_at(addr, line, len)).collect();
        self.out.spaces = spaces;
        self.line = None;
    }

    fn line_at(&self, addr: u32, line: u32, len: u32) -> Option<SourceLine> {
        let listed = self.out.list.get(line as usize)?;
        let file = self.texts.name(listed.line.file).into();
        Some(SourceLine { addr, kind: SourceKind::Asm, file, line: listed.line.number, len })
    }

    /// Reports a fault at the line with this number in the listing.
    fn report_at_line(&mut self, line: u32, code: &'static str, cause: String, hint: &str) {
        self.line = self.out.list.get(line as usize).map(|listed| listed.line.clone());
        let text = self.line.as_ref().map_or("", |line| &line.text);
        let whole = crate::lines::trim(text, 0..crate::statement::code_end(self.dialect, text));
        self.report(LineFault::new(code, whole, cause, hint));
    }

    /// Reports a range that is in no memory.
    fn report_outside(&mut self, beyond: Option<(u32, Range<u64>)>, spaces: &[ImageSpace]) {
        let Some((line, at)) = beyond else { return };
        let unit = u64::from(self.chip.bytes_per_address(self.chip.code_space));
        let list: Vec<String> = spaces
            .iter()
            .filter(|space| space.len > 0)
            .map(|space| {
                let window = image_window(space);
                format!("{} 0x{:04X} to 0x{:04X}", space.name, window.start / unit, window.end / unit - 1)
            })
            .collect();
        let (first, last) = (at.start / unit, (at.end.max(at.start + 1) - 1) / unit);
        let cause = format!("there is no memory at 0x{first:04X} to 0x{last:04X} of the {}", self.chip.name);
        self.report_at_line(line, "ASM020", cause, &format!("its memories: {}", list.join(", ")));
    }

    fn report_overlap(&mut self, line: u32, with: u32, space: &ImageSpace, addr: usize) {
        let other = self.out.list.get(with as usize);
        let place = other.map_or(String::new(), |o| format!("{}:{}", self.texts.name(o.line.file), o.line.number));
        let unit =
            if space.name == self.out.code { self.chip.bytes_per_address(self.chip.code_space) as usize } else { 1 };
        let cause = format!("an item of {place} is already in {} from 0x{:04X} on", space.name, addr / unit.max(1));
        self.report_at_line(line, "ASM019", cause, "move one of them with org");
    }

    /// Reports words with more bits than the memory has; pads half words with an erased byte.
    fn check_words(&mut self, space: &ImageSpace, memory: &mut Vec<PlacedByte>) {
        if space.word != 2 {
            return;
        }
        if memory.len() % 2 == 1 {
            memory.push(PlacedByte::default());
        }
        let mut wide = Vec::new();
        for word in memory.chunks_exact_mut(2) {
            let [low, high] = word else { continue };
            let from = low.listed_line.max(high.listed_line);
            if from != 0 {
                for cell in [&mut *low, &mut *high].into_iter().filter(|cell| cell.listed_line == 0) {
                    *cell = PlacedByte { byte: 0xFF, listed_line: from };
                }
            }
            let value = u16::from_le_bytes([low.byte, high.byte]);
            if let WordBits::Only(bits) | WordBits::Low(bits) = space.word_bits
                && from != 0
                && u32::from(value) >> bits != 0
            {
                wide.push((from - 1, value, bits));
            }
        }
        for (line, value, bits) in wide {
            let cause = format!("0x{value:04X} has more than the {bits} bits of a word of {}", space.name);
            self.report_at_line(line, "ASM021", cause, "give a smaller value");
        }
    }
}

/// Returns the range of a memory in the image file.
fn image_window(space: &ImageSpace) -> Range<u64> {
    space.start.into()..u64::from(space.start) + u64::from(space.len)
}

/// Returns the bytes of a memory that were emitted.
fn memory_segments(space: &ImageSpace, memory: &[PlacedByte]) -> Vec<Segment> {
    let mut list: Vec<Segment> = Vec::new();
    let mut last = None;
    for (addr, cell) in memory.iter().enumerate().filter(|(_, cell)| cell.listed_line != 0) {
        match list.last_mut() {
            Some(segment) if last == Some(addr.wrapping_sub(1)) => segment.bytes.push(cell.byte),
            _ => list.push(Segment { space: space.name, addr: addr as u32, bytes: vec![cell.byte] }),
        }
        last = Some(addr);
    }
    list
}
