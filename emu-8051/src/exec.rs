//! The bodies of the MCS-51 instructions, in the order of the table.
//!
//! Source: user's manual, "MCS-51 instruction set". Operands are places (`operand_place.rs`). Registers of
//! the chip are read in the first cycle of an instruction and written in its last.

use emu_core::machine::{BitOps, BodyMachine, ByteOps, WideOps};

pub(crate) use crate::operand_place::{AccPlace, BitOperandPlace, CarryPlace, OperandPlace, OperandSource};
use crate::operands::{Imm16, RamBit, Rel, Ri};

/// What MCS-51 bodies need in addition to [`BodyMachine`].
pub(crate) trait Mcs51Machine: BodyMachine {
    /// Reads the accumulator.
    fn acc(&self) -> Self::Byte;
    /// Writes the accumulator.
    fn set_acc(&mut self, value: Self::Byte);
    /// Reads register B.
    fn b(&self) -> Self::Byte;
    /// Writes register B.
    fn set_b(&mut self, value: Self::Byte);
    /// Reads the selected data pointer.
    fn dptr(&self) -> Self::Wide;
    /// Writes the selected data pointer.
    fn set_dptr(&mut self, value: Self::Wide);
    /// Reads the stack pointer.
    fn sp(&self) -> Self::Byte;
    /// Writes the stack pointer.
    fn set_sp(&mut self, value: Self::Byte);
    /// Reads CY.
    fn carry(&self) -> Self::Bit;
    /// Writes CY.
    fn set_carry(&mut self, value: Self::Bit);
    /// Reads AC.
    fn half_carry(&self) -> Self::Bit;
    /// Writes OV.
    fn set_overflow(&mut self, value: Self::Bit);
    /// CY := bit 7 of `carries`, AC := bit 3 of `carries`, OV := bit 7 of `overflow`.
    fn set_sum_flags(&mut self, carries: Self::Byte, overflow: Self::Byte);
    /// Converts a bit to a word, 0 or 1.
    fn word_from_bit(bit: Self::Bit) -> Self::Byte;
    /// Makes a bit that is known at compile time.
    fn bit_from_bool(on: bool) -> Self::Bit;
    /// Reads a register of the selected bank, 0 to 7.
    fn reg(&mut self, r: u8) -> Self::Byte;
    /// Writes a register of the selected bank.
    fn set_reg(&mut self, r: u8, value: Self::Byte);
    /// Reads RAM below 80h by direct address.
    fn ram(&mut self, addr: u8) -> Self::Byte;
    /// Writes RAM below 80h by direct address.
    fn set_ram(&mut self, addr: u8, value: Self::Byte);
    /// Reads RAM by indirect address.
    fn idata(&mut self, addr: Self::Byte) -> Self::Byte;
    /// Writes RAM by indirect address.
    fn set_idata(&mut self, addr: Self::Byte, value: Self::Byte);
    /// Reads a direct address: RAM, or a register of the core or the chip. A port gives its pins.
    fn direct(&mut self, addr: u8) -> Self::Byte;
    /// Reads a direct address for a read-modify-write instruction: a port gives its latch.
    fn direct_latch(&mut self, addr: u8) -> Self::Byte;
    /// Writes a direct address.
    fn set_direct(&mut self, addr: u8, value: Self::Byte);
    /// Reads a bit of RAM.
    fn ram_bit(&mut self, at: RamBit) -> Self::Bit;
    /// Writes a bit of RAM.
    fn set_ram_bit(&mut self, at: RamBit, value: Self::Bit);
    /// Reads a bit by its bit address. A port gives its pins.
    fn direct_bit(&mut self, addr: u8) -> Self::Bit;
    /// Reads a bit for a read-modify-write instruction: a port gives its latch.
    fn direct_bit_latch(&mut self, addr: u8) -> Self::Bit;
    /// Writes a bit by its bit address if `condition` is true; otherwise its byte is not accessed.
    fn set_direct_bit_if(&mut self, condition: Self::Bit, addr: u8, value: Self::Bit);
    /// Reads external RAM.
    fn xdata(&mut self, addr: Self::Wide) -> Self::Byte;
    /// Writes external RAM.
    fn set_xdata(&mut self, addr: Self::Wide, value: Self::Byte);
    /// Reads the latch of port 2, the upper address byte of MOVX @Ri.
    fn xdata_page(&mut self) -> Self::Byte;
    /// Reads program memory.
    fn code(&mut self, addr: Self::Wide) -> Self::Byte;
    /// Address of the next instruction.
    fn next_pc(&self) -> Self::Wide;
    /// Jumps by a distance from the next instruction if `condition` is true.
    fn relative_if(&mut self, condition: Self::Bit, distance: i8);
    /// RETI: ends the interrupt in progress. One more instruction is executed before the next interrupt.
    fn end_interrupt(&mut self);
}

/// The bit, or its complement if `invert`.
#[inline(always)]
fn invert_if<B: BitOps>(bit: B, invert: bool) -> B {
    if invert { !bit } else { bit }
}

