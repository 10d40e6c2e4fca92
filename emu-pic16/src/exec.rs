//! Bodies of the instructions, one for each meaning.
//!
//! Source: DS33023, section 29. A file register is a [`FileOperand`]: `resolved` determines once where the
//! access goes (INDF through FSR), then it is read and written there. `write` stores results of instructions
//! without flags, `write_with_flags` those of instructions with flags: if the target is STATUS, the flags are
//! left to the arithmetic ("Status Register" in section 5). Flags are set after the result is stored.

use emu_core::machine::{BodyMachine, ByteOps};

use crate::operands::{B, F, FileAddress, JumpTarget, K, RamCell};
use crate::periph::map::Sfr;

/// Operations that PIC16 bodies need in addition to [`BodyMachine`].
pub(crate) trait Pic16Machine: BodyMachine {
    /// Reads W.
    fn w(&self) -> Self::Byte;
    /// Writes W.
    fn set_w(&mut self, value: Self::Byte);
    /// Reads C.
    fn carry(&self) -> Self::Bit;
    /// Writes C.
    fn set_carry(&mut self, value: Self::Bit);
    /// Sets Z if the byte is 0, otherwise clears it.
    fn set_z(&mut self, value: Self::Byte);
    /// Sets C to bit 7 and DC to bit 3 of `carries`.
    fn set_carries(&mut self, carries: Self::Byte);
    /// Converts a bit to a word, 0 or 1.
    fn word_from_bit(bit: Self::Bit) -> Self::Byte;
    /// Returns `file_address`, or the address in FSR if `file_address` is INDF.
    fn resolve(&mut self, file_address: FileAddress) -> FileAddress;
    /// Reads a file register.
    fn read_file(&mut self, file_address: FileAddress) -> Self::Byte;
    /// Writes a file register.
    fn write_file(&mut self, file_address: FileAddress, value: Self::Byte);
    /// Writes a file register with the result of an instruction that sets flags.
    fn write_file_with_flags(&mut self, file_address: FileAddress, value: Self::Byte);
    /// Reads the bit of a file register given by its mask.
    #[inline(always)]
    fn read_file_bit(&mut self, file_address: FileAddress, mask: u8) -> Self::Bit {
        Self::is_any_bit_set(self.read_file(file_address), mask)
    }
    /// Reads a file register and writes it back with the bit under `mask` set or cleared.
    #[inline(always)]
    fn write_file_bit(&mut self, file_address: FileAddress, mask: u8, on: bool) {
        let value = self.read_file(file_address);
        self.write_file(file_address, with_mask(value, mask, on));
    }
    /// Reads a byte of RAM.
    fn read_ram(&mut self, addr: u16) -> Self::Byte;
    /// Writes a byte of RAM.
    fn write_ram(&mut self, addr: u16, value: Self::Byte);
    /// Returns the bit of a word given by its mask.
    fn is_any_bit_set(value: Self::Byte, mask: u8) -> Self::Bit;
    /// Skips the next instruction if `condition` holds, which takes one cycle more.
    fn skip(&mut self, condition: Self::Bit);
    /// Jumps to `target` in the page that PCLATH selects.
    fn jump_within_page(&mut self, target: u16);
    /// Pushes the address of the next instruction.
    fn push(&mut self);
    /// Pops the program counter from the stack.
    fn pop(&mut self);
    /// Sets GIE, at RETFIE.
    fn end_interrupt(&mut self);
    /// Clears the watchdog, at CLRWDT.
    fn clear_watchdog(&mut self);
    /// Enters standby, at SLEEP.
    fn enter_standby(&mut self);
}

/// A file register as an operand.
pub(crate) trait FileOperand: Copy {
    /// Reports whether this is the program counter: writing it is a jump.
    fn is_pcl(self) -> bool;
    /// Resolves the operand, once for each access.
    fn resolved<M: Pic16Machine>(self, m: &mut M) -> Self;
    /// Reads the file register.
    fn read<M: Pic16Machine>(self, m: &mut M) -> M::Byte;
    /// Writes the file register.
    fn write<M: Pic16Machine>(self, m: &mut M, value: M::Byte);
    /// Writes the result of an instruction that sets flags.
    fn write_with_flags<M: Pic16Machine>(self, m: &mut M, value: M::Byte);
    /// Reads the bit given by its mask.
    #[inline(always)]
    fn read_bit<M: Pic16Machine>(self, m: &mut M, mask: u8) -> M::Bit {
        M::is_any_bit_set(self.read(m), mask)
    }
    /// Reads the file register and writes it back with the bit under `mask` set or cleared.
    #[inline(always)]
    fn write_bit<M: Pic16Machine>(self, m: &mut M, mask: u8, on: bool) {
        let value = self.read(m);
        self.write(m, with_mask(value, mask, on));
    }
}

