//! Finds where scans begin in an unknown image: where the program sees the timer flag that it waits for.
//!
//! 1. The flag: writes to the registers of timer flags are observed. The search selects an instruction that
//!    writes there once per CYCLE (within 10 %) and clears a bit.
//! 2. The poll: the first instruction that reads this bit as set. The wait lasts from the first execution of
//!    the poll after a scan to that moment; everything executed in between, such as delays and calls, belongs
//!    to the wait.
//! 3. The scan starts at the first instruction after the poll that the wait has not executed. It ends when
//!    the poll is executed again.
//! 4. The starts found in this way are counted from reset on. If they do not occur as often as the flag is
//!    cleared, the search fails.
//!
//! The emulator skips iterations of loops that only wait, except for some cycles around the moment at which
//! the flag is set.

use std::collections::{HashMap, HashSet};

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::{Cpu, Probe, ProgramError, StopReason};

use crate::CheckError;

/// Where a scan begins and ends; addresses are program words.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ScanLoop {
    /// The first instruction after the wait.
    pub start: u32,
    /// The instruction that polls the flag until it is set.
    pub wait: u32,
    /// Approximate machine cycles from one start to the next.
    pub period: u64,
    /// Maximum machine cycles between two polls of the flag, which is how late a scan may start.
    pub max_read_gap: u64,
}

/// Number of periods that are observed.
const WATCHED_PERIODS: u64 = 12;

/// Machine cycles allowed for the set-up of a program, in addition to [`WATCHED_PERIODS`] periods.
const MAX_RESET_CYCLES: u64 = 200_000;

/// AVR registers with timer flags.
const AVR: [&str; 6] = ["TIFR", "TIFR0", "TIFR1", "TIFR2", "TIFR3", "ETIFR"];
/// PIC16 registers with timer flags.
const PIC16: [&str; 3] = ["PIR1", "PIR2", "INTCON"];
/// 8051 registers with timer flags.
const MCS51: [&str; 2] = ["TCON", "T2CON"];
/// 8051 timer flags as bit addresses.
const MCS51_BITS: [&str; 3] = ["TF0", "TF1", "TF2"];

/// Number of waits analysed for each instruction that clears a flag, until one of them shows where scans
/// begin.
const MAX_WAITS: usize = 3;

/// Number of polls in a wait whose distances are measured.
const MEASURED_READS: usize = 16;

/// Maximum machine cycles from clearing the flag to the first instruction of the scan.
const MAX_CYCLES_AFTER_CLEAR: u64 = 2_000;

/// A probe that records writes to flag registers, with the instruction that makes each.
struct FlagWriteProbe {
    space: Option<u8>,
    regs: Vec<u16>,
    bit_space: Option<u8>,
    bits: Vec<u16>,
    pc: u32,
    /// Machine cycle, instruction address, and register of each write.
    writes: Vec<(u64, u32, u16)>,
}

impl FlagWriteProbe {
    fn new(chip: &Chip) -> FlagWriteProbe {
        let names: &[&str] = match chip.family {
            ChipFamily::Avr => &AVR,
            ChipFamily::Pic16 => &PIC16,
            ChipFamily::Mcs51 => &MCS51,
            ChipFamily::Ap101 => &[],
        };
        FlagWriteProbe {
            space: chip.space_index(chip.reg_space),
            regs: names.iter().filter_map(|name| chip.reg(name)).collect(),
            bit_space: chip.space_index("bit"),
            bits: MCS51_BITS.iter().filter_map(|name| chip.bit(name)).collect(),
            pc: 0,
            writes: Vec::new(),
        }
    }
}

impl Probe for FlagWriteProbe {
    const INSN: bool = true;
    const EVERY_ITERATION: bool = false;
    const DATA: bool = true;
    const DATA_READS: bool = false;

