//! Checks types along all paths: the current result, operands, parameters, targets of writes.
//!
//! IEC 61131-3, edition 2, converts no type implicitly, so the types of the current result and of an operand
//! must be equal. Numbers without a type take the type of the other side.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity};

use super::codes;
use super::flow::{LineTypes, ResultType, TypeMismatch, follow};
use super::model::{IlBinaryOperand, IlBinaryOperator, IlCondition, IlInstruction, IlOperand, IlOperation, IlProgram};
use super::types::{IecType, StandardBlock};

mod calls;
mod declared;
mod values;

/// Checks a program that was read without an error. Returns errors, warnings and notes in the order of their
/// positions.
#[must_use]
pub fn check(program: &IlProgram) -> Vec<Diagnostic> {
    let mut checker = IlChecker::new(program);
    let before = checker.follow().before;
    let (_, openers) = super::links::parentheses(program);
    checker.is_reporting = true;
    checker.check_declarations();
    for (index, line) in program.instructions.iter().enumerate() {
        let waiting = openers.get(&index).map(|opener| (*opener, &before[*opener]));
        checker.transfer(line, &before[index], waiting);
    }
    let mut diagnostics = checker.diagnostics;
    diagnostics.sort_by(|a, b| (a.pos, a.code).cmp(&(b.pos, b.code)));
    diagnostics.dedup();
    diagnostics
}

/// Returns the type of the current result after each line of the program.
#[must_use]
pub fn result_types(program: &IlProgram) -> Vec<ResultType> {
    IlChecker::new(program).follow().after
}

/// Returns the types of the current result before and after each line of the program.
pub(super) fn types_around(program: &IlProgram) -> LineTypes {
    IlChecker::new(program).follow()
}

const BOOL: ResultType = ResultType::Of(IecType::Bool);

struct IlChecker<'a> {
    program: &'a IlProgram,
    /// Index of each variable by its name in capitals.
    variables: BTreeMap<String, usize>,
    /// Blocks that the short form calls without a declaration.
    implied_blocks: BTreeMap<String, StandardBlock>,
    is_reporting: bool,
    /// Names in capitals that were reported as not declared.
    undeclared: BTreeSet<String>,
    diagnostics: Vec<Diagnostic>,
}

impl<'a> IlChecker<'a> {
    fn new(program: &'a IlProgram) -> Self {
        let names = program.variables.iter().enumerate();
        let variables = names.map(|(index, v)| (v.name.text.to_ascii_uppercase(), index)).collect();
        let short = program.instructions.iter().filter_map(|line| match &line.operation {
            Some(IlOperation::ShortBlock { block, instance, .. }) => Some((instance.text.to_ascii_uppercase(), *block)),
            _ => None,
        });
        let implied_blocks = short.collect();
        IlChecker {
            program,
            variables,
            implied_blocks,
            is_reporting: false,
            undeclared: BTreeSet::new(),
            diagnostics: Vec::new(),
        }
    }

    fn follow(&mut self) -> LineTypes {
        let program = self.program;
        follow(program, |index, before, waiting| self.transfer(&program.instructions[index], before, waiting))
    }

    fn report(&mut self, severity: Severity, code: &'static str, pos: Pos, cause: String, hint: &str) {
        if self.is_reporting {
            self.diagnostics.push(Diagnostic::new(severity, code, &self.program.file, pos, cause, hint));
        }
    }

    fn error(&mut self, code: &'static str, pos: Pos, cause: String, hint: &str) {
        self.report(Severity::Error, code, pos, cause, hint);
    }

    /// Returns the type of the current result for use by an operator; reports one that has no value.
    fn used(&mut self, result: &ResultType, pos: Pos) -> ResultType {
        let (severity, code, cause, hint) = match result {
            ResultType::NotLoaded => (
                Severity::Error,
                codes::IL_NOT_LOADED,
                "the current result has no value here",
                "load a value with LD first",
            ),
            ResultType::AfterCall(kept) if **kept == ResultType::NotLoaded => return self.used(kept, pos),
            ResultType::AfterCall(_) => (
                Severity::Warning,
                codes::IL_AFTER_CALL,
                "the current result is not defined after CAL",
                "load a value with LD after CAL",
            ),
            ResultType::Mixed => (
                Severity::Note,
                codes::IL_MIXED,
                "the current result has another type on each path to here",
                "load a value with LD after the label",
            ),
            value => return value.clone(),
        };
        self.report(severity, code, pos, cause.to_owned(), hint);
        match result {
            ResultType::AfterCall(kept) if kept.is_value() => (**kept).clone(),
            _ => ResultType::Unknown,
        }
    }

