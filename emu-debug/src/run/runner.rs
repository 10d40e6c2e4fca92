//! The runner: runs until a condition, a limit, the end of the program, or its fault.

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, Probe, ProgramError, StopReason};
use emu_core::pins::{PinId, PinLevel};

use crate::devices::attached_devices::AttachedDevices;
use crate::names::address_names::AddressRange;
use crate::probes::access_monitor::{AccessMonitor, AccessWatch, RamCheck, WatchedAccess};
use crate::probes::combined_probe::{CombinedProbe, DynRunProbe};
use crate::probes::lints::{LintFinding, LintProbe};
use crate::probes::run_probes::RunProbes;
use crate::probes::uart_log::UartLog;
use crate::probes::waveform::WaveWriter;
use crate::run::run_controller::{
    CYCLES_BETWEEN_DECISIONS, ContinueCallback, RunController, RunDecision, StretchWatch,
};
use crate::run::stop_condition::StopCondition;
use crate::text::time::CycleClock;
use crate::trace::{self, TraceProbe};

/// The conditions that end a run.
#[derive(Debug, Clone, Default)]
pub struct RunPlan {
    /// Machine cycle at which the run ends at the latest.
    pub limit: u64,
    /// Conditions; any of them ends the run.
    pub until: Vec<StopCondition>,
    /// A text in the serial output that ends the run with success, unless the controller still waits
    /// ([`RunController::is_waiting`]).
    pub expect: Option<Vec<u8>>,
    /// A text in the serial output that ends the run with failure.
    pub fail: Option<Vec<u8>>,
    /// A read of unwritten RAM ends the run as a fault.
    pub stop_on_unwritten_read: bool,
    /// Ranges of data memory that the image initializes; they count as written.
    pub initialized: Vec<AddressRange>,
    /// The machine continues in another run, so a byte that is not completely sent belongs to that run.
    pub continues: bool,
    /// Suspicious behaviour of the program is collected.
    pub lint: bool,
}

/// Why a run ended. A fault of the program overrides conditions, and the text of [`RunPlan::fail`] overrides
/// other texts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunEnd {
    /// The run reached the cycle [`RunPlan::limit`].
    Limit,
    /// The program has ended: nothing can wake the chip any more.
    Halted,
    /// A condition of [`RunPlan::until`] became true, by its index; with the access if it waited for one.
    Until(usize, Option<WatchedAccess>),
    /// The chip sent the text of [`RunPlan::expect`].
    Expected,
    /// The chip sent the text of [`RunPlan::fail`].
    Failed,
    /// The program cannot continue, or read unwritten memory.
    Error(ProgramError),
    /// The controller stopped waiting ([`RunDecision::StopWaiting`]), or the trace or the waveform cannot be
    /// written.
    StoppedWaiting,
    /// The user interrupted the run. The runner does not return this: its caller puts it in place of
    /// [`RunEnd::StoppedWaiting`].
    Interrupted,
    /// The controller has finished.
    Finished,
}

/// The result of a run.
#[derive(Debug)]
pub struct RunResult {
    /// Why the run ended.
    pub reason: RunEnd,
    /// The bytes that the chip sent over its first serial port.
    pub uart: Vec<u8>,
    /// Pins with contention between chip and outside, each with its first machine cycle.
    pub contention: Vec<(PinId, u64)>,
    /// Suspicious behaviour, with [`RunPlan::lint`].
    pub lints: Vec<LintFinding>,
    /// Why the requested waveform could not be written.
    pub wave_error: Option<std::io::Error>,
}

/// Runs `cpu` according to `plan`. Writes and ends `wave`; calls `keep_waiting` with all bytes sent so far
/// before the first cycle, every few million cycles and at the end, and ends the run if it returns false.
pub fn run<C: Cpu>(
    cpu: &mut C,
    plan: &RunPlan,
    wave: Option<WaveWriter>,
    keep_waiting: &mut dyn FnMut(&[u8]) -> bool,
) -> RunResult {
    let clock = CycleClock { hz: 1, clocks_per_cycle: cpu.clocks_per_cycle() };
    run_with_devices(&mut AttachedDevices::new(Vec::new(), clock), cpu, plan, wave, &mut ContinueCallback(keep_waiting))
}

/// Runs `cpu` as [`run`] does, with devices at its pins. `controller` decides before each stretch whether and
/// how far the run continues.
pub fn run_with_devices<C: Cpu>(
    devices: &mut AttachedDevices,
    cpu: &mut C,
    plan: &RunPlan,
    wave: Option<WaveWriter>,
    controller: &mut dyn RunController<C>,
) -> RunResult {
    let machine = ConnectedMachine { cpu, devices };
    run_with_probe(machine, plan, wave, ExtraProbes { extra: &mut (), trace: None }, controller)
}

