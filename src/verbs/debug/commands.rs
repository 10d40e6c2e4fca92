//! The table of commands, from which dispatch, help, completion and the page `docs/debug.md` are made.

use diag::nearest;

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
    /// The same again.
    Same,
    /// It goes on where it was.
    Continue,
}

/// What a group of commands is about.
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
    /// All, in their order.
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

/// A command.
pub struct DebugCommand {
    /// Its name; any beginning of it that no other has will do.
    pub name: &'static str,
    /// Other names.
    pub aliases: &'static [&'static str],
    /// What follows it.
    pub syntax: &'static str,
    /// What it does, in a line.
    pub help: &'static str,
    /// What it is about.
    pub group: CommandGroup,
    /// What an empty line does after it.
    pub repeat: RepeatKind,
    /// Does it.
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
    command(Run, "step",              &["s"],         "[COUNT]",     Same, running::step,          "to the next source line, into calls; service routines are run through; without lines an instruction"),
    command(Run, "stepi",             &["si"],        "[COUNT]",     Same, running::stepi,         "one instruction, or one entry of an interrupt"),
    command(Run, "next",              &["n"],         "[COUNT]",     Same, running::next,          "to the next source line, over calls; without lines an instruction"),
    command(Run, "nexti",             &["ni"],        "[COUNT]",     Same, running::nexti,         "one instruction, over calls and interrupts"),
    command(Run, "finish",            &["fin"],       "",            Same, running::finish,        "to where this subroutine or service routine returns to"),
    command(Run, "until",             &["u"],         "[LOCATION]",  Same, running::until,         "to a location, or out of this subroutine; without one as next, but never back, so that it leaves loops"),
    command(Run, "continue",          &["c", "fg"],   "[COUNT]",     Same, running::continue_running,         "run until something stops it; with a count the breakpoint here is passed COUNT - 1 times"),
    command(Run, "advance",           &["adv"],       "LOCATION",    Same, running::advance,       "to a location, or out of this subroutine"),
    command(Run, "run",               &["r"],         "",            No,   running::run,           "from the beginning of the history; what was done from outside is done again"),
    command(Run, "start",             &["sta"],       "",            No,   running::start,         "the same, up to main"),
    command(Run, "jump",              &["j"],         "LOCATION",    No,   running::jump,          "go on at another location"),
    command(Run, "until-pin",         &[],            "PIN=LEVEL",   Same, running::until_pin,     "run until a pin comes to a level: until-pin PB5=1, or z where nothing drives it"),
    command(Run, "run-to-cycle",      &[],            "CYCLE",       No,   running::run_to_cycle,  "run up to a machine cycle, or a time: run-to-cycle 16000, run-to-cycle 10ms, run-to-cycle $cycle+100"),
    command(Run, "reset",             &[],            "[power|external|watchdog|brownout]", No, running::reset, "reset the chip; time goes on"),

    command(Points, "break",          &["b", "br"],   "[LOCATION] [if EXPR]", No, points::set_break,   "stop before a location: 0x86, main, main.c:12, rung 3, rung 3.2 (an element), welder.ld:12; without one before the instruction that is next"),
    command(Points, "tbreak",         &["tb"],        "[LOCATION] [if EXPR]", No, points::set_tbreak,  "the same, once"),
    command(Points, "hbreak",         &["hb"],        "[LOCATION] [if EXPR]", No, points::set_break,   "the same as break, for who is used to it"),
    command(Points, "watch",          &["wa"],        "PLACE [if EXPR]",      No, points::watch,       "stop where a value has changed: memory, register, bit, pin, expression"),
    command(Points, "rwatch",         &["rw"],        "PLACE [if EXPR]",      No, points::rwatch,      "stop where memory is read"),
    command(Points, "awatch",         &["aw"],        "PLACE [if EXPR]",      No, points::awatch,      "stop where memory is read or written"),
    command(Points, "clear",          &["cl"],        "[LOCATION]",           No, points::clear,       "delete the breakpoints at a location; without one at the instruction that is next"),
    command(Points, "condition",      &["cond"],      "NUMBER [EXPR]",        No, points::condition,   "a point stops only where EXPR is not 0; without one always"),
    command(Points, "ignore",         &[],            "NUMBER COUNT",         No, points::ignore,      "a point passes over the next COUNT hits"),
    command(Points, "commands",       &["comm"],      "[NUMBER]",             No, points::commands,    "the lines up to `end` are carried out when a point stops; `silent` first leaves out what a stop prints"),
    command(Points, "delete",         &["d"],         "[NUMBER..]",           No, points::delete,      "delete points; without numbers all"),
    command(Points, "enable",         &[],            "[once|delete|count N|display] [NUMBER..]", No, points::enable, "points count again: `once`; until they stop, and are deleted then; for N stops; `display` means displays"),
    command(Points, "disable",        &["dis"],       "[display] [NUMBER..]", No, points::disable,    "points do not count; `display` means displays"),

    command(Data, "print",            &["p"],         "[/FORMAT] EXPR",       No, data::print,         "the value of an expression: registers, memory, bits, pins, symbols, variables and operators of C (x.y, p->y, a[1], *p, &x, (char)x); /x /d /u /o /t /c /a; X = VALUE sets it"),
    command(Data, "call",             &[],            "EXPR",                 No, data::call,          "the same; functions of the program are not called"),
    command(Data, "ptype",            &["pt"],        "EXPR or TYPE",         No, types::ptype,        "a type of C with its members"),
    command(Data, "whatis",           &["wha"],       "EXPR or TYPE",         No, types::whatis,       "the name of a type of C"),
    command(Data, "set",              &[],            "PLACE = EXPR",         No, data::set,           "give a place another value: set r16 = 5, set PB0 = 1, set VCC=4.5V, set buf = buf + 1"),
    command(Data, "x",                &[],            "[/FORMAT] PLACE",      Continue, examine::examine,       "memory from a place on: x/8xb data:0x100; count, format (x z d u o t c a f i s), unit (b h w g)"),
    command(Data, "display",          &[],            "[/FORMAT] [EXPR]",     No, displays::display,       "show an expression at every stop; without one show them all now"),
    command(Data, "undisplay",        &[],            "[NUMBER..]",           No, displays::undisplay,     "show it no more; without numbers none"),
    command(Data, "assert",           &[],            "EXPR",                 No, data::assert,        "fail where EXPR is 0: a script ends with exit code 1"),

    command(Code, "info",             &["i"],         "WHAT [..]",            No, info::info,          "what is known: info without more lists what there is"),
    command(Code, "disas",            &["disassemble"], "[/rs] [LOCATION] [COUNT]", Continue, code::disas,         "the function around a location, or around the next instruction; FIRST,LAST and FIRST,+BYTES a range, COUNT so many instructions; /s with lines of the source, /r with bytes"),
    command(Code, "list",             &["l"],         "[LOCATION]",           Continue, code::list,          "lines of the source: list, list 12, list 5,9, list main, list main.c:12, list - for those before"),
    command(Code, "bt",               &["backtrace", "where"], "[COUNT] [full]", No, calls::backtrace, "the calls that led here, as far as the stack tells; -2 for the outermost two; full: with their variables"),
    command(Code, "frame",            &["f"],         "[NUMBER]",           No, calls::frame,       "look at a call, 0 the innermost: print, info locals and list are about it then"),
    command(Code, "select-frame",     &[],            "NUMBER",             No, calls::select,      "look at a call without a word, as frame does"),
    command(Code, "up",               &[],            "[COUNT]",            Same, calls::up,        "look at the caller"),
    command(Code, "down",             &["dow"],       "[COUNT]",            Same, calls::down,      "look at what it called"),

    command(Ladder, "scan",           &[],            "[COUNT]",   Same, rungs::scan,         "to where the next scan begins"),
    command(Ladder, "rung",           &[],            "[COUNT]",   Same, rungs::rung,         "to where the next rung with code begins"),
    command(Ladder, "element",        &["el"],        "[COUNT]",   Same, rungs::element,      "to where the next element with code begins"),
    command(Ladder, "why",            &[],            "SYMBOL",    No,   rungs::why,          "what made a symbol what it is: the contacts that did, back through the scans"),

    command(Back, "reverse-stepi",    &["rsi"],       "[COUNT]",   Same, back::stepi,        "one instruction back"),
    command(Back, "reverse-nexti",    &["rni"],       "[COUNT]",   Same, back::nexti,        "the same, over calls and interrupts"),
    command(Back, "reverse-step",     &["rs"],        "[COUNT]",   Same, back::step,         "back to where a source line begins, into calls"),
    command(Back, "reverse-next",     &["rn"],        "[COUNT]",   Same, back::next,         "back to where a source line begins, over calls; without lines an instruction"),
    command(Back, "reverse-continue", &["rc"],        "",          Same, back::reverse_continue,        "back to the last hit of a point, or to the beginning"),
    command(Back, "reverse-finish",   &["rfin"],      "",          Same, back::finish,       "back to before the call of this subroutine"),
    command(Back, "goto-cycle",       &["gc"],        "CYCLE",     No,   back::goto_cycle,   "to a machine cycle or a time, back or forwards; points do not stop it"),
    command(Back, "last-write",       &["lw"],        "PLACE [go]", No,  back::last_write,   "who gave a place its value last; with `go` goes to behind that instruction"),
    command(Back, "reverse-last",     &["rl"],        "PLACE",     No,   back::reverse_last, "goes to where a place got its value last, as last-write with `go`"),

    command(Session, "save",          &[],            "FILE",      No,   files::save,        "write the machine to a file, for `load` and for `emu run --snapshot-in`; save breakpoints FILE writes commands that set the points, for `source`"),
    command(Session, "load",          &[],            "FILE",      No,   files::load,        "go on from a machine that `save` or `emu run --snapshot-out` has written; a history begins there"),
    command(Session, "source",        &[],            "FILE",      No,   files::source,      "carry out the commands of a file, up to the first that fails"),
    command(Session, "record",        &[],            "FILE",      No,   record::record,     "write what was done from outside up to now as a scenario that does it again"),
    command(Session, "echo",          &[],            "TEXT",      No,   texts::echo,        "print a text; \\n and the like are what they are in C"),
    command(Session, "output",        &[],            "[/FORMAT] EXPR", No, texts::output,   "print a value without its name"),
    command(Session, "show",          &[],            "SETTING",   No,   settings::show,     "a setting: print pretty, print elements, print repeats, listsize"),
    command(Session, "printf",        &[],            "\"TEXT\", EXPR..", No, texts::printf, "print a text with values in it: printf \"%d of %s\\n\", i, name"),
    command(Session, "define",        &[],            "NAME",      No,   blocks::define,     "the lines up to `end` become a command; $arg0, $arg1, .. are its arguments, $argc their count"),
    command(Session, "document",      &[],            "NAME",      No,   blocks::document,   "the lines up to `end` are what `help` tells of a command that `define` made"),
    command(Session, "while",         &[],            "EXPR",      No,   blocks::while_loop, "the lines up to `end` again and again while EXPR is not 0"),
    command(Session, "if",            &[],            "EXPR",      No,   blocks::if_block,   "the lines up to `end` where EXPR is not 0, those behind `else` where it is"),
    command(Session, "loop_break",    &[],            "",          No,   blocks::loop_break, "leave the loop of `while`"),
    command(Session, "loop_continue", &[],            "",          No,   blocks::loop_continue, "go on with the next iteration of `while`"),
    command(Session, "help",          &["h", "?"],    "[COMMAND]", No,   help,               "what a command does"),
    command(Session, "quit",          &["q", "exit"], "[CODE]",    No,   files::quit,        "leave"),
];

