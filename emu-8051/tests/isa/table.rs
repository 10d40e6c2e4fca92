//! Runs the cases of `8051.txt`; the head of that file explains their format.

use std::collections::{BTreeMap, BTreeSet};

use emu_8051::Mcs51;
use emu_8051::chips::chip;
use emu_8051::isa::{SHAPES, find_row};
use emu_core::image::Image;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_core::table::MatchedRow;
use emu_core::{Cpu, ProgramError, RamInit, StopReason};

use super::rig::parity;

const CASES: &str = include_str!("8051.txt");

/// Number of random backgrounds per case. Everything that a case does not name must stay unchanged on all of
/// them.
const BACKGROUNDS: u64 = 4;

/// Bits of PSW with names: position and width.
const BITS: &[(&str, u32, u32)] = &[("C", 7, 1), ("AC", 6, 1), ("F0", 5, 1), ("RS", 3, 2), ("OV", 2, 1), ("UD", 1, 1)];

const REGISTERS: &[(&str, usize)] =
    &[("A", 0xE0), ("B", 0xF0), ("PSW", 0xD0), ("SP", 0x81), ("P0", 0x80), ("P1", 0x90), ("P2", 0xA0), ("P3", 0xB0)];

/// The state that a case can name, as plain data. Special function registers are at their addresses, ports as
/// their latches.
#[derive(Debug, Clone, PartialEq, Eq)]
struct State {
    ram: Vec<u8>,
    sfr: Vec<u8>,
    pc: u32,
}

struct Case<'a> {
    number: usize,
    line: &'a str,
    asm: &'a str,
    chip: &'a str,
    before: Vec<(&'a str, u32)>,
    after: Vec<(&'a str, u32)>,
    outcome: &'a str,
}

/// Parses items `name=hex`; the item `on=` sets `chip` instead.
fn items<'a>(text: &'a str, line: usize, chip: &mut &'a str) -> Vec<(&'a str, u32)> {
    let item = |word: &'a str| {
        let (name, value) = word.split_once('=').unwrap_or_else(|| panic!("line {line}: `{word}`"));
        if name == "on" {
            *chip = value;
            return None;
        }
        let number = u32::from_str_radix(value, 16).unwrap_or_else(|e| panic!("line {line}: `{word}`: {e}"));
        Some((name, number))
    };
    text.split_whitespace().filter_map(item).collect()
}

fn cases() -> Vec<Case<'static>> {
    let lines = CASES.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    lines
        .map(|(i, line)| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let (3..=4, [asm, states, outcome, ..]) = (columns.len(), &columns[..]) else {
                panic!("line {}: three columns are wanted, and at most a note", i + 1)
            };
            let (before, after) = states.split_once("->").unwrap_or_else(|| panic!("line {}: no ->", i + 1));
            let mut chip = "8052";
            let before = items(before, i + 1, &mut chip);
            let after = items(after, i + 1, &mut chip);
            Case { number: i + 1, line, asm, chip, before, after, outcome }
        })
        .collect()
}

/// The address in `x[1234]`, where `x` is `head`.
fn bracketed(name: &str, head: &str) -> Option<u32> {
    let digits = name.strip_prefix(head)?.strip_prefix('[')?.strip_suffix(']')?;
    Some(u32::from_str_radix(digits, 16).unwrap_or_else(|e| panic!("{name}: {e}")))
}

/// The bytes of the instruction, assembled or given as bytes.
fn code(case: &Case, pc: u32) -> Vec<u8> {
    match case.asm.strip_prefix("db ") {
        Some(bytes) => bytes.split_whitespace().map(|b| u8::from_str_radix(b, 16).expect("a byte")).collect(),
        None => {
            let words = emu_asm::assemble_line(chip("8052").expect("a chip"), case.asm, pc)
                .unwrap_or_else(|e| panic!("line {}: {e}", case.number));
            words.iter().map(|&word| word as u8).collect()
        }
    }
}

impl State {
    fn random(rng: &mut Rng) -> State {
        let (mut ram, mut sfr) = (vec![0; 0x100], vec![0; 0x100]);
        rng.fill(&mut ram);
        for addr in [0xE0, 0xF0, 0xD0, 0x81, 0x82, 0x83] {
            sfr[addr] = rng.next_u64() as u8;
        }
        for port in [0x80, 0x90, 0xA0, 0xB0] {
            sfr[port] = 0xFF;
        }
        State { ram, sfr, pc: 0x1234 }
    }

