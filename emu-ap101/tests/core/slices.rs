//! Any way of running a random program gives the same machine.

use emu_ap101::{Ap101, isa};
use emu_core::Cpu;
use emu_core::cpu::ResetCause;
use emu_core::pins::PinLevel;
use emu_core::rng::Rng;
use emu_test_support::slices::{RandomInput, SlicePlan, SliceSubject, pick_random};

use crate::rig::{Block, image};

const SEED: u64 = 0x5EED_0101;
/// A build without optimisation runs fewer programs, because each is run in eleven ways.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 30 } else { 600 };
/// Number of inputs to a program, and the cycles within which they come; between two inputs the machine can
/// settle or not.
const LIVES: [(usize, u64); 2] = [(40, 2000), (5, 20_000)];

/// A random instruction, mostly on one of a few bits.
fn word(rng: &mut Rng, first: u16, len: u16) -> u16 {
    let word = rng.next_u64() as u16;
    let offset = pick_random(rng, &[0u16, 1, 2, 3, 4, 7, 127, 128, 129, 130, 248, 255, 256, 257, 258, 511]);
    match word >> 12 {
        _ if rng.one_in(20) => word,
        0xD | 0xE if !rng.one_in(12) => word & 0xF000 | (first + rng.below(len.into()) as u16),
        0xB..=0xF => word | 0x0FFF,
        _ => word & 0xF600 | if rng.one_in(3) { 0x800 } else { 0 } | offset,
    }
}

pub fn plan(seed: u64) -> SlicePlan<Ap101> {
    let rng = &mut Rng::new(seed);
    let mut block = Block {
        live: rng.one_in(3),
        reconfigurable: rng.one_in(3),
        outputs: pick_random(rng, &[0, 1, 4, 4, 256]),
        inputs: pick_random(rng, &[0, 4, 512]),
        hz: pick_random(rng, &[0, 1000, 32_768]),
        period: pick_random(rng, &[0, 0, 5, 40, 300]),
        ..Block::EMPTY
    };
    for module in block.modules.iter_mut().take(5) {
        *module = (rng.below(8) as u8, rng.below(4) as u8, rng.below(6) as u16);
    }
    let mut words = Vec::new();
    for entry in 0..rng.below(4) as usize {
        let (first, len) = (words.len() as u16, 1 + rng.below(12) as u16);
        words.extend((0..len).map(|_| word(rng, first, len)));
        block.programs[entry] = [first, first + len - 1, rng.below(4) as u16, 1 + 2 * rng.below(2) as u16];
    }
    if words.is_empty() {
        let len = rng.below(20) as u16;
        words.extend((0..len).map(|_| word(rng, 0, len)));
    }
    let (touched, span) = pick_random(rng, &LIVES);
    let mut acts: Vec<(u64, RandomInput)> =
        (0..touched).map(|_| (rng.below(span), act(rng, words.len() as u64 + 1))).collect();
    acts.push((span, RandomInput::Nothing));
    acts.sort_by_key(|act| act.0);
    let listing: String = words.iter().map(|&word| format!("{}\n", isa::disassemble(&[word], 0).text)).collect();
    let what = format!("seed {seed}\n{block:?}\n{listing}{acts:?}");
    let block = (!rng.one_in(5)).then_some(&block);
    let places = (0..words.len() as u32).collect();
    SlicePlan {
        description: what,
        start: Ap101::new(&image(&words, block)),
        inputs: acts,
        breakpoint_candidates: places,
    }
}

fn act(rng: &mut Rng, words: u64) -> RandomInput {
    let bit = rng.below(2) as u8;
    match rng.below(12) {
        0 => RandomInput::Poke("m", pick_random(rng, &[1, 2, 3, 248, 249, 250, 256, 257]), bit),
        1 => RandomInput::Poke("e", rng.below(5) as u32, bit),
        2 => RandomInput::Poke("code", rng.below(2 * words) as u32, rng.next_u64() as u8),
        3 => RandomInput::Poke(pick_random(rng, &["i", "preset"]), rng.below(8) as u32, bit),
        4 => RandomInput::Pc(rng.below(words) as u32),
        5 => RandomInput::Trap(rng.below(words) as u32, bit == 1),
        6 => RandomInput::Reset(pick_random(rng, &[ResetCause::PowerOn, ResetCause::External])),
        7 => RandomInput::Drive(768, if rng.one_in(3) { PinLevel::Low } else { PinLevel::High }),
        8 => RandomInput::Drive(769, PinLevel::from_bit(bit == 1)),
        9 => RandomInput::Drive(512 + rng.below(4) as u16, PinLevel::from_bit(bit == 1)),
        _ => RandomInput::Drive(
            rng.below(5) as u16,
            pick_random(rng, &[PinLevel::Low, PinLevel::High, PinLevel::Float, PinLevel::PullUp]),
        ),
    }
}

/// All memories except code, and the registers.
fn seen(cpu: &Ap101) -> Vec<Option<u8>> {
    let memories = [("i", 512), ("e", 256), ("m", 512), ("r", 384), ("preset", 256), ("value", 256)];
    let bits = memories.iter().flat_map(|&(space, size)| (0..size).map(move |addr| cpu.peek(space, addr)));
    let registers = ["A", "NA", "RIC", "RX", "PROG", "OVR"]
        .iter()
        .flat_map(|name| cpu.reg(name).unwrap_or_default().to_le_bytes().map(Some));
    bits.chain(registers).collect()
}

#[test]
fn random_programs() {
    let subject = SliceSubject {
        visible_state: seen,
        memories: |cpu| (0..4096).map(|addr| cpu.peek("code", addr)).collect(),
        code_words: 24,
        set_skip_idle_loops: Ap101::set_skip_idle_loops,
        asleep: Ap101::is_waiting,
        corrupt_state: |cpu| {
            cpu.poke("code", 2 * cpu.pc(), 0);
            cpu.poke("m", 1, 1);
        },
    };
    let mut rng = Rng::new(SEED);
    let far: u64 = (0..PROGRAMS).map(|_| subject.assert_slicing_invariant(&plan(rng.next_u64()), &mut rng)).sum();
    // If all programs stopped early, the comparison would be worthless.
    assert!(far > PROGRAMS * LIVES[0].1 / 8, "only {far} cycles in all");
}
