//! Runs the cases of `pic16.txt`, whose header explains the format.

use std::collections::{BTreeMap, BTreeSet};

use emu_core::rng::Rng;
use emu_core::{Cpu, ProgramError, StopReason};
use emu_pic16::Pic16;
use emu_pic16::isa::{Pic16Row, ROWS, SHAPES, find_row};

use super::rig::{FSR, INDF, PCL, PCLATH, QUIET, STATUS, machine, put_word, word};

const CASES: &str = include_str!("pic16.txt");

/// Number of random backgrounds for each case. Everything that a case does not name must stay unchanged on
/// all of them.
const BACKGROUNDS: u64 = 4;

/// Named bits of STATUS: position and width.
const BITS: &[(&str, u32, u32)] =
    &[("C", 0, 1), ("DC", 1, 1), ("Z", 2, 1), ("PD", 3, 1), ("TO", 4, 1), ("RP", 5, 2), ("IRP", 7, 1)];

/// Chip of cases that name none.
const CHIP: &str = "pic16f877";

/// Everything that a case can name, as plain data. Bytes are at their lowest address.
#[derive(Debug, Clone, PartialEq, Eq)]
struct State {
    data: BTreeMap<u16, u8>,
    w: u8,
    pc: u32,
    stack: [u16; 8],
    sp: usize,
}

