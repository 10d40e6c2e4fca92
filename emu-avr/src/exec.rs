//! Bodies of the AVR instructions, one for each meaning, in the order of the table.
//!
//! Source: AVR Instruction Set Manual DS40002198, section 5. The flag formulas are its Boolean formulas,
//! computed on all eight bits at once: bit 7 of `carries` is C, bit 3 is H.

use emu_core::machine::{BodyMachine, ByteOps, WideOps};

use crate::flags::SregFlag;
use crate::operands::{A, B, D16, K, R, Rel, Rh, Rp, Rw, Skip};

/// Number of the lower register of the pointer X (r27:r26).
pub(crate) const X: u8 = 26;
/// Number of the lower register of the pointer Y (r29:r28).
pub(crate) const Y: u8 = 28;
/// Number of the lower register of the pointer Z (r31:r30).
pub(crate) const Z: u8 = 30;

/// Operations that AVR bodies need in addition to [`BodyMachine`]. Data accesses happen in the last cycle
/// charged so far.
pub(crate) trait AvrMachine: BodyMachine {
    /// Reads a register, 0 to 31.
    fn reg(&self, r: u8) -> Self::Byte;
    /// Writes a register, 0 to 31.
    fn set_reg(&mut self, r: u8, value: Self::Byte);
    /// Reads a flag.
    fn flag(&self, flag: SregFlag) -> Self::Bit;
    /// Writes one flag and no other. Setting I blocks interrupts for one instruction.
    fn set_flag(&mut self, flag: SregFlag, value: Self::Bit);
    /// Writes a flag whose value is known at compile time.
    fn force_flag(&mut self, flag: SregFlag, on: bool);
    /// Returns the carry as a word, 0 or 1.
    fn carry(&self) -> Self::Byte;
    /// Returns a word that is zero exactly if Z is set.
    fn not_zero(&self) -> Self::Byte;
    /// Sets C to bit 7 of `carry`.
    fn set_c(&mut self, carry: Self::Byte);
    /// Sets C to bit 7 and H to bit 3 of `carries`.
    fn set_carries(&mut self, carries: Self::Byte);
    /// Sets Z if `word` is zero, otherwise clears it.
    fn set_z(&mut self, word: Self::Byte);
    /// Sets N to bit 7 of `n`, Z if `z` is zero, V to bit 7 of `v`, and S to N xor V.
    fn set_nzv(&mut self, n: Self::Byte, z: Self::Byte, v: Self::Byte);
    /// Reads a byte of data memory.
    fn load(&mut self, addr: Self::Wide) -> Self::Byte;
    /// Writes a byte of data memory.
    fn store(&mut self, addr: Self::Wide, value: Self::Byte);
    /// Reads the I/O register `a`, 0 to 63.
    fn io_read(&mut self, a: u8) -> Self::Byte;
    /// Writes the I/O register `a`, 0 to 63.
    fn io_write(&mut self, a: u8, value: Self::Byte);
    /// Writes bit `b` of the I/O register `a`, 0 to 31.
    fn io_write_bit(&mut self, a: u8, b: u8, on: bool);
    /// Reads the byte of program memory at the byte address `addr`.
    fn code_byte(&mut self, addr: Self::Wide) -> Self::Byte;
    /// Reads a byte of program memory at RAMPZ and `addr`. If `inc` is set, RAMPZ is incremented when `addr`
    /// wraps.
    fn far_code_byte(&mut self, addr: Self::Wide, inc: bool) -> Self::Byte;
    /// Executes the command in SPMCSR on program memory.
    fn store_program(&mut self);
    /// Returns the stack pointer.
    fn sp(&self) -> Self::Wide;
    /// Writes the stack pointer.
    fn set_sp(&mut self, sp: Self::Wide);
    /// Returns the word address of the next instruction.
    fn next_pc(&self) -> Self::Wide;
    /// Enters sleep, if SMCR enables it.
    fn sleep(&mut self);
    /// Clears the watchdog counter.
    fn clear_watchdog(&mut self);
}

