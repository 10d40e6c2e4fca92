//! The symbols of a program: its variables, the instances of the short form, and addresses without a name.

use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};

use crate::symbol_kinds::SymbolKind;

use super::codes;
use super::flow::size_of;
use super::implied::for_each_operand;
use super::literals::address_text;
use super::model::{IlOperandKind, IlOperation, IlProgram, IlQualifier, IlSection, IlVariable};
use super::steps::{DurationError, IecVariable, TypedSymbol, milliseconds, part_symbol};
use super::types::{AddressArea, AddressSize, DirectAddress, IecType, IlLiteral, IlValue, StandardBlock};

/// All variables of a program, by name and by address.
pub(super) struct SymbolTable {
    variables: Vec<IecVariable>,
    by_name: BTreeMap<String, usize>,
    by_address: BTreeMap<DirectAddress, usize>,
}

impl SymbolTable {
    /// Collects the variables of a program, of which the text declares the first `declared`.
    pub(super) fn new(program: &IlProgram, declared: usize) -> (SymbolTable, Vec<Diagnostic>) {
        let (variables, by_name, by_address) = (Vec::new(), BTreeMap::new(), BTreeMap::new());
        let mut table = SymbolTable { variables, by_name, by_address };
        let mut faults = Vec::new();
        let mut error = |code, pos, cause: String, hint: &str| {
            faults.push(Diagnostic::new(Severity::Error, code, &program.file, pos, cause, hint));
        };
        for (index, variable) in program.variables.iter().enumerate() {
            if let Some(other) = variable.address.as_ref().and_then(|address| table.at(address, &variable.iec_type)) {
                let cause = format!("`{}` is at the address of `{}`", variable.name.text, other.name);
                error(codes::IL_NOT_RUN, variable.name.pos, cause, "give each variable an address of its own");
            }
            let initial = match variable.initial.as_ref().map_or(Ok(0), constant) {
                Ok(initial) => initial,
                Err(why) => {
                    let cause = format!("the initial value of `{}`: {why}", variable.name.text);
                    error(codes::IL_MILLISECONDS, variable.name.pos, cause, "give a number of milliseconds");
                    0
                }
            };
            table.add(declared_variable(variable, initial, index < declared));
        }
        for line in &program.instructions {
            let Some(IlOperation::ShortBlock { block, instance, .. }) = &line.operation else { continue };
            match table.block(&instance.text) {
                Some(other) if other != *block => {
                    let cause =
                        format!("`{}` is {} here and {} before", instance.text, block.keyword(), other.keyword());
                    error(codes::IL_NOT_RUN, instance.pos, cause, "give each timer and counter a name of its own");
                }
                Some(_) => {}
                None => table.add(implied(instance.text.clone(), IecType::Block(*block), None, instance.pos)),
            }
        }
        table.add_addresses(program);
        (table, faults)
    }

    fn add(&mut self, variable: IecVariable) {
        let index = self.variables.len();
        self.by_name.entry(variable.name.to_ascii_uppercase()).or_insert(index);
        if let Some(address) = &variable.address {
            self.by_address.entry(sized(address, &variable.iec_type)).or_insert(index);
        }
        self.variables.push(variable);
    }

    /// Adds the addresses that the program uses without a name, in the order of their first use.
    fn add_addresses(&mut self, program: &IlProgram) {
        for operation in program.instructions.iter().filter_map(|line| line.operation.as_ref()) {
            for_each_operand(operation, &mut |operand, _| {
                let IlOperandKind::Address(address) = &operand.kind else { return };
                let iec_type = type_at(address);
                if self.at(address, &iec_type).is_none() {
                    let address = sized(address, &iec_type);
                    self.add(implied(address_text(&address), iec_type, Some(address), operand.pos));
                }
            });
        }
    }

    fn at(&self, address: &DirectAddress, iec_type: &IecType) -> Option<&IecVariable> {
        self.variables.get(*self.by_address.get(&sized(address, iec_type))?)
    }

    fn variable(&self, name: &str) -> Option<&IecVariable> {
        self.variables.get(*self.by_name.get(&name.to_ascii_uppercase())?)
    }

    /// Returns the symbol of a variable that is no instance.
    pub(super) fn symbol(&self, name: &str) -> Option<TypedSymbol> {
        let variable = self.variable(name)?;
        let kind = variable.kind?;
        Some(TypedSymbol { name: variable.name.clone(), kind, iec_type: variable.iec_type.clone() })
    }

    /// Returns the symbol at an address.
    pub(super) fn symbol_at(&self, address: &DirectAddress) -> Option<TypedSymbol> {
        self.at(address, &type_at(address)).and_then(|variable| self.symbol(&variable.name))
    }

    /// Returns the block of an instance.
    pub(super) fn block(&self, name: &str) -> Option<StandardBlock> {
        match self.variable(name)?.iec_type {
            IecType::Block(block) => Some(block),
            _ => None,
        }
    }

