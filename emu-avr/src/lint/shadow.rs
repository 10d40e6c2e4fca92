//! The shadow machine: runs instruction bodies on unknown bits before they run on the real machine.

use emu_core::dispatch;
use emu_core::lint::Lint;
use emu_core::machine::BodyMachine;

use super::value::{TrackedBit, TrackedByte, TrackedPair, UnknownBits};
use super::{LintTracker, PORT_COUNT, SETTLE_CYCLES};
use crate::chips::{RegisterSlot, SocRegister, SplitBit};
#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::executor::{CoreRegisters, DataMemory, RAM_START, SPH, SPL, SREG, ram};
use crate::flags::SregFlag;
use crate::isa::{AvrOp, AvrOpKind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};
use crate::periph::{adc, timers, usart};
use crate::soc::AvrSoc;

/// The shadow machine for one instruction.
pub(super) struct ShadowMachine<'a> {
    hot: &'a CoreRegisters,
    data: &'a DataMemory,
    soc: &'a AvrSoc,
    live: &'a mut LintTracker,
    sp: u16,
    /// Word address of the next instruction.
    next: u16,
    /// True if the bytes that the instruction stores are pushed on the stack.
    pushes: bool,
}

impl<'a> ShadowMachine<'a> {
    /// Returns a shadow machine for the instruction at the tracker's `pc`.
    pub(super) fn new(
        hot: &'a CoreRegisters,
        data: &'a DataMemory,
        soc: &'a AvrSoc,
        live: &'a mut LintTracker,
    ) -> Self {
        ShadowMachine { hot, data, soc, sp: hot.sp, next: live.pc.wrapping_add(1) as u16, live, pushes: false }
    }

    /// Runs the body of `op` and updates the unknown bits.
    pub(super) fn execute_op(&mut self, op: AvrOp) {
        self.pushes = matches!(op.kind, AvrOpKind::Push | AvrOpKind::Call | AvrOpKind::Rcall | AvrOpKind::Icall);
        let [d, r, _] = op.args.map(|arg| usize::from(arg % 32));
        let (before, carry) = (self.live.regs[d], self.live.flags[SregFlag::C as usize]);
        let same = d == r;
        // The result of combining a register with itself does not depend on its value.
        let alike = same
            && matches!(
                op.kind,
                AvrOpKind::Eor | AvrOpKind::Sub | AvrOpKind::Sbc | AvrOpKind::Cp | AvrOpKind::Cpc | AvrOpKind::Cpse
            );
        if alike {
            self.live.regs[d] = UnknownBits::NONE;
        }
        self.run_body(op);
        match op.kind {
            AvrOpKind::Cp | AvrOpKind::Cpc | AvrOpKind::Cpse if alike => self.live.regs[d] = before,
            // A call of the next instruction reserves two bytes of stack; the pushed address is never used.
            AvrOpKind::Rcall if op.args[..2] == self.next.to_le_bytes() => {
                self.live.forget(self.sp.wrapping_add(1), self.hot.sp)
            }
            // LSL and ROL are ADD and ADC of a register with itself; as shifts, their unknown bits are exact.
            AvrOpKind::Add | AvrOpKind::Adc if same => {
                let low =
                    if op.kind == AvrOpKind::Adc && carry.bits != 0 { carry.with_bits(1) } else { UnknownBits::NONE };
                let after = self.live.regs[d];
                self.live.regs[d] = after.or_else(low).with_bits(before.bits << 1 | low.bits);
            }
            _ => {}
        }
    }

    fn run_body(&mut self, op: AvrOp) {
        let (m, op) = (self, &op);
        avr_table!(dispatch { (m, op, AvrOpKind, op.kind, {}) });
    }

    /// Pushes the return address of an interrupt.
    pub(super) fn interrupt(&mut self) {
        self.pushes = true;
        push_pc(self);
    }

    /// Returns the byte of RAM at a data address.
    fn byte(&self, addr: u16) -> u8 {
        if addr < RAM_START as u16 { self.soc.low_at(addr) } else { self.data.bytes[ram(addr - RAM_START as u16)] }
    }

    /// Returns the value of avr-libc's variable for the end of the heap, or 0 if the program has none.
    fn heap(&self) -> u16 {
        self.live
            .program_facts
            .heap_end_variable
            .map_or(0, |addr| u16::from_le_bytes([self.byte(addr), self.byte(addr.wrapping_add(1))]))
    }

    fn check_push(&mut self, addr: u16) {
        let heap = self.heap();
        self.live.check_push(addr, heap);
    }

    /// Checks a frame, made by moving SP, when it is first used: its bytes become unknown.
    fn check_frame(&mut self) {
        let Some(from) = self.live.stack.moved_from.take() else { return };
        if self.sp < from {
            self.live.forget(self.sp + 1, from);
            self.check_push(self.sp + 1);
        }
    }

