//! Converts a text drawing of `emu draw` to an SVG picture: wires and rails become lines, everything else
//! stays text.

use std::fmt::Write as _;

use diag::escape_markup;

/// Width and height of a character in pixels.
const CELL: (usize, usize) = (9, 18);

/// Free space around the drawing in pixels.
const MARGIN: usize = 12;

/// Colours for light and dark pages.
const STYLE: &str = "\
text { font: 15px ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace; fill: #1f2328; white-space: pre; }
.paper { fill: #ffffff; }
.number { fill: #6e7781; }
.rail { stroke: #0b57a4; stroke-width: 2; }
.wire { stroke: #0a6640; stroke-width: 2; }
@media (prefers-color-scheme: dark) {
text { fill: #e6e8eb; }
.paper { fill: #15181c; }
.number { fill: #9aa4af; }
.rail { stroke: #7ab8ff; }
.wire { stroke: #5fd39a; }
}
";

/// Returns the picture of a drawing with at least one line. The title is for readers who cannot see the
/// picture.
pub fn svg(drawing: &str, title: &str) -> String {
    let lines: Vec<Vec<char>> = drawing.lines().map(|line| line.chars().collect()).collect();
    let columns = lines.iter().map(Vec::len).max().unwrap_or(0);
    let (width, height) = (columns * CELL.0 + 2 * MARGIN, lines.len() * CELL.1 + 2 * MARGIN);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n\
         <title>{}</title>\n<style>{STYLE}</style>\n<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n",
        escape_markup(title)
    );
    for (row, line) in lines.iter().enumerate() {
        draw_line(&mut out, line, MARGIN + row * CELL.1);
    }
    out.push_str("</svg>\n");
    out
}

/// Draws one line of characters whose upper edge is at `top` pixels.
fn draw_line(out: &mut String, line: &[char], top: usize) {
    let x = |column: usize| MARGIN + column * CELL.0;
    let middle = top + CELL.1 / 2;
    let mut column = 0;
    while column < line.len() {
        let same = line[column..].iter().take_while(|c| **c == line[column]).count();
        match line[column] {
            ' ' => column += same,
            '-' => {
                _ = writeln!(out, "<path class=\"wire\" d=\"M{} {middle}H{}\"/>", x(column), x(column + same));
                column += same;
            }
            '|' => {
                let class = if same > 1 { "rail" } else { "wire" };
                for n in column..column + same {
                    _ = writeln!(out, "<path class=\"{class}\" d=\"M{} {top}v{}\"/>", x(n) + CELL.0 / 2, CELL.1);
                }
                column += same;
            }
            _ => {
                let word: String = line[column..].iter().take_while(|c| !" -|".contains(**c)).collect();
                let number = column < 6 && word.chars().all(|c| c.is_ascii_digit());
                let (class, length) = (if number { " class=\"number\"" } else { "" }, word.chars().count());
                _ = writeln!(
                    out,
                    "<text{class} x=\"{}\" y=\"{}\" textLength=\"{}\">{}</text>",
                    x(column),
                    top + 13,
                    length * CELL.0,
                    escape_markup(&word)
                );
                column += length;
            }
        }
    }
}
