//! Text styles with and without colours, and drawing into a picture.

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;
use ratatui_core::style::{Color, Modifier, Style};

/// Selects the style of the screen. Colours carry no information of their own: a sign or a weight carries it
/// too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScreenStyle {
    /// Whether colours are used.
    pub color: bool,
}

#[rustfmt::skip]
impl ScreenStyle {
    fn of(self, color: Color, modifier: Modifier) -> Style {
        let plain = Style::new().add_modifier(modifier);
        if self.color { plain.fg(color) } else { plain }
    }
    /// Normal text.
    #[must_use] pub fn text(self) -> Style { Style::new() }
    /// Something that carries power or is true.
    #[must_use] pub fn live(self) -> Style { self.of(Color::Green, Modifier::BOLD) }
    /// Something that carries no power or is false.
    #[must_use] pub fn dead(self) -> Style { self.of(Color::DarkGray, if self.color { Modifier::empty() } else { Modifier::DIM }) }
    /// Secondary text.
    #[must_use] pub fn faint(self) -> Style { self.dead() }
    /// Comments of the program.
    #[must_use] pub fn comment(self) -> Style { self.of(Color::Cyan, Modifier::empty()) }
    /// A lamp that is on.
    #[must_use] pub fn lamp(self) -> Style { self.of(Color::Yellow, Modifier::BOLD) }
    /// A key to press.
    #[must_use] pub fn key(self) -> Style { self.of(Color::Cyan, Modifier::BOLD) }
    /// The heading of a part of the screen.
    #[must_use] pub fn title(self) -> Style { self.of(Color::Blue, Modifier::BOLD) }
    /// The title line or a marked line.
    #[must_use] pub fn bar(self) -> Style { Style::new().add_modifier(Modifier::REVERSED) }
    /// A value that has just changed, or is highlighted.
    #[must_use] pub fn change(self) -> Style { self.of(Color::Yellow, Modifier::BOLD) }
    /// An error.
    #[must_use] pub fn wrong(self) -> Style { self.of(Color::Red, Modifier::BOLD) }
    /// [`ScreenStyle::live`] if `on`, or else [`ScreenStyle::dead`].
    #[must_use] pub fn on(self, on: bool) -> Style { if on { self.live() } else { self.dead() } }
}

/// An area of a picture; drawing is clipped to it.
pub struct PaneArea<'a> {
    picture: &'a mut Buffer,
    /// The area.
    pub area: Rect,
}

impl<'a> PaneArea<'a> {
    /// The part of a picture inside `area`.
    pub fn new(picture: &'a mut Buffer, area: Rect) -> PaneArea<'a> {
        let area = area.intersection(picture.area);
        PaneArea { picture, area }
    }

    /// Writes text from column `x` and row `y` of the area on, and returns the column after it.
    pub fn put(&mut self, x: u16, y: u16, text: &str, style: Style) -> u16 {
        if x >= self.area.width || y >= self.area.height {
            return x;
        }
        let room = usize::from(self.area.width - x);
        let (end, _) = self.picture.set_stringn(self.area.x + x, self.area.y + y, text, room, style);
        end - self.area.x
    }

    /// Writes text that ends before column `end`.
    pub fn put_right(&mut self, end: u16, y: u16, text: &str, style: Style) {
        let width = u16::try_from(text.chars().count()).unwrap_or(u16::MAX);
        if width <= end {
            self.put(end - width, y, text, style);
        }
    }

    /// Writes a heading: a name followed by a horizontal line.
    pub fn put_heading(&mut self, y: u16, name: &str, look: ScreenStyle) {
        let end = self.put(0, y, name, look.title());
        let rule = "─".repeat(usize::from(self.area.width.saturating_sub(end + 1)));
        self.put(end + 1, y, &rule, look.faint());
    }

    /// Sets the style of a whole line.
    pub fn style_line(&mut self, y: u16, style: Style) {
        if y < self.area.height {
            self.picture.set_style(Rect { y: self.area.y + y, height: 1, ..self.area }, style);
        }
    }
}

/// Truncates a text to `width` characters; an ellipsis marks the cut.
#[must_use]
pub fn truncate_text(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    let mut out: String = text.chars().take(width.saturating_sub(1)).collect();
    out.push('…');
    out
}

/// Draws a command line that is being typed.
pub fn draw_prompt(paper: &mut PaneArea<'_>, line: &str, look: ScreenStyle) {
    // Of a long line, the end is shown.
    let room = usize::from(paper.area.width).saturating_sub(2);
    let count = line.chars().count();
    let shown: String = line.chars().skip(count.saturating_sub(room)).collect();
    let end = paper.put(0, 0, ":", look.key());
    let end = paper.put(end, 0, &shown, look.text());
    paper.put(end, 0, "█", look.text());
}

/// A key and its function, as the last line of the screen shows them.
#[derive(Debug, Clone, Copy)]
pub struct KeyLabel {
    /// Name of the key.
    pub key: &'static str,
    /// What it does, in one word.
    pub function: &'static str,
}

/// Returns the label of a key.
#[must_use]
pub const fn key_label(key: &'static str, function: &'static str) -> KeyLabel {
    KeyLabel { key, function }
}

/// Draws keys with their functions, as many as fit.
pub fn draw_keys(paper: &mut PaneArea<'_>, keys: &[KeyLabel], look: ScreenStyle) {
    let mut x = 0;
    for KeyLabel { key, function } in keys {
        let width = u16::try_from(key.len() + function.len() + 3).unwrap_or(u16::MAX);
        if x + width > paper.area.width + 2 {
            break;
        }
        x = paper.put(x, 0, key, look.key());
        x = paper.put(x + 1, 0, function, look.text()) + 2;
    }
}

/// Draws a box with the list of keys on top of everything.
pub fn draw_help(picture: &mut Buffer, area: Rect, text: &str, look: ScreenStyle) {
    let lines: Vec<&str> = text.lines().collect();
    let widest = lines.iter().map(|l| l.chars().count()).max().unwrap_or(0);
    let width = u16::try_from(widest + 4).unwrap_or(u16::MAX).min(area.width);
    let height = u16::try_from(lines.len() + 2).unwrap_or(u16::MAX).min(area.height);
    let place = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 2, width, height };
    let mut paper = PaneArea::new(picture, place);
    let inner = usize::from(width.saturating_sub(2));
    let rule = "─".repeat(inner);
    let mut inside = Vec::new();
    paper.put(0, 0, &format!("┌{rule}┐"), look.title());
    paper.put(2, 0, " Keys ", look.title());
    for y in 1..height.saturating_sub(1) {
        let text = lines.get(usize::from(y) - 1).copied().unwrap_or("");
        paper.put(0, y, &format!("│{:inner$}│", ""), look.title());
        let room = Rect { x: place.x + 2, y: place.y + y, width: width.saturating_sub(4), height: 1 };
        inside.push((room, text));
    }
    paper.put(0, height.saturating_sub(1), &format!("└{rule}┘"), look.title());
    for (room, text) in inside {
        PaneArea::new(picture, room).put(0, 0, text, look.text());
    }
}
