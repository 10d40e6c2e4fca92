//! Checks that need the whole program.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity};

use crate::check::Checker;
use crate::codes;
use crate::model::{CounterKind, Element, ElementId, LadderDialect, ProgramElement, SymbolKind};
use crate::packages;
use crate::reader::message_text;

/// Notes what the head says and has no effect: an unknown chip, masks of PULL-UP LIST, widths of VAR LIST.
pub(crate) fn check_head(checker: &mut Checker<'_>) {
    let program = checker.program;
    let mut notes: Vec<(&'static str, Pos, String, &str)> = Vec::new();
    let micro = program.settings.micro.as_deref();
    if let Some(micro) = micro.filter(|m| packages::chip_of(m).is_none() && packages::unmodelled_target(m).is_none()) {
        let cause = format!("MICRO={} is no name of LDmicro's list: the program has no chip", message_text(micro));
        notes.push((codes::IGNORED_SETTING, Pos::default(), cause, "`emu chips` lists the chips"));
    }
    for entry in program.io.iter().filter(|entry| entry.name.starts_with('X')) {
        let Some(pin) = micro.and_then(|micro| packages::package_pin(micro, entry.pin)) else { continue };
        let is_pic = micro.is_some_and(|micro| micro.contains("PIC1"));
        // A PIC has pull-ups at port B only.
        let Some((letter, bit)) = port_bit(pin).filter(|(letter, _)| !is_pic || *letter == 'B') else { continue };
        let mut masks = program.pull_ups.iter().flatten().filter_map(|text| pull_up_mask(text));
        let mask = masks.rfind(|(port, _)| port.eq_ignore_ascii_case(&letter));
        if mask.is_some_and(|(_, mask)| mask >> bit & 1 == 0) {
            let cause = format!(
                "{}: PULL-UP LIST gives {pin} no pull-up, but a compiled image turns it on at every input",
                entry.name
            );
            notes.push((codes::IGNORED_SETTING, entry.pos, cause, "a resistor to ground at the pin overrides it"));
        }
    }
    let is_newer = program.dialect == LadderDialect::Ldmicro5;
    let counted: BTreeSet<String> = program.elements().filter_map(|at| accumulator(at.element)).collect();
    for entry in program.vars.iter().flatten().filter(|entry| is_newer && counted.contains(&entry.name)) {
        let bytes = checker.widths.bytes_of_symbol(&entry.name);
        if bytes != entry.bytes {
            let cause = format!(
                "{} has {bytes} byte(s), not {}: its timer or counter decides, as in LDmicro 5",
                entry.name, entry.bytes
            );
            notes.push((codes::LIST_LINE, entry.pos, cause, "nothing to do; the line has no effect"));
        }
    }
    let file = &program.file;
    let notes =
        notes.into_iter().map(|(code, pos, cause, hint)| Diagnostic::new(Severity::Note, code, file, pos, cause, hint));
    checker.diagnostics.extend(notes);
}

/// The port and the bit of a pin such as `PB3`.
fn port_bit(pin: &str) -> Option<(char, u32)> {
    let mut letters = pin.chars();
    let (_, letter) = (letters.next()?, letters.next()?);
    Some((letter, letters.as_str().parse().ok().filter(|bit| *bit < 8)?))
}

/// The port and the mask of a line of PULL-UP LIST.
fn pull_up_mask(text: &str) -> Option<(char, u64)> {
    let (port, mask) = text.split_once(':')?;
    let digits = mask.trim_start().strip_prefix("0x")?;
    let end = digits.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(digits.len());
    Some((port.chars().nth(1)?, u64::from_str_radix(digits.get(..end)?, 16).ok()?))
}

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
