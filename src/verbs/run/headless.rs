//! Executes `emu run`: builds the run from the flags, runs the machine with its probes, and reports the
//! result.

use std::io::Write;
use std::sync::atomic::Ordering;
use std::time::Instant;

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::image::Image;
use emu_core::pins::CycleTime;
use emu_debug::cod::{CodRunLimits, CodScript};
use emu_debug::run::shown_pin_levels;
use emu_debug::stimulus::queue_drives;
use emu_debug::waveform::WaveExtras;
use emu_debug::{
    AddressNames, AddressRange, AttachedDevices, ContinueCallback, CycleClock, ProgramSource, RunController, RunEnd,
    RunResult, WaveWriter,
};
use scenario::ScenarioVerdict;

use super::RunArgs;
use super::cover::{CoverageAndProfile, CoverageReport, CoverageRun};
use super::plan::{PlannedRun, check_pins_exist, exit_code, missing_expected_text, plan_run};
use super::scenario::{ScenarioHost, ScenarioSetup};
use super::snapshot::RunSnapshots;
use super::trace::TraceRequest;
use crate::shared::attach::AttachedStores;
use crate::shared::fail::VerbFailure;
use crate::shared::family::MachineVisitor;
use crate::shared::interrupts::listen_for_interrupts;
use crate::shared::output::PendingFile;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::reset_hold::reset_hold;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::store::MemoryFile;
use crate::shared::{avr, family, output, pic16, scenarios, store};
use crate::verbs::run::summary::RunSummary;
use crate::verbs::run::{cod, lint, summary};

/// The job of `emu run`, for a machine of any family ([`MachineVisitor`]).
pub struct RunJob<'a> {
    /// The flags.
    pub args: &'a RunArgs,
    /// The program.
    pub image: &'a Image,
    /// The messages of a self-checking program.
    pub script: Option<CodScript>,
    /// Oscillator frequency in Hz.
    pub hz: u64,
    /// Settings of an AVR.
    pub avr: avr::AvrWiring,
    /// Options of a PIC16.
    pub pic16: emu_pic16::Options,
    /// The file that keeps the EEPROM, and its contents if it exists.
    pub eeprom: Option<(MemoryFile, Option<Vec<u8>>)>,
    /// The snapshots that the run reads and writes.
    pub snapshots: RunSnapshots,
    /// Writes the snapshots that a scenario requests.
    pub snapshot_writer: SnapshotWriter,
    /// Devices on the pins.
    pub devices: AttachedStores,
    /// Standard output carries a result other than the summary, which then goes to standard error.
    pub to_stdout: bool,
    /// The style of messages.
    pub style: &'a MessageStyle,
}

impl MachineVisitor for RunJob<'_> {
    type Output = Result<u8, VerbFailure>;

    fn visit<C: Cpu + 'static>(mut self, mut cpu: C) -> Self::Output {
        let eeprom_file = self.eeprom.take().map(|(file, contents)| {
            store::load_eeprom(&mut cpu, &contents.unwrap_or_default());
            file
        });
        let clock = CycleClock { hz: self.hz, clocks_per_cycle: cpu.clocks_per_cycle() * self.avr.divider };
        let source = self.source(cpu.chip());
        let planned = plan_run(self.args, &source, clock);
        // The lookup of a source line may have found damaged debugging information.
        report_diagnostics(self.style, self.image.lines.warnings(), FileTexts::NONE);
        let warnings_reported = self.image.lines.warnings().len();
        let mut planned = planned?;
        self.snapshots.resume(&mut cpu, &mut planned)?;
        check_pins_exist(&planned, &cpu)?;
        let mut devices = self.devices.connect(cpu.chip(), clock, &planned.drives)?;
        let mut started = false;
        let outcome = self.run_and_report((&mut cpu, &mut devices), planned, &mut started);
        report_diagnostics(
            self.style,
            self.image.lines.warnings().get(warnings_reported..).unwrap_or_default(),
            FileTexts::NONE,
        );
        if !started {
            return outcome;
        }
        // These files are written however the run ended, and independently of each other.
        let eeprom_written = eeprom_file.map_or(Ok(()), |file| file.keep(&store::eeprom_bytes(&cpu)));
        let devices_written = self.devices.write_back(&devices);
        let snapshot_written = self.snapshots.write_snapshot(&cpu);
        outcome.and_then(|code| eeprom_written.and(devices_written).and(snapshot_written).map(|()| code))
    }
}