/// Reads a byte of a memory, by the memory's name and address: [`Cpu::peek`].
pub type ReadMemory<'a> = &'a dyn Fn(&str, u32) -> Option<u8>;

/// An additional probe of a run. Of its constants only [`Probe::INSN`], [`Probe::EVERY_ITERATION`] and
/// [`Probe::FLOW`] may be true.
pub trait RunProbe: Probe {
    /// Called when the run is at a breakpoint that the plan does not wait for, before the instruction at the
    /// program word `pc`; the run continues.
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        let _ = (memory, pc);
    }
}

impl RunProbe for () {}

/// A machine with the devices at its pins.
pub struct ConnectedMachine<'a, C> {
    /// The machine.
    pub cpu: &'a mut C,
    /// The devices.
    pub devices: &'a mut AttachedDevices,
}

/// Probes of a run in addition to those of its plan.
pub struct ExtraProbes<'a, 't, A: ?Sized> {
    /// A probe of the caller; `()` for none.
    pub extra: &'a mut A,
    /// Traces each instruction.
    pub trace: Option<&'a mut TraceProbe<'t>>,
}

/// Calls [`run_with_devices`] with an additional probe, and traces each instruction with `trace`.
pub fn run_with_probe<C: Cpu, A: RunProbe>(
    machine: ConnectedMachine<'_, C>,
    plan: &RunPlan,
    wave: Option<WaveWriter>,
    probes: ExtraProbes<'_, '_, A>,
    controller: &mut dyn RunController<C>,
) -> RunResult {
    let ExtraProbes { extra, trace } = probes;
    if plan.needs_every_access() || trace.is_some() {
        return run_with_all_observers(machine, plan, wave, ExtraProbes { extra, trace }, controller);
    }
    run_until_end(machine, plan, wave, extra, controller)
}

/// Runs with the observers of the plan and the trace, in addition to the additional probe. It is compiled
/// once for all additional probes.
fn run_with_all_observers<C: Cpu>(
    machine: ConnectedMachine<'_, C>,
    plan: &RunPlan,
    wave: Option<WaveWriter>,
    probes: ExtraProbes<'_, '_, dyn DynRunProbe + '_>,
    controller: &mut dyn RunController<C>,
) -> RunResult {
    let AccessProbes { monitor, lints } = plan.access_probes(machine.cpu);
    let mut combined = CombinedProbe { access_monitor: monitor, lints, trace: probes.trace, run_probe: probes.extra };
    let ended = run_until_end(machine, plan, wave, &mut combined, controller);
    RunResult { lints: combined.lints.map_or_else(Vec::new, LintProbe::into_findings), ..ended }
}

/// The observer of a run, as seen by its loop.
trait RunObserver: Probe + Sized {
    /// Calls [`RunProbe::on_breakpoint_passed`].
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32);
    /// Returns why the run ends, if this observer ends it.
    fn end_reason(&self, plan: &RunPlan) -> Option<RunEnd>;
    /// Runs the machine as [`Cpu::run`] does; it may also stop without a request, so that its observations
    /// are checked.
    fn run_machine<C: Cpu>(cpu: &mut C, until: u64, probes: &mut RunProbes<&mut Self>) -> StopReason;
}

impl<A: RunProbe> RunObserver for A {
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        RunProbe::on_breakpoint_passed(self, memory, pc);
    }

    fn end_reason(&self, _: &RunPlan) -> Option<RunEnd> {
        None
    }

    fn run_machine<C: Cpu>(cpu: &mut C, until: u64, probes: &mut RunProbes<&mut Self>) -> StopReason {
        cpu.run(until, probes)
    }
}

impl RunObserver for CombinedProbe<'_, '_> {
    fn on_breakpoint_passed(&mut self, memory: ReadMemory<'_>, pc: u32) {
        self.run_probe.on_breakpoint_passed(memory, pc);
    }

    fn end_reason(&self, plan: &RunPlan) -> Option<RunEnd> {
        // A trace that can no longer be written ends the run.
        let failed = self.trace.as_ref().is_some_and(|trace| trace.has_failed());
        plan.end_reason(&self.access_monitor).or(failed.then_some(RunEnd::StoppedWaiting))
    }

    fn run_machine<C: Cpu>(cpu: &mut C, until: u64, probes: &mut RunProbes<&mut Self>) -> StopReason {
        if probes.inner.trace.is_some() { trace::run_traced(cpu, until, probes) } else { cpu.run(until, probes) }
    }
}

/// Returns the levels of all pins of a chip, in the order of its pins.
pub fn pin_levels<C: Cpu>(cpu: &C, chip: &Chip) -> Vec<PinLevel> {
    (0..chip.pins.len() as PinId).map(|pin| cpu.pin_level(pin)).collect()
}

