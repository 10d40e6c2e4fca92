//! The table of commands, from which dispatch, help, completion and the page `docs/debug.md` are generated.

use diag::nearest;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};
use super::{
    back, blocks, calls, code, data, displays, examine, files, info, points, record, rungs, running, settings, texts,
    types,
};

/// What an empty line does after a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RepeatKind {
    /// Nothing.
    No,
    /// Repeats the command.
    Same,
    /// Continues where the command ended.
    Continue,
}

/// The topic of a group of commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandGroup {
    /// Running.
    Run,
    /// Breakpoints and watchpoints.
    Points,
    /// Values.
    Data,
    /// The program.
    Code,
    /// Ladder programs.
    Ladder,
    /// Back in time.
    Back,
    /// The session itself.
    Session,
}

impl CommandGroup {
    /// All groups in the order of the help, with their titles.
    pub const ALL: &[(CommandGroup, &'static str)] = &[
        (CommandGroup::Run, "Running"),
        (CommandGroup::Points, "Breakpoints and watchpoints"),
        (CommandGroup::Data, "Values"),
        (CommandGroup::Code, "The program"),
        (CommandGroup::Ladder, "Ladder programs"),
        (CommandGroup::Back, "Back in time"),
        (CommandGroup::Session, "The session"),
    ];
}

/// A command of the debugger.
pub struct DebugCommand {
    /// Name of the command; any unambiguous prefix of it is accepted.
    pub name: &'static str,
    /// Aliases of the name.
    pub aliases: &'static [&'static str],
    /// Arguments, as the help shows them.
    pub syntax: &'static str,
    /// Description in one line.
    pub help: &'static str,
    /// Group of the command in the help.
    pub group: CommandGroup,
    /// What an empty line does after it.
    pub repeat: RepeatKind,
    /// Executes the command.
    pub run: fn(&mut DebugShell, &str, &mut String) -> CommandResult,
}

const fn command(
    group: CommandGroup,
    name: &'static str,
    aliases: &'static [&'static str],
    syntax: &'static str,
    repeat: RepeatKind,
    run: fn(&mut DebugShell, &str, &mut String) -> CommandResult,
    help: &'static str,
) -> DebugCommand {
    DebugCommand { name, aliases, syntax, help, group, repeat, run }
}

use CommandGroup::{Back, Code, Data, Ladder, Points, Run, Session};
use RepeatKind::{Continue, No, Same};

