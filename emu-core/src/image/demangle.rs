//! Demangles the linker names of C++ and Rust compilers.
//!
//! C++ names follow the Itanium ABI (`_Z...`) and are parsed by `cpp_demangle`. Rust names in both schemes
//! (`_R...` and `_ZN...17h<hash>E`) are parsed by `rustc-demangle`. The names come from files, so the lengths
//! of both input and output are limited: a name of a few bytes can refer to parts of itself and expand
//! without bound.

use std::borrow::Cow;
use std::fmt::{self, Write};
use std::iter;
use std::ops::Range;

use cpp_demangle::{BorrowedSymbol, DemangleOptions};

/// Maximum length of a mangled and of a demangled name, in bytes.
const MAX_NAME: usize = 4096;

/// A name in the language of the program, together with its linker name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct DemangledName {
    /// The name as the linker wrote it: `_ZN3app7computeER5Shapei`.
    pub linkage: String,
    /// Namespaces and name without parameters: `app::compute`.
    pub path: String,
}

/// What a name of the linker is in the language of the program.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct SourceName {
    /// The whole name, as gdb prints it.
    pub whole: String,
    /// As [`DemangledName::path`].
    pub path: String,
}

impl SourceName {
    /// A name without parameters.
    fn plain(name: String) -> SourceName {
        SourceName { whole: name.clone(), path: name }
    }
}

/// What a name of the linker is in the language of the program; nothing for names that no compiler has
/// mangled.
#[must_use]
pub(super) fn demangle(name: &str) -> Option<SourceName> {
    if name.len() > MAX_NAME || !name.starts_with("_Z") && !name.starts_with("_R") {
        return None;
    }
    if let Ok(rust) = rustc_demangle::try_demangle(name) {
        // Without the hash, which no source contains.
        let whole = write_limited(|out| write!(out, "{rust:#}"))?;
        return Some(SourceName::plain(whole));
    }
    let symbol = BorrowedSymbol::new(name.as_bytes()).ok()?;
    let options = DemangleOptions::new().no_return_type();
    let whole = write_limited(|out| symbol.structured_demangle(out, &options).map_err(|_| fmt::Error))?;
    if let Some(special) = describe_special_symbol(name, &whole) {
        return Some(SourceName::plain(special));
    }
    let path = write_limited(|out| symbol.structured_demangle(out, &options.no_params()).map_err(|_| fmt::Error))?;
    Some(SourceName { whole, path })
}

/// Describes a symbol that a compiler makes for a class, as c++filt prints it: `vtable for Shape` where
/// `cpp_demangle` prints `{vtable(Shape)}`.
fn describe_special_symbol(name: &str, whole: &str) -> Option<String> {
    let (what, of) = whole.strip_prefix('{')?.strip_suffix(")}")?.split_once('(')?;
    Some(match what {
        "virtual override thunk" => {
            let kind = if name.starts_with("_ZTv") { "virtual" } else { "non-virtual" };
            format!("{kind} thunk to {}", of.split_once("}), ").or(of.split_once(", ")).map_or(of, |(_, of)| of))
        }
        "vtt" => format!("VTT for {of}"),
        "static initialization guard" => format!("guard variable for {of}"),
        _ => format!("{what} for {of}"),
    })
}

/// A path without the arguments of its last template: `app::twice` for `app::twice<int>`.
pub(super) fn without_arguments(path: &str) -> &str {
    let mut depth = 0u32;
    for (at, c) in path.char_indices().rev() {
        match c {
            '>' => depth += 1,
            '<' => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return path.get(..at).unwrap_or(path);
                }
            }
            _ if depth == 0 => return path,
            _ => {}
        }
    }
    path
}

/// Removes the parameters of the functions that contain the last name of a path, and the result type of the
/// first of them. For example, a static variable in a function, `int app::twice<int>(int)::last`, becomes
/// `app::twice<int>::last`.
pub(super) fn without_outer_parameters(path: &str) -> Cow<'_, str> {
    let groups = groups_before_names(path, ['(', ')']);
    let name = groups.first().and_then(|group| path.get(..group.start)).filter(|name| !name.contains("operator"));
    let returned = name.map_or(0, |name| {
        let mut depth = 0u32;
        let space = name.char_indices().rev().find(|(_, c)| {
            match c {
                '>' | ')' => depth += 1,
                '<' | '(' => depth = depth.saturating_sub(1),
                _ => {}
            }
            *c == ' ' && depth == 0
        });
        space.map_or(0, |(at, _)| at + 1)
    });
    if returned == 0 {
        without_ranges(path, &groups)
    } else {
        without_ranges(path, &[iter::once(0..returned).collect(), groups].concat())
    }
}

