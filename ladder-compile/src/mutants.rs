//! Compilers with one deliberate fault each, enumerated mechanically, to measure what a check of compiled
//! programs can find.
//!
//! Faults of the intermediate code: another operator or operand, a constant off by one, an inverted polarity,
//! an omitted store, a changed order, a cell at another cell's place. Faults of the image: swapped pins, a
//! wrong period, an omitted instruction of reset, latching or output, an omitted bank selection.

mod accessed_cells;
mod op_mutants;
mod shape_mutants;

use diag::Diagnostic;
use ladder::{ElementId, LadderProgram};

use crate::ir::{Ir, IrOp, IrStep};
use crate::pins::AssignedPin;
use crate::target::{BuiltImage, CodeMark, CompileTarget, ImageLine};
use crate::{CompileOptions, CompiledProgram, PreparedCompile, finish_compile, prepare, refusal_diagnostics};

/// Kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum MutantKind {
    /// An operation of a rung is changed or omitted.
    Operation,
    /// An operation before or after the rungs, or a value of a table, is changed.
    Surrounding,
    /// Two operations or two rungs are swapped.
    Order,
    /// The destination is written before the operands are read.
    Aliasing,
    /// A cell is kept at another cell's place.
    State,
    /// Two pins are swapped.
    Pin,
    /// The period is wrong: one tick off, or scans are lost or doubled.
    Period,
    /// An instruction around the rungs is omitted: of reset, of latching inputs, of writing outputs.
    OmittedInstruction,
    /// The selection of a memory bank or code page is omitted, so the previous one is used.
    Bank,
}

/// Description of one fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mutant {
    /// Number of the fault for [`compile_mutant`], from 0.
    pub id: u32,
    /// Kind of the fault.
    pub kind: MutantKind,
    /// Element whose code is changed, if the fault belongs to one.
    pub element: Option<ElementId>,
    /// Text of the change: what is replaced, and by what.
    pub description: String,
}

/// The change that a fault makes.
enum MutantChange {
    /// Other intermediate code.
    Ir(Box<Ir>),
    /// Other pins.
    Pins(Vec<AssignedPin>),
    /// Clock frequency and cycle time used for the image, instead of the right ones.
    Time(u64, u64),
    /// The line of the image with this number is replaced by no-operations.
    OmittedInstruction(usize),
}

/// A possible fault, which is built only on demand.
struct MutantCandidate<'a> {
    kind: MutantKind,
    element: Option<ElementId>,
    describe: Box<dyn Fn() -> String + 'a>,
    make_change: Box<dyn Fn() -> MutantChange + 'a>,
}

/// Returns every fault of `program` for a chip; empty if [`crate::compile`] refuses the program.
#[must_use]
pub fn mutants(program: &LadderProgram, options: &CompileOptions) -> Vec<Mutant> {
    let Ok(prepared) = prepare(program, options) else { return Vec::new() };
    let job = prepared.compile_job(program);
    let Ok(built) = (job.target.build)(&job) else { return Vec::new() };
    let all = code_candidates(&prepared).into_iter().chain(image_candidates(program, &prepared, &built));
    all.zip(0..)
        .map(|(candidate, id)| Mutant {
            id,
            kind: candidate.kind,
            element: candidate.element,
            description: (candidate.describe)(),
        })
        .collect()
}

