//! Emulated machine cycles per host second, and the price of a snapshot.

// Criterion's macro makes a public function without a doc comment.
#![allow(missing_docs)]

#[path = "programs/assemble.rs"]
mod programs;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::{Cpu, RamInit};

/// Cycles of one measurement.
const CYCLES: u64 = 1_000_000;

fn machine(source: &str) -> Avr {
    let image = programs::image(source).unwrap_or_else(|e| panic!("{e}"));
    Avr::new(&ATMEGA328P, &image, RamInit::Random(1))
}

fn run(c: &mut Criterion) {
    let mut group = c.benchmark_group("avr");
    group.throughput(Throughput::Elements(CYCLES));
    for (name, source) in programs::PROGRAMS {
        let mut avr = machine(source);
        avr.set_skip(false);
        group.bench_function(*name, |b| b.iter(|| black_box(avr.run(avr.cycle() + CYCLES, &mut ()))));
        if *name == "poll" {
            avr.set_skip(true);
            group
                .bench_function("poll, jumping over", |b| b.iter(|| black_box(avr.run(avr.cycle() + CYCLES, &mut ()))));
        }
    }
    group.finish();
}

fn clone(c: &mut Criterion) {
    let mut avr = machine(programs::PROGRAMS[1].1);
    avr.run(10_000, &mut ());
    c.bench_function("avr/clone", |b| b.iter(|| black_box(avr.clone())));
}

criterion_group!(benches, run, clone);
criterion_main!(benches);
