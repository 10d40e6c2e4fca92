//! Jumps, RETURN and LOCK, and the lines that begin a scan.

use crate::il::{IecType, IlCondition, IlOperation};
use crate::model::{Element, FlowOp};

use super::emitter::{IlEmitter, RungBit};

impl IlEmitter<'_> {
    /// Emits what every scan begins with, and names the labels.
    pub(super) fn prepare_scan(&mut self) {
        if self.facts.has_lock {
            let lock = self.add_variable("Locked", IecType::Bool);
            self.load_bit(&lock);
            self.emit(IlOperation::Return(IlCondition::IfTrue));
            self.lock = Some(lock);
        }
        if self.facts.has_master {
            let master = self.add_variable("Master", IecType::Bool);
            let one = self.bool_literal(true);
            self.load(one, false);
            self.store(&master);
            self.master = Some(master);
        }
        for rung in self.facts.targets.clone() {
            let label = self.names.add("Rung");
            self.rung_labels.insert(rung, label);
        }
    }

    /// GOTO, RETURN and LOCK.
    pub(super) fn flow(&mut self, element: &Element, is_needed: bool) {
        match element {
            Element::Flow { op: FlowOp::Goto, label } => {
                self.ensure_loaded();
                match self.facts.target(label).and_then(|rung| self.rung_labels.get(&rung).cloned()) {
                    Some(label) => self.jump(IlCondition::IfTrue, &label),
                    None => self.emit(IlOperation::Return(IlCondition::IfTrue)),
                }
            }
            Element::Return if !self.has_subprograms() => {
                self.ensure_loaded();
                self.emit(IlOperation::Return(IlCondition::IfTrue));
            }
            Element::Lock => {
                self.ensure_loaded();
                if let Some(lock) = self.lock.clone() {
                    let target = self.variable(&lock, None);
                    self.emit(IlOperation::Set(target));
                }
                self.emit(IlOperation::Return(IlCondition::IfTrue));
                return;
            }
            // GOSUB and its subprogram; only elements of the flow come here.
            _ => {
                let cause = format!("Instruction List has no subprograms, as in `{}`", crate::element_text(element));
                return self.refuse(cause, "write the rungs of the subprogram at the place of each GOSUB");
            }
        }
        if is_needed {
            // A jump that is not taken gives 0.
            let zero = self.bool_literal(false);
            self.bit = RungBit::One;
            self.condition(zero, false);
        }
    }

    fn has_subprograms(&self) -> bool {
        let is_end = |element: &Element| matches!(element, Element::Flow { op: FlowOp::Subprogram, .. });
        self.source.elements().any(|at| is_end(at.element))
    }
}