impl FileOperand for F {
    #[inline(always)]
    fn read_bit<M: Pic16Machine>(self, m: &mut M, mask: u8) -> M::Bit {
        m.read_file_bit(self.0, mask)
    }
    #[inline(always)]
    fn write_bit<M: Pic16Machine>(self, m: &mut M, mask: u8, on: bool) {
        m.write_file_bit(self.0, mask, on);
    }
    #[inline(always)]
    fn is_pcl(self) -> bool {
        self.0 == FileAddress::sfr(Sfr::PCL)
    }
    #[inline(always)]
    fn resolved<M: Pic16Machine>(self, m: &mut M) -> F {
        F(m.resolve(self.0))
    }
    #[inline(always)]
    fn read<M: Pic16Machine>(self, m: &mut M) -> M::Byte {
        m.read_file(self.0)
    }
    #[inline(always)]
    fn write<M: Pic16Machine>(self, m: &mut M, value: M::Byte) {
        m.write_file(self.0, value);
    }
    #[inline(always)]
    fn write_with_flags<M: Pic16Machine>(self, m: &mut M, value: M::Byte) {
        m.write_file_with_flags(self.0, value);
    }
}

impl FileOperand for RamCell {
    #[inline(always)]
    fn is_pcl(self) -> bool {
        false
    }
    #[inline(always)]
    fn resolved<M: Pic16Machine>(self, _: &mut M) -> RamCell {
        self
    }
    #[inline(always)]
    fn read<M: Pic16Machine>(self, m: &mut M) -> M::Byte {
        m.read_ram(self.0)
    }
    #[inline(always)]
    fn write<M: Pic16Machine>(self, m: &mut M, value: M::Byte) {
        m.write_ram(self.0, value);
    }
    #[inline(always)]
    fn write_with_flags<M: Pic16Machine>(self, m: &mut M, value: M::Byte) {
        m.write_ram(self.0, value);
    }
}

/// Stores the result of an instruction with flags in W or in the file register.
#[inline(always)]
fn store_result<M: Pic16Machine, P: FileOperand>(m: &mut M, f: P, to_w: bool, value: M::Byte) {
    if to_w {
        m.set_w(value);
    } else {
        f.write_with_flags(m, value);
    }
}

/// Stores the result of an instruction without flags in W or in the file register.
#[inline(always)]
fn store_without_flags<M: Pic16Machine, P: FileOperand>(m: &mut M, f: P, to_w: bool, value: M::Byte) {
    if to_w {
        m.set_w(value);
    } else {
        f.write(m, value);
    }
}

/// Stores the result of DECFSZ or INCFSZ, and skips. If the write was a jump, there is nothing to skip.
#[inline(always)]
fn count_and_skip<M: Pic16Machine, P: FileOperand>(m: &mut M, f: P, to_w: bool, value: M::Byte) {
    store_without_flags(m, f, to_w, value);
    if to_w || !f.is_pcl() {
        m.skip(value.is_zero());
    }
}

/// Returns the word with the bits in `mask` set or cleared.
#[inline(always)]
fn with_mask<W: ByteOps>(value: W, mask: u8, on: bool) -> W {
    if on { value | W::from(mask) } else { value & W::from(!mask) }
}

/// Returns the carries out of every bit of `a + b = s`.
#[inline(always)]
fn carries<W: ByteOps>(a: W, b: W, s: W) -> W {
    (a & b) | (!s & (a | b))
}

/// Returns the complements of the borrows of `a - b = d`, which the PIC uses as carries.
#[inline(always)]
fn no_borrows<W: ByteOps>(a: W, b: W, d: W) -> W {
    !((!a & b) | (d & (!a | b)))
}

macro_rules! bodies {
    ($( fn $name:ident $(<$operand:ident>)? ($m:ident $(, $arg:ident : $type:ty)*) $body:block )*) => { $(
        #[inline(always)]
        pub(crate) fn $name<M: Pic16Machine $(, $operand: FileOperand)?>($m: &mut M $(, $arg: $type)*) $body
    )* };
}