/// Removes the arguments of the templates that contain the last name of a path: `Stack::push` for
/// `Stack<int>::push`.
pub(super) fn without_outer_arguments(path: &str) -> Cow<'_, str> {
    without_ranges(path, &groups_before_names(path, ['<', '>']))
}

/// Finds bracketed groups that belong to a name and are followed by another name, including the qualifiers of
/// a method: `(int) const` in `f(int) const::count`. They are in order from left to right and not nested.
fn groups_before_names(path: &str, [open, close]: [char; 2]) -> Vec<Range<usize>> {
    const QUALIFIERS: [&str; 4] = [" const", " volatile", "&", " "];
    let mut found: Vec<Range<usize>> = Vec::new();
    for (end, _) in path.rmatch_indices("::") {
        if found.last().is_some_and(|group| end > group.start) {
            continue;
        }
        let mut front = path.get(..end).unwrap_or_default();
        while let Some(shorter) = QUALIFIERS.iter().find_map(|qualifier| front.strip_suffix(qualifier)) {
            front = shorter;
        }
        if !front.ends_with(close) {
            continue;
        }
        let mut depth = 0u32;
        let start = front.char_indices().rev().find(|(_, c)| {
            depth = if *c == close { depth + 1 } else { depth.saturating_sub(u32::from(*c == open)) };
            depth == 0
        });
        // A group with no name before it is a name itself: `(anonymous namespace)`.
        let named = |start: &usize| path.get(..*start).is_some_and(|name| !name.is_empty() && !name.ends_with("::"));
        found.extend(start.map(|(start, _)| start).filter(named).map(|start| start..end));
    }
    found.reverse();
    found
}

/// The text without these parts, which must be in ascending order.
fn without_ranges<'p>(text: &'p str, parts: &[Range<usize>]) -> Cow<'p, str> {
    if parts.is_empty() {
        return Cow::Borrowed(text);
    }
    let starts = iter::once(0).chain(parts.iter().map(|part| part.end));
    let ends = parts.iter().map(|part| part.start).chain([text.len()]);
    Cow::Owned(starts.zip(ends).filter_map(|(start, end)| text.get(start..end)).collect())
}

/// What `write` writes, or `None` if it is empty, too long or fails.
fn write_limited(write: impl FnOnce(&mut LimitedString) -> fmt::Result) -> Option<String> {
    let mut out = LimitedString(String::new());
    write(&mut out).ok()?;
    (!out.0.is_empty()).then_some(out.0)
}

/// A string that rejects writes beyond a length of [`MAX_NAME`] bytes.
struct LimitedString(String);

impl Write for LimitedString {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        if self.0.len() + text.len() > MAX_NAME {
            return Err(fmt::Error);
        }
        self.0.push_str(text);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{SourceName, demangle, without_outer_arguments, without_outer_parameters};

    #[test]
    fn outer_functions_lose_their_parameters() {
        let table = [
            ("f(int)::cnt", "f::cnt", "f::cnt"),
            ("app::S::g(char) const::n", "app::S::g::n", "app::S::g::n"),
            ("int app::twice<int>(int)::last", "app::twice<int>::last", "app::twice::last"),
            ("Stack<A<int> >::push(A<int> const&)::n", "Stack<A<int> >::push::n", "Stack::push::n"),
            ("f(g(int)::T)::n", "f::n", "f::n"),
            ("(anonymous namespace)::four()::n", "(anonymous namespace)::four::n", "(anonymous namespace)::four::n"),
            ("f()::{lambda(int)#1}::operator()(int) const::n", "f::{lambda(int)#1}::operator()::n", ""),
            ("A::operator bool() const::n", "A::operator bool::n", "A::operator bool::n"),
            ("app::area", "app::area", "app::area"),
            (")::", ")::", ")::"),
            ("", "", ""),
        ];
        for (path, bare, generic) in table {
            let found = without_outer_parameters(path);
            assert_eq!(found, bare, "{path}");
            let generic = if generic.is_empty() { bare } else { generic };
            assert_eq!(without_outer_arguments(&found), generic, "{path}");
        }
    }

    fn demangled_pair(name: &str) -> String {
        demangle(name).map_or("-".to_owned(), |found| format!("{} | {}", found.whole, found.path))
    }

