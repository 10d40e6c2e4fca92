//! Functions, variables and types of a program, out of the debugging information (DWARF 2 to 5, stabs) of its
//! ELF file.
//!
//! ```text
//!   read.rs    entries of .debug_info to functions, blocks, variables, types
//!   stabs.rs   records of .stab to the same
//!   place.rs   where a variable is while the machine is in a frame: location expressions and lists
//!   unwind.rs  .debug_frame: the frame of the caller
//!   cdb.rs     records of SDCC for MCS-51 to the same
//!   call_sites.rs  values of parameters at the time of the call
//! ```
//!
//! A type is named by the place of its entry in `.debug_info` ([`TypeId`]), so that types that refer to each
//! other need no second pass; those of stabs have numbers behind. Nothing here knows a machine: who asks for
//! a place gives registers and memory as a [`FrameView`].

mod builtin;
mod call_sites;
pub(in crate::image) mod cdb;
mod place;
mod read;
mod stabs;
mod unwind;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

pub use cdb::{Mcs51Memory, SpaceAddress};
pub use place::{ByteLocation, FrameView};
pub use unwind::UnwoundFrame;

/// First address of AVR data memory in the addresses of AVR ELF files (binutils, ld/scripttempl/avr.sc).
pub const AVR_DATA: u32 = 0x80_0000;

/// A type, identified by the offset of its entry in `.debug_info`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TypeId(pub usize);

/// How the bytes of a base type are interpreted (DWARF 4, section 5.1, `DW_AT_encoding`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseEncoding {
    /// A signed number.
    Signed,
    /// An unsigned number.
    Unsigned,
    /// A signed character.
    SignedChar,
    /// An unsigned character.
    UnsignedChar,
    /// A boolean.
    Boolean,
    /// An IEEE 754 floating-point number.
    Float,
}

/// A type of C or C++.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CType {
    /// A number, character, boolean or floating-point type.
    Base {
        /// Name of the type.
        name: String,
        /// Size in bytes.
        bytes: u32,
        /// How the bytes are interpreted.
        encoding: BaseEncoding,
    },
    /// A pointer or reference.
    Pointer {
        /// The type that it points to; `None` means `void`.
        to: Option<TypeId>,
        /// Size in bytes.
        bytes: u32,
    },
    /// An array with one or more dimensions, the outer one first.
    Array {
        /// Type of the elements.
        of: Option<TypeId>,
        /// Number of elements of each dimension; `None` if it is unknown.
        counts: Vec<Option<u32>>,
    },
    /// A struct, union or class.
    Record {
        /// `struct`, `union` or `class`.
        keyword: &'static str,
        /// The tag; `None` if it is anonymous.
        name: Option<String>,
        /// Size in bytes.
        bytes: u32,
        /// The members in order of declaration.
        members: Vec<StructMember>,
    },
    /// An enumeration.
    Enum {
        /// The tag; `None` if it is anonymous.
        name: Option<String>,
        /// Size in bytes.
        bytes: u32,
        /// The constants: name and value.
        values: Vec<(String, i64)>,
    },
    /// A `typedef`.
    Named {
        /// Name of the `typedef`.
        name: String,
        /// The type that it names.
        of: Option<TypeId>,
    },
    /// A type with `const`, `volatile`, `restrict` or `_Atomic`.
    Qualified {
        /// The qualifier.
        word: &'static str,
        /// The type that it qualifies.
        of: Option<TypeId>,
    },
    /// A function type.
    Function {
        /// Type of the result; `None` means `void`.
        result: Option<TypeId>,
        /// Types of the parameters.
        parameters: Vec<Option<TypeId>>,
        /// The parameters are known: where there are none it takes none.
        prototyped: bool,
    },
}

/// The bits of a bit field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitRange {
    /// The lowest bit.
    pub first: u32,
    /// Number of bits.
    pub size: u32,
}

/// A bit field as its first byte and the bits from there.
#[derive(Debug, Clone, Copy)]
struct BitsInByte {
    /// The offset of the byte that the bits begin in.
    offset: u32,
    /// The bits, counted from bit 0 of that byte.
    bits: Option<BitRange>,
}

impl BitRange {
    /// Splits the range into the byte that it begins in, counted from `offset`, and the bits from there.
    fn in_byte(self, offset: u32) -> BitsInByte {
        BitsInByte {
            offset: offset.saturating_add(self.first / 8),
            bits: Some(BitRange { first: self.first % 8, size: self.size.min(64) }),
        }
    }
}

