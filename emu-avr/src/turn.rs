//! The hot loop: what one instruction does to the machine.
//!
//! [`Turn`] holds the hot state as plain locals whose address never escapes, so that it lives in host registers; data
//! memory (registers of the core included) lies beside it. Everything a body calls is inlined; slow paths get scalars.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Probe, Wake};
use emu_core::dispatch;
use emu_core::machine::{Byte, Machine, Pair};
use emu_core::table::Op;

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::flags::{Flag, Flags};
use crate::isa::{AvrOp, Kind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};
use crate::predecode::{Code, WORDS};
use crate::soc::Soc;

/// Data addresses of the registers of the core.
pub(crate) const SPL: u16 = 0x5D;
/// See [`SPL`].
pub(crate) const SPH: u16 = 0x5E;
/// See [`SPL`].
pub(crate) const SREG: u16 = 0x5F;

/// What the core holds of data memory. All of it is behind one pointer, so that the hot loop has registers of the host left.
#[derive(Debug, Clone)]
pub(crate) struct Data {
    /// The registers of the core, and from [`RAM`] on RAM, of which a chip has the first. What RAM there is below 100h is kept by
    /// the chip.
    pub bytes: [u8; RAM + MOST_RAM],
    /// Bytes of RAM from the data address 100h on.
    pub ram_len: u16,
}

/// Where RAM begins in [`Data`]. Registers are a byte of index away, so that none is checked.
pub(crate) const RAM: usize = 0x100;

/// RAM of the largest chip in bytes; a power of two.
pub(crate) const MOST_RAM: usize = 0x1000;

/// The state of the core that every instruction touches.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hot {
    /// Program word address; may stand behind the end of memory until it is masked.
    pub pc: u32,
    /// Stack pointer.
    pub sp: u16,
    /// SREG.
    pub flags: Flags,
    /// Cycles and instructions.
    pub time: Countdown,
    /// The boundary at this cycle takes no interrupt: the instruction before it set I.
    pub hold_at: u64,
    /// SLEEP was executed.
    pub sleeping: bool,
    /// The op at `pc` needs the slow path.
    pub escape: bool,
    /// The probe asked for a stop.
    pub stop: bool,
}

impl Hot {
    /// At cycle 0, everything 0 or off.
    pub(crate) const START: Hot = Hot {
        pc: 0,
        sp: 0,
        flags: Flags::unpack(0),
        time: Countdown::START,
        hold_at: u64::MAX,
        sleeping: false,
        escape: false,
        stop: false,
    };
}

/// One turn of the loop: hot state by value, everything else borrowed.
pub(crate) struct Turn<'a, P: Probe> {
    pub hot: Hot,
    pub data: &'a mut Data,
    pub code: &'a Code,
    pub bus: &'a mut Soc,
    pub probe: &'a mut P,
}

impl<P: Probe> Turn<'_, P> {
    /// The machine cycle in which an access of the running instruction falls: the last one charged.
    #[inline(always)]
    const fn access(&self) -> u64 {
        self.hot.time.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn wake(&mut self, wake: Wake) {
        if wake != Wake::NONE {
            if wake.has(Wake::HOLD) {
                self.hot.hold_at = self.hot.time.now();
            }
            self.hot.time.force();
        }
    }

    /// After I was set: the next boundary takes no interrupt.
    #[inline(always)]
    fn hold(&mut self) {
        self.hot.hold_at = self.hot.time.now();
        self.hot.time.force();
    }

    /// The instruction goes on elsewhere than behind it.
    #[inline(always)]
    fn goes(&mut self, target: u32) {
        if P::FLOW {
            let mask = self.code.mask();
            self.probe.goes(self.hot.pc & mask, target & mask, true);
        }
        self.hot.pc = target;
    }

    /// Tells the probe of an access to data memory.
    #[inline(always)]
    fn saw(&mut self, addr: u16, value: u8, write: bool) {
        let wanted = P::DATA && (write || P::READS);
        if wanted && self.probe.data(self.access(), 0, addr, value, write) {
            self.hot.stop = true;
            self.hot.time.force();
        }
    }

    /// Reads what is not RAM: core registers by their data address, peripherals, nothing.
    #[inline(always)]
    fn read_special(&mut self, addr: u16) -> u8 {
        match addr {
            0..=0x1F => self.data.bytes[addr as usize],
            SPL => self.hot.sp as u8,
            SPH => (self.hot.sp >> 8) as u8,
            SREG => self.hot.flags.pack(),
            _ => {
                let (value, wake) = read_bus(self.bus, addr, self.access());
                self.wake(wake);
                value
            }
        }
    }

    #[inline(always)]
    fn write_special(&mut self, addr: u16, value: u8) {
        match addr {
            0..=0x1F => self.data.bytes[addr as usize] = value,
            SPL => self.hot.sp = self.hot.sp & 0xFF00 | u16::from(value),
            SPH => self.hot.sp = self.hot.sp & 0x00FF | u16::from(value) << 8,
            SREG => {
                self.hot.flags = Flags::unpack(value);
                if value & 0x80 != 0 {
                    self.hold();
                }
            }
            _ => {
                let wake = write_bus(self.bus, addr, value, self.access());
                self.wake(wake);
            }
        }
    }
}

