//! Flash as predecoded ops: four bytes per program word.

use emu_core::table::{Op, Site};

use crate::isa::{AvrOp, Kind, PC_MASK, row_of};
use crate::record::record;

/// Program words that the op array holds; a power of two, so that an address needs a mask and no check.
pub const WORDS: usize = PC_MASK as usize + 1;

/// Program memory in both forms.
#[derive(Debug, Clone)]
pub struct Code {
    /// Bytes, erased ones FFh.
    pub bytes: Box<[u8; WORDS * 2]>,
    /// One op per program word, poll marks and traps in place.
    pub ops: Box<[AvrOp; WORDS]>,
}

impl Code {
    /// Program memory filled from address 0 with `image`, erased behind it.
    pub fn new(image: &[u8]) -> Code {
        let mut bytes = Box::new([0xFF; WORDS * 2]);
        let n = image.len().min(bytes.len());
        bytes[..n].copy_from_slice(&image[..n]);
        let illegal = Op { kind: Kind::Illegal, arg: [0; 3] };
        Code { bytes, ops: Box::new([illegal; WORDS]) }
    }

    /// The word at `pc`, which wraps at the end of memory.
    pub fn word(&self, pc: u32) -> u16 {
        let at = (pc as usize * 2) % self.bytes.len();
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    /// Length of the instruction at `pc` in words; a word without a row counts one.
    fn len_at(&self, pc: u32) -> u32 {
        row_of(self.word(pc), 0).map_or(1, |(row, ..)| row.len())
    }

    /// Decodes the instruction at `pc`, without poll marks or traps. A word without a row, and SPM, come as `Illegal`.
    pub fn decode(&self, pc: u32) -> AvrOp {
        let Some((row, kind, bits)) = row_of(self.word(pc), self.word(pc + 1)) else {
            return Op { kind: Kind::Illegal, arg: [0; 3] };
        };
        if kind == Kind::Spm {
            return Op { kind: Kind::Illegal, arg: [0; 3] };
        }
        let len = row.len();
        let mask = (self.bytes.len() / 2 - 1) as u32;
        row.op(kind, bits, &Site { pc, len, next_len: self.len_at(pc + len), pc_mask: mask })
    }

    /// Decodes all of it. With `polls`, branches that close a loop which only looks are marked [`Kind::Poll`]; a jump to
    /// itself is marked always, since that is how programs end.
    pub fn predecode(&mut self, polls: bool) {
        // Erased words stay what they are: no instruction.
        let used = self.bytes.iter().rposition(|&b| b != 0xFF).map_or(0, |at| at as u32 / 2 + 1);
        for pc in 0..used {
            self.ops[pc as usize] = self.op_at(pc, polls);
        }
    }

    /// The op that stands at `pc` where no trap is set.
    pub fn op_at(&self, pc: u32, polls: bool) -> AvrOp {
        let op = self.decode(pc);
        let closes =
            loop_closed_by(op, pc).is_some_and(|head| head == pc || polls && self.only_looks(head, pc).is_some());
        if closes { Op { kind: Kind::Poll, arg: op.arg } } else { op }
    }

    /// The data addresses that the loop from `head` to the branch at `end` reads, when a turn of it depends on nothing
    /// else: it reaches out to nothing, and needs no register or flag that it has written itself a turn before. So its
    /// turns are all alike until one of those cells changes. `None` for other loops.
    pub fn only_looks(&self, head: u32, end: u32) -> Option<Vec<u16>> {
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
        (needs & writes == 0 && (head == end || !looks.is_empty())).then_some(looks)
    }
}

/// The target of a short backward branch (or a jump to itself), the head of the loop that it closes.
fn loop_closed_by(op: AvrOp, pc: u32) -> Option<u32> {
    const REACH: u32 = 8;
    let record = record(op, false);
    record.target.filter(|&target| !record.reaches_out && target <= pc && pc - target <= REACH)
}