    /// Returns the unknown bits of a read at a data address.
    fn doubt_at(&mut self, addr: u16) -> UnknownBits {
        if let Some(doubt) = self.live.ram_doubt(addr) {
            return *doubt;
        }
        if addr == SREG {
            let bits = (0..8).fold(0, |bits, i| bits | u8::from(self.live.flags[i].bits != 0) << i);
            return self.live.flags.iter().fold(UnknownBits::NONE, |all, &flag| all.or_else(flag)).with_bits(bits);
        }
        let Some(port) = self.live.part.input_port(addr) else { return UnknownBits::NONE };
        let floats = self.soc.floating(port) & !self.live.reported_pins[port % PORT_COUNT];
        UnknownBits::at(addr, floats)
    }

    /// Handles a write of the bits in `mask` to a data address outside RAM.
    fn write(&mut self, addr: u16, value: TrackedByte, mask: u8) {
        match addr {
            SREG => {
                for (i, flag) in self.live.flags.iter_mut().enumerate() {
                    *flag = value.doubt.with_bits(value.doubt.bits >> i & 1);
                }
                self.live.check_vectors = true;
            }
            SPL | SPH => {
                self.live.report_use(value.doubt);
                let heap = self.heap();
                self.live.move_stack(self.sp, value.from_stack_pointer, heap);
            }
            _ => self.write_register(addr, value, mask),
        }
    }

    /// Handles a write to a register of the chip, or to a reserved address.
    fn write_register(&mut self, addr: u16, value: TrackedByte, mask: u8) {
        self.live.report_use(value.doubt.with_bits(value.doubt.bits & mask));
        // After a reported stack overflow, overwritten registers give no new information.
        let over = self.live.stack.overflow_reported;
        let Some(present) = self.live.presence.existing_bits(addr, value.byte) else {
            if !over {
                let addr = *self.live.reserved_writes.entry(self.live.pc).or_insert(addr);
                self.live.add_finding(Lint::UnimplementedAddress { addr });
            }
            return;
        };
        let reserved = value.byte & !value.doubt.bits & mask & !present;
        if reserved != 0 && !over {
            self.live.add_finding(Lint::ReservedBits { addr, bits: reserved });
        }
        self.live.check_vectors = true;
        let (now, pc) = (self.hot.clock.now(), self.live.pc);
        match self.live.part.register_slot(addr) {
            RegisterSlot::Usart(n, usart::UsartRegister::UDR) => {
                let n = usize::from(n) % 2;
                if self.soc.sends_at(n, now) {
                    self.live.check_baud(self.soc, n, now, pc);
                }
            }
            RegisterSlot::Usart(n, _) | RegisterSlot::Ursel(n) => {
                self.live.pending_bauds[usize::from(n) % 2] = (now + SETTLE_CYCLES, pc)
            }
            RegisterSlot::Split(bits) => {
                for &SplitBit { slot: site, .. } in bits {
                    if let RegisterSlot::Usart(n, _) = site {
                        self.live.pending_bauds[usize::from(n) % 2] = (now + SETTLE_CYCLES, pc);
                    }
                }
            }
            RegisterSlot::Own(SocRegister::CLKPR) => self.live.pending_bauds = [(now + SETTLE_CYCLES, pc); 2],
            RegisterSlot::Timer(n, timers::TimerRegister::ICRL) if !over && !self.soc.icr_is_top(n) => {
                self.live.add_finding(Lint::CaptureWritten { addr });
            }
            RegisterSlot::Adc(adc::AdcRegister::ADMUX) if !over => {
                let absent = self.soc.absent_channel(value.byte);
                absent.into_iter().for_each(|channel| self.live.add_finding(Lint::MissingChannel { channel }));
            }
            _ => {}
        }
    }
}

impl BodyMachine for ShadowMachine<'_> {
    type Bit = TrackedBit;
    type Byte = TrackedByte;
    type Wide = TrackedPair;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, _: u32) {}
    fn jump(&mut self, _: u32) {}
    fn goto(&mut self, target: TrackedPair) {
        self.live.report_use(target.doubt());
    }
    fn branch_if(&mut self, condition: TrackedBit, _: u32) {
        self.live.report_use(condition.doubt);
    }
    fn skip_if(&mut self, condition: TrackedBit, _: u32) {
        self.live.report_use(condition.doubt);
    }
}

