//! Program memory as predecoded ops, four bytes per program word.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::{InstructionMark, LoopPlan};
use emu_core::state::MemoryChanges;
use emu_core::table::{InstructionLocation, MatchedRow, PredecodedOp};

use crate::chips::AvrPart;
use crate::executor::{SPL, SREG};
use crate::isa::{AvrOp, AvrOpKind, find_row, is_missing};
use crate::recorder::record_instruction;

/// Program words in the op array: all that a 16-bit program counter can address, so that no bounds check is
/// needed. Words past the end of a smaller memory go to the slow path, which wraps to the start.
pub(crate) const MAX_WORDS: usize = 0x1_0000;

/// Program memory as bytes and as predecoded ops.
#[derive(Debug, Clone)]
pub(crate) struct CodeMemory {
    /// The bytes; their number is a power of two, and erased bytes are FFh.
    pub bytes: Vec<u8>,
    /// One op per program word, with breakpoints. `ops[0]` marks only jumps to themselves as
    /// [`AvrOpKind::PollingLoop`], because programs end that way; `ops[1]` marks all polling loops.
    pub ops: [Box<[AvrOp; MAX_WORDS]>; 2],
    /// The ops without marks and breakpoints.
    pub ops_unmarked: Box<[AvrOp; MAX_WORDS]>,
    /// The polling loops, by the branch that closes each.
    loops: BTreeMap<u32, LoopPlan>,
    /// Kind of an erased word.
    erased: AvrOpKind,
    part: &'static AvrPart,
    breakpoints: BTreeSet<u32>,
    /// Differences from the bytes at creation.
    pub changes: MemoryChanges<u8>,
}

impl CodeMemory {
    /// Creates program memory from `bytes`, whose number is a power of two and at most twice [`MAX_WORDS`].
    /// Erased words are NOPs if `erased_is_nop`, otherwise illegal.
    pub(crate) fn new(bytes: Vec<u8>, part: &'static AvrPart, erased_is_nop: bool) -> CodeMemory {
        let erased = if erased_is_nop { AvrOpKind::Nop } else { AvrOpKind::Illegal };
        let mut ops = Box::new([PredecodedOp { kind: AvrOpKind::PollingLoop, args: [0; 3] }; MAX_WORDS]);
        ops[..bytes.len() / 2].fill(PredecodedOp { kind: erased, args: [0; 3] });
        let (ops, plain) = ([ops.clone(), ops.clone()], ops);
        let used = bytes.iter().rposition(|&b| b != 0xFF).map_or(0, |at| at as u32 / 2 + 1);
        let mut code = CodeMemory {
            bytes,
            ops,
            ops_unmarked: plain,
            loops: BTreeMap::new(),
            erased,
            part,
            breakpoints: BTreeSet::new(),
            changes: MemoryChanges::NONE,
        };
        code.predecode(0, used);
        code
    }

    /// Returns the byte at an address, which wraps at the end of memory.
    #[inline(always)]
    pub(crate) fn byte(&self, addr: usize) -> u8 {
        self.bytes.get(addr & self.bytes.len().wrapping_sub(1)).copied().unwrap_or(0xFF)
    }

    /// Returns the number of program words minus one: the mask with which the program counter wraps.
    #[inline(always)]
    pub(crate) fn mask(&self) -> u32 {
        (self.bytes.len() / 2 - 1) as u32
    }

    /// Writes a byte of program memory.
    pub(crate) fn poke(&mut self, addr: usize, value: u8) {
        let old = std::mem::replace(&mut self.bytes[addr], value);
        self.changes.record(addr, old, value);
        // The byte may belong to an instruction that starts one word earlier, or be skipped by one before
        // that. The branch that closes a loop around it can be several words ahead.
        let pc = (addr / 2) as u32 + MAX_WORDS as u32;
        for pc in pc - 3..pc + MAX_LOOP_WORDS + 2 {
            let pc = pc & self.mask();
            self.predecode(pc, pc + 1);
        }
    }

