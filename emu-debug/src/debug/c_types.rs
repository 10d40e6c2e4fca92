//! Types of C as text, as gdb writes them.

use emu_core::image::{CType, DebugInfo, TypeId};

use super::c_type_queries::{CTypeRef, CTypeQueries as _};

/// Deepest nesting of types, so that no file can exhaust the stack.
const MAX_DEPTH: u32 = 32;

/// The name of a type around the name of what has it: `int (*f)(void)`.
pub(super) fn declaration(info: &DebugInfo, kind: CTypeRef, inner: &str) -> String {
    if kind.pointer_depth > 0 {
        let pointed = CTypeRef { pointer_depth: kind.pointer_depth - 1, ..kind };
        let behind =
            pointed.pointer_depth == 0 && matches!(info.resolve_type(pointed), Some(CType::Array { .. } | CType::Function { .. }));
        let own = is_direct(info, pointed) && behind;
        return declaration(info, pointed, &if own { format!("(*{inner})") } else { format!("*{inner}") });
    }
    if kind.indexed_dimensions > 0
        && let Some((of, counts)) = info.array(kind)
    {
        return of_type(info, of, &format!("{inner}{}", dimensions(counts)), MAX_DEPTH);
    }
    of_type(info, kind.id, inner, MAX_DEPTH)
}

/// It is an array or a function itself, not a name of one.
fn is_direct(info: &DebugInfo, kind: CTypeRef) -> bool {
    let is = |id: TypeId| matches!(info.type_info(id), Some(CType::Array { .. } | CType::Function { .. }));
    kind.pointer_depth == 0 && kind.id.is_some_and(is)
}

fn dimensions(counts: &[Option<u32>]) -> String {
    counts.iter().map(|count| count.map_or("[]".to_owned(), |count| format!("[{count}]"))).collect()
}

fn joined(word: &str, inner: &str) -> String {
    if inner.is_empty() { word.to_owned() } else { format!("{word} {inner}") }
}

fn of_type(info: &DebugInfo, id: Option<TypeId>, inner: &str, depth: u32) -> String {
    let Some(kind) = id.and_then(|id| info.type_info(id)).filter(|_| depth > 0) else { return joined("void", inner) };
    let below = |id, inner: &str| of_type(info, id, inner, depth - 1);
    match kind {
        CType::Base { name, .. } | CType::Named { name, .. } => joined(name, inner),
        CType::Record { keyword, name, .. } => joined(&tag(keyword, name.as_deref()), inner),
        CType::Enum { name, .. } => joined(&tag("enum", name.as_deref()), inner),
        CType::Pointer { to, .. } => {
            let direct = to.and_then(|to| info.type_info(to));
            match direct {
                Some(CType::Array { .. } | CType::Function { .. }) => below(*to, &format!("(*{inner})")),
                _ => below(*to, &format!("*{inner}")),
            }
        }
        CType::Qualified { word, of } => match of.and_then(|of| info.type_info(of)) {
            // Of a pointer it comes behind the star.
            Some(CType::Pointer { to, .. }) => below(*to, &format!("* {}", joined(word, inner))),
            _ => format!("{word} {}", below(*of, inner)),
        },
        CType::Array { of, counts } => {
            let space = if inner.is_empty() || inner.starts_with('[') { " " } else { "" };
            let text = format!("{inner}{}", dimensions(counts));
            let found = below(*of, &text);
            if space.is_empty() { found } else { found.replace("  ", " ") }
        }
        CType::Function { result, parameters } => {
            let list: Vec<String> = parameters.iter().map(|of| below(*of, "")).collect();
            let list = if list.is_empty() { "void".to_owned() } else { list.join(", ") };
            below(*result, &format!("{inner}({list})"))
        }
    }
}

fn tag(keyword: &str, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{keyword} {name}"),
        None => format!("{keyword} {{...}}"),
    }
}

/// A type with the members of a struct or union and the constants of an enumeration, without its names, as `ptype` has it.
pub(super) fn type_definition(info: &DebugInfo, kind: CTypeRef) -> String {
    if kind.pointer_depth > 0 {
        let inner = type_definition(info, CTypeRef { pointer_depth: kind.pointer_depth - 1, ..kind });
        return starred(&inner);
    }
    body(info, kind.id, MAX_DEPTH)
}

fn starred(inner: &str) -> String {
    if inner.ends_with('*') { format!("{inner}*") } else { format!("{inner} *") }
}

fn body(info: &DebugInfo, id: Option<TypeId>, depth: u32) -> String {
    let Some(kind) = id.and_then(|id| info.type_info(id)).filter(|_| depth > 0) else { return "void".to_owned() };
    match kind {
        CType::Named { of, .. } => body(info, *of, depth - 1),
        CType::Qualified { word, of } => match info.resolve_typedefs(*of).and_then(|of| info.type_info(of)) {
            Some(CType::Pointer { .. }) => format!("{} {word}", body(info, *of, depth - 1)),
            _ => format!("{word} {}", body(info, *of, depth - 1)),
        },
        CType::Pointer { to, .. } => match info.resolve_typedefs(*to).and_then(|to| info.type_info(to)) {
            Some(CType::Array { .. } | CType::Function { .. }) => of_type(info, id, "", MAX_DEPTH),
            _ => starred(&body(info, *to, depth - 1)),
        },
        CType::Array { of, counts } => format!("{} {}", body(info, *of, depth - 1), dimensions(counts)),
        CType::Record { keyword, name, members, .. } => {
            let mut text =
                format!("{} {{\n", name.as_ref().map_or((*keyword).to_owned(), |name| format!("{keyword} {name}")));
            for member in members {
                let own = match (&member.name, member.member_type.and_then(|of| info.type_info(of))) {
                    (None, Some(CType::Record { .. })) => body(info, member.member_type, depth - 1).replace('\n', "\n    "),
                    (name, _) => of_type(info, member.member_type, name.as_deref().unwrap_or_default(), MAX_DEPTH),
                };
                let bits = member.bit_range.map_or(String::new(), |(_, size)| format!(" : {size}"));
                text.push_str(&format!("    {own}{bits};\n"));
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
        CType::Base { .. } | CType::Function { .. } => of_type(info, id, "", MAX_DEPTH),
    }
}

/// The constant of an enumeration that has this name, and its type.
pub(super) fn find_enumerator(info: &DebugInfo, wanted: &str) -> Option<(i64, CTypeRef)> {
    info.types().find_map(|(id, kind)| match kind {
        CType::Enum { values, .. } => {
            let (_, value) = values.iter().find(|(name, _)| name == wanted)?;
            Some((*value, CTypeRef::new(Some(id))))
        }
        _ => None,
    })
}

/// The type that a text names: `uint8_t`, `struct order *`, `unsigned char`. Nothing where it names none.
pub(super) fn find_type(info: &DebugInfo, text: &str) -> Option<CTypeRef> {
    let text = text.trim();
    let bare = text.trim_end_matches(|c: char| c == '*' || c.is_whitespace());
    let stars = text[bare.len()..].matches('*').count();
    let words: Vec<&str> = bare.split_whitespace().filter(|word| !matches!(*word, "const" | "volatile")).collect();
    let stars = u32::try_from(stars).ok()?;
    if words == ["void"] {
        return Some(CTypeRef { id: None, pointer_depth: stars, indexed_dimensions: 0 });
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
    let found = info.types().find(|(_, kind)| is(kind)).map(|(id, _)| id)?;
    Some(CTypeRef { id: Some(found), pointer_depth: stars, indexed_dimensions: 0 })
}

/// `long unsigned int` and `unsigned long` are one type: its words in order, without `int` where others say enough.
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
