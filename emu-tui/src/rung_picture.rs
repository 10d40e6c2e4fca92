//! Draws a rung with its power flow, based on the drawing of `emu draw`.
//!
//! Wires that touch each other form a net. A net carries power if the element after it had power at its input
//! or, at the right rail, if the element before it had power at its output. So the picture only needs the
//! power at the input and output of each element.

use ladder::{DrawnElement, Element, ElementId, LadderProgram, RungNode};
use ladder_eval::ElementPower;

/// The kind of a character in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GlyphInk {
    /// A wire or a part of an element: with or without power.
    Power(bool),
    /// The name of a bit with its value, or other text above an element.
    Name(bool),
    /// A comment of the program.
    Comment,
    /// The number of the rung.
    Number,
}

/// A character of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PictureGlyph {
    /// The character.
    pub glyph: char,
    /// The kind of the character.
    pub ink: GlyphInk,
    /// True if the character belongs to the marked element.
    pub marked: bool,
}

/// The state of a program in one scan.
pub trait PowerFlowSource {
    /// Power at the input and at the output of an element; `None` if it was not executed.
    fn power_flow(&self, element: ElementId) -> Option<ElementPower>;
    /// The value of a bit; `None` if the symbol is not a bit.
    fn bit_value(&self, name: &str) -> Option<bool>;
}

/// Columns before and after the content in a line of the drawing.
const MARGIN: (usize, usize) = (8, 2);

/// One rung as lines of characters. Wires are shortened if the drawing of `emu draw` is wider than `width`
/// columns, but not below the width of the elements. The result is empty if there is no such rung.
#[must_use]
pub fn rung_picture(
    program: &LadderProgram,
    index: usize,
    width: usize,
    seen: &dyn PowerFlowSource,
    mark: Option<ElementId>,
) -> Vec<Vec<PictureGlyph>> {
    let Some(rung) = program.rungs.get(index) else { return Vec::new() };
    let mut elements = Vec::new();
    collect_elements(&rung.series, &mut elements);
    let digits = program.rungs.len().to_string().len();
    let mut lines = Vec::new();
    for element in &elements {
        if let Element::Comment(text) = element {
            push_comment(text, width.saturating_sub(digits + 2).max(20), digits, &mut lines);
        }
    }
    let comments = lines.len();
    let has_wire = elements.iter().any(|e| !matches!(e, Element::Comment(_)));
    if has_wire {
        let drawing = ladder::draw_rung(program, index);
        let is_wire =
            |c: &&DrawnElement| !matches!(elements.get(c.id.index as usize), Some(Element::Comment(_)) | None);
        let cells: Vec<DrawnElement> = drawing.elements.iter().filter(is_wire).copied().collect();
        // The names of the elements are above the first wire; a rung that is too large to draw is one line of
        // text.
        let first = cells.iter().map(|c| c.line.saturating_sub(1)).min();
        let first = first.unwrap_or(drawing.lines.len().saturating_sub(1));
        let mut grid = RungGrid::new(&drawing.lines, first, &cells);
        grid.power_nets(&cells, seen);
        for cell in &cells {
            grid.draw_element(cell, elements.get(cell.id.index as usize).copied(), seen, mark);
        }
        lines.extend(grid.lines(width, digits));
    }
    // The rung number is at the first wire, or at the first line if there is no wire.
    let number = format!("{:>digits$}", index + 1);
    let at = if has_wire && lines.len() > comments + 1 { comments + 1 } else { 0 };
    if let Some(line) = lines.get_mut(at) {
        line.iter_mut().zip(number.chars()).for_each(|(slot, c)| slot.glyph = c);
    }
    lines
}

/// Collects the elements of a series in text order.
fn collect_elements<'a>(series: &'a [RungNode], out: &mut Vec<&'a Element>) {
    for node in series {
        match node {
            RungNode::Leaf(element, _) => out.push(element),
            RungNode::Parallel(branches, _) => branches.iter().for_each(|b| collect_elements(b, out)),
        }
    }
}

