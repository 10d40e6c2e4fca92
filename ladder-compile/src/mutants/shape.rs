//! Faults of more than one operation: orders, aliasing, cells at the places of others.

use ladder::ElementId;

use super::cells::{Cell, Slot, Touched, each};
use super::{Candidate, Change, MutantKind, text};
use crate::ir::{BitRole, Cond, Ir, Op, Step, Value, WordRole};

/// All of them.
pub(super) fn candidates(ir: &Ir) -> Vec<Candidate<'_>> {
    let mut all = orders(ir);
    all.extend(rungs(ir));
    all.extend(aliases(ir));
    all.extend(states(ir));
    all
}

/// Neighbours that do not commute, swapped.
fn orders(ir: &Ir) -> Vec<Candidate<'_>> {
    let mut all = Vec::new();
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, pair) in rung.steps.windows(2).enumerate() {
            let [first, second] = pair else { continue };
            let commute = match (&first.op, &second.op) {
                (Op::And { .. } | Op::AndCompare(_), Op::And { .. } | Op::AndCompare(_)) => true,
                (Op::Or { .. }, Op::Or { .. }) => true,
                (one, other) => one == other || !Touched::of([one]).meets(&Touched::of([other])),
            };
            if commute {
                continue;
            }
            let make = move || {
                let mut changed = ir.clone();
                let steps = &mut changed.rungs[number].steps;
                (steps[at].op, steps[at + 1].op) = (second.op.clone(), first.op.clone());
                Change::Ir(changed)
            };
            let what = move || format!("`{}` comes behind `{}`", text(ir, &first.op), text(ir, &second.op));
            let (kind, element) = (MutantKind::Order, Some(first.at));
            all.push(Candidate { kind, element, what: Box::new(what), make: Box::new(make) });
        }
    }
    all
}

/// Neighbouring rungs that do not commute, swapped.
fn rungs(ir: &Ir) -> Vec<Candidate<'_>> {
    let touched: Vec<Touched> = ir
        .rungs
        .iter()
        .map(|rung| {
            let mut touched = Touched::of(rung.steps.iter().map(|step| &step.op));
            let passing = |cell: &Cell| match cell {
                Cell::Acc => true,
                Cell::Bit(bit) => ir.is_temporary(*bit),
                Cell::Word(_) | Cell::Part => false,
            };
            touched.reads.retain(|cell| !passing(cell));
            touched.writes.retain(|cell| !passing(cell));
            touched
        })
        .collect();
    let mut all = Vec::new();
    for (n, pair) in touched.windows(2).enumerate() {
        let [first, second] = pair else { continue };
        if !first.meets(second) {
            continue;
        }
        let make = move || {
            let mut changed = ir.clone();
            // Elements stay in their rungs, so that the map is whole.
            let moved = |from: usize, to: usize| -> Vec<Step> {
                let last = ir.rungs[to].elements.saturating_sub(1);
                let steps = ir.rungs[from].steps.iter();
                steps
                    .map(|step| {
                        let at = ElementId { rung: to as u32, index: step.at.index.min(last) };
                        Step { at, op: step.op.clone() }
                    })
                    .collect()
            };
            changed.rungs[n].steps = moved(n + 1, n);
            changed.rungs[n + 1].steps = moved(n, n + 1);
            Change::Ir(changed)
        };
        let what = move || format!("rungs {} and {} change places", n + 1, n + 2);
        all.push(Candidate { kind: MutantKind::Order, element: None, what: Box::new(what), make: Box::new(make) });
    }
    all
}

/// Destinations that are written before the operands are read, and rows of moves in the wrong order.
fn aliases(ir: &Ir) -> Vec<Candidate<'_>> {
    let mut all = Vec::new();
    for (number, rung) in ir.rungs.iter().enumerate() {
        for (at, step) in rung.steps.iter().enumerate() {
            let count = places(&step.op);
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
                    Change::Ir(changed)
                };
                let (kind, element) = (MutantKind::Aliasing, Some(step.at));
                all.push(Candidate { kind, element, what: Box::new(what), make: Box::new(make) });
            }
        }
    }
    all
}

/// Where this fault can be in `op`.
fn places(op: &Op) -> usize {
    let own = usize::from(own_alias(op).is_some());
    match op {
        Op::If { then, otherwise, .. } => own + then.iter().chain(otherwise).map(places).sum::<usize>(),
        _ => own,
    }
}