    fn on_instruction(&mut self, _: u64, pc: u32) -> bool {
        self.pc = pc;
        false
    }

    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, _: u8, write: bool) -> bool {
        let flag = Some(space) == self.space && self.regs.contains(&addr)
            || Some(space) == self.bit_space && self.bits.contains(&addr);
        if write && flag {
            // On an 8051, the address of a bit without its lowest three bits is the address of its register.
            let reg = if Some(space) == self.space { addr } else { addr & 0xF8 };
            self.writes.push((at, self.pc, reg));
        }
        false
    }
}

/// Some bits of a register.
#[derive(Debug, Clone, Copy)]
struct RegisterBits {
    reg: u16,
    mask: u8,
}

impl RegisterBits {
    /// The bits that are 1 in an access to `addr` of memory `space`; on an 8051 this includes accesses to
    /// single bits.
    fn bits_in_access(chip: &Chip, (space, addr, value): (u8, u16, u8)) -> Option<RegisterBits> {
        if Some(space) == chip.space_index(chip.reg_space) {
            return Some(RegisterBits { reg: addr, mask: value });
        }
        let bit = Some(space) == chip.space_index("bit") && addr >= 0x80;
        bit.then(|| RegisterBits { reg: addr & 0xF8, mask: u8::from(value != 0) << (addr & 7) })
    }

    fn register_value<C: Cpu>(cpu: &C, reg: u16) -> u8 {
        cpu.peek(cpu.chip().reg_space, reg.into()).unwrap_or(0)
    }

    fn is_set<C: Cpu>(self, cpu: &C) -> bool {
        RegisterBits::register_value(cpu, self.reg) & self.mask != 0
    }
}

/// A probe that stops after the first instruction that reads one of the bits as set.
struct FlagReadProbe {
    chip: &'static Chip,
    flag: RegisterBits,
    at: u64,
    pc: u32,
}

impl Probe for FlagReadProbe {
    const INSN: bool = true;
    const DATA: bool = true;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        (self.at, self.pc) = (at, pc);
        false
    }

    fn on_data_access(&mut self, _: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let ones = RegisterBits::bits_in_access(self.chip, (space, addr, value));
        !write && ones.is_some_and(|ones| ones.reg == self.flag.reg && ones.mask & self.flag.mask != 0)
    }
}

/// A probe that records cycle and address of instructions, except for iterations that the emulator skips.
#[derive(Default)]
struct InstructionTrace(Vec<(u64, u32)>);

impl Probe for InstructionTrace {
    const INSN: bool = true;
    const EVERY_ITERATION: bool = false;

    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.0.push((at, pc));
        false
    }
}

/// Finds the pacing of the program in `cpu`, which is in its power-up state; `period` is CYCLE in machine
/// cycles.
///
/// # Errors
/// The observation that contradicts a pacing by a timer flag.
pub(crate) fn find_scan_loop<C: Cpu>(cpu: C, period: u64) -> Result<ScanLoop, CheckError> {
    let mut flags = FlagWriteProbe::new(cpu.chip());
    let until = MAX_RESET_CYCLES.saturating_add(period.saturating_mul(WATCHED_PERIODS));
    let mut watched = cpu.clone();
    run_to_cycle(&mut watched, until, &mut flags)?;
    let mut writes: HashMap<(u32, u16), Vec<u64>> = HashMap::new();
    flags.writes.iter().for_each(|&(at, pc, reg)| writes.entry((pc, reg)).or_default().push(at));
    let mut candidates: Vec<(u64, u32, u16)> = Vec::new();
    let mut other_periods: Vec<u64> = Vec::new();
    for (&(pc, reg), at) in &writes {
        // The first write may belong to the set-up of the program.
        let [_, from, .., to] = at.as_slice() else { continue };
        let mean = (to - from) / (at.len() as u64 - 2).max(1);
        if mean.abs_diff(period) <= period / 10 { candidates.push((mean, pc, reg)) } else { other_periods.push(mean) }
    }
    candidates.sort_unstable();
    let nearest = other_periods.iter().min_by_key(|mean| mean.abs_diff(period));
    let mut error = match nearest {
        Some(mean) => CheckError::OtherPeriod { mean: *mean, period },
        None => CheckError::NoTimerFlag { period },
    };
    for &(mean, clearing_pc, reg) in &candidates {
        let mut at = watched.clone();
        at.set_breakpoint(clearing_pc, true);
        let limit = period.saturating_mul(2);
        for _ in 0..MAX_WAITS {
            let span = match ScanSpan::next_span(&mut at, (clearing_pc, reg), limit) {
                Ok(span) => span,
                Err(cause) => {
                    error = cause;
                    break;
                }
            };
            // The instruction may clear other flags together with the one that is polled.
            for mask in (0..8).map(|bit| 1 << bit & span.cleared).filter(|&mask| mask != 0) {
                let wait = span.find_wait(RegisterBits { reg, mask });
                let found = wait.map(|(start, wait, gap)| ScanLoop { start, wait, period: mean, max_read_gap: gap });
                match found.and_then(|found| confirm(cpu.clone(), found)) {
                    Ok(found) => return Ok(found),
                    Err(cause) => error = cause,
                }
            }
        }
    }
    Err(error)
}

