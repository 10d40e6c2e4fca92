//! Subroutines for programs. Operands are in [`A`] and [`B`], results in A. A routine with a single call is
//! inlined there.

use emu_avr::isa::AvrOpKind;

use super::arch::{AvrCodeWriter, AvrJump};
use super::buses;
use super::layout::{AvrCellPlace, AvrLayout};
use super::registers::{self, A, AvrRegisters, B, BYTE, LOW_ZERO, SCRATCH, ZERO};
use crate::ir::WordId;

/// A subroutine and its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AvrRoutine {
    /// A := A * B, with this many bytes.
    Multiply(u8),
    /// A := A / B, with this many bytes; false if B is known to be positive.
    Divide(u8, bool),
    /// A := the conversion of the selected input, waiting for at most this many iterations.
    Convert(u32),
    /// A := this many bytes of EEPROM, from the address in [`BYTE`] on.
    ReadEeprom(u8),
    /// Writes this many bytes of A to the EEPROM from the address in [`BYTE`] on, as
    /// [`IrOp::WriteEeprom`](crate::ir::IrOp::WriteEeprom) requires.
    WriteEeprom(u8, WordId, i32),
    /// Writes a register of an I2C device, waiting for at most this many iterations for each byte.
    I2cWrite(u32),
    /// A := a register of an I2C device, with such waits.
    I2cRead(u32),
    /// A := the byte that SPI exchanges for that in A, with such a wait; the pin of the device by its letter
    /// and number.
    Spi(u32, (char, u8)),
}

/// What the bodies of the subroutines need.
#[derive(Debug, Clone, Copy)]
pub struct RoutineContext<'a> {
    /// Register lookup of the chip.
    pub regs: &'a AvrRegisters,
    /// Places of the cells.
    pub layout: &'a AvrLayout,
    /// Number of EEPROM bytes in use.
    pub eeprom: u16,
}

impl AvrRoutine {
    /// Title for the listing.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            AvrRoutine::Multiply(_) => "multiplication",
            AvrRoutine::Divide(..) => "division",
            AvrRoutine::Convert(_) => "conversion",
            AvrRoutine::ReadEeprom(_) => "read the EEPROM",
            AvrRoutine::WriteEeprom(..) => "write the EEPROM",
            AvrRoutine::I2cWrite(_) => "write an I2C register",
            AvrRoutine::I2cRead(_) => "read an I2C register",
            AvrRoutine::Spi(..) => "exchange a byte on SPI",
        }
    }

    /// Emits the instructions of the routine, without the return.
    pub fn body(self, asm: &mut AvrCodeWriter, context: &RoutineContext<'_>) {
        match self {
            AvrRoutine::Multiply(bytes) => multiply(asm, bytes.into()),
            AvrRoutine::Divide(bytes, signed) => divide(asm, bytes.into(), signed),
            AvrRoutine::Convert(turns) => convert(asm, context.regs, turns),
            AvrRoutine::ReadEeprom(bytes) => recall(asm, context, bytes.into()),
            AvrRoutine::I2cWrite(turns) => buses::write_register(asm, context.regs, turns),
            AvrRoutine::I2cRead(turns) => buses::read_register(asm, context.regs, turns),
            AvrRoutine::Spi(turns, select) => buses::exchange(asm, context.regs, turns, select),
            AvrRoutine::WriteEeprom(bytes, busy, scans) => persist(asm, context, bytes.into(), (busy, scans)),
        }
    }
}

/// Bytes of the product and of the remainder during the computation.
const WORK_REGISTERS: [i32; 4] = [18, 19, 30, 31];
/// Counter of the bits of a division.
const COUNT_REGISTER: i32 = 16;
/// Sign of a quotient.
const SIGN_REGISTER: i32 = 17;
/// Counter and sign in divisions of at most two bytes, which do not use r17:r16.
const NARROW_REGISTERS: (i32, i32) = (20, 21);

fn low_registers(regs: [i32; 4], bytes: usize) -> impl Iterator<Item = i32> {
    regs.into_iter().take(bytes)
}

