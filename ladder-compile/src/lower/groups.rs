//! Lowers parallel groups.

use ladder::{Element, RungNode};

use super::Lowering;
use crate::ir::{BitId, BitRole, IrOp};

impl Lowering<'_> {
    /// Input and output bit of a parallel group.
    fn group_bits(&mut self, depth: usize) -> (BitId, BitId) {
        let subprogram = self.jumps.as_ref().and_then(|plan| plan.subprogram(self.element.rung));
        if let Some(bits) = self.groups.get(&(subprogram, depth)) {
            return *bits;
        }
        let suffix = subprogram.map_or(String::new(), |first| format!(" of {}", first + 1));
        // A scan that goes on where an earlier one was held needs them.
        let role = if self.has_held_scans() { BitRole::Memory } else { BitRole::Temporary };
        let input = self.new_bit(format!("in{depth}{suffix}"), role);
        let output = self.new_bit(format!("out{depth}{suffix}"), role);
        self.groups.insert((subprogram, depth), (input, output));
        (input, output)
    }

    /// Lowers a parallel group: each branch starts with the group's input, in order; the output is the OR of
    /// the branches.
    pub(super) fn parallel(&mut self, branches: &[Vec<RungNode>], depth: usize) {
        self.element.index = self.next;
        let (input, output) = self.group_bits(depth);
        // Branches that only narrow the rung state, with no other effect, can start with true and be combined
        // with the input afterwards. Simple ORs of contacts stay simple this way.
        let pure = branches.iter().flatten().all(only_narrows_rung);
        self.push(IrOp::Store { bit: input, negated: false });
        for (i, branch) in branches.iter().enumerate() {
            match (pure, i) {
                (true, _) => self.push(IrOp::SetAccumulator(true)),
                (false, 0) => {}
                (false, _) => self.push(IrOp::Load { bit: input, negated: false }),
            }
            self.series(branch, depth + 1);
            if i > 0 {
                self.push(IrOp::Or { bit: output, negated: false });
            }
            if i + 1 < branches.len() {
                self.push(IrOp::Store { bit: output, negated: false });
            }
        }
        if pure {
            self.push(IrOp::And { bit: input, negated: false });
        }
    }
}

/// True for nodes that can only narrow the rung state and have no other effect.
fn only_narrows_rung(node: &RungNode) -> bool {
    match node {
        RungNode::Leaf(element, _) => matches!(
            element,
            Element::Contacts { .. } | Element::Compare { .. } | Element::Short | Element::Open | Element::Comment(_)
        ),
        RungNode::Parallel(branches, _) => branches.iter().flatten().all(only_narrows_rung),
    }
}
