//! Adds jumps and subprograms to a random program, so that its rungs are executed in another order.

use diag::Pos;
use emu_core::rng::Rng;
use ladder::{Element, FlowOp, Rung, RungNode};

/// Adds some jumps and, if `full`, jumps back and a subprogram. `inputs` are names for conditions, at least
/// one.
pub(super) fn add_flow(rng: &mut Rng, rungs: &mut Vec<Rung>, inputs: &[String], full: bool) {
    let body = if full && rng.one_in(2) { add_subprogram(rng, rungs, inputs) } else { 0..0 };
    for jump in 0..rng.below(3) {
        let from = rng.below(rungs.len() as u64) as usize;
        let to = rng.below(rungs.len() as u64 + 1) as usize;
        // SUBPROG and ENDSUB are alone in their rungs, and a jump stays on its side of them.
        let ends = body.clone().next().into_iter().chain(body.clone().last());
        if ends.into_iter().any(|end| end == from) || body.contains(&from) != (body.contains(&to) && to != body.start) {
            continue;
        }
        if to <= from && (!full || rng.one_in(2)) {
            continue;
        }
        // Numbers would change when rungs are added or removed; beyond the last rung is the end.
        let label = if to == rungs.len() {
            "9999".to_owned()
        } else if to == body.start && !body.is_empty() || to + 1 == body.end {
            continue;
        } else {
            let name = format!("l{jump}_{to}");
            insert(rng, &mut rungs[to].series, vec![flow(FlowOp::Label, &name)]);
            name
        };
        let condition = contact(rng, inputs);
        insert(rng, &mut rungs[from].series, vec![condition, flow(FlowOp::Goto, &label)]);
    }
}

/// Makes a subprogram of some rungs and calls it; returns its rungs.
fn add_subprogram(rng: &mut Rng, rungs: &mut Vec<Rung>, inputs: &[String]) -> std::ops::Range<usize> {
    if rungs.len() < 2 {
        return 0..0;
    }
    let first = rng.below(rungs.len() as u64) as usize;
    let count = (1 + rng.below(3) as usize).min(rungs.len() - first).min(rungs.len() - 1);
    for _ in 0..1 + rng.below(3) {
        let caller = rng.below((rungs.len() - count) as u64) as usize;
        let caller = if caller < first { caller } else { caller + count };
        insert(rng, &mut rungs[caller].series, vec![flow(FlowOp::Gosub, "s")]);
    }
    if rng.one_in(2) {
        let condition = contact(rng, inputs);
        insert(rng, &mut rungs[first].series, vec![condition, RungNode::Leaf(Element::Return, Pos::default())]);
    }
    let alone = |op| Rung { series: vec![flow(op, "s")], pos: Pos::default() };
    rungs.insert(first + count, alone(FlowOp::EndSubprogram));
    rungs.insert(first, alone(FlowOp::Subprogram));
    first..first + count + 2
}

fn flow(op: FlowOp, label: &str) -> RungNode {
    RungNode::Leaf(Element::Flow { op, label: label.to_owned() }, Pos::default())
}

fn contact(rng: &mut Rng, names: &[String]) -> RungNode {
    let name = names[rng.below(names.len() as u64) as usize].clone();
    RungNode::Leaf(Element::Contacts { name, negated: rng.one_in(2), set1: None }, Pos::default())
}

/// Inserts nodes somewhere in a series, or in a branch of one of its groups.
fn insert(rng: &mut Rng, series: &mut Vec<RungNode>, nodes: Vec<RungNode>) {
    let groups = series.iter_mut().filter_map(|node| match node {
        RungNode::Parallel(branches, _) => Some(branches),
        RungNode::Leaf(..) => None,
    });
    if let Some(branches) = groups.last().filter(|_| rng.one_in(2)) {
        let branch = rng.below(branches.len() as u64) as usize;
        return insert(rng, &mut branches[branch], nodes);
    }
    let at = rng.below(series.len() as u64 + 1) as usize;
    series.splice(at..at, nodes);
}
