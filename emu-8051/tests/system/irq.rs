//! Random programs, pins and timers: every call of a service routine is compared with the model, by cycle and
//! source.

use emu_8051::Mcs51;
use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, StopReason};

use crate::model::{self, Do, PINS, Setup};
use crate::source;

const SEEDS: u64 = 2000;
const CYCLES: u64 = 1500;

#[derive(Default)]
struct Calls(Vec<(u64, u8)>);

impl Probe for Calls {
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.0.push((at, vector));
    }
}

fn op(rng: &mut Rng, main: bool) -> Do {
    let on = rng.one_in(2);
    match rng.below(if main { 16 } else { 12 }) {
        0 | 1 => Do::IncDptr,
        2 | 3 => Do::Mul,
        4 => Do::EnableBit([0, 1, 2, 3, 4, 5, 7][rng.below(7) as usize], !rng.one_in(3)),
        5 => Do::PriorityBit(rng.below(6) as u8, on),
        6 => [Do::Enable(0x80 | rng.below(64) as u8), Do::Priority(rng.below(64) as u8)][usize::from(on)],
        // Flags that nothing else clears are cleared more often than set.
        7 | 8 => Do::Flag(rng.below(8) as usize, rng.one_in(3)),
        9 if main && rng.one_in(3) => Do::Idle,
        _ => Do::Nop,
    }
}

fn setup(rng: &mut Rng) -> Setup {
    let mut routines = Vec::new();
    for source in 0..7 {
        let mut routine = Vec::new();
        for _ in 0..if source == 0 { 40 } else { rng.below(6) } {
            routine.push(op(rng, source == 0));
        }
        if source == 0 {
            // Each iteration of the main program enables interrupts again.
            routine.extend([Do::Enable(0x80 | rng.next_u64() as u8 & 0x3F), Do::Again]);
        } else {
            // The LJMP from the vector. The program must clear the flags of these two sources, and mostly
            // does.
            routine.insert(0, Do::IncDptr);
            let flags: &[usize] =
                [&[4, 5][..], &[6, 7]].get(source.max(5) - 5).filter(|_| source > 4).copied().unwrap_or(&[]);
            for &flag in flags.iter().filter(|_| !rng.one_in(8)) {
                routine.push(Do::Flag(flag, false));
            }
            routine.push(Do::Reti);
        }
        routines.push(routine);
    }
    let mut drives = Vec::new();
    for pin in 0..PINS.len() {
        let (mut at, mut level) = (3 + rng.below(40), false);
        let longest = [3, 20, 120, 2000][rng.below(4) as usize];
        while at < CYCLES {
            drives.push((at, pin, level));
            level = !level;
            at += 1 + rng.below(longest);
        }
    }
    drives.sort_unstable();
    let high = |rng: &mut Rng| [0xFF, 0xFE, 0xF0, 0xE0][rng.below(4) as usize];
    Setup {
        routines,
        edges: [rng.one_in(2), rng.one_in(2)],
        gate: [rng.one_in(4), rng.one_in(4)],
        counter: rng.one_in(4),
        reload: rng.one_in(2),
        start: [[rng.next_u64() as u8, high(rng)], [rng.next_u64() as u8, high(rng)]],
        timer2: 0xFF00 | rng.below(256) as u16,
        rcap: 0xFF00 | rng.below(250) as u16,
        ie: 0x80 | rng.next_u64() as u8 & 0x3F,
        ip: rng.next_u64() as u8 & 0x3F,
        sample_now: rng.one_in(3),
        drives,
    }
}

/// The machine with the program, pins and registers of `setup`.
fn machine(setup: &Setup) -> Mcs51 {
    let mut text = format!("chip at89c52 {}\n", if setup.sample_now { "now" } else { "" });
    for &(at, pin, high) in &setup.drives {
        text += &format!("drive {} {at}{}\n", PINS[pin], if high { 'H' } else { 'L' });
    }
    for source in 1..7 {
        text += &format!("0x{:02x}: ljmp at{source}\n", source * 8 - 5);
    }
    text += "0x40:\n";
    for (source, routine) in setup.routines.iter().enumerate() {
        text += &format!("at{source}:\n");
        for op in routine.iter().skip(usize::from(source > 0)) {
            text += &format!("{}\n", op.text("at0"));
        }
    }
    let mut mcs51 = source::program("random", &text).0.machine();
    mcs51.set_pc(0x40);
    let bit = |on: bool, n: u8| u8::from(on) << n;
    let mode = if setup.reload { 0x22 } else { 0x11 };
    let tmod = mode | bit(setup.gate[0], 3) | bit(setup.gate[1], 7) | bit(setup.counter, 2);
    let tcon = 0x50 | bit(setup.edges[0], 0) | bit(setup.edges[1], 2);
    let [low, high] = setup.timer2.to_le_bytes();
    let [rcap_low, rcap_high] = setup.rcap.to_le_bytes();
    let registers = [
        (0x89, tmod),
        (0x8A, setup.start[0][0]),
        (0x8C, setup.start[0][1]),
        (0x8B, setup.start[1][0]),
        (0x8D, setup.start[1][1]),
        (0xCA, rcap_low),
        (0xCB, rcap_high),
        (0xCC, low),
        (0xCD, high),
        (0xB8, setup.ip),
        (0xA8, setup.ie),
        (0x88, tcon),
        (0xC8, 0x0C),
    ];
    for (addr, value) in registers {
        assert!(mcs51.poke("sfr", addr, value));
    }
    mcs51
}

#[test]
fn every_call_is_that_of_the_ticked_model() {
    let (mut calls, mut sources) = (0, [0; 7]);
    for seed in 0..SEEDS {
        let mut rng = Rng::new(0x1234_0000 + seed);
        let setup = setup(&mut rng);
        let wanted = model::run(&setup, CYCLES);
        let mut mcs51 = machine(&setup);
        let mut found = Calls::default();
        // In one run or in slices, which must make no difference.
        let slice = [CYCLES, 1, 7, 100][(seed % 4) as usize];
        let mut until = 0;
        let mut stop = StopReason::Limit;
        while until < CYCLES && stop == StopReason::Limit {
            until += slice;
            stop = mcs51.run(until, &mut found);
        }
        let wanted: Vec<_> = wanted.into_iter().filter(|call| call.0 < CYCLES - 10).collect();
        found.0.retain(|call| call.0 < CYCLES - 10);
        if found.0 != wanted {
            let n = found.0.iter().zip(&wanted).take_while(|(f, w)| f == w).count();
            panic!(
                "seed {seed}, {stop:?}: after {:?} wanted {:?}, found {:?}\n{setup:#?}",
                &wanted[n.saturating_sub(3)..n],
                wanted.get(n),
                found.0.get(n)
            );
        }
        calls += wanted.len();
        wanted.iter().for_each(|call| sources[usize::from(call.1)] += 1);
    }
    println!("{SEEDS} programs, {calls} calls, by source {sources:?}");
    assert!(calls > 20_000 && sources[1..].iter().all(|&n| n > 500), "{calls} {sources:?}");
}
