//! `emu compile`: a ladder program to an image for a chip.

use std::path::Path;

use clap::Args;
use emu_debug::time;
use ladder_compile::Options;

use crate::args::{Ladder, Mcu};
use crate::fail::{Failure, exit};
use crate::report::{Terminal, report};
use crate::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu compile examples/welder.ld --mcu atmega328p
  emu compile welder.ld --mcu atmega328p -o out.hex --listing out.lst --map out.json
  emu compile welder.ld --mcu atmega328p --pin Xstart=PD2 --pin Yarc=PB5 --clock 8MHz -o -";

/// Flags of `emu compile`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CompileArgs {
    #[command(flatten)]
    program: Ladder,
    #[command(flatten)]
    mcu: Mcu,
    /// The Intel HEX file; - is standard output. Default: the program's name with .hex, in the current folder (standard
    /// output for a program from standard input).
    #[arg(short, long, value_name = "FILE")]
    output: Option<String>,
    /// Write the instructions below the rungs that they come from.
    #[arg(long, value_name = "FILE")]
    listing: Option<String>,
    /// Write where everything is (rungs, elements, symbols, pins, scan), as JSON.
    #[arg(long, value_name = "FILE")]
    map: Option<String>,
    #[command(flatten)]
    target: Target,
}

/// What a compiled program is told about its chip.
#[derive(Debug, Args)]
pub struct Target {
    /// Put an input or output at a pin: Xstart=PD2. Goes before the pins of the program. Repeatable.
    #[arg(long = "pin", value_name = "NAME=PIN", value_parser = pin)]
    pub pins: Vec<(String, String)>,
    /// Oscillator, instead of the program's CRYSTAL: 16MHz, 8000000.
    #[arg(long, value_name = "HZ", value_parser = time::hertz)]
    pub clock: Option<u64>,
}

fn pin(text: &str) -> Result<(String, String), String> {
    match text.split_once('=').map(|(name, pin)| (name.trim(), pin.trim())) {
        Some((name, pin)) if !name.is_empty() && !pin.is_empty() => Ok((name.to_owned(), pin.to_owned())),
        _ => Err("write a symbol and a pin, as in Xstart=PD2".to_owned()),
    }
}

/// Compiles a program. When anything fails no file is written.
pub fn compile(args: &CompileArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let hex = args.output.clone().unwrap_or_else(|| default_name(&args.program.file));
    let mut outputs = vec![("--output", hex.as_str())];
    outputs.extend(args.listing.as_deref().map(|file| ("--listing", file)));
    outputs.extend(args.map.as_deref().map(|file| ("--map", file)));
    output::owners(&outputs)?;
    output::spares(&args.program.file, &outputs)?;
    let read = input::program(&args.program.file, args.program.dialect, true, terminal)?;
    let options = Options {
        mcu: args.mcu.chip.name.to_owned(),
        pins: args.target.pins.clone(),
        clock_hz: args.target.clock,
        ..Options::default()
    };
    let compiled = match ladder_compile::compile(&read.program, &options) {
        Ok(compiled) => compiled,
        Err(refusals) => return Err(Failure::Refused(refusals, read.texts)),
    };
    let mut map = serde_json::to_string_pretty(&compiled.map).map_err(|e| Failure::writing("map", &e.into()))?;
    map.push('\n');
    let texts =
        [Some(&compiled.hex), args.listing.as_ref().map(|_| &compiled.listing), args.map.as_ref().map(|_| &map)];
    let files: Vec<(&str, &[u8])> =
        outputs.iter().zip(texts.into_iter().flatten()).map(|((_, file), text)| (*file, text.as_bytes())).collect();
    output::files(&files)?;
    report(terminal, &compiled.notes, &read.texts);
    Ok(exit::OK)
}

/// The name of the image that is made of a program.
pub fn default_name(program: &str) -> String {
    let stem = Path::new(program).file_stem().map(|stem| stem.to_string_lossy());
    match stem {
        Some(stem) if program != "-" => format!("{stem}.hex"),
        _ => "-".to_owned(),
    }
}
