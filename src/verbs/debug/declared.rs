//! `info functions`, `info variables` and `info types`: lists the declarations of the program by file, as gdb
//! does.

use std::collections::BTreeSet;

use emu_core::image::SymbolAt;
use emu_debug::bit_space::BIT_SPACE;
use emu_debug::debug::{Declaration, DeclarationKind};

use super::shell::{CommandResult, DebugShell};
use super::types::name_filter;

/// First address of the special function registers of an 8051, and of their bits.
const FIRST_SFR: u32 = 0x80;

/// `info types`: lists the named types.
pub(super) fn types(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let wanted = name_filter(args)?;
    let found = shell.session.scope.declarations(DeclarationKind::Type);
    heading("types", args, out);
    by_files(found.iter().filter(|own| wanted.is_match(&own.name)), out);
    Ok(())
}

fn heading(what: &str, args: &str, out: &mut String) {
    out.push_str(&match args {
        "" => format!("All defined {what}:\n"),
        args => format!("All {what} matching regular expression \"{args}\":\n"),
    });
}

fn by_files<'a>(found: impl Iterator<Item = &'a Declaration>, out: &mut String) {
    let mut last = None;
    for Declaration { file, line, text, .. } in found {
        if last != Some(file) {
            out.push_str(&format!("\nFile {}:\n", if file.is_empty() { "<unknown>" } else { file }));
            last = Some(file);
        }
        let line = if *line == 0 { String::new() } else { format!("{line}:") };
        out.push_str(&format!("{line}\t{text}\n"));
    }
}

/// `info functions` and `info variables`: lists the declarations of C, then the other symbols of program
/// memory or of the other memories. A regular expression selects by name.
pub(super) fn info_kind(shell: &DebugShell, args: &str, code: bool, out: &mut String) -> CommandResult {
    let wanted = name_filter(args)?;
    let scope = &shell.session.scope;
    let chip = scope.chip();
    let (kind, what) =
        if code { (DeclarationKind::Function, "functions") } else { (DeclarationKind::Variable, "variables") };
    let declared = scope.declarations(kind);
    heading(what, args, out);
    by_files(declared.iter().filter(|own| wanted.is_match(&own.name)), out);
    // Spaces of bits and registers contain names of the chip, not of the program.
    let is = |space: &str| {
        !(chip.reg_space == space && chip.reg_space != chip.ram_space)
            && (space == chip.code_space) == code
            && chip.spaces.iter().any(|own| own.name == space)
    };
    // SDCC and its headers define a symbol for each register of the chip, and put an underscore before every
    // name.
    let own = |name: &str| {
        let bare = name.trim_start_matches('_');
        chip.reg(bare).is_some() || chip.bit(bare).is_some() || chip.bits.iter().any(|bit| bit.name == bare)
    };
    let is_declared = |name: &str| declared.iter().any(|own| own.name == name);
    let doubled = |name: &str| {
        let other = |bare| scope.symbols.iter().any(|other| other.name == bare);
        name.strip_prefix('_').is_some_and(|bare| other(bare) || is_declared(bare))
    };
    // SDCC also defines statics with their module and function, and bits of registers from its headers.
    let is_sdcc = chip.has_sdcc_pointers() && scope.has_debug_info();
    let others = if is_sdcc { scope.declarations(DeclarationKind::Variable) } else { Vec::new() };
    let of_sdcc = |symbol: &SymbolAt| {
        is_sdcc
            && (symbol.name.contains('.')
                || symbol.space == BIT_SPACE && symbol.addr >= FIRST_SFR
                || others.iter().any(|own| own.name == symbol.name))
    };
    let fresh = |name: &str| !own(name) && !doubled(name) && !is_declared(name);
    let symbols = scope.symbols.iter().filter(|symbol| is(symbol.space) && fresh(&symbol.name) && !of_sdcc(symbol));
    let row = |space: &'static str, addr: u32, name: &str| {
        let addr = addr / chip.bytes_per_address(space).max(1);
        let place = match chip.linked_address(space, addr) {
            _ if code => format!("0x{addr:08x}"),
            Some(linked) => format!("0x{linked:08x}"),
            None => format!("{space}:0x{addr:04x}"),
        };
        (place, name.to_owned())
    };
    let rows: BTreeSet<(String, String)> = symbols
        .filter(|symbol| wanted.is_match(&symbol.name))
        .map(|symbol| row(symbol.space, symbol.addr, &symbol.name))
        .collect();
    if !rows.is_empty() {
        out.push_str("\nNon-debugging symbols:\n");
    }
    rows.iter().for_each(|(place, name)| out.push_str(&format!("{place}  {name}\n")));
    Ok(())
}
