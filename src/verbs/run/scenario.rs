//! `emu run --scenario`, `--stimulus` and `--record`: scenarios on a chip with an image.
//!
//! A tick is one clock of the oscillator. Drives are queued ahead of their time, so that each acts in its own
//! clock. Conditions are evaluated between two instructions: after each edge of a pin that they name, and
//! after every instruction if they name memory.

mod flags;

use std::sync::Arc;

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, ResetCause};
use emu_core::pins::{CycleTime, PinLevel};
use emu_debug::chip_scenario::{ChipBindings, ChipObservable, ChipStimulus};
use emu_debug::stimulus::{ExternalDrive, INITIAL_SUPPLY_MV, SupplyChange, queue_drive};
use emu_debug::{CycleClock, RunController, RunDecision, SerialLineSender, StretchWatch, TimedDrive};
use scenario::{
    BoundScenario, MachineError, OutputReading, PlayerState, RecordedAction, Recorder, ScenarioError, ScenarioPlayer,
    ScenarioValue, ScenarioVerdict, ScenarioWorld,
};

pub use flags::ScenarioFlags;

use crate::shared::fail::VerbFailure;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::{family, output};

/// Number of machine cycles by which drives are queued ahead of their time.
const QUEUE_AHEAD_CYCLES: u64 = 1 << 10;

/// Runs scenarios on one machine.
pub struct ScenarioHost<'a> {
    chip: &'static Chip,
    clock: CycleClock,
    bindings: ChipBindings,
    /// The scenario that gives the verdict; the stimuli run in parallel.
    deciding_player: Option<ScenarioPlayer>,
    stimulus_players: Vec<ScenarioPlayer>,
    /// Sends bytes to the chip's serial receiver.
    sender: Option<SerialLineSender>,
    /// Changes of the supply: time, and voltage in millivolts.
    supplies: Vec<SupplyChange>,
    /// The tick at which the players run next.
    next_poll_tick: u64,
    started: bool,
    /// The verdict, once the deciding scenario has ended.
    pub verdict: Option<ScenarioVerdict>,
    /// Records the actions, if `--record` is given.
    pub recorder: Option<Recorder>,
    snapshot_writer: SnapshotWriter,
    /// The drives of pins and supply, if the caller wants to repeat them.
    pub drives: Option<Vec<TimedDrive>>,
    /// Returns false when the user stops the run. The argument is all bytes sent so far.
    pub keep_waiting: &'a mut dyn FnMut(&[u8]) -> bool,
}

/// The parts from which a [`ScenarioHost`] is built.
pub struct ScenarioSetup {
    /// The resolved names of pins and memory.
    pub bindings: ChipBindings,
    /// Changes of the supply from other flags: time, and voltage in millivolts.
    pub supplies: Vec<SupplyChange>,
    /// The scenario that gives the verdict, if there is one.
    pub deciding: Option<BoundScenario>,
    /// Stimuli that run in parallel and give no verdict.
    pub stimuli: Vec<BoundScenario>,
    /// Bits per second of sent bytes, unless the scenario gives another rate.
    pub baud: u64,
    /// Records the actions, if `--record` is given.
    pub recorder: Option<Recorder>,
    /// Writes the snapshots that a scenario requests.
    pub snapshot_writer: SnapshotWriter,
}

