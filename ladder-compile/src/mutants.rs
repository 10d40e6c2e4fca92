//! Compilers with one fault each, enumerated mechanically: from the intermediate code of a program (an operator, an operand,
//! a constant by one, a polarity, a store left out, an order, a cell at another's place) and from its image (a pin, the period, an
//! instruction of reset, latching or output left out, a bank not chosen). They show what a check of compiled programs can find.

mod cells;
mod ops;
mod shape;

use diag::Diagnostic;
use ladder::{ElementId, Program};

use crate::ir::{Ir, Op, Step};
use crate::pins::Pin;
use crate::target::{Built, Line, Mark, Target};
use crate::{Compiled, Options, Prepared, finish, prepare, refusal};

/// What sort of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MutantKind {
    /// An operation of a rung is another, or none.
    Operation,
    /// An operation before or behind the rungs, or a value of a table, is another.
    Around,
    /// Two operations or two rungs change places.
    Order,
    /// The destination is written before the operands are read.
    Aliasing,
    /// A cell is kept at another's place.
    State,
    /// Two pins are swapped.
    Pin,
    /// The period is another: by one tick, or scans are lost or doubled.
    Period,
    /// An instruction around the rungs is left out: of reset, of latching the inputs, of writing the outputs.
    LeftOut,
    /// A bank of memory or a page of code is not chosen, so that the one before is met.
    Bank,
}

/// One fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mutant {
    /// Names it for [`compile_mutant`], from 0.
    pub id: u32,
    /// Its sort.
    pub kind: MutantKind,
    /// The element whose code it changes, where it is one's.
    pub element: Option<ElementId>,
    /// What is changed, and what it becomes.
    pub what: String,
}

/// What is done otherwise.
enum Change {
    Ir(Ir),
    Pins(Vec<Pin>),
    /// Clock and cycle that the image is made for, in place of the right ones.
    Time(u64, u64),
    /// The line of the image with this number does nothing.
    LeftOut(usize),
}

/// A fault that is made when it is wanted.
struct Candidate<'a> {
    kind: MutantKind,
    element: Option<ElementId>,
    what: Box<dyn Fn() -> String + 'a>,
    make: Box<dyn Fn() -> Change + 'a>,
}

/// Every fault of `program` for a chip; none for a program that [`crate::compile`] refuses.
#[must_use]
pub fn mutants(program: &Program, options: &Options) -> Vec<Mutant> {
    let Ok(prepared) = prepare(program, options) else { return Vec::new() };
    let job = prepared.job(program);
    let Ok(built) = (job.target.build)(&job) else { return Vec::new() };
    let all = of_code(&prepared).into_iter().chain(of_image(program, &prepared, &built));
    all.zip(0..)
        .map(|(candidate, id)| Mutant {
            id,
            kind: candidate.kind,
            element: candidate.element,
            what: (candidate.what)(),
        })
        .collect()
}

/// Compiles `program` with the fault `id`; a number that no fault has changes nothing.
///
/// # Errors
/// As [`crate::compile`].
pub fn compile_mutant(program: &Program, options: &Options, id: u32) -> Result<Compiled, Vec<Diagnostic>> {
    let prepared = prepare(program, options)?;
    let job = prepared.job(program);
    let build =
        |job: &crate::target::Job<'_>| (job.target.build)(job).map_err(|refusal| refusal::tell(&refusal, program, job));
    let mut code = of_code(&prepared);
    let count = code.len();
    let id = id as usize;
    if id < count {
        let change = (code.swap_remove(id).make)();
        let (mut ir, mut pins) = (None, None);
        match change {
            Change::Ir(changed) => ir = Some(changed),
            Change::Pins(changed) => pins = Some(changed),
            Change::Time(..) | Change::LeftOut(_) => {}
        }
        let with = crate::target::Job { ir: ir.as_ref().unwrap_or(job.ir), ..job };
        let built = build(&crate::target::Job { pins: pins.as_deref().unwrap_or(job.pins), ..with })?;
        return finish(program, &with, built, prepared.notes.clone());
    }
    let sound = build(&job)?;
    let change = of_image(program, &prepared, &sound).into_iter().nth(id - count).map(|found| (found.make)());
    let notes = prepared.notes.clone();
    match change {
        None | Some(Change::Ir(_) | Change::Pins(_)) => finish(program, &job, sound, notes),
        Some(Change::Time(clock_hz, cycle_us)) => {
            let built = build(&crate::target::Job { clock_hz, cycle_us, ..job })?;
            // The map says what should be.
            let (period, shortest, tick) = (sound.period, sound.shortest, sound.tick);
            finish(program, &job, Built { period, shortest, tick, fuses: sound.fuses, ..built }, notes)
        }
        Some(Change::LeftOut(line)) => finish(program, &job, left_out(sound, line, job.target), notes),
    }
}

