//! Finds the location of a variable: location expressions of DWARF (DWARF 5, section 2.6), evaluated by
//! `gimli`.
//!
//! An object is a sequence of bytes, and each byte has its own location. Compilers for AVR keep a two-byte
//! number in two registers, or one half in a register and the other in memory. A member of a struct or an
//! element of an array is therefore a part of the sequence. A register from which an address is computed is a
//! pair: r28 means Y.

use gimli::{
    EndianSlice, Evaluation, EvaluationResult, Expression, LittleEndian as Le, Location as Piece, Value, ValueType,
};

use super::{AVR_DATA, BaseEncoding, CType, DebugInfo, FunctionInfo, TypeId, UnitInfo, VariableInfo, VariableLocation};

type DwarfSlice<'b> = EndianSlice<'b, Le>;

/// DWARF number of the stack pointer (AVR-GCC, "Register layout": r0 to r31, then SP).
pub(super) const STACK_POINTER: u16 = 32;

/// Size in bytes of the largest object whose bytes are located.
const MAX_OBJECT_BYTES: u32 = 1 << 16;

/// Maximum number of operations of an expression, in case it never ends.
const MAX_OPERATIONS: u32 = 10_000;

/// Location of one byte of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteLocation {
    /// In memory, at an address of the ELF file.
    Memory(u32),
    /// In a register, given by its DWARF number.
    Register(u16),
    /// Not stored anywhere, but the value is known.
    Value(u8),
    /// Optimized away by the compiler.
    OptimizedOut,
}

/// A stack frame: registers and memory as seen from a call that has not returned.
pub trait FrameView {
    /// Byte address of the frame; for a caller, that of the last byte of its call instruction.
    fn pc_byte(&self) -> u32;
    /// Value of an 8-bit register by its DWARF number, or of SP by the number 32; `None` if the value is
    /// lost.
    fn register(&self, number: u16) -> Option<u32>;
    /// A byte of memory at an address of the ELF file.
    fn memory(&self, address: u32) -> Option<u8>;
    /// The canonical frame address (DWARF 5, section 6.4), an address of data memory.
    fn cfa(&self) -> Option<u32>;
    /// Value of an 8-bit register, and of those above it, when the function of the frame was called.
    fn register_at_call(&self, _number: u16) -> Option<u64> {
        None
    }
}

/// A location expression that was executed to its end.
pub(super) struct FinishedEvaluation<'b> {
    /// The state of the evaluation, which has the result.
    pub(super) evaluation: Evaluation<DwarfSlice<'b>>,
    /// Whether the expression read registers, so that an address is one of data memory.
    pub(super) uses_registers: bool,
}

impl DebugInfo {
    /// Returns the location of each byte of a variable in a frame. `function` is the function of the frame.
    #[must_use]
    pub fn locate_bytes(
        &self,
        variable: &VariableInfo,
        function: Option<&FunctionInfo>,
        frame: &dyn FrameView,
    ) -> Vec<ByteLocation> {
        let bytes = self.size(variable.variable_type).unwrap_or(0).min(MAX_OBJECT_BYTES);
        let gone = || vec![ByteLocation::OptimizedOut; bytes as usize];
        let Some(unit) = self.units.get(variable.unit) else { return gone() };
        let expression = match &variable.location {
            VariableLocation::Constant(value) => {
                let value = value.iter().copied().chain(std::iter::repeat(0));
                return value.take(bytes as usize).map(ByteLocation::Value).collect();
            }
            location => location.expression_at(frame.pc_byte()),
        };
        let Some(expression) = expression else { return gone() };
        let mut found = self.evaluate_expression(unit, expression, function, frame, bytes).unwrap_or_default();
        found.resize(bytes as usize, ByteLocation::OptimizedOut);
        found
    }

