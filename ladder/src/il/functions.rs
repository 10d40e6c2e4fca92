//! The standard functions with integer, bit string and duration arguments (IEC 61131-3, 2.5.1.5).

use super::model::IlBinaryOperator;
use super::types::IecType;

/// How the arguments and the result of a function are typed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum FunctionKind {
    /// All arguments and the result have one type.
    Same,
    /// An operator with more than one operand.
    Operator(IlBinaryOperator),
    /// BOOL, then arguments of one type, which is the type of the result.
    Select,
    /// An integer, then arguments of one type, which is the type of the result.
    Multiplex,
    /// A bit string and an integer; the result is the bit string.
    Shift,
    /// Conversion from one type to another.
    Convert(IecType, IecType),
}

/// A standard function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StandardFunction {
    /// What it computes.
    pub kind: FunctionKind,
    /// Names of the arguments; the last one repeats with rising numbers if it ends with a digit.
    pub names: &'static [&'static str],
    /// Smallest number of arguments.
    pub least: usize,
    /// Largest number of arguments.
    pub most: usize,
}

const MANY: usize = 1000;

/// Names of the functions that are no operators and no conversions.
const NAMED: [&str; 11] = ["ABS", "MOVE", "MAX", "MIN", "LIMIT", "SEL", "MUX", "SHL", "SHR", "ROL", "ROR"];

/// Returns the names of all standard functions: operators, selections, shifts and conversions.
pub fn standard_functions() -> impl Iterator<Item = String> {
    let pairs = IecType::elementary().flat_map(|from| IecType::elementary().map(move |to| (from.clone(), to)));
    let conversions = pairs.filter(|(from, to)| from != to);
    let conversions = conversions.map(|(from, to)| format!("{}_TO_{}", from.keyword(), to.keyword()));
    let operators = IlBinaryOperator::ALL.iter().map(|(_, keyword)| (*keyword).to_owned());
    NAMED.iter().map(|name| (*name).to_owned()).chain(operators).chain(conversions)
}

/// Returns the standard function with this name, in any case.
pub(super) fn function(name: &str) -> Option<StandardFunction> {
    let upper = name.to_ascii_uppercase();
    let make = |kind, names, least, most| Some(StandardFunction { kind, names, least, most });
    if let Some((operator, _)) = IlBinaryOperator::ALL.iter().find(|(_, keyword)| *keyword == upper) {
        let is_extensible = operator.is_logic()
            || operator.is_comparison() && *operator != IlBinaryOperator::Ne
            || matches!(operator, IlBinaryOperator::Add | IlBinaryOperator::Mul);
        return make(FunctionKind::Operator(*operator), &["IN1"], 2, if is_extensible { MANY } else { 2 });
    }
    match upper.as_str() {
        "ABS" | "MOVE" => make(FunctionKind::Same, &["IN"], 1, 1),
        "MAX" | "MIN" => make(FunctionKind::Same, &["IN1"], 2, MANY),
        "LIMIT" => make(FunctionKind::Same, &["MN", "IN", "MX"], 3, 3),
        "SEL" => make(FunctionKind::Select, &["G", "IN0"], 3, 3),
        "MUX" => make(FunctionKind::Multiplex, &["K", "IN0"], 3, MANY),
        "SHL" | "SHR" | "ROL" | "ROR" => make(FunctionKind::Shift, &["IN", "N"], 2, 2),
        _ => {
            let (from, to) = upper.split_once("_TO_")?;
            let (from, to) = (IecType::from_keyword(from)?, IecType::from_keyword(to)?);
            let kind = (from != to).then_some(FunctionKind::Convert(from, to))?;
            make(kind, &["IN"], 1, 1)
        }
    }
}

impl StandardFunction {
    /// Returns the index of the argument with this name, in any case.
    pub(super) fn argument(&self, name: &str) -> Option<usize> {
        let upper = name.to_ascii_uppercase();
        if let Some(index) = self.names.iter().position(|known| *known == upper) {
            return Some(index);
        }
        let (last, index) = (self.names.last()?, self.names.len() - 1);
        let (stem, first) = last.split_at(last.len() - 1);
        let first: usize = first.parse().ok()?;
        let number: usize = upper.strip_prefix(stem).filter(|digits| !digits.starts_with('0'))?.parse().ok()?;
        Some(index + number.checked_sub(first)?).filter(|index| *index < self.most)
    }
}
