//! The diagnostics of the family: no part of the machine that a program could see, and kept only while a probe asks for them.
//!
//! Before an instruction its body runs on a machine of its own ([`shadow::ShadowMachine`]) that computes with what is known and what is
//! not: registers and RAM that nobody has written, bits of ports whose pins float. A copy of what is unknown is no use of it
//! (registers that are saved, structures that are copied whole); a branch or a skip that depends on it is, an address made of it,
//! and a register of the chip that gets it. So a port that is read whole counts only for the bits that matter in the end.

mod shadow;
mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use emu_core::cpu::{NEVER, Probe};
use emu_core::image::Image;
use emu_core::lint::Lint;

use crate::chips::AvrPart;
use crate::executor::Executor;
use crate::flags::SregFlag;
use crate::isa::{AvrOp, Kind};
use crate::predecode::CodeMemory;
use crate::recorder::record_instruction;
use crate::soc::{AvrSoc, BaudClock};
use shadow::ShadowMachine;
use value::UnknownBits;

/// Cycles after the last write of a port's settings from which on they count as what the program wants.
const SETTLE_CYCLES: u64 = 256;

/// Greatest error of a baud rate that is accepted, in thousandths. At 16 MHz the usual rates 57,600 and 115,200 are 2.1 %
/// off, and every Arduino board runs so (ATmega328P data sheet, tables 19-9 to 19-12).
const BAUD_TOLERANCE: u64 = 25;

/// Where the linker of avr-libc ends static data: the last of these that there is.
const END_SYMBOLS: [&str; 4] = ["__data_end", "__bss_end", "_end", "__heap_start"];

/// Where avr-libc keeps the end of its heap.
const HEAP_SYMBOL: &str = "__brkval";

/// What the chip keeps for diagnostics. Next to nothing until a probe asks for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct LintState {
    program_facts: Arc<ProgramFacts>,
    tracker: Option<Box<LintTracker>>,
}

/// What is known of a program before it runs.
#[derive(Debug, Clone, Default)]
struct ProgramFacts {
    /// The data address behind static data; 0 where nobody says.
    static_data_end: u16,
    /// Where the end of the heap is kept.
    heap_end_variable: Option<u16>,
    /// The bytes of RAM that the image fills.
    initialized_ram: Vec<u16>,
}

impl LintState {
    /// For a program.
    pub(crate) fn for_program(image: &Image, part: &AvrPart) -> LintState {
        let data = || image.symbols.iter().filter(|symbol| symbol.space == part.chip.ram_space);
        let address = |symbol: &emu_core::image::SymbolAt| u16::try_from(symbol.addr).ok();
        let end = data().filter(|symbol| END_SYMBOLS.contains(&symbol.name.as_str())).filter_map(address).max();
        let heap = data().find(|symbol| symbol.name == HEAP_SYMBOL).and_then(address);
        let filled = image.bytes_in(part.chip.ram_space).filter_map(|(addr, _)| u16::try_from(addr).ok());
        let ground = ProgramFacts {
            static_data_end: end.unwrap_or(0),
            heap_end_variable: heap,
            initialized_ram: filled.collect(),
        };
        LintState { program_facts: Arc::new(ground), tracker: None }
    }

    /// The machine is another one: it is looked at anew.
    pub(crate) fn forget(&mut self) {
        self.tracker = None;
    }

    /// An edge on INT`int` has ended the sleep of the instruction before.
    pub(crate) fn edge_woke(&mut self, int: u8) {
        if let Some(live) = &mut self.tracker {
            live.found.push((live.last_pc, Lint::EdgeWoke { int }));
        }
    }

    /// The chip is reset: what registers of the core and of the chip hold is known.
    pub(crate) fn reset(&mut self) {
        if let Some(live) = &mut self.tracker {
            live.flags = [UnknownBits::NONE; 8];
            live.stack = StackTracker::START;
            live.pending_bauds = [(NEVER, 0); 2];
            live.check_vectors = false;
        }
    }
}

