//! The hot loop: executes single instructions on the machine.
//!
//! [`Executor`] holds the registers of the core in local variables whose address never escapes, so the
//! compiler keeps them in host registers. Data memory, with the registers of the core, is borrowed.
//! Everything that a body calls is inlined; slow paths are outlined and get scalars only.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, BusEffect, Probe};
use emu_core::machine::{BodyMachine, ByteValue, WideValue};
use emu_core::table::PredecodedOp;
use emu_core::{RegisterRead, dispatch};

#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::flags::{SregFlag, SregFlags};
use crate::isa::{AvrOp, AvrOpKind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};
use crate::predecode::{CodeMemory, MAX_WORDS};
use crate::soc::AvrSoc;

/// Data address of the stack pointer, low byte.
pub(crate) const SPL: u16 = 0x5D;
/// Data address of the stack pointer, high byte.
pub(crate) const SPH: u16 = 0x5E;
/// Data address of SREG.
pub(crate) const SREG: u16 = 0x5F;

/// The part of data memory that the core holds. It is behind one pointer, so that the hot loop keeps more
/// host registers free.
#[derive(Debug, Clone)]
pub(crate) struct DataMemory {
    /// The registers of the core, and RAM from [`RAM_START`] on; a chip uses the first
    /// [`DataMemory::ram_len`] bytes of it. The chip around the core holds the RAM below 100h.
    pub bytes: [u8; RAM_START + MAX_RAM],
    /// Size in bytes of the RAM from the data address 100h on.
    pub ram_len: u16,
}

/// Index of the RAM in [`DataMemory`]. An 8-bit register index is always below it, so register accesses need
/// no bounds check.
pub(crate) const RAM_START: usize = 0x100;

/// RAM of the largest chip in bytes; a power of two.
pub(crate) const MAX_RAM: usize = 0x4000;

/// State of the core that every instruction uses.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoreRegisters {
    /// Program word address. It can be past the end of memory until it is masked.
    pub pc: u32,
    /// Stack pointer.
    pub sp: u16,
    /// SREG.
    pub flags: SregFlags,
    /// Counts of cycles and instructions, and the deadline.
    pub clock: Countdown,
    /// Cycle of the boundary that takes no interrupt, because the instruction before it set I.
    pub no_interrupt_at: u64,
    /// True after SLEEP was executed, until the core wakes.
    pub is_sleeping: bool,
    /// True if the op at `pc` needs the slow path.
    pub slow_path_requested: bool,
    /// True if the probe requested a stop.
    pub stop_requested: bool,
}

impl CoreRegisters {
    /// State at cycle 0: everything is 0 or off.
    pub(crate) const START: CoreRegisters = CoreRegisters {
        pc: 0,
        sp: 0,
        flags: SregFlags::unpack(0),
        clock: Countdown::START,
        no_interrupt_at: u64::MAX,
        is_sleeping: false,
        slow_path_requested: false,
        stop_requested: false,
    };
}

/// Context in which instructions execute: the registers of the core by value, everything else borrowed.
pub(crate) struct Executor<'a, P: Probe> {
    /// Registers of the core, by value.
    pub core: CoreRegisters,
    /// Data memory with the registers of the core.
    pub data: &'a mut DataMemory,
    /// Program memory.
    pub code: &'a CodeMemory,
    /// The chip around the core.
    pub bus: &'a mut AvrSoc,
    /// The observer of the run.
    pub probe: &'a mut P,
}

impl<P: Probe> Executor<'_, P> {
    /// Returns the machine cycle of a data access of the current instruction: the last cycle charged.
    #[inline(always)]
    const fn access_cycle(&self) -> u64 {
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

    /// Blocks interrupts at the next boundary; called after I was set.
    #[inline(always)]
    fn hold_interrupts(&mut self) {
        self.core.no_interrupt_at = self.core.clock.now();
        self.core.clock.expire();
    }

    /// Continues execution at `target` instead of the next instruction.
    #[inline(always)]
    fn jump_to(&mut self, target: u32) {
        if P::FLOW {
            let mask = self.code.mask();
            self.probe.on_branch(self.core.pc & mask, target & mask, true);
        }
        self.core.pc = target;
    }

    /// Reports an access to data memory to the probe.
    #[inline(always)]
    fn report_access(&mut self, addr: u16, value: u8, write: bool) {
        let wanted = P::DATA && (write || P::DATA_READS);
        if wanted && self.probe.on_data_access(self.access_cycle(), 0, addr, value, write) {
            self.core.stop_requested = true;
            self.core.clock.expire();
        }
    }

    /// Reads a data address that is not RAM at 100h or above: a core register, a peripheral register, or
    /// nothing.
    #[inline(always)]
    fn read_register(&mut self, addr: u16) -> u8 {
        match addr {
            0..=0x1F => self.data.bytes[addr as usize],
            SPL => self.core.sp as u8,
            SPH => (self.core.sp >> 8) as u8,
            SREG => self.core.flags.pack(),
            _ => {
                let RegisterRead { value, effect } = read_bus(self.bus, addr, self.access_cycle());
                self.apply_bus_effect(effect);
                value
            }
        }
    }

    #[inline(always)]
    fn write_register(&mut self, addr: u16, value: u8) {
        match addr {
            0..=0x1F => self.data.bytes[addr as usize] = value,
            SPL => self.core.sp = self.core.sp & 0xFF00 | u16::from(value),
            SPH => self.core.sp = self.core.sp & 0x00FF | u16::from(value) << 8,
            SREG => {
                self.core.flags = SregFlags::unpack(value);
                if value & 0x80 != 0 {
                    self.hold_interrupts();
                }
            }
            _ => {
                let effect = write_bus(self.bus, addr, value, self.access_cycle());
                self.apply_bus_effect(effect);
            }
        }
    }
}

