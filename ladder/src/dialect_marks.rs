//! Finds what only LDmicro 5 can have written, in a file with the header of release 2.3.

use diag::Pos;

use crate::model::{CounterKind, Element, LadderProgram, LdFormat, ProgramElement, RungNode};
use crate::reader::message_text;
use crate::write::element_text;

/// What shows that LDmicro 5 wrote a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DialectMark {
    /// What it is, as the subject of a sentence.
    pub what: String,
    /// Where it is; unknown for a line of the head.
    pub place: MarkPlace,
}

/// Where a mark is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum MarkPlace {
    /// At a position.
    At(Pos),
    /// In the line of the head that begins with this text.
    HeadLine(&'static str),
}

impl LadderProgram {
    /// Whether only LDmicro 5 can have written the program: it has a list, a setting, an element or an
    /// argument that release 2.3 does not write, or a CTC that is not last in its rung.
    #[must_use]
    pub fn only_ldmicro5_writes(&self) -> bool {
        self.ldmicro5_mark().is_some()
    }

    /// The first mark of LDmicro 5 under the header of release 2.3.
    pub(crate) fn ldmicro5_mark(&self) -> Option<DialectMark> {
        if self.format != LdFormat::V01 {
            return None;
        }
        self.element_mark().or_else(|| self.head_mark())
    }

    fn element_mark(&self) -> Option<DialectMark> {
        let mark = |at: ProgramElement<'_>, why: &str| DialectMark {
            what: format!("{} ({}) is {why}", at.id, message_text(&element_text(at.element))),
            place: MarkPlace::At(at.pos),
        };
        let own = self.elements().find(|at| at.element.only_ldmicro5_writes());
        if let Some(at) = own {
            return Some(mark(at, "of LDmicro 5"));
        }
        let middle = self.rungs.iter().find_map(|rung| counter_before_end(&rung.series, true))?;
        let at = self.elements().find(|at| std::ptr::eq(at.element, middle))?;
        Some(mark(at, "not last in its rung, which is of LDmicro 5"))
    }

    fn head_mark(&self) -> Option<DialectMark> {
        let settings = &self.settings;
        let has_unit = |rest: &str, unit: &str| rest.get(..unit.len()).is_some_and(|u| u.eq_ignore_ascii_case(unit));
        let lines = [
            ("CYCLE=", "the text after the number of CYCLE=", has_unit(&settings.cycle_rest, "us")),
            ("CRYSTAL=", "the text after the number of CRYSTAL=", has_unit(&settings.crystal_rest, "hz")),
            ("BAUD=", "the text after the number of BAUD=", has_unit(&settings.baud_rest, "hz")),
            ("COMPILER=", "COMPILER=", settings.compiler.is_some()),
            ("VAR", "VAR LIST", self.vars.is_some()),
            ("PULL-UP", "PULL-UP LIST", self.pull_ups.is_some()),
        ];
        if let Some((line, what, _)) = lines.into_iter().find(|(_, _, found)| *found) {
            return Some(DialectMark { what: format!("{what} is of LDmicro 5"), place: MarkPlace::HeadLine(line) });
        }
        if let Some(entry) = self.io.iter().find(|entry| entry.modbus.is_some()) {
            let what = format!("the Modbus address of {} is of LDmicro 5", message_text(&entry.name));
            return Some(DialectMark { what, place: MarkPlace::At(entry.pos) });
        }
        let numbered = self.rungs.first().filter(|_| self.style.rung_numbers)?;
        let what = "the number after RUNG is of LDmicro 5".to_owned();
        Some(DialectMark { what, place: MarkPlace::At(numbered.pos) })
    }
}

/// A CTC with something between it and the right rail. Release 2.3 draws CTC at the right rail only.
///
/// `at_rail` says whether the right end of `series` is the right rail.
fn counter_before_end(series: &[RungNode], at_rail: bool) -> Option<&Element> {
    let end = series.iter().rposition(|node| !matches!(node, RungNode::Leaf(Element::Comment(_), _)));
    series.iter().enumerate().find_map(|(i, node)| {
        let at_rail = at_rail && end.is_none_or(|end| i >= end);
        match node {
            RungNode::Leaf(element @ Element::Counter { kind: CounterKind::Ctc, .. }, _) if !at_rail => Some(element),
            RungNode::Leaf(..) => None,
            RungNode::Parallel(branches, _) => branches.iter().find_map(|branch| counter_before_end(branch, at_rail)),
        }
    })
}
