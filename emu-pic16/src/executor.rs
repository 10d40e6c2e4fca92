//! The hot loop: executes single instructions on the machine.
//!
//! [`Executor`] holds the registers of the core in local variables whose address never escapes, so the
//! compiler keeps them in host registers. RAM is borrowed. Everything that a body calls is inlined; slow
//! paths are outlined and get scalars only.

use emu_core::cpu::{Bus, BusEffect, Probe};
use emu_core::machine::{BodyMachine, ByteValue, WideValue};
use emu_core::table::{Operand, RamOperand};
use emu_core::{RegisterRead, dispatch};

use crate::core_state::{BANK, CoreRegisters, PD, TO};
#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::isa::{Pic16Op, Pic16OpKind, SPAN, pic16_table};
use crate::lint::LintState;
use crate::operands::{B, F, FileAddress, JumpTarget, K, RamCell};
use crate::periph::map::Sfr;
use crate::soc::Pic16Soc;

/// Number of addresses of data memory.
pub(crate) const DATA_ADDRESSES: usize = 0x200;

/// Number of ops of all banks: each bank has its own, because an address has a different meaning in each.
/// Half of the ops are past the end of program memory.
pub(crate) const OPS: usize = 0x1_0000;

/// Index of data memory in the chip's list of memories.
const DATA_SPACE: u8 = 1;

/// Context in which instructions execute: the registers of the core by value, everything else borrowed.
pub(crate) struct Executor<'a, P: Probe> {
    /// Registers of the core, by value.
    pub core: CoreRegisters,
    /// RAM by canonical address. It is a slice, whose length is checked in one comparison.
    pub ram: &'a mut [u8],
    /// Return addresses; `core.sp` is the index of the next push.
    pub stack: &'a mut [u16; 8],
    /// Resolved file address of every address of data memory.
    pub file_addresses: &'a [FileAddress; DATA_ADDRESSES],
    /// Lowest address of the byte at each address.
    pub lowest_addresses: &'a [u16; DATA_ADDRESSES],
    /// Program memory.
    pub words: &'a [u16; SPAN],
    /// What the lints remember from earlier instructions.
    pub lints: &'a mut LintState,
    /// The chip around the core.
    pub bus: &'a mut Pic16Soc,
    /// The observer of the run.
    pub probe: &'a mut P,
}

const INDF: u16 = FileAddress::sfr(Sfr::INDF).0;
const STATUS: u16 = FileAddress::sfr(Sfr::STATUS).0;
const FSR: u16 = FileAddress::sfr(Sfr::FSR).0;
const PCL: u16 = FileAddress::sfr(Sfr::PCL).0;
/// File address of PCLATH.
pub(crate) const PCLATH: u16 = FileAddress::sfr(Sfr::PCLATH).0;
const UNIMPLEMENTED: u16 = FileAddress::NONE.0;
/// Masks of bits in STATUS.
const C: u8 = 0x01;
const Z: u8 = 0x04;
const RP0: u8 = 0x20;
const RP1: u8 = 0x40;
/// First file address that is a register of the chip.
pub(crate) const REGISTERS: u16 = INDF;

/// The instruction that is being executed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RunningInstruction {
    /// Its word address.
    pub(crate) pc: u32,
    /// Its program word.
    pub(crate) word: u16,
}

