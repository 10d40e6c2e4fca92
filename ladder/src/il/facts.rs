//! The row of the table of element facts for a line of Instruction List.

use std::borrow::Cow;

use crate::element_facts::{ElementFacts, PowerEffect, SymbolUse, WriteMoment};

use super::model::IlCondition;
use super::steps::{IlAction, IlSource, IlStep, TypedSymbol};

/// Returns the properties of a line. Its power is the current result: whether it is not 0.
pub(crate) fn instruction_facts(step: &IlStep) -> ElementFacts<'_> {
    let mut symbols: Vec<SymbolUse<'_>> = Vec::new();
    for source in step.sources() {
        if let IlSource::Symbol(symbol) = source {
            symbols.push(symbol_use(symbol, true, None));
        }
    }
    let (power, has_memory) = match &step.action {
        IlAction::Nothing | IlAction::Open { source: None, .. } => (PowerEffect::Wire, false),
        IlAction::Load { .. }
        | IlAction::Not { .. }
        | IlAction::Binary { .. }
        | IlAction::Open { .. }
        | IlAction::Close { .. }
        | IlAction::Function(_) => (PowerEffect::Decides, false),
        IlAction::Store { target, .. } => {
            symbols.push(symbol_use(target, false, Some(WriteMoment::Always)));
            (PowerEffect::Acts, false)
        }
        IlAction::Set(target) | IlAction::Reset(target) => {
            symbols.push(symbol_use(target, false, Some(WriteMoment::Powered)));
            (PowerEffect::Acts, false)
        }
        IlAction::Jump { .. } | IlAction::Return(_) => (PowerEffect::Acts, false),
        IlAction::Call { condition, call } => {
            // A call on FALSE is neither of the moments of power; what it writes, it may write in every scan.
            let moment = if *condition == IlCondition::IfTrue { WriteMoment::Powered } else { WriteMoment::Always };
            for part in call.block.parts() {
                // Inputs keep what an earlier call or ST wrote.
                let is_written = !part.is_input || call.inputs.iter().any(|(input, _)| is_part(input, part.name));
                let Some(part) = call.part(part.name) else { continue };
                let moment = is_written.then_some(moment);
                symbols.push(SymbolUse { name: Cow::Owned(part.name), kind: part.kind, is_read: true, write: moment });
            }
            symbols.extend(call.outputs.iter().map(|output| symbol_use(&output.target, false, Some(moment))));
            (PowerEffect::Acts, true)
        }
    };
    let (constants, part) = (Vec::new(), None);
    ElementFacts { keyword: step.keyword(), symbols, constants, power, has_memory, part, needs_ldmicro5: false }
}

fn symbol_use(symbol: &TypedSymbol, is_read: bool, write: Option<WriteMoment>) -> SymbolUse<'_> {
    SymbolUse { name: Cow::Borrowed(&symbol.name), kind: symbol.kind, is_read, write }
}

/// Whether the symbol is the part of this name of its instance.
fn is_part(symbol: &TypedSymbol, part: &str) -> bool {
    symbol.name.rsplit_once('.').is_some_and(|(_, name)| name == part)
}
