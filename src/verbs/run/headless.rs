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
use super::cover::{CoverAndProfile, CoverageRun};
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

/// A run with all its inputs.
pub struct HeadlessRun<'a> {
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
    /// The file of the EEPROM, and its contents if it exists.
    pub eeprom: Option<(MemoryFile, Option<Vec<u8>>)>,
    /// The snapshots that the run reads and writes.
    pub snapshots: RunSnapshots,
    /// Writes the snapshots that a scenario requests.
    pub snapshot_writer: SnapshotWriter,
    /// Devices on the pins.
    pub devices: AttachedStores,
    /// Standard output carries a result other than the summary.
    pub to_stdout: bool,
    /// The style of messages.
    pub terminal: &'a MessageStyle,
}

impl MachineVisitor for HeadlessRun<'_> {
    type Output = Result<u8, VerbFailure>;

    fn visit<C: Cpu + 'static>(mut self, mut cpu: C) -> Self::Output {
        let store = self.eeprom.take().map(|(store, held)| {
            store::load_eeprom(&mut cpu, &held.unwrap_or_default());
            store
        });
        let clock = CycleClock { hz: self.hz, clocks_per_cycle: cpu.clocks_per_cycle() * self.avr.divider };
        let source = self.source(cpu.chip());
        let job = plan_run(self.args, &source, clock);
        // The lookup of a source line may have found damaged debugging information.
        report_diagnostics(self.terminal, self.image.lines.warnings(), FileTexts::NONE);
        let reported = self.image.lines.warnings().len();
        let mut job = job?;
        self.snapshots.resume(&mut cpu, &mut job)?;
        check_pins_exist(&job, &cpu)?;
        let mut board = self.devices.connect(cpu.chip(), clock, &job.drives)?;
        let mut begun = false;
        let out = self.run_and_report((&mut cpu, &mut board), job, &mut begun);
        report_diagnostics(
            self.terminal,
            self.image.lines.warnings().get(reported..).unwrap_or_default(),
            FileTexts::NONE,
        );
        if !begun {
            return out;
        }
        // These files are written however the run ended, and independently of each other.
        let stored = store.map_or(Ok(()), |store| store.keep(&store::eeprom_bytes(&cpu)));
        let held = self.devices.write_back(&board);
        let saved = self.snapshots.write_snapshot(&cpu);
        out.and_then(|code| stored.and(held).and(saved).map(|()| code))
    }
}