/// The source file of a compilation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompiledFile<'i> {
    /// Its name as the compiler got it.
    pub name: &'i str,
    /// The folder in which the compiler ran.
    pub folder: &'i str,
}

/// A member of a struct or union.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructMember {
    /// Name of the member; `None` for an anonymous struct or union.
    pub name: Option<String>,
    /// Offset in bytes from the start of the struct or union.
    pub offset: u32,
    /// The bits of a bit field, counted from the lowest bit of the byte at `offset`.
    pub bit_range: Option<BitRange>,
    /// Type of the member.
    pub member_type: Option<TypeId>,
}

/// Where a variable is, as the compiler describes it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum VariableLocation {
    /// The compiler has optimized the variable away.
    #[default]
    OptimizedOut,
    /// The variable has a constant value.
    Constant(Vec<u8>),
    /// One location expression that is always valid.
    Expression(Vec<u8>),
    /// A location expression for each of several ranges of byte addresses of the program.
    List(Vec<(Range<u32>, Vec<u8>)>),
}

/// A variable or parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableInfo {
    /// Name of the variable.
    pub name: String,
    /// Type of the variable; `None` if the file does not say.
    pub variable_type: Option<TypeId>,
    /// Whether it is a parameter.
    pub parameter: bool,
    /// Line of its declaration, 0 if unknown.
    pub line: u32,
    /// Whether other units can refer to it.
    pub external: bool,
    /// Location of the variable.
    pub location: VariableLocation,
    /// Index of its compilation unit.
    pub(super) unit: usize,
}

/// A block of a function that can have its own variables.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BlockInfo {
    /// Byte addresses of its code; empty if the block covers all of the block around it.
    pub ranges: Vec<Range<u32>>,
    /// The function whose call was inlined as this block.
    pub inlined: Option<String>,
    /// File and line of the inlined call. The file has no folders; it is empty if unknown.
    pub call_site: (String, u32),
    /// The variables of the block.
    pub variables: Vec<VariableInfo>,
    /// The blocks inside this block.
    pub blocks: Vec<BlockInfo>,
}

/// The first byte of a location expression that is an address (DWARF 5, section 7.7.1, `DW_OP_addr`).
const DW_OP_ADDR: u8 = 0x03;

impl VariableInfo {
    /// Returns true if the variable has one fixed address, independent of the function that runs.
    #[must_use]
    pub fn is_everywhere(&self) -> bool {
        matches!(&self.location, VariableLocation::Expression(bytes) if bytes.first() == Some(&DW_OP_ADDR))
    }
}

/// A function that has code.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionInfo {
    /// Name of the function.
    pub name: String,
    /// Type of the result; `None` means `void`.
    pub result: Option<TypeId>,
    /// Type of the function, a [`CType::Function`].
    pub of: TypeId,
    /// Line of its definition, 0 if unknown.
    pub line: u32,
    /// Whether other units can call it.
    pub external: bool,
    /// Code, parameters and variables of the function.
    pub block: BlockInfo,
    /// Location of the base of its frame.
    pub(super) frame_base: VariableLocation,
    /// Index of its compilation unit.
    pub(super) unit: usize,
}

/// A compilation unit: what its location expressions and names depend on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnitInfo {
    pub encoding: gimli::Encoding,
    /// Offset of the unit in `.debug_info`; references within the unit are relative to it.
    pub start: usize,
    /// Name of the source file, and below it the folder of the compilation.
    pub name: String,
    pub folder: String,
    /// Offset of the unit's addresses in `.debug_addr`.
    pub addresses: usize,
    /// Byte addresses of its code; empty if the file does not say.
    pub ranges: Vec<Range<u32>>,
    /// Whether locations of variables are valid from the first instruction of a function on. That is so for
    /// GCC if the unit has location lists.
    pub exact: bool,
}

