//! Run-time diagnostics of the AVR: suspicious behaviour of a program, tracked only while a probe asks for
//! it.
//!
//! Before an instruction executes on the machine, its body runs on a second machine
//! ([`shadow::ShadowMachine`]) that tracks which bits are unknown: registers and RAM that nobody has written,
//! bits of ports whose pins float. A copy of an unknown value is not reported (saved registers, structures
//! that are copied whole). A use is reported: a branch or skip that depends on an unknown bit, an address
//! computed from one, or a write of one to a register of the chip. So for a port that is read as a whole,
//! only the bits that finally matter count.
//!
//! The tracked state is not part of the machine; a program cannot see it.

mod shadow;
mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use emu_core::cpu::{NEVER, Probe};
use emu_core::image::{AddressedByte, Image};
use emu_core::lint::Lint;

use crate::chips::{AvrPart, RegisterPresence};
use crate::executor::Executor;
use crate::flags::SregFlag;
use crate::isa::{AvrOp, AvrOpKind};
use crate::predecode::CodeMemory;
use crate::recorder::record_instruction;
use crate::soc::{AvrSoc, BaudClock};
use shadow::ShadowMachine;
use value::UnknownBits;

/// Number of cycles after the last write to the settings of a serial port from which on they count as final.
const SETTLE_CYCLES: u64 = 256;

/// Largest accepted error of a baud rate, in thousandths. At 16 MHz the usual rates 57,600 and 115,200 are
/// off by 2.1 %, and every Arduino board uses them (ATmega328P data sheet, tables 19-9 to 19-12).
const BAUD_TOLERANCE: u64 = 25;

/// Symbols with which the linker of avr-libc marks the end of static data. The highest one present counts.
const END_SYMBOLS: [&str; 4] = ["__data_end", "__bss_end", "_end", "__heap_start"];

/// Symbol of the variable in which avr-libc keeps the end of its heap.
const HEAP_SYMBOL: &str = "__brkval";

/// State of the diagnostics. Almost empty until a probe asks for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct LintState {
    program_facts: Arc<ProgramFacts>,
    tracker: Option<Box<LintTracker>>,
}

/// Facts about a program that are known before it runs.
#[derive(Debug, Clone, Default)]
struct ProgramFacts {
    /// End address (exclusive) of static data; 0 if unknown.
    static_data_end: u16,
    /// Data address of the variable that holds the end of the heap.
    heap_end_variable: Option<u16>,
    /// Addresses of the RAM bytes that the image fills.
    initialized_ram: Vec<u16>,
}

impl LintState {
    /// Collects the facts about the program in `image`.
    pub(crate) fn for_program(image: &Image, part: &AvrPart) -> LintState {
        let data = || image.symbols.iter().filter(|symbol| symbol.space == part.chip.ram_space);
        let address = |symbol: &emu_core::image::SymbolAt| u16::try_from(symbol.addr).ok();
        let end = data().filter(|symbol| END_SYMBOLS.contains(&symbol.name.as_str())).filter_map(address).max();
        let heap = data().find(|symbol| symbol.name == HEAP_SYMBOL).and_then(address);
        let filled =
            image.bytes_in(part.chip.ram_space).filter_map(|AddressedByte { addr, .. }| u16::try_from(addr).ok());
        let program_facts = ProgramFacts {
            static_data_end: end.unwrap_or(0),
            heap_end_variable: heap,
            initialized_ram: filled.collect(),
        };
        LintState { program_facts: Arc::new(program_facts), tracker: None }
    }

    /// Discards the tracked state, because the machine was replaced by another one.
    pub(crate) fn forget(&mut self) {
        self.tracker = None;
    }

    /// Records that an edge on INT`int` ended the sleep that the previous instruction started.
    pub(crate) fn edge_woke(&mut self, int: u8) {
        if let Some(tracker) = &mut self.tracker {
            tracker.found.push((tracker.last_pc, Lint::WokenByEdge { int }));
        }
    }

    /// Resets the tracked state: after a reset, the registers of core and chip are known.
    pub(crate) fn reset(&mut self) {
        if let Some(tracker) = &mut self.tracker {
            tracker.flags = [UnknownBits::NONE; 8];
            tracker.stack = StackTracker::START;
            tracker.pending_bauds = [(NEVER, 0); 2];
            tracker.check_vectors = false;
        }
    }
}