/// Compiles `program` with fault `id`; an unknown number changes nothing.
///
/// # Errors
/// The errors of [`crate::compile`].
pub fn compile_mutant(
    program: &LadderProgram,
    options: &CompileOptions,
    id: u32,
) -> Result<CompiledProgram, Vec<Diagnostic>> {
    let prepared = prepare(program, options)?;
    let job = prepared.compile_job(program);
    let build = |job: &crate::target::CompileJob<'_>| {
        (job.target.build)(job).map_err(|refusal| refusal_diagnostics::refusal_diagnostics(&refusal, program, job))
    };
    let mut code = code_candidates(&prepared);
    let count = code.len();
    let id = id as usize;
    if id < count {
        let change = (code.swap_remove(id).make_change)();
        let (mut ir, mut pins) = (None, None);
        match change {
            MutantChange::Ir(changed) => ir = Some(*changed),
            MutantChange::Pins(changed) => pins = Some(changed),
            MutantChange::Time(..) | MutantChange::OmittedInstruction(_) => {}
        }
        let with = crate::target::CompileJob { ir: ir.as_ref().unwrap_or(job.ir), ..job };
        let built = build(&crate::target::CompileJob { pins: pins.as_deref().unwrap_or(job.pins), ..with })?;
        return finish_compile(program, &with, built, prepared.notes.clone());
    }
    let sound = build(&job)?;
    let change =
        image_candidates(program, &prepared, &sound).into_iter().nth(id - count).map(|found| (found.make_change)());
    let notes = prepared.notes.clone();
    match change {
        None | Some(MutantChange::Ir(_) | MutantChange::Pins(_)) => finish_compile(program, &job, sound, notes),
        Some(MutantChange::Time(clock_hz, cycle_us)) => {
            let built = build(&crate::target::CompileJob { clock_hz, cycle_us, ..job })?;
            // The map states the values of the right image.
            let (period, shortest, tick) = (sound.period, sound.shortest_period_cycles, sound.tick_cycles);
            finish_compile(
                program,
                &job,
                BuiltImage { period, shortest_period_cycles: shortest, tick_cycles: tick, fuses: sound.fuses, ..built },
                notes,
            )
        }
        Some(MutantChange::OmittedInstruction(line)) => {
            finish_compile(program, &job, omit_instruction(sound, line, job.target), notes)
        }
    }
}

/// The intermediate code of a program without and with a fault.
#[derive(Debug, Clone, PartialEq)]
pub struct MutantIr {
    /// Without the fault.
    pub sound: Ir,
    /// With the fault.
    pub faulty: Ir,
}

/// Returns the intermediate code of `program` without and with fault `id`, if it is a fault of the
/// intermediate code.
#[must_use]
pub fn mutant_ir(program: &LadderProgram, options: &CompileOptions, id: u32) -> Option<MutantIr> {
    let prepared = prepare(program, options).ok()?;
    let change = code_candidates(&prepared).into_iter().nth(id as usize).map(|found| (found.make_change)())?;
    let MutantChange::Ir(changed) = change else { return None };
    Some(MutantIr { sound: prepared.ir, faulty: *changed })
}

/// Faults introduced before the image is built.
fn code_candidates(prepared: &PreparedCompile) -> Vec<MutantCandidate<'_>> {
    let mut all = op_candidates(&prepared.ir);
    all.extend(shape_mutants::shape_candidates(&prepared.ir));
    all.extend(pin_candidates(prepared));
    all
}

/// Faults of the image.
fn image_candidates<'a>(
    program: &LadderProgram,
    prepared: &PreparedCompile,
    built: &'a BuiltImage,
) -> Vec<MutantCandidate<'a>> {
    let mut all = period_candidates(program, prepared, built);
    all.extend(omission_candidates(built));
    all.extend(bank_candidates(built));
    all
}

fn text(ir: &Ir, op: &IrOp) -> String {
    ir.op_text(op).lines().map(str::trim).collect::<Vec<_>>().join("; ")
}

