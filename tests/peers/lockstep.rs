//! Single instructions compared with simavr: registers, SREG, SP, PC, data memory and cycles, from the same
//! random states.
//!
//! The addresses are limited to registers, SP, SREG, RAM and peripheral registers that only store what is
//! written (see `states.rs`). Other addresses differ by design and are compared elsewhere.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::{Command, Stdio};

use emu_avr::Avr;
use emu_avr::isa::{AvrOpKind, KINDS, ROWS, disassemble};
use emu_core::rng::Rng;
use emu_core::table::InstructionRow;
use emu_core::{Cpu, StopReason};
use emu_test_support::random_seed;

use crate::harness;
use crate::states::{Draw, at_the_ends, batch, machine, put};

/// Minimum number of complete states compared per row.
const WANTED: usize = 10_000;
/// States that share one flash image: all states, and those of one instruction at an end of flash.
const BATCH: usize = 2_400;
const AT_AN_END: usize = 100;
/// Number of instructions per row at the ends of flash.
const ENDS: usize = 8;
const CHANGES: usize = 16;
const OUTCOME: usize = 12 + 32 + 4 + 4 * CHANGES;

/// The effects of an instruction. For data memory only the changes, without SP and SREG.
#[derive(Debug, PartialEq, Eq)]
struct Outcome {
    runs_on: bool,
    sreg: u8,
    sp: u16,
    /// Byte address.
    pc: u32,
    cycles: u32,
    regs: Vec<u8>,
    changed: BTreeMap<u16, u8>,
}

/// Rows that are not compared at all, with the reason.
const ROWS_LEFT_OUT: &[(AvrOpKind, &str)] =
    &[(AvrOpKind::Elpm, NOT_THERE), (AvrOpKind::ElpmZ, NOT_THERE), (AvrOpKind::ElpmZi, NOT_THERE)];

/// Returns why a state is not compared. Each reason has a line in avr.txt.
fn left_out(kind: AvrOpKind, d: &Draw) -> Option<&'static str> {
    let next = d.pc + words(kind);
    if next > 0x4000 || next == 0x4000 && (pushes(kind) || skips(kind)) {
        return Some(WRAP);
    }
    let (low, before) = match kind {
        AvrOpKind::LpmZi if (d.words[0] >> 4) & 0x1F >= 30 => return Some(LPM),
        AvrOpKind::StX | AvrOpKind::StXi => (26, 0),
        AvrOpKind::StXd => (26, 1),
        AvrOpKind::StYi => (28, 0),
        AvrOpKind::StYd => (28, 1),
        AvrOpKind::StZi => (30, 0),
        AvrOpKind::StZd => (30, 1),
        _ => return None,
    };
    let addr = u16::from_le_bytes([d.regs[low], d.regs[low + 1]]) - before;
    (usize::from(addr) / 2 == low / 2).then_some(STORE)
}

const WRAP: &str =
    "across the end of flash: 14 bits of program counter (8.2); there what lies behind flash is fetched and pushed";

/// Returns the length of the instruction in words.
fn words(kind: AvrOpKind) -> u16 {
    ROWS.iter().zip(KINDS).find(|(_, k)| **k == kind).map_or(1, |(row, _)| row.len() as u16)
}

/// Returns true if the instruction pushes the address of the next one.
fn pushes(kind: AvrOpKind) -> bool {
    matches!(kind, AvrOpKind::Rcall | AvrOpKind::Icall | AvrOpKind::Call)
}

/// Returns true if the instruction examines the next one.
fn skips(kind: AvrOpKind) -> bool {
    matches!(kind, AvrOpKind::Cpse | AvrOpKind::Sbrc | AvrOpKind::Sbrs | AvrOpKind::Sbic | AvrOpKind::Sbis)
}

const SMCR: u16 = 0x53;

const NOT_THERE: &str = "no instruction of the ATmega328P";
const LPM: &str = "lpm r30,Z+ and lpm r31,Z+: undefined (manual, LPM); there the pointer wins over the byte loaded";
const STORE: &str = "ST onto the very pointer it goes through (manual, ST: the byte is stored): there the pointer is written back over it";

