//! Selects instructions for operations on peripherals and tables.

use emu_avr::isa::AvrOpKind;

use super::arch::AvrJump;
use super::buses::{AvrI2cSetup, AvrSpiSetup};
use super::pwm::AvrPwmSetup;
use super::registers::{self, A, BYTE, SCRATCH, ZERO};
use super::runtime::AvrRoutine;
use super::select::AvrSelector;
use super::serial::{self, AvrUartSetup};
use super::words::consecutive_registers;
use crate::CodegenError;
use crate::code::CodeLabel;
use crate::ir::{WordId, WordOperand};

/// Settings of the peripherals of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AvrPeripherals {
    /// Serial line, if used.
    pub serial: Option<AvrUartSetup>,
    /// I2C bus, if used.
    pub i2c: Option<AvrI2cSetup>,
    /// SPI bus, if used.
    pub spi: Option<AvrSpiSetup>,
    /// PWM outputs in the order of their numbers.
    pub pwm: Vec<AvrPwmSetup>,
    /// Value of ADMUX for each analog input.
    pub adc_selects: Vec<u8>,
    /// Maximum number of iterations of the loop that waits for a conversion.
    pub conversion_iterations: u32,
    /// Labels of the tables in program memory, by their number in the intermediate code.
    pub tables: Vec<CodeLabel>,
}

/// Z, the low register of the pointer pair.
const POINTER: i32 = 30;

