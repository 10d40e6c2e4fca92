//! The AVR back end: translates intermediate code to an image of program memory.

pub mod arch;
pub mod buses;
pub mod compare;
pub mod layout;
pub mod pacing;
pub mod peripheral_ops;
pub mod pwm;
pub mod registers;
pub mod reset;
pub mod runtime;
pub mod select;
pub mod serial;
pub mod targets;
pub mod usage;
pub mod words;

use emu_avr::isa::{self, AvrOpKind};
use ladder::ElementId;

use crate::code::{CodeLabel, FinishedCode};
use crate::ir::{ConstantTable, Ir, IrOp, PortCells};
use crate::jump_roles::JumpLabels;
use crate::longest_path::longest_path;
use crate::map::{CellLocation, SpecialPin};
use crate::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, ImageLine};
use arch::{AvrArch, AvrCodeWriter, AvrJump};
use compare::ComparisonChain;
use layout::{AvrCellPlace, AvrLayout, AvrPortUse};
use pacing::AvrPacing;
use peripheral_ops::AvrPeripherals;
use registers::{AvrRegisters, is_bit_addressable};
use runtime::{AvrRoutine, RoutineContext};
use select::{AvrKnownState, AvrSelector};
use usage::AvrUsage;

pub use targets::TARGETS;

/// All decisions made before the first instruction is emitted.
struct AvrBuildPlan<'a> {
    job: &'a CompileJob<'a>,
    regs: AvrRegisters,
    pace: AvrPacing,
    layout: AvrLayout,
    devices: AvrPeripherals,
    signed_divisors: bool,
}

/// Builds an image.
///
/// # Errors
/// The image does not fit the chip, or the chip lacks a feature that the program needs.
pub fn build(job: &CompileJob<'_>) -> Result<BuiltImage, BuildRefusal> {
    let chip = job.target.chip;
    let regs = AvrRegisters::new(job.target);
    let pace = pacing::plan_pacing(job.clock_hz, job.cycle_us, pacing::prescaler_reset_clocks(&regs))?;
    let uses = AvrUsage::of(job.ir);
    let layout = layout::layout(job, &uses, pace.fraction_bytes())
        .map_err(|needed| BuildRefusal::RamTooSmall { needed, available: chip.ram_len.into() })?;
    let lacks = || BuildRefusal::Unsupported {
        cause: format!("{} has no converter", chip.name),
        hint: "take a chip that has one, such as atmega328p".to_owned(),
        element: None,
    };
    let (inputs, turns) = reset::plan_converter(&regs, job).ok_or_else(lacks)?;
    let devices = AvrPeripherals {
        serial: serial::plan_uart(job)?,
        i2c: buses::plan_i2c(job),
        spi: buses::plan_spi(job),
        pwm: pwm::plan_pwm(job)?,
        adc_selects: inputs,
        conversion_iterations: turns,
        tables: Vec::new(),
    };
    let signed_divisors = uses.signed_divisors;
    let mut plan = AvrBuildPlan { job, regs, pace, layout, devices, signed_divisors };

    // The first pass collects the subroutines, and finds those that are called only once and can be inlined.
    let (_, wanted) = emit_image(&mut plan, &[], false)?;
    let single: Vec<AvrRoutine> = wanted.iter().filter(|wanted| wanted.2 == 1).map(|wanted| wanted.0).collect();
    let calls = wanted.len() > single.len();
    let (asm, _) = emit_image(&mut plan, &single, calls)?;
    let code = asm.finish().map_err(BuildRefusal::Internal)?;
    built_image(&plan, &code)
}

