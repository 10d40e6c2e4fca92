//! Benchmark of the PIC16: emulated instruction cycles per second of the host, and the cost of a snapshot.
//!
//! The programs are those of `benches/speedpic.sh`, which compares them with gpsim: HEX files that gpasm made
//! from the sources next to them.

// Criterion's macro defines a public function without a doc comment.
#![allow(missing_docs)]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_core::image::load_hex;
use emu_core::{Cpu, RamInit};
use emu_pic16::{Options, Pic16, chips};

/// Instruction cycles per measurement.
const CYCLES: u64 = 1_000_000;

/// The oscillator frequency in Hz; an instruction cycle takes four clocks.
const HZ: u64 = 20_000_000;

/// Name and HEX file of each program.
const PROGRAMS: &[(&str, &[u8])] = &[
    ("alu", include_bytes!("programs_pic/alu.hex")),
    ("crc", include_bytes!("programs_pic/crc.hex")),
    ("tmr0int", include_bytes!("programs_pic/tmr0int.hex")),
    ("ladder", include_bytes!("programs_pic/ladder.hex")),
    ("wdtsleep", include_bytes!("programs_pic/wdtsleep.hex")),
    ("t1sleep", include_bytes!("programs_pic/t1sleep.hex")),
];

fn machine(name: &str, hex: &[u8]) -> Pic16 {
    let chip = chips::chip("pic16f873").expect("a PIC16F873");
    let loaded = load_hex(name, hex, chip.hex_spaces).unwrap_or_else(|e| panic!("{name}: {e:?}"));
    Pic16::with(chip, &loaded.image, RamInit::Random(1), Options { hz: HZ, ..Options::default() })
}

fn run(c: &mut Criterion) {
    let mut group = c.benchmark_group("pic16");
    group.throughput(Throughput::Elements(CYCLES));
    for (name, hex) in PROGRAMS {
        let mut pic = machine(name, hex);
        group.bench_function(*name, |b| b.iter(|| black_box(pic.run(pic.cycle() + CYCLES, &mut ()))));
    }
    group.finish();
}

fn clone(c: &mut Criterion) {
    let (name, hex) = PROGRAMS[0];
    let mut pic = Box::new(machine(name, hex));
    pic.run(10_000, &mut ());
    // The copy overwrites another machine on the heap, like a ring of snapshots.
    let mut slot = pic.clone();
    c.bench_function("pic16/clone", |b| b.iter(|| *black_box(&mut slot) = black_box(&pic).clone()));
}

criterion_group!(benches, run, clone);
criterion_main!(benches);
