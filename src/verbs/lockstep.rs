//! `emu lockstep`: runs a machine in lockstep with another simulator.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use clap::{Args, ValueEnum};
use diag::text::readable;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::{Cpu, RamInit, StopReason};
use emu_core::image::{HexSegment, Image, write_hex};
use emu_debug::lockstep::gpsim::{self, GpsimPeer};
use emu_debug::lockstep::s51::{self, S51Peer};
use emu_debug::lockstep::simavr::{self, SimavrPeer};
use emu_debug::lockstep::{
    CYCLES_NAME, CompareOptions, ExecutedInstruction, LockstepEnd, LockstepOutcome, LockstepReport, PeerSimulator,
    PeerStart, RegisterView, compare,
};
use emu_debug::{AddressNames, CycleClock, ProgramSource, time};
use serde_json::{Value, json};

use crate::shared::codes::{PEER_FAILED, PEER_LACKS_CHIP, PEER_TIMED_OUT, file_error};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::family::{MachineSetup, MachineVisitor, visit_machine};
use crate::shared::flags::McuFlags;
use crate::shared::interrupts::listen_for_interrupts;
use crate::shared::report::{FileTexts, MessageStyle};
use crate::shared::{input, output, readings};

const EXAMPLES: &str = "\
Examples:
  emu lockstep app.ihx --mcu 8052 --against s51 --for 10ms
  emu lockstep app.hex --mcu pic16f877a --against gpsim --steps 5000 --ignore FSR
  emu lockstep app.hex --mcu atmega328p --against simavr --last 20

Exit codes: 0 no difference; 1 a difference; 2 a usage error, or the peer is not installed; 3 a file or the
peer's answer was refused, or the peer does not have the chip or did not answer in time; 5 a signal (Ctrl-C)
ended the comparison.";

/// Default limit of a run without another limit, in instructions.
const DEFAULT_STEPS: u64 = 100_000;

/// Default time limit for an answer of the peer, in seconds.
const DEFAULT_TIMEOUT_S: u64 = 10;

/// Words of the longest instruction of any family.
const MAX_INSTRUCTION_WORDS: u32 = 3;

/// Flags of `emu lockstep`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct LockstepArgs {
    /// A HEX or ELF file, or an assembly source by its name; for gpsim a HEX file.
    #[arg(value_name = "IMAGE")]
    image: String,
    #[command(flatten)]
    mcu: McuFlags,
    /// The simulator: s51 for the 8051 family, gpsim for PIC16, simavr for AVR.
    #[arg(long, value_name = "PEER", value_enum)]
    against: PeerChoice,
    /// End after this much chip time: 10ms, 1000c (machine cycles).
    #[arg(long = "for", value_name = "TIME", conflicts_with = "cycles")]
    time: Option<String>,
    /// End after this many machine cycles.
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,
    /// End after this many instructions. Default: 100000, or no limit if a time or cycles are given.
    #[arg(long, value_name = "N")]
    steps: Option<u64>,
    /// Oscillator frequency of both: 16MHz, 8000000. Default: the frequency in the chip's row.
    #[arg(long, value_name = "HZ", value_parser = time::parse_hertz)]
    clock: Option<u64>,
    #[command(flatten)]
    readings: readings::ReadingFlags,
    /// Ignore differences in this register, named as in `emu run`. Repeatable.
    #[arg(long, value_name = "REG")]
    ignore: Vec<String>,
    /// Ignore differences in cycles. simavr does not report cycles.
    #[arg(long)]
    cycles_free: bool,
    /// Number of instructions to show before the difference.
    #[arg(long, value_name = "N", default_value_t = 8)]
    last: usize,
    /// End the peer if an answer takes longer than this, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_TIMEOUT_S, value_parser = clap::value_parser!(u64).range(1..=86_400))]
    timeout: u64,
    /// The peer's executable, if it is not on the PATH under its own name.
    #[arg(long, value_name = "FILE")]
    peer: Option<PathBuf>,
    /// Symbol files of SDCC or gputils, as in `emu run`. Repeatable.
    #[arg(long, value_name = "FILE")]
    symbols: Vec<String>,
    /// One JSON document on standard output.
    #[arg(long)]
    pub json: bool,
}

