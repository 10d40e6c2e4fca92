//! Runs the cases of `avr.txt`, whose header explains the format.

use std::collections::{BTreeMap, BTreeSet};

use emu_avr::Avr;
use emu_avr::chips::{ATMEGA328P, chip};
use emu_avr::isa::{ROWS, find_row};
use emu_core::image::Image;
use emu_core::rng::Rng;
use emu_core::table::MatchedRow;
use emu_core::{Cpu, ProgramError, RamInit, StopReason};

const CASES: &str = include_str!("avr.txt");

/// Number of random backgrounds for each case. Everything that a case does not name must stay unchanged on
/// all of them.
const BACKGROUNDS: u64 = 4;

const FLAGS: &str = "CZNVSHTI";

/// Everything that a case can name, as plain data: registers and RAM in one array.
#[derive(Debug, Clone, PartialEq, Eq)]
struct State {
    data: Vec<u8>,
    sreg: u8,
    sp: u16,
    /// Byte address.
    pc: u32,
}

struct Case<'a> {
    number: usize,
    line: &'a str,
    asm: &'a str,
    before: Vec<(&'a str, u32, usize)>,
    after: Vec<(&'a str, u32, usize)>,
    outcome: &'a str,
}

/// Parses `name=hex` items: name, value, number of digits.
fn items(text: &str, line: usize) -> Vec<(&str, u32, usize)> {
    let item = |word| {
        let (name, value): (&str, &str) = str::split_once(word, '=').unwrap_or_else(|| panic!("line {line}: `{word}`"));
        let number = u32::from_str_radix(value, 16).unwrap_or_else(|e| panic!("line {line}: `{word}`: {e}"));
        (name, number, value.len())
    };
    text.split_whitespace().map(item).collect()
}

fn cases() -> Vec<Case<'static>> {
    let lines = CASES.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    lines
        .map(|(i, line)| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let [asm, states, outcome] = columns[..] else { panic!("line {}: three columns are wanted", i + 1) };
            let (before, after) = states.split_once("->").unwrap_or_else(|| panic!("line {}: no ->", i + 1));
            let (before, after) = (items(before, i + 1), items(after, i + 1));
            Case { number: i + 1, line, asm, before, after, outcome }
        })
        .collect()
}

fn bracketed<'a>(name: &'a str, head: &str) -> Option<&'a str> {
    name.strip_prefix(head)?.strip_prefix('[')?.strip_suffix(']')
}

impl State {
    fn random(rng: &mut Rng) -> State {
        let mut data = vec![0; 0x900];
        rng.fill(&mut data[..0x20]);
        rng.fill(&mut data[0x100..]);
        State { data, sreg: rng.next_u64() as u8, sp: 0x200 + rng.below(0x600) as u16, pc: 0x200 }
    }

    /// Sets one named item; program memory is not part of the state.
    fn set(&mut self, name: &str, value: u32, case: &Case) {
        let at = case.number;
        if let Some(bit) = FLAGS.find(name).filter(|_| name.len() == 1) {
            self.sreg = self.sreg & !(1 << bit) | (value as u8) << bit;
        } else if let Some(addr) = bracketed(name, "") {
            let addr = usize::from_str_radix(addr, 16).unwrap_or_else(|e| panic!("line {at}: {name}: {e}"));
            assert!(!(0x5D..=0x5F).contains(&addr), "line {at}: SP and SREG go by their names");
            self.data[addr] = value as u8;
        } else if let Some((high, low)) = name.strip_prefix('r').and_then(|n| n.split_once(':')) {
            let (high, low): (usize, usize) = (high.parse().expect("register"), low.parse().expect("register"));
            (self.data[high], self.data[low]) = ((value >> 8) as u8, value as u8);
        } else if let Some(n) = name.strip_prefix('r') {
            self.data[n.parse::<usize>().expect("register")] = value as u8;
        } else {
            match name {
                "SREG" => self.sreg = value as u8,
                "SP" => self.sp = value as u16,
                "PC" => self.pc = value,
                _ => panic!("line {at}: `{name}` is nothing that a case can name"),
            }
        }
    }

    fn put_into(&self, avr: &mut Avr) {
        for (addr, &byte) in self.data.iter().enumerate() {
            // Registers of the chip keep their reset values, except those that a case names.
            if !(0x20..0x100).contains(&addr) || byte != 0 {
                assert!(avr.poke("data", addr as u32, byte));
            }
        }
        avr.set_reg("SREG", u32::from(self.sreg));
        avr.set_reg("SP", u32::from(self.sp));
        avr.set_pc(self.pc / 2);
    }

    fn of(avr: &Avr) -> State {
        let byte = |addr| avr.peek("data", addr).unwrap_or_else(|| panic!("data:{addr:04x}"));
        let mut data: Vec<u8> = (0..0x900).map(byte).collect();
        data[0x5D..0x60].fill(0);
        let reg = |name| avr.reg(name).unwrap_or_else(|| panic!("{name}"));
        State { data, sreg: reg("SREG") as u8, sp: reg("SP") as u16, pc: avr.pc() * 2 }
    }