#[inline(always)]
fn push_word<M: Mcs51Machine>(m: &mut M, value: M::Byte) {
    let sp = m.sp() + M::Byte::from(1);
    m.set_sp(sp);
    m.set_idata(sp, value);
}

#[inline(always)]
fn pop_word<M: Mcs51Machine>(m: &mut M) -> M::Byte {
    let sp = m.sp();
    let value = m.idata(sp);
    m.set_sp(sp - M::Byte::from(1));
    value
}

/// Pushes the address of the next instruction, low byte first (manual: LCALL).
#[inline(always)]
pub(crate) fn push_pc<M: Mcs51Machine>(m: &mut M) {
    let pc = m.next_pc();
    push_word(m, pc.lo());
    push_word(m, pc.hi());
}

#[inline(always)]
fn pop_pc<M: Mcs51Machine>(m: &mut M) {
    let high = pop_word(m);
    let low = pop_word(m);
    m.goto(M::Wide::join(high, low));
}

/// Computes `a + b + carry` in the accumulator and sets the flags.
#[inline(always)]
fn sum<M: Mcs51Machine>(m: &mut M, b: M::Byte, carry: M::Byte) {
    let a = m.acc();
    let s = a + b + carry;
    let carries = (a & b) | (!s & (a | b));
    m.set_sum_flags(carries, (a ^ s) & (b ^ s));
    m.set_acc(s);
}

macro_rules! bodies {
    ($( fn $name:ident $(<$($place:ident : $kind:ident),*>)? ($m:ident $(, $arg:ident : $type:ty)*) $body:block )*) => { $(
        #[inline(always)]
        pub(crate) fn $name<M: Mcs51Machine $($(, $place: $kind)*)?>($m: &mut M $(, $arg: $type)*) $body
    )* };
}

