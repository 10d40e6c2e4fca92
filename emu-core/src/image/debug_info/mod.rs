//! Functions, variables and types of a program, out of the debugging information (DWARF 2 to 5, stabs) of its ELF file.
//!
//! ```text
//!   read.rs    entries of .debug_info to functions, blocks, variables, types
//!   stabs.rs   records of .stab to the same
//!   place.rs   where a variable is while the machine is in a frame: location expressions and lists
//!   unwind.rs  .debug_frame: the frame of the caller
//! ```
//!
//! A type is named by the place of its entry in `.debug_info` ([`TypeId`]), so that types that refer to each other need no second
//! pass; those of stabs have numbers behind. Nothing here knows a machine: who asks for a place gives registers and memory as a [`FrameView`].

mod place;
mod read;
mod stabs;
mod unwind;

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

pub use place::{ByteLocation, FrameView};
pub use unwind::UnwoundFrame;

/// Where the data memory of an AVR begins in the addresses of its ELF files (binutils, ld/scripttempl/avr.sc).
pub const AVR_DATA: u32 = 0x80_0000;

/// A type, by the place of its entry in `.debug_info`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TypeId(pub usize);

/// How the bytes of a base type are read (DWARF 4, section 5.1, `DW_AT_encoding`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseEncoding {
    /// A number with a sign.
    Signed,
    /// A number without a sign.
    Unsigned,
    /// A character with a sign.
    SignedChar,
    /// A character without a sign.
    UnsignedChar,
    /// True or false.
    Boolean,
    /// IEEE 754.
    Float,
}

/// A type of C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CType {
    /// A number or character.
    Base {
        /// Its name.
        name: String,
        /// Bytes.
        bytes: u32,
        /// How they are read.
        encoding: BaseEncoding,
    },
    /// A pointer; to nothing is to `void`.
    Pointer {
        /// What it points to.
        to: Option<TypeId>,
        /// Bytes.
        bytes: u32,
    },
    /// An array with one count for each dimension, the outer first; an unknown count is nothing.
    Array {
        /// Its elements.
        of: Option<TypeId>,
        /// Elements by dimension.
        counts: Vec<Option<u32>>,
    },
    /// A struct or union.
    Record {
        /// `struct`, `union` or `class`.
        keyword: &'static str,
        /// Its tag.
        name: Option<String>,
        /// Bytes.
        bytes: u32,
        /// Its members in their order.
        members: Vec<StructMember>,
    },
    /// An enumeration.
    Enum {
        /// Its tag.
        name: Option<String>,
        /// Bytes.
        bytes: u32,
        /// Its constants.
        values: Vec<(String, i64)>,
    },
    /// A `typedef`.
    Named {
        /// The name.
        name: String,
        /// What it stands for.
        of: Option<TypeId>,
    },
    /// `const`, `volatile` and the like.
    Qualified {
        /// The word.
        word: &'static str,
        /// What it qualifies.
        of: Option<TypeId>,
    },
    /// A function.
    Function {
        /// What it returns; nothing is `void`.
        result: Option<TypeId>,
        /// Types of its parameters.
        parameters: Vec<Option<TypeId>>,
        /// The parameters are known: where there are none it takes none.
        prototyped: bool,
    },
}

/// A member of a struct or union.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StructMember {
    /// Its name; an unnamed struct or union within has none.
    pub name: Option<String>,
    /// Bytes from the beginning.
    pub offset: u32,
    /// Of a bit field: the first bit, counted from the lowest bit of the byte at `offset`, and bits.
    pub bit_range: Option<(u32, u32)>,
    /// Its type.
    pub member_type: Option<TypeId>,
}

/// Where a variable is, as the compiler tells it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum VariableLocation {
    /// Nowhere: it is optimized away.
    #[default]
    OptimizedOut,
    /// It has one value for ever.
    Constant(Vec<u8>),
    /// An expression.
    Expression(Vec<u8>),
    /// An expression each for ranges of byte addresses of the program.
    List(Vec<(Range<u32>, Vec<u8>)>),
}

/// A variable or parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VariableInfo {
    /// Its name.
    pub name: String,
    /// Its type; nothing where the file does not tell.
    pub variable_type: Option<TypeId>,
    /// It is a parameter.
    pub parameter: bool,
    /// Line of its declaration, 0 where that is unknown.
    pub line: u32,
    /// Where it is.
    pub location: VariableLocation,
    /// The unit that it belongs to, by number.
    pub(super) unit: usize,
}

/// A block of a function with variables of its own.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct BlockInfo {
    /// Byte addresses of its code; none where it is as large as what it lies in.
    pub ranges: Vec<Range<u32>>,
    /// The function whose code was put here in place of a call.
    pub inlined: Option<String>,
    /// File and line of that call; the file by its name without folders, empty where it is not known.
    pub call_site: (String, u32),
    /// Its variables.
    pub variables: Vec<VariableInfo>,
    /// Blocks within it.
    pub blocks: Vec<BlockInfo>,
}

/// Begins a location that is an address (DWARF 5, section 7.7.1, `DW_OP_addr`).
const DW_OP_ADDR: u8 = 0x03;

impl VariableInfo {
    /// It has one place for good, whatever function is running.
    #[must_use]
    pub fn is_everywhere(&self) -> bool {
        matches!(&self.location, VariableLocation::Expression(bytes) if bytes.first() == Some(&DW_OP_ADDR))
    }
}