/// Emits the whole image.
fn emit_image(
    plan: &mut AvrBuildPlan<'_>,
    single: &[AvrRoutine],
    calls: bool,
) -> Result<(AvrCodeWriter, Vec<select::RequestedRoutine>), BuildRefusal> {
    let job = plan.job;
    let chip = job.target.chip;
    let mut asm = AvrCodeWriter::new(AvrArch { chip });
    plan.devices.tables = job.ir.tables.iter().map(|_| asm.new_label()).collect();
    let (regs, layout, pace) = (&plan.regs, &plan.layout, &plan.pace);
    // LPM reaches only the first 64 KB, so tables come first on larger chips.
    let low_tables = chip.flash_bytes > 0x1_0000 && !job.ir.tables.is_empty();
    if low_tables {
        let start = asm.new_label();
        asm.mark(CodeMark::Section("start"));
        asm.jump(AvrJump::To, start);
        emit_tables(&mut asm, job.ir, &plan.devices.tables);
        asm.place_label(start);
    }
    asm.mark(CodeMark::Section("reset: memory, ports"));
    reset::clear_memory(&mut asm, regs, layout, job, calls);
    reset::set_up_ports(&mut asm, regs, layout, job);
    reset::set_up_peripherals(&mut asm, regs, &plan.devices, job);
    asm.mark(CodeMark::Section("pacing timer"));
    pace.start(&mut asm, regs, layout);

    let poll = asm.new_label();
    asm.mark(CodeMark::Section("wait for the match"));
    asm.mark(CodeMark::PollLoop);
    asm.place_label(poll);
    let (flags, matched) = (regs.addr(&["TIFR1", "TIFR"]), regs.bit(&["OCF1A"]));
    if is_bit_addressable(flags) {
        asm.op(AvrOpKind::Sbis, &[flags - 0x20, matched]);
        asm.jump(AvrJump::To, poll);
    } else {
        registers::read(&mut asm, 24, flags);
        asm.op(AvrOpKind::Sbrs, &[24, matched]);
        asm.jump(AvrJump::To, poll);
    }
    asm.mark(CodeMark::ScanStart);
    asm.mark(CodeMark::Section("scan: take the match, latch the inputs"));
    if is_bit_addressable(flags) {
        asm.op(AvrOpKind::Sbi, &[flags - 0x20, matched]);
    } else {
        // Writing back what was read clears the flags that are set; no code waits for the other flags.
        registers::write(&mut asm, flags, 24);
    }
    pace.set_next_period(&mut asm, regs, layout);
    for port in &layout.ports {
        if let Some(reg) = port.input {
            registers::read(&mut asm, reg.into(), regs.port("PIN", port.letter));
        }
    }
    let mut select = AvrSelector {
        asm: &mut asm,
        ir: job.ir,
        layout,
        regs,
        devices: &plan.devices,
        signed_divisors: plan.signed_divisors,
        known: AvrKnownState::default(),
        comparison_chain: ComparisonChain::default(),
        jump_labels: JumpLabels::default(),
        routines: Vec::new(),
        inlined_routines: single,
        internal_error: None,
    };
    select.ops(&job.ir.prologue);
    select_rungs(job.ir, &mut select);
    select.ops(&job.ir.epilogue);
    let (wanted, fault) = (select.routines, select.internal_error);
    if let Some(fault) = fault {
        return Err(BuildRefusal::Internal(fault));
    }
    asm.mark(CodeMark::Section("write the outputs"));
    for port in &layout.ports {
        match job.ir.port_cells(port.letter) {
            Some(cells) => write_port_cells(&mut asm, (job, regs, layout), port, cells),
            None => {
                if let Some(reg) = port.output {
                    registers::write(&mut asm, regs.port("PORT", port.letter), reg.into());
                }
            }
        }
    }
    asm.mark(CodeMark::ScanEnd);
    asm.jump(AvrJump::To, poll);
    asm.mark(CodeMark::AfterScan);
    let context = RoutineContext { regs, layout, eeprom: job.ir.eeprom_bytes };
    for &(routine, label, _) in wanted.iter().filter(|wanted| !single.contains(&wanted.0)) {
        asm.mark(CodeMark::Section(routine.title()));
        asm.place_label(label);
        routine.body(&mut asm, &context);
        asm.op(AvrOpKind::Ret, &[]);
    }
    if !low_tables {
        emit_tables(&mut asm, job.ir, &plan.devices.tables);
    }
    Ok((asm, wanted))
}

