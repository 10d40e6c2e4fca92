//! Served programs: on this computer, on an emulated AVR, on an emulated 8051.

use diag::Diagnostic;
use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, Probe, RamInit, Stop};
use emu_core::image::{self, ElfMachine, Image};
use ladder_compile::emit::Source;

use super::codes;
use super::script::{Record, Script, Slots};
use super::tools::{Scratch, compile, error, talk};
use super::unit::{self, PLC_C, PLC_H};

/// Machine cycles that a scan may take where it is served, its telling with it.
const SCAN_CYCLES: u64 = 4_000_000;

const STRICT: [&str; 5] = ["-std=c89", "-pedantic", "-Wall", "-Wextra", "-Werror"];

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// Runs C programs on this computer, each by its script: one program is made of all, which takes much less time than one
/// of each. `portable` leaves out what compilers are known to do beyond the standard.
///
/// # Errors
/// A compiler that is missing or refuses a source, a file that cannot be written, a program that tells too little.
pub fn native(programs: &[(Source, Script)], portable: bool) -> Result<Vec<Vec<Record>>, Diagnostic> {
    let scratch = Scratch::new()?;
    let mut args = words(&STRICT);
    args.extend(words(if portable { &["-O0", "-DPLC_PORTABLE"] } else { &["-O1"] }));
    args.extend(words(&["-o", "served"]));
    for ((source, _), n) in programs.iter().zip(0..) {
        let name = format!("program{n}.c");
        scratch.write(&name, unit::member(source, n))?;
        args.push(name);
    }
    scratch.write("main.c", unit::switchboard(programs.len()))?;
    args.push("main.c".to_owned());
    compile("gcc", "gcc", &args, &scratch)?;
    let begin = |n: usize, _: &Source| vec![b'L', n as u8, (n >> 8) as u8];
    converse(programs, Slots::InOrder, &scratch, begin)
}

/// Runs programs as byte code on this computer, each by its script.
///
/// # Errors
/// As [`native`].
pub fn interpreted(programs: &[(Source, Script)]) -> Result<Vec<Vec<Record>>, Diagnostic> {
    let scratch = Scratch::new()?;
    scratch.write("plc.c", PLC_C)?;
    scratch.write("plc.h", PLC_H)?;
    scratch.write("main.c", unit::interpreter())?;
    let mut args = words(&STRICT);
    args.extend(words(&["-O1", "-DPLC_MAX_BITS=65536", "-DPLC_MAX_WORDS=65536", "-o", "served", "main.c", "plc.c"]));
    compile("gcc", "gcc", &args, &scratch)?;
    let begin = |_: usize, source: &Source| {
        let mut bytes = vec![b'L'];
        bytes.extend((source.image.len() as u32).to_le_bytes());
        bytes.extend(&source.image);
        bytes
    };
    converse(programs, Slots::Interpreter, &scratch, begin)
}

/// Tells `served` all scripts in turn and reads what it answers.
fn converse(
    programs: &[(Source, Script)],
    slots: Slots,
    scratch: &Scratch,
    begin: impl Fn(usize, &Source) -> Vec<u8>,
) -> Result<Vec<Vec<Record>>, Diagnostic> {
    let mut told = Vec::new();
    for ((source, script), n) in programs.iter().zip(0..) {
        told.extend(begin(n, source));
        told.extend(script.bytes());
        told.push(b'U');
    }
    let answer = talk(&scratch.at("served"), &told, scratch)?;
    let mut rest = answer.as_slice();
    let mut all = Vec::new();
    for ((source, script), n) in programs.iter().zip(1..) {
        let shape = slots.shape(source);
        let mut records = Vec::new();
        for scan in 0..script.scans() {
            let (Some(record), Some(more)) = (shape.record(rest), rest.get(shape.len()..)) else {
                return Err(stopped(format!("program {n} ended in scan {} of {}", scan + 1, script.scans())));
            };
            records.push(record);
            rest = more;
        }
        rest = match rest.split_first() {
            Some((b'U', more)) => more,
            _ => return Err(stopped(format!("program {n} did not end behind its last scan"))),
        };
        all.push(records);
    }
    Ok(all)
}

fn stopped(cause: String) -> Diagnostic {
    error(codes::STOPPED, cause, "please report this with the program")
}

/// How a source is served on a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As C.
    C,
    /// As byte code with its interpreter.
    Bytecode,
}

