//! C objects: variables, pointer targets, members, elements; and values with a C type.

pub(in crate::debug) mod assignment;
mod byte_locations;

use std::ops::Range;
use std::sync::Arc;

use emu_core::image::{AVR_DATA, BaseEncoding, BitRange, CType, DebugInfo, FunctionInfo, Mcs51Memory, VariableInfo};

pub use byte_locations::ObjectByteLocation;
pub(super) use byte_locations::number_from_bytes;

use super::c_type_queries::{CTypeQueries as _, CTypeRef, FoundMember};
use super::call_stack::CallStack;
use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression::{BinaryOperator, DebugExpression};
use super::expression_place::ExpressionPlace;
use super::expression_value::ExpressionValue;

/// The base of an object.
#[derive(Debug, Clone, PartialEq, Eq)]
enum ObjectBase {
    /// A variable: where it is in scope (everywhere if empty), and the level of the first frame to search.
    Variable { variable: Arc<VariableInfo>, known: Vec<Range<u32>>, level: usize },
    /// Memory at an address.
    At(Box<DebugExpression>),
    /// A value without a location.
    Value(Box<DebugExpression>),
    /// The address of an object.
    AddressOf(Box<ObjectExpr>),
    /// The code of a function, from this byte address on.
    Function(u32),
    /// Bytes as they were when the value history recorded them.
    Kept(Vec<ObjectByteLocation>),
}

/// A C object, or a value with a type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ObjectExpr {
    /// The call stack of the program, which has the debugging information.
    pub(super) calls: CallStack,
    base: ObjectBase,
    /// Its type.
    pub ctype: CTypeRef,
    /// Offset in bytes from the base.
    offset: u32,
    /// Array indices, each with the size of an element in bytes.
    indices: Vec<(DebugExpression, u32)>,
    /// The bits of a bit field.
    bits: Option<BitRange>,
    /// On an 8051, the base of the memory that contains it, if that is known without a machine.
    memory: Option<u32>,
}

impl ObjectExpr {
    /// Returns a variable.
    pub(super) fn variable(
        calls: CallStack,
        variable: &VariableInfo,
        known: Vec<Range<u32>>,
        level: usize,
    ) -> ObjectExpr {
        let kind = CTypeRef::new(variable.variable_type);
        let memory = calls.info.memory_of_variable(variable);
        let base = ObjectBase::Variable { variable: Arc::new(variable.clone()), known, level };
        ObjectExpr { memory, ..ObjectExpr::of(calls, base, kind) }
    }

    /// Returns memory at an address.
    pub(super) fn at(calls: CallStack, addr: DebugExpression, kind: CTypeRef) -> ObjectExpr {
        ObjectExpr::of(calls, ObjectBase::At(Box::new(addr)), kind)
    }

    /// Returns a value with a type.
    pub(super) fn value_of(calls: CallStack, value: DebugExpression, kind: CTypeRef) -> ObjectExpr {
        ObjectExpr::of(calls, ObjectBase::Value(Box::new(value)), kind)
    }

    /// Returns a function of the program.
    pub(super) fn function(calls: CallStack, function: &FunctionInfo) -> Option<ObjectExpr> {
        let first = function.block.ranges.iter().map(|range| range.start).min()?;
        Some(ObjectExpr::of(calls, ObjectBase::Function(first), CTypeRef::new(Some(function.of))))
    }

    /// Returns the current value as a constant, for the value history.
    pub(super) fn kept(&self, machine: &dyn DynMachine) -> ObjectExpr {
        let base = match self.code_address(machine).and_then(|byte| u32::try_from(byte).ok()) {
            Some(byte) => ObjectBase::Function(byte),
            None => ObjectBase::Kept(self.byte_locations(machine).iter().map(|cell| cell.frozen(machine)).collect()),
        };
        ObjectExpr { base, offset: 0, indices: Vec::new(), ..self.clone() }
    }

    /// Returns true if it is a function.
    #[must_use]
    pub fn is_function(&self) -> bool {
        matches!(self.resolved_type(), Some(CType::Function { .. }))
    }

    /// Returns true if it is a pointer to a function, which holds a word address.
    #[must_use]
    pub fn is_function_pointer(&self) -> bool {
        let to = self.element_type().filter(|_| !self.is_array());
        to.is_some_and(|to| matches!(self.info().resolve_type(to), Some(CType::Function { .. })))
    }

