//! Subroutines, generated once for each width that a program uses. Multiplication and division work in
//! scratch:
//!
//! ```text
//! 0            scratch of comparisons, and a byte of the subroutines
//! 1            operand 0, and the quotient     (as many bytes as the width)
//! 1 + w        operand 1
//! 1 + 2 w      product, remainder
//! 1 + 3 w      count
//! 2 + 3 w      sign
//! ```

use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::buses;
use super::chip_data::ANY_BANK;
use super::peripherals::{self, Pic16Peripherals, Pic16PwmSetup};
use super::select::Pic16Routine;
use super::writer::{C, Pic16Label, Pic16Writer, STATUS, Z};
use crate::ir::Ir;
use crate::target::CodeMark;

/// Number of bytes of scratch for arithmetic of a width.
#[must_use]
pub fn scratch(bytes: u8) -> u16 {
    3 + 3 * u16::from(bytes)
}

/// Emits a subroutine; `scratch` is the address of its scratch, `index` that of the word that indexes a
/// table.
pub fn emit_routine(
    out: &mut Pic16Writer<'_>,
    (routine, label): (Pic16Routine, Pic16Label),
    ir: &Ir,
    scratch: u16,
    negate: Option<Pic16Label>,
    index: u16,
    devices: &Pic16Peripherals,
) {
    let near = out.chip.reachable_banks(scratch);
    let start = |out: &mut Pic16Writer<'_>, title| {
        out.mark(CodeMark::Section(title));
        out.assume_banks(near);
        out.place(label);
    };
    match routine {
        Pic16Routine::Multiply(width) => {
            start(out, "product");
            multiply(out, width.into(), scratch);
        }
        Pic16Routine::Divide(width) => {
            start(out, "quotient");
            divide(out, width.into(), scratch, negate);
        }
        Pic16Routine::Negate(which, width) => {
            start(out, "negative");
            let at = scratch + 1 + which * u16::from(width);
            (0..u16::from(width)).for_each(|n| out.byte_op(Pic16OpKind::ComfF, at + n));
            for n in 0..u16::from(width) {
                if n > 0 {
                    out.skip_unless((STATUS, Z), true);
                }
                out.byte_op(Pic16OpKind::IncfF, at + n);
            }
            out.implied_op(Pic16OpKind::Return);
        }
        Pic16Routine::Table(table, byte, _) => {
            out.mark(CodeMark::Section("table"));
            out.assume_banks(out.chip.reachable_banks(index));
            out.place(label);
            let values = ir.tables.get(table as usize).map_or(&[][..], |table| &table.values);
            self::emit_table(out, values, byte, index);
        }
        Pic16Routine::Convert => emit_conversion(out, label, devices, scratch),
        Pic16Routine::ReadEeprom => {
            out.mark(CodeMark::Section("read EEPROM"));
            out.assume_banks(ANY_BANK);
            out.place(label);
            let chip = out.chip;
            out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::EEADR));
            if chip.has_bit("EEPGD") {
                out.set_bit(chip.bit("EEPGD"), false);
            }
            out.set_bit(chip.bit("RD"), true);
            out.byte_op(Pic16OpKind::MovfW, chip.reg(Sfr::EEDATA));
            out.select_bank(1);
            out.implied_op(Pic16OpKind::Return);
        }
        Pic16Routine::WriteEeprom => {
            out.mark(CodeMark::Section("write EEPROM"));
            out.assume_banks(ANY_BANK);
            out.place(label);
            let chip = out.chip;
            out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::EEDATA));
            out.set_bit(chip.bit("WREN"), true);
            // Unlock sequence of the data sheet; interrupts are off.
            for k in [0x55, 0xAA] {
                out.literal_op(Pic16OpKind::Movlw, k);
                out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::EECON2));
            }
            out.set_bit(chip.bit("WR"), true);
            out.set_bit(chip.bit("WREN"), false);
            out.select_bank(1);
            out.implied_op(Pic16OpKind::Return);
        }
        Pic16Routine::I2cWrite | Pic16Routine::I2cRead | Pic16Routine::Spi => {
            buses::emit_transfer(out, (routine, label), devices.bus, scratch);
        }
        Pic16Routine::Duty(output) => {
            let banks = out.common_banks(&[scratch, peripherals::duty_register(out.chip, devices, output)]);
            out.mark(CodeMark::Section("duty"));
            out.assume_banks(banks);
            out.place(label);
            emit_duty(out, devices.pwm.get(output as usize).copied(), scratch);
        }
    }
}