    /// Checks a line and returns the type after it. `waiting` is the line of the operator that
    /// waits for this `)`, and the type before it.
    fn transfer(
        &mut self,
        line: &IlInstruction,
        before: &ResultType,
        waiting: Option<(usize, &ResultType)>,
    ) -> ResultType {
        let Some(operation) = &line.operation else { return before.clone() };
        if *before == ResultType::Unreached {
            return ResultType::Unreached;
        }
        let pos = line.pos;
        match operation {
            IlOperation::Load { negated, operand } => self.load(*negated, operand, before, pos),
            IlOperation::Store { negated, target } => self.store(*negated, target, before, pos),
            IlOperation::Set(target) => self.set_or_reset("S", target, before, pos),
            IlOperation::Reset(target) => self.set_or_reset("R", target, before, pos),
            IlOperation::NoTarget { .. } => self.used(before, pos),
            IlOperation::Not => {
                let result = self.used(before, pos);
                self.expect_bits("NOT", &result, pos);
                result
            }
            IlOperation::Binary { operator, operand, .. } => match operand {
                IlBinaryOperand::Value(operand) => {
                    let result = self.used(before, pos);
                    let value = self.value_of(operand);
                    self.binary(*operator, &result, &value, operand.pos)
                }
                IlBinaryOperand::Deferred(operand) => {
                    self.used(before, pos);
                    operand.as_ref().map_or(ResultType::NotLoaded, |operand| self.value_of(operand))
                }
            },
            IlOperation::Close => self.close(before, waiting, pos),
            IlOperation::Jump { condition, .. } | IlOperation::Return(condition) => {
                self.condition(*condition, before, pos);
                before.clone()
            }
            IlOperation::Call { condition, instance, parameters } => {
                self.condition(*condition, before, pos);
                self.call(instance, parameters);
                match before {
                    ResultType::AfterCall(_) => before.clone(),
                    kept => ResultType::AfterCall(Box::new(kept.clone())),
                }
            }
            IlOperation::BlockInput { input, instance } => {
                let result = self.used(before, pos);
                self.input_operator(input.keyword(), &instance.text, &result, instance.pos);
                before.clone()
            }
            IlOperation::ShortBlock { block, instance, preset } => {
                let result = self.used(before, pos);
                self.expect(&BOOL, &result, pos, block.keyword());
                self.short_block(*block, &instance.text, preset, instance.pos);
                before.clone()
            }
            IlOperation::Function { name, parenthesized, arguments } => {
                self.function(name, *parenthesized, arguments, before, pos)
            }
        }
    }

    fn load(&mut self, negated: bool, operand: &IlOperand, before: &ResultType, pos: Pos) -> ResultType {
        if let Some(instance) = self.instance_operand(operand)
            && self.block_part(instance, "LD").is_some_and(|part| part.is_input)
            && !negated
        {
            // `LD C1` sets the input LD of a down counter.
            let result = self.used(before, pos);
            self.expect(&BOOL, &result, pos, "LD");
            return before.clone();
        }
        let value = self.value_of(operand);
        if negated {
            self.expect_bits("LDN", &value, operand.pos);
        }
        value
    }

    fn store(&mut self, negated: bool, target: &IlOperand, before: &ResultType, pos: Pos) -> ResultType {
        let result = self.used(before, pos);
        if negated {
            self.expect_bits("STN", &result, pos);
        }
        let place = self.target_of(target);
        self.expect(&place, &result, target.pos, "ST");
        before.clone()
    }

    fn set_or_reset(&mut self, operator: &str, target: &IlOperand, before: &ResultType, pos: Pos) -> ResultType {
        let result = self.used(before, pos);
        self.expect(&BOOL, &result, pos, operator);
        if let Some(instance) = self.instance_operand(target)
            && self.block_part(instance, operator).is_some_and(|part| part.is_input)
        {
            return before.clone();
        }
        let place = self.target_of(target);
        self.expect(&BOOL, &place, target.pos, operator);
        before.clone()
    }