/// Functions, variables and types of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DebugInfo {
    /// Functions that have code, sorted by first address.
    pub functions: Vec<FunctionInfo>,
    /// Variables outside of functions.
    pub globals: Vec<VariableInfo>,
    /// The types by their offset.
    pub(super) types: BTreeMap<usize, CType>,
    /// Types that are others: their definition is elsewhere.
    pub(super) same_types: HashMap<usize, usize>,
    /// File and line where types are defined.
    pub(super) definitions: BTreeMap<usize, (String, u32)>,
    /// The compilation units, in ascending order.
    pub(super) units: Vec<UnitInfo>,
    /// What is added to pointers of a type, so that the sum tells its memory too.
    pub(super) pointer_bases: HashMap<usize, u32>,
    /// Whether addresses of variables contain their memory ([`Mcs51Memory`]).
    pub(super) has_memories: bool,
    /// The calls that the compiler describes.
    pub(super) call_sites: call_sites::CallSites,
    /// Contents of `.debug_frame`, and below them those of `.debug_addr`.
    pub(super) frames: Vec<u8>,
    /// Contents of `.debug_addr`.
    pub(super) addresses: Vec<u8>,
}

/// A type of the debugging information with its id.
#[derive(Debug, Clone, Copy)]
pub struct NumberedType<'a> {
    /// The id that other types and variables refer to.
    pub id: TypeId,
    /// The type.
    pub kind: &'a CType,
}

impl DebugInfo {
    /// Reads the debugging information of an ELF file. The result is empty if the file has none; damaged
    /// parts are left out.
    #[must_use]
    pub fn from_elf(bytes: &[u8]) -> DebugInfo {
        read::read_debug_info(bytes)
    }

    /// Returns the type with this id.
    #[must_use]
    pub fn type_info(&self, id: TypeId) -> Option<&CType> {
        let own = self.types.get(self.same_types.get(&id.0).unwrap_or(&id.0));
        own.or_else(|| builtin::builtin_type(id))
    }

    /// The type of C that a debugger knows by itself, as the compiler of the AVR has it: `int`, `unsigned
    /// long`, `double`.
    #[must_use]
    pub fn builtin_type(name: &str) -> Option<TypeId> {
        builtin::builtin_id(name)
    }

    /// All types, in the order of the file.
    pub fn types(&self) -> impl Iterator<Item = NumberedType<'_>> {
        self.types.iter().map(|(id, kind)| NumberedType { id: TypeId(*id), kind })
    }

    /// Follows typedefs and qualifiers to the underlying type; `None` means `void`.
    #[must_use]
    pub fn resolve_typedefs(&self, mut id: Option<TypeId>) -> Option<TypeId> {
        // A damaged file can have typedefs that refer to each other in a cycle.
        for _ in 0..64 {
            match self.type_info(id?)? {
                CType::Named { of, .. } | CType::Qualified { of, .. } => id = *of,
                _ => return id,
            }
        }
        None
    }

    /// Size of a type in bytes, or `None` if it is unknown.
    #[must_use]
    pub fn size(&self, id: Option<TypeId>) -> Option<u32> {
        self.size_within(id, 64)
    }

    fn size_within(&self, id: Option<TypeId>, depth: u32) -> Option<u32> {
        match self.type_info(self.resolve_typedefs(id)?)? {
            CType::Base { bytes, .. }
            | CType::Pointer { bytes, .. }
            | CType::Record { bytes, .. }
            | CType::Enum { bytes, .. } => Some(*bytes),
            CType::Array { of, counts } => {
                let each = self.size_within(*of, depth.checked_sub(1)?)?;
                counts.iter().try_fold(each, |size, count| size.checked_mul((*count)?))
            }
            _ => None,
        }
    }

    /// The function whose code contains a byte address.
    #[must_use]
    pub fn function_at(&self, byte: u32) -> Option<&FunctionInfo> {
        self.functions.iter().find(|function| function.block.has_code_at(byte))
    }

    /// The source file of the code at a byte address.
    #[must_use]
    pub fn unit_at(&self, byte: u32) -> Option<CompiledFile<'_>> {
        let unit = self
            .function_at(byte)
            .map(|function| function.unit)
            .or_else(|| self.units.iter().position(|unit| unit.ranges.iter().any(|range| range.contains(&byte))))?;
        self.units.get(unit).map(|unit| CompiledFile { name: &unit.name, folder: &unit.folder })
    }

    /// Returns true if the variables of a function are at their locations only after its prologue.
    #[must_use]
    pub fn has_prologue(&self, function: &FunctionInfo) -> bool {
        !self.units.get(function.unit).is_some_and(|unit| unit.exact)
    }

    /// Finds a variable outside of functions; one in the unit of the code at `byte` is preferred.
    #[must_use]
    pub fn global(&self, name: &str, byte: u32) -> Option<&VariableInfo> {
        let unit = self.function_at(byte).map(|function| function.unit);
        let named = || self.globals.iter().filter(|variable| variable.name == name);
        named().find(|variable| Some(variable.unit) == unit).or_else(|| named().next())
    }

    /// Finds a function; one in the unit of the code at `byte` is preferred.
    #[must_use]
    pub fn function(&self, name: &str, byte: u32) -> Option<&FunctionInfo> {
        let unit = self.function_at(byte).map(|function| function.unit);
        let named = || self.functions.iter().filter(|function| function.name == name);
        named().find(|function| Some(function.unit) == unit).or_else(|| named().next())
    }
}