struct Case {
    number: usize,
    line: &'static str,
    asm: &'static str,
    chip: &'static str,
    before: Vec<(&'static str, u32)>,
    after: Vec<(&'static str, u32)>,
    outcome: &'static str,
}

/// Parses `name=hex` items; an item with the chip is removed.
fn items(text: &'static str, line: usize, chip: &mut &'static str) -> Vec<(&'static str, u32)> {
    let item = |word: &'static str| {
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

fn cases() -> Vec<Case> {
    let lines = CASES.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    lines
        .map(|(i, line)| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let (3..=4, [asm, states, outcome, ..]) = (columns.len(), &columns[..]) else {
                panic!("line {}: three columns are wanted, and at most a note", i + 1)
            };
            let (before, after) = states.split_once("->").unwrap_or_else(|| panic!("line {}: no ->", i + 1));
            let mut chip = CHIP;
            let before = items(before, i + 1, &mut chip);
            let after = items(after, i + 1, &mut chip);
            Case { number: i + 1, line, asm, chip, before, after, outcome }
        })
        .collect()
}

/// Returns the lowest address of the byte at `addr` (data sheets, "Register file map": DS30292 figures 2-3
/// and 2-4, DS35007 figure 2-2); None for unimplemented addresses and INDF.
fn lowest(chip: &str, addr: u16) -> Option<u16> {
    let (bank, low) = (addr / 0x80, addr % 0x80);
    if low == INDF {
        return None;
    }
    if [PCL, STATUS, FSR, PCLATH, 0x0B].contains(&low) {
        return Some(low);
    }
    match (chip, bank, low) {
        ("pic16f84", ..) => match low {
            0x0C..=0x4F => Some(low),
            0x07 | 0x50.. => None,
            _ => Some((bank & 1) * 0x80 + low),
        },
        // Timer 0, OPTION_REG, PORTB and TRISB.
        (_, _, 0x01 | 0x06) => Some((bank & 1) * 0x80 + low),
        ("pic16f873", 2 | 3, 0x20..) => Some((bank & 1) * 0x80 + low),
        ("pic16f873", _, 0x20..) => Some(addr),
        ("pic16f877", _, 0x70..) => Some(low),
        ("pic16f877", ..) if low >= [0x20, 0x20, 0x10, 0x10][usize::from(bank)] => Some(addr),
        (_, 0, ..0x20) => Some(addr).filter(|_| chip == "pic16f877" || low != 0x08 && low != 0x09),
        (_, 1, 0x05 | 0x07 | 0x0C..=0x0E | 0x11..=0x14 | 0x18 | 0x19 | 0x1E | 0x1F) => Some(addr),
        ("pic16f877", 1, 0x08 | 0x09) => Some(addr),
        (_, 2, 0x0C..=0x0F) | (_, 3, 0x0C | 0x0D) => Some(addr),
        _ => None,
    }
}

/// Reports whether an address returned by [`lowest`] is RAM.
fn is_ram(chip: &str, addr: u16) -> bool {
    match chip {
        "pic16f84" => (0x0C..0x80).contains(&addr),
        _ => addr % 0x80 >= if addr < 0x100 { 0x20 } else { 0x10 },
    }
}

/// Parses an address such as `[1A5]`.
fn bracketed(name: &str) -> Option<u16> {
    let digits = name.strip_prefix('[')?.strip_suffix(']')?;
    Some(u16::from_str_radix(digits, 16).unwrap_or_else(|e| panic!("{name}: {e}")))
}

/// Returns the word of the instruction: assembled, or as given.
fn code(case: &Case) -> u16 {
    match case.asm.strip_prefix("word ") {
        Some(word) => u16::from_str_radix(word, 16).unwrap_or_else(|e| panic!("line {}: {e}", case.number)),
        None => word(case.asm),
    }
}

impl State {
    /// Reads the state of the machine.
    fn of(cpu: &Pic16, chip: &str) -> State {
        let byte = |addr: u16| cpu.peek("data", addr.into()).unwrap_or_else(|| panic!("{addr:03x}"));
        let kept = (0..0x200).filter(|&addr| lowest(chip, addr) == Some(addr) && addr != PCL);
        State {
            data: kept.map(|addr| (addr, byte(addr))).collect(),
            w: cpu.reg("W").expect("a register") as u8,
            pc: cpu.pc(),
            stack: *cpu.stack().entries,
            sp: cpu.stack().next,
        }
    }

    fn put(&mut self, addr: u16, mask: u8, value: u8) {
        let byte = self.data.get_mut(&addr).unwrap_or_else(|| panic!("nothing at {addr:03x}"));
        *byte = *byte & !mask | value & mask;
    }

    /// Sets one named item; returns false if a case cannot name it.
    fn set(&mut self, chip: &str, name: &str, value: u32) -> bool {
        let byte = value as u8;
        if let Some(addr) = bracketed(name) {
            let Some(addr) = lowest(chip, addr) else { return value == 0 };
            self.put(addr, 0xFF, byte);
        } else if let Some(&(_, at, width)) = BITS.iter().find(|(bit, ..)| *bit == name) {
            self.put(STATUS, (((1u32 << width) - 1) << at) as u8, (value << at) as u8);
        } else {
            match name {
                "W" => self.w = byte,
                "STATUS" => self.put(STATUS, 0xFF, byte),
                "FSR" => self.put(FSR, 0xFF, byte),
                "PCLATH" => self.put(PCLATH, 0xFF, byte),
                "PC" => self.pc = value,
                "push" => {
                    self.stack[self.sp] = value as u16;
                    self.sp = (self.sp + 1) % 8;
                }
                "pop" => self.sp = (self.sp + 7) % 8,
                _ => return false,
            }
        }
        true
    }

    /// Puts the state into the machine, after the calls that fill its stack.
    fn put_into(&self, cpu: &mut Pic16, chip: &str, named: &BTreeSet<u16>) {
        for (&addr, &byte) in &self.data {
            if named.contains(&addr) || is_ram(chip, addr) || addr == STATUS || addr == FSR {
                assert!(cpu.poke("data", addr.into(), byte), "{addr:03x}");
            }
        }
        cpu.set_reg("W", self.w.into());
        cpu.set_pc(self.pc);
    }

    /// Describes the differences between the expected and the actual state.
    fn against(&self, found: &State) -> String {
        let mut out = String::new();
        for ((addr, w), f) in self.data.iter().zip(found.data.values()).filter(|((_, w), f)| w != f) {
            out += &format!("  [{addr:03x}]: wanted {w:02x}, found {f:02x}\n");
        }
        if self.w != found.w {
            out += &format!("  W: wanted {:02x}, found {:02x}\n", self.w, found.w);
        }
        if self.pc != found.pc {
            out += &format!("  PC: wanted {:04x}, found {:04x}\n", self.pc, found.pc);
        }
        if (self.stack, self.sp) != (found.stack, found.sp) {
            out += &format!("  stack: wanted {:x?}, found {:x?}\n", (self.stack, self.sp), (found.stack, found.sp));
        }
        out
    }
}

/// Pushes `top` by executing a CALL.
fn push(cpu: &mut Pic16, top: u32) {
    let at = (top + 0x1FFF) % 0x2000;
    let kept = at % cpu_words(cpu);
    put_word(cpu, kept, 0x2000);
    cpu.set_pc(at);
    assert_eq!(cpu.step(&mut ()), StopReason::Limit);
    put_word(cpu, kept, 0x3FFF);
}

fn cpu_words(cpu: &Pic16) -> u32 {
    cpu.chip().flash_bytes / 2
}

/// Runs one case on one background; returns a description of the differences as the error.
fn run(case: &Case, new: &Pic16, seed: u64) -> Result<(), String> {
    let mut cpu = new.clone();
    for &(_, top) in case.before.iter().filter(|item| item.0 == "push") {
        push(&mut cpu, top);
    }
    cpu.set_pc(0x0234);
    let mut wanted = State::of(&cpu, case.chip);
    let mut rng = Rng::new(seed);
    let some = rng.next_u64();
    wanted.w = some as u8;
    wanted.put(FSR, 0xFF, (some >> 8) as u8);
    wanted.put(STATUS, 0x87, (some >> 16) as u8);
    for (_, byte) in wanted.data.iter_mut().filter(|(addr, _)| is_ram(case.chip, **addr)) {
        *byte = rng.next_u64() as u8;
    }
    let mut named = BTreeSet::new();
    for &(name, value) in case.before.iter().filter(|item| item.0 != "push") {
        if !wanted.set(case.chip, name, value) {
            return Err(format!("  `{name}` is nothing that a case can name\n"));
        }
        named.extend(bracketed(name).and_then(|addr| lowest(case.chip, addr)));
        named.extend((name == "PCLATH").then_some(PCLATH));
    }
    let (pc, op) = (wanted.pc, code(case));
    let at = pc % cpu_words(&cpu);
    put_word(&mut cpu, at, op);
    wanted.put_into(&mut cpu, case.chip, &named);
    let put = State::of(&cpu, case.chip);
    if put != wanted {
        return Err(format!("  not what the case begins with:\n{}", wanted.against(&put)));
    }
    let (cycle, counted) = (cpu.cycle(), cpu.instructions());
    let stop = cpu.step(&mut ());
    let (spent, done) = (cpu.cycle() - cycle, cpu.instructions() - counted);
    if let Ok(cycles) = case.outcome.parse::<u64>() {
        wanted.pc = (pc + 1) % 0x2000;
        // A jump to itself with nothing that can wake the chip also ends a program.
        let ends = stop == StopReason::Halted && cpu.pc() == pc;
        if stop != StopReason::Limit && !ends || spent != cycles || done != 1 {
            return Err(format!("  {stop:?} after {spent} cycles and {done} instructions, {cycles} wanted\n"));
        }
    } else if case.outcome != "illegal"
        || stop != (StopReason::Error(ProgramError::Illegal { pc, word: op }))
        || spent != 0
        || done != 0
    {
        return Err(format!("  {stop:?} after {spent} cycles, {} wanted\n", case.outcome));
    }
    for &(name, value) in &case.after {
        if !wanted.set(case.chip, name, value) {
            return Err(format!("  `{name}` is nothing that a case can want\n"));
        }
    }
    let differences = wanted.against(&State::of(&cpu, case.chip));
    if differences.is_empty() { Ok(()) } else { Err(differences) }
}

#[test]
fn every_case_does_what_it_says_and_nothing_else() {
    let mut failures = String::new();
    let mut chips = BTreeMap::new();
    for case in cases() {
        let new = chips.entry(case.chip).or_insert_with(|| machine(case.chip, 0x16));
        let bad = (0..BACKGROUNDS).map(|n| case.number as u64 * 1000 + n).find_map(|seed| {
            let text = run(&case, new, seed).err()?;
            Some(format!("line {}: {}\n  background {seed}\n{text}", case.number, case.line))
        });
        failures += &bad.unwrap_or_default();
    }
    assert!(failures.is_empty(), "\n{failures}");
    assert_eq!(QUIET & 0xC4, 0, "neither watchdog nor brown-out comes in between");
}

/// An instruction with a file register has cases with RAM and with a register, which are two kinds to the
/// interpreter.
#[test]
fn every_row_has_a_case() {
    let mut seen: BTreeMap<usize, BTreeSet<bool>> = BTreeMap::new();
    for case in cases() {
        let word = code(&case);
        if let Some(Pic16Row { kind, .. }) = find_row(word) {
            let ram = word & 0x7F >= if case.chip == "pic16f84" { 0x0C } else { 0x20 };
            seen.entry(kind as usize).or_default().insert(ram);
        }
    }
    let mut missing = Vec::new();
    for (i, row) in ROWS.iter().enumerate() {
        let found = seen.get(&i).cloned().unwrap_or_default();
        let sides: &[bool] = if SHAPES[i].is_some() { &[false, true] } else { &[] };
        if found.is_empty() || sides.iter().any(|side| !found.contains(side)) {
            missing.push(format!("{} {found:?}", row.name));
        }
    }
    assert!(missing.is_empty(), "no case for {missing:?}");
}
