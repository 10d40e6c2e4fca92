//! Our side of `speedpic.sh`: runs a HEX file for a number of instruction cycles.
//!
//! `speedpic FILE.hex CYCLES` prints the executed cycles and the CPU seconds.

use std::process::ExitCode;

use emu_core::image::load_hex;
use emu_core::{Cpu, RamInit};
use emu_pic16::{Options, Pic16, chips};

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let result = match args[..] {
        [file, cycles] => run(file, cycles),
        _ => Err("usage: speedpic FILE.hex CYCLES".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("{cause}");
            ExitCode::FAILURE
        }
    }
}

/// Returns the CPU time of this thread in seconds.
fn cpu_seconds() -> Result<f64, String> {
    let text = std::fs::read_to_string("/proc/self/schedstat").map_err(|e| format!("/proc/self/schedstat: {e}"))?;
    let nanoseconds = text.split_whitespace().next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.map(|n| n * 1e-9).ok_or_else(|| "/proc/self/schedstat is not understood".to_owned())
}

fn run(file: &str, cycles: &str) -> Result<(), String> {
    let cycles: u64 = cycles.parse().map_err(|e| format!("{cycles}: {e}"))?;
    let bytes = std::fs::read(file).map_err(|e| format!("{file}: {e}"))?;
    let chip = chips::chip("pic16f873").ok_or("no PIC16F873")?;
    let loaded = load_hex(file, &bytes, chip.hex_spaces).map_err(|e| format!("{file}: {e:?}"))?;
    let options = Options { hz: 20_000_000, ..Options::default() };
    let mut pic = Pic16::with(chip, &loaded.image, RamInit::Random(1), options);
    let before = cpu_seconds()?;
    let stop = pic.run(cycles, &mut ());
    let spent = cpu_seconds()? - before;
    println!("{} {spent:.6} {stop:?}", pic.cycle());
    Ok(())
}
