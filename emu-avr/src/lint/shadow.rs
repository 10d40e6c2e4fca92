//! The machine on which bodies run before they run on the real one: it keeps only what is known and what is not.

use emu_core::dispatch;
use emu_core::lint::Lint;
use emu_core::machine::Machine;

use super::value::{Bit, Doubt, Pair, Value};
use super::{Live, PORTS, SETTLED};
use crate::chips::{Own, Site};
#[allow(clippy::wildcard_imports)]
use crate::exec::*;
use crate::flags::Flag;
use crate::isa::{AvrOp, Kind, avr_table};
use crate::operands::{A, Abs, B, D16, K, Q, R, Rel, Rh, Rm, Rp, Rw, Skip};
use crate::periph::{adc, timers, usart};
use crate::soc::Soc;
use crate::turn::{Data, Hot, RAM, SPH, SPL, SREG, ram};

/// One instruction on the machine of what is known.
pub(super) struct Shadow<'a> {
    hot: &'a Hot,
    data: &'a Data,
    soc: &'a Soc,
    live: &'a mut Live,
    sp: u16,
    /// The next instruction.
    next: u16,
    /// What it stores is pushed.
    pushes: bool,
}

impl<'a> Shadow<'a> {
    pub(super) fn new(hot: &'a Hot, data: &'a Data, soc: &'a Soc, live: &'a mut Live) -> Self {
        Shadow { hot, data, soc, sp: hot.sp, next: live.pc.wrapping_add(1) as u16, live, pushes: false }
    }

    /// Runs the body of `op`.
    pub(super) fn execute(&mut self, op: AvrOp) {
        self.pushes = matches!(op.kind, Kind::Push | Kind::Call | Kind::Rcall | Kind::Icall);
        let [d, r, _] = op.arg.map(|arg| usize::from(arg % 32));
        let (before, carry) = (self.live.regs[d], self.live.flags[Flag::C as usize]);
        let same = d == r;
        // What comes of a register with itself does not depend on what it holds.
        let alike = same && matches!(op.kind, Kind::Eor | Kind::Sub | Kind::Sbc | Kind::Cp | Kind::Cpc | Kind::Cpse);
        if alike {
            self.live.regs[d] = Doubt::NONE;
        }
        self.body(op);
        match op.kind {
            Kind::Cp | Kind::Cpc | Kind::Cpse if alike => self.live.regs[d] = before,
            // A call of the next instruction makes room for two bytes: what it pushes is nobody's address.
            Kind::Rcall if op.arg[..2] == self.next.to_le_bytes() => {
                self.live.forget(self.sp.wrapping_add(1), self.hot.sp)
            }
            // LSL and ROL are sums of a register with itself, which are more exact as what they are.
            Kind::Add | Kind::Adc if same => {
                let low = if op.kind == Kind::Adc && carry.bits != 0 { carry.of(1) } else { Doubt::NONE };
                let after = self.live.regs[d];
                self.live.regs[d] = after.or(low).of(before.bits << 1 | low.bits);
            }
            _ => {}
        }
    }

    fn body(&mut self, op: AvrOp) {
        let (m, op) = (self, &op);
        avr_table!(dispatch { (m, op, op.kind, {}) });
    }

    /// The return address of an interrupt is pushed.
    pub(super) fn interrupt(&mut self) {
        self.pushes = true;
        push_pc(self);
    }

    /// The byte of RAM at a data address.
    fn byte(&self, addr: u16) -> u8 {
        if addr < RAM as u16 { self.soc.low_at(addr) } else { self.data.bytes[ram(addr - RAM as u16)] }
    }

    /// What stands where avr-libc keeps the end of its heap.
    fn heap(&self) -> u16 {
        self.live.ground.heap.map_or(0, |addr| u16::from_le_bytes([self.byte(addr), self.byte(addr.wrapping_add(1))]))
    }

    fn stacked(&mut self, addr: u16) {
        let heap = self.heap();
        self.live.stacked(addr, heap);
    }

    /// A frame that was made by moving the stack pointer is used for the first time: nobody has written it.
    fn frame(&mut self) {
        let Some(from) = self.live.stack.moved_from.take() else { return };
        if self.sp < from {
            self.live.forget(self.sp + 1, from);
            self.stacked(self.sp + 1);
        }
    }

