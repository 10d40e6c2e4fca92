//! One instruction at a time beside simavr: registers, SREG, SP, PC, data memory and cycles from the same random states.
//!
//! Addresses stay at registers, SP, SREG, GPIOR and RAM (see `states.rs`): what lies behind other addresses differs by
//! design and is compared elsewhere.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::{Command, Stdio};

use emu_avr::Avr;
use emu_avr::isa::{KINDS, Kind, ROWS, disassemble};
use emu_core::rng::Rng;
use emu_core::{Cpu, Stop};

use crate::states::{Draw, batch, machine, put};
use crate::{harness, seed};

const STATES: usize = 1_200;
const CHANGES: usize = 16;
const OUTCOME: usize = 12 + 32 + 4 + 4 * CHANGES;

/// What an instruction did. Data memory: only what changed, SP and SREG apart.
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
#[rustfmt::skip]
const ROWS_LEFT_OUT: &[(Kind, &str)] = &[
    (Kind::Spm,   "stops the run here, programs a page there"),
    (Kind::Sleep, "sleeps there whatever SE of SMCR says (data sheet 10.11.1: only if SE is one); line `sleep` in avr.txt"),
    (Kind::Wdr,   "acts on the watchdog, not on the core"),
    (Kind::Break, "opens the debugger there"),
    (Kind::Elpm,  NOT_THERE),
    (Kind::ElpmZ, NOT_THERE),
    (Kind::ElpmZi, NOT_THERE),
];

/// States that are not compared, with the reason. Each has a line in avr.txt.
fn left_out(kind: Kind, d: &Draw) -> Option<&'static str> {
    let (low, before) = match kind {
        Kind::LpmZi if (d.words[0] >> 4) & 0x1F >= 30 => return Some(LPM),
        Kind::StX | Kind::StXi => (26, 0),
        Kind::StXd => (26, 1),
        Kind::StYi => (28, 0),
        Kind::StYd => (28, 1),
        Kind::StZi => (30, 0),
        Kind::StZd => (30, 1),
        _ => return None,
    };
    let addr = u16::from_le_bytes([d.regs[low], d.regs[low + 1]]) - before;
    (usize::from(addr) / 2 == low / 2).then_some(STORE)
}

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
        pc: whole(4),
        cycles: whole(8),
        regs: bytes[12..44].to_vec(),
        changed: cells.collect(),
    }
}

fn data(avr: &Avr) -> Vec<u8> {
    (0..0x900).map(|a| avr.peek("data", a).unwrap_or(0)).collect()
}

fn ours(base: &Avr, d: &Draw) -> Outcome {
    let mut avr = put(base, d);
    let (before, cycle) = (data(&avr), avr.cycle());
    let stop = avr.step(&mut ());
    let after = data(&avr);
    let differs = |&a: &usize| before[a] != after[a] && !(0x5D..=0x5F).contains(&a);
    Outcome {
        // A jump to itself may also be the end of the program.
        runs_on: stop == Stop::Limit || stop == Stop::Halted && avr.pc() == d.pc.into(),
        sreg: after[0x5F],
        sp: u16::from_le_bytes([after[0x5D], after[0x5E]]),
        pc: avr.pc() * 2,
        cycles: (avr.cycle() - cycle) as u32,
        regs: after[..32].to_vec(),
        changed: (32..0x900).filter(differs).map(|a| (a as u16, after[a])).collect(),
    }
}

#[test]
#[ignore = "needs simavr: .ci/peers installs it"]
fn every_row_in_lock_step_with_simavr() {
    let seed = seed();
    println!("seed {seed:#x} (EMU_SEED), {STATES} states a row");
    let mut rng = Rng::new(seed);
    let mut bad = Vec::new();
    let (mut compared, mut excluded) = (0, BTreeMap::<&str, usize>::new());
    for (row, &kind) in ROWS.iter().zip(KINDS) {
        let (flash, draws) = batch(row, kind, STATES, &mut rng);
        if let Some((_, why)) = ROWS_LEFT_OUT.iter().find(|(k, _)| *k == kind) {
            println!("{:8} compared     0  excluded all: {why}", row.name);
            continue;
        }
        let base = machine(kind, flash.clone());
        let (mut same, mut out, mut differ) = (0, 0, 0);
        for (d, theirs) in draws.iter().zip(theirs(&flash, &draws)) {
            if let Some(why) = left_out(kind, d) {
                out += 1;
                *excluded.entry(why).or_default() += 1;
                continue;
            }
            let ours = ours(&base, d);
            same += 1;
            if ours != theirs {
                differ += 1;
                if differ <= 3 {
                    let text = disassemble(&d.words, d.pc.into()).text;
                    bad.push(format!(
                        "{}: {text}\n  from   {d:02x?}\n  ours   {ours:02x?}\n  simavr {theirs:02x?}",
                        row.name
                    ));
                }
            }
        }
        println!("{:8} compared {same:5}  excluded {out:3}  differ {differ}", row.name);
        assert!(same >= 1000, "{}: only {same} states compared", row.name);
        compared += same;
    }
    println!("compared {compared} in all; excluded:");
    for (why, n) in &excluded {
        println!("{n:6}  {why}");
    }
    assert!(bad.is_empty(), "seed {seed:#x}\n{}", bad.join("\n"));
}
