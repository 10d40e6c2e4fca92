//! Handles the keys of the panel.

use ratatui_core::layout::Rect;

use super::{LadderPanel, PanelPace, SPEEDS, prompt, view};
use crate::{ScreenKey, ViewRequest};

/// Keys of the inputs, in input order. Letters with another function are left out.
pub(super) const SWITCH_KEYS: &str = "123456789acdefhijklmnostuvxy";

/// The digits with the shift key on an American keyboard; Alt with a digit does the same on every keyboard.
const SHIFTED: &str = "!@#$%^&*(";

/// Scans per column of the waveforms, to select from.
const ZOOMS: [usize; 6] = [1, 2, 5, 10, 20, 50];

/// Maximum length of a command line in characters.
const MAX_COMMAND_LENGTH: usize = 200;

/// Handles a key on a screen of this size.
pub(super) fn update(panel: &mut LadderPanel, key: ScreenKey, area: Rect) -> ViewRequest {
    if key == ScreenKey::Ctrl('c') {
        return ViewRequest::Quit;
    }
    if panel.prompt.is_some() {
        handle_prompt_key(panel, key);
        return ViewRequest::Continue;
    }
    if panel.help {
        // Any key closes the help and has no other effect.
        panel.help = false;
        return ViewRequest::Continue;
    }
    panel.last_message = (String::new(), false);
    match key {
        ScreenKey::Char('q') => return ViewRequest::Quit,
        ScreenKey::Char('?') => panel.help = true,
        ScreenKey::Char(':') => panel.prompt = Some(String::new()),
        ScreenKey::Char(' ') => {
            set_pace(panel, PanelPace::Paused);
            panel.machine.run(1);
        }
        ScreenKey::Char('g') => set_pace(panel, PanelPace::Free),
        ScreenKey::Char('r') if panel.machine.cycle_us() == 0 => {
            set_message(panel, "this program has no cycle time to go by (CYCLE=)")
        }
        ScreenKey::Char('r') => set_pace(panel, PanelPace::Real),
        ScreenKey::Char('p') => set_pace(panel, PanelPace::Paused),
        ScreenKey::Char('b') => go_back(panel, 1),
        ScreenKey::Char('B') => go_back(panel, 10),
        ScreenKey::Char('R') => {
            panel.machine.power_cycle();
            panel.last_message.0 = "power off and on: switches and EEPROM stay".to_owned();
        }
        ScreenKey::Char('+') => scale_speed(panel, 2.0),
        ScreenKey::Char('-') => scale_speed(panel, 0.5),
        ScreenKey::Char('z') => panel.zoom = next_zoom(panel.zoom),
        ScreenKey::Char('w') => panel.first_bit = view::next_bit(panel, area),
        ScreenKey::Char('.') => change_level(panel, 32),
        ScreenKey::Char(',') => change_level(panel, -32),
        ScreenKey::Char('>') => change_level(panel, 1),
        ScreenKey::Char('<') => change_level(panel, -1),
        ScreenKey::Tab => panel.analog += 1,
        ScreenKey::Char(']') => panel.first_part = (panel.first_part + 1).min(view::max_part_scroll(panel, area)),
        ScreenKey::Char('[') => {
            panel.first_part = panel.first_part.min(view::max_part_scroll(panel, area)).saturating_sub(1)
        }
        ScreenKey::Down => scroll_down(panel, area),
        ScreenKey::Up => scroll_up(panel, area),
        ScreenKey::PageDown => (0..5).for_each(|_| scroll_down(panel, area)),
        ScreenKey::PageUp => (0..5).for_each(|_| scroll_up(panel, area)),
        ScreenKey::Home => (panel.first_rung, panel.first_column) = ((0, 0), 0),
        ScreenKey::End => panel.first_rung = (rung_count(panel).saturating_sub(1), 0),
        ScreenKey::Right => panel.first_column = (panel.first_column + 8).min(view::max_column_scroll(panel, area)),
        ScreenKey::Left => panel.first_column = panel.first_column.saturating_sub(8),
        ScreenKey::Escape | ScreenKey::Enter | ScreenKey::Backspace => {}
        ScreenKey::Char(c) => toggle_switch(panel, c),
        ScreenKey::Alt(c) => pulse_switch(panel, c),
        ScreenKey::Ctrl(c) => set_message(panel, &format!("no key Ctrl-{c}; ? lists the keys")),
    }
    ViewRequest::Continue
}