    /// Sets one named item of the state. Returns false if it is not part of the state.
    fn set(&mut self, name: &str, value: u32) -> bool {
        if let Some(addr) = bracketed(name, "") {
            self.ram[addr as usize] = value as u8;
        } else if let Some(addr) = bracketed(name, "s") {
            self.sfr[addr as usize] = value as u8;
        } else if let Some(&(_, at, width)) = BITS.iter().find(|(bit, ..)| *bit == name) {
            let mask = ((1u32 << width) - 1) << at;
            self.sfr[0xD0] = self.sfr[0xD0] & !(mask as u8) | (value << at) as u8;
        } else if let Some(&(_, addr)) = REGISTERS.iter().find(|(register, _)| *register == name) {
            self.sfr[addr] = value as u8;
        } else if let Some(n) = name.strip_prefix('R').and_then(|n| n.parse::<usize>().ok()) {
            self.ram[usize::from(self.sfr[0xD0] & 0x18) + n] = value as u8;
        } else if name == "DPTR" {
            [self.sfr[0x83], self.sfr[0x82]] = (value as u16).to_be_bytes();
        } else if name == "PC" {
            self.pc = value;
        } else {
            return false;
        }
        true
    }

    /// Sets P as it follows from A.
    fn with_parity(mut self) -> State {
        self.sfr[0xD0] = self.sfr[0xD0] & 0xFE | parity(self.sfr[0xE0].into()) as u8;
        self
    }

    /// Puts the state into a machine. Registers that a case does not name keep their reset values.
    fn put_into(&self, cpu: &mut Mcs51, named: &BTreeSet<usize>) {
        for (addr, &byte) in self.ram.iter().enumerate() {
            assert!(cpu.poke("idata", addr as u32, byte) || addr >= 0x80);
        }
        for addr in (0x80..0x100).filter(|addr| named.contains(addr)) {
            assert!(cpu.poke("sfr", addr as u32, self.sfr[addr]));
        }
        cpu.set_pc(self.pc);
    }

    /// The state of a machine. With all pins pulled high from outside, ports read as their latches.
    fn of(cpu: &Mcs51) -> State {
        let mut cpu = cpu.clone();
        (0..32).for_each(|pin| cpu.drive(CycleTime::at(cpu.cycle()), pin, PinLevel::High));
        let ram = (0..0x100).map(|addr| cpu.peek("idata", addr).unwrap_or(0)).collect();
        let sfr = (0..0x100).map(|addr| cpu.peek("sfr", addr).unwrap_or(0)).collect();
        State { ram, sfr, pc: cpu.pc() }
    }

    /// Describes the differences between this (expected) state and `found`.
    fn against(&self, found: &State) -> String {
        let mut out = String::new();
        let mut note = |name: String, wanted: u32, found: u32| {
            if wanted != found {
                out += &format!("  {name}: wanted {wanted:02x}, found {found:02x}\n");
            }
        };
        for (addr, (&w, &f)) in self.ram.iter().zip(&found.ram).enumerate() {
            note(format!("[{addr:02x}]"), w.into(), f.into());
        }
        for (addr, (&w, &f)) in self.sfr.iter().zip(&found.sfr).enumerate() {
            note(format!("s[{addr:02x}]"), w.into(), f.into());
        }
        note("PC".into(), self.pc, found.pc);
        out
    }
}

fn external(cpu: &Mcs51) -> Vec<Option<u8>> {
    (0..0x1_0000).map(|addr| cpu.peek("xdata", addr)).collect()
}

