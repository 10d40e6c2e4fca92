//! Checks that need the whole program.

use std::collections::{BTreeMap, BTreeSet};

use diag::Severity;

use crate::check::Checker;
use crate::codes;
use crate::model::{CounterKind, Element, ElementId, ProgramElement, SymbolKind};

/// Reports doubly driven coils, contacts that no coil drives, shared accumulators, and RES of other symbols.
pub(crate) fn check_names(checker: &mut Checker<'_>) {
    let program = checker.program;
    // For each coil name: its first coil, and whether all its coils so far only set or only reset.
    let mut coils: BTreeMap<&str, (ElementId, bool)> = BTreeMap::new();
    let mut owners: BTreeMap<String, (ElementId, &Element)> = BTreeMap::new();
    let mut contacts: BTreeSet<&str> = BTreeSet::new();
    let driven: BTreeSet<String> =
        program.elements().flat_map(|at| at.element.facts().written().map(str::to_owned).collect::<Vec<_>>()).collect();
    let counted: BTreeSet<String> = program.elements().filter_map(|at| accumulator(at.element)).collect();
    for at in program.elements() {
        match at.element {
            Element::Coil { name, set, reset, .. } => {
                let latch = *set || *reset;
                if let Some((first, all_latch)) = coils.get_mut(name.as_str()) {
                    if !(*all_latch && latch) {
                        let cause = format!("{name} is already driven by {first}; the later coil wins");
                        checker.warning(
                            codes::COIL_TWICE,
                            at,
                            cause,
                            "join the conditions with PARALLEL into one coil",
                        );
                    }
                    *all_latch &= latch;
                } else {
                    coils.insert(name, (at.id, latch));
                }
            }
            // `insert` returns false for a name that was reported before, so each name gives one warning.
            Element::Contacts { name, .. }
                if !name.starts_with('X') && !driven.contains(name.as_str()) && contacts.insert(name) =>
            {
                let cause = format!("no coil drives {name}, so it is always 0");
                checker.warning(codes::NEVER_DRIVEN, at, cause, "add a coil, or correct the name");
            }
            Element::Res { name } if !counted.contains(name.as_str()) => {
                let cause = format!("{name} is not a timer or counter");
                let hint = format!("correct the name, or write MOVE {name} 0");
                checker.warning(codes::RES_TARGET, at, cause, hint);
            }
            // The other checks use the table of element facts.
            _ => {}
        }
        if let Some(name) = accumulator(at.element) {
            match owners.get(&name) {
                Some((first, other)) => report_shared_accumulator(checker, at, &name, *first, other),
                None => drop(owners.insert(name, (at.id, at.element))),
            }
        }
    }
}

/// Returns the name of the accumulator of a timer or counter.
fn accumulator(element: &Element) -> Option<String> {
    let facts = element.facts();
    let of = facts.symbols.iter().find(|symbol| matches!(symbol.kind, SymbolKind::Timer | SymbolKind::Counter));
    of.map(|symbol| symbol.name.to_string())
}

fn report_shared_accumulator(
    checker: &mut Checker<'_>,
    at: ProgramElement<'_>,
    name: &str,
    first: ElementId,
    other: &Element,
) {
    use CounterKind::{Ctd, Ctu};
    let kind = |e: &Element| match e {
        Element::Counter { kind, .. } => Some(*kind),
        _ => None,
    };
    if let (Some(Ctu), Some(Ctd)) | (Some(Ctd), Some(Ctu)) = (kind(at.element), kind(other)) {
        let cause =
            format!("{name} is also counted by {first}: CTU and CTD on one counter, LDmicro's way to count both ways");
        let hint = "nothing to do if this is meant";
        return checker.report(Severity::Note, codes::SHARED, at, &cause, hint);
    }
    let cause = format!("{name} is also used by {first}, and each disturbs the other");
    checker.warning(codes::SHARED, at, cause, "give each timer and counter a name of its own");
}
