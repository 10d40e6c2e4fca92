//! Arithmetic over all its operands, with carry and Z both ways, against plain integers.
//!
//! The reference computes in `i32`: the carry is what does not fit into eight bits, the half carry what does not fit into
//! four, V a signed result outside -128..=127 and S the sign of the signed result as it would be without a limit. The
//! boolean formulas of the manual, from which the bodies are written, appear nowhere here.

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_avr::isa::assemble;
use emu_core::image::{Image, Segment};
use emu_core::{Cpu, RamInit, Stop};

const C: u8 = 1;
const Z: u8 = 2;
const N: u8 = 4;
const V: u8 = 8;
const S: u8 = 16;
const H: u8 = 32;

/// Result (none for a comparison) and SREG of an instruction on `d`, `r` and SREG.
type Reference = fn(i32, i32, u8) -> (Option<i32>, u8);

fn with(sreg: u8, flags: &[(u8, bool)]) -> u8 {
    flags.iter().fold(sreg, |s, &(mask, on)| if on { s | mask } else { s & !mask })
}

fn signed(byte: i32) -> i32 {
    i32::from(byte as u8 as i8)
}

fn bit(sreg: u8, mask: u8) -> i32 {
    i32::from(sreg & mask != 0)
}

fn added(d: i32, r: i32, carry: i32, sreg: u8) -> (Option<i32>, u8) {
    let (full, true_sum) = (d + r + carry, signed(d) + signed(r) + carry);
    let half = d % 16 + r % 16 + carry;
    let flags = [
        (C, full > 255),
        (H, half > 15),
        (V, !(-128..=127).contains(&true_sum)),
        (S, true_sum < 0),
        (N, full % 256 > 127),
        (Z, full % 256 == 0),
    ];
    (Some(full % 256), with(sreg, &flags))
}

/// `sticky`: Z can only be cleared, so that it speaks for a number of several bytes.
fn subtracted(d: i32, r: i32, borrow: i32, sticky: bool, sreg: u8) -> (Option<i32>, u8) {
    let (full, true_difference) = (d - r - borrow, signed(d) - signed(r) - borrow);
    let half = d % 16 - r % 16 - borrow;
    let result = full.rem_euclid(256);
    let flags = [
        (C, full < 0),
        (H, half < 0),
        (V, !(-128..=127).contains(&true_difference)),
        (S, true_difference < 0),
        (N, result > 127),
        (Z, result == 0 && (!sticky || sreg & Z != 0)),
    ];
    (Some(result), with(sreg, &flags))
}

fn logic(result: i32, sreg: u8) -> (Option<i32>, u8) {
    let result = result.rem_euclid(256);
    (Some(result), with(sreg, &[(V, false), (N, result > 127), (S, result > 127), (Z, result == 0)]))
}

/// A right shift: V says that sign and carry differ, which makes S the carry.
fn shifted(result: i32, out: bool, sreg: u8) -> (Option<i32>, u8) {
    let negative = result > 127;
    (Some(result), with(sreg, &[(C, out), (N, negative), (V, negative != out), (S, out), (Z, result == 0)]))
}

fn counted(d: i32, step: i32, sreg: u8) -> (Option<i32>, u8) {
    let result = (d + step).rem_euclid(256);
    let wide = signed(d) + step;
    let flags = [(V, !(-128..=127).contains(&wide)), (S, wide < 0), (N, result > 127), (Z, result == 0)];
    (Some(result), with(sreg, &flags))
}

fn compared((_, sreg): (Option<i32>, u8)) -> (Option<i32>, u8) {
    (None, sreg)
}

#[rustfmt::skip]
const TWO: &[(&str, Reference)] = &[
    ("add",  |d, r, s| added(d, r, 0, s)),
    ("adc",  |d, r, s| added(d, r, bit(s, C), s)),
    ("sub",  |d, r, s| subtracted(d, r, 0, false, s)),
    ("sbc",  |d, r, s| subtracted(d, r, bit(s, C), true, s)),
    ("cp",   |d, r, s| compared(subtracted(d, r, 0, false, s))),
    ("cpc",  |d, r, s| compared(subtracted(d, r, bit(s, C), true, s))),
    ("and",  |d, r, s| logic(d & r, s)),
    ("or",   |d, r, s| logic(d | r, s)),
    ("eor",  |d, r, s| logic(d ^ r, s)),
    ("mov",  |_, r, s| (Some(r), s)),
];

