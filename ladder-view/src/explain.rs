//! Explains which elements gave a symbol its value.

use std::sync::Arc;

use emu_debug::debug::{DynMachine, ProgramFollower};
use ladder::{
    ChipPart, Element, ElementId, LadderProgram, PowerEffect, ProgramElement, SymbolKind, SymbolUse, WriteMoment,
    element_text,
};
use ladder_eval::{ElementPower, Evaluator};

use crate::power_flow::{PowerDecider, deciders};
use crate::scan_follower::{FollowedScan, ScanFollower};
use crate::{LadderView, ScanPosition, ViewError};

/// Maximum depth of causes in an explanation.
const MAX_DEPTH: usize = 6;

/// A scan up to an element (exclusive), or to its end if there is none.
type ScanPrefix = (Arc<FollowedScan>, Option<ElementId>);

impl LadderView {
    /// Explains the value of a symbol: the element that wrote it, and the elements that gave power to that
    /// element or blocked it.
    ///
    /// Causes that changed recently are explained in turn, back through the scans. Each cause is one line,
    /// indented by depth. For rungs that the chip has not reached in this scan, the explanation uses the
    /// previous scan.
    ///
    /// # Errors
    /// There is no such symbol, no scan has run, or the session does not follow the program.
    pub fn explain_value(
        &self,
        follow: &dyn ProgramFollower,
        machine: &dyn DynMachine,
        name: &str,
    ) -> Result<Vec<String>, ViewError> {
        let follower = ScanFollower::from_dyn(follow).ok_or(ViewError::NotFollowed)?;
        let symbol = self.facts.power_up.index(name).ok_or_else(|| self.unknown_symbol(name))?;
        let moment = self.scan_position(Some(follow), machine);
        let since = if follower.scans_before > 0 { "the reset" } else { "power-up" };
        let Some(newest) = moment.current_scan.as_ref().or(moment.last_scan.as_ref()) else {
            return Err(ViewError::NoScan { was_reset: follower.scans_before > 0 });
        };
        let value = self.facts.chip_value(symbol, machine);
        let shown = self.facts.shown_value(symbol, value);
        let prefix: ScanPrefix = (newest.clone(), self.reached_element(&moment, symbol, value));
        let explainer = ChangeExplainer { view: self, follower };
        let fits = prefix.0.value(symbol, prefix.1) == value;
        if self.is_input(symbol) {
            let scan = match explainer.last_change(symbol, &prefix) {
                _ if !fits => Some(follower.scan().unwrap_or(0)),
                change => change.map(|change| change.0.number),
            };
            let scan = scan.map_or(since.to_owned(), |scan| format!("scan {scan}"));
            return Ok(vec![format!("{name} is {shown} since {scan}: its pin")]);
        }
        if !fits {
            return Ok(vec![format!("{name} is {shown}: it was set from outside; no element has written that")]);
        }
        let mut lines = Vec::new();
        // The element that wrote the symbol last ran in this scan or in the previous one.
        let before =
            moment.last_scan.as_ref().filter(|past| past.number < prefix.0.number).map(|past| (past.clone(), None));
        let prefixes = [Some(prefix.clone()), before.clone()].into_iter().flatten();
        let found = prefixes
            .filter_map(|reported| Some((self.last_writer(&reported.0, symbol, reported.1)?, reported.0)))
            .next();
        match &found {
            Some((writer, scan)) => {
                let place = self.element_text(*writer);
                let mut line = format!("{name} is {shown}: {place} wrote it in scan {}", scan.number);
                if scan.number < prefix.0.number && prefix.1.is_some_and(|to| *writer >= to) {
                    line.push_str(&format!(", scan {} has not come to it yet", prefix.0.number));
                }
                lines.push(line);
                self.push_power_causes(&deciders(&self.facts.program, scan, *writer), scan, 1, &mut lines);
            }
            None => {
                let far = if prefix.1.is_some() { " so far" } else { "" };
                let number = prefix.0.number;
                lines.push(format!("{name} is {shown}: no element of scan {number} has written it{far}"));
            }
        }
        let written_in = found.map_or(prefix.0.number, |(_, scan)| scan.number);
        match explainer.last_change(symbol, &prefix) {
            Some(change) => {
                if change.0.number == written_in {
                    lines.push(format!("it became that in scan {written_in}"));
                } else {
                    let scan = &change.0;
                    let value = self.facts.shown_value(symbol, scan.value(symbol, change.1));
                    let number = scan.number;
                    let cycle = scan.cycle;
                    lines.push(format!("it became {value} in scan {number}, whose inputs were taken in cycle {cycle}"));
                }
                explainer.push_causes(symbol, &change, written_in, 1, &mut lines);
            }
            None => lines.push(format!("it has been so since {since}")),
        }
        Ok(lines)
    }

