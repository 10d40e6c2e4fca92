//! Subroutines that programs use. Operands are in [`A`] and [`B`], results in A; where one is used once it stands in its place.

use emu_avr::isa::Kind;

use super::arch::{Asm, Jump};
use super::layout::{Home, Layout};
use super::regs::{self, A, B, BYTE, LOW_ZERO, Regs, SCRATCH, ZERO};
use crate::ir::Word;

/// A subroutine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Routine {
    /// A := A * B, so many bytes.
    Multiply(u8),
    /// A := A / B, so many bytes; false: B is known to be above zero.
    Divide(u8, bool),
    /// A := the conversion of the selected input; a turn of its loop is taken at most so many times.
    Convert(u32),
    /// A := so many bytes of EEPROM from the address in [`BYTE`] on.
    Recall(u8),
    /// A, so many bytes, to the EEPROM from the address in [`BYTE`] on, as [`Op::Persist`](crate::ir::Op::Persist) has it.
    Persist(u8, Word, i32),
}

/// What bodies need to know.
#[derive(Debug, Clone, Copy)]
pub struct Around<'a> {
    /// Names of registers.
    pub regs: &'a Regs,
    /// Places of the cells.
    pub layout: &'a Layout,
    /// Bytes of EEPROM in use.
    pub eeprom: u16,
}

impl Routine {
    /// For the listing.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Routine::Multiply(_) => "multiplication",
            Routine::Divide(..) => "division",
            Routine::Convert(_) => "conversion",
            Routine::Recall(_) => "read the EEPROM",
            Routine::Persist(..) => "write the EEPROM",
        }
    }

    /// Its instructions, without the return.
    pub fn body(self, asm: &mut Asm, around: &Around<'_>) {
        match self {
            Routine::Multiply(bytes) => multiply(asm, bytes.into()),
            Routine::Divide(bytes, signed) => divide(asm, bytes.into(), signed),
            Routine::Convert(turns) => convert(asm, around.regs, turns),
            Routine::Recall(bytes) => recall(asm, around, bytes.into()),
            Routine::Persist(bytes, busy, scans) => persist(asm, around, bytes.into(), (busy, scans)),
        }
    }
}

/// The bytes of the product, and of the remainder, as they are reckoned.
const WORK: [i32; 4] = [18, 19, 30, 31];
/// Counts the bits of a division.
const COUNT: i32 = 16;
/// The sign of a quotient.
const SIGN: i32 = 17;
/// The same in divisions of at most two bytes, which leave r17:r16 alone.
const SMALL: (i32, i32) = (20, 21);

fn take(regs: [i32; 4], bytes: usize) -> impl Iterator<Item = i32> {
    regs.into_iter().take(bytes)
}

/// The low half of the product: byte products whose places are above it are left out.
fn multiply(asm: &mut Asm, bytes: usize) {
    if bytes == 1 {
        asm.op(Kind::Mul, &[A[0], B[0]]);
        asm.op(Kind::Mov, &[A[0], LOW_ZERO]);
    } else {
        let mut fresh = [true; 4];
        // Those in even places first: they fill the places side by side, without a carry to hand on.
        let mut pairs: Vec<(usize, usize)> = (0..bytes).flat_map(|i| (0..bytes - i).map(move |j| (i, j))).collect();
        pairs.sort_by_key(|&(i, j)| ((i + j) % 2 == 1, i + j));
        for (i, j) in pairs {
            let at = i + j;
            asm.op(Kind::Mul, &[A[i], B[j]]);
            match (fresh[at], at + 1 < bytes) {
                (true, true) if fresh[at + 1] => {
                    asm.op(Kind::Movw, &[WORK[at], LOW_ZERO]);
                    (fresh[at], fresh[at + 1]) = (false, false);
                }
                (true, false) => {
                    asm.op(Kind::Mov, &[WORK[at], LOW_ZERO]);
                    fresh[at] = false;
                }
                (_, false) => asm.op(Kind::Add, &[WORK[at], LOW_ZERO]),
                _ => {
                    asm.op(Kind::Add, &[WORK[at], LOW_ZERO]);
                    asm.op(Kind::Adc, &[WORK[at + 1], ZERO]);
                    if at + 2 < bytes {
                        // The carry goes on; r1:r0 is free to be zero again, and neither EOR nor MOV touches the carry.
                        asm.op(Kind::Ldi, &[COUNT, 0]);
                        (at + 2..bytes).for_each(|n| asm.op(Kind::Adc, &[WORK[n], COUNT]));
                    }
                }
            }
        }
        for n in (0..bytes).step_by(2) {
            if n + 1 < bytes {
                asm.op(Kind::Movw, &[A[n], WORK[n]]);
            } else {
                asm.op(Kind::Mov, &[A[n], WORK[n]]);
            }
        }
    }
    asm.op(Kind::Eor, &[ZERO, ZERO]);
    asm.op(Kind::Eor, &[LOW_ZERO, LOW_ZERO]);
}

