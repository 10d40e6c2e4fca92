//! Benchmark of AVR: emulated machine cycles per second of the host, and the cost of a snapshot.

// Criterion's macro defines a public function without a doc comment.
#![allow(missing_docs)]

#[path = "programs/assemble.rs"]
mod programs;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::{Cpu, RamInit, image};

/// Machine cycles per measurement.
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
        avr.set_skip_idle_loops(false);
        group.bench_function(*name, |b| b.iter(|| black_box(avr.run(avr.cycle() + CYCLES, &mut ()))));
        if *name == "poll" {
            avr.set_skip_idle_loops(true);
            group
                .bench_function("poll, jumping over", |b| b.iter(|| black_box(avr.run(avr.cycle() + CYCLES, &mut ()))));
        }
    }
    group.finish();
}

/// A ladder scan that nearly fills its period, so that the machine waits little.
fn scan(c: &mut Criterion) {
    let program = ladder::parse("scan.ld", include_str!("programs/scan.ld")).expect("a sound program").program;
    let options = ladder_compile::CompileOptions { mcu: ATMEGA328P.name.to_owned(), ..Default::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("a program that fits");
    let loaded = image::load_hex("scan", compiled.hex.as_bytes(), ATMEGA328P.hex_spaces).expect("a sound image");
    let mut avr = Avr::new(&ATMEGA328P, &loaded.image, RamInit::Random(1));
    avr.set_skip_idle_loops(false);
    let mut group = c.benchmark_group("avr");
    group.throughput(Throughput::Elements(CYCLES));
    group.bench_function("scan", |b| b.iter(|| black_box(avr.run(avr.cycle() + CYCLES, &mut ()))));
    group.finish();
}

fn clone(c: &mut Criterion) {
    let mut avr = Box::new(machine(programs::PROGRAMS[1].1));
    avr.run(10_000, &mut ());
    // The copy overwrites another machine on the heap, like a ring of snapshots. On the stack of the
    // benchmark, the time of the copy varies between 0.1 and 3 microseconds with its address.
    let mut slot = avr.clone();
    c.bench_function("avr/clone", |b| b.iter(|| *black_box(&mut slot) = black_box(&avr).clone()));
}

criterion_group!(benches, run, scan, clone);
criterion_main!(benches);
