//! What the proof says about the parts of the chip: their state is one opaque term, which every access
//! changes.

use super::*;
use ladder_compile::ir::BusAction;

impl ProofSpace {
    /// A value goes to a part.
    pub(super) fn record_output(&mut self, what: &str, value: WordOperand, s: &mut SymbolicState) {
        let value = self.value(s, value);
        s.parts = self.opaque_term(what, &[s.parts, value]);
    }

    /// A transfer on a bus. All devices answer the same byte within a scan.
    pub(super) fn record_transfer(
        &mut self,
        ir: &Ir,
        s: &mut SymbolicState,
        (action, register, value): (BusAction, WordOperand, WordOperand),
        dst: Option<WordId>,
    ) {
        let operands = [self.value(s, register), self.value(s, value), s.parts];
        s.parts = self.opaque_term(&format!("transfer {action:?}"), &operands);
        if let Some(dst) = dst {
            let answer = self.opaque_term("answer", &[]);
            self.set(ir, s, dst, answer);
        }
    }
}
