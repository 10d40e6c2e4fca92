//! The symbols of a program, collected from its rungs.

use std::collections::BTreeMap;

use crate::integer_widths::IntegerWidths;
use crate::model::{Element, LadderOperand, LadderProgram, LadderSymbol, SymbolKind};

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
    use SymbolKind::{Adc, Counter, Timer, Variable};
    let operand = |o: &LadderOperand, each: &mut dyn FnMut(&str, SymbolKind)| {
        if let LadderOperand::Var(name) = o {
            each(name, Variable);
        }
    };
    match element {
        Element::Comment(_)
        | Element::Short
        | Element::Open
        | Element::Placeholder
        | Element::MasterRelay
        | Element::Osr
        | Element::Osf => {}
        Element::Contacts { name, .. } | Element::Coil { name, .. } => each(name, kind_by_letter(name)),
        Element::Timer { name, delay, adjust, .. } => {
            each(name, Timer);
            operand(delay, each);
            adjust.iter().for_each(|o| operand(o, each));
        }
        Element::Counter { name, max, init, .. } => {
            each(name, Counter);
            operand(max, each);
            init.iter().for_each(|o| operand(o, each));
        }
        Element::Res { name } => each(name, Variable),
        Element::Move { dest, src } => {
            each(dest, Variable);
            operand(src, each);
        }
        Element::Math { dest, op1, op2, .. } => {
            each(dest, Variable);
            operand(op1, each);
            operand(op2, each);
        }
        Element::Compare { op1, op2, .. } => {
            operand(op1, each);
            operand(op2, each);
        }
        Element::ShiftRegister { name, stages } => (0..*stages).for_each(|i| each(&format!("{name}{i}"), Variable)),
        Element::LookUpTable { dest, index, .. } | Element::PiecewiseLinear { dest, index, .. } => {
            each(dest, Variable);
            operand(index, each);
        }
        Element::ReadAdc { name, .. } => each(name, Adc),
        Element::SetPwm { duty, hertz, .. } => {
            operand(duty, each);
            operand(hertz, each);
        }
        Element::UartRecv { name, .. } | Element::UartSend { name, .. } | Element::Persist { name } => {
            each(name, Variable)
        }
        Element::FormattedString { var, .. } => var.iter().for_each(|name| each(name, Variable)),
    }
}