impl<'a> ScenarioHost<'a> {
    /// Creates the host, before anything has happened.
    ///
    /// # Errors
    /// The rate of `--baud` is impossible for a serial line. The rate of a scenario was checked when the
    /// scenario was bound.
    pub fn new(
        chip: &'static Chip,
        clock: CycleClock,
        setup: ScenarioSetup,
        keep_waiting: &'a mut dyn FnMut(&[u8]) -> bool,
    ) -> Result<ScenarioHost<'a>, VerbFailure> {
        let ScenarioSetup { bindings, supplies, deciding, stimuli, baud, recorder, snapshot_writer } = setup;
        let sends = deciding.iter().chain(&stimuli).any(|bound| bound.has_send_step);
        let baud = deciding.iter().find_map(|bound| bound.baud).unwrap_or(baud);
        let sender =
            family::receive_pin(chip).filter(|_| sends).map(|pin| SerialLineSender::new(pin, baud)).transpose();
        let sender = sender.map_err(|why| VerbFailure::invalid_flag_value("--baud <RATE>", &baud.to_string(), &why))?;
        let player = |bound: BoundScenario| ScenarioPlayer::new(Arc::new(bound));
        Ok(ScenarioHost {
            chip,
            clock,
            bindings,
            deciding_player: deciding.map(player),
            stimulus_players: stimuli.into_iter().map(player).collect(),
            sender,
            supplies,
            next_poll_tick: 0,
            started: false,
            verdict: None,
            recorder: recorder.map(|mut recorder| {
                recorder.baud = recorder.baud.or(sends.then_some(baud));
                recorder
            }),
            snapshot_writer,
            drives: None,
            keep_waiting,
        })
    }

    /// Performs the actions before the first cycle.
    pub fn start<C: Cpu>(&mut self, cpu: &mut C) {
        if let Some(sender) = &self.sender {
            let (at, pin) = (CycleTime::at(cpu.cycle()), sender.pin);
            cpu.drive(at, pin, PinLevel::High);
            self.note_drive(TimedDrive { at, drive: ExternalDrive::Level(pin, PinLevel::High) });
            let tick = cpu.cycle().saturating_mul(self.ticks_per_cycle());
            let name = self.chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name);
            self.record_action(tick, || RecordedAction::Set(name.to_owned(), ScenarioValue::Number(1)));
        }
        self.started = true;
        self.run_players(cpu, &[]);
    }

    /// Returns the number of ticks per machine cycle.
    fn ticks_per_cycle(&self) -> u64 {
        u64::from(self.clock.clocks_per_cycle.max(1))
    }

    /// Polls all players: each performs its actions that are due. Sets the tick of the next poll, and the
    /// verdict when the deciding scenario ends.
    fn run_players<C: Cpu>(&mut self, cpu: &mut C, sent: &[u8]) {
        let (mut deciding_player, mut stimulus_players) =
            (self.deciding_player.take(), std::mem::take(&mut self.stimulus_players));
        let mut next_tick = u64::MAX;
        let mut world = CpuWorld { host: self, cpu, sent };
        let mut verdict = None;
        for player in &mut stimulus_players {
            if let PlayerState::WakeAt(tick) = player.poll(&mut world) {
                next_tick = next_tick.min(tick);
            }
        }
        if let Some(player) = &mut deciding_player {
            match player.poll(&mut world) {
                PlayerState::WakeAt(tick) => next_tick = next_tick.min(tick),
                PlayerState::Done(reached) => verdict = Some(reached),
            }
        }
        (self.deciding_player, self.stimulus_players, self.next_poll_tick) =
            (deciding_player, stimulus_players, next_tick);
        self.verdict = self.verdict.take().or(verdict);
    }

    /// Returns the verdict; ends the scenario if the run ended first.
    pub fn end_scenario<C: Cpu>(&mut self, cpu: &mut C, sent: &[u8], why: &str) -> Option<ScenarioVerdict> {
        if self.verdict.is_none() {
            self.run_players(cpu, sent);
        }
        if let (None, Some(mut player)) = (&self.verdict, self.deciding_player.take()) {
            let world = CpuWorld { host: self, cpu, sent };
            self.verdict = Some(player.abort(&world, why));
        }
        self.verdict.clone()
    }

    /// Returns the text of the recording up to now.
    pub fn recording<C: Cpu>(&self, cpu: &C) -> Option<String> {
        self.recorder.as_ref().map(|recorder| recorder.write(cpu.cycle().saturating_mul(self.ticks_per_cycle())))
    }

    /// Returns the supply voltage at a time, in millivolts.
    fn supply(&self, time: CycleTime) -> u32 {
        let before = self.supplies.iter().filter(|change| change.at <= time);
        before
            .max_by_key(|SupplyChange { at, .. }| *at)
            .map_or(INITIAL_SUPPLY_MV, |SupplyChange { millivolts, .. }| *millivolts)
    }

    fn note_drive(&mut self, drive: TimedDrive) {
        if let Some(drives) = &mut self.drives {
            drives.push(drive);
        }
    }

    fn record_action(&mut self, tick: u64, action: impl FnOnce() -> RecordedAction) {
        if let Some(recorder) = &mut self.recorder {
            recorder.push(tick, action());
        }
    }
}

impl<C: Cpu> RunController<C> for ScenarioHost<'_> {
    fn next_decision(&mut self, cpu: &mut C, sent: &[u8], stretch_watch: &mut StretchWatch) -> RunDecision {
        if !(self.keep_waiting)(sent) {
            return RunDecision::StopWaiting;
        }
        self.run_players(cpu, sent);
        if self.verdict.is_some() {
            return RunDecision::Finished;
        }
        // A scenario that is not finished needs time to pass, even on a halted chip.
        cpu.set_run_while_halted(self.deciding_player.is_some() || self.next_poll_tick != u64::MAX);
        let now = cpu.cycle();
        stretch_watch.pins.clear();
        stretch_watch.bytes = false;
        let mut until = self.next_poll_tick.div_ceil(self.ticks_per_cycle());
        if let Some(player) = &self.deciding_player {
            stretch_watch.bytes = player.awaits_bytes();
            for output in player.watched_outputs() {
                match self.bindings.observables.get(output) {
                    Some(ChipObservable::Pin(pin)) => stretch_watch.pins.push(*pin),
                    // Registers of the chip can change without an instruction, so poll after each one.
                    Some(ChipObservable::Memory(..)) => until = now + 1,
                    None => {}
                }
            }
        }
        RunDecision::RunUntil(until.max(now + 1))
    }

    fn is_waiting(&self) -> bool {
        self.deciding_player.is_some() && self.verdict.is_none()
    }

    fn finish(&mut self, _: &mut C, sent: &[u8]) {
        (self.keep_waiting)(sent);
    }
}

