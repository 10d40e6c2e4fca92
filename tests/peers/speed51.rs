//! Our side of `speed51.sh`: assembles the programs of `benches/programs51`, and runs a HEX file for a number
//! of cycles.
//!
//! `speed51 hex FOLDER` writes every program as NAME.hex; `speed51 run FILE.hex CYCLES` prints the executed
//! cycles and the CPU seconds.

#[path = "../../benches/programs51/assemble.rs"]
mod assemble;
#[path = "../../benches/programs51/programs.rs"]
mod programs;

use std::path::Path;
use std::process::ExitCode;

use emu_8051::{Mcs51, chips};
use emu_core::image::{load_hex, write_hex};
use emu_core::{Cpu, RamInit};

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let result = match args[..] {
        ["hex", folder] => hex(Path::new(folder)),
        ["run", file, cycles] => run(file, cycles),
        _ => Err("usage: speed51 hex FOLDER | speed51 run FILE.hex CYCLES".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(cause) => {
            eprintln!("{cause}");
            ExitCode::FAILURE
        }
    }
}

fn hex(folder: &Path) -> Result<(), String> {
    for (name, source) in programs::programs() {
        let image = assemble::image(&source).map_err(|e| format!("{name}: {e}"))?;
        let path = folder.join(format!("{name}.hex"));
        let segments: Vec<_> =
            image.segments.iter().map(|s| emu_core::image::HexSegment { addr: s.addr, bytes: &s.bytes }).collect();
        std::fs::write(&path, write_hex(&segments)).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("{name}");
    }
    Ok(())
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
    let chip = chips::chip("at89c52").ok_or("no AT89C52")?;
    let loaded = load_hex(file, &bytes, chip.hex_spaces).map_err(|e| format!("{file}: {e:?}"))?;
    let mut mcs51 = Mcs51::new(chip, &loaded.image, RamInit::Random(1));
    let before = cpu_seconds()?;
    let stop = mcs51.run(cycles, &mut ());
    let spent = cpu_seconds()? - before;
    println!("{} {spent:.6} {stop:?}", mcs51.cycle());
    Ok(())
}
