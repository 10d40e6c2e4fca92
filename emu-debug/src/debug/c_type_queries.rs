//! Queries on C types.

use emu_core::image::{BitRange, CType, DebugInfo, Mcs51Memory, StructMember, TypeId};

/// A type, with pointers around it that the program need not define: `&x` is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CTypeRef {
    /// The type; `None` is `void`.
    pub id: Option<TypeId>,
    /// Number of pointers around it.
    pub pointer_depth: u32,
    /// For an array: the number of dimensions that are already indexed.
    pub indexed_dimensions: usize,
    /// For a pointer with `pointer_depth` above 0: what is added to its value to get an address that contains
    /// its memory (8051); `None` if the memory is not known.
    pub memory: Option<u32>,
}

impl CTypeRef {
    /// Returns a type of the program.
    #[must_use]
    pub fn new(id: Option<TypeId>) -> CTypeRef {
        CTypeRef { id, pointer_depth: 0, indexed_dimensions: 0, memory: None }
    }
}

/// Size of a pointer in bytes (AVR-GCC).
const POINTER_BYTES: u32 = 2;

/// The type of an array.
#[derive(Debug, Clone, Copy)]
pub struct ArrayShape<'a> {
    /// The type of an element; None for void.
    pub element: Option<TypeId>,
    /// The number of elements of each dimension, if it is known.
    pub counts: &'a [Option<u32>],
}

/// Queries on types.
pub(super) trait CTypeQueries {
    fn resolve_type(&self, kind: CTypeRef) -> Option<&CType>;
    fn size_of(&self, kind: CTypeRef) -> Option<u32>;
    fn array(&self, kind: CTypeRef) -> Option<ArrayShape<'_>>;
    fn element_type(&self, kind: CTypeRef) -> Option<CTypeRef>;
    fn member(&self, record: Option<TypeId>, name: &str, depth: u32) -> Option<FoundMember>;
    fn member_names(&self, record: Option<TypeId>) -> Vec<&str>;
    fn type_name(&self, kind: CTypeRef) -> String;
    fn memory_of_target(&self, kind: CTypeRef) -> Option<u32>;
}

/// A member of a struct or union, found by its name.
pub(super) struct FoundMember {
    /// Offset in bytes.
    pub offset: u32,
    /// The bits of a bit field.
    pub bits: Option<BitRange>,
    pub member_type: Option<TypeId>,
}

impl CTypeQueries for DebugInfo {
    fn resolve_type(&self, kind: CTypeRef) -> Option<&CType> {
        if kind.pointer_depth > 0 { None } else { self.type_info(self.resolve_typedefs(kind.id)?) }
    }

    fn size_of(&self, kind: CTypeRef) -> Option<u32> {
        if kind.pointer_depth > 0 {
            // A generic pointer of the 8051 has the memory in its third byte.
            return Some(POINTER_BYTES + u32::from(kind.memory == Some(Mcs51Memory::POINTER)));
        }
        match self.array(kind) {
            Some(ArrayShape { element: of, counts }) => {
                counts.iter().try_fold(self.size(of)?, |size, count| size.checked_mul((*count)?))
            }
            None => self.size(kind.id),
        }
    }

    /// Returns the element type of an array, and its element counts by dimension.
    fn array(&self, kind: CTypeRef) -> Option<ArrayShape<'_>> {
        match self.resolve_type(kind)? {
            CType::Array { of, counts } => {
                Some(ArrayShape { element: *of, counts: counts.get(kind.indexed_dimensions..)? })
            }
            _ => None,
        }
    }

    fn element_type(&self, kind: CTypeRef) -> Option<CTypeRef> {
        let ArrayShape { element: of, counts } = self.array(kind)?;
        Some(if counts.len() > 1 {
            CTypeRef { indexed_dimensions: kind.indexed_dimensions + 1, ..kind }
        } else {
            CTypeRef::new(of)
        })
    }

    fn member(&self, record: Option<TypeId>, name: &str, depth: u32) -> Option<FoundMember> {
        let CType::Record { members, .. } = self.type_info(self.resolve_typedefs(record)?)? else { return None };
        let own = members.iter().find(|member| member.name.as_deref() == Some(name));
        if let Some(member) = own {
            let StructMember { offset, bit_range: bits, member_type, .. } = *member;
            return Some(FoundMember { offset, bits, member_type });
        }
        members.iter().filter(|member| member.name.is_none()).find_map(|member| {
            let inner = self.member(member.member_type, name, depth.checked_sub(1)?)?;
            Some(FoundMember { offset: member.offset.checked_add(inner.offset)?, ..inner })
        })
    }

    fn member_names(&self, record: Option<TypeId>) -> Vec<&str> {
        match self.resolve_typedefs(record).and_then(|id| self.type_info(id)) {
            Some(CType::Record { members, .. }) => members.iter().filter_map(|member| member.name.as_deref()).collect(),
            _ => Vec::new(),
        }
    }

    fn type_name(&self, kind: CTypeRef) -> String {
        super::c_types::declaration(self, kind, "")
    }

    /// Returns the base of the memory that a pointer of this type points to.
    fn memory_of_target(&self, kind: CTypeRef) -> Option<u32> {
        if kind.pointer_depth > 0 { kind.memory } else { self.pointer_base(kind.id) }
    }
}