/// Returns the levels of all pins; `None` for pins that are not shown ([`Cpu::pins_to_show`]).
pub fn shown_pin_levels<C: Cpu>(cpu: &C, chip: &Chip) -> Vec<Option<PinLevel>> {
    let mut levels = vec![None; chip.pins.len()];
    for pin in cpu.pins_to_show() {
        if let Some(shown) = levels.get_mut(usize::from(pin)) {
            *shown = Some(cpu.pin_level(pin));
        }
    }
    levels
}

/// The probes that observe every instruction and access.
struct AccessProbes {
    /// The probe of watched accesses and fetches.
    monitor: AccessMonitor,
    /// The probe of lints, if the plan asks for it.
    lints: Option<LintProbe>,
}

/// A watched access of an end condition.
struct NumberedWatch {
    /// The position of the condition in the plan.
    condition: usize,
    /// The access.
    watch: AccessWatch,
}

/// An awaited fetch of an end condition.
#[derive(Debug, Clone, Copy)]
struct NumberedFetch {
    /// The position of the condition in the plan.
    condition: usize,
    /// The program word.
    pc: u32,
}

/// The texts that end a run.
struct AwaitedTexts {
    /// The texts.
    texts: Vec<Vec<u8>>,
    /// Why the run ends at each of them.
    ends: Vec<RunEnd>,
}

impl RunPlan {
    /// Returns true if every instruction and every access must be observed.
    fn needs_every_access(&self) -> bool {
        let is_access = |until: &StopCondition| {
            matches!(until, StopCondition::Read(_) | StopCondition::Write(_) | StopCondition::Fetch(_))
        };
        self.stop_on_unwritten_read || self.lint || self.until.iter().any(is_access)
    }

    /// Returns the probes that observe every instruction and access for the plan.
    fn access_probes<C: Cpu>(&self, cpu: &C) -> AccessProbes {
        let ram =
            RamCheck { canonical_address: &|addr| cpu.canonical_ram_address(addr), initialized: &self.initialized };
        let watches = self.watches().into_iter().map(|NumberedWatch { watch, .. }| watch).collect();
        let monitor = AccessMonitor::new(cpu.chip(), watches, self.stop_on_unwritten_read.then_some(&ram));
        let monitor =
            monitor.with_fetches(self.awaited_fetches().into_iter().map(|NumberedFetch { pc, .. }| pc).collect());
        AccessProbes { monitor, lints: self.lint.then(|| LintProbe::new(cpu.chip(), &ram)) }
    }

    /// Returns why the run ends, if an access or a fetch ends it.
    fn end_reason(&self, monitor: &AccessMonitor) -> Option<RunEnd> {
        let fault = monitor.unwritten_read.map(|(pc, fault)| RunEnd::Error(ProgramError::Fault { pc, fault }));
        let access =
            || monitor.first_access.and_then(|a| Some(RunEnd::Until(self.watches().get(a.watch)?.condition, Some(a))));
        let fetched =
            || monitor.seen_fetch.and_then(|i| Some(RunEnd::Until(self.awaited_fetches().get(i)?.condition, None)));
        fault.or_else(access).or_else(fetched)
    }

    /// Returns the watched accesses, each with the position of its condition.
    fn watches(&self) -> Vec<NumberedWatch> {
        let numbered = |condition, range: &AddressRange, write| {
            Some(NumberedWatch { condition, watch: AccessWatch { range: *range, write } })
        };
        let watch = |(i, until): (usize, &StopCondition)| match until {
            StopCondition::Read(range) => numbered(i, range, false),
            StopCondition::Write(range) => numbered(i, range, true),
            _ => None,
        };
        self.until.iter().enumerate().filter_map(watch).collect()
    }

    /// Returns the awaited fetches: condition and program word.
    fn awaited_fetches(&self) -> Vec<NumberedFetch> {
        let fetch = |(i, until): (usize, &StopCondition)| match until {
            StopCondition::Fetch(pc) => Some(NumberedFetch { condition: i, pc: *pc }),
            _ => None,
        };
        self.until.iter().enumerate().filter_map(fetch).collect()
    }

    /// Returns the awaited texts, and why the run ends at each.
    fn awaited_texts(&self) -> AwaitedTexts {
        let fail = self.fail.iter().map(|text| (text.clone(), RunEnd::Failed));
        let expect = self.expect.iter().map(|text| (text.clone(), RunEnd::Expected));
        let until = self.until.iter().enumerate().filter_map(|(i, until)| match until {
            StopCondition::Uart(text) => Some((text.clone(), RunEnd::Until(i, None))),
            _ => None,
        });
        let (texts, ends) = fail.chain(expect).chain(until).unzip();
        AwaitedTexts { texts, ends }
    }
}

