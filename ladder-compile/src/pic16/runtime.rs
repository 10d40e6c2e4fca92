//! Subroutines, each made once for every width that a program uses. Multiplication and division work in scratch:
//!
//! ```text
//! 0            scratch of comparisons, and a byte of the subroutines
//! 1            operand 0, and the quotient     (as many bytes as the width)
//! 1 + w        operand 1
//! 1 + 2 w      product, remainder
//! 1 + 3 w      count
//! 2 + 3 w      sign
//! ```

use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::chip::ANY;
use super::out::{C, Lab, Out, STATUS, Z};
use super::periph::{self, Devices};
use super::select::Routine;
use crate::ir::Ir;
use crate::target::Mark;

/// Bytes of scratch that arithmetic of a width needs.
#[must_use]
pub fn scratch(bytes: u8) -> u16 {
    3 + 3 * u16::from(bytes)
}

/// A subroutine; `scratch` is its scratch, `index` the address of the word that a table is read by.
pub fn emit(
    out: &mut Out<'_>,
    (routine, label): (Routine, Lab),
    ir: &Ir,
    scratch: u16,
    negate: Option<Lab>,
    index: u16,
    devices: &Devices,
) {
    let near = out.chip.reach(scratch);
    let start = |out: &mut Out<'_>, title| {
        out.mark(Mark::Part(title));
        out.enter(near);
        out.place(label);
    };
    match routine {
        Routine::Multiply(width) => {
            start(out, "product");
            multiply(out, width.into(), scratch);
        }
        Routine::Divide(width) => {
            start(out, "quotient");
            divide(out, width.into(), scratch, negate);
        }
        Routine::Negate(which, width) => {
            start(out, "negative");
            let at = scratch + 1 + which * u16::from(width);
            (0..u16::from(width)).for_each(|n| out.f(Kind::ComfF, at + n));
            for n in 0..u16::from(width) {
                if n > 0 {
                    out.only_if((STATUS, Z), true);
                }
                out.f(Kind::IncfF, at + n);
            }
            out.bare(Kind::Return);
        }
        Routine::Table(table, byte, _) => {
            out.mark(Mark::Part("table"));
            out.enter(out.chip.reach(index));
            out.place(label);
            let values = ir.tables.get(table as usize).map_or(&[][..], |table| &table.values);
            self::table(out, values, byte, index);
        }
        Routine::Convert => convert(out, label, devices, scratch),
        Routine::ReadEeprom => {
            out.mark(Mark::Part("read EEPROM"));
            out.enter(ANY);
            out.place(label);
            let chip = out.chip;
            out.f(Kind::Movwf, chip.reg(Sfr::EEADR));
            if chip.has_bit("EEPGD") {
                out.put(chip.bit("EEPGD"), false);
            }
            out.put(chip.bit("RD"), true);
            out.f(Kind::MovfW, chip.reg(Sfr::EEDATA));
            out.select(1);
            out.bare(Kind::Return);
        }
        Routine::WriteEeprom => {
            out.mark(Mark::Part("write EEPROM"));
            out.enter(ANY);
            out.place(label);
            let chip = out.chip;
            out.f(Kind::Movwf, chip.reg(Sfr::EEDATA));
            out.put(chip.bit("WREN"), true);
            // The sequence of the data sheet; interrupts are off.
            for k in [0x55, 0xAA] {
                out.lit(Kind::Movlw, k);
                out.f(Kind::Movwf, chip.reg(Sfr::EECON2));
            }
            out.put(chip.bit("WR"), true);
            out.put(chip.bit("WREN"), false);
            out.select(1);
            out.bare(Kind::Return);
        }
        Routine::Duty => {
            let banks = out.common(&[scratch, periph::duty_register(out.chip, devices)]);
            out.mark(Mark::Part("duty"));
            out.enter(banks);
            out.place(label);
            duty(out, devices, scratch);
        }
    }
}

