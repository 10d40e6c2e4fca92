//! Any way of running a random program gives the same machine.

use emu_8051::Mcs51;
use emu_core::Cpu;
use emu_core::rng::Rng;
use emu_test_support::slices::SliceSubject;

use super::states::plan;

const SEED: u64 = 0x5EED_5100;
const PROGRAMS: u64 = 300;
const SPAN: u64 = 50_000;

/// RAM, then registers from 100h on.
fn seen(cpu: &Mcs51) -> Vec<Option<u8>> {
    let registers = (0x80..0x100).map(|addr| cpu.peek("sfr", addr));
    (0..0x100).map(|addr| cpu.peek("idata", addr)).chain(registers).collect()
}

/// External memory, then code.
fn memories(cpu: &Mcs51) -> Vec<Option<u8>> {
    let of = |space: &'static str| (0..0x1_0000).map(move |addr| cpu.peek(space, addr));
    of("xdata").chain(of("code")).collect()
}

#[test]
fn random_programs() {
    let subject = SliceSubject {
        visible_state: seen,
        memories,
        code_words: 0x1_0000,
        set_skip_idle_loops: Mcs51::set_skip_idle_loops,
        asleep: |cpu| cpu.is_asleep(),
        corrupt_state: |cpu| {
            cpu.poke("code", cpu.pc(), 0);
            cpu.poke("xdata", 0x40, 0xFF);
        },
    };
    let mut rng = Rng::new(SEED);
    let far: u64 = (0..PROGRAMS).map(|_| subject.assert_slicing_invariant(&plan(rng.next_u64(), SPAN), &mut rng)).sum();
    // If all programs stopped early, the comparison would be worthless.
    assert!(far > PROGRAMS * SPAN / 2, "only {far} cycles in all");
}
