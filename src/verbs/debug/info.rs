//! `info`: prints information about the machine and the session.

use emu_core::chip::Chip;

use super::numbers::hex;
use super::shell::{CommandResult, DebugShell};
use super::stop::level;
use super::{about, calls, declared, point_table, rungs, types};

/// A topic of `info`.
struct InfoTopic {
    name: &'static str,
    help: &'static str,
    write: fn(&mut DebugShell, &str, &mut String) -> CommandResult,
}

/// All topics, in the order of the list.
#[rustfmt::skip]
const TOPICS: &[InfoTopic] = &[
    InfoTopic { name: "registers",   help: "registers of the core; with names those registers, also of the chip", write: registers },
    InfoTopic { name: "breakpoints", help: "breakpoints and watchpoints",                             write: |shell, args, out| point_table::list(shell, args, false, out) },
    InfoTopic { name: "watchpoints", help: "watchpoints",                                             write: |shell, args, out| point_table::list(shell, args, true, out) },
    InfoTopic { name: "locals",      help: "variables of the selected call",                 write: |shell, _, out| calls::info_variables(shell, false, out) },
    InfoTopic { name: "args",        help: "parameters of the selected call",                                          write: |shell, _, out| calls::info_variables(shell, true, out) },
    InfoTopic { name: "frame",       help: "the selected call: its location, its caller, the registers that it has saved", write: |shell, _, out| calls::info_frame(shell, out) },
    InfoTopic { name: "stack",       help: "the stack pointer and the active calls",               write: stack },
    InfoTopic { name: "pins",        help: "levels of the pins",                                      write: pins },
    InfoTopic { name: "timers",      help: "registers of the timers",                                 write: |shell, _, out| part(shell, ChipPart::Timers, out) },
    InfoTopic { name: "uart",        help: "registers of the serial port",                            write: |shell, _, out| part(shell, ChipPart::Uart, out) },
    InfoTopic { name: "interrupts",  help: "registers of the interrupts, and their vectors",          write: interrupts },
    InfoTopic { name: "cycle",       help: "time, instructions, scans, and the start of the history",     write: cycle },
    InfoTopic { name: "rung",        help: "the next rung, or the rung with a number, with its power flow", write: rungs::info },
    InfoTopic { name: "source",      help: "the current source file",                                    write: types::info_source },
    InfoTopic { name: "sources",     help: "the source files of the program; with a text those that contain it", write: types::info_sources },
    InfoTopic { name: "line",        help: "the code of a source line: info line main.c:12",          write: types::info_line },
    InfoTopic { name: "symbol",      help: "the symbol at an address: info symbol 0x86",       write: types::info_symbol },
    InfoTopic { name: "functions",   help: "functions; with a regular expression those whose names match it", write: |shell, args, out| declared::info_kind(shell, args, true, out) },
    InfoTopic { name: "variables",   help: "variables; with a regular expression those whose names match it", write: |shell, args, out| declared::info_kind(shell, args, false, out) },
    InfoTopic { name: "types",       help: "types of C; with a regular expression those whose names match it",              write: declared::types },
    InfoTopic { name: "scope",       help: "variables of the function at a location: info scope price", write: about::scope },
    InfoTopic { name: "address",     help: "where a variable or function is: info address x",         write: about::address },
    InfoTopic { name: "files",       help: "the program and the memories of the chip",                write: about::files },
    InfoTopic { name: "target",      help: "same as info files",                                                write: about::files },
    InfoTopic { name: "program",     help: "where the program is",                                    write: about::program },
    InfoTopic { name: "all-registers", help: "registers of the core and of the chip",                 write: about::all_registers },
    InfoTopic { name: "sharedlibrary", help: "there are none",                                        write: |_, _, out| about::none("shared libraries", out) },
    InfoTopic { name: "threads",     help: "there are none",                                          write: |_, _, out| about::none("threads", out) },
    InfoTopic { name: "signals",     help: "there are none",                                          write: |_, _, out| about::none("signals", out) },
    InfoTopic { name: "symbols",     help: "symbols of the program; with a text those that contain it",  write: symbols },
    InfoTopic { name: "display",     help: "what every stop shows",                                   write: |shell, _, out| { shell.list_displays(out); Ok(()) } },
];