/// All commands, group by group.
#[rustfmt::skip]
pub const COMMANDS: &[DebugCommand] = &[
    command(Run, "step",              &["s"],         "[COUNT]",     Same, running::step,          "run to the next source line and enter calls; service routines run to their end; without source lines one instruction"),
    command(Run, "stepi",             &["si"],        "[COUNT]",     Same, running::stepi,         "execute one instruction, or one interrupt entry"),
    command(Run, "next",              &["n"],         "[COUNT]",     Same, running::next,          "run to the next source line and pass over calls; without source lines one instruction"),
    command(Run, "nexti",             &["ni"],        "[COUNT]",     Same, running::nexti,         "execute one instruction and pass over calls and interrupts"),
    command(Run, "finish",            &["fin"],       "",            Same, running::finish,        "run until this subroutine or service routine returns"),
    command(Run, "until",             &["u"],         "[LOCATION]",  Same, running::until,         "run to a location, or until this subroutine returns; without a location like next, but never back in the function, so it leaves loops"),
    command(Run, "continue",          &["c", "fg"],   "[COUNT]",     Same, running::continue_running,         "run until something stops the program; with a count, ignore the breakpoint here COUNT - 1 times"),
    command(Run, "advance",           &["adv"],       "LOCATION",    Same, running::advance,       "run to a location, or until this subroutine returns"),
    command(Run, "run",               &["r"],         "",            No,   running::run,           "go to the beginning of the history and run; external actions are repeated"),
    command(Run, "start",             &["sta"],       "",            No,   running::start,         "go to the beginning of the history and run to main"),
    command(Run, "jump",              &["j"],         "LOCATION",    No,   running::jump,          "continue at another location"),
    command(Run, "until-pin",         &[],            "PIN=LEVEL",   Same, running::until_pin,     "run until a pin changes to a level: until-pin PB5=1, or z if nothing drives it"),
    command(Run, "run-to-cycle",      &[],            "CYCLE",       No,   running::run_to_cycle,  "run to a machine cycle or a time: run-to-cycle 16000, run-to-cycle 10ms, run-to-cycle $cycle+100"),
    command(Run, "reset",             &[],            "[power|external|watchdog|brownout]", No, running::reset, "reset the chip; cycles continue to count"),

    command(Points, "break",          &["b", "br"],   "[LOCATION] [if EXPR]", No, points::set_break,   "stop before a location: 0x86, main, main.c:12, rung 3, rung 3.2 (an element), welder.ld:12; without a location before the next instruction"),
    command(Points, "tbreak",         &["tb"],        "[LOCATION] [if EXPR]", No, points::set_tbreak,  "set a breakpoint that is deleted when it stops the program"),
    command(Points, "hbreak",         &["hb"],        "[LOCATION] [if EXPR]", No, points::set_break,   "same as break"),
    command(Points, "watch",          &["wa"],        "PLACE [if EXPR]",      No, points::watch,       "stop when a value changes: memory, register, bit, pin, expression"),
    command(Points, "rwatch",         &["rw"],        "PLACE [if EXPR]",      No, points::rwatch,      "stop when memory is read"),
    command(Points, "awatch",         &["aw"],        "PLACE [if EXPR]",      No, points::awatch,      "stop when memory is read or written"),
    command(Points, "clear",          &["cl"],        "[LOCATION]",           No, points::clear,       "delete the breakpoints at a location; without a location at the next instruction"),
    command(Points, "condition",      &["cond"],      "NUMBER [EXPR]",        No, points::condition,   "make a point stop only if EXPR is not 0; without EXPR always"),
    command(Points, "ignore",         &[],            "NUMBER COUNT",         No, points::ignore,      "ignore the next COUNT hits of a point"),
    command(Points, "commands",       &["comm"],      "[NUMBER]",             No, points::commands,    "execute the lines up to `end` when a point stops the program; `silent` as the first line suppresses the report of the stop"),
    command(Points, "delete",         &["d"],         "[NUMBER..]",           No, points::delete,      "delete points; without numbers all of them"),
    command(Points, "enable",         &[],            "[once|delete|count N|display] [NUMBER..]", No, points::enable, "enable points: `once` for one stop, `delete` for one stop, which deletes them, `count N` for N stops; `display` enables displays"),
    command(Points, "disable",        &["dis"],       "[display] [NUMBER..]", No, points::disable,    "disable points; `display` disables displays"),

    command(Data, "print",            &["p"],         "[/FORMAT] EXPR",       No, data::print,         "print the value of an expression: registers, memory, bits, pins, symbols, variables and operators of C (x.y, p->y, a[1], *p, &x, (char)x); /x /d /u /o /t /c /a; X = VALUE sets it"),
    command(Data, "call",             &[],            "EXPR",                 No, data::call,          "same as print; functions of the program are not called"),
    command(Data, "ptype",            &["pt"],        "EXPR or TYPE",         No, types::ptype,        "print a C type with its members"),
    command(Data, "whatis",           &["wha"],       "EXPR or TYPE",         No, types::whatis,       "print the name of a C type"),
    command(Data, "set",              &[],            "PLACE = EXPR",         No, data::set,           "assign a value: set r16 = 5, set PB0 = 1, set VCC=4.5V, set buf = buf + 1"),
    command(Data, "x",                &[],            "[/FORMAT] PLACE",      Continue, examine::examine,       "print memory from an address on: x/8xb data:0x100; count, format (x z d u o t c a f i s), unit (b h w g)"),
    command(Data, "display",          &[],            "[/FORMAT] [EXPR]",     No, displays::display,       "show an expression at every stop; without EXPR show all displays now"),
    command(Data, "undisplay",        &[],            "[NUMBER..]",           No, displays::undisplay,     "delete displays; without numbers all of them"),
    command(Data, "assert",           &[],            "EXPR",                 No, data::assert,        "fail if EXPR is 0: a script then ends with exit code 1"),

    command(Code, "info",             &["i"],         "WHAT [..]",            No, info::info,          "print information; info alone lists the topics"),
    command(Code, "disas",            &["disassemble"], "[/rs] [LOCATION] [COUNT]", Continue, code::disas,         "disassemble the function at a location or at the next instruction; FIRST,LAST or FIRST,+BYTES for a range, COUNT for a number of instructions; /s with source lines, /r with bytes"),
    command(Code, "list",             &["l"],         "[LOCATION]",           Continue, code::list,          "print source lines: list, list 12, list 5,9, list main, list main.c:12, list - for the previous ones"),
    command(Code, "bt",               &["backtrace", "where"], "[COUNT] [full]", No, calls::backtrace, "print the active calls, as far as the stack shows them; -2 for the outermost two; full: with their variables"),
    command(Code, "frame",            &["f"],         "[NUMBER]",           No, calls::frame,       "select a call, 0 is the innermost: print, info locals and list then refer to it"),
    command(Code, "select-frame",     &[],            "NUMBER",             No, calls::select,      "select a call as frame does, without output"),
    command(Code, "up",               &[],            "[COUNT]",            Same, calls::up,        "select the caller"),
    command(Code, "down",             &["dow"],       "[COUNT]",            Same, calls::down,      "select the called function"),

    command(Ladder, "scan",           &[],            "[COUNT]",   Same, rungs::scan,         "run to the start of the next scan"),
    command(Ladder, "rung",           &[],            "[COUNT]",   Same, rungs::rung,         "run to the start of the next rung with code"),
    command(Ladder, "element",        &["el"],        "[COUNT]",   Same, rungs::element,      "run to the start of the next element with code"),
    command(Ladder, "why",            &[],            "SYMBOL",    No,   rungs::why,          "explain the value of a symbol: the contacts that caused it, back through the scans"),

    command(Back, "reverse-stepi",    &["rsi"],       "[COUNT]",   Same, back::stepi,        "go back one instruction"),
    command(Back, "reverse-nexti",    &["rni"],       "[COUNT]",   Same, back::nexti,        "go back one instruction and pass over calls and interrupts"),
    command(Back, "reverse-step",     &["rs"],        "[COUNT]",   Same, back::step,         "go back to the start of a source line and enter calls"),
    command(Back, "reverse-next",     &["rn"],        "[COUNT]",   Same, back::next,         "go back to the start of a source line and pass over calls; without source lines one instruction"),
    command(Back, "reverse-continue", &["rc"],        "",          Same, back::reverse_continue,        "go back to the last hit of a point, or to the beginning of the history"),
    command(Back, "reverse-finish",   &["rfin"],      "",          Same, back::finish,       "go back to before the call of this subroutine"),
    command(Back, "goto-cycle",       &["gc"],        "CYCLE",     No,   back::goto_cycle,   "go to a machine cycle or a time, backwards or forwards; points do not stop it"),
    command(Back, "last-write",       &["lw"],        "PLACE [go]", No,  back::last_write,   "print what wrote a place last; with `go`, go to the end of that instruction"),
    command(Back, "reverse-last",     &["rl"],        "PLACE",     No,   back::reverse_last, "go to the last write of a place; same as last-write with `go`"),

    command(Session, "save",          &[],            "FILE",      No,   files::save,        "save the machine to a file, for `load` and for `emu run --snapshot-in`; save breakpoints FILE writes commands that set all points, for `source`"),
    command(Session, "load",          &[],            "FILE",      No,   files::load,        "continue from a machine that `save` or `emu run --snapshot-out` has written; the history begins there"),
    command(Session, "source",        &[],            "FILE",      No,   files::source,      "execute the commands of a file, up to the first that fails"),
    command(Session, "record",        &[],            "FILE",      No,   record::record,     "write the external actions up to now as a scenario that repeats them"),
    command(Session, "echo",          &[],            "TEXT",      No,   texts::echo,        "print a text; escapes such as \\n are those of C"),
    command(Session, "output",        &[],            "[/FORMAT] EXPR", No, texts::output,   "print a value without its name"),
    command(Session, "show",          &[],            "SETTING",   No,   settings::show,     "print a setting: print pretty, print elements, print repeats, listsize"),
    command(Session, "printf",        &[],            "\"TEXT\", EXPR..", No, texts::printf, "print a text with values in it: printf \"%d of %s\\n\", i, name"),
    command(Session, "define",        &[],            "NAME",      No,   blocks::define,     "define a command of the lines up to `end`; $arg0, $arg1, .. are its arguments, $argc their number"),
    command(Session, "document",      &[],            "NAME",      No,   blocks::document,   "use the lines up to `end` as the help text of a command made by `define`"),
    command(Session, "while",         &[],            "EXPR",      No,   blocks::while_loop, "repeat the lines up to `end` while EXPR is not 0"),
    command(Session, "if",            &[],            "EXPR",      No,   blocks::if_block,   "execute the lines up to `end` if EXPR is not 0, those after `else` if it is 0"),
    command(Session, "loop_break",    &[],            "",          No,   blocks::loop_break, "leave the loop of `while`"),
    command(Session, "loop_continue", &[],            "",          No,   blocks::loop_continue, "continue with the next iteration of `while`"),
    command(Session, "help",          &["h", "?"],    "[COMMAND]", No,   help,               "describe a command"),
    command(Session, "quit",          &["q", "exit"], "[CODE]",    No,   files::quit,        "end the session"),
];

