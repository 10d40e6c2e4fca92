//! What made a symbol what it is.

use std::sync::Arc;

use emu_debug::debug::{Follow, Target};
use ladder::{Element, ElementId, Program, SymbolKind, element_text};
use ladder_eval::Evaluator;

use crate::flow::{Decider, deciders};
use crate::follow::{Follower, Scan};
use crate::{Moment, View};

/// How many causes behind causes are told.
const DEEPEST: usize = 6;

/// A scan, up to where it is told of: before that element, or to its end.
type Course = (Arc<Scan>, Option<ElementId>);

impl View {
    /// Why a symbol has its value: the element that wrote it, what gave power to that element or kept it away, and the same for what
    /// changed there, back through the scans. One line each, the deeper the further back. What the chip has not come to yet in this
    /// scan is told of the scan before.
    ///
    /// # Errors
    /// No such symbol, or no scan has run: one sentence.
    pub fn why(&self, follow: &dyn Follow, target: &dyn Target, name: &str) -> Result<Vec<String>, String> {
        let follower = Follower::of(follow).ok_or("nothing follows this program")?;
        let symbol = self.facts.start.index(name).ok_or_else(|| self.unknown(name))?;
        let moment = self.moment(Some(follow), target);
        let since = if follower.scans_before > 0 { "the reset" } else { "power-up" };
        let Some(newest) = moment.begun.as_ref().or(moment.past.as_ref()) else {
            let reset = if follower.scans_before > 0 { " since the reset" } else { "" };
            return Err(format!("no scan has run yet{reset}; `scan` runs one"));
        };
        let place = self.facts.places.get(symbol);
        let value = place.and_then(|place| place.value(target)).unwrap_or(0) as i32;
        let course: Course = (newest.clone(), self.come_to(&moment, symbol, value));
        let story = Story { view: self, follower };
        let fits = course.0.value(symbol, course.1) == value;
        if self.is_input(symbol) {
            let scan = match story.last_change(symbol, &course) {
                _ if !fits => Some(follower.scan().unwrap_or(0)),
                change => change.map(|change| change.0.number),
            };
            let scan = scan.map_or(since.to_owned(), |scan| format!("scan {scan}"));
            return Ok(vec![format!("{name} is {value} since {scan}: its pin")]);
        }
        if !fits {
            return Ok(vec![format!("{name} is {value}: it was set from outside; no element has written that")]);
        }
        let mut lines = Vec::new();
        // The element that wrote it last has done so in this scan, or in the one before.
        let before = moment.past.as_ref().filter(|past| past.number < course.0.number).map(|past| (past.clone(), None));
        let told = [Some(course.clone()), before.clone()].into_iter().flatten();
        let found = told.filter_map(|told| Some((self.writer(&told.0, symbol, told.1)?, told.0))).next();
        match &found {
            Some((writer, scan)) => {
                let place = self.place(*writer);
                let mut line = format!("{name} is {value}: {place} wrote it in scan {}", scan.number);
                if scan.number < course.0.number && course.1.is_some_and(|to| *writer >= to) {
                    line.push_str(&format!(", scan {} has not come to it yet", course.0.number));
                }
                lines.push(line);
                self.told(&deciders(&self.facts.program, scan, *writer), scan, 1, &mut lines);
            }
            None => {
                let far = if course.1.is_some() { " so far" } else { "" };
                let number = course.0.number;
                lines.push(format!("{name} is {value}: no element of scan {number} has written it{far}"));
            }
        }
        let told = found.map_or(course.0.number, |(_, scan)| scan.number);
        match story.last_change(symbol, &course) {
            Some(change) => {
                if change.0.number == told {
                    lines.push(format!("it became that in scan {told}"));
                } else {
                    let (scan, value) = (&change.0, change.0.value(symbol, change.1));
                    let number = scan.number;
                    let cycle = scan.cycle;
                    lines.push(format!("it became {value} in scan {number}, whose inputs were taken in cycle {cycle}"));
                }
                story.because(symbol, &change, told, 1, &mut lines);
            }
            None => lines.push(format!("it has been so since {since}")),
        }
        Ok(lines)
    }

    /// The element that the scan has come to: behind the one that is carried out where a symbol has its value from that already.
    fn come_to(&self, moment: &Moment, symbol: usize, value: i32) -> Option<ElementId> {
        let (begun, here) = (moment.begun.as_ref()?, moment.here?);
        // Elements without code of their own are carried out by the one before them.
        let elements = self.facts.map.elements.iter();
        let own = elements.filter(|element| element.start < element.end).map(|element| (element.rung, element.element));
        let next = own.filter(|own| *own > (here.rung + 1, here.index + 1)).min();
        let next = next.map(|(rung, element)| ElementId { rung: rung - 1, index: element - 1 });
        let is_done = begun.value(symbol, Some(here)) != value && begun.value(symbol, next) == value;
        if is_done { next } else { Some(here) }
    }