macro_rules! bodies {
    ($( $(#[doc = $doc:literal])* fn $name:ident($m:ident $(, $arg:ident : $type:ty)*) $body:block )*) => { $(
        $(#[doc = $doc])*
        #[inline(always)]
        pub(crate) fn $name<M: AvrMachine>($m: &mut M $(, $arg: $type)*) $body
    )* };
}

/// Returns the register pair whose lower register is `low`.
#[inline(always)]
fn pair<M: AvrMachine>(m: &M, low: u8) -> M::Wide {
    M::Wide::join(m.reg(low | 1), m.reg(low))
}

#[inline(always)]
fn set_pair<M: AvrMachine>(m: &mut M, low: u8, value: M::Wide) {
    m.set_reg(low, value.lo());
    m.set_reg(low | 1, value.hi());
}

/// Returns `a + b + carry`, and sets all flags of an addition.
#[inline(always)]
fn sum<M: AvrMachine>(m: &mut M, a: M::Byte, b: M::Byte, carry: M::Byte) -> M::Byte {
    let s = a + b + carry;
    let carries = (a & b) | (!s & (a | b));
    m.set_carries(carries);
    m.set_nzv(s, s, (a ^ s) & (b ^ s));
    s
}

/// Returns `a - b - borrow`, and sets all flags of a subtraction. Z is set only if `z` is zero too.
#[inline(always)]
fn difference<M: AvrMachine>(m: &mut M, a: M::Byte, b: M::Byte, borrow: M::Byte, z: M::Byte) -> M::Byte {
    let s = a - b - borrow;
    let borrows = (!a & b) | (s & (!a | b));
    m.set_carries(borrows);
    m.set_nzv(s, s | z, (a ^ b) & (a ^ s));
    s
}

/// Stores a logic result and sets its flags: V is clear.
#[inline(always)]
fn logic<M: AvrMachine>(m: &mut M, d: u8, s: M::Byte) {
    m.set_nzv(s, s, M::Byte::from(0));
    m.set_reg(d, s);
}

/// Stores the right shift `s` of `a` and sets its flags: C is the bit shifted out, V is N xor C.
#[inline(always)]
fn shifted<M: AvrMachine>(m: &mut M, d: R, a: M::Byte, s: M::Byte) {
    let out = a << 7;
    m.set_c(out);
    m.set_nzv(s, s, s ^ out);
    m.set_reg(d.0, s);
}

#[inline(always)]
fn push_word<M: AvrMachine>(m: &mut M, value: M::Byte) {
    let sp = m.sp();
    m.store(sp, value);
    m.set_sp(sp - M::Wide::from(1));
}

#[inline(always)]
fn pop_word<M: AvrMachine>(m: &mut M) -> M::Byte {
    let sp = m.sp() + M::Wide::from(1);
    m.set_sp(sp);
    m.load(sp)
}

/// Pushes the address of the next instruction, low byte first (manual: CALL, "the return address is stored").
#[inline(always)]
pub(crate) fn push_pc<M: AvrMachine>(m: &mut M) {
    let pc = m.next_pc();
    push_word(m, pc.lo());
    push_word(m, pc.hi());
}

bodies! {
    fn add(m, d: R, r: R) {
        let (a, b) = (m.reg(d.0), m.reg(r.0));
        let s = sum(m, a, b, M::Byte::from(0));
        m.set_reg(d.0, s);
    }
    fn adc(m, d: R, r: R) {
        let (a, b, c) = (m.reg(d.0), m.reg(r.0), m.carry());
        let s = sum(m, a, b, c);
        m.set_reg(d.0, s);
    }
    fn adiw(m, d: Rw, k: K) {
        let a = pair(m, d.0);
        let s = a + M::Wide::from(u16::from(k.0));
        m.set_c(a.hi() & !s.hi());
        m.set_nzv(s.hi(), s.hi() | s.lo(), s.hi() & !a.hi());
        set_pair(m, d.0, s);
    }
    fn sub(m, d: R, r: R) {
        let (a, b) = (m.reg(d.0), m.reg(r.0));
        let s = difference(m, a, b, M::Byte::from(0), M::Byte::from(0));
        m.set_reg(d.0, s);
    }
    fn subi(m, d: Rh, k: K) {
        let a = m.reg(d.0);
        let s = difference(m, a, M::Byte::from(k.0), M::Byte::from(0), M::Byte::from(0));
        m.set_reg(d.0, s);
    }
    fn sbc(m, d: R, r: R) {
        let (a, b, c, z) = (m.reg(d.0), m.reg(r.0), m.carry(), m.not_zero());
        let s = difference(m, a, b, c, z);
        m.set_reg(d.0, s);
    }
    fn sbci(m, d: Rh, k: K) {
        let (a, c, z) = (m.reg(d.0), m.carry(), m.not_zero());
        let s = difference(m, a, M::Byte::from(k.0), c, z);
        m.set_reg(d.0, s);
    }
    fn sbiw(m, d: Rw, k: K) {
        let a = pair(m, d.0);
        let s = a - M::Wide::from(u16::from(k.0));
        m.set_c(s.hi() & !a.hi());
        m.set_nzv(s.hi(), s.hi() | s.lo(), a.hi() & !s.hi());
        set_pair(m, d.0, s);
    }
    fn and(m, d: R, r: R) { let s = m.reg(d.0) & m.reg(r.0); logic(m, d.0, s); }
    fn andi(m, d: Rh, k: K) { let s = m.reg(d.0) & M::Byte::from(k.0); logic(m, d.0, s); }
    fn or(m, d: R, r: R) { let s = m.reg(d.0) | m.reg(r.0); logic(m, d.0, s); }
    fn ori(m, d: Rh, k: K) { let s = m.reg(d.0) | M::Byte::from(k.0); logic(m, d.0, s); }
    fn eor(m, d: R, r: R) { let s = m.reg(d.0) ^ m.reg(r.0); logic(m, d.0, s); }
    fn com(m, d: R) {
        let s = !m.reg(d.0);
        m.set_c(M::Byte::from(0x80));
        logic(m, d.0, s);
    }
    fn neg(m, d: R) {
        let b = m.reg(d.0);
        let s = difference(m, M::Byte::from(0), b, M::Byte::from(0), M::Byte::from(0));
        m.set_reg(d.0, s);
    }
    fn inc(m, d: R) {
        let a = m.reg(d.0);
        let s = a + M::Byte::from(1);
        m.set_nzv(s, s, s & !a);
        m.set_reg(d.0, s);
    }
    fn dec(m, d: R) {
        let a = m.reg(d.0);
        let s = a - M::Byte::from(1);
        m.set_nzv(s, s, a & !s);
        m.set_reg(d.0, s);
    }
    fn mul(m, d: R, r: R) {
        let p = M::Wide::mul(m.reg(d.0), m.reg(r.0));
        m.set_c(p.hi());
        m.set_z(p.hi() | p.lo());
        set_pair(m, 0, p);
    }
    /// Signed and fractional products. The product of the unsigned bytes is too large by 256 times the other
    /// factor for each signed factor below 0. A fractional product is shifted left by one; C is the bit
    /// before the shift.
    fn muls(m, d: u8, r: u8, d_signed: bool, r_signed: bool, shift: u8) {
        let (a, b) = (m.reg(d), m.reg(r));
        let zero = M::Byte::from(0);
        let minus = |on: bool, sign: M::Byte, other: M::Byte| if on { (zero - (sign >> 7)) & other } else { zero };
        let high = minus(d_signed, a, b) + minus(r_signed, b, a);
        let p = M::Wide::mul(a, b) - M::Wide::join(high, zero);
        m.set_c(p.hi());
        let p = if shift == 1 { p + p } else { p };
        m.set_z(p.hi() | p.lo());
        set_pair(m, 0, p);
    }
    fn jmp(m, k: u16) { m.jump(u32::from(k)); }
    fn ijmp(m) { let z = pair(m, Z); m.goto(z); }
    fn call(m, k: u16) { push_pc(m); m.jump(u32::from(k)); }
    fn icall(m) { let z = pair(m, Z); push_pc(m); m.goto(z); }
    fn ret(m) {
        let hi = pop_word(m);
        let lo = pop_word(m);
        m.goto(M::Wide::join(hi, lo));
    }
    fn reti(m) { ret(m); m.force_flag(SregFlag::I, true); }
    fn cpse(m, d: R, r: R, n: Skip) {
        let equal = (m.reg(d.0) ^ m.reg(r.0)).is_zero();
        m.charge(1);
        m.skip_if(equal, u32::from(n.0));
    }
    fn cp(m, d: R, r: R) {
        let (a, b) = (m.reg(d.0), m.reg(r.0));
        difference(m, a, b, M::Byte::from(0), M::Byte::from(0));
    }
    fn cpc(m, d: R, r: R) {
        let (a, b, c, z) = (m.reg(d.0), m.reg(r.0), m.carry(), m.not_zero());
        difference(m, a, b, c, z);
    }
    fn cpi(m, d: Rh, k: K) {
        let a = m.reg(d.0);
        difference(m, a, M::Byte::from(k.0), M::Byte::from(0), M::Byte::from(0));
    }
    fn sbr(m, r: R, b: B, n: Skip, on: bool) {
        let bit = m.reg(r.0).bit(b.0);
        m.charge(1);
        m.skip_if(if on { bit } else { !bit }, u32::from(n.0));
    }
    fn sbi_skip(m, a: A, b: B, n: Skip, on: bool) {
        m.charge(1);
        let bit = m.io_read(a.0).bit(b.0);
        m.skip_if(if on { bit } else { !bit }, u32::from(n.0));
    }
    fn br(m, flag: SregFlag, on: bool, k: Rel) {
        let bit = m.flag(flag);
        m.charge(1);
        m.branch_if(if on { bit } else { !bit }, u32::from(k.0));
    }
    fn io_bit(m, a: A, b: B, on: bool) { m.io_write_bit(a.0, b.0, on); }
    fn lsr(m, d: R) { let a = m.reg(d.0); shifted(m, d, a, a >> 1); }
    fn ror(m, d: R) { let a = m.reg(d.0); let s = (a >> 1) | (m.carry() << 7); shifted(m, d, a, s); }
    fn asr(m, d: R) { let a = m.reg(d.0); shifted(m, d, a, (a >> 1) | (a & M::Byte::from(0x80))); }
    fn swap(m, d: R) { let a = m.reg(d.0); m.set_reg(d.0, (a << 4) | (a >> 4)); }
    fn flag(m, flag: SregFlag, on: bool) { m.force_flag(flag, on); }
    fn bst(m, d: R, b: B) { let bit = m.reg(d.0).bit(b.0); m.set_flag(SregFlag::T, bit); }
    fn bld(m, d: R, b: B) { let s = m.reg(d.0).with_bit(b.0, m.flag(SregFlag::T)); m.set_reg(d.0, s); }
    fn mov(m, d: R, r: R) { let s = m.reg(r.0); m.set_reg(d.0, s); }
    fn movw(m, d: Rp, r: Rp) { let s = pair(m, r.0); set_pair(m, d.0, s); }
    fn ldi(m, d: Rh, k: K) { m.set_reg(d.0, M::Byte::from(k.0)); }
    fn ld(m, d: R, p: u8, q: u8) {
        let addr = pair(m, p) + M::Wide::from(u16::from(q));
        let s = m.load(addr);
        m.set_reg(d.0, s);
    }
    /// The pointer is incremented before the register is written: `ld r26, X+` leaves the loaded byte
    /// (undefined by the manual).
    fn ld_inc(m, d: R, p: u8) {
        let addr = pair(m, p);
        let s = m.load(addr);
        set_pair(m, p, addr + M::Wide::from(1));
        m.set_reg(d.0, s);
    }
    fn ld_dec(m, d: R, p: u8) {
        let addr = pair(m, p) - M::Wide::from(1);
        let s = m.load(addr);
        set_pair(m, p, addr);
        m.set_reg(d.0, s);
    }
    fn lds(m, d: R, k: D16) { let s = m.load(M::Wide::from(k.0)); m.set_reg(d.0, s); }
    fn st(m, p: u8, q: u8, r: R) {
        let (addr, s) = (pair(m, p) + M::Wide::from(u16::from(q)), m.reg(r.0));
        m.store(addr, s);
    }
    /// The stored byte is read from the register before the pointer is incremented: `st X+, r26` stores the
    /// old value (undefined by the manual). The pointer is written before the store, so that a store onto the
    /// pointer itself wins.
    fn st_inc(m, p: u8, r: R) {
        let (addr, s) = (pair(m, p), m.reg(r.0));
        set_pair(m, p, addr + M::Wide::from(1));
        m.store(addr, s);
    }
    fn st_dec(m, p: u8, r: R) {
        let (addr, s) = (pair(m, p) - M::Wide::from(1), m.reg(r.0));
        set_pair(m, p, addr);
        m.store(addr, s);
    }
    fn sts(m, k: D16, r: R) { let s = m.reg(r.0); m.store(M::Wide::from(k.0), s); }
    fn lpm(m, d: R, inc: bool) {
        let z = pair(m, Z);
        let s = m.code_byte(z);
        if inc {
            set_pair(m, Z, z + M::Wide::from(1));
        }
        m.set_reg(d.0, s);
    }
    fn elpm(m, d: R, inc: bool) {
        let z = pair(m, Z);
        let s = m.far_code_byte(z, inc);
        if inc {
            set_pair(m, Z, z + M::Wide::from(1));
        }
        m.set_reg(d.0, s);
    }
    fn spm(m) {
        m.store_program();
    }
    fn in_(m, d: R, a: A) { let s = m.io_read(a.0); m.set_reg(d.0, s); }
    fn out(m, a: A, r: R) { let s = m.reg(r.0); m.io_write(a.0, s); }
    fn push(m, r: R) { let s = m.reg(r.0); push_word(m, s); }
    fn pop(m, d: R) { let s = pop_word(m); m.set_reg(d.0, s); }
    fn nop(_m) {}
    fn sleep(m) { m.sleep(); }
    fn wdr(m) { m.clear_watchdog(); }
}
