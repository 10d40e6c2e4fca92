//! `emu debug --scenario`: queues the stimuli of a scenario before the first cycle, so that they are repeated
//! when the history is executed again. A scenario that expects or waits is first played to its end on a copy
//! of the machine, because the times of its steps are known only then.

use super::command_error::CommandError;
use std::collections::BTreeSet;

use diag::Diagnostic;
use emu_check::{ArrivalWindow, EvaluatorPlay, ScanInputs, byte_edges};
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_debug::chip_scenario::{ChipBindings, ChipResolver, timed_drives};
use emu_debug::debug::{
    DebugSession, DynMachine, MachineWithDevices, NameScope, ObserveLevel, RunGoal, SessionOptions, SessionStopReason,
    TimedAction, UserAction,
};
use emu_debug::run::run_with_devices;
use emu_debug::stimulus::{ExternalDrive, SupplyChange, check_drive_supported};
use emu_debug::{AddressNames, AttachedDevices, CycleClock, RunPlan, TimedDrive};
use ladder_compile::SpecialPin;
use ladder_view::LadderView;
use scenario::{ScenarioOutcome, ScenarioVerdict, bind};

use crate::shared::fail::VerbFailure;
use crate::shared::scenarios::ScenarioFile;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::{avr, family, output};
use crate::verbs::run::scenario::{ScenarioHost, ScenarioSetup};

/// Maximum number of machine cycles, in addition to periods, until a chip begins its first scan.
const RESET_CYCLES: u64 = 2_000_000;

/// Maximum number of periods until the next scan has ended.
const MAX_PERIODS: u64 = 4;

/// The environment of the machine that plays a scenario.
pub(super) struct ScenarioContext<'a> {
    /// The file of the program.
    pub program: &'a str,
    pub names: AddressNames<'a>,
    pub clock: CycleClock,
    /// Default bit rate of sent bytes, in bits per second.
    pub baud: u64,
    /// `--uart-in` uses the serial line to the chip.
    pub serial_line_taken: bool,
    /// Pins that the command line and devices drive.
    pub driven: Vec<PinId>,
    /// Changes of the supply by the command line: time and millivolts.
    pub supplies: Vec<SupplyChange>,
    pub snapshot_writer: SnapshotWriter,
}

impl ScenarioContext<'_> {
    /// Returns why bytes cannot be sent, or `None` if they can.
    fn no_serial_reason(&self) -> Option<String> {
        self.serial_line_taken.then(|| "--uart-in already uses the line".to_owned())
    }
}

/// Returns the drives of a scenario, and prints how the scenario ends.
pub(super) fn scenario_drives<C: Cpu + 'static>(
    file: &ScenarioFile,
    view: Option<&LadderView>,
    (cpu, board): (C, AttachedDevices),
    around: &ScenarioContext<'_>,
) -> Result<Vec<TimedDrive>, VerbFailure> {
    if let Some(view) = view {
        match LadderPlayback::new(file, view, around) {
            Ok(scans) => return scans.play(file, Box::new(MachineWithDevices::new(cpu, board))),
            // A recording of a session with a ladder program names pins.
            Err(faults) if faults.iter().any(|fault| fault.code == scenario::UNKNOWN_NAME) => {
                return drives_on_image(file, (cpu, board), around).map_err(|other| match other {
                    VerbFailure::Refused(all, _) if all.iter().any(|fault| fault.code == scenario::UNKNOWN_NAME) => {
                        file.binding_failure(faults)
                    }
                    other => other,
                });
            }
            Err(faults) => return Err(file.binding_failure(faults)),
        }
    }
    drives_on_image(file, (cpu, board), around)
}