    fn condition(&mut self, condition: IlCondition, before: &ResultType, pos: Pos) {
        if condition != IlCondition::Always {
            let result = self.used(before, pos);
            self.expect(&BOOL, &result, pos, "a conditional operator");
        }
    }

    fn close(&mut self, inner: &ResultType, waiting: Option<(usize, &ResultType)>, pos: Pos) -> ResultType {
        let inner = self.used(inner, pos);
        let Some((opener, outer)) = waiting else { return inner };
        // The line of the operator reported a result without a value.
        let outer = match outer {
            ResultType::AfterCall(kept) if kept.is_value() => (**kept).clone(),
            outer if outer.is_value() => outer.clone(),
            _ => ResultType::Unknown,
        };
        match &self.program.instructions[opener].operation {
            Some(IlOperation::Binary { operator, .. }) => self.binary(*operator, &outer, &inner, pos),
            _ => inner,
        }
    }

    /// Returns the type of `result operator value`.
    fn binary(&mut self, operator: IlBinaryOperator, result: &ResultType, value: &ResultType, pos: Pos) -> ResultType {
        let is_scaled_time = matches!(operator, IlBinaryOperator::Mul | IlBinaryOperator::Div)
            && *result == ResultType::Of(IecType::Time)
            && match value {
                ResultType::Number(_) | ResultType::Sized(_) | ResultType::Unknown => true,
                ResultType::Of(iec_type) => iec_type.is_integer(),
                _ => false,
            };
        if is_scaled_time {
            return result.clone();
        }
        let keyword = operator.keyword();
        let unified = match result.unify(value) {
            Ok(unified) => unified,
            Err(mismatch) => {
                self.mismatch(&mismatch, result, value, pos, keyword);
                return if operator.is_comparison() { BOOL } else { ResultType::Unknown };
            }
        };
        if operator.is_comparison() {
            return BOOL;
        }
        if operator.is_logic() {
            self.expect_bits(keyword, &unified, pos);
        } else if let ResultType::Of(iec_type) = &unified {
            let takes_time = matches!(operator, IlBinaryOperator::Add | IlBinaryOperator::Sub);
            if !(iec_type.is_integer() || takes_time && *iec_type == IecType::Time) {
                let cause = format!("{keyword} does not take {}", iec_type.keyword());
                self.error(codes::IL_TYPE, pos, cause, "give integers; ADD and SUB also take TIME");
                return ResultType::Unknown;
            }
        }
        unified
    }

    fn expect_bits(&mut self, operator: &str, result: &ResultType, pos: Pos) {
        if let ResultType::Of(iec_type) = result
            && !iec_type.is_bit_string()
        {
            let cause = format!("{operator} does not take {}", iec_type.keyword());
            self.error(codes::IL_TYPE, pos, cause, "give BOOL, BYTE, WORD or DWORD, or convert with INT_TO_WORD");
        }
    }

    /// Checks that `found` fits `wanted`.
    fn expect(&mut self, wanted: &ResultType, found: &ResultType, pos: Pos, operator: &str) {
        if let Err(mismatch) = wanted.unify(found) {
            self.mismatch(&mismatch, wanted, found, pos, operator);
        }
    }

    fn mismatch(&mut self, mismatch: &TypeMismatch, wanted: &ResultType, found: &ResultType, pos: Pos, operator: &str) {
        if matches!(mismatch, TypeMismatch::Range) {
            let (number, other) =
                if matches!(wanted, ResultType::Number(_)) { (wanted, found) } else { (found, wanted) };
            let cause = format!("{operator}: {number} does not fit {other}");
            return self.error(codes::IL_RANGE, pos, cause, "give a number in the range of the type");
        }
        let hint = match (found, wanted) {
            (ResultType::Of(from), ResultType::Of(to)) if !from.is_block() && !to.is_block() => {
                format!("convert the operand: {}_TO_{}", from.keyword(), to.keyword())
            }
            _ => "give both sides the same type".to_owned(),
        };
        self.error(codes::IL_TYPE, pos, format!("{operator} needs {wanted}, but finds {found}"), &hint);
    }
}
