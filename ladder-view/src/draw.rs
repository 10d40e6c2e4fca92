//! A rung with power in its wires.

use emu_debug::debug::{DynMachine, ProgramFollower};
use ladder::{DrawnElement, draw_rung};

use crate::{LadderView, ScanPosition};

/// Around what is powered, and around what is next.
const POWERED_STYLE: &str = "\x1b[32m";
const NEXT_STYLE: &str = "\x1b[7m";
const RESET_STYLE: &str = "\x1b[0m";

impl LadderView {
    /// The rung that the chip is in, as text: wires with power are drawn `=`, the element that is next stands between `>` and `<`. Of
    /// that rung only what has run in this scan has power. Nothing between the rungs of two scans. `color`: terminal sequences too.
    #[must_use]
    pub fn draw(&self, follow: Option<&dyn ProgramFollower>, target: &dyn DynMachine, color: bool) -> Vec<String> {
        let moment = self.scan_position(follow, target);
        moment.current_element.map_or(Vec::new(), |here| self.draw_at(here.rung, &moment, color))
    }

    /// A rung, from 1, as [`LadderView::draw`] shows it: one that was not reached yet in this scan as the scan before left it.
    #[must_use]
    pub fn draw_rung(
        &self,
        rung: u32,
        follow: Option<&dyn ProgramFollower>,
        target: &dyn DynMachine,
        color: bool,
    ) -> Vec<String> {
        rung.checked_sub(1).map_or(Vec::new(), |index| self.draw_at(index, &self.scan_position(follow, target), color))
    }

    /// A rung, from 0.
    fn draw_at(&self, index: u32, moment: &ScanPosition, color: bool) -> Vec<String> {
        let next = moment.current_element;
        let drawing = draw_rung(&self.facts.program, index as usize);
        let mut lines: Vec<Vec<char>> = drawing.lines.iter().map(|line| line.chars().collect()).collect();
        let power = |cell: &DrawnElement| moment.power(cell.id);
        for cell in &drawing.elements {
            let Some((before, behind)) = power(cell) else { continue };
            let Some(line) = lines.get_mut(cell.line) else { continue };
            if behind {
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
                    (Some(cell), _) if power(cell).is_some_and(|power| power.1) => POWERED_STYLE,
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

/// Power in a wire, up to where it ends or meets another.
fn power_wire<'a>(line: impl Iterator<Item = &'a mut char>) {
    line.take_while(|sign| matches!(sign, '-' | '=')).for_each(|sign| *sign = '=');
}