    /// Sets or clears a breakpoint; returns false if nothing changed.
    pub(crate) fn set_breakpoint(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.breakpoints.insert(pc) } else { self.breakpoints.remove(&pc) };
        if changed {
            self.predecode(pc, pc + 1);
            let kind = if on { AvrOpKind::Breakpoint } else { AvrOpKind::PollingLoop };
            for ops in &mut self.ops {
                for past_end in ops.iter_mut().skip(pc as usize).step_by(self.bytes.len() / 2).skip(1) {
                    past_end.kind = kind;
                }
            }
        }
        changed
    }

    /// Reports whether there is a breakpoint at `pc`.
    pub(crate) fn has_breakpoint(&self, pc: u32) -> bool {
        self.breakpoints.contains(&pc)
    }

    /// Returns the mark of the instruction at `pc` for the run loop; plain if there is a breakpoint.
    pub(crate) fn instruction_mark(&self, pc: u32) -> InstructionMark {
        match [0, 1].map(|ops: usize| self.ops[ops][pc as usize].kind) {
            [AvrOpKind::PollingLoop, _] => InstructionMark::JumpsToItself,
            [_, AvrOpKind::PollingLoop] => InstructionMark::ClosesLoop,
            _ => InstructionMark::Plain,
        }
    }

    /// Returns the polling loop that the branch at `end` closes.
    pub(crate) fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.loops.get(&end)
    }

    /// Predecodes the words from `from` to `to`, exclusive.
    fn predecode(&mut self, from: u32, to: u32) {
        for pc in from..to {
            let op = self.decode(pc);
            self.ops_unmarked[pc as usize] = op;
            let head = loop_closed_by(op, pc);
            let loop_plan = head.and_then(|head| self.polling_loop(head, pc).or_else(|| self.countdown_loop(head, pc)));
            let kinds = match (self.breakpoints.contains(&pc), head, &loop_plan) {
                (true, ..) => [AvrOpKind::Breakpoint; 2],
                (_, Some(head), _) if head == pc => [AvrOpKind::PollingLoop; 2],
                (_, _, Some(_)) => [op.kind, AvrOpKind::PollingLoop],
                _ => [op.kind; 2],
            };
            for (ops, kind) in self.ops.iter_mut().zip(kinds) {
                ops[pc as usize] = PredecodedOp { kind, args: op.args };
            }
            match loop_plan {
                Some(plan) => self.loops.insert(pc, plan),
                None => self.loops.remove(&pc),
            };
        }
    }

    /// Returns the word at `pc`, which wraps at the end of memory.
    pub(crate) fn word(&self, pc: u32) -> u16 {
        let at = (pc as usize * 2) % self.bytes.len();
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// The row at `pc`, if the chip has the instruction.
    fn row_at(&self, pc: u32) -> Option<MatchedRow<AvrOpKind>> {
        find_row(self.word(pc), self.word(pc + 1)).filter(|found| !is_missing(self.bytes.len() as u32, found.kind))
    }

    /// Returns the length of the instruction at `pc` in words; 1 for a word without a row.
    fn len_at(&self, pc: u32) -> u32 {
        self.row_at(pc).map_or(1, |found| found.row.len())
    }

    /// Decodes the instruction at `pc`, without loop marks and breakpoints. A word without a row is
    /// `Illegal`; an erased word has the kind `erased`.
    fn decode(&self, pc: u32) -> AvrOp {
        let Some(MatchedRow { row, kind, bits }) = self.row_at(pc) else {
            let kind = if self.word(pc) == 0xFFFF { self.erased } else { AvrOpKind::Illegal };
            return PredecodedOp { kind, args: [0; 3] };
        };
        let len = row.len();
        row.predecode(
            kind,
            bits,
            &InstructionLocation { pc, len, next_len: self.len_at(pc + len), pc_mask: self.mask() },
        )
    }

    /// Returns the plan of the loop from `head` to the branch at `end`, if an iteration depends only on the
    /// cells that it reads: it has no effect outside but clearing the watchdog, and needs no register or flag
    /// that it wrote in the previous iteration. All iterations are then equal until one of those cells
    /// changes. None for other loops, and for loops that read a volatile register.
    fn polling_loop(&self, head: u32, end: u32) -> Option<LoopPlan> {
        let (mut addresses_read, mut needs, mut writes, mut pc) = (Vec::new(), 0u64, 0u64, head);
        let (mut clears_watchdog, mut skipped, mut constants) = (false, false, KnownRegisters::default());
        while pc <= end {
            let op = self.decode(pc);
            let mut record = record_instruction(op, false);
            if let Some(addr) = constants.loaded_address(op) {
                (record.has_other_effects, record.addresses_read) = (false, vec![addr]);
            }
            if record.has_other_effects {
                return None;
            }
            // A skipped instruction leaves the register unchanged.
            constants.update(op, record.writes, skipped);
            skipped = record.conditional;
            clears_watchdog |= record.clears_watchdog;
            needs |= record.reads & !writes;
            writes |= record.writes;
            addresses_read.extend(record.addresses_read);
            pc += self.len_at(pc);
        }
        let reads_only_steady =
            !addresses_read.is_empty() && !addresses_read.iter().any(|&reg| self.part.volatile_register(reg));
        (needs & writes == 0 && head != end && reads_only_steady).then_some(LoopPlan {
            head,
            registers_read: addresses_read.into_iter().filter(|&addr| self.is_bus_register(addr)).collect(),
            clears_watchdog,
            counter: Vec::new(),
        })
    }

    /// Reports whether a data address is a register of the chip around the core.
    fn is_bus_register(&self, addr: u16) -> bool {
        (0x20..self.part.chip.ram_start).contains(&addr) && !matches!(addr, SPL..=SREG)
    }

    /// Returns the plan of the loop from `head` to the BRNE at `end`, if it decrements a counter by DEC, SBIW
    /// or SUBI with SBCI, and otherwise only clears the watchdog.
    fn countdown_loop(&self, head: u32, end: u32) -> Option<LoopPlan> {
        let (mut counter, mut counter_complete): (Vec<u8>, bool) = (Vec::new(), false);
        for pc in head..end {
            let op = self.decode(pc);
            let (reg, first) = (op.args[0], counter.is_empty());
            match op.kind {
                AvrOpKind::Nop | AvrOpKind::Wdr => counter_complete = !first,
                AvrOpKind::Dec if first => (counter, counter_complete) = (vec![reg], true),
                AvrOpKind::Sbiw if first && op.args[1] == 1 => (counter, counter_complete) = (vec![reg, reg + 1], true),
                AvrOpKind::Subi if first && op.args[1] == 1 => counter.push(reg),
                AvrOpKind::Sbci if !first && !counter_complete && op.args[1] == 0 && !counter.contains(&reg) => {
                    counter.push(reg)
                }
                _ => return None,
            }
        }
        let is_countdown = self.decode(end).kind == AvrOpKind::Brne && !counter.is_empty();
        is_countdown.then_some(LoopPlan {
            head,
            registers_read: Vec::new(),
            clears_watchdog: false,
            counter: counter.into_iter().map(u16::from).collect(),
        })
    }
}