/// Kept while a probe asks for diagnostics. What a tool pokes into RAM stays as unknown as it was.
#[derive(Debug, Clone)]
struct LintTracker {
    part: &'static AvrPart,
    ground: Arc<ProgramFacts>,
    /// What is not known of the registers, of the flags, and of RAM from its first byte on.
    regs: [UnknownBits; 32],
    flags: [UnknownBits; 8],
    ram: Vec<UnknownBits>,
    /// Registers that hold what was worked out from the stack pointer, a bit each.
    from_sp: u32,
    /// Registers and cells that were told of.
    reported_addresses: BTreeSet<u16>,
    /// Pins that were told of.
    reported_pins: [u8; PORT_COUNT],
    stack: StackTracker,
    /// Instructions that have written where nothing is, each with the first such address.
    reserved_writes: BTreeMap<u32, u16>,
    /// Baud rates that were told of, and from when on settings count, with the instruction that made them.
    reported_bauds: [u32; 2],
    pending_bauds: [(u64, u32); 2],
    /// Enables of interrupts may have changed since they were looked at; those that were told of.
    check_vectors: bool,
    reported_vectors: u64,
    /// The instruction before.
    last_pc: u32,
    /// The running instruction, and what was found: at which, and what.
    pc: u32,
    found: Vec<(u32, Lint)>,
}

/// Most ports of a chip.
const PORT_COUNT: usize = 8;

/// Where the stack may grow.
#[derive(Debug, Clone, Copy)]
struct StackTracker {
    /// The program has put it somewhere by a number that did not come from where it was; nothing has been pushed since.
    was_set: bool,
    /// It was placed where static data lie, as the stack of a task does: only the end of RAM bounds it.
    is_task_stack: bool,
    /// Where the stack pointer was before it was moved to make a frame that nobody has used so far.
    moved_from: Option<u16>,
    /// It is where it should not be, and that was told.
    overflow_reported: bool,
}

impl StackTracker {
    const START: StackTracker =
        StackTracker { was_set: true, is_task_stack: false, moved_from: None, overflow_reported: false };
}

impl LintTracker {
    /// For a machine that has executed nothing so far if `fresh`; otherwise nobody knows any more what was written.
    fn new(part: &'static AvrPart, ground: &Arc<ProgramFacts>, fresh: bool) -> Box<LintTracker> {
        let first = part.chip.ram_start;
        let whole = |addr| if fresh { UnknownBits::at(addr, 0xFF) } else { UnknownBits::NONE };
        let mut live = LintTracker {
            part,
            ground: Arc::clone(ground),
            regs: std::array::from_fn(|n| whole(n as u16)),
            flags: [UnknownBits::NONE; 8],
            ram: (first..first + part.chip.ram_len).map(whole).collect(),
            from_sp: 0,
            reported_addresses: BTreeSet::new(),
            reported_pins: [0; PORT_COUNT],
            stack: StackTracker::START,
            reserved_writes: BTreeMap::new(),
            reported_bauds: [0; 2],
            pending_bauds: [(NEVER, 0); 2],
            check_vectors: false,
            reported_vectors: 0,
            last_pc: 0,
            pc: 0,
            found: Vec::new(),
        };
        for &addr in &ground.initialized_ram {
            live.mark_known(addr);
        }
        Box::new(live)
    }

    fn add_finding(&mut self, lint: Lint) {
        self.found.push((self.pc, lint));
    }

    /// A byte of RAM or a register, by its data address.
    fn ram_doubt(&mut self, addr: u16) -> Option<&mut UnknownBits> {
        match addr {
            0..32 => self.regs.get_mut(usize::from(addr)),
            _ => self.ram.get_mut(usize::from(addr.wrapping_sub(self.part.chip.ram_start))),
        }
    }

    /// The byte at a data address is known from now on.
    fn mark_known(&mut self, addr: u16) {
        if let Some(cell) = self.ram_doubt(addr) {
            *cell = UnknownBits::NONE;
        }
    }