/// Adds a comment, wrapped between words.
fn push_comment(text: &str, width: usize, digits: usize, lines: &mut Vec<Vec<PictureGlyph>>) {
    let mut push = |text: &str| {
        let mut line = margin(digits);
        line.extend(text.chars().map(|sign| PictureGlyph { glyph: sign, ink: GlyphInk::Comment, marked: false }));
        lines.push(line);
    };
    // Line breaks of the author are ignored, because they were made for another width.
    let mut line = String::new();
    for word in text.split(|c: char| c.is_whitespace() || c.is_control()).filter(|w| !w.is_empty()) {
        let mut word: Vec<char> = word.chars().collect();
        if !line.is_empty() && line.chars().count() + 1 + word.len() > width {
            push(&line);
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        while word.len() > width {
            let rest = word.split_off(width);
            push(&word.iter().collect::<String>());
            word = rest;
        }
        line.extend(word);
    }
    push(&line);
}

/// The columns before the left rail.
fn margin(digits: usize) -> Vec<PictureGlyph> {
    vec![PictureGlyph { glyph: ' ', ink: GlyphInk::Number, marked: false }; digits + 1]
}

/// The content of a rung between its rails.
struct RungGrid {
    rows: Vec<Vec<char>>,
    glyphs: Vec<Vec<PictureGlyph>>,
    /// True for characters that are part of a wire.
    wires: Vec<Vec<bool>>,
    offset: usize,
}

impl RungGrid {
    fn new(lines: &[String], first: usize, cells: &[DrawnElement]) -> RungGrid {
        let content = |line: &String| -> Vec<char> {
            let all: Vec<char> = line.chars().collect();
            all.get(MARGIN.0..all.len().saturating_sub(MARGIN.1)).unwrap_or(&[]).to_vec()
        };
        let rows: Vec<Vec<char>> = lines.iter().skip(first).map(content).collect();
        let mut wires: Vec<Vec<bool>> =
            rows.iter().map(|row| row.iter().map(|c| matches!(c, '-' | '|' | '+')).collect()).collect();
        for cell in cells {
            let from = cell.column.saturating_sub(MARGIN.0);
            if let Some(row) = wires.get_mut(cell.line.saturating_sub(first)) {
                row.iter_mut().skip(from).take(cell.width).for_each(|wire| *wire = false);
            }
        }
        let sign = |&sign: &char| PictureGlyph { glyph: sign, ink: GlyphInk::Name(false), marked: false };
        let signs = rows.iter().map(|row| row.iter().map(sign).collect()).collect();
        RungGrid { rows, glyphs: signs, wires, offset: first }
    }

    /// Row, first column, and column after an element.
    fn place(&self, cell: &DrawnElement) -> (usize, usize, usize) {
        let from = cell.column.saturating_sub(MARGIN.0);
        (cell.line.saturating_sub(self.offset), from, from + cell.width)
    }

    fn wire(&self, row: usize, column: usize) -> Option<char> {
        self.wires.get(row)?.get(column)?.then(|| self.rows.get(row)?.get(column).copied())?
    }

    /// The neighbours that a piece of wire touches: left, right, up, down.
    fn wire_neighbours(&self, row: usize, column: usize) -> [Option<(usize, usize)>; 4] {
        let across = |c: char| matches!(c, '-' | '+');
        let along = |c: char| matches!(c, '|' | '+');
        let here = self.wire(row, column).unwrap_or(' ');
        let at = |row: Option<usize>, column: Option<usize>, fits: fn(char) -> bool| {
            let (row, column) = (row?, column?);
            (fits(here) && fits(self.wire(row, column)?)).then_some((row, column))
        };
        [
            at(Some(row), column.checked_sub(1), across),
            at(Some(row), Some(column + 1), across),
            at(row.checked_sub(1), Some(column), along),
            at(Some(row + 1), Some(column), along),
        ]
    }

    /// Finds the nets that touch elements, and sets their power. Dashes in names do not touch an element.
    fn power_nets(&mut self, cells: &[DrawnElement], seen: &dyn PowerFlowSource) {
        let mut net_of: Vec<Vec<usize>> = self.rows.iter().map(|row| vec![0; row.len()]).collect();
        // Net 0 means no net. Per net: power at the input of elements after it, power at the output of
        // elements before it.
        let mut nets: Vec<(Option<bool>, bool)> = vec![(None, false)];
        for cell in cells {
            let (row, from, to) = self.place(cell);
            let power = seen.power_flow(cell.id).unwrap_or_default();
            for (column, behind) in [(from.checked_sub(1), false), (Some(to), true)] {
                let Some(column) = column.filter(|c| self.wire(row, *c).is_some()) else { continue };
                let net = match net_of.get(row).and_then(|r| r.get(column)) {
                    Some(0) => {
                        nets.push((None, false));
                        self.flood_net(row, column, nets.len() - 1, &mut net_of);
                        nets.len() - 1
                    }
                    Some(&net) => net,
                    None => continue,
                };
                if let Some(net) = nets.get_mut(net) {
                    if behind {
                        net.1 |= power.after;
                    } else {
                        net.0 = Some(net.0.unwrap_or(false) | power.before);
                    }
                }
            }
        }
        for (row, line) in net_of.iter().enumerate() {
            for (column, &net) in line.iter().enumerate().filter(|(_, net)| **net > 0) {
                let power = nets.get(net).is_some_and(|(saw, gave)| saw.unwrap_or(*gave));
                let joints = self.wire_neighbours(row, column).map(|to| to.is_some());
                let sign = wire_glyph(self.wire(row, column).unwrap_or(' '), joints, power);
                if let Some(slot) = self.glyphs.get_mut(row).and_then(|r| r.get_mut(column)) {
                    *slot = PictureGlyph { glyph: sign, ink: GlyphInk::Power(power), marked: false };
                }
            }
        }
    }

    fn flood_net(&self, row: usize, column: usize, net: usize, net_of: &mut [Vec<usize>]) {
        let mut open = vec![(row, column)];
        while let Some((row, column)) = open.pop() {
            let Some(slot) = net_of.get_mut(row).and_then(|r| r.get_mut(column)).filter(|slot| **slot == 0) else {
                continue;
            };
            *slot = net;
            open.extend(self.wire_neighbours(row, column).into_iter().flatten());
        }
    }

    /// Draws an element and colours its name.
    fn draw_element(
        &mut self,
        cell: &DrawnElement,
        element: Option<&Element>,
        seen: &dyn PowerFlowSource,
        mark: Option<ElementId>,
    ) {
        let (row, from, to) = self.place(cell);
        let power = seen.power_flow(cell.id).unwrap_or_default();
        let marked = mark == Some(cell.id);
        let mut put = |column: usize, sign: Option<char>| {
            if let Some(slot) = self.glyphs.get_mut(row).and_then(|r| r.get_mut(column)) {
                *slot = PictureGlyph { glyph: sign.unwrap_or(slot.glyph), ink: GlyphInk::Power(power.after), marked };
            }
        };
        (from..to).for_each(|column| put(column, None));
        let bit = match element {
            Some(Element::Contacts { name, negated, .. }) => {
                let bit = seen.bit_value(name).unwrap_or(false);
                // The value at the time when the rung was executed counts, if it is known; a marked element
                // was not executed yet.
                let closed = if power.before && !marked { power.after } else { bit != *negated };
                put(
                    from,
                    Some(if closed {
                        if power.before { '┫' } else { '┨' }
                    } else if power.before {
                        '┥'
                    } else {
                        '┤'
                    }),
                );
                put(to.saturating_sub(1), Some(if closed { if power.after { '┣' } else { '┠' } } else { '├' }));
                bit
            }
            Some(Element::Coil { name, negated, set, reset, .. }) => {
                let bit = seen.bit_value(name).unwrap_or(false);
                if !(*negated || *set || *reset) {
                    put(from + 1, Some(if bit { '●' } else { ' ' }));
                }
                bit
            }
            _ => power.after,
        };
        // The name is above the element and may extend over the wires on both sides.
        let Some(above) = row.checked_sub(1).and_then(|row| self.glyphs.get_mut(row)) else { return };
        let is_text = |s: &PictureGlyph| s.glyph != ' ' && !matches!(s.ink, GlyphInk::Power(_));
        let mut span = (from, to);
        while span.0 > 0 && above.get(span.0 - 1).is_some_and(is_text) {
            span.0 -= 1;
        }
        while above.get(span.1).is_some_and(is_text) {
            span.1 += 1;
        }
        for slot in above.iter_mut().take(span.1).skip(span.0).filter(|s| is_text(s)) {
            (slot.ink, slot.marked) = (GlyphInk::Name(bit), marked);
        }
    }

    /// The lines with rails. If `width` is too small, columns that only lengthen wires are left out.
    fn lines(&self, width: usize, digits: usize) -> Vec<Vec<PictureGlyph>> {
        let keep = self.columns_kept(width.saturating_sub(digits + 3));
        let rows = self.glyphs.iter().zip(&self.wires).enumerate();
        rows.map(|(number, (signs, wires))| {
            let joins = |column: Option<usize>| {
                let column = column.filter(|c| number % 2 == 1 || wires.get(*c) == Some(&true))?;
                let touches =
                    matches!(self.rows.get(number)?.get(column)?, '-' | '+' | ']' | ')' | '}' | '[' | '(' | '{');
                match signs.get(column)?.ink {
                    GlyphInk::Power(power) if touches => Some(power),
                    _ => None,
                }
            };
            let rail = |sign, power| PictureGlyph { glyph: sign, ink: GlyphInk::Power(power), marked: false };
            let mut line = margin(digits);
            line.push(match joins(Some(0)) {
                Some(true) => rail('┣', true),
                Some(false) => rail('┠', true),
                None => rail('┃', true),
            });
            line.extend(signs.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(sign, _)| *sign));
            line.push(match joins(signs.len().checked_sub(1)) {
                Some(true) => rail('┥', true),
                Some(false) => rail('┤', false),
                None => rail('│', false),
            });
            line
        })
        .collect()
    }

    /// Selects the columns to keep, at most `width` if possible. Of a sequence of equal columns with only
    /// wires and spaces, all but one can be removed; the longest sequences are shortened first.
    fn columns_kept(&self, width: usize) -> Vec<bool> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let plain = |column: usize| {
            self.rows.iter().zip(&self.wires).all(|(row, wires)| match row.get(column) {
                Some(' ') | None => true,
                Some(_) => wires.get(column) == Some(&true),
            })
        };
        let same = |a: usize, b: usize| self.rows.iter().all(|row| row.get(a) == row.get(b));
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for column in 0..columns {
            match runs.last_mut() {
                Some((from, count)) if plain(column) && plain(*from) && same(*from, column) => *count += 1,
                _ => runs.push((column, 1)),
            }
        }
        let mut surplus = columns.saturating_sub(width);
        let mut longest = runs.iter().map(|(_, count)| *count).max().unwrap_or(1);
        let mut left: Vec<usize> = runs.iter().map(|(_, count)| *count).collect();
        while surplus > 0 && longest > 1 {
            for count in left.iter_mut().filter(|count| **count == longest).take(surplus) {
                *count -= 1;
                surplus -= 1;
            }
            longest = left.iter().copied().max().unwrap_or(1);
        }
        let mut keep = vec![false; columns];
        for ((from, _), count) in runs.iter().zip(left) {
            keep.iter_mut().skip(*from).take(count).for_each(|slot| *slot = true);
        }
        keep
    }
}

/// The character of a piece of wire with connections to the left, right, up and down.
fn wire_glyph(wire: char, [left, right, up, down]: [bool; 4], power: bool) -> char {
    let signs: [char; 2] = match (wire, left, right, up, down) {
        ('|', ..) => ['│', '┃'],
        ('+', true, true, true, true) => ['┼', '╋'],
        ('+', true, true, true, false) => ['┴', '┻'],
        ('+', true, true, false, true) => ['┬', '┳'],
        ('+', true, false, true, true) => ['┤', '┫'],
        ('+', false, true, true, true) => ['├', '┣'],
        ('+', true, false, true, false) => ['┘', '┛'],
        ('+', false, true, true, false) => ['└', '┗'],
        ('+', true, false, false, true) => ['┐', '┓'],
        ('+', false, true, false, true) => ['┌', '┏'],
        ('+', false, false, ..) => ['│', '┃'],
        _ => ['─', '━'],
    };
    signs[usize::from(power)]
}
