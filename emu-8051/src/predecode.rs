//! Program memory as predecoded ops: four bytes per byte of it, since an instruction may begin anywhere.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::Mark;
use emu_core::state::Changes;
use emu_core::table::{Op, Site};

use crate::isa::{Kind, Mcs51Op, ROWS, SHAPES, row_of};
use crate::operands::{BitAddr, Dir, RamBit};
use crate::record::{Record, record};
use crate::soc::restless;
use crate::turn::SPAN;

/// How the machine treats MOVX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum External {
    /// XDATA is a memory of its own.
    #[default]
    Separate,
    /// XDATA and program memory are one: a write may change instructions.
    Unified,
    /// There is no bus.
    Absent,
}

/// A loop that only looks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Loop {
    /// Its first instruction.
    pub head: u32,
    /// The registers of the chip that it reads.
    pub looks: Vec<u8>,
    /// It clears the watchdog.
    pub renews: bool,
    /// It does nothing but count down this byte.
    pub counter: Option<Counter>,
}

/// What a DJNZ counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Counter {
    /// A register of the bank.
    Reg(u8),
    /// A byte of RAM.
    Ram(u8),
}

/// Program memory in both forms.
#[derive(Debug, Clone)]
pub(crate) struct Code {
    /// Bytes, erased ones FFh.
    pub bytes: Box<[u8; SPAN]>,
    /// One op per byte, traps in place: `ops[0]` marks jumps to themselves as [`Kind::Poll`], since that is how programs
    /// end; `ops[1]` marks all loops that only look.
    pub ops: [Box<[Mcs51Op; SPAN]>; 2],
    /// The same without any marks or traps.
    pub plain: Box<[Mcs51Op; SPAN]>,
    /// The loops that only look, by the jump that closes them.
    loops: BTreeMap<u32, Loop>,
    traps: BTreeSet<u32>,
    external: External,
    size: u32,
    /// What differs from the bytes that it was built with.
    pub changes: Changes<u8>,
}

impl Code {
    /// Program memory of `size` bytes filled from address 0 with `image`, erased behind it. Behind its end there is no
    /// instruction.
    pub(crate) fn new(image: &[u8], size: u32, external: External) -> Code {
        let mut bytes = Box::new([0xFF; SPAN]);
        let used = image.len().min(SPAN);
        bytes[..used].copy_from_slice(&image[..used]);
        // What erased bytes read as is an instruction too, and the same everywhere.
        let erased = decode([0xFF; 3], 0, external);
        let ops = || Box::new([erased; SPAN]);
        let (marked, plain) = ([ops(), ops()], ops());
        let (loops, traps, changes) = (BTreeMap::new(), BTreeSet::new(), Changes::NONE);
        let mut code = Code { bytes, ops: marked, plain, loops, traps, external, size, changes };
        code.predecode(0, used as u32);
        code.predecode(size, SPAN as u32);
        code
    }

    /// Writes a byte of program memory.
    pub(crate) fn poke(&mut self, addr: u16, value: u8) {
        let old = std::mem::replace(&mut self.bytes[usize::from(addr)], value);
        self.changes.note(addr.into(), old, value);
        // The byte may belong to an instruction that begins up to two bytes before; the jump that closes a loop around it
        // may stand some bytes ahead.
        for pc in u32::from(addr) + SPAN as u32 - 2..=u32::from(addr) + SPAN as u32 + REACH {
            let pc = pc % SPAN as u32;
            self.predecode(pc, pc + 1);
        }
    }