/// Returns the index in [`DataMemory`] of the RAM byte `i`, counted from the data address 100h.
#[inline(always)]
pub(crate) const fn ram(i: u16) -> usize {
    RAM_START + (i as usize & (MAX_RAM - 1))
}

/// Reads a byte of program memory for the LPM before the program word `next`, which ends at cycle `end`.
/// SPMCSR can select another byte (fuses, lock bits, signature).
#[inline(never)]
fn code_byte(code: &CodeMemory, bus: &mut AvrSoc, addr: u32, next: u32, end: u64) -> u8 {
    let replacement = bus.program_byte(addr, 2 * (next.wrapping_sub(1) & code.mask()), end.wrapping_sub(3));
    replacement.unwrap_or_else(|| code.byte(addr as usize))
}

/// Reads a byte of program memory at RAMPZ and `z` for an ELPM. If `inc` is set and `z` wraps, RAMPZ is
/// incremented.
#[inline(never)]
fn far_code_byte(code: &CodeMemory, bus: &mut AvrSoc, z: u16, inc: bool, next: u32, end: u64) -> u8 {
    let byte = code_byte(code, bus, bus.rampz_address(z), next, end);
    if inc && z == u16::MAX {
        bus.count_rampz();
    }
    byte
}

/// Reads a peripheral register. Addresses past the end of RAM read 0.
#[inline(never)]
fn read_bus(bus: &mut AvrSoc, addr: u16, at: u64) -> RegisterRead {
    bus.read(addr, at)
}

/// Writes a peripheral register. Writes past the end of RAM have no effect.
#[inline(never)]
fn write_bus(bus: &mut AvrSoc, addr: u16, value: u8, at: u64) -> BusEffect {
    bus.write(addr, value, at)
}

impl<P: Probe> BodyMachine for Executor<'_, P> {
    type Bit = bool;
    type Byte = ByteValue;
    type Wide = WideValue;

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
            self.core.clock.charge(1);
            self.jump_to(target);
        }
    }
    #[inline(always)]
    fn skip_if(&mut self, condition: bool, words: u32) {
        if condition {
            self.core.clock.charge(words);
            self.jump_to(self.core.pc.wrapping_add(words));
        }
    }
}

