//! Benchmark of checks of random programs: each program is compiled for one chip and compared for 100 scans.

// Criterion's macro defines a public function without a doc comment.
#![allow(missing_docs)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use emu_check::fuzz::{CampaignPlan, FAMILIES, generate_program, run_trial};

/// Number of programs per measurement.
const PROGRAMS: u64 = 40;

/// Time limit per program, far above the normal time.
const LIMIT: Duration = Duration::from_secs(60);

fn fuzz(c: &mut Criterion) {
    let mut group = c.benchmark_group("fuzz");
    group.sample_size(10);
    for mcu in FAMILIES {
        let target = ladder_compile::find_target(mcu);
        // Programs that the chip supports, so that each one is checked.
        let fits = |number: &u64| target.is_some_and(|target| generate_program(1, *number).1.is_supported_by(target));
        let numbers: Vec<u64> = (0..).filter(fits).take(PROGRAMS as usize).collect();
        let plan = CampaignPlan { seed: 1, programs: u64::MAX, scans: 100, mcus: vec![mcu.to_owned()] };
        group.throughput(Throughput::Elements(PROGRAMS));
        group.bench_function(mcu, |b| {
            b.iter(|| numbers.iter().for_each(|&number| _ = black_box(run_trial(&plan, number, LIMIT))));
        });
    }
    group.finish();
}

criterion_group!(benches, fuzz);
criterion_main!(benches);
