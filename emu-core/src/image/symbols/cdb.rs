//! Reads SDCC's debugging records, one per line: CDB File Format, section 4.
//!
//! ```text
//!   S:G$fast$0_0$0({1}SC:U),E,0,0     symbol: name, type with size in bytes, address space, stack
//!   F:G$main$0_0$0({2}DF,SV:S),C,..   function
//!   L:G$fast$0_0$0:10                 link address, hexadecimal
//!   M: module   T: type               not needed here; debug_info/cdb.rs reads types
//! ```

use crate::image::symbols::NumberedLine;
use std::collections::HashMap;

use diag::Pos;

use super::names::{self, DebugRecord, SymbolScope};
use super::{CollectedSymbols, FaultList, MemorySpace, SourceKind, numbered_lines, pos_of, shortened};

/// The contents of a symbol or function record.
#[derive(Debug, Clone, Copy)]
struct CdbSymbol {
    /// Memory; `None` for a variable on a stack or in registers.
    mem: Option<MemorySpace>,
    size: u32,
    function: bool,
}

/// A link record, which gives a name its address.
#[derive(Debug, Clone, Copy)]
struct CdbLink<'t> {
    /// The number of the line, from 1.
    number: u32,
    /// The text of the line.
    line: &'t str,
    /// The name as SDCC writes it, with scope and block.
    name: &'t str,
    /// The address.
    addr: u32,
}

/// What a record of a symbol and its link record have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct CdbKey<'t> {
    /// The module or function that the name is in.
    scope: SymbolScope<'t>,
    /// The name in the source.
    name: &'t str,
    /// The nesting level of the block, with a suffix in newer versions.
    level: &'t str,
    /// The number of the block.
    block: &'t str,
}

/// Reads a file of records.
pub(super) fn read_cdb(text: &str, found: &mut CollectedSymbols, faults: &mut FaultList) {
    let mut kinds: HashMap<CdbKey, CdbSymbol> = HashMap::new();
    let mut links = Vec::new();
    for NumberedLine { number, line } in numbered_lines(text).filter(|NumberedLine { line, .. }| !line.is_empty()) {
        if faults.is_full() {
            return;
        }
        match line.as_bytes() {
            [b'S' | b'F', b':', ..] => match symbol(line) {
                Ok(CdbSymbolRecord { key, symbol: kind }) => {
                    // A function has both records, and one of them may lack its memory.
                    let known = kinds.entry(key).or_insert(kind);
                    known.mem = known.mem.or(kind.mem);
                }
                Err(CdbDamage { part, cause: what }) => damaged(number, line, part, what, faults),
            },
            [b'L', b':', ..] => match link(line) {
                Ok(CdbLinkedName { name, addr }) => links.push(CdbLink { number, line, name, addr }),
                Err(CdbDamage { part, cause: what }) => damaged(number, line, part, what, faults),
            },
            [b'A'..=b'Z', b':', ..] => {}
            _ => damaged(number, line, line, "the line begins with no record type", faults),
        }
    }
    if links.is_empty() && faults.is_empty() {
        let cause = || format!("{} symbols, but no link address (record L)", kinds.len());
        let hint = "link with --debug as well and give the .cdb that the linker wrote";
        faults.error("SYM007", Pos::default(), cause, hint);
    }
    let functions = function_ends(&links, &kinds);
    for CdbLink { number, line, name, addr } in links {
        place_symbol(
            name,
            addr,
            CdbTables { kinds: &kinds, functions: &functions },
            pos_of(number, line, name),
            found,
            faults,
        );
    }
}

/// Returns the addresses of the functions, and below them those of their last instructions.
fn function_ends(links: &[CdbLink], kinds: &HashMap<CdbKey, CdbSymbol>) -> HashMap<u32, u32> {
    let ends = links.iter().filter_map(|CdbLink { name, addr, .. }| Some((name.strip_prefix('X')?, *addr)));
    let ends: HashMap<&str, u32> = ends.collect();
    let functions = links.iter().filter(|CdbLink { name, .. }| match names::parse_debug_record(name) {
        Some(DebugRecord::Symbol { scope, name, level, block }) => {
            kinds.get(&CdbKey { scope, name, level, block }).is_some_and(|kind| kind.function)
        }
        _ => false,
    });
    functions.map(|CdbLink { name, addr, .. }| (*addr, ends.get(name).copied().unwrap_or(*addr))).collect()
}

/// What the records of a file say before the links are read.
#[derive(Debug, Clone, Copy)]
struct CdbTables<'a> {
    /// The symbols by their keys.
    kinds: &'a HashMap<CdbKey<'a>, CdbSymbol>,
    /// The addresses of functions with those of their last instructions.
    functions: &'a HashMap<u32, u32>,
}

