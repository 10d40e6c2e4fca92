//! The symbols of a program, collected from its rungs.

use std::collections::BTreeMap;

use crate::integer_widths::IntegerWidths;
use crate::model::{Element, LadderProgram, LadderSymbol, SymbolKind};

pub(crate) fn collect_symbols(program: &LadderProgram) -> Vec<LadderSymbol> {
    let mut found: BTreeMap<String, SymbolKind> = BTreeMap::new();
    for (_, element, _) in program.elements() {
        for_each_symbol_use(element, &mut |name, kind| {
            let slot = found.entry(name.to_owned()).or_insert(kind);
            // A plain use never hides that the name is an accumulator or an analog input.
            if *slot == SymbolKind::Variable {
                *slot = kind;
            }
        });
    }
    for entry in &program.io {
        // Pins of other kinds (a pulse width output of LDmicro 5) hold nothing that a program could read.
        let kind = kind_by_letter(&entry.name);
        if kind != SymbolKind::Variable {
            found.entry(entry.name.clone()).or_insert(kind);
        }
    }
    let widths = IntegerWidths::new(program);
    let pins: BTreeMap<&str, u32> = program.io.iter().rev().map(|e| (e.name.as_str(), e.pin)).collect();
    let mut list: Vec<LadderSymbol> = found
        .into_iter()
        .map(|(name, kind)| {
            let pin = pins.get(name.as_str()).copied().unwrap_or(0);
            let bytes = if kind.is_bit() { 0 } else { widths.bytes_of_symbol(&name) };
            LadderSymbol { name, kind, pin, bytes }
        })
        .collect();
    list.sort_by(|a, b| (a.kind, &a.name).cmp(&(b.kind, &b.name)));
    list
}

/// The kind that a name's first letter gives where only its spelling is known (contacts, coils, `IO LIST`).
#[must_use]
pub fn kind_by_letter(name: &str) -> SymbolKind {
    match name.chars().next() {
        Some('X') => SymbolKind::Input,
        Some('Y') => SymbolKind::Output,
        Some('R') => SymbolKind::Relay,
        Some('A') => SymbolKind::Adc,
        _ => SymbolKind::Variable,
    }
}

/// Calls `each` for every name that `element` reads or writes, with the kind that this use gives it.
pub fn for_each_symbol_use(element: &Element, each: &mut dyn FnMut(&str, SymbolKind)) {
    element.facts().symbols.iter().for_each(|symbol| each(&symbol.name, symbol.kind));
}