/// Runs until the instruction at `clearing_pc`, which has a breakpoint, clears bits of `reg`, and executes
/// it. Returns the cleared bits and the cycle in which the instruction starts.
fn run_to_clear<C: Cpu>(cpu: &mut C, (clearing_pc, reg): (u32, u16), limit: u64) -> Result<(u8, u64), CheckError> {
    let until = cpu.cycle().saturating_add(limit);
    loop {
        match cpu.run(until, &mut ()) {
            StopReason::Breakpoint { .. } => {}
            stop => return Err(CheckError::FlagStaysSet { stop }),
        }
        let (before, at) = (RegisterBits::register_value(cpu, reg), cpu.cycle());
        cpu.set_breakpoint(clearing_pc, false);
        cpu.step(&mut ());
        cpu.set_breakpoint(clearing_pc, true);
        let mask = before & !RegisterBits::register_value(cpu, reg);
        if mask != 0 {
            return Ok((mask, at));
        }
    }
}

/// The time from one clearing of the flag to the next: a scan and its wait, in any order.
struct ScanSpan<C> {
    /// The machine after the first clearing.
    from: C,
    /// Cycle in which the second clearing instruction starts.
    taken: u64,
    /// Cycle in which the second clearing instruction ends.
    to: u64,
    /// The bits that it clears.
    cleared: u8,
}

impl<C: Cpu> ScanSpan<C> {
    /// The span from the next clearing on; `cpu` continues until after the second one.
    fn next_span(cpu: &mut C, clearing_pc: (u32, u16), limit: u64) -> Result<Self, CheckError> {
        run_to_clear(cpu, clearing_pc, limit)?;
        let mut from = cpu.clone();
        from.set_breakpoint(clearing_pc.0, false);
        let (cleared, taken) = run_to_clear(cpu, clearing_pc, limit)?;
        Ok(ScanSpan { from, taken, to: cpu.cycle(), cleared })
    }

