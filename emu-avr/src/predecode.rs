//! Flash as predecoded ops: four bytes per program word.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::InstructionMark;
use emu_core::state::MemoryChanges;
use emu_core::table::{InstructionLocation, MatchedRow, PredecodedOp};

use crate::chips::AvrPart;
use crate::isa::{AvrOp, Kind, find_row, is_missing};
use crate::recorder::record_instruction;

/// Program words that the op array holds: as many as a program counter of 16 bits reaches, so that it needs no check. What
/// is behind the end of a smaller memory falls to the slow path, which goes on at the beginning.
pub(crate) const MAX_WORDS: usize = 0x1_0000;

/// A loop that only looks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LoopPlan {
    /// Its first instruction.
    pub head: u32,
    /// The data addresses that it reads.
    pub addresses_read: Vec<u16>,
    /// It clears the watchdog.
    pub clears_watchdog: bool,
    /// It does nothing but count these registers down, as one number, the lowest first.
    pub counter_registers: Vec<u8>,
}

/// Program memory in both forms.
#[derive(Debug, Clone)]
pub(crate) struct CodeMemory {
    /// Bytes, a power of two of them, erased ones FFh.
    pub bytes: Vec<u8>,
    /// One op per program word, traps in place: `ops[0]` marks jumps to themselves as [`Kind::PollingLoop`], since that is how
    /// programs end; `ops[1]` marks all loops that only look.
    pub ops: [Box<[AvrOp; MAX_WORDS]>; 2],
    /// The same without any marks or traps.
    pub ops_unmarked: Box<[AvrOp; MAX_WORDS]>,
    /// The loops that only look, by the branch that closes them.
    loops: BTreeMap<u32, LoopPlan>,
    /// What an erased word is.
    erased: Kind,
    part: &'static AvrPart,
    traps: BTreeSet<u32>,
    /// What differs from the bytes that it was built with.
    pub changes: MemoryChanges<u8>,
}