/// The intermediate code of `program`, sound and with the fault `id`, where it is a fault of the intermediate code.
#[must_use]
pub fn mutant_ir(program: &Program, options: &Options, id: u32) -> Option<(Ir, Ir)> {
    let prepared = prepare(program, options).ok()?;
    let change = of_code(&prepared).into_iter().nth(id as usize).map(|found| (found.make)())?;
    let Change::Ir(changed) = change else { return None };
    Some((prepared.ir, changed))
}

/// Faults that are made before the image.
fn of_code(prepared: &Prepared) -> Vec<Candidate<'_>> {
    let mut all = operations(&prepared.ir);
    all.extend(shape::candidates(&prepared.ir));
    all.extend(pins(prepared));
    all
}

/// Faults of the image.
fn of_image<'a>(program: &Program, prepared: &Prepared, built: &'a Built) -> Vec<Candidate<'a>> {
    let mut all = periods(program, prepared, built);
    all.extend(leave_out(built));
    all.extend(banks(built));
    all
}

fn text(ir: &Ir, op: &Op) -> String {
    ir.text(op).lines().map(str::trim).collect::<Vec<_>>().join("; ")
}

/// The faults of single operations, those of the rungs first.
fn operations(ir: &Ir) -> Vec<Candidate<'_>> {
    let mut all = Vec::new();
    let what = |op: Op, new: Option<Op>| -> Box<dyn Fn() -> String + '_> {
        Box::new(move || {
            let new = new.as_ref().map_or_else(|| "nothing".to_owned(), |new| text(ir, new));
            format!("`{}` becomes `{new}`", text(ir, &op))
        })
    };
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, step) in rung.steps.iter().enumerate() {
            for (n, (op, new)) in ops::variants(ir, &step.op).into_iter().enumerate() {
                let make = move || {
                    let mut changed = ir.clone();
                    let new = ops::replaced(ir, &step.op, n).map(|op| Step { at: step.at, op });
                    changed.rungs[number].steps.splice(at..=at, new).for_each(drop);
                    Change::Ir(changed)
                };
                let what = what(op, new);
                let (kind, element) = (MutantKind::Operation, Some(step.at));
                all.push(Candidate { kind, element, what, make: Box::new(make) });
            }
        }
    }
    for (begin, list) in [(true, &ir.begin), (false, &ir.end)] {
        for (at, op) in list.iter().enumerate() {
            for (n, (op_changed, new)) in ops::variants(ir, op).into_iter().enumerate() {
                let make = move || {
                    let mut changed = ir.clone();
                    let list = if begin { &mut changed.begin } else { &mut changed.end };
                    list.splice(at..=at, ops::replaced(ir, op, n)).for_each(drop);
                    Change::Ir(changed)
                };
                let what = what(op_changed, new);
                all.push(Candidate { kind: MutantKind::Around, element: None, what, make: Box::new(make) });
            }
        }
    }
    for (number, table) in ir.tables.iter().enumerate() {
        for (at, value) in table.values.iter().enumerate() {
            let other = if *value > 0 { value - 1 } else { value + 1 };
            let make = move || {
                let mut changed = ir.clone();
                changed.tables[number].values[at] = other;
                Change::Ir(changed)
            };
            let what = move || format!("{}[{at}] is {other} instead of {value}", table.name);
            all.push(Candidate { kind: MutantKind::Around, element: None, what: Box::new(what), make: Box::new(make) });
        }
    }
    all
}

/// Every two pins of one direction, one after the other, swapped.
fn pins(prepared: &Prepared) -> Vec<Candidate<'_>> {
    let pins = &prepared.pins;
    let sort = |pin: &Pin| (pin.output, pin.analog);
    let mut all = Vec::new();
    for (n, pin) in pins.iter().enumerate() {
        let Some(other) = pins.iter().skip(n + 1).position(|other| sort(other) == sort(pin)).map(|at| n + 1 + at)
        else {
            continue;
        };
        let make = move || {
            let mut pins = pins.clone();
            (pins[n].pin, pins[other].pin) = (pins[other].pin, pins[n].pin);
            Change::Pins(pins)
        };
        let what = move || format!("the pins of {} and {} are swapped", pin.name, pins[other].name);
        all.push(Candidate { kind: MutantKind::Pin, element: None, what: Box::new(what), make: Box::new(make) });
    }
    all
}

