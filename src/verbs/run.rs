//! `emu run`: runs an image on an emulated chip without user interaction.

mod cod;
mod cover;
mod cycle_profile;
mod headless;
mod lint;
mod plan;
mod rungs;
pub mod scenario;
mod signals;
mod snapshot;
mod summary;
mod trace;

use std::time::Duration;

use clap::Args;
use emu_core::chip::Chip;
use emu_core::cpu::RamInit;
use emu_debug::text_escapes::unescape;
use emu_debug::time;

use crate::shared::fail::VerbFailure;
use crate::shared::family::visit_machine;
use crate::shared::machine::{MachineArgs, MachineOptions, WiredMachine};
use crate::shared::output::RequestedOutput;
use crate::shared::report::MessageStyle;
use crate::shared::snapshots::SnapshotWriter;
use crate::shared::{family, input, output, snapshots};
use crate::verbs::run::lint::LintMode;
use headless::RunJob;
use snapshot::RunSnapshots;

use crate::shared::usage_error::UsageError;

const EXAMPLES: &str = "\
Examples:
  emu run blink.hex --mcu atmega328p --for 2s --vcd blink.vcd
  emu run hello.elf --mcu atmega328p --uart - --expect-uart 'done\\n' --fail-uart FAIL
  emu run press.hex --mcu atmega328p --set PD2=1 --at 10ms:PD2=0 --until 'pin PB5=1' --for 1s
  emu run app.elf --mcu atmega328p --until pc=main --peek data:0x100..0x120 --json
  emu run app.elf --mcu atmega328p --until pc=main.c:12 --peek buf
  emu run blink.hex --mcu atmega328p --scenario blink.toml --record again.toml
  emu run test.ihx --mcu at89s52 --symbols test.map --until 'read xdata:0x7654' --uart -

Exit codes: 0 the chip halted, an awaited event occurred, or a requested limit was reached; 1 --fail-uart was
seen, or the program halted while --until or --expect-uart still waited, or --lint=error found something, or
an expectation of --scenario was not met; 2 a usage error; 3 a file was refused or could not be written; 4 a
fault of the program; 5 a limit was reached while something was still awaited, or the default limit of 60 s of
the chip's time, or --timeout, or Ctrl-C.";

/// Default limit of a run, in simulated time.
const DEFAULT_LIMIT: &str = "60s";

