//! A probe of every instruction and access, for conditions on memory and for reads of RAM before it is
//! written. It makes a run slower, so only runs that need it have it.

use emu_core::chip::Chip;
use emu_core::cpu::{Probe, ProgramFault, Subcycle};
use emu_core::pins::CycleTime;

use crate::names::address_names::AddressRange;
use crate::names::bit_space::{self, BIT_SPACE};

/// An access that matches a watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WatchedAccess {
    /// Index of the watch in the list that [`AccessMonitor::new`] got.
    pub watch: usize,
    /// Program word of the instruction.
    pub pc: u32,
    /// The memory, as [`Chip::spaces`] names it.
    pub space: &'static str,
    /// Address in the memory.
    pub addr: u16,
    /// The byte read or written; 0 or 1 in the memory `bit`.
    pub value: u8,
}

/// Observes every access: for watches, and for reads of RAM that was never written.
///
/// Where single bits have addresses of their own, an access to a bit also counts as one to its byte, and an
/// access to a byte as one to each of its bits.
#[derive(Debug, Clone)]
pub struct AccessMonitor {
    /// The first access that matches a watch.
    pub first_access: Option<WatchedAccess>,
    /// The first read of an unwritten byte of RAM: program word and fault.
    pub unwritten_read: Option<(u32, ProgramFault)>,
    chip: &'static Chip,
    watches: Vec<AccessWatch>,
    /// Program words whose fetch is watched.
    awaited_fetches: Vec<u32>,
    /// Index in `awaited_fetches` of the word that was fetched.
    pub seen_fetch: Option<usize>,
    unwritten_ram: Option<UnwrittenRam>,
    /// Program word of the current instruction.
    pc: u32,
}

/// A range of accesses to watch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AccessWatch {
    /// Bytes of data memory, or bits.
    pub range: AddressRange,
    /// Watches writes; otherwise reads.
    pub write: bool,
}

/// The RAM that has not been written so far.
#[derive(Debug, Clone)]
pub(crate) struct UnwrittenRam {
    space: &'static str,
    /// Per address: the canonical address of its byte, if it is RAM.
    canonical: Vec<Option<u32>>,
    /// Per canonical address: the bits that have not been written.
    unwritten: Vec<u8>,
}

/// Which RAM of a chip is checked for reads before writes.
pub struct RamCheck<'a> {
    /// Returns the canonical address of a byte of RAM:
    /// [`Cpu::canonical_ram_address`](emu_core::Cpu::canonical_ram_address).
    pub canonical_address: &'a dyn Fn(u32) -> Option<u32>,
    /// Ranges of data memory that count as written.
    pub initialized: &'a [AddressRange],
}

impl AccessMonitor {
    /// Returns a monitor for `watches`; with `ram_check` also for the first read of a byte of RAM that the
    /// program has not written and that `ram_check` does not list as initialized.
    #[must_use]
    pub fn new(chip: &'static Chip, watches: Vec<AccessWatch>, ram_check: Option<&RamCheck<'_>>) -> AccessMonitor {
        let unwritten_ram = ram_check.map(|ram_check| UnwrittenRam::new(chip, ram_check));
        AccessMonitor {
            first_access: None,
            unwritten_read: None,
            chip,
            watches,
            awaited_fetches: Vec::new(),
            seen_fetch: None,
            unwritten_ram,
            pc: 0,
        }
    }

    /// Also watches the fetch of these program words, on machines with subcycles.
    #[must_use]
    pub fn with_fetches(self, fetches: Vec<u32>) -> AccessMonitor {
        AccessMonitor { awaited_fetches: fetches, ..self }
    }

    /// Returns the access if a watch matches it.
    fn find_watched_access(&self, space: &'static str, addr: u16, value: u8, write: bool) -> Option<WatchedAccess> {
        self.watches.iter().enumerate().filter(|(_, w)| w.write == write).find_map(|(watch, w)| {
            let MatchedAccess { space, addr, value } = w.matching_access(self.chip, space, addr, value)?;
            Some(WatchedAccess { watch, pc: self.pc, space, addr, value })
        })
    }
}