    /// Finds the wait for `flag` in the span. Returns the first instruction after it, the poll, and the
    /// maximum cycles from poll to poll.
    fn find_wait(&self, flag: RegisterBits) -> Result<(u32, u32, u64), CheckError> {
        let mut last_clear = last_clear_moment(&self.from, flag, self.taken);
        let mut probe = FlagReadProbe { chip: last_clear.chip(), flag, at: 0, pc: 0 };
        if last_clear.run(self.to, &mut probe) != StopReason::Probe {
            return Err(CheckError::NoWaitLoop);
        }
        let (seen, poll) = (probe.at, probe.pc);
        let mut trace = InstructionTrace::default();
        self.from.clone().run(self.to.saturating_add(MAX_CYCLES_AFTER_CLEAR), &mut trace);
        let first = trace.0.iter().position(|&(_, pc)| pc == poll).ok_or(CheckError::NoWaitLoop)?;
        let last = trace
            .0
            .iter()
            .position(|&at| at == (seen, poll))
            .filter(|&last| last > first)
            .ok_or(CheckError::NoWaitLoop)?;
        let (wait_instructions, after_wait) =
            (trace.0.get(first..last).unwrap_or(&[]), trace.0.get(last + 1..).unwrap_or(&[]));
        let wait_instructions: HashSet<u32> = wait_instructions.iter().map(|&(_, pc)| pc).collect();
        let start = after_wait
            .iter()
            .map(|&(_, pc)| pc)
            .find(|pc| !wait_instructions.contains(pc))
            .ok_or_else(|| CheckError::PollWithoutEffect { poll: poll * last_clear.chip().word_bytes.max(1) })?;
        let mut from = self.from.clone();
        from.set_breakpoint(poll, true);
        let mut polls = Vec::new();
        while polls.len() < MEASURED_READS && from.run(seen, &mut ()) == (StopReason::Breakpoint { pc: poll }) {
            polls.push(from.cycle());
        }
        if polls.len() < MEASURED_READS {
            polls.push(seen);
        }
        let gap = polls.windows(2).filter_map(|pair| pair.last()?.checked_sub(*pair.first()?)).max().unwrap_or(0);
        Ok((start, poll, gap))
    }
}

/// The last state between two instructions before cycle `taken` in which no bit of the flag is set.
fn last_clear_moment<C: Cpu>(from: &C, flag: RegisterBits, taken: u64) -> C {
    let (mut last_clear, mut until) = (from.clone(), taken);
    while until > last_clear.cycle() + 1 {
        let middle = last_clear.cycle() + (until - last_clear.cycle()) / 2;
        let mut cpu = last_clear.clone();
        cpu.run(middle, &mut ());
        if cpu.cycle() >= middle && cpu.cycle() < taken && !flag.is_set(&cpu) {
            last_clear = cpu
        } else {
            until = middle
        }
    }
    last_clear
}

/// Confirms the result: from reset on, scans must start as often as the flag is cleared.
fn confirm<C: Cpu>(mut cpu: C, found: ScanLoop) -> Result<ScanLoop, CheckError> {
    let until = MAX_RESET_CYCLES.saturating_add(found.period.saturating_mul(WATCHED_PERIODS));
    let mut starts = Vec::new();
    cpu.set_breakpoint(found.start, true);
    while starts.len() as u64 <= WATCHED_PERIODS {
        match cpu.run(until, &mut ()) {
            StopReason::Breakpoint { pc } if pc == found.start => {
                starts.push(cpu.cycle());
                cpu.set_breakpoint(found.wait, true);
            }
            // Only one stop at the poll per start: without the breakpoint, the emulator skips the iterations
            // of the wait.
            StopReason::Breakpoint { pc } => cpu.set_breakpoint(pc, false),
            _ => break,
        }
    }
    let (count, span) = match starts.as_slice() {
        [first, .., last] => (starts.len() as u64 - 1, last - first),
        _ => (0, 0),
    };
    let is_confirmed = count >= WATCHED_PERIODS / 2 && span.abs_diff(count * found.period) <= found.period / 2;
    is_confirmed.then_some(found).ok_or_else(|| {
        let word = cpu.chip().word_bytes.max(1);
        CheckError::ScanStartNotFound {
            poll: found.wait * word,
            period: found.period,
            start: found.start * word,
            mean: span / count.max(1),
            count,
        }
    })
}

fn run_to_cycle<C: Cpu, P: Probe>(cpu: &mut C, until: u64, probe: &mut P) -> Result<(), CheckError> {
    match cpu.run(until, probe) {
        StopReason::Limit => Ok(()),
        StopReason::Halted => Err(CheckError::HaltsBeforeScan),
        StopReason::Error(ProgramError::Illegal { pc, word }) => Err(CheckError::IllegalInstruction { word, pc }),
        StopReason::Error(ProgramError::Fault { pc, fault }) => Err(CheckError::ProgramFault { fault, pc }),
        StopReason::Breakpoint { .. } | StopReason::Probe => Err(CheckError::UnexpectedStop),
    }
}
