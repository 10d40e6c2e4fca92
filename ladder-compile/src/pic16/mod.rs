//! The PIC16 back end: translates intermediate code to an image of program memory and configuration words.

pub mod arch;
mod branch;
pub mod buses;
pub mod chip_data;
mod compare;
pub mod config;
pub mod layout;
mod logic;
pub mod pacing;
pub mod peripherals;
pub mod reset;
pub mod rung_formula;
pub mod runtime;
pub mod select;
mod targets;
pub mod timer_extension;
pub mod touched_cells;
mod word_ops;
pub mod writer;

use emu_pic16::isa::Pic16OpKind;
use ladder::ElementId;

use crate::CodegenError;
use crate::code::{CodeWriter, FinishedCode};
use crate::ir::{ArithmeticOp, BranchCondition, Ir, IrOp, WordComparison, WordOperand};
use crate::longest_path;
use crate::map::CellLocation;
use crate::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, ImageLine};
use arch::{PAGE, Pic16Arch, Pic16Jump};
use chip_data::Pic16ChipData;
use layout::{Pic16Layout, Pic16PortUse, Pic16RamNeeds};
use pacing::{FreeTimers, Pic16Pacing};
use peripherals::Pic16Peripherals;
use select::{Pic16Routine, Pic16Selector};
use writer::Pic16Writer;

pub use targets::TARGETS;

/// Builds the image of a scan. The caller must check that the scan fits its period.
///
/// # Errors
/// The image does not fit the chip, or the chip cannot generate a requested rate or frequency.
pub fn build(job: &CompileJob<'_>) -> Result<BuiltImage, BuildRefusal> {
    let name = job.target.chip.name;
    let mut steps = job.ir.rungs.iter().flat_map(|rung| &rung.steps);
    if let Some(step) = steps.find(|step| matches!(step.op, IrOp::Module { .. })) {
        return Err(BuildRefusal::Internal(CodegenError::NoModules { chip: name, element: step.element }));
    }
    let part = emu_pic16::chips::part(name).ok_or(BuildRefusal::Internal(CodegenError::NoChipRow { chip: name }))?;
    let chip = Pic16ChipData::new(part);
    let modules: Vec<u8> = job.pwm_outputs().map(|(_, at)| at.channel).collect();
    let pace = pacing::plan_pacing(job.clock_hz, job.cycle_us, FreeTimers::free_beside_pwm(&modules))?;
    let devices = peripherals::plan_peripherals(job, &chip)?;
    let needs = Pic16RamNeeds {
        scratch: scratch_bytes(job.ir, &chip),
        fraction: pace.bytes(),
        extension: pace.extension(),
        received: job.ir.uart.receive,
    };
    let layout = layout::layout(job.ir, job.pins, &chip, needs)
        .map_err(|needed| BuildRefusal::RamTooSmall { needed, available: u64::from(job.target.chip.ram_len) })?;
    let code = match build_code(job, &chip, &layout, &devices, &pace, false)? {
        Some(code) => code,
        // With more than one page, put subroutines first, so that their pages are known to the calls.
        None => build_code(job, &chip, &layout, &devices, &pace, true)?
            .ok_or(BuildRefusal::Internal(CodegenError::NoCodeSize))?,
    };
    let available = u64::from(job.target.chip.on_chip_flash_bytes);
    let at = |mark| code.mark_address(mark).unwrap_or(0);
    let starts: Vec<u32> =
        (0..job.ir.rungs.len() as u32).map(|n| at(CodeMark::Rung(n))).chain([at(CodeMark::RungsEnd)]).collect();
    let spans = || starts.iter().zip(starts.iter().skip(1));
    if code.words.len() as u64 * 2 > available {
        let rungs = spans().map(|(start, end)| u64::from(end - start) * 2).collect();
        return Err(BuildRefusal::CodeTooLarge { needed: code.words.len() as u64 * 2, available, rungs });
    }
    // The jump back to the poll loop may change the page.
    let back = u64::from(arch::form_words(
        Pic16Jump::Goto,
        arch::shortest_level(at(CodeMark::ScanEnd), at(CodeMark::PollLoop)),
    )) + 1;
    let worst = longest_path::longest_path(&code, at(CodeMark::ScanStart), at(CodeMark::ScanEnd)) + back;
    if pace.extension() > 0 && worst + pace.poll() > timer_extension::MAX_SCAN_CYCLES {
        return Err(BuildRefusal::Unsupported {
            cause: format!(
                "a scan takes up to {} machine cycles, but the timer overflows every 65536, several times in a cycle of {} us",
                worst + pace.poll(),
                job.cycle_us
            ),
            hint: "divide the program, or choose a shorter cycle".to_owned(),
            element: None,
        });
    }
    let mut segments = vec![(0, code.words.iter().flat_map(|word| word.to_le_bytes()).collect())];
    segments.extend(config::config_words(part, job.clock_hz));
    Ok(BuiltImage {
        segments,
        lines: image_lines(&code),
        marks: code.marks.clone(),
        bit_places: layout
            .bits
            .iter()
            .map(|&(addr, bit)| CellLocation::Bit { space: "data".to_owned(), addr: addr.into(), bit })
            .collect(),
        word_places: (layout.words.iter().zip(&job.ir.words))
            .map(|(&addr, cell)| CellLocation::Word { space: "data".to_owned(), addr: addr.into(), bytes: cell.bytes })
            .collect(),
        period: pace.period,
        shortest_period_cycles: pace.shortest(),
        tick_cycles: pace.prescale,
        poll_cycles: pace.poll(),
        worst_scan_cycles: worst,
        rung_cycles: spans().map(|(&start, &end)| longest_path::longest_path(&code, start, end)).collect(),
        ram_bytes: layout.used.len() as u32,
        fuses: config::config_lines(part, job.clock_hz),
        specials: devices.specials.clone(),
        pin_needs: reset::pin_needs(job, &layout),
    })
}

