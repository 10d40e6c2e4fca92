//! Draws rungs as text in the layout of LDmicro's listing: names above the wire, symbols in it, coils at the
//! right rail.

use crate::element_symbol::{element_symbol, printable};
use crate::model::{Element, ElementId, LadderDialect, LadderProgram, RungNode};

/// Position of an element in the lines of its drawn rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DrawnElement {
    /// Element that is drawn here.
    pub id: ElementId,
    /// Index from 0 of the line with its symbol; the line above it holds the name. For a comment, its first
    /// line.
    pub line: usize,
    /// Column of the symbol's first character, from 0, in characters.
    pub column: usize,
    /// Width of the symbol in characters.
    pub width: usize,
}

/// A rung drawn as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drawing {
    /// Lines of equal width, between the rails, with the rung's number at the first wire.
    pub lines: Vec<String>,
    /// Positions of all elements, in text order, so that callers can mark power flow.
    pub elements: Vec<DrawnElement>,
}

/// Minimum width between the rails, in characters.
const MIN_WIDTH: usize = 60;
/// A rung wider than this, in characters, does not widen the other rungs.
const MAX_COMMON_WIDTH: usize = 2_000;
/// A rung whose drawing needs more characters than this is not drawn.
const MAX_AREA: usize = 8_000_000;
/// Minimum width of an element with its wires, in characters.
const MIN_ELEMENT_WIDTH: usize = 11;

/// Draws the whole program: its rungs with empty lines between them, then LDmicro's END rung. Ends with a
/// line break. The networks of Instruction List are listed in columns.
#[must_use]
pub fn draw(program: &LadderProgram) -> String {
    if program.dialect == LadderDialect::Iec {
        return draw_networks(program);
    }
    let width = common_width(program);
    let mut out = String::new();
    for index in 0..program.rungs.len() {
        for line in draw_rung_lines(program, index, width).lines {
            out.push_str(line.trim_end());
            out.push('\n');
        }
        out.push_str(&between_rails("", "", ' ', width));
        out.push('\n');
    }
    let end = format!("------[END]{}", "-".repeat(width.saturating_sub(11)));
    out.push_str(&between_rails("", &end, '-', width));
    out.push('\n');
    out
}

/// Lists the networks of a program in Instruction List, with empty lines between them.
fn draw_networks(program: &LadderProgram) -> String {
    let mut out = String::new();
    for (index, drawing) in crate::il::listings(program).enumerate() {
        if index > 0 {
            out.push('\n');
        }
        for line in drawing.lines {
            out.push_str(line.trim_end());
            out.push('\n');
        }
    }
    out
}

/// Draws one rung (index from 0) as [`draw`] does, with the positions of its elements.
///
/// The drawing is empty if the index is beyond the last rung.
#[must_use]
pub fn draw_rung(program: &LadderProgram, rung_index: usize) -> Drawing {
    if program.dialect == LadderDialect::Iec {
        return crate::il::listing(program, rung_index);
    }
    draw_rung_lines(program, rung_index, common_width(program))
}

fn common_width(program: &LadderProgram) -> usize {
    let widths = program.rungs.iter().map(|r| series_width(&r.series)).filter(|w| *w <= MAX_COMMON_WIDTH);
    widths.max().unwrap_or(0).max(MIN_WIDTH)
}

/// A line between the rails, with `number` before the left rail.
fn between_rails(number: &str, content: &str, fill: char, width: usize) -> String {
    let missing = width.saturating_sub(content.chars().count());
    format!("{number:>5} ||{content}{}||", String::from(fill).repeat(missing))
}

/// Number of columns before the content of a line.
const LEFT_MARGIN: usize = 8;

