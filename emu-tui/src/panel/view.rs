//! Draws the panel.
//!
//! ```text
//!   wide: | title                     |     narrow: | title     |
//!         | rungs          | parts    |             | parts     |
//!         | waveforms                 |             | rungs     |
//!         | keys                      |             | waveforms |
//!                                                   | keys      |
//! ```

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::Style;

use super::{LadderPanel, PanelPace, parts, rows, wave};
use crate::ScreenStyle;
use crate::rung_picture::{self, GlyphInk, PictureGlyph};
use crate::style::{self, KeyLabel, PaneArea, key_label, truncate_text};

/// Minimum size (columns, lines) of a useful screen.
const MIN_SIZE: (u16, u16) = (32, 10);

/// Minimum width at which the parts are drawn next to the rungs.
const WIDE_FROM: u16 = 76;

/// The keys of the footer, in order of importance.
const KEYS: [KeyLabel; 9] = [
    key_label("space", "scan"),
    key_label("r", "clock"),
    key_label("g", "free"),
    key_label("p", "pause"),
    key_label("b", "back"),
    key_label("?", "help"),
    key_label("q", "quit"),
    key_label(":", "set"),
    key_label("R", "power"),
];

const HELP: &str = "\
space  one scan                  1 ..  throw a switch
r      run as the clock goes     !, A, alt-1 ..
g      run freely                      the same for one scan
p      pause                     . ,   analog level +32, -32
+ -    faster, slower            > <   analog level +1, -1
b B    back a scan, ten scans    tab   next analog input
R      power off and on          z w   waveform: zoom, next bits
arrows, page keys, home, end     scroll the rungs
[ ]                              scroll the parts
ctrl-z to the shell              q     quit
:      a command: Xa=1   Alevel=512   send hello\\n
                  scan 100   back 5   speed 0.5
";

/// The areas of the screen: rungs, parts, waveforms.
fn pane_areas(panel: &LadderPanel, area: Rect) -> [Rect; 3] {
    let inner = Rect { y: area.y + 1, height: area.height.saturating_sub(2), ..area };
    let wave_room = inner.height / 3;
    let wave = u16::try_from(wave::wave_height(panel)).unwrap_or(u16::MAX).min(wave_room);
    let wave = if wave < 2 { 0 } else { wave };
    let upper = Rect { height: inner.height - wave, ..inner };
    let lower = Rect { y: upper.y + upper.height, height: wave, ..inner };
    if area.width >= WIDE_FROM {
        let parts = (area.width * 3 / 8).clamp(30, 48);
        let rungs = Rect { width: area.width - parts - 3, ..upper };
        let parts = Rect { x: area.x + area.width - parts, width: parts, ..upper };
        return [rungs, parts, lower];
    }
    let wanted = rows::rows(panel, upper.width, ScreenStyle { color: false }).len();
    let parts = u16::try_from(wanted).unwrap_or(u16::MAX).min(upper.height / 2);
    let rungs = Rect { y: upper.y + parts, height: upper.height - parts, ..upper };
    [rungs, Rect { height: parts, ..upper }, lower]
}

/// Maximum scroll position of the parts.
pub(super) fn max_part_scroll(panel: &LadderPanel, area: Rect) -> usize {
    let [_, place, _] = pane_areas(panel, area);
    rows::rows(panel, place.width, ScreenStyle { color: false }).len().saturating_sub(usize::from(place.height))
}

/// The first waveform bit of the next page; after the last page, the first bit.
pub(super) fn next_bit(panel: &LadderPanel, area: Rect) -> usize {
    let [.., place] = pane_areas(panel, area);
    let rows = usize::from(place.height.saturating_sub(1));
    if panel.first_bit + rows + 1 < wave::wave_height(panel) { panel.first_bit + rows } else { 0 }
}

/// Heights in lines that decide how far a pane scrolls.
pub(super) struct RungHeights {
    /// Height of the rung.
    pub rung: usize,
    /// Height of the pane for rungs.
    pub pane: usize,
}

/// Heights of a rung and of the pane for rungs.
pub(super) fn rung_heights(panel: &LadderPanel, rung: usize, area: Rect) -> RungHeights {
    let [place, ..] = pane_areas(panel, area);
    let lines =
        rung_picture::rung_picture(&panel.machine.program, rung, usize::from(place.width), &panel.machine, None);
    RungHeights { rung: lines.len(), pane: usize::from(place.height) }
}

/// Maximum scroll position to the right of the visible rungs.
pub(super) fn max_column_scroll(panel: &LadderPanel, area: Rect) -> usize {
    let [place, ..] = pane_areas(panel, area);
    let lines = rung_lines(panel, place);
    let widest = lines.iter().map(Vec::len).max().unwrap_or(0);
    (widest + 1).saturating_sub(usize::from(place.width))
}