/// A line of the debugger: `x/8xb buf` has the word `x` and the arguments `/8xb buf`.
#[derive(Debug, PartialEq, Eq)]
pub struct CommandLine<'l> {
    /// The command's name, or a prefix of it.
    pub word: &'l str,
    /// The rest of the line, trimmed.
    pub args: &'l str,
}

/// Splits a line into its first word and the rest. Returns `None` if the line is empty or a comment.
pub fn split_command(line: &str) -> Option<CommandLine<'_>> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return None;
    }
    let end = line
        .char_indices()
        .skip(1)
        .find(|(_, c)| !c.is_ascii_alphanumeric() && !matches!(c, '-' | '_'))
        .map_or(line.len(), |(at, _)| at);
    let (word, rest) = line.split_at(end);
    Some(CommandLine { word, args: rest.trim() })
}

/// Commands of gdb that are not available, each with a replacement or the reason.
#[rustfmt::skip]
const FOREIGN: &[(&str, &str)] = &[
    ("target", "the machine is part of this program; emu debug --gdb serves avr-gdb"),
    ("file", "start emu debug with another file"), ("symbol-file", "start emu debug with --symbols"),
    ("kill", "use reset, run or quit"), ("detach", "quit leaves"), ("attach", "the machine is part of this program"),
    ("shell", "the debugger starts no programs"), ("make", "the debugger starts no programs"),
    ("thread", "a chip has no threads"), ("skip", "finish leaves a function, advance runs past it"),
    ("macro", "debugging information of avr-gcc has no macros"),
    ("pwd", "paths are relative to the folder in which emu was started"), ("cd", "paths are relative to the folder in which emu was started"),
    ("directory", "paths are relative to the folder in which emu was started"), ("layout", "emu debug --tui is the full screen"),
    ("tui", "emu debug --tui is the full screen"),
    ("checkpoint", "save and load keep the machine, goto-cycle goes back"), ("return", "finish lets the function end"),
    ("catch", "break on an interrupt's routine"), ("handle", "a chip has no signals"), ("signal", "a chip has no signals"),
    ("python", "source executes a file of commands"), ("py", "source executes a file of commands"),
    ("guile", "source executes a file of commands"), ("gu", "source executes a file of commands"),
    ("find", "x and print show memory, last-write finds the last write of a place"),
    ("search", "list shows the source"), ("forward-search", "list shows the source"), ("reverse-search", "list shows the source"),
    ("starti", "reset goes to the first instruction"), ("compare-sections", "the image is the program memory; emu disasm shows it"),
    ("maint", "commands for the developers of gdb"), ("maintenance", "commands for the developers of gdb"),
    ("compile", "the debugger compiles nothing"), ("thbreak", "tbreak is the same"),
];