/// Flags of `emu run`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RunArgs {
    /// A HEX or ELF file; for the 8051 family also an absolute object file (OMF-51); or an assembly source,
    /// by its name (.asm, .s, .a51, .src), which is assembled first. - is standard input.
    #[arg(value_name = "IMAGE")]
    image: String,
    /// End after this much chip time: 2s, 10ms, 2.5us, 100ns, or 1000c (machine cycles). Default: 60s.
    #[arg(long = "for", value_name = "TIME", conflicts_with = "cycles")]
    time: Option<String>,
    /// End after this many machine cycles.
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,
    /// The contents of RAM and registers after power-up: random:SEED, zero, or trap. With trap they are zero,
    /// and a read of RAM that the program has not written ends the run with exit code 4.
    #[arg(long, value_name = "FILL", default_value = "zero", value_parser = parse_ram)]
    ram: RamChoice,
    /// End when this condition becomes true: pc=0x1a2 (byte address, on PIC16 a word address), pc=main or
    /// pc=main+0x4 (symbol), pc=main.c:12 (source line), fetch=2 (AP101: fetched and not yet executed), 'pin
    /// PB5=1' (or 0, or z), 'write data:0x100', 'read xdata:0x7654', 'write buf' (all bytes of a variable),
    /// 'uart "text"'. Repeatable; any of them ends the run.
    #[arg(long, value_name = "COND")]
    until: Vec<String>,
    /// Show memory at the end: data:0x100..0x120 (end excluded), flash:0, sfr:P1, bit:0x20.3. Names of
    /// registers and of the program are addresses too; a variable of known size gives all its bytes:
    /// data:buf, data:buf+2, or buf if only one memory has that name. Repeatable.
    #[arg(long, value_name = "RANGE")]
    peek: Vec<String>,
    /// Write the pins and the sent bytes as a waveform (VCD); - is standard output.
    #[arg(long, value_name = "FILE")]
    vcd: Option<String>,
    /// Write the bytes that the chip sends on its first serial port to a file, unchanged. With - only these
    /// bytes go to standard output.
    #[arg(long, value_name = "FILE")]
    uart: Option<String>,
    /// End successfully when this text was sent; the escapes are \n \r \t \0 \\ \" \xNN. Exit code 1 or 5 if
    /// it is never sent. With --scenario the run continues to the end of the scenario.
    #[arg(long, value_name = "TEXT", value_parser = |t: &str| unescape(t).map(EscapedBytes))]
    expect_uart: Option<EscapedBytes>,
    /// End with exit code 1 when this text was sent; escapes as in --expect-uart.
    #[arg(long, value_name = "TEXT", value_parser = |t: &str| unescape(t).map(EscapedBytes))]
    fail_uart: Option<EscapedBytes>,
    /// End with exit code 5 after this much host time: 30s, 500ms.
    #[arg(long, value_name = "TIME", value_parser = time::parse_duration)]
    timeout: Option<Duration>,
    /// Report suspicious but legal behaviour of the program, each kind with its code, place and count. HOW is
    /// warn, the default, or error: a run that would end with exit code 0 then ends with 1. On every chip:
    /// reads of RAM that was never written. On AVR also registers that were never written, a stack that grows
    /// over data or heap, writes to reserved addresses and bits, baud rates that are off, interrupts without
    /// a service routine, reads of floating pins. On PIC16 also reads of analog pins, latch bits that a
    /// read-modify-write changes as a side effect, stack overflow and underflow, jumps with a wrong PCLATH,
    /// service routines that do not save W, STATUS or PCLATH, SLEEP without effect.
    #[arg(long, value_name = "HOW", num_args = 0..=1, require_equals = true, default_missing_value = "warn")]
    #[arg(hide_possible_values = true)]
    lint: Option<LintMode>,
    #[command(flatten)]
    scenario_flags: scenario::ScenarioFlags,
    /// One JSON document on standard output.
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    cover: cover::CoverageFlags,
    #[command(flatten)]
    trace: trace::TraceFlags,
    #[command(flatten)]
    snapshot: snapshot::SnapshotFlags,
    // Last, because clap puts all flags after it under the headings of the families.
    #[command(flatten)]
    machine: MachineArgs,
    /// Execute the messages in this .cod file, as gpsim does: external parts, commands, assertions. The
    /// program passes (exit code 0, otherwise 1, and 4 for an illegal instruction) when the first message
    /// that halts it says PASSED. The run has no start-up times. Its frequency is that of --clock, otherwise
    /// that of the messages, otherwise 20 MHz or the maximum of the chip. The file also gives the symbols.
    #[arg(long, value_name = "FILE", help_heading = "Only for the PIC16 family", conflicts_with_all = ["until", "peek", "vcd", "uart", "uart_in", "expect_uart", "fail_uart", "timeout", "lint", "attach", "trace"])]
    cod: Option<String>,
}

/// Bytes of a text with escapes. It is a separate type because clap treats `Vec<u8>` as a repeated flag.
#[derive(Debug, Clone)]
struct EscapedBytes(Vec<u8>);

/// The value of `--ram`: the contents of RAM after power-up.
#[derive(Debug, Clone, Copy)]
pub enum RamChoice {
    /// RAM holds these bytes, and the program may read them.
    Fill(RamInit),
    /// The program must write a byte before it reads it.
    Trap,
}

/// Parses the value of `--ram`.
pub fn parse_ram(text: &str) -> Result<RamChoice, UsageError> {
    match text.split_once(':') {
        None if text == "zero" => Ok(RamChoice::Fill(RamInit::Zero)),
        None if text == "trap" => Ok(RamChoice::Trap),
        Some(("random", seed)) => {
            let wrong = |_| UsageError::MalformedPart {
                part: seed.to_owned(),
                wanted: "a seed",
                expected: "write a number, as in random:1".into(),
            };
            let seed = seed.parse().map_err(wrong)?;
            Ok(RamChoice::Fill(RamInit::Random(seed)))
        }
        _ => Err(UsageError::malformed("write random:SEED, zero or trap")),
    }
}