    /// Converts the value of a pointer to data as it is printed (on an AVR from 0x800000) to an address.
    pub(super) fn without_link_offset(&self, value: i64) -> i64 {
        let data = i64::from(AVR_DATA);
        let is_linked = self.is_linked_pointer() && (data..data + 0x1_0000).contains(&value);
        if is_linked { value - data } else { value }
    }

    /// Returns the object with the variables of calls in it replaced by their current locations.
    pub(super) fn with_bound_value(mut self, machine: &dyn DynMachine) -> ObjectExpr {
        self.base = match self.base {
            ObjectBase::Value(of) => ObjectBase::Value(Box::new(of.with_bound_operands(machine))),
            ObjectBase::At(of) => ObjectBase::At(Box::new(of.with_bound_operands(machine))),
            other => other,
        };
        self
    }

    /// Returns true if the compiler has optimized away all its bytes, or something from which it is computed.
    pub(super) fn is_optimized_out(&self, machine: &dyn DynMachine) -> bool {
        let cells = self.byte_locations(machine);
        !cells.is_empty() && cells.iter().all(|cell| *cell == ObjectByteLocation::OptimizedAway)
    }

    /// Returns true if it is a value without a location, so that it cannot be set.
    #[must_use]
    pub fn is_computed(&self) -> bool {
        matches!(self.base, ObjectBase::Value(_) | ObjectBase::AddressOf(_) | ObjectBase::Kept(_))
    }

    /// Returns true if it is a pointer to data, whose value is printed with the offset that ELF files of the
    /// AVR give data memory.
    pub(super) fn is_linked_pointer(&self) -> bool {
        self.element_type().is_some() && !self.is_array() && !self.is_function() && !self.is_function_pointer()
    }

    /// Returns the byte address of a function; `None` if it is none.
    pub(super) fn code_address(&self, machine: &dyn DynMachine) -> Option<i64> {
        match &self.base {
            _ if !self.is_function() => None,
            ObjectBase::Function(byte) => Some((*byte).into()),
            ObjectBase::At(addr) => addr.value(machine),
            _ => None,
        }
    }

    fn of(calls: CallStack, base: ObjectBase, kind: CTypeRef) -> ObjectExpr {
        ObjectExpr { calls, base, ctype: kind, offset: 0, indices: Vec::new(), bits: None, memory: None }
    }

    /// Returns the types and functions of the program.
    #[must_use]
    pub fn info(&self) -> &DebugInfo {
        &self.calls.info
    }

    /// Returns its type without typedef names and qualifiers; `None` for `void` and for pointer types that
    /// the program does not define.
    #[must_use]
    pub fn resolved_type(&self) -> Option<&CType> {
        self.info().resolve_type(self.ctype)
    }

    /// Returns the type of a pointer's target or of an array's elements; `None` for other objects.
    #[must_use]
    pub fn element_type(&self) -> Option<CTypeRef> {
        if let Some(stars) = self.ctype.pointer_depth.checked_sub(1) {
            return Some(CTypeRef { pointer_depth: stars, memory: None, ..self.ctype });
        }
        match self.resolved_type()? {
            CType::Pointer { to, .. } => Some(CTypeRef::new(*to)),
            CType::Array { .. } => self.info().element_type(self.ctype),
            // `*f` is the function again.
            CType::Function { .. } => Some(self.ctype),
            _ => None,
        }
    }

    /// Returns true if it is an array, whose value is the address of its first element.
    #[must_use]
    pub fn is_array(&self) -> bool {
        matches!(self.resolved_type(), Some(CType::Array { .. }))
    }

    /// Returns `*p`, or the element `[index]`.
    ///
    /// # Errors
    /// It is neither a pointer nor an array, or the size of its target is not known.
    pub(super) fn element(&self, index: DebugExpression) -> Result<ObjectExpr, DebugError> {
        let kind = self
            .element_type()
            .ok_or_else(|| DebugError::NotAPointer { type_name: self.info().type_name(self.ctype) })?;
        if self.is_function() {
            return Ok(self.clone());
        }
        let size = self.info().size_of(kind);
        if index == DebugExpression::Number(0) && !self.is_array() {
            if let ObjectBase::AddressOf(object) = &self.base {
                return Ok(ObjectExpr { ctype: kind, ..(**object).clone() });
            }
            let value = DebugExpression::Object(Box::new(self.clone()));
            return Ok(self.target_at(value, kind));
        }
        let size = size.filter(|size| *size > 0).ok_or(DebugError::UnknownSize { what: "what it points to" })?;
        if self.is_array() {
            let mut found = ObjectExpr { ctype: kind, ..self.clone() };
            match index {
                DebugExpression::Number(n) if n >= 0 && found.indices.is_empty() => {
                    let bytes = u32::try_from(n).ok().and_then(|n| n.checked_mul(size));
                    found.offset = bytes.and_then(|n| found.offset.checked_add(n)).ok_or(DebugError::IndexTooLarge)?;
                }
                index => found.indices.push((index, size)),
            }
            return Ok(found);
        }
        Ok(self.target_at(self.scaled_offset(BinaryOperator::Add, index, size), kind))
    }