/// Emits operand 0 * operand 1, by shifting and adding.
fn multiply(out: &mut Pic16Writer<'_>, width: u16, scratch: u16) {
    let (a, b, product) = (scratch + 1, scratch + 1 + width, scratch + 1 + 2 * width);
    let count = product + width;
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::Clrf, product + n));
    out.set_byte(count, 8 * width as u8);
    let (again, zero) = (out.label(), out.label());
    out.place(again);
    // Shift a right and test its lowest bit; the bit shifted in at the top does not matter.
    (0..width).rev().for_each(|n| out.byte_op(Pic16OpKind::RrfF, a + n));
    out.skip_unless((STATUS, C), false);
    out.goto(zero);
    for n in 0..width {
        out.byte_op(Pic16OpKind::MovfW, b + n);
        if n > 0 {
            out.skip_unless((STATUS, C), true);
            out.byte_op(Pic16OpKind::IncfszW, b + n);
        }
        out.byte_op(Pic16OpKind::AddwfF, product + n);
    }
    out.place(zero);
    out.set_bit((STATUS, C), false);
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::RlfF, b + n));
    out.byte_op(Pic16OpKind::DecfszF, count);
    out.goto_back(again, 8 * u32::from(width) - 1);
    out.implied_op(Pic16OpKind::Return);
}

/// Emits operand 0 := operand 0 / operand 1, truncated toward zero.
///
/// The magnitudes are divided bit by bit. A divisor of 0 gives a quotient of all ones, which with the sign of
/// the dividend is -1 or 1, as the language requires.
fn divide(out: &mut Pic16Writer<'_>, width: u16, scratch: u16, negate: Option<Pic16Label>) {
    let (a, b, rest) = (scratch + 1, scratch + 1 + width, scratch + 1 + 2 * width);
    let (count, sign) = (rest + width, rest + width + 1);
    let near = out.chip.reachable_banks(scratch);
    out.byte_op(Pic16OpKind::MovfW, a + width - 1);
    out.byte_op(Pic16OpKind::XorwfW, b + width - 1);
    out.byte_op(Pic16OpKind::Movwf, sign);
    if let Some(negate) = negate {
        out.skip_unless((a + width - 1, 7), true);
        out.call(negate, near, None);
    }
    // The divisor is negated inline.
    let positive = out.label();
    out.skip_unless((b + width - 1, 7), false);
    out.goto(positive);
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::ComfF, b + n));
    for n in 0..width {
        if n > 0 {
            out.skip_unless((STATUS, Z), true);
        }
        out.byte_op(Pic16OpKind::IncfF, b + n);
    }
    out.place(positive);
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::Clrf, rest + n));
    out.set_byte(count, 8 * width as u8);
    let (again, less) = (out.label(), out.label());
    out.place(again);
    // The carry is the quotient bit found last.
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::RlfF, a + n));
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::RlfF, rest + n));
    // Check whether the remainder is at least the divisor.
    for n in 0..width {
        out.byte_op(Pic16OpKind::MovfW, b + n);
        if n > 0 {
            out.skip_unless((STATUS, C), false);
            out.byte_op(Pic16OpKind::IncfszW, b + n);
        }
        out.byte_op(Pic16OpKind::SubwfW, rest + n);
    }
    out.skip_unless((STATUS, C), false);
    out.goto(less);
    for n in 0..width {
        out.byte_op(Pic16OpKind::MovfW, b + n);
        if n > 0 {
            out.skip_unless((STATUS, C), false);
            out.byte_op(Pic16OpKind::IncfszW, b + n);
        }
        out.byte_op(Pic16OpKind::SubwfF, rest + n);
    }
    // The subtraction does not borrow, so the carry is set.
    out.place(less);
    out.byte_op(Pic16OpKind::DecfszF, count);
    out.goto_back(again, 8 * u32::from(width) - 1);
    (0..width).for_each(|n| out.byte_op(Pic16OpKind::RlfF, a + n));
    if let Some(negate) = negate {
        out.skip_unless((sign, 7), true);
        out.call(negate, near, None);
    }
    out.implied_op(Pic16OpKind::Return);
}

/// Emits W := one byte of the value at the index, by a jump into a table of RETLW, which may be at any
/// address.
fn emit_table(out: &mut Pic16Writer<'_>, values: &[i32], byte: u8, index: u16) {
    let (data, chip) = (out.label(), out.chip);
    if values.len() > 256 {
        out.byte_op(Pic16OpKind::MovfW, index + 1);
        out.label_byte(Pic16OpKind::Addlw, data, 1);
    } else {
        out.label_byte(Pic16OpKind::Movlw, data, 1);
    }
    out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::PCLATH));
    out.byte_op(Pic16OpKind::MovfW, index);
    out.label_byte(Pic16OpKind::Addlw, data, 0);
    out.skip_unless((STATUS, C), true);
    out.byte_op(Pic16OpKind::IncfF, chip.reg(Sfr::PCLATH));
    out.computed_goto(chip.reg(Sfr::PCL));
    out.place(data);
    for value in values {
        out.literal_op(Pic16OpKind::Retlw, value.to_le_bytes().get(usize::from(byte)).copied().unwrap_or(0));
    }
}

