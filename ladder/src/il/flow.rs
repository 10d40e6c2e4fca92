//! The type of the current result along all paths of a program.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::RangeInclusive;

use super::links::{label_lines, parentheses};
use super::model::{IlCondition, IlOperation, IlProgram};
use super::types::IecType;

/// What is known of the type of the current result.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResultType {
    /// No path leads here.
    Unreached,
    /// Nothing is loaded: at the beginning of the program, and after `(` without operand.
    NotLoaded,
    /// After CAL, where IEC 61131-3 does not define it. Here it keeps its value, of this type.
    AfterCall(Box<ResultType>),
    /// A number without type; its value if it is known. It takes the type of what it is used with.
    Number(Option<i64>),
    /// The content of an address with a size letter: any type of this number of bits.
    Sized(u32),
    /// A type.
    Of(IecType),
    /// A variable that is not declared, in a program without declarations.
    Unknown,
    /// Paths with different types meet here.
    Mixed,
}

impl fmt::Display for ResultType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ResultType::Unreached => f.write_str("unreached"),
            ResultType::NotLoaded => f.write_str("not loaded"),
            ResultType::AfterCall(_) => f.write_str("undefined after CAL"),
            ResultType::Number(Some(value)) => write!(f, "the number {value}"),
            ResultType::Number(None) => f.write_str("a number"),
            ResultType::Sized(bits) => write!(f, "{bits} bits"),
            ResultType::Of(iec_type) => f.write_str(iec_type.keyword()),
            ResultType::Unknown => f.write_str("unknown"),
            ResultType::Mixed => f.write_str("mixed"),
        }
    }
}

/// Why two types do not fit.
pub(super) enum TypeMismatch {
    /// The types differ.
    Types,
    /// The number does not fit the type.
    Range,
}

impl ResultType {
    /// Whether the operator can use the result: something is loaded, of one type.
    pub(super) fn is_value(&self) -> bool {
        matches!(self, ResultType::Number(_) | ResultType::Sized(_) | ResultType::Of(_) | ResultType::Unknown)
    }

    /// Returns the type of two values that are used together.
    pub(super) fn unify(&self, other: &ResultType) -> Result<ResultType, TypeMismatch> {
        use ResultType::{Number, Of, Sized, Unknown};
        let number_in = |value: &Option<i64>, range: RangeInclusive<i64>, unified: &ResultType| match value {
            Some(value) if !range.contains(value) => Err(TypeMismatch::Range),
            _ => Ok(unified.clone()),
        };
        match (self, other) {
            (Unknown, other) | (other, Unknown) => Ok(other.clone()),
            (Number(_), Number(_)) => Ok(Number(None)),
            (Number(value), typed @ Of(iec_type)) | (typed @ Of(iec_type), Number(value)) => match iec_type.range() {
                Some(range) => number_in(value, range, typed),
                None => Err(TypeMismatch::Types),
            },
            (Number(value), sized @ Sized(bits)) | (sized @ Sized(bits), Number(value)) => {
                let half = 1_i64 << (bits - 1).min(61);
                number_in(value, -half..=2 * half - 1, sized)
            }
            (Sized(bits), typed @ Of(iec_type)) | (typed @ Of(iec_type), Sized(bits)) if size_of(iec_type) == *bits => {
                Ok(typed.clone())
            }
            (a, b) if a == b => Ok(a.clone()),
            _ => Err(TypeMismatch::Types),
        }
    }

    /// Returns the type where two paths meet.
    fn join(&self, other: &ResultType) -> ResultType {
        use ResultType::{Mixed, Unknown, Unreached};
        match (self, other) {
            (Unreached, other) | (other, Unreached) => other.clone(),
            (a, b) if a == b => a.clone(),
            (a, b) if !a.is_value() || !b.is_value() => Mixed,
            (Unknown, _) | (_, Unknown) => Unknown,
            (a, b) => a.unify(b).unwrap_or(Mixed),
        }
    }
}

/// Returns the number of bits of an elementary type, 0 for a block.
pub(super) fn size_of(iec_type: &IecType) -> u32 {
    match iec_type {
        IecType::Bool => 1,
        IecType::Sint | IecType::Usint | IecType::Byte => 8,
        IecType::Int | IecType::Uint | IecType::Word => 16,
        IecType::Dint | IecType::Udint | IecType::Dword | IecType::Time => 32,
        IecType::Block(_) | IecType::Named(_) => 0,
    }
}

/// Types of the result before and after each line.
pub(super) struct LineTypes {
    /// Before each line.
    pub before: Vec<ResultType>,
    /// After each line.
    pub after: Vec<ResultType>,
}

/// Follows all paths. `transfer` returns the type after the line with this index from the type before it and,
/// for `)`, the line of the operator that waits and the type before it.
pub(super) fn follow(
    program: &IlProgram,
    mut transfer: impl FnMut(usize, &ResultType, Option<(usize, &ResultType)>) -> ResultType,
) -> LineTypes {
    let lines = &program.instructions;
    let (_, openers) = parentheses(program);
    let labels = label_lines(program);
    let closers: BTreeMap<usize, usize> = openers.iter().map(|(closer, opener)| (*opener, *closer)).collect();
    let mut before = vec![ResultType::Unreached; lines.len()];
    let mut after = before.clone();
    let mut work = BTreeSet::new();
    if let Some(first) = before.first_mut() {
        *first = ResultType::NotLoaded;
        work.insert(0);
    }
    while let Some(index) = work.pop_first() {
        let waiting = openers.get(&index).map(|opener| (*opener, &before[*opener]));
        after[index] = transfer(index, &before[index], waiting);
        // The operation that waits is executed with the type before its operator.
        work.extend(closers.get(&index).filter(|closer| before[**closer] != ResultType::Unreached));
        let operation = lines[index].operation.as_ref();
        let jump = match operation {
            Some(IlOperation::Jump { label, .. }) => labels.get(&label.text.to_ascii_uppercase()).copied(),
            _ => None,
        };
        // A jump back is not taken once the scan has taken all that it may.
        let is_end = match operation {
            Some(IlOperation::Jump { condition: IlCondition::Always, .. }) => jump.is_none_or(|target| target > index),
            Some(IlOperation::Return(IlCondition::Always)) => true,
            _ => false,
        };
        let next = Some(index + 1).filter(|next| !is_end && *next < lines.len());
        for target in jump.into_iter().chain(next) {
            let joined = before[target].join(&after[index]);
            if joined != before[target] {
                before[target] = joined;
                work.insert(target);
            }
        }
    }
    LineTypes { before, after }
}