/// regs := -regs.
pub fn negate(asm: &mut Asm, regs: [i32; 4], bytes: usize) {
    take(regs, bytes).skip(1).for_each(|reg| asm.op(Kind::Com, &[reg]));
    asm.op(Kind::Neg, &[regs[0]]);
    take(regs, bytes).skip(1).for_each(|reg| asm.op(Kind::Sbci, &[reg, 0xFF]));
}

/// Signed, truncated. Magnitudes are divided bit by bit; with a divisor of 0 every bit of the quotient is 1, which with the
/// dividend's sign is -1 or 1, as the language has it.
fn divide(asm: &mut Asm, bytes: usize, signed: bool) {
    let (count, sign) = if bytes <= 2 { SMALL } else { (COUNT, SIGN) };
    let (a_high, b_high) = (A[bytes - 1], B[bytes - 1]);
    asm.op(Kind::Mov, &[sign, a_high]);
    if signed {
        asm.op(Kind::Eor, &[sign, b_high]);
    }
    for (regs, high) in [(A, a_high), (B, b_high)].into_iter().take(if signed { 2 } else { 1 }) {
        let positive = asm.label();
        asm.op(Kind::And, &[high, high]);
        asm.jump(Jump::If(Kind::Brpl), positive);
        negate(asm, regs, bytes);
        asm.place(positive);
    }
    for n in (0..bytes).step_by(2) {
        if n + 1 < bytes {
            asm.op(Kind::Movw, &[WORK[n], LOW_ZERO]);
        } else {
            asm.op(Kind::Mov, &[WORK[n], ZERO]);
        }
    }
    let bits = 8 * bytes as i32;
    asm.op(Kind::Ldi, &[count, bits]);
    let (again, smaller, positive) = (asm.label(), asm.label(), asm.label());
    asm.place(again);
    asm.op(Kind::Add, &[A[0], A[0]]);
    take(A, bytes).skip(1).for_each(|reg| asm.op(Kind::Adc, &[reg, reg]));
    take(WORK, bytes).for_each(|reg| asm.op(Kind::Adc, &[reg, reg]));
    if bytes > 1 {
        asm.op(Kind::Cp, &[WORK[0], B[0]]);
        take(WORK, bytes).zip(B).skip(1).for_each(|(work, b)| asm.op(Kind::Cpc, &[work, b]));
    } else {
        asm.op(Kind::Cp, &[WORK[0], B[0]]);
    }
    asm.jump(Jump::If(Kind::Brcs), smaller);
    asm.op(Kind::Sub, &[WORK[0], B[0]]);
    take(WORK, bytes).zip(B).skip(1).for_each(|(work, b)| asm.op(Kind::Sbc, &[work, b]));
    asm.op(Kind::Inc, &[A[0]]);
    asm.place(smaller);
    asm.op(Kind::Dec, &[count]);
    asm.repeat(Jump::If(Kind::Brne), again, bits as u32);
    asm.op(Kind::And, &[sign, sign]);
    asm.jump(Jump::If(Kind::Brpl), positive);
    negate(asm, A, bytes);
    asm.place(positive);
}

/// Waits for one bit of a register to be 0: the body of the loop, its jump taken at most so many times.
pub fn wait_clear(asm: &mut Asm, addr: i32, bit: i32, turns: u32) {
    let again = asm.label();
    asm.place(again);
    if regs::has_bits(addr) {
        asm.op(Kind::Sbic, &[addr - 0x20, bit]);
    } else {
        regs::read(asm, BYTE, addr);
        asm.op(Kind::Sbrc, &[BYTE, bit]);
    }
    asm.repeat(Jump::To, again, turns);
}

/// Clocks of a turn of [`wait_clear`].
#[must_use]
pub fn wait_clocks(addr: i32) -> u32 {
    if regs::has_bits(addr) {
        3
    } else if regs::is_io(addr) {
        4
    } else {
        5
    }
}

