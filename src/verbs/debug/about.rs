//! `info` about the program as a whole: its types, its memories, what it does not have.

use std::collections::BTreeSet;

use emu_core::image::CType;

use super::info;
use super::numbers::hex;
use super::shell::{CommandResult, DebugShell};

/// `info types`: the types that have a name.
pub(super) fn types(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let wanted = super::types::name_filter(args)?;
    let known = &shell.session.scope.calls().info;
    let named = known.types().filter_map(|(_, kind)| match kind {
        CType::Base { name, .. } => Some(name.clone()),
        CType::Named { name, .. } => Some(format!("typedef {name}")),
        CType::Record { keyword, name: Some(name), .. } => Some(format!("{keyword} {name}")),
        CType::Enum { name: Some(name), .. } => Some(format!("enum {name}")),
        _ => None,
    });
    let names: BTreeSet<String> = named.filter(|name| wanted.is_match(name)).collect();
    if names.is_empty() {
        out.push_str("no types\n");
    }
    names.iter().for_each(|name| out.push_str(&format!("{name}\n")));
    Ok(())
}

/// `info scope LOCATION`: parameters and variables of the function there.
pub(super) fn scope(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("of which location? info scope price, info scope main.c:12".to_owned());
    }
    let word = shell.parse_line_location(args)?.first().copied().unwrap_or_default();
    let scope = &shell.session.scope;
    let variables = scope.variables_at(word);
    if variables.is_empty() {
        out.push_str(&format!("No locals at {args}.\n"));
    }
    for (name, object) in variables {
        let bytes = object.bytes().unwrap_or(0);
        out.push_str(&format!("Symbol {name} is a variable of type {}, length {bytes}\n", object.type_name()));
    }
    Ok(())
}

/// `info address NAME`.
pub(super) fn address(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let expr = shell.parse_expression(args)?;
    let value = match expr.object() {
        Some(object) if object.is_function() => shell.integer_value(args)?,
        _ => shell
            .integer_value(&format!("&{args}"))
            .map_err(|_| format!("`{args}` is in no memory; print shows its value"))?,
    };
    out.push_str(&format!("Symbol {args} is at {}\n", hex(value, 4)));
    Ok(())
}

/// `info files`: the program, and the memories of the chip.
pub(super) fn files(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let chip = shell.session.scope.chip();
    out.push_str(&format!("Symbols from {}\n{}:\n", shell.file, chip.name));
    for (name, size, _) in chip.spaces {
        out.push_str(&format!("  0x{:04x} - 0x{:04x} is {name}\n", 0, size.saturating_sub(1)));
    }
    Ok(())
}

/// `info program`.
pub(super) fn program(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let target = shell.session.machine();
    let place = shell.session.scope.source().describe_word(target.pc());
    out.push_str(&format!("{} is stopped at {place}, cycle {}\n", shell.file, target.cycle()));
    Ok(())
}

/// `info all-registers`.
pub(super) fn all_registers(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    info::registers(shell, args, out)?;
    if !args.is_empty() {
        return Ok(());
    }
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    let value = |reg: &emu_core::chip::NamedAddress| {
        let value = target.peek(chip.reg_space, u32::from(reg.addr))?;
        Some(format!("{:<7} {}", reg.name, hex(value.into(), 2)))
    };
    let values: Vec<String> = chip.regs.iter().filter_map(value).collect();
    info::columns(&values, 6, out);
    Ok(())
}

/// What a program of a controller does not have.
pub(super) fn none(what: &str, out: &mut String) -> CommandResult {
    out.push_str(&format!("No {what}: this program runs on a chip without an operating system.\n"));
    Ok(())
}