/// Topics of gdb's `info` that are not available, each with the reason.
const FOREIGN: &[(&str, &str)] = &[
    ("macro", "debugging information of avr-gcc has no macros"),
    ("macros", "debugging information of avr-gcc has no macros"),
    ("skip", "no function is skipped"),
    ("record", "`info cycle` shows the start of the history"),
    ("checkpoints", "save and load keep the machine, goto-cycle goes back"),
    ("inferiors", "the machine is the only one"),
    ("exec", "`info files` shows the program"),
    ("os", "a chip has no operating system"),
];

/// Parts of a chip that `info` lists by their registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ChipPart {
    Timers,
    Uart,
    Interrupts,
}

/// Returns the prefixes of the names of a part's registers; empty if the family has no such part.
fn register_prefixes(chip: &Chip, part: ChipPart) -> &'static [&'static str] {
    let family = chip.family_traits();
    match part {
        ChipPart::Timers => family.timer_registers,
        ChipPart::Uart => family.uart_registers,
        ChipPart::Interrupts => family.interrupt_registers,
    }
}

/// `info`: prints a topic, or lists the topics.
pub(super) fn info(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (word, rest) = args.split_once(char::is_whitespace).unwrap_or((args, ""));
    if word.is_empty() {
        list_topics(out);
        return Ok(());
    }
    // The first topic that matches is used, so `i r` and `i b` work as in gdb.
    let exact = TOPICS.iter().find(|topic| topic.name == word);
    match exact.or_else(|| TOPICS.iter().find(|topic| topic.name.starts_with(word))) {
        Some(topic) => (topic.write)(shell, rest.trim(), out),
        None if let Some((_, why)) = FOREIGN.iter().find(|(name, _)| *name == word) => {
            Err(format!("`info {word}` of gdb is not available: {why}").into())
        }
        None => {
            Err(format!("there is no `info {word}`; the topics are {}", names().collect::<Vec<_>>().join(", ")).into())
        }
    }
}

/// Returns the names of all topics.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    TOPICS.iter().map(|topic| topic.name)
}

/// Prints the list of topics.
pub(super) fn list_topics(out: &mut String) {
    TOPICS.iter().for_each(|topic| out.push_str(&format!("  info {:<12} {}\n", topic.name, topic.help)));
}

/// `info registers`: prints registers of the core or of the chip.
pub(super) fn registers(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if !args.is_empty() {
        for name in args.split_whitespace() {
            let name = name.trim_start_matches('$');
            // For a caller, the registers that its call has saved.
            let expr = shell.parse_expression(&format!("${name}")).or_else(|_| shell.parse_expression(name))?;
            let value = expr.value(shell.session.machine());
            let text = shell.value_text(&expr, Default::default());
            out.push_str(&match value {
                Some(value) if shell.session.scope.has_debug_info() => {
                    let natural = shell.natural_register_text(name, value);
                    format!("{name:<15}{:<19} {natural}\n", format!("0x{value:x}"))
                }
                _ => format!("{name} = {text}\n"),
            });
        }
        return Ok(());
    }
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    let values: Vec<String> = chip
        .cpu_regs
        .iter()
        .filter(|name| **name != "PC")
        .filter_map(|name| Some(format!("{name:<6} {}", hex(shell.integer_value(&format!("${name}")).ok()?, 2))))
        .collect();
    columns(&values, 8, out);
    let word = shell.calls().get(shell.level).map_or(target.pc(), |frame| frame.word);
    out.push_str(&format!("PC     {}\n", shell.session.scope.source().describe_word(word)));
    Ok(())
}

/// Prints texts in columns, row by row.
pub(super) fn columns(values: &[String], count: usize, out: &mut String) {
    let width = values.iter().map(|value| value.chars().count()).max().unwrap_or(0) + 2;
    for row in values.chunks(count) {
        let line: String = row.iter().map(|value| format!("{value:<width$}")).collect();
        out.push_str(line.trim_end());
        out.push('\n');
    }
}

fn pins(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    const MANY: usize = 100;
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    let all = chip.pins.iter().zip(0..).filter(|(_, id)| target.has_pin(*id));
    let wanted = |name: &str| args.is_empty() || name.to_ascii_lowercase().starts_with(&args.to_ascii_lowercase());
    // A controller with hundreds of channels lists only those that are on.
    let few = chip.pins.len() < MANY || !args.is_empty();
    let values: Vec<String> = all
        .map(|(pin, id)| (pin.name, level(target.pin_level(id))))
        .filter(|(name, level)| wanted(name) && (few || *level == "1"))
        .map(|(name, level)| format!("{name}={level}"))
        .collect();
    if values.is_empty() {
        out.push_str(if few { "no such pin\n" } else { "no channel is on\n" });
    }
    columns(&values, 8, out);
    Ok(())
}

