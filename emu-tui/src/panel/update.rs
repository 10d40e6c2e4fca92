//! What keys do.

use ratatui_core::layout::Rect;

use super::{Pace, Panel, SPEEDS, prompt, view};
use crate::{Key, Wish};

/// Keys of the inputs, in their order. Letters that do something else are left out.
pub(super) const SWITCHES: &str = "123456789acdefhijklmnostuvxy";

/// What the digits are with the shift key, on an American keyboard. Alt does the same on every keyboard.
const SHIFTED: &str = "!@#$%^&*(";

/// Zooms of the waveform.
const ZOOMS: [usize; 6] = [1, 2, 5, 10, 20, 50];

/// Longest command line.
const LINE: usize = 200;

/// What a key makes of the panel, on a screen of this size.
pub(super) fn update(panel: &mut Panel, key: Key, area: Rect) -> Wish {
    if key == Key::Ctrl('c') {
        return Wish::Quit;
    }
    if panel.prompt.is_some() {
        typed(panel, key);
        return Wish::On;
    }
    if panel.help {
        // Any key closes the help, and does nothing else.
        panel.help = false;
        return Wish::On;
    }
    panel.told = (String::new(), false);
    match key {
        Key::Char('q') => return Wish::Quit,
        Key::Char('?') => panel.help = true,
        Key::Char(':') => panel.prompt = Some(String::new()),
        Key::Char(' ') => {
            pace(panel, Pace::Still);
            panel.machine.run(1);
        }
        Key::Char('g') => pace(panel, Pace::Free),
        Key::Char('r') if panel.machine.cycle_us() == 0 => {
            tell(panel, "this program has no cycle time to go by (CYCLE=)")
        }
        Key::Char('r') => pace(panel, Pace::Real),
        Key::Char('p') => pace(panel, Pace::Still),
        Key::Char('b') => back(panel, 1),
        Key::Char('B') => back(panel, 10),
        Key::Char('R') => {
            panel.machine.power_cycle();
            panel.told.0 = "power off and on: switches and EEPROM stay".to_owned();
        }
        Key::Char('+') => speed(panel, 2.0),
        Key::Char('-') => speed(panel, 0.5),
        Key::Char('z') => panel.zoom = next(panel.zoom),
        Key::Char('w') => panel.bit = view::next_bit(panel, area),
        Key::Char('.') => level(panel, 32),
        Key::Char(',') => level(panel, -32),
        Key::Char('>') => level(panel, 1),
        Key::Char('<') => level(panel, -1),
        Key::Tab => panel.analog += 1,
        Key::Char(']') => panel.first = (panel.first + 1).min(view::lowest(panel, area)),
        Key::Char('[') => panel.first = panel.first.min(view::lowest(panel, area)).saturating_sub(1),
        Key::Down => down(panel, area),
        Key::Up => up(panel, area),
        Key::PageDown => (0..5).for_each(|_| down(panel, area)),
        Key::PageUp => (0..5).for_each(|_| up(panel, area)),
        Key::Home => (panel.top, panel.left) = ((0, 0), 0),
        Key::End => panel.top = (rungs(panel).saturating_sub(1), 0),
        Key::Right => panel.left = (panel.left + 8).min(view::widest(panel, area)),
        Key::Left => panel.left = panel.left.saturating_sub(8),
        Key::Escape | Key::Enter | Key::Backspace => {}
        Key::Char(c) => switch(panel, c),
        Key::Alt(c) => pulse(panel, c),
        Key::Ctrl(c) => tell(panel, &format!("no key Ctrl-{c}; ? tells the keys")),
    }
    Wish::On
}

/// A key while the command line is open.
fn typed(panel: &mut Panel, key: Key) {
    let Some(mut line) = panel.prompt.take() else { return };
    match key {
        Key::Enter => {
            panel.told = match prompt::obey(panel, &line) {
                Ok(told) => (told, false),
                Err(why) => (why, true),
            };
            return;
        }
        Key::Escape => return,
        // Deleting behind the beginning leaves the line.
        Key::Backspace if line.pop().is_none() => return,
        Key::Char(c) if line.chars().count() < LINE => line.push(c),
        _ => {}
    }
    panel.prompt = Some(line);
}

fn tell(panel: &mut Panel, text: &str) {
    panel.told = (text.to_owned(), true);
}

fn pace(panel: &mut Panel, pace: Pace) {
    (panel.pace, panel.owed, panel.late) = (pace, 0.0, false);
}

fn back(panel: &mut Panel, scans: usize) {
    pace(panel, Pace::Still);
    if panel.machine.back(scans) == 0 {
        tell(panel, "nothing before this is kept");
    }
}

fn speed(panel: &mut Panel, factor: f64) {
    panel.speed = (panel.speed * factor).clamp(*SPEEDS.start(), *SPEEDS.end());
}

fn next(zoom: usize) -> usize {
    ZOOMS.into_iter().find(|next| *next > zoom).unwrap_or(1)
}

/// The input under a key.
fn input(panel: &Panel, keys: &str, key: char) -> Option<usize> {
    let at = keys.chars().position(|c| c == key)?;
    panel.inputs().nth(at)
}

fn switch(panel: &mut Panel, key: char) {
    if let Some(symbol) = input(panel, SWITCHES, key) {
        let value = i32::from(panel.machine.get(symbol) == 0);
        panel.machine.set(symbol, value);
    } else if let Some(symbol) = input(panel, SHIFTED, key) {
        panel.machine.pulse(symbol);
    } else if key.is_ascii_uppercase() && input(panel, SWITCHES, key.to_ascii_lowercase()).is_some() {
        pulse(panel, key.to_ascii_lowercase());
    } else if SWITCHES.contains(key) {
        tell(panel, &format!("no input under `{key}`: there are {}", panel.inputs().count()));
    } else {
        tell(panel, &format!("no key `{key}`; ? tells the keys"));
    }
}

fn pulse(panel: &mut Panel, key: char) {
    match input(panel, SWITCHES, key) {
        Some(symbol) => panel.machine.pulse(symbol),
        None => tell(panel, &format!("no input under `{key}`")),
    }
}

fn level(panel: &mut Panel, by: i32) {
    let count = panel.machine.levels().count();
    let Some((symbol, level)) = panel.machine.levels().nth(panel.analog % count.max(1)) else {
        return tell(panel, "the program reads no analog input");
    };
    let level = (i32::from(level) + by).clamp(0, 1023);
    panel.machine.set_level(symbol, u16::try_from(level).unwrap_or(0));
}

fn rungs(panel: &Panel) -> usize {
    panel.machine.program.rungs.len()
}

/// A rung further; a rung that is higher than the screen passes by in pieces.
fn down(panel: &mut Panel, area: Rect) {
    let (rung, lines) = panel.top;
    let (height, room) = view::height_of(panel, rung, area);
    if lines + room < height {
        panel.top.1 += (room / 2).max(1);
    } else if rung + 1 < rungs(panel) {
        panel.top = (rung + 1, 0);
    }
}

fn up(panel: &mut Panel, area: Rect) {
    let (rung, lines) = panel.top;
    let step = |room: usize| (room / 2).max(1);
    if lines > 0 {
        let (_, room) = view::height_of(panel, rung, area);
        panel.top.1 = lines.saturating_sub(step(room));
    } else if rung > 0 {
        let (height, room) = view::height_of(panel, rung - 1, area);
        let steps = height.saturating_sub(room).div_ceil(step(room));
        panel.top = (rung - 1, steps * step(room));
    }
}
