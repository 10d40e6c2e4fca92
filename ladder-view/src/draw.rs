//! Draws a rung with the power in its wires.

use emu_debug::debug::{DynMachine, ProgramFollower};
use ladder::{DrawnElement, draw_rung};
use ladder_eval::ElementPower;

use crate::{LadderView, ScanPosition};

/// Terminal sequence before powered wires and elements; below, before the next element.
const POWERED_STYLE: &str = "\x1b[32m";
const NEXT_STYLE: &str = "\x1b[7m";
const RESET_STYLE: &str = "\x1b[0m";

impl LadderView {
    /// Draws the rung that the chip is executing: powered wires are drawn as `=`, the next element is between
    /// `>` and `<`.
    ///
    /// In that rung only elements that have run in this scan have power. The result is empty between the
    /// rungs of two scans. `color` adds terminal sequences.
    #[must_use]
    pub fn draw(&self, follow: Option<&dyn ProgramFollower>, machine: &dyn DynMachine, color: bool) -> Vec<String> {
        let moment = self.scan_position(follow, machine);
        moment.current_element.map_or(Vec::new(), |here| self.draw_at(here.rung, &moment, color))
    }

    /// Draws a rung (from 1) as [`LadderView::draw`] does; a rung not yet reached in this scan shows the
    /// previous scan.
    #[must_use]
    pub fn draw_rung(
        &self,
        rung: u32,
        follow: Option<&dyn ProgramFollower>,
        machine: &dyn DynMachine,
        color: bool,
    ) -> Vec<String> {
        rung.checked_sub(1).map_or(Vec::new(), |index| self.draw_at(index, &self.scan_position(follow, machine), color))
    }

    /// Draws a rung, by its index from 0.
    fn draw_at(&self, index: u32, moment: &ScanPosition, color: bool) -> Vec<String> {
        let next = moment.current_element;
        let drawing = draw_rung(&self.facts.program, index as usize);
        let mut lines: Vec<Vec<char>> = drawing.lines.iter().map(|line| line.chars().collect()).collect();
        let power = |cell: &DrawnElement| moment.power(cell.id);
        for cell in &drawing.elements {
            let Some(ElementPower { before, after }) = power(cell) else { continue };
            let Some(line) = lines.get_mut(cell.line) else { continue };
            if after {
                power_wire(line.iter_mut().skip(cell.column + cell.width));
            }
            if before {
                let start = cell.column.min(line.len());
                power_wire(line.iter_mut().take(start).rev());
            }
        }
        for cell in drawing.elements.iter().filter(|cell| Some(cell.id) == next) {
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
            let cells = drawing.elements.iter().filter(|cell| cell.line == n);
            let sign = |at: usize| {
                let cell = cells.clone().find(|cell| (cell.column..cell.column + cell.width).contains(&at));
                match (cell, line.get(at)) {
                    (Some(cell), _) if Some(cell.id) == next => NEXT_STYLE,
                    (Some(cell), _) if power(cell).is_some_and(|power| power.after) => POWERED_STYLE,
                    (None, Some('=')) => POWERED_STYLE,
                    _ => "",
                }
            };
            let mut out = String::new();
            let mut last = "";
            for (at, character) in line.iter().enumerate() {
                let now = sign(at);
                if now != last {
                    out.push_str(if last.is_empty() { "" } else { RESET_STYLE });
                    out.push_str(now);
                    last = now;
                }
                out.push(*character);
            }
            out.push_str(if last.is_empty() { "" } else { RESET_STYLE });
            out.trim_end().to_owned()
        };
        lines.into_iter().enumerate().map(text).collect()
    }
}

/// Draws power in a wire, up to its end or to another wire.
fn power_wire<'a>(line: impl Iterator<Item = &'a mut char>) {
    line.take_while(|sign| matches!(sign, '-' | '=')).for_each(|sign| *sign = '=');
}