impl RunJob<'_> {
    /// Returns names and source lines of the program's addresses.
    fn source(&self, chip: &'static Chip) -> ProgramSource<'_> {
        ProgramSource { names: AddressNames { chip, symbols: &self.image.symbols }, lines: &self.image.lines }
    }

    /// Runs the machine and reports the result. Sets `started` just before the machine runs.
    fn run_and_report<C: Cpu>(
        &self,
        (cpu, devices): (&mut C, &mut AttachedDevices),
        mut planned: PlannedRun,
        started: &mut bool,
    ) -> Result<u8, VerbFailure> {
        let (args, image, chip) = (self.args, self.image, cpu.chip());
        let source = self.source(chip);
        let initialized_segments = image.segments.iter().filter(|s| s.space == chip.ram_space);
        planned.plan.initialized = initialized_segments
            .map(|s| AddressRange { space: s.space, start: s.addr, end: s.addr + s.bytes.len() as u32 })
            .collect();
        for (text, range) in &planned.peek {
            let width = chip.bytes_per_address(range.space);
            if let Some(addr) = (range.start..range.end).find(|&addr| cpu.peek(range.space, addr * width).is_none()) {
                let why = format!("{} has no memory at {}:0x{addr:x}", chip.name, range.space);
                return Err(VerbFailure::invalid_flag_value("--peek <RANGE>", text, &why));
            }
        }
        queue_drives(cpu, &planned.drives).map_err(VerbFailure::usage)?;
        pic16::warn_missing_config(chip, image, &self.pic16);
        if let Some(script) = &self.script {
            let limits = CodRunLimits { cycle: planned.plan.limit, hz: self.hz };
            let name = args.cod.as_deref().unwrap_or_default();
            *started = true;
            return cod::run_and_judge(cpu, script, (name, source), (limits, &planned.drives), args.json);
        }
        let scenario = args.scenario_flags.scenario.as_deref().map(scenarios::read_scenario).transpose()?;
        let scenario_setup = match args.scenario_flags.is_any_given() {
            true => Some(args.scenario_flags.scenario_setup(
                cpu,
                &source,
                (args, &planned),
                scenario.as_ref(),
                (&self.snapshot_writer, self.style),
            )?),
            false => None,
        };
        if let Some(deciding) = scenario_setup.as_ref().and_then(|scenario_setup| scenario_setup.deciding.as_ref()) {
            planned.plan.limit = deciding.max_cycles(planned.clock.clocks_per_cycle);
        }
        devices.connect(cpu);
        let trace_request = args.trace.resolve(cpu, &source)?;
        let cover = CoverageRun::new(
            &args.cover,
            args.trace.map.as_deref(),
            (&source, image),
            (&self.snapshot_writer.protected_files, self.style),
        )?;
        let run_inputs = (&planned, trace_request, source);
        let RecordedRun { result, verdict, coverage, outputs_written } =
            run_recorded(args, (cpu, devices), run_inputs, (scenario_setup, &cover), started)?;
        let hold_reason = if result.reason == RunEnd::Halted { reset_hold(cpu, &planned.drives) } else { None };
        let PlannedRun { clock, plan, peek, .. } = &planned;
        let summary = RunSummary { cpu, source, clock: *clock, plan, result: &result, peek, reset_hold: hold_reason };
        if let Some(lint_mode) = args.lint {
            lint::report_lints(&summary, lint_mode, &args.image, self.style);
        }
        summary::report_faults(&summary, &avr::erased_memory_hint(chip, image, &self.avr));
        avr::warn_clock_change(cpu, &self.avr);
        let reports = cover.write_reports(&coverage, &source);
        outputs_written?;
        let CoverageReport { text: coverage_text, members: json_members } = reports?;
        let scenario_verdict = scenario.as_ref().zip(verdict.as_ref());
        if let (RunEnd::Finished, Some(text)) = (result.reason, missing_expected_text(plan, &result)) {
            let text = text.escape_ascii();
            output::print_to_stderr(&format!(
                "error: the scenario has ended, but the text of --expect-uart, \"{text}\", was not sent\n"
            ));
        }
        if args.json {
            let mut document = summary::json_document(&summary);
            for (name, member) in json_members {
                document[name] = member;
            }
            if let Some((file, verdict)) = scenario_verdict {
                document["scenario"] = file.verdict_json(verdict);
            }
            if args.lint.is_some() {
                document["lints"] = lint::document(&summary);
            }
            output::print_json(&document)?;
        } else if self.to_stdout {
            output::print_to_stderr(&(summary::summary_text(&summary) + &coverage_text));
        } else {
            output::print(summary::summary_text(&summary) + &coverage_text)?;
        }
        let limit_requested = args.time.is_some() || args.cycles.is_some();
        let code = exit_code(&planned.plan, &result, limit_requested);
        let code = match scenario_verdict {
            Some((file, verdict)) => {
                file.report_beside_run(verdict, (code, args.json || self.to_stdout), self.style)?
            }
            None => code,
        };
        Ok(args.lint.map_or(code, |lint_mode| lint::exit_code_with_lints(lint_mode, &result.lints, code)))
    }
}