/// Values of registers that the loop itself sets to constants.
#[derive(Default)]
struct KnownRegisters([Option<u8>; 32]);

impl KnownRegisters {
    /// Returns the data address at or above 20h that a load reads through a pointer with a known value.
    fn loaded_address(&self, op: AvrOp) -> Option<u16> {
        let (low, offset) = match op.kind {
            AvrOpKind::LdX => (26, 0),
            AvrOpKind::LdY => (28, 0),
            AvrOpKind::LdZ => (30, 0),
            AvrOpKind::LddY => (28, op.args[1]),
            AvrOpKind::LddZ => (30, op.args[1]),
            _ => return None,
        };
        let addr = u16::from_le_bytes([self.0[low]?, self.0[low + 1]?]).wrapping_add(offset.into());
        (addr >= 0x20).then_some(addr)
    }

    /// Updates the known values after an instruction that writes `writes` and that may have been skipped.
    fn update(&mut self, op: AvrOp, writes: u64, skipped: bool) {
        let of = |reg: u8| self.0[usize::from(reg & 31)];
        let values: &[Option<u8>] = match op.kind {
            AvrOpKind::Ldi => &[Some(op.args[1])],
            AvrOpKind::Movw => &[of(op.args[1]), of(op.args[1] + 1)],
            _ => &[],
        };
        let mut values = values.iter();
        let written = self.0.iter_mut().enumerate().filter(|(reg, _)| writes >> reg & 1 == 1);
        written.for_each(|(_, known)| *known = values.next().copied().flatten().filter(|_| !skipped));
    }
}

/// Longest loop that is analyzed: words between its first instruction and its branch.
const MAX_LOOP_WORDS: u32 = 16;

/// Returns the head of the loop that the instruction at `pc` closes: the target of a short backward branch or
/// of a jump to itself.
fn loop_closed_by(op: AvrOp, pc: u32) -> Option<u32> {
    let record = record_instruction(op, false);
    record.target.filter(|&target| !record.has_other_effects && target <= pc && pc - target <= MAX_LOOP_WORDS)
}
