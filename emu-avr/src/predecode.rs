//! Flash as predecoded ops: four bytes per program word.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::Mark;
use emu_core::state::Changes;
use emu_core::table::{Op, Row, Site};

use crate::chips::Part;
use crate::isa::{AvrOp, Kind, lacks, row_of};
use crate::record::record;

/// Program words that the op array holds: as many as a program counter of 16 bits reaches, so that it needs no check. What
/// is behind the end of a smaller memory falls to the slow path, which goes on at the beginning.
pub const WORDS: usize = 0x1_0000;

/// Program memory in both forms.
#[derive(Debug, Clone)]
pub struct Code {
    /// Bytes, a power of two of them, erased ones FFh.
    pub bytes: Vec<u8>,
    /// One op per program word, traps in place: `ops[0]` marks jumps to themselves as [`Kind::Poll`], since that is how
    /// programs end; `ops[1]` marks all loops that only look.
    pub ops: [Box<[AvrOp; WORDS]>; 2],
    /// The same without any marks or traps.
    pub plain: Box<[AvrOp; WORDS]>,
    /// The loops that only look, by the branch that closes them: head, and the data addresses that they read.
    loops: BTreeMap<u32, (u32, Vec<u16>)>,
    part: &'static Part,
    traps: BTreeSet<u32>,
    /// What differs from the bytes that it was built with.
    pub changes: Changes<u8>,
}

impl Code {
    /// Program memory with these bytes, a power of two of them that is at most twice [`WORDS`].
    pub fn new(bytes: Vec<u8>, part: &'static Part) -> Code {
        let mut ops = Box::new([Op { kind: Kind::Poll, arg: [0; 3] }; WORDS]);
        // Erased words stay what they are: no instruction.
        ops[..bytes.len() / 2].fill(Op { kind: Kind::Illegal, arg: [0; 3] });
        let (ops, plain) = ([ops.clone(), ops.clone()], ops);
        let used = bytes.iter().rposition(|&b| b != 0xFF).map_or(0, |at| at as u32 / 2 + 1);
        let mut code =
            Code { bytes, ops, plain, loops: BTreeMap::new(), part, traps: BTreeSet::new(), changes: Changes::NONE };
        code.predecode(0, used);
        code
    }

    /// The byte at an address, which wraps at the end of memory.
    #[inline(always)]
    pub fn byte(&self, addr: usize) -> u8 {
        self.bytes.get(addr & self.bytes.len().wrapping_sub(1)).copied().unwrap_or(0xFF)
    }

    /// Program words minus one: where the program counter wraps.
    #[inline(always)]
    pub fn mask(&self) -> u32 {
        (self.bytes.len() / 2 - 1) as u32
    }

    /// Writes a byte of program memory.
    pub fn poke(&mut self, addr: usize, value: u8) {
        let old = std::mem::replace(&mut self.bytes[addr], value);
        self.changes.note(addr, old, value);
        // The byte may belong to an instruction that begins a word before, or be skipped over by one before that; the
        // branch that closes a loop around it may stand some words ahead.
        let pc = (addr / 2) as u32 + WORDS as u32;
        for pc in pc - 3..pc + REACH + 2 {
            let pc = pc & self.mask();
            self.predecode(pc, pc + 1);
        }
    }

