//! A rung with power in its wires.

use emu_debug::debug::Follow;
use ladder::{Cell, ElementId, draw_rung};

use crate::View;
use crate::follow::{Follower, Scan};

/// Around what is powered, and around what is next.
const GREEN: &str = "\x1b[32m";
const NEXT: &str = "\x1b[7m";
const PLAIN: &str = "\x1b[0m";

impl View {
    /// The rung that the instruction at a program word belongs to, as text: wires with power are drawn `=`, the element of the
    /// instruction stands between `>` and `<`. Of the scan that is under way only what has run so far has power. Nothing where the
    /// word belongs to no rung. `color`: terminal sequences too.
    #[must_use]
    pub fn draw(&self, follow: Option<&dyn Follow>, word: u32, color: bool) -> Vec<String> {
        self.rung_at(word).map_or(Vec::new(), |rung| self.draw_rung(rung, follow, word, color))
    }

    /// A rung, from 1, as [`View::draw`] shows it: of one that was not reached yet in this scan, as the scan before left it.
    #[must_use]
    pub fn draw_rung(&self, rung: u32, follow: Option<&dyn Follow>, word: u32, color: bool) -> Vec<String> {
        let Some(index) = rung.checked_sub(1) else { return Vec::new() };
        let scan = follow.and_then(Follower::of).and_then(|follower| follower.now.clone());
        let here = self.element_at(word);
        let has_run = |id: ElementId| here.is_none_or(|here| id.rung != here.rung || id < here);
        self.draw_with(index, scan.as_deref(), here, &has_run, color)
    }

    /// A rung, from 0, with the power of a scan.
    pub(crate) fn draw_with(
        &self,
        index: u32,
        scan: Option<&Scan>,
        next: Option<ElementId>,
        has_run: &dyn Fn(ElementId) -> bool,
        color: bool,
    ) -> Vec<String> {
        let drawing = draw_rung(&self.facts.program, index as usize);
        let mut lines: Vec<Vec<char>> = drawing.lines.iter().map(|line| line.chars().collect()).collect();
        let power = |cell: &Cell| scan.filter(|_| has_run(cell.id)).and_then(|scan| scan.power(cell.id));
        for cell in &drawing.cells {
            let Some((before, behind)) = power(cell) else { continue };
            let Some(line) = lines.get_mut(cell.line) else { continue };
            if behind {
                wire(line.iter_mut().skip(cell.column + cell.width));
            }
            if before {
                let start = cell.column.min(line.len());
                wire(line.iter_mut().take(start).rev());
            }
        }
        for cell in drawing.cells.iter().filter(|cell| Some(cell.id) == next) {
            let Some(line) = lines.get_mut(cell.line) else { continue };
            for (at, mark) in [(cell.column.checked_sub(1), '>'), (Some(cell.column + cell.width), '<')] {
                if let Some(sign) = at.and_then(|at| line.get_mut(at)).filter(|sign| matches!(sign, '-' | '=' | ' ')) {
                    *sign = mark;
                }
            }
        }
        let text = |(n, line): (usize, Vec<char>)| {
            if !color {
                return line.into_iter().collect::<String>().trim_end().to_owned();
            }
            let cells = drawing.cells.iter().filter(|cell| cell.line == n);
            let sign = |at: usize| {
                let cell = cells.clone().find(|cell| (cell.column..cell.column + cell.width).contains(&at));
                match (cell, line.get(at)) {
                    (Some(cell), _) if Some(cell.id) == next => NEXT,
                    (Some(cell), _) if power(cell).is_some_and(|power| power.1) => GREEN,
                    (None, Some('=')) => GREEN,
                    _ => "",
                }
            };
            let mut out = String::new();
            let mut last = "";
            for (at, character) in line.iter().enumerate() {
                let now = sign(at);
                if now != last {
                    out.push_str(if last.is_empty() { "" } else { PLAIN });
                    out.push_str(now);
                    last = now;
                }
                out.push(*character);
            }
            out.push_str(if last.is_empty() { "" } else { PLAIN });
            out.trim_end().to_owned()
        };
        lines.into_iter().enumerate().map(text).collect()
    }
}

/// Power in a wire, up to where it ends or meets another.
fn wire<'a>(line: impl Iterator<Item = &'a mut char>) {
    line.take_while(|sign| matches!(sign, '-' | '=')).for_each(|sign| *sign = '=');
}