#[rustfmt::skip]
const CONSTANT: &[(&str, Reference)] = &[
    ("subi", |d, k, s| subtracted(d, k, 0, false, s)),
    ("sbci", |d, k, s| subtracted(d, k, bit(s, C), true, s)),
    ("cpi",  |d, k, s| compared(subtracted(d, k, 0, false, s))),
    ("andi", |d, k, s| logic(d & k, s)),
    ("ori",  |d, k, s| logic(d | k, s)),
    ("ldi",  |_, k, s| (Some(k), s)),
];

#[rustfmt::skip]
const ONE: &[(&str, Reference)] = &[
    ("com",  |d, _, s| { let (r, s) = logic(255 - d, s); (r, s | C) }),
    ("neg",  |d, _, s| subtracted(0, d, 0, false, s)),
    ("inc",  |d, _, s| counted(d, 1, s)),
    ("dec",  |d, _, s| counted(d, -1, s)),
    ("lsr",  |d, _, s| shifted(d / 2, d % 2 == 1, s)),
    ("ror",  |d, _, s| shifted(d / 2 + 128 * bit(s, C), d % 2 == 1, s)),
    ("asr",  |d, _, s| shifted(signed(d).div_euclid(2).rem_euclid(256), d % 2 == 1, s)),
    ("swap", |d, _, s| (Some(d % 16 * 16 + d / 16), s)),
    ("lsl",  |d, _, s| added(d, d, 0, s)),
    ("rol",  |d, _, s| added(d, d, bit(s, C), s)),
    ("tst",  |d, _, s| logic(d, s)),
    ("clr",  |_, _, s| logic(0, s)),
];

/// r1:r0 as result and the two flags of a product; `shift` doubles it.
fn product(d: i32, r: i32, shift: bool, sreg: u8) -> (i32, u8) {
    let full = (d * r).rem_euclid(0x1_0000);
    let result = if shift { full * 2 % 0x1_0000 } else { full };
    (result, with(sreg, &[(C, full > 0x7FFF), (Z, result == 0)]))
}

type Product = fn(i32, i32, u8) -> (i32, u8);

#[rustfmt::skip]
const PRODUCTS: &[(&str, Product)] = &[
    ("mul",    |d, r, s| product(d, r, false, s)),
    ("muls",   |d, r, s| product(signed(d), signed(r), false, s)),
    ("mulsu",  |d, r, s| product(signed(d), r, false, s)),
    ("fmul",   |d, r, s| product(d, r, true, s)),
    ("fmuls",  |d, r, s| product(signed(d), signed(r), true, s)),
    ("fmulsu", |d, r, s| product(signed(d), r, true, s)),
];

/// A machine with these lines from address 0.
fn machine(lines: &[String]) -> Avr {
    let word = |(pc, line): (usize, &String)| assemble(line, pc as u32).unwrap_or_else(|e| panic!("{line}: {e}"))[0];
    let bytes: Vec<u8> = lines.iter().enumerate().map(word).flat_map(u16::to_le_bytes).collect();
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() };
    Avr::new(&ATMEGA328P, &image, RamInit::Zero)
}

fn put(avr: &mut Avr, addr: u32, value: i32) {
    assert!(avr.poke("data", addr, value as u8));
}

fn get(avr: &Avr, addr: u32) -> i32 {
    avr.peek("data", addr).map_or(-1, i32::from)
}

/// SREG with carry and Z as `pick` (0 to 3) says; the others are a mix of the operands, so that they take both values.
fn sreg(pick: u8, d: i32, r: i32) -> u8 {
    (d.wrapping_mul(167) ^ r.wrapping_mul(89)) as u8 & !(C | Z) | pick
}

/// One instruction at word 0 or at word `pc` on r20 and r21.
fn check(avr: &mut Avr, pc: u32, name: &str, reference: Reference, d: i32, r: i32) {
    for pick in 0..4 {
        let before = sreg(pick, d, r);
        put(avr, 20, d);
        put(avr, 21, r);
        put(avr, 0x5F, i32::from(before));
        avr.set_pc(pc);
        let stop = avr.step(&mut ());
        let (result, after) = reference(d, r, before);
        let found = (get(avr, 20), get(avr, 0x5F), get(avr, 21), avr.pc(), stop);
        let wanted = (result.unwrap_or(d), i32::from(after), r, pc + 1, Stop::Limit);
        assert_eq!(found, wanted, "{name} {d:02x}, {r:02x}, SREG {before:02x}: (Rd, SREG, Rr, PC, stop)");
    }
}