/// Finds the command of a word: a name, an alias, or an unambiguous prefix of a name.
///
/// # Errors
/// No command or several commands match; the message names them.
pub fn find_command(word: &str) -> Result<&'static DebugCommand, CommandError> {
    let exact = COMMANDS.iter().find(|command| command.name == word || command.aliases.contains(&word));
    if let Some(command) = exact {
        return Ok(command);
    }
    let all: Vec<&DebugCommand> = COMMANDS.iter().filter(|command| command.name.starts_with(word)).collect();
    match all.as_slice() {
        [command] => Ok(command),
        [] if FOREIGN.iter().any(|(name, _)| *name == word) => {
            let why = FOREIGN.iter().find(|(name, _)| *name == word).map_or("", |(_, why)| why);
            Err(format!("`{word}` of gdb is not available: {why}").into())
        }
        [] => {
            let names = COMMANDS.iter().flat_map(|command| command.aliases.iter().chain([&command.name]).copied());
            let near = nearest(word, names.filter(|name| name.len() > 1));
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            Err(format!("there is no command `{word}`{near} (`help` lists them)").into())
        }
        several => {
            let names: Vec<&str> = several.iter().map(|command| command.name).collect();
            Err(format!("`{word}` could be {}", names.join(", ")).into())
        }
    }
}

