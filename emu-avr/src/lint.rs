//! The diagnostics of the family: no part of the machine that a program could see, and kept only while a probe asks for them.
//!
//! Before an instruction its body runs on a machine of its own ([`shadow::Shadow`]) that computes with what is known and what is
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

use crate::chips::Part;
use crate::flags::Flag;
use crate::isa::{AvrOp, Kind};
use crate::predecode::Code;
use crate::record::record;
use crate::soc::Soc;
use crate::turn::Turn;
use shadow::Shadow;
use value::Doubt;

/// Cycles after the last write of a port's settings from which on they count as what the program wants.
const SETTLED: u64 = 256;

/// Greatest error of a baud rate that is accepted, in thousandths. At 16 MHz the usual rates 57,600 and 115,200 are 2.1 %
/// off, and every Arduino board runs so (ATmega328P data sheet, tables 19-9 to 19-12).
const BAUD_TOLERANCE: u64 = 25;

/// Where the linker of avr-libc ends static data: the last of these that there is.
const ENDS: [&str; 4] = ["__data_end", "__bss_end", "_end", "__heap_start"];

/// Where avr-libc keeps the end of its heap.
const HEAP: &str = "__brkval";

/// What the chip keeps for diagnostics. Next to nothing until a probe asks for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lints {
    ground: Arc<Ground>,
    live: Option<Box<Live>>,
}

/// What is known of a program before it runs.
#[derive(Debug, Clone, Default)]
struct Ground {
    /// The data address behind static data; 0 where nobody says.
    end: u16,
    /// Where the end of the heap is kept.
    heap: Option<u16>,
    /// The bytes of RAM that the image fills.
    filled: Vec<u16>,
}

impl Lints {
    /// For a program.
    pub(crate) fn of(image: &Image, part: &Part) -> Lints {
        let data = || image.symbols.iter().filter(|symbol| symbol.space == part.chip.ram);
        let address = |symbol: &emu_core::image::SymbolAt| u16::try_from(symbol.addr).ok();
        let end = data().filter(|symbol| ENDS.contains(&symbol.name.as_str())).filter_map(address).max();
        let heap = data().find(|symbol| symbol.name == HEAP).and_then(address);
        let filled = image.bytes_in(part.chip.ram).filter_map(|(addr, _)| u16::try_from(addr).ok());
        let ground = Ground { end: end.unwrap_or(0), heap, filled: filled.collect() };
        Lints { ground: Arc::new(ground), live: None }
    }

    /// The machine is another one: it is looked at anew.
    pub(crate) fn forget(&mut self) {
        self.live = None;
    }

    /// An edge on INT`int` has ended the sleep of the instruction before.
    pub(crate) fn edge_woke(&mut self, int: u8) {
        if let Some(live) = &mut self.live {
            live.found.push((live.last, Lint::EdgeWoke { int }));
        }
    }

    /// The chip is reset: what registers of the core and of the chip hold is known.
    pub(crate) fn reset(&mut self) {
        if let Some(live) = &mut self.live {
            live.flags = [Doubt::NONE; 8];
            live.stack = Stack::START;
            live.settled = [(NEVER, 0); 2];
            live.look = false;
        }
    }
}

/// Kept while a probe asks for diagnostics. What a tool pokes into RAM stays as unknown as it was.
#[derive(Debug, Clone)]
struct Live {
    part: &'static Part,
    ground: Arc<Ground>,
    /// What is not known of the registers, of the flags, and of RAM from its first byte on.
    regs: [Doubt; 32],
    flags: [Doubt; 8],
    ram: Vec<Doubt>,
    /// Registers that hold what was worked out from the stack pointer, a bit each.
    from_sp: u32,
    /// Registers and cells that were told of.
    told: BTreeSet<u16>,
    /// Pins that were told of.
    told_pins: [u8; PORTS],
    stack: Stack,
    /// Instructions that have written where nothing is, each with the first such address.
    wild: BTreeMap<u32, u16>,
    /// Baud rates that were told of, and from when on settings count, with the instruction that made them.
    told_bauds: [u32; 2],
    settled: [(u64, u32); 2],
    /// Enables of interrupts may have changed since they were looked at; those that were told of.
    look: bool,
    told_vectors: u64,
    /// The instruction before.
    last: u32,
    /// The running instruction, and what was found: at which, and what.
    pc: u32,
    found: Vec<(u32, Lint)>,
}

/// Most ports of a chip.
const PORTS: usize = 8;

/// Where the stack may grow.
#[derive(Debug, Clone, Copy)]
struct Stack {
    /// The program has put it somewhere by a number that did not come from where it was; nothing has been pushed since.
    placed: bool,
    /// It was placed where static data lie, as the stack of a task does: only the end of RAM bounds it.
    own: bool,
    /// Where the stack pointer was before it was moved to make a frame that nobody has used so far.
    moved_from: Option<u16>,
    /// It is where it should not be, and that was told.
    over: bool,
}

