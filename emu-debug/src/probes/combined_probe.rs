//! Combines all observers of instructions and accesses in one probe, so that the run loop is compiled once
//! for all runs with any of them.

use emu_core::cpu::{Probe, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::CycleTime;

use crate::probes::access_monitor::AccessMonitor;
use crate::probes::lints::LintProbe;
use crate::run::{ReadMemory, RunProbe};
use crate::trace::TraceProbe;

/// A [`RunProbe`] behind a pointer.
pub(crate) trait DynRunProbe: crate::probes::dyn_probe::DynProbe {
    /// Calls [`Probe::on_branch`].
    fn on_branch(&mut self, next: u32, to: u32, taken: bool);
    /// Calls [`Probe::on_flow_start`].
    fn on_flow_start(&mut self, pc: u32);
    /// Calls [`Probe::on_flow_end`].
    fn on_flow_end(&mut self, pc: u32);
    /// Calls [`RunProbe::on_breakpoint_passed`].
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32);
}

impl<A: RunProbe> DynRunProbe for A {
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        Probe::on_branch(self, next, to, taken);
    }

    fn on_flow_start(&mut self, pc: u32) {
        Probe::on_flow_start(self, pc);
    }

    fn on_flow_end(&mut self, pc: u32) {
        Probe::on_flow_end(self, pc);
    }

    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        RunProbe::on_breakpoint_passed(self, memory, pc);
    }
}

/// Combines conditions, lints, the instruction trace, and an additional probe.
pub(crate) struct CombinedProbe<'a, 'l> {
    pub access_monitor: AccessMonitor,
    pub lints: Option<LintProbe>,
    pub trace: Option<&'a mut TraceProbe<'l>>,
    pub run_probe: &'a mut dyn DynRunProbe,
}

impl Probe for CombinedProbe<'_, '_> {
    const INSN: bool = true;
    const DATA: bool = true;
    const FLOW: bool = true;
    const LINT: bool = true;
    const SUBCYCLE: bool = true;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        // If the trace stops before the instruction, it will be reported again.
        if self.trace.as_mut().is_some_and(|trace| trace.on_instruction(at, pc)) {
            return true;
        }
        self.access_monitor.on_instruction(at, pc);
        if let Some(lints) = &mut self.lints {
            lints.on_instruction(at, pc);
        }
        self.run_probe.on_instruction(at, pc)
    }

    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if let Some(lints) = &mut self.lints {
            lints.on_data_access(at, space, addr, value, write);
        }
        let stop = self.trace.as_mut().is_some_and(|trace| trace.on_data_access(at, space, addr, value, write));
        self.access_monitor.on_data_access(at, space, addr, value, write) | stop
    }

    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.run_probe.on_branch(next, to, taken);
    }

    fn on_flow_start(&mut self, pc: u32) {
        self.run_probe.on_flow_start(pc);
    }

    fn on_flow_end(&mut self, pc: u32) {
        self.run_probe.on_flow_end(pc);
    }

    fn on_interrupt(&mut self, at: u64, vector: u8) {
        if let Some(trace) = &mut self.trace {
            trace.on_interrupt(at, vector);
        }
        self.run_probe.on_interrupt(at, vector);
    }

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        if let Some(lints) = &mut self.lints {
            lints.on_lint(at, pc, lint);
        }
    }

    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.access_monitor.on_subcycle(at, phase, pc, word)
    }
}