/// Emits ADCON0 := W, the wait for the capacitor, and the wait for the conversion.
fn emit_conversion(out: &mut Pic16Writer<'_>, label: Pic16Label, devices: &Pic16Peripherals, scratch: u16) {
    let Some(adc) = &devices.adc else { return };
    let chip = out.chip;
    out.mark(CodeMark::Section("conversion"));
    out.assume_banks(1);
    out.place(label);
    out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::ADCON0));
    let switch = |out: &mut Pic16Writer<'_>, value: u8| {
        if adc.converting != adc.resting {
            out.set_byte(chip.reg(Sfr::ADCON1), value);
            out.select_bank(1);
        }
    };
    switch(out, adc.converting);
    out.set_byte(scratch, adc.acquisition_iterations);
    let (charge, wait) = (out.label(), out.label());
    out.place(charge);
    out.byte_op(Pic16OpKind::DecfszF, scratch);
    out.goto_back(charge, u32::from(adc.acquisition_iterations) - 1);
    out.set_bit(chip.bit("GO"), true);
    out.place(wait);
    out.skip_unless(chip.bit("GO"), true);
    out.goto_back(wait, adc.max_conversion_iterations);
    switch(out, adc.resting);
    out.implied_op(Pic16OpKind::Return);
}

/// Emits the setting of the duty cycle to W percent.
///
/// The pulse in quarters of a count is W * 4 (PR2 + 1) / 100, computed with 16 fractional bits below the
/// highest byte.
fn emit_duty(out: &mut Pic16Writer<'_>, pwm: Option<Pic16PwmSetup>, scratch: u16) {
    let Some(pwm) = pwm else { return };
    let chip = out.chip;
    let (percent, low, mid, high, count) = (scratch, scratch + 1, scratch + 2, scratch + 3, scratch + 4);
    let quarters = 4 * (u64::from(pwm.period) + 1);
    // One percent in units of 2^-14 quarters, rounded up slightly so that exact results are not missed.
    let unit = ((quarters << 14) / 100 + 1) as i32;
    let (part, done) = (out.label(), out.label());
    out.byte_op(Pic16OpKind::Movwf, percent);
    for at in [low, mid, high] {
        out.byte_op(Pic16OpKind::Clrf, at);
    }
    // 100 %: a pulse longer than the period never ends.
    out.literal_op(Pic16OpKind::Xorlw, 100);
    out.skip_unless((STATUS, Z), false);
    out.goto(part);
    out.byte_op(Pic16OpKind::DecfF, high);
    out.goto(done);
    out.place(part);
    out.set_byte(count, 7);
    let (again, zero) = (out.label(), out.label());
    // Multiply by the seven bits of W, highest first.
    out.byte_op(Pic16OpKind::RlfF, percent);
    out.place(again);
    out.set_bit((STATUS, C), false);
    for at in [low, mid, high] {
        out.byte_op(Pic16OpKind::RlfF, at);
    }
    out.byte_op(Pic16OpKind::RlfF, percent);
    out.skip_unless((STATUS, C), false);
    out.goto(zero);
    for (n, (at, k)) in [low, mid, high].into_iter().zip(unit.to_le_bytes()).enumerate() {
        out.literal_op(Pic16OpKind::Movlw, k);
        if n > 0 {
            out.skip_unless((STATUS, C), true);
            out.literal_op(Pic16OpKind::Movlw, k + 1);
        }
        out.byte_op(Pic16OpKind::AddwfF, at);
    }
    out.place(zero);
    out.byte_op(Pic16OpKind::DecfszF, count);
    out.goto_back(again, 6);
    out.place(done);
    // Bits 7 and 6 of the middle byte are the lowest two bits of the pulse, bits 5 and 4 of the control
    // register.
    out.byte_op(Pic16OpKind::RrfF, mid);
    out.byte_op(Pic16OpKind::RrfW, mid);
    out.literal_op(Pic16OpKind::Andlw, chip.mask(&pwm.module.quarters));
    out.literal_op(Pic16OpKind::Iorlw, chip.mask(&pwm.module.mode));
    out.byte_op(Pic16OpKind::Movwf, chip.reg(pwm.module.control));
    out.byte_op(Pic16OpKind::MovfW, high);
    out.byte_op(Pic16OpKind::Movwf, chip.reg(pwm.module.duty));
    out.implied_op(Pic16OpKind::Return);
}