impl Stack {
    const START: Stack = Stack { placed: true, own: false, moved_from: None, over: false };
}

impl Live {
    /// For a machine that has executed nothing so far if `fresh`; otherwise nobody knows any more what was written.
    fn new(part: &'static Part, ground: &Arc<Ground>, fresh: bool) -> Box<Live> {
        let first = part.chip.ram_start;
        let whole = |addr| if fresh { Doubt::at(addr, 0xFF) } else { Doubt::NONE };
        let mut live = Live {
            part,
            ground: Arc::clone(ground),
            regs: std::array::from_fn(|n| whole(n as u16)),
            flags: [Doubt::NONE; 8],
            ram: (first..first + part.chip.ram_len).map(whole).collect(),
            from_sp: 0,
            told: BTreeSet::new(),
            told_pins: [0; PORTS],
            stack: Stack::START,
            wild: BTreeMap::new(),
            told_bauds: [0; 2],
            settled: [(NEVER, 0); 2],
            look: false,
            told_vectors: 0,
            last: 0,
            pc: 0,
            found: Vec::new(),
        };
        for &addr in &ground.filled {
            live.know(addr);
        }
        Box::new(live)
    }

    fn find(&mut self, lint: Lint) {
        self.found.push((self.pc, lint));
    }

    /// A byte of RAM or a register, by its data address.
    fn cell(&mut self, addr: u16) -> Option<&mut Doubt> {
        match addr {
            0..32 => self.regs.get_mut(usize::from(addr)),
            _ => self.ram.get_mut(usize::from(addr.wrapping_sub(self.part.chip.ram_start))),
        }
    }

    /// The byte at a data address is known from now on.
    fn know(&mut self, addr: u16) {
        if let Some(cell) = self.cell(addr) {
            *cell = Doubt::NONE;
        }
    }

    /// Nothing is known any more of the bytes of RAM from one address up to another.
    fn forget(&mut self, from: u16, to: u16) {
        for addr in from.max(self.part.chip.ram_start)..=to {
            let Some(cell) = self.cell(addr) else { return };
            *cell = Doubt::at(addr, 0xFF);
            self.told.remove(&addr);
        }
    }

    /// What is unknown makes a difference now.
    fn used(&mut self, doubt: Doubt) {
        // What a stack has overwritten that was told of says nothing new.
        if doubt.bits == 0 || self.stack.over {
            return;
        }
        let addr = doubt.from;
        if let Some(port) = self.part.input_port(addr) {
            let bits = doubt.source & !self.told_pins[port % PORTS];
            if bits != 0 {
                self.told_pins[port % PORTS] |= bits;
                self.find(Lint::FloatingRead { port: addr, bits });
            }
        } else if self.told.insert(addr) {
            self.find(Lint::UnknownUse { space: self.part.chip.ram, addr });
        }
    }

    /// The stack pointer is about to be moved by hand from `sp` on, by a number that comes from where it was if `frame`.
    fn move_stack(&mut self, sp: u16, frame: bool, heap: u16) {
        if frame {
            self.settle(sp, heap);
            self.stack.moved_from.get_or_insert(sp);
        } else {
            (self.stack.placed, self.stack.moved_from) = (true, None);
        }
    }

    /// The first address of RAM, and the one behind static data and the heap.
    fn bounds(&self, heap: u16) -> (u16, u16) {
        let (first, behind) = (self.part.chip.ram_start, self.behind());
        let end = if (first..behind).contains(&heap) { self.ground.end.max(heap) } else { self.ground.end };
        (first, end.max(first))
    }

    /// The address behind RAM.
    const fn behind(&self) -> u16 {
        self.part.chip.ram_start + self.part.chip.ram_len
    }

    /// A stack that was placed begins to be used at `addr`.
    fn settle(&mut self, addr: u16, heap: u16) {
        let (first, end) = self.bounds(heap);
        if std::mem::take(&mut self.stack.placed) {
            self.stack.own = (first..end).contains(&addr);
        }
    }

    /// A byte is pushed at `addr`, or a frame reaches down to it; `heap` is what stands where avr-libc keeps the end of its heap.
    fn stacked(&mut self, addr: u16, heap: u16) {
        self.settle(addr, heap);
        let (first, end) = self.bounds(heap);
        let limit = if self.stack.own { first } else { end };
        // A stack that has run out of RAM at its beginning goes round to the end of the address space.
        let over = addr < limit || self.stack.over && addr >= self.behind();
        if over && !self.stack.over {
            self.find(Lint::StackMeets { limit });
        }
        self.stack.over = over;
    }