impl CodeMemory {
    /// Program memory with these bytes, a power of two of them that is at most twice [`MAX_WORDS`]; erased words do nothing, or are no
    /// instruction.
    pub(crate) fn new(bytes: Vec<u8>, part: &'static AvrPart, erased_is_nop: bool) -> CodeMemory {
        let erased = if erased_is_nop { Kind::Nop } else { Kind::Illegal };
        let mut ops = Box::new([PredecodedOp { kind: Kind::PollingLoop, args: [0; 3] }; MAX_WORDS]);
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
            traps: BTreeSet::new(),
            changes: MemoryChanges::NONE,
        };
        code.predecode(0, used);
        code
    }

    /// The byte at an address, which wraps at the end of memory.
    #[inline(always)]
    pub(crate) fn byte(&self, addr: usize) -> u8 {
        self.bytes.get(addr & self.bytes.len().wrapping_sub(1)).copied().unwrap_or(0xFF)
    }

    /// Program words minus one: where the program counter wraps.
    #[inline(always)]
    pub(crate) fn mask(&self) -> u32 {
        (self.bytes.len() / 2 - 1) as u32
    }

    /// Writes a byte of program memory.
    pub(crate) fn poke(&mut self, addr: usize, value: u8) {
        let old = std::mem::replace(&mut self.bytes[addr], value);
        self.changes.record(addr, old, value);
        // The byte may belong to an instruction that begins a word before, or be skipped over by one before that; the
        // branch that closes a loop around it may stand some words ahead.
        let pc = (addr / 2) as u32 + MAX_WORDS as u32;
        for pc in pc - 3..pc + MAX_LOOP_WORDS + 2 {
            let pc = pc & self.mask();
            self.predecode(pc, pc + 1);
        }
    }

    /// Sets or clears a trap; false when it was so already.
    pub(crate) fn set_breakpoint(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.traps.insert(pc) } else { self.traps.remove(&pc) };
        if changed {
            self.predecode(pc, pc + 1);
            let kind = if on { Kind::Breakpoint } else { Kind::PollingLoop };
            for ops in &mut self.ops {
                for behind in ops.iter_mut().skip(pc as usize).step_by(self.bytes.len() / 2).skip(1) {
                    behind.kind = kind;
                }
            }
        }
        changed
    }

    /// True when a trap stands at `pc`.
    pub(crate) fn has_breakpoint(&self, pc: u32) -> bool {
        self.traps.contains(&pc)
    }

    /// What the instruction at `pc` is to the loop around the hot loop; nothing else where a trap stands.
    pub(crate) fn instruction_mark(&self, pc: u32) -> InstructionMark {
        match [0, 1].map(|ops: usize| self.ops[ops][pc as usize].kind) {
            [Kind::PollingLoop, _] => InstructionMark::JumpsToItself,
            [_, Kind::PollingLoop] => InstructionMark::ClosesLoop,
            _ => InstructionMark::Plain,
        }
    }

    /// The loop that only looks and is closed by the branch at `end`.
    pub(crate) fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.loops.get(&end)
    }

    /// Fills the ops from `from` up to `to`, which is excluded.
    fn predecode(&mut self, from: u32, to: u32) {
        for pc in from..to {
            let op = self.decode(pc);
            self.ops_unmarked[pc as usize] = op;
            let head = loop_closed_by(op, pc);
            let looks = head.and_then(|head| self.polling_loop(head, pc).or_else(|| self.countdown_loop(head, pc)));
            let kinds = match (self.traps.contains(&pc), head, &looks) {
                (true, ..) => [Kind::Breakpoint; 2],
                (_, Some(head), _) if head == pc => [Kind::PollingLoop; 2],
                (_, _, Some(_)) => [op.kind, Kind::PollingLoop],
                _ => [op.kind; 2],
            };
            for (ops, kind) in self.ops.iter_mut().zip(kinds) {
                ops[pc as usize] = PredecodedOp { kind, args: op.args };
            }
            match looks {
                Some(found) => self.loops.insert(pc, found),
                None => self.loops.remove(&pc),
            };
        }
    }

    /// The word at `pc`, which wraps at the end of memory.
    pub(crate) fn word(&self, pc: u32) -> u16 {
        let at = (pc as usize * 2) % self.bytes.len();
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// The row at `pc`, if the chip has the instruction.
    fn row_at(&self, pc: u32) -> Option<MatchedRow<Kind>> {
        find_row(self.word(pc), self.word(pc + 1)).filter(|found| !is_missing(self.bytes.len() as u32, found.kind))
    }

    /// Length of the instruction at `pc` in words; a word without a row counts one.
    fn len_at(&self, pc: u32) -> u32 {
        self.row_at(pc).map_or(1, |found| found.row.len())
    }

    /// Decodes the instruction at `pc`, without poll marks or traps. A word without a row comes as `Illegal`, an
    /// erased one as what it is taken for.
    fn decode(&self, pc: u32) -> AvrOp {
        let Some(MatchedRow { row, kind, bits }) = self.row_at(pc) else {
            let kind = if self.word(pc) == 0xFFFF { self.erased } else { Kind::Illegal };
            return PredecodedOp { kind, args: [0; 3] };
        };
        let len = row.len();
        row.predecode(
            kind,
            bits,
            &InstructionLocation { pc, len, next_len: self.len_at(pc + len), pc_mask: self.mask() },
        )
    }

    /// The loop from `head` to the branch at `end`, when a turn of it depends on nothing but the cells that it reads: it
    /// reaches out to nothing but the watchdog, and needs no register or flag that it has written itself a turn before. So
    /// its turns are all alike until one of those cells changes. `None` for other loops, and for those that read a cell
    /// which never rests.
    fn polling_loop(&self, head: u32, end: u32) -> Option<LoopPlan> {
        let (mut looks, mut needs, mut writes, mut pc) = (Vec::new(), 0u64, 0u64, head);
        let (mut renews, mut skipped, mut constants) = (false, false, KnownRegisters::default());
        while pc <= end {
            let op = self.decode(pc);
            let mut record = record_instruction(op, false);
            if let Some(addr) = constants.load(op) {
                (record.has_other_effects, record.addresses_read) = (false, vec![addr]);
            }
            if record.has_other_effects {
                return None;
            }
            // What is skipped leaves the register as it was.
            constants.run(op, record.writes, skipped);
            skipped = record.conditional;
            renews |= record.clears_watchdog;
            needs |= record.reads & !writes;
            writes |= record.writes;
            looks.extend(record.addresses_read);
            pc += self.len_at(pc);
        }
        let rests = !looks.is_empty() && !looks.iter().any(|&reg| self.part.volatile_register(reg));
        (needs & writes == 0 && head != end && rests).then_some(LoopPlan {
            head,
            addresses_read: looks,
            clears_watchdog: renews,
            counter_registers: Vec::new(),
        })
    }

    /// The loop from `head` to the BRNE at `end`, when it counts down by one, by DEC, SBIW or SUBI with SBCI, and does nothing
    /// besides but clear the watchdog.
    fn countdown_loop(&self, head: u32, end: u32) -> Option<LoopPlan> {
        let (mut counter, mut closed): (Vec<u8>, bool) = (Vec::new(), false);
        for pc in head..end {
            let op = self.decode(pc);
            let (reg, first) = (op.args[0], counter.is_empty());
            match op.kind {
                Kind::Nop | Kind::Wdr => closed = !first,
                Kind::Dec if first => (counter, closed) = (vec![reg], true),
                Kind::Sbiw if first && op.args[1] == 1 => (counter, closed) = (vec![reg, reg + 1], true),
                Kind::Subi if first && op.args[1] == 1 => counter.push(reg),
                Kind::Sbci if !first && !closed && op.args[1] == 0 && !counter.contains(&reg) => counter.push(reg),
                _ => return None,
            }
        }
        let counts = self.decode(end).kind == Kind::Brne && !counter.is_empty();
        counts.then_some(LoopPlan {
            head,
            addresses_read: Vec::new(),
            clears_watchdog: false,
            counter_registers: counter,
        })
    }
}