/// The place where a type is defined.
#[derive(Debug, Clone, Copy)]
pub struct TypeDefinition<'a> {
    /// The source file as the compiler wrote it.
    pub file: &'a str,
    /// The line from 1; 0 for a type that the compiler defines.
    pub line: u32,
}

impl DebugInfo {
    /// Returns true if the unit of a function is the source file `file`, given by its name or the end of its
    /// path.
    #[must_use]
    pub fn is_defined_in(&self, function: &FunctionInfo, file: &str) -> bool {
        self.is_unit(function.unit, file)
    }

    fn is_unit(&self, unit: usize, file: &str) -> bool {
        let is = |name: &str| name == file || name.strip_suffix(file).is_some_and(|before| before.ends_with('/'));
        self.units.get(unit).is_some_and(|unit| is(&unit.name))
    }

    /// What is added to the value of a pointer type to get an address that tells its memory
    /// ([`Mcs51Memory`]); `None` for chips whose pointers are into one memory.
    #[must_use]
    pub fn pointer_base(&self, id: Option<TypeId>) -> Option<u32> {
        self.pointer_bases.get(&self.resolve_typedefs(id)?.0).copied()
    }

    /// What is added to an address in the memory of a variable to get an address that contains the memory
    /// ([`Mcs51Memory`]); `None` for chips whose pointers are into one memory.
    #[must_use]
    pub fn memory_of_variable(&self, variable: &VariableInfo) -> Option<u32> {
        match &variable.location {
            VariableLocation::Expression(bytes) if self.has_memories && variable.is_everywhere() => {
                let address = bytes.get(1..5)?.try_into().ok().map(u32::from_le_bytes)?;
                Some(address & !0xFFFF)
            }
            _ => None,
        }
    }

    /// Name of the source file of a function, as the compiler was given it.
    #[must_use]
    pub fn file_of_function(&self, function: &FunctionInfo) -> &str {
        self.units.get(function.unit).map_or("", |unit| &unit.name)
    }

    /// Name of the source file of a variable, as the compiler was given it.
    #[must_use]
    pub fn file_of_variable(&self, variable: &VariableInfo) -> &str {
        self.units.get(variable.unit).map_or("", |unit| &unit.name)
    }

    /// File and line of the definition of a type; of one that the compiler defines, the file of its unit and
    /// line 0.
    #[must_use]
    pub fn definition_of(&self, id: TypeId) -> TypeDefinition<'_> {
        if let Some((file, line)) = self.definitions.get(&id.0) {
            return TypeDefinition { file, line: *line };
        }
        let unit = self.units.iter().take_while(|unit| unit.start <= id.0).last();
        TypeDefinition { file: unit.map_or("", |unit| &unit.name), line: 0 }
    }

    /// Finds a variable outside of functions in the unit of a source file.
    #[must_use]
    pub fn global_in_file(&self, file: &str, name: &str) -> Option<&VariableInfo> {
        self.globals.iter().find(|variable| variable.name == name && self.is_unit(variable.unit, file))
    }
}

impl BlockInfo {
    /// Returns true if the block contains the code at a byte address.
    #[must_use]
    pub fn has_code_at(&self, byte: u32) -> bool {
        self.ranges.iter().any(|range| range.contains(&byte))
    }

    /// The nested blocks that contain a byte address, innermost first; `self` is the last.
    #[must_use]
    pub fn blocks_around(&self, byte: u32) -> Vec<&BlockInfo> {
        let (mut found, mut here) = (vec![self], self);
        while let Some(inner) = here.blocks.iter().find(|block| block.ranges.is_empty() || block.has_code_at(byte)) {
            found.push(inner);
            here = inner;
        }
        found.reverse();
        found
    }
}
