//! The AP101 back end: intermediate code to an image of program memory with its configuration.
//!
//! The machine is what the intermediate code imagines: one bit accumulator, bit cells, timers and counters that are written and read
//! like bits. It samples inputs, paces program cycles and clears its memory at a cold start by itself, so an image is the rungs and a
//! configuration. docs/compile-ap101.md says where everything is.

mod layout;
mod refuse;
mod select;
mod source;

use emu_ap101::chips::AP101;
use emu_ap101::config::{Config, INPUTS, Inputs, OUTPUTS, PROGRAMS, Program};
use emu_ap101::isa::{self, Kind, SPAN};
use ladder::ElementId;

use crate::code::{Arch, Asm, Code, Cycles, Flow, Step};
use crate::ir::{Ir, Op};
use crate::map::{Place, Ratio};
use crate::target::{Built, Job, Line, Mark, Refusal, Target};
use crate::worst::longest;
use layout::Layout;
use select::Select;

pub use source::directives;

/// Clocks of a machine cycle.
const CLOCKS: u64 = 2;

const CHANNELS: usize = INPUTS as usize + OUTPUTS as usize;

/// Names of the channels: inputs, then outputs.
const PINS: [&str; CHANNELS] = {
    let mut pins = [""; CHANNELS];
    let mut n = 0;
    while n < CHANNELS {
        pins[n] = AP101.pins[n].name;
        n += 1;
    }
    pins
};

/// The chips of this back end.
pub const TARGETS: &[Target] =
    &[Target { chip: &AP101, pins: &PINS, uart: None, pwm: None, adc: &[], eeprom: 0, build }];

/// Makes an image.
///
/// # Errors
/// What the machine cannot express, all of it at once; a period that is no whole number of machine cycles; more code, memory or modules
/// than there are.
pub fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let mut refusals = refuse::refuse(job);
    let period = period(job).map_err(|refusal| refusals.push(refusal)).unwrap_or_default();
    let layout = match layout::layout(job) {
        Ok(layout) if refusals.is_empty() => layout,
        Ok(_) => return Err(Refusal::Many(refusals)),
        Err(more) => return Err(Refusal::Many([refusals, more].concat())),
    };
    let mut code = code(job.ir, &layout, false)?;
    if code.at(Mark::ScanEnd) == Some(0) {
        code = self::code(job.ir, &layout, true)?;
    }
    let at = |mark| code.at(mark).unwrap_or(0);
    let starts: Vec<u32> = (0..job.ir.rungs.len() as u32).map(|n| at(Mark::Rung(n))).collect();
    let ends = starts.iter().skip(1).copied().chain([at(Mark::RungsEnd)]);
    let rungs: Vec<(u32, u32)> = starts.iter().copied().zip(ends).collect();
    if code.words.len() > SPAN {
        return Err(Refusal::Code {
            needed: 2 * code.words.len() as u64,
            available: 2 * SPAN as u64,
            rungs: rungs.iter().map(|(start, end)| 2 * u64::from(end - start)).collect(),
        });
    }
    let bytes = code.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let block = config(job, &layout, period, code.words.len()).block();
    // Behind the program the machine looks at every output channel, a machine cycle each.
    let reload = u64::from(layout.outputs);
    Ok(Built {
        segments: vec![(0, bytes), (emu_ap101::config::BLOCK, block)],
        lines: lines(&code),
        marks: code.marks.clone(),
        bits: layout.bits.iter().map(|&addr| layout::place(addr)).collect(),
        words: layout.words.iter().map(|&module| value(module)).collect(),
        period: Ratio { num: period, den: 1 },
        shortest: period,
        tick: 1,
        poll: 0,
        worst: longest(&code, 0, code.words.len() as u32) + reload,
        rungs: rungs.iter().map(|&(start, end)| longest(&code, start, end)).collect(),
        ram_bytes: layout.memory.div_ceil(8),
        fuses: Vec::new(),
        specials: Vec::new(),
        warnings: Vec::new(),
    })
}

