//! Faults that involve several operations: wrong order, aliasing, swapped cells.

use ladder::ElementId;

use super::accessed_cells::{AccessedCell, CellAccesses, CellSlot, for_each_cell};
use super::{MutantCandidate, MutantChange, MutantKind, text};
use crate::ir::{BitRole, BranchCondition, Ir, IrOp, IrStep, WordOperand, WordRole};

/// All faults of this kind.
pub(super) fn shape_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let mut all = order_candidates(ir);
    all.extend(rung_order_candidates(ir));
    all.extend(alias_candidates(ir));
    all.extend(state_candidates(ir));
    all
}

/// Swaps neighbouring operations that do not commute.
fn order_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let mut all = Vec::new();
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, pair) in rung.steps.windows(2).enumerate() {
            let [first, second] = pair else { continue };
            let commute = match (&first.op, &second.op) {
                (IrOp::And { .. } | IrOp::AndCompare(_), IrOp::And { .. } | IrOp::AndCompare(_)) => true,
                (IrOp::Or { .. }, IrOp::Or { .. }) => true,
                (one, other) => one == other || !CellAccesses::of([one]).conflicts_with(&CellAccesses::of([other])),
            };
            if commute {
                continue;
            }
            let make = move || {
                let mut changed = ir.clone();
                let steps = &mut changed.rungs[number].steps;
                (steps[at].op, steps[at + 1].op) = (second.op.clone(), first.op.clone());
                MutantChange::Ir(Box::new(changed))
            };
            let what = move || format!("`{}` comes behind `{}`", text(ir, &first.op), text(ir, &second.op));
            let (kind, element) = (MutantKind::Order, Some(first.element));
            all.push(MutantCandidate { kind, element, describe: Box::new(what), make_change: Box::new(make) });
        }
    }
    all
}

/// Swaps neighbouring rungs that do not commute.
fn rung_order_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let touched: Vec<CellAccesses> = ir
        .rungs
        .iter()
        .map(|rung| {
            let mut touched = CellAccesses::of(rung.steps.iter().map(|step| &step.op));
            let passing = |cell: &AccessedCell| match cell {
                AccessedCell::Acc => true,
                AccessedCell::Bit(bit) => ir.is_temporary(*bit),
                AccessedCell::Word(_) | AccessedCell::Peripheral => false,
            };
            touched.reads.retain(|cell| !passing(cell));
            touched.writes.retain(|cell| !passing(cell));
            touched
        })
        .collect();
    let mut all = Vec::new();
    for (n, pair) in touched.windows(2).enumerate() {
        let [first, second] = pair else { continue };
        if !first.conflicts_with(second) {
            continue;
        }
        let make = move || {
            let mut changed = ir.clone();
            // Elements stay in their rungs, so that the map is complete.
            let moved = |from: usize, to: usize| -> Vec<IrStep> {
                let last = ir.rungs[to].element_count.saturating_sub(1);
                let steps = ir.rungs[from].steps.iter();
                steps
                    .map(|step| {
                        let at = ElementId { rung: to as u32, index: step.element.index.min(last) };
                        IrStep { element: at, op: step.op.clone() }
                    })
                    .collect()
            };
            changed.rungs[n].steps = moved(n + 1, n);
            changed.rungs[n + 1].steps = moved(n, n + 1);
            MutantChange::Ir(Box::new(changed))
        };
        let what = move || format!("rungs {} and {} change places", n + 1, n + 2);
        all.push(MutantCandidate {
            kind: MutantKind::Order,
            element: None,
            describe: Box::new(what),
            make_change: Box::new(make),
        });
    }
    all
}

/// Writes destinations before operands are read, and reverses sequences of moves.
fn alias_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let mut all = Vec::new();
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, step) in rung.steps.iter().enumerate() {
            let count = count_alias_places(&step.op);
            for n in 0..count {
                let mut left = n;
                let Some(new) = aliased(&step.op, &mut left) else { continue };
                let what = move || format!("`{}` becomes `{}`", text(ir, &step.op), text(ir, &new));
                let make = move || {
                    let mut changed = ir.clone();
                    let mut left = n;
                    if let Some(op) = aliased(&step.op, &mut left) {
                        changed.rungs[number].steps[at].op = op;
                    }
                    MutantChange::Ir(Box::new(changed))
                };
                let (kind, element) = (MutantKind::Aliasing, Some(step.element));
                all.push(MutantCandidate { kind, element, describe: Box::new(what), make_change: Box::new(make) });
            }
        }
    }
    all
}

/// Number of places in `op` where an aliasing fault is possible.
fn count_alias_places(op: &IrOp) -> usize {
    let own = usize::from(own_alias(op).is_some());
    match op {
        IrOp::If { if_true: then, if_false: otherwise, .. } => {
            own + then.iter().chain(otherwise).map(count_alias_places).sum::<usize>()
        }
        _ => own,
    }
}