/// Faults of single operations, those of the rungs first.
fn op_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let mut all = Vec::new();
    let what = |op: IrOp, new: Option<IrOp>| -> Box<dyn Fn() -> String + '_> {
        Box::new(move || {
            let new = new.as_ref().map_or_else(|| "nothing".to_owned(), |new| text(ir, new));
            format!("`{}` becomes `{new}`", text(ir, &op))
        })
    };
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, step) in rung.steps.iter().enumerate() {
            for (n, (op, new)) in op_mutants::op_mutants(ir, &step.op).into_iter().enumerate() {
                let make = move || {
                    let mut changed = ir.clone();
                    let new = op_mutants::nth_mutant(ir, &step.op, n).map(|op| IrStep { element: step.element, op });
                    changed.rungs[number].steps.splice(at..=at, new).for_each(drop);
                    MutantChange::Ir(Box::new(changed))
                };
                let what = what(op, new);
                let (kind, element) = (MutantKind::Operation, Some(step.element));
                all.push(MutantCandidate { kind, element, describe: what, make_change: Box::new(make) });
            }
        }
    }
    for (begin, list) in [(true, &ir.prologue), (false, &ir.epilogue)] {
        for (at, op) in list.iter().enumerate() {
            for (n, (op_changed, new)) in op_mutants::op_mutants(ir, op).into_iter().enumerate() {
                let make = move || {
                    let mut changed = ir.clone();
                    let list = if begin { &mut changed.prologue } else { &mut changed.epilogue };
                    list.splice(at..=at, op_mutants::nth_mutant(ir, op, n)).for_each(drop);
                    MutantChange::Ir(Box::new(changed))
                };
                let what = what(op_changed, new);
                all.push(MutantCandidate {
                    kind: MutantKind::Surrounding,
                    element: None,
                    describe: what,
                    make_change: Box::new(make),
                });
            }
        }
    }
    for (number, table) in ir.tables.iter().enumerate() {
        for (at, value) in table.values.iter().enumerate() {
            let other = if *value > 0 { value - 1 } else { value + 1 };
            let make = move || {
                let mut changed = ir.clone();
                changed.tables[number].values[at] = other;
                MutantChange::Ir(Box::new(changed))
            };
            let what = move || format!("{}[{at}] is {other} instead of {value}", table.name);
            all.push(MutantCandidate {
                kind: MutantKind::Surrounding,
                element: None,
                describe: Box::new(what),
                make_change: Box::new(make),
            });
        }
    }
    all
}

/// Swaps each pin with the next one of the same direction.
fn pin_candidates(prepared: &PreparedCompile) -> Vec<MutantCandidate<'_>> {
    let pins = &prepared.pins;
    let sort = |pin: &AssignedPin| (pin.output, pin.analog);
    let mut all = Vec::new();
    for (n, pin) in pins.iter().enumerate() {
        let Some(other) = pins.iter().skip(n + 1).position(|other| sort(other) == sort(pin)).map(|at| n + 1 + at)
        else {
            continue;
        };
        let make = move || {
            let mut pins = pins.clone();
            (pins[n].pin, pins[other].pin) = (pins[other].pin, pins[n].pin);
            MutantChange::Pins(pins)
        };
        let what = move || format!("the pins of {} and {} are swapped", pin.name, pins[other].name);
        all.push(MutantCandidate {
            kind: MutantKind::Pin,
            element: None,
            describe: Box::new(what),
            make_change: Box::new(make),
        });
    }
    all
}

/// Changes the period: one tick shorter, one tick longer, half, and double.
fn period_candidates<'a>(
    program: &LadderProgram,
    prepared: &PreparedCompile,
    built: &BuiltImage,
) -> Vec<MutantCandidate<'a>> {
    let (clock, cycle) = (prepared.clock_hz, program.settings.cycle_us);
    // Clock change that makes the period one tick longer.
    let clocks = u128::from(clock) * u128::from(cycle) * u128::from(built.period.den);
    let per_cycle = (clocks / (u128::from(built.period.num.max(1)) * 1_000_000)).max(1);
    let step = (u128::from(built.tick_cycles) * per_cycle * 1_000_000).div_ceil(u128::from(cycle.max(1))) as u64;
    let times = [
        ("the period is one tick longer", clock.saturating_add(step), cycle),
        ("the period is one tick shorter", clock.saturating_sub(step), cycle),
        ("every second scan is lost", clock, cycle.saturating_mul(2)),
        ("every scan is run twice", clock, cycle / 2),
    ];
    times
        .into_iter()
        .filter(|&(_, clock, cycle)| clock > 0 && cycle > 0)
        .map(|(what, clock, cycle)| MutantCandidate {
            kind: MutantKind::Period,
            element: None,
            describe: Box::new(move || what.to_owned()),
            make_change: Box::new(move || MutantChange::Time(clock, cycle)),
        })
        .collect()
}