/// The period one tick shorter and longer, half, and double.
fn periods<'a>(program: &Program, prepared: &Prepared, built: &Built) -> Vec<Candidate<'a>> {
    let (clock, cycle) = (prepared.clock_hz, program.settings.cycle_us);
    // Clocks of a tick in a cycle: the clock that gives one tick more than this one.
    let clocks = u128::from(clock) * u128::from(cycle) * u128::from(built.period.den);
    let per_cycle = (clocks / (u128::from(built.period.num.max(1)) * 1_000_000)).max(1);
    let step = (u128::from(built.tick) * per_cycle * 1_000_000).div_ceil(u128::from(cycle.max(1))) as u64;
    let times = [
        ("the period is one tick longer", clock.saturating_add(step), cycle),
        ("the period is one tick shorter", clock.saturating_sub(step), cycle),
        ("every second scan is lost", clock, cycle.saturating_mul(2)),
        ("every scan is run twice", clock, cycle / 2),
    ];
    times
        .into_iter()
        .filter(|&(_, clock, cycle)| clock > 0 && cycle > 0)
        .map(|(what, clock, cycle)| Candidate {
            kind: MutantKind::Period,
            element: None,
            what: Box::new(move || what.to_owned()),
            make: Box::new(move || Change::Time(clock, cycle)),
        })
        .collect()
}

/// Every instruction before the wait, between the start of a scan and the first rung, and between the last rung and the end.
fn leave_out(built: &Built) -> Vec<Candidate<'_>> {
    let at = |mark: Mark| built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at);
    let first = at(Mark::Rung(0)).or(at(Mark::RungsEnd)).unwrap_or(0);
    let spans = [
        ("reset", 0, at(Mark::Poll).unwrap_or(0)),
        ("start of the scan", at(Mark::ScanStart).unwrap_or(0), first),
        ("end of the scan", at(Mark::RungsEnd).unwrap_or(0), at(Mark::ScanEnd).unwrap_or(0)),
    ];
    let instructions = built.lines.iter().enumerate().filter(|(_, line)| !line.text.is_empty());
    let part =
        |line: &Line| spans.iter().find(|&&(_, from, to)| (from..to).contains(&line.addr)).map(|(part, ..)| *part);
    let of_part = |(n, line)| Some(without(MutantKind::LeftOut, part(line)?, n, line));
    instructions.filter_map(of_part).collect()
}

/// Every instruction that chooses a bank of memory or a page of code: those that set or clear bits 5 to 7 of STATUS, or write
/// PCLATH, on a PIC16. The other families have none.
fn banks(built: &Built) -> Vec<Candidate<'_>> {
    let chooses = |line: &Line| {
        let words: Vec<&str> = line.text.split([' ', ',']).filter(|word| !word.is_empty()).collect();
        match words[..] {
            ["bsf" | "bcf", "0x03", bit] => matches!(bit, "5" | "6" | "7"),
            ["bsf" | "bcf", "0x0A", _] | ["movwf" | "clrf", "0x0A"] => true,
            _ => false,
        }
    };
    let lines = built.lines.iter().enumerate().filter(|(_, line)| chooses(line));
    lines.map(|(n, line)| without(MutantKind::Bank, "bank", n, line)).collect()
}

fn without<'a>(kind: MutantKind, part: &'static str, n: usize, line: &'a Line) -> Candidate<'a> {
    let text = move || line.text.split_whitespace().collect::<Vec<_>>().join(" ");
    let what = move || format!("{part}: `{}` at {:04X} is left out", text(), line.addr);
    Candidate { kind, element: None, what: Box::new(what), make: Box::new(move || Change::LeftOut(n)) }
}

/// The image without one of its instructions: words stand there that do nothing. They are zeros, but on the AP101 ones.
fn left_out(mut built: Built, line: usize, target: &Target) -> Built {
    let (word_bytes, nothing) = (target.chip.word_bytes, if target.has_modules() { 0xFF } else { 0 });
    let Some(Line { addr, words, text, target: goes }) = built.lines.get_mut(line) else { return built };
    let (from, to) = (*addr * word_bytes, (*addr + words.len() as u32) * word_bytes);
    words.fill(u16::from_le_bytes([nothing; 2]));
    "nop".clone_into(text);
    *goes = None;
    for (start, bytes) in &mut built.segments {
        for (at, byte) in (*start..).zip(bytes.iter_mut()) {
            if (from..to).contains(&at) {
                *byte = nothing;
            }
        }
    }
    built
}