bodies! {
    fn add<S: OperandSource>(m, s: S) {
        let b = s.read(m);
        sum(m, b, M::Byte::from(0));
    }
    fn addc<S: OperandSource>(m, s: S) {
        let b = s.read(m);
        let carry = M::word_from_bit(m.carry());
        sum(m, b, carry);
    }
    fn subb<S: OperandSource>(m, s: S) {
        let b = s.read(m);
        let a = m.acc();
        let d = a - b - M::word_from_bit(m.carry());
        let borrows = (!a & b) | (d & (!a | b));
        m.set_sum_flags(borrows, (a ^ b) & (a ^ d));
        m.set_acc(d);
    }
    fn inc<P: OperandPlace>(m, p: P) {
        let v = p.read_latch(m) + M::Byte::from(1);
        p.write(m, v);
    }
    fn dec<P: OperandPlace>(m, p: P) {
        let v = p.read_latch(m) - M::Byte::from(1);
        p.write(m, v);
    }
    fn inc_dptr(m) {
        let v = m.dptr() + M::Wide::from(1);
        m.set_dptr(v);
    }
    fn mul(m) {
        let product = M::Wide::mul(m.acc(), m.b());
        m.set_carry(M::bit_from_bool(false));
        m.set_overflow(!product.hi().is_zero());
        m.set_acc(product.lo());
        m.set_b(product.hi());
    }
    fn div(m) {
        let (a, b) = (m.acc(), m.b());
        let (quotient, rest) = a.div_rem(b);
        m.set_carry(M::bit_from_bool(false));
        m.set_overflow(b.is_zero());
        m.set_acc(quotient);
        m.set_b(rest);
    }
    fn da(m) {
        let a = m.acc();
        let low = m.half_carry() | !(a & M::Byte::from(0x0F)).lt(M::Byte::from(10));
        let adjusted = a + M::Byte::from(6).when(low);
        // CY can be set but never cleared.
        let high = m.carry() | adjusted.lt(a) | !adjusted.lt(M::Byte::from(0xA0));
        m.set_carry(high);
        m.set_acc(adjusted + M::Byte::from(0x60).when(high));
    }
    fn anl<P: OperandPlace, S: OperandSource>(m, p: P, s: S) {
        let v = p.read_latch(m) & s.read(m);
        p.write(m, v);
    }
    fn orl<P: OperandPlace, S: OperandSource>(m, p: P, s: S) {
        let v = p.read_latch(m) | s.read(m);
        p.write(m, v);
    }
    fn xrl<P: OperandPlace, S: OperandSource>(m, p: P, s: S) {
        let v = p.read_latch(m) ^ s.read(m);
        p.write(m, v);
    }
    fn cpl_a(m) {
        let v = !m.acc();
        m.set_acc(v);
    }
    fn rl(m) {
        let a = m.acc();
        m.set_acc(a << 1 | a >> 7);
    }
    fn rlc(m) {
        let a = m.acc();
        let v = a << 1 | M::word_from_bit(m.carry());
        m.set_carry(a.bit(7));
        m.set_acc(v);
    }
    fn rr(m) {
        let a = m.acc();
        m.set_acc(a >> 1 | a << 7);
    }
    fn rrc(m) {
        let a = m.acc();
        let v = a >> 1 | M::word_from_bit(m.carry()) << 7;
        m.set_carry(a.bit(0));
        m.set_acc(v);
    }
    fn swap(m) {
        let a = m.acc();
        m.set_acc(a << 4 | a >> 4);
    }
    fn mov<P: OperandPlace, S: OperandSource>(m, p: P, s: S) {
        let v = s.read(m);
        p.write(m, v);
    }
    fn mov_dptr(m, k: Imm16) {
        m.set_dptr(M::Wide::from(k.0));
    }
    fn movc_dptr(m) {
        let at = m.dptr() + M::Wide::join(M::Byte::from(0), m.acc());
        let v = m.code(at);
        m.set_acc(v);
    }
    fn movc_pc(m) {
        let at = m.next_pc() + M::Wide::join(M::Byte::from(0), m.acc());
        let v = m.code(at);
        m.set_acc(v);
    }
    fn movx_a_ind(m, i: Ri) {
        let at = M::Wide::join(m.xdata_page(), m.reg(i.0));
        let v = m.xdata(at);
        m.set_acc(v);
    }
    fn movx_a_dptr(m) {
        let v = m.xdata(m.dptr());
        m.set_acc(v);
    }
    fn movx_ind_a(m, i: Ri) {
        let at = M::Wide::join(m.xdata_page(), m.reg(i.0));
        m.set_xdata(at, m.acc());
    }
    fn movx_dptr_a(m) {
        m.set_xdata(m.dptr(), m.acc());
    }
    fn push<S: OperandSource>(m, s: S) {
        // SP is incremented first, so PUSH SP pushes the incremented value (manual: PUSH).
        let sp = m.sp() + M::Byte::from(1);
        m.set_sp(sp);
        let v = s.read(m);
        m.set_idata(sp, v);
    }
    fn pop<P: OperandPlace>(m, p: P) {
        // SP is decremented before the byte is written, so POP SP leaves the popped byte in SP (manual: POP).
        let v = pop_word(m);
        p.write(m, v);
    }
    fn xch<P: OperandPlace>(m, p: P) {
        let v = p.read(m);
        let a = m.acc();
        p.write(m, a);
        m.set_acc(v);
    }
    fn xchd(m, i: Ri) {
        let at = m.reg(i.0);
        let v = m.idata(at);
        let a = m.acc();
        let halves = (a ^ v) & M::Byte::from(0x0F);
        m.set_idata(at, v ^ halves);
        m.set_acc(a ^ halves);
    }
    fn set_bit<P: BitOperandPlace>(m, p: P, on: bool) {
        p.write(m, M::bit_from_bool(on));
    }
    fn cpl_bit<P: BitOperandPlace>(m, p: P) {
        let v = !p.read_latch(m);
        p.write(m, v);
    }
    fn anl_c<P: BitOperandPlace>(m, p: P, invert: bool) {
        let v = invert_if(p.read(m), invert);
        m.set_carry(m.carry() & v);
    }
    fn orl_c<P: BitOperandPlace>(m, p: P, invert: bool) {
        let v = invert_if(p.read(m), invert);
        m.set_carry(m.carry() | v);
    }
    fn mov_c_bit<P: BitOperandPlace>(m, p: P) {
        let v = p.read(m);
        m.set_carry(v);
    }
    fn mov_bit_c<P: BitOperandPlace>(m, p: P) {
        let v = m.carry();
        p.write(m, v);
    }
    fn jump_if<P: BitOperandPlace>(m, p: P, on: bool, t: Rel) {
        let v = p.read(m);
        m.relative_if(invert_if(v, !on), t.0);
    }
    fn jbc<P: BitOperandPlace>(m, p: P, t: Rel) {
        let v = p.read_latch(m);
        p.write_if(m, v, M::bit_from_bool(false));
        m.relative_if(v, t.0);
    }
    fn call(m, target: u16) {
        push_pc(m);
        m.jump(u32::from(target));
    }
    fn ret(m) {
        pop_pc(m);
    }
    fn reti(m) {
        pop_pc(m);
        m.end_interrupt();
    }
    fn jmp(m, target: u16) {
        m.jump(u32::from(target));
    }
    fn sjmp(m, t: Rel) {
        m.relative_if(M::bit_from_bool(true), t.0);
    }
    fn jmp_dptr(m) {
        let target = m.dptr() + M::Wide::join(M::Byte::from(0), m.acc());
        m.goto(target);
    }
    fn jz(m, zero: bool, t: Rel) {
        let v = invert_if(m.acc().is_zero(), !zero);
        m.relative_if(v, t.0);
    }
    fn cjne<P: OperandSource, S: OperandSource>(m, p: P, s: S, t: Rel) {
        let (a, b) = (p.read(m), s.read(m));
        m.set_carry(a.lt(b));
        m.relative_if(!(a ^ b).is_zero(), t.0);
    }
    fn djnz<P: OperandPlace>(m, p: P, t: Rel) {
        let v = p.read_latch(m) - M::Byte::from(1);
        p.write(m, v);
        m.relative_if(!v.is_zero(), t.0);
    }
    fn nop(_m) {}
}
