//! What keys do.

use ratatui_core::layout::Rect;

use super::{Debugger, Lower, Machine, Run, Wants, view};
use crate::{Key, Wish};

/// Keys that are short for a command.
const COMMANDS: [(char, &str); 11] = [
    ('s', "stepi"),
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

/// Machine cycles in a column of the waveform.
pub const SCALES: [u64; 8] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Longest command line.
const LINE: usize = 400;

/// What a key makes of the screen.
pub fn update<M: Machine>(screen: &mut Debugger<M>, key: Key, area: Rect) -> Wish {
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
            let Some(address) = here(screen).map(|line| line.1) else { return Wish::On };
            return obey(screen, &format!("until {address}"));
        }
        Key::Char('z') => screen.zoom = (screen.zoom + 1) % SCALES.len(),
        Key::Char('Z') => screen.zoom = (screen.zoom + SCALES.len() - 1) % SCALES.len(),
        Key::Char('m') => {
            (screen.lower, screen.memory) =
                (Lower::Memory, (screen.memory.0 + usize::from(screen.lower == Lower::Memory), 0))
        }
        Key::Char(']') => screen.memory.1 = screen.memory.1.saturating_add(view::row_bytes(area)),
        Key::Char('[') => screen.memory.1 = screen.memory.1.saturating_sub(view::row_bytes(area)),
        Key::PageDown => screen.memory.1 = screen.memory.1.saturating_add(16 * view::row_bytes(area)),
        Key::PageUp => screen.memory.1 = screen.memory.1.saturating_sub(16 * view::row_bytes(area)),
        Key::Tab => {
            screen.lower = match screen.lower {
                Lower::Rung => Lower::Symbols,
                Lower::Symbols => Lower::Memory,
                Lower::Memory if has_ladder(screen) => Lower::Rung,
                Lower::Memory => Lower::Memory,
            }
        }
        Key::Down => screen.cursor = beside(screen, 1),
        Key::Up => screen.cursor = beside(screen, -1),
        Key::Home | Key::Escape => screen.cursor = None,
        Key::Char(c) => match COMMANDS.iter().find(|(key, _)| *key == c) {
            Some((_, command)) => return obey(screen, command),
            None => screen.told = (format!("no key `{c}`; ? tells the keys"), true),
        },
        _ => {}
    }
    Wish::On
}

fn has_ladder<M: Machine>(screen: &Debugger<M>) -> bool {
    !screen.machine.sight(&code(screen, 0)).symbols.is_empty()
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
    screen.cursor = None;
    if answer.quit { Wish::Quit } else { Wish::On }
}

/// Wants nothing but code.
fn code<M>(screen: &Debugger<M>, lines: usize) -> Wants {
    Wants { around: screen.cursor, lines, rung: 0, memory: (0, 0, 0), since: u64::MAX }
}

/// Word, address and breakpoint of the line under the cursor.
fn here<M: Machine>(screen: &Debugger<M>) -> Option<(u32, String, Option<u32>)> {
    let sight = screen.machine.sight(&code(screen, 1));
    let word = screen.cursor.unwrap_or(sight.pc);
    sight.code.into_iter().find(|line| line.word == word).map(|line| (line.word, line.address, line.point))
}

/// Sets a breakpoint under the cursor, or deletes it.
fn toggle<M: Machine>(screen: &mut Debugger<M>) -> Wish {
    let cursor = screen.cursor;
    let Some((_, address, point)) = here(screen) else { return Wish::On };
    let command = point.map_or_else(|| format!("break {address}"), |id| format!("delete {id}"));
    let wish = obey(screen, &command);
    screen.cursor = cursor;
    if screen.told.0.is_empty() {
        screen.told.0 = command;
    }
    wish
}

/// The instruction before or behind the one under the cursor.
fn beside<M: Machine>(screen: &Debugger<M>, by: isize) -> Option<u32> {
    let sight = screen.machine.sight(&code(screen, 2));
    let word = screen.cursor.unwrap_or(sight.pc);
    let at = sight.code.iter().position(|line| line.word == word)?;
    let next = at.checked_add_signed(by).and_then(|at| sight.code.get(at)).map_or(word, |line| line.word);
    (next != sight.pc).then_some(next)
}
