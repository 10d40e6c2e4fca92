//! SDCC's debugging records, one a line: CDB File Format, section 4.
//!
//! ```text
//!   S:G$fast$0_0$0({1}SC:U),E,0,0     symbol: name, type with size in bytes, address space, stack
//!   F:G$main$0_0$0({2}DF,SV:S),C,..   function
//!   L:G$fast$0_0$0:10                 link address, hexadecimal
//!   M: module   T: type               not needed
//! ```

use std::collections::HashMap;

use diag::Pos;

use super::names::{self, Debug, Scope};
use super::{Faults, Found, LineKind, Mem, numbered, pos_of, short};

/// What a symbol or function record says.
#[derive(Clone, Copy)]
struct Kind {
    /// None for what lies on a stack or in registers.
    mem: Option<Mem>,
    size: u32,
}

type Key<'t> = (Scope<'t>, &'t str, &'t str, &'t str);

/// Reads a file of records.
pub(super) fn read(text: &str, found: &mut Found, faults: &mut Faults) {
    let mut kinds: HashMap<Key, Kind> = HashMap::new();
    let mut links = Vec::new();
    for (number, line) in numbered(text).filter(|(_, line)| !line.is_empty()) {
        if faults.full() {
            return;
        }
        match line.as_bytes() {
            [b'S' | b'F', b':', ..] => match symbol(line) {
                Ok((key, kind)) => {
                    // A function has both records; one of them may not know where it lies.
                    let known = kinds.entry(key).or_insert(kind);
                    known.mem = known.mem.or(kind.mem);
                }
                Err((part, what)) => damaged(number, line, part, what, faults),
            },
            [b'L', b':', ..] => match link(line) {
                Ok((name, addr)) => links.push((number, line, name, addr)),
                Err((part, what)) => damaged(number, line, part, what, faults),
            },
            [b'A'..=b'Z', b':', ..] => {}
            _ => damaged(number, line, line, "the line begins with no record type", faults),
        }
    }
    if links.is_empty() && faults.none() {
        let cause = || format!("{} symbols, but no link address (record L)", kinds.len());
        let hint = "link with --debug as well and give the .cdb that the linker wrote";
        faults.error("SYM007", Pos::default(), cause, hint);
    }
    for (number, line, name, addr) in links {
        place(name, addr, &kinds, pos_of(number, line, name), found, faults);
    }
}

fn place(name: &str, addr: u32, kinds: &HashMap<Key, Kind>, pos: Pos, found: &mut Found, faults: &mut Faults) {
    match names::debug(name) {
        Some(Debug::CLine { file, line }) => found.line(addr, LineKind::C, file, line, pos, faults),
        Some(Debug::AsmLine { module, line }) => {
            found.line(addr, LineKind::Asm, &format!("{module}.asm"), line, pos, faults);
        }
        Some(Debug::End) => {}
        Some(Debug::Symbol { scope, name: short, level, block }) => match kinds.get(&(scope, short, level, block)) {
            Some(&Kind { mem: Some(mem), size }) => {
                found.place(mem, addr, size, names::in_c(scope, short, block), pos, faults);
            }
            _ => found.unplaced.push((short.to_owned(), addr)),
        },
        None => found.unplaced.push((name.to_owned(), addr)),
    }
}

type Damage<'t> = (&'t str, &'static str);

/// `S:name({size}type),space,...`
fn symbol(line: &str) -> Result<(Key<'_>, Kind), Damage<'_>> {
    let rest = line.get(2..).unwrap_or_default();
    let (name, _) = rest.split_once('(').ok_or((rest, "the type in parentheses is missing"))?;
    let Some(Debug::Symbol { scope, name, level, block }) = names::debug(name) else {
        return Err((name, "wanted a name such as G$main$0_0$0"));
    };
    let (chain, after) = rest.rsplit_once(')').ok_or((rest, "the type is not closed"))?;
    let chain = chain.split_once('(').map_or("", |(_, chain)| chain);
    let size =
        chain.strip_prefix('{').and_then(|c| c.split_once('}')).ok_or((chain, "the size in braces is missing"))?;
    let bytes: u32 = size.0.parse().map_err(|_| (size.0, "the size is no number"))?;
    let space = after.strip_prefix(',').map(|a| a.split(',').next().unwrap_or_default());
    let space = space.ok_or((after, "the address space is missing"))?;
    let function = size.1.starts_with("DF");
    let mem = match space {
        // A function that only a declaration or an interrupt table names has the space of undefined symbols.
        "C" | "D" => Some(Mem::Code),
        "Z" if function => Some(Mem::Code),
        "E" | "G" => Some(Mem::Idata),
        "F" | "P" => Some(Mem::Xdata),
        "H" | "J" => Some(Mem::Bit),
        "I" => Some(Mem::Sfr),
        "A" | "B" | "R" | "Z" => None,
        _ => return Err((if space.is_empty() { after } else { space }, "the address space is unknown")),
    };
    // The size of a function's record is that of a pointer to it; that of a bit is in bytes.
    let size = if function { 0 } else { bytes };
    Ok(((scope, name, level, block), Kind { mem, size }))
}

/// `L:name:address`
fn link(line: &str) -> Result<(&str, u32), Damage<'_>> {
    let rest = line.get(2..).unwrap_or_default();
    let (name, addr) = rest.rsplit_once(':').ok_or((rest, "the address is missing"))?;
    if name.is_empty() {
        return Err((rest, "the name is missing"));
    }
    let digits = !addr.is_empty() && addr.bytes().all(|b| b.is_ascii_hexdigit());
    let addr = if digits { u32::from_str_radix(addr, 16).ok() } else { None }
        .ok_or((if addr.is_empty() { rest } else { addr }, "the address is no hexadecimal number of 32 bits"))?;
    Ok((name, addr))
}

fn damaged(number: u32, line: &str, part: &str, what: &'static str, faults: &mut Faults) {
    let cause = || format!("{what}: {:?}", short(part));
    faults.error("SYM003", pos_of(number, line, part), cause, "the file is cut off or damaged: build anew");
}