/// Omits each instruction before the poll loop, between the start of a scan and the first rung, and after the
/// last rung.
fn omission_candidates(built: &BuiltImage) -> Vec<MutantCandidate<'_>> {
    let at = |mark: CodeMark| built.marks.iter().find(|(m, _)| *m == mark).map(|&(_, at)| at);
    let first = at(CodeMark::Rung(0)).or(at(CodeMark::RungsEnd)).unwrap_or(0);
    let spans = [
        ("reset", 0, at(CodeMark::PollLoop).unwrap_or(0)),
        ("start of the scan", at(CodeMark::ScanStart).unwrap_or(0), first),
        ("end of the scan", at(CodeMark::RungsEnd).unwrap_or(0), at(CodeMark::ScanEnd).unwrap_or(0)),
    ];
    let instructions = built.lines.iter().enumerate().filter(|(_, line)| !line.text.is_empty());
    let part =
        |line: &ImageLine| spans.iter().find(|&&(_, from, to)| (from..to).contains(&line.addr)).map(|(part, ..)| *part);
    let of_part = |(n, line)| Some(omission_candidate(MutantKind::OmittedInstruction, part(line)?, n, line));
    instructions.filter_map(of_part).collect()
}

/// Omits each instruction that selects a memory bank or a code page.
///
/// On a PIC16 these set or clear bits 5 to 7 of STATUS, or write PCLATH. The other families have none.
fn bank_candidates(built: &BuiltImage) -> Vec<MutantCandidate<'_>> {
    let chooses = |line: &ImageLine| {
        let words: Vec<&str> = line.text.split([' ', ',']).filter(|word| !word.is_empty()).collect();
        match words[..] {
            ["bsf" | "bcf", "0x03", bit] => matches!(bit, "5" | "6" | "7"),
            ["bsf" | "bcf", "0x0A", _] | ["movwf" | "clrf", "0x0A"] => true,
            _ => false,
        }
    };
    let lines = built.lines.iter().enumerate().filter(|(_, line)| chooses(line));
    lines.map(|(n, line)| omission_candidate(MutantKind::Bank, "bank", n, line)).collect()
}

fn omission_candidate<'a>(kind: MutantKind, part: &'static str, n: usize, line: &'a ImageLine) -> MutantCandidate<'a> {
    let text = move || line.text.split_whitespace().collect::<Vec<_>>().join(" ");
    let what = move || format!("{part}: `{}` at {:04X} is left out", text(), line.addr);
    MutantCandidate {
        kind,
        element: None,
        describe: Box::new(what),
        make_change: Box::new(move || MutantChange::OmittedInstruction(n)),
    }
}

/// Replaces an instruction of the image by words without effect: zeros, but ones on the AP101.
fn omit_instruction(mut built: BuiltImage, line: usize, target: &CompileTarget) -> BuiltImage {
    let (word_bytes, nothing) = (target.chip.word_bytes, if target.has_modules() { 0xFF } else { 0 });
    let Some(ImageLine { addr, words, text, target }) = built.lines.get_mut(line) else { return built };
    let (from, to) = (*addr * word_bytes, (*addr + words.len() as u32) * word_bytes);
    words.fill(u16::from_le_bytes([nothing; 2]));
    "nop".clone_into(text);
    *target = None;
    for (start, bytes) in &mut built.segments {
        for (at, byte) in (*start..).zip(bytes.iter_mut()) {
            if (from..to).contains(&at) {
                *byte = nothing;
            }
        }
    }
    built
}