/// Runs one case on one background. The error describes the differences.
fn run(case: &Case, seed: u64) -> Result<(), String> {
    let row = chip(case.chip).ok_or(format!("  no chip {}\n", case.chip))?;
    let mut cpu = Mcs51::new(row, &Image::default(), RamInit::Random(seed));
    let mut wanted = State::random(&mut Rng::new(seed));
    let mut named: BTreeSet<usize> = [0xE0, 0xF0, 0xD0, 0x81, 0x82, 0x83].into();
    let mut pulled = Vec::new();
    for &(name, value) in &case.before {
        let before = wanted.clone();
        if wanted.set(name, value) {
            // An item counts as named even if it changes nothing.
            let changed = (0x80..0x100).filter(|&addr| wanted.sfr[addr] != before.sfr[addr]);
            named.extend(changed.chain(bracketed(name, "s").map(|addr| addr as usize)));
        } else if let Some(addr) = bracketed(name, "x") {
            assert!(cpu.poke("xdata", addr, value as u8));
        } else if let Some(addr) = bracketed(name, "code") {
            assert!(cpu.poke("code", addr, value as u8));
        } else if let Some(port) = name.strip_prefix("pinP") {
            let port: PinId = port.parse().expect("a port");
            pulled.extend((0..8).filter(|bit| value >> bit & 1 == 0).map(|bit| port * 8 + bit));
        } else {
            return Err(format!("  `{name}` is nothing that a case can name\n"));
        }
    }
    let pc = wanted.pc;
    let bytes = code(case, pc);
    for (i, &byte) in (0..).zip(&bytes) {
        assert!(cpu.poke("code", (pc + i) & 0xFFFF, byte));
    }
    wanted.put_into(&mut cpu, &named);
    for pin in pulled {
        cpu.drive(CycleTime::at(cpu.cycle()), pin, PinLevel::Low);
    }
    // Registers that are not named have their reset values, and missing RAM reads as nothing.
    let found = State::of(&cpu);
    for addr in (0x80..0x100).filter(|addr| !named.contains(addr)) {
        wanted.sfr[addr] = found.sfr[addr];
    }
    if cpu.peek("idata", 0x80).is_none() {
        wanted.ram[0x80..].fill(0);
    }
    let mut outside = if case.asm.starts_with("movx") { external(&cpu) } else { Vec::new() };
    let (cycle, counted) = (cpu.cycle(), cpu.instructions());
    let stop = cpu.step(&mut ());
    let (spent, done) = (cpu.cycle() - cycle, cpu.instructions() - counted);
    if let Ok(cycles) = case.outcome.parse::<u64>() {
        wanted.pc = (pc + bytes.len() as u32) & 0xFFFF;
        // A jump to itself with nothing that can wake the chip also ends a program.
        let ends = stop == StopReason::Halted && cpu.pc() == pc;
        if stop != StopReason::Limit && !ends || spent != cycles || done != 1 {
            return Err(format!("  {stop:?} after {spent} cycles and {done} instructions, {cycles} wanted\n"));
        }
    } else {
        let stops = StopReason::Error(ProgramError::Illegal { pc, word: bytes[0].into() });
        if case.outcome != "illegal" || stop != stops || spent != 0 {
            return Err(format!("  {stop:?} after {spent} cycles, {} wanted\n", case.outcome));
        }
    }
    for &(name, value) in &case.after {
        if let Some(addr) = bracketed(name, "x") {
            outside[addr as usize] = Some(value as u8);
        } else if !wanted.set(name, value) {
            return Err(format!("  `{name}` is nothing that a case can want\n"));
        }
    }
    let mut differences = wanted.with_parity().against(&State::of(&cpu));
    if !outside.is_empty() {
        for (addr, (w, f)) in outside.iter().zip(external(&cpu)).enumerate().filter(|(_, (w, f))| *w != f) {
            differences += &format!("  x[{addr:04x}]: wanted {w:02x?}, found {f:02x?}\n");
        }
    }
    if differences.is_empty() { Ok(()) } else { Err(differences) }
}

#[test]
fn every_case_does_what_it_says_and_nothing_else() {
    let mut failures = String::new();
    for case in cases() {
        let bad = (0..BACKGROUNDS).map(|n| case.number as u64 * 1000 + n).find_map(|seed| {
            let text = run(&case, seed).err()?;
            Some(format!("line {}: {}\n  background {seed}\n{text}", case.number, case.line))
        });
        failures += &bad.unwrap_or_default();
    }
    assert!(failures.is_empty(), "\n{failures}");
}

/// An instruction with an address needs cases on both sides of 80h, because the interpreter has two kinds for
/// them.
#[test]
fn every_row_has_a_case() {
    let mut seen: BTreeMap<usize, BTreeSet<bool>> = BTreeMap::new();
    for case in cases() {
        let pc = case.before.iter().find(|item| item.0 == "PC").map_or(0x1234, |item| item.1);
        let bytes = code(&case, pc);
        let at = |i: usize| bytes.get(i).copied().unwrap_or(0);
        if let Some(MatchedRow { row, kind, .. }) = find_row([at(0), at(1), at(2)]) {
            let above = at(1) >= 0x80 || row.name == "MovDirDir" && at(2) >= 0x80;
            seen.entry(kind as usize).or_default().insert(above);
        }
    }
    let mut missing = Vec::new();
    for (i, row) in emu_8051::isa::ROWS.iter().enumerate() {
        let found = seen.get(&i).cloned().unwrap_or_default();
        let sides: &[bool] = if SHAPES[i].is_some() { &[false, true] } else { &[] };
        if found.is_empty() || sides.iter().any(|side| !found.contains(side)) {
            missing.push(format!("{} {found:?}", row.name));
        }
    }
    assert!(missing.is_empty(), "no case for {missing:?}");
}