impl AvrSelector<'_> {
    /// dst := `table[index]`.
    pub fn look_up(&mut self, dst: WordId, index: WordId, table: u32) {
        let (ir, devices) = (self.ir, self.devices);
        let found = ir.tables.get(table as usize).zip(devices.tables.get(table as usize));
        let Some((table, &label)) = found else {
            self.internal_error = Some(CodegenError::NoTable { table });
            return;
        };
        let bytes = i32::from(table.bytes);
        let short = table.values.len() * usize::from(table.bytes) <= 256;
        let pointer = consecutive_registers(POINTER);
        let width = if short { 1 } else { 2 };
        self.load_value(WordOperand::Cell(index), width, pointer);
        let add = |this: &mut Self, other: i32| {
            this.asm.op(AvrOpKind::Add, &[POINTER, other]);
            if !short {
                this.asm.op(AvrOpKind::Adc, &[POINTER + 1, other + 1]);
            }
        };
        match bytes {
            2 => add(self, POINTER),
            3 => {
                self.copy_registers(consecutive_registers(BYTE), pointer, width);
                add(self, POINTER);
                add(self, BYTE);
            }
            4 => {
                add(self, POINTER);
                add(self, POINTER);
            }
            _ => {}
        }
        if short {
            self.asm.op(AvrOpKind::Ldi, &[POINTER + 1, 0]);
        }
        // LPM uses byte addresses. There is no add with a constant, so the code subtracts the negated
        // address.
        self.asm.op_with_label_value(AvrOpKind::Subi, &[POINTER, 0], 1, label, |word| {
            (2 * word as i32).wrapping_neg() & 0xFF
        });
        self.asm.op_with_label_value(AvrOpKind::Sbci, &[POINTER + 1, 0], 1, label, |word| {
            (2 * word as i32).wrapping_neg() >> 8 & 0xFF
        });
        let wanted = self.bytes(dst);
        let home = self.home_registers(dst);
        let to = home.unwrap_or(A);
        let have = wanted.min(usize::from(table.bytes));
        for (n, &reg) in to.iter().enumerate().take(have) {
            self.asm.op(if n + 1 < have { AvrOpKind::LpmZi } else { AvrOpKind::LpmZ }, &[reg]);
        }
        if table.values.iter().any(|&value| value < 0) {
            self.sign_extend(to, have, wanted);
        } else {
            to.iter().take(wanted).skip(have).for_each(|&reg| self.asm.op(AvrOpKind::Mov, &[reg, ZERO]));
        }
        if home.is_some() {
            self.invalidate_cached(dst);
        } else {
            self.known.a = None;
            self.store_registers(dst, A);
        }
    }

    /// dst := the result of converting an analog input.
    pub fn read_adc(&mut self, dst: WordId, input: u32) {
        let devices = self.devices;
        // A single input stays selected, so it is selected only at reset.
        if let (Some(&select), true) = (devices.adc_selects.get(input as usize), devices.adc_selects.len() > 1) {
            registers::write_constant(self.asm, self.regs.addr(&["ADMUX"]), select.into(), SCRATCH);
        }
        self.routine(AvrRoutine::Convert(devices.conversion_iterations));
        let wanted = self.bytes(dst);
        A.iter().take(wanted).skip(2).for_each(|&reg| self.asm.op(AvrOpKind::Mov, &[reg, ZERO]));
        self.store_registers(dst, A);
    }

    /// Sets the duty cycle of a PWM output to a value.
    pub fn set_pwm(&mut self, output: u32, duty: WordOperand) {
        let Some(&pwm) = self.devices.pwm.get(output as usize) else {
            self.internal_error = Some(CodegenError::NoPwmFrequency);
            return;
        };
        match duty {
            WordOperand::Const(duty) => pwm.set_constant_duty(self.asm, self.regs, duty),
            WordOperand::Cell(word) => {
                let bytes = self.bytes(word);
                self.load_value(duty, bytes, A);
                pwm.set_variable_duty(self.asm, self.regs, bytes);
                self.known.a = None;
            }
        }
    }

    /// Writes the low byte of a value to the transmitter.
    pub fn send(&mut self, value: WordOperand) {
        let [from, ..] = self.source_registers(value, 1, A);
        if self.ir.uart.waits
            && let Some(line) = self.devices.serial
        {
            line.clear_sent(self.asm, self.regs);
        }
        registers::write(self.asm, self.regs.serial(serial::DATA), from);
    }

    /// Waits until the transmitter has sent its byte.
    pub fn wait_sent(&mut self) {
        if let Some(line) = self.devices.serial {
            line.wait_sent(self.asm, self.regs);
        }
    }

    /// T := a byte has been received; if so, it is stored in dst.
    pub fn receive(&mut self, dst: WordId) {
        let over = self.asm.new_label();
        let (status, bit) = (self.regs.serial(serial::STATUS), self.regs.bit(serial::RECEIVED));
        self.asm.op(AvrOpKind::Clt, &[]);
        if registers::is_bit_addressable(status) {
            self.asm.op(AvrOpKind::Sbis, &[status - 0x20, bit]);
        } else {
            registers::read(self.asm, BYTE, status);
            self.asm.op(AvrOpKind::Sbrs, &[BYTE, bit]);
        }
        self.asm.jump(AvrJump::To, over);
        let before = self.known.a;
        let wanted = self.bytes(dst);
        let home = self.home_registers(dst);
        let to = home.unwrap_or(A);
        registers::read(self.asm, to[0], self.regs.serial(serial::DATA));
        to.iter().take(wanted).skip(1).for_each(|&reg| self.asm.op(AvrOpKind::Mov, &[reg, ZERO]));
        if home.is_none() {
            self.store_registers(dst, A);
        }
        self.asm.op(AvrOpKind::Set, &[]);
        self.asm.place_label(over);
        // After the two paths join, A may hold dst, its old content, or neither.
        self.known.a = before.filter(|_| home.is_some());
        self.invalidate_cached(dst);
        self.known.t = None;
    }

    /// Loads the address of an EEPROM cell: the low byte to the register of the routines, the high byte to
    /// EEARH.
    fn cell_address(&mut self, addr: u16) {
        let [low, high] = addr.to_le_bytes();
        self.asm.op(AvrOpKind::Ldi, &[BYTE, low.into()]);
        if self.ir.eeprom_bytes > 256 {
            registers::write_constant(self.asm, self.regs.addr(&["EEARH"]), high.into(), SCRATCH);
        }
    }

    /// dst := EEPROM from `addr` on.
    pub fn recall(&mut self, dst: WordId, addr: u16) {
        self.cell_address(addr);
        self.routine(AvrRoutine::ReadEeprom(self.layout.bytes(dst)));
        self.store_registers(dst, A);
    }

    /// Writes one byte of src to the EEPROM, if it differs from its cell.
    pub fn persist(&mut self, src: WordId, addr: u16, busy: WordId, scans: i32) {
        let bytes = self.layout.bytes(src);
        self.load_value(WordOperand::Cell(src), bytes.into(), A);
        self.cell_address(addr);
        self.routine(AvrRoutine::WriteEeprom(bytes, busy, scans));
    }
}
