//! What keys do.

use ratatui_core::layout::Rect;

use super::{Debugger, Lower, Machine, Run, Source, Wants, view};
use crate::{Key, Wish};

/// Keys that are short for a command.
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

/// Those of which the source shows another: what they do to lines.
const LINES: [(char, &str); 3] = [('s', "step"), ('u', "reverse-step"), ('U', "reverse-next")];

/// Machine cycles in a column of the waveform.
pub(super) const SCALES: [u64; 8] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Longest command line.
const LINE: usize = 400;

/// What a key makes of the screen.
pub(super) fn update<M: Machine>(screen: &mut Debugger<M>, key: Key, area: Rect) -> Wish {
    if let Some(line) = screen.prompt.take() {
        return typed(screen, line, key);
    }
    if screen.help {
        // Any key closes the help; of those only Ctrl-C does what it says.
        screen.help = false;
        return if key == Key::Ctrl('c') { Wish::Quit } else { Wish::On };
    }
    if screen.run.take().is_some() {
        // Whatever the key was, it stops a run first; a pause is nothing but that.
        screen.told = ("paused".to_owned(), false);
        if matches!(key, Key::Char(' ' | 'p') | Key::Ctrl('c') | Key::Escape) {
            return Wish::On;
        }
    }
    screen.owed = 0.0;
    match key {
        Key::Char('q') | Key::Ctrl('c') => return Wish::Quit,
        Key::Char('?') => screen.help = true,
        Key::Char(':') => screen.prompt = Some(String::new()),
        Key::Char(' ') => screen.run = Some(Run::Clock),
        Key::Char('c') => screen.run = Some(Run::Free),
        Key::Char('+') => screen.speed = (screen.speed * 2.0).min(1024.0),
        Key::Char('-') => screen.speed = (screen.speed / 2.0).max(1.0 / 65_536.0),
        Key::Char('b') => return toggle(screen),
        Key::Enter => {
            let Some((place, _)) = here(screen) else { return Wish::On };
            return obey(screen, &format!("until {place}"));
        }
        Key::Char('z') => screen.zoom = (screen.zoom + 1) % SCALES.len(),
        Key::Char('Z') => screen.zoom = (screen.zoom + SCALES.len() - 1) % SCALES.len(),
        Key::Char('v') => (screen.source, screen.cursor, screen.line) = (!screen.source, None, None),
        Key::Char('m') => {
            let next = usize::from(screen.lower() == Lower::Memory);
            (screen.lower, screen.memory) = (Some(Lower::Memory), (screen.memory.0 + next, 0))
        }
        Key::Char(']') => screen.memory.1 = screen.memory.1.saturating_add(view::row_bytes(area)),
        Key::Char('[') => screen.memory.1 = screen.memory.1.saturating_sub(view::row_bytes(area)),
        Key::PageDown => screen.memory.1 = screen.memory.1.saturating_add(16 * view::row_bytes(area)),
        Key::PageUp => screen.memory.1 = screen.memory.1.saturating_sub(16 * view::row_bytes(area)),
        Key::Tab => {
            screen.lower = Some(match screen.lower() {
                Lower::Rung => Lower::Symbols,
                Lower::Symbols => Lower::Memory,
                Lower::Memory => Lower::Serial,
                Lower::Serial if screen.ladder => Lower::Rung,
                Lower::Serial => Lower::Memory,
            })
        }
        Key::Down => beside(screen, 1),
        Key::Up => beside(screen, -1),
        Key::Home | Key::Escape => (screen.cursor, screen.line) = (None, None),
        Key::Char(c) => match commands(screen).find(|(key, _)| *key == c) {
            Some((_, command)) => return obey(screen, command),
            None => screen.told = (format!("no key `{c}`; ? tells the keys"), true),
        },
        _ => {}
    }
    Wish::On
}

/// The keys that are short for a command, as they are now.
fn commands<M: Machine>(screen: &Debugger<M>) -> impl Iterator<Item = (char, &'static str)> + use<M> {
    let lines = if source(screen, 0).is_some() { &LINES[..] } else { &[] };
    lines.iter().chain(&COMMANDS).copied()
}

/// A key while the command line is open.
fn typed<M: Machine>(screen: &mut Debugger<M>, mut line: String, key: Key) -> Wish {
    match key {
        Key::Ctrl('c') | Key::Escape => return Wish::On,
        // A command that lets the machine run is a run of the screen, which shows it on its way.
        Key::Enter if matches!(line.trim(), "c" | "continue") => {
            (screen.run, screen.owed) = (Some(Run::Free), 0.0);
            return Wish::On;
        }
        Key::Enter => return obey(screen, &line),
        Key::Backspace if line.pop().is_none() => return Wish::On,
        Key::Char(c) if line.chars().count() < LINE => line.push(c),
        _ => {}
    }
    screen.prompt = Some(line);
    Wish::On
}

fn obey<M: Machine>(screen: &mut Debugger<M>, line: &str) -> Wish {
    let answer = screen.machine.obey(line);
    screen.told = (answer.text, answer.failed);
    (screen.cursor, screen.line) = (None, None);
    if answer.quit { Wish::Quit } else { Wish::On }
}

/// The code around the cursor, and nothing else.
fn code<M: Machine>(screen: &Debugger<M>, lines: usize) -> super::Sight {
    screen.machine.sight(&Wants { around: screen.cursor, lines, since: u64::MAX, ..Wants::default() })
}

/// The source around the cursor, where it is shown.
fn source<M: Machine>(screen: &Debugger<M>, lines: usize) -> Option<Source> {
    let wants = Wants { line: screen.line, source: lines + 1, since: u64::MAX, ..Wants::default() };
    if screen.source { screen.machine.sight(&wants).source } else { None }
}

/// The place under the cursor as commands take it, and the breakpoint there.
fn here<M: Machine>(screen: &Debugger<M>) -> Option<(String, Option<u32>)> {
    if let Some(source) = source(screen, 0) {
        let line = source.lines.iter().find(|line| line.0 == source.around)?;
        return Some((format!("{}:{}", source.file, source.around), line.2));
    }
    let sight = code(screen, 1);
    let word = screen.cursor.unwrap_or(sight.pc);
    sight.code.into_iter().find(|line| line.word == word).map(|line| (line.address, line.point))
}

/// Sets a breakpoint under the cursor, or deletes it.
fn toggle<M: Machine>(screen: &mut Debugger<M>) -> Wish {
    let (cursor, line) = (screen.cursor, screen.line);
    let Some((place, point)) = here(screen) else { return Wish::On };
    let command = point.map_or_else(|| format!("break {place}"), |id| format!("delete {id}"));
    let wish = obey(screen, &command);
    (screen.cursor, screen.line) = (cursor, line);
    if screen.told.0.is_empty() {
        screen.told.0 = command;
    }
    wish
}

/// Puts the cursor before or behind the line, or the instruction, under it.
fn beside<M: Machine>(screen: &mut Debugger<M>, by: isize) {
    if let Some(source) = source(screen, 2) {
        let at = source.lines.iter().position(|line| line.0 == source.around);
        let next = at.and_then(|at| source.lines.get(at.checked_add_signed(by)?)).map_or(source.around, |line| line.0);
        screen.line = (source.here != Some(next)).then_some(next);
        return;
    }
    let sight = code(screen, 2);
    let word = screen.cursor.unwrap_or(sight.pc);
    let Some(at) = sight.code.iter().position(|line| line.word == word) else { return };
    let next = at.checked_add_signed(by).and_then(|at| sight.code.get(at)).map_or(word, |line| line.word);
    screen.cursor = (next != sight.pc).then_some(next);
}
