//! What the panel looks like.
//!
//! ```text
//!   wide: | title                     |     narrow: | title    |
//!         | rungs          | parts    |             | parts    |
//!         | waveform                  |             | rungs    |
//!         | keys                      |             | waveform |
//!                                                   | keys     |
//! ```

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::Style;

use super::{Pace, Panel, parts, rows, wave};
use crate::Look;
use crate::flow::{self, Ink, Sign};
use crate::look::{self, Paper, fit};

/// Least size that shows anything of use.
const LEAST: (u16, u16) = (32, 10);

/// From this width on the parts stand beside the rungs.
const WIDE: u16 = 76;

/// The keys, as many as fit.
const KEYS: [(&str, &str); 9] = [
    ("space", "scan"),
    ("r", "clock"),
    ("g", "free"),
    ("p", "pause"),
    ("b", "back"),
    ("?", "help"),
    ("q", "quit"),
    (":", "set"),
    ("R", "power"),
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

/// Where the parts of the screen are: rungs, parts, waveform.
fn places(panel: &Panel, area: Rect) -> [Rect; 3] {
    let inner = Rect { y: area.y + 1, height: area.height.saturating_sub(2), ..area };
    let wave_room = inner.height / 3;
    let wave = u16::try_from(wave::height(panel)).unwrap_or(u16::MAX).min(wave_room);
    let wave = if wave < 2 { 0 } else { wave };
    let upper = Rect { height: inner.height - wave, ..inner };
    let lower = Rect { y: upper.y + upper.height, height: wave, ..inner };
    if area.width >= WIDE {
        let parts = (area.width * 3 / 8).clamp(30, 48);
        let rungs = Rect { width: area.width - parts - 3, ..upper };
        let parts = Rect { x: area.x + area.width - parts, width: parts, ..upper };
        return [rungs, parts, lower];
    }
    let wanted = rows::rows(panel, upper.width, Look { color: false }).len();
    let parts = u16::try_from(wanted).unwrap_or(u16::MAX).min(upper.height / 2);
    let rungs = Rect { y: upper.y + parts, height: upper.height - parts, ..upper };
    [rungs, Rect { height: parts, ..upper }, lower]
}

/// How far the parts can be scrolled.
pub(super) fn lowest(panel: &Panel, area: Rect) -> usize {
    let [_, place, _] = places(panel, area);
    rows::rows(panel, place.width, Look { color: false }).len().saturating_sub(usize::from(place.height))
}

/// The first bit of the waveform after another screenful; the first of all after the last.
pub(super) fn next_bit(panel: &Panel, area: Rect) -> usize {
    let [.., place] = places(panel, area);
    let rows = usize::from(place.height.saturating_sub(1));
    if panel.bit + rows + 1 < wave::height(panel) { panel.bit + rows } else { 0 }
}

/// Height of a rung, and of the place for rungs.
pub(super) fn height_of(panel: &Panel, rung: usize, area: Rect) -> (usize, usize) {
    let [place, ..] = places(panel, area);
    let lines = flow::rung(&panel.machine.program, rung, usize::from(place.width), &panel.machine, None);
    (lines.len(), usize::from(place.height))
}

/// How far the rungs that are seen can be scrolled to the right.
pub(super) fn widest(panel: &Panel, area: Rect) -> usize {
    let [place, ..] = places(panel, area);
    let lines = rung_lines(panel, place);
    let widest = lines.iter().map(Vec::len).max().unwrap_or(0);
    (widest + 1).saturating_sub(usize::from(place.width))
}

/// The whole picture.
pub(super) fn view(panel: &Panel, area: Rect, look: Look) -> Buffer {
    let mut picture = Buffer::empty(area);
    if area.width < LEAST.0 || area.height < LEAST.1 {
        let text = format!("needs {}x{}", LEAST.0, LEAST.1);
        Paper::new(&mut picture, area).put(0, 0, &text, look.text());
        return picture;
    }
    let [rungs, parts, lower] = places(panel, area);
    title(panel, &mut Paper::new(&mut picture, area), look);
    draw_rungs(panel, &mut Paper::new(&mut picture, rungs), look);
    if area.width >= WIDE {
        let mut rule = Paper::new(&mut picture, Rect { x: parts.x - 2, width: 1, ..parts });
        (0..parts.height).for_each(|y| _ = rule.put(0, y, "│", look.faint()));
    }
    draw_parts(panel, &mut Paper::new(&mut picture, parts), look);
    if lower.height > 0 {
        wave::draw(panel, &mut Paper::new(&mut picture, lower), look);
    }
    let last = Rect { y: area.y + area.height - 1, height: 1, ..area };
    foot(panel, &mut Paper::new(&mut picture, last), look);
    if panel.help {
        look::help(&mut picture, area, HELP, look);
    }
    picture
}

fn title(panel: &Panel, paper: &mut Paper<'_>, look: Look) {
    let width = paper.area.width;
    paper.put(0, 0, &" ".repeat(usize::from(width)), look.bar());
    let scans = panel.machine.evaluator().scans();
    let time = parts::time(i64::try_from(scans.saturating_mul(panel.machine.cycle_us())).unwrap_or(i64::MAX));
    let speed = format!("{:.3}", panel.speed);
    let speed = speed.trim_end_matches('0').trim_end_matches('.');
    let pace = match panel.pace {
        Pace::Still => "▪ pause".to_owned(),
        Pace::Free => "▶ free".to_owned(),
        Pace::Real if panel.late => format!("▶ clock x{speed}, late"),
        Pace::Real => format!("▶ clock x{speed}"),
    };
    let right = format!("scan {scans}   {time}   {pace} ");
    let room = usize::from(width).saturating_sub(right.chars().count() + 2);
    paper.put(1, 0, &fit(&panel.name, room), look.bar());
    paper.put_right(width, 0, &right, look.bar());
}

/// Lines of the rungs from the uppermost on, as many as fill the place.
fn rung_lines(panel: &Panel, place: Rect) -> Vec<Vec<Sign>> {
    let (top, above) = panel.top;
    let mut lines = Vec::new();
    for rung in top..panel.machine.program.rungs.len() {
        if lines.len() >= usize::from(place.height) + above {
            break;
        }
        lines.extend(flow::rung(&panel.machine.program, rung, usize::from(place.width), &panel.machine, None));
    }
    lines.drain(..above.min(lines.len()));
    lines.truncate(usize::from(place.height));
    lines
}

fn draw_rungs(panel: &Panel, paper: &mut Paper<'_>, look: Look) {
    let lines = rung_lines(panel, paper.area);
    for (y, line) in (0..paper.area.height).zip(&lines) {
        let mut x = 0;
        for sign in line.iter().skip(panel.left) {
            let style = style(sign, look);
            x = paper.put(x, y, sign.sign.encode_utf8(&mut [0; 4]), style);
        }
        if line.len() > panel.left + usize::from(paper.area.width) {
            // There is more to the right.
            paper.put_right(paper.area.width, y, "›", look.key());
        }
    }
    if panel.machine.program.rungs.is_empty() {
        paper.put(1, 0, "the program has no rungs", look.faint());
    }
}

fn style(sign: &Sign, look: Look) -> Style {
    match sign.ink {
        Ink::Power(power) => look.on(power),
        Ink::Name(true) => look.live(),
        Ink::Name(false) => look.text(),
        Ink::Comment => look.comment(),
        Ink::Number => look.faint(),
    }
}

fn draw_parts(panel: &Panel, paper: &mut Paper<'_>, look: Look) {
    let rows = rows::rows(panel, paper.area.width, look);
    let height = usize::from(paper.area.height);
    let first = panel.first.min(rows.len().saturating_sub(height));
    for (y, row) in (0..paper.area.height).zip(rows.iter().skip(first)) {
        match row {
            rows::Row::Head(name) => paper.head(y, name, look),
            rows::Row::Line(spans) => {
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

fn foot(panel: &Panel, paper: &mut Paper<'_>, look: Look) {
    let (told, wrong) = &panel.told;
    match &panel.prompt {
        Some(line) => look::prompt(paper, line, look),
        None if told.is_empty() => look::keys(paper, &KEYS, look),
        None => _ = paper.put(0, 0, told, if *wrong { look.wrong() } else { look.text() }),
    }
}