/// Number of bytes of scratch that a scan needs.
fn scratch_bytes(ir: &Ir, chip: &Pic16ChipData) -> u16 {
    fn visit(ir: &Ir, op: &IrOp, needs: &mut u16) {
        let compare = |c: &WordComparison| match c.b {
            WordOperand::Cell(b) if ir.bytes(c.a) != ir.bytes(b) => runtime::scratch(ir.bytes(c.a).max(ir.bytes(b))),
            WordOperand::Cell(_) => 1,
            WordOperand::Const(_) => 0,
        };
        let more = match op {
            IrOp::AndCompare(c) => compare(c),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                then.iter().chain(otherwise).for_each(|op| visit(ir, op, needs));
                if let BranchCondition::Compare(c) = cond { compare(c) } else { 0 }
            }
            IrOp::Math { op: math @ (ArithmeticOp::Mul | ArithmeticOp::Div), dst, a, b } => {
                runtime::scratch(ir.width(*math, *dst, *a, *b))
            }
            IrOp::Math { dst, a: WordOperand::Cell(a), b: WordOperand::Cell(b), .. } => {
                let same = ir.bytes(*a) >= ir.bytes(*dst) && ir.bytes(*b) >= ir.bytes(*dst) && ir.bytes(*dst) <= 2;
                if same { 0 } else { runtime::scratch(ir.bytes(*dst)) }
            }
            IrOp::SetPwm { .. } => 5,
            IrOp::Transfer { .. } => buses::SCRATCH_BYTES,
            IrOp::ReadAdc { .. } => 1,
            _ => 0,
        };
        *needs = more.max(*needs);
    }
    let mut needs = 0;
    let rungs = ir.rungs.iter().flat_map(|rung| rung.steps.iter().map(|step| &step.op));
    ir.prologue.iter().chain(rungs).chain(&ir.epilogue).for_each(|op| visit(ir, op, &mut needs));
    // Operands that no single bank reaches are copied to scratch.
    let bytes: u16 = ir.words.iter().map(|cell| u16::from(cell.bytes)).sum();
    let first = chip
        .part
        .chip
        .ram_ranges
        .iter()
        .find(|ram| ram.first == ram.canonical)
        .map_or(0, |ram| ram.last - ram.first + 1);
    if bytes + ir.bits.len() as u16 / 8 + 32 > first {
        needs = needs.max(runtime::scratch(ir.words.iter().map(|cell| cell.bytes).max().unwrap_or(0)));
    }
    needs
}