    /// Returns the spelling of an instance as it is declared.
    pub(super) fn spelling(&self, name: &str) -> String {
        self.variable(name).map_or_else(|| name.to_owned(), |variable| variable.name.clone())
    }

    /// Returns the symbol of an input or output of an instance.
    pub(super) fn part(&self, instance: &str, part: &str) -> Option<TypedSymbol> {
        let part = self.block(instance)?.part(part)?;
        Some(part_symbol(&self.spelling(instance), part.name, part.iec_type()))
    }

    /// Returns the notes about declarations.
    pub(super) fn notes(&self, file: &str) -> Vec<Diagnostic> {
        let mut notes = Vec::new();
        let mut note = |code, pos, cause: String, hint: &str| {
            notes.push(Diagnostic::new(Severity::Note, code, file, pos, cause, hint));
        };
        for variable in &self.variables {
            let area = variable.address.as_ref().map(|address| address.area);
            let is_at_pin = matches!(area, Some(AddressArea::Input | AddressArea::Output));
            if is_at_pin && variable.kind == Some(SymbolKind::Variable) {
                let cause = format!("`{}` is a number at an address of pins; no pin holds it", variable.name);
                note(codes::IL_NUMBER_AT_PIN, variable.pos, cause, "use a BOOL for a pin");
            }
            if variable.qualifier == Some(IlQualifier::Retain) {
                let cause = format!("`{}` is RETAIN, which has no effect yet", variable.name);
                note(codes::IL_RETAIN, variable.pos, cause, "nothing to do if the power stays on");
            }
        }
        notes
    }

    /// Returns the variables in the order of their declarations, then those without one.
    pub(super) fn into_variables(self) -> Vec<IecVariable> {
        self.variables
    }
}

fn declared_variable(variable: &IlVariable, initial: i64, is_declared: bool) -> IecVariable {
    let area = variable.address.as_ref().map(|address| address.area);
    let kind = match (&variable.iec_type, variable.section, area) {
        (IecType::Block(_) | IecType::Named(_), ..) => None,
        (IecType::Bool, IlSection::Input, _) | (IecType::Bool, _, Some(AddressArea::Input)) => Some(SymbolKind::Input),
        (IecType::Bool, IlSection::Output, _) | (IecType::Bool, _, Some(AddressArea::Output)) => {
            Some(SymbolKind::Output)
        }
        (IecType::Bool, ..) => Some(SymbolKind::Relay),
        _ => Some(SymbolKind::Variable),
    };
    IecVariable {
        name: variable.name.text.clone(),
        kind,
        iec_type: variable.iec_type.clone(),
        initial,
        section: variable.section,
        qualifier: variable.qualifier,
        address: variable.address.clone(),
        is_declared,
        comment: variable.comment.clone(),
        pos: variable.name.pos,
    }
}

/// A variable that the text does not declare: an instance of the short form, or an address.
fn implied(name: String, iec_type: IecType, address: Option<DirectAddress>, pos: Pos) -> IecVariable {
    let kind = match (&iec_type, address.as_ref().map(|address| address.area)) {
        (IecType::Block(_), _) => None,
        (IecType::Bool, Some(AddressArea::Input)) => Some(SymbolKind::Input),
        (IecType::Bool, Some(AddressArea::Output)) => Some(SymbolKind::Output),
        (IecType::Bool, _) => Some(SymbolKind::Relay),
        _ => Some(SymbolKind::Variable),
    };
    IecVariable {
        name,
        kind,
        iec_type,
        initial: 0,
        section: IlSection::Local,
        qualifier: None,
        address,
        is_declared: false,
        comment: None,
        pos,
    }
}

/// Returns the address with the size letter that the type needs, so that `%Q0.0` and `%QX0.0` are equal.
fn sized(address: &DirectAddress, iec_type: &IecType) -> DirectAddress {
    let size = address.size.unwrap_or_else(|| match size_of(iec_type) {
        8 => AddressSize::Byte,
        16 => AddressSize::Word,
        32 => AddressSize::Double,
        _ => AddressSize::Bit,
    });
    DirectAddress { size: Some(size), ..address.clone() }
}

/// Returns the type of what is at an address without a name.
fn type_at(address: &DirectAddress) -> IecType {
    match address.size {
        None | Some(AddressSize::Bit) => IecType::Bool,
        Some(AddressSize::Byte) => IecType::Byte,
        Some(AddressSize::Word) => IecType::Word,
        Some(AddressSize::Double) => IecType::Dword,
    }
}

/// Returns the number of a literal: 0 or 1 for BOOL, milliseconds for TIME.
///
/// # Errors
/// The literal is a duration that no timer can count.
pub(super) fn constant(literal: &IlLiteral) -> Result<i64, DurationError> {
    match literal.value {
        IlValue::Bool(value) => Ok(i64::from(value)),
        IlValue::Integer { value, .. } => Ok(value),
        IlValue::Time(nanoseconds) => milliseconds(nanoseconds),
    }
}
