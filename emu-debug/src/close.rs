//! What looks at every instruction and every access: costs time, so it is a type parameter of the tools.

use emu_core::chip::Chip;
use emu_core::cpu::{Fault, Probe, Subcycle};
use emu_core::pins::Time;

use crate::bits::{self, BIT};
use crate::place::Range;

/// An access that was waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Access {
    /// Position of the watch that saw it.
    pub watch: usize,
    /// Program word of the instruction.
    pub pc: u32,
    /// The memory, as [`Chip::spaces`] names it.
    pub space: &'static str,
    /// Address in it.
    pub addr: u16,
    /// The byte read or written; in the memory `bit` 0 or 1.
    pub value: u8,
}

/// Looks at every access: watches, and RAM that is read before it was written.
///
/// Where single bits have addresses of their own, an access to a bit is one to its byte too, and an access to a byte is one
/// to each of its bits.
#[derive(Debug, Clone)]
pub struct Close {
    /// The first access that a watch saw.
    pub seen: Option<Access>,
    /// The first byte of RAM that was read before it was written: program word and fault.
    pub fault: Option<(u32, Fault)>,
    chip: &'static Chip,
    watches: Vec<Watch>,
    /// Program words whose fetch is waited for.
    fetches: Vec<u32>,
    /// Position of the one that was fetched.
    pub fetched: Option<usize>,
    fresh: Option<Fresh>,
    pc: u32,
}

/// Accesses to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watch {
    /// Bytes of data memory, or bits.
    pub range: Range,
    /// Writes; otherwise reads.
    pub write: bool,
}

/// RAM not written so far.
#[derive(Debug, Clone)]
pub(crate) struct Fresh {
    space: &'static str,
    /// For each address the one under which its byte is kept, where it is RAM.
    kept: Vec<Option<u32>>,
    /// For each address under which a byte is kept the bits that were not written.
    unwritten: Vec<u8>,
}

/// What of a chip's RAM is looked at.
pub struct RamTrap<'a> {
    /// Where bytes of RAM are kept: [`Cpu::ram_at`](emu_core::Cpu::ram_at).
    pub at: &'a dyn Fn(u32) -> Option<u32>,
    /// Stretches of data memory that count as written.
    pub filled: &'a [Range],
}

impl Close {
    /// Waits for `watches`; with `trap` also for the first read of a byte of `chip`'s RAM that neither the program has written
    /// nor counts as written.
    #[must_use]
    pub fn new(chip: &'static Chip, watches: Vec<Watch>, trap: Option<&RamTrap<'_>>) -> Close {
        let fresh = trap.map(|trap| Fresh::new(chip, trap));
        Close { seen: None, fault: None, chip, watches, fetches: Vec::new(), fetched: None, fresh, pc: 0 }
    }

    /// Waits also for the fetch of one of these program words, on machines that have subcycles.
    #[must_use]
    pub fn with_fetches(self, fetches: Vec<u32>) -> Close {
        Close { fetches, ..self }
    }

    /// The access as it is told, if a watch waits for it.
    fn watched(&self, space: &'static str, addr: u16, value: u8, write: bool) -> Option<Access> {
        self.watches.iter().enumerate().filter(|(_, w)| w.write == write).find_map(|(watch, w)| {
            let (space, addr, value) = w.hit(self.chip, space, addr, value)?;
            Some(Access { watch, pc: self.pc, space, addr, value })
        })
    }
}

impl Watch {
    /// Memory, address and value of an access as they are told, if it touches the range.
    pub(crate) fn hit(
        &self,
        chip: &Chip,
        space: &'static str,
        addr: u16,
        value: u8,
    ) -> Option<(&'static str, u16, u8)> {
        let at = u32::from(addr);
        let within =
            |space: &str, at: u32| self.range.space == space && (self.range.start..self.range.end).contains(&at);
        if within(space, at) {
            return Some((space, addr, value));
        }
        if space == BIT {
            let (byte_space, byte, _) = bits::byte_of(chip, at)?;
            return within(byte_space, byte).then_some((space, addr, value));
        }
        // A byte, where bits are waited for: the first of them that it has.
        let eight = (self.range.space == BIT).then(|| bits::of_byte(chip, space, at)).flatten()?;
        let first = eight.start.max(self.range.start);
        (first < eight.end.min(self.range.end)).then(|| (BIT, first as u16, value >> (first - eight.start) & 1))
    }
}

impl Fresh {
    /// All RAM of `chip` but what counts as written.
    pub(crate) fn new(chip: &'static Chip, ram: &RamTrap<'_>) -> Fresh {
        let size = chip.spaces.iter().find(|(name, ..)| *name == chip.ram).map_or(0, |space| space.1);
        let filled = |addr| ram.filled.iter().any(|r| r.space == chip.ram && (r.start..r.end).contains(&addr));
        Fresh {
            space: chip.ram,
            kept: (0..size).map(ram.at).collect(),
            unwritten: (0..size).map(|addr| if filled(addr) { 0 } else { 0xFF }).collect(),
        }
    }

    /// Notes an access as [`Probe::data`] tells of it; the byte of RAM that it reads without that having been written: the
    /// address under which it is kept.
    pub(crate) fn reads_unwritten(&mut self, chip: &Chip, space: u8, addr: u16, write: bool) -> Option<u32> {
        let (space, addr) = (chip.spaces.get(usize::from(space))?.0, u32::from(addr));
        let bit = if space == BIT { bits::byte_of(chip, addr) } else { None };
        let (space, addr, mask) = bit.map_or((space, addr, 0xFF), |(space, byte, bit)| (space, byte, 1 << bit));
        let kept = self.kept.get(addr as usize).copied().flatten().filter(|_| space == self.space)?;
        let unwritten = self.unwritten.get_mut(kept as usize)?;
        if write {
            *unwritten &= !mask;
        }
        (!write && *unwritten & mask != 0).then_some(kept)
    }

    /// The byte kept at an address counts as written from now on.
    pub(crate) fn fill(&mut self, kept: u32) {
        if let Some(unwritten) = self.unwritten.get_mut(kept as usize) {
            *unwritten = 0;
        }
    }
}

impl Probe for Close {
    const INSN: bool = true;
    const DATA: bool = true;
    const SUBCYCLE: bool = true;

    fn insn(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn subcycle(&mut self, _at: Time, phase: Subcycle, pc: u32, _word: u16) -> bool {
        if phase == Subcycle::Fetch && self.fetched.is_none() {
            self.fetched = self.fetches.iter().position(|&fetch| fetch == pc);
        }
        self.fetched.is_some()
    }

    fn data(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let unknown = self.fresh.as_mut().and_then(|fresh| fresh.reads_unwritten(self.chip, space, addr, write));
        let space = self.chip.spaces.get(usize::from(space)).map_or("", |(name, ..)| name);
        if unknown.is_some() && self.fault.is_none() {
            self.fault = Some((self.pc, Fault::UninitialisedRead { space, addr }));
        }
        if self.seen.is_none() {
            self.seen = self.watched(space, addr, value, write);
        }
        self.seen.is_some() || self.fault.is_some()
    }
}