/// The first word of a line and the rest: `x/8xb buf` is `x` and `/8xb buf`. Nothing where the line is empty or a comment.
pub fn split_command(line: &str) -> Option<(&str, &str)> {
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
    Some((word, rest.trim()))
}

/// Commands of gdb that make no sense here, and what does.
#[rustfmt::skip]
const FOREIGN: &[(&str, &str)] = &[
    ("target", "the machine is within this program; emu debug --gdb serves avr-gdb"),
    ("file", "start emu debug with another file"), ("symbol-file", "start emu debug with --symbols"),
    ("kill", "reset, run and quit are"), ("detach", "quit leaves"), ("attach", "the machine is within this program"),
    ("shell", "the debugger starts no programs"), ("make", "the debugger starts no programs"),
    ("thread", "a chip has no threads"), ("skip", "finish leaves a function, advance goes on behind it"),
    ("macro", "debugging information of avr-gcc has no macros"),
    ("pwd", "files are found from where emu was started"), ("cd", "files are found from where emu was started"),
    ("directory", "files are found from where emu was started"), ("layout", "emu debug --tui is the full screen"),
    ("tui", "emu debug --tui is the full screen"),
    ("checkpoint", "save and load keep the machine, goto-cycle goes back"), ("return", "finish lets the function end"),
    ("catch", "break on an interrupt's routine"), ("handle", "a chip has no signals"), ("signal", "a chip has no signals"),
    ("python", "source carries out a file of commands"), ("py", "source carries out a file of commands"),
    ("guile", "source carries out a file of commands"), ("gu", "source carries out a file of commands"),
    ("compile", "the debugger compiles nothing"), ("thbreak", "tbreak is the same"),
];