/// operand 0 * operand 1, by shifting and adding.
fn multiply(out: &mut Out<'_>, width: u16, scratch: u16) {
    let (a, b, product) = (scratch + 1, scratch + 1 + width, scratch + 1 + 2 * width);
    let count = product + width;
    (0..width).for_each(|n| out.f(Kind::Clrf, product + n));
    out.set(count, 8 * width as u8);
    let (again, zero) = (out.label(), out.label());
    out.place(again);
    // The lowest bit of a, and a / 2; what comes in from above does not matter.
    (0..width).rev().for_each(|n| out.f(Kind::RrfF, a + n));
    out.only_if((STATUS, C), false);
    out.goto(zero);
    for n in 0..width {
        out.f(Kind::MovfW, b + n);
        if n > 0 {
            out.only_if((STATUS, C), true);
            out.f(Kind::IncfszW, b + n);
        }
        out.f(Kind::AddwfF, product + n);
    }
    out.place(zero);
    out.put((STATUS, C), false);
    (0..width).for_each(|n| out.f(Kind::RlfF, b + n));
    out.f(Kind::DecfszF, count);
    out.back(again, 8 * u32::from(width) - 1);
    out.bare(Kind::Return);
}

/// operand 0 := operand 0 / operand 1, truncated. Magnitudes are divided bit by bit; with a divisor of 0 every bit of the
/// quotient is 1, which with the dividend's sign is -1 or 1, as the language has it.
fn divide(out: &mut Out<'_>, width: u16, scratch: u16, negate: Option<Lab>) {
    let (a, b, rest) = (scratch + 1, scratch + 1 + width, scratch + 1 + 2 * width);
    let (count, sign) = (rest + width, rest + width + 1);
    let near = out.chip.reach(scratch);
    out.f(Kind::MovfW, a + width - 1);
    out.f(Kind::XorwfW, b + width - 1);
    out.f(Kind::Movwf, sign);
    if let Some(negate) = negate {
        out.only_if((a + width - 1, 7), true);
        out.call(negate, near, None);
    }
    // The divisor is negated in line.
    let positive = out.label();
    out.only_if((b + width - 1, 7), false);
    out.goto(positive);
    (0..width).for_each(|n| out.f(Kind::ComfF, b + n));
    for n in 0..width {
        if n > 0 {
            out.only_if((STATUS, Z), true);
        }
        out.f(Kind::IncfF, b + n);
    }
    out.place(positive);
    (0..width).for_each(|n| out.f(Kind::Clrf, rest + n));
    out.set(count, 8 * width as u8);
    let (again, less) = (out.label(), out.label());
    out.place(again);
    // The carry is the bit of the quotient found last.
    (0..width).for_each(|n| out.f(Kind::RlfF, a + n));
    (0..width).for_each(|n| out.f(Kind::RlfF, rest + n));
    // Is the divisor in it?
    for n in 0..width {
        out.f(Kind::MovfW, b + n);
        if n > 0 {
            out.only_if((STATUS, C), false);
            out.f(Kind::IncfszW, b + n);
        }
        out.f(Kind::SubwfW, rest + n);
    }
    out.only_if((STATUS, C), false);
    out.goto(less);
    for n in 0..width {
        out.f(Kind::MovfW, b + n);
        if n > 0 {
            out.only_if((STATUS, C), false);
            out.f(Kind::IncfszW, b + n);
        }
        out.f(Kind::SubwfF, rest + n);
    }
    // No borrow comes of it: the carry is set.
    out.place(less);
    out.f(Kind::DecfszF, count);
    out.back(again, 8 * u32::from(width) - 1);
    (0..width).for_each(|n| out.f(Kind::RlfF, a + n));
    if let Some(negate) = negate {
        out.only_if((sign, 7), true);
        out.call(negate, near, None);
    }
    out.bare(Kind::Return);
}

/// W := a byte of the value that the index chooses: a jump into a row of RETLW, which may lie anywhere.
fn table(out: &mut Out<'_>, values: &[i32], byte: u8, index: u16) {
    let (data, chip) = (out.label(), out.chip);
    if values.len() > 256 {
        out.f(Kind::MovfW, index + 1);
        out.refer(Kind::Addlw, data, 1);
    } else {
        out.refer(Kind::Movlw, data, 1);
    }
    out.f(Kind::Movwf, chip.reg(Sfr::PCLATH));
    out.f(Kind::MovfW, index);
    out.refer(Kind::Addlw, data, 0);
    out.only_if((STATUS, C), true);
    out.f(Kind::IncfF, chip.reg(Sfr::PCLATH));
    out.computed_goto(chip.reg(Sfr::PCL));
    out.place(data);
    for value in values {
        out.lit(Kind::Retlw, value.to_le_bytes().get(usize::from(byte)).copied().unwrap_or(0));
    }
}