    /// Describes the differences between the expected and the actual state.
    fn against(&self, found: &State) -> String {
        let mut out = String::new();
        let mut note = |name: String, wanted: u32, found: u32| {
            if wanted != found {
                out += &format!("  {name}: wanted {wanted:02x}, found {found:02x}\n");
            }
        };
        for (addr, (&w, &f)) in self.data.iter().zip(&found.data).enumerate() {
            note(if addr < 32 { format!("r{addr}") } else { format!("[{addr:04x}]") }, w.into(), f.into());
        }
        for (bit, flag) in FLAGS.chars().enumerate() {
            note(flag.to_string(), (self.sreg >> bit & 1).into(), (found.sreg >> bit & 1).into());
        }
        note("SP".into(), self.sp.into(), found.sp.into());
        note("PC".into(), self.pc, found.pc);
        out
    }
}

/// Runs one case on one background; returns a description of the differences as the error.
fn run(case: &Case, base: &Avr, seed: u64) -> Result<(), String> {
    let mut avr = base.clone();
    let mut wanted = State::random(&mut Rng::new(seed));
    for &(name, value, _) in case.before.iter().filter(|(n, ..)| bracketed(n, "flash").is_none()) {
        wanted.set(name, value, case);
    }
    wanted.put_into(&mut avr);
    // The effect of writes to the chip's registers is not tested here.
    wanted.data[0x20..0x100].copy_from_slice(&State::of(&avr).data[0x20..0x100]);
    let words = line(case.asm, wanted.pc / 2).map_err(|e| format!("  {e}\n"))?;
    let end = avr.chip().flash_bytes - 1;
    let mut flash = |addr: u32, byte: u8| assert!(avr.poke("flash", addr & end, byte));
    for (i, word) in words.iter().enumerate() {
        let [low, high] = word.to_le_bytes();
        flash(wanted.pc + 2 * i as u32, low);
        flash(wanted.pc + 2 * i as u32 + 1, high);
    }
    for &(name, value, digits) in &case.before {
        if let Some(addr) = bracketed(name, "flash") {
            let addr = u32::from_str_radix(addr, 16).map_err(|e| format!("  {name}: {e}\n"))?;
            flash(addr, value as u8);
            if digits == 4 {
                flash(addr + 1, (value >> 8) as u8);
            }
        }
    }
    let cycle = avr.cycle();
    let at = wanted.pc / 2;
    let stop = avr.step(&mut ());
    let spent = avr.cycle() - cycle;
    if let Ok(cycles) = case.outcome.parse::<u64>() {
        wanted.pc = (wanted.pc + 2 * words.len() as u32) & 0x7FFF;
        // A jump to itself with nothing that can wake the chip also ends a program.
        let ends = stop == StopReason::Halted && avr.pc() == at;
        if stop != StopReason::Limit && !ends || spent != cycles {
            return Err(format!("  {stop:?} after {spent} cycles, {cycles} wanted\n"));
        }
    } else {
        let stops = match case.outcome {
            "illegal" => StopReason::Error(ProgramError::Illegal { pc: at, word: words[0] }),
            other => return Err(format!("  `{other}` is not an outcome\n")),
        };
        if stop != stops || spent != 0 {
            return Err(format!("  {stop:?} after {spent} cycles, {stops:?} wanted\n"));
        }
    }
    for &(name, value, _) in &case.after {
        wanted.set(name, value, case);
    }
    let differences = wanted.against(&State::of(&avr));
    if differences.is_empty() { Ok(()) } else { Err(differences) }
}

/// Assembles an instruction; one that only larger chips have is assembled for such a chip.
fn line(text: &str, pc: u32) -> Result<Vec<u16>, emu_core::table::AsmError> {
    let large = chip("atmega128").expect("a chip");
    emu_asm::assemble_line(&ATMEGA328P, text, pc)
        .or_else(|why| emu_asm::assemble_line(large, text, pc).map_err(|_| why))
}

#[test]
fn every_case_does_what_it_says_and_nothing_else() {
    let base = |chip| Avr::new(chip, &Image::default(), RamInit::Zero);
    let (base, larger) = (base(&ATMEGA328P), base(chip("atmega128").expect("a chip")));
    let mut failures = String::new();
    for case in cases() {
        let bad = (0..BACKGROUNDS).map(|n| case.number as u64 * 1000 + n).find_map(|seed| {
            let base = if case.asm.starts_with("elpm") { &larger } else { &base };
            let text = run(&case, base, seed).err()?;
            Some(format!("line {}: {}\n  background {seed}\n{text}", case.number, case.line))
        });
        failures += &bad.unwrap_or_default();
    }
    assert!(failures.is_empty(), "\n{failures}");
}

#[test]
fn every_row_and_every_outcome_has_a_case() {
    let mut seen: BTreeMap<&str, BTreeSet<u8>> = BTreeMap::new();
    for case in cases() {
        let words = line(case.asm, 0x100).or_else(|_| line(case.asm, 0)).unwrap_or_default();
        let second = words.get(1).copied().unwrap_or(0);
        if let Some(MatchedRow { row, .. }) = words.first().and_then(|&first| find_row(first, second)) {
            seen.entry(row.name).or_default().extend(case.outcome.parse::<u8>());
        }
    }
    let mut missing = Vec::new();
    for row in ROWS {
        match seen.get(row.name) {
            None => missing.push(row.name.to_owned()),
            Some(cycles) => {
                let absent = row.cycles.possible_counts().iter().filter(|c| !cycles.contains(c));
                missing.extend(absent.map(|c| format!("{} of {c} cycles", row.name)));
            }
        }
    }
    assert!(missing.is_empty(), "no case for {missing:?}");
}