/// Sets one bit of a register.
pub fn set_bit(asm: &mut Asm, addr: i32, bit: i32) {
    if regs::has_bits(addr) {
        asm.op(Kind::Sbi, &[addr - 0x20, bit]);
    } else {
        regs::read(asm, BYTE, addr);
        asm.op(Kind::Ori, &[BYTE, 1 << bit]);
        regs::write(asm, addr, BYTE);
    }
}

fn convert(asm: &mut Asm, regs: &Regs, turns: u32) {
    let (control, start) = (regs.addr(&["ADCSRA"]), regs.bit(&["ADSC"]));
    set_bit(asm, control, start);
    wait_clear(asm, control, start, turns);
    // The low byte goes first: it locks the high one.
    regs::read(asm, A[0], regs.addr(&["ADCL"]));
    regs::read(asm, A[1], regs.addr(&["ADCH"]));
}

/// Clocks for which reading the EEPROM, and starting to write it, halts the chip.
const READ_HALT: u32 = 4;
const WRITE_HALT: u32 = 2;

/// `to` := the cell of the EEPROM whose address is in [`BYTE`].
fn cell(asm: &mut Asm, regs: &Regs, to: i32) {
    regs::write(asm, regs.addr(&["EEARL"]), BYTE);
    asm.costly(Kind::Sbi, &[regs.addr(&["EECR"]) - 0x20, regs.bit(&["EERE"])], READ_HALT);
    regs::read(asm, to, regs.addr(&["EEDR"]));
}

fn recall(asm: &mut Asm, around: &Around<'_>, bytes: usize) {
    for (n, reg) in take(A, bytes).enumerate() {
        if n > 0 {
            next_cell(asm, around);
        }
        cell(asm, around.regs, reg);
    }
}

/// The address counts up, with its high byte where the program uses so many cells.
fn next_cell(asm: &mut Asm, around: &Around<'_>) {
    asm.op(Kind::Inc, &[BYTE]);
    if around.eeprom > 256 {
        let (same, high) = (asm.label(), around.regs.addr(&["EEARH"]));
        asm.jump(Jump::If(Kind::Brne), same);
        regs::read(asm, SCRATCH, high);
        asm.op(Kind::Inc, &[SCRATCH]);
        regs::write(asm, high, SCRATCH);
        asm.place(same);
    }
}

fn persist(asm: &mut Asm, around: &Around<'_>, bytes: usize, (busy, scans): (Word, i32)) {
    let regs = around.regs;
    let (write, done) = (asm.label(), asm.label());
    for (n, reg) in take(A, bytes).enumerate() {
        if n > 0 {
            next_cell(asm, around);
        }
        cell(asm, regs, SCRATCH);
        asm.op(Kind::Cp, &[SCRATCH, reg]);
        if n + 1 < bytes {
            let same = asm.label();
            if n == 0 {
                asm.jump(Jump::If(Kind::Brne), write);
            } else {
                asm.jump(Jump::If(Kind::Breq), same);
                asm.op(Kind::Mov, &[A[0], reg]);
                asm.jump(Jump::To, write);
            }
            asm.place(same);
        } else {
            asm.jump(Jump::If(Kind::Breq), done);
            if n > 0 {
                asm.op(Kind::Mov, &[A[0], reg]);
            }
        }
    }
    asm.place(write);
    let control = regs.addr(&["EECR"]) - 0x20;
    regs::write(asm, regs.addr(&["EEDR"]), A[0]);
    asm.op(Kind::Sbi, &[control, regs.bit(&["EEMPE", "EEMWE"])]);
    asm.costly(Kind::Sbi, &[control, regs.bit(&["EEPE", "EEWE"])], WRITE_HALT);
    let home = around.layout.word(busy);
    for (byte, n) in scans.to_le_bytes().into_iter().zip(0..around.layout.bytes(busy)) {
        let from = if byte == 0 { ZERO } else { SCRATCH };
        if byte != 0 {
            asm.op(Kind::Ldi, &[SCRATCH, byte.into()]);
        }
        match home {
            Home::Reg(reg) => asm.op(Kind::Mov, &[i32::from(reg + n), from]),
            Home::Ram(addr) => around.layout.store(asm, addr + u16::from(n), from),
        }
    }
    asm.place(done);
}