/// Where a byte of RAM is kept.
#[inline(always)]
pub(crate) const fn ram(i: u16) -> usize {
    RAM + (i as usize & (MOST_RAM - 1))
}

/// A byte of program memory, or what SPMCSR has put in its place, for the LPM before the program word `next` that ends at `end`.
#[inline(never)]
fn code_byte(code: &Code, bus: &mut Soc, addr: u32, next: u32, end: u64) -> u8 {
    let aside = bus.program_byte(addr, 2 * (next.wrapping_sub(1) & code.mask()), end.wrapping_sub(3));
    aside.unwrap_or_else(|| code.byte(addr as usize))
}

/// The same at RAMPZ and `z` for an ELPM; RAMPZ counts with `z` if `inc`.
#[inline(never)]
fn far_code_byte(code: &Code, bus: &mut Soc, (z, inc): (u16, bool), next: u32, end: u64) -> u8 {
    let byte = code_byte(code, bus, bus.far(z), next, end);
    if inc && z == u16::MAX {
        bus.count_rampz();
    }
    byte
}

/// A peripheral register is read; addresses behind RAM give 0.
#[inline(never)]
fn read_bus(bus: &mut Soc, addr: u16, at: u64) -> (u8, Wake) {
    bus.read(addr, at)
}

/// A peripheral register is written; addresses behind RAM take nothing.
#[inline(never)]
fn write_bus(bus: &mut Soc, addr: u16, value: u8, at: u64) -> Wake {
    bus.write(addr, value, at)
}

impl<P: Probe> Machine for Turn<'_, P> {
    type Bit = bool;
    type Word = Byte;
    type Wide = Pair;

    #[inline(always)]
    fn advance(&mut self, words: u32) {
        self.hot.pc = self.hot.pc.wrapping_add(words);
        self.hot.time.count();
    }
    #[inline(always)]
    fn charge(&mut self, cycles: u32) {
        self.hot.time.charge(cycles);
    }
    #[inline(always)]
    fn jump(&mut self, target: u32) {
        self.goes(target);
    }
    #[inline(always)]
    fn goto(&mut self, target: Pair) {
        self.goes(target.0.into());
    }
    #[inline(always)]
    fn branch_if(&mut self, condition: bool, target: u32) {
        if condition {
            self.hot.time.charge(1);
            self.goes(target);
        }
    }
    #[inline(always)]
    fn skip_if(&mut self, condition: bool, words: u32) {
        if condition {
            self.hot.time.charge(words);
            self.goes(self.hot.pc.wrapping_add(words));
        }
    }
}

