//! The hot loop: what one instruction does to the machine.
//!
//! [`Turn`] holds the hot state as plain locals whose address never escapes, so that it lives in host registers; RAM lies
//! beside it. Everything a body calls is inlined; slow paths get scalars.

use emu_core::cpu::{Bus, Probe, Wake};
use emu_core::dispatch;
use emu_core::machine::{Byte, Machine, Pair};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::hot::Hot;
use crate::isa::{Kind, Mcs51Op, mcs51_table};
use crate::operands::{Abs, BitAddr, Dir, Imm, Imm16, Page, RamBit, Rel, Ri, Rn};
use crate::soc::{Soc, Transfer};

/// Bytes of program memory, and of external RAM.
pub(crate) const SPAN: usize = 0x1_0000;

/// The memories by their places in the list of a chip.
pub(crate) mod space {
    /// RAM on the chip, by indirect address.
    pub(crate) const IDATA: u8 = 1;
    /// Special function registers.
    pub(crate) const SFR: u8 = 2;
    /// Single bits.
    pub(crate) const BIT: u8 = 3;
    /// External RAM.
    pub(crate) const XDATA: u8 = 4;
}

/// One turn of the loop: hot state by value, everything else borrowed.
pub(crate) struct Turn<'a, P: Probe> {
    pub hot: Hot,
    /// Cycles of the running instruction.
    pub cycles: u32,
    /// There is RAM above 7Fh.
    pub upper: bool,
    /// There are two data pointers.
    pub dual: bool,
    pub ram: &'a mut [u8; 256],
    pub xdata: &'a mut [u8; SPAN],
    pub code: &'a [u8; SPAN],
    pub bus: &'a mut Soc,
    pub probe: &'a mut P,
}

impl<P: Probe> Turn<'_, P> {
    /// The cycle in which the running instruction reads: its first.
    #[inline(always)]
    const fn first(&self) -> u64 {
        self.hot.time.now().wrapping_sub(self.cycles as u64)
    }

    /// The cycle in which the running instruction writes: its last.
    #[inline(always)]
    const fn last(&self) -> u64 {
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

    /// The instruction goes on elsewhere than behind it.
    #[inline(always)]
    fn goes(&mut self, target: u32) {
        if P::FLOW {
            self.probe.goes(self.hot.pc & 0xFFFF, target & 0xFFFF, true);
        }
        self.hot.pc = target;
    }

    /// Tells the probe of an access to data memory.
    #[inline(always)]
    fn saw(&mut self, space: u8, addr: u16, value: u8, write: bool) {
        if P::DATA && (write || P::READS) {
            let at = if write { self.last() } else { self.first() };
            if self.probe.data(at, space, addr, value, write) {
                self.hot.stop = true;
                self.hot.time.force();
            }
        }
    }

    /// Reads the register at a direct address from 80h on.
    #[inline(always)]
    fn read_sfr(&mut self, addr: u8, latch: bool) -> u8 {
        if let Some(value) = self.hot.core(addr, self.dual) {
            return value;
        }
        let at = self.first();
        let (value, wake) = read_bus(self.bus, addr, latch, at);
        self.wake(wake);
        value
    }

    /// A byte has gone over the bus.
    #[inline(always)]
    fn moved(&mut self, transfer: Transfer) {
        if self.bus.minds_movx() {
            let at = self.last();
            let wake = use_bus(self.bus, transfer, at);
            self.wake(wake);
        }
    }

    /// Writes the bits of `mask` of the register at a direct address from 80h on.
    #[inline(always)]
    fn write_sfr(&mut self, addr: u8, mask: u8, value: u8) {
        let whole = if mask == 0xFF { Some(0) } else { self.hot.core(addr, self.dual) };
        if let Some(old) = whole
            && self.hot.set_core(addr, old & !mask | value & mask, self.dual)
        {
            return;
        }
        let at = self.last();
        let wake = write_bus(self.bus, addr, mask, value, at);
        self.wake(wake);
    }
}

/// A register of the chip is read.
#[inline(never)]
fn read_bus(bus: &mut Soc, addr: u8, latch: bool, at: u64) -> (u8, Wake) {
    let addr = u16::from(addr);
    if latch { bus.read_latch(addr, at) } else { bus.read(addr, at) }
}

/// A register of the chip is written.
#[inline(never)]
fn write_bus(bus: &mut Soc, addr: u8, mask: u8, value: u8, at: u64) -> Wake {
    bus.write_bits(u16::from(addr), mask, value, at)
}

/// MOVX does something to the ports.
#[inline(never)]
fn use_bus(bus: &mut Soc, transfer: Transfer, at: u64) -> Wake {
    bus.external_access(transfer, at)
}

