//! Checks of calls of blocks and functions.

use diag::Pos;

use super::super::codes;
use super::super::flow::ResultType;
use super::super::functions::{FunctionKind, StandardFunction, function};
use super::super::model::{IlBinaryOperator, IlName, IlOperand, IlOperandKind, IlParameter};
use super::super::types::{BlockPart, IecType, IlLiteral, IlValue, StandardBlock};
use super::{BOOL, IlChecker};

impl IlChecker<'_> {
    /// Checks the parameters of CAL.
    pub(super) fn call(&mut self, instance: &IlName, parameters: &[IlParameter]) {
        self.check_declared(&instance.text, instance.pos, "TON");
        let block = self.block_of(&instance.text);
        let inputs: Vec<BlockPart> =
            block.map_or(Vec::new(), |block| block.parts().iter().copied().filter(|part| part.is_input).collect());
        for (index, parameter) in parameters.iter().enumerate() {
            match parameter {
                IlParameter::Positional(value) => {
                    let found = self.value_of(value);
                    let Some(block) = block else { continue };
                    match inputs.get(index) {
                        Some(part) => self.expect(&ResultType::Of(part.iec_type()), &found, value.pos, part.name),
                        None => {
                            let cause = format!("{} has {} inputs", block.keyword(), inputs.len());
                            self.error(codes::IL_BLOCK_PART, value.pos, cause, "remove this parameter");
                        }
                    }
                }
                IlParameter::Input { name, value } => {
                    let found = self.value_of(value);
                    if let Some(part) = self.parameter_part(&instance.text, name, true) {
                        self.expect(&ResultType::Of(part.iec_type()), &found, value.pos, part.name);
                    }
                }
                IlParameter::Output { negated, name, target } => {
                    let place = self.target_of(target);
                    if let Some(part) = self.parameter_part(&instance.text, name, false) {
                        let found = ResultType::Of(part.iec_type());
                        if *negated {
                            self.expect_bits("NOT", &found, name.pos);
                        }
                        self.expect(&place, &found, target.pos, part.name);
                    }
                }
            }
        }
    }

    fn parameter_part(&mut self, instance: &str, name: &IlName, is_input: bool) -> Option<BlockPart> {
        let part = match self.block_of(instance) {
            Some(_) => self.part_of(instance, &name.text, name.pos)?,
            None => return None,
        };
        if part.is_input != is_input {
            let (cause, hint) = if is_input {
                (format!("{} is an output", part.name), "write => after the name of an output")
            } else {
                (format!("{} is an input", part.name), "write := after the name of an input")
            };
            self.error(codes::IL_BLOCK_PART, name.pos, cause, hint);
            return None;
        }
        Some(part)
    }

    /// Checks `CU C1`: the current result is stored in the input of the instance.
    pub(super) fn input_operator(&mut self, input: &str, instance: &str, result: &ResultType, pos: Pos) {
        self.check_declared(instance, pos, "TON");
        if self.block_of(instance).is_none() {
            return;
        }
        if let Some(part) = self.part_of(instance, input, pos) {
            self.expect(&ResultType::Of(part.iec_type()), result, pos, input);
        }
    }

    /// Checks the preset of `TON T1,100`. A number without type is in milliseconds for timers.
    pub(super) fn short_block(&mut self, block: StandardBlock, instance: &str, preset: &IlOperand, pos: Pos) {
        self.check_declared(instance, pos, "TON");
        let found = self.value_of(preset);
        let Some(part) = block.preset() else { return };
        if let IlOperandKind::Literal(IlLiteral { prefix: None, value: IlValue::Integer { value, .. } }) = &preset.kind
            && part.iec_type() == IecType::Time
        {
            if *value < 0 {
                let hint = "give a delay in milliseconds, or T#100ms";
                self.error(codes::IL_RANGE, preset.pos, format!("the delay {value} is negative"), hint);
            }
            return;
        }
        self.expect(&ResultType::Of(part.iec_type()), &found, preset.pos, part.name);
    }

    /// Checks a function and returns the type of its result.
    pub(super) fn function(
        &mut self,
        name: &IlName,
        parenthesized: bool,
        arguments: &[IlParameter],
        before: &ResultType,
        pos: Pos,
    ) -> ResultType {
        let result = if parenthesized { None } else { Some((self.used(before, pos), pos)) };
        let Some(function) = function(&name.text) else {
            for argument in arguments {
                let (IlParameter::Positional(value)
                | IlParameter::Input { value, .. }
                | IlParameter::Output { target: value, .. }) = argument;
                self.value_of(value);
            }
            let hint = "use a standard function; bodies of functions are not read";
            self.error(codes::IL_FUNCTION, name.pos, format!("the function {} is unknown", name.text), hint);
            return ResultType::Unknown;
        };
        let mut values: Vec<(ResultType, Pos)> = result.into_iter().collect();
        for argument in arguments {
            match argument {
                IlParameter::Positional(value) => values.push((self.value_of(value), value.pos)),
                IlParameter::Input { name, value } => self.named_argument(&function, name, value, &mut values),
                IlParameter::Output { name, .. } => {
                    let hint = "store the result with ST";
                    self.error(codes::IL_BLOCK_PART, name.pos, "a function has no outputs".to_owned(), hint);
                }
            }
        }
        if values.len() < function.least || values.len() > function.most {
            let cause = format!("{} takes {}, not {}", name.text, count_text(&function), values.len());
            let hint = "without parentheses the current result is the first argument";
            self.error(codes::IL_ARGUMENTS, name.pos, cause, hint);
            return ResultType::Unknown;
        }
        self.function_result(&name.text, &function.kind, &values)
    }

    /// Puts a named argument in its place.
    fn named_argument(
        &mut self,
        function: &StandardFunction,
        name: &IlName,
        value: &IlOperand,
        values: &mut Vec<(ResultType, Pos)>,
    ) {
        let found = (self.value_of(value), value.pos);
        let Some(index) = function.argument(&name.text) else {
            let hint = format!("the first arguments are {}", function.names.join(", "));
            self.error(codes::IL_BLOCK_PART, name.pos, format!("there is no argument `{}`", name.text), &hint);
            return;
        };
        let index = index.min(values.len());
        values.insert(index, found);
    }

    fn function_result(&mut self, name: &str, kind: &FunctionKind, values: &[(ResultType, Pos)]) -> ResultType {
        let common = |checker: &mut Self, values: &[(ResultType, Pos)]| {
            let mut all = values.first().map_or(ResultType::Unknown, |(first, _)| first.clone());
            for (value, pos) in values.iter().skip(1) {
                match all.unify(value) {
                    Ok(unified) => all = unified,
                    Err(mismatch) => checker.mismatch(&mismatch, &all, value, *pos, name),
                }
            }
            all
        };
        let first =
            |values: &[(ResultType, Pos)]| values.first().cloned().unwrap_or((ResultType::Unknown, Pos::default()));
        let (head, head_pos) = first(values);
        let rest = values.get(1..).unwrap_or(&[]);
        match kind {
            FunctionKind::Same => common(self, values),
            FunctionKind::Operator(operator) => self.operator_result(*operator, &head, rest),
            FunctionKind::Select => {
                self.expect(&BOOL, &head, head_pos, name);
                common(self, rest)
            }
            FunctionKind::Multiplex => {
                self.expect_integer(name, &head, head_pos);
                common(self, rest)
            }
            FunctionKind::Shift => {
                self.expect_bits(name, &head, head_pos);
                let (number, number_pos) = first(rest);
                self.expect_integer(name, &number, number_pos);
                head
            }
            FunctionKind::Convert(from, to) => {
                self.expect(&ResultType::Of(from.clone()), &head, head_pos, name);
                ResultType::Of(to.clone())
            }
        }
    }

    fn operator_result(
        &mut self,
        operator: IlBinaryOperator,
        first: &ResultType,
        rest: &[(ResultType, Pos)],
    ) -> ResultType {
        let mut result = first.clone();
        for (value, pos) in rest {
            let next = self.binary(operator, &result, value, *pos);
            // `LT a, b` compares neighbours: a with the current result, b with a.
            result = if operator.is_comparison() { value.clone() } else { next };
        }
        if operator.is_comparison() { BOOL } else { result }
    }

    fn expect_integer(&mut self, name: &str, value: &ResultType, pos: Pos) {
        if let ResultType::Of(iec_type) = value
            && !iec_type.is_integer()
        {
            let cause = format!("{name} needs an integer, but finds {}", iec_type.keyword());
            self.error(codes::IL_TYPE, pos, cause, "give an integer such as INT or USINT");
        }
    }
}

fn count_text(function: &StandardFunction) -> String {
    match (function.least, function.most) {
        (1, 1) => "1 argument".to_owned(),
        (least, most) if least == most => format!("{least} arguments"),
        (least, _) => format!("{least} arguments or more"),
    }
}
