//! Opens a session for every front end of the debugger: from an image with the flags of its machine, or from
//! a ladder program.

use clap::Args;
use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_debug::debug::{DebugSession, DynMachine, MachineWithDevices, NameScope, SessionOptions};
use emu_debug::stimulus::{queue_drives, supply_changes};
use emu_debug::{AddressNames, CycleClock, ProgramSource, TimedDrive};
use ladder_compile::PinAssignment;
use ladder_view::LadderView;

use super::ladder;
use super::scenario::{ScenarioContext, scenario_drives};
use crate::shared::fail::VerbFailure;
use crate::shared::family::{MachineVisitor, visit_machine};
use crate::shared::flags::ReadFlags;
use crate::shared::machine::{MachineArgs, MachineOptions, WiredMachine, check_pins_exist};
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::scenarios::ScenarioFile;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::sources::SourceFiles;
use crate::shared::usage_error::UsageError;
use crate::shared::{input, pic16, scenarios, snapshots, store};
use crate::verbs::compile::parse_pin_assignment;
use crate::verbs::run::{RamChoice, parse_ram};

/// The program to debug, and how its machine is wired.
#[derive(Debug, Args)]
pub struct DebugSubject {
    /// A HEX or ELF file, for the 8051 family also an absolute object file (OMF-51), an assembly source by
    /// its name (.asm, .s, .a51, .src), or a ladder program (.ld, .il), which is compiled first.
    #[arg(value_name = "FILE")]
    pub file: String,
    /// What RAM and registers hold after power-up: random:SEED or zero.
    #[arg(long, value_name = "FILL", default_value = "zero", value_parser = parse_ram_init)]
    ram: RamInit,
    /// The ladder program that the image was compiled from, for rungs and symbols; with --map.
    #[arg(long, value_name = "PROGRAM.ld", requires = "map")]
    pub(super) ladder: Option<String>,
    /// The map that was written with the image (`emu compile --map`); with --ladder.
    #[arg(long, value_name = "FILE", requires = "ladder")]
    pub(super) map: Option<String>,
    /// Put an input or output of a ladder program at a pin: Xstart=PD2. Overrides the pins of the program.
    /// Repeatable.
    #[arg(long = "pin", value_name = "NAME=PIN", value_parser = parse_pin_assignment)]
    pub(super) pins: Vec<PinAssignment>,
    /// How the program is read.
    #[command(flatten)]
    pub(super) read: ReadFlags,
    /// Apply the external stimuli of a scenario (docs/scenario.md), in addition to --set and --at. A scenario
    /// that expects or waits is first played on a copy of the machine, and its outcome is printed.
    #[arg(long, value_name = "FILE")]
    scenario: Option<String>,
    /// Maximum size of the copies of the machine for going back in time: 64M, 500k, 1G.
    #[arg(long, value_name = "BYTES", default_value = "64M", value_parser = parse_byte_count)]
    history: usize,
    // Last, because the headings of the families would also stand over the flags behind them.
    #[command(flatten)]
    pub machine: MachineArgs,
}

/// Parses the value of `--ram`; the check for reads of unwritten RAM is not available here.
fn parse_ram_init(text: &str) -> Result<RamInit, UsageError> {
    match parse_ram(text) {
        Ok(RamChoice::Fill(init)) => Ok(init),
        _ => Err(UsageError::malformed("write random:SEED or zero")),
    }
}

/// Parses a number of bytes: 64M, 500k, 1G, 4096.
fn parse_byte_count(text: &str) -> Result<usize, UsageError> {
    let expected = "write 64M, 500k or 1G".into();
    let wrong = UsageError::MalformedPart { part: text.to_owned(), wanted: "a number of bytes", expected };
    let (digits, shift) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 10),
        Some((at, 'm' | 'M')) => (&text[..at], 20),
        Some((at, 'g' | 'G')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let number: usize = digits.parse().map_err(|_| wrong.clone())?;
    number.checked_mul(1 << shift).ok_or(wrong)
}

/// A session with its ladder program, source texts and files.
pub struct OpenedSession {
    /// The machine under the debugger.
    pub session: DebugSession,
    /// The ladder program, if there is one.
    pub view: Option<LadderView>,
    /// Texts of the source lines.
    pub sources: SourceFiles,
    /// Writer of the snapshots of the session.
    pub snapshot_writer: SnapshotWriter,
    /// The program file.
    pub file: String,
    /// Drives that were queued before the session began.
    pub drives: Vec<TimedDrive>,
}

