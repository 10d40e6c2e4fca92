//! A contact that parallel branches have in common is computed once.

use std::collections::HashSet;

use super::Later;
use crate::ir::{Bit, Cond, Ir, Logic, Op, Step};

/// Takes a contact that two branches have in common out of both: `load x; and a; store t; load x; and b; or t` is
/// `load a; store t; load b; or t; and x`.
pub(super) fn factor(ir: &mut Ir, temporary: &HashSet<Bit>) {
    let mut within = temporary.clone();
    for rung in &ir.rungs {
        let mut later = Later::behind_the_scan(ir);
        rung.steps.iter().rev().for_each(|step| _ = later.op(step.op.clone()));
        within.retain(|bit| later.dead_bits.contains(bit));
    }
    for rung in &mut ir.rungs {
        while (0..rung.steps.len()).any(|at| factor_at(&mut rung.steps, at, &within)) {}
    }
}

/// The same where the temporary is stored by step `at`; false where there is nothing to take out. The temporary must be
/// one that no rung reads before it has stored it (`within`), and must not be read again.
fn factor_at(steps: &mut Vec<Step>, at: usize, within: &HashSet<Bit>) -> bool {
    let Some(Step { op: Op::Store { bit: joined, negated: false }, .. }) = steps.get(at) else { return false };
    let joined = *joined;
    let contact = |step: &Step| match step.op {
        Op::Load { bit, negated } | Op::And { bit, negated } => Some((bit, negated)),
        _ => None,
    };
    let is_and = |step: &&Step| matches!(step.op, Op::And { .. });
    let is_load = |step: Option<&Step>| step.is_some_and(|step| matches!(step.op, Op::Load { .. }));
    // The second branch is `load; and; ..` up to the OR; of the first one the last ANDs count, and the load before them.
    let ands = steps.iter().skip(at + 2).take_while(is_and).count();
    let or = at + 2 + ands;
    let joins = |step: &Step| step.op == Op::Or { bit: joined, negated: false };
    let Some(owner) = steps.get(or).map(|step| step.at) else { return false };
    if !within.contains(&joined) || !is_load(steps.get(at + 1)) || !steps.get(or).is_some_and(joins) {
        return false;
    }
    if steps.iter().skip(or + 1).map(|step| &step.op).find_map(|op| next_access(op, joined)) == Some(Access::Read) {
        return false;
    }
    let before = steps.iter().take(at).rev().take_while(is_and).count();
    let first = at - before - usize::from(is_load(steps.get((at - before).wrapping_sub(1))));
    let common = (first..at).find_map(|n| {
        let factor = contact(steps.get(n)?).filter(|(bit, _)| *bit != joined)?;
        (at + 1..or).find(|&m| steps.get(m).and_then(contact) == Some(factor)).map(|m| (n, m, factor))
    });
    let Some((n, m, (bit, negated))) = common else { return false };
    let whole = first + 1 == at && is_load(steps.get(first)) || m == at + 1 && ands == 0;
    if whole {
        // One of the branches is the contact alone, which the other narrows in vain.
        steps.splice(at..=or, [Step { at: owner, op: Op::Load { bit, negated } }]);
        return true;
    }
    steps.insert(or + 1, Step { at: owner, op: Op::And { bit, negated } });
    for gone in [m, n] {
        let was_load = is_load(steps.get(gone));
        steps.remove(gone);
        if let (true, Some(Step { op, .. })) = (was_load, steps.get_mut(gone))
            && let Op::And { bit, negated } = *op
        {
            *op = Op::Load { bit, negated };
        }
    }
    true
}

/// How an operation deals with a bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Access {
    Read,
    Written,
}

/// The first thing that an operation surely does with a bit; an operation that may read it reads it.
fn next_access(op: &Op, wanted: Bit) -> Option<Access> {
    let reads = |read: &[Bit]| read.contains(&wanted).then_some(Access::Read);
    match op {
        Op::Load { bit, .. } | Op::And { bit, .. } | Op::Or { bit, .. } => reads(&[*bit]),
        Op::Rising(bit) | Op::Falling(bit) => reads(&[*bit]),
        Op::Store { bit, .. } | Op::Put { bit, .. } => (*bit == wanted).then_some(Access::Written),
        Op::Logic { dst, is } => {
            let read = match is {
                Logic::Copy(a) | Logic::Not(a) => reads(&[*a]),
                Logic::And(a, b) | Logic::Or(a, b) => reads(&[*a, *b]),
            };
            read.or((*dst == wanted).then_some(Access::Written))
        }
        Op::If { cond, then, otherwise } => {
            let asked = matches!(cond, Cond::Bit(bit) if *bit == wanted);
            let mut arms = [then, otherwise].map(|arm| arm.iter().find_map(|op| next_access(op, wanted)));
            if asked || arms.contains(&Some(Access::Read)) {
                return Some(Access::Read);
            }
            arms.sort_by_key(Option::is_some);
            arms[0]
        }
        Op::Acc(_) | Op::AndCompare(_) | Op::Receive { .. } | Op::Module { .. } => None,
        Op::Move { .. } | Op::Math { .. } | Op::Lookup { .. } | Op::ReadAdc { .. } | Op::SetPwm { .. } => None,
        Op::Send { .. } | Op::Recall { .. } | Op::Persist { .. } => None,
    }
}
