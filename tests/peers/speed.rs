//! Our side of `speed.sh`: assembles the programs of `benches/programs`, and runs a HEX file for a number of
//! cycles.
//!
//! `speed hex FOLDER` writes every program, and a compiled ladder scan, as NAME.hex. `speed run FILE.hex
//! CYCLES [skip]` prints the executed cycles and the CPU seconds; polling loops are skipped only with `skip`.
//! `speed clone FILE.hex` prints the time of a clone of the running machine.

#[path = "../../benches/programs/assemble.rs"]
mod programs;

use std::path::Path;
use std::process::ExitCode;

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::image::{ElfMachine, load, write_hex};
use emu_core::{Cpu, RamInit};

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let result = match args[..] {
        ["hex", folder] => hex(Path::new(folder)),
        ["run", file, cycles] => run(file, cycles, false),
        ["run", file, cycles, "skip"] => run(file, cycles, true),
        ["clone", file] => clone(file),
        _ => Err("usage: speed hex FOLDER | speed run FILE.hex CYCLES [skip] | speed clone FILE.hex".to_owned()),
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
    for (name, source) in programs::PROGRAMS {
        let image = programs::image(source).map_err(|e| format!("{name}.s: {e}"))?;
        let path = folder.join(format!("{name}.hex"));
        let segments: Vec<_> =
            image.segments.iter().map(|s| emu_core::image::HexSegment { addr: s.addr, bytes: &s.bytes }).collect();
        std::fs::write(&path, write_hex(&segments)).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("{name}");
    }
    // A ladder scan that nearly fills its period.
    let program =
        ladder::parse("scan.ld", include_str!("../../benches/programs/scan.ld")).map_err(|e| format!("{e:?}"))?.program;
    let options = ladder_compile::CompileOptions { mcu: ATMEGA328P.name.to_owned(), ..Default::default() };
    let compiled = ladder_compile::compile(&program, &options).map_err(|e| format!("{e:?}"))?;
    std::fs::write(folder.join("scan.hex"), compiled.hex).map_err(|e| format!("scan.hex: {e}"))?;
    println!("scan");
    Ok(())
}

/// Returns the CPU time of this thread in seconds.
fn cpu_seconds() -> Result<f64, String> {
    let text = std::fs::read_to_string("/proc/self/schedstat").map_err(|e| format!("/proc/self/schedstat: {e}"))?;
    let nanoseconds = text.split_whitespace().next().and_then(|n| n.parse::<f64>().ok());
    nanoseconds.map(|n| n * 1e-9).ok_or_else(|| "/proc/self/schedstat is not understood".to_owned())
}

fn machine(file: &str) -> Result<Avr, String> {
    let bytes = std::fs::read(file).map_err(|e| format!("{file}: {e}"))?;
    let machine = ElfMachine(ATMEGA328P.elf_machine);
    let loaded = load(file, &bytes, ATMEGA328P.hex_spaces, ATMEGA328P.elf_spaces, machine)
        .map_err(|e| format!("{file}: {e:?}"))?;
    Ok(Avr::new(&ATMEGA328P, &loaded.image, RamInit::Random(1)))
}

fn run(file: &str, cycles: &str, skip: bool) -> Result<(), String> {
    let cycles: u64 = cycles.parse().map_err(|e| format!("{cycles}: {e}"))?;
    let mut avr = machine(file)?;
    avr.set_skip_idle_loops(skip);
    let before = cpu_seconds()?;
    let stop = avr.run(cycles, &mut ());
    let spent = cpu_seconds()? - before;
    println!("{} {spent:.6} {stop:?}", avr.cycle());
    Ok(())
}

/// Takes snapshots of a running machine in a ring of 64, as a history does.
fn clone(file: &str) -> Result<(), String> {
    let mut avr = machine(file)?;
    avr.run(1_000_000, &mut ());
    let mut ring = vec![avr.clone(); 64];
    let rounds = 20_000;
    let before = cpu_seconds()?;
    for slot in (0..ring.len()).cycle().take(rounds) {
        ring[slot] = std::hint::black_box(&avr).clone();
    }
    let spent = cpu_seconds()? - before;
    println!("clone of the whole machine ({} bytes): {:.2} us", size_of::<Avr>(), spent / rounds as f64 * 1e6);
    Ok(())
}