/// Tracked state, kept while a probe asks for diagnostics. RAM that a tool writes from outside stays unknown.
#[derive(Debug, Clone)]
struct LintTracker {
    part: &'static AvrPart,
    presence: Arc<RegisterPresence>,
    program_facts: Arc<ProgramFacts>,
    /// Unknown bits of the registers, of the flags, and of RAM from its first byte on.
    regs: [UnknownBits; 32],
    flags: [UnknownBits; 8],
    ram: Vec<UnknownBits>,
    /// Bit mask of the registers that hold a value computed from the stack pointer.
    from_sp: u32,
    /// Registers and RAM cells already reported.
    reported_addresses: BTreeSet<u16>,
    /// Pins already reported, one mask per port.
    reported_pins: [u8; PORT_COUNT],
    stack: StackTracker,
    /// Instructions that have written to a reserved address, each with the first such address.
    reserved_writes: BTreeMap<u32, u16>,
    /// Baud rates already reported; then, per port, the cycle from which its settings count as final, and the
    /// instruction that made them.
    reported_bauds: [u32; 2],
    pending_bauds: [(u64, u32); 2],
    /// True if interrupt enables may have changed since the last check; then the vectors already reported.
    check_vectors: bool,
    reported_vectors: u64,
    /// Program word address of the previous instruction.
    last_pc: u32,
    /// Program word address of the current instruction; then the findings, each with its instruction.
    pc: u32,
    found: Vec<(u32, Lint)>,
}

/// Largest number of ports on a chip.
const PORT_COUNT: usize = 8;

/// Tracks how far the stack may grow.
#[derive(Debug, Clone, Copy)]
struct StackTracker {
    /// True if the program has set SP to a value that was not computed from SP, and has pushed nothing since.
    was_set: bool,
    /// True if SP was set into static data, as for the stack of a task: then only the start of RAM limits the
    /// stack.
    is_task_stack: bool,
    /// Value of SP before it was moved to make a stack frame that has not been used yet.
    moved_from: Option<u16>,
    /// True if the stack has overflowed and this was reported.
    overflow_reported: bool,
}

impl StackTracker {
    const START: StackTracker =
        StackTracker { was_set: true, is_task_stack: false, moved_from: None, overflow_reported: false };
}

impl LintTracker {
    /// Returns the state for a machine that has executed nothing so far (`is_fresh`): registers and RAM are
    /// unknown. Otherwise everything counts as written.
    fn new(part: &'static AvrPart, program_facts: &Arc<ProgramFacts>, is_fresh: bool) -> Box<LintTracker> {
        let first = part.chip.ram_start;
        let initial = |addr| if is_fresh { UnknownBits::at(addr, 0xFF) } else { UnknownBits::NONE };
        let mut tracker = LintTracker {
            part,
            presence: Arc::new(RegisterPresence::new(part)),
            program_facts: Arc::clone(program_facts),
            regs: std::array::from_fn(|n| initial(n as u16)),
            flags: [UnknownBits::NONE; 8],
            ram: (first..first + part.chip.ram_len).map(initial).collect(),
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
        for &addr in &program_facts.initialized_ram {
            tracker.mark_known(addr);
        }
        Box::new(tracker)
    }

    fn add_finding(&mut self, lint: Lint) {
        self.found.push((self.pc, lint));
    }

    /// Returns the unknown bits of a RAM byte or register, by its data address.
    fn ram_doubt(&mut self, addr: u16) -> Option<&mut UnknownBits> {
        match addr {
            0..32 => self.regs.get_mut(usize::from(addr)),
            _ => self.ram.get_mut(usize::from(addr.wrapping_sub(self.part.chip.ram_start))),
        }
    }

    /// Marks the byte at a data address as known.
    fn mark_known(&mut self, addr: u16) {
        if let Some(cell) = self.ram_doubt(addr) {
            *cell = UnknownBits::NONE;
        }
    }

    /// Marks the RAM bytes from address `from` to `to`, inclusive, as unknown.
    fn forget(&mut self, from: u16, to: u16) {
        for addr in from.max(self.part.chip.ram_start)..=to {
            let Some(cell) = self.ram_doubt(addr) else { return };
            *cell = UnknownBits::at(addr, 0xFF);
            self.reported_addresses.remove(&addr);
        }
    }

    /// Reports a use of unknown bits, once per address or pin.
    fn report_use(&mut self, doubt: UnknownBits) {
        // After a reported stack overflow, overwritten data gives no new information.
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
            self.add_finding(Lint::UnwrittenUse { space: self.part.chip.ram_space, addr });
        }
    }

    /// Handles an instruction that writes SP, whose value is `sp`. `frame` is true if the new value was
    /// computed from SP.
    fn move_stack(&mut self, sp: u16, frame: bool, heap: u16) {
        if frame {
            self.check_stack_pointer(sp, heap);
            self.stack.moved_from.get_or_insert(sp);
        } else {
            (self.stack.was_set, self.stack.moved_from) = (true, None);
        }
    }

    /// Returns the first address of RAM, and the end address (exclusive) of static data and heap.
    fn stack_bounds(&self, heap: u16) -> (u16, u16) {
        let (first, behind) = (self.part.chip.ram_start, self.ram_end());
        let end = if (first..behind).contains(&heap) {
            self.program_facts.static_data_end.max(heap)
        } else {
            self.program_facts.static_data_end
        };
        (first, end.max(first))
    }

    /// Returns the end address (exclusive) of RAM.
    const fn ram_end(&self) -> u16 {
        self.part.chip.ram_start + self.part.chip.ram_len
    }

    /// Decides, at the first use of a newly set stack, whether it is the stack of a task.
    fn check_stack_pointer(&mut self, addr: u16, heap: u16) {
        let (first, end) = self.stack_bounds(heap);
        if std::mem::take(&mut self.stack.was_set) {
            self.stack.is_task_stack = (first..end).contains(&addr);
        }
    }

