//! Expected results of the arithmetic, in plain integers.
//!
//! The carry is what does not fit into eight bits, the half carry what does not fit into four. V is a signed
//! result outside -128..=127, and S is the sign of the unlimited signed result. The Boolean formulas of the
//! manual, from which the bodies are written, are not used here.

pub const C: u8 = 1;
pub const Z: u8 = 2;
pub const N: u8 = 4;
pub const V: u8 = 8;
pub const S: u8 = 16;
pub const H: u8 = 32;
pub const T: u8 = 64;
pub const I: u8 = 128;

/// Computes result (None for a comparison) and SREG of an instruction from `d`, `r` and SREG.
pub type Reference = fn(i32, i32, u8) -> (Option<i32>, u8);

pub fn with(sreg: u8, flags: &[(u8, bool)]) -> u8 {
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

/// `sticky`: Z can only be cleared, so that it is valid for a number of several bytes.
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

/// A right shift. V is sign xor carry, so S equals the carry.
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
pub const TWO: &[(&str, Reference)] = &[
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
pub const CONSTANT: &[(&str, Reference)] = &[
    ("subi", |d, k, s| subtracted(d, k, 0, false, s)),
    ("sbci", |d, k, s| subtracted(d, k, bit(s, C), true, s)),
    ("cpi",  |d, k, s| compared(subtracted(d, k, 0, false, s))),
    ("andi", |d, k, s| logic(d & k, s)),
    ("ori",  |d, k, s| logic(d | k, s)),
    ("sbr",  |d, k, s| logic(d | k, s)),
    ("ldi",  |_, k, s| (Some(k), s)),
];

#[rustfmt::skip]
pub const ONE: &[(&str, Reference)] = &[
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
    ("ser",  |_, _, s| (Some(255), s)),
];

/// Returns r1:r0 and the two flags of a product; `shift` doubles it.
fn product(d: i32, r: i32, shift: bool, sreg: u8) -> (i32, u8) {
    let full = (d * r).rem_euclid(0x1_0000);
    let result = if shift { full * 2 % 0x1_0000 } else { full };
    (result, with(sreg, &[(C, full > 0x7FFF), (Z, result == 0)]))
}

pub type Product = fn(i32, i32, u8) -> (i32, u8);

#[rustfmt::skip]
pub const PRODUCTS: &[(&str, Product)] = &[
    ("mul",    |d, r, s| product(d, r, false, s)),
    ("muls",   |d, r, s| product(signed(d), signed(r), false, s)),
    ("mulsu",  |d, r, s| product(signed(d), r, false, s)),
    ("fmul",   |d, r, s| product(d, r, true, s)),
    ("fmuls",  |d, r, s| product(signed(d), signed(r), true, s)),
    ("fmulsu", |d, r, s| product(signed(d), r, true, s)),
];

/// Returns pair and SREG of ADIW (`sign` 1) and SBIW (`sign` -1).
pub fn pair(d: i32, k: i32, sign: i32, sreg: u8) -> (i32, u8) {
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
    (result, with(sreg, &flags))
}
