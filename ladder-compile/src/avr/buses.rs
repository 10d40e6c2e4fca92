//! The I2C and SPI buses: their settings, their set-up, and the subroutines of their transfers.

use emu_avr::isa::AvrOpKind;

use super::arch::{AvrCodeWriter, AvrJump};
use super::layout::port_and_mask;
use super::registers::{self, A, AvrRegisters, B, BYTE, SCRATCH, ZERO};
use super::runtime::{AvrRoutine, wait_clear, wait_clocks};
use super::select::AvrSelector;
use crate::CodegenError;
use crate::ir::{BusAction, WordId, WordOperand};
use crate::target::CompileJob;

/// Settings of the I2C bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrI2cSetup {
    /// Value of TWBR.
    rate: u8,
    /// Value of TWSR: binary logarithm of the prescaler, by twos.
    prescaler: u8,
    /// Clocks per bit.
    pub bit: u64,
}

/// Settings of the SPI bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrSpiSetup {
    /// Bits SPR1 and SPR0.
    rate: u8,
    /// SPI2X.
    double: bool,
    /// Clocks per bit.
    pub bit: u64,
    /// Letter and number of the pin that selects the device.
    select: (char, u8),
}

/// Clocks of a bit that do not depend on TWBR, and the least TWBR of a master (data sheet of ATmega16, "Bit
/// rate generator unit").
const FIXED_BIT_CLOCKS: u64 = 16;
const MIN_RATE: u64 = 10;

/// Bit times of a byte with its acknowledge, and of a start or stop before it, with the wait for a free bus.
const BYTE_BITS: u64 = 12;
/// Clocks of the instructions around a transfer, which its wait covers too.
const OVERHEAD_CLOCKS: u64 = 32;

/// The highest rate that is not above the wanted one; the lowest possible rate if all are above.
#[must_use]
pub fn plan_i2c(job: &CompileJob<'_>) -> Option<AvrI2cSetup> {
    let hertz = u64::from(job.ir.buses.i2c?).max(1);
    let over = job.clock_hz.div_ceil(hertz).saturating_sub(FIXED_BIT_CLOCKS);
    let setup = |prescaler: u8, rate: u64| {
        let bit = FIXED_BIT_CLOCKS + ((2 * rate) << (2 * prescaler));
        AvrI2cSetup { rate: rate as u8, prescaler, bit }
    };
    let fits = (0..4u8).find_map(|prescaler| {
        let rate = over.div_ceil(2 << (2 * prescaler)).max(MIN_RATE);
        (rate <= 255).then(|| setup(prescaler, rate))
    });
    Some(fits.unwrap_or_else(|| setup(3, 255)))
}

/// Clocks per bit, SPR and SPI2X. Half the clock is left out: a device has no time to answer.
const SPI_RATES: [(u64, u8, bool); 6] =
    [(4, 0, false), (8, 1, true), (16, 1, false), (32, 2, true), (64, 2, false), (128, 3, false)];

/// The highest rate that is not above the wanted one; the lowest possible rate if all are above.
#[must_use]
pub fn plan_spi(job: &CompileJob<'_>) -> Option<AvrSpiSetup> {
    let (hertz, [select, ..]) = (u64::from(job.ir.buses.spi?), job.target.spi?);
    let fits = |row: &&(u64, u8, bool)| job.clock_hz <= row.0.saturating_mul(hertz);
    let &(bit, rate, double) = SPI_RATES.iter().find(fits).or(SPI_RATES.last())?;
    let (letter, mask) = port_and_mask(select);
    Some(AvrSpiSetup { rate, double, bit, select: (letter, mask.trailing_zeros() as u8) })
}

impl AvrI2cSetup {
    /// Emits the set-up of the rate; each transfer enables the bus itself.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        registers::write_constant(asm, regs.addr(&["TWBR"]), self.rate.into(), 24);
        registers::write_constant(asm, regs.addr(&["TWSR"]), self.prescaler.into(), 24);
    }

    /// Iterations of the loop that waits for a byte.
    fn iterations(&self, regs: &AvrRegisters) -> u32 {
        let clocks = BYTE_BITS * self.bit + OVERHEAD_CLOCKS;
        clocks.div_ceil(wait_clocks(regs.addr(&["TWCR"])).into()) as u32
    }
}

impl AvrSpiSetup {
    /// Emits the set-up: master, mode 0. The pins are outputs already, and the device is not selected.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        let control = regs.mask(&[&["SPE"], &["MSTR"]]) | i32::from(self.rate);
        registers::write_constant(asm, regs.addr(&["SPCR"]), control, 24);
        if self.double {
            registers::write_constant(asm, regs.addr(&["SPSR"]), regs.mask(&[&["SPI2X"]]), 24);
        }
    }

    /// Iterations of the loop that waits for a byte.
    fn iterations(&self, regs: &AvrRegisters) -> u32 {
        (9 * self.bit + OVERHEAD_CLOCKS).div_ceil(wait_clocks(regs.addr(&["SPSR"])).into()) as u32
    }
}

/// Emits a loop that waits until one bit of a register is 1, bounded to `turns` iterations for the longest
/// path.
pub fn wait_set(asm: &mut AvrCodeWriter, addr: i32, bit: i32, turns: u32) {
    let again = asm.new_label();
    asm.place_label(again);
    registers::read(asm, BYTE, addr);
    asm.op(AvrOpKind::Sbrs, &[BYTE, bit]);
    asm.jump_back(AvrJump::To, again, turns);
}