/// Returns the drives of a scenario for an image: on pins, at clocks, as in `emu run`.
fn drives_on_image<C: Cpu>(
    file: &ScenarioFile,
    (mut cpu, mut board): (C, AttachedDevices),
    around: &ScenarioContext<'_>,
) -> Result<Vec<TimedDrive>, VerbFailure> {
    let (chip, clock) = (cpu.chip(), around.clock);
    let refused = |faults| file.binding_failure(faults);
    let (bound, ahead, table) = {
        let there = |space: &str, addr: u32| cpu.peek(space, addr).is_some();
        let has_pin = |pin: PinId| cpu.has_pin(pin);
        let own = |name: &str| avr::chip_pin_text(chip, name);
        let mut resolver = ChipResolver {
            names: around.names,
            clock,
            has_byte: &there,
            has_pin: &has_pin,
            check_drive: &|put| check_drive_supported(&cpu, put),
            canonical_pin_name: &own,
            serial: (family::has_uart(chip), family::receive_pin(chip)),
            no_snapshots: Some("a session writes its snapshots by `save`".to_owned()),
            no_serial_input: around.no_serial_reason(),
            bindings: ChipBindings::default(),
        };
        let bound = bind(&file.scenario, &mut resolver, Some(around.program), Some(chip.name)).map_err(refused)?;
        bound.require_external_stimuli(&|id| resolver.bindings.is_external_drive(id)).map_err(refused)?;
        let ahead = timed_drives(&file.scenario, &mut resolver, Some(around.program), around.baud);
        (bound, ahead, resolver.bindings)
    };
    if let Ok(drives) = ahead {
        let last = drives.last().map_or(0, |drive| drive.at.cycle);
        let end = format!("up to cycle {last} ({} s)", clock.seconds(last));
        output::print_to_stderr(&format!("scenario: nothing is expected; queued {} drive(s) {end}\n", drives.len()));
        return Ok(drives);
    }
    let plan = RunPlan { limit: bound.max_cycles(clock.clocks_per_cycle), ..RunPlan::default() };
    let setup = ScenarioSetup {
        bindings: table,
        supplies: around.supplies.clone(),
        deciding: Some(bound),
        stimuli: Vec::new(),
        baud: around.baud,
        recorder: None,
        snapshot_writer: around.snapshot_writer.clone(),
    };
    let mut keep_running = |_: &[u8]| true;
    let mut host = ScenarioHost::new(chip, clock, setup, &mut keep_running)?;
    host.drives = Some(Vec::new());
    host.start(&mut cpu);
    let ended = run_with_devices(&mut board, &mut cpu, &plan, None, &mut host);
    if let Some(verdict) = host.end_scenario(&mut cpu, &ended.uart, "the run ended") {
        let cycle = verdict.tick / u64::from(clock.clocks_per_cycle.max(1));
        report_verdict(file, &verdict, (cycle, &format!("{} s", clock.seconds(cycle))));
    }
    let mut queued = host.drives.take().unwrap_or_default();
    // Keep the drives up to the end of the scenario, and the rest of a byte that has begun.
    let (end, line) = (CycleTime::at(cpu.cycle()), family::receive_pin(chip));
    queued.retain(|drive| drive.at <= end || line.is_some() && drive.pin() == line);
    queued.sort_by_key(|drive| drive.at);
    Ok(queued)
}

/// Runs to a program word and returns the cycle, or `None` if the word is not reached before `until`.
fn run_to_word(session: &mut DebugSession, word: u32, until: u64) -> Option<u64> {
    let goal = RunGoal { until: Some(until), words: BTreeSet::from([word]), runs_while_halted: false };
    (session.run(&goal, &mut || true) == SessionStopReason::Done).then(|| session.machine().cycle())
}

/// Prints how a scenario ended.
fn report_verdict(file: &ScenarioFile, verdict: &ScenarioVerdict, (cycle, moment): (u64, &str)) {
    let end = match verdict.outcome {
        ScenarioOutcome::Passed => {
            output::print_to_stderr(&format!(
                "scenario: passed, {} step(s), up to cycle {cycle} ({moment})\n",
                file.steps()
            ));
            return;
        }
        ScenarioOutcome::Failed => "failed",
        ScenarioOutcome::NoResult => "had no result",
    };
    let step = verdict.step.map_or_else(String::new, |step| format!("step {step} (line {}) ", verdict.pos.line));
    let why = verdict.why.trim_end_matches(',');
    output::print_to_stderr(&format!("scenario: {step}{end} at cycle {cycle} ({moment}): {why}\n"));
}

/// Plays a scenario of a ladder program scan by scan: the evaluator plays it, and the chip runs in parallel
/// and supplies the values of its symbols.
struct LadderPlayback<'a> {
    play: EvaluatorPlay,
    view: &'a LadderView,
    around: &'a ScenarioContext<'a>,
    /// The inputs of the last scan.
    last: ScanInputs,
}