/// Runs an image.
pub fn run<'a>(args: &'a RunArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let machine = &args.machine;
    let stdout = ("--json", if args.json { "-" } else { "" });
    let file = |file: &'a Option<String>| file.as_deref().unwrap_or("");
    let outputs = [
        stdout,
        ("--uart", file(&args.uart)),
        ("--vcd", file(&args.vcd)),
        ("--trace", file(&args.trace.trace)),
        ("--snapshot-out", file(&args.snapshot.snapshot_out)),
        ("--eeprom", file(&machine.eeprom)),
    ];
    let device_files = machine.attach.iter().map(|attached| ("--attach", file(&attached.file)));
    let recorded_scenario = ("--record", file(&args.scenario_flags.record));
    let outputs = outputs.into_iter().chain([recorded_scenario]).chain(args.cover.outputs()).chain(device_files);
    let given = outputs.filter(|(_, file)| !file.is_empty());
    let output_files: Vec<_> = given.map(|(flag, file)| RequestedOutput::new(flag, file)).collect();
    output::check_distinct_outputs(&output_files)?;
    let scenario_inputs = args.scenario_flags.scenario.iter().chain(&args.scenario_flags.stimulus);
    let inputs = std::iter::once(&args.image).chain(&machine.symbols).chain(&args.snapshot.snapshot_in);
    let more_inputs = args.trace.inputs().chain(args.cover.inputs());
    let mut protected_files: Vec<String> = inputs.chain(scenario_inputs).chain(more_inputs).cloned().collect();
    for file in &protected_files {
        output::check_input_not_overwritten(file, &output_files)?;
    }
    protected_files.extend(output_files.iter().map(|output| output.file.to_owned()));
    if matches!(args.ram, RamChoice::Trap) && args.snapshot.snapshot_in.is_some() {
        let why =
            "--ram trap cannot be used with --snapshot-in: a snapshot does not record which bytes of RAM were written";
        return Err(VerbFailure::Usage(why.to_owned()));
    }
    let chip_choice = machine.mcu.choose_chip(&args.image)?;
    let chip = chip_choice.chip;
    let to_stdout = output_files.iter().any(|requested| output::is_stdout(requested.file));
    check_serial_flags(args, chip)?;
    let cod = &args.cod;
    let mut script = cod.as_deref().map(|file| cod::read_script(file, chip)).transpose()?;
    let clock = match (&mut script, cod) {
        (Some(script), Some(file)) => Some(cod::choose_script_clock(script, file, machine.clock, chip)?),
        _ => chip_choice.clock(machine.clock),
    };
    let ram = match args.ram {
        RamChoice::Fill(init) => init,
        RamChoice::Trap => RamInit::Zero,
    };
    let start_up = !machine.no_start_up && script.is_none();
    let symbols: Vec<String> = machine.symbols.iter().chain(cod).cloned().collect();
    let wired =
        machine.wire_machine(chip, &MachineOptions { ram, bus: args.vcd.is_some(), clock, start_up }, || {
            input::read_image_with_symbols(&args.image, &symbols, chip, style)
        })?;
    chip_choice.report_simavr_requests(&wired.image, args.vcd.is_some());
    let WiredMachine { image, mut setup, hz, avr, eeprom, devices } = wired;
    // The test programs of gpsim convert without waiting for the acquisition time.
    setup.pic16.ideal_acquisition = script.is_some();
    let snapshot_writer = SnapshotWriter { head: snapshots::snapshot_header(chip, &image, &setup), protected_files };
    let snapshots = RunSnapshots::open(&args.snapshot, snapshot_writer.head.clone())?;
    let pic16 = setup.pic16;
    let headless = RunJob {
        args,
        image: &image,
        script,
        hz,
        avr,
        pic16,
        eeprom,
        snapshots,
        snapshot_writer,
        devices,
        to_stdout,
        style,
    };
    visit_machine(chip, &image, &setup, headless)
}

/// Refuses flags for serial bytes on a chip without a serial port.
fn check_serial_flags(args: &RunArgs, chip: &Chip) -> Result<(), VerbFailure> {
    let serial_flags = [
        ("--uart", args.uart.is_some()),
        ("--uart-in", !args.machine.uart_in.is_empty()),
        ("--expect-uart", args.expect_uart.is_some()),
        ("--fail-uart", args.fail_uart.is_some()),
        ("--until 'uart ..'", args.until.iter().any(|text| text.trim().starts_with("uart"))),
    ];
    match serial_flags.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) if !family::has_uart(chip) => {
            Err(VerbFailure::Usage(format!("{flag} is for chips with a serial port; {} has none", chip.name)))
        }
        _ => Ok(()),
    }
}