fn place_symbol(
    name: &str,
    addr: u32,
    CdbTables { kinds, functions }: CdbTables<'_>,
    pos: Pos,
    found: &mut CollectedSymbols,
    faults: &mut FaultList,
) {
    match names::parse_debug_record(name) {
        Some(DebugRecord::CLine { file, line }) => found.add_line(addr, SourceKind::C, file, line, pos, faults),
        Some(DebugRecord::AsmLine { module, line }) => {
            found.add_line(addr, SourceKind::Asm, &format!("{module}.asm"), line, pos, faults);
        }
        Some(DebugRecord::End) => {}
        Some(DebugRecord::Symbol { scope, name: short, level, block }) => {
            match kinds.get(&CdbKey { scope, name: short, level, block }) {
                Some(&CdbSymbol { mem: Some(mem), size, function }) => {
                    let size = match functions.get(&addr).filter(|_| mem == MemorySpace::Code) {
                        // From the first byte to the first of the last instruction, as in the line records.
                        Some(last) if function => last.saturating_sub(addr).saturating_add(1),
                        // A string that the linker has put into another one keeps an address of code.
                        Some(_) => 0,
                        None => size,
                    };
                    found.add_symbol(mem, addr, size, names::c_names(scope, short, block), pos, faults);
                }
                _ => found.unplaced.push((short.to_owned(), addr)),
            }
        }
        None => found.unplaced.push((name.to_owned(), addr)),
    }
}

/// The reason why a record cannot be read.
#[derive(Debug, Clone, Copy)]
struct CdbDamage<'t> {
    /// The part of the line that is wrong.
    part: &'t str,
    /// The reason, for the message.
    cause: &'static str,
}

/// A record of a symbol.
#[derive(Debug, Clone)]
struct CdbSymbolRecord<'t> {
    /// What identifies the symbol in link records.
    key: CdbKey<'t>,
    /// What the record says about it.
    symbol: CdbSymbol,
}

/// Parses `S:name({size}type),space,...`.
fn symbol(line: &str) -> Result<CdbSymbolRecord<'_>, CdbDamage<'_>> {
    let rest = line.get(2..).unwrap_or_default();
    let (name, _) =
        rest.split_once('(').ok_or(CdbDamage { part: rest, cause: "the type in parentheses is missing" })?;
    let Some(DebugRecord::Symbol { scope, name, level, block }) = names::parse_debug_record(name) else {
        return Err(CdbDamage { part: name, cause: "wanted a name such as G$main$0_0$0" });
    };
    let (chain, after) = rest.rsplit_once(')').ok_or(CdbDamage { part: rest, cause: "the type is not closed" })?;
    let chain = chain.split_once('(').map_or("", |(_, chain)| chain);
    let size = chain
        .strip_prefix('{')
        .and_then(|c| c.split_once('}'))
        .ok_or(CdbDamage { part: chain, cause: "the size in braces is missing" })?;
    let bytes: u32 = size.0.parse().map_err(|_| CdbDamage { part: size.0, cause: "the size is not a number" })?;
    let space = after.strip_prefix(',').map(|a| a.split(',').next().unwrap_or_default());
    let space = space.ok_or(CdbDamage { part: after, cause: "the address space is missing" })?;
    let function = size.1.starts_with("DF");
    let mem = match space {
        // A function that only a declaration or an interrupt table names has the address space of undefined
        // symbols.
        "C" | "D" => Some(MemorySpace::Code),
        "Z" if function => Some(MemorySpace::Code),
        "E" | "G" => Some(MemorySpace::Idata),
        "F" | "P" => Some(MemorySpace::Xdata),
        "H" | "J" => Some(MemorySpace::Bit),
        "I" => Some(MemorySpace::Sfr),
        "A" | "B" | "R" | "Z" => None,
        _ => {
            return Err(CdbDamage {
                part: if space.is_empty() { after } else { space },
                cause: "the address space is unknown",
            });
        }
    };
    // The size in the record of a function is that of a pointer to it; the size of a bit is in bytes.
    let size = if function { 0 } else { bytes };
    Ok(CdbSymbolRecord { key: CdbKey { scope, name, level, block }, symbol: CdbSymbol { mem, size, function } })
}

/// The content of a link record.
#[derive(Debug, Clone, Copy)]
struct CdbLinkedName<'a> {
    /// The name as SDCC writes it.
    name: &'a str,
    /// The address.
    addr: u32,
}

/// Parses `L:name:address`.
fn link(line: &str) -> Result<CdbLinkedName<'_>, CdbDamage<'_>> {
    let rest = line.get(2..).unwrap_or_default();
    let (name, addr) = rest.rsplit_once(':').ok_or(CdbDamage { part: rest, cause: "the address is missing" })?;
    if name.is_empty() {
        return Err(CdbDamage { part: rest, cause: "the name is missing" });
    }
    let digits = !addr.is_empty() && addr.bytes().all(|b| b.is_ascii_hexdigit());
    let addr = if digits { u32::from_str_radix(addr, 16).ok() } else { None }.ok_or(CdbDamage {
        part: if addr.is_empty() { rest } else { addr },
        cause: "the address is not a hexadecimal number of 32 bits",
    })?;
    Ok(CdbLinkedName { name, addr })
}

fn damaged(number: u32, line: &str, part: &str, what: &'static str, faults: &mut FaultList) {
    let cause = || format!("{what}: {:?}", shortened(part));
    faults.error("SYM003", pos_of(number, line, part), cause, "the file is cut off or damaged: build again");
}
