//! Real programs, if the corpus is present: folder `EMU_CORPUS`, or else `../shared/ld` next to the
//! workspace. Checks agree, and the chip alone reproduces the traces of LDmicro 2.3.

use crate::common;
use std::fs;
use std::path::{Path, PathBuf};

use emu_avr::Avr;
use emu_check::CheckOptions;
use emu_core::cpu::{Cpu, RamInit, StopReason};
use emu_core::image::load_hex;
use emu_core::pins::{CycleTime, PinLevel};
use ladder_compile::{CellLocation, CompiledProgram, compile};

/// The programs on which a check must agree.
const AGREE: &[&str] = &[
    "reg-contacts",
    "reg-timers-counters",
    "reg-integers",
    "sample-blink",
    "sample-traffic",
    "sample-coil_s_r_n",
    "sample-ctc_osr",
    "sample-7seg-display",
    "sample-MasterRelay-Test",
];

/// The programs for which the corpus has traces.
const TRACED: &[&str] = &[
    "reg-contacts",
    "reg-integers",
    "reg-timers-counters",
    "sample-blink",
    "sample-coil_s_r_n",
    "sample-ctc_osr",
    "sample-traffic",
];

/// Number of scans of each trace.
const SCANS: u64 = 800;

fn corpus() -> Option<PathBuf> {
    let beside = || common::beside("../../shared/ld");
    let folder = std::env::var_os("EMU_CORPUS").map_or_else(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no corpus at {}; EMU_CORPUS names its folder", folder.display());
    None
}

#[test]
fn checks_agree() {
    let Some(folder) = corpus() else { return };
    for name in AGREE {
        let program = common::read(&folder.join(format!("{name}.ld")));
        let report = common::report(&program, &CheckOptions::default());
        println!("{}", report.text());
        assert!(report.agreed && report.coverage.full, "{}", report.text());
    }
}

#[test]
fn the_chip_gives_the_columns_of_the_traces() {
    let Some(folder) = corpus() else { return };
    TRACED.iter().for_each(|name| trace(&folder, name));
}

fn trace(folder: &Path, name: &str) {
    let program = common::read(&folder.join(format!("{name}.ld")));
    let options = ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), ..Default::default() };
    let compiled = compile(&program, &options).unwrap_or_else(|faults| panic!("{name}: {faults:?}"));
    let chip = emu_avr::chips::chip("atmega328p").expect("the chip");
    let image = load_hex(name, compiled.hex.as_bytes(), chip.hex_spaces).expect("an image").image;
    let mut avr = Avr::new(chip, &image, RamInit::Random(7));
    avr.set_breakpoint(compiled.map.scan_end / 2, true);

    let csv = fs::read_to_string(folder.join("traces").join(format!("{name}.csv"))).expect("a trace");
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let (mut scans, mut compared) = (0, 0);
    for line in lines {
        let values: Vec<i32> = line.split(',').map(|v| v.parse().expect("a number")).collect();
        scans += 1;
        assert_eq!(values[0], scans, "{name}: scans are numbered from 1");
        let now = CycleTime::at(avr.cycle());
        let pin = |symbol: &str| {
            let pin = compiled.map.pins.iter().find(|p| p.name == symbol)?;
            chip.pin(&pin.pin)
        };
        for (symbol, value) in header.iter().zip(&values).filter(|(symbol, _)| symbol.starts_with('X')) {
            avr.drive(now, pin(symbol).expect("a pin"), PinLevel::from_bit(*value != 0));
        }
        let limit = avr.cycle() + 3 * compiled.map.cycle.num / compiled.map.cycle.den;
        assert!(matches!(avr.run(limit, &mut ()), StopReason::Breakpoint { .. }), "{name}: no end of scan {scans}");
        for (symbol, &value) in header.iter().zip(&values).skip(1) {
            assert_eq!(read(&compiled, &avr, symbol), value, "{name}, scan {scans}, {symbol}");
            if symbol.starts_with('Y') {
                assert_eq!(
                    avr.pin_level(pin(symbol).expect("a pin")),
                    PinLevel::from_bit(value != 0),
                    "{name}, scan {scans}, {symbol}"
                );
            }
            compared += 1;
        }
    }
    println!("{name}: {scans} scans, {compared} values by the chip as by LDmicro 2.3");
    assert_eq!(scans as u64, SCANS, "{name}");
}

fn read(compiled: &CompiledProgram, avr: &Avr, symbol: &str) -> i32 {
    let found = compiled.map.symbols.iter().find(|s| s.name == symbol);
    match &found.unwrap_or_else(|| panic!("no place for {symbol}")).place {
        CellLocation::Bit { space, addr, bit } => i32::from(avr.peek(space, *addr).expect("a byte") >> bit & 1),
        CellLocation::Word { space, addr, .. } => {
            let byte = |addr| avr.peek(space, addr).expect("a byte");
            i32::from(i16::from_le_bytes([byte(*addr), byte(addr + 1)]))
        }
    }
}
