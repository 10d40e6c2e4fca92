//! `emu compile`: compiles a ladder program to an image for a chip.

use std::path::Path;

use clap::{Args, ValueEnum};
use emu_core::chip::Chip;
use emu_debug::time;
use ladder_compile::{CompileOptions, CompiledProgram, ImageMap, PinAssignment, emit};
use serde_json::json;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::flags::LadderFlags;
use crate::shared::output::RequestedOutput;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::usage_error::UsageError;
use crate::shared::{family, input, output};

const EXAMPLES: &str = "\
Examples:
  emu compile examples/welder.ld --mcu atmega328p
  emu compile welder.ld --mcu pic16f876 -o out.hex --listing out.lst --map out.json
  emu compile welder.ld --mcu atmega328p --pin Xstart=PD2 --pin Yarc=PB5 --clock 8MHz -o -
  emu compile welder.ld --mcu at89s52 -O0 --emit lst -o -      code to follow by eye
  emu compile welder.ld --emit c                               one C function per scan";

/// Flags of `emu compile`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompileArgs {
    #[command(flatten)]
    program: LadderFlags,
    /// The chip, such as `atmega328p` (`emu chips` lists them). Default: the chip of MICRO=. C and byte code
    /// have no chip, and sketches need none.
    #[arg(long, value_name = "CHIP", value_parser = family::ChipParser, hide_possible_values = true)]
    mcu: Option<&'static Chip>,
    /// What to write.
    #[arg(long, value_name = "KIND", value_enum, default_value_t = EmitKind::Hex)]
    emit: EmitKind,
    /// The file to write; - is standard output. Default: the name of the program with the extension of its
    /// kind, such as .hex, in the current folder (standard output for a program from standard input).
    #[arg(short, long, value_name = "FILE")]
    output: Option<String>,
    /// Write a listing with the instructions of each rung below the rung.
    #[arg(long, value_name = "FILE")]
    listing: Option<String>,
    /// Write the locations of rungs, elements, symbols, pins and the scan, as JSON.
    #[arg(long, value_name = "FILE")]
    map: Option<String>,
    /// Level of optimisation for size. 1 is the default. With 0 each operation on bits becomes a separate
    /// template.
    #[arg(long, value_name = "LEVEL", default_value_t = 1, value_parser = clap::value_parser!(u8).range(0..=1))]
    optimise: u8,
    /// -O0 and -O1 are --optimise 0 and --optimise 1; -O alone is -O1.
    #[arg(short = 'O', conflicts_with = "optimise")]
    small: bool,
    // The digits are flags after -O instead of its value, because a value would take the next word when no
    // digit follows.
    #[arg(short = '0', hide = true, requires = "small", conflicts_with = "one")]
    zero: bool,
    #[arg(short = '1', hide = true, requires = "small")]
    one: bool,
    /// In a sketch: time in milliseconds for which an input must be stable before it counts.
    #[arg(long, value_name = "MS")]
    debounce: Option<u32>,
    #[command(flatten)]
    target: TargetFlags,
    /// One JSON document on standard output with the statistics: bytes, RAM, cycles of the longest scan and
    /// of every rung.
    #[arg(long)]
    pub json: bool,
}

/// The kinds of output that a program can be turned into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum EmitKind {
    /// Intel HEX.
    Hex,
    /// Assembly source, for `emu asm` and for the family's usual assembler.
    Asm,
    /// The listing.
    Lst,
    /// The map, as JSON.
    Map,
    /// The intermediate code.
    Ir,
    /// ANSI C, one call per scan.
    C,
    /// Byte code for a small interpreter.
    Bytecode,
    /// A sketch for Arduino boards with an ATmega328P.
    Arduino,
}

impl EmitKind {
    /// Returns the file name extension of this kind.
    fn ending(self) -> &'static str {
        match self {
            EmitKind::Hex => "hex",
            EmitKind::Asm => "asm",
            EmitKind::Lst => "lst",
            EmitKind::Map => "json",
            EmitKind::Ir => "ir",
            EmitKind::C => "c",
            EmitKind::Bytecode => "inc",
            EmitKind::Arduino => "ino",
        }
    }

    /// Returns true for sources, which need no chip.
    fn is_source(self) -> bool {
        matches!(self, EmitKind::C | EmitKind::Bytecode | EmitKind::Arduino)
    }
}