impl HeadlessRun<'_> {
    /// Returns names and source lines of the program's addresses.
    fn source(&self, chip: &'static Chip) -> ProgramSource<'_> {
        ProgramSource { names: AddressNames { chip, symbols: &self.image.symbols }, lines: &self.image.lines }
    }

    /// Runs the machine and reports the result. Sets `begun` just before the machine runs.
    fn run_and_report<C: Cpu>(
        &self,
        (cpu, board): (&mut C, &mut AttachedDevices),
        mut job: PlannedRun,
        begun: &mut bool,
    ) -> Result<u8, VerbFailure> {
        let (args, image, chip) = (self.args, self.image, cpu.chip());
        let source = self.source(chip);
        let filled = image.segments.iter().filter(|s| s.space == chip.ram_space);
        job.plan.initialized = filled
            .map(|s| AddressRange { space: s.space, start: s.addr, end: s.addr + s.bytes.len() as u32 })
            .collect();
        for (text, range) in &job.peek {
            let width = chip.bytes_per_address(range.space);
            if let Some(addr) = (range.start..range.end).find(|&addr| cpu.peek(range.space, addr * width).is_none()) {
                let why = format!("{} has no memory at {}:0x{addr:x}", chip.name, range.space);
                return Err(VerbFailure::invalid_flag_value("--peek <RANGE>", text, &why));
            }
        }
        queue_drives(cpu, &job.drives).map_err(VerbFailure::usage)?;
        pic16::warn_missing_config(chip, image, &self.pic16);
        if let Some(script) = &self.script {
            let limits = CodRunLimits { cycle: job.plan.limit, hz: self.hz };
            let name = args.cod.as_deref().unwrap_or_default();
            *begun = true;
            return cod::run_and_judge(cpu, script, (name, source), (limits, &job.drives), args.json);
        }
        let scenario = args.scenes.scenario.as_deref().map(scenarios::read_scenario).transpose()?;
        let cast = match args.scenes.is_any_given() {
            true => Some(args.scenes.scenario_setup(
                cpu,
                &source,
                (args, &job, scenario.as_ref()),
                (&self.snapshot_writer, self.terminal),
            )?),
            false => None,
        };
        if let Some(bound) = cast.as_ref().and_then(|cast| cast.deciding.as_ref()) {
            job.plan.limit = bound.max_cycles(job.clock.clocks_per_cycle);
        }
        board.connect(cpu);
        let asked = args.trace.resolve(cpu, &source)?;
        let cover = CoverageRun::new(
            &args.cover,
            args.trace.map.as_deref(),
            (&source, image),
            (&self.snapshot_writer.protected_files, self.terminal),
        )?;
        let job_of = (&job, asked, source);
        let RecordedRun { ended, verdict, seen, files_written: kept } =
            run_recorded(args, (cpu, board), job_of, (cast, &cover), begun)?;
        let held = if ended.reason == RunEnd::Halted { reset_hold(cpu, &job.drives) } else { None };
        let PlannedRun { clock, plan, peek, .. } = &job;
        let story = RunSummary { cpu, source, clock: *clock, plan, ended: &ended, peek, reset_hold: held };
        if let Some(how) = args.lint {
            lint::report_lints(&story, how, &args.image, self.terminal);
        }
        summary::report_faults(&story, &avr::erased_memory_hint(chip, image, &self.avr));
        avr::warn_clock_change(cpu, &self.avr);
        let reported = cover.write_reports(&seen, &source);
        kept?;
        let (covered, members) = reported?;
        let played = scenario.as_ref().zip(verdict.as_ref());
        if let (RunEnd::Finished, Some(text)) = (ended.reason, missing_expected_text(plan, &ended)) {
            let text = text.escape_ascii();
            output::print_to_stderr(&format!(
                "error: the scenario is over, and --expect-uart \"{text}\" was not sent\n"
            ));
        }
        if args.json {
            let mut document = summary::json_document(&story);
            for (name, member) in members {
                document[name] = member;
            }
            if let Some((file, verdict)) = played {
                document["scenario"] = file.verdict_json(verdict);
            }
            if args.lint.is_some() {
                document["lints"] = lint::document(&story);
            }
            output::print_json(&document)?;
        } else if self.to_stdout {
            output::print_to_stderr(&(summary::summary_text(&story) + &covered));
        } else {
            output::print(summary::summary_text(&story) + &covered)?;
        }
        let asked = args.time.is_some() || args.cycles.is_some();
        let code = exit_code(&job.plan, &ended, asked);
        let code = match played {
            Some((file, verdict)) => {
                file.report_beside_run(verdict, (code, args.json || self.to_stdout), self.terminal)?
            }
            None => code,
        };
        Ok(args.lint.map_or(code, |how| lint::exit_code_with_lints(how, &ended.lints, code)))
    }
}

