//! The benchmark programs compute the results that their headers state. A program that runs off its code
//! would make its benchmark meaningless.

#[path = "../benches/programs/assemble.rs"]
mod programs;

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::{Cpu, RamInit, StopReason};

fn after(name: &str, cycles: u64) -> Avr {
    let (_, source) = programs::PROGRAMS.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}"));
    let image = programs::image(source).unwrap_or_else(|e| panic!("{name}.s: {e}"));
    let mut avr = Avr::new(&ATMEGA328P, &image, RamInit::Random(1));
    assert_eq!(avr.run(cycles, &mut ()), StopReason::Limit, "{name}");
    avr
}

fn data(avr: &Avr, addr: u32, len: u32) -> Vec<u8> {
    (addr..addr + len).filter_map(|a| avr.peek("data", a)).collect()
}

#[test]
fn alu_adds_and_shifts() {
    // 7 instructions before the loop, then iterations of 14 cycles: the sum is the number of iterations times
    // 9E35C64D plus the initial value of r3:0.
    let (start, end) = (after("alu", 7), after("alu", 7 + 14 * 1000));
    let sum = |avr: &Avr| u32::from_le_bytes(data(avr, 0, 4).try_into().unwrap_or_default());
    assert_eq!(sum(&end), sum(&start).wrapping_add(0x9E35_C64Du32.wrapping_mul(1000)));
    let mut register = 1u16;
    for _ in 0..1000 {
        register = register >> 1 ^ if register & 1 == 1 { 0xB400 } else { 0 };
    }
    assert_eq!(data(&end, 24, 2), register.to_le_bytes());
}

#[test]
fn copy_copies() {
    // 5 + 256 * 7 - 1 + 3 cycles per round.
    let avr = after("copy", 1799);
    let from = data(&avr, 0x100, 256);
    assert!(from.iter().any(|&b| b != from[0]));
    assert_eq!(data(&avr, 0x300, 256), from);
}

#[test]
fn crc_is_the_crc() {
    let avr = after("crc", 40_000);
    let crc = data(&avr, 0x100, 256).into_iter().fold(0xFFFFu16, |crc, byte| {
        (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| crc << 1 ^ if crc >> 15 == 1 { 0x1021 } else { 0 })
    });
    assert_eq!(data(&avr, 0x500, 2), crc.to_le_bytes());
}

#[test]
fn poll_counts_overflows() {
    // The timer overflows every 256 * 1024 cycles; r20 keeps its value after reset at the start.
    let overflows = |cycles| after("poll", cycles).reg("r20").unwrap_or(0);
    let start = overflows(1000);
    assert_eq!(overflows(10 * 262_144 + 500), (start + 10) & 0xFF);
    assert_eq!(overflows(10 * 262_144 - 500), (start + 9) & 0xFF);
}

#[test]
fn sieve_finds_the_primes() {
    let avr = after("sieve", 100_000);
    let prime = |n: u32| n > 1 && !(2..n).any(|d| n.is_multiple_of(d));
    let primes = (0..1024).filter(|&n| prime(n)).count() as u16;
    assert_eq!((primes, data(&avr, 0x500, 2)), (172, 172u16.to_le_bytes().to_vec()));
}

#[test]
fn irq_counts_milliseconds() {
    // The timer starts about 20 cycles after the program; a service routine ends more than 100 cycles after
    // its match.
    let count = |cycles| u32::from_le_bytes(data(&after("irq", cycles), 0x200, 4).try_into().unwrap_or_default());
    for ms in [1, 255, 256, 300] {
        assert_eq!((count(16_000 * ms), count(16_000 * ms + 200)), (ms as u32 - 1, ms as u32), "{ms}");
    }
}

#[test]
fn sleep_wakes_at_overflows() {
    let wakes = |cycles| after("sleep", cycles).reg("r20").unwrap_or(0);
    let start = wakes(1000);
    assert_eq!(wakes(10 * 262_144 + 500), (start + 10) & 0xFF);
}