/// Flags that assign pins and clock of the target chip.
#[derive(Debug, Args)]
pub struct TargetFlags {
    /// Assign an input or output to a pin: Xstart=PD2. Overrides the pins of the program. Repeatable.
    #[arg(long = "pin", value_name = "NAME=PIN", value_parser = parse_pin_assignment)]
    pub pins: Vec<PinAssignment>,
    /// Oscillator frequency, instead of the program's CRYSTAL: 16MHz, 8000000.
    #[arg(long, value_name = "HZ", value_parser = time::parse_hertz)]
    pub clock: Option<u64>,
}

/// Parses `NAME=PIN`.
pub fn parse_pin_assignment(text: &str) -> Result<PinAssignment, UsageError> {
    match text.split_once('=').map(|(symbol, pin)| (symbol.trim(), pin.trim())) {
        Some((symbol, pin)) if !symbol.is_empty() && !pin.is_empty() => Ok(PinAssignment::new(symbol, pin)),
        _ => Err(UsageError::malformed("write a symbol and a pin, as in Xstart=PD2")),
    }
}

impl CompileArgs {
    /// Returns true unless -O0 or --optimise 0 is given.
    fn optimises(&self) -> bool {
        self.optimise > 0 && !self.zero
    }
}

/// Compiles a program. If any step fails, no file is written.
pub fn compile(args: &CompileArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let main = args.output.clone().unwrap_or_else(|| output_name(&args.program.file, args.emit.ending()));
    let mut outputs = vec![RequestedOutput::new("--output", &main)];
    outputs.extend(RequestedOutput::to_file("--listing", args.listing.as_deref()));
    outputs.extend(RequestedOutput::to_file("--map", args.map.as_deref()));
    let printed = RequestedOutput::printed("--json", args.json);
    output::check_distinct_outputs(&outputs.iter().copied().chain(printed).collect::<Vec<_>>())?;
    output::check_input_not_overwritten(&args.program.file, &outputs)?;
    if args.debounce.is_some() && !matches!(args.emit, EmitKind::Arduino) {
        return Err(VerbFailure::Usage("--debounce is for sketches; give --emit arduino as well".to_owned()));
    }
    if args.emit.is_source() {
        return write_source(args, &main, style);
    }
    let read = input::read_program_for_pins(&args.program.file, args.program.read.options(), &args.target.pins, style)?;
    let chip = match args.mcu {
        Some(chip) => chip,
        None => family::parse_chip(read.chip()?).map_err(VerbFailure::usage)?,
    };
    let options = CompileOptions {
        mcu: chip.name.to_owned(),
        pins: args.target.pins.clone(),
        clock_hz: args.target.clock,
        optimise: args.optimises(),
    };
    let compiled = match ladder_compile::compile(&read.program, &options) {
        Ok(compiled) => compiled,
        Err(refusals) => return Err(VerbFailure::Refused(refusals, read.texts)),
    };
    read.note_other_chip(chip.name);
    let mut map =
        serde_json::to_string_pretty(&compiled.map).map_err(|e| VerbFailure::write_failed("map", &e.into()))?;
    map.push('\n');
    let text = match args.emit {
        EmitKind::Asm => ladder_compile::assembly(&read.program, chip, &compiled.built, &compiled.map),
        EmitKind::Lst => compiled.listing.clone(),
        EmitKind::Map => map.clone(),
        EmitKind::Ir => compiled.ir.clone(),
        EmitKind::Hex | EmitKind::C | EmitKind::Bytecode | EmitKind::Arduino => compiled.hex.clone(),
    };
    let texts = [Some(&text), args.listing.as_ref().map(|_| &compiled.listing), args.map.as_ref().map(|_| &map)];
    let files: Vec<(&str, &[u8])> =
        outputs.iter().zip(texts.into_iter().flatten()).map(|(output, text)| (output.file, text.as_bytes())).collect();
    output::write_files(&files)?;
    report_diagnostics(style, &compiled.notes, &read.texts);
    if args.json {
        output::print_json(&document(&args.program.file, &compiled))?;
    } else {
        output::print_to_stderr(&size_text(&compiled.map));
    }
    Ok(exit::OK)
}