impl<P: Probe> AvrMachine for Turn<'_, P> {
    #[inline(always)]
    fn reg(&self, r: u8) -> Byte {
        Byte(self.data.bytes[usize::from(r)])
    }
    #[inline(always)]
    fn set_reg(&mut self, r: u8, value: Byte) {
        self.data.bytes[usize::from(r)] = value.0;
    }
    #[inline(always)]
    fn flag(&self, flag: Flag) -> bool {
        self.hot.flags.get(flag)
    }
    #[inline(always)]
    fn set_flag(&mut self, flag: Flag, value: bool) {
        self.hot.flags.set(flag, value);
    }
    #[inline(always)]
    fn force_flag(&mut self, flag: Flag, on: bool) {
        self.hot.flags.set(flag, on);
        if flag as u8 == Flag::I as u8 && on {
            self.hold();
        }
    }
    #[inline(always)]
    fn carry(&self) -> Byte {
        Byte(self.hot.flags.carries as u8 >> 7)
    }
    #[inline(always)]
    fn not_zero(&self) -> Byte {
        Byte(self.hot.flags.z as u8)
    }
    #[inline(always)]
    fn set_c(&mut self, carry: Byte) {
        self.hot.flags.set_c(carry.0.into());
    }
    #[inline(always)]
    fn set_carries(&mut self, carries: Byte) {
        self.hot.flags.carries = carries.0.into();
    }
    #[inline(always)]
    fn set_z(&mut self, word: Byte) {
        self.hot.flags.z = word.0.into();
    }
    #[inline(always)]
    fn set_nzv(&mut self, n: Byte, z: Byte, v: Byte) {
        let flags = &mut self.hot.flags;
        (flags.n, flags.z, flags.v, flags.s) = (n.0.into(), z.0.into(), v.0.into(), 0);
    }
    #[inline(always)]
    fn load(&mut self, addr: Pair) -> Byte {
        let addr = addr.0;
        let i = addr.wrapping_sub(RAM as u16);
        let value = if i < self.data.ram_len { self.data.bytes[ram(i)] } else { self.read_special(addr) };
        self.saw(addr, value, false);
        Byte(value)
    }
    #[inline(always)]
    fn store(&mut self, addr: Pair, value: Byte) {
        let (addr, value) = (addr.0, value.0);
        self.saw(addr, value, true);
        let i = addr.wrapping_sub(RAM as u16);
        if i < self.data.ram_len {
            self.data.bytes[ram(i)] = value;
        } else {
            self.write_special(addr, value);
        }
    }
    #[inline(always)]
    fn io_read(&mut self, a: u8) -> Byte {
        let addr = u16::from(a & 0x3F) + 0x20;
        let value = self.read_special(addr);
        self.saw(addr, value, false);
        Byte(value)
    }
    #[inline(always)]
    fn io_write(&mut self, a: u8, value: Byte) {
        let value = value.0;
        let addr = u16::from(a & 0x3F) + 0x20;
        self.saw(addr, value, true);
        self.write_special(addr, value);
    }
    #[inline(always)]
    fn io_write_bit(&mut self, a: u8, b: u8, on: bool) {
        let addr = u16::from(a & 0x1F) + 0x20;
        let mask = 1u8 << (b & 7);
        let value = if on { mask } else { 0 };
        self.saw(addr, value, true);
        let wake = self.bus.write_bits(addr, mask, value, self.access());
        self.wake(wake);
    }
    #[inline(always)]
    fn code_byte(&mut self, addr: Pair) -> Byte {
        Byte(code_byte(self.code, self.bus, addr.0.into(), self.hot.pc, self.hot.time.now()))
    }
    #[inline(always)]
    fn far_code_byte(&mut self, addr: Pair, inc: bool) -> Byte {
        Byte(far_code_byte(self.code, self.bus, (addr.0, inc), self.hot.pc, self.hot.time.now()))
    }
    #[inline(always)]
    fn store_program(&mut self) {
        let pair = |low: usize| u16::from_le_bytes([self.data.bytes[low], self.data.bytes[low + 1]]);
        let (z, data) = (pair(30), pair(0));
        let pc = 2 * (self.hot.pc.wrapping_sub(1) & self.code.mask());
        self.bus.store_program(z, data, pc, self.hot.time.now());
        self.hot.time.force();
    }
    #[inline(always)]
    fn sp(&self) -> Pair {
        Pair(self.hot.sp)
    }
    #[inline(always)]
    fn set_sp(&mut self, sp: Pair) {
        self.hot.sp = sp.0;
    }
    #[inline(always)]
    fn next_pc(&self) -> Pair {
        Pair((self.hot.pc & self.code.mask()) as u16)
    }
    #[inline(always)]
    fn sleep(&mut self) {
        self.hot.sleeping = self.bus.sleep(self.access());
        self.hot.time.force();
    }
    #[inline(always)]
    fn clear_watchdog(&mut self) {
        let at = self.access();
        self.bus.clear_watchdog(at);
        self.hot.time.force();
    }
}

/// Executes `$op` on `$m`; `$other` is for kinds without a row.
macro_rules! execute {
    ($m:ident, $op:ident, $other:expr) => {
        avr_table!(dispatch { ($m, $op, $op.kind, $other) })
    };
}

/// Fetches and executes the instruction at the program counter.
macro_rules! turn {
    ($turn:ident, $ops:ident) => {{
        let m = &mut $turn;
        let op: &AvrOp = &$ops[m.hot.pc as u16 as usize];
        if P::INSN && op.kind as u8 != Kind::Trap as u8 && m.probe.insn(m.hot.time.now(), m.hot.pc & m.code.mask()) {
            m.hot.stop = true;
            m.hot.time.force();
            break;
        }
        if P::LINT {
            m.lint(op);
        }
        execute!(m, op, {
            m.hot.escape = true;
            m.hot.time.force();
        });
    }};
}

impl<P: Probe> Turn<'_, P> {
    /// Runs to the deadline; returns the hot state. The turn is written twice so that there are two indirect jumps.
    #[inline(never)]
    pub(crate) fn burst(self, ops: &[AvrOp; WORDS]) -> Hot {
        let mut turn = self;
        while turn.hot.time.goes_on() {
            turn!(turn, ops);
            if !turn.hot.time.goes_on() {
                break;
            }
            turn!(turn, ops);
        }
        turn.hot
    }

    /// Executes one given op, whatever stands in the op array; a kind without a row does nothing.
    #[inline(never)]
    pub(crate) fn single(self, op: Op<Kind>) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        let op = &op;
        if P::LINT {
            m.lint(op);
        }
        execute!(m, op, ());
        turn.hot
    }

    /// Goes to the interrupt vector at the program word `vector`: return address on the stack, I clear, 4 cycles (data sheet
    /// 7.7.1).
    #[inline(never)]
    pub(crate) fn interrupt(self, vector: u32) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        if P::LINT {
            m.lint_interrupt(vector);
        }
        m.charge(4);
        push_pc(m);
        m.hot.flags.set(Flag::I, false);
        m.hot.pc = vector;
        turn.hot
    }
}