    /// Returns true if it is a variable whose type the program does not describe.
    #[must_use]
    pub fn has_unknown_type(&self) -> bool {
        let is_untyped =
            matches!(&self.base, ObjectBase::Variable { variable, .. } if variable.variable_type.is_none());
        is_untyped && self.ctype == CTypeRef::default()
    }

    /// Returns a variable without a type as an object of a type; `None` for other objects.
    pub(super) fn with_declared_type(&self, kind: CTypeRef) -> Option<ObjectExpr> {
        let ObjectBase::Variable { variable, known, level } = &self.base else { return None };
        let mut typed = VariableInfo::clone(variable);
        typed.variable_type = kind.id.filter(|_| self.has_unknown_type() && kind.pointer_depth == 0);
        typed.variable_type?;
        Some(ObjectExpr::variable(self.calls.clone(), &typed, known.clone(), *level))
    }

    /// Returns what a pointer points to.
    #[must_use]
    pub fn pointed_object(&self) -> Option<ObjectExpr> {
        self.element(DebugExpression::Number(0)).ok().filter(|_| !self.is_array())
    }

    /// Returns the object at an address that a pointer of this type holds.
    fn target_at(&self, addr: DebugExpression, kind: CTypeRef) -> ObjectExpr {
        let memory = self.info().memory_of_target(self.ctype);
        let addr = match memory {
            None => addr,
            Some(base) => {
                let base = DebugExpression::Number(base.into());
                DebugExpression::Binary(BinaryOperator::Add, Box::new(addr), Box::new(base))
            }
        };
        ObjectExpr { memory, ..ObjectExpr::at(self.calls.clone(), addr, kind) }
    }

    /// Returns the base of the memory that its value points to: for an array that of the array, for a pointer
    /// that of its type.
    pub(super) fn memory_of_target(&self) -> Option<u32> {
        if self.is_array() { self.memory } else { self.info().memory_of_target(self.ctype) }
    }

    /// Returns a pointer moved by a number of elements.
    fn scaled_offset(&self, operator: BinaryOperator, by: DebugExpression, size: u32) -> DebugExpression {
        let by =
            DebugExpression::Binary(BinaryOperator::Mul, Box::new(by), Box::new(DebugExpression::Number(size.into())));
        DebugExpression::Binary(operator, Box::new(DebugExpression::Object(Box::new(self.clone()))), Box::new(by))
    }

    /// Returns `p + n` or `p - n` for pointers and arrays; `None` for other objects.
    pub(super) fn offset_by(&self, operator: BinaryOperator, by: &DebugExpression) -> Option<ObjectExpr> {
        let kind = self.element_type().filter(|_| !self.is_function() && !self.is_function_pointer())?;
        let size = self.info().size_of(kind).unwrap_or(1).max(1);
        let kind = CTypeRef { pointer_depth: kind.pointer_depth + 1, memory: self.memory_of_target(), ..kind };
        let from = if self.is_array() { self.address().ok()? } else { self.clone() };
        Some(ObjectExpr::value_of(self.calls.clone(), from.scaled_offset(operator, by.clone(), size), kind))
    }

    /// Returns its address.
    ///
    /// # Errors
    /// It is a value.
    pub(super) fn address(&self) -> Result<ObjectExpr, DebugError> {
        if matches!(self.base, ObjectBase::Value(_) | ObjectBase::AddressOf(_) | ObjectBase::Kept(_)) {
            return Err(DebugError::NoAddress { text: None });
        }
        // The address of a bit field is that of its first byte, as in gdb.
        let kind = CTypeRef { pointer_depth: self.ctype.pointer_depth + 1, memory: self.memory, ..self.ctype };
        Ok(ObjectExpr::of(self.calls.clone(), ObjectBase::AddressOf(Box::new(self.clone())), kind))
    }

