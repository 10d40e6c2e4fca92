//! Arithmetic and logic with all operands, and with carry and Z set and clear, compared with the plain
//! integers of `reference.rs`.

use std::collections::BTreeSet;

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_avr::isa::{ROWS, find_row};
use emu_core::image::{Image, Segment};
use emu_core::table::MatchedRow;
use emu_core::{Cpu, RamInit, StopReason};

use super::reference::{C, CONSTANT, I, ONE, PRODUCTS, Product, Reference, T, TWO, Z, pair, with};

/// Returns a machine with these lines from address 0.
fn machine(lines: &[String]) -> Avr {
    let word = |(pc, line): (usize, &String)| {
        emu_asm::assemble_line(&ATMEGA328P, line, pc as u32).unwrap_or_else(|e| panic!("{line}: {e}"))[0]
    };
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

/// Returns an SREG with carry and Z from `pick` (0 to 3); the other flags mix the operands, so that they take
/// both values.
fn sreg(pick: u8, d: i32, r: i32) -> u8 {
    (d.wrapping_mul(167) ^ r.wrapping_mul(89)) as u8 & !(C | Z) | pick
}

/// Executes the instruction at the word address `pc`, which is not a jump, with the given registers and SREG;
/// returns the registers and SREG after it.
fn run<const N: usize>(avr: &mut Avr, pc: u32, regs: [(u32, i32); N], before: u8) -> ([i32; N], u8) {
    for (r, value) in regs {
        put(avr, r, value);
    }
    put(avr, 0x5F, i32::from(before));
    avr.set_pc(pc);
    let stop = avr.step(&mut ());
    assert_eq!((stop, avr.pc()), (StopReason::Limit, pc + 1));
    (regs.map(|(r, _)| get(avr, r)), get(avr, 0x5F) as u8)
}

fn pairs() -> impl Iterator<Item = (i32, i32)> {
    (0..256).flat_map(|d| (0..256).map(move |r| (d, r)))
}

/// Bytes at the edges of the range.
const EDGES: [i32; 12] = [0, 1, 2, 0x0F, 0x10, 0x55, 0x7F, 0x80, 0x81, 0xF0, 0xFE, 0xFF];

/// Inputs: all pairs with all four values of carry and Z, and edge values with any SREG.
fn inputs() -> impl Iterator<Item = (i32, i32, u8)> {
    let all = pairs().flat_map(|(d, r)| (0..4).map(move |pick| (d, r, sreg(pick, d, r))));
    let edges = EDGES.iter().flat_map(|&d| EDGES.iter().map(move |&r| (d, r)));
    all.chain(edges.flat_map(|(d, r)| (0..=255).map(move |sreg| (d, r, sreg))))
}

fn lines(names: impl Iterator<Item = &'static str>, operands: &str) -> Vec<String> {
    names.map(|name| format!("{name} {operands}")).collect()
}

#[test]
fn two_registers() {
    for (operands, rd, rr) in [("r20, r21", 20, 21), ("r31, r0", 31, 0)] {
        let mut avr = machine(&lines(TWO.iter().map(|row| row.0), operands));
        for (pc, (name, reference)) in (0..).zip(TWO) {
            for (d, r, before) in inputs() {
                let found = run(&mut avr, pc, [(rd, d), (rr, r)], before);
                let (result, after) = reference(d, r, before);
                let wanted = ([result.unwrap_or(d), r], after);
                assert_eq!(found, wanted, "{name} {d:02x}, {r:02x}, SREG {before:02x}: (Rd, Rr), SREG");
            }
        }
    }
}

/// Two operands in the same register.
#[test]
fn a_register_and_itself() {
    let mut avr = machine(&lines(TWO.iter().map(|row| row.0), "r7, r7"));
    for (pc, (name, reference)) in (0..).zip(TWO) {
        for (d, before) in (0..256).flat_map(|d| (0..=255).map(move |sreg| (d, sreg))) {
            let found = run(&mut avr, pc, [(7, d)], before);
            let (result, after) = reference(d, d, before);
            assert_eq!(found, ([result.unwrap_or(d)], after), "{name} {d:02x} twice, SREG {before:02x}");
        }
    }
}

#[test]
fn register_and_constant() {
    for (name, reference) in CONSTANT {
        let mut avr = machine(&(0..256).map(|k| format!("{name} r20, {k}")).collect::<Vec<_>>());
        for (d, k, before) in inputs() {
            let found = run(&mut avr, k as u32, [(20, d)], before);
            let (result, after) = reference(d, k, before);
            assert_eq!(found, ([result.unwrap_or(d)], after), "{name} {d:02x}, {k:02x}, SREG {before:02x}");
        }
    }
}

#[test]
fn one_register() {
    let mut avr = machine(&lines(ONE.iter().map(|row| row.0), "r20"));
    for (pc, (name, reference)) in (0..).zip(ONE) {
        for (d, before) in (0..256).flat_map(|d| (0..=255).map(move |sreg| (d, sreg))) {
            let found = run(&mut avr, pc, [(20, d)], before);
            let (result, after) = reference(d, 0, before);
            assert_eq!(found, ([result.unwrap_or(d)], after), "{name} {d:02x}, SREG {before:02x}");
        }
    }
}

fn check_product(avr: &mut Avr, (pc, rd, rr): (u32, u32, u32), name: &str, reference: Product, case: (i32, i32, u8)) {
    let (d, r, before) = case;
    let (_, found) = run(avr, pc, [(rd, d), (rr, r)], before);
    let (result, after) = reference(d, r, before);
    // The factors do not change, unless they are in r0 or r1, which get the product.
    let [want_d, want_r] = [(rd, d), (rr, r)].map(|(reg, old)| match reg {
        0 => result % 256,
        1 => result / 256,
        _ => old,
    });
    let found = (get(avr, 1) * 256 + get(avr, 0), found, get(avr, rd), get(avr, rr));
    assert_eq!(found, (result, after, want_d, want_r), "{name} {d:02x}, {r:02x}, SREG {before:02x}");
}

#[test]
fn products() {
    let mut avr = machine(&lines(PRODUCTS.iter().map(|row| row.0), "r20, r21"));
    let mut twice = machine(&lines(PRODUCTS.iter().map(|row| row.0), "r20, r20"));
    for (pc, (name, reference)) in (0..).zip(PRODUCTS) {
        for case in inputs() {
            check_product(&mut avr, (pc, 20, 21), name, *reference, case);
        }
        for d in 0..256 {
            check_product(&mut twice, (pc, 20, 20), name, *reference, (d, d, sreg(d as u8 % 4, d, d)));
        }
    }
    // Factors in the registers of the product.
    let places = [(0, 1), (1, 0), (0, 21), (20, 1), (0, 0), (1, 1)];
    let mut avr = machine(&places.map(|(d, r)| format!("mul r{d}, r{r}")));
    for (pc, (rd, rr)) in (0..).zip(places) {
        for (d, r) in pairs().filter(|(d, r)| rd != rr || d == r) {
            check_product(&mut avr, (pc, rd, rr), "mul", PRODUCTS[0].1, (d, r, sreg(d as u8 % 4, d, r)));
        }
    }
}

/// ADIW and SBIW with every pair and every constant. Without optimization that takes too long; then each
/// constant is tested with one pair in 61 and with those around the edges.
#[test]
fn pairs_and_constants() {
    for (name, sign) in [("adiw", 1), ("sbiw", -1)] {
        let mut avr = machine(&(0..64).map(|k| format!("{name} r24, {k}")).collect::<Vec<_>>());
        for k in 0..64 {
            let near = |d: i32| [0, 0x100, 0x8000, 0x1_0000].iter().any(|edge| (d - edge).abs() <= 70);
            for d in (0..0x1_0000).filter(|&d| !cfg!(debug_assertions) || d % 61 == k % 61 || near(d)) {
                let before = sreg((d ^ k) as u8 % 4, d, k);
                let ([low, high], sreg) = run(&mut avr, k as u32, [(24, d % 256), (25, d / 256)], before);
                let found = (high * 256 + low, sreg);
                assert_eq!(found, pair(d, k, sign, before), "{name} {d:04x}, {k}, SREG {before:02x}");
            }
        }
    }
}

#[test]
fn pairs_in_all_places_and_with_any_sreg() {
    for (name, sign) in [("adiw", 1), ("sbiw", -1)] {
        for (pc, low) in (0..).zip([24, 26, 28, 30]) {
            let mut avr = machine(&[24, 26, 28, 30].map(|low| format!("{name} r{low}, 1")));
            for (d, before) in [0, 1, 0x7FFF, 0x8000, 0xFFFF].iter().flat_map(|&d| (0..=255).map(move |s| (d, s))) {
                let ([l, h], sreg) = run(&mut avr, pc, [(low, d % 256), (low + 1, d / 256)], before);
                assert_eq!((h * 256 + l, sreg), pair(d, 1, sign, before), "{name} r{low}: {d:04x}, SREG {before:02x}");
            }
        }
    }
}

/// The eight flags by the letters of SEx and CLx, in the order of SREG.
const LETTERS: &str = "cznvshti";

#[test]
fn one_flag() {
    for (n, letter) in LETTERS.chars().enumerate() {
        let mask = 1 << n;
        let mut avr = machine(&[format!("se{letter}"), format!("cl{letter}")]);
        for before in 0..=255u8 {
            for (pc, on) in [(0, true), (1, false)] {
                let ([], found) = run(&mut avr, pc, [], before);
                assert_eq!(found, with(before, &[(mask, on)]), "{letter} to {on}, SREG {before:02x}");
            }
        }
    }
    assert_eq!((1 << LETTERS.find('t').unwrap_or(0), 1 << LETTERS.find('i').unwrap_or(0)), (T, I));
}

#[test]
fn a_bit_and_t() {
    for b in 0..8 {
        let mut avr = machine(&[format!("bst r9, {b}"), format!("bld r9, {b}")]);
        for (d, before) in (0..256).flat_map(|d| (0..=255).map(move |sreg| (d, sreg))) {
            let set = d / (1 << b) % 2 == 1;
            let found = run(&mut avr, 0, [(9, d)], before);
            assert_eq!(found, ([d], with(before, &[(T, set)])), "bst {d:02x}, {b}, SREG {before:02x}");
            let without = d - if set { 1 << b } else { 0 };
            let wanted = without + if before & T != 0 { 1 << b } else { 0 };
            let found = run(&mut avr, 1, [(9, d)], before);
            assert_eq!(found, ([wanted], before), "bld {d:02x}, {b}, SREG {before:02x}");
        }
    }
}

/// Every row that writes a flag, and every other row that computes, is in one of these tests.
#[test]
fn no_row_is_left_out() {
    let mut tested: BTreeSet<&str> = ["adiw", "sbiw", "bst", "bld"].into();
    let named = |names: &[(&'static str, Reference)]| names.iter().map(|row| row.0).collect::<Vec<_>>();
    tested.extend([TWO, ONE, CONSTANT].iter().flat_map(|names| named(names)));
    tested.extend(PRODUCTS.iter().map(|row| row.0));
    for letter in LETTERS.chars() {
        for line in [format!("se{letter}"), format!("cl{letter}")] {
            let word = emu_asm::assemble_line(&ATMEGA328P, &line, 0).unwrap_or_else(|e| panic!("{line}: {e}"))[0];
            let MatchedRow { row, .. } = find_row(word, 0).unwrap_or_else(|| panic!("{line}"));
            assert_eq!(row.flags, letter.to_ascii_uppercase().to_string());
            tested.insert(row.mnemonic);
        }
    }
    let computes = |row: &&emu_core::table::InstructionRow| !row.flags.is_empty() && row.mnemonic != "reti";
    let missing: Vec<_> = ROWS.iter().filter(computes).filter(|row| !tested.contains(row.mnemonic)).collect();
    assert!(missing.is_empty(), "{missing:?}");
    assert!(["swap", "mov", "ldi", "ser", "lsl", "rol", "tst", "clr"].iter().all(|name| tested.contains(name)));
}
