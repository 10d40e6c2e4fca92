//! What looks at every instruction and every access: costs time, so it is a type parameter of the tools.

use emu_core::chip::Chip;
use emu_core::cpu::{Fault, Probe};

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
    /// The byte read or written.
    pub value: u8,
}

/// Looks at every access: watches, and RAM that is read before it was written.
#[derive(Debug, Clone, Default)]
pub struct Close {
    /// The first access that a watch saw.
    pub seen: Option<Access>,
    /// The first byte of RAM that was read before it was written: program word and fault.
    pub fault: Option<(u32, Fault)>,
    spaces: &'static [(&'static str, u32)],
    watches: Vec<Watch>,
    fresh: Option<Fresh>,
    pc: u32,
}

/// Accesses to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Watch {
    /// Bytes of data memory.
    pub range: Range,
    /// Writes; otherwise reads.
    pub write: bool,
}

/// Bytes of RAM not written so far.
#[derive(Debug, Clone)]
struct Fresh {
    space: &'static str,
    start: u16,
    unwritten: Vec<bool>,
}

impl Close {
    /// Waits for `watches`; with `filled` also for the first read of a byte of `chip`'s RAM that neither the program has
    /// written nor lies in these stretches of data memory.
    #[must_use]
    pub fn new(chip: &'static Chip, watches: Vec<Watch>, filled: Option<&[Range]>) -> Close {
        let fresh = filled.map(|filled| {
            let ram = u32::from(chip.ram_start)..u32::from(chip.ram_start) + u32::from(chip.ram_len);
            let unwritten =
                ram.map(|addr| !filled.iter().any(|r| r.space == chip.ram && (r.start..r.end).contains(&addr)));
            Fresh { space: chip.ram, start: chip.ram_start, unwritten: unwritten.collect() }
        });
        Close { spaces: chip.spaces, watches, fresh, ..Close::default() }
    }
}

impl Probe for Close {
    const INSN: bool = true;
    const DATA: bool = true;

    fn insn(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn data(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let space = self.spaces.get(usize::from(space)).map_or("", |(name, _)| name);
        if let Some(fresh) = self.fresh.as_mut().filter(|fresh| fresh.space == space)
            && let Some(unwritten) = fresh.unwritten.get_mut(usize::from(addr.wrapping_sub(fresh.start)))
        {
            if write {
                *unwritten = false;
            } else if *unwritten && self.fault.is_none() {
                self.fault = Some((self.pc, Fault::UninitialisedRead { space, addr }));
            }
        }
        let hit = |w: &Watch| {
            w.write == write && w.range.space == space && (w.range.start..w.range.end).contains(&u32::from(addr))
        };
        if self.seen.is_none()
            && let Some(watch) = self.watches.iter().position(hit)
        {
            self.seen = Some(Access { watch, pc: self.pc, space, addr, value });
        }
        self.seen.is_some() || self.fault.is_some()
    }
}