/// Runs the machine and writes the outputs of `--uart`, `--vcd`, `--trace`, `--coverage` and `--profile`.
fn run_recorded<C: Cpu>(
    args: &RunArgs,
    (cpu, devices): (&mut C, &mut AttachedDevices),
    (planned, trace_request, source): (&PlannedRun, TraceRequest, ProgramSource<'_>),
    (scenario_setup, cover): (Option<ScenarioSetup>, &CoverageRun<'_>),
    started: &mut bool,
) -> Result<RecordedRun, VerbFailure> {
    let chip = cpu.chip();
    let record_file =
        args.scenario_flags.record.as_deref().filter(|f| !output::is_stdout(f)).map(PendingFile::new).transpose()?;
    let uart_to_stdout = args.uart.as_deref().is_some_and(output::is_stdout);
    let (start, mut printed_bytes, mut print_error) = (Instant::now(), 0, None);
    let interrupted = listen_for_interrupts();
    let mut keep_waiting = |sent: &[u8]| {
        if uart_to_stdout && print_error.is_none() {
            print_error = output::print(sent.get(printed_bytes..).unwrap_or_default()).err();
            printed_bytes = sent.len();
        }
        print_error.is_none()
            && !interrupted.load(Ordering::Relaxed)
            && args.timeout.is_none_or(|limit| start.elapsed() < limit)
    };
    let mut scenario_host = match scenario_setup {
        Some(scenario_setup) => Some(ScenarioHost::new(chip, planned.clock, scenario_setup, &mut keep_waiting)?),
        None => None,
    };
    // Before the waveform starts, so that the waveform includes the state of the first cycle.
    if let Some(scenario_host) = &mut scenario_host {
        scenario_host.start(cpu);
    }
    let uart_file = args.uart.as_deref().filter(|f| !output::is_stdout(f)).map(PendingFile::new).transpose()?;
    let vcd_file = args.vcd.as_deref().filter(|f| !output::is_stdout(f)).map(PendingFile::new).transpose()?;
    let vcd_name = args.vcd.as_deref().unwrap_or_default();
    let vcd_error = |error: std::io::Error| VerbFailure::write_failed(vcd_name, &error);
    let wave = match (&args.vcd, &vcd_file) {
        (None, _) => None,
        (Some(_), Some(file)) => Some(file.writer()?),
        (Some(_), None) => Some(Box::new(std::io::BufWriter::new(std::io::stdout())) as Box<dyn Write>),
    };
    let mut wave = wave
        .map(|out| {
            let levels = shown_pin_levels(cpu, chip);
            let wave_signals = &trace_request.wave_signals();
            let start = CycleTime::at(cpu.cycle());
            let extras = WaveExtras { start, uart: family::has_uart(chip), wave_signals, split: args.trace.vcd_bits };
            WaveWriter::with_extras(out, chip, planned.clock, &levels, extras)
        })
        .transpose()
        .map_err(vcd_error)?;

    let trace_file = args.trace.pending()?;
    let mut trace_probe = args.trace.trace_probe(trace_request, trace_file.as_ref(), (source, planned.clock.hz))?;

    *started = true;
    let mut run_machine = |cpu: &mut C, controller: &mut dyn RunController<C>| {
        cover.run((cpu, devices), &planned.plan, (wave.take(), trace_probe.as_mut()), controller)
    };
    let ((mut result, coverage), verdict, recording) = match scenario_host {
        Some(mut scenario_host) => {
            let result = run_machine(cpu, &mut scenario_host);
            let verdict = scenario_host.end_scenario(cpu, &result.0.uart, "the run ended");
            (result, verdict, scenario_host.recording(cpu))
        }
        None => (run_machine(cpu, &mut ContinueCallback(&mut keep_waiting)), None, None),
    };
    if result.reason == RunEnd::StoppedWaiting && interrupted.load(Ordering::Relaxed) {
        result.reason = RunEnd::Interrupted;
    }
    // Each output is kept, even if another one fails.
    let uart_written = uart_file.map_or(Ok(()), |file| write_pending(file, args.uart.as_deref(), &result.uart));
    let vcd_written = match (result.wave_error.take(), vcd_file) {
        (Some(error), _) => Err(vcd_error(error)),
        (None, file) => file.map_or(Ok(()), PendingFile::complete),
    };
    let trace_written = trace_probe
        .map_or(Ok(()), |trace_probe| args.trace.finish_trace(trace_probe, trace_file, cpu.cycle(), &result));
    let text = recording.unwrap_or_default();
    let record_written = match (args.scenario_flags.record.as_deref(), record_file) {
        (Some(_), Some(file)) => write_pending(file, args.scenario_flags.record.as_deref(), text.as_bytes()),
        (Some(_), None) => output::print(text),
        (None, _) => Ok(()),
    };
    let outputs_written =
        print_error.map_or(Ok(()), Err).and(uart_written).and(vcd_written).and(trace_written).and(record_written);
    Ok(RecordedRun { result, verdict, coverage, outputs_written })
}

/// Writes an open file and renames it to its final name.
fn write_pending(file: PendingFile, name: Option<&str>, bytes: &[u8]) -> Result<(), VerbFailure> {
    let mut out = file.writer()?;
    let written = out.write_all(bytes).and_then(|()| out.flush());
    written.map_err(|error| VerbFailure::write_failed(name.unwrap_or_default(), &error))?;
    drop(out);
    file.complete()
}

/// The result of [`run_recorded`].
struct RecordedRun {
    /// The result of the run.
    result: RunResult,
    /// The verdict of the scenario, if there is one.
    verdict: Option<ScenarioVerdict>,
    /// What the run executed, for the reports.
    coverage: CoverageAndProfile,
    /// The first error of the output files.
    outputs_written: Result<(), VerbFailure>,
}