/// The command that a word stands for: a name, another name, or the beginning of one name only.
///
/// # Errors
/// There is none, or there are several: a sentence that names them.
pub fn find_command(word: &str) -> Result<&'static DebugCommand, String> {
    let exact = COMMANDS.iter().find(|command| command.name == word || command.aliases.contains(&word));
    if let Some(command) = exact {
        return Ok(command);
    }
    let all: Vec<&DebugCommand> = COMMANDS.iter().filter(|command| command.name.starts_with(word)).collect();
    match all.as_slice() {
        [command] => Ok(command),
        [] if FOREIGN.iter().any(|(name, _)| *name == word) => {
            let why = FOREIGN.iter().find(|(name, _)| *name == word).map_or("", |(_, why)| why);
            Err(format!("`{word}` of gdb is no command here: {why}"))
        }
        [] => {
            let names = COMMANDS.iter().flat_map(|command| command.aliases.iter().chain([&command.name]).copied());
            let near = nearest(word, names.filter(|name| name.len() > 1));
            let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
            Err(format!("there is no command `{word}`{near} (`help` lists them)"))
        }
        several => {
            let names: Vec<&str> = several.iter().map(|command| command.name).collect();
            Err(format!("`{word}` could be {}", names.join(", ")))
        }
    }
}

