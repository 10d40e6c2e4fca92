//! Numbers as rows of bits, the lowest first: one bit after the other is moved.

use ladder::{ShiftOp, UnaryOp};

/// The lowest bits of a number.
pub fn of(value: i64, bits: usize) -> Vec<bool> {
    (0..bits).map(|n| value.div_euclid(1 << n).rem_euclid(2) == 1).collect()
}

/// The number of which these are all bits; the last is the sign.
pub fn number(bits: &[bool]) -> i64 {
    let weight = |n: usize| if n + 1 == bits.len() { -(1_i64 << n) } else { 1 << n };
    (0..bits.len()).filter(|&n| bits[n]).map(weight).sum()
}

pub fn unary(op: UnaryOp, value: i64, width: usize) -> i64 {
    let mut bits = of(value, width);
    match op {
        UnaryOp::Not => -1 - value,
        UnaryOp::Neg => 0 - value,
        UnaryOp::Swap => {
            // The parts change places, and then the bits within each.
            let part = if width == 8 { 4 } else { 8 };
            bits.reverse();
            bits.chunks_mut(part).for_each(<[bool]>::reverse);
            number(&bits)
        }
        UnaryOp::Opposite => {
            bits.reverse();
            number(&bits)
        }
        UnaryOp::BinToBcd => {
            let digits = format!("{:04}", value.unsigned_abs());
            digits.bytes().rev().take(4).zip([1, 256, 65_536, 16_777_216]).map(|(d, w)| i64::from(d - b'0') * w).sum()
        }
        UnaryOp::BcdToBin => {
            let digit = |byte: &[bool]| (0..4).filter(|&n| byte[n]).map(|n| 1 << n).sum::<i64>();
            bits.chunks(8).rev().fold(0, |sum, byte| 10 * sum + digit(byte))
        }
    }
}

pub fn shift(op: ShiftOp, value: i64, width: usize, count: i64) -> i64 {
    // To the left there must be room for all that may be stored.
    let mut bits = of(value, if op == ShiftOp::Shl { 40 } else { width });
    // After 96 steps everything is shifted out, and every rotation is back where it began.
    for _ in 0..if count > 96 { 96 + count % 96 } else { count } {
        let (low, high) = (bits[0], bits[bits.len() - 1]);
        match op {
            ShiftOp::Shl => bits.rotate_right(1),
            ShiftOp::Rol => bits.rotate_right(1),
            ShiftOp::Shr | ShiftOp::Sr0 | ShiftOp::Ror => bits.rotate_left(1),
        }
        let last = bits.len() - 1;
        match op {
            ShiftOp::Shl => bits[0] = false,
            ShiftOp::Rol => bits[0] = high,
            ShiftOp::Shr => bits[last] = high,
            ShiftOp::Sr0 => bits[last] = false,
            ShiftOp::Ror => bits[last] = low,
        }
    }
    number(&bits)
}

/// The number of `bits` bits that is congruent to `value`.
pub fn wrap_to_bits(value: i64, bits: u32) -> i64 {
    let half = 1 << (bits - 1);
    (value + half).rem_euclid(2 * half) - half
}

/// Quotient of the magnitudes with the combined sign; division by zero gives -1, or 1 for a negative
/// dividend.
pub fn divide(a: i64, b: i64) -> i64 {
    let sign = if (a < 0) == (b < 0) { 1 } else { -1 };
    match (a, b) {
        (0.., 0) => -1,
        (_, 0) => 1,
        _ => sign * (a.abs() / b.abs()),
    }
}

/// Bit by bit, on enough bits for any operand.
pub fn bitwise(a: i64, b: i64, is: impl Fn(bool, bool) -> bool) -> i64 {
    let pairs = of(a, 40).into_iter().zip(of(b, 40));
    number(&pairs.map(|(x, y)| is(x, y)).collect::<Vec<bool>>())
}