    fn is_input(&self, symbol: usize) -> bool {
        self.facts.start.symbols().get(symbol).is_some_and(|symbol| symbol.kind == SymbolKind::Input)
    }

    /// What gave power to an element, or kept it away.
    fn told(&self, way: &[Decider<'_>], scan: &Scan, depth: usize, lines: &mut Vec<String>) {
        let indent = "  ".repeat(depth);
        if way.is_empty() {
            lines.push(format!("{indent}power came straight from the left rail"));
        }
        for decider in way {
            let how = if decider.on { "gave power" } else { "blocked" };
            lines.push(format!("{indent}{how}: {}{}", self.place(decider.id), self.read_values(decider, scan)));
        }
    }

    /// ` (Xstop 0)`: values of what an element reads.
    fn read_values(&self, decider: &Decider<'_>, scan: &Scan) -> String {
        // What a contact that got power has made of it tells the bit as it was just then.
        if let Element::Contacts { name, negated, .. } = decider.element
            && let Some((true, behind)) = scan.power(decider.id)
        {
            return format!(" ({name} {})", u8::from(behind != *negated));
        }
        let behind = ElementId { index: decider.id.index + 1, ..decider.id };
        let one = |name: &str| Some(format!("{name} {}", scan.value(self.facts.start.index(name)?, Some(behind))));
        let all: Vec<String> = reads(decider.element).into_iter().filter_map(one).collect();
        if all.is_empty() { String::new() } else { format!(" ({})", all.join(", ")) }
    }

    /// `rung 3, element 2: CONTACTS Xstop 1`.
    fn place(&self, id: ElementId) -> String {
        let element = self.facts.program.elements().find(|(other, ..)| *other == id);
        element.map_or_else(|| id.to_string(), |(_, element, _)| format!("{id}: {}", element_text(element)))
    }

    /// The element that wrote a symbol last in a scan up to `to`: of set and reset coils one that had power.
    fn writer(&self, scan: &Scan, symbol: usize, to: Option<ElementId>) -> Option<ElementId> {
        let name = &self.facts.start.symbols().get(symbol)?.name;
        let wrote = |id: ElementId, element: &Element| {
            let (powered, passing) = scan.power(id).unwrap_or_default();
            match writes(element) {
                Written::Always(written) => written == name,
                Written::Powered(written) => powered && written == name,
                Written::Passing(written) => passing && written == name,
                Written::Stages(stem, stages) => powered && is_stage(name, stem, stages),
                Written::Nothing => false,
            }
        };
        let elements = self.facts.program.elements().take_while(|(id, ..)| to.is_none_or(|to| *id < to));
        elements.filter(|(id, element, _)| wrote(*id, element)).map(|(id, ..)| id).last()
    }

    fn unknown(&self, name: &str) -> String {
        let names: Vec<&str> = self.facts.start.symbols().iter().map(|symbol| symbol.name.as_str()).collect();
        format!("the program has no symbol `{name}`; it has {}", names.join(", "))
    }
}

/// A program in its course, up to now.
struct Story<'a> {
    view: &'a View,
    follower: &'a Follower,
}

impl Story<'_> {
    /// The last change of a symbol in the course of a scan, or in a scan before.
    fn last_change(&self, symbol: usize, course: &Course) -> Option<Course> {
        if course.0.changed(symbol, course.1) {
            return Some(course.clone());
        }
        let changes = self.follower.changes.get(symbol)?.iter().rev();
        changes.into_iter().find(|change| change.number < course.0.number).map(|change| (change.clone(), None))
    }

    /// What changed a symbol in a scan, and what changed that. `told`: the scan of which the writer is told already.
    fn because(&self, symbol: usize, course: &Course, told: u64, depth: usize, lines: &mut Vec<String>) {
        let (view, scan, indent) = (self.view, &course.0, "  ".repeat(depth));
        let Some(writer) = view.writer(scan, symbol, course.1) else {
            lines.push(format!("{indent}no element wrote it in scan {}: it was set from outside", scan.number));
            return;
        };
        let way = deciders(&view.facts.program, scan, writer);
        if depth > 1 || told != scan.number {
            lines.push(format!("{indent}{} wrote it", view.place(writer)));
            view.told(&way, scan, depth + 1, lines);
        }
        if depth >= DEEPEST {
            return;
        }
        // Of what decided, that which had changed not long before: in this scan, or in the one before.
        for decider in way {
            for name in reads(decider.element) {
                let Some(cause) = view.facts.start.index(name).filter(|cause| *cause != symbol) else { continue };
                // What an element reads and writes itself, it has read as it left it.
                let behind = ElementId { index: decider.id.index + 1, ..decider.id };
                let Some(change) = self.last_change(cause, &(scan.clone(), Some(behind))) else { continue };
                let (number, value) = (change.0.number, change.0.value(cause, change.1));
                if number + 1 < scan.number {
                    continue;
                }
                if view.is_input(cause) {
                    lines.push(format!("{indent}  {name} became {value} before scan {number}: its pin"));
                    continue;
                }
                lines.push(format!("{indent}  {name} became {value} in scan {number}"));
                // An accumulator that its own timer counts says no more.
                if view.writer(&change.0, cause, change.1).is_none_or(|writer| writer.rung != decider.id.rung) {
                    self.because(cause, &change, told, depth + 2, lines);
                }
            }
        }
    }
}

