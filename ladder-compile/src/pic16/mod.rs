//! The PIC16 back end: intermediate code to an image of program memory and configuration words.

pub mod arch;
mod branch;
pub mod chip;
mod compare;
pub mod config;
pub mod expr;
pub mod extend;
pub mod layout;
mod logic;
pub mod out;
pub mod pace;
pub mod periph;
pub mod reset;
pub mod runtime;
pub mod select;
mod targets;
pub mod uses;
mod words;

use emu_pic16::isa::Kind;
use ladder::ElementId;

use crate::code::{Asm, Code};
use crate::ir::{Compare, Cond, Ir, Math, Op, Value};
use crate::map::Place;
use crate::target::{Built, Job, Line, Mark, Refusal};
use crate::worst;
use arch::{Jump, PAGE, Pic};
use chip::Silicon;
use layout::{Layout, Needs};
use out::Out;
use pace::{Free, Pace};
use periph::Devices;
use select::{Routine, Select};

pub use targets::TARGETS;

/// Makes the image of a scan. Programs that take too long are the caller's to refuse.
///
/// # Errors
/// The image does not fit the chip, or the chip cannot do something at the speed that is asked for.
pub fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let name = job.target.chip.name;
    let mut steps = job.ir.rungs.iter().flat_map(|rung| &rung.steps);
    if let Some(step) = steps.find(|step| matches!(step.op, Op::Module { .. })) {
        return Err(Refusal::Internal(format!("{name} has no modules, but {} is one", step.at)));
    }
    let part = emu_pic16::chips::part(name).ok_or_else(|| Refusal::Internal(format!("{name} has no row")))?;
    let chip = Silicon::new(part);
    let pace = pace::pace(job.clock_hz, job.cycle_us, Free::beside(job.ir.pwm_hz.is_some(), &chip))
        .map_err(|(shortest, longest)| Refusal::Period { shortest, longest })?;
    let devices = periph::devices(job, &chip)?;
    let needs = Needs {
        scratch: scratch(job.ir, &chip),
        fraction: pace.bytes(),
        extension: pace.extension(),
        received: job.ir.uart.receive,
    };
    let layout = layout::layout(job.ir, job.pins, &chip, needs)
        .map_err(|needed| Refusal::Ram { needed, available: u64::from(job.target.chip.ram_len) })?;
    let code = match image(job, &chip, &layout, &devices, &pace, false)? {
        Some(code) => code,
        // More than a page: subroutines first, where calls know them.
        None => image(job, &chip, &layout, &devices, &pace, true)?
            .ok_or_else(|| Refusal::Internal("the code has no size".to_owned()))?,
    };
    let available = u64::from(job.target.chip.on_chip);
    let at = |mark| code.at(mark).unwrap_or(0);
    let starts: Vec<u32> =
        (0..job.ir.rungs.len() as u32).map(|n| at(Mark::Rung(n))).chain([at(Mark::RungsEnd)]).collect();
    let spans = || starts.iter().zip(starts.iter().skip(1));
    if code.words.len() as u64 * 2 > available {
        let rungs = spans().map(|(start, end)| u64::from(end - start) * 2).collect();
        return Err(Refusal::Code { needed: code.words.len() as u64 * 2, available, rungs });
    }
    // The jump back to the loop that waits, which may change the page.
    let back = u64::from(arch::words(Jump::Goto, arch::level(at(Mark::ScanEnd), at(Mark::Poll)))) + 1;
    let worst = worst::longest(&code, at(Mark::ScanStart), at(Mark::ScanEnd)) + back;
    if pace.extension() > 0 && worst + pace.poll() > extend::LONGEST_SCAN {
        return Err(Refusal::Lacks {
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
    segments.extend(config::words(part, job.clock_hz));
    Ok(Built {
        segments,
        lines: lines(&code),
        marks: code.marks.clone(),
        bits: layout
            .bits
            .iter()
            .map(|&(addr, bit)| Place::Bit { space: "data".to_owned(), addr: addr.into(), bit })
            .collect(),
        words: (layout.words.iter().zip(&job.ir.words))
            .map(|(&addr, cell)| Place::Word { space: "data".to_owned(), addr: addr.into(), bytes: cell.bytes })
            .collect(),
        period: pace.period,
        shortest: pace.shortest(),
        tick: pace.prescale,
        poll: pace.poll(),
        worst,
        rungs: spans().map(|(&start, &end)| worst::longest(&code, start, end)).collect(),
        ram_bytes: layout.used.len() as u32,
        fuses: config::lines(part, job.clock_hz),
        specials: devices.specials.clone(),
        warnings: reset::warnings(job, &layout),
    })
}

/// Bytes of scratch that a scan needs.
fn scratch(ir: &Ir, chip: &Silicon) -> u16 {
    fn visit(ir: &Ir, op: &Op, needs: &mut u16) {
        let compare = |c: &Compare| match c.b {
            Value::Cell(b) if ir.bytes(c.a) != ir.bytes(b) => runtime::scratch(ir.bytes(c.a).max(ir.bytes(b))),
            Value::Cell(_) => 1,
            Value::Const(_) => 0,
        };
        let more = match op {
            Op::AndCompare(c) => compare(c),
            Op::If { cond, then, otherwise } => {
                then.iter().chain(otherwise).for_each(|op| visit(ir, op, needs));
                if let Cond::Compare(c) = cond { compare(c) } else { 0 }
            }
            Op::Math { op: math @ (Math::Mul | Math::Div), dst, a, b } => {
                runtime::scratch(ir.width(*math, *dst, *a, *b))
            }
            Op::Math { dst, a: Value::Cell(a), b: Value::Cell(b), .. } => {
                let same = ir.bytes(*a) >= ir.bytes(*dst) && ir.bytes(*b) >= ir.bytes(*dst) && ir.bytes(*dst) <= 2;
                if same { 0 } else { runtime::scratch(ir.bytes(*dst)) }
            }
            Op::SetPwm { .. } => 5,
            Op::ReadAdc { .. } => 1,
            _ => 0,
        };
        *needs = more.max(*needs);
    }
    let mut needs = 0;
    let rungs = ir.rungs.iter().flat_map(|rung| rung.steps.iter().map(|step| &step.op));
    ir.begin.iter().chain(rungs).chain(&ir.end).for_each(|op| visit(ir, op, &mut needs));
    // Operands that no bank reaches together are copied.
    let bytes: u16 = ir.words.iter().map(|cell| u16::from(cell.bytes)).sum();
    let first =
        chip.part.chip.ram_map.iter().find(|ram| ram.first == ram.kept).map_or(0, |ram| ram.last - ram.first + 1);
    if bytes + ir.bits.len() as u16 / 8 + 32 > first {
        needs = needs.max(runtime::scratch(ir.words.iter().map(|cell| cell.bytes).max().unwrap_or(0)));
    }
    needs
}

/// The code; nothing where it has more than a page although it should be `large` for that.
fn image(
    job: &Job<'_>,
    chip: &Silicon,
    layout: &Layout,
    devices: &Devices,
    pace: &Pace,
    large: bool,
) -> Result<Option<Code>, Refusal> {
    let mut out = Out::new(chip);
    reset::reset(&mut out, job, layout, devices, pace);
    let entry = out.items.len();
    let poll = out.label();
    out.cut();
    out.mark(Mark::Part("wait for the match"));
    out.select(1);
    out.mark(Mark::Poll);
    out.place(poll);
    let flag = chip.bit(pace.flag());
    out.only_if(flag, false);
    out.back(poll, 1);
    extend::count(&mut out, flag, pace.extension(), layout.extension, poll);
    out.mark(Mark::ScanStart);
    out.mark(Mark::Part("scan: take the match, latch the inputs"));
    if pace.extension() == 0 {
        out.put(flag, false);
    }
    for port in layout.ports.iter().filter(|port| port.inputs != 0) {
        out.f(Kind::MovfW, port.port);
        out.f(Kind::Movwf, port.input);
    }
    let mut select = Select::new(out, job.ir, layout, devices);
    select.latch_received();
    select.next_period(pace);
    scan(job.ir, &mut select);
    let (mut out, mut routines) = (select.out, select.routines);
    out.mark(Mark::Part("write the outputs"));
    for port in layout.ports.iter().filter(|port| port.outputs != 0) {
        out.f(Kind::MovfW, port.output);
        out.f(Kind::Movwf, port.port);
    }
    out.select(1);
    out.mark(Mark::ScanEnd);
    out.back(poll, 1);
    out.mark(Mark::ScanOver);
    let behind = out.items.len();
    let widths: Vec<u8> =
        routines.keys().filter_map(|r| if let Routine::Divide(width) = r { Some(*width) } else { None }).collect();
    for width in widths {
        let label = out.label();
        routines.insert(Routine::Negate(0, width), label);
    }
    // What is called stands before its callers.
    let (first, then): (Vec<_>, Vec<_>) = routines.iter().partition(|(r, _)| matches!(r, Routine::Negate(..)));
    for (&routine, &label) in first.into_iter().chain(then) {
        let negate =
            if let Routine::Divide(width) = routine { routines.get(&Routine::Negate(0, width)).copied() } else { None };
        let index = if let Routine::Table(_, _, word) = routine { layout.word(word) } else { 0 };
        out.cut();
        runtime::emit(&mut out, (routine, label), job.ir, layout.scratch, negate, index, devices);
    }
    if large {
        // The way in goes around the subroutines.
        let mut subroutines = out.items.split_off(behind);
        let rest = out.items.split_off(entry);
        out.goto(poll);
        out.items.append(&mut subroutines);
        out.items.extend(rest);
    }
    let mut asm = Asm::new(Pic);
    let length = out::assemble(&out.items, out.labels(), &mut asm).map_err(|cause| Refusal::Lacks {
        cause,
        hint: "divide the element".to_owned(),
        element: None,
    })?;
    let code = asm.finish().map_err(Refusal::Internal)?;
    if code.words.len() as u32 != length {
        return Err(Refusal::Internal(format!("the code has {} words and was laid out as {length}", code.words.len())));
    }
    Ok((large || code.words.len() as u32 <= PAGE).then_some(code))
}

/// The operations, with a mark at every rung and every element of the program, also at those without code.
fn scan(ir: &Ir, select: &mut Select<'_, '_>) {
    enum At<'a> {
        Mark(Mark),
        Op(&'a Op),
    }
    let mut all: Vec<At<'_>> = ir.begin.iter().map(At::Op).collect();
    for (number, rung) in ir.rungs.iter().enumerate() {
        let number = number as u32;
        all.push(At::Mark(Mark::Rung(number)));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.elements {
            let id = ElementId { rung: number, index };
            all.push(At::Mark(Mark::Element(id)));
            while let Some(step) = steps.next_if(|step| step.at <= id) {
                all.push(At::Op(&step.op));
            }
        }
    }
    all.push(At::Mark(Mark::RungsEnd));
    all.extend(ir.end.iter().map(At::Op));
    let ops: Vec<&Op> = all.iter().filter_map(|at| if let At::Op(op) = at { Some(*op) } else { None }).collect();
    let (mut next, mut done) = (0, 0);
    for at in all {
        match at {
            At::Mark(mark) => {
                if matches!(mark, Mark::Rung(_) | Mark::RungsEnd) {
                    select.out.cut();
                }
                select.out.mark(mark);
            }
            At::Op(op) => {
                if next >= done {
                    select.out.cut();
                    done = next + select.op(op, ops.get(next + 1..).unwrap_or_default(), false, None);
                }
                next += 1;
            }
        }
    }
    select.out.cut();
}

/// The code by address; what fills up a page is data.
fn lines(code: &Code) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::with_capacity(code.insns.len());
    let words = |from: u32, to: u32| code.words.get(from as usize..to as usize).unwrap_or_default().to_vec();
    let mut next = 0;
    for insn in &code.insns {
        if insn.addr > next {
            lines.push(Line { addr: next, words: words(next, insn.addr), text: String::new(), target: None });
        }
        next = insn.addr + insn.len;
        lines.push(Line {
            addr: insn.addr,
            words: words(insn.addr, next),
            text: insn.text.clone(),
            target: insn.target,
        });
    }
    lines
}
