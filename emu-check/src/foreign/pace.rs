//! Where scans begin in an image of which nothing is known: by the timer's flag that it waits for.
//!
//! First the flag: registers of timer flags are watched, and of all instructions that write there the one is taken that does it
//! once in about CYCLE. Then the loop: shortly before such a write the instructions that the chip executes most often are
//! the loop that waits, what follows them is the first of the scan, and the first of them to come again is its end.
//!
//! Only those last cycles are looked at instruction by instruction; else turns of loops that only wait are jumped over.

use std::collections::HashMap;

use emu_core::chip::{Chip, Family};
use emu_core::cpu::{Cpu, Probe, Stop};

/// Where a scan begins and ends, as program words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Found {
    /// First instruction behind the loop that waits.
    pub start: u32,
    /// The first of that loop to be executed after a scan.
    pub wait: u32,
    /// Machine cycles from one start to the next, about.
    pub period: u64,
}

/// Periods that are watched.
const WATCHED: u64 = 12;

/// Machine cycles allowed for a program to set itself up, at most so many periods besides.
const RESET: u64 = 200_000;

/// Registers that hold flags of timers, and single bits that are.
const AVR: [&str; 6] = ["TIFR", "TIFR0", "TIFR1", "TIFR2", "TIFR3", "ETIFR"];
const PIC16: [&str; 3] = ["PIR1", "PIR2", "INTCON"];
const MCS51: [&str; 2] = ["TCON", "T2CON"];
const MCS51_BITS: [&str; 3] = ["TF0", "TF1", "TF2"];

/// Machine cycles before a flag is cleared in which the loop that waits is looked for; where it is not found, in more of them. A
/// scan that is busy for long in loops of its own lies before them.
const WINDOWS: [u64; 3] = [512, 8192, u64::MAX];

/// Watches writes to flag registers, with the instruction that makes them.
struct Flags {
    space: Option<u8>,
    regs: Vec<u16>,
    bit_space: Option<u8>,
    bits: Vec<u16>,
    pc: u32,
    /// Machine cycle and instruction of each write.
    writes: Vec<(u64, u32)>,
}

impl Flags {
    fn new(chip: &Chip) -> Flags {
        let names: &[&str] = match chip.family {
            Family::Avr => &AVR,
            Family::Pic16 => &PIC16,
            Family::Mcs51 => &MCS51,
            Family::Ap101 => &[],
        };
        Flags {
            space: chip.space(chip.reg_space),
            regs: names.iter().filter_map(|name| chip.reg(name)).collect(),
            bit_space: chip.space("bit"),
            bits: MCS51_BITS.iter().filter_map(|name| chip.bit(name)).collect(),
            pc: 0,
            writes: Vec::new(),
        }
    }
}

impl Probe for Flags {
    const INSN: bool = true;
    const EVERY: bool = false;
    const DATA: bool = true;
    const READS: bool = false;

    fn insn(&mut self, _: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn data(&mut self, at: u64, space: u8, addr: u16, _: u8, write: bool) -> bool {
        let flag = Some(space) == self.space && self.regs.contains(&addr)
            || Some(space) == self.bit_space && self.bits.contains(&addr);
        if write && flag {
            self.writes.push((at, self.pc));
        }
        false
    }
}

/// Notes every instruction.
#[derive(Default)]
struct Trace(Vec<u32>);

impl Probe for Trace {
    const INSN: bool = true;