/// Emits a multiplication that computes only the low half of the product.
fn multiply(asm: &mut AvrCodeWriter, bytes: usize) {
    if bytes == 1 {
        asm.op(AvrOpKind::Mul, &[A[0], B[0]]);
        asm.op(AvrOpKind::Mov, &[A[0], LOW_ZERO]);
    } else {
        let mut fresh = [true; 4];
        // Products at even positions first: they fill pairs of bytes without a carry to propagate.
        let mut pairs: Vec<(usize, usize)> = (0..bytes).flat_map(|i| (0..bytes - i).map(move |j| (i, j))).collect();
        pairs.sort_by_key(|&(i, j)| ((i + j) % 2 == 1, i + j));
        for (i, j) in pairs {
            let at = i + j;
            asm.op(AvrOpKind::Mul, &[A[i], B[j]]);
            match (fresh[at], at + 1 < bytes) {
                (true, true) if fresh[at + 1] => {
                    asm.op(AvrOpKind::Movw, &[WORK_REGISTERS[at], LOW_ZERO]);
                    (fresh[at], fresh[at + 1]) = (false, false);
                }
                (true, false) => {
                    asm.op(AvrOpKind::Mov, &[WORK_REGISTERS[at], LOW_ZERO]);
                    fresh[at] = false;
                }
                (_, false) => asm.op(AvrOpKind::Add, &[WORK_REGISTERS[at], LOW_ZERO]),
                _ => {
                    asm.op(AvrOpKind::Add, &[WORK_REGISTERS[at], LOW_ZERO]);
                    asm.op(AvrOpKind::Adc, &[WORK_REGISTERS[at + 1], ZERO]);
                    if at + 2 < bytes {
                        // Propagate the carry. r1:r0 may become zero again here, because neither EOR nor MOV
                        // changes the carry.
                        asm.op(AvrOpKind::Ldi, &[COUNT_REGISTER, 0]);
                        (at + 2..bytes).for_each(|n| asm.op(AvrOpKind::Adc, &[WORK_REGISTERS[n], COUNT_REGISTER]));
                    }
                }
            }
        }
        for n in (0..bytes).step_by(2) {
            if n + 1 < bytes {
                asm.op(AvrOpKind::Movw, &[A[n], WORK_REGISTERS[n]]);
            } else {
                asm.op(AvrOpKind::Mov, &[A[n], WORK_REGISTERS[n]]);
            }
        }
    }
    asm.op(AvrOpKind::Eor, &[ZERO, ZERO]);
    asm.op(AvrOpKind::Eor, &[LOW_ZERO, LOW_ZERO]);
}

/// Emits regs := -regs.
pub fn negate(asm: &mut AvrCodeWriter, regs: [i32; 4], bytes: usize) {
    low_registers(regs, bytes).skip(1).for_each(|reg| asm.op(AvrOpKind::Com, &[reg]));
    asm.op(AvrOpKind::Neg, &[regs[0]]);
    low_registers(regs, bytes).skip(1).for_each(|reg| asm.op(AvrOpKind::Sbci, &[reg, 0xFF]));
}