/// Draws the whole panel.
pub(super) fn view(panel: &LadderPanel, area: Rect, look: ScreenStyle) -> Buffer {
    let mut picture = Buffer::empty(area);
    if area.width < MIN_SIZE.0 || area.height < MIN_SIZE.1 {
        let text = format!("needs {}x{}", MIN_SIZE.0, MIN_SIZE.1);
        PaneArea::new(&mut picture, area).put(0, 0, &text, look.text());
        return picture;
    }
    let [rungs, parts, lower] = pane_areas(panel, area);
    draw_title(panel, &mut PaneArea::new(&mut picture, area), look);
    draw_rungs(panel, &mut PaneArea::new(&mut picture, rungs), look);
    if area.width >= WIDE_FROM {
        let mut rule = PaneArea::new(&mut picture, Rect { x: parts.x - 2, width: 1, ..parts });
        (0..parts.height).for_each(|y| _ = rule.put(0, y, "│", look.faint()));
    }
    draw_parts(panel, &mut PaneArea::new(&mut picture, parts), look);
    if lower.height > 0 {
        wave::draw_wave(panel, &mut PaneArea::new(&mut picture, lower), look);
    }
    let last = Rect { y: area.y + area.height - 1, height: 1, ..area };
    draw_footer(panel, &mut PaneArea::new(&mut picture, last), look);
    if panel.help {
        style::draw_help(&mut picture, area, HELP, look);
    }
    picture
}

fn draw_title(panel: &LadderPanel, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let width = paper.area.width;
    paper.put(0, 0, &" ".repeat(usize::from(width)), look.bar());
    let scans = panel.machine.evaluator().scans();
    let time = parts::format_us(i64::try_from(scans.saturating_mul(panel.machine.cycle_us())).unwrap_or(i64::MAX));
    let speed = format!("{:.3}", panel.speed);
    let speed = speed.trim_end_matches('0').trim_end_matches('.');
    let pace = match panel.pace {
        PanelPace::Paused => "▪ pause".to_owned(),
        PanelPace::Free => "▶ free".to_owned(),
        PanelPace::Real if panel.is_late => format!("▶ clock x{speed}, late"),
        PanelPace::Real => format!("▶ clock x{speed}"),
    };
    let right = format!("scan {scans}   {time}   {pace} ");
    let room = usize::from(width).saturating_sub(right.chars().count() + 2);
    paper.put(1, 0, &truncate_text(&panel.name, room), look.bar());
    paper.put_right(width, 0, &right, look.bar());
}

/// Lines of the visible rungs, as many as fill the pane.
fn rung_lines(panel: &LadderPanel, place: Rect) -> Vec<Vec<PictureGlyph>> {
    let (top, above) = panel.first_rung;
    let mut lines = Vec::new();
    for rung in top..panel.machine.program.rungs.len() {
        if lines.len() >= usize::from(place.height) + above {
            break;
        }
        lines.extend(rung_picture::rung_picture(
            &panel.machine.program,
            rung,
            usize::from(place.width),
            &panel.machine,
            None,
        ));
    }
    lines.drain(..above.min(lines.len()));
    lines.truncate(usize::from(place.height));
    lines
}

fn draw_rungs(panel: &LadderPanel, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let lines = rung_lines(panel, paper.area);
    for (y, line) in (0..paper.area.height).zip(&lines) {
        let mut x = 0;
        for sign in line.iter().skip(panel.first_column) {
            let style = glyph_style(sign, look);
            x = paper.put(x, y, sign.glyph.encode_utf8(&mut [0; 4]), style);
        }
        if line.len() > panel.first_column + usize::from(paper.area.width) {
            // A marker that the line continues to the right.
            paper.put_right(paper.area.width, y, "›", look.key());
        }
    }
    if panel.machine.program.rungs.is_empty() {
        paper.put(1, 0, "the program has no rungs", look.faint());
    }
}

fn glyph_style(sign: &PictureGlyph, look: ScreenStyle) -> Style {
    match sign.ink {
        GlyphInk::Power(power) => look.on(power),
        GlyphInk::Name(true) => look.live(),
        GlyphInk::Name(false) => look.text(),
        GlyphInk::Comment => look.comment(),
        GlyphInk::Number => look.faint(),
    }
}

fn draw_parts(panel: &LadderPanel, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let rows = rows::rows(panel, paper.area.width, look);
    let height = usize::from(paper.area.height);
    let first = panel.first_part.min(rows.len().saturating_sub(height));
    for (y, row) in (0..paper.area.height).zip(rows.iter().skip(first)) {
        match row {
            rows::PanelRow::Head(name) => paper.put_heading(y, name, look),
            rows::PanelRow::Line(spans) => {
                let mut x = 0;
                for (text, style) in spans {
                    x = paper.put(x, y, text, *style);
                }
            }
        }
    }
    let hidden = rows.len().saturating_sub(first + height);
    if hidden > 0 && height > 0 {
        let text = format!(" {hidden} more below: ] ");
        paper.put_right(paper.area.width, paper.area.height - 1, &text, look.bar());
    }
}

fn draw_footer(panel: &LadderPanel, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let (message, wrong) = &panel.last_message;
    match &panel.prompt {
        Some(line) => style::draw_prompt(paper, line, look),
        None if message.is_empty() => style::draw_keys(paper, &KEYS, look),
        None => _ = paper.put(0, 0, message, if *wrong { look.wrong() } else { look.text() }),
    }
}
