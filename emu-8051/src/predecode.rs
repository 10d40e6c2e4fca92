//! Program memory as predecoded ops: one op of four bytes for each byte of memory, because an instruction can
//! start anywhere.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::engine::{InstructionMark, LoopPlan};
use emu_core::state::MemoryChanges;
use emu_core::table::{InstructionLocation, MatchedRow, PredecodedOp};

use crate::executor::ADDRESS_SPACE;
use crate::isa::{Mcs51Op, Mcs51OpKind, ROWS, SHAPES, find_row};
use crate::operands::{BitAddr, Dir, RamBit};
use crate::recorder::{InstructionRecord, record_instruction};
use crate::soc::volatile_register;

/// How the machine executes MOVX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum XdataBus {
    /// XDATA is a separate memory.
    #[default]
    Separate,
    /// XDATA and program memory are one memory: a write can change instructions.
    Unified,
    /// The chip has no external bus.
    Absent,
}

/// In the number of a counter byte: it is a register of the selected bank instead of an address of RAM.
pub(crate) const BANKED: u16 = 0x100;

/// Program memory as bytes and as ops.
#[derive(Debug, Clone)]
pub(crate) struct CodeMemory {
    /// The bytes; erased ones are FFh.
    pub bytes: Box<[u8; ADDRESS_SPACE]>,
    /// One op per byte, with breakpoints. `ops[0]` marks only jumps to themselves as
    /// [`Mcs51OpKind::PollingLoop`], since that is how programs end; `ops[1]` marks all polling loops.
    pub ops: [Box<[Mcs51Op; ADDRESS_SPACE]>; 2],
    /// The ops without any marks or breakpoints.
    pub ops_unmarked: Box<[Mcs51Op; ADDRESS_SPACE]>,
    /// The polling loops, by the address of the jump at their end.
    loops: BTreeMap<u32, LoopPlan>,
    breakpoints: BTreeSet<u32>,
    xdata_bus: XdataBus,
    size: u32,
    /// What differs from the bytes with which it was built.
    pub changes: MemoryChanges<u8>,
}

impl CodeMemory {
    /// Program memory of `size` bytes. It is filled from address 0 with `image` and erased after it. Beyond
    /// its end there are no instructions.
    pub(crate) fn new(image: &[u8], size: u32, xdata_bus: XdataBus) -> CodeMemory {
        let mut bytes = Box::new([0xFF; ADDRESS_SPACE]);
        let used = image.len().min(ADDRESS_SPACE);
        bytes[..used].copy_from_slice(&image[..used]);
        // Erased bytes decode to an instruction too, the same one at every address.
        let erased = decode([0xFF; 3], 0, xdata_bus);
        let erased_ops = || Box::new([erased; ADDRESS_SPACE]);
        let (ops, ops_unmarked) = ([erased_ops(), erased_ops()], erased_ops());
        let (loops, breakpoints, changes) = (BTreeMap::new(), BTreeSet::new(), MemoryChanges::NONE);
        let mut code = CodeMemory { bytes, ops, ops_unmarked, loops, breakpoints, xdata_bus, size, changes };
        code.predecode(0, used as u32);
        code.predecode(size, ADDRESS_SPACE as u32);
        code
    }

    /// Writes a byte of program memory.
    pub(crate) fn poke(&mut self, addr: u16, value: u8) {
        let old = std::mem::replace(&mut self.bytes[usize::from(addr)], value);
        self.changes.record(addr.into(), old, value);
        // The byte can belong to an instruction that starts up to two bytes before it. The jump at the end of
        // a loop around it can be up to [`MAX_LOOP_BYTES`] ahead.
        for pc in u32::from(addr) + ADDRESS_SPACE as u32 - 2..=u32::from(addr) + ADDRESS_SPACE as u32 + MAX_LOOP_BYTES {
            let pc = pc % ADDRESS_SPACE as u32;
            self.predecode(pc, pc + 1);
        }
    }

    /// Sets or clears a breakpoint. Returns false if nothing changed.
    pub(crate) fn set_breakpoint(&mut self, pc: u32, on: bool) -> bool {
        let changed = if on { self.breakpoints.insert(pc) } else { self.breakpoints.remove(&pc) };
        if changed {
            self.predecode(pc, pc + 1);
        }
        changed
    }