    /// Evaluates an expression for an object of `bytes` bytes. Returns `None` if a part of the expression has
    /// no value.
    fn evaluate_expression(
        &self,
        unit: &UnitInfo,
        expression: &[u8],
        function: Option<&FunctionInfo>,
        frame: &dyn FrameView,
        bytes: u32,
    ) -> Option<Vec<ByteLocation>> {
        if expression.is_empty() {
            return None;
        }
        let FinishedEvaluation { evaluation, uses_registers: computed } =
            self.run_evaluation(unit, expression, function, frame)?;
        let mut found = Vec::new();
        for piece in evaluation.result() {
            let size = match piece.size_in_bits {
                Some(bits) => u32::try_from(bits.div_ceil(8)).ok()?.min(MAX_OBJECT_BYTES),
                None => bytes,
            };
            let skipped = piece.bit_offset.unwrap_or(0);
            let whole = skipped % 8 == 0;
            let skipped = u32::try_from(skipped / 8).ok().filter(|_| whole);
            let at = |n: u32| -> ByteLocation {
                let Some(n) = skipped.and_then(|skipped| n.checked_add(skipped)) else {
                    return ByteLocation::OptimizedOut;
                };
                match &piece.location {
                    Piece::Register { register } => u16::try_from(n)
                        .ok()
                        .and_then(|n| register.0.checked_add(n))
                        .map_or(ByteLocation::OptimizedOut, ByteLocation::Register),
                    Piece::Address { address } => {
                        ByteLocation::Memory(data_address(*address, computed).wrapping_add(n))
                    }
                    Piece::Value { value } => {
                        let known = value_bytes(*value);
                        // Bytes above a known value are filled with its sign; an unsigned value has none.
                        let rest =
                            known.last().map_or(0, |last| if last & 0x80 != 0 && known.len() < 8 { 0xFF } else { 0 });
                        ByteLocation::Value(known.get(n as usize).copied().unwrap_or(rest))
                    }
                    Piece::Bytes { value } => value
                        .slice()
                        .get(n as usize)
                        .map_or(ByteLocation::OptimizedOut, |byte| ByteLocation::Value(*byte)),
                    Piece::Empty | Piece::ImplicitPointer { .. } => ByteLocation::OptimizedOut,
                }
            };
            found.extend((0..size).map(at));
            if found.len() > MAX_OBJECT_BYTES as usize {
                return None;
            }
        }
        Some(found)
    }

    /// Runs an expression to its end. The flag of the result is true if the expression used registers, so
    /// that an address is one of data memory.
    pub(super) fn run_evaluation<'b>(
        &'b self,
        unit: &UnitInfo,
        expression: &'b [u8],
        function: Option<&FunctionInfo>,
        frame: &dyn FrameView,
    ) -> Option<FinishedEvaluation<'b>> {
        let mut evaluation = Expression(EndianSlice::new(expression, Le)).evaluation(unit.encoding);
        evaluation.set_max_iterations(MAX_OPERATIONS);
        let mut result = evaluation.evaluate().ok()?;
        // With 16-bit addresses (LLVM), data memory has no address range of its own.
        let width = usize::from(unit.encoding.address_size);
        let mut computed = width <= 2;
        loop {
            result = match result {
                EvaluationResult::Complete => return Some(FinishedEvaluation { evaluation, uses_registers: computed }),
                EvaluationResult::RequiresRegister { register, base_type } => {
                    computed = true;
                    let value = u64::from(register_pair(frame, register.0)?);
                    let kind = self.value_type(unit, base_type.0)?;
                    evaluation.resume_with_register(Value::from_u64(kind, value).ok()?)
                }
                EvaluationResult::RequiresFrameBase => {
                    computed = true;
                    evaluation.resume_with_frame_base(self.frame_base(function?, frame)?.into())
                }
                EvaluationResult::RequiresCallFrameCfa => {
                    computed = true;
                    evaluation.resume_with_call_frame_cfa(frame.cfa()?.into())
                }
                EvaluationResult::RequiresMemory { address, size, base_type, .. } => {
                    let address = data_address(address, computed);
                    let bytes = (0..u32::from(size)).rev().map(|n| frame.memory(address.wrapping_add(n)));
                    let value = bytes.into_iter().try_fold(0, |high, byte| Some(high << 8 | u64::from(byte?)))?;
                    let kind = self.value_type(unit, base_type.0)?;
                    evaluation.resume_with_memory(Value::from_u64(kind, value).ok()?)
                }
                EvaluationResult::RequiresRelocatedAddress(address) => {
                    evaluation.resume_with_relocated_address(address)
                }
                EvaluationResult::RequiresIndexedAddress { index, .. } => {
                    let at = unit.addresses.checked_add(index.0.checked_mul(width)?)?;
                    let bytes = self.addresses.get(at..at.checked_add(width)?)?;
                    let address = bytes.iter().rev().fold(0u64, |high, byte| high << 8 | u64::from(*byte));
                    evaluation.resume_with_indexed_address(address)
                }
                EvaluationResult::RequiresBaseType(offset) => {
                    evaluation.resume_with_base_type(self.value_type(unit, offset.0)?)
                }
                EvaluationResult::RequiresEntryValue(of) => {
                    let LeadingRegister { register, .. } = single_register(of.0.slice())?;
                    evaluation.resume_with_entry_value(Value::Generic(frame.register_at_call(register)?))
                }
                _ => return None,
            }
            .ok()?;
        }
    }

    /// Returns the base of the frame of a function, an address of data memory.
    fn frame_base(&self, function: &FunctionInfo, frame: &dyn FrameView) -> Option<u32> {
        let unit = self.units.get(function.unit)?;
        let expression = function.frame_base.expression_at(frame.pc_byte())?;
        let FinishedEvaluation { evaluation, .. } = self.run_evaluation(unit, expression, None, frame)?;
        match evaluation.result().first()?.location {
            // The register contains the base. LLVM counts from the first byte of the frame, which is the one
            // after the byte that Y points to.
            Piece::Register { register } => register_pair(frame, register.0).map(|base| base.wrapping_add(1)),
            Piece::Address { address } => Some(address as u32 & 0xFFFF),
            _ => None,
        }
    }

    /// The type of a value on the stack of an expression; offset 0 means a number with the width of an
    /// address.
    fn value_type(&self, unit: &UnitInfo, offset: usize) -> Option<ValueType> {
        if offset == 0 {
            return Some(ValueType::Generic);
        }
        let CType::Base { bytes, encoding, .. } = self.type_info(TypeId(unit.start.checked_add(offset)?))? else {
            return None;
        };
        let encoding = match encoding {
            BaseEncoding::Signed => gimli::DW_ATE_signed,
            BaseEncoding::Unsigned => gimli::DW_ATE_unsigned,
            BaseEncoding::SignedChar => gimli::DW_ATE_signed_char,
            BaseEncoding::UnsignedChar | BaseEncoding::Boolean => gimli::DW_ATE_unsigned_char,
            BaseEncoding::Float => gimli::DW_ATE_float,
        };
        ValueType::from_encoding(encoding, (*bytes).into())
    }
}

