//! The run: from edge to edge, from message to message.

use emu_core::cpu::{Cpu, Probe, ProgramError, StopReason};
use emu_core::image::SimulatorMessage;
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

use super::circuit::CodCircuit;
use super::error::CodError;
use super::expr::CodExpression;
use super::script::{CodAction, CodRefusal, CodScript, refusal};
use super::value::CodValue;
use super::wiring::SetAnalogInput;
use crate::names::address_names::AddressNames;
use crate::probes::dyn_probe;

/// Machine cycles before a part's own next change at which the run stops, so that the change is queued in the
/// chip in time: no instruction and no interrupt entry is longer.
const LEAD_CYCLES: u64 = 8;

/// Number of stops within one machine cycle after which the run is given up.
const MAX_STEPS_WITHOUT_TIME: u32 = 10_000;

/// The limits of a run.
#[derive(Debug, Clone, Copy)]
pub struct CodRunLimits {
    /// The machine cycle at which it ends at the latest; `break c` may end it earlier.
    pub cycle: u64,
    /// Clock of the chip in Hz.
    pub hz: u64,
}

/// How a run ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CodVerdict {
    /// A message halted it.
    Message {
        /// Its text.
        text: String,
        /// The assertion that failed, if the message was one, and the values of its names.
        failed_assertion: Option<(String, Vec<NamedText>)>,
        /// Program word address.
        pc: u32,
        /// Machine cycle.
        cycle: u64,
    },
    /// The limit of the caller or of the program was reached.
    Limit {
        /// Machine cycle.
        cycle: u64,
    },
    /// Nothing can wake the chip any more.
    Halted {
        /// Program word address.
        pc: u32,
        /// Machine cycle.
        cycle: u64,
    },
    /// The program cannot continue.
    Error(ProgramError),
    /// A message cannot be executed.
    Refused(CodRefusal),
    /// Chip and bench react to each other without end, as in a ring of gates through a comparator.
    Unsettled {
        /// Machine cycle.
        cycle: u64,
    },
}

impl CodVerdict {
    /// Returns true if the first message that halted the run contains PASSED.
    #[must_use]
    pub fn passed(&self) -> bool {
        matches!(self, CodVerdict::Message { text, .. } if text.contains("PASSED"))
    }
}

/// The outcome of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodOutcome {
    /// How it ended.
    pub verdict: CodVerdict,
    /// Number of assertions checked.
    pub assertions_checked: u64,
    /// Remarks about commands that are unusual but not wrong.
    pub warnings: Vec<String>,
}

/// Collects the edges of pins on nets.
struct EdgeProbe {
    attached: Vec<bool>,
    seen: Vec<ChipEvent>,
}

impl Probe for EdgeProbe {
    const EVENTS: bool = true;

    fn on_event(&mut self, event: ChipEvent) -> bool {
        let on_net = matches!(event, ChipEvent::Edge { pin, .. } if self.attached.get(usize::from(pin)) == Some(&true));
        if on_net {
            self.seen.push(event);
        }
        on_net
    }
}

/// Runs `cpu`, which has just been powered up, with the messages of its program. `analog` receives voltages
/// when they change.
pub fn run_script<C: Cpu>(
    cpu: &mut C,
    script: &CodScript,
    names: AddressNames<'_>,
    limits: CodRunLimits,
    analog: SetAnalogInput<'_, C>,
) -> CodOutcome {
    let circuit = CodCircuit::new(names, script.frequency().unwrap_or(limits.hz).max(1), limits.cycle);
    let attached = vec![false; names.chip.pins.len()];
    let mut run =
        CodRun { circuit, edges: EdgeProbe { attached, seen: Vec::new() }, pin_levels: Vec::new(), checked: 0 };
    let verdict = run.run_to_verdict(cpu, script, analog);
    for pc in script.by_address.keys() {
        cpu.set_breakpoint(*pc, false);
    }
    CodOutcome { verdict, assertions_checked: run.checked, warnings: run.circuit.warnings }
}

struct CodRun<'n> {
    circuit: CodCircuit<'n>,
    edges: EdgeProbe,
    /// Levels of the pins, edge by edge.
    pin_levels: Vec<PinLevel>,
    checked: u64,
}

/// A name in an expression with its current value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedText {
    /// The name.
    pub name: String,
    /// The value as text.
    pub value: String,
}