/// Handles a key while the command line is open.
fn handle_prompt_key(panel: &mut LadderPanel, key: ScreenKey) {
    let Some(mut line) = panel.prompt.take() else { return };
    match key {
        ScreenKey::Enter => {
            panel.last_message = match prompt::run_command(panel, &line) {
                Ok(message) => (message, false),
                Err(error) => (error.to_string(), true),
            };
            return;
        }
        ScreenKey::Escape => return,
        // Backspace on an empty line closes the command line.
        ScreenKey::Backspace if line.pop().is_none() => return,
        ScreenKey::Char(c) if line.chars().count() < MAX_COMMAND_LENGTH => line.push(c),
        _ => {}
    }
    panel.prompt = Some(line);
}

fn set_message(panel: &mut LadderPanel, text: &str) {
    panel.last_message = (text.to_owned(), true);
}

fn set_pace(panel: &mut LadderPanel, pace: PanelPace) {
    (panel.pace, panel.us_due, panel.is_late) = (pace, 0.0, false);
}

fn go_back(panel: &mut LadderPanel, scans: usize) {
    set_pace(panel, PanelPace::Paused);
    if panel.machine.go_back(scans) == 0 {
        set_message(panel, "nothing before this is kept");
    }
}

fn scale_speed(panel: &mut LadderPanel, factor: f64) {
    panel.speed = (panel.speed * factor).clamp(*SPEEDS.start(), *SPEEDS.end());
}

fn next_zoom(zoom: usize) -> usize {
    ZOOMS.into_iter().find(|next| *next > zoom).unwrap_or(1)
}

/// The input that belongs to a key.
fn input_of_key(panel: &LadderPanel, keys: &str, key: char) -> Option<usize> {
    let at = keys.chars().position(|c| c == key)?;
    panel.inputs().nth(at)
}

fn toggle_switch(panel: &mut LadderPanel, key: char) {
    if let Some(symbol) = input_of_key(panel, SWITCH_KEYS, key) {
        let value = i32::from(panel.machine.get(symbol) == 0);
        panel.machine.set(symbol, value);
    } else if let Some(symbol) = input_of_key(panel, SHIFTED, key) {
        panel.machine.pulse(symbol);
    } else if key.is_ascii_uppercase() && input_of_key(panel, SWITCH_KEYS, key.to_ascii_lowercase()).is_some() {
        pulse_switch(panel, key.to_ascii_lowercase());
    } else if SWITCH_KEYS.contains(key) {
        set_message(panel, &format!("no input under `{key}`: there are {}", panel.inputs().count()));
    } else {
        set_message(panel, &format!("no key `{key}`; ? lists the keys"));
    }
}

fn pulse_switch(panel: &mut LadderPanel, key: char) {
    match input_of_key(panel, SWITCH_KEYS, key) {
        Some(symbol) => panel.machine.pulse(symbol),
        None => set_message(panel, &format!("no input under `{key}`")),
    }
}

fn change_level(panel: &mut LadderPanel, by: i32) {
    let count = panel.machine.levels().count();
    let Some((symbol, level)) = panel.machine.levels().nth(panel.analog % count.max(1)) else {
        return set_message(panel, "the program reads no analog input");
    };
    let level = (i32::from(level) + by).clamp(0, 1023);
    panel.machine.set_level(symbol, u16::try_from(level).unwrap_or(0));
}

fn rung_count(panel: &LadderPanel) -> usize {
    panel.machine.program.rungs.len()
}

/// Scrolls down by one rung; a rung that is higher than the pane is scrolled in several steps.
fn scroll_down(panel: &mut LadderPanel, area: Rect) {
    let (rung, lines) = panel.first_rung;
    let view::RungHeights { rung: height, pane: room } = view::rung_heights(panel, rung, area);
    if lines + room < height {
        panel.first_rung.1 += (room / 2).max(1);
    } else if rung + 1 < rung_count(panel) {
        panel.first_rung = (rung + 1, 0);
    }
}

fn scroll_up(panel: &mut LadderPanel, area: Rect) {
    let (rung, lines) = panel.first_rung;
    let step = |room: usize| (room / 2).max(1);
    if lines > 0 {
        let room = view::rung_heights(panel, rung, area).pane;
        panel.first_rung.1 = lines.saturating_sub(step(room));
    } else if rung > 0 {
        let view::RungHeights { rung: height, pane: room } = view::rung_heights(panel, rung - 1, area);
        let steps = height.saturating_sub(room).div_ceil(step(room));
        panel.first_rung = (rung - 1, steps * step(room));
    }
}
