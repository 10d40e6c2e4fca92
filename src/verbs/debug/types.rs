//! Commands about debugging information: types, symbols, source files and lines.

use std::collections::BTreeSet;

use emu_debug::address_names::decimal_offset;
use emu_debug::debug::{DebugExpression, ExpressionPlace, FileLine, ObjectByteLocation, ObjectExpr};
use regex_lite::Regex;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};

/// Parses the regular expression of `info functions` and similar topics, which matches any part of a name. An
/// empty text matches all names.
pub(super) fn name_filter(text: &str) -> Result<Regex, CommandError> {
    Regex::new(text).map_err(|why| {
        let why = why.to_string();
        let why = why.lines().last().unwrap_or_default().trim_start_matches("error: ").to_owned();
        format!("`{text}` is not a regular expression: {why}").into()
    })
}

/// Returns the object or type that a text names.
fn parse_object_or_type(shell: &DebugShell, text: &str) -> Result<ObjectExpr, CommandError> {
    if text.is_empty() {
        return Err("the expression or type is missing: ptype x, ptype struct order, whatis a[1]".into());
    }
    if let Some(found) = shell.session.scope.type_named(text) {
        return Ok(found);
    }
    match shell.parse_expression(text)?.object() {
        Some(object) => Ok(object.clone()),
        None => Err(format!("the type of `{text}` is unknown").into()),
    }
}

/// Returns the type of an expression that is no C object: a literal, a computed value, a register.
fn computed_type(shell: &DebugShell, text: &str) -> Result<String, CommandError> {
    if shell.is_void(text) {
        return Ok("void".to_owned());
    }
    let expr = shell.parse_expression(text)?;
    let is_avr = shell.session.scope.chip().is_known_to_gdb();
    let known = match &expr {
        DebugExpression::Place(ExpressionPlace::Pc) if is_avr => Some("void (*)()".to_owned()),
        DebugExpression::Place(ExpressionPlace::Reg("SP")) if is_avr => Some("void *".to_owned()),
        DebugExpression::Place(ExpressionPlace::Reg(_)) if is_avr => Some("uint8_t".to_owned()),
        expr => shell.session.scope.computed_type(expr),
    };
    known.ok_or_else(|| format!("the type of `{text}` is unknown").into())
}

/// `ptype`: prints the definition of a type.
pub(super) fn ptype(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let kind = match parse_object_or_type(shell, args) {
        Ok(object) => object.type_definition(),
        Err(why) => computed_type(shell, args).map_err(|_| why)?,
    };
    out.push_str(&format!("type = {kind}\n"));
    Ok(())
}

/// `whatis`: prints the type of an expression.
pub(super) fn whatis(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    // For the name of a type, print the type that it is an alias of.
    let kind = match shell.session.scope.type_named(args) {
        Some(named) => named.aliased_kind(),
        None => match parse_object_or_type(shell, args) {
            Ok(object) => object.type_name(),
            Err(why) => computed_type(shell, args).map_err(|_| why)?,
        },
    };
    out.push_str(&format!("type = {kind}\n"));
    Ok(())
}

/// `info symbol ADDRESS`: prints the symbol at an address of program memory, or otherwise of RAM.
pub(super) fn info_symbol(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("which address? info symbol 0x86, info symbol $pc, info symbol data:0x100".into());
    }
    let (scope, chip) = (&shell.session.scope, shell.session.scope.chip());
    if let Ok(range) = scope.parse_range(args) {
        let start = range.start.saturating_mul(chip.bytes_per_address(range.space));
        let name = if range.space == chip.code_space {
            scope.source().names.nearest_symbol(start)
        } else {
            scope.source().names.containing_symbol(range.space, start)
        };
        if let Some(name) = name {
            out.push_str(&format!("{} in {}\n", spaced(&name), range.space));
            return Ok(());
        }
    }
    if let Some(name) = symbol_of_pointer(shell, args) {
        out.push_str(&format!("{name}\n"));
        return Ok(());
    }
    let value = shell.integer_value(args)?;
    let address = u32::try_from(value).map_err(|_| format!("{value} is not an address"))?;
    let code = || {
        let word = shell.program_word(address)?;
        let inside = shell.session.scope.calls().function(word).is_some() || shell.session.word(word) != u16::MAX;
        scope.source().names.nearest_symbol(word * chip.word_bytes).filter(|_| inside)
    };
    let in_code = || code().map(|name| (name, chip.code_space));
    let in_ram = || Some((scope.source().names.containing_symbol(chip.ram_space, address)?, chip.ram_space));
    // A value with the type of a pointer points to data, unless it points to a function.
    let is_data = |of: &ObjectExpr| !of.is_function() && !of.is_function_pointer();
    let data = shell.parse_expression(args).is_ok_and(|expr| expr.object().is_some_and(is_data));
    let found = if data { in_ram().or_else(in_code) } else { in_code().or_else(in_ram) };
    match found {
        Some((name, space)) => out.push_str(&format!("{} in {space}\n", spaced(&name))),
        None => out.push_str(&format!("No symbol matches {args}.\n")),
    }
    Ok(())
}