/// `op` with the fault at place `left`.
fn aliased(op: &Op, left: &mut usize) -> Option<Op> {
    if let Some(new) = own_alias(op) {
        if *left == 0 {
            return Some(new);
        }
        *left -= 1;
    }
    let Op::If { cond, then, otherwise } = op else { return None };
    let (mut then, mut otherwise) = (then.clone(), otherwise.clone());
    for inner in then.iter_mut().chain(otherwise.iter_mut()) {
        if let Some(new) = aliased(inner, left) {
            *inner = new;
            return Some(Op::If { cond: *cond, then, otherwise });
        }
    }
    None
}

fn own_alias(op: &Op) -> Option<Op> {
    match op {
        Op::Math { op, dst, a: Value::Cell(a), b: Value::Cell(b) } if a != b && (dst == a || dst == b) => {
            let other = if dst == a { *b } else { *a };
            let early = Op::Move { dst: *dst, src: Value::Cell(other) };
            let late = Op::Math { op: *op, dst: *dst, a: Value::Cell(*dst), b: Value::Cell(*dst) };
            Some(both(vec![early, late]))
        }
        Op::Lookup { dst, index, .. } if dst == index => {
            Some(both(vec![Op::Move { dst: *dst, src: Value::Const(0) }, op.clone()]))
        }
        // The stages of a shift register.
        Op::If { cond, then, otherwise } if then.len() > 1 && then.iter().all(|op| matches!(op, Op::Move { .. })) => {
            let then = then.iter().rev().cloned().collect();
            Some(Op::If { cond: *cond, then, otherwise: otherwise.clone() })
        }
        _ => None,
    }
}

/// Some operations as one.
fn both(ops: Vec<Op>) -> Op {
    Op::If { cond: Cond::Acc, then: ops.clone(), otherwise: ops }
}

/// Cells that the code keeps where the next one of the kind is.
fn states(ir: &Ir) -> Vec<Candidate<'_>> {
    let mut all = Vec::new();
    for (n, cell) in ir.bits.iter().enumerate().filter(|(_, cell)| cell.role != BitRole::Temporary) {
        let Some(other) = ir.bits.iter().skip(n + 1).position(|c| c.role == cell.role).map(|at| n + 1 + at) else {
            continue;
        };
        let make = move || {
            Change::Ir(renamed(ir, &mut |slot| {
                if let Slot::Bit(bit) = slot
                    && bit.0 as usize == n
                {
                    bit.0 = other as u32;
                }
            }))
        };
        all.push(moved(&cell.name, &ir.bits[other].name, Box::new(make)));
    }
    let sort = |role: WordRole| matches!(role, WordRole::Symbol(_));
    for (n, cell) in ir.words.iter().enumerate().filter(|(_, cell)| cell.role != WordRole::Temporary) {
        let same = |c: &crate::ir::WordCell| {
            sort(c.role) == sort(cell.role) && c.role != WordRole::Temporary && c.bytes == cell.bytes
        };
        let Some(other) = ir.words.iter().skip(n + 1).position(same).map(|at| n + 1 + at) else { continue };
        let make = move || {
            Change::Ir(renamed(ir, &mut |slot| {
                if let Slot::Word(word) = slot
                    && word.0 as usize == n
                {
                    word.0 = other as u32;
                }
            }))
        };
        all.push(moved(&cell.name, &ir.words[other].name, Box::new(make)));
    }
    all
}

fn moved<'a>(name: &'a str, other: &'a str, make: Box<dyn Fn() -> Change + 'a>) -> Candidate<'a> {
    let what = Box::new(move || format!("{name} is kept where {other} is"));
    Candidate { kind: MutantKind::State, element: None, what, make }
}

fn renamed(ir: &Ir, rename: &mut dyn FnMut(Slot<'_>)) -> Ir {
    let mut changed = ir.clone();
    let steps = changed.rungs.iter_mut().flat_map(|rung| &mut rung.steps).map(|step| &mut step.op);
    let around = changed.begin.iter_mut().chain(&mut changed.end);
    steps.chain(around).for_each(|op| each(op, &mut |slot, _| rename(slot)));
    changed
}
