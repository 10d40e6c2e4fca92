//! C types as text in the notation of gdb.

use crate::debug::c_type_queries::ArrayShape;
use emu_core::image::{CType, DebugInfo, NumberedType, TypeId};

use super::c_type_queries::{CTypeQueries as _, CTypeRef};

/// Maximum nesting of types, so that no file can exhaust the stack.
const MAX_DEPTH: u32 = 32;

/// Returns a type around the name that it declares: `int (*f)(void)`.
pub(super) fn declaration(info: &DebugInfo, kind: CTypeRef, inner: &str) -> String {
    of_kind(info, kind, inner, Style::AddressNames)
}

/// Returns a type with typedefs resolved, including the members of a struct or union and the constants of an
/// enumeration, as `ptype` prints it.
pub(super) fn type_definition(info: &DebugInfo, kind: CTypeRef) -> String {
    of_kind(info, kind, "", Style::Whole)
}

/// How a type with a name is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    /// By its name.
    AddressNames,
    /// By its definition.
    Whole,
}

fn of_kind(info: &DebugInfo, kind: CTypeRef, inner: &str, style: Style) -> String {
    if kind.pointer_depth > 0 {
        let pointed = CTypeRef { pointer_depth: kind.pointer_depth - 1, ..kind };
        let own = pointed.pointer_depth == 0 && is_direct(info, pointed.id, style);
        return of_kind(info, pointed, &if own { format!("(*{inner})") } else { format!("*{inner}") }, style);
    }
    if kind.indexed_dimensions > 0
        && let Some(ArrayShape { element: of, counts }) = info.array(kind)
    {
        return of_type(info, of, &format!("{inner}{}", dimensions(counts)), style, MAX_DEPTH);
    }
    of_type(info, kind.id, inner, style, MAX_DEPTH)
}

/// Returns true if it prints as an array or a function and not as a name: a pointer to it needs parentheses.
fn is_direct(info: &DebugInfo, id: Option<TypeId>, style: Style) -> bool {
    let id = if style == Style::Whole { info.resolve_typedefs(id) } else { id };
    matches!(id.and_then(|id| info.type_info(id)), Some(CType::Array { .. } | CType::Function { .. }))
}

fn dimensions(counts: &[Option<u32>]) -> String {
    counts.iter().map(|count| count.map_or("[]".to_owned(), |count| format!("[{count}]"))).collect()
}

fn joined(word: &str, inner: &str) -> String {
    if inner.is_empty() { word.to_owned() } else { format!("{word} {inner}") }
}

fn of_type(info: &DebugInfo, id: Option<TypeId>, inner: &str, style: Style, depth: u32) -> String {
    let Some(kind) = id.and_then(|id| info.type_info(id)).filter(|_| depth > 0) else { return joined("void", inner) };
    let below = |id, inner: &str| of_type(info, id, inner, style, depth - 1);
    match kind {
        CType::Named { of, .. } if style == Style::Whole => below(*of, inner),
        CType::Base { name, .. } => joined(short_name(name), inner),
        CType::Named { name, .. } => joined(name, inner),
        CType::Record { .. } | CType::Enum { .. } if style == Style::Whole => joined(&body(info, kind, depth), inner),
        CType::Record { keyword, name, .. } => joined(&tag(keyword, name.as_deref()), inner),
        CType::Enum { name, .. } => joined(&tag("enum", name.as_deref()), inner),
        CType::Pointer { to, .. } => match is_direct(info, *to, style) {
            true => below(*to, &format!("(*{inner})")),
            false => below(*to, &format!("*{inner}")),
        },
        CType::Qualified { word, of } => {
            let of = if style == Style::Whole { info.resolve_typedefs(*of) } else { *of };
            match of.and_then(|of| info.type_info(of)) {
                // After the star of a pointer.
                Some(CType::Pointer { to, .. }) => {
                    let own = format!("* {}", joined(word, inner));
                    below(*to, &if is_direct(info, *to, style) { format!("({own})") } else { own })
                }
                // A qualifier of an array applies to its elements.
                _ => match below(of, inner) {
                    own if own.starts_with(&format!("{word} ")) => own,
                    own => format!("{word} {own}"),
                },
            }
        }
        CType::Array { of, counts } => below(*of, &format!("{inner}{}", dimensions(counts))),
        CType::Function { result, parameters, prototyped } => {
            // Parameters keep their type names.
            let own = |of: &Option<TypeId>| of_type(info, *of, "", Style::AddressNames, depth - 1);
            let list: Vec<String> = parameters.iter().map(own).collect();
            let list = if list.is_empty() && *prototyped { "void".to_owned() } else { list.join(", ") };
            below(*result, &format!("{inner}({list})"))
        }
    }
}

/// Returns the name of an integer type as gdb prints it, without a redundant `int`.
fn short_name(name: &str) -> &str {
    match name {
        "long int" => "long",
        "long unsigned int" => "unsigned long",
        "long long int" => "long long",
        "long long unsigned int" => "unsigned long long",
        "short int" => "short",
        "short unsigned int" => "unsigned short",
        name => name,
    }
}

fn tag(keyword: &str, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{keyword} {name}"),
        None => format!("{keyword} {{...}}"),
    }
}

