//! Scenario flags of `emu run`, and the setup of scenarios before the first cycle.

use clap::Args;
use emu_core::chip::ChipFamily;
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId};
use emu_debug::ProgramSource;
use emu_debug::chip_scenario::{ChipBindings, ChipResolver};
use emu_debug::stimulus::{ExternalDrive, check_drive_supported, find_pin, supply_changes};
use emu_debug::text_escapes::unescape;
use scenario::{RecordedAction, Recorder, ScenarioValue, bind};

use super::super::RunArgs;
use super::super::plan::PlannedRun;
use super::ScenarioSetup;
use crate::shared::fail::VerbFailure;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::scenarios::ScenarioFile;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::{avr, family, scenarios};

/// Flags of scenarios.
#[derive(Debug, Args)]
pub struct ScenarioFlags {
    /// Play a scenario (docs/scenario.md). The run ends with the scenario, with exit code 1 if an expectation
    /// was not met and 5 if a step was still waiting at the limit. --for and --cycles set the limit.
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<String>,
    /// Use a waveform (VCD) as stimulus: a wire with the name of a pin drives that pin. Other wires are
    /// ignored.
    #[arg(long, value_name = "FILE")]
    pub stimulus: Option<String>,
    /// Use only these wires of --stimulus: PD2,PD3. Repeatable.
    #[arg(long, value_name = "PIN", value_delimiter = ',', requires = "stimulus")]
    pub drive: Vec<String>,
    /// Write the actions on the chip (--set, --at, --uart-in, --scenario, --stimulus) as a scenario that
    /// repeats them.
    #[arg(long, value_name = "FILE")]
    pub record: Option<String>,
}

impl ScenarioFlags {
    /// Returns true if any of the flags is given.
    pub fn is_any_given(&self) -> bool {
        self.scenario.is_some() || self.stimulus.is_some() || self.record.is_some()
    }