    /// Settings of serial ports that have stood long enough, with the receiver on.
    fn look_at_bauds(&mut self, soc: &Soc, now: u64) {
        for n in 0..2 {
            let (at, pc) = self.settled[n];
            if at <= now {
                self.settled[n].0 = NEVER;
                if soc.listens_at(n, now) {
                    self.baud(soc, n, now, pc);
                }
            }
        }
    }

    /// Compares the baud rate of a serial port with usual ones.
    fn baud(&mut self, soc: &Soc, n: usize, now: u64, pc: u32) {
        let Some((hz, clocks)) = soc.baud(n, now) else { return };
        let baud = u32::try_from((hz + clocks / 2) / clocks).unwrap_or(u32::MAX);
        let usual = u64::from(emu_core::lint::usual_baud(baud));
        let off = hz.abs_diff(usual * clocks);
        if off * 1_000 > BAUD_TOLERANCE * usual * clocks && std::mem::replace(&mut self.told_bauds[n], baud) != baud {
            self.found.push((pc, Lint::Baud { uart: n as u8, baud }));
        }
    }

    /// Interrupts that can come now and that nobody serves.
    fn look_at_vectors(&mut self, soc: &Soc, code: &Code, now: u64) {
        self.look = false;
        let enabled = soc.enabled(now) & !self.told_vectors;
        for vector in (1..64u8).filter(|vector| enabled >> vector & 1 == 1) {
            if !handled(soc, code, soc.vectors() + u32::from(vector) * self.part.chip.vector_words) {
                self.told_vectors |= 1 << vector;
                self.found.push((self.last, Lint::Unhandled { vector }));
            }
        }
    }
}

/// Where the instruction at `pc` jumps to, if it is a jump.
fn jump(code: &Code, pc: u32) -> Option<u32> {
    let op = code.plain.get(pc as usize).filter(|op| matches!(op.kind, Kind::Jmp | Kind::Rjmp))?;
    record(*op, true).target.map(|target| target & code.mask())
}

/// Something serves the vector at the program word `at`: not what is erased, and neither a jump to the beginning nor one to such
/// a jump, which is what avr-libc puts where a program has no handler.
fn handled(soc: &Soc, code: &Code, at: u32) -> bool {
    let at = at & code.mask();
    if code.plain.get(at as usize).is_none_or(|op| op.kind == Kind::Illegal) {
        return false;
    }
    let begins = |pc: u32| pc == soc.vectors() || pc == soc.reset_vector() || pc == 0;
    jump(code, at).is_none_or(|target| !begins(target) && jump(code, target).is_none_or(|target| !begins(target)))
}

impl<P: Probe> Turn<'_, P> {
    /// Looks at what `op`, the instruction at the program counter, is about to do. Kinds without a body are looked at when they
    /// are executed.
    #[inline(never)]
    pub(crate) fn lint(&mut self, op: &AvrOp) {
        if matches!(op.kind, Kind::Illegal | Kind::Trap | Kind::Poll) {
            return;
        }
        let (now, pc) = (self.hot.time.now(), self.hot.pc & self.code.mask());
        let mut live = self.live();
        live.pc = pc;
        live.look_at_bauds(self.bus, now);
        if live.look && self.hot.flags.get(Flag::I) {
            live.look_at_vectors(self.bus, self.code, now);
        }
        Shadow::new(&self.hot, self.data, self.bus, &mut live).execute(*op);
        live.last = pc;
        self.tell(live, now);
    }

    /// The interrupt whose vector is the program word `at` is about to be entered.
    #[inline(never)]
    pub(crate) fn lint_interrupt(&mut self, at: u32) {
        let now = self.hot.time.now();
        let mut live = self.live();
        live.pc = at;
        if !handled(self.bus, self.code, at) {
            let vector = at.wrapping_sub(self.bus.vectors()) / live.part.chip.vector_words.max(1);
            live.find(Lint::NoHandler { vector: vector as u8 });
        }
        Shadow::new(&self.hot, self.data, self.bus, &mut live).interrupt();
        self.tell(live, now);
    }

    fn live(&mut self) -> Box<Live> {
        let fresh = self.hot.time.instructions() == 0;
        let part = self.bus.part();
        let lints = &mut self.bus.lints;
        lints.live.take().unwrap_or_else(|| Live::new(part, &lints.ground, fresh))
    }

    /// Tells the probe what was found, as of the first cycle of the instruction.
    fn tell(&mut self, mut live: Box<Live>, at: u64) {
        for (pc, lint) in live.found.drain(..) {
            self.probe.lint(at, pc, lint);
        }
        self.bus.lints.live = Some(live);
    }
}