#[test]
fn two_registers() {
    let lines: Vec<String> = TWO.iter().map(|(name, _)| format!("{name} r20, r21")).collect();
    let mut avr = machine(&lines);
    for (pc, (name, reference)) in (0..).zip(TWO) {
        for (d, r) in (0..256).flat_map(|d| (0..256).map(move |r| (d, r))) {
            check(&mut avr, pc, name, *reference, d, r);
        }
    }
}

#[test]
fn register_and_constant() {
    for (name, reference) in CONSTANT {
        let lines: Vec<String> = (0..256).map(|k| format!("{name} r20, {k}")).collect();
        let mut avr = machine(&lines);
        put(&mut avr, 21, 0);
        for (d, k) in (0..256).flat_map(|d| (0..256).map(move |k| (d, k))) {
            for pick in [0, 3] {
                let before = sreg(pick, d, k) ^ if d % 2 == k % 2 { Z } else { 0 };
                put(&mut avr, 20, d);
                put(&mut avr, 0x5F, i32::from(before));
                avr.set_pc(k as u32);
                avr.step(&mut ());
                let (result, after) = reference(d, k, before);
                let found = (get(&avr, 20), get(&avr, 0x5F));
                assert_eq!(
                    found,
                    (result.unwrap_or(d), i32::from(after)),
                    "{name} {d:02x}, {k:02x}, SREG {before:02x}"
                );
            }
        }
    }
}

#[test]
fn one_register() {
    let lines: Vec<String> = ONE.iter().map(|(name, _)| format!("{name} r20")).collect();
    let mut avr = machine(&lines);
    for (pc, (name, reference)) in (0..).zip(ONE) {
        for d in 0..256 {
            for r in [0, 0x5A, 0xFF] {
                check(&mut avr, pc, name, *reference, d, r);
            }
        }
    }
}

#[test]
fn products() {
    let lines: Vec<String> = PRODUCTS.iter().map(|(name, _)| format!("{name} r20, r21")).collect();
    let mut avr = machine(&lines);
    for (pc, (name, reference)) in (0..).zip(PRODUCTS) {
        for (d, r) in (0..256).flat_map(|d| (0..256).map(move |r| (d, r))) {
            let before = sreg((d ^ r) as u8 % 4, d, r);
            put(&mut avr, 20, d);
            put(&mut avr, 21, r);
            put(&mut avr, 0x5F, i32::from(before));
            avr.set_pc(pc);
            avr.step(&mut ());
            let (result, after) = reference(d, r, before);
            let found = (get(&avr, 1) * 256 + get(&avr, 0), get(&avr, 0x5F), get(&avr, 20), get(&avr, 21));
            assert_eq!(found, (result, i32::from(after), d, r), "{name} {d:02x}, {r:02x}, SREG {before:02x}");
        }
    }
}

/// ADIW and SBIW over every pair and every constant would be four million steps; every pair meets the constants at the
/// edges, and every constant the pairs around the edges.
#[test]
fn pairs_and_constants() {
    for (name, sign) in [("adiw", 1), ("sbiw", -1)] {
        let lines: Vec<String> = (0..64).map(|k| format!("{name} r24, {k}")).collect();
        let mut avr = machine(&lines);
        let mut one = |d: i32, k: i32| {
            let before = sreg((d ^ k) as u8 % 4, d, k);
            put(&mut avr, 24, d % 256);
            put(&mut avr, 25, d / 256);
            put(&mut avr, 0x5F, i32::from(before));
            avr.set_pc(k as u32);
            avr.step(&mut ());
            let full = d + sign * k;
            let wide = i32::from(d as u16 as i16) + sign * k;
            let result = full.rem_euclid(0x1_0000);
            let flags = [
                (C, full != result),
                (V, !(-0x8000..=0x7FFF).contains(&wide)),
                (S, wide < 0),
                (N, result > 0x7FFF),
                (Z, result == 0),
            ];
            let found = (get(&avr, 25) * 256 + get(&avr, 24), get(&avr, 0x5F));
            assert_eq!(found, (result, i32::from(with(before, &flags))), "{name} {d:04x}, {k}, SREG {before:02x}");
        };
        for d in 0..0x1_0000 {
            for k in [0, 1, 63] {
                one(d, k);
            }
        }
        for k in 0..64 {
            for edge in [0, 0x100, 0x8000, 0x1_0000] {
                (edge - 70..edge + 70).filter(|d| (0..0x1_0000).contains(d)).for_each(|d| one(d, k));
            }
        }
    }
}