    /// Returns a member, also of an unnamed struct or union in it; for a pointer, a member of its target.
    ///
    /// # Errors
    /// It has no members, or none with that name.
    pub(super) fn member(&self, name: &str) -> Result<ObjectExpr, DebugError> {
        let Some(CType::Record { .. }) = self.resolved_type() else {
            if self.element_type().is_some() && !self.is_function() {
                return self.element(DebugExpression::Number(0))?.member(name);
            }
            return Err(DebugError::NoMembers { name: name.to_owned(), type_name: self.info().type_name(self.ctype) });
        };
        let Some(FoundMember { offset, bits, member_type }) = self.info().member(self.ctype.id, name, 8) else {
            return Err(DebugError::UnknownMember {
                type_name: self.info().type_name(self.ctype),
                name: name.to_owned(),
                known: self.info().member_names(self.ctype.id).into_iter().map(str::to_owned).collect(),
            });
        };
        let offset = self.offset.checked_add(offset).ok_or(DebugError::MemberTooFar)?;
        Ok(ObjectExpr { ctype: CTypeRef::new(member_type), offset, bits, ..self.clone() })
    }

    /// Returns its size in bytes; for a bit field, the bytes that contain it.
    #[must_use]
    pub fn bytes(&self) -> Option<u32> {
        match self.bits {
            Some(BitRange { first, size }) => Some(first.saturating_add(size).div_ceil(8)),
            None => self.info().size_of(self.ctype),
        }
    }

    /// Returns its value if it is a number, character, pointer, enumeration or truth value; for other types
    /// the number in its first bytes, if there is one. An array gives the address of its first element where
    /// C does.
    #[must_use]
    pub fn number(&self, machine: &dyn DynMachine) -> Option<i64> {
        match &self.base {
            ObjectBase::Value(value) => {
                // A cast of a function, or of a pointer to one, keeps its bits.
                let code_space = value.object().filter(|of| of.is_function() || of.is_function_pointer());
                let value = match (code_space, value.evaluate(machine)?) {
                    (Some(_), byte) => {
                        ExpressionValue::Whole(byte.to_integer() / i64::from(machine.chip().word_bytes.max(1)))
                    }
                    (None, value) => value,
                };
                if self.is_real() {
                    return Some(value.to_bits(self.bytes()?));
                }
                let value = value.to_integer();
                let Some(bytes) = self.bytes().filter(|bytes| *bytes < 8) else { return Some(value) };
                let unused = 64 - 8 * bytes.max(1);
                Some(if self.is_signed() {
                    value << unused >> unused
                } else {
                    ((value as u64) << unused >> unused) as i64
                })
            }
            ObjectBase::AddressOf(object) if object.memory == Some(Mcs51Memory::POINTER) => {
                match object.byte_locations(machine).first()? {
                    ObjectByteLocation::Memory(space, addr) => Some(i64::from(Mcs51Memory::generic_tag(space) | *addr)),
                    _ => None,
                }
            }
            ObjectBase::AddressOf(object) => object.first_address(machine),
            _ => {
                let cells = self.byte_locations(machine);
                let bytes: Option<Vec<u8>> = cells.iter().take(8).map(|cell| cell.value(machine)).collect();
                number_from_bytes(&bytes?, self.bits, self.is_signed())
            }
        }
    }

    /// Returns the value as in C: an array is the address of its first element, a struct or union has none.
    #[must_use]
    pub(super) fn amount(&self, machine: &dyn DynMachine) -> Option<ExpressionValue> {
        match self.resolved_type() {
            Some(CType::Array { .. }) => self.first_address(machine).map(ExpressionValue::Whole),
            Some(CType::Record { .. }) => None,
            Some(CType::Function { .. }) => self.code_address(machine).map(ExpressionValue::Whole),
            _ if self.is_function_pointer() => {
                let words = self.number(machine)?;
                Some(ExpressionValue::Whole(words.saturating_mul(machine.chip().word_bytes.into())))
            }
            _ if self.is_real() => ExpressionValue::from_bits(self.number(machine)?, self.bytes()?),
            _ => self.number(machine).map(ExpressionValue::Whole),
        }
    }

    /// Returns true if it is a floating-point number.
    #[must_use]
    pub fn is_real(&self) -> bool {
        matches!(self.resolved_type(), Some(CType::Base { encoding: BaseEncoding::Float, .. }))
    }

    /// Returns true if its value cannot change.
    pub(super) fn is_constant(&self) -> bool {
        match &self.base {
            ObjectBase::Value(value) => value.is_constant(),
            ObjectBase::Function(_) | ObjectBase::Kept(_) => true,
            _ => false,
        }
    }

