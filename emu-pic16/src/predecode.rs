//! Program memory as predecoded ops, four bytes each. Each bank has its own ops, because the bank determines
//! the resolved address of an operand.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::{InstructionMark, LoopPlan};
use emu_core::state::MemoryChanges;
use emu_core::table::{InstructionLocation, PredecodedOp};

use crate::executor::{DATA_ADDRESSES, OPS};
use crate::isa::{Pic16Op, Pic16OpKind, Pic16Row, SHAPES, SPAN, find_row};
use crate::operands::{B, F, FileAddress};
use crate::periph::map::Sfr;
use crate::recorder::record_instruction;

/// Longest loop that is analyzed: words between its first instruction and its GOTO.
const MAX_LOOP_WORDS: u32 = 16;

/// Program memory as words and as predecoded ops. It repeats after its end (DS33023, section 6.2).
#[derive(Debug, Clone)]
pub(crate) struct CodeMemory {
    /// Words of 14 bits; erased words are 3FFFh.
    pub words: Box<[u16; SPAN]>,
    /// One op per bank and word, with breakpoints. `ops[0]` marks only jumps to themselves as
    /// [`Pic16OpKind::PollingLoop`], because programs end that way; `ops[1]` marks all polling loops. In
    /// both, a test and the GOTO after it are one op.
    pub ops: [Box<[Pic16Op; OPS]>; 2],
    /// The ops without marks, breakpoints and joined ops.
    pub ops_unmarked: Box<[Pic16Op; OPS]>,
    /// Resolved file address of every address of data memory.
    pub file_addresses: Box<[FileAddress; DATA_ADDRESSES]>,
    /// Lowest address of the byte at each address.
    pub lowest_addresses: Box<[u16; DATA_ADDRESSES]>,
    /// The polling loops, by bank and address of the GOTO that closes each.
    loops: BTreeMap<u32, LoopPlan>,
    breakpoints: BTreeSet<u32>,
    size: u32,
    /// Differences from the words at creation.
    pub changes: MemoryChanges<u16>,
}

impl CodeMemory {
    /// Creates program memory of `size` words (a power of two, at most [`SPAN`]) with `image` from address 0
    /// on; the rest is erased.
    pub(crate) fn new(image: &[u16], size: u32, file_addresses: Box<[FileAddress; DATA_ADDRESSES]>) -> CodeMemory {
        let size = size.clamp(1, SPAN as u32);
        let mut words = Box::new([0x3FFF; SPAN]);
        for (at, word) in words.iter_mut().enumerate() {
            *word = image.get(at % size as usize).map_or(0x3FFF, |word| word & 0x3FFF);
        }
        let mut lowest_addresses = Box::new([0; DATA_ADDRESSES]);
        for (addr, low) in lowest_addresses.iter_mut().enumerate() {
            let same = |other: &usize| {
                file_addresses[addr] != FileAddress::NONE && file_addresses[*other] == file_addresses[addr]
            };
            *low = (0..addr).find(same).unwrap_or(addr) as u16;
        }
        let erased = decode(0x3FFF, 0, &file_addresses);
        // Past the end of memory, the slow path wraps to the start.
        let mut past_end = Box::new([PredecodedOp { kind: Pic16OpKind::PollingLoop, ..erased }; OPS]);
        for bank in past_end.chunks_exact_mut(OPS / 4) {
            bank[..SPAN].fill(erased);
        }
        let erased_ops = || past_end.clone();
        let (ops, ops_unmarked) = ([erased_ops(), erased_ops()], erased_ops());
        let (loops, breakpoints, changes) = (BTreeMap::new(), BTreeSet::new(), MemoryChanges::NONE);
        let mut code = CodeMemory {
            words,
            ops,
            ops_unmarked,
            file_addresses,
            lowest_addresses,
            loops,
            breakpoints,
            size,
            changes,
        };
        for pc in 0..SPAN as u32 {
            if code.words[pc as usize] != 0x3FFF {
                code.predecode(pc);
            }
        }
        code
    }

    /// Writes a word at all addresses where it appears.
    pub(crate) fn poke(&mut self, addr: u32, word: u16) {
        let at = addr % self.size;
        self.changes.record(at as usize, self.words[at as usize], word & 0x3FFF);
        for first in (0..SPAN as u32).step_by(self.size as usize) {
            self.words[(first + at) as usize] = word & 0x3FFF;
        }
        for first in (0..SPAN as u32).step_by(self.size as usize) {
            // The GOTO that closes a loop around the word can be several words ahead.
            for pc in first + at..=first + at + MAX_LOOP_WORDS {
                self.predecode(pc % SPAN as u32);
            }
        }
    }

