//! Handles the keys of the debugger screen.

use ratatui_core::layout::Rect;

use super::{AutoRun, DebuggedMachine, DebuggerScreen, LowerPane, ScreenQuery, SourceExcerpt, view};
use crate::{ScreenKey, ViewRequest};

/// Keys that are shortcuts for commands.
const COMMANDS: [(char, &str); 13] = [
    ('s', "stepi"),
    ('i', "stepi"),
    ('o', "reverse-stepi"),
    ('n', "next"),
    ('N', "nexti"),
    ('f', "finish"),
    ('S', "scan"),
    ('g', "rung"),
    ('e', "element"),
    ('u', "reverse-stepi"),
    ('U', "reverse-next"),
    ('r', "reverse-continue"),
    ('R', "reset"),
];

/// Keys with another command while the source is shown: they work on source lines.
const LINE_COMMANDS: [(char, &str); 3] = [('s', "step"), ('u', "reverse-step"), ('U', "reverse-next")];

/// Machine cycles per column of the waveform.
pub(super) const SCALES: [u64; 8] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Maximum length of a command line in characters.
const MAX_COMMAND_LENGTH: usize = 400;

/// Handles a key.
pub(super) fn update<M: DebuggedMachine>(screen: &mut DebuggerScreen<M>, key: ScreenKey, area: Rect) -> ViewRequest {
    if let Some(line) = screen.prompt.take() {
        return handle_prompt_key(screen, line, key);
    }
    if screen.help {
        // Any key closes the help; only Ctrl-C has its normal effect, too.
        screen.help = false;
        return if key == ScreenKey::Ctrl('c') { ViewRequest::Quit } else { ViewRequest::Continue };
    }
    if screen.run.take().is_some() {
        // Any key stops a run first; a pause key does nothing else.
        screen.last_message = ("paused".to_owned(), false);
        if matches!(key, ScreenKey::Char(' ' | 'p') | ScreenKey::Ctrl('c') | ScreenKey::Escape) {
            return ViewRequest::Continue;
        }
    }
    screen.cycles_due = 0.0;
    match key {
        ScreenKey::Char('q') | ScreenKey::Ctrl('c') => return ViewRequest::Quit,
        ScreenKey::Char('?') => screen.help = true,
        ScreenKey::Char(':') => screen.prompt = Some(String::new()),
        ScreenKey::Char(' ') => screen.run = Some(AutoRun::Clock),
        ScreenKey::Char('c') => screen.run = Some(AutoRun::Free),
        ScreenKey::Char('+') => screen.speed = (screen.speed * 2.0).min(1024.0),
        ScreenKey::Char('-') => screen.speed = (screen.speed / 2.0).max(1.0 / 65_536.0),
        ScreenKey::Char('b') => return toggle_breakpoint(screen),
        ScreenKey::Enter => {
            let Some((place, _)) = cursor_place(screen) else { return ViewRequest::Continue };
            return run_command(screen, &format!("until {place}"));
        }
        ScreenKey::Char('z') => screen.zoom = (screen.zoom + 1) % SCALES.len(),
        ScreenKey::Char('Z') => screen.zoom = (screen.zoom + SCALES.len() - 1) % SCALES.len(),
        ScreenKey::Char('v') => (screen.source, screen.cursor, screen.line) = (!screen.source, None, None),
        ScreenKey::Char('m') => {
            let next = usize::from(screen.lower() == LowerPane::Memory);
            (screen.lower, screen.memory) = (Some(LowerPane::Memory), (screen.memory.0 + next, 0))
        }
        ScreenKey::Char(']') => screen.memory.1 = screen.memory.1.saturating_add(view::row_bytes(area)),
        ScreenKey::Char('[') => screen.memory.1 = screen.memory.1.saturating_sub(view::row_bytes(area)),
        ScreenKey::PageDown => screen.memory.1 = screen.memory.1.saturating_add(16 * view::row_bytes(area)),
        ScreenKey::PageUp => screen.memory.1 = screen.memory.1.saturating_sub(16 * view::row_bytes(area)),
        ScreenKey::Tab => {
            screen.lower = Some(match screen.lower() {
                LowerPane::Rung => LowerPane::Symbols,
                LowerPane::Symbols => LowerPane::Memory,
                LowerPane::Memory => LowerPane::Serial,
                LowerPane::Serial if screen.ladder => LowerPane::Rung,
                LowerPane::Serial => LowerPane::Memory,
            })
        }
        ScreenKey::Down => move_cursor(screen, 1),
        ScreenKey::Up => move_cursor(screen, -1),
        ScreenKey::Home | ScreenKey::Escape => (screen.cursor, screen.line) = (None, None),
        ScreenKey::Char(c) => match key_commands(screen).find(|(key, _)| *key == c) {
            Some((_, command)) => return run_command(screen, command),
            None => screen.last_message = (format!("no key `{c}`; ? lists the keys"), true),
        },
        _ => {}
    }
    ViewRequest::Continue
}