    /// Element that the scan has reached: the one after the current element, if the symbol already has the
    /// value from the current one.
    fn reached_element(&self, moment: &ScanPosition, symbol: usize, value: i32) -> Option<ElementId> {
        let (begun, here) = (moment.current_scan.as_ref()?, moment.current_element?);
        // An element without code of its own is executed by the element before it.
        let elements = self.facts.map.elements.iter();
        let own = elements.filter(|element| element.start < element.end).map(|element| (element.rung, element.element));
        let next = own.filter(|own| *own > (here.rung + 1, here.index + 1)).min();
        let next = next.map(|(rung, element)| ElementId { rung: rung - 1, index: element - 1 });
        let is_done = begun.value(symbol, Some(here)) != value && begun.value(symbol, next) == value;
        if is_done { next } else { Some(here) }
    }

    fn is_input(&self, symbol: usize) -> bool {
        self.facts.power_up.symbols().get(symbol).is_some_and(|symbol| symbol.kind == SymbolKind::Input)
    }

    /// Adds the elements that gave power to an element, or blocked it.
    fn push_power_causes(&self, way: &[PowerDecider<'_>], scan: &FollowedScan, depth: usize, lines: &mut Vec<String>) {
        let indent = "  ".repeat(depth);
        if way.is_empty() {
            lines.push(format!("{indent}power came straight from the left rail"));
        }
        for decider in way {
            let how = if decider.passed_power { "gave power" } else { "blocked" };
            lines.push(format!("{indent}{how}: {}{}", self.element_text(decider.id), self.read_values(decider, scan)));
        }
    }

    /// Formats the values that an element reads, such as ` (Xstop 0)`.
    fn read_values(&self, decider: &PowerDecider<'_>, scan: &FollowedScan) -> String {
        // The output of a powered contact reveals the value of its bit at that time.
        if let Element::Contacts { name, negated, .. } = decider.element
            && let Some(ElementPower { before: true, after }) = scan.power(decider.id)
        {
            return format!(" ({name} {})", u8::from(after != *negated));
        }
        let behind = ElementId { index: decider.id.index + 1, ..decider.id };
        let one = |name: &str| {
            let symbol = self.facts.power_up.index(name)?;
            Some(format!("{name} {}", self.facts.shown_value(symbol, scan.value(symbol, Some(behind)))))
        };
        let all: Vec<String> = deciding_symbols(decider.element).iter().filter_map(|name| one(name)).collect();
        if all.is_empty() { String::new() } else { format!(" ({})", all.join(", ")) }
    }

    /// Formats an element, such as `rung 3, element 2: CONTACTS Xstop 1`.
    fn element_text(&self, id: ElementId) -> String {
        let element = self.facts.program.find_element(id);
        element.map_or_else(|| id.to_string(), |at| format!("{id}: {}", element_text(at.element)))
    }

    /// Finds the element that last wrote a symbol in a scan before `to`; set and reset coils count only with
    /// power.
    fn last_writer(&self, scan: &FollowedScan, symbol: usize, to: Option<ElementId>) -> Option<ElementId> {
        let name = &self.facts.power_up.symbols().get(symbol)?.name;
        let wrote = |id: ElementId, element: &Element| {
            let power = scan.power(id).unwrap_or_default();
            element.facts().write_moment(name).is_some_and(|moment| match moment {
                WriteMoment::Always => true,
                WriteMoment::Powered => power.before,
                WriteMoment::Passing => power.after,
            })
        };
        let elements = self.facts.program.elements().take_while(|at| to.is_none_or(|to| at.id < to));
        elements.filter(|at| wrote(at.id, at.element)).map(|at| at.id).last()
    }

    fn unknown_symbol(&self, name: &str) -> ViewError {
        let known = self.facts.power_up.symbols().iter().map(|symbol| symbol.name.clone()).collect();
        ViewError::UnknownSymbol { name: name.to_owned(), known }
    }
}

/// Finds causes of changes in the scans so far.
struct ChangeExplainer<'a> {
    view: &'a LadderView,
    follower: &'a ScanFollower,
}

