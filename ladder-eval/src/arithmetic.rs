//! Arithmetic of the evaluator: exact results, cut to the width of the integer that stores them.

use ladder::{CompareOp, MathOp};

/// Direction and bound of a counter (2.3, 5.3).
#[derive(Debug, Clone, Copy)]
pub(crate) enum CountMode {
    /// Up, without a bound.
    Up,
    /// Down, without a bound.
    Down,
    /// Up to the limit.
    UpTo,
    /// Down to the limit.
    DownTo,
    /// Release 2.3: up to the limit and then from 0 again; gives on what it gets.
    Circular,
    /// LDmicro 5: up past the limit and then from the start again, with a carry.
    UpAround,
    /// LDmicro 5: down past the limit and then from the start again, with a carry.
    DownAround,
}

/// Condition on the rung bit under which a counter counts.
#[derive(Debug, Clone, Copy)]
pub(crate) enum CountInput {
    /// On a rising edge.
    Rising,
    /// On a falling edge.
    Falling,
    /// In every scan in which it is 1.
    High,
    /// In every scan in which it is 0.
    Low,
}

/// Truncates an exact number to its low 32 - `cut` bits in two's complement.
pub(crate) fn truncate(exact: i64, cut: u8) -> i32 {
    (exact as i32) << cut >> cut
}

/// One step of a counter, exact, before what brings it back to its start.
pub(crate) fn count_step(kind: CountMode, n: i32, max: i32) -> i64 {
    let exact = i64::from(n);
    match kind {
        CountMode::Up | CountMode::UpAround => exact + 1,
        CountMode::Down | CountMode::DownAround => exact - 1,
        CountMode::UpTo => exact + i64::from(n < max),
        CountMode::DownTo => exact - i64::from(n > max),
        CountMode::Circular if n >= max => 0,
        CountMode::Circular => exact + 1,
    }
}

/// Exact arithmetic of sections 2.4 and 5.7. Only the low bytes are stored, so the width of the computation
/// does not matter.
pub(crate) fn math(op: MathOp, a: i64, b: i64) -> i64 {
    match op {
        MathOp::Add => a + b,
        MathOp::Sub => a - b,
        MathOp::Mul => a * b,
        MathOp::Div if b == 0 => {
            if a >= 0 {
                -1
            } else {
                1
            }
        }
        MathOp::Div => a / b,
        // What is left over when the quotient above is taken.
        MathOp::Mod if b == 0 => a,
        MathOp::Mod => a % b,
        MathOp::And => a & b,
        MathOp::Or => a | b,
        MathOp::Xor => a ^ b,
    }
}

/// Signed comparison of section 2.4.
pub(crate) fn compare(op: CompareOp, a: i32, b: i32) -> bool {
    match op {
        CompareOp::Equ => a == b,
        CompareOp::Neq => a != b,
        CompareOp::Grt => a > b,
        CompareOp::Geq => a >= b,
        CompareOp::Les => a < b,
        CompareOp::Leq => a <= b,
    }
}