/// The shortcuts for commands that are valid now.
fn key_commands<M: DebuggedMachine>(screen: &DebuggerScreen<M>) -> impl Iterator<Item = (char, &'static str)> + use<M> {
    let lines = if source(screen, 0).is_some() { &LINE_COMMANDS[..] } else { &[] };
    lines.iter().chain(&COMMANDS).copied()
}

/// Handles a key while the command line is open.
fn handle_prompt_key<M: DebuggedMachine>(
    screen: &mut DebuggerScreen<M>,
    mut line: String,
    key: ScreenKey,
) -> ViewRequest {
    match key {
        ScreenKey::Ctrl('c') | ScreenKey::Escape => return ViewRequest::Continue,
        // `continue` becomes a run of the screen, so that the screen is updated meanwhile.
        ScreenKey::Enter if matches!(line.trim(), "c" | "continue") => {
            (screen.run, screen.cycles_due) = (Some(AutoRun::Free), 0.0);
            return ViewRequest::Continue;
        }
        ScreenKey::Enter => return run_command(screen, &line),
        ScreenKey::Backspace if line.pop().is_none() => return ViewRequest::Continue,
        ScreenKey::Char(c) if line.chars().count() < MAX_COMMAND_LENGTH => line.push(c),
        _ => {}
    }
    screen.prompt = Some(line);
    ViewRequest::Continue
}

fn run_command<M: DebuggedMachine>(screen: &mut DebuggerScreen<M>, line: &str) -> ViewRequest {
    let answer = screen.machine.run_command(line);
    screen.last_message = (answer.text, answer.failed);
    (screen.cursor, screen.line) = (None, None);
    if answer.quit { ViewRequest::Quit } else { ViewRequest::Continue }
}

/// A snapshot of the code around the cursor only.
fn code<M: DebuggedMachine>(screen: &DebuggerScreen<M>, lines: usize) -> super::DebuggerSnapshot {
    screen.machine.debugger_snapshot(&ScreenQuery {
        around: screen.cursor,
        lines,
        since: u64::MAX,
        ..ScreenQuery::default()
    })
}

/// The source around the cursor, if it is shown.
fn source<M: DebuggedMachine>(screen: &DebuggerScreen<M>, lines: usize) -> Option<SourceExcerpt> {
    let wants = ScreenQuery { line: screen.line, source: lines + 1, since: u64::MAX, ..ScreenQuery::default() };
    if screen.source { screen.machine.debugger_snapshot(&wants).source } else { None }
}

/// The location of the cursor in the syntax of commands, and the number of the breakpoint there.
fn cursor_place<M: DebuggedMachine>(screen: &DebuggerScreen<M>) -> Option<(String, Option<u32>)> {
    if let Some(source) = source(screen, 0) {
        let line = source.lines.iter().find(|line| line.0 == source.around)?;
        return Some((format!("{}:{}", source.file, source.around), line.2));
    }
    let sight = code(screen, 1);
    let word = screen.cursor.unwrap_or(sight.pc);
    sight.code.into_iter().find(|line| line.word == word).map(|line| (line.address, line.breakpoint))
}

/// Sets or deletes a breakpoint at the cursor.
fn toggle_breakpoint<M: DebuggedMachine>(screen: &mut DebuggerScreen<M>) -> ViewRequest {
    let (cursor, line) = (screen.cursor, screen.line);
    let Some((place, point)) = cursor_place(screen) else { return ViewRequest::Continue };
    let command = point.map_or_else(|| format!("break {place}"), |id| format!("delete {id}"));
    let wish = run_command(screen, &command);
    (screen.cursor, screen.line) = (cursor, line);
    if screen.last_message.0.is_empty() {
        screen.last_message.0 = command;
    }
    wish
}

/// Moves the cursor by one line or instruction, up or down.
fn move_cursor<M: DebuggedMachine>(screen: &mut DebuggerScreen<M>, by: isize) {
    if let Some(source) = source(screen, 2) {
        let at = source.lines.iter().position(|line| line.0 == source.around);
        let next = at.and_then(|at| source.lines.get(at.checked_add_signed(by)?)).map_or(source.around, |line| line.0);
        screen.line = (source.current_line != Some(next)).then_some(next);
        return;
    }
    let sight = code(screen, 2);
    let word = screen.cursor.unwrap_or(sight.pc);
    let Some(at) = sight.code.iter().position(|line| line.word == word) else { return };
    let next = at.checked_add_signed(by).and_then(|at| sight.code.get(at)).map_or(word, |line| line.word);
    screen.cursor = (next != sight.pc).then_some(next);
}