    /// Sets or clears a trap; false when it was so already.
    pub fn trap(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.traps.insert(pc) } else { self.traps.remove(&pc) };
        if changed {
            self.predecode(pc, pc + 1);
            let kind = if on { Kind::Trap } else { Kind::Poll };
            for ops in &mut self.ops {
                for behind in ops.iter_mut().skip(pc as usize).step_by(self.bytes.len() / 2).skip(1) {
                    behind.kind = kind;
                }
            }
        }
        changed
    }

    /// True when a trap stands at `pc`.
    pub fn has_trap(&self, pc: u32) -> bool {
        self.traps.contains(&pc)
    }

    /// What the instruction at `pc` is to the loop around the hot loop; nothing else where a trap stands.
    pub fn mark(&self, pc: u32) -> Mark {
        match [0, 1].map(|ops: usize| self.ops[ops][pc as usize].kind) {
            [Kind::Poll, _] => Mark::Spins,
            [_, Kind::Poll] => Mark::ClosesLoop,
            _ => Mark::Plain,
        }
    }

    /// The loop that only looks and is closed by the branch at `end`: its head and what it reads.
    pub fn look(&self, end: u32) -> Option<&(u32, Vec<u16>)> {
        self.loops.get(&end)
    }

    /// Fills the ops from `from` up to `to`, which is excluded.
    fn predecode(&mut self, from: u32, to: u32) {
        for pc in from..to {
            let op = self.decode(pc);
            self.plain[pc as usize] = op;
            let head = loop_closed_by(op, pc);
            let looks = head.and_then(|head| Some((head, self.only_looks(head, pc)?)));
            let kinds = match (self.traps.contains(&pc), head, &looks) {
                (true, ..) => [Kind::Trap; 2],
                (_, Some(head), _) if head == pc => [Kind::Poll; 2],
                (_, _, Some(_)) => [op.kind, Kind::Poll],
                _ => [op.kind; 2],
            };
            for (ops, kind) in self.ops.iter_mut().zip(kinds) {
                ops[pc as usize] = Op { kind, arg: op.arg };
            }
            match looks {
                Some(found) => self.loops.insert(pc, found),
                None => self.loops.remove(&pc),
            };
        }
    }

    /// The word at `pc`, which wraps at the end of memory.
    pub fn word(&self, pc: u32) -> u16 {
        let at = (pc as usize * 2) % self.bytes.len();
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// The row at `pc`, if the chip has the instruction.
    fn row_at(&self, pc: u32) -> Option<(&'static Row, Kind, u32)> {
        row_of(self.word(pc), self.word(pc + 1)).filter(|&(_, kind, _)| !lacks(self.bytes.len() as u32, kind))
    }

    /// Length of the instruction at `pc` in words; a word without a row counts one.
    fn len_at(&self, pc: u32) -> u32 {
        self.row_at(pc).map_or(1, |(row, ..)| row.len())
    }

    /// Decodes the instruction at `pc`, without poll marks or traps. A word without a row comes as `Illegal`.
    fn decode(&self, pc: u32) -> AvrOp {
        let Some((row, kind, bits)) = self.row_at(pc) else {
            return Op { kind: Kind::Illegal, arg: [0; 3] };
        };
        let len = row.len();
        row.op(kind, bits, &Site { pc, len, next_len: self.len_at(pc + len), pc_mask: self.mask() })
    }

    /// The data addresses that the loop from `head` to the branch at `end` reads, when a turn of it depends on nothing
    /// else: it reaches out to nothing, and needs no register or flag that it has written itself a turn before. So its
    /// turns are all alike until one of those cells changes. `None` for other loops, and for those that read a cell
    /// which never rests.
    fn only_looks(&self, head: u32, end: u32) -> Option<Vec<u16>> {
        let (mut looks, mut needs, mut writes, mut pc) = (Vec::new(), 0u64, 0u64, head);
        while pc <= end {
            let record = record(self.decode(pc), false);
            if record.reaches_out {
                return None;
            }
            needs |= record.reads & !writes;
            writes |= record.writes;
            looks.extend(record.looks);
            pc += self.len_at(pc);
        }
        let rests = !looks.is_empty() && !looks.iter().any(|&reg| self.part.restless(reg));
        (needs & writes == 0 && head != end && rests).then_some(looks)
    }
}

/// Words between the ends of a loop that is looked at.
const REACH: u32 = 8;

/// The target of a short backward branch (or a jump to itself), the head of the loop that it closes.
fn loop_closed_by(op: AvrOp, pc: u32) -> Option<u32> {
    let record = record(op, false);
    record.target.filter(|&target| !record.reaches_out && target <= pc && pc - target <= REACH)
}