/// The peer simulators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum PeerChoice {
    /// s51 of uCsim, for the 8051 family.
    S51,
    /// gpsim of GNU PIC, for the PIC16 family.
    Gpsim,
    /// simavr, for AVR.
    Simavr,
}

impl PeerChoice {
    /// Returns the program with its Debian package, and the family.
    fn package_and_family(self) -> ((&'static str, &'static str), ChipFamily) {
        match self {
            PeerChoice::S51 => (s51::PROGRAM, ChipFamily::Mcs51),
            PeerChoice::Gpsim => (gpsim::PROGRAM, ChipFamily::Pic16),
            PeerChoice::Simavr => (simavr::PROGRAM, ChipFamily::Avr),
        }
    }

    fn name(self) -> &'static str {
        self.package_and_family().0.0
    }

    /// Returns the name of the equivalent chip that the peer simulates, if it does not have ours under its
    /// own name.
    fn equivalent_chip(self, chip: &str) -> Option<&'static str> {
        match self {
            PeerChoice::S51 => None,
            PeerChoice::Gpsim => gpsim::equivalent_chip(chip),
            PeerChoice::Simavr => simavr::equivalent_chip(chip),
        }
    }
}

/// Runs an image on both machines and compares them.
pub fn lockstep(args: &LockstepArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let chosen = args.mcu.choose_chip(&args.image)?;
    let chip = chosen.chip;
    if args.against.package_and_family().1 != chip.family {
        let fits = [PeerChoice::S51, PeerChoice::Gpsim, PeerChoice::Simavr]
            .into_iter()
            .find(|peer| peer.package_and_family().1 == chip.family);
        let hint = fits.map_or("no peer is known for it".to_owned(), |peer| format!("give --against {}", peer.name()));
        return Err(VerbFailure::Usage(format!("{} has no {}; {hint}", args.against.name(), chip.name)));
    }
    let known = |name: &String| {
        name.eq_ignore_ascii_case(CYCLES_NAME) || chip.cpu_regs.iter().any(|reg| reg.eq_ignore_ascii_case(name))
    };
    if let Some(odd) = args.ignore.iter().find(|name| !known(name)) {
        let why = format!("{} has {}", chip.name, chip.cpu_regs.join(", "));
        return Err(VerbFailure::invalid_flag_value("--ignore <REG>", odd, &why));
    }
    let readings = args.readings.of(chip)?;
    let image = input::read_image_with_symbols(&args.image, &args.symbols, chip, style)?;
    let hz = chosen.clock(args.clock).unwrap_or(chip.default_hz);
    let setup = MachineSetup {
        ram: RamInit::Zero,
        bus: false,
        avr: emu_avr::Options { readings: readings.avr, ..emu_avr::Options::at_hz(hz) },
        mcs51: emu_8051::Options { readings: readings.mcs51, ..emu_8051::Options::default() },
        pic16: emu_pic16::Options { hz, start_up: false, readings: readings.pic16, ..emu_pic16::Options::default() },
        ap101: emu_ap101::Options::default(),
    };
    visit_machine(chip, &image, &setup, OwnMachine { args, image: &image, hz })
}

/// The machine of `emu` in the comparison.
struct OwnMachine<'a> {
    args: &'a LockstepArgs,
    image: &'a Image,
    hz: u64,
}

