//! Operations on the bits of integers (5.7), as numbers: each on the exact value or on the bits of a width.

use ladder::{SegmentDisplay, ShiftOp, UnaryOp};

/// The bits of a number of `bits` bits, as a number without sign.
fn unsigned(value: i32, bits: u32) -> u64 {
    i64::from(value) as u64 & ((1 << bits) - 1)
}

/// The number with sign that `bits` bits are.
fn signed(pattern: u64, bits: u32) -> i64 {
    let spare = 64 - bits;
    (pattern << spare) as i64 >> spare
}

/// NOT, NEG, SWAP, OPPOSITE, BIN2BCD, BCD2BIN of a number of `bits` bits.
pub(crate) fn unary(op: UnaryOp, value: i32, bits: u32) -> i64 {
    let pattern = unsigned(value, bits);
    match op {
        UnaryOp::Not => !i64::from(value),
        UnaryOp::Neg => -i64::from(value),
        UnaryOp::Swap if bits == 8 => signed(pattern << 4 | pattern >> 4, 8),
        UnaryOp::Swap => signed(pattern.swap_bytes() >> (64 - bits), bits),
        UnaryOp::Opposite => signed(pattern.reverse_bits() >> (64 - bits), bits),
        UnaryOp::BinToBcd => {
            let magnitude = i64::from(value).abs();
            (0..4).map(|n| (magnitude / 10_i64.pow(n) % 10) << (8 * n)).sum()
        }
        UnaryOp::BcdToBin => pattern
            .to_le_bytes()
            .into_iter()
            .take(4)
            .zip(0..)
            .map(|(byte, n)| i64::from(byte & 0xF) * 10_i64.pow(n))
            .sum(),
    }
}

/// A shift or rotation of a number of `bits` bits.
pub(crate) fn shift(op: ShiftOp, value: i32, bits: u32, count: i32) -> i64 {
    let pattern = unsigned(value, bits);
    let count = count.max(0) as u32;
    match op {
        _ if count == 0 => value.into(),
        // What is stored has at most 32 bits.
        ShiftOp::Shl => i64::from(value).checked_shl(count).unwrap_or(0),
        ShiftOp::Shr => i64::from(value) >> count.min(63),
        ShiftOp::Sr0 => pattern.checked_shr(count).unwrap_or(0) as i64,
        ShiftOp::Rol => rotate_left(pattern, bits, count % bits),
        ShiftOp::Ror => rotate_left(pattern, bits, (bits - count % bits) % bits),
    }
}

fn rotate_left(pattern: u64, bits: u32, count: u32) -> i64 {
    signed(pattern << count | pattern >> (bits - count), bits)
}

/// A number with one bit changed; bits beyond 32 change nothing that is stored.
pub(crate) fn with_bit(value: i32, bit: i32, to: bool) -> i64 {
    let mask = if (0..32).contains(&bit) { 1_i64 << bit } else { 0 };
    if to { i64::from(value) | mask } else { i64::from(value) & !mask }
}

/// One bit of a number; beyond its width it is the sign, below 0 there is none.
pub(crate) fn has_bit(value: i32, bit: i32) -> bool {
    bit >= 0 && i64::from(value) >> bit.min(63) & 1 == 1
}

/// The low byte of a number with its bits in other places; of two bits for one place the higher counts.
pub(crate) fn route_bits(value: i32, targets: [u8; 8]) -> i64 {
    (0..).zip(targets).fold(0, |out, (n, to)| out & !(1 << to) | i64::from(has_bit(value, n)) << to)
}

/// The character that a code means, and its segments; complemented for a common anode.
pub(crate) fn segments(display: SegmentDisplay, source: i32, inverted: bool) -> (i32, i64) {
    let code = match source {
        176 => 128,
        0..=128 => source,
        _ => 32,
    };
    let lit = display.characters().get(code as usize).map_or(0, |lit| i64::from(*lit));
    (code, if inverted { !lit } else { lit })
}