/// Machine cycles of a scan, a whole number that the configuration can hold.
fn period(job: &Job<'_>) -> Result<u64, Refusal> {
    let Job { clock_hz, cycle_us, .. } = *job;
    let lacks = |cause: String, hint: String| Err(Refusal::Lacks { cause, hint, element: None });
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

/// The configuration: one program, as many channels as are in use, a period.
fn config(job: &Job<'_>, layout: &Layout, period: u64, words: usize) -> Config {
    let last = (words as u16).saturating_sub(1);
    let mut enabled = [false; PROGRAMS];
    enabled[0] = true;
    Config {
        inputs: Inputs::Scan,
        reconfigurable: false,
        output_channels: layout.outputs,
        input_channels: layout.inputs,
        hz: job.clock_hz,
        period,
        programs: vec![Program { entry: 0, start: 0, last, rx: 0 }],
        enabled,
        modules: layout.modules,
    }
}

/// The value of a module, two bytes.
fn value(module: u16) -> Place {
    Place::Word { space: "value".to_owned(), addr: 2 * u32::from(module), bytes: 2 }
}

/// The scan as instructions; `longer`: with one more, so that the first of a scan is not its last one.
fn code(ir: &Ir, layout: &Layout, longer: bool) -> Result<Code, Refusal> {
    let mut asm = Asm::new(Machine);
    // Every operation of the scan in a row, so that what comes later can be asked.
    let rungs = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
    let all: Vec<&Op> = ir.begin.iter().chain(rungs).chain(&ir.end).collect();
    let mut select = Select::new(&mut asm, layout, &all);
    select.asm.mark(Mark::ScanStart);
    if longer {
        select.asm.op(Kind::Nop, &[]);
    }
    if !ir.begin.is_empty() {
        select.asm.mark(Mark::Part("before the rungs"));
    }
    ir.begin.iter().for_each(|_| select.next());
    for (number, rung) in (0..).zip(&ir.rungs) {
        select.asm.mark(Mark::Rung(number));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.elements {
            let id = ElementId { rung: number, index };
            select.asm.mark(Mark::Element(id));
            while steps.next_if(|step| step.at <= id).is_some() {
                select.next();
            }
        }
        steps.for_each(|_| select.next());
    }
    select.asm.mark(Mark::RungsEnd);
    ir.end.iter().for_each(|_| select.next());
    select.asm.mark(Mark::Part("outputs from their images"));
    select.outputs();
    select.asm.mark(Mark::Part("the end"));
    select.asm.mark(Mark::ScanEnd);
    // Jumps may go to the end of the last rung, but not behind the last word.
    asm.op(Kind::Nop, &[]);
    asm.mark(Mark::ScanOver);
    asm.finish().map_err(Refusal::Internal)
}

fn lines(code: &Code) -> Vec<Line> {
    let line = |insn: &crate::code::Insn| {
        let words = code.words.get(insn.addr as usize..(insn.addr + insn.len) as usize).unwrap_or_default().to_vec();
        Line { addr: insn.addr, words, text: insn.text.clone(), target: insn.target }
    };
    code.insns.iter().map(line).collect()
}

/// The family as the assembler of back ends sees it: every instruction is a word and a machine cycle.
#[derive(Debug)]
struct Machine;

/// A jump, or one that is made if A is 1: both reach everything.
#[derive(Debug, Clone, Copy)]
enum Jump {
    Always,
    IfSet,
}

impl Arch for Machine {
    type Kind = Kind;
    type Jump = Jump;

    fn len(&self, _: Kind) -> u32 {
        1
    }

    fn encode(&self, kind: Kind, operands: &[i32], _: u32) -> Result<Vec<u16>, String> {
        isa::encode(kind, operands).map(|word| vec![word]).map_err(|error| error.to_string())
    }

    fn form(&self, jump: Jump, _: u8, _: u32, to: u32) -> Option<Vec<Step<Kind>>> {
        let kind = match jump {
            Jump::Always => Kind::Jmp,
            Jump::IfSet => Kind::Jmpc,
        };
        // Code that is longer than the memory is refused for its length, whatever its jumps hold.
        Some(vec![Step { kind, operands: vec![(to % SPAN as u32) as i32], target: Some(to) }])
    }

    fn flow(&self, kind: Kind) -> (Flow, Cycles) {
        let flow = match kind {
            Kind::Jmp | Kind::JmpX => Flow::Jump,
            Kind::Jmpc | Kind::JmpcX => Flow::Branch,
            _ => Flow::Next,
        };
        let row = isa::ROWS.get(kind as usize);
        let cycles = row.and_then(|row| row.cycles.outcomes().first().copied()).map_or(1, u32::from);
        (flow, [cycles; 3])
    }

    fn text(&self, words: &[u16], at: u32) -> String {
        isa::disassemble(words, at).text
    }
}
