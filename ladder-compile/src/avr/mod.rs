//! The AVR back end: intermediate code to an image of program memory.

pub mod arch;
pub mod compare;
pub mod devices;
pub mod layout;
pub mod pace;
pub mod pwm;
pub mod regs;
pub mod reset;
pub mod runtime;
pub mod select;
pub mod serial;
pub mod targets;
pub mod uses;
pub mod words;

use emu_avr::isa::{self, Kind};
use ladder::ElementId;

use crate::code::{Code, Label};
use crate::ir::{Ir, Op, Table};
use crate::map::{Place, Special};
use crate::target::{Built, Job, Line, Mark, Refusal};
use crate::worst::longest;
use arch::{Asm, Avr, Jump};
use compare::Row;
use devices::Devices;
use layout::Layout;
use pace::Pace;
use regs::{Regs, has_bits};
use runtime::{Around, Routine};
use select::{Known, Select};
use uses::Uses;

pub use targets::TARGETS;

/// Everything that is decided before the first instruction.
struct Plan<'a> {
    job: &'a Job<'a>,
    regs: Regs,
    pace: Pace,
    layout: Layout,
    devices: Devices,
    signed_divisors: bool,
}

/// Makes an image.
///
/// # Errors
/// The image does not fit the chip, or the chip cannot do what the program asks for.
pub fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let chip = job.target.chip;
    let regs = Regs::new(chip);
    let pace = pace::pace(job.clock_hz, job.cycle_us, pace::lead(&regs))
        .map_err(|(shortest, longest)| Refusal::Period { shortest, longest })?;
    let uses = Uses::of(job.ir);
    let layout = layout::layout(job, &uses, pace.fraction_bytes())
        .map_err(|needed| Refusal::Ram { needed, available: chip.ram_len.into() })?;
    let taps = emu_avr::chips::part(chip.name).and_then(|part| part.timers.get(2)).map_or(&[][..], |t| &t.taps);
    let lacks = || Refusal::Lacks {
        cause: format!("{} has no converter", chip.name),
        hint: "take a chip that has one".to_owned(),
        element: None,
    };
    let (inputs, turns) = reset::converter(&regs, job).ok_or_else(lacks)?;
    let devices = Devices { serial: serial::plan(job)?, pwm: pwm::plan(job, taps)?, inputs, turns, tables: Vec::new() };
    let signed_divisors = uses.signed_divisors;
    let mut plan = Plan { job, regs, pace, layout, devices, signed_divisors };

    // The first time tells which subroutines there are, and which of them are wanted once only.
    let (_, wanted) = emit(&mut plan, &[], false)?;
    let single: Vec<Routine> = wanted.iter().filter(|wanted| wanted.2 == 1).map(|wanted| wanted.0).collect();
    let calls = wanted.len() > single.len();
    let (asm, _) = emit(&mut plan, &single, calls)?;
    let code = asm.finish().map_err(Refusal::Internal)?;
    built(&plan, &code)
}