/// Emits the latch and the directions of a port whose registers the program names. Pins that the program uses
/// otherwise keep their outputs, pull-ups and directions.
fn write_port_cells(
    asm: &mut AvrCodeWriter,
    (job, regs, layout): (&CompileJob<'_>, &AvrRegisters, &AvrLayout),
    port: &AvrPortUse,
    cells: &PortCells,
) {
    let free = i32::from(!(job.used_pins(port.letter) | port.driven | port.pull_ups));
    let load = |asm: &mut AvrCodeWriter, word| {
        match layout.word(word) {
            AvrCellPlace::Reg(reg) => asm.op(AvrOpKind::Mov, &[24, reg.into()]),
            AvrCellPlace::Ram(addr) => layout.load(asm, 24, addr),
        }
        asm.op(AvrOpKind::Andi, &[24, free]);
    };
    match (cells.latch, port.output) {
        (Some(latch), image) => {
            load(asm, latch);
            match image {
                Some(image) => asm.op(AvrOpKind::Or, &[24, image.into()]),
                None if port.pull_ups != 0 => asm.op(AvrOpKind::Ori, &[24, port.pull_ups.into()]),
                None => {}
            }
            registers::write(asm, regs.port("PORT", port.letter), 24);
        }
        (None, Some(image)) => registers::write(asm, regs.port("PORT", port.letter), image.into()),
        (None, None) => {}
    }
    if let Some(direction) = cells.direction {
        load(asm, direction);
        if port.driven != 0 {
            asm.op(AvrOpKind::Ori, &[24, port.driven.into()]);
        }
        registers::write(asm, regs.port("DDR", port.letter), 24);
    }
}

/// Emits the rungs, with a mark at every element of the program, also at elements without code.
///
/// Unoptimised code also has a mark at every operation.
fn select_rungs(ir: &Ir, select: &mut AvrSelector<'_>) {
    let steps = || ir.rungs.iter().flat_map(|rung| &rung.steps);
    let plain = steps().any(|step| matches!(step.op, IrOp::Logic { .. }));
    for (rung, code) in (0..).zip(&ir.rungs) {
        select.asm.mark(CodeMark::Rung(rung));
        let mut steps = (0..).zip(&code.steps).peekable();
        for index in 0..code.element_count {
            let id = ElementId { rung, index };
            select.asm.mark(CodeMark::Element(id));
            while let Some((number, step)) = steps.next_if(|(_, step)| step.element <= id) {
                if plain {
                    select.asm.mark(CodeMark::Step { rung, step: number });
                }
                select.op(&step.op, steps.peek().map(|(_, next)| &next.op));
            }
        }
    }
    select.asm.mark(CodeMark::RungsEnd);
}

/// Emits the constant tables.
fn emit_tables(asm: &mut AvrCodeWriter, ir: &Ir, labels: &[CodeLabel]) {
    for (table, &label) in ir.tables.iter().zip(labels) {
        asm.mark(CodeMark::Section("table"));
        asm.place_label(label);
        asm.data(&table_words(table));
    }
}

/// The bytes of a table, low byte first, two per word.
fn table_words(table: &ConstantTable) -> Vec<u16> {
    let bytes: Vec<u8> =
        table.values.iter().flat_map(|value| value.to_le_bytes().into_iter().take(table.bytes.into())).collect();
    bytes.chunks(2).map(|pair| pair.iter().rev().fold(0, |word, &byte| word << 8 | u16::from(byte))).collect()
}

/// Collects the properties of the finished image.
fn built_image(plan: &AvrBuildPlan<'_>, code: &FinishedCode) -> Result<BuiltImage, BuildRefusal> {
    let (job, pace, layout) = (plan.job, &plan.pace, &plan.layout);
    let chip = job.target.chip;
    let at = |mark| code.mark_address(mark).unwrap_or(0);
    let starts =
        (0..=job.ir.rungs.len() as u32).map(|n| code.mark_address(CodeMark::Rung(n)).unwrap_or(at(CodeMark::RungsEnd)));
    let starts: Vec<u32> = starts.collect();
    let ranges = || starts.iter().zip(starts.iter().skip(1));
    let needed = 2 * code.words.len() as u64;
    if needed > u64::from(chip.flash_bytes) {
        let rungs = ranges().map(|(start, end)| 2 * u64::from(end - start)).collect();
        return Err(BuildRefusal::CodeTooLarge { needed, available: chip.flash_bytes.into(), rungs });
    }
    let data = || "data".to_owned();
    let bits = layout.bits.iter().map(|(place, bit)| CellLocation::Bit {
        space: data(),
        addr: place.addr().into(),
        bit: *bit,
    });
    let words = layout.words.iter().zip(&layout.sizes).map(|(place, bytes)| CellLocation::Word {
        space: data(),
        addr: place.addr().into(),
        bytes: *bytes,
    });
    Ok(BuiltImage {
        segments: vec![(0, code.words.iter().flat_map(|word| word.to_le_bytes()).collect())],
        lines: image_lines(code),
        marks: code.marks.clone(),
        bit_places: bits.collect(),
        word_places: words.collect(),
        period: pace.period,
        shortest_period_cycles: pace.shortest_period(),
        tick_cycles: pace.prescale,
        poll_cycles: longest_poll(&plan.regs),
        worst_scan_cycles: longest_path(code, at(CodeMark::ScanStart), at(CodeMark::AfterScan)),
        rung_cycles: ranges().map(|(&start, &end)| longest_path(code, start, end)).collect(),
        ram_bytes: layout.ram_bytes.into(),
        fuses: targets::fuse_requirements(chip, job.clock_hz),
        specials: special_pins(plan),
        pin_needs: job.bus_needs(),
    })
}

/// Maximum number of clocks from a match to the first instruction of its scan.
///
/// It consists of an iteration that just missed the match (the test and the jump back) and the test that sees
/// it.
fn longest_poll(regs: &AvrRegisters) -> u64 {
    let cycles = |kind: AvrOpKind, outcome: usize| {
        let row = isa::ROWS.get(kind as usize);
        row.and_then(|row| row.cycles.possible_counts().get(outcome)).copied().map_or(0, u64::from)
    };
    let (read_flag, skip) = if is_bit_addressable(regs.addr(&["TIFR1", "TIFR"])) {
        (0, AvrOpKind::Sbis)
    } else {
        (cycles(AvrOpKind::In, 0), AvrOpKind::Sbrs)
    };
    read_flag + cycles(skip, 0) + cycles(AvrOpKind::Rjmp, 0) + read_flag + cycles(skip, 1)
}

/// Lines of the image: instructions, and the data between them.
fn image_lines(code: &FinishedCode) -> Vec<ImageLine> {
    let words =
        |addr: u32, len: u32| code.words.iter().skip(addr as usize).take(len as usize).copied().collect::<Vec<u16>>();
    let mut lines = Vec::new();
    let mut next = 0;
    let data = |lines: &mut Vec<ImageLine>, from: u32, to: u32| {
        for addr in (from..to).step_by(4) {
            let words = words(addr, (to - addr).min(4));
            lines.push(ImageLine { addr, words, text: String::new(), target: None });
        }
    };
    for insn in &code.instructions {
        data(&mut lines, next, insn.addr);
        let words = words(insn.addr, insn.len);
        lines.push(ImageLine { addr: insn.addr, words, text: insn.text.clone(), target: insn.target });
        next = insn.addr + insn.len;
    }
    data(&mut lines, next, code.words.len() as u32);
    lines
}

/// Pins with a special function: neither input nor output of the program.
fn special_pins(plan: &AvrBuildPlan<'_>) -> Vec<SpecialPin> {
    let (job, target) = (plan.job, plan.job.target);
    let mut specials = Vec::new();
    if let (Some(serial), Some((transmit, receive)), Some(baud)) = (plan.devices.serial, target.uart, job.baud) {
        if job.ir.uart.send {
            specials.push(SpecialPin::Transmit { pin: transmit.to_owned(), baud, bit: serial.bit() });
        }
        if job.ir.uart.receive {
            specials.push(SpecialPin::Receive { pin: receive.to_owned(), baud });
        }
    }
    let cycles = |num| crate::map::Ratio { num, den: 1 };
    if let (Some(i2c), Some((pin, clock))) = (plan.devices.i2c, target.i2c) {
        let (pin, clock) = (pin.to_owned(), clock.to_owned());
        specials.push(SpecialPin::I2c { pin, clock, bit: cycles(i2c.bit) });
    }
    if let (Some(spi), Some(pins)) = (plan.devices.spi, target.spi) {
        let [pin, clock, out, input] = pins.map(str::to_owned);
        specials.push(SpecialPin::Spi { pin, clock, out, input, bit: cycles(spi.bit) });
    }
    for pin in job.pins.iter().filter(|pin| pin.analog) {
        specials.push(SpecialPin::Analog { pin: pin.pin.to_owned(), name: pin.name.clone() });
    }
    for (pwm, (output, at)) in plan.devices.pwm.iter().zip(job.pwm_outputs()) {
        let period = crate::map::Ratio { num: pwm.period(), den: 1 };
        specials.push(SpecialPin::Pwm {
            pin: at.pin.to_owned(),
            name: output.name.clone(),
            hertz: output.hertz.into(),
            period,
            steps: pwm.steps(),
        });
    }
    specials
}