/// Runs the machine until a condition of the plan, an observer or the controller ends the run.
fn run_until_end<C: Cpu, L: RunObserver>(
    machine: ConnectedMachine<'_, C>,
    plan: &RunPlan,
    wave: Option<WaveWriter>,
    observer: &mut L,
    controller: &mut dyn RunController<C>,
) -> RunResult {
    let ConnectedMachine { cpu, devices } = machine;
    let AwaitedTexts { texts, ends: end_of_text } = plan.awaited_texts();
    let (mut pins, mut pin_conditions) = (Vec::new(), Vec::new());
    for (i, until) in plan.until.iter().enumerate() {
        match until {
            StopCondition::Pc(pc) => cpu.set_breakpoint(*pc, true),
            StopCondition::Line(_, words) => words.iter().for_each(|pc| cpu.set_breakpoint(*pc, true)),
            StopCondition::Pin(pin, level) => {
                pins.push((*pin, *level));
                pin_conditions.push(i);
            }
            StopCondition::Fetch(_) | StopCondition::Read(_) | StopCondition::Write(_) | StopCondition::Uart(_) => {}
        }
    }
    let found_pin = pins.iter().position(|&(pin, level)| cpu.pin_level(pin) == level);
    let mut probes = RunProbes {
        uart: UartLog::new(texts),
        found_text: None,
        awaited_pins: pins,
        found_pin,
        contention: Vec::new(),
        wave,
        inner: observer,
        stretch_watch: StretchWatch::default(),
    };
    let observed_end = |probes: &RunProbes<&mut L>| {
        let text = probes.found_text.and_then(|i| end_of_text.get(i).copied());
        // A waveform that can no longer be written ends the run.
        let wave_failed = probes.wave.as_ref().is_some_and(WaveWriter::has_failed).then_some(RunEnd::StoppedWaiting);
        let pin = || probes.found_pin.and_then(|i| pin_conditions.get(i)).map(|&i| RunEnd::Until(i, None));
        probes.inner.end_reason(plan).or(text).or_else(pin).or(wave_failed)
    };
    let reason = loop {
        match observed_end(&probes) {
            Some(RunEnd::Expected) if controller.is_waiting() => probes.found_text = None,
            Some(reason) => break reason,
            None => {}
        }
        probes.stretch_watch.triggered = false;
        let until = match controller.next_decision(cpu, &probes.uart.sent, &mut probes.stretch_watch) {
            RunDecision::RunUntil(cycle) => {
                plan.limit.min(cycle).min(cpu.cycle().saturating_add(CYCLES_BETWEEN_DECISIONS))
            }
            RunDecision::StopWaiting => break RunEnd::StoppedWaiting,
            RunDecision::Finished => {
                // Shows the effect of the last actions.
                devices.run_with(cpu, cpu.cycle(), &mut probes, L::run_machine);
                break RunEnd::Finished;
            }
        };
        let stop = devices.run_with(cpu, until, &mut probes, L::run_machine);
        if let Some(reason) = observed_end(&probes).filter(|reason| *reason != RunEnd::Expected) {
            break reason;
        }
        match stop {
            StopReason::Limit if cpu.cycle() >= plan.limit => break RunEnd::Limit,
            StopReason::Limit | StopReason::Probe => {}
            StopReason::Halted => break RunEnd::Halted,
            StopReason::Error(error) => break RunEnd::Error(error),
            StopReason::Breakpoint { pc } => {
                let is_reached = |until: &StopCondition| match until {
                    StopCondition::Pc(word) => *word == pc,
                    StopCondition::Line(_, words) => words.contains(&pc),
                    _ => false,
                };
                if let Some(i) = plan.until.iter().position(is_reached) {
                    break RunEnd::Until(i, None);
                }
                probes.inner.on_breakpoint_passed(&|space, addr| cpu.peek(space, addr), pc);
            }
        }
    };
    // The byte in its stop bit counts: the chip has reported it to the program as sent.
    let last = cpu.byte_in_stop_bit().filter(|_| !plan.continues).and_then(|byte| probes.uart.push_byte(byte));
    let reason = match last.and_then(|text| end_of_text.get(text)) {
        Some(RunEnd::Failed) if !matches!(reason, RunEnd::Error(_)) => RunEnd::Failed,
        Some(&text) if matches!(reason, RunEnd::Limit | RunEnd::Halted | RunEnd::Until(..)) => text,
        _ => reason,
    };
    controller.finish(cpu, &probes.uart.sent);
    let wave_error = probes.wave.take().and_then(|wave| wave.finish(cpu.cycle()).err());
    RunResult { reason, uart: probes.uart.sent, contention: probes.contention, lints: Vec::new(), wave_error }
}
