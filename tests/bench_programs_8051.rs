//! The benchmark programs of the 8051 compute the results that their headers state.

#[path = "../benches/programs51/assemble.rs"]
mod assemble;
#[path = "../benches/programs51/programs.rs"]
mod programs;

use emu_8051::{Mcs51, chips};
use emu_core::{Cpu, RamInit, StopReason};

fn after(name: &str, cycles: u64) -> Mcs51 {
    let list = programs::programs();
    let (_, source) = list.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}"));
    let image = assemble::image(source).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut mcs51 = Mcs51::new(chips::chip("at89c52").expect("a CMOS 8052"), &image, RamInit::Random(1));
    assert_eq!(mcs51.run(cycles, &mut ()), StopReason::Limit, "{name}");
    mcs51
}

fn idata(mcs51: &Mcs51, addr: u32) -> u8 {
    mcs51.peek("idata", addr).unwrap_or_else(|| panic!("idata {addr:#x}"))
}

fn word(mcs51: &Mcs51, addr: u32) -> u32 {
    u32::from(idata(mcs51, addr)) | u32::from(idata(mcs51, addr + 1)) << 8
}

#[test]
fn alu_computes() {
    // 12 cycles before the loop, then iterations of 50; iterations 256 and 512 have 3 more.
    for turns in [1u32, 2, 99, 100, 255, 600] {
        let mcs51 = after("alu", 12 + 50 * u64::from(turns) + 3 * u64::from(turns / 256));
        let (mut sum, mut cells, mut decimal) = (0u32, [0u8; 4], 0u32);
        for _ in 0..turns {
            sum = sum.wrapping_add(0x9E35_C64D);
            let [r2, r3, r4, r5] = sum.to_le_bytes();
            cells[0] = cells[0].rotate_left(1).wrapping_add(r5 ^ r2) ^ r3.wrapping_mul(r5);
            cells[1] = (r4 / 10).rotate_left(4) | (r4 % 10);
            decimal = (decimal + 1) % 100;
            cells[2] = (decimal / 10 * 16 + decimal % 10) as u8;
            cells[3] = (!cells[3].wrapping_sub(r2) & 0x7F).rotate_left(4);
        }
        assert_eq!(word(&mcs51, 2) | word(&mcs51, 4) << 16, sum, "{turns}");
        assert_eq!(word(&mcs51, 6), turns, "{turns}");
        assert_eq!(std::array::from_fn(|i| idata(&mcs51, 0x30 + i as u32)), cells, "{turns}");
    }
}

#[test]
fn sieve_counts_the_primes() {
    let mcs51 = after("sieve", 2_000_000);
    assert!(idata(&mcs51, 0x32) > 2, "rounds");
    assert_eq!(word(&mcs51, 0x30), 1899);
}

#[test]
fn ticks_come_every_thousand_cycles_and_disturb_nothing() {
    // The timer starts within the first hundred cycles.
    let mut mcs51 = after("tick", 5_000_500);
    assert_eq!(word(&mcs51, 0x30), 5000);
    // Only at the head of the loop do the register and the count match.
    while mcs51.pc() != SHIFT {
        assert_eq!(mcs51.step(&mut ()), StopReason::Limit);
        assert!(mcs51.cycle() < 5_001_000, "never again at the head of the loop");
    }
    let shifts = word(&mcs51, 0x32) | u32::from(idata(&mcs51, 0x34)) << 16;
    let mut register = 1u16;
    for _ in 0..shifts {
        register = register >> 1 ^ if register & 1 == 1 { 0xB400 } else { 0 };
    }
    assert!(shifts > 100_000);
    assert_eq!(word(&mcs51, 2), u32::from(register));
}

/// Address of the label `shift` in `tick.s`: 0Eh plus the lengths of the 14 instructions before the label.
const SHIFT: u32 = 0x0E + 1 + 2 * 5 + 2 + 1 + 3 * 5 + 2;

#[test]
fn the_ladder_goes_by_its_rungs() {
    let mut mcs51 = after("bits", 10); // The count of scans is cleared.
    let mut bits = [false; 128];
    let scans = 300u32;
    for scan in 0..scans {
        for (n, bit) in bits.iter_mut().enumerate().take(16) {
            *bit = scan >> n & 1 == 1;
        }
        for rung in programs::rungs() {
            let [a, b, c, d] = rung.read.map(|n| bits[usize::from(n)]);
            let flow = (a && b || !c) && !d;
            let coil = &mut bits[usize::from(rung.coil)];
            *coil = match rung.kind {
                0 => flow,
                1 => *coil || flow,
                _ => *coil && !flow,
            };
        }
    }
    while word(&mcs51, 6) < scans {
        assert_eq!(mcs51.step(&mut ()), StopReason::Limit);
        assert!(mcs51.cycle() < u64::from(scans) * 1200);
    }
    let expected: Vec<u8> = bits.chunks(8).map(|b| b.iter().rev().fold(0, |v, &b| v << 1 | u8::from(b))).collect();
    let got: Vec<u8> = (0x22..0x2E).map(|a| idata(&mcs51, a)).collect();
    assert_eq!(got, expected[2..14]);
    assert!(got.iter().any(|&b| b != 0));
}

#[test]
fn idle_wakes() {
    // The program reloads the timer some cycles after it overflowed: a wake takes at least 10,000 cycles, and
    // at most 20 more.
    let wakes = word(&after("idle", 100_000_000), 0x30);
    assert!((9980..=10_000).contains(&wakes), "{wakes}");
}
