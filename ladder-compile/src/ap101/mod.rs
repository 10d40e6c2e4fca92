//! The AP101 back end: translates intermediate code to a program image with its configuration.
//!
//! The machine has the same model as the intermediate code: one bit accumulator, bit cells, and timers and
//! counters that are written and read like bits. It samples inputs, paces program cycles and clears its
//! memory at a cold start by itself, so an image consists of the rungs and a configuration.
//! docs/compile-ap101.md describes the layout.

mod acc_use;
mod config_source;
mod layout;
mod limits;
mod select;

use emu_ap101::chips::AP101;
use emu_ap101::config::{Ap101Config, INPUTS, InputSampling, OUTPUTS, PROGRAMS, ProgramEntry};
use emu_ap101::isa::{self, Ap101OpKind, SPAN};
use ladder::ElementId;

use crate::CodegenError;
use crate::code::{CodeWriter, ControlFlow, CycleCounts, FinishedCode, FormInstruction, TargetArch};
use crate::ir::{Ir, IrOp};
use crate::longest_path::longest_path;
use crate::map::{CellLocation, Ratio};
use crate::target::{BuildRefusal, BuiltImage, CodeMark, CompileJob, CompileTarget, ImageLine};
use layout::Ap101Layout;
use select::Ap101Selector;

pub use config_source::config_directives;

/// Clocks per machine cycle.
const CLOCKS: u64 = 2;

const CHANNELS: usize = INPUTS as usize + OUTPUTS as usize;

/// Names of the channels: first the inputs, then the outputs.
const PINS: [&str; CHANNELS] = {
    let mut pins = [""; CHANNELS];
    let mut n = 0;
    while n < CHANNELS {
        pins[n] = AP101.pins[n].name;
        n += 1;
    }
    pins
};

/// Chips of this back end.
pub const TARGETS: &[CompileTarget] = &[CompileTarget {
    chip: &AP101,
    pins: &PINS,
    uart: None,
    pwm: &[],
    i2c: None,
    spi: None,
    adc: &[],
    eeprom: 0,
    build,
}];

/// Builds an image.
///
/// # Errors
/// Reports everything that the machine cannot express at once; a period that is not a whole number of machine
/// cycles; more code, memory or modules than the machine has.
pub fn build(job: &CompileJob<'_>) -> Result<BuiltImage, BuildRefusal> {
    let mut refusals = limits::unsupported_ops(job);
    let period = whole_cycle_period(job).map_err(|refusal| refusals.push(refusal)).unwrap_or_default();
    let layout = match layout::layout(job) {
        Ok(layout) if refusals.is_empty() => layout,
        Ok(_) => return Err(BuildRefusal::Several(refusals)),
        Err(more) => return Err(BuildRefusal::Several([refusals, more].concat())),
    };
    let mut code = scan_code(job.ir, &layout, false)?;
    if code.mark_address(CodeMark::ScanEnd) == Some(0) {
        code = self::scan_code(job.ir, &layout, true)?;
    }
    let at = |mark| code.mark_address(mark).unwrap_or(0);
    let starts: Vec<u32> = (0..job.ir.rungs.len() as u32).map(|n| at(CodeMark::Rung(n))).collect();
    let ends = starts.iter().skip(1).copied().chain([at(CodeMark::RungsEnd)]);
    let rungs: Vec<(u32, u32)> = starts.iter().copied().zip(ends).collect();
    if code.words.len() > SPAN {
        return Err(BuildRefusal::CodeTooLarge {
            needed: 2 * code.words.len() as u64,
            available: 2 * SPAN as u64,
            rungs: rungs.iter().map(|(start, end)| 2 * u64::from(end - start)).collect(),
        });
    }
    let bytes = code.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let block = configuration(job, &layout, period, code.words.len()).to_bytes();
    // After the program, the machine loads the outputs from their images: one machine cycle per channel.
    let reload = u64::from(layout.outputs);
    Ok(BuiltImage {
        segments: vec![(0, bytes), (emu_ap101::config::CONFIG_ADDRESS, block)],
        lines: lines(&code),
        marks: code.marks.clone(),
        bit_places: layout.bits.iter().map(|&addr| layout::bit_place(addr)).collect(),
        word_places: layout.words.iter().map(|&module| module_value_place(module)).collect(),
        period: Ratio { num: period, den: 1 },
        shortest_period_cycles: period,
        tick_cycles: 1,
        poll_cycles: 0,
        worst_scan_cycles: longest_path(&code, 0, code.words.len() as u32) + reload,
        rung_cycles: rungs.iter().map(|&(start, end)| longest_path(&code, start, end)).collect(),
        ram_bytes: layout.memory_bits.div_ceil(8),
        fuses: Vec::new(),
        specials: Vec::new(),
        pin_needs: Vec::new(),
    })
}

