//! The hot loop: executes predecoded instructions.
//!
//! [`Executor`] holds the registers of the core as plain locals whose address never escapes, so that the
//! compiler keeps them in host registers. RAM is borrowed. Everything that a body calls is inlined; slow
//! paths take scalars.

use emu_core::cpu::{Bus, BusEffect, Probe};
use emu_core::machine::{BodyMachine, ByteValue, WideValue};
use emu_core::{RegisterRead, dispatch};

use crate::core_state::CoreRegisters;
#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Mcs51Op, Mcs51OpKind, mcs51_table};
use crate::operands::{Abs, BitAddr, Dir, Imm, Imm16, Page, RamBit, Rel, Ri, Rn};
use crate::soc::{BusTransfer, Mcs51Soc};

/// Size in bytes of program memory, and of external RAM.
pub(crate) const ADDRESS_SPACE: usize = 0x1_0000;

/// Indexes of the memories in [`Chip::spaces`](emu_core::chip::Chip::spaces).
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

/// Context in which instructions execute: the registers of the core by value, everything else borrowed.
pub(crate) struct Executor<'a, P: Probe> {
    /// Registers of the core, by value.
    pub core: CoreRegisters,
    /// Cycles of the running instruction.
    pub cycles: u32,
    /// Whether the chip has RAM above 7Fh.
    pub has_upper_ram: bool,
    /// Whether the chip has two data pointers.
    pub has_two_dptrs: bool,
    /// RAM on the chip, by indirect address.
    pub ram: &'a mut [u8; 256],
    /// External RAM.
    pub xdata: &'a mut [u8; ADDRESS_SPACE],
    /// Program memory.
    pub code: &'a [u8; ADDRESS_SPACE],
    /// The chip around the core.
    pub bus: &'a mut Mcs51Soc,
    /// The observer of the run.
    pub probe: &'a mut P,
}

impl<P: Probe> Executor<'_, P> {
    /// The cycle in which the running instruction reads: its first one.
    #[inline(always)]
    const fn read_cycle(&self) -> u64 {
        self.core.clock.now().wrapping_sub(self.cycles as u64)
    }

    /// The cycle in which the running instruction writes: its last one.
    #[inline(always)]
    const fn write_cycle(&self) -> u64 {
        self.core.clock.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn apply_bus_effect(&mut self, effect: BusEffect) {
        if effect != BusEffect::NONE {
            if effect.contains(BusEffect::HOLD_INTERRUPTS) {
                self.core.no_interrupt_at = self.core.clock.now();
            }
            self.core.clock.expire();
        }
    }

    /// Continues at `target` instead of the next instruction, and reports the jump to the probe.
    #[inline(always)]
    fn jump_to(&mut self, target: u32) {
        if P::FLOW {
            self.probe.on_branch(self.core.pc & 0xFFFF, target & 0xFFFF, true);
        }
        self.core.pc = target;
    }

    /// Reports an access to data memory to the probe.
    #[inline(always)]
    fn report_access(&mut self, space: u8, addr: u16, value: u8, write: bool) {
        if P::DATA && (write || P::DATA_READS) {
            let at = if write { self.write_cycle() } else { self.read_cycle() };
            if self.probe.on_data_access(at, space, addr, value, write) {
                self.core.stop_requested = true;
                self.core.clock.expire();
            }
        }
    }

    /// Reads the register at a direct address from 80h on.
    #[inline(always)]
    fn read_sfr(&mut self, addr: u8, latch: bool) -> u8 {
        if let Some(value) = self.core.read_core_sfr(addr, self.has_two_dptrs) {
            return value;
        }
        let at = self.read_cycle();
        let RegisterRead { value, effect } = read_bus(self.bus, addr, latch, at);
        self.apply_bus_effect(effect);
        value
    }

    /// Reports a byte on the external bus to the ports.
    #[inline(always)]
    fn on_bus_transfer(&mut self, transfer: BusTransfer) {
        if self.bus.has_bus_pins() {
            let at = self.write_cycle();
            let effect = transfer_on_bus(self.bus, transfer, at);
            self.apply_bus_effect(effect);
        }
    }

    /// Writes the bits in `mask` of the register at a direct address from 80h on.
    #[inline(always)]
    fn write_sfr(&mut self, addr: u8, mask: u8, value: u8) {
        let other_bits = if mask == 0xFF { Some(0) } else { self.core.read_core_sfr(addr, self.has_two_dptrs) };
        if let Some(old) = other_bits
            && self.core.write_core_sfr(addr, old & !mask | value & mask, self.has_two_dptrs)
        {
            return;
        }
        let at = self.write_cycle();
        let effect = write_bus(self.bus, addr, mask, value, at);
        self.apply_bus_effect(effect);
    }
}