impl CodRun<'_> {
    fn run_to_verdict<C: Cpu>(&mut self, cpu: &mut C, script: &CodScript, analog: SetAnalogInput<'_, C>) -> CodVerdict {
        let now = |cpu: &C| cpu.cycle().saturating_mul(u64::from(cpu.clocks_per_cycle()));
        for (command, message) in &script.start {
            if let Err(cause) = self.circuit.command(command, cpu, now(cpu)) {
                return CodVerdict::Refused(refusal(message, cause));
            }
        }
        if let Some((_, message)) = script.start.last().filter(|_| self.circuit.has_unfinished_stimulus()) {
            return CodVerdict::Refused(refusal(message, CodError::UnfinishedStimulus));
        }
        for pin in 0..self.edges.attached.len() {
            let attached = self.circuit.is_attached(pin as PinId);
            if let Some(known) = self.edges.attached.get_mut(pin) {
                *known = attached;
            }
        }
        for pc in script.by_address.keys() {
            cpu.set_breakpoint(*pc, true);
        }
        self.circuit.settle(cpu, now(cpu), &[], &mut *analog);
        self.pin_levels = crate::run::pin_levels(cpu, cpu.chip());
        let (mut steps_without_time, mut last) = (0, cpu.cycle());
        loop {
            steps_without_time = if cpu.cycle() == last { steps_without_time + 1 } else { 0 };
            last = cpu.cycle();
            if steps_without_time > MAX_STEPS_WITHOUT_TIME {
                return CodVerdict::Unsettled { cycle: last };
            }
            if cpu.cycle() >= self.circuit.limit {
                return CodVerdict::Limit { cycle: cpu.cycle() };
            }
            let until = self.run_limit(cpu, &mut *analog).min(self.circuit.limit);
            let stop = cpu.run(until, &mut dyn_probe::probe_events(&mut self.edges));
            self.apply_edges(cpu, &mut *analog);
            match stop {
                StopReason::Limit | StopReason::Probe => {}
                StopReason::Halted => {
                    // Something on the bench may still wake the chip: the next change there, which not every
                    // scheduled event is.
                    let mut t = now(cpu);
                    loop {
                        match self.next_drive(cpu, t) {
                            None => return CodVerdict::Halted { pc: cpu.pc(), cycle: cpu.cycle() },
                            Some(next) if next / u64::from(cpu.clocks_per_cycle()) >= self.circuit.limit => {
                                return CodVerdict::Limit { cycle: self.circuit.limit };
                            }
                            Some(next) if self.drive(cpu, next, &mut *analog) => break,
                            Some(next) => t = next,
                        }
                    }
                }
                StopReason::Error(error) => return CodVerdict::Error(error),
                StopReason::Breakpoint { pc } => {
                    if let Some(verdict) = self.messages(cpu, script, pc, &mut *analog) {
                        return verdict;
                    }
                }
            }
        }
    }

    /// Returns the next clock after `t` at which a part changes an output by itself.
    fn next_drive<C: Cpu>(&self, cpu: &C, t: u64) -> Option<u64> {
        let cycle = u64::from(cpu.clocks_per_cycle());
        self.circuit.parts.iter().filter_map(|part| part.next_drive(t, cycle, self.circuit.hz)).min()
    }

    /// Drives the outputs of the parts at `t` on the nets; returns true if an input of the chip changes.
    fn drive<C: Cpu>(&mut self, cpu: &mut C, t: u64, analog: SetAnalogInput<'_, C>) -> bool {
        for part in &mut self.circuit.parts {
            part.advance(t, self.circuit.hz);
        }
        self.circuit.settle(cpu, t, &[], analog)
    }

    /// Queues what the parts drive within the next cycles, each change at its own time; returns the cycle up
    /// to which the chip may run before the parts must be evaluated again.
    fn run_limit<C: Cpu>(&mut self, cpu: &mut C, analog: SetAnalogInput<'_, C>) -> u64 {
        let cycle = u64::from(cpu.clocks_per_cycle());
        let mut t = cpu.cycle().saturating_mul(cycle);
        let mut queued = None;
        let next = loop {
            let Some(next) = self.next_drive(cpu, t) else { break u64::MAX };
            // One change at a time: the chip may react to it.
            if next / cycle > cpu.cycle().saturating_add(LEAD_CYCLES) || queued.is_some() {
                break next / cycle;
            }
            queued = Some(next);
            self.drive(cpu, next, &mut *analog);
            t = next;
        };
        let next_sample = self.circuit.parts.iter().filter_map(|part| part.next_sample(self.circuit.hz)).min();
        // Samples are taken after the chip has passed them, drives are queued before.
        let sample_cycle = next_sample.map_or(u64::MAX, |t| t.div_ceil(cycle));
        let until = queued.map_or_else(|| next.saturating_sub(LEAD_CYCLES), |t| t.div_ceil(cycle));
        let next_cycle = cpu.cycle().saturating_add(1);
        if self.circuit.shared { next_cycle } else { until.min(sample_cycle).max(next_cycle) }
    }

    /// Passes the edges of the last stretch to the bench in order, with everything that was due in it.
    fn apply_edges<C: Cpu>(&mut self, cpu: &mut C, analog: SetAnalogInput<'_, C>) {
        let cycle = u64::from(cpu.clocks_per_cycle());
        let clocks = |at: CycleTime| at.cycle.saturating_mul(cycle).saturating_add(at.phase.into());
        let mut last = None;
        for event in std::mem::take(&mut self.edges.seen) {
            if let ChipEvent::Edge { at, pin, level } = event {
                if let Some(wire) = self.pin_levels.get_mut(usize::from(pin)) {
                    *wire = level;
                }
                let then = self.pin_levels.clone();
                self.circuit.settle(cpu, clocks(at), &then, &mut *analog);
                last = Some(clocks(at));
            }
        }
        let now = cpu.cycle().saturating_mul(cycle);
        if let Some(last) = last.or(self.circuit.shared.then_some(now)) {
            self.circuit.settle(cpu, last, &[], &mut *analog);
        }
        self.pin_levels = crate::run::pin_levels(cpu, cpu.chip());
        for part in &mut self.circuit.parts {
            part.sample(now, self.circuit.hz);
            part.advance(now, self.circuit.hz);
        }
    }

    /// Executes the messages at an address; returns a verdict if one of them ends the run.
    fn messages<C: Cpu>(
        &mut self,
        cpu: &mut C,
        script: &CodScript,
        pc: u32,
        analog: SetAnalogInput<'_, C>,
    ) -> Option<CodVerdict> {
        let actions = script.by_address.get(&pc)?;
        let mut after: Vec<(&CodAction, &SimulatorMessage)> = Vec::new();
        for (action, message) in actions {
            match action {
                CodAction::Assert(assertion) => {
                    self.checked += 1;
                    let holds = match assertion.condition.as_ref().map(|expr| self.circuit.eval(expr, cpu)) {
                        None => false,
                        Some(Ok(value)) => value.to_bool() == Some(true) || matches!(value, CodValue::Text(_)),
                        Some(Err(cause)) => return Some(CodVerdict::Refused(refusal(message, cause))),
                    };
                    if !holds {
                        let is_broken =
                            assertion.condition.as_ref().map(|expr| (message.text.clone(), self.values(expr, cpu)));
                        return Some(CodVerdict::Message {
                            text: assertion.text.clone(),
                            failed_assertion: is_broken,
                            pc,
                            cycle: cpu.cycle(),
                        });
                    }
                }
                CodAction::Before(_) => {
                    if let Some(verdict) = self.execute_action(cpu, action, message, &mut *analog) {
                        return Some(verdict);
                    }
                }
                CodAction::After(_) => after.push((action, message)),
            }
        }
        if !after.is_empty() {
            let stop = cpu.step(&mut dyn_probe::probe_events(&mut self.edges));
            self.apply_edges(cpu, &mut *analog);
            if let StopReason::Error(error) = stop {
                return Some(CodVerdict::Error(error));
            }
        }
        after.into_iter().find_map(|(action, message)| self.execute_action(cpu, action, message, &mut *analog))
    }

    /// Returns the names in an expression with their current values.
    fn values<C: Cpu>(&self, expr: &CodExpression, cpu: &C) -> Vec<NamedText> {
        let value = |name: &str| self.circuit.eval(&CodExpression::Name(name.to_owned()), cpu);
        let named = |name: &str| Some(NamedText { name: name.to_owned(), value: value(name).ok()?.to_string() });
        expr.names().into_iter().filter_map(named).collect()
    }

    fn execute_action<C: Cpu>(
        &mut self,
        cpu: &mut C,
        action: &CodAction,
        message: &SimulatorMessage,
        analog: SetAnalogInput<'_, C>,
    ) -> Option<CodVerdict> {
        let (CodAction::Before(command) | CodAction::After(command)) = action else { return None };
        let t = cpu.cycle().saturating_mul(u64::from(cpu.clocks_per_cycle()));
        if let Err(cause) = self.circuit.command(command, cpu, t) {
            return Some(CodVerdict::Refused(refusal(message, cause)));
        }
        self.circuit.settle(cpu, t, &[], analog);
        None
    }
}
