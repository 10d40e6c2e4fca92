//! Types of C that a debugger knows without the program: those of literals and of what is computed (AVR-GCC,
//! "Type layout").

use std::sync::LazyLock;

use super::{BaseEncoding, CType, TypeId};

/// First id of a built-in type; entries of a file lie far below.
const FIRST: usize = usize::MAX - 63;

#[rustfmt::skip]
const TYPES: &[(&str, u32, BaseEncoding)] = &[
    ("int", 2, BaseEncoding::Signed), ("unsigned int", 2, BaseEncoding::Unsigned),
    ("long", 4, BaseEncoding::Signed), ("unsigned long", 4, BaseEncoding::Unsigned),
    ("long long", 8, BaseEncoding::Signed), ("unsigned long long", 8, BaseEncoding::Unsigned),
    ("short", 2, BaseEncoding::Signed), ("unsigned short", 2, BaseEncoding::Unsigned),
    ("char", 1, BaseEncoding::SignedChar), ("signed char", 1, BaseEncoding::SignedChar),
    ("unsigned char", 1, BaseEncoding::UnsignedChar),
    ("float", 4, BaseEncoding::Float), ("double", 4, BaseEncoding::Float),
];

static BUILTIN: LazyLock<Vec<CType>> = LazyLock::new(|| {
    let base =
        |&(name, bytes, encoding): &(&str, u32, BaseEncoding)| CType::Base { name: name.to_owned(), bytes, encoding };
    TYPES.iter().map(base).collect()
});

/// The built-in type of an id.
pub(super) fn builtin_type(id: TypeId) -> Option<&'static CType> {
    BUILTIN.get(id.0.checked_sub(FIRST)?)
}

/// The id of the built-in type of a name.
pub(super) fn builtin_id(name: &str) -> Option<TypeId> {
    TYPES.iter().position(|(own, ..)| *own == name).map(|at| TypeId(FIRST + at))
}