    /// Whether a breakpoint is set at `pc`.
    pub(crate) fn has_breakpoint(&self, pc: u32) -> bool {
        self.breakpoints.contains(&pc)
    }

    /// The mark of the instruction at `pc` for the run loop; plain if a breakpoint is set.
    pub(crate) fn instruction_mark(&self, pc: u32) -> InstructionMark {
        match [0, 1].map(|ops: usize| self.ops[ops][pc as usize].kind) {
            [Mcs51OpKind::PollingLoop, _] => InstructionMark::JumpsToItself,
            [_, Mcs51OpKind::PollingLoop] => InstructionMark::ClosesLoop,
            _ => InstructionMark::Plain,
        }
    }

    /// The polling loop that ends with the jump at `end`.
    pub(crate) fn loop_plan(&self, end: u32) -> Option<&LoopPlan> {
        self.loops.get(&end)
    }

    /// The op of the MOVX at `pc` as if XDATA were a separate memory.
    pub(crate) fn movx(&self, pc: u32) -> Mcs51Op {
        decode(self.bytes_at(pc), pc, XdataBus::Separate)
    }

    /// Three bytes from `pc` on; addresses wrap at the end of memory.
    fn bytes_at(&self, pc: u32) -> [u8; 3] {
        [0, 1, 2].map(|i| self.bytes[(pc as usize + i) % ADDRESS_SPACE])
    }

