//! What made a symbol what it is.

use emu_debug::debug::Follow;
use ladder::{Element, ElementId, SymbolKind, element_text};

use crate::View;
use crate::flow::{Decider, deciders};
use crate::follow::{Follower, Scan};

/// How many causes behind causes are told.
const DEEPEST: usize = 6;

impl View {
    /// Why a symbol has its value: the element that wrote it, what gave power to that element or kept it away, and the same for what
    /// changed there, back through the scans. One line each, the deeper the further back.
    ///
    /// # Errors
    /// No such symbol, or no scan has run: one sentence.
    pub fn why(&self, follow: &dyn Follow, name: &str) -> Result<Vec<String>, String> {
        let follower = Follower::of(follow).ok_or("nothing follows this program")?;
        let symbol = self.facts.start.index(name).ok_or_else(|| self.unknown(name))?;
        let now = follower.now.as_deref().ok_or("no scan has run yet; `scan` runs one")?;
        let value = |scan: &Scan| scan.after.get(symbol).copied().unwrap_or(0);
        let mut lines = Vec::new();
        let kind = self.facts.start.symbols().get(symbol).map(|symbol| symbol.kind);
        if kind == Some(SymbolKind::Input) {
            lines.push(match follower.changes.get(symbol).and_then(|changes| changes.back()) {
                Some(scan) => format!("{name} is {} since scan {}: its pin", value(now), scan.number),
                None => format!("{name} is {} since power-up: its pin", value(now)),
            });
            return Ok(lines);
        }
        match self.writer(now, symbol) {
            Some(writer) => {
                lines.push(format!("{name} is {}: {} wrote it in scan {}", value(now), self.place(writer), now.number));
                self.deciding(now, writer, 1, &mut lines);
            }
            None => lines.push(format!("{name} is {}: no element of scan {} has written it", value(now), now.number)),
        }
        match follower.changes.get(symbol).and_then(|changes| changes.back()) {
            Some(scan) if scan.number < now.number => {
                lines.push(format!(
                    "it became {} in scan {}, whose inputs were taken in cycle {}",
                    value(scan),
                    scan.number,
                    scan.cycle
                ));
                self.because(follower, symbol, scan, 1, &mut lines);
            }
            Some(_) => {
                lines.push("it became that in this scan".to_owned());
                self.because(follower, symbol, now, 1, &mut lines);
            }
            None => lines.push("it has been so since power-up".to_owned()),
        }
        Ok(lines)
    }

    /// What changed a symbol in a scan, and what changed that.
    fn because(&self, follower: &Follower, symbol: usize, scan: &Scan, depth: usize, lines: &mut Vec<String>) {
        let indent = "  ".repeat(depth);
        let Some(writer) = self.writer(scan, symbol) else {
            lines.push(format!("{indent}no element wrote it in scan {}: it was set from outside", scan.number));
            return;
        };
        let way = deciders(&self.facts.program, scan, writer);
        if depth > 1 || follower.now.as_ref().is_none_or(|now| now.number != scan.number) {
            lines.push(format!("{indent}{} wrote it", self.place(writer)));
            self.told(&way, scan, depth + 1, lines);
        }
        if depth >= DEEPEST {
            return;
        }
        // Of what decided, that which had changed not long before: in this scan, or in the one before.
        for decider in way {
            for name in reads(decider.element) {
                let Some(cause) = self.facts.start.index(name).filter(|cause| *cause != symbol) else { continue };
                let changes = follower.changes.get(cause).into_iter().flatten().rev();
                let Some(change) = changes.into_iter().find(|change| change.number <= scan.number) else { continue };
                if change.number + 1 < scan.number {
                    continue;
                }
                let value = change.after.get(cause).copied().unwrap_or(0);
                let kind = self.facts.start.symbols().get(cause).map(|symbol| symbol.kind);
                if kind == Some(SymbolKind::Input) {
                    lines.push(format!("{indent}  {name} became {value} before scan {}: its pin", change.number));
                } else if self.writer(change, cause).is_some_and(|writer| writer.rung == decider.id.rung) {
                    // An accumulator that its own timer counts.
                    lines.push(format!("{indent}  {name} became {value} in scan {}", change.number));
                } else {
                    lines.push(format!("{indent}  {name} became {value} in scan {}", change.number));
                    self.because(follower, cause, change, depth + 2, lines);
                }
            }
        }
    }

    /// What gave power to an element, or kept it away.
    fn deciding(&self, scan: &Scan, to: ElementId, depth: usize, lines: &mut Vec<String>) {
        self.told(&deciders(&self.facts.program, scan, to), scan, depth, lines);
    }

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
        let one = |name: &str| {
            let symbol = self.facts.start.index(name)?;
            let input = self.facts.start.symbols().get(symbol)?.kind == SymbolKind::Input;
            let values = if input { &scan.before } else { &scan.after };
            Some(format!("{name} {}", values.get(symbol)?))
        };
        let all: Vec<String> = reads(decider.element).into_iter().filter_map(one).collect();
        if all.is_empty() { String::new() } else { format!(" ({})", all.join(", ")) }
    }

    /// `rung 3, element 2: CONTACTS Xstop 1`.
    fn place(&self, id: ElementId) -> String {
        let element = self.facts.program.elements().find(|(other, ..)| *other == id);
        element.map_or_else(|| id.to_string(), |(_, element, _)| format!("{id}: {}", element_text(element)))
    }

    /// The element that wrote a symbol last in a scan: of set and reset coils one that had power.
    fn writer(&self, scan: &Scan, symbol: usize) -> Option<ElementId> {
        let name = &self.facts.start.symbols().get(symbol)?.name;
        let wrote = |id: ElementId, element: &Element| {
            let powered = scan.power(id).is_some_and(|power| power.0);
            match writes(element) {
                Written::Always(written) => written == name,
                Written::Powered(written) => powered && written == name,
                Written::Stages(stem) => powered && name.strip_prefix(stem).is_some_and(|n| n.parse::<u32>().is_ok()),
                Written::Nothing => false,
            }
        };
        let elements = self.facts.program.elements();
        elements.filter(|(id, element, _)| wrote(*id, element)).map(|(id, ..)| id).last()
    }

    fn unknown(&self, name: &str) -> String {
        let names: Vec<&str> = self.facts.start.symbols().iter().map(|symbol| symbol.name.as_str()).collect();
        format!("the program has no symbol `{name}`; it has {}", names.join(", "))
    }
}

/// What an element writes.
enum Written<'a> {
    Nothing,
    /// Whether it has power or not.
    Always(&'a str),
    /// Only with power.
    Powered(&'a str),
    /// Variables of this stem and a number, with power.
    Stages(&'a str),
}

fn writes(element: &Element) -> Written<'_> {
    match element {
        Element::Coil { name, set, reset, .. } if *set || *reset => Written::Powered(name),
        Element::Coil { name, .. } | Element::Timer { name, .. } | Element::Counter { name, .. } => {
            Written::Always(name)
        }
        Element::Res { name } | Element::ReadAdc { name, .. } | Element::UartRecv { name, .. } => {
            Written::Powered(name)
        }
        Element::Persist { name } => Written::Always(name),
        Element::Move { dest, .. }
        | Element::Math { dest, .. }
        | Element::LookUpTable { dest, .. }
        | Element::PiecewiseLinear { dest, .. } => Written::Powered(dest),
        Element::ShiftRegister { name, .. } => Written::Stages(name),
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
