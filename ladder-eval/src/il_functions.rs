//! Standard functions of Instruction List: section 6.3 of `docs/semantics.md`.

use ladder::il::IlFunction;

use crate::flat_program::ScanState;
use crate::il_ops::{FlatOperand, NumberType, combine};

/// A call of a function with its arguments resolved.
#[derive(Debug, Clone)]
pub(crate) struct FlatFunction {
    /// The function.
    pub function: IlFunction,
    /// Its arguments, in the order of their names.
    pub arguments: Vec<FlatOperand>,
    /// Type of the arguments.
    pub number: NumberType,
    /// Type of the value.
    pub result: NumberType,
}

impl ScanState {
    /// The value of a function (I16 to I20).
    pub(crate) fn function_value(&self, call: &FlatFunction) -> i64 {
        let number = call.number;
        let whole = |index: usize| call.arguments.get(index).map_or(0, |argument| self.il_value(*argument));
        let argument = |index: usize| number.modulo(whole(index));
        let all = || (0..call.arguments.len()).map(argument);
        let value = match call.function {
            IlFunction::Operator(operator) if operator.is_comparison() => {
                let numbers: Vec<i64> = all().collect();
                let holds = |pair: &[i64]| combine(operator, pair[0], pair[1], number) != 0;
                i64::from(numbers.windows(2).all(holds))
            }
            IlFunction::Operator(operator) => all().reduce(|a, b| combine(operator, a, b, number)).unwrap_or(0),
            IlFunction::Absolute => argument(0).abs(),
            IlFunction::Move | IlFunction::Convert if call.result != NumberType::BIT => argument(0),
            IlFunction::Move | IlFunction::Convert => i64::from(argument(0) != 0),
            IlFunction::Maximum => all().max().unwrap_or(0),
            IlFunction::Minimum => all().min().unwrap_or(0),
            IlFunction::Limit => argument(1).max(argument(0)).min(argument(2)),
            IlFunction::Select => argument(if whole(0) == 0 { 1 } else { 2 }),
            IlFunction::Multiplex => {
                let last = call.arguments.len() as i64 - 2;
                argument(1 + whole(0).clamp(0, last.max(0)) as usize)
            }
            IlFunction::ShiftLeft => shifted(argument(0), whole(1), number, |bits, n| bits << n),
            IlFunction::ShiftRight => shifted(argument(0), whole(1), number, |bits, n| bits >> n),
            IlFunction::RotateLeft => rotated(argument(0), whole(1), number),
            IlFunction::RotateRight if whole(1) < 0 => argument(0),
            IlFunction::RotateRight => rotated(argument(0), width(number) - whole(1) % width(number), number),
        };
        call.result.modulo(value)
    }
}

fn width(number: NumberType) -> i64 {
    i64::from(number.bits)
}

/// Moves bits by `count` places with zeros (I19).
fn shifted(bits: i64, count: i64, number: NumberType, shift: impl Fn(i64, i64) -> i64) -> i64 {
    match count {
        ..0 => bits,
        _ if count >= width(number) => 0,
        _ => shift(bits, count),
    }
}

/// Rotates bits to the left (I19).
fn rotated(bits: i64, count: i64, number: NumberType) -> i64 {
    if count < 0 {
        return bits;
    }
    let by = count % width(number);
    bits << by | bits >> (width(number) - by)
}
