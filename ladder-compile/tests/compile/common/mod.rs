//! Helpers that the tests share: test tables, programs from rungs, and a chip that runs an image.

pub mod bench;
pub mod ir;
pub mod ladders;
#[path = "../../../../tests/ladder/parse.rs"]
mod parse;

use emu_avr::Avr;
use emu_core::{Cpu, RamInit};
use ladder::LadderProgram;
use ladder_compile::{CellLocation, CompileOptions, CompiledProgram, compile};

/// Splits a table into cases: `== name`, then sections separated by lines of `--`. Lines that begin with `#`
/// are comments.
pub fn cases(table: &str) -> Vec<(String, Vec<String>)> {
    let mut all = Vec::new();
    for case in table.split("\n== ").skip(1) {
        let (name, body) = case.split_once('\n').expect("a case has lines");
        let lines: Vec<&str> = body.lines().filter(|l| !l.starts_with('#')).collect();
        let sections = lines.split(|l| l.trim() == "--").map(|s| s.join("\n").trim_matches('\n').to_owned());
        all.push((name.trim().to_owned(), sections.collect()));
    }
    assert!(!all.is_empty(), "the table has cases");
    all
}

/// Parses rungs with a cycle of 10 ms and a clock of 4 MHz. A text that begins with a header is used
/// unchanged.
pub fn program(text: &str) -> LadderProgram {
    let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nEND\nPROGRAM\n";
    let text = if text.starts_with("LDmicro") { text.to_owned() } else { format!("{head}{text}\n") };
    parse::parse("test.ld", &text)
}

/// Options for an ATmega328P, otherwise default.
pub fn options() -> CompileOptions {
    CompileOptions { mcu: "atmega328p".to_owned(), ..CompileOptions::default() }
}

/// Compiles a program; panics with the errors if that fails.
pub fn compiled(program: &LadderProgram) -> CompiledProgram {
    compile(program, &options())
        .unwrap_or_else(|errors| panic!("{}", errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")))
}

/// An image on the chip, after its reset code and before its first scan.
pub struct CompiledChip {
    pub cpu: Avr,
    pub map: ladder_compile::ImageMap,
}

impl CompiledChip {
    pub fn new(compiled: &CompiledProgram, ram: RamInit) -> CompiledChip {
        let chip = emu_avr::chips::chip(&compiled.map.mcu).expect("a known chip");
        let loaded =
            emu_core::image::load_hex("image", compiled.hex.as_bytes(), chip.hex_spaces).expect("a sound image");
        let mut chip = CompiledChip { cpu: Avr::new(chip, &loaded.image, ram), map: compiled.map.clone() };
        chip.run_to(chip.map.poll);
        chip
    }

    /// Runs until the instruction at a byte address is next.
    pub fn run_to(&mut self, addr: u32) {
        self.cpu.set_breakpoint(addr / 2, true);
        let limit = self.cpu.cycle() + 100_000_000;
        let stop = self.cpu.run(limit, &mut ());
        assert_eq!(self.cpu.pc() * 2, addr, "{stop:?} before 0x{addr:04X}");
        self.cpu.set_breakpoint(addr / 2, false);
    }

    fn place(&self, name: &str) -> CellLocation {
        let found = self.map.symbols.iter().find(|s| s.name == name);
        found.unwrap_or_else(|| panic!("the map has {name}")).place.clone()
    }

    pub fn get(&self, name: &str) -> i32 {
        let peek = |space: &str, addr| self.cpu.peek(space, addr).expect("a place in memory");
        match self.place(name) {
            CellLocation::Bit { space, addr, bit } => i32::from(peek(&space, addr) >> bit & 1),
            CellLocation::Word { space, addr, .. } => {
                i16::from_le_bytes([peek(&space, addr), peek(&space, addr + 1)]).into()
            }
        }
    }

    pub fn set(&mut self, name: &str, value: i32) {
        match self.place(name) {
            CellLocation::Bit { space, addr, bit } => {
                let old = self.cpu.peek(&space, addr).expect("a place in memory");
                let new = old & !(1 << bit) | (value as u8 & 1) << bit;
                assert!(self.cpu.poke(&space, addr, new));
            }
            CellLocation::Word { space, addr, .. } => {
                for (n, byte) in (value as i16).to_le_bytes().into_iter().enumerate() {
                    assert!(self.cpu.poke(&space, addr + n as u32, byte));
                }
            }
        }
    }

    /// Runs one scan without its timer and returns its clocks, from its first instruction to the start of the
    /// wait.
    ///
    /// Values are set at the start of the scan, inputs after they were latched.
    pub fn scan(&mut self, values: &[(String, i32)]) -> u64 {
        self.cpu.set_pc(self.map.scan_start / 2);
        let start = self.cpu.cycle();
        for (name, value) in values.iter().filter(|(name, _)| !name.starts_with('X')) {
            self.set(name, *value);
        }
        let first = self.map.rungs.first().map_or(self.map.scan_end, |rung| rung.start);
        self.run_to(first);
        for (name, value) in values.iter().filter(|(name, _)| name.starts_with('X')) {
            self.set(name, *value);
        }
        self.run_to(self.map.scan_end);
        self.run_to(self.map.poll);
        self.cpu.cycle() - start
    }
}

/// Parses `Xa=1 Ca=-3` into pairs.
pub fn pairs(text: &str) -> Vec<(String, i32)> {
    text.split_whitespace()
        .map(|pair| {
            let (name, value) = pair.split_once('=').unwrap_or_else(|| panic!("`{pair}` is name=value"));
            (name.to_owned(), value.parse().unwrap_or_else(|_| panic!("`{pair}` has a number")))
        })
        .collect()
}
