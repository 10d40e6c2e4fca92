//! C types of computed values: the usual arithmetic conversions (ISO C99, section 6.3.1.8), with `int` of two
//! bytes.

use emu_core::image::{BaseEncoding, CType, DebugInfo};

use super::c_objects::ObjectExpr;
use super::c_type_queries::CTypeRef;
use super::call_stack::CallStack;
use super::expression::{BinaryOperator, DebugExpression};

/// Size of `int` in bytes.
const INT_BYTES: u32 = 2;

/// The type of a number after integer promotion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ArithmeticType {
    /// An integer of two, four or eight bytes.
    Whole { bytes: u32, signed: bool },
    /// A floating-point number, with its type if the program defines it.
    Real(Option<CTypeRef>),
}

const INT: ArithmeticType = ArithmeticType::Whole { bytes: INT_BYTES, signed: true };

impl ArithmeticType {
    /// Returns the type of a literal.
    pub fn of_number(value: i64) -> ArithmeticType {
        let bytes = [2u32, 4].into_iter().find(|bytes| {
            let most = 1i64 << (8 * bytes - 1);
            (-most..most).contains(&value)
        });
        ArithmeticType::Whole { bytes: bytes.unwrap_or(8), signed: true }
    }

    fn of_object(object: &ObjectExpr) -> Option<ArithmeticType> {
        let promoted = |bytes: u32, signed: bool| match bytes {
            ..INT_BYTES => INT,
            _ => ArithmeticType::Whole { bytes, signed },
        };
        if let Some(bits) = object.bit_field().map(|bits| bits.size) {
            return Some(promoted(bits.div_ceil(8).max(1) - u32::from(bits < 16 && bits > 8), object.is_signed()));
        }
        match object.resolved_type()? {
            CType::Base { encoding: BaseEncoding::Float, .. } => Some(ArithmeticType::Real(Some(object.ctype))),
            CType::Base { bytes, .. } | CType::Enum { bytes, .. } if *bytes <= 8 => {
                Some(promoted(*bytes, object.is_signed()))
            }
            _ => None,
        }
    }

    /// Returns the type of an expression; `None` if it is no number of C, such as a register of the chip.
    pub fn of(expr: &DebugExpression) -> Option<ArithmeticType> {
        match expr {
            DebugExpression::Number(value) => Some(ArithmeticType::of_number(*value)),
            DebugExpression::Real(_) => Some(ArithmeticType::Real(None)),
            DebugExpression::Object(object) => ArithmeticType::of_object(object),
            DebugExpression::Unary('!', _) => Some(INT),
            DebugExpression::Unary(_, of) => ArithmeticType::of(of),
            DebugExpression::Binary(operator, ..) if operator.is_truth() => Some(INT),
            DebugExpression::Binary(_, a, b) => Some(ArithmeticType::of(a)?.common(ArithmeticType::of(b)?)),
            DebugExpression::Choice(parts) => {
                Some(ArithmeticType::of(&parts[1])?.common(ArithmeticType::of(&parts[2])?))
            }
            DebugExpression::Place(_)
            | DebugExpression::At(..)
            | DebugExpression::Bit(..)
            | DebugExpression::Text(_) => None,
        }
    }

    fn common(self, other: ArithmeticType) -> ArithmeticType {
        use ArithmeticType::{Real, Whole};
        match (self, other) {
            (Real(a), Real(b)) => Real(a.or(b)),
            (Real(own), _) | (_, Real(own)) => Real(own),
            (Whole { bytes: a, signed: first }, Whole { bytes: b, signed: second }) => {
                let signed = if a == b {
                    first && second
                } else if a > b {
                    first
                } else {
                    second
                };
                Whole { bytes: a.max(b), signed }
            }
        }
    }