/// Reads a register of the chip; outlined.
#[inline(never)]
fn read_bus(bus: &mut Mcs51Soc, addr: u8, latch: bool, at: u64) -> RegisterRead {
    let addr = u16::from(addr);
    if latch { bus.read_latch(addr, at) } else { bus.read(addr, at) }
}

/// Writes a register of the chip; outlined.
#[inline(never)]
fn write_bus(bus: &mut Mcs51Soc, addr: u8, mask: u8, value: u8, at: u64) -> BusEffect {
    bus.write_bits(u16::from(addr), mask, value, at)
}

/// Applies a transfer of MOVX to the ports; outlined.
#[inline(never)]
fn transfer_on_bus(bus: &mut Mcs51Soc, transfer: BusTransfer, at: u64) -> BusEffect {
    bus.external_access(transfer, at)
}

impl<P: Probe> BodyMachine for Executor<'_, P> {
    type Bit = bool;
    type Byte = ByteValue;
    type Wide = WideValue;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.cycles = cycles;
        self.advance(words);
        self.charge(cycles);
    }
    #[inline(always)]
    fn advance(&mut self, words: u32) {
        self.core.pc = self.core.pc.wrapping_add(words);
        self.core.clock.count_instruction();
    }
    #[inline(always)]
    fn charge(&mut self, cycles: u32) {
        self.core.clock.charge(cycles);
    }
    #[inline(always)]
    fn jump(&mut self, target: u32) {
        self.jump_to(target);
    }
    #[inline(always)]
    fn goto(&mut self, target: WideValue) {
        self.jump_to(target.0.into());
    }
    #[inline(always)]
    fn branch_if(&mut self, condition: bool, target: u32) {
        if condition {
            self.jump_to(target);
        }
    }
    #[inline(always)]
    fn skip_if(&mut self, condition: bool, words: u32) {
        if condition {
            self.jump_to(self.core.pc.wrapping_add(words));
        }
    }
}