    /// What is not known of what is read at a data address.
    fn doubt(&mut self, addr: u16) -> Doubt {
        if let Some(doubt) = self.live.cell(addr) {
            return *doubt;
        }
        if addr == SREG {
            let bits = (0..8).fold(0, |bits, i| bits | u8::from(self.live.flags[i].bits != 0) << i);
            return self.live.flags.iter().fold(Doubt::NONE, |all, &flag| all.or(flag)).of(bits);
        }
        let Some(port) = self.live.part.input_port(addr) else { return Doubt::NONE };
        let floats = self.soc.floating(port) & !self.live.told_pins[port % PORTS];
        Doubt::at(addr, floats)
    }

    /// The bits of `mask` are written at a data address that is not RAM.
    fn write(&mut self, addr: u16, value: Value, mask: u8) {
        match addr {
            SREG => {
                for (i, flag) in self.live.flags.iter_mut().enumerate() {
                    *flag = value.doubt.of(value.doubt.bits >> i & 1);
                }
                self.live.look = true;
            }
            SPL | SPH => {
                self.live.used(value.doubt);
                let heap = self.heap();
                self.live.move_stack(self.sp, value.stack, heap);
            }
            _ => self.write_chip(addr, value, mask),
        }
    }

    /// A register of the chip, or what is none.
    fn write_chip(&mut self, addr: u16, value: Value, mask: u8) {
        self.live.used(value.doubt.of(value.doubt.bits & mask));
        // What a stack overwrites that was told of says nothing new.
        let over = self.live.stack.over;
        let Some(present) = self.live.part.present(addr, value.byte) else {
            if !over {
                let addr = *self.live.wild.entry(self.live.pc).or_insert(addr);
                self.live.find(Lint::NothingThere { addr });
            }
            return;
        };
        let reserved = value.byte & !value.doubt.bits & mask & !present;
        if reserved != 0 && !over {
            self.live.find(Lint::ReservedBits { addr, bits: reserved });
        }
        self.live.look = true;
        let (now, pc) = (self.hot.time.now(), self.live.pc);
        match self.live.part.site(addr) {
            Site::Usart(n, usart::Reg::UDR) => {
                let n = usize::from(n) % 2;
                if self.soc.sends_at(n, now) {
                    self.live.baud(self.soc, n, now, pc);
                }
            }
            Site::Usart(n, _) | Site::Ursel(n) => self.live.settled[usize::from(n) % 2] = (now + SETTLED, pc),
            Site::Split(bits) => {
                for &(_, site, _) in bits {
                    if let Site::Usart(n, _) = site {
                        self.live.settled[usize::from(n) % 2] = (now + SETTLED, pc);
                    }
                }
            }
            Site::Own(Own::CLKPR) => self.live.settled = [(now + SETTLED, pc); 2],
            Site::Timer(n, timers::Reg::ICRL) if !over && !self.soc.icr_is_top(n) => {
                self.live.find(Lint::CaptureWritten { addr });
            }
            Site::Adc(adc::Reg::ADMUX) if !over => {
                let absent = self.soc.absent_channel(value.byte);
                absent.into_iter().for_each(|channel| self.live.find(Lint::ChannelAbsent { channel }));
            }
            _ => {}
        }
    }
}

impl Machine for Shadow<'_> {
    type Bit = Bit;
    type Word = Value;
    type Wide = Pair;
    fn advance(&mut self, _: u32) {}
    fn charge(&mut self, _: u32) {}
    fn jump(&mut self, _: u32) {}
    fn goto(&mut self, target: Pair) {
        self.live.used(target.doubt());
    }
    fn branch_if(&mut self, condition: Bit, _: u32) {
        self.live.used(condition.doubt);
    }
    fn skip_if(&mut self, condition: Bit, _: u32) {
        self.live.used(condition.doubt);
    }
}