    /// Checks a byte pushed at `addr`, or a frame that extends down to it. `heap` is the value of avr-libc's
    /// variable for the end of the heap.
    fn check_push(&mut self, addr: u16, heap: u16) {
        self.check_stack_pointer(addr, heap);
        let (first, end) = self.stack_bounds(heap);
        let limit = if self.stack.is_task_stack { first } else { end };
        // A stack that runs past the start of RAM wraps to the end of the address space.
        let over = addr < limit || self.stack.overflow_reported && addr >= self.ram_end();
        if over && !self.stack.overflow_reported {
            self.add_finding(Lint::StackCollision { limit });
        }
        self.stack.overflow_reported = over;
    }

    /// Checks the baud rates whose settings have been unchanged for [`SETTLE_CYCLES`], on ports with the
    /// receiver on.
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

    /// Compares the baud rate of a serial port with the usual rates.
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

    /// Reports enabled interrupts without a handler.
    fn check_vectors(&mut self, soc: &AvrSoc, code: &CodeMemory, now: u64) {
        self.check_vectors = false;
        let enabled = soc.enabled(now) & !self.reported_vectors;
        for vector in (1..64u8).filter(|vector| enabled >> vector & 1 == 1) {
            if !has_handler(soc, code, soc.vector_base() + u32::from(vector) * self.part.chip.words_per_vector) {
                self.reported_vectors |= 1 << vector;
                self.found.push((self.last_pc, Lint::EnabledWithoutHandler { vector }));
            }
        }
    }
}

/// Returns the target of the instruction at `pc`, if it is a jump.
fn jump_target(code: &CodeMemory, pc: u32) -> Option<u32> {
    let op = code.ops_unmarked.get(pc as usize).filter(|op| matches!(op.kind, AvrOpKind::Jmp | AvrOpKind::Rjmp))?;
    record_instruction(*op, true).target.map(|target| target & code.mask())
}

/// Reports whether the vector at the program word `at` has a handler. Without a handler are: an erased
/// vector, a jump to the program's start, and a jump to such a jump, which avr-libc generates for unused
/// vectors.
fn has_handler(soc: &AvrSoc, code: &CodeMemory, at: u32) -> bool {
    let at = at & code.mask();
    if code.ops_unmarked.get(at as usize).is_none_or(|op| op.kind == AvrOpKind::Illegal) {
        return false;
    }
    let begins = |pc: u32| pc == soc.vector_base() || pc == soc.reset_vector() || pc == 0;
    jump_target(code, at)
        .is_none_or(|target| !begins(target) && jump_target(code, target).is_none_or(|target| !begins(target)))
}

impl<P: Probe> Executor<'_, P> {
    /// Checks `op`, the instruction at the program counter, before it executes. Kinds without a body are
    /// checked when they execute.
    #[inline(never)]
    pub(crate) fn lint(&mut self, op: &AvrOp) {
        if matches!(op.kind, AvrOpKind::Illegal | AvrOpKind::Breakpoint | AvrOpKind::PollingLoop) {
            return;
        }
        let (now, pc) = (self.core.clock.now(), self.core.pc & self.code.mask());
        let mut tracker = self.take_tracker();
        tracker.pc = pc;
        tracker.check_bauds(self.bus, now);
        if tracker.check_vectors && self.core.flags.get(SregFlag::I) {
            tracker.check_vectors(self.bus, self.code, now);
        }
        ShadowMachine::new(&self.core, self.data, self.bus, &mut tracker).execute_op(*op);
        tracker.last_pc = pc;
        self.report_findings(tracker, now);
    }

    /// Checks the interrupt whose vector is the program word `at` before it is entered.
    #[inline(never)]
    pub(crate) fn lint_interrupt(&mut self, at: u32) {
        let now = self.core.clock.now();
        let mut tracker = self.take_tracker();
        tracker.pc = at;
        if !has_handler(self.bus, self.code, at) {
            let vector = at.wrapping_sub(self.bus.vector_base()) / tracker.part.chip.words_per_vector.max(1);
            tracker.add_finding(Lint::TakenWithoutHandler { vector: vector as u8 });
        }
        ShadowMachine::new(&self.core, self.data, self.bus, &mut tracker).interrupt();
        self.report_findings(tracker, now);
    }

    fn take_tracker(&mut self) -> Box<LintTracker> {
        let is_fresh = self.core.clock.instructions() == 0;
        let part = self.bus.part();
        let lints = &mut self.bus.lints;
        lints.tracker.take().unwrap_or_else(|| LintTracker::new(part, &lints.program_facts, is_fresh))
    }

    /// Reports the findings to the probe, with the first cycle of the instruction.
    fn report_findings(&mut self, mut tracker: Box<LintTracker>, at: u64) {
        for (pc, lint) in tracker.found.drain(..) {
            self.probe.on_lint(at, pc, lint);
        }
        self.bus.lints.tracker = Some(tracker);
    }
}