/// Returns the symbol at the target of a pointer, or at an array, in the memory of that object (8051).
fn symbol_of_pointer(shell: &DebugShell, text: &str) -> Option<String> {
    let (scope, target) = (&shell.session.scope, shell.session.machine());
    let expr = shell.parse_expression(text).ok().filter(|_| scope.chip().has_sdcc_pointers())?;
    let object = expr.object().filter(|object| !object.is_function() && !object.is_function_pointer())?;
    let object = if object.is_array() { object.clone() } else { object.pointed_object()? };
    let ObjectByteLocation::Memory(space, addr) = *object.byte_locations(target).first()? else { return None };
    let name = scope.source().names.containing_symbol(space, addr)?;
    Some(format!("{} in {space}", spaced(&name)))
}

/// Converts `main+0x4` to `main + 4`.
fn spaced(name: &str) -> String {
    let parts = name.rsplit_once("+0x").and_then(|(name, offset)| Some((name, u32::from_str_radix(offset, 16).ok()?)));
    parts.map_or_else(|| name.to_owned(), |(name, offset)| format!("{name} + {offset}"))
}

/// `info line LOCATION`: prints the addresses of the code of a source line.
pub(super) fn info_line(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let FileLine { file, line: number } = match args {
        "" => shell.current_line().ok_or("there is no source line here")?,
        text => shell.parse_line(text)?,
    };
    let scope = &shell.session.scope;
    let words = match scope.source().parse_words(&format!("{file}:{number}")) {
        Ok(words) => words,
        Err(_) => {
            out.push_str(&line_without_code(shell, &file, number));
            return Ok(());
        }
    };
    let chip = scope.chip();
    let word = words.first().copied().unwrap_or_default();
    let is_line =
        |word: u32| scope.source().line_at(word).is_some_and(|line| *line.file == *file && line.line == number);
    let end = (word..chip.flash_bytes / chip.word_bytes.max(1)).find(|word| !is_line(*word)).unwrap_or(word);
    let at = |word: u32| {
        let name = scope.source().names.nearest_symbol(word * chip.word_bytes);
        let name = name.map_or(String::new(), |name| format!(" <{}>", decimal_offset(&name)));
        format!("0x{:x}{name}", chip.code_address(word))
    };
    out.push_str(&format!("Line {number} of \"{file}\" starts at address {} and ends at {}.\n", at(word), at(end)));
    if words.len() > 1 {
        let others: Vec<String> = words.iter().skip(1).map(|word| at(*word)).collect();
        out.push_str(&format!("It has more code at {}.\n", others.join(", ")));
    }
    shell.listed = None;
    shell.set_examined_code(word);
    Ok(())
}

/// Returns the text for a source line without code.
fn line_without_code(shell: &mut DebugShell, file: &str, number: u32) -> String {
    let count = shell.sources.file(&shell.session.scope.lines, file).map_or(u32::MAX, |lines| lines.len() as u32);
    if number > count {
        return format!("Line number {number} is out of range for \"{file}\".\n");
    }
    let scope = &shell.session.scope;
    let later = scope.lines.all_lines().iter().filter(|line| *line.file == *file && line.line > number);
    match later.min_by_key(|line| (line.line, line.addr)) {
        Some(line) => {
            let name = scope.source().names.nearest_symbol(line.addr);
            let name = name.map_or(String::new(), |name| format!(" <{}>", decimal_offset(&name)));
            let address = scope.chip().code_address(line.addr / scope.chip().word_bytes.max(1));
            format!("Line {number} of \"{file}\" is at address 0x{address:x}{name} but contains no code.\n")
        }
        None => format!("Line {number} of \"{file}\" has no code.\n"),
    }
}

/// `info source`: prints the current source file.
pub(super) fn info_source(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let Some(FileLine { file, .. }) = shell.current_line() else {
        out.push_str("No source line is known here.\n");
        return Ok(());
    };
    let scope = &shell.session.scope;
    out.push_str(&format!("Current source file is {file}\n"));
    if let Some(folder) = scope.lines.folder(&file) {
        out.push_str(&format!("Compilation directory is {folder}\n"));
    }
    let language = if scope.has_debug_info() { "Source language is c.\n" } else { "" };
    let found = shell.sources.file(&scope.lines, &file).map(<[String]>::len);
    out.push_str(&match found {
        Some(lines) => format!("Contains {lines} lines.\n{language}"),
        None => "The file is not found.\n".to_owned(),
    });
    Ok(())
}

/// `info sources`: lists the source files of the program.
pub(super) fn info_sources(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let wanted = name_filter(args)?;
    let files: BTreeSet<&str> = shell.session.scope.lines.all_lines().iter().map(|line| &*line.file).collect();
    let found: Vec<&str> = files.into_iter().filter(|file| wanted.is_match(file)).collect();
    if found.is_empty() {
        out.push_str("no source files\n");
    }
    found.iter().for_each(|file| out.push_str(&format!("{file}\n")));
    Ok(())
}