bodies! {
    fn addwf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let (a, b) = (f.read(m), m.w());
        let s = a + b;
        store_result(m, f, to_w, s);
        m.set_carries(carries(a, b, s));
        m.set_z(s);
    }
    fn andwf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) & m.w();
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn clrf<P>(m, f: P) {
        let (f, zero) = (f.resolved(m), M::Byte::from(0));
        f.write_with_flags(m, zero);
        m.set_z(zero);
    }
    fn clrw(m) {
        m.set_w(M::Byte::from(0));
        m.set_z(M::Byte::from(0));
    }
    fn comf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = !f.read(m);
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn decf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) - M::Byte::from(1);
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn decfsz<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) - M::Byte::from(1);
        count_and_skip(m, f, to_w, v);
    }
    fn incf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) + M::Byte::from(1);
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn incfsz<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) + M::Byte::from(1);
        count_and_skip(m, f, to_w, v);
    }
    fn iorwf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) | m.w();
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn movf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m);
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn movwf<P>(m, f: P) {
        let f = f.resolved(m);
        let v = m.w();
        f.write(m, v);
    }
    fn nop(_m) {}
    fn rlf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let a = f.read(m);
        let v = a << 1 | M::word_from_bit(m.carry());
        store_result(m, f, to_w, v);
        m.set_carry(a.bit(7));
    }
    fn rrf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let a = f.read(m);
        let v = a >> 1 | M::word_from_bit(m.carry()) << 7;
        store_result(m, f, to_w, v);
        m.set_carry(a.bit(0));
    }
    fn subwf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let (a, b) = (f.read(m), m.w());
        let d = a - b;
        store_result(m, f, to_w, d);
        m.set_carries(no_borrows(a, b, d));
        m.set_z(d);
    }
    fn swapf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let a = f.read(m);
        store_without_flags(m, f, to_w, a << 4 | a >> 4);
    }
    fn xorwf<P>(m, f: P, to_w: bool) {
        let f = f.resolved(m);
        let v = f.read(m) ^ m.w();
        store_result(m, f, to_w, v);
        m.set_z(v);
    }
    fn set_bit<P>(m, f: P, b: B, on: bool) {
        let f = f.resolved(m);
        f.write_bit(m, b.0, on);
    }
    fn skip_bit<P>(m, f: P, b: B, on: bool) {
        let f = f.resolved(m);
        let bit = f.read_bit(m, b.0);
        m.skip(if on { bit } else { !bit });
    }
    fn addlw(m, k: K) {
        let (a, b) = (m.w(), M::Byte::from(k.0));
        let s = a + b;
        m.set_w(s);
        m.set_carries(carries(a, b, s));
        m.set_z(s);
    }
    fn andlw(m, k: K) {
        let v = m.w() & M::Byte::from(k.0);
        m.set_w(v);
        m.set_z(v);
    }
    fn call(m, t: JumpTarget) {
        m.push();
        m.jump_within_page(t.0);
    }
    fn clrwdt(m) {
        m.clear_watchdog();
    }
    fn goto(m, t: JumpTarget) {
        m.jump_within_page(t.0);
    }
    fn iorlw(m, k: K) {
        let v = m.w() | M::Byte::from(k.0);
        m.set_w(v);
        m.set_z(v);
    }
    fn movlw(m, k: K) {
        m.set_w(M::Byte::from(k.0));
    }
    fn retfie(m) {
        m.end_interrupt();
        m.pop();
    }
    fn retlw(m, k: K) {
        m.set_w(M::Byte::from(k.0));
        m.pop();
    }
    fn return_(m) {
        m.pop();
    }
    fn sleep(m) {
        m.enter_standby();
    }
    fn sublw(m, k: K) {
        let (a, b) = (M::Byte::from(k.0), m.w());
        let d = a - b;
        m.set_w(d);
        m.set_carries(no_borrows(a, b, d));
        m.set_z(d);
    }
    fn xorlw(m, k: K) {
        let v = m.w() ^ M::Byte::from(k.0);
        m.set_w(v);
        m.set_z(v);
    }
    fn option(m) {
        let v = m.w();
        m.write_file(FileAddress::sfr(Sfr::OPTION), v);
    }
    fn tris(m, sfr: Sfr) {
        let v = m.w();
        m.write_file(FileAddress::sfr(sfr), v);
    }
}
