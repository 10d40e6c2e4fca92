//! Types of operands and of targets of writes.

use diag::{Pos, nearest};

use super::super::codes;
use super::super::flow::ResultType;
use super::super::literals::literal_text;
use super::super::model::{IlOperand, IlOperandKind, IlQualifier, IlSection};
use super::super::types::{
    AddressArea, AddressSize, BlockPart, DirectAddress, IecType, IlLiteral, IlValue, StandardBlock,
};
use super::IlChecker;

impl<'a> IlChecker<'a> {
    /// Returns the variable with this name.
    pub(super) fn variable(&self, name: &str) -> Option<&'a super::super::model::IlVariable> {
        let index = self.variables.get(&name.to_ascii_uppercase())?;
        self.program.variables.get(*index)
    }

    /// Returns the name of the operand if it is an instance of a block.
    pub(super) fn instance_operand<'b>(&self, operand: &'b IlOperand) -> Option<&'b str> {
        let IlOperandKind::Variable { name, member: None } = &operand.kind else { return None };
        self.block_of(name).map(|_| name.as_str())
    }

    /// Returns the standard block of an instance, declared or implied by the short form.
    pub(super) fn block_of(&self, instance: &str) -> Option<StandardBlock> {
        match self.variable(instance) {
            Some(variable) => match variable.iec_type {
                IecType::Block(block) => Some(block),
                _ => None,
            },
            None => self.implied_blocks.get(&instance.to_ascii_uppercase()).copied(),
        }
    }

    /// Returns an input or output of an instance; `None` if it has none of this name.
    pub(super) fn block_part(&self, instance: &str, part: &str) -> Option<BlockPart> {
        self.block_of(instance)?.part(part)
    }

    /// Returns the type of an operand that is read.
    pub(super) fn value_of(&mut self, operand: &IlOperand) -> ResultType {
        match &operand.kind {
            IlOperandKind::Variable { name, member: Some(member) } => self
                .part_of(name, member, operand.pos)
                .map_or(ResultType::Unknown, |part| ResultType::Of(part.iec_type())),
            IlOperandKind::Variable { name, member: None } => self.variable_type(name, operand.pos),
            IlOperandKind::Address(address) => address_type(address),
            IlOperandKind::Literal(literal) => self.literal_type(literal, operand.pos),
        }
    }

    fn variable_type(&mut self, name: &str, pos: Pos) -> ResultType {
        if let Some(variable) = self.variable(name) {
            if variable.iec_type.is_block() {
                let cause = format!("`{name}` is an instance of {}", variable.iec_type.keyword());
                self.error(codes::IL_TYPE, pos, cause, &format!("name an output, such as {name}.Q"));
                return ResultType::Unknown;
            }
            return ResultType::Of(variable.iec_type.clone());
        }
        if self.implied_blocks.contains_key(&name.to_ascii_uppercase()) {
            return super::BOOL; // its output Q
        }
        self.check_declared(name, pos, "BOOL");
        ResultType::Unknown
    }

    /// Reports a name that is not declared, if the program has declarations: at the first place where it is
    /// used. `example` is a type for the hint.
    pub(super) fn check_declared(&mut self, name: &str, pos: Pos, example: &str) {
        let upper = name.to_ascii_uppercase();
        let is_known = self.variables.contains_key(&upper) || self.implied_blocks.contains_key(&upper);
        if is_known || self.variables.is_empty() || self.is_reporting && !self.undeclared.insert(upper) {
            return;
        }
        let names = self.program.variables.iter().map(|variable| variable.name.text.as_str());
        let other = format!("declare it, for example `{name} : {example};`");
        let hint = nearest(name, names).map_or(other, |meant| format!("did you mean {meant}?"));
        self.error(codes::IL_UNDECLARED, pos, format!("`{name}` is not declared"), &hint);
    }

    /// Returns the input or output of an instance; reports one that the block does not have.
    pub(super) fn part_of(&mut self, instance: &str, member: &str, pos: Pos) -> Option<BlockPart> {
        let Some(block) = self.block_of(instance) else {
            match self.variable(instance) {
                Some(variable) if !variable.iec_type.is_block() => {
                    let cause = format!("`{instance}` is {}, not a block", variable.iec_type.keyword());
                    self.error(codes::IL_TYPE, pos, cause, "only instances of blocks have inputs and outputs");
                }
                _ => self.check_declared(instance, pos, "TON"),
            }
            return None;
        };
        let part = block.part(member);
        if part.is_none() {
            let names: Vec<&str> = block.parts().iter().map(|part| part.name).collect();
            let cause = format!("{} has no `{member}`", block.keyword());
            self.error(codes::IL_BLOCK_PART, pos, cause, &format!("it has {}", names.join(", ")));
        }
        part
    }

    /// Returns the type of a variable or an address that is written; reports one that cannot be written.
    pub(super) fn target_of(&mut self, target: &IlOperand) -> ResultType {
        let text = super::super::write::operand_text(target);
        let refusal = match &target.kind {
            IlOperandKind::Variable { name, member: Some(member) } => {
                let part = self.block_part(name, member);
                part.filter(|part| !part.is_input).map(|_| format!("`{text}` is an output of the block"))
            }
            IlOperandKind::Variable { name, member: None } => match self.variable(name) {
                Some(variable) if variable.qualifier == Some(IlQualifier::Constant) => {
                    Some(format!("`{text}` is a constant"))
                }
                Some(variable) if variable.section == IlSection::Input => Some(format!("`{text}` is an input")),
                Some(variable) if variable.address.as_ref().is_some_and(|a| a.area == AddressArea::Input) => {
                    Some(format!("`{text}` is at an input address"))
                }
                _ => None,
            },
            IlOperandKind::Address(address) if address.area == AddressArea::Input => {
                Some(format!("`{text}` is an input address"))
            }
            IlOperandKind::Literal(_) => Some(format!("`{text}` is a literal")),
            IlOperandKind::Address(_) => None,
        };
        if let Some(cause) = refusal {
            self.error(codes::IL_READ_ONLY, target.pos, cause, "write an output, a memory address or a VAR");
        }
        self.value_of(target)
    }

    /// Returns the type of a literal; reports one that does not fit its prefix.
    pub(super) fn literal_type(&mut self, literal: &IlLiteral, pos: Pos) -> ResultType {
        let typed = literal.prefix.clone().map(ResultType::Of);
        match literal.value {
            IlValue::Bool(_) => typed.unwrap_or(super::BOOL),
            IlValue::Time(_) => ResultType::Of(IecType::Time),
            IlValue::Integer { value, .. } => {
                let number = ResultType::Number(Some(value));
                if let (Some(typed), Some(range)) = (&typed, literal.prefix.as_ref().and_then(IecType::range)) {
                    if !range.contains(&value) {
                        let cause = format!("{} is not in {} to {}", literal_text(literal), range.start(), range.end());
                        self.error(codes::IL_RANGE, pos, cause, "give a number in the range of the type");
                    }
                    return typed.clone();
                }
                number
            }
        }
    }
}

fn address_type(address: &DirectAddress) -> ResultType {
    match address.size {
        None | Some(AddressSize::Bit) => super::BOOL,
        Some(size) => ResultType::Sized(size.bits()),
    }
}