    /// Returns the address of its first byte; in data memory without the offset of the ELF file.
    fn first_address(&self, machine: &dyn DynMachine) -> Option<i64> {
        let chip = machine.chip();
        if let Some(byte) = self.code_address(machine) {
            return Some(byte / i64::from(chip.word_bytes.max(1)));
        }
        match self.byte_locations(machine).first()? {
            ObjectByteLocation::Memory(space, addr)
                if *space == chip.ram_space && *addr >= chip.family_traits().registers_in_ram =>
            {
                Some((*addr).into())
            }
            ObjectByteLocation::Memory(space, addr) if *space == chip.code_space => Some((*addr).into()),
            ObjectByteLocation::Memory(_, addr) if chip.has_sdcc_pointers() => Some((*addr).into()),
            ObjectByteLocation::Memory(space, addr) if *space != chip.ram_space => {
                Some(i64::from(chip.elf_spaces.iter().find(|window| window.name == *space)?.start + addr))
            }
            _ => None,
        }
    }

    /// Returns whether a number of this type can be negative.
    pub(super) fn is_signed(&self) -> bool {
        match self.resolved_type() {
            Some(CType::Base { encoding, .. }) => matches!(encoding, BaseEncoding::Signed | BaseEncoding::SignedChar),
            Some(CType::Enum { values, .. }) => values.iter().any(|(_, value)| *value < 0),
            _ => false,
        }
    }

    /// Returns its current location if it is up to four bytes or one bit.
    #[must_use]
    pub fn place(&self, machine: &dyn DynMachine) -> Option<ExpressionPlace> {
        let cells = self.byte_locations(machine);
        let &ObjectByteLocation::Memory(space, addr) = cells.first()? else { return None };
        let row = (0u32..).zip(&cells).take(4).all(|(n, cell)| *cell == ObjectByteLocation::Memory(space, addr + n));
        match self.bits {
            Some(BitRange { first: bit, size: 1 }) => {
                Some(ExpressionPlace::Bit { space, addr: addr + bit / 8, bit: (bit % 8) as u8 })
            }
            Some(_) => None,
            None => row.then_some(ExpressionPlace::Memory {
                space,
                addr,
                bytes: cells.len().clamp(1, 4) as u8,
                signed: self.is_signed(),
            }),
        }
    }

    /// Returns true if the variables in it are in scope at the location of the machine.
    #[must_use]
    pub fn is_known(&self, machine: &dyn DynMachine) -> bool {
        let own = match &self.base {
            ObjectBase::Variable { known, level, .. } if !known.is_empty() => {
                self.frame(machine, known, *level).is_some()
            }
            ObjectBase::At(of) | ObjectBase::Value(of) => of.is_known(machine),
            ObjectBase::AddressOf(of) => of.is_known(machine),
            _ => true,
        };
        own && self.indices.iter().all(|(index, _)| index.is_known(machine))
    }

    /// Returns its bit field, if it is one.
    pub(super) fn bit_field(&self) -> Option<BitRange> {
        self.bits
    }

    /// Returns true if it is a local variable of a call, or computed from one.
    #[must_use]
    pub fn is_local(&self) -> bool {
        let own = match &self.base {
            ObjectBase::Variable { variable, known, .. } => !known.is_empty() && !variable.is_everywhere(),
            ObjectBase::At(of) | ObjectBase::Value(of) => of.is_local(),
            ObjectBase::AddressOf(of) => of.is_local(),
            ObjectBase::Function(_) | ObjectBase::Kept(_) => false,
        };
        own || self.indices.iter().any(|(index, _)| index.is_local())
    }

    /// Returns the code in which the local variable that it is computed from is in scope.
    pub(super) fn local_scope(&self) -> Option<&[Range<u32>]> {
        let own = match &self.base {
            ObjectBase::Variable { known, .. } => (!known.is_empty()).then_some(known.as_slice()),
            ObjectBase::At(of) | ObjectBase::Value(of) => of.first_local_scope(),
            ObjectBase::AddressOf(of) => of.local_scope(),
            ObjectBase::Function(_) | ObjectBase::Kept(_) => None,
        };
        own.or_else(|| self.indices.iter().find_map(|(index, _)| index.first_local_scope()))
    }

    /// Returns true if its address depends only on time.
    pub(super) fn depends_only_on_time(&self) -> bool {
        match &self.base {
            ObjectBase::At(of) | ObjectBase::Value(of) => of.depends_only_on_time(),
            _ => false,
        }
    }
}
