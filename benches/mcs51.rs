//! Benchmark of the 8051: emulated machine cycles per second of the host, and the cost of a snapshot.

// Criterion's macro defines a public function without a doc comment.
#![allow(missing_docs)]

#[path = "programs51/assemble.rs"]
mod assemble;
#[path = "programs51/programs.rs"]
mod programs;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_8051::{Mcs51, chips};
use emu_core::{Cpu, RamInit};

/// Machine cycles per measurement.
const CYCLES: u64 = 1_000_000;

fn machine(source: &str) -> Mcs51 {
    let image = assemble::image(source).unwrap_or_else(|e| panic!("{e}"));
    Mcs51::new(chips::chip("at89c52").expect("a CMOS 8052"), &image, RamInit::Random(1))
}

fn run(c: &mut Criterion) {
    let mut group = c.benchmark_group("mcs51");
    group.throughput(Throughput::Elements(CYCLES));
    for (name, source) in programs::programs() {
        let mut mcs51 = machine(&source);
        group.bench_function(name, |b| b.iter(|| black_box(mcs51.run(mcs51.cycle() + CYCLES, &mut ()))));
    }
    group.finish();
}

fn clone(c: &mut Criterion) {
    let mut mcs51 = Box::new(machine(&programs::programs()[0].1));
    mcs51.run(10_000, &mut ());
    // The copy overwrites another machine on the heap, like a ring of snapshots.
    let mut slot = mcs51.clone();
    c.bench_function("mcs51/clone", |b| b.iter(|| *black_box(&mut slot) = black_box(&mcs51).clone()));
}

criterion_group!(benches, run, clone);
criterion_main!(benches);