fn draw_rung_lines(program: &LadderProgram, index: usize, common: usize) -> Drawing {
    let mut drawing = Drawing { lines: Vec::new(), elements: Vec::new() };
    let Some(rung) = program.rungs.get(index) else { return drawing };
    let number = (index + 1).to_string();
    let width = series_width(&rung.series).max(common);
    let mut next = ElementId { rung: u32::try_from(index).unwrap_or(u32::MAX), index: 0 };
    draw_comments(&rung.series, &mut next, width, &mut drawing);
    if !has_wire(&rung.series) {
        if let Some(first) = drawing.lines.first_mut() {
            *first = first.replacen("     ", &format!("{number:>5}"), 1);
        }
        return drawing;
    }
    let height = series_height(&rung.series);
    if width.saturating_mul(height) > MAX_AREA {
        let text = format!(" (too large to draw: {width} columns, {height} lines)");
        drawing.lines.push(between_rails(&number, &text, ' ', common.max(text.chars().count())));
        return drawing;
    }
    let mut canvas = Canvas { rows: vec![vec![' '; width]; height], cells: Vec::new() };
    next.index = 0;
    canvas.series(&rung.series, DrawArea { row: 0, column: 0, width, at_left: true, at_right: true }, &mut next);
    let offset = drawing.lines.len();
    drawing.elements.extend(canvas.cells.iter().map(|c| DrawnElement {
        line: c.line + offset,
        column: c.column + LEFT_MARGIN,
        ..*c
    }));
    drawing.elements.sort_by_key(|c| c.id);
    for (row, text) in canvas.rows.iter().enumerate() {
        let content: String = text.iter().collect();
        drawing.lines.push(between_rails(if row == 1 { &number } else { "" }, &content, ' ', width));
    }
    drawing
}

/// Draws all comments of a rung as lines of text above its wire.
fn draw_comments(series: &[RungNode], next: &mut ElementId, width: usize, drawing: &mut Drawing) {
    for node in series {
        match node {
            RungNode::Leaf(Element::Comment(text), _) => {
                let wrapped = wrap(text, width.saturating_sub(2));
                let first = wrapped.first().map_or(0, |l| l.chars().count());
                drawing.elements.push(DrawnElement {
                    id: *next,
                    line: drawing.lines.len(),
                    column: LEFT_MARGIN + 1,
                    width: first,
                });
                drawing.lines.extend(wrapped.iter().map(|l| between_rails("", &format!(" {l}"), ' ', width)));
                next.index += 1;
            }
            RungNode::Leaf(..) => next.index += 1,
            RungNode::Parallel(branches, _) => branches.iter().for_each(|b| draw_comments(b, next, width, drawing)),
        }
    }
}

/// Breaks a text into lines of at most `width` characters, between words where possible.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in text.replace("\r\n", "\n").split(['\n', '\r']) {
        let mut line = String::new();
        let mut length = 0;
        for word in printable(paragraph).split(' ') {
            let count = word.chars().count();
            if length > 0 && length + 1 + count > width {
                lines.push(std::mem::take(&mut line));
                length = 0;
            } else if length > 0 {
                line.push(' ');
                length += 1;
            }
            for c in word.chars() {
                if length == width {
                    lines.push(std::mem::take(&mut line));
                    length = 0;
                }
                line.push(c);
                length += 1;
            }
        }
        lines.push(line);
    }
    lines
}

fn is_comment(node: &RungNode) -> bool {
    matches!(node, RungNode::Leaf(Element::Comment(_), _))
}

/// True unless the rung holds only comments.
fn has_wire(series: &[RungNode]) -> bool {
    series.iter().any(|n| !is_comment(n))
}

fn node_width(node: &RungNode) -> usize {
    match node {
        RungNode::Leaf(Element::Comment(_), _) => 0,
        RungNode::Leaf(element, _) => {
            let symbol = element_symbol(element);
            (symbol.above.chars().count().max(symbol.in_wire.chars().count()) + 4).max(MIN_ELEMENT_WIDTH)
        }
        // One column on each side for the junctions.
        RungNode::Parallel(branches, _) => branches.iter().map(|b| series_width(b)).max().unwrap_or(0) + 2,
    }
}

