//! Names of a program without declarations, as in reference 001: what each of them is.

use std::collections::{BTreeMap, BTreeSet};

use diag::Pos;

use super::model::{
    IlBinaryOperand, IlName, IlOperand, IlOperandKind, IlOperation, IlParameter, IlProgram, IlSection, IlVariable,
};
use super::types::IecType;

/// Returns the program with a declaration for each name, if it has none, and the number of variables that the
/// text declares.
///
/// All names are BOOL. A name that nothing writes is an input. A written name is an output, or a relay if it
/// is M, R or F and digits.
pub(super) fn with_implied_names(program: &IlProgram) -> (IlProgram, usize) {
    let declared = program.variables.len();
    let mut complete = program.clone();
    if declared > 0 {
        return (complete, declared);
    }
    let operations = || program.instructions.iter().filter_map(|line| line.operation.as_ref());
    let instances: BTreeSet<String> = operations()
        .filter_map(|operation| match operation {
            IlOperation::ShortBlock { instance, .. }
            | IlOperation::Call { instance, .. }
            | IlOperation::BlockInput { instance, .. } => Some(instance.text.to_ascii_uppercase()),
            _ => None,
        })
        .collect();
    let mut names: BTreeMap<String, (String, Pos, bool)> = BTreeMap::new();
    for operation in operations() {
        for_each_operand(operation, &mut |operand, is_written| {
            let IlOperandKind::Variable { name, member: None } = &operand.kind else { return };
            let upper = name.to_ascii_uppercase();
            if !instances.contains(&upper) {
                names.entry(upper).or_insert((name.clone(), operand.pos, false)).2 |= is_written;
            }
        });
    }
    let mut names: Vec<_> = names.into_iter().collect();
    names.sort_by_key(|(_, (_, pos, _))| *pos);
    complete.variables = names
        .into_iter()
        .map(|(upper, (text, pos, is_written))| IlVariable {
            name: IlName { text, pos },
            section: match (is_written, is_relay(&upper)) {
                (false, _) => IlSection::Input,
                (true, true) => IlSection::Local,
                (true, false) => IlSection::Output,
            },
            qualifier: None,
            iec_type: IecType::Bool,
            address: None,
            initial: None,
            comment: None,
        })
        .collect();
    (complete, declared)
}

/// Whether the name, in capitals, is M, R or F and digits.
fn is_relay(upper: &str) -> bool {
    let digits = upper.strip_prefix(['M', 'R', 'F']);
    digits.is_some_and(|digits| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit()))
}

/// Calls `each` for every operand, and with true for one that is written.
pub(super) fn for_each_operand(operation: &IlOperation, each: &mut dyn FnMut(&IlOperand, bool)) {
    match operation {
        IlOperation::Load { operand, .. }
        | IlOperation::Binary {
            operand: IlBinaryOperand::Value(operand) | IlBinaryOperand::Deferred(Some(operand)),
            ..
        }
        | IlOperation::ShortBlock { preset: operand, .. } => each(operand, false),
        IlOperation::Store { target, .. } | IlOperation::Set(target) | IlOperation::Reset(target) => each(target, true),
        IlOperation::Call { parameters, .. } | IlOperation::Function { arguments: parameters, .. } => {
            for parameter in parameters {
                match parameter {
                    IlParameter::Positional(value) | IlParameter::Input { value, .. } => each(value, false),
                    IlParameter::Output { target, .. } => each(target, true),
                }
            }
        }
        IlOperation::Binary { .. }
        | IlOperation::NoTarget { .. }
        | IlOperation::Not
        | IlOperation::Close
        | IlOperation::Jump { .. }
        | IlOperation::BlockInput { .. }
        | IlOperation::Return(_) => {}
    }
}