    /// Fills the ops from `from` up to `to`, exclusive.
    fn predecode(&mut self, from: u32, to: u32) {
        for pc in from..to {
            let op = match pc < self.size {
                true => decode(self.bytes_at(pc), pc, self.xdata_bus),
                false => PredecodedOp { kind: Mcs51OpKind::Illegal, args: [0; 3] },
            };
            self.ops_unmarked[pc as usize] = op;
            let head = loop_closed_by(op, self.bytes_at(pc), pc);
            let jumps_to_itself =
                head == Some(pc) && matches!(op.kind, Mcs51OpKind::Sjmp | Mcs51OpKind::Ajmp | Mcs51OpKind::Ljmp);
            let loop_plan = head
                .filter(|_| !jumps_to_itself)
                .and_then(|head| self.countdown_loop(op, head, pc).or_else(|| self.polling_loop(head, pc)));
            let kinds = match (self.breakpoints.contains(&pc), jumps_to_itself, &loop_plan) {
                (true, ..) => [Mcs51OpKind::Breakpoint; 2],
                (_, true, _) => [Mcs51OpKind::PollingLoop; 2],
                (.., Some(_)) => [op.kind, Mcs51OpKind::PollingLoop],
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

    /// The loop from `head` to the jump at `end`, if an iteration changes only registers of the core and the
    /// watchdog. Then an iteration that leaves the core unchanged repeats, until one of the registers that it
    /// reads changes. `None` for other loops, and for loops that read a volatile register.
    fn polling_loop(&self, head: u32, end: u32) -> Option<LoopPlan> {
        let mut clears_watchdog = false;
        let (mut registers_read, mut starts, mut targets, mut pc) = (Vec::new(), Vec::new(), Vec::new(), head);
        while pc <= end {
            let record = record_instruction(decode(self.bytes_at(pc), pc, self.xdata_bus));
            if record.has_other_effects {
                return None;
            }
            clears_watchdog |= record.clears_watchdog;
            starts.push(pc);
            targets.extend(jump_target(&record, self.bytes_at(pc), pc));
            registers_read.extend(record.registers_read);
            pc += instruction_len(self.bytes_at(pc));
        }
        // A jump into the middle of an instruction would execute other instructions.
        let jumps_into_instruction =
            targets.iter().any(|target| (head..=end).contains(target) && !starts.contains(target));
        let is_complete = starts.last() == Some(&end) && !jumps_into_instruction;
        (is_complete && !registers_read.iter().any(|&addr| volatile_register(addr))).then_some(LoopPlan {
            head,
            registers_read: registers_read.into_iter().map(u16::from).collect(),
            clears_watchdog,
            counter: Vec::new(),
        })
    }

    /// The loop from `head` to the DJNZ `op` at `end`, if there are only NOPs between them.
    fn countdown_loop(&self, op: Mcs51Op, head: u32, end: u32) -> Option<LoopPlan> {
        let counter = match op.kind {
            Mcs51OpKind::DjnzReg => BANKED | u16::from(op.args[0]),
            Mcs51OpKind::DjnzRam => u16::from(op.args[0]),
            _ => return None,
        };
        let only_nops = (head..end).all(|pc| decode(self.bytes_at(pc), pc, self.xdata_bus).kind == Mcs51OpKind::Nop);
        only_nops.then_some(LoopPlan {
            head,
            registers_read: Vec::new(),
            clears_watchdog: false,
            counter: vec![counter],
        })
    }
}

/// Maximum distance in bytes from the jump of a loop back to its head.
const MAX_LOOP_BYTES: u32 = 16;

/// Length of the instruction at the start of some bytes; 1 if there is no row.
fn instruction_len(bytes: [u8; 3]) -> u32 {
    find_row(bytes).map_or(1, |found| found.row.len())
}

/// Decodes the instruction at the start of `bytes`, whose address is `pc`, without marks or breakpoints.
fn decode(bytes: [u8; 3], pc: u32, xdata_bus: XdataBus) -> Mcs51Op {
    let Some(MatchedRow { row, kind, bits }) = find_row(bytes) else {
        return PredecodedOp { kind: Mcs51OpKind::Illegal, args: [0; 3] };
    };
    let len = row.len();
    let mut op = row.predecode(kind, bits, &InstructionLocation { pc, len, next_len: 1, pc_mask: 0xFFFF });
    if row.operands.last().is_some_and(|slot| slot.letter == b't' && !slot.kind.wide) {
        // In the op a relative target is the distance from the next instruction. It follows operands of one
        // byte each.
        let place = row.operands.len() - 1;
        op.args[place] = op.args[place].wrapping_sub((pc + len) as u8);
    }
    let reads = matches!(kind, Mcs51OpKind::MovxADptr | Mcs51OpKind::MovxAInd);
    let writes = matches!(kind, Mcs51OpKind::MovxDptrA | Mcs51OpKind::MovxIndA);
    let needs_slow_path = match xdata_bus {
        XdataBus::Separate => false,
        XdataBus::Unified => writes,
        XdataBus::Absent => reads || writes,
    };
    if needs_slow_path { PredecodedOp { kind: Mcs51OpKind::RewriteCode, ..op } } else { ram_variant(op) }
}

/// The op in the shape for RAM, if all addresses of its operands are in RAM.
fn ram_variant(mut op: Mcs51Op) -> Mcs51Op {
    let row = op.kind as usize;
    let (Some(&Some(shape)), Some(row)) = (SHAPES.get(row), ROWS.get(row)) else { return op };
    let addresses = row.operands.iter().zip(op.args);
    if addresses.clone().any(|(slot, byte)| matches!(slot.kind.name, Dir::NAME | BitAddr::NAME) && byte >= 0x80) {
        return op;
    }
    if row.operands.first().is_some_and(|slot| slot.kind.name == BitAddr::NAME) {
        let bit = RamBit::of_address(op.args[0]);
        op.args = [bit.byte, bit.mask, op.args[1]];
    }
    PredecodedOp { kind: shape, ..op }
}

/// The target of a short backward jump, or of one to itself: the head of the loop that it ends.
fn loop_closed_by(op: Mcs51Op, bytes: [u8; 3], pc: u32) -> Option<u32> {
    let record = record_instruction(op);
    let may_repeat = !record.has_other_effects || matches!(op.kind, Mcs51OpKind::DjnzReg | Mcs51OpKind::DjnzRam);
    jump_target(&record, bytes, pc).filter(|&target| may_repeat && target <= pc && pc - target <= MAX_LOOP_BYTES)
}

/// The target of a jump whose target is known.
fn jump_target(record: &InstructionRecord, bytes: [u8; 3], pc: u32) -> Option<u32> {
    let relative = record.distance.map(|d| (pc + instruction_len(bytes)).wrapping_add_signed(d.into()) & 0xFFFF);
    relative.or(record.target.map(u32::from))
}