impl VariableLocation {
    /// The expression that is valid at a byte address.
    pub(super) fn expression_at(&self, byte: u32) -> Option<&[u8]> {
        match self {
            VariableLocation::Expression(bytes) => Some(bytes),
            VariableLocation::List(list) => {
                list.iter().find(|(range, _)| range.contains(&byte)).map(|(_, bytes)| bytes.as_slice())
            }
            VariableLocation::OptimizedOut | VariableLocation::Constant(_) => None,
        }
    }
}

/// A location expression that begins with a register.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeadingRegister<'a> {
    /// DWARF's number of the register.
    pub(super) register: u16,
    /// The bytes of the expression after it.
    pub(super) rest: &'a [u8],
}

/// The register that a location expression begins with, and what follows.
pub(super) fn single_register(expression: &[u8]) -> Option<LeadingRegister<'_>> {
    const DW_OP_REG0: u8 = 0x50;
    const DW_OP_REG31: u8 = 0x6F;
    let (first, rest) = expression.split_first()?;
    (DW_OP_REG0..=DW_OP_REG31)
        .contains(first)
        .then(|| LeadingRegister { register: u16::from(first - DW_OP_REG0), rest })
}

/// The value of a register and the next one as a pair, from which addresses are computed.
pub(super) fn register_pair(frame: &dyn FrameView, number: u16) -> Option<u32> {
    if number >= STACK_POINTER {
        return frame.register(number);
    }
    let high = if number + 1 < STACK_POINTER { frame.register(number + 1)? } else { 0 };
    Some(frame.register(number)? | high << 8)
}

/// Converts an address to one of the ELF file. An address computed from registers has 16 bits and is in data
/// memory.
fn data_address(address: u64, computed: bool) -> u32 {
    let address = address as u32;
    if computed { AVR_DATA | address & 0xFFFF } else { address }
}

/// The bytes of a value, lowest first. A number of unspecified width has four.
fn value_bytes(value: Value) -> Vec<u8> {
    match value {
        Value::Generic(value) => value.to_le_bytes()[..4].to_vec(),
        Value::I8(value) => value.to_le_bytes().to_vec(),
        Value::U8(value) => vec![value, 0],
        Value::I16(value) => value.to_le_bytes().to_vec(),
        Value::U16(value) => [value.to_le_bytes().as_slice(), &[0]].concat(),
        Value::I32(value) => value.to_le_bytes().to_vec(),
        Value::U32(value) => [value.to_le_bytes().as_slice(), &[0]].concat(),
        Value::I64(value) => value.to_le_bytes().to_vec(),
        Value::U64(value) => value.to_le_bytes().to_vec(),
        Value::F32(value) => value.to_le_bytes().to_vec(),
        Value::F64(value) => value.to_le_bytes().to_vec(),
    }
}