/// Runs the machine and writes the outputs of `--uart`, `--vcd`, `--trace`, `--coverage` and `--profile`.
fn run_recorded<C: Cpu>(
    args: &RunArgs,
    (cpu, board): (&mut C, &mut AttachedDevices),
    (job, asked, source): (&PlannedRun, TraceRequest, ProgramSource<'_>),
    (cast, cover): (Option<ScenarioSetup>, &CoverageRun<'_>),
    begun: &mut bool,
) -> Result<RecordedRun, VerbFailure> {
    let chip = cpu.chip();
    let record = args.scenes.record.as_deref().filter(|f| !output::is_stdout(f)).map(PendingFile::new).transpose()?;
    let raw = args.uart.as_deref().is_some_and(output::is_stdout);
    let (start, mut printed, mut broken) = (Instant::now(), 0, None);
    let interrupted = listen_for_interrupts();
    let mut patience = |sent: &[u8]| {
        if raw && broken.is_none() {
            broken = output::print(sent.get(printed..).unwrap_or_default()).err();
            printed = sent.len();
        }
        broken.is_none()
            && !interrupted.load(Ordering::Relaxed)
            && args.timeout.is_none_or(|limit| start.elapsed() < limit)
    };
    let mut stage = match cast {
        Some(cast) => Some(ScenarioHost::new(chip, job.clock, cast, &mut patience)?),
        None => None,
    };
    // Before the waveform starts, so that the waveform includes the state of the first cycle.
    if let Some(stage) = &mut stage {
        stage.start(cpu);
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
            let columns = &asked.columns();
            let start = CycleTime::at(cpu.cycle());
            let extras = WaveExtras { start, uart: family::has_uart(chip), columns, split: args.trace.vcd_bits };
            WaveWriter::with_extras((out, chip, job.clock), &levels, extras)
        })
        .transpose()
        .map_err(vcd_error)?;

    let trace_file = args.trace.pending()?;
    let mut look = args.trace.trace_probe(asked, trace_file.as_ref(), (source, job.clock.hz))?;

    *begun = true;
    let mut go = |cpu: &mut C, host: &mut dyn RunController<C>| {
        cover.run((cpu, board), &job.plan, (wave.take(), look.as_mut()), host)
    };
    let ((mut ended, seen), verdict, recording) = match stage {
        Some(mut stage) => {
            let ended = go(cpu, &mut stage);
            let verdict = stage.end_scenario(cpu, &ended.0.uart, "the run ended");
            (ended, verdict, stage.recording(cpu))
        }
        None => (go(cpu, &mut ContinueCallback(&mut patience)), None, None),
    };
    if ended.reason == RunEnd::Declined && interrupted.load(Ordering::Relaxed) {
        ended.reason = RunEnd::Interrupted;
    }
    // Each output is kept, even if another one fails.
    let sent = uart_file.map_or(Ok(()), |file| write_pending(file, args.uart.as_deref(), &ended.uart));
    let drawn = match (ended.wave_error.take(), vcd_file) {
        (Some(error), _) => Err(vcd_error(error)),
        (None, file) => file.map_or(Ok(()), PendingFile::complete),
    };
    let traced = look.map_or(Ok(()), |look| args.trace.finish_trace(look, trace_file, cpu.cycle(), &ended));
    let text = recording.unwrap_or_default();
    let record = match (args.scenes.record.as_deref(), record) {
        (Some(_), Some(file)) => write_pending(file, args.scenes.record.as_deref(), text.as_bytes()),
        (Some(_), None) => output::print(text),
        (None, _) => Ok(()),
    };
    let kept = broken.map_or(Ok(()), Err).and(sent).and(drawn).and(traced).and(record);
    Ok(RecordedRun { ended, verdict, seen, files_written: kept })
}

/// Writes an open file and renames it to its final name.
fn write_pending(file: PendingFile, name: Option<&str>, bytes: &[u8]) -> Result<(), VerbFailure> {
    let mut out = file.writer()?;
    let written = out.write_all(bytes).and_then(|()| out.flush());
    written.map_err(|error| VerbFailure::write_failed(name.unwrap_or_default(), &error))?;
    drop(out);
    file.complete()
}

/// How a run and its scenario ended, and whether its output files are complete.
struct RecordedRun {
    ended: RunResult,
    verdict: Option<ScenarioVerdict>,
    seen: CoverAndProfile,
    files_written: Result<(), VerbFailure>,
}
