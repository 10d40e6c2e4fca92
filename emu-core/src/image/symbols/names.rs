//! Parses the debugging names that SDCC gives to symbols, and chooses the names for each address.
//!
//! ```text
//!   G$name$level$block              global                 XG$.. XF..   end of a function
//!   Fmodule$name$level$block        static of a module     A$module$line              assembler line
//!   Lmodule.func$name$level$block   static of a function   C$file$line$level$block    line of C
//! ```
//! CDB File Format (SDCC's `cdbfileformat`), sections 3 and 4. The level is `1_0` in newer versions, `1` in
//! older ones, and `0` for functions.

use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};

use super::{MemorySpace, SymbolFile};
use crate::image::SymbolAt;

/// A name of an address with the strength of its claim.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::image) struct RankedName {
    /// How strong the claim is.
    pub(in crate::image) rank: NameRank,
    /// The name.
    pub(in crate::image) name: String,
}

/// How strong the claim of an address on a name is. The strongest claim wins. Of several equal claims on a
/// name none wins, but two addresses for one [`NameRank::Exact`] name are an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::image) enum NameRank {
    /// The linker name.
    Exact,
    /// A static with everything that distinguishes it from others: `module.name`,
    /// `module.function.name$block`.
    Full,
    /// The C name of a global, without the underscore.
    Plain,
    /// A static of a function without its block, and without its module.
    Near,
    /// A static by its name only.
    Bare,
    /// A name whose end may be cut off.
    Cut,
}

/// An address with its names.
pub(in crate::image) struct SymbolEntry {
    pub mem: MemorySpace,
    pub addr: u32,
    pub size: u32,
    pub names: Vec<RankedName>,
    pub pos: Pos,
    pub file: usize,
}

/// A debugging name, parsed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::image) enum DebugRecord<'t> {
    Symbol {
        scope: SymbolScope<'t>,
        name: &'t str,
        level: &'t str,
        block: &'t str,
    },
    /// The end of a function.
    End,
    AsmLine {
        module: &'t str,
        line: u32,
    },
    CLine {
        file: &'t str,
        line: u32,
    },
}

/// Where a name is visible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(in crate::image) enum SymbolScope<'t> {
    Global,
    Module(&'t str),
    /// `module.function`, or only `function` in files of old versions.
    Function(&'t str),
}

/// Parses a debugging name; `None` for any other name.
pub(in crate::image) fn parse_debug_record(text: &str) -> Option<DebugRecord<'_>> {
    if let Some(rest) = text.strip_prefix("A$") {
        let (module, line) = rest.rsplit_once('$')?;
        return Some(DebugRecord::AsmLine { module: non_empty(module)?, line: line.parse().ok()? });
    }
    let mut parts = text.rsplitn(3, '$');
    let (block, level) = (non_empty(parts.next()?)?, non_empty(parts.next()?)?);
    let (scope, name) = parts.next()?.split_once('$')?;
    if !block.bytes().all(|b| b.is_ascii_digit()) || !level.bytes().all(|b| b.is_ascii_digit() || b == b'_') {
        return None;
    }
    if scope == "C" {
        let (file, line) = name.rsplit_once('$')?;
        return Some(DebugRecord::CLine { file: non_empty(file)?, line: line.parse().ok()? });
    }
    let scope = match (scope.get(..1)?, scope.get(1..)?) {
        ("G", "") => SymbolScope::Global,
        ("F", module) => SymbolScope::Module(non_empty(module)?),
        ("L", function) => SymbolScope::Function(non_empty(function)?),
        ("X", rest) if rest == "G" || rest.starts_with(['F', 'L']) => return Some(DebugRecord::End),
        _ => return None,
    };
    // Functions have the level `0` in one kind of record and `0_0` in the other.
    let level = level.split_once('_').map_or(level, |(level, _)| level);
    Some(DebugRecord::Symbol { scope, name: non_empty(name)?, level, block })
}

fn non_empty(text: &str) -> Option<&str> {
    (!text.is_empty()).then_some(text)
}

