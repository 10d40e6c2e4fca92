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
    /// Data address.
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
    start: u16,
    unwritten: Vec<bool>,
}

impl Close {
    /// Waits for `watches`; with `filled` also for the first read of a byte of `chip`'s RAM that neither the program has
    /// written nor lies in these stretches of data memory.
    #[must_use]
    pub fn new(chip: &Chip, watches: Vec<Watch>, filled: Option<&[Range]>) -> Close {
        let fresh = filled.map(|filled| {
            let ram = u32::from(chip.ram_start)..u32::from(chip.ram_start) + u32::from(chip.ram_len);
            let unwritten = ram.map(|addr| !filled.iter().any(|r| (r.start..r.end).contains(&addr))).collect();
            Fresh { start: chip.ram_start, unwritten }
        });
        Close { watches, fresh, ..Close::default() }
    }
}

impl Probe for Close {
    const INSN: bool = true;
    const DATA: bool = true;

    fn insn(&mut self, _at: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn data(&mut self, _at: u64, addr: u16, value: u8, write: bool) -> bool {
        if let Some(fresh) = &mut self.fresh
            && let Some(unwritten) = fresh.unwritten.get_mut(usize::from(addr.wrapping_sub(fresh.start)))
        {
            if write {
                *unwritten = false;
            } else if *unwritten && self.fault.is_none() {
                self.fault = Some((self.pc, Fault::UninitialisedRead { addr }));
            }
        }
        let hit = |w: &Watch| w.write == write && (w.range.start..w.range.end).contains(&u32::from(addr));
        if self.seen.is_none()
            && let Some(watch) = self.watches.iter().position(hit)
        {
            self.seen = Some(Access { watch, pc: self.pc, addr, value });
        }
        self.seen.is_some() || self.fault.is_some()
    }
}