/// An access to a watched range: to a byte, or to a bit if bits are watched.
pub(crate) struct MatchedAccess {
    /// The memory.
    pub space: &'static str,
    /// Address in it.
    pub addr: u16,
    /// The value of the byte or bit.
    pub value: u8,
}

impl AccessWatch {
    /// Returns the access if it touches the range.
    pub(crate) fn matching_access(
        &self,
        chip: &Chip,
        space: &'static str,
        addr: u16,
        value: u8,
    ) -> Option<MatchedAccess> {
        let addr32 = u32::from(addr);
        let within =
            |space: &str, addr: u32| self.range.space == space && (self.range.start..self.range.end).contains(&addr);
        if within(space, addr32) {
            return Some(MatchedAccess { space, addr, value });
        }
        if space == BIT_SPACE {
            let at = bit_space::byte_of_bit(chip, addr32)?;
            return within(at.space, at.byte).then_some(MatchedAccess { space, addr, value });
        }
        // An access to a byte when bits are watched: the first watched bit of that byte.
        let bits = (self.range.space == BIT_SPACE).then(|| bit_space::bits_of_byte(chip, space, addr32)).flatten()?;
        let first = bits.start.max(self.range.start);
        (first < bits.end.min(self.range.end)).then(|| MatchedAccess {
            space: BIT_SPACE,
            addr: first as u16,
            value: value >> (first - bits.start) & 1,
        })
    }
}

impl UnwrittenRam {
    /// Returns all RAM of `chip` that does not count as written.
    pub(crate) fn new(chip: &'static Chip, ram: &RamCheck<'_>) -> UnwrittenRam {
        let size = chip.space(chip.ram_space).map_or(0, |space| space.size);
        let filled =
            |addr| ram.initialized.iter().any(|r| r.space == chip.ram_space && (r.start..r.end).contains(&addr));
        UnwrittenRam {
            space: chip.ram_space,
            canonical: (0..size).map(ram.canonical_address).collect(),
            unwritten: (0..size).map(|addr| if filled(addr) { 0 } else { 0xFF }).collect(),
        }
    }

    /// Records an access that [`Probe::on_data_access`] reports. If it reads an unwritten byte of RAM,
    /// returns the canonical address of the byte.
    pub(crate) fn note_access(&mut self, chip: &Chip, space: u8, addr: u16, write: bool) -> Option<u32> {
        let (space, addr) = (chip.spaces.get(usize::from(space))?.name, u32::from(addr));
        let bit = if space == BIT_SPACE { bit_space::byte_of_bit(chip, addr) } else { None };
        let (space, addr, mask) = bit.map_or((space, addr, 0xFF), |at| (at.space, at.byte, 1 << at.bit));
        let canonical = self.canonical.get(addr as usize).copied().flatten().filter(|_| space == self.space)?;
        let unwritten = self.unwritten.get_mut(canonical as usize)?;
        if write {
            *unwritten &= !mask;
        }
        (!write && *unwritten & mask != 0).then_some(canonical)
    }

    /// Marks the byte at a canonical address as written.
    pub(crate) fn mark_written(&mut self, canonical: u32) {
        if let Some(unwritten) = self.unwritten.get_mut(canonical as usize) {
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
        let unwritten_read = self
            .unwritten_ram
            .as_mut()
            .and_then(|unwritten_ram| unwritten_ram.note_access(self.chip, space, addr, write));
        let space = self.chip.spaces.get(usize::from(space)).map_or("", |space| space.name);
        if unwritten_read.is_some() && self.unwritten_read.is_none() {
            self.unwritten_read = Some((self.pc, ProgramFault::UnwrittenRead { space, addr }));
        }
        if self.first_access.is_none() {
            self.first_access = self.find_watched_access(space, addr, value, write);
        }
        self.first_access.is_some() || self.unwritten_read.is_some()
    }
}