impl MachineVisitor for OwnMachine<'_> {
    type Output = Result<u8, VerbFailure>;

    fn visit<C: Cpu>(self, mut cpu: C) -> Self::Output {
        let (args, chip) = (self.args, cpu.chip());
        let clock = CycleClock { hz: self.hz, clocks_per_cycle: cpu.clocks_per_cycle() };
        let until = match (&args.time, args.cycles) {
            (Some(text), _) => {
                clock.parse_cycles(text).map_err(|why| VerbFailure::invalid_flag_value("--for <TIME>", text, &why))?
            }
            (None, Some(n)) => n,
            (None, None) => u64::MAX,
        };
        let limited = args.time.is_some() || args.cycles.is_some();
        let terms = CompareOptions {
            ignore: args.ignore.clone(),
            ignore_cycles: args.cycles_free,
            until,
            max_steps: args.steps.unwrap_or(if limited { u64::MAX } else { DEFAULT_STEPS }),
            kept_instructions: args.last,
        };
        // Before the temporary folder exists, so that a signal cannot leave it on disk.
        let interrupt = listen_for_interrupts();
        let folder = TemporaryFolder::new()
            .map_err(|error| VerbFailure::write_failed("the folder for the peer's files", &error))?;
        let hex = self.write_hex(chip, &folder.0)?;
        let peer = self.start_peer(&folder.0, &hex, &cpu, &interrupt);
        let ran = peer.and_then(|mut peer| compare(&mut cpu, &mut *peer, &terms));
        let report = match ran {
            // The signal came before the peer started.
            Err(error) if error.kind() == io::ErrorKind::Interrupted => LockstepReport::interrupted(cpu.cycle()),
            ran => ran.map_err(|error| self.peer_failure(&error))?,
        };
        let source =
            ProgramSource { names: AddressNames { chip, symbols: &self.image.symbols }, lines: &self.image.lines };
        let peer = args.against;
        let report_text = LockstepText {
            source,
            cpu: &cpu,
            peer: peer.name(),
            stand_in: peer.equivalent_chip(chip.name),
            report: &report,
        };
        if args.json {
            output::print_json(&report_text.document())?;
        } else {
            output::print(report_text.text())?;
        }
        Ok(match report.outcome {
            LockstepOutcome::Same { end: LockstepEnd::Interrupted } => exit::LIMIT,
            LockstepOutcome::Same { .. } => exit::OK,
            LockstepOutcome::Differs { .. } => exit::FAILED,
        })
    }
}

impl OwnMachine<'_> {
    /// Writes the program as a HEX file for the peer, in the temporary folder.
    fn write_hex(&self, chip: &Chip, folder: &Path) -> Result<String, VerbFailure> {
        const NAME: &str = "program.hex";
        let place = folder.join(NAME);
        let made = if chip.family == ChipFamily::Pic16 {
            // Only the HEX file has the addresses of the configuration words.
            let text = readable(&input::read_bytes(&self.args.image)?);
            // gpsim accepts only records.
            let records: Vec<&str> = text.lines().map(str::trim).filter(|line| line.starts_with(':')).collect();
            if records.is_empty() {
                let why = "gpsim reads Intel HEX; give it the HEX file (`emu asm` writes one)";
                return Err(VerbFailure::Usage(why.to_owned()));
            }
            fs::write(&place, records.join("\n") + "\n")
        } else if chip.family == ChipFamily::Avr {
            // simavr starts at the last segment of a file with gaps.
            let mut code = vec![0xFF; self.image.end(chip.code_space) as usize];
            self.image.fill(chip.code_space, &mut code);
            fs::write(&place, write_hex(&[HexSegment { addr: 0, bytes: &code }]))
        } else {
            let code = self.image.segments.iter().filter(|segment| segment.space == chip.code_space);
            fs::write(
                &place,
                write_hex(&code.map(|one| HexSegment { addr: one.addr, bytes: &one.bytes }).collect::<Vec<_>>()),
            )
        };
        made.map_err(|error| VerbFailure::write_failed(&place.display().to_string(), &error))?;
        Ok(NAME.to_owned())
    }

    fn start_peer<C: Cpu>(
        &self,
        folder: &Path,
        hex: &str,
        cpu: &C,
        interrupt: &Arc<AtomicBool>,
    ) -> io::Result<Box<dyn PeerSimulator>> {
        // The path is relative to the current folder, but the peer runs in the temporary folder.
        let own = self.args.peer.as_deref();
        let program = own.map_or(Ok(PathBuf::from(self.args.against.name())), std::path::absolute)?;
        let start = PeerStart {
            program: &program,
            folder,
            hex,
            chip: cpu.chip().name,
            sp: cpu.reg("SP").unwrap_or(0),
            hz: self.hz,
            clocks_per_cycle: cpu.clocks_per_cycle(),
            timeout: Duration::from_secs(self.args.timeout),
            interrupt,
        };
        Ok(match self.args.against {
            PeerChoice::S51 => Box::new(S51Peer::new(&start)?),
            PeerChoice::Gpsim => Box::new(GpsimPeer::new(&start)?),
            PeerChoice::Simavr => Box::new(SimavrPeer::new(&start)?),
        })
    }

    /// Returns the failure for an error of the peer.
    fn peer_failure(&self, error: &io::Error) -> VerbFailure {
        let ((program, package), _) = self.args.against.package_and_family();
        let (code, cause, hint) = match (error.kind(), &self.args.peer) {
            (io::ErrorKind::NotFound, None) => {
                return VerbFailure::Usage(format!(
                    "{program} is not installed; Debian has it in the package {package}"
                ));
            }
            (io::ErrorKind::NotFound | io::ErrorKind::PermissionDenied, Some(file)) => {
                return VerbFailure::invalid_flag_value(
                    "--peer <FILE>",
                    &file.display().to_string(),
                    &crate::shared::codes::system_message(error),
                );
            }
            (io::ErrorKind::Unsupported, _) => (
                PEER_LACKS_CHIP,
                format!("has no {error}"),
                "docs/lockstep.md lists what it has; take another chip, or another peer",
            ),
            (io::ErrorKind::TimedOut, _) => (
                PEER_TIMED_OUT,
                format!("was ended: {error}"),
                "give more time with --timeout, or start it by hand and see what it says",
            ),
            _ => {
                let hint = "start it by hand with the same image, and see what it says";
                (PEER_FAILED, format!("does not do what it is asked: {error}"), hint)
            }
        };
        VerbFailure::Refused(vec![file_error(code, program, cause, hint)], FileTexts::default())
    }
}