    /// Nothing is known any more of the bytes of RAM from one address up to another.
    fn forget(&mut self, from: u16, to: u16) {
        for addr in from.max(self.part.chip.ram_start)..=to {
            let Some(cell) = self.ram_doubt(addr) else { return };
            *cell = UnknownBits::at(addr, 0xFF);
            self.reported_addresses.remove(&addr);
        }
    }

    /// What is unknown makes a difference now.
    fn report_use(&mut self, doubt: UnknownBits) {
        // What a stack has overwritten that was told of says nothing new.
        if doubt.bits == 0 || self.stack.overflow_reported {
            return;
        }
        let addr = doubt.from;
        if let Some(port) = self.part.input_port(addr) {
            let bits = doubt.source & !self.reported_pins[port % PORT_COUNT];
            if bits != 0 {
                self.reported_pins[port % PORT_COUNT] |= bits;
                self.add_finding(Lint::FloatingRead { port: addr, bits });
            }
        } else if self.reported_addresses.insert(addr) {
            self.add_finding(Lint::UnknownUse { space: self.part.chip.ram_space, addr });
        }
    }

    /// The stack pointer is about to be moved by hand from `sp` on, by a number that comes from where it was if `frame`.
    fn move_stack(&mut self, sp: u16, frame: bool, heap: u16) {
        if frame {
            self.check_stack_pointer(sp, heap);
            self.stack.moved_from.get_or_insert(sp);
        } else {
            (self.stack.was_set, self.stack.moved_from) = (true, None);
        }
    }

    /// The first address of RAM, and the one behind static data and the heap.
    fn stack_bounds(&self, heap: u16) -> (u16, u16) {
        let (first, behind) = (self.part.chip.ram_start, self.ram_end());
        let end = if (first..behind).contains(&heap) {
            self.ground.static_data_end.max(heap)
        } else {
            self.ground.static_data_end
        };
        (first, end.max(first))
    }

    /// The address behind RAM.
    const fn ram_end(&self) -> u16 {
        self.part.chip.ram_start + self.part.chip.ram_len
    }

    /// A stack that was placed begins to be used at `addr`.
    fn check_stack_pointer(&mut self, addr: u16, heap: u16) {
        let (first, end) = self.stack_bounds(heap);
        if std::mem::take(&mut self.stack.was_set) {
            self.stack.is_task_stack = (first..end).contains(&addr);
        }
    }

    /// A byte is pushed at `addr`, or a frame reaches down to it; `heap` is what stands where avr-libc keeps the end of its heap.
    fn check_push(&mut self, addr: u16, heap: u16) {
        self.check_stack_pointer(addr, heap);
        let (first, end) = self.stack_bounds(heap);
        let limit = if self.stack.is_task_stack { first } else { end };
        // A stack that has run out of RAM at its beginning goes round to the end of the address space.
        let over = addr < limit || self.stack.overflow_reported && addr >= self.ram_end();
        if over && !self.stack.overflow_reported {
            self.add_finding(Lint::StackMeets { limit });
        }
        self.stack.overflow_reported = over;
    }

    /// Settings of serial ports that have stood long enough, with the receiver on.
    fn check_bauds(&mut self, soc: &AvrSoc, now: u64) {
        for n in 0..2 {
            let (at, pc) = self.pending_bauds[n];
            if at <= now {
                self.pending_bauds[n].0 = NEVER;
                if soc.listens_at(n, now) {
                    self.check_baud(soc, n, now, pc);
                }
            }
        }
    }

    /// Compares the baud rate of a serial port with usual ones.
    fn check_baud(&mut self, soc: &AvrSoc, n: usize, now: u64, pc: u32) {
        let Some(BaudClock { hz, clocks_per_bit: clocks }) = soc.baud(n, now) else { return };
        let baud = u32::try_from((hz + clocks / 2) / clocks).unwrap_or(u32::MAX);
        let usual = u64::from(emu_core::lint::nearest_standard_baud(baud));
        let off = hz.abs_diff(usual * clocks);
        if off * 1_000 > BAUD_TOLERANCE * usual * clocks && std::mem::replace(&mut self.reported_bauds[n], baud) != baud
        {
            self.found.push((pc, Lint::Baud { uart: n as u8, baud }));
        }
    }