/// `op` with the fault at place `left`.
fn aliased(op: &IrOp, left: &mut usize) -> Option<IrOp> {
    if let Some(new) = own_alias(op) {
        if *left == 0 {
            return Some(new);
        }
        *left -= 1;
    }
    let IrOp::If { cond, if_true: then, if_false: otherwise } = op else { return None };
    let (mut then, mut otherwise) = (then.clone(), otherwise.clone());
    for inner in then.iter_mut().chain(otherwise.iter_mut()) {
        if let Some(new) = aliased(inner, left) {
            *inner = new;
            return Some(IrOp::If { cond: *cond, if_true: then, if_false: otherwise });
        }
    }
    None
}

fn own_alias(op: &IrOp) -> Option<IrOp> {
    match op {
        IrOp::Math { op, dst, a: WordOperand::Cell(a), b: WordOperand::Cell(b) }
            if a != b && (dst == a || dst == b) =>
        {
            let other = if dst == a { *b } else { *a };
            let early = IrOp::Move { dst: *dst, src: WordOperand::Cell(other) };
            let late = IrOp::Math { op: *op, dst: *dst, a: WordOperand::Cell(*dst), b: WordOperand::Cell(*dst) };
            Some(sequence(vec![early, late]))
        }
        IrOp::Lookup { dst, index, .. } if dst == index => {
            Some(sequence(vec![IrOp::Move { dst: *dst, src: WordOperand::Const(0) }, op.clone()]))
        }
        // The stages of a shift register.
        IrOp::If { cond, if_true: then, if_false: otherwise }
            if then.len() > 1 && then.iter().all(|op| matches!(op, IrOp::Move { .. })) =>
        {
            let then = then.iter().rev().cloned().collect();
            Some(IrOp::If { cond: *cond, if_true: then, if_false: otherwise.clone() })
        }
        _ => None,
    }
}

/// Combines several operations into one.
fn sequence(ops: Vec<IrOp>) -> IrOp {
    IrOp::If { cond: BranchCondition::Acc, if_true: ops.clone(), if_false: ops }
}

/// Places a cell where the next cell of the same kind is.
fn state_candidates(ir: &Ir) -> Vec<MutantCandidate<'_>> {
    let mut all = Vec::new();
    for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role != BitRole::Temporary) {
        let Some(other) = ir.bits.iter().skip(n + 1).position(|c| c.role == cell.role).map(|at| n + 1 + at) else {
            continue;
        };
        let make = move || {
            MutantChange::Ir(Box::new(rename_cells(ir, &mut |slot| {
                if let CellSlot::Bit(bit) = slot
                    && bit.0 as usize == n
                {
                    bit.0 = other as u32;
                }
            })))
        };
        all.push(moved_cell_candidate(&cell.name, &ir.bits[other].name, Box::new(make)));
    }
    let sort = |role: WordRole| matches!(role, WordRole::Symbol(_));
    for (n, cell) in ir.words.iter().enumerate().filter(|(_, cell)| cell.role != WordRole::Temporary) {
        let same = |c: &crate::ir::WordCell| {
            sort(c.role) == sort(cell.role) && c.role != WordRole::Temporary && c.bytes == cell.bytes
        };
        let Some(other) = ir.words.iter().skip(n + 1).position(same).map(|at| n + 1 + at) else { continue };
        let make = move || {
            MutantChange::Ir(Box::new(rename_cells(ir, &mut |slot| {
                if let CellSlot::Word(word) = slot
                    && word.0 as usize == n
                {
                    word.0 = other as u32;
                }
            })))
        };
        all.push(moved_cell_candidate(&cell.name, &ir.words[other].name, Box::new(make)));
    }
    all
}

fn moved_cell_candidate<'a>(
    name: &'a str,
    other: &'a str,
    make: Box<dyn Fn() -> MutantChange + 'a>,
) -> MutantCandidate<'a> {
    let what = Box::new(move || format!("{name} is kept where {other} is"));
    MutantCandidate { kind: MutantKind::State, element: None, describe: what, make_change: make }
}

fn rename_cells(ir: &Ir, rename: &mut dyn FnMut(CellSlot<'_>)) -> Ir {
    let mut changed = ir.clone();
    let steps = changed.rungs.iter_mut().flat_map(|rung| &mut rung.steps).map(|step| &mut step.op);
    let around = changed.prologue.iter_mut().chain(&mut changed.epilogue);
    steps.chain(around).for_each(|op| for_each_cell(op, &mut |slot, _| rename(slot)));
    changed
}