/// Registers of which the loop itself says what they hold.
#[derive(Default)]
struct KnownRegisters([Option<u8>; 32]);

impl KnownRegisters {
    /// The data address behind the registers that a load reads through a pointer of constants.
    fn load(&self, op: AvrOp) -> Option<u16> {
        let (low, offset) = match op.kind {
            Kind::LdX => (26, 0),
            Kind::LdY => (28, 0),
            Kind::LdZ => (30, 0),
            Kind::LddY => (28, op.args[1]),
            Kind::LddZ => (30, op.args[1]),
            _ => return None,
        };
        let addr = u16::from_le_bytes([self.0[low]?, self.0[low + 1]?]).wrapping_add(offset.into());
        (addr >= 0x20).then_some(addr)
    }

    /// An instruction that writes `writes` is over, or was skipped perhaps.
    fn run(&mut self, op: AvrOp, writes: u64, skipped: bool) {
        let of = |reg: u8| self.0[usize::from(reg & 31)];
        let values: &[Option<u8>] = match op.kind {
            Kind::Ldi => &[Some(op.args[1])],
            Kind::Movw => &[of(op.args[1]), of(op.args[1] + 1)],
            _ => &[],
        };
        let mut values = values.iter();
        let written = self.0.iter_mut().enumerate().filter(|(reg, _)| writes >> reg & 1 == 1);
        written.for_each(|(_, held)| *held = values.next().copied().flatten().filter(|_| !skipped));
    }
}

/// Words between the ends of a loop that is looked at.
const MAX_LOOP_WORDS: u32 = 16;

/// The target of a short backward branch (or a jump to itself), the head of the loop that it closes.
fn loop_closed_by(op: AvrOp, pc: u32) -> Option<u32> {
    let record = record_instruction(op, false);
    record.target.filter(|&target| !record.has_other_effects && target <= pc && pc - target <= MAX_LOOP_WORDS)
}
