//! Questions about types of C.

use emu_core::image::{CType, DebugInfo, TypeId};

/// A type, and how many pointers to it that the program need not have: `&x` is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Kind {
    /// The type; nothing stands for `void`.
    pub id: Option<TypeId>,
    /// Pointers around it.
    pub stars: u32,
    /// Of an array: dimensions that an index was taken of.
    pub taken: usize,
}

impl Kind {
    /// A type of the program.
    #[must_use]
    pub fn new(id: Option<TypeId>) -> Kind {
        Kind { id, stars: 0, taken: 0 }
    }
}

/// Bytes of a pointer of AVR-GCC.
const POINTER: u32 = 2;

/// Questions about types.
pub(super) trait Kinds {
    fn shape(&self, kind: Kind) -> Option<&CType>;
    fn size_of(&self, kind: Kind) -> Option<u32>;
    fn array(&self, kind: Kind) -> Option<(Option<TypeId>, &[Option<u32>])>;
    fn element(&self, kind: Kind) -> Option<Kind>;
    fn member(&self, record: Option<TypeId>, name: &str, depth: u32) -> Option<Found>;
    fn member_names(&self, record: Option<TypeId>) -> Vec<&str>;
    fn kind_text(&self, kind: Kind) -> String;
}

/// Bytes before a member, its bit field, its type.
type Found = (u32, Option<(u32, u32)>, Option<TypeId>);

impl Kinds for DebugInfo {
    fn shape(&self, kind: Kind) -> Option<&CType> {
        if kind.stars > 0 { None } else { self.kind(self.plain(kind.id)?) }
    }

    fn size_of(&self, kind: Kind) -> Option<u32> {
        if kind.stars > 0 {
            return Some(POINTER);
        }
        match self.array(kind) {
            Some((of, counts)) => counts.iter().try_fold(self.size(of)?, |size, count| size.checked_mul((*count)?)),
            None => self.size(kind.id),
        }
    }

    /// The elements of an array, and how many of them by dimension.
    fn array(&self, kind: Kind) -> Option<(Option<TypeId>, &[Option<u32>])> {
        match self.shape(kind)? {
            CType::Array { of, counts } => Some((*of, counts.get(kind.taken..)?)),
            _ => None,
        }
    }

    fn element(&self, kind: Kind) -> Option<Kind> {
        let (of, counts) = self.array(kind)?;
        Some(if counts.len() > 1 { Kind { taken: kind.taken + 1, ..kind } } else { Kind::new(of) })
    }

    fn member(&self, record: Option<TypeId>, name: &str, depth: u32) -> Option<Found> {
        let CType::Record { members, .. } = self.kind(self.plain(record)?)? else { return None };
        let own = members.iter().find(|member| member.name.as_deref() == Some(name));
        if let Some(member) = own {
            return Some((member.offset, member.bits, member.of));
        }
        members.iter().filter(|member| member.name.is_none()).find_map(|member| {
            let (offset, bits, of) = self.member(member.of, name, depth.checked_sub(1)?)?;
            Some((member.offset.checked_add(offset)?, bits, of))
        })
    }

    fn member_names(&self, record: Option<TypeId>) -> Vec<&str> {
        match self.plain(record).and_then(|id| self.kind(id)) {
            Some(CType::Record { members, .. }) => members.iter().filter_map(|member| member.name.as_deref()).collect(),
            _ => Vec::new(),
        }
    }

    fn kind_text(&self, kind: Kind) -> String {
        super::ctype::name(self, kind, "")
    }
}