/// A temporary folder that `drop` removes.
struct TemporaryFolder(PathBuf);

impl TemporaryFolder {
    fn new() -> io::Result<TemporaryFolder> {
        let base = std::env::temp_dir();
        for n in 0..u32::MAX {
            let folder = base.join(format!("emu-lockstep-{}-{n}", std::process::id()));
            match fs::create_dir(&folder) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                made => return made.map(|()| TemporaryFolder(folder)),
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        _ = fs::remove_dir_all(&self.0);
    }
}

/// The report of a comparison, as text or JSON.
struct LockstepText<'a, C> {
    source: ProgramSource<'a>,
    cpu: &'a C,
    peer: &'static str,
    stand_in: Option<&'static str>,
    report: &'a LockstepReport,
}

impl<C: Cpu> LockstepText<'_, C> {
    /// Returns an executed instruction with its address.
    fn instruction_line(&self, executed: &ExecutedInstruction) -> String {
        let chip = self.source.names.chip;
        let byte = |addr: u32| u16::from(self.cpu.peek(chip.code_space, addr % chip.flash_bytes).unwrap_or(0xFF));
        let size = chip.word_bytes;
        let word = |start: u32| (0..size).rev().fold(0, |high, i| high << 8 | byte(start + i));
        let words: Vec<u16> = (0..MAX_INSTRUCTION_WORDS).map(|i| word((executed.pc + i) * size)).collect();
        let text = (chip.isa.disassemble)(&words, executed.pc).text;
        format!("{}  {text}", self.source.describe_word(executed.pc))
    }

    fn vector(&self, number: u8) -> String {
        let names = self.source.names.chip.vectors;
        names.get(usize::from(number)).map_or_else(|| number.to_string(), |name| (*name).to_owned())
    }

    fn text(&self) -> String {
        let LockstepReport { outcome, steps, cycle, last_instructions: last, sleeps_of_other_length: other_sleeps } =
            self.report;
        let peer = self.stand_in.map_or(self.peer.to_owned(), |other| format!("{} as {other}", self.peer));
        let (before, ours, theirs, differing, shared_interrupt) = match outcome {
            LockstepOutcome::Same { end } => {
                let end = match end {
                    LockstepEnd::Limit => String::new(),
                    LockstepEnd::Interrupted => "; interrupted".to_owned(),
                    LockstepEnd::Stopped(StopReason::Halted) => "; the program has ended".to_owned(),
                    LockstepEnd::Stopped(_) => {
                        format!("; no instruction at {}", self.source.describe_word(self.cpu.pc()))
                    }
                };
                let slept = match other_sleeps {
                    0 => String::new(),
                    n => format!("; {n} sleeps of another length"),
                };
                return format!("agreed     with {peer} in {steps} instructions, {cycle} cycles{slept}{end}\n");
            }
            LockstepOutcome::Differs { before, ours, theirs, differing_names: differing, shared_interrupt } => {
                (before, ours, theirs, differing, shared_interrupt)
            }
        };
        let mut out = format!("differs    from {peer} after {steps} instructions: {}\n", differing.join(", "));
        for (i, executed) in last.iter().enumerate() {
            let mark = if i + 1 == last.len() { '>' } else { ' ' };
            out.push_str(&format!("{mark} cycle {:>8}  {}\n", executed.cycle, self.instruction_line(executed)));
            if let Some(vector) = executed.interrupt {
                out.push_str(&format!("  then the interrupt {}\n", self.vector(vector)));
            }
        }
        if let Some(vector) = shared_interrupt {
            let name = self.vector(*vector);
            out.push_str(&format!("the interrupt {name} is entered by both, at different instructions\n"));
        }
        out.push_str(&format!("{:<10} {:>8}  {:>8}  {:>8}\n", "register", "before", "emu", self.peer));
        let rows = before.regs.iter().zip(&ours.regs).zip(&theirs.regs);
        // Registers that neither machine changed are omitted.
        for ((before, ours), theirs) in rows.filter(|((before, ours), theirs)| before.1 != ours.1 || ours.1 != theirs.1)
        {
            let mark = if differing.contains(&ours.0) { "  <" } else { "" };
            let [before, one, other] = [before, ours, theirs].map(|(_, value)| format!("0x{value:02x}"));
            out.push_str(&format!("{:<10} {before:>8}  {one:>8}  {other:>8}{mark}\n", ours.0));
        }
        if let (Some(before), Some(ours), Some(theirs)) = (before.cycle, ours.cycle, theirs.cycle) {
            let mark = if differing.contains(&CYCLES_NAME) { "  <" } else { "" };
            out.push_str(&format!("{CYCLES_NAME:<10} {before:>8}  {ours:>8}  {theirs:>8}{mark}\n"));
        }
        out
    }

    fn document(&self) -> Value {
        let LockstepReport { outcome, steps, cycle, last_instructions: last, sleeps_of_other_length: other_sleeps } =
            self.report;
        let view = |view: &RegisterView| {
            let regs = view.regs.iter().map(|(name, value)| ((*name).to_owned(), json!(value)));
            json!({ "cycle": view.cycle, "registers": Value::Object(regs.collect()) })
        };
        let executed = |executed: &ExecutedInstruction| {
            json!({ "cycle": executed.cycle, "addr": self.source.names.chip.code_address(executed.pc), "text": self.instruction_line(executed),
                    "interrupt": executed.interrupt.map(|vector| self.vector(vector)) })
        };
        let difference = match outcome {
            LockstepOutcome::Same { .. } => Value::Null,
            LockstepOutcome::Differs { before, ours, theirs, differing_names: differing, shared_interrupt } => {
                json!({
                    "what": differing, "interrupt": shared_interrupt.map(|vector| self.vector(vector)), "before": view(before), "emu": view(ours), "peer": view(theirs),
                    "last": last.iter().map(executed).collect::<Vec<_>>(),
                })
            }
        };
        json!({
            "schema": 1, "mcu": self.source.names.chip.name, "against": self.peer, "as": self.stand_in, "instructions": steps, "cycles": cycle,
            "other_sleeps": other_sleeps,
            "agreed": matches!(outcome, LockstepOutcome::Same { .. }), "interrupted": matches!(outcome, LockstepOutcome::Same { end: LockstepEnd::Interrupted }),
            "difference": difference,
        })
    }
}
