//! The probe that wants to see instructions, and the run that shows them to it.

use emu_core::cpu::{Cpu, Probe, Stop};

use super::lines::{Access, Step, What};
use super::signals::Signals;
use super::sink::Trace;
use super::words::Words;
use crate::closer::Closer;
use crate::tools::Tools;

/// Steps after which the host is asked whether to go on.
const STEPS: u32 = 1 << 16;

/// What is looked at, instruction by instruction.
pub struct Look<'a> {
    /// The trace that is written.
    pub trace: Option<Trace<'a>>,
    /// The signals of a waveform.
    pub signals: Option<Signals>,
    /// The words of which a trace is written; all of them where there is no such set.
    only: Option<Words>,
    /// Every instruction is looked at, wherever it stands.
    every: bool,
    /// The machine does one step at a time.
    stepping: bool,
    /// It runs on from a place that is looked at, and has executed no instruction since: it slept, and may be woken.
    idle: bool,
    /// What it does in this step, or the interrupt that it has entered in front of the next instruction.
    now: Option<(u64, What)>,
    accesses: Vec<Access>,
    /// Registers before the step, if they are known, and behind it.
    before: Vec<u32>,
    known: bool,
    after: Vec<u32>,
}

impl<'a> Look<'a> {
    /// Looks at all that a trace wants, of the words `only` or of all, and at signals.
    #[must_use]
    pub fn new(trace: Option<Trace<'a>>, only: Option<Words>, signals: Option<Signals>) -> Look<'a> {
        let every = trace.is_some() && only.is_none() || signals.as_ref().is_some_and(Signals::every);
        Look {
            trace,
            signals,
            only,
            every,
            stepping: false,
            idle: false,
            now: None,
            accesses: Vec::new(),
            before: Vec::new(),
            known: false,
            after: Vec::new(),
        }
    }

    /// The trace cannot be written.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.trace.as_ref().is_some_and(Trace::has_failed)
    }

    /// A line is written for the instruction at `pc`.
    fn traced(&self, pc: u32) -> bool {
        self.trace.is_some() && self.only.as_ref().is_none_or(|only| only.has(pc))
    }

    /// The step at `pc` is looked at.
    fn steps(&self, pc: u32) -> bool {
        self.every || self.traced(pc)
    }

    /// Before a step, or a run.
    fn begin<C: Cpu>(&mut self, cpu: &C, stepping: bool) {
        self.stepping = stepping;
        if !self.known && self.trace.is_some() && stepping {
            cpu.regs(&mut self.before);
            self.known = true;
        }
    }

    /// Behind a step, or where a run has stopped. True if there was one. `from`: where the program was before it.
    fn end<C: Cpu>(&mut self, cpu: &C, from: u32) -> bool {
        self.stepping = false;
        let Some((at, what)) = self.now.take() else { return false };
        let wanted = match what {
            What::Instruction(pc) => self.traced(pc),
            // Seen from where it came, or where it goes to.
            What::Interrupt(_) => self.traced(from) || self.traced(cpu.pc()),
        };
        if self.known {
            cpu.regs(&mut self.after);
        }
        if let Some(trace) = self.trace.as_mut().filter(|_| wanted) {
            let before = if self.known { self.before.as_slice() } else { &[] };
            trace.step(cpu, &Step { at, what, before, after: &self.after, accesses: &self.accesses });
        }
        std::mem::swap(&mut self.before, &mut self.after);
        self.accesses.clear();
        true
    }
}

impl Probe for Look<'_> {
    const INSN: bool = true;
    const DATA: bool = true;

    fn insn(&mut self, at: u64, pc: u32) -> bool {
        if self.stepping {
            self.now = Some((at, What::Instruction(pc)));
            return false;
        }
        if self.steps(pc) || self.idle && self.now.is_some() {
            return true;
        }
        // It runs on unseen.
        self.now = None;
        self.accesses.clear();
        (self.idle, self.known) = (false, false);
        false
    }

    fn data(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if self.now.is_some() && self.trace.is_some() {
            self.accesses.push(Access { space, addr, value, write });
        }
        // Where it steps there is a look at the end of the instruction anyway.
        write && !self.stepping && self.signals.as_ref().is_some_and(|signals| signals.touched(space, addr))
    }

    fn irq(&mut self, at: u64, vector: u8) {
        self.accesses.clear();
        self.now = Some((at, What::Interrupt(vector)));
    }
}

/// Runs the machine as [`Cpu::run`] does, and shows it to the [`Look`] of the tools. It may also stop without being asked to, so that
/// the tools are asked what they have seen.
pub(crate) fn go<C: Cpu>(cpu: &mut C, until: u64, tools: &mut Tools<&mut Closer<'_, '_>>) -> Stop {
    for _ in 0..STEPS {
        let Some(look) = &mut tools.close.look else { return cpu.run(until, tools) };
        if look.has_failed() {
            return Stop::Probe;
        }
        let from = cpu.pc();
        let steps = look.steps(from);
        // Where nothing has happened in its cycle, or nobody looks, it goes on at full speed.
        if steps {
            look.begin(cpu, true);
            let stop = cpu.run(until.min(cpu.cycle() + 1), tools);
            let happened = shown(cpu, tools, |look| look.end(cpu, from));
            if stop != Stop::Limit || cpu.cycle() >= until {
                return stop;
            }
            if happened {
                continue;
            }
        }
        if let Some(look) = &mut tools.close.look {
            look.idle = steps;
            look.begin(cpu, false);
        }
        let stop = cpu.run(until, tools);
        shown(cpu, tools, |look| {
            // An interrupt that was entered, and no instruction since.
            if look.now.is_some() {
                look.end(cpu, from);
            } else {
                // What may have changed meanwhile, as by a reset, no instruction did.
                look.known = false;
            }
            look.idle = false;
            true
        });
        return stop;
    }
    Stop::Probe
}

/// Lets the [`Look`] end its step, and then writes what has changed into the waveform.
fn shown<C: Cpu>(cpu: &C, tools: &mut Tools<&mut Closer<'_, '_>>, end: impl FnOnce(&mut Look<'_>) -> bool) -> bool {
    let Some(look) = &mut tools.close.look else { return false };
    let happened = end(look);
    if let (Some(signals), Some(wave)) = (&mut look.signals, &mut tools.wave) {
        signals.sample(cpu, wave);
    }
    happened
}
