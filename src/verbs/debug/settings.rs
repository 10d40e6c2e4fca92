//! Settings of gdb: `set listsize`, `set print`, and those that make no difference here.

use super::shell::DebugShell;

/// What gdb's `set` has settings for that scripts begin with.
const IGNORED_GDB_SETTINGS: &[&str] = &["confirm", "height", "width", "pagination", "style", "logging", "verbose"];

/// What gdb's `set print` has settings for, and the value by which values are written here.
#[rustfmt::skip]
const FIXED_PRINT_SETTINGS: &[(&str, &str)] = &[
    ("address", "on"), ("symbol", "on"), ("array", "off"), ("array-indexes", "off"), ("union", "on"), ("null-stop", "off"),
    ("demangle", "on"), ("asm-demangle", "off"), ("object", "off"), ("static-members", "on"), ("vtbl", "off"),
    ("sevenbit-strings", "off"), ("frame-arguments", "scalars"), ("entry-values", "no"), ("finish", "on"), ("max-depth", "20"),
];

/// `set listsize` and `set print`; false where the text is another setting, or none.
///
/// # Errors
/// The setting is not available.
pub(super) fn set_setting(shell: &mut DebugShell, args: &str, out: &mut String) -> Result<bool, String> {
    let words: Vec<&str> = args.split_whitespace().collect();
    let amount = |text: &str| match text {
        "unlimited" | "0" | "-1" => Ok(u32::MAX),
        text => text.parse::<u32>().map_err(|_| format!("`{text}` is no count; write a number or unlimited")),
    };
    let print = &mut shell.session.scope.print;
    match words.as_slice() {
        ["listsize", count] => shell.list_size = amount(count)?,
        ["print" | "p" | "pr", "pretty"] => print.pretty = true,
        ["print" | "p" | "pr", "pretty", on @ ("on" | "off" | "1" | "0")] => print.pretty = matches!(*on, "on" | "1"),
        ["print" | "p" | "pr", "elements", count] => print.elements = amount(count)? as usize,
        ["print" | "p" | "pr", "repeats", count] => print.repeats = amount(count)? as usize,
        ["print" | "p" | "pr", name, value @ ..] => {
            let value = value.first().copied().unwrap_or("on");
            return match FIXED_PRINT_SETTINGS.iter().find(|(own, _)| own == name) {
                Some((_, fixed)) if *fixed == value => Ok(true),
                Some((_, fixed)) => Err(format!("`set print {name}` is not available; it is {fixed}")),
                None => Err(format!("`set print {name}` is not available; there are pretty, elements and repeats")),
            };
        }
        [name, ..] if IGNORED_GDB_SETTINGS.contains(name) => {
            shell.note_once("note: that setting of gdb makes no difference here", out);
        }
        _ => return Ok(false),
    }
    Ok(true)
}