impl<P: Probe> Executor<'_, P> {
    /// Returns the cycle in which the current instruction reads and writes: its first. Only instructions
    /// without accesses have been charged more than one cycle by then.
    #[inline(always)]
    pub(crate) const fn cycle(&self) -> u64 {
        self.core.clock.now().wrapping_sub(1)
    }

    #[inline(always)]
    fn apply_bus_effect(&mut self, effect: BusEffect) {
        if effect != BusEffect::NONE {
            self.core.clock.expire();
        }
    }

    /// Reports an access to data memory to the probe.
    #[inline(always)]
    fn report_access(&mut self, value: u8, write: bool) {
        if P::DATA && (write || P::DATA_READS) {
            let at = self.cycle();
            let addr = self.address();
            if self.probe.on_data_access(at, DATA_SPACE, addr, value, write) {
                self.core.stop_requested = true;
                self.core.clock.expire();
            }
        }
    }

    /// Returns the address and the word of the current instruction.
    #[inline(always)]
    pub(crate) const fn running_instruction(&self) -> RunningInstruction {
        let pc = self.core.bank_and_pc.wrapping_sub(1) % SPAN as u32;
        RunningInstruction { pc, word: self.words[pc as usize] }
    }

    /// Returns the address of data memory that the current instruction accesses; the lowest one if the byte
    /// has several.
    #[inline(always)]
    pub(crate) const fn address(&self) -> u16 {
        let word = self.running_instruction().word;
        let addr = match word {
            0x62 => 0x81,
            0x65..=0x67 => word & 7 | 0x80,
            _ if word & 0x7F == 0 => self.core.indirect_address as u16,
            _ => ((self.core.bank_and_pc & BANK) >> 7) as u16 | word & 0x7F,
        };
        self.lowest_addresses[addr as usize % DATA_ADDRESSES]
    }

    /// Continues execution at `target` instead of the next instruction.
    #[inline(always)]
    fn jump_to(&mut self, target: u32) {
        let next = self.core.pc();
        self.core.set_pc(target);
        if P::FLOW {
            self.probe.on_branch(next, self.core.pc(), true);
        }
    }

    #[inline(always)]
    fn push_pc(&mut self) {
        self.stack[self.core.sp as usize % 8] = self.core.pc() as u16;
        self.core.sp = (self.core.sp + 1) % 8;
    }

    #[inline(always)]
    fn write_ram_byte(&mut self, addr: u16, value: u8) {
        if let Some(byte) = self.ram.get_mut(usize::from(addr)) {
            *byte = value;
        }
    }

    /// Writes a register other than STATUS.
    #[inline(always)]
    fn write_register(&mut self, file_address: u16, value: u8) {
        if P::LINT {
            self.lint_write(file_address, value);
        }
        match file_address {
            FSR => self.core.indirect_address = self.core.indirect_address & 0x100 | u32::from(value),
            PCLATH => self.core.pclath = u32::from(value) & 0x1F,
            PCL => {
                self.jump_to(self.core.pclath << 8 | u32::from(value));
                self.core.clock.charge(1);
            }
            INDF | UNIMPLEMENTED => {}
            _ => {
                let at = self.cycle();
                let effect = write_bus(self.bus, file_address, value, at);
                self.apply_bus_effect(effect);
            }
        }
    }
}

/// Reads a register of the chip.
#[inline(never)]
fn read_bus(bus: &mut Pic16Soc, file_address: u16, at: u64) -> RegisterRead {
    bus.read(file_address - REGISTERS, at)
}

/// Writes a register of the chip.
#[inline(never)]
fn write_bus(bus: &mut Pic16Soc, file_address: u16, value: u8, at: u64) -> BusEffect {
    bus.write(file_address - REGISTERS, value, at)
}

impl<P: Probe> BodyMachine for Executor<'_, P> {
    type Bit = bool;
    type Byte = ByteValue;
    type Wide = WideValue;

    #[inline(always)]
    fn begin(&mut self, words: u32, cycles: u32) {
        self.advance(words);
        // A skip instruction takes one cycle, and one more if it skips.
        self.charge(if cycles == 0 { 1 } else { cycles });
    }
    #[inline(always)]
    fn advance(&mut self, words: u32) {
        self.core.bank_and_pc = self.core.bank_and_pc.wrapping_add(words);
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
        let skipped = if condition { words } else { 0 };
        let next = self.core.pc();
        self.core.bank_and_pc = self.core.bank_and_pc.wrapping_add(skipped);
        // No branch here, because the skip is hard to predict for the host.
        if P::FLOW {
            self.probe.on_branch(next, self.core.pc(), condition);
        }
        self.core.clock.charge(skipped);
    }
}

