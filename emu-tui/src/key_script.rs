//! Plays key scripts on a view without a terminal, and converts pictures to text.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::{Color, Modifier};

use crate::{ScreenStyle, ScreenView, ScriptStep, ViewRequest};

/// Plays the steps on a screen of the given size and returns the last picture; a step that quits ends the
/// script.
pub fn play_keys(app: &mut dyn ScreenView, steps: &[ScriptStep], area: Rect, look: ScreenStyle) -> Buffer {
    for step in steps {
        match *step {
            ScriptStep::Wait(time) => app.advance_time(time),
            ScriptStep::Key(key) if app.handle_key(key, area) == ViewRequest::Quit => break,
            ScriptStep::Key(_) => {}
        }
    }
    app.render(area, look)
}

/// A picture as lines of text without trailing spaces; with colours as escape sequences of a terminal (SGR).
#[must_use]
pub fn picture_text(picture: &Buffer, look: ScreenStyle) -> String {
    let mut out = String::new();
    let width = usize::from(picture.area.width).max(1);
    for row in picture.content().chunks(width) {
        let used = row.iter().rposition(|c| c.symbol() != " ").map_or(0, |at| at + 1);
        let mut before = String::new();
        for cell in row.iter().take(used) {
            let sgr = if look.color { sgr_parameters(cell.fg, cell.modifier) } else { String::new() };
            if sgr != before {
                out.push_str(&format!("\x1b[0{sgr}m"));
                before = sgr;
            }
            out.push_str(cell.symbol());
        }
        if !before.is_empty() {
            out.push_str("\x1b[0m");
        }
        out.push('\n');
    }
    out
}

/// The SGR parameters of a style.
fn sgr_parameters(color: Color, modifier: Modifier) -> String {
    let mut out = String::new();
    for (one, code) in [(Modifier::BOLD, 1), (Modifier::DIM, 2), (Modifier::UNDERLINED, 4), (Modifier::REVERSED, 7)] {
        if modifier.contains(one) {
            out.push_str(&format!(";{code}"));
        }
    }
    let code = match color {
        Color::Red => 31,
        Color::Green => 32,
        Color::Yellow => 33,
        Color::Blue => 34,
        Color::Cyan => 36,
        Color::DarkGray => 90,
        _ => return out,
    };
    out + &format!(";{code}")
}
