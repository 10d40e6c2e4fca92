//! What looks at every instruction and every access: costs time, so it is a type parameter of the tools.

use emu_core::chip::Chip;
use emu_core::cpu::{Probe, ProgramFault, Subcycle};
use emu_core::pins::CycleTime;

use crate::address_names::AddressRange;
use crate::bit_space::{self, BIT_SPACE};

/// An access that was waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchedAccess {
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
pub struct AccessMonitor {
    /// The first access that a watch saw.
    pub first_access: Option<WatchedAccess>,
    /// The first byte of RAM that was read before it was written: program word and fault.
    pub unwritten_read: Option<(u32, ProgramFault)>,
    chip: &'static Chip,
    watches: Vec<AccessWatch>,
    /// Program words whose fetch is waited for.
    awaited_fetches: Vec<u32>,
    /// Position of the one that was fetched.
    pub seen_fetch: Option<usize>,
    unwritten_ram: Option<UnwrittenRam>,
    pc: u32,
}

/// Accesses to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AccessWatch {
    /// Bytes of data memory, or bits.
    pub range: AddressRange,
    /// Writes; otherwise reads.
    pub write: bool,
}

/// RAM not written so far.
#[derive(Debug, Clone)]
pub(crate) struct UnwrittenRam {
    space: &'static str,
    /// For each address the one under which its byte is kept, where it is RAM.
    canonical: Vec<Option<u32>>,
    /// For each address under which a byte is kept the bits that were not written.
    unwritten: Vec<u8>,
}

/// What of a chip's RAM is looked at.
pub struct RamCheck<'a> {
    /// Where bytes of RAM are kept: [`Cpu::canonical_ram_address`](emu_core::Cpu::canonical_ram_address).
    pub canonical_address: &'a dyn Fn(u32) -> Option<u32>,
    /// Stretches of data memory that count as written.
    pub initialized: &'a [AddressRange],
}

impl AccessMonitor {
    /// Waits for `watches`; with `trap` also for the first read of a byte of `chip`'s RAM that neither the program has written
    /// nor counts as written.
    #[must_use]
    pub fn new(chip: &'static Chip, watches: Vec<AccessWatch>, trap: Option<&RamCheck<'_>>) -> AccessMonitor {
        let fresh = trap.map(|trap| UnwrittenRam::new(chip, trap));
        AccessMonitor {
            first_access: None,
            unwritten_read: None,
            chip,
            watches,
            awaited_fetches: Vec::new(),
            seen_fetch: None,
            unwritten_ram: fresh,
            pc: 0,
        }
    }

    /// Waits also for the fetch of one of these program words, on machines that have subcycles.
    #[must_use]
    pub fn with_fetches(self, fetches: Vec<u32>) -> AccessMonitor {
        AccessMonitor { awaited_fetches: fetches, ..self }
    }

    /// The access as it is told, if a watch waits for it.
    fn find_watched_access(&self, space: &'static str, addr: u16, value: u8, write: bool) -> Option<WatchedAccess> {
        self.watches.iter().enumerate().filter(|(_, w)| w.write == write).find_map(|(watch, w)| {
            let (space, addr, value) = w.matching_access(self.chip, space, addr, value)?;
            Some(WatchedAccess { watch, pc: self.pc, space, addr, value })
        })
    }
}

impl AccessWatch {
    /// Memory, address and value of an access as they are told, if it touches the range.
    pub(crate) fn matching_access(
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
        if space == BIT_SPACE {
            let (byte_space, byte, _) = bit_space::byte_of_bit(chip, at)?;
            return within(byte_space, byte).then_some((space, addr, value));
        }
        // A byte, where bits are waited for: the first of them that it has.
        let eight = (self.range.space == BIT_SPACE).then(|| bit_space::bits_of_byte(chip, space, at)).flatten()?;
        let first = eight.start.max(self.range.start);
        (first < eight.end.min(self.range.end)).then(|| (BIT_SPACE, first as u16, value >> (first - eight.start) & 1))
    }
}

impl UnwrittenRam {
    /// All RAM of `chip` but what counts as written.
    pub(crate) fn new(chip: &'static Chip, ram: &RamCheck<'_>) -> UnwrittenRam {
        let size = chip.spaces.iter().find(|(name, ..)| *name == chip.ram_space).map_or(0, |space| space.1);
        let filled =
            |addr| ram.initialized.iter().any(|r| r.space == chip.ram_space && (r.start..r.end).contains(&addr));
        UnwrittenRam {
            space: chip.ram_space,
            canonical: (0..size).map(ram.canonical_address).collect(),
            unwritten: (0..size).map(|addr| if filled(addr) { 0 } else { 0xFF }).collect(),
        }
    }

    /// Notes an access as [`Probe::on_data_access`] tells of it; the byte of RAM that it reads without that having been written: the
    /// address under which it is kept.
    pub(crate) fn note_access(&mut self, chip: &Chip, space: u8, addr: u16, write: bool) -> Option<u32> {
        let (space, addr) = (chip.spaces.get(usize::from(space))?.0, u32::from(addr));
        let bit = if space == BIT_SPACE { bit_space::byte_of_bit(chip, addr) } else { None };
        let (space, addr, mask) = bit.map_or((space, addr, 0xFF), |(space, byte, bit)| (space, byte, 1 << bit));
        let kept = self.canonical.get(addr as usize).copied().flatten().filter(|_| space == self.space)?;
        let unwritten = self.unwritten.get_mut(kept as usize)?;
        if write {
            *unwritten &= !mask;
        }
        (!write && *unwritten & mask != 0).then_some(kept)
    }

    /// The byte kept at an address counts as written from now on.
    pub(crate) fn mark_written(&mut self, kept: u32) {
        if let Some(unwritten) = self.unwritten.get_mut(kept as usize) {
            *unwritten = 0;
        }
    }
}

impl Probe for AccessMonitor {
    const INSN: bool = true;
    const DATA: bool = true;
    const SUBCYCLE: bool = true;

    fn on_instruction(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn on_subcycle(&mut self, _at: CycleTime, phase: Subcycle, pc: u32, _word: u16) -> bool {
        if phase == Subcycle::Fetch && self.seen_fetch.is_none() {
            self.seen_fetch = self.awaited_fetches.iter().position(|&fetch| fetch == pc);
        }
        self.seen_fetch.is_some()
    }

    fn on_data_access(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let unknown = self.unwritten_ram.as_mut().and_then(|fresh| fresh.note_access(self.chip, space, addr, write));
        let space = self.chip.spaces.get(usize::from(space)).map_or("", |(name, ..)| name);
        if unknown.is_some() && self.unwritten_read.is_none() {
            self.unwritten_read = Some((self.pc, ProgramFault::UninitialisedRead { space, addr }));
        }
        if self.first_access.is_none() {
            self.first_access = self.find_watched_access(space, addr, value, write);
        }
        self.first_access.is_some() || self.unwritten_read.is_some()
    }
}