fn series_width(series: &[RungNode]) -> usize {
    series.iter().map(node_width).sum()
}

fn node_height(node: &RungNode) -> usize {
    match node {
        RungNode::Leaf(..) => 2,
        // An empty line separates two branches.
        RungNode::Parallel(branches, _) => {
            (branches.iter().map(|b| series_height(b) + 1).sum::<usize>()).saturating_sub(1).max(2)
        }
    }
}

fn series_height(series: &[RungNode]) -> usize {
    series.iter().map(node_height).max().unwrap_or(2)
}

/// A rectangle of the canvas to draw in: its second row is the wire, and its sides may be the rails.
#[derive(Clone, Copy)]
struct DrawArea {
    row: usize,
    column: usize,
    width: usize,
    at_left: bool,
    at_right: bool,
}

/// The characters of a rung being drawn, and the positions of its elements.
struct Canvas {
    rows: Vec<Vec<char>>,
    cells: Vec<DrawnElement>,
}

impl Canvas {
    fn put_text(&mut self, row: usize, column: usize, text: &str) {
        if let Some(line) = self.rows.get_mut(row) {
            line.iter_mut().skip(column).zip(text.chars()).for_each(|(slot, c)| *slot = c);
        }
    }

    fn series(&mut self, series: &[RungNode], place: DrawArea, next: &mut ElementId) {
        self.put_text(place.row + 1, place.column, &"-".repeat(place.width));
        let spare = place.width.saturating_sub(series_width(series));
        let drawn = series.iter().filter(|n| !is_comment(n)).count();
        let mut column = place.column;
        let mut seen = 0;
        for node in series {
            if is_comment(node) {
                next.index += 1;
                continue;
            }
            seen += 1;
            let (first, last) = (seen == 1, seen == drawn);
            let mut width = node_width(node);
            let mut at_left = place.at_left && first;
            let at_right = place.at_right && last;
            if last && first && matches!(node, RungNode::Parallel(..)) {
                width += spare;
            } else if last && place.at_right {
                // An element that ends at the right rail touches it.
                column += spare;
                at_left &= spare == 0;
            }
            let inner = DrawArea { row: place.row, column, width, at_left, at_right };
            match node {
                RungNode::Leaf(element, _) => {
                    self.draw_element(element, inner, *next);
                    next.index += 1;
                }
                RungNode::Parallel(branches, _) => self.parallel(branches, inner, next),
            }
            column += width;
        }
    }

    fn parallel(&mut self, branches: &[Vec<RungNode>], place: DrawArea, next: &mut ElementId) {
        let (left, right) = (usize::from(!place.at_left), usize::from(!place.at_right));
        let mut row = place.row;
        let mut last_wire = row + 1;
        for branch in branches {
            let width = place.width.saturating_sub(left + right);
            self.series(branch, DrawArea { row, column: place.column + left, width, ..place }, next);
            last_wire = row + 1;
            row += series_height(branch) + 1;
        }
        // Branches that reach a rail are joined by the rail itself.
        let sides = [(left, place.column), (right, (place.column + place.width).saturating_sub(1))];
        for (_, column) in sides.iter().filter(|(joint, _)| *joint == 1) {
            let mut row = place.row;
            for line in place.row + 2..last_wire {
                self.put_text(line, *column, "|");
            }
            for branch in branches {
                self.put_text(row + 1, *column, "+");
                row += series_height(branch) + 1;
            }
        }
    }

    fn draw_element(&mut self, element: &Element, place: DrawArea, id: ElementId) {
        let symbol = element_symbol(element);
        let (above, width) = (symbol.above.chars().count(), symbol.in_wire.chars().count());
        let column = place.column + place.width.saturating_sub(width) / 2;
        self.put_text(place.row, place.column + place.width.saturating_sub(above) / 2, &symbol.above);
        self.put_text(place.row + 1, column, &symbol.in_wire);
        self.cells.push(DrawnElement { id, line: place.row + 1, column, width });
    }
}