/// Emits a signed division that truncates toward zero.
///
/// The magnitudes are divided bit by bit. A divisor of 0 gives a quotient of all ones, which with the sign of
/// the dividend is -1 or 1, as the language requires.
fn divide(asm: &mut AvrCodeWriter, bytes: usize, signed: bool) {
    let (count, sign) = if bytes <= 2 { NARROW_REGISTERS } else { (COUNT_REGISTER, SIGN_REGISTER) };
    let (a_high, b_high) = (A[bytes - 1], B[bytes - 1]);
    asm.op(AvrOpKind::Mov, &[sign, a_high]);
    if signed {
        asm.op(AvrOpKind::Eor, &[sign, b_high]);
    }
    for (regs, high) in [(A, a_high), (B, b_high)].into_iter().take(if signed { 2 } else { 1 }) {
        let positive = asm.new_label();
        asm.op(AvrOpKind::And, &[high, high]);
        asm.jump(AvrJump::If(AvrOpKind::Brpl), positive);
        negate(asm, regs, bytes);
        asm.place_label(positive);
    }
    for n in (0..bytes).step_by(2) {
        if n + 1 < bytes {
            asm.op(AvrOpKind::Movw, &[WORK_REGISTERS[n], LOW_ZERO]);
        } else {
            asm.op(AvrOpKind::Mov, &[WORK_REGISTERS[n], ZERO]);
        }
    }
    let bits = 8 * bytes as i32;
    asm.op(AvrOpKind::Ldi, &[count, bits]);
    let (again, smaller, positive) = (asm.new_label(), asm.new_label(), asm.new_label());
    asm.place_label(again);
    asm.op(AvrOpKind::Add, &[A[0], A[0]]);
    low_registers(A, bytes).skip(1).for_each(|reg| asm.op(AvrOpKind::Adc, &[reg, reg]));
    low_registers(WORK_REGISTERS, bytes).for_each(|reg| asm.op(AvrOpKind::Adc, &[reg, reg]));
    if bytes > 1 {
        asm.op(AvrOpKind::Cp, &[WORK_REGISTERS[0], B[0]]);
        low_registers(WORK_REGISTERS, bytes).zip(B).skip(1).for_each(|(work, b)| asm.op(AvrOpKind::Cpc, &[work, b]));
    } else {
        asm.op(AvrOpKind::Cp, &[WORK_REGISTERS[0], B[0]]);
    }
    asm.jump(AvrJump::If(AvrOpKind::Brcs), smaller);
    asm.op(AvrOpKind::Sub, &[WORK_REGISTERS[0], B[0]]);
    low_registers(WORK_REGISTERS, bytes).zip(B).skip(1).for_each(|(work, b)| asm.op(AvrOpKind::Sbc, &[work, b]));
    asm.op(AvrOpKind::Inc, &[A[0]]);
    asm.place_label(smaller);
    asm.op(AvrOpKind::Dec, &[count]);
    asm.jump_back(AvrJump::If(AvrOpKind::Brne), again, bits as u32);
    asm.op(AvrOpKind::And, &[sign, sign]);
    asm.jump(AvrJump::If(AvrOpKind::Brpl), positive);
    negate(asm, A, bytes);
    asm.place_label(positive);
}

/// Emits a loop that waits until one bit of a register is 0, bounded to `turns` iterations for the longest
/// path.
pub fn wait_clear(asm: &mut AvrCodeWriter, addr: i32, bit: i32, turns: u32) {
    let again = asm.new_label();
    asm.place_label(again);
    if registers::is_bit_addressable(addr) {
        asm.op(AvrOpKind::Sbic, &[addr - 0x20, bit]);
    } else {
        registers::read(asm, BYTE, addr);
        asm.op(AvrOpKind::Sbrc, &[BYTE, bit]);
    }
    asm.jump_back(AvrJump::To, again, turns);
}

/// Clocks per iteration of [`wait_clear`].
#[must_use]
pub fn wait_clocks(addr: i32) -> u32 {
    if registers::is_bit_addressable(addr) {
        3
    } else if registers::is_io(addr) {
        4
    } else {
        5
    }
}

/// Emits code that sets one bit of a register.
pub fn set_bit(asm: &mut AvrCodeWriter, addr: i32, bit: i32) {
    if registers::is_bit_addressable(addr) {
        asm.op(AvrOpKind::Sbi, &[addr - 0x20, bit]);
    } else {
        registers::read(asm, BYTE, addr);
        asm.op(AvrOpKind::Ori, &[BYTE, 1 << bit]);
        registers::write(asm, addr, BYTE);
    }
}

fn convert(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32) {
    let (control, start) = (regs.addr(&["ADCSRA"]), regs.bit(&["ADSC"]));
    set_bit(asm, control, start);
    wait_clear(asm, control, start, turns);
    // Read the low byte first: this locks the high one.
    registers::read(asm, A[0], regs.addr(&["ADCL"]));
    registers::read(asm, A[1], regs.addr(&["ADCH"]));
}

