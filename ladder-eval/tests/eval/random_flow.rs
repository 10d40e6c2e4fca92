//! Puts jumps and subprograms into random programs.

use ladder::{Element, FlowOp, RungNode};

use crate::common::model::{contacts, leaf};

/// Numbers that follow from a seed.
struct Draw(u64);

impl Draw {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % limit as u64) as usize
    }
}

/// Adds up to two subprograms, of which the first may call the second, and some jumps.
pub fn with_flow(mut rungs: Vec<Vec<RungNode>>, seed: u64) -> Vec<Vec<RungNode>> {
    let mut draw = Draw(seed);
    // Bounds of the bodies, with the rungs of SUBPROG and ENDSUB.
    let mut bodies: Vec<(usize, usize)> = Vec::new();
    for name in ["s", "t"].into_iter().take(draw.below(3)) {
        let first = rungs.len();
        rungs.push(vec![flow(FlowOp::Subprogram, name)]);
        (0..1 + draw.below(2)).for_each(|_| rungs.push(vec![leaf(contacts("Xa", false)), leaf(Element::Osc)]));
        rungs.push(vec![flow(FlowOp::EndSubprogram, name)]);
        bodies.push((first, rungs.len() - 1));
    }
    // The main program may also go on below.
    rungs.push(vec![leaf(contacts("Xb", false)), leaf(Element::Osr)]);
    let around = |rung: usize| bodies.iter().position(|body| body.0 < rung && rung <= body.1);
    let is_end = |rung: usize| bodies.iter().any(|body| body.0 == rung || body.1 == rung);
    for number in 0..draw.below(6) {
        let (from, to) = (draw.below(rungs.len()), draw.below(rungs.len() + 1));
        if is_end(from) {
            continue;
        }
        let mut nodes = vec![leaf(contacts(["Xa", "Xb", "Ra"][draw.below(3)], draw.below(2) == 0))];
        match draw.below(4) {
            0 if !bodies.is_empty() && around(from).is_none() => {
                nodes.push(flow(FlowOp::Gosub, ["s", "t"][draw.below(bodies.len())]));
            }
            1 if bodies.len() == 2 && around(from) == Some(0) => nodes.push(flow(FlowOp::Gosub, "t")),
            2 if around(from).is_some() || draw.below(4) == 0 => nodes.push(leaf(Element::Return)),
            _ if around(from) == around(to) && (draw.below(2) == 0 || to >= rungs.len() || is_end(to)) => {
                nodes.push(flow(FlowOp::Goto, &(to + 1).to_string()));
            }
            _ if around(from) == around(to) => {
                let name = format!("l{number}");
                insert(&mut draw, &mut rungs[to], vec![flow(FlowOp::Label, &name)]);
                nodes.push(flow(FlowOp::Goto, &name));
            }
            _ => {}
        }
        insert(&mut draw, &mut rungs[from], nodes);
    }
    rungs
}

fn flow(op: FlowOp, label: &str) -> RungNode {
    leaf(Element::Flow { op, label: label.to_owned() })
}

fn insert(draw: &mut Draw, series: &mut Vec<RungNode>, nodes: Vec<RungNode>) {
    if let Some(RungNode::Parallel(branches, _)) = series.last_mut()
        && draw.below(2) == 0
    {
        let branch = draw.below(branches.len());
        return insert(draw, &mut branches[branch], nodes);
    }
    let at = draw.below(series.len() + 1);
    series.splice(at..at, nodes);
}