/// Returns a struct or union with its members, or an enumeration with its constants.
fn body(info: &DebugInfo, kind: &CType, depth: u32) -> String {
    match kind {
        CType::Record { keyword, name, members, .. } => {
            let mut text =
                format!("{} {{\n", name.as_ref().map_or((*keyword).to_owned(), |name| format!("{keyword} {name}")));
            for member in members {
                let of = member.member_type.and_then(|of| info.type_info(of));
                let own = match (&member.name, of) {
                    (None, Some(of @ CType::Record { .. })) if depth > 0 => {
                        body(info, of, depth - 1).replace('\n', "\n    ")
                    }
                    (Some(name), Some(of @ CType::Record { name: None, .. })) if depth > 0 => {
                        format!("{} {name}", body(info, of, depth - 1).replace('\n', "\n    "))
                    }
                    (name, _) => of_type(
                        info,
                        member.member_type,
                        name.as_deref().unwrap_or_default(),
                        Style::AddressNames,
                        MAX_DEPTH,
                    ),
                };
                let bits = member.bit_range.map_or(String::new(), |bits| format!(" : {}", bits.size));
                text.push_str(&format!("    {own}{bits};\n"));
            }
            if members.is_empty() {
                text.push_str("    <no data fields>\n");
            }
            text + "}"
        }
        CType::Enum { name, values, .. } => {
            let mut next = 0;
            let each = values.iter().map(|(name, value)| {
                let text = if *value == next { name.clone() } else { format!("{name} = {value}") };
                next = value.wrapping_add(1);
                text
            });
            let each: Vec<String> = each.collect();
            let head = name.as_ref().map_or("enum".to_owned(), |name| format!("enum {name}"));
            format!("{head} {{{}}}", each.join(", "))
        }
        _ => String::new(),
    }
}

/// An enumeration constant.
#[derive(Debug, Clone, Copy)]
pub(super) struct TypedEnumerator {
    /// The value.
    pub(super) value: i64,
    /// The enumeration.
    pub(super) kind: CTypeRef,
}

/// Returns the value and the type of the enumeration constant with this name.
pub(super) fn find_enumerator(info: &DebugInfo, wanted: &str) -> Option<TypedEnumerator> {
    info.types().find_map(|NumberedType { id, kind }| match kind {
        CType::Enum { values, .. } => {
            let (_, value) = values.iter().find(|(name, _)| name == wanted)?;
            Some(TypedEnumerator { value: *value, kind: CTypeRef::new(Some(id)) })
        }
        _ => None,
    })
}

/// Parses a type name: `uint8_t`, `struct order *`, `unsigned char`. `None` if there is no such type.
pub(super) fn find_type(info: &DebugInfo, text: &str) -> Option<CTypeRef> {
    let text = text.trim();
    let (bare, behind) = text.split_at(text.find('*').unwrap_or(text.len()));
    if behind.split(['*', ' ']).any(|word| !matches!(word, "" | "const" | "volatile")) {
        return None;
    }
    let stars = behind.matches('*').count();
    let is_qualifier = |word: &str| matches!(word, "const" | "volatile");
    let words: Vec<&str> = bare.split_whitespace().filter(|word| !is_qualifier(word)).collect();
    let qualifier = bare.split_whitespace().find(|word| is_qualifier(word));
    let stars = u32::try_from(stars).ok()?;
    if words == ["void"] {
        return Some(CTypeRef { id: None, pointer_depth: stars, ..CTypeRef::default() });
    }
    let wanted = canonical(&words);
    let is = |kind: &CType| match kind {
        CType::Named { name, .. } => *name == words.join(" "),
        CType::Base { name, .. } => canonical(&name.split_whitespace().collect::<Vec<_>>()) == wanted,
        CType::Record { keyword, name: Some(name), members, .. } => {
            words == [keyword, name.as_str()] && !members.is_empty()
        }
        CType::Enum { name: Some(name), .. } => words == ["enum", name.as_str()],
        _ => false,
    };
    // Start-up code has types with the same names as those of headers.
    let found = || info.types().filter(|NumberedType { kind, .. }| is(kind));
    let find_type = found().find(|NumberedType { kind, .. }| matches!(kind, CType::Named { .. }));
    let found = find_type.or_else(|| found().next()).map(|NumberedType { id, .. }| id);
    // Type names that the debugger also defines: `unsigned long` is the compiler's `long unsigned int`.
    let own = DebugInfo::builtin_type(&words.join(" "));
    let own = own.filter(|own| found.is_none_or(|found| info.size(Some(found)) == info.size(Some(*own))));
    let plain = found.and_then(|id| info.type_info(id)).is_none_or(|kind| matches!(kind, CType::Base { .. }));
    let found = own.filter(|_| plain).or(found)?;
    // A qualified type is a type of its own if the program defines it.
    let same = |of: &Option<TypeId>| {
        let of = of.and_then(|of| info.type_info(of));
        of == info.type_info(found)
            || matches!(of, Some(CType::Base { name, .. }) if canonical(&name.split_whitespace().collect::<Vec<_>>()) == wanted)
    };
    let found = qualifier
        .and_then(|word| {
            info.types()
                .find(|NumberedType { kind, .. }| matches!(kind, CType::Qualified { word: own, of } if *own == word && same(of)))
        })
        .map_or(found, |NumberedType { id, .. }| id);
    Some(CTypeRef { id: Some(found), pointer_depth: stars, ..CTypeRef::default() })
}

/// Returns the words of a type in a canonical order, without a redundant `int`: `long unsigned int` and
/// `unsigned long` are the same type.
fn canonical(words: &[&str]) -> Vec<String> {
    let mut words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
    let is_char = words.iter().any(|word| word == "char");
    if words.len() > 1 && !is_char {
        words.retain(|word| !matches!(word.as_str(), "int" | "signed"));
    }
    if words.is_empty() || words == ["signed"] {
        return vec!["int".to_owned()];
    }
    words.sort();
    words
}
