//! The chip reproduces the hand-written traces of `tests/ladder`: each program is compiled and runs from
//! random RAM, with its pins driven and read.

#[path = "ladder/parse.rs"]
mod parse;
#[path = "ladder/mod.rs"]
mod table;

use emu_avr::{Avr, chips};
use emu_core::pins::PinId;
use emu_core::{Cpu, CycleTime, PinLevel, RamInit, StopReason, image};
use ladder_compile::{CellLocation, CompileOptions, CompiledProgram, ImageMap, compile};
use table::Column;

/// A chip that stops at the start and the end of its scans.
struct TestBench {
    cpu: Avr,
    map: ImageMap,
}

impl TestBench {
    fn new(compiled: CompiledProgram, seed: u64) -> TestBench {
        let chip = chips::chip(&compiled.map.mcu).expect("a known chip");
        let loaded = image::load_hex("image", compiled.hex.as_bytes(), chip.hex_spaces).expect("a sound image");
        let mut cpu = Avr::new(chip, &loaded.image, RamInit::Random(seed));
        cpu.set_breakpoint(compiled.map.scan_start / 2, true);
        cpu.set_breakpoint(compiled.map.scan_end / 2, true);
        TestBench { cpu, map: compiled.map }
    }

    fn run_to(&mut self, addr: u32) {
        let limit = self.cpu.cycle() + 1_000_000;
        assert_eq!(self.cpu.run(limit, &mut ()), StopReason::Breakpoint { pc: addr / 2 });
    }

    /// Returns the pin of an input or output.
    fn pin(&self, name: &str) -> Option<PinId> {
        let pin = self.map.pins.iter().find(|p| p.name == name)?;
        self.cpu.chip().pin(&pin.pin)
    }

    /// Returns the data address of a symbol, and the number of its bit unless it is an integer.
    fn place(&self, name: &str) -> (u32, Option<u8>) {
        let symbol = self.map.symbols.iter().find(|s| s.name == name).unwrap_or_else(|| panic!("no {name} in the map"));
        match &symbol.place {
            CellLocation::Bit { addr, bit, .. } => (*addr, Some(*bit)),
            CellLocation::Word { addr, .. } => (*addr, None),
        }
    }

    /// Returns the width of an integer in bytes.
    fn bytes(&self, name: &str) -> u8 {
        match self.map.symbols.iter().find(|s| s.name == name).map(|s| &s.place) {
            Some(CellLocation::Word { bytes, .. }) => *bytes,
            _ => 0,
        }
    }

    fn peek(&self, addr: u32) -> u8 {
        self.cpu.peek("data", addr).expect("data memory")
    }

    fn get(&self, name: &str) -> i32 {
        if let (true, Some(pin)) = (name.starts_with('Y'), self.pin(name)) {
            return i32::from(self.cpu.pin_level(pin) == PinLevel::High);
        }
        match self.place(name) {
            (addr, Some(bit)) => i32::from(self.peek(addr) >> bit & 1),
            (addr, None) => {
                let bytes = (addr..addr + u32::from(self.bytes(name))).rev().map(|addr| self.peek(addr));
                let value = bytes.fold(0, |value, byte| value << 8 | i32::from(byte));
                let cut = 32 - 8 * self.bytes(name);
                value << cut >> cut
            }
        }
    }

    fn set(&mut self, name: &str, value: i32) {
        let (addr, bit) = self.place(name);
        match bit {
            Some(bit) => {
                let value = self.peek(addr) & !(1 << bit) | u8::from(value != 0) << bit;
                assert!(self.cpu.poke("data", addr, value));
            }
            None => {
                for (addr, byte) in (addr..).zip(value.to_le_bytes()).take(self.bytes(name).into()) {
                    assert!(self.cpu.poke("data", addr, byte));
                }
            }
        }
    }

    fn scan(&mut self, values: &[(&str, i32)]) {
        for &(name, value) in values {
            if let (true, Some(pin)) = (name.starts_with('X'), self.pin(name)) {
                let now = CycleTime::at(self.cpu.cycle());
                self.cpu.drive(now, pin, PinLevel::from_bit(value != 0));
            }
        }
        self.run_to(self.map.scan_start);
        for &(name, value) in values.iter().filter(|(name, _)| !name.starts_with('X')) {
            self.set(name, value);
        }
        self.run_to(self.map.scan_end);
    }
}

fn symbol(column: &Column) -> Option<String> {
    match column {
        Column::Symbol(name) => Some(name.clone()),
        _ => None,
    }
}

/// Tables that the compiler for this chip does not support yet. Remove a line when it does.
const NOT_YET: &[&str] = &["tables.txt", "ldmicro5.txt"];

#[test]
fn the_chip_gives_every_line_of_every_trace() {
    let (mut faults, mut lines, mut refused, mut outside, mut later) = (Vec::new(), 0, Vec::new(), 0, 0);
    for (seed, case) in table::cases().into_iter().enumerate() {
        if NOT_YET.iter().any(|table| case.name.starts_with(table)) {
            later += 1;
            continue;
        }
        // The checker drives and reads serial line, converter, PWM output and EEPROM in its own tests.
        let symbols = |columns: &[Column]| -> Option<Vec<String>> { columns.iter().map(symbol).collect() };
        let (Some(given_names), Some(wanted_names)) = (symbols(&case.given), symbols(&case.wanted)) else {
            outside += 1;
            continue;
        };
        let program = parse::parse("test.ld", &case.program);
        let options = CompileOptions { mcu: "atmega328p".into(), ..CompileOptions::default() };
        let mut bench = match compile(&program, &options) {
            Ok(compiled) => TestBench::new(compiled, seed as u64),
            Err(why) => {
                refused.push(format!("{}: {}", case.name, why[0].code));
                continue;
            }
        };
        // Inputs that a case does not set are low.
        let inputs: Vec<String> =
            bench.map.pins.iter().filter(|p| p.name.starts_with('X')).map(|p| p.name.clone()).collect();
        let mut values: Vec<(&str, i32)> = inputs.iter().map(|n| (n.as_str(), 0)).collect();
        for row in &case.rows {
            lines += 1;
            for _ in 0..row.times {
                let given = given_names.iter().zip(&row.given).filter_map(|(n, v)| Some((n.as_str(), (*v)?)));
                values.extend(given);
                bench.scan(&values);
                values.clear();
            }
            let found: Vec<Option<i32>> = wanted_names.iter().map(|n| Some(bench.get(n))).collect();
            if found != row.wanted {
                faults.push(format!("{}: {}: found {found:?}, wanted {:?}", case.name, row.text, row.wanted));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
    // A coil in the middle of a rung has a meaning but is still refused: that is a rule of the language
    // (LD101 ..).
    println!(
        "{lines} lines on the chip; {later} cases not compiled yet, {outside} with other columns than symbols; refused by the checks: {refused:#?}"
    );
    // LC002: elements that have no code for this chip yet.
    let known = |reason: &String| reason.contains(": LD1") || reason.ends_with(": LC002");
    assert!(lines > 250 && refused.iter().all(known), "{lines} lines, refused: {refused:#?}");
}