    #[test]
    fn names_of_every_scheme() {
        let table = [
            ("_ZN3app7computeER5Shapei", "app::compute(Shape&, int) | app::compute"),
            ("_ZN3app6resultE", "app::result | app::result"),
            ("_ZN2SqC2Ei", "Sq::Sq(int) | Sq::Sq"),
            ("_ZN2SqD0Ev", "Sq::~Sq() | Sq::~Sq"),
            ("_ZTV2Sq", "vtable for Sq | vtable for Sq"),
            ("_ZTI2Sq", "typeinfo for Sq | typeinfo for Sq"),
            ("_ZGVZ4mainE1s", "guard variable for main::s | guard variable for main::s"),
            ("_ZThn2_N2Sq4areaEv", "non-virtual thunk to Sq::area() | non-virtual thunk to Sq::area()"),
            ("_ZL5count", "count | count"),
            ("_Z5twiceIiET_S0_", "twice<int>(int) | twice<int>"),
            ("_ZN1AclEi", "A::operator()(int) | A::operator()"),
            ("_ZN12_GLOBAL__N_14fourEv", "(anonymous namespace)::four() | (anonymous namespace)::four"),
            ("_Z5scalei.constprop.0", "scale(int) [clone .constprop.0] | scale"),
            ("_ZN3app7compute17h0123456789abcdefE", "app::compute | app::compute"),
            ("_RNvNtC7mycrate3app7compute", "mycrate::app::compute | mycrate::app::compute"),
            ("main", "- | -"),
            ("_", "- | -"),
            ("_Z", "- | -"),
            ("_Rest", "- | -"),
            ("_ZN3ap", "- | -"),
            ("__vector_16", "- | -"),
        ];
        for (name, wanted) in table {
            assert_eq!(demangled_pair(name), wanted.replace("- | -", "-"), "{name}");
        }
    }

    #[test]
    fn arguments_of_templates_are_left_out() {
        for (path, wanted) in
            [("twice<int>", "twice"), ("a::b<c<d>, e>", "a::b"), ("a<b>::c", "a<b>::c"), (">", ">"), ("", "")]
        {
            assert_eq!(super::without_arguments(path), wanted);
        }
    }

    #[test]
    fn a_name_without_end_has_a_limit() {
        // Each pair contains the previous one twice.
        let mut name = "_Z1fSt4pairIiiE".to_owned();
        for depth in 0..40 {
            let earlier = if depth == 0 { "S_".to_owned() } else { format!("S{}_", depth - 1) };
            name.push_str(&format!("St4pairI{earlier}{earlier}E"));
        }
        assert!(demangle(&name).is_none_or(|found| found.whole.len() <= super::MAX_NAME));
        assert_eq!(demangle(&format!("_Z{}", "N".repeat(5000))), None);
        assert_eq!(demangle(&format!("_Z1f{}i", "P".repeat(4000))), None);
    }

    /// Names come from files: any input must give an answer.
    #[test]
    fn damaged_names_are_answered() {
        let names: [&[u8]; 6] = [
            b"_ZN3app7computeIN1A1BEEEvR5ShapeT_S2_DpT0_",
            b"_ZNK3std4pairIiSt6vectorIcSaIcEEE5firstEPFvS1_EM1CKFivE",
            b"_ZZN1A1fEvENKUlT_E_clIiEEDaS0_",
            b"_ZN12_GLOBAL__N_1L3fooILi3EXadL_Z3barvEEEEDTcl1gfp_EET_",
            b"_RINvNtC3std3mem8align_ofNtNtC3std3mem12DiscriminantE",
            b"_RNvXs_NtC5crate3fooINtB4_3BarTRlAshj4_FG_EuEENtNtB4_5trait1T1f",
        ];
        let letters = b"SNTILEKRPFDACMUZXcdtvij_0123456789.$ ";
        let mut rng = crate::rng::Rng::new(5);
        let mut below = |n: usize| usize::try_from(rng.below(n as u64)).unwrap_or(0);
        for round in 0..60_000 {
            let mut name = names[round % names.len()].to_vec();
            for _ in 0..=below(6) {
                let (at, letter) = (2 + below(name.len() - 2), letters[below(letters.len())]);
                match below(4) {
                    0 => name.insert(at, letter),
                    1 if name.len() > 8 => _ = name.remove(at),
                    2 => name.extend_from_within(at..),
                    _ => name[at] = letter,
                }
                name.truncate(600);
            }
            let name = String::from_utf8_lossy(&name).into_owned();
            if let Some(SourceName { whole, path }) = demangle(&name) {
                assert!(whole.len() <= super::MAX_NAME && path.len() <= super::MAX_NAME, "{name}");
            }
        }
    }
}