impl AvrMachine for Shadow<'_> {
    fn reg(&self, r: u8) -> Value {
        let r = usize::from(r % 32);
        Value { byte: self.data.bytes[r], doubt: self.live.regs[r], stack: self.live.from_sp >> r & 1 == 1 }
    }
    fn set_reg(&mut self, r: u8, value: Value) {
        let r = usize::from(r % 32);
        self.live.regs[r] = value.doubt;
        self.live.from_sp = self.live.from_sp & !(1 << r) | u32::from(value.stack) << r;
    }
    fn flag(&self, flag: Flag) -> Bit {
        Bit { on: self.hot.flags.get(flag), doubt: self.live.flags[flag as usize] }
    }
    fn set_flag(&mut self, flag: Flag, value: Bit) {
        self.live.flags[flag as usize] = value.doubt;
    }
    fn force_flag(&mut self, flag: Flag, _: bool) {
        self.live.flags[flag as usize] = Doubt::NONE;
    }
    fn carry(&self) -> Value {
        let flag = self.flag(Flag::C);
        let doubt = flag.doubt.of((flag.doubt.bits != 0).into());
        Value { byte: flag.on.into(), doubt, stack: false }
    }
    fn not_zero(&self) -> Value {
        let flag = self.flag(Flag::Z);
        let doubt = flag.doubt.of((flag.doubt.bits != 0).into());
        Value { byte: (!flag.on).into(), doubt, stack: false }
    }
    fn set_c(&mut self, carry: Value) {
        self.live.flags[Flag::C as usize] = carry.doubt.of(carry.doubt.bits & 0x80);
    }
    fn set_carries(&mut self, carries: Value) {
        self.set_c(carries);
        self.live.flags[Flag::H as usize] = carries.doubt.of(carries.doubt.bits & 0x08);
    }
    fn set_z(&mut self, word: Value) {
        use emu_core::machine::WordOps;
        self.live.flags[Flag::Z as usize] = word.is_zero().doubt;
    }
    fn set_nzv(&mut self, n: Value, z: Value, v: Value) {
        let sign = |value: Value| value.doubt.of(value.doubt.bits & 0x80);
        self.set_z(z);
        self.live.flags[Flag::N as usize] = sign(n);
        self.live.flags[Flag::V as usize] = sign(v);
        self.live.flags[Flag::S as usize] = sign(n).or(sign(v));
    }
    fn load(&mut self, addr: Pair) -> Value {
        self.live.used(addr.doubt());
        self.frame();
        let addr = addr.number();
        Value { byte: 0, doubt: self.doubt(addr), stack: matches!(addr, SPL | SPH) }
    }
    fn store(&mut self, addr: Pair, value: Value) {
        self.live.used(addr.doubt());
        self.frame();
        let (addr, first) = (addr.number(), self.live.part.chip.ram_start);
        match self.live.cell(addr) {
            Some(cell) => *cell = value.doubt,
            // A stack that is anywhere else is told of as what it is.
            None if self.pushes && addr < first => {}
            None => self.write(addr, value, 0xFF),
        }
        if addr < 32 {
            self.live.from_sp &= !(1 << addr);
        }
    }
    fn io_read(&mut self, a: u8) -> Value {
        let addr = u16::from(a & 0x3F) + 0x20;
        Value { byte: 0, doubt: self.doubt(addr), stack: matches!(addr, SPL | SPH) }
    }
    fn io_write(&mut self, a: u8, value: Value) {
        self.write(u16::from(a & 0x3F) + 0x20, value, 0xFF);
    }
    fn io_write_bit(&mut self, a: u8, b: u8, on: bool) {
        let mask = 1 << (b & 7);
        self.write(u16::from(a & 0x1F) + 0x20, Value::known(if on { mask } else { 0 }), mask);
    }
    fn code_byte(&mut self, addr: Pair) -> Value {
        self.live.used(addr.doubt());
        Value::known(0)
    }
    fn far_code_byte(&mut self, addr: Pair, _: bool) -> Value {
        self.code_byte(addr)
    }
    fn store_program(&mut self) {
        self.live.used(self.live.regs[usize::from(Z)].or(self.live.regs[usize::from(Z) + 1]));
    }
    fn sp(&self) -> Pair {
        Pair::known(self.sp)
    }
    fn set_sp(&mut self, sp: Pair) {
        // Downwards: something was pushed where the stack pointer was.
        if self.pushes {
            self.stacked(self.sp);
        }
        self.sp = sp.number();
    }
    fn next_pc(&self) -> Pair {
        Pair::known(0)
    }
    fn sleep(&mut self) {}
    fn clear_watchdog(&mut self) {}
}