/// Clocks for which reading the EEPROM halts the CPU; below, those of starting a write.
const EEPROM_READ_HALT_CLOCKS: u32 = 4;
const EEPROM_WRITE_HALT_CLOCKS: u32 = 2;

/// Emits `to` := the EEPROM cell whose address is in [`BYTE`].
fn read_cell(asm: &mut AvrCodeWriter, regs: &AvrRegisters, to: i32) {
    registers::write(asm, regs.addr(&["EEARL"]), BYTE);
    asm.op_with_extra_cycles(
        AvrOpKind::Sbi,
        &[regs.addr(&["EECR"]) - 0x20, regs.bit(&["EERE"])],
        EEPROM_READ_HALT_CLOCKS,
    );
    registers::read(asm, to, regs.addr(&["EEDR"]));
}

fn recall(asm: &mut AvrCodeWriter, context: &RoutineContext<'_>, bytes: usize) {
    for (n, reg) in low_registers(A, bytes).enumerate() {
        if n > 0 {
            increment_cell_address(asm, context);
        }
        read_cell(asm, context.regs, reg);
    }
}

/// Increments the EEPROM address, including its high byte if the program uses more than 256 cells.
fn increment_cell_address(asm: &mut AvrCodeWriter, context: &RoutineContext<'_>) {
    asm.op(AvrOpKind::Inc, &[BYTE]);
    if context.eeprom > 256 {
        let (same, high) = (asm.new_label(), context.regs.addr(&["EEARH"]));
        asm.jump(AvrJump::If(AvrOpKind::Brne), same);
        registers::read(asm, SCRATCH, high);
        asm.op(AvrOpKind::Inc, &[SCRATCH]);
        registers::write(asm, high, SCRATCH);
        asm.place_label(same);
    }
}

fn persist(asm: &mut AvrCodeWriter, context: &RoutineContext<'_>, bytes: usize, (busy, scans): (WordId, i32)) {
    let regs = context.regs;
    let (write, done) = (asm.new_label(), asm.new_label());
    for (n, reg) in low_registers(A, bytes).enumerate() {
        if n > 0 {
            increment_cell_address(asm, context);
        }
        read_cell(asm, regs, SCRATCH);
        asm.op(AvrOpKind::Cp, &[SCRATCH, reg]);
        if n + 1 < bytes {
            let same = asm.new_label();
            if n == 0 {
                asm.jump(AvrJump::If(AvrOpKind::Brne), write);
            } else {
                asm.jump(AvrJump::If(AvrOpKind::Breq), same);
                asm.op(AvrOpKind::Mov, &[A[0], reg]);
                asm.jump(AvrJump::To, write);
            }
            asm.place_label(same);
        } else {
            asm.jump(AvrJump::If(AvrOpKind::Breq), done);
            if n > 0 {
                asm.op(AvrOpKind::Mov, &[A[0], reg]);
            }
        }
    }
    asm.place_label(write);
    let control = regs.addr(&["EECR"]) - 0x20;
    registers::write(asm, regs.addr(&["EEDR"]), A[0]);
    asm.op(AvrOpKind::Sbi, &[control, regs.bit(&["EEMPE", "EEMWE"])]);
    asm.op_with_extra_cycles(AvrOpKind::Sbi, &[control, regs.bit(&["EEPE", "EEWE"])], EEPROM_WRITE_HALT_CLOCKS);
    let home = context.layout.word(busy);
    for (byte, n) in scans.to_le_bytes().into_iter().zip(0..context.layout.bytes(busy)) {
        let from = if byte == 0 { ZERO } else { SCRATCH };
        if byte != 0 {
            asm.op(AvrOpKind::Ldi, &[SCRATCH, byte.into()]);
        }
        match home {
            AvrCellPlace::Reg(reg) => asm.op(AvrOpKind::Mov, &[i32::from(reg + n), from]),
            AvrCellPlace::Ram(addr) => context.layout.store(asm, addr + u16::from(n), from),
        }
    }
    asm.place_label(done);
}
