//! Code from reset to the start of the pacing timer: sets up memory, registers, ports and peripherals from
//! any state.

use std::collections::BTreeMap;

use emu_avr::isa::AvrOpKind;
use emu_core::chip::PinDef;

use super::arch::{AvrCodeWriter, AvrJump};
use super::layout::{AvrCellPlace, AvrLayout};
use super::peripheral_ops::AvrPeripherals;
use super::registers::{self, AvrRegisters, LOW_ZERO, ZERO};
use super::runtime::{wait_clear, wait_clocks};
use crate::target::CompileJob;

/// Up to this many instruction words, RAM and registers are cleared one by one; beyond, by a loop of that
/// size.
const MAX_UNROLLED_WORDS: usize = 5;

/// Duration of a conversion in converter clocks, including the wait for the first clock edge.
const CONVERSION_CLOCKS: u32 = 14;
/// Duration of the first conversion in converter clocks.
const FIRST_CONVERSION_CLOCKS: u32 = 26;
/// CPU clocks of the instructions around a conversion, which its wait covers too.
const CONVERSION_OVERHEAD_CLOCKS: u32 = 8;
/// Maximum converter clock for full resolution, in Hz.
const MAX_CONVERTER_HZ: u64 = 200_000;

/// Clears memory and registers, and sets the stack pointer if the program has subroutines (`calls`).
pub fn clear_memory(
    asm: &mut AvrCodeWriter,
    regs: &AvrRegisters,
    layout: &AvrLayout,
    job: &CompileJob<'_>,
    calls: bool,
) {
    let chip = job.target.chip;
    asm.op(AvrOpKind::Eor, &[ZERO, ZERO]);
    let at_end = emu_avr::chips::part(chip.name).is_some_and(|part| part.stack_starts_at_ram_end);
    if calls && !at_end {
        let [low, high] = (chip.ram_start + (chip.ram_len - 1)).to_le_bytes();
        registers::write_constant(asm, regs.addr(&["SPH"]), high.into(), 24);
        registers::write_constant(asm, regs.addr(&["SPL"]), low.into(), 24);
    }
    let bytes = usize::from(layout.ram_bytes);
    if bytes > MAX_UNROLLED_WORDS {
        clear_ram(asm, layout);
    }
    clear_registers(asm, &layout.registers);
    if bytes > 0 {
        let [low, high] = layout.ram_start.to_le_bytes();
        asm.op(AvrOpKind::Ldi, &[28, low.into()]);
        asm.op(AvrOpKind::Ldi, &[29, high.into()]);
    }
    if bytes <= MAX_UNROLLED_WORDS {
        (0..layout.ram_bytes).for_each(|n| layout.store(asm, layout.ram_start + n, ZERO));
    }
    let mut bytes_of_bits: BTreeMap<AvrCellPlace, u8> = BTreeMap::new();
    for (place, bit) in job.ir.initial_bits().map(|bit| layout.bit(bit)) {
        *bytes_of_bits.entry(place).or_default() |= 1 << bit;
    }
    bytes_of_bits.into_iter().for_each(|(place, byte)| put_byte(asm, layout, place, 0, byte));
    for (cell, home) in job.ir.words.iter().zip(&layout.words) {
        for (byte, n) in cell.initial.to_le_bytes().into_iter().zip(0..cell.bytes).filter(|&(byte, _)| byte != 0) {
            put_byte(asm, layout, *home, n, byte);
        }
    }
}

/// Writes a constant to byte `n` of a cell.
fn put_byte(asm: &mut AvrCodeWriter, layout: &AvrLayout, place: AvrCellPlace, n: u8, byte: u8) {
    match place {
        AvrCellPlace::Reg(reg) if reg >= 16 => asm.op(AvrOpKind::Ldi, &[(reg + n).into(), byte.into()]),
        AvrCellPlace::Reg(reg) => {
            asm.op(AvrOpKind::Ldi, &[24, byte.into()]);
            asm.op(AvrOpKind::Mov, &[(reg + n).into(), 24]);
        }
        AvrCellPlace::Ram(addr) => {
            asm.op(AvrOpKind::Ldi, &[24, byte.into()]);
            layout.store(asm, addr + u16::from(n), 24);
        }
    }
}

fn clear_ram(asm: &mut AvrCodeWriter, layout: &AvrLayout) {
    let [low, high] = layout.ram_start.to_le_bytes();
    let [end_low, end_high] = (layout.ram_start + layout.ram_bytes).to_le_bytes();
    asm.op(AvrOpKind::Ldi, &[30, low.into()]);
    asm.op(AvrOpKind::Ldi, &[31, high.into()]);
    let many = layout.ram_bytes > 256;
    if many {
        asm.op(AvrOpKind::Ldi, &[24, end_high.into()]);
    }
    let again = asm.new_label();
    asm.place_label(again);
    asm.op(AvrOpKind::StZi, &[ZERO]);
    asm.op(AvrOpKind::Cpi, &[30, end_low.into()]);
    if many {
        asm.op(AvrOpKind::Cpc, &[31, 24]);
    }
    asm.jump_back(AvrJump::If(AvrOpKind::Brne), again, layout.ram_bytes.into());
}