/// Length of a scan in machine cycles; fails if it is not a whole number or does not fit the configuration.
fn whole_cycle_period(job: &CompileJob<'_>) -> Result<u64, BuildRefusal> {
    let CompileJob { clock_hz, cycle_us, .. } = *job;
    let lacks = |cause: String, hint: String| Err(BuildRefusal::Unsupported { cause, hint, element: None });
    let (num, den) = (u128::from(clock_hz) * u128::from(cycle_us), 1_000_000 * u128::from(CLOCKS));
    let longest = u128::from(u32::MAX);
    if num / den > longest || u32::try_from(clock_hz).is_err() {
        let cause = format!(
            "the cycle of {cycle_us} us at {clock_hz} Hz is {} machine cycles, the most is {longest}",
            num / den
        );
        return lacks(
            cause,
            format!("a cycle is at most {} us at this clock", longest * den / u128::from(clock_hz.max(1))),
        );
    }
    if num % den != 0 || num == 0 {
        let common = gcd(num, den);
        let cause = format!(
            "the cycle of {cycle_us} us at {clock_hz} Hz is {}/{} machine cycles of two clocks, and the machine waits for a whole \
             number of them",
            num / common,
            den / common
        );
        let step = den / gcd(u128::from(clock_hz), den);
        return lacks(cause, format!("at this clock CYCLE= is a multiple of {step} us; or set CRYSTAL="));
    }
    Ok((num / den) as u64)
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Configuration with one program, the channels in use and a period.
fn configuration(job: &CompileJob<'_>, layout: &Ap101Layout, period: u64, words: usize) -> Ap101Config {
    let last = (words as u16).saturating_sub(1);
    let mut enabled = [false; PROGRAMS];
    enabled[0] = true;
    Ap101Config {
        inputs: InputSampling::Scan,
        reconfigurable: false,
        output_channels: layout.outputs,
        input_channels: layout.inputs,
        hz: job.clock_hz,
        period,
        programs: vec![ProgramEntry { entry: 0, start: 0, last, rx: 0 }],
        enabled,
        modules: layout.modules,
    }
}

/// Location of the value of a module, two bytes.
fn module_value_place(module: u16) -> CellLocation {
    CellLocation::Word { space: "value".to_owned(), addr: 2 * u32::from(module), bytes: 2 }
}

/// Generates the code of a scan.
///
/// With `longer` the scan begins with a NOP, so that its first instruction is not also its last.
fn scan_code(ir: &Ir, layout: &Ap101Layout, longer: bool) -> Result<FinishedCode, BuildRefusal> {
    let mut asm = CodeWriter::new(Ap101Arch);
    // All operations of the scan in order, so that the selector can look ahead.
    let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
    let all: Vec<&IrOp> = ir.prologue.iter().chain(rungs).chain(&ir.epilogue).collect();
    let mut select = Ap101Selector::new(&mut asm, layout, &all);
    select.asm.mark(CodeMark::ScanStart);
    if longer {
        select.asm.op(Ap101OpKind::Nop, &[]);
    }
    if !ir.prologue.is_empty() {
        select.asm.mark(CodeMark::Section("before the rungs"));
    }
    ir.prologue.iter().for_each(|_| select.select_next());
    for (number, rung) in (0..).zip(&ir.rungs) {
        select.asm.mark(CodeMark::Rung(number));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.element_count {
            let id = ElementId { rung: number, index };
            select.asm.mark(CodeMark::Element(id));
            while steps.next_if(|step| step.element <= id).is_some() {
                select.select_next();
            }
        }
        steps.for_each(|_| select.select_next());
    }
    select.asm.mark(CodeMark::RungsEnd);
    ir.epilogue.iter().for_each(|_| select.select_next());
    select.asm.mark(CodeMark::Section("outputs from their images"));
    select.copy_late_outputs();
    select.asm.mark(CodeMark::Section("the end"));
    select.asm.mark(CodeMark::ScanEnd);
    // Jumps may target the end of the last rung, but not an address after the last word, so the code ends
    // with a NOP.
    asm.op(Ap101OpKind::Nop, &[]);
    asm.mark(CodeMark::AfterScan);
    asm.finish().map_err(BuildRefusal::Internal)
}

fn lines(code: &FinishedCode) -> Vec<ImageLine> {
    let line = |insn: &crate::code::CodeInstruction| {
        let words = code.words.get(insn.addr as usize..(insn.addr + insn.len) as usize).unwrap_or_default().to_vec();
        ImageLine { addr: insn.addr, words, text: insn.text.clone(), target: insn.target }
    };
    code.instructions.iter().map(line).collect()
}

/// AP101 as a target of the code writer: every instruction has one word and takes one machine cycle.
#[derive(Debug)]
struct Ap101Arch;

/// An unconditional jump, or a jump taken if A is 1; both reach every address.
#[derive(Debug, Clone, Copy)]
enum Ap101Jump {
    Unconditional,
    IfSet,
}

impl TargetArch for Ap101Arch {
    type Opcode = Ap101OpKind;
    type JumpForm = Ap101Jump;

    fn instruction_words(&self, _: Ap101OpKind) -> u32 {
        1
    }

    fn encode(&self, kind: Ap101OpKind, operands: &[i32], _: u32) -> Result<Vec<u16>, CodegenError> {
        Ok(vec![isa::encode(kind, operands)?])
    }

    fn jump_form(&self, jump: Ap101Jump, _: u8, _: u32, to: u32) -> Option<Vec<FormInstruction<Ap101OpKind>>> {
        let kind = match jump {
            Ap101Jump::Unconditional => Ap101OpKind::Jmp,
            Ap101Jump::IfSet => Ap101OpKind::Jmpc,
        };
        // Code that exceeds the memory is refused by its length, so the operand may wrap here.
        Some(vec![FormInstruction { kind, operands: vec![(to % SPAN as u32) as i32], target: Some(to) }])
    }

    fn flow_and_cycles(&self, kind: Ap101OpKind) -> (ControlFlow, CycleCounts) {
        let flow = match kind {
            Ap101OpKind::Jmp | Ap101OpKind::JmpX => ControlFlow::Jump,
            Ap101OpKind::Jmpc | Ap101OpKind::JmpcX => ControlFlow::Branch,
            _ => ControlFlow::Sequential,
        };
        let row = isa::ROWS.get(kind as usize);
        let cycles = row.and_then(|row| row.cycles.possible_counts().first().copied()).map_or(1, u32::from);
        (flow, [cycles; 3])
    }

    fn disassemble(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at).text
    }
}