    /// Sets or clears a breakpoint; returns false if nothing changed.
    pub(crate) fn set_breakpoint(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.breakpoints.insert(pc) } else { self.breakpoints.remove(&pc) };
        if changed {
            self.predecode(pc);
        }
        changed
    }

    /// Reports whether there is a breakpoint at `pc`.
    pub(crate) fn has_breakpoint(&self, pc: u32) -> bool {
        self.breakpoints.contains(&pc)
    }

    /// Returns the mark of the instruction at `pc` in the bank whose ops start at `bank`.
    pub(crate) fn instruction_mark(&self, bank: u32, pc: u32) -> InstructionMark {
        match self.ops_unmarked[(bank | pc) as usize % OPS].kind {
            Pic16OpKind::Goto if jumps_to_itself(self.words[pc as usize % SPAN], pc) => InstructionMark::JumpsToItself,
            _ if self.loops.contains_key(&(bank | pc)) => InstructionMark::ClosesLoop,
            _ => InstructionMark::Plain,
        }
    }

    /// Returns the polling loop that the GOTO at `end` closes.
    pub(crate) fn loop_plan(&self, bank: u32, end: u32) -> Option<&LoopPlan> {
        self.loops.get(&(bank | end))
    }

    fn predecode(&mut self, pc: u32) {
        let word = self.words[pc as usize];
        for bank in 0..4 {
            let at = bank << 14 | pc;
            let op = decode(word, bank as u16, &self.file_addresses);
            self.ops_unmarked[at as usize] = op;
            let jumps_to_itself = op.kind == Pic16OpKind::Goto && jumps_to_itself(word, pc);
            let loop_plan = if jumps_to_itself { None } else { self.loop_closed_by(op, bank as u16, pc) };
            let loop_plan = loop_plan.or_else(|| self.countdown_loop(op, bank as u16, pc));
            let kinds = match (self.breakpoints.contains(&pc), jumps_to_itself, &loop_plan) {
                (true, ..) => [Pic16OpKind::Breakpoint; 2],
                (_, true, _) => [Pic16OpKind::PollingLoop; 2],
                (.., Some(_)) => [op.kind, Pic16OpKind::PollingLoop],
                _ => [op.kind; 2],
            };
            for (ops, kind) in self.ops.iter_mut().zip(kinds) {
                ops[at as usize] = PredecodedOp { kind, args: op.args };
                // The slow path wraps from past the end to the start, which may have a breakpoint.
                if let Some(past_end) = ops.get_mut(at as usize + SPAN).filter(|_| pc < 2) {
                    past_end.kind = if kind == Pic16OpKind::Breakpoint {
                        Pic16OpKind::Breakpoint
                    } else {
                        Pic16OpKind::PollingLoop
                    };
                }
                join_ops(ops, at as usize);
                if pc > 0 {
                    join_ops(ops, at as usize - 1);
                }
            }
            match loop_plan {
                Some(plan) => self.loops.insert(at, plan),
                None => self.loops.remove(&at),
            };
        }
    }

    /// Returns the plan of the loop that the GOTO `op` at `end` closes, if an iteration changes only W,
    /// flags, the bank, PCLATH and the watchdog. Then an iteration that leaves the core unchanged repeats,
    /// until a register of the chip that it reads changes. The bank must be the same at head and end.
    fn loop_closed_by(&self, op: Pic16Op, bank: u16, end: u32) -> Option<LoopPlan> {
        let target = Some(op).filter(|op| op.kind == Pic16OpKind::Goto).and_then(|op| record_instruction(op).target)?;
        // Assumes the PCLATH of code that stays in its page; at run time the loop is not skipped if PCLATH
        // differs.
        let head = end & 0x1800 | u32::from(target);
        if head > end || end - head > MAX_LOOP_WORDS {
            return None;
        }
        let (mut registers_read, mut clears_watchdog, mut bank_now, mut skipped) = (Vec::new(), false, bank, false);
        for pc in head..=end {
            let word = self.words[pc as usize];
            let record = record_instruction(decode(word, bank_now, &self.file_addresses));
            match selected_bank(word, bank_now) {
                Some(bank) if !skipped => bank_now = bank,
                None if !record.has_other_effects => {}
                _ => return None,
            }
            skipped = record.skips;
            clears_watchdog |= record.clears_watchdog;
            registers_read.extend(
                record
                    .addresses_read
                    .iter()
                    .filter_map(|file_address| as_chip_register(*file_address))
                    .map(|sfr| sfr as u16),
            );
        }
        (bank_now == bank).then_some(LoopPlan { head, registers_read, clears_watchdog, counter: Vec::new() })
    }

    /// Returns the plan of the loop that the GOTO `op` at `end` closes, if it decrements a byte by DECFSZ and
    /// otherwise only clears the watchdog.
    fn countdown_loop(&self, op: Pic16Op, bank: u16, end: u32) -> Option<LoopPlan> {
        let target = Some(op).filter(|op| op.kind == Pic16OpKind::Goto).and_then(|op| record_instruction(op).target)?;
        let head = end & 0x1800 | u32::from(target);
        if head >= end || end - head > MAX_LOOP_WORDS {
            return None;
        }
        let at = |pc: u32| decode(self.words[pc as usize], bank, &self.file_addresses);
        let only_clears_watchdog =
            (head..end - 1).all(|pc| matches!(at(pc).kind, Pic16OpKind::Nop | Pic16OpKind::Clrwdt));
        let test = at(end - 1);
        let counter = vec![u16::from_le_bytes([test.args[0], test.args[1]])];
        (only_clears_watchdog && test.kind == Pic16OpKind::DecfszFRam).then_some(LoopPlan {
            head,
            registers_read: Vec::new(),
            clears_watchdog: false,
            counter,
        })
    }
}