/// Opens a session, and prints warnings and notes.
pub fn open_session(subject: &DebugSubject, style: &MessageStyle) -> Result<OpenedSession, VerbFailure> {
    let machine = &subject.machine;
    let chosen = machine.mcu.choose_chip(&subject.file)?;
    let chip = chosen.chip;
    let compiled = if subject.is_ladder() { Some(subject.compile_ladder(chip, style)?) } else { None };
    let mapped = if compiled.is_none() { subject.mapped_ladder(chip, style)? } else { None };
    let own = compiled.as_ref().map(|compiled| &compiled.view).or(mapped.as_ref()).map(|view| view.map().clock_hz);
    let clock = chosen.clock(machine.clock.or(own));
    let machine_options = MachineOptions { ram: subject.ram, bus: false, clock, start_up: !machine.no_start_up };
    let wired = machine.wire_machine(chip, &machine_options, || match &compiled {
        Some(compiled) => compiled.image(&subject.file, chip),
        None => input::read_image_with_symbols(&subject.file, &machine.symbols, chip, style),
    })?;
    let view = compiled.map(|compiled| compiled.view).or(mapped);
    let mut scope = program_scope(chip, &wired.image, style);
    scope.ladder = view.as_ref().map_or(Vec::new(), LadderView::symbols);
    let (image, setup) = (wired.image.clone(), wired.setup);
    let head = snapshots::snapshot_header(chip, &image, &setup);
    let scenario = subject.scenario.as_deref().map(scenarios::read_scenario).transpose()?;
    let files = || std::iter::once(&subject.file).chain(&machine.symbols);
    let protected_files: Vec<String> = files()
        .chain(&subject.ladder)
        .chain(&subject.map)
        .chain(&subject.scenario)
        .chain(&machine.eeprom)
        .cloned()
        .collect();
    let snapshot_writer = SnapshotWriter { head, protected_files };
    let builder = SessionBuilder {
        machine,
        program: &subject.file,
        wired,
        view: view.as_ref(),
        scenario: scenario.as_ref(),
        snapshot_writer: snapshot_writer.clone(),
    };
    let BuiltMachine { target, clock, drives } = visit_machine(chip, &image, &setup, builder)?;
    let follower = view.as_ref().map(LadderView::follower);
    let options = SessionOptions { clock, max_copy_bytes: subject.history, follower };
    let sources = SourceFiles::new(files().map(String::as_str));
    let session = DebugSession::new(target, scope, options);
    Ok(OpenedSession { session, view, sources, snapshot_writer, file: subject.file.clone(), drives })
}

/// Collects the names of the program, and prints warnings about damaged debugging information.
fn program_scope(chip: &'static Chip, image: &Image, style: &MessageStyle) -> NameScope {
    let mut scope = NameScope::new(chip);
    scope.symbols.clone_from(&image.symbols);
    scope.lines = image.lines.clone();
    // The lines are parsed at the first access, which also collects the warnings.
    _ = scope.lines.all_lines();
    report_diagnostics(style, scope.lines.warnings(), FileTexts::NONE);
    scope
}

/// Creates a machine with its devices and queued drives.
struct SessionBuilder<'a> {
    machine: &'a MachineArgs,
    program: &'a str,
    wired: WiredMachine,
    view: Option<&'a LadderView>,
    scenario: Option<&'a ScenarioFile>,
    snapshot_writer: SnapshotWriter,
}

/// A machine before its first cycle, with its queued drives.
struct BuiltMachine {
    target: Box<dyn DynMachine>,
    clock: CycleClock,
    drives: Vec<TimedDrive>,
}

impl MachineVisitor for SessionBuilder<'_> {
    type Output = Result<BuiltMachine, VerbFailure>;

    fn visit<C: Cpu + 'static>(self, mut cpu: C) -> Self::Output {
        let WiredMachine { image, setup, hz, avr, eeprom, devices } = self.wired;
        let chip = cpu.chip();
        if let Some((_, held)) = eeprom {
            store::load_eeprom(&mut cpu, &held.unwrap_or_default());
        }
        let clock = CycleClock { hz, clocks_per_cycle: cpu.clocks_per_cycle() * avr.divider };
        let source = ProgramSource { names: AddressNames { chip, symbols: &image.symbols }, lines: &image.lines };
        let alias = |text: &str| self.view.map_or_else(|| text.to_owned(), |view| view.pin_assignment(text));
        let asked = self.machine.drives(&source, clock, &alias)?;
        check_pins_exist(&cpu, &asked, std::iter::empty())?;
        let mut board = devices.connect(chip, clock, &asked)?;
        // If two drives set a pin at the same time, the later one counts.
        let mut drives = self.view.map_or(Vec::new(), |view| ladder::default_drives(view, chip));
        drives.retain(|drive| !board.driven_pins().any(|pin| ladder::is_drive_of(drive, pin)));
        drives.extend(asked);
        if let Some(file) = self.scenario {
            let (mut copy, mut around) = (cpu.clone(), board.clone());
            queue_drives(&mut copy, &drives).map_err(VerbFailure::usage)?;
            around.connect(&mut copy);
            let driven = drives.iter().filter_map(TimedDrive::pin).chain(board.driven_pins()).collect();
            let (baud, serial_line_taken) = (self.machine.baud, !self.machine.uart_in.is_empty());
            let (names, snapshot_writer) = (source.names, self.snapshot_writer);
            let supplies = supply_changes(&drives);
            let known = ScenarioContext {
                program: self.program,
                names,
                clock,
                baud,
                serial_line_taken,
                driven,
                supplies,
                snapshot_writer,
            };
            drives.extend(scenario_drives(file, self.view, (copy, around), &known)?);
        }
        queue_drives(&mut cpu, &drives).map_err(VerbFailure::usage)?;
        pic16::warn_missing_config(chip, &image, &setup.pic16);
        board.connect(&mut cpu);
        Ok(BuiltMachine { target: Box::new(MachineWithDevices::new(cpu, board)), clock, drives })
    }
}