/// ADCON0 := W; waits for the capacitor, then for the conversion.
fn convert(out: &mut Out<'_>, label: Lab, devices: &Devices, scratch: u16) {
    let Some(adc) = &devices.adc else { return };
    let chip = out.chip;
    out.mark(Mark::Part("conversion"));
    out.enter(1);
    out.place(label);
    out.f(Kind::Movwf, chip.reg(Sfr::ADCON0));
    let switch = |out: &mut Out<'_>, value: u8| {
        if adc.converting != adc.resting {
            out.set(chip.reg(Sfr::ADCON1), value);
            out.select(1);
        }
    };
    switch(out, adc.converting);
    out.set(scratch, adc.acquire);
    let (charge, wait) = (out.label(), out.label());
    out.place(charge);
    out.f(Kind::DecfszF, scratch);
    out.back(charge, u32::from(adc.acquire) - 1);
    out.put(chip.bit("GO"), true);
    out.place(wait);
    out.only_if(chip.bit("GO"), true);
    out.back(wait, adc.turns);
    switch(out, adc.resting);
    out.bare(Kind::Return);
}

/// W percent to the PWM output: the pulse in quarters of a count is W * 4 (PR2 + 1) / 100, computed with 16 binary places
/// below the highest byte.
fn duty(out: &mut Out<'_>, devices: &Devices, scratch: u16) {
    let Some(pwm) = devices.pwm else { return };
    let chip = out.chip;
    let (percent, low, mid, high, count) = (scratch, scratch + 1, scratch + 2, scratch + 3, scratch + 4);
    let quarters = 4 * (u64::from(pwm.period) + 1);
    // A percent in 2^-14 quarters, rounded up a little so that whole results are not missed.
    let unit = ((quarters << 14) / 100 + 1) as i32;
    let (part, done) = (out.label(), out.label());
    out.f(Kind::Movwf, percent);
    for at in [low, mid, high] {
        out.f(Kind::Clrf, at);
    }
    // 100 %: a pulse longer than the period never ends.
    out.lit(Kind::Xorlw, 100);
    out.only_if((STATUS, Z), false);
    out.goto(part);
    out.f(Kind::DecfF, high);
    out.goto(done);
    out.place(part);
    out.set(count, 7);
    let (again, zero) = (out.label(), out.label());
    // Seven bits of W, the highest first.
    out.f(Kind::RlfF, percent);
    out.place(again);
    out.put((STATUS, C), false);
    for at in [low, mid, high] {
        out.f(Kind::RlfF, at);
    }
    out.f(Kind::RlfF, percent);
    out.only_if((STATUS, C), false);
    out.goto(zero);
    for (n, (at, k)) in [low, mid, high].into_iter().zip(unit.to_le_bytes()).enumerate() {
        out.lit(Kind::Movlw, k);
        if n > 0 {
            out.only_if((STATUS, C), true);
            out.lit(Kind::Movlw, k + 1);
        }
        out.f(Kind::AddwfF, at);
    }
    out.place(zero);
    out.f(Kind::DecfszF, count);
    out.back(again, 6);
    out.place(done);
    // Bits 7 and 6 of the middle byte are the two lowest of the pulse, bits 5 and 4 of the control register.
    out.f(Kind::RrfF, mid);
    out.f(Kind::RrfW, mid);
    out.lit(Kind::Andlw, chip.mask(&pwm.module.quarters));
    out.lit(Kind::Iorlw, chip.mask(&pwm.module.mode));
    out.f(Kind::Movwf, chip.reg(pwm.module.control));
    out.f(Kind::MovfW, high);
    out.f(Kind::Movwf, chip.reg(pwm.module.duty));
    out.bare(Kind::Return);
}