    /// Interrupts that can come now and that nobody serves.
    fn check_vectors(&mut self, soc: &AvrSoc, code: &CodeMemory, now: u64) {
        self.check_vectors = false;
        let enabled = soc.enabled(now) & !self.reported_vectors;
        for vector in (1..64u8).filter(|vector| enabled >> vector & 1 == 1) {
            if !has_handler(soc, code, soc.vector_base() + u32::from(vector) * self.part.chip.words_per_vector) {
                self.reported_vectors |= 1 << vector;
                self.found.push((self.last_pc, Lint::Unhandled { vector }));
            }
        }
    }
}

/// Where the instruction at `pc` jumps to, if it is a jump.
fn jump_target(code: &CodeMemory, pc: u32) -> Option<u32> {
    let op = code.ops_unmarked.get(pc as usize).filter(|op| matches!(op.kind, Kind::Jmp | Kind::Rjmp))?;
    record_instruction(*op, true).target.map(|target| target & code.mask())
}

/// Something serves the vector at the program word `at`: not what is erased, and neither a jump to the beginning nor one to such
/// a jump, which is what avr-libc puts where a program has no handler.
fn has_handler(soc: &AvrSoc, code: &CodeMemory, at: u32) -> bool {
    let at = at & code.mask();
    if code.ops_unmarked.get(at as usize).is_none_or(|op| op.kind == Kind::Illegal) {
        return false;
    }
    let begins = |pc: u32| pc == soc.vector_base() || pc == soc.reset_vector() || pc == 0;
    jump_target(code, at)
        .is_none_or(|target| !begins(target) && jump_target(code, target).is_none_or(|target| !begins(target)))
}

impl<P: Probe> Executor<'_, P> {
    /// Looks at what `op`, the instruction at the program counter, is about to do. Kinds without a body are looked at when they
    /// are executed.
    #[inline(never)]
    pub(crate) fn lint(&mut self, op: &AvrOp) {
        if matches!(op.kind, Kind::Illegal | Kind::Breakpoint | Kind::PollingLoop) {
            return;
        }
        let (now, pc) = (self.core.clock.now(), self.core.pc & self.code.mask());
        let mut live = self.take_tracker();
        live.pc = pc;
        live.check_bauds(self.bus, now);
        if live.check_vectors && self.core.flags.get(SregFlag::I) {
            live.check_vectors(self.bus, self.code, now);
        }
        ShadowMachine::new(&self.core, self.data, self.bus, &mut live).execute_op(*op);
        live.last_pc = pc;
        self.report_findings(live, now);
    }

    /// The interrupt whose vector is the program word `at` is about to be entered.
    #[inline(never)]
    pub(crate) fn lint_interrupt(&mut self, at: u32) {
        let now = self.core.clock.now();
        let mut live = self.take_tracker();
        live.pc = at;
        if !has_handler(self.bus, self.code, at) {
            let vector = at.wrapping_sub(self.bus.vector_base()) / live.part.chip.words_per_vector.max(1);
            live.add_finding(Lint::NoHandler { vector: vector as u8 });
        }
        ShadowMachine::new(&self.core, self.data, self.bus, &mut live).interrupt();
        self.report_findings(live, now);
    }

    fn take_tracker(&mut self) -> Box<LintTracker> {
        let fresh = self.core.clock.instructions() == 0;
        let part = self.bus.part();
        let lints = &mut self.bus.lints;
        lints.tracker.take().unwrap_or_else(|| LintTracker::new(part, &lints.program_facts, fresh))
    }

    /// Tells the probe what was found, as of the first cycle of the instruction.
    fn report_findings(&mut self, mut live: Box<LintTracker>, at: u64) {
        for (pc, lint) in live.found.drain(..) {
            self.probe.on_lint(at, pc, lint);
        }
        self.bus.lints.tracker = Some(live);
    }
}