/// The ranked names of a symbol whose linker name is `name`.
pub(in crate::image) fn linker_names(name: &str) -> Vec<RankedName> {
    let plain = name
        .strip_prefix('_')
        .and_then(non_empty)
        .map(|plain| RankedName { rank: NameRank::Plain, name: plain.to_owned() });
    std::iter::once(RankedName { rank: NameRank::Exact, name: name.to_owned() }).chain(plain).collect()
}

/// The ranked names of a label that is local to its module.
pub(in crate::image) fn local_names(module: &str, name: &str) -> Vec<RankedName> {
    let plain = name.strip_prefix('_').and_then(non_empty);
    let each = [Some(name), plain].into_iter().flatten();
    let full = |name: &str| {
        (!module.is_empty()).then(|| RankedName { rank: NameRank::Full, name: format!("{module}.{name}") })
    };
    each.flat_map(|name| full(name).into_iter().chain([RankedName { rank: NameRank::Bare, name: name.to_owned() }]))
        .collect()
}

/// The ranked names of a symbol whose C name is `name`.
pub(super) fn c_names(scope: SymbolScope, name: &str, block: &str) -> Vec<RankedName> {
    match scope {
        SymbolScope::Global => linker_names(&format!("_{name}")),
        SymbolScope::Module(module) => {
            vec![
                RankedName { rank: NameRank::Full, name: format!("{module}.{name}") },
                RankedName { rank: NameRank::Bare, name: format!("_{name}") },
                RankedName { rank: NameRank::Bare, name: name.to_owned() },
            ]
        }
        SymbolScope::Function(path) => {
            let mut names = vec![
                RankedName { rank: NameRank::Full, name: format!("{path}.{name}${block}") },
                RankedName { rank: NameRank::Near, name: format!("{path}.{name}") },
                RankedName { rank: NameRank::Bare, name: name.to_owned() },
            ];
            if let Some((_, function)) = path.rsplit_once('.') {
                names.push(RankedName { rank: NameRank::Near, name: format!("{function}.{name}") });
            }
            names
        }
    }
}

/// Gives each name to the address with the strongest claim, and adds a fault for each name on which files
/// disagree.
pub(in crate::image) fn resolve_names(
    entries: &[SymbolEntry],
    files: &[SymbolFile],
    refused: &mut Vec<Diagnostic>,
) -> Vec<SymbolAt> {
    let mut claims: BTreeMap<(MemorySpace, &str), Vec<(NameRank, &SymbolEntry)>> = BTreeMap::new();
    for entry in entries {
        for RankedName { rank, name } in &entry.names {
            claims.entry((entry.mem, name)).or_default().push((*rank, entry));
        }
    }
    let mut symbols = Vec::new();
    for ((mem, name), claims) in claims {
        let Some(best) = claims.iter().map(|(rank, _)| *rank).min() else { continue };
        let mut strong = claims.iter().filter(|(rank, _)| *rank == best).map(|(_, entry)| *entry);
        let Some(first) = strong.next() else { continue };
        match strong.find(|entry| entry.addr != first.addr) {
            None => {
                let same = claims.iter().filter(|(_, entry)| entry.addr == first.addr);
                let size = same.map(|(_, entry)| entry.size).max().unwrap_or(0);
                symbols.push((mem, SymbolAt::new(name, mem.name(), first.addr, size)));
            }
            Some(other) if best == NameRank::Exact && refused.len() < crate::image::MAX_REPORTED => {
                refused.push(disagreement(name, first, other, files));
            }
            Some(_) => {}
        }
    }
    symbols.sort_by(|(a, x), (b, y)| (a, x.addr, &x.name).cmp(&(b, y.addr, &y.name)));
    symbols.into_iter().map(|(_, symbol)| symbol).collect()
}

fn disagreement(name: &str, first: &SymbolEntry, other: &SymbolEntry, files: &[SymbolFile]) -> Diagnostic {
    let file = |entry: &SymbolEntry| files.get(entry.file).map_or("", |file| file.name);
    let (space, name) = (first.mem.name(), super::shortened(name));
    let cause = format!(
        "{space} symbol `{name}` is at 0x{:04X}, but at 0x{:04X} in {}:{}",
        other.addr,
        first.addr,
        file(first),
        first.pos.line
    );
    let hint = "the files are of different builds: build again and give the files of one build";
    Diagnostic::new(Severity::Error, "SYM008", file(other), other.pos, cause, hint)
}