fn given(d: &Draw) -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(d.pc.to_le_bytes());
    bytes.extend(d.sp.to_le_bytes());
    bytes.extend([d.sreg, 0, 0, 0]);
    bytes.extend(d.regs);
    for (addr, value) in d.cells {
        bytes.extend(addr.to_le_bytes());
        bytes.extend([value, 0]);
    }
    bytes
}

fn theirs(flash: &[u8], draws: &[Draw]) -> Vec<Outcome> {
    let mut child = Command::new(harness("simavr_step"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("simavr_step: {e}"));
    let mut input = child.stdin.take().expect("a pipe");
    let bytes: Vec<u8> = flash.iter().copied().chain(draws.iter().flat_map(given)).collect();
    let writer = std::thread::spawn(move || input.write_all(&bytes));
    let output = child.wait_with_output().expect("simavr_step ends");
    writer.join().expect("the writer").expect("simavr_step reads its input");
    assert!(output.status.success(), "simavr_step: {}", output.status);
    assert_eq!(output.stdout.len(), draws.len() * OUTCOME, "one outcome a case");
    output.stdout.chunks(OUTCOME).map(parse).collect()
}

fn parse(bytes: &[u8]) -> Outcome {
    let half = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let whole = |at: usize| u32::from(half(at)) | u32::from(half(at + 2)) << 16;
    let cells = (0..usize::from(bytes[44])).map(|i| (half(48 + 4 * i), bytes[50 + 4 * i]));
    Outcome {
        runs_on: bytes[0] == 0,
        sreg: bytes[1],
        sp: half(2),
        // In simavr the program counter exceeds flash and wraps with the next instruction; it has 14 bits
        // (8.2).
        pc: whole(4) % 0x8000,
        cycles: whole(8),
        regs: bytes[12..44].to_vec(),
        changed: cells.collect(),
    }
}

/// SP and SREG are compared separately.
const CORE: std::ops::RangeInclusive<usize> = 0x5D..=0x5F;

fn data(avr: &Avr) -> Vec<u8> {
    (0..0x900).map(|a| avr.peek("data", a).unwrap_or(0)).collect()
}

/// Runs one instruction on our machine; `before` is the data memory of `base`.
fn ours(kind: AvrOpKind, base: &Avr, before: &[u8], d: &Draw) -> Outcome {
    let mut avr = put(base, d);
    let mut before = before.to_vec();
    before[..32].copy_from_slice(&d.regs);
    d.cells.iter().filter(|cell| cell.0 < 0x900).for_each(|&(addr, value)| before[usize::from(addr)] = value);
    let cycle = avr.cycle();
    let stop = avr.step(&mut ());
    let after = data(&avr);
    // The machine is asleep if another step executes no instruction.
    let asleep = kind == AvrOpKind::Sleep && {
        let done = avr.instructions();
        let mut next = avr.clone();
        next.step(&mut ());
        next.instructions() == done
    };
    let differs = |&a: &usize| before[a] != after[a] && !CORE.contains(&a);
    Outcome {
        // A jump to itself may also be the end of the program.
        runs_on: !asleep && (stop == StopReason::Limit || stop == StopReason::Halted && avr.pc() == u32::from(d.pc)),
        sreg: after[0x5F],
        sp: u16::from_le_bytes([after[0x5D], after[0x5E]]),
        pc: avr.pc() * 2,
        cycles: (avr.cycle() - cycle) as u32,
        regs: after[..32].to_vec(),
        changed: (32..0x900).filter(differs).map(|a| (a as u16, after[a])).collect(),
    }
}

/// Sets SE with a random mode for SLEEP, where both machines sleep. simavr sleeps regardless of SE (10.11.1:
/// only if SE is one; line `sleep` in avr.txt).
fn with_modes(kind: AvrOpKind, mut drawn: (Vec<u8>, Vec<Draw>), rng: &mut Rng) -> (Vec<u8>, Vec<Draw>) {
    if kind == AvrOpKind::Sleep {
        drawn.1.iter_mut().for_each(|d| d.cells[0] = (SMCR, rng.below(8) as u8 * 2 + 1));
    }
    drawn
}

/// The results of the comparison.
#[derive(Default)]
struct Tally {
    same: usize,
    excluded: BTreeMap<&'static str, usize>,
    differ: usize,
    bad: Vec<String>,
}

impl Tally {
    fn out(&self) -> usize {
        self.excluded.values().sum()
    }
}

/// Compares states that share a flash image.
fn compare(kind: AvrOpKind, (flash, draws): (Vec<u8>, Vec<Draw>), tally: &mut Tally) {
    let base = machine(kind, flash.clone());
    let before = data(&base);
    for (d, theirs) in draws.iter().zip(theirs(&flash, &draws)) {
        if let Some(why) = left_out(kind, d) {
            *tally.excluded.entry(why).or_default() += 1;
            continue;
        }
        let ours = ours(kind, &base, &before, d);
        tally.same += 1;
        if ours != theirs {
            tally.differ += 1;
            if tally.differ <= 3 {
                let text = disassemble(&d.words, d.pc.into()).text;
                tally.bad.push(format!("{text}\n  from   {d:02x?}\n  ours   {ours:02x?}\n  simavr {theirs:02x?}"));
            }
        }
    }
}

/// Compares one row.
fn check(row: &InstructionRow, kind: AvrOpKind, rng: &mut Rng) -> Tally {
    let mut tally = Tally::default();
    for _ in 0..ENDS {
        let drawn = at_the_ends(row, kind, AT_AN_END, rng);
        compare(kind, with_modes(kind, drawn, rng), &mut tally);
    }
    while tally.same < WANTED && tally.out() < WANTED {
        let drawn = batch(row, kind, BATCH, rng);
        compare(kind, with_modes(kind, drawn, rng), &mut tally);
    }
    tally
}

#[test]
#[ignore = "needs simavr: .ci/peers installs it"]
fn every_row_in_lock_step_with_simavr() {
    let seed = random_seed();
    println!("seed {seed:#x} (EMU_SEED), {WANTED} states a row or more");
    let rows: Vec<(usize, &InstructionRow, AvrOpKind)> =
        ROWS.iter().zip(KINDS).enumerate().map(|(n, (row, &k))| (n, row, k)).collect();
    let there = |kind: AvrOpKind| ROWS_LEFT_OUT.iter().all(|(left, _)| *left != kind);
    // Each row has its own random numbers, so that two rows can be compared in parallel.
    let work = |part: usize| -> Vec<(usize, Tally)> {
        let mine = rows.iter().filter(|(n, _, kind)| n % 2 == part && there(*kind));
        mine.map(|&(n, row, kind)| (n, check(row, kind, &mut Rng::new(seed << 8 | n as u64)))).collect()
    };
    let mut found: BTreeMap<usize, Tally> = std::thread::scope(|scope| {
        let other = scope.spawn(|| work(1));
        let mut found = work(0);
        found.extend(other.join().expect("the other half"));
        found.into_iter().collect()
    });

    let (mut compared, mut excluded, mut bad) = (0, BTreeMap::<&str, usize>::new(), Vec::new());
    for (n, row, kind) in &rows {
        let Some(mut tally) = found.remove(n) else {
            let why = ROWS_LEFT_OUT.iter().find(|(left, _)| left == kind).map_or("", |row| row.1);
            println!("{:8} compared     0  excluded all: {why}", row.name);
            continue;
        };
        println!("{:8} compared {:5}  excluded {:4}  differ {}", row.name, tally.same, tally.out(), tally.differ);
        assert!(tally.same >= WANTED, "{}: only {} states compared", row.name, tally.same);
        compared += tally.same;
        bad.append(&mut tally.bad);
        tally.excluded.into_iter().for_each(|(why, n)| *excluded.entry(why).or_default() += n);
    }
    println!("compared {compared} in all, excluded {}:", excluded.values().sum::<usize>());
    for (why, n) in &excluded {
        println!("{n:6}  {why}");
    }
    assert!(bad.is_empty(), "seed {seed:#x}\n{}", bad.join("\n"));
}