    /// Reads the waveform of --stimulus, and resolves the names of all scenarios for the machine.
    pub fn scenario_setup<C: Cpu>(
        &self,
        cpu: &C,
        source: &ProgramSource<'_>,
        (args, planned): (&RunArgs, &PlannedRun),
        file: Option<&ScenarioFile>,
        (snapshot_writer, style): (&SnapshotWriter, &MessageStyle),
    ) -> Result<ScenarioSetup, VerbFailure> {
        let has_byte = |space: &str, addr: u32| cpu.peek(space, addr).is_some();
        let has_pin = |pin: PinId| cpu.has_pin(pin);
        let no_serial_input = (!args.machine.uart_in.is_empty()).then(|| "--uart-in already uses the line".to_owned());
        let reason = || "a snapshot does not contain the state of the devices of --attach".to_owned();
        let no_snapshots = (!args.machine.attach.is_empty()).then(reason);
        let chip = cpu.chip();
        let canonical_pin_name = |name: &str| avr::chip_pin_text(chip, name);
        let mut resolver = ChipResolver {
            names: source.names,
            clock: planned.clock,
            has_byte: &has_byte,
            has_pin: &has_pin,
            check_drive: &|drive| check_drive_supported(cpu, drive),
            canonical_pin_name: &canonical_pin_name,
            serial: (family::has_uart(chip), family::receive_pin(chip)),
            no_snapshots,
            no_serial_input,
            bindings: ChipBindings::default(),
        };
        let clocks = u64::from(planned.clock.clocks_per_cycle.max(1));
        let deciding = match file {
            Some(file) => {
                let bound = bind(&file.scenario, &mut resolver, Some(&args.image), Some(chip.name));
                let limit_requested = args.time.is_some() || args.cycles.is_some();
                let limit = limit_requested.then(|| planned.plan.limit.saturating_mul(clocks));
                Some(bound.map_err(|faults| file.binding_failure(faults))?.with_limit(limit))
            }
            None => None,
        };
        let mut stimuli = Vec::new();
        if let Some(name) = &self.stimulus {
            let wave = scenarios::read_waveform(name)?;
            for wire in &self.drive {
                if !wave.has_wire(wire) {
                    return Err(VerbFailure::invalid_flag_value(
                        "--drive <PIN>",
                        wire,
                        &"the waveform has no wire of this name",
                    ));
                }
            }
            let is_used = |wire: &str| {
                let is_selected = self.drive.is_empty() || self.drive.iter().any(|name| name == wire);
                let pin_name = avr::chip_pin_text(chip, &source.names.replace_channel_name(wire));
                is_selected && find_pin(chip, &pin_name).is_ok_and(|pin| cpu.has_pin(pin))
            };
            let (wave_scenario, warnings) = wave.scenario(&mut { is_used })?;
            // With --drive, unused wires are intentional and need no warning.
            if self.drive.is_empty() {
                report_diagnostics(style, &warnings, FileTexts::NONE);
            }
            let bound =
                bind(&wave_scenario, &mut resolver, None, None).map_err(|faults| wave.binding_failure(faults))?;
            stimuli.push(bound.with_limit(Some(u64::MAX)));
        }
        let recorder = self.record.as_ref().map(|_| {
            let mut recorder = Recorder::new(Some(planned.clock.clocks_per_cycle.max(1)));
            recorder.program = (args.image != "-").then(|| file_name(&args.image));
            recorder.mcu = Some(chip.name.to_owned());
            // On the 8051, drives act when a machine cycle begins.
            recorder.align_to_cycles = chip.family == ChipFamily::Mcs51;
            recorder.baud = (!args.machine.uart_in.is_empty()).then_some(args.machine.baud);
            recorded_flags(args, planned, clocks).into_iter().for_each(|(tick, action)| recorder.push(tick, action));
            recorder
        });
        let (bindings, snapshot_writer) = (std::mem::take(&mut resolver.bindings), snapshot_writer.clone());
        let supplies = supply_changes(&planned.drives);
        Ok(ScenarioSetup { bindings, supplies, deciding, stimuli, baud: args.machine.baud, recorder, snapshot_writer })
    }
}

/// Returns the last component of a path.
fn file_name(path: &str) -> String {
    path.rsplit(['/', '\\']).next().unwrap_or(path).to_owned()
}

/// Returns the actions of --set, --at and --uart-in with their ticks, in order of time.
fn recorded_flags(args: &RunArgs, planned: &PlannedRun, clocks: u64) -> Vec<(u64, RecordedAction)> {
    let at = args.machine.at.iter().map(|text| text.split_once(':').map_or(text.as_str(), |(_, drive)| drive));
    let texts = args.machine.set.iter().map(String::as_str).chain(at);
    let tick = |at: CycleTime| at.cycle.saturating_mul(clocks).saturating_add(at.phase.into());
    let mut actions: Vec<(u64, bool, RecordedAction)> = Vec::new();
    for (text, drive) in texts.zip(&planned.drives) {
        let Some((name, value)) = text.split_once('=') else { continue };
        let value = value.trim();
        let value = value.parse().map_or_else(|_| ScenarioValue::Text(value.to_owned()), ScenarioValue::Number);
        let is_pin = !matches!(drive.drive, ExternalDrive::Supply(_));
        actions.push((tick(drive.at), is_pin, RecordedAction::Set(name.trim().to_owned(), value)));
    }
    let texts = args.machine.uart_in.iter().filter_map(|text| text.split_once(':'));
    for (time, text) in texts {
        if let (Ok(at), Ok(bytes)) = (planned.clock.parse_moment(time), unescape(text)) {
            actions.push((tick(at), true, RecordedAction::Send(bytes)));
        }
    }
    // The order of the queue: the supply before the pins.
    actions.sort_by_key(|(tick, is_pin, _)| (*tick, *is_pin));
    actions.into_iter().map(|(tick, _, actions)| (tick, actions)).collect()
}