    /// Returns the C type.
    pub fn ctype(self) -> CTypeRef {
        let name = match self {
            ArithmeticType::Real(Some(own)) => return own,
            ArithmeticType::Real(None) => "double",
            ArithmeticType::Whole { bytes: ..=INT_BYTES, signed: true } => "int",
            ArithmeticType::Whole { bytes: ..=INT_BYTES, signed: false } => "unsigned int",
            ArithmeticType::Whole { bytes: ..=4, signed: true } => "long",
            ArithmeticType::Whole { bytes: ..=4, signed: false } => "unsigned long",
            ArithmeticType::Whole { signed: true, .. } => "long long",
            ArithmeticType::Whole { signed: false, .. } => "unsigned long long",
        };
        CTypeRef::new(DebugInfo::builtin_type(name))
    }
}

/// Returns true if an expression contains a C object.
fn has_object(expr: &DebugExpression) -> bool {
    matches!(expr, DebugExpression::Object(_)) || expr.operands().into_iter().any(has_object)
}

/// Returns a value converted to a type.
fn converted(calls: &CallStack, value: DebugExpression, kind: CTypeRef) -> DebugExpression {
    DebugExpression::Object(Box::new(ObjectExpr::value_of(calls.clone(), value, kind)))
}

/// Combines two operands; if a C object is among them, the result has the type that C gives it. Two numbers
/// are computed at once.
pub(super) fn binary(
    calls: Option<&CallStack>,
    operator: BinaryOperator,
    left: DebugExpression,
    right: DebugExpression,
) -> DebugExpression {
    if let (DebugExpression::Number(a), DebugExpression::Number(b)) = (&left, &right)
        && let Some(value) = operator.apply(*a, *b)
    {
        return DebugExpression::Number(value);
    }
    let plain = |left, right| DebugExpression::Binary(operator, Box::new(left), Box::new(right));
    let Some(calls) = calls.filter(|_| has_object(&left) || has_object(&right)) else { return plain(left, right) };
    let is_shift = matches!(operator, BinaryOperator::Shl | BinaryOperator::Shr);
    let types = ArithmeticType::of(&left).zip(ArithmeticType::of(&right));
    let Some(common) = types.map(|(a, b)| if is_shift { a } else { a.common(b) }) else { return plain(left, right) };
    let is_of_bits = is_shift
        || matches!(
            operator,
            BinaryOperator::Rem | BinaryOperator::BitAnd | BinaryOperator::BitOr | BinaryOperator::BitXor
        );
    if is_of_bits && types.is_some_and(|(a, b)| [a, b].iter().any(|of| matches!(of, ArithmeticType::Real(_)))) {
        return plain(left, right);
    }
    // Operands need no conversion if the result is truncated to its type anyway.
    let matters = matches!(operator, BinaryOperator::Div | BinaryOperator::Rem)
        || operator.is_truth() && !matches!(operator, BinaryOperator::And | BinaryOperator::Or);
    let convert = |of: DebugExpression| match common {
        ArithmeticType::Whole { .. } if matters && ArithmeticType::of(&of) != Some(common) => {
            converted(calls, of, common.ctype())
        }
        _ => of,
    };
    let result = if operator.is_truth() { INT } else { common };
    converted(calls, plain(convert(left), convert(right)), result.ctype())
}

/// Applies `-`, `!` or `~`; the result has the type that C gives it.
pub(super) fn unary(calls: Option<&CallStack>, sign: char, of: DebugExpression) -> DebugExpression {
    if let DebugExpression::Number(value) = of {
        return DebugExpression::Number(match sign {
            '-' => value.wrapping_neg(),
            '!' => i64::from(value == 0),
            _ => !value,
        });
    }
    let kind = if sign == '!' { Some(INT) } else { ArithmeticType::of(&of) };
    let kind = kind.filter(|kind| sign != '~' || matches!(kind, ArithmeticType::Whole { .. }));
    let known = calls.filter(|_| has_object(&of)).zip(kind);
    let plain = DebugExpression::Unary(sign, Box::new(of));
    match known {
        Some((calls, kind)) => converted(calls, plain, kind.ctype()),
        None => plain,
    }
}
