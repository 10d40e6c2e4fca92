//! Any way of running a random program gives the same machine.

use emu_core::Cpu;
use emu_core::rng::Rng;
use emu_pic16::{Pic16, Pic16Stack};
use emu_test_support::slices::SliceSubject;

use super::states::plan;

const SEED: u64 = 0x5EED_1650;
/// Number of programs. A build without optimization runs only the first ones, because each program runs in
/// eleven ways.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 40 } else { 300 };
const SPAN: u64 = 50_000;

/// Returns data memory, the stack from 200h on, its pointer, and W.
fn seen(cpu: &Pic16) -> Vec<Option<u8>> {
    let Pic16Stack { entries: stack, next: sp } = cpu.stack();
    let stack = stack.iter().flat_map(|place| place.to_le_bytes());
    let core = stack.chain([sp as u8, cpu.reg("W").map_or(0, |w| w as u8)]);
    (0..0x200).map(|addr| cpu.peek("data", addr)).chain(core.map(Some)).collect()
}

/// Returns program memory, then EEPROM.
fn memories(cpu: &Pic16) -> Vec<Option<u8>> {
    let of = |space: &'static str| (0..0x4000).map(move |addr| cpu.peek(space, addr));
    of("flash").chain(of("eeprom")).collect()
}

#[test]
fn random_programs() {
    let subject = SliceSubject {
        visible_state: seen,
        memories,
        code_words: 0x400,
        set_skip_idle_loops: Pic16::set_skip_idle_loops,
        asleep: |cpu| cpu.is_asleep(),
        corrupt_state: |cpu| {
            cpu.poke("flash", 2 * cpu.pc(), 0);
            cpu.poke("data", 0x40, 0xFF);
        },
    };
    let mut rng = Rng::new(SEED);
    let far: u64 = (0..PROGRAMS).map(|_| subject.assert_slicing_invariant(&plan(rng.next_u64(), SPAN), &mut rng)).sum();
    // If all runs stopped at once, nothing would be compared.
    assert!(far > PROGRAMS * SPAN / 2, "only {far} cycles in all");
}
