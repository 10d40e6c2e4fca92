//! Settings of gdb: `set listsize`, `set print`, and settings that have no effect here.

use emu_debug::debug::PrintSettings;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};

/// Settings of gdb that scripts often change and that have no effect here.
const IGNORED_GDB_SETTINGS: &[&str] = &["confirm", "height", "width", "pagination", "style", "logging", "verbose"];

/// Settings of gdb's `set print` that are fixed here, with their values.
#[rustfmt::skip]
const FIXED_PRINT_SETTINGS: &[(&str, &str)] = &[
    ("address", "on"), ("symbol", "on"), ("array", "off"), ("array-indexes", "off"), ("union", "on"), ("null-stop", "off"),
    ("demangle", "on"), ("asm-demangle", "off"), ("object", "off"), ("static-members", "on"), ("vtbl", "off"),
    ("sevenbit-strings", "off"), ("frame-arguments", "scalars"), ("entry-values", "default"), ("finish", "on"), ("max-depth", "20"),
];

/// Executes `set listsize` and `set print`. Returns false if the text is another setting or none.
///
/// # Errors
/// The setting is not available.
pub(super) fn set_setting(shell: &mut DebugShell, args: &str, out: &mut String) -> Result<bool, CommandError> {
    let words: Vec<&str> = args.split_whitespace().collect();
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
                Some((_, fixed)) => Err(format!("`set print {name}` is not available; it is {fixed}").into()),
                None => {
                    Err(format!("`set print {name}` is not available; there are pretty, elements and repeats").into())
                }
            };
        }
        [name, ..] if IGNORED_GDB_SETTINGS.contains(name) => {
            shell.note_once("note: that setting of gdb has no effect here", out);
        }
        _ => return Ok(false),
    }
    Ok(true)
}

/// Parses the options of `print`, up to `--` or the first word that is no option. Returns the expression
/// after them.
///
/// # Errors
/// The value of an option is invalid.
pub(super) fn print_options<'a>(print: &mut PrintSettings, args: &'a str) -> Result<&'a str, CommandError> {
    let mut rest = args.trim_start();
    loop {
        let (word, behind) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        let behind = behind.trim_start();
        let (value, after) = behind.split_once(char::is_whitespace).unwrap_or((behind, ""));
        rest = match word {
            "--" => return Ok(behind),
            "-pretty" => {
                print.pretty = value != "off";
                if matches!(value, "on" | "off") { after } else { behind }
            }
            "-elements" | "-repeats" => {
                let count = amount(value)? as usize;
                *(if word == "-elements" { &mut print.elements } else { &mut print.repeats }) = count;
                after
            }
            _ => return Ok(rest),
        };
        rest = rest.trim_start();
    }
}

fn amount(text: &str) -> Result<u32, CommandError> {
    match text {
        "unlimited" | "0" | "-1" => Ok(u32::MAX),
        text => text.parse::<u32>().map_err(|_| format!("`{text}` is not a count; write a number or unlimited").into()),
    }
}

/// `show`: prints a setting.
pub(super) fn show(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let print = &shell.session.scope.print;
    let count = |count: usize| if count >= u32::MAX as usize { "unlimited".to_owned() } else { count.to_string() };
    let words: Vec<&str> = args.split_whitespace().collect();
    let text = match words.as_slice() {
        ["print" | "p" | "pr", "pretty"] => {
            format!("Pretty formatting of structures is {}.", if print.pretty { "on" } else { "off" })
        }
        ["print" | "p" | "pr", "elements"] => {
            format!("Limit on string chars or array elements to print is {}.", count(print.elements))
        }
        ["print" | "p" | "pr", "repeats"] => {
            format!("Threshold for repeated print elements is {}.", count(print.repeats))
        }
        ["print" | "p" | "pr", name]
            if let Some((_, fixed)) = FIXED_PRINT_SETTINGS.iter().find(|(own, _)| own == name) =>
        {
            format!("print {name} is {fixed}; it cannot be changed.")
        }
        ["listsize"] => {
            format!("Number of source lines gdb will list by default is {}.", count(shell.list_size as usize))
        }
        ["version"] => format!("emu {}", env!("CARGO_PKG_VERSION")),
        _ => {
            let known = "print pretty, print elements, print repeats, listsize, version";
            return Err(format!("`show {args}` is not available; there are {known}").into());
        }
    };
    out.push_str(&format!("{text}\n"));
    Ok(())
}
