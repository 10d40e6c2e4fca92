//! `emu check`: compile, run on the chip, compare every scan with the reference evaluator.

use std::time::{Duration, Instant};

use clap::Args;
use emu_check::Options;
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::{Ladder, Mcu};
use crate::compile::Target;
use crate::fail::{Failure, exit};
use crate::report::{Terminal, report};
use crate::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu check examples/welder.ld --mcu atmega328p
  emu check examples/traffic.ld --mcu atmega328p --scans 100000 --seed 7
  emu check examples/tank.ld --mcu atmega328p --pin Ypump=PB5 --json

Exit codes: 0 chip and reference agree; 1 they differ: the report says where and how to see it again; 3 the program is
refused. The same seed gives the same run for ever.";

/// Time after which a bar shows how far the check is.
const PATIENCE: Duration = Duration::from_secs(1);

/// Flags of `emu check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CheckArgs {
    #[command(flatten)]
    program: Ladder,
    #[command(flatten)]
    mcu: Mcu,
    /// Seed of everything random, stimulus and RAM: a number. It is fixed unless given, so that runs can be repeated.
    #[arg(long, value_name = "N", default_value_t = Options::default().seed)]
    seed: u64,
    /// Number of scans to compare, at least 1.
    #[arg(long, value_name = "N", default_value_t = Options::default().scans, value_parser = clap::value_parser!(u64).range(1..))]
    scans: u64,
    #[command(flatten)]
    target: Target,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
}

/// Checks a program.
pub fn check(args: &CheckArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let read = input::program(&args.program.file, args.program.dialect, true, terminal)?;
    let options = Options {
        mcu: args.mcu.chip.name.to_owned(),
        seed: args.seed,
        scans: args.scans,
        pins: args.target.pins.clone(),
        clock_hz: args.target.clock,
        rungs: true,
    };
    let (start, mut bar) = (Instant::now(), None);
    let mut progress = |done: u64, total: u64| {
        if terminal.live && start.elapsed() >= PATIENCE {
            bar.get_or_insert_with(|| progress_bar(total)).set_position(done);
        }
    };
    let result = emu_check::check(&read.program, &options, &mut progress);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let checked = match result {
        Ok(checked) => checked,
        Err(refusals) => return Err(Failure::Refused(refusals, read.texts)),
    };
    if args.json {
        output::json(&checked)?;
    } else {
        // Fuses are for those who burn the image.
        let notes: Vec<_> = checked.notes.iter().filter(|n| n.code != ladder_compile::FUSES_NOTE).cloned().collect();
        report(terminal, &notes, &read.texts);
        output::print(checked.text())?;
    }
    Ok(if checked.agreed { exit::OK } else { exit::FAILED })
}

fn progress_bar(total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} scans");
    ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