/// Writes the image.
fn emit(plan: &mut Plan<'_>, single: &[Routine], calls: bool) -> Result<(Asm, Vec<select::Wanted>), Refusal> {
    let job = plan.job;
    let chip = job.target.chip;
    let mut asm = Asm::new(Avr { chip });
    plan.devices.tables = job.ir.tables.iter().map(|_| asm.label()).collect();
    let (regs, layout, pace) = (&plan.regs, &plan.layout, &plan.pace);
    // LPM reaches the first 64 KB.
    let low_tables = chip.flash > 0x1_0000 && !job.ir.tables.is_empty();
    if low_tables {
        let start = asm.label();
        asm.mark(Mark::Part("start"));
        asm.jump(Jump::To, start);
        tables(&mut asm, job.ir, &plan.devices.tables);
        asm.place(start);
    }
    asm.mark(Mark::Part("reset: memory, ports"));
    reset::memory(&mut asm, regs, layout, job, calls);
    reset::ports(&mut asm, regs, layout, job);
    reset::devices(&mut asm, regs, &plan.devices, job);
    asm.mark(Mark::Part("pacing timer"));
    pace.start(&mut asm, regs, layout);

    let poll = asm.label();
    asm.mark(Mark::Part("wait for the match"));
    asm.mark(Mark::Poll);
    asm.place(poll);
    let (flags, matched) = (regs.addr(&["TIFR1", "TIFR"]), regs.bit(&["OCF1A"]));
    if has_bits(flags) {
        asm.op(Kind::Sbis, &[flags - 0x20, matched]);
        asm.jump(Jump::To, poll);
    } else {
        regs::read(&mut asm, 24, flags);
        asm.op(Kind::Sbrs, &[24, matched]);
        asm.jump(Jump::To, poll);
    }
    asm.mark(Mark::ScanStart);
    asm.mark(Mark::Part("scan: take the match, latch the inputs"));
    if has_bits(flags) {
        asm.op(Kind::Sbi, &[flags - 0x20, matched]);
    } else {
        // What was read clears what it says; nobody waits for the other flags.
        regs::write(&mut asm, flags, 24);
    }
    pace.next(&mut asm, regs, layout);
    for port in &layout.ports {
        if let Some(reg) = port.input {
            regs::read(&mut asm, reg.into(), regs.port("PIN", port.letter));
        }
    }
    let mut select = Select {
        asm: &mut asm,
        ir: job.ir,
        layout,
        regs,
        devices: &plan.devices,
        signed_divisors: plan.signed_divisors,
        known: Known::default(),
        row: Row::default(),
        routines: Vec::new(),
        single,
        fault: None,
    };
    select.ops(&job.ir.begin);
    rungs(job.ir, &mut select);
    select.ops(&job.ir.end);
    let (wanted, fault) = (select.routines, select.fault);
    if let Some(fault) = fault {
        return Err(Refusal::Internal(fault));
    }
    asm.mark(Mark::Part("write the outputs"));
    for port in &layout.ports {
        if let Some(reg) = port.output {
            regs::write(&mut asm, regs.port("PORT", port.letter), reg.into());
        }
    }
    asm.mark(Mark::ScanEnd);
    asm.jump(Jump::To, poll);
    asm.mark(Mark::ScanOver);
    let around = Around { regs, layout, eeprom: job.ir.eeprom };
    for &(routine, label, _) in wanted.iter().filter(|wanted| !single.contains(&wanted.0)) {
        asm.mark(Mark::Part(routine.title()));
        asm.place(label);
        routine.body(&mut asm, &around);
        asm.op(Kind::Ret, &[]);
    }
    if !low_tables {
        tables(&mut asm, job.ir, &plan.devices.tables);
    }
    Ok((asm, wanted))
}

/// The rungs, with a mark at every element of the program, also at those without code; in code that is not optimised also
/// at every operation.
fn rungs(ir: &Ir, select: &mut Select<'_>) {
    let steps = || ir.rungs.iter().flat_map(|rung| &rung.steps);
    let plain = steps().any(|step| matches!(step.op, Op::Logic { .. }));
    for (rung, code) in (0..).zip(&ir.rungs) {
        select.asm.mark(Mark::Rung(rung));
        let mut steps = (0..).zip(&code.steps).peekable();
        for index in 0..code.elements {
            let id = ElementId { rung, index };
            select.asm.mark(Mark::Element(id));
            while let Some((number, step)) = steps.next_if(|(_, step)| step.at <= id) {
                if plain {
                    select.asm.mark(Mark::Step { rung, step: number });
                }
                select.op(&step.op, steps.peek().map(|(_, next)| &next.op));
            }
        }
    }
    select.asm.mark(Mark::RungsEnd);
}

/// The constant tables.
fn tables(asm: &mut Asm, ir: &Ir, labels: &[Label]) {
    for (table, &label) in ir.tables.iter().zip(labels) {
        asm.mark(Mark::Part("table"));
        asm.place(label);
        asm.data(&packed(table));
    }
}

/// The bytes of a table, low byte first, two to a word.
fn packed(table: &Table) -> Vec<u16> {
    let bytes: Vec<u8> =
        table.values.iter().flat_map(|value| value.to_le_bytes().into_iter().take(table.bytes.into())).collect();
    bytes.chunks(2).map(|pair| pair.iter().rev().fold(0, |word, &byte| word << 8 | u16::from(byte))).collect()
}