fn clear_registers(asm: &mut AvrCodeWriter, used: &[u8]) {
    let mut words = Vec::new();
    let mut rest = used.iter().copied().peekable();
    while let Some(reg) = rest.next() {
        let pair = reg % 2 == 0 && rest.next_if_eq(&(reg + 1)).is_some();
        words.push((reg, pair));
    }
    if words.len() < MAX_UNROLLED_WORDS {
        asm.op(AvrOpKind::Eor, &[LOW_ZERO, LOW_ZERO]);
        for (reg, pair) in words {
            asm.op(
                if pair { AvrOpKind::Movw } else { AvrOpKind::Mov },
                &[reg.into(), if pair { LOW_ZERO } else { ZERO }],
            );
        }
        return;
    }
    // Registers are data memory from address 0: Z counts down from its own address and is zero at the end.
    asm.op(AvrOpKind::Ldi, &[30, 30]);
    asm.op(AvrOpKind::Ldi, &[31, 0]);
    let again = asm.new_label();
    asm.place_label(again);
    asm.op(AvrOpKind::StZd, &[ZERO]);
    asm.op(AvrOpKind::And, &[30, 30]);
    asm.jump_back(AvrJump::If(AvrOpKind::Brne), again, 30);
}

/// Emits the set-up of ports: pull-ups before directions, so that no output glitches.
///
/// The ports have their reset values: inputs without pull-up.
pub fn set_up_ports(asm: &mut AvrCodeWriter, regs: &AvrRegisters, layout: &AvrLayout, job: &CompileJob<'_>) {
    let part = emu_avr::chips::part(job.target.chip.name);
    let named = |pin: &PinDef| job.ir.ports.iter().any(|cells| pin.name.chars().nth(1) == Some(cells.letter));
    let is_used = |pin: &PinDef| job.pins.iter().any(|used| used.pin == pin.name) || named(pin);
    if part.is_some_and(|part| part.chip.pins.iter().any(|pin| part.is_jtag_pin(pin.name) && is_used(pin))) {
        // The bit takes effect only if it is written twice within four clocks.
        let control = regs.addr(&["MCUCSR", "MCUCR"]);
        registers::read(asm, 24, control);
        asm.op(AvrOpKind::Ori, &[24, regs.mask(&[&["JTD"]])]);
        registers::write(asm, control, 24);
        registers::write(asm, control, 24);
    }
    for port in &layout.ports {
        if port.pull_ups != 0 {
            asm.op(AvrOpKind::Ldi, &[24, port.pull_ups.into()]);
            registers::write(asm, regs.port("PORT", port.letter), 24);
            if let Some(image) = port.output {
                // The image may have initial values of outputs.
                let is_clear = job.ir.initial_bits().next().is_none();
                asm.op(if is_clear { AvrOpKind::Mov } else { AvrOpKind::Or }, &[image.into(), 24]);
            }
        }
        if port.driven != 0 {
            registers::write_constant(asm, regs.port("DDR", port.letter), port.driven.into(), 24);
        }
    }
}

/// Emits the set-up of the peripherals in use.
pub fn set_up_peripherals(
    asm: &mut AvrCodeWriter,
    regs: &AvrRegisters,
    devices: &AvrPeripherals,
    job: &CompileJob<'_>,
) {
    if let Some(serial) = devices.serial {
        serial.start(asm, regs, job);
    }
    if let Some(i2c) = devices.i2c {
        i2c.start(asm, regs);
    }
    if let Some(spi) = devices.spi {
        spi.start(asm, regs);
    }
    for pwm in devices.pwm.iter().filter(|pwm| pwm.starts_timer) {
        pwm.start(asm, regs);
    }
    if let Some(&input) = devices.adc_selects.first() {
        // The first conversion takes longer than the others, so do it here.
        let (control, start) = (regs.addr(&["ADCSRA"]), regs.bit(&["ADSC"]));
        registers::write_constant(asm, regs.addr(&["ADMUX"]), input.into(), 24);
        let bits = regs.mask(&[&["ADEN"], &["ADSC"]]) | i32::from(converter_clock(job.clock_hz));
        registers::write_constant(asm, control, bits, 24);
        wait_clear(asm, control, start, wait_iterations(control, FIRST_CONVERSION_CLOCKS, job.clock_hz));
    }
    if job.ir.eeprom_bytes > 0 {
        // An EEPROM write that reset interrupted continues; wait for its end.
        let control = regs.addr(&["EECR"]);
        wait_clear(asm, control, regs.bit(&["EEPE", "EEWE"]), u32::from(u16::MAX));
        if regs.has("EEARH") {
            registers::write(asm, regs.addr(&["EEARH"]), ZERO);
        }
    }
}

/// Settings for the analog inputs of a program: ADMUX of each, and the maximum number of iterations of the
/// loop that waits for a conversion.
#[must_use]
pub fn plan_converter(regs: &AvrRegisters, job: &CompileJob<'_>) -> Option<(Vec<u8>, u32)> {
    let channel = |(n, name): (usize, &String)| {
        let pin = job.pins.iter().find(|pin| pin.analog && pin.name == *name)?;
        let (_, channel) = job.target.adc.iter().find(|(known, _)| *known == pin.pin)?;
        let reference = match job.ir.adc_references.get(n).copied().unwrap_or(0) {
            // The reference voltage is the supply.
            0 => regs.mask(&[&["REFS0"]]) as u8,
            refs => refs << 6,
        };
        Some(channel | reference)
    };
    let inputs = job.ir.adcs.iter().enumerate().map(channel).collect::<Option<Vec<u8>>>()?;
    Some((inputs, wait_iterations(regs.addr(&["ADCSRA"]), CONVERSION_CLOCKS, job.clock_hz)))
}

/// ADPS: binary logarithm of the divider of the converter clock.
fn converter_clock(clock_hz: u64) -> u8 {
    (1..7).find(|power| clock_hz >> power <= MAX_CONVERTER_HZ).unwrap_or(7)
}

fn wait_iterations(control: i32, conversion: u32, clock_hz: u64) -> u32 {
    ((conversion << converter_clock(clock_hz)) + CONVERSION_OVERHEAD_CLOCKS).div_ceil(wait_clocks(control))
}