    /// Sets or clears a trap; false when it was so already.
    pub(crate) fn trap(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.traps.insert(pc) } else { self.traps.remove(&pc) };
        if changed {
            self.predecode(pc, pc + 1);
        }
        changed
    }

    /// True when a trap stands at `pc`.
    pub(crate) fn has_trap(&self, pc: u32) -> bool {
        self.traps.contains(&pc)
    }

    /// What the instruction at `pc` is to the loop around the hot loop; nothing else where a trap stands.
    pub(crate) fn mark(&self, pc: u32) -> Mark {
        match [0, 1].map(|ops: usize| self.ops[ops][pc as usize].kind) {
            [Kind::Poll, _] => Mark::Spins,
            [_, Kind::Poll] => Mark::ClosesLoop,
            _ => Mark::Plain,
        }
    }

    /// The loop that only looks and is closed by the jump at `end`.
    pub(crate) fn look(&self, end: u32) -> Option<&Loop> {
        self.loops.get(&end)
    }

    /// The op of the MOVX at `pc` as it is where XDATA is a memory of its own.
    pub(crate) fn movx(&self, pc: u32) -> Mcs51Op {
        decode(self.at(pc), pc, External::Separate)
    }

    /// Three bytes from `pc` on, around the end of memory.
    fn at(&self, pc: u32) -> [u8; 3] {
        [0, 1, 2].map(|i| self.bytes[(pc as usize + i) % SPAN])
    }

    /// Fills the ops from `from` up to `to`, which is excluded.
    fn predecode(&mut self, from: u32, to: u32) {
        for pc in from..to {
            let op = match pc < self.size {
                true => decode(self.at(pc), pc, self.external),
                false => Op { kind: Kind::Illegal, arg: [0; 3] },
            };
            self.plain[pc as usize] = op;
            let head = loop_closed_by(op, self.at(pc), pc);
            let spins = head == Some(pc) && matches!(op.kind, Kind::Sjmp | Kind::Ajmp | Kind::Ljmp);
            let looks = head
                .filter(|_| !spins)
                .and_then(|head| self.counts_down(op, head, pc).or_else(|| self.only_looks(head, pc)));
            let kinds = match (self.traps.contains(&pc), spins, &looks) {
                (true, ..) => [Kind::Trap; 2],
                (_, true, _) => [Kind::Poll; 2],
                (.., Some(_)) => [op.kind, Kind::Poll],
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

    /// The loop from `head` to the jump at `end`, when a turn of it changes nothing but what the core holds and the watchdog:
    /// then a turn that leaves the core as it was is followed by one just like it, until one of the registers that it reads
    /// changes. `None` for other loops, and for those that read a register which never rests.
    fn only_looks(&self, head: u32, end: u32) -> Option<Loop> {
        let mut renews = false;
        let (mut looks, mut starts, mut targets, mut pc) = (Vec::new(), Vec::new(), Vec::new(), head);
        while pc <= end {
            let record = record(decode(self.at(pc), pc, self.external));
            if record.reaches_out {
                return None;
            }
            renews |= record.renews;
            starts.push(pc);
            targets.extend(target(&record, self.at(pc), pc));
            looks.extend(record.looks);
            pc += len(self.at(pc));
        }
        // A jump into the middle of an instruction would find others there.
        let strays = targets.iter().any(|target| (head..=end).contains(target) && !starts.contains(target));
        let whole = starts.last() == Some(&end) && !strays;
        (whole && !looks.iter().any(|&addr| restless(addr))).then_some(Loop { head, looks, renews, counter: None })
    }

    /// The loop from `head` to the DJNZ `op` at `end`, when nothing but NOPs stands between.
    fn counts_down(&self, op: Mcs51Op, head: u32, end: u32) -> Option<Loop> {
        let counter = match op.kind {
            Kind::DjnzReg => Counter::Reg(op.arg[0]),
            Kind::DjnzRam => Counter::Ram(op.arg[0]),
            _ => return None,
        };
        let idle = (head..end).all(|pc| decode(self.at(pc), pc, self.external).kind == Kind::Nop);
        idle.then_some(Loop { head, looks: Vec::new(), renews: false, counter: Some(counter) })
    }
}

/// Bytes between the ends of a loop that is looked at.
const REACH: u32 = 16;

/// Length of the instruction at the front of some bytes; one without a row counts one.
fn len(bytes: [u8; 3]) -> u32 {
    row_of(bytes).map_or(1, |(row, ..)| row.len())
}

/// Decodes the instruction at the front of `bytes`, which stand at `pc`, without poll marks or traps.
fn decode(bytes: [u8; 3], pc: u32, external: External) -> Mcs51Op {
    let Some((row, kind, bits)) = row_of(bytes) else {
        return Op { kind: Kind::Illegal, arg: [0; 3] };
    };
    let len = row.len();
    let mut op = row.op(kind, bits, &Site { pc, len, next_len: 1, pc_mask: 0xFFFF });
    if row.operands.last().is_some_and(|slot| slot.letter == b't' && !slot.kind.wide) {
        // In the op a relative target is the distance from the next instruction. It stands behind what takes a byte each.
        let place = row.operands.len() - 1;
        op.arg[place] = op.arg[place].wrapping_sub((pc + len) as u8);
    }
    let reads = matches!(kind, Kind::MovxADptr | Kind::MovxAInd);
    let writes = matches!(kind, Kind::MovxDptrA | Kind::MovxIndA);
    let slow = match external {
        External::Separate => false,
        External::Unified => writes,
        External::Absent => reads || writes,
    };
    if slow { Op { kind: Kind::Rewrite, ..op } } else { in_ram(op) }
}

/// The op in the shape for RAM, where all addresses of its operands lie there.
fn in_ram(mut op: Mcs51Op) -> Mcs51Op {
    let row = op.kind as usize;
    let (Some(&Some(shape)), Some(row)) = (SHAPES.get(row), ROWS.get(row)) else { return op };
    let addresses = row.operands.iter().zip(op.arg);
    if addresses.clone().any(|(slot, byte)| matches!(slot.kind.name, Dir::NAME | BitAddr::NAME) && byte >= 0x80) {
        return op;
    }
    if row.operands.first().is_some_and(|slot| slot.kind.name == BitAddr::NAME) {
        let bit = RamBit::at(op.arg[0]);
        op.arg = [bit.byte, bit.mask, op.arg[1]];
    }
    Op { kind: shape, ..op }
}

/// The target of a short backward jump (or one to itself), the head of the loop that it closes.
fn loop_closed_by(op: Mcs51Op, bytes: [u8; 3], pc: u32) -> Option<u32> {
    let record = record(op);
    let stays = !record.reaches_out || matches!(op.kind, Kind::DjnzReg | Kind::DjnzRam);
    target(&record, bytes, pc).filter(|&target| stays && target <= pc && pc - target <= REACH)
}

/// The target of a jump that says where it goes.
fn target(record: &Record, bytes: [u8; 3], pc: u32) -> Option<u32> {
    let relative = record.distance.map(|d| (pc + len(bytes)).wrapping_add_signed(d.into()) & 0xFFFF);
    relative.or(record.target.map(u32::from))
}