    fn insn(&mut self, _: u64, pc: u32) -> bool {
        self.0.push(pc);
        false
    }
}

/// Finds the pacing of the program in `cpu`, which is fresh from reset; `period` is CYCLE in machine cycles.
///
/// # Errors
/// What was seen instead, in words.
pub(crate) fn find<C: Cpu>(mut cpu: C, period: u64) -> Result<Found, String> {
    let mut flags = Flags::new(cpu.chip());
    let until = RESET.saturating_add(period.saturating_mul(WATCHED));
    run(&mut cpu, until, &mut flags)?;
    let mut writes: HashMap<u32, Vec<u64>> = HashMap::new();
    flags.writes.iter().for_each(|&(at, pc)| writes.entry(pc).or_default().push(at));
    let mut takes: Vec<(u64, u32)> = Vec::new();
    let mut others: Vec<u64> = Vec::new();
    for (&pc, at) in &writes {
        // The first may belong to the set-up.
        let [_, from, .., to] = at.as_slice() else { continue };
        let mean = (to - from) / (at.len() as u64 - 2).max(1);
        if mean.abs_diff(period) <= period / 10 { takes.push((mean, pc)) } else { others.push(mean) }
    }
    takes.sort_unstable();
    let Some(&(mean, take)) = takes.first() else {
        let nearest = others.iter().min_by_key(|mean| mean.abs_diff(period));
        return Err(match nearest {
            Some(mean) => format!("a timer's flag is cleared every {mean} machine cycles, and CYCLE is {period}"),
            None => format!("no timer's flag is cleared again and again, every {period} machine cycles as CYCLE asks"),
        });
    };
    // From one take to the next: a scan and its wait, whatever the order of the instructions.
    cpu.trap(take, true);
    let limit = period.saturating_mul(2);
    to_trap(&mut cpu, limit)?;
    let from = cpu.clone();
    to_trap(&mut cpu, limit)?;
    let members = WINDOWS.iter().find_map(|window| {
        let (mut near, until) = (from.clone(), cpu.cycle().saturating_sub(*window));
        if until > near.cycle() && near.run(until, &mut ()) != Stop::Limit {
            return None;
        }
        let mut trace = Trace::default();
        near.run(cpu.cycle(), &mut trace);
        trace.0.push(take);
        waits(&trace.0)
    });
    let (start, members) = members
        .ok_or_else(|| "the program does not wait for the flag in a loop, or has no time left to wait".to_owned())?;
    cpu.trap(take, false);
    members.iter().for_each(|&pc| cpu.trap(pc, true));
    let wait = to_trap(&mut cpu, limit)?;
    Ok(Found { start, wait, period: mean })
}

/// Runs to the next trap, within so many machine cycles.
fn to_trap<C: Cpu>(cpu: &mut C, limit: u64) -> Result<u32, String> {
    match cpu.run(cpu.cycle().saturating_add(limit), &mut ()) {
        Stop::Trap { pc } => Ok(pc),
        stop => Err(format!("the instruction that clears the flag does not come again ({stop:?})")),
    }
}

/// The loop in the instructions that lead to a take: the first behind it, and its own.
fn waits(trace: &[u32]) -> Option<(u32, Vec<u32>)> {
    let mut visits: HashMap<u32, u64> = HashMap::new();
    trace.iter().for_each(|&pc| *visits.entry(pc).or_default() += 1);
    let most = visits.values().copied().max().unwrap_or(0);
    // What leaves the loop is not executed on the last turn, what the trace begins behind not on the first.
    let member = |pc: &u32| visits.get(pc).is_some_and(|&n| n + 2 >= most);
    if most < 6 {
        return None;
    }
    let mut exits = trace.windows(2).filter_map(|pair| match pair {
        [from, to] if member(from) && !member(to) => Some(*to),
        _ => None,
    });
    let start = exits.next()?;
    let mut members: Vec<u32> = visits.keys().copied().filter(|pc| member(pc)).collect();
    members.sort_unstable();
    exits.all(|exit| exit == start).then_some((start, members))
}

fn run<C: Cpu, P: Probe>(cpu: &mut C, until: u64, probe: &mut P) -> Result<(), String> {
    match cpu.run(until, probe) {
        Stop::Limit => Ok(()),
        Stop::Halted => Err("the program halts before any scan".to_owned()),
        Stop::Illegal { pc, word } => Err(format!("0x{word:04X} at program word 0x{pc:04X} is no instruction")),
        Stop::Fault { pc, fault } => Err(format!("{fault}, at program word 0x{pc:04X}")),
        Stop::Trap { .. } | Stop::Probe => Err("the program stopped where nobody asked for".to_owned()),
    }
}