/// The chip as a scenario sees it between two instructions.
struct CpuWorld<'f, 'a, C> {
    host: &'f mut ScenarioHost<'a>,
    cpu: &'f mut C,
    sent: &'f [u8],
}

impl<C: Cpu> CpuWorld<'_, '_, C> {
    /// Returns the tick and the time for an action requested at a tick. A tick that has passed becomes the
    /// current one, after the last instruction.
    fn drive_time(&self, tick: u64) -> (u64, CycleTime) {
        let (tick, per_cycle) = (tick.max(self.now()), self.host.ticks_per_cycle());
        (tick, CycleTime { cycle: tick / per_cycle, phase: (tick % per_cycle) as u8 })
    }
}

fn refused(why: impl Into<MachineError>) -> ScenarioError {
    ScenarioError::Refused(why.into())
}

impl<C: Cpu> ScenarioWorld for CpuWorld<'_, '_, C> {
    fn now(&self) -> u64 {
        self.cpu.cycle().saturating_mul(self.host.ticks_per_cycle())
    }

    fn queue_ahead_ticks(&self) -> u64 {
        QUEUE_AHEAD_CYCLES * self.host.ticks_per_cycle()
    }

    fn set_input(&mut self, input: usize, at: u64) -> Result<(), ScenarioError> {
        let Some((stimulus, name, value)) = self.host.bindings.stimuli.get(input).cloned() else { return Ok(()) };
        let (tick, time) = self.drive_time(at);
        match stimulus {
            ChipStimulus::Drive(drive) => {
                if let ExternalDrive::Supply(millivolts) = drive {
                    self.host.supplies.push(SupplyChange { at: time, millivolts });
                }
                queue_drive(self.cpu, TimedDrive { at: time, drive }, &mut self.host.supply(time)).map_err(refused)?;
                self.host.note_drive(TimedDrive { at: time, drive });
            }
            ChipStimulus::Poke(space, addr, bytes) => {
                for (addr, byte) in (addr..).zip(bytes) {
                    self.cpu.poke(space, addr, byte);
                }
            }
        }
        self.host.record_action(tick, || RecordedAction::Set(name, value));
        Ok(())
    }

    fn read_output(&self, output: usize) -> OutputReading {
        self.host
            .bindings
            .observables
            .get(output)
            .map_or(OutputReading::Floating, |observable| observable.read(self.cpu))
    }

    fn send(&mut self, bytes: &[u8], at: u64) -> Result<(), ScenarioError> {
        let ((tick, time), clock) = (self.drive_time(at), self.host.clock);
        let Some(sender) = &mut self.host.sender else { return Ok(()) };
        for drive in sender.edges_of_bytes(clock, time, bytes).map_err(refused)? {
            queue_drive(self.cpu, drive, &mut self.host.supply(time)).map_err(refused)?;
            self.host.note_drive(drive);
        }
        self.host.record_action(tick, || RecordedAction::Send(bytes.to_vec()));
        Ok(())
    }

    fn received(&self) -> &[u8] {
        self.sent
    }

    fn power_cycle(&mut self) -> Result<(), ScenarioError> {
        self.cpu.reset(ResetCause::PowerOn);
        let now = self.now();
        self.host.record_action(now, || RecordedAction::PowerCycle);
        Ok(())
    }

    fn snapshot(&mut self, file: &str) -> Result<(), ScenarioError> {
        let written = self.host.snapshot_writer.write_within(file, self.cpu.cycle(), &self.cpu.save());
        written.map_err(|failure| refused(format!("no snapshot was written: {}", failure.sentence())))
    }

    fn log(&mut self, line: &str) {
        let moment = self.describe_tick(self.now());
        output::print_to_stderr(&format!("{moment}: {line}\n"));
    }

    fn describe_tick(&self, tick: u64) -> String {
        let cycle = tick / self.host.ticks_per_cycle();
        format!("cycle {cycle} ({} s)", self.host.clock.seconds(cycle))
    }
}