/// A function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionInfo {
    /// Its name.
    pub name: String,
    /// What it returns; nothing is `void`.
    pub result: Option<TypeId>,
    /// Its type, a [`CType::Function`].
    pub of: TypeId,
    /// Its code, and its parameters and variables.
    pub block: BlockInfo,
    /// The base of its frame.
    pub(super) frame_base: VariableLocation,
    /// The unit that it belongs to, by number.
    pub(super) unit: usize,
}

/// What location expressions of a unit need to know of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnitInfo {
    pub encoding: gimli::Encoding,
    /// Place of its first entry in `.debug_info`, from which references within it count.
    pub start: usize,
    /// Name and folder.
    pub name: String,
    pub folder: String,
    /// Where its addresses begin in `.debug_addr`.
    pub addresses: usize,
    /// Byte addresses of its code; none where the file does not tell.
    pub ranges: Vec<Range<u32>>,
    /// A compiler that tells where variables are from the first instruction of a function on (GCC, as soon as it has lists).
    pub exact: bool,
}

/// Functions, variables and types of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DebugInfo {
    /// Functions with code, by their first address.
    pub functions: Vec<FunctionInfo>,
    /// Variables outside of functions.
    pub globals: Vec<VariableInfo>,
    pub(super) types: BTreeMap<usize, CType>,
    /// Types that are others: what is told elsewhere.
    pub(super) same_types: HashMap<usize, usize>,
    pub(super) units: Vec<UnitInfo>,
    /// `.debug_frame` and `.debug_addr`.
    pub(super) frames: Vec<u8>,
    pub(super) addresses: Vec<u8>,
}

impl DebugInfo {
    /// The debugging information of an ELF file; empty where it has none, and without what is damaged.
    #[must_use]
    pub fn from_elf(bytes: &[u8]) -> DebugInfo {
        read::read_debug_info(bytes)
    }

    /// A type.
    #[must_use]
    pub fn type_info(&self, id: TypeId) -> Option<&CType> {
        self.types.get(self.same_types.get(&id.0).unwrap_or(&id.0))
    }

    /// All types, in the order of the file.
    pub fn types(&self) -> impl Iterator<Item = (TypeId, &CType)> {
        self.types.iter().map(|(id, kind)| (TypeId(*id), kind))
    }

    /// A type without its names and qualifiers; nothing for `void`.
    #[must_use]
    pub fn resolve_typedefs(&self, mut id: Option<TypeId>) -> Option<TypeId> {
        // A damaged file may have names that go round in circles.
        for _ in 0..64 {
            match self.type_info(id?)? {
                CType::Named { of, .. } | CType::Qualified { of, .. } => id = *of,
                _ => return id,
            }
        }
        None
    }

    /// Bytes of a type; nothing where that is unknown.
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

    /// The function whose code is at a byte address.
    #[must_use]
    pub fn function_at(&self, byte: u32) -> Option<&FunctionInfo> {
        self.functions.iter().find(|function| function.block.has_code_at(byte))
    }

    /// Name of the source file and folder of the compilation of the code at a byte address.
    #[must_use]
    pub fn unit_at(&self, byte: u32) -> Option<(&str, &str)> {
        let unit = self
            .function_at(byte)
            .map(|function| function.unit)
            .or_else(|| self.units.iter().position(|unit| unit.ranges.iter().any(|range| range.contains(&byte))))?;
        self.units.get(unit).map(|unit| (unit.name.as_str(), unit.folder.as_str()))
    }

    /// The variables of a function are in their places only behind its prologue.
    #[must_use]
    pub fn has_prologue(&self, function: &FunctionInfo) -> bool {
        !self.units.get(function.unit).is_some_and(|unit| unit.exact)
    }

    /// A variable outside of functions: one of the unit of the code at a byte address first.
    #[must_use]
    pub fn global(&self, name: &str, byte: u32) -> Option<&VariableInfo> {
        let unit = self.function_at(byte).map(|function| function.unit);
        let named = || self.globals.iter().filter(|variable| variable.name == name);
        named().find(|variable| Some(variable.unit) == unit).or_else(|| named().next())
    }

    /// A function: one of the unit of the code at a byte address first.
    #[must_use]
    pub fn function(&self, name: &str, byte: u32) -> Option<&FunctionInfo> {
        let unit = self.function_at(byte).map(|function| function.unit);
        let named = || self.functions.iter().filter(|function| function.name == name);
        named().find(|function| Some(function.unit) == unit).or_else(|| named().next())
    }
}

impl DebugInfo {
    /// The unit of a function is a source file: its name, or the end of its path.
    #[must_use]
    pub fn is_defined_in(&self, function: &FunctionInfo, file: &str) -> bool {
        self.is_unit(function.unit, file)
    }

    fn is_unit(&self, unit: usize, file: &str) -> bool {
        let is = |name: &str| name == file || name.strip_suffix(file).is_some_and(|before| before.ends_with('/'));
        self.units.get(unit).is_some_and(|unit| is(&unit.name))
    }

    /// A variable outside of functions in the unit of a source file.
    #[must_use]
    pub fn global_in_file(&self, file: &str, name: &str) -> Option<&VariableInfo> {
        self.globals.iter().find(|variable| variable.name == name && self.is_unit(variable.unit, file))
    }
}

impl BlockInfo {
    /// The code at a byte address belongs to it.
    #[must_use]
    pub fn has_code_at(&self, byte: u32) -> bool {
        self.ranges.iter().any(|range| range.contains(&byte))
    }

    /// The blocks around the code at a byte address, the innermost first, itself last.
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
