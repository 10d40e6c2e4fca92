//! Runs served programs: on this computer, on an emulated AVR, or on an emulated 8051.

use diag::Diagnostic;
use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, Probe, RamInit, StopReason};
use emu_core::image::{self, ElfMachine, Image};
use ladder_compile::emit::{EmittedSource, bytecode};

use super::c_unit;
use super::codes;
use super::external_tools::{ScratchFolder, run_compiler, run_with_input, tool_error};
use super::script::{ScanRecord, ServeScript, SlotNumbering};
use crate::error::stop_text;

/// Maximum machine cycles that a chip takes for one byte of the script. A scan with its record takes longest.
const MAX_CYCLES_PER_BYTE: u64 = 4_000_000;

const STRICT_FLAGS: [&str; 5] = ["-std=c89", "-pedantic", "-Wall", "-Wextra", "-Werror"];

fn to_strings(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// Runs C programs on this computer, each with its script. All programs are compiled into one executable,
/// which takes much less time than one executable each. `portable` disables what compilers guarantee beyond
/// the C standard.
///
/// # Errors
/// A compiler is missing or refuses a source, a file cannot be written, or a program ends early.
pub fn run_native(
    programs: &[(EmittedSource, ServeScript)],
    portable: bool,
) -> Result<Vec<Vec<ScanRecord>>, Diagnostic> {
    let scratch = ScratchFolder::new()?;
    let mut args = to_strings(&STRICT_FLAGS);
    args.extend(to_strings(if portable { &["-O0", "-DPLC_PORTABLE"] } else { &["-O1"] }));
    args.extend(to_strings(&["-o", "served"]));
    for ((source, _), n) in programs.iter().zip(0..) {
        let name = format!("program{n}.c");
        scratch.write(&name, c_unit::member_unit(source, n))?;
        args.push(name);
    }
    scratch.write("main.c", c_unit::switchboard(programs.len()))?;
    args.push("main.c".to_owned());
    run_compiler("gcc", "gcc", &args, &scratch)?;
    let begin = |n: usize, _: &EmittedSource| vec![b'L', n as u8, (n >> 8) as u8];
    exchange(programs, SlotNumbering::InOrder, &scratch, begin)
}

/// Runs programs as byte code on this computer, each with its script.
///
/// # Errors
/// The errors of [`run_native`].
pub fn run_interpreted(programs: &[(EmittedSource, ServeScript)]) -> Result<Vec<Vec<ScanRecord>>, Diagnostic> {
    let scratch = ScratchFolder::new()?;
    scratch.write("plc.c", bytecode::INTERPRETER)?;
    scratch.write("plc.h", bytecode::INTERPRETER_HEADER)?;
    scratch.write("main.c", c_unit::interpreter_unit())?;
    let mut args = to_strings(&STRICT_FLAGS);
    args.extend(to_strings(&[
        "-O1",
        "-DPLC_MAX_BITS=65536",
        "-DPLC_MAX_WORDS=65536",
        "-o",
        "served",
        "main.c",
        "plc.c",
    ]));
    run_compiler("gcc", "gcc", &args, &scratch)?;
    let begin = |_: usize, source: &EmittedSource| {
        let mut bytes = vec![b'L'];
        bytes.extend((source.image.len() as u32).to_le_bytes());
        bytes.extend(&source.image);
        bytes
    };
    exchange(programs, SlotNumbering::Interpreter, &scratch, begin)
}

/// Sends all scripts to the executable `served` and parses its records.
fn exchange(
    programs: &[(EmittedSource, ServeScript)],
    slots: SlotNumbering,
    scratch: &ScratchFolder,
    begin: impl Fn(usize, &EmittedSource) -> Vec<u8>,
) -> Result<Vec<Vec<ScanRecord>>, Diagnostic> {
    let mut input = Vec::new();
    for ((source, script), n) in programs.iter().zip(0..) {
        input.extend(begin(n, source));
        input.extend(script.bytes());
        input.push(b'U');
    }
    let answer = run_with_input(&scratch.at("served"), &input, scratch)?;
    let mut rest = answer.as_slice();
    let mut all = Vec::new();
    for ((source, script), n) in programs.iter().zip(1..) {
        let shape = slots.record_shape(source);
        let mut records = Vec::new();
        for scan in 0..script.scans() {
            let (Some(record), Some(more)) = (shape.read_record(rest), rest.get(shape.len()..)) else {
                return Err(stopped_diagnostic(format!(
                    "program {n} ended in scan {} of {}",
                    scan + 1,
                    script.scans()
                )));
            };
            records.push(record);
            rest = more;
        }
        rest = match rest.split_first() {
            Some((b'U', more)) => more,
            _ => return Err(stopped_diagnostic(format!("program {n} did not end after its last scan"))),
        };
        all.push(records);
    }
    Ok(all)
}

fn stopped_diagnostic(cause: String) -> Diagnostic {
    tool_error(codes::STOPPED, cause, "please report this with the program")
}

/// The form of a source that is served on a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ServedForm {
    /// C.
    C,
    /// Byte code with its interpreter.
    Bytecode,
}

