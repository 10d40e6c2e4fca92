//! Factors out a contact that parallel branches have in common, so that it is computed once.

use std::collections::HashSet;

use super::Liveness;
use crate::ir::{BitId, BranchCondition, Ir, IrOp, IrStep, LogicOp};

/// Moves a contact that two branches have in common after their OR.
///
/// `load x; and a; store t; load x; and b; or t` becomes `load a; store t; load b; or t; and x`.
pub(super) fn factor_common_contacts(ir: &mut Ir, temporary: &HashSet<BitId>) {
    let mut within = temporary.clone();
    for rung in &ir.rungs {
        let mut later = Liveness::at_scan_end(ir);
        rung.steps.iter().rev().for_each(|step| _ = later.op(step.op.clone()));
        within.retain(|bit| later.dead_bits.contains(bit));
    }
    for rung in &mut ir.rungs {
        while (0..rung.steps.len()).any(|at| factor_at(&mut rung.steps, at, &within)) {}
    }
}

/// Factors a contact out where step `at` stores the temporary; returns false if there is none.
///
/// No rung may read the temporary before storing it (`within`), and it must not be read again.
fn factor_at(steps: &mut Vec<IrStep>, at: usize, within: &HashSet<BitId>) -> bool {
    let Some(IrStep { op: IrOp::Store { bit: joined, negated: false }, .. }) = steps.get(at) else { return false };
    let joined = *joined;
    let contact = |step: &IrStep| match step.op {
        IrOp::Load { bit, negated } | IrOp::And { bit, negated } => Some((bit, negated)),
        _ => None,
    };
    let is_and = |step: &&IrStep| matches!(step.op, IrOp::And { .. });
    let is_load = |step: Option<&IrStep>| step.is_some_and(|step| matches!(step.op, IrOp::Load { .. }));
    // The second branch is `load; and; ..` up to the OR. The first branch ends with ANDs, preceded by a load.
    let ands = steps.iter().skip(at + 2).take_while(is_and).count();
    let or = at + 2 + ands;
    let joins = |step: &IrStep| step.op == IrOp::Or { bit: joined, negated: false };
    let Some(owner) = steps.get(or).map(|step| step.element) else { return false };
    if !within.contains(&joined) || !is_load(steps.get(at + 1)) || !steps.get(or).is_some_and(joins) {
        return false;
    }
    if steps.iter().skip(or + 1).map(|step| &step.op).find_map(|op| next_access(op, joined)) == Some(BitAccess::Read) {
        return false;
    }
    let before = steps.iter().take(at).rev().take_while(is_and).count();
    let first = at - before - usize::from(is_load(steps.get((at - before).wrapping_sub(1))));
    let common = (first..at).find_map(|n| {
        let factor = contact(steps.get(n)?).filter(|(bit, _)| *bit != joined)?;
        (at + 1..or).find(|&m| steps.get(m).and_then(contact) == Some(factor)).map(|m| (n, m, factor))
    });
    let Some((n, m, (bit, negated))) = common else { return false };
    let is_single_contact = first + 1 == at && is_load(steps.get(first)) || m == at + 1 && ands == 0;
    if is_single_contact {
        // One branch is only the contact, so the other branch has no effect.
        steps.splice(at..=or, [IrStep { element: owner, op: IrOp::Load { bit, negated } }]);
        return true;
    }
    steps.insert(or + 1, IrStep { element: owner, op: IrOp::And { bit, negated } });
    for gone in [m, n] {
        let was_load = is_load(steps.get(gone));
        steps.remove(gone);
        if let (true, Some(IrStep { op, .. })) = (was_load, steps.get_mut(gone))
            && let IrOp::And { bit, negated } = *op
        {
            *op = IrOp::Load { bit, negated };
        }
    }
    true
}

/// How an operation accesses a bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BitAccess {
    Read,
    Written,
}

/// First certain access of an operation to a bit; a possible read counts as a read.
fn next_access(op: &IrOp, wanted: BitId) -> Option<BitAccess> {
    let reads = |read: &[BitId]| read.contains(&wanted).then_some(BitAccess::Read);
    match op {
        IrOp::Load { bit, .. } | IrOp::And { bit, .. } | IrOp::Or { bit, .. } => reads(&[*bit]),
        IrOp::Rising(bit) | IrOp::Falling(bit) => reads(&[*bit]),
        IrOp::Store { bit, .. } | IrOp::SetBit { bit, .. } => (*bit == wanted).then_some(BitAccess::Written),
        IrOp::Logic { dst, function: is } => {
            let read = match is {
                LogicOp::Copy(a) | LogicOp::Not(a) => reads(&[*a]),
                LogicOp::And(a, b) | LogicOp::Or(a, b) => reads(&[*a, *b]),
            };
            read.or((*dst == wanted).then_some(BitAccess::Written))
        }
        IrOp::If { cond, if_true: then, if_false: otherwise } => {
            let asked = matches!(cond, BranchCondition::Bit(bit) if *bit == wanted);
            let mut arms = [then, otherwise].map(|arm| arm.iter().find_map(|op| next_access(op, wanted)));
            if asked || arms.contains(&Some(BitAccess::Read)) {
                return Some(BitAccess::Read);
            }
            arms.sort_by_key(Option::is_some);
            arms[0]
        }
        IrOp::SetAccumulator(_) | IrOp::AndCompare(_) | IrOp::Receive { .. } | IrOp::Module { .. } => None,
        IrOp::Move { .. } | IrOp::Math { .. } | IrOp::Lookup { .. } | IrOp::ReadAdc { .. } | IrOp::SetPwm { .. } => {
            None
        }
        IrOp::Transfer { .. } | IrOp::WaitSent => None,
        IrOp::Send { .. } | IrOp::ReadEeprom { .. } | IrOp::WriteEeprom { .. } | IrOp::Label(_) => None,
        // It may be read where the jump goes.
        IrOp::Jump { .. } => Some(BitAccess::Read),
    }
}