impl<P: Probe> Machine for Turn<'_, P> {
    type Bit = bool;
    type Word = Byte;
    type Wide = Pair;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.cycles = cycles;
        self.advance(words);
        self.charge(cycles);
    }
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
            self.goes(target);
        }
    }
    #[inline(always)]
    fn skip_if(&mut self, condition: bool, words: u32) {
        if condition {
            self.goes(self.hot.pc.wrapping_add(words));
        }
    }
}

impl<P: Probe> Mcs51Machine for Turn<'_, P> {
    #[inline(always)]
    fn acc(&self) -> Byte {
        Byte(self.hot.acc as u8)
    }
    #[inline(always)]
    fn set_acc(&mut self, value: Byte) {
        self.hot.acc = value.0.into();
    }
    #[inline(always)]
    fn b(&self) -> Byte {
        Byte(self.hot.b as u8)
    }
    #[inline(always)]
    fn set_b(&mut self, value: Byte) {
        self.hot.b = value.0.into();
    }
    #[inline(always)]
    fn dptr(&self) -> Pair {
        Pair(self.hot.dptr as u16)
    }
    #[inline(always)]
    fn set_dptr(&mut self, value: Pair) {
        self.hot.dptr = value.0.into();
    }
    #[inline(always)]
    fn sp(&self) -> Byte {
        Byte(self.hot.sp as u8)
    }
    #[inline(always)]
    fn set_sp(&mut self, value: Byte) {
        self.hot.sp = value.0.into();
    }
    #[inline(always)]
    fn carry(&self) -> bool {
        self.hot.cy != 0
    }
    #[inline(always)]
    fn set_carry(&mut self, value: bool) {
        self.hot.cy = value.into();
    }
    #[inline(always)]
    fn half(&self) -> bool {
        self.hot.ac & 8 != 0
    }
    #[inline(always)]
    fn set_overflow(&mut self, value: bool) {
        self.hot.ov = u32::from(value) << 7;
    }
    #[inline(always)]
    fn set_sum_flags(&mut self, carries: Byte, overflow: Byte) {
        let carries = u32::from(carries.0);
        (self.hot.cy, self.hot.ac, self.hot.ov) = (carries >> 7, carries, overflow.0.into());
    }
    #[inline(always)]
    fn word(bit: bool) -> Byte {
        Byte(bit.into())
    }
    #[inline(always)]
    fn bit(on: bool) -> bool {
        on
    }
    #[inline(always)]
    fn reg(&mut self, r: u8) -> Byte {
        let addr = (self.hot.bank | u32::from(r)) as u8;
        let value = self.ram[usize::from(addr)];
        self.saw(space::IDATA, addr.into(), value, false);
        Byte(value)
    }
    #[inline(always)]
    fn set_reg(&mut self, r: u8, value: Byte) {
        let addr = (self.hot.bank | u32::from(r)) as u8;
        self.saw(space::IDATA, addr.into(), value.0, true);
        self.ram[usize::from(addr)] = value.0;
    }
    #[inline(always)]
    fn ram(&mut self, addr: u8) -> Byte {
        let value = self.ram[usize::from(addr)];
        self.saw(space::IDATA, addr.into(), value, false);
        Byte(value)
    }
    #[inline(always)]
    fn set_ram(&mut self, addr: u8, value: Byte) {
        self.saw(space::IDATA, addr.into(), value.0, true);
        self.ram[usize::from(addr)] = value.0;
    }
    #[inline(always)]
    fn idata(&mut self, addr: Byte) -> Byte {
        let addr = addr.0;
        let value = if addr < 0x80 || self.upper { self.ram[usize::from(addr)] } else { 0xFF };
        self.saw(space::IDATA, addr.into(), value, false);
        Byte(value)
    }
    #[inline(always)]
    fn set_idata(&mut self, addr: Byte, value: Byte) {
        let addr = addr.0;
        self.saw(space::IDATA, addr.into(), value.0, true);
        if addr < 0x80 || self.upper {
            self.ram[usize::from(addr)] = value.0;
        }
    }
    #[inline(always)]
    fn direct(&mut self, addr: u8) -> Byte {
        if addr < 0x80 {
            return self.ram(addr);
        }
        let value = self.read_sfr(addr, false);
        self.saw(space::SFR, addr.into(), value, false);
        Byte(value)
    }
    #[inline(always)]
    fn direct_latch(&mut self, addr: u8) -> Byte {
        if addr < 0x80 {
            return self.ram(addr);
        }
        let value = self.read_sfr(addr, true);
        self.saw(space::SFR, addr.into(), value, false);
        Byte(value)
    }
    #[inline(always)]
    fn set_direct(&mut self, addr: u8, value: Byte) {
        if addr < 0x80 {
            return self.set_ram(addr, value);
        }
        self.saw(space::SFR, addr.into(), value.0, true);
        self.write_sfr(addr, 0xFF, value.0);
    }
    #[inline(always)]
    fn ram_bit(&mut self, at: RamBit) -> bool {
        let value = self.ram[usize::from(at.byte)] & at.mask != 0;
        self.saw(space::BIT, at.addr().into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn set_ram_bit(&mut self, at: RamBit, value: bool) {
        self.saw(space::BIT, at.addr().into(), value.into(), true);
        let byte = &mut self.ram[usize::from(at.byte)];
        *byte = *byte & !at.mask | at.mask & u8::from(value).wrapping_neg();
    }
    #[inline(always)]
    fn direct_bit(&mut self, addr: u8) -> bool {
        if addr < 0x80 {
            return self.ram_bit(RamBit::at(addr));
        }
        let value = self.read_sfr(addr & 0xF8, false) >> (addr & 7) & 1 != 0;
        self.saw(space::BIT, addr.into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn direct_bit_latch(&mut self, addr: u8) -> bool {
        if addr < 0x80 {
            return self.ram_bit(RamBit::at(addr));
        }
        let value = self.read_sfr(addr & 0xF8, true) >> (addr & 7) & 1 != 0;
        self.saw(space::BIT, addr.into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn set_direct_bit_if(&mut self, condition: bool, addr: u8, value: bool) {
        if !condition {
            return;
        }
        if addr < 0x80 {
            return self.set_ram_bit(RamBit::at(addr), value);
        }
        self.saw(space::BIT, addr.into(), value.into(), true);
        let mask = 1 << (addr & 7);
        self.write_sfr(addr & 0xF8, mask, mask & u8::from(value).wrapping_neg());
    }
    #[inline(always)]
    fn xdata(&mut self, addr: Pair) -> Byte {
        let value = self.xdata[usize::from(addr.0)];
        self.saw(space::XDATA, addr.0, value, false);
        self.moved(Transfer { addr: addr.0, value, write: false });
        Byte(value)
    }
    #[inline(always)]
    fn set_xdata(&mut self, addr: Pair, value: Byte) {
        self.saw(space::XDATA, addr.0, value.0, true);
        self.xdata[usize::from(addr.0)] = value.0;
        self.moved(Transfer { addr: addr.0, value: value.0, write: true });
    }
    #[inline(always)]
    fn page(&mut self) -> Byte {
        Byte(self.bus.port2())
    }
    #[inline(always)]
    fn code(&mut self, addr: Pair) -> Byte {
        Byte(self.code[usize::from(addr.0)])
    }
    #[inline(always)]
    fn next_pc(&self) -> Pair {
        Pair(self.hot.pc as u16)
    }
    #[inline(always)]
    fn relative_if(&mut self, condition: bool, distance: i8) {
        if condition {
            self.goes(self.hot.pc.wrapping_add_signed(distance.into()));
        }
    }
    #[inline(always)]
    fn interrupt_ended(&mut self) {
        self.bus.reti();
        self.hot.hold_at = self.hot.time.now();
        self.hot.time.force();
    }
}

/// Executes `$op` on `$m`; `$other` is for kinds without a row.
macro_rules! execute {
    ($m:ident, $op:ident, $other:expr) => {
        mcs51_table!(dispatch { ($m, $op, $op.kind, $other) })
    };
}

/// Fetches and executes the instruction at the program counter.
macro_rules! turn {
    ($turn:ident, $ops:ident) => {{
        let m = &mut $turn;
        let op: &Mcs51Op = &$ops[m.hot.pc as u16 as usize];
        if P::INSN && op.kind as u8 != Kind::Trap as u8 && m.probe.insn(m.hot.time.now(), m.hot.pc & 0xFFFF) {
            m.hot.stop = true;
            m.hot.time.force();
            break;
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
    pub(crate) fn burst(self, ops: &[Mcs51Op; SPAN]) -> Hot {
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
    pub(crate) fn single(self, op: Mcs51Op) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        let op = &op;
        execute!(m, op, ());
        turn.hot
    }

    /// Calls the service routine at `target`: the return address on the stack, 2 cycles (user's manual, "How interrupts are
    /// handled").
    #[inline(never)]
    pub(crate) fn interrupt(self, target: u32) -> Hot {
        let mut turn = self;
        let m = &mut turn;
        m.cycles = 2;
        m.charge(2);
        push_pc(m);
        m.hot.pc = target;
        turn.hot
    }
}