impl<P: Probe> Pic16Machine for Executor<'_, P> {
    #[inline(always)]
    fn w(&self) -> ByteValue {
        ByteValue(self.core.w as u8)
    }
    #[inline(always)]
    fn set_w(&mut self, value: ByteValue) {
        self.core.w = value.0.into();
    }
    #[inline(always)]
    fn carry(&self) -> bool {
        self.core.c != 0
    }
    #[inline(always)]
    fn set_carry(&mut self, value: bool) {
        self.core.c = value.into();
    }
    #[inline(always)]
    fn set_z(&mut self, value: ByteValue) {
        self.core.z = value.0.into();
    }
    #[inline(always)]
    fn set_carries(&mut self, carries: ByteValue) {
        let carries = u32::from(carries.0);
        (self.core.c, self.core.dc) = (carries >> 7, carries & 8);
    }
    #[inline(always)]
    fn word_from_bit(bit: bool) -> ByteValue {
        ByteValue(bit.into())
    }
    #[inline(always)]
    fn resolve(&mut self, file_address: FileAddress) -> FileAddress {
        if file_address.0 == INDF {
            self.file_addresses[self.core.indirect_address as usize % DATA_ADDRESSES]
        } else {
            file_address
        }
    }
    #[inline(always)]
    fn read_file(&mut self, file_address: FileAddress) -> ByteValue {
        let value = match file_address.0 {
            ..REGISTERS => self.ram.get(usize::from(file_address.0)).copied().unwrap_or(0),
            STATUS => self.core.status(),
            FSR => self.core.indirect_address as u8,
            PCL => self.core.bank_and_pc as u8,
            PCLATH => self.core.pclath as u8,
            INDF | UNIMPLEMENTED => 0,
            register => {
                let at = self.cycle();
                if P::LINT {
                    self.lint_read(register);
                }
                let RegisterRead { value, effect } = read_bus(self.bus, register, at);
                self.apply_bus_effect(effect);
                value
            }
        };
        self.report_access(value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn write_file(&mut self, file_address: FileAddress, value: ByteValue) {
        self.report_access(value.0, true);
        match file_address.0 {
            ..REGISTERS => self.write_ram_byte(file_address.0, value.0),
            STATUS => self.core.set_status(value.0.into()),
            other => self.write_register(other, value.0),
        }
    }
    #[inline(always)]
    fn write_file_with_flags(&mut self, file_address: FileAddress, value: ByteValue) {
        self.report_access(value.0, true);
        match file_address.0 {
            ..REGISTERS => self.write_ram_byte(file_address.0, value.0),
            STATUS => self.core.set_banks(value.0.into()),
            other => self.write_register(other, value.0),
        }
    }
    // The STATUS bits that programs test most often, without packing all of STATUS.
    #[inline(always)]
    fn read_file_bit(&mut self, file_address: FileAddress, mask: u8) -> bool {
        match (file_address.0, mask) {
            (STATUS, C) if !P::DATA => self.core.c != 0,
            (STATUS, Z) if !P::DATA => self.core.z as u8 == 0,
            _ => Self::is_any_bit_set(self.read_file(file_address), mask),
        }
    }
    #[inline(always)]
    fn write_file_bit(&mut self, file_address: FileAddress, mask: u8, on: bool) {
        match (file_address.0, mask) {
            (STATUS, C) if !P::DATA => self.core.c = on.into(),
            (STATUS, RP0 | RP1) if !P::DATA => {
                let bank = u32::from(mask) << 9;
                self.core.bank_and_pc = if on { self.core.bank_and_pc | bank } else { self.core.bank_and_pc & !bank };
            }
            _ => {
                let value = self.read_file(file_address).0;
                self.write_file(file_address, ByteValue(if on { value | mask } else { value & !mask }));
            }
        }
    }
    #[inline(always)]
    fn read_ram(&mut self, addr: u16) -> ByteValue {
        let value = self.ram.get(usize::from(addr)).copied().unwrap_or(0);
        self.report_access(value, false);
        ByteValue(value)
    }
    #[inline(always)]
    fn write_ram(&mut self, addr: u16, value: ByteValue) {
        self.report_access(value.0, true);
        self.write_ram_byte(addr, value.0);
    }
    #[inline(always)]
    fn is_any_bit_set(value: ByteValue, mask: u8) -> bool {
        value.0 & mask != 0
    }
    #[inline(always)]
    fn skip(&mut self, condition: bool) {
        self.skip_if(condition, 1);
    }
    #[inline(always)]
    fn jump_within_page(&mut self, target: u16) {
        let target = (self.core.pclath & 0x18) << 8 | u32::from(target);
        if P::LINT {
            self.lint_jump(target);
        }
        self.jump_to(target);
    }
    #[inline(always)]
    fn push(&mut self) {
        if P::LINT {
            let pc = self.running_instruction().pc;
            self.lint_push(pc);
        }
        self.push_pc();
    }
    #[inline(always)]
    fn pop(&mut self) {
        if P::LINT {
            self.lint_pop();
        }
        self.core.sp = self.core.sp.wrapping_sub(1) % 8;
        self.jump_to(self.stack[self.core.sp as usize % 8].into());
    }
    #[inline(always)]
    fn end_interrupt(&mut self) {
        if P::LINT {
            self.lint_interrupt_ended();
        }
        let first = self.cycle().wrapping_sub(1);
        self.bus.interrupt_ended(first);
        self.core.clock.expire();
    }
    #[inline(always)]
    fn clear_watchdog(&mut self) {
        self.core.timeout_bits = TO | PD;
        let at = self.cycle();
        self.bus.clear_watchdog(at);
        self.core.clock.expire();
    }
    #[inline(always)]
    fn enter_standby(&mut self) {
        let at = self.cycle();
        if self.bus.sleep(at) {
            self.core.timeout_bits = TO;
        } else if P::LINT {
            self.lint_no_sleep();
        }
        self.core.clock.expire();
    }
}

/// Executes `$op` on `$m`. `$other` runs for kinds without a row.
macro_rules! execute_op {
    ($m:ident, $op:ident, $other:expr) => {
        pic16_table!(dispatch { ($m, $op, Pic16OpKind, $op.kind, $other) })
    };
}

/// Executes a test and, unless it skips or the deadline is reached, the GOTO after it.
macro_rules! then_goto {
    ($m:ident, $ops:ident, $test:expr) => {{
        let next = $m.core.bank_and_pc.wrapping_add(1);
        $m.begin(1, 0);
        $test;
        if !P::INSN && $m.core.bank_and_pc == next && $m.core.clock.is_before_deadline() {
            let target = JumpTarget::decode_next(&$ops[next as u16 as usize], &mut 0);
            $m.begin(1, 2);
            goto($m, target);
        }
    }};
}

/// Decodes the operands of a test.
#[inline(always)]
fn ram_of(op: &Pic16Op) -> RamCell {
    F::decode_next_in_ram(op, &mut 0)
}
#[inline(always)]
fn file_of(op: &Pic16Op) -> F {
    F::decode_next(op, &mut 0)
}
#[inline(always)]
fn bit_of(op: &Pic16Op) -> B {
    B::decode_next(op, &mut 2)
}

impl<P: Probe> Executor<'_, P> {
    /// Executes instructions until the deadline; returns the registers of the core.
    #[inline(never)]
    pub(crate) fn burst(self, ops: &[Pic16Op; OPS]) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        emu_core::burst_loop!(m, op: Pic16OpKind = ops[m.core.bank_and_pc as u16 as usize], m.core.pc(), {
            execute_op!(
                m,
                op,
                match op.kind {
                    Pic16OpKind::BtfscGoto => then_goto!(m, ops, skip_bit(m, ram_of(op), bit_of(op), false)),
                    Pic16OpKind::BtfssGoto => then_goto!(m, ops, skip_bit(m, ram_of(op), bit_of(op), true)),
                    Pic16OpKind::DecfszGoto => then_goto!(m, ops, decfsz(m, ram_of(op), false)),
                    Pic16OpKind::IncfszGoto => then_goto!(m, ops, incfsz(m, ram_of(op), false)),
                    Pic16OpKind::BtfscSfrGoto => then_goto!(m, ops, skip_bit(m, file_of(op), bit_of(op), false)),
                    Pic16OpKind::BtfssSfrGoto => then_goto!(m, ops, skip_bit(m, file_of(op), bit_of(op), true)),
                    _ => emu_core::leave_burst!(m),
                }
            );
        });
        executor.core
    }

    /// Executes the given op instead of the one in the op array. A kind without a row does nothing.
    #[inline(never)]
    pub(crate) fn single(self, op: Pic16Op) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        let op = &op;
        execute_op!(m, op, ());
        executor.core
    }

    /// Enters the interrupt: charges `cycles`, pushes the return address, jumps to the vector.
    #[inline(never)]
    pub(crate) fn enter_interrupt(self, cycles: u32) -> CoreRegisters {
        let mut executor = self;
        let m = &mut executor;
        m.charge(cycles);
        if P::LINT {
            m.lint_interrupt();
        }
        m.push_pc();
        m.core.set_pc(4);
        executor.core
    }
}
