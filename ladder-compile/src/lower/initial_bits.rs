//! Bits that begin with 1.

use crate::ir::{BitCell, BitId, BitRole, BranchCondition, Ir, IrOp};

impl Ir {
    /// Lets the first scan set the bits that begin with 1, for targets whose reset clears all bits.
    pub fn set_bits_in_first_scan(&mut self) {
        let mut ops: Vec<IrOp> = self.initial_bits().map(|bit| IrOp::SetBit { bit, value: true }).collect();
        self.bits.iter_mut().for_each(|cell| cell.initial = false);
        if ops.is_empty() {
            return;
        }
        let bit = BitId(self.bits.len() as u32);
        self.bits.push(BitCell { name: "scanned".to_owned(), role: BitRole::Memory, initial: false });
        ops.push(IrOp::SetBit { bit, value: true });
        self.prologue.insert(0, IrOp::If { cond: BranchCondition::Bit(bit), if_true: Vec::new(), if_false: ops });
    }

    /// The bits that are 1 after reset.
    pub fn initial_bits(&self) -> impl Iterator<Item = BitId> {
        (0..).zip(&self.bits).filter(|(_, cell)| cell.initial).map(|(n, _)| BitId(n))
    }
}