impl<'a> LadderPlayback<'a> {
    fn new(
        file: &ScenarioFile,
        view: &'a LadderView,
        around: &'a ScenarioContext<'a>,
    ) -> Result<LadderPlayback<'a>, Vec<Diagnostic>> {
        let mut play = EvaluatorPlay::new(view.program())?;
        play.resolver().cannot_send_reason = around.no_serial_reason();
        let bound = bind(&file.scenario, play.resolver(), Some(&view.program().file), Some(around.names.chip.name))?;
        let resolver = play.resolver();
        bound.require_external_stimuli(&|id| resolver.is_external_input(id))?;
        play.add_scenario(bound);
        let last = ScanInputs { levels: Vec::new(), conversions: Vec::new(), byte: None, arrival_scans: 0 };
        Ok(LadderPlayback { play, view, around, last })
    }

    /// Returns all drives with their times: each is applied after the end of a scan, before the next.
    fn play(mut self, file: &ScenarioFile, target: Box<dyn DynMachine>) -> Result<Vec<TimedDrive>, VerbFailure> {
        let (map, chip) = (self.view.map(), self.around.names.chip);
        let options = SessionOptions { clock: self.around.clock, max_copy_bytes: 0, follower: None };
        let mut session = DebugSession::new(target, NameScope::new(chip), options);
        let places: Vec<_> = self.view.symbols().into_iter().map(|(_, place)| place).collect();
        let period = map.cycle.num / map.cycle.den.max(1);
        let (start, end) = (self.view.scan_start(), map.scan_end / chip.word_bytes.max(1));
        let mut begun: Option<u64> = None;
        let why = loop {
            let read = |symbol: usize| {
                places.get(symbol).and_then(|place| place.value(session.machine())).map_or(0, |value| value as i32)
            };
            let goes_on = self.play.scan_with_chip(Some(&read));
            self.play.take_log().iter().for_each(|line| output::print_to_stderr(&format!("{line}\n")));
            if !goes_on {
                break "it was stopped";
            }
            let first = begun.is_none() && session.machine().pc() == start;
            self.drive_changes(&mut session, begun, (period, start))
                .map_err(|why| VerbFailure::Usage(why.to_string()))?;
            let until = session.machine().cycle().saturating_add(MAX_PERIODS * period + RESET_CYCLES);
            // AP101 begins with its program, so its first scan begins at once.
            begun = if first { Some(session.machine().cycle()) } else { run_to_word(&mut session, start, until) };
            // If a scan ends at its first instruction, there is nothing more to run.
            if begun.is_none() || (first || end != start) && run_to_word(&mut session, end, until).is_none() {
                break "the chip did not reach the end of a scan";
            }
        };
        let verdict = self.play.finish(why);
        report_verdict(file, &verdict, (session.machine().cycle(), &verdict.tick_text));
        let drive = |event: TimedAction<'_>| match event.action {
            UserAction::Drive(drive) => Some(*drive),
            _ => None,
        };
        Ok(session.input_events().filter_map(drive).collect())
    }

    /// Applies the inputs that have changed. `begun` is the start cycle of the scan that has ended.
    fn drive_changes(
        &mut self,
        session: &mut DebugSession,
        begun: Option<u64>,
        (period, start): (u64, u32),
    ) -> Result<(), CommandError> {
        let next = self.play.scan_inputs();
        let (chip, at) = (self.around.names.chip, CycleTime::at(session.machine().cycle()));
        let pin = |name: &str| chip.pin(&self.view.pin_assignment(name));
        let mut puts = Vec::new();
        // Inputs are low at first.
        for (name, level) in &next.levels {
            let old = self.last.levels.iter().find(|(other, _)| other == name).is_some_and(|(_, level)| *level);
            puts.extend(
                pin(name).filter(|_| old != *level).map(|pin| ExternalDrive::Level(pin, PinLevel::from_bit(*level))),
            );
        }
        for (name, count) in &next.conversions {
            let old = self.last.conversions.iter().find(|(other, _)| other == name).map(|(_, count)| *count);
            let mine = |pin: &PinId| old.is_some() || !self.around.driven.contains(pin);
            puts.extend(
                pin(name).filter(|_| old != Some(*count)).filter(mine).map(|pin| ExternalDrive::Counts(pin, *count)),
            );
        }
        for put in puts {
            session.apply_action(UserAction::Drive(TimedDrive { at, drive: put }))?;
        }
        if let Some(byte) = next.byte {
            self.send(session, byte, next.arrival_scans, begun, (period, start))?;
        }
        self.last = next;
        Ok(())
    }

    /// Sends a byte to the chip such that it arrives while the chip waits for a scan.
    fn send(
        &self,
        session: &mut DebugSession,
        byte: u8,
        arrives: u64,
        begun: Option<u64>,
        (period, start): (u64, u32),
    ) -> Result<(), CommandError> {
        let line = self.view.map().specials.iter().find_map(|special| match special {
            SpecialPin::Receive { pin, baud } => Some((self.around.names.chip.pin(pin)?, *baud)),
            _ => None,
        });
        let Some((pin, baud)) = line else { return Ok(()) };
        // Before its first scan the chip does not listen: a copy of the machine finds the cycle of that scan.
        let begun = begun.unwrap_or_else(|| {
            let mut copy = session.machine().fork();
            copy.set_breakpoints(&BTreeSet::from([start]));
            copy.run(copy.cycle().saturating_add(MAX_PERIODS * period + RESET_CYCLES), ObserveLevel::Nothing, &mut ());
            copy.cycle().saturating_sub(period)
        });
        let clocks = u64::from(self.around.clock.clocks_per_cycle.max(1));
        let busy = u64::from(self.view.map().worst_scan_cycles).saturating_add(self.view.map().poll_cycles.into());
        let slot = ArrivalWindow {
            hz: self.around.clock.hz,
            baud,
            now: session.machine().cycle().max(begun).saturating_add(1).saturating_mul(clocks),
            scan: (begun.saturating_mul(clocks), busy.saturating_mul(clocks)),
            period: period.saturating_mul(clocks),
            scans_later: arrives + 1,
        };
        for (clock, high) in byte_edges(byte, slot) {
            let at = CycleTime { cycle: clock / clocks, phase: (clock % clocks) as u8 };
            session.apply_action(UserAction::Drive(TimedDrive {
                at,
                drive: ExternalDrive::Level(pin, PinLevel::from_bit(high)),
            }))?;
        }
        Ok(())
    }
}