/// Spaces of AP101 with the presets and the values of its timers and counters.
const PRESET: &str = "preset";
const VALUE: &str = "value";

/// Prints the timers and counters of AP101 that are in use, with value and preset.
fn modules(shell: &DebugShell, out: &mut String) {
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    let count = chip.space(PRESET).map_or(0, |space| space.size);
    let word = |space: &str, at: u32| {
        let byte = |n: u32| target.peek(space, 2 * at + n).map_or(0, u32::from);
        byte(0) | byte(1) << 8
    };
    let used =
        (0..count).map(|at| (at, word(PRESET, at), word(VALUE, at))).filter(|(_, preset, value)| preset | value != 0);
    let values: Vec<String> = used.map(|(at, preset, value)| format!("{at}: {value} of {preset}")).collect();
    if values.is_empty() {
        out.push_str("no timer or counter has a preset\n");
    }
    columns(&values, 6, out);
}

/// Prints names and values of the registers of a part.
fn part(shell: &mut DebugShell, part: ChipPart, out: &mut String) -> CommandResult {
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    let prefixes = register_prefixes(chip, part);
    if prefixes.is_empty() {
        match part {
            ChipPart::Timers if chip.spaces.iter().any(|space| space.name == PRESET) => modules(shell, out),
            _ => out.push_str(&format!("{} has no registers of that kind\n", chip.name)),
        }
        return Ok(());
    }
    let of = |name: &str| prefixes.iter().any(|prefix| name.starts_with(prefix));
    let regs = chip.regs.iter().filter(|reg| of(reg.name));
    let values: Vec<String> = regs
        .filter_map(|reg| {
            let value = target.peek(chip.reg_space, u32::from(reg.addr))?;
            Some(format!("{:<7} {}", reg.name, hex(value.into(), 2)))
        })
        .collect();
    columns(&values, 6, out);
    Ok(())
}

fn interrupts(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    part(shell, ChipPart::Interrupts, out)?;
    let chip: &Chip = shell.session.scope.chip();
    for (n, name) in (0u32..).zip(chip.vectors) {
        let word = (n * chip.words_per_vector).saturating_sub(chip.later_vectors_back_words);
        out.push_str(&format!("{n:>3}  {name:<14} 0x{:04x}\n", chip.code_address(word)));
    }
    let flags = shell.session.machine().interrupt_flags();
    if !flags.is_empty() {
        out.push_str(&format!("set and enabled: {}\n", flags.join(", ")));
    }
    Ok(())
}

fn stack(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let target = shell.session.machine();
    match target.reg("SP") {
        Some(sp) => out.push_str(&format!("SP = {}\n", hex(sp.into(), 2))),
        None => out.push_str(&format!("depth {}\n", target.stack_depth())),
    }
    calls::backtrace(shell, "", out)
}

fn cycle(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let (session, target) = (&shell.session, shell.session.machine());
    let clock = session.clock();
    out.push_str(&format!("cycle         {}\n", target.cycle()));
    out.push_str(&format!("time          {} s at {} Hz\n", clock.seconds(target.cycle()), clock.hz));
    out.push_str(&format!("instructions  {}\n", target.instructions()));
    if let Some(scan) = session.scan() {
        out.push_str(&format!("scan          {scan}\n"));
    }
    out.push_str(&format!("history from  cycle {}\n", session.first_cycle()));
    let actions = session.input_events().count();
    if actions > 0 {
        out.push_str(&format!("inputs        {actions} external actions\n"));
    }
    Ok(())
}

fn symbols(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    rungs::values(shell, args, out);
    let scope = &shell.session.scope;
    let mut lines: Vec<String> = scope
        .symbols
        .iter()
        .filter(|symbol| symbol.name.contains(args) || symbol.linkage_name().contains(args))
        .map(|symbol| {
            let width = scope.chip().bytes_per_address(symbol.space);
            let size = if symbol.size > 0 { format!(", {} bytes", symbol.size) } else { String::new() };
            format!("{}:0x{:04x} {}{size}\n", symbol.space, symbol.addr / width, symbol.name)
        })
        .collect();
    lines.sort();
    lines.dedup();
    if lines.is_empty() && shell.view.is_none() {
        lines.push("no symbols\n".to_owned());
    }
    lines.iter().for_each(|line| out.push_str(line));
    Ok(())
}