/// Emits a step of the I2C bus: the control bits besides TWINT and TWEN, and the wait for its end.
fn step(asm: &mut AvrCodeWriter, regs: &AvrRegisters, bits: &[&[&str]], turns: u32) {
    let control = regs.addr(&["TWCR"]);
    let go = regs.mask(&[&["TWINT"], &["TWEN"]]) | regs.mask(bits);
    registers::write_constant(asm, control, go, BYTE);
    wait_set(asm, control, regs.bit(&["TWINT"]), turns);
}

/// Emits a step that sends the byte in a register.
fn send_byte(asm: &mut AvrCodeWriter, regs: &AvrRegisters, from: i32, turns: u32) {
    registers::write(asm, regs.addr(&["TWDR"]), from);
    step(asm, regs, &[], turns);
}

/// Emits the start, the address in [`SCRATCH`] for writing, and the register in B.
fn address_register(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32) {
    step(asm, regs, &[&["TWSTA"]], turns);
    send_byte(asm, regs, SCRATCH, turns);
    send_byte(asm, regs, B[0], turns);
}

/// Emits the stop and the wait for it.
fn stop(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32) {
    let control = regs.addr(&["TWCR"]);
    registers::write_constant(asm, control, regs.mask(&[&["TWINT"], &["TWEN"], &["TWSTO"]]), BYTE);
    wait_clear(asm, control, regs.bit(&["TWSTO"]), turns);
}

/// Emits the write of a register of a device, which need not answer: address in [`SCRATCH`], register in B,
/// byte in A.
pub fn write_register(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32) {
    address_register(asm, regs, turns);
    send_byte(asm, regs, A[0], turns);
    stop(asm, regs, turns);
}

/// Status of TWSR: the device has answered the address for reading.
const READING: i32 = 0x40;
/// Bits of the status in TWSR.
const STATUS_BITS: i32 = 0xF8;

/// Emits A := a register of a device: address in [`SCRATCH`], register in B. FFh if no device answers.
pub fn read_register(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32) {
    address_register(asm, regs, turns);
    step(asm, regs, &[&["TWSTA"]], turns);
    asm.op(AvrOpKind::Ori, &[SCRATCH, 1]);
    send_byte(asm, regs, SCRATCH, turns);
    registers::read(asm, BYTE, regs.addr(&["TWSR"]));
    asm.op(AvrOpKind::Andi, &[BYTE, STATUS_BITS]);
    asm.op(AvrOpKind::Ldi, &[A[0], 0xFF]);
    asm.op(AvrOpKind::Cpi, &[BYTE, READING]);
    let over = asm.new_label();
    asm.jump(AvrJump::If(AvrOpKind::Brne), over);
    step(asm, regs, &[], turns);
    registers::read(asm, A[0], regs.addr(&["TWDR"]));
    asm.place_label(over);
    stop(asm, regs, turns);
}

/// Emits A := the byte that comes while that in A goes, with the device selected.
pub fn exchange(asm: &mut AvrCodeWriter, regs: &AvrRegisters, turns: u32, (letter, bit): (char, u8)) {
    // The ports of all chips that have the bus are within reach of CBI and SBI.
    let port = regs.port("PORT", letter) - 0x20;
    asm.op(AvrOpKind::Cbi, &[port, bit.into()]);
    registers::write(asm, regs.addr(&["SPDR"]), A[0]);
    wait_set(asm, regs.addr(&["SPSR"]), regs.bit(&["SPIF"]), turns);
    asm.op(AvrOpKind::Sbi, &[port, bit.into()]);
    registers::read(asm, A[0], regs.addr(&["SPDR"]));
}

impl AvrSelector<'_> {
    /// A transfer on a bus, and its wait.
    pub fn transfer(&mut self, action: BusAction, register: WordOperand, value: WordOperand, dst: Option<WordId>) {
        let (devices, regs) = (self.devices, self.regs);
        let routine = match (action, devices.i2c, devices.spi) {
            (BusAction::I2cWrite(_), Some(i2c), _) => AvrRoutine::I2cWrite(i2c.iterations(regs)),
            (BusAction::I2cRead(_), Some(i2c), _) => AvrRoutine::I2cRead(i2c.iterations(regs)),
            (BusAction::Spi, _, Some(spi)) => AvrRoutine::Spi(spi.iterations(regs), spi.select),
            _ => {
                self.internal_error = Some(CodegenError::NoBus);
                return;
            }
        };
        if !matches!(action, BusAction::I2cRead(_)) {
            self.load_value(value, 1, A);
        }
        if let BusAction::I2cWrite(device) | BusAction::I2cRead(device) = action {
            self.load_value(register, 1, B);
            self.asm.op(AvrOpKind::Ldi, &[SCRATCH, i32::from(device) << 1]);
        }
        self.routine(routine);
        let Some(dst) = dst else { return };
        let wanted = self.bytes(dst);
        A.iter().take(wanted).skip(1).for_each(|&reg| self.asm.op(AvrOpKind::Mov, &[reg, ZERO]));
        self.store_registers(dst, A);
    }
}
