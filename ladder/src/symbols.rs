//! Collects the symbols of a program from its rungs and its `IO LIST`.

use std::collections::BTreeMap;

use crate::integer_widths::IntegerWidths;
use crate::model::{Element, LadderDialect, LadderProgram, LadderSymbol, ProgramElement, SymbolKind};

/// Collects the symbols of a program, as [`LadderProgram::symbols`] describes.
pub(crate) fn collect_symbols(program: &LadderProgram) -> Vec<LadderSymbol> {
    if program.dialect == LadderDialect::Iec {
        return declared_symbols(program);
    }
    let mut found: BTreeMap<String, SymbolKind> = BTreeMap::new();
    for ProgramElement { element, .. } in program.elements() {
        for_each_symbol_use(element, &mut |name, kind| {
            let slot = found.entry(name.to_owned()).or_insert(kind);
            // A use as a plain variable does not override that the name is an accumulator or an analog input.
            if *slot == SymbolKind::Variable {
                *slot = kind;
            }
        });
    }
    for entry in &program.io {
        // Pins of other kinds (such as a PWM output of LDmicro 5) hold no value that a program can read.
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
            LadderSymbol { name, kind, pin, bytes, iec_type: None, is_given: kind == SymbolKind::Input }
        })
        .collect();
    list.sort_by(|a, b| (a.kind, &a.name).cmp(&(b.kind, &b.name)));
    list
}

/// Returns the symbols of an IEC program, which its declarations give.
fn declared_symbols(program: &LadderProgram) -> Vec<LadderSymbol> {
    let pins: BTreeMap<&str, u32> = program.io.iter().rev().map(|e| (e.name.as_str(), e.pin)).collect();
    let symbols = program
        .declarations
        .iter()
        .flat_map(|variable| variable.symbols().into_iter().map(|symbol| (symbol, variable.is_given())));
    let mut list: Vec<LadderSymbol> = symbols
        .map(|(symbol, is_given)| LadderSymbol {
            is_given,
            pin: pins.get(symbol.name.as_str()).copied().unwrap_or(0),
            kind: symbol.kind,
            bytes: if symbol.kind.is_bit() { 0 } else { (symbol.iec_type.bits() / 8) as u8 },
            iec_type: Some(symbol.iec_type),
            name: symbol.name,
        })
        .collect();
    list.sort_by(|a, b| (a.kind, &a.name).cmp(&(b.kind, &b.name)));
    list
}

/// Kind given by the first letter of a name, where only the spelling is known (contacts, coils, `IO LIST`).
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

/// Calls `each` for every symbol that `element` reads or writes, with the kind that this use implies.
pub fn for_each_symbol_use(element: &Element, each: &mut dyn FnMut(&str, SymbolKind)) {
    element.facts().symbols.iter().for_each(|symbol| each(&symbol.name, symbol.kind));
}