/// Runs one program on the emulated chip `mcu` with its script: an ATmega48 to 328, or an 8051 family chip.
///
/// # Errors
/// The errors of [`run_native`], and a chip on which this form is not supported.
pub fn run_on_chip(
    source: &EmittedSource,
    script: &ServeScript,
    form: ServedForm,
    mcu: &str,
) -> Result<Vec<ScanRecord>, Diagnostic> {
    let mcu = mcu.to_ascii_lowercase();
    let scratch = ScratchFolder::new()?;
    let mut files = vec!["main.c".to_owned()];
    let slots = match form {
        ServedForm::C => {
            scratch.write("main.c", c_unit::standalone_unit(source))?;
            SlotNumbering::InOrder
        }
        ServedForm::Bytecode => {
            scratch.write("main.c", c_unit::interpreted_unit(source))?;
            scratch.write("plc.c", bytecode::INTERPRETER)?;
            scratch.write("plc.h", bytecode::INTERPRETER_HEADER)?;
            files.push("plc.c".to_owned());
            SlotNumbering::Interpreter
        }
    };
    let room = (format!("-DPLC_MAX_BITS={}", source.bits.max(1)), format!("-DPLC_MAX_WORDS={}", source.words.max(1)));
    let answer = if let Some(chip) = emu_avr::chips::chip(&mcu).filter(|chip| has_standard_gpior(chip.name)) {
        let mut args = to_strings(&STRICT_FLAGS);
        args.extend([format!("-mmcu={mcu}"), room.0, room.1]);
        args.extend(to_strings(&["-Os", "-o", "served.elf"]));
        args.extend(files);
        run_compiler("avr-gcc", "gcc-avr avr-libc", &args, &scratch)?;
        let loaded = load_compiled_image(&scratch, "served.elf", chip, ElfMachine::AVR)?;
        // Data memory addresses of GPIOR1 and GPIOR0: DS40002061, 8.6.
        let ports = ServePorts { space: "data", from_checker: 0x4A, to_checker: 0x3E };
        serve_script(emu_avr::Avr::new(chip, &loaded, RamInit::Random(1)), ports, script)?
    } else if let (Some(chip), ServedForm::C) = (emu_8051::chips::chip(&mcu), form) {
        let mut args = to_strings(&["-mmcs51", "--model-large", "--std-c89", "--Werror", "--xram-size", "0x7F00"]);
        // The disabled warnings are unreachable code after endless loops, and comparisons with a constant
        // result.
        args.extend(to_strings(&["--disable-warning", "126", "--disable-warning", "110", "-o", "served.ihx"]));
        args.extend(files);
        run_compiler("sdcc", "sdcc", &args, &scratch)?;
        let loaded = load_compiled_image(&scratch, "served.ihx", chip, ElfMachine::MCS51)?;
        // The programs are larger than the internal program memory, so all of it is external.
        let options = emu_8051::Options { ea: false, ..emu_8051::Options::default() };
        let ports = ServePorts { space: "xdata", from_checker: 0x7FFE, to_checker: 0x7FFF };
        serve_script(emu_8051::Mcs51::with(chip, &loaded, RamInit::Random(1), options), ports, script)?
    } else {
        let cause = format!("emitted sources of this kind cannot be served on `{mcu}`");
        return Err(tool_error(codes::NO_WAY, cause, "name an ATmega48 to 328, or for C a chip of the 8051 family"));
    };
    let shape = slots.record_shape(source);
    let records: Vec<ScanRecord> = answer.chunks(shape.len()).filter_map(|bytes| shape.read_record(bytes)).collect();
    if records.len() as u64 == script.scans() {
        return Ok(records);
    }
    Err(stopped_diagnostic(format!("the chip reported {} of {} scans", records.len(), script.scans())))
}

/// Returns true for the chips with GPIOR0 and GPIOR1 at the usual addresses.
fn has_standard_gpior(name: &str) -> bool {
    ["atmega48", "atmega88", "atmega168", "atmega328"].iter().any(|family| name.starts_with(family))
}

/// Loads the ELF or HEX file that a compiler has written.
pub(super) fn load_compiled_image(
    scratch: &ScratchFolder,
    name: &str,
    chip: &Chip,
    machine: ElfMachine,
) -> Result<Image, Diagnostic> {
    let loaded = image::load(name, &scratch.read(name)?, chip.hex_spaces, chip.elf_spaces, machine);
    loaded.map(|loaded| loaded.image).map_err(|faults| {
        let first = faults.into_iter().next().map_or_else(String::new, |fault| fault.to_string());
        tool_error(
            codes::TOOL_FAILED,
            format!("the image does not load: {first}"),
            "the program may be too large for the chip",
        )
    })
}

/// The two memory cells through which a chip exchanges bytes with the checker.
#[derive(Clone, Copy)]
struct ServePorts {
    space: &'static str,
    from_checker: u16,
    to_checker: u16,
}

/// A probe that records the bytes that the chip sends, and stops after the chip has read a byte.
struct ServeProbe {
    space: u8,
    ports: ServePorts,
    output: Vec<u8>,
}

impl Probe for ServeProbe {
    const DATA: bool = true;
    fn on_data_access(&mut self, _: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if space == self.space && addr == self.ports.to_checker && write {
            self.output.push(value);
        }
        space == self.space && addr == self.ports.from_checker && !write
    }
}

/// Runs a chip with its script byte by byte: each byte is in the cell before the chip reads it.
fn serve_script<C: Cpu>(mut cpu: C, ports: ServePorts, script: &ServeScript) -> Result<Vec<u8>, Diagnostic> {
    let space = cpu.chip().spaces.iter().position(|space| space.name == ports.space).unwrap_or(0) as u8;
    let mut watch = ServeProbe { space, ports, output: Vec::new() };
    for (byte, n) in script.bytes().iter().chain(b"U").zip(1..) {
        cpu.poke(ports.space, ports.from_checker.into(), *byte);
        let stop = cpu.run(cpu.cycle() + MAX_CYCLES_PER_BYTE, &mut watch);
        if stop != StopReason::Probe {
            return Err(stopped_diagnostic(format!(
                "the chip did not read byte {n} of the script: {}, at byte address 0x{:04X}",
                stop_text(stop),
                cpu.pc() * cpu.chip().word_bytes
            )));
        }
    }
    Ok(watch.output)
}