/// `help`: lists all commands, or describes one.
fn help(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if let Some(user) = shell.user_commands.get(args) {
        out.push_str(&format!("{}\n", user.help.as_deref().unwrap_or("User-defined.")));
        return Ok(());
    }
    if !args.is_empty() {
        let CommandLine { word, args } = split_command(args).unwrap_or(CommandLine { word: args, args: "" });
        if find_command(word).is_ok_and(|command| command.name == "info") && args.is_empty() {
            info::list_topics(out);
            return Ok(());
        }
        return find_command(word).map(|command| write_command_help(command, out));
    }
    for (group, title) in CommandGroup::ALL {
        out.push_str(&format!("{title}:\n"));
        COMMANDS.iter().filter(|command| command.group == *group).for_each(|command| write_command_help(command, out));
    }
    out.push_str("An unambiguous prefix of a name is enough; an empty line repeats the last command.\n");
    Ok(())
}

fn write_command_help(command: &DebugCommand, out: &mut String) {
    let names: Vec<&str> = std::iter::once(command.name).chain(command.aliases.iter().copied()).collect();
    let head = format!("{} {}", names.join(", "), command.syntax);
    out.push_str(&format!("  {:<34} {}\n", head.trim_end(), command.help));
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;

    use super::*;

    /// Checks the table of commands in `docs/debug.md`; EMU_BLESS=1 rewrites it.
    #[test]
    fn the_page_has_every_command() {
        let mut table = String::new();
        for (group, title) in CommandGroup::ALL {
            _ = write!(table, "### {title}\n\n| command | also | what it does |\n|---|---|---|\n");
            for command in COMMANDS.iter().filter(|command| command.group == *group) {
                let syntax = format!("{} {}", command.name, command.syntax).replace('|', "\\|");
                let also: Vec<String> = command.aliases.iter().map(|alias| format!("`{alias}`")).collect();
                _ = writeln!(table, "| `{}` | {} | {} |", syntax.trim(), also.join(" "), command.help);
            }
            table.push('\n');
        }
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/debug.md");
        let page = std::fs::read_to_string(&file).expect("the page");
        let (before, rest) = page.split_once("## Commands\n\n").expect("a part with the commands");
        let (_, behind) = rest.split_once("## Places and expressions\n").expect("a part behind it");
        let wanted = format!("{before}## Commands\n\n{table}## Places and expressions\n{behind}");
        if std::env::var_os("EMU_BLESS").is_some() {
            std::fs::write(&file, &wanted).expect("the page is written");
        } else {
            assert!(page == wanted, "docs/debug.md is not up to date: EMU_BLESS=1 writes it");
        }
    }

    #[test]
    fn names_are_found_by_their_beginnings() {
        let rows = [
            ("s", "step"),
            ("si", "stepi"),
            ("n", "next"),
            ("ni", "nexti"),
            ("c", "continue"),
            ("cont", "continue"),
            ("b", "break"),
            ("p", "print"),
            ("i", "info"),
            ("x", "x"),
            ("u", "until"),
            ("fin", "finish"),
            ("rsi", "reverse-stepi"),
            ("up", "up"),
            ("f", "frame"),
            ("r", "run"),
            ("rni", "reverse-nexti"),
            ("rs", "reverse-step"),
            ("rn", "reverse-next"),
            ("rc", "reverse-continue"),
            ("wat", "watch"),
            ("disp", "display"),
            ("l", "list"),
            ("d", "delete"),
            ("q", "quit"),
            ("lw", "last-write"),
            ("undisp", "undisplay"),
            ("info", "info"),
        ];
        for (word, wanted) in rows {
            assert_eq!(find_command(word).map(|command| command.name), Ok(wanted), "{word}");
        }
        assert!(find_command("re").is_err_and(|why| why.to_string().contains("reset, reverse-stepi")));
        assert_eq!(split_command("x/8xb buf"), Some(CommandLine { word: "x", args: "/8xb buf" }));
        assert_eq!(split_command("# nothing"), None);
    }

    /// Checks that no two commands have the same name.
    #[test]
    fn names_are_taken_once() {
        let mut names: Vec<&str> = COMMANDS.iter().flat_map(|c| c.aliases.iter().chain([&c.name]).copied()).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all);
    }
}
