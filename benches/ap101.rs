//! Benchmark of AP101: emulated machine cycles per second of the host, and the cost of a snapshot.
//!
//! A program cycle of the short program has 12 instructions and a reload of 4 channels, so that the work
//! between program cycles matters; the long program measures the hot loop.

// Criterion's macro defines a public function without a doc comment.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_ap101::Ap101;
use emu_ap101::chips::AP101;
use emu_core::Cpu;
use emu_core::cpu::LAST_CYCLE;
use emu_core::image::{Image, Segment};
use emu_core::pins::{CycleTime, PinLevel};

/// Machine cycles per measurement.
const CYCLES: u64 = 1_000_000;

/// The textbook function of six variables: not (ab or cd or eg).
const AND_OR_NOT: &str = "ld I1; and I2; sto M1; ld I3; and I4; or M1; sto M1; ld I5; and I6; or M1; stoc E1; nop";

/// Number of words of the long program.
const LONG: usize = 500;

/// A configuration block with these channels and one module, a timer.
fn block(inputs: u16, outputs: u16) -> Vec<u8> {
    let mut block = vec![0; 0x300];
    block[..3].copy_from_slice(b"AP\x01");
    block[6..8].copy_from_slice(&outputs.to_le_bytes());
    block[8..10].copy_from_slice(&inputs.to_le_bytes());
    block[0x104..0x108].copy_from_slice(&[1, 2, 50, 0]);
    block
}

/// Rungs in the style of a ladder compiler, some of them with a timer.
fn long() -> Vec<String> {
    let rung = |n: usize| {
        let (a, b, c) = (n % 32, n * 7 % 200, n * 3 % 200);
        [
            format!("ld I{a}"),
            format!("andc M{b}"),
            format!("or M{c}"),
            format!("xor I{}", 31 - a),
            match n % 8 {
                0 => format!("sto E{}", n % 16),
                1 => "sto R1".to_owned(),
                2 => "stc M5".to_owned(),
                _ => format!("sto M{b}"),
            },
        ]
    };
    (0..LONG / 5).flat_map(rung).collect()
}

fn machine<'a>(lines: impl Iterator<Item = &'a str>, inputs: u16, outputs: u16) -> Ap101 {
    let words =
        lines.map(|line| emu_asm::assemble_line(&AP101, line, 0).unwrap_or_else(|error| panic!("{line}: {error}")));
    let code = words.flatten().flat_map(u16::to_le_bytes).collect();
    let segments = vec![
        Segment { space: "code", addr: 0, bytes: code },
        Segment { space: "config", addr: 0, bytes: block(inputs, outputs) },
    ];
    let mut machine = Ap101::new(&Image { segments, ..Image::default() });
    // With a pending event the machine does not halt, and every cycle is executed.
    machine.set_skip_idle_loops(false);
    machine.drive(CycleTime::at(LAST_CYCLE), 0, PinLevel::Low);
    machine
}

fn run(c: &mut Criterion) {
    let mut group = c.benchmark_group("ap101");
    group.throughput(Throughput::Elements(CYCLES));
    let long = long();
    let machines = [
        ("and-or-not", machine(AND_OR_NOT.split(';').map(str::trim), 8, 4)),
        ("500 words", machine(long.iter().map(String::as_str), 32, 16)),
    ];
    for (name, mut machine) in machines {
        group.bench_function(name, |b| b.iter(|| black_box(machine.run(machine.cycle() + CYCLES, &mut ()))));
    }
    group.finish();
}

fn clone(c: &mut Criterion) {
    let mut ap101 = Box::new(machine(AND_OR_NOT.split(';').map(str::trim), 8, 4));
    ap101.run(10_000, &mut ());
    // The copy overwrites another machine on the heap, like a ring of snapshots.
    let mut slot = ap101.clone();
    c.bench_function("ap101/clone", |b| b.iter(|| *black_box(&mut slot) = black_box(&ap101).clone()));
}

criterion_group!(benches, run, clone);
criterion_main!(benches);