/// `help`.
fn help(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if let Some(user) = shell.user_commands.get(args) {
        out.push_str(&format!("{}\n", user.help.as_deref().unwrap_or("User-defined.")));
        return Ok(());
    }
    if !args.is_empty() {
        let (word, rest) = split_command(args).unwrap_or((args, ""));
        if find_command(word).is_ok_and(|command| command.name == "info") && rest.is_empty() {
            info::list_topics(out);
            return Ok(());
        }
        return find_command(word).map(|command| write_command_help(command, out));
    }
    for (group, title) in CommandGroup::ALL {
        out.push_str(&format!("{title}:\n"));
        COMMANDS.iter().filter(|command| command.group == *group).for_each(|command| write_command_help(command, out));
    }
    out.push_str("A beginning of a name will do where it is clear; an empty line repeats.\n");
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

    /// The table of commands in `docs/debug.md`; EMU_BLESS=1 writes it anew.
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
        assert!(find_command("re").is_err_and(|why| why.contains("reset, reverse-stepi")));
        assert_eq!(split_command("x/8xb buf"), Some(("x", "/8xb buf")));
        assert_eq!(split_command("# nothing"), None);
    }

    /// No two commands answer to one name.
    #[test]
    fn names_are_taken_once() {
        let mut names: Vec<&str> = COMMANDS.iter().flat_map(|c| c.aliases.iter().chain([&c.name]).copied()).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all);
    }
}