impl ChangeExplainer<'_> {
    /// Last change of a symbol in a scan up to a position, or in an earlier scan.
    fn last_change(&self, symbol: usize, course: &ScanPrefix) -> Option<ScanPrefix> {
        if course.0.has_changed(symbol, course.1) {
            return Some(course.clone());
        }
        let changes = self.follower.changes.get(symbol)?.iter().rev();
        changes.into_iter().find(|change| change.number < course.0.number).map(|change| (change.clone(), None))
    }

    /// Adds the cause of a symbol's change in a scan, and the causes of that; `written_in` is the scan whose
    /// writer was already named.
    fn push_causes(&self, symbol: usize, course: &ScanPrefix, written_in: u64, depth: usize, lines: &mut Vec<String>) {
        let (view, scan, indent) = (self.view, &course.0, "  ".repeat(depth));
        let Some(writer) = view.last_writer(scan, symbol, course.1) else {
            lines.push(format!("{indent}no element wrote it in scan {}: it was set from outside", scan.number));
            return;
        };
        let deciders_on_path = deciders(&view.facts.program, scan, writer);
        if depth > 1 || written_in != scan.number {
            lines.push(format!("{indent}{} wrote it", view.element_text(writer)));
            view.push_power_causes(&deciders_on_path, scan, depth + 1, lines);
        }
        if depth >= MAX_DEPTH {
            return;
        }
        // Among the deciding symbols, follow those that changed recently: in this scan or in the previous
        // one.
        for decider in deciders_on_path {
            for name in &deciding_symbols(decider.element) {
                let Some(cause) = view.facts.power_up.index(name).filter(|cause| *cause != symbol) else { continue };
                // A symbol that the element itself writes counts with its value after the element.
                let behind = ElementId { index: decider.id.index + 1, ..decider.id };
                let Some(change) = self.last_change(cause, &(scan.clone(), Some(behind))) else { continue };
                let number = change.0.number;
                let value = view.facts.shown_value(cause, change.0.value(cause, change.1));
                if number + 1 < scan.number {
                    continue;
                }
                if view.is_input(cause) {
                    lines.push(format!("{indent}  {name} became {value} before scan {number}: its pin"));
                    continue;
                }
                lines.push(format!("{indent}  {name} became {value} in scan {number}"));
                // The accumulator of a timer or counter in the same rung explains nothing more.
                if view.last_writer(&change.0, cause, change.1).is_none_or(|writer| writer.rung != decider.id.rung) {
                    self.push_causes(cause, &change, written_in, depth + 2, lines);
                }
            }
        }
    }
}

/// Returns the elements that write symbols, with the symbols, in text order.
pub(crate) fn symbol_writes(program: &LadderProgram, start: &Evaluator) -> Vec<(ElementId, u32)> {
    let mut all = Vec::new();
    for ProgramElement { id, element, .. } in program.elements() {
        let facts = element.facts();
        let symbols = (0..).zip(start.symbols()).filter(|(_, symbol)| facts.write_moment(&symbol.name).is_some());
        all.extend(symbols.map(|(symbol, _)| (id, symbol)));
    }
    all
}

/// Returns the symbols that only elements of these parts of the chip write, such as those of a received byte.
pub(crate) fn received_symbols(
    program: &LadderProgram,
    start: &Evaluator,
    writes: &[(ElementId, u32)],
    parts: &[ChipPart],
) -> Vec<usize> {
    let is_one = |part: ChipPart| parts.contains(&part);
    let receives = program.elements().filter(|at| at.element.facts().part.is_some_and(is_one));
    let names =
        receives.flat_map(|at| at.element.facts().written().filter_map(|name| start.index(name)).collect::<Vec<_>>());
    names.filter(|symbol| writes.iter().filter(|write| write.1 as usize == *symbol).count() == 1).collect()
}

/// Symbols whose values decide the output of an element.
fn deciding_symbols(element: &Element) -> Vec<String> {
    let facts = element.facts();
    let decides = match facts.power {
        PowerEffect::Narrows => true,
        // The element's own count decides, not the value that it is compared with.
        PowerEffect::Decides => matches!(element, Element::Instruction(_)),
        PowerEffect::NoWire | PowerEffect::Wire | PowerEffect::Acts => return Vec::new(),
    };
    // The inputs of an encoder decide too.
    let counts = |symbol: &SymbolUse<'_>| decides || symbol.write.is_some() || symbol.kind.is_bit();
    let symbols = facts.symbols.into_iter().filter(|symbol| symbol.is_read && counts(symbol));
    symbols.map(|symbol| symbol.name.into_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_register_writes_its_own_stages_but_the_first() {
        let rungs = ["SHIFT_REGISTER reg 3", "MOVE reg3 1", "MOVE reg01 1", "MOVE reg1x 1"];
        let rungs: String = rungs.iter().map(|rung| format!("RUNG\n  {rung}\nEND\n")).collect();
        let text = format!("LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nIO LIST\nEND\nPROGRAM\n{rungs}");
        let program =
            ladder::parse_bytes("f.ld", text.as_bytes(), ladder::ParseOptions::default()).expect("a program").program;
        let start = Evaluator::new(&program).expect("an evaluator");
        let written: Vec<(u32, &str)> = symbol_writes(&program, &start)
            .into_iter()
            .map(|(id, symbol)| (id.rung, start.symbols()[symbol as usize].name.as_str()))
            .collect();
        assert_eq!(written, [(0, "reg1"), (0, "reg2"), (1, "reg3"), (2, "reg01"), (3, "reg1x")]);
    }
}
