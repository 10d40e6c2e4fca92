//! Resolves operands, calls of blocks and calls of functions.

use diag::Pos;

use super::codes;
use super::flow::ResultType;
use super::functions::{FunctionKind, function};
use super::model::{IlCondition, IlName, IlOperand, IlOperandKind, IlParameter};
use super::resolve::{IlResolver, concrete};
use super::steps::{BlockCall, BlockOutput, FunctionCall, IlAction, IlFunction, IlSource, TypedSymbol};
use super::symbols::constant;
use super::types::{BlockPart, IecType, IlLiteral, IlValue, StandardBlock};
use super::write::operand_text;

/// A value and its type.
type TypedSource = (IlSource, ResultType);

impl IlResolver<'_> {
    /// Returns the input `part` of the instance that the operand names; `None` if it names none.
    pub(super) fn input_of(&self, operand: &IlOperand, part: &str) -> Option<BlockPart> {
        let IlOperandKind::Variable { name, member: None } = &operand.kind else { return None };
        self.table.block(name)?.part(part).filter(|part| part.is_input)
    }

    /// Returns the name of the instance in an operand.
    pub(super) fn instance_name(&self, operand: &IlOperand) -> String {
        match &operand.kind {
            IlOperandKind::Variable { name, .. } => name.clone(),
            _ => String::new(),
        }
    }

    /// Returns the symbol that an operand names; reports one that is unknown.
    pub(super) fn target(&mut self, operand: &IlOperand) -> Option<TypedSymbol> {
        let found = match &operand.kind {
            IlOperandKind::Variable { name, member: Some(member) } => self.table.part(name, member),
            IlOperandKind::Variable { name, member: None } => {
                // An instance of the short form names its output.
                self.table.symbol(name).or_else(|| self.table.part(name, "Q")).or_else(|| self.table.part(name, "QU"))
            }
            IlOperandKind::Address(address) => self.table.symbol_at(address),
            IlOperandKind::Literal(_) => None,
        };
        if found.is_none() {
            let cause = format!("`{}` is not declared", operand_text(operand));
            self.error(codes::IL_UNDECLARED, operand.pos, cause, "declare it between VAR and END_VAR");
        }
        found
    }

    /// Returns where an operand has its value, and its type.
    pub(super) fn source(&mut self, operand: &IlOperand) -> Option<TypedSource> {
        let IlOperandKind::Literal(literal) = &operand.kind else {
            let symbol = self.target(operand)?;
            let is_sized =
                matches!(&operand.kind, IlOperandKind::Address(address) if self.is_unnamed(address, &symbol));
            let bits = super::flow::size_of(&symbol.iec_type);
            let found =
                if is_sized && bits > 1 { ResultType::Sized(bits) } else { ResultType::Of(symbol.iec_type.clone()) };
            return Some((IlSource::Symbol(symbol), found));
        };
        let value = self.number(literal, operand.pos)?;
        let found = match (&literal.prefix, literal.value) {
            (Some(prefix), _) => ResultType::Of(prefix.clone()),
            (None, IlValue::Bool(_)) => ResultType::Of(IecType::Bool),
            (None, IlValue::Integer { .. }) => ResultType::Number(Some(value)),
            (None, IlValue::Time(_)) => ResultType::Of(IecType::Time),
        };
        Some((IlSource::Constant(value), found))
    }

    /// Whether the symbol at an address is the address itself, which takes the type of what it is used with.
    fn is_unnamed(&self, address: &super::types::DirectAddress, symbol: &TypedSymbol) -> bool {
        symbol.name == super::literals::address_text(address)
    }

    fn number(&mut self, literal: &IlLiteral, pos: Pos) -> Option<i64> {
        match constant(literal) {
            Ok(value) => Some(value),
            Err(why) => {
                let cause = format!("the duration {}: {why}", super::literals::literal_text(literal));
                self.error(codes::IL_MILLISECONDS, pos, cause, "give a whole number of milliseconds");
                None
            }
        }
    }

    /// Returns the instance and its block; reports a name that is none.
    fn instance(&mut self, name: &str, pos: Pos) -> Option<(String, StandardBlock)> {
        let block = self.table.block(name);
        if block.is_none() {
            let hint = format!("declare it, for example `{name} : TON;`");
            self.error(codes::IL_UNDECLARED, pos, format!("`{name}` is not declared"), &hint);
        }
        Some((self.table.spelling(name), block?))
    }

    /// Returns the call that an input operator makes: the current result is stored in the input.
    pub(super) fn input_call(&mut self, name: &str, input: &str, pos: Pos) -> Option<IlAction> {
        let (instance, block) = self.instance(name, pos)?;
        let part = self.table.part(name, input)?;
        let inputs = vec![(part, IlSource::Result)];
        let call = BlockCall { block, instance, inputs, outputs: Vec::new() };
        Some(IlAction::Call { condition: IlCondition::Always, call })
    }

    /// Returns the call of the short form: the current result is the first input, the number the preset.
    pub(super) fn short_call(&mut self, block: StandardBlock, name: &IlName, preset: &IlOperand) -> Option<IlAction> {
        let (instance, _) = self.instance(&name.text, name.pos)?;
        let Some(preset_part) = block.preset() else {
            let cause = format!("{} has no preset, so it has no short form", block.keyword());
            self.error(codes::IL_NOT_RUN, name.pos, cause, "declare the instance and call it with CAL");
            return None;
        };
        let first = self.table.part(&name.text, block.parts().first()?.name)?;
        let (source, _) = self.source(preset)?;
        if preset_part.iec_type() == IecType::Time
            && matches!(source, IlSource::Constant(value) if i32::try_from(value).is_err())
        {
            let cause = format!("the delay {} is longer than 2147483647 ms (24 days)", operand_text(preset));
            self.error(codes::IL_MILLISECONDS, preset.pos, cause, "give a shorter delay");
        }
        let second = self.table.part(&name.text, preset_part.name)?;
        let inputs = vec![(first, IlSource::Result), (second, source)];
        let call = BlockCall { block, instance, inputs, outputs: Vec::new() };
        Some(IlAction::Call { condition: IlCondition::Always, call })
    }

    /// Returns the call of CAL.
    pub(super) fn block_call(&mut self, name: &IlName, parameters: &[IlParameter]) -> Option<BlockCall> {
        let (instance, block) = self.instance(&name.text, name.pos)?;
        let mut call = BlockCall { block, instance, inputs: Vec::new(), outputs: Vec::new() };
        let mut inputs = block.parts().iter().filter(|part| part.is_input);
        for parameter in parameters {
            match parameter {
                IlParameter::Positional(value) => {
                    let part = self.table.part(&name.text, inputs.next()?.name)?;
                    call.inputs.push((part, self.source(value)?.0));
                }
                IlParameter::Input { name: input, value } => {
                    let part = self.table.part(&name.text, &input.text)?;
                    call.inputs.push((part, self.source(value)?.0));
                }
                IlParameter::Output { negated, name: output, target } => {
                    let part = self.table.part(&name.text, &output.text)?;
                    let target = self.target(target)?;
                    call.outputs.push(BlockOutput { part, negated: *negated, target });
                }
            }
        }
        Some(call)
    }

    /// Returns the call of a function. `first` is the type of the current result, if it is the first
    /// argument.
    pub(super) fn function_call(
        &mut self,
        name: &IlName,
        first: Option<ResultType>,
        arguments: &[IlParameter],
    ) -> Option<FunctionCall> {
        let standard = function(&name.text)?;
        let mut placed: Vec<(usize, TypedSource)> = Vec::new();
        if let Some(first) = first {
            placed.push((0, (IlSource::Result, first)));
        }
        for argument in arguments {
            match argument {
                IlParameter::Positional(value) => placed.push((placed.len(), self.source(value)?)),
                IlParameter::Input { name, value } => {
                    placed.push((standard.argument(&name.text)?, self.source(value)?))
                }
                IlParameter::Output { .. } => return None,
            }
        }
        placed.sort_by_key(|(index, _)| *index);
        if placed.iter().enumerate().any(|(wanted, (index, _))| *index != wanted) {
            let hint = "name all arguments up to the last one";
            self.error(codes::IL_ARGUMENTS, name.pos, format!("an argument of {} is missing", name.text), hint);
            return None;
        }
        let (arguments, types): (Vec<IlSource>, Vec<ResultType>) = placed.into_iter().map(|(_, value)| value).unzip();
        let common = |types: &[ResultType]| {
            let all = types.iter().skip(1).fold(types.first()?.clone(), |all, next| all.unify(next).unwrap_or(all));
            concrete(&all)
        };
        let (iec_type, result) = match &standard.kind {
            FunctionKind::Convert(from, to) => (from.clone(), to.clone()),
            FunctionKind::Same => same(common(&types)?),
            FunctionKind::Select | FunctionKind::Multiplex => same(common(types.get(1..)?)?),
            FunctionKind::Shift => same(common(types.get(..1)?)?),
            FunctionKind::Operator(operator) if operator.is_comparison() => (common(&types)?, IecType::Bool),
            FunctionKind::Operator(_) => {
                // TIME also multiplies and divides with an integer.
                let is_time = types.first()? == &ResultType::Of(IecType::Time);
                same(if is_time { IecType::Time } else { common(&types)? })
            }
        };
        let function = IlFunction::from_name(&name.text.to_ascii_uppercase())?;
        Some(FunctionCall { function, arguments, iec_type, result })
    }
}

/// The type of the arguments and of the value of a function for which they are equal.
fn same(iec_type: IecType) -> (IecType, IecType) {
    (iec_type.clone(), iec_type)
}