/// Writes an emitted source, which is not for a particular chip.
fn write_source(args: &CompileArgs, main: &str, style: &MessageStyle) -> Result<u8, VerbFailure> {
    if args.listing.is_some() || args.map.is_some() || args.json {
        let why = "--listing, --map and --json describe an image, and a source is not an image";
        return Err(VerbFailure::Usage(why.to_owned()));
    }
    // Refuse flags that would have no effect, instead of ignoring them.
    let sketch = args.emit == EmitKind::Arduino;
    let idle = [
        ("--mcu", args.mcu.is_some() && !sketch, "C and byte code are for any chip"),
        ("--pin", !args.target.pins.is_empty() && !sketch, "C and byte code have no pins"),
        ("--clock", args.target.clock.is_some(), "a source takes its cycle from the program, and has no oscillator"),
        ("-O0", !args.optimises(), "sources have one form only"),
    ];
    if let Some((flag, _, why)) = idle.iter().find(|(_, given, _)| *given) {
        return Err(VerbFailure::Usage(format!("{why}; leave {flag} out, or write an image with --emit hex")));
    }
    if let Some(refusal) = args.mcu.and_then(|chip| emit::arduino::refuse_chip(&args.program.file, chip)) {
        return Err(VerbFailure::Refused(vec![refusal], FileTexts::default()));
    }
    let read = input::read_program_for_pins(&args.program.file, args.program.read.options(), &args.target.pins, style)?;
    let emitted = match args.emit {
        EmitKind::Bytecode => emit::bytecode::emit(&read.program).map(|source| (source, Vec::new())),
        EmitKind::Arduino => {
            let options = emit::arduino::SketchOptions {
                pins: args.target.pins.clone(),
                debounce_ms: args.debounce.unwrap_or(0),
            };
            emit::arduino::emit(&read.program, &options).map(|sketch| (sketch.source, sketch.notes))
        }
        _ => emit::c::emit(&read.program).map(|source| (source, Vec::new())),
    };
    let (source, notes) = match emitted {
        Ok(emitted) => emitted,
        Err(refusals) => return Err(VerbFailure::Refused(refusals, read.texts)),
    };
    output::write_files(&[(main, source.text.as_bytes())])?;
    report_diagnostics(style, &notes, &read.texts);
    Ok(exit::OK)
}

/// Returns the sizes and times that decide the choice of a chip, in two lines.
fn size_text(map: &ImageMap) -> String {
    let rung = map.rungs.iter().max_by_key(|rung| (rung.worst_cycles, std::cmp::Reverse(rung.rung)));
    let rung = rung.map_or(String::new(), |rung| format!(" (rung {} up to {})", rung.rung, rung.worst_cycles));
    format!(
        "code {} bytes, RAM {} bytes\nlongest scan {} machine cycles{rung}, of a period of {}; slack {}\n",
        map.code_bytes,
        map.ram_bytes,
        map.worst_scan_cycles,
        map.cycle.num / map.cycle.den.max(1),
        map.slack_cycles
    )
}

/// Returns the statistics as one JSON document.
fn document(program: &str, compiled: &CompiledProgram) -> serde_json::Value {
    let map = &compiled.map;
    let rungs = map.rungs.iter();
    let rungs: Vec<_> = rungs
        .map(|r| json!({ "rung": r.rung, "code_bytes": r.end - r.start, "worst_cycles": r.worst_cycles }))
        .collect();
    json!({
        "schema": 1,
        "program": program,
        "mcu": map.mcu,
        "clock_hz": map.clock_hz,
        "cycle": map.cycle,
        "code_bytes": map.code_bytes,
        "ram_bytes": map.ram_bytes,
        "worst_scan_cycles": map.worst_scan_cycles,
        "poll_cycles": map.poll_cycles,
        "slack_cycles": map.slack_cycles,
        "rungs": rungs,
        "notes": compiled.notes,
    })
}

/// Returns the default name of the image of a program.
pub fn default_image_name(program: &str) -> String {
    output_name(program, "hex")
}

/// Returns the default name of an output file of a program.
fn output_name(program: &str, ending: &str) -> String {
    let stem = Path::new(program).file_stem().map(|stem| stem.to_string_lossy());
    match stem {
        Some(stem) if program != "-" => format!("{stem}.{ending}"),
        _ => "-".to_owned(),
    }
}