impl AvrMachine for ShadowMachine<'_> {
    fn reg(&self, r: u8) -> TrackedByte {
        let r = usize::from(r % 32);
        TrackedByte {
            byte: self.data.bytes[r],
            doubt: self.live.regs[r],
            from_stack_pointer: self.live.from_sp >> r & 1 == 1,
        }
    }
    fn set_reg(&mut self, r: u8, value: TrackedByte) {
        let r = usize::from(r % 32);
        self.live.regs[r] = value.doubt;
        self.live.from_sp = self.live.from_sp & !(1 << r) | u32::from(value.from_stack_pointer) << r;
    }
    fn flag(&self, flag: SregFlag) -> TrackedBit {
        TrackedBit { on: self.hot.flags.get(flag), doubt: self.live.flags[flag as usize] }
    }
    fn set_flag(&mut self, flag: SregFlag, value: TrackedBit) {
        self.live.flags[flag as usize] = value.doubt;
    }
    fn force_flag(&mut self, flag: SregFlag, _: bool) {
        self.live.flags[flag as usize] = UnknownBits::NONE;
    }
    fn carry(&self) -> TrackedByte {
        let flag = self.flag(SregFlag::C);
        let doubt = flag.doubt.with_bits((flag.doubt.bits != 0).into());
        TrackedByte { byte: flag.on.into(), doubt, from_stack_pointer: false }
    }
    fn not_zero(&self) -> TrackedByte {
        let flag = self.flag(SregFlag::Z);
        let doubt = flag.doubt.with_bits((flag.doubt.bits != 0).into());
        TrackedByte { byte: (!flag.on).into(), doubt, from_stack_pointer: false }
    }
    fn set_c(&mut self, carry: TrackedByte) {
        self.live.flags[SregFlag::C as usize] = carry.doubt.with_bits(carry.doubt.bits & 0x80);
    }
    fn set_carries(&mut self, carries: TrackedByte) {
        self.set_c(carries);
        self.live.flags[SregFlag::H as usize] = carries.doubt.with_bits(carries.doubt.bits & 0x08);
    }
    fn set_z(&mut self, word: TrackedByte) {
        use emu_core::machine::ByteOps;
        self.live.flags[SregFlag::Z as usize] = word.is_zero().doubt;
    }
    fn set_nzv(&mut self, n: TrackedByte, z: TrackedByte, v: TrackedByte) {
        let sign = |value: TrackedByte| value.doubt.with_bits(value.doubt.bits & 0x80);
        self.set_z(z);
        self.live.flags[SregFlag::N as usize] = sign(n);
        self.live.flags[SregFlag::V as usize] = sign(v);
        self.live.flags[SregFlag::S as usize] = sign(n).or_else(sign(v));
    }
    fn load(&mut self, addr: TrackedPair) -> TrackedByte {
        self.live.report_use(addr.doubt());
        self.check_frame();
        let addr = addr.number();
        TrackedByte { byte: 0, doubt: self.doubt_at(addr), from_stack_pointer: matches!(addr, SPL | SPH) }
    }
    fn store(&mut self, addr: TrackedPair, value: TrackedByte) {
        self.live.report_use(addr.doubt());
        self.check_frame();
        let (addr, first) = (addr.number(), self.live.part.chip.ram_start);
        match self.live.ram_doubt(addr) {
            Some(cell) => *cell = value.doubt,
            // A stack below RAM is reported as a stack overflow, not as a write to registers.
            None if self.pushes && addr < first => {}
            None => self.write(addr, value, 0xFF),
        }
        if addr < 32 {
            self.live.from_sp &= !(1 << addr);
        }
    }
    fn io_read(&mut self, a: u8) -> TrackedByte {
        let addr = u16::from(a & 0x3F) + 0x20;
        TrackedByte { byte: 0, doubt: self.doubt_at(addr), from_stack_pointer: matches!(addr, SPL | SPH) }
    }
    fn io_write(&mut self, a: u8, value: TrackedByte) {
        self.write(u16::from(a & 0x3F) + 0x20, value, 0xFF);
    }
    fn io_write_bit(&mut self, a: u8, b: u8, on: bool) {
        let mask = 1 << (b & 7);
        self.write(u16::from(a & 0x1F) + 0x20, TrackedByte::known(if on { mask } else { 0 }), mask);
    }
    fn code_byte(&mut self, addr: TrackedPair) -> TrackedByte {
        self.live.report_use(addr.doubt());
        TrackedByte::known(0)
    }
    fn far_code_byte(&mut self, addr: TrackedPair, _: bool) -> TrackedByte {
        self.code_byte(addr)
    }
    fn store_program(&mut self) {
        self.live.report_use(self.live.regs[usize::from(Z)].or_else(self.live.regs[usize::from(Z) + 1]));
    }
    fn sp(&self) -> TrackedPair {
        TrackedPair::known(self.sp)
    }
    fn set_sp(&mut self, sp: TrackedPair) {
        // The stack grows down: the byte was pushed at the old SP.
        if self.pushes {
            self.check_push(self.sp);
        }
        self.sp = sp.number();
    }
    fn next_pc(&self) -> TrackedPair {
        TrackedPair::known(0)
    }
    fn sleep(&mut self) {}
    fn clear_watchdog(&mut self) {}
}