/// Runs one program on the emulated chip `mcu`, by its script: an ATmega48 to 328 or one of the 8051 family.
///
/// # Errors
/// As [`native`]; there is no such way to the chip.
pub fn on_chip(source: &Source, script: &Script, form: Form, mcu: &str) -> Result<Vec<Record>, Diagnostic> {
    let mcu = mcu.to_ascii_lowercase();
    let scratch = Scratch::new()?;
    let mut files = vec!["main.c".to_owned()];
    let slots = match form {
        Form::C => {
            scratch.write("main.c", unit::alone(source))?;
            Slots::InOrder
        }
        Form::Bytecode => {
            scratch.write("main.c", unit::interpreted(source))?;
            scratch.write("plc.c", PLC_C)?;
            scratch.write("plc.h", PLC_H)?;
            files.push("plc.c".to_owned());
            Slots::Interpreter
        }
    };
    let room = (format!("-DPLC_MAX_BITS={}", source.bits.max(1)), format!("-DPLC_MAX_WORDS={}", source.words.max(1)));
    let answer = if let Some(chip) = emu_avr::chips::chip(&mcu).filter(|chip| has_gpior(chip.name)) {
        let mut args = words(&STRICT);
        args.extend([format!("-mmcu={mcu}"), room.0, room.1]);
        args.extend(words(&["-Os", "-o", "served.elf"]));
        args.extend(files);
        compile("avr-gcc", "gcc-avr avr-libc", &args, &scratch)?;
        let loaded = load(&scratch, "served.elf", chip, ElfMachine::AVR)?;
        // DS40002061, 8.6: GPIOR1 and GPIOR0 in data memory.
        let ports = Ports { space: "data", from_checker: 0x4A, to_checker: 0x3E };
        serve(emu_avr::Avr::new(chip, &loaded, RamInit::Random(1)), ports, script)?
    } else if let (Some(chip), Form::C) = (emu_8051::chips::chip(&mcu), form) {
        let mut args = words(&["-mmcs51", "--model-large", "--std-c89", "--Werror", "--xram-size", "0x7F00"]);
        // Unreachable code behind endless loops, and comparisons that the optimiser decides: both are meant.
        args.extend(words(&["--disable-warning", "126", "--disable-warning", "110", "-o", "served.ihx"]));
        args.extend(files);
        compile("sdcc", "sdcc", &args, &scratch)?;
        let loaded = load(&scratch, "served.ihx", chip, ElfMachine::MCS51)?;
        // Programs are longer than what the chip has inside, so all of it lies outside.
        let options = emu_8051::Options { ea: false, ..emu_8051::Options::default() };
        let ports = Ports { space: "xdata", from_checker: 0x7FFE, to_checker: 0x7FFF };
        serve(emu_8051::Mcs51::with(chip, &loaded, RamInit::Random(1), options), ports, script)?
    } else {
        let cause = format!("emitted sources of this kind cannot be served on `{mcu}`");
        return Err(error(codes::NO_WAY, cause, "name an ATmega48 to 328, or for C a chip of the 8051 family"));
    };
    let shape = slots.shape(source);
    let records: Vec<Record> = answer.chunks(shape.len()).filter_map(|bytes| shape.record(bytes)).collect();
    if records.len() as u64 == script.scans() {
        return Ok(records);
    }
    Err(stopped(format!("the chip told {} of {} scans", records.len(), script.scans())))
}

/// The chips whose general purpose registers stand at the same addresses.
fn has_gpior(name: &str) -> bool {
    ["atmega48", "atmega88", "atmega168", "atmega328"].iter().any(|family| name.starts_with(family))
}

/// Reads what a compiler has made.
pub(super) fn load(scratch: &Scratch, name: &str, chip: &Chip, machine: ElfMachine) -> Result<Image, Diagnostic> {
    let loaded = image::load(name, &scratch.read(name)?, chip.hex, chip.elf, machine);
    loaded.map(|loaded| loaded.image).map_err(|faults| {
        let first = faults.into_iter().next().map_or_else(String::new, |fault| fault.to_string());
        error(
            codes::TOOL_FAILED,
            format!("the image does not load: {first}"),
            "the program may be too large for the chip",
        )
    })
}

/// The two cells by which a chip is served.
#[derive(Clone, Copy)]
struct Ports {
    space: &'static str,
    from_checker: u16,
    to_checker: u16,
}

/// Keeps what is told, and stops the chip when it has taken a byte.
struct Watch {
    space: u8,
    ports: Ports,
    told: Vec<u8>,
}

impl Probe for Watch {
    const DATA: bool = true;
    fn data(&mut self, _: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if space == self.space && addr == self.ports.to_checker && write {
            self.told.push(value);
        }
        space == self.space && addr == self.ports.from_checker && !write
    }
}

/// Gives a chip its script byte by byte: the next byte lies ready before the chip takes it.
fn serve<C: Cpu>(mut cpu: C, ports: Ports, script: &Script) -> Result<Vec<u8>, Diagnostic> {
    let space = cpu.chip().spaces.iter().position(|(name, ..)| *name == ports.space).unwrap_or(0) as u8;
    let mut watch = Watch { space, ports, told: Vec::new() };
    for (byte, n) in script.bytes().iter().chain(b"U").zip(1..) {
        cpu.poke(ports.space, ports.from_checker.into(), *byte);
        let stop = cpu.run(cpu.cycle() + SCAN_CYCLES, &mut watch);
        if stop != Stop::Probe {
            return Err(stopped(format!("byte {n} of the script was not taken: {stop:?} at 0x{:04X}", cpu.pc())));
        }
    }
    Ok(watch.told)
}
