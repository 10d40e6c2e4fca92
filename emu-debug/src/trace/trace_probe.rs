//! The probe of a trace, and the run that shows instructions to it.

use emu_core::cpu::{Cpu, Probe, StopReason};

use super::line_writer::{TraceEventKind, TraceLine, TracedAccess};
use super::output::TraceOutput;
use super::signals::TraceSignals;
use super::word_set::WordSet;
use crate::probes::combined_probe::CombinedProbe;
use crate::probes::run_probes::RunProbes;

/// Number of steps between two decisions of the controller.
const STEPS_BETWEEN_DECISIONS: u32 = 1 << 16;

/// Observes instructions one by one.
pub struct TraceProbe<'a> {
    /// The trace that is written.
    pub trace: Option<TraceOutput<'a>>,
    /// The signals of a waveform.
    pub signals: Option<TraceSignals>,
    /// The traced words; `None` for all.
    traced_words: Option<WordSet>,
    /// Every instruction is observed, at any address.
    every_instruction: bool,
    /// The machine executes one step at a time.
    stepping: bool,
    /// The machine runs from an observed location but has not executed an instruction since: it slept, and
    /// may wake.
    idle: bool,
    /// The current step, or the interrupt that was entered before the next instruction.
    current: Option<(u64, TraceEventKind)>,
    accesses: Vec<TracedAccess>,
    /// Registers before the step, if they are known, and after it.
    before: Vec<u32>,
    before_known: bool,
    after: Vec<u32>,
}

impl<'a> TraceProbe<'a> {
    /// Returns a probe for a trace of the words `only`, or of all words, and for signals.
    #[must_use]
    pub fn new(
        trace: Option<TraceOutput<'a>>,
        traced_words: Option<WordSet>,
        signals: Option<TraceSignals>,
    ) -> TraceProbe<'a> {
        let every_instruction = trace.is_some() && traced_words.is_none()
            || signals.as_ref().is_some_and(TraceSignals::changes_with_any_instruction);
        TraceProbe {
            trace,
            signals,
            traced_words,
            every_instruction,
            stepping: false,
            idle: false,
            current: None,
            accesses: Vec::new(),
            before: Vec::new(),
            before_known: false,
            after: Vec::new(),
        }
    }

    /// Returns true if the trace cannot be written.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.trace.as_ref().is_some_and(TraceOutput::has_failed)
    }

    /// Returns true if a line is written for the instruction at `pc`.
    fn is_traced(&self, pc: u32) -> bool {
        self.trace.is_some() && self.traced_words.as_ref().is_none_or(|traced_words| traced_words.contains(pc))
    }

    /// Returns true if the step at `pc` is observed.
    fn needs_step(&self, pc: u32) -> bool {
        self.every_instruction || self.is_traced(pc)
    }

    /// Prepares for a step, or a run.
    fn begin_step<C: Cpu>(&mut self, cpu: &C, stepping: bool) {
        self.stepping = stepping;
        if !self.before_known && self.trace.is_some() && stepping {
            cpu.read_regs(&mut self.before);
            self.before_known = true;
        }
    }

    /// Handles the end of a step, or the stop of a run; returns whether there was a step. `from` is the
    /// location before it.
    fn end_step<C: Cpu>(&mut self, cpu: &C, from: u32) -> bool {
        self.stepping = false;
        let Some((at, kind)) = self.current.take() else { return false };
        let is_written = match kind {
            TraceEventKind::Instruction(pc) => self.is_traced(pc),
            // Traced if its origin or its destination is.
            TraceEventKind::Interrupt(_) => self.is_traced(from) || self.is_traced(cpu.pc()),
        };
        if self.before_known {
            cpu.read_regs(&mut self.after);
        }
        if let Some(trace) = self.trace.as_mut().filter(|_| is_written) {
            let before = if self.before_known { self.before.as_slice() } else { &[] };
            trace.add_step(cpu, &TraceLine { at, kind, before, after: &self.after, accesses: &self.accesses });
        }
        std::mem::swap(&mut self.before, &mut self.after);
        self.accesses.clear();
        true
    }
}

impl Probe for TraceProbe<'_> {
    const INSN: bool = true;
    const DATA: bool = true;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        if self.stepping {
            self.current = Some((at, TraceEventKind::Instruction(pc)));
            return false;
        }
        if self.needs_step(pc) || self.idle && self.current.is_some() {
            return true;
        }
        // It continues without observation.
        self.current = None;
        self.accesses.clear();
        (self.idle, self.before_known) = (false, false);
        false
    }

    fn on_data_access(&mut self, _at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if self.current.is_some() && self.trace.is_some() {
            self.accesses.push(TracedAccess { space, addr, value, write });
        }
        // A step is observed at the end of the instruction anyway.
        write && !self.stepping && self.signals.as_ref().is_some_and(|signals| signals.is_changed_by_write(space, addr))
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.accesses.clear();
        self.current = Some((at, TraceEventKind::Interrupt(vector)));
    }
}

/// Runs the machine as [`Cpu::run`] does, and shows it to the [`TraceProbe`] of the tools. It may also stop
/// without a request, so that the observations of the tools are checked.
pub(crate) fn run_traced<C: Cpu>(
    cpu: &mut C,
    until: u64,
    probes: &mut RunProbes<&mut CombinedProbe<'_, '_>>,
) -> StopReason {
    for _ in 0..STEPS_BETWEEN_DECISIONS {
        let Some(probe) = &mut probes.inner.trace else { return cpu.run(until, probes) };
        if probe.has_failed() {
            return StopReason::Probe;
        }
        let from = cpu.pc();
        let steps = probe.needs_step(from);
        // If nothing has happened in its cycle, or nothing is observed, it continues at full speed.
        if steps {
            probe.begin_step(cpu, true);
            let stop = cpu.run(until.min(cpu.cycle() + 1), probes);
            let stepped = finish_step(cpu, probes, |probe| probe.end_step(cpu, from));
            if stop != StopReason::Limit || cpu.cycle() >= until {
                return stop;
            }
            if stepped {
                continue;
            }
        }
        if let Some(probe) = &mut probes.inner.trace {
            probe.idle = steps;
            probe.begin_step(cpu, false);
        }
        let stop = cpu.run(until, probes);
        finish_step(cpu, probes, |probe| {
            // An interrupt was entered, and no instruction has followed.
            if probe.current.is_some() {
                probe.end_step(cpu, from);
            } else {
                // Changes in the meantime, as by a reset, were not made by an instruction.
                probe.before_known = false;
            }
            probe.idle = false;
            true
        });
        return stop;
    }
    StopReason::Probe
}

/// Lets the [`TraceProbe`] end its step, then writes the changes to the waveform.
fn finish_step<C: Cpu>(
    cpu: &C,
    probes: &mut RunProbes<&mut CombinedProbe<'_, '_>>,
    end: impl FnOnce(&mut TraceProbe<'_>) -> bool,
) -> bool {
    let Some(probe) = &mut probes.inner.trace else { return false };
    let stepped = end(probe);
    if let (Some(signals), Some(wave)) = (&mut probe.signals, &mut probes.wave) {
        signals.sample(cpu, wave);
    }
    stepped
}