impl<P: Probe> Mcs51Machine for Executor<'_, P> {
    #[inline(always)]
    fn acc(&self) -> ByteValue {
        ByteValue(self.core.acc as u8)
    }
    #[inline(always)]
    fn set_acc(&mut self, value: ByteValue) {
        self.core.acc = value.0.into();
    }
    #[inline(always)]
    fn b(&self) -> ByteValue {
        ByteValue(self.core.b as u8)
    }
    #[inline(always)]
    fn set_b(&mut self, value: ByteValue) {
        self.core.b = value.0.into();
    }
    #[inline(always)]
    fn dptr(&self) -> WideValue {
        WideValue(self.core.dptr as u16)
    }
    #[inline(always)]
    fn set_dptr(&mut self, value: WideValue) {
        self.core.dptr = value.0.into();
    }
    #[inline(always)]
    fn sp(&self) -> ByteValue {
        ByteValue(self.core.sp as u8)
    }
    #[inline(always)]
    fn set_sp(&mut self, value: ByteValue) {
        self.core.sp = value.0.into();
    }
    #[inline(always)]
    fn carry(&self) -> bool {
        self.core.cy != 0
    }
    #[inline(always)]
    fn set_carry(&mut self, value: bool) {
        self.core.cy = value.into();
    }
    #[inline(always)]
    fn half_carry(&self) -> bool {
        self.core.ac & 8 != 0
    }
    #[inline(always)]
    fn set_overflow(&mut self, value: bool) {
        self.core.ov = u32::from(value) << 7;
    }
    #[inline(always)]
    fn set_sum_flags(&mut self, carries: ByteValue, overflow: ByteValue) {
        let carries = u32::from(carries.0);
        (self.core.cy, self.core.ac, self.core.ov) = (carries >> 7, carries, overflow.0.into());
    }
    #[inline(always)]
    fn word_from_bit(bit: bool) -> ByteValue {
        ByteValue(bit.into())
    }
    #[inline(always)]
    fn bit_from_bool(on: bool) -> bool {
        on
    }
    #[inline(always)]
    fn reg(&mut self, r: u8) -> ByteValue {
        let addr = (self.core.bank | u32::from(r)) as u8;
        let value = self.ram[usize::from(addr)];
        self.report_access(space::IDATA, addr.into(), value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn set_reg(&mut self, r: u8, value: ByteValue) {
        let addr = (self.core.bank | u32::from(r)) as u8;
        self.report_access(space::IDATA, addr.into(), value.0, true);
        self.ram[usize::from(addr)] = value.0;
    }
    #[inline(always)]
    fn ram(&mut self, addr: u8) -> ByteValue {
        let value = self.ram[usize::from(addr)];
        self.report_access(space::IDATA, addr.into(), value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn set_ram(&mut self, addr: u8, value: ByteValue) {
        self.report_access(space::IDATA, addr.into(), value.0, true);
        self.ram[usize::from(addr)] = value.0;
    }
    #[inline(always)]
    fn idata(&mut self, addr: ByteValue) -> ByteValue {
        let addr = addr.0;
        let value = if addr < 0x80 || self.has_upper_ram { self.ram[usize::from(addr)] } else { 0xFF };
        self.report_access(space::IDATA, addr.into(), value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn set_idata(&mut self, addr: ByteValue, value: ByteValue) {
        let addr = addr.0;
        self.report_access(space::IDATA, addr.into(), value.0, true);
        if addr < 0x80 || self.has_upper_ram {
            self.ram[usize::from(addr)] = value.0;
        }
    }
    #[inline(always)]
    fn direct(&mut self, addr: u8) -> ByteValue {
        if addr < 0x80 {
            return self.ram(addr);
        }
        let value = self.read_sfr(addr, false);
        self.report_access(space::SFR, addr.into(), value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn direct_latch(&mut self, addr: u8) -> ByteValue {
        if addr < 0x80 {
            return self.ram(addr);
        }
        let value = self.read_sfr(addr, true);
        self.report_access(space::SFR, addr.into(), value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn set_direct(&mut self, addr: u8, value: ByteValue) {
        if addr < 0x80 {
            return self.set_ram(addr, value);
        }
        self.report_access(space::SFR, addr.into(), value.0, true);
        self.write_sfr(addr, 0xFF, value.0);
    }
    #[inline(always)]
    fn ram_bit(&mut self, at: RamBit) -> bool {
        let value = self.ram[usize::from(at.byte)] & at.mask != 0;
        self.report_access(space::BIT, at.addr().into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn set_ram_bit(&mut self, at: RamBit, value: bool) {
        self.report_access(space::BIT, at.addr().into(), value.into(), true);
        let byte = &mut self.ram[usize::from(at.byte)];
        *byte = *byte & !at.mask | at.mask & u8::from(value).wrapping_neg();
    }
    #[inline(always)]
    fn direct_bit(&mut self, addr: u8) -> bool {
        if addr < 0x80 {
            return self.ram_bit(RamBit::of_address(addr));
        }
        let value = self.read_sfr(addr & 0xF8, false) >> (addr & 7) & 1 != 0;
        self.report_access(space::BIT, addr.into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn direct_bit_latch(&mut self, addr: u8) -> bool {
        if addr < 0x80 {
            return self.ram_bit(RamBit::of_address(addr));
        }
        let value = self.read_sfr(addr & 0xF8, true) >> (addr & 7) & 1 != 0;
        self.report_access(space::BIT, addr.into(), value.into(), false);
        value
    }
    #[inline(always)]
    fn set_direct_bit_if(&mut self, condition: bool, addr: u8, value: bool) {
        if !condition {
            return;
        }
        if addr < 0x80 {
            return self.set_ram_bit(RamBit::of_address(addr), value);
        }
        self.report_access(space::BIT, addr.into(), value.into(), true);
        let mask = 1 << (addr & 7);
        self.write_sfr(addr & 0xF8, mask, mask & u8::from(value).wrapping_neg());
    }
    #[inline(always)]
    fn xdata(&mut self, addr: WideValue) -> ByteValue {
        let value = self.xdata[usize::from(addr.0)];
        self.report_access(space::XDATA, addr.0, value, false);
        self.on_bus_transfer(BusTransfer { addr: addr.0, value, write: false });
        ByteValue(value)
    }
    #[inline(always)]
    fn set_xdata(&mut self, addr: WideValue, value: ByteValue) {
        self.report_access(space::XDATA, addr.0, value.0, true);
        self.xdata[usize::from(addr.0)] = value.0;
        self.on_bus_transfer(BusTransfer { addr: addr.0, value: value.0, write: true });
    }
    #[inline(always)]
    fn xdata_page(&mut self) -> ByteValue {
        ByteValue(self.bus.port2())
    }
    #[inline(always)]
    fn code(&mut self, addr: WideValue) -> ByteValue {
        ByteValue(self.code[usize::from(addr.0)])
    }
    #[inline(always)]
    fn next_pc(&self) -> WideValue {
        WideValue(self.core.pc as u16)
    }
    #[inline(always)]
    fn relative_if(&mut self, condition: bool, distance: i8) {
        if condition {
            self.jump_to(self.core.pc.wrapping_add_signed(distance.into()));
        }
    }
    #[inline(always)]
    fn end_interrupt(&mut self) {
        self.bus.end_interrupt();
        self.core.no_interrupt_at = self.core.clock.now();
        self.core.clock.expire();
    }
}

/// Executes `$op` on `$m`; `$other` is for kinds without a row.
macro_rules! execute_op {
    ($m:ident, $op:ident, $other:expr) => {
        mcs51_table!(dispatch { ($m, $op, Mcs51OpKind, $op.kind, $other) })
    };
}

impl<P: Probe> Executor<'_, P> {
    /// Executes instructions until the deadline; returns the registers of the core.
    #[inline(never)]
    pub(crate) fn burst(self, ops: &[Mcs51Op; ADDRESS_SPACE]) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        emu_core::burst_loop!(m, op: Mcs51OpKind = ops[m.core.pc as u16 as usize], m.core.pc & 0xFFFF, {
            execute_op!(m, op, emu_core::leave_burst!(m));
        });
        executor.core
    }

    /// Executes one given op, regardless of the op array. A kind without a row does nothing.
    #[inline(never)]
    pub(crate) fn single(self, op: Mcs51Op) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        let op = &op;
        execute_op!(m, op, ());
        executor.core
    }

    /// Calls the service routine at `target`: pushes the return address, in 2 cycles (user's manual, "How
    /// interrupts are handled").
    #[inline(never)]
    pub(crate) fn enter_interrupt(self, target: u32) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        m.cycles = 2;
        m.charge(2);
        push_pc(m);
        m.core.pc = target;
        executor.core
    }
}