/// Generates the code; `None` if it exceeds one page although `large` is false.
fn build_code(
    job: &CompileJob<'_>,
    chip: &Pic16ChipData,
    layout: &Pic16Layout,
    devices: &Pic16Peripherals,
    pace: &Pic16Pacing,
    large: bool,
) -> Result<Option<FinishedCode>, BuildRefusal> {
    let mut out = Pic16Writer::new(chip);
    reset::emit_reset(&mut out, job, layout, devices, pace);
    let entry = out.items.len();
    let poll = out.label();
    out.allow_page_change();
    out.mark(CodeMark::Section("wait for the match"));
    out.select_bank(1);
    out.mark(CodeMark::PollLoop);
    out.place(poll);
    let flag = chip.bit(pace.flag());
    out.skip_unless(flag, false);
    out.goto_back(poll, 1);
    timer_extension::count_overflow(&mut out, flag, pace.extension(), layout.extension, poll);
    out.mark(CodeMark::ScanStart);
    out.mark(CodeMark::Section("scan: take the match, latch the inputs"));
    if pace.extension() == 0 {
        out.set_bit(flag, false);
    }
    for port in layout.ports.iter().filter(|port| port.input_bits != 0) {
        out.byte_op(Pic16OpKind::MovfW, port.port);
        out.byte_op(Pic16OpKind::Movwf, port.input);
    }
    let mut select = Pic16Selector::new(out, job.ir, layout, devices);
    select.latch_received();
    select.next_period(pace);
    select_scan(job.ir, &mut select);
    let (mut out, mut routines) = (select.out, select.routines);
    out.mark(CodeMark::Section("write the outputs"));
    for port in &layout.ports {
        write_port(&mut out, job, (layout, devices), port);
    }
    out.select_bank(1);
    out.mark(CodeMark::ScanEnd);
    out.goto_back(poll, 1);
    out.mark(CodeMark::AfterScan);
    let subroutines_start = out.items.len();
    let widths: Vec<u8> =
        routines.keys().filter_map(|r| if let Pic16Routine::Divide(width) = r { Some(*width) } else { None }).collect();
    for width in widths {
        let label = out.label();
        routines.insert(Pic16Routine::Negate(0, width), label);
    }
    // Subroutines come before their callers.
    let (first, then): (Vec<_>, Vec<_>) = routines.iter().partition(|(r, _)| matches!(r, Pic16Routine::Negate(..)));
    for (&routine, &label) in first.into_iter().chain(then) {
        let negate = if let Pic16Routine::Divide(width) = routine {
            routines.get(&Pic16Routine::Negate(0, width)).copied()
        } else {
            None
        };
        let index = if let Pic16Routine::Table(_, _, word) = routine { layout.word(word) } else { 0 };
        out.allow_page_change();
        runtime::emit_routine(&mut out, (routine, label), job.ir, layout.scratch, negate, index, devices);
    }
    if large {
        // The entry jumps around the subroutines.
        let mut subroutines = out.items.split_off(subroutines_start);
        let rest = out.items.split_off(entry);
        out.goto(poll);
        out.items.append(&mut subroutines);
        out.items.extend(rest);
    }
    let mut asm = CodeWriter::new(Pic16Arch);
    let length = writer::assemble(&out.items, out.labels(), &mut asm).map_err(|error| BuildRefusal::Unsupported {
        cause: error.to_string(),
        hint: "divide the element".to_owned(),
        element: None,
    })?;
    let code = asm.finish().map_err(BuildRefusal::Internal)?;
    if code.words.len() as u32 != length {
        return Err(BuildRefusal::Internal(CodegenError::LayoutMismatch { words: code.words.len(), planned: length }));
    }
    Ok((large || code.words.len() as u32 <= PAGE).then_some(code))
}