/// Elements that write symbols, with the symbols, in text order.
pub(crate) fn all_writes(program: &Program, start: &Evaluator) -> Vec<(ElementId, u32)> {
    let mut all = Vec::new();
    for (id, element, _) in program.elements() {
        let is_written = |name: &str| match writes(element) {
            Written::Always(written) | Written::Powered(written) | Written::Passing(written) => written == name,
            Written::Stages(stem, stages) => is_stage(name, stem, stages),
            Written::Nothing => false,
        };
        let symbols = (0..).zip(start.symbols()).filter(|(_, symbol)| is_written(&symbol.name));
        all.extend(symbols.map(|(symbol, _)| (id, symbol)));
    }
    all
}

/// Symbols that nothing but the serial line writes.
pub(crate) fn received(program: &Program, start: &Evaluator, writes: &[(ElementId, u32)]) -> Vec<usize> {
    let names = program.elements().filter_map(|(_, element, _)| match element {
        Element::UartRecv { name, .. } => start.index(name),
        _ => None,
    });
    names.filter(|symbol| writes.iter().filter(|write| write.1 as usize == *symbol).count() == 1).collect()
}

/// A shift register of so many stages writes it: all but the first, which is its input.
fn is_stage(name: &str, stem: &str, stages: u32) -> bool {
    let number = name.strip_prefix(stem);
    number.is_some_and(|n| n.parse().is_ok_and(|stage: u32| (1..stages).contains(&stage) && stage.to_string() == n))
}

/// What an element writes.
enum Written<'a> {
    Nothing,
    /// Whether it has power or not.
    Always(&'a str),
    /// Only with power.
    Powered(&'a str),
    /// Only where it gives power on.
    Passing(&'a str),
    /// The stages of a shift register, with power: its stem and their number.
    Stages(&'a str, u32),
}

fn writes(element: &Element) -> Written<'_> {
    match element {
        Element::Coil { name, set, reset, .. } if *set || *reset => Written::Powered(name),
        Element::Coil { name, .. } | Element::Timer { name, .. } | Element::Counter { name, .. } => {
            Written::Always(name)
        }
        Element::Res { name } | Element::ReadAdc { name, .. } => Written::Powered(name),
        Element::UartRecv { name, .. } => Written::Passing(name),
        Element::Persist { name } => Written::Always(name),
        Element::Move { dest, .. }
        | Element::Math { dest, .. }
        | Element::LookUpTable { dest, .. }
        | Element::PiecewiseLinear { dest, .. } => Written::Powered(dest),
        Element::ShiftRegister { name, stages } => Written::Stages(name, *stages),
        _ => Written::Nothing,
    }
}

/// Symbols whose values decide what an element gives on.
fn reads(element: &Element) -> Vec<&str> {
    let name = |operand: &'_ ladder::Operand| match operand {
        ladder::Operand::Var(_) => true,
        ladder::Operand::Const { .. } => false,
    };
    match element {
        Element::Contacts { name, .. } | Element::Timer { name, .. } | Element::Counter { name, .. } => vec![name],
        Element::Compare { op1, op2, .. } => {
            let variables = [op1, op2].into_iter().filter(|operand| name(operand));
            variables
                .filter_map(|operand| if let ladder::Operand::Var(name) = operand { Some(name.as_str()) } else { None })
                .collect()
        }
        _ => Vec::new(),
    }
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
            ladder::parse_bytes("f.ld", text.as_bytes(), ladder::Options::default()).expect("a program").program;
        let start = Evaluator::new(&program).expect("an evaluator");
        let written: Vec<(u32, &str)> = all_writes(&program, &start)
            .into_iter()
            .map(|(id, symbol)| (id.rung, start.symbols()[symbol as usize].name.as_str()))
            .collect();
        assert_eq!(written, [(0, "reg1"), (0, "reg2"), (1, "reg3"), (2, "reg01"), (3, "reg1x")]);
    }
}
