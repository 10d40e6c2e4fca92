//! The panes of the source and of the serial output.

use super::SourceExcerpt;
use crate::ScreenStyle;
use crate::style::PaneArea;

/// Draws the source with the cursor in the middle if there are enough lines on both sides.
pub(super) fn draw_source(source: &SourceExcerpt, marked: bool, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    paper.put_heading(0, &format!("Source {}", source.file), look);
    let height = usize::from(paper.area.height.saturating_sub(1));
    let at = source.lines.iter().position(|line| line.0 == source.around).unwrap_or(0);
    let first = at.saturating_sub(height / 2).min(source.lines.len().saturating_sub(height));
    for (y, (number, text, point)) in (1..paper.area.height).zip(source.lines.iter().skip(first)) {
        let (here, cursor) = (source.current_line == Some(*number), marked && source.around == *number);
        paper.put(0, y, if point.is_some() { "●" } else { " " }, look.wrong());
        paper.put(
            1,
            y,
            if here {
                "▶"
            } else if cursor {
                ">"
            } else {
                " "
            },
            look.live(),
        );
        let x = paper.put(2, y, &format!("{number:>4}"), look.faint());
        paper.put(x + 1, y, text, if here { look.live() } else { look.text() });
        if cursor {
            paper.style_line(y, look.bar());
        }
    }
}

/// Draws the last lines that the serial port has sent.
pub(super) fn draw_serial(lines: &[String], paper: &mut PaneArea<'_>, look: ScreenStyle) {
    paper.put_heading(0, "Serial port, sent", look);
    if lines.is_empty() {
        paper.put(1, 1, "nothing was sent yet", look.faint());
    }
    let height = usize::from(paper.area.height.saturating_sub(1));
    let first = lines.len().saturating_sub(height);
    for (y, line) in (1..paper.area.height).zip(lines.iter().skip(first)) {
        paper.put(1, y, line, look.text());
    }
}
