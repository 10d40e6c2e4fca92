//! Topics of `info` about the whole program: scopes, addresses, memories, and what a chip does not have.

use emu_core::chip::{Chip, ChipSpace};
use emu_debug::debug::{ExpressionPlace, NamedObject, ObjectExpr};

use super::info;
use super::numbers::hex;
use super::shell::{CommandResult, DebugShell};

/// `info scope LOCATION`: lists the parameters and variables of the function at a location.
pub(super) fn scope(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("which location? info scope price, info scope main.c:12".into());
    }
    let word = shell.parse_line_location(args)?.first().copied().unwrap_or_default();
    let scope = &shell.session.scope;
    let variables = scope.variables_at(word);
    out.push_str(&match variables.is_empty() {
        true => format!("Symbol table for {args} contains no locals or arguments.\n"),
        false => format!("Scope for {args}:\n"),
    });
    for NamedObject { name, object } in variables {
        let bytes = object.bytes().unwrap_or(0);
        let place = match object.place(shell.session.machine()) {
            Some(place) if !object.is_local() => format!("in static storage at address {}", data_address(shell, place)),
            _ => format!("a variable of type {}", object.type_name()),
        };
        out.push_str(&format!("Symbol {name} is {place}, length {bytes}.\n"));
    }
    Ok(())
}

/// `info address NAME`: prints the address of a variable or function.
pub(super) fn address(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let expr = shell.parse_expression(args)?;
    let place = expr.place(shell.session.machine());
    let storage = if expr.object().is_some_and(ObjectExpr::is_local) { "a variable" } else { "static storage" };
    out.push_str(&match (expr.object(), place) {
        (Some(object), _) if object.is_function() => {
            format!("Symbol \"{args}\" is a function at address 0x{:x}.\n", shell.integer_value(args)?)
        }
        (Some(_), Some(ExpressionPlace::Memory { space, addr, .. }))
            if is_core_register(shell.session.scope.chip(), space, addr) =>
        {
            format!("Symbol \"{args}\" is {storage} in $r{addr}.\n")
        }
        (Some(_), Some(place)) => {
            format!("Symbol \"{args}\" is {storage} at address {}.\n", data_address(shell, place))
        }
        _ => {
            let missing = |_| format!("`{args}` is not in memory; print shows its value");
            let address = shell.integer_value(&format!("&{args}")).map_err(missing)?;
            format!("Symbol \"{args}\" is at {}.\n", hex(address, 4))
        }
    });
    Ok(())
}

/// Returns true if an address of a memory is a register of the core.
fn is_core_register(chip: &Chip, space: &str, addr: u32) -> bool {
    space == chip.ram_space && addr < chip.family_traits().registers_in_ram
}

/// Returns the address of a place as text.
fn data_address(shell: &DebugShell, place: ExpressionPlace) -> String {
    let chip = shell.session.scope.chip();
    match place {
        ExpressionPlace::Memory { space, addr, .. } | ExpressionPlace::Bit { space, addr, .. } => {
            match chip.linked_address(space, addr) {
                Some(linked) => format!("0x{linked:x}"),
                None => format!("{space}:0x{addr:x}"),
            }
        }
        _ => "unknown".to_owned(),
    }
}

/// `info files`: prints the program file, and the memories of the chip with their address ranges.
pub(super) fn files(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let chip = shell.session.scope.chip();
    out.push_str(&format!("Symbols from {}\n{}:\n", shell.file, chip.name));
    for ChipSpace { name, size, .. } in chip.spaces {
        out.push_str(&format!("  0x{:04x} - 0x{:04x} is {name}\n", 0, size.saturating_sub(1)));
    }
    Ok(())
}

/// `info program`: prints the current location and cycle.
pub(super) fn program(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let target = shell.session.machine();
    let place = shell.session.scope.source().describe_word(target.pc());
    out.push_str(&format!("{} is stopped at {place}, cycle {}\n", shell.file, target.cycle()));
    Ok(())
}

/// `info all-registers`: prints the registers of the core and of the chip.
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

/// Prints that a program on a chip has no `what`, such as threads.
pub(super) fn none(what: &str, out: &mut String) -> CommandResult {
    out.push_str(&format!("No {what}: this program runs on a chip without an operating system.\n"));
    Ok(())
}