/// Emits the outputs of a port, and the latch and the directions if the program names them. Pins that the
/// program uses otherwise keep their outputs and directions.
fn write_port(
    out: &mut Pic16Writer<'_>,
    job: &CompileJob<'_>,
    (layout, devices): (&Pic16Layout, &Pic16Peripherals),
    port: &Pic16PortUse,
) {
    let cells = job.ir.port_cells(port.letter);
    let free = port.existing_bits & !job.used_pins(port.letter);
    let high =
        reset::driven_pins(job, devices).filter(|pin| pin.1).fold(0, |all, pin| all | pin_mask(pin.0, port.letter));
    let write = |out: &mut Pic16Writer<'_>| {
        if high != 0 {
            out.literal_op(Pic16OpKind::Iorlw, high);
        }
        out.byte_op(Pic16OpKind::Movwf, port.port);
    };
    if let Some(latch) = cells.and_then(|cells| cells.latch) {
        out.byte_op(Pic16OpKind::MovfW, layout.word(latch));
        out.literal_op(Pic16OpKind::Andlw, free);
        if port.output_bits != 0 {
            out.byte_op(Pic16OpKind::IorwfW, port.output);
        }
        write(out);
    } else if port.output_bits != 0 {
        out.byte_op(Pic16OpKind::MovfW, port.output);
        write(out);
    }
    if let Some(direction) = cells.and_then(|cells| cells.direction) {
        out.byte_op(Pic16OpKind::MovfW, layout.word(direction));
        out.literal_op(Pic16OpKind::Andlw, free);
        let driven = reset::driven_pins(job, devices).fold(0, |all, (pin, _)| all | pin_mask(pin, port.letter));
        out.literal_op(Pic16OpKind::Iorlw, port.existing_bits & !(free | port.output_bits | driven));
        out.byte_op(Pic16OpKind::Movwf, port.tris);
    }
}

/// Mask of a pin such as `RC2` in the port of a letter; 0 for a pin of another port.
pub(super) fn pin_mask(pin: &str, letter: char) -> u8 {
    let bit = pin.chars().nth(2).and_then(|digit| digit.to_digit(8));
    bit.filter(|_| pin.chars().nth(1) == Some(letter)).map_or(0, |bit| 1 << bit)
}

/// Selects all operations, with a mark at every rung and every element of the program, also at elements
/// without code.
fn select_scan(ir: &Ir, select: &mut Pic16Selector<'_, '_>) {
    enum ScanItem<'a> {
        Mark(CodeMark),
        Op(&'a IrOp),
    }
    let mut all: Vec<ScanItem<'_>> = ir.prologue.iter().map(ScanItem::Op).collect();
    for (number, rung) in ir.rungs.iter().enumerate() {
        let number = number as u32;
        all.push(ScanItem::Mark(CodeMark::Rung(number)));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.element_count {
            let id = ElementId { rung: number, index };
            all.push(ScanItem::Mark(CodeMark::Element(id)));
            while let Some(step) = steps.next_if(|step| step.element <= id) {
                all.push(ScanItem::Op(&step.op));
            }
        }
    }
    all.push(ScanItem::Mark(CodeMark::RungsEnd));
    all.extend(ir.epilogue.iter().map(ScanItem::Op));
    let ops: Vec<&IrOp> =
        all.iter().filter_map(|at| if let ScanItem::Op(op) = at { Some(*op) } else { None }).collect();
    let (mut next, mut done) = (0, 0);
    for at in all {
        match at {
            ScanItem::Mark(mark) => {
                if matches!(mark, CodeMark::Rung(_) | CodeMark::RungsEnd) {
                    select.out.allow_page_change();
                }
                select.out.mark(mark);
            }
            ScanItem::Op(op) => {
                if next >= done {
                    select.out.allow_page_change();
                    done = next + select.op(op, ops.get(next + 1..).unwrap_or_default(), false, None);
                }
                next += 1;
            }
        }
    }
    select.out.allow_page_change();
}

/// Lines of the image by address; words that fill up a page are data.
fn image_lines(code: &FinishedCode) -> Vec<ImageLine> {
    let mut lines: Vec<ImageLine> = Vec::with_capacity(code.instructions.len());
    let words = |from: u32, to: u32| code.words.get(from as usize..to as usize).unwrap_or_default().to_vec();
    let mut next = 0;
    for insn in &code.instructions {
        if insn.addr > next {
            lines.push(ImageLine { addr: next, words: words(next, insn.addr), text: String::new(), target: None });
        }
        next = insn.addr + insn.len;
        lines.push(ImageLine {
            addr: insn.addr,
            words: words(insn.addr, next),
            text: insn.text.clone(),
            target: insn.target,
        });
    }
    lines
}