/// Returns the bank after an instruction that sets or clears a bit of the bank selection or of PCLATH,
/// starting from `bank`; None for other instructions.
fn selected_bank(word: u16, bank: u16) -> Option<u16> {
    let (bit, set) = (word >> 7 & 7, word & 0x0400 != 0);
    let with = |mask: u16| if set { bank | mask } else { bank & !mask };
    match (word & 0x3800, word & 0x7F, bit) {
        (0x1000, 0x03, 5 | 6) => Some(with(1 << (bit - 5))),
        (0x1000, 0x0A, _) => Some(bank),
        _ => None,
    }
}

/// Joins a test and the GOTO after it into one op, if neither has a mark; otherwise separates them.
fn join_ops(ops: &mut [Pic16Op; OPS], at: usize) {
    let before_goto = ops.get(at + 1).is_some_and(|next| next.kind == Pic16OpKind::Goto);
    if let Some(op) = ops.get_mut(at) {
        for (test, joined) in JOINED_OPS {
            if op.kind == test || op.kind == joined {
                op.kind = if before_goto { joined } else { test };
            }
        }
    }
}

/// Tests that can be joined with a GOTO, each with its joined kind.
const JOINED_OPS: [(Pic16OpKind, Pic16OpKind); 6] = [
    (Pic16OpKind::BtfscRam, Pic16OpKind::BtfscGoto),
    (Pic16OpKind::BtfssRam, Pic16OpKind::BtfssGoto),
    (Pic16OpKind::DecfszFRam, Pic16OpKind::DecfszGoto),
    (Pic16OpKind::IncfszFRam, Pic16OpKind::IncfszGoto),
    (Pic16OpKind::Btfsc, Pic16OpKind::BtfscSfrGoto),
    (Pic16OpKind::Btfss, Pic16OpKind::BtfssSfrGoto),
];

/// Returns the register of the chip at a file address; None for RAM and core registers.
fn as_chip_register(file_address: FileAddress) -> Option<Sfr> {
    let sfr = *Sfr::ALL.get(usize::from(file_address.0.checked_sub(FileAddress::sfr(Sfr::INDF).0)?))?;
    (!matches!(sfr, Sfr::INDF | Sfr::PCL | Sfr::STATUS | Sfr::FSR | Sfr::PCLATH)).then_some(sfr)
}

/// Reports whether the GOTO `word` at `pc` jumps to itself, if PCLATH has its page.
fn jumps_to_itself(word: u16, pc: u32) -> bool {
    u32::from(word & 0x7FF) == pc & 0x7FF
}

/// Decodes an instruction for the bank in RP1:RP0, without loop marks and breakpoints.
fn decode(word: u16, bank: u16, file_addresses: &[FileAddress; DATA_ADDRESSES]) -> Pic16Op {
    let Some(Pic16Row { row, kind }) = find_row(word) else {
        return PredecodedOp { kind: Pic16OpKind::Illegal, args: [0; 3] };
    };
    let mut op = row.predecode(kind, word.into(), &InstructionLocation { len: 1, ..InstructionLocation::default() });
    let (mut at, mut in_ram) = (0, false);
    for slot in row.operands {
        match slot.kind.name {
            F::NAME => {
                let file_address = file_addresses[usize::from(bank << 7 | word & 0x7F) % DATA_ADDRESSES];
                op.args[at..at + 2].copy_from_slice(&file_address.0.to_le_bytes());
                in_ram = file_address.0 < DATA_ADDRESSES as u16;
            }
            B::NAME => op.args[at] = 1 << (op.args[at] & 7),
            _ => {}
        }
        at += if slot.kind.wide { 2 } else { 1 };
    }
    match SHAPES[kind as usize] {
        Some(shape) if in_ram => PredecodedOp { kind: shape, ..op },
        _ => op,
    }
}