impl<P: Probe> AvrMachine for Executor<'_, P> {
    #[inline(always)]
    fn reg(&self, r: u8) -> ByteValue {
        ByteValue(self.data.bytes[usize::from(r)])
    }
    #[inline(always)]
    fn set_reg(&mut self, r: u8, value: ByteValue) {
        self.data.bytes[usize::from(r)] = value.0;
    }
    #[inline(always)]
    fn flag(&self, flag: SregFlag) -> bool {
        self.core.flags.get(flag)
    }
    #[inline(always)]
    fn set_flag(&mut self, flag: SregFlag, value: bool) {
        self.core.flags.set(flag, value);
    }
    #[inline(always)]
    fn force_flag(&mut self, flag: SregFlag, on: bool) {
        self.core.flags.set(flag, on);
        if flag as u8 == SregFlag::I as u8 && on {
            self.hold_interrupts();
        }
    }
    #[inline(always)]
    fn carry(&self) -> ByteValue {
        ByteValue(self.core.flags.carries as u8 >> 7)
    }
    #[inline(always)]
    fn not_zero(&self) -> ByteValue {
        ByteValue(self.core.flags.z as u8)
    }
    #[inline(always)]
    fn set_c(&mut self, carry: ByteValue) {
        self.core.flags.set_c(carry.0.into());
    }
    #[inline(always)]
    fn set_carries(&mut self, carries: ByteValue) {
        self.core.flags.carries = carries.0.into();
    }
    #[inline(always)]
    fn set_z(&mut self, word: ByteValue) {
        self.core.flags.z = word.0.into();
    }
    #[inline(always)]
    fn set_nzv(&mut self, n: ByteValue, z: ByteValue, v: ByteValue) {
        let flags = &mut self.core.flags;
        (flags.n, flags.z, flags.v, flags.s) = (n.0.into(), z.0.into(), v.0.into(), 0);
    }
    #[inline(always)]
    fn load(&mut self, addr: WideValue) -> ByteValue {
        let addr = addr.0;
        let i = addr.wrapping_sub(RAM_START as u16);
        let value = if i < self.data.ram_len { self.data.bytes[ram(i)] } else { self.read_register(addr) };
        self.report_access(addr, value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn store(&mut self, addr: WideValue, value: ByteValue) {
        let (addr, value) = (addr.0, value.0);
        self.report_access(addr, value, true);
        let i = addr.wrapping_sub(RAM_START as u16);
        if i < self.data.ram_len {
            self.data.bytes[ram(i)] = value;
        } else {
            self.write_register(addr, value);
        }
    }
    #[inline(always)]
    fn io_read(&mut self, a: u8) -> ByteValue {
        let addr = u16::from(a & 0x3F) + 0x20;
        let value = self.read_register(addr);
        self.report_access(addr, value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn io_write(&mut self, a: u8, value: ByteValue) {
        let value = value.0;
        let addr = u16::from(a & 0x3F) + 0x20;
        self.report_access(addr, value, true);
        self.write_register(addr, value);
    }
    #[inline(always)]
    fn io_write_bit(&mut self, a: u8, b: u8, on: bool) {
        let addr = u16::from(a & 0x1F) + 0x20;
        let mask = 1u8 << (b & 7);
        let value = if on { mask } else { 0 };
        self.report_access(addr, value, true);
        let effect = self.bus.write_bits(addr, mask, value, self.access_cycle());
        self.apply_bus_effect(effect);
    }
    #[inline(always)]
    fn code_byte(&mut self, addr: WideValue) -> ByteValue {
        ByteValue(code_byte(self.code, self.bus, addr.0.into(), self.core.pc, self.core.clock.now()))
    }
    #[inline(always)]
    fn far_code_byte(&mut self, addr: WideValue, inc: bool) -> ByteValue {
        ByteValue(far_code_byte(self.code, self.bus, addr.0, inc, self.core.pc, self.core.clock.now()))
    }
    #[inline(always)]
    fn store_program(&mut self) {
        let pair = |low: usize| u16::from_le_bytes([self.data.bytes[low], self.data.bytes[low + 1]]);
        let (z, data) = (pair(30), pair(0));
        let pc = 2 * (self.core.pc.wrapping_sub(1) & self.code.mask());
        self.bus.store_program(z, data, pc, self.core.clock.now());
        self.core.clock.expire();
    }
    #[inline(always)]
    fn sp(&self) -> WideValue {
        WideValue(self.core.sp)
    }
    #[inline(always)]
    fn set_sp(&mut self, sp: WideValue) {
        self.core.sp = sp.0;
    }
    #[inline(always)]
    fn next_pc(&self) -> WideValue {
        WideValue((self.core.pc & self.code.mask()) as u16)
    }
    #[inline(always)]
    fn sleep(&mut self) {
        self.core.is_sleeping = self.bus.sleep(self.access_cycle());
        self.core.clock.expire();
    }
    #[inline(always)]
    fn clear_watchdog(&mut self) {
        let at = self.access_cycle();
        self.bus.clear_watchdog(at);
        self.core.clock.expire();
    }
}

/// Executes `$op` on `$m`. `$other` runs for kinds without a row.
macro_rules! execute_op {
    ($m:ident, $op:ident, $other:expr) => {
        avr_table!(dispatch { ($m, $op, AvrOpKind, $op.kind, $other) })
    };
}

impl<P: Probe> Executor<'_, P> {
    /// Executes instructions until the deadline; returns the registers of the core.
    #[inline(never)]
    pub(crate) fn burst(self, ops: &[AvrOp; MAX_WORDS]) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        emu_core::burst_loop!(m, op: AvrOpKind = ops[m.core.pc as u16 as usize], m.core.pc & m.code.mask(), {
            if P::LINT {
                m.lint(op);
            }
            execute_op!(m, op, emu_core::leave_burst!(m));
        });
        executor.core
    }

    /// Executes the given op instead of the one in the op array. A kind without a row does nothing.
    #[inline(never)]
    pub(crate) fn single(self, op: PredecodedOp<AvrOpKind>) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        let op = &op;
        if P::LINT {
            m.lint(op);
        }
        execute_op!(m, op, ());
        executor.core
    }

    /// Enters the interrupt at the program word `vector`: pushes the return address, clears I, takes 4 cycles
    /// (data sheet 7.7.1).
    #[inline(never)]
    pub(crate) fn enter_interrupt(self, vector: u32) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        if P::LINT {
            m.lint_interrupt(vector);
        }
        m.charge(4);
        push_pc(m);
        m.core.flags.set(SregFlag::I, false);
        m.core.pc = vector;
        executor.core
    }
}