/// What is known of the finished image.
fn built(plan: &Plan<'_>, code: &Code) -> Result<Built, Refusal> {
    let (job, pace, layout) = (plan.job, &plan.pace, &plan.layout);
    let chip = job.target.chip;
    let at = |mark| code.at(mark).unwrap_or(0);
    let starts = (0..=job.ir.rungs.len() as u32).map(|n| code.at(Mark::Rung(n)).unwrap_or(at(Mark::RungsEnd)));
    let starts: Vec<u32> = starts.collect();
    let ranges = || starts.iter().zip(starts.iter().skip(1));
    let needed = 2 * code.words.len() as u64;
    if needed > u64::from(chip.flash) {
        let rungs = ranges().map(|(start, end)| 2 * u64::from(end - start)).collect();
        return Err(Refusal::Code { needed, available: chip.flash.into(), rungs });
    }
    let data = || "data".to_owned();
    let bits = layout.bits.iter().map(|(home, bit)| Place::Bit { space: data(), addr: home.addr().into(), bit: *bit });
    let words = layout.words.iter().zip(&layout.sizes).map(|(home, bytes)| Place::Word {
        space: data(),
        addr: home.addr().into(),
        bytes: *bytes,
    });
    Ok(Built {
        segments: vec![(0, code.words.iter().flat_map(|word| word.to_le_bytes()).collect())],
        lines: lines(code),
        marks: code.marks.clone(),
        bits: bits.collect(),
        words: words.collect(),
        period: pace.period,
        shortest: pace.shortest(),
        tick: pace.prescale,
        poll: poll(&plan.regs),
        worst: longest(code, at(Mark::ScanStart), at(Mark::ScanOver)),
        rungs: ranges().map(|(&start, &end)| longest(code, start, end)).collect(),
        ram_bytes: layout.ram_bytes.into(),
        fuses: targets::fuses(chip, job.clock_hz),
        specials: specials(plan),
        warnings: Vec::new(),
    })
}

/// The longest time from a match to the first instruction of its scan: one turn that just missed the match, the look and the
/// jump back, and the look that sees it.
fn poll(regs: &Regs) -> u64 {
    let cycles = |kind: Kind, outcome: usize| {
        let row = isa::ROWS.get(kind as usize);
        row.and_then(|row| row.cycles.outcomes().get(outcome)).copied().map_or(0, u64::from)
    };
    let (look, skip) =
        if has_bits(regs.addr(&["TIFR1", "TIFR"])) { (0, Kind::Sbis) } else { (cycles(Kind::In, 0), Kind::Sbrs) };
    look + cycles(skip, 0) + cycles(Kind::Rjmp, 0) + look + cycles(skip, 1)
}

/// The image line by line: instructions, and the data between them.
fn lines(code: &Code) -> Vec<Line> {
    let words =
        |addr: u32, len: u32| code.words.iter().skip(addr as usize).take(len as usize).copied().collect::<Vec<u16>>();
    let mut lines = Vec::new();
    let mut next = 0;
    let data = |lines: &mut Vec<Line>, from: u32, to: u32| {
        for addr in (from..to).step_by(4) {
            let words = words(addr, (to - addr).min(4));
            lines.push(Line { addr, words, text: String::new(), target: None });
        }
    };
    for insn in &code.insns {
        data(&mut lines, next, insn.addr);
        let words = words(insn.addr, insn.len);
        lines.push(Line { addr: insn.addr, words, text: insn.text.clone(), target: insn.target });
        next = insn.addr + insn.len;
    }
    data(&mut lines, next, code.words.len() as u32);
    lines
}

/// Pins with another job than input and output.
fn specials(plan: &Plan<'_>) -> Vec<Special> {
    let (job, target) = (plan.job, plan.job.target);
    let mut specials = Vec::new();
    if let (Some(serial), Some((transmit, receive)), Some(baud)) = (plan.devices.serial, target.uart, job.baud) {
        if job.ir.uart.send {
            specials.push(Special::Transmit { pin: transmit.to_owned(), baud, bit: serial.bit() });
        }
        if job.ir.uart.receive {
            specials.push(Special::Receive { pin: receive.to_owned(), baud });
        }
    }
    for pin in job.pins.iter().filter(|pin| pin.analog) {
        specials.push(Special::Analog { pin: pin.pin.to_owned(), name: pin.name.clone() });
    }
    if let (Some(pwm), Some(pin), Some(hertz)) = (plan.devices.pwm, target.pwm, job.ir.pwm_hz) {
        let period = crate::map::Ratio { num: pwm.period(), den: 1 };
        specials.push(Special::Pwm { pin: pin.to_owned(), hertz: hertz.into(), period, steps: pwm.steps() });
    }
    specials
}
